"""The command that goes down the tail of the onset stress."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from stiction.cli.common import StudyFile, Workers, echo, writable_folder
from stiction.errors import InputError


def reliability(
    study: StudyFile,
    out: Annotated[Path, typer.Option(help="Folder for table, data and figures.")] = Path(
        "stiction-reliability"
    ),
    stress: Annotated[
        float | None,
        typer.Option(help="Also: probability of sliding below this stress, Pa.", min=0.0),
    ] = None,
    probability: Annotated[
        float | None, typer.Option(help="Also: stress with this failure probability.")
    ] = None,
    smallest: Annotated[
        float, typer.Option(help="Probability down to which the curve goes.")
    ] = 1e-9,
    target_cv: Annotated[
        float, typer.Option(help="Coefficient of variation at the smallest probability.")
    ] = 0.3,
    workers: Workers = None,
    max_evaluations: Annotated[
        int | None, typer.Option(help="Most samples to solve for the curve, and for each answer.")
    ] = None,
) -> None:
    """Failure probability of a study's interface, decade by decade.

    Problem, strength, method and seed come from the study file; its number of samples does not
    matter here. Prints the curve and writes `failure_curve.csv`, `failure_curve.nc` and a figure
    (PNG and PDF) into a folder. The stress is the mean shear stress on the interface, and failure
    means that the interface as a whole slides below it.
    """
    from stiction import plot
    from stiction.plot.style import save_figure
    from stiction.reliability.curve import failure_curve
    from stiction.reliability.failure import design_stress, failure_probability
    from stiction.study.export import write_result
    from stiction.study.study import Study

    loaded = Study.from_toml(study)
    if loaded.sweep:
        keys = ", ".join(key for axis in loaded.sweep for key in axis.keys)
        raise InputError(
            f"sweep: `stiction reliability` takes one interface, and {study} sweeps {keys}; give"
            " the point you mean its values and take [[sweep]] out, or call st.failure_curve for"
            " each point in Python"
        )
    # What is asked for last is refused first: the curve may take minutes.
    if probability is not None and not 0.0 < probability < 1.0:
        raise InputError(f"--probability: must lie between 0 and 1, got {probability}")
    writable_folder(out)
    given = loaded.problem, loaded.random
    options: dict[str, Any] = {
        "method": loaded.method,
        "seed": loaded.ensemble.seed,
        "workers": workers,
        "max_evaluations": max_evaluations,
    }
    curve = failure_curve(*given, smallest=smallest, target_cv=target_cv, **options)
    write_result(curve, out / "failure_curve.nc")
    table = curve.reset_coords().to_dataframe()
    table.to_csv(out / "failure_curve.csv", index=False)
    figure = plot.failure_curve(curve).figure
    for ending in ("png", "pdf"):
        save_figure(figure, out / f"failure_curve.{ending}")
    echo(table.to_string(index=False, float_format="{:.7g}".format))
    if stress is not None:
        echo(failure_probability(*given, stress, **options))
    if probability is not None:
        echo(design_stress(*given, probability=probability, **options))
    echo(f"written to {out}")

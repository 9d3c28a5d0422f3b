"""The command that goes down the tail."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from stiction.cli.common import StudyFile, Workers, echo, writable_folder
from stiction.errors import InputError


def _say(text: str) -> None:
    """What is being done, for who watches a terminal."""
    if sys.stderr.isatty():
        echo(text, err=True)


def reliability(
    study: StudyFile,
    out: Annotated[Path, typer.Option(help="Folder for table, data and figures.")] = Path(
        "stiction-reliability"
    ),
    stress: Annotated[
        float | None, typer.Option(help="Also: probability of letting go below this stress, Pa.")
    ] = None,
    probability: Annotated[
        float | None, typer.Option(help="Also: stress with this failure probability.")
    ] = None,
    smallest: Annotated[float, typer.Option(help="Probability down to which the curve goes.")] = (
        1e-9
    ),
    target_cov: Annotated[
        float, typer.Option(help="Coefficient of variation at the smallest probability.")
    ] = 0.3,
    plain_samples: Annotated[
        int, typer.Option(help="Samples of plain Monte Carlo beside it; 0 for none.")
    ] = 10_000,
    tails: Annotated[
        bool,
        typer.Option("--tails", help="Also: other correlation lengths, lengths, distributions."),
    ] = False,
    workers: Workers = None,
) -> None:
    """Failure probability of a study's interface, decade by decade.

    Problem, strength, method and seed come from the study file; its number of samples does not
    matter here. Prints the curve and writes `failure_curve.csv`, `failure_curve.nc` and the
    figures (PNG and PDF) into a folder.

    The stress is the mean shear stress on the interface, and failure means that the interface as
    a whole lets go below it.
    """
    from stiction.reliability.curve import failure_curve
    from stiction.reliability.design import check_probability, design_stress
    from stiction.reliability.estimate import check_stress, failure_probability
    from stiction.reliability.tails import tail_study
    from stiction.report import reliability_figures as figures
    from stiction.report.style import save_figure
    from stiction.runs import write_result
    from stiction.study import Study

    loaded = Study.from_toml(study)
    problem, field, method = loaded.problem, loaded.strength, loaded.method
    seed = loaded.ensemble.seed
    others: dict[str, Any] = {
        "residual_strength": loaded.residual_strength,
        "initial_stress": loaded.initial_stress,
        "weakening_rate": loaded.weakening_rate,
    }
    # What is asked for last is refused first: the curve may take minutes.
    mistakes = [] if stress is None else check_stress("--stress", stress)
    mistakes += [] if probability is None else check_probability("--probability", probability)
    if mistakes:
        raise InputError(mistakes)
    writable_folder(out)

    def save(figure: Any, name: str) -> None:
        for ending in ("png", "pdf"):
            save_figure(figure, out / f"{name}.{ending}")

    _say(f"the curve down to P = {smallest:g}, by {method.type} ...")
    curve = failure_curve(
        problem,
        field,
        method=method,
        smallest=smallest,
        target_cov=target_cov,
        plain_samples=plain_samples,
        seed=seed,
        workers=workers,
        **others,
    )
    write_result(curve, out / "failure_curve.nc")
    table = figures.curve_table(curve)
    table.write_csv(out)
    save(figures.curve_figure(curve), "failure_curve")
    cells = [list(table.columns), *table.cells()]
    for row, value in zip(cells[1:], curve["stress"].values, strict=True):
        row[0] = f"{value:.7g}"  # near the bound five digits do not tell the points apart
    widths = [max(len(row[i]) for row in cells) for i in range(len(table.columns))]
    for row in cells:
        line = "  ".join(f"{cell:>{width}}" for cell, width in zip(row, widths, strict=True))
        echo(line)
    echo(
        f"bound {curve.attrs['lower_bound']:.7g} Pa; {curve.attrs['evaluations']} evaluations;"
        f" {method.type}, {curve.attrs['event']}"
    )
    if stress is not None:
        _say(f"the probability below {stress:g} Pa ...")
        found = failure_probability(
            problem, field, stress, method=method, seed=seed, workers=workers, **others
        )
        echo(f"{found}\n  {found.algorithm}: {found.reason}")
        if found.failing_profiles.sizes and problem.friction.weakening_rate is not None:
            spot = figures.weak_spot_figure(
                found.failing_profiles, problem.nucleation_length, stress
            )
            save(spot, "weak_spots")
    if probability is not None:
        _say(f"the stress with P = {probability:g} ...")
        answer = design_stress(
            problem,
            field,
            probability=probability,
            method=method,
            seed=seed,
            workers=workers,
            **others,
        )
        echo(str(answer))
    if tails:
        _say("seven more curves: correlation lengths, interface lengths, distributions ...")
        several = tail_study(
            problem,
            field,
            method=method,
            smallest=smallest,
            target_cov=target_cov,
            plain_samples=plain_samples,
            seed=seed,
            workers=workers,
            **others,
        )
        figures.tail_table(several).write_csv(out)
        save(figures.tail_figure(several), "failure_tails")
    echo(f"written to {out}")

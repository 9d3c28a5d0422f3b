"""The command that goes down the tail."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from stiction.cli.common import StudyFile, TimeLimit, Workers, echo, writable_folder
from stiction.errors import InputError
from stiction.progress import Meter

Event = Literal["critical_stress", "first_instability"]


def _one_interface(study: Any, path: Path) -> None:
    """Refuse a sweep: which of its points is meant cannot be guessed."""
    if not study.sweep:
        return
    keys = ", ".join(key for axis in study.sweep for key in axis.keys)
    raise InputError(
        f"sweep: `stiction reliability` takes one interface, and {path} sweeps {keys} over"
        f" {len(study.points)} points; give the point you mean its values in the study and take"
        " [[sweep]] out, or call st.failure_curve for each point in Python"
    )


def _both(answers: Mapping[Event, Any], value: Callable[[Any], float]) -> None:
    """Print an answer for the interface as a whole and, where it differs, for its first patch."""
    whole, first = answers["critical_stress"], answers.get("first_instability")
    if first is None:
        echo(str(whole))
        return
    if f"{value(first):.3g}" == f"{value(whole):.3g}":
        echo(f"{whole}\n  to three digits the same for the first instability")
        return
    echo(f"as a whole:        {whole}")
    echo(f"first instability: {first}")
    echo(
        "  the first patch becomes unstable, arrested or not, before the interface slides as a"
        " whole or just then:\n  the first instability is the conservative answer"
    )


COLUMNS = (
    "stress",
    "friction_coefficient",
    "probability",
    "probability_low",
    "probability_high",
    "coefficient_of_variation",
    "plain_probability",
    "rice_probability",
)


def reliability(
    study: StudyFile,
    out: Annotated[Path, typer.Option(help="Folder for table, data and figures.")] = Path(
        "stiction-reliability"
    ),
    stress: Annotated[
        float | None, typer.Option(help="Also: probability of letting go below this stress, Pa.")
    ] = None,
    friction_coefficient: Annotated[
        float | None,
        typer.Option(
            help="Instead of --stress: mean shear stress over mean normal pressure. Needs a"
            " normal pressure."
        ),
    ] = None,
    probability: Annotated[
        float | None, typer.Option(help="Also: stress with this failure probability.")
    ] = None,
    smallest: Annotated[float, typer.Option(help="Probability down to which the curve goes.")] = (
        1e-9
    ),
    target_cv: Annotated[
        float, typer.Option(help="Coefficient of variation at the smallest probability.")
    ] = 0.3,
    plain_samples: Annotated[
        int, typer.Option(help="Samples of plain Monte Carlo beside it; 0 for none.")
    ] = 10_000,
    event: Annotated[
        Event,
        typer.Option(
            help="What the curve counts: 'critical_stress', letting go as a whole, or"
            " 'first_instability'. --stress, --friction-coefficient and --probability say both."
        ),
    ] = "critical_stress",
    workers: Workers = None,
    time_limit: TimeLimit = None,
) -> None:
    """Failure probability of a study's interface, decade by decade.

    Problem, strength, method and seed come from the study file; its number of samples does not
    matter here. Prints the curve and writes `failure_curve.csv`, `failure_curve.nc` and the
    figures (PNG and PDF) into a folder.

    The stress is the mean shear stress on the interface, and failure means that the interface as
    a whole slides below it; with --event first_instability, that its first patch does,
    arrested or not, which is never later. With a normal pressure in the study the curve is
    given in friction coefficients too, stress over mean pressure; where the pressure is random,
    --friction-coefficient counts each sample's own. The time limit holds for the curve and each
    answer.
    """
    from stiction import plot
    from stiction.export import write_result
    from stiction.plot.style import save_figure
    from stiction.random.random_interface import as_random_interface
    from stiction.reliability.curve import failure_curve
    from stiction.reliability.design import check_probability, design_stress
    from stiction.reliability.estimate import (
        check_coefficient,
        check_stress,
        failure_probability,
    )
    from stiction.reliability.limit_state import mean_pressure
    from stiction.reliability.result import bounded
    from stiction.study.study import Study

    loaded = Study.from_toml(study)
    _one_interface(loaded, study)
    problem, random, method = loaded.problem, loaded.random, loaded.method
    seed = loaded.ensemble.seed
    others: dict[str, Any] = {"workers": workers, "time_limit": time_limit}
    # Without arrest the first unstable patch is the whole interface.
    events: list[Event] = ["critical_stress"]
    if "arrested_events" in method.variables(problem):
        events.append("first_instability")
    # What is asked for last is refused first: the curve may take minutes.
    mistakes = [] if stress is None else check_stress("--stress", stress)
    if friction_coefficient is not None:
        mistakes += check_coefficient("--friction-coefficient", friction_coefficient)
        if stress is not None:
            mistakes.append("--friction-coefficient: give it or --stress, not both")
        if not mean_pressure(problem, as_random_interface(random)) > 0.0:
            mistakes.append(
                "--friction-coefficient: the study has no normal pressure; give"
                " problem.load.normal_pressure (Pa) or [random.normal_pressure], or ask by --stress"
            )
    mistakes += [] if probability is None else check_probability("--probability", probability)
    if mistakes:
        raise InputError(mistakes)
    writable_folder(out)

    def save(figure: Any, name: str) -> None:
        with Meter(f"drawing {name}"):
            for ending in ("png", "pdf"):
                save_figure(figure, out / f"{name}.{ending}")

    curve = failure_curve(
        problem,
        random,
        method=method,
        smallest=smallest,
        target_cv=target_cv,
        plain_samples=plain_samples,
        seed=seed,
        event=event,
        **others,
    )
    write_result(curve, out / "failure_curve.nc")
    table = curve.reset_coords().to_dataframe()[[name for name in COLUMNS if name in curve]]
    table.to_csv(out / "failure_curve.csv", index=False)
    save(plot.failure_curve(curve).figure, "failure_curve")
    echo(table.to_string(index=False, float_format="{:.7g}".format))
    lowest = curve.attrs["lower_bound"]
    bound = f"bound {lowest:.7g} Pa; " if bounded(lowest) else ""
    echo(f"{bound}{curve.attrs['evaluations']} evaluations; {method.label}, {curve.attrs['event']}")
    if stress is not None or friction_coefficient is not None:
        probabilities = {
            event: failure_probability(
                problem,
                random,
                stress,
                friction_coefficient=friction_coefficient,
                method=method,
                seed=seed,
                event=event,
                **others,
            )
            for event in events
        }
        _both(probabilities, lambda answer: answer.probability)
        found = probabilities["critical_stress"]
        echo(f"  {found.algorithm}: {found.reason}")
        if found.failing_profiles.sizes and problem.friction.weakening_rate is not None:
            save(plot.weak_spots(found, problem=problem).figure, "weak_spots")
    if probability is not None:
        stresses = {
            event: design_stress(
                problem,
                random,
                probability=probability,
                method=method,
                seed=seed,
                event=event,
                **others,
            )
            for event in events
        }
        _both(stresses, lambda answer: answer.stress)
    echo(f"written to {out}")

"""Commands on study files that compute next to nothing: check, schema."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Annotated, Any

import numpy as np
import typer

from stiction.cli.common import StudyFile, echo, size
from stiction.errors import InputError
from stiction.progress import Meter, duration

PROBED = 5
"""Points of a sweep at which samples are timed."""
BUDGET = 2.0
"""Seconds that the timing may take, apart from preparation and compilation."""

Lines = list[tuple[str, str]]


def check(
    study: StudyFile,
    probe: Annotated[
        bool,
        typer.Option(
            help="Solve a few samples: for the time a study takes, and for the error of the local"
            " criterion."
        ),
    ] = True,
) -> None:
    """Say what a study file would do, how long and how big, or everything that is wrong with it."""
    from stiction.study.study import Study

    loaded = Study.from_toml(study)
    echo(f"{study}: valid" + (f", {loaded.title!r}" if loaded.title else ""))
    lines = _description(loaded)
    if probe:
        with Meter("timing a few samples"):
            lines += _cost(loaded) + _methods(loaded.experiments[0])
    for name, text in lines:
        echo(f"  {name:20s} {text}")


def _description(study: Any) -> Lines:
    points, ensemble = study.experiments, study.ensemble
    samples = f"{ensemble.samples} (seed {ensemble.seed})"
    if study.sweep:
        samples += f" at each of {len(points)} points: {len(points) * ensemble.samples} in all"
    labels = dict.fromkeys(point.method.label for point in points)
    lines = [("method", ", ".join(labels)), ("samples", samples)]
    for axis in study.axes:
        keys = " with ".join(variable.long_name for _, variable in axis.coordinates.values())
        values = next(iter(axis.coordinates.values()))[0]
        lines.append(("sweep", f"{keys}: {axis.size} values, {values[0]} to {values[-1]}"))
    problems = [point.problem for point in points]
    lines.append(("effective modulus", _range((p.effective_modulus for p in problems), "Pa")))
    fields = [point.random.strength for point in points]
    unit = "Pa" if fields[0].of is None else "(friction coefficient)"
    means = _range((field.mean for field in fields), unit)
    deviations = _range((field.standard_deviation for field in fields), unit)
    pairs = zip(fields, problems, strict=True)
    modes = _range((field.modes(p.interface).count for field, p in pairs), "modes")
    lines.append(("strength", f"mean {means}, standard deviation {deviations}, {modes}"))
    efolding = _range((field.efolding_length() for field in set(fields)), "m")
    lines.append(("correlation 1/e at", f"{efolding} (of the strength)"))
    lines += _lengths(problems, fields)
    if points[0].wide:
        chosen = "all" if ensemble.keep_samples is None else str(len(ensemble.keep_samples))
        lines.append(("kept", f"{', '.join(points[0].wide)} of {chosen} samples"))
    return lines


def _range(given: Iterable[float], unit: str) -> str:
    values = list(given)
    low, high = min(values), max(values)
    text = f"{low:.6g}" if low == high else f"{low:.4g} to {high:.4g}"
    return f"{text} {unit}"


def _lengths(problems: Sequence[Any], fields: Sequence[Any]) -> Lines:
    """Nodes, interface and correlation length in nucleation lengths."""
    try:
        lengths = [problem.nucleation_length for problem in problems]
    except InputError:
        return [("nucleation length", "varies along the interface")]
    nodes = _range((min(p.nodes_in_nucleation_length(p.uniform_rate)) for p in problems), "nodes")
    axes = range(min(len(problem.interface.lengths) for problem in problems))
    pairs = list(zip(problems, lengths, strict=True))
    ratio = " x ".join(
        _range((problem.interface.lengths[i] / h_n for problem, h_n in pairs), "h_n") for i in axes
    )
    lines = [("nucleation length", f"{_range(lengths, 'm')}: {nodes}, L = {ratio}")]
    spectra = [(field.spectrum, h_n) for field, h_n in zip(fields, lengths, strict=True)]
    if all(hasattr(spectrum, "correlation_length") for spectrum, _ in spectra):
        ratios = (spectrum.correlation_length / h_n for spectrum, h_n in spectra)
        lines.append(("xi_0 / h_n", _range(ratios, "").rstrip()))
    return lines


def _methods(experiment: Any) -> Lines:
    """Which methods take the first point, and how far the local criterion is from the exact one."""
    from stiction.criterion.local import LocalCriterion
    from stiction.dynamics.method import Rupture
    from stiction.ensemble.pilot import ON_A_LINE, ON_A_PLANE, compare
    from stiction.equilibrium.method import Equilibrium

    texts: dict[Any, str] = {}
    for method, text in (
        (LocalCriterion(), ""),
        (Equilibrium(), "exact"),
        (Rupture(loading_rate=1.0), "with inertia; depends on the loading rate"),
    ):
        refused = method.supports(experiment.problem)
        texts[method] = f"does not apply: {'; '.join(refused)}" if refused else text
    local = LocalCriterion()
    if not texts[local]:
        count = ON_A_PLANE if experiment.problem.interface.is_plane else ON_A_LINE
        found = compare(experiment.by(local), experiment.draws(experiment.seed, 0, count))
        if found is not None:
            texts[local] = (
                f"{100.0 * found.bias:+.2g} % of the exact onset on average, with a scatter of"
                f" {100.0 * found.scatter:.2g} % (a pilot of {found.samples} samples)"
            )
    return [(method.label, text or "applies") for method, text in texts.items()]


def _cost(study: Any) -> Lines:
    """How long a study takes, from a few timed samples, and how much it stores."""
    from stiction.ensemble.batches import Span, solve_span, usable_cores
    from stiction.ensemble.monte_carlo import wide_bytes
    from stiction.errors import collect_warnings

    ensemble, points = study.ensemble, study.experiments
    chosen = np.unique(np.linspace(0, len(points) - 1, PROBED).round().astype(int))
    rates: list[float] = []
    failures: dict[str, None] = {}
    with collect_warnings():  # the run itself warns
        for number in map(int, chosen):
            solve_span(points[number], Span(number, ensemble.first, 1))  # compiles and prepares
            share, best = BUDGET / chosen.size, np.inf
            done, count, spent = 0, 1, 0.0
            while spent < share and done < ensemble.samples:
                count = min(count, ensemble.samples - done)
                table = solve_span(points[number], Span(number, ensemble.first + done, count))
                spent, done = spent + table.seconds, done + count
                rate = table.seconds / count
                best = min(best, rate)  # few samples at once cost more each
                failures |= dict.fromkeys(map(str, table.failures))
                count = max(1, min(2 * count, points[number].batch, int((share - spent) / rate)))
            rates.append(float(best))
    seconds = float(np.interp(np.arange(len(points)), chosen, rates).sum()) * ensemble.samples
    low, high = duration(min(rates)), duration(max(rates))
    each = low if low == high else f"{low} to {high}"
    cores = usable_cores()
    narrow = sum(len(point.variables) - len(point.wide) + 2 for point in points)
    wide = sum(wide_bytes(point, ensemble.samples, ensemble.first) for point in points)
    lines = [
        (
            "time",
            f"about {duration(seconds)} on one core, {duration(seconds / cores)} on the {cores}"
            f" here ({each} a sample, probed at {len(chosen)} of {len(points)} points)",
        ),
        ("size", f"about {size(8.0 * ensemble.samples * narrow + wide)}"),
    ]
    return lines + [("failed in the probe", text) for text in failures]


def schema() -> None:
    """Print the JSON schema of a study file, for editors that complete and check TOML."""
    from stiction.study.study import study_schema

    echo(json.dumps(study_schema(), indent=2))

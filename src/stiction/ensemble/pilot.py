"""A pilot: solve some samples of an approximate method also with its exact counterpart.

Problem. How much do the onsets from an approximate method, such as the local
criterion, differ from the exact onsets of the same samples?

Steps, at up to `MAX_PILOT_POINTS` points of a sweep:

1. Select the first samples, and the weakest among the first `MAX_RANKED_SAMPLES`.
2. Test quickly, with the method, whether their onsets may differ from the exact
   onsets. If not, stop.
3. Solve these samples exactly. The difference divided by the mean exact onset has a
   mean (bias) and a standard deviation (scatter). Report the largest values over
   all points.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, collect_warnings
from stiction.base.progress import Meter
from stiction.ensemble.batches import in_threads, usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.methods.onset import doubt, exact_counterpart, relative_differences
from stiction.methods.protocol import optional_member

SAMPLES_ON_LINE, SAMPLES_ON_PLANE = 32, 8
"""Number of first samples, and of weakest samples."""
MAX_RANKED_SAMPLES, RANKING_SECONDS = 1000, 1.0
"""First samples among which the weakest are found, and seconds on one core for them."""
BATCH_SAMPLES = 64
"""Samples that the inexpensive method solves at once."""
MAX_PILOT_POINTS = 8
"""Most points of a sweep that have a pilot."""


def compare(
    points: Sequence[Experiment],
    first: int = 0,
    most: int = SAMPLES_ON_LINE,
    show: bool = False,
    workers: int | None = None,
) -> dict[str, Any]:
    """Return the bias and scatter of an approximate method for the first and weakest samples.

    The result is empty if there is no exact counterpart, or if no point leaves a
    doubt.
    """
    chosen = np.unique(np.linspace(0, len(points) - 1, MAX_PILOT_POINTS).round().astype(int))
    parts: dict[str, list[Array]] = {}
    cores = workers or usable_cores()
    with Meter("comparing with the exact onset", len(chosen), show, unit="points") as meter:
        for number in chosen.tolist():
            for name, relative in _differences(points[number], first, most, cores).items():
                if relative.size > 1:
                    parts.setdefault(name, []).append(relative)
            meter.advance()
    attributes: dict[str, Any] = {}
    for name, differences in parts.items():
        attributes[f"{name}_samples"] = differences[0].size
        attributes[f"{name}_bias"] = float(max((part.mean() for part in differences), key=abs))
        attributes[f"{name}_scatter"] = float(max(part.std(ddof=1) for part in differences))
    return attributes


def _differences(
    experiment: Experiment, first: int, most: int, workers: int
) -> dict[str, Array]:
    """Return differences from the exact onset over its mean, for the first and weakest samples.

    The result is empty without an exact counterpart, or if the quick test leaves no doubt.
    """
    problem, method = experiment.problem, experiment.method
    exact = exact_counterpart(problem, method)
    if exact is None:
        return {}
    size = SAMPLES_ON_PLANE if problem.interface.is_plane else SAMPLES_ON_LINE
    with collect_warnings():  # the ensemble itself warns
        # 1.
        ranked = min(MAX_RANKED_SAMPLES, int(RANKING_SECONDS / experiment.seconds))
        draws = experiment.draws(first, min(max(size, ranked), most))
        stress = _onsets(experiment, draws, BATCH_SAMPLES, workers)
        chosen = {"pilot": np.arange(min(size, most))}
        if most > size:
            chosen["pilot_weakest"] = np.argsort(stress)[:size]
        chosen = {name: rows[np.isfinite(stress[rows])] for name, rows in chosen.items()}
        # 2.
        may_differ = optional_member(method, "may_differ")
        groups = [rows for rows in chosen.values() if rows.size]
        samples = [experiment.sample(experiment.profiles(draws[rows])) for rows in groups]
        pairs = zip(samples, groups, strict=True)
        if not any(may_differ(problem, sample, stress[rows]) for sample, rows in pairs):
            return {}
        # 3.
        some = np.unique(np.concatenate(list(chosen.values())))
        true = np.full(stress.size, np.nan)
        true[some] = _onsets(experiment.by(exact), draws[some], 1, workers)
    return {
        name: relative_differences(stress[rows], true[rows]) for name, rows in chosen.items()
    }


def _onsets(experiment: Experiment, draws: Array, batch: int, workers: int) -> Array:
    """Return the stress at onset for each row of draws, or NaN if it cannot be solved."""

    def solve(rows: Array) -> Array:
        try:
            stress: Array = experiment.onset(experiment.profiles(rows))["critical_stress"]
        except (InputError, RuntimeError, ArithmeticError):
            alone = len(rows) == 1
            return np.full(1, np.nan) if alone else _onsets(experiment, rows, 1, 1)
        return stress

    parts = np.split(draws, range(batch, len(draws), batch))
    return np.concatenate(in_threads(solve, parts, workers))


def pilot_doubt(
    experiment: Experiment, comparison: Mapping[str, Any], where: str = ""
) -> str | None:
    """Return a warning if a difference exceeds 1 %."""
    differences = {
        f"the {comparison[f'{name}_samples']} {text}{where}": (
            comparison[f"{name}_bias"], comparison[f"{name}_scatter"]
        )
        for name, text in (("pilot", "first samples"), ("pilot_weakest", "weakest of more"))
        if f"{name}_bias" in comparison
    }  # fmt: skip
    return doubt(experiment.method, differences)

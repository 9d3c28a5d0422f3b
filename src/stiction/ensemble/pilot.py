"""A pilot: some samples of an inexpensive method solved by its exact counterpart too."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.criterion.local import LocalCriterion
from stiction.ensemble.batches import in_threads, usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.equilibrium.method import Equilibrium
from stiction.errors import InputError, collect_warnings
from stiction.progress import Meter

ON_A_LINE, ON_A_PLANE = 32, 8
"""Number of samples of a pilot."""
MOST_POINTS = 8
"""Number of points of a sweep that have a pilot."""
WORTH_A_WARNING = 0.01


def exact_counterpart(experiment: Experiment) -> Experiment | None:
    """Return an experiment by the local criterion as one by `Equilibrium`, if that can take it."""
    method, problem = Equilibrium(), experiment.problem
    if not isinstance(experiment.method, LocalCriterion) or method.supports(problem):
        return None
    return Experiment(problem, experiment.random, method, seed=experiment.seed)


def compare(
    points: Sequence[Experiment], first: int = 0, most: int = ON_A_LINE, show: bool = False
) -> dict[str, Any]:
    """Solve samples of at most eight points by their method and by its exact counterpart.

    Return mean and scatter of the difference relative to the mean of the exact onset, of the
    points with the largest; nothing if there is no exact counterpart.
    """
    chosen = np.unique(np.linspace(0, len(points) - 1, MOST_POINTS).round().astype(int))
    found = []
    with Meter("comparing with the exact onset", len(chosen), show, unit="points") as meter:
        for number in chosen.tolist():
            relative = _differences(points[number], first, most)
            if relative.size > 1:
                found.append((relative.size, relative.mean(), relative.std(ddof=1)))
            meter.advance()
    if not found:
        return {}
    samples, bias, scatter = zip(*found, strict=True)
    return {
        "pilot_samples": samples[0],
        "pilot_bias": float(max(bias, key=abs)),
        "pilot_scatter": float(max(scatter)),
    }


def _differences(experiment: Experiment, first: int, most: int) -> Array:
    """Return the differences to the exact onset, relative to its mean; none if there is no such."""
    exact = exact_counterpart(experiment)
    if exact is None:
        return np.empty(0)

    def both(row: Array) -> list[float]:
        try:
            profiles = experiment.profiles(row[None, :])
            solved = (one.onset(profiles)["critical_stress"] for one in (experiment, exact))
            return [float(stress[0]) for stress in solved]
        except (InputError, RuntimeError, ArithmeticError):
            return [float("nan")] * 2

    size = ON_A_PLANE if experiment.problem.interface.is_plane else ON_A_LINE
    with collect_warnings():  # the ensemble itself warns
        draws = experiment.draws(first, min(size, most))
        pairs = np.array(in_threads(both, list(draws), usable_cores()))
    near, true = pairs[np.isfinite(pairs).all(axis=1)].T
    difference: Array = (near - true) / abs(true.mean()) if near.size else near
    return difference


def doubt(found: dict[str, Any], where: str = "") -> str | None:
    """Return the text of a warning if the difference is beyond 1 %."""
    if not found or max(abs(found["pilot_bias"]), found["pilot_scatter"]) <= WORTH_A_WARNING:
        return None
    bias, scatter = 100.0 * found["pilot_bias"], 100.0 * found["pilot_scatter"]
    return (
        f"the local criterion differs from the exact onset by {bias:+.2g} % on average, with a"
        f" scatter of {scatter:.2g} %{where} (a pilot of {found['pilot_samples']} samples);"
        " method=st.Equilibrium() has no such error"
    )

"""A pilot: some samples of an inexpensive method solved by its exact counterpart too."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.criterion.local import LocalCriterion
from stiction.ensemble.batches import in_threads, usable_cores
from stiction.ensemble.experiment import Ensemble, Experiment
from stiction.equilibrium.method import Equilibrium
from stiction.errors import InputError, collect_warnings, warn_accuracy
from stiction.progress import Meter

ON_A_LINE, ON_A_PLANE = 32, 8
"""Number of samples of a pilot."""
MOST_POINTS = 8
"""Number of points of a sweep that have a pilot."""
WORTH_A_WARNING = 0.01


class Pilot(NamedTuple):
    """Mean and scatter of the difference to the exact onset, relative to the mean of the latter."""

    samples: int  # solved by both
    bias: float
    scatter: float


def exact_counterpart(experiment: Experiment) -> Experiment | None:
    """Return an experiment by the local criterion as one by `Equilibrium`, if that can take it."""
    method, problem = Equilibrium(), experiment.problem
    if not isinstance(experiment.method, LocalCriterion) or method.supports(problem):
        return None
    return Experiment(problem, experiment.random, method, seed=experiment.seed)


def compare(experiment: Experiment, first: int = 0, most: int = ON_A_LINE) -> Pilot | None:
    """Solve samples by a method and by its exact counterpart, in threads; None if there is none."""
    exact = exact_counterpart(experiment)
    if exact is None:
        return None
    size = ON_A_PLANE if experiment.problem.interface.is_plane else ON_A_LINE
    draws = experiment.draws(first, min(size, most))

    def both(row: Array) -> list[float]:
        try:
            profiles = experiment.profiles(row[None, :])
            solved = (one.onset(profiles)["critical_stress"] for one in (experiment, exact))
            return [float(stress[0]) for stress in solved]
        except (InputError, RuntimeError, ArithmeticError):
            return [float("nan")] * 2

    with collect_warnings():  # the ensemble itself warns
        found = np.array(in_threads(both, list(draws), usable_cores()))
    near, true = found[np.isfinite(found).all(axis=1)].T
    if near.size < 2:
        return None
    difference = (near - true) / abs(float(true.mean()))
    return Pilot(near.size, float(difference.mean()), float(difference.std(ddof=1)))


def doubt(pilot: Pilot, where: str = "") -> str | None:
    """Return the text of a warning if the difference is beyond 1 %."""
    if max(abs(pilot.bias), pilot.scatter) <= WORTH_A_WARNING:
        return None
    return (
        f"the local criterion differs from the exact onset by {100.0 * pilot.bias:+.2g} % on"
        f" average, with a scatter of {100.0 * pilot.scatter:.2g} %{where} (a pilot of"
        f" {pilot.samples} samples); method=st.Equilibrium() has no such error"
    )


def pilot_attributes(
    points: Sequence[Experiment], ensemble: Ensemble, show: bool
) -> dict[str, Any]:
    """Compare the first samples of at most eight points, and warn of a difference beyond 1 %.

    Return the largest bias and scatter of the points; nothing if there is no exact counterpart.
    """
    chosen = np.unique(np.linspace(0, len(points) - 1, MOST_POINTS).round().astype(int))
    found: list[Pilot] = []
    with Meter("comparing with the exact onset", len(chosen), show, unit="points") as meter:
        for number in chosen.tolist():
            pilot = compare(points[number], ensemble.first, ensemble.samples)
            found += [pilot] if pilot else []
            meter.advance()
    if not found:
        return {}
    bias = max((pilot.bias for pilot in found), key=abs)
    worst = Pilot(found[0].samples, bias, max(pilot.scatter for pilot in found))
    if text := doubt(worst, " at the worst point of the sweep" if len(points) > 1 else ""):
        warn_accuracy(text)
    return {f"pilot_{name}": value for name, value in worst._asdict().items()}

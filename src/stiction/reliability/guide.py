"""What samples cost, and whether a less expensive method leads to the samples that fail."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.ensemble.pilot import exact_counterpart
from stiction.errors import collect_warnings
from stiction.methods import methods
from stiction.reliability.limit_state import LimitState, no_single_length

SECONDS = 100.0
"""Computing time that an answer may take if the user does not say."""
FEWEST, MOST = 1_000, 2_000_000
CHAIN = 20_000
"""Evaluations of subset simulation for about P = 1e-4 with a coefficient of variation of .1."""
PATIENCE = 900.0
"""Seconds on one core beyond which such a chain is begun only if `max_evaluations` allows it."""
ALIKE = 0.9
"""Share of the weakest plain samples that a guide must pick to lead to the rarest."""
CHECKED = (8, 64)
"""Fewest and most samples that are solved exactly to check those of the local criterion."""


def _seconds(state: LimitState) -> float:
    experiment = state.experiment
    return max(1e-9, float(experiment.method.seconds_per_sample(experiment.problem)))


def budget_of(state: LimitState, max_evaluations: int | None) -> int:
    """Return the evaluations allowed."""
    if max_evaluations is not None:
        return max_evaluations
    return int(min(MOST, max(FEWEST, SECONDS / _seconds(state))))


def too_slow(state: LimitState, max_evaluations: int | None) -> str | None:
    """Return why chains of samples take too long by this method; None if not, or if allowed."""
    seconds, method = CHAIN * _seconds(state), state.experiment.method
    fast = seconds <= PATIENCE and method.type != "rupture"
    if fast or (max_evaluations or 0) >= CHAIN:
        return None
    return (
        f"the {CHAIN:,} evaluations of subset simulation by {method.type!r} would take about"
        f" {seconds / 3600.0:.1g} h on one core; allow them with max_evaluations, take a faster"
        " method, or count (failure_probability with algorithm='plain', or quantiles of"
        " st.monte_carlo)"
    )


def first_stage(state: LimitState) -> Any:
    """Return the less expensive method that leads this one down the tail; None without one."""
    name = getattr(state.experiment.method, "first_stage", None)
    return None if name is None else methods()[name]()


def two_levels_refused(state: LimitState) -> str | None:
    """Return why two levels are not possible, or None if they are."""
    experiment = state.experiment
    if first_stage(state) is None:
        return f"{experiment.method.type!r} names no less expensive method as its first stage"
    reason = no_single_length(experiment.problem, experiment.random)
    return None if reason is None else f"the local criterion does not hold: {reason}"


def agreement(guide: Array, exact: Array) -> float:
    """Return the share of the exactly weakest fiftieth of samples in the guide's weakest tenth.

    Parameters
    ----------
    guide, exact : (samples,) arrays
        Stresses of the same samples; a few hundred.
    """
    weakest = np.argsort(exact)[: max(5, exact.size // 50)]
    seen = np.argsort(guide)[: max(10, exact.size // 10)]
    return float(np.isin(weakest, seen).mean())


def resembles(state: LimitState, draws: Array, values: Array) -> tuple[bool, str]:
    """Return whether the first stage picks the weakest of some plain samples, and the text."""
    guide = first_stage(state)
    share = agreement(state.by(guide)(draws), values)
    text = f"of {values.size} plain samples the {guide.label} picks {share:.0%} of the weakest"
    return share >= ALIKE, text


def distinct(values: Array, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return up to `count` positions with different values, in random order."""
    _, first = np.unique(values, return_index=True)  # chains repeat states
    chosen: NDArray[np.int64] = rng.permutation(first)[:count]
    return chosen


def exact_doubts(
    state: LimitState, near: tuple[Array, Array], stress: float, probability: float
) -> list[str]:
    """Solve some samples of the local criterion exactly; return a warning if they fail otherwise.

    Parameters
    ----------
    near : (draws, stresses)
        Samples on both sides of the stress, the lowest there are.
    stress, probability : float
        Pa, and the estimate of P(onset < stress).
    """
    exact, (draws, values) = exact_counterpart(state.experiment), near
    if exact is None or draws.shape[0] == 0:
        return []
    few, most = CHECKED
    cost = exact.method.seconds_per_sample(exact.problem)
    count = int(min(max(few, 10.0 / cost), most))
    chosen = distinct(values, count, np.random.default_rng(0))
    state.meter.note = "checking by equilibrium"
    with collect_warnings():
        below = replace(state, experiment=exact)(draws[chosen]) < stress
    failed = values[chosen] < stress
    discordant = int(np.sum(below != failed))
    if abs(int(below.sum()) - int(failed.sum())) <= 2.0 * math.sqrt(max(discordant, 1)):
        return []
    there = probability * max(int(below.sum()), 1) / max(int(failed.sum()), 1)
    return [
        f"of {chosen.size} samples in the tail {failed.sum()} fail by the local criterion and"
        f" {below.sum()} by equilibrium: by equilibrium the probability of failure is"
        f" {'about' if below.any() else 'below'} {min(there, 1.0):.2g} instead of"
        f" {probability:.2g}; use method=st.Equilibrium()"
    ]

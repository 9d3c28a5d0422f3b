"""How many evaluations an answer may take, and which algorithms a method is fast enough for."""

from __future__ import annotations

from typing import Any

from stiction.methods import methods
from stiction.reliability.limit_state import LimitState

SECONDS = 100.0
"""Computing time that an answer may take if the user does not say."""
FEWEST, MOST = 1_000, 2_000_000
CHAIN = 20_000
"""Evaluations of subset simulation for about P = 1e-4 with a coefficient of variation of .1."""
PATIENCE = 900.0
"""Seconds on one core beyond which such a chain is begun only if `max_evaluations` allows it."""


def _seconds(state: LimitState) -> float:
    return max(1e-9, float(state.method.seconds_per_sample(state.problem)))


def budget_of(state: LimitState, max_evaluations: int | None) -> int:
    """Evaluations allowed."""
    if max_evaluations is not None:
        return int(max_evaluations)
    return int(min(MOST, max(FEWEST, SECONDS / _seconds(state))))


def too_slow(state: LimitState, max_evaluations: int | None) -> str | None:
    """Why chains of samples take too long by this method; None if they do not or are allowed."""
    seconds = CHAIN * _seconds(state)
    if seconds <= PATIENCE or (max_evaluations or 0) >= CHAIN:
        return None
    return (
        f"the {CHAIN:,} evaluations of subset simulation by {state.method.type!r} would take about"
        f" {seconds / 3600.0:.1g} h on one core; allow them with max_evaluations, take a faster"
        " method, or count (algorithm='plain', or quantiles of st.monte_carlo)"
    )


def refused_chains(state: LimitState, max_evaluations: int | None) -> list[str]:
    """The same as a list of mistakes, for what has no other algorithm."""
    reason = too_slow(state, max_evaluations)
    return [] if reason is None else [f"method: {reason}"]


def first_stage(state: LimitState) -> Any:
    """The cheaper method that leads this one down the tail; None if it names none."""
    name = getattr(state.method, "first_stage", None)
    return None if name is None else methods()[name]()


def no_first_stage(state: LimitState) -> str | None:
    """Why two levels are not possible, or None if they are."""
    if first_stage(state) is None:
        return f"{state.method.type!r} names no cheaper method as its first stage"
    reason = state.no_single_length()
    return None if reason is None else f"the local criterion does not hold: {reason}"

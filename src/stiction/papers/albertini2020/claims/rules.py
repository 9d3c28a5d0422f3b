"""Rules that turn computed numbers into verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from stiction.papers.albertini2020.claims.claim import Quantity, Verdict
from stiction.papers.albertini2020.data import Data
from stiction.statistics.estimates import Estimate

SIGMAS = 3.0
"""A difference counts when it exceeds so many standard errors.

At three, one of some fifty comparisons goes wrong by chance in about one run out of seven at the
worst; most differences here are ten or more.
"""


def agrees(found: Estimate, printed: float, resolution: float, near: float = 0.05) -> Verdict:
    """A printed number: holds to its last digit, with a correction within the share `near`."""
    distance = abs(found.value - printed)
    if distance <= 0.5 * resolution * (1.0 + 1e-9) + SIGMAS * found.error:
        return Verdict.HOLDS
    return Verdict.CORRECTED if distance <= near * abs(printed) else Verdict.FAILS


def below(found: Estimate, limit: float) -> Verdict:
    """Whether a number is below a limit, undecided within its error."""
    if found.value + SIGMAS * found.error <= limit:
        return Verdict.HOLDS
    return Verdict.FAILS if found.value - SIGMAS * found.error > limit else Verdict.OPEN


def above(found: Estimate, limit: float) -> Verdict:
    """Whether a number is above a limit, undecided within its error."""
    return below(Estimate(-found.value, found.error), -limit)


def falling(series: Sequence[Estimate]) -> Verdict:
    """Whether each number is below the one before, undecided where errors overlap."""
    steps = [right - left for left, right in pairwise(series)]
    if all(step.value < -SIGMAS * step.error for step in steps):
        return Verdict.HOLDS
    if any(step.value > SIGMAS * step.error for step in steps):
        return Verdict.FAILS
    return Verdict.OPEN


def rising(series: Sequence[Estimate]) -> Verdict:
    """Whether each number is above the one before, undecided where errors overlap."""
    return falling([Estimate(-each.value, each.error) for each in series])


def steps_down(series: Sequence[Estimate]) -> tuple[int, int]:
    """How many steps certainly fall, and how many certainly rise."""
    steps = [right - left for left, right in pairwise(series)]
    return (
        sum(step.value < -SIGMAS * step.error for step in steps),
        sum(step.value > SIGMAS * step.error for step in steps),
    )


def worst(verdicts: Sequence[Verdict]) -> Verdict:
    """The most unfavourable of several: fails, then undecided, then with a correction."""
    order = (Verdict.FAILS, Verdict.OPEN, Verdict.CORRECTED, Verdict.HOLDS)
    return min(verdicts, key=order.index)


def at_each(data: Data, series: Sequence[Estimate], unit: str = "") -> tuple[Quantity, ...]:
    """One quantity a correlation length of the Monte Carlo study."""
    return tuple(
        Quantity(f"xi_0/h_n = {ratio:g}", each, unit)
        for ratio, each in zip(data.ratios, series, strict=True)
    )


def megapascal(estimate: Estimate) -> Estimate:
    """Pa to MPa."""
    return estimate.scaled(1e-6)


def kilopascal(estimate: Estimate) -> Estimate:
    """Pa to kPa."""
    return estimate.scaled(1e-3)

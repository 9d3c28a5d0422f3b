"""Rules that turn computed numbers into verdicts; each says what it asks, and what it can answer.

A rule is called with the numbers that a claim has measured. A difference counts when it exceeds
three standard errors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Any, ClassVar, Protocol

from stiction.papers.albertini2020.claims.limits import Limit
from stiction.statistics.estimates import Estimate

SIGMAS = 3.0
"""A difference counts when it exceeds so many standard errors.

At three, one of some fifty comparisons goes wrong by chance in about one run out of seven at the
worst; most differences here are ten or more.
"""

Series = Sequence[Estimate]


class Verdict(StrEnum):
    """What became of a claim."""

    FAILS = "does not hold"
    UNDECIDABLE = "undecidable from the text"
    CORRECTED = "holds with a correction"
    OPEN = "undecided"
    HOLDS = "holds"
    TRIVIAL = "true by construction"


HOLDS, CORRECTED, FAILS, OPEN = Verdict.HOLDS, Verdict.CORRECTED, Verdict.FAILS, Verdict.OPEN
_WORST = (FAILS, OPEN, Verdict.UNDECIDABLE, CORRECTED, HOLDS, Verdict.TRIVIAL)


def worst(verdicts: Sequence[Verdict]) -> Verdict:
    """The most unfavourable of several."""
    return min(verdicts, key=_WORST.index)


class Rule(Protocol):
    """What decides a claim."""

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """All that it can answer."""

    @property
    def text(self) -> str:
        """What it asks, for people."""

    def __call__(self, numbers: Any) -> Verdict:
        """The verdict on what was measured."""


def _side(value: float, error: float) -> Verdict:
    """Whether a number is certainly not positive (holds) or certainly positive (fails)."""
    if value + SIGMAS * error <= 0.0:
        return HOLDS
    return FAILS if value - SIGMAS * error > 0.0 else OPEN


def _together(verdicts: Sequence[Verdict], partly: bool) -> Verdict:
    if not verdicts:
        return OPEN
    if partly and HOLDS in verdicts and FAILS in verdicts:
        return CORRECTED
    return worst(verdicts)


def _level(limit: Limit | float) -> tuple[float, str]:
    return (limit.value, limit.text) if isinstance(limit, Limit) else (limit, f"{limit:g}")


@dataclass(frozen=True)
class Below:
    """Every number is below a limit; with `partly` it may be so at some lengths only."""

    limit: Limit | float
    partly: bool = False

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        return (HOLDS, OPEN, FAILS, CORRECTED) if self.partly else (HOLDS, OPEN, FAILS)

    @property
    def text(self) -> str:
        return f"every number below {_level(self.limit)[1]}"

    def __call__(self, numbers: Series) -> Verdict:
        limit, _ = _level(self.limit)
        return _together([_side(each.value - limit, each.error) for each in numbers], self.partly)


@dataclass(frozen=True)
class Above:
    """Every number is above a limit; with `partly` it may be so at some lengths only."""

    limit: Limit | float
    partly: bool = False

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        return Below(self.limit, self.partly).verdicts

    @property
    def text(self) -> str:
        return f"every number above {_level(self.limit)[1]}"

    def __call__(self, numbers: Series) -> Verdict:
        limit, _ = _level(self.limit)
        return _together([_side(limit - each.value, each.error) for each in numbers], self.partly)


@dataclass(frozen=True)
class Within:
    """Every number lies between two values."""

    low: float
    high: float
    word: str = ""

    verdicts: ClassVar[tuple[Verdict, ...]] = (HOLDS, OPEN, FAILS)

    @property
    def text(self) -> str:
        word = f" ({self.word})" if self.word else ""
        return f"every number from {self.low:g} to {self.high:g}{word}"

    def __call__(self, numbers: Series) -> Verdict:
        sides = [
            worst(
                [
                    _side(each.value - self.high, each.error),
                    _side(self.low - each.value, each.error),
                ]
            )
            for each in numbers
        ]
        return _together(sides, False)


def near(centre: float, limit: Limit) -> Within:
    """Every number is as close to a value as the limit says."""
    return Within(centre - limit.value, centre + limit.value, limit.word)


@dataclass(frozen=True)
class Printed:
    """One number agrees with a printed one to its last printed digit."""

    digits: str

    verdicts: ClassVar[tuple[Verdict, ...]] = (HOLDS, OPEN, FAILS)

    @property
    def half(self) -> float:
        """Half a unit in the last printed place."""
        return 0.5 * 10.0 ** -len(self.digits.partition(".")[2])

    @property
    def text(self) -> str:
        return f"{self.digits} to the printed digits, \N{PLUS-MINUS SIGN}{self.half:g}"

    def __call__(self, numbers: Series) -> Verdict:
        half = self.half * (1.0 + 1e-9)
        return Within(float(self.digits) - half, float(self.digits) + half)(numbers)


@dataclass(frozen=True)
class Falling:
    """A series falls from its first to its last number, and rises nowhere on the way.

    Where some steps certainly fall and others certainly rise it holds over a part of the range.
    """

    verdicts: ClassVar[tuple[Verdict, ...]] = (HOLDS, OPEN, FAILS, CORRECTED)
    text: ClassVar[str] = "the last number below the first, and no step up"
    sign: ClassVar[float] = 1.0

    def __call__(self, numbers: Series) -> Verdict:
        series = [Estimate(self.sign * each.value, each.error) for each in numbers]
        if len(series) < 2:
            return OPEN
        steps = [right - left for left, right in pairwise(series)]
        whole = series[-1] - series[0]
        falls = any(step.value < -SIGMAS * step.error for step in [*steps, whole])
        rises = any(step.value > SIGMAS * step.error for step in steps)
        if falls and rises:
            return CORRECTED
        if rises or whole.value > SIGMAS * whole.error:
            return FAILS
        return HOLDS if whole.value < -SIGMAS * whole.error else OPEN


@dataclass(frozen=True)
class Rising(Falling):
    """The same upwards."""

    text: ClassVar[str] = "the last number above the first, and no step down"
    sign: ClassVar[float] = -1.0


@dataclass(frozen=True)
class Graded:
    """One number (or the least of several) is above a limit, or, with a correction, a lower one."""

    enough: Limit
    some: Limit

    verdicts: ClassVar[tuple[Verdict, ...]] = (HOLDS, CORRECTED, OPEN, FAILS)

    @property
    def text(self) -> str:
        return f"above {self.enough.text}; with a correction above {self.some.text}"

    def __call__(self, numbers: Series) -> Verdict:
        least = min(numbers, key=lambda each: each.value)
        first = _side(self.enough.value - least.value, least.error)
        if first is HOLDS:
            return HOLDS
        second = _side(self.some.value - least.value, least.error)
        if second is HOLDS:
            return CORRECTED if first is FAILS else OPEN
        return second


@dataclass(frozen=True)
class Never:
    """Shares are zero; with a correction, rare."""

    rare: Limit

    verdicts: ClassVar[tuple[Verdict, ...]] = (HOLDS, CORRECTED, OPEN, FAILS)

    @property
    def text(self) -> str:
        return f"none at all; with a correction below {self.rare.text}"

    def __call__(self, numbers: Series) -> Verdict:
        if all(each.value == 0.0 for each in numbers):
            return HOLDS
        found = Below(self.rare)(numbers)
        return CORRECTED if found is HOLDS else found


@dataclass(frozen=True)
class SameCount:
    """A printed count `hits` of `runs` may be another draw of the share that was found."""

    hits: int
    runs: int
    limit: Limit

    verdicts: ClassVar[tuple[Verdict, ...]] = (HOLDS, FAILS)

    @property
    def text(self) -> str:
        return f"{self.hits} of {self.runs} within {self.limit.value:g} standard deviations"

    def __call__(self, numbers: Series) -> Verdict:
        (share,) = numbers
        scatter = math.sqrt(max(share.value * (1.0 - share.value), 0.0) / self.runs)
        distance = abs(share.value - self.hits / self.runs)
        return HOLDS if distance <= self.limit.value * math.hypot(scatter, share.error) else FAILS


@dataclass(frozen=True)
class Chance:
    """No probability that a difference comes by chance is below the limit, over all together."""

    limit: Limit

    verdicts: ClassVar[tuple[Verdict, ...]] = (HOLDS, FAILS)

    @property
    def text(self) -> str:
        return f"the smallest probability, times their number, above {self.limit.value:g}"

    def __call__(self, numbers: Series) -> Verdict:
        smallest = min(each.value for each in numbers)
        return HOLDS if smallest * len(numbers) > self.limit.value else FAILS

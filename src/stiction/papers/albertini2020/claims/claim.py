"""A claim: where the paper makes it, what it says, and a rule that judges what was computed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum

from stiction.papers.albertini2020.data import Data
from stiction.statistics.estimates import Estimate


class Verdict(StrEnum):
    """What became of a claim."""

    HOLDS = "holds"
    CORRECTED = "holds with a correction"
    FAILS = "does not hold"
    OPEN = "undecided"


@dataclass(frozen=True)
class Quantity:
    """A computed number with its uncertainty, label and unit.

    Attributes
    ----------
    label : str
    estimate : Estimate
    unit : str
        As shown; empty for a pure number.
    """

    label: str
    estimate: Estimate
    unit: str = ""

    @property
    def text(self) -> str:
        """Label, value and error, the value to the digits that the error leaves."""
        number = rounded(self.estimate)
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.label}: {number}{unit}" if self.label else f"{number}{unit}"


@dataclass(frozen=True)
class Finding:
    """What was computed for a claim, and the verdict.

    Attributes
    ----------
    computed : tuple of Quantity
    verdict : Verdict
    comment : str
        The correction, or what else should be known.
    """

    computed: tuple[Quantity, ...]
    verdict: Verdict
    comment: str = ""


Judge = Callable[[Data], Finding]


@dataclass(frozen=True)
class Claim:
    """A statement of the paper.

    Attributes
    ----------
    name : str
        Short, unique.
    where : str
        Section or equation.
    says : str
        In our own words.
    printed : str
        The printed value, if there is one.
    needs : tuple of str
        Names of the studies that it is judged by.
    judge : callable
        From data to finding.
    """

    name: str
    where: str
    says: str
    printed: str
    needs: tuple[str, ...]
    judge: Judge

    @property
    def subject(self) -> str:
        """What it is about: the module that it stands in."""
        return self.judge.__module__.rpartition(".")[2]


CLAIMS: dict[str, Claim] = {}
"""All claims by name."""

SUBJECTS = {
    "parameters": "Parameters and theory",
    "nucleation": "Nucleation stress",
    "onset": "Critical stress and position of onset",
    "interaction": "Theory against exact equilibrium",
    "simulation": "Theory against elastodynamic simulation",
    "rupture": "Nucleation and run-away propagation",
    "what_if": "What if",
}
"""Titles of the subjects, by module, in the order in which they are shown."""


def claim(
    *, where: str, says: str, printed: str = "", needs: tuple[str, ...] = ()
) -> Callable[[Judge], Judge]:
    """Decorator that makes a function from data to finding a claim; its name is the function's."""

    def register(judge: Judge) -> Judge:
        name = judge.__name__.replace("_", "-")
        if name in CLAIMS:
            raise ValueError(f"two claims are called {name}")
        CLAIMS[name] = Claim(name, where, says, printed, needs, judge)
        return judge

    return register


def judged(data: Data, claims: Iterable[Claim] | None = None) -> list[tuple[Claim, Finding]]:
    """Every claim whose studies there are, with its finding, subject by subject."""
    there = set(data.studies)
    chosen = CLAIMS.values() if claims is None else claims
    possible = [each for each in chosen if there.issuperset(each.needs)]
    order = {subject: place for place, subject in enumerate(SUBJECTS)}
    possible.sort(key=lambda each: order.get(each.subject, len(order)))
    return [(each, each.judge(data)) for each in possible]


def rounded(estimate: Estimate) -> str:
    """'0.6947 ± 0.0002': the error to one or two digits, the value to the same place."""
    value, error = estimate.value, estimate.error
    if not math.isfinite(value):
        return str(value)
    if not error > 0.0 or not math.isfinite(error):
        return f"{value:.6g}"
    place = math.floor(math.log10(error))
    if error / 10.0**place < 2.95:  # a leading 1 or 2 deserves a second digit
        place -= 1
    digits = max(-place, 0)
    return f"{value:.{digits}f} \N{PLUS-MINUS SIGN} {error:.{digits}f}"

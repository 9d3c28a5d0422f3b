"""A claim: where the paper makes it, what it says, what is measured, and the rule that judges."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from stiction.papers.albertini2020.claims.combined_rules import EachReading
from stiction.papers.albertini2020.claims.rules import Rule, Verdict
from stiction.papers.albertini2020.data import Data
from stiction.statistics.estimates import Estimate


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
class Measured:
    """What was measured for a claim.

    Attributes
    ----------
    judged : sequence of Quantity, or one for each part of an `All` or each reading
        What the rule is given.
    beside : sequence of Quantity
        What else should be known.
    comment : str
    comments : mapping of Verdict to str
        What to say instead, by verdict.
    """

    judged: Any
    beside: Sequence[Quantity] = ()
    comment: str = ""
    comments: Mapping[Verdict, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Finding:
    """What was computed for a claim, and the verdict.

    Attributes
    ----------
    computed : tuple of Quantity
    verdict : Verdict
    comment : str
        The correction, or what else should be known.
    by_reading : tuple of Verdict
        Under each reading of the text, where it leaves several.
    by_elastodynamics : Finding, optional
        The same statement judged by the Monte Carlo study by elastodynamics.
    """

    computed: tuple[Quantity, ...]
    verdict: Verdict
    comment: str = ""
    by_reading: tuple[Verdict, ...] = ()
    by_elastodynamics: Finding | None = None


Measure = Callable[[Data], Measured]


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
    rule : Rule
    measure : callable
        From data to what the rule judges.
    onsets_of : str
        The study whose onsets it is about: where elastodynamics was run for as many samples, the
        statement is judged a second time by its onsets in their place. Empty if it is about
        something else.
    """

    name: str
    where: str
    says: str
    printed: str
    needs: tuple[str, ...]
    rule: Rule
    measure: Measure
    onsets_of: str = ""

    @property
    def subject(self) -> str:
        """What it is about: the module that it stands in."""
        return self.measure.__module__.rpartition(".")[2]

    def judge(self, data: Data) -> Finding:
        """Measure, and apply the rule; again by elastodynamics where there is enough of it."""
        finding = self._judge(data)
        runs = data.by_elastodynamics(self.onsets_of) if self.onsets_of else None
        if runs is None:
            return finding
        return replace(finding, by_elastodynamics=self._judge(runs))

    def _judge(self, data: Data) -> Finding:
        found = self.measure(data)
        numbers = _numbers(found.judged)
        verdict = self.rule(numbers)
        by_reading: tuple[Verdict, ...] = ()
        if isinstance(self.rule, EachReading):
            by_reading = tuple(self.rule.of_each(numbers))
        computed = tuple(dict.fromkeys((*_flat(found.judged), *found.beside)))
        comment = found.comments.get(verdict, found.comment)
        return Finding(computed, verdict, comment, by_reading)


def _numbers(judged: Any) -> Any:
    """Estimates in place of quantities, however they are nested."""
    if isinstance(judged, Quantity):
        return judged.estimate
    return [_numbers(each) for each in judged]


def _flat(judged: Any) -> Iterator[Quantity]:
    if isinstance(judged, Quantity):
        yield judged
        return
    for each in judged:
        yield from _flat(each)


CLAIMS: dict[str, Claim] = {}
"""All claims by name."""

SUBJECTS = {
    "parameters": "Parameters and theory",
    "nucleation": "Nucleation stress",
    "onset": "Critical stress and position of onset",
    "prediction": "Theory against exact equilibrium and elastodynamics",
    "modulus": "Which modulus",
    "patches": "Slip patches and how they interact",
    "arrest": "Run-away, arrest and what drives it",
    "size": "Size of the scatter and of the interface",
    "what_if": "What if",
}
"""Titles of the subjects, by module, in the order in which they are shown."""


def claim(
    *,
    where: str,
    says: str,
    rule: Rule,
    printed: str = "",
    needs: tuple[str, ...] = (),
    onsets_of: str = "",
) -> Callable[[Measure], Measure]:
    """Decorator that makes a function from data to `Measured` a claim of the function's name."""

    def register(measure: Measure) -> Measure:
        name = measure.__name__.replace("_", "-")
        if name in CLAIMS:
            raise ValueError(f"two claims are called {name}")
        CLAIMS[name] = Claim(name, where, says, printed, needs, rule, measure, onsets_of)
        return measure

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
    """'0.6947 +- 0.0002': the error to one or two digits, the value to the same place."""
    value, error = estimate.value, estimate.error
    if not math.isfinite(value):
        return str(value)
    if not error > 0.0 or not math.isfinite(error):
        return f"{value:.5g}" if abs(value) < 1e5 else f"{value:,.0f}"
    place = math.floor(math.log10(error))
    if error / 10.0**place < 2.95:  # a leading 1 or 2 deserves a second digit
        place -= 1
    digits = max(-place, 0)
    if digits > 6:
        return f"{value:.2g} \N{PLUS-MINUS SIGN} {error:.1g}"
    return f"{value:.{digits}f} \N{PLUS-MINUS SIGN} {error:.{digits}f}"

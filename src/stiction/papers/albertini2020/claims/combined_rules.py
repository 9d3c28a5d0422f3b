"""Rules made of rules: several at once, under each reading of the text, softly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from stiction.papers.albertini2020.claims.rules import Rule, Series, Verdict, worst


@dataclass(frozen=True)
class Hypotheses:
    """Which of several readings of the text fits all that is printed; the first is what it says.

    The numbers are how many printed statements each reading misses.
    """

    readings: tuple[str, ...]

    verdicts: ClassVar[tuple[Verdict, ...]] = (
        Verdict.HOLDS, Verdict.FAILS, Verdict.UNDECIDABLE,
    )  # fmt: skip

    @property
    def text(self) -> str:
        return f"the only reading that misses the least is {self.readings[0]!r}"

    def __call__(self, numbers: Series) -> Verdict:
        least = min(each.value for each in numbers)
        best = [i for i, each in enumerate(numbers) if each.value == least]
        if len(best) > 1 or least > 0.0:
            return Verdict.UNDECIDABLE
        return Verdict.HOLDS if best == [0] else Verdict.FAILS


@dataclass(frozen=True)
class EachReading:
    """A rule on the numbers of each reading of the text; where they disagree, the text does not
    decide."""

    rule: Rule

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        return (*self.rule.verdicts, Verdict.UNDECIDABLE)

    @property
    def text(self) -> str:
        return f"under every reading: {self.rule.text}"

    def __call__(self, numbers: Sequence[Any]) -> Verdict:
        found = self.of_each(numbers)
        return found[0] if len(set(found)) == 1 else Verdict.UNDECIDABLE

    def of_each(self, numbers: Sequence[Any]) -> list[Verdict]:
        """The verdict under each reading."""
        return [self.rule(each) for each in numbers]


@dataclass(frozen=True)
class Softly:
    """A rule on a word beside the statement: where it fails the statement needs a correction."""

    rule: Rule

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        found = (
            Verdict.CORRECTED if each is Verdict.FAILS else each for each in self.rule.verdicts
        )
        return tuple(dict.fromkeys(found))

    @property
    def text(self) -> str:
        return f"{self.rule.text} (else with a correction)"

    def __call__(self, numbers: Any) -> Verdict:
        found = self.rule(numbers)
        return Verdict.CORRECTED if found is Verdict.FAILS else found


@dataclass(frozen=True)
class Construction:
    """What the definitions make true: there is nothing to be found."""

    because: str

    verdicts: ClassVar[tuple[Verdict, ...]] = (Verdict.TRIVIAL,)

    @property
    def text(self) -> str:
        return f"true by construction: {self.because}"

    def __call__(self, numbers: Series) -> Verdict:
        return Verdict.TRIVIAL


@dataclass(frozen=True)
class All:
    """Several rules, each on a series of its own; the worst verdict counts."""

    parts: tuple[Rule, ...]

    def __init__(self, *parts: Rule) -> None:
        object.__setattr__(self, "parts", parts)

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        found = {verdict for part in self.parts for verdict in part.verdicts}
        return tuple(verdict for verdict in Verdict if verdict in found)

    @property
    def text(self) -> str:
        return "; and ".join(part.text for part in self.parts)

    def __call__(self, numbers: Sequence[Series]) -> Verdict:
        pairs = zip(self.parts, numbers, strict=True)
        return worst([part(series) for part, series in pairs])

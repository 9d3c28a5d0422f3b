"""Rules that turn numbers with errors into a verdict; three standard errors decide."""

import contextlib
import functools
import math
from collections.abc import Callable, Iterable, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from decimal import Decimal
from enum import Enum
from itertools import combinations

from reproduction.numbers_with_errors import Number

SIGMAS = 3.0


class Verdict(Enum):
    """The verdict on a statement, in the order in which the page counts them."""

    FAILS = "does not hold"
    CORRECTED = "holds with a correction"
    TEXT = "undecided from the text"
    OPEN = "undecided"
    HOLDS = "holds"


Numbers = Sequence[Number]
_FACTOR = ContextVar("factor", default=1.0)


@contextlib.contextmanager
def limits_times(factor: float):
    """Multiply limits that are a choice, to see whether a verdict rests on them."""
    token = _FACTOR.set(factor)
    try:
        yield
    finally:
        _FACTOR.reset(token)


@dataclass(frozen=True)
class Rule:
    """What must be met, in words, as a function of the judged series, and how many these are."""

    text: str
    judge: Callable[[Sequence[Numbers]], Verdict]
    series: int = 1

    def __call__(self, series: Sequence[Numbers]) -> Verdict:
        known = series and all(map(len, series))
        return self.judge(series) if known else Verdict.OPEN


def _range(number: Number) -> tuple[float, float]:
    return number.value - SIGMAS * number.error, number.value + SIGMAS * number.error


def _moved(limit: float, share: bool, centre: float) -> float:
    """Return a limit that is a choice, moved from a centre; limits of shares by their odds."""
    factor = _FACTOR.get()
    if share and math.isfinite(limit):
        return factor * limit / (1.0 + (factor - 1.0) * limit)
    return centre + factor * (limit - centre)


def within(low: float, high: float, why: str = "", *, share: bool = False) -> Rule:
    """Every number lies between two limits; `why` is the reason of limits that are a choice."""
    one_sign = low * high > 0.0 and math.isfinite(high - low)
    centre = 0.5 * (low + high) if one_sign else 0.0

    def judge(series: Sequence[Numbers]) -> Verdict:
        least, most = (_moved(x, share, centre) if why else x for x in (low, high))
        ranges = [_range(number) for row in series for number in row]
        if all(least <= left and right <= most for left, right in ranges):
            return Verdict.HOLDS
        if any(left > most or right < least for left, right in ranges):
            return Verdict.FAILS
        return Verdict.OPEN

    text = f"between {low:g} and {high:g}"
    if low == -math.inf:
        text = f"below {high:g}"
    elif high == math.inf:
        text = f"above {low:g}"
    if why.startswith("%"):
        text, why = f"{text} %", why.removeprefix("%").removeprefix(": ")
    return Rule(text + (f" ({why})" if why else ""), judge)


def below(limit: float, why: str = "", *, share: bool = False) -> Rule:
    return within(-math.inf, limit, why, share=share)


def above(limit: float, why: str = "", *, share: bool = False) -> Rule:
    return within(limit, math.inf, why, share=share)


def printed(digits: str) -> Rule:
    """The number rounds to the printed digits."""
    half = 0.5 * 10.0 ** Decimal(digits).as_tuple().exponent
    rule = within(float(digits) - half, float(digits) + half)
    return Rule(f"{digits} to the printed digits", rule.judge)


def _monotonic(sign: float, word: str) -> Rule:
    def judge(series: Sequence[Numbers]) -> Verdict:
        row = [number * sign for number in series[0]]
        least, most = _range(row[-1] - row[0])
        rises = [later - earlier for earlier, later in combinations(row, 2)]
        wrong = any(_range(rise)[1] < 0.0 for rise in rises)
        doubtful = any(rise.value < -rise.error for rise in rises)
        if not least > 0.0:
            return Verdict.FAILS if most < 0.0 or wrong else Verdict.OPEN
        return Verdict.CORRECTED if wrong else Verdict.OPEN if doubtful else Verdict.HOLDS

    return Rule(f"{word} from the first to the last, and no two go the other way", judge)


falling = functools.partial(_monotonic, -1.0, "falls")
rising = functools.partial(_monotonic, 1.0, "rises")
_WORST = (Verdict.FAILS, Verdict.OPEN, Verdict.CORRECTED, Verdict.HOLDS)


def _found(rules: Sequence[Rule], series: Sequence[Numbers]) -> list[Verdict]:
    """Return the verdict of each rule on as many series as it takes."""
    if len(series) != sum(rule.series for rule in rules):
        raise ValueError(f"{len(series)} series for {len(rules)} rules")
    rest = iter(series)
    return [rule([next(rest) for _ in range(rule.series)]) for rule in rules]


def each(*rules: Rule) -> Rule:
    """One rule for each judged series; the worst verdict counts."""

    def judge(series: Sequence[Numbers]) -> Verdict:
        return min(_found(rules, series), key=_WORST.index)

    number = sum(rule.series for rule in rules)
    return Rule("; and ".join(rule.text for rule in rules), judge, number)


def graded(strict: Rule, weak: Rule) -> Rule:
    """Holds by the first rule, with a correction by the second only."""

    def judge(series: Sequence[Numbers]) -> Verdict:
        verdict = strict(series)
        if verdict is Verdict.FAILS and weak(series) is not Verdict.FAILS:
            return Verdict.CORRECTED if weak(series) is Verdict.HOLDS else Verdict.OPEN
        return verdict

    return Rule(f"{strict.text}; a correction if only {weak.text}", judge)


def never(limit: float) -> Rule:
    """It happens in no sample of so many that the share is below a limit."""

    def judge(series: Sequence[Numbers]) -> Verdict:
        verdict = below(limit, "choice", share=True)(series)
        seen = any(number.value > 0.0 for row in series for number in row)
        return Verdict.CORRECTED if verdict is Verdict.HOLDS and seen else verdict

    return Rule(f"in no sample, of enough to exclude {limit:g}; a correction if in some", judge)


def by_chance(level: float = 0.01) -> Rule:
    """The smallest of several probabilities, times their number, is above a level."""

    def judge(series: Sequence[Numbers]) -> Verdict:
        values = [number.value for row in series for number in row]
        return Verdict.HOLDS if min(values) * len(values) > level else Verdict.FAILS

    return Rule(f"smallest p-value times their number above {level:g}", judge)


def unlikely(level: float = 0.00135) -> Rule:
    """Every chance is below that of three standard errors to one side."""

    def judge(series: Sequence[Numbers]) -> Verdict:
        sure = all(number.value < level for row in series for number in row)
        return Verdict.HOLDS if sure else Verdict.OPEN

    return Rule(f"a chance below {level:g}, undecided otherwise", judge)


def together(verdicts: Iterable[Verdict]) -> Verdict:
    """Return what several readings of a text have in common."""
    decided = {*verdicts}
    sure = decided - {Verdict.OPEN}
    if len(sure) > 1:
        return Verdict.TEXT
    return Verdict.OPEN if Verdict.OPEN in decided else sure.pop()


def alike(*rules: Rule) -> Rule:
    """One rule for every measure of what the text does not define, or a rule for each."""

    def judge(series: Sequence[Numbers]) -> Verdict:
        each_rule = rules if len(rules) > 1 else rules * (len(series) // rules[0].series)
        results = _found(each_rule, series)
        if Verdict.FAILS in results:
            return together(results)
        return min(results, key=(Verdict.CORRECTED, Verdict.OPEN, Verdict.HOLDS).index)

    text = "; or ".join(rule.text for rule in rules)
    return Rule(f"by each measure: {text}", judge, sum(rule.series for rule in rules))

"""Every claim's rule gives each of its verdicts on numbers made for it, and keeps to its limits."""

import functools
import math
import re
from pathlib import Path

import pytest

from stiction.papers.albertini2020.claims import CLAIMS, Verdict
from stiction.papers.albertini2020.claims import limits as table
from stiction.papers.albertini2020.claims.combined_rules import (
    All,
    Construction,
    EachReading,
    Hypotheses,
    Softly,
)
from stiction.papers.albertini2020.claims.rules import (
    Above,
    Below,
    Chance,
    Falling,
    Graded,
    Never,
    Printed,
    Rising,
    SameCount,
    Within,
    near,
    worst,
)
from stiction.papers.albertini2020.studies.modulus import READINGS
from stiction.statistics.estimates import Estimate

HOLDS, CORRECTED, FAILS, OPEN = Verdict.HOLDS, Verdict.CORRECTED, Verdict.FAILS, Verdict.OPEN
UNDECIDABLE = Verdict.UNDECIDABLE


def level(rule):
    return getattr(rule.limit, "value", rule.limit)


@functools.singledispatch
def witnesses(rule):
    """Numbers that make a rule give each of its verdicts, by verdict."""
    raise TypeError(type(rule))


def either_side(limit, good):
    """Three numbers: certainly on the good side, too vague to tell, certainly on the other."""
    unit = abs(limit) or 1.0
    fine, bad = limit + good * unit, limit - good * unit
    return {
        HOLDS: [Estimate(fine, 0.3 * unit)],
        OPEN: [Estimate(fine, 0.4 * unit)],
        FAILS: [Estimate(fine), Estimate(bad, 0.3 * unit)],
    }


@witnesses.register(Below)
@witnesses.register(Above)
def _(rule):
    made = either_side(level(rule), -1.0 if isinstance(rule, Below) else 1.0)
    if rule.partly:
        made[CORRECTED] = made[FAILS]
        made[FAILS] = made[FAILS][1:]
    return made


@witnesses.register
def _(rule: Within):
    middle, half = 0.5 * (rule.low + rule.high), 0.5 * (rule.high - rule.low)
    return {
        HOLDS: [Estimate(middle, 0.3 * half)],
        OPEN: [Estimate(rule.high, 0.1 * half)],
        FAILS: [Estimate(middle), Estimate(rule.low - half, 0.3 * half)],
    }


@witnesses.register
def _(rule: Printed):
    value = float(rule.digits)
    return {
        HOLDS: [Estimate(value + 0.99 * rule.half)],
        OPEN: [Estimate(value, rule.half)],
        FAILS: [Estimate(value + 1.01 * rule.half)],
    }


@witnesses.register(Falling)
@witnesses.register(Rising)
def _(rule):
    def series(*values, error=0.1):
        return [Estimate(rule.sign * value, error) for value in values]

    return {
        HOLDS: series(3, 2, 2.1, 1),
        OPEN: series(3, 2.9, 2.8),
        FAILS: series(1, 2, 3),
        CORRECTED: series(3, 1, 2),
    }


@witnesses.register
def _(rule: Graded):
    enough, some = rule.enough.value, rule.some.value
    gap = enough - some
    return {
        HOLDS: [Estimate(enough + 0.1 * gap, 0.01 * gap)],
        CORRECTED: [Estimate(enough + gap), Estimate(some + 0.5 * gap, 0.01 * gap)],
        OPEN: [Estimate(enough, 0.1 * gap)],
        FAILS: [Estimate(enough + gap), Estimate(some - 0.5 * gap, 0.01 * gap)],
    }


@witnesses.register
def _(rule: Never):
    rare = rule.rare.value
    return {
        HOLDS: [Estimate(0.0, rare)],
        CORRECTED: [Estimate(0.0, 0.1 * rare), Estimate(0.5 * rare, 0.1 * rare)],
        OPEN: [Estimate(rare, 0.1 * rare)],
        FAILS: [Estimate(2.0 * rare, 0.1 * rare)],
    }


@witnesses.register
def _(rule: SameCount):
    share = rule.hits / rule.runs
    return {HOLDS: [Estimate(share)], FAILS: [Estimate(0.1 * share)]}


@witnesses.register
def _(rule: Chance):
    return {
        HOLDS: [Estimate(0.5), Estimate(3.0 * rule.limit.value)],
        FAILS: [Estimate(0.9), Estimate(0.3 * rule.limit.value)],
    }


@witnesses.register
def _(rule: Hypotheses):
    others = [Estimate(2.0)] * (len(rule.readings) - 2)
    return {
        HOLDS: [Estimate(0.0), Estimate(1.0), *others],
        FAILS: [Estimate(1.0), Estimate(0.0), *others],
        UNDECIDABLE: [Estimate(1.0), Estimate(2.0), *others],
    }


@witnesses.register
def _(rule: Construction):
    return {Verdict.TRIVIAL: [Estimate(1.0)]}


@witnesses.register
def _(rule: All):
    made = {}
    each = [witnesses(part) for part in rule.parts]
    for i, part in enumerate(rule.parts):
        for verdict in part.verdicts:
            made[verdict] = [own[verdict if i == j else HOLDS] for j, own in enumerate(each)]
    return made


@witnesses.register
def _(rule: Softly):
    own = witnesses(rule.rule)
    return {CORRECTED if verdict is FAILS else verdict: made for verdict, made in own.items()}


@witnesses.register
def _(rule: EachReading):
    own = witnesses(rule.rule)
    made = {verdict: [numbers] * len(READINGS) for verdict, numbers in own.items()}
    made[UNDECIDABLE] = [own[HOLDS], *[own[FAILS]] * (len(READINGS) - 1)]
    return made


CASES = [(name, verdict) for name, claim in CLAIMS.items() for verdict in claim.rule.verdicts]


@pytest.mark.parametrize(("name", "verdict"), CASES, ids=lambda case: str(case))
def test_each_rule_gives_each_of_its_verdicts(name, verdict):
    rule = CLAIMS[name].rule
    assert rule(witnesses(rule)[verdict]) is verdict


def test_all_rules_but_constructions_can_fail():
    for name, claim in CLAIMS.items():
        if not isinstance(claim.rule, Construction):
            assert FAILS in claim.rule.verdicts, name


def test_printed_digits_decide():
    assert Printed("0.66")([Estimate(0.66443)]) is HOLDS
    assert Printed("1")([Estimate(0.99333)]) is HOLDS
    assert Printed("0.751")([Estimate(0.75073)]) is HOLDS
    assert Printed("0.9997")([Estimate(0.9995)]) is FAILS
    assert near(1.0, table.ONE_PER_CENT)([Estimate(1.02)]) is FAILS


def test_worst():
    assert worst([HOLDS, OPEN, CORRECTED]) is OPEN
    assert worst([HOLDS, Verdict.TRIVIAL]) is HOLDS


def test_every_limit_has_a_reason():
    for name, limit in table.LIMITS.items():
        assert limit.word, name
        assert len(limit.reason) > 10, name
        assert math.isfinite(limit.value), name


def test_every_rule_says_what_it_asks():
    for name, claim in CLAIMS.items():
        assert len(claim.rule.text) > 5, name


PAGE = (Path(__file__).parents[2] / "docs" / "paper.md").read_text(encoding="utf-8")


def test_the_page_has_every_statement_with_its_rule():
    for claim in CLAIMS.values():
        row = f"| {claim.where} | {claim.says} | `{claim.name}` | {claim.rule.text} |"
        assert row in PAGE, claim.name
    named = set(re.findall(r"\| `([a-z-]+)` \| ", PAGE.partition("## Statements")[2]))
    assert named == set(CLAIMS)


def test_the_page_has_every_limit_with_its_reason():
    for limit in table.LIMITS.values():
        assert f"| {limit.word} |" in PAGE
        assert limit.reason in PAGE

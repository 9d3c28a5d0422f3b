"""A claim is a statement of the paper with a rule; a finding is a claim with its numbers."""

import contextlib
import dataclasses
import functools
import itertools
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import jinja2
import pandas as pd

from reproduction import PARAMETERS, measures, rules, setting
from reproduction import numbers_with_errors as estimates
from reproduction.numbers_with_errors import Number, number_of, rounded
from reproduction.rules import Rule, Verdict, limits_times, together
from reproduction.runner import Data, LeftOut
from reproduction.setting import RATIOS, SIMULATED
from reproduction.studies import READINGS

NAMES = {"abs": abs} | vars(setting) | vars(estimates) | vars(measures)
"""All that an expression in `statements.toml` and a text in `page.toml` may name."""
OVER = {"r": RATIOS, "s": SIMULATED, "t": SIMULATED[1:]}
"""An expression that names one of these letters is computed at each of its xi_0/h_n."""
SCALED = ("Pa", "m", "J/m²")
"""Units of expressions that are printed with a prefix by the size of the numbers."""
JINJA = jinja2.Environment(undefined=jinja2.StrictUndefined)


@functools.cache
def _expression(source: str):
    return JINJA.compile_expression(source, undefined_to_none=False)


@dataclasses.dataclass(frozen=True)
class Series:
    """One computed quantity over keys: values of xi_0/h_n, or names of cases."""

    label: str
    unit: str
    rows: Sequence[tuple[float | str, Number]]

    def text(self) -> str:
        """Return the numbers in a line, each with the unit that suits the largest."""
        parts = []
        for key, number in self.rows:
            shown = rounded(number) + (f" {self.unit}" if self.unit else "")
            where = f"{key:g}: " if isinstance(key, float) else f"{key}: " if key else ""
            parts.append(where + shown)
        over_ratios = self.rows and isinstance(self.rows[0][0], float)
        values = ", ".join(parts) or "too few samples"
        return self.label + (" at xi_0/h_n = " if over_ratios else ": ") + values


@dataclasses.dataclass(frozen=True)
class Claim:
    """A statement as it stands in `statements.toml`, where the keys are explained."""

    name: str
    says: str
    where: str
    rule: Rule
    judged: Sequence[Sequence[str]]
    beside: Sequence[Sequence[str]] = ()
    note: str = ""
    correction: str = ""
    kind: str = "finding"
    own: bool = True


def _read() -> dict[str, list[Claim]]:
    groups = tomllib.loads(Path(__file__).with_name("statements.toml").read_text("utf-8"))
    return {
        title: [
            Claim(name, **row | {"rule": _expression(row["rule"])(vars(rules))})
            for name, row in rows.items()
        ]
        for title, rows in groups.items()
    }


GROUPS = _read()  # all claims by the title of their group
CLAIMS = {claim.name: claim for rows in GROUPS.values() for claim in rows}


@dataclasses.dataclass(frozen=True)
class Finding:
    """A claim with its numbers and its verdict.

    `readings` has the verdict of each reading of the modulus, `otherwise` those that limits half
    and twice as large would give if they differ.
    """

    claim: Claim
    judged: Sequence[Series]
    beside: Sequence[Series]
    verdict: Verdict
    readings: Mapping[str, Verdict]
    otherwise: Mapping[str, Verdict]


def series(quantity: Sequence[str], data: Data, key: str = "") -> Series:
    """Compute a quantity of a claim, in a reading of the modulus if it depends on it."""
    label, unit, source = quantity
    names = NAMES | {"d": data, "key": key, "v": functools.partial(data.reading, key)}
    function = _expression(source)
    for letter, ratios in OVER.items():
        if re.search(rf"\b{letter}\b", source):
            values = [(float(x), number_of(function(names, **{letter: x}))) for x in ratios]
            break
    else:
        value = function(names)
        values = value if isinstance(value, list) else [("", number_of(value))]
    if unit in SCALED:
        factor, unit = estimates.prefixed([number.value for _, number in values], unit)
        values = [(key, number * factor) for key, number in values]
    return Series(f"({key}) {label}" if key and len(READINGS) > 1 else label, unit, values)


def judge_all(data: Data) -> tuple[dict[str, list[Finding]], list[tuple[Claim, str]]]:
    """Return the findings by title, and the claims left out with what each of them needs."""
    groups, left = {title: [] for title in GROUPS}, []
    for title, rows in GROUPS.items():
        for claim in rows:
            try:
                groups[title].append(judge(claim, data))
            except LeftOut as missing:
                left.append((claim, str(missing)))
    return groups, left


def judge(claim: Claim, data: Data) -> Finding:
    """Compute the numbers of a claim and apply its rule, or raise `LeftOut`."""
    if PARAMETERS and not claim.own:
        raise LeftOut("printed")
    by_reading = any(re.search(r"\b(v|key)\b", source) for *_, source in claim.judged)
    cases = {
        key: [series(quantity, data, key) for quantity in claim.judged]
        for key in (READINGS if by_reading else ("",))
    }
    beside = []
    for quantity in claim.beside:
        with contextlib.suppress(LeftOut):
            beside.append(series(quantity, data))
    return decide(claim, cases, beside)


def decide(claim: Claim, cases: Mapping[str, Sequence[Series]], beside=()) -> Finding:
    """Apply the rule of a claim to its numbers in each reading."""
    numbers = {
        key: [[number for _, number in row.rows] for row in judged]
        for key, judged in cases.items()
    }
    readings = {key: claim.rule(rows) for key, rows in numbers.items()}
    verdict, otherwise = together(readings.values()), {}
    for factor, text in ((0.5, "half"), (2.0, "twice")):
        with limits_times(factor):
            moved = together(claim.rule(rows) for rows in numbers.values())
        if moved is not verdict:
            otherwise[text] = moved
    judged = [row for rows in cases.values() for row in rows]
    return Finding(claim, judged, beside, verdict, readings, otherwise)


def write_csv(groups: Mapping[str, Sequence[Finding]], path: Path) -> None:
    """Write every number of every claim, one a row."""
    rows = []
    for finding in itertools.chain(*groups.values()):
        for row in (*finding.judged, *finding.beside):
            for key, number in row.rows:
                ratio, case = (key, "") if isinstance(key, float) else ("", key)
                rows.append({
                    "claim": finding.claim.name, "verdict": finding.verdict.value,
                    "quantity": row.label, "xi_0/h_n": ratio, "case": case,
                    "value": number.value, "error": number.error, "unit": row.unit,
                    "judged": row in finding.judged,
                })  # fmt: skip
    pd.DataFrame(rows).to_csv(path, index=False)

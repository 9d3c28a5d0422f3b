"""A claim is a row: what the paper says, where, what is computed for it, and the rule."""

import dataclasses
import functools
import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from reproduction import PARAMETERS
from reproduction.numbers_with_errors import Number
from reproduction.rules import Rule, Verdict, limits_times, together
from reproduction.runner import Size
from reproduction.setting import RATIOS

MINUS = "\N{MINUS SIGN}"
TEXTS = tomllib.loads(Path(__file__).with_name("statements.toml").read_text("utf-8"))
"""By name: what the paper says, where, and what stands beside the verdict."""


@dataclass(frozen=True)
class Series:
    """One computed quantity over keys: values of xi_0/h_n, or names of cases."""

    label: str
    unit: str
    rows: Sequence[tuple[float | str, Number]]

    def text(self) -> str:
        """Return the numbers in a line."""
        parts = []
        for key, number in self.rows:
            shown = rounded(number) + (f" {self.unit}" if self.unit else "")
            where = f"{key:g}: " if isinstance(key, float) else f"{key}: " if key else ""
            parts.append(where + shown)
        over_ratios = self.rows and isinstance(self.rows[0][0], float)
        return self.label + (" at xi_0/h_n = " if over_ratios else ": ") + ", ".join(parts)


class LeftOut(KeyError):
    """A study is not computed in this run, or not yet."""


class Data:
    """The studies by name, as futures, with short ways to their numbers.

    With `wait=False` a study that is still being computed counts as left out.
    """

    def __init__(self, studies: Mapping[str, Future], size: Size, *, wait: bool = True) -> None:
        self.studies, self.size, self.wait = studies, size, wait

    def __contains__(self, name: str) -> bool:
        return name in self.studies and (self.wait or self.studies[name].done())

    def __getitem__(self, name: str) -> xr.Dataset:
        if name not in self:
            raise LeftOut(name)
        return self.studies[name].result()

    def at(self, study: str, name: str, ratio: float) -> np.ndarray:
        """Return a variable of a study at one xi_0/h_n."""
        return self[study][name].sel(correlation_ratio=ratio).values

    def stress(self, ratio: float, study: str = "local") -> np.ndarray:
        """Return tau_cr of every sample, Pa."""
        return self.at(study, "critical_stress", ratio)

    def excess(self, ratio: float) -> np.ndarray:
        """Return the first instability by the local criterion over the exact one, less one."""
        name = "first_instability"
        return self.at("local", name, ratio) / self.at("exact", name, ratio) - 1.0

    def what_if(self, name: str, variable: str, point: int) -> np.ndarray:
        """Return a variable of a what-if at one of its points."""
        return self[name][variable].isel(point=point).values


Measured = tuple[Sequence[Series] | Mapping[str, Sequence[Series]], Sequence[Series]]


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, whose text stands in `statements.toml` under its name.

    `measure` returns what is judged, by reading of the modulus if it depends on it, and what
    stands beside it; `note` makes a note of results. `kind` is "finding"; "arithmetic" for
    printed numbers, identities and what is true by the definitions; "beyond" for a statement
    outside the range that the paper covers. The last two are counted apart.
    """

    name: str
    rule: Rule
    measure: Callable[[Data], Measured]
    note: Callable[[Data], str] | None = None
    kind: str = "finding"

    @property
    def says(self) -> str:
        """What the paper says, in our words."""
        return TEXTS[self.name]["says"]

    @property
    def where(self) -> str:
        """Section, paragraph and sentence."""
        return TEXTS[self.name]["where"]


Check = functools.partial(Claim, kind="arithmetic")
Beyond = functools.partial(Claim, kind="beyond")


@dataclass(frozen=True)
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
    note: str = ""


def verdicts(rule: Rule, cases: Mapping[str, Sequence[Series]]) -> dict[str, Verdict]:
    """Return the verdict of a rule on each case."""
    return {
        key: rule([[number for _, number in series.rows] for series in judged])
        for key, judged in cases.items()
    }


def judge(claim: Claim, data: Data) -> Finding | None:
    """Compute the numbers of a claim and apply its rule; None if a study is left out.

    Printed numbers are those of the paper's parameters, and are left out with others.
    """
    if PARAMETERS and claim.kind == "arithmetic":
        return None
    try:
        judged, beside = claim.measure(data)
        note = claim.note(data) if claim.note else TEXTS[claim.name].get("note", "")
    except LeftOut:
        return None
    cases = judged if isinstance(judged, Mapping) else {"": judged}
    readings = verdicts(claim.rule, cases)
    verdict, otherwise = together(readings.values()), {}
    for factor, text in ((0.5, "half"), (2.0, "twice")):
        with limits_times(factor):
            moved = together(verdicts(claim.rule, cases).values())
        if moved is not verdict:
            otherwise[text] = moved
    rows = [
        dataclasses.replace(series, label=f"({key}) {series.label}" if key else series.label)
        for key, judged_series in cases.items()
        for series in judged_series
    ]
    return Finding(
        claim, rows, beside, verdict, {} if "" in readings else readings, otherwise, note
    )


def over_ratios(
    label: str, unit: str, function: Callable[[float], Number], ratios=RATIOS
) -> Series:
    """Return a series of function(ratio)."""
    return Series(label, unit, [(float(ratio), function(ratio)) for ratio in ratios])


def one(label: str, value, unit: str = "", error: float = 0.0) -> Series:
    """Return a series of one number."""
    number = value if isinstance(value, Number) else Number(float(value), error)
    return Series(label, unit, [("", number)])


def rounded(number: Number) -> str:
    """Return a number with its error, to two digits of the error."""
    value, error = number.value, number.error
    if not math.isfinite(value):
        return "not known"
    if error > 0.0 and math.isfinite(error):
        digits = max(1 - math.floor(math.log10(error)), 0)
        if digits <= 7:
            return f"{value:.{digits}f} ± {error:.{digits}f}".replace("-", MINUS)
        return f"{value:.2g} ± {error:.1g}".replace("-", MINUS)
    small = value != 0.0 and abs(value) < 1e-3
    return (f"{value:.2g}" if small else f"{value:.4g}").replace("-", MINUS)


def short(number: Number) -> str:
    """Return a number without its error, to a digit that is worth half of the error or more."""
    value, error = number.value, number.error
    if not math.isfinite(value):
        return "not known"
    if value == 0.0 and error == 0.0:
        return "0"
    size = abs(value) or error
    places = 2 - math.floor(math.log10(size))  # three digits at most
    if error > 0.0:
        places = min(places, math.floor(-math.log10(0.5 * error)))
    value = round(value, places) + 0.0
    return f"{value:,.{max(places, 0)}f}".replace("-", MINUS)


def write_csv(findings: Sequence[Finding], path: Path) -> None:
    """Write every number of every claim, one a row."""
    rows = []
    for finding in findings:
        for series in (*finding.judged, *finding.beside):
            for key, number in series.rows:
                ratio, case = (key, "") if isinstance(key, float) else ("", key)
                rows.append({
                    "claim": finding.claim.name, "verdict": finding.verdict.value,
                    "quantity": series.label, "xi_0/h_n": ratio, "case": case,
                    "value": number.value, "error": number.error, "unit": series.unit,
                    "judged": series in finding.judged,
                })  # fmt: skip
    pd.DataFrame(rows).to_csv(path, index=False)

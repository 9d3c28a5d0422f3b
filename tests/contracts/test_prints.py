"""Laws of printed results: a number is that of its name, in the unit beside it."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from contracts.bodies import World
from contracts.test_plots import coefficients, fit, in_si, uniform
from contracts.test_results import LOCAL, QUIET, chance, design

import stiction as st

pytestmark = pytest.mark.filterwarnings("ignore")
RATE = "problem.friction.weakening_rate"


def posterior(w: World) -> Any:
    rates = 0.2e12 * w.factor("Pa m-1"), 0.4e12 * w.factor("Pa m-1")
    given = {"prior": {"marginal.low": (0.3, 0.5), RATE: rates}, "unit": "Pa", "samples": 100}
    peaks = np.array([0.7e6, 0.72e6, 0.75e6]) * w.Pa
    return st.infer(uniform(w), coefficients(w), peaks, method=w.method, **given, **QUIET)


PRINTED: dict[str, Any] = {
    "design": design, "chance": chance, "fit": fit, "posterior": posterior,
    "fit of strength": lambda w: fit(w, 2e6 * w.Pa, "strength"),
    "sample": lambda w: w.problem.sample(w.profiles()),
    "statistics": lambda w: st.theory.nucleation_statistics(uniform(w), coefficients(w)),
}  # fmt: skip
NAMED: dict[str, Any] = {  # rows whose names are not those of attributes
    "standard deviation": lambda result: result.variance**0.5,
    "mean of the strength": lambda result: result.strength_mean,
    "its standard deviation": lambda result: result.strength_variance**0.5,
    "coefficient of variation": lambda result: result.cv,
}
NUMBER, UNIT = r"-?\d[\d.]*(?:e[+-]?\d+)?", r"[GMkm\u00b5]?(?:Pa m-1|Pa|N|m)"


def rows_of(result: Any) -> Any:
    """Names of printed rows, with their numbers in SI and the unit of these; then of remarks."""
    for line in str(result).splitlines()[2:]:
        name, *columns = re.split(r" {2,}", line.strip())
        if columns and (numbers := re.findall(NUMBER, "  ".join(columns[:2]))):
            units = [column for column in columns if re.fullmatch(UNIT, column)]
            yield name, *in_si(np.array(numbers[:3], dtype=float), f"({''.join(units)})")
            for number, unit in re.findall(rf"({NUMBER}) ({UNIT})\b", columns[-1]):
                yield "", *in_si(np.array([float(number)]), f"({unit})")


def stated(result: Any, name: str) -> list[Any]:
    """What a result itself states by a name: a number or a mean, and its interval or range."""
    key, mean = name.replace(" ", "_"), getattr(result, "mean", None)
    numbers = getattr(result, "parameters", mean if isinstance(mean, dict) else {})
    values = NAMED[name](result) if name in NAMED else numbers.get(name)
    values = np.ravel(getattr(result, key) if values is None else values)
    values = values[np.isfinite(values)]
    intervals = getattr(result, "interval", {key: (values.min(), values.max())})
    return [values.mean(), *intervals.get(key, ())]


@pytest.mark.parametrize("kind", PRINTED)
def test_a_printed_number_is_that_of_its_name_in_its_unit(kind):
    """In other units, each number changes as its unit says."""
    w = LOCAL("line with ends")
    result, other = PRINTED[kind](w), w.in_units(Pa=0.25, m=4.0, s=8.0)
    rows, scaled = [*rows_of(result)], [*rows_of(PRINTED[kind](other))]
    assert rows
    for (name, numbers, unit), (_, others, known) in zip(rows, scaled, strict=True):
        close = {"atol": 6e-3 * np.abs(numbers).max(), "err_msg": name}  # of three digits
        np.testing.assert_allclose(others / other.factor(unit), numbers, **close)
        assert unit == known
        if name:
            right = stated(result, name)[: len(numbers)]
            np.testing.assert_allclose(numbers, right, **close)

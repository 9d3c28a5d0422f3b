"""The scatter between specimens, and records without it."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2

from stiction.base.arrays import Array
from stiction.base.errors import InputError

MOST_SCATTER = math.log(2.0)
"""Largest variance between specimens of the logarithm that is searched: a factor of cv 1."""


def levels_of(rows: Sequence[Array]) -> Array:
    """Return the means of records of different specimens, (records,)."""
    levels = np.array([row.mean() for row in rows])
    if levels.min() <= 0.0:
        raise InputError(
            f"between: needs records of positive mean, got means from {levels.min():g} to"
            f" {levels.max():g}"
        )
    return levels


def as_of_one(rows: Sequence[Array], within: Array) -> list[Array]:
    """Return the records, scaled as if all came from one specimen.

    Equal means would lack the part of the variance that a field itself has from record to record.
    So the logarithms of the means are drawn together until Q(0) of `variance_between` is what it is
    without scatter between specimens; `within` are their variances from the field alone.
    """
    levels = levels_of(rows)
    if levels.size < 2:
        return list(rows)
    logarithms = np.log(levels)
    weight = 1.0 / np.maximum(within, 1e-300)
    away = logarithms - weight @ logarithms / weight.sum()
    excess = max(float(weight @ away**2) / (levels.size - 1), 1e-300)
    wanted = np.exp(away / math.sqrt(excess))
    factors = wanted / wanted.mean() * levels.mean() / levels
    return [row * factor for row, factor in zip(rows, factors, strict=True)]


def _weighed(values: Array, within: Array, s: float) -> tuple[float, float, float]:
    """Mean of values at a variance s between records, its variance, and Q(s)."""
    weight = 1.0 / (s + within)
    middle = float(weight @ values / weight.sum())
    return middle, 1.0 / float(weight.sum()), float(weight @ (values - middle) ** 2)


def chance_of_scatter(levels: Array, variances: Array) -> float:
    """Return how likely records of one field scatter at least as much about a common mean."""
    return float(chi2.sf(_weighed(levels, variances, 0.0)[2], levels.size - 1))


def variance_between(logarithms: Array, within: Array, level: float) -> float:
    """Return the variance s between records at which Q(s) is as large as `level`.

    Q(s) = sum (L - m(s))^2/(s + v) is chi-square distributed with one degree of freedom
    less than records at the true variance s of the logarithms L (Viechtbauer, 2007),
    whatever their number. `within` are the variances v of the logarithms from the field
    alone, (records,).
    """

    def excess(s: float) -> float:
        return _weighed(logarithms, within, s)[2] - level

    if excess(0.0) <= 0.0:
        return 0.0
    if excess(MOST_SCATTER) >= 0.0:
        return MOST_SCATTER
    return float(brentq(excess, 0, MOST_SCATTER))


def scatter_between(logarithms: Array, within: Array) -> float:
    """Estimate the coefficient of variation of a log-normal factor between records.

    It is where Q is as large as expected (Paule and Mandel, 1982); 0 of a single record.
    """
    if logarithms.size < 2:
        return 0.0
    return math.sqrt(math.expm1(variance_between(logarithms, within, logarithms.size - 1)))

"""The scatter between specimens, and records without it."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2
from scipy.stats import t as student

from stiction.base.arrays import Array
from stiction.base.errors import InputError

MOST_SCATTER = math.log(2.0)
"""Largest variance between specimens of the logarithm that is searched: a factor of cv 1."""


def levels_of(rows: Sequence[Array]) -> Array:
    """Return the means of records of different specimens, (records,)."""
    levels = np.array([row.mean() for row in rows])
    if len(rows) < 2 or levels.min() <= 0.0:
        raise InputError(
            f"between: needs several records of positive mean, got {len(rows)} with means from"
            f" {levels.min():g} to {levels.max():g}"
        )
    return levels


def as_of_one(rows: Sequence[Array], within: Array) -> list[Array]:
    """Return the records, scaled as if all came from one specimen.

    Equal means would lack the part of the variance that a field itself has from record to record.
    So the logarithms of the means are drawn together until Q(0) of `variance_between` is what it is
    without scatter between specimens; `within` are their variances from the field alone.
    """
    levels = levels_of(rows)
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


def likely_between(
    logarithms: Array, within: Array, count: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Draw likely variances between records, and the logarithm of the mean with each, (count,).

    Levels of Q are those of chi-square that `MOST_SCATTER` leaves; given s, the mean
    logarithm is normal. Factors are log-normal with mean 1.
    """
    freedom = logarithms.size - 1
    least = chi2.cdf(_weighed(logarithms, within, MOST_SCATTER)[2], freedom)
    shares, errors = rng.spawn(2)  # each draw depends on its number only
    levels = chi2.ppf(least + (1.0 - least) * shares.random(count), freedom)
    found = np.array([variance_between(logarithms, within, float(level)) for level in levels])
    middles = [_weighed(logarithms, within, float(s))[:2] for s in found]
    means = [
        m + math.sqrt(v) * z
        for (m, v), z in zip(middles, errors.standard_normal(count), strict=True)
    ]
    return found, np.array(means) + 0.5 * (found + within.mean())


def scatter_between(
    logarithms: Array, within: Array, confidence: float
) -> tuple[float, tuple[float, float], float]:
    """Estimate the coefficient of variation of a log-normal factor between records.

    The estimate is where Q is as large as expected (Paule and Mandel, 1982). Returns the
    coefficient, its interval, and half the width of that of the mean logarithm.
    """
    freedom, tail = logarithms.size - 1, 0.5 * (1.0 - confidence)
    levels = (freedom, chi2.ppf(1.0 - tail, freedom), chi2.ppf(tail, freedom))
    found, low, high = (variance_between(logarithms, within, float(one)) for one in levels)
    error = float((1.0 / (found + within)).sum() ** -0.5)
    cv, least, most = (math.sqrt(math.expm1(s)) for s in (found, low, high))
    return cv, (least, most), float(student.ppf(0.5 + 0.5 * confidence, freedom)) * error

"""Estimate the scatter between specimens, and remove it from records.

Problem. Records k = 1, ..., n from different specimens have means with
logarithms L_k. The field alone gives L_k the variance v_k. Estimate the
variance s between specimens, and scale the records as if all came from
one specimen.

Sources. Paule and Mandel (1982), Journal of Research
of the National Bureau of Standards 87, 377.
Viechtbauer (2007), Statistics in Medicine 26, 37.

Steps:

1. With weights 1/(s + v_k), take the mean m(s) of the logarithms and
   Q(s) = sum (L_k - m(s))^2/(s + v_k). At the true s, Q has a
   chi-square distribution with n - 1 degrees of freedom.
2. Estimate s from Q(s) = n - 1, the mean of this distribution. Use s =
   0 if Q(0) is smaller.
3. Reduce the differences between the logarithms until Q(0) = n - 1, and
   scale the records to these means. Equal means would lack the variance
   that the field alone causes between records.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2

from stiction.base.arrays import Array
from stiction.base.errors import InputError

MOST_SCATTER = math.log(2.0)
"""Largest variance s of the search, of a log-normal factor with coefficient of variation 1."""


def levels_of(rows: Sequence[Array]) -> Array:
    """Return the means of records from different specimens."""
    levels = np.array([row.mean() for row in rows])
    if levels.min() <= 0.0:
        raise InputError(f"between: needs records with a positive mean. Got {levels.min():g}")
    return levels


def as_of_one(rows: Sequence[Array], within: Array) -> list[Array]:
    """Return the records scaled as if all came from one specimen (step 3).

    `within` holds the variances v_k.
    """
    levels = levels_of(rows)
    if levels.size < 2:
        return list(rows)
    logarithms = np.log(levels)
    # Records of a uniform field have no variance of their own.
    weight = 1.0 / np.maximum(within, 1e-300)
    away = logarithms - weight @ logarithms / weight.sum()
    excess = max(float(weight @ away**2) / (levels.size - 1), 1e-300)
    wanted = np.exp(away / math.sqrt(excess))
    # The mean over all records stays.
    factors = wanted / wanted.mean() * levels.mean() / levels
    return [row * factor for row, factor in zip(rows, factors, strict=True)]


def _q(values: Array, within: Array, s: float) -> float:
    """Return Q(s) for values (step 1)."""
    weight = 1.0 / (s + within)
    middle = float(weight @ values / weight.sum())
    return float(weight @ (values - middle) ** 2)


def chance_of_scatter(levels: Array, variances: Array) -> float:
    """Return the probability that records from one field scatter as much about a common mean."""
    return float(chi2.sf(_q(levels, variances, 0.0), levels.size - 1))


def scatter_between(logarithms: Array, within: Array) -> float:
    """Estimate the coefficient of variation of a log-normal factor between records (step 2).

    For a single record the estimate is 0.
    """
    # Q falls as s rises.
    freedom = logarithms.size - 1
    if _q(logarithms, within, 0.0) <= freedom:
        return 0.0
    if _q(logarithms, within, MOST_SCATTER) >= freedom:
        return math.sqrt(math.expm1(MOST_SCATTER))
    variance = brentq(lambda s: _q(logarithms, within, s) - freedom, 0, MOST_SCATTER)
    return math.sqrt(math.expm1(variance))

"""Scatter from specimen to specimen, estimated from the means of several records."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2
from scipy.stats import t as student

from stiction.arrays import Array
from stiction.inference.whittle import Model
from stiction.inference.window import Window

LARGEST = 9.0
"""Largest variance of the logarithm that is searched."""


def variances_within(model: Model, cv: float, windows: Sequence[Window]) -> Array:
    """Return variances of the logarithms of record means from a field of one `cv`, (records,)."""
    known = {
        one: one.variance_of_mean(model.correlation(one)) for one in dict.fromkeys(windows)
    }
    return np.log1p([cv**2 * known[window] for window in windows])


def scatter_between(
    logarithms: Array, within: Array, confidence: float
) -> tuple[float, tuple[float, float], float]:
    """Estimate the coefficient of variation of a log-normal factor between records.

    Q(s) = sum (L - m(s))^2/(s + v) is chi-square distributed with one degree of freedom
    less than records at the true variance s of the logarithms L (Viechtbauer, 2007),
    whatever their number; the estimate is where Q is as large as that (Paule and Mandel,
    1982). `within` are the variances v of the logarithms from the field alone, (records,).
    Returns the coefficient, its interval, and half the width of that of the mean logarithm.
    """
    freedom = logarithms.size - 1

    def excess(s: float, level: float) -> float:
        weight = 1.0 / (s + within)
        middle = float(weight @ logarithms / weight.sum())
        return float(weight @ (logarithms - middle) ** 2) - level

    def where(level: float) -> float:
        if excess(0.0, level) <= 0.0:
            return 0.0
        if excess(LARGEST, level) >= 0.0:
            return LARGEST
        return float(brentq(excess, 0, LARGEST, args=(level,)))

    tail = 0.5 * (1.0 - confidence)
    levels = (freedom, chi2.ppf(1.0 - tail, freedom), chi2.ppf(tail, freedom))
    found, low, high = (where(float(level)) for level in levels)
    error = float((1.0 / (found + within)).sum() ** -0.5)
    cv, least, most = (math.sqrt(math.expm1(s)) for s in (found, low, high))
    return cv, (least, most), float(student.ppf(0.5 + 0.5 * confidence, freedom)) * error

"""Scatter from specimen to specimen: what the means of several records tell of it."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2

from stiction.arrays import Array
from stiction.inference.window import Window
from stiction.interface import Interface
from stiction.random.random_field import RandomField

SAMPLES = 400
LARGEST = 9.0
"""Largest variance of the logarithm that is searched."""


def variances_within(field: RandomField, windows: Sequence[Window]) -> Array:
    """Return the variances that logarithms of record means have from the field alone.

    From samples of the field on interfaces twice as long as each record.
    """
    known: dict[int, float] = {}
    for window in windows:
        if id(window) in known:
            continue
        shape: Any = tuple(2 * n for n in window.shape)
        lengths: Any = tuple(n * h for n, h in zip(shape, window.spacings, strict=True))
        if len(shape) == 1:
            (lengths,), (shape,) = lengths, shape
        interface = Interface(length=lengths, nodes=shape)
        draws = field.draws(interface, SAMPLES, 0)
        inside = np.zeros(interface.shape, dtype=np.bool_)
        inside[tuple(slice(n) for n in window.shape)] = window.measured
        means = field.profiles(interface, draws)[:, inside].mean(axis=1)
        known[id(window)] = float(np.log(means).var())
    return np.array([known[id(window)] for window in windows])


def scatter_between(
    logarithms: Array, within: Array, confidence: float
) -> tuple[float, tuple[float, float], float]:
    """Estimate the coefficient of variation of a log-normal factor between records.

    Q(s) = sum (L - m(s))^2/(s + v) is chi-square distributed with one degree of freedom less than
    records at the true variance s of the logarithms (Viechtbauer, 2007), whatever their number;
    the estimate is where Q is as large as that (Paule and Mandel, 1982).

    Parameters
    ----------
    logarithms : (records,) array
        Of the means of records.
    within : (records,) array
        Variances that these have from the field alone.
    confidence : float

    Returns
    -------
    float
        The coefficient of variation.
    (float, float)
        Its interval.
    float
        The standard error of the mean logarithm.
    """
    freedom = logarithms.size - 1

    def q(s: float) -> float:
        weight = 1.0 / (s + within)
        middle = float(weight @ logarithms / weight.sum())
        return float(weight @ (logarithms - middle) ** 2)

    def where(level: float) -> float:
        if q(0.0) <= level:
            return 0.0
        return (
            LARGEST
            if q(LARGEST) >= level
            else float(brentq(lambda s: q(s) - level, 0, LARGEST))
        )

    tail = 0.5 * (1.0 - confidence)
    levels = (freedom, chi2.ppf(1.0 - tail, freedom), chi2.ppf(tail, freedom))
    found, low, high = (where(float(level)) for level in levels)
    error = float((1.0 / (found + within)).sum() ** -0.5)
    cv, least, most = (math.sqrt(math.expm1(s)) for s in (found, low, high))
    return cv, (least, most), error

"""Quantiles with confidence bands from order statistics: no assumption on the distribution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from stiction._checks import is_real, numbers
from stiction.errors import InputError
from stiction.model import brief, describe
from stiction.statistics.estimates import Estimate, as_sample

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Quantiles:
    """Quantiles of a sample.

    Attributes
    ----------
    probability : (m,) array
    value : (m,) array
        The sample quantiles, in the unit of the values.
    lower, upper : (m,) arrays
        Ends of the confidence interval of each; infinite where the sample is too small to bound
        that quantile.
    confidence : float
        Coverage of each interval, at least.
    """

    probability: Array
    value: Array
    lower: Array
    upper: Array
    confidence: float

    __repr__ = brief


def quantiles(values: Any, probability: Any, *, confidence: float = 0.95) -> Quantiles:
    """Quantiles of independent values with distribution-free confidence intervals.

    Parameters
    ----------
    values : (samples,) array
        For example the critical stress of a Monte Carlo ensemble, Pa.
    probability : float or (m,) array
        Between 0 and 1, exclusive.
    confidence : float
        Coverage of each interval, in (0, 1).

    Returns
    -------
    Quantiles

    Raises
    ------
    InputError
        If there are no values, a value is not finite or a probability is out of range.

    Notes
    -----
    The number of values below the p-quantile is binomial (N, p); the interval runs between the
    order statistics whose ranks hold it with the asked probability (David and Nagaraja, 2003,
    Sec. 7.1). The coverage is exact for continuous distributions, rounded up to whole ranks.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> found = st.quantiles(np.random.default_rng(0).normal(size=2000), [0.5])
    >>> bool(found.lower[0] < 0.0 < found.upper[0])
    True
    """
    ordered = np.sort(as_sample(values, 1))
    p = np.atleast_1d(numbers("probability", probability))
    problems = []
    if p.ndim != 1 or not np.all((p > 0.0) & (p < 1.0)):
        problems.append(
            f"probability: must be between 0 and 1, exclusive, got {describe(probability)}"
        )
    if not (is_real(confidence) and 0.0 < confidence < 1.0):
        given = describe(confidence)
        problems.append(f"confidence: must be between 0 and 1, exclusive, got {given}")
    if problems:
        raise InputError(problems)
    n = ordered.size
    tail = 0.5 * (1.0 - confidence)
    # Rank r is a lower end if fewer than r values fall below the quantile with probability <= tail.
    low = scipy.stats.binom.ppf(tail, n, p).astype(int)  # P(B <= low - 1) < tail <= P(B <= low)
    high = scipy.stats.binom.isf(tail, n, p).astype(int) + 1  # P(B >= high) <= tail
    padded = np.concatenate(([-np.inf], ordered, [np.inf]))
    return Quantiles(
        probability=p,
        value=np.quantile(ordered, p, method="median_unbiased"),
        lower=padded[np.clip(low, 0, n + 1)],
        upper=padded[np.clip(high, 0, n + 1)],
        confidence=float(confidence),
    )


def quantile_distance(values: Any, low: float, high: float) -> Estimate:
    """Distance of two quantiles of independent values, with its standard error.

    Parameters
    ----------
    values : (samples,) array
    low, high : float
        Probabilities, 0 < low < high < 1: 0.25 and 0.75 for the quartile range.

    Returns
    -------
    Estimate, in the unit of the values

    Notes
    -----
    Error by the influence function (1{x > q_p} - (1 - p))/f(q_p) of a quantile, the density f from
    the order statistics N^(-1/5)/5 to either side.

    Raises
    ------
    InputError
        If there are fewer than 16 values, or the probabilities are not in order.
    """
    if not (is_real(low) and is_real(high) and 0.0 < low < high < 1.0):
        given = f"{describe(low)} and {describe(high)}"
        raise InputError(f"low, high: must be 0 < low < high < 1, got {given}")
    sample = as_sample(values, 16)
    reach = 0.2 * sample.size**-0.2

    def influence(p: float) -> tuple[float, Array]:
        ends = np.clip((p - reach, p + reach), 0.0, 1.0)
        below, middle, above = np.quantile(sample, (ends[0], p, ends[1]))
        density = (ends[1] - ends[0]) / max(float(above - below), np.finfo(float).tiny)
        return float(middle), ((sample > middle) - (1.0 - p)) / density

    first, second = influence(low), influence(high)
    error = float((second[1] - first[1]).std(ddof=1)) / sample.size**0.5
    return Estimate(second[0] - first[0], error)

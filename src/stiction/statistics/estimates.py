"""Estimates with standard errors: means, standard deviations and quantiles of samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import Numbers, check, checked
from stiction.base.representation import Result, Row, Summary


@dataclass(frozen=True)
class WithError:
    """Estimated number and its standard error, which is zero if the number is exact."""

    value: float
    error: float = 0.0


def as_sample(values: Any, fewest: int = 2) -> Array:
    """Return finite values as a flat array with at least `fewest` entries."""
    array = check("values", values, Numbers).ravel()
    if array.size < fewest:
        raise InputError(f"values: at least {fewest} are needed, got {array.size}")
    if not np.all(np.isfinite(array)):
        entry = int(np.argmin(np.isfinite(array)))
        raise InputError(f"values: must be finite, but entry {entry} is {array[entry]}")
    return array


def mean(values: Any) -> WithError:
    """Estimate the mean of independent values (samples,), in the unit of the values."""
    sample = as_sample(values)
    return WithError(float(sample.mean()), float(sample.std(ddof=1)) / math.sqrt(sample.size))


def standard_deviation(values: Any) -> WithError:
    """Estimate the standard deviation of independent values (samples,), in their unit.

    The error, sqrt((m_4 - s^4)/N)/(2 s), follows from the fourth moment with the
    delta method. A Gaussian distribution is not assumed.
    """
    sample = as_sample(values)
    s = float(sample.std(ddof=1))
    fourth = float(np.mean((sample - sample.mean()) ** 4))
    error = math.sqrt(max(fourth - s**4, 0.0) / sample.size)
    return WithError(s, error / (2.0 * s) if s else 0.0)


@dataclass(frozen=True, eq=False, repr=False)
class Quantiles(Result):
    """Quantiles of a sample.

    Attributes
    ----------
    probability : (m,) array
    value : (m,) array
        Quantiles of the sample, in the unit of the values.
    lower, upper : (m,) arrays
        Ends of the 95 % confidence intervals. An end is infinite if the sample is too
        small to bound a quantile.
    unit : str
        Unit of the values, if they state a unit, as an `xarray.DataArray` does.
    """

    probability: Array
    value: Array
    lower: Array
    upper: Array
    unit: str = ""

    def _summary(self) -> Summary:
        pairs = zip(self.lower.tolist(), self.upper.tolist(), strict=True)
        rows = [
            Row(f"{probability:g}", value, ends, self.unit)
            for probability, value, ends in zip(
                self.probability, self.value, pairs, strict=True
            )
        ]
        return Summary("Quantiles of a sample", rows, "95 % interval")


@checked
def quantiles(values: Any, probability: Numbers) -> Quantiles:
    """Estimate quantiles of independent values, with distribution-free confidence intervals.

    Parameters
    ----------
    values : (samples,) array
        Values, for example critical stresses from `monte_carlo`, Pa.
    probability : float or (m,) array
        Probabilities of the quantiles, between 0 and 1, exclusive.

    Notes
    -----
    The number of values below the p-quantile is binomial (N, p). The ends of the interval
    are order statistics. The number lies between their ranks with a probability of 95 %
    (David and Nagaraja, 2003, Sec. 7.1). The coverage is exact for continuous
    distributions, rounded up to whole ranks.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> found = st.statistics.quantiles(np.random.default_rng(0).normal(size=2000), [0.5])
    >>> bool(found.lower[0] < 0.0 < found.upper[0])
    True
    """
    ordered = np.sort(as_sample(values, 1))
    p = np.atleast_1d(probability)
    if (wrong := p[~((p > 0.0) & (p < 1.0))]).size:
        raise InputError(f"probability: must be between 0 and 1, exclusive, got {wrong[0]:g}")
    n, tail = ordered.size, 0.025
    # Rank r is a lower end if fewer than r values lie below the quantile with
    # probability <= tail.
    low = scipy.stats.binom.ppf(tail, n, p).astype(int)  # P(B <= low - 1) < tail <= P(B <= low)
    high = scipy.stats.binom.isf(tail, n, p).astype(int) + 1  # P(B >= high) <= tail
    padded = np.concatenate(([-np.inf], ordered, [np.inf]))
    value = np.quantile(ordered, p, method="median_unbiased")
    lower, upper = padded[np.clip(low, 0, n + 1)], padded[np.clip(high, 0, n + 1)]
    return Quantiles(p, value, lower, upper, getattr(values, "attrs", {}).get("units", ""))

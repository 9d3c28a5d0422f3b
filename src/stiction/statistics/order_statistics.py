"""Quantiles with confidence bands from order statistics: no assumption on the distribution."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import Numbers, Real, brief, checked, describe
from stiction.statistics.estimates import as_sample


@dataclass(frozen=True, eq=False)
class Quantiles:
    """Quantiles of a sample.

    Attributes
    ----------
    probability : (m,) array
    value : (m,) array
        The sample quantiles, in the unit of the values.
    lower, upper : (m,) arrays
        Ends of the confidence interval of each; infinite where the sample is too small to
        bound that quantile.
    confidence : float
        Coverage of each interval, at least.
    """

    probability: Array
    value: Array
    lower: Array
    upper: Array
    confidence: float

    __repr__ = brief


@checked
def quantiles(values: Any, probability: Numbers, *, confidence: Real = 0.95) -> Quantiles:
    """Estimate quantiles of independent values, with distribution-free confidence intervals.

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
    The number of values below the p-quantile is binomial (N, p); the interval runs between
    the order statistics whose ranks hold it with the asked probability (David and Nagaraja,
    2003, Sec. 7.1). The coverage is exact for continuous distributions, rounded up to whole
    ranks.

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
    problems = [
        f"{name}: must be between 0 and 1, exclusive, got {describe(value)}"
        for name, value in (("probability", probability), ("confidence", confidence))
        if not np.all((np.asarray(value) > 0.0) & (np.asarray(value) < 1.0))
    ]
    if problems:
        raise InputError(problems)
    n = ordered.size
    tail = 0.5 * (1.0 - confidence)
    # Rank r is a lower end if fewer than r values lie below the quantile with probability <= tail.
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

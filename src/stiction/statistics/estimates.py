"""Estimates with standard errors: means, standard deviations and quantiles of samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats
from scipy.special import stdtrit

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import Numbers, brief, check, checked


@dataclass(frozen=True)
class WithError:
    """An estimated number and its standard error, zero if exact."""

    value: float
    error: float = 0.0

    def __sub__(self, other: WithError | float) -> WithError:
        other = other if isinstance(other, WithError) else WithError(other)
        return WithError(self.value - other.value, math.hypot(self.error, other.error))


def as_sample(values: Any, fewest: int = 2) -> Array:
    """Return finite values, at least `fewest`, as a flat array."""
    array = check("values", values, Numbers).ravel()
    if array.size < fewest:
        raise InputError(f"values: at least {fewest} are needed, got {array.size}")
    if not np.all(np.isfinite(array)):
        entry = int(np.argmin(np.isfinite(array)))
        raise InputError(f"values: must be finite; entry {entry} is not")
    return array


def mean(values: Any) -> WithError:
    """Estimate the mean of independent values (samples,), in their unit."""
    sample = as_sample(values)
    return WithError(float(sample.mean()), float(sample.std(ddof=1)) / math.sqrt(sample.size))


def standard_deviation(values: Any) -> WithError:
    """Estimate the standard deviation of independent values (samples,), in their unit.

    Error by the delta method from the fourth moment: sqrt((m_4 - s^4)/N)/(2 s), without a
    Gaussian assumption.
    """
    sample = as_sample(values)
    s = float(sample.std(ddof=1))
    fourth = float(np.mean((sample - sample.mean()) ** 4))
    error = math.sqrt(max(fourth - s**4, 0.0) / sample.size)
    return WithError(s, error / (2.0 * s) if s else 0.0)


@dataclass(frozen=True)
class Combined:
    """A mean from all methods, with the standard error of the expensive results by themselves."""

    estimate: WithError
    plain_error: float
    freedom: int  # of the error of the estimate

    @property
    def saving(self) -> float:
        """How many times as many expensive results alone would have the same error."""
        return (self.plain_error / self.estimate.error) ** 2

    def interval(self) -> tuple[float, float]:
        """Return the 95 % interval by Student's distribution, in the unit of the values."""
        half = float(stdtrit(self.freedom, 0.975)) * self.estimate.error
        return self.estimate.value - half, self.estimate.value + half


def combined_mean(expensive: Any, *inexpensive: Any) -> Combined:
    """Estimate the mean of few expensive results, with many inexpensive ones as controls.

    The results may be onsets by `Rupture`, `Equilibrium` and `LocalCriterion` with one seed.
    What a method gets right about the next more expensive one is averaged over all of its own
    samples, what it gets wrong over those of the latter only (Peherstorfer et al., 2016).

    Parameters
    ----------
    expensive : (n,) array
        Results of samples 0 to n - 1, at least three.
    *inexpensive : (N_1,), (N_2,), ... arrays
        Results of the same samples first and then of more; each is at least as long as the last.

    Notes
    -----
    With n expensive results the error has n - 2 degrees of freedom, since mean and weight
    are estimated from them: for small n, use the interval and not twice the error.

    Examples
    --------
    >>> import stiction as st
    >>> found = st.statistics.combined_mean([1.0, 2.1, 2.9], [0.9, 2.0, 2.8, 1.7, 2.2, 1.9])
    >>> round(found.estimate.value, 3)
    2.017
    >>> found.estimate.error < found.plain_error
    True
    """
    first, chain = as_sample(expensive, 3), [as_sample(one, 3) for one in inexpensive]
    sizes = [first.size, *(results.size for results in chain)]
    if sizes != sorted(sizes):
        raise InputError(
            f"inexpensive: each must have at least as many results as the one before, got {sizes}"
            " samples"
        )
    value, variance = _telescoped(first, chain)
    plain, freedom = math.sqrt(_telescoped(first, [])[1]), first.size - (2 if chain else 1)
    return Combined(WithError(value, math.sqrt(variance)), plain, freedom)


def _telescoped(results: Array, chain: Sequence[Array]) -> tuple[float, float]:
    """Return mean_n(Y - a X) + a E[X] and its variance, Var(Y - a X)/n + a^2 Var(E[X]).

    E[X] is from the rest of the chain. For a = Cov(X, Y)/Var(X) the two terms do not covary.
    """
    if not chain:
        return float(results.mean()), float(results.var(ddof=1)) / results.size
    own = chain[0][: results.size]
    spread = float(own.var(ddof=1))
    weight = float(np.cov(results, own)[0, 1]) / spread if spread > 0.0 else 0.0
    rest = results - weight * own
    value, variance = _telescoped(chain[0], chain[1:])
    variance = float(rest.var(ddof=2)) / rest.size + weight**2 * variance
    return float(rest.mean()) + weight * value, variance


@dataclass(frozen=True, eq=False)
class Quantiles:
    """Quantiles of a sample.

    Attributes
    ----------
    probability : (m,) array
    value : (m,) array
        The sample quantiles, in the unit of the values.
    lower, upper : (m,) arrays
        Ends of the 95 % confidence interval of each; infinite where the sample is too small to
        bound that quantile.
    """

    probability: Array
    value: Array
    lower: Array
    upper: Array

    __repr__ = brief


@checked
def quantiles(values: Any, probability: Numbers) -> Quantiles:
    """Estimate quantiles of independent values, with distribution-free confidence intervals.

    Parameters
    ----------
    values : (samples,) array
        For example the critical stress of a Monte Carlo ensemble, Pa.
    probability : float or (m,) array
        Between 0 and 1, exclusive.

    Notes
    -----
    The number of values below the p-quantile is binomial (N, p); the interval runs between
    the order statistics whose ranks contain it with a probability of 95 % (David and
    Nagaraja, 2003, Sec. 7.1). The coverage is exact for continuous distributions, rounded
    up to whole ranks.

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
    # Rank r is a lower end if fewer than r values lie below the quantile with probability <= tail.
    low = scipy.stats.binom.ppf(tail, n, p).astype(int)  # P(B <= low - 1) < tail <= P(B <= low)
    high = scipy.stats.binom.isf(tail, n, p).astype(int) + 1  # P(B >= high) <= tail
    padded = np.concatenate(([-np.inf], ordered, [np.inf]))
    value = np.quantile(ordered, p, method="median_unbiased")
    lower, upper = padded[np.clip(low, 0, n + 1)], padded[np.clip(high, 0, n + 1)]
    return Quantiles(p, value, lower, upper)

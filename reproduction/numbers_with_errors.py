"""Numbers with standard errors, from independent samples."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom


@dataclass(frozen=True)
class Number:
    """A value and its standard error, zero for what is exact."""

    value: float
    error: float = 0.0

    def __mul__(self, factor: float) -> Number:
        return Number(self.value * factor, self.error * abs(factor))

    def __sub__(self, subtrahend) -> Number:
        subtrahend = subtrahend if isinstance(subtrahend, Number) else Number(float(subtrahend))
        return Number(self.value - subtrahend.value, math.hypot(self.error, subtrahend.error))

    def __truediv__(self, divisor) -> Number:
        divisor = divisor if isinstance(divisor, Number) else Number(float(divisor))
        value = self.value / divisor.value
        parts = (self.error / divisor.value, value * divisor.error / divisor.value)
        return Number(value, math.hypot(*parts))

    def __abs__(self) -> Number:
        return Number(abs(self.value), self.error)


def mean(values) -> Number:
    """Return the mean."""
    values = np.ravel(values)
    return Number(float(values.mean()), float(values.std(ddof=1)) / math.sqrt(values.size))


def deviation(values) -> Number:
    """Return the standard deviation; the error is from the fourth moment."""
    values = np.ravel(values)
    s = float(values.std(ddof=1))
    fourth = float(np.mean((values - values.mean()) ** 4))
    error = math.sqrt(max(fourth - s**4, 0.0) / values.size) / (2.0 * s) if s else 0.0
    return Number(s, error)


def skewness(values) -> Number:
    """Return the skewness; the error is that of its influence function."""
    values = np.ravel(values)
    u = (values - values.mean()) / values.std()
    g = float(np.mean(u**3))
    influence = u**3 - g - 3.0 * u - 1.5 * g * (u * u - 1.0)
    return Number(g, float(influence.std()) / math.sqrt(values.size))


def share(events) -> Number:
    """Return the share of events that happened, with the error of Agresti and Coull (1998)."""
    events = np.ravel(events).astype(bool)
    n = events.size + 4.0
    adjusted = (events.sum() + 2.0) / n
    return Number(float(events.mean()), math.sqrt(adjusted * (1.0 - adjusted) / n))


def chance_of_so_many(events, usual: Number) -> Number:
    """Return the chance of at least so many events at the usual share plus three errors."""
    events = np.ravel(events).astype(bool)
    probability = min(usual.value + 3.0 * usual.error, 1.0)
    return Number(float(binom.sf(events.sum() - 1, events.size, probability)))


def root_mean_square(values) -> Number:
    """Return the root mean square."""
    square = mean(np.ravel(values) ** 2)
    root = math.sqrt(square.value)
    return Number(root, square.error / (2.0 * root) if root else 0.0)


def _quantile_influence(values, p: float):
    """Return a quantile and the influence of each value on it."""
    reach = min(0.5 * values.size ** (-1.0 / 3.0), p, 1.0 - p)
    low, at, high = np.quantile(values, [p - reach, p, p + reach])
    return at, (p - (values < at)) * (high - low) / (2.0 * reach)


def quantile(values, p: float) -> Number:
    """Return a quantile."""
    values = np.ravel(values)
    at, influence = _quantile_influence(values, p)
    return Number(float(at), float(influence.std()) / math.sqrt(values.size))


def lower_spread(values, upper: float = 0.5) -> Number:
    """Return the median less the lower quartile, the spread that the paper plots."""
    values = np.ravel(values)
    high, upper_influence = _quantile_influence(values, upper)
    quartile, quartile_influence = _quantile_influence(values, 0.25)
    return Number(
        float(high - quartile),
        float((upper_influence - quartile_influence).std()) / math.sqrt(values.size),
    )


def ratio_of_means(values, divisors) -> Number:
    """Return the ratio of the means of paired values."""
    values, divisors = np.ravel(values), np.ravel(divisors)
    ratio = float(values.mean() / divisors.mean())
    error = float((values - ratio * divisors).std()) / abs(float(divisors.mean()))
    return Number(ratio, error / math.sqrt(values.size))


def pooled_moments(sums) -> tuple[Number, Number, Number]:
    """Return mean, standard deviation and skewness of a stationary field.

    `sums` holds, for each sample, the means over x of d, d^2 and d^3. Values within a sample are
    correlated and samples are not, so the errors come from the scatter between samples.
    """
    sums = np.asarray(sums)
    a1, a2, a3 = sums.mean(axis=0)
    variance = a2 - a1 * a1
    s = math.sqrt(variance)
    g = (a3 - 3.0 * a1 * a2 + 2.0 * a1**3) / s**3
    d1, d2, d3 = (sums - sums.mean(axis=0)).T
    of_variance = d2 - 2.0 * a1 * d1
    of_third = d3 - 3.0 * a2 * d1 - 3.0 * a1 * d2 + 6.0 * a1 * a1 * d1
    of_skewness = of_third / s**3 - 1.5 * g * of_variance / variance
    root = math.sqrt(sums.shape[0])
    return (
        Number(float(a1), float(d1.std()) / root),
        Number(s, float(of_variance.std()) / (2.0 * s * root)),
        Number(float(g), float(of_skewness.std()) / root),
    )


def relative_changes(values, usual) -> tuple[Number, Number]:
    """Return the relative changes of mean and standard deviation between paired samples."""
    values, usual = np.ravel(values), np.ravel(usual)
    shift = (values - usual) / usual.mean()

    def influence(x):
        return 0.5 * ((x - x.mean()) ** 2 / x.var() - 1.0)

    ratio = float(values.std() / usual.std())
    error = float((influence(values) - influence(usual)).std()) / math.sqrt(values.size)
    return mean(shift), Number(ratio - 1.0, ratio * error)

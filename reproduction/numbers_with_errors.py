"""Numbers with standard errors, from independent samples."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom

MINUS = "\N{MINUS SIGN}"


@dataclass(frozen=True)
class Number:
    """A value and its standard error, zero for what is exact."""

    value: float
    error: float = 0.0

    def __mul__(self, factor: float) -> Number:
        return Number(self.value * factor, self.error * abs(factor))

    def __add__(self, summand) -> Number:
        summand = number_of(summand)
        return Number(self.value + summand.value, math.hypot(self.error, summand.error))

    def __sub__(self, subtrahend) -> Number:
        return self + number_of(subtrahend) * -1.0

    def __truediv__(self, divisor) -> Number:
        divisor = number_of(divisor)
        value = self.value / divisor.value
        parts = (self.error / divisor.value, value * divisor.error / divisor.value)
        return Number(value, math.hypot(*parts))

    def __abs__(self) -> Number:
        return Number(abs(self.value), self.error)


def number_of(value) -> Number:
    """Return a number, exact if it has no error."""
    return value if isinstance(value, Number) else Number(float(value))


PREFIXES = {"T": 1e12, "G": 1e9, "M": 1e6, "k": 1e3, "": 1.0, "m": 1e-3, "µ": 1e-6}


def prefixed(values, unit: str) -> tuple[float, str]:
    """Return the factor and the name of the unit in which the largest value is 0.1 to 100."""
    size = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    most = 1e3 if unit == "m" else math.inf  # there are kilometres, and no megametres
    fitting = (name for name, value in PREFIXES.items() if value <= min(10.0 * size, most))
    prefix = next(fitting, "") if size else ""
    return 1.0 / PREFIXES[prefix], prefix + unit


def si(value, unit: str) -> str:
    """Return a value or a number, without its error, with the unit that suits its size."""
    number = number_of(value)
    factor, name = prefixed([number.value], unit)
    text = short(number * factor)
    exact = "." in text and not number.error
    return f"{text.rstrip('0').rstrip('.') if exact else text} {name}"


def rounded(number: Number) -> str:
    """Return a number with its error, to two digits of the error."""
    value, error = number.value, number.error
    if not math.isfinite(value):
        return "not known"
    if error > 0.0 and math.isfinite(error):
        digits = max(1 - math.floor(math.log10(error)), 0)
        if digits <= 7:
            return f"{value:.{digits}f} ± {error:.{digits}f}".replace("-", MINUS)
        return f"{value:.2g} ± {error:.1g}".replace("-", MINUS)
    small = value != 0.0 and abs(value) < 1e-3
    return (f"{value:.2g}" if small else f"{value:.4g}").replace("-", MINUS)


def short(number: Number) -> str:
    """Return a number without its error, to a digit that is worth half of the error or more."""
    value, error = number.value, number.error
    if not math.isfinite(value):
        return "not known"
    if value == 0.0 and error == 0.0:
        return "0"
    size = abs(value) or error
    places = 2 - math.floor(math.log10(size))  # three digits at most
    if error > 0.0:
        places = min(places, math.floor(-math.log10(0.5 * error)))
    if abs(value) > error:  # one digit at least
        places = max(places, -math.floor(math.log10(size)))
    value = round(value, places) + 0.0
    return f"{value:,.{max(places, 0)}f}".replace("-", MINUS)


def _estimate(value, influence) -> Number:
    """Return a statistic whose error is the scatter of the influence of each sample on it."""
    return Number(float(value), float(np.std(influence)) / math.sqrt(np.size(influence)))


def mean(values) -> Number:
    values = np.ravel(values)
    if values.size < 2:
        return Number(math.nan, math.nan)
    return Number(float(values.mean()), float(values.std(ddof=1)) / math.sqrt(values.size))


def deviation(values) -> Number:
    """Return the standard deviation; the error is from the fourth moment."""
    values = np.ravel(values)
    s = float(values.std(ddof=1))
    fourth = float(np.mean((values - values.mean()) ** 4))
    error = math.sqrt(max(fourth - s**4, 0.0) / values.size) / (2.0 * s) if s else 0.0
    return Number(s, error)


def variation(values) -> Number:
    return deviation(values) / float(np.mean(values))


def skewness(values) -> Number:
    values = np.ravel(values)
    u = (values - values.mean()) / values.std()
    g = float(np.mean(u**3))
    return _estimate(g, u**3 - g - 3.0 * u - 1.5 * g * (u * u - 1.0))


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
    square = mean(np.ravel(values) ** 2)
    root = math.sqrt(square.value)
    return Number(root, square.error / (2.0 * root) if root else 0.0)


def _quantile_influence(values, p: float):
    """Return a quantile and the influence of each value on it."""
    reach = min(0.5 * values.size ** (-1.0 / 3.0), p, 1.0 - p)
    low, at, high = np.quantile(values, [p - reach, p, p + reach])
    return at, (p - (values < at)) * (high - low) / (2.0 * reach)


def quantile(values, p: float) -> Number:
    return _estimate(*_quantile_influence(np.ravel(values), p))


def lower_spread(values, upper: float = 0.5) -> Number:
    """Return the median less the lower quartile, the spread that the paper plots."""
    high, upper_influence = _quantile_influence(np.ravel(values), upper)
    quartile, quartile_influence = _quantile_influence(np.ravel(values), 0.25)
    return _estimate(high - quartile, upper_influence - quartile_influence)


def whole_spread(values) -> Number:
    """Return the upper less the lower quartile."""
    return lower_spread(values, 0.75)


def ratio_of_means(values, divisors) -> Number:
    """Return the ratio of the means of paired values."""
    values, divisors = np.ravel(values), np.ravel(divisors)
    ratio = float(values.mean() / divisors.mean())
    return _estimate(ratio, (values - ratio * divisors) / float(divisors.mean()))


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
    return _estimate(a1, d1), _estimate(s, of_variance / (2.0 * s)), _estimate(g, of_skewness)


def relative_changes(values, usual) -> tuple[Number, Number]:
    """Return the relative changes of mean and standard deviation between paired samples."""
    values, usual = np.ravel(values), np.ravel(usual)

    def influence(x):
        return 0.5 * ((x - x.mean()) ** 2 / x.var() - 1.0)

    ratio = float(values.std() / usual.std())
    error = ratio * (influence(values) - influence(usual))
    return mean((values - usual) / usual.mean()), _estimate(ratio - 1.0, error)

"""Estimates with standard errors: moments and shares of independent samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction._checks import numbers
from stiction.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """A number and how well it is known.

    Attributes
    ----------
    value : float
    error : float
        Standard error; zero for what is exact.
    """

    value: float
    error: float = 0.0

    def __sub__(self, other: Estimate | float) -> Estimate:
        other = other if isinstance(other, Estimate) else Estimate(other)
        return Estimate(self.value - other.value, math.hypot(self.error, other.error))

    def scaled(self, factor: float) -> Estimate:
        """The estimate of a multiple."""
        return Estimate(self.value * factor, self.error * abs(factor))


def as_sample(values: Any, fewest: int = 2) -> Array:
    """Independent, finite values as a flat array.

    Raises
    ------
    InputError
        If there are fewer than `fewest`, or one is not finite.
    """
    array = numbers("values", values).ravel()
    if array.size < fewest:
        raise InputError(f"values: at least {fewest} are needed, got {array.size}")
    if not np.all(np.isfinite(array)):
        entry = int(np.argmin(np.isfinite(array)))
        raise InputError(f"values: must be finite; entry {entry} is not")
    return array


def mean(values: Any) -> Estimate:
    """Mean of independent values.

    Parameters
    ----------
    values : (samples,) array

    Returns
    -------
    Estimate, in the unit of the values
    """
    sample = as_sample(values)
    return Estimate(float(sample.mean()), float(sample.std(ddof=1)) / math.sqrt(sample.size))


def standard_deviation(values: Any) -> Estimate:
    """Standard deviation of independent values; its error needs no Gaussian assumption.

    Parameters
    ----------
    values : (samples,) array

    Returns
    -------
    Estimate, in the unit of the values

    Notes
    -----
    Error by the delta method from the fourth moment: sqrt((m_4 - s^4)/N)/(2 s).
    """
    sample = as_sample(values)
    s = float(sample.std(ddof=1))
    if s == 0.0:
        return Estimate(0.0, 0.0)
    fourth = float(np.mean((sample - sample.mean()) ** 4))
    return Estimate(s, math.sqrt(max(fourth - s**4, 0.0) / sample.size) / (2.0 * s))


def skewness(values: Any) -> Estimate:
    """Skewness of independent values, E[(x - mean)^3]/std^3.

    Parameters
    ----------
    values : (samples,) array

    Returns
    -------
    Estimate, dimensionless

    Notes
    -----
    Error by the influence function u^3 - 3 u - g (1 + 3 (u^2 - 1)/2) of the standardised u, g the
    skewness.
    """
    sample = as_sample(values, 3)
    s = float(sample.std())
    if s == 0.0:
        return Estimate(0.0, 0.0)
    u = (sample - sample.mean()) / s
    g = float(np.mean(u**3))
    influence = u**3 - g - 3.0 * u - 1.5 * g * (u * u - 1.0)
    return Estimate(g, float(influence.std(ddof=1)) / math.sqrt(sample.size))


def share(events: Any) -> Estimate:
    """Share of independent events that happened.

    Parameters
    ----------
    events : (samples,) array of bool

    Returns
    -------
    Estimate, dimensionless

    Notes
    -----
    The error is that of Agresti and Coull (1998), which stays positive when all or none happened.
    """
    happened = np.asarray(events, dtype=bool).ravel()
    if happened.size == 0:
        raise InputError("events: at least 1 is needed, got 0")
    n = happened.size
    adjusted = (happened.sum() + 2.0) / (n + 4.0)
    return Estimate(float(happened.mean()), math.sqrt(adjusted * (1.0 - adjusted) / (n + 4.0)))


def pooled_moments(sums: Any) -> tuple[Estimate, Estimate, Estimate]:
    """Mean, standard deviation and skewness of a stationary field from means over each sample.

    The values within a sample are correlated, the samples are not; the errors come from the
    scatter between samples.

    Parameters
    ----------
    sums : (samples, 3) array
        Of each sample the means over x of d, d^2 and d^3, d the deviation from a fixed reference
        near the mean.

    Returns
    -------
    mean of d, standard deviation, skewness : Estimate
    """
    sums = np.asarray(sums, dtype=np.float64)
    if sums.ndim != 2 or sums.shape[1] != 3 or sums.shape[0] < 2:
        raise InputError(f"sums: must have shape (samples, 3), samples >= 2, got {sums.shape}")
    n = sums.shape[0]
    a1, a2, a3 = sums.mean(axis=0)
    variance = a2 - a1 * a1
    third = a3 - 3.0 * a1 * a2 + 2.0 * a1**3
    deviation = math.sqrt(variance)
    g = third / deviation**3
    d1, d2, d3 = (sums - sums.mean(axis=0)).T
    of_variance = d2 - 2.0 * a1 * d1
    of_third = d3 - 3.0 * a2 * d1 - 3.0 * a1 * d2 + 6.0 * a1 * a1 * d1
    of_skewness = of_third / deviation**3 - 1.5 * g * of_variance / variance

    def error(influence: Array) -> float:
        return float(influence.std(ddof=1)) / math.sqrt(n)

    return (
        Estimate(float(a1), error(d1)),
        Estimate(deviation, error(of_variance) / (2.0 * deviation)),
        Estimate(float(g), error(of_skewness)),
    )

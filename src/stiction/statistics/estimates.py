"""Estimates with standard errors: moments of independent samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import Numbers, check


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
        """Return the estimate of a multiple."""
        return Estimate(self.value * factor, self.error * abs(factor))


def as_sample(values: Any, fewest: int = 2) -> Array:
    """Return independent, finite values, at least `fewest`, as a flat array."""
    array = check("values", values, Numbers).ravel()
    if array.size < fewest:
        raise InputError(f"values: at least {fewest} are needed, got {array.size}")
    if not np.all(np.isfinite(array)):
        entry = int(np.argmin(np.isfinite(array)))
        raise InputError(f"values: must be finite; entry {entry} is not")
    return array


def mean(values: Any) -> Estimate:
    """Estimate the mean of independent values (samples,), in their unit."""
    sample = as_sample(values)
    return Estimate(float(sample.mean()), float(sample.std(ddof=1)) / math.sqrt(sample.size))


def standard_deviation(values: Any) -> Estimate:
    """Estimate the standard deviation of independent values (samples,), in their unit.

    Error by the delta method from the fourth moment: sqrt((m_4 - s^4)/N)/(2 s), without a
    Gaussian assumption.
    """
    sample = as_sample(values)
    s = float(sample.std(ddof=1))
    if s == 0.0:
        return Estimate(0.0, 0.0)
    fourth = float(np.mean((sample - sample.mean()) ** 4))
    return Estimate(s, math.sqrt(max(fourth - s**4, 0.0) / sample.size) / (2.0 * s))

"""Correlation of a mapped Gaussian field by Hermite expansion of the map."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from stiction._typing import Array
from stiction.errors import InputError
from stiction.random.marginals import quantile_of_normal

TERMS = 40
REACH = 8.0
STEPS = 6400


@lru_cache(maxsize=64)
def hermite_coefficients(marginal: Any) -> Array:
    """c_m = E[F^-1(Phi(Z)) h_m(Z)], m = 0..40, h_m the orthonormal Hermite polynomials.

    c_0 is the mean and the sum of the others' squares the variance (Grigoriu, 1995). Evaluated by
    a fine trapezoidal rule on |z| <= 8: unlike Gauss-Hermite quadrature it stays accurate where
    the map has kinks, and its error for smooth maps is round-off. The last coefficient stands for
    all the rest of the variance, so that the correlation is 1 at zero lag.

    Raises
    ------
    InputError
        If the quantile is not finite on |z| <= 8 or the moments of scipy disagree with it.
    """
    z = np.linspace(-REACH, REACH, STEPS + 1)
    weight = np.exp(-0.5 * z * z) * (z[1] - z[0]) / np.sqrt(2.0 * np.pi)
    value = quantile_of_normal(marginal.distribution, z)
    variance = float(marginal.distribution.var())
    coefficients = np.empty(TERMS + 1)
    previous, current = np.zeros_like(z), np.ones_like(z)
    for m in range(TERMS):
        coefficients[m] = np.sum(weight * value * current)
        following = (z * current - np.sqrt(m) * previous) / np.sqrt(m + 1.0)
        previous, current = current, following
    rest = variance - np.sum(coefficients[1:-1] ** 2)
    # Heavy tails beyond |z| = 8 and round-off; more than this means that scipy's quantile fails.
    if not rest > -1e-6 * variance or rest > 0.5 * variance:
        raise InputError(
            "marginal: scipy's quantile of this distribution is not accurate enough in its tails"
            f" for a correlation ({np.count_nonzero(~np.isfinite(value))} values of"
            f" {value.size} are not finite)"
        )
    coefficients[-1] = np.sqrt(max(rest, 0.0))
    coefficients.flags.writeable = False
    return coefficients


def correlation_of_mapped(rho: Array, coefficients: Array) -> Array:
    """sum_m c_m^2 rho^m / sum_m c_m^2, m >= 1, for an array of correlations rho of z."""
    power = coefficients[1:] ** 2
    result: Array = np.polynomial.polynomial.polyval(rho, np.concatenate(([0.0], power)))
    return result / power.sum()

"""Correlation of a mapped Gaussian field by Hermite expansion of the map."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from stiction._typing import Array
from stiction.fields.marginals import quantile_of_normal

TERMS = 40
QUADRATURE = 400


@lru_cache(maxsize=64)
def hermite_coefficients(marginal: Any) -> Array:
    """c_m = E[F^-1(Phi(Z)) h_m(Z)], m = 0..39, h_m the orthonormal Hermite polynomials.

    c_0 is the mean and the sum of the others' squares the variance (Grigoriu, 1995). Evaluated by
    a fine trapezoidal rule on |z| <= 12: unlike Gauss-Hermite quadrature it stays accurate where
    the map has kinks, and its error for smooth maps is round-off.
    """
    z = np.linspace(-12.0, 12.0, 24 * QUADRATURE + 1)
    weight = np.exp(-0.5 * z * z) * (z[1] - z[0]) / np.sqrt(2.0 * np.pi)
    value = quantile_of_normal(marginal.distribution, z)
    coefficients = np.empty(TERMS)
    previous, current = np.zeros_like(z), np.ones_like(z)
    for m in range(TERMS):
        coefficients[m] = np.sum(weight * value * current)
        following = (z * current - np.sqrt(m) * previous) / np.sqrt(m + 1.0)
        previous, current = current, following
    coefficients.flags.writeable = False
    return coefficients


def correlation_of_mapped(rho: Array, coefficients: Array) -> Array:
    """sum_m c_m^2 rho^m / sum_m c_m^2, m >= 1, for an array of correlations rho of z."""
    power = coefficients[1:] ** 2
    result: Array = np.polynomial.polynomial.polyval(rho, np.concatenate(([0.0], power)))
    return result / power.sum()

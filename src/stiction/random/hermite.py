"""Correlation of a mapped Gaussian field by Hermite expansion of the map."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.random.marginals import quantile_of_normal

TERMS, MOST_TERMS = 40, 1000
REACH, FURTHEST = 8.0, 37.0  # the normal distribution's tail is representable up to 37
STEP = 0.0025
SMALL = 1e-6  # share of the variance


@lru_cache(maxsize=64)
def hermite_coefficients(marginal: Any) -> Array:
    """c_m = E[F^-1(Phi(Z)) h_m(Z)], m = 0, 1, ..., h_m the orthonormal Hermite polynomials.

    c_0 is the mean and the sum of the others' squares the variance (Grigoriu, 1995). Evaluated by
    a fine trapezoidal rule on |z| <= 8: unlike Gauss-Hermite quadrature it stays accurate where
    the map has kinks, and its error for smooth maps is round-off. Heavy tails have their variance
    further out and in high orders: then on |z| <= 37, and up to order 1000. The last coefficient
    stands for all the rest of the variance, so that the correlation is 1 at zero lag.

    Raises
    ------
    InputError
        If the quantile is not finite where it matters or the moments of scipy disagree with it.
    """
    coefficients, tail = _expand(marginal.distribution, REACH)
    if tail > SMALL:
        coefficients, tail = _expand(marginal.distribution, FURTHEST)
    coefficients.flags.writeable = False
    return coefficients


def share_unaccounted(coefficients: Array) -> float:
    """Largest error of a correlation from these coefficients: what the last one stands for."""
    return float(coefficients[-1] ** 2 / np.sum(coefficients[1:] ** 2))


def _expand(distribution: Any, reach: float) -> tuple[Array, float]:
    """Coefficients from |z| <= `reach`, and the share of the variance that lies beyond."""
    half = round(reach / STEP)
    z = np.arange(-half, half + 1) * STEP
    # Without the mean: it would cost a narrow marginal its digits.
    mean, variance = float(distribution.mean()), float(distribution.var())
    value = quantile_of_normal(distribution, z) - mean
    # Far out some of scipy's families have no quantile; what that costs shows in the rest.
    value[(np.abs(z) > REACH) & ~np.isfinite(value)] = 0.0
    # A half of the weight with each factor: high orders overflow far out without it.
    root = np.sqrt(STEP / np.sqrt(2.0 * np.pi)) * np.exp(-0.25 * z * z)
    value *= root
    tail = 1.0 - float(np.sum(value * value)) / variance
    found, rest = [mean], variance
    previous, current = np.zeros_like(z), root
    for m in range(MOST_TERMS):
        if m > 0:
            found.append(float(np.sum(value * current)))
            rest -= found[-1] ** 2
        if m >= TERMS - 1 and not rest > SMALL * variance:
            break
        following = (z * current - np.sqrt(m) * previous) / np.sqrt(m + 1.0)
        previous, current = current, following
    # More than round-off means that scipy's quantile fails.
    if not rest > -SMALL * variance or (reach == FURTHEST and rest > 0.5 * variance):
        raise InputError(
            "marginal: scipy's quantile of this distribution is not accurate enough in its tails"
            f" for a correlation ({np.count_nonzero(~np.isfinite(value))} values of"
            f" {value.size} are not finite; {100.0 * rest / variance:.2g} % of the variance are"
            " not accounted for)"
        )
    found.append(np.sqrt(max(rest, 0.0)))
    return np.array(found), tail


def correlation_of_mapped(rho: Array, coefficients: Array) -> Array:
    """sum_m c_m^2 rho^m / sum_m c_m^2, m >= 1, for an array of correlations rho of z."""
    power = coefficients[1:] ** 2
    result: Array = np.polynomial.polynomial.polyval(rho, np.concatenate(([0.0], power)))
    return result / power.sum()

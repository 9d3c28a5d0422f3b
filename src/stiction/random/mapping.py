"""The map z -> F^-1(Phi(z)) from the Gaussian field to the marginal F, and its effect on
correlation.

The map is tabulated, which is a thousand times faster than scipy's quantile: cubic Hermite
pieces on a uniform grid of [-8, 8], those beyond [-4, 4] only once they are needed. Every piece
is checked when the table is built; those that miss the tolerance (at a kink of the density, say)
and all z outside are left to scipy. So the result is accurate everywhere: to 1e-9 of the value,
or of a millionth of the standard deviation where the value is smaller than that.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtr

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.jit import jit

REACH, MOSTLY = 8.0, 4.0
"""Reach of a whole table, and of the part that most samples need."""
PER_UNIT = 256
"""Pieces per unit of z."""
TOLERANCE = 2e-10  # relative; the promise is 1e-9
TERMS, MOST_TERMS, STEP = 40, 1000, 0.0025
SMALL = 1e-6  # share of the variance


def quantile_of_normal(distribution: Any, z: Array) -> Array:
    """Compute F^-1(Phi(z)) of a frozen scipy.stats distribution (Grigoriu, 1995).

    Phi(z) rounds to 1 long before z = 8. The upper tail keeps its digits only through
    Phi(-z), and only where scipy inverts the survival function of the family directly.
    """
    tail, lower, found = ndtr(-np.abs(z)), z < 0.0, np.empty_like(z)
    found[lower], found[~lower] = distribution.ppf(tail[lower]), distribution.isf(tail[~lower])
    # scipy's beta.isf may be NaN where the value is its upper end to round-off.
    return np.where(np.isnan(found) & (z > REACH), distribution.support()[1], found)


@jit
def interpolate(z: Array, table: Array, out: Array) -> int:
    """Fill `out` with the tabulated map of `z` (flat arrays); NaN and counted where it has none."""
    pieces = table.shape[0] - 1
    first = REACH * PER_UNIT - 0.5 * pieces  # of those of a whole table
    missing = 0
    for i in range(z.size):
        position = (z[i] + REACH) * PER_UNIT - first
        piece = int(position) if 0.0 <= position < pieces else -1
        if piece < 0:
            out[i] = np.nan
            missing += 1
            continue
        t = position - piece
        left, right = table[piece, 0], table[piece + 1, 0]
        slope_left, slope_right = table[piece, 1], table[piece + 1, 1]
        rise = right - left
        quadratic = 3.0 * rise - 2.0 * slope_left - slope_right
        cubic = slope_left + slope_right - 2.0 * rise
        value = left + t * (slope_left + t * (quadratic + t * cubic))
        out[i] = value
        if np.isnan(value):
            missing += 1
    return missing


@lru_cache(maxsize=8192)
def quantile_table(marginal: Any, reach: float = REACH) -> Array:
    """Return values of the map and slopes times the step, (nodes, 2); NaN where scipy takes over.

    Most have 32 KiB: as many are kept as a long list of equally likely interfaces has.
    """
    distribution = marginal.distribution
    step, pieces = 1.0 / PER_UNIT, round(2.0 * reach * PER_UNIT)
    # Two nodes beyond each end, for central differences of fourth order.
    z = -reach + step * np.arange(-2, pieces + 3)
    value = quantile_of_normal(distribution, z)
    slope = (8.0 * (value[3:-1] - value[1:-3]) - (value[4:] - value[:-4])) / 12.0
    table = np.ascontiguousarray(np.stack([value[2:-2], slope], axis=1))
    checks = z[2:-3, None] + step * np.array([0.25, 0.5, 0.75])
    exact = quantile_of_normal(distribution, checks)
    found = np.empty(checks.size)
    table.flags.writeable = False  # as it will be used: one signature, compiled once
    interpolate(checks.ravel(), table, found)
    # Relative to the value, but not to a zero crossing of it.
    scale = np.maximum(np.abs(exact), 1e-6 * distribution.std())
    wrong = ~(np.abs(found.reshape(checks.shape) - exact) <= TOLERANCE * scale).all(axis=1)
    # A NaN slope spoils exactly the two pieces that share its node.
    result = table.copy()
    result[:-1][wrong, 1] = np.nan
    result.flags.writeable = False
    return result


def from_normal(marginal: Any, z: Array) -> Array:
    """Compute F^-1(Phi(z)) for an array of any shape, to 1e-9 relative (Grigoriu, 1995)."""
    if hasattr(marginal, "of_normal"):
        return np.asarray(marginal.of_normal(np.asarray(z, np.float64)))
    flat = np.ascontiguousarray(z, dtype=np.float64).ravel()
    standard, low, scale = _standard(marginal)
    out = np.empty_like(flat)
    if interpolate(flat, quantile_table(standard, MOSTLY), out):
        missing = np.isnan(out)
        rest, found = flat[missing], out[missing]
        if interpolate(rest, quantile_table(standard, REACH), found):
            never = np.isnan(found)
            found[never] = quantile_of_normal(standard.distribution, rest[never])
        out[missing] = found
    if standard is not marginal:
        out *= scale
        out += low
    return out.reshape(np.shape(z))


class Standard(NamedTuple):
    """A family of scipy at scale 1 from 0, whose table serves all multiples."""

    family: Any
    shapes: tuple[float, ...]

    @property
    def distribution(self) -> Any:
        """The frozen distribution."""
        return self.family(*self.shapes)


def _standard(marginal: Any) -> tuple[Any, float, float]:
    """Return a marginal that this one is a multiple of, its lower bound and scale.

    Shapes are rounded to 12 digits: those of multiples are equal but for round-off. Below zero a
    relative error of the multiple would be a larger one of the value: it keeps its own table.
    """
    family = getattr(marginal, "of_scipy", None)
    if family is None or marginal.low < 0.0:
        return marginal, 0.0, 1.0
    *shapes, low, scale = marginal.distribution.args
    return Standard(family, tuple(float(f"{one:.12g}") for one in shapes)), low, scale


@lru_cache(maxsize=64)
def hermite_coefficients(
    marginal: Any, step: float = STEP, most_terms: int = MOST_TERMS
) -> Array:
    """Return c_m = E[F^-1(Phi(Z)) h_m(Z)], h_m the orthonormal Hermite polynomials, m = 0, 1, ...

    c_0 is the mean and the sum of the others' squares the variance (Grigoriu, 1995). By the
    trapezoidal rule on |z| <= 8; fine steps are accurate where the map has kinks, too. The
    last coefficient stands for all the rest of the variance, so that the correlation is 1
    at zero lag. An `InputError` if scipy's quantile and moments disagree.
    """
    distribution, half = marginal.distribution, round(REACH / step)
    z = np.arange(-half, half + 1) * step
    # Without the mean, which would cost a narrow marginal its digits.
    mean, variance = float(distribution.mean()), float(distribution.var())
    if not variance > 0.0:
        raise InputError("marginal: its standard deviation is zero in double precision")
    root = np.sqrt(step / np.sqrt(2.0 * np.pi)) * np.exp(-0.25 * z * z)
    value = (quantile_of_normal(distribution, z) - mean) * root
    found, rest = [mean], variance
    previous, current = np.zeros_like(z), root
    for m in range(most_terms):
        if m > 0:
            found.append(float(np.sum(value * current)))
            rest -= found[-1] ** 2
        if m >= TERMS - 1 and not rest > SMALL * variance:
            break
        following = (z * current - np.sqrt(m) * previous) / np.sqrt(m + 1.0)
        previous, current = current, following
    if not rest > -max(SMALL, step**2) * variance:  # more than round-off and the rule's error
        raise InputError(
            "marginal: scipy's quantile of this distribution is not accurate enough"
        )
    coefficients = np.array([*found, np.sqrt(max(rest, 0.0))])
    coefficients.flags.writeable = False
    return coefficients


def correlation_of_mapped(rho: Array, coefficients: Array) -> Array:
    """Compute sum_m c_m^2 rho^m / sum_m c_m^2, m >= 1, for correlations rho of z."""
    power = coefficients[1:] ** 2
    result: Array = np.polynomial.polynomial.polyval(rho, np.concatenate(([0.0], power)))
    return result / power.sum()

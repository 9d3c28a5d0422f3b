"""A table of the map z -> F^-1(Phi(z)), a thousand times cheaper than the quantile itself.

Cubic Hermite pieces on a uniform grid of [-8, 8]. Every piece is checked against the quantile
when the table is built; pieces that miss the tolerance (at a kink of the density, say) and all z
outside are left to scipy. So the result is accurate everywhere: to 1e-9 of the value, or of a
millionth of the standard deviation where the value is smaller than that.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.jit import jit
from stiction.random.marginals import quantile_of_normal

REACH = 8.0
PIECES = 4096
TOLERANCE = 2e-10  # relative; the promise is 1e-9


@jit
def interpolate(z: Array, table: Array, out: Array) -> int:
    """Fill `out` with the tabulated map of `z` (flat arrays); NaN and counted where it has none."""
    pieces = table.shape[0] - 1
    scale = pieces / 16.0  # nodes per unit of z on [-8, 8]
    missing = 0
    for i in range(z.size):
        position = (z[i] + 8.0) * scale
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


def _build(distribution: Any) -> Array:
    step = 2.0 * REACH / PIECES
    # Two nodes beyond each end, for central differences of fourth order.
    z = -REACH + step * np.arange(-2, PIECES + 3)
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


@lru_cache(maxsize=64)
def quantile_table(marginal: Any) -> Array:
    """Table of the map for a marginal, shape (4097, 2): values and slopes times the step."""
    return _build(marginal.distribution)


def from_normal(marginal: Any, z: Array) -> Array:
    """F^-1(Phi(z)) for an array of any shape, to 1e-9 relative (Grigoriu, 1995)."""
    flat = np.ascontiguousarray(z, dtype=np.float64).ravel()
    out = np.empty_like(flat)
    if interpolate(flat, quantile_table(marginal), out):
        fill_missing(marginal, flat, out)
    return out.reshape(np.shape(z))


def fill_missing(marginal: Any, z: Array, out: Array) -> None:
    """Replace the NaN of `out` by scipy's quantile of `z` (arrays of one shape)."""
    missing = np.isnan(out)
    out[missing] = quantile_of_normal(marginal.distribution, z[missing])

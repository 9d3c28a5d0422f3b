"""Density of the peak that a test shows: that of the onset, with the error of the load cell.

No onset is below the least possible strength, and where the correlation length is long many are
just above it. A kernel density of the onsets would leak below, and find any strength possible whose
bound is not far above the least peak. So the kernels stand on v = log(onset - bound), or on the
onset itself where there is no bound (Wand, Marron and Ruppert, 1991). Their width is Silverman's
(1986, section 3.4.2), and what it adds to the variance is taken from the sample (section 6.1.2).
Densities are tabulated in units in which v has mean 0 and variance 1, where they hardly change from
node to node. The error of the load cell is integrated: by Gauss and Hermite's rule where it is
small against the spread of the onset, Legendre's between the bound and where the error ends where
it reaches the bound, and over the onset's distribution where it is large.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from stiction.arrays import Array
from stiction.jit import jit

GROUPS = 256
"""Most groups of neighbouring sorted samples that stand for the sample, by their means."""
COARSE = 24
"""Groups over which an error that is not small is integrated."""
REACH = 10.0
STEP = 0.05
LARGE = 0.6
"""Load-cell error over the spread of the onset from which on it is not small."""
MODE = 1.0
"""Logarithm of the density of no standardised onset is above this: of a normal one it is -0.9."""
_ABSCISSAE, _WEIGHTS = np.polynomial.hermite_e.hermegauss(7)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()
_PLACES, _PARTS = np.polynomial.legendre.leggauss(16)
NEAR = 4.5
"""Standard deviations of the load cell that matter; nearer to the bound, the rule is Legendre's."""


class Densities(NamedTuple):
    """Tabulated densities of standardised v.

    Attributes
    ----------
    bound : (nodes,) array
        Least possible onset at the reference, Pa; -inf where there is none.
    mean, spread : (nodes,) arrays
        Of v.
    table : (nodes, points) array
        Logarithm of the density of the standardised v, in steps of `STEP` from -`REACH`.
    groups, shares : (nodes, COARSE) arrays
        Standardised v of a few groups of the sample, and their shares of it.
    """

    bound: Array
    mean: Array
    spread: Array
    table: Array
    groups: Array
    shares: Array


def silverman(samples: float) -> float:
    """Width of the kernel for a sample of unit variance that is nearly normal."""
    return float(1.06 * samples**-0.2)


def grouped(ordered: Array, most: int) -> tuple[Array, Array]:
    """Means and shares of groups of neighbouring sorted values, ever smaller ones in the tails.

    Ends of groups are at equal steps of a normal variable, so that no group of a sample that is
    nearly normal is wide against the kernel. Values on an end are shared out.
    """
    size = ordered.size
    reach = float(ndtri(1.0 - 0.5 / size))
    ends = size * ndtr(np.linspace(-reach, reach, min(most, size) + 1))
    ends[0], ends[-1] = 0.0, size
    sums = np.concatenate(([0.0], np.cumsum(ordered)))
    share = np.diff(ends)
    means: Array = np.diff(np.interp(ends, np.arange(size + 1), sums)) / share
    share /= size
    means -= share @ means
    means /= math.sqrt(share @ means**2)  # groups hide a little of the spread
    return means, share


@jit
def _log_density(centres: Array, share: Array, width: float, z: Array, out: Array) -> None:
    """Logarithm of a sum of Gaussians of one width around sorted centres, at points z."""
    norm = math.log(width * math.sqrt(2.0 * math.pi))
    for i in range(z.size):
        nearest = np.inf
        for centre in centres:
            nearest = min(nearest, abs(z[i] - centre))
        least = 0.5 * (nearest / width) ** 2
        total = 0.0
        for k in range(centres.size):
            u = (z[i] - centres[k]) / width
            total += share[k] * math.exp(least - 0.5 * u * u)
        out[i] = math.log(total) - least - norm


def to_v(peaks: Array, bound: Array) -> Array:
    """v of onsets (nodes, samples) above the bounds (nodes,)."""
    if not np.isfinite(bound).all():
        return peaks
    above = peaks - bound[:, None]
    # Round-off may put an onset on its bound.
    return np.log(np.maximum(above, 1e-9 * above.mean(axis=1, keepdims=True)))


def tabulate(peaks: Array, bound: Array) -> Densities:
    """Densities of onsets (nodes, samples) that cannot be below `bound` (nodes,)."""
    if not np.isfinite(bound).all():
        bound = np.full(bound.shape, -np.inf)
    v = to_v(peaks, bound)
    nodes, samples = v.shape
    mean, spread = v.mean(axis=1), v.std(axis=1)
    spread = np.maximum(spread, 1e-12 * np.maximum(np.abs(mean), 1.0))
    z = np.linspace(-REACH, REACH, round(2.0 * REACH / STEP) + 1)
    table = np.empty((nodes, z.size))
    groups, shares = np.empty((nodes, COARSE)), np.empty((nodes, COARSE))
    width = silverman(samples)
    for node in range(nodes):
        ordered = np.sort((v[node] - mean[node]) / spread[node])
        centres, share = grouped(ordered, GROUPS)
        _log_density(centres * math.sqrt(1.0 - width**2), share, width, z, table[node])
        groups[node], shares[node] = grouped(ordered, COARSE)
    return Densities(bound, mean, spread, table, groups, shares)


@jit
def _interpolated(table: Array, index: NDArray[np.int64], weight: Array, z: float) -> float:
    """Logarithm of the standardised density, linear between nodes and steps."""
    inside = min(max(z, -REACH), REACH)
    at = (inside + REACH) / STEP
    k = min(int(at), table.shape[1] - 2)
    t = at - k
    value = 0.0
    for c in range(index.size):
        if weight[c] != 0.0:
            row = table[index[c]]
            value += weight[c] * (row[k] + t * (row[k + 1] - row[k]))
    beyond = abs(z) - abs(inside)
    return value - 50.0 * beyond * (beyond + 1.0)


@jit
def _blend(values: Array, index: NDArray[np.int64], weight: Array) -> float:
    total = 0.0
    for c in range(index.size):
        if weight[c] != 0.0:
            total += weight[c] * values[index[c]]
    return total


@jit
def log_likelihoods(
    index: NDArray[np.int64],
    weight: Array,
    shift: Array,
    stretch: Array,
    error: float,
    densities: Densities,
    peaks: Array,
    floor: float,
    out: Array,
) -> None:
    """Logarithm of the density of each peak at each point, (points, peaks), 1/Pa.

    Bound, mean and spread are linear between nodes, and so is the logarithm of the standardised
    density. A point whose sum would fall below `floor` even if all peaks to come were at the mode
    is given up, and the rest of its row is -inf.
    """
    for i in range(index.shape[0]):
        near, share = index[i], weight[i]
        mean, spread = _blend(densities.mean, near, share), _blend(densities.spread, near, share)
        bounded = np.isfinite(densities.bound[0])
        bound = _blend(densities.bound, near, share) if bounded else 0.0
        own = error / stretch[i]
        typical = spread * math.exp(mean) if bounded else spread
        large = own > LARGE * typical
        at_mode = MODE - math.log(stretch[i] * math.hypot(typical, own))
        hopeless, so_far = False, 0.0
        for j in range(peaks.size):
            if hopeless:
                out[i, j] = -np.inf
                continue
            y = (peaks[j] - shift[i]) / stretch[i]
            top, total = -np.inf, 0.0
            near_bound = bounded and own > 0.0 and y - NEAR * own < bound and not large
            width = max(y, bound) + NEAR * own - bound
            count = _ABSCISSAE.size if own > 0.0 else 1
            if large:
                count = COARSE
            elif near_bound:
                count = _PLACES.size
            for k in range(count):
                if large:
                    z = _blend(densities.groups[:, k], near, share)
                    v = mean + spread * z
                    away = (y - (bound + math.exp(v) if bounded else v)) / own
                    mass = _blend(densities.shares[:, k], near, share)
                    value = math.log(mass / (own * math.sqrt(2.0 * math.pi))) - 0.5 * away * away
                else:
                    x = y if own == 0.0 else y - own * _ABSCISSAE[k % _ABSCISSAE.size]
                    if near_bound:
                        x = bound + 0.5 * width * (1.0 + _PLACES[k])
                    if bounded and x <= bound:
                        continue
                    v = math.log(x - bound) if bounded else x
                    value = _interpolated(densities.table, near, share, (v - mean) / spread)
                    value -= math.log(spread) + (v if bounded else 0.0)
                    if near_bound:
                        away = (y - x) / own
                        part = 0.5 * width * _PARTS[k] / (own * math.sqrt(2.0 * math.pi))
                        value += math.log(part) - 0.5 * away * away
                    elif own > 0.0:
                        value += math.log(_WEIGHTS[k])
                if value > top:
                    total = total * math.exp(top - value) + 1.0
                    top = value
                elif value > -np.inf:
                    total += math.exp(value - top)
            out[i, j] = (top + math.log(total) if total > 0.0 else -np.inf) - math.log(stretch[i])
            so_far += out[i, j]
            hopeless = so_far + (peaks.size - 1 - j) * at_mode < floor

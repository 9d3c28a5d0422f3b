"""Density of a measured peak: the density of the onset, convolved with the load-cell error.

Problem. Onsets T_1, ..., T_N, all above the bound b, were simulated.
Compute the density

    p(y) = int f(T) phi((y - T)/e)/e dT

of a peak y = T + error. Here f is the density of onsets, e the standard
deviation of the load-cell error, and phi the standard normal density.

Sources. Wand, Marron and Ruppert (1991), Journal of the American
Statistical Association 86, 343, introduced transformed kernels.
Silverman, Density Estimation (1986), gives the kernel width in section
3.4.2, and kernels that keep the variance in section 6.1.2.

Steps:

1. Use v = log(T - b). If the correlation length is long, many onsets
   lie just above b, and kernels on T itself would leak below b. If
   there is no bound, choose b so far below the onsets that the
   logarithm is nearly linear.
2. Standardise v to mean 0 and variance 1. The density of v then hardly
   changes between the nodes of the parameter grid.
3. Replace the sorted sample by the means of at most `GROUPS` groups.
   Groups are smaller in the tails.
4. Sum normal kernels of Silverman's width w = 1.06 N^(-1/5), with
   centres multiplied by sqrt(1 - w^2), so that the sum keeps
   variance 1. Tabulate the logarithm in steps of `STEP`.
5. Interpolate this logarithm between steps and between the nodes
   of the parameter grid. Beyond the table it falls like a parabola.
6. Integrate over v with the midpoint rule. It converges faster than any
   power of the step if the step is smaller than the widths of the error
   and the density.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from stiction.base.arrays import Array
from stiction.base.jit import jit

GROUPS = 256
"""Most groups of neighbouring sorted samples."""
TABLE_REACH = 10.0
STEP = 0.05
BOUND_DEVIATIONS = 1e5
"""Distance of the bound below the onsets, in standard deviations, if
the onsets have no bound."""
ERRORS, SPREADS = 4.0, 6.0
"""Half range of the integration in standard deviations of the load
cell, and of v."""


class Densities(NamedTuple):
    """Densities of the standardised v at the nodes of the parameter grid."""

    onsets: Array  # (nodes, samples), of the same samples at every node
    bound: Array  # least possible onset, (nodes,)
    mean: Array  # of v, (nodes,)
    spread: Array  # standard deviation of v, (nodes,)
    table: Array  # logarithms in steps of `STEP` from -`TABLE_REACH`, (nodes, steps)

    def standardised(self) -> Array:
        """Return the standardised v for onsets (nodes, samples)."""
        return (to_v(self.onsets, self.bound) - self.mean[:, None]) / self.spread[:, None]

    def between(self, index: NDArray[np.int64], weight: Array) -> Array:
        """Return bound, mean and spread, interpolated at points, with shape (3, points)."""
        values = np.stack([self.bound, self.mean, self.spread])
        return np.ascontiguousarray(np.einsum("pc,kpc->kp", weight, values[:, index]))


def grouped(ordered: Array) -> tuple[Array, Array]:
    """Return the means and weights of groups of neighbouring values, which are sorted (step 3).

    Groups end at equal steps of a normal variable, so that every group
    in a nearly normal sample is narrow compared with the kernel. A
    value at an end is divided between both groups.
    """
    size = ordered.size
    reach = float(ndtri(1.0 - 0.5 / size))
    ends = size * ndtr(np.linspace(-reach, reach, min(GROUPS, size) + 1))
    ends[0], ends[-1] = 0.0, size
    sums = np.concatenate(([0.0], np.cumsum(ordered)))
    share = np.diff(ends)
    means: Array = np.diff(np.interp(ends, np.arange(size + 1), sums)) / share
    share /= size
    means -= share @ means
    means /= math.sqrt(share @ means**2)  # groups hide a small part of the variance
    return means, share


def to_v(onsets: Array, bound: Array) -> Array:
    """Return v for onsets (nodes, samples) above the bounds (nodes,) (step 1)."""
    above = onsets - bound[:, None]
    # Round-off may put an onset on its bound.
    return np.log(np.maximum(above, 1e-9 * above.mean(axis=1, keepdims=True)))


def densities_of(onsets: Array, bound: Array) -> Densities:
    """Return densities of onsets (nodes, samples) that cannot lie below `bound` (nodes,)."""
    if not np.isfinite(bound).all():
        bound = onsets.mean(axis=1) - BOUND_DEVIATIONS * onsets.std(axis=1).max()
    # 1. and 2.
    v = to_v(onsets, bound)
    mean, spread = v.mean(axis=1), v.std(axis=1)
    spread = np.maximum(spread, 1e-12 * np.maximum(np.abs(mean), 1.0))
    z = np.linspace(-TABLE_REACH, TABLE_REACH, round(2.0 * TABLE_REACH / STEP) + 1)
    width = 1.06 * onsets.shape[1] ** -0.2  # Silverman's
    densities = Densities(onsets, bound, mean, spread, np.empty((mean.size, z.size)))
    for row, values in zip(densities.table, densities.standardised(), strict=True):
        # 3. and 4.
        centres, share = grouped(np.sort(values))
        away = (z[:, None] - math.sqrt(1.0 - width**2) * centres) / width
        powers = -0.5 * away**2
        top = powers.max(axis=1)
        row[:] = top + np.log(np.exp(powers - top[:, None]) @ share)
        row -= math.log(width * math.sqrt(2.0 * math.pi))
    return densities


@jit
def _interpolated(table: Array, index: NDArray[np.int64], weight: Array, z: float) -> float:
    """Return the logarithm of the standardised density at z (step 5)."""
    inside = min(max(z, -TABLE_REACH), TABLE_REACH)
    at = (inside + TABLE_REACH) / STEP
    k = min(int(at), table.shape[1] - 2)
    t = at - k
    value = 0.0
    for c in range(index.size):
        row = table[index[c]]
        value += weight[c] * (row[k] + t * (row[k + 1] - row[k]))
    beyond = abs(z) - abs(inside)
    return value - 50.0 * beyond * (beyond + 1.0)


@jit
def _with_error(
    y: float,
    error: float,
    of_v: tuple[float, float, float],
    table: Array,
    near: Any,
    share: Array,
) -> float:
    """Return the log density of onset plus error at y (step 6).

    `of_v` holds bound, mean and spread.
    """
    bound, mean, spread = of_v
    low, high = y - ERRORS * error - bound, max(y, bound) + ERRORS * error - bound
    low, high = math.log(low) if low > 0.0 else -np.inf, math.log(high)
    # Only onsets that both the error and the density allow contribute.
    first, last = max(low, mean - SPREADS * spread), min(high, mean + SPREADS * spread)
    if first >= last:  # the error reaches only onsets far out in the tail
        first, last = max(low, high - 2.0 * SPREADS * spread), high
    count = 7 + int(2.0 * (last - first) / spread)
    step = (last - first) / count
    top, total = -np.inf, 0.0
    for k in range(count):
        v = first + (k + 0.5) * step
        away = (y - bound - math.exp(v)) / error
        value = _interpolated(table, near, share, (v - mean) / spread) - 0.5 * away * away
        # Sum exponentials relative to the largest, so that they neither
        # overflow nor vanish.
        if value > top:
            total = total * math.exp(top - value) + 1.0
            top = value
        else:
            total += math.exp(value - top)
    return top + math.log(total * step / (spread * error * math.sqrt(2.0 * math.pi)))


@jit
def log_likelihoods(
    table: Array,
    index: NDArray[np.int64],
    weight: Array,
    of_v: Array,
    scales: Array,
    error: float,
    peaks: Array,
    out: Array,
) -> None:
    """Write log densities (1/Pa) of peaks at points to `out`, with shape (points, peaks).

    `of_v` comes from `Densities.between`. `scales` holds shift and
    stretch, with shape (2, points).
    """
    for i in range(index.shape[0]):
        bound, mean, spread = of_v[0, i], of_v[1, i], of_v[2, i]
        shift, stretch = scales[0, i], scales[1, i]
        for j in range(peaks.size):
            y = (peaks[j] - shift) / stretch
            value = -np.inf
            if error > 0.0:
                around = bound, mean, spread
                value = _with_error(y, error / stretch, around, table, index[i], weight[i])
            elif y > bound:
                v = math.log(y - bound)
                value = _interpolated(table, index[i], weight[i], (v - mean) / spread)
                value -= math.log(spread) + v
            out[i, j] = value - math.log(stretch)

"""Density of the measured peak: that of the onset, with the error of the load cell.

No onset is below the least possible strength, and where the correlation length is long many
are just above it. A kernel density of the onsets would leak below, and find any strength
possible whose bound is not far above the least peak. So the kernels stand on v = log(onset
- bound) (Wand, Marron and Ruppert, 1991); where there is no bound, on one so far below that
the logarithm is straight. Their width is Silverman's (1986, section 3.4.2), and what it
adds to the variance is taken from the sample (section 6.1.2). Densities are tabulated in
units in which v has mean 0 and variance 1, where they hardly change from node to node. The
error of the load cell is integrated over v by the midpoint rule, which converges faster
than any power of the step once that is below the narrower of error and density.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from stiction.base.arrays import Array
from stiction.base.jit import jit

GROUPS = 256
"""Largest number of groups of neighbouring sorted samples, whose means stand for the sample."""
TABLE_REACH = 10.0
STEP = 0.05
BOUND_DEVIATIONS = 1e5
"""Distance of a bound, in standard deviations, from onsets that have none."""
ERRORS, SPREADS = 4.0, 6.0
"""Half range of the integration, in standard deviations of the load cell, and of v."""


class Densities(NamedTuple):
    """Densities of standardised v at nodes."""

    onsets: Array  # (nodes, samples): of the same samples at every node
    bound: Array  # (nodes,): least possible onset
    mean: Array  # of v, (nodes,)
    spread: Array
    table: Array  # logarithms in steps of `STEP` from -`TABLE_REACH`, (nodes, steps)

    def standardised(self) -> Array:
        """Return standardised v of the onsets, (nodes, samples)."""
        return (to_v(self.onsets, self.bound) - self.mean[:, None]) / self.spread[:, None]

    def between(self, index: NDArray[np.int64], weight: Array) -> Array:
        """Return bound, mean and spread at points, (3, points), linear between nodes."""
        values = np.stack([self.bound, self.mean, self.spread])
        return np.ascontiguousarray(np.einsum("pc,kpc->kp", weight, values[:, index]))


def grouped(ordered: Array) -> tuple[Array, Array]:
    """Means and shares of groups of neighbouring sorted values, ever smaller ones in the tails.

    Ends of groups are at equal steps of a normal variable, so that no group of a sample
    that is nearly normal is wide against the kernel. Values on an end are shared out.
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
    means /= math.sqrt(share @ means**2)  # groups hide a little of the spread
    return means, share


def to_v(onsets: Array, bound: Array) -> Array:
    """v of onsets (nodes, samples) above the bounds (nodes,)."""
    above = onsets - bound[:, None]
    # Round-off may put an onset on its bound.
    return np.log(np.maximum(above, 1e-9 * above.mean(axis=1, keepdims=True)))


def tabulate(onsets: Array, bound: Array) -> Densities:
    """Densities of onsets (nodes, samples) that cannot be below `bound` (nodes,)."""
    if not np.isfinite(bound).all():
        bound = onsets.mean(axis=1) - BOUND_DEVIATIONS * onsets.std(axis=1).max()
    v = to_v(onsets, bound)
    mean, spread = v.mean(axis=1), v.std(axis=1)
    spread = np.maximum(spread, 1e-12 * np.maximum(np.abs(mean), 1.0))
    z = np.linspace(-TABLE_REACH, TABLE_REACH, round(2.0 * TABLE_REACH / STEP) + 1)
    width = 1.06 * onsets.shape[1] ** -0.2  # Silverman's
    densities = Densities(onsets, bound, mean, spread, np.empty((mean.size, z.size)))
    for row, values in zip(densities.table, densities.standardised(), strict=True):
        centres, share = grouped(np.sort(values))
        away = (z[:, None] - math.sqrt(1.0 - width**2) * centres) / width
        powers = -0.5 * away**2
        top = powers.max(axis=1)
        row[:] = top + np.log(np.exp(powers - top[:, None]) @ share)
        row -= math.log(width * math.sqrt(2.0 * math.pi))
    return densities


@jit
def _interpolated(table: Array, index: NDArray[np.int64], weight: Array, z: float) -> float:
    """Logarithm of the standardised density, linear between nodes and steps."""
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
    """Logarithm of the density of an onset and the error of the load cell together, at y.

    `of_v` are its bound, mean and spread.
    """
    bound, mean, spread = of_v
    low, high = y - ERRORS * error - bound, max(y, bound) + ERRORS * error - bound
    low, high = math.log(low) if low > 0.0 else -np.inf, math.log(high)
    first, last = max(low, mean - SPREADS * spread), min(high, mean + SPREADS * spread)
    if first >= last:  # all that the error reaches is far out
        first, last = max(low, high - 2.0 * SPREADS * spread), high
    count = 7 + int(2.0 * (last - first) / spread)
    step = (last - first) / count
    top, total = -np.inf, 0.0
    for k in range(count):
        v = first + (k + 0.5) * step
        away = (y - bound - math.exp(v)) / error
        value = _interpolated(table, near, share, (v - mean) / spread) - 0.5 * away * away
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
    """Logarithm of the density of each peak at each point, (points, peaks), 1/Pa.

    The logarithm of the standardised density is linear between nodes, as `of_v` is, see
    `Densities.between`. `scales` are shift and stretch at the points, (2, points).
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

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
        """Return the standardised v for onsets (nodes, samples).

        >>> onsets = np.array([[1.0, 1.0], [3.0, 3.0]]) + np.exp([[1, 4], [0, 7]])
        >>> nodes = np.array([[1, 3], [2, 5], [0.5, 0.25]])  # bound, mean and spread
        >>> Densities(onsets, *nodes, np.zeros(0)).standardised().round(9).tolist()
        [[-2.0, 4.0], [-20.0, 8.0]]
        """
        return (to_v(self.onsets, self.bound) - self.mean[:, None]) / self.spread[:, None]

    def between(self, index: NDArray[np.int64], weight: Array) -> Array:
        """Return bound, mean and spread, interpolated at points, with shape (3, points).

        The first point lies between the nodes 0 and 2, and the
        second one at node 1.

        >>> nodes = np.array([[1, 2, 5], [10, 30, 50], [0.1, 0.7, 0.5]])
        >>> index, weight = np.array([[0, 2], [1, 0]]), np.array([[0.25, 0.75], [1, 0]])
        >>> Densities(np.zeros(0), *nodes, np.zeros(0)).between(index, weight).round(9).tolist()
        [[4.0, 2.0], [40.0, 30.0], [0.4, 0.7]]
        """
        values = np.stack([self.bound, self.mean, self.spread])
        return np.ascontiguousarray(np.einsum("pc,kpc->kp", weight, values[:, index]))


def grouped(ordered: Array) -> tuple[Array, Array]:
    """Return the means and weights of groups of neighbouring values, which are sorted (step 3).

    Groups end at equal steps of a normal variable, so that every group
    in a nearly normal sample is narrow compared with the kernel. A
    value at an end is divided between both groups.

    Examples
    --------
    Three values give three groups. The middle group is the
    smallest, and has only a part of the middle value.

    >>> means, share = grouped(np.array([-1, 1, 5.0]))
    >>> half = ndtr(ndtri(5 / 6) / 3.0) - 0.5
    >>> bool(np.allclose(share, [0.5 - half, 2.0 * half, 0.5 - half]))
    True
    >>> f"{abs(share @ means):.6f} {share @ means**2:.6f}"
    '0.000000 1.000000'
    >>> f"{(means[2] - means[1]) / (means[1] - means[0]):.6f}"
    '2.000000'
    >>> grouped(np.arange(1000.0))[0].size
    256
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
    """Return v for onsets (nodes, samples) above the bounds (nodes,) (step 1).

    Examples
    --------
    The second onset of the first node lies on its bound, and 1 is
    the mean distance.

    >>> v = to_v(np.array([[3, 1], [6, 4.0]]), np.array([1, 2]))
    >>> bool(np.allclose(v, np.log([[2, 1e-9], [4, 2]])))
    True
    """
    above = onsets - bound[:, None]
    # Round-off may put an onset on its bound.
    return np.log(np.maximum(above, 1e-9 * above.mean(axis=1, keepdims=True)))


def densities_of(onsets: Array, bound: Array) -> Densities:
    """Return densities of onsets (nodes, samples) that cannot lie below `bound` (nodes,).

    Examples
    --------
    >>> known = densities_of(np.array([[2, 3, 7], [4, 7, 12.0]]), np.array([1, 3]))
    >>> bool(np.allclose(known.mean, np.log([12, 36]) / 3.0))
    True
    >>> bool(np.allclose(known.spread, [np.log([1, 2, 6]).std(), np.log([1, 4, 9]).std()]))
    True

    Each row is the logarithm of a density with mean 0 and variance
    1. Far out it is one kernel, whose width determines the
    curvature.

    >>> z, p = np.linspace(-10, 10, known.table.shape[1]), np.exp(known.table)
    >>> moments = np.stack([p.sum(axis=1), p @ z, p @ z**2]) * STEP
    >>> (moments.round(6) + 0.0).tolist()
    [[1.0, 1.0], [0.0, 0.0], [1.0, 1.0]]
    >>> ends = np.diff(known.table, 2)[:, [0, -1]] * (1.06 * 3**-0.2 / STEP) ** 2
    >>> ends.round(2).tolist()
    [[-1.0, -1.0], [-1.0, -1.0]]

    Without a bound, v is nearly linear in the onset.

    >>> free = densities_of(np.array([[2, 3, 7], [4, 7, 12.0]]), np.array([-np.inf, 3]))
    >>> scatter = np.array([4, 7, 12.0]).std()
    >>> bool(np.allclose(free.bound, [4 - 1e5 * scatter, 23 / 3 - 1e5 * scatter]))
    True
    >>> free.standardised()[1].round(3).tolist()
    [-1.111, -0.202, 1.313]
    """
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
    """Return the logarithm of the standardised density at z (step 5).

    The rows of the table are k and 1000 + k^2. At z = -9.89, k is
    2.2.

    >>> k = np.arange(401.0)
    >>> table, near = np.stack([0 * k, k, 1000 + k**2]), np.array([1, 2])
    >>> weight = np.array([0.75, 0.25])
    >>> f"{_interpolated(table, near, weight, -9.89):.6f}"  # 0.75 * 2.2 + 0.25 * 1005
    '252.900000'

    Beyond the table, 2 above its last value and 1 below its first
    value:

    >>> [_interpolated(table, near[:1], np.ones(1), z) for z in (12.0, -11.0)]
    [100.0, -100.0]
    """
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

    A normal v with mean 0.3 and standard deviation 0.4, and its
    integral as a sum over many z:

    >>> rows = -0.5 * np.linspace(-10, 10, 401)[None] ** 2 - 0.5 * math.log(2.0 * math.pi)
    >>> z = np.linspace(-9.9, 9.9, 100_001)
    >>> def by_sum(y, error):
    ...     away = (y - 1.0 - np.exp(0.3 + 0.4 * z)) / error
    ...     total = np.exp(-0.5 * (z**2 + away**2)).sum() * 198e-6
    ...     return math.log(total / (2.0 * math.pi * error))
    >>> near = np.zeros(1, dtype=np.int64), np.ones(1)
    >>> peaks = np.array([[2.1, 0.2], [9.0, 3.0], [1.0369, 5e-4], [1.1, 0.2], [0.9, 0.1]])
    >>> found = [_with_error(*peak, (1.0, 0.3, 0.4), rows, *near) for peak in peaks]
    >>> differences = np.abs([a - by_sum(*peak) for a, peak in zip(found, peaks, strict=True)])
    >>> bool(np.all(differences < [5e-4, 5e-4, 5e-4, 5e-3, 0.02]))
    True
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

    Examples
    --------
    A normal v gives a log-normal density of the onsets above the
    bound, here 1 and 0.5. Onsets are shifted by 2 and stretched by
    3. The last peak lies below both bounds.

    >>> table = -0.5 * np.linspace(-10, 10, 401)[None] ** 2 - 0.5 * math.log(2.0 * math.pi)
    >>> index, weight, out = np.zeros((2, 1), dtype=np.int64), np.ones((2, 1)), np.zeros((2, 2))
    >>> of_v = np.array([[1, 0.5], [0.3, 0.8], [0.4, 0.2]])  # bound, mean and spread
    >>> scales, peaks = np.array([[2, 2], [3, 3.0]]), np.array([9.5, 3.5])
    >>> log_likelihoods(table, index, weight, of_v, scales, 0.0, peaks, out)
    >>> from scipy.stats import lognorm
    >>> expected = [lognorm(0.4, 5, 3 * np.exp(0.3)), lognorm(0.2, 3.5, 3 * np.exp(0.8))]
    >>> bool(np.abs(out[:, 0] - [law.logpdf(9.5) for law in expected]).max() < 1e-3)
    True
    >>> out[:, 1].tolist()
    [-inf, -inf]

    With an error, which is stretched as well:

    >>> log_likelihoods(table, index, weight, of_v, scales, 0.6, peaks, out)
    >>> around = (0.5, 0.8, 0.2), table, index[1], weight[1]
    >>> bool(np.isclose(out[1, 1], _with_error(0.5, 0.2, *around) - math.log(3.0)))
    True
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

"""Find the least moving average of strength over load, over critical windows.

Problem
-------
s is the strength minus initial stress (Pa), p is the load profile, and
y are the weights of a window (`windows`). The window centred at x
becomes unstable in isolation at the load <s, y>_x/<p, y>_x. Find the
least load over all x and all windows. On a line, x may lie between the
nodes. On a plane the load is computed at the nodes, which is exact for
the discrete problem, and only the position is interpolated.

Algorithm
---------
1. Compute the averages at all nodes by Fourier transform (`averages`).
2. On a plane, take the lowest node. A parabola through its neighbours
   gives the position.
3. On a line, fit a parabola at each node that is a local minimum.
   Estimate how low the function falls there, and the error of the
   parabola (`_estimates`).
4. At the lowest local minimum, and at others that may be lower, find
   the minimum of the polynomials through `STENCIL` nodes, in the cells
   on both sides of the node (`_minimum_near`).

The exact average has bounds. Round-off may violate these bounds, and so
may the polynomials, which ring at jumps of the strength. Values are
therefore limited to the bounds.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit, jit_allocating
from stiction.elasticity.operator import Transform, convolve, make_transform
from stiction.methods.criterion.windows import Window, places_of
from stiction.problem.interface import Interface

STENCIL = 10  # nodes of a polynomial, five on either side of its cell
PARABOLA_ERROR = 0.065  # largest distance of a cubic from its parabola, in third differences
MAX_NEWTON_STEPS = 50
PLACE_ATOL = 1e-11  # change of the place, in nodes, that is round-off
NO_NODE = -1

# Coefficients of the polynomial through ten nodes, in powers of the
# distance from their middle.
_FIT = np.linalg.inv(np.vander(np.arange(STENCIL) - 0.5 * (STENCIL - 1), increasing=True))


def averages(
    interface: Interface, windows: Sequence[Window], excess: Array, profile: Array
) -> Iterator[Iterator[Array]]:
    """Yield, for each sample and window y, <s, y>/<p, y> centred at every node, as (*shape).

    Strength minus initial stress s (Pa) has shape (samples, *shape),
    and the load profile p has shape (*shape). An average is infinite if
    the window reaches beyond the interface extent.

    The window has the weights 0.5, 0.3 and 0.2 at the nodes 0, 1 and 3 from
    its centre. Within an extent of nodes 1 to 5 it fits at nodes 1 and 2.

    >>> y = np.array([0.5, 0.3, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0])
    >>> window = Window(1.0, (0.4,), 0.4, 1.0, y, np.conj(np.fft.rfft(y)))
    >>> s, p = np.array([3.0, 5.0, 2.0, 8.0, 4.0, 6.0, 1.0, 7.0]), np.ones(8)
    >>> p[[0, 4]] = 2.0, 4.0
    >>> for ends in (None, (0.1, 0.5)):
    ...     ((fields,),) = averages(
    ...         Interface(0.8, 8, extent=ends), [window], s[None], p
    ...     )
    ...     print(fields.round(4).tolist())
    [3.0667, 2.4375, 4.6, 2.8421, 2.08, 3.25, 3.6, 3.6923]
    [inf, 2.4375, 4.6, inf, inf, inf, inf, inf]
    >>> moved = [(np.roll(s, -x) @ y) / (np.roll(p, -x) @ y) for x in range(8)]
    >>> np.round(moved, 4).tolist()
    [3.0667, 2.4375, 4.6, 2.8421, 2.08, 3.25, 3.6, 3.6923]
    """
    # Both averages are convolutions with the weights.
    load = interface.transform(profile)
    p_y = [interface.inverse_transform(load * (y.spectrum / y.total)) for y in windows]
    if interface.is_held:
        # Any finite value will do: the local
        # criterion leaves these nodes out.
        excess = np.where(interface.breakable, excess, 0.0)
        places = (places_of(interface, y) for y in windows)
        p_y = [np.where(at, scale, 0.0) for at, scale in zip(places, p_y, strict=True)]
    for strength in excess:
        waves = interface.transform(strength)
        pairs = zip(windows, p_y, strict=True)
        yield (
            np.divide(
                interface.inverse_transform(waves * y.spectrum), scale,
                out=np.full(interface.shape, np.inf), where=scale > 0.0,
            )
            for y, scale in pairs
        )  # fmt: skip


def least_average(
    interface: Interface, windows: Sequence[Window], excess: Array, profile: Array
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Return the least average of each sample over positions and windows (see `averages`).

    Returns the averages (Pa), their positions in nodes, and the numbers
    of their windows. On a line the minimum may lie between the nodes.
    On a plane, and if the interface ends, the average is taken at the
    nodes, and only the position is interpolated.

    The first window weighs three nodes, and the second window weighs two.
    They fit within the extent of nodes 1 to 5 at nodes 1 and 2, and at nodes
    1 to 4. In the first sample the second window has the least average,
    (5 + 2)/2. In the second sample it is 0.5 * 2 + 0.3 * 3 + 0.2 * 1. Beside
    a node without an average, the position is not interpolated.

    >>> y = np.zeros((2, 8))
    >>> y[0, [0, 1, 3]], y[1, :2] = (0.5, 0.3, 0.2), 0.5
    >>> windows = [
    ...     Window(1.0, (0.4,), 0.4, 1.0, of, np.conj(np.fft.rfft(of))) for of in y
    ... ]
    >>> s = np.full((2, 8), np.inf)
    >>> s[:, 1:6] = [[5.0, 2.0, 8.0, 4.0, 6.0], [2.0, 3.0, 9.0, 1.0, 9.0]]
    >>> line = Interface(0.8, 8, extent=(0.1, 0.5))
    >>> load, place, chosen = least_average(line, windows, s, np.ones(8))
    >>> load.round(9).tolist(), place.tolist(), chosen.tolist()
    ([3.5, 2.1], [1.0, 1.0], [1, 0])

    On a plane a position has two components.

    >>> s = np.full((1, 8, 8), 9.0)
    >>> s[0, 2, 4:7] = 5.0, 3.0, 4.0
    >>> y = np.eye(1, 64).reshape(8, 8)
    >>> window = Window(1.0, (0.1, 0.1), 0.01, 1.0, y, np.conj(np.fft.rfft2(y)))
    >>> load, place, _ = least_average(
    ...     Interface((0.8, 0.8), (8, 8)), [window], s, np.ones((8, 8))
    ... )
    >>> load.round(9).tolist(), place.round(4).tolist()
    ([3.0], [[2.0, 5.1667]])
    """
    count = len(excess)
    # A line has one window, and its minimum is found between the nodes.
    load, place, chosen = np.full(count, np.inf), np.zeros(count), np.zeros(count, np.int64)
    if not interface.is_plane and not interface.is_held:
        transform, multiplier = make_transform(interface.shape), np.array(windows[0].spectrum)
        reach = int(np.ceil(0.5 * windows[0].extents[0] / interface.spacing)) + 2
        _minimum_of_rows(transform, excess, profile, multiplier, reach, load, place)
        return load, place, chosen
    place = np.zeros((count, len(interface.shape)))
    for i, fields in enumerate(averages(interface, windows, excess, profile)):
        bound = np.min(excess[i] / profile)  # round-off of the transforms may fall below it
        for window, average in enumerate(fields):
            least = max(average.min(), bound)
            if least < load[i]:
                load[i], place[i], chosen[i] = least, _between_nodes(average), window
    return load, place if interface.is_plane else place[:, 0], chosen


def _between_nodes(average: Array) -> Array:
    """Step 2: return the position, in nodes, of the minimum of a parabola at the lowest node.

    Positions only at nodes would be visible as stripes in a histogram.

    The parabola through 3, 1 and 4 has its minimum 0.1 before the middle.
    The node before the first node is the last node.

    >>> _between_nodes(np.array([1.0, 4.0, 9.0, 9.0, 3.0])).round(6).tolist()
    [4.9]
    >>> field = np.full((4, 6), 9.0)
    >>> field[2], field[1, 4], field[3, 4] = [9.0, 9.0, 9.0, 5.0, 3.0, 4.0], 6.0, 4.0
    >>> _between_nodes(field).round(4).tolist()  # 2 + 0.5 * 2/4, 4 + 0.5 * 1/3
    [2.25, 4.1667]
    >>> (
    ...     _between_nodes(np.array([2.0, 2.0, 2.0])),
    ...     _between_nodes(np.array([np.inf, 2.0, np.inf])),
    ... )
    (array([0.]), array([1.]))
    """
    node = np.unravel_index(int(average.argmin()), average.shape)
    place = np.array(node, dtype=np.float64)
    for axis in range(average.ndim):
        through: Any = (*node[:axis], slice(None), *node[axis + 1 :])
        line = average[through]
        before, middle, after = (line[(node[axis] + s) % line.size] for s in (-1, 0, 1))
        bend = before - 2.0 * middle + after
        # A flat or infinite neighbourhood has no parabola.
        if 0.0 < bend < np.inf:
            place[axis] += 0.5 * (before - after) / bend
    return np.mod(place, average.shape)


@jit
def _estimates(values: Array, i: int) -> tuple[float, float]:
    """Step 3: return the minimum near a node from a parabola, and how much lower it may be.

    The minimum is infinite if the node is not a local minimum.

    The parabola through 5, 2 and 3 is 2 - u + 2 u², with the minimum 1.875.
    The third differences are 3 and 1. Places repeat, and in the opposite
    order nothing changes.

    >>> values = np.array([9.0, 5.0, 2.0, 3.0, 7.0, 8.0])
    >>> turned = [(np.roll(values, k), (2 + k) % 6) for k in range(6)] + [
    ...     (values[::-1].copy(), 3)
    ... ]
    >>> {tuple(np.round(_estimates.py_func(*given), 6).tolist()) for given in turned}
    {(1.875, 0.195)}
    >>> [
    ...     float(_estimates.py_func(np.array([4.0, 4.0, 1.0, 1.0, 4.0]), i)[0])
    ...     for i in (0, 2, 3)
    ... ]
    [inf, inf, 0.625]
    """
    n = values.size
    left, middle, right = values[i - 1], values[i], values[i + 1 - n]
    if not (middle <= left and middle < right):
        return np.inf, 0.0
    shift = 0.5 * (left - right) / (left - 2.0 * middle + right)
    before = abs(right - 3.0 * middle + 3.0 * left - values[i - 2])
    after = abs(values[i + 2 - n] - 3.0 * right + 3.0 * middle - left)
    return middle - 0.25 * (left - right) * shift, PARABOLA_ERROR * max(before, after)


@jit
def _slope(power: Array, u: float) -> tuple[float, float]:
    """Return the first and second derivative of a polynomial at u.

    The polynomial 5 + 3 u - 2 u² + u^9 has the derivatives 3 - 4 u + 9 u^8 and
    -4 + 72 u^7.

    >>> power = np.array([5.0, 3.0, -2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    >>> _slope(power, 1.0), _slope(power, -1.0)
    ((8.0, 68.0), (16.0, -76.0))
    """
    slope, curvature = 0.0, 0.0
    for p in range(STENCIL - 1, 0, -1):
        curvature = curvature * u + slope
        slope = slope * u + p * power[p]
    return slope, curvature


@jit
def _minimum_near(
    values: Array, strength: Array, profile: Array, reach: int, node: int, power: Array
) -> tuple[float, float]:
    """Step 4: return the minimum between a node and its two neighbours, and its position.

    Newton's method for the slope is kept inside a bracket, with
    bisection if the function is not convex. Two bounds exclude ringing
    of the polynomial. The first is the least ratio of strength to load
    under the patch. The second applies if the values are convex: the
    lines through two values on either side, extended until they meet.

    A cosine has its least value 2 at 5.3, between nodes 5 and 6. If a node
    under the patch has a ratio above 2, the minimum is not below this ratio.
    If the ratio exceeds the value at the node, the node is the minimum.

    >>> i, power = np.arange(32), np.empty(STENCIL)
    >>> values = 3.0 - np.cos(2.0 * np.pi * (i - 5.3) / 32)
    >>> for ratio in (0.0, 2.001, 2.1):
    ...     strength = np.where(abs(i - 5) <= 2, 3.0 * ratio, 0.0)
    ...     least, place = _minimum_near(
    ...         values, strength, np.full(32, 3.0), 2, 5, power
    ...     )
    ...     print(f"{least:.6f} {place:.6f}")
    2.000000 5.300000
    2.001000 5.300000
    2.001734 5.000000

    The polynomial rings at this corner. Lines with the slopes -1 and 17 on
    either side meet at 8 + 16/18.

    >>> values = np.maximum(12.0 - i, 17.0 * (i - 9.0) + 5.0)
    >>> for corner, node in ((values, 8), (values[::-1].copy(), 23)):
    ...     least, place = _minimum_near(
    ...         corner, -9.0 + 0.0 * i, np.ones(32), 2, node, power
    ...     )
    ...     print(f"{least:.4f}", 8 < place < 9 or 22 < place < 23)
    3.1111 True
    3.1111 True
    """
    n = values.size
    least = np.inf
    for j in range(node - reach, node + reach + 1):
        least = min(least, strength[j % n] / profile[j % n])
    lowest, place = values[node], float(node)
    for side in (-1, 1):
        cell = node if side > 0 else (node - 1) % n
        for p in range(STENCIL):
            power[p] = 0.0
        for j in range(STENCIL):
            value = values[(cell - STENCIL // 2 + 1 + j) % n] - values[cell]
            for p in range(STENCIL):
                power[p] += _FIT[p, j] * value
        u = -0.5 * side
        if side * _slope(power, u)[0] >= 0.0:  # the polynomial rises from the node
            continue
        low, high = -0.5, 0.5
        for _ in range(MAX_NEWTON_STEPS):
            slope, curvature = _slope(power, u)
            if slope > 0.0:
                high = u
            else:
                low = u
            move = -slope / curvature if curvature > 0.0 else np.inf
            if abs(move) < PLACE_ATOL:
                break
            u = u + move if low < u + move < high else 0.5 * (low + high)
        value = 0.0
        for p in range(STENCIL - 1, -1, -1):
            value = value * u + power[p]
        # The second bound: values that rise faster and faster stay
        # above the lines from outside.
        value = max(values[cell] + value, least)
        at_node, beside = values[node], values[(node + side) % n]
        before, rise = at_node - values[(node - side) % n], beside - at_node
        after = values[(node + 2 * side) % n] - beside
        if before <= rise <= after:  # convex
            bound = at_node
            if before < after:
                bound = at_node + before * (after - rise) / (after - before)
            value = max(value, bound)
        if value < lowest:
            lowest, place = value, node + 0.5 * side + u
    return lowest, place


@jit_allocating
def _minimum_of_rows(
    transform: Transform, excess: Array, profile: Array, multiplier: Array, reach: int,
    minimum: Array, place: Array,
) -> None:  # fmt: skip
    """Steps 1, 3 and 4: write the lowest average in every row, and its position in nodes.

    The weights are 0.5, and 0.25 on both sides, and the load profile is 2.
    The average multiplies a cosine by a known number. It repeats, and
    without a local minimum it is constant. (The function runs without
    compilation, with transforms by numpy.)

    >>> from types import FunctionType
    >>> def by_numpy(transform, multiplier, field, spectrum, out):
    ...     out[:] = np.fft.irfft(multiplier * np.fft.rfft(field), out.size)
    >>> names = globals() | {"convolve": by_numpy}
    >>> plain = FunctionType(_minimum_of_rows.py_func.__code__, names)
    >>> i, turn = np.arange(32), 2.0 * np.pi / 32
    >>> gains, (load, place) = (
    ...     0.5 + 0.5 * np.cos(turn * np.arange(17)),
    ...     np.zeros((2, 3)),
    ... )
    >>> s = [3.0 - np.cos(turn * (i - x)) / gains[1] for x in (5.3, 31.7)] + [
    ...     np.full(32, 7.0)
    ... ]
    >>> plain(None, np.array(s), np.full(32, 2.0), gains, 4, load, place)
    >>> load.round(6).tolist(), place.round(4).tolist()
    ([1.0, 1.0, 3.5], [5.3, 31.7, 0.0])

    This average has five minima. The parabola is lowest at node 0, but the
    least value, 2.996, lies at 25.6.

    >>> wave, slow = np.cos(5.0 * turn * i), np.cos(turn * (i - 27.0))
    >>> s = 4.0 - wave / gains[5] - 0.004 * slow / gains[1]
    >>> plain(None, s[None], np.ones(32), gains, 4, load, place)
    >>> print(f"{load[0]:.3f} {place[0]:.1f}")
    2.996 25.6
    """
    nodes = profile.size
    values, power = np.empty(nodes), np.empty(STENCIL)
    scale, spectrum = np.empty(nodes), np.empty(multiplier.size, np.complex128)
    convolve(transform, multiplier / multiplier[0], profile, spectrum, scale)
    for row in range(excess.shape[0]):
        strength = excess[row]
        convolve(transform, multiplier, strength, spectrum, values)
        # The exact average is at least the least ratio. Round-off of
        # the transforms may be below.
        least = np.inf
        for i in range(nodes):
            least = min(least, multiplier[0] * strength[i] / profile[i])
        for i in range(nodes):
            values[i] = max(values[i] / scale[i], least)
        # 3.
        best, lowest = ZERO + NO_NODE, np.inf
        for i in range(nodes):
            estimate = _estimates(values, i)[0]
            if estimate < lowest:
                best, lowest = i, estimate
        # 4. Without a local minimum the average is constant.
        average, where = values[0], 0.0
        if best != NO_NODE:
            average, where = _minimum_near(values, strength, profile, reach, best, power)
        for i in range(nodes):
            estimate, error = _estimates(values, i)
            if i != best and estimate - error < average:
                minimum_i, place_i = _minimum_near(values, strength, profile, reach, i, power)
                if minimum_i < average:
                    average, where = minimum_i, place_i
        where %= nodes
        minimum[row] = average
        place[row] = where if where < nodes else 0.0  # a tiny negative place rounds to `nodes`

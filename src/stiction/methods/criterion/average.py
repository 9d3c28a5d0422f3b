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
    """Return the first and second derivative of a polynomial at u."""
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
    """Steps 1, 3 and 4: write the lowest average in every row, and its position in nodes."""
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

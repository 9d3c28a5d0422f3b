"""The least moving average over places and windows."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.criterion.windows import Window
from stiction.jit import jit

STENCIL = 10
# Coefficients of the polynomial through ten nodes, in powers of the distance from their middle.
_FIT = np.linalg.inv(np.vander(np.arange(STENCIL) - 0.5 * (STENCIL - 1), increasing=True))


@jit
def _slope(power: Array, u: float) -> tuple[float, float]:
    """First and second derivative of a polynomial."""
    slope, curvature = 0.0, 0.0
    for p in range(STENCIL - 1, 0, -1):
        curvature = curvature * u + slope
        slope = slope * u + p * power[p]
    return slope, curvature


@jit
def _fit(values: Array, cell: int, power: Array) -> None:
    """The polynomial through the ten nodes around the cell from node `cell` to the next."""
    power[:] = 0.0
    for j in range(STENCIL):
        value = values[(cell - STENCIL // 2 + 1 + j) % values.size] - values[cell]
        for p in range(STENCIL):
            power[p] += _FIT[p, j] * value


@jit
def _between(values: Array, node: int, side: int, power: Array) -> tuple[float, float]:
    """The minimum between the lowest `node` and the one beside it: its value and place, in nodes.

    Newton's method on the slope of the local polynomial, kept between the points where the slope
    is known to change sign; it bisects where the function is not convex.
    """
    cell = node if side > 0 else (node - 1) % values.size
    _fit(values, cell, power)
    u = -0.5 * side
    if side * _slope(power, u)[0] >= 0.0:  # it rises from the node
        return values[node], float(node)
    low, high = -0.5, 0.5
    for _ in range(50):
        slope, curvature = _slope(power, u)
        if slope > 0.0:
            high = u
        else:
            low = u
        move = -slope / curvature if curvature > 0.0 else np.inf
        if abs(move) < 1e-11:
            break
        u = u + move if low < u + move < high else 0.5 * (low + high)
    value = 0.0
    for p in range(STENCIL - 1, -1, -1):
        value = value * u + power[p]
    return values[cell] + value, node + 0.5 * side + u


@jit
def _above_secants(values: Array, node: int, side: int) -> float:
    """What a convex function of these values cannot fall below between a node and the next.

    It lies above the lines through the two values on either side, extended until they meet. Where
    the values are not convex there is no such bound.
    """
    nodes = values.size
    here, following = values[node], values[(node + side) % nodes]
    before = here - values[(node - side) % nodes]
    after = values[(node + 2 * side) % nodes] - following
    rise = following - here
    if not before <= rise <= after:
        return -np.inf
    if before == after:
        return min(here, following)
    return here + before * (after - rise) / (after - before)


@jit
def _limited(
    values: Array, ratio: Array, reach: int, node: int, power: Array
) -> tuple[float, float]:
    """The minimum near `node`, kept to what weights that are not negative allow.

    The polynomial rings where the strength jumps. It may not fall below the least ratio of
    strength to load under the patch, nor below the secants of the values around.
    """
    least = np.inf
    for j in range(node - reach, node + reach + 1):
        least = min(least, ratio[j % ratio.size])
    lowest, where = values[node], float(node)
    for side in (-1, 1):
        value, place = _between(values, node, side, power)
        value = max(value, least, _above_secants(values, node, side))
        if value < lowest:
            lowest, where = value, place
    return lowest, where


@jit
def refine_minimum(values: Array, ratio: Array, reach: int) -> tuple[float, float]:
    """Minimum of a smooth function between the nodes of its `values`, and its place in nodes.

    A parabola through each local minimum of the nodes estimates how low the function falls there;
    a polynomial through ten nodes takes the lowest, and any other that might be lower.
    """
    nodes = values.size
    lows = np.empty(nodes // 2 + 1)
    lowest = np.empty(nodes // 2 + 1, dtype=np.int64)
    power = np.empty(STENCIL)
    count, best = 0, 0
    left, middle = values[nodes - 1], values[0]
    for i in range(nodes):
        right = values[i + 1] if i + 1 < nodes else values[0]
        if middle <= left and middle < right:
            shift = 0.5 * (left - right) / (left - 2.0 * middle + right)
            lows[count] = middle - 0.25 * (left - right) * shift
            lowest[count] = i
            if lows[count] < lows[best]:
                best = count
            count += 1
        left, middle = middle, right
    if count == 0:  # constant
        return values[0], 0.0
    value, place = _limited(values, ratio, reach, lowest[best], power)
    for i in range(count):
        if i == best:
            continue
        # A cubic through four nodes differs from the parabola by at most 0.065 third differences.
        node = lowest[i]
        left, middle, right = values[node - 1], values[node], values[(node + 1) % nodes]
        before = abs(right - 3.0 * middle + 3.0 * left - values[node - 2])
        after = abs(values[(node + 2) % nodes] - 3.0 * right + 3.0 * middle - left)
        if lows[i] - 0.065 * max(before, after) < value:
            other, elsewhere = _limited(values, ratio, reach, node, power)
            if other < value:
                value, place = other, elsewhere
    place %= nodes
    return value, place if place < nodes else 0.0  # a tiny negative place rounds to `nodes`


@jit
def minimum_rows(
    excess: Array, load: Array, multiplier: Array, reach: int, minimum: Array, place: Array
) -> None:
    """Minimum over x of <g, excess>/<g, load> for every row, and where, in units of nodes.

    The weight of the load has unit integral; a patch reaches `reach` nodes to either side.
    """
    rows, nodes = excess.shape
    scale = np.fft.irfft(np.fft.rfft(load) * (multiplier / multiplier[0]), nodes)
    for row in range(rows):
        ratio = multiplier[0] * excess[row] / load
        values = np.fft.irfft(np.fft.rfft(excess[row]) * multiplier, nodes) / scale
        # The weights keep to this bound; only the rounding of the transforms may not.
        least = ratio.min()
        for i in range(nodes):
            values[i] = max(values[i], least)
        minimum[row], place[row] = refine_minimum(values, ratio, reach)


class LocalOnset(NamedTuple):
    """Least moving average (Pa), the place it is at (in nodes, (2,)), and the window."""

    load: float
    place: Array
    window: int


def local_onset(windows: Sequence[Window], excess: Array, profile: Array) -> LocalOnset:
    """Find the least <s, y>/<p, y> over places and windows y of a plane.

    Strength less initial stress (Pa) and load profile are (nx, ny). The load is that of a node,
    which is exact for the discrete problem.
    """
    strength = np.fft.rfft2(excess)
    uniform = bool((profile == profile[0, 0]).all())
    load = None if uniform else np.fft.rfft2(profile)
    lowest, best, chosen = np.inf, excess, 0
    for number, window in enumerate(windows):
        average = np.fft.irfft2(strength * window.spectrum, excess.shape)
        if load is None:
            average /= profile[0, 0]
        else:
            average /= np.fft.irfft2(load * window.spectrum, excess.shape)
        least = float(average.min())
        if least < lowest:
            lowest, best, chosen = least, average, number
    return LocalOnset(lowest, _between_nodes(best), chosen)


def _between_nodes(average: Array) -> Array:
    """Return where a parabola through the nodes around the lowest has its minimum, in nodes.

    Places at nodes would show as stripes in a histogram.
    """
    node = np.unravel_index(int(average.argmin()), average.shape)
    place = np.array(node, dtype=np.float64)
    for axis in (0, 1):
        line = np.take(average, node[1 - axis], axis=1 - axis)
        before, here, after = (line[(node[axis] + s) % line.size] for s in (-1, 0, 1))
        bend = before - 2.0 * here + after
        if bend > 0.0:
            place[axis] += 0.5 * (before - after) / bend
    return np.mod(place, average.shape)

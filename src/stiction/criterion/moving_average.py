"""The moving average and its minimum between the nodes, row by row."""

from __future__ import annotations

import numpy as np

from stiction._jit import jit
from stiction._typing import Array


@jit
def average_rows(profiles: Array, multiplier: Array, out: Array) -> None:
    """Periodic moving average of every row, as a product in Fourier space."""
    nodes = profiles.shape[1]
    for row in range(profiles.shape[0]):
        out[row] = np.fft.irfft(np.fft.rfft(profiles[row]) * multiplier, nodes)


@jit
def _interpolant(spectrum: Array, nodes: int, theta: float) -> tuple[float, float, float]:
    """Value, first and second derivative in theta = 2 pi x/L of the trigonometric interpolant."""
    half = nodes // 2
    step = complex(np.cos(theta), np.sin(theta))
    power = complex(1.0, 0.0)
    value, slope, curvature = spectrum[0].real, 0.0, 0.0
    for m in range(1, half + 1):
        power *= step
        term = spectrum[m] * power
        weight = 1.0 if m == half else 2.0
        value += weight * term.real
        slope -= weight * m * term.imag
        curvature -= weight * m * m * term.real
    return value / nodes, slope / nodes, curvature / nodes


@jit
def _quotient(
    spectrum: Array, scale: Array, nodes: int, theta: float
) -> tuple[float, float, float]:
    """Value and two derivatives of the interpolant of `spectrum` over that of `scale`.

    A uniform scale comes as a spectrum of its mean alone, and costs nothing.
    """
    value, slope, curvature = _interpolant(spectrum, nodes, theta)
    if scale.size == 1:
        factor = nodes / scale[0].real
        return value * factor, slope * factor, curvature * factor
    below, slope_below, curvature_below = _interpolant(scale, nodes, theta)
    value /= below
    slope = (slope - value * slope_below) / below
    curvature = (curvature - 2.0 * slope * slope_below - value * curvature_below) / below
    return value, slope, curvature


@jit
def _newton(
    spectrum: Array, scale: Array, nodes: int, node: int, start: float
) -> tuple[float, float]:
    """The quotient's minimum within one spacing of `node`: its value and place, in nodes.

    Newton's method on the slope, from `start`, kept between the points where the slope is known
    to change sign; it bisects where the function is not convex.
    """
    angle = 2.0 * np.pi / nodes
    low, high = node - 1.0, node + 1.0
    place = start
    for _ in range(50):
        value, slope, curvature = _quotient(spectrum, scale, nodes, place * angle)
        if slope > 0.0:
            high = place
        else:
            low = place
        move = -slope / (curvature * angle) if curvature > 0.0 else np.inf
        if abs(move) < 1e-4:  # what is left of Newton's series is below round-off
            return value + 0.5 * slope * move * angle, place + move
        place = place + move if low < place + move < high else 0.5 * (low + high)
    return value, place


@jit
def refine_minimum(values: Array, spectrum: Array, scale: Array) -> tuple[float, float]:
    """Minimum of the interpolant of `spectrum` over that of `scale`, and its place in nodes.

    A parabola through each local minimum of the nodes' `values` estimates how low the function
    falls there; Newton's method takes the lowest to round-off, and any other that might be lower.
    """
    nodes = values.size
    lows, starts = np.empty(nodes // 2 + 1), np.empty(nodes // 2 + 1)
    lowest = np.empty(nodes // 2 + 1, dtype=np.int64)
    count, best = 0, 0
    left, middle = values[nodes - 1], values[0]
    for i in range(nodes):
        right = values[i + 1] if i + 1 < nodes else values[0]
        if middle <= left and middle < right:
            bend = left - 2.0 * middle + right
            shift = 0.5 * (left - right) / bend
            lows[count] = middle - 0.25 * (left - right) * shift
            starts[count] = i + shift
            lowest[count] = i
            if lows[count] < lows[best]:
                best = count
            count += 1
        left, middle = middle, right
    if count == 0:  # constant
        return values[0], 0.0
    value, place = _newton(spectrum, scale, nodes, lowest[best], starts[best])
    for i in range(count):
        if i == best:
            continue
        # A cubic through four nodes differs from the parabola by at most 0.065 third differences.
        node = lowest[i]
        left, middle, right = values[node - 1], values[node], values[(node + 1) % nodes]
        before = abs(right - 3.0 * middle + 3.0 * left - values[node - 2])
        after = abs(values[(node + 2) % nodes] - 3.0 * right + 3.0 * middle - left)
        if lows[i] - 0.065 * max(before, after) < value:
            other, elsewhere = _newton(spectrum, scale, nodes, node, starts[i])
            if other < value:
                value, place = other, elsewhere
    place %= nodes
    return value, place if place < nodes else 0.0  # a tiny negative place rounds to `nodes`


@jit
def minimum_rows(
    excess: Array, load: Array, multiplier: Array, factor: int, minimum: Array, place: Array
) -> None:
    """Minimum over x of <g, excess>/<g, load> for every row, and where, in units of nodes.

    Both averages are trigonometric interpolants; the weight of the load has unit integral. The
    minimum is sought on a grid `factor` times finer and then between its nodes.
    """
    rows, nodes = excess.shape
    fine = factor * nodes
    half = nodes // 2
    below = np.zeros(fine // 2 + 1, dtype=np.complex128)
    below[: half + 1] = np.fft.rfft(load) * (multiplier * (factor / multiplier[0]))
    if factor > 1:  # the highest mode of the coarse grid stands for both of its signs
        below[half] *= 0.5
    scale = np.fft.irfft(below, fine)
    if np.ptp(load) <= 1e-14 * load[0]:
        below = below[:1].copy()
    spectrum = np.zeros(fine // 2 + 1, dtype=np.complex128)
    for row in range(rows):
        spectrum[: half + 1] = np.fft.rfft(excess[row]) * (multiplier * factor)
        if factor > 1:
            spectrum[half] *= 0.5
        quotient = np.fft.irfft(spectrum, fine) / scale
        minimum[row], where = refine_minimum(quotient, spectrum, below)
        place[row] = where / factor

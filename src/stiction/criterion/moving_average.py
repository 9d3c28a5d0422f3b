"""The moving average and its minimum between the nodes, row by row."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stiction._jit import jit

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@jit
def average_rows(profiles: Array, multiplier: Array, out: Array) -> None:
    """Periodic moving average of every row, as a product in Fourier space."""
    nodes = profiles.shape[1]
    for row in range(profiles.shape[0]):
        out[row] = np.fft.irfft(np.fft.rfft(profiles[row]) * multiplier, nodes)


@jit
def _interpolant(spectrum: Complex, nodes: int, theta: float) -> tuple[float, float, float]:
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
def _newton(spectrum: Complex, nodes: int, node: int, start: float) -> tuple[float, float]:
    """The interpolant's minimum within one spacing of `node`: its value and place, in nodes.

    Newton's method on the slope, from `start`, kept between the points where the slope is known
    to change sign; it bisects where the interpolant is not convex.
    """
    angle = 2.0 * np.pi / nodes
    low, high = node - 1.0, node + 1.0
    place = start
    for _ in range(50):
        value, slope, curvature = _interpolant(spectrum, nodes, place * angle)
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
def refine_minimum(values: Array, spectrum: Complex) -> tuple[float, float]:
    """Minimum of the trigonometric interpolant of `values`, and its place in units of nodes.

    A parabola through each local minimum of the nodes estimates how low the interpolant falls
    there; Newton's method takes the lowest to round-off, and any other that might be lower.
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
    value, place = _newton(spectrum, nodes, lowest[best], starts[best])
    for i in range(count):
        # The parabola's drop below its node is right to well within a factor of two.
        if i != best and lows[i] - (values[lowest[i]] - lows[i]) < value:
            other, elsewhere = _newton(spectrum, nodes, lowest[i], starts[i])
            if other < value:
                value, place = other, elsewhere
    return value, place % nodes


@jit
def minimum_rows(
    excess: Array, multiplier: Array, scale: Array, minimum: Array, place: Array
) -> None:
    """Minimum over x of <g, excess>/scale for every row, and where, in units of nodes.

    `scale` is the averaged load profile at the nodes. Where it is uniform, the minimum is that of
    the interpolant of the average, else that of the interpolant of the quotient at the nodes.
    """
    rows, nodes = excess.shape
    uniform = True
    for i in range(nodes):
        if abs(scale[i] - scale[0]) > 1e-14 * scale[0]:
            uniform = False
    for row in range(rows):
        spectrum = np.fft.rfft(excess[row]) * (multiplier / scale[0])
        average = np.fft.irfft(spectrum, nodes)
        if not uniform:
            for i in range(nodes):
                average[i] *= scale[0] / scale[i]
            spectrum = np.fft.rfft(average)
        minimum[row], place[row] = refine_minimum(average, spectrum)

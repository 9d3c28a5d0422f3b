"""The local criterion of a plane: ellipses that are unstable by themselves.

An ellipse of given aspect is critical when the lowest eigenvalue of K on its nodes has fallen to W.
Its eigenvector y is a multiplier of the whole interface, so the moving average of strength less
initial stress with the weight y, over that of the load profile, bounds the onset from above
(strictly for a Z-matrix). For nu = 0 the critical disc has radius 2.0061 G/(2W).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction._typing import Array
from stiction.equilibrium.conjugate_gradients import Mask
from stiction.equilibrium.lowest_eigenvector import lowest_eigenvector
from stiction.equilibrium.transform_operator import Operator, make_operator

TOLERANCE = 1e-9
"""Residual of an eigenvector, as a share of W."""
ITERATIONS = 500


class EllipseWindow(NamedTuple):
    """A critical ellipse.

    Attributes
    ----------
    aspect : float
        Semi-axis along x over that along y.
    extents : (float, float)
        Lengths along x and y, m.
    area : float
        Of its nodes, m^2.
    eigenvalue : float
        Lowest eigenvalue of K on it, not above W, Pa/m.
    weight : (nx, ny) array
        Eigenvector of unit sum, centred on node (0, 0).
    spectrum : (nx, ny // 2 + 1) complex array
        Conjugate of its transform.
    """

    aspect: float
    extents: tuple[float, float]
    area: float
    eigenvalue: float
    weight: Array
    spectrum: NDArray[np.complex128]


def squared_radius(shape: tuple[int, int], lengths: tuple[float, float], aspect: float) -> Array:
    """x^2 + (aspect y)^2 of every node, from the nearest image of node (0, 0), m^2."""
    x = np.fft.fftfreq(shape[0]) * lengths[0]
    y = np.fft.fftfreq(shape[1]) * lengths[1]
    result: Array = (x[:, None]) ** 2 + (aspect * y[None, :]) ** 2
    return result


def _lowest(operator: Operator, inside: Mask, rate: float, guess: Array) -> float:
    if not (guess[inside] != 0.0).any():
        guess[:] = 1.0
    return lowest_eigenvector(operator, inside, guess, TOLERANCE * rate, ITERATIONS)[0]


def ellipse_window(
    symbol: Array, shape: tuple[int, int], lengths: tuple[float, float], rate: float, aspect: float
) -> EllipseWindow | None:
    """Smallest unstable ellipse of one aspect, or None if it does not fit between its images.

    Parameters
    ----------
    symbol : (nx, ny // 2 + 1) array
        K(k), Pa/m.
    shape, lengths : (int, int), (float, float)
        Nodes and periods (m).
    rate : float
        W, Pa/m.
    aspect : float
        Semi-axis along x over that along y.
    """
    operator = make_operator(symbol, rate, shape)._replace(rate=np.zeros(shape))
    distance = squared_radius(shape, lengths, aspect)
    radii = np.unique(np.round(distance / distance.max(), 12)) * distance.max() * (1.0 + 1e-11)
    half = min(0.5 * lengths[0], 0.5 * lengths[1] * aspect)
    low, high = -1, int(np.searchsorted(radii, half**2))
    if high == 0:
        return None
    found = None
    guess = np.ones(shape)
    probe = max(1, high // 16)  # small ones first: they cost the fewest iterations
    while high - low > 1:
        middle = min(low + probe, high - 1) if probe else (low + high) // 2
        inside = distance <= radii[middle]
        vector = guess.copy()
        value = _lowest(operator, inside, rate, vector)
        if value <= rate:
            high, found, guess, probe = middle, (inside, value, vector), vector, 0
        else:
            low, guess = middle, vector
            probe *= 2
    if found is None:
        return None
    inside, value, vector = found
    weight = np.maximum(vector, 0.0)
    weight /= weight.sum()
    axis = float(np.sqrt(radii[high]))
    cell = lengths[0] * lengths[1] / (shape[0] * shape[1])
    return EllipseWindow(
        aspect, (2.0 * axis, 2.0 * axis / aspect), float(inside.sum()) * cell, value, weight,
        np.conj(np.fft.rfft2(weight)),
    )  # fmt: skip


class LocalOnset(NamedTuple):
    """Least moving average (Pa), the node it is at, the window, and the average, (nx, ny)."""

    load: float
    node: tuple[int, int]
    window: int
    average: Array


def local_onset(windows: Sequence[EllipseWindow], excess: Array, profile: Array) -> LocalOnset:
    """Minimum over place and shape of <s, y>/<p, y>.

    Parameters
    ----------
    windows : sequence of EllipseWindow
    excess, profile : (nx, ny) arrays
        Strength less initial stress (Pa), and the load profile.
    """
    strength = np.fft.rfft2(excess)
    uniform = bool((profile == profile[0, 0]).all())
    load = None if uniform else np.fft.rfft2(profile)
    best: LocalOnset | None = None
    for number, window in enumerate(windows):
        average = np.fft.irfft2(strength * window.spectrum, excess.shape)
        if load is None:
            average /= profile[0, 0]
        else:
            average /= np.fft.irfft2(load * window.spectrum, excess.shape)
        place = int(average.argmin())
        if best is None or average.flat[place] < best.load:
            ny = excess.shape[1]
            best = LocalOnset(
                float(average.flat[place]), (place // ny, place % ny), number, average
            )
    if best is None:
        raise ValueError("no critical ellipse fits on the plane")
    return best

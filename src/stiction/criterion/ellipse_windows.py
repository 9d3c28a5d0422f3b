"""The local criterion of a plane: ellipses that are unstable by themselves.

An ellipse of given aspect is critical when the lowest eigenvalue of K on its nodes has fallen to W.
Its eigenvector y is a multiplier of the whole interface, so the moving average of strength less
initial stress with the weight y, over that of the load profile, bounds the onset from above
(strictly for a Z-matrix). For nu = 0 the critical disc has radius 2.0061 G/(2W).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.elasticity.lowest_eigenvector import lowest_eigenvector
from stiction.elasticity.transform_operator import make_operator

TOLERANCE = 1e-9
"""Residual of an eigenvector, as a share of W."""
ITERATIONS = 500
SMALLEST_BOX = 32
"""Nodes along each side of the piece of a plane that is looked at first."""


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


def squared_radius(shape: tuple[int, int], spacings: tuple[float, float], aspect: float) -> Array:
    """x^2 + (aspect y)^2 of every node, from the nearest image of node (0, 0), m^2."""
    x, y = (np.fft.fftfreq(n) * n * spacing for n, spacing in zip(shape, spacings, strict=True))
    result: Array = (x[:, None]) ** 2 + (aspect * y[None, :]) ** 2
    return result


def _boxes(shape: tuple[int, int]) -> Iterator[tuple[int, int]]:
    """Ever larger pieces of a plane, the last of them the whole."""
    side = SMALLEST_BOX
    while side < max(shape):
        yield min(side, shape[0]), min(side, shape[1])
        side *= 2
    yield shape


def _nodes_of(box: tuple[int, int], shape: tuple[int, int]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Nodes of the plane that a box around node (0, 0) consists of, in the order of transforms."""
    along, across = (
        np.rint(np.fft.fftfreq(n) * n).astype(np.int64) % whole
        for n, whole in zip(box, shape, strict=True)
    )
    return np.ix_(along, across)


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

    Notes
    -----
    What happens on the nodes of an ellipse is the same on a box of the plane that is twice as
    long, made periodic with the stiffness between its own nodes: a block of a Toeplitz matrix is
    one of a circulant. So the cost follows the ellipse and not the plane.
    """
    spacings = lengths[0] / shape[0], lengths[1] / shape[1]
    column = np.fft.irfft2(symbol, shape)
    least = 0.0
    for box in _boxes(shape):
        workspace = [
            n * spacing * (0.5 if n == whole else 0.25) * stretch
            for n, whole, spacing, stretch in zip(box, shape, spacings, (1.0, aspect), strict=True)
        ]
        nodes = _nodes_of(box, shape)
        found = _smallest_unstable(column[nodes], spacings, rate, aspect, least, min(workspace))
        if found is not None:
            weight = np.zeros(shape)
            weight[nodes] = np.maximum(found.vector, 0.0)
            weight /= weight.sum()
            area = found.nodes * spacings[0] * spacings[1]
            extents = 2.0 * found.axis, 2.0 * found.axis / aspect
            spectrum = np.conj(np.fft.rfft2(weight))
            return EllipseWindow(aspect, extents, area, found.eigenvalue, weight, spectrum)
        least = min(workspace) ** 2
    return None


class _Unstable(NamedTuple):
    """Eigenvector on a box, semi-axis along x (m), number of nodes, lowest eigenvalue (Pa/m)."""

    vector: Array
    axis: float
    nodes: int
    eigenvalue: float


def _smallest_unstable(
    column: Array,
    spacings: tuple[float, float],
    rate: float,
    aspect: float,
    least: float,
    axis: float,
) -> _Unstable | None:
    """Smallest unstable ellipse in a box, by bisection of its semi-axis up to `axis`.

    Parameters
    ----------
    column : (mx, my) array
        Stress (Pa) at each node of the box by unit slip at node (0, 0).
    least : float
        Square of a semi-axis that is known to be stable, m^2.
    """
    shape = column.shape
    symbol = np.ascontiguousarray(np.fft.rfft2(column).real)
    operator = make_operator(symbol, rate, shape)._replace(
        rate=np.zeros(shape), inverse=1.0 / (np.maximum(symbol, 0.0) + 0.5 * rate)
    )
    distance = squared_radius(shape, spacings, aspect)
    radii = np.unique(distance)
    # Nodes that are equally far by symmetry differ by round-off.
    radii = radii[np.append(np.diff(radii) > 1e-9 * radii[1:], True)] * (1.0 + 1e-9)
    low, high = int(np.searchsorted(radii, least)) - 1, int(np.searchsorted(radii, axis**2))
    if high <= low + 1:
        return None
    found = None
    guess = np.ones(shape)
    probe = max(1, (high - low) // 16)  # small ones first: they cost the fewest iterations
    while high - low > 1:
        middle = min(low + probe, high - 1) if probe else (low + high) // 2
        inside = distance <= radii[middle]
        vector = guess.copy()
        if not (vector[inside] != 0.0).any():
            vector[:] = 1.0
        value = lowest_eigenvector(operator, inside, vector, TOLERANCE * rate, ITERATIONS)[0]
        if value <= rate:
            high, found, guess, probe = middle, (inside, value, vector), vector, 0
        else:
            low, guess = middle, vector
            probe *= 2
    if found is None:
        return None
    inside, value, vector = found
    return _Unstable(vector, float(np.sqrt(radii[high])), int(inside.sum()), value)


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

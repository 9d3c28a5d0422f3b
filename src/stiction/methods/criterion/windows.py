"""Critical windows: patches that are just unstable in isolation, with weights for their nodes.

Problem
-------
K is the stiffness and W the uniform weakening rate (Pa/m). A window is a set of
nodes on which the lowest eigenvalue of K is at most W. Its eigenvector y > 0 has
unit sum. If all other nodes are held, slip on the window becomes unstable at the
load <s, y>/<p, y>. Here s is the strength minus initial stress (Pa), and p is the
load profile. If K has no positive off-diagonal entry, y is a multiplier for the
whole interface. This load then bounds the onset from above, as long as no node
reaches its residual strength.

Algorithm
---------
On a line, the window has the nucleation length h_n, and y is the eigenfunction of
K. Uenishi and J. R. Rice (J. Geophys. Res. 108, 2003) as weights for the nodes
(`eigenfunction`). On a plane, the window is an ellipse. For each of five aspects:

1. Start with a small box of nodes, made periodic with the stiffness
   between its own nodes. A block of a Toeplitz matrix is a block of a
   circulant matrix, so the problem on an ellipse of at most half the
   length of the box stays the same. The cost depends on the size of the
   ellipse, not of the plane.
2. Find by bisection the smallest ellipse in the box whose lowest
   eigenvalue is at most W (`_smallest_unstable`), with LOBPCG
   (`elasticity.operator`).
3. If every ellipse in the box is stable, double the box and repeat step 2. If the
   box is already the whole plane, the window does not fit.

For nu = 0 the critical disc has radius 2.0061 G/(2W).
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.elasticity.operator import lowest_eigenvector, make_operator
from stiction.elasticity.protocol import HalfSpaces
from stiction.methods.criterion.eigenfunction import around, grid_weights
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem

# Aspects of the ellipses, relative to the middle ellipse. With the
# paper's strength nine shapes from 0.8 to 2 lower the bound by less
# than 0.05 % more.
STRETCHES = (2.0 / 3.0, 5.0 / 6.0, 1.0, 6.0 / 5.0, 3.0 / 2.0)
EIGENVECTOR_RTOL = 1e-9  # residual of an eigenvector, as a share of W
MAX_ELLIPSE_ITERATIONS = 500
MIN_BOX_NODES = 32  # along each side of the box that is searched first
RADIUS_RTOL = 1e-9  # distances of nodes that are equal by symmetry differ by round-off
FIRST_PROBE_SHARE = 16  # the first ellipse to be tried has a sixteenth of all radii below it


class Window(NamedTuple):
    """A critical patch, centred on the first node."""

    aspect: float  # ratio of the semi-axes along x and y; 1 on a line
    extents: tuple[float, ...]  # length in each direction, m
    area: float  # its length (m), on a plane the area of its nodes (m²)
    eigenvalue: float  # lowest eigenvalue of K on it, not above W, Pa/m
    weight: Array  # of each node (*shape), never negative, of unit sum
    spectrum: NDArray[Any]  # conjugate of its transform, which the moving average multiplies by

    @property
    def total(self) -> float:
        """Sum of the weights, 1 to round-off."""
        return float(self.spectrum.flat[0].real)


def windows_of(
    problem: Problem, W: float, stretches: Sequence[float] = STRETCHES
) -> list[Window]:
    """Return the critical windows for a weakening rate (Pa/m), or raise an `InputError`.

    A line has a single window. A plane has a window for each multiple
    of the aspect 1/sqrt(1 - nu), because the critical length in mode II
    is 1/(1 - nu) times the critical length in mode III. Every window
    must fit on the interface.
    """
    interface, solid = problem.interface, problem.solid
    length = problem.nucleation_lengths(W)[0]
    advice = "The local criterion does not hold there, use st.Equilibrium()"
    if not interface.is_plane:
        if length > interface.measure:
            raise InputError(
                f"interface.length: the nucleation length {length:.4g} m is longer than the"
                f" interface ({interface.measure:.4g} m). {advice} or st.Rupture()"
            )
        weights = _line_weights(0.5 * length / interface.spacing, interface.size)
        return _within_extent(interface, [Window(1.0, (length,), length, W, *weights)])
    middle = float(1.0 / np.sqrt(1.0 - solid.poisson_ratio))
    windows = []
    for aspect in (middle * stretch for stretch in stretches):
        window = ellipse_window(problem.half_spaces, interface.shape, W, aspect)
        if window is None:
            size = " x ".join(f"{side:.4g}" for side in interface.lengths)
            raise InputError(
                f"interface.length: a critical patch does not fit on a plane of {size} m: in each"
                f" direction it takes nearly twice the nucleation length, {length:.4g} m. {advice}"
            )
        windows.append(window)
    return _within_extent(interface, windows)


def places_of(interface: Interface, window: Window) -> Any:
    """Return a mask (*shape) of the nodes at which a window lies within the interface's extent."""
    if not interface.is_held:
        return True
    beyond = interface.transform(1.0 * ~interface.breakable)
    under = interface.transform(1.0 * (window.weight > 0.0)).conj()
    return interface.inverse_transform(beyond * under) < 0.5  # a number of nodes, to round-off


def _within_extent(interface: Interface, windows: list[Window]) -> list[Window]:
    """Return the windows that fit within the extent. Raise an error if no window fits."""
    if fitting := [y for y in windows if np.any(places_of(interface, y))]:
        return fitting
    extents = " x ".join(f"{length:.4g}" for length in windows[0].extents)
    raise InputError(
        f"interface.extent: no critical patch ({extents} m) lies within it; widen it, or use"
        " st.Equilibrium()"
    )


@lru_cache(maxsize=64)
def _line_weights(half_width: float, nodes: int) -> tuple[Array, Array]:
    """Return the weights around node 0, and their transform. `half_width` is h_n/2 in nodes."""
    weights = around(grid_weights(half_width), nodes)
    spectrum = np.fft.rfft(weights).real
    for array in (weights, spectrum):
        array.flags.writeable = False
    return weights, spectrum


@lru_cache(maxsize=64, typed=True)
def ellipse_window(
    half_spaces: HalfSpaces, shape: tuple[int, ...], W: float, aspect: float
) -> Window | None:
    """Return the smallest unstable ellipse with an aspect, or `None` if it meets its images.

    See steps 1 to 3 in the docstring of the module.
    """
    spacings = np.divide(half_spaces.lengths, shape)
    column = np.fft.irfft2(half_spaces.symbol(shape), shape)
    stable_square, side = 0.0, MIN_BOX_NODES
    while True:
        # 1. An ellipse may fill half of the box, or all of the plane.
        box = np.minimum(side, shape)
        share = np.where(box == shape, 0.5, 0.25)
        axis = float(np.min(box * spacings * share * (1.0, aspect)))
        steps_x, steps_y = (np.rint(np.fft.fftfreq(n) * n).astype(np.int64) for n in box)
        nodes = np.ix_(steps_x % shape[0], steps_y % shape[1])
        x, y = steps_x * spacings[0], steps_y * spacings[1]
        distance = x[:, None] ** 2 + (aspect * y[None, :]) ** 2
        # 2.
        ellipse = _smallest_unstable(column[nodes], distance, W, stable_square, axis**2)
        if ellipse is not None:
            weight = np.zeros(shape)
            weight[nodes] = np.maximum(ellipse.vector, 0.0)
            weight /= weight.sum()
            length = 2.0 * float(np.sqrt(ellipse.square))
            area = float((distance <= ellipse.square).sum() * np.prod(spacings))
            extents, spectrum = (length, length / aspect), np.conj(np.fft.rfft2(weight))
            return Window(aspect, extents, area, ellipse.eigenvalue, weight, spectrum)
        # 3.
        if (box == shape).all():
            return None
        stable_square, side = axis**2, 2 * side


class Ellipse(NamedTuple):
    """Ellipse that contains nodes on which the lowest eigenvalue of K is at most W."""

    square: float  # of its semi-axis along x, m²
    eigenvalue: float  # Pa/m
    vector: Array  # on the nodes of the box


def _smallest_unstable(
    column: Array, distance: Array, W: float, stable_square: float, max_square: float
) -> Ellipse | None:
    """Step 2: find the smallest unstable ellipse up to `max_square` (m²), or `None`, by bisection.

    `column` holds the stress (Pa) at each node of
    the box due to unit slip at node (0, 0). Ellipses
    up to `stable_square` are known to be stable.
    """
    symbol = np.fft.rfft2(column).real
    operator = make_operator(symbol, W, column.shape)._replace(
        weakening_rate=np.zeros(column.size),
        inverse=1.0 / (np.maximum(symbol.flatten(), 0.0) + 0.5 * W),
    )
    radii = np.unique(distance)
    is_last_of_equals = np.append(np.diff(radii) > RADIUS_RTOL * radii[1:], True)
    radii = radii[is_last_of_equals] * (1.0 + RADIUS_RTOL)
    low, high = (int(np.searchsorted(radii, square)) for square in (stable_square, max_square))
    low -= 1
    ellipse: Ellipse | None = None
    tolerance = EIGENVECTOR_RTOL * W
    vector = np.ones(column.shape)
    probe = max(1, (high - low) // FIRST_PROBE_SHARE)  # small ones take the fewest iterations
    while high - low > 1:
        middle = (low + high) // 2 if ellipse else min(low + probe, high - 1)
        inside = distance <= radii[middle]
        vector = vector.copy() if vector[inside].any() else np.ones(column.shape)
        value, _ = lowest_eigenvector(
            operator, inside.reshape(-1), vector.reshape(-1), tolerance, MAX_ELLIPSE_ITERATIONS
        )
        if value <= W:
            high, ellipse = middle, Ellipse(float(radii[middle]), value, vector)
        else:
            low, probe = middle, 2 * probe
    return ellipse

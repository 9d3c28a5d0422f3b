"""Critical windows: patches that are just unstable by themselves, and weights of their nodes.

On a line the window is the nucleation length with the eigenfunction of Uenishi and Rice (2003) as
its weight. On a plane it is an ellipse: for each of five aspects the smallest on whose nodes the
lowest eigenvalue of K has fallen to W, with the eigenvector as weight. The eigenvector is a
multiplier of the whole interface, so the average of strength less initial stress with this weight,
over that of the load profile, bounds the load at onset from above, as long as no node reaches its
residual strength (strictly for a Z-matrix). For nu = 0 the critical disc has radius
2.0061 G/(2W).
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
from stiction.problem.problem import Problem

# Aspects of the ellipses over that of the middle one. With the paper's strength nine shapes from
# 0.8 to 2 lower the bound by less than 0.05 % more.
STRETCHES = (2.0 / 3.0, 5.0 / 6.0, 1.0, 6.0 / 5.0, 3.0 / 2.0)
TOLERANCE, ITERATIONS = 1e-9, 500  # residual of an eigenvector, as a share of W
SMALLEST_BOX = 32  # nodes along each side of the part of a plane that is searched first


class Window(NamedTuple):
    """A critical patch, centred on the first node."""

    aspect: float  # semi-axis along x over that along y; 1 on a line
    extents: tuple[float, ...]  # length in each direction, m
    area: float  # its length (m), on a plane the area of its nodes (m²)
    eigenvalue: float  # lowest eigenvalue of K on it, not above W, Pa/m
    weight: Array  # of each node (*shape), never negative, of unit sum
    spectrum: NDArray[Any]  # conjugate of its transform: what the moving average does to waves

    @property
    def total(self) -> float:
        """Sum of the weights, one to round-off."""
        return float(self.spectrum.flat[0].real)


def windows_of(
    problem: Problem, rate: float, stretches: Sequence[float] = STRETCHES
) -> list[Window]:
    """Return the critical windows of a weakening rate (Pa/m); `InputError` if one does not fit.

    One on a line; on a plane one for each multiple of the aspect 1/sqrt(1 - nu), because a line of
    mode II is critical at a length that is 1/(1 - nu) times that of mode III.
    """
    interface, solid = problem.interface, problem.solid
    length = problem.nucleation_lengths(rate)[0]
    advice = "the local criterion does not hold there, use st.Equilibrium()"
    if not interface.is_plane:
        if length > interface.extent:
            raise InputError(
                f"interface.length: the nucleation length {length:.4g} m is longer than the"
                f" interface ({interface.extent:.4g} m); {advice} or st.Rupture()"
            )
        weights = _line_weights(0.5 * length / interface.spacing, interface.size)
        return [Window(1.0, (length,), length, rate, *weights)]
    middle = float(1.0 / np.sqrt(1.0 - solid.poisson_ratio))
    found = []
    for aspect in (middle * stretch for stretch in stretches):
        window = _ellipse(problem.half_spaces, interface.shape, rate, aspect)
        if window is None:
            size = " x ".join(f"{one:.4g}" for one in interface.lengths)
            raise InputError(
                f"interface.length: a critical patch does not fit on a plane of {size} m: in each"
                f" direction it takes nearly twice the nucleation length, {length:.4g} m; {advice}"
            )
        found.append(window)
    return found


@lru_cache(maxsize=64)
def _line_weights(half_width: float, nodes: int) -> tuple[Array, Array]:
    """Return the weights around node 0 and their transform; `half_width` is h_n/2 in nodes."""
    weights = around(grid_weights(half_width), nodes)
    found = weights, np.fft.rfft(weights).real
    for array in found:
        array.flags.writeable = False
    return found


@lru_cache(maxsize=64)
def _ellipse(
    half_spaces: HalfSpaces, shape: tuple[int, ...], rate: float, aspect: float
) -> Window | None:
    symbol = half_spaces.symbol(shape)
    return ellipse_window(symbol, shape, half_spaces.lengths, rate, aspect)


def ellipse_window(
    symbol: Array,
    shape: tuple[int, ...],
    lengths: tuple[float, ...],
    rate: float,
    aspect: float,
) -> Window | None:
    """Return the smallest unstable ellipse of one aspect; None if it meets its images.

    The problem on the nodes of an ellipse is the same on a box of the plane that is twice as
    long, made periodic with the stiffness between its own nodes: a block of a Toeplitz matrix is
    one of a circulant. So the cost follows the ellipse and not the plane.
    """
    spacings = np.divide(lengths, shape)
    column = np.fft.irfft2(symbol, shape)
    least, side = 0.0, SMALLEST_BOX
    while True:
        box = np.minimum(side, shape)
        share = np.where(box == shape, 0.5, 0.25)
        axis = float(np.min(box * spacings * share * (1.0, aspect)))
        steps = [np.rint(np.fft.fftfreq(n) * n).astype(np.int64) for n in box]
        nodes = np.ix_(*(one % n for one, n in zip(steps, shape, strict=True)))
        x, y = (one * spacing for one, spacing in zip(steps, spacings, strict=True))
        distance = x[:, None] ** 2 + (aspect * y[None, :]) ** 2
        found = _smallest_unstable(column[nodes], distance, rate, least, axis**2)
        if found is not None:
            square, value, vector = found
            weight = np.zeros(shape)
            weight[nodes] = np.maximum(vector, 0.0)
            weight /= weight.sum()
            length = 2.0 * float(np.sqrt(square))
            area = float((distance <= square).sum() * np.prod(spacings))
            spectrum = np.conj(np.fft.rfft2(weight))
            return Window(aspect, (length, length / aspect), area, value, weight, spectrum)
        if (box == shape).all():
            return None
        least, side = axis**2, 2 * side


def _smallest_unstable(
    column: Array, distance: Array, rate: float, least: float, most: float
) -> tuple[float, float, Array] | None:
    """Find by bisection the squared distance (m²) within which K has an eigenvalue up to W.

    The column is the stress (Pa) at each node of a box by unit slip at node (0, 0). Nodes up to
    `least` are stable. The eigenvalue and the eigenvector come along.
    """
    symbol = np.fft.rfft2(column).real
    operator = make_operator(symbol, rate, column.shape)._replace(
        rate=np.zeros(column.size),
        inverse=1.0 / (np.maximum(symbol.flatten(), 0.0) + 0.5 * rate),
    )
    radii = np.unique(distance)
    # Nodes that are equally far by symmetry differ by round-off.
    radii = radii[np.append(np.diff(radii) > 1e-9 * radii[1:], True)] * (1.0 + 1e-9)
    low, high = (int(np.searchsorted(radii, square)) for square in (least, most))
    low -= 1
    found: tuple[float, float, Array] | None = None
    vector = np.ones(column.shape)
    probe = max(1, (high - low) // 16)  # small ones first: they take the fewest iterations
    while high - low > 1:
        middle = (low + high) // 2 if found else min(low + probe, high - 1)
        inside = distance <= radii[middle]
        vector = vector.copy() if vector[inside].any() else np.ones(column.shape)
        value, _ = lowest_eigenvector(
            operator, inside.reshape(-1), vector.reshape(-1), TOLERANCE * rate, ITERATIONS
        )
        if value <= rate:
            high, found = middle, (float(radii[middle]), value, vector)
        else:
            low, probe = middle, 2 * probe
    return found

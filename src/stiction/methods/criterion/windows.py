"""Critical windows: patches that are just unstable in isolation, with weights for their nodes.

Problem
-------
K is the stiffness and W the uniform weakening rate (Pa/m). A window is
a set of nodes on which the lowest eigenvalue of K is at most W. Its
eigenvector y > 0 has unit sum. If all other nodes are held, slip on the
window becomes unstable at the load <s, y>/<p, y>. Here s is the
strength minus initial stress (Pa), and p is the load profile. If K has
no positive off-diagonal entry, y is a multiplier for the whole
interface. This load then bounds the onset from above, as long as no
node reaches its residual strength.

Algorithm
---------
On a line, the window has the nucleation length h_n, and y is the
eigenfunction of K. Uenishi and J. R. Rice (J. Geophys. Res. 108, 2003)
as weights for the nodes (`grid_weights`). On a plane, the window is an
ellipse. For each of five aspects:

1. Start with a small box of nodes, made periodic with the stiffness
   between its own nodes. A block of a Toeplitz matrix is a block of a
   circulant matrix, so the problem on an ellipse of at most half the
   length of the box stays the same. The cost depends on the ellipse,
   not on the plane.
2. Find by bisection the smallest ellipse in the box whose lowest
   eigenvalue is at most W (`_smallest_unstable`), with LOBPCG
   (`elasticity.operator`).
3. If every ellipse in the box is stable, double the box and repeat
   step 2. If the box is already the whole plane, the window does not
   fit.

For nu = 0 the critical disc has radius 2.0061 G/(2W).

Weights on a line
-----------------
A patch of half-length a is just unstable if the slip rate v solves an
eigenproblem on [-1, 1], with W a/G* = lambda_0 (K. Uenishi and J. R.
Rice, J. Geophys. Res. 108, 2003, equation 14). The weight g of the
local criterion is v with unit integral,

    g(cos t) = sum over odd m of b_m sin(m t),  b_m = 2 a_m/pi,  a_1 = 1.

Weights on a grid must not be negative, so that an average lies between
the least and the greatest strength. The steps are:

1. Find lambda_0 and a_m by Galerkin's method (`eigenvalue_and_vector`).
2. Compute the transform of g by the midpoint rule (`multiplier`).
3. Take samples of g as the weights of nodes inside the patch. Fit the
   weights at the ends of the patch to the transform, by least squares
   among weights that are not negative (`grid_weights`).
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.optimize import nnls

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.elasticity.operator import lowest_eigenvector, make_operator
from stiction.elasticity.protocol import HalfSpaces
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem

N_SINES = 40  # terms of the eigenfunction, whose transform is then within 2e-7 of the limit
N_FITTED_NODES = 16  # at either end of a patch; samples of g are exact further inside
COSINES_AT_ONCE = 1 << 20
FITTED_WAVE = 2.0  # |k| h_n/2 above which the fit counts less, as the fourth power
WEIGHT_OF_SUM = 1e3  # of the equation that the weights sum to one


@lru_cache(maxsize=4)
def eigenvalue_and_vector(terms: int = N_SINES) -> tuple[float, Array]:
    """Return the smallest eigenvalue lambda_0 and its eigenvector a_1, a_2, ... with a_1 = 1.

    A patch of half-length a is critical at a W/G* = lambda_0 (Uenishi
    and Rice, 2003). Here v(cos t) = sum_k a_k sin(k t), with the
    Galerkin matrices A = diag(pi k/4) and B_jk = (I(j-k) - I(j+k))/2,
    I(m) = 2/(1-m^2) for even m, 0 for odd.

    A single sine gives A/B = (pi/4)/(4/3). Of three sines the second is left
    out, and the others solve (A - lambda B) a = 0. The limit is 0.578887.

    >>> print(
    ...     f"{eigenvalue_and_vector(1)[0] * 16.0 / np.pi:.6f} {eigenvalue_and_vector()[0]:.6f}"
    ... )
    3.000000 0.578887
    >>> value, a = eigenvalue_and_vector(3)
    >>> rows = (
    ...     value * (4 / 3 - 4 / 15 * a[2]),
    ...     value * (36 / 35 * a[2] - 4 / 15) / a[2],
    ... )
    >>> np.round(rows, 6).tolist() == np.round(
    ...     [np.pi / 4, 3 * np.pi / 4], 6
    ... ).tolist()
    True
    >>> a[:2].tolist(), a.flags.writeable
    ([1.0, 0.0], False)
    """
    k = np.arange(1, terms + 1)

    def integral(m: Array) -> Array:
        return np.where(m % 2 == 0, 2.0 / np.where(m % 2 == 0, 1.0 - m * m, 1.0), 0.0)

    a = np.diag(np.pi * k / 4.0)
    b = 0.5 * (integral(k[:, None] - k[None, :]) - integral(k[:, None] + k[None, :]))
    # B is well conditioned only for the smallest eigenvalues, so solve
    # for 1/lambda instead.
    inverse, vectors = scipy.linalg.eigh(b, a)
    vector = vectors[:, -1] / vectors[0, -1]
    vector[1::2] = 0.0  # the first eigenfunction is even
    vector.flags.writeable = False
    return float(1.0 / inverse[-1]), vector


def weight(s: Array) -> Array:
    """Return the weight g(s) of the local criterion, zero for |s| > 1.

    The integral over the patch is 1.

    >>> t = np.pi * (np.arange(60) + 0.5) / 60
    >>> print(f"{np.pi * np.mean(weight(np.cos(t)) * np.sin(t)):.9f}")
    1.000000000
    >>> ends = weight(np.array([-1.2, -1.0, -0.3, 0.3, 0.9, 1.5]))
    >>> (
    ...     ends[[0, 1, 5]].round(9).tolist(),
    ...     bool(ends[2] >= ends[3] - 1e-9 > ends[4] > 0.2),
    ... )
    ([0.0, 0.0, 0.0], True)
    """
    inside = np.abs(s) <= 1.0
    t = np.arccos(np.where(inside, s, 0.0))
    sine = eigenvalue_and_vector()[1] * (2.0 / np.pi)
    m = np.arange(1, sine.size + 1)
    value: Array = np.tensordot(sine, np.sin(np.multiply.outer(m, t)), axes=1)
    return np.where(inside, value, 0.0)


def multiplier(z: Array) -> Array:
    """Return the transform of g at z = |k| h_n/2, by which averaging multiplies a cosine.

    The transform is the integral of g(cos t) cos(z cos t) sin t over
    [0, pi]. With more than (z + N_SINES)/2 points, the midpoint rule is
    exact to round-off.

    The sum over many points of the patch agrees. A constant does not change.

    >>> s = (np.arange(4000) + 0.5) / 2000 - 1.0
    >>> waves = multiplier(
    ...     np.linspace(0.0, 300.0, 30001)
    ... )  # more than are computed at once
    >>> for number in (0, 300, 30000):  # z = 0, 3 and 300
    ...     integral = weight(s) @ np.cos(number / 100.0 * s) / 2000
    ...     print(f"{waves[number]:.4f} {abs(waves[number] - integral):.4f}")
    1.0000 0.0000
    0.2799 0.0000
    -0.0002 0.0000
    """
    points = int(0.25 * np.max(z)) + N_SINES  # on [0, pi/2]; the other half is the same
    t = (np.arange(points) + 0.5) * (0.5 * np.pi / points)
    share = weight(np.cos(t)) * np.sin(t) * (np.pi / points)
    parts = np.array_split(z, 1 + np.size(z) * points // COSINES_AT_ONCE)
    return np.concatenate([np.cos(np.outer(part, np.cos(t))) @ share for part in parts])


def grid_weights(half_width: float) -> Array:
    """Return weights w_0, w_1 = w_-1, ... for nodes 0, 1, ... from the centre of a patch.

    `half_width` is h_n/2 in nodes, and w_0 + 2 (w_1 + w_2 + ...) = 1.
    No weight is negative, so an average lies between the least and the
    greatest strength even if the strength jumps. Weights from a product
    with the transform of g would ring.

    Inside a patch, plain samples of g are accurate (the
    trapezoidal rule). At the ends g falls like a square root, and
    other weights are needed (B. Alpert, SIAM J. Sci. Comput. 20,
    1551, 1999). These are fitted to the transform of g by least
    squares among weights that are not negative (C. Lawson and R.
    Hanson, Solving Least Squares Problems, 1974). Long waves have
    the largest weight in the fit, because they carry nearly all
    of tau_n. At |k| h_n/2 = 3 the error of the transform is 1e-4
    with 9 nodes in h_n, 5e-6 with 16 and 1e-9 with 35.

    These nodes have 1 as the sum of their weights. A wave with |k| h_n/2 = 3
    is multiplied as by g. Far from the ends the weights are samples of g.

    >>> w, z = grid_weights(4.6), np.array([3.0])
    >>> print(f"{w[0] + 2.0 * w[1:].sum():.6f} {w.min() >= 0.0} {len(w)}")
    1.000000 True 7
    >>> wave = w[0] + 2.0 * (w[1:] @ np.cos(3.0 / 4.6 * np.arange(1, 7)))
    >>> print(f"{wave:.4f} {multiplier(z)[0]:.4f}")
    0.2799 0.2799
    >>> nodes = np.arange(16)
    >>> np.allclose(
    ...     30.0 * grid_weights(30.0)[nodes], weight(nodes / 30.0), rtol=1e-6
    ... )
    True
    """
    last = int(np.ceil(half_width)) + 1
    inner = max(last + 1 - N_FITTED_NODES, 0)
    half = 4 * last + 64  # wavenumbers to Nyquist's, close enough for the wave across the patch
    wave = np.pi / half * np.arange(half + 1)
    w = np.zeros(last + 1)
    w[:inner] = weight(np.arange(inner) / half_width) / half_width
    z = wave * half_width
    transform = multiplier(z)
    fitted = np.arange(inner, last + 1)
    columns = np.where(fitted == 0, 1.0, 2.0) * np.cos(np.outer(wave, fitted))
    importance = (1.0 + (z / FITTED_WAVE) ** 2) ** -2.0
    importance[0] = WEIGHT_OF_SUM
    missing = transform - np.fft.rfft(around(w, 2 * half)).real
    w[inner:], _ = nnls(columns * importance[:, None], missing * importance)
    return w * (transform[0] / np.fft.rfft(around(w, 2 * half)).real[0])


def around(w: Array, nodes: int) -> Array:
    """Return weights w_0, w_1, ... on both sides of node 0 on a periodic line, as (nodes,).

    On four nodes, node 2 is both the second and the second before node 0.

    >>> around(np.array([5.0, 3.0, 1.0]), 4).tolist()
    [5.0, 3.0, 2.0, 3.0]
    >>> around(np.array([5.0, 3.0, 1.0]), 6).tolist()
    [5.0, 3.0, 1.0, 0.0, 1.0, 3.0]
    """
    both = np.zeros(nodes)
    offsets = np.arange(w.size)
    np.add.at(both, offsets % nodes, w)
    np.add.at(both, -offsets[1:] % nodes, w[1:])
    return both


# Aspects of the ellipses, relative to the middle ellipse. With the
# paper's strength nine shapes from 0.8 to 2 lower the bound by less
# than 0.05 % more.
STRETCHES = (2.0 / 3.0, 5.0 / 6.0, 1.0, 6.0 / 5.0, 3.0 / 2.0)
EIGENVECTOR_RTOL = 1e-9  # residual of an eigenvector, relative to W
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
        """Sum of the weights, 1 to round-off.

        >>> y = np.array([0.5, 0.3, 0.1, 0.0])
        >>> round(Window(1.0, (0.2,), 0.2, 1.0, y, np.fft.rfft(y)).total, 9)
        0.9
        """
        return float(self.spectrum.flat[0].real)


def windows_of(
    problem: Problem, W: float, stretches: Sequence[float] = STRETCHES
) -> list[Window]:
    """Return the critical windows for a weakening rate (Pa/m), or raise an `InputError`.

    A line has a single window. A plane has a window for each multiple
    of the aspect 1/sqrt(1 - nu), because the critical length in mode II
    is 1/(1 - nu) times the critical length in mode III. Every window
    must fit on the interface.

    A plane has a window for each aspect. Half the rate makes the window of a
    line twice as long.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> length, rate = problem.nucleation_length, problem.friction.weakening_rate
    >>> ((window,), (double,)) = (
    ...     windows_of(problem, rate),
    ...     windows_of(problem, 0.5 * rate),
    ... )
    >>> (
    ...     round(window.extents[0] / length, 6),
    ...     round(double.area / length, 6),
    ...     window.aspect,
    ... )
    (1.0, 2.0, 1.0)
    >>> near = int(0.5 * length / problem.interface.spacing)  # nodes on either side
    >>> [bool(window.weight[i] > 1e-3) for i in (0, near, -near, near + 2)]
    [True, True, True, False]
    >>> plane = st.Problem(
    ...     solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.19, density=1000.0),
    ...     interface=st.Interface((0.1, 0.1), (40, 40)),
    ...     friction=st.LinearWeakening(weakening_rate=1e11),
    ... )
    >>> [
    ...     round(y.aspect, 6) for y in windows_of(plane, 1e11, (0.9, 1.8))
    ... ]  # over sqrt(0.81) = 0.9
    [1.0, 2.0]
    """
    interface, solid = problem.interface, problem.solid
    length = problem.nucleation_lengths(W)[0]
    advice = "The local criterion does not hold in this case. Use st.Equilibrium()"
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
    """Return a mask (*shape) of the nodes at which a window lies within the interface's extent.

    The window reaches from its centre to three nodes after it.

    >>> y = np.array([0.5, 0.3, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0])
    >>> window = Window(1.0, (0.4,), 0.4, 1.0, y, np.fft.rfft(y))
    >>> places_of(Interface(0.8, 8, extent=(0.1, 0.5)), window).nonzero()[0].tolist()
    [1, 2]
    >>> places_of(Interface(0.8, 8), window)
    True
    """
    if not interface.is_held:
        return True
    beyond = interface.transform(1.0 * ~interface.breakable)
    under = interface.transform(1.0 * (window.weight > 0.0)).conj()
    return interface.inverse_transform(beyond * under) < 0.5  # a number of nodes, to round-off


def _within_extent(interface: Interface, windows: list[Window]) -> list[Window]:
    """Return the windows that fit within the extent. Raise an error if no window fits.

    Windows over three and five nodes from their centre: the second is too
    wide for four nodes.

    >>> y = [1.0 * (np.arange(8) < count) for count in (3, 5)]
    >>> three, five = (
    ...     Window(1.0, (0.1 * w.sum(),), 0.0, 1.0, w, np.fft.rfft(w)) for w in y
    ... )
    >>> line = Interface(0.8, 8, extent=(0.2, 0.5))
    >>> [fitting.extents for fitting in _within_extent(line, [five, three])] == [
    ...     three.extents
    ... ]
    True
    >>> _within_extent(line, [five])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: interface.extent: is too small for a critical patch (0.5 m)...
    """
    if fitting := [y for y in windows if np.any(places_of(interface, y))]:
        return fitting
    extents = " x ".join(f"{length:.4g}" for length in windows[0].extents)
    raise InputError(
        f"interface.extent: is too small for a critical patch ({extents} m). Widen the extent,"
        " or use st.Equilibrium()"
    )


@lru_cache(maxsize=64)
def _line_weights(half_width: float, nodes: int) -> tuple[Array, Array]:
    """Return the weights around node 0, and their transform.

    `half_width` is h_n/2 in nodes.

    >>> weights, spectrum = _line_weights(2.3, 16)
    >>> same = weights[:4].tolist() == grid_weights(2.3)[:4].tolist()
    >>> same, bool(weights[2] == weights[-2] > 0.0)
    (True, True)
    >>> np.allclose(spectrum, np.fft.rfft(weights)), weights.flags.writeable
    (True, False)
    """
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

    See steps 1 to 3 at the top of the file.

    For nu = 0 the critical disc has the radius 2.0061 G/(2 W). In this
    example this is 0.01 m. Twice the aspect halves the extent along y. A disc
    that would need more than the plane does not fit.

    >>> G, half_spaces = 1e9, HalfSpaces((0.08, 0.08), (1e9, 1e9))
    >>> W = 2.0061 * G / 0.02
    >>> disc = ellipse_window(half_spaces, (64, 64), W, 1.0)
    >>> print(
    ...     f"{disc.extents[0]:.3f} {disc.area / (np.pi * 0.01**2):.1f} {disc.total:.6f}"
    ... )
    0.020 1.0 1.000000
    >>> print(f"{disc.weight[2, 0] / disc.weight[0, -2]:.6f} {disc.weight[9, 0]:g}")
    1.000000 0
    >>> long = ellipse_window(half_spaces, (64, 64), W, 2.0)
    >>> print(f"{long.area / (np.pi * long.extents[0] * long.extents[1] / 4.0):.1f}")
    1.0
    >>> print(
    ...     long.extents[0] / long.extents[1],
    ...     disc.eigenvalue <= W,
    ...     long.eigenvalue <= W,
    ... )
    2.0 True True
    >>> ellipse_window(half_spaces, (64, 64), 0.02 * W, 1.0) is None
    True
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

    The eigenvalues of the matrices for all ellipses show which is the
    smallest with an eigenvalue below W.

    >>> column = np.fft.irfft2(
    ...     HalfSpaces((16.0, 16.0), (1.0, 0.8)).symbol((16, 16)), (16, 16)
    ... )
    >>> x, at = np.fft.fftfreq(16, 1.0 / 16), np.array([*np.ndindex(16, 16)])
    >>> distance = x[:, None] ** 2 + (1.3 * x[None, :]) ** 2
    >>> K, radii = column[tuple((at[:, None] - at).T % 16)], np.unique(distance)
    >>> inside = [distance.ravel() <= r for r in radii]
    >>> lowest = np.array(
    ...     [np.linalg.eigvalsh(K[np.ix_(S, S)])[0] for S in inside[:40]]
    ... )
    >>> W = 0.4
    >>> square = radii[np.argmax(lowest <= W)]
    >>> ellipse = _smallest_unstable(column, distance, W, 0.0, 36.0)
    >>> print(
    ...     f"{ellipse.square / square:.6f} {ellipse.eigenvalue / lowest[lowest <= W][0]:.6f}"
    ... )
    1.000000 1.000000
    >>> _smallest_unstable(column, distance, W, 0.0, 0.99 * square) is None
    True
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
        flat = inside.reshape(-1), vector.reshape(-1)
        value = lowest_eigenvector(operator, *flat, tolerance, MAX_ELLIPSE_ITERATIONS)
        if value <= W:
            high, ellipse = middle, Ellipse(float(radii[middle]), value, vector)
        else:
            low, probe = middle, 2 * probe
    return ellipse

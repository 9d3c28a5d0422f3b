"""Critical windows: where a patch becomes unstable by itself, and the weight of each of its nodes.

On a line the window is the nucleation length with the eigenfunction of Uenishi and Rice (2003) as
its weight. On a plane it is an ellipse: for each of five aspects the smallest on whose nodes the
lowest eigenvalue of K has fallen to W, with the eigenvector as weight. The eigenvector is a
multiplier of the whole interface, so the average of strength less initial stress with this weight,
over that of the load profile, bounds the load at onset from above, as long as no node reaches its
residual strength (strictly for a Z-matrix). For nu = 0 the critical disc has radius
2.0061 G/(2W).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.special import jv

from stiction.arrays import Array
from stiction.elasticity.linear import lowest_eigenvector
from stiction.elasticity.operator import make_operator, stiffness_symbol
from stiction.errors import InputError
from stiction.problem import Problem

Weights = Literal["exact", "rounded"]

TERMS = 40
"""Terms of the eigenfunction."""
EDGE = 16
"""Nodes at either end of a patch whose weights are fitted; samples of g are exact further in."""
SMOOTH = 2.0
"""|k| h_n/2 above which the fit counts less, as the fourth power."""
STRETCHES = (2.0 / 3.0, 5.0 / 6.0, 1.0, 6.0 / 5.0, 3.0 / 2.0)
"""Aspects of the ellipses over that of the middle one. With the paper's strength nine shapes from
0.8 to 2 lower the bound by less than 0.05 % more."""
TOLERANCE = 1e-9
"""Residual of an eigenvector, as a share of W."""
ITERATIONS = 500
SMALLEST_BOX = 32
"""Nodes along each side of the part of a plane that is looked at first."""


class Window(NamedTuple):
    """A critical patch, centred on the first node.

    Attributes
    ----------
    aspect : float
        Semi-axis along x over that along y; 1 on a line.
    extents : tuple of float
        Length in each direction, m.
    area : float
        Its length (m), on a plane the area of its nodes (m²).
    eigenvalue : float
        Lowest eigenvalue of K on it, not above W, Pa/m.
    weight : (*shape) array
        Weight of each node, never negative; of unit sum unless it is the rounded one.
    spectrum : array
        Conjugate of its transform: what the moving average does to each wave.
    """

    aspect: float
    extents: tuple[float, ...]
    area: float
    eigenvalue: float
    weight: Array
    spectrum: NDArray[Any]

    @property
    def total(self) -> float:
        """Sum of the weights."""
        return float(self.spectrum.flat[0].real)


def windows_of(
    problem: Problem, rate: float, weights: Weights = "exact", aspect: float | None = None
) -> list[Window]:
    """Return the critical windows of a weakening rate (Pa/m): one on a line, five on a plane.

    With an aspect, on a plane, the ellipse of this aspect only. `InputError` if a window does not
    fit on the interface.
    """
    if not problem.interface.is_plane:
        return [_line_window(problem, rate, weights)]
    middle = middle_aspect(problem)
    aspects = [middle * stretch for stretch in STRETCHES] if aspect is None else [aspect]
    return [_plane_window(problem, rate, one) for one in aspects]


def _line_window(problem: Problem, rate: float, weights: Weights) -> Window:
    length, interface = problem.nucleation_lengths(rate)[0], problem.interface
    if length > interface.extent:
        raise InputError(
            f"interface.length: the nucleation length {length:.4g} m is longer than the"
            f" interface ({interface.extent:.4g} m); the local criterion does not hold"
            " there, use st.Equilibrium() or st.Rupture()"
        )
    weight, spectrum = _line_weights(0.5 * length / interface.spacing, interface.size, weights)
    return Window(1.0, (length,), length, rate, weight, spectrum)


@lru_cache(maxsize=64)
def _line_weights(half_width: float, nodes: int, weights: Weights) -> tuple[Array, Array]:
    """Return the weights around node 0 and their transform; `half_width` is h_n/2 in nodes."""
    weight = exact_weight() if weights == "exact" else rounded_weight()
    w = grid_weights(weight, half_width)
    around = _around(w, nodes)
    found = around, transform(w, nodes)
    for array in found:
        array.flags.writeable = False
    return found


def _plane_window(problem: Problem, rate: float, aspect: float) -> Window:
    grid, solid = problem.interface, problem.solid
    found = _kept(
        grid.shape, grid.lengths, solid.shear_modulus, solid.poisson_ratio, rate, aspect
    )
    if found is None:
        length = problem.nucleation_lengths(rate)[0]
        size = " x ".join(f"{one:.4g}" for one in grid.lengths)
        raise InputError(
            f"interface.length: a critical patch of aspect {aspect:.3g} does not fit on a plane of"
            f" {size} m (in each direction nearly twice the nucleation length, {length:.4g} m, is"
            " needed); the local criterion does not hold there, use st.Equilibrium()"
        )
    return found


@lru_cache(maxsize=64)
def _kept(
    shape: tuple[int, int],
    lengths: tuple[float, float],
    modulus: float,
    ratio: float,
    rate: float,
    aspect: float,
) -> Window | None:
    symbol = stiffness_symbol(shape, lengths, modulus / (1.0 - ratio), modulus)
    return ellipse_window(symbol, shape, lengths, rate, aspect)


def middle_aspect(problem: Problem) -> float:
    """Return the aspect about which those of critical ellipses lie, 1/sqrt(1 - nu).

    A line of mode II is critical at a length that is 1/(1 - nu) times that of mode III.
    """
    return float(1.0 / np.sqrt(1.0 - problem.solid.poisson_ratio))


def odd_bessel(z: Array, count: int) -> Array:
    """Return J_1, J_3, ..., J_(2 count - 1) at positive z, shape (count, z.size).

    By recurrence, which is far less expensive than each order by itself: upwards where z is above
    the highest order, downwards from order 120 elsewhere (Miller, 1952), and order by order for
    the few z below 1, where the downward recurrence would overflow.
    """
    orders = 2 * count
    result = np.empty((count, z.size))
    small, large = z < 1.0, z >= orders
    result[:, small] = jv(np.arange(1, orders, 2)[:, None], z[small])
    x = z[large]
    before, here = jv(0, x), jv(1, x)
    for m in range(1, orders):
        if m % 2:
            result[m // 2, large] = here
        before, here = here, 2.0 * m / x * here - before
    middle = ~small & ~large
    x = z[middle]
    after, here, norm = np.zeros_like(x), np.full_like(x, 1e-290), np.zeros_like(x)
    for m in range(120 + 2 * max(0, orders - 80), 0, -1):
        if m % 2 and m < orders:
            result[m // 2, middle] = here
        elif m % 2 == 0:
            norm += 2.0 * here
        after, here = here, 2.0 * m / x * here - after
    result[:, middle] /= norm + here  # J_0 + 2 J_2 + 2 J_4 + ... = 1
    return result


@dataclass(frozen=True, eq=False)
class Weight:
    """An even weight g on [-1, 1]: g(cos t) = sum over odd m of b_m sin(m t).

    Attributes
    ----------
    sine : (M,) array
        b_1, b_2, b_3, ... (even ones zero).
    """

    sine: Array

    def at(self, s: Array) -> Array:
        """Return g(s), zero for |s| > 1."""
        inside = np.abs(s) <= 1.0
        t = np.arccos(np.where(inside, s, 0.0))
        m = np.arange(1, self.sine.size + 1)
        value: Array = np.tensordot(self.sine, np.sin(np.multiply.outer(m, t)), axes=1)
        return np.where(inside, value, 0.0)

    def multiplier(self, z: Array) -> Array:
        """Return the transform of g at z = |k| h_n/2: what a moving average does to a cosine.

        The integral of sin(m t) cos(z cos t) sin t over [0, pi] is
        pi m (-1)^((m-1)/2) J_m(z)/z for odd m.
        """
        z = np.asarray(z, dtype=np.float64)
        m = np.arange(1, self.sine.size + 1, 2)
        factor = np.pi * self.sine[m - 1] * m * (-1.0) ** ((m - 1) // 2)
        safe = np.where(z == 0.0, 1.0, z).ravel()
        value = (factor @ odd_bessel(safe, m.size)).reshape(z.shape) / safe.reshape(z.shape)
        return np.where(z == 0.0, 0.5 * np.pi * self.sine[0], value)


@lru_cache(maxsize=4)
def eigenvalues_and_vector(terms: int = TERMS) -> tuple[float, Array]:
    """Return the smallest eigenvalue lambda_0 and its eigenvector a_1, a_2, ... with a_1 = 1.

    Uenishi and Rice (2003): a patch of half-length a is critical at a W/G* = lambda_0, with
    v(cos t) = sum_k a_k sin(k t) and the Galerkin matrices A = diag(pi k/4) and
    B_jk = (I(j-k) - I(j+k))/2, I(m) = 2/(1-m^2) for even m, 0 for odd.
    """
    k = np.arange(1, terms + 1)

    def integral(m: Array) -> Array:
        return np.where(m % 2 == 0, 2.0 / np.where(m % 2 == 0, 1.0 - m * m, 1.0), 0.0)

    a = np.diag(np.pi * k / 4.0)
    b = 0.5 * (integral(k[:, None] - k[None, :]) - integral(k[:, None] + k[None, :]))
    # B is well conditioned only on the low end that matters; solve for 1/lambda instead.
    inverse, vectors = scipy.linalg.eigh(b, a)
    vector = vectors[:, -1] / vectors[0, -1]
    vector[1::2] = 0.0  # the first eigenfunction is even
    vector.flags.writeable = False
    return float(1.0 / inverse[-1]), vector


def _frozen(sine: Array) -> Weight:
    sine.flags.writeable = False
    return Weight(sine)


@lru_cache(maxsize=1)
def exact_weight() -> Weight:
    """Return g_0 = v_0 / integral of v_0, the exact eigenfunction (Uenishi and Rice, 2003).

    With 40 terms its multiplier is within 2e-7 of the limit of many terms.
    """
    _, vector = eigenvalues_and_vector()
    # The integral of sin(k t) sin t over [0, pi] is pi/2 for k = 1, else 0.
    return _frozen(vector * (2.0 / np.pi))


@lru_cache(maxsize=1)
def rounded_weight() -> Weight:
    """Return the printed approximation 0.751 (0.925 - 0.308 s^2) sqrt(1-s^2).

    Its integral is 1.00036; Uenishi and Rice (2003, Eq. 11), Albertini et al. (2020, Eq. 9).
    """
    sine = np.zeros(3)
    sine[0] = 0.751 * (0.925 - 0.308 / 4.0)
    sine[2] = -0.751 * 0.308 / 4.0
    return _frozen(sine)


def grid_weights(weight: Weight, half_width: float) -> Array:
    """Return weights w_0, w_1 = w_-1, ... of the nodes 0, 1, ... from the centre of a patch.

    `half_width` is h_n/2 in nodes; w_0 + 2 (w_1 + w_2 + ...) is the integral of `weight`. With
    weights that are not negative and add up to one, an average lies between the least and the
    greatest strength, whatever jumps the strength has. A product in Fourier space with the
    transform of g is exact for smooth strength, but its weights ring: beside a strong barrier the
    average falls below the lowest strength.

    Inside a patch plain samples of g are as accurate as can be (the trapezoidal rule), only its
    ends, where g falls like a root, need other weights (as in Alpert, 1999, SIAM J. Sci. Comput.
    20, 1551). These are fitted to the transform of g at all wavenumbers of the grid, by least
    squares among weights that are not negative (Lawson and Hanson, 1974). The fit is weighted
    towards long waves, which carry nearly all of tau_n. Error of the transform at |k| h_n/2 = 3:
    1e-4, 5e-6, 1e-9 with 9, 16, 35 nodes in h_n.
    """
    last = int(np.ceil(half_width)) + 1
    inner = max(last + 1 - EDGE, 0)
    half = 4 * last + 64  # wavenumbers to Nyquist's, close enough for the wave across the patch
    wave = np.pi / half * np.arange(half + 1)
    w = np.zeros(last + 1)
    w[:inner] = weight.at(np.arange(inner) / half_width) / half_width
    z = wave * half_width
    missing = weight.multiplier(z) - transform(w, 2 * half)
    fitted = np.arange(inner, last + 1)
    columns = np.where(fitted == 0, 1.0, 2.0) * np.cos(np.outer(wave, fitted))
    importance = (1.0 + (z / SMOOTH) ** 2) ** -2.0
    importance[0] = 1e3  # the sum
    w[inner:], _ = nnls(columns * importance[:, None], missing * importance)
    result: Array = w * (weight.multiplier(np.zeros(1))[0] / transform(w, 2 * half)[0])
    return result


def _around(w: Array, nodes: int) -> Array:
    """Return the weights w_0, w_1, ... on both sides of node 0 of a periodic line."""
    around = np.zeros(nodes)
    offsets = np.arange(w.size)
    np.add.at(around, offsets % nodes, w)
    np.add.at(around, -offsets[1:] % nodes, w[1:])
    return around


def transform(w: Array, nodes: int) -> Array:
    """Return what the weights do to each wave of a periodic line of `nodes`, (nodes//2 + 1,)."""
    result: Array = np.fft.rfft(_around(w, nodes)).real
    return result


def squared_radius(
    shape: tuple[int, int], spacings: tuple[float, float], aspect: float
) -> Array:
    """Return x^2 + (aspect y)^2 of every node from the nearest image of node (0, 0), m^2."""
    x, y = (np.fft.fftfreq(n) * n * spacing for n, spacing in zip(shape, spacings, strict=True))
    result: Array = (x[:, None]) ** 2 + (aspect * y[None, :]) ** 2
    return result


def _boxes(shape: tuple[int, int]) -> Iterator[tuple[int, int]]:
    """Yield ever larger boxes of nodes, the last of them the whole plane."""
    side = SMALLEST_BOX
    while side < max(shape):
        yield min(side, shape[0]), min(side, shape[1])
        side *= 2
    yield shape


def _nodes_of(
    box: tuple[int, int], shape: tuple[int, int]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the nodes of a box around node (0, 0), in the order of transforms."""
    along, across = (
        np.rint(np.fft.fftfreq(n) * n).astype(np.int64) % whole
        for n, whole in zip(box, shape, strict=True)
    )
    return np.ix_(along, across)


def ellipse_window(
    symbol: Array,
    shape: tuple[int, int],
    lengths: tuple[float, float],
    rate: float,
    aspect: float,
) -> Window | None:
    """Return the smallest unstable ellipse of one aspect; None if it meets its images.

    K(k) and W are in Pa/m, the periods in m; the aspect is that of the semi-axes along x and y.

    What happens on the nodes of an ellipse is the same on a box of the plane that is twice as
    long, made periodic with the stiffness between its own nodes: a block of a Toeplitz matrix is
    one of a circulant. So the cost follows the ellipse and not the plane.
    """
    spacings = lengths[0] / shape[0], lengths[1] / shape[1]
    column = np.fft.irfft2(symbol, shape)
    least = 0.0
    for box in _boxes(shape):
        longest = [
            n * spacing * (0.5 if n == whole else 0.25) * stretch
            for n, whole, spacing, stretch in zip(
                box, shape, spacings, (1.0, aspect), strict=True
            )
        ]
        nodes = _nodes_of(box, shape)
        found = _smallest_unstable(column[nodes], spacings, rate, aspect, least, min(longest))
        if found is not None:
            weight = np.zeros(shape)
            weight[nodes] = np.maximum(found.vector, 0.0)
            weight /= weight.sum()
            area = found.nodes * spacings[0] * spacings[1]
            extents = 2.0 * found.axis, 2.0 * found.axis / aspect
            spectrum = np.conj(np.fft.rfft2(weight))
            return Window(aspect, extents, area, found.eigenvalue, weight, spectrum)
        least = min(longest) ** 2
    return None


class _Unstable(NamedTuple):
    """Eigenvector on a box, semi-axis along x (m), nodes, lowest eigenvalue (Pa/m)."""

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
    """Find the smallest unstable ellipse in a box by bisection of its semi-axis up to `axis`.

    The column is the stress (Pa) at each node of the box by unit slip at node (0, 0); `least` is
    the square of a semi-axis that is known to be stable, m².
    """
    shape = column.shape
    symbol = np.fft.rfft2(column).real
    operator = make_operator(symbol, rate, shape)._replace(
        rate=np.zeros(column.size),
        inverse=1.0 / (np.maximum(symbol.flatten(), 0.0) + 0.5 * rate),
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
    probe = max(1, (high - low) // 16)  # small ones first: they take the fewest iterations
    while high - low > 1:
        middle = min(low + probe, high - 1) if probe else (low + high) // 2
        inside = distance <= radii[middle]
        vector = guess.copy()
        if not (vector[inside] != 0.0).any():
            vector[:] = 1.0
        value, _ = lowest_eigenvector(
            operator, inside.reshape(-1), vector.reshape(-1), TOLERANCE * rate, ITERATIONS
        )
        if value <= rate:
            high, found, guess, probe = middle, (inside, value, vector), vector, 0
        else:
            low, guess = middle, vector
            probe *= 2
    if found is None:
        return None
    inside, value, vector = found
    return _Unstable(vector, float(np.sqrt(radii[high])), int(inside.sum()), value)

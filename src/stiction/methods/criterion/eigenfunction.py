"""The critical slip-rate profile on a line, as weights for the nodes.

Problem
-------
A patch of half-length a is just unstable if the slip rate v solves an eigenproblem
on [-1, 1], with W a/G* = lambda_0 (K. Uenishi and J. R. Rice, J. Geophys. Res. 108,
2003, equation 14). The weight g of the local criterion is v with unit integral,

    g(cos t) = sum over odd m of b_m sin(m t),  b_m = 2 a_m/pi,  a_1 = 1.

Weights on a grid must not be negative, so that an average lies between
the least and the greatest strength.

Algorithm
---------
1. Galerkin's method gives lambda_0 and a_m (`eigenvalue_and_vector`).
2. The midpoint rule gives the transform of g (`multiplier`).
3. The weights of nodes inside the patch are samples of g. The weights at the ends
   of the patch are fitted to the transform, by least squares among
   weights that are not negative (`grid_weights`).
"""

from functools import lru_cache

import numpy as np
import scipy.linalg
from scipy.optimize import nnls

from stiction.base.arrays import Array

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
    """Return the weight g(s) of the local criterion, zero for |s| > 1."""
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
    result: Array = w * (transform[0] / np.fft.rfft(around(w, 2 * half)).real[0])
    return result


def around(w: Array, nodes: int) -> Array:
    """Return weights w_0, w_1, ... on both sides of node 0 on a periodic line, as (nodes,)."""
    both = np.zeros(nodes)
    offsets = np.arange(w.size)
    np.add.at(both, offsets % nodes, w)
    np.add.at(both, -offsets[1:] % nodes, w[1:])
    return both

"""The Uenishi-Rice eigenproblem: the slip-rate profile of a patch that is about to run away."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.linalg
from scipy.special import jv

from stiction.arrays import Array

TERMS = 40


def odd_bessel(z: Array, count: int) -> Array:
    """J_1, J_3, ..., J_(2 count - 1) at positive z, shape (count, z.size).

    By recurrence, since one transform of every order is far dearer than all together: upwards
    where z is above the highest order, downwards from order 120 elsewhere (Miller, 1952), and
    order by order for the few z below 1, where the downward recurrence would overflow.
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
        """g(s) for |s| <= 1, zero outside."""
        inside = np.abs(s) <= 1.0
        t = np.arccos(np.where(inside, s, 0.0))
        m = np.arange(1, self.sine.size + 1)
        value: Array = np.tensordot(self.sine, np.sin(np.multiply.outer(m, t)), axes=1)
        return np.where(inside, value, 0.0)

    def multiplier(self, z: Array) -> Array:
        """Fourier transform of g at z = |k| h_n/2: what a moving average does to a cosine.

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
    """Smallest eigenvalue lambda_0 and its eigenvector a_1, a_2, ... with a_1 = 1.

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
    """g_0 = v_0 / integral of v_0, from the exact eigenfunction (Uenishi and Rice, 2003).

    With 40 terms its multiplier is within 2e-7 of the limit of many terms.
    """
    _, vector = eigenvalues_and_vector()
    # The integral of sin(k t) sin t over [0, pi] is pi/2 for k = 1, else 0.
    return _frozen(vector * (2.0 / np.pi))


@lru_cache(maxsize=1)
def rounded_weight() -> Weight:
    """The printed approximation 0.751 (0.925 - 0.308 s^2) sqrt(1-s^2), whose integral is 1.00036.

    Uenishi and Rice (2003, Eq. 11), used by Albertini et al. (2020, Eq. 9).
    """
    sine = np.zeros(3)
    sine[0] = 0.751 * (0.925 - 0.308 / 4.0)
    sine[2] = -0.751 * 0.308 / 4.0
    return _frozen(sine)

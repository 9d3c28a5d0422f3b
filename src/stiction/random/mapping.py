"""Mapping z -> F^-1(Phi(z)) from a Gaussian field to a marginal, and correlation of the result.

Problem
-------
A translation field (M. Grigoriu, Applied Non-Gaussian Processes, 1995)
is v(x) = g(z(x)) with

    g(z) = F^-1(Phi(z)),                                                                      (1)

and is needed for millions of z. The quantile F^-1 of scipy is a
thousand times too slow. If z at a lag has the correlation rho, v at
this lag has the correlation

    sum_m c_m^2 rho^m / sum_m c_m^2, m >= 1,   c_m = E[g(Z) h_m(Z)],                          (2)

with the orthonormal Hermite polynomials h_m of a standard normal Z.

Algorithm of the mapping (`from_normal`): our own
-------------------------------------------------
1. Reduce the marginal to scale 1, so that all multiples use the same table
   (`_standard`).
2. Tabulate (1) as cubic Hermite pieces on a uniform grid of [-8, 8],
   with slopes by central differences of fourth order. Check every piece
   at three points, and mark pieces that miss `TABLE_RTOL`, for example
   at a kink of the density (`quantile_table`).
3. Interpolate (`interpolate`). scipy computes the values outside the
   table and on marked pieces.

The relative error is at most 1e-9, or the absolute error 1e-15 standard
deviations.

Algorithm of the correlation (`hermite_coefficients`)
-----------------------------------------------------
4. Compute c_m of (2) with the trapezoidal rule on [-8, 8], and the
   polynomials with their recursion.
5. Stop after at least `MIN_TERMS` terms, when the remaining fraction of
   the variance is small.
6. Append a coefficient for the remaining variance, so that the
   correlation is 1 at zero lag.

Example
-------
z = 0 is the median. A uniform marginal on [0, 1] maps z = 1 to Phi(1):

>>> import scipy.stats
>>> quantile_of_normal(scipy.stats.uniform(), np.array([0.0, 1.0])).round(4).tolist()
[0.5, 0.8413]
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtr

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.jit import jit
from stiction.random.marginals import frozen

TABLE_END = 8.0
"""Largest |z| of a table."""
PIECES_PER_UNIT = 256
"""Number of pieces per unit of z."""
TABLE_RTOL = 2e-10  # at three points of a piece, so that 1e-9 holds everywhere
MIN_TERMS, MAX_TERMS, HERMITE_STEP = 40, 1000, 0.0025
MAX_REST = 1e-6  # fraction of the variance that the last coefficient may represent


def quantile_of_normal(distribution: Any, z: Array) -> Array:
    """Compute F^-1(Phi(z)) for a frozen scipy.stats distribution (Grigoriu, 1995).

    Phi(z) loses its digits as it approaches 1, and rounds to 1 near z =
    8.3. The upper tail therefore uses Phi(-z), which keeps its digits
    if scipy inverts the survival function of the family directly.

    The exponential distribution has F^-1(p) = -log(1 - p). Both tails keep
    their digits.

    >>> import scipy.stats
    >>> z = np.array([-9.0, -1.5, 1.5, 9.0])
    >>> value = quantile_of_normal(scipy.stats.expon(), z)
    >>> expected = [*-np.log1p(-ndtr(z[:2])), *-np.log(ndtr(-z[2:]))]
    >>> np.allclose(value, expected, rtol=1e-12, atol=0.0)
    True

    A quantile without a value is the upper end, beyond z = 8:

    >>> from types import SimpleNamespace as Named
    >>> law = Named(ppf=lambda p: p, isf=lambda p: p + np.nan, support=lambda: (2.0, 7.0))
    >>> quantile_of_normal(law, np.array([0.0, 8.0, 8.5])).tolist()
    [nan, nan, 7.0]
    """
    tail, lower, value = ndtr(-np.abs(z)), z < 0.0, np.empty_like(z)
    value[lower], value[~lower] = distribution.ppf(tail[lower]), distribution.isf(tail[~lower])
    # scipy's beta.isf may be NaN if the value
    # equals its upper end to round-off.
    return np.where(np.isnan(value) & (z > TABLE_END), distribution.support()[1], value)


@jit
def interpolate(z: Array, table: Array, out: Array) -> int:
    """Step 3: write the tabulated mapping of `z` to `out` (flat arrays).

    Return the number of NaN.

    Values are NaN outside the table and on marked pieces.

    A table of x^3 with one node for each 1/256 is exact. Its slopes are 3
    x^2, and the last piece is marked.

    >>> table = np.array([[0.0, 0.0], [1.0, 3.0], [8.0, 12.0], [27.0, np.nan]])
    >>> table.flags.writeable = False
    >>> z, out = np.array([0.5, 1.25, 0.0, 2.0, -0.25, 3.0, 1.75]) / 256.0 - 8.0, np.empty(7)
    >>> interpolate(z, table, out), out.tolist()
    (3, [0.125, 1.953125, 0.0, nan, nan, nan, 5.359375])
    """
    pieces = table.shape[0] - 1
    missing = 0
    for i in range(z.size):
        position = (z[i] + TABLE_END) * PIECES_PER_UNIT
        inside = 0.0 <= position < pieces
        piece = int(position) if inside else 0
        t = position - piece if inside else np.nan
        left, right = table[piece, 0], table[piece + 1, 0]
        slope_left, slope_right = table[piece, 1], table[piece + 1, 1]
        rise = right - left
        quadratic = 3.0 * rise - 2.0 * slope_left - slope_right
        cubic = slope_left + slope_right - 2.0 * rise
        value = left + t * (slope_left + t * (quadratic + t * cubic))
        out[i] = value
        if np.isnan(value):
            missing += 1
    return missing


@lru_cache(maxsize=8192)
def quantile_table(marginal: Any) -> Array:
    """Step 2: return an array (nodes, 2) with values of the mapping, and slopes times the step.

    The slopes of a marked piece are NaN. A table takes 64 KiB, so that
    the cache can hold the tables of many equally likely interfaces.

    The uniform distribution on [0, 1] has the slope phi(z) at z. The nodes
    2048 and 2304 are z = 0 and 1.

    >>> import scipy.stats
    >>> table = quantile_table(Standard(scipy.stats.uniform, (0.0, 1.0)))
    >>> table.shape, table.flags.writeable
    ((4097, 2), False)
    >>> np.round(table[[2048, 2304]] * [1.0, 256.0], 9).tolist()
    [[0.5, 0.39894228], [0.841344746, 0.241970725]]

    The triangular distribution has a kink at its median, z = 0. The slopes
    at the nodes 2047 to 2049 are wrong, and four pieces have these ends:

    >>> triangular = quantile_table(Standard(scipy.stats.triang, (0.5,)))
    >>> np.flatnonzero(np.isnan(triangular[:3000, 1])).tolist()
    [2046, 2047, 2048, 2049]
    """
    distribution = marginal.distribution
    step, pieces = 1.0 / PIECES_PER_UNIT, round(2.0 * TABLE_END * PIECES_PER_UNIT)
    # Two nodes beyond each end, for central differences of fourth order.
    z = -TABLE_END + step * np.arange(-2, pieces + 3)
    value = quantile_of_normal(distribution, z)
    slope = (8.0 * (value[3:-1] - value[1:-3]) - (value[4:] - value[:-4])) / 12.0
    table = np.ascontiguousarray(np.stack([value[2:-2], slope], axis=1))
    checks = z[2:-3, None] + step * np.array([0.25, 0.5, 0.75])
    exact = quantile_of_normal(distribution, checks)
    interpolated = np.empty(checks.size)
    # Read-only arrays have another type for numba: check with the type
    # of later calls.
    table.flags.writeable = False
    interpolate(checks.ravel(), table, interpolated)
    # Errors are relative to the value, but not at its zero crossing.
    scale = np.maximum(np.abs(exact), 1e-6 * distribution.std())
    error = np.abs(interpolated.reshape(checks.shape) - exact)
    wrong = ~(error <= TABLE_RTOL * scale).all(axis=1)
    # A NaN slope marks the piece, and the
    # piece before it, which has the same node.
    result = table.copy()
    result[:-1][wrong, 1] = np.nan
    result.flags.writeable = False
    return result


def from_normal(marginal: Any, z: Array) -> Array:
    """Compute F^-1(Phi(z)) for an array, with a relative error below 1e-9 (Grigoriu, 1995).

    >>> from stiction.random.marginals import Beta, Lognormal, ScipyMarginal
    >>> z = np.array([[-9.0, -1.0, 0.0], [0.3, 1.0, 7.99]])
    >>> value = from_normal(Beta(alpha=1.0, beta=1.0, low=0.0, high=2.0), z)
    >>> value.shape, np.allclose(value, 2.0 * ndtr(z), rtol=1e-9, atol=0.0)
    ((2, 3), True)
    >>> from_normal(Beta(alpha=1.0, beta=1.0, low=3.0, high=5.0), z).round(6).tolist()
    [[3.0, 3.317311, 4.0], [4.235823, 4.682689, 5.0]]
    >>> from_normal(Lognormal(mean=2.5, cv=0.75), 0.0).tolist()  # 2.5 / (1 + cv^2)^0.5
    2.0

    Also at a kink, which the triangular distribution has at its median, the
    relative error is below 1e-9:

    >>> marginal, z = ScipyMarginal("triang", (("c", 0.5),)), np.linspace(-0.02, 0.02, 401)
    >>> exact = quantile_of_normal(marginal.distribution, z)
    >>> bool(np.all(np.abs(from_normal(marginal, z) / exact - 1.0) < 1e-9))
    True
    """
    if hasattr(marginal, "of_normal"):
        return np.asarray(marginal.of_normal(np.asarray(z, np.float64)))
    flat = np.ascontiguousarray(z, dtype=np.float64).ravel()
    # 1. The family at scale 1.
    standard, low, scale = _standard(marginal)
    out = np.empty_like(flat)
    # 2. and 3. The table, and scipy.
    if interpolate(flat, quantile_table(standard), out):
        missing = np.isnan(out)
        out[missing] = quantile_of_normal(standard.distribution, flat[missing])
    if standard is not marginal:
        out *= scale
        out += low
    return out.reshape(np.shape(z))


class Standard(NamedTuple):
    """Distribution of scipy from 0 at scale 1, whose table serves all multiples."""

    family: Any
    shapes: tuple[float, ...]

    @property
    def distribution(self) -> Any:
        """Frozen distribution of scipy.

        >>> import scipy.stats
        >>> Standard(scipy.stats.beta, (1.0, 3.0)).distribution.mean().item()
        0.25
        """
        return frozen(self.family, *self.shapes)


def _standard(marginal: Any) -> tuple[Any, float, float]:
    """Step 1: return the marginal at scale 1, and the lower bound and scale of the given marginal.

    Shapes are rounded to 12 digits, because the shapes of multiples
    differ by round-off. A marginal with a lower bound below zero has
    its own table, because subtraction would magnify the relative error.

    >>> from stiction.random.marginals import Beta, Weibull
    >>> standard, low, scale = _standard(Beta(alpha=1.5, beta=2.5, low=3.0, high=7.0))
    >>> standard.family.name, standard.shapes, low, scale
    ('beta', (1.5, 2.5), 3.0, 4.0)
    >>> below = Beta(alpha=1.5, beta=2.5, low=-3.0, high=7.0)
    >>> _standard(below) == (below, 0.0, 1.0)
    True
    >>> shapes = {
    ...     _standard(Weibull(mean=mean, cv=0.3))[0].shapes
    ...     for mean in np.linspace(1.0, 2.0, 40)
    ... }
    >>> len(shapes)
    1
    """
    family = marginal._scipy_family
    if family is None or marginal.low < 0.0:
        return marginal, 0.0, 1.0
    *shapes, low, scale = marginal.distribution.args
    return Standard(family, tuple(float(f"{shape:.12g}") for shape in shapes)), low, scale


@lru_cache(maxsize=64)
def hermite_coefficients(
    marginal: Any, step: float = HERMITE_STEP, most_terms: int = MAX_TERMS
) -> Array:
    """Return c_m = E[F^-1(Phi(Z)) h_m(Z)] for the orthonormal Hermite polynomials h_0, h_1, ...

    c_0 is the mean, and the sum of the squares of all other
    coefficients is the variance (Grigoriu, 1995). The steps are fine
    enough for kinks in the mapping. The last coefficient accounts for
    the remaining variance. Raises an `InputError` if the quantile and
    the moments of scipy disagree.

    The lognormal distribution has c_m = mean s^m / (m!)^0.5, with s^2 =
    log(1 + cv^2). The last coefficient holds the remaining variance, also
    after a few terms.

    >>> from stiction.random.marginals import Beta, Lognormal
    >>> marginal, s = Lognormal(mean=2.0, cv=0.75), np.log(1.5625) ** 0.5
    >>> expected = 2.0 * s ** np.arange(5) / np.array([1.0, 1.0, 2.0, 6.0, 24.0]) ** 0.5
    >>> coefficients = hermite_coefficients(marginal)
    >>> np.allclose(coefficients[:5], expected), coefficients.size, coefficients.flags.writeable
    (True, 41, False)
    >>> few = hermite_coefficients(marginal, most_terms=4)
    >>> np.allclose(few[:4], expected[:4]), few.size
    (True, 5)
    >>> np.isclose(few[-1] ** 2, 1.5**2 - np.sum(expected[1:4] ** 2)).item()
    True
    >>> uniform = hermite_coefficients(Beta(alpha=1.0, beta=1.0, low=0.0, high=1.0))
    >>> np.allclose([uniform[0], uniform[1], uniform[2]], [0.5, 0.5 / np.pi**0.5, 0.0])
    True
    """
    distribution, half = marginal.distribution, round(TABLE_END / step)
    z = np.arange(-half, half + 1) * step
    # Subtract the mean, as a narrow marginal would lose digits otherwise.
    mean, variance = float(distribution.mean()), float(distribution.var())
    if not variance > 0.0:
        raise InputError("marginal: its standard deviation is zero in double precision")
    # 4. Both factors hold the square root of the weight, so that
    # neither overflows.
    root = np.sqrt(step / np.sqrt(2.0 * np.pi)) * np.exp(-0.25 * z * z)
    value = (quantile_of_normal(distribution, z) - mean) * root
    coefficients, rest = [mean], variance
    previous, current = np.zeros_like(z), root
    for m in range(most_terms):
        if m > 0:
            coefficients.append(float(np.sum(value * current)))
            rest -= coefficients[-1] ** 2
        # 5.
        if m >= MIN_TERMS - 1 and not rest > MAX_REST * variance:
            break
        following = (z * current - np.sqrt(m) * previous) / np.sqrt(m + 1.0)
        previous, current = current, following
    # A negative rest above round-off and the error of the rule shows
    # inconsistent moments.
    if not rest > -max(MAX_REST, step**2) * variance:
        raise InputError("marginal: its quantiles by scipy are inaccurate. Use another")
    # 6.
    with_rest = np.array([*coefficients, np.sqrt(max(rest, 0.0))])
    with_rest.flags.writeable = False
    return with_rest


def correlation_of_mapped(rho: Array, coefficients: Array) -> Array:
    """Compute sum_m c_m^2 rho^m / sum_m c_m^2, m >= 1, for correlations rho of z.

    The mean does not matter. Here 4 rho + 1 rho^2 is divided by 5.

    >>> correlation_of_mapped(np.array([0.5, 1.0, -1.0]), np.array([9.0, 2.0, -1.0])).tolist()
    [0.45, 1.0, -0.6]
    """
    power = coefficients[1:] ** 2
    result: Array = np.polynomial.polynomial.polyval(rho, np.concatenate(([0.0], power)))
    return result / power.sum()

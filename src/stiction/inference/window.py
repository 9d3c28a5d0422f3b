"""Exact effect of a finite window on a spectrum: taper, gaps and removal of a trend.

Problem. A record is not a period of the interface. Find the expectation
of the periodogram after a taper h (zero at gaps) and removal of a trend
by the projection P. The expectation is linear in the correlation C:

    E |sum_m u_k(m) y(m)|^2 = sum_l C(l) a_k(l),    u_k = P (h exp(-i k x)),

with the autocorrelation a_k of u_k. The equation contains leakage,
gaps, aliasing and the loss of low wavenumbers to the trend.

Sources. Sykulski, Olhede, Guillaumin, Lilly and Early (2019),
Biometrika 106, 251, treat a line without a trend. Guillaumin, Sykulski,
Olhede and Simons (2022), Journal of the Royal Statistical Society B 84,
1526, treat planes with gaps.

Steps:

1. Fit orthonormal polynomials to the measured points: P is the identity
   minus the projection on these polynomials.
2. For most wavenumbers the trend has no effect because of the taper,
   and a_k is the autocorrelation of h. One transform gives the
   expectation at all these wavenumbers.
3. For the lowest wavenumbers (`EXACT`), compute a_k with the trend.
4. The correlation comes from a transform of the spectrum on a period of
   `ROOM` records. Add the density at all wavenumbers that alias to the
   same wavenumber. The nearest aliases are exact. Farther aliases are
   evaluated at few wavenumbers, because their sum is smooth.

Departures. The trend in step 3 is our own, as is the treatment of
aliases in step 4.
"""

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.signal.windows import tukey

from stiction.base.arrays import Array

TAPERED = 0.5
"""Fraction of a record over which the cosine taper rises and falls."""
EXACT = {1: 16, 2: 2}
"""Wavenumbers, as numbers of modes, up to which the expectation
contains the trend."""
ROOM = {1: 4, 2: 2}
"""Period of the grid on which a correlation is computed, in lengths of
the record."""
EDGE = 2.0
"""Width over which a spectrum fades out at its end, in steps of the
coarsest wavenumbers at which it is evaluated. The likelihood would move
in steps with the correlation length if the end were sharper."""
LEFT_OUT = 1e-4
"""Fraction of the variance above the end of a spectrum without truncation."""
FOLDS = 6
"""Multiples of the sampling wavenumber whose aliases are added one by one."""
NEAR, FEW = 1, {1: 65, 2: 33}
"""Multiples that need all wavenumbers, and number of wavenumbers per
direction for the others."""


Density = Callable[[Array], Array]


class RecordWindow:
    """Geometry of records: points `spacings` (m) apart, taper, gaps and degree of the trend.

    Lags in each direction are 0, 1, ..., n - 1, -n, ..., -1. A real
    transform has shape (*half).

    Five points, with a gap at point 1. The cosine taper rises over a quarter
    of the record, from 0 at 0 to 1 at 5/4. Point 0 lies at 1/2:

    >>> window = RecordWindow((0.5,), np.array([1, 0, 1, 1, 1], dtype=bool))
    >>> (window.taper / window.taper[2]).round(4).tolist()  # (1 - cos(0.4 pi))/2
    [0.3455, 0.0, 1.0, 1.0, 0.3455]
    >>> float(np.sum(window.taper**2).round(9))
    1.0

    Pairs at lags 0 to 4, and then -5 to -1:

    >>> np.abs(window.pairs).round(9).tolist()
    [4.0, 2.0, 2.0, 1.0, 1.0, 0.0, 1.0, 1.0, 2.0, 2.0]

    The weights of wavenumbers 0, 1, 2 (of five points) and 0, 1, 2, 3 (of six):

    >>> window.weights.tolist(), RecordWindow((0.5,), np.ones(6, dtype=bool)).weights.tolist()
    ([0.0, 1.0, 1.0], [0.0, 1.0, 1.0, 0.5])

    The expected periodogram of white noise with variance 1 is 1, but the mean
    of 64 points takes a part of low wavenumbers:

    >>> window = RecordWindow((0.5,), np.ones(64, dtype=bool))
    >>> lost = 1.0 - window.white
    >>> round(float(lost[0] * 64 / window.taper.sum() ** 2), 9), abs(float(lost[20].round(9)))
    (1.0, 0.0)
    """

    def __init__(
        self, spacings: tuple[float, ...], measured: NDArray[np.bool_], degree: int = 0
    ) -> None:
        self.measured, self.spacings, self.shape = measured, spacings, measured.shape
        room, exact = ROOM[measured.ndim], EXACT[measured.ndim]
        self._period = tuple(fft.next_fast_len(room * n, real=True) for n in self.shape)
        self._lags = np.ix_(
            *[np.r_[:n, m - n : m] for n, m in zip(self.shape, self._period, strict=True)]
        )
        # 4. wavenumbers of the period over the sampling wavenumber
        self._of_period = [fft.fftfreq(n) for n in self._period[:-1]]
        self._of_period.append(fft.rfftfreq(self._period[-1]))
        # 1. orthonormal polynomials of the trend, (points, terms)
        self.basis = _polynomials(measured, degree)
        ones = np.ones(int(measured.sum()))
        self.pairs = self.products(ones)  # number of pairs of measured points by lag
        self._of_trend: Any = sum(self.products(term) for term in self.basis.T[1:])
        # 2.
        tapers = np.ix_(*[tukey(2 * n + 1, TAPERED)[1::2] for n in self.shape])  # nowhere zero
        self.taper = np.prod(np.broadcast_arrays(measured, *tapers), axis=0)
        self.taper /= np.sqrt(np.sum(self.taper**2))
        self._spread = self.products(self.taper[measured])
        # 3.
        most = [min(exact, (n - 1) // 2) for n in self.shape]
        numbers = [np.arange(-m, m + 1) for m in most]
        numbers[-1] = np.arange(min(exact, self.shape[-1] // 2) + 1)
        low = np.array(list(itertools.product(*numbers)))
        self._low = tuple(low.T)
        self._exact = np.stack([self._autocorrelation(wave) for wave in low])
        unit = np.zeros_like(self.pairs)
        unit.flat[0] = 1.0
        self.white = self.expectation(unit)  # of white noise
        # One half if both k and -k are there or k is its own opposite,
        # and 0 for the mean.
        self.weights = np.ones(self.white.shape)
        self.weights[..., [0, -1] if self.shape[-1] % 2 == 0 else 0] = 0.5
        self.weights.flat[0] = 0.0

    def products(self, weights: Array) -> Array:
        """Return, for each lag, the sum of w_i w_j over measured pairs.

        >>> window = RecordWindow((0.5,), np.array([1, 0, 1, 1], dtype=bool))
        >>> window.products(np.array([2.0, 3.0, 5.0])).round(9).tolist()  # 2, 0, 3, 5
        [38.0, 15.0, 6.0, 10.0, 0.0, 10.0, 6.0, 15.0]
        """
        field, lags = np.zeros(self.shape), tuple(2 * n for n in self.shape)
        field[self.measured] = weights
        return fft.irfftn(np.abs(fft.rfftn(field, lags)) ** 2, lags)

    def _autocorrelation(self, wave: NDArray[np.int64]) -> Array:
        """Return a_k at all lags, flattened (step 3).

        At lag 0 it is the sum of squares |u|², with the trend taken out, and at
        other lags the sum of u(m) conj(u(m + l)):

        >>> window = RecordWindow((0.5,), np.array([1, 0, 1, 1, 1], dtype=bool), degree=1)
        >>> at = np.array([0, 2, 3, 4])
        >>> carried = window.taper[at] * np.exp(-2j * np.pi * 2 * at / 5)
        >>> trend = np.polyfit(at, carried.real, 1), np.polyfit(at, carried.imag, 1)
        >>> u = np.zeros(5, complex)
        >>> u[at] = carried - np.polyval(trend[0], at) - 1j * np.polyval(trend[1], at)
        >>> expected = [(u[: 5 - lag] * u[lag:].conj()).sum().real for lag in range(5)]
        >>> bool(np.allclose(window._autocorrelation(np.array([2]))[:5], expected))
        True
        """
        turns = [number * np.arange(n) / n for number, n in zip(wave, self.shape, strict=True)]
        phase = 2.0 * np.pi * sum(np.ix_(*turns))
        carried = (self.taper * np.exp(-1j * phase))[self.measured]
        field = np.zeros(self.shape, dtype=np.complex128)
        field[self.measured] = carried - self.basis @ (self.basis.T @ carried)
        power = np.abs(fft.fftn(field, self._spread.shape)) ** 2
        return fft.ifftn(power).real.ravel()

    @property
    def wave_vectors(self) -> tuple[Array, ...]:
        """Components of the wave vectors in `periodogram`, rad/m, in shapes that broadcast.

        >>> plane = RecordWindow((0.5, 0.25), np.ones((9, 8), dtype=bool))
        >>> x, y = plane.wave_vectors
        >>> x.shape, y.shape, (x.ravel()[[1, -1]] * 4.5 / np.pi).round(9).tolist()
        ((9, 1), (1, 5), [2.0, -2.0])
        >>> (y.ravel() / np.pi).round(9).tolist()
        [0.0, 1.0, 2.0, 3.0, 4.0]
        """
        axes = [fft.fftfreq(n, d) for n, d in zip(self.shape, self.spacings, strict=True)]
        axes[-1] = fft.rfftfreq(self.shape[-1], self.spacings[-1])
        return tuple(2.0 * np.pi * axis for axis in np.ix_(*axes))

    def without_trend(self, values: Array) -> Array:
        """Remove the trend of measured values (points,), and keep their mean.

        >>> measured = np.array([1, 0, 1, 1, 1], dtype=bool)
        >>> values = np.array([3.0, 7.0, 9.0, 11.0])  # 3 + 2 x
        >>> RecordWindow((0.5,), measured, degree=1).without_trend(values).round(9).tolist()
        [7.5, 7.5, 7.5, 7.5]
        >>> RecordWindow((0.5,), measured).without_trend(values).tolist()
        [3.0, 7.0, 9.0, 11.0]
        """
        if self.basis.shape[1] == 1:
            return values
        return values - self.basis @ (self.basis.T @ values) + values.mean()

    def periodogram(self, values: Array) -> Array:
        """Return |sum h (y - trend) exp(-i k x)|^2 as (*half), from measured values (points,).

        >>> at, values = np.array([0, 2, 3, 4]), np.array([3.0, 6.0, 1.0, 6.0])
        >>> window = RecordWindow((0.5,), np.array([1, 0, 1, 1, 1], dtype=bool), degree=1)
        >>> wave = np.exp(-2j * np.pi * 2 * at / 5)
        >>> rest = values - np.polyval(np.polyfit(at, values, 1), at)
        >>> by_hand = np.abs(np.sum(window.taper[at] * rest * wave)) ** 2
        >>> powers = window.periodogram(values)
        >>> powers.shape, round(float(powers[2] / by_hand), 9)
        ((3,), 1.0)
        """
        field = np.zeros(self.shape)
        field[self.measured] = values - self.basis @ (self.basis.T @ values)
        return np.abs(fft.rfftn(self.taper * field)) ** 2

    def expectation(self, covariance: Array) -> Array:
        """Return the expected periodogram (*half) from the covariance at all lags (steps 2, 3).

        The covariance of a wave with a random phase depends on the lag alone:

        >>> window = RecordWindow((0.5,), np.ones(90, dtype=bool))
        >>> lags, at = np.r_[:90, -90:0], np.arange(90)
        >>> waves = [np.cos(0.9 * at + phase) for phase in np.pi * np.arange(8) / 8]
        >>> mean = np.mean([window.periodogram(wave) for wave in waves], axis=0)
        >>> expected = window.expectation(0.5 * np.cos(0.9 * lags))
        >>> bool(np.allclose(mean, expected, atol=1e-3 * mean.max())), int(expected.argmax())
        (True, 13)
        >>> bool(np.allclose(mean[:17], expected[:17]))  # exact, with the mean taken out
        True

        White noise on a plane with a gap, without its linear trend, at wavenumbers
        -2 to 2 and 0 to 2:

        >>> measured = np.ones((9, 8), dtype=bool)
        >>> measured[3, 5] = False
        >>> plane = RecordWindow((0.5, 0.25), measured, degree=1)
        >>> (x, y), h = np.nonzero(measured), plane.taper[measured]
        >>> trend = np.stack([np.ones(71), x, y], axis=1)
        >>> for p, q in itertools.product((-2, -1, 0, 1, 2), (0, 1, 2)):
        ...     wave = h * np.exp(-2j * np.pi * (p * x / 9 + q * y / 8))
        ...     rest = wave - trend @ np.linalg.lstsq(trend + 0j, wave, rcond=None)[0]
        ...     assert abs(np.sum(np.abs(rest) ** 2) - plane.white[p, q]) < 1e-9
        """
        every_other = tuple(slice(None, None, 2) for _ in self.shape)
        result = fft.rfftn(self._spread * covariance).real[every_other].copy()
        result[self._low] = self._exact @ covariance.ravel()
        return result

    def power(self, spectrum: Any, anisotropy: float = 1.0) -> Array:
        """Return the variance of z in each mode on a periodic grid.

        The sum is 1 (step 4).

        Power above `FOLDS` sampling wavenumbers is spread evenly. The
        spectrum is not truncated, because the missing power of a rough
        spectrum would be mistaken for noise.

        >>> from stiction import PowerLawSpectrum
        >>> window = RecordWindow((0.5,), np.ones(64, dtype=bool))
        >>> power = window.power(PowerLawSpectrum(correlation_length=3.0, exponent=4.0))
        >>> both = 2.0 * power.sum() - power[0] - power[-1]  # 256 is even
        >>> power.size, round(float(both), 9)
        (129, 1.0)

        The variance in each mode is proportional to (k² + lambda²)^-4, with its
        aliases:

        >>> k, fold = 2.0 * np.pi * np.arange(129) / 128.0, 4.0 * np.pi * np.arange(-6, 7)[:, None]
        >>> density = ((k + fold) ** 2 + (2.0 * np.pi / 3.0) ** 2) ** -4.0
        >>> ratio = power / density.sum(axis=0)
        >>> bool(np.allclose(ratio, ratio[0], rtol=1e-3))
        True

        The power of a rough spectrum beyond the aliases is spread evenly, and the
        sum is 1 as well:

        >>> from stiction import ExponentialSpectrum
        >>> power = window.power(ExponentialSpectrum(correlation_length=0.2))
        >>> round(float(2.0 * power.sum() - power[0] - power[-1]), 9)
        1.0

        On a plane, an anisotropy of 2 doubles the wavenumbers along y:

        >>> plane = RecordWindow((0.5, 0.5), np.ones((16, 16), dtype=bool))
        >>> spectrum = PowerLawSpectrum(correlation_length=3.0, exponent=4.0)
        >>> power = plane.power(spectrum, 2.0)
        >>> power.shape, round(float(power[0, 3] / power[6, 0]), 3)
        ((32, 17), 1.0)
        """
        dimensions = len(self.shape)
        stretch = (1.0, anisotropy)[:dimensions]
        sampling = [a * 2.0 * math.pi / d for a, d in zip(stretch, self.spacings, strict=True)]
        cutoff = max(spectrum.quantile(1.0 - LEFT_OUT, dimensions), *sampling)
        folds = [min(FOLDS, math.ceil(cutoff / s + 0.5)) for s in sampling]
        end = min(cutoff, *(s * (f + 0.5) for s, f in zip(sampling, folds, strict=True)))
        axes = [s * of_period for s, of_period in zip(sampling, self._of_period, strict=True)]
        steps = [np.ptp(axis) / (min(axis.size, FEW[dimensions]) - 1) for axis in axes]
        width = EDGE * max(steps)
        folded = _folded_line if dimensions == 1 else _folded_plane

        def density(k: Array) -> Array:
            """Return the density, which fades out at its end."""
            fade = np.minimum(np.maximum((end - k) / width + 0.5, 0.0), 1.0)
            return spectrum.density(k, dimensions) * fade

        total = folded(density, axes, folds, sampling, end + width)
        missed = 0.0
        if end < cutoff:
            kept = [spectrum.power_within(k, dimensions) for k in (end, cutoff)]
            missed = 1.0 - kept[0] / kept[1]
        # Most modes of a real transform count twice, for k and -k.
        all_modes = 2.0 * total.sum() - total[..., 0].sum()
        if self._period[-1] % 2 == 0:
            all_modes -= total[..., -1].sum()
        total *= (1.0 - missed) / all_modes
        total += missed / math.prod(self._period)
        return total

    def variance_of_mean(self, covariance: Array) -> float:
        """Return the variance of the measured mean, from the covariance.

        The mean of three values, with a correlation of 0.5 between neighbours and
        0.2 at lag 2. Point 1 is a gap:

        >>> covariance = np.array([1.0, 0.5, 0.2, 0.0, 0.0, 0.0, 0.2, 0.5])
        >>> window = RecordWindow((0.5,), np.array([1, 0, 1, 1], dtype=bool))
        >>> round(window.variance_of_mean(covariance), 9)  # (3 + 2 x 0.5 + 2 x 0.2) / 9
        0.488888889
        """
        return float(np.sum(self.pairs * covariance) / np.sum(self.measured) ** 2)

    def taken_by_trend(self, covariance: Array) -> float:
        """Return the expected sum of squares that `without_trend` removes from the field.

        A field that is perfectly correlated has no trend. White noise loses one
        degree of freedom for each degree of the trend:

        >>> window = RecordWindow((0.5,), np.array([1, 0, 1, 1, 1], dtype=bool), degree=2)
        >>> white = np.eye(1, 10)[0]
        >>> taken = window.taken_by_trend(white), window.taken_by_trend(np.ones(10))
        >>> round(taken[0], 9), abs(round(taken[1], 9))
        (2.0, 0.0)
        """
        return float(np.sum(self._of_trend * covariance))

    def correlation(self, power: Array) -> Array:
        """Return the correlation at all lags.

        >>> window = RecordWindow((0.5,), np.ones(5, dtype=bool))  # a period of 20 points
        >>> power = np.zeros(11)
        >>> power[3] = 0.5  # at wavenumbers 3 and -3
        >>> lags = np.r_[:5, -5:0]
        >>> bool(np.allclose(window.correlation(power), np.cos(2.0 * np.pi * 3 * lags / 20)))
        True
        """
        whole: Array = fft.irfftn(power, self._period) * math.prod(self._period)
        return whole[self._lags]

    def sample(self, power: Array, rng: np.random.Generator) -> Array:
        """Sample z at the measured points (points,), as a piece of a period.

        >>> window = RecordWindow((0.5,), np.array([1, 0, 1, 1, 1], dtype=bool))
        >>> power = np.zeros(11)
        >>> power[3] = 0.5
        >>> z = window.sample(power, np.random.default_rng(0))
        >>> z.size, abs(round(float(z[1] + z[3] - 2.0 * np.cos(0.3 * np.pi) * z[2]), 9))  # a wave
        (4, 0.0)
        >>> rng = np.random.default_rng(0)
        >>> squares = np.mean([window.sample(power, rng) ** 2 for _ in range(4000)])
        >>> bool(0.95 < squares < 1.05)
        True
        """
        white = fft.rfftn(rng.standard_normal(self._period))
        whole = fft.irfftn(white * np.sqrt(power * math.prod(self._period)), self._period)
        return whole[tuple(slice(n) for n in self.shape)][self.measured]


def _polynomials(measured: NDArray[np.bool_], degree: int) -> Array:
    """Return orthonormal polynomials (points, terms) up to a total degree, at measured points.

    >>> measured = np.array([1, 1, 0, 1, 1, 1], dtype=bool)
    >>> basis = _polynomials(measured, 2)
    >>> basis.shape, bool(np.allclose(basis.T @ basis, np.eye(3)))
    ((5, 3), True)
    >>> x = np.flatnonzero(measured) ** 2.0 - 3.0 * np.flatnonzero(measured)
    >>> float(np.abs(x - basis @ (basis.T @ x)).max().round(9))
    0.0
    >>> [_polynomials(np.ones((4, 5), dtype=bool), degree).shape[1] for degree in (0, 1, 2)]
    [1, 3, 6]
    """
    axes = np.ix_(*[np.linspace(-1.0, 1.0, n) for n in measured.shape])
    terms = [
        np.prod(np.broadcast_arrays(*[x**p for x, p in zip(axes, powers, strict=True)]), axis=0)
        for powers in itertools.product(range(degree + 1), repeat=len(axes))
        if sum(powers) <= degree
    ]
    return np.linalg.qr(np.stack([term[measured] for term in terms], axis=1))[0]


def _folded_line(
    density: Density, axes: list[Array], folds: list[int], sampling: list[float], end: float
) -> Array:
    """Return the sum of the density over all wavenumbers with the same alias on the grid.

    The density 1/k² has the aliases k + 8 m. Five multiples give 1/2² + 1/6² +
    1/10² + ... at k = 2:

    >>> axis = np.linspace(0.0, 4.0, 129)
    >>> line = _folded_line(lambda k: 1.0 / np.maximum(k, 0.1) ** 2, [axis], [2], [8.0], 9.0)
    >>> expected = sum((2.0 + 8.0 * m) ** -2.0 for m in range(-2, 3))
    >>> round(float(line[64] / expected), 5)
    1.0
    >>> line = _folded_line(lambda k: 1.0 / np.maximum(k, 0.1) ** 2, [axis], [0], [8.0], 9.0)
    >>> float(line[64].round(9))
    0.25
    """

    def added(at: Array, multiples: Array) -> Array:
        return density(np.abs(at + multiples[:, None] * sampling[0])).sum(axis=0)

    near = min(folds[0], NEAR)
    line = added(axes[0], np.arange(-near, near + 1))
    if folds[0] > near:  # smooth from there on
        far = np.arange(near + 1, folds[0] + 1)
        few = np.linspace(0.0, axes[0][-1], FEW[1])
        line += np.interp(axes[0], few, added(few, np.concatenate([-far, far])))
    return line


def _folded_plane(
    density: Density, axes: list[Array], folds: list[int], sampling: list[float], end: float
) -> Array:
    """Return the same sum on a plane, over multiples in both directions.

    >>> axes = [np.linspace(-4.0, 3.875, 64), np.linspace(0.0, 5.0, 41)]
    >>> def density(k):
    ...     return np.exp(-k / 3.0)
    >>> near = _folded_plane(density, axes, [1, 0], [8.0, 10.0], 1e9)
    >>> k = [np.hypot(axes[0][9] + p, axes[1][7]) for p in (-8.0, 0.0, 8.0)]
    >>> round(float(near[9, 7] / sum(np.exp(-np.array(k) / 3.0))), 9)
    1.0
    >>> far = _folded_plane(density, axes, [1, 2], [8.0, 10.0], 1e9)
    >>> k = [np.hypot(axes[0][9] + p, axes[1][7] + q)
    ...      for p in (-8.0, 0.0, 8.0) for q in (-20.0, -10.0, 0.0, 10.0, 20.0)]
    >>> round(float(far[9, 7] / sum(np.exp(-np.array(k) / 3.0))), 3)
    1.0

    Multiples that lie completely beyond the end, here of 20 along y, are left
    out:

    >>> reached = _folded_plane(density, axes, [1, 2], [8.0, 10.0], 14.0)
    >>> k = [np.hypot(axes[0][9] + p, axes[1][7] + q)
    ...      for p in (-8.0, 0.0, 8.0) for q in (-10.0, 0.0, 10.0)]
    >>> round(float(reached[9, 7] / sum(np.exp(-np.array(k) / 3.0))), 3)
    1.0
    """
    few = [np.linspace(axis.min(), axis.max(), FEW[2]) for axis in axes]
    near, far = np.zeros((axes[0].size, axes[1].size)), np.zeros((FEW[2], FEW[2]))
    for p, q in itertools.product(*(range(-fold, fold + 1) for fold in folds)):
        total, at = (near, axes) if max(abs(p), abs(q)) <= NEAR else (far, few)
        k = np.hypot(*np.ix_(at[0] + p * sampling[0], at[1] + q * sampling[1]))
        if k.min() <= end:
            total += density(k)
    rows = np.stack([np.interp(axes[1], few[1], row) for row in far])
    columns = [np.interp(axes[0], few[0], column) for column in rows.T]
    return near + np.stack(columns, axis=1)

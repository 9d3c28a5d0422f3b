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
        """Return, for each lag, the sum of w_i w_j over measured pairs."""
        field, lags = np.zeros(self.shape), tuple(2 * n for n in self.shape)
        field[self.measured] = weights
        return fft.irfftn(np.abs(fft.rfftn(field, lags)) ** 2, lags)

    def _autocorrelation(self, wave: NDArray[np.int64]) -> Array:
        """Return a_k at all lags, flattened (step 3)."""
        turns = [number * np.arange(n) / n for number, n in zip(wave, self.shape, strict=True)]
        phase = 2.0 * np.pi * sum(np.ix_(*turns))
        carried = (self.taper * np.exp(-1j * phase))[self.measured]
        field = np.zeros(self.shape, dtype=np.complex128)
        field[self.measured] = carried - self.basis @ (self.basis.T @ carried)
        power = np.abs(fft.fftn(field, self._spread.shape)) ** 2
        return fft.ifftn(power).real.ravel()

    @property
    def wave_vectors(self) -> tuple[Array, ...]:
        """Components of the wave vectors in `periodogram`, rad/m, in shapes that broadcast."""
        axes = [fft.fftfreq(n, d) for n, d in zip(self.shape, self.spacings, strict=True)]
        axes[-1] = fft.rfftfreq(self.shape[-1], self.spacings[-1])
        return tuple(2.0 * np.pi * axis for axis in np.ix_(*axes))

    def without_trend(self, values: Array) -> Array:
        """Remove the trend of measured values (points,), and keep their mean."""
        if self.basis.shape[1] == 1:
            return values
        return values - self.basis @ (self.basis.T @ values) + values.mean()

    def periodogram(self, values: Array) -> Array:
        """Return |sum h (y - trend) exp(-i k x)|^2 as (*half), from measured values (points,)."""
        field = np.zeros(self.shape)
        field[self.measured] = values - self.basis @ (self.basis.T @ values)
        return np.abs(fft.rfftn(self.taper * field)) ** 2

    def expectation(self, covariance: Array) -> Array:
        """Return the expected periodogram (*half) from the covariance at all lags (steps 2, 3)."""
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
        """Return the variance of the measured mean, from the covariance."""
        return float(np.sum(self.pairs * covariance) / np.sum(self.measured) ** 2)

    def taken_by_trend(self, covariance: Array) -> float:
        """Return the expected sum of squares that `without_trend` removes from the field."""
        return float(np.sum(self._of_trend * covariance))

    def correlation(self, power: Array) -> Array:
        """Return the correlation at all lags."""
        whole: Array = fft.irfftn(power, self._period) * math.prod(self._period)
        return whole[self._lags]

    def sample(self, power: Array, rng: np.random.Generator) -> Array:
        """Sample z at the measured points (points,), as a piece of a period."""
        white = fft.rfftn(rng.standard_normal(self._period))
        whole = fft.irfftn(white * np.sqrt(power * math.prod(self._period)), self._period)
        return whole[tuple(slice(n) for n in self.shape)][self.measured]


def _polynomials(measured: NDArray[np.bool_], degree: int) -> Array:
    """Return orthonormal polynomials (points, terms) up to a total degree, at measured points."""
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
    """Return the sum of the density over all wavenumbers with the same alias on the grid."""

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

"""What a finite window does to a spectrum: taper, gaps and the removal of a trend, exactly.

A record is no period of the interface. Its periodogram, tapered and with a trend removed, has an
expectation that is linear in the correlation,

    E |sum_m u_k(m) y(m)|^2 = sum_l C(l) a_k(l),    u_k = P (h exp(-i k x)),

with h the taper (zero where nothing was measured), P the projection that removes the trend and a_k
the autocorrelation of u_k. Leakage, gaps, aliasing and the loss of low wavenumbers to the trend are
all in it (the debiased Whittle likelihood of Sykulski, Olhede, Guillaumin, Lilly and Early, 2019,
and of Guillaumin, Sykulski, Olhede and Simons, 2022, here with the trend as well).
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from stiction.arrays import Array

TAPERED = 0.5
"""Share of a record over which the cosine taper rises and falls."""
EXACT = {1: 16, 2: 2}
"""Wave numbers up to which the trend is in the expectation; the taper hides it from higher ones."""


@dataclass(frozen=True, eq=False)
class Window:
    """Taper, gaps and trend of records of one geometry.

    Attributes
    ----------
    shape : tuple of int
    spacings : tuple of float
        m.
    measured : (*shape) array of bool
    basis : (points, terms) array
        Orthonormal polynomials of the trend on the measured points.
    taper : (*shape) array
        h, zero in gaps; its squares sum to 1.
    spread : (*padded) array
        Autocorrelation of h at lags 0, 1, ..., n - 1, -n, ..., -1.
    low : tuple of arrays of int
        Wave numbers for which the trend counts.
    exact : (low, lags) array
        a_k of those.
    """

    shape: tuple[int, ...]
    spacings: tuple[float, ...]
    measured: NDArray[np.bool_]
    basis: Array
    taper: Array
    spread: Array
    low: tuple[NDArray[np.int64], ...]
    exact: Array

    @property
    def padded(self) -> tuple[int, ...]:
        """Shape of arrays over all lags, twice that of the record."""
        return tuple(2 * n for n in self.shape)

    @property
    def wave_vectors(self) -> tuple[Array, ...]:
        """Components of the wave vectors of `periodogram`, rad/m; they broadcast."""
        axes = [fft.fftfreq(n, d) for n, d in zip(self.shape, self.spacings, strict=True)]
        axes[-1] = fft.rfftfreq(self.shape[-1], self.spacings[-1])
        return tuple(2.0 * np.pi * axis for axis in np.ix_(*axes))

    def without_trend(self, values: Array) -> Array:
        """Measured values (points,) without their trend but with their mean."""
        if self.basis.shape[1] == 1:
            return values
        result: Array = values - self.basis @ (self.basis.T @ values) + values.mean()
        return result

    def periodogram(self, values: Array) -> Array:
        """|sum h (y - trend) exp(-i k x)|^2 of values (*shape) or of measured ones (points,)."""
        known = values[self.measured] if values.shape == self.shape else values
        field = np.zeros(self.shape)
        field[self.measured] = known - self.basis @ (self.basis.T @ known)
        result: Array = np.abs(fft.rfftn(self.taper * field)) ** 2
        return result

    def expectation(self, covariance: Array) -> Array:
        """Of the periodogram, from the covariance at all lags, (*padded)."""
        padded = fft.rfftn(self.spread * covariance).real
        step = tuple(slice(None, None, 2) for _ in self.shape)
        result = padded[step].copy()
        result[self.low] = self.exact @ covariance.ravel()
        return result


def make_window(
    shape: tuple[int, ...],
    spacings: tuple[float, ...],
    measured: NDArray[np.bool_],
    degree: int,
) -> Window:
    """The window of records of one shape, with gaps where nothing was measured."""
    basis = _polynomials(measured, degree)
    tapers = np.ix_(*[_taper(n) for n in shape])
    taper = np.prod(np.broadcast_arrays(measured, *tapers), axis=0)
    taper /= np.sqrt(np.sum(taper**2))
    padded = tuple(2 * n for n in shape)
    spread = fft.irfftn(np.abs(fft.rfftn(taper, padded)) ** 2, padded)
    # Wave numbers of the half plane of a real transform.
    most = [min(EXACT[len(shape)], (n - 1) // 2) for n in shape]
    numbers = [np.arange(-m, m + 1) for m in most]
    numbers[-1] = np.arange(min(EXACT[len(shape)], shape[-1] // 2) + 1)
    low = np.array(list(itertools.product(*numbers)))
    exact = np.stack([_autocorrelation(wave, taper, measured, basis) for wave in low])
    return Window(shape, spacings, measured, basis, taper, spread, tuple(low.T), exact)


def _polynomials(measured: NDArray[np.bool_], degree: int) -> Array:
    """Orthonormal polynomials of a total degree on the measured points, (points, terms)."""
    axes = np.ix_(*[np.linspace(-1.0, 1.0, n) for n in measured.shape])
    terms = [
        np.prod(np.broadcast_arrays(*[x**p for x, p in zip(axes, powers, strict=True)]), axis=0)
        for powers in itertools.product(range(degree + 1), repeat=len(axes))
        if sum(powers) <= degree
    ]
    basis: Array = np.linalg.qr(np.stack([term[measured] for term in terms], axis=1))[0]
    return basis


def _taper(n: int) -> Array:
    """A cosine (Tukey) taper that is nowhere zero."""
    place = (np.arange(n) + 0.5) / n
    edge = np.minimum(np.minimum(place, 1.0 - place) / (0.5 * TAPERED), 1.0)
    result: Array = np.sin(0.5 * np.pi * edge) ** 2
    return result


def _autocorrelation(
    wave: NDArray[np.int64], taper: Array, measured: NDArray[np.bool_], basis: Array
) -> Array:
    """a_k at all lags, flat."""
    turns = [number * np.arange(n) / n for number, n in zip(wave, taper.shape, strict=True)]
    phase = 2.0 * np.pi * sum(np.ix_(*turns))
    carried = (taper * np.exp(-1j * phase))[measured]
    field = np.zeros(taper.shape, dtype=np.complex128)
    field[measured] = carried - basis @ (basis.T @ carried)
    padded = tuple(2 * n for n in taper.shape)
    result: Array = fft.ifftn(np.abs(fft.fftn(field, padded)) ** 2).real.ravel()
    return result

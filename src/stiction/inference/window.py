"""What a finite window does to a spectrum: taper, gaps and the removal of a trend, exactly.

A record is no period of the interface. Its periodogram, tapered and with a trend removed, has an
expectation that is linear in the correlation,

    E |sum_m u_k(m) y(m)|^2 = sum_l C(l) a_k(l),    u_k = P (h exp(-i k x)),

with h the taper (zero where nothing was measured), P the projection that removes the trend and a_k
the autocorrelation of u_k. Leakage, gaps, aliasing and the loss of low wavenumbers to the trend are
all in it (the debiased Whittle likelihood of Sykulski, Olhede, Guillaumin, Lilly and Early, 2019,
and of Guillaumin, Sykulski, Olhede and Simons, 2022, here with the trend as well).
"""

from __future__ import annotations

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


def polynomials(shape: tuple[int, ...], measured: NDArray[np.bool_], degree: int) -> Array:
    """Orthonormal polynomials of a total degree on the measured points, (points, terms)."""
    axes = [np.linspace(-1.0, 1.0, n) for n in shape]
    grids = np.meshgrid(*axes, indexing="ij")
    terms = [
        np.prod([g**p for g, p in zip(grids, powers, strict=True)], axis=0)
        for powers in itertools.product(range(degree + 1), repeat=len(shape))
        if sum(powers) <= degree
    ]
    columns = np.stack([term[measured] for term in terms], axis=1)
    basis: Array = np.linalg.qr(columns)[0]
    return basis


def without_trend(values: Array, basis: Array) -> Array:
    """Measured values (points,) less their projection on polynomials."""
    result: Array = values - basis @ (basis.T @ values)
    return result


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
        Of the trend.
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
        parts = []
        for axis, (n, d) in enumerate(zip(self.shape, self.spacings, strict=True)):
            last = axis == len(self.shape) - 1
            k = 2.0 * np.pi * (fft.rfftfreq(n, d) if last else fft.fftfreq(n, d))
            parts.append(k.reshape([-1 if i == axis else 1 for i in range(len(self.shape))]))
        return tuple(parts)

    def periodogram(self, values: Array) -> Array:
        """|sum h (y - trend) exp(-i k x)|^2 of values (*shape) or of measured ones (points,)."""
        known = values[self.measured] if values.shape == self.shape else values
        field = np.zeros(self.shape)
        field[self.measured] = without_trend(known, self.basis)
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
    tapered: float = TAPERED,
) -> Window:
    """The window of records of one shape, with gaps where nothing was measured."""
    basis = polynomials(shape, measured, degree)
    taper = measured.astype(np.float64)
    for axis, n in enumerate(shape):
        one = _cosine(n, tapered)
        taper = taper * one.reshape([-1 if i == axis else 1 for i in range(len(shape))])
    taper /= np.sqrt(np.sum(taper**2))
    padded = tuple(2 * n for n in shape)
    spread = fft.irfftn(np.abs(fft.rfftn(taper, padded)) ** 2, padded)
    numbers = _low_numbers(shape)
    exact = np.stack([_spread_of(wave, taper, measured, basis, padded) for wave in numbers.T])
    low = tuple(np.asarray(index) for index in numbers)
    return Window(shape, spacings, measured, basis, taper, spread, low, exact)


def _cosine(n: int, share: float) -> Array:
    """A cosine (Tukey) taper that is nowhere zero."""
    place = (np.arange(n) + 0.5) / n
    edge = np.minimum(place, 1.0 - place) / (0.5 * share)
    result: Array = np.where(edge < 1.0, np.sin(0.5 * np.pi * np.minimum(edge, 1.0)) ** 2, 1.0)
    return result


def _low_numbers(shape: tuple[int, ...]) -> NDArray[np.int64]:
    """Wave numbers of the half plane of a real transform, (dimensions, count)."""
    most = EXACT[len(shape)]
    ranges = [range(-min(most, (n - 1) // 2), min(most, (n - 1) // 2) + 1) for n in shape]
    ranges[-1] = range(min(most, shape[-1] // 2) + 1)
    return np.array(list(itertools.product(*ranges)), dtype=np.int64).T


def _spread_of(
    wave: NDArray[np.int64],
    taper: Array,
    measured: NDArray[np.bool_],
    basis: Array,
    padded: tuple[int, ...],
) -> Array:
    """a_k at all lags, flat."""
    phase = sum(
        (2.0 * np.pi * number / n)
        * np.arange(n).reshape([-1 if i == axis else 1 for i in range(len(padded))])
        for axis, (number, n) in enumerate(zip(wave, taper.shape, strict=True))
    )
    carried = (taper * np.exp(-1j * phase))[measured]
    field = np.zeros(taper.shape, dtype=np.complex128)
    field[measured] = carried - basis @ (basis.T @ carried)
    spectrum = np.abs(fft.fftn(field, padded)) ** 2
    result: Array = fft.ifftn(spectrum).real.ravel()
    return result

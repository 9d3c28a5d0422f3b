"""Whittle likelihood of records whose field is mapped from a Gaussian one, with noise on top.

The likelihood is in terms of the measured values themselves: their correlation follows from that
of the Gaussian field z by the Hermite expansion of the marginal's map, and white noise of the
measurement, which is added to values and not to z, adds its share at zero lag. The variance is
free, so that what a short record does to it does not disturb the shape of the spectrum.

A spectrum that is cut off, or falls fast, has next to nothing at high wavenumbers, where a
likelihood would weigh the logarithm of what is left: higher orders of the map, rounding of the
data. A floor of a thousandth of the highest power is therefore added to periodogram and expectation
alike. The score stays unbiased; what lies below the floor ceases to count.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter

from stiction.arrays import Array
from stiction.inference.spectral_model import Grid
from stiction.inference.window import Window
from stiction.random.mapping import quantile_of_normal

FLOOR = 1e-3
"""Of the highest power, averaged over records and neighbours."""
NEIGHBOURS = 5
ORDERS = 10
REACH, POINTS = 6.0, 121


def hermite_shares(marginal: Any) -> Array:
    """Shares of the variance in the Hermite orders 0, 1, ..., which sum to 1.

    As `stiction.random.mapping.hermite_coefficients`, with fewer points and orders: a hundredth of
    its cost and an error below 1e-4, the last order standing for all that are left out.
    """
    z = np.linspace(-REACH, REACH, POINTS)
    weight = np.exp(-0.5 * z * z)
    weight /= weight.sum()
    value = quantile_of_normal(marginal.distribution, z)
    value = value - weight @ value
    total = float(weight @ value**2)
    shares = np.zeros(ORDERS + 1)
    previous, current = np.zeros_like(z), np.ones_like(z)
    for order in range(1, ORDERS):
        previous, current = (
            current,
            (z * current - np.sqrt(order - 1) * previous) / np.sqrt(order),
        )
        shares[order] = float(weight @ (value * current)) ** 2 / total
    shares[ORDERS] = max(1.0 - shares.sum(), 0.0)
    result: Array = shares / shares.sum()
    return result


@dataclass(frozen=True, eq=False)
class Observed:
    """Periodograms of all records of one geometry.

    Attributes
    ----------
    window : Window
    grid : Grid
    records : int
    average : (*half) array
        Of their periodograms.
    weights : (*half) array
        Of wave vectors: 1, a half where k and -k are both among them or k is its own opposite, 0
        for the mean.
    floor : float
        Added to periodograms and expectations.
    white : (*half) array
        Expectation of a periodogram of white noise of unit variance.
    """

    window: Window
    grid: Grid
    records: int
    average: Array
    weights: Array
    floor: float
    white: Array


def make_observed(window: Window, periodograms: Array) -> Observed:
    """What is needed of periodograms (records, *half) in a window."""
    average = periodograms.mean(axis=0)
    smooth = uniform_filter(average, NEIGHBOURS, mode="nearest")
    unit = np.zeros(window.padded)
    unit[(0,) * unit.ndim] = 1.0
    weights = np.ones(average.shape)
    weights[..., 0] = 0.5
    if window.shape[-1] % 2 == 0:
        weights[..., -1] = 0.5
    weights[(0,) * weights.ndim] = 0.0
    return Observed(
        window=window,
        grid=Grid(window.shape, window.spacings),
        records=len(periodograms),
        average=average,
        weights=weights,
        floor=FLOOR * float(smooth.max()),
        white=window.expectation(unit),
    )


@dataclass(frozen=True, eq=False)
class Model:
    """What a spectrum, a marginal and a share of noise predict of records.

    Attributes
    ----------
    spectrum : PowerLawSpectrum, SquaredExponentialSpectrum or ExponentialSpectrum
    anisotropy : float
    noise_share : float
        Of the variance of the values; negative only on the way to an estimate.
    variance : float
        Of the values, noise included.
    shares : (orders,) array
        See `hermite_shares`.
    end_seen : bool
        Whether the truncation of the spectrum is a property of the field, which records may show.
        Otherwise it only makes simulation finite: at a multiple of 1/xi_0 it would, among the
        wavenumbers of a record, tell the correlation length, and rule out a longer one.
    """

    spectrum: Any
    anisotropy: float
    noise_share: float
    variance: float
    shares: Array
    end_seen: bool = True

    @property
    def noise(self) -> float:
        """Standard deviation of the measurement noise."""
        return math.sqrt(self.noise_share * self.variance)

    def power(self, grid: Grid) -> Array:
        """Variance of z in each mode of a grid."""
        return grid.power(self.spectrum, self.anisotropy, end_seen=self.end_seen)

    def signal(self, observed: Observed) -> Array:
        """Expectation of periodograms of values of unit variance without noise, (*half)."""
        rho = observed.grid.correlation(self.power(observed.grid))
        return observed.window.expectation(np.polynomial.polynomial.polyval(rho, self.shares))

    def expectation(self, observed: Observed) -> Array:
        """Of periodograms, (*half)."""
        return self.with_noise(self.signal(observed), observed)

    def with_noise(self, signal: Array, observed: Observed) -> Array:
        """The expectation of periodograms from that without noise."""
        share = self.noise_share
        result: Array = self.variance * ((1.0 - share) * signal + share * observed.white)
        return result


def loss(expected: Sequence[Array], observed: Sequence[Observed]) -> float:
    """Minus the log likelihood; infinite where less than nothing is expected."""
    value = 0.0
    for one, e in zip(observed, expected, strict=True):
        lifted = e + one.floor
        if lifted.min() <= 0.0:
            return math.inf
        terms = np.log(lifted) + (one.average + one.floor) / lifted
        value += one.records * float(np.sum(one.weights * terms))
    return value

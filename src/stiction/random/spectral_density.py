"""What spectra of the underlying Gaussian field have in common: power, truncation, correlation.

A spectrum is known by its density g(k) and the wavenumber at which it is truncated; what is sampled
is the truncated one, and so correlations and lengths are of that. Truncation is given as a
multiple of lambda = 2 pi/xi_0 (`truncation`) or as the share of the power that is kept
(`power_kept`).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Any, ClassVar, TypeAlias

import numpy as np
from pydantic import BeforeValidator, Field
from scipy.optimize import brentq

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import _number
from stiction.random.pieces import Pieces, in_pieces

Share: TypeAlias = Annotated[float, BeforeValidator(_number), Field(gt=0, lt=1)]


def one_truncation(truncation: float | None, power_kept: float | None) -> None:
    if truncation is not None and power_kept is not None:
        raise InputError("give truncation or power_kept, not both")


class SpectralDensity:
    """What all spectra share; a subclass gives g(k) and its cumulative power."""

    def density(self, wavenumber: Array) -> Array:
        """g(k)/g(0) at k in rad/m, an array of the same shape."""
        raise NotImplementedError

    def power_within(self, wavenumber: float) -> float:
        """Share of the power at wavenumbers below `wavenumber` (rad/m), on an infinite line."""
        raise NotImplementedError

    def untruncated_correlation(self, lag: Array) -> Array:
        """Correlation that z would have at `lag` (m) without truncation, on an infinite line."""
        raise NotImplementedError

    def correlation(self, lag: Array) -> Array:
        """Correlation of z at `lag` (m), truncation included, on an infinite line."""
        pieces = _truncated(self)
        result: Array = pieces.cosine(lag) / pieces.total
        return result

    @property
    def cutoff(self) -> float:
        """Wavenumber above which the spectrum is truncated, rad/m."""
        raise NotImplementedError

    def plane_density(self, wavenumber: Array) -> Array:
        """Density on a plane at wave vectors of length k in rad/m, up to a factor."""
        raise NotImplementedError

    def plane_power_within(self, wavenumber: float) -> float:
        """Share of the power at wave vectors shorter than `wavenumber`, on an infinite plane."""
        raise NotImplementedError

    @property
    def plane_cutoff(self) -> float:
        """Length of wave vector above which the spectrum of a plane is truncated, rad/m."""
        raise NotImplementedError

    @property
    def _edges(self) -> Array:
        """Wavenumbers from 0 to the cutoff; between them the density is looked at as a whole."""
        return np.array([0.0, self.cutoff])

    @property
    def power_kept_by_truncation(self) -> float:
        """Share of the power that truncation keeps, on an infinite line."""
        return self.power_within(self.cutoff)

    @property
    def efolding_length(self) -> float:
        """Distance at which the correlation of z first falls to 1/e, m, on an infinite line."""
        return lag_of_correlation(self, math.exp(-1.0))

    def _power_quantile(self, share: float) -> float:
        return quantile(self.power_within, share)


def quantile(power_within: Callable[[float], float], share: float) -> float:
    """Wavenumber below which a share of the power lies, rad/m."""
    upper = 1.0
    while power_within(upper) < share:
        upper *= 2.0
        if upper > 1e15:
            raise InputError("spectrum: its power is not finite; give a truncation")
    root: float = brentq(lambda k: power_within(k) - share, 0.0, upper, xtol=1e-300)
    return root


@lru_cache(maxsize=256)
def _truncated(spectrum: SpectralDensity) -> Pieces:
    return in_pieces(spectrum.density, spectrum._edges)


@lru_cache(maxsize=256)
def lag_of_correlation(spectrum: SpectralDensity, target: float) -> float:
    """First lag at which the correlation of z on an infinite line falls to `target`, m."""
    # The correlation cannot change faster than its highest wavenumber allows; wide steps after
    # that, for spectra whose power sits far below their truncation.
    step = 0.25 * math.pi / spectrum.cutoff
    low = high = 0.0
    while True:
        lags = high + step * np.arange(1, 65)
        below = np.nonzero(spectrum.correlation(lags) <= target)[0]
        if below.size:
            high = float(lags[below[0]])
            low = high - step
            break
        high = float(lags[-1])
        step *= 1.25
        if not math.isfinite(high):
            raise InputError("spectrum: its correlation does not fall to 1/e at any distance")

    def excess(ratio: float) -> float:
        return float(spectrum.correlation(np.array([ratio * high]))[0]) - target

    root: float = brentq(excess, low / high, 1.0, xtol=1e-15, rtol=1e-14)
    return root * high


class ScaledSpectrum(SpectralDensity):
    """Spectra known by one length; g depends on k times it only."""

    correlation_length: float
    truncation: float | None
    power_kept: float | None
    _default_power: ClassVar[float] = 0.9997

    @property
    def efolding_length(self) -> float:
        """Distance at which the correlation of z first falls to 1/e, m, on an infinite line."""
        # Searched for once a shape: a sweep may hold a hundred thousand lengths.
        shape: Any = self
        unit = dataclasses.replace(shape, correlation_length=1.0)
        return self.correlation_length * lag_of_correlation(unit, math.exp(-1.0))

    @property
    def cutoff(self) -> float:
        """Wavenumber above which the spectrum is truncated, rad/m."""
        if self.truncation is not None:
            return self.truncation * 2.0 * math.pi / self.correlation_length
        return self._power_quantile(self.power_kept or self._default_power)

    @property
    def plane_cutoff(self) -> float:
        """Length of wave vector above which the spectrum of a plane is truncated, rad/m."""
        if self.truncation is not None:
            return self.cutoff
        return self._plane_quantile(self.power_kept or self._default_power)

    def _plane_quantile(self, share: float) -> float:
        raise NotImplementedError

    def with_correlation_length(self, correlation_length: float) -> Any:
        """The same spectrum with another `correlation_length` (m)."""
        return dataclasses.replace(self, correlation_length=correlation_length)  # type: ignore[type-var]  # every subclass is a dataclass

    def with_efolding_length(self, length: float) -> Any:
        """The same shape of spectrum whose correlation of z falls to 1/e at `length` (m)."""
        return self.with_correlation_length(self.correlation_length * length / self.efolding_length)

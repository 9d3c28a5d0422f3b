"""Power spectral densities of the underlying Gaussian field.

A spectrum is known by its density g(k) and the wavenumber at which it is truncated; what is sampled
is the truncated one, and so correlations and lengths are of that. Truncation is given as a
multiple of lambda = 2 pi/xi_0 (`truncation`) or as the share of the power that is kept
(`power_kept`).

On a plane the field is isotropic, and a line cut through it has the correlation of the field on a
line. That makes the density on the plane, as a function of the length of the wave vector, the
inverse Abel transform of the line's: with the power of (1 + k^2) less by a half where the line's is
a power of that, and the same where it is Gaussian.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

import numpy as np
from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema, model_validator
from scipy.optimize import brentq
from scipy.special import betainc, betaincinv, erf, erfinv, gammaln, kve

from stiction._model import Positive, _number, model
from stiction._typing import Array
from stiction.errors import InputError
from stiction.random.pieces import Pieces, in_pieces

Share: TypeAlias = Annotated[float, BeforeValidator(_number), Field(gt=0, lt=1)]


def _one_truncation(truncation: float | None, power_kept: float | None) -> None:
    if truncation is not None and power_kept is not None:
        raise InputError("give truncation or power_kept, not both")


class _Spectrum:
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
        return _quantile(self.power_within, share)


def _quantile(power_within: Callable[[float], float], share: float) -> float:
    """Wavenumber below which a share of the power lies, rad/m."""
    upper = 1.0
    while power_within(upper) < share:
        upper *= 2.0
        if upper > 1e15:
            raise InputError("spectrum: its power is not finite; give a truncation")
    root: float = brentq(lambda k: power_within(k) - share, 0.0, upper, xtol=1e-300)
    return root


@lru_cache(maxsize=256)
def _truncated(spectrum: _Spectrum) -> Pieces:
    return in_pieces(spectrum.density, spectrum._edges)


@lru_cache(maxsize=256)
def lag_of_correlation(spectrum: _Spectrum, target: float) -> float:
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


class _ScaledSpectrum(_Spectrum):
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


@model
class PowerLawSpectrum(_ScaledSpectrum):
    """g(k) ~ (k^2 + lambda^2)^-exponent, lambda = 2 pi/correlation_length.

    Parameters
    ----------
    correlation_length : float
        xi_0 = 2 pi/lambda, m.
    exponent : float
        In [0.6, 64]; 4 in Albertini et al. (2020, Eq. 4).
    truncation : float, optional
        Truncation in multiples of lambda; 2.5 if neither this nor `power_kept` is given.
    power_kept : float, optional
        Share of the power kept by truncation, in (0, 1).

    Notes
    -----
    On an infinite line this is a Matern covariance of smoothness exponent - 1/2, and on a plane the
    same with the density (k^2 + lambda^2)^-(exponent + 1/2).

    Examples
    --------
    >>> import stiction as st
    >>> spectrum = st.PowerLawSpectrum(correlation_length=2e-3, exponent=2.0)
    >>> round(spectrum.with_efolding_length(1e-3).efolding_length * 1e3, 6)  # mm
    1.0
    """

    correlation_length: Positive
    exponent: Annotated[float, BeforeValidator(_number), Field(ge=0.6, le=64.0)] = 4.0
    truncation: Positive | None = None
    power_kept: Share | None = None
    type: Literal["power_law"] = "power_law"

    @model_validator(mode="after")
    def _truncated_once(self) -> PowerLawSpectrum:
        _one_truncation(self.truncation, self.power_kept)
        return self

    @property
    def cutoff(self) -> float:
        """Wavenumber above which the spectrum is truncated, rad/m."""
        if self.power_kept is not None:
            return self._power_quantile(self.power_kept)
        return (2.5 if self.truncation is None else self.truncation) * self.cutoff_wavenumber

    @property
    def plane_cutoff(self) -> float:
        """Length of wave vector above which the spectrum of a plane is truncated, rad/m."""
        return self.cutoff if self.power_kept is None else self._plane_quantile(self.power_kept)

    @property
    def cutoff_wavenumber(self) -> float:
        """lambda = 2 pi/xi_0, rad/m: the density falls as a power law above it."""
        return 2.0 * math.pi / self.correlation_length

    def density(self, wavenumber: Array) -> Array:
        """g(k)/g(0) at k in rad/m."""
        ratio = np.asarray(wavenumber) / self.cutoff_wavenumber
        result: Array = (1.0 + ratio * ratio) ** -self.exponent
        return result

    def power_within(self, wavenumber: float) -> float:
        """Share of the power below `wavenumber`: an incomplete beta function."""
        ratio = (wavenumber / self.cutoff_wavenumber) ** 2
        return float(betainc(0.5, self.exponent - 0.5, ratio / (1.0 + ratio)))

    def _power_quantile(self, share: float) -> float:
        # 1 - t of the incomplete beta function above, without cancellation where t is nearly 1.
        rest = float(betaincinv(self.exponent - 0.5, 0.5, 1.0 - share))
        return self.cutoff_wavenumber * math.sqrt((1.0 - rest) / rest)

    def plane_density(self, wavenumber: Array) -> Array:
        """(1 + (k/lambda)^2)^-(exponent + 1/2)."""
        ratio = np.asarray(wavenumber) / self.cutoff_wavenumber
        result: Array = (1.0 + ratio * ratio) ** -(self.exponent + 0.5)
        return result

    def plane_power_within(self, wavenumber: float) -> float:
        """Share of the power at wave vectors shorter than `wavenumber`."""
        ratio = wavenumber / self.cutoff_wavenumber
        return -math.expm1((0.5 - self.exponent) * math.log1p(ratio * ratio))

    def _plane_quantile(self, share: float) -> float:
        return self.cutoff_wavenumber * math.sqrt(
            math.expm1(math.log1p(-share) / (0.5 - self.exponent))
        )

    def untruncated_correlation(self, lag: Array) -> Array:
        """Matern correlation at `lag` (m), on an infinite line."""
        smoothness = self.exponent - 0.5
        a = np.abs(np.asarray(lag, dtype=np.float64)) * self.cutoff_wavenumber
        with np.errstate(divide="ignore", invalid="ignore"):
            log_value = (
                (1.0 - smoothness) * math.log(2.0)
                - gammaln(smoothness)
                + smoothness * np.log(a)
                + np.log(kve(smoothness, a))
                - a
            )
        # Where the Bessel function overflows, a is so small that the correlation is 1.
        return np.where(np.isfinite(log_value) & (a > 0.0), np.exp(log_value), 1.0)


@model
class SquaredExponentialSpectrum(_ScaledSpectrum):
    """Correlation exp(-(x/xi_0)^2): g(k) ~ exp(-(k xi_0/2)^2).

    Parameters
    ----------
    correlation_length : float
        xi_0, m: here the correlation of z would be 1/e at xi_0 without truncation.
    truncation : float, optional
        Truncation in multiples of 2 pi/xi_0.
    power_kept : float, optional
        Share of the power kept by truncation; 0.9997 if neither is given.

    Examples
    --------
    >>> import stiction as st
    >>> spectrum = st.SquaredExponentialSpectrum(correlation_length=2e-3)
    >>> round(spectrum.with_efolding_length(1e-3).efolding_length * 1e3, 6)  # mm
    1.0
    """

    correlation_length: Positive
    truncation: Positive | None = None
    power_kept: Share | None = None
    type: Literal["squared_exponential"] = "squared_exponential"

    @model_validator(mode="after")
    def _truncated_once(self) -> SquaredExponentialSpectrum:
        _one_truncation(self.truncation, self.power_kept)
        return self

    def density(self, wavenumber: Array) -> Array:
        """g(k)/g(0) at k in rad/m."""
        result: Array = np.exp(-((np.asarray(wavenumber) * self.correlation_length / 2.0) ** 2))
        return result

    def power_within(self, wavenumber: float) -> float:
        """Share of the power below `wavenumber`."""
        return float(erf(wavenumber * self.correlation_length / 2.0))

    def _power_quantile(self, share: float) -> float:
        return 2.0 / self.correlation_length * float(erfinv(share))

    def plane_density(self, wavenumber: Array) -> Array:
        """The same as on a line."""
        return self.density(wavenumber)

    def plane_power_within(self, wavenumber: float) -> float:
        """Share of the power at wave vectors shorter than `wavenumber`."""
        return -math.expm1(-((wavenumber * self.correlation_length / 2.0) ** 2))

    def _plane_quantile(self, share: float) -> float:
        return 2.0 / self.correlation_length * math.sqrt(-math.log1p(-share))

    def untruncated_correlation(self, lag: Array) -> Array:
        """exp(-(lag/xi_0)^2)."""
        result: Array = np.exp(-((np.asarray(lag) / self.correlation_length) ** 2))
        return result


@model
class ExponentialSpectrum(_ScaledSpectrum):
    """Correlation exp(-|x|/xi_0): g(k) ~ 1/(1 + (k xi_0)^2). A rough field.

    Parameters
    ----------
    correlation_length : float
        xi_0, m: here the correlation of z would be 1/e at xi_0 without truncation.
    truncation : float, optional
        Truncation in multiples of 2 pi/xi_0.
    power_kept : float, optional
        Share of the power kept by truncation; 0.99 if neither is given, since the spectrum
        falls slowly and every further nine takes ten times as many modes.

    Examples
    --------
    >>> import stiction as st
    >>> spectrum = st.ExponentialSpectrum(correlation_length=2e-3)
    >>> round(spectrum.with_efolding_length(1e-3).efolding_length * 1e3, 6)  # mm
    1.0
    """

    correlation_length: Positive
    truncation: Positive | None = None
    power_kept: Share | None = None
    type: Literal["exponential"] = "exponential"

    _default_power: ClassVar[float] = 0.99

    @model_validator(mode="after")
    def _truncated_once(self) -> ExponentialSpectrum:
        _one_truncation(self.truncation, self.power_kept)
        return self

    def density(self, wavenumber: Array) -> Array:
        """g(k)/g(0) at k in rad/m."""
        result: Array = 1.0 / (1.0 + (np.asarray(wavenumber) * self.correlation_length) ** 2)
        return result

    def power_within(self, wavenumber: float) -> float:
        """Share of the power below `wavenumber`."""
        return 2.0 / math.pi * math.atan(wavenumber * self.correlation_length)

    def _power_quantile(self, share: float) -> float:
        return math.tan(share * math.pi / 2.0) / self.correlation_length

    def plane_density(self, wavenumber: Array) -> Array:
        """(1 + (k xi_0)^2)^(-3/2)."""
        ratio = np.asarray(wavenumber) * self.correlation_length
        result: Array = (1.0 + ratio * ratio) ** -1.5
        return result

    def plane_power_within(self, wavenumber: float) -> float:
        """Share of the power at wave vectors shorter than `wavenumber`."""
        return 1.0 - 1.0 / math.hypot(1.0, wavenumber * self.correlation_length)

    def _plane_quantile(self, share: float) -> float:
        return math.sqrt((1.0 - share) ** -2 - 1.0) / self.correlation_length

    def untruncated_correlation(self, lag: Array) -> Array:
        """exp(-|lag|/xi_0)."""
        result: Array = np.exp(-np.abs(np.asarray(lag)) / self.correlation_length)
        return result


def _refuse_to_write(function: Any) -> Any:
    name = getattr(function, "__name__", repr(function))
    raise ValueError(f"spectrum.function is the Python function {name!r}; use a named spectrum")


LONGEST, SHORTEST = 1e-6, 1e12
"""Wavenumbers between which a spectrum of one's own is integrated octave by octave, rad/m."""


@model
class CustomSpectrum(_Spectrum):
    """A spectrum of your own: any g(k), up to a factor.

    Parameters
    ----------
    function : callable
        g(k): takes an array of wavenumbers (rad/m), returns an array, not negative, integrable.
        On a plane it is the density there, at wave vectors of length k, so that g(k) k must be
        integrable; a line cut through the plane then has another spectrum than g.
    max_wavenumber : float, optional
        Truncation, rad/m; by `power_kept` if left out.
    power_kept : float, optional
        Share of the power kept by truncation; 0.9997 if neither is given.
    break_points : sequence of float
        Wavenumbers (rad/m, positive) at which g jumps or has a peak. Lines and steps wider than
        1/4096 of an octave are found without; a narrower line needs its two ends here.

    Raises
    ------
    InputError
        If the function is not a density, or its integral does not settle.

    Notes
    -----
    For Python only: a study with a function of your own cannot be written to a file. The power,
    cumulative and truncated, comes from Legendre expansions that are compared with the function
    and refined until they agree to 1e-11 of the power.
    """

    function: Annotated[
        Callable[[Any], Any], PlainSerializer(_refuse_to_write), WithJsonSchema({"not": {}})
    ]
    max_wavenumber: Positive | None = None
    power_kept: Share | None = None
    break_points: tuple[Positive, ...] = ()
    type: Literal["custom"] = "custom"

    @model_validator(mode="after")
    def _is_a_density(self) -> CustomSpectrum:
        if self.max_wavenumber is not None and self.power_kept is not None:
            raise InputError("give max_wavenumber or power_kept, not both")
        probe = np.geomspace(1e-3, 1e6, 64)
        try:
            values = np.asarray(self.function(probe), dtype=np.float64)
        except Exception as error:
            raise InputError(f"function: fails on an array of wavenumbers: {error!r}") from None
        if values.shape != probe.shape or not np.all(np.isfinite(values)) or values.min() < 0.0:
            raise InputError("function: must map (m,) wavenumbers to (m,) finite values >= 0")
        pieces = _whole(self)
        if not 0.0 < pieces.total < np.inf:
            raise InputError("function: its integral over wavenumbers must be positive and finite")
        last = 1.0 - pieces.within(1e-3 * SHORTEST) / pieces.total
        if self.max_wavenumber is None and last > 1e-3:
            raise InputError(
                f"function: {100.0 * last:.2g} % of its power lie above {1e-3 * SHORTEST:g} rad/m:"
                " its integral does not converge; give max_wavenumber"
            )
        return self

    def _edges_to(self, end: float) -> Array:
        octaves = np.exp2(np.arange(math.log2(LONGEST), math.log2(SHORTEST)))
        inner = [k for k in (*octaves, *self.break_points) if k < end]
        return np.unique([0.0, *inner, end])

    @property
    def _edges(self) -> Array:
        return self._edges_to(self.cutoff)

    def density(self, wavenumber: Array) -> Array:
        """g(k) at k in rad/m, up to a factor."""
        return np.array(self.function(np.asarray(wavenumber)), dtype=np.float64)

    def power_integral(self, wavenumber: float) -> float:
        """Integral of g from 0 to `wavenumber`, or to `max_wavenumber` if that is less."""
        return _whole(self).within(wavenumber)

    def power_within(self, wavenumber: float) -> float:
        """Share of the power below `wavenumber`, of that below `max_wavenumber` if given."""
        return min(self.power_integral(wavenumber) / _whole(self).total, 1.0)

    @property
    def cutoff(self) -> float:
        """Wavenumber above which the spectrum is truncated, rad/m."""
        if self.max_wavenumber is not None:
            return self.max_wavenumber
        return _cutoff_of(self, 0.9997 if self.power_kept is None else self.power_kept)

    def plane_density(self, wavenumber: Array) -> Array:
        """g(k): of a spectrum of one's own it is the density of what it is used for."""
        return self.density(wavenumber)

    def plane_power_integral(self, wavenumber: float) -> float:
        """Integral of g(k) k from 0 to `wavenumber`, or to `max_wavenumber` if that is less."""
        return _whole_plane(self).within(wavenumber)

    def plane_power_within(self, wavenumber: float) -> float:
        """Share of the power at wave vectors shorter than `wavenumber`."""
        return min(self.plane_power_integral(wavenumber) / _whole_plane(self).total, 1.0)

    @property
    def plane_cutoff(self) -> float:
        """Length of wave vector above which the spectrum of a plane is truncated, rad/m."""
        if self.max_wavenumber is not None:
            return self.max_wavenumber
        return _plane_cutoff_of(self, 0.9997 if self.power_kept is None else self.power_kept)

    def untruncated_correlation(self, lag: Array) -> Array:
        """Correlation of the whole spectrum at `lag` (m), up to `max_wavenumber` if given."""
        pieces = _whole(self)
        result: Array = pieces.cosine(lag) / pieces.total
        return result


@lru_cache(maxsize=64)
def _whole(spectrum: CustomSpectrum) -> Pieces:
    end = SHORTEST if spectrum.max_wavenumber is None else spectrum.max_wavenumber
    return in_pieces(spectrum.density, spectrum._edges_to(end))


@lru_cache(maxsize=64)
def _cutoff_of(spectrum: CustomSpectrum, share: float) -> float:
    return spectrum._power_quantile(share)


@lru_cache(maxsize=64)
def _whole_plane(spectrum: CustomSpectrum) -> Pieces:
    end = SHORTEST if spectrum.max_wavenumber is None else spectrum.max_wavenumber
    return in_pieces(lambda k: k * spectrum.density(k), spectrum._edges_to(end))


@lru_cache(maxsize=64)
def _plane_cutoff_of(spectrum: CustomSpectrum, share: float) -> float:
    if 1.0 - spectrum.plane_power_within(1e-3 * SHORTEST) > 1e-3:
        raise InputError(
            "spectrum: on a plane the power of g(k) is the integral of g(k) k, which does not"
            " converge; give max_wavenumber"
        )
    return _quantile(spectrum.plane_power_within, share)


def _as_spectrum(value: Any) -> Any:
    if isinstance(value, type):
        raise InputError(f"must be a spectrum such as st.{value.__name__}(...), got the class")
    if callable(value) and not isinstance(value, _Spectrum):
        return CustomSpectrum(function=value)
    return value


Spectrum: TypeAlias = Annotated[
    Annotated[
        PowerLawSpectrum | SquaredExponentialSpectrum | ExponentialSpectrum | CustomSpectrum,
        Field(discriminator="type"),
    ],
    BeforeValidator(_as_spectrum),
]
"""Any of the spectra above, or a function g(k)."""

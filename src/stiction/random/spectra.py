"""Power spectral densities of the underlying Gaussian field, on lines and on planes.

With a density g(k), the correlation of z on a line at the lag x is

    rho(x) = int_0^K g(k) cos(k x) dk / int_0^K g(k) dk,                                      (1)

where K is the largest wavenumber. Samples have the truncated spectrum,
so correlations and lengths refer to this spectrum too.

1. Integrate (1) octave by octave, because densities span decades, with
   QUADPACK's rule for a cosine (R. Piessens, E. de Doncker-Kapenga, C.
   Ueberhuber and D. Kahaner, QUADPACK, 1983) (`_integrate`).
2. Find the length at which the correlation falls to 1/e by marching,
   then by a search (`lag_of_correlation`).

On a plane the field is isotropic, and along any straight line it has
the same correlation as a field on a line. Therefore, in D dimensions
the exponent of a power law in 1 + k^2 grows by (D - 1)/2, and a
Gaussian keeps its form.

To add a spectrum, write a subclass of `ScaledSpectrum` and `register` it.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from abc import abstractmethod
from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

import numpy as np
from pydantic import Field, PlainSerializer, model_validator
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import betainc, betaincinv, gammainc, gammainccinv, gammaln, kve

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.kinds import Kinds, OneOf, from_table, register
from stiction.base.model import Listed, Positive, Real, describe, model

LARGEST_CUTOFF = 1e4
"""Largest default truncation of a power law, in units of lambda."""

Share: TypeAlias = Annotated[Real, Field(gt=0, lt=1)]
Magnitude: TypeAlias = Annotated[Positive, Field(gt=1e-15, lt=1e15)]
"""Length, wavenumber, or ratio of two, whose powers do not underflow or
overflow."""
Kept: TypeAlias = Annotated[Share, Field(gt=1e-6)]
INTEGRAL_RTOL, MAX_INTEGRAL_ERROR = 1e-12, 1e-6  # requested and accepted errors of integrals


class SpectralDensity(Listed):
    """Base class for spectra on infinite lines (`dimensions` = 1) and planes (2)."""

    family: ClassVar[str] = "spectra"
    _shown: ClassVar[tuple[str, ...]] = ("correlation", "density", "efolding_length")

    @abstractmethod
    def density(self, wavenumber: Array, dimensions: int = 1) -> Array:
        """Return the density at wave vectors with length k (rad/m), up to a factor."""

    @abstractmethod
    def cutoff(self, dimensions: int = 1) -> float:
        """Return the wavenumber above which the spectrum is truncated, rad/m."""

    @property
    def scale(self) -> float:
        """Wavenumber (rad/m) at which the integration by octaves begins."""
        return 1e-6 * self.cutoff()

    def correlation(self, lag: Array) -> Array:
        """Return the correlation at `lag` (m) on a line, with truncation."""
        edges, power = _truncated(self)
        lags = np.abs(np.ravel(lag)).tolist()
        integrals = [_integrate(self, edges, lag=lag, power=power) for lag in lags]
        return np.reshape(integrals, np.shape(lag)) / power

    @property
    def efolding_length(self) -> float:
        """Distance, m, at which the correlation of z on a line first falls to 1/e."""
        return lag_of_correlation(self, math.exp(-1.0))


def _integrate(
    spectrum: SpectralDensity,
    edges: Array,
    order: int = 0,
    lag: float = 0.0,
    power: float = 0.0,
) -> float:
    """Step 1: return the integral of g(k) k^order cos(k lag) over all pieces (QUADPACK's QAWO).

    The tolerance is 1e-12 of `power`, or
    of each piece if `power` is not known.
    """
    options: dict[str, Any] = {"weight": "cos", "wvar": lag} if lag > 0.0 else {}
    options |= {"epsabs": INTEGRAL_RTOL * power, "epsrel": INTEGRAL_RTOL}
    options |= {"limit": 200, "full_output": 1}  # which silences warnings about the error

    def density(k: float) -> float:
        return float(spectrum.density(np.array([k]))[0]) * k**order

    pieces = [quad(density, a, b, **options)[:2] for a, b in itertools.pairwise(edges)]
    # QUADPACK estimates the error of each piece. Their sum bounds the
    # error of the integral.
    integrals, errors = np.array(pieces).T
    if not errors.sum() <= MAX_INTEGRAL_ERROR * (power or np.abs(integrals).sum()):
        raise InputError(
            "function: its integral over wavenumbers does not converge. Use a density that falls"
            " faster at large wavenumbers"
        )
    return float(integrals.sum())


@lru_cache(maxsize=256)
def _truncated(spectrum: SpectralDensity) -> tuple[Array, float]:
    """Return the ends of octaves up to the cutoff, rad/m, and the power below the cutoff."""
    scale, end = spectrum.scale, spectrum.cutoff()
    # From half the scale on, each piece ends at twice the wavenumber of
    # the piece before.
    octaves = scale * np.exp2(np.arange(-1, 1 + max(0, math.log2(end / scale))))
    edges = np.concatenate(([0.0], octaves[octaves < end], [end]))
    return edges, _integrate(spectrum, edges)


@lru_cache(maxsize=256)
def lag_of_correlation(spectrum: SpectralDensity, target: float) -> float:
    """Step 2: return the first lag (m) at which the correlation on a line falls to `target`."""
    # The slope of the correlation is at most the mean wavenumber.
    # Between lags that are close against the root mean square of the
    # wavelengths, it is nearly straight. March in such steps until it
    # is below the target, then search between the last two lags.
    edges, power = _truncated(spectrum)
    slope = _integrate(spectrum, edges, order=1) / power
    step = 0.25 * math.sqrt(power / _integrate(spectrum, edges, order=2))

    def excess(lag: float) -> float:
        return float(spectrum.correlation(np.array(lag))) - target

    before = lag = 0.0
    above = 1.0 - target
    while above > 0.0:
        before, lag = lag, lag + max(above / slope, step)
        above = excess(lag)
        step *= 1.005  # longer steps for spectra with little power near their truncation
    tight: Any = {"xtol": 1e-15, "rtol": 1e-14}
    return lag * brentq(lambda ratio: excess(ratio * lag), before / lag, 1.0, **tight)


@model
class ScaledSpectrum(SpectralDensity):
    """Base class for spectra with a single length: g depends only on k times this length.

    A subclass defines `density`, `power_within`, its inverse
    `quantile`, and `untruncated_correlation`. `stiction.fit_field` uses
    the latter to find the correlation length.
    """

    correlation_length: Magnitude
    power_kept: Kept | None = dataclasses.field(default=None, kw_only=True)
    _shown = "efolding_length", "with_efolding_length"
    default_power: ClassVar[float] = 0.9997
    """Fraction of the power retained by the default truncation."""

    @abstractmethod
    def power_within(self, wavenumber: float, dimensions: int = 1) -> float:
        """Return the fraction of the power at wave vectors shorter than `wavenumber` (rad/m)."""

    @abstractmethod
    def quantile(self, share: float, dimensions: int = 1) -> float:
        """Return the wavenumber (rad/m) below which a fraction of the power lies."""

    @abstractmethod
    def untruncated_correlation(self, lag: Array) -> Array:
        """Return the correlation of z on a line, without truncation, at `lag` (m, any shape)."""

    @property
    def scale(self) -> float:
        """Wavenumber, rad/m, with which all spectra of a class scale."""
        return 1.0 / self.correlation_length

    def cutoff(self, dimensions: int = 1) -> float:
        return self.quantile(self.power_kept or self.default_power, dimensions)

    @property
    def efolding_length(self) -> float:
        # Search once for each shape, as a sweep may hold a hundred
        # thousand lengths.
        unit = dataclasses.replace(self, correlation_length=1.0)
        return self.correlation_length * lag_of_correlation(unit, math.exp(-1.0))

    def with_efolding_length(self, length: float) -> Any:
        """Return a spectrum of the same shape whose z has the e-folding length `length` (m)."""
        xi = self.correlation_length * length / self.efolding_length
        return dataclasses.replace(self, correlation_length=xi)


class _PowerOfWavenumber(ScaledSpectrum):
    """Density (1 + (k/scale)^2)^-(exponent + (D - 1)/2)."""

    exponent = 1.0

    def density(self, wavenumber: Array, dimensions: int = 1) -> Array:
        ratio = wavenumber / self.scale
        return (1.0 + ratio * ratio) ** -(self.exponent + 0.5 * (dimensions - 1))

    def power_within(self, wavenumber: float, dimensions: int = 1) -> float:
        # The power is a beta integral in t = k^2/(scale^2 + k^2).
        ratio = (wavenumber / self.scale) ** 2
        return float(betainc(0.5 * dimensions, self.exponent - 0.5, ratio / (1.0 + ratio)))

    def quantile(self, share: float, dimensions: int = 1) -> float:
        # The complement 1 - t of the incomplete beta function avoids
        # cancellation for t near 1.
        complement = float(betaincinv(self.exponent - 0.5, 0.5 * dimensions, 1.0 - share))
        return self.scale * math.sqrt((1.0 - complement) / complement)


@register
@model
class PowerLawSpectrum(_PowerOfWavenumber):
    """Power-law spectrum g(k) ~ (k^2 + lambda^2)^-exponent, lambda = 2 pi/correlation_length.

    Parameters
    ----------
    correlation_length : float
        Correlation length xi_0 = 2 pi/lambda, m.
    exponent : float
        Exponent in [0.6, 64], 4 in Albertini et al. (2020, Eq. 4).
    power_kept : float, optional
        Fraction of the power retained by truncation, in (0, 1). By
        default the spectrum ends where 0.99969 of the power on a line
        is retained, but not below 2.5 lambda nor above 10,000 lambda. It
        ends at 2.5 lambda for the exponent 4 (as in the paper), at 11
        lambda for 2, and at 2,100 lambda for 1. Below an exponent of
        0.92, the upper limit retains less power.

    Notes
    -----
    On an infinite line or plane this is a Matern covariance with smoothness exponent - 1/2.

    Examples
    --------
    >>> import stiction as st
    >>> spectrum = st.PowerLawSpectrum(correlation_length=2e-3, exponent=2.0)
    >>> round(spectrum.with_efolding_length(1e-3).efolding_length * 1e3, 6)  # mm
    1.0
    """

    exponent: Annotated[Real, Field(ge=0.6, le=64.0)] = 4.0
    type: Literal["power_law"] = "power_law"
    default_power: ClassVar[float] = 0.99969

    @property
    def scale(self) -> float:
        """Wavenumber lambda = 2 pi/xi_0, rad/m, above which the density falls as a power law."""
        return 2.0 * math.pi / self.correlation_length

    def cutoff(self, dimensions: int = 1) -> float:
        if self.power_kept is None:
            # The same wavenumber on a line and on a plane.
            # A slow decay would need millions of modes for the last power.
            cutoff = max(2.5 * self.scale, self.quantile(self.default_power))
            return min(cutoff, LARGEST_CUTOFF * self.scale)
        return super().cutoff(dimensions)

    def untruncated_correlation(self, lag: Array) -> Array:
        order = self.exponent - 0.5
        a = np.abs(lag) * self.scale
        with np.errstate(divide="ignore", invalid="ignore"):
            log_value = (1.0 - order) * math.log(2.0) - gammaln(order) + order * np.log(a)
            log_value = log_value + np.log(kve(order, a)) - a
        # If the Bessel function overflows, a is so small that the
        # correlation is 1.
        return np.where(np.isfinite(log_value) & (a > 0.0), np.exp(log_value), 1.0)


@register
@model
class SquaredExponentialSpectrum(ScaledSpectrum):
    """Spectrum for the correlation exp(-(x/xi_0)^2): g(k) ~ exp(-(k xi_0/2)^2).

    Parameters
    ----------
    correlation_length : float
        Correlation length xi_0, m, at which the correlation of z is 1/e
        without truncation.
    power_kept : float, optional
        Fraction of the power to retain, by default 0.9997.
    """

    type: Literal["squared_exponential"] = "squared_exponential"

    def density(self, wavenumber: Array, dimensions: int = 1) -> Array:
        return np.asarray(np.exp(-((wavenumber * self.correlation_length / 2.0) ** 2)))

    def power_within(self, wavenumber: float, dimensions: int = 1) -> float:
        half = wavenumber * self.correlation_length / 2.0
        return float(gammainc(0.5 * dimensions, half * half))

    def quantile(self, share: float, dimensions: int = 1) -> float:
        square = float(gammainccinv(0.5 * dimensions, 1.0 - share))
        return 2.0 / self.correlation_length * math.sqrt(square)

    def untruncated_correlation(self, lag: Array) -> Array:
        return np.asarray(np.exp(-((lag / self.correlation_length) ** 2)))


@register
@model
class ExponentialSpectrum(_PowerOfWavenumber):
    """Spectrum for the correlation exp(-|x|/xi_0), a rough field: g(k) ~ 1/(1 + (k xi_0)^2).

    The parameters are the same as for `SquaredExponentialSpectrum`. By
    default 0.99 of the power is retained, because every further digit 9
    takes ten times as many modes.
    """

    type: Literal["exponential"] = "exponential"
    default_power: ClassVar[float] = 0.99

    def untruncated_correlation(self, lag: Array) -> Array:
        return np.asarray(np.exp(-np.abs(lag) / self.correlation_length))


def _refuse_to_write(function: Any) -> Any:
    name = getattr(function, "__name__", repr(function))
    raise ValueError(f"spectrum.function is the Python function {name!r}. Use a named spectrum")


@model
class CustomSpectrum(SpectralDensity):
    """User-defined spectrum for Python only: any g(k), up to a factor.

    Parameters
    ----------
    function : callable
        g(k), which takes an array of wavenumbers (rad/m) and returns an
        array without negative values. On a plane, g(k) is the density
        at wave vectors with length k.
    max_wavenumber : float
        Truncation, rad/m.
    """

    function: Annotated[Callable[[Any], Any], PlainSerializer(_refuse_to_write)]
    max_wavenumber: Magnitude
    type: Literal["custom"] = "custom"

    @model_validator(mode="after")
    def _is_a_density(self) -> CustomSpectrum:
        wavenumbers = self.max_wavenumber * np.linspace(0.0, 1.0, 64)
        try:
            values = self.density(wavenumbers)
        except Exception as error:
            raise InputError(f"function: fails on an array of wavenumbers: {error!r}") from None
        if values.shape != (64,) or not np.all(np.isfinite(values)) or values.min() < 0.0:
            raise InputError("function: must map (m,) wavenumbers to (m,) finite values >= 0")
        return self

    def density(self, wavenumber: Array, dimensions: int = 1) -> Array:
        return np.array(self.function(np.asarray(wavenumber)), dtype=np.float64)

    def cutoff(self, dimensions: int = 1) -> float:
        return self.max_wavenumber


SPECTRA = Kinds("spectra")
"""Spectra by their names in study files."""


def spectrum_of(value: Any) -> SpectralDensity:
    """Return a spectrum, given as a spectrum or a table {type, ...}."""
    if isinstance(value, SpectralDensity):
        return value
    if isinstance(value, dict):
        return from_table(SPECTRA, value)
    raise InputError(
        "must be a spectrum such as st.PowerLawSpectrum(...), not its class, or"
        f" st.CustomSpectrum(function=g, max_wavenumber=...), got {describe(value)}"
    )


Spectrum: TypeAlias = Annotated[SpectralDensity, OneOf(SPECTRA, spectrum_of), "Spectrum"]
"""Annotation of an argument that is a spectrum."""

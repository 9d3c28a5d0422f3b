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
        """Wavenumber (rad/m) at which the integration by octaves begins.

        >>> CustomSpectrum(np.ones_like, 3000.0).scale
        0.003
        """
        return 1e-6 * self.cutoff()

    def correlation(self, lag: Array) -> Array:
        """Return the correlation at `lag` (m) on a line, with truncation.

        A constant density up to K has the correlation sin(K x) / (K x).

        >>> spectrum = CustomSpectrum(lambda k: 7.0 + 0.0 * k, 4.0)
        >>> spectrum.correlation(np.array([[0.0, 0.3], [-0.3, 1.0]])).round(6).tolist()
        [[1.0, 0.776699], [0.776699, -0.189201]]
        >>> round(math.sin(1.2) / 1.2, 6), round(math.sin(4.0) / 4.0, 6)
        (0.776699, -0.189201)
        >>> length = spectrum.efolding_length
        >>> round(math.sin(4.0 * length) / (4.0 * length) * math.e, 9)
        1.0
        """
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

    >>> spectrum, edges = (
    ...     CustomSpectrum(lambda k: 7.0 + 0.0 * k, 4.0),
    ...     np.array([0.0, 1.0, 4.0]),
    ... )
    >>> [
    ...     round(_integrate(spectrum, edges, order), 9) for order in (0, 1, 2)
    ... ]  # 7 k^(m+1) / (m + 1)
    [28.0, 56.0, 149.333333333]
    >>> round(_integrate(spectrum, edges, lag=0.3, power=28.0), 9) == round(
    ...     7.0 / 0.3 * math.sin(1.2), 9
    ... )
    True
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
    """Return the ends of octaves up to the cutoff, rad/m, and the power below the cutoff.

    The density 1 / (1 + k^2) has the power arctan(K), and is truncated where
    99 % of pi/2 are kept.

    >>> edges, power = _truncated(ExponentialSpectrum(1.0))
    >>> edges[:-1].tolist(), round(float(edges[-1]), 5) == round(math.tan(0.495 * math.pi), 5)
    ([0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0], True)
    >>> round(power / math.pi, 9)
    0.495
    >>> _truncated(PowerLawSpectrum(2.0 * math.pi))[0].tolist()
    [0.0, 0.5, 1.0, 2.0, 2.5]
    >>> _truncated(SquaredExponentialSpectrum(1.0, power_kept=0.01))[0].round(6).tolist()
    [0.0, 0.017725]
    """
    scale, end = spectrum.scale, spectrum.cutoff()
    # From half the scale on, each piece ends at twice the wavenumber of
    # the piece before.
    octaves = scale * np.exp2(np.arange(-1, 1 + max(0, math.log2(end / scale))))
    edges = np.concatenate(([0.0], octaves[octaves < end], [end]))
    return edges, _integrate(spectrum, edges)


@lru_cache(maxsize=256)
def lag_of_correlation(spectrum: SpectralDensity, target: float) -> float:
    """Step 2: return the first lag (m) at which the correlation on a line falls to `target`.

    >>> spectrum = CustomSpectrum(lambda k: 7.0 + 0.0 * k, 4.0)
    >>> lag = lag_of_correlation(spectrum, 0.2)
    >>> round(math.sin(4.0 * lag) / (4.0 * lag), 9), 4.0 * lag < math.pi
    (0.2, True)

    This density has its power near 50 rad/m. The correlation oscillates,
    almost as exp(-x^2) cos(50 x), and 0.3 = cos(1.27) is first reached near
    50 x = 1.27:

    >>> narrow = CustomSpectrum(lambda k: np.exp(-0.25 * (k - 50.0) ** 2), 60.0)
    >>> lag = lag_of_correlation(narrow, 0.3)
    >>> round(50.0 * lag, 2), round(math.exp(-(lag**2)) * math.cos(50.0 * lag), 6)
    (1.27, 0.3)
    """
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
        """Wavenumber, rad/m, with which all spectra of a class scale.

        >>> SquaredExponentialSpectrum(0.25).scale, PowerLawSpectrum(0.5).scale / math.pi
        (4.0, 4.0)
        """
        return 1.0 / self.correlation_length

    def cutoff(self, dimensions: int = 1) -> float:
        """Return the wavenumber below which the kept power lies, rad/m.

        >>> spectrum = ExponentialSpectrum(0.5, power_kept=0.5)  # 2/pi arctan(k / 2) on a line
        >>> (
        ...     round(spectrum.cutoff(), 9),
        ...     round(spectrum.cutoff(2) ** 2, 9),
        ... )  # 1 - (1 + k^2/4)^-0.5
        (2.0, 12.0)
        >>> round(
        ...     SquaredExponentialSpectrum(0.5).power_within(
        ...         SquaredExponentialSpectrum(0.5).cutoff()
        ...     ),
        ...     9,
        ... )
        0.9997
        """
        return self.quantile(self.power_kept or self.default_power, dimensions)

    @property
    def efolding_length(self) -> float:
        # Search once for each shape, as a sweep may hold a hundred
        # thousand lengths.
        """Distance, m, at which the correlation of z first falls to 1/e. It scales with the length.

        >>> round(
        ...     PowerLawSpectrum(0.03).efolding_length / PowerLawSpectrum(1.0).efolding_length,
        ...     9,
        ... )
        0.03
        >>> round(SquaredExponentialSpectrum(0.03, power_kept=1 - 1e-12).efolding_length, 6)
        0.03
        """
        unit = dataclasses.replace(self, correlation_length=1.0)
        return self.correlation_length * lag_of_correlation(unit, math.exp(-1.0))

    def with_efolding_length(self, length: float) -> Any:
        """Return a spectrum of the same shape whose z has the e-folding length `length` (m).

        >>> spectrum = PowerLawSpectrum(
        ...     0.03, exponent=2.0, power_kept=0.9
        ... ).with_efolding_length(0.5)
        >>> round(spectrum.efolding_length, 9), spectrum.exponent, spectrum.power_kept
        (0.5, 2.0, 0.9)
        """
        xi = self.correlation_length * length / self.efolding_length
        return dataclasses.replace(self, correlation_length=xi)


class _PowerOfWavenumber(ScaledSpectrum):
    """Density (1 + (k/scale)^2)^-(exponent + (D - 1)/2)."""

    exponent = 1.0

    def density(self, wavenumber: Array, dimensions: int = 1) -> Array:
        """Return the density, here of the scale 2 and the exponent 1.5.

        >>> spectrum = PowerLawSpectrum(math.pi, exponent=1.5)  # scale 2
        >>> spectrum.density(np.array([0.0, 2.0])).round(6).tolist()
        [1.0, 0.353553]
        >>> spectrum.density(np.array([0.0, 2.0]), 2).round(6).tolist()
        [1.0, 0.25]
        """
        ratio = wavenumber / self.scale
        return (1.0 + ratio * ratio) ** -(self.exponent + 0.5 * (dimensions - 1))

    def power_within(self, wavenumber: float, dimensions: int = 1) -> float:
        # The power is a beta integral in t = k^2/(scale^2 + k^2).
        """Return the fraction of the power at shorter wave vectors.

        On a plane with the exponent n, the fraction is 1 - (1 + (k/scale)^2)^(1/2
        - n).

        >>> exponential, spectrum = (
        ...     ExponentialSpectrum(0.5),
        ...     PowerLawSpectrum(math.pi, exponent=2.0),
        ... )
        >>> (
        ...     round(exponential.power_within(2.0), 9),
        ...     round(exponential.power_within(12.0**0.5, 2), 9),
        ... )
        (0.5, 0.5)
        >>> round(spectrum.power_within(12.0**0.5, 2), 9)
        0.875
        """
        ratio = (wavenumber / self.scale) ** 2
        return float(betainc(0.5 * dimensions, self.exponent - 0.5, ratio / (1.0 + ratio)))

    def quantile(self, share: float, dimensions: int = 1) -> float:
        # The complement 1 - t of the incomplete beta function avoids
        # cancellation for t near 1.
        """Return the wavenumber below which a fraction of the power lies, as `power_within` says.

        >>> exponential, spectrum = (
        ...     ExponentialSpectrum(0.5),
        ...     PowerLawSpectrum(math.pi, exponent=2.0),
        ... )
        >>> round(exponential.quantile(0.5), 9), round(spectrum.quantile(0.875, 2) ** 2, 9)
        (2.0, 12.0)
        """
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
        """Return the wavenumber at the truncation, rad/m.

        With the exponent 2 on a plane, 0.875 is kept below 3^0.5 lambda.

        >>> scale = PowerLawSpectrum(0.1).scale
        >>> kept = PowerLawSpectrum(0.1, exponent=2.0, power_kept=0.875)
        >>> round((kept.cutoff(2) / scale) ** 2, 9)
        3.0
        >>> exponents = (4.0, 9.0, 0.6, 2.0)
        >>> ratios = [PowerLawSpectrum(0.1, exponent=n).cutoff() / scale for n in exponents]
        >>> [round(ratio, 9) for ratio in ratios[:3]], 10.5 < ratios[3] < 11.5
        ([2.5, 2.5, 10000.0], True)
        >>> PowerLawSpectrum(0.1, exponent=2.0).cutoff(2) / scale == ratios[3]
        True
        """
        if self.power_kept is None:
            # The same wavenumber on a line and on a plane.
            # A slow decay would need millions of modes for the last power.
            cutoff = max(2.5 * self.scale, self.quantile(self.default_power))
            return min(cutoff, LARGEST_CUTOFF * self.scale)
        return super().cutoff(dimensions)

    def untruncated_correlation(self, lag: Array) -> Array:
        """Return the Matern correlation.

        With a = lambda x, it is exp(-a) for the exponent 1, and (1 + a) exp(-a)
        for 2.

        >>> a = np.array([[0.0, 0.3], [-2.0, 1e-200]])
        >>> correlation = PowerLawSpectrum(math.pi, exponent=1.0).untruncated_correlation(
        ...     a / 2.0
        ... )
        >>> np.allclose(correlation, np.exp(-np.abs(a)))
        True
        >>> correlation = PowerLawSpectrum(math.pi, exponent=2.0).untruncated_correlation(
        ...     a / 2.0
        ... )
        >>> np.allclose(correlation, (1.0 + np.abs(a)) * np.exp(-np.abs(a)))
        True
        """
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
        """Return exp(-(k xi_0 / 2)^2).

        >>> SquaredExponentialSpectrum(0.5).density(np.array([0.0, 6.0])).round(6).tolist()
        [1.0, 0.105399]
        >>> round(math.exp(-2.25), 6)
        0.105399
        """
        return np.asarray(np.exp(-((wavenumber * self.correlation_length / 2.0) ** 2)))

    def power_within(self, wavenumber: float, dimensions: int = 1) -> float:
        """Return the fraction of the power at shorter wave vectors.

        With h = k xi_0 / 2, it is erf(h) on a line and 1 - exp(-h^2) on a plane.

        >>> spectrum = SquaredExponentialSpectrum(0.5)
        >>> math.isclose(spectrum.power_within(3.0), math.erf(0.75))
        True
        >>> math.isclose(spectrum.power_within(3.0, 2), 1.0 - math.exp(-0.5625))
        True
        """
        half = wavenumber * self.correlation_length / 2.0
        return float(gammainc(0.5 * dimensions, half * half))

    def quantile(self, share: float, dimensions: int = 1) -> float:
        """Return the wavenumber below which a fraction of the power lies, as `power_within` says.

        >>> spectrum = SquaredExponentialSpectrum(0.5)
        >>> (
        ...     round(spectrum.quantile(math.erf(0.75)), 9),
        ...     round(spectrum.quantile(1.0 - math.exp(-4.0), 2), 9),
        ... )
        (3.0, 8.0)
        """
        square = float(gammainccinv(0.5 * dimensions, 1.0 - share))
        return 2.0 / self.correlation_length * math.sqrt(square)

    def untruncated_correlation(self, lag: Array) -> Array:
        """Return exp(-(x / xi_0)^2).

        >>> SquaredExponentialSpectrum(0.5).untruncated_correlation(
        ...     np.array([0.0, -0.75])
        ... ).round(6).tolist()
        [1.0, 0.105399]
        """
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
        """Return exp(-|x| / xi_0).

        >>> ExponentialSpectrum(0.5).untruncated_correlation(np.array([0.0, -0.75])).round(
        ...     6
        ... ).tolist()
        [1.0, 0.22313]
        >>> round(math.exp(-1.5), 6)
        0.22313
        """
        return np.asarray(np.exp(-np.abs(lag) / self.correlation_length))


def _refuse_to_write(function: Any) -> Any:
    """Refuse to write a function to a study file.

    >>> _refuse_to_write(math.cos)
    Traceback (most recent call last):
    ...
    ValueError: spectrum.function is the Python function 'cos'. Use a named spectrum
    """
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
        """Return the values of the function as floats.

        >>> spectrum = CustomSpectrum(lambda k: (k < 3) * 2, 5.0)
        >>> spectrum.density([2, 4]).tolist(), spectrum.cutoff(), spectrum.cutoff(2)
        ([2.0, 0.0], 5.0, 5.0)
        """
        return np.array(self.function(np.asarray(wavenumber)), dtype=np.float64)

    def cutoff(self, dimensions: int = 1) -> float:
        return self.max_wavenumber


SPECTRA = Kinds("spectra")
"""Spectra by their names in study files."""


def spectrum_of(value: Any) -> SpectralDensity:
    """Return a spectrum, given as a spectrum or a table {type, ...}.

    >>> spectrum = spectrum_of(
    ...     {"type": "power_law", "correlation_length": 0.1, "exponent": 2.0}
    ... )
    >>> spectrum == PowerLawSpectrum(0.1, exponent=2.0), spectrum_of(spectrum) is spectrum
    (True, True)
    >>> spectrum_of(PowerLawSpectrum)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: must be a spectrum such as ... got ...PowerLawSpectrum...
    """
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

"""Power spectral densities of the underlying Gaussian field, on lines and on planes.

On a plane the field is isotropic, and a line cut through it has the correlation of the
field on a line. That fixes the density in D dimensions as a function of the length of the
wave vector (it is the inverse Abel transform of the line's): to the power of 1 + k^2 is
added (D - 1)/2, and a Gaussian stays what it is. What is sampled is the truncated
spectrum, so correlations and lengths are of that. To add a spectrum, derive from
`SpectralDensity`, or from `ScaledSpectrum` if it has one length, and add it to `SPECTRA`.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

import numpy as np
from pydantic import Field, PlainSerializer, WithJsonSchema, model_validator
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import betainc, betaincinv, gammainc, gammainccinv, gammaln, kve

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.kinds import OneOf, from_table
from stiction.model import Positive, Real, describe, model

Share: TypeAlias = Annotated[Real, Field(gt=0, lt=1)]
ACCURACY = 1e-12
LARGEST_ERROR = 1e-6
"""Error of integrals over wavenumbers that is aimed at, and that is accepted, of the power."""


class SpectralDensity(ABC):
    """Base class of spectra; `dimensions` is 1 on a line and 2 on a plane, both infinite.

    One of your own has `density`, `power_within` and its inverse `quantile`.
    """

    power_kept: float | None = None
    default_power: ClassVar[float] = 0.9997
    """Share of the power retained by truncation if nothing is given."""

    @abstractmethod
    def density(self, wavenumber: Array, dimensions: int = 1) -> Array:
        """Return the density at wave vectors of length k (rad/m), up to a factor."""

    @abstractmethod
    def power_within(self, wavenumber: float, dimensions: int = 1) -> float:
        """Return the share of the power at wave vectors shorter than `wavenumber` (rad/m)."""

    @abstractmethod
    def quantile(self, share: float, dimensions: int = 1) -> float:
        """Return the wavenumber (rad/m) below which a share of the power lies."""

    def _edges(self, end: float) -> Array:
        """Wavenumbers (rad/m) from 0 to `end` between which the density is smooth: octaves."""
        octaves = np.exp2(np.arange(math.log2(LONGEST), math.log2(SHORTEST)))
        return np.unique([0.0, *octaves[octaves < end], end])

    def cutoff(self, dimensions: int = 1) -> float:
        """Return the wavenumber above which the spectrum is truncated, rad/m."""
        share = self.default_power if self.power_kept is None else self.power_kept
        return self.quantile(share, dimensions)

    def correlation(self, lag: Array) -> Array:
        """Return the correlation of z at `lag` (m), truncation included, on a line."""
        edges, power = _truncated(self)
        density = moment(self, 0)
        found = [
            integrate(density, edges, float(one), power).sum() for one in np.abs(np.ravel(lag))
        ]
        return np.reshape(found, np.shape(lag)) / power

    @property
    def efolding_length(self) -> float:
        """Distance at which the correlation of z first falls to 1/e, m, on a line."""
        return lag_of_correlation(self, math.exp(-1.0))


def integrate(
    density: Callable[[float], float], edges: Array, lag: float = 0.0, power: float = math.inf
) -> Array:
    """Integrate a density times cos(k lag) over each interval between `edges`.

    `lag` (m) may be any number of periods (QUADPACK's QAWO). `power`, if known, decides
    which errors are small: 1e-12 of it, and of each part otherwise.
    """
    options: dict[str, Any] = {"weight": "cos", "wvar": lag} if lag > 0.0 else {}
    options |= {"limit": 200, "epsrel": ACCURACY, "full_output": 1}
    options["epsabs"] = ACCURACY * power if math.isfinite(power) else 0.0
    parts = [quad(density, a, b, **options)[:2] for a, b in itertools.pairwise(edges)]
    found, errors = np.array(parts).T
    size = min(power, float(np.abs(found).sum()))
    if not np.all(np.isfinite(found)) or errors.sum() > LARGEST_ERROR * size:
        raise InputError(
            "function: its integral over wavenumbers does not settle; name the wavenumbers at which"
            " it jumps or peaks in break_points"
        )
    return np.asarray(found)


def moment(spectrum: SpectralDensity, order: int) -> Callable[[float], float]:
    """Return the density on a line times a power of the wavenumber, as a function of that."""
    return lambda k: float(spectrum.density(np.array([k]))[0]) * k**order


@lru_cache(maxsize=256)
def _truncated(spectrum: SpectralDensity) -> tuple[Array, float]:
    """Edges of intervals up to the cutoff, rad/m, and the power below it, up to a factor."""
    edges = spectrum._edges(spectrum.cutoff())
    return edges, float(integrate(moment(spectrum, 0), edges).sum())


@lru_cache(maxsize=256)
def lag_of_correlation(spectrum: SpectralDensity, target: float) -> float:
    """Return the first lag at which the correlation of z on a line falls to `target`, m."""
    edges, power = _truncated(spectrum)
    first, second = (float(integrate(moment(spectrum, m), edges).sum()) for m in (1, 2))
    slope, step = first / power, 0.25 * math.sqrt(power / second)
    before = lag = 0.0
    excess = 1.0 - target
    while excess > 0.0:
        # The correlation falls no faster than by the mean wavenumber, and is nearly straight
        # between lags that are close against the root mean square of the wavelengths.
        before, lag = lag, lag + max(excess / slope, step)
        excess = float(spectrum.correlation(np.array(lag))) - target
        step *= 1.005  # for spectra whose power sits far below their truncation
    root: float = brentq(
        lambda ratio: float(spectrum.correlation(np.array(ratio * lag))) - target,
        before / lag, 1.0, xtol=1e-15, rtol=1e-14,
    )  # fmt: skip
    return root * lag


@model
class ScaledSpectrum(SpectralDensity):
    """Base class of spectra with one length: g depends on k times it only."""

    correlation_length: Positive
    truncation: Positive | None = dataclasses.field(default=None, kw_only=True)
    power_kept: Share | None = dataclasses.field(default=None, kw_only=True)

    @model_validator(mode="after")
    def _consistent(self) -> Any:
        if not 1e-100 < self.correlation_length < 1e100:  # else its inverse or square overflows
            raise InputError(
                "correlation_length: must lie between 1e-100 and 1e+100 m, got"
                f" {self.correlation_length:g}"
            )
        if self.truncation is not None and self.power_kept is not None:
            raise InputError("give truncation or power_kept, not both")
        return self

    @property
    def scale(self) -> float:
        """Wavenumber in units of which the density is one function, rad/m."""
        return 1.0 / self.correlation_length

    def _edges(self, end: float) -> Array:
        octaves = self.scale * np.exp2(np.arange(-1, 1 + max(0, math.log2(end / self.scale))))
        return np.concatenate(([0.0], octaves[octaves < end], [end]))

    def cutoff(self, dimensions: int = 1) -> float:
        if self.truncation is not None:
            return self.truncation * 2.0 * math.pi / self.correlation_length
        return super().cutoff(dimensions)

    @property
    def efolding_length(self) -> float:
        """Distance at which the correlation of z first falls to 1/e, m, on a line."""
        # Searched for once a shape: a sweep may hold a hundred thousand lengths.
        unit = dataclasses.replace(self, correlation_length=1.0)
        return self.correlation_length * lag_of_correlation(unit, math.exp(-1.0))

    def with_efolding_length(self, length: float) -> Any:
        """Return the same shape of spectrum whose correlation of z falls to 1/e at `length` (m)."""
        xi = self.correlation_length * length / self.efolding_length
        return dataclasses.replace(self, correlation_length=xi)


class _PowerOfWavenumber(ScaledSpectrum):
    """Density (1 + (k/scale)^2)^-(exponent + (D - 1)/2)."""

    exponent = 1.0

    def density(self, wavenumber: Array, dimensions: int = 1) -> Array:
        ratio = np.asarray(wavenumber) / self.scale
        result: Array = (1.0 + ratio * ratio) ** -(self.exponent + 0.5 * (dimensions - 1))
        return result

    def power_within(self, wavenumber: float, dimensions: int = 1) -> float:
        ratio = (wavenumber / self.scale) ** 2
        return float(betainc(0.5 * dimensions, self.exponent - 0.5, ratio / (1.0 + ratio)))

    def quantile(self, share: float, dimensions: int = 1) -> float:
        # 1 - t of the incomplete beta function above, without cancellation where t is nearly 1.
        rest = float(betaincinv(self.exponent - 0.5, 0.5 * dimensions, 1.0 - share))
        return self.scale * math.sqrt((1.0 - rest) / rest)


@model
class PowerLawSpectrum(_PowerOfWavenumber):
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
        Share of the power retained by truncation, in (0, 1).

    Notes
    -----
    On an infinite line this is a Matern covariance of smoothness exponent - 1/2, and on a
    plane the same with the density (k^2 + lambda^2)^-(exponent + 1/2).

    Examples
    --------
    >>> import stiction as st
    >>> spectrum = st.PowerLawSpectrum(correlation_length=2e-3, exponent=2.0)
    >>> round(spectrum.with_efolding_length(1e-3).efolding_length * 1e3, 6)  # mm
    1.0
    """

    exponent: Annotated[Real, Field(ge=0.6, le=64.0)] = 4.0
    type: Literal["power_law"] = "power_law"

    @property
    def scale(self) -> float:
        """lambda = 2 pi/xi_0, rad/m: the density falls as a power law above it."""
        return 2.0 * math.pi / self.correlation_length

    def cutoff(self, dimensions: int = 1) -> float:
        if self.truncation is None and self.power_kept is None:
            return 2.5 * self.scale
        return super().cutoff(dimensions)

    def untruncated_correlation(self, lag: Array) -> Array:
        order = self.exponent - 0.5
        a = np.abs(np.asarray(lag, dtype=np.float64)) * self.scale
        with np.errstate(divide="ignore", invalid="ignore"):
            log_value = (1.0 - order) * math.log(2.0) - gammaln(order) + order * np.log(a)
            log_value = log_value + np.log(kve(order, a)) - a
        # Where the Bessel function overflows, a is so small that the correlation is 1.
        return np.where(np.isfinite(log_value) & (a > 0.0), np.exp(log_value), 1.0)


@model
class SquaredExponentialSpectrum(ScaledSpectrum):
    """Correlation exp(-(x/xi_0)^2): g(k) ~ exp(-(k xi_0/2)^2).

    Parameters
    ----------
    correlation_length : float
        xi_0, m: without truncation the correlation of z is 1/e there.
    truncation, power_kept : float, optional
        Truncation in multiples of 2 pi/xi_0, or the share of the power that is retained;
        the default retains 0.9997.
    """

    type: Literal["squared_exponential"] = "squared_exponential"

    def density(self, wavenumber: Array, dimensions: int = 1) -> Array:
        result: Array = np.exp(-((np.asarray(wavenumber) * self.correlation_length / 2.0) ** 2))
        return result

    def power_within(self, wavenumber: float, dimensions: int = 1) -> float:
        half = wavenumber * self.correlation_length / 2.0
        return float(gammainc(0.5 * dimensions, half * half))

    def quantile(self, share: float, dimensions: int = 1) -> float:
        square = float(gammainccinv(0.5 * dimensions, 1.0 - share))
        return 2.0 / self.correlation_length * math.sqrt(square)

    def untruncated_correlation(self, lag: Array) -> Array:
        result: Array = np.exp(-((np.asarray(lag) / self.correlation_length) ** 2))
        return result


@model
class ExponentialSpectrum(_PowerOfWavenumber):
    """Correlation exp(-|x|/xi_0): g(k) ~ 1/(1 + (k xi_0)^2). A rough field.

    The parameters are those of `SquaredExponentialSpectrum`, but 0.99 of the power is
    retained by default, since every further nine takes ten times as many modes.
    """

    type: Literal["exponential"] = "exponential"

    default_power: ClassVar[float] = 0.99

    def untruncated_correlation(self, lag: Array) -> Array:
        result: Array = np.exp(-np.abs(np.asarray(lag)) / self.correlation_length)
        return result


LONGEST, SHORTEST = 1e-6, 1e12
"""Wavenumbers between which a spectrum of one's own is integrated octave by octave, rad/m."""


def _refuse_to_write(function: Any) -> Any:
    name = getattr(function, "__name__", repr(function))
    raise ValueError(f"spectrum.function is the Python function {name!r}; use a named spectrum")


@model
class CustomSpectrum(SpectralDensity):
    """User-defined spectrum: any g(k), up to a factor.

    Parameters
    ----------
    function : callable
        g(k): takes an array of wavenumbers (rad/m), returns an array, not negative,
        integrable. On a plane it is the density there, at wave vectors of length k, so that
        g(k) k must be integrable; a line cut through the plane then has another spectrum
        than g.
    max_wavenumber : float, optional
        Truncation, rad/m; by `power_kept` if left out.
    power_kept : float, optional
        Share of the power retained by truncation; 0.9997 if neither is given.
    break_points : sequence of float
        Wavenumbers (rad/m, positive) at which g jumps or has a peak. Anything narrower than
        a tenth of an octave needs its two ends here, or it may be missed.

    Notes
    -----
    It exists in Python only: a study with a function cannot be written to a file. The
    function is integrated by adaptive quadrature (`scipy.integrate.quad`), octave by octave.
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
        try:
            values = self.density(np.geomspace(1e-3, 1e6, 64))
        except Exception as error:
            raise InputError(f"function: fails on an array of wavenumbers: {error!r}") from None
        if values.shape != (64,) or not np.all(np.isfinite(values)) or values.min() < 0.0:
            raise InputError("function: must map (m,) wavenumbers to (m,) finite values >= 0")
        _cumulative(self, 1)
        return self

    def _edges(self, end: float) -> Array:
        return np.unique([*super()._edges(end), *(k for k in self.break_points if k < end)])

    def density(self, wavenumber: Array, dimensions: int = 1) -> Array:
        return np.array(self.function(np.asarray(wavenumber)), dtype=np.float64)

    def power_within(self, wavenumber: float, dimensions: int = 1) -> float:
        edges, sums = _cumulative(self, dimensions)
        end = min(wavenumber, float(edges[-1]))
        before = max(int(np.searchsorted(edges, end)) - 1, 0)
        part = integrate(moment(self, dimensions - 1), np.array([edges[before], end]))
        return min(float((sums[before] + part[0]) / sums[-1]), 1.0)

    def quantile(self, share: float, dimensions: int = 1) -> float:
        edges, sums = _cumulative(self, dimensions)
        above = int(np.searchsorted(sums, share * sums[-1]))
        root: float = brentq(
            lambda k: self.power_within(k, dimensions) - share,
            edges[above - 1], edges[above], xtol=1e-300,
        )  # fmt: skip
        return root

    def cutoff(self, dimensions: int = 1) -> float:
        return self.max_wavenumber or super().cutoff(dimensions)


@lru_cache(maxsize=64)
def _cumulative(spectrum: CustomSpectrum, dimensions: int) -> tuple[Array, Array]:
    """Edges of octaves, rad/m, and the power below each, up to a factor."""
    edges = spectrum._edges(spectrum.max_wavenumber or SHORTEST)
    sums = np.cumsum([0.0, *integrate(moment(spectrum, dimensions - 1), edges)])
    if not 0.0 < sums[-1] < np.inf:
        raise InputError("function: its integral over wavenumbers must be positive and finite")
    last = 1.0 - np.interp(1e-3 * SHORTEST, edges, sums) / sums[-1]
    if spectrum.max_wavenumber is None and last > 1e-3:
        raise InputError(
            f"function: {100.0 * last:.2g} % of its power lies above {1e-3 * SHORTEST:g}"
            f" rad/m: the integral of g(k){' k' * (dimensions - 1)} does not converge;"
            " give max_wavenumber"
        )
    return edges, sums


SPECTRA: dict[str, Any] = {
    kind.type: kind
    for kind in (PowerLawSpectrum, SquaredExponentialSpectrum, ExponentialSpectrum)
}
"""By their names in study files."""


def spectrum_of(value: Any) -> SpectralDensity:
    """Return the spectrum of one, of a table {type, ...}, or of a function g(k)."""
    if isinstance(value, SpectralDensity):
        return value
    if isinstance(value, dict):
        found: SpectralDensity = from_table(SPECTRA, value)
        return found
    if callable(value) and not isinstance(value, type):
        return CustomSpectrum(function=value)
    raise InputError(
        "must be a spectrum such as st.PowerLawSpectrum(...), not its class, or a function g(k),"
        f" got {describe(value)}"
    )


Spectrum: TypeAlias = Annotated[Any, OneOf(SPECTRA, spectrum_of)]
"""Any of the spectra above, or a function g(k)."""

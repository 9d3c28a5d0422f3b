"""Named power spectral densities of the underlying Gaussian field.

On a plane the field is isotropic, and a line cut through it has the correlation of the field on a
line. That makes the density on the plane, as a function of the length of the wave vector, the
inverse Abel transform of the line's: with the power of (1 + k^2) less by a half where the line's is
a power of that, and the same where it is Gaussian.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

import numpy as np
from pydantic import BeforeValidator, Field, model_validator
from scipy.special import betainc, betaincinv, erf, erfinv, gammaln, kve

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import Positive, _number, model
from stiction.random.custom_spectrum import CustomSpectrum
from stiction.random.spectral_density import ScaledSpectrum, Share, SpectralDensity, one_truncation


@model
class PowerLawSpectrum(ScaledSpectrum):
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
        one_truncation(self.truncation, self.power_kept)
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
class SquaredExponentialSpectrum(ScaledSpectrum):
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
        one_truncation(self.truncation, self.power_kept)
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
class ExponentialSpectrum(ScaledSpectrum):
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
        one_truncation(self.truncation, self.power_kept)
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


def _as_spectrum(value: Any) -> Any:
    if isinstance(value, type):
        raise InputError(f"must be a spectrum such as st.{value.__name__}(...), got the class")
    if callable(value) and not isinstance(value, SpectralDensity):
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

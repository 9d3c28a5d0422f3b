"""Marginals in engineers' parameters: mean and coefficient of variation of what is measured.

In each of them `mean` is the mean of the field and `cv` its standard deviation over its mean,
whatever the bound: the lower bound `low` shifts nothing but the shape. scipy's own parameters
(shapes, loc, scale) follow from them.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np
import scipy.stats
from pydantic import model_validator
from scipy.optimize import brentq, root
from scipy.special import gammaln

from stiction.errors import InputError
from stiction.model import Positive, Real, model


@model(kw_only=True)
class _MeanAndCov:
    """Families above a lower bound, known by mean and coefficient of variation."""

    mean: Positive
    cv: Positive
    low: Real = 0.0

    @model_validator(mode="after")
    def _above_low(self) -> Self:
        if not self.mean > self.low:
            raise InputError(f"mean must be above low, got mean={self.mean:g}, low={self.low:g}")
        return self

    @property
    def _excess(self) -> float:
        """Mean above the lower bound."""
        return self.mean - self.low

    @property
    def _ratio(self) -> float:
        """Standard deviation over the mean above the lower bound."""
        return self.cv * abs(self.mean) / self._excess


@model(kw_only=True)
class Lognormal(_MeanAndCov):
    """Lognormal distribution above `low`.

    Parameters
    ----------
    mean : float
        Mean of the field, such as 0.6e6 Pa; above `low`.
    cv : float
        Standard deviation over mean, positive.
    low : float
        Lower bound, 0 if left out.

    Raises
    ------
    InputError
        If the mean is not above the bound.

    Examples
    --------
    >>> import stiction as st
    >>> round(st.Lognormal(mean=1e6, cv=0.2, low=0.3e6).distribution.std())
    200000
    """

    type: Literal["lognormal"] = "lognormal"

    @cached_property
    def distribution(self) -> Any:
        """The same as a frozen `scipy.stats` distribution."""
        shape = math.sqrt(math.log1p(self._ratio**2))
        scale = self._excess / math.sqrt(1.0 + self._ratio**2)
        return scipy.stats.lognorm(shape, self.low, scale)


@model(kw_only=True)
class Weibull(_MeanAndCov):
    """Weibull distribution (of minima) above `low`.

    Parameters
    ----------
    mean : float
        Mean of the field; above `low`.
    cv : float
        Standard deviation over mean, positive.
    low : float
        Lower bound, 0 if left out.

    Raises
    ------
    InputError
        If the mean is not above the bound.
    """

    type: Literal["weibull"] = "weibull"

    @model_validator(mode="after")
    def _as_wide_as_can_be_solved(self) -> Weibull:
        if not 1e-3 < self._ratio < 10.0:
            raise InputError(
                "cv: the standard deviation over the mean above low must lie between 0.001 and"
                f" 10, got {self._ratio:g}"
            )
        return self

    @cached_property
    def distribution(self) -> Any:
        """The same as a frozen `scipy.stats` distribution."""

        def excess(log_shape: float) -> float:
            inverse = math.exp(-log_shape)
            spread = gammaln(1.0 + 2.0 * inverse) - 2.0 * gammaln(1.0 + inverse)
            return float(math.expm1(spread)) - self._ratio**2

        # The ratio falls from 10 to 0.001 as the shape rises from 0.2 to 1300.
        shape = math.exp(brentq(excess, math.log(0.15), math.log(2e3), xtol=1e-14))
        scale = self._excess / math.exp(gammaln(1.0 + 1.0 / shape))
        return scipy.stats.weibull_min(shape, self.low, scale)


@model(kw_only=True)
class Gamma(_MeanAndCov):
    """Gamma distribution above `low`.

    Parameters
    ----------
    mean : float
        Mean of the field; above `low`.
    cv : float
        Standard deviation over mean, positive.
    low : float
        Lower bound, 0 if left out.

    Raises
    ------
    InputError
        If the mean is not above the bound.
    """

    type: Literal["gamma"] = "gamma"

    @cached_property
    def distribution(self) -> Any:
        """The same as a frozen `scipy.stats` distribution."""
        shape = self._ratio**-2
        return scipy.stats.gamma(shape, self.low, self._excess / shape)


@model(kw_only=True)
class TruncatedNormal:
    """Normal distribution cut off at `low` and `high`.

    Parameters
    ----------
    mean : float
        Mean of the field, that is after the cut; between `low` and `high`.
    cv : float
        Standard deviation over mean, after the cut, positive.
    low : float
        0 if left out.
    high : float, optional
        None if left out.

    Raises
    ------
    InputError
        If the bounds are not in order, or no cut normal distribution has these moments: it is less
        scattered than an exponential, or between two bounds a uniform, distribution.
    """

    mean: Real
    cv: Positive
    low: Real = 0.0
    high: Real | None = None
    type: Literal["truncated_normal"] = "truncated_normal"

    @model_validator(mode="after")
    def _ordered(self) -> TruncatedNormal:
        top = math.inf if self.high is None else self.high
        if not self.low < self.mean < top:
            raise InputError(
                f"mean must lie between low and high, got low={self.low:g}, mean={self.mean:g},"
                f" high={top:g}"
            )
        _ = self.distribution
        return self

    @cached_property
    def distribution(self) -> Any:
        """The same as a frozen `scipy.stats` distribution."""
        deviation = self.cv * abs(self.mean)
        top = math.inf if self.high is None else self.high
        excess, room = self.mean - self.low, top - self.mean

        def moments(guess: Any) -> Any:
            centre, width = self.mean + deviation * guess[0], deviation * math.exp(guess[1])
            a, b = (self.low - centre) / width, (top - centre) / width
            try:
                mean, variance = scipy.stats.truncnorm.stats(a, b, centre, width)
            except (FloatingPointError, ValueError):
                return np.array([1e3, 1e3])
            return np.array([(mean - self.mean) / deviation, np.sqrt(variance) / deviation - 1.0])

        possible = deviation < excess and deviation**2 < excess * room / 2.0
        found = root(moments, [0.0, 0.0], tol=1e-12) if possible else None
        if found is None or not np.abs(moments(found.x)).max() < 1e-8:
            raise InputError(
                f"no normal distribution cut at low={self.low:g} and high={top:g} has"
                f" mean={self.mean:g} and cv={self.cv:g}: it would have to be wider than the cut"
                " leaves; lower cv or the bound, or take st.Lognormal or st.Beta"
            )
        centre = self.mean + deviation * float(found.x[0])
        width = deviation * math.exp(float(found.x[1]))
        a, b = (self.low - centre) / width, (top - centre) / width
        return scipy.stats.truncnorm(a, b, centre, width)


FAMILIES: dict[str, Any] = {
    "lognormal": Lognormal,
    "weibull": Weibull,
    "gamma": Gamma,
    "truncated_normal": TruncatedNormal,
}
"""By their names in study files. 'gamma' is scipy's where scipy's parameters are given."""

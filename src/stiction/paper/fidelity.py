"""Few dear runs and many cheap ones of the same samples: control variates for mean and quantiles.

The dear result of sample i is Y_i for i < n, the cheap one X_i for i < N. What the cheap method
gets right is averaged over all N samples, what it gets wrong over the n dear ones only
(Peherstorfer, Willcox and Gunzburger, 2016, with two levels).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stiction._typing import Array
from stiction.statistics.estimates import Estimate


@dataclass(frozen=True)
class Combined:
    """An estimate from both, and what it is worth.

    Attributes
    ----------
    estimate : Estimate
    plain_error : float
        Standard error of the dear runs by themselves.
    """

    estimate: Estimate
    plain_error: float

    @property
    def saving(self) -> float:
        """How many times as many dear runs plain sampling would need for the same error."""
        return (self.plain_error / self.estimate.error) ** 2


def _weight(dear: Array, cheap: Array) -> float:
    spread = float(cheap.var(ddof=1))
    if spread == 0.0:
        return 0.0
    return float(np.cov(dear, cheap)[0, 1]) / spread


def combined_mean(dear: Array, cheap: Array) -> Combined:
    """Mean of the dear result.

    Parameters
    ----------
    dear : (n,) array
        Of samples 0 .. n - 1, at least three.
    cheap : (N,) array
        Of the same samples first, then of N - n more.

    Returns
    -------
    Combined

    Notes
    -----
    mean_n(Y - a X) + a mean_N(X) with a = Cov(X, Y)/Var(X); variance
    Var(Y - a X)/n + a^2 Var(X)/N, the covariance of the two terms vanishing for this a.
    """
    n, total = dear.size, cheap.size
    own = cheap[:n]
    weight = _weight(dear, own)
    rest = dear - weight * own
    value = float(rest.mean() + weight * cheap.mean())
    variance = float(rest.var(ddof=2)) / n + weight**2 * float(cheap.var(ddof=1)) / total
    return _combined(value, variance, float(dear.var(ddof=1)) / n)


def combined_quantiles(dear: Array, cheap: Array, probabilities: Array) -> list[Combined]:
    """Quantiles of the dear result; arguments as for `combined_mean`.

    Notes
    -----
    The same estimator for the distribution function at each level t: indicators Y <= t and
    a + b X <= t, a and b by regression; then inverted. The error of the quantile is that of the
    distribution function over the density, taken from the calibrated cheap results.
    """
    n, total = dear.size, cheap.size
    slope = _weight(dear, cheap[:n])
    alike = float(dear.mean()) + slope * (cheap - float(cheap[:n].mean()))
    levels = np.quantile(alike, np.linspace(0.0005, 0.9995, 301))
    share = np.empty(levels.size)
    variance = np.empty(levels.size)
    for i, level in enumerate(levels):
        y, x = (dear <= level).astype(float), (alike[:n] <= level).astype(float)
        weight = _weight(y, x)
        whole = float((alike <= level).mean())
        rest = y - weight * x
        share[i] = rest.mean() + weight * whole
        # No difference between so few indicators does not mean that there is none: Laplace's rule.
        least = (1.0 / (n + 2.0)) / n
        own = max(float(rest.var(ddof=1)) / n, least * min(1.0, 4.0 * whole * (1.0 - whole)))
        variance[i] = own + weight**2 * whole * (1.0 - whole) / total
    share = np.maximum.accumulate(np.clip(share, 0.0, 1.0))
    result = []
    for p in np.asarray(probabilities, dtype=float):
        at = min(int(np.searchsorted(share, p)), levels.size - 1)
        value = float(np.interp(p, share, levels))
        width = 0.05 * min(p, 1.0 - p) + 0.01
        low, high = np.quantile(alike, (max(p - width, 0.0), min(p + width, 1.0)))
        per_stress = (high - low) / (min(p + width, 1.0) - max(p - width, 0.0))
        plain = p * (1.0 - p) / n
        result.append(_combined(value, variance[at] * per_stress**2, plain * per_stress**2))
    return result


def _combined(value: float, variance: float, plain: float) -> Combined:
    return Combined(Estimate(value, math.sqrt(variance)), math.sqrt(plain))

"""Few dear runs and ever more cheaper ones: control variates for means and quantiles.

Sample i is the same whatever the method. The dear result of samples 0 .. n - 1 is Y, those of ever
cheaper methods X_1 of 0 .. N_1 - 1, X_2 of 0 .. N_2 - 1 and so on, n <= N_1 <= N_2 ... What a
method gets right about the next dearer one is averaged over all of its own samples, what it gets
wrong over those of the dearer one only (Peherstorfer, Willcox and Gunzburger, 2016).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.statistics.estimates import Estimate, as_sample


@dataclass(frozen=True)
class Combined:
    """An estimate from all methods, and what it is worth.

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


def _telescoped(dear: Array, chain: Sequence[Array], least: float = 0.0) -> tuple[float, float]:
    """Mean of `dear` and its variance; `least` bounds the variance of what a method misses.

    mean_n(Y - a X) + a E[X], a = Cov(X, Y)/Var(X), with E[X] from the rest of the chain in the same
    way; variance Var(Y - a X)/n + a^2 Var(E[X]): for this a the two terms do not covary.
    """
    n = dear.size
    if not chain:
        return float(dear.mean()), float(dear.var(ddof=1)) / n
    own = chain[0][:n]
    weight = _weight(dear, own)
    rest = dear - weight * own
    value, variance = _telescoped(chain[0], chain[1:], least)
    missed = max(float(rest.var(ddof=2)) / n, least / (n * (n + 2.0)))
    return float(rest.mean()) + weight * value, missed + weight**2 * variance


def combined_mean(dear: Any, *cheap: Any) -> Combined:
    """Mean of a dear result of few samples, with the help of cheaper ones of more.

    Such as onsets by `Rupture`, `Equilibrium` and `LocalCriterion` of samples of the same seed.

    Parameters
    ----------
    dear : (n,) array
        Of samples 0 .. n - 1, at least three.
    *cheap : (N_1,), (N_2,), ... arrays
        Of the same samples first and then of more, each at least as long as the one before.

    Returns
    -------
    Combined
        `estimate` with its `value` and standard `error`, `plain_error` of the dear results alone,
        and `saving`, how many times as many of these would give the same error.

    Raises
    ------
    InputError
        If there are fewer than three dear results, one is not finite, or cheaper results are fewer.

    Notes
    -----
    Linear control variates, one in the other (Peherstorfer, Willcox and Gunzburger, 2016).

    Examples
    --------
    >>> import stiction as st
    >>> found = st.combined_mean([1.0, 2.1, 2.9], [0.9, 2.0, 2.8, 1.7, 2.2, 1.9])
    >>> round(found.estimate.value, 3)
    2.017
    >>> found.estimate.error < found.plain_error
    True
    """
    dear, chain = as_sample(dear, 3), [as_sample(results, 3) for results in cheap]
    sizes = [dear.size, *(results.size for results in chain)]
    if sizes != sorted(sizes):
        raise InputError(
            f"cheap: each must have at least as many results as the one before, got {sizes} samples"
        )
    value, variance = _telescoped(dear, chain)
    plain = float(dear.var(ddof=1)) / dear.size
    return Combined(Estimate(value, math.sqrt(variance)), math.sqrt(plain))


def combined_quantiles(
    dear: Array, cheap: Sequence[Array], probabilities: Sequence[float] | Array
) -> list[Combined]:
    """Quantiles of the dear result; arguments as for `combined_mean`.

    Notes
    -----
    The same estimator for the distribution function at each level t, of indicators that a result is
    at most t, after each cheap result has been fitted to the next dearer one by regression; then
    inverted. The error of a quantile is that of the distribution function over the density, which
    comes from the cheapest results.
    """
    alike: list[Array] = []
    above = dear
    for results in cheap:
        own = results[: above.size]
        fitted = float(above.mean()) + _weight(above, own) * (results - float(own.mean()))
        alike.append(fitted)
        above = fitted
    many = np.sort(above)
    levels = np.quantile(many, np.linspace(0.0005, 0.9995, 301))
    found = [_share_below(dear, alike, level) for level in levels]
    share = np.maximum.accumulate(np.clip([value for value, _ in found], 0.0, 1.0))
    result = []
    for p in probabilities:
        at = min(int(np.searchsorted(share, p)), levels.size - 1)
        value = float(np.interp(p, share, levels))
        width = 0.05 * min(p, 1.0 - p) + 0.01
        low, high = max(p - width, 0.0), min(p + width, 1.0)
        between = float(np.subtract(*np.quantile(many, (high, low))))
        per_share = between / (high - low)
        error = math.sqrt(found[at][1]) * per_share
        plain = math.sqrt(p * (1.0 - p) / dear.size) * per_share
        result.append(Combined(Estimate(value, error), plain))
    return result


def _share_below(dear: Array, alike: Sequence[Array], level: float) -> tuple[float, float]:
    whole = float((alike[-1] <= level).mean())
    # That few indicators agree does not mean that all would (Laplace's rule of succession).
    least = min(1.0, 4.0 * whole * (1.0 - whole))
    chain = [(each <= level).astype(np.float64) for each in alike]
    return _telescoped((dear <= level).astype(np.float64), chain, least)

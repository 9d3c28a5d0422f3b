"""Few expensive runs and ever more inexpensive ones: control variates for means.

Sample i is the same whatever the method. The expensive result of samples 0 .. n - 1 is Y,
those of ever less expensive methods X_1 of 0 .. N_1 - 1, X_2 of 0 .. N_2 - 1 and so on,
n <= N_1 <= N_2 ... What a method gets right about the next more expensive one is averaged
over all of its own samples, what it gets wrong over those of the latter only (Peherstorfer,
Willcox and Gunzburger, 2016).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import stdtrit

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.statistics.estimates import Estimate, as_sample


@dataclass(frozen=True)
class Combined:
    """A mean from all methods: `estimate` with its `value` and standard `error`.

    `plain_error` is the standard error of the expensive results by themselves, `freedom`
    the number of degrees of freedom of the error.
    """

    estimate: Estimate
    plain_error: float
    freedom: int

    @property
    def saving(self) -> float:
        """How many times as many expensive results alone would have the same error."""
        return (self.plain_error / self.estimate.error) ** 2

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval by Student's distribution, in the unit of the values."""
        half = float(stdtrit(self.freedom, 0.5 + 0.5 * confidence)) * self.estimate.error
        return self.estimate.value - half, self.estimate.value + half


def combined_mean(expensive: Any, *inexpensive: Any) -> Combined:
    """Estimate the mean of an expensive result of few samples, with the help of others of more.

    Such as onsets by `Rupture`, `Equilibrium` and `LocalCriterion` of one seed.

    Parameters
    ----------
    expensive : (n,) array
        Of samples 0 .. n - 1, at least three.
    *inexpensive : (N_1,), (N_2,), ... arrays
        Of the same samples first and then of more, each at least as long as the one before.

    Returns
    -------
    Combined
        With `estimate`, `interval(confidence)`, `plain_error` and `saving`.

    Raises
    ------
    InputError
        If one is not finite, there are fewer than three expensive results, or fewer others.

    Notes
    -----
    Linear control variates, one in the other (Peherstorfer, Willcox and Gunzburger, 2016).
    With n expensive results the error has n - 2 degrees of freedom, since mean and weight
    are estimated from them: of few results, use the interval and not twice the error.

    Examples
    --------
    >>> import stiction as st
    >>> found = st.statistics.combined_mean([1.0, 2.1, 2.9], [0.9, 2.0, 2.8, 1.7, 2.2, 1.9])
    >>> round(found.estimate.value, 3)
    2.017
    >>> found.estimate.error < found.plain_error
    True
    """
    first, chain = as_sample(expensive, 3), [as_sample(one, 3) for one in inexpensive]
    sizes = [first.size, *(results.size for results in chain)]
    if sizes != sorted(sizes):
        raise InputError(
            f"inexpensive: each must have at least as many results as the one before, got {sizes}"
            " samples"
        )
    value, variance = _telescoped(first, chain)
    plain = math.sqrt(float(first.var(ddof=1)) / first.size)
    return Combined(
        Estimate(value, math.sqrt(variance)), plain, first.size - (2 if chain else 1)
    )


def _telescoped(results: Array, chain: Sequence[Array]) -> tuple[float, float]:
    """Return the mean of `results` and its variance.

    mean_n(Y - a X) + a E[X], a = Cov(X, Y)/Var(X), with E[X] from the rest of the chain in
    the same way; variance Var(Y - a X)/n + a^2 Var(E[X]): for this a the two terms do not
    covary.
    """
    if not chain:
        return float(results.mean()), float(results.var(ddof=1)) / results.size
    own = chain[0][: results.size]
    spread = float(own.var(ddof=1))
    weight = float(np.cov(results, own)[0, 1]) / spread if spread > 0.0 else 0.0
    rest = results - weight * own
    value, variance = _telescoped(chain[0], chain[1:])
    variance = float(rest.var(ddof=2)) / rest.size + weight**2 * variance
    return float(rest.mean()) + weight * value, variance

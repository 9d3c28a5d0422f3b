"""Marginals of values that carry measurement noise: maximum likelihood of the sum of both.

Values are counted in bins; the probability of a bin is that of the marginal, convolved with normal
noise by Gauss-Hermite quadrature of its distribution function, which stays smooth where a density
does not. So values that noise carried beyond a bound of the marginal are no trouble.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats
from scipy.special import betainc, gammainc, ndtr

from stiction.arrays import Array
from stiction.random.marginals import (
    Beta,
    Gamma,
    Lognormal,
    ScipyMarginal,
    TruncatedNormal,
    Weibull,
)

BINS = 160
NODES = 9
ROUNDS = 40
LEAST = 1e-12
_X, _W = np.polynomial.hermite_e.hermegauss(NODES)
_W = _W / _W.sum()


@dataclass(frozen=True)
class Search:
    """A family as a function of a vector that is free to take any value.

    Attributes
    ----------
    start : array
    distribution : callable
        From a vector and values to probabilities.
    marginal : callable
        From a vector to the marginal.
    """

    start: Array
    distribution: Callable[[Array, Array], Array]
    marginal: Callable[[Array], Any]


def _above(low: float, values: Array) -> Array:
    return np.maximum(values - low, 1e-300)


def _of_lognormal(start: Lognormal) -> Search:
    low = start.low
    shape, _, scale = start.distribution.args

    def marginal(v: Array) -> Lognormal:
        variance = math.exp(2.0 * v[1])
        excess = math.exp(v[0] + 0.5 * variance)
        mean = low + excess
        return Lognormal(mean=mean, cv=math.sqrt(math.expm1(variance)) * excess / mean, low=low)

    return Search(
        np.array([math.log(scale), math.log(shape)]),
        lambda v, y: ndtr((np.log(_above(low, y)) - v[0]) / math.exp(v[1])),
        marginal,
    )


def _of_weibull(start: Weibull) -> Search:
    low = start.low
    shape, _, scale = start.distribution.args

    def marginal(v: Array) -> Weibull:
        frozen = scipy.stats.weibull_min(math.exp(v[1]), low, math.exp(v[0]))
        mean = float(frozen.mean())
        return Weibull(mean=mean, cv=float(frozen.std()) / mean, low=low)

    return Search(
        np.array([math.log(scale), math.log(shape)]),
        lambda v, y: -np.expm1(-((_above(low, y) * math.exp(-v[0])) ** math.exp(v[1]))),
        marginal,
    )


def _of_gamma(start: Gamma) -> Search:
    low = start.low
    shape, _, scale = start.distribution.args

    def marginal(v: Array) -> Gamma:
        excess = math.exp(v[0] + v[1])
        mean = low + excess
        return Gamma(mean=mean, cv=excess * math.exp(-0.5 * v[1]) / mean, low=low)

    return Search(
        np.array([math.log(scale), math.log(shape)]),
        lambda v, y: gammainc(math.exp(v[1]), _above(low, y) * math.exp(-v[0])),
        marginal,
    )


def _of_beta(start: Beta, fixed: dict[str, float], width: float) -> Search:
    ends = [name for name in ("low", "high") if name not in fixed]

    def parts(v: Array) -> tuple[float, float, float, float]:
        free = dict(zip(ends, width * np.asarray(v[2:]), strict=True))
        low, high = free.get("low", start.low), free.get("high", start.high)
        return math.exp(v[0]), math.exp(v[1]), low, max(high, low + 1e-6 * width)

    def distribution(v: Array, y: Array) -> Array:
        a, b, low, high = parts(v)
        found: Array = betainc(a, b, np.clip((y - low) / (high - low), 0.0, 1.0))
        return found

    def marginal(v: Array) -> Beta:
        a, b, low, high = parts(v)
        return Beta(alpha=a, beta=b, low=low, high=high)

    free = [getattr(start, name) / width for name in ends]
    return Search(
        np.array([math.log(start.alpha), math.log(start.beta), *free]), distribution, marginal
    )


def _of_truncated(start: TruncatedNormal) -> Search:
    _, _, centre, deviation = start.distribution.args
    low, high = start.low, math.inf if start.high is None else start.high
    unit = float(start.distribution.std())

    def distribution(v: Array, y: Array) -> Array:
        middle, width = unit * v[0], unit * math.exp(v[1])
        below, above = ndtr((low - middle) / width), ndtr((high - middle) / width)
        share = (ndtr((np.clip(y, low, high) - middle) / width) - below) / max(
            above - below, 1e-300
        )
        return np.clip(share, 0.0, 1.0)

    def marginal(v: Array) -> TruncatedNormal:
        middle, width = unit * v[0], unit * math.exp(v[1])
        frozen = scipy.stats.truncnorm(
            (low - middle) / width, (high - middle) / width, middle, width
        )
        mean = float(frozen.mean())
        return TruncatedNormal(mean=mean, cv=float(frozen.std()) / mean, low=low, high=start.high)

    return Search(np.array([centre / unit, math.log(deviation / unit)]), distribution, marginal)


def without_noise(start: Any, fixed: dict[str, float], values: Array, noise: float) -> Any:
    """The marginal of values less their noise, of the family of a first guess.

    Parameters
    ----------
    start : marginal
        Fitted to values drawn together to the variance that they would have without noise.
    fixed : dict
        Parameters that stay.
    values : (points,) array
        As measured.
    noise : float
        Standard deviation of the noise.

    Returns
    -------
    marginal
        The first guess itself for a family that is known to scipy only.
    """
    if isinstance(start, ScipyMarginal):
        return start
    if isinstance(start, Beta):
        search = _of_beta(start, fixed, float(np.ptp(values)))
    elif isinstance(start, TruncatedNormal):
        search = _of_truncated(start)
    else:
        make: dict[type, Callable[[Any], Search]] = {
            Lognormal: _of_lognormal, Weibull: _of_weibull, Gamma: _of_gamma,
        }  # fmt: skip
        search = make[type(start)](start)
    counts, edges = np.histogram(values, bins=BINS)
    shifted = edges[:, None] - noise * _X

    def probabilities(v: Array) -> Array:
        reached = search.distribution(v, shifted) @ _W
        reached[0], reached[-1] = 0.0, 1.0
        found: Array = np.maximum(np.diff(reached), LEAST)
        return found

    return search.marginal(_scored(search.start, counts.astype(np.float64), probabilities))


def mean_log_likelihood(marginal: Any, values: Array, noise: float) -> float:
    """Of values in bins, marginal and noise together; the width of a bin is left out."""
    counts, edges = np.histogram(values, bins=BINS)
    reached = marginal.distribution.cdf(edges[:, None] - noise * _X) @ _W
    reached[0], reached[-1] = 0.0, 1.0
    return float(counts @ np.log(np.maximum(np.diff(reached), LEAST)) / counts.sum())


def _scored(at: Array, counts: Array, probabilities: Callable[[Array], Array]) -> Array:
    """The vector of the greatest multinomial likelihood, by damped Fisher scoring."""
    expected = probabilities(at)
    value, damping = float(counts @ np.log(expected)), 1e-3
    for _ in range(ROUNDS):
        slopes = np.stack(
            [(probabilities(at + e) - expected) / 1e-5 for e in 1e-5 * np.eye(at.size)]
        )
        score = slopes @ (counts / expected)
        information = counts.sum() * (slopes / expected) @ slopes.T
        diagonal = np.diag(np.diag(information) + 1e-9 * np.trace(information))
        while damping < 1e8:
            step = np.linalg.solve(information + damping * diagonal, score)
            step *= min(1.0, 0.5 / max(np.abs(step).max(), 1e-300))
            moved = probabilities(at + step)
            new = float(counts @ np.log(moved))
            if new >= value:
                break
            damping *= 10.0
        else:
            break
        gain, size = new - value, float(np.abs(step).max())
        at, expected, value = at + step, moved, new
        damping = max(0.1 * damping, 1e-9)
        if gain < 1e-5 or size < 1e-5:
            break
    return at

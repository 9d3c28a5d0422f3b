"""Errors of estimated probabilities: intervals and the variance of correlated chains.

Sources. Clopper and Pearson (1934), Biometrika 26, 404, derive intervals for a
count. Chan and Lai (2013), Annals of Statistics 41, 2877, and Lee and Whiteley
(2018), Biometrika 105, 609, derive the variance of chains from their genealogy.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv, stdtrit

CONFIDENCE = 0.95
"""Confidence level of every interval."""


def log_width(cv: float) -> float:
    """Return half the width of the interval for log(estimate).

    The width uses Student's distribution, because the coefficient of variation is
    itself estimated from about 1/cv^2 independent families.
    """
    if cv == 0.0:
        return 0.0
    freedom = max(1.0, 1.0 / (cv * cv) - 1.0)
    return float(stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE)) * math.sqrt(math.log1p(cv * cv))


def lognormal_interval(probability: float, cv: float) -> tuple[float, float]:
    """Return an interval within [0, 1] for an estimate whose logarithm is roughly normal."""
    if not math.isfinite(cv):
        return 0.0, 1.0
    width = log_width(cv)
    high = probability * math.exp(min(width, 700.0))
    return probability * math.exp(-width), min(1.0, high)


def binomial_interval(failures: int, samples: int) -> tuple[float, float]:
    """Return the interval for a probability from independent samples (Clopper and Pearson)."""
    tail, held = 0.5 * (1.0 - CONFIDENCE), samples - failures
    low = betaincinv(failures, held + 1, tail) if failures else 0.0
    high = betaincinv(failures + 1, held, 1.0 - tail) if held else 1.0
    return float(low), float(high)


def ancestral_variance(ancestors: NDArray[np.int64], samples: int) -> float:
    """Return the squared cv of an estimate by subset simulation, from the ancestors of failures.

    Families that descend from different first samples evolve independently. There are
    N = `samples` first samples. The shares w_i of the families among the failures
    therefore measure the error, v = sum (w_i - 1/N)^2. It is computed in three steps:

    1. Sum the squared shares, and subtract 1/N.
    2. If all samples fail, v is zero. Use at least (2/N)^2, as if two more samples
       had not failed. This bounds the error as the binomial distribution does.
    3. With k families of equal size, v is 1/k, but the variance of a mean of k values
       needs 1/(k - 1). Therefore return v/(1 - v).
    """
    if ancestors.size == 0:
        return math.inf
    _, sizes = np.unique(ancestors, return_counts=True)
    shares = sizes / ancestors.size
    spread = max(float(np.sum(shares * shares)) - 1.0 / samples, (2.0 / samples) ** 2)
    return spread / (1.0 - spread) if spread < 1.0 else math.inf


def generator(seed: int, *key: int) -> np.random.Generator:
    """Return an independent generator for each key under one seed.

    The first number of the spawn key separates this generator from the streams of
    random fields.
    """
    sequence = np.random.SeedSequence(entropy=seed, spawn_key=(7_000_000, *key))
    return np.random.Generator(np.random.PCG64DXSM(sequence))

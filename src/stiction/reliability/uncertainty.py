"""Errors of estimated probabilities: intervals, and the variance of correlated chains."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv, stdtrit

CONFIDENCE = 0.95
"""Confidence level of every interval."""


def log_width(cv: float) -> float:
    """Half the width of the interval of the logarithm of an estimate.

    By Student's distribution, as the coefficient of variation is itself estimated, from
    about 1/cv^2 independent families.
    """
    if cv == 0.0:
        return 0.0
    freedom = max(1.0, 1.0 / (cv * cv) - 1.0)
    return float(stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE)) * math.sqrt(math.log1p(cv * cv))


def lognormal_interval(probability: float, cv: float) -> tuple[float, float]:
    """Interval of an estimate whose logarithm is about normal, within [0, 1]."""
    if not math.isfinite(cv):
        return 0.0, 1.0
    width = log_width(cv)
    high = probability * math.exp(min(width, 700.0))
    return probability * math.exp(-width), min(1.0, high)


def binomial_interval(failures: int, samples: int) -> tuple[float, float]:
    """Interval of a probability from independent samples (Clopper and Pearson, 1934)."""
    tail, held = 0.5 * (1.0 - CONFIDENCE), samples - failures
    low = betaincinv(failures, held + 1, tail) if failures else 0.0
    high = betaincinv(failures + 1, held, 1.0 - tail) if held else 1.0
    return float(low), float(high)


def ancestral_variance(ancestors: NDArray[np.int64], samples: int) -> float:
    """Squared coefficient of variation of a subset estimate, from the ancestry of its failures.

    The genealogy estimator of Chan and Lai (2013) and Lee and Whiteley (2018): families that
    descend from different first samples, `samples` in all, evolve independently, so the spread
    of their shares among the failures measures the error, the sum of (share - 1/N)^2 over the N
    first samples. With k families of equal size that is 1/k, where the variance of a mean of k
    calls for 1/(k - 1): hence a last division by one minus the sum. If all samples fail, it is as
    if two more had not: that bounds the error as their binomial distribution does.
    """
    if ancestors.size == 0:
        return math.inf
    _, sizes = np.unique(ancestors, return_counts=True)
    shares = sizes / ancestors.size
    spread = max(float(np.sum(shares * shares)) - 1.0 / samples, (2.0 / samples) ** 2)
    return spread / (1.0 - spread) if spread < 1.0 else math.inf


def generator(seed: int, *key: int) -> np.random.Generator:
    """Return an independent generator for each key under one seed.

    The leading number of the spawn key keeps clear of the streams of random fields.
    """
    sequence = np.random.SeedSequence(entropy=seed, spawn_key=(7_000_000, *key))
    return np.random.Generator(np.random.PCG64DXSM(sequence))

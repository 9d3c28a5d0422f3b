"""Which modulus did the paper use? Asked by all printed results that depend on it.

The text says plane stress and prints G* = G/(1 - nu), which belongs to plane strain.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr
from scipy.stats import binom

from reproduction.numbers_with_errors import Number
from reproduction.runner import Data
from reproduction.setting import SIMULATED
from reproduction.studies import READINGS

RESAMPLED = 400  # bootstrap samples, of the same draws in every reading


def _count(number: int, of: int, *ratios: float) -> Callable:
    """Return the chance of a number of misplaced onsets among so many."""

    def chance(resampled: Callable, visible: float) -> np.ndarray:
        p = sum(resampled("misplaced", ratio) for ratio in ratios) / len(ratios)
        return binom.pmf(number, of, p)

    return chance


def _eight(resampled: Callable) -> np.ndarray:
    """Return the chance of 8 or more misplaced onsets among 60."""
    shares = np.transpose([resampled("misplaced", ratio) for ratio in SIMULATED])
    counts = binom.pmf(np.arange(21), 20, shares[:, :, None])
    return np.array([1.0 - functools.reduce(np.convolve, row)[:8].sum() for row in counts])


def _example(resampled: Callable, visible: float) -> np.ndarray:
    return resampled("patches", 0.25, lambda n: (n >= 20) & (n <= 30))


def _apart(ratio: float, resampled: Callable):
    """Return how far the theory lies above a mean of 20 simulations, in its standard errors."""
    simulated, predicted = (resampled(name, ratio) for name in ("simulated", "predicted"))
    square = resampled("simulated", ratio, lambda v: (v / 1e6) ** 2)
    error = np.sqrt((square - (simulated / 1e6) ** 2) / 20.0) * 1e6
    return (predicted - simulated) / error


def _above(resampled: Callable, visible: float) -> np.ndarray:
    return ndtr(_apart(0.25, resampled) - visible)


def _coincide(resampled: Callable, visible: float) -> np.ndarray:
    shifts = [_apart(ratio, resampled) for ratio in (0.5, 2.0)]
    return math.prod(ndtr(visible - shift) - ndtr(-visible - shift) for shift in shifts)


EVIDENCE = (_count(6, 20, 0.25), _count(2, 40, 0.5, 2.0), _example, _above, _coincide)
"""Probabilities of the printed results that `page.toml` lists, given means of resampled samples.
Two means are taken to differ if they are visibly apart, in standard errors of a mean of 20."""
COUNTS = slice(3)  # the part of the evidence that consists of counts


@dataclass(frozen=True)
class Reading:
    """What a reading gives for each printed result."""

    key: str
    chances: tuple[np.ndarray, ...]
    eight: Number

    def chance(self, index: int) -> Number:
        """Return the probability of a printed result."""
        return _bootstrapped(self.chances[index])

    @property
    def likelihood(self) -> np.ndarray:
        """Product of the probabilities: of the samples first, then of each bootstrap."""
        return math.prod(self.chances)


def _bootstrapped(values: np.ndarray) -> Number:
    return Number(float(values[0]), float(values[1:].std()))


@functools.cache
def compare(data: Data, visible: float = 1.0) -> dict[str, Reading]:
    """Return all readings; `visible` is the difference of two means that would be seen."""
    count = data["readings"].sizes["sample"]
    drawn = np.random.default_rng(0).integers(count, size=(RESAMPLED, count))
    drawn = np.vstack([np.arange(count), drawn])
    readings = {}
    for key in READINGS:
        values_of = functools.partial(data.reading, key)

        @functools.cache
        def resampled(name, ratio, function=np.asarray, values_of=values_of):
            return np.mean(function(values_of(name, ratio))[drawn], axis=1)

        chances = tuple(function(resampled, visible) for function in EVIDENCE)
        readings[key] = Reading(key, chances, _bootstrapped(_eight(resampled)))
    return readings


def most_likely(data: Data) -> float:
    """Return the largest likelihood of a reading."""
    return max(float(reading.likelihood[0]) for reading in compare(data).values()) or 1.0


def odds(data: Data, evidence=slice(None), visible: float = 1.0) -> tuple[float, float, float]:
    """Return how much likelier two moduli are than one, with a 95 % interval.

    The best reading of each kind counts; `evidence` chooses among the printed results.
    """
    readings = compare(data, visible).values()
    a, b, *two = [math.prod(reading.chances[evidence]) for reading in readings]
    ratio = np.maximum(*two) / np.maximum(np.maximum(a, b), 1e-300)
    return float(ratio[0]), *map(float, np.quantile(ratio[1:], (0.025, 0.975)))

"""Plain Monte Carlo: count the failures among the samples of the ensemble."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stiction._typing import Array
from stiction.reliability.limit_state import LimitState

BATCH = 1024
SHOWN = 64
"""Failing samples remembered."""


@dataclass(frozen=True, eq=False)
class Count:
    """Failures among the first samples of an ensemble.

    Attributes
    ----------
    failures, samples : int
    numbers : (up to 64,) int array
        Sample numbers of the first failures.
    """

    failures: int
    samples: int
    numbers: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def probability(self) -> float:
        """Share of failures."""
        return self.failures / self.samples

    @property
    def coefficient_of_variation(self) -> float:
        """Binomial standard error over the estimate."""
        if self.failures == 0:
            return math.inf
        # Where none held, as if one more had been drawn that did: nothing is certain by counting.
        held = max(1.0 - self.probability, 1.0 / (self.samples + 1.0))
        return math.sqrt(held / self.failures)


NOTHING = Count(0, 0)


def tally(values: Array, stress: float, so_far: Count = NOTHING) -> Count:
    """The count after the next samples, of these stresses at onset."""
    failed = values < stress
    numbers = np.concatenate([so_far.numbers, so_far.samples + np.flatnonzero(failed)])
    return Count(so_far.failures + int(failed.sum()), so_far.samples + values.size, numbers[:SHOWN])


def count_on(state: LimitState, seed: int, stress: float, samples: int, so_far: Count) -> Count:
    """The count extended to a number of samples."""
    while so_far.samples < samples:
        batch = min(BATCH, samples - so_far.samples)
        so_far = tally(state(state.draws(seed, so_far.samples, batch)), stress, so_far)
    return so_far


def count_failures(
    state: LimitState,
    seed: int,
    stress: float,
    *,
    target_cov: float,
    first: int,
    max_evaluations: int,
    so_far: Count | None = None,
) -> Count:
    """Count until the coefficient of variation is at most the target.

    Sample i is that of `stiction.monte_carlo` with the same seed.
    """
    count = NOTHING if so_far is None else so_far
    wanted: float = max(first, count.samples)
    while True:
        count = count_on(state, seed, stress, int(min(wanted, max_evaluations)), count)
        cov = count.coefficient_of_variation
        if cov <= target_cov or count.samples >= max_evaluations:
            return count
        # Four times more where nothing is known; else what is missing, and a little.
        known = count.failures >= 10
        wanted = 1.05 * count.samples * (cov / target_cov) ** 2 if known else 4.0 * count.samples
        wanted = max(wanted, count.samples + first)

"""Plain Monte Carlo: count the failures among the samples of the ensemble."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.progress import TimeUp
from stiction.reliability.limit_state import LimitState
from stiction.reliability.uncertainty import binomial_interval

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
    until_failure : bool
        Whether counting ended at a failure, because it was the last one wanted. That one says
        nothing of how frequent failures are, and neither does its sample.
    """

    failures: int
    samples: int
    numbers: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    until_failure: bool = False

    @property
    def probability(self) -> float:
        """Unbiased estimate: the share of failures, of all samples but the last failure.

        Haldane (1945); with a least or a greatest number of samples, Girshick, Mosteller and
        Savage (1946).
        """
        last = int(self.until_failure)
        return (self.failures - last) / (self.samples - last)

    @property
    def cv(self) -> float:
        """Standard error over the estimate."""
        last = int(self.until_failure)
        if self.failures <= last:
            return math.inf
        # Where none held, as if one more had been drawn that did: nothing is certain by counting.
        held = max(1.0 - self.probability, 1.0 / (self.samples + 1.0))
        return math.sqrt(held / (self.failures - last))

    def interval(self, confidence: float) -> tuple[float, float]:
        """Return Clopper and Pearson's, or of a count until a failure the negative binomial one."""
        low, high = binomial_interval(self.failures, self.samples, confidence)
        if self.until_failure:
            high = binomial_interval(self.failures - 1, self.samples - 1, confidence)[1]
        return low, high


def tally(values: Array, stress: float, first: int = 0) -> Count:
    """Count among samples first, first + 1, ... of these stresses at onset."""
    failed = np.flatnonzero(values < stress)
    return Count(failed.size, values.size, first + failed[:SHOWN])


def failures_wanted(target_cv: float) -> int:
    """Return how many failures make the error small enough: it falls like 1/sqrt(r - 1)."""
    return 2 + math.ceil(1.0 / (target_cv * target_cv))


def count_failures(
    state: LimitState,
    seed: int,
    stress: float,
    *,
    target_cv: float,
    least: int,
    max_evaluations: int,
    start: int = 0,
) -> tuple[Count, int]:
    """Count until there are enough failures, among at least `least` samples.

    Stopping when the estimate looks precise enough would favour counts that saw many failures
    early. So the number of failures is fixed beforehand, and what was computed beyond the last of
    them does not count.

    Parameters
    ----------
    state : LimitState
        If its time is over, what was counted until then is the answer.
    seed : int
        Sample i is that of `stiction.monte_carlo` with the same seed.
    stress, target_cv : float
    least, max_evaluations : int
    start : int
        Number of the first sample.

    Returns
    -------
    count : Count
    evaluations : int
        Those that do not count included.

    Raises
    ------
    TimeUp
        If its time is over before the first sample.
    """
    wanted = failures_wanted(target_cv)
    least = min(least, max_evaluations)
    parts: list[NDArray[np.bool_]] = []
    done = failures = 0
    while done < least or (failures < wanted and done < max_evaluations):
        size = least - done
        if size <= 0:
            rest = max_evaluations - done
            size = math.ceil((wanted - failures) * done / failures) if failures else rest
            size = min(size, rest)
        try:
            values = state(state.draws(seed, start + done, min(size, BATCH)))
        except TimeUp as up:
            values = up.values
        parts.append(values < stress)
        done, failures = done + values.size, failures + int(parts[-1].sum())
        state.meter.note = f"{failures:,} failures of {wanted:,} wanted"
        if state.meter.over:
            break
    if not done:
        raise TimeUp
    numbers = np.flatnonzero(np.concatenate(parts))
    shown = start + numbers[:SHOWN]
    if failures >= wanted and numbers[wanted - 1] >= least:
        return Count(wanted, int(numbers[wanted - 1]) + 1, shown, until_failure=True), done
    return Count(failures, done, shown), done

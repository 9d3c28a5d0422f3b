"""Plain Monte Carlo: count the failures among the samples of the ensemble."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.ensemble.limit_state import LimitState
from stiction.reliability.subset import Descent, Population
from stiction.reliability.uncertainty import binomial_interval

COUNT_BATCH = 1024
"""Most samples that are drawn and solved before failures are counted again."""


class Counted(NamedTuple):
    """Failures among samples; one that ended the count is not part of the estimate."""

    failures: int
    samples: int
    until_failure: bool = False

    @property
    def probability(self) -> float:
        """Unbiased estimate: the share of failures, of all samples but the last failure.

        Haldane (1945); with limits on the samples, Girshick, Mosteller and Savage (1946).
        """
        last = int(self.until_failure)
        return (self.failures - last) / (self.samples - last)

    @property
    def cv(self) -> float:
        """Standard error over the estimate."""
        last = int(self.until_failure)
        if self.failures <= last:
            return math.inf
        # If no sample held, count as if one more had: no count is certain.
        held = max(1.0 - self.probability, 1.0 / (self.samples + 1.0))
        return math.sqrt(held / (self.failures - last))

    def interval(self) -> tuple[float, float]:
        """Return Clopper and Pearson's interval, the negative binomial one until a failure."""
        low, high = binomial_interval(self.failures, self.samples)
        if self.until_failure:
            high = binomial_interval(self.failures - 1, self.samples - 1)[1]
        return low, high


def count_failures(
    state: LimitState,
    seed: int,
    stress: float,
    *,
    target_cv: float,
    least: int,
    max_evaluations: int,
    start: int = 0,
) -> tuple[Counted, Descent]:
    """Count until there are enough failures, at least `least` samples from `start` on.

    The number of failures is fixed beforehand: stopping at a precise estimate would favour
    early failures. Samples beyond the last of them do not count, but are returned too.
    """
    wanted = 2 + math.ceil(1.0 / (target_cv * target_cv))  # the error falls like 1/sqrt(r - 1)
    least = min(least, max_evaluations)
    parts: list[Array] = []
    members: list[NDArray[np.int64]] = []
    done = failures = 0
    while done < least or (failures < wanted and done < max_evaluations):
        size = least - done
        if size <= 0:
            size = math.ceil((wanted - failures) * done / failures) if failures else COUNT_BATCH
        size = min(size, COUNT_BATCH, max_evaluations - done)
        draws = state.draws(seed, start + done, size)
        parts.append(state(draws))
        members.append(state.member(draws))
        done, failures = done + size, failures + int(np.sum(parts[-1] < stress))
        state.meter.note = f"{failures:,} failures of {wanted:,} wanted"
    values = np.concatenate(parts)
    count = Counted(failures, done)
    if failures >= wanted:
        last = int(np.flatnonzero(values < stress)[wanted - 1])
        if last >= least:
            count = Counted(wanted, last + 1, until_failure=True)
    level = Population(
        math.inf, 0.0, values, np.arange(done), np.concatenate(members), np.empty((0, 0))
    )
    return count, Descent(done, [level], stress, done, complete=True)

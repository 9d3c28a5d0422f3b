"""Plain Monte Carlo: count the failures among the samples of the ensemble.

Problem. Estimate P(T < s) from independent samples of the onset T. The
coefficient of variation must not exceed a target.

Sources. Haldane (1945), Biometrika 33, 222, introduced inverse binomial
sampling. Girshick, Mosteller and Savage (1946), Annals of Mathematical
Statistics 17, 13, added limits on the number of samples. The intervals
follow Clopper and Pearson (1934), Biometrika 26, 404.

Steps:

1. Fix the number r of failures from the target: the error is
   proportional to 1/sqrt(r - 1). A rule that stopped when the estimate
   looks precise would favour early failures.
2. Draw samples until there are r failures, within the limits on samples.
3. If the last failure ended the count, the unbiased estimate is (r -
   1)/(n - 1) for n samples up to this failure. Otherwise it is the
   fraction of failures.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv

from stiction.base.arrays import Array
from stiction.ensemble.limit_state import LimitState
from stiction.reliability.subset import Descent, Population

CONFIDENCE = 0.9
"""Confidence level of every interval."""
COUNT_BATCH = 1024
"""Most samples that are solved before failures are counted again."""


def binomial_interval(failures: int, samples: int) -> tuple[float, float]:
    """Return the interval for a probability from independent samples (Clopper and Pearson)."""
    tail, held = 0.5 * (1.0 - CONFIDENCE), samples - failures
    low = betaincinv(failures, held + 1, tail) if failures else 0.0
    high = betaincinv(failures + 1, held, 1.0 - tail) if held else 1.0
    return float(low), float(high)


class Counted(NamedTuple):
    """Failures among samples. If the last failure ended the count, it is not included."""

    failures: int
    samples: int
    until_failure: bool = False

    @property
    def probability(self) -> float:
        """Unbiased estimate of the probability (step 3)."""
        last = int(self.until_failure)
        return (self.failures - last) / (self.samples - last)

    @property
    def cv(self) -> float:
        """Standard error of the estimate, divided by the estimate."""
        last = int(self.until_failure)
        if self.failures <= last:
            return math.inf
        # If all samples failed, count one more that holds, because no
        # count is certain.
        held = max(1.0 - self.probability, 1.0 / (self.samples + 1.0))
        return math.sqrt(held / (self.failures - last))

    def interval(self) -> tuple[float, float]:
        """Return the interval of Clopper and Pearson, or the negative binomial interval."""
        low, high = binomial_interval(self.failures, self.samples)
        if self.until_failure:
            # At least n samples before failure r are at most r - 1
            # failures in n - 1 samples.
            high = binomial_interval(self.failures - 1, self.samples - 1)[1]
        return low, high


@dataclass(frozen=True)
class Redrawn:
    """Draws of plain samples that begin with `first`. They are drawn again to save memory."""

    state: LimitState
    seed: int
    first: int
    samples: int

    def __len__(self) -> int:
        return self.samples

    def __getitem__(self, rows: NDArray[np.int64]) -> Array:
        """Return the draws (rows, dimension) of some of the samples."""
        draws = [self.state.draws(self.seed, self.first + row, 1) for row in rows.tolist()]
        return np.concatenate(draws)


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
    """Count until there are enough failures, and at least `least` samples from `start` on.

    Samples after the last counted failure are also returned.
    """
    # 1. Two more than the square of 1/target, since the error falls
    # like 1/sqrt(r - 1).
    wanted = 2 + math.ceil(1.0 / (target_cv * target_cv))
    least = min(least, max_evaluations)
    parts: list[Array] = []
    members: list[NDArray[np.int64]] = []
    done = failures = 0
    # 2.
    while done < least or (failures < wanted and done < max_evaluations):
        size = least - done
        if size <= 0:
            # As many as should hold the missing failures.
            size = math.ceil((wanted - failures) * done / failures) if failures else COUNT_BATCH
        size = min(size, COUNT_BATCH, max_evaluations - done)
        draws = state.draws(seed, start + done, size)
        parts.append(state(draws))
        members.append(state.member(draws))
        done, failures = done + size, failures + int(np.sum(parts[-1] < stress))
        state.meter.note = f"{failures:,} failures of {wanted:,} wanted"
    values = np.concatenate(parts)
    count = Counted(failures, done)
    # 3. The first `least` samples are always counted, whether or not
    # they hold r failures.
    if failures >= wanted:
        last = int(np.flatnonzero(values < stress)[wanted - 1])
        if last >= least:
            count = Counted(wanted, last + 1, until_failure=True)
    level = Population(
        math.inf, 0.0, values, np.arange(done), np.concatenate(members),
        Redrawn(state, seed, start, done),
    )  # fmt: skip
    return count, Descent(done, [level], stress, done, complete=True)

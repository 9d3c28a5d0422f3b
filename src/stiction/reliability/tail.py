"""The lower tail of the onset, from independent repetitions that are pooled until precise enough.

Problem. Estimate p(s) = P(T < s) for the onset T
and a stress s, or the stress at a probability. The
coefficient of variation must not exceed a target.

Source. The repetitions follow subset simulation (`subset`) or use two
levels (`two_level`).

Steps:

1. If the algorithm is 'auto' and two levels are possible, solve a pilot
   of plain samples by the method and by its less expensive first stage,
   which is called the guide. Use two levels if the weakest tenth
   according to the guide contains at least `LEAST_SHARE_PICKED` of the
   weakest fiftieth of the samples.
2. Make a repetition of moderate size. It
   depends only on the seed and its number.
3. Pool repetitions: p = sum of w_r p_r. The weights w_r are
   proportional to the numbers of samples, which do not depend on the
   outcome. The squared coefficient of variation is the sum of (w_r
   p_r)^2 v_r over p^2, with the relative variances v_r.
4. If the coefficient of variation is above the target, make the next
   repetition (step 2) and pool again (step 3). Choose the size that
   should reach the target, within the limits on size and evaluations.
5. Suppose that 'auto' chose the guide. If less than a fraction `POOR` of
   the samples that the guide selects are failures, sample again by
   subset simulation.
6. Find the stress at a probability from p(s) by bisection. The interval
   of the stress ends at the two stresses that belong to the interval
   ends of p. If no sample is so low, the lower end is the least
   possible stress.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtrit

from stiction.base.arrays import Array, one_blas_thread
from stiction.base.progress import SILENT, Meter
from stiction.ensemble.limit_state import LimitState
from stiction.reliability.subset import Descent, descend, generator
from stiction.reliability.two_level import bridge

CONFIDENCE = 0.9
"""Confidence level of every interval."""
FREQUENT = 0.01
"""Probability above which counting needs no more evaluations than
subset simulation."""
SIZE_MARGIN = 1.1
"""Factor on the sample size, because the variance so far is itself an
estimate."""
DEEPER = 0.3
"""Fraction of a probability to which repetitions go on for the lower
end of the interval."""
GUIDE_PILOT_SAMPLES = 500
"""Number of plain samples by which a guide is judged."""
LEAST_SHARE_PICKED = 0.9
"""Fraction of the weakest plain samples that a guide must pick."""
RESOLVED = 3
"""Fewest samples that determine the probability of an interface of a list."""
POOR = 0.02
"""Least fraction of failures among the samples of a guide."""


class Sizes(NamedTuple):
    """Sizes of repetitions: samples per level, or exact samples with two levels."""

    key: int  # first key of the generators, so that each kind has draws of its own
    first: int
    largest: int


SUBSET, TWO_LEVELS = Sizes(1, 1_000, 5_000), Sizes(3, 200, 1_000)
OF_CURVES = Sizes(4, 2_000, 2_000)
"""Repetitions of curves have one size."""


class Goal(NamedTuple):
    """Quantity to find in a tail: the probability below a stress, or the stress at a probability.

    The default of the number that is not sought cannot be reached, so
    it never stops the sampling.
    """

    cv: float  # coefficient of variation to reach
    stress: float = -math.inf
    probability: float = 0.0


def log_width(cv: float) -> float:
    """Return half the width of the interval for log(estimate).

    The width uses Student's distribution, because
    the coefficient of variation is itself estimated
    from about 1/cv^2 independent families.

    With cv = 0.5 there are 3 degrees of freedom, and Student's quantile is
    2.3534. A large cv leaves 1 degree of freedom, with the quantile 6.3138.

    >>> round(log_width(0.5) / math.sqrt(math.log(1.25)), 4)
    2.3534
    >>> round(log_width(2.0) / math.sqrt(math.log(5.0)), 4), log_width(0.0)
    (6.3138, 0.0)
    """
    if cv == 0.0:
        return 0.0
    freedom = max(1.0, 1.0 / (cv * cv) - 1.0)
    return float(stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE)) * math.sqrt(math.log1p(cv * cv))


def lognormal_interval(probability: float, cv: float) -> tuple[float, float]:
    """Return an interval within [0, 1] for an estimate whose logarithm is roughly normal.

    >>> low, high = lognormal_interval(0.3, 0.5)  # the factor is exp(1.1117) = 3.0395
    >>> round(low, 4), round(high, 4)
    (0.0987, 0.9118)
    >>> lognormal_interval(0.4, 0.5)[1], lognormal_interval(0.4, math.inf)
    (1.0, (0.0, 1.0))
    """
    if not math.isfinite(cv):
        return 0.0, 1.0
    factor = math.exp(log_width(cv))
    return probability / factor, min(1.0, probability * factor)


class Tail(NamedTuple):
    """The lower tail of the onset stress, from pooled repetitions.

    Here a repetition with 3 plain samples and one with 5 have the weights
    3/8 and 5/8. The event happens in 7 of 8 samples.

    >>> from stiction.reliability.subset import Population
    >>> def plain(*values):
    ...     numbers = np.arange(len(values))
    ...     level = Population(math.inf, 0.0, np.array(values), numbers, numbers % 2)
    ...     return Descent(len(values), [level], 0.5, len(values), complete=True)
    >>> tail = Tail([plain(3.0, 5.0, 7.0), plain(1.0, 4.0, 2.0, math.inf, 5.5)])
    >>> tail.extent, tail.survived, tail.complete
    ((1.0, 7.0), 0.125, True)

    Below 2.5 are 0 of 3 and 2 of 5 samples, and below 3.5 1 of 3 and 2 of 5.
    The relative variances are 2 and 3/7 (`ancestral_variance`).

    >>> tail.probability(2.5), tail.probability(3.5)
    (0.25, 0.375)
    >>> round(tail.cv(2.5) ** 2, 6), round(tail.cv(3.5) ** 2, 6), tail.cv(0.9)
    (0.428571, 0.412698, inf)

    Stresses at a probability, and the ends of an interval with
    the factor 1.4033. The lower end 0.15/1.4033 is rarer than all samples.

    >>> [round(tail.quantile(p), 6) for p in (0.25, 0.26, 0.875, 0.876)]
    [2.0, 3.0, 7.0, inf]
    >>> [round(end, 6) for end in tail.stress_interval(0.375, 0.2, 0.5)]
    [3.0, 5.0]
    >>> [round(end, 6) for end in tail.stress_interval(0.15, 0.2, 0.5)]
    [0.5, 2.0]
    >>> tail.stress_interval(0.1, math.inf, 0.5)
    (0.5, 7.0)
    """

    repetitions: Sequence[Descent]
    algorithm: str = "subset"  # or 'two_level'
    reason: str = ""
    spent: int = 0  # evaluations of the method, including those for the choice of the algorithm

    @property
    def complete(self) -> bool:
        """Whether the tail reaches the requested level."""
        return bool(self.repetitions[0].complete)

    @property
    def reached(self) -> float:
        """Stress, Pa, at the last level of an incomplete subset simulation."""
        return float(np.nextafter(self.repetitions[0].threshold, math.inf))

    def short_of(self, goal: str) -> str:
        """Return a message which says that the tail does not reach the requested level.

        >>> from types import SimpleNamespace
        >>> end = SimpleNamespace(samples=4, threshold=2.0, survived=0.5)
        >>> end.probability = lambda stress: 0.25 * (stress > 2.0)
        >>> print(Tail([end], spent=40).short_of("p"))
        40 evaluations do not reach p, but come down to 2 Pa (P = 0.25). Raise max_evaluations
        >>> Tail([end], "two_level", spent=40).short_of("P = 0.01")
        '40 evaluations do not reach P = 0.01. Raise max_evaluations'
        >>> Tail([SimpleNamespace(samples=4, survived=1.0)], spent=7).short_of("P = 0.01")
        'the event happens in none of 7 samples'
        """
        if self.survived == 1.0:
            return f"the event happens in none of {self.spent} samples"
        text = f"{self.spent} evaluations do not reach {goal}"
        if self.algorithm == "subset":
            chance = self.probability(self.reached)
            text += f", but come down to {self.reached:.7g} Pa (P = {chance:.2g})"
        return f"{text}. Raise max_evaluations"

    @property
    def extent(self) -> tuple[float, float]:
        """Lowest and highest stress among the samples, Pa."""
        lowest, highest = zip(*(descent.extent for descent in self.repetitions), strict=True)
        return min(lowest), max(highest)

    @property
    def survived(self) -> float:
        """Fraction of plain samples in which the event does not happen."""
        return float(self._weights @ [descent.survived for descent in self.repetitions])

    @property
    def _weights(self) -> Array:
        """Weight of each repetition, from its size, which does not depend on the outcome."""
        sizes = np.array([descent.samples for descent in self.repetitions])
        return sizes / sizes.sum()

    def _parts(self, stress: float) -> Array:
        """Contribution of each repetition to the probability."""
        return self._weights * [descent.probability(stress) for descent in self.repetitions]

    def probability(self, stress: float) -> float:
        """Return the estimate of P(onset below `stress`) (step 3)."""
        return float(sum(self._parts(stress)))

    def cv(self, stress: float) -> float:
        """Return the coefficient of variation, infinite if no sample is below the stress."""
        parts = self._parts(stress)
        if not parts.any():
            return math.inf
        variance = 0.0
        for part, descent in zip(parts, self.repetitions, strict=True):
            if part:  # a repetition without a failure has no relative variance
                variance += part * part * descent.relative_variance(stress)
        return float(math.sqrt(variance) / sum(parts))

    def of_members(self, stress: float, count: int) -> Array:
        """Return the probability for each of the equally likely interfaces.

        The probability is NaN if fewer than `RESOLVED` samples of an
        interface are below the stress. For plain samples, it is the
        fraction among the samples of the interface, because their number
        is random and causes most of the error near P = 1.

        The first interface has 3 failures among 4 plain samples. The second
        interface has 2 failures, too few. The plain samples of a second
        repetition are added. The third repetition has chains, in which 4
        samples of 1 % each are failures.

        >>> from types import SimpleNamespace
        >>> from stiction.reliability.subset import Below
        >>> def repetition(failures, *of_all):
        ...     ancestors = np.arange(len(failures))
        ...     below = Below(0.01, np.array(failures), ancestors, *map(np.array, of_all))
        ...     return SimpleNamespace(samples=9, below=lambda stress: below)
        >>> plain = repetition([0, 1, 0, 0, 1], [0, 1, 0, 0, 1, 1, 1, 0, 1])
        >>> Tail([plain]).of_members(1.0, 2).tolist()
        [0.75, nan]
        >>> more, chains = repetition([1, 0], [0, 1, 0]), repetition([1, 0, 1, 1])
        >>> found = Tail([plain, more, chains]).of_members(1.0, 2)
        >>> np.allclose(found, [0.02 / 3.0 + 2.0 / 3.0 * 4 / 6, 0.02 + 2.0 / 3.0 * 3 / 6])
        True
        >>> Tail([repetition(60 * [1])]).of_members(1.0, 2).tolist()  # an estimate of 1.2
        [nan, 1.0]
        """
        in_chains, seen, low, plain = np.zeros((4, count))
        plain_weight = 0.0
        for weight, descent in zip(self._weights, self.repetitions, strict=True):
            below = descent.below(stress)
            failures = np.bincount(below.members, minlength=count)
            seen += failures
            if below.drawn is None:
                # P(T < s | member) = P(T < s and member) / P(member),
                # and P(member) = 1/count.
                in_chains += weight * count * below.probability * failures
            else:
                # Plain samples of all repetitions are added up before
                # the division, because some repetitions have few
                # samples of an interface.
                low += failures
                plain += np.bincount(below.drawn, minlength=count)
                plain_weight += weight
        chances = in_chains + plain_weight * low / np.maximum(plain, 1.0)
        return np.where(seen >= RESOLVED, np.minimum(chances, 1.0), np.nan)

    def members_cv(self, stress: float, kinds: Array) -> float:
        """Return the coefficient of variation due to the list of interfaces, which is a sample.

        Members with the same number in `kinds` are one entry of the
        list. An entry has the fraction w of the list and the fraction p of
        the failures. As in importance sampling, the square of the
        result is the sum of (p - w)^2 over the entries.

        Members 0 and 1 are one entry with w = 2/3. The samples in the second
        repetition count twice. The entries have 1 and 6 failures, and 49 - 9 - 4
        pairs have different ancestors, of which 37 - 7 - 4 are alike. The spread
        is 26/36 - 2 (2/21 + 6/21) + 5/9.

        >>> from types import SimpleNamespace
        >>> from stiction.reliability.subset import Below
        >>> def repetition(chance, members, ancestors):
        ...     below = Below(chance, np.array(members, int), np.array(ancestors, int))
        ...     return SimpleNamespace(samples=4, below=lambda stress: below)
        >>> first = repetition(0.25, [2, 2, 2, 1, 2], [0, 4, 4, 2, 2])
        >>> tail = Tail([first, repetition(0.5, [2], [7])])
        >>> round(tail.members_cv(1.0, np.array([0, 0, 1])) ** 2, 6)  # 0.515873/(1 - 5/9)
        1.160714

        The failures may follow the list more closely than chance would
        allow, or there may be no failure:

        >>> Tail([repetition(0.25, [0, 1, 0, 1], [0, 1, 2, 3])]).members_cv(1.0, np.array([0, 1]))
        0.0
        >>> Tail([repetition(0.25, [], [])]).members_cv(1.0, np.array([0, 1]))
        0.0
        """
        entries = np.bincount(kinds)
        failures, pairs, alike = np.zeros(entries.size), 0.0, 0.0
        for descent in self.repetitions:
            below = descent.below(stress)
            # Samples count by the probability that they represent.
            per_sample, of_sample = below.probability * descent.samples, kinds[below.members]
            failures += per_sample * np.bincount(of_sample, minlength=entries.size)
            pairs -= per_sample * per_sample * _squares(below.ancestors)
            alike -= per_sample * per_sample * _squares(of_sample, below.ancestors)
        # The sum of p^2 is the chance that two failures belong to one
        # entry. Only pairs with different ancestors are independent.
        # Counting all pairs would give too large a chance if entries
        # have few samples.
        pairs, alike = pairs + float(failures.sum()) ** 2, alike + float(failures @ failures)
        if not pairs > 0.0:
            return 0.0
        w, p = entries / kinds.size, failures / failures.sum()
        spread = alike / pairs - 2.0 * float(w @ p) + float(w @ w)
        # The entries determine their own mean,
        # which takes one degree of freedom.
        excess = spread / max(1.0 - float(w @ w), 1e-300)
        return math.sqrt(max(excess, 0.0))

    def quantile(self, probability: float) -> float:
        """Return the stress below which the onset lies with this probability (step 6).

        The stress is infinite if the event is less frequent.
        """
        if probability > 1.0 - self.survived:
            return math.inf
        low, high = self.extent
        for _ in range(80):  # bisection halves the interval to the last bit
            middle = 0.5 * (low + high)
            if self.probability(middle) < probability:
                low = middle
            else:
                high = middle
        return high

    def stress_interval(
        self, probability: float, cv: float, lowest: float
    ) -> tuple[float, float]:
        """Return the stresses at the interval ends of the probability (step 6)."""
        least, highest = self.extent
        if not math.isfinite(cv):
            return lowest, highest
        below, above = lognormal_interval(probability, cv)
        # No sample is below the least one, so smaller probabilities
        # have no stress.
        seen = self.probability(float(np.nextafter(least, math.inf)))
        return self.quantile(below) if below >= seen else lowest, self.quantile(above)


@dataclass(frozen=True, eq=False)
class TailPoint:
    """A tail at a stress: the probability of a lower onset, and its errors.

    The last interface cannot fail at this stress, and the first one must.

    >>> from types import SimpleNamespace
    >>> random = SimpleNamespace(kinds=np.array([0, 0, 1]))
    >>> state = SimpleNamespace(several=True, experiment=SimpleNamespace(random=random))
    >>> state.bounds_of_members = lambda: [(1.0, 2.0), (1.5, 4.0), (2.0, 5.0)]
    >>> tail = SimpleNamespace(probability=lambda s: s / 8.0, cv=lambda s: 1.5 * s)
    >>> tail.members_cv = lambda stress, kinds: stress * float(kinds.sum())
    >>> tail.of_members = lambda stress, count: np.full(count, 0.3)
    >>> point = TailPoint(state, tail, 2.0)
    >>> point.probability, point.sampling_cv, point.members_cv, round(point.cv**2, 6)
    (0.25, 3.0, 2.0, 13.0)
    >>> point.members.tolist()
    [1.0, 0.3, 0.0]

    The error by the choice of interfaces is zero for a single interface.

    >>> state.several = False
    >>> alone = TailPoint(state, tail, 2.0)
    >>> alone.members_cv, alone.cv, alone.members.size
    (0.0, 3.0, 0)
    """

    state: LimitState
    tail: Tail
    stress: float

    @cached_property
    def probability(self) -> float:
        """Probability of an onset below the stress."""
        return self.tail.probability(self.stress)

    @cached_property
    def sampling_cv(self) -> float:
        """Coefficient of variation of the probability due to sampling."""
        return self.tail.cv(self.stress)

    @cached_property
    def members_cv(self) -> float:
        """Part of `cv` due to the choice of interfaces, or 0 for a single interface."""
        if not self.state.several:
            return 0.0
        return self.tail.members_cv(self.stress, self.state.experiment.random.kinds)

    @cached_property
    def cv(self) -> float:
        """Coefficient of variation due to sampling and to the choice of interfaces."""
        return math.hypot(self.sampling_cv, self.members_cv)

    @cached_property
    def members(self) -> Array:
        """Probability of each equally likely interface, or empty for a single interface."""
        if not self.state.several:
            return np.zeros(0)
        lows, highs = np.array(self.state.bounds_of_members()).T
        probabilities = self.tail.of_members(self.stress, lows.size)
        return np.select([self.stress <= lows, self.stress >= highs], [0.0, 1.0], probabilities)


def _squares(*labels: Array) -> float:
    """Count the samples with each label, and return the sum of the squared counts.

    >>> _squares(np.array([3, 3, 5, 3])), _squares(np.array([3, 3, 5, 3]), np.array([1, 2, 1, 1]))
    (10.0, 6.0)
    """
    _, sizes = np.unique(np.stack(labels), axis=1, return_counts=True)
    return float(np.sum(sizes.astype(np.float64) ** 2))


def repeat_until_precise(
    make: Callable[[int, int, int], Any],
    judge: Callable[[Sequence[Any]], float],
    *,
    target_cv: float,
    first: int,
    largest: int,
    max_evaluations: int,
    meter: Meter = SILENT,
) -> list[Any]:
    """Return repetitions whose pooled coefficient of variation is at most the target.

    Either all repetitions are complete, or there is a single
    incomplete repetition. `make` takes (samples, number,
    remaining evaluations). `judge` returns the coefficient
    of variation, or zero to stop. Repetitions of moderate
    size, from `first` to `largest`, limit the memory.

    Suppose that n samples have the cv 1/sqrt(n), and cost 2 evaluations
    each. A cv of 0.08 needs 156.25 samples, and 10 % more are wanted. A
    repetition has 20 to 90 samples. Its number and the remaining
    evaluations are printed. Only the last one keeps its draws:

    >>> from stiction.reliability.subset import Population
    >>> level = Population(0.0, 0.0, *np.zeros((3, 1)), draws=np.zeros((1, 1)))
    >>> def make(size, number, left):
    ...     print(size, number, left)
    ...     return Descent(size, [level], 0.0, 2 * size, complete=left > 99)
    >>> def judge(repetitions):
    ...     return sum(repetition.samples for repetition in repetitions) ** -0.5
    >>> sizes = {"target_cv": 0.08, "first": 20, "largest": 90}
    >>> found = repeat_until_precise(make, judge, max_evaluations=1000, **sizes)
    20 0 1000
    90 1 960
    61 2 780
    >>> [len(repetition.populations[0].draws) for repetition in found]
    [0, 0, 1]
    >>> len(repeat_until_precise(make, lambda _: 0.08, max_evaluations=1000, **sizes))
    20 0 1000
    1

    A budget of 201 allows 80 samples after the first 20. The last repetition
    is not used if it is incomplete, unless it is the only one. An
    infinite cv doubles the samples.

    >>> len(repeat_until_precise(make, judge, max_evaluations=201, **sizes))
    20 0 201
    80 1 161
    2
    >>> len(repeat_until_precise(make, judge, max_evaluations=139, **sizes))
    20 0 139
    49 1 99
    1
    >>> len(repeat_until_precise(make, judge, max_evaluations=99, **sizes))
    20 0 99
    1
    >>> len(repeat_until_precise(make, lambda _: math.inf, max_evaluations=195, **sizes))
    20 0 195
    20 1 155
    40 2 115
    3
    """
    repetitions: list[Any] = []
    spent, size = 0, first
    while size >= first:
        latest = make(size, len(repetitions), max_evaluations - spent)
        spent += latest.evaluations
        if not latest.complete:
            return repetitions or [latest]
        # 3. Only the latest repetition keeps its draws, for checks and
        # failing profiles.
        repetitions = [*(earlier.light() for earlier in repetitions), latest]
        cv = judge(repetitions)
        if cv <= target_cv:
            break
        # 4. The error falls with the square root of the number of samples.
        meter.note = f"repetition {len(repetitions)}, cv {cv:.2g} (target {target_cv:g})"
        total = wanted = sum(repetition.samples for repetition in repetitions)
        price = sum(repetition.evaluations for repetition in repetitions) / total
        if math.isfinite(cv):
            wanted = SIZE_MARGIN * total * (cv / target_cv) ** 2 - total
        affordable = (max_evaluations - spent) / price
        size = int(min(max(wanted, first), largest, affordable))
    return repetitions


def share_picked(guide: Array, exact: Array) -> float:
    """Return which fraction of the weakest fiftieth lies in the weakest tenth by the guide.

    Of 400 samples the weakest 8 have the ranks 35 to 42 by the guide, which
    picks ranks below 40. Of 20 samples the weakest 5 have the ranks 8 to 12,
    and ranks below 10 are picked.

    >>> exact = np.arange(400.0)
    >>> share_picked((exact + 35.0) % 400.0, exact)
    0.625
    >>> share_picked((exact[:20] + 8.0) % 20.0, exact[:20])
    0.4
    """
    weakest = np.argsort(exact)[: max(5, exact.size // 50)]
    seen = np.argsort(guide)[: max(10, exact.size // 10)]
    return float(np.isin(weakest, seen).mean())


def sample_tail(
    state: LimitState,
    goal: Goal,
    *,
    algorithm: str,
    budget: int,
    reason: str = "as requested",
    pilot: tuple[Array, Array] | None = None,
) -> Tail:
    """Sample the lower tail until the goal is reached.

    With 'auto', two levels are used if the guide passes steps 1 and 5.
    `budget` includes the pilot, which holds (draws, stresses) of plain
    samples that are solved already.

    Here the onset is a function of a standard normal number x. The first
    tail is found by subset simulation, because there is no guide. A budget
    of 1200 allows levels with 300 samples.

    >>> from types import SimpleNamespace
    >>> class State:
    ...     dimension, bounds, meter = 1, (-9.0, 9.0), SILENT
    ...     experiment = SimpleNamespace(seed=3, method=SimpleNamespace(label="guide"))
    ...     def __init__(self, onset, guide="none"):
    ...         self.onset, self.guide = onset, guide
    ...     def __call__(self, draws):
    ...         return self.onset(draws[:, 0])
    ...     def draws(self, seed, first, count):
    ...         return generator(seed).standard_normal((count, 1))
    ...     def member(self, draws):
    ...         return np.zeros(len(draws), int)
    >>> state = State(lambda x: x)
    >>> tail = sample_tail(state, Goal(0.5, -2.0), algorithm="auto", budget=1200)
    >>> tail.algorithm, tail.reason, tail.repetitions[0].samples
    ('subset', 'as requested', 300)
    >>> tail.spent == sum(descent.evaluations for descent in tail.repetitions) <= 1200
    True
    >>> abs(tail.probability(-2.0) / 0.02275 - 1.0) < 3.0 * tail.cv(-2.0) < 1.5
    True

    A quantile needs levels down to 0.3 times the probability. The
    probabilities are 1, 0.1, 0.01 and 0.001.

    >>> tail = sample_curve(state, Goal(0.1, probability=0.0025), 25_000)
    >>> [(len(descent.populations), descent.samples) for descent in tail.repetitions[:2]]
    [(4, 2000), (4, 2000)]
    >>> tail.spent == sum(descent.evaluations for descent in tail.repetitions)
    True
    >>> abs(tail.quantile(0.0025) + 2.807) < 0.1
    True

    A guide that ranks samples as the method does leads to two levels. The
    opposite order does not. The last guide leads to samples that do not fail.

    >>> def found(guide, onset, stress):
    ...     state = State(onset, State(guide))
    ...     tail = sample_tail(state, Goal(0.9, stress), algorithm="auto", budget=20_000)
    ...     again = sum(descent.evaluations for descent in tail.repetitions)
    ...     print(tail.algorithm, tail.reason.partition("; ")[2], tail.spent - again > 500)
    ...     return tail.probability(stress)
    >>> 0.6 < found(lambda x: x, lambda x: x - 0.1, -3.1) / 0.00135 < 1.6
    two_level of 500 plain samples the guide picks 100% of the weakest False
    True
    >>> found(lambda x: -x, lambda x: x, -2.0) > 0.01
    subset of 500 plain samples the guide picks 0% of the weakest False
    True
    >>> wrong = found(lambda x: x, lambda x: np.where(x < -3.0, 9.0, x), -2.998)
    ... # doctest: +ELLIPSIS
    subset ...weakest; only ...% of the failures by the guide are confirmed True
    """
    # 1.
    auto, seed = algorithm == "auto", state.experiment.seed
    possible = "unused" if algorithm == "subset" else state.guide
    guide = None if isinstance(possible, str) else possible
    if auto and guide and pilot is None:
        draws = state.draws(seed, 0, min(GUIDE_PILOT_SAMPLES, budget // 5))
        pilot = draws, state(draws)
    spent = 0 if pilot is None else pilot[1].size
    label = guide.experiment.method.label if guide else ""
    if auto and guide and pilot:
        share = share_picked(guide(pilot[0]), pilot[1])
        # The reason is part of the answer, also if the guide is not used.
        reason += f"; of {spent} plain samples the {label} picks {share:.0%} of the weakest"
        guide = guide if share >= LEAST_SHARE_PICKED else None
    # 2. to 4.
    repetitions = _repetitions(state, goal, budget - spent, guide, POOR if auto else 0.0)
    spent += sum(descent.evaluations for descent in repetitions)
    # 5. A walk by a poor guide ends far from the failures, and misses
    # many of them.
    if auto and guide and _share_failing(repetitions[0]) < POOR:
        share = _share_failing(repetitions[0])
        reason += f"; only {share:.1%} of the failures by the {label} are confirmed"
        guide, repetitions = None, _repetitions(state, goal, budget - spent)
        spent += sum(descent.evaluations for descent in repetitions)
    return Tail(repetitions, "subset" if guide is None else "two_level", reason, spent)


def sample_curve(state: LimitState, goal: Goal, budget: int) -> Tail:
    """Sample the lower tail with the repetitions that failure curves use."""
    repetitions = _repetitions(state, goal, budget, sizes=OF_CURVES)
    return Tail(repetitions, spent=sum(descent.evaluations for descent in repetitions))


def _repetitions(
    state: LimitState,
    goal: Goal,
    budget: int,
    guide: LimitState | None = None,
    poor: float = 0.0,
    sizes: Sizes = SUBSET,
) -> list[Descent]:
    """Repeat subset simulation until the tail is precise enough.

    With a `guide`, each repetition uses two levels. Stop after the
    first repetition if fewer than a fraction `poor` of the samples that
    the guide selects fail.
    """
    sizes = TWO_LEVELS if guide else sizes

    def judge(repetitions: Sequence[Descent]) -> float:
        if guide and _share_failing(repetitions[0]) < poor:
            return 0.0
        tail = Tail(repetitions)
        return tail.cv(tail.quantile(goal.probability) if goal.probability else goal.stress)

    def make(samples: int, number: int, max_evaluations: int) -> Descent:
        # 2. A repetition depends only on the seed, the kind and its number.
        options: dict[str, Any] = {
            "samples": samples, "max_evaluations": max_evaluations, "threshold": goal.stress,
            "floor": state.bounds[0], "label": state.member,
            "rng": generator(state.experiment.seed, sizes.key, number),
        }  # fmt: skip
        chance = goal.probability
        with one_blas_thread():  # the number of threads changes the last bits
            if guide is None:
                return descend(state, state.dimension, probability=DEEPER * chance, **options)
            return bridge(guide, state, state.dimension, probability=chance, **options)

    # Take fewer samples if the budget would not allow four levels.
    return repeat_until_precise(
        make, judge, target_cv=goal.cv, first=min(sizes.first, max(budget // 4, 20)),
        largest=sizes.largest, max_evaluations=budget, meter=state.meter,
    )  # fmt: skip


def _share_failing(descent: Descent) -> float:
    """Return the fraction of failures among samples that the guide selects, 1 without samples.

    >>> from stiction.reliability.subset import Population
    >>> none, values = np.zeros(0, int), np.array([1.0, 3.0, 2.0, 4.0, 5.0])
    >>> level = Population(math.inf, 0.0, values, none, none)
    >>> early = level._replace(values=values - 3.0)
    >>> _share_failing(Descent(5, [early, level], 2.0, 5, complete=True))
    0.2
    >>> _share_failing(Descent(5, [level], 2.0, 5, complete=False))
    1.0
    """
    values = descent.populations[-1].values
    return float(np.mean(values < descent.threshold)) if descent.complete else 1.0

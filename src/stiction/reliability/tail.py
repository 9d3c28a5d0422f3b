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
    """
    if cv == 0.0:
        return 0.0
    freedom = max(1.0, 1.0 / (cv * cv) - 1.0)
    return float(stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE)) * math.sqrt(math.log1p(cv * cv))


def lognormal_interval(probability: float, cv: float) -> tuple[float, float]:
    """Return an interval within [0, 1] for an estimate whose logarithm is roughly normal."""
    if not math.isfinite(cv):
        return 0.0, 1.0
    factor = math.exp(log_width(cv))
    return probability / factor, min(1.0, probability * factor)


class Tail(NamedTuple):
    """The lower tail of the onset stress, from pooled repetitions."""

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
        """Return a message which says that the tail does not reach the requested level."""
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
    """A tail at a stress: the probability of a lower onset, and its errors."""

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
    """Count the samples with each label, and return the sum of the squared counts."""
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
    """Return which fraction of the weakest fiftieth lies in the weakest tenth by the guide."""
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
    """Return the fraction of failures among samples that the guide selects, 1 without samples."""
    values = descent.populations[-1].values
    return float(np.mean(values < descent.threshold)) if descent.complete else 1.0

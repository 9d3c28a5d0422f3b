"""The lower tail of the stress at onset: independent repetitions, pooled until precise enough."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.progress import SILENT, Meter
from stiction.reliability.counting import Count, tally
from stiction.reliability.guide import first_stage, resembles, two_levels_refused
from stiction.reliability.limit_state import LimitState
from stiction.reliability.subset import MOST_LEVELS, descend
from stiction.reliability.two_level import bridge
from stiction.reliability.uncertainty import generator, log_width

MARGIN = 1.1
"""The variance known so far is itself an estimate; aim a little further."""
SUBSET, SUBSET_MOST = 1_000, 5_000
"""Samples a level of the first repetition of subset simulation and of the largest."""
BRIDGE, BRIDGE_MOST = 200, 1_000
"""Exact samples of the first repetition over two levels and of the largest."""
DEEPER = 0.3
"""Repetitions go on to this share of a probability, to know the lower end of the interval."""
PILOT = 500
"""Plain samples that tell whether a less expensive method is a guide."""
POOR = 0.02
"""Of the samples that a guide leads to, those that fail: fewer, and it is no guide."""


@dataclass(frozen=True, eq=False)
class Tail:
    """The lower tail of the stress at onset from pooled repetitions.

    Attributes
    ----------
    repetitions : sequence of Descent or of Bridge
    algorithm, reason : str
        'subset' or 'two_level', and why.
    spent : int
        Evaluations of the method in all, those to choose the algorithm included.
    """

    repetitions: Sequence[Any]
    algorithm: str = "subset"
    reason: str = ""
    spent: int = 0

    @property
    def complete(self) -> bool:
        """Whether it reaches as far down as asked for."""
        return bool(self.repetitions[0].complete)

    @property
    def reached(self) -> float:
        """Pa; of the last level of a subset simulation that is not complete."""
        return float(np.nextafter(self.repetitions[0].threshold, math.inf))

    def short_of(self, goal: str) -> str:
        """Return in words that it does not reach as far down as asked for."""
        text = f"{self.spent} evaluations do not reach {goal}"
        if self.algorithm == "two_level":
            return f"{text}: raise max_evaluations"
        deep = len(self.repetitions[0].populations) >= MOST_LEVELS
        return (
            f"{text}: they have come down to {self.reached:.7g} Pa"
            f" (P = {self.probability(self.reached):.2g});"
            + (f" it stops after {MOST_LEVELS} levels" if deep else " raise max_evaluations")
        )

    @property
    def extent(self) -> tuple[float, float]:
        """Lowest and highest stress seen, Pa."""
        extents = [one.extent for one in self.repetitions]
        return min(low for low, _ in extents), max(high for _, high in extents)

    @property
    def first_stage_evaluations(self) -> int:
        """Samples that only the less expensive method was asked for."""
        return sum(getattr(one, "first_stage_evaluations", 0) for one in self.repetitions)

    @property
    def weights(self) -> list[float]:
        """Each repetition's part in the mean: its size, which does not depend on its outcome."""
        total = sum(one.samples for one in self.repetitions)
        return [one.samples / total for one in self.repetitions]

    def probability(self, stress: float) -> float:
        """Return the estimate of P(onset below `stress`)."""
        parts = zip(self.weights, self.repetitions, strict=True)
        return float(sum(weight * one.probability(stress) for weight, one in parts))

    def cv(self, stress: float) -> float:
        """Return its coefficient of variation; infinite where no sample is so low."""
        whole = self.probability(stress)
        if whole == 0.0:
            return math.inf
        variance = 0.0
        for weight, one in zip(self.weights, self.repetitions, strict=True):
            part = weight * one.probability(stress)
            if part > 0.0:
                variance += part * part * one.relative_variance(stress)
        return math.sqrt(variance) / whole

    def counted(self, stress: float) -> Count | None:
        """Return a count where failure is so likely that no repetition had a second level.

        All samples are independent then.
        """
        populations: list[Any] = [getattr(one, "populations", ()) for one in self.repetitions]
        if not self.complete or any(len(each) != 1 for each in populations):
            return None
        return tally(np.concatenate([each[0].values for each in populations]), stress)

    def quantile(self, probability: float) -> float:
        """Return the stress below which the onset lies with this probability."""
        low, high = self.extent
        for _ in range(80):
            middle = 0.5 * (low + high)
            if self.probability(middle) < probability:
                low = middle
            else:
                high = middle
        return high

    def stress_interval(
        self, probability: float, cv: float, confidence: float, lowest: float
    ) -> tuple[float, float]:
        """Return stresses whose estimated probabilities bracket the one asked for."""
        least, highest = self.extent
        if not math.isfinite(cv):
            return lowest, highest
        width = min(log_width(cv, confidence), 700.0)
        below = probability * math.exp(-width)
        seen = self.probability(float(np.nextafter(least, math.inf)))
        low = self.quantile(below) if below >= seen else lowest
        return low, self.quantile(min(probability * math.exp(width), 1.0))


def repeat_until_precise(
    make: Callable[[int, int, int], Any],
    judge: Callable[[Sequence[Any]], float],
    *,
    target_cv: float,
    first: int,
    largest: int,
    max_evaluations: int,
    meter: Meter = SILENT,
    enough: Callable[[Any], bool] = lambda one: False,
) -> list[Any]:
    """Return repetitions whose pooled coefficient of variation is at most the target.

    All of them are complete, or it is a single incomplete one.

    Parameters
    ----------
    make : callable
        (samples, number of the repetition, evaluations left) to a repetition.
    judge : callable
        Coefficient of variation of some repetitions together.
    first, largest : int
        Size of the first repetition and of the largest; many of moderate size bound the memory.
    enough : callable
        Whether the first repetition is such that no more are wanted.
    """
    done: list[Any] = []
    spent, size = 0, first
    while True:
        one = make(size, len(done), max_evaluations - spent)
        spent += one.evaluations
        if not one.complete:
            return done or [one]
        done = [*(earlier.light() for earlier in done), one]
        cv = judge(done)
        meter.note = f"{len(done)} repetitions, c.o.v. {cv:.2g} (target {target_cv:g})"
        if cv <= target_cv or (len(done) == 1 and enough(one)):
            return done
        total = sum(each.samples for each in done)
        price = sum(each.evaluations for each in done) / total
        wanted = MARGIN * total * (cv / target_cv) ** 2 - total if math.isfinite(cv) else total
        affordable = (max_evaluations - spent) / price
        size = int(min(max(wanted, first), largest, affordable))
        if size < first:
            return done


def sample_tail(
    state: LimitState,
    *,
    algorithm: str,
    target_cv: float,
    seed: int,
    budget: int,
    stress: float | None = None,
    probability: float = 0.0,
    reason: str = "as asked",
    pilot: tuple[Array, Array] | None = None,
) -> Tail:
    """Sample the lower tail down to a stress, or down to a probability.

    Parameters
    ----------
    algorithm : {"auto", "subset", "two_level"}
        'auto' takes two levels where a less expensive method is a guide to the weakest samples:
        where it picks the same ones among some plain samples, and the first repetition finds
        failures among the samples that it leads to.
    target_cv : float
        Of the probability at the stress, or at its own quantile.
    budget : int
        Evaluations of the method, those of the pilot included.
    pilot : (draws, stresses), optional
        Plain samples that are there already.
    """
    spent = 0 if pilot is None else pilot[1].size
    auto = algorithm == "auto"
    if auto:
        algorithm = "subset"
        if two_levels_refused(state) is None:
            if pilot is None:
                draws = state.draws(seed, 0, min(PILOT, budget // 5))
                pilot, spent = (draws, state(draws)), draws.shape[0]
            good, text = resembles(state, *pilot)
            algorithm, reason = ("two_level" if good else "subset"), f"{reason}; {text}"

    def make(samples: int, number: int, left: int) -> Any:
        rng = generator(seed, 3 if algorithm == "two_level" else 1, number)
        if algorithm == "two_level":
            return bridge(
                state.by(first_stage(state)), state, state.dimension, samples=samples, rng=rng,
                max_evaluations=left, threshold=stress, probability=probability,
                floor=state.bounds[0],
            )  # fmt: skip
        return descend(
            state, state.dimension, samples=samples, rng=rng, max_evaluations=left,
            threshold=-math.inf if stress is None else stress,
            probability=DEEPER * probability, floor=state.bounds[0],
        )  # fmt: skip

    def judge(repetitions: Sequence[Any]) -> float:
        tail = Tail(repetitions)
        return tail.cv(tail.quantile(probability) if stress is None else stress)

    def is_poor(one: Any) -> bool:
        return auto and algorithm == "two_level" and bool(one.complete and one.share < POOR)

    def repeated() -> list[Any]:
        both = (BRIDGE, BRIDGE_MOST) if algorithm == "two_level" else (SUBSET, SUBSET_MOST)
        # Fewer than usual where the budget would not even hold four levels.
        first = min(both[0], max((budget - spent) // 4, 20))
        return repeat_until_precise(
            make, judge, target_cv=target_cv, first=first, largest=both[1],
            max_evaluations=budget - spent, meter=state.meter, enough=is_poor,
        )  # fmt: skip

    found = repeated()
    if is_poor(found[0]):
        spent += sum(one.evaluations for one in found)
        label = first_stage(state).label
        reason += f"; of what fails by the {label} {found[0].share:.1%} fails: a poor guide"
        algorithm = "subset"
        found = repeated()
    return Tail(found, algorithm, reason, spent + sum(one.evaluations for one in found))

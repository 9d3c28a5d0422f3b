"""Independent runs, each as large as is still needed, pooled until the estimate is good enough."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from stiction.progress import SILENT, Meter, TimeUp

MARGIN = 1.1
"""The variance known so far is itself an estimate; aim a little further."""


AnyRun = TypeVar("AnyRun", bound="Run")


class Run(Protocol):
    """What pooling needs to know of a run."""

    @property
    def samples(self) -> int:
        """Size; the variance falls like one over it."""

    @property
    def evaluations(self) -> int:
        """Cost."""

    @property
    def complete(self) -> bool:
        """Whether it came to an estimate."""

    def light(self: AnyRun) -> AnyRun:
        """The same without what only the last run is asked for."""


class TailRun(Run, Protocol):
    """A run that estimates a whole stretch of the lower tail."""

    @property
    def extent(self) -> tuple[float, float]:
        """Lowest and highest stress seen, Pa."""

    def probability(self, value: float) -> float:
        """Estimate of P(onset < value)."""

    def relative_variance(self, value: float) -> float:
        """Squared coefficient of variation of it."""


AnyTailRun = TypeVar("AnyTailRun", bound=TailRun)


def weights(runs: Sequence[Run]) -> list[float]:
    """Each run's part in the pooled mean: by its size, which does not depend on its outcome."""
    total = sum(run.samples for run in runs)
    return [run.samples / total for run in runs]


def run_until_precise(
    make: Callable[[int, int, int], AnyRun],
    judge: Callable[[Sequence[AnyRun]], float],
    *,
    target_cv: float,
    first: int,
    largest: int,
    max_evaluations: int,
    meter: Meter = SILENT,
) -> list[AnyRun]:
    """Runs until their pooled coefficient of variation is at most the target.

    Parameters
    ----------
    make : callable
        (samples, number of the run, evaluations left) to a run.
    judge : callable
        Coefficient of variation of what runs tell together.
    target_cv : float
    first, largest : int
        Size of the first run and of the largest; many runs of moderate size bound the memory.
    max_evaluations : int
    meter : Meter
        Told what is still to come; if its time is over no run is begun.

    Returns
    -------
    list of runs
        All complete, or a single incomplete one.

    Raises
    ------
    TimeUp
        If the first run had no time for anything.
    """
    runs: list[AnyRun] = []
    spent, size = 0, first
    while True:
        try:
            run = make(size, len(runs), max_evaluations - spent)
        except TimeUp:
            if runs:
                return runs
            raise
        spent += run.evaluations
        if not run.complete:
            return runs or [run]
        runs = [*(earlier.light() for earlier in runs), run]
        cv = judge(runs)
        if cv <= target_cv:
            return runs
        total = sum(r.samples for r in runs)
        price = sum(r.evaluations for r in runs) / total
        wanted = MARGIN * total * (cv / target_cv) ** 2 - total if math.isfinite(cv) else total
        affordable = (max_evaluations - spent) / price
        size = int(min(max(wanted, first), largest, affordable))
        if size < first or meter.over:
            return runs
        meter.expect(size * sum(cost(r) for r in runs) / total)


def cost(run: Run) -> int:
    """Samples that a run asked any method for."""
    return run.evaluations + int(getattr(run, "first_stage_evaluations", 0))


@dataclass(frozen=True, eq=False)
class Tail(Generic[AnyTailRun]):
    """The lower tail of the stress at onset from pooled runs.

    Attributes
    ----------
    runs : sequence of runs
    """

    runs: Sequence[AnyTailRun]

    def probability(self, stress: float) -> float:
        """Estimate of P(onset below `stress`)."""
        parts = zip(weights(self.runs), self.runs, strict=True)
        return sum(weight * run.probability(stress) for weight, run in parts)

    def coefficient_of_variation(self, stress: float) -> float:
        """Of `probability(stress)`; infinite where no sample went so low."""
        whole = self.probability(stress)
        if whole == 0.0:
            return math.inf
        variance = 0.0
        for weight, run in zip(weights(self.runs), self.runs, strict=True):
            part = weight * run.probability(stress)
            if part > 0.0:
                variance += part * part * run.relative_variance(stress)
        return math.sqrt(variance) / whole

    def quantile(self, probability: float) -> float:
        """Stress below which the onset lies with this probability."""
        low = min(run.extent[0] for run in self.runs)
        high = max(run.extent[1] for run in self.runs)
        for _ in range(80):
            middle = 0.5 * (low + high)
            if self.probability(middle) < probability:
                low = middle
            else:
                high = middle
        return high

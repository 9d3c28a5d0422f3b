"""Runs down the lower tail to a probability, and the stresses that they find there."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stiction.reliability.algorithms import BRIDGE, BRIDGE_MOST, SUBSET, SUBSET_MOST
from stiction.reliability.effort import first_stage
from stiction.reliability.limit_state import LimitState
from stiction.reliability.pooling import AnyTailRun, Tail, run_until_precise
from stiction.reliability.request import first_size
from stiction.reliability.subset import Descent, descend
from stiction.reliability.two_level import Bridge, bridge
from stiction.reliability.uncertainty import generator, log_width

DEEPER = 0.3
"""Runs go on to this share of the probability, to know the lower end of the interval."""


@dataclass(frozen=True)
class TailRequest:
    """How far down, and how precisely.

    Attributes
    ----------
    state : LimitState
    probability, target_cv : float
    seed, budget : int
    spent : int
        Evaluations already made to choose the algorithm.
    """

    state: LimitState
    probability: float
    target_cv: float
    seed: int
    budget: int
    spent: int = 0

    def pooled(
        self, make: Callable[[int, int, int], AnyTailRun], first: int, largest: int
    ) -> Tail[AnyTailRun]:
        """Runs until the probability is known as precisely as asked at its own quantile."""

        def judge(runs: Sequence[AnyTailRun]) -> float:
            tail = Tail(runs)
            return tail.coefficient_of_variation(tail.quantile(self.probability))

        return Tail(
            run_until_precise(
                make,
                judge,
                target_cv=self.target_cv,
                first=first_size(first, self.budget),
                largest=largest,
                max_evaluations=self.budget,
                meter=self.state.meter,
            )
        )


def subset_tail(request: TailRequest) -> Tail[Descent]:
    """The tail down to a probability, by subset simulation."""
    state = request.state

    def make(samples: int, number: int, left: int) -> Descent:
        return descend(
            state,
            state.dimension,
            rng=generator(request.seed, 5, number),
            samples=samples,
            probability=DEEPER * request.probability,
            floor=state.bounds[0],
            max_evaluations=left,
        )

    return request.pooled(make, SUBSET, SUBSET_MOST)


def two_level_tail(request: TailRequest) -> Tail[Bridge]:
    """The same by subset simulation of the first stage, with the method itself at its end."""
    state = request.state
    cheap = state.by(first_stage(state))

    def make(samples: int, number: int, left: int) -> Bridge:
        return bridge(
            cheap,
            state,
            state.dimension,
            samples=samples,
            rng=generator(request.seed, 6, number),
            max_evaluations=left,
            probability=request.probability,
            floor=state.bounds[0],
        )

    return request.pooled(make, BRIDGE, BRIDGE_MOST)


def stress_interval(
    tail: Tail[AnyTailRun], probability: float, cv: float, confidence: float, lowest: float
) -> tuple[float, float]:
    """Stresses whose estimated probabilities bracket the one asked for."""
    if not math.isfinite(cv):
        return lowest, tail.runs[0].extent[1]
    width = min(log_width(cv, confidence), 700.0)
    below = probability * math.exp(-width)
    seen = tail.probability(np.nextafter(min(run.extent[0] for run in tail.runs), math.inf))
    low = tail.quantile(below) if below >= seen else lowest
    return low, tail.quantile(min(probability * math.exp(width), 1.0))

"""Design stress: the stress below which the interface lets go with a given probability."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from stiction._model import describe
from stiction.criterion.method import LocalCriterion
from stiction.errors import InputError
from stiction.fields.random_field import RandomField, warn_if_inaccurate
from stiction.methods import Method
from stiction.problem import Problem
from stiction.reliability.estimate import (
    FREQUENT,
    budget_of,
    check_algorithm,
    check_target,
    usable_first_stage,
)
from stiction.reliability.limit_state import Event, LimitState, make_limit_state
from stiction.reliability.pooled import AnyTailRun, Tail, run_until_precise
from stiction.reliability.result import say
from stiction.reliability.sampled import BRIDGE, BRIDGE_MOST, SUBSET, SUBSET_MOST
from stiction.reliability.subset import Descent, descend
from stiction.reliability.two_level import Bridge, bridge
from stiction.reliability.uncertainty import generator, log_width

DEEPER = 0.3
"""Runs go on to this share of the probability, to know the lower end of the interval."""


@dataclass(frozen=True, eq=False)
class DesignStress:
    """A stress and the probability that the interface lets go below it.

    Attributes
    ----------
    stress : float
        Pa.
    interval : tuple of float
        Confidence interval of the stress, Pa.
    probability : float
        Asked for.
    coefficient_of_variation : float
        Of the failure probability at `stress`; the stress itself is known far better.
    evaluations, first_stage_evaluations : int
        Samples that the method, and only the local criterion, were asked for.
    lower_bound, stress_above_bound : float
        Pa; no sample lets go below `lower_bound`.
    algorithm, reason : str
    confidence : float
        Of `interval`.
    diagnostics : dict
    warnings : tuple of str
        Why the result is not to be trusted; empty if it is.
    """

    stress: float
    interval: tuple[float, float]
    probability: float
    coefficient_of_variation: float
    evaluations: int
    lower_bound: float
    algorithm: str
    reason: str
    confidence: float
    first_stage_evaluations: int = 0
    diagnostics: Mapping[str, float] = field(default_factory=dict, repr=False)
    warnings: tuple[str, ...] = ()

    @property
    def stress_above_bound(self) -> float:
        """`stress` less `lower_bound`, Pa."""
        return self.stress - self.lower_bound

    def __str__(self) -> str:
        low, high = self.interval
        return (
            f"{self.stress / 1e6:.7g} MPa ({100 * self.confidence:g} %: {low / 1e6:.7g} to"
            f" {high / 1e6:.7g}), {self.stress_above_bound / 1e3:.4g} kPa above the bound, at"
            f" P = {self.probability:g}; {self.algorithm}, {self.evaluations} evaluations"
        )


def check_probability(name: str, value: Any) -> list[str]:
    """Why a number is no probability to sample for."""
    real = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    if not real or not 0.0 < value < 1.0:
        return [f"{name}: must lie between 0 and 1, got {describe(value)}"]
    if value < 1e-30:
        return [f"{name}: must be at least 1e-30, got {value!r}"]
    return []


def stress_interval(
    tail: Tail[AnyTailRun], probability: float, cov: float, confidence: float, lowest: float
) -> tuple[float, float]:
    """Stresses whose estimated probabilities bracket the one asked for."""
    if not math.isfinite(cov):
        return lowest, tail.runs[0].extent[1]
    width = min(log_width(cov, confidence), 700.0)
    below = probability * math.exp(-width)
    seen = tail.probability(np.nextafter(min(run.extent[0] for run in tail.runs), math.inf))
    low = tail.quantile(below) if below >= seen else lowest
    return low, tail.quantile(min(probability * math.exp(width), 1.0))


def subset_tail(
    state: LimitState, probability: float, seed: int, target_cov: float, budget: int
) -> Tail[Descent]:
    """The tail down to a probability, by subset simulation."""

    def make(samples: int, number: int, left: int) -> Descent:
        return descend(
            state,
            state.dimension,
            rng=generator(seed, 5, number),
            samples=samples,
            probability=DEEPER * probability,
            max_evaluations=left,
        )

    def judge(runs: Sequence[Descent]) -> float:
        tail = Tail(runs)
        return tail.coefficient_of_variation(tail.quantile(probability))

    runs = run_until_precise(
        make,
        judge,
        target_cov=target_cov,
        first=SUBSET,
        largest=SUBSET_MOST,
        max_evaluations=budget,
    )
    return Tail(runs)


def _two_level_tail(
    state: LimitState, probability: float, seed: int, target_cov: float, budget: int
) -> Tail[Bridge]:
    cheap = state.by(LocalCriterion())

    def make(samples: int, number: int, left: int) -> Bridge:
        return bridge(
            cheap,
            state,
            state.dimension,
            samples=samples,
            rng=generator(seed, 6, number),
            max_evaluations=left,
            probability=probability,
        )

    def judge(runs: Sequence[Bridge]) -> float:
        tail = Tail(runs)
        return tail.coefficient_of_variation(tail.quantile(probability))

    runs = run_until_precise(
        make,
        judge,
        target_cov=target_cov,
        first=BRIDGE,
        largest=BRIDGE_MOST,
        max_evaluations=budget,
    )
    return Tail(runs)


def _finish(
    state: LimitState,
    tail: Tail[AnyTailRun],
    probability: float,
    target_cov: float,
    confidence: float,
    algorithm: str,
    reason: str,
    first_stage: int,
) -> DesignStress:
    lowest = state.bounds[0]
    evaluations = sum(run.evaluations for run in tail.runs)
    doubts = []
    if tail.runs[0].complete:
        stress = tail.quantile(probability)
        cov = tail.coefficient_of_variation(stress)
        interval = stress_interval(tail, probability, cov, confidence, lowest)
        if cov > target_cov:
            doubts.append(
                f"the coefficient of variation of the probability is {cov:.2g}, not"
                f" {target_cov:g}: {evaluations} evaluations do not suffice; raise max_evaluations"
            )
    else:
        seen = tail.runs[0].extent[0] if evaluations else state.bounds[1]
        stress, cov, interval = seen, math.inf, (lowest, seen)
        doubts.append(
            f"{evaluations} evaluations do not reach P = {probability:g}: the stress lies below"
            f" {seen:.7g} Pa, the lowest seen; raise max_evaluations"
        )
    return DesignStress(
        stress=stress,
        interval=interval,
        probability=probability,
        coefficient_of_variation=cov,
        evaluations=evaluations,
        first_stage_evaluations=first_stage,
        lower_bound=lowest,
        algorithm=algorithm,
        reason=reason,
        confidence=confidence,
        diagnostics={
            "runs": len(tail.runs),
            "effective_families": 1.0 / cov**2 if cov > 0.0 else math.inf,
        },
        warnings=say(doubts),
    )


def design_stress(
    problem: Problem,
    strength: RandomField,
    *,
    probability: float,
    method: Method,
    algorithm: Literal["auto", "subset", "two_level"] = "auto",
    target_cov: float = 0.1,
    seed: int = 0,
    max_evaluations: int | None = None,
    confidence: float = 0.95,
    event: Event = "critical_stress",
    residual_strength: RandomField | None = None,
    initial_stress: RandomField | None = None,
    weakening_rate: RandomField | None = None,
    workers: int | None = None,
) -> DesignStress:
    """Below which stress does the interface let go with a given probability?

    The quantile of the stress at onset, from one set of subset runs: nothing is searched for.

    Parameters
    ----------
    problem : Problem
    strength : RandomField
        Peak strength, Pa.
    probability : float
        Between 0 and 1, such as 1e-6.
    method : LocalCriterion or Equilibrium
    algorithm : {"auto", "subset", "two_level"}
        'auto' takes two levels for equilibrium where the local criterion holds and the
        probability is below 1 %, else subset simulation by the method itself.
    target_cov : float
        Coefficient of variation to reach, of the failure probability at the stress.
    seed, max_evaluations, confidence, event, workers
        As in `failure_probability`.
    residual_strength, initial_stress, weakening_rate : RandomField, optional
        What is random besides the strength.

    Returns
    -------
    DesignStress
        With `stress` and `interval`, Pa.

    Raises
    ------
    InputError
        Naming all that does not fit.

    Warns
    -----
    AccuracyWarning
        If the evaluations allowed do not suffice.
    """
    fields = {
        "residual_strength": residual_strength,
        "initial_stress": initial_stress,
        "weakening_rate": weakening_rate,
    }
    problems = check_target(target_cov, confidence, max_evaluations)
    problems += check_probability("probability", probability)
    try:
        state = make_limit_state(problem, strength, method, seed, fields, event, workers)
        problems += check_sampling(state)
        problems += check_algorithm(state, algorithm, ("auto", "subset", "two_level"))
    except InputError as error:
        problems += error.problems
    if problems:
        raise InputError(problems)
    for _, random in state.fields:
        warn_if_inaccurate(random, problem.interface)
    budget, reason, chosen = budget_of(state, max_evaluations), "as asked", str(algorithm)
    if algorithm == "auto":
        if usable_first_stage(state) is None and probability < FREQUENT:
            chosen, reason = "two_level", "the local criterion resembles equilibrium and is cheap"
        else:
            chosen, reason = "subset", "the method itself goes down the tail"
    if chosen == "two_level":
        bridges = _two_level_tail(state, float(probability), int(seed), target_cov, budget)
        cheap = sum(run.first_stage_evaluations for run in bridges.runs)
        return _finish(
            state, bridges, float(probability), target_cov, confidence, chosen, reason, cheap
        )
    tail = subset_tail(state, float(probability), int(seed), target_cov, budget)
    return _finish(state, tail, float(probability), target_cov, confidence, chosen, reason, 0)


def check_sampling(state: LimitState) -> list[str]:
    """Refuse a method too slow for thousands of samples."""
    if state.method.type != "rupture":
        return []
    return [
        "method: rupture simulations take too long for subset simulation; use st.Equilibrium(), or"
        " st.monte_carlo(...) and the quantiles of its critical_stress"
    ]

"""Design stress: the stress below which the interface slides with a given probability."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from stiction.methods import Method
from stiction.model import describe, is_real
from stiction.problem import Problem
from stiction.progress import Meter, Show, TimeUp, check_time_limit
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.reliability.effort import budget_of, first_stage, no_first_stage, refused_chains
from stiction.reliability.estimate import (
    ALIKE,
    FREQUENT,
    check_algorithm,
    check_target,
)
from stiction.reliability.limit_state import Event, LimitState, make_limit_state
from stiction.reliability.pooling import AnyTailRun, Tail
from stiction.reliability.request import advice, ran_out, short_of
from stiction.reliability.result import above_bound, as_coefficient, say
from stiction.reliability.tail_runs import (
    TailRequest,
    stress_interval,
    subset_tail,
    two_level_tail,
)
from stiction.reliability.two_level import agreement

TYPICAL = 200
"""Plain samples whose median is the typical stress: to 2 % where it scatters by 20 %."""
PILOT = 500
"""Plain samples by which 'auto' judges the first stage."""


@dataclass(frozen=True, eq=False)
class DesignStress:
    """A stress and the probability that the interface slides below it.

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
        Pa; no sample slides below `lower_bound`.
    algorithm, reason : str
    confidence : float
        Of `interval`.
    diagnostics : dict
    cut_short : bool
        Whether `time_limit` ended it before `target_cv` was reached.
    warnings : tuple of str
        Why the result is not to be trusted; empty if it is.
    typical_stress : float
        Median stress at onset of 200 plain samples, Pa: what every second joint holds.
    normal_pressure : float
        Mean over the interface, Pa; NaN if the problem has none.
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
    cut_short: bool = False
    warnings: tuple[str, ...] = ()
    typical_stress: float = math.nan
    normal_pressure: float = math.nan

    @property
    def safety_factor(self) -> float:
        """`typical_stress` over `stress`: by how much a joint that holds on average is reduced."""
        return self.typical_stress / self.stress

    @property
    def friction_coefficient(self) -> float:
        """`stress` over the mean normal pressure; NaN without one."""
        return self.stress / self.normal_pressure

    @property
    def stress_above_bound(self) -> float:
        """`stress` less `lower_bound`, Pa."""
        return self.stress - self.lower_bound

    def __str__(self) -> str:
        low, high = self.interval
        return (
            f"{self.stress / 1e6:.7g} MPa ({100 * self.confidence:g} %: {low / 1e6:.7g} to"
            f" {high / 1e6:.7g}){as_coefficient(self.friction_coefficient)}"
            f"{above_bound(self.stress, self.lower_bound)}, at P = {self.probability:g};"
            f" {self.algorithm}, {self.evaluations} evaluations"
            f"{', cut short' if self.cut_short else ''}"
        )


def check_probability(name: str, value: Any) -> list[str]:
    """Why a number is no probability to sample for."""
    if not is_real(value) or not 0.0 < value < 1.0:
        return [f"{name}: must lie between 0 and 1, got {describe(value)}"]
    if value < 1e-30:
        return [f"{name}: must be at least 1e-30, got {value!r}"]
    return []


def _chosen(state: LimitState, probability: float, seed: int, budget: int) -> tuple[str, str, int]:
    """Algorithm, reason, and the evaluations it took to choose."""
    if probability >= FREQUENT or no_first_stage(state) is not None:
        return "subset", "the method itself goes down the tail", 0
    draws = state.draws(seed, 0, min(PILOT, budget // 5))
    share = agreement(state.by(first_stage(state))(draws), state(draws))
    label = first_stage(state).label
    seen = f"of {draws.shape[0]} plain samples the {label} picks {share:.0%} of the weakest"
    if share >= ALIKE:
        return "two_level", f"{seen}, at a tenth of the cost", draws.shape[0]
    return "subset", f"{seen} only", draws.shape[0]


def _finish(
    request: TailRequest,
    tail: Tail[AnyTailRun],
    confidence: float,
    algorithm: str,
    reason: str,
    first_stage: int,
) -> DesignStress:
    state, probability, target_cv = request.state, request.probability, request.target_cv
    lowest = state.bounds[0]
    evaluations = request.spent + sum(run.evaluations for run in tail.runs)
    doubts = []
    if tail.runs[0].complete:
        stress = tail.quantile(probability)
        cv = tail.coefficient_of_variation(stress)
        least = math.nextafter(lowest, math.inf)
        on_it = tail.probability(least)
        if on_it >= probability:
            stress, cv = lowest, tail.coefficient_of_variation(least)
            doubts.append(
                f"{on_it:.2g} of all samples slide at the bound of {lowest:.7g} Pa, as far as the"
                f" method can tell: the stress at P = {probability:g} is the bound itself"
            )
        interval = stress_interval(tail, probability, cv, confidence, lowest)
        if cv > target_cv:
            doubts.append(
                f"the coefficient of variation of the probability is {cv:.3g}, not"
                f" {target_cv:g}: {short_of(state, evaluations)}"
            )
    else:
        # What was seen of the tail bounds the stress: below its lowest value nothing is known.
        seen = tail.runs[0].extent[0]
        stress, cv, interval = seen, math.inf, (lowest, seen)
        place = f"the stress lies below {seen:.7g} Pa, the lowest seen"
        if not seen > lowest:
            stress, interval = lowest, (lowest, state.bounds[1])
            place = f"some samples slide at the bound of {lowest:.7g} Pa, too few to tell more"
        elif not math.isfinite(seen):
            stress, interval = math.nan, state.bounds
            place = "the method itself was not asked"
        doubts.append(
            f"{ran_out(state, evaluations)} do not reach P = {probability:g}: {place};"
            f" {advice(state)}"
        )
    return DesignStress(
        stress=stress,
        interval=interval,
        probability=probability,
        coefficient_of_variation=cv,
        evaluations=evaluations,
        first_stage_evaluations=first_stage,
        lower_bound=lowest,
        algorithm=algorithm,
        reason=reason,
        confidence=confidence,
        diagnostics={
            "runs": len(tail.runs),
            "effective_families": 1.0 / cv**2 if cv > 0.0 else math.inf,
        },
        cut_short=state.meter.over and cv > target_cv,
        warnings=say(doubts),
    )


def design_stress(
    problem: Problem,
    random: RandomInterface | RandomField,
    *,
    probability: float,
    method: Method,
    algorithm: Literal["auto", "subset", "two_level"] = "auto",
    target_cv: float = 0.1,
    seed: int = 0,
    max_evaluations: int | None = None,
    confidence: float = 0.95,
    event: Event = "critical_stress",
    workers: int | None = None,
    time_limit: float | None = None,
    progress: Show = True,
) -> DesignStress:
    """Below which stress does the interface slide with a given probability?

    The quantile of the stress at onset, from one set of subset runs: nothing is searched for.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface or RandomField
        What is random; a field alone is the peak strength, Pa.
    probability : float
        Between 0 and 1, such as 1e-6.
    method : LocalCriterion or Equilibrium
    algorithm : {"auto", "subset", "two_level"}
        'auto' takes two levels for equilibrium if the probability is below 1 % and the local
        criterion picks the same plain samples as the weakest, else subset simulation by the
        method itself.
    target_cv : float
        Coefficient of variation to reach, of the failure probability at the stress.
    seed, max_evaluations, confidence, event, workers, time_limit, progress
        As in `failure_probability`.

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
        If the evaluations or the time allowed do not suffice, or the onset piles up on the bound.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> method = st.LocalCriterion()
    >>> found = st.design_stress(problem, strength, probability=1e-3, method=method, target_cv=0.3)
    >>> bool(found.stress > found.lower_bound)
    True
    """
    problems = check_target(target_cv, confidence, max_evaluations)
    problems += check_probability("probability", probability) + check_time_limit(time_limit)
    meter = Meter("design_stress", show=progress, time_limit=time_limit)
    state = make_limit_state(
        problem,
        random,
        method,
        seed,
        event,
        workers,
        meter=meter,
        problems=problems,
        check=lambda state: (
            refused_chains(state, max_evaluations)
            or check_algorithm(state, algorithm, ("auto", "subset", "two_level"), max_evaluations)
        ),
    )
    request = TailRequest(
        state, float(probability), target_cv, int(seed), budget_of(state, max_evaluations)
    )
    with meter:
        meter.expect(request.budget, at_most=True)
        found = _sampled(request, algorithm, confidence)
        try:
            typical = float(np.median(state(state.draws(int(seed), 0, TYPICAL))))
        except TimeUp:
            typical = math.nan
    return replace(found, typical_stress=typical, normal_pressure=state.pressure)


def _sampled(request: TailRequest, algorithm: str, confidence: float) -> DesignStress:
    """The answer by an algorithm, as far as there is time."""
    chosen, reason = algorithm, "as asked"
    try:
        if algorithm == "auto":
            chosen, reason, spent = _chosen(
                request.state, request.probability, request.seed, request.budget
            )
            request = replace(request, budget=request.budget - spent, spent=spent)
        if chosen == "two_level":
            bridges = two_level_tail(request)
            cheap = sum(run.first_stage_evaluations for run in bridges.runs)
            return _finish(request, bridges, confidence, chosen, reason, cheap)
        return _finish(request, subset_tail(request), confidence, chosen, reason, 0)
    except TimeUp as up:
        spent = request.spent + up.spent
        text = f"nothing is known of the stress: {short_of(request.state, spent)}"
        return DesignStress(
            stress=math.nan,
            interval=request.state.bounds,
            probability=request.probability,
            coefficient_of_variation=math.inf,
            evaluations=spent,
            lower_bound=request.state.bounds[0],
            algorithm="none",
            reason=reason,
            confidence=confidence,
            cut_short=True,
            warnings=say([text]),
        )

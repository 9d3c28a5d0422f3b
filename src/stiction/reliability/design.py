"""Design stress: the stress below which the interface slides with a given probability."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from stiction.ensemble.experiment import Experiment
from stiction.methods import MethodObject
from stiction.model import Count, Progress, Seconds, checked
from stiction.problem import Problem
from stiction.progress import Meter, TimeUp
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.reliability.answer import (
    Budget,
    Confidence,
    DesignStress,
    Probability,
    Seed,
    TargetCv,
    advice,
    imprecise,
    nothing_known,
    prepare,
    ran_out,
    warned,
)
from stiction.reliability.guide import budget_of, exact_doubts
from stiction.reliability.limit_state import Event, LimitState
from stiction.reliability.tail import Tail, sample_tail

FREQUENT = 0.01
"""From here on the method itself goes down the tail."""
TYPICAL = 200
"""Plain samples whose median is the typical stress: to 2 % where it scatters by 20 %."""


@checked
def design_stress(
    problem: Problem,
    random: RandomInterface | RandomField,
    *,
    probability: Probability,
    method: MethodObject,
    algorithm: Literal["auto", "subset", "two_level"] = "auto",
    target_cv: TargetCv = 0.1,
    seed: Seed = 0,
    max_evaluations: Budget | None = None,
    confidence: Confidence = 0.95,
    event: Event = "critical_stress",
    workers: Count | None = None,
    time_limit: Seconds | None = None,
    progress: Progress = True,
) -> DesignStress:
    """Estimate the stress below which the interface slides with a given probability.

    The quantile of the stress at onset, from one set of repetitions of subset simulation.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface or RandomField
        What is random; a field alone is the peak strength, Pa.
    probability : float
        Between 0 and 1, such as 1e-6.
    method : LocalCriterion or Equilibrium
        `Rupture`, and a method that would take more than a quarter of an hour on one core, is
        refused unless `max_evaluations` is 20,000 or more.
    algorithm : {"auto", "subset", "two_level"}
        As in `failure_probability`.
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
        Naming everything that does not fit.
    TimeoutError
        If nothing is known after `time_limit`.

    Warns
    -----
    AccuracyWarning
        If the evaluations or the time allowed do not suffice, the onset piles up on the bound, or
        samples about the stress fail otherwise by equilibrium than by the local criterion.

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
    experiment = Experiment(problem, random, method, seed=seed)
    meter = Meter("design_stress", show=progress, time_limit=time_limit)
    state = prepare(
        experiment,
        event,
        workers,
        meter,
        algorithm="subset" if algorithm == "auto" else algorithm,
        max_evaluations=max_evaluations,
    )
    reason = "as asked"
    if algorithm == "auto":
        reason = "frequent" if probability >= FREQUENT else "rare"
        algorithm = "subset" if probability >= FREQUENT else "auto"
    with meter:
        try:
            tail = sample_tail(
                state,
                algorithm=algorithm,
                target_cv=target_cv,
                seed=seed,
                budget=budget_of(state, max_evaluations),
                probability=probability,
                reason=reason,
            )
            stress, cv, interval, doubts = _quantile(state, tail, probability, confidence)
            doubts += imprecise(state, cv, target_cv, tail.spent) if tail.complete else []
            if tail.algorithm == "subset" and tail.complete and not meter.over:
                last = tail.repetitions[-1].population(stress)
                doubts += exact_doubts(state, last.draws, last.values, stress, probability)
        except TimeUp:
            raise nothing_known(state) from None
        try:
            median = float(np.median(state(state.draws(seed, 0, TYPICAL))))
        except TimeUp:
            median = math.nan
    return DesignStress(
        stress=stress,
        probability=probability,
        interval=interval,
        cv=cv,
        evaluations=tail.spent,
        first_stage_evaluations=tail.first_stage_evaluations,
        lower_bound=state.bounds[0],
        algorithm=tail.algorithm,
        reason=tail.reason,
        confidence=confidence,
        diagnostics={
            "repetitions": len(tail.repetitions),
            "effective_families": 1.0 / cv**2 if cv > 0.0 else math.inf,
        },
        cut_short=meter.over and cv > target_cv,
        warnings=warned(doubts),
        median_stress=median,
        normal_pressure=experiment.pressure,
    )


def _quantile(
    state: LimitState, tail: Tail, probability: float, confidence: float
) -> tuple[float, float, tuple[float, float], list[str]]:
    """Return the stress, the coefficient of variation of its probability, interval and doubts."""
    lowest = state.bounds[0]
    if tail.complete:
        stress = tail.quantile(probability)
        cv, doubts = tail.cv(stress), []
        least = math.nextafter(lowest, math.inf)
        on_it = tail.probability(least)
        if on_it >= probability:
            stress, cv = lowest, tail.cv(least)
            doubts.append(
                f"{on_it:.2g} of all samples slide at the bound of {lowest:.7g} Pa, as far as the"
                f" method can tell: the stress at P = {probability:g} is the bound itself"
            )
        return stress, cv, tail.stress_interval(probability, cv, confidence, lowest), doubts
    # What was seen of the tail bounds the stress: below its lowest value nothing is known.
    stress = tail.extent[0]
    interval, place = (lowest, stress), f"the stress lies below {stress:.7g} Pa, the lowest seen"
    if not stress > lowest:
        stress, interval = lowest, (lowest, state.bounds[1])
        place = f"some samples slide at the bound of {lowest:.7g} Pa, too few to tell more"
    elif not math.isfinite(stress):
        stress, interval = math.nan, state.bounds
        place = "the method itself was not asked"
    text = (
        f"{ran_out(state, tail.spent)} do not reach P = {probability:g}: {place}; {advice(state)}"
    )
    return stress, math.inf, interval, [text]

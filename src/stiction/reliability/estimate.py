"""Failure probability: checks, exact answers, choice of algorithm, and the report."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from stiction.arrays import Array
from stiction.errors import unknown_name
from stiction.methods import Method
from stiction.model import describe, is_finite, is_real, is_whole
from stiction.problem import Problem
from stiction.progress import Meter, Show, TimeUp, check_time_limit
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.reliability.algorithms import (
    by_counting,
    by_importance,
    by_subset,
    by_two_levels,
    counted,
    unknown,
)
from stiction.reliability.effort import budget_of, first_stage, no_first_stage, too_slow
from stiction.reliability.limit_state import (
    Event,
    LimitState,
    make_limit_state,
)
from stiction.reliability.plain_monte_carlo import tally
from stiction.reliability.request import Request
from stiction.reliability.result import FailureProbability
from stiction.reliability.two_level import agreement

Algorithm = Literal["auto", "plain", "subset", "importance", "two_level"]
ALGORITHMS = ("auto", "plain", "subset", "importance", "two_level")

PILOT = 1_000
"""Plain samples that tell which algorithm to take."""
ALIKE = 0.9
"""Share of the weakest plain samples that the local criterion must pick to lead to the rarest."""
FREQUENT = 0.01
"""From here on plain sampling needs no more evaluations than subset simulation."""


LEAST_COV = 1e-6
"""A smaller coefficient of variation would take more than 1e12 failures."""


def check_target(target_cv: Any, confidence: Any, max_evaluations: Any) -> list[str]:
    """What is wrong with the options that all functions of this package share."""
    problems = []
    if not (is_finite(target_cv) and target_cv >= LEAST_COV):
        problems.append(f"target_cv: must be a number >= {LEAST_COV:g}, got {describe(target_cv)}")
    if not (is_real(confidence) and 0.0 < confidence < 1.0):
        problems.append(f"confidence: must lie between 0 and 1, got {describe(confidence)}")
    if max_evaluations is not None and not is_whole(max_evaluations, 100):
        problems.append(
            f"max_evaluations: must be a whole number >= 100, got {describe(max_evaluations)}"
        )
    return problems


def check_stress(name: str, value: Any) -> list[str]:
    """Why a number is no stress."""
    if is_finite(value):
        return []
    return [f"{name}: must be a finite number in Pa, got {describe(value)}"]


def check_coefficient(name: str, value: Any) -> list[str]:
    """Why a number is no friction coefficient."""
    if is_finite(value) and value > 0.0:
        return []
    return [f"{name}: must be a positive number, got {describe(value)}"]


def check_algorithm(
    state: LimitState, algorithm: str, valid: tuple[str, ...], max_evaluations: int | None
) -> list[str]:
    """Why an algorithm cannot be used here; no texts if it can."""
    if not isinstance(algorithm, str):
        return [f"algorithm: must be one of {', '.join(valid)}, got {describe(algorithm)}"]
    if algorithm not in valid:
        return [unknown_name("algorithm", algorithm, valid)]
    if algorithm in ("auto", "plain"):
        return []
    reason = too_slow(state, max_evaluations)
    if reason is not None:
        return [f"algorithm: {reason}"]
    if algorithm == "two_level":
        reason = no_first_stage(state)
    elif algorithm == "importance":
        reason = state.not_alike_everywhere()
    return [] if reason is None else [f"algorithm: {algorithm!r} is not possible: {reason}"]


def _exact(request: Request, probability: float, reason: str) -> FailureProbability:
    return FailureProbability(
        probability=probability,
        coefficient_of_variation=0.0,
        interval=(probability, probability),
        evaluations=0,
        stress=request.stress,
        lower_bound=request.state.bounds[0],
        algorithm="exact",
        reason=reason,
        confidence=request.confidence,
    )


def _chosen(request: Request, draws: Array, values: Array) -> tuple[str, str]:
    """Algorithm and reason, by the pilot's draws and stresses.

    What told which algorithm to take does not enter its estimate: counting is chosen where the
    pilot happens to hold many failures.
    """
    state, pilot = request.state, tally(values, request.stress)
    plural = "s" * (pilot.failures != 1)
    seen = f"{pilot.failures} failure{plural} among {pilot.samples} plain samples"
    if pilot.probability >= FREQUENT:
        return "plain", f"{seen}: frequent enough to count"
    if no_first_stage(state) is None:
        share = agreement(state.by(first_stage(state))(draws), values)
        if share >= ALIKE:
            text = (
                f"{seen}: rare; the {first_stage(state).label} resembles it, at a tenth of its cost"
            )
            return "two_level", text
        seen += f"; the {first_stage(state).label} picks only {share:.0%} of the weakest of them"
    return "subset", f"{seen}: rare, and subset simulation does not need to know where"


def failure_probability(
    problem: Problem,
    random: RandomInterface | RandomField,
    stress: float | None = None,
    *,
    method: Method,
    friction_coefficient: float | None = None,
    algorithm: Algorithm = "auto",
    target_cv: float = 0.1,
    seed: int = 0,
    max_evaluations: int | None = None,
    confidence: float = 0.95,
    event: Event = "critical_stress",
    workers: int | None = None,
    time_limit: float | None = None,
    progress: Show = True,
) -> FailureProbability:
    """How likely does an interface of random strength slide below a given stress?

    Parameters
    ----------
    problem : Problem
    random : RandomInterface or RandomField
        What is random; a field alone is the peak strength, Pa.
    stress : float, optional
        Mean interface stress that it must hold, Pa. Failure is an onset strictly below it.
    method : LocalCriterion, Equilibrium or Rupture
        How the onset is found. `Rupture` goes with plain Monte Carlo only.
    friction_coefficient : float, optional
        Instead of `stress`: mean shear stress over mean normal pressure that it must hold. Where
        the pressure is random, each sample's own pressure counts.
    algorithm : {"auto", "plain", "subset", "importance", "two_level"}
        Plain Monte Carlo; subset simulation; importance sampling around the most likely weak spot
        at a random place (where the interface is alike everywhere); subset simulation by the local
        criterion with equilibrium at its end. 'auto' looks at a thousand plain samples; if 1 % of
        them fail it counts failures among others; else it takes two levels for equilibrium, if
        the local criterion picks the same samples as the weakest, and subset simulation
        otherwise. `reason` in the result says which and why.
    target_cv : float
        Coefficient of variation to reach.
    seed : int
        Not negative. The result depends on it and not on the number of workers.
    max_evaluations : int, optional
        Most samples the method is asked for: by default 2,000,000 by the local criterion, 200,000
        by equilibrium, 1,000 by rupture. If they do not suffice, the result holds what there is
        and a warning.
    confidence : float
        Of the interval.
    event : {"critical_stress", "first_instability"}
        Which stress counts as letting go: that of the whole interface, or that at which the first
        patch becomes unstable, arrested or not. By the local criterion they are the same.
    workers : int, optional
        Threads; all cores by default.
    time_limit : float, optional
        Seconds. When they are over the result holds what there is, with `cut_short` and a warning.
    progress : bool or callable
        As in `monte_carlo`; how many samples it will take is known better and better.

    Returns
    -------
    FailureProbability
        With `probability`, `coefficient_of_variation`, `interval`, `evaluations` and more.

    Raises
    ------
    InputError
        Naming all that does not fit.

    Warns
    -----
    AccuracyWarning
        If the estimate is not to be trusted; `warnings` in the result holds the same texts.

    Notes
    -----
    Subset simulation: Au and Beck (2001), Papaioannou et al. (2015); its error from the ancestry
    of the failing samples, Lee and Whiteley (2018). Intervals are binomial (Clopper and Pearson,
    1934) for plain Monte Carlo, log-normal otherwise. Plain Monte Carlo counts until it has seen
    2 + 1/target_cv^2 failures, which leaves its estimate unbiased (Haldane, 1945).

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> found = st.failure_probability(problem, strength, 0.68e6, method=st.LocalCriterion())
    >>> low, high = found.interval
    >>> bool(0.0 < low < found.probability < high < 1.0)
    True
    """
    problems = check_target(target_cv, confidence, max_evaluations)
    problems += check_time_limit(time_limit)
    if (stress is None) == (friction_coefficient is None):
        problems.append("stress: give either stress (Pa) or friction_coefficient")
    elif stress is not None:
        problems += check_stress("stress", stress)
    else:
        problems += check_coefficient("friction_coefficient", friction_coefficient)
    meter = Meter("failure_probability", show=progress, time_limit=time_limit)
    state = make_limit_state(
        problem,
        random,
        method,
        seed,
        event,
        workers,
        meter=meter,
        per_pressure=friction_coefficient is not None,
        problems=problems,
        check=lambda state: check_algorithm(state, algorithm, ALGORITHMS, max_evaluations),
    )
    budget = budget_of(state, max_evaluations)
    pilot = min(PILOT, max(budget // 5, 50))
    limit = float(stress if stress is not None else (friction_coefficient or 0.0) * state.pressure)
    request = Request(state, limit, float(target_cv), int(seed), budget, confidence, pilot)
    low, high = state.bounds
    if limit <= low:
        text = f"no interface slides at or below {low:g} Pa, where nothing slips"
        return replace(_exact(request, 0.0, text), normal_pressure=state.pressure)
    if limit >= high:
        text = f"no interface holds more than the greatest strength, {high:g} Pa"
        return replace(_exact(request, 1.0, text), normal_pressure=state.pressure)
    with meter:
        meter.expect(budget, at_most=True)
        found = _sampled(request, algorithm, too_slow(state, max_evaluations))
        return replace(found, normal_pressure=state.pressure)


def _sampled(request: Request, algorithm: str, slow: str | None) -> FailureProbability:
    """The answer by an algorithm, as far as there is time."""
    state, reason = request.state, "as asked"
    if algorithm == "auto" and slow is not None:
        algorithm, reason = "plain", slow
    if algorithm == "auto":
        draws, values = state.draws(request.seed, 0, request.pilot), np.empty(0)
        try:
            values = state(draws)
            algorithm, reason = _chosen(request, draws, values)
        except TimeUp as up:
            values = values if values.size else up.values
            reason = "the time was over while looking how frequent failures are"
            if not values.size:
                return unknown(request, reason, 0)
            return counted(request, tally(values, request.stress), values.size, reason)
        request = request.after(values.size)
    try:
        if algorithm == "plain":
            return by_counting(request, reason)
        if algorithm == "importance":
            return by_importance(request, reason)
        if algorithm == "two_level":
            return by_two_levels(request, state.by(first_stage(state)), reason)
        return by_subset(request, reason)
    except TimeUp as up:
        return unknown(request, reason, request.spent + up.spent)

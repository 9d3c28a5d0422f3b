"""Failure probability: exact answers, the choice of the algorithm, and the report."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.ensemble.experiment import Experiment
from stiction.errors import InputError, UnitWarning, warn_user
from stiction.methods import MethodObject
from stiction.model import Count, Progress, Real, Seconds, checked
from stiction.problem import Problem
from stiction.progress import Meter, TimeUp
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.reliability.answer import (
    Budget,
    Confidence,
    FailureProbability,
    Seed,
    TargetCv,
    advice,
    distinct,
    imprecise,
    nothing_known,
    prepare,
    profiles_of,
    short_of,
    warned,
)
from stiction.reliability.counting import Count as Counted
from stiction.reliability.counting import count_failures, tally
from stiction.reliability.guide import budget_of, exact_doubts, too_slow
from stiction.reliability.limit_state import Event, LimitState
from stiction.reliability.subset import MOST_LEVELS
from stiction.reliability.tail import Tail, sample_tail
from stiction.reliability.uncertainty import generator, lognormal_interval

PILOT = 1_000
"""Plain samples that tell which algorithm to take."""
FREQUENT = 0.01
"""From here on plain sampling needs no more evaluations than subset simulation."""
DOUBTFUL = 1e-3
"""Share of the mean strength below which a stress is probably in another unit."""
SHOWN = 20
"""Failing profiles kept."""
FEWEST_FAMILIES = 5.0
FEWEST_ACCEPTED = 0.1


@checked
def failure_probability(
    problem: Problem,
    random: RandomInterface | RandomField,
    stress: Real | None = None,
    *,
    method: MethodObject,
    friction_coefficient: Real | None = None,
    algorithm: Literal["auto", "plain", "subset", "two_level"] = "auto",
    target_cv: TargetCv = 0.1,
    seed: Seed = 0,
    max_evaluations: Budget | None = None,
    confidence: Confidence = 0.95,
    event: Event = "critical_stress",
    workers: Count | None = None,
    time_limit: Seconds | None = None,
    progress: Progress = True,
) -> FailureProbability:
    """Estimate the probability that an interface of random strength slides below a stress.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface or RandomField
        What is random; a field alone is the peak strength, Pa.
    stress : float, optional
        Mean interface stress that it must hold, Pa. Failure is an onset strictly below it.
    method : LocalCriterion, Equilibrium or Rupture
        The method that finds the onset. By `Rupture` failures are counted; so are they by any
        method that is too slow for subset simulation, unless `max_evaluations` is 20,000 or more.
    friction_coefficient : float, optional
        Instead of `stress`: mean shear stress over mean normal pressure that it must hold. Where
        the pressure is random, each sample's own pressure counts.
    algorithm : {"auto", "plain", "subset", "two_level"}
        Plain Monte Carlo; subset simulation; or subset simulation by the local criterion with
        equilibrium at its end. 'auto' solves a thousand plain samples; if 1 % of them fail it
        counts failures among others. Otherwise it takes two levels for equilibrium if the local
        criterion picks the same samples as the weakest and most of what it leads to is not
        wasted, else subset simulation. `reason` in the result says which and why.
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
        Whether the interface as a whole has to slide, or the first patch to become unstable,
        arrested or not. By the local criterion they are the same.
    workers : int, optional
        Threads; all cores by default.
    time_limit : float, optional
        Seconds. When they are over the result holds what there is, with `cut_short` and a warning.
    progress : bool or callable
        As in `monte_carlo`; the number of samples that it will take is not known beforehand.

    Returns
    -------
    FailureProbability
        With `probability`, `cv`, `interval`, `evaluations` and more.

    Raises
    ------
    InputError
        Naming everything that does not fit.
    TimeoutError
        If nothing is known after `time_limit`.

    Warns
    -----
    AccuracyWarning
        If the estimate is not to be trusted; `warnings` in the result holds the same texts. By the
        local criterion some failing samples are solved by equilibrium too, and both probabilities
        are given if they differ by more than their error.
    UnitWarning
        If the stress is below a thousandth of the mean strength.

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
    problems = []
    if (stress is None) == (friction_coefficient is None):
        problems.append("stress: give either stress (Pa) or friction_coefficient")
    if friction_coefficient is not None and friction_coefficient <= 0.0:
        problems.append(f"friction_coefficient: must be positive, got {friction_coefficient}")
    if problems:
        raise InputError(problems)
    experiment = Experiment(problem, random, method, seed=seed)
    meter = Meter("failure_probability", show=progress, time_limit=time_limit)
    state = prepare(
        experiment, event, workers, meter, per_pressure=stress is None, algorithm=algorithm,
        max_evaluations=max_evaluations,
    )  # fmt: skip
    pressure = experiment.pressure
    limit = float((friction_coefficient or 0.0) * pressure if stress is None else stress)
    common: dict[str, Any] = {
        "stress": limit,
        "confidence": confidence,
        "normal_pressure": pressure,
    }
    if exact := _without_sampling(state, limit):
        chance, reason = exact
        return FailureProbability(
            probability=chance, interval=(chance, chance), cv=0.0, evaluations=0,
            lower_bound=state.bounds[0], algorithm="exact", reason=reason, **common,
        )  # fmt: skip
    budget = budget_of(state, max_evaluations)
    with meter:
        try:
            found = _sampled(
                state, limit, algorithm, too_slow(state, max_evaluations), target_cv, seed, budget
            )
            report: Any = _of_count if isinstance(found[0], Counted) else _of_tail
            values, doubts = report(state, limit, *found, target_cv, seed, confidence)
        except TimeUp:
            raise nothing_known(state) from None
    return FailureProbability(
        lower_bound=state.bounds[0],
        cut_short=meter.over and values["cv"] > target_cv,
        warnings=warned(doubts),
        **values,
        **common,
    )


def _without_sampling(state: LimitState, stress: float) -> tuple[float, str] | None:
    """Return the probability and the reason where no sample is needed."""
    low, high = state.bounds
    if stress <= low:
        return 0.0, f"no interface slides at or below {low:g} Pa, where nothing slips"
    if stress >= high:
        return 1.0, f"no interface holds more than the greatest strength, {high:g} Pa"
    experiment = state.experiment
    mean = experiment.mean("strength")
    if not 0.0 < stress < DOUBTFUL * mean:
        return None
    warn_user(
        f"stress: {stress:g} Pa is {stress / mean:.1g} of the mean strength, {mean:.3g} Pa; check"
        " its unit (Pa), and give a coefficient as friction_coefficient=",
        UnitWarning,
    )
    load, field = experiment.problem.load, experiment.random.strength
    simple = np.ptp(experiment.problem.load_profile) == 0.0 and not np.any(load.initial_stress)
    if simple and field.of is None and "initial_stress" not in experiment.random.names:
        # A node must be weaker than the stress.
        chance = experiment.problem.interface.size * float(field.marginal.distribution.cdf(stress))
        if chance < 1e-300 and not state.per_pressure:
            return 0.0, "the strength at a point is lower with a probability below 1e-300"
    return None


def _sampled(
    state: LimitState,
    stress: float,
    algorithm: str,
    slow: str | None,
    target_cv: float,
    seed: int,
    budget: int,
) -> tuple[Counted | Tail, str, int]:
    """Return the count or the tail, the reason for it, and the evaluations."""
    least, reason, spent, pilot = min(PILOT, max(budget // 5, 50)), "as asked", 0, None
    if algorithm == "auto" and slow is not None:
        algorithm, reason = "plain", slow
    elif algorithm == "auto":
        # What told which algorithm to take does not enter its estimate: counting is chosen where
        # the pilot happens to hold many failures.
        draws = state.draws(seed, 0, least)
        try:
            values = state(draws)
        except TimeUp as up:
            if not up.values.size:
                raise
            return tally(up.values, stress), "the time was over in the pilot", up.values.size
        count, spent, pilot = tally(values, stress), least, (draws, values)
        seen = f"{count.failures} failure{'s' * (count.failures != 1)} of {least} plain samples"
        if count.probability >= FREQUENT:
            algorithm, reason = "plain", f"{seen}: frequent enough to count"
        else:
            reason = f"{seen}: rare"
    if algorithm == "plain":
        count, evaluations = count_failures(
            state, seed, stress, target_cv=target_cv, least=least,
            max_evaluations=budget - spent, start=spent,
        )  # fmt: skip
        return count, reason, spent + evaluations
    tail = sample_tail(
        state, algorithm=algorithm, target_cv=target_cv, seed=seed, budget=budget - spent,
        stress=stress, reason=reason, pilot=pilot,
    )  # fmt: skip
    return tail, tail.reason, spent + tail.spent


def _of_count(
    state: LimitState,
    stress: float,
    count: Counted,
    reason: str,
    evaluations: int,
    target_cv: float,
    seed: int,
    confidence: float,
) -> tuple[dict[str, Any], list[str]]:
    """Return the answer by counting, and the doubts."""
    draws = _drawn(state, seed, count.numbers[:SHOWN])
    values = {
        "probability": count.probability,
        "cv": count.cv,
        "interval": count.interval(confidence),
        "evaluations": evaluations,
        "algorithm": "plain",
        "reason": reason,
        "failing_profiles": profiles_of(state, draws),
        "diagnostics": {"failures": count.failures, "samples": count.samples},
    }
    doubts = imprecise(state, count.cv, target_cv, evaluations)
    if count.near.size and not state.meter.over:
        near = _drawn(state, seed, count.near)
        doubts += exact_doubts(state, near, count.near_values, stress, count.probability)
    return values, doubts


def _drawn(state: LimitState, seed: int, numbers: NDArray[np.int64]) -> Array:
    """Return the draws of some samples, (samples, dimension)."""
    rows = [state.draws(seed, int(number), 1) for number in numbers]
    return np.concatenate([np.empty((0, state.dimension)), *rows])


def _of_tail(
    state: LimitState,
    stress: float,
    tail: Tail,
    reason: str,
    evaluations: int,
    target_cv: float,
    seed: int,
    confidence: float,
) -> tuple[dict[str, Any], list[str]]:
    """Return the answer by subset simulation, by one level or two, and the doubts."""
    probability, cv = tail.probability(stress), tail.cv(stress)
    interval = lognormal_interval(probability, cv, confidence)
    doubts = imprecise(state, cv, target_cv, evaluations)
    last = tail.repetitions[-1]
    levels: Any = ()
    if tail.algorithm == "two_level":
        share = float(np.mean([one.share for one in tail.repetitions]))
        covered = min(one.last for one in tail.repetitions)
        diagnostics = {"failing_share": share, "covered": covered, "ceiling": last.ceiling}
        failing, values = last.failing, last.failing_values
        near = (np.empty((0, state.dimension)), np.empty(0))
        if probability == 0.0:
            reached = math.exp(last.descent.populations[-1].log_probability)
            interval = (0.0, reached)
            doubts = [
                "no failure was found by the method itself; the interval says only that it is"
                f" rarer than the last level by its first stage: {short_of(state, evaluations)}"
            ]
        elif covered < 0.8:
            doubts.append(
                f"the local criterion misses {1.0 - covered:.0%} of the failures: the estimate may"
                " be low; compare with algorithm='subset'"
            )
    else:
        levels, lowest = tail.repetitions[0].levels, last.populations[-1]
        failed = lowest.values < stress
        failing, values = lowest.draws[failed], lowest.values[failed]
        near = lowest.draws, lowest.values
        acceptance = [level.acceptance for one in tail.repetitions for level in one.levels[1:]]
        diagnostics = {
            "levels": max(len(one.levels) for one in tail.repetitions),
            "least_acceptance": min(acceptance, default=1.0),
        }
        if tail.complete and all(len(one.levels) == 1 for one in tail.repetitions):
            # So likely that there was nothing to go down to: the samples are independent.
            count = tally(
                np.concatenate([one.populations[0].values for one in tail.repetitions]), stress
            )
            cv, interval = count.cv, count.interval(confidence)
            doubts = imprecise(state, cv, target_cv, evaluations)
        elif not tail.complete:
            doubts, interval = _incomplete(state, stress, tail, confidence)
        elif min(acceptance, default=1.0) < FEWEST_ACCEPTED:
            doubts.append(
                f"only {min(acceptance):.0%} of the steps of a level were accepted: its chains"
                " hardly moved"
            )
    families = 1.0 / cv**2 if cv > 0.0 else math.inf
    if probability > 0.0 and families < FEWEST_FAMILIES:
        doubts.append(
            f"the failures descend from about {families:.1f} independent first samples only"
        )
    if not state.meter.over and tail.complete:
        doubts += exact_doubts(state, *near, stress, probability)
    chosen = distinct(values, SHOWN, generator(seed, 2))
    return {
        "probability": probability,
        "cv": cv,
        "interval": interval,
        "evaluations": evaluations,
        "first_stage_evaluations": tail.first_stage_evaluations,
        "algorithm": tail.algorithm,
        "reason": reason,
        "levels": levels,
        "failing_profiles": profiles_of(state, failing[chosen]),
        "diagnostics": {"repetitions": len(tail.repetitions), "effective_families": families}
        | diagnostics,
    }, doubts


def _incomplete(
    state: LimitState, stress: float, tail: Tail, confidence: float
) -> tuple[list[str], tuple[float, float]]:
    """Return the doubt and the interval where subset simulation did not come down so far."""
    first = tail.repetitions[0]
    lowest = first.levels[-1].threshold
    above = float(np.nextafter(lowest, math.inf))
    deep = len(first.levels) >= MOST_LEVELS
    rest = f"it stops after {MOST_LEVELS} levels" if deep else advice(state)
    reached = tail.probability(above)
    text = (
        f"after {first.evaluations} evaluations subset simulation had come down to"
        f" {lowest:.7g} Pa (P = {reached:.2g}) and not to {stress:.7g} Pa: the probability is"
        f" below that of the last level, which is all that the interval says; {rest}"
    )
    return [text], (0.0, lognormal_interval(reached, tail.cv(above), confidence)[1])

"""Failure probability and design stress: the choice of the algorithm, and the answer."""

import math
from typing import Any, Literal

import numpy as np
import xarray as xr

from stiction.arrays import Array
from stiction.ensemble.experiment import Experiment
from stiction.errors import InputError, UnitWarning, warn_user
from stiction.methods import MethodObject, label, study_attributes
from stiction.model import Count, Number, Progress, Real, checked
from stiction.problem import PROFILES, Problem
from stiction.progress import Meter
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.reliability.answer import (
    Budget,
    Confidence,
    DesignStress,
    FailureProbability,
    Probability,
    TargetCv,
    answered,
    imprecise,
    prepare,
)
from stiction.reliability.counting import count_failures, tally
from stiction.reliability.guide import budget_of, distinct, exact_doubts, too_slow
from stiction.reliability.limit_state import Event, LimitState
from stiction.reliability.tail import Tail, sample_tail
from stiction.reliability.uncertainty import generator, lognormal_interval
from stiction.results import ONSET_VARIABLES, along

PILOT = 1_000
"""Plain samples that tell which algorithm to take."""
FREQUENT = 0.01
"""From here on plain sampling needs no more evaluations than subset simulation."""
DOUBTFUL = 1e-3
"""Share of the mean strength below which a stress is probably in another unit."""
SHOWN = 20
"""Failing profiles kept."""

Found = tuple[dict[str, Any], list[str]]
"""Attributes of an answer, and why it is not to be trusted."""


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
    seed: Number = 0,
    max_evaluations: Budget | None = None,
    confidence: Confidence = 0.95,
    event: Event = "critical_stress",
    workers: Count | None = None,
    progress: Progress = True,
) -> FailureProbability:
    """Estimate the probability that an interface of random strength slides below a stress.

    The algorithms and their sources: page 'Failure probability' of the documentation.

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
        wasted, else subset simulation. `reason` in the result gives the choice and its cause.
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

    Warns
    -----
    AccuracyWarning
        If the estimate is not to be trusted; `warnings` in the result holds the same texts. By the
        local criterion some samples about the stress are solved by equilibrium too, and both
        probabilities are given if they differ by more than their error.
    UnitWarning
        If the stress is below a thousandth of the mean strength.

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
    meter = Meter("failure_probability", show=progress)
    state = prepare(
        experiment, event, workers, meter, max_evaluations, algorithm=algorithm,
        per_pressure=stress is None,
    )  # fmt: skip
    limit = float(
        (friction_coefficient or 0.0) * experiment.pressure if stress is None else stress
    )
    with meter:
        values, doubts = _without_sampling(state, limit) or _sampled(
            state, limit, algorithm, target_cv, seed, max_evaluations, confidence
        )
    return answered(
        FailureProbability, state, doubts, stress=limit, confidence=confidence, **values
    )


def _without_sampling(state: LimitState, stress: float) -> Found | None:
    """Return the answer where no sample is needed."""
    low, high = state.bounds
    experiment = state.experiment
    mean = experiment.mean("strength")
    reason, chance = "", 0.0
    if stress <= low:
        reason = f"no interface slides at or below {low:g} Pa, where nothing slips"
    elif stress >= high:
        chance, reason = 1.0, f"no interface holds more than the greatest strength, {high:g} Pa"
    elif 0.0 < stress < DOUBTFUL * mean:
        warn_user(
            f"stress: {stress:g} Pa is {stress / mean:.1g} of the mean strength, {mean:.3g} Pa;"
            " check its unit (Pa), and give a coefficient as friction_coefficient=",
            UnitWarning,
        )
        load, field = experiment.problem.load, experiment.random.strength
        simple = np.ptp(experiment.problem.load_profile) == 0.0 and not np.any(
            load.initial_stress
        )
        if simple and field.of is None and "initial_stress" not in experiment.random.names:
            # A node must be weaker than the stress.
            weaker = float(field.marginal.distribution.cdf(stress))
            if experiment.problem.interface.size * weaker < 1e-300 and not state.per_pressure:
                reason = "the strength at a point is lower with a probability below 1e-300"
    if not reason:
        return None
    values = {"probability": chance, "interval": (chance, chance), "cv": 0.0}
    return values | {"evaluations": 0, "algorithm": "exact", "reason": reason}, []


def _sampled(
    state: LimitState,
    stress: float,
    algorithm: str,
    target_cv: float,
    seed: int,
    max_evaluations: int | None,
    confidence: float,
) -> Found:
    """Return the answer by sampling."""
    budget, slow = budget_of(state, max_evaluations), too_slow(state, max_evaluations)
    least, reason, pilot = min(PILOT, max(budget // 5, 50)), "as asked", None
    if algorithm == "auto" and slow is not None:
        algorithm, reason = "plain", slow
    elif algorithm == "auto":
        # What told which algorithm to take does not enter its estimate: counting is chosen where
        # the pilot happens to hold many failures.
        draws = state.draws(seed, 0, least)
        pilot = draws, state(draws)
        count = tally(pilot[1], stress)
        reason = (
            f"{count.failures} failure{'s' * (count.failures != 1)} of {least} plain samples"
        )
        if count.probability >= FREQUENT:
            algorithm, reason = "plain", f"{reason}: frequent enough to count"
        else:
            reason = f"{reason}: rare"
    if algorithm == "plain":
        start = 0 if pilot is None else least
        count, evaluations = count_failures(
            state, seed, stress, target_cv=target_cv, least=least,
            max_evaluations=budget - start, start=start,
        )  # fmt: skip
        values: dict[str, Any] = {
            "probability": count.probability,
            "cv": count.cv,
            "interval": count.interval(confidence),
            "evaluations": start + evaluations,
            "failing_profiles": _profiles(state, _drawn(state, seed, count.numbers[:SHOWN])),
        }
        doubts = imprecise(count.cv, target_cv, values["evaluations"])
        near = _drawn(state, seed, count.near), count.near_values
        doubts += exact_doubts(state, near, stress, count.probability)
        return values | {"algorithm": algorithm, "reason": reason}, doubts
    tail = sample_tail(
        state, algorithm=algorithm, target_cv=target_cv, seed=seed, budget=budget,
        stress=stress, reason=reason, pilot=pilot,
    )  # fmt: skip
    return _of_tail(state, stress, tail, target_cv, seed, confidence)


def _drawn(state: LimitState, seed: int, numbers: Any) -> Array:
    """Return the draws of some samples, (samples, dimension)."""
    rows = [state.draws(seed, int(number), 1) for number in numbers]
    return np.concatenate([np.empty((0, state.dimension)), *rows])


def _of_tail(
    state: LimitState, stress: float, tail: Tail, target_cv: float, seed: int, confidence: float
) -> Found:
    """Return the answer by subset simulation, by one level or two."""
    count = tail.counted(stress)
    probability, cv = tail.probability(stress), count.cv if count else tail.cv(stress)
    interval = lognormal_interval(probability, cv, confidence)
    doubts = imprecise(cv, target_cv, tail.spent)
    last = tail.repetitions[-1]
    if tail.algorithm == "two_level":
        failing, values = last.failing, last.failing_values
        covered = min(one.last for one in tail.repetitions)
        if probability == 0.0:
            interval = 0.0, math.exp(last.descent.populations[-1].log_probability)
            doubts = [
                f"{tail.short_of('a failure by the method itself')}; the interval tells only that"
                " it is rarer than the last level by its first stage"
            ]
        elif covered < 0.8:
            doubts.append(
                f"the local criterion misses {1.0 - covered:.0%} of the failures: the estimate may"
                " be low; compare with algorithm='subset'"
            )
    else:
        lowest = last.populations[-1]
        failing, values = (
            each[lowest.values < stress] for each in (lowest.draws, lowest.values)
        )
        if count:
            interval = count.interval(confidence)
        elif not tail.complete:
            rarest, its_cv = tail.probability(tail.reached), tail.cv(tail.reached)
            interval = 0.0, lognormal_interval(rarest, its_cv, confidence)[1]
            doubts = [
                f"{tail.short_of(f'{stress:.7g} Pa')}; the interval tells no more than that"
            ]
        if tail.complete:
            doubts += exact_doubts(state, last.around(stress), stress, probability)
    chosen = distinct(values, SHOWN, generator(seed, 2))
    return {
        "probability": probability,
        "cv": cv,
        "interval": interval,
        "evaluations": tail.spent,
        "first_stage_evaluations": tail.first_stage_evaluations,
        "algorithm": tail.algorithm,
        "reason": tail.reason,
        "failing_profiles": _profiles(state, failing[chosen]),
    }, doubts


def _profiles(state: LimitState, draws: Array) -> xr.Dataset:
    """Return profiles and onset of some draws, labelled."""
    if draws.shape[0] == 0:
        return xr.Dataset()
    problem, method = state.experiment.problem, state.experiment.method
    profiles = state.profiles(draws)
    onset = state.experiment.onset(profiles)
    values = dict(profiles) | {name: onset[name] for name in ONSET_VARIABLES}
    meaning = {name: along(problem.interface, PROFILES[name]) for name in profiles}
    attributes = study_attributes(problem=problem, method=method)
    return label(problem, method, values, np.arange(draws.shape[0]), attributes, meaning)


@checked
def design_stress(
    problem: Problem,
    random: RandomInterface | RandomField,
    *,
    probability: Probability,
    method: MethodObject,
    target_cv: TargetCv = 0.1,
    seed: Number = 0,
    max_evaluations: Budget | None = None,
    confidence: Confidence = 0.95,
    event: Event = "critical_stress",
    workers: Count | None = None,
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
    target_cv : float
        Coefficient of variation to reach, of the failure probability at the stress.
    seed, max_evaluations, confidence, event, workers, progress
        As in `failure_probability`.

    Returns
    -------
    DesignStress
        With `stress` and `interval`, Pa.

    Raises
    ------
    InputError
        Naming everything that does not fit.

    Warns
    -----
    AccuracyWarning
        If the evaluations allowed do not suffice, the onset piles up on the bound, or samples
        about the stress fail otherwise by equilibrium than by the local criterion.

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
    meter = Meter("design_stress", show=progress)
    state = prepare(experiment, event, workers, meter, max_evaluations)
    often = probability >= FREQUENT
    with meter:
        tail = sample_tail(
            state, algorithm="subset" if often else "auto", target_cv=target_cv, seed=seed,
            budget=budget_of(state, max_evaluations), probability=probability,
            reason="frequent" if often else "rare",
        )  # fmt: skip
        values, doubts = _quantile(state, tail, probability, target_cv, confidence)
    return answered(
        DesignStress, state, doubts, probability=probability, confidence=confidence,
        evaluations=tail.spent, first_stage_evaluations=tail.first_stage_evaluations,
        algorithm=tail.algorithm, reason=tail.reason, **values,
    )  # fmt: skip


def _quantile(
    state: LimitState, tail: Tail, probability: float, target_cv: float, confidence: float
) -> Found:
    """Return the stress at a probability."""
    lowest = state.bounds[0]
    if not tail.complete:  # below the lowest value seen of the tail nothing is known
        stress = tail.extent[0] if math.isfinite(tail.extent[0]) else math.nan
        interval = (lowest, stress) if stress > lowest else state.bounds
        found = {"stress": stress, "cv": math.inf, "interval": interval}
        return found, [tail.short_of(f"P = {probability:g}")]
    stress, doubts = tail.quantile(probability), []
    least = math.nextafter(lowest, math.inf)
    cv, on_it = tail.cv(stress), tail.probability(least)
    if on_it >= probability:
        stress, cv = lowest, tail.cv(least)
        doubts.append(
            f"{on_it:.2g} of all samples slide at the bound of {lowest:.7g} Pa, as far as the"
            f" method can tell: the stress at P = {probability:g} is the bound itself"
        )
    interval = tail.stress_interval(probability, cv, confidence, lowest)
    doubts += imprecise(cv, target_cv, tail.spent)
    if tail.algorithm == "subset":
        last = tail.repetitions[-1]
        doubts += exact_doubts(state, last.around(stress), stress, probability)
    return {"stress": stress, "cv": cv, "interval": interval}, doubts

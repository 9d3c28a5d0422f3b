"""Failure probability: counting, subset simulation, or two levels."""

from typing import Any, Literal

import numpy as np
import xarray as xr

from stiction.arrays import Array
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import Event, LimitState
from stiction.errors import InputError, UnitWarning, warn_user
from stiction.methods import MethodObject, label, study_attributes
from stiction.model import Count, Number, Positive, Progress, Real, checked
from stiction.problem import Problem
from stiction.progress import Meter
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.random.stresses import mean_in_stress
from stiction.reliability.answer import (
    Budget,
    FailureProbability,
    TargetCv,
    distinct,
    exact_doubts,
    imprecise,
    prepare,
    too_slow,
)
from stiction.reliability.counting import count_failures
from stiction.reliability.tail import Tail, sample_tail
from stiction.reliability.uncertainty import generator, lognormal_interval
from stiction.results import along
from stiction.variables import ONSET_VARIABLES, PROFILES

PILOT = 1_000
"""Number of plain samples by which the algorithm is chosen."""
FREQUENT = 0.01
"""Probability above which plain sampling needs no more evaluations than subset simulation."""
NEGLIGIBLE = 1e-15
"""Probability of failing, or of holding, below which no sample is drawn."""
DOUBTFUL = 0.02
"""Share of the mean strength below which a stress is probably in another unit."""
SHOWN = 20
"""Failing profiles kept."""
CHECKED = 32
"""Number of failures among the samples that are also solved by equilibrium."""
COVERED = 0.8
"""Share of the failures that the first stage must reach to avoid a warning."""


@checked
def failure_probability(
    problem: Problem,
    random: RandomInterface | RandomField,
    stress: Real | None = None,
    *,
    method: MethodObject,
    friction_coefficient: Positive | None = None,
    algorithm: Literal["auto", "plain", "subset", "two_level"] = "auto",
    target_cv: TargetCv = 0.1,
    seed: Number = 0,
    max_evaluations: Budget | None = None,
    event: Event = "critical_stress",
    workers: Count | None = None,
    progress: Progress = True,
) -> FailureProbability:
    """Estimate the probability that an interface of random strength slides below a stress.

    The algorithms and their sources: page 'Failure probability' of the documentation.

    Parameters
    ----------
    problem, random, seed, workers, progress
        As in `monte_carlo`. The total number of samples is an estimate.
    stress : float, optional
        Mean shear stress to carry, Pa. Failure is an onset strictly below it.
    method : LocalCriterion, Equilibrium or Rupture
        The method. `Rupture`, and any method too slow for subset simulation, is used with
        plain Monte Carlo unless `max_evaluations` is 20,000 or more.
    friction_coefficient : float, optional
        Instead of `stress`: ratio of mean shear stress to mean normal pressure that it must
        carry. If the pressure is random, each sample's own pressure counts.
    algorithm : {"auto", "plain", "subset", "two_level"}
        Plain Monte Carlo, subset simulation, or subset simulation by the local criterion with
        equilibrium as the last level. 'auto' solves a thousand plain samples; if 1 % of them
        fail, it continues with plain Monte Carlo. Otherwise it takes two levels for equilibrium
        if the local criterion picks the same weakest samples and wastes few evaluations, else
        subset simulation. `reason` in the result gives the choice and its cause.
    target_cv : float
        Coefficient of variation to reach.
    max_evaluations : int, optional
        Largest number of samples to solve: by default 2,000,000 by the local criterion,
        200,000 by equilibrium, 1,000 by rupture. If they do not suffice, the result holds
        the estimate so far and a warning.
    event : {"critical_stress", "first_instability"}
        Whether the interface as a whole has to slide, or the first patch to become unstable,
        arrested or not. By the local criterion they are the same.

    Returns
    -------
    FailureProbability
        With `probability`, `cv`, `interval` (95 %), `evaluations` and more.

    Raises
    ------
    InputError
        If any argument is invalid; the message lists every problem.

    Warns
    -----
    AccuracyWarning
        If the estimate is unreliable; `warnings` in the result holds the same texts. With
        the local criterion, some samples near the stress are also solved by equilibrium,
        and both probabilities are given if they differ by more than their error.
    UnitWarning
        If the stress is below a fiftieth or above fifty times of the mean strength.

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
    if (stress is None) == (friction_coefficient is None):
        raise InputError("stress: give either stress (Pa) or friction_coefficient")
    experiment = Experiment(problem, random, method, seed=seed)
    state, budget = prepare(
        experiment, event, workers, Meter("failure_probability", show=progress),
        max_evaluations, algorithm=algorithm, per_pressure=stress is None,
    )  # fmt: skip
    if stress is None:
        stress = float((friction_coefficient or 0.0) * experiment.pressure)
    likely = state.likely_bounds(NEGLIGIBLE)
    mean = mean_in_stress(experiment.problem, experiment.random, "strength")
    if max(state.bounds[0], 0.0) < stress < DOUBTFUL * mean or stress > mean / DOUBTFUL:
        name = "stress" if friction_coefficient is None else "friction_coefficient"
        warn_user(
            f"{name}: {stress:g} Pa is {stress / mean:.2g} times the mean strength, {mean:.3g} Pa;"
            " check the units (stress in Pa, friction_coefficient without unit)",
            UnitWarning,
        )
    with state.meter:
        if not likely[0] < stress < likely[1]:
            found = _certain(state, stress, likely)
        else:
            slow = too_slow(experiment, max_evaluations)
            chosen, reason, pilot = _choice(state, stress, algorithm, slow, budget)
            if chosen == "plain":
                begun = 0 if pilot is None else pilot[1].size
                found = _by_counting(state, stress, target_cv, budget, begun)
                found["reason"] = reason
            else:
                tail = sample_tail(
                    state, algorithm=chosen, target_cv=target_cv, budget=budget,
                    stress=stress, reason=reason, pilot=pilot,
                )  # fmt: skip
                found = _by_tail(state, stress, tail, target_cv)
    return FailureProbability.of(state, stress=stress, **found)


def _certain(state: LimitState, stress: float, likely: tuple[float, float]) -> dict[str, Any]:
    """Return the attributes of an answer where no sample is needed."""
    certain = not state.bounds[0] < stress < state.bounds[1]
    low, high = state.bounds if certain else likely
    doubt = 0.0 if certain else NEGLIGIBLE
    if stress >= high:
        chance, interval = 1.0, (1.0 - doubt, 1.0)
        reason = f"no interface carries more than {high:.7g} Pa"
    else:
        chance, interval = 0.0, (0.0, doubt)
        reason = f"no interface slides at or below {low:.7g} Pa"
    reason += "" if certain else f", but for a probability below {doubt:g}"
    found = {"probability": chance, "interval": interval, "cv": 0.0, "evaluations": 0}
    return found | {"algorithm": "exact", "reason": reason}


def _fewest(budget: int) -> int:
    """Return the least number of plain samples that are solved."""
    return min(PILOT, max(budget // 5, 50))


def _choice(
    state: LimitState, stress: float, algorithm: str, slow: str | None, budget: int
) -> tuple[str, str, tuple[Array, Array] | None]:
    """Return the algorithm, the reason, and the draws and stresses of the samples that it took.

    They do not enter the estimate by counting, which is chosen where they hold many failures.
    """
    if algorithm != "auto":
        return algorithm, "as requested", None
    if slow is not None:
        return "plain", slow, None
    draws = state.draws(state.experiment.seed, 0, _fewest(budget))
    stresses = state(draws)
    count, failures = stresses.size, int(np.sum(stresses < stress))
    reason = f"{failures} failure{'s' * (failures != 1)} of {count} plain samples: "
    if failures >= FREQUENT * count:
        return "plain", f"{reason}frequent enough to count", (draws, stresses)
    return "auto", f"{reason}rare", (draws, stresses)


def _by_counting(
    state: LimitState,
    stress: float,
    target_cv: float,
    budget: int,
    start: int,
) -> dict[str, Any]:
    """Return the attributes of an answer by plain Monte Carlo from sample `start` on."""
    seed = state.experiment.seed

    def drawn(numbers: Any) -> Array:
        rows = [state.draws(seed, start + int(one), 1) for one in numbers]
        return np.concatenate([np.empty((0, state.dimension)), *rows])

    count, stresses = count_failures(
        state, seed, stress, target_cv=target_cv, least=_fewest(budget),
        max_evaluations=budget - start, start=start,
    )  # fmt: skip
    failed = np.flatnonzero(stresses < stress)
    # The weakest samples: failures and others in their true shares.
    some = failed[:CHECKED]
    seen = stresses[: some.max(initial=-1) + 1]
    near = np.argsort(seen, kind="stable")[: 2 * some.size]
    spent = start + stresses.size
    doubts = imprecise(count.cv, target_cv, spent)
    doubts += exact_doubts(state, (drawn(near), stresses[near]), stress, count.probability)
    return {
        "algorithm": "plain",
        "probability": count.probability,
        "cv": count.cv,
        "interval": count.interval(),
        "evaluations": spent,
        "failing_profiles": _profiles(state, drawn(failed[:SHOWN])),
        "doubts": doubts,
    }


def _by_tail(state: LimitState, stress: float, tail: Tail, target_cv: float) -> dict[str, Any]:
    """Return the attributes of an answer by subset simulation, by one level or two."""
    probability, cv, last = tail.probability(stress), tail.cv(stress), tail.repetitions[-1]
    interval = lognormal_interval(probability, cv)
    if count := tail.counted(stress):
        cv, interval = count.cv, count.interval()
    doubts = imprecise(cv, target_cv, tail.spent)
    if tail.algorithm == "two_level" and probability == 0.0:
        interval = 0.0, last.rarest
        doubts = [
            f"{tail.short_of('a failure')}; the interval ends at the last level of the first stage"
        ]
    elif tail.algorithm == "two_level":
        covered = min(one.last for one in tail.repetitions)
        if covered < COVERED:
            doubts.append(
                f"the local criterion misses {1.0 - covered:.0%} of the failures: the estimate may"
                " be low; compare with algorithm='subset'"
            )
    elif tail.complete:
        doubts += exact_doubts(state, last.around(stress), stress, probability)
    else:
        there = tail.probability(tail.reached), tail.cv(tail.reached)
        interval = 0.0, lognormal_interval(*there)[1]
        doubts = [f"{tail.short_of(f'{stress:.7g} Pa')}; the interval ends there"]
    draws, stresses = last.failing(stress)
    chosen = distinct(stresses, SHOWN, generator(state.experiment.seed, 2))
    return tail.attributes | {
        "probability": probability,
        "cv": cv,
        "interval": interval,
        "failing_profiles": _profiles(state, draws[chosen]),
        "doubts": doubts,
    }


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

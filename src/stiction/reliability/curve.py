"""The stress at a probability: one for a design, or a curve of them over decades."""

import math
from typing import Annotated, Any

import numpy as np
import xarray as xr
from pydantic import Field

from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import Event
from stiction.errors import warn_accuracy
from stiction.methods import MethodObject, study_attributes
from stiction.model import Count, Number, Progress, checked
from stiction.problem import Problem
from stiction.progress import Meter
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.reliability.answer import (
    Budget,
    DesignStress,
    Probability,
    TargetCv,
    exact_doubts,
    imprecise,
    prepare,
)
from stiction.reliability.failure import FREQUENT
from stiction.reliability.tail import sample_tail
from stiction.reliability.uncertainty import lognormal_interval
from stiction.results import to_dataset
from stiction.variables import Variable

COMMONEST = 0.5

VARIABLES = {
    name: Variable(unit, text, ("point",))
    for name, unit, text in (
        ("stress", "Pa", "stress"),
        ("stress_above_bound", "Pa", "stress above its lower bound"),
        ("friction_coefficient", "1", "stress over the mean normal pressure"),
        ("probability", "1", "probability of an onset below the stress"),
        ("probability_low", "1", "lower end of the interval of the probability"),
        ("probability_high", "1", "upper end of the 95 % interval of the probability"),
        ("cv", "1", "coefficient of variation of the probability"),
        ("stress_low", "Pa", "lower end of the interval of the stress"),
        ("stress_high", "Pa", "upper end of the interval of the stress"),
    )
}


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
    event: Event = "critical_stress",
    workers: Count | None = None,
    progress: Progress = True,
) -> DesignStress:
    """Estimate the stress below which the interface slides with a given probability.

    This is a quantile of the onset stress, from one set of repetitions of subset simulation.

    Parameters
    ----------
    probability : float
        Between 0 and 1, such as 1e-6.
    method : LocalCriterion or Equilibrium
        `Rupture`, or a method that would take more than a quarter of an hour on one core,
        is refused unless `max_evaluations` is 20,000 or more.
    target_cv : float
        Coefficient of variation to reach, of the failure probability at the stress.
    problem, random, seed, workers, progress
        As in `monte_carlo`.
    max_evaluations, event
        As in `failure_probability`.

    Returns
    -------
    DesignStress
        With `stress` and its 95 % `interval`, Pa.

    Raises
    ------
    InputError
        If any argument is invalid; the message lists every problem.

    Warns
    -----
    AccuracyWarning
        If the allowed evaluations do not suffice, onsets accumulate at the bound, or
        equilibrium and the local criterion disagree on samples near the stress.

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
    state, budget = prepare(experiment, event, workers, meter, max_evaluations)
    often, lowest, doubts = probability >= FREQUENT, state.bounds[0], []
    with meter:
        tail = sample_tail(
            state, algorithm="subset" if often else "auto", target_cv=target_cv, budget=budget,
            probability=probability, reason="frequent" if often else "rare",
        )  # fmt: skip
        if tail.complete:
            stress, least = tail.quantile(probability), math.nextafter(lowest, math.inf)
            cv, on_it = tail.cv(stress), tail.probability(least)
            if on_it >= probability:
                stress, cv = lowest, tail.cv(least)
                doubts.append(
                    f"{on_it:.2g} of all samples slide at the bound of {lowest:.7g} Pa,"
                    " within the accuracy of the method: the stress at P ="
                    f" {probability:g} is the bound itself"
                )
            interval = tail.stress_interval(probability, cv, lowest)
            doubts += imprecise(cv, target_cv, tail.spent)
            if tail.algorithm == "subset":
                near = tail.repetitions[-1].around(stress)
                doubts += exact_doubts(state, near, stress, probability)
        else:  # the tail ends at its lowest sample
            cv, stress = math.inf, tail.extent[0] if math.isfinite(tail.extent[0]) else math.nan
            interval = (lowest, stress) if stress > lowest else state.bounds
            doubts.append(tail.short_of(f"P = {probability:g}"))
    return DesignStress.of(
        state, stress=stress, probability=probability, cv=cv, interval=interval,
        doubts=doubts, **tail.attributes,
    )  # fmt: skip


@checked
def failure_curve(
    problem: Problem,
    random: RandomInterface | RandomField,
    *,
    method: MethodObject,
    smallest: Probability = 1e-9,
    points_per_decade: Annotated[Count, Field(le=1000)] = 3,
    target_cv: TargetCv = 0.3,
    seed: Number = 0,
    max_evaluations: Budget | None = None,
    event: Event = "critical_stress",
    workers: Count | None = None,
    progress: Progress = True,
) -> xr.Dataset:
    """Estimate P(onset < s) from one half down to a smallest probability.

    Parameters
    ----------
    smallest : float
        Smallest probability of the curve.
    points_per_decade : int
        Number of stresses per decade of probability.
    target_cv : float
        Coefficient of variation to reach at the smallest probability; it is lower elsewhere.
    problem, random, seed, workers, progress
        As in `monte_carlo`.
    method
        As in `design_stress`.
    max_evaluations, event
        As in `failure_probability`.

    Returns
    -------
    xarray.Dataset
        Over 'point': `stress`, `stress_above_bound` (Pa), `probability` with `probability_low`,
        `probability_high` and `cv`, `stress_low`, `stress_high` (Pa), and with a normal pressure
        `friction_coefficient`, the stress over its mean. `stress_above_bound` means little where
        the attribute `lower_bound` is zero or less.

    Raises
    ------
    InputError
        If any argument is invalid; the message lists every problem.

    Warns
    -----
    AccuracyWarning
        If the allowed evaluations do not suffice, or equilibrium and the local criterion
        disagree on samples at the end of the curve.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> curve = st.failure_curve(problem, strength, method=st.LocalCriterion(), smallest=1e-3)
    >>> bool((curve.stress.diff("point") < 0.0).all())
    True
    """
    experiment = Experiment(problem, random, method, seed=seed)
    meter = Meter("failure_curve", show=progress)
    state, budget = prepare(experiment, event, workers, meter, max_evaluations)
    with meter:
        tail = sample_tail(
            state, algorithm="subset", target_cv=target_cv, budget=budget, probability=smallest
        )
        if tail.complete:
            stress = tail.quantile(smallest)
            near = tail.repetitions[-1].around(stress)
            doubts = exact_doubts(state, near, stress, smallest)
        else:
            doubts = [f"{tail.short_of(f'P = {smallest:g}')}; the curve ends there"]
            smallest = tail.probability(tail.reached)
    for text in doubts:
        warn_accuracy(text)
    lowest, pressure = state.bounds[0], experiment.pressure
    decades = max(np.log10(COMMONEST / smallest), 0.0)
    count = int(np.ceil(decades * points_per_decade)) + 1
    rows = []
    for chance in (COMMONEST * 10.0 ** -np.linspace(0.0, decades, count)).tolist():
        stress = tail.quantile(chance)
        found, cv = tail.probability(stress), tail.cv(stress)
        ends = lognormal_interval(found, cv)
        sides = tail.stress_interval(chance, cv, lowest)
        rows.append((stress, stress - lowest, stress / pressure, found, *ends, cv, *sides))
    values: dict[str, Any] = dict(zip(VARIABLES, np.array(rows).T, strict=True))
    if not np.isfinite(pressure):
        del values["friction_coefficient"]
    attributes = study_attributes(problem=problem, random=experiment.random, method=method) | {
        "lower_bound": lowest,
        "event": event,
        "seed": seed,
        "evaluations": tail.spent,
        "method": method.type,
    }
    return to_dataset(values, VARIABLES, {}, attributes)

"""The failure curve: P(onset < s) over decades."""

from typing import Annotated, Any

import numpy as np
import xarray as xr
from pydantic import Field

from stiction.ensemble.experiment import Experiment
from stiction.errors import warn_accuracy
from stiction.methods import MethodObject, study_attributes
from stiction.model import Count, Number, Progress, checked
from stiction.problem import Problem
from stiction.progress import Meter
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.reliability.answer import Budget, Confidence, Probability, TargetCv, prepare
from stiction.reliability.guide import budget_of, exact_doubts
from stiction.reliability.limit_state import Event, LimitState
from stiction.reliability.tail import Tail, sample_tail
from stiction.reliability.uncertainty import lognormal_interval
from stiction.results import Variable, to_dataset

COMMONEST = 0.5

VARIABLES: dict[str, Variable] = {
    "stress": Variable("Pa", "stress", ("point",)),
    "stress_above_bound": Variable("Pa", "stress above the least possible one", ("point",)),
    "friction_coefficient": Variable("1", "stress over the mean normal pressure", ("point",)),
    "probability": Variable("1", "probability of an onset below the stress", ("point",)),
    "probability_low": Variable("1", "lower end of its interval", ("point",)),
    "probability_high": Variable("1", "upper end of its interval", ("point",)),
    "cv": Variable("1", "coefficient of variation of the probability", ("point",)),
    "stress_low": Variable("Pa", "lower end of the interval of the stress", ("point",)),
    "stress_high": Variable("Pa", "upper end of the interval of the stress", ("point",)),
}


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
    confidence: Confidence = 0.95,
    event: Event = "critical_stress",
    workers: Count | None = None,
    progress: Progress = True,
) -> xr.Dataset:
    """Estimate P(onset < s) from one half down to a smallest probability.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface or RandomField
        What is random; a field alone is the peak strength, Pa.
    method : LocalCriterion or Equilibrium
        As in `design_stress`.
    smallest : float
        Probability down to which the curve goes.
    points_per_decade : int
        Stresses a factor of ten in probability.
    target_cv : float
        Coefficient of variation to reach at the smallest probability; it is lower elsewhere.
    seed, max_evaluations, confidence, event, workers, progress
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
        Naming everything that does not fit.

    Warns
    -----
    AccuracyWarning
        If the evaluations allowed do not suffice, or samples at the end of the curve fail
        otherwise by equilibrium than by the local criterion.

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
    state = prepare(experiment, event, workers, meter, max_evaluations)
    with meter:
        tail = sample_tail(
            state, algorithm="subset", target_cv=target_cv, seed=seed,
            budget=budget_of(state, max_evaluations), probability=smallest,
        )  # fmt: skip
        deepest = _deepest(state, tail, smallest)
    attributes = study_attributes(problem=problem, random=experiment.random, method=method) | {
        "lower_bound": state.bounds[0],
        "event": event,
        "confidence": confidence,
        "seed": seed,
        "evaluations": tail.spent,
        "method": method.type,
    }
    values = _points(state, tail, deepest, points_per_decade, confidence)
    return to_dataset(values, VARIABLES, {}, attributes)


def _deepest(state: LimitState, tail: Tail, smallest: float) -> float:
    """Return the probability at which the curve ends; warn if it ends early, or is not exact."""
    if tail.complete:
        stress = tail.quantile(smallest)
        near = tail.repetitions[-1].around(stress)
        doubts = exact_doubts(state, near, stress, smallest)
    else:
        doubts = [f"{tail.short_of(f'P = {smallest:g}')}; the curve ends there"]
        smallest = tail.probability(tail.reached)
    for text in doubts:
        warn_accuracy(text)
    return smallest


def _points(
    state: LimitState, tail: Tail, deepest: float, points_per_decade: int, confidence: float
) -> dict[str, Any]:
    """Return the variables of the curve."""
    decades = max(np.log10(COMMONEST / deepest), 0.0)
    count = int(np.ceil(decades * points_per_decade)) + 1
    chances = COMMONEST * 10.0 ** -np.linspace(0.0, decades, count)
    lowest, pressure = state.bounds[0], state.experiment.pressure
    rows = []
    for chance in map(float, chances):
        stress = tail.quantile(chance)
        found, cv = tail.probability(stress), tail.cv(stress)
        ends = lognormal_interval(found, cv, confidence)
        sides = tail.stress_interval(chance, cv, confidence, lowest)
        rows.append((stress, stress - lowest, stress / pressure, found, *ends, cv, *sides))
    values = dict(zip(VARIABLES, np.array(rows).T, strict=True))
    if not np.isfinite(pressure):
        del values["friction_coefficient"]
    return values

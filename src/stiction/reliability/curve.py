"""The failure curve: P(onset < s) over decades, with what else there is to compare it with."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import xarray as xr
from pydantic import BeforeValidator, Field

from stiction.arrays import Array
from stiction.ensemble.experiment import Experiment
from stiction.errors import InputError
from stiction.methods import MethodObject
from stiction.model import Count, Progress, Seconds, _count, checked, to_plain
from stiction.problem import Problem
from stiction.progress import Meter, TimeUp
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.reliability.answer import (
    Budget,
    Confidence,
    Probability,
    Seed,
    TargetCv,
    advice,
    nothing_known,
    prepare,
    ran_out,
    short_of,
    warned,
)
from stiction.reliability.counting import BATCH
from stiction.reliability.guide import budget_of, exact_doubts
from stiction.reliability.limit_state import Event, LimitState, alike_everywhere
from stiction.reliability.tail import sample_tail
from stiction.reliability.uncertainty import binomial_interval, lognormal_interval
from stiction.results import Variable, to_dataset
from stiction.statistics.rice import rice_distribution

COMMONEST = 0.5
RICE_SAMPLES = 2_000
FEWEST_CROSSINGS = 5
"""Crossings below which their rate is not known."""

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
    "rice_probability": Variable("1", "by Rice's formula, local criterion", ("point",)),
    "plain_probability": Variable("1", "by plain Monte Carlo", ("point",)),
    "plain_low": Variable("1", "lower end of its interval", ("point",)),
    "plain_high": Variable("1", "upper end of its interval", ("point",)),
}
Some = Annotated[int, BeforeValidator(_count), Field(ge=0, le=10**9)]


@checked
def failure_curve(
    problem: Problem,
    random: RandomInterface | RandomField,
    *,
    method: MethodObject,
    smallest: Probability = 1e-9,
    points_per_decade: Annotated[Count, Field(le=1000)] = 3,
    target_cv: TargetCv = 0.3,
    plain_samples: Some = 10_000,
    seed: Seed = 0,
    max_evaluations: Budget | None = None,
    confidence: Confidence = 0.95,
    event: Event = "critical_stress",
    workers: Count | None = None,
    time_limit: Seconds | None = None,
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
    plain_samples : int
        Samples of plain Monte Carlo to compare with; 0 for none.
    seed, max_evaluations, confidence, event, workers, progress
        As in `failure_probability`.
    time_limit : float, optional
        Seconds. When they are over, the curve holds the repetitions and the plain samples that
        are done, and the attribute 'cut_short' gives the reason.

    Returns
    -------
    xarray.Dataset
        Over 'point': `stress`, `stress_above_bound` (Pa), `probability` with `probability_low`,
        `probability_high` and `cv`, `stress_low`, `stress_high` (Pa), `plain_probability` with
        interval (NaN where fewer than three samples fail) and, where the interface is alike
        everywhere, `rice_probability`; with a normal pressure `friction_coefficient`, the stress
        over its mean. `stress_above_bound` means little where the attribute `lower_bound` is zero
        or less.

    Raises
    ------
    InputError
        Naming everything that does not fit.
    TimeoutError
        If nothing is known after `time_limit`.

    Warns
    -----
    AccuracyWarning
        If the evaluations or the time allowed do not suffice, or samples at the end of the curve
        fail otherwise by equilibrium than by the local criterion.

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
    meter = Meter("failure_curve", show=progress, time_limit=time_limit)
    state = prepare(experiment, event, workers, meter, max_evaluations=max_evaluations)
    onsets, doubts = np.empty(0), []
    with meter:
        try:
            tail = sample_tail(
                state,
                algorithm="subset",
                target_cv=target_cv,
                seed=seed,
                budget=budget_of(state, max_evaluations),
                probability=smallest,
            )
        except TimeUp:
            raise nothing_known(state) from None
        deepest = smallest
        if not tail.complete:
            threshold = tail.repetitions[0].levels[-1].threshold
            deepest = tail.probability(float(np.nextafter(threshold, np.inf)))
            doubts.append(
                f"{ran_out(state, tail.spent)} do not reach P = {smallest:g}: the curve ends at"
                f" {deepest:.2g}; {advice(state)}"
            )
        elif not meter.over:
            stress = tail.quantile(smallest)
            last = tail.repetitions[-1].population(stress)
            doubts += exact_doubts(state, last.draws, last.values, stress, smallest)
        if plain_samples and not meter.over:
            meter.stage("failure_curve, plain Monte Carlo", plain_samples)
            onsets = _onsets(state, seed, plain_samples)
    decades = max(np.log10(COMMONEST / deepest), 0.0)
    count = int(np.ceil(decades * points_per_decade)) + 1
    chances = COMMONEST * 10.0 ** -np.linspace(0.0, decades, count)
    levels = np.array([tail.quantile(float(chance)) for chance in chances])
    cv = np.array([tail.cv(float(one)) for one in levels])
    cut = meter.over and (bool(doubts) or bool(cv[-1] > target_cv) or onsets.size < plain_samples)
    if cut and not doubts:
        lacking = "the curve is less precise than asked for, or has fewer plain samples"
        doubts = [f"{lacking}: {short_of(state, tail.spent)}"]
    warned(doubts)
    found = np.array([tail.probability(float(one)) for one in levels])
    lowest = state.bounds[0]
    ends = [
        lognormal_interval(float(p), float(c), confidence) for p, c in zip(found, cv, strict=True)
    ]
    sides = [
        tail.stress_interval(float(p), float(c), confidence, lowest)
        for p, c in zip(chances, cv, strict=True)
    ]
    values: dict[str, Any] = {
        "stress": levels,
        "stress_above_bound": levels - lowest,
        "probability": found,
        "cv": cv,
    }
    values |= dict(zip(("probability_low", "probability_high"), np.array(ends).T, strict=True))
    values |= dict(zip(("stress_low", "stress_high"), np.array(sides).T, strict=True))
    if np.isfinite(experiment.pressure):
        values["friction_coefficient"] = levels / experiment.pressure
    if alike_everywhere(experiment):
        values["rice_probability"] = _rice(problem, experiment.random.strength, levels, seed)
    if onsets.size:
        plain = _plain(onsets, levels, confidence)
        values |= dict(zip(("plain_probability", "plain_low", "plain_high"), plain, strict=True))
    attributes: dict[str, Any] = {
        "lower_bound": lowest,
        "event": event,
        "confidence": confidence,
        "seed": seed,
        "evaluations": tail.spent,
        "plain_samples": onsets.size,
        "method": method.type,
    }
    if cut:
        attributes["cut_short"] = "; ".join(doubts)
    try:
        attributes["study"] = {
            "problem": to_plain(problem),
            "random": to_plain(experiment.random),
            "method": to_plain(method),
        }
    except InputError:  # a function of the user's in it
        attributes["study_incomplete"] = 1
    return to_dataset(values, VARIABLES, {}, attributes)


def _onsets(state: LimitState, seed: int, samples: int) -> Array:
    """Return stresses of the first samples of the ensemble, as many as there is time for."""
    parts = []
    for first in range(0, samples, BATCH):
        try:
            parts.append(state(state.draws(seed, first, min(BATCH, samples - first))))
        except TimeUp as up:
            parts.append(up.values)
            break
    return np.concatenate(parts)


def _plain(onset: Array, stress: Any, confidence: float) -> Any:
    """Return probability and interval by counting, NaN where fewer than three samples fail."""
    samples, onset = onset.size, np.sort(onset)
    counts = np.searchsorted(onset, stress, side="left")
    rows = [
        (k / samples, *binomial_interval(int(k), samples, confidence)) if k > 2 else (np.nan,) * 3
        for k in counts
    ]
    return np.array(rows).T


def _rice(problem: Problem, strength: RandomField, stress: Array, seed: int) -> Array:
    """Return Rice's formula at falling stresses, NaN where crossings are too few."""
    levels = np.unique(stress)
    found = rice_distribution(problem, strength, profiles=RICE_SAMPLES, seed=seed, stress=levels)
    crossings = found.crossing_rate * RICE_SAMPLES * problem.interface.extent
    # Far above the median of tau_n nothing crosses either, but the interface lies below.
    known = (crossings > FEWEST_CROSSINGS - 0.5) | (found.point_survival < 0.5)
    chance: Array = np.where(known, found.probability, np.nan)
    return chance[np.searchsorted(levels, stress)]

"""The failure curve: P(onset < s) over decades, with what else there is to compare it with."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.methods import Method
from stiction.model import describe, is_whole, to_plain
from stiction.problem import Problem
from stiction.progress import Meter, Show, TimeUp, check_time_limit
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.reliability.design import check_probability
from stiction.reliability.effort import budget_of, refused_chains
from stiction.reliability.estimate import check_target
from stiction.reliability.limit_state import (
    Event,
    LimitState,
    make_limit_state,
)
from stiction.reliability.plain_monte_carlo import BATCH
from stiction.reliability.request import advice, ran_out, short_of
from stiction.reliability.result import say
from stiction.reliability.tail_runs import TailRequest, stress_interval, subset_tail
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
    "coefficient_of_variation": Variable("1", "of the probability", ("point",)),
    "stress_low": Variable("Pa", "lower end of the interval of the stress", ("point",)),
    "stress_high": Variable("Pa", "upper end of the interval of the stress", ("point",)),
    "rice_probability": Variable("1", "by Rice's formula, local criterion", ("point",)),
    "plain_probability": Variable("1", "by plain Monte Carlo", ("point",)),
    "plain_low": Variable("1", "lower end of its interval", ("point",)),
    "plain_high": Variable("1", "upper end of its interval", ("point",)),
}


def _onsets(state: LimitState, seed: int, samples: int) -> Array:
    """Stresses of the first samples of the ensemble, as many as there is time for."""
    parts = []
    for first in range(0, samples, BATCH):
        try:
            parts.append(state(state.draws(seed, first, min(BATCH, samples - first))))
        except TimeUp as up:
            parts.append(up.values)
            break
    return np.concatenate(parts)


def _plain(onset: Array, stress: Any, confidence: float) -> Any:
    """Probability and interval by counting, NaN where fewer than three samples go so low."""
    samples, onset = onset.size, np.sort(onset)
    counts = np.searchsorted(onset, stress, side="left")
    rows = [
        (k / samples, *binomial_interval(int(k), samples, confidence)) if k > 2 else (np.nan,) * 3
        for k in counts
    ]
    return np.array(rows).T


def _rice(problem: Problem, strength: RandomField, stress: Array, seed: int) -> Array:
    """Rice's formula at falling stresses, NaN where crossings are too few to know their rate."""
    levels = np.unique(stress)
    found = rice_distribution(problem, strength, profiles=RICE_SAMPLES, seed=seed, stress=levels)
    crossings = found.crossing_rate * RICE_SAMPLES * problem.interface.extent
    # Far above the median of tau_n nothing crosses either, but the interface lies below.
    known = (crossings > FEWEST_CROSSINGS - 0.5) | (found.point_survival < 0.5)
    chance: Array = np.where(known, found.probability, np.nan)
    return chance[np.searchsorted(levels, stress)]


def failure_curve(
    problem: Problem,
    random: RandomInterface | RandomField,
    *,
    method: Method,
    smallest: float = 1e-9,
    points_per_decade: int = 3,
    target_cv: float = 0.3,
    plain_samples: int = 10_000,
    seed: int = 0,
    max_evaluations: int | None = None,
    confidence: float = 0.95,
    event: Event = "critical_stress",
    workers: int | None = None,
    time_limit: float | None = None,
    progress: Show = True,
) -> xr.Dataset:
    """P(onset < s) from one half down to a smallest probability.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface or RandomField
        What is random; a field alone is the peak strength, Pa.
    method : LocalCriterion or Equilibrium
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
        Seconds. When they are over, the curve ends where it has come to, the plain samples are
        those that are done, and the attribute 'cut_short' says so.

    Returns
    -------
    xarray.Dataset
        Over 'point': `stress`, `stress_above_bound` (Pa), `probability` with `probability_low`,
        `probability_high` and `coefficient_of_variation`, `stress_low`, `stress_high` (Pa),
        `plain_probability` with interval (NaN where fewer than three samples fail) and, where the
        interface is alike everywhere, `rice_probability`; with a normal pressure
        `friction_coefficient`, the stress over its mean. `stress_above_bound` means little where
        the attribute `lower_bound` is zero or less.

    Raises
    ------
    InputError
        Naming all that does not fit.
    TimeoutError
        If not even a few samples were done within `time_limit`.

    Warns
    -----
    AccuracyWarning
        If the evaluations or the time allowed do not suffice.
    """
    problems = check_target(target_cv, confidence, max_evaluations)
    problems += check_probability("smallest", smallest) + check_time_limit(time_limit)
    meter = Meter("failure_curve", show=progress, time_limit=time_limit)
    for name, value, least, most in (
        ("points_per_decade", points_per_decade, 1, 1000),
        ("plain_samples", plain_samples, 0, 10**9),
    ):
        if not is_whole(value, least) or value > most:
            given = describe(value)
            problems.append(f"{name}: must be a whole number from {least} to {most}, got {given}")
    state = make_limit_state(
        problem,
        random,
        method,
        seed,
        event,
        workers,
        meter=meter,
        problems=problems,
        check=lambda state: refused_chains(state, max_evaluations),
    )
    request = TailRequest(
        state, float(smallest), target_cv, int(seed), budget_of(state, max_evaluations)
    )
    with meter:
        meter.expect(request.budget, at_most=True)
        try:
            tail = subset_tail(request)
        except TimeUp:
            raise TimeoutError(f"no curve: {short_of(state, 0)}") from None
        onsets = np.empty(0)
        if plain_samples and not meter.over:
            meter.stage("failure_curve, plain Monte Carlo", int(plain_samples))
            onsets = _onsets(state, int(seed), int(plain_samples))
    deepest, spent = float(smallest), sum(run.evaluations for run in tail.runs)
    doubts = []
    if not tail.runs[0].complete:
        deepest = tail.probability(float(np.nextafter(tail.runs[0].levels[-1].threshold, np.inf)))
        doubts = [
            f"{ran_out(state, spent)} do not reach P = {smallest:g}: the curve ends at"
            f" {deepest:.2g}; {advice(state)}"
        ]
    short = (
        float(tail.coefficient_of_variation(tail.quantile(deepest))) > target_cv
        or onsets.size < plain_samples
    )
    cut = meter.over and (bool(doubts) or short)
    if cut and not doubts:
        lacking = "the curve is less precise than asked for, or has fewer plain samples"
        doubts = [f"{lacking}: {short_of(state, spent)}"]
    say(doubts)
    decades = max(np.log10(COMMONEST / deepest), 0.0)
    count = int(np.ceil(decades * points_per_decade)) + 1
    chances = COMMONEST * 10.0 ** -np.linspace(0.0, decades, count)
    stress = np.array([tail.quantile(float(chance)) for chance in chances])
    found = np.array([tail.probability(float(s)) for s in stress])
    cv = np.array([tail.coefficient_of_variation(float(s)) for s in stress])
    lowest = state.bounds[0]
    pairs = zip(found, cv, strict=True)
    ends = np.array([lognormal_interval(float(p), float(c), confidence) for p, c in pairs])
    pairs = zip(chances, cv, strict=True)
    sides = np.array(
        [stress_interval(tail, float(p), float(c), confidence, lowest) for p, c in pairs]
    )
    values = {
        "stress": stress,
        "stress_above_bound": stress - lowest,
        "probability": found,
        "probability_low": ends[:, 0],
        "probability_high": ends[:, 1],
        "coefficient_of_variation": cv,
        "stress_low": sides[:, 0],
        "stress_high": sides[:, 1],
    }
    if np.isfinite(state.pressure):
        values["friction_coefficient"] = stress / state.pressure
    if state.not_alike_everywhere() is None:
        values["rice_probability"] = _rice(problem, state.random.strength, stress, int(seed))
    if onsets.size:
        plain = _plain(onsets, stress, confidence)
        values |= dict(zip(("plain_probability", "plain_low", "plain_high"), plain, strict=True))
    attributes: dict[str, Any] = {
        "lower_bound": lowest,
        "event": state.event,
        "confidence": float(confidence),
        "seed": int(seed),
        "evaluations": spent,
        "plain_samples": onsets.size,
        "method": method.type,
    }
    if cut:
        attributes["cut_short"] = "; ".join(doubts)
    try:
        attributes["study"] = {
            "problem": to_plain(problem),
            "random": to_plain(state.random),
            "method": to_plain(method),
        }
    except InputError:  # a function of the user's in it
        attributes["study_incomplete"] = 1
    return to_dataset(values, VARIABLES, {}, attributes)

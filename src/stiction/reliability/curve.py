"""The failure curve: P(onset < s) over decades, with what else there is to compare it with."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from stiction._checks import is_whole
from stiction._model import describe, to_plain
from stiction._typing import Array
from stiction.errors import InputError
from stiction.fields.random_field import RandomField
from stiction.methods import Method
from stiction.problem import Problem
from stiction.reliability.design import (
    TailRequest,
    check_probability,
    check_sampling,
    stress_interval,
    subset_tail,
)
from stiction.reliability.estimate import budget_of, check_target
from stiction.reliability.limit_state import (
    Event,
    LimitState,
    make_limit_state,
)
from stiction.reliability.plain import BATCH
from stiction.reliability.result import say
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


def _plain(state: LimitState, seed: int, stress: Any, samples: int, confidence: float) -> Any:
    """Probability and interval by counting, NaN where fewer than three samples go so low."""
    parts = []
    for first in range(0, samples, BATCH):
        parts.append(state(state.draws(seed, first, min(BATCH, samples - first))))
    onset = np.sort(np.concatenate(parts))
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
    crossings = found.crossing_rate * RICE_SAMPLES * problem.interface.length
    # Far above the median of tau_n nothing crosses either, but the interface lies below.
    known = (crossings > FEWEST_CROSSINGS - 0.5) | (found.point_survival < 0.5)
    chance: Array = np.where(known, found.probability, np.nan)
    return chance[np.searchsorted(levels, stress)]


def failure_curve(
    problem: Problem,
    strength: RandomField,
    *,
    method: Method,
    smallest: float = 1e-9,
    points_per_decade: int = 3,
    target_cov: float = 0.3,
    plain_samples: int = 10_000,
    seed: int = 0,
    max_evaluations: int | None = None,
    confidence: float = 0.95,
    event: Event = "critical_stress",
    residual_strength: RandomField | None = None,
    initial_stress: RandomField | None = None,
    weakening_rate: RandomField | None = None,
    workers: int | None = None,
) -> xr.Dataset:
    """P(onset < s) from one half down to a smallest probability.

    Parameters
    ----------
    problem : Problem
    strength : RandomField
        Peak strength, Pa.
    method : LocalCriterion or Equilibrium
    smallest : float
        Probability down to which the curve goes.
    points_per_decade : int
        Stresses a factor of ten in probability.
    target_cov : float
        Coefficient of variation to reach at the smallest probability; it is lower elsewhere.
    plain_samples : int
        Samples of plain Monte Carlo to compare with; 0 for none.
    seed, max_evaluations, confidence, event, workers
        As in `failure_probability`.
    residual_strength, initial_stress, weakening_rate : RandomField, optional
        What is random besides the strength.

    Returns
    -------
    xarray.Dataset
        Over 'point': `stress`, `stress_above_bound` (Pa), `probability` with `probability_low`,
        `probability_high` and `coefficient_of_variation`, `stress_low`, `stress_high` (Pa),
        `plain_probability` with interval (NaN where fewer than three samples fail) and, where the
        interface is alike everywhere, `rice_probability`.

    Raises
    ------
    InputError
        Naming all that does not fit.
    """
    fields = {
        "residual_strength": residual_strength,
        "initial_stress": initial_stress,
        "weakening_rate": weakening_rate,
    }
    problems = check_target(target_cov, confidence, max_evaluations)
    problems += check_probability("smallest", smallest)
    for name, value, least, most in (
        ("points_per_decade", points_per_decade, 1, 1000),
        ("plain_samples", plain_samples, 0, 10**9),
    ):
        if not is_whole(value, least) or value > most:
            given = describe(value)
            problems.append(f"{name}: must be a whole number from {least} to {most}, got {given}")
    state = make_limit_state(
        problem,
        strength,
        method,
        seed,
        fields,
        event,
        workers,
        problems=problems,
        check=check_sampling,
    )
    budget = budget_of(state, max_evaluations)
    tail = subset_tail(TailRequest(state, float(smallest), target_cov, int(seed), budget))
    deepest = float(smallest)
    if not tail.runs[0].complete:
        deepest = tail.probability(float(np.nextafter(tail.runs[0].levels[-1].threshold, np.inf)))
        say(
            [
                f"the evaluations allowed do not reach P = {smallest:g}: the curve ends at"
                f" {deepest:.2g}; raise max_evaluations"
            ]
        )
    decades = max(np.log10(COMMONEST / deepest), 0.0)
    count = int(np.ceil(decades * points_per_decade)) + 1
    chances = COMMONEST * 10.0 ** -np.linspace(0.0, decades, count)
    stress = np.array([tail.quantile(float(chance)) for chance in chances])
    found = np.array([tail.probability(float(s)) for s in stress])
    cov = np.array([tail.coefficient_of_variation(float(s)) for s in stress])
    lowest = state.bounds[0]
    pairs = zip(found, cov, strict=True)
    ends = np.array([lognormal_interval(float(p), float(c), confidence) for p, c in pairs])
    pairs = zip(chances, cov, strict=True)
    sides = np.array(
        [stress_interval(tail, float(p), float(c), confidence, lowest) for p, c in pairs]
    )
    values = {
        "stress": stress,
        "stress_above_bound": stress - lowest,
        "probability": found,
        "probability_low": ends[:, 0],
        "probability_high": ends[:, 1],
        "coefficient_of_variation": cov,
        "stress_low": sides[:, 0],
        "stress_high": sides[:, 1],
    }
    if state.not_alike_everywhere() is None:
        values["rice_probability"] = _rice(problem, strength, stress, int(seed))
    if plain_samples:
        plain = _plain(state, int(seed), stress, int(plain_samples), confidence)
        values |= dict(zip(("plain_probability", "plain_low", "plain_high"), plain, strict=True))
    attributes: dict[str, Any] = {
        "lower_bound": lowest,
        "event": state.event,
        "confidence": float(confidence),
        "seed": int(seed),
        "evaluations": sum(run.evaluations for run in tail.runs),
        "plain_samples": int(plain_samples),
        "method": method.type,  # type: ignore[attr-defined]  # every method names its type
    }
    try:
        attributes["study"] = {
            "problem": to_plain(problem),
            "strength": to_plain(strength),
            "method": to_plain(method),
        }
    except InputError:  # a function of the user's in it
        attributes["study_incomplete"] = 1
    return to_dataset(values, VARIABLES, {}, attributes)

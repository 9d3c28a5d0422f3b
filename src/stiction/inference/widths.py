"""Expected widths of intervals and of the design after further tests or profiles.

Problem. Specimens were measured, and their mean, scatter and fields have a
posterior. How wide will the intervals be after further measurements, and how large
the design stress?

Source. The expectation is over simulated campaigns, as in Lindley (1956), Annals of
Mathematical Statistics 27, 986, but for a width instead of information.

Steps, for each design and each simulated campaign:

1. Draw true values (field, family, s and mean) from the posterior given the present
   measurements.
2. Draw further peaks, and levels of further profiles, with these values.
3. Compute the posterior given all measurements (`stiction.inference.specimens`).
4. Compute the width of the 90 % interval for each parameter, and the design stress
   from the predictive distribution. The result holds their means over campaigns.

Departure. Only the `MAX_FIELDS` fields with the largest mass are kept.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from stiction.base.arrays import Array
from stiction.base.errors import InputError, unknown_name
from stiction.base.model import is_whole
from stiction.inference.joined import SpecimenPosterior, profiles_of, simulated_onsets
from stiction.inference.likelihood import Simulation, variable_of
from stiction.inference.peaks import si_of
from stiction.inference.specimens import (
    MEAN_KEY,
    SCATTER_KEY,
    Grid,
    Tables,
    factor_of_family,
    grid_of_profiles,
)  # fmt: skip
from stiction.problem.problem import Problem

MAX_FIELDS = 12
"""Fields within a specimen that represent all of them."""
WIDTH_DRAWS = 2_000
"""Draws of a posterior for an interval."""


def expected_widths(
    problem: Problem,
    random: Any,
    designs: Mapping[str, Any],
    simulation: Simulation,
    probability: float,
    error: float,
    unit: str,
    repetitions: int,
) -> xr.Dataset:
    """Return widths of intervals and design stresses after further tests. See `design_of_tests`."""
    seed, method, meter = simulation.seed, simulation.method, simulation.meter
    plans = {"now": (0, 0)} | {name: _plan(name, given) for name, given in designs.items()}
    if isinstance(random, SpecimenPosterior):
        tables, mass = random.likelihood, random.grid.mass.sum(axis=(1, 2, 3))
    else:
        profiles = profiles_of(random, None, None, seed)
        if not profiles.levels.size:
            raise InputError("random: must be a fit or a posterior of `infer` without a prior")
        variable = variable_of(problem, profiles.fields[0], si_of(unit))
        onsets = simulated_onsets(
            profiles, problem, simulation, None, np.zeros(0), 0, error, variable
        )
        tables, mass = Tables(profiles, method, (onsets,), error, (np.zeros(0),)), np.ones(1)
    if any(levels for _, levels in plans.values()) and not tables.profiles.levels.size:
        raise InputError(
            "designs: profiles: need a fit. Further profiles are as long as its profiles"
        )
    tables = _fewer(tables, mass)
    _, now = grid_of_profiles(tables.profiles, tables)
    rng = np.random.default_rng([seed, 8])
    meter.stage("simulated campaigns", len(plans) * repetitions)
    widths = np.empty((len(plans), repetitions, 2))
    stresses = np.empty((len(plans), repetitions))
    for row, (tests, levels) in enumerate(plans.values()):
        for number in range(repetitions):
            # 1.
            truth = now.draws(1, rng)
            # 2. and 3.
            grid, both = _after(tables, truth, tests, levels, rng) if row else (now, tables)
            # 4.
            drawn = grid.described(grid.draws(WIDTH_DRAWS, rng))
            ends = [np.quantile(drawn[name], [0.05, 0.95]) for name in (MEAN_KEY, SCATTER_KEY)]
            widths[row, number] = np.ptp(ends, axis=1)
            stresses[row, number] = both.quantile(grid, np.array([probability]))[0]
            meter.advance()
    area = both.onsets[0].area
    low, high = np.quantile(stresses, [0.05, 0.95], axis=1) / area
    of = ("design", "parameter")
    about = {"units": "Pa"}
    return xr.Dataset(
        {
            "width": (of, widths.mean(axis=1)),
            "standard_error": (of, widths.std(axis=1) / np.sqrt(repetitions)),
            "design_stress": ("design", stresses.mean(axis=1) / area, about),
            "design_low": ("design", low, about),
            "design_high": ("design", high, about),
        },
        {"design": list(plans), "parameter": [MEAN_KEY, SCATTER_KEY]},
        {"probability": probability, "repetitions": repetitions},
    )


def _plan(name: str, given: Any) -> tuple[int, int]:
    """Return the numbers of further tests and profiles."""
    table = dict(given) if isinstance(given, Mapping) else {"tests": given}
    if unknown := [str(key) for key in table if key not in ("tests", "profiles")]:
        raise InputError(unknown_name(f"designs: {name}", unknown[0], ("tests", "profiles")))
    numbers = table.get("tests", 0), table.get("profiles", 0)
    if not all(is_whole(number, 0) for number in numbers) or not sum(numbers):
        raise InputError(
            f"designs: {name}: tests and profiles must be whole numbers, at least one of them >= 1"
        )
    return numbers


def _fewer(tables: Tables, mass: Array) -> Tables:
    """Return the tables for the fields with the largest mass."""
    profiles = tables.profiles
    order = np.argsort(-np.broadcast_to(mass, len(profiles.fields)), kind="stable")[:MAX_FIELDS]
    fields = tuple(profiles.fields[k] for k in order)
    fewer = profiles._replace(fields=fields, within=profiles.within[order])
    onsets = tuple(kind.of(order) for kind in tables.onsets)
    return replace(tables, profiles=fewer, onsets=onsets)


def _after(
    tables: Tables, truth: Array, tests: int, levels: int, rng: np.random.Generator
) -> tuple[Grid, Tables]:
    """Return the posterior after further tests and profiles for a true draw (1, 4) (steps 2, 3)."""
    profiles = tables.profiles
    peaks = tables.predicted(0, np.repeat(truth, tests, axis=0), int(rng.integers(2**31)))
    field, family, cv, log_mean = truth[0]
    law = factor_of_family(profiles.families[int(family)], float(cv)).distribution
    count = max(profiles.within.shape[1], 1)
    within = profiles.within.sum(axis=1, keepdims=True).repeat(levels, axis=1) / count
    variance = within[int(field)]
    errors = np.sqrt(variance) * rng.standard_normal(levels) - 0.5 * variance
    new = profiles.reference * law.ppf(rng.random(levels)) * np.exp(log_mean + errors)
    both = profiles._replace(
        levels=np.concatenate([profiles.levels, new]),
        within=np.concatenate([profiles.within, within], axis=1),
    )
    further = (np.concatenate([tables.peaks[0], np.maximum(peaks, 1e-9)]), *tables.peaks[1:])
    updated = replace(tables, profiles=both, peaks=further)
    return grid_of_profiles(both, updated)[1], updated

"""Systematic non-uniform driving: a gradient and an edge, by equilibrium and with inertia."""

from __future__ import annotations

import dataclasses
from functools import partial

import numpy as np
import xarray as xr

from stiction._typing import Array
from stiction.criterion.griffith import griffith_length
from stiction.dynamics.method import Rupture
from stiction.dynamics.simulate import simulate_rupture
from stiction.equilibrium.method import Equilibrium
from stiction.load import EdgeLoad, GradientLoad, Load
from stiction.papers.albertini2020.setting import Setting
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.problem import Problem

name = "driving"
title = "Non-uniform driving: a gradient and an edge"
depends = ("seed",)

SAMPLES = 16
EVENTS = 12
"""Arrested events kept of each sample."""
_NODES = 512
_EVENT_COST = 20  # of a sample with many events, in samples without
_RATE = 2e7  # Pa/s, as in the other ruptures
RUPTURE = work(Rupture(loading_rate=_RATE), 1)
_HELD = 1.005  # of the load of the first arrested event: what inertia is given
_PATIENCE = 1e-3  # s, longest rupture that is waited for
_SLIPPED = 1e-2  # of the largest slip, from which a node belongs to the arrested patch


def cases(setting: Setting) -> dict[str, Load]:
    """The loads; tau_0 is the mean of each."""
    length = setting.problem.interface.extent
    return {
        "uniform": Load(),
        "gradient": Load(profile=GradientLoad(amplitude=0.9, centre=0.5)),
        "edge": Load(profile=EdgeLoad(excess=4.0, decay=0.1 * length, edge=0.5)),
    }


def problem_of(setting: Setting, load: Load) -> Problem:
    """The setting's problem under that load, with a residual strength of 0.6 of the weakest."""
    residual = 0.6 * max(setting.bounds[0], 0.0)
    problem = setting.problem
    return dataclasses.replace(
        problem,
        interface=dataclasses.replace(problem.interface, nodes=min(problem.interface.size, _NODES)),
        friction=dataclasses.replace(problem.friction, residual_strength=residual),
        load=load,
    )


def cost(context: Context) -> int:
    """Events by equilibrium, and as many ruptures."""
    each = work(Equilibrium(), _EVENT_COST) + RUPTURE
    return len(cases(context.setting)) * SAMPLES * each


def compute(context: Context) -> xr.Dataset:
    """Arrested events of each sample, the first of them with inertia, and Griffith's lengths."""
    setting = context.setting
    ratio = setting.correlation_ratios[1]
    parts = []
    for load in cases(setting).values():
        problem = problem_of(setting, load)
        field = setting.field(ratio)
        found = context.monte_carlo(
            problem, field, Equilibrium(events=EVENTS), SAMPLES, weight=_EVENT_COST
        )
        profiles = field.sample(problem.interface, samples=SAMPLES, seed=context.seed)
        energy = _energy(problem, profiles)
        length, stress = found["event_length"].values, found["event_stress"].values
        griffith = np.full_like(length, np.nan)
        there = np.isfinite(length)
        centre = 0.5 * problem.interface.extent
        griffith[there] = griffith_length(
            problem, stress[there], energy, centre=centre, arrest=True
        )
        arrested = np.flatnonzero(np.isfinite(length[:, 0]))
        dynamic = np.full(SAMPLES, np.nan)
        dynamic[arrested] = context.map(
            partial(_with_inertia, problem, profiles, stress[:, 0]), arrested, RUPTURE
        )
        context.report(RUPTURE * (SAMPLES - arrested.size))
        kept = found[["critical_stress", "first_instability", "arrested_events", "event_length",
                      "event_stress", "event_position", "event_moment"]]  # fmt: skip
        kept["griffith_length"] = (("sample", "event"), griffith, {"units": "m"})
        kept["dynamic_length"] = (
            "sample", dynamic, {"units": "m", "long_name": "first arrested patch with inertia"}
        )  # fmt: skip
        parts.append(kept)
    dataset = xr.concat(parts, dim="case", combine_attrs="drop").assign_coords(
        case=list(cases(setting))
    )
    dataset.attrs["correlation_ratio"] = ratio
    return dataset


def _energy(problem: Problem, profiles: Array) -> float:
    """Mean fracture energy, J/m^2."""
    friction = problem.friction
    drop = profiles - float(np.mean(friction.residual_strength))
    return float(np.mean(drop**2)) / (2.0 * float(np.max(friction.weakening_rate)))


def curve(setting: Setting, case: str, loads: Array) -> Array:
    """Griffith's length of arrest at the mean fracture energy against the load, m."""
    problem = problem_of(setting, cases(setting)[case])
    field = setting.field(setting.correlation_ratios[1])
    energy = _energy(problem, field.sample(problem.interface, samples=64, seed=0))
    centre = 0.5 * problem.interface.extent
    return griffith_length(problem, loads, energy, centre=centre, arrest=True)


def _with_inertia(problem: Problem, profiles: Array, stresses: Array, sample: int) -> float:
    """Length of the patch in which a rupture comes to rest under the load at which equilibrium
    has its first arrested event, m; the interface if it does not."""
    profile, stress = profiles[sample], float(stresses[sample])
    rise = _HELD * stress / _RATE
    run = simulate_rupture(
        problem,
        profile,
        method=Rupture(loading_rate=_RATE),
        load=([0.0, rise, rise + 1.0], [0.0, _HELD * stress, _HELD * stress]),
        stop="rest",
        end_time=rise + _PATIENCE,
        variables=("slip",),
        every=100_000,
        every_implicit=100_000,
        steps=False,
        progress=False,
    )
    slip = run["slip"].values[-1]
    return float(_longest(slip > _SLIPPED * slip.max())) * problem.interface.spacing


def _longest(inside: Array) -> int:
    """Nodes of the longest run on the circle."""
    if inside.all():
        return int(inside.size)
    stops = np.flatnonzero(~np.concatenate([inside, inside]))
    return int(np.diff(stops).max(initial=1)) - 1

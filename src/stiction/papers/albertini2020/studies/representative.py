"""One rupture in space and time, with the nucleation stress of its strength."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stiction._typing import Array
from stiction.criterion.nucleation import nucleation_stress
from stiction.dynamics.simulate import simulate_rupture
from stiction.papers.albertini2020.setting import Setting
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.papers.albertini2020.studies.ruptures import METHOD

name = "representative"
title = "A representative rupture"
depends = ("seed",)

EVERY = 6


LENGTH = 6.0
"""Of the slipping area, in h_n, at which it is asked how much of it has weakened."""


def cost(context: Context) -> int:
    """One run."""
    return work(METHOD, 1)


def compute(context: Context) -> xr.Dataset:
    """Sample 0 of the Monte Carlo study at the shortest simulated correlation length."""
    setting = context.setting
    ratio = setting.simulated_ratios[0]
    profile = setting.field(ratio).sample(setting.problem.interface, samples=1, seed=context.seed)
    run = simulate_rupture(
        setting.problem, profile, method=METHOD, variables=("slip_rate", "slip"), every=EVERY
    )
    run["slip_rate"] = run["slip_rate"].astype(np.float32)
    run["weakened_share"] = ((), _weakened(setting, run, profile[0]), {"units": "1"})
    run = run.drop_vars("slip")
    tau_n = nucleation_stress(setting.problem, profile)[0]
    run["nucleation_stress"] = ("x", tau_n, {"units": "Pa", "long_name": "nucleation stress"})
    run.attrs["correlation_ratio"] = ratio
    context.report(cost(context))
    return run


def _weakened(setting: Setting, run: xr.Dataset, strength: Array) -> float:
    """Share of the area around the onset at its residual strength, once it is `LENGTH` long."""
    problem = setting.problem
    friction, interface = problem.friction, problem.interface
    critical = (strength - friction.residual_strength) / friction.weakening_rate
    node = round(float(run["critical_position"]) / interface.spacing) % interface.size
    wanted = LENGTH * problem.nucleation_length / interface.spacing
    for slip in np.roll(run["slip"].values, interface.size // 2 - node, axis=1):
        moving = slip > 1e-3 * slip.max()
        stops = np.flatnonzero(~moving)
        left = stops[stops < interface.size // 2].max(initial=-1)
        right = stops[stops > interface.size // 2].min(initial=interface.size)
        if right - left - 1 >= wanted:
            inside = slice(left + 1, right)
            weak = np.roll(critical, interface.size // 2 - node)[inside]
            return float(np.mean(slip[inside] >= 0.999 * weak))
    return float("nan")

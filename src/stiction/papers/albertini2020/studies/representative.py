"""One rupture in space and time, with the nucleation stress of its strength."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stiction.criterion.nucleation import nucleation_stress
from stiction.dynamics.simulate import simulate_rupture
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.papers.albertini2020.studies.ruptures import METHOD

name = "representative"
title = "A representative rupture"
depends = ("seed",)

EVERY = 6


def cost(context: Context) -> int:
    """One run."""
    return work(METHOD, 1)


def compute(context: Context) -> xr.Dataset:
    """Sample 0 of the Monte Carlo study at the shortest simulated correlation length."""
    setting = context.setting
    ratio = setting.simulated_ratios[0]
    profile = setting.field(ratio).sample(setting.problem.interface, samples=1, seed=context.seed)
    run = simulate_rupture(
        setting.problem, profile, method=METHOD, variables=("slip_rate",), every=EVERY
    )
    run["slip_rate"] = run["slip_rate"].astype(np.float32)
    tau_n = nucleation_stress(setting.problem, profile)[0]
    run["nucleation_stress"] = ("x", tau_n, {"units": "Pa", "long_name": "nucleation stress"})
    run.attrs["correlation_ratio"] = ratio
    context.report(cost(context))
    return run

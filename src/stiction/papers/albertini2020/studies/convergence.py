"""Elastodynamic onset with other grids, loading rates and time steps, on the same fields."""

from __future__ import annotations

import dataclasses

import numpy as np
import xarray as xr

from stiction.dynamics.method import Rupture
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.papers.albertini2020.studies.ruptures import LOADING_RATE, METHOD
from stiction.problem import Problem

name = "convergence"
title = "Grid, loading rate and time step"
depends = ("seed", "ruptures")

MOST = 4
_FEWEST_NODES = 6.0  # in h_n, on the coarser grid


def _count(context: Context) -> int:
    return max(min(MOST, context.ruptures // 5), 1)


def _cases(problem: Problem) -> dict[str, tuple[Problem, Rupture, int]]:
    """Label -> problem, method, and cost in runs as they are."""

    def grid(factor: float) -> Problem:
        nodes = 2 * round(problem.interface.size * factor / 2)
        return dataclasses.replace(
            problem, interface=dataclasses.replace(problem.interface, nodes=nodes)
        )

    def rate(factor: float) -> Rupture:
        return dataclasses.replace(METHOD, loading_rate=LOADING_RATE * factor)

    half = dataclasses.replace(
        METHOD, courant=METHOD.courant / 2, load_step=METHOD.load_step / 2,
        slip_step=METHOD.slip_step / 2,
    )  # fmt: skip
    cases = {
        "as it is": (problem, METHOD, 1),
        "twice the nodes": (grid(2.0), METHOD, 3),
        "ten times the loading rate": (problem, rate(10.0), 1),
        "a tenth of the loading rate": (problem, rate(0.1), 1),
        "half the time step": (problem, half, 2),
    }
    if problem.nucleation_length >= _FEWEST_NODES * 2.0 * problem.interface.spacing:
        cases["half the nodes"] = (grid(0.5), METHOD, 1)
    return cases


def cost(context: Context) -> int:
    """All cases."""
    cases = _cases(context.setting.problem).values()
    return sum(times for _, _, times in cases) * work(METHOD, _count(context))


def compute(context: Context) -> xr.Dataset:
    """Critical stress of each case at the shortest simulated correlation length."""
    setting = context.setting
    field = setting.field(setting.simulated_ratios[0])
    stress, place, labels = [], [], []
    for label, (problem, method, times) in _cases(setting.problem).items():
        tell, context.report = context.report, lambda count: None
        try:
            found = context.monte_carlo(problem, field, method, _count(context))
        finally:
            context.report = tell
        context.report(times * work(METHOD, _count(context)))
        stress.append(found["critical_stress"].values)
        place.append(found["critical_position"].values)
        labels.append(label)
    return xr.Dataset(
        {
            "critical_stress": (("case", "sample"), np.array(stress), {"units": "Pa"}),
            "critical_position": (("case", "sample"), np.array(place), {"units": "m"}),
        },
        coords={"case": labels},
    )

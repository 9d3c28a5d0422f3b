"""Elastodynamic ruptures, and what three static predictions say of the same samples."""

from __future__ import annotations

import dataclasses

import numpy as np
import xarray as xr

from stiction.criterion.method import LocalCriterion
from stiction.dynamics.method import Rupture
from stiction.equilibrium.method import Equilibrium
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.problem import Problem

name = "ruptures"
title = "Elastodynamic ruptures against static predictions"
depends = ("seed", "ruptures")

LOADING_RATE = 2e7  # Pa/s
METHOD = Rupture(loading_rate=LOADING_RATE)
_LOCAL = ("critical_stress", "critical_position")
_EXACT = (*_LOCAL, "first_instability", "arrested_events", "slip_patches")


def printed_problem(problem: Problem) -> Problem:
    """The problem with the modulus that the paper prints, G/(1 - nu), that of plane strain."""
    return dataclasses.replace(problem, solid=dataclasses.replace(problem.solid, plane="strain"))


def cost(context: Context) -> int:
    """All runs, and the static methods."""
    once = work(METHOD, 1) + work(Equilibrium(), 1) + 2
    return len(context.setting.simulated_ratios) * context.ruptures * once


def compute(context: Context) -> xr.Dataset:
    """Onset by elastodynamics, and by `local_`, `printed_` and `exact_` prediction.

    Samples 0 to 19 of the Monte Carlo study at the first correlation length, 20 to 39 at the
    second, ...: the same draws serve every correlation length, and ought to serve only one here.
    """
    setting, count = context.setting, context.ruptures
    problem = setting.problem
    parts = []
    for i, ratio in enumerate(setting.simulated_ratios):
        field, first = setting.field(ratio), i * count
        part = context.monte_carlo(problem, field, METHOD, count, first)
        for label, case, method, names in (
            ("local", problem, LocalCriterion(), _LOCAL),
            ("printed", printed_problem(problem), LocalCriterion(), _LOCAL),
            ("exact", problem, Equilibrium(), _EXACT),
        ):
            found = context.monte_carlo(case, field, method, count, first)
            for key in names:
                part[f"{label}_{key}"] = found[key].assign_attrs(
                    long_name=f"{found[key].attrs['long_name']} ({label} prediction)"
                )
        # The numbers of the samples differ between correlation lengths.
        part["number"] = ("sample", np.arange(first, first + count), {"long_name": "sample number"})
        parts.append(part.assign_coords(sample=np.arange(count)))
    dataset = xr.concat(parts, dim="correlation_ratio", combine_attrs="drop")
    dataset.attrs["loading_rate"] = LOADING_RATE
    return dataset.assign_coords(
        correlation_ratio=(
            "correlation_ratio",
            list(setting.simulated_ratios),
            {"units": "1", "long_name": "xi_0/h_n"},
        )
    )

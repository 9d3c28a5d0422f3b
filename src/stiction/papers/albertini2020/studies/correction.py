"""The same fields, the paper's slips undone one by one: its modulus and its rounded weights."""

from __future__ import annotations

import dataclasses

import numpy as np
import xarray as xr

from stiction.criterion.method import LocalCriterion
from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.summary import stack
from stiction.statistics.estimates import mean

name = "correction"
title = "What the printed modulus and the rounded weights do to the critical stress"


def cost(context: Context) -> int:
    """Three side studies at every correlation length."""
    return 3 * len(context.setting.correlation_ratios) * context.fewer


def compute(context: Context) -> xr.Dataset:
    """Mean difference of tau_cr on the same fields: printed modulus, rounded weights.

    The fields are those of the paper: xi_0 in units of the printed h_n.
    """
    setting = context.setting
    problem = setting.problem
    # The printed modulus G/(1 - nu) is that of plane strain, whatever the setting's plane.
    printed = dataclasses.replace(problem, solid=dataclasses.replace(problem.solid, plane="strain"))
    own = dataclasses.replace(problem, solid=dataclasses.replace(problem.solid, plane="stress"))
    parts = {}
    for ratio in setting.correlation_ratios:
        field = setting.field(ratio, nucleation_length=printed.nucleation_length)
        stress = {
            key: context.monte_carlo(case, field, method, context.fewer)["critical_stress"].values
            for key, case, method in (
                ("own", own, LocalCriterion()),
                ("printed", printed, LocalCriterion()),
                ("rounded", own, LocalCriterion(weights="rounded")),
            )
        }
        numbers = {}
        for key in ("printed", "rounded"):
            difference = mean(stress[key] - stress["own"])
            numbers[key] = ((), difference.value, {"units": "Pa"})
            numbers[f"{key}_error"] = ((), difference.error, {"units": "Pa"})
        numbers["own"] = ((), float(np.mean(stress["own"])), {"units": "Pa"})
        parts[ratio] = xr.Dataset(numbers)
    return stack(parts, "correlation_ratio", "xi_0/h_n")

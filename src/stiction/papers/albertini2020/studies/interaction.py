"""The same samples by exact equilibrium: what the local criterion leaves out."""

from __future__ import annotations

import xarray as xr

from stiction.criterion.method import LocalCriterion
from stiction.equilibrium.method import Equilibrium
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.papers.albertini2020.studies.ruptures import printed_problem

name = "interaction"
title = "Exact equilibrium on the same samples"


def cost(context: Context) -> int:
    """All samples at every correlation length, exactly and by the printed formula."""
    each = work(Equilibrium(), 1) + work(LocalCriterion(), 1)
    return each * context.samples * len(context.setting.correlation_ratios)


def compute(context: Context) -> xr.Dataset:
    """Onset with all interactions between patches; sample i is that of the Monte Carlo study.

    Beside it what the local criterion says with the printed modulus G/(1 - nu), that of plane
    strain, which is how the paper predicts its plane-stress simulations.
    """
    setting = context.setting
    printed = printed_problem(setting.problem)
    parts = []
    for ratio in setting.correlation_ratios:
        field = setting.field(ratio)
        exact = context.monte_carlo(setting.problem, field, Equilibrium(), context.samples)
        other = context.monte_carlo(printed, field, LocalCriterion(), context.samples)
        for name in ("first_instability", "critical_position"):
            exact[f"printed_{name}"] = other[name].assign_attrs(
                long_name=f"{other[name].attrs['long_name']}, by the printed formula"
            )
        parts.append(exact)
    dataset = xr.concat(parts, dim="correlation_ratio", combine_attrs="drop")
    return dataset.assign_coords(
        correlation_ratio=(
            "correlation_ratio",
            list(setting.correlation_ratios),
            {"units": "1", "long_name": "xi_0/h_n"},
        )
    )

"""Many more samples by the local criterion: the cheapest control variate of elastodynamics."""

from __future__ import annotations

import xarray as xr

from stiction.criterion.method import LocalCriterion
from stiction.papers.albertini2020.studies.context import Context, work

name = "abundant"
title = "Many more samples by the local criterion"

FACTOR = 20
"""Times the samples of the Monte Carlo study."""


def cost(context: Context) -> int:
    """All of them, at every correlation length."""
    samples = FACTOR * context.samples
    return len(context.setting.correlation_ratios) * work(LocalCriterion(), samples)


def compute(context: Context) -> xr.Dataset:
    """Critical stress; the first samples are those of the Monte Carlo study."""
    setting = context.setting
    parts = []
    for ratio in setting.correlation_ratios:
        found = context.monte_carlo(
            setting.problem, setting.field(ratio), LocalCriterion(), FACTOR * context.samples
        )
        parts.append(found[["critical_stress"]])
    dataset = xr.concat(parts, dim="correlation_ratio", combine_attrs="drop")
    return dataset.assign_coords(
        correlation_ratio=(
            "correlation_ratio",
            list(setting.correlation_ratios),
            {"units": "1", "long_name": "xi_0/h_n"},
        )
    )

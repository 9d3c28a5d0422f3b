"""Critical stress against correlation length far beyond the paper's range, at fixed L."""

from __future__ import annotations

import xarray as xr

from stiction.criterion.method import LocalCriterion
from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.summary import stack, summarise

name = "trend"
title = "Critical stress against correlation length at fixed interface length"

RATIOS = (0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0)
MEAN_MODES = (0, 1)


def _ratios(context: Context) -> list[float]:
    """Those at which at least one mode is left, whatever the setting."""
    setting = context.setting
    longest = 2.0 * setting.truncation * setting.problem.interface.extent
    length = setting.problem.nucleation_length
    return [ratio for ratio in RATIOS if ratio * length < 0.5 * longest]


def cost(context: Context) -> int:
    """A side study's samples at every ratio, with and without the mean mode."""
    return len(_ratios(context)) * len(MEAN_MODES) * context.fewer


def compute(context: Context) -> xr.Dataset:
    """Summary of tau_cr at each xi_0/h_n, without (0) and with (1) the mean mode."""
    setting = context.setting
    by_mode = {}
    for mean_mode in MEAN_MODES:
        by_ratio = {}
        for ratio in _ratios(context):
            field = setting.field(ratio, mean_mode=bool(mean_mode))
            result = context.monte_carlo(setting.problem, field, LocalCriterion(), context.fewer)
            by_ratio[ratio] = summarise(result["critical_stress"].values)
        by_mode[mean_mode] = stack(by_ratio, "ratio", "xi_0/h_n")
    return stack(by_mode, "mean_mode", "whether z has the mode k = 0")

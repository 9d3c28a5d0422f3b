"""Size of the interface: mean and scatter of tau_cr, and how pieces make a whole."""

from __future__ import annotations

import dataclasses

import numpy as np
import xarray as xr
from scipy.stats import ks_2samp

from stiction._typing import Array
from stiction.criterion.method import LocalCriterion
from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.summary import stack, summarise
from stiction.problem import Problem

name = "size"
title = "Size of the interface"

FACTORS = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
"""L over the setting's L."""
_JOINED = 1.0  # from which length on pieces are put together


def ratio_of(context: Context) -> float:
    """The correlation length of this study: the second of the setting's."""
    return context.setting.correlation_ratios[1]


def cost(context: Context) -> int:
    """A side study for each length; longer ones are dearer."""
    return round(sum(max(factor, 1.0) for factor in FACTORS) * context.fewer)


def longer(problem: Problem, factor: float) -> Problem:
    """The same with `factor` times the length at the same spacing."""
    grid = problem.interface
    return dataclasses.replace(
        problem,
        interface=dataclasses.replace(
            grid, length=grid.extent * factor, nodes=2 * round(grid.size * factor / 2)
        ),
    )


def compute(context: Context) -> xr.Dataset:
    """Summaries of tau_cr against L."""
    setting = context.setting
    ratio = ratio_of(context)
    stress: dict[float, Array] = {}
    for factor in FACTORS:
        result = context.monte_carlo(
            longer(setting.problem, factor), setting.field(ratio), LocalCriterion(),
            context.fewer,
        )  # fmt: skip
        stress[factor] = result["critical_stress"].values
        context.report(max(round((factor - 1.0) * context.fewer), 0))
    parts = {}
    for factor, values in stress.items():
        part = summarise(values)
        pieces = round(factor / _JOINED)
        distance = np.nan
        if pieces > 1:
            # Weakest of so many independent interfaces of the setting's length, drawn again.
            generator = np.random.default_rng(context.seed)
            drawn = generator.choice(stress[_JOINED], (4 * values.size, pieces)).min(axis=1)
            distance = float(ks_2samp(values, drawn).statistic)
        part["joined_distance"] = ((), distance, {"units": "1"})
        parts[factor] = part
    dataset = stack(parts, "length_factor", "L over the setting's L")
    dataset.attrs["correlation_ratio"] = ratio
    return dataset

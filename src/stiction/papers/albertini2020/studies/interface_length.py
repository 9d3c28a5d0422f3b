"""Longer and shorter interfaces with the same strength."""

from __future__ import annotations

import dataclasses

import xarray as xr

from stiction.criterion.method import LocalCriterion
from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.summary import stack, summarise

name = "interface_length"
title = "Interface length"

FACTORS = (0.5, 1.0, 2.0, 4.0)


def ratio_of(context: Context) -> float:
    """The correlation length of this study: the second of the setting's."""
    return context.setting.correlation_ratios[1]


def cost(context: Context) -> int:
    """A side study's samples for each length."""
    return len(FACTORS) * context.fewer


def compute(context: Context) -> xr.Dataset:
    """Summary of tau_cr against L/L_0, at equal spacing of nodes."""
    setting = context.setting
    problem, interface = setting.problem, setting.problem.interface
    field = setting.field(ratio_of(context))
    parts = {}
    for factor in FACTORS:
        grid = dataclasses.replace(
            interface,
            length=interface.extent * factor,
            nodes=2 * round(interface.size * factor / 2),
        )
        longer = dataclasses.replace(problem, interface=grid)
        result = context.monte_carlo(longer, field, LocalCriterion(), context.fewer)
        parts[factor] = summarise(result["critical_stress"].values)
    dataset = stack(parts, "length_factor", "L over the setting's L")
    dataset.attrs["correlation_ratio"] = ratio_of(context)
    return dataset

"""The Monte Carlo study: many samples at each correlation length, by the local criterion."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from stiction.criterion.nucleation import nucleation_stress
from stiction.papers.albertini2020.criterion_with_moments import STATIONS, CriterionWithMoments
from stiction.papers.albertini2020.studies.context import Context
from stiction.statistics.densities import count_into

name = "monte_carlo"
title = "Monte Carlo study by the local criterion"

CELLS = 2048
_PER_SAMPLE = ("nucleation_stress",)


def cost(context: Context) -> int:
    """All samples at every correlation length."""
    return context.samples * len(context.setting.correlation_ratios)


def compute(context: Context) -> xr.Dataset:
    """Onset of every sample, moments and a histogram of tau_n, and one sample to be drawn."""
    setting = context.setting
    interface = setting.problem.interface
    method = CriterionWithMoments(reference=setting.mean)
    parts, profiles = [], []
    for ratio in setting.correlation_ratios:
        field = setting.field(ratio)
        result = context.monte_carlo(setting.problem, field, method, context.samples)
        counts, low, high = _histogram(result["nucleation_stress"].values, setting.bounds)
        result = result.drop_vars(_PER_SAMPLE)
        result["nucleation_counts"] = ("cell", counts, {"long_name": "histogram of tau_n"})
        result["nucleation_low"] = ((), low, {"units": "Pa", "long_name": "its lower end"})
        result["nucleation_high"] = ((), high, {"units": "Pa", "long_name": "its upper end"})
        parts.append(result)
        # The same draws serve every correlation length.
        draws = field.draws(interface, 1, context.seed)
        profiles.append(field.profiles(interface, draws)[0])
    dataset = xr.concat(parts, dim="correlation_ratio", combine_attrs="drop")
    tau_n = nucleation_stress(setting.problem, np.array(profiles))
    dims = ("correlation_ratio", "x")
    dataset["profile_strength"] = (
        dims,
        np.array(profiles),
        {"units": "Pa", "long_name": "peak strength of sample 0"},
    )
    dataset["profile_nucleation_stress"] = (
        dims,
        tau_n,
        {"units": "Pa", "long_name": "nucleation stress of sample 0"},
    )
    dataset.attrs["stations"] = min(STATIONS, interface.size)
    return dataset.assign_coords(
        correlation_ratio=(
            "correlation_ratio",
            list(setting.correlation_ratios),
            {"units": "1", "long_name": "xi_0/h_n"},
        ),
        x=("x", interface.x, {"units": "m", "long_name": "position along the interface"}),
    )


def _histogram(values: Any, bounds: tuple[float, float]) -> tuple[Any, float, float]:
    # tau_n is an average of tau_p and cannot leave its support; without bounds, leave room.
    smallest, largest = float(values.min()), float(values.max())
    room = 0.25 * (largest - smallest)
    low = bounds[0] if np.isfinite(bounds[0]) else smallest - room
    high = bounds[1] if np.isfinite(bounds[1]) else largest + room
    counts = np.zeros(CELLS, dtype=np.int64)
    count_into(np.ascontiguousarray(values).ravel(), low, high, counts)
    return counts, low, high

"""What needs no samples: correlations, mean and variance of the nucleation stress, limits."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stiction.criterion.eigenproblem import exact_weight, rounded_weight
from stiction.interface import Interface
from stiction.papers.albertini2020.studies.context import Context
from stiction.random.random_field import RandomField
from stiction.statistics.moments import nucleation_limits, nucleation_statistics

name = "theory"
title = "Exact statistics of the nucleation stress"

UNRESOLVED = 1e-3  # share of the power that a grid may fold without changing the curve
RATIOS = np.geomspace(0.02, 20.0, 41)


def cost(context: Context) -> int:
    """No samples."""
    return 0


def compute(context: Context) -> xr.Dataset:
    """Correlations at the Monte Carlo ratios, variance against xi_0/h_n, eigenfunction."""
    setting = context.setting
    problem, interface = setting.problem, setting.problem.interface
    ratios = list(setting.correlation_ratios)
    fields = [setting.field(ratio) for ratio in ratios]
    finest = [setting.field(float(ratio)) for ratio in RATIOS]
    usable = [_resolved(field, interface) for field in finest]
    finite = [
        nucleation_statistics(problem, field).variance_ratio if there else np.nan
        for field, there in zip(finest, usable, strict=True)
    ]
    infinite = [
        nucleation_statistics(problem, field, infinite=True).variance_ratio for field in finest
    ]
    own = [nucleation_statistics(problem, field) for field in fields]
    limits = nucleation_limits(problem, fields[0])
    s = np.linspace(-1.0, 1.0, 401)
    return xr.Dataset(
        {
            "correlation": (
                ("correlation_ratio", "lag"),
                np.array([field.correlation(interface) for field in fields]),
                {"units": "1", "long_name": "correlation of the strength"},
            ),
            "gaussian_correlation": (
                ("correlation_ratio", "lag"),
                np.array([field.correlation(interface, of="z") for field in fields]),
                {"units": "1", "long_name": "correlation of the Gaussian field"},
            ),
            "variance_ratio": ("correlation_ratio", [each.variance_ratio for each in own]),
            "nucleation_mean": (
                "correlation_ratio",
                [each.mean for each in own],
                {"units": "Pa", "long_name": "mean of the nucleation stress"},
            ),
            "variance_ratio_periodic": ("ratio", np.array(finite)),
            "variance_ratio_infinite": ("ratio", np.array(infinite)),
            "exact_weight": ("s", exact_weight().at(s)),
            "rounded_weight": ("s", rounded_weight().at(s)),
        },
        coords={
            "correlation_ratio": ("correlation_ratio", ratios, {"units": "1"}),
            "ratio": ("ratio", RATIOS, {"units": "1", "long_name": "xi_0/h_n"}),
            "lag": ("lag", interface.x, {"units": "m"}),
            "s": ("s", s, {"units": "1", "long_name": "position in half-lengths of the patch"}),
        },
        attrs={
            "short_slope": limits.short_slope,
            "long_ratio_fixed_length": limits.long_ratio_fixed_length,
        },
    )


def _resolved(field: RandomField, interface: Interface) -> bool:
    """Whether the interface holds a mode of the field, and its grid nearly all of the power."""
    if 2.0 * np.pi / interface.extent > field.spectrum.cutoff:
        return False
    unresolved = field.modes(interface).sigma[interface.size // 2 + 1 :]
    return float(np.sum(unresolved**2)) < UNRESOLVED

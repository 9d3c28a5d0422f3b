"""Normal pressure with a residual strength: what Coulomb's law at every point makes of h_n."""

from __future__ import annotations

import dataclasses

import numpy as np
import xarray as xr

from stiction.equilibrium.method import Equilibrium
from stiction.papers.albertini2020.setting import Setting
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.papers.albertini2020.studies.summary import stack, summarise
from stiction.problem import Problem
from stiction.statistics.estimates import mean

name = "pressure"
title = "Normal pressure, with a residual strength"

FACTORS = (0.5, 1.0, 2.0, 3.0)
"""Pressure over that of the setting."""
RESIDUAL = 0.3
"""tau_r over <tau_p>: as much weakening, relative to the strength, as the cited experiments."""
STRENGTH = 0.5
"""<tau_p> over the pressure."""
MOST = 400
_NODES_IN_PATCH = 8.0


def _count(context: Context) -> int:
    return min(MOST, max(context.samples // 8, 64))


def cost(context: Context) -> int:
    """Every pressure."""
    return len(FACTORS) * work(Equilibrium(), _count(context))


def problem_at(setting: Setting, factor: float) -> Problem:
    """tau_p and tau_r in proportion to the pressure, d_c fixed: W too is in proportion to it.

    At a factor of one h_n is the setting's.
    """
    resolution = setting.problem.nucleation_length / setting.problem.interface.spacing
    finer = 2 ** max(int(np.ceil(np.log2(_NODES_IN_PATCH * FACTORS[-1] / resolution))), 0)
    grid = setting.problem.interface
    rate = float(np.max(setting.problem.friction.weakening_rate)) * factor
    return dataclasses.replace(
        setting.problem,
        interface=dataclasses.replace(grid, nodes=grid.size * finer),
        friction=dataclasses.replace(
            setting.problem.friction,
            weakening_rate=rate,
            residual_strength=RESIDUAL * setting.mean * factor,
        ),
        load=dataclasses.replace(
            setting.problem.load, normal_pressure=setting.mean * factor / STRENGTH
        ),
    )


def compute(context: Context) -> xr.Dataset:
    """Friction coefficient, and length of the critical patch by exact equilibrium."""
    setting = context.setting
    ratio = setting.correlation_ratios[1]
    parts = {}
    for factor in FACTORS:
        problem = problem_at(setting, factor)
        # The roughness keeps its length: xi_0 is told in the h_n of the setting.
        field = setting.field(ratio, marginal=_stronger(setting, factor))
        found = context.monte_carlo(problem, field, Equilibrium(), _count(context))
        part = summarise(found["friction_coefficient"].values)
        length = mean(found["critical_patch_length"].values)
        part["patch_length"], part["patch_length_error"] = length.value, length.error
        part["nucleation_length"] = problem.nucleation_length
        part["drop"] = (1.0 - RESIDUAL) * setting.mean * factor
        parts[factor] = part
    return stack(parts, "pressure", "pressure over the setting's")


def _stronger(setting: Setting, factor: float) -> object:
    """The strength times the factor."""
    own = setting.marginal
    if hasattr(own, "low") and hasattr(own, "high"):
        return dataclasses.replace(own, low=own.low * factor, high=own.high * factor)
    import scipy.stats

    frozen = own.distribution
    return scipy.stats.truncnorm(
        -4.0, 4.0, float(frozen.mean()) * factor, float(frozen.std()) * factor
    )

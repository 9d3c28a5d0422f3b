"""One field, ever smaller nucleation length: xi_0/h_n grows with L/xi_0 held fixed."""

from __future__ import annotations

import dataclasses

import numpy as np
import xarray as xr
from scipy.stats import ks_2samp

from stiction.criterion.method import LocalCriterion
from stiction.papers.albertini2020.criterion_with_moments import CriterionWithMoments
from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.summary import stack, summarise

name = "window"
title = "Vanishing nucleation length in one and the same field"

FACTORS = (1.0, 2.0, 4.0, 8.0)
NODES_IN_WINDOW = 8.0


def cost(context: Context) -> int:
    """A side study's samples for each nucleation length."""
    return len(FACTORS) * context.fewer


def compute(context: Context) -> xr.Dataset:
    """Summaries of tau_cr and of min tau_p of the same samples, and how far they are apart."""
    setting = context.setting
    problem, interface = setting.problem, setting.problem.interface
    largest = setting.correlation_ratios[-1]
    field = setting.field(largest)
    resolution = problem.nucleation_length / interface.spacing / FACTORS[-1]
    finer = 2 ** max(int(np.ceil(np.log2(NODES_IN_WINDOW / resolution))), 0)
    grid = dataclasses.replace(interface, nodes=interface.size * finer)
    base = CriterionWithMoments(reference=setting.mean)
    parts, weakest = {}, None
    for factor in FACTORS:
        friction = dataclasses.replace(
            problem.friction, weakening_rate=float(np.max(problem.friction.weakening_rate)) * factor
        )
        stiffer = dataclasses.replace(problem, interface=grid, friction=friction)
        method = base if weakest is None else LocalCriterion()
        result = context.monte_carlo(stiffer, field, method, context.fewer)
        if weakest is None:
            weakest = result["weakest_strength"].values
        stress = result["critical_stress"].values
        part = summarise(stress)
        test = ks_2samp(stress, weakest)
        part["distance"] = ((), float(test.statistic), {"long_name": "Kolmogorov-Smirnov distance"})
        part["excess"] = ((), float(np.mean(stress - weakest)), {"units": "Pa"})
        part["excess_error"] = (
            (),
            float(np.std(stress - weakest, ddof=1) / np.sqrt(stress.size)),
            {"units": "Pa"},
        )
        parts[largest * factor] = part
    own = summarise(weakest)
    own = own.rename({str(key): f"weakest_{key}" for key in own.data_vars})
    return stack(parts, "ratio", "xi_0/h_n").merge(own)

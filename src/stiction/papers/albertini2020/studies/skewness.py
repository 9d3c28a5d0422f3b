"""The mirrored distribution: a mostly strong interface with few weak regions."""

from __future__ import annotations

import dataclasses

import numpy as np
import scipy.stats
import xarray as xr

from stiction.criterion.method import LocalCriterion
from stiction.papers.albertini2020.setting import Setting
from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.summary import stack, summarise
from stiction.random.marginals import Beta

name = "skewness"
title = "Strength skewed to high values instead of low ones"


def mirrored(setting: Setting) -> object | None:
    """The setting's Beta distribution with its shapes swapped; none for other distributions."""
    marginal = setting.marginal
    if not isinstance(marginal, Beta):
        return None
    return dataclasses.replace(marginal, alpha=marginal.beta, beta=marginal.alpha)


def cost(context: Context) -> int:
    """Two side studies at every correlation length."""
    return 2 * len(context.setting.correlation_ratios) * context.fewer


def compute(context: Context) -> xr.Dataset:
    """Summary of tau_cr for the setting's distribution and for its mirror image."""
    setting = context.setting
    own = setting.marginal
    other = mirrored(setting) or scipy.stats.truncnorm(
        -4.0, 4.0, own.distribution.mean(), own.distribution.std()
    )
    parts = {}
    for skew, marginal in ((0, own), (1, other)):
        by_ratio = {}
        for ratio in setting.correlation_ratios:
            field = setting.field(ratio, marginal=marginal)
            result = context.monte_carlo(setting.problem, field, LocalCriterion(), context.fewer)
            by_ratio[ratio] = summarise(result["critical_stress"].values)
        parts[skew] = stack(by_ratio, "correlation_ratio", "xi_0/h_n")
        parts[skew]["point_skewness"] = float(
            np.asarray(field.marginal.distribution.stats(moments="s"))
        )
    return stack(parts, "mirrored", "0: the setting's distribution, 1: its mirror image")

"""Other spectral exponents, at equal length of decay of the correlation to 1/e."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import ks_2samp

from stiction.criterion.method import LocalCriterion
from stiction.paper.studies.context import Context
from stiction.paper.studies.summary import stack, summarise

name = "spectrum"
title = "Other spectral exponents at equal e-folding length"

FACTORS = (0.375, 0.5, 1.0, 2.0)
POWER_KEPT = 0.999


def cost(context: Context) -> int:
    """A side study's samples for each exponent and correlation length."""
    return len(FACTORS) * len(context.setting.correlation_ratios) * context.fewer


def compute(context: Context) -> xr.Dataset:
    """Summary of tau_cr for each exponent, its e-folding length that of the setting's field."""
    setting = context.setting
    by_exponent = {}
    reference: dict[float, NDArray[np.float64]] = {}
    # The setting's own exponent comes first: the others are measured against it.
    for factor in sorted(FACTORS, key=lambda factor: factor != 1.0):
        exponent = max(setting.exponent * factor, 0.75)
        by_ratio = {}
        for ratio in setting.correlation_ratios:
            length = setting.field(ratio).efolding_length()
            field = setting.field(ratio, exponent=exponent, power_kept=POWER_KEPT)
            field = field.with_efolding_length(length)
            result = context.monte_carlo(
                setting.problem, field, LocalCriterion(), context.fewer
            )
            stress = result["critical_stress"].values
            part = summarise(stress)
            distance = ks_2samp(stress, reference.setdefault(ratio, stress)).statistic
            part["distance"] = ((), float(distance))
            by_ratio[ratio] = part
        by_exponent[exponent] = stack(by_ratio, "correlation_ratio", "xi_0/h_n")
    return stack(by_exponent, "exponent", "exponent of the spectrum").sortby("exponent")

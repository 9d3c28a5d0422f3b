"""Other spectral exponents, at equal length of decay of the correlation to 1/e."""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy.stats import ks_2samp

from stiction._typing import Array
from stiction.criterion.method import LocalCriterion
from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.summary import stack, summarise
from stiction.statistics.estimates import Estimate

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
    reference: dict[float, Array] = {}
    # The setting's own exponent comes first: the others are measured against it.
    for factor in sorted(FACTORS, key=lambda factor: factor != 1.0):
        exponent = max(setting.exponent * factor, 0.75)
        by_ratio = {}
        for ratio in setting.correlation_ratios:
            length = setting.field(ratio).efolding_length()
            field = setting.field(ratio, exponent=exponent, power_kept=POWER_KEPT)
            field = field.with_efolding_length(length)
            result = context.monte_carlo(setting.problem, field, LocalCriterion(), context.fewer)
            stress = result["critical_stress"].values
            part = summarise(stress)
            usual = reference.setdefault(ratio, stress)
            part["distance"] = ((), float(ks_2samp(stress, usual).statistic))
            for key, change in relative_changes(stress, usual).items():
                part[f"{key}_change"] = ((), change.value, {"units": "1"})
                part[f"{key}_change_error"] = ((), change.error, {"units": "1"})
            by_ratio[ratio] = part
        by_exponent[exponent] = stack(by_ratio, "correlation_ratio", "xi_0/h_n")
    return stack(by_exponent, "exponent", "exponent of the spectrum").sortby("exponent")


def relative_changes(stress: Array, usual: Array) -> dict[str, Estimate]:
    """Relative changes of mean and standard deviation between samples of the same draws.

    The draws are shared, so most of the sampling error cancels; the errors come from the
    difference of the influence functions.
    """

    def influence(values: Array) -> Array:
        return 0.5 * ((values - values.mean()) ** 2 / values.var() - 1.0)

    def error(differences: Array) -> float:
        return float(differences.std(ddof=1) / np.sqrt(differences.size))

    shift = stress / usual.mean() - usual / usual.mean()
    widening = float(stress.std() / usual.std())
    return {
        "mean": Estimate(float(shift.mean()), error(shift)),
        "deviation": Estimate(
            widening - 1.0, widening * error(influence(stress) - influence(usual))
        ),
    }

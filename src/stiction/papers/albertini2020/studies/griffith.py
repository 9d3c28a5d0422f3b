"""Griffith's length beside the nucleation length, and the fracture energy along the interface."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.summary import stack
from stiction.statistics.estimates import mean

name = "griffith"
title = "Griffith length and fracture energy"
needs = ("monte_carlo",)


def cost(context: Context) -> int:
    """No samples of its own."""
    return 0


def compute(context: Context) -> xr.Dataset:
    """Moments of Gamma(x), exactly, and 2a with G = <Gamma> under each sample's onset stress.

    Gamma = (tau_p - tau_r)^2/(2 W) and G = pi a drop^2/(2 G*) (Albertini et al., 2020, Eq. 14).
    """
    setting = context.setting
    problem = setting.problem
    residual = float(np.mean(problem.friction.residual_strength))
    rate = float(np.max(problem.friction.weakening_rate))
    distribution = setting.marginal.distribution
    about = distribution.mean() - residual
    second, third, fourth = (_central(distribution, k) for k in (2, 3, 4))
    square = about**2 + second
    variance = 4 * about**2 * second + 4 * about * third + fourth - second**2
    energy = square / (2.0 * rate)
    parts = {}
    for ratio in setting.correlation_ratios:
        stress = context.results["monte_carlo"]["critical_stress"].sel(correlation_ratio=ratio)
        length = (
            4.0 * problem.effective_modulus * energy / (np.pi * (stress.values - residual) ** 2)
        )
        found = mean(length / problem.nucleation_length)
        parts[ratio] = xr.Dataset({"length_ratio": found.value, "length_ratio_error": found.error})
    dataset = stack(parts, "correlation_ratio", "xi_0/h_n")
    dataset["energy_mean"] = ((), energy, {"units": "J/m^2", "long_name": "mean of Gamma"})
    dataset["energy_variation"] = ((), float(np.sqrt(variance)) / square, {"units": "1"})
    return dataset


def _central(distribution: object, order: int) -> float:
    """Central moment of a distribution."""
    centre = distribution.mean()  # type: ignore[attr-defined]  # of scipy.stats, untyped
    return float(distribution.expect(lambda x: (x - centre) ** order))  # type: ignore[attr-defined]

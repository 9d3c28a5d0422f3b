"""Numbers that several figures and claims derive from the studies."""

from __future__ import annotations

import numpy as np

from stiction._typing import Array
from stiction.papers.albertini2020.data import Data
from stiction.problem import Problem
from stiction.statistics.control_variates import Combined, combined_mean
from stiction.statistics.estimates import Estimate, pooled_moments, standard_deviation
from stiction.statistics.quantiles import quantile_distance

SCATTER = {
    "lower": "median less lower quartile",
    "quartiles": "quartile range",
    "deviation": "standard deviation",
}
"""Measures of how much tau_cr varies; the paper plots the first."""


def scatter(data: Data, ratio: float) -> dict[str, Estimate]:
    """The three measures of the scatter of tau_cr in the Monte Carlo study, Pa."""
    stress = data.at(ratio)["critical_stress"].values
    return {
        "lower": quantile_distance(stress, 0.25, 0.5),
        "quartiles": quantile_distance(stress, 0.25, 0.75),
        "deviation": standard_deviation(stress),
    }


def nucleation_moments(data: Data, ratio: float) -> tuple[Estimate, Estimate, Estimate]:
    """Mean and standard deviation over <tau_p>, and skewness, of tau_n in the Monte Carlo study."""
    shift, deviation, skew = pooled_moments(data.at(ratio)["nucleation_moments"].values)
    return Estimate(1.0 + shift.value, shift.error), deviation, skew


def variance_ratio(data: Data, ratio: float) -> Estimate:
    """Var[tau_n]/Var[tau_p] in the Monte Carlo study."""
    _, deviation, _ = nucleation_moments(data, ratio)
    own = data.setting.field(ratio).standard_deviation / data.setting.mean
    value = (deviation.value / own) ** 2
    return Estimate(value, 2.0 * value * deviation.error / deviation.value)


def apart(problem: Problem, one: Array, other: Array) -> Array:
    """Whether two positions are more than h_n/2 from each other, the shorter way round."""
    gap = np.abs(one - other)
    gap = np.minimum(gap, problem.interface.extent - gap)
    result: Array = gap > 0.5 * problem.nucleation_length
    return result


def overprediction(data: Data, ratio: float) -> Array:
    """First instability by the local criterion less that by exact equilibrium, each sample, Pa."""
    local = data.at(ratio)["first_instability"].values
    exact = data["interaction"].sel(correlation_ratio=ratio)["first_instability"].values
    result: Array = local - exact
    return result


def misplaced(data: Data, ratio: float, *, printed: bool = False) -> Array:
    """Whether the local criterion puts the onset more than h_n/2 from where it is, each sample.

    With the modulus of the plane state, or with the printed one.
    """
    problem = data.setting.problem
    study = data["interaction"].sel(correlation_ratio=ratio)
    local = study["printed_critical_position"] if printed else data.at(ratio)["critical_position"]
    return apart(problem, local.values, study["critical_position"].values)


def shift_of(data: Data, ratio: float, prediction: str) -> Array:
    """Relative error of a static prediction of tau_cr against elastodynamics, each rupture.

    `prediction` is "local", "printed" or "exact"; positive where it predicts too much.
    """
    runs = data["ruptures"].sel(correlation_ratio=ratio)
    name = "first_instability" if prediction == "exact" else "critical_stress"
    found = runs["critical_stress"].values
    result: Array = (runs[f"{prediction}_{name}"].values - found) / found
    return result


def displaced(data: Data, ratio: float, prediction: str) -> Array:
    """Whether a prediction puts the onset of a rupture more than h_n/2 from where it began."""
    problem = data.setting.problem
    runs = data["ruptures"].sel(correlation_ratio=ratio)
    predicted = runs[f"{prediction}_critical_position"].values
    return apart(problem, predicted, runs["critical_position"].values)


def dynamic_mean(data: Data, ratio: float) -> Combined:
    """Mean tau_cr by elastodynamics, Pa: few ruptures, and what equilibrium says of all samples.

    The samples of the ruptures are some of those of the Monte Carlo study where that is larger.
    """
    runs = data["ruptures"].sel(correlation_ratio=ratio)
    dear, cheap = runs["critical_stress"].values, runs["exact_critical_stress"].values
    return combined_mean(dear, _joined(cheap, runs["number"].values, _exact_all(data, ratio)))


def _exact_all(data: Data, ratio: float) -> Array:
    found: Array = data["interaction"]["critical_stress"].sel(correlation_ratio=ratio).values
    return found


def _joined(first: Array, numbers: Array, every: Array) -> Array:
    """Those of the dear runs first, then all others."""
    others = np.setdiff1d(np.arange(every.size), numbers)
    return np.concatenate([first, every[others]])


def fidelity(data: Data, ratio: float) -> tuple[Array, Array, Array]:
    """tau_cr of the same samples by ever cheaper methods: elastodynamics, equilibrium, criterion.

    Each has the samples of the one before and more.
    """
    dear = data["dynamic"]["critical_stress"].sel(correlation_ratio=ratio).values
    exact = _exact_all(data, ratio)
    local = data["abundant"]["critical_stress"].sel(correlation_ratio=ratio).values
    return dear[: exact.size], exact, local


def toughest(data: Data) -> float:
    """Largest fracture energy, (tau_p,max - tau_r)^2/(2 W), J/m^2; infinite without a bound."""
    friction = data.setting.problem.friction
    high = data.setting.bounds[1] - float(np.mean(friction.residual_strength))
    return high**2 / (2.0 * float(np.max(friction.weakening_rate)))


def release_rate(data: Data, stress: float, length: Array | float) -> Array:
    """Static energy release rate, J/m^2, of a crack of this length in units of h_n.

    pi a drop^2/(2 G*) for half-length a and drop = stress - tau_r: a shear crack between identical
    half-spaces (Albertini et al., 2020, Sec. 5.2).
    """
    problem = data.setting.problem
    drop = stress - float(np.mean(problem.friction.residual_strength))
    half = 0.5 * np.asarray(length) * problem.nucleation_length
    result: Array = np.pi * half * drop**2 / (2.0 * problem.effective_modulus)
    return result


def variation(data: Data, ratio: float) -> Estimate:
    """Coefficient of variation of tau_cr in the Monte Carlo study; that of mu_s at any pressure."""
    stress = data.at(ratio)["critical_stress"].values
    found = standard_deviation(stress)
    return found.scaled(1.0 / float(stress.mean()))


def required_width(data: Data, factor: float, wanted: float) -> tuple[float, float]:
    """Coefficient of variation of the strength at which tau_cr has the wanted one, and its own.

    The local criterion is linear in the strength: w times the deviations of tau_p from its mean
    give w times those of tau_cr. `factor` is L over the setting's.
    """
    study = data["size"].sel(length_factor=factor)
    mean, spread = float(study["mean"]), float(study["standard_deviation"])
    unit = data.setting.mean
    # w spread = wanted (unit + w (mean - unit))
    width = wanted * unit / (spread + wanted * (unit - mean))
    own = data.setting.field(data.ratios[1]).standard_deviation / unit
    return width * own, own

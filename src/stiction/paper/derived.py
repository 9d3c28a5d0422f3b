"""Numbers that several figures and claims derive from the studies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stiction.paper.data import Array, Data
from stiction.statistics.estimates import Estimate, pooled_moments


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


def overprediction(data: Data, ratio: float) -> Array:
    """First instability by the local criterion less that by exact equilibrium, each sample, Pa."""
    local = data.at(ratio)["first_instability"].values
    exact = data["interaction"].sel(correlation_ratio=ratio)["first_instability"].values
    result: Array = local - exact
    return result


def misplaced(data: Data, ratio: float, *, printed: bool = False) -> NDArray[np.bool_]:
    """Whether the local criterion puts the onset more than h_n/2 from where it is, each sample.

    With the modulus of the plane state, or with the printed one.
    """
    problem = data.setting.problem
    study = data["interaction"].sel(correlation_ratio=ratio)
    local = study["printed_critical_position"] if printed else data.at(ratio)["critical_position"]
    gap = np.abs(local.values - study["critical_position"].values)
    gap = np.minimum(gap, problem.interface.length - gap)
    result: NDArray[np.bool_] = gap > 0.5 * problem.nucleation_length
    return result

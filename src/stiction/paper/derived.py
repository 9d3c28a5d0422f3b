"""Numbers that several figures and claims derive from the studies."""

from __future__ import annotations

from stiction.paper.data import Data
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

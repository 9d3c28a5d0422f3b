"""Random properties of a problem as stresses: friction coefficients times the normal pressure."""

from collections.abc import Mapping
from functools import reduce
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.problem import Problem
from stiction.random.random_interface import RandomInterface

WORTH_SAYING = 1e-6
MOST = 0.5
QUANTILES, PRESSURES = 2000, 64
"""Equally likely values that stand for a random residual strength and a normal pressure."""


def coefficients_of(random: RandomInterface) -> list[str]:
    """Return the names of the properties that are given as coefficients."""
    return [name for name, field in random.properties.items() if field.of is not None]


def check_pressure(problem: Problem, random: RandomInterface) -> None:
    """Raise an `InputError` if coefficients are given without a normal pressure."""
    names = coefficients_of(random)
    if names and problem.load.normal_pressure is None and "normal_pressure" not in random.names:
        raise InputError(
            f"{names[0]}: is given as friction coefficients, which need a normal pressure"
            " (load.normal_pressure, Pa)"
        )


def profiles_in_stress(
    problem: Problem, random: RandomInterface, profiles: Mapping[str, Array]
) -> dict[str, Array]:
    """Return sampled profiles with coefficients multiplied by the pressure at each node."""
    found = dict(profiles)
    for name in coefficients_of(random):
        pressure = profiles.get("normal_pressure", problem.load.normal_pressure)
        found[name] = found[name] * pressure
    return found


def range_of_product(one: tuple[Any, Any], other: tuple[Any, Any]) -> tuple[float, float]:
    """Return the bounds of a product of two numbers in these ranges, which may be infinite."""
    ends = [0.0 if a == 0.0 or b == 0.0 else float(a * b) for a in one for b in other]
    return min(ends), max(ends)


def support_in_stress(
    problem: Problem, random: RandomInterface, name: str
) -> tuple[float, float]:
    """Return the values between which a property lies, Pa, with its factor between specimens."""
    factor = (random.between or {}).get(name)
    marginals = [random.properties[name].marginal, *([factor] if factor else [])]
    ends = [marginal.distribution.support() for marginal in marginals]
    if random.properties[name].of is not None and "normal_pressure" in random.names:
        ends.append(support_in_stress(problem, random, "normal_pressure"))
    elif random.properties[name].of is not None:
        ends.append(
            (np.min(problem.load.normal_pressure), np.max(problem.load.normal_pressure))
        )
    return reduce(range_of_product, ends, (1.0, 1.0))


def _equally_likely(distribution: Any, count: int) -> Array:
    found: Array = distribution.ppf((np.arange(count) + 0.5) / count)
    return found


def _pressures(problem: Problem, random: RandomInterface) -> Array:
    """Pressures that a point may have, equally likely."""
    if "normal_pressure" in random.names:
        field = random.properties["normal_pressure"]
        return _equally_likely(field.marginal.distribution, PRESSURES)
    flat = np.sort(np.ravel(problem.load.normal_pressure))
    return flat[np.linspace(0, flat.size - 1, min(flat.size, PRESSURES)).round().astype(int)]


def mean_in_stress(problem: Problem, random: RandomInterface, name: str) -> float:
    """Return the mean of a property, Pa."""
    field = random.properties[name]
    return field.mean * (1.0 if field.of is None else float(_pressures(problem, random).mean()))


def share_below_residual(problem: Problem, random: RandomInterface) -> float:
    """Return the probability that the strength at a point is not above the residual strength.

    Properties are taken as independent.
    """
    fields, between = random.properties, random.between or {}
    residual, coefficients = np.asarray(problem.friction.residual_strength), False
    if "residual_strength" in fields:
        field = fields["residual_strength"]
        coefficients = field.of is not None
        residual = _equally_likely(field.marginal.distribution, QUANTILES)
    factors = {
        name: _equally_likely(between[name].distribution, PRESSURES)
        for name in ("residual_strength", "strength")
        if name in between
    }
    if "residual_strength" in factors:
        residual = np.outer(residual, factors["residual_strength"])
    if coefficients and fields["strength"].of is None:
        residual = np.outer(residual, _pressures(problem, random))
    elif fields["strength"].of is not None and not coefficients:
        residual = np.outer(residual, 1.0 / _pressures(problem, random))
    if "strength" in factors:
        residual = np.outer(residual, 1.0 / factors["strength"])
    return float(np.mean(fields["strength"].marginal.distribution.cdf(residual)))


def check_residual(problem: Problem, random: RandomInterface) -> None:
    """Warn of the share of the strength that does not exceed the residual strength.

    A node whose strength does not exceed its residual strength does not weaken. A few of
    those can be meant: an `AccuracyWarning` gives a share above one in a million. If they
    are the rule, above a half, the interface does not weaken at all: an `InputError`.
    """
    share = share_below_residual(problem, random)
    if share <= WORTH_SAYING:
        return
    low, high = support_in_stress(problem, random, "strength")
    said = (
        f"strength: {100.0 * share:.3g} % of its marginal, which reaches from {low:g} to"
        f" {high:g} Pa, lies at or below the residual strength"
    )
    if share > MOST:
        raise InputError(
            f"{said}: most of the interface would not weaken at all. Raise the strength, lower the"
            " residual strength, or check the unit of both (Pa)"
        )
    warn_accuracy(
        f"{said}; there the interface does not weaken. If this is not intended, lower the"
        " residual strength or choose a marginal that stays above it"
    )

"""What is random on a problem, as stresses: friction coefficients times the normal pressure."""

from collections.abc import Mapping

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.problem import Problem
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface, range_of_product

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


def _equally_likely(count: int) -> Array:
    return (np.arange(count) + 0.5) / count


def _quantiles(field: RandomField, count: int) -> Array:
    """Values of a field at a point, equally likely."""
    found: Array = field.marginal.distribution.ppf(_equally_likely(count))
    return found


def _pressures(problem: Problem, fields: Mapping[str, RandomField]) -> Array:
    """Pressures that a point may have, equally likely."""
    if "normal_pressure" in fields:
        return _quantiles(fields["normal_pressure"], PRESSURES)
    flat = np.sort(np.ravel(problem.load.normal_pressure))
    return flat[np.linspace(0, flat.size - 1, min(flat.size, PRESSURES)).round().astype(int)]


def support_in_stress(
    problem: Problem, random: RandomInterface, name: str
) -> tuple[float, float]:
    """Return the values between which a property lies, Pa."""
    low, high = random.support(name)
    if random.properties[name].of is None:
        return low, high
    ends = problem.load.normal_pressure
    if "normal_pressure" in random.names:
        ends = random.support("normal_pressure")
    return range_of_product((low, high), (float(np.min(ends)), float(np.max(ends))))


def mean_in_stress(problem: Problem, fields: Mapping[str, RandomField], name: str) -> float:
    """Return the mean of a property, Pa."""
    field = fields[name]
    return field.mean * (1.0 if field.of is None else float(_pressures(problem, fields).mean()))


def share_below_residual(problem: Problem, random: RandomInterface) -> float:
    """Return the probability that the strength at a point is not above the residual strength.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface
        Its properties are taken as independent.
    """
    fields = random.properties
    residual = np.asarray(problem.friction.residual_strength)
    if "residual_strength" in fields:
        residual = _quantiles(fields["residual_strength"], QUANTILES)
    strength = fields["strength"]
    if strength.of is not None:
        residual = np.ravel(residual)[:, None] / _pressures(problem, fields)
    factor = (random.between or {}).get("strength")
    if factor is not None:
        residual = np.ravel(residual)[:, None] / factor.distribution.ppf(
            _equally_likely(PRESSURES)
        )
    return float(np.mean(strength.marginal.distribution.cdf(residual)))


def check_residual(problem: Problem, random: RandomInterface) -> None:
    """Warn of the share of the strength that does not exceed the residual strength.

    A node whose strength does not exceed its residual strength does not weaken. A few of
    those can be meant: an `AccuracyWarning` gives a share above one in a million. If they
    are the rule, above a half, the interface does not weaken at all: an `InputError`.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface
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
        f"{said}; there the interface does not weaken. If that is not meant, lower the residual"
        " strength or choose a marginal that stays above it"
    )

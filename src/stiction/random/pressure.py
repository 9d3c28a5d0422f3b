"""Strength given as friction coefficients: stresses are these times the normal pressure there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.problem import Problem
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface

QUANTILES = 64


def coefficients_of(random: RandomInterface) -> list[str]:
    """Return the names of the properties that are given as coefficients."""
    return [name for name, field in random.properties.items() if field.of is not None]


def check_pressure(problem: Problem, random: RandomInterface) -> None:
    """Refuse coefficients without a normal pressure.

    Raises
    ------
    InputError
    """
    names = coefficients_of(random)
    given = problem.load.normal_pressure is not None or "normal_pressure" in random.names
    if names and not given:
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
        found[name] = np.asarray(profiles[name]) * np.asarray(pressure)
    return found


def pressures(problem: Problem, fields: Mapping[str, RandomField]) -> Array:
    """Return pressures that a point may have, equally likely, for what needs no sampling."""
    if "normal_pressure" in fields:
        middles = (np.arange(QUANTILES) + 0.5) / QUANTILES
        found: Array = fields["normal_pressure"].marginal.distribution.ppf(middles)
        return found
    flat = np.sort(np.ravel(problem.load.normal_pressure))
    return flat[np.linspace(0, flat.size - 1, min(flat.size, QUANTILES)).round().astype(int)]


def support_in_stress(
    problem: Problem, fields: Mapping[str, RandomField], name: str
) -> tuple[float, float]:
    """Return the values between which a property lies, Pa."""
    field = fields[name]
    low, high = (float(end) for end in field.marginal.distribution.support())
    if field.of is None:
        return low, high
    if "normal_pressure" in fields:
        ends = [float(p) for p in fields["normal_pressure"].marginal.distribution.support()]
    else:
        given = np.asarray(problem.load.normal_pressure)
        ends = [float(given.min()), float(given.max())]
    corners = [0.0 if a == 0.0 or b == 0.0 else a * b for a in (low, high) for b in ends]
    return min(corners), max(corners)


def mean_in_stress(problem: Problem, fields: Mapping[str, RandomField], name: str) -> float:
    """Return the mean of a property, Pa."""
    field = fields[name]
    factor = 1.0 if field.of is None else float(pressures(problem, fields).mean())
    return field.mean * factor

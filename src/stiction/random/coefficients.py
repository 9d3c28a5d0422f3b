"""Strength given as friction coefficients: stresses are these times the normal pressure there."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.problem import Problem
from stiction.random.marginals import PythonMarginal, ScipyMarginal
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface

QUANTILES = 64


def scaled_marginal(marginal: Any, factor: float) -> Any:
    """The marginal of a quantity times a positive number."""
    if isinstance(marginal, PythonMarginal):
        frozen = marginal.distribution
        shapes, loc, scale = frozen.dist._parse_args(*frozen.args, **frozen.kwds)
        return PythonMarginal(frozen.dist(*shapes, loc=loc * factor, scale=scale * factor))
    if isinstance(marginal, ScipyMarginal):
        own = {"loc": 0.0, "scale": 1.0} | dict(marginal.parameters)
        own |= {name: own[name] * factor for name in ("loc", "scale")}
        return ScipyMarginal(marginal.type, tuple(own.items()))
    places = {
        field.name: getattr(marginal, field.name) * factor
        for field in dataclasses.fields(marginal)
        if field.name in ("mean", "low", "high") and getattr(marginal, field.name) is not None
    }
    return dataclasses.replace(marginal, **places)


def in_stress(problem: Problem, random: RandomInterface) -> RandomInterface:
    """The same with coefficients turned into stresses, where one number does that.

    Where the pressure varies along the interface or is random, they are multiplied sample by
    sample; see `profiles_in_stress`.

    Raises
    ------
    InputError
        If there is a coefficient and no pressure.
    """
    names = coefficients_of(random)
    if not names:
        return random
    pressure = problem.load.normal_pressure
    if pressure is None and "normal_pressure" not in random.names:
        raise InputError(
            f"{names[0]}: is given as friction coefficients, which need a normal pressure"
            " (load.normal_pressure, Pa)"
        )
    if "normal_pressure" in random.names or np.ndim(pressure) > 0:
        return random
    scaled: dict[str, Any] = {}
    for name in names:
        field = random.properties[name]
        marginal = scaled_marginal(field.marginal, float(pressure))
        scaled[name] = dataclasses.replace(field, marginal=marginal, of=None)
    return dataclasses.replace(random, **scaled)


def coefficients_of(random: RandomInterface) -> list[str]:
    """Names of the properties that are given as coefficients."""
    return [name for name, field in random.properties.items() if field.of is not None]


def profiles_in_stress(
    problem: Problem, random: RandomInterface, profiles: Mapping[str, Array]
) -> dict[str, Array]:
    """Sampled profiles with coefficients multiplied by the pressure at each node."""
    found = dict(profiles)
    for name in coefficients_of(random):
        pressure = profiles.get("normal_pressure", problem.load.normal_pressure)
        found[name] = np.asarray(profiles[name]) * np.asarray(pressure)
    return found


def pressures(problem: Problem, fields: Mapping[str, RandomField]) -> Array:
    """Pressures that a point may have, equally likely, for what needs no sampling."""
    if "normal_pressure" in fields:
        middles = (np.arange(QUANTILES) + 0.5) / QUANTILES
        found: Array = fields["normal_pressure"].marginal.distribution.ppf(middles)
        return found
    flat = np.sort(np.ravel(problem.load.normal_pressure))
    return flat[np.linspace(0, flat.size - 1, min(flat.size, QUANTILES)).round().astype(int)]


def support_in_stress(
    problem: Problem, fields: Mapping[str, RandomField], name: str
) -> tuple[float, float]:
    """Between which values a property lies, Pa."""
    field = fields[name]
    low, high = (float(end) for end in field.marginal.distribution.support())
    if field.of is None:
        return low, high
    if "normal_pressure" in fields:
        ends = [float(p) for p in fields["normal_pressure"].marginal.distribution.support()]
    else:
        given = np.asarray(problem.load.normal_pressure)
        ends = [float(given.min()), float(given.max())]
    corners = [_product(a, b) for a in (low, high) for b in ends]
    return min(corners), max(corners)


def _product(a: float, b: float) -> float:
    return 0.0 if a == 0.0 or b == 0.0 else a * b


def mean_in_stress(problem: Problem, fields: Mapping[str, RandomField], name: str) -> float:
    """Mean of a property, Pa."""
    field = fields[name]
    factor = 1.0 if field.of is None else float(pressures(problem, fields).mean())
    return field.mean * factor

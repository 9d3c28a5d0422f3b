"""Random properties as stresses. Friction coefficients are multiplied by the pressure."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy
from stiction.problem.problem import Problem
from stiction.problem.sample import constants_of, pressing_of
from stiction.problem.specimen import UNFIT_FOR_SLIDER, Slider
from stiction.random.fields import FACTOR, RandomInterface

MAX_SHARE = 0.5
"""Largest fraction of nodes that do not weaken."""


def coefficients_of(random: RandomInterface) -> list[str]:
    """Return the properties that are given as coefficients, by name."""
    return [name for name, field in random.properties.items() if field.quantity is not None]


def check_pressure(problem: Problem, random: RandomInterface) -> None:
    """Raise an `InputError` if coefficients lack a pressure, or a factor lacks its property."""
    names, constants = coefficients_of(random), constants_of(problem, np.ones(()))
    forces = {"pressing_force": problem.load.pressing_force}
    for name in random.between or {}:
        value = (constants | forces).get(name)
        if name not in random.names and (value is None or not np.any(value)):
            raise InputError(
                f"between.{name}: multiplies {name}, but the problem has no {name}. Give {name} in"
                " the problem, make it random, or leave this factor out"
            )
    for name in sorted({*random.names} & {*UNFIT_FOR_SLIDER} - {*names}):
        if isinstance(problem.specimen, Slider):
            raise InputError(f"random.{name}: {UNFIT_FOR_SLIDER[name]}")
    if names and problem.given_pressure is None and "normal_pressure" not in random.names:
        raise InputError(
            f"{names[0]}: is given as friction coefficients, which need a normal pressure"
            " (load.normal_pressure, Pa, or load.pressing_force, N)"
        )


def profiles_in_stress(
    problem: Problem, random: RandomInterface, profiles: Mapping[str, Array]
) -> dict[str, Array]:
    """Return sampled profiles with coefficients multiplied by the pressure at each node.

    A sampled pressure is multiplied by the pressure profile between
    glued blocks. Constants in the problem are multiplied by their
    factors between specimens.
    """
    stresses = {name: rows for name, rows in profiles.items() if not name.startswith(FACTOR)}
    factors = {name: rows for name, rows in profiles.items() if name.startswith(FACTOR)}
    # A pressure is random itself, or the pressure of the problem times
    # a random factor.
    pressure = problem.normal_pressure
    if "normal_pressure" in stresses:
        pressure = stresses["normal_pressure"] = stresses["normal_pressure"] * pressing_of(
            problem
        )
    elif FACTOR + "normal_pressure" in factors:
        pressure = factors[FACTOR + "normal_pressure"] * pressure
    stresses |= {name: stresses[name] * pressure for name in coefficients_of(random)}
    constants = constants_of(problem, stresses["strength"]) if factors else {}
    for key, factor in factors.items():
        name = key.removeprefix(FACTOR)
        stresses[name] = factor * constants[name]
    return stresses


def support_in_stress(
    problem: Problem, random: RandomInterface, name: str, chance: float = 0.0
) -> tuple[float, float]:
    """Return the lower and upper bound of a property, Pa, including its factor between specimens.

    If `chance` is positive, the bounds are quantiles: each random part
    lies beyond them with this probability on either side.
    """
    field, between = random.properties.get(name), random.between or {}

    def extremes(marginal: Any) -> Any:
        law = marginal.distribution
        return (law.ppf(chance), law.isf(chance)) if chance else law.support()

    if field is None:
        value = constants_of(problem, 0.0)[name]
        low, high = np.min(value), np.max(value)
    else:
        low, high = extremes(field.marginal)
    pressed = ("normal_pressure", "pressing_force") if name == "normal_pressure" else (name,)
    # Rounding may put the lower end of a factor just below zero.
    factors = [np.maximum(extremes(between[key]), 0.0) for key in pressed if key in between]
    if field is not None and name == "normal_pressure":
        factors.append((np.min(pressing_of(problem)), np.max(pressing_of(problem))))
    if field is not None and field.quantity is not None:
        factors.append(support_in_stress(problem, random, "normal_pressure", chance))
    for factor in factors:  # factors are positive, and 0 times infinity counts as 0
        ends = [a * b if a and b else 0.0 for a in (low, high) for b in factor]
        low, high = min(ends), max(ends)
    return float(low), float(high)


def mean_in_stress(problem: Problem, random: RandomInterface, name: str) -> float:
    """Return the mean of a property, Pa. Factors between specimens have mean 1."""
    field, pressure = random.properties[name], problem.normal_pressure
    if field.quantity is None:
        return field.mean
    if "normal_pressure" in random.properties:
        pressure = random.properties["normal_pressure"].mean * pressing_of(problem)
    return field.mean * float(np.mean(pressure))


def check_residual(problem: Problem, profiles: Mapping[str, Array]) -> None:
    """Warn if sampled strengths (Pa) do not exceed the residual strength at some nodes.

    These nodes do not weaken. If they are more than half of all nodes,
    an `InputError` is raised.
    """
    strength = profiles["strength"]
    residual = profiles.get("residual_strength", problem.friction.residual(strength))
    share = float(np.mean(strength <= residual))
    text = (
        f"strength: {100.0 * share:.3g} % of the nodes lie at or below the residual strength"
        f" (samples: {len(strength)})"
    )
    if share > MAX_SHARE:
        raise InputError(
            f"{text}: most of the interface would not weaken at all. Raise the strength, lower"
            " the residual strength, or check the unit of both (Pa)"
        )
    if share:
        warn_accuracy(f"{text} and do not weaken. If they should, lower the residual strength")

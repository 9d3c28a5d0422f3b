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
    """Return the properties that are given as coefficients, by name.

    >>> from types import SimpleNamespace as Named
    >>> fields = {
    ...     "strength": Named(quantity="friction_coefficient"),
    ...     "initial_stress": Named(quantity=None),
    ... }
    >>> coefficients_of(Named(properties=fields))
    ['strength']
    """
    return [name for name, field in random.properties.items() if field.quantity is not None]


def check_pressure(problem: Problem, random: RandomInterface) -> None:
    """Raise an `InputError` if coefficients lack a pressure, or a factor lacks its property.

    >>> import stiction as st
    >>> spectrum, factor = st.PowerLawSpectrum(0.05), st.Lognormal(mean=1.0, cv=0.1)
    >>> stress = st.RandomField(st.Lognormal(mean=2e6, cv=0.2), spectrum)
    >>> solid, friction = st.Solid(2e9, 0.2, 1200.0), st.LinearWeakening(weakening_rate=5e10)
    >>> line, load = st.Interface(0.1, 8), st.Load(normal_pressure=2e6)
    >>> problem, bare = (
    ...     st.Problem(solid, line, friction, load),
    ...     st.Problem(solid, line, friction),
    ... )
    >>> def refusals(problem, *between, **fields):
    ...     factors = dict.fromkeys(between, factor)
    ...     try:
    ...         check_pressure(
    ...             problem, st.RandomInterface(strength=stress, between=factors, **fields)
    ...         )
    ...     except InputError as error:
    ...         return str(error)[:54]
    >>> refusals(problem, "strength", "normal_pressure", "weakening_rate")
    >>> refusals(bare, "normal_pressure", normal_pressure=stress)
    >>> refusals(bare, "strength", "normal_pressure")
    'between.normal_pressure: multiplies normal_pressure, b'
    >>> [refusals(problem, name)[8:35] for name in ("pressing_force", "initial_stress")]
    ['pressing_force: multiplies ', 'initial_stress: multiplies ']
    >>> line, load = st.Interface(0.1, 8, width=0.01), st.Load(pressing_force=2e3)
    >>> refusals(st.Problem(solid, line, friction, load), "pressing_force")
    >>> marginal = st.Lognormal(mean=0.6, cv=0.2)
    >>> coefficient = st.RandomField(marginal, spectrum, quantity="friction_coefficient")
    >>> refusals(bare, residual_strength=coefficient)
    'residual_strength: is given as friction coefficients, '
    >>> refusals(bare, residual_strength=coefficient, normal_pressure=stress)
    >>> refusals(problem, residual_strength=coefficient)
    """
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

    The strength is a coefficient, and the pressure 2 MPa has a factor. A
    constant, such as the initial stress 0.5 MPa, is multiplied by its own
    factor.

    >>> import stiction as st
    >>> marginal, spectrum = st.Lognormal(mean=0.6, cv=0.2), st.PowerLawSpectrum(0.05)
    >>> field = st.RandomField(marginal, spectrum, quantity="friction_coefficient")
    >>> random = st.RandomInterface(strength=field)
    >>> load = st.Load(normal_pressure=2e6, initial_stress=0.5e6)
    >>> friction = st.LinearWeakening(weakening_rate=5e10)
    >>> problem = st.Problem(st.Solid(2e9, 0.2, 1200.0), st.Interface(0.1, 8), friction, load)
    >>> coefficients = np.array([[0.5] * 8, [0.75] * 8])
    >>> factors = np.array([[1.5] * 8, [0.5] * 8])
    >>> def first_nodes(**profiles):
    ...     profiles = {name.replace("__", "."): rows for name, rows in profiles.items()}
    ...     rows = profiles_in_stress(problem, random, {"strength": coefficients, **profiles})
    ...     return {name: rows[name][:, 0].tolist() for name in sorted(rows)}
    >>> first_nodes()
    {'strength': [1000000.0, 1500000.0]}
    >>> first_nodes(normal_pressure=1e6 * factors)
    {'normal_pressure': [1500000.0, 500000.0], 'strength': [750000.0, 375000.0]}
    >>> first_nodes(between__normal_pressure=factors)
    {'normal_pressure': [3000000.0, 1000000.0], 'strength': [1500000.0, 750000.0]}
    >>> first_nodes(between__initial_stress=factors)
    {'initial_stress': [750000.0, 250000.0], 'strength': [1000000.0, 1500000.0]}
    >>> from types import SimpleNamespace as Named
    >>> blocks = Named(pressure=np.array([0.5, 1.5] * 4))
    >>> problem = Named(specimen=Named(pressing="glued"), blocks=blocks, normal_pressure=None)
    >>> first_nodes(normal_pressure=1e6 * factors)  # half of it, between glued blocks
    {'normal_pressure': [750000.0, 250000.0], 'strength': [375000.0, 187500.0]}
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

    Coefficients from 0.2 to 0.7 have a factor from 0.5 to 1.5, and the
    pressure 2 MPa has a factor from 0.75 to 1.25.

    >>> import stiction as st
    >>> def between(low, high):
    ...     return st.Beta(alpha=1.0, beta=1.0, low=low, high=high)
    >>> spectrum = st.PowerLawSpectrum(0.05)
    >>> field = st.RandomField(between(0.2, 0.7), spectrum, quantity="friction_coefficient")
    >>> factors = {"strength": between(0.5, 1.5), "pressing_force": between(0.75, 1.25)}
    >>> stress = st.RandomField(between(-1e6, 0.5e6), spectrum)
    >>> random = st.RandomInterface(strength=field, initial_stress=stress, between=factors)
    >>> solid, friction = st.Solid(2e9, 0.2, 1200.0), st.LinearWeakening(weakening_rate=5e10)
    >>> load = st.Load(normal_pressure=2e6, initial_stress=np.linspace(1e5, 8e5, 8))
    >>> problem = st.Problem(solid, st.Interface(0.1, 8), friction, load)
    >>> support_in_stress(problem, random, "normal_pressure")
    (1500000.0, 2500000.0)
    >>> low, high = support_in_stress(problem, random, "strength")
    >>> round(low), round(high)  # 0.2 * 0.5 * 1.5 MPa, and 0.7 * 1.5 * 2.5 MPa
    (150000, 2625000)
    >>> support_in_stress(problem, random, "initial_stress")
    (-1000000.0, 500000.0)
    >>> [round(end) for end in support_in_stress(problem, random, "initial_stress", 0.1)]
    [-850000, 350000]
    >>> low, high = support_in_stress(problem, random, "strength", 0.1)
    >>> round(low), round(high)  # 0.25 * 0.6 * 1.6 MPa, and 0.65 * 1.4 * 2.4 MPa
    (240000, 2184000)

    A random pressure has its own support, times the profile between glued
    blocks. A factor from just below zero counts as zero.

    >>> pressure = st.RandomField(between(1e6, 3e6), spectrum)
    >>> random = st.RandomInterface(
    ...     strength=field,
    ...     initial_stress=stress,
    ...     normal_pressure=pressure,
    ...     between={"initial_stress": between(-1e-13, 2.0)},
    ... )
    >>> support_in_stress(problem, random, "normal_pressure")
    (1000000.0, 3000000.0)
    >>> [round(end) for end in support_in_stress(problem, random, "initial_stress")]
    [-2000000, 1000000]
    >>> unbounded = st.RandomField(st.Lognormal(mean=0.6, cv=0.2), spectrum)
    >>> random = st.RandomInterface(strength=unbounded, between={"strength": between(0.0, 2.0)})
    >>> support_in_stress(problem, random, "strength")
    (0.0, inf)
    >>> support_in_stress(
    ...     problem, random, "initial_stress"
    ... )  # the smallest and largest of the load
    (100000.0, 800000.0)
    >>> from types import SimpleNamespace as Named
    >>> blocks = Named(pressure=np.array([0.9, 0.5, 1.5, 1.1]))
    >>> glued = Named(specimen=Named(pressing="glued"), blocks=blocks)
    >>> random = st.RandomInterface(strength=field, normal_pressure=pressure)
    >>> support_in_stress(glued, random, "normal_pressure")
    (500000.0, 4500000.0)

    Zero times infinity counts as zero:

    >>> import scipy.stats
    >>> unbounded = st.RandomField(scipy.stats.norm(1e6, 1e5), spectrum)
    >>> random = st.RandomInterface(strength=unbounded, between={"strength": between(0.0, 2.0)})
    >>> support_in_stress(problem, random, "strength")
    (-inf, inf)
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
    """Return the mean of a property, Pa. Factors between specimens have mean 1.

    >>> import stiction as st
    >>> spectrum = st.PowerLawSpectrum(0.05)
    >>> marginal = st.Lognormal(mean=0.6, cv=0.2)
    >>> field = st.RandomField(marginal, spectrum, quantity="friction_coefficient")
    >>> pressure = st.RandomField(st.Lognormal(mean=3e6, cv=0.1), spectrum)
    >>> from types import SimpleNamespace as Named
    >>> specimen, blocks = Named(pressing="glued"), Named(pressure=np.array([0.5, 0.75, 1.0]))
    >>> problem = Named(normal_pressure=2e6, specimen=specimen, blocks=blocks)
    >>> random = st.RandomInterface(strength=field)
    >>> round(mean_in_stress(problem, random, "strength"))
    1200000
    >>> random = st.RandomInterface(strength=field, normal_pressure=pressure)
    >>> round(mean_in_stress(problem, random, "strength"))  # 0.6 * 3 MPa * 0.75
    1350000
    >>> round(mean_in_stress(problem, random, "normal_pressure"))
    3000000
    """
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

    >>> from types import SimpleNamespace as Named
    >>> from stiction.base.errors import collect_warnings
    >>> problem = Named(friction=Named(residual=lambda strength: 0.25 * strength.max()))
    >>> strength, residual = np.array([[4.0, 2.0, 3.0, 8.0]]), np.array([[3.0, 2.0, 2.0, 2.0]])
    >>> def warned(**profiles):
    ...     with collect_warnings() as texts:
    ...         check_residual(problem, profiles)
    ...     return [str(text)[:79] for text in texts]
    >>> warned(strength=strength, residual_strength=residual)  # the second node
    ['strength: 25 % of the nodes lie at or below the residual strength (samples: 1) ']
    >>> warned(strength=strength), warned(strength=strength + 0.5, residual_strength=residual)
    (['strength: 25 % of the nodes lie at or below the residual strength (samples: 1) '], [])
    >>> len(
    ...     warned(strength=strength, residual_strength=residual + [1.0, 0.0, 0.0, 0.0])
    ... )  # half
    1
    >>> warned(
    ...     strength=strength, residual_strength=residual + [1.0, 0.0, 1.0, 0.0]
    ... )  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: strength: 75 % of the nodes lie at or below ... (Pa)
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

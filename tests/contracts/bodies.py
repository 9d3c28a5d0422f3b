"""A crooked world on every kind of body, and the same world in other units or moved."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np

import stiction as st
from stiction.base.variables import UNITS, unit_of_key
from stiction.random.dotted_keys import with_values

SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.31, density=1170.0)
FIELD = st.RandomField(
    st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6), st.PowerLawSpectrum(4e-3)
)
COEFFICIENTS = st.RandomField(
    st.Beta(alpha=1.5, beta=3.0, low=0.45, high=0.95),
    st.PowerLawSpectrum(9e-3),
    quantity="friction_coefficient",
)
PLATEN, PUSHER = st.Platen(stiffness=3e7), st.Pusher(height=0.006, width=0.004, stiffness=6e7)


def body(nodes: Any, length: Any, drive: Any = None, **ends: Any) -> st.Problem:
    """A problem whose load, initial stress and residual strength vary; its area is known."""
    specimen = drive and st.Blocks(height=0.021, thickness=0.0071, drive=drive)
    width = None if specimen or np.ndim(nodes) else 0.0113
    interface = st.Interface(length, nodes, width=width, **ends)
    x = np.meshgrid(*interface.coordinates.values(), indexing="ij")[0] / interface.lengths[0]
    load = st.Load(
        profile=1.0 if specimen else 1.1 + 0.2 * np.sin(2.0 * np.pi * x + 0.4),
        initial_stress=5e4 * (0.4 + np.cos(2.0 * np.pi * x - 0.7)),
        normal_pressure=2.1e6,
    )
    friction = st.LinearWeakening(weakening_rate=0.3e12, residual_strength=0.3e6 + 5e4 * x)
    return st.Problem(SOLID, interface, friction, load, specimen=specimen)


def rig(nodes: int, length: float) -> st.Problem:
    """A slider that is pushed low on its side, on a longer base of another material."""
    base = st.Base(
        height=0.03, behind=0.02, ahead=0.05,
        solid=st.Solid(shear_modulus=0.7e9, poisson_ratio=0.35, density=1200.0),
    )  # fmt: skip
    slider = st.Slider(height=0.041, thickness=0.0071, base=base, drive=PUSHER, tilt=0.2)
    x = (np.arange(nodes) + 0.5) / nodes
    friction = st.LinearWeakening(weakening_rate=0.1e12, residual_ratio=0.25 + 0.05 * x)
    load = st.Load(pressing_force=1.1e3)
    return st.Problem(SOLID, st.Interface(length, nodes), friction, load, specimen=slider)


PATCH = st.Ellipse(centre=(0.011, 0.008), semi_axes=(0.0105, 0.0077))
BODIES = {
    "line": body(64, 0.037),
    "line with ends": body(64, 0.037, extent=(0.006, 0.029)),
    "plane": body((24, 20), (0.023, 0.0164)),
    "plane with ends": body((24, 20), (0.023, 0.0164), extent=PATCH),
    "blocks": body(64, 0.073, PUSHER),
    "blocks with an extent": body(64, 0.073, PLATEN, extent=(0.009, 0.061)),
    "slider": rig(40, 0.073),
}
WITH_ENDS = ("line with ends", "plane with ends", "blocks with an extent", "slider")
"""One of each kind: for laws that do not ask whether an interface has ends."""
METHODS_OF = {
    "local_criterion": lambda problem: st.LocalCriterion(),
    "equilibrium": lambda problem: st.Equilibrium(),
    "rupture": lambda problem: st.Rupture(loading_rate=None if problem.specimen else 1e9),
}


def field_of(problem: st.Problem) -> st.RandomField:
    """The random strength of a body: of a slider, as friction coefficients."""
    return COEFFICIENTS if isinstance(problem.specimen, st.Slider) else FIELD


def profiles_of(problem: st.Problem, rows: Any) -> Any:
    """Strengths as profiles that a call accepts."""
    given = isinstance(problem.specimen, st.Slider)
    return {"friction_coefficient": rows} if given else rows


class World:
    """A study of a body, three samples of it, and the units in which both are written."""

    def __init__(self, plain: dict[str, Any], strength: Any, units: Any = None) -> None:
        self.plain, self.study = plain, st.Study.from_dict(plain)
        self.strength, self.units = strength, units or {"Pa": 1.0, "m": 1.0, "s": 1.0}
        self.problem, self.random = self.study.problem, self.study.random
        self.method, self.interface = self.study.method, self.problem.interface
        self.Pa = self.units["Pa"]
        self.coefficients = self.random.strength.quantity == "friction_coefficient"

    def profiles(self, rows: Any = slice(None)) -> Any:
        """Some of the samples, as profiles that a call accepts."""
        rows = self.strength[rows]
        return {"friction_coefficient": rows} if self.coefficients else rows

    def factor(self, unit: str) -> float:
        """How often a new unit goes into the old one: of 'N m-1', 'J/m', 'kg m-3'."""
        base = self.units
        known = base | {"N": base["Pa"] * base["m"] ** 2, "J": base["Pa"] * base["m"] ** 3}
        known["Hz"] = 1.0 / base["s"]
        known["kg"] = base["Pa"] * base["m"] * base["s"] ** 2
        value = 1.0
        for sign, names in zip((1, -1), [*unit.split("/"), ""], strict=False):
            for name, power in re.findall(r"([A-Za-z]+)(-?\d*)", names):
                value *= known[name] ** (sign * int(power or 1))
        return value

    def in_units(self, **units: float) -> World:
        """The same world with stresses, lengths and times in other units."""
        new = World.__new__(World)
        new.units = {"Pa": 1.0, "m": 1.0, "s": 1.0} | units
        strength = self.strength * (1.0 if self.coefficients else units["Pa"])
        unit = "1" if self.coefficients else "Pa"
        plain = _rewritten(self.plain, new.factor, of_stress=unit)
        return World(plain, strength, new.units)

    def moved(self, move: Callable[[Any], Any], words: Any = MappingProxyType({})) -> World:
        """The same world with the profiles at its nodes moved and some words replaced."""
        plain = _at_nodes(self.plain, self.interface.shape, move, words)
        return World(plain, np.array([move(row) for row in self.strength]))


PLACES = {"extent": "m", "centre": "m", "semi_axes": "m", "nodes": "1", "profile": "1"}
PLACES |= {"behind": "m", "ahead": "m", "pressing_force": "N", "tilt": "1"}
STRESSES = {"initial_stress", "normal_pressure", "residual_strength"}


def _rewritten(
    value: Any, factor: Callable[[str], float], key: str = "", *, of_stress: str = "Pa"
) -> Any:
    if isinstance(value, dict):
        return {
            name: _rewritten(inner, factor, name, of_stress=of_stress)
            for name, inner in value.items()
        }
    if isinstance(value, list):
        return [_rewritten(inner, factor, key, of_stress=of_stress) for inner in value]
    if isinstance(value, float):
        known = PLACES | dict.fromkeys(STRESSES, "Pa") | UNITS
        return value * factor(known.get(key) or unit_of_key(key, of_stress))
    return value


def _at_nodes(value: Any, shape: Any, move: Callable[[Any], Any], words: Any) -> Any:
    if isinstance(value, dict):
        return {name: _at_nodes(inner, shape, move, words) for name, inner in value.items()}
    if isinstance(value, str):
        return words.get(value, value)
    whole = isinstance(value, list) and np.shape(np.asarray(value, dtype=object)) == shape
    return move(np.array(value)).tolist() if whole else value


@cache
def world(name: str, method: str = "equilibrium") -> World:
    """A body, a method and three samples."""
    problem = BODIES[name]
    field = field_of(problem)
    study = st.Study(
        problem=problem, random=field, method=METHODS_OF[method](problem), samples=3, seed=2
    )
    return World(study.to_dict(), field.sample(problem.interface, samples=3, seed=2))


def with_values_of(study: st.Study, values: dict[str, Any]) -> st.Study:
    """The study with other values by dotted key."""
    names = ("problem", "random", "method", "seed")
    both = with_values({name: getattr(study, name) for name in names}, values)
    return dataclasses.replace(study, **{name: both[name] for name in names})


def attempt(call: Callable[[], Any]) -> tuple[Any, str]:
    """The result of a call, or None and the reason for its refusal."""
    try:
        return call(), ""
    except st.InputError as error:
        return None, str(error)

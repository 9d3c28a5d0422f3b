"""Values that no solid has: told from the numbers together, with the unit that was probably meant.

Every number may be right in itself; what betrays a unit is a speed, a ratio or a length that
follows from several of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import UnitWarning, warn_user

if TYPE_CHECKING:
    from stiction.problem import Problem
    from stiction.solid import Solid

FASTEST = 2e4
"""m/s; shear waves of diamond run at 1.2e4."""
SLOWEST = 0.3
"""m/s; shear waves of the softest gels run at 1."""
WEAKEST = 1e-8
"""Strength over shear modulus; steel (8e10 Pa) under 10 kPa at a coefficient of 0.1 has 1e-8."""
USUAL = 1e-3
"""Strength over shear modulus of polymers in the laboratory; of rock a tenth of that."""
TYPICAL = 1e6
"""Pa; shear strength of polymers in the laboratory, where surfaces are measured."""
SLIPPERIEST = 1e-4
"""Friction coefficient; structural superlubricity has 1e-4 or less."""
ROUGHEST = 50.0
"""Friction coefficient."""
ATOM = 1e-11
"""m; a critical slip below a tenth of an atom is none."""
MOST_NODES = 5e4
"""More are asked for by a wrong unit rather than by a large interface."""

# Powers of L/h_n = L W/(2 lambda_0 G*), with the units in which people have them, and the range
# in which the value has to lie after conversion to be believed.
_LENGTHS = {"mm": 1e-3, "um": 1e-6, "km": 1e3}
_STRESSES = {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
_RATES = {"kPa/m (or Pa/mm)": 1e3, "MPa/m (or Pa/um)": 1e6, "GPa/m (or MPa/mm)": 1e9, "TPa/m": 1e12}
_PARTS: dict[str, tuple[int, Mapping[str, float], tuple[float, float]]] = {
    "problem.interface.length": (1, _LENGTHS, (1e-4, 1e5)),
    "problem.solid.shear_modulus": (-1, _STRESSES, (1e3, 1e12)),
    "problem.friction.weakening_rate": (1, _RATES, (1e4, 1e16)),
    "problem.friction.critical_slip": (-1, _LENGTHS, (1e-9, 10.0)),
    "strength": (1, _STRESSES, (1e2, 1e10)),
}
_SANE = (1.0, 5e3)
"""L/h_n that a problem set up on purpose has."""


def suspects(problem: Problem, ratio: float, strength: float | None = None) -> str:
    """Which single value in another unit would bring L/h_n = `ratio` to where it usually is."""
    friction = problem.friction
    values = {
        "problem.interface.length": min(problem.interface.lengths),
        "problem.solid.shear_modulus": problem.solid.shear_modulus,
        "problem.friction.weakening_rate": friction.weakening_rate,
        "problem.friction.critical_slip": friction.critical_slip,
        "strength": strength if friction.weakening_rate is None else None,
    }
    found = []
    for name, value in values.items():
        if value is None:
            continue
        power, units, (low, high) = _PARTS[name]
        typical = float(np.median(value))
        for unit, factor in units.items():
            fits = _SANE[0] < ratio * factor**power < _SANE[1]
            if fits and low <= typical * factor <= high and 0.5 <= typical <= 1e7:
                si = "m" if units is _LENGTHS else "Pa/m" if units is _RATES else "Pa"
                found.append(f"{name.removeprefix('problem.')} = {typical:g} {si} in {unit}")
                break
    return " or ".join(found)


def warn_of_waves(solid: Solid) -> None:
    """Warn where waves run as in no solid."""
    speed = solid.shear_wave_speed
    if SLOWEST <= speed <= FASTEST:
        return
    guesses = []
    for unit, factor in _STRESSES.items():
        if 100.0 <= speed * factor**0.5 <= 1.3e4 and solid.density >= 10.0:
            guesses.append(f"shear_modulus = {solid.shear_modulus:g} in {unit}")
            break
    for unit, factor in {"g/cm3": 1e3, "t/mm3": 1e12}.items():
        if 10.0 <= solid.density * factor <= 3e4:
            guesses.append(f"density = {solid.density:g} in {unit}")
            break
    _warn(
        f"solid: shear waves at {speed:.4g} m/s, as in no solid (shear_modulus ="
        f" {solid.shear_modulus:g} Pa, density = {solid.density:g} kg/m3)",
        " or ".join(guesses),
    )


def warn_of_units(problem: Problem, strength: float, residual: float = 0.0) -> None:
    """Warn where the mean strength (Pa) does not go with the rest of the problem."""
    modulus = problem.solid.shear_modulus
    pressure = problem.load.normal_pressure
    pressure = None if pressure is None else float(np.mean(pressure))
    friction = problem.friction
    reasons = []
    if strength < WEAKEST * modulus:
        reasons.append(f"{strength / modulus:.2g} of the shear modulus")
    if strength > modulus:
        reasons.append(f"{strength / modulus:.2g} times the shear modulus")
    if pressure is not None and not SLIPPERIEST <= strength / pressure <= ROUGHEST:
        reasons.append(f"a friction coefficient of {strength / pressure:.2g} at {pressure:g} Pa")
    if friction.weakening_rate is not None:
        slip = (strength - residual) / float(np.median(friction.weakening_rate))
        if 0.0 < slip < ATOM:
            reasons.append(f"less than an atom of critical slip, {slip:.2g} m")
    if reasons:
        _warn(f"strength: its mean, {strength:.4g} Pa, is " + " and ".join(reasons),
              _unit_of_strength(strength, modulus, pressure))  # fmt: skip
        return  # the length below follows from it
    if friction.weakening_rate is None:  # otherwise the problem has seen to it
        scale, value = friction.scale
        rate = float(friction.rate(np.array(strength - residual), scale, np.median(value)))
        warn_of_length(problem, problem.nucleation_length_of(max(rate, 1e-300)), strength)


def warn_of_length(problem: Problem, patch: float, strength: float | None = None) -> None:
    """Warn where the critical patch (m) fills the interface."""
    length = min(problem.interface.lengths)
    if patch < length:
        return
    _warn(
        f"the critical patch (nucleation length {patch:.3g} m) fills the interface"
        f" ({length:.3g} m): all of it slides as one",
        suspects(problem, length / patch, strength),
    )


def is_strength(value: float) -> bool:
    """Whether some solid may have such a mean strength (Pa)."""
    low, high = _PARTS["strength"][2]
    return low <= value <= high


def warn_of_mapped(strength: float, others: Mapping[str, float]) -> None:
    """Warn of a mean strength (Pa) made of heights without a unit; `others`: if in which one."""
    fits = {unit: abs(math.log(value / TYPICAL)) for unit, value in others.items()
            if is_strength(value)}  # fmt: skip
    unit = min(fits, key=lambda unit: fits[unit]) if fits else None
    _warn(
        f"strength: makes {strength:.4g} Pa in the mean of values that state no unit, taken as m",
        f"they are in {unit}: unit={unit!r}" if unit else "",
    )


def _unit_of_strength(strength: float, modulus: float, pressure: float | None) -> str:
    guesses = []
    if pressure is not None and 0.01 <= strength <= 5.0:
        guesses.append("strength is a friction coefficient (multiply it by the normal pressure)")
    fits = {}
    for unit, factor in _STRESSES.items():
        value = strength * factor
        usual = pressure is None or 0.02 <= value / pressure <= 5.0
        if usual and 1e-6 <= value / modulus <= 0.03:
            fits[unit] = abs(math.log(value / modulus / USUAL))
    if fits:
        guesses.append(f"strength is in {min(fits, key=lambda unit: fits[unit])}")
    if pressure is None and 0.05 <= strength <= 1.5:
        guesses.append("strength is a friction coefficient (multiply it by the normal pressure)")
    return " or ".join(guesses)


def _warn(text: str, guess: str) -> None:
    advice = f"perhaps {guess}" if guess else "check the units if that is not meant"
    warn_user(f"{text}; {advice}", UnitWarning)

"""Names, units and meanings of given, drawn and computed quantities."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Variable:
    """Unit, meaning and dimensions of a variable in a result.

    Attributes
    ----------
    units : str
        In SI, "1" for a pure number.
    long_name : str
    dims : tuple of str
        The first is 'sample' for all variables from a method.
    """

    units: str
    long_name: str
    dims: tuple[str, ...] = ("sample",)

    @property
    def wide(self) -> bool:
        """Whether a sample has a value for each node, rather than a number or a vector.

        >>> [Variable("m", "", dims).wide for dims in (("sample",), ("sample", "direction"))]
        [False, False]
        >>> Variable("m", "", ("sample", "x", "direction")).wide, Variable("m", "", ("x",)).wide
        (True, False)
        """
        return not set(self.dims[1:]) <= {DIRECTION}


PROFILES: dict[str, Variable] = {
    "strength": Variable("Pa", "peak strength"),
    "residual_strength": Variable("Pa", "residual strength"),
    "initial_stress": Variable("Pa", "initial stress"),
    "weakening_rate": Variable("Pa m-1", "weakening rate"),
    "critical_slip": Variable("m", "critical slip"),
    "fracture_energy": Variable("J m-2", "fracture energy"),
    "normal_pressure": Variable("Pa", "normal pressure"),
}
"""Profiles that may be given or sampled, in an order that numbers the
streams of random draws and never changes."""
FRICTION_COEFFICIENT = Variable("1", "static friction coefficient")
QUANTITIES = PROFILES | {
    "residual_ratio": Variable("1", "residual ratio"),
    "load_profile": Variable("1", "load profile"),
    "slip": Variable("m", "slip"),
    "friction_coefficient": FRICTION_COEFFICIENT,
    "height": Variable("m", "height"),
}
"""Quantities that may be read as a profile."""

UNITS = {name: variable.units for name, variable in PROFILES.items()} | {
    "length": "m",
    "correlation_length": "m",
    "efolding_length": "m",
    "decay": "m",
    "height": "m",
    "thickness": "m",
    "width": "m",
    "behind": "m",
    "ahead": "m",
    "stiffness": "N m-1",
    "mass": "kg",
    "shear_modulus": "Pa",
    "youngs_modulus": "Pa",
    "density": "kg m-3",
    "loading_rate": "Pa s-1",
    "pressing_force": "N",
    "end_time": "s",
}
"""Units of parameters by the ends of their keys. Other parameters are
pure numbers."""
OF_THE_FIELD = ("mean", "standard_deviation", "low", "high", "loc", "scale", "noise")
"""Parameters of a marginal or a measurement in the unit of their field."""


def unit_of_key(key: str, of_field: str) -> str:
    """Return the unit of a parameter with a dotted key, for a field in the unit `of_field`.

    >>> [unit_of_key(f"strength.marginal.{name}", "Pa") for name in ("mean", "shape", "low")]
    ['Pa', '1', 'Pa']
    >>> unit_of_key("strength.spectrum.correlation_length", "Pa"), unit_of_key("noise", "N")
    ('m', 'N')
    >>> unit_of_key("correlation.scale", "Pa"), unit_of_key("between.noise", "Pa")
    ('1', '1')
    """
    *before, last = key.split(".")
    if {"between", "correlation"} & {*before}:
        return "1"
    return of_field if last in OF_THE_FIELD else UNITS.get(last, "1")


DIRECTION = "direction"
"""Dimension of the components along x and y."""

ONSET_VARIABLES: dict[str, Variable] = {
    "critical_load": Variable("Pa", "load factor at which the interface slides as a whole"),
    "critical_stress": Variable("Pa", "largest mean interface stress on the way to sliding"),
    "first_instability": Variable(
        "Pa", "mean interface stress when the first patch is unstable"
    ),
    "critical_position": Variable("m", "position of the critical patch"),
}

FORCES: dict[str, tuple[str, str]] = {
    "critical_stress": ("critical_force", "largest shear force on the way to sliding"),
    "first_instability": (
        "first_instability_force", "shear force when the first patch is unstable"
    ),
    "event_stress": ("event_force", "shear force at the event"),
    "event_stress_drop": ("event_force_drop", "fall of the shear force in the event"),
    "mean_stress": ("force", "shear force"),
    "machine_stress": ("machine_force", "force of the machine"),
}  # fmt: skip
"""Names and texts of the forces that accompany mean stresses if the
area is known."""
OF_WHOLE_INTERFACE = ("machine_stress",)
"""Stresses of `FORCES` that the whole interface carries, not only the
part that can break."""


def force_variables(variables: Mapping[str, Variable]) -> dict[str, Variable]:
    """Return the variables for the forces, N, that accompany the stresses among some variables.

    >>> known = {"slip": Variable("m", "slip"), "mean_stress": Variable("Pa", "mean", ("load",))}
    >>> force_variables(known)
    {'force': Variable(units='N', long_name='shear force', dims=('load',))}
    """
    dims = {name: known.dims for name, known in variables.items() if name in FORCES}
    return {FORCES[name][0]: Variable("N", FORCES[name][1], dims[name]) for name in dims}


def forces(
    values: Mapping[str, Any], area: float | None, whole_area: float | None
) -> dict[str, Any]:
    """Return the forces, N, for the stresses among some values, or {} if the area is unknown.

    `area` is the area that can break, and `whole_area` the area of the
    whole interface, m².

    The force of the machine refers to the whole interface.

    >>> values = {"mean_stress": 3.0, "slip": 1.0, "machine_stress": 5.0}
    >>> forces(values, 2.0, 7.0)
    {'force': 6.0, 'machine_force': 35.0}
    >>> forces(values, None, 7.0), forces(values, 2.0, None)
    ({}, {})
    """
    if area is None or whole_area is None:
        return {}
    return {
        FORCES[name][0]: stress * (whole_area if name in OF_WHOLE_INTERFACE else area)
        for name, stress in values.items()
        if name in FORCES
    }


SAMPLE = Variable("1", "sample number", ("sample",))

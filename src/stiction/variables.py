"""Names, units and meaning of what is given, drawn and computed along an interface."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Variable:
    """Unit, meaning and dimensions of a variable of a result.

    Attributes
    ----------
    units : str
        SI; "1" for a pure number.
    long_name : str
    dims : tuple of str
        The first is 'sample' for all variables of a method.
    """

    units: str
    long_name: str
    dims: tuple[str, ...] = ("sample",)

    @property
    def wide(self) -> bool:
        """Whether a sample has one value a node, and not one or one a direction."""
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
"""What may be given or sampled along an interface, with its unit; the order is that of the streams
of random draws and never changes."""
FRICTION_COEFFICIENT = Variable("1", "static friction coefficient")
QUANTITIES = PROFILES | {
    "residual_ratio": Variable("1", "residual ratio"),
    "load_profile": Variable("1", "load profile"),
    "slip": Variable("m", "slip"),
    "friction_coefficient": FRICTION_COEFFICIENT,
    "height": Variable("m", "height"),
}
"""What may be read as a profile."""

DIRECTION = "direction"
"""Dimension of the components along x and y."""

ONSET_VARIABLES: dict[str, Variable] = {
    "critical_load": Variable("Pa", "load factor at which the interface slides as a whole"),
    "critical_stress": Variable("Pa", "mean interface stress at the critical load"),
    "first_instability": Variable(
        "Pa", "mean interface stress when the first patch is unstable"
    ),
    "critical_position": Variable("m", "position of the critical patch"),
}

SAMPLE = Variable("1", "sample number", ("sample",))

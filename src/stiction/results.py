"""Results: labelled datasets with units and all it takes to run them again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stiction import __version__
from stiction.interface import Interface

if TYPE_CHECKING:
    import xarray as xr


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


def along(interface: Interface, variable: Variable) -> Variable:
    """Return the same variable with one value a node."""
    return replace(variable, dims=(*variable.dims, *interface.dims))


def position(interface: Interface, variable: Variable) -> Variable:
    """Return the same variable as a place, which has two components on a plane."""
    dims = (*variable.dims, DIRECTION) if interface.is_plane else variable.dims
    return replace(variable, dims=dims)


def onset_variables(interface: Interface) -> dict[str, Variable]:
    """Return the variables that every method computes for each sample."""
    place = position(interface, ONSET_VARIABLES["critical_position"])
    return ONSET_VARIABLES | {"critical_position": place}


def coordinate(interface: Interface, dim: str) -> tuple[NDArray[Any], Variable]:
    """Return the values and the meaning of a dimension of the interface."""
    if dim == DIRECTION:
        return np.array(interface.dims), Variable("", "direction of a component", (DIRECTION,))
    what = f"position along {dim}" if interface.is_plane else "position along the interface"
    return interface.coordinates[dim], Variable("m", what, (dim,))


def to_dataset(
    values: Mapping[str, NDArray[Any]],
    variables: Mapping[str, Variable],
    coordinates: Mapping[str, tuple[NDArray[Any], Variable]],
    attributes: Mapping[str, Any],
    interface: Interface | None = None,
) -> xr.Dataset:
    """Label arrays with dimensions, coordinates, units and long names.

    Of the attributes, strings and numbers are kept; anything else is written as JSON. The places of
    nodes are added if they lie on one `interface`.
    """
    import xarray as xr

    def labelled(array: NDArray[Any], variable: Variable) -> Any:
        about = {"units": variable.units, "long_name": variable.long_name}
        return variable.dims, np.asarray(array), about

    attrs: dict[str, Any] = {"stiction_version": __version__}
    attrs |= {f"{library}_version": version(library) for library in ("numpy", "numba")}
    for name, value in attributes.items():
        attrs[name] = value if isinstance(value, str | int | float) else json.dumps(value)
    coordinates = dict(coordinates)
    if interface is not None:
        used = {dim for name in values for dim in variables[name].dims}
        for dim in sorted(used & {*interface.dims, DIRECTION}):
            coordinates[dim] = coordinate(interface, dim)
    return xr.Dataset(
        {name: labelled(array, variables[name]) for name, array in values.items()},
        coords={name: labelled(*given) for name, given in coordinates.items()},
        attrs=attrs,
    )


SAMPLE = Variable("1", "sample number", ("sample",))

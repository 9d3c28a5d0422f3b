"""Results: labelled datasets with units, and with the inputs that are needed to repeat them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stiction import __version__
from stiction.base.errors import InputError
from stiction.base.model import to_plain
from stiction.base.variables import DIRECTION, ONSET_VARIABLES, Variable
from stiction.problem.interface import Interface

if TYPE_CHECKING:
    import xarray as xr


def study_attributes(**parts: Any) -> dict[str, Any]:
    """Return the problem, the method and so on by name in plain form, or why this is impossible.

    >>> study_attributes(problem={"nodes": 8}, seed=3), [*study_attributes(problem=print)]
    ({'study': {'problem': {'nodes': 8}, 'seed': 3}}, ['study_incomplete'])
    """
    try:
        return {"study": {name: to_plain(part) for name, part in parts.items()}}
    except InputError as error:
        return {"study_incomplete": str(error)}


def along(interface: Interface, variable: Variable) -> Variable:
    """Return the variable with a value for each node.

    >>> along(Interface((1.0, 2.0), (8, 16)), Variable("Pa", "stress")).dims
    ('sample', 'x', 'y')
    """
    return replace(variable, dims=(*variable.dims, *interface.dims))


def position(interface: Interface, variable: Variable) -> Variable:
    """Return the variable as a position, which has two components on a plane.

    >>> interfaces = Interface(1.0, 8), Interface((1.0, 2.0), (8, 16))
    >>> [position(interface, Variable("m", "place")).dims for interface in interfaces]
    [('sample',), ('sample', 'direction')]
    """
    dims = (*variable.dims, DIRECTION) if interface.is_plane else variable.dims
    return replace(variable, dims=dims)


def per_area(interface: Interface, variable: Variable) -> Variable:
    """Return the variable on this interface.

    On a plane, a quantity per length becomes a total.

    >>> force = Variable("N", "force per length")
    >>> for interface in (Interface(1.0, 8), Interface((1.0, 2.0), (8, 16))):
    ...     print(per_area(interface, force))
    Variable(units='N', long_name='force per length', dims=('sample',))
    Variable(units='N m', long_name='force', dims=('sample',))
    >>> [per_area(interface, Variable(units, "")).units for units in ("N/s", "J/m", "Pa")]
    ['N m/s', 'J', 'Pa']
    """
    if not interface.is_plane:
        return variable
    units = {"N": "N m", "N/s": "N m/s", "J/m": "J"}.get(variable.units, variable.units)
    name = variable.long_name.replace(" per length", "")
    return replace(variable, units=units, long_name=name)


def onset_variables(interface: Interface) -> dict[str, Variable]:
    """Return the variables that every method computes for each sample.

    >>> variables = onset_variables(Interface((1.0, 2.0), (8, 16)))
    >>> variables["critical_position"].dims, variables["critical_load"].dims
    (('sample', 'direction'), ('sample',))
    """
    place = position(interface, ONSET_VARIABLES["critical_position"])
    return ONSET_VARIABLES | {"critical_position": place}


def coordinate(interface: Interface, dim: str) -> tuple[NDArray[Any], Variable]:
    """Return the values and the meaning of an interface dimension.

    >>> line, plane = Interface(1.0, 8), Interface((1.0, 2.0), (8, 16))
    >>> values, variable = coordinate(plane, "y")
    >>> values[[0, 1, -1]].tolist(), variable.units, variable.long_name, variable.dims
    ([0.0, 0.125, 1.875], 'm', 'position along y', ('y',))
    >>> coordinate(line, "x")[1].long_name, coordinate(plane, "direction")[0].tolist()
    ('position along the interface', ['x', 'y'])
    """
    if dim == DIRECTION:
        return np.array(interface.dims), Variable("", "direction of a component", (DIRECTION,))
    what = f"position along {dim}" if interface.is_plane else "position along the interface"
    return interface.coordinates[dim], Variable("m", what, (dim,))


def as_text(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return attributes other than strings and numbers as JSON.

    >>> as_text({"seed": 3, "cv": 0.5, "note": "a", "sizes": [1, 2], "gap": None})
    {'seed': 3, 'cv': 0.5, 'note': 'a', 'sizes': '[1, 2]', 'gap': 'null'}
    """
    return {
        name: value if isinstance(value, str | int | float) else json.dumps(value)
        for name, value in attributes.items()
    }


def to_dataset(
    values: Mapping[str, NDArray[Any]],
    variables: Mapping[str, Variable],
    coordinates: Mapping[str, tuple[NDArray[Any], Variable]],
    attributes: Mapping[str, Any],
    interface: Interface | None = None,
) -> xr.Dataset:
    """Label arrays with dimensions, coordinates (of an `interface` too), units and names.

    Attributes other than strings and numbers are written as JSON.

    >>> variables = {"slip": Variable("m", "slips", ("sample", "x")), "load": Variable("Pa", "p")}
    >>> samples = {"sample": (np.array([4, 7]), Variable("", "number"))}
    >>> values = {"slip": np.ones((2, 8)), "load": np.ones(2)}
    >>> data = to_dataset(values, variables, samples, {"seed": [3]}, Interface(1.0, 8))
    >>> dict(data.sizes), data.slip.attrs, data.seed, data.x.values[1:3].tolist()
    ({'sample': 2, 'x': 8}, {'units': 'm', 'long_name': 'slips'}, '[3]', [0.125, 0.25])
    >>> slips = values.pop("slip")
    >>> [*to_dataset(values, variables, samples, {}, Interface(1.0, 8)).coords]
    ['sample']
    """
    import xarray as xr

    def labelled(array: NDArray[Any], variable: Variable) -> Any:
        about = {"units": variable.units, "long_name": variable.long_name}
        return variable.dims, np.asarray(array), about

    attrs: dict[str, Any] = {"stiction_version": __version__}
    attrs |= {f"{library}_version": version(library) for library in ("numpy", "numba")}
    attrs |= as_text(attributes)
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

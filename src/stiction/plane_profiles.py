"""Profiles of planes that state their own axes and units: names decide, whatever the order."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.interface import Interface
from stiction.model import describe, real_array
from stiction.profile_files import NETCDF, TEXT, decoded, read_netcdf, read_npy
from stiction.profile_text import Table, read_table
from stiction.quantities import Map, check_only, choose, converted, factor_of

TOLERANCE = 0.02
"""Of the spacing of nodes: what rounding in a file may move a point."""


def on_plane(
    source: Any,
    quantity: str,
    interface: Interface,
    value: Any = None,
    unit: str | None = None,
    strength: Map | None = None,
) -> Array:
    """Values of a labelled array at the nodes of a plane, in SI.

    Parameters
    ----------
    source : DataArray or Dataset
        Over 'x' and 'y', in any order, and at most one dimension more, of samples. Coordinates, if
        it has any, must be those of the nodes.
    quantity : str
        One of `stiction.quantities.UNITS`.
    interface : Interface
    value, unit : str, optional
        Name of the variable; unit where the source states none.
    strength : callable, optional
        What makes `quantity` of the values, which are something else then, such as heights.

    Returns
    -------
    (samples, nx, ny) or (nx, ny) array; (samples, 1) of one value a sample
    """
    if hasattr(source, "data_vars"):
        names = [str(one) for one in source.data_vars]
        if value is not None and value not in names:
            raise InputError(unknown_name("value", str(value), names))
        if not names:
            raise InputError("holds no map (a variable of numbers along two dimensions)")
        known = [(one, _stated(source[one])) for one in names]
        name = names[choose(known, quantity, strength)] if value is None else value
        source = source[name]
    else:
        check_only(source.name, value)
    stated, name = _stated(source), source.name
    dims = [str(dim) for dim in source.dims]
    samples = [dim for dim in dims if dim not in interface.dims]
    if len(samples) <= 1 and len(samples) == len(dims):  # one value a sample
        values = real_array(source.values)[..., np.newaxis]
        return converted(values, unit, stated, quantity, strength, name)
    if len(samples) > 1 or len(dims) - len(samples) != 2:
        raise InputError(
            f"which dimensions run along the plane is not clear from ({', '.join(dims)}); call them"
            " 'x', the direction of load and slip, and 'y', and a third one 'sample'"
        )
    source = source.transpose(*samples, *interface.dims)
    for dim, nodes in interface.coordinates.items():
        if source.sizes[dim] != nodes.size:
            raise InputError(
                f"has {source.sizes[dim]} values along {dim}, the plane has {nodes.size} nodes"
            )
        if dim in source.coords:
            place = real_array(source[dim].values) * factor_of(None, _stated(source[dim]), dim)
            order = np.argsort(place, kind="stable")
            source, place = source.isel({dim: order}), place[order]
            if not np.abs(place - nodes).max() <= TOLERANCE * nodes[1]:  # NaN is no place
                raise InputError(
                    f"{dim} reaches from {place[0]:g} to {place[-1]:g} m, the nodes from"
                    f" {nodes[0]:g} to {nodes[-1]:g} m; on a plane values are taken at the nodes"
                    " only"
                )
    return converted(real_array(source.values), unit, stated, quantity, strength, name)


def _stated(source: Any) -> str | None:
    return str(source.attrs.get("units", source.attrs.get("unit", ""))).strip() or None


def read_plane(
    path: Path,
    quantity: str,
    interface: Interface,
    value: Any,
    unit: str | None,
    strength: Map | None,
) -> Array:
    """The same from a .npy file of shape (nx, ny), in SI or in `unit`, a NetCDF file or text."""
    if path.suffix.lower() in NETCDF:
        return on_plane(read_netcdf(path, 2), quantity, interface, value, unit, strength)
    if path.suffix.lower() in TEXT:
        return _from_table(read_table(decoded(path)), quantity, interface, value, unit, strength)
    if path.suffix.lower() != ".npy":
        raise InputError(
            "a profile of a plane is an array (nx, ny) in a .npy or .nc file, or text with the"
            f" columns x, y and value, got {path.name!r}"
        )
    if value is not None:
        raise InputError(
            f"value: a .npy file of a plane holds one array, without names; got {describe(value)}"
        )
    array = read_npy(path)
    if array.shape == interface.shape[::-1] != interface.shape:
        raise InputError(
            f"must have shape {interface.shape}, got shape {array.shape}; x and y have changed"
            " places: the first axis of a profile is x"
        )
    if array.shape != interface.shape:
        raise InputError(f"must have shape {interface.shape}, got shape {array.shape}")
    return converted(array, unit, None, quantity, strength)


def _from_table(
    table: Table,
    quantity: str,
    interface: Interface,
    value: Any,
    unit: str | None,
    strength: Map | None,
) -> Array:
    """Values at the nodes from columns x, y and value; NaN where there is none."""
    names = [str(name).casefold() for name in table.names]
    if not any(table.names):
        raise InputError(
            f"holds {len(names)} columns without names, as of a matrix; a map as text has a line"
            " for each place, with columns called 'x', 'y' and the value's; save a matrix"
            " (nx, ny) with np.save as .npy"
        )
    if "x" not in names or "y" not in names:
        raise InputError(
            "a map as text needs a line of names, with columns called 'x', 'y' and the value's, got"
            f" {', '.join(repr(name) for name in table.names)}"
        )
    rest = [i for i, name in enumerate(names) if name not in ("x", "y")]
    if not rest:
        raise InputError("holds places only; a map has a column of values beside x and y")
    chosen = [i for i in rest if table.names[i] == value or i == value]
    if value is not None and not chosen:
        raise InputError(unknown_name("value", str(value), [str(table.names[i]) for i in rest]))
    known = [(table.names[i], table.units[i] or unit) for i in rest]
    column = chosen[0] if chosen else rest[choose(known, quantity, strength)]
    found = np.full(interface.shape, np.nan)
    index = []
    for dim, spacing, count in zip(
        interface.dims, interface.spacings, interface.shape, strict=True
    ):
        at = names.index(dim)
        place = table.columns[at] * factor_of(None, table.units[at], dim) / spacing
        off = np.abs(place - np.round(place))
        if not np.all(off <= TOLERANCE):
            raise InputError(
                f"{dim} must lie at the nodes, {spacing:.6g} m apart; {dim} ="
                f" {place[int(np.argmax(~(off <= TOLERANCE)))] * spacing:.6g} m does not"
            )
        if place.min() < -TOLERANCE or place.max() > count - 1 + TOLERANCE:
            raise InputError(
                f"{dim} reaches from {place.min() * spacing:g} to {place.max() * spacing:g} m, the"
                f" nodes from 0 to {(count - 1) * spacing:g} m; check its unit"
            )
        index.append(np.round(place).astype(np.int64))
    flat = np.ravel_multi_index(index, interface.shape)
    if np.unique(flat).size < flat.size:
        raise InputError("repeats a place: two lines have the same x and y")
    found.ravel()[flat] = table.columns[column]
    return converted(found, unit, table.units[column], quantity, strength, table.names[column])

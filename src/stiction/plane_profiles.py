"""Profiles of planes that state their own axes and units: names decide, whatever the order."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from stiction._model import real_array
from stiction._typing import Array
from stiction.errors import InputError, unknown_name
from stiction.interface import Interface
from stiction.profile_files import NETCDF, TEXT, decoded, read_netcdf, read_npy
from stiction.profile_text import Table, read_table
from stiction.units import factor_to

TOLERANCE = 0.02
"""Of the spacing of nodes: what rounding in a file may move a point."""


def on_plane(
    source: Any, quantity: str, si: str, interface: Interface, value: Any = None, unit: Any = None
) -> Array:
    """Values of a labelled array at the nodes of a plane, in SI.

    Parameters
    ----------
    source : DataArray or Dataset
        Over 'x' and 'y', in any order, and at most one dimension more, of samples. Coordinates, if
        it has any, must be those of the nodes.
    quantity, si : str
        What it is called in a dataset, and its SI unit.
    interface : Interface
    value, unit : str, optional
        Name of the variable; unit where the source states none.

    Returns
    -------
    (samples, nx, ny) or (nx, ny) array; (samples, 1) of one value a sample
    """
    if hasattr(source, "data_vars"):
        name = quantity if value is None else value
        names = [str(one) for one in source.data_vars]
        if len(names) == 1 and value is None:
            name = names[0]
        if name not in names:
            raise InputError(unknown_name("value", str(name), names))
        source = source[name]
    dims = [str(dim) for dim in source.dims]
    samples = [dim for dim in dims if dim not in interface.dims]
    if len(samples) <= 1 and len(samples) == len(dims):  # one value a sample
        values = real_array(source.values)[..., np.newaxis]
        return values * _factor(source, si, unit)
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
            place = real_array(source[dim].values) * _factor(source[dim], "m", None)
            if np.abs(place - nodes).max() > TOLERANCE * nodes[1]:
                raise InputError(
                    f"{dim} reaches from {place[0]:g} to {place[-1]:g} m, the nodes from"
                    f" {nodes[0]:g} to {nodes[-1]:g} m; on a plane values are taken at the nodes"
                    " only"
                )
    return real_array(source.values) * _factor(source, si, unit)


def _factor(source: Any, si: str, given: str | None) -> float:
    stated = str(source.attrs.get("units", source.attrs.get("unit", ""))).strip()
    text = given or stated
    return factor_to(si, text) if text else 1.0


def read_plane(
    path: Path, quantity: str, si: str, interface: Interface, value: Any, unit: Any
) -> Array:
    """The same from a .npy file of shape (nx, ny), in SI or in `unit`, or a NetCDF file."""
    if path.suffix.lower() in NETCDF:
        return on_plane(read_netcdf(path, 2), quantity, si, interface, value, unit)
    if path.suffix.lower() in TEXT:
        return _from_table(read_table(decoded(path)), quantity, si, interface, value, unit)
    if path.suffix.lower() != ".npy":
        raise InputError(
            "a profile of a plane is an array (nx, ny) in a .npy or .nc file, or text with the"
            f" columns x, y and value, got {path.name!r}"
        )
    array = read_npy(path)
    if array.shape == interface.shape[::-1] != interface.shape:
        raise InputError(
            f"must have shape {interface.shape}, got shape {array.shape}; x and y have changed"
            " places: the first axis of a profile is x"
        )
    if array.shape != interface.shape:
        raise InputError(f"must have shape {interface.shape}, got shape {array.shape}")
    return array * (factor_to(si, unit) if unit else 1.0)


def _from_table(
    table: Table, quantity: str, si: str, interface: Interface, value: Any, unit: str | None
) -> Array:
    """Values at the nodes from columns x, y and value; NaN where there is none."""
    names = [str(name).casefold() for name in table.names]
    if "x" not in names or "y" not in names:
        raise InputError(
            "a map as text needs a line of names, with columns called 'x', 'y' and the value's, got"
            f" {', '.join(repr(name) for name in table.names)}"
        )
    rest = [i for i, name in enumerate(names) if name not in ("x", "y")]
    chosen = [i for i in rest if table.names[i] == value or i == value]
    called = [i for i in rest if names[i] == quantity]
    if value is not None and not chosen:
        raise InputError(unknown_name("value", str(value), [str(table.names[i]) for i in rest]))
    column = (chosen or called or rest)[0]
    if len(rest) > 1 and not chosen and not called:
        raise InputError("holds several columns beside x and y; say which is meant: value=...")
    stated = table.units[column]
    if not (chosen or called or unit or stated):
        raise InputError(
            f"its column {table.names[column]!r} is not plainly the {quantity} ({si}): call it so,"
            " state its unit, or say which it is with value=..."
        )
    found = np.full(interface.shape, np.nan)
    index = []
    for dim, spacing, count in zip(
        interface.dims, interface.spacings, interface.shape, strict=True
    ):
        at = names.index(dim)
        place = table.columns[at] * factor_to("m", table.units[at] or "m") / spacing
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
    given = None if unit is None or stated is None else factor_to(si, stated)
    if given is not None and not np.isclose(given, factor_to(si, str(unit)), rtol=1e-12):
        raise InputError(f"{quantity} is said to be in {unit}, the source states {stated}")
    return found * factor_to(si, unit or stated or si)

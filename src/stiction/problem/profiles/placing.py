"""Put values on the nodes of a line or a plane, and refuse gaps.

The nodes are x_i = i L/n in each direction. The interface
is periodic, so points may come in any order and begin
anywhere. On a specimen, the nodes are x_i = (i + 1/2)
L/n, and the profile stops at its ends. The steps are:

1. Find the common offset of the points from the nodes, as a share of
   the spacing. Warn about an offset. Refuse points that do not lie on
   nodes.
2. Number the node of each point. Refuse two different values at a node.
3. Give each node the value of its point, or NaN.
4. Refuse missing values, unless the caller can use them.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, warn_accuracy
from stiction.base.model import real_array
from stiction.problem.interface import Interface
from stiction.problem.reading.labels import OF_A_PLANE, is_labelled, labelled, simplified

TOLERANCE = 0.02
"""Share of the spacing by which rounding in a file may move a point."""


def points_of(array: Any) -> tuple[Array, dict[str, Array]]:
    """Return values (..., points) and positions (m) by direction.

    Values without coordinates keep their shape, and their dictionary of
    positions is empty.
    """
    dims = [dim for dim in ("x", "y") if dim in array.coords]
    if len(dims) == 2 and "row" not in array.dims:
        array = array.stack(row=dims, create_index=False)
    return array.values, {dim: array[dim].values for dim in dims}


def place(array: Any, interface: Interface) -> Array:
    """Return values at the nodes of an interface (..., *shape), with NaN at missing points."""
    values, places = points_of(array)
    if not places:
        shape = values.shape[-len(interface.shape) :]
        if shape != interface.shape:
            hint = turned(shape, interface.shape)
            if not interface.is_plane:
                hint = ". Give a value for each node, or positions (x=...)"
            raise InputError(f"must have shape {interface.shape}, got shape {shape}{hint}")
        return values
    if values.size == 0:
        raise InputError("has no values")
    # 1. Find the offset from the nodes.
    offsets = [_offset(dim, places[dim], interface) for dim in interface.dims]
    # 2. Number nodes.
    steps = [
        np.round(places[dim] / h - interface.first - offset).astype(np.int64)
        for dim, h, offset in zip(interface.dims, interface.spacings, offsets, strict=True)
    ]
    if interface.is_free:
        flat, at = steps[0], places["x"]
        if not 0 <= flat.min() <= flat.max() < interface.size:
            raise InputError(
                f"x extends from {at.min():g} to {at.max():g} m, beyond a specimen of"
                f" {interface.measure:g} m. Crop the record or move its coordinates, as in"
                " profile.assign_coords(x=profile.x - profile.x.min())"
            )
    else:
        flat = np.ravel_multi_index(steps, interface.shape, mode="wrap")
    node, first, twins = np.unique(flat, return_index=True, return_inverse=True)
    _check_repeats(values, places, first[twins], interface)
    # 3. Put values on the nodes.
    full = np.full((*values.shape[:-1], interface.size), np.nan)
    full[..., node] = values[..., first]
    return full.reshape(*values.shape[:-1], *interface.shape)


def turned(given: tuple[int, ...], shape: tuple[int, ...]) -> str:
    """Return a hint for the message about the shape of a plane, if its axes are swapped."""
    if len(shape) == 2 and given == shape[::-1]:
        return ". x and y are swapped: the first axis of a profile is x"
    return ""


def _offset(dim: str, x: Array, interface: Interface) -> float:
    """Return the offset of the points from the nodes, in spacings, in (-0.5, 0.5] (step 1)."""
    axis = interface.dims.index(dim)
    spacing, length = interface.spacings[axis], interface.lengths[axis]
    formula, cells = f"{dim}_i = i L/n", ", as at the centres of cells"
    if interface.is_free:
        formula, cells = f"{dim}_i = (i + 1/2) L/n", ""
    at = np.unique(x) / spacing - interface.first
    if at[-1] - at[0] > interface.shape[axis] + TOLERANCE:
        period = np.ptp(x) + spacing * np.median(np.diff(at))  # both ends are not one place
        raise InputError(
            f"{dim} extends from {x.min():g} to {x.max():g} m on an interface of {length:g} m."
            f" Check the unit of {dim}, crop the record, or make interface.length {period:.6g}"
        )
    first = at[0] - np.ceil(at[0] - 0.5 - TOLERANCE)
    if interface.is_free and first > 0.5 - 2.0 * TOLERANCE:
        first -= 1.0  # the node before would lie outside
    deviation = at - first - np.round(at - first)
    coarse = not interface.is_plane and (at.size < 2 or np.median(np.diff(at)) > 1.5)
    if coarse or np.abs(deviation).max() > TOLERANCE:
        advice = "" if interface.is_plane else ", as in profile.interp(x=problem.interface.x)"
        raise InputError(
            f"the {at.size} points of {dim}, from {x.min():.6g} to {x.max():.6g} m, do not coincide"
            f" with the {interface.shape[axis]} nodes {formula}, which are {spacing:.6g} m apart."
            f" Check the unit of {dim}, or give values at the nodes (interface.{dim}){advice}"
        )
    offset = float(first + deviation.mean())
    if abs(offset) > TOLERANCE:
        warn_accuracy(
            f"{dim} is offset by {offset:.2g} of a spacing from the nodes {formula}{cells}, where"
            f" values are used. Add {offset * spacing:+.4g} m to positions in the result"
        )
    return offset


def _check_repeats(
    values: Array, places: dict[str, Array], twins: NDArray[np.int64], interface: Interface
) -> None:
    """Refuse two points at the same place, unless they have the same value a period apart."""
    rows = values.reshape(-1, twins.size)
    for i in np.flatnonzero(twins != np.arange(twins.size)):
        pair = [twins[i], i]
        sides = zip(places.values(), interface.lengths, strict=True)
        apart = max(np.ptp(x[pair]) / length for x, length in sides)
        first, second = rows.T[pair]
        if apart < 0.5 or not np.array_equal(first, second, equal_nan=True):
            where = ", ".join(
                f"{dim} = {x[twins[i]]:.9g} and {x[i]:.9g} m" for dim, x in places.items()
            )
            raise InputError(
                f"{where} are the same position on an interface of period {interface.length}"
                f" m. Keep either value{'' if interface.is_plane else OF_A_PLANE}"
            )


def refuse_missing(values: Array, interface: Interface) -> Array:
    """Return values (..., *shape). Refuse NaN among them (step 4)."""
    missing = np.isnan(values)
    if missing.any():
        rows = missing.reshape(-1, *interface.shape)
        row = int(np.argmax(rows.any(axis=interface.axes)))
        raise InputError(
            f"values are missing (NaN) at {rows[row].sum()} of {interface.size} nodes"
            f"{f' of sample {row}' * (len(rows) > 1)}, the first at"
            f" {interface.describe_node(int(np.argmax(rows[row])))}. Make interface.length the"
            " length of the record, or draw equally likely values there with"
            " RandomField.given(profile)"
        )
    return values


def at_nodes(name: str, value: Any, interface: Interface, *, missing: bool = False) -> Any:
    """Return the values of a quantity at the nodes. With `missing`, some may be NaN.

    `name` may be a dotted key. Numbers, and arrays with a different
    shape, are returned unchanged, because the caller checks them.
    """
    quantity = quantity_of(name)
    with prefixed(name):
        if hasattr(value, "options"):  # a `ProfileFile`
            value = value.to_xarray(interface)
        value = simplified(value, quantity)
        if is_labelled(value):
            array = labelled(value, quantity, interface.dims)
            if array.ndim == 1 and not {*array.dims} <= {"x", "row"}:  # a value for each sample
                if quantity == "strength":
                    raise InputError(
                        "has no dimension along the interface. Name this dimension 'x'"
                    )
                return array.values[:, np.newaxis]
            array = place(array, interface)
            return array if missing else refuse_missing(array, interface)
        with suppress(TypeError):  # values that are no numbers are refused with other mistakes
            array = real_array(value)
            if array.shape[-len(interface.shape) :] == interface.shape:
                return array if missing else refuse_missing(array, interface)
    return value


def quantity_of(key: str) -> str:
    """Return the quantity that the parameter with this name or dotted key holds."""
    field = key.rsplit(".", 1)[-1]
    return "load_profile" if field == "profile" else field

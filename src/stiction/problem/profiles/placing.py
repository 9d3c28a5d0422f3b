"""Put values on the nodes of a line or a plane, and handle gaps.

The nodes are x_i = i L/n in each direction. The interface
is periodic, so points may come in any order and begin
anywhere. On a specimen, the nodes are x_i = (i + 1/2)
L/n, and the profile stops at its ends. The steps are:

1. Find the common offset of the points from the nodes, as a share of
   the spacing. Warn about an offset. Refuse points that do not lie on
   nodes, unless the caller wants to interpolate.
2. Number the node of each point. Refuse two different values at a node.
3. Give each node the value of its point, or interpolate between points.
4. Refuse missing values, leave NaN, or fill gaps by linear
   interpolation on request.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy
from stiction.problem.interface import Interface

if TYPE_CHECKING:
    import xarray as xr

Gaps = Literal["refuse", "fill", "skip"]
Mask = NDArray[np.bool_]

TOLERANCE = 0.02
"""Share of the spacing by which rounding in a file may move a point."""
WIDE = 4.0
"""Multiple of the median distance of points above which an interval is a gap."""
IN_GAP, MEASURED = "in_gap", "measured"
"""Variable of a result, and coordinate of results and profiles with gaps, False in a gap."""
OF_A_PLANE = (
    ". A map has columns or coordinates x and y, or is an .npy of shape (nx, ny), and needs an"
    " interface of two lengths and two numbers of nodes"
)
"""Advice for two dimensions where a line was expected."""


def points_of(array: Any) -> tuple[Array, dict[str, Array], Any]:
    """Return values (..., points), positions (m) by direction, and a mask of measured points.

    The mask is True if all points were measured.
    Values without coordinates keep their shape,
    and their dictionary of positions is empty.
    """
    dims = [dim for dim in ("x", "y") if dim in array.coords]
    if len(dims) == 2 and "row" not in array.dims:
        array = array.stack(row=dims, create_index=False)
    measured: Any = True
    if MEASURED in array.coords:
        mask = array[MEASURED].broadcast_like(array).transpose(*array.dims)
        measured = mask.values.astype(bool)
    return array.values, {dim: array[dim].values for dim in dims}, measured


def place(
    array: Any, interface: Interface, interpolate: bool = False, gaps: Gaps = "refuse"
) -> tuple[Array, Any]:
    """Return values at the nodes of an interface (..., *shape), and a mask of measured nodes.

    The mask is False at filled and missing values. It is True if all
    values are there.
    """
    values, places, measured = points_of(array)
    if not places:
        shape = values.shape[-len(interface.shape) :]
        if shape != interface.shape:
            hint = turned(shape, interface.shape)
            if not interface.is_plane:
                hint = ". Give a value for each node, or positions (x=...)"
            raise InputError(f"must have shape {interface.shape}, got shape {shape}{hint}")
        return close_gaps(values, measured, interface, gaps)
    if values.size == 0:
        raise InputError("has no values")
    # 1. Find the offset from the nodes.
    offsets = [_offset(dim, places[dim], interface, interpolate) for dim in interface.dims]
    # 2. Number nodes. Between them, places differ if they are a
    # millionth of a spacing apart.
    finer = 10**6 if None in offsets else 1
    shape = tuple(finer * n for n in interface.shape)
    steps = [
        np.round(finer * (places[dim] / h - interface.first - (offset or 0.0))).astype(np.int64)
        for dim, h, offset in zip(interface.dims, interface.spacings, offsets, strict=True)
    ]
    if interface.is_free:
        flat, at = steps[0], places["x"]
        if finer == 1 and not 0 <= flat.min() <= flat.max() < interface.size:
            raise InputError(
                f"x extends from {at.min():g} to {at.max():g} m, beyond a specimen of"
                f" {interface.measure:g} m. Crop the record, pass offset='centre' or"
                " interpolate=True"
            )
    else:
        flat = np.ravel_multi_index(steps, shape, mode="wrap")
    node, first, twins = np.unique(flat, return_index=True, return_inverse=True)
    _check_repeats(values, places, first[twins], interface)

    # 3. Put values on the nodes.
    def put(rows: Array) -> Array:
        if finer > 1:
            return _interpolated(places["x"][first], rows[..., first], interface)
        full = np.full((*rows.shape[:-1], interface.size), np.nan)
        full[..., node] = rows[..., first]
        return full.reshape(*rows.shape[:-1], *interface.shape)

    if finer > 1:
        warn_accuracy(
            f"{node.size} points are interpolated linearly to {interface.size} nodes, which are"
            f" {interface.spacing:.3g} m apart"
        )
    # 4. Close gaps.
    whole = np.all(measured) or put(measured * 1.0) > 0.999
    return close_gaps(put(values), whole, interface, gaps)


def turned(given: tuple[int, ...], shape: tuple[int, ...]) -> str:
    """Return a hint for the message about the shape of a plane, if its axes are swapped."""
    if len(shape) == 2 and given == shape[::-1]:
        return ". x and y are swapped: the first axis of a profile is x"
    return ""


def _offset(dim: str, x: Array, interface: Interface, interpolate: bool) -> float | None:
    """Return the common offset of the points from the nodes, in spacings, in (-0.5, 0.5] (step 1).

    The offset is None if the points must be interpolated, for example
    if a line has fewer points than nodes.
    """
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
        if interpolate:
            return None
        advice = "" if interface.is_plane else ", or pass interpolate=True"
        raise InputError(
            f"the {at.size} points of {dim}, from {x.min():.6g} to {x.max():.6g} m, do not coincide"
            f" with the {interface.shape[axis]} nodes {formula}, which are {spacing:.6g} m apart."
            f" Check the unit of {dim}, give values at the nodes (interface.{dim}){advice}"
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


def _interpolated(x: Array, values: Array, interface: Interface) -> Array:
    """Return linear interpolations: constant just beyond free ends, and NaN in gaps (step 3)."""
    length, nodes = interface.measure, interface.x
    margin = TOLERANCE * interface.spacing
    if not interface.is_free:
        x = np.mod(x, length)
    order = np.argsort(x)
    x = x[order]
    typical = float(np.median(np.diff(x))) if x.size > 1 else length
    widest = WIDE * max(typical, interface.spacing)

    def at_nodes(row: Array) -> Array:
        known = np.flatnonzero(~np.isnan(row))
        if known.size == 0:
            raise InputError("has no value at all")
        at, value, around = x[known], row[known], False
        if interface.is_free:
            ends = at[0] - 0.5 * widest, at[-1] + 0.5 * widest
            value = np.r_[value[0], value, value[-1]]
        else:
            ends = at[-1] - length, at[0] + length
            value = np.r_[value[-1], value, value[0]]
            around = known[0] + x.size > known[-1] + 1
        at = np.r_[ends[0], at, ends[1]]
        is_gap = (np.diff(at) > widest) | np.r_[around, np.diff(known) > 1, around]
        interval = np.searchsorted(at, nodes, side="right").clip(1, at.size - 1) - 1
        apart = np.minimum(np.abs(nodes - at[interval]), np.abs(at[interval + 1] - nodes))
        outside = (nodes < ends[0]) | (nodes > ends[1])
        hole = outside | (is_gap[interval] & (apart > margin))
        return np.where(hole, np.nan, np.interp(nodes, at, value))

    return np.apply_along_axis(at_nodes, -1, values[..., order])


def close_gaps(
    values: Array, measured: Any, interface: Interface, gaps: Gaps
) -> tuple[Array, Any]:
    """Refuse, leave or fill NaN. Return values (..., *shape) and a mask (step 4)."""

    missing = np.isnan(values)
    if not missing.any():
        return values, measured
    rows, holes = values.reshape(-1, *interface.shape), missing.reshape(-1, *interface.shape)
    row = int(np.argmax(holes.any(axis=interface.axes)))
    text = (
        f"values are missing (NaN) at {holes[row].sum()} of {interface.size} nodes"
        f"{f' of sample {row}' * (len(rows) > 1)}, the first at"
        f" {interface.describe_node(int(np.argmax(holes[row])))}"
    )
    if gaps == "refuse":
        raise InputError(
            f"{text}. Make interface.length the length of the record, or pass gaps='fill', which"
            " interpolates. RandomField.given(profile) draws equally likely values there instead"
        )
    if gaps == "fill":
        if holes.all(axis=interface.axes).any():
            raise InputError("has no value at all")
        values = np.stack([
            _filled(row, hole, interface) for row, hole in zip(rows, holes, strict=True)
        ]).reshape(values.shape)  # fmt: skip
        doubt = ". Check interface.length and the unit of x" if missing.mean() > 0.5 else ""
        pieces = "triangles" if interface.is_plane else "straight lines"
        warn_accuracy(f"{text}. They are filled with {pieces}{doubt}")
    return values, ~missing & measured


def _filled(row: Array, hole: Mask, interface: Interface) -> Array:
    """Return values (*shape) with gaps filled by linear interpolation.

    Free ends take the nearest value. On a plane, triangles connect the
    nodes around each gap, and the period is repeated on all sides.
    """
    if not hole.any():
        return row
    row = row.copy()
    if not interface.is_plane:
        x, period = interface.x, None if interface.is_free else interface.measure
        row[hole] = np.interp(x[hole], x[~hole], row[~hole], period=period)
        return row
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
    from scipy.ndimage import binary_dilation

    half = [(n // 2, n // 2) for n in interface.shape]
    wide, values = np.pad(hole, half, mode="wrap"), np.pad(row, half, mode="wrap")
    around = np.argwhere(binary_dilation(wide, np.ones((3, 3))) & ~wide)
    at = np.argwhere(hole) + [before for before, _ in half]
    spacings, known = np.array(interface.spacings), values[tuple(around.T)]
    inside = LinearNDInterpolator(around * spacings, known)(at * spacings)
    nearest = NearestNDInterpolator(around * spacings, known)(at * spacings)
    row[hole] = np.where(np.isnan(inside), nearest, inside)
    return row


def with_gaps(problem: Any, result: xr.Dataset, measured: Any) -> xr.Dataset:
    """Add to a result the gaps of its profiles, and mark patches that reach into gaps."""
    interface, position = problem.interface, result["critical_position"]
    if np.all(measured):
        return result
    W, places = (
        problem.friction.uniform_weakening_rate,
        position.values.reshape(-1, len(interface.dims)),
    )
    lengths = interface.spacings if W is None else problem.nucleation_lengths(W)
    near: Any = True
    for axis, (dim, length) in enumerate(zip(interface.dims, interface.lengths, strict=True)):
        apart = interface.coordinates[dim] - places[:, axis, np.newaxis]
        if not interface.is_free:
            apart = np.mod(apart + 0.5 * length, length) - 0.5 * length
        close = np.abs(apart) < (1.0 - 1e-9) * max(
            0.5 * lengths[axis], interface.spacings[axis]
        )
        other_axes = [i for i in range(1, len(interface.dims) + 1) if i != axis + 1]
        near = near & np.expand_dims(close, other_axes)
    in_gap = (near & ~measured).any(axis=interface.axes)
    if in_gap.any():
        first = ", ".join(
            f"{dim} = {at:.6g} m"
            for dim, at in zip(interface.dims, places[int(np.argmax(in_gap))], strict=True)
        )
        warn_accuracy(
            f"the critical patch at {first} reaches into a gap, where strength was interpolated"
            f" ({in_gap.sum()} of {in_gap.size} samples)"
        )
    about = {"units": "1", "long_name": "whether the critical patch reaches into a gap"}
    dims = position.dims[: len(position.dims) - (len(interface.dims) > 1)]
    shape = position.shape[: len(dims)]
    result[IN_GAP] = (dims, in_gap.reshape(shape), about)
    along = ("sample", *interface.dims) if len(measured) > 1 else interface.dims
    known = measured if len(measured) > 1 else measured[0]
    units = {dim: (dim, x, {"units": "m"}) for dim, x in interface.coordinates.items()}
    return result.assign_coords({**units, MEASURED: (along, known)})

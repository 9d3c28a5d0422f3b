"""Values put on the nodes of a line or a plane, and their gaps.

The nodes are x_i = i L/n in each direction, periodically: points may come in any order and begin
anywhere. What is missing stays NaN unless it is filled on request.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.interface import Interface

if TYPE_CHECKING:
    import xarray as xr

Gaps = Literal["refuse", "fill", "skip"]
Mask = NDArray[np.bool_]

TOLERANCE = 0.02
"""Of the spacing of nodes: what rounding in a file may move a point."""
WIDE = 4.0
"""Times the median distance of points: what is wider is no interval but a gap."""
SHOWN = 3
IN_GAP, MEASURED = "in_gap", "measured"
"""Variable of a result; coordinate of results and profiles with gaps, False where none was."""
OF_A_PLANE = (
    "; a map over x and y is read with the plane it belongs to,"
    " interface=st.Interface(length=(Lx, Ly), nodes=(nx, ny))"
)
"""What to do with two dimensions where a line was expected."""


class Points(NamedTuple):
    """Values (..., points) of one quantity in SI, NaN where there is none, and where they belong.

    `places` (m) has an array (points,) for each direction. It is empty if the values come in the
    order of the nodes, (..., *shape). `measured` is False where a gap was filled earlier.
    """

    values: Array
    places: dict[str, Array]
    measured: Any = True


def place(
    points: Points, interface: Interface, interpolate: bool = False, gaps: Gaps = "refuse"
) -> tuple[Array, Any]:
    """Put values on the nodes of an interface, (..., *shape), with a mask of what was measured.

    The mask is False where there was no value, be it filled in or left out; it is True if nothing
    is missing.
    """
    values, places, measured = points
    if not places:
        shape = values.shape[-len(interface.shape) :]
        if shape != interface.shape:
            hint = (
                "; give a value for each node, or the column of x (x=...), with"
                " interpolate=True if points do not lie on the nodes"
            )
            hint = turned(shape, interface.shape) if interface.is_plane else hint
            raise InputError(f"must have shape {interface.shape}, got shape {shape}{hint}")
        return close_gaps(values, measured, interface, gaps)
    if values.size == 0:
        raise InputError("has no values")
    offsets = {dim: _offset(dim, places[dim], interface) for dim in interface.dims}
    between = None in offsets.values()
    if between and not interpolate:
        raise InputError(_elsewhere(points, offsets, interface, gaps))
    # Between the nodes, places differ if they are a millionth of the spacing apart.
    finer = 10**6 if between else 1
    index = []
    for dim, n, length in zip(interface.dims, interface.shape, interface.lengths, strict=True):
        offset = 0.0 if between else offsets[dim] or 0.0
        step = np.round(places[dim] / (length / (finer * n)) - offset)
        index.append(np.mod(step, finer * n).astype(np.int64))
    shape = tuple(finer * n for n in interface.shape)
    node, first, twins = np.unique(
        np.ravel_multi_index(index, shape), return_index=True, return_inverse=True
    )
    _check_repeats(points, first[twins], interface)

    def put(rows: Array) -> Array:
        if between:
            return _interpolated(places["x"][first], rows[..., first], interface)
        full = np.full((*rows.shape[:-1], interface.size), np.nan)
        full[..., node] = rows[..., first]
        return full.reshape(*rows.shape[:-1], *interface.shape)

    if between:
        warn_accuracy(
            f"{node.size} points are interpolated linearly to {interface.size} nodes, which are"
            f" {interface.spacing:.3g} m apart"
        )
    whole = np.all(measured) or put(measured * 1.0) > 0.999
    return close_gaps(put(values), whole, interface, gaps)


def turned(given: tuple[int, ...], shape: tuple[int, ...]) -> str:
    """Return the hint for a message on the shape of a plane if its axes are swapped."""
    if len(shape) == 2 and given == shape[::-1]:
        return "; x and y are swapped: the first axis of a profile is x"
    return ""


def _offset(dim: str, x: Array, interface: Interface) -> float | None:
    """By how many spacings, in (-0.5, 0.5], all points lie beside nodes; None if by no one number.

    A line that is coarser than the nodes is to be interpolated, even if its points are nodes.
    """
    axis = interface.dims.index(dim)
    spacing, length = interface.spacings[axis], interface.lengths[axis]
    if not np.all(np.isfinite(x)):
        raise InputError(f"{dim} must be finite; entry {int(np.argmin(np.isfinite(x)))} is not")
    at = np.unique(x) / spacing
    if at[-1] - at[0] > interface.shape[axis] + TOLERANCE:
        period = np.ptp(x) + np.median(np.diff(np.unique(x)))  # both ends are not one place
        raise InputError(
            f"{dim} reaches from {x.min():g} to {x.max():g} m, the interface is {length:g} m long:"
            f" check the unit of {dim}, crop the record, or make interface.length {period:.6g}"
        )
    if not interface.is_plane and (at.size < 2 or np.median(np.diff(at)) > 1.5):
        return None
    first = at[0] - np.ceil(at[0] - 0.5 - TOLERANCE)
    deviation = at - first - np.round(at - first)
    if np.abs(deviation).max() > TOLERANCE:
        return None
    offset = float(first + deviation.mean())
    if abs(offset) > TOLERANCE:
        warn_accuracy(
            f"{dim} is offset by {offset:.2g} of a spacing from the nodes {dim}_i = i"
            f" L/n, as at the centres of cells: node i stands for {dim}_i"
            f" {offset * spacing:+.4g} m, to be added to positions in the result"
        )
    return offset


def _elsewhere(
    points: Points, offsets: dict[str, float | None], interface: Interface, gaps: Gaps
) -> list[str]:
    """Return the reason why points do not lie on the nodes, with the options of the user."""
    problems = []
    advice = "" if interface.is_plane else ", or interpolate linearly with interpolate=True"
    for dim, n, h in zip(interface.dims, interface.shape, interface.spacings, strict=True):
        if offsets[dim] is None:
            x = np.unique(points.places[dim])
            problems.append(
                f"{dim} does not coincide with the {n} nodes {dim}_i = i L/n, which are"
                f" {h:.6g} m apart: {x.size} points from {x[0]:.6g} to {x[-1]:.6g} m;"
                f" check the unit of {dim}, give values at the nodes, as np.linspace(0,"
                f" L, n, endpoint=False) does{advice}"
            )
    missing = int(np.isnan(points.values).sum())
    if missing and gaps == "refuse":
        problems.append(
            f"{missing} points have no value (NaN); fill such gaps with gaps='fill'"
        )
    return problems


def _check_repeats(points: Points, twins: NDArray[np.int64], interface: Interface) -> None:
    """Refuse two points at one place, unless they have the same value a period apart."""
    periods = dict(zip(points.places, interface.lengths, strict=True))
    for i in np.flatnonzero(twins != np.arange(twins.size)):
        pair = [twins[i], i]
        one, other = np.moveaxis(points.values[..., pair], -1, 0)
        same = np.array_equal(one, other, equal_nan=True)
        apart = max(np.ptp(x[pair]) / periods[dim] for dim, x in points.places.items())
        if apart < 0.5 or not same:
            where = ", ".join(
                f"{dim} = {x[twins[i]]:.9g} and {x[i]:.9g} m"
                for dim, x in points.places.items()
            )
            raise InputError(
                f"{where} are the same position on an interface of period {interface.length}"
                f" m; keep one of the two values{'' if interface.is_plane else OF_A_PLANE}"
            )


def _interpolated(x: Array, values: Array, interface: Interface) -> Array:
    """Linear between points, and NaN in intervals that are gaps."""
    length, nodes = interface.extent, interface.x
    margin = TOLERANCE * interface.spacing
    x = np.mod(x, length)
    order = np.argsort(x)
    x = x[order]
    typical = float(np.median(np.diff(x))) if x.size > 1 else length
    widest = WIDE * max(typical, interface.spacing)

    def at_nodes(row: Array) -> Array:
        known = np.flatnonzero(~np.isnan(row))
        if known.size == 0:
            raise InputError("has no value at all")
        begin = x[known]
        width = np.diff(begin, append=begin[0] + length)
        is_gap = (width > widest) | (np.diff(known, append=known[0] + x.size) > 1)
        interval = np.searchsorted(begin, nodes, side="right") - 1
        into = np.mod(nodes - begin[interval], length)
        inside = (into > margin) & (into < width[interval] - margin)
        found = np.interp(nodes, begin, row[known], period=length)
        return np.where(inside & is_gap[interval], np.nan, found)

    return np.apply_along_axis(at_nodes, -1, values[..., order])


def close_gaps(
    values: Array, measured: Any, interface: Interface, gaps: Gaps
) -> tuple[Array, Any]:
    """Values (..., *shape) with NaN where nothing was measured, refused, left or filled."""
    missing = np.isnan(values)
    if not missing.any():
        return values, measured
    text = describe_gaps(missing, interface)
    how = "smoothly from their rim" if interface.is_plane else "with straight lines"
    if gaps == "refuse":
        raise InputError(
            f"{text}; give them, make interface.length that of the record, or pass gaps='fill'"
            f" to fill them {how}"
        )
    if gaps == "fill":
        filled = values.reshape(-1, *interface.shape).copy()
        for row, hole in zip(filled, missing.reshape(filled.shape), strict=True):
            if hole.any():
                _fill(row, hole, interface.spacings)
        values = filled.reshape(values.shape)
        doubt = "; check interface.length and the unit of x" if missing.mean() > 0.5 else ""
        warn_accuracy(f"{text}; filled {how}{doubt}")
    return values, ~missing & measured


def _fill(values: Array, hole: Mask, spacings: tuple[float, ...]) -> None:
    """Solve Laplace's equation of the nodes in the hole, periodically.

    On a line that is the straight line between its ends; nothing is higher or lower than its rim.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import spsolve

    if hole.all():
        raise InputError("has no value at all")
    known, own = np.where(hole, 0.0, values), np.flatnonzero(hole)
    nodes = np.arange(hole.size).reshape(hole.shape)
    right, columns, entries = np.zeros(own.size), [own], [np.zeros(own.size)]
    for axis, spacing in enumerate(spacings):
        weight = (min(spacings) / spacing) ** 2
        for step in (1, -1):
            right += weight * np.roll(known, step, axis)[hole]
            columns.append(np.roll(nodes, step, axis)[hole])
            entries.append(np.full(own.size, -weight))
            entries[0] += weight
    rows = np.tile(np.arange(own.size), len(columns))
    index = (rows, np.concatenate(columns))
    matrix = csr_array((np.concatenate(entries), index), shape=(own.size, hole.size))
    values[hole] = spsolve(matrix.tocsc()[:, own], right)


def describe_gaps(missing: Mask, interface: Interface) -> str:
    """Return 'values are missing (NaN) at x = 0.0112 to 0.0141 m (29 of 1024 nodes)'."""
    maps = missing.reshape(-1, *interface.shape)
    row = int(np.argmax(maps.reshape(len(maps), -1).any(axis=1)))
    count = f"{maps[row].sum()} of {interface.size} nodes"
    if len(maps) > 1:
        count += f" of sample {row}"
    if interface.is_plane:
        place = interface.describe_node(int(np.argmax(maps[row])))
        return f"values are missing (NaN) at {count}, the first at {place}"
    first = np.flatnonzero(maps[row] & ~np.roll(maps[row], 1))
    last = np.flatnonzero(maps[row] & ~np.roll(maps[row], -1))
    if maps[row].all():
        first, last = np.array([0]), np.array([-1])
    elif last[0] < first[0]:  # a gap begins before x = 0 and ends behind it
        last = np.roll(last, -1)
    ends = zip(interface.x[first][:SHOWN], interface.x[last][:SHOWN], strict=True)
    at = ", ".join(f"{a:.6g} m" if a == b else f"{a:.6g} to {b:.6g} m" for a, b in ends)
    more = f" and {first.size - SHOWN} more gaps" if first.size > SHOWN else ""
    return f"values are missing (NaN) at x = {at}{more} ({count})"


def with_gaps(problem: Any, result: xr.Dataset, measured: Any) -> xr.Dataset:
    """Return a result with the gaps of its profiles, and a mark of onsets that lie in one."""
    if np.all(measured):
        return result
    interface = problem.interface
    position = result["critical_position"]
    places = np.reshape(position.values, (-1, len(interface.shape)))
    inside = _missing_near(interface, places, measured, interface.spacings)
    rate = problem.uniform_rate
    patch = interface.spacings if rate is None else problem.nucleation_lengths(rate)
    near = _missing_near(interface, places, measured, [0.5 * h for h in patch]) & ~inside
    for where, what in ((inside, "the onset"), (near, "the critical patch")):
        if where.any():
            first = zip(interface.dims, places[int(np.argmax(where))], strict=True)
            at = ", ".join(f"{dim} = {place:.6g} m" for dim, place in first)
            verb = "lies in" if where is inside else "reaches into"
            warn_accuracy(
                f"{what} at {at} {verb} a gap of the profile ({where.sum()} of {where.size}"
                " samples): the strength there was filled in, not measured"
            )
    dims = tuple(dim for dim in position.dims if dim != "direction")
    attributes = {"units": "1", "long_name": "whether the onset lies in a gap of the profile"}
    result[IN_GAP] = (dims, inside.reshape([position.sizes[dim] for dim in dims]), attributes)
    one = measured.shape[0] == 1
    along = interface.dims if one else ("sample", *interface.dims)
    nodes = {dim: (dim, at, {"units": "m"}) for dim, at in interface.coordinates.items()}
    mask = {MEASURED: (along, measured[0] if one else measured)}
    return result.assign_coords(nodes | mask)


def _missing_near(interface: Any, places: Any, measured: Mask, reach: Sequence[float]) -> Mask:
    """Whether nodes nearer than `reach` (m, in each direction) to places (k, D) are missing."""
    found = np.zeros(len(places), dtype=np.bool_)
    maps = np.broadcast_to(measured, (len(places), *interface.shape))
    for i in np.flatnonzero(np.isfinite(places).all(axis=1)):
        near = []
        for place, length, nodes, most in zip(
            places[i], interface.lengths, interface.coordinates.values(), reach, strict=True
        ):
            apart = np.abs(np.mod(nodes - place + 0.5 * length, length) - 0.5 * length)
            near.append(apart < (1.0 - 1e-9) * most)
        found[i] = not maps[i][np.ix_(*near)].all()
    return found

"""Values put on the nodes of a line or a plane, and their gaps.

The nodes are x_i = i L/n in each direction, periodically: points may come in any order and begin
anywhere. What is missing stays NaN until somebody asks for it to be filled.
"""

from __future__ import annotations

import json
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
IN_GAP, GAPS = "in_gap", "gaps"
"""Variable and attribute of a result."""
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
    measured: Mask | None = None


def place(
    points: Points, interface: Interface, interpolate: bool = False, gaps: Gaps = "refuse"
) -> tuple[Array, Mask | None]:
    """Put values on the nodes of an interface, (..., *shape), and say which were measured.

    The mask is False where there was no value, be it filled in or left out; it is None if nothing
    is missing.
    """
    values, places, measured = points
    if not places:
        shape = values.shape[-len(interface.shape) :]
        if shape != interface.shape:
            raise InputError(_other_shape(shape, interface))
        return close_gaps(values, measured, interface, gaps)
    if values.size == 0:
        raise InputError("has no values")
    offsets = [_offset(dim, places[dim], interface) for dim in interface.dims]
    between = None in offsets
    if between and not interpolate:
        raise InputError(_elsewhere(points, offsets, interface, gaps))
    # Between the nodes, places differ if they are a millionth of the spacing apart.
    shape = tuple(10**6 * n for n in interface.shape) if between else interface.shape
    index = []
    for dim, n, length, offset in zip(
        interface.dims, shape, interface.lengths, offsets, strict=True
    ):
        step = np.round(
            places[dim] / (length / n) - (offset if offset and not between else 0.0)
        )
        index.append(np.mod(step, n).astype(np.int64))
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
    if measured is not None:
        measured = put(measured * 1.0) > 0.999
    return close_gaps(put(values), measured, interface, gaps)


def turned(given: tuple[int, ...], shape: tuple[int, ...]) -> str:
    """What to say of a shape of a plane if its axes have changed places."""
    if len(shape) == 2 and given == shape[::-1]:
        return "; x and y have changed places: the first axis of a profile is x"
    return ""


def _other_shape(shape: tuple[int, ...], interface: Interface) -> str:
    if interface.is_plane:
        hint = turned(shape, interface.shape)
        return f"must have shape {interface.shape}, got shape {shape}{hint}"
    return (
        f"has {shape[-1] if shape else 1} values, the interface has {interface.size} nodes; give a"
        " value for each node, or x beside the values (x=... names its column), with"
        " interpolate=True where points lie elsewhere than the nodes"
    )


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
        raise InputError(
            f"{dim} reaches from {x.min():g} to {x.max():g} m, the interface is {length:g} m long:"
            f" check the unit of {dim}, crop the record, or make interface.length {np.ptp(x):.6g}"
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
            f"{dim} lies {offset:.2g} of a spacing beside the nodes {dim}_i = i L/n, as at the"
            f" centres of cells: node i stands for {dim}_i {offset * spacing:+.4g} m, to be"
            " added to positions in the result"
        )
    return offset


def _elsewhere(
    points: Points, offsets: list[float | None], interface: Interface, gaps: Gaps
) -> list[str]:
    """Why points cannot be put on the nodes as they are, and all that is to be decided."""
    problems = []
    advice = "" if interface.is_plane else ", or interpolate linearly with interpolate=True"
    for dim, n, h, offset in zip(
        interface.dims, interface.shape, interface.spacings, offsets, strict=True
    ):
        if offset is None:
            x = np.unique(points.places[dim])
            step = np.ptp(x) / max(x.size - 1, 1)
            problems.append(
                f"{dim} lies elsewhere than the {n} nodes {dim}_i = i L/n, which are {h:.6g} m"
                f" apart: {x.size} points from {x[0]:.6g} to {x[-1]:.6g} m, {step:.6g} m apart;"
                f" check the unit of {dim}, give values at the nodes, as np.linspace(0, L, n,"
                f" endpoint=False) does{advice}"
            )
    missing = int(np.isnan(points.values).sum())
    if missing and gaps == "refuse":
        problems.append(
            f"{missing} points have no value (NaN); fill such gaps with gaps='fill'"
        )
    return problems


def _check_repeats(points: Points, twins: NDArray[np.int64], interface: Interface) -> None:
    """Refuse two points at one place, unless they have the same value a period apart."""
    places = list(points.places.items())
    for i in np.flatnonzero(twins != np.arange(twins.size)):
        pair = [twins[i], i]
        one, other = np.moveaxis(points.values[..., pair], -1, 0)
        periods = zip(interface.lengths, places, strict=True)
        apart = max(np.ptp(x[pair]) / length for length, (_, x) in periods)
        if apart < 0.5 or not np.array_equal(one, other, equal_nan=True):
            where = [f"{dim} = {x[twins[i]]:.9g} and {x[i]:.9g} m" for dim, x in places]
            raise InputError(
                f"{', '.join(where)} are one place of an interface with the period"
                f" {interface.length} m; keep one of the two values"
                + OF_A_PLANE
                * (not interface.is_plane)
            )


def _interpolated(x: Array, values: Array, interface: Interface) -> Array:
    """Linear between points, and NaN in intervals that are gaps."""
    length, nodes = interface.extent, interface.x
    margin = TOLERANCE * interface.spacing
    x = np.mod(x, length)
    order = np.argsort(x)
    x, rows = x[order], values.reshape(-1, x.size)[:, order]
    typical = float(np.median(np.diff(x))) if x.size > 1 else length
    widest = WIDE * max(typical, interface.spacing)
    found = np.empty((rows.shape[0], nodes.size))
    for row, target in zip(rows, found, strict=True):
        known = np.flatnonzero(~np.isnan(row))
        if known.size == 0:
            raise InputError("has no value at all")
        begin = x[known]
        width = np.diff(begin, append=begin[0] + length)
        is_gap = (width > widest) | (np.diff(known, append=known[0] + x.size) > 1)
        interval = np.searchsorted(begin, nodes, side="right") - 1
        into = np.mod(nodes - begin[interval], length)
        inside = (into > margin) & (into < width[interval] - margin)
        target[:] = np.interp(nodes, begin, row[known], period=length)
        target[inside & is_gap[interval]] = np.nan
    return found.reshape(*values.shape[:-1], nodes.size)


def close_gaps(
    values: Array, measured: Mask | None, interface: Interface, gaps: Gaps
) -> tuple[Array, Mask | None]:
    """Values (..., *shape) with NaN where nothing was measured, refused, left or filled."""
    missing = np.isnan(values)
    if not missing.any():
        return values, measured
    text = describe_gaps(missing, interface)
    how = "smoothly from around them" if interface.is_plane else "with straight lines"
    if gaps == "refuse":
        raise InputError(
            f"must be finite: there {text}; give what was measured, make interface.length that of"
            f" the record, or fill gaps {how}, which the result then remembers: gaps='fill'"
        )
    whole = ~missing if measured is None else ~missing & measured
    if gaps == "skip":
        return values, whole
    filled = values.reshape(-1, *interface.shape).copy()
    for one, hole in zip(filled, missing.reshape(filled.shape), strict=True):
        if hole.all():
            raise InputError("has no value at all")
        if hole.any():
            _fill(one, hole, interface.spacings)
    warn_accuracy(f"there {text}; filled {how}")
    return filled.reshape(values.shape), whole


def _fill(values: Array, hole: Mask, spacings: tuple[float, ...]) -> None:
    """Solve Laplace's equation of the nodes in the hole, periodically.

    On a line that is the straight line between its ends; nothing is higher or lower than its rim.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import spsolve

    number = np.full(hole.shape, -1)
    number[hole] = np.arange(hole.sum())
    places = np.nonzero(hole)
    own = number[places]
    rows, columns, entries = [own], [own], [np.zeros(own.size)]
    right = np.zeros(own.size)
    for axis, spacing in enumerate(spacings):
        weight = (min(spacings) / spacing) ** 2
        for step in (-1, 1):
            beside = list(places)
            beside[axis] = (places[axis] + step) % hole.shape[axis]
            there = number[tuple(beside)]
            known = there < 0
            entries[0] += weight
            right[known] += weight * values[tuple(beside)][known]
            rows.append(own[~known])
            columns.append(there[~known])
            entries.append(np.full(int((~known).sum()), -weight))
    index = (np.concatenate(rows), np.concatenate(columns))
    matrix = csr_array((np.concatenate(entries), index), shape=(own.size, own.size))
    values[hole] = spsolve(matrix.tocsc(), right)


def gaps_of(missing: Mask, interface: Interface) -> list[tuple[float, float]]:
    """Return where nodes of a line lack a value: first and last, m; first > last across x = 0."""
    if missing.all():
        return [(0.0, float(interface.x[-1]))]
    starts = np.flatnonzero(missing & ~np.roll(missing, 1))
    ends = np.flatnonzero(missing & ~np.roll(missing, -1))
    if ends.size and ends[0] < starts[0]:  # one begins before x = 0 and ends behind it
        ends = np.roll(ends, -1)
    x = interface.x
    return [(float(x[a]), float(x[b])) for a, b in zip(starts, ends, strict=True)]


def describe_gaps(missing: Mask, interface: Interface) -> str:
    """Say 'are no values (NaN) at x = 0.0112 to 0.0141 m (29 of 1024 nodes)'."""
    maps = missing.reshape(-1, *interface.shape)
    gaps = maps.reshape(len(maps), -1).sum(axis=1)
    row = int(np.argmax(gaps > 0))
    count = f"{gaps[row]} of {interface.size} nodes"
    if len(maps) > 1:
        count += f" of sample {row}; {(gaps > 0).sum()} of {len(maps)} samples have gaps"
    if interface.is_plane:
        first = interface.describe_node(int(np.argmax(maps[row])))
        return f"are no values (NaN) at {count}, the first at {first}"
    spans = gaps_of(maps[row], interface)
    at = ", ".join(
        f"{a:.6g} m" if a == b else f"{a:.6g} to {b:.6g} m" for a, b in spans[:SHOWN]
    )
    more = f" and {len(spans) - SHOWN} more gaps" if len(spans) > SHOWN else ""
    return f"are no values (NaN) at x = {at}{more} ({count})"


def with_gaps(problem: Any, result: xr.Dataset, measured: Mask | None) -> xr.Dataset:
    """Return a result that says where its profiles have gaps, and which onsets lie in one."""
    if measured is None:
        return result
    interface = problem.interface
    position = result["critical_position"]
    places = np.reshape(position.values, (-1, len(interface.shape)))
    inside = _missing_near(interface, places, measured, interface.spacings)
    rate = problem.uniform_rate
    patch = interface.spacings if rate is None else problem.nucleation_lengths(rate)
    near = _missing_near(interface, places, measured, [0.5 * h for h in patch]) & ~inside
    for where, what in (
        (inside, "the onset at {} lies in"),
        (near, "the critical patch at {} reaches into"),
    ):
        if where.any():
            first = places[int(np.argmax(where))]
            at = ", ".join(
                f"{d} = {v:.6g} m" for d, v in zip(interface.dims, first, strict=True)
            )
            warn_accuracy(
                f"{what.format(at)} a gap of the profile ({where.sum()} of {where.size} samples):"
                " the strength there was filled in, not measured"
            )
    dims = tuple(dim for dim in position.dims if dim != "direction")
    attributes = {"units": "1", "long_name": "whether the onset lies in a gap of the profile"}
    result[IN_GAP] = (dims, inside.reshape([position.sizes[dim] for dim in dims]), attributes)
    if not interface.is_plane and np.all(measured == measured[:1]):
        result.attrs[GAPS] = json.dumps(gaps_of(~measured[0], interface))
    return result


def _missing_near(interface: Any, places: Any, measured: Mask, reach: Sequence[float]) -> Mask:
    """Whether nodes nearer than `reach` (m, in each direction) to places (k, D) are missing."""
    found = np.zeros(len(places), dtype=np.bool_)
    maps = np.broadcast_to(measured, (len(places), *interface.shape))
    for i in np.flatnonzero(np.isfinite(places).all(axis=1)):
        missing = ~maps[i]
        for axis, nodes in enumerate(interface.coordinates.values()):
            length = interface.lengths[axis]
            apart = np.abs(
                np.mod(nodes - places[i, axis] + 0.5 * length, length) - 0.5 * length
            )
            missing = np.compress(apart < (1.0 - 1e-9) * reach[axis], missing, axis=axis)
        found[i] = missing.any()
    return found


def stored_gaps(result: xr.Dataset) -> list[tuple[float, float]]:
    """Return the gaps that all profiles have: first and last node without a value, m."""
    return [(float(a), float(b)) for a, b in json.loads(result.attrs.get(GAPS, "[]"))]

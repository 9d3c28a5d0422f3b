"""From points to nodes: coordinates decide where a value belongs, and no gap is closed unseen.

All of it is the same on a line and on a plane. The nodes are x_i = i L/n in each direction,
periodically: points may come in any order and begin anywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.interface import Interface

Gaps = Literal["refuse", "fill", "skip"]

TOLERANCE = 0.02
"""Of the spacing of nodes: what rounding in a file may move a point."""
WIDE = 4.0
"""Times the median distance of points: what is wider is no interval but a gap."""
SHOWN = 3


class Points(NamedTuple):
    """Values of one quantity in SI, and where they belong.

    Attributes
    ----------
    values : (..., points) array
        Or (..., *shape) in the order of the nodes.
    places : dict of (points,) arrays
        m, along each direction; empty if the values come in the order of the nodes.
    measured : array of bool or None
        Of the shape of `values`; False where a gap was filled earlier.
    """

    values: Array
    places: dict[str, Array]
    measured: NDArray[np.bool_] | None = None


class AtNodes(NamedTuple):
    """Values at the nodes.

    Attributes
    ----------
    values : (..., *shape) array
    measured : (..., *shape) array of bool or None
        False where there was no value, be it filled in or left out; None if nothing is missing.
    """

    values: Array
    measured: NDArray[np.bool_] | None


def place(
    points: Points, interface: Interface, *, interpolate: bool = False, gaps: Gaps = "refuse"
) -> AtNodes:
    """Put values on the nodes of an interface.

    Parameters
    ----------
    points : Points
        NaN where there is no value.
    interface : Interface
    interpolate : bool
        Whether points of a line may lie elsewhere than the nodes; then linearly and periodically.
    gaps : {"refuse", "fill", "skip"}

    Raises
    ------
    InputError
        If points repeat, reach beyond a period or lie elsewhere than the nodes, or values are
        missing and may not be filled in.
    """
    values, measured = points.values, points.measured
    if not points.places:
        shape = values.shape[-len(interface.shape) :]
        if shape != interface.shape:
            raise InputError(_other_shape(shape, interface))
        return close_gaps(values, measured, interface, gaps)
    if values.size == 0:
        raise InputError("has no values")
    problems: list[str] = []
    put = _put(points.places, values, interface, interpolate, problems)
    if problems and np.isnan(values).any() and gaps == "refuse":
        problems.append(
            f"{int(np.isnan(values).sum())} of {values.size} points have no value (NaN); fill such"
            " gaps with gaps='fill'"
        )
    if problems:
        raise InputError(problems)
    if measured is not None:
        measured = put(measured * 1.0) > 0.999
    return close_gaps(put(values), measured, interface, gaps)


def _other_shape(shape: tuple[int, ...], interface: Interface) -> str:
    if interface.is_plane:
        turned = shape == interface.shape[::-1] != interface.shape
        hint = "; x and y have changed places: the first axis of a profile is x" * turned
        return f"must have shape {interface.shape}, got shape {shape}{hint}"
    return (
        f"has {shape[-1] if shape else 1} values, the interface has {interface.size} nodes"
        " (interface.size); give a value for each node, or x beside the values (x=... names its"
        " column), with interpolate=True where points lie elsewhere than the nodes"
    )


def _put(
    places: dict[str, Array], values: Array, interface: Interface, interpolate: bool,
    problems: list[str],
) -> Callable[[Array], Array]:  # fmt: skip
    """A function that puts values (..., points) on the nodes, NaN where there are none."""
    kept: Any = slice(None)
    at = []
    for axis, dim in enumerate(interface.dims):
        n, spacing, length = (
            interface.shape[axis],
            interface.spacings[axis],
            interface.lengths[axis],
        )
        x, which = np.unique(places[dim], return_inverse=True)
        if not np.all(np.isfinite(x)):
            entry = int(np.argmin(np.isfinite(places[dim])))
            raise InputError(f"{dim} must be finite; entry {entry} is not")
        if x[-1] - x[0] > length + TOLERANCE * spacing:
            raise InputError(_too_long(dim, x, length))
        if abs(x[-1] - x[0] - length) <= TOLERANCE * spacing:
            kept = _without_closing_points(dim, which, x, values, interface)
        again = np.flatnonzero(np.diff(x) <= 1e-6 * spacing)
        if again.size or (len(places) == 1 and x.size < which.size):
            first = int(again[0]) if again.size else int(np.argmax(np.bincount(which) > 1))
            last = min(first + 1, x.size - 1) if again.size else first
            raise InputError(f"{dim} repeats: {x[first]:.9g} and {x[last]:.9g} m are one place")
        offset = _offset(x, n, spacing, length, coarse=interface.is_plane)
        if offset is None and not interpolate:
            problems.append(_elsewhere(dim, x, n, spacing))
            continue
        if offset is None:
            return lambda rows: _interpolated(places[dim][kept], rows[..., kept], interface)
        if abs(offset) > TOLERANCE:
            warn_accuracy(
                f"{dim} lies {offset:.2g} of a spacing beside the nodes {dim}_i = i L/n, as at the"
                f" centres of cells: node i stands for {dim}_i {offset * spacing:+.4g} m, to be"
                " added to positions in the result"
            )
        at.append(np.round(x / spacing - offset).astype(np.int64)[which] % n)
    if problems:
        return lambda rows: rows
    flat = np.ravel_multi_index([index[kept] for index in at], interface.shape)
    if np.unique(flat).size < flat.size:
        raise InputError(f"{' and '.join(interface.dims)} repeat: two points lie at one node")

    def put(rows: Array) -> Array:
        full = np.full((*rows.shape[:-1], interface.size), np.nan)
        full[..., flat] = rows[..., kept]
        return full.reshape(*rows.shape[:-1], *interface.shape)

    return put


def _too_long(dim: str, x: Array, length: float) -> str:
    hint = (
        f"crop the record, as profile.sel({dim}=slice(0, ...)) does, or make interface.length"
        f" {float(x[-1] - x[0]):.6g} m"
    )
    for unit, factor in (("mm", 1e-3), ("um", 1e-6)):
        if 0.3 * length < factor * (x[-1] - x[0]) <= 1.001 * length:
            hint = f"if x is in {unit}, say so: units of x in the file, or x_unit={unit!r}"
    return (
        f"{dim} reaches from {x[0]:g} to {x[-1]:g} m, the interface is {length:g} m long"
        f" (interface.extent); {hint}"
    )


def _without_closing_points(
    dim: str, which: NDArray[np.int64], x: Array, values: Array, interface: Interface
) -> NDArray[np.bool_]:
    """All points but the last, which are the first ones again, a period later."""
    first, last = which == 0, which == x.size - 1
    if not np.array_equal(values[..., first], values[..., last], equal_nan=True):
        raise InputError(
            f"{dim} = {x[0]:g} and {x[-1]:g} m are one place of an interface with the period"
            f" {interface.length} m (interface.extent), with two values; leave out one end, as"
            " np.linspace(0, L, n, endpoint=False) does"
        )
    return ~last


def _offset(x: Array, n: int, spacing: float, length: float, *, coarse: bool) -> float | None:
    """By how many spacings, in (-0.5, 0.5], all points lie beside nodes; None if by no one number.

    On a line, a grid that is coarser than the nodes does not count, even if its points are nodes.
    """
    if abs(x[-1] - x[0] - length) <= TOLERANCE * spacing:
        x = x[:-1]
    at = x / spacing
    if at.size < 2 or (not coarse and np.median(np.diff(at)) > 1.5):
        return 0.0 if coarse and abs(at[0] - round(at[0])) <= TOLERANCE else None
    first = at[0] - np.ceil(at[0] - 0.5 - TOLERANCE)
    deviation = at - first - np.round(at - first)
    return float(first + deviation.mean()) if np.abs(deviation).max() <= TOLERANCE else None


def _elsewhere(dim: str, x: Array, n: int, spacing: float) -> str:
    step = float(np.median(np.diff(x))) if x.size > 1 else 0.0
    fit = f", or interface.length = {x.size * step:.6g}" if x.size == n else ""
    hint = ""
    for unit, factor in (("mm", 1e-3), ("um", 1e-6), ("km", 1e3)):
        if abs(factor * step / spacing - 1.0) < 1e-3:
            hint = f"; if x is in {unit}, say so: units of x in the file, or x_unit={unit!r}"
    return (
        f"{dim} lies elsewhere than the {n} nodes {dim}_i = i L/n: {x.size} points from"
        f" {x[0]:.6g} to {x[-1]:.6g} m, {step:.6g} m apart, the nodes {spacing:.6g} m"
        f" (interface.extent / interface.size); give values at the nodes{fit}, or ask for linear"
        f" interpolation with interpolate=True{hint}"
    )


def _interpolated(x: Array, values: Array, interface: Interface) -> Array:
    """Linear between points, and NaN in intervals that are gaps."""
    length, nodes = interface.extent, interface.x
    order = np.argsort(x, kind="stable")
    x, rows = x[order], values.reshape(-1, x.size)[:, order]
    found = np.empty((rows.shape[0], nodes.size))
    typical = float(np.median(np.diff(x))) if x.size > 1 else length
    widest = 0.0
    for row, target in zip(rows, found, strict=True):
        known = np.flatnonzero(~np.isnan(row))
        if known.size == 0:
            raise InputError("has no value at all")
        begin = x[known]
        target[:] = np.interp(nodes, begin, row[known], period=length)
        end = np.append(begin[1:], begin[0] + length)
        left_out = np.append(np.diff(known) > 1, known[-1] - known[0] < x.size - 1)
        wide = (end - begin > WIDE * max(typical, interface.spacing)) | left_out
        widest = max(widest, float(np.max((end - begin)[~wide], initial=0.0)))
        margin = TOLERANCE * interface.spacing
        for a, b in zip(begin[wide], end[wide], strict=True):
            into = np.mod(nodes - a, length)
            target[(into > margin) & (into < b - a - margin)] = np.nan
    warn_accuracy(
        f"{x.size} points are interpolated linearly to {nodes.size} nodes; the widest distance"
        f" between them is {widest:.3g} m, {widest / interface.spacing:.3g} times the spacing of"
        " nodes"
    )
    return found.reshape(*values.shape[:-1], nodes.size)


def close_gaps(
    values: Array, measured: NDArray[np.bool_] | None, interface: Interface, gaps: Gaps
) -> AtNodes:
    """Values (..., *shape) with NaN where nothing was measured, refused, left or filled."""
    missing = np.isnan(values)
    if not missing.any():
        return AtNodes(values, measured)
    text = describe_gaps(missing, interface)
    how = "smoothly from around them" if interface.is_plane else "with straight lines"
    if gaps == "refuse":
        raise InputError(
            f"must be finite: there {text}; give what was measured, or fill gaps {how}, which the"
            f" result then remembers: gaps='fill'{_much_missing(missing, interface)}"
        )
    whole = ~missing if measured is None else ~missing & measured
    if gaps == "skip":
        return AtNodes(values, whole)
    filled = values.reshape(-1, *interface.shape).copy()
    for one, hole in zip(filled, missing.reshape(filled.shape), strict=True):
        if hole.all():
            raise InputError("has no value at all")
        if hole.any():
            _fill(one, hole, interface.spacings)
    warn_accuracy(f"there {text}; filled {how}")
    return AtNodes(filled.reshape(values.shape), whole)


def _much_missing(missing: NDArray[np.bool_], interface: Interface) -> str:
    """What to do where a record is much shorter than the interface."""
    if interface.is_plane or missing.ndim > 1:
        return ""
    gap = max((b - a) % interface.extent for a, b in gaps_of(missing, interface))
    if gap < 0.25 * interface.extent:
        return ""
    length = interface.extent - gap - interface.spacing
    return (
        f". The record covers {length:.4g} m of the interface; if it holds no more, make"
        f" interface.length {length:.6g}"
    )


def _fill(values: Array, hole: NDArray[np.bool_], spacings: tuple[float, ...]) -> None:
    """Solve Laplace's equation of the nodes in the hole, periodically.

    The measured nodes around it are its rim: on a line that is the straight line between the ends,
    and nothing in it is higher or lower than its rim.
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


def gaps_of(missing: NDArray[np.bool_], interface: Interface) -> list[tuple[float, float]]:
    """Return where nodes of a line lack a value: first and last, m; first > last across x = 0."""
    if missing.all():
        return [(0.0, float(interface.x[-1]))]
    starts = np.flatnonzero(missing & ~np.roll(missing, 1))
    ends = np.flatnonzero(missing & ~np.roll(missing, -1))
    if ends.size and ends[0] < starts[0]:  # one begins before x = 0 and ends behind it
        ends = np.roll(ends, -1)
    x = interface.x
    return [(float(x[a]), float(x[b])) for a, b in zip(starts, ends, strict=True)]


def describe_gaps(missing: NDArray[np.bool_], interface: Interface) -> str:
    """Say 'are no values (NaN) at x = 0.0112 to 0.0141 m (29 of 1024 nodes)'."""
    maps = missing.reshape(-1, *interface.shape)
    with_gaps = maps.reshape(len(maps), -1).any(axis=1)
    row = int(np.argmax(with_gaps))
    count = f"{int(maps[row].sum())} of {interface.size} nodes"
    which = f" in sample {row}" if len(maps) > 1 else ""
    others = int(with_gaps.sum()) - 1
    which += f", and in {others} more samples" if others else ""
    if interface.is_plane:
        first = interface.describe_node(int(np.argmax(maps[row])))
        return f"are no values (NaN) at {count}, the first at {first}{which}"
    spans = gaps_of(maps[row], interface)
    at = ", ".join(f"{a:.6g} m" if a == b else f"{a:.6g} to {b:.6g} m" for a, b in spans[:SHOWN])
    more = f" and {len(spans) - SHOWN} more gaps" if len(spans) > SHOWN else ""
    return f"are no values (NaN) at x = {at}{more} ({count}{which})"

"""From points to nodes: coordinates decide where a value belongs, and gaps are never closed unseen.

The nodes are x_i = i L/n on a circle of length L. Points may come in any order and begin anywhere;
they are taken modulo L.
"""

from __future__ import annotations

import dataclasses
from typing import Any, Literal, NamedTuple, get_args

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


class AtNodes(NamedTuple):
    """Values at the nodes.

    Attributes
    ----------
    values : (..., nodes) array
    measured : (..., nodes) array of bool or None
        False where there was no value, be it filled in or left out; None if nothing is missing.
    """

    values: Array
    measured: NDArray[np.bool_] | None


def check_gaps(gaps: object) -> None:
    """Refuse what is no way to deal with gaps."""
    if gaps not in get_args(Gaps):
        raise InputError(f"gaps: must be 'refuse', 'fill' or 'skip', got {gaps!r}")


def in_order(values: Array, interface: Interface, gaps: Gaps) -> AtNodes:
    """Values (..., n) that come without coordinates: one for each node, in the order of nodes."""
    if values.shape[-1:] != (interface.size,):
        raise InputError(
            f"has {values.shape[-1] if values.ndim else 1} values, the interface has"
            f" {interface.size} nodes (interface.size); give a value for each node, or x beside"
            " the values"
        )
    return _filled(values, interface, gaps)


def by_coordinate(
    x: Array, values: Array, interface: Interface, *, interpolate: bool, gaps: Gaps
) -> AtNodes:
    """Values (..., points) at the points x (m), put on the nodes.

    Parameters
    ----------
    x : (points,) array
    values : (..., points) array
        NaN where there is no value.
    interface : Interface
    interpolate : bool
        Whether points may lie elsewhere than the nodes; then linearly and periodically.
    gaps : {"refuse", "fill"}

    Raises
    ------
    InputError
        If points repeat, reach beyond a period or lie elsewhere than the nodes, or values are
        missing and may not be filled in.
    """
    if not np.all(np.isfinite(x)):
        raise InputError(f"x must be finite; entry {int(np.argmin(np.isfinite(x)))} is not")
    if x.size == 0:
        raise InputError("has no values")
    order = np.argsort(x, kind="stable")
    x, values = x[order], values[..., order]
    length, spacing = interface.extent, interface.spacing
    if x[-1] - x[0] > length + TOLERANCE * spacing:
        raise InputError(
            f"x reaches from {x[0]:g} to {x[-1]:g} m, the interface is {length:g} m long"
            f" (interface.extent){_hint_of_millimetres(x, length)}"
        )
    x, values = _without_closing_point(x, values, interface)
    steps = np.diff(x)
    if steps.size and steps.min() <= 1e-6 * spacing:
        again = int(np.argmin(steps))
        raise InputError(f"x repeats: {x[again]:.9g} and {x[again + 1]:.9g} m are one place")
    offset = _offset(x, interface)
    if offset is None:
        if not interpolate:
            raise InputError(_elsewhere(x, interface))
        return _interpolated(x, values, interface, gaps)
    if abs(offset) > TOLERANCE:
        warn_accuracy(
            f"x lies {offset:.2g} of a spacing beside the nodes x_i = i L/n, as at the centres of"
            f" cells: node i stands for x_i {offset * spacing:+.4g} m, to be added to positions in"
            " the result"
        )
    index = np.round(x / spacing - offset).astype(np.int64) % interface.size
    if np.unique(index).size < index.size:
        raise InputError("x repeats: two points lie at one node")
    full = np.full((*values.shape[:-1], interface.size), np.nan)
    full[..., index] = values
    return _filled(full, interface, gaps)


def _hint_of_millimetres(x: Array, length: float) -> str:
    for unit, factor in (("mm", 1e-3), ("um", 1e-6)):
        if 0.3 * length < factor * (x[-1] - x[0]) <= 1.001 * length:
            return f"; if x is in {unit}, say so: units of x in the file, or x_unit={unit!r}"
    return ""


def _without_closing_point(x: Array, values: Array, interface: Interface) -> tuple[Array, Array]:
    """Without a last point that is the first one again, a period later."""
    if abs(x[-1] - x[0] - interface.extent) > TOLERANCE * interface.spacing:
        return x, values
    if not np.array_equal(values[..., 0], values[..., -1], equal_nan=True):
        raise InputError(
            f"x = {x[0]:g} and {x[-1]:g} m are one place of an interface with the period"
            f" {interface.length:g} m (interface.extent), with two values;"
            " leave out one end, as np.linspace(0, L, n, endpoint=False) does"
        )
    return x[:-1], values[..., :-1]


def _offset(x: Array, interface: Interface) -> float | None:
    """By how many spacings, in (-0.5, 0.5], all points lie beside nodes; None if by no one number.

    A grid that is coarser than the nodes does not count, even where its points are nodes.
    """
    place = x / interface.spacing
    steps = np.diff(place)
    if steps.size == 0 or np.median(steps) > 1.5:
        return None
    first = place[0] - np.ceil(place[0] - 0.5 - TOLERANCE)
    deviation = place - first - np.round(place - first)
    if np.abs(deviation).max() > TOLERANCE:
        return None
    return float(first + deviation.mean())


def _elsewhere(x: Array, interface: Interface) -> str:
    step = float(np.median(np.diff(x))) if x.size > 1 else 0.0
    fit = f", or interface.length = {x.size * step:.6g}" if x.size == interface.size else ""
    return (
        f"x lies elsewhere than the {interface.size} nodes x_i = i L/n: {x.size} points from"
        f" {x[0]:.6g} to {x[-1]:.6g} m, {step:.6g} m apart, the nodes {interface.spacing:.6g} m"
        f" (interface.extent / interface.size); give values at the nodes{fit}, or ask for linear"
        f" interpolation (interpolate=True, --interpolate){_hint_of_units(step, interface)}"
    )


def _hint_of_units(step: float, interface: Interface) -> str:
    for unit, factor in (("mm", 1e-3), ("um", 1e-6), ("km", 1e3)):
        if abs(factor * step / interface.spacing - 1.0) < 1e-3:
            return f"; if x is in {unit}, say so: units of x in the file, or x_unit={unit!r}"
    return ""


def _interpolated(x: Array, values: Array, interface: Interface, gaps: Gaps) -> AtNodes:
    length, nodes = interface.extent, interface.x
    rows = values.reshape(-1, x.size)
    found = np.empty((rows.shape[0], nodes.size))
    typical = float(np.median(np.diff(x))) if x.size > 1 else length
    widest = 0.0
    for row, target in zip(rows, found, strict=True):
        known = np.flatnonzero(~np.isnan(row))
        if known.size == 0:
            raise InputError("has no value at all")
        place = x[known]
        target[:] = np.interp(nodes, place, row[known], period=length)
        ends = np.append(place[1:], place[0] + length)
        left_out = np.append(np.diff(known) > 1, known[-1] - known[0] < x.size - 1)
        wide = (ends - place > WIDE * max(typical, interface.spacing)) | left_out
        widest = max(widest, float(np.max((ends - place)[~wide], initial=0.0)))
        for begin, end in zip(place[wide], ends[wide], strict=True):
            into = np.mod(nodes - begin, length)
            margin = TOLERANCE * interface.spacing
            target[(into > margin) & (into < end - begin - margin)] = np.nan
    warn_accuracy(
        f"{x.size} points are interpolated linearly to {nodes.size} nodes; the widest distance"
        f" between them is {widest:.3g} m, {widest / interface.spacing:.3g} times the spacing of"
        " nodes"
    )
    return _filled(found.reshape(*values.shape[:-1], nodes.size), interface, gaps)


def _filled(values: Array, interface: Interface, gaps: Gaps) -> AtNodes:
    """Gaps closed by straight lines between their ends, if that was asked for."""
    missing = np.isnan(values)
    if not missing.any():
        return AtNodes(values, None)
    text = describe_gaps(missing.reshape(-1, interface.size), interface)
    if gaps == "refuse":
        raise InputError(
            f"must be finite: there {text}; give what was measured, or fill gaps with straight"
            " lines, which the result then remembers (gaps='fill', --fill-gaps)"
        )
    if gaps == "skip":
        return AtNodes(values, ~missing)
    values = values.copy()
    rows, holes = values.reshape(-1, interface.size), missing.reshape(-1, interface.size)
    for row, hole in zip(rows, holes, strict=True):
        if hole.all():
            raise InputError("has no value at all")
        if hole.any():
            known = interface.x[~hole]
            row[hole] = np.interp(interface.x[hole], known, row[~hole], period=interface.extent)
    warn_accuracy(f"there {text}; filled with straight lines between their ends")
    return AtNodes(values, ~missing)


def gaps_of(missing: NDArray[np.bool_], interface: Interface) -> list[tuple[float, float]]:
    """Where nodes are without a value: first and last such node, m; first > last across x = 0."""
    if missing.all():
        return [(0.0, float(interface.x[-1]))]
    starts = np.flatnonzero(missing & ~np.roll(missing, 1))
    ends = np.flatnonzero(missing & ~np.roll(missing, -1))
    if ends.size and ends[0] < starts[0]:  # one begins before x = 0 and ends behind it
        ends = np.roll(ends, -1)
    x = interface.x
    return [(float(x[a]), float(x[b])) for a, b in zip(starts, ends, strict=True)]


def describe_gaps(missing: NDArray[np.bool_], interface: Interface) -> str:
    """'are no values at x = 0.0112 to 0.0141 m (29 of 1024 nodes)', for (samples, nodes)."""
    row = int(np.argmax(missing.any(axis=1)))
    spans = gaps_of(missing[row], interface)
    places = ", ".join(
        f"{a:.6g} m" if a == b else f"{a:.6g} to {b:.6g} m" for a, b in spans[:SHOWN]
    )
    more = f" and {len(spans) - SHOWN} more gaps" if len(spans) > SHOWN else ""
    others = int(missing.any(axis=1).sum()) - 1
    which = f" in sample {row}" if missing.shape[0] > 1 else ""
    also = f", and in {others} more samples" if others else ""
    return (
        f"are no values (NaN) at x = {places}{more} ({int(missing[row].sum())} of"
        f" {interface.size} nodes{which}{also})"
    )


@dataclasses.dataclass(frozen=True, eq=False)
class Points:
    """Values of one quantity in SI, and where they belong.

    Attributes
    ----------
    values : (points,) or (samples, points) array
    x : (points,) array or None
        m; None if they come in the order of the nodes.
    measured : array of bool or None
        Of the shape of `values`, or (points,); from an earlier filling of gaps.
    """

    values: Array
    x: Array | None = None
    measured: NDArray[np.bool_] | None = None

    def on(self, interface: Interface, *, interpolate: bool, gaps: Gaps) -> AtNodes:
        """The same at the nodes of an interface."""
        if self.x is None:
            found, measured = in_order(self.values, interface, gaps), self.measured
        else:
            options: dict[str, Any] = {"interpolate": interpolate, "gaps": gaps}
            found, measured = by_coordinate(self.x, self.values, interface, **options), None
            if self.measured is not None:
                share = by_coordinate(self.x, self.measured * 1.0, interface, **options)
                measured = share.values > 0.999
        both = [mask for mask in (found.measured, measured) if mask is not None]
        return AtNodes(found.values, np.logical_and.reduce(both) if both else None)

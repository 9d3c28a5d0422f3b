"""Gaps in measured profiles: remembered from what was given to what is answered."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction.errors import InputError, warn_accuracy
from stiction.profiles import Gaps, at_nodes, gaps_of

Mask = NDArray[np.bool_]

IN_GAP = "in_gap"
GAPS = "gaps"


def gather(
    problem: Any, given: Mapping[str, Any], gaps: Gaps
) -> tuple[dict[str, Any], Mask | None]:
    """What a caller gave, at the nodes, and where all of it was measured.

    Returns
    -------
    values : dict
    measured : (samples, nodes) or (1, nodes) array of bool, or None if nothing was filled in
    """
    problems: list[str] = []
    values: dict[str, Any] = {}
    masks = []
    for name, value in given.items():
        values[name] = value
        if value is None:
            continue
        try:
            found = at_nodes(name, value, name, problem.interface, gaps)
        except InputError as error:
            problems += error.problems
            continue
        values[name] = found.values
        if found.measured is not None:
            masks.append(found.measured.reshape(-1, problem.interface.size))
    if problems:
        raise InputError(problems)
    if not masks:
        return values, None
    count = max(mask.shape[0] for mask in masks)
    everywhere = np.ones((count, problem.interface.size), dtype=bool)
    for mask in masks:
        everywhere &= mask
    return values, everywhere


def without_gaps(
    values: Mapping[str, Any], measured: Mask
) -> tuple[dict[str, Any], NDArray[np.int64]]:
    """The samples that have no gap in any profile, and their numbers.

    Raises
    ------
    InputError
        If every sample has one.
    """
    whole = measured.all(axis=1)
    if not whole.any():
        raise InputError(
            f"gaps: all of {whole.size} samples have gaps, so none is left (gaps='skip');"
            " gaps='fill' fills them with straight lines, which the result then remembers"
        )
    warn_accuracy(f"{int((~whole).sum())} of {whole.size} samples have gaps and are left out")

    def kept(value: Any) -> Any:
        return value[whole] if np.ndim(value) > 1 and len(value) == whole.size else value

    return {name: kept(value) for name, value in values.items()}, np.flatnonzero(whole)


def with_gaps(problem: Any, result: xr.Dataset, measured: Mask) -> xr.Dataset:
    """A result that says where its profiles have gaps, and which onsets lie in one."""
    position = result["critical_position"]
    inside = (_inside_plane if problem.interface.is_plane else _inside)(
        problem, np.atleast_1d(position.values), measured
    )
    dims = tuple(dim for dim in position.dims if dim != "direction")
    attributes = {"units": "1", "long_name": "whether the onset lies in a gap of the profile"}
    result[IN_GAP] = (dims, inside.reshape([position.sizes[dim] for dim in dims]), attributes)
    if not problem.interface.is_plane and np.all(measured == measured[:1]):
        result.attrs[GAPS] = json.dumps(gaps_of(~measured[0], problem.interface))
    return result


def _inside_plane(problem: Any, position: NDArray[np.float64], measured: Mask) -> Mask:
    """Which onsets (samples, 2) lie at a node that was not measured."""
    interface = problem.interface
    position = position.reshape(-1, 2)
    nodes = [
        np.round(np.nan_to_num(place) / spacing).astype(np.int64) % count
        for place, spacing, count in zip(
            position.T, interface.spacings, interface.shape, strict=True
        )
    ]
    maps = np.broadcast_to(measured, (len(position), interface.size))
    rows = np.arange(len(position))
    known = np.isfinite(position).all(axis=1)
    inside: Mask = known & ~maps.reshape(-1, *interface.shape)[rows, nodes[0], nodes[1]]
    if inside.any():
        x, y = position[int(np.argmax(inside))]
        warn_accuracy(
            f"the onset at x = {x:.6g} m, y = {y:.6g} m lies in a gap of the map: the strength"
            " there was filled in, not measured"
        )
    return inside


def _inside(problem: Any, position: NDArray[np.float64], measured: Mask) -> Mask:
    """Which onsets lie in a gap; warns of them, and of critical patches that reach into one."""
    nodes, spacing = problem.interface.size, problem.interface.spacing
    measured = np.broadcast_to(measured, (position.size, nodes))
    known = np.isfinite(position)
    place = np.where(known, position, 0.0) / spacing
    rows = np.arange(position.size)

    def unknown(at: Any) -> Any:
        return known & ~measured[rows, np.mod(at.astype(np.int64), nodes)]

    inside: Mask = unknown(np.floor(place)) | unknown(np.ceil(place))
    rate = problem.friction.weakening_rate
    near = inside.copy()
    if rate is not None and np.ptp(rate) == 0.0:
        half = min(0.5 * problem.nucleation_length / spacing, 0.5 * nodes)
        for step in np.arange(-np.floor(half), np.floor(half) + 1.0):
            near |= unknown(np.round(place) + step)
    for where, what in ((inside, "lies in a gap"), (near & ~inside, "reaches into a gap")):
        if where.any():
            first = int(np.argmax(where))
            also = f" (and {int(where.sum()) - 1} more samples)" if where.sum() > 1 else ""
            subject = "the onset" if what.startswith("lies") else "the critical patch"
            warn_accuracy(
                f"{subject} at x = {position[first]:.6g} m {what} of the profile{also}: the"
                " strength there was filled in, not measured"
            )
    return inside


def listed(result: xr.Dataset) -> list[tuple[float, float]]:
    """The gaps that all profiles of a result have: first and last node without a value, m."""
    return [(float(a), float(b)) for a, b in json.loads(result.attrs.get(GAPS, "[]"))]

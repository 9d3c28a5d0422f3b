"""Gaps in measured profiles: remembered from what was given to what is answered."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction.errors import InputError, warn_accuracy
from stiction.placing import Gaps, gaps_of
from stiction.profiles import at_nodes

Mask = NDArray[np.bool_]

IN_GAP = "in_gap"
GAPS = "gaps"


def gather(
    problem: Any, given: Mapping[str, Any], gaps: Gaps
) -> tuple[dict[str, Any], Mask | None]:
    """Put what a caller gave on the nodes, and find where all of it was measured.

    Returns
    -------
    values : dict
    measured : (samples, *shape) or (1, *shape) array of bool, or None if nothing is missing
    """
    problems: list[str] = []
    values: dict[str, Any] = {}
    measured: Any = True
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
            measured = measured & found.measured.reshape(-1, *problem.interface.shape)
    if problems:
        raise InputError(problems)
    return values, None if measured is True else measured


def without_gaps(
    values: Mapping[str, Any], measured: Mask
) -> tuple[dict[str, Any], NDArray[np.int64]]:
    """Return the samples that have no gap in any profile, and their numbers.

    Raises
    ------
    InputError
        If every sample has one.
    """
    whole = measured.reshape(len(measured), -1).all(axis=1)
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
    """Return a result that says where its profiles have gaps, and which onsets lie in one."""
    interface = problem.interface
    position = result["critical_position"]
    places = np.reshape(position.values, (-1, len(interface.shape)))
    inside = _missing_near(interface, places, measured, interface.spacings)
    rate = problem.uniform_rate
    lengths = interface.spacings if rate is None else problem.nucleation_lengths(rate)
    near = _missing_near(interface, places, measured, [0.5 * h for h in lengths]) & ~inside
    said = {"the onset at {} lies in": inside, "the critical patch at {} reaches into": near}
    for what, where in said.items():
        if where.any():
            first = places[int(np.argmax(where))]
            at = ", ".join(f"{d} = {v:.6g} m" for d, v in zip(interface.dims, first, strict=True))
            also = f" (and {int(where.sum()) - 1} more samples)" if where.sum() > 1 else ""
            warn_accuracy(
                f"{what.format(at)} a gap of the profile{also}: the strength there was filled in,"
                " not measured"
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
        for axis, (dim, nodes) in enumerate(interface.coordinates.items()):
            length = interface.lengths[axis]
            apart = np.abs(np.mod(nodes - places[i, axis] + 0.5 * length, length) - 0.5 * length)
            close = apart < (1.0 - 1e-9) * reach[axis]
            missing = np.compress(close, missing, axis=interface.dims.index(dim))
        found[i] = missing.any()
    return found


def listed(result: xr.Dataset) -> list[tuple[float, float]]:
    """Return the gaps that all profiles have: first and last node without a value, m."""
    return [(float(a), float(b)) for a, b in json.loads(result.attrs.get(GAPS, "[]"))]

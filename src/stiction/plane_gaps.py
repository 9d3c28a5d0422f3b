"""Gaps in maps of planes: named, left out, or closed by the smoothest surface over their rim."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import spsolve

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.interface import Interface
from stiction.profile_nodes import AtNodes, Gaps


def close_gaps(values: Array, interface: Interface, gaps: Gaps) -> AtNodes:
    """Maps (..., nx, ny) with NaN where nothing was measured, refused, left or filled.

    What fills a gap solves Laplace's equation in it, with the measured nodes around it as its rim:
    on a line that is the straight line between the ends, and nothing in it is higher or lower than
    its rim.
    """
    missing = np.isnan(values)
    if not missing.any():
        return AtNodes(values, None)
    maps = missing.reshape(-1, *interface.shape)
    row = int(np.argmax(maps.any(axis=(1, 2))))
    i, j = np.argwhere(maps[row])[0]
    dx, dy = interface.spacings
    text = (
        f"are no values (NaN) at {int(maps[row].sum())} of {interface.size} nodes, the first at x ="
        f" {i * dx:.6g} m, y = {j * dy:.6g} m" + f" (sample {row})" * (len(maps) > 1)
    )
    if gaps == "refuse":
        raise InputError(
            f"must be finite: there {text}; give what was measured, or fill gaps smoothly, which"
            " the result then remembers (gaps='fill', --fill-gaps)"
        )
    if gaps == "skip":
        return AtNodes(values, ~missing)
    filled = values.reshape(-1, *interface.shape).copy()
    for one, hole in zip(filled, maps, strict=True):
        if hole.all():
            raise InputError("has no value at all")
        if hole.any():
            _fill(one, hole, interface.spacings)
    warn_accuracy(f"there {text}; filled smoothly from around them")
    return AtNodes(filled.reshape(values.shape), ~missing)


def _fill(values: Array, hole: NDArray[np.bool_], spacings: tuple[float, ...]) -> None:
    """Solve the five-point Laplace equation of the nodes in the hole, periodically."""
    number = np.full(hole.shape, -1)
    number[hole] = np.arange(hole.sum())
    places = np.nonzero(hole)
    own = number[places]
    rows, columns, entries = [own], [own], [np.zeros(own.size)]
    right = np.zeros(own.size)
    for axis, spacing in enumerate(spacings):
        for step in (-1, 1):
            beside = list(places)
            beside[axis] = (places[axis] + step) % hole.shape[axis]
            weight = spacing**-2 * np.ones(own.size)
            entries[0] += weight
            there = number[tuple(beside)]
            known = there < 0
            right[known] += weight[known] * values[tuple(beside)][known]
            rows.append(own[~known])
            columns.append(there[~known])
            entries.append(-weight[~known])
    index = (np.concatenate(rows), np.concatenate(columns))
    matrix = csr_array((np.concatenate(entries), index), shape=(own.size, own.size))
    values[hole] = spsolve(matrix.tocsc(), right)

"""Patches on a periodic plane: connected slipping nodes, and where and how wide one of them is.

Nodes are connected where their cells share an edge (four neighbours), also across the borders.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from stiction.arrays import Array

Mask = NDArray[np.bool_]

CORE = 0.1
"""Share of the largest weight from which on a node belongs to the critical patch."""


class Patch(NamedTuple):
    """Centre along x and y (m, from 0 to the period), extents along x and y (m), area (m²)."""

    centre: tuple[float, float]
    extents: tuple[float, float]
    area: float


def labelled_patches(mask: Mask) -> tuple[NDArray[np.int64], int]:
    """Number of the patch, from 1 on, of every node; 0 where there is none; and how many patches.

    Parameters
    ----------
    mask : (nx, ny) bool array
    """
    pieces, count = label(mask)
    if count == 0:
        return pieces.astype(np.int64), 0
    first = np.concatenate((pieces[0, :], pieces[:, 0]))
    last = np.concatenate((pieces[-1, :], pieces[:, -1]))
    meet = (first > 0) & (last > 0)
    graph = coo_array((np.ones(meet.sum()), (first[meet], last[meet])), (count + 1, count + 1))
    patches, numbers = connected_components(graph, directed=False)
    # Node 0 of the graph, the background, is a component of its own.
    order = np.zeros(patches, dtype=np.int64)
    order[np.delete(np.arange(patches), numbers[0])] = np.arange(1, patches)
    return order[numbers][pieces], patches - 1


def _span(occupied: Mask, peak: int) -> tuple[int, int]:
    """First place and length of the shortest arc that holds all places; all around from the peak's
    far side if none is empty."""
    n = occupied.size
    places = np.flatnonzero(occupied)
    if places.size == n:
        return peak - n // 2, n
    gaps = np.diff(np.append(places, places[0] + n))
    widest = int(np.argmax(gaps))
    return int(places[(widest + 1) % places.size]), n - int(gaps[widest]) + 1


def patch_of(mask: Mask, weight: Array, spacings: tuple[float, ...]) -> Patch:
    """The centre (centroid of the weight), extents and area of a patch.

    Parameters
    ----------
    mask : (nx, ny) bool array
        Its nodes, at least one.
    weight : (nx, ny) array
    spacings : (float, float)
        m.
    """
    peak = np.unravel_index(int(np.argmax(np.where(mask, weight, -np.inf))), mask.shape)
    centre, extents = [], []
    for axis in (0, 1):
        start, length = _span(np.any(mask, axis=1 - axis), int(peak[axis]))
        profile = np.where(mask, weight, 0.0).sum(axis=1 - axis)
        n = mask.shape[axis]
        along = profile[(start + np.arange(length)) % n]
        place = (start + (along * np.arange(length)).sum() / along.sum()) % n
        centre.append(float(place * spacings[axis]))
        extents.append(length * spacings[axis])
    area = float(mask.sum()) * spacings[0] * spacings[1]
    return Patch((centre[0], centre[1]), (extents[0], extents[1]), area)


def critical_patch(multiplier: Array, spacings: tuple[float, ...]) -> tuple[Mask, Patch]:
    """The patch that becomes unstable, of its multiplier: its nodes, and what `patch_of` says.

    It is where y is above a tenth of its largest value, around that value. Not all slipping nodes
    that are connected with it: in a rough strength these reach across the plane, with a y that is
    next to nothing.

    Parameters
    ----------
    multiplier : (nx, ny) array
        y >= 0, not all zero.
    spacings : (float, float)
        m.
    """
    numbers, _ = labelled_patches(multiplier > CORE * multiplier.max())
    inside: Mask = numbers == numbers.flat[int(np.argmax(multiplier))]
    return inside, patch_of(inside, multiplier, spacings)

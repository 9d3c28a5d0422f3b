"""Number, position and extent of slipping patches on a line or plane.

Nodes on a plane are connected if their cells have a common edge (four
neighbours), also across the borders. In these functions, `interface` is
an `Interface`. Kernels do not depend on the file that defines it.

Example
-------
Slip at nodes 0, 3 and 4 of a periodic line of five nodes is one patch:

>>> count_patches(np.array([1.0, 0.0, 0.0, 2.0, 1.0]))
1
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from stiction.base.arrays import Array
from stiction.base.jit import jit

Mask = NDArray[np.bool_]

MIN_PATCH_WEIGHT = 0.1
"""Fraction of the largest weight above which a node of a plane belongs to the critical patch.

At the border of a patch y falls off over a few nodes. Half or twice this
fraction changes areas by a sixth to a quarter, and no other result.
"""


class Patch(NamedTuple):
    """Centre, extents and first ends (m) along each direction, and area (m²; m).

    Centre and first ends are from 0 to the period.
    """

    centre: tuple[float, ...]
    extents: tuple[float, ...]
    area: float
    starts: tuple[float, ...]


def count_patches(slip: Array) -> int:
    """Count the runs of slipping nodes on a circle."""
    # A run starts where a node slips and its left neighbour does not.
    above = slip > 0.0
    starts = int(np.count_nonzero(above[1:] > above[:-1])) + int(above[0] > above[-1])
    return max(starts, int(above[0]))


@jit
def main_patch(field: Array) -> tuple[int, int, float]:
    """Return the first node, length and centroid (in nodes, 0 to n) of the run with the peak.

    A run is a sequence of positive entries. No
    entry of the field is negative. If all entries
    are positive, the run is centred at the peak.
    """
    n, peak = field.shape[0], 0
    for i in range(n):
        if field[i] > field[peak]:
            peak = i
    # Go left from the peak to the first node of the run, and then right
    # to the last.
    start, length = peak, 1
    while length < n and field[start - 1 if start else n - 1] > 0.0:
        start = start - 1 if start else n - 1
        length += 1
    end = peak
    while length < n:
        end = end + 1 if end < n - 1 else 0
        if not field[end] > 0.0:
            break
        length += 1
    if length == n:
        # The run has no ends: cut the circle opposite the peak.
        start = (peak + n // 2 + 1) % n
    # The centroid is taken along the run, so that it is defined across
    # the ends of the circle.
    weight = moment = 0.0
    for q in range(length):
        value = field[(start + q) % n]
        weight += value
        moment += value * q
    centre = start + moment / weight
    return start, length, centre - n if centre >= n else centre


def with_ends(field: Array, interface: Any) -> Array:
    """If the interface has ends, append a zero to a field, so that the ends do not meet."""
    return np.append(field, 0.0) if interface.is_free else field


def line_patch(field: Array, interface: Any) -> Patch:
    """Return the patch on a line that contains the largest entry of a field."""
    spacing = interface.spacing
    first, length, centre = main_patch(with_ends(field, interface))
    centre += interface.first
    # A node represents half a spacing on each side.
    start = (first + interface.first - 0.5) % field.size * spacing
    return Patch((centre * spacing,), (length * spacing,), length * spacing, (start,))


def labelled_patches(mask: Mask) -> tuple[NDArray[np.int64], int]:
    """Return each node's patch number (from 1; 0 at rest), and the patch count."""
    pieces, count = label(mask)
    if count == 0:
        return pieces.astype(np.int64), 0
    # scipy's labels stop at the borders. Join the patches that meet
    # across them.
    first = np.concatenate((pieces[0, :], pieces[:, 0]))
    last = np.concatenate((pieces[-1, :], pieces[:, -1]))
    meet = (first > 0) & (last > 0)
    graph = coo_array((np.ones(meet.sum()), (first[meet], last[meet])), (count + 1, count + 1))
    patches, numbers = connected_components(graph, directed=False)
    # Node 0 of the graph is the background.
    # Number the other components from 1.
    order = np.zeros(patches, dtype=np.int64)
    order[np.delete(np.arange(patches), numbers[0])] = np.arange(1, patches)
    return order[numbers][pieces], patches - 1


def span(occupied: Mask, peak: int) -> tuple[int, int]:
    """Return the beginning and the length of the shortest arc that contains all occupied places.

    If every place is occupied, the arc is the whole circle, cut
    opposite the peak.

    >>> span(np.array([True, False, False, True, True]), 0)
    (3, 3)
    >>> span(np.ones(5, dtype=bool), 1)
    (-1, 5)
    """
    n = occupied.size
    places = np.flatnonzero(occupied)
    if places.size == n:
        return peak - n // 2, n
    # The shortest arc is the circle without the widest gap.
    gaps = np.diff(np.append(places, places[0] + n))
    widest = int(np.argmax(gaps))
    return int(places[(widest + 1) % places.size]), n - int(gaps[widest]) + 1


def patch_of(mask: Mask, weight: Array, spacings: tuple[float, ...]) -> Patch:
    """Return the patch marked by a mask on a plane, centred at the centroid of the weight."""
    peak = np.unravel_index(int(np.argmax(np.where(mask, weight, -np.inf))), mask.shape)
    centre, extents, starts = [], [], []
    for axis in (0, 1):
        # The other axis is projected away, so that the patch becomes an arc.
        start, length = span(np.any(mask, axis=1 - axis), int(peak[axis]))
        profile = np.where(mask, weight, 0.0).sum(axis=1 - axis)
        n = mask.shape[axis]
        along = profile[(start + np.arange(length)) % n]
        place = (start + (along * np.arange(length)).sum() / along.sum()) % n
        centre.append(float(place * spacings[axis]))
        extents.append(length * spacings[axis])
        starts.append((start - 0.5) % n * spacings[axis])
    area = float(mask.sum()) * spacings[0] * spacings[1]
    return Patch(tuple(centre), tuple(extents), area, tuple(starts))


def largest_patch(weight: Array, interface: Any, share: float) -> tuple[Mask, Patch]:
    """Return the nodes of the patch around the largest weight, and the patch.

    The weight is not negative, and positive somewhere. Nodes belong to
    a patch if their weight exceeds a fraction of the largest weight.
    """
    above = weight > share * weight.max()
    if weight.ndim == 1:  # a line
        above = np.where(above, weight, 0.0)
        start, length, _ = main_patch(with_ends(above, interface))
        inside = np.zeros(weight.size, dtype=np.bool_)
        inside[(start + np.arange(length)) % weight.size] = True
        return inside, line_patch(above, interface)
    numbers, _ = labelled_patches(above)
    inside = numbers == numbers.flat[int(np.argmax(weight))]
    return inside, patch_of(inside, weight, interface.spacings)


def critical_patch(multiplier: Array, interface: Any) -> Patch:
    """Return the patch that becomes unstable, from the multiplier y >= 0, or NaN if y is zero.

    On a line, the patch is the run with the largest y. On a
    plane, it is the connected area around the largest y in
    which y exceeds a tenth of its largest value. Slipping
    nodes with a smaller y do not count, because with a
    rough strength they extend across the whole plane.
    """
    if not multiplier.any():
        nowhere = (np.nan,) * len(interface.shape)
        return Patch(nowhere, nowhere, np.nan, nowhere)
    if not interface.is_plane:
        return line_patch(multiplier, interface)
    field = multiplier.reshape(interface.shape)
    _, patch = largest_patch(field, interface, MIN_PATCH_WEIGHT)
    return patch


def patches_of(slip: Array, interface: Any) -> int:
    """Return the number of slipping patches."""
    if interface.is_plane:
        return labelled_patches(slip.reshape(interface.shape) > 0.0)[1]
    return count_patches(with_ends(slip, interface))

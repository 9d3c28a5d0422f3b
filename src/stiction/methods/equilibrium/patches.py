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
    """Count the runs of slipping nodes on a circle.

    Across the border, two slipping nodes are one patch:

    >>> fields = [1.0, 0.0, 2.0, 0.0], [0.5, 2.0], [0.0, 0.0], [0.0, 3.0, 3.0, 0.0, 1.0]
    >>> [count_patches(np.array(slip)) for slip in fields]
    [2, 1, 0, 2]
    """
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

    A run may lie across the border. Its centroid is then counted past node 5, or again from 0:

    >>> main_patch(np.array([1.0, 0.0, 0.0, 2.0, 0.0, 3.0]))
    (5, 2, 5.25)
    >>> first, length, centre = main_patch(np.array([4.0, 2.0, 0.0, 3.0, 0.0, 1.0]))
    >>> first, length, round(centre, 6)
    (5, 3, 0.142857)
    >>> main_patch(np.array([0.0, 1.0, 5.0, 2.0, 0.0, 4.0]))
    (1, 3, 2.125)

    If all entries are positive, the run begins half a circle after the peak:

    >>> first, length, centre = main_patch(np.array([1.0, 2.0, 5.0, 3.0]))
    >>> first, length, round(centre, 6)
    (1, 4, 2.272727)
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
    """If the interface has ends, append a zero to a field, so that the ends do not meet.

    >>> from stiction.problem.interface import Interface
    >>> field = np.array([2.0, 0, 0, 0, 0, 0, 0, 3.0])
    >>> interfaces = Interface(0.8, 8), Interface(0.8, 8, ends="free")
    >>> [with_ends(field, interface)[6:].tolist() for interface in interfaces]
    [[0.0, 3.0], [0.0, 3.0, 0.0]]
    """
    return np.append(field, 0.0) if interface.is_free else field


def line_patch(field: Array, interface: Any) -> Patch:
    """Return the patch on a line that contains the largest entry of a field.

    The nodes are 25 mm apart, and the first node of an interface with ends lies 12.5 mm from
    its beginning. Without ends, the patch continues at node 7:

    >>> from stiction.problem.interface import Interface
    >>> line, free = Interface(0.2, 8), Interface(0.2, 8, ends="free")
    >>> field = np.array([3.0, 1.0, 0, 0, 0, 0, 0, 1.0])
    >>> for interface in (line, free):
    ...     patch = line_patch(field, interface)
    ...     values = [*patch.centre, *patch.extents, patch.area, *patch.starts]
    ...     print(np.round(values, 6).tolist())
    [0.0, 0.075, 0.075, 0.1625]
    [0.01875, 0.05, 0.05, 0.0]
    """
    spacing = interface.spacing
    first, length, centre = main_patch(with_ends(field, interface))
    centre += interface.first
    # A node represents half a spacing on each side.
    start = (first + interface.first - 0.5) % field.size * spacing
    return Patch((centre * spacing,), (length * spacing,), length * spacing, (start,))


def labelled_patches(mask: Mask) -> tuple[NDArray[np.int64], int]:
    """Return each node's patch number (from 1; 0 at rest), and the patch count.

    The corners meet across both borders. Cells that only touch at a corner are not connected:

    >>> mask = np.array([[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0]], dtype=bool)
    >>> patches, count = labelled_patches(mask)
    >>> patches.tolist()
    [[1, 0, 0, 1], [0, 2, 0, 0], [0, 0, 3, 0], [1, 0, 0, 0]]
    >>> count
    3
    >>> labelled_patches(np.zeros((2, 3), dtype=bool))
    (array([[0, 0, 0],
           [0, 0, 0]]), 0)
    """
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
    """Return the patch marked by a mask on a plane, centred at the centroid of the weight.

    Rows are 0.5 m apart and columns 0.1 m. The patch lies across the border between rows:

    >>> mask = np.zeros((4, 6), dtype=bool)
    >>> mask[0, 1:4] = mask[3, 3] = True
    >>> weight = np.where(mask, 1.0, 9.0)
    >>> weight[0, 1] = 5.0
    >>> patch = patch_of(mask, weight, (0.5, 0.1))
    >>> np.round([*patch.centre, *patch.extents, patch.area, *patch.starts], 6).tolist()
    [1.9375, 0.1625, 1.0, 0.3, 0.2, 1.25, 0.05]

    A patch along the whole circle is cut opposite its own peak, in row 3:

    >>> mask = np.arange(24).reshape(4, 6) % 6 == 2
    >>> weight = np.where(mask, 1.0, 9.0)
    >>> weight[3, 2] = 2.0
    >>> patch = patch_of(mask, weight, (0.5, 0.1))
    >>> np.round([patch.centre[0], patch.extents[0], patch.starts[0]], 6).tolist()
    [1.3, 2.0, 0.25]
    """
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

    Nodes with exactly half of the largest weight do not belong to the patch:

    >>> from stiction.problem.interface import Interface
    >>> weight = np.array([2.0, 4.0, 3.0, 2.1, 0.0, 3.9, 2.0, 0.0])
    >>> inside, patch = largest_patch(weight, Interface(0.8, 8), 0.5)
    >>> np.flatnonzero(inside).tolist()
    [1, 2, 3]
    >>> np.round([*patch.starts, patch.area], 6).tolist()
    [0.05, 0.3]
    >>> field = np.zeros((8, 10))
    >>> field[2, 3:5], field[2, 5:7], field[6] = (2.0, 7.0), (3.0, 4.0), 6.0
    >>> inside, patch = largest_patch(field, Interface((0.8, 2.0), (8, 10)), 0.5)
    >>> np.argwhere(inside).tolist()
    [[2, 4]]
    >>> np.round(patch.extents, 6).tolist()
    [0.1, 0.2]
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

    On a plane, y = 0.6 exceeds a tenth of 5 but 0.4 does not. On a line any positive y counts:

    >>> from stiction.problem.interface import Interface
    >>> line, plane = Interface(0.8, 8), Interface((0.8, 2.0), (8, 10))
    >>> y = np.array([0.0, 0.4, 5.0, 0.6, 0.0, 0.0, 0.6, 0.0])
    >>> round(critical_patch(y, line).area, 6)
    0.3
    >>> field = np.zeros((8, 10))
    >>> field[:, 4] = y
    >>> patch = critical_patch(field.reshape(-1), plane)
    >>> np.round([*patch.extents, *patch.starts, patch.area], 6).tolist()
    [0.2, 0.2, 0.15, 0.7, 0.04]
    >>> critical_patch(np.zeros(8), line)
    Patch(centre=(nan,), extents=(nan,), area=nan, starts=(nan,))
    >>> critical_patch(np.zeros(80), plane).starts
    (nan, nan)
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
    """Return the number of slipping patches.

    Slip at both ends is one patch on a circle, and two patches between ends:

    >>> from stiction.problem.interface import Interface
    >>> slip = np.array([1.0, 0, 0, 2, 2, 0, 0, 1])
    >>> [patches_of(slip, Interface(0.8, 8, ends=ends)) for ends in (None, "free")]
    [2, 3]
    >>> patches_of(np.tile(slip, 10), Interface((2.0, 0.8), (10, 8)))
    2
    """
    if interface.is_plane:
        return labelled_patches(slip.reshape(interface.shape) > 0.0)[1]
    return count_patches(with_ends(slip, interface))

"""A preconditioner for large grids: the interface cut into segments, each with its own factor."""

from __future__ import annotations

import numpy as np

from stiction.arrays import Array
from stiction.equilibrium.cholesky import append, back_substitute, row_start, substitute
from stiction.equilibrium.linear_program import PIVOT
from stiction.jit import jit


@jit
def append_by_segment(
    factors: Array,
    members: Array,
    sizes: Array,
    inside: Array,
    origin: int,
    width: int,
    nodes: Array,
    column: Array,
    diagonal: Array,
    order: Array,
) -> int:
    """Append nodes, in the order given, to the factors of their segments.

    Parameters
    ----------
    factors : (segments, row_start(width + 4)) array, changed
    members : (segments, width + 4) int array, changed
    sizes : (segments,) int array, changed
    inside : (n,) bool array, changed
    origin, width : int
        First node and number of nodes of segment 0.
    nodes : (count,) int array
    column, diagonal : (n,) arrays
    order : (>= width + 4,) int array, work space

    Returns
    -------
    int
        The first segment whose own block of A is not positive definite (it stops before the node
        that makes it so), or -1.
    """
    n = inside.shape[0]
    for segment in range(sizes.shape[0]):
        count = 0
        for t in range(nodes.shape[0]):
            if ((nodes[t] - origin) % n) // width == segment:
                order[count] = nodes[t]
                count += 1
        if count == 0:
            continue
        before = sizes[segment]
        now = append(
            factors[segment], before, members[segment], order, count, column, diagonal, PIVOT
        )
        sizes[segment] = now
        for t in range(before, now):
            inside[members[segment, t]] = True
        if now < before + count:
            return segment
    return -1


@jit
def precondition(
    factors: Array,
    members: Array,
    sizes: Array,
    values: Array,
    result: Array,
    right: Array,
    forward: Array,
    solution: Array,
) -> None:
    """Solve the block-diagonal part of A on the slipping nodes; zero elsewhere."""
    result[:] = 0.0
    for segment in range(sizes.shape[0]):
        size = sizes[segment]
        if size == 0:
            continue
        for t in range(size):
            right[t] = values[members[segment, t]]
        substitute(factors[segment], size, right, forward)
        back_substitute(factors[segment], size, forward, solution)
        for t in range(size):
            result[members[segment, t]] = solution[t]


class Segments:
    """The slipping nodes of one sample on a large grid, with a factor for each segment.

    Parameters
    ----------
    column, diagonal : (n,) arrays
        First column of K and diagonal of A, Pa/m.
    origin : int
        First node of the first segment.
    width : int
        Nodes of a segment.
    """

    def __init__(self, column: Array, diagonal: Array, origin: int, width: int) -> None:
        n = column.shape[0]
        count = -(-n // width)
        self.column, self.diagonal = column, diagonal
        self.origin, self.width = origin, width
        self.factors = np.empty((count, row_start(width + 4)))
        self.members = np.zeros((count, width + 4), dtype=np.int64)
        self.sizes = np.zeros(count, dtype=np.int64)
        self.inside = np.zeros(n, dtype=np.bool_)
        self._order = np.empty(width + 4, dtype=np.int64)
        self._workspace = np.empty((3, width + 4))

    def append(self, nodes: Array) -> int:
        """Append nodes in this order; the segment that fails, or -1."""
        failed: int = append_by_segment(
            self.factors, self.members, self.sizes, self.inside, self.origin, self.width,
            np.ascontiguousarray(nodes, dtype=np.int64), self.column, self.diagonal, self._order,
        )  # fmt: skip
        return failed

    def truncate(self, sizes: Array) -> None:
        """Go back to earlier sizes."""
        self.sizes[:] = sizes
        self.inside[:] = False
        for segment, size in enumerate(sizes):
            self.inside[self.members[segment, :size]] = True

    def remove(self, negative: Array) -> None:
        """Take out the marked nodes; factors of their segments are rebuilt from there on."""
        again = []
        sizes = self.sizes.copy()
        for segment, size in enumerate(sizes):
            marked = negative[self.members[segment, :size]]
            if marked.any():
                kept = int(np.argmax(marked))
                rest = self.members[segment, kept:size]
                again.append(rest[~marked[kept:]].copy())
                sizes[segment] = kept
        self.truncate(sizes)
        if again:
            self.append(np.concatenate(again))

    def solve(self, values: Array) -> Array:
        """The preconditioner applied to a field."""
        result = np.empty_like(values)
        precondition(
            self.factors, self.members, self.sizes, values, result,
            self._workspace[0], self._workspace[1], self._workspace[2],
        )  # fmt: skip
        return result

"""The stiffness K of a line or of two blocks inside kernels, which resolve it by its type."""

# numba compares the names of arguments with their annotations, so functions by type have none.
# mypy: disable-error-code="no-untyped-def"

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit
from stiction.elasticity.line import Stiffness, add_four, apply_stiffness


class BlockStiffness(NamedTuple):
    """K of two blocks, row by row in a flat array, and what slip takes off their drive.

    Slip d lowers the mean stress by relief <q, d>/n (Pa/m; 0 under dead load).
    """

    rows: Array
    nodes: int
    relief: float


def make_block_stiffness(matrix: Array, relief: float) -> BlockStiffness:
    """Return the stiffness of a symmetric matrix (n, n), Pa/m."""
    return BlockStiffness(np.ascontiguousarray(matrix).reshape(-1), len(matrix), relief)


def _entry(stiffness: Any, i: int, j: int) -> float:
    """Stand for K_ij; the function is chosen by the type of the stiffness."""
    raise NotImplementedError


def _relief(stiffness: Any, profile: Array, slip: Array) -> float:
    """Stand for the stress that slip takes off the drive."""
    raise NotImplementedError


def _apply(
    stiffness: Any, members: Array, size: int, values: Array, halves: Array, result: Array
) -> None:
    """Stand for the product of K with a field."""
    raise NotImplementedError


def _apply_outside(
    stiffness: Any,
    members: Array,
    size: int,
    values: Array,
    inside: Array,
    halves: Array,
    result: Array,
) -> None:
    """Stand for the product at the nodes that are not inside."""
    raise NotImplementedError


@jit
def _apply_rows(
    stiffness: BlockStiffness,
    members: Array,
    size: int,
    values: Array,
    start: int,
    target: Array,
) -> None:
    """`target` = K times a field that has `values` at some members, from a node `start` on."""
    n = stiffness.nodes
    for q in range(target.shape[0]):
        target[q] = 0.0
    for first in range(ZERO, size, 4):
        p0 = p1 = p2 = p3 = ZERO
        z0 = z1 = z2 = z3 = 0.0
        for t in range(first, min(first + 4, size)):
            p0, p1, p2, p3 = members[t] * n + start, p0, p1, p2
            z0, z1, z2, z3 = values[t], z0, z1, z2
        add_four(target, stiffness.rows, (p0, p1, p2, p3), (z0, z1, z2, z3))


@jit
def _apply_runs(
    stiffness: BlockStiffness,
    members: Array,
    size: int,
    values: Array,
    inside: Array,
    result: Array,
) -> None:
    """Multiply at each run of nodes that are not inside."""
    end = ZERO
    while end < stiffness.nodes:
        start = end
        while end < stiffness.nodes and inside[end] == inside[start]:
            end += 1
        if not inside[start]:
            _apply_rows(stiffness, members, size, values, start, result[start:end])


@overload(_entry)
def _entry_of(stiffness, i, j):
    if stiffness.instance_class is Stiffness:
        return lambda stiffness, i, j: stiffness.column[abs(i - j)]
    return lambda stiffness, i, j: stiffness.rows[i * stiffness.nodes + j]


@overload(_relief)
def _relief_of(stiffness, profile, slip):
    if stiffness.instance_class is Stiffness:
        return lambda stiffness, profile, slip: 0.0

    def mean(stiffness, profile, slip):
        if stiffness.relief == 0.0:
            return 0.0
        total = 0.0
        for i in range(slip.shape[0]):
            total += profile[i] * slip[i]
        return stiffness.relief * total / slip.shape[0]

    return mean


@overload(_apply)
def _apply_of(stiffness, members, size, values, halves, result):
    if stiffness.instance_class is Stiffness:
        return lambda stiffness, members, size, values, halves, result: apply_stiffness(
            stiffness, members, size, values, halves, result
        )
    return lambda stiffness, members, size, values, halves, result: _apply_rows(
        stiffness, members, size, values, ZERO, result[: stiffness.nodes]
    )


@overload(_apply_outside)
def _apply_outside_of(stiffness, members, size, values, inside, halves, result):
    if stiffness.instance_class is Stiffness:
        return lambda stiffness, members, size, values, inside, halves, result: apply_stiffness(
            stiffness, members, size, values, halves, result
        )
    return lambda stiffness, members, size, values, inside, halves, result: _apply_runs(
        stiffness, members, size, values, inside, result
    )


@jit
def entry(stiffness: Any, i: int, j: int) -> float:
    """Return K_ij, Pa/m."""
    return _entry(stiffness, i, j)


@jit
def mean_relief(stiffness: Any, profile: Array, slip: Array) -> float:
    """Return by how much slip lowers the mean stress of the interface, Pa; 0 at a fixed force."""
    return _relief(stiffness, profile, slip)


@jit
def apply(
    stiffness: Any, members: Array, size: int, values: Array, halves: Array, result: Array
) -> None:
    """`result` (n,) = K times a field that has `values` at the first `size` of the `members`."""
    _apply(stiffness, members, size, values, halves, result)


@jit
def apply_outside(
    stiffness: Any,
    members: Array,
    size: int,
    values: Array,
    inside: Array,
    halves: Array,
    result: Array,
) -> None:
    """Multiply as `apply` does, at least at the nodes that are not inside, where K is dense.

    On a line all of the product costs as much.
    """
    _apply_outside(stiffness, members, size, values, inside, halves, result)

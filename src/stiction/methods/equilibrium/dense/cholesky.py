"""A Cholesky factor that grows: nodes are appended to it, in any order, until a pivot fails.

The rows of the factor lie one after the other in a flat array, each padded to a multiple of eight
numbers: half the memory of a square, and no two rows compete for the same cache sets.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit, jit_inside
from stiction.base.lanes import LANES, load, multiply_add, totals, zeros
from stiction.elasticity.operator import dot
from stiction.elasticity.stiffness import apply, apply_outside, entry
from stiction.methods.equilibrium.sample import StaticSample

GROUP = 4
"""Rows that are appended together: each row of the factor is then read once for four new ones."""
PIVOT = 1e-13
"""Share of the diagonal below which a pivot is round-off."""
TURNING = 4
"""Time of a rotation of two rows, in units of that of a row in a group that is appended."""
MOST_MEMBERS = 8192
"""Slipping nodes for which a dense factor has space (268 MB if all of it is used)."""
CROWDED = -2
"""In the place of a number of members or a status: more members than that."""


@jit
def row_start(row: int) -> int:
    """Return the index at which a row begins in the flat array."""
    block = row >> 3
    return 32 * block * (block + 1) + 8 * (row & 7) * (block + 1)


@jit
def substitute(factor: Array, first: int, last: int, values: Array) -> None:
    """Solve L x = values in place, in the order of the rows; those before `first` are solved."""
    for r in range(first, last):
        start = row_start(r)
        row = factor[start : start + r + 1]
        values[r] = (values[r] - dot(row, values, r)) / row[r]


@jit_inside
def _solve_four(factor: Array, size: int) -> None:
    """Forward substitution of four new rows that follow row `size` - 1, in place.

    Two columns at a time: eight running sums keep the processor's vector units busy.
    """
    s0 = row_start(size)
    s1 = row_start(size + 1)
    s2 = row_start(size + 2)
    s3 = row_start(size + 3)
    x0 = factor[s0 : s0 + size]
    x1 = factor[s1 : s1 + size]
    x2 = factor[s2 : s2 + size]
    x3 = factor[s3 : s3 + size]
    k = 0
    while k + 1 < size:
        base = row_start(k)
        u = factor[base : base + k + 1]
        base = row_start(k + 1)
        v = factor[base : base + k + 2]
        whole = k - k % LANES
        p0 = p1 = p2 = p3 = zeros()
        q0 = q1 = q2 = q3 = zeros()
        for t in range(0, whole, LANES):
            p = load(u, t)
            q = load(v, t)
            y = load(x0, t)
            p0 = multiply_add(p, y, p0)
            q0 = multiply_add(q, y, q0)
            y = load(x1, t)
            p1 = multiply_add(p, y, p1)
            q1 = multiply_add(q, y, q1)
            y = load(x2, t)
            p2 = multiply_add(p, y, p2)
            q2 = multiply_add(q, y, q2)
            y = load(x3, t)
            p3 = multiply_add(p, y, p3)
            q3 = multiply_add(q, y, q3)
        u0, u1, u2, u3 = totals(p0, p1, p2, p3)
        v0, v1, v2, v3 = totals(q0, q1, q2, q3)
        for t in range(whole, k):
            a = u[t]
            b = v[t]
            u0 = multiply_add(a, x0[t], u0)
            u1 = multiply_add(a, x1[t], u1)
            u2 = multiply_add(a, x2[t], u2)
            u3 = multiply_add(a, x3[t], u3)
            v0 = multiply_add(b, x0[t], v0)
            v1 = multiply_add(b, x1[t], v1)
            v2 = multiply_add(b, x2[t], v2)
            v3 = multiply_add(b, x3[t], v3)
        inverse = 1.0 / u[k]
        x0[k] = (x0[k] - u0) * inverse
        x1[k] = (x1[k] - u1) * inverse
        x2[k] = (x2[k] - u2) * inverse
        x3[k] = (x3[k] - u3) * inverse
        inverse = 1.0 / v[k + 1]
        x0[k + 1] = (x0[k + 1] - v0 - v[k] * x0[k]) * inverse
        x1[k + 1] = (x1[k + 1] - v1 - v[k] * x1[k]) * inverse
        x2[k + 1] = (x2[k + 1] - v2 - v[k] * x2[k]) * inverse
        x3[k + 1] = (x3[k + 1] - v3 - v[k] * x3[k]) * inverse
        k += 2
    if k < size:
        base = row_start(k)
        u = factor[base : base + k + 1]
        x0[k] = (x0[k] - dot(u, x0, k)) / u[k]
        x1[k] = (x1[k] - dot(u, x1, k)) / u[k]
        x2[k] = (x2[k] - dot(u, x2, k)) / u[k]
        x3[k] = (x3[k] - dot(u, x3, k)) / u[k]


@jit
def raise_diagonal(
    factor: Array, size: int, position: int, amount: float, turns: Array
) -> None:
    """Add a positive amount to one diagonal entry of the factored matrix, by plane rotations.

    The cosines and sines of the rotations are kept in `turns`, a workspace.
    """
    for r in range(position, size):
        start = row_start(r)
        row = factor[start : start + r + 1]
        # The column that is rotated into the factor: zero below the entry that rises.
        extra = math.sqrt(amount) if r == position else 0.0
        for k in range(position, r):
            entry = row[k]
            row[k] = multiply_add(turns[1, k], extra, turns[0, k] * entry)
            extra = multiply_add(turns[0, k], extra, -turns[1, k] * entry)
        pivot = math.sqrt(row[r] * row[r] + extra * extra)
        turns[0, r] = row[r] / pivot
        turns[1, r] = extra / pivot
        row[r] = pivot


@jit
def back_substitute(factor: Array, size: int, values: Array) -> None:
    """Solve L^T x = values in place, rows of L taken four at a time."""
    i = size
    while i >= 4:
        i -= 4
        s0 = row_start(i)
        s1 = row_start(i + 1)
        s2 = row_start(i + 2)
        s3 = row_start(i + 3)
        r0 = factor[s0 : s0 + i + 1]
        r1 = factor[s1 : s1 + i + 2]
        r2 = factor[s2 : s2 + i + 3]
        r3 = factor[s3 : s3 + i + 4]
        z3 = values[i + 3] / r3[i + 3]
        z2 = (values[i + 2] - z3 * r3[i + 2]) / r2[i + 2]
        z1 = (values[i + 1] - z3 * r3[i + 1] - z2 * r2[i + 1]) / r1[i + 1]
        z0 = (values[i] - z3 * r3[i] - z2 * r2[i] - z1 * r1[i]) / r0[i]
        values[i] = z0
        values[i + 1] = z1
        values[i + 2] = z2
        values[i + 3] = z3
        for t in range(i):
            less = multiply_add(-z0, r0[t], values[t])
            less = multiply_add(-z1, r1[t], less)
            less = multiply_add(-z2, r2[t], less)
            values[t] = multiply_add(-z3, r3[t], less)
    while i > 0:
        i -= 1
        start = row_start(i)
        row = factor[start : start + i + 1]
        z = values[i] / row[i]
        values[i] = z
        for t in range(i):
            values[t] = multiply_add(-z, row[t], values[t])


class Workspace(NamedTuple):
    """The factor of A on the slipping nodes of one sample, with the arrays that extend it.

    Arrays are at nodes (n,), or of members: the slipping nodes in the order of the factor's rows.
    """

    stiffness: Any
    factor: Array
    members: NDArray[np.int64]
    order: NDArray[np.int64]  # nodes to append
    inside: NDArray[np.bool_]  # marks the members
    diagonal: Array  # of A, at nodes
    turns: Array  # cosines and sines of rotations
    halves: Array  # workspace of products
    held: NDArray[np.int64]  # (1,): rows that are valid for members and `held_diagonal`
    held_diagonal: Array  # of A as factored, of members
    forward_load: Array  # forward substitution of the load profile
    forward_strength: Array  # that of the strength
    forward_drive: Array  # that of the drive in a jump
    known_drive: Array  # the drive of which that is
    keys: Array  # by which `order` is sorted
    right: Array  # a right side, at nodes
    resting: Array  # stress that nodes take off the interface which slipped and rest, at nodes
    solution: Array  # of members
    rates: Array  # of slip, of members
    direction: Array  # at nodes
    product: Array  # of K, at nodes


def make_workspace(stiffness: Any, n: int) -> Workspace:
    """Workspace for samples of n nodes. Pages of the factor that are never used cost no memory."""
    capacity = min(n, MOST_MEMBERS)
    return Workspace(
        stiffness,
        np.empty(row_start(capacity + 4)),
        np.empty(n + 4, dtype=np.int64),
        np.empty(n, dtype=np.int64),
        np.empty(n, dtype=np.bool_),
        np.empty(n),
        np.empty((2, n + 4)),
        np.empty((2, n // 2)),
        np.zeros(1, dtype=np.int64),
        *np.zeros((12, n + 4)),
    )


class Course(NamedTuple):
    """One sample on its way."""

    sample: StaticSample
    slip: Array  # d at nodes, m; it goes with it, as does the next
    stiff: Array  # K d, Pa
    workspace: Workspace
    stops: bool  # a node that slips may stop


@jit
def append(workspace: Workspace, size: int, count: int) -> int:
    """Append order[:count] to the factor of A on members[:size], until done or a pivot fails.

    Returns the number of members: if it is below size + count, the node after the last member
    failed, and its row, without the pivot, follows the last one in the factor.
    """
    factor, members, nodes = workspace.factor, workspace.members, workspace.order
    stiffness, diagonal = workspace.stiffness, workspace.diagonal
    done = 0
    while done < count:
        group = min(GROUP, count - done)
        for r in range(group):
            node = nodes[done + r]
            start = row_start(size + r)
            row = factor[start : start + size]
            for t in range(size):
                row[t] = entry(stiffness, node, members[t])
        if group == 1:
            start = row_start(size)
            substitute(factor, ZERO, size, factor[start : start + size])
        else:
            for r in range(group, GROUP):
                start = row_start(size + r)
                for t in range(size):
                    factor[start + t] = 0.0
            _solve_four(factor, size)
        for r in range(group):
            node = nodes[done + r]
            start = row_start(size + r)
            row = factor[start : start + size + r + 1]
            for q in range(r):
                base = row_start(size + q)
                known = factor[base : base + size + q + 1]
                own = entry(stiffness, node, members[size + q])
                row[size + q] = (own - dot(known, row, size + q)) / known[size + q]
            pivot = diagonal[node] - dot(row, row, size + r)
            members[size + r] = node
            if pivot <= PIVOT * diagonal[node]:
                workspace.held[0] = size + r
                return size + r
            row[size + r] = math.sqrt(pivot)
            workspace.held_diagonal[size + r] = diagonal[node]
        size += group
        done += group
    workspace.held[0] = size
    return size


@jit
def remove(workspace: Workspace, size: int, position: int) -> int:
    """Take one member out of the factor; returns the number of those that stay.

    The rows below it move up, and plane rotations spread its column over the others.
    """
    factor, members, turns = workspace.factor, workspace.members, workspace.turns
    for r in range(position + 1, size):
        start = row_start(r)
        row = factor[start : start + r + 1]
        start = row_start(r - 1)
        above = factor[start : start + r]
        extra = row[position]
        for k in range(position):
            above[k] = row[k]
        for k in range(position, r - 1):
            own = row[k + 1]
            above[k] = turns[0, k] * own + turns[1, k] * extra
            extra = turns[0, k] * extra - turns[1, k] * own
        pivot = math.sqrt(row[r] * row[r] + extra * extra)
        turns[0, r - 1] = row[r] / pivot
        turns[1, r - 1] = extra / pivot
        above[r - 1] = pivot
        members[r - 1] = members[r]
        workspace.held_diagonal[r - 1] = workspace.held_diagonal[r]
    workspace.held[0] = size - 1
    return size - 1


@jit
def factor_inside(workspace: Workspace) -> int:
    """Factor A on the nodes that are `inside`; returns what `append` returns.

    Rows stay up to the first node that is not inside any more, or that weakens more steeply than
    before; those of nodes that weaken less are turned. Nodes that weaken no more come first in what
    is appended: as a crack grows most nodes are such, and their rows stay longest.
    """
    stiffness, diagonal = workspace.stiffness, workspace.diagonal
    members, order, inside = workspace.members, workspace.order, workspace.inside
    known, held = workspace.held_diagonal, workspace.held[0]
    kept = first = turned = ZERO
    while kept < held and inside[members[kept]] and diagonal[members[kept]] >= known[kept]:
        if diagonal[members[kept]] > known[kept]:
            turned += 1
        elif turned == 0:
            first += 1
        kept += 1
    if TURNING * turned * (kept - first) > kept * kept:
        kept = first  # it is faster to compute their rows again
    for t in range(kept):
        i = members[t]
        inside[i] = False
        if diagonal[i] > known[t]:
            raise_diagonal(workspace.factor, kept, t, diagonal[i] - known[t], workspace.turns)
            known[t] = diagonal[i]
    count = ZERO
    for weakening in (False, True):
        for i in range(inside.shape[0]):
            if inside[i] and (weakening or diagonal[i] == entry(stiffness, i, i)):
                inside[i] = False
                order[count] = i
                count += 1
    for t in range(count):
        inside[order[t]] = True
    for t in range(kept):
        inside[members[t]] = True
    return append(workspace, kept, count)


@jit_inside
def substitute_members(
    workspace: Workspace, first: int, last: int, values: Array, forward: Array
) -> None:
    """Extend one of the forward substitutions by the members first..last-1."""
    for r in range(first, last):
        forward[r] = values[workspace.members[r]]
    substitute(workspace.factor, first, last, forward)


@jit_inside
def multiply_members(workspace: Workspace, size: int, values: Array, result: Array) -> None:
    """Multiply K by a field given on the members; the result is at all nodes."""
    apply(workspace.stiffness, workspace.members, size, values, workspace.halves, result)


@jit_inside
def multiply_outside(workspace: Workspace, size: int, values: Array, result: Array) -> None:
    """Multiply K by a field given on the members; `result` holds the product there already."""
    apply_outside(
        workspace.stiffness, workspace.members, size, values, workspace.inside,
        workspace.halves, result,
    )  # fmt: skip


@jit_inside
def take_off_resting(course: Course) -> None:
    """Multiply K by the slip of the nodes that rest, into `resting`."""
    slip, workspace = course.slip, course.workspace
    values, count = workspace.right, ZERO
    for i in range(slip.shape[0]):
        if slip[i] > 0.0 and not workspace.inside[i]:
            workspace.order[count] = i
            values[count] = slip[i]
            count += 1
    apply(
        workspace.stiffness, workspace.order, count, values, workspace.halves, workspace.resting
    )


@jit_inside
def solve_forward(workspace: Workspace, size: int, load: float, solution: Array) -> None:
    """Slip of the members at a load, A_SS d = load p - s, from the forward substitutions."""
    for t in range(size):
        solution[t] = load * workspace.forward_load[t] - workspace.forward_strength[t]
    back_substitute(workspace.factor, size, solution)


@jit_inside
def singular_direction(workspace: Workspace, size: int, direction: Array) -> None:
    """The field y = (-A_SS^-1 A_Sj, 1) after `append` failed at the node j = members[size].

    It is not negative and A y <= 0, as A is a Z-matrix: a bound for the load, and the direction in
    which slip runs away.
    """
    solution = workspace.solution
    start = row_start(size)
    for t in range(size):
        solution[t] = -workspace.factor[start + t]
    back_substitute(workspace.factor, size, solution)
    for i in range(direction.shape[0]):
        direction[i] = 0.0
    for t in range(size):
        direction[workspace.members[t]] = max(solution[t], 0.0)
    direction[workspace.members[size]] = 1.0

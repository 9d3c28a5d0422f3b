"""The Cholesky factor L of A on the slipping nodes, updated as these nodes change.

Problem
-------
K is the stiffness (Pa/m), W >= 0 the weakening rate of each node (Pa/m), A = K -
diag(W), and S the list of the slipping nodes, in the order of the rows of L. This
folder solves systems

    A_SS x = b,  with A_SS = L L':  first L y = b (forward), then L' x = y (backward),           (1)

for sets S and rates W that change a little from one system to the next. A pivot
that is not positive shows that A_SS is not positive definite. The equilibrium is
then unstable.

Algorithm
---------
L is updated instead of computed again (P. Gill, G. Golub, W. Murray and M.
Saunders, Mathematics of Computation 28, 1974; G. Golub and C. Van Loan, Matrix
Computations, 2013, section 6.5).

1. Append a node j (`append`). Its row l solves L l = A_Sj. Its pivot is (A_jj -
   l'l)^1/2. If A_jj - l'l is not positive, the vector z = (-A_SS^-1 A_Sj, 1) has
   z'Az = A_jj - l'l <= 0, and A z = 0 on S (`singular_direction`).
2. Remove a node (`remove`). The rows below it move up, which leaves one entry above
   the diagonal in each of these rows. Plane rotations of neighbouring columns make
   the entry zero.
3. Raise a diagonal entry by a > 0 (`raise_diagonal`): A_SS + a e e', where e is
   the unit vector of the node. Plane rotations between the columns of L and a^1/2 e
   make a^1/2 e zero.
4. Factor A on any set of nodes (`factor_slipping`). Keep the leading rows whose
   nodes still slip and weaken no more than before. Raise the entries of nodes that
   weaken less, and append the other nodes.

Departures from the textbook, for speed:

- The rows of L are stored one after the other in a flat array. Each row is padded
  to a multiple of eight numbers. This takes half the memory of a square array, and
  no two rows compete for the same cache sets.
- Four rows are appended together, so that each row of L is read once for four new
  rows.
- A pivot counts as not positive if its square is below `PIVOT_RTOL` of the
  diagonal entry.

Node numbers are called `i`, `node` or `nodes`, and rows of L `r`, `t` and
`position`.
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

ROWS_APPENDED_TOGETHER = 4
PIVOT_RTOL = 1e-13
"""Share of the diagonal entry below which the square of a pivot is round-off."""
COST_OF_ROTATING_ROW = 4
"""Time to rotate one entry of a row, in units of the time to append it in a group of rows."""
MAX_SLIPPING = 8192
"""Slipping nodes for which L has space (268 MB if all of it is used)."""


@jit
def row_start(row: int) -> int:
    """Return the index at which a row of L begins in the flat array."""
    block = row >> 3
    return 32 * block * (block + 1) + 8 * (row & 7) * (block + 1)


@jit
def forward_substitute(factor: Array, first: int, last: int, values: Array) -> None:
    """Solve L x = values in place for the rows first..last-1. Rows before them are solved."""
    for r in range(first, last):
        start = row_start(r)
        row = factor[start : start + r + 1]
        values[r] = (values[r] - dot(row, values, r)) / row[r]


@jit_inside
def _forward_substitute_four(factor: Array, n_rows: int) -> None:
    """Solve L x = values in place for four right sides, which are the rows after `n_rows` in L.

    Two columns are processed at a time. Eight running sums keep the processor's
    vector units busy.
    """
    s0 = row_start(n_rows)
    s1 = row_start(n_rows + 1)
    s2 = row_start(n_rows + 2)
    s3 = row_start(n_rows + 3)
    x0 = factor[s0 : s0 + n_rows]
    x1 = factor[s1 : s1 + n_rows]
    x2 = factor[s2 : s2 + n_rows]
    x3 = factor[s3 : s3 + n_rows]
    k = 0
    while k + 1 < n_rows:
        base = row_start(k)
        u = factor[base : base + k + 1]
        base = row_start(k + 1)
        v = factor[base : base + k + 2]
        vectorised = k - k % LANES
        p0 = p1 = p2 = p3 = zeros()
        q0 = q1 = q2 = q3 = zeros()
        for t in range(0, vectorised, LANES):
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
        for t in range(vectorised, k):
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
    if k < n_rows:
        base = row_start(k)
        u = factor[base : base + k + 1]
        x0[k] = (x0[k] - dot(u, x0, k)) / u[k]
        x1[k] = (x1[k] - dot(u, x1, k)) / u[k]
        x2[k] = (x2[k] - dot(u, x2, k)) / u[k]
        x3[k] = (x3[k] - dot(u, x3, k)) / u[k]


@jit
def raise_diagonal(
    factor: Array, n_rows: int, position: int, amount: float, rotations: Array
) -> None:
    """Step 3: add a positive amount to the diagonal entry of A_SS at a position.

    `rotations` is a workspace for the cosines and sines of the rotations.
    """
    cosines, sines = rotations[0], rotations[1]
    for r in range(position, n_rows):
        start = row_start(r)
        row = factor[start : start + r + 1]
        # The entry of this row in the column a^1/2 e, after the rotations of the
        # rows above.
        added = math.sqrt(amount) if r == position else 0.0
        for k in range(position, r):
            L_rk = row[k]
            row[k] = multiply_add(sines[k], added, cosines[k] * L_rk)
            added = multiply_add(cosines[k], added, -sines[k] * L_rk)
        pivot = math.sqrt(row[r] * row[r] + added * added)
        cosines[r] = row[r] / pivot
        sines[r] = added / pivot
        row[r] = pivot


@jit
def back_substitute(factor: Array, n_rows: int, values: Array) -> None:
    """Solve L' x = values in place, with four rows of L at a time."""
    i = n_rows
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
            reduced = multiply_add(-z0, r0[t], values[t])
            reduced = multiply_add(-z1, r1[t], reduced)
            reduced = multiply_add(-z2, r2[t], reduced)
            values[t] = multiply_add(-z3, r3[t], reduced)
    while i > 0:
        i -= 1
        start = row_start(i)
        row = factor[start : start + i + 1]
        z = values[i] / row[i]
        values[i] = z
        for t in range(i):
            values[t] = multiply_add(-z, row[t], values[t])


class Workspace(NamedTuple):
    """Factor L on the slipping nodes of a sample, and the arrays that belong to L.

    Arrays have an entry for each node (n,), or in S for each row of L.
    """

    stiffness: Any  # K as kernels take it: `elasticity.stiffness`
    max_slipping: int  # rows for which L has space
    factor: Array  # L, row by row
    slipping: NDArray[np.int64]  # S
    queue: NDArray[np.int64]  # nodes to append
    is_slipping: NDArray[np.bool_]
    diagonal: Array  # of A
    rotations: Array  # (2, n): cosines and sines
    halves: Array  # workspace of products with K
    n_factored: NDArray[np.int64]  # (1,): rows of L that hold for `slipping`
    n_substituted: NDArray[np.int64]  # (1,): rows for which `Linv_drive` holds
    factored_diagonal: Array  # of A as it is in L, in S
    Linv_p: Array  # L^-1 times the load profile, in S
    Linv_q: Array  # L^-1 times the strength at zero slip, in S
    Linv_drive: Array  # L^-1 times `substituted_drive`, in S
    substituted_drive: Array  # drive of the last step of a jump, in S
    margins: Array  # by which `queue` is sorted
    rhs: Array  # a right side
    K_resting: Array  # K times the slip of nodes that slipped and rest
    solution: Array  # in S
    v: Array  # growth of slip with the load, m/Pa, in S
    direction: Array
    Kv: Array  # K times v


def make_workspace(stiffness: Any, n: int, max_slipping: int = MAX_SLIPPING) -> Workspace:
    """Return a workspace for samples with n nodes. Unused pages of L take no memory."""
    capacity = min(n, max_slipping)
    return Workspace(
        stiffness,
        max_slipping,
        np.empty(row_start(capacity + 4)),
        np.empty(n + 4, dtype=np.int64),
        np.empty(n, dtype=np.int64),
        np.empty(n, dtype=np.bool_),
        np.empty(n),
        np.empty((2, n + 4)),
        np.empty((2, n // 2)),
        *np.zeros((2, 1), dtype=np.int64),
        *np.zeros((12, n + 4)),
    )


class SlipState(NamedTuple):
    """Slip of a sample. It is updated as the load rises or a patch jumps."""

    sample: StaticSample
    slip: Array  # d, m
    Kd: Array  # K d, Pa
    workspace: Workspace
    may_stop: bool  # whether slip at one node can unload another, which then stops
    held: bool = False  # whether to go on once all has slipped that can, held by nodes beyond


@jit
def append(workspace: Workspace, n_slipping: int, count: int) -> int:
    """Step 1: append queue[:count] to S and L, until all are appended or a pivot fails.

    Returns the number of rows in L. If this number is below n_slipping + count, the
    pivot for the next node in S failed. The row of the failed node, without the
    pivot, then follows the last row in L.
    """
    factor, slipping, queue = workspace.factor, workspace.slipping, workspace.queue
    stiffness, diagonal = workspace.stiffness, workspace.diagonal
    appended = 0
    while appended < count:
        group = min(ROWS_APPENDED_TOGETHER, count - appended)
        for r in range(group):
            node = queue[appended + r]
            start = row_start(n_slipping + r)
            row = factor[start : start + n_slipping]
            for t in range(n_slipping):
                row[t] = entry(stiffness, node, slipping[t])
        if group == 1:
            start = row_start(n_slipping)
            forward_substitute(factor, ZERO, n_slipping, factor[start : start + n_slipping])
        else:
            for r in range(group, ROWS_APPENDED_TOGETHER):
                start = row_start(n_slipping + r)
                for t in range(n_slipping):
                    factor[start + t] = 0.0
            _forward_substitute_four(factor, n_slipping)
        # The columns of the group itself, and the pivots.
        for r in range(group):
            node = queue[appended + r]
            start = row_start(n_slipping + r)
            row = factor[start : start + n_slipping + r + 1]
            for k in range(r):
                start = row_start(n_slipping + k)
                above = factor[start : start + n_slipping + k + 1]
                K_jk = entry(stiffness, node, slipping[n_slipping + k])
                row[n_slipping + k] = (K_jk - dot(above, row, n_slipping + k)) / above[
                    n_slipping + k
                ]
            pivot_squared = diagonal[node] - dot(row, row, n_slipping + r)
            slipping[n_slipping + r] = node
            if pivot_squared <= PIVOT_RTOL * diagonal[node]:
                workspace.n_factored[0] = n_slipping + r
                return n_slipping + r
            row[n_slipping + r] = math.sqrt(pivot_squared)
            workspace.factored_diagonal[n_slipping + r] = diagonal[node]
        n_slipping += group
        appended += group
    workspace.n_factored[0] = n_slipping
    return n_slipping


@jit
def remove(workspace: Workspace, n_slipping: int, position: int) -> int:
    """Step 2: remove the node at a position from S and L. Return the number of remaining nodes."""
    factor, slipping = workspace.factor, workspace.slipping
    cosines, sines = workspace.rotations[0], workspace.rotations[1]
    for r in range(position + 1, n_slipping):
        start = row_start(r)
        row = factor[start : start + r + 1]
        start = row_start(r - 1)
        new = factor[start : start + r]  # the place of the row above, which has moved already
        removed = row[position]
        for k in range(position):
            new[k] = row[k]
        for k in range(position, r - 1):
            L_rk = row[k + 1]
            new[k] = cosines[k] * L_rk + sines[k] * removed
            removed = cosines[k] * removed - sines[k] * L_rk
        pivot = math.sqrt(row[r] * row[r] + removed * removed)
        cosines[r - 1] = row[r] / pivot
        sines[r - 1] = removed / pivot
        new[r - 1] = pivot
        slipping[r - 1] = slipping[r]
        workspace.factored_diagonal[r - 1] = workspace.factored_diagonal[r]
    workspace.n_factored[0] = n_slipping - 1
    return n_slipping - 1


@jit
def factor_slipping(workspace: Workspace) -> int:
    """Step 4: factor A on the nodes marked by `is_slipping`. The result is as in `append`."""
    stiffness, diagonal = workspace.stiffness, workspace.diagonal
    slipping, queue, is_slipping = workspace.slipping, workspace.queue, workspace.is_slipping
    factored_diagonal, n_factored = workspace.factored_diagonal, workspace.n_factored[0]
    n_kept = n_unchanged = n_raised = ZERO
    while n_kept < n_factored:
        i = slipping[n_kept]
        if not is_slipping[i] or diagonal[i] < factored_diagonal[n_kept]:
            break
        if diagonal[i] > factored_diagonal[n_kept]:
            n_raised += 1
        elif n_raised == 0:
            n_unchanged += 1
        n_kept += 1
    if COST_OF_ROTATING_ROW * n_raised * (n_kept - n_unchanged) > n_kept * n_kept:
        n_kept = n_unchanged  # it is faster to compute the other rows again
    for t in range(n_kept):
        i = slipping[t]
        is_slipping[i] = False  # for now: only nodes without a row are left marked
        if diagonal[i] > factored_diagonal[t]:
            rise = diagonal[i] - factored_diagonal[t]
            raise_diagonal(workspace.factor, n_kept, t, rise, workspace.rotations)
            factored_diagonal[t] = diagonal[i]
    # Nodes that weaken no more come first. Most nodes of a growing crack are
    # such, and the rows at the top of L are kept longest.
    count = ZERO
    for may_weaken in (False, True):
        for i in range(is_slipping.shape[0]):
            if is_slipping[i] and (may_weaken or diagonal[i] == entry(stiffness, i, i)):
                is_slipping[i] = False
                queue[count] = i
                count += 1
    for t in range(count):
        is_slipping[queue[t]] = True
    for t in range(n_kept):
        is_slipping[slipping[t]] = True
    return append(workspace, n_kept, count)


@jit_inside
def substitute_slipping(
    workspace: Workspace, first: int, last: int, values: Array, Linv_values: Array
) -> None:
    """Extend L^-1 times a field with `values` at the nodes by the rows first..last-1."""
    for r in range(first, last):
        Linv_values[r] = values[workspace.slipping[r]]
    forward_substitute(workspace.factor, first, last, Linv_values)


@jit_inside
def multiply_slipping(
    workspace: Workspace, n_slipping: int, values: Array, product: Array
) -> None:
    """Multiply K by a field that has `values` in S and is zero elsewhere."""
    apply(
        workspace.stiffness, workspace.slipping, n_slipping, values, workspace.halves, product
    )


@jit_inside
def multiply_outside(
    workspace: Workspace, n_slipping: int, values: Array, product: Array
) -> None:
    """Multiply as in `multiply_slipping`, but do not change the product at the slipping nodes.

    (On a line these entries are overwritten with the same product, up to round-off.)
    """
    apply_outside(
        workspace.stiffness, workspace.slipping, n_slipping, values, workspace.is_slipping,
        workspace.halves, product,
    )  # fmt: skip


@jit_inside
def apply_stiffness_to_resting_slip(state: SlipState) -> None:
    """Write K times the slip of nodes that slipped and now rest to `workspace.K_resting`.

    Overwrites `workspace.queue` and `workspace.rhs`.
    """
    slip, workspace = state.slip, state.workspace
    nodes, values, count = workspace.queue, workspace.rhs, ZERO
    for i in range(slip.shape[0]):
        if slip[i] > 0.0 and not workspace.is_slipping[i]:
            nodes[count] = i
            values[count] = slip[i]
            count += 1
    apply(workspace.stiffness, nodes, count, values, workspace.halves, workspace.K_resting)


@jit_inside
def solve_slip(workspace: Workspace, n_slipping: int, load: float, slip: Array) -> None:
    """Solve A_SS d = load p - q for the slip in S, given L^-1 p and L^-1 q."""
    for t in range(n_slipping):
        slip[t] = load * workspace.Linv_p[t] - workspace.Linv_q[t]
    back_substitute(workspace.factor, n_slipping, slip)


@jit_inside
def singular_direction(workspace: Workspace, n_factored: int, direction: Array) -> None:
    """Write z = (-A_SS^-1 A_Sj, 1), clipped at zero, after `append` failed at node j.

    If K has no positive off-diagonal entry, z >= 0 and A z <= 0 everywhere. Then z is
    a multiplier that bounds the load from above, and the direction in which slip
    jumps. The entries of z in S, without clipping, are left in `workspace.solution`.
    """
    z = workspace.solution
    start = row_start(n_factored)
    for t in range(n_factored):
        z[t] = -workspace.factor[start + t]
    back_substitute(workspace.factor, n_factored, z)
    for i in range(direction.shape[0]):
        direction[i] = 0.0
    for t in range(n_factored):
        direction[workspace.slipping[t]] = max(z[t], 0.0)
    direction[workspace.slipping[n_factored]] = 1.0

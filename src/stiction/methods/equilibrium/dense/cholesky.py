"""The Cholesky factor L of A on the slipping nodes, updated as these nodes change.

Problem
-------
K is the stiffness (Pa/m), W >= 0 the weakening rate of each node
(Pa/m), A = K - diag(W), and S the list of slipping nodes, ordered like
the rows of L. This folder solves systems

    A_SS x = b,  with A_SS = L L':  first L y = b (forward), then L' x = y (backward),  (1)

for sets S and rates W that change a little from one system to the next.
A pivot that is not positive shows that A_SS is not positive definite.
The equilibrium is then unstable.

Algorithm
---------
L is updated rather than computed again (P. Gill, G. Golub, W. Murray
and M. Saunders, Mathematics of Computation 28, 1974; G. Golub and C.
Van Loan, Matrix Computations, 2013, section 6.5).

1. Append a node j (`append`). Its row l solves L l = A_Sj. Its pivot is
   (A_jj - l'l)^1/2. If A_jj - l'l is not positive, the vector z =
   (-A_SS^-1 A_Sj, 1) has z'Az = A_jj - l'l <= 0, and A z = 0 on S
   (`singular_direction`).
2. Remove a node (`remove`). The rows below it move up, which leaves one
   entry above the diagonal in each of these rows. Plane rotations of
   neighbouring columns make the entry zero.
3. Raise a diagonal entry by a > 0 (`raise_diagonal`): A_SS + a e e',
   where e is the unit vector of the node. Plane rotations between the
   columns of L and a^1/2 e make a^1/2 e zero.
4. Factor A on any set of nodes (`factor_slipping`). Keep the leading
   rows whose nodes still slip and weaken no more than before. Raise the
   entries of nodes that weaken less, and append the other nodes.

Departures from the textbook, for speed:

- The rows of L are stored one after the other in a flat array. Each row
  is padded to a multiple of eight numbers. This takes half the memory
  of a square array, and no two rows compete for the same cache sets.
- Four rows are appended together, so that each row of L is read once
  for four new rows.
- A pivot counts as not positive if its square is below `PIVOT_RTOL` of
  the diagonal entry.

Node numbers are called `i`, `node` or `nodes`, and rows of L `r`, `t`
and `position`.

Example
-------
A has 1 on its diagonal and -1 elsewhere. The first pivot is 1. The
second node has the row l = -1, and its pivot 1 - l'l is zero, so only
one row is appended:

>>> from stiction.elasticity.protocol import DenseEntries
>>> K = np.array([[2.0, -1, -1], [-1, 2, -1], [-1, -1, 2]])
>>> workspace = make_workspace(DenseEntries(K.ravel(), 3, 0.0), 3)
>>> workspace.diagonal[:3], workspace.is_slipping[:3], workspace.queue[:2] = 1.0, False, (0, 1)
>>> append(workspace, 0, 2)
1

All four steps on 24 nodes. Here `is_factor` compares L L' with A on the nodes in S:

>>> n, i = 24, np.arange(24)
>>> K = np.diag(30.0 + i) - np.abs(np.cos(np.add.outer(i, i) + np.outer(i, i)))
>>> workspace = make_workspace(DenseEntries(K.ravel(), n, 0.0), n)
>>> A, workspace.diagonal[:], workspace.is_slipping[:] = K.copy(), np.diag(K), False
>>> def is_factor(count):
...     S, L = workspace.slipping[:count], np.zeros((count, count))
...     for r in range(count):
...         L[r, : r + 1] = workspace.factor[row_start(r) : row_start(r) + r + 1]
...     marked = workspace.is_slipping.nonzero()[0].tolist() == sorted(S.tolist())
...     return marked and np.allclose(L @ L.T, A[np.ix_(S, S)], atol=1e-9)
>>> workspace.queue[:18] = (5 * i[:18] + 3) % n  # 3, 8, 13, ...
>>> append(workspace, 0, 5), is_factor(5)
(5, True)
>>> workspace.queue[:13] = workspace.queue[5:18].copy()
>>> append(workspace, 5, 13), is_factor(18)
(18, True)
>>> remove(workspace, 18, 4)
17
>>> is_factor(17)
True
>>> remove(workspace, 17, 16)
16
>>> is_factor(16)
True
>>> j = workspace.slipping[3]
>>> A[j, j] = workspace.diagonal[j] = workspace.factored_diagonal[3] = K[j, j] + 2.5
>>> raise_diagonal(workspace, 16, 3, 2.5)
>>> is_factor(16)
True

Then the nodes of two rows stop, node 21 joins, and some nodes weaken less or
more. A keeps the node that weakens less in its row:

>>> def change(row, amount):
...     j = workspace.slipping[row]
...     A[j, j] = workspace.diagonal[j] = A[j, j] + amount
>>> workspace.is_slipping[workspace.slipping[[9, 12]]] = False
>>> workspace.is_slipping[21], kept = True, workspace.slipping[:9].tolist()
>>> change(2, 1.5)
>>> change(13, -0.5)
>>> factor_slipping(workspace)
15
>>> is_factor(15)
True
>>> workspace.slipping[:9].tolist() == kept
True
>>> change(12, 3.5), factor_slipping(workspace), is_factor(15)
(None, 15, True)
>>> change(5, -0.5), factor_slipping(workspace), is_factor(15)
(None, 15, True)
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
from stiction.methods.equilibrium.strength import StaticSample

ROWS_APPENDED_TOGETHER = 4
PIVOT_RTOL = 1e-13
"""Fraction of the diagonal entry below which the square of a pivot is
round-off."""
COST_OF_ROTATING_ROW = 4
"""Time to rotate one entry of a row, in units of the time to append it
in a group of rows."""
MAX_SLIPPING = 8192
"""Number of slipping nodes for which L has space (268 MB if all is used)."""


@jit
def row_start(row: int) -> int:
    """Return the index at which a row of L begins in the flat array.

    The rows 0 to 7 take 8 numbers each, and the rows 8 to 15 take 16 each:

    >>> [row_start(r) for r in (0, 1, 7, 8, 9, 15, 16, 17)]
    [0, 8, 56, 64, 80, 176, 192, 216]
    """
    block = row >> 3
    return 32 * block * (block + 1) + 8 * (row & 7) * (block + 1)


@jit_inside
def row_slice(row: int, length: int) -> slice:
    """Return the slice of the flat array with the first entries in a row of L.

    >>> row_slice.py_func(9, 4)
    slice(80, 84, None)
    """
    start = row_start(row)
    return slice(start, start + length)


@jit
def forward_substitute(factor: Array, first: int, last: int, values: Array) -> None:
    """Solve L x = values in place for the rows first..last-1.

    Rows before them are solved.

    L has the rows (2), (1, 4) and (3, 1, 5):

    >>> L = np.zeros(24)
    >>> L[0], L[8:10], L[16:19] = 2.0, (1.0, 4.0), (3.0, 1.0, 5.0)
    >>> x = np.array([4.0, 10.0, 18.0])
    >>> forward_substitute(L, 0, 3, x)
    >>> x.tolist()
    [2.0, 2.0, 2.0]
    >>> x = np.array([2.0, 2.0, 18.0])  # the first two rows are solved
    >>> forward_substitute(L, 2, 3, x)
    >>> x.tolist()
    [2.0, 2.0, 2.0]
    """
    for r in range(first, last):
        row = factor[row_slice(r, r + 1)]
        values[r] = (values[r] - dot(row, values, r)) / row[r]


@jit_inside
def _solve_two(x: Array, k: int, corner: tuple[float, ...], u_x: float, v_x: float) -> None:
    """Solve L x = values for the entries k and k + 1, from two rows u and v of L.

    The corner of L holds 1/u_k, v_k and 1/v_k+1. u_x and v_x are the
    inner products of the rows with the first k entries of x.

    Rows (..., 2) and (..., 3, 4) with the inner products 1 and 2 of the entries before:

    >>> x = np.array([9.0, 7.0, 15.0])
    >>> _solve_two.py_func(x, 1, (1 / 2.0, 3.0, 1 / 4.0), 1.0, 2.0)
    >>> x.tolist()
    [9.0, 3.0, 1.0]
    """
    x[k] = (x[k] - u_x) * corner[0]
    x[k + 1] = (x[k + 1] - v_x - corner[1] * x[k]) * corner[2]


@jit_inside
def _forward_substitute_four(factor: Array, n_rows: int) -> None:
    """Solve L x = values in place for four right sides, which are the rows after `n_rows` in L.

    Two rows u and v of L are processed at a time.
    Eight running sums, of each row times each right
    side, keep the processor's vector units busy.
    """
    x0 = factor[row_slice(n_rows, n_rows)]
    x1 = factor[row_slice(n_rows + 1, n_rows)]
    x2 = factor[row_slice(n_rows + 2, n_rows)]
    x3 = factor[row_slice(n_rows + 3, n_rows)]
    k = 0
    while k + 1 < n_rows:
        u = factor[row_slice(k, k + 1)]
        v = factor[row_slice(k + 1, k + 2)]
        vectorised = k - k % LANES
        p0 = p1 = p2 = p3 = zeros()
        q0 = q1 = q2 = q3 = zeros()
        for t in range(0, vectorised, LANES):
            p, q = load(u, t), load(v, t)
            y0, y1, y2, y3 = load(x0, t), load(x1, t), load(x2, t), load(x3, t)
            p0, q0 = multiply_add(p, y0, p0), multiply_add(q, y0, q0)
            p1, q1 = multiply_add(p, y1, p1), multiply_add(q, y1, q1)
            p2, q2 = multiply_add(p, y2, p2), multiply_add(q, y2, q2)
            p3, q3 = multiply_add(p, y3, p3), multiply_add(q, y3, q3)
        u0, u1, u2, u3 = totals(p0, p1, p2, p3)
        v0, v1, v2, v3 = totals(q0, q1, q2, q3)
        for t in range(vectorised, k):
            u0, v0 = multiply_add(u[t], x0[t], u0), multiply_add(v[t], x0[t], v0)
            u1, v1 = multiply_add(u[t], x1[t], u1), multiply_add(v[t], x1[t], v1)
            u2, v2 = multiply_add(u[t], x2[t], u2), multiply_add(v[t], x2[t], v2)
            u3, v3 = multiply_add(u[t], x3[t], u3), multiply_add(v[t], x3[t], v3)
        corner = 1.0 / u[k], v[k], 1.0 / v[k + 1]
        _solve_two(x0, k, corner, u0, v0)
        _solve_two(x1, k, corner, u1, v1)
        _solve_two(x2, k, corner, u2, v2)
        _solve_two(x3, k, corner, u3, v3)
        k += 2
    if k < n_rows:  # the last row of an odd number
        u = factor[row_slice(k, k + 1)]
        for x in (x0, x1, x2, x3):
            x[k] = (x[k] - dot(u, x, k)) / u[k]


@jit
def back_substitute(factor: Array, n_rows: int, values: Array) -> None:
    """Solve L' x = values in place, with four rows of L at a time.

    >>> i = np.arange(7)
    >>> L, rows = np.zeros(row_start(7)), np.tril(np.add.outer(2 * i, i) % 5 + 1.0)
    >>> for r in i:
    ...     L[row_start(r) : row_start(r) + r + 1] = rows[r, : r + 1]
    >>> for n in (3, 7):
    ...     x = i[:n] + 1.0
    ...     back_substitute(L, n, x)
    ...     print(np.allclose(rows[:n, :n].T @ x, i[:n] + 1.0))
    True
    True
    """
    i = n_rows
    while i >= 4:
        i -= 4
        r0 = factor[row_slice(i, i + 1)]
        r1 = factor[row_slice(i + 1, i + 2)]
        r2 = factor[row_slice(i + 2, i + 3)]
        r3 = factor[row_slice(i + 3, i + 4)]
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
        row = factor[row_slice(i, i + 1)]
        z = values[i] / row[i]
        values[i] = z
        for t in range(i):
            values[t] = multiply_add(-z, row[t], values[t])


class Workspace(NamedTuple):
    """Factor L on the slipping nodes of a sample, and arrays that belong to L.

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
    factored_diagonal: Array  # of A as it is in L, in S
    Linv_p: Array  # L^-1 times the load profile, in S
    Linv_q: Array  # L^-1 times the strength at zero slip, in S
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
    factor, slipping = np.empty(row_start(capacity + 4)), np.empty(n + 4, dtype=np.int64)
    queue, is_slipping = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.bool_)
    return Workspace(
        stiffness, max_slipping, factor, slipping, queue, is_slipping, np.empty(n),
        np.empty((2, n + 4)), np.empty((2, n // 2)), np.zeros(1, dtype=np.int64),
        *np.zeros((10, n + 4)),
    )  # fmt: skip


class SlipState(NamedTuple):
    """Slip of a sample, updated as the load rises or a patch jumps."""

    sample: StaticSample
    slip: Array  # d, m
    Kd: Array  # K d, Pa
    workspace: Workspace
    may_stop: bool  # whether slip at one node can unload another, which then stops
    goes_on: bool = False  # whether a path or jump goes on once every node that can break slips


@jit
def append(workspace: Workspace, n_slipping: int, count: int) -> int:
    """Step 1: append queue[:count] to S and L, until all are appended or a pivot fails.

    Appended nodes are marked in `is_slipping`. Returns the number of
    rows in L. If this number is below n_slipping + count, the pivot for
    the next node in S failed. The row of the failed node, without the
    pivot, then follows the last row in L.
    """
    factor, slipping, stiffness = workspace.factor, workspace.slipping, workspace.stiffness
    diagonal = workspace.diagonal
    n_factored, n_goal = n_slipping, n_slipping + count
    while n_factored < n_goal:
        nodes = workspace.queue[n_factored - n_slipping :]
        group = min(ROWS_APPENDED_TOGETHER, n_goal - n_factored)
        # The columns of the rows that L had before the group.
        for r in range(1 if group == 1 else ROWS_APPENDED_TOGETHER):
            row = factor[row_slice(n_factored + r, n_factored)]
            for t in range(n_factored):
                # Rows without a node are zero.
                row[t] = entry(stiffness, nodes[r], slipping[t]) if r < group else 0.0
        if group == 1:
            row = factor[row_slice(n_factored, n_factored)]
            forward_substitute(factor, ZERO, n_factored, row)
        else:
            _forward_substitute_four(factor, n_factored)
        # The columns of the group itself, and the pivots.
        for r in range(n_factored, n_factored + group):
            node = slipping[r] = nodes[r - n_factored]
            row = factor[row_slice(r, r + 1)]
            for k in range(n_factored, r):
                above = factor[row_slice(k, k + 1)]
                row[k] = (entry(stiffness, node, slipping[k]) - dot(above, row, k)) / above[k]
            pivot_squared = diagonal[node] - dot(row, row, r)
            if pivot_squared <= PIVOT_RTOL * diagonal[node]:
                workspace.n_factored[0] = r
                return r
            row[r] = math.sqrt(pivot_squared)
            workspace.factored_diagonal[r] = diagonal[node]
            workspace.is_slipping[node] = True
        n_factored += group
    workspace.n_factored[0] = n_factored
    return n_factored


@jit
def remove(workspace: Workspace, n_slipping: int, position: int) -> int:
    """Step 2: remove the node at a position from S, the marks and L.

    Return the number left.
    """
    factor, slipping = workspace.factor, workspace.slipping
    cosines, sines = workspace.rotations[0], workspace.rotations[1]
    workspace.is_slipping[slipping[position]] = False
    for r in range(position + 1, n_slipping):
        row = factor[row_slice(r, r + 1)]
        new = factor[row_slice(r - 1, r)]  # the place of the row above, which has moved already
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
def raise_diagonal(workspace: Workspace, n_rows: int, position: int, amount: float) -> None:
    """Step 3: add a positive amount to the diagonal entry of A_SS at a position."""
    factor, rotations = workspace.factor, workspace.rotations
    cosines, sines = rotations[0], rotations[1]
    for r in range(position, n_rows):
        row = factor[row_slice(r, r + 1)]
        # The entry of this row in the column a^1/2 e, after the
        # rotations of the rows above.
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
def factor_slipping(workspace: Workspace) -> int:
    """Step 4: factor A on the nodes marked by `is_slipping`.

    The result is as in `append`.
    """
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
            raise_diagonal(workspace, n_kept, t, rise)
            factored_diagonal[t] = diagonal[i]
    # Nodes that weaken no more come first. Most nodes of a growing
    # crack are such, and the rows at the top of L are kept longest.
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
    """Extend L^-1 times a field with `values` at the nodes by the rows first..last-1.

    With L as in `forward_substitute`, only row 2 is new, and its node is 7:

    >>> from types import SimpleNamespace
    >>> L = np.zeros(24)
    >>> L[16:19] = 3.0, 1.0, 5.0
    >>> workspace, x = SimpleNamespace(factor=L, slipping=np.array([4, 5, 7])), np.full(3, 2.0)
    >>> substitute_slipping.py_func(workspace, 2, 3, np.arange(11.0, 19.0), x)
    >>> x.tolist()
    [2.0, 2.0, 2.0]
    """
    for r in range(first, last):
        Linv_values[r] = values[workspace.slipping[r]]
    forward_substitute(workspace.factor, first, last, Linv_values)


@jit_inside
def multiply_slipping(workspace: Workspace, n_slipping: int, values: Array, out: Array) -> None:
    """Multiply K by a field that has `values` in S and is zero elsewhere."""
    apply(workspace.stiffness, workspace.slipping, n_slipping, values, workspace.halves, out)


@jit_inside
def multiply_outside(workspace: Workspace, n_slipping: int, values: Array, out: Array) -> None:
    """Multiply as in `multiply_slipping`, but do not change `out` at the slipping nodes.

    (On a line these entries are overwritten with the same product, up
    to round-off.)
    """
    apply_outside(
        workspace.stiffness, workspace.slipping, n_slipping, values, workspace.is_slipping,
        workspace.halves, out,
    )  # fmt: skip


@jit_inside
def apply_stiffness_to_resting_slip(state: SlipState) -> None:
    """Write K times the slip of nodes that slipped and now rest to `workspace.K_resting`.

    The product is zero if no such node exists, as on a line. The call overwrites
    `workspace.queue` and `workspace.rhs`.
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
    """Solve A_SS d = load p - q for the slip in S, given L^-1 p and L^-1 q.

    With L = ((2), (1, 4)), L' d = 3 L^-1 p - L^-1 q = (4, 8):

    >>> from types import SimpleNamespace
    >>> L, d = np.zeros(24), np.zeros(3)
    >>> L[0], L[8:10] = 2.0, (1.0, 4.0)
    >>> Linv_p, Linv_q = np.array([2.0, 3.0, 9.0]), np.array([2.0, 1.0, 9.0])
    >>> workspace = SimpleNamespace(factor=L, Linv_p=Linv_p, Linv_q=Linv_q)
    >>> solve_slip.py_func(workspace, 2, 3.0, d)
    >>> d.tolist()
    [1.0, 2.0, 0.0]
    """
    for t in range(n_slipping):
        slip[t] = load * workspace.Linv_p[t] - workspace.Linv_q[t]
    back_substitute(workspace.factor, n_slipping, slip)


@jit_inside
def solve_v(workspace: Workspace, n_slipping: int, v: Array) -> None:
    """Solve A_SS v = p for the rates of slip with the load in S, given L^-1 p.

    With L = ((2), (1, 4)), L' v = L^-1 p = (4, 8):

    >>> from types import SimpleNamespace
    >>> L, v = np.zeros(24), np.zeros(3)
    >>> L[0], L[8:10] = 2.0, (1.0, 4.0)
    >>> solve_v.py_func(SimpleNamespace(factor=L, Linv_p=np.array([4.0, 8.0, 9.0])), 2, v)
    >>> v.tolist()
    [1.0, 2.0, 0.0]
    """
    for t in range(n_slipping):
        v[t] = workspace.Linv_p[t]
    back_substitute(workspace.factor, n_slipping, v)


@jit_inside
def write_clipped(workspace: Workspace, n_slipping: int, values: Array, field: Array) -> None:
    """Write values in S, clipped at zero, to a field (n,) that is zero at the other nodes.

    >>> from types import SimpleNamespace
    >>> workspace, field = SimpleNamespace(slipping=np.array([3, 1, 0])), np.full(4, 9.0)
    >>> write_clipped.py_func(workspace, 2, np.array([5.0, -2.0, 7.0]), field)
    >>> field.tolist()
    [0.0, 0.0, 0.0, 5.0]
    """
    for i in range(field.shape[0]):
        field[i] = 0.0
    for t in range(n_slipping):
        field[workspace.slipping[t]] = max(values[t], 0.0)


@jit_inside
def singular_direction(workspace: Workspace, n_factored: int, direction: Array) -> None:
    """Write z = (-A_SS^-1 A_Sj, 1), clipped at zero, after `append` failed at node j.

    If K has no positive off-diagonal entry, z >= 0 and A z <= 0
    everywhere. Then z is a multiplier that bounds the load from above,
    and the direction in which slip jumps. The entries of z in S,
    without clipping, are left in `workspace.solution`.
    """
    z = workspace.solution
    failed_row = workspace.factor[row_slice(n_factored, n_factored)]
    for t in range(n_factored):
        z[t] = -failed_row[t]
    back_substitute(workspace.factor, n_factored, z)
    write_clipped(workspace, n_factored, z, direction)
    direction[workspace.slipping[n_factored]] = 1.0

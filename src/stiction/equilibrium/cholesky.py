"""A Cholesky factor that grows: nodes are appended to it, in any order, until a pivot fails.

The rows of the factor lie one after the other in a flat array, each padded to a multiple of eight
numbers: half the memory of a square, and no two rows compete for the same cache sets.
"""

from __future__ import annotations

from stiction._jit import jit, jit_sums
from stiction._typing import Array

GROUP = 4
"""Rows that are appended together: each row of the factor is then read once for four new ones."""


@jit
def row_start(row: int) -> int:
    """Where a row begins in the flat array."""
    block = row >> 3
    return 32 * block * (block + 1) + 8 * (row & 7) * (block + 1)


@jit_sums
def dot(first: Array, second: Array, count: int) -> float:
    """Sum of products; numpy's own takes threads for long arrays, and then depends on how many."""
    total = 0.0
    for t in range(count):
        total += first[t] * second[t]
    return total


@jit_sums
def _solve_one(factor: Array, start: int, size: int) -> None:
    """Forward substitution of one new row, in place."""
    row = factor[start : start + size]
    for k in range(size):
        base = row_start(k)
        known = factor[base : base + k + 1]
        total = 0.0
        for t in range(k):
            total += known[t] * row[t]
        row[k] = (row[k] - total) / known[k]


@jit_sums
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
        u0 = u1 = u2 = u3 = 0.0
        v0 = v1 = v2 = v3 = 0.0
        for t in range(k):
            a = u[t]
            b = v[t]
            u0 += a * x0[t]
            u1 += a * x1[t]
            u2 += a * x2[t]
            u3 += a * x3[t]
            v0 += b * x0[t]
            v1 += b * x1[t]
            v2 += b * x2[t]
            v3 += b * x3[t]
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
        u0 = u1 = u2 = u3 = 0.0
        for t in range(k):
            a = u[t]
            u0 += a * x0[t]
            u1 += a * x1[t]
            u2 += a * x2[t]
            u3 += a * x3[t]
        x0[k] = (x0[k] - u0) / u[k]
        x1[k] = (x1[k] - u1) / u[k]
        x2[k] = (x2[k] - u2) / u[k]
        x3[k] = (x3[k] - u3) / u[k]


@jit
def append(
    factor: Array,
    size: int,
    members: Array,
    nodes: Array,
    count: int,
    coupling: Array,
    diagonal: Array,
    tolerance: float,
) -> int:
    """Append nodes to the factor of A on the members, until done or a pivot fails.

    Parameters
    ----------
    factor : (row_start(n + 4),) array, changed
    size : int
        Members so far.
    members : (n,) int array, changed
        Node numbers in the order of the factor.
    nodes, count : (n,) int array and int
        What to append, in this order.
    coupling : (n,) array
        First column of the stiffness, the matrix being coupling[|i - j|] off the diagonal.
    diagonal : (n,) array
        Diagonal of A.
    tolerance : float
        A pivot at or below this share of its diagonal counts as not positive.

    Returns
    -------
    int
        Members now. If it is less than size + count, the node after the last member failed, and
        its (unfinished) row, without the pivot, follows the last one in the factor.
    """
    done = 0
    while done < count:
        group = min(GROUP, count - done)
        for r in range(group):
            node = nodes[done + r]
            start = row_start(size + r)
            row = factor[start : start + size]
            for t in range(size):
                row[t] = coupling[abs(node - members[t])]
        if group == 1:
            _solve_one(factor, row_start(size), size)
        else:
            for r in range(group, GROUP):
                start = row_start(size + r)
                factor[start : start + size] = 0.0
            _solve_four(factor, size)
        for r in range(group):
            node = nodes[done + r]
            start = row_start(size + r)
            row = factor[start : start + size + r + 1]
            for q in range(r):
                base = row_start(size + q)
                known = factor[base : base + size + q + 1]
                entry = coupling[abs(node - members[size + q])]
                row[size + q] = (entry - dot(known, row, size + q)) / known[size + q]
            pivot = diagonal[node] - dot(row, row, size + r)
            members[size + r] = node
            if pivot <= tolerance * diagonal[node]:
                return size + r
            row[size + r] = pivot**0.5
        size += group
        done += group
    return size


@jit_sums
def raise_diagonal(factor: Array, size: int, position: int, amount: float, turns: Array) -> None:
    """Add a positive amount to one diagonal entry of the factored matrix, by plane rotations.

    Parameters
    ----------
    factor : (row_start(n + 4),) array, changed
    size, position : int
        Rows of the factor, and the row whose diagonal entry rises.
    amount : float
    turns : (>= 2, >= size) array, work space
        Cosine and sine of each rotation.
    """
    for r in range(position, size):
        start = row_start(r)
        row = factor[start : start + r + 1]
        # The column that is rotated into the factor: zero below the entry that rises.
        extra = amount**0.5 if r == position else 0.0
        for k in range(position, r):
            entry = row[k]
            row[k] = turns[0, k] * entry + turns[1, k] * extra
            extra = turns[0, k] * extra - turns[1, k] * entry
        pivot = (row[r] * row[r] + extra * extra) ** 0.5
        turns[0, r] = row[r] / pivot
        turns[1, r] = extra / pivot
        row[r] = pivot


@jit
def extend_forward(
    factor: Array, first: int, last: int, members: Array, values: Array, forward: Array
) -> None:
    """Forward substitution of node values, for rows first..last-1 of the factor."""
    for r in range(first, last):
        start = row_start(r)
        row = factor[start : start + r + 1]
        forward[r] = (values[members[r]] - dot(row, forward, r)) / row[r]


@jit_sums
def substitute(factor: Array, size: int, values: Array, forward: Array) -> None:
    """Solve L forward = values, both in the order of the rows."""
    for r in range(size):
        start = row_start(r)
        row = factor[start : start + r + 1]
        total = 0.0
        for t in range(r):
            total += row[t] * forward[t]
        forward[r] = (values[r] - total) / row[r]


@jit_sums
def back_substitute(factor: Array, size: int, right: Array, solution: Array) -> None:
    """Solve L^T solution = right, rows of L taken four at a time; `right` is used up."""
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
        z3 = right[i + 3] / r3[i + 3]
        z2 = (right[i + 2] - z3 * r3[i + 2]) / r2[i + 2]
        z1 = (right[i + 1] - z3 * r3[i + 1] - z2 * r2[i + 1]) / r1[i + 1]
        z0 = (right[i] - z3 * r3[i] - z2 * r2[i] - z1 * r1[i]) / r0[i]
        solution[i] = z0
        solution[i + 1] = z1
        solution[i + 2] = z2
        solution[i + 3] = z3
        for t in range(i):
            right[t] -= z0 * r0[t] + z1 * r1[t] + z2 * r2[t] + z3 * r3[t]
    while i > 0:
        i -= 1
        start = row_start(i)
        row = factor[start : start + i + 1]
        z = right[i] / row[i]
        solution[i] = z
        for t in range(i):
            right[t] -= z * row[t]

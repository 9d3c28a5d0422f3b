"""The stiffness K of a line or of two blocks inside kernels, which resolve it by its type.

`entry`, `mean_relief`, `apply` and `apply_outside` are for kernels only: numba puts the overload
for the type of K in their place, so that their Python bodies are never run.
"""

# numba compares the names of arguments with their annotations, so functions by type have none.
# mypy: disable-error-code="no-untyped-def"

from typing import Any

from numba.extending import overload

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit
from stiction.base.lanes import multiply_add
from stiction.elasticity.protocol import CircularEntries, DenseEntries


def entry(entries: Any, i: int, j: int) -> float:
    """Return K_ij, Pa/m."""
    raise NotImplementedError


def mean_relief(entries: Any, profile: Array, slip: Array) -> float:
    """Return by how much slip lowers the mean stress of the interface, Pa; 0 at a fixed force."""
    raise NotImplementedError


def apply(
    entries: Any, members: Array, size: int, values: Array, halves: Array, result: Array
) -> None:
    """`result` (n,) = K times a field that has `values` at the first `size` of the `members`."""
    raise NotImplementedError


def apply_outside(
    entries: Any,
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
    raise NotImplementedError


@jit
def add_four(
    target: Array, strip: Array, places: tuple[int, int, int, int], values: tuple[float, ...]
) -> None:
    """Add the contribution of four nodes to one half of a product."""
    half = target.shape[0]
    p0, p1, p2, p3 = places
    z0, z1, z2, z3 = values
    a = strip[p0 : p0 + half]
    b = strip[p1 : p1 + half]
    c = strip[p2 : p2 + half]
    d = strip[p3 : p3 + half]
    for q in range(half):
        more = multiply_add(z0, a[q], target[q])
        more = multiply_add(z1, b[q], more)
        more = multiply_add(z2, c[q], more)
        target[q] = multiply_add(z3, d[q], more)


@jit
def apply_circular(
    entries: CircularEntries,
    members: Array,
    size: int,
    values: Array,
    halves: Array,
    result: Array,
) -> None:
    """`result` (n,) = K times a field that has `values` at the first `size` of the `members`.

    Elsewhere the field is zero; `halves` (2, n/2) is a workspace.
    """
    strip = entries.strip
    half = halves.shape[1]
    for parity in range(2):
        # Sources of this parity act on targets of the other one.
        target = halves[1 - parity]
        for q in range(half):
            target[q] = 0.0
        held = 0
        p0 = p1 = p2 = p3 = ZERO
        z0 = z1 = z2 = z3 = 0.0
        for t in range(size):
            node = members[t]
            if (node & 1) != parity or values[t] == 0.0:
                continue
            # Target q of the other parity lies at odd distance 2 (q - (node >> 1)) + 1 - 2 parity.
            p0, p1, p2, p3 = half - (node >> 1) - parity, p0, p1, p2
            z0, z1, z2, z3 = values[t], z0, z1, z2
            held += 1
            if held == 4:
                add_four(target, strip, (p0, p1, p2, p3), (z0, z1, z2, z3))
                held = 0
                z0 = z1 = z2 = z3 = 0.0
        if held > 0:
            add_four(target, strip, (p0, p1, p2, p3), (z0, z1, z2, z3))
    for q in range(half):
        result[2 * q] = halves[0, q]
        result[2 * q + 1] = halves[1, q]
    for t in range(size):
        result[members[t]] += entries.column[0] * values[t]


@jit
def _apply_rows(
    entries: DenseEntries,
    members: Array,
    size: int,
    values: Array,
    start: int,
    target: Array,
) -> None:
    """`target` = K times a field that has `values` at some members, from a node `start` on."""
    n = entries.nodes
    for q in range(target.shape[0]):
        target[q] = 0.0
    for first in range(ZERO, size, 4):
        p0 = p1 = p2 = p3 = ZERO
        z0 = z1 = z2 = z3 = 0.0
        for t in range(first, min(first + 4, size)):
            p0, p1, p2, p3 = members[t] * n + start, p0, p1, p2
            z0, z1, z2, z3 = values[t], z0, z1, z2
        add_four(target, entries.rows, (p0, p1, p2, p3), (z0, z1, z2, z3))


@jit
def _apply_runs(
    entries: DenseEntries,
    members: Array,
    size: int,
    values: Array,
    inside: Array,
    result: Array,
) -> None:
    """Multiply at each run of nodes that are not inside."""
    end = ZERO
    while end < entries.nodes:
        start = end
        while end < entries.nodes and inside[end] == inside[start]:
            end += 1
        if not inside[start]:
            _apply_rows(entries, members, size, values, start, result[start:end])


@overload(entry)
def _entry(entries, i, j):
    if entries.instance_class is CircularEntries:
        return lambda entries, i, j: entries.column[abs(i - j)]
    return lambda entries, i, j: entries.rows[i * entries.nodes + j]


@overload(mean_relief)
def _mean_relief(entries, profile, slip):
    if entries.instance_class is CircularEntries:
        return lambda entries, profile, slip: 0.0

    def mean(entries, profile, slip):
        if entries.relief == 0.0:
            return 0.0
        total = 0.0
        for i in range(slip.shape[0]):
            total += profile[i] * slip[i]
        return entries.relief * total / slip.shape[0]

    return mean


@overload(apply)
def _apply(entries, members, size, values, halves, result):
    if entries.instance_class is CircularEntries:
        return lambda entries, members, size, values, halves, result: apply_circular(
            entries, members, size, values, halves, result
        )
    return lambda entries, members, size, values, halves, result: _apply_rows(
        entries, members, size, values, ZERO, result[: entries.nodes]
    )


@overload(apply_outside)
def _apply_outside(entries, members, size, values, inside, halves, result):
    if entries.instance_class is CircularEntries:
        return lambda entries, members, size, values, inside, halves, result: apply_circular(
            entries, members, size, values, halves, result
        )
    return lambda entries, members, size, values, inside, halves, result: _apply_runs(
        entries, members, size, values, inside, result
    )

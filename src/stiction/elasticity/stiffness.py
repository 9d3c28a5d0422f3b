"""Products with the stiffness K of a line or two blocks, inside kernels.

Problem
-------
For lines and for blocks, kernels need single entries K_ij (Pa/m), and K
d for a slip d that is zero except at some nodes. numba compiles a
kernel for each type of entries (`CircularEntries` on a line,
`DenseEntries` in blocks). `entry`, `mean_relief`, `apply` and
`apply_outside` are placeholders whose Python bodies are never run:
numba replaces them by the overload for the type of entries. If a type
has no overload, the compilation of a kernel raises an error.

Algorithm: our own
------------------
`apply_circular` sums columns of K. On a line K_j = 0 for even j > 0
(`line`), so even nodes act only on odd nodes, and vice versa.

1. For each parity, take the slipping nodes with this parity. They act
   on n/2 targets, which are the nodes with the other parity.
2. The entries in K from a node to its targets are n/2 consecutive
   numbers of `strip`, the odd entries of the first column three times
   over. Add them, times the slip, for four nodes at once, so that each
   target is read and written once for four nodes.
3. Join the two halves, and add the diagonal.

`_apply_rows` does the same with rows of a dense matrix, which is symmetric.
"""

# Functions that numba chooses by type have no annotations.
# mypy: disable-error-code="no-untyped-def"

from collections.abc import Callable
from typing import Any

from numba.core.errors import TypingError
from numba.extending import overload

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit
from stiction.base.lanes import multiply_add
from stiction.elasticity.protocol import CircularEntries, DenseEntries


def entry(entries: Any, i: int, j: int) -> float:
    """Return K_ij, Pa/m."""
    raise NotImplementedError


def mean_relief(entries: Any, profile: Array, slip: Array) -> float:
    """Return the amount, Pa, by which slip lowers the mean stress, or 0 under a dead load."""
    raise NotImplementedError


def apply(
    entries: Any, nodes: Array, count: int, values: Array, halves: Array, product: Array
) -> None:
    """Multiply K by a field: `values` at the first `count` of the `nodes`, and zero elsewhere.

    The result is written to `product` (n,). `halves` (2, n/2) is a
    workspace.
    """
    raise NotImplementedError


def apply_outside(
    entries: Any,
    nodes: Array,
    count: int,
    values: Array,
    is_slipping: Array,
    halves: Array,
    product: Array,
) -> None:
    """Multiply as `apply` does, but for blocks write only the nodes that do not slip.

    On a line, a part of the product costs as much as the whole product,
    so all nodes are written.
    """
    raise NotImplementedError


@jit
def add_four(
    target: Array, strip: Array, places: tuple[int, int, int, int], values: tuple[float, ...]
) -> None:
    """Add what four nodes contribute to half a product.

    >>> import numpy as np
    >>> target, strip = np.array([1.0, 2.0]), np.array([1.0, 10.0, 100.0, 1000.0, 5.0])
    >>> add_four(target, strip, (0, 2, 1, 3), (1.0, 2.0, 3.0, 4.0))
    >>> target.tolist()  # 1 + 1 + 200 + 30 + 4000, and 2 + 10 + 2000 + 300 + 20
    [4232.0, 2332.0]
    """
    half = target.shape[0]
    p0, p1, p2, p3 = places
    z0, z1, z2, z3 = values
    # Views of equal length, so that the compiler vectorises the loop.
    a = strip[p0 : p0 + half]
    b = strip[p1 : p1 + half]
    c = strip[p2 : p2 + half]
    d = strip[p3 : p3 + half]
    for q in range(half):
        value = multiply_add(z0, a[q], target[q])
        value = multiply_add(z1, b[q], value)
        value = multiply_add(z2, c[q], value)
        target[q] = multiply_add(z3, d[q], value)


@jit
def apply_circular(
    K: CircularEntries, nodes: Array, count: int, values: Array, halves: Array, product: Array
) -> None:
    """Multiply by K of a line, as `apply` does.

    Slip at seven of 12 nodes, one of which is zero, and an eighth that does not count:

    >>> import numpy as np
    >>> from stiction.elasticity.line import stiffness_column
    >>> column = stiffness_column(12, 1.0, 3.0)
    >>> entries = CircularEntries(column, np.tile(column[1::2], 3))
    >>> nodes = np.array([0, 11, 2, 4, 7, 6, 8, 10, 3])
    >>> values = np.array([1.0, 2.0, 0.0, 3.0, 4.0, 5.0, 6.0, 7.0, 9.0])
    >>> slip, product = np.zeros(12), np.empty(12)
    >>> slip[nodes[:8]] = values[:8]
    >>> apply_circular(entries, nodes, 8, values, np.empty((2, 6)), product)
    >>> K = column[np.abs(np.subtract.outer(np.arange(12), np.arange(12)))]
    >>> np.allclose(product, K @ slip)
    True
    """
    strip, half = K.strip, halves.shape[1]
    for parity in range(2):
        # 1.
        target = halves[1 - parity]
        for q in range(half):
            target[q] = 0.0
        n_waiting = 0  # nodes p0, p1, ... with slip z0, z1, ... are added in groups of four
        p0 = p1 = p2 = p3 = ZERO
        z0 = z1 = z2 = z3 = 0.0
        for t in range(count):
            node = nodes[t]
            if (node & 1) != parity or values[t] == 0.0:
                continue
            # 2. Target q lies at the odd distance 2 (q - (node >> 1)) +
            # 1 - 2 parity. Names instead of arrays let the compiler
            # keep the four nodes in registers.
            p0, p1, p2, p3 = half - (node >> 1) - parity, p0, p1, p2
            z0, z1, z2, z3 = values[t], z0, z1, z2
            n_waiting += 1
            if n_waiting == 4:
                add_four(target, strip, (p0, p1, p2, p3), (z0, z1, z2, z3))
                n_waiting = 0
                z0 = z1 = z2 = z3 = 0.0
        # The last group may be short. Its missing nodes have no slip.
        if n_waiting > 0:
            add_four(target, strip, (p0, p1, p2, p3), (z0, z1, z2, z3))
    # 3.
    for q in range(half):
        product[2 * q] = halves[0, q]
        product[2 * q + 1] = halves[1, q]
    for t in range(count):
        product[nodes[t]] += K.column[0] * values[t]


@jit
def _apply_rows(
    entries: DenseEntries, nodes: Array, count: int, values: Array, start: int, target: Array
) -> None:
    """Write K times a field with `values` at `nodes`, from the node `start` on, to `target`.

    Slip at five of six nodes, from the node 2 on:

    >>> import numpy as np
    >>> K = np.arange(36.0).reshape(6, 6) ** 1.5
    >>> K += K.T
    >>> nodes, values = np.array([5, 0, 3, 1, 2, 4]), np.array([2.0, 3.0, 1.0, 5.0, 4.0, 9.0])
    >>> slip, target = np.zeros(6), np.empty(3)
    >>> slip[nodes[:5]] = values[:5]
    >>> _apply_rows(DenseEntries(K.ravel(), 6, 0.0), nodes, 5, values, 2, target)
    >>> np.allclose(target, (K @ slip)[2:5])
    True
    """
    n = entries.n_nodes
    for q in range(target.shape[0]):
        target[q] = 0.0
    for first in range(ZERO, count, 4):
        # A short last group adds the first row with the factor zero.
        p0 = p1 = p2 = p3 = ZERO
        z0 = z1 = z2 = z3 = 0.0
        for t in range(first, min(first + 4, count)):
            p0, p1, p2, p3 = nodes[t] * n + start, p0, p1, p2
            z0, z1, z2, z3 = values[t], z0, z1, z2
        add_four(target, entries.rows, (p0, p1, p2, p3), (z0, z1, z2, z3))


@jit
def _apply_rows_outside(
    K: DenseEntries, nodes: Array, count: int, values: Array, is_slipping: Array, product: Array
) -> None:
    """Write K times a field at the nodes that do not slip, run by run.

    >>> import numpy as np
    >>> K = np.arange(36.0).reshape(6, 6) ** 1.5
    >>> K += K.T
    >>> nodes, values = np.array([1, 4]), np.array([3.0, -2.0])
    >>> slip, product = np.array([0.0, 3.0, 0.0, 0.0, -2.0, 0.0]), np.full(6, np.nan)
    >>> slips, entries = slip != 0.0, DenseEntries(K.ravel(), 6, 0.0)
    >>> _apply_rows_outside(entries, nodes, 2, values, slips, product)
    >>> np.allclose(product[~slips], (K @ slip)[~slips]), np.isnan(product[slips]).tolist()
    (True, [True, True])
    """
    # Runs of nodes at rest alternate with runs of slipping nodes, which
    # are skipped.
    end = ZERO
    while end < K.n_nodes:
        start = end
        while end < K.n_nodes and is_slipping[end] == is_slipping[start]:
            end += 1
        if not is_slipping[start]:
            _apply_rows(K, nodes, count, values, start, product[start:end])


def _by_type(stub: Any, circular: Callable[..., Any], dense: Callable[..., Any]) -> None:
    """Let numba compile a function by the type of its first argument, in place of a stub."""

    @overload(stub, strict=False)
    def choose(K, *others):
        # numba's type of a named tuple knows the class of the tuple.
        kind = getattr(K, "instance_class", None)
        if kind not in (CircularEntries, DenseEntries):
            raise TypingError(
                f"entries: kernels do not know the stiffness of {K}. Give CircularEntries or"
                " DenseEntries, or add a case to `_by_type` in stiction.elasticity.stiffness"
            )
        return circular if kind is CircularEntries else dense


def _relief_of_rows(K, profile, slip):
    """Return the relief of the load by slip in blocks, Pa.

    >>> import numpy as np
    >>> profile, slip = np.array([1.5, 0.5]), np.array([2.0, 4.0])
    >>> float(_relief_of_rows(DenseEntries(profile, 2, 3.0), profile, slip))  # 3 * (3 + 2)/2
    7.5
    >>> _relief_of_rows(DenseEntries(profile, 2, 0.0), profile, slip)
    0.0
    """
    if K.relief == 0.0:
        return 0.0
    total = 0.0
    for i in range(slip.shape[0]):
        total += profile[i] * slip[i]
    return K.relief * total / slip.shape[0]


_by_type(entry, lambda K, i, j: K.column[abs(i - j)], lambda K, i, j: K.rows[i * K.n_nodes + j])
_by_type(mean_relief, lambda K, profile, slip: 0.0, _relief_of_rows)
_by_type(
    apply,
    lambda K, at, count, d, halves, out: apply_circular(K, at, count, d, halves, out),
    lambda K, at, count, d, halves, out: _apply_rows(K, at, count, d, ZERO, out[: K.n_nodes]),
)
_by_type(
    apply_outside,
    lambda K, at, count, d, slips, halves, out: apply_circular(K, at, count, d, halves, out),
    lambda K, at, count, d, slips, halves, out: _apply_rows_outside(
        K, at, count, d, slips, out
    ),
)

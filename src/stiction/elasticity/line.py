"""The static stiffness K of a line on its nodes: the first column in closed form, its product.

K is the circulant matrix of the symbol (G*/2)|k|. For an even number n of nodes it has

    K_0 = (G*/2)(2 pi/L) n/4,   K_j = -(G*/2)(2 pi/L)/(n sin^2(pi j/n)) for odd j,

0 for even j > 0: nodes of one parity act on those of the other only, which halves products.
"""

from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit
from stiction.base.lanes import multiply_add


def stiffness_column(nodes: int, length: float, modulus: float) -> Array:
    """First column of K, (nodes,), Pa/m: an even number of nodes, the period (m) and G* (Pa)."""
    scale = np.pi * modulus / length
    column = np.zeros(nodes)
    odd = np.arange(1, nodes, 2)
    column[odd] = -scale / (nodes * np.sin(np.pi * np.minimum(odd, nodes - odd) / nodes) ** 2)
    column[0] = -column[odd].sum()  # equals scale * nodes / 4; this way a uniform slip is free
    return column


class Stiffness(NamedTuple):
    """K of a line: its first column (n,), and its odd entries three times in a row, Pa/m."""

    column: Array
    strip: Array


def make_stiffness(column: Array) -> Stiffness:
    """Return the stiffness with a first column; the strip spares products index arithmetic."""
    return Stiffness(column, np.ascontiguousarray(np.tile(column[1::2], 3)))


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
def apply_stiffness(
    stiffness: Stiffness, members: Array, size: int, values: Array, halves: Array, result: Array
) -> None:
    """`result` (n,) = K times a field that has `values` at the first `size` of the `members`.

    Elsewhere the field is zero; `halves` (2, n/2) is a workspace.
    """
    strip = stiffness.strip
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
        result[members[t]] += stiffness.column[0] * values[t]


@jit
def griffith_length(drop: float, energy: float, modulus: float) -> float:
    """Critical length of a crack (m), infinite without a stress drop.

    A crack of half-length a with stress drop D (Pa) releases pi a D^2/(2 G*) at each tip
    (Griffith, 1921), and grows where that is more than the fracture energy (J/m²); the
    modulus is G* (Pa).
    """
    if drop <= 0.0:
        return np.inf
    return 4.0 * modulus * energy / (np.pi * drop * drop)

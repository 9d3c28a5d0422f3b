"""The inner product of two profiles, in the order of sums that stands in the source."""

from __future__ import annotations

from stiction.arrays import Array
from stiction.jit import jit
from stiction.lanes import LANES, add, load, multiply_add, total, zeros


@jit
def dot(first: Array, second: Array, count: int) -> float:
    """Sum of products; numpy's own takes threads for long arrays, and then depends on how many."""
    a = zeros()
    b = zeros()
    c = zeros()
    d = zeros()
    t = 0
    while t + 4 * LANES <= count:
        a = multiply_add(load(first, t), load(second, t), a)
        b = multiply_add(load(first, t + LANES), load(second, t + LANES), b)
        c = multiply_add(load(first, t + 2 * LANES), load(second, t + 2 * LANES), c)
        d = multiply_add(load(first, t + 3 * LANES), load(second, t + 3 * LANES), d)
        t += 4 * LANES
    if t + 2 * LANES <= count:
        a = multiply_add(load(first, t), load(second, t), a)
        b = multiply_add(load(first, t + LANES), load(second, t + LANES), b)
        t += 2 * LANES
    if t + LANES <= count:
        c = multiply_add(load(first, t), load(second, t), c)
        t += LANES
    rest = 0.0
    while t < count:
        rest = multiply_add(first[t], second[t], rest)
        t += 1
    return total(add(add(a, b), add(c, d))) + rest

"""Slip of given nodes of a plane, by preconditioned conjugate gradients with transforms.

A = K - W cut to the slipping nodes. A spring may hold a patch: A + spring phi phi^T is positive
definite also where A has one direction phi of negative curvature, so that states on and beyond
the turning point of the load can be solved for. The preconditioner is 1/(K(k) + W/2), cut too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.elasticity.inner_product import dot
from stiction.elasticity.transform_operator import Operator, filtered, product
from stiction.jit import jit

SOLVED = 0
NEGATIVE = 1
EXHAUSTED = 2

Mask = NDArray[np.bool_]


@jit
def inner(a: Array, b: Array) -> float:
    """Sum of products over all nodes of two fields."""
    return dot(a.reshape(-1), b.reshape(-1), a.size)


@jit
def add_scaled(target: Array, factor: float, source: Array) -> None:
    """`target` += factor * source."""
    t, s = target.reshape(-1), source.reshape(-1)
    for i in range(t.size):
        t[i] += factor * s[i]


@jit
def cut(field: Array, inside: Mask) -> None:
    """Set a field to zero outside a set of nodes."""
    values, keep = field.reshape(-1), inside.reshape(-1)
    for i in range(values.size):
        if not keep[i]:
            values[i] = 0.0


@jit
def largest_inside(field: Array, inside: Mask) -> float:
    """Largest absolute value of a field on a set of nodes."""
    values, keep = field.reshape(-1), inside.reshape(-1)
    most = 0.0
    for i in range(values.size):
        if keep[i]:
            most = max(most, abs(values[i]))
    return most


@jit
def residual_of(
    operator: Operator, spring: float, held: Array, right: Array, x: Array, out: Array
) -> None:
    """`out` = right - (A + spring held held^T) x at every node."""
    product(operator, x, out)
    force = spring * inner(held, x) if spring > 0.0 else 0.0
    values, r, h = out.reshape(-1), right.reshape(-1), held.reshape(-1)
    for i in range(values.size):
        values[i] = r[i] - values[i] - force * h[i]


@jit
def solve_inside(
    operator: Operator,
    inside: Mask,
    spring: float,
    held: Array,
    x: Array,
    residual: Array,
    workspace: Array,
    tolerance: float,
    iterations: int,
) -> tuple[int, int]:
    """Conjugate gradients for (A + spring held held^T) x = right on the nodes `inside`.

    Parameters
    ----------
    operator : Operator
    inside : (nx, ny) bool array
    spring : float
        Stiffness of the spring, Pa/m; zero for none.
    held : (nx, ny) array
        phi, of unit norm.
    x : (nx, ny) array, changed
        Guess, then solution; zero outside.
    residual : (nx, ny) array, changed
        Of the guess on entry, as from `residual_of`; afterwards that of the solution, zero outside.
    workspace : (3, nx, ny) array
        Overwritten; ``workspace[1]`` is the direction of negative curvature, if one is met.
    tolerance : float
        Largest residual allowed at a node, Pa.
    iterations : int

    Returns
    -------
    status, iterations : int
        SOLVED, NEGATIVE (curvature) or EXHAUSTED; and how many iterations it took.
    """
    z, direction, image = workspace[0], workspace[1], workspace[2]
    cut(residual, inside)
    previous = 0.0
    for iteration in range(iterations):
        if largest_inside(residual, inside) <= tolerance:
            return SOLVED, iteration
        filtered(operator, operator.inverse, residual, z)
        cut(z, inside)
        now = inner(residual, z)
        ratio = now / previous if previous > 0.0 else 0.0
        previous = now
        p, w = direction.reshape(-1), z.reshape(-1)
        for i in range(p.size):
            p[i] = w[i] + (ratio * p[i] if ratio > 0.0 else 0.0)
        product(operator, direction, image)
        if spring > 0.0:
            add_scaled(image, spring * inner(held, direction), held)
        cut(image, inside)
        curvature = inner(direction, image)
        if curvature <= 0.0:
            return NEGATIVE, iteration + 1
        step = now / curvature
        add_scaled(x, step, direction)
        add_scaled(residual, -step, image)
    return EXHAUSTED, iterations

"""Equilibrium of a plane at a fixed load, optionally with a patch held by a spring.

Find d >= 0 with A d + s - tau_0 p - mu phi >= 0, equal to zero where d > 0, and
mu = spring (alpha - <phi, d>). Nodes join where they carry more than their strength and leave where
they would slip backwards, until neither happens. Without a spring and for a Z-matrix A nodes only
join, and the result is the least equilibrium at this load. With the spring, equilibria are found on
both sides of the turning point, and mu tells which load they belong to.
"""

from __future__ import annotations

from stiction.arrays import Array
from stiction.elasticity.conjugate_gradients import (
    EXHAUSTED,
    NEGATIVE,
    SOLVED,
    Mask,
    largest_inside,
    residual_of,
    solve_inside,
)
from stiction.elasticity.transform_operator import Operator
from stiction.jit import jit

LOOSE = 0.05
"""Factor by which a residual is reduced before the set of slipping nodes is revised."""


@jit
def revise(inside: Mask, slip: Array, residual: Array, tolerance: float) -> tuple[int, int]:
    """Let overloaded nodes join and those with negative slip leave; returns how many of each."""
    keep, d, r = inside.reshape(-1), slip.reshape(-1), residual.reshape(-1)
    joined, left = 0, 0
    for i in range(d.size):
        if keep[i]:
            if d[i] < 0.0:
                keep[i] = False
                d[i] = 0.0
                left += 1
        elif r[i] > tolerance:
            keep[i] = True
            joined += 1
    return joined, left


@jit
def equilibrate(
    operator: Operator,
    right: Array,
    spring: float,
    held: Array,
    inside: Mask,
    slip: Array,
    residual: Array,
    workspace: Array,
    tolerance: float,
    iterations: int,
) -> tuple[int, int]:
    """Slip under the drive `right` = tau_0 p - s + spring alpha phi.

    Parameters
    ----------
    operator : Operator
    right : (nx, ny) array
        Pa.
    spring, held : float, (nx, ny) array
        See `solve_inside`.
    inside : (nx, ny) bool array, changed
        Nodes that slip: a guess, then the answer.
    slip : (nx, ny) array, changed
        d, m: a guess, then the answer.
    residual : (nx, ny) array, output
        right - A d - spring phi <phi, d>: not above `tolerance` anywhere if solved.
    workspace : (3, nx, ny) array
        See `solve_inside`.
    tolerance : float
        Pa.
    iterations : int
        Of conjugate gradients in all.

    Returns
    -------
    status, iterations : int
    """
    values, keep = slip.reshape(-1), inside.reshape(-1)
    for i in range(values.size):
        if not keep[i]:
            values[i] = 0.0
    residual_of(operator, spring, held, right, slip, residual)
    revise(inside, slip, residual, tolerance)
    used = 0
    status = SOLVED
    while used < iterations:
        goal = max(LOOSE * largest_inside(residual, inside), tolerance)
        status, taken = solve_inside(
            operator, inside, spring, held, slip, residual, workspace, goal, iterations - used
        )
        used += taken + 1
        if status == NEGATIVE:
            return status, used
        residual_of(operator, spring, held, right, slip, residual)
        joined, left = revise(inside, slip, residual, tolerance)
        if joined == 0 and left == 0 and largest_inside(residual, inside) <= 2.0 * tolerance:
            return SOLVED, used
        if left > 0:
            residual_of(operator, spring, held, right, slip, residual)
    return EXHAUSTED, used

"""Equilibrium at a fixed load, by conjugate gradients, optionally with a patch held by a spring.

Find d >= 0 with A d + s - tau_0 p - mu phi >= 0, equal to zero where d > 0, and
mu = spring (alpha - <phi, d>). Nodes join where they carry more than their strength and leave where
they would slip backwards, until neither happens. Without a spring and for a Z-matrix A nodes only
join, and the result is the least equilibrium at this load. With the spring, equilibria are found on
both sides of the turning point, and mu gives the load to which each belongs.
"""

from stiction.base.arrays import Array
from stiction.base.jit import jit, jit_inside
from stiction.elasticity.operator import (
    EXHAUSTED,
    MAX_ITERATIONS,
    NEGATIVE_CURVATURE,
    SOLVED,
    Mask,
    Operator,
    largest_inside,
    residual_of,
    restrict,
    solve_inside,
)

LOOSE = 0.05
"""Factor by which a residual is reduced before the set of slipping nodes is revised."""


@jit_inside
def _revise(inside: Mask, slip: Array, residual: Array, tolerance: float) -> tuple[int, int]:
    """Let overloaded nodes join and those with negative slip leave; return how many of each."""
    joined, left = 0, 0
    for i in range(slip.size):
        if inside[i]:
            if slip[i] < 0.0:
                inside[i] = False
                slip[i] = 0.0
                left += 1
        elif residual[i] > tolerance:
            inside[i] = True
            joined += 1
    return joined, left


@jit
def equilibrate(
    operator: Operator,
    right: Array,
    inside: Mask,
    slip: Array,
    residual: Array,
    tolerance: float,
) -> tuple[int, int]:
    """Slip under the drive `right` = tau_0 p - s + spring alpha phi; status and iterations.

    The nodes `inside` that slip, and their slip, are a guess, then the solution. The residual
    right - A d - spring phi <phi, d> is nowhere above `tolerance` (Pa) if it is solved.
    """
    restrict(slip, inside)
    residual_of(operator, right, slip, residual)
    _revise(inside, slip, residual, tolerance)
    used = 0
    while used < MAX_ITERATIONS:
        goal = max(LOOSE * largest_inside(residual, inside), tolerance)
        status, taken = solve_inside(operator, inside, slip, residual, goal)
        used += taken + 1
        if status == NEGATIVE_CURVATURE:
            return status, used
        residual_of(operator, right, slip, residual)
        joined, left = _revise(inside, slip, residual, tolerance)
        if joined == 0 and left == 0 and largest_inside(residual, inside) <= 2.0 * tolerance:
            return SOLVED, used
        if left > 0:
            residual_of(operator, right, slip, residual)
    return EXHAUSTED, used

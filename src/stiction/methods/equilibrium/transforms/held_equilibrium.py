"""Equilibrium at a fixed load, by conjugate gradients, optionally with a patch held by a spring.

Problem
-------
A = K - diag(W) (`elasticity.operator`), d >= 0 is the slip (m), s the strength
less initial stress at zero slip (Pa), p the load profile, phi (|phi| = 1) the
shape of a patch. Find

    d >= 0,  r = load p - s + mu phi - A d <= 0,  with r = 0 where d > 0,                     (1)
    mu = spring (alpha - <phi, d>),

the stress mu of the spring being zero if the spring holds nothing. Without a
spring, and if K has no positive entry off its diagonal, the solution is the least
equilibrium at this load. With a spring there are solutions on both sides of the
turning point. They are equilibria of the interface itself where mu = 0.

Algorithm
---------
Active set with conjugate gradients inside, as in a projected method (J. Nocedal
and S. Wright, Numerical Optimization, 2006, section 16.7), but with whole sets
instead of a line search.

1. Revise the set of the slipping nodes: overloaded nodes (r > 0) join, and nodes
   with d < 0 leave.
2. Reduce the residual on the set by `LOOSE_RESIDUAL`, or to the tolerance
   (`solve_inside`). If the curvature along a direction is negative, there is no
   stable solution: stop.
3. Compute r at all nodes and go to 1, until no node joins or leaves and r is
   small on the set.

Without a spring and positive entries off the diagonal nodes only join, so that
this ends. Otherwise only the number of iterations ends it.
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

LOOSE_RESIDUAL = 0.05
"""Factor by which a residual is reduced before the set of slipping nodes is revised."""


@jit_inside
def _revise(inside: Mask, slip: Array, residual: Array, tolerance: float) -> tuple[int, int]:
    """Step 1: return how many nodes joined and how many left."""
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
    """Solve (1) for right = load p - s + spring alpha phi. Return the status and iterations.

    The nodes `inside`, and their slip, are a guess, then the solution. If it is solved, the
    residual r is nowhere above the tolerance (Pa), and on the set within twice the tolerance.
    """
    restrict(slip, inside)
    residual_of(operator, right, slip, residual)
    _revise(inside, slip, residual, tolerance)
    iterations = 0
    while iterations < MAX_ITERATIONS:
        # 2.
        goal = max(LOOSE_RESIDUAL * largest_inside(residual, inside), tolerance)
        status, taken = solve_inside(operator, inside, slip, residual, goal)
        iterations += taken + 1
        if status == NEGATIVE_CURVATURE:
            return status, iterations
        # 3. and 1.
        residual_of(operator, right, slip, residual)
        joined, left = _revise(inside, slip, residual, tolerance)
        if joined == 0 and left == 0 and largest_inside(residual, inside) <= 2.0 * tolerance:
            return SOLVED, iterations
        if left > 0:
            residual_of(operator, right, slip, residual)
    return EXHAUSTED, iterations

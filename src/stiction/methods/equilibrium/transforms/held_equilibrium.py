"""Find an equilibrium at a fixed load by conjugate gradients.

A spring may hold a patch.

Problem
-------
Let A = K - diag(W) (`elasticity.operator`). d >= 0 is the slip (m), s
is the strength minus initial stress at zero slip (Pa), p is the load
profile, and phi (|phi| = 1) is the shape of a patch. Find

    d >= 0,  r = load p - s + mu phi - A d <= 0,  with r = 0 where d > 0,  (1)
    mu = spring (alpha - <phi, d>),

The stress mu of the spring is zero if there is no spring. Without a
spring, and if K has no positive off-diagonal entry, the solution is the
least equilibrium at this load. With a spring there are solutions on
both sides of the turning point. A solution with mu = 0 is an
equilibrium of the interface without the spring.

Algorithm
---------
The algorithm combines an active set with conjugate gradients, as in a
projected method (J. Nocedal and S. Wright, Numerical Optimization,
2006, section 16.7), but it changes whole sets rather than using a line
search.

1. Revise the set of the slipping nodes: overloaded nodes (r > 0) join,
   and nodes with d < 0 leave.
2. Reduce the residual on the set by `LOOSE_RESIDUAL`, or to the
   tolerance (`solve_inside`). If the curvature along a direction is
   negative, there is no stable solution. Then stop.
3. Compute r at all nodes and go to step 1, until no node joins or
   leaves, and r is small on the set.

Without a spring and without positive off-diagonal
entries, nodes only join, so the algorithm ends.
Otherwise only the limit on iterations ends it.
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
"""Factor by which a residual is reduced before the set of slipping
nodes is revised."""


@jit_inside
def _revise(inside: Mask, slip: Array, residual: Array, tolerance: float) -> tuple[int, int]:
    """Step 1: return the numbers of nodes that joined and left.

    Node 0 slips backwards and leaves. Node 2 is overloaded and joins. Node 3 is overloaded by
    no more than the tolerance:

    >>> import numpy as np
    >>> inside, slip = np.array([True, True, False, False]), np.array([-0.1, 0.0, 0.0, 0.0])
    >>> _revise.py_func(inside, slip, np.array([9.0, 9.0, 0.6, 0.5]), 0.5)
    (1, 1)
    >>> inside.tolist()
    [False, True, True, False]
    >>> slip.tolist()
    [0.0, 0.0, 0.0, 0.0]
    """
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
    operator: Operator, right: Array, inside: Mask, slip: Array, tolerance: float
) -> int:
    """Solve (1) for right = load p - s + spring alpha phi.

    Return the status.

    On entry, the nodes `inside` and their slip are a guess. On return,
    they are the solution. If (1) is solved, the residual r does not
    exceed the tolerance (Pa) at any node, and on the set it is within
    twice the tolerance.

    If K(k) = 8 for all waves, K d = 8 d - D on eight nodes, with the sum D of
    the slip. Nodes 0, 1 and 2 slip, so that D = (3 + 1 - 0.5 + 3 D)/8 = 0.7
    m, and node 4 leaves:

    >>> import numpy as np
    >>> from stiction.elasticity.operator import make_operator
    >>> K, right = np.array([0.0, 8, 8, 8, 8]), np.array([3, 1, -0.5, -0.71, -3, -9, -9, -9])
    >>> inside, slip = np.zeros(8, dtype=bool), np.array([0.1, 0, 0, 0, 0.2, 0, 0, 0])
    >>> inside[[0, 1, 4]] = True
    >>> equilibrate(make_operator(K, 0.0, (8,)), right, inside, slip, 1e-9) == SOLVED
    True
    >>> slip.round(6).tolist()
    [0.4625, 0.2125, 0.025, 0.0, 0.0, 0.0, 0.0, 0.0]

    With W = 5.5 Pa/m, the stiffness of m nodes that slip equally is 8 - m - 5.5 Pa/m:

    >>> inside, slip, unstable = slip < 0.0, np.zeros(8), make_operator(K, 5.5, (8,))
    >>> equilibrate(unstable, right, inside, slip, 1e-9) == NEGATIVE_CURVATURE
    True
    """
    residual = operator.residual
    # 1. Begin with the nodes that the guess overloads.
    restrict(slip, inside)
    residual_of(operator, right, slip, residual)
    _revise(inside, slip, residual, tolerance)
    iterations = 0
    while iterations < MAX_ITERATIONS:
        # 2. A rough solution is enough to see which nodes join.
        goal = max(LOOSE_RESIDUAL * largest_inside(residual, inside), tolerance)
        status, taken = solve_inside(operator, inside, slip, residual, goal)
        iterations += taken + 1  # a revision costs a product, too
        if status == NEGATIVE_CURVATURE:
            return status
        # 3. and 1.
        residual_of(operator, right, slip, residual)
        joined, left = _revise(inside, slip, residual, tolerance)
        # Round-off may let the true residual exceed the residual of
        # conjugate gradients.
        if joined == 0 and left == 0 and largest_inside(residual, inside) <= 2.0 * tolerance:
            return SOLVED
        if left > 0:  # the slip of these nodes was set to zero
            residual_of(operator, right, slip, residual)
    return EXHAUSTED

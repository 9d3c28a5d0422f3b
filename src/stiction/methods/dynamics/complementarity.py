"""Find the slip increments in an implicit step, so that no stress exceeds the strength.

Problem
-------
Find the slip increments u >= 0 (m) in a step, such that at every node

    stress g - M u <= strength after the slip,   and equality where u > 0.  (1)

g is the stress at the end of a step without slip
(`SlipProblem.trial`). M is a circulant matrix with positive
eigenvalues (`SlipProblem.symbol`, Pa/m): elasticity, memory and
radiation. The strength of a node follows a straight line, b - w u. As u
grows, the node may pass to a different line. w is the weakening rate of
the node (`SlipProblem.falling`), and g - b is `SlipProblem.driving`.

Algorithm (`solve_increment`)
-----------------------------
The algorithm is a semismooth Newton iteration in the form of a
primal-dual active set (M. Hintermueller, K. Ito and K. Kunisch, SIAM
Journal on Optimization 13, 2002):

1. Begin with the set S of nodes that already slip or whose trial stress
   exceeds their strength. Use the straight lines of the first guess.
2. On S solve (M - W) u = g - b, W = diag(w), with u = 0 elsewhere
   (`_solve`). This uses conjugate gradients (M. Hestenes and E.
   Stiefel, Journal of Research of the National Bureau of Standards 49,
   1952), preconditioned with M^-1 restricted to S. The letters are the
   same as in this source: residual r, direction p, z = M^-1 r.
3. Nodes outside S whose stress exceeds their strength join S, and nodes
   with u < 0 leave S. Every node moves to the straight line that
   belongs to its u.
4. Repeat from step 2 until no node changes.

Departures: the search ends without a result after too many iterations,
or at a direction with negative curvature (a patch is then unstable at
this step size). With a curved law, a node counts as changed only if its
strength changes by more than a bound.
"""

from typing import Any

from stiction.base.arrays import Array
from stiction.base.jit import jit_inside
from stiction.elasticity.operator import convolve
from stiction.methods.dynamics.state import Setting, SlipProblem, node_line, node_strength

_MAX_CG, _MAX_NEWTON = 400, 60  # iterations
_MIN_CURVATURE = 1e-10  # of p (M - W) p relative to p M p
_JOINING = 10.0  # stress above the strength with which a node joins, in units of the accuracy


@jit_inside
def _solve(problem: SlipProblem, accuracy: float) -> Any:
    """Step 2: improve u in place to a residual of `accuracy` (Pa).

    Return whether that succeeds.
    """
    transform, work, product = problem.transform, problem.work, problem.product
    u, slipping = problem.increment, problem.slipping
    driving, falling, n = problem.driving, problem.falling, u.size
    r, p, z = problem.cg_residual, problem.cg_direction, problem.cg_preconditioned
    convolve(transform, problem.symbol, u, work, product)
    largest = 0.0
    for i in range(n):
        r[i] = p[i] = 0.0
        if slipping[i] > 0:
            r[i] = driving[i] - product[i] + falling[i] * u[i]
            largest = max(largest, abs(r[i]))
    if not largest > accuracy:
        return largest <= accuracy  # False for NaN
    rz_before = 1.0
    for iteration in range(_MAX_CG):
        convolve(transform, problem.inverse, r, work, z)
        rz = 0.0
        for i in range(n):
            if slipping[i] > 0:
                rz += z[i] * r[i]
        beta = rz / rz_before if iteration > 0 else 0.0
        for i in range(n):
            p[i] = z[i] + beta * p[i] if slipping[i] > 0 else 0.0
        convolve(transform, problem.symbol, p, work, product)
        curvature, elastic = 0.0, 0.0  # p (M - W) p and p M p
        for i in range(n):
            if slipping[i] > 0:
                elastic += p[i] * product[i]
                product[i] -= falling[i] * p[i]
                curvature += p[i] * product[i]
        if not curvature > _MIN_CURVATURE * elastic:
            return False
        alpha = rz / curvature
        largest = 0.0
        for i in range(n):
            if slipping[i] > 0:
                u[i] += alpha * p[i]
                r[i] -= alpha * product[i]
                largest = max(largest, abs(r[i]))
        if largest <= accuracy:
            return True
        rz_before = rz
    return False


@jit_inside
def solve_increment(
    problem: SlipProblem, setting: Setting, slip: Array, accuracy: float, line_accuracy: float
) -> Any:
    """Find the slip increments of an implicit step.

    Return whether they were found.

    `problem.increment` and `problem.slipping` hold the first guess, and
    then the solution. The stress is accurate to `accuracy` (Pa). The
    strength may differ by `line_accuracy` (Pa) from the straight line
    that replaces it.
    """
    u, slipping, trial = problem.increment, problem.slipping, problem.trial
    driving, falling, product, n = problem.driving, problem.falling, problem.product, u.size
    # 1. The first slipping set and its lines.
    for i in range(n):
        if slipping[i] == 0 and trial[i] > node_strength(setting, i, slip[i]):
            slipping[i] = 1
        if slipping[i] == 0:
            u[i] = 0.0
        start, falling[i] = node_line(setting, i, slip[i], u[i])
        driving[i] = trial[i] - start
    for _ in range(_MAX_NEWTON):
        # 2. The increments of this set on these lines.
        if not _solve(problem, accuracy):
            return False
        # 3. Nodes that join, leave, or pass to another line.
        convolve(problem.transform, problem.symbol, u, problem.work, product)
        changed = 0
        for i in range(n):
            if slipping[i] == 0:
                strength = node_strength(setting, i, slip[i])
                if trial[i] - product[i] > strength + _JOINING * accuracy:
                    slipping[i] = 1
                    changed += 1
            elif u[i] < 0.0:
                slipping[i] = 0
                u[i] = 0.0
                changed += 1
            start, slope = node_line(setting, i, slip[i], u[i])
            before = driving[i] + falling[i] * u[i]
            driving[i] = trial[i] - start
            if slipping[i] > 0 and abs(driving[i] + slope * u[i] - before) > line_accuracy:
                changed += 1
            falling[i] = slope
        # 4. Done once nothing changes.
        if changed == 0:
            return True
    return False

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

    The equations of the slipping nodes have a direct solution. With a
    steeper fall a patch is unstable. (The function runs without compilation,
    with transforms by numpy.)

    >>> from types import FunctionType, SimpleNamespace
    >>> import numpy as np
    >>> def by_numpy(transform, multiplier, field, spectrum, out):
    ...     out[:] = np.fft.irfft(multiplier * np.fft.rfft(field), out.size)
    >>> plain = FunctionType(
    ...     _solve.py_func.__code__, globals() | {"convolve": by_numpy}
    ... )
    >>> symbol, falling = (
    ...     np.array([2.0, 3.0, 5.0, 6.0]),
    ...     np.array([0.5, 1.0, 9.0, 0.0, 0.25, 1.5]),
    ... )
    >>> fields = {
    ...     name: np.zeros(6) for name in ("product", "cg_residual", "cg_direction")
    ... }
    >>> problem = SimpleNamespace(
    ...     transform=None,
    ...     work=None,
    ...     symbol=symbol,
    ...     inverse=1.0 / symbol,
    ...     **fields,
    ...     cg_preconditioned=np.zeros(6),
    ...     increment=np.array([0.1, 0.2, 0.0, 0.0, 0.3, 0.0]),
    ...     slipping=np.array([1, 1, 0, 0, 1, 1]),
    ...     falling=falling,
    ...     driving=np.array([4.0, -3.0, 9.0, 9.0, 1.0, 2.0]),
    ... )
    >>> plain(problem, 1e-10)
    True
    >>> S, column = problem.slipping > 0, np.fft.irfft(symbol, 6)
    >>> M = column[abs(np.subtract.outer(np.arange(6), np.arange(6)))]
    >>> u = np.linalg.solve((M - np.diag(falling))[np.ix_(S, S)], problem.driving[S])
    >>> np.allclose(problem.increment[S], u), problem.increment[~S].tolist()
    (True, [0.0, 0.0])
    >>> problem.falling, problem.driving = 9.0 * falling, 2.0 * problem.driving
    >>> plain(problem, 1e-10)
    False
    >>> problem.driving[0] = np.nan
    >>> plain(problem, 1e-10)
    False
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

    Nodes 1 and 2 slip, and node 2 passes to its residual strength. Node 4
    leaves the first guess, and node 3 joins although its trial stress is too
    low at first. No stress exceeds the strength after the slip. (The
    functions run without compilation, with transforms by numpy.)

    >>> from types import FunctionType, SimpleNamespace
    >>> import numpy as np
    >>> def by_numpy(transform, multiplier, field, spectrum, out):
    ...     out[:] = np.fft.irfft(multiplier * np.fft.rfft(field), out.size)
    >>> peak, residual, W = np.full(6, 9.0), np.full(6, 2.0), np.full(6, 1.5)
    >>> def line(setting, i, slip, ahead):
    ...     weakens = peak[i] - W[i] * (slip + ahead) > residual[i]
    ...     return (peak[i] - W[i] * slip, W[i]) if weakens else (residual[i], 0.0)
    >>> plain = globals() | {"convolve": by_numpy, "node_line": line}
    >>> plain["node_strength"] = lambda setting, i, slip: line(
    ...     setting, i, slip, 0.0
    ... )[0]
    >>> for kernel in (_solve, solve_increment):
    ...     plain[kernel.__name__] = FunctionType(kernel.py_func.__code__, plain)
    >>> fields = (
    ...     "product",
    ...     "cg_residual",
    ...     "cg_direction",
    ...     "cg_preconditioned",
    ...     "driving",
    ...     "falling",
    ... )
    >>> symbol, trial = (
    ...     np.array([2.0, 3.0, 5.0, 6.0]),
    ...     np.array([1.0, 12.0, 20.0, 8.0, 3.0, 5.0]),
    ... )
    >>> problem = SimpleNamespace(
    ...     transform=None,
    ...     work=None,
    ...     symbol=symbol,
    ...     inverse=1.0 / symbol,
    ...     trial=trial,
    ...     **{name: np.zeros(6) for name in fields},
    ...     increment=np.array([0.0, 0.1, 0.5, 0.0, 0.2, 0.0]),
    ...     slipping=np.array([0, 1, 0, 0, 1, 0]),
    ... )
    >>> slip = np.array([0.0, 0.5, 1.0, 0.0, 0.2, 0.0])
    >>> plain["solve_increment"](problem, None, slip, 1e-9, 1e-9)
    True
    >>> u = problem.increment
    >>> after = [line(None, i, slip[i] + u[i], 0.0)[0] for i in range(6)]
    >>> above = trial - np.fft.irfft(symbol * np.fft.rfft(u), 6) - after
    >>> print(u.round(4).tolist(), problem.slipping.tolist())
    [0.0, 3.8875, 5.9688, 1.9875, 0.0, 0.0] [0, 1, 1, 1, 0, 0]
    >>> (above.round(4) + 0.0).tolist()
    [-4.1125, 0.0, 0.0, 0.0, -3.7125, -4.0]
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

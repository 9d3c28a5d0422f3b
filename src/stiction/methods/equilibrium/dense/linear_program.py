"""Load of the first instability on a line or specimen, from a linear programme.

Problem
-------
As long as strength falls linearly with slip, s_i = excess_i - W_i d_i,
the largest load (Pa) with an equilibrium is, with A = K - diag(W), slip
d >= 0 (m) and load profile p > 0,

    max {load : d >= 0, A d + excess - load p >= 0}                  (1)
      = min {<excess, y>/<p, y> : y >= 0, A y <= 0}.                 (2)

Every feasible d bounds the load from below, and every feasible y, a
multiplier, bounds the load from above. If K has no positive
off-diagonal entry, the equilibrium at a load is the least feasible slip
(R. Cottle, J.-S. Pang and R. Stone, The Linear Complementarity Problem,
1992, section 3.11), and nodes only have to be added to the set S of the
slipping nodes.

Algorithm
---------
The algorithm is our own. It solves (1) with an active set that grows,
and (2) with cuts that lower the load. It starts from an upper bound of
(2), for example from the weakest window, and from a load below this
bound.

1. At the load, find resting nodes that are overstressed. If there are
   any, add them to S, the most overstressed first. Each node adds a row
   to the factor L of A_SS (`cholesky`).
2. If all pivots are positive, solve A_SS
   d_S = load p_S - excess_S. Go to step 1.
3. If the pivot of node j fails, the load is too high. y = (-A_SS^-1
   A_Sj, 1) is feasible in (2): a cut. Lower the bound and the load to
   <excess, y>/<p, y>. Solve for the slip at this load, remove the nodes
   that would slip backwards, and go to step 1. If the cut lowers the
   load only by round-off, the load is the solution. Then `_back_off`
   makes the slip feasible, and the algorithm ends.
4. If no node is overstressed, the load has an equilibrium.
   If the load is the upper bound, it is the solution.
   Otherwise raise the load towards the bound by
   `SHARE_TOWARDS_BOUND` of the way, or to the bound if it is
   within `CLOSE_RTOL`. Solve for the slip, and go to step 1.

The order of the nodes in step 1 and the fraction in step 4 are for speed.
In a different order the search stalls near the solution. If the load is
too high, far too many nodes join before a pivot fails.

Example
-------
Three nodes have the strengths 1, 2 and 4 Pa, W = 1 Pa/m, and each pair
is coupled by 1 Pa/m. With y = (1/2, 1/2, 0), A y = (0, 0, -1) is not
positive, so no load above <excess, y> = 1.5 Pa has an equilibrium. Slip
of 0.5 m at node 0 is an equilibrium at this load:

>>> import numpy as np
>>> from stiction.elasticity.protocol import DenseEntries
>>> from stiction.methods.equilibrium.dense.cholesky import SlipState, make_workspace
>>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
>>> K = np.array([[2.0, -1, -1], [-1, 2, -1], [-1, -1, 2]])
>>> entries = DenseEntries(K.ravel(), 3, 0.0)
>>> sample = make_sample(np.array([1.0, 2, 4]), np.zeros(3), np.ones(3), np.ones(3), LINEAR)
>>> slip, Kd, y = np.zeros((3, 3))
>>> state = SlipState(sample, slip, Kd, make_workspace(entries, 3), False)
>>> solve_program(state, 1.0, 4.0, np.inf, y)
(1.5, True)
>>> slip.tolist(), y.tolist()
([0.5, 0.0, 0.0], [0.5, 0.5, 0.0])
"""

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit, jit_inside
from stiction.elasticity.stiffness import apply, entry
from stiction.methods.equilibrium.dense import cholesky
from stiction.methods.equilibrium.dense.cholesky import SlipState, Workspace
from stiction.methods.equilibrium.strength import StaticSample, strength_at

OVERSTRESS_RTOL = 1e-12
"""Fraction of the mean strength below which an overstress is round-off."""
CLOSE_RTOL = 0.02
"""Relative distance below the bound from which a stable load is raised
to the bound itself."""
SHARE_TOWARDS_BOUND = 0.75
"""Fraction of the way to the bound by which a stable load is raised."""
MAX_PASSES = 10_000
"""Most passes, each of which adds a node or changes the load."""


@jit_inside
def sort_by(keys: Array, nodes: NDArray[np.int64], count: int) -> None:
    """Sort nodes[:count] by rising keys[:count], both in place (Shell sort, Ciura's gaps).

    >>> keys, nodes = np.array([3.0, -1.0, 2.0, 0.5, -9.0]), np.arange(10, 15)
    >>> sort_by.py_func(keys, nodes, 4)
    >>> keys.tolist()
    [-1.0, 0.5, 2.0, 3.0, -9.0]
    >>> nodes.tolist()
    [11, 13, 12, 10, 14]
    >>> keys = (7.0 * np.arange(41)) % 41
    >>> sort_by.py_func(keys, np.arange(41), 41)
    >>> keys.tolist() == list(range(41))
    True
    """
    for gap in (1750, 701, 301, 132, 57, 23, 10, 4, 1):
        for i in range(gap, count):
            key, node, j = keys[i], nodes[i], i
            while j >= gap and keys[j - gap] > key:
                keys[j] = keys[j - gap]
                nodes[j] = nodes[j - gap]
                j -= gap
            keys[j] = key
            nodes[j] = node


@jit_inside
def queue_overstressed(state: SlipState, load: float, tolerance: float) -> int:
    """Write the resting nodes above their strength to `workspace.queue`.

    Return their number.

    The most overstressed node comes first. Overstress within the
    tolerance (Pa) does not count.
    """
    sample, slip, Kd, workspace, _, _ = state
    count = ZERO
    for i in range(Kd.shape[0]):
        if not workspace.is_slipping[i]:
            # On a specimen, a node that slipped before may rest at any
            # piece of its law.
            never_slipped = slip[i] == 0.0  # then its strength is known without a search
            strength = sample.excess[i] if never_slipped else strength_at(sample, slip, i)
            margin = strength - load * sample.profile[i] + Kd[i]
            if margin < -tolerance:
                workspace.margins[count] = margin
                workspace.queue[count] = i
                count += 1
    sort_by(workspace.margins, workspace.queue, count)
    return count


@jit_inside
def stress_tolerance(sample: StaticSample, load: float) -> float:
    """Return the overstress, Pa, that counts as round-off.

    |-2| + 3 x 0.5 and 4 + 3 x 1 add up to 10.5 Pa. One of the three nodes
    cannot break:

    >>> from types import SimpleNamespace
    >>> excess, profile = np.array([-2.0, np.inf, 4.0]), np.array([0.5, 7.0, 1.0])
    >>> sample = SimpleNamespace(excess=excess, profile=profile)
    >>> round(float(stress_tolerance.py_func(sample, -3.0)) * 1e12, 6)
    3.5
    """
    # Nodes with infinite strength, which cannot break, do not count.
    total, n = 0.0, sample.excess.shape[0]
    for i in range(n):
        if sample.excess[i] < np.inf:
            total += abs(sample.excess[i]) + abs(load) * sample.profile[i]
    return OVERSTRESS_RTOL * total / n


@jit_inside
def _solve(state: SlipState, load: float, n_slipping: int) -> None:
    """Write the slip of S at a load to `workspace.solution`, and K d to `state.Kd`."""
    cholesky.solve_slip(state.workspace, n_slipping, load, state.workspace.solution)
    cholesky.multiply_slipping(state.workspace, n_slipping, state.workspace.solution, state.Kd)


@jit_inside
def _back_off(state: SlipState, load: float, n_slipping: int) -> None:
    """Step 3: lower the load of the slip slightly, until no resting node is overstressed.

    Close to the solution, slip grows so fast with the load that
    round-off in the load may leave a node overstressed. One step along
    the tangent v = d d/d load corrects this. The returned load does not
    change. The certificate shows the difference between the returned
    load and the load of the slip.
    """
    sample, _, Kd, workspace, _, _ = state
    v, Kv = workspace.solution, workspace.Kv
    cholesky.solve_v(workspace, n_slipping, v)
    cholesky.multiply_slipping(workspace, n_slipping, v, Kv)
    # The largest step that any overstressed node needs.
    step = 0.0
    for i in range(Kd.shape[0]):
        margin = sample.excess[i] - load * sample.profile[i] + Kd[i]
        if margin < 0.0 and not workspace.is_slipping[i]:
            step = max(step, margin / (Kv[i] - sample.profile[i]))
    _solve(state, load - step, n_slipping)


@jit_inside
def _remove_reversed(workspace: Workspace, n_slipping: int, load: float) -> int:
    """Step 3: remove the nodes that would slip backwards from S. Return the remaining number.

    L remains valid up to the first of these nodes, so all nodes after
    it are also removed. Removed nodes that belong to S are then
    overstressed, and come back.
    """
    slip = workspace.solution
    while n_slipping > 0:
        # L^-1 p and L^-1 q hold for the leading rows, so only the back
        # substitution is repeated.
        n_forward = 0
        while n_forward < n_slipping and slip[n_forward] >= 0.0:
            n_forward += 1
        if n_forward == n_slipping:
            break
        for t in range(n_forward, n_slipping):
            workspace.is_slipping[workspace.slipping[t]] = False
        n_slipping = n_forward
        cholesky.solve_slip(workspace, n_slipping, load, slip)
    return n_slipping


@jit_inside
def _cut(state: SlipState, n_factored: int, bound: float, best: Array) -> tuple[float, float]:
    """Step 3: return the load of the cut and the new bound.

    Write its multiplier to `best`.
    """
    sample, _, _, workspace, _, _ = state
    y = workspace.direction
    cholesky.singular_direction(workspace, n_factored, y)
    excess_y = p_y = 0.0
    for t in range(n_factored + 1):
        i = workspace.slipping[t]
        excess_y += y[i] * sample.excess[i]
        p_y += y[i] * sample.profile[i]
    # By (2), no load above the cut has an equilibrium.
    cut = excess_y / p_y
    if cut < bound:
        bound = cut
        for i in range(best.shape[0]):
            best[i] = y[i] / p_y
    return cut, bound


@jit
def solve_program(
    state: SlipState, start: float, bound: float, cap: float, multiplier: Array
) -> tuple[float, bool]:
    """Return the load that solves (1), with slip d, K d and multiplier, and whether (1) is solved.

    The bound is an upper bound with its multiplier, and the first load
    is `start`. Nodes that already slip (`state.slip`) join first. If
    `cap` is below the solution, the result is the least equilibrium at
    the load `cap`. The problem is not solved if there are too many
    passes, or more slipping nodes than the workspace can hold.

    For 30 nodes, `linprog` solves (1) as well. Searches begin below or above
    the solution, end at a cap, and go on from there:

    >>> from scipy.optimize import linprog
    >>> from stiction.elasticity.protocol import DenseEntries
    >>> from stiction.methods.equilibrium.dense.cholesky import make_workspace
    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> n, i = 30, np.arange(30)
    >>> K = -1.0 / (1.0 + np.abs(np.subtract.outer(i, i))) ** 2
    >>> K -= np.diag(K.sum(axis=1) - 0.02)
    >>> W, p = 0.7 + 0.2 * np.sin(i), 1.0 + 0.1 * np.cos(2.0 * i)
    >>> excess = 3.0 + np.sin(0.9 * i) + np.cos(1.7 * i)
    >>> sample = make_sample(excess, excess - 90.0, p, W, LINEAR)
    >>> exact = -linprog(-np.eye(n + 1)[0], np.column_stack((p, np.diag(W) - K)), excess).fun
    >>> def solve(start, cap=np.inf, slip=0.0):
    ...     slip, (Kd, y, Ky) = slip + np.zeros(n), np.zeros((3, n))
    ...     workspace = make_workspace(DenseEntries(K.ravel(), n, 0.0), n)
    ...     state = SlipState(sample, slip, Kd, workspace, False)
    ...     load, solved = solve_program(state, start, np.inf if cap < np.inf else 4.0, cap, y)
    ...     overload = load * p - K @ slip - excess + W * slip
    ...     gap = certificate(sample, slip, Kd, y, workspace, Ky) if cap == np.inf else 0.0
    ...     good = overload.max() < 1e-9, np.abs(overload[slip > 0]).max() < 1e-9, gap < 1e-9
    ...     return round(load / exact, 9), solved, *map(bool, good), slip
    >>> solve(0.5)[:5]
    (1.0, True, True, True, True)
    >>> solve(9.0)[:5]
    (1.0, True, True, True, True)
    >>> *capped, known = solve(0.5, 0.95 * exact)
    >>> capped
    [0.95, True, True, True, True]
    >>> solve(0.95 * exact, slip=known)[:5]
    (1.0, True, True, True, True)
    """
    sample, slip, Kd, workspace, _, _ = state
    top = min(bound, cap)
    load = min(start, top)
    tolerance = stress_tolerance(sample, top)
    slipping, is_slipping = workspace.slipping, workspace.is_slipping
    p, excess = sample.profile, sample.excess
    # Begin without slip. The nodes of a
    # known state join at once, in any order.
    n_slipping = ZERO
    n_known = ZERO  # nodes that slip already, until they have joined
    for i in range(slip.shape[0]):
        workspace.diagonal[i] = entry(workspace.stiffness, i, i) - sample.weakening_rate[i]
        is_slipping[i] = False
        Kd[i] = 0.0
        if slip[i] > 0.0:
            workspace.queue[n_known] = i
            n_known += 1
            slip[i] = 0.0
    solved = False
    for _ in range(MAX_PASSES):
        # 1. The nodes that must slip.
        count = n_known or queue_overstressed(state, load, tolerance)
        n_known = ZERO
        if count == 0:  # 4.
            top = min(bound, cap)
            if load >= top:
                solved = True
                break
            # At the bound itself far too many nodes may join, unless
            # the load is close.
            if top - load <= CLOSE_RTOL * abs(top):
                load = top
            else:
                load = (1.0 - SHARE_TOWARDS_BOUND) * load + SHARE_TOWARDS_BOUND * top
            _solve(state, load, n_slipping)
            continue
        if n_slipping + count > workspace.max_slipping:
            break
        n_before = n_slipping
        n_slipping = cholesky.append(workspace, n_slipping, count)
        cholesky.substitute_slipping(workspace, n_before, n_slipping, p, workspace.Linv_p)
        cholesky.substitute_slipping(workspace, n_before, n_slipping, excess, workspace.Linv_q)
        if n_slipping == n_before + count:  # 2.
            _solve(state, load, n_slipping)
            continue
        # 3. A pivot failed.
        # The row of the failed node follows the last row of L, and gives the cut.
        cut, bound = _cut(state, n_slipping, bound, multiplier)
        # The load had an equilibrium up to
        # round-off if the cut hardly lowers it.
        by_round_off_only = cut >= load - tolerance
        load = min(load, bound)
        cholesky.solve_slip(workspace, n_slipping, load, workspace.solution)
        n_slipping = _remove_reversed(workspace, n_slipping, load)
        cholesky.multiply_slipping(workspace, n_slipping, workspace.solution, Kd)
        if by_round_off_only:
            solved = True
            _back_off(state, load, n_slipping)
            break
    for t in range(n_slipping):
        slip[slipping[t]] = max(workspace.solution[t], 0.0)
    return load, solved


@jit
def certificate(
    sample: StaticSample, slip: Array, Kd: Array, y: Array, workspace: Workspace, Ky: Array
) -> float:
    """Return the distance between rigorous bounds, Pa: (1) from slip, (2) from the multiplier y.

    Writes K y to `Ky`.

    With y = (1, 0.5, 0) and W = 1 Pa/m, K y = (1.5, 0, -1.5). The upper bound
    is (2 + 1.5 + 0.5 x 0.25)/1.5 Pa, because (A y)_0 is 0.5 Pa and d_0 is 0.25
    m. The lower bound is 2 + 0.25 Pa:

    >>> from stiction.elasticity.protocol import DenseEntries
    >>> from stiction.methods.equilibrium.dense.cholesky import make_workspace
    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> K = np.array([[2.0, -1, -1], [-1, 2, -1], [-1, -1, 2]])
    >>> sample = make_sample(np.array([2.0, 3, 4]), np.zeros(3), np.ones(3), np.ones(3), LINEAR)
    >>> slip, y = np.array([0.25, 0, 0]), np.array([1.0, 0.5, 0.0])
    >>> workspace, Ky = make_workspace(DenseEntries(K.ravel(), 3, 0.0), 3), np.zeros(3)
    >>> gap = certificate(sample, slip, K @ slip, y, workspace, Ky)
    >>> round(gap - (3.625 / 1.5 - 2.25), 9)
    0.0
    >>> Ky.tolist()
    [1.5, 0.0, -1.5]
    """
    n, lower, excess_y, count = slip.shape[0], np.inf, 0.0, ZERO
    # The load of (1) is the least balance over load profile, for any slip.
    for i in range(n):
        balance = sample.excess[i] + Kd[i] - sample.weakening_rate[i] * slip[i]
        lower = min(lower, balance / sample.profile[i])
        if y[i] > 0.0:
            excess_y += y[i] * sample.excess[i]
            workspace.queue[count] = i
            workspace.solution[count] = y[i]
            count += 1
    apply(workspace.stiffness, workspace.queue, count, workspace.solution, workspace.halves, Ky)
    p_y = infeasible = 0.0
    for i in range(n):
        p_y += y[i] * sample.profile[i]
        # Round-off may leave A y slightly positive. Its effect on the
        # bound, <A y, d>, is added.
        infeasible += max(Ky[i] - sample.weakening_rate[i] * y[i], 0.0) * slip[i]
    return max((excess_y + infeasible) / p_y - lower, 0.0)

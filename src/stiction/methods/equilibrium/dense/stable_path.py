"""Follow stable equilibria of a line or a specimen, event by event, while the load rises.

Problem
-------
p is the load profile, K is the stiffness (Pa/m), and d >= 0 is the slip
(m). The strength at node i, minus its initial stress, falls with slip
along straight pieces: s_i = q_i - W_i d_i. Slip is an equilibrium at a
load (Pa) if no stress exceeds the strength, and if both are equal at
slipping nodes:

    load p - K d <= s(d),  with '=' at the slipping nodes S.         (1)

With A = K - diag(W), the slip and its growth rate v with the load
(m/Pa) follow from

    A_SS d_S = load p_S - q_S - (K d_rest)_S,    A_SS v = p_S,       (2)

where d_rest is the slip of nodes that slipped before
and now rest. (2) holds until a node enters or leaves S,
or reaches a corner of its friction law. The equilibrium
is stable as long as A_SS is positive definite.

On a line, K has no positive off-diagonal entry, and a slipping node
never stops. On a specimen, K may have positive off-diagonal entries
(`may_stop`), so that slip at one node can unload other nodes. Slip
never goes back: an unloaded node rests. The rates at the nodes that
reach their strength then minimise v'Av/2 - p'v over v >= 0:

    v >= 0,  A v - p >= 0,  v'(A v - p) = 0.                         (3)

Algorithm
---------
The method is parametric quadratic programming. The solution is
piecewise linear in the load, and its kinks are found one after the
other, as on the critical line of H. Markowitz (Naval Research Logistics
Quarterly 3, 1956). Step 2 is an active-set method for (3) (J. Nocedal
and S. Wright, Numerical Optimization, 2006, section 16.5).

1. Find S and factor A_SS = L L'. If a pivot fails, go to step 5.
2. Solve (2) for the rates v of slip, and multiply them
   by K. For (3), move v from its former value towards
   the solution. The first node whose rate reaches zero
   on the way stops. Remove it from S and solve again.
3. Find the smallest load rise at which a resting node reaches
   its strength (a start), or a slipping node reaches a corner of its
   law. Raise the load. If any rise would overstress a node at its
   strength, the node starts at once. This ensures A v >= p.
4. After a start, append a row to L. After a corner, one diagonal entry
   of A_SS changes. Rotate the rows of L from this entry on, or compute
   them again if the node now weakens more steeply.
5. If a pivot of L fails, A_SS is no longer positive definite: z'Az <= 0
   for the direction z = (-A_SS^-1 A_Sj, 1) at the failed node j. If z
   >= 0, slip along z is unbounded: it jumps at constant load, and the
   path ends, unstable. Otherwise, for (3) only, v moves along z until a
   rate reaches zero. If a start failed, that node stops, and the start
   is tried again. If a corner or the first factor failed, the nodes
   without a row in L leave S, and may start again. Nodes that do not
   start again before the load rises have stopped.
6. The path ends at the target, or when every node has slipped. The path
   is abandoned if S outgrows L, or if nodes stop and start without end.

Node numbers are called `i` or `node`, positions in S (the rows of L)
`t` or `position`.

Example
-------
Three nodes have the strengths 1, 2 and 4 Pa, W = 1 Pa/m, and each pair
is coupled by 1 Pa/m. Node 0 starts at load 1 with the rate 1/A_00 = 1.
Its slip adds load - 1 to the stress of node 1, which therefore starts
at 2 load - 1 = 2, load 1.5. A_SS = [[1, -1], [-1, 1]] is then singular,
and slip jumps along (1, 1, 0):

>>> import numpy as np
>>> from stiction.elasticity.protocol import DenseEntries
>>> from stiction.methods.equilibrium.dense.cholesky import SlipState, make_workspace
>>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
>>> K = np.array([[2.0, -1, -1], [-1, 2, -1], [-1, -1, 2]])
>>> entries = DenseEntries(K.ravel(), 3, 0.0)
>>> sample = make_sample(np.array([1.0, 2, 4]), np.zeros(3), np.ones(3), np.ones(3), LINEAR)
>>> slip, Kd, direction = np.zeros((3, 3))
>>> state = SlipState(sample, slip, Kd, make_workspace(entries, 3), False)
>>> end = follow_stable_path(state, 1.0, np.inf, direction)
>>> end.load
1.5
>>> end.status.name
'UNSTABLE'
>>> slip.tolist()
[0.5, 0.0, 0.0]
>>> direction.tolist()
[1.0, 1.0, 0.0]
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit_allocating, jit_inside
from stiction.elasticity.stiffness import entry, mean_relief
from stiction.methods.equilibrium.dense import cholesky
from stiction.methods.equilibrium.dense.cholesky import SlipState
from stiction.methods.equilibrium.dense.linear_program import stress_tolerance
from stiction.methods.equilibrium.state import PathStatus
from stiction.methods.equilibrium.strength import piece_at, start_of, strength_at

EVENTS_PER_REFRESH = 16
"""Number of events after which slip is computed anew from L, so that round-off does not
accumulate."""
MAX_MARGIN_AT_STRENGTH = 1e3
"""Largest distance of a node below its strength that counts as zero, in units of
`stress_tolerance`."""
MAX_RESTARTS_PER_NODE = 16
"""Average number of starts per node after which the path is given up."""
NEGATIVE_RATE_RTOL = 1e-10
"""A rate below zero by less than this fraction of the largest rate is
round-off."""

ONE: Any = np.int64(1)  # as `ZERO`: numba would compile a kernel again for a literal
NOBODY = -1  # no position in S, no node


class PathEnd(NamedTuple):
    """End of a path."""

    load: float  # Pa
    peak: float  # largest mean stress on the way, divided by the mean of the load profile, Pa
    stopped: bool  # whether a node stopped on the way, or had stopped before
    status: PathStatus


class PathEvent(NamedTuple):
    """Next start or corner. Both are NOBODY if the target comes first."""

    step: float  # rise of the load, Pa
    starting_node: int
    corner_position: int  # in S


class Start(NamedTuple):
    """Slipping set S after a node has started to slip."""

    bounded: bool  # whether rates of slip exist; if not, the path ends
    n_slipping: int
    first_changed: int  # first row of the factor that is new
    some_stopped: bool


@jit_inside
def _find_slipping(
    state: SlipState, load: float, piece: NDArray[np.int64], q: Array
) -> tuple[int, bool]:
    """Step 1: mark the slipping nodes, and write q and the diagonal of A.

    Return the number of slipping nodes, and whether a node that
    slipped before rests.
    """
    sample, slip, Kd, workspace, may_stop, _ = state
    # A node of a specimen that slipped before may rest below its strength.
    n_slipping, some_rest = ZERO, False
    atol = MAX_MARGIN_AT_STRENGTH * stress_tolerance(sample, load)
    for i in range(slip.shape[0]):
        piece[i] = piece_at(sample, slip, i)
        q[i] = start_of(sample, i, piece[i])
        W = sample.pieces.slopes[piece[i]] * sample.weakening_rate[i]
        workspace.diagonal[i] = entry(workspace.stiffness, i, i) - W
        is_slipping = slip[i] > 0.0
        if may_stop and is_slipping:
            margin = strength_at(sample, slip, i) - load * sample.profile[i] + Kd[i]
            is_slipping = margin <= atol
            some_rest = some_rest or not is_slipping
        workspace.is_slipping[i] = is_slipping
        n_slipping += is_slipping
    return n_slipping, some_rest


@jit_inside
def _substitute(state: SlipState, q: Array, first: int, n_slipping: int) -> None:
    """Extend L^-1 p and L^-1 (q + K d of resting nodes) by the rows first..n_slipping-1 of L."""
    workspace, p = state.workspace, state.sample.profile
    for t in range(first, n_slipping):
        i = workspace.slipping[t]
        workspace.rhs[i] = q[i] + workspace.K_resting[i]
    cholesky.substitute_slipping(workspace, first, n_slipping, p, workspace.Linv_p)
    cholesky.substitute_slipping(workspace, first, n_slipping, workspace.rhs, workspace.Linv_q)


@jit_inside
def _first_to_stop(
    state: SlipState, n_slipping: int, v_nodes: Array, new: Array, endless: bool
) -> tuple[int, float]:
    """Return the first node whose rate reaches zero (position in S), and the fraction of the move.

    Rates move from `v_nodes` to `new` (in S), or, if `endless`, along
    `new` without end.

    Rates in S, at the nodes 3, 1 and 0, move from (4, 6, 5) to (2, -2, -5).
    Node 0 stops at half the way, before node 1. Along (0.5, -4, -2) without
    end, node 1 stops first:

    >>> from types import SimpleNamespace
    >>> state = SimpleNamespace(workspace=SimpleNamespace(slipping=np.array([3, 1, 0])))
    >>> v_nodes = np.array([5.0, 6.0, 9.0, 4.0])
    >>> new = np.array([2.0, -2, -5])
    >>> position, share = _first_to_stop.py_func(state, 3, v_nodes, new, False)
    >>> position, float(share)
    (2, 0.5)
    >>> new = np.array([0.5, -4, -2])
    >>> position, share = _first_to_stop.py_func(state, 3, v_nodes, new, True)
    >>> position, float(share)
    (1, 1.5)
    >>> resting = np.zeros(4)  # the node that reverses fastest stops first
    >>> _first_to_stop.py_func(state, 3, resting, np.array([-1.0, -3, -2]), True)[0]
    1
    >>> _first_to_stop.py_func(state, 3, v_nodes, np.array([2.0, -1e-11, 5]), False)
    (-1, inf)
    """
    slipping, largest = state.workspace.slipping, 0.0
    for t in range(n_slipping):
        largest = max(largest, abs(new[t]))
    # If rates of several nodes are zero already, the node that reverses
    # fastest stops first.
    first, share = NOBODY, np.inf
    for t in range(n_slipping):
        if new[t] < -NEGATIVE_RATE_RTOL * largest:
            v_now = v_nodes[slipping[t]]
            zero_at = v_now / ((0.0 if endless else v_now) - new[t])
            if zero_at < share or (zero_at == share and new[t] < new[first]):
                first, share = t, zero_at
    return first, share


@jit_inside
def _move_v(
    state: SlipState, n_slipping: int, v_nodes: Array, new: Array, share: float, endless: bool
) -> None:
    """Move the rates by a fraction of the way to `new` (in S). See `_first_to_stop`.

    Rates at the nodes 3 and 1 go half the way from 4 and 6 to 2 and -9, or half
    2 and -9 further:

    >>> from types import SimpleNamespace
    >>> state = SimpleNamespace(workspace=SimpleNamespace(slipping=np.array([3, 1, 0])))
    >>> for endless in (False, True):
    ...     v_nodes = np.array([5.0, 6.0, 9.0, 4.0])
    ...     _move_v.py_func(state, 2, v_nodes, np.array([2.0, -9.0]), 0.5, endless)
    ...     print(v_nodes.tolist())
    [5.0, 0.0, 9.0, 3.0]
    [5.0, 1.5, 9.0, 5.0]
    """
    slipping = state.workspace.slipping
    for t in range(n_slipping):
        i = slipping[t]
        change = new[t] - (0.0 if endless else v_nodes[i])
        v_nodes[i] = max(v_nodes[i] + share * change, 0.0)


@jit_inside
def _stop(state: SlipState, n_slipping: int, position: int, v_nodes: Array) -> int:
    """Remove a node from S. Return the number of nodes that still slip."""
    v_nodes[state.workspace.slipping[position]] = 0.0
    n_slipping = cholesky.remove(state.workspace, n_slipping, position)
    cholesky.apply_stiffness_to_resting_slip(state)
    return n_slipping


@jit_inside
def _stop_unloaded(
    state: SlipState, q: Array, n_slipping: int, v_nodes: Array
) -> tuple[int, bool]:
    """Step 2 with (3): move the rates from `v_nodes` towards v.

    Stop nodes whose rate reaches zero.

    Return the number of slipping nodes, and whether a node stopped.
    `workspace.v` and `v_nodes` then hold the solution of (2) for the
    slipping nodes.
    """
    workspace, v = state.workspace, state.workspace.v
    some_stopped = False
    while True:
        first, share = _first_to_stop(state, n_slipping, v_nodes, v, endless=False)
        if first == NOBODY:
            break
        _move_v(state, n_slipping, v_nodes, v, share, endless=False)
        n_slipping = _stop(state, n_slipping, first, v_nodes)
        _substitute(state, q, ZERO, n_slipping)
        cholesky.solve_v(workspace, n_slipping, v)
        some_stopped = True
    for t in range(n_slipping):
        v_nodes[workspace.slipping[t]] = max(v[t], 0.0)
    return n_slipping, some_stopped


@jit_inside
def _refresh(state: SlipState, load: float, n_slipping: int) -> None:
    """Compute slip and K d again from the factor."""
    _, slip, Kd, workspace, _, _ = state
    cholesky.solve_slip(workspace, n_slipping, load, workspace.solution)
    cholesky.multiply_slipping(workspace, n_slipping, workspace.solution, Kd)
    for t in range(n_slipping):
        slip[workspace.slipping[t]] = max(workspace.solution[t], 0.0)
    for i in range(slip.shape[0]):
        Kd[i] += workspace.K_resting[i]


@jit_inside
def _next_event(
    state: SlipState, load: float, target: float, piece: NDArray[np.int64], n_slipping: int
) -> PathEvent:
    """Step 3: return the first event on the way to the target.

    Node 0 slips and reaches its corner, 0.4 m, after 0.3/2 Pa. Node 1 starts
    after 0.6/(1 - 0.25) Pa, and the margin at node 2 opens:

    >>> from types import SimpleNamespace
    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> pieces = LINEAR._replace(ends=np.array([0.1, 1.0]))
    >>> rows = np.array([[5.0, 2.0, 2.0], [1.0] * 3, [1.0] * 3, [1.0] * 3])
    >>> sample, (slip, Kd) = make_sample(*rows, pieces), np.array([[0.1, 0, 0], [0, -0.4, 0]])
    >>> workspace = SimpleNamespace(
    ...     is_slipping=np.array([True, False, False]), Kv=np.array([0.0, 0.25, 1.5]),
    ...     slipping=np.zeros(3, int), v=np.array([2.0]),
    ... )
    >>> state, piece = SlipState(sample, slip, Kd, workspace, False), np.zeros(3, int)
    >>> def event(target, first_piece=0):
    ...     piece[0] = first_piece
    ...     step, starting_node, corner = _next_event.py_func(state, 1.0, target, piece, 1)
    ...     return round(float(step), 6), starting_node, corner
    >>> event(1.1)
    (0.1, -1, -1)
    >>> event(9.0)
    (0.15, -1, 0)
    >>> event(9.0, 1)
    (0.8, 1, -1)
    >>> event(9.0, 2)
    (0.8, 1, -1)
    >>> workspace.v[0] = 5.0  # the second corner, 4 m, after 3.9/5 Pa
    >>> event(9.0, 1), event(9.0, 2)
    ((0.78, -1, 0), (0.8, 1, -1))
    """
    sample, slip, Kd, workspace, _, _ = state
    p, corners = sample.profile, sample.pieces.ends
    step = target - load
    starting_node = corner = NOBODY
    for i in range(slip.shape[0]):
        if not workspace.is_slipping[i]:
            never_slipped = slip[i] == 0.0  # then its strength is known without a search
            strength = sample.excess[i] if never_slipped else strength_at(sample, slip, i)
            margin = max(strength - load * p[i] + Kd[i], 0.0)
            closing = p[i] - workspace.Kv[i]  # Pa of margin per Pa of load
            if closing > 0.0 and margin < step * closing:
                step = margin / closing
                starting_node = i
    for t in range(n_slipping):
        i = workspace.slipping[t]
        if piece[i] < corners.shape[0] and workspace.v[t] > 0.0:
            left = max(corners[piece[i]] * sample.critical[i] - slip[i], 0.0)
            if left < step * workspace.v[t]:
                step = left / workspace.v[t]
                starting_node, corner = NOBODY, t
    return PathEvent(step, starting_node, corner)


@jit_inside
def _move_along_z(state: SlipState, n_factored: int, v_nodes: Array, direction: Array) -> int:
    """Step 5: write the direction z after a pivot failed, and move the rates along z.

    Returns the position in S of the node whose rate reaches zero, or
    NOBODY if z is unbounded.
    """
    workspace = state.workspace
    cholesky.singular_direction(workspace, n_factored, direction)
    if not state.may_stop:
        return NOBODY
    # `direction` is z clipped at zero, by node. z itself is left in `solution`,
    # in S, without its last entry: the failed node, which `append` left
    # in `slipping[n_factored]`.
    z = workspace.solution
    z[n_factored] = 1.0
    first, share = _first_to_stop(state, n_factored + 1, v_nodes, z, endless=True)
    if first != NOBODY:
        _move_v(state, n_factored + 1, v_nodes, z, share, endless=True)
    return first


@jit_inside
def _keep_factored(state: SlipState, n_factored: int, v_nodes: Array) -> None:
    """Step 5 after a corner or the first factor: the nodes without a row in L leave S.

    >>> from types import SimpleNamespace
    >>> marks, v_nodes = np.array([True, True, False, True]), np.array([1.0, 2.0, 3.0, 4.0])
    >>> workspace = SimpleNamespace(slipping=np.array([3, 1, 0]), is_slipping=marks)
    >>> _keep_factored.py_func(SimpleNamespace(workspace=workspace), 2, v_nodes)
    >>> marks.tolist()
    [False, True, False, True]
    >>> v_nodes.tolist()
    [0.0, 2.0, 0.0, 4.0]
    """
    slipping, is_slipping = state.workspace.slipping, state.workspace.is_slipping
    for i in range(v_nodes.shape[0]):
        is_slipping[i] = False
    for t in range(n_factored):
        is_slipping[slipping[t]] = True
    for i in range(v_nodes.shape[0]):
        if not is_slipping[i]:
            v_nodes[i] = 0.0


@jit_inside
def _some_rest(state: SlipState) -> bool:
    """Return whether any node that slipped before rests.

    >>> from types import SimpleNamespace
    >>> workspace = SimpleNamespace(is_slipping=np.array([True, False, False]))
    >>> slips = np.array([0.2, 0.0, 0.0]), np.array([0.2, 0.0, 0.1])
    >>> [_some_rest.py_func(SimpleNamespace(workspace=workspace, slip=slip)) for slip in slips]
    [False, True]
    """
    for i in range(state.slip.shape[0]):
        if state.slip[i] > 0.0 and not state.workspace.is_slipping[i]:
            return True
    return False


@jit_inside
def _pass_corner(
    state: SlipState, piece: NDArray[np.int64], q: Array, n_slipping: int, corner: int
) -> int:
    """Step 4 at a corner: move the node to its next piece, and update L.

    Return the number of factored nodes, which falls if a pivot failed.
    """
    sample, slip, _, workspace, _, _ = state
    pieces, i = sample.pieces, workspace.slipping[corner]
    slip[i] = pieces.ends[piece[i]] * sample.critical[i]
    W_before = pieces.slopes[piece[i]] * sample.weakening_rate[i]
    piece[i] += 1
    q[i] = start_of(sample, i, piece[i])
    W = pieces.slopes[piece[i]] * sample.weakening_rate[i]
    workspace.diagonal[i] = entry(workspace.stiffness, i, i) - W
    if W_before >= W:
        cholesky.raise_diagonal(workspace, n_slipping, corner, W_before - W)
        workspace.factored_diagonal[corner] = workspace.diagonal[i]
        return n_slipping
    # The node weakens more steeply: compute L again from its row on.
    # `append` reads the queue.
    for t in range(corner, n_slipping):
        workspace.queue[t - corner] = workspace.slipping[t]
    return cholesky.append(workspace, corner, n_slipping - corner)


@jit_inside
def _start(
    state: SlipState, node: int, n_slipping: int, v_nodes: Array, direction: Array
) -> Start:
    """Steps 4 and 5 at a start: append a node to S. Nodes that bound z stop."""
    workspace, first_changed, some_stopped = state.workspace, n_slipping, False
    while True:
        workspace.queue[0] = node  # `append` reads it
        if cholesky.append(workspace, n_slipping, ONE) > n_slipping:
            break
        bounding = _move_along_z(state, n_slipping, v_nodes, direction)
        if bounding == NOBODY:
            return Start(False, n_slipping, first_changed, some_stopped)
        n_slipping = _stop(state, n_slipping, bounding, v_nodes)
        first_changed, some_stopped = ZERO, True
    if state.slip[node] > 0.0:  # it rested after slip
        cholesky.apply_stiffness_to_resting_slip(state)
        first_changed = ZERO
    return Start(True, n_slipping + 1, first_changed, some_stopped)


@jit_inside
def ends_sliding(state: SlipState) -> bool:
    """Return whether a path or jump ends because every node that can break has slipped.

    Node 1 slipped and rests, and node 2 cannot break:

    >>> from types import SimpleNamespace
    >>> sample = SimpleNamespace(excess=np.array([1.0, 2.0, np.inf]))
    >>> workspace = SimpleNamespace(is_slipping=np.array([True, False, False]))
    >>> state = SlipState(sample, np.array([0.0, 0.2, 0.0]), None, workspace, True)
    >>> ends_sliding.py_func(state)
    True
    >>> ends_sliding.py_func(state._replace(goes_on=True))
    False
    >>> ends_sliding.py_func(state._replace(slip=np.zeros(3)))
    False
    """
    if state.goes_on:
        return False
    for i in range(state.slip.shape[0]):
        slips = state.workspace.is_slipping[i] or state.slip[i] > 0.0
        if not slips and state.sample.excess[i] < np.inf:
            return False
    return True


@jit_allocating
def follow_stable_path(
    state: SlipState, load: float, target: float, direction: Array
) -> PathEnd:
    """Follow the stable equilibria from a load up to a target (Pa) or the first instability.

    Slip and K d of the state are updated. If the path ends unstable,
    the direction (n,) in which slip jumps is written to `direction`.

    Twelve nodes pass corners of two pieces, on paths that go on or become
    unstable. At each target (1) holds, and A z <= 0. If K has positive
    entries, nodes stop and rest below their strength:

    >>> from stiction.elasticity.protocol import DenseEntries
    >>> from stiction.methods.equilibrium.dense.cholesky import make_workspace
    >>> from stiction.methods.equilibrium.strength import Pieces, make_sample, present_pieces
    >>> n, i, ends = 12, np.arange(12), np.array([0.3, 1.0])
    >>> steep = Pieces(ends, np.array([1, 10 / 9, 0]), np.array([1, 1.5, 0]), 20 / 27, 0.5)
    >>> flat = Pieces(ends, np.array([1, 4 / 7, 0]), np.array([1, 2 / 7, 0]), 2.0, 0.35)
    >>> excess, p = 3.0 + np.sin(0.9 * i) + np.cos(1.7 * i), 1.0 + 0.2 * np.cos(2.0 * i)
    >>> def follow(coupling, W, pieces, may_stop=False):
    ...     distance = np.abs(np.subtract.outer(i, i))
    ...     K = -coupling * (np.cos(distance) if may_stop else 1.0) / (1.0 + distance)
    ...     K[i, i] = 3.0
    ...     sample = make_sample(excess, excess - 1.5, p, W + 0.2 * np.sin(i), pieces)
    ...     workspace = make_workspace(DenseEntries(K.ravel(), n, 0.0), n)
    ...     (slip, Kd, z), load, worst = np.zeros((3, n)), 0.9, 0.0
    ...     state = SlipState(sample, slip, Kd, workspace, may_stop, True)
    ...     for target in np.arange(1.0, 8.0, 0.5):
    ...         end = follow_stable_path(state, load, target, z)
    ...         load, (piece, strength, W) = end.load, present_pieces(sample, slip)
    ...         over = load * p - K @ slip - strength + W * slip
    ...         slips = (slip > 0.0) & (workspace.is_slipping | (not may_stop))
    ...         worst = max(worst, *over, *np.abs(over[slips]), *np.abs(Kd - K @ slip))
    ...         if end.status != PathStatus.STABLE:
    ...             break
    ...     Az, rest = K @ z - W * z, (slip > 0.0) & ~slips
    ...     print(end.status.name, bool(worst < 1e-9), end.stopped, int(piece.max()))
    ...     print(*(bool(value) for value in (Az.max() < 1e-9, z.any(), rest.any())))
    >>> follow(0.3, 0.6, flat)
    STABLE True False 1
    True False False
    >>> follow(0.5, 2.4, flat)
    UNSTABLE True False 2
    True True False
    >>> follow(0.5, 1.6, steep)
    UNSTABLE True False 2
    True True False
    >>> follow(0.7, 2.0, steep, True)
    UNSTABLE True True 2
    False True True
    """
    sample, slip, Kd, workspace, may_stop, _ = state
    n, n_corners = slip.shape[0], sample.pieces.ends.shape[0]
    v, Kv = workspace.v, workspace.Kv
    piece = np.zeros(n, np.int64)
    q = np.empty(n)
    v_nodes = np.zeros(n)

    # 1. The slipping nodes, and the factor of A on them.
    n_marked, stopped = _find_slipping(state, load, piece, q)
    peak = load - mean_relief(workspace.stiffness, sample.profile, slip)
    if n_marked > workspace.max_slipping:
        return PathEnd(load, peak, stopped, PathStatus.GIVEN_UP)
    n_slipping = cholesky.factor_slipping(workspace)
    some_left = False  # whether nodes left S for want of a row in L, since the load last rose
    if n_slipping < n_marked:
        if _move_along_z(state, n_slipping, v_nodes, direction) == NOBODY:
            return PathEnd(load, peak, stopped, PathStatus.UNSTABLE)
        _keep_factored(state, n_slipping, v_nodes)
        some_left = True
    cholesky.apply_stiffness_to_resting_slip(state)
    first_changed = ZERO

    # Each node passes each corner once, and starts once unless nodes stop.
    max_events = (1 + MAX_RESTARTS_PER_NODE * may_stop + n_corners) * n + 1
    for event_number in range(max_events):
        _substitute(state, q, first_changed, n_slipping)

        # 2. The rates of slip and of K d. In S the latter follow from
        # (2): K v = p + W v.
        cholesky.solve_v(workspace, n_slipping, v)
        if may_stop:
            n_slipping, some_stopped = _stop_unloaded(state, q, n_slipping, v_nodes)
            stopped = stopped or some_stopped
        for t in range(n_slipping):
            i = workspace.slipping[t]
            W = entry(workspace.stiffness, i, i) - workspace.diagonal[i]
            Kv[i] = sample.profile[i] + W * v[t]
        cholesky.multiply_outside(workspace, n_slipping, v, Kv)
        if event_number % EVENTS_PER_REFRESH == 0:
            _refresh(state, load, n_slipping)  # safe here: S and L match until the event

        # 3. On to the next event.
        event = _next_event(state, load, target, piece, n_slipping)
        if some_left and event.step > MAX_MARGIN_AT_STRENGTH * stress_tolerance(sample, load):
            # Nodes that left S and belong to it have started again: the
            # others have stopped.
            stopped = stopped or _some_rest(state)
            some_left = False
        at_target = event.starting_node == NOBODY and event.corner_position == NOBODY
        load = target if at_target else load + event.step
        for t in range(n_slipping):
            slip[workspace.slipping[t]] += event.step * v[t]
        for i in range(n):
            Kd[i] += event.step * Kv[i]
        peak = max(peak, load - mean_relief(workspace.stiffness, sample.profile, slip))
        if at_target:  # 6.
            return PathEnd(load, peak, stopped, PathStatus.STABLE)

        # 4. and 5. The factor after the event.
        if event.corner_position != NOBODY:
            first_changed = event.corner_position
            n_factored = _pass_corner(state, piece, q, n_slipping, event.corner_position)
            if n_factored < n_slipping:
                if _move_along_z(state, n_factored, v_nodes, direction) == NOBODY:
                    return PathEnd(load, peak, stopped, PathStatus.UNSTABLE)
                n_slipping = n_factored
                _keep_factored(state, n_slipping, v_nodes)
                cholesky.apply_stiffness_to_resting_slip(state)
                some_left, first_changed = True, ZERO
        else:
            if n_slipping == workspace.max_slipping:
                return PathEnd(load, peak, stopped, PathStatus.GIVEN_UP)
            start = _start(state, event.starting_node, n_slipping, v_nodes, direction)
            stopped = stopped or start.some_stopped
            if not start.bounded:
                return PathEnd(load, peak, stopped, PathStatus.UNSTABLE)
            n_slipping, first_changed = start.n_slipping, start.first_changed
            if ends_sliding(state):  # 6. If the machine is stiff, the interface slides stably.
                return PathEnd(load, peak, stopped, PathStatus.STABLE)
    return PathEnd(load, peak, stopped, PathStatus.GIVEN_UP)

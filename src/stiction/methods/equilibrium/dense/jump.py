"""The jump after an instability of a line or specimen, to a new equilibrium or to sliding.

Problem
-------
An equilibrium became unstable at a load (Pa). Find the least
equilibrium at this load with no less slip, or show that there is no
such equilibrium. K is the stiffness (Pa/m), d >= 0 is the slip (m),
s(d) is the strength minus initial stress (Pa), which falls along
straight pieces, and p is the load profile:

    load p - K d <= s(d),  with '=' at the slipping nodes S.         (1)

A node is driven if load p - K d - s(d), its overload, is not negative.
Suppose that K has no positive off-diagonal entry, and that strength
only falls with slip. Then slip at which all slipping nodes are driven
lies below the least equilibrium. So does the slip after steps 1 and 2.

Algorithm
---------
The algorithm is our own. Its two types of step do not pass the least
equilibrium.

1. Elastic step. Hold all strengths at their present values,
   and solve K_SS d_S = (load p - s)_S. Slip increases to
   this solution at nodes at which the solution is larger.
   K_SS is factored once and only grows.
2. Step with the true pieces. On S, let A = K - diag(W) with the
   weakening rates W of the present pieces. If A_SS is positive
   definite, move towards the solution of the linear problem for these
   pieces. If not, move along z >= 0 with A z <= 0 (step 1 in
   `cholesky`). The move ends when the first node reaches the next
   corner in its law.
3. After each step of either type, the resting nodes that are
   overstressed join S.
4. Step 1 is repeated as long as nodes join or pass corners, at most
   `MAX_ELASTIC_STEPS` times in a row. Then step 2 follows, and so on.
   Step 2 requires a second factor. It is needed because step 1 alone
   creeps towards an equilibrium without reaching it.
5. The interface slides if all nodes slip, if its mean strength cannot
   carry the load, if a run of nodes at their residual strength is
   longer than Griffith's length, which no fracture energy can stop, or
   if step 2 is unbounded. It is arrested if step 2 ends at the solution
   of the linear problem and no node joins.

On a specimen, K may have positive off-diagonal entries (`may_stop`), so
that a step may unload a slipping node. Slip does not go back. In step 1
such a node leaves S, and rests until it is overstressed again. In step
2 the node is left out of this step only, and the interface is not
arrested as long as the node is overstressed. Every step lowers the
energy. Therefore the steps end, at a state in which no stress exceeds
its strength.

Example
-------
Three nodes have the strengths 1, 2 and 4 Pa, W = 1 Pa/m, no residual
strength, and each pair is coupled by 1 Pa/m. At load 1.5, slip (0.5, 0,
0) jumps along (1, 1, 0). It moves first until node 0 has lost its
strength, to (1, 0.5, 0). K d is then (1.5, 0, -1.5): node 0 carries no
stress, node 1 carries its strength 1.5, and node 2 carries 3 of 4 Pa.
The patch is arrested:

>>> import numpy as np
>>> from stiction.elasticity.protocol import DenseEntries
>>> from stiction.methods.equilibrium.dense.cholesky import SlipState, make_workspace
>>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
>>> K = np.array([[2.0, -1, -1], [-1, 2, -1], [-1, -1, 2]])
>>> entries = DenseEntries(K.ravel(), 3, 0.0)
>>> sample = make_sample(np.array([1.0, 2, 4]), np.zeros(3), np.ones(3), np.ones(3), LINEAR)
>>> slip = np.array([1.0, 0.5, 0.0])
>>> state = SlipState(sample, slip, K @ slip, make_workspace(entries, 3), False)
>>> Outcome(jump(state, 1.5, np.inf, make_workspace(entries, 3))).name
'ARRESTED'
>>> slip.tolist()
[1.0, 0.5, 0.0]
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit, jit_inside
from stiction.elasticity.stiffness import entry, mean_relief
from stiction.methods.equilibrium.dense import cholesky
from stiction.methods.equilibrium.dense.cholesky import SlipState, Workspace
from stiction.methods.equilibrium.dense.linear_program import (
    queue_overstressed,
    stress_tolerance,
)
from stiction.methods.equilibrium.dense.stable_path import (
    MAX_MARGIN_AT_STRENGTH,
    NEGATIVE_RATE_RTOL,
    ends_sliding,
)
from stiction.methods.equilibrium.state import Outcome
from stiction.methods.equilibrium.strength import (
    StaticSample,
    piece_at,
    step_to_corner,
    strength_at,
    unsupported,
)

MAX_ELASTIC_STEPS_IN_ALL = 4000
MAX_ELASTIC_STEPS = 16
"""Number of elastic steps in a row after which a step 2 follows although nodes keep joining."""


class Course(IntEnum):
    """Continuations of a jump after a step."""

    GOES_ON = 0
    SLIDES = 1  # no node is left that can hold the interface
    RESTS = 2
    NO_SPACE = 3  # more nodes slip than L has space for


class StepEnd(NamedTuple):
    """End of a step, after the overstressed nodes have joined S."""

    course: Course
    n_slipping: int


@jit_inside
def _residual_runs(sample: StaticSample, slip: Array) -> tuple[int, int]:
    """Return the longest run of residual nodes on the circle, and the number of passed corners.

    Nodes 5, 0 and 1 are residual in a row across the border, and node 3. Node 2
    has passed a corner. A node that cannot weaken does not count before it slips:

    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> pieces = LINEAR._replace(ends=np.array([0.25, 1.0]))
    >>> sample = make_sample(np.full(6, 3.0), *np.ones((3, 6)), pieces)
    >>> runs = jit(lambda sample, slip: _residual_runs(sample, slip))
    >>> runs(sample, np.array([2.0, 3.0, 0.6, 2.0, 0.4, 9.0]))
    (3, 9)
    >>> runs(sample, np.full(6, 2.0))
    (6, 12)
    >>> runs(sample._replace(critical=np.zeros(6)), np.zeros(6))
    (0, 0)
    """
    n, longest, run, n_corners = slip.shape[0], 0, 0, 0
    for q in range(2 * n):  # twice around, so that a run across the first node is complete
        i = q if q < n else q - n
        residual = slip[i] > 0.0 and slip[i] >= sample.pieces.at_corner * sample.critical[i]
        run = run + 1 if residual else 0
        if q < n and residual:
            n_corners += sample.pieces.ends.shape[0]
        elif q < n and slip[i] > 0.0:
            n_corners += piece_at(sample, slip, i)
        longest = max(longest, run)
    return min(longest, n), n_corners


@jit_inside
def _join(state: SlipState, load: float, n_slipping: int, tolerance: float) -> StepEnd:
    """Step 3: append the overstressed nodes to S and to the factor of K."""
    workspace = state.workspace
    count = queue_overstressed(state, load, tolerance)
    if count == 0:  # the resting nodes hold the interface
        return StepEnd(Course.GOES_ON, n_slipping)
    if n_slipping + count > workspace.max_slipping:
        return StepEnd(Course.NO_SPACE, n_slipping)
    n_factored = cholesky.append(workspace, n_slipping, count)
    if n_factored < n_slipping + count:  # K is singular on all nodes only
        return StepEnd(Course.SLIDES, n_slipping)
    return StepEnd(Course.SLIDES if ends_sliding(state) else Course.GOES_ON, n_factored)


@jit_inside
def _remove_unloaded(state: SlipState, n_slipping: int, tolerance: float) -> int:
    """Step 1: unmark the nodes that an elastic step would move back. Return the number left.

    Back steps are 0.1 x 2 and 0.1 x 4 Pa at the nodes 2 and 0, and the allowance is 0.3 Pa:

    >>> from types import SimpleNamespace
    >>> workspace = SimpleNamespace(
    ...     slipping=np.array([2, 0, 1]), solution=np.array([0.4, 0.2, 0.6]),
    ...     diagonal=np.array([4.0, 9.0, 2.0]), is_slipping=np.ones(3, dtype=bool),
    ... )
    >>> state = SimpleNamespace(workspace=workspace, slip=np.array([0.3, 0.5, 0.5]))
    >>> _remove_unloaded.py_func(state, 3, 0.3 / MAX_MARGIN_AT_STRENGTH)
    2
    >>> workspace.is_slipping.tolist()
    [False, True, True]
    """
    workspace, n_stay = state.workspace, n_slipping
    for t in range(n_slipping):
        i = workspace.slipping[t]
        back = (state.slip[i] - workspace.solution[t]) * workspace.diagonal[i]  # Pa
        if back > MAX_MARGIN_AT_STRENGTH * tolerance:
            workspace.is_slipping[i] = False
            n_stay -= 1
    return n_stay


@jit_inside
def _elastic_step(state: SlipState, load: float, n_slipping: int, tolerance: float) -> StepEnd:
    """Steps 1 and 3: make an elastic step. The nodes that it overstresses join."""
    sample, slip, Kd, workspace, may_stop, _ = state
    solution, drive, K_resting = workspace.solution, workspace.rhs, workspace.K_resting
    slipping = workspace.slipping
    cholesky.apply_stiffness_to_resting_slip(state)
    while True:
        # The drive is the stress that the slip of S must release to
        # meet the strengths.
        for t in range(n_slipping):
            i = slipping[t]
            drive[i] = load * sample.profile[i] - strength_at(sample, slip, i) - K_resting[i]
        cholesky.substitute_slipping(workspace, ZERO, n_slipping, drive, solution)
        cholesky.back_substitute(workspace.factor, n_slipping, solution)
        if not may_stop:
            break
        n_stay = _remove_unloaded(state, n_slipping, tolerance)
        if n_stay == n_slipping:
            break
        n_slipping = cholesky.factor_slipping(workspace)
        cholesky.apply_stiffness_to_resting_slip(state)
    # Slip does not go back. In S, K d is then the drive, to round-off.
    for t in range(n_slipping):
        i = slipping[t]
        slip[i] = max(slip[i], solution[t])
        solution[t] = slip[i]
        Kd[i] = drive[i]
    cholesky.multiply_outside(workspace, n_slipping, solution, Kd)
    for i in range(slip.shape[0]):
        Kd[i] += K_resting[i]
    return _join(state, load, n_slipping, tolerance)


@jit_inside
def _leave_out_reversed(workspace: Workspace, n_slipping: int, atol: float, rtol: float) -> int:
    """Step 2: unmark the nodes whose solution is below zero. Return their number.

    A solution counts as below zero if K_ii times the solution is below
    -`atol` (Pa), and the solution is also below -`rtol` times the
    largest solution.
    """
    solution = workspace.solution
    largest = 1.0  # a direction of singularity is 1 at the node that failed
    for t in range(n_slipping):
        largest = max(largest, solution[t])
    count = ZERO
    for t in range(n_slipping):
        i = workspace.slipping[t]
        if -solution[t] > max(atol / entry(workspace.stiffness, i, i), rtol * largest):
            workspace.is_slipping[i] = False
            count += 1
    return count


@jit_inside
def _write_direction(
    state: SlipState, true_pieces: Workspace, n_marked: int, drive: Array, tolerance: float
) -> float:
    """Step 2: write the direction of the step.

    Return the longest step along the direction.

    The longest step is 1 if the direction leads to the solution of the
    linear problem, and otherwise infinite.
    """
    # Leave out nodes that would move back, and solve again, until no
    # such node is left. Each pass leaves out a node, so the loop ends.
    direction, solution = true_pieces.direction, true_pieces.solution
    while True:
        n_factored = cholesky.factor_slipping(true_pieces)
        if n_factored < n_marked:
            longest, atol, rtol = np.inf, 0.0, NEGATIVE_RATE_RTOL
            cholesky.singular_direction(true_pieces, n_factored, direction)
        else:
            longest, atol, rtol = 1.0, MAX_MARGIN_AT_STRENGTH * tolerance, 0.0
            cholesky.substitute_slipping(true_pieces, ZERO, n_marked, drive, solution)
            cholesky.back_substitute(true_pieces.factor, n_marked, solution)
            cholesky.write_clipped(true_pieces, n_marked, solution, direction)
        if not state.may_stop:
            return longest
        n_reversed = _leave_out_reversed(true_pieces, n_factored, atol, rtol)
        if n_reversed == 0:
            return longest
        n_marked -= n_reversed


@jit_inside
def _step_with_true_pieces(
    state: SlipState, load: float, true_pieces: Workspace, n_slipping: int, tolerance: float
) -> StepEnd:
    """Steps 2 and 3: move slip with the true pieces.

    The nodes that this overstresses join.

    `true_pieces` is the workspace with the factor of A = K - diag(W).
    """
    sample, slip, Kd, workspace, _, _ = state
    # Nodes that the step leaves out lose their mark among the true
    # pieces only. In elastic steps they still slip.
    overload = workspace.rhs
    for i in range(slip.shape[0]):
        piece = piece_at(sample, slip, i)
        W = sample.pieces.slopes[piece] * sample.weakening_rate[i]
        true_pieces.is_slipping[i] = workspace.is_slipping[i]
        true_pieces.diagonal[i] = entry(workspace.stiffness, i, i) - W
        overload[i] = load * sample.profile[i] - strength_at(sample, slip, i) - Kd[i]
    longest = _write_direction(state, true_pieces, n_slipping, overload, tolerance)
    # Without a corner on the way, slip along an unstable direction
    # never stops.
    step = step_to_corner(sample, slip, true_pieces.direction, longest)
    if step == np.inf:
        return StepEnd(Course.SLIDES, n_slipping)
    for t in range(n_slipping):
        workspace.solution[t] = slip[workspace.slipping[t]]
    cholesky.multiply_slipping(workspace, n_slipping, workspace.solution, Kd)
    cholesky.apply_stiffness_to_resting_slip(state)
    # At rest, if the step was not cut short by a corner, and all nodes
    # left out stay below their strength.
    at_rest = step == 1.0 and longest == 1.0
    for i in range(slip.shape[0]):
        Kd[i] += workspace.K_resting[i]
        if workspace.is_slipping[i] and not true_pieces.is_slipping[i]:  # it was left out
            overload_i = load * sample.profile[i] - strength_at(sample, slip, i) - Kd[i]
            at_rest = at_rest and overload_i <= MAX_MARGIN_AT_STRENGTH * tolerance
    end = _join(state, load, n_slipping, tolerance)
    if at_rest and end.course == Course.GOES_ON and end.n_slipping == n_slipping:
        return StepEnd(Course.RESTS, n_slipping)
    return end


@jit
def jump(state: SlipState, load: float, unstoppable: float, true_pieces: Workspace) -> Outcome:
    """Follow an instability at a fixed load to the least equilibrium, or to sliding.

    On entry, slip and K d are those at the instability, or those after
    a move along its direction to a corner of the law. On return they
    belong to the equilibrium, or are a lower bound of the equilibrium.
    If `unstoppable` nodes in a row are at their residual strength, the
    interface slides. `true_pieces` holds the factor of K - diag(W), with
    the slopes W of the present pieces of the law.

    Twelve nodes pass corners of two pieces and come to rest where (1) holds,
    also if K has positive entries:

    >>> from stiction.elasticity.protocol import DenseEntries
    >>> from stiction.methods.equilibrium.dense.cholesky import make_workspace
    >>> from stiction.methods.equilibrium.strength import Pieces, make_sample, present_pieces
    >>> n, i, ends = 12, np.arange(12), np.array([0.3, 1.0])
    >>> flat = Pieces(ends, np.array([1, 4 / 7, 0]), np.array([1, 2 / 7, 0]), 2.0, 0.35)
    >>> excess, p = 3.0 + np.sin(0.9 * i) + np.cos(1.7 * i), 1.0 + 0.2 * np.cos(2.0 * i)
    >>> def rest(load, W, may_stop=False, unstoppable=np.inf, relief=0.1):
    ...     distance = np.abs(np.subtract.outer(i, i))
    ...     K = -0.6 * (np.cos(distance) if may_stop else 1.0) / (1.0 + distance)
    ...     K[i, i] = 3.0
    ...     sample = make_sample(excess, excess - 1.5, p, W + 0.2 * np.sin(i), flat)
    ...     entries = DenseEntries(K.ravel(), n, relief)
    ...     elastic, true_pieces = (make_workspace(entries, n) for _ in range(2))
    ...     slip = np.where(load * p > excess, 1e-3, 0.0)
    ...     state = SlipState(sample, slip, K @ slip, elastic, may_stop, True)
    ...     outcome = jump(state, load, unstoppable, true_pieces)
    ...     piece, strength, W = present_pieces(sample, slip)
    ...     over = load * p - K @ slip - strength + W * slip
    ...     slips = true_pieces.is_slipping
    ...     holds = over.max() < 1e-8, np.abs(over[slips]).max() < 1e-8
    ...     return Outcome(outcome).name, *map(bool, holds), int(piece.max())
    >>> rest(2.5, 2.4)
    ('ARRESTED', True, True, 1)
    >>> rest(3.5, 2.4)
    ('ARRESTED', True, True, 2)
    >>> rest(3.5, 0.6)
    ('ARRESTED', True, True, 0)
    >>> rest(3.5, 2.4, True)
    ('ARRESTED', True, True, 2)

    Three residual nodes lie in a row. The interface slides if that many
    cannot be stopped, or if its mean strength cannot carry a dead load:

    >>> [rest(3.5, 2.4, unstoppable=nodes)[0] for nodes in (3, 4)]
    ['SLIDING', 'ARRESTED']
    >>> rest(3.5, 2.4, relief=0.0)[0]
    'SLIDING'
    """
    sample, slip, _, workspace, _, _ = state
    n = slip.shape[0]
    tolerance = stress_tolerance(sample, load)
    # Factor K on all nodes that slip.
    n_marked = ZERO
    for i in range(n):
        workspace.diagonal[i] = entry(workspace.stiffness, i, i)
        workspace.is_slipping[i] = slip[i] > 0.0
        n_marked += workspace.is_slipping[i]
    if n_marked > workspace.max_slipping:
        return Outcome.UNDECIDED
    n_slipping = cholesky.factor_slipping(workspace)
    if n_slipping < n_marked or n_marked == n:  # K is singular on all nodes only
        return Outcome.SLIDING
    steps_in_row = n_corners_before = 0
    for _ in range(MAX_ELASTIC_STEPS_IN_ALL):
        # 1. and 3.
        n_before = n_slipping
        course, n_slipping = _elastic_step(state, load, n_slipping, tolerance)
        # 5. If a machine drives the blocks, slip lowers the load, so the mean strength
        # is no criterion.
        dead_load = mean_relief(workspace.stiffness, sample.profile, slip) == 0.0
        run, n_corners = _residual_runs(sample, slip)
        slides = run >= unstoppable or (dead_load and unsupported(sample, load, slip))
        if course == Course.GOES_ON and slides:
            return Outcome.SLIDING
        # 4.
        steps_in_row += 1
        progress = n_slipping > n_before or n_corners > n_corners_before
        n_corners_before = n_corners
        if course == Course.GOES_ON and not (progress and steps_in_row < MAX_ELASTIC_STEPS):
            # 2. and 3.
            steps_in_row = 0
            end = _step_with_true_pieces(state, load, true_pieces, n_slipping, tolerance)
            course, n_slipping = end
        if course == Course.SLIDES:
            return Outcome.SLIDING
        if course == Course.RESTS:
            return Outcome.ARRESTED
        if course == Course.NO_SPACE:
            break
    return Outcome.UNDECIDED

"""Jump beyond an instability, to another equilibrium at the same load or to global sliding.

Slip beyond the instability can only grow, and strength only falls with slip. So every field from
which all slipping nodes are still driven forward lies below the next equilibrium, and two kinds of
step keep that property: with frozen strengths, solve the elastic problem (K on the slipping nodes);
or move along a field z >= 0 with A z <= 0, or towards the solution of the linear problem of the
present states, as far as the first node that reaches the next corner of its friction law.

Where K has positive entries off its diagonal, a step may unload a node that slips. Slip does not go
back: that node is left out of the step and rests, until it is overstressed again. Every step then
lowers the energy, so that they end, where no stress is above its strength.
"""

import numpy as np

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit, jit_inside
from stiction.elasticity.stiffness import entry, mean_relief
from stiction.methods.equilibrium.dense.cholesky import (
    CROWDED,
    MOST_MEMBERS,
    Course,
    Workspace,
    append,
    back_substitute,
    factor_inside,
    multiply_members,
    multiply_outside,
    singular_direction,
    substitute_members,
    take_off_resting,
)
from stiction.methods.equilibrium.dense.linear_program import overstressed, stress_tolerance
from stiction.methods.equilibrium.dense.stable_path import AT_STRENGTH, REVERSED, all_slip
from stiction.methods.equilibrium.sample import (
    Outcome,
    StaticSample,
    piece_at,
    step_to_corner,
    strength_at,
    unsupported,
)

ALL = -1
"""In the place of a number of members: no node remains that never slipped."""

STEPS = 4000
"""Largest number of elastic steps."""
PATIENCE = 16
"""Number of elastic steps after which the true states are tried although nodes keep joining."""


@jit_inside
def _residual_runs(sample: StaticSample, slip: Array) -> tuple[int, int]:
    """Longest run of residual nodes on the circle, and the number of corners passed in all."""
    n = slip.shape[0]
    longest = 0
    run = 0
    count = 0
    for q in range(2 * n):
        i = q if q < n else q - n
        residual = slip[i] > 0.0 and slip[i] >= sample.pieces.at_corner * sample.critical[i]
        run = run + 1 if residual else 0
        if q < n and residual:
            count += sample.pieces.ends.shape[0]
        elif q < n and slip[i] > 0.0:
            count += piece_at(sample.pieces, sample.critical[i], slip[i])
        longest = max(longest, run)
    return min(longest, n), count


@jit_inside
def _join(course: Course, load: float, size: int, tolerance: float) -> int:
    """Append the overstressed nodes to the elastic factor.

    Returns the number of members, ALL if no node remains that never slipped, CROWDED if they do not
    fit.
    """
    workspace = course.workspace
    count = overstressed(course, load, tolerance)
    if count == 0:
        return size
    if size + count > MOST_MEMBERS:
        return CROWDED
    now = append(workspace, size, count)
    if now < size + count:
        return ALL
    for t in range(size, now):
        workspace.inside[workspace.members[t]] = True
    return ALL if all_slip(course) else now


@jit_inside
def _forget(workspace: Workspace) -> None:
    """Let no row of the factor have a forward substitution."""
    for t in range(workspace.known_drive.shape[0]):
        workspace.known_drive[t] = np.nan


@jit_inside
def _relax(course: Course, load: float, size: int, tolerance: float) -> int:
    """Take one elastic step with frozen strengths; the nodes that it overstresses then join.

    Returns what `_join` returns. Of rows whose drive is that of the step before, as it is at
    residual strength, the forward substitution stays; `_forget` them with the factor.
    """
    sample, slip, stiff, workspace, stops = course
    solution, drive = workspace.solution, workspace.right
    resting, members = workspace.resting, workspace.members
    forward, before = workspace.forward_drive, workspace.known_drive
    if stops:
        take_off_resting(course)
    while True:
        for t in range(size):
            i = members[t]
            drive[i] = load * sample.profile[i] - strength_at(sample, slip, i) - resting[i]
        known = ZERO
        while known < size and drive[members[known]] == before[known]:
            known += 1
        substitute_members(workspace, known, size, drive, forward)
        for t in range(size):
            before[t] = drive[members[t]]
            solution[t] = forward[t]
        back_substitute(workspace.factor, size, solution)
        stay = size
        for t in range(size if stops else ZERO):
            i = members[t]
            if (slip[i] - solution[t]) * workspace.diagonal[i] > AT_STRENGTH * tolerance:
                workspace.inside[i] = False
                stay -= 1
        if stay == size:
            break
        size = factor_inside(workspace)
        _forget(workspace)
        take_off_resting(course)
    for t in range(size):
        i = members[t]
        slip[i] = max(slip[i], solution[t])
        solution[t] = slip[i]
        stiff[i] = drive[i]
    multiply_outside(workspace, size, solution, stiff)
    for i in range(slip.shape[0]):
        stiff[i] += resting[i]
    return _join(course, load, size, tolerance)


@jit_inside
def _leave_reversed(other: Workspace, size: int, least: float, share: float) -> int:
    """Leave out the members whose solution is below zero; returns how many.

    By at least the stress `least` at the node, or the `share` of the largest.
    """
    solution = other.solution
    largest = 1.0
    for t in range(size):
        largest = max(largest, solution[t])
    count = ZERO
    for t in range(size):
        i = other.members[t]
        if -solution[t] > max(least / entry(other.stiffness, i, i), share * largest):
            other.inside[i] = False
            count += 1
    return count


@jit_inside
def _settle(
    course: Course, load: float, other: Workspace, size: int, tolerance: float
) -> Outcome:
    """Take one step with the true states: along the unstable direction or towards equilibrium.

    Returns ARRESTED if the step ends in the equilibrium of the members, SLIDING if nothing bounds
    it, else UNDECIDED.
    """
    sample, slip, stiff, workspace, stops = course
    drive = workspace.right
    for i in range(slip.shape[0]):
        own = entry(workspace.stiffness, i, i)
        other.inside[i] = workspace.inside[i]
        piece = piece_at(sample.pieces, sample.critical[i], slip[i])
        other.diagonal[i] = own - sample.pieces.slopes[piece] * sample.rate[i]
        drive[i] = load * sample.profile[i] - strength_at(sample, slip, i) - stiff[i]
    direction, solution = other.direction, other.solution
    near = AT_STRENGTH * tolerance
    count = size
    while True:
        now = factor_inside(other)
        if now < count:
            singular_direction(other, now, direction)
            longest = np.inf
            gone = _leave_reversed(other, now, 0.0, REVERSED) if stops else ZERO
        else:
            longest = 1.0
            substitute_members(other, ZERO, count, drive, solution)
            back_substitute(other.factor, count, solution)
            for i in range(slip.shape[0]):
                direction[i] = 0.0
            for t in range(count):
                direction[other.members[t]] = max(solution[t], 0.0)
            gone = _leave_reversed(other, count, near, 0.0) if stops else ZERO
        if gone == 0:
            break
        count -= gone
    step = step_to_corner(sample, slip, direction, longest)
    if step == np.inf:
        return Outcome.SLIDING
    solution, resting = workspace.solution, workspace.resting
    for t in range(size):
        solution[t] = slip[workspace.members[t]]
    multiply_members(workspace, size, solution, stiff)
    if stops:
        take_off_resting(course)
    rests = step == 1.0 and longest == 1.0
    for i in range(slip.shape[0]):
        stiff[i] += resting[i]
        if workspace.inside[i] and not other.inside[i]:
            over = load * sample.profile[i] - strength_at(sample, slip, i) - stiff[i]
            rests = rests and over <= near
    return Outcome.ARRESTED if rests else Outcome.UNDECIDED


@jit
def jump(course: Course, load: float, griffith: float, other: Workspace) -> Outcome:
    """Follow an instability at a fixed load to the next least equilibrium, or to sliding.

    Slip d and K d are those of the state that became unstable, moved along the unstable direction
    as far as `step_to_corner` goes; on return, of the next equilibrium or a lower bound of it.
    A run of residual nodes as long as Griffith's length counts as global sliding.
    """
    sample, slip, _, workspace, _ = course
    tolerance = stress_tolerance(sample, load)
    count = ZERO
    for i in range(slip.shape[0]):
        workspace.diagonal[i] = entry(workspace.stiffness, i, i)
        workspace.inside[i] = slip[i] > 0.0
        workspace.resting[i] = 0.0
        count += workspace.inside[i]
    if count > MOST_MEMBERS:
        return Outcome.UNDECIDED
    size = factor_inside(workspace)
    _forget(workspace)
    if size < count or count == slip.shape[0]:
        return Outcome.SLIDING
    waited = 0
    passed = 0
    for _ in range(STEPS):
        before = size
        size = _relax(course, load, size, tolerance)
        if size == CROWDED:
            return Outcome.UNDECIDED
        fixed = mean_relief(workspace.stiffness, sample.profile, slip) == 0.0
        if size == ALL or (fixed and unsupported(sample, load, slip)):
            return Outcome.SLIDING
        run, corners = _residual_runs(sample, slip)
        if run >= griffith:
            return Outcome.SLIDING
        waited += 1
        # A factor of their own pays once elastic steps change only the slip, or creep on.
        if waited < PATIENCE and (size > before or corners > passed):
            passed = corners
            continue
        waited = 0
        passed = corners
        before = size
        status = _settle(course, load, other, size, tolerance)
        if status == Outcome.SLIDING:
            return Outcome.SLIDING
        size = _join(course, load, size, tolerance)
        if size < 0:
            return Outcome.UNDECIDED if size == CROWDED else Outcome.SLIDING
        if status == Outcome.ARRESTED and size == before:
            return Outcome.ARRESTED
    return Outcome.UNDECIDED

"""Jump beyond an instability, to another equilibrium at the same load or to global sliding.

Slip beyond the instability can only grow, and strength only falls with slip. So every field from
which all slipping nodes are still driven forward lies below the next equilibrium, and two kinds of
step keep that property: with frozen strengths, solve the elastic problem (K on the slipping nodes);
or move along a field z >= 0 with A z <= 0, or towards the solution of the linear problem of the
present states, as far as the first node that reaches the next corner of its friction law.
"""

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.stiffness import entry, mean_relief
from stiction.equilibrium.cholesky import (
    MOST_MEMBERS,
    Workspace,
    append,
    back_substitute,
    factor_inside,
    multiply_members,
    singular_direction,
    substitute_members,
)
from stiction.equilibrium.linear_program import overstressed, stress_tolerance
from stiction.equilibrium.sample import (
    Outcome,
    Sample,
    piece_at,
    step_to_corner,
    strength_at,
    unsupported,
)
from stiction.jit import ZERO, jit, jit_inside

ALL = -1
CROWDED = -2

STEPS = 4000
"""Largest number of elastic steps."""
PATIENCE = 16
"""Number of elastic steps after which the true states are tried although nodes keep joining."""


@jit_inside
def _residual_runs(sample: Sample, slip: Array) -> tuple[int, int]:
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
def _join(
    sample: Sample, load: float, stiff: Array, workspace: Workspace, size: int, tolerance: float
) -> int:
    """Append the overstressed nodes to the elastic factor.

    Returns the number of members, ALL if no node remains at rest, CROWDED if they do not fit.
    """
    count = overstressed(sample, load, stiff, workspace, tolerance)
    if count == 0:
        return size
    if size + count > MOST_MEMBERS:
        return CROWDED
    now = append(workspace, size, count)
    if now < size + count or now == stiff.shape[0]:
        return ALL
    for t in range(size, now):
        workspace.inside[workspace.members[t]] = True
    return now


@jit_inside
def _relax(
    sample: Sample,
    load: float,
    slip: Array,
    stiff: Array,
    workspace: Workspace,
    size: int,
    tolerance: float,
) -> int:
    """Take one elastic step with frozen strengths; the nodes that it overstresses then join.

    Returns what `_join` returns.
    """
    solution = workspace.vectors[1]
    drive = workspace.vectors[3]
    for t in range(size):
        i = workspace.members[t]
        drive[i] = load * sample.profile[i] - strength_at(sample, slip, i)
    substitute_members(workspace, ZERO, size, drive, solution)
    back_substitute(workspace.factor, size, solution)
    for t in range(size):
        i = workspace.members[t]
        slip[i] = max(slip[i], solution[t])
        solution[t] = slip[i]
    multiply_members(workspace, size, solution, stiff)
    return _join(sample, load, stiff, workspace, size, tolerance)


@jit_inside
def _settle(
    sample: Sample,
    load: float,
    slip: Array,
    stiff: Array,
    workspace: Workspace,
    other: Workspace,
    size: int,
) -> Outcome:
    """Take one step with the true states: along the unstable direction or towards equilibrium.

    Returns ARRESTED if the step ends in the equilibrium of the members, SLIDING if nothing bounds
    it, else UNDECIDED.
    """
    for i in range(slip.shape[0]):
        own = entry(workspace.stiffness, i, i)
        other.inside[i] = workspace.inside[i]
        piece = piece_at(sample.pieces, sample.critical[i], slip[i])
        other.diagonal[i] = own - sample.pieces.slopes[piece] * sample.rate[i]
    now = factor_inside(other)
    direction = other.vectors[3]
    longest = 1.0
    if now < size:
        singular_direction(other, now, direction)
        longest = np.inf
    else:
        drive = other.vectors[2]
        for i in range(slip.shape[0]):
            drive[i] = load * sample.profile[i] - strength_at(sample, slip, i) - stiff[i]
        solution = other.vectors[1]
        substitute_members(other, ZERO, size, drive, solution)
        back_substitute(other.factor, size, solution)
        for i in range(slip.shape[0]):
            direction[i] = 0.0
        for t in range(size):
            direction[other.members[t]] = max(solution[t], 0.0)
    step = step_to_corner(sample, slip, direction, longest)
    if step == np.inf:
        return Outcome.SLIDING
    solution = workspace.vectors[1]
    for t in range(size):
        solution[t] = slip[workspace.members[t]]
    multiply_members(workspace, size, solution, stiff)
    return Outcome.ARRESTED if step == 1.0 and longest == 1.0 else Outcome.UNDECIDED


@jit
def jump(
    sample: Sample,
    load: float,
    slip: Array,
    stiff: Array,
    griffith: float,
    workspace: Workspace,
    other: Workspace,
) -> Outcome:
    """Follow an instability at a fixed load to the next least equilibrium, or to sliding.

    Slip d and K d are those of the state that became unstable, moved along the unstable direction
    as far as `step_to_corner` goes; on return, of the next equilibrium or a lower bound of it.
    A run of residual nodes as long as Griffith's length counts as global sliding.
    """
    tolerance = stress_tolerance(sample, load)
    count = ZERO
    for i in range(slip.shape[0]):
        workspace.diagonal[i] = entry(workspace.stiffness, i, i)
        workspace.inside[i] = slip[i] > 0.0
        count += workspace.inside[i]
    if count > MOST_MEMBERS:
        return Outcome.UNDECIDED
    size = factor_inside(workspace)
    if size < count or count == slip.shape[0]:
        return Outcome.SLIDING
    waited = 0
    passed = 0
    for _ in range(STEPS):
        before = size
        size = _relax(sample, load, slip, stiff, workspace, size, tolerance)
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
        status = _settle(sample, load, slip, stiff, workspace, other, size)
        if status == Outcome.SLIDING:
            return Outcome.SLIDING
        size = _join(sample, load, stiff, workspace, size, tolerance)
        if size < 0:
            return Outcome.UNDECIDED if size == CROWDED else Outcome.SLIDING
        if status == Outcome.ARRESTED and size == before:
            return Outcome.ARRESTED
    return Outcome.UNDECIDED

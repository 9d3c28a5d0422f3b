"""Beyond an instability: does the patch come to rest in another equilibrium at the same load?

Slip beyond the instability can only grow, and strength only falls with slip. So every field from
which all slipping nodes are still driven forward lies below the next equilibrium, and two kinds of
step keep that property: with frozen strengths, solve the elastic problem (K on the slipping nodes);
or move along a field z >= 0 with A z <= 0, or towards the solution of the linear problem of the
present states, as far as the first node that reaches the next corner of its friction law.
"""

from __future__ import annotations

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.line_stiffness import apply_stiffness
from stiction.equilibrium.cholesky import append, back_substitute, extend_forward
from stiction.equilibrium.linear_program import (
    PIVOT,
    overstressed,
    singular_direction,
    stress_tolerance,
)
from stiction.equilibrium.pieces import AT_CORNER, piece_at, start_of
from stiction.equilibrium.workspace import MOST_MEMBERS, Grid, Sample, Workspace, make_workspace
from stiction.jit import ZERO, jit

SLIDING = 0
ARRESTED = 1
UNDECIDED = 2

ALL = -1
CROWDED = -2

PATIENCE = 16
"""Elastic steps after which the true states are tried even if more nodes keep joining."""


@jit
def strength_at(sample: Sample, slip: Array, i: int) -> float:
    """Strength less initial stress of node i after some slip."""
    piece = piece_at(sample.pieces, sample.critical[i], slip[i])
    start = start_of(sample.pieces, sample.excess[i], sample.residual[i], piece)
    return start - sample.pieces.slopes[piece] * sample.rate[i] * slip[i]


@jit
def step_to_corner(sample: Sample, slip: Array, direction: Array, longest: float) -> float:
    """Move along a direction until the first node reaches a corner, at most `longest` of it."""
    step = longest
    ends = sample.pieces.ends
    for i in range(slip.shape[0]):
        if direction[i] > 0.0:
            piece = piece_at(sample.pieces, sample.critical[i], slip[i])
            if piece < ends.shape[0]:
                step = min(step, (ends[piece] * sample.critical[i] - slip[i]) / direction[i])
    if not np.isfinite(step):
        return step
    for i in range(slip.shape[0]):
        slip[i] += step * direction[i]
    return step


@jit
def griffith_length(sample: Sample, load: float, spacing: float, modulus: float) -> float:
    """Griffith's critical crack length, in nodes: nothing on the interface stops a longer one.

    A crack of half-length a with stress drop D releases pi a D^2/(2 G*) at each tip (Griffith,
    1921), and grows where that is more than the fracture energy; the largest of the interface is
    max (tau_p - tau_r) d_c times the area under the law.
    """
    drop = np.inf
    energy = 0.0
    for i in range(sample.excess.shape[0]):
        drop = min(drop, load * sample.profile[i] - sample.residual[i])
        fall = sample.excess[i] - sample.residual[i]
        energy = max(energy, sample.pieces.area * fall * sample.critical[i])
    if drop <= 0.0:
        return np.inf
    return 4.0 * modulus * energy / (np.pi * drop * drop * spacing)


@jit
def residual_runs(sample: Sample, slip: Array) -> tuple[int, int]:
    """Longest run of residual nodes on the circle, and how many corners are passed in all."""
    n = slip.shape[0]
    longest = 0
    run = 0
    count = 0
    for q in range(2 * n):
        i = q if q < n else q - n
        residual = slip[i] > 0.0 and slip[i] >= AT_CORNER * sample.critical[i]
        run = run + 1 if residual else 0
        if q < n and residual:
            count += sample.pieces.ends.shape[0]
        elif q < n and slip[i] > 0.0:
            count += piece_at(sample.pieces, sample.critical[i], slip[i])
        longest = max(longest, run)
    return min(longest, n), count


@jit
def unsupported(sample: Sample, load: float, slip: Array) -> bool:
    """Whether the whole interface, at its present strengths, cannot carry the load."""
    balance = 0.0
    for i in range(slip.shape[0]):
        balance += load * sample.profile[i] - strength_at(sample, slip, i)
    return balance > 0.0


@jit
def relax(
    sample: Sample,
    grid: Grid,
    load: float,
    slip: Array,
    stiff: Array,
    workspace: Workspace,
    size: int,
    tolerance: float,
) -> int:
    """One elastic step with frozen strengths, then the nodes it overstresses join.

    Returns as `join` does.
    """
    right = workspace.vectors[0]
    solution = workspace.vectors[1]
    drive = workspace.vectors[3]
    for t in range(size):
        i = workspace.members[t]
        drive[i] = load * sample.profile[i] - strength_at(sample, slip, i)
    extend_forward(workspace.factor, ZERO, size, workspace.members, drive, workspace.forward[0])
    for t in range(size):
        right[t] = workspace.forward[0, t]
    back_substitute(workspace.factor, size, right, solution)
    for t in range(size):
        i = workspace.members[t]
        slip[i] = max(slip[i], solution[t])
        solution[t] = slip[i]
    apply_stiffness(
        grid.strip, grid.column[0], workspace.members, size, solution, workspace.halves, stiff
    )
    return join(sample, grid, load, stiff, workspace, size, tolerance)


@jit
def join(
    sample: Sample,
    grid: Grid,
    load: float,
    stiff: Array,
    workspace: Workspace,
    size: int,
    tolerance: float,
) -> int:
    """Append the overstressed nodes to the elastic factor.

    Returns the members now, ALL if nothing remains at rest, CROWDED if there is no room for them.
    """
    count = overstressed(load, sample.excess, sample.profile, stiff, workspace, tolerance)
    if count == 0:
        return size
    if size + count > MOST_MEMBERS:
        return CROWDED
    now = append(
        workspace.factor,
        size,
        workspace.members,
        workspace.order,
        count,
        grid.column,
        workspace.diagonal,
        PIVOT,
    )
    if now < size + count:
        return ALL
    for t in range(size, now):
        workspace.inside[workspace.members[t]] = True
    return now


@jit
def settle(
    sample: Sample,
    grid: Grid,
    load: float,
    slip: Array,
    stiff: Array,
    workspace: Workspace,
    other: Workspace,
    size: int,
) -> int:
    """One step with the true states: along the unstable direction, or towards equilibrium.

    Returns ARRESTED if the step ends in the equilibrium of the members, SLIDING if nothing bounds
    it, else UNDECIDED.
    """
    n = slip.shape[0]
    for t in range(size):
        i = workspace.members[t]
        other.order[t] = i
        piece = piece_at(sample.pieces, sample.critical[i], slip[i])
        other.diagonal[i] = grid.column[0] - sample.pieces.slopes[piece] * sample.rate[i]
    now = append(
        other.factor, ZERO, other.members, other.order, size, grid.column, other.diagonal, PIVOT
    )
    direction = other.vectors[3]
    longest = 1.0
    if now < size:
        singular_direction(other, now, direction)
        longest = np.inf
    else:
        drive = other.vectors[2]
        for i in range(n):
            drive[i] = load * sample.profile[i] - strength_at(sample, slip, i) - stiff[i]
        extend_forward(other.factor, ZERO, size, other.members, drive, other.forward[0])
        right = other.vectors[0]
        solution = other.vectors[1]
        for t in range(size):
            right[t] = other.forward[0, t]
        back_substitute(other.factor, size, right, solution)
        direction[:] = 0.0
        for t in range(size):
            direction[other.members[t]] = max(solution[t], 0.0)
    step = step_to_corner(sample, slip, direction, longest)
    if not np.isfinite(step):
        return SLIDING
    solution = workspace.vectors[1]
    for t in range(size):
        solution[t] = slip[workspace.members[t]]
    apply_stiffness(
        grid.strip, grid.column[0], workspace.members, size, solution, workspace.halves, stiff
    )
    return ARRESTED if step == 1.0 and longest == 1.0 else UNDECIDED


@jit
def jump(
    sample: Sample,
    grid: Grid,
    load: float,
    slip: Array,
    stiff: Array,
    griffith: float,
    steps: int,
    workspace: Workspace,
) -> int:
    """Follow an instability at a fixed load to the next least equilibrium, or to none.

    Parameters
    ----------
    sample, grid : Sample, Grid
    load : float
        tau_0, Pa.
    slip, stiff : (n,) arrays, changed
        d of the state that became unstable, moved along the unstable direction as far as
        `step_to_corner` goes, and K d. Afterwards a lower bound of the next equilibrium, or it.
    griffith : float
        Griffith's critical crack length, in nodes: so many residual nodes in a row count as global
        sliding.
    steps : int
        Elastic steps to try at most; UNDECIDED if they are not enough.
    workspace : Workspace

    Returns
    -------
    int
        SLIDING, ARRESTED or UNDECIDED.
    """
    n = slip.shape[0]
    tolerance = stress_tolerance(sample.excess, sample.profile, load)
    workspace.diagonal[:] = grid.column[0]
    count = ZERO
    for i in range(n):
        workspace.inside[i] = slip[i] > 0.0
        if workspace.inside[i]:
            workspace.order[count] = i
            count += 1
    if count > MOST_MEMBERS:
        return UNDECIDED
    size = append(
        workspace.factor,
        ZERO,
        workspace.members,
        workspace.order,
        count,
        grid.column,
        workspace.diagonal,
        PIVOT,
    )
    if size < count:
        return SLIDING
    other = make_workspace(n)
    waited = 0
    passed = 0
    for _ in range(steps):
        before = size
        size = relax(sample, grid, load, slip, stiff, workspace, size, tolerance)
        if size == CROWDED:
            return UNDECIDED
        if size == ALL or unsupported(sample, load, slip):
            return SLIDING
        run, corners = residual_runs(sample, slip)
        if run >= griffith:
            return SLIDING
        waited += 1
        # Worth a factor of its own once elastic steps change nothing but the slip, or creep on.
        if waited < PATIENCE and (size > before or corners > passed):
            passed = corners
            continue
        waited = 0
        passed = corners
        before = size
        status = settle(sample, grid, load, slip, stiff, workspace, other, size)
        if status == SLIDING:
            return SLIDING
        size = join(sample, grid, load, stiff, workspace, size, tolerance)
        if size < 0:
            return UNDECIDED if size == CROWDED else SLIDING
        if status == ARRESTED and size == before:
            return ARRESTED
    return UNDECIDED

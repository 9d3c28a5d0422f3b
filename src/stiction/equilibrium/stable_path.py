"""The path of equilibria, event by event: the load rises until a node slips or reaches a corner.

Between events slip is linear in the load: d(load) = A_SS^-1 (load p - q). Here q is the value
at zero slip of the piece on which a node is, less the initial stress, and W the slope of it.
An event is a node at rest that reaches its strength (a new row of the factor), a slipping node
that reaches the next corner (a diagonal entry that rises as the strength falls less steeply), or a
node whose slipping, or weakening more steeply, makes A singular: there the path ends.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.elasticity.stiffness import entry, mean_relief
from stiction.equilibrium.cholesky import (
    MOST_MEMBERS,
    Workspace,
    append,
    back_substitute,
    factor_inside,
    multiply_members,
    raise_diagonal,
    singular_direction,
    solve_forward,
    substitute_members,
)
from stiction.equilibrium.sample import Sample, piece_at, start_of
from stiction.jit import ZERO, jit_allocating, jit_inside

REACHED = 0
UNSTABLE = 1
CROWDED = 2

ONE: Any = np.int64(1)
"""An index that is no literal, as `ZERO`."""
REFRESH = 16
"""Events after which slip is solved for anew, so that round-off does not accumulate."""


@jit_inside
def _begin(
    sample: Sample, slip: Array, piece: NDArray[np.int64], strength: Array, workspace: Workspace
) -> int:
    """Strength and diagonal of A for the present pieces; returns how many nodes slip."""
    count = ZERO
    for i in range(slip.shape[0]):
        workspace.inside[i] = slip[i] > 0.0
        piece[i] = piece_at(sample.pieces, sample.critical[i], slip[i])
        strength[i] = start_of(sample, i, piece[i])
        own = entry(workspace.stiffness, i, i)
        workspace.diagonal[i] = own - sample.pieces.slopes[piece[i]] * sample.rate[i]
        if workspace.inside[i]:
            count += 1
    return count


@jit_inside
def _next_event(
    sample: Sample,
    load: float,
    target: float,
    slip: Array,
    stiff: Array,
    piece: NDArray[np.int64],
    workspace: Workspace,
    size: int,
) -> tuple[float, int, int]:
    """Step of the load to the next event, the node that begins to slip and the member that reaches
    a corner, -1 for none."""
    rate, stiff_rate = workspace.vectors[3], workspace.vectors[2]
    pieces = sample.pieces
    step = target - load
    starts = -1
    ends = -1
    for i in range(slip.shape[0]):
        if not workspace.inside[i]:
            margin = max(sample.excess[i] - load * sample.profile[i] + stiff[i], 0.0)
            closing = sample.profile[i] - stiff_rate[i]
            if closing > 0.0 and margin < step * closing:
                step = margin / closing
                starts = i
    for t in range(size):
        i = workspace.members[t]
        if piece[i] < pieces.ends.shape[0] and rate[t] > 0.0:
            left = max(pieces.ends[piece[i]] * sample.critical[i] - slip[i], 0.0)
            if left < step * rate[t]:
                step = left / rate[t]
                starts = -1
                ends = t
    return step, starts, ends


@jit_inside
def _change_slope(
    workspace: Workspace, size: int, member: int, before: float, after: float
) -> int:
    """Change the weakening rate of a member in the factor; returns the members still in it."""
    node = workspace.members[member]
    workspace.diagonal[node] = entry(workspace.stiffness, node, node) - after
    if after <= before:
        raise_diagonal(workspace.factor, size, member, before - after, workspace.vectors)
        workspace.entries[member] = workspace.diagonal[node]
        return size
    # It weakens more steeply: the factor is made anew from there on.
    for t in range(member, size):
        workspace.order[t - member] = workspace.members[t]
    return append(workspace, member, size - member)


@jit_allocating
def advance(
    sample: Sample,
    load: float,
    target: float,
    slip: Array,
    stiff: Array,
    direction: Array,
    workspace: Workspace,
) -> tuple[float, float, float, int]:
    """Follow the stable path from a load towards another one; slip d and K d go with it.

    It ends where all nodes slip, too. Returned are the load at the end, the largest mean stress on
    the way (over the mean of the load profile; the load, unless a machine drives), how far a node
    slipped back (m; it would have stopped, which is not modelled) and the status. The status is
    REACHED; UNSTABLE, in the direction z >= 0, A z <= 0, that is then written; or CROWDED: more
    members than the workspace holds.
    """
    n = slip.shape[0]
    solution, stiff_rate, rate = (
        workspace.vectors[1],
        workspace.vectors[2],
        workspace.vectors[3],
    )
    pieces = sample.pieces
    piece = np.zeros(n, np.int64)
    strength = np.empty(n)
    members, order = workspace.members, workspace.order
    count = _begin(sample, slip, piece, strength, workspace)
    peak = load - mean_relief(workspace.stiffness, sample.profile, slip)
    back = 0.0
    if count > MOST_MEMBERS:
        return load, load, 0.0, CROWDED
    size = factor_inside(workspace)
    if size < count:
        # Stability was lost exactly as the residual strength was reached.
        singular_direction(workspace, size, direction)
        return load, peak, back, UNSTABLE
    substitute_members(workspace, ZERO, size, sample.profile, workspace.forward[0])
    substitute_members(workspace, ZERO, size, strength, workspace.forward[1])
    # A node begins to slip, and passes each corner, once.
    for event in range((1 + pieces.ends.shape[0]) * n + 1):
        for t in range(size):
            rate[t] = workspace.forward[0, t]
        back_substitute(workspace.factor, size, rate)
        multiply_members(workspace, size, rate, stiff_rate)
        if event % REFRESH == 0:
            solve_forward(workspace, size, load, solution)
            multiply_members(workspace, size, solution, stiff)
            for t in range(size):
                before = slip[members[t]]
                slip[members[t]] = max(solution[t], 0.0)
                back = max(back, before - slip[members[t]])
        step, starts, ends = _next_event(
            sample, load, target, slip, stiff, piece, workspace, size
        )
        load = target if starts < 0 and ends < 0 else load + step
        for t in range(size):
            slip[members[t]] += step * rate[t]
            back = max(back, -step * rate[t])
        for i in range(n):
            stiff[i] += step * stiff_rate[i]
        peak = max(peak, load - mean_relief(workspace.stiffness, sample.profile, slip))
        changed = size
        if ends >= 0:
            i = members[ends]
            slip[i] = pieces.ends[piece[i]] * sample.critical[i]
            before = pieces.slopes[piece[i]] * sample.rate[i]
            piece[i] += 1
            strength[i] = start_of(sample, i, piece[i])
            after = pieces.slopes[piece[i]] * sample.rate[i]
            now = _change_slope(workspace, size, ends, before, after)
            if now < size:
                singular_direction(workspace, now, direction)
                return load, peak, back, UNSTABLE
            changed = ends
        elif starts >= 0:
            if size == MOST_MEMBERS:
                return load, peak, back, CROWDED
            order[0] = starts
            now = append(workspace, size, ONE)
            if now == size:
                singular_direction(workspace, size, direction)
                return load, peak, back, UNSTABLE
            workspace.inside[starts] = True
            size = now
            if size == n:
                return load, peak, back, REACHED
        else:
            return load, peak, back, REACHED
        substitute_members(workspace, changed, size, sample.profile, workspace.forward[0])
        substitute_members(workspace, changed, size, strength, workspace.forward[1])
    return load, peak, back, CROWDED

"""The path of equilibria, event by event: the load rises until a node slips or reaches a corner.

Between events slip is linear in the load, d(load) = A_SS^-1 (load p - q) with q what the piece of
the law on which a node is has at zero slip, less the initial stress, and W the slope of the piece.
An event is a node at rest that reaches its strength (a row of the factor more), a slipping node
that reaches the next corner (a diagonal entry that rises as the strength falls less steeply), or a
node whose slipping, or weakening more steeply, makes A singular: there the path ends.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.elasticity.line_stiffness import apply_stiffness
from stiction.equilibrium.cholesky import append, back_substitute, extend_forward, raise_diagonal
from stiction.equilibrium.linear_program import PIVOT, singular_direction, solve_forward
from stiction.equilibrium.pieces import piece_at, start_of
from stiction.equilibrium.workspace import MOST_MEMBERS, Grid, Sample, Workspace
from stiction.jit import ZERO, jit

REACHED = 0
UNSTABLE = 1
CROWDED = 2

REFRESH = 16
"""Events after which slip is solved for anew, lest round-off adds up."""


@jit
def build(
    sample: Sample,
    grid: Grid,
    slip: Array,
    piece: NDArray[np.int64],
    strength: Array,
    workspace: Workspace,
) -> int:
    """Strength and diagonal of A for the present pieces; returns how many nodes slip."""
    count = ZERO
    pieces = sample.pieces
    for i in range(slip.shape[0]):
        workspace.inside[i] = slip[i] > 0.0
        piece[i] = piece_at(pieces, sample.critical[i], slip[i])
        strength[i] = start_of(pieces, sample.excess[i], sample.residual[i], piece[i])
        workspace.diagonal[i] = grid.column[0] - pieces.slopes[piece[i]] * sample.rate[i]
        if workspace.inside[i]:
            workspace.order[count] = i
            count += 1
    return count


@jit
def advance(
    sample: Sample,
    grid: Grid,
    load: float,
    target: float,
    slip: Array,
    stiff: Array,
    direction: Array,
    workspace: Workspace,
) -> tuple[float, int]:
    """Follow the stable path from one load towards another.

    Parameters
    ----------
    sample, grid : Sample, Grid
    load : float
        tau_0 (Pa) at which `slip` is a stable equilibrium.
    target : float
        Load at which to stop.
    slip, stiff : (n,) arrays, changed
        d and K d.
    direction : (n,) array, output
        If the path ends: in which it is unstable, z >= 0 and A z <= 0.
    workspace : Workspace

    Returns
    -------
    load, status : float, int
        REACHED, UNSTABLE, or CROWDED: more members than the workspace holds.
    """
    n = slip.shape[0]
    right = workspace.vectors[0]
    solution = workspace.vectors[1]
    stiff_rate = workspace.vectors[2]
    rate = workspace.vectors[3]
    pieces = sample.pieces
    last = pieces.ends.shape[0]
    piece = np.zeros(n, np.int64)
    strength = np.empty(n)
    own = grid.column[0]
    members, order, diagonal = workspace.members, workspace.order, workspace.diagonal
    count = build(sample, grid, slip, piece, strength, workspace)
    if count > MOST_MEMBERS:
        return load, CROWDED
    size = append(workspace.factor, ZERO, members, order, count, grid.column, diagonal, PIVOT)
    if size < count:
        # Stability was lost exactly as the residual strength was reached.
        singular_direction(workspace, size, direction)
        return load, UNSTABLE
    extend_forward(workspace.factor, ZERO, size, members, sample.profile, workspace.forward[0])
    extend_forward(workspace.factor, ZERO, size, members, strength, workspace.forward[1])
    for event in range((1 + last) * n + 1):  # a node begins to slip, and passes each corner, once
        for t in range(size):
            right[t] = workspace.forward[0, t]
        back_substitute(workspace.factor, size, right, rate)
        apply_stiffness(grid.strip, own, members, size, rate, workspace.halves, stiff_rate)
        if event % REFRESH == 0:
            solve_forward(workspace, size, load, solution)
            apply_stiffness(grid.strip, own, members, size, solution, workspace.halves, stiff)
            for t in range(size):
                slip[members[t]] = max(solution[t], 0.0)
        step = target - load
        starts = -1
        ends = -1
        for i in range(n):
            if not workspace.inside[i]:
                margin = max(sample.excess[i] - load * sample.profile[i] + stiff[i], 0.0)
                closing = sample.profile[i] - stiff_rate[i]
                if closing > 0.0 and margin < step * closing:
                    step = margin / closing
                    starts = i
        for t in range(size):
            i = members[t]
            if piece[i] < last and rate[t] > 0.0:
                left = max(pieces.ends[piece[i]] * sample.critical[i] - slip[i], 0.0)
                if left < step * rate[t]:
                    step = left / rate[t]
                    starts = -1
                    ends = t
        load = target if starts < 0 and ends < 0 else load + step
        for t in range(size):
            slip[members[t]] += step * rate[t]
        for i in range(n):
            stiff[i] += step * stiff_rate[i]
        if ends >= 0:
            i = members[ends]
            slip[i] = pieces.ends[piece[i]] * sample.critical[i]
            before = pieces.slopes[piece[i]] * sample.rate[i]
            piece[i] += 1
            strength[i] = start_of(pieces, sample.excess[i], sample.residual[i], piece[i])
            after = pieces.slopes[piece[i]] * sample.rate[i]
            diagonal[i] = own - after
            if after <= before:
                raise_diagonal(workspace.factor, size, ends, before - after, workspace.vectors)
            else:  # it weakens more steeply: the factor is made anew from there on
                order[: size - ends] = members[ends:size]
                now = append(
                    workspace.factor,
                    ends,
                    members,
                    order,
                    size - ends,
                    grid.column,
                    diagonal,
                    PIVOT,
                )
                if now < size:
                    singular_direction(workspace, now, direction)
                    return load, UNSTABLE
            extend_forward(
                workspace.factor, ends, size, members, sample.profile, workspace.forward[0]
            )
            extend_forward(workspace.factor, ends, size, members, strength, workspace.forward[1])
        elif starts >= 0:
            if size == MOST_MEMBERS:
                return load, CROWDED
            order[0] = starts
            now = append(workspace.factor, size, members, order, 1, grid.column, diagonal, PIVOT)
            if now == size:
                singular_direction(workspace, size, direction)
                return load, UNSTABLE
            extend_forward(
                workspace.factor, size, now, members, sample.profile, workspace.forward[0]
            )
            extend_forward(workspace.factor, size, now, members, strength, workspace.forward[1])
            workspace.inside[starts] = True
            size = now
        else:
            return load, REACHED
    return load, CROWDED

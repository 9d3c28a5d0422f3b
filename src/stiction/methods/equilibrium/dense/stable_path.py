"""The path of equilibria, event by event: the load rises until a node slips or reaches a corner.

Between events slip is linear in the load: d(load) = A_SS^-1 (load p - q). Here q is the value
at zero slip of the piece on which a node is, less the initial stress, and W the slope of it.
An event is a node at rest that reaches its strength (a new row of the factor), a slipping node
that reaches the next corner (a diagonal entry that rises as the strength falls less steeply), or a
node whose slipping, or weakening more steeply, makes A singular: there the path ends.

Slip never goes back. Where K has positive entries off its diagonal, slip may unload other nodes: at
the nodes at their strength the rates v of slip solve v >= 0, A v - p >= 0, <v, A v - p> = 0, the
conditions of a minimum of <v, A v>/2 - <p, v> over v >= 0. After an event the rates move from those
before towards the minimum on the face of the slipping nodes; the first node whose rate reaches zero
leaves it: it stops, and rests at the strength of the slip that it has reached. A node that comes to
its strength, again or in no time, is an event as above. Each such move lowers the function, so that
they end, at a minimum or in a direction y >= 0, <y, A y> <= 0 that nothing bounds: the instability.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit_allocating, jit_inside
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
    raise_diagonal,
    remove,
    singular_direction,
    solve_forward,
    substitute_members,
    take_off_resting,
)
from stiction.methods.equilibrium.dense.linear_program import stress_tolerance
from stiction.methods.equilibrium.sample import piece_at, start_of, strength_at

REACHED = 0
UNSTABLE = 1

ONE: Any = np.int64(1)
"""An index that is no literal, as `ZERO`."""
REFRESH = 16
"""Events after which slip is solved for anew, so that round-off does not accumulate."""
AT_STRENGTH = 1e3
"""Overstresses by round-off below its strength within which a node counts as at it."""
STARTS = 16
"""Times that a node may start again, on average."""
REVERSED = 1e-10
"""Share of the largest rate by which a rate below zero is round-off."""


@jit_inside
def _begin(
    course: Course, load: float, piece: NDArray[np.int64], strength: Array
) -> tuple[int, bool]:
    """Strength and diagonal of A for the present pieces.

    Returns how many nodes slip, and whether others rest that slipped before.
    """
    sample, slip, stiff, workspace, stops = course
    count = ZERO
    rests = False
    near = AT_STRENGTH * stress_tolerance(sample, load)
    for i in range(slip.shape[0]):
        slips = slip[i] > 0.0
        piece[i] = piece_at(sample.pieces, sample.critical[i], slip[i])
        strength[i] = start_of(sample, i, piece[i])
        own = entry(workspace.stiffness, i, i)
        workspace.diagonal[i] = own - sample.pieces.slopes[piece[i]] * sample.rate[i]
        if stops and slips:
            margin = strength_at(sample, slip, i) - load * sample.profile[i] + stiff[i]
            slips = margin <= near
            rests = rests or not slips
        workspace.inside[i] = slips
        if slips:
            count += 1
    return count, rests


@jit_inside
def _first_to_stop(
    workspace: Workspace, size: int, values: Array, speed: Array, endless: bool
) -> int:
    """Member whose rate is the first to reach zero as rates go towards `values`; -1 for none.

    The rates (n,) move as far as that. If the move is `endless`, rates go along `values` instead.
    """
    members = workspace.members
    largest = 0.0
    for t in range(size):
        largest = max(largest, abs(values[t]))
    first = -1
    share = np.inf
    for t in range(size):
        if values[t] < -REVERSED * largest:
            now = speed[members[t]]
            reach = now / ((0.0 if endless else now) - values[t])
            if reach < share or (reach == share and values[t] < values[first]):
                first = t
                share = reach
    if first >= 0:
        for t in range(size):
            i = members[t]
            change = values[t] - (0.0 if endless else speed[i])
            speed[i] = max(speed[i] + share * change, 0.0)
    return first


@jit_inside
def _fails(course: Course, size: int, speed: Array, direction: Array) -> int:
    """Write the direction after a pivot failed; the member whose rate bounds it, -1 for none.

    Rates then move along it until that of the member is zero.
    """
    workspace = course.workspace
    singular_direction(workspace, size, direction)
    if not course.stops:
        return -1
    solution = workspace.solution
    solution[size] = 1.0
    return _first_to_stop(workspace, size + 1, solution, speed, True)


@jit_inside
def _stop(course: Course, size: int, member: int, speed: Array) -> int:
    """Let a member rest; returns how many slip on."""
    workspace = course.workspace
    node = workspace.members[member]
    workspace.inside[node] = False
    speed[node] = 0.0
    size = remove(workspace, size, member)
    take_off_resting(course)
    return size


@jit_inside
def _keep_members(course: Course, size: int, speed: Array) -> None:
    """Let all others rest; those at their strength slip on in the next events."""
    members, inside = course.workspace.members, course.workspace.inside
    for i in range(speed.shape[0]):
        inside[i] = False
    for t in range(size):
        inside[members[t]] = True
    for i in range(speed.shape[0]):
        if not inside[i]:
            speed[i] = 0.0
    take_off_resting(course)


@jit_inside
def _substitute(course: Course, strength: Array, first: int, size: int) -> None:
    """Extend both forward substitutions by the members first..size-1."""
    workspace, profile = course.workspace, course.sample.profile
    right, resting = workspace.right, workspace.resting
    for t in range(first, size):
        i = workspace.members[t]
        right[i] = strength[i] + resting[i]
    substitute_members(workspace, first, size, profile, workspace.forward_load)
    substitute_members(workspace, first, size, right, workspace.forward_strength)


@jit_inside
def all_slip(course: Course) -> bool:
    """Whether every node slips or has slipped."""
    slip, count = course.slip, ZERO
    for i in range(slip.shape[0]):
        count += course.workspace.inside[i] or slip[i] > 0.0
    return bool(count == slip.shape[0])


@jit_inside
def _next_event(
    course: Course, load: float, target: float, piece: NDArray[np.int64], size: int
) -> tuple[float, int, int]:
    """Step of the load to the next event, the node that begins to slip and the member that reaches
    a corner, -1 for none."""
    sample, slip, stiff, workspace, _ = course
    rate, stiff_rate, pieces = workspace.rates, workspace.product, sample.pieces
    step = target - load
    starts = -1
    ends = -1
    for i in range(slip.shape[0]):
        if not workspace.inside[i]:
            present = strength_at(sample, slip, i) if slip[i] > 0.0 else sample.excess[i]
            margin = max(present - load * sample.profile[i] + stiff[i], 0.0)
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
        raise_diagonal(workspace.factor, size, member, before - after, workspace.turns)
        workspace.held_diagonal[member] = workspace.diagonal[node]
        return size
    # It weakens more steeply: the factor is made anew from there on.
    for t in range(member, size):
        workspace.order[t - member] = workspace.members[t]
    return append(workspace, member, size - member)


@jit_allocating
def advance(
    course: Course, load: float, target: float, direction: Array
) -> tuple[float, float, bool, int]:
    """Follow the stable path from a load towards another one.

    It ends where all nodes have slipped, too. Returned are the load at the end, the largest mean
    stress on the way (over the mean of the load profile; the load, unless a machine drives),
    whether a node stopped or rests after slip, and the status: REACHED; UNSTABLE, in the direction
    z >= 0, A z <= 0, that is then written; or CROWDED: more members than the workspace holds.
    """
    sample, slip, stiff, workspace, stops = course
    n = slip.shape[0]
    solution, stiff_rate, rate = workspace.solution, workspace.product, workspace.rates
    resting = workspace.resting
    pieces = sample.pieces
    piece = np.zeros(n, np.int64)
    strength = np.empty(n)
    speed = np.zeros(n)
    members, order = workspace.members, workspace.order
    count, stopped = _begin(course, load, piece, strength)
    peak = load - mean_relief(workspace.stiffness, sample.profile, slip)
    if count > MOST_MEMBERS:
        return load, load, stopped, CROWDED
    size = factor_inside(workspace)
    if size < count:
        # Stability was lost exactly as the residual strength was reached.
        if _fails(course, size, speed, direction) < 0:
            return load, peak, stopped, UNSTABLE
        _keep_members(course, size, speed)
    for i in range(n):
        resting[i] = 0.0
    if stopped or size < count:
        take_off_resting(course)
    _substitute(course, strength, ZERO, size)
    # Unless it stops, a node begins to slip, and passes each corner, once.
    for event in range((1 + STARTS * stops + pieces.ends.shape[0]) * n + 1):
        while True:
            for t in range(size):
                rate[t] = workspace.forward_load[t]
            back_substitute(workspace.factor, size, rate)
            first = _first_to_stop(workspace, size, rate, speed, False) if stops else -1
            if first < 0:
                break
            stopped = True
            size = _stop(course, size, first, speed)
            _substitute(course, strength, ZERO, size)
        for t in range(size):
            i = members[t]
            speed[i] = max(rate[t], 0.0)
            weakening = entry(workspace.stiffness, i, i) - workspace.diagonal[i]
            stiff_rate[i] = sample.profile[i] + weakening * rate[t]
        multiply_outside(workspace, size, rate, stiff_rate)
        if event % REFRESH == 0:
            solve_forward(workspace, size, load, solution)
            multiply_members(workspace, size, solution, stiff)
            for t in range(size):
                slip[members[t]] = max(solution[t], 0.0)
            for i in range(n):
                stiff[i] += resting[i]
        step, starts, ends = _next_event(course, load, target, piece, size)
        load = target if starts < 0 and ends < 0 else load + step
        for t in range(size):
            slip[members[t]] += step * rate[t]
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
            changed = ends
            if now < size:
                if _fails(course, now, speed, direction) < 0:
                    return load, peak, stopped, UNSTABLE
                size = now
                _keep_members(course, size, speed)
                changed = ZERO
        elif starts >= 0:
            if size == MOST_MEMBERS:
                return load, peak, stopped, CROWDED
            while True:
                order[0] = starts
                if append(workspace, size, ONE) > size:
                    break
                first = _fails(course, size, speed, direction)
                if first < 0:
                    return load, peak, stopped, UNSTABLE
                stopped = True
                size = _stop(course, size, first, speed)
                changed = ZERO
            workspace.inside[starts] = True
            size += 1
            if slip[starts] > 0.0:  # it had stopped
                take_off_resting(course)
                changed = ZERO
            if all_slip(course):
                return load, peak, stopped, REACHED
        else:
            return load, peak, stopped, REACHED
        _substitute(course, strength, changed, size)
    return load, peak, stopped, CROWDED

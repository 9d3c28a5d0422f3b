"""The onset as a linear programme, by an active set that grows and dual cuts that lower the load.

At a load the nodes that must slip are added until none is overstressed, the most overstressed
first. If A on the slipping nodes ceases to be positive definite as node j joins, the load is too
high, and y = (-A_SS^-1 A_Sj, 1) says by how much: A y <= 0, so <s, y>/<p, y> is a lower upper
bound (a cut). The same slipping nodes, less the few that do not slip at the lower load, go on from
there. A load that is an upper bound and has an equilibrium is the critical one.
"""

from __future__ import annotations

from stiction._jit import ZERO, jit
from stiction._typing import Array
from stiction.elasticity.line_stiffness import apply_stiffness
from stiction.equilibrium.cholesky import append, back_substitute, extend_forward, row_start
from stiction.equilibrium.workspace import MOST_MEMBERS, Grid, Room

SOLVED = 0
STALLED = 1
OVERFULL = 2

PIVOT = 1e-13
"""Share of the diagonal below which a pivot is round-off."""
OVERSTRESS = 1e-12
"""Share of the mean strength below which an overstress is round-off."""
PASSES = 10_000


@jit
def sort_by(keys: Array, order: Array, count: int) -> None:
    """Sort `order[:count]` by rising `keys[:count]`, both in place (Shell, Ciura's gaps)."""
    for gap in (1750, 701, 301, 132, 57, 23, 10, 4, 1):
        for i in range(gap, count):
            key = keys[i]
            node = order[i]
            j = i
            while j >= gap and keys[j - gap] > key:
                keys[j] = keys[j - gap]
                order[j] = order[j - gap]
                j -= gap
            keys[j] = key
            order[j] = node


@jit
def solve_forward(room: Room, size: int, load: float, solution: Array) -> None:
    """Slip of the members at a load, A_SS d = load p - s, from the forward substitutions."""
    right = room.vectors[0]
    for t in range(size):
        right[t] = load * room.forward[0, t] - room.forward[1, t]
    back_substitute(room.factor, size, right, solution)


@jit
def singular_direction(room: Room, size: int, direction: Array) -> None:
    """The field y = (-A_SS^-1 A_Sj, 1) after `append` failed at the node j = members[size].

    It is not negative and A y <= 0, as A is a Z-matrix: a bound for the load, and the direction in
    which slip runs away.
    """
    right = room.vectors[0]
    solution = room.vectors[1]
    start = row_start(size)
    for t in range(size):
        right[t] = -room.factor[start + t]
    back_substitute(room.factor, size, right, solution)
    direction[:] = 0.0
    for t in range(size):
        direction[room.members[t]] = max(solution[t], 0.0)
    direction[room.members[size]] = 1.0


@jit
def overstressed(
    load: float, excess: Array, profile: Array, stiff: Array, room: Room, tolerance: float
) -> int:
    """Nodes at rest above their strength, most overstressed first; returns how many."""
    count = ZERO
    keys = room.vectors[2]
    for i in range(excess.shape[0]):
        margin = excess[i] - load * profile[i] + stiff[i]
        if margin < -tolerance and not room.inside[i]:
            keys[count] = margin
            room.order[count] = i
            count += 1
    sort_by(keys, room.order, count)
    return count


@jit
def stress_tolerance(excess: Array, profile: Array, load: float) -> float:
    """Overstress, Pa, that is round-off."""
    scale = 0.0
    for i in range(excess.shape[0]):
        scale += abs(excess[i]) + abs(load) * profile[i]
    return OVERSTRESS * scale / excess.shape[0]


@jit
def back_off(
    load: float,
    excess: Array,
    profile: Array,
    grid: Grid,
    room: Room,
    size: int,
    solution: Array,
    stiff: Array,
) -> None:
    """Lower the load of the slip by so little that no node at rest is overstressed.

    Close to the onset slip grows so fast with the load that round-off in the load alone may leave
    a node overstressed. One step along the tangent d d/d load mends it.
    """
    right = room.vectors[0]
    stiff_rate = room.vectors[2]
    own = grid.column[0]
    for t in range(size):
        right[t] = room.forward[0, t]
    back_substitute(room.factor, size, right, solution)
    apply_stiffness(grid.strip, own, room.members, size, solution, room.halves, stiff_rate)
    step = 0.0
    for i in range(excess.shape[0]):
        margin = excess[i] - load * profile[i] + stiff[i]
        if margin < 0.0 and not room.inside[i]:
            step = max(step, margin / (stiff_rate[i] - profile[i]))
    solve_forward(room, size, load - step, solution)
    apply_stiffness(grid.strip, own, room.members, size, solution, room.halves, stiff)


@jit
def solve_program(
    excess: Array,
    profile: Array,
    grid: Grid,
    bound: float,
    cap: float,
    multiplier: Array,
    slip: Array,
    stiff: Array,
    room: Room,
) -> tuple[float, int]:
    """Critical load with slip and multiplier, from an upper bound and its multiplier.

    Parameters
    ----------
    excess, profile : (n,) arrays
        s = tau_p - tau_i (Pa), load profile p.
    grid : Grid
    bound : float
        An upper bound of the load that belongs to `multiplier`.
    cap : float
        Do not look above this load: if it is below the critical one, the result is the least
        equilibrium at `cap`.
    multiplier : (n,) array, changed
        y of the lowest upper bound, <p, y> = 1.
    slip, stiff : (n,) arrays, output
        d and K d.
    room : Room
        With room.diagonal set to the diagonal of A.

    Returns
    -------
    load, status : float, int
        SOLVED, STALLED after too many passes, or OVERFULL: more members than there is room for.
    """
    load = min(bound, cap)
    tolerance = stress_tolerance(excess, profile, load)
    members = room.members
    inside = room.inside
    solution = room.vectors[1]
    own = grid.column[0]
    inside[:] = False
    stiff[:] = 0.0
    size = ZERO
    status = STALLED
    for _ in range(PASSES):
        count = overstressed(load, excess, profile, stiff, room, tolerance)
        if count == 0:
            status = SOLVED
            break
        if size + count > MOST_MEMBERS:
            status = OVERFULL
            break
        before = size
        size = append(
            room.factor, size, members, room.order, count, grid.column, room.diagonal, PIVOT
        )
        extend_forward(room.factor, before, size, members, profile, room.forward[0])
        extend_forward(room.factor, before, size, members, excess, room.forward[1])
        for t in range(before, size):
            inside[members[t]] = True
        failed = size < before + count
        settled = False
        if failed:
            direction = room.vectors[3]
            singular_direction(room, size, direction)
            above = 0.0
            below = 0.0
            for t in range(size + 1):
                node = members[t]
                above += direction[node] * excess[node]
                below += direction[node] * profile[node]
            settled = above / below >= load - tolerance
            if above / below < bound:
                bound = above / below
                for i in range(excess.shape[0]):
                    multiplier[i] = direction[i] / below
            load = min(load, bound)
        solve_forward(room, size, load, solution)
        if failed:
            # Members that joined only because the load was too high would slip backwards now.
            kept = 0
            while kept < size:
                kept = 0
                while kept < size and solution[kept] >= 0.0:
                    kept += 1
                if kept < size:
                    for t in range(kept, size):
                        inside[members[t]] = False
                    size = kept
                    solve_forward(room, size, load, solution)
                    kept = 0
                    if size == 0:
                        break
        apply_stiffness(grid.strip, own, members, size, solution, room.halves, stiff)
        if settled:  # a cut that lowers the load by round-off only: this is the optimum
            status = SOLVED
            back_off(load, excess, profile, grid, room, size, solution, stiff)
            break
    slip[:] = 0.0
    for t in range(size):
        slip[members[t]] = max(solution[t], 0.0)
    return load, status

"""The onset as a linear programme, by an active set that grows and dual cuts that lower the load.

At a load the nodes that must slip are added until none is overstressed, the most overstressed
first. If A on the slipping nodes ceases to be positive definite as node j joins, the load is too
high, and y = (-A_SS^-1 A_Sj, 1) says by how much: A y <= 0, so <s, y>/<p, y> is a lower upper
bound (a cut). The same slipping nodes, less the few that do not slip at the lower load, go on from
there. A load that is an upper bound and has an equilibrium is the critical one.
"""

from __future__ import annotations

from stiction.arrays import Array
from stiction.elasticity.line_stiffness import apply_stiffness
from stiction.equilibrium.cholesky import append, back_substitute, extend_forward, row_start
from stiction.equilibrium.workspace import MOST_MEMBERS, Grid, Workspace
from stiction.jit import ZERO, jit

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
def solve_forward(workspace: Workspace, size: int, load: float, solution: Array) -> None:
    """Slip of the members at a load, A_SS d = load p - s, from the forward substitutions."""
    right = workspace.vectors[0]
    for t in range(size):
        right[t] = load * workspace.forward[0, t] - workspace.forward[1, t]
    back_substitute(workspace.factor, size, right, solution)


@jit
def singular_direction(workspace: Workspace, size: int, direction: Array) -> None:
    """The field y = (-A_SS^-1 A_Sj, 1) after `append` failed at the node j = members[size].

    It is not negative and A y <= 0, as A is a Z-matrix: a bound for the load, and the direction in
    which slip runs away.
    """
    right = workspace.vectors[0]
    solution = workspace.vectors[1]
    start = row_start(size)
    for t in range(size):
        right[t] = -workspace.factor[start + t]
    back_substitute(workspace.factor, size, right, solution)
    direction[:] = 0.0
    for t in range(size):
        direction[workspace.members[t]] = max(solution[t], 0.0)
    direction[workspace.members[size]] = 1.0


@jit
def overstressed(
    load: float, excess: Array, profile: Array, stiff: Array, workspace: Workspace, tolerance: float
) -> int:
    """Nodes at rest above their strength, most overstressed first; returns how many."""
    count = ZERO
    keys = workspace.vectors[2]
    for i in range(excess.shape[0]):
        margin = excess[i] - load * profile[i] + stiff[i]
        if margin < -tolerance and not workspace.inside[i]:
            keys[count] = margin
            workspace.order[count] = i
            count += 1
    sort_by(keys, workspace.order, count)
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
    workspace: Workspace,
    size: int,
    solution: Array,
    stiff: Array,
) -> None:
    """Lower the load of the slip by so little that no node at rest is overstressed.

    Close to the onset slip grows so fast with the load that round-off in the load alone may leave
    a node overstressed. One step along the tangent d d/d load mends it.
    """
    right = workspace.vectors[0]
    stiff_rate = workspace.vectors[2]
    own = grid.column[0]
    for t in range(size):
        right[t] = workspace.forward[0, t]
    back_substitute(workspace.factor, size, right, solution)
    apply_stiffness(
        grid.strip, own, workspace.members, size, solution, workspace.halves, stiff_rate
    )
    step = 0.0
    for i in range(excess.shape[0]):
        margin = excess[i] - load * profile[i] + stiff[i]
        if margin < 0.0 and not workspace.inside[i]:
            step = max(step, margin / (stiff_rate[i] - profile[i]))
    solve_forward(workspace, size, load - step, solution)
    apply_stiffness(grid.strip, own, workspace.members, size, solution, workspace.halves, stiff)


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
    workspace: Workspace,
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
    workspace : Workspace
        With workspace.diagonal set to the diagonal of A.

    Returns
    -------
    load, status : float, int
        SOLVED, STALLED after too many passes, or OVERFULL: more members than the workspace holds.
    """
    load = min(bound, cap)
    tolerance = stress_tolerance(excess, profile, load)
    members = workspace.members
    inside = workspace.inside
    solution = workspace.vectors[1]
    own = grid.column[0]
    inside[:] = False
    stiff[:] = 0.0
    size = ZERO
    status = STALLED
    for _ in range(PASSES):
        count = overstressed(load, excess, profile, stiff, workspace, tolerance)
        if count == 0:
            status = SOLVED
            break
        if size + count > MOST_MEMBERS:
            status = OVERFULL
            break
        before = size
        size = append(
            workspace.factor,
            size,
            members,
            workspace.order,
            count,
            grid.column,
            workspace.diagonal,
            PIVOT,
        )
        extend_forward(workspace.factor, before, size, members, profile, workspace.forward[0])
        extend_forward(workspace.factor, before, size, members, excess, workspace.forward[1])
        for t in range(before, size):
            inside[members[t]] = True
        failed = size < before + count
        settled = False
        if failed:
            direction = workspace.vectors[3]
            singular_direction(workspace, size, direction)
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
        solve_forward(workspace, size, load, solution)
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
                    solve_forward(workspace, size, load, solution)
                    kept = 0
                    if size == 0:
                        break
        apply_stiffness(grid.strip, own, members, size, solution, workspace.halves, stiff)
        if settled:  # a cut that lowers the load by round-off only: this is the optimum
            status = SOLVED
            back_off(load, excess, profile, grid, workspace, size, solution, stiff)
            break
    slip[:] = 0.0
    for t in range(size):
        slip[members[t]] = max(solution[t], 0.0)
    return load, status

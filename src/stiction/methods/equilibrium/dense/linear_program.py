"""The onset as a linear programme, by an active set that grows and dual cuts that lower the load.

At a load the nodes that must slip are added until none is overstressed, the most overstressed
first. If A on the slipping nodes ceases to be positive definite as node j joins, the load is too
high, and y = (-A_SS^-1 A_Sj, 1) shows by how much: A y <= 0, so <s, y>/<p, y> is a lower upper
bound (a cut). The same slipping nodes, less the few that do not slip at the lower load, go on from
there. A load that is an upper bound and has an equilibrium is the critical one.
"""

import numpy as np

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit, jit_inside
from stiction.elasticity.stiffness import apply, entry
from stiction.methods.equilibrium.dense.cholesky import (
    MOST_MEMBERS,
    Course,
    Workspace,
    append,
    back_substitute,
    multiply_members,
    singular_direction,
    solve_forward,
    substitute_members,
)
from stiction.methods.equilibrium.sample import StaticSample, strength_at

OVERSTRESS = 1e-12
"""Share of the mean strength below which an overstress is round-off."""
CLOSE = 0.02
"""Relative distance of a stable load below the bound at which the bound itself is tried."""
PASSES = 10_000
"""Bound of a loop in which each pass adds a node or lowers the load."""
NEARER = 0.75
"""Share of the way to the bound by which a stable load is raised until close to it."""


@jit_inside
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


@jit_inside
def overstressed(course: Course, load: float, least: float) -> int:
    """Put the nodes at rest above their strength into `order`, most overstressed first."""
    sample, slip, stiff, workspace, _ = course
    count = ZERO
    keys = workspace.keys
    for i in range(stiff.shape[0]):
        if not workspace.inside[i]:
            present = strength_at(sample, slip, i) if slip[i] > 0.0 else sample.excess[i]
            margin = present - load * sample.profile[i] + stiff[i]
            if margin < -least:
                keys[count] = margin
                workspace.order[count] = i
                count += 1
    sort_by(keys, workspace.order, count)
    return count


@jit_inside
def stress_tolerance(sample: StaticSample, load: float) -> float:
    """Overstress, Pa, that counts as round-off."""
    scale = 0.0
    n = sample.excess.shape[0]
    for i in range(n):
        scale += abs(sample.excess[i]) + abs(load) * sample.profile[i]
    return OVERSTRESS * scale / n


@jit_inside
def _back_off(course: Course, load: float, size: int) -> None:
    """Lower the load of the slip by so little that no node at rest is overstressed.

    Close to the onset slip grows so fast with the load that round-off in the load alone may leave
    a node overstressed. One step along the tangent d d/d load mends it.
    """
    sample, _, stiff, workspace, _ = course
    solution, stiff_rate = workspace.solution, workspace.product
    for t in range(size):
        solution[t] = workspace.forward_load[t]
    back_substitute(workspace.factor, size, solution)
    multiply_members(workspace, size, solution, stiff_rate)
    step = 0.0
    for i in range(stiff.shape[0]):
        margin = sample.excess[i] - load * sample.profile[i] + stiff[i]
        if margin < 0.0 and not workspace.inside[i]:
            step = max(step, margin / (stiff_rate[i] - sample.profile[i]))
    solve_forward(workspace, size, load - step, solution)
    multiply_members(workspace, size, solution, stiff)


@jit_inside
def _without_reversed(workspace: Workspace, size: int, load: float) -> int:
    """Remove the members that would slip backwards at a load; return the number that stay."""
    solution = workspace.solution
    while size > 0:
        kept = 0
        while kept < size and solution[kept] >= 0.0:
            kept += 1
        if kept == size:
            break
        for t in range(kept, size):
            workspace.inside[workspace.members[t]] = False
        size = kept
        solve_forward(workspace, size, load, solution)
    return size


@jit
def solve_program(
    course: Course, start: float, bound: float, cap: float, multiplier: Array
) -> tuple[float, bool]:
    """Critical load with slip d, K d and multiplier, from an upper bound and its multiplier.

    The load is first `start`, then each time three quarters nearer to the bound until close to
    it: at too high a load far too many nodes join. Nodes that already slip (`slip`) join
    first. If `cap` is below the critical load, the result is the least equilibrium there. It is not
    solved after too many passes, or if the workspace cannot hold the members.
    """
    sample, slip, stiff, workspace, _ = course
    top = min(bound, cap)
    load = min(start, top)
    tolerance = stress_tolerance(sample, top)
    members, inside = workspace.members, workspace.inside
    solution = workspace.solution
    size = ZERO
    known = ZERO
    for i in range(slip.shape[0]):
        workspace.diagonal[i] = entry(workspace.stiffness, i, i) - sample.rate[i]
        inside[i] = False
        stiff[i] = 0.0
        if slip[i] > 0.0:
            workspace.order[known] = i
            known += 1
            slip[i] = 0.0
    solved = False
    for _ in range(PASSES):
        count = known or overstressed(course, load, tolerance)
        known = ZERO
        if count == 0:
            top = min(bound, cap)
            if load >= top:
                solved = True
                break
            load = (
                top if top - load <= CLOSE * abs(top) else (1.0 - NEARER) * load + NEARER * top
            )
            solve_forward(workspace, size, load, solution)
            multiply_members(workspace, size, solution, stiff)
            continue
        if size + count > MOST_MEMBERS:
            break
        before = size
        size = append(workspace, size, count)
        substitute_members(workspace, before, size, sample.profile, workspace.forward_load)
        substitute_members(workspace, before, size, sample.excess, workspace.forward_strength)
        for t in range(before, size):
            inside[members[t]] = True
        failed = size < before + count
        settled = False
        if failed:
            direction = workspace.direction
            singular_direction(workspace, size, direction)
            above = 0.0
            below = 0.0
            for t in range(size + 1):
                node = members[t]
                above += direction[node] * sample.excess[node]
                below += direction[node] * sample.profile[node]
            settled = above / below >= load - tolerance
            if above / below < bound:
                bound = above / below
                for i in range(multiplier.shape[0]):
                    multiplier[i] = direction[i] / below
            load = min(load, bound)
        solve_forward(workspace, size, load, solution)
        if failed:  # members that joined only because the load was too high
            size = _without_reversed(workspace, size, load)
        multiply_members(workspace, size, solution, stiff)
        if settled:  # a cut that lowers the load by round-off only: this is the optimum
            solved = True
            _back_off(course, load, size)
            break
    for t in range(size):
        slip[members[t]] = max(solution[t], 0.0)
    return load, solved


@jit
def certificate(
    sample: StaticSample, slip: Array, stiff: Array, multiplier: Array, workspace: Workspace
) -> float:
    """Distance of the rigorous bounds from below (by the slip) and from above (by y), Pa.

    K y is left in ``workspace.product``.
    """
    n = slip.shape[0]
    lower = np.inf
    count = ZERO
    values = workspace.solution
    product = workspace.product
    for i in range(n):
        balance = sample.excess[i] + stiff[i] - sample.rate[i] * slip[i]
        lower = min(lower, balance / sample.profile[i])
        if multiplier[i] > 0.0:
            workspace.order[count] = i
            values[count] = multiplier[i]
            count += 1
    apply(workspace.stiffness, workspace.order, count, values, workspace.halves, product)
    above = 0.0
    below = 0.0
    excess = 0.0
    for i in range(n):
        above += multiplier[i] * sample.excess[i]
        below += multiplier[i] * sample.profile[i]
        # Round-off may leave A y slightly positive; what this can do to the bound is added to it.
        excess += max(product[i] - sample.rate[i] * multiplier[i], 0.0) * slip[i]
    return max((above + excess) / below - lower, 0.0)

"""The onset as a linear programme, by an active set that grows and dual cuts that lower the load.

At a load the nodes that must slip are added until none is overstressed, the most overstressed
first. If A on the slipping nodes ceases to be positive definite as node j joins, the load is too
high, and y = (-A_SS^-1 A_Sj, 1) says by how much: A y <= 0, so <s, y>/<p, y> is a lower upper
bound (a cut). The same slipping nodes, less the few that do not slip at the lower load, go on from
there. A load that is an upper bound and has an equilibrium is the critical one.
"""

from __future__ import annotations

from stiction._jit import jit
from stiction.equilibrium.cholesky import append, back_substitute, extend_forward, row_start
from stiction.equilibrium.stiffness import apply_stiffness

SOLVED = 0
STALLED = 1

PIVOT = 1e-13
"""Share of the diagonal below which a pivot is round-off."""
OVERSTRESS = 1e-12
"""Share of the mean strength below which an overstress is round-off."""
PASSES = 10_000


@jit
def sort_by(keys, order, count):
    """Sort `order[:count]` by rising `keys[:count]`, both in place (Shell's method, Ciura's gaps)."""
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
def slip_at(factor, size, load, forward_profile, forward_excess, right, solution):
    """Slip of the members at a load: A_SS d = load p - s."""
    for t in range(size):
        right[t] = load * forward_profile[t] - forward_excess[t]
    back_substitute(factor, size, right, solution)


@jit
def first_negative(solution, size):
    """Position of the first member that would slip backwards, or `size`."""
    for t in range(size):
        if solution[t] < 0.0:
            return t
    return size


@jit
def overstressed(load, excess, profile, stiff, inside, tolerance, keys, order):
    """Nodes at rest above their strength, most overstressed first; returns how many."""
    count = 0
    for i in range(excess.shape[0]):
        margin = excess[i] - load * profile[i] + stiff[i]
        if margin < -tolerance and not inside[i]:
            keys[count] = margin
            order[count] = i
            count += 1
    sort_by(keys, order, count)
    return count


@jit
def solve_program(
    excess,
    profile,
    diagonal,
    column,
    strip,
    bound,
    cap,
    multiplier,
    slip,
    stiff,
    factor,
    members,
    order,
    inside,
    forward,
    vectors,
    halves,
):
    """Critical load with slip and multiplier, from an upper bound and its multiplier.

    Parameters
    ----------
    excess, profile, diagonal : (n,) arrays
        s = tau_p - tau_i (Pa), load profile p, diagonal of A (Pa/m).
    column, strip : arrays
        Of the stiffness.
    bound : float
        An upper bound of the load that belongs to `multiplier`.
    cap : float
        Do not look above this load: the solution is the least equilibrium at `cap` if there is one.
    multiplier : (n,) array, changed
        y of the lowest upper bound.
    slip, stiff : (n,) arrays, output
        d and K d.
    factor, members, order, inside, forward, vectors, halves : work space
        Shapes row_start(n + 4), (n + 4), (n,), (n,), (2, n + 4), (3, n + 4), (2, n/2).

    Returns
    -------
    load, size, cuts, status : float, int, int, int
    """
    n = excess.shape[0]
    load = min(bound, cap)
    scale = 0.0
    for i in range(n):
        scale += abs(excess[i])
    tolerance = OVERSTRESS * (scale / n + abs(load) * profile.sum() / n)
    forward_profile = forward[0]
    forward_excess = forward[1]
    right = vectors[0]
    solution = vectors[1]
    keys = vectors[2]
    inside[:] = False
    stiff[:] = 0.0
    size = 0
    cuts = 0
    status = STALLED
    for _ in range(PASSES):
        count = overstressed(load, excess, profile, stiff, inside, tolerance, keys, order)
        if count == 0:
            status = SOLVED
            break
        before = size
        size = append(factor, size, members, order, count, column, diagonal, PIVOT)
        extend_forward(factor, before, size, members, profile, forward_profile)
        extend_forward(factor, before, size, members, excess, forward_excess)
        for t in range(before, size):
            inside[members[t]] = True
        failed = size < before + count
        settled = False
        if failed:
            cuts += 1
            node = members[size]
            start = row_start(size)
            for t in range(size):
                right[t] = -factor[start + t]
            back_substitute(factor, size, right, solution)
            above = excess[node]
            below = profile[node]
            for t in range(size):
                above += solution[t] * excess[members[t]]
                below += solution[t] * profile[members[t]]
            if above / below < bound:
                bound = above / below
                multiplier[:] = 0.0
                multiplier[node] = 1.0 / below
                for t in range(size):
                    multiplier[members[t]] = max(solution[t], 0.0) / below
            settled = bound >= load - tolerance
            load = min(load, bound)
        slip_at(factor, size, load, forward_profile, forward_excess, right, solution)
        if failed:
            kept = first_negative(solution, size)
            while kept < size:
                for t in range(kept, size):
                    inside[members[t]] = False
                size = kept
                slip_at(factor, size, load, forward_profile, forward_excess, right, solution)
                kept = first_negative(solution, size)
        apply_stiffness(strip, column[0], members, size, solution, halves, stiff)
        if settled:  # a cut that lowers the load by round-off only: this is the optimum
            status = SOLVED
            break
    slip[:] = 0.0
    for t in range(size):
        slip[members[t]] = max(solution[t], 0.0)
    return load, size, cuts, status

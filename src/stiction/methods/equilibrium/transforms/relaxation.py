"""Equilibria of a plane at a fixed load, if nodes pass corners of their friction law.

Problem
-------
K is the stiffness (Pa/m), d >= 0 is the slip (m), and p is the load
profile. On its present piece, the strength at node i, minus its initial
stress, is q_i - W_i d_i. A node is overloaded if load p - K d exceeds
its strength. An equilibrium at a load (Pa) satisfies

    load p - K d <= q - W d,  with '=' where d > 0.                  (1)

For given pieces this problem is linear, and `held_equilibrium` solves
it by conjugate gradients with A = K - diag(W). If A is not positive
definite, conjugate gradients find a direction with negative curvature.
The pieces depend on the slip. Two questions are answered:

(a) Does a stable path lead from an
equilibrium at a lower load to an equilibrium
    at this load (`stable_equilibrium`)?
(b) At which least equilibrium, not below a given slip, does an overdamped
    interface come to rest, or does it slide (`least_equilibrium`)?
    `dense.jump` answers this for lines.

Algorithm for (a): Newton's method
----------------------------------
1. Solve (1) for the pieces at the present slip. Repeat with the pieces
   at the solution until they do not change. Until then, solve only to a
   rough residual.
2. On the nodes that slip at the end, look for negative curvature of K
   minus the steepest weakening of each node on the way. If there is no
   negative curvature, A is positive definite in every state on the way.
   Therefore the path is stable, and there is no other equilibrium.

Algorithm for (b): our own, steps that do not pass the least equilibrium
------------------------------------------------------------------------
1. If the load exceeds the mean strength, the interface slides, because
   the mean of K d is zero.
2. Step with bounds (`_bound`). Let nodes weaken at only a fraction of
   their present rate, and no further than to their next corner. This
   strength is not below the true strength at any node. Therefore the
   solution of (1) with this strength lies below the least equilibrium.
   The fraction is 1 - `omitted`. The larger it is, the longer is the step.
3. If the fraction is 1 and all nodes are on the assumed pieces, the
   solution is the least equilibrium, and the interface is arrested.
4. If the step has a solution, slip moves to it. If hardly any node
   moves, the next step has the fraction 1, because only this fraction
   can end at the equilibrium.
5. If a step has negative curvature with the fraction 1, or if the slip is
   at an instability, move with the true pieces to the first corner
   (`_step_to_corner`). Otherwise omit twice as much of the weakening. A
   step that omits all of it has a solution unless the interface slides.

On a plane, K has small positive off-diagonal entries. Without such
entries the bounds in (b) would be strict.
"""

from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.operator import (
    EXHAUSTED,
    MAX_ITERATIONS,
    NEGATIVE_CURVATURE,
    SOLVED,
    Operator,
    inner,
    lowest_eigenvector,
    product,
    residual_of,
    solve_inside,
)
from stiction.methods.equilibrium.state import Outcome
from stiction.methods.equilibrium.strength import (
    Present,
    StaticSample,
    all_breakable_slip,
    present_pieces,
    residual_nodes,
    step_to_corner,
)
from stiction.methods.equilibrium.transforms.held_equilibrium import equilibrate

# Half or twice any of these changes a result by less than the gap, and
# the time by hardly more than a tenth (planes of 64 and 96 squared,
# with and without arrests).
MAX_REVISIONS = 100
"""Most revisions of the pieces in Newton's method, which usually ends
by itself."""
MAX_JUMP_STEPS = 2000
"""Most steps of a jump, which may creep along in ever smaller steps."""
PIECES_RESIDUAL = 0.03
"""Factor by which a residual is reduced before the pieces are revised."""
CURVATURE_RESIDUAL = 0.1
"""Factor by which a residual is reduced in the search for negative
curvature."""
DIRECTION_RTOL = 1e-5
"""Fraction of the largest entry below which an entry of an unstable
direction is round-off."""
DRAG = 1e-3
"""Stiffness that is added in place of the omitted weakening, relative
to the largest W. Without it a step of a plane that slides as a whole
would have no solution."""
BOUND_RESIDUAL = 0.05
"""Largest residual stress of a step, as a fraction of the weakening
omitted in the step before."""
MIN_OMITTED = 0.02
"""Fraction of the weakening that is omitted first."""
CREEP = 0.02
"""Growth in a step, as a fraction of d_c, up to which slip hardly moves."""


def residual_tolerance(sample: StaticSample, load: float, accuracy: float) -> float:
    """Return the largest residual stress, Pa, for an accuracy relative to the strength or load.

    Strength above the load, such as the strength of barriers, does not
    count.

    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> excess, profile = np.array([2.0, np.inf, 8.0]), np.array([1.0, 1.0, 2.0])
    >>> sample = make_sample(excess, np.zeros(3), profile, np.ones(3), LINEAR)
    >>> residual_tolerance(sample, -3.0, 0.5)
    4.25
    """
    can_break = np.isfinite(sample.excess)
    applied = abs(load) * sample.profile[can_break]
    mean = np.minimum(np.abs(sample.excess[can_break]), applied).mean() + applied.mean()
    return accuracy * float(mean)


def solve_pieces(
    operator: Operator, drive: Array, weakening_rate: Array, guess: Array, tolerance: float
) -> tuple[int, Array]:
    """Solve (1) for given pieces, with drive = load p - q.

    Return the status and the slip.

    Eight nodes have K d = 8 d - D, with the sum D of d. Node 0 has 4 d_0 - D =
    3 Pa and node 1 has 6 d_1 - D = 1 Pa, so (1 - 1/4 - 1/6) D = 3/4 + 1/6 m:

    >>> from stiction.elasticity.operator import make_operator
    >>> operator, W = make_operator(np.array([0.0, 8, 8, 8, 8]), 0.0, (8,)), np.full(8, 2.0)
    >>> W[0], drive = 4.0, np.array([3.0, 1, -3, -9, -9, -9, -9, -9])
    >>> status, slip = solve_pieces(operator, drive, W, np.zeros(8), 1e-9)
    >>> status == SOLVED
    True
    >>> slip[:3].round(6).tolist()
    [1.142857, 0.428571, 0.0]
    """
    # Nodes that the load alone would overload begin inside; the others
    # join if they must.
    slip = guess.copy()
    inside = (guess > 0.0) | (drive > 0.0)
    operator = operator._replace(weakening_rate=weakening_rate)
    return equilibrate(operator, drive, inside, slip, tolerance), slip


def _is_definite(operator: Operator, W: Array, growth: Array, slip: Array) -> bool:
    """(a) 2: return whether K - diag(W) on the nodes that slip shows no negative curvature.

    The search begins with the growth of slip, which is close to the
    direction in which stability is lost. It continues in the directions
    of conjugate gradients.

    With W = 5.5 Pa/m, the stiffness of m equal nodes is 8 - m - 5.5 Pa/m: two
    are stable, and three are not, even if slip grows at a single node:

    >>> from stiction.elasticity.operator import make_operator
    >>> operator, W = make_operator(np.array([0.0, 8, 8, 8, 8]), 0.0, (8,)), np.full(8, 5.5)
    >>> node, two, three = (1.0 * (np.arange(8) < m) for m in (1, 2, 3))
    >>> pairs = (two, two), (three, three), (node, three), (node, two)
    >>> [_is_definite(operator, W, growth, slip) for growth, slip in pairs]
    [True, False, False, True]
    """
    operator, inside = operator._replace(weakening_rate=W), slip > 0.0
    solution, image = np.zeros_like(slip), np.empty_like(slip)
    product(operator, growth, image)
    curvature = inner(growth, image)
    if not curvature > 0.0:
        return False
    # From nearly any right side, conjugate gradients
    # meet a negative curvature. With the growth as
    # the soft mode, they take few iterations.
    operator, residual = operator._replace(soft_mode=growth / np.sqrt(curvature)), 1.0 * inside
    status, _ = solve_inside(operator, inside, solution, residual, CURVATURE_RESIDUAL)
    return status == SOLVED


def stable_equilibrium(
    operator: Operator,
    sample: StaticSample,
    load: float,
    slip: Array,
    accuracy: float,
    guess: Array,
) -> Array | None:
    """Return the slip at a load if a stable path certainly leads there, and otherwise `None`.

    The path begins at an equilibrium with less slip at a lower load.
    The guess is a slip at the end of the path. The accuracy is the
    largest residual stress as a fraction of the mean strength or load.

    Eight nodes have K d = 8 d - D, with the sum D of d, and W = 2 Pa/m. At 2
    Pa, 6 d_0 - D = 1 Pa and 6 d_1 - D = 0 Pa. If node 0 has a constant
    strength of 0.8 Pa beyond 0.1 m, 8 d_0 - D = 1.2 Pa:

    >>> from stiction.elasticity.operator import make_operator
    >>> from stiction.methods.equilibrium.strength import LINEAR, Pieces, make_sample
    >>> operator = make_operator(np.array([0.0, 8, 8, 8, 8]), 0.0, (8,))
    >>> excess, residual = np.array([[1.0, 2, 3, 9, 9, 9, 9, 9], [0.8] + [-9.0] * 7])
    >>> def slip_at(load, residual, W, excess=excess, pieces=LINEAR):
    ...     sample, start = make_sample(excess, residual, np.ones(8), W, pieces), np.zeros(8)
    ...     end = stable_equilibrium(operator, sample, load, start, 1e-9, start)
    ...     return None if end is None else end[:3].round(5).tolist()
    >>> W = np.full(8, 2.0)
    >>> slip_at(2.0, residual - 9.0, W)
    [0.20833, 0.04167, 0.0]
    >>> slip_at(2.0, residual, W)
    [0.17647, 0.03529, 0.0]

    With W = 5.5 Pa/m, the path turns at 1.8 Pa (`fold.follow_to_turn`):

    >>> slip_at(1.7, residual - 9.0, W + 3.5)
    [0.6, 0.2, 0.0]
    >>> slip_at(2.0, residual - 9.0, W + 3.5)

    On a steep second piece, node 0 has the stiffness 7 - 9 Pa/m and jumps,
    although it is stable before and after. On a flat one, 7 d = 3 - 0.6 + d:

    >>> ends, starts = np.array([0.5, 1.0]), np.array([1.0, 1.5, 0.0])
    >>> steep = Pieces(ends, starts, np.array([1.0, 3.0, 0.0]), 0.5, 0.6)
    >>> flat = Pieces(ends, np.array([1.0, 0.5, 0.0]), np.array([1.0, 1 / 3, 0.0]), 1.5, 0.4)
    >>> strong, none = np.where(excess > 1.0, 9.0, 1.2), np.zeros(8)
    >>> [slip_at(3.0, none, W + 1.0, strong, pieces) for pieces in (steep, flat)]
    [None, [0.4, 0.0, 0.0]]
    """
    tolerance = residual_tolerance(sample, load, accuracy)
    pieces, start = sample.pieces, present_pieces(sample, slip)
    assumed, residual = start.piece, np.empty_like(slip)
    end, allowed = np.maximum(guess, slip), np.inf
    # 1.
    for _ in range(MAX_REVISIONS):
        present = present_pieces(sample, end)
        # The pieces must belong to a slip that was solved to the tolerance.
        if allowed <= tolerance and np.array_equal(assumed, present.piece):
            break
        drive, assumed = load * sample.profile - present.strength, present.piece
        if allowed > tolerance:
            operator = operator._replace(weakening_rate=present.weakening_rate)
            residual_of(operator, drive, end, residual)
            largest = np.where(end > 0.0, np.abs(residual), residual).max()
            allowed = max(tolerance, PIECES_RESIDUAL * float(largest))
        status, solution = solve_pieces(operator, drive, present.weakening_rate, end, allowed)
        if status != SOLVED:
            return None
        end = np.maximum(solution, slip)
    else:
        return None
    # 2.
    # The weakening of a law that flattens is steepest at the start.
    steepest = start.weakening_rate
    if pieces.steepens:
        piece = np.arange(pieces.slopes.size)[:, None]
        passed = (start.piece <= piece) & (piece <= present.piece)
        slopes = np.where(passed, pieces.slopes[:, None], 0.0)
        steepest = slopes.max(axis=0) * sample.weakening_rate
    return end if _is_definite(operator, steepest, end - slip, end) else None


def _bound(
    operator: Operator,
    sample: StaticSample,
    load: float,
    slip: Array,
    present: Present,
    omitted: float,
    tolerance: float,
) -> tuple[int, Array, bool]:
    """(b) 2: return the slip if nodes omit a fraction of their weakening and stop at their corner.

    Return the status, the slip, and whether it is an equilibrium: the
    assumed strengths are then the true ones.

    The assumed strength is the larger of two straight
    lines, and Newton's method finds which line applies
    at each node. The drive is reduced by the allowed
    residual, so that a rough slip is also a bound.

    Node 0 has 7 d = 2 - 1 + W d, with W = 4 Pa/m until its strength is 0.4 Pa at 0.15 m:

    >>> from stiction.elasticity.operator import make_operator
    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> operator = make_operator(np.array([0.0, 8, 8, 8, 8]), 0.0, (8,))
    >>> excess, residual = np.array([[1.0] + [9.0] * 7, [0.4] + [0.0] * 7])
    >>> sample = make_sample(excess, residual, np.ones(8), np.full(8, 4.0), LINEAR)
    >>> def bound(load, omitted, slip=0.0):
    ...     slip = slip * np.eye(8)[0]
    ...     present = present_pieces(sample, slip)
    ...     status, end, rests = _bound(operator, sample, load, slip, present, omitted, 1e-9)
    ...     return status, round(float(end[0]), 6), rests
    >>> bound(1.3, 0.0), bound(2.0, 0.0)  # 0.3/3 m on the slope, 1.6/7 m beyond
    ((0, 0.1, True), (0, 0.228571, True))

    If three quarters are omitted, W is 1 Pa/m less 0.75 times the drag of 0.004 Pa/m:

    >>> _, slip, rests = bound(1.3, 0.75)
    >>> slip == round(0.3 / (7 - 1 + 0.003), 6), rests
    (True, False)
    >>> _, slip, _ = bound(1.3, 0.75, 0.06)  # the strength is 0.76 Pa at 0.06 m
    >>> slip == round((1.3 - 0.76 - 0.997 * 0.06) / 6.003, 6)
    True
    """
    drag = DRAG * float(sample.weakening_rate.max())
    W = (1.0 - omitted) * present.weakening_rate - omitted * drag
    start = present.strength - (present.weakening_rate - W) * slip
    corner = np.append(sample.pieces.ends, 1e300)[present.piece] * sample.critical
    # `level` is the strength at the next corner. Nodes without a corner have no level.
    falls = (present.weakening_rate > 0.0) & np.isfinite(corner)
    level = np.full(slip.size, -np.inf)
    level[falls] = present.strength[falls] - present.weakening_rate[falls] * corner[falls]
    is_level = np.zeros(slip.size, dtype=np.bool_)
    end, lowered = slip, tolerance if omitted > 0.0 else 0.0
    for _ in range(MAX_REVISIONS):
        strength, slope = np.where(is_level, level, start), np.where(is_level, 0.0, W)
        drive = load * sample.profile - strength - lowered
        status, end = solve_pieces(operator, drive, slope, end, tolerance)
        if status != SOLVED:
            return status, slip, False
        is_beyond = start - W * end < level
        if np.array_equal(is_beyond, is_level):
            passed = present_pieces(sample, end).piece > present.piece
            # Beyond its last corner the true
            # strength of a node is level, too.
            falls_on = passed & (present.piece < sample.pieces.ends.size - 1)
            is_equilibrium = omitted == 0.0 and not falls_on.any()
            return SOLVED, np.maximum(end, slip), is_equilibrium
        is_level = is_beyond
    return EXHAUSTED, slip, False


def _step_to_corner(
    operator: Operator, sample: StaticSample, load: float, slip: Array, tolerance: float
) -> Array:
    """(b) 5: move slip with the true pieces until the first node reaches a corner.

    Only the nodes that slip or are overloaded move: towards their
    equilibrium or, without an equilibrium, along y >= 0 with A y =
    lambda y, lambda < 0. In both cases every moving node remains
    overloaded or balanced, so that the next equilibrium is not passed.

    Node 0 with W = 9 Pa/m is unstable and goes to its corner at 0.1 m. With W
    = 4 Pa/m it goes to its equilibrium at 0.3/3 m, or to its corner at 0.225 m:

    >>> from stiction.elasticity.operator import make_operator
    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> operator = make_operator(np.array([0.0, 8, 8, 8, 8]), 0.0, (8,))
    >>> excess, residual = np.array([[1.0] + [9.0] * 7, [0.1] + [0.0] * 7])
    >>> for W, load in (9.0, 1.0), (9.0, 1.3), (4.0, 1.3), (4.0, 3.0):
    ...     sample = make_sample(excess, residual, np.ones(8), np.full(8, W), LINEAR)
    ...     slip = _step_to_corner(operator, sample, load, 0.01 * np.eye(8)[0], 1e-9)
    ...     print(slip[:2].round(6).tolist())
    [0.1, 0.0]
    [0.1, 0.0]
    [0.1, 0.0]
    [0.225, 0.0]
    """
    present = present_pieces(sample, slip)
    operator = operator._replace(weakening_rate=present.weakening_rate)
    drive = load * sample.profile - present.strength
    overload, end = np.empty_like(slip), slip.copy()
    residual_of(operator, drive, slip, overload)
    inside = (slip > 0.0) | (overload > 0.0)
    status, _ = solve_inside(operator, inside, end, overload, tolerance)
    direction = np.where(inside, np.maximum(end - slip, 0.0), 0.0)
    longest = 1.0
    if status == NEGATIVE_CURVATURE:
        direction = np.abs(operator.direction)
        largest_W = float(sample.weakening_rate.max())
        lowest_eigenvector(operator, inside, direction, 1e-6 * largest_W, MAX_ITERATIONS)
        direction = np.where(direction > DIRECTION_RTOL * direction.max(), direction, 0.0)
        # Strength falls by more than stress along it, until a node
        # reaches a corner.
        longest = np.inf
    moved = slip.copy()
    step_to_corner(sample, moved, direction, longest)
    return moved


class Relaxed(NamedTuple):
    """Outcome for the interface at a load, and its slip."""

    status: Outcome
    slip: Array


def least_equilibrium(
    operator: Operator,
    sample: StaticSample,
    load: float,
    slip: Array,
    accuracy: float = 1e-7,
    is_unstable: bool = False,
    to_rest: bool = True,
) -> Relaxed:
    """Return the least equilibrium at a load that is not below a given slip (see (b)).

    The given slip is zero, or belongs to an equilibrium at a lower
    load, or lies beyond this equilibrium along an unstable direction,
    or (`is_unstable`) belongs to an instability. The accuracy is the
    largest residual stress as a fraction of the mean strength or load. If
    an interface ends, it slides when all nodes that can break slip,
    unless it is followed `to_rest`.

    Node 0 loses its strength of 1 Pa and comes to rest with 7 d = 1.5 - 0.1. If node 1 bears
    only 1.6 Pa, less than 1.5 Pa and d, it jumps as well, to 6 d = 1.4 at both nodes:

    >>> from stiction.elasticity.operator import make_operator
    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> operator = make_operator(np.array([0.0, 8, 8, 8, 8]), 0.0, (8,))
    >>> def end(load, second, slip=0.0, third=9.0, **options):
    ...     excess = np.array([1.0, second, third, 9, 9, 9, 9, 9])
    ...     residual = np.where(excess < 2.0, 0.1, 0.0)
    ...     sample = make_sample(excess, residual, np.ones(8), np.full(8, 9.0), LINEAR)
    ...     found = least_equilibrium(operator, sample, load, slip * np.eye(8)[0], **options)
    ...     return found.status.name, found.slip[:3].round(4).tolist()
    >>> end(1.5, 9.0)
    ('ARRESTED', [0.2, 0.0, 0.0])
    >>> end(1.5, 1.6)
    ('ARRESTED', [0.2333, 0.2333, 0.0])
    >>> end(0.99, 9.0, 0.01, is_unstable=True)
    ('ARRESTED', [0.1271, 0.0, 0.0])
    >>> end(9.5, 9.0)[0]
    'SLIDING'

    If the interface ends, it slides when every node that can break slips:

    >>> excess = np.array([1.0, 1.6] + [np.inf] * 6)
    >>> sample = make_sample(excess, np.full(8, 0.1), np.ones(8), np.full(8, 9.0), LINEAR)
    >>> for to_rest in (True, False):
    ...     found = least_equilibrium(operator, sample, 1.5, np.zeros(8), to_rest=to_rest)
    ...     print(found.status.name)
    ARRESTED
    SLIDING
    """
    tolerance = residual_tolerance(sample, load, accuracy)
    slip, weakens = np.maximum(slip, 0.0), sample.critical > 0.0
    omitted = 0.0  # fraction of the weakening that is omitted
    omitted_before = 0.0  # the same, before a step with the fraction 1 was tried
    fall = 0.0  # largest strength drop in the step before, Pa
    for _ in range(MAX_JUMP_STEPS):
        # 1. The load less the present strength, summed over the nodes.
        # The sum of K d is zero.
        present = present_pieces(sample, slip)
        drive = load * sample.profile - present.strength
        if float((drive + present.weakening_rate * slip).sum()) > tolerance * slip.size:
            return Relaxed(Outcome.SLIDING, slip)
        if not to_rest and all_breakable_slip(sample, slip):
            return Relaxed(Outcome.SLIDING, slip)
        # 2.
        if is_unstable:  # as if step 2 had met the unstable direction
            status, bound, is_equilibrium = NEGATIVE_CURVATURE, slip, False
            is_unstable = False
        else:
            allowed = max(tolerance, BOUND_RESIDUAL * omitted * fall)
            step = _bound(operator, sample, load, slip, present, omitted, allowed)
            status, bound, is_equilibrium = step
        if is_equilibrium:  # 3.
            return Relaxed(Outcome.ARRESTED, bound)
        if status == SOLVED:  # 4.
            still_weakens = ~residual_nodes(sample, bound) & weakens
            growth = np.where(still_weakens, bound - slip, 0.0)
            fall, slip = float((present.weakening_rate * growth).max()), bound
            if not (growth > CREEP * sample.critical).any():
                omitted, omitted_before = 0.0, omitted
        elif status == NEGATIVE_CURVATURE and omitted < 1.0:  # 5.
            if omitted == 0.0:
                slip = _step_to_corner(operator, sample, load, slip, tolerance)
            omitted = min(max(2.0 * omitted, omitted_before, MIN_OMITTED), 1.0)
            omitted_before = 0.0
        else:
            break
    return Relaxed(Outcome.UNDECIDED, slip)

"""Find the turn of a stable path on a plane by following the path from event to event.

Problem
-------
K is the stiffness (Pa/m), W are the present weakening rates (Pa/m), A =
K - diag(W), S are the slipping nodes, and p is the load profile.
Between events, slip d grows with the load at the rate v, with A_SS v =
p_S, and A_SS is positive definite. At an event, a node begins to slip
or reaches a corner in its law. The path turns at the first event after
which A_SS is no longer positive definite. Find its load, and the
direction y in which slip jumps.

Algorithm
---------
The algorithm is the same as in `dense.stable_path`, but conjugate
gradients (`solve_inside`) replace the factor.

1. Solve for the slip at the first load, revising the pieces of the
   nodes, and for the rates v.
2. Find the smallest load rise to an event, and raise the load.
   If the target comes first, end.
3. At a corner of node j, solve A_SS y = e_j, the unit vector
   of j. On its next piece, W_j falls by c (W before minus W
   after), which adds c to one diagonal entry. A_SS remains
   positive definite if 1 + c y_j > 0. Then v becomes v - c
   v_j/(1 + c y_j) y (the formula of Sherman and Morrison).
4. If node j starts, solve for y with y_j = 1 and (A y)_S = 0 on the
   other slipping nodes. A remains positive definite if
   y'Ay = (A y)_j > 0. With c_j = p_j - (K v)_j, v becomes
   v + c_j/(y'Ay) y.
5. If A does not remain positive definite, the path turns in the
   direction y. Otherwise go to step 2.
"""

from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.operator import SOLVED, Mask, Operator, inner, product, solve_inside
from stiction.methods.equilibrium.strength import StaticSample, present_pieces
from stiction.methods.equilibrium.transforms.relaxation import residual_tolerance, solve_pieces

MAX_EVENTS = 300
"""Most events up to the turn, in a path that begins a step of the load
before it."""
TURN_SLIP_RTOL = 1e-11
"""Residual stress of the slip, as a fraction of the mean strength or
load."""
SOLUTION_RTOL = 1e-9
"""Residual of other solutions, as a fraction of their largest right
side."""
MAX_PIECE_REVISIONS = 20
"""Revisions of the pieces of a rough slip."""


class Turn(NamedTuple):
    """Turn of a path, or its state at the target if the path goes on."""

    load: float  # Pa
    slip: Array  # m
    direction: Array | None  # y, in which slip jumps, with <p, y> = 1; None if the path goes on


def _solution(operator: Operator, inside: Mask, right: Array) -> Array | None:
    """Solve A x = right on the nodes inside.

    Return `None` if A is not positive definite there.

    Eight nodes have K d = 8 d - D, with the sum D of d, and W = 5.5 Pa/m. On
    two nodes, 2.5 d - D = (1, 2) Pa and D = 3/(2.5 - 2) m. Three nodes are
    unstable:

    >>> from stiction.elasticity.operator import make_operator
    >>> operator = make_operator(np.array([0.0, 8, 8, 8, 8]), 5.5, (8,))
    >>> right, inside = np.arange(1.0, 9.0), np.arange(8) < 2
    >>> _solution(operator, inside, right).round(6).tolist()
    [2.8, 3.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    >>> _solution(operator, np.arange(8) < 3, right) is None
    True
    """
    x, residual = np.zeros(right.size), np.where(inside, right, 0.0)
    tolerance = SOLUTION_RTOL * float(np.abs(residual).max())
    status, _ = solve_inside(operator, inside, x, residual, tolerance)
    return x if status == SOLVED else None


def _equilibrium_near(
    operator: Operator, sample: StaticSample, load: float, slip: Array
) -> Array | None:
    """Step 1: improve a rough slip at a load.

    Return `None` without an equilibrium nearby.

    Node 0 has a constant strength of 0.8 Pa beyond 0.1 m, so 8 d_0 - D = 2 -
    0.8, and node 1 has 6 d_1 - D = 2 - 2. Therefore D = 0.15/(1 - 1/8 - 1/6)
    m. Three nodes are unstable:

    >>> from stiction.elasticity.operator import make_operator
    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> operator = make_operator(np.array([0.0, 8, 8, 8, 8]), 2.0, (8,))
    >>> excess, residual = np.array([[1.0, 2, 3, 9, 9, 9, 9, 9], [0.8, 0, 0, 0, 0, 0, 0, 0]])
    >>> sample = make_sample(excess, residual, np.ones(8), np.full(8, 2.0), LINEAR)
    >>> _equilibrium_near(operator, sample, 2.0, 0.05 * np.eye(8)[0])[:3].round(6).tolist()
    [0.176471, 0.035294, 0.0]
    >>> _equilibrium_near(operator, sample, 20.0, np.zeros(8)) is None
    True
    """
    tolerance = residual_tolerance(sample, load, TURN_SLIP_RTOL)
    for _ in range(MAX_PIECE_REVISIONS):
        present = present_pieces(sample, slip)
        drive = load * sample.profile - present.strength
        status, slip = solve_pieces(operator, drive, present.weakening_rate, slip, tolerance)
        if status != SOLVED:
            break
        if np.array_equal(present.piece, present_pieces(sample, slip).piece):
            return slip
    return None


def follow_to_turn(
    operator: Operator, sample: StaticSample, load: float, target: float, slip: Array
) -> Turn | None:
    """Follow a stable path, from a rough slip at a load, to its turn or to the target load.

    Returns `None` if the path is not stable at the first load, or after
    too many events.

    Eight nodes have K d = 8 d - D, with the sum D of d, and W = 5.5 Pa/m. Node
    0 starts at 1 Pa, and node 1 at 1.6 Pa, where d_0 = 0.6/1.5 m. From then
    on, D = 4 load - 6, and the path turns when node 2 starts, at 1.8 Pa:

    >>> from stiction.elasticity.operator import make_operator
    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> operator = make_operator(np.array([0.0, 8, 8, 8, 8]), 5.5, (8,))
    >>> excess, W = np.array([1.0, 2, 3, 9, 9, 9, 9, 9]), np.full(8, 5.5)
    >>> sample = make_sample(excess, np.full(8, -9.0), np.ones(8), W, LINEAR)
    >>> turn = follow_to_turn(operator, sample, 1.2, 3.0, np.zeros(8))
    >>> round(turn.load, 6)
    1.8
    >>> turn.slip[:3].round(6).tolist()
    [0.8, 0.4, 0.0]
    >>> turn.direction[:4].round(6).tolist()
    [0.4, 0.4, 0.2, 0.0]

    Node 0 may reach its residual strength of -1.75 Pa, after 0.5 m at 1.65 Pa.
    At 1.7 Pa, 8 d_0 - D = 3.45 Pa and 2.5 d_1 - D = -0.3 Pa:

    >>> residual = np.where(excess > 1.0, -9.0, -1.75)
    >>> sample = make_sample(excess, residual, np.ones(8), W, LINEAR)
    >>> turn = follow_to_turn(operator, sample, 1.2, 1.7, np.zeros(8))
    >>> turn.load
    1.7
    >>> turn.slip[:3].round(6).tolist()
    [0.513158, 0.142105, 0.0]
    >>> turn.direction

    Three nodes that slip at the first load are not stable:

    >>> sample = make_sample(np.ones(8), np.full(8, -9.0), np.ones(8), W, LINEAR)
    >>> follow_to_turn(operator, sample, 1.2, 3.0, np.zeros(8)) is None
    True
    """
    # 1.
    start = _equilibrium_near(operator, sample, load, slip)
    if start is None:
        return None
    slip, inside, pieces = start, start > 0.0, sample.pieces
    piece, strength, weakening_rate = present_pieces(sample, slip)
    operator = operator._replace(weakening_rate=weakening_rate)  # changed in place below
    v, image = _solution(operator, inside, sample.profile), np.empty_like(slip)
    for _ in range(MAX_EVENTS):
        if v is None:
            break
        # 2. At nodes at rest d = v = 0, so products with A replace
        # products with K.
        product(operator, slip, image)
        margin = np.maximum(strength + image - load * sample.profile, 0.0)
        product(operator, v, image)
        closing = sample.profile - image
        corner = np.append(pieces.ends, 1e300)[piece] * sample.critical
        rise = np.full(slip.size, np.inf)  # of the load until the event of each node
        # A node at rest starts when its margin has closed.
        starts = ~inside & (closing > 0.0)
        rise[starts] = margin[starts] / closing[starts]
        # A slipping node passes the corner at the end of its piece.
        weakens = inside & (v > 0.0) & (piece < pieces.ends.size)
        rise[weakens] = np.maximum(corner[weakens] - slip[weakens], 0.0) / v[weakens]
        node = int(np.argmin(rise))
        step = min(float(rise[node]), target - load)
        load, slip = load + step, slip + step * v
        if load >= target:
            return Turn(load, slip, None)
        unit = np.zeros_like(slip)
        unit[node] = 1.0
        if inside[node]:  # 3.
            y = _solution(operator, inside, unit)
            if y is None:
                break
            piece[node] += 1
            W_before, slip[node] = weakening_rate[node], corner[node]
            weakening_rate[node] = pieces.slopes[piece[node]] * sample.weakening_rate[node]
            change = W_before - weakening_rate[node]
            pivot, push = 1.0 + change * y[node], -change * v[node]
        else:  # 4.
            product(operator, unit, image)
            y = _solution(operator, inside, -image)
            if y is None:
                break
            y[node], inside[node] = 1.0, True
            pivot, push = inner(image, y), closing[node]
        # 5.
        if pivot <= 0.0:
            return Turn(load, slip, y / inner(sample.profile, y))
        v += push / pivot * y
    return None

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

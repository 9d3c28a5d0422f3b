"""The end of a stable path on a plane, followed from event to event: where it turns, and how.

Between events, a node that begins to slip or reaches a corner of its law, slip is linear in the
load, and A = K - W is positive definite on the slipping nodes. An event adds one node to A or
changes one W, so one solve shows whether A stays definite: it does if y^T A y > 0 for y that is 1
at the new node and balanced on the others, or if 1 + (W before - W after) y > 0 at the corner,
for A y = 1 there and 0 elsewhere. If not, the path turns, in the direction y.
"""

from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.operator import SOLVED, Mask, Operator, inner, product, solve_inside
from stiction.methods.equilibrium.sample import StaticSample, present_pieces
from stiction.methods.equilibrium.transforms.relaxation import residual_tolerance, solve_pieces

EVENTS = 300
"""Most events of a path to its turn, which is begun a step of the load before."""
PRECISE = 1e-11
"""Residual stress of the slip, as a share of the mean strength or load."""
RESIDUAL = 1e-9
"""Residual of other solutions, as a share of their largest drive."""
ROUNDS = 20
"""Most revisions of the pieces of a rough slip."""


class Turn(NamedTuple):
    """Load (Pa), slip (m), and the direction y in which a path turns there, <p, y> = 1.

    The direction is zero where the path goes on.
    """

    load: float
    slip: Array
    direction: Array


def _solution(operator: Operator, inside: Mask, right: Array) -> Array | None:
    """Solution of A x = right on the nodes inside, None if A is not positive definite there."""
    x, residual = np.zeros(right.size), np.where(inside, right, 0.0)
    tolerance = RESIDUAL * float(np.abs(residual).max())
    status, _ = solve_inside(operator, inside, x, residual, tolerance)
    return x if status == SOLVED else None


def _balanced(
    operator: Operator, sample: StaticSample, load: float, slip: Array
) -> Array | None:
    """Slip at a load from a rough one; None if there is none."""
    tolerance = residual_tolerance(sample, load, PRECISE)
    for _ in range(ROUNDS):
        now = present_pieces(sample, slip)
        drive = load * sample.profile - now.strength
        status, slip = solve_pieces(operator, drive, now.rate, slip, tolerance)
        if status != SOLVED:
            break
        if np.array_equal(now.piece, present_pieces(sample, slip).piece):
            return slip
    return None


def follow_to_turn(
    operator: Operator, sample: StaticSample, load: float, target: float, slip: Array
) -> Turn | None:
    """Follow a stable path, from a slip that is roughly that at a load, up to a higher load.

    It ends at a turn before. None if it is not stable at the first load, or after too many events.
    """
    found = _balanced(operator, sample, load, slip)
    if found is None:
        return None
    slip, inside, pieces = found, found > 0.0, sample.pieces
    piece, strength, rate = present_pieces(sample, slip)
    operator = operator._replace(rate=rate)  # `rate` is changed in place below
    speed, image = _solution(operator, inside, sample.profile), np.empty_like(slip)
    for _ in range(EVENTS):
        if speed is None:
            break
        product(operator, slip, image)
        margin = np.maximum(strength + image - load * sample.profile, 0.0)
        product(operator, speed, image)
        closing = sample.profile - image
        corner = np.append(pieces.ends, 1e300)[piece] * sample.critical
        wait = np.full(slip.size, np.inf)
        starts = ~inside & (closing > 0.0)
        wait[starts] = margin[starts] / closing[starts]
        weakens = inside & (speed > 0.0) & (piece < pieces.ends.size)
        wait[weakens] = np.maximum(corner[weakens] - slip[weakens], 0.0) / speed[weakens]
        node = int(np.argmin(wait))
        step = min(float(wait[node]), target - load)
        load, slip = load + step, slip + step * speed
        if load >= target:
            return Turn(load, slip, np.zeros_like(slip))
        unit = np.zeros_like(slip)
        unit[node] = 1.0
        if inside[node]:
            y = _solution(operator, inside, unit)
            if y is None:
                break
            piece[node] += 1
            share = pieces.starts[piece[node]]
            strength[node] = share * sample.excess[node] + (1.0 - share) * sample.residual[node]
            before, slip[node] = rate[node], corner[node]
            rate[node] = pieces.slopes[piece[node]] * sample.rate[node]
            change = before - rate[node]
            stays, push = 1.0 + change * y[node], -change * speed[node]
        else:
            product(operator, unit, image)
            y = _solution(operator, inside, -image)
            if y is None:
                break
            y[node], inside[node] = 1.0, True
            stays, push = inner(image, y), closing[node]
        if stays <= 0.0:
            return Turn(load, slip, y / inner(sample.profile, y))
        speed += push / stays * y
    return None

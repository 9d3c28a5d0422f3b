"""Relaxation at a fixed load, by transforms: each node stuck or on a piece of its friction law.

From a slip d whose nodes are all driven forward or balanced, an overdamped interface moves to the
least equilibrium that is not below d, or there is none and it slides. Two kinds of step, neither
of which passes that equilibrium (see `jump`, which does the same with dense factors): an elastic
one, with the strength frozen at its present value; and one with the true states of the nodes, up
to where the first node reaches the next corner: if none does, it is the equilibrium.
"""

from typing import NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.linear import (
    EXHAUSTED,
    NEGATIVE,
    SOLVED,
    lowest_eigenvector,
    no_spring,
    residual_of,
    solve_inside,
)
from stiction.elasticity.operator import Operator
from stiction.equilibrium.held_equilibrium import ITERATIONS, equilibrate
from stiction.equilibrium.sample import (
    Sample,
    present_pieces,
    residual_nodes,
    step_to_corner,
)

BALANCED = 0
SLIDING = 1
UNDECIDED = 2

RELEVANT = 1e-5
"""Share of the largest value below which a node is not part of an unstable direction."""
STEPS = 2000
SETTLED = 0.02
"""Growth of slip in one elastic step, as a share of d_c, below which the true states are tried."""
DRAG = 1e-3
"""Stiffness added to elastic steps, as a share of the largest W."""
ROUGH = 2e-3
"""Largest residual stress, as a share of the mean strength, while growth exceeds `SETTLED`."""


def _solve(
    operator: Operator, drive: Array, rate: Array, slip: Array, tolerance: float
) -> tuple[int, Array]:
    """Equilibrium for given strengths at zero slip and rates; status and slip."""
    new = slip.copy()
    inside = (slip > 0.0) | (drive > 0.0)
    status, _ = equilibrate(
        operator._replace(rate=rate), no_spring(slip.size), drive, inside, new,
        np.empty_like(slip), np.empty((3, slip.size)), tolerance,
    )  # fmt: skip
    return status, new


def _weakening_step(
    operator: Operator, sample: Sample, load: float, slip: Array, tolerance: float
) -> Array:
    """Slip moved with the true states until the first node reaches a corner.

    Only the nodes that slip or are overloaded move: towards their equilibrium or, if they
    have none, along y >= 0 with A y = lambda y, lambda < 0. Both keep every node that moves driven
    forward or balanced, so the next equilibrium is not passed.
    """
    now = present_pieces(sample, slip)
    operator = operator._replace(rate=now.rate)
    drive = load * sample.profile - now.strength
    rest, new = np.empty_like(slip), slip.copy()
    workspace = np.empty((3, slip.size))
    free = no_spring(slip.size)
    residual_of(operator, free, drive, slip, rest)
    inside = (slip > 0.0) | (rest > 0.0)
    status, _ = solve_inside(
        operator, free, inside, new, rest, workspace, tolerance, ITERATIONS
    )
    direction = np.where(inside, np.maximum(new - slip, 0.0), 0.0)
    longest = 1.0
    if status == NEGATIVE:
        direction = np.abs(workspace[1])
        largest = float(sample.rate.max())
        lowest_eigenvector(operator, inside, direction, 1e-6 * largest, ITERATIONS)
        direction = np.where(direction > RELEVANT * direction.max(), direction, 0.0)
        longest = np.inf
    moved = slip.copy()
    step_to_corner(sample, moved, direction, longest)
    return moved


class Relaxed(NamedTuple):
    """Status (BALANCED, SLIDING or UNDECIDED) and slip."""

    status: int
    slip: Array


def least_equilibrium(
    operator: Operator,
    sample: Sample,
    load: float,
    slip: Array,
    accuracy: float = 1e-7,
    only_stable: bool = False,
) -> Relaxed:
    """Return the least equilibrium at a load that is not below a given slip.

    The slip is zero, or an equilibrium at a lower load, or beyond it along an unstable direction;
    the accuracy is the largest residual stress as a share of the mean strength. With `only_stable`
    the result is UNDECIDED where the path to the equilibrium looks unstable.

    The interface slides once the load exceeds the average strength that is left: stiffness adds
    nothing to the mean. If K has no positive entry off its diagonal, the result is exact up to
    `accuracy`. On planes K has small positive entries there.
    """
    tolerance = accuracy * float(
        np.abs(sample.excess).mean() + abs(load) * sample.profile.mean()
    )
    # K alone is singular where everything slips; a drag on growth keeps the slip a lower bound.
    drag = DRAG * float(sample.rate.max())
    frozen = np.full_like(sample.rate, -drag)
    slip = np.maximum(slip, 0.0)
    patient = False
    for _ in range(STEPS):
        now = present_pieces(sample, slip)
        drive = load * sample.profile - now.strength
        if float((drive + now.rate * slip).sum()) > tolerance * slip.size:
            return Relaxed(SLIDING, slip)
        if not patient:
            status, new = _solve(operator, drive, now.rate, slip, tolerance)
            if status == EXHAUSTED or (status == NEGATIVE and only_stable):
                return Relaxed(UNDECIDED, slip)
            if status == SOLVED:
                new = np.maximum(new, slip)
                if step_to_corner(sample, slip.copy(), new - slip, 1.0) >= 1.0:
                    return Relaxed(BALANCED, new)
            slip = _weakening_step(operator, sample, load, slip, tolerance)
            now = present_pieces(sample, slip)
        # With the drive lowered by the residual allowed, a rough solution is a lower bound too.
        rough = max(ROUGH / accuracy, 1.0) * tolerance if patient else tolerance
        strength = now.strength - now.rate * slip
        drive = load * sample.profile - (strength + rough - drag * slip)
        status, new = _solve(operator, drive, frozen, slip, rough)
        if status != SOLVED:
            return Relaxed(UNDECIDED, slip)
        new = np.maximum(new, slip)
        weakening = ~residual_nodes(sample, new) & (sample.critical > 0.0)
        patient = bool((new - slip > SETTLED * sample.critical)[weakening].any())
        slip = new
    return Relaxed(UNDECIDED, slip)

"""Equilibria at a fixed load, by transforms: each node stuck or on a piece of its friction law.

From an equilibrium at a lower load either the path to this load is certainly stable
(`stable_equilibrium`), or an overdamped interface moves to the least equilibrium that is not below
it, or slides (`least_equilibrium`, as `jump` with dense factors).
"""

from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.operator import (
    EXHAUSTED,
    ITERATIONS,
    NEGATIVE,
    SOLVED,
    Operator,
    inner,
    lowest_eigenvector,
    product,
    residual_of,
    solve_inside,
)
from stiction.methods.equilibrium.sample import (
    Outcome,
    Present,
    StaticSample,
    present_pieces,
    residual_nodes,
    step_to_corner,
)
from stiction.methods.equilibrium.transforms.growing_patch import ENDS, SMALL, grown
from stiction.methods.equilibrium.transforms.held_equilibrium import equilibrate

# Halved or doubled none of these changes a result by more than the gap, or the time by much more
# than a tenth (planes of 64 and 96 squared, with and without arrests).
NEWTON = 100
"""Bound of a loop that ends by itself, as pieces are revised."""
STEPS = 2000
"""Bound of a jump that creeps along in ever smaller steps."""
LOOSE = 0.03
"""Factor by which a residual is reduced before the pieces of the law are revised."""
CHECKED = 0.1
"""Factor by which a residual is reduced where a matrix is looked through for negative curvature."""
RELEVANT = 1e-5
"""Share of the largest value below which a node of an unstable direction is round-off of it."""
DRAG = 1e-3
"""Stiffness added to steps that leave out all weakening, as a share of the largest W: without, a
plane that slides as a whole has no bound."""
ROUGH = 0.05
"""Largest residual stress of a step, as a share of the weakening left out in the step before."""


def residual_tolerance(sample: StaticSample, load: float, accuracy: float) -> float:
    """Residual stress that is allowed, Pa, from its share of the mean strength or load.

    Strength beyond the load, such as that of barriers, does not count.
    """
    applied = abs(load) * sample.profile
    mean = np.minimum(np.abs(sample.excess), applied).mean() + applied.mean()
    return accuracy * float(mean)


def slip_under(
    operator: Operator, drive: Array, rate: Array, slip: Array, tolerance: float
) -> tuple[int, Array]:
    """Equilibrium for given strengths at zero slip and rates; status and slip."""
    new = slip.copy()
    inside = (slip > 0.0) | (drive > 0.0)
    operator = operator._replace(rate=rate)
    status, _ = equilibrate(operator, drive, inside, new, np.empty_like(slip), tolerance)
    return status, new


def _definite(operator: Operator, rate: Array, growth: Array, slip: Array) -> bool:
    """Whether K - `rate` on the nodes that slip shows no negative curvature.

    It is looked for in the growth, which is close to the direction of a loss of stability,
    and as the matrix is solved with.
    """
    x, image = np.zeros_like(slip), np.empty_like(slip)
    operator, inside = operator._replace(rate=rate), slip > 0.0
    product(operator, growth, image)
    curvature = inner(growth, image)
    if not curvature > 0.0:
        return False
    operator, residual = operator._replace(slow=growth / np.sqrt(curvature)), 1.0 * inside
    status, _ = solve_inside(operator, inside, x, residual, CHECKED)
    return status == SOLVED


def stable_equilibrium(
    operator: Operator,
    sample: StaticSample,
    load: float,
    slip: Array,
    accuracy: float,
    guess: Array,
) -> Array | None:
    """Return the equilibrium at a load to which a stable path leads from one at a lower load.

    The guess is a slip there. None if that is not certain. It is if A is positive definite, on the
    nodes that slip at the end, with the steepest weakening that each passes on the way: then it is
    at each state on the way, and there is no other equilibrium. Newton's method finds the pieces at
    the end; until it knows them its solutions are rough.
    """
    tolerance = residual_tolerance(sample, load, accuracy)
    pieces, first = sample.pieces, present_pieces(sample, slip)
    before, residual = first.piece, np.empty_like(slip)
    new, rough = np.maximum(guess, slip), np.inf
    for _ in range(NEWTON):
        now = present_pieces(sample, new)
        if rough <= tolerance and np.array_equal(before, now.piece):
            break
        drive, before = load * sample.profile - now.strength, now.piece
        if rough > tolerance:
            present = operator._replace(rate=now.rate)
            residual_of(present, drive, new, residual)
            largest = np.where(new > 0.0, np.abs(residual), residual).max()
            rough = max(tolerance, LOOSE * float(largest))
        status, found = slip_under(operator, drive, now.rate, new, rough)
        if status != SOLVED:
            return None
        new = np.maximum(found, slip)
    else:
        return None
    steepest = first.rate
    if pieces.steepens:
        piece = np.arange(pieces.slopes.size)[:, None]
        passed = (first.piece <= piece) & (piece <= now.piece)
        steepest = np.where(passed, pieces.slopes[:, None], 0.0).max(axis=0) * sample.rate
    return new if _definite(operator, steepest, new - slip, new) else None


def _bound(
    operator: Operator,
    sample: StaticSample,
    load: float,
    slip: Array,
    now: Present,
    share: float,
    tolerance: float,
) -> tuple[int, Array, bool]:
    """Equilibrium if nodes weaken by a share of what they do, and no further than to their corner.

    Their strength is nowhere below the true one, so that the slip is a lower bound of the least
    equilibrium: as the drive is lowered by the residual allowed, a rough one too. Newton's method;
    the strength is the larger of two lines. Returns the status, the slip, and whether the
    strengths are the true ones.
    """
    rate = share * now.rate - (1.0 - share) * DRAG * float(sample.rate.max())
    start = now.strength - (now.rate - rate) * slip
    corner = np.append(sample.pieces.ends, 1e300)[now.piece] * sample.critical
    level = np.where(now.rate > 0.0, now.strength - now.rate * corner, -np.inf)
    flat = np.zeros(slip.size, dtype=np.bool_)
    new, spared = slip, tolerance if share < 1.0 else 0.0
    for _ in range(NEWTON):
        strength, slope = np.where(flat, level, start), np.where(flat, 0.0, rate)
        drive = load * sample.profile - strength - spared
        status, new = slip_under(operator, drive, slope, new, tolerance)
        if status != SOLVED:
            return status, slip, False
        beyond = start - rate * new < level
        if np.array_equal(beyond, flat):
            passed = present_pieces(sample, new).piece > now.piece
            onto_other = passed & (now.piece < sample.pieces.ends.size - 1)
            return SOLVED, np.maximum(new, slip), share == 1.0 and not onto_other.any()
        flat = beyond
    return EXHAUSTED, slip, False


def _weakening_step(
    operator: Operator, sample: StaticSample, load: float, slip: Array, tolerance: float
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
    residual_of(operator, drive, slip, rest)
    inside = (slip > 0.0) | (rest > 0.0)
    status, _ = solve_inside(operator, inside, new, rest, tolerance)
    direction = np.where(inside, np.maximum(new - slip, 0.0), 0.0)
    longest = 1.0
    if status == NEGATIVE:
        direction = np.abs(operator.direction)
        largest = float(sample.rate.max())
        lowest_eigenvector(operator, inside, direction, 1e-6 * largest, ITERATIONS)
        direction = np.where(direction > RELEVANT * direction.max(), direction, 0.0)
        longest = np.inf
    moved = slip.copy()
    step_to_corner(sample, moved, direction, longest)
    return moved


class Relaxed(NamedTuple):
    """What becomes of the interface at the load, and its slip."""

    status: Outcome
    slip: Array


def least_equilibrium(
    operator: Operator,
    sample: StaticSample,
    load: float,
    slip: Array,
    accuracy: float = 1e-7,
    unstable: bool = False,
) -> Relaxed:
    """Return the least equilibrium at a load that is not below a given slip.

    The slip is zero, or an equilibrium at a lower load, or beyond it along an unstable direction;
    the accuracy is the largest residual stress as a share of the mean strength or load. Steps with
    a share of the weakening do not pass it, and are the longer the larger the share; with the whole
    of it they end there, or A is not positive definite, and slip moves in the unstable direction:
    at once if the slip is `unstable`, that of an instability.

    The interface slides once the load exceeds the average strength that is left: stiffness adds
    nothing to the mean. If K has no positive entry off its diagonal, the result is exact up to
    `accuracy`. On planes K has small positive entries there.
    """
    tolerance = residual_tolerance(sample, load, accuracy)
    slip, weakens = np.maximum(slip, 0.0), sample.critical > 0.0
    spared = resumed = fall = 0.0  # share of the weakening left out; that after a true step; Pa
    for _ in range(STEPS):
        now = present_pieces(sample, slip)
        drive = load * sample.profile - now.strength
        if float((drive + now.rate * slip).sum()) > tolerance * slip.size:
            return Relaxed(Outcome.SLIDING, slip)
        status = NEGATIVE
        if not unstable:
            allowed = max(tolerance, ROUGH * spared * fall)
            share = 1.0 - spared
            status, new, true = _bound(operator, sample, load, slip, now, share, allowed)
        unstable = False
        if status == SOLVED:
            if true:
                return Relaxed(Outcome.ARRESTED, new)
            growth = np.where(~residual_nodes(sample, new) & weakens, new - slip, 0.0)
            fall, slip = float((now.rate * growth).max()), new
            if not (growth > SMALL * sample.critical).any():  # it creeps along
                spared, resumed = 0.0, spared
        elif status == NEGATIVE and spared < 1.0:
            if spared == 0.0:
                moved = _weakening_step(operator, sample, load, slip, tolerance)
                growth, slip = moved - slip, moved
                largest = float((growth[weakens] / sample.critical[weakens]).max(initial=0.0))
                if largest > ENDS and not sample.pieces.steepens:
                    growth *= min(1.0, SMALL / largest)
                    slip = grown(operator, sample, load, slip, growth, tolerance)
                    continue
            spared, resumed = min(max(2.0 * spared, resumed, SMALL), 1.0), 0.0
        else:
            break
    return Relaxed(Outcome.UNDECIDED, slip)

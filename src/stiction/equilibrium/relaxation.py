"""Equilibria at a fixed load, by transforms: each node stuck or on a piece of its friction law.

From an equilibrium at a lower load either the path to this load is certainly stable
(`stable_equilibrium`), or an overdamped interface moves to the least equilibrium that is not below
it, or slides (`least_equilibrium`, as `jump` with dense factors).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.elasticity.linear import (
    EXHAUSTED,
    NEGATIVE,
    SOLVED,
    Spring,
    inner,
    lowest_eigenvector,
    no_spring,
    residual_of,
    solve_inside,
)
from stiction.elasticity.operator import Operator, filtered
from stiction.equilibrium.held_equilibrium import ITERATIONS, equilibrate
from stiction.equilibrium.sample import (
    Outcome,
    Present,
    Sample,
    piece_at,
    present_pieces,
    residual_nodes,
    start_of,
    step_to_corner,
)
from stiction.jit import jit

NEWTON = 100
STEPS = 2000
RELEVANT = 1e-5
"""Share of the largest value below which a node is not part of an unstable direction."""
SETTLED = 0.02
"""Growth of slip in one step, as a share of d_c, below which the whole weakening is tried."""
LEAST_LEFT = 0.02
"""Least share of the weakening that a step leaves out, if it leaves out any."""
DRAG = 1e-3
"""Stiffness added to steps that leave out all weakening, as a share of the largest W."""
ROUGH = 0.05
"""Largest residual stress of a step, as a share of the weakening left out in the step before."""
FIRST = 0.05
"""Growth of a patch that is tried first, as a share of d_c."""
ENDS = 2e-3
"""Growth in a step, as a share of d_c, below which a patch is not followed any more."""
QUICK = 0.7
"""Growth up to which a step is expected to add more than the one before, as a share of d_c."""
MOST = 0.98
"""Largest share of the weakening in a step of a growing patch."""
SPARED = 0.1
"""Residual stress of such a step, as a share of the weakening left out."""
HELD = 0.9
"""Amplitude at which a spring holds a growing patch, as a share of that expected."""
FREE = 0.3
"""Share of the weakening up to which no spring holds the patch."""
RUNS = -1.0
"""Force of the spring, over that at rest, below which the patch outruns what was expected."""
USED, LONGEST = 0.3, 1.5
"""Share of a step that must be possible, or it has failed, and how much of it is made at most."""
FAILURES = 3
"""Failures in a row after which a growing patch is not followed any more."""


def residual_tolerance(sample: Sample, load: float, accuracy: float) -> float:
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
    status, _ = equilibrate(
        operator._replace(rate=rate), no_spring(slip.size), drive, inside, new,
        np.empty_like(slip), np.empty((3, slip.size)), tolerance,
    )  # fmt: skip
    return status, new


def _definite(operator: Operator, rate: Array, inside: NDArray[np.bool_]) -> bool:
    """Whether K - `rate` on some nodes shows no negative curvature as it is solved with."""
    x, residual = np.zeros(rate.size), np.where(inside, 1.0, 0.0)
    status, _ = solve_inside(
        operator._replace(rate=rate), no_spring(rate.size), inside, x, residual,
        np.empty((3, rate.size)), 1e-4, ITERATIONS,
    )  # fmt: skip
    return status == SOLVED


def stable_equilibrium(
    operator: Operator, sample: Sample, load: float, slip: Array, accuracy: float, guess: Array
) -> Array | None:
    """Return the equilibrium at a load to which a stable path leads from one at a lower load.

    The guess is a slip there. None if that is not certain. It is if A is positive definite, on the
    nodes that slip at the end, with the steepest weakening that each passes on the way: then it is
    at each state on the way, and there is no other equilibrium. Newton's method finds the pieces at
    the end; if no node comes to weaken more steeply, its first matrix is that A, and it comes from
    above.
    """
    tolerance = residual_tolerance(sample, load, accuracy)
    pieces = sample.pieces
    first = now = present_pieces(sample, slip)
    new = guess
    for _ in range(NEWTON):
        drive = load * sample.profile - now.strength
        status, found = slip_under(operator, drive, now.rate, new, tolerance)
        if status != SOLVED:
            return None
        new = np.maximum(found, slip)
        before, now = now, present_pieces(sample, new)
        if np.array_equal(before.piece, now.piece):
            break
    else:
        return None
    if pieces.steepens and not np.array_equal(first.piece, now.piece):
        piece = np.arange(pieces.slopes.size)[:, None]
        passed = (first.piece <= piece) & (piece <= now.piece)
        steepest = np.where(passed, pieces.slopes[:, None], 0.0).max(axis=0) * sample.rate
        if not _definite(operator, steepest, new > 0.0):
            return None
    return new


def _bound(
    operator: Operator,
    sample: Sample,
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


@jit
def longest_step(sample: Sample, rest: Array, slip: Array, move: Array, image: Array) -> float:
    """Return the largest t at which no node that moves to slip + t `move` is held back.

    `rest` is the overload at the slip (Pa), not negative where a node moves, and `image` K times
    the move. Under a law that only flattens the overload is concave in t: it is not negative on the
    way, either.
    """
    pieces = sample.pieces
    longest = np.inf
    for i in range(slip.size):
        if not move[i] > 0.0:
            continue
        here, left = 0.0, rest[i]
        piece = piece_at(pieces, sample.critical[i], slip[i])
        while here < longest:
            corner = np.inf
            if piece < pieces.ends.shape[0]:
                corner = (pieces.ends[piece] * sample.critical[i] - slip[i]) / move[i]
            fall = image[i] - pieces.slopes[piece] * sample.rate[i] * move[i]
            if fall > 0.0 and left < (corner - here) * fall:
                longest = min(longest, here + max(left, 0.0) / fall)
                break
            if corner == np.inf:
                break
            left -= (corner - here) * fall
            here = corner
            piece += 1
    return longest


def _strength(sample: Sample, slip: Array) -> Array:
    """Strength less initial stress after a slip, Pa."""
    now = present_pieces(sample, slip)
    return now.strength - now.rate * slip


@jit
def secants(sample: Sample, slip: Array, move: Array, rate: Array) -> float:
    """`rate` = weakening on the way to slip + `move` (Pa/m); return the largest fall, Pa."""
    pieces = sample.pieces
    largest = 0.0
    for i in range(slip.size):
        piece = piece_at(pieces, sample.critical[i], slip[i])
        rate[i] = pieces.slopes[piece] * sample.rate[i]
        if move[i] > 0.0:
            before = start_of(sample, i, piece) - rate[i] * slip[i]
            there = slip[i] + move[i]
            piece = piece_at(pieces, sample.critical[i], there)
            after = start_of(sample, i, piece) - pieces.slopes[piece] * sample.rate[i] * there
            rate[i] = (before - after) / move[i]
            largest = max(largest, before - after)
    return largest


def _push(
    operator: Operator, sample: Sample, rest: Array, slip: Array, growth: Array, share: float,
    tolerance: float, residual: Array,
) -> tuple[Array, float] | None:  # fmt: skip
    """Slip that a growing patch adds where it is overloaded by `rest`; None if it has no bound.

    Nodes weaken by a share of what they do on the way to the growth expected. A spring holds the
    patch at an amplitude, as K less this weakening may have a direction of negative curvature: its
    force is returned, too, as a share of that at no slip. `residual` is a workspace.
    """
    inside = rest >= 0.0
    move = np.where(inside, growth, 0.0)
    size = np.sqrt(inner(move, move))
    if size == 0.0:
        return None
    rate = np.empty_like(slip)
    fall = secants(sample, slip, move, rate)
    stiffness = float(sample.rate.max()) if share > FREE else 0.0
    spring = Spring(stiffness, move / size)
    spared = max(SPARED * (1.0 - share) * fall, tolerance)
    drive = rest - spared + (HELD * stiffness * size) * spring.shape
    rate *= share
    held = operator._replace(rate=rate)
    residual_of(held, spring, drive, move, residual)
    status, _ = solve_inside(
        held, spring, inside, move, residual, np.empty((3, slip.size)), spared, ITERATIONS
    )
    force = HELD - inner(spring.shape, move) / size
    return (np.maximum(move, 0.0), force) if status == SOLVED else None


def _grown(
    operator: Operator,
    sample: Sample,
    load: float,
    slip: Array,
    growth: Array,
    tolerance: float,
) -> Array:
    """Slip of a patch that grows by itself, from the growth in the step before.

    Each step moves overloaded nodes alone, as far as all of them stay overloaded all the way, by
    concavity (the law only flattens). So the first of them that came to its slip in the next
    equilibrium would not be in balance there: that equilibrium is not passed, however
    rough the step is. The load is lowered by the tolerance, which makes the overload positive.
    """
    weakens = sample.critical > 0.0
    stress, image = np.empty((2, slip.size))
    filtered(operator, operator.symbol, slip, stress)
    share, failures = 1.0 - FIRST, 0
    while failures < FAILURES:
        rest = load * sample.profile - _strength(sample, slip) - tolerance
        if float(rest.sum()) > 0.0:
            break
        rest -= stress
        found = _push(operator, sample, rest, slip, growth, share, tolerance, image)
        if found is None:
            share, failures = 0.7 * share, failures + 1
            continue
        move, force = found
        filtered(operator, operator.symbol, move, image)
        step = min(longest_step(sample, rest, slip, move, image), LONGEST)
        slip = slip + step * move
        stress += step * image
        size = float((move[weakens] / sample.critical[weakens]).max(initial=0.0))
        if share > FREE and force < RUNS:
            growth, share = move / max(size, 1.0), 0.5 * share
            continue
        if step < USED:
            growth, failures = 0.5 * move, failures + 1
            share *= 1.0 if force > 0.0 else 0.7
            continue
        if step * size < ENDS:
            break
        failures = 0
        faster = 0.9 if force > 0.0 else 1.5 if force > -0.05 else 2.0
        faster = min(faster if share > FREE else 1.2, max(QUICK / (step * size), 1.0))
        growth = faster * step * move
        share = min(max(1.0 - 0.7 * step * size, 0.0), MOST)
    return slip


class Relaxed(NamedTuple):
    """What becomes of the interface at the load, and its slip."""

    status: Outcome
    slip: Array


def least_equilibrium(
    operator: Operator,
    sample: Sample,
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
    slip = np.maximum(slip, 0.0)
    weakens = sample.critical > 0.0
    left = kept = dropped = 0.0
    for _ in range(STEPS):
        now = present_pieces(sample, slip)
        drive = load * sample.profile - now.strength
        if float((drive + now.rate * slip).sum()) > tolerance * slip.size:
            return Relaxed(Outcome.SLIDING, slip)
        allowed = max(tolerance, ROUGH * left * dropped)
        status, new, true = NEGATIVE, slip, False
        if not unstable:
            status, new, true = _bound(operator, sample, load, slip, now, 1.0 - left, allowed)
        unstable = False
        if status == NEGATIVE and left < 1.0:
            if left == 0.0:
                before = slip
                slip = _weakening_step(operator, sample, load, slip, tolerance)
                growth = slip - before
                largest = float((growth[weakens] / sample.critical[weakens]).max(initial=0.0))
                if largest > ENDS and not sample.pieces.steepens:
                    growth *= min(1.0, FIRST / largest)
                    slip = _grown(operator, sample, load, slip, growth, tolerance)
                    continue
            left, kept = min(max(2.0 * left, kept, LEAST_LEFT), 1.0), 0.0
            continue
        if status != SOLVED:
            break
        if true:
            return Relaxed(Outcome.ARRESTED, new)
        weakening = ~residual_nodes(sample, new) & weakens
        growth = np.where(weakening, new - slip, 0.0)
        dropped = float((now.rate * growth).max())
        slip = new
        if not (growth > SETTLED * sample.critical).any():
            left, kept = 0.0, left
    return Relaxed(Outcome.UNDECIDED, slip)

"""A patch on a plane that grows by itself, followed by rough steps that pass no equilibrium."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit
from stiction.elasticity.operator import (
    SOLVED,
    Operator,
    filtered,
    inner,
    operator_of,
    residual_of,
    solve_inside,
)
from stiction.methods.equilibrium.patches import span
from stiction.methods.equilibrium.sample import StaticSample, piece_at, present_pieces, start_of

# No result rests on these: whether a step passes an equilibrium is checked. With one halved or
# doubled small planes take up to a quarter longer, of MOST and HELD up to six tenths.
SMALL = 0.02
"""Growth, as a share of d_c, that is tried first, and is none where steps speed up."""
ENDS = 2e-3
"""Growth in a step, as a share of d_c, below which steps that solve for bounds are faster."""
QUICK = 0.7
"""Growth, as a share of d_c, up to which a step adds more than the one before: it speeds up."""
MOST, LESS = 0.99, 0.7
"""Largest share of the weakening in a step, and how much less it is after one that failed."""
SPARED = 0.1
"""Residual stress of a step, as a share of the weakening left out: less would be lost again."""
HELD = 0.9
"""Amplitude at which a spring holds a patch, over that expected: so it pulls, if all is right."""
FREE = 0.3
"""Share of the weakening up to which no spring is needed: K less that is positive definite."""
RUNS, EASY = -1.0, -0.05
"""Force of the spring, over that at rest, below which the patch outruns what was expected, and
below which it may soon."""
SLOWER, FASTER, FASTEST, FREELY = 0.9, 1.5, 2.0, 1.2
"""Growth over that of the step before: where the spring pulls, pushes, pushes hard; without one."""
USED, LONGEST = 0.3, 1.5
"""Share of a step that must be possible, or it has failed, and how much of it is made at most."""
FAILURES = 3
"""Failures in a row, each in a window twice as wide, after which bounds are solved for instead."""
WIDE = 1.5
"""Least size of a window around a patch, over that of the patch: images act as a border does."""
NARROWEST = 16
"""Least nodes of a window along x and y: below, transforms cost no less."""
PART = 0.01
"""Growth from which a node is part of the patch, as a share of the largest."""


@jit
def longest_step(
    sample: StaticSample, rest: Array, slip: Array, move: Array, image: Array
) -> float:
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


@jit
def secants(sample: StaticSample, slip: Array, move: Array, rate: Array) -> float:
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


class Window(NamedTuple):
    """Nodes of a part of the plane, and its operator as if it were a plane of its own."""

    nodes: NDArray[np.int64] | slice
    operator: Operator


def _around(part: NDArray[np.bool_], wide: float) -> tuple[NDArray[np.int64], int]:
    """Places along an axis around those of a patch, and how many times as long the axis is."""
    nodes, ratio = part.size, 1
    start, extent = span(part, 0)
    while nodes % (2 * ratio) == 0 and nodes >= 2 * ratio * max(wide * extent, NARROWEST):
        ratio *= 2
    size = nodes // ratio
    first = start - (size - extent) // 2
    return (first + np.arange(size)) % nodes, ratio


def window_around(operator: Operator, growth: Array, wide: float) -> Window:
    """Return the window around a patch that grows, `wide` times as large, or the plane.

    The wave vectors of a window are those of the plane, but for every second, fourth, ...
    """
    shape, half = operator.transform.shape, operator.transform.half
    part = growth.reshape(shape) > PART * growth.max()
    if not part.any():
        return Window(slice(None), operator)
    (rows, by_x), (columns, by_y) = (_around(part.any(axis=axis), wide) for axis in (1, 0))
    if by_x * by_y == 1:
        return Window(slice(None), operator)
    nodes = (rows[:, None] * shape[1] + columns).reshape(-1)
    symbol, inverse = (
        field.reshape(half)[::by_x, ::by_y].flatten()
        for field in (operator.symbol, operator.inverse)
    )
    shape = rows.size, columns.size
    return Window(nodes, operator_of(shape, symbol, inverse, operator.rate[nodes]))


def _push(
    window: Window, sample: StaticSample, rest: Array, slip: Array, growth: Array, share: float,
    tolerance: float,
) -> tuple[Array, float] | None:  # fmt: skip
    """Slip that a growing patch adds where it is overloaded by `rest`; None if it has no bound.

    Nodes in the window weaken by a share of what they do on the way to the growth expected. A
    spring holds the patch at an amplitude, as K less this weakening may have a direction of
    negative curvature: its force is returned, too, as a share of that at no slip.
    """
    nodes, operator = window
    every, (*fields, pieces) = slip.size, sample
    excess, strength, profile, slope, critical = (field[nodes] for field in fields)
    sample = StaticSample(excess, strength, profile, slope, critical, pieces)
    rest, slip, growth = rest[nodes], slip[nodes], growth[nodes]
    inside, residual = rest >= 0.0, np.empty_like(slip)
    move = np.where(inside, growth, 0.0)
    size = np.sqrt(inner(move, move))
    if size == 0.0:
        return None
    rate = np.empty_like(slip)
    fall = secants(sample, slip, move, rate)
    stiffness = float(sample.rate.max()) if share > FREE else 0.0
    spared = max(SPARED * (1.0 - share) * fall, tolerance)
    held = move / size
    drive = rest - spared + (HELD * stiffness * size) * held
    rate *= share
    operator = operator._replace(rate=rate, spring=stiffness, held=held)
    residual_of(operator, drive, move, residual)
    status, _ = solve_inside(operator, inside, move, residual, spared)
    if status != SOLVED:
        return None
    pushed = np.zeros(every)
    pushed[nodes] = np.maximum(move, 0.0)
    return pushed, HELD - inner(held, move) / size


def grown(
    operator: Operator,
    sample: StaticSample,
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
    So a step may be computed in a window around the patch, as if the plane were no larger; one
    that fails is tried again in a wider window.
    """
    weakens = sample.critical > 0.0
    stress, image = np.empty((2, slip.size))
    filtered(operator, operator.symbol, slip, stress)
    share, failures = 1.0 - SMALL, 0
    while failures < FAILURES:
        _, start, rate = present_pieces(sample, slip)
        rest = load * sample.profile - (start - rate * slip) - tolerance
        if float(rest.sum()) > 0.0:
            break
        rest -= stress
        moving = np.where(rest >= 0.0, growth, 0.0)
        window = window_around(operator, moving, WIDE * 2.0**failures)
        found = _push(window, sample, rest, slip, growth, share, tolerance)
        if found is None:
            share, failures = LESS * share, failures + 1
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
            share *= 1.0 if force > 0.0 else LESS
            continue
        if step * size < ENDS:
            break
        failures = 0
        faster = SLOWER if force > 0.0 else FASTER if force > EASY else FASTEST
        faster = min(faster if share > FREE else FREELY, max(QUICK / (step * size), 1.0))
        growth = faster * step * move
        share = min(max(1.0 - LESS * step * size, 0.0), MOST)
    return slip

"""The programme of planes, with transforms: a coarse grid first, then the turning point.

`plane_onset` also serves long lines.

Between jumps the next instability is a linear programme with the present pieces of the friction
law, as long as no node reaches a corner before it. Where one does, and after a jump, the path is
followed in steps of the load.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.operator import Operator, inner, make_operator
from stiction.elasticity.protocol import HalfSpaces
from stiction.methods.equilibrium.sample import (
    Jump,
    Outcome,
    State,
    StaticSample,
    at_rest,
    exceeds,
    multiplier_of,
    pieces_of,
)
from stiction.methods.equilibrium.transforms.bracket import Bracket, bisect
from stiction.methods.equilibrium.transforms.fold import follow_to_turn
from stiction.methods.equilibrium.transforms.relaxation import (
    least_equilibrium,
    stable_equilibrium,
)
from stiction.methods.equilibrium.transforms.turning_point import close
from stiction.problem.problem import Problem

COARSEST = 8.0
"""Least ratio of the largest K(k) to W on a coarse grid: about six nodes in h_n."""
FEWEST = 8
"""Least nodes along x and y on a coarse grid: below, none is faster than the next one."""
ROUGH = 1e-4
"""Relative gap on coarse grids, whose own error is larger."""
RETREATS = (0.0, 1e-5, 1e-4)
"""Shares of the load below its lower bound from which a path is followed to its turn: the slip
that proves the bound may be beyond it."""
FIRST_STEP = 1e-4
"""Step of the load where the path is followed in steps, as a share of the load; it adapts."""
AHEAD = 0.9
"""Share of the way to the onset that would be without corners that is tried at once: the rest is
what corners take off, mostly less than a tenth."""
SHORTER, LONGER = 0.3, 1.5
"""Change of a step that failed, and of the next after one that did not."""
REACH = 3.0
"""Most steps ahead to which slip is extrapolated as a guess."""
ROUGHNESS = 0.1
"""Largest residual stress after a step, as a share of the step."""
ROUGHEST = 1e-5
"""The same, as a share of the mean strength or load: a rougher slip may miss an event."""
AT_CORNER = 1.0 - 1e-9
"""Share of the slip at a corner above which a node counts as beyond it, given `ACCURACY`."""
ACCURACY = 1e-7
"""Largest residual stress of the slip at a given load, as a share of the mean strength."""
BISECTED, FINER = 5e-3, 0.2
"""Relative gap to which a trivial bracket is bisected before Newton's method is tried, and how much
finer each time that fails."""


def halved(fine: Array) -> Array:
    """Return values on every other node, averaged with weights 1/4, 1/2, 1/4 along each axis."""
    for axis in range(fine.ndim):
        even, odd = ((*(slice(None),) * axis, slice(first, None, 2)) for first in (0, 1))
        fine = 0.5 * fine[even] + 0.25 * (fine[odd] + np.roll(fine[odd], 1, axis))
    return fine


def doubled(coarse: Array) -> Array:
    """Return values interpolated linearly to twice the nodes along each axis."""
    for axis in range(coarse.ndim):
        between = 0.5 * (coarse + np.roll(coarse, -1, axis))
        shape = tuple(n * (1 + (a == axis)) for a, n in enumerate(coarse.shape))
        coarse = np.stack((coarse, between), axis + 1).reshape(shape)
    return coarse


class PlaneOnset(NamedTuple):
    """Onset of one sample.

    Rigorous bounds of the load (Pa) with the slip (m) and the multiplier, (*shape), that prove
    them; whether they are as close as required.
    """

    lower: float
    upper: float
    slip: Array
    multiplier: Array
    closed: bool


def _narrow(bracket: Bracket, gap: float) -> float:
    """Close a bracket from its trivial bounds: bisection until Newton's method succeeds.

    Returns the curvature found. The bounds of a stiffness that is no Z-matrix may not meet.
    """
    share, finest = BISECTED, 0.1 * gap
    bend = 0.0
    while not bracket.closed(gap):
        direction = bisect(bracket, share, 0.05 * min(share, 1e-4))
        _, bend = close(bracket, direction, bracket.lower, bracket.slip, gap)
        if share <= finest:
            break
        share = max(FINER * share, finest)
    return bend


def plane_onset(
    half_spaces: HalfSpaces,
    excess: Array,
    profile: Array,
    rate: Array,
    gap: float = 1e-6,
    slip: Array | None = None,
    corner: Array | None = None,
) -> PlaneOnset:
    """Return the largest load with an equilibrium while no node has reached a corner of its law.

    All fields are (nx, ny), of a line (nodes,): peak strength less initial stress (Pa), load
    profile p > 0, weakening rate (Pa/m; zero where it is residual), slip (m) of an equilibrium at a
    lower load to start from instead of coarse grids. The bounds are closed to a relative gap.
    The onset of a coarse grid is returned if a node there slips beyond its corner (m; 0 for none).
    """
    fields = (excess, profile, rate, np.zeros_like(excess) if corner is None else corner)
    levels = [tuple(np.asarray(given, dtype=np.float64) for given in fields)]
    while slip is None:
        shape = levels[-1][0].shape
        stiffest, weakest = float(half_spaces.symbol(shape).max()), float(levels[-1][2].max())
        odd = any(nodes % 2 for nodes in shape)
        if odd or min(shape) < 2 * FEWEST or 0.5 * stiffest < COARSEST * weakest:
            break
        levels.append(tuple(map(halved, levels[-1])))
    coarse: Bracket | None = None
    bend = 0.0
    for number in range(len(levels) - 1, -1, -1):
        goal = gap if number == 0 else max(ROUGH, gap)
        strength, load_profile, weakening, end = levels.pop()
        symbol = half_spaces.symbol(strength.shape)
        bracket = Bracket(symbol, weakening, strength, load_profile)
        if slip is not None:
            bracket.raise_slip(slip.flatten())
        closed = False
        if coarse is not None:
            below = tuple(nodes // 2 for nodes in strength.shape)
            guess = doubled(coarse.slip.reshape(below)).flatten()
            held = doubled(coarse.multiplier.reshape(below)).flatten()
            held *= 1.0 / np.sqrt((held**2).sum())
            closed, bend = close(bracket, held, coarse.lower, guess, goal, bend)
        if not closed:
            bend = _narrow(bracket, goal)
        coarse = bracket
        end = end.reshape(-1)
        if number > 0 and ((bracket.slip > end) & (end > 0.0)).any():
            break
    return PlaneOnset(
        bracket.lower, bracket.upper, bracket.slip.reshape(strength.shape),
        bracket.multiplier.reshape(strength.shape), bracket.closed(gap),
    )  # fmt: skip


class PlaneProgram:
    """Equilibria of a plane, to a relative distance of bounds; safe to use from several threads."""

    def __init__(self, problem: Problem, gap: float = 1e-6) -> None:
        self.elastic = problem.half_spaces
        self.shape = problem.interface.shape
        self.pieces = pieces_of(problem.friction)._replace(at_corner=AT_CORNER)
        self.requested = gap
        self.widest_gap = 1.01 * gap  # round-off

    def _operator(self, sample: StaticSample) -> Operator:
        return make_operator(
            self.elastic.symbol(self.shape), sample.rate.reshape(self.shape), self.shape
        )

    def _onset(self, sample: StaticSample, corner: Array) -> PlaneOnset:
        """Return the onset without corners, of a coarse grid if a node there passes its corner."""
        fields = (sample.excess, sample.profile, sample.rate, corner)
        excess, profile, rate, corner = (field.reshape(self.shape) for field in fields)
        return plane_onset(self.elastic, excess, profile, rate, self.requested, corner=corner)

    def next(self, sample: StaticSample, state: State | None = None) -> State:
        """Return the next instability on the path from a stable state or from rest.

        From rest it is the onset without corners, if no node reaches its corner before. A coarse
        grid shows most often whether one does; then the path is followed, and if it turns before
        any node does, the onset is computed after all, with its certificate.
        """
        if state is not None:
            return self._step_on(sample, state, FIRST_STEP * state.load)
        found = self._onset(sample, self.pieces.ends[0] * sample.critical)
        if found.slip.size < sample.excess.size:
            reached = self._from_rest(sample, found)
            if exceeds(sample, reached.slip):
                return reached
            found = self._onset(sample, np.zeros_like(sample.excess))
        slip, multiplier = found.slip.reshape(-1), found.multiplier.reshape(-1)
        if exceeds(sample, slip):
            return self._from_rest(sample, found)
        return State(found.lower, slip, multiplier, gap=found.upper - found.lower)

    def _from_rest(self, sample: StaticSample, found: PlaneOnset) -> State:
        """Follow the path from rest, at first most of the way to the onset without corners."""
        rest = at_rest(sample)
        step = max(AHEAD * (found.lower - rest.load), FIRST_STEP * rest.load)
        return self._step_on(sample, rest, step)

    def _step_on(self, sample: StaticSample, state: State, step: float) -> State:
        """Follow the stable path in steps of the load.

        A step is shortened if it may be unstable, which a long one may only because nodes begin to
        slip in it before others reach their corners.
        """
        load, slip, gap = state.load, state.slip, self.requested
        operator = self._operator(sample)
        passed = [(load, slip)]
        while True:
            accuracy = max(0.1 * gap, min(ROUGHNESS * step / abs(load), ROUGHEST))
            guess = slip
            if len(passed) > 1:
                below, less = passed[-2]
                guess = slip + min(step / (load - below), REACH) * (slip - less)
            there = stable_equilibrium(operator, sample, load + step, slip, accuracy, guess)
            if there is None and step > gap * load:
                step = max(SHORTER * step, 0.7 * gap * load)  # the last one is below the gap
                continue
            beyond = load + step
            if there is None:
                # A rough slip may be beyond the turn: then from one step before, and so on.
                starts = reversed(passed)
                turns = (follow_to_turn(operator, sample, a, beyond, d) for a, d in starts)
                turn = next((one for one in turns if one is not None), None)
                if turn is None:
                    direction = slip - passed[0][1]
                    return State(load, slip, direction, gap=step, certified=False)
                if turn.direction.any():
                    return State(
                        turn.load, turn.slip, turn.direction, gap=beyond - turn.load,
                        certified=False, multiplier=turn.direction,
                    )  # fmt: skip
                there = turn.slip
            growth = there - slip
            work = step * inner(sample.profile, growth)
            if work > 0.0:  # A times the growth is about the step of the load
                operator = operator._replace(soft_mode=growth / np.sqrt(work))
            load, slip, step = beyond, there, LONGER * step
            passed = [*passed[-3:], (load, slip)]

    def gradient(self, sample: StaticSample, state: State) -> Array:
        """Find the direction in which the path turns; NaN if that is not found."""
        if state.multiplier is not None or state.gap == 0.0:
            return multiplier_of(sample, state)
        operator, beyond = self._operator(sample), state.load + 2.0 * state.gap
        slip = state.slip
        for retreat in RETREATS if state.certified else ():
            load = state.load - retreat * abs(state.load)
            turn = follow_to_turn(operator, sample, load, beyond, slip)
            if turn is not None and turn.direction.any():
                return turn.direction
            slip = np.zeros(slip.size)  # that which proves the bound may be beyond the turn
        return np.full(slip.size, np.nan)

    def jump(self, sample: StaticSample, found: State) -> Jump:
        beyond = found.load + found.gap
        beyond += self.requested * abs(beyond)
        ahead = least_equilibrium(
            self._operator(sample), sample, beyond, found.slip, 0.1 * self.requested, True
        )
        arrested = ahead.status == Outcome.ARRESTED
        # Where no turn was found, and the rest is in order, a stable path was only hard to follow.
        counts = not arrested or found.multiplier is not None
        after = State(beyond, ahead.slip, found.direction, jumped=True)
        return Jump(arrested, ahead.status != Outcome.UNDECIDED, after, counts)

    def at(self, sample: StaticSample, state: State, load: float) -> State | None:
        if load <= state.load:
            return state
        found = least_equilibrium(self._operator(sample), sample, load, state.slip, ACCURACY)
        if found.status != Outcome.ARRESTED:
            return None
        return replace(state, load=load, slip=found.slip, unstable=False)

    def stress_released(self, state: State) -> Array:
        symbol = self.elastic.symbol(self.shape)
        slip = state.slip.reshape(self.shape)
        released: Array = np.fft.irfft2(symbol * np.fft.rfft2(slip), self.shape).reshape(-1)
        return released

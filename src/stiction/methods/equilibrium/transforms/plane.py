"""Choose the algorithm for equilibria of a plane, with transforms.

Problem
-------
Follow the equilibria of a plane, equation (1) in `solver`, from
instability to instability. K is known only by its symbol in Fourier
space. The onset without corners is the largest load with an equilibrium
if no node reaches a corner in its law (problem (1) in `bracket`).

Algorithm
---------
The algorithm is our own. `plane_onset` finds the onset without corners,
also for long lines:

1. Make coarser grids, each with half the nodes, as long as they resolve
   the nucleation length.
2. On the coarsest grid, bisect the trivial bounds until Newton's method
   on the turning point succeeds (`_narrow`).
3. On each finer grid, start Newton's method
   (`turning_point.close_by_newton`) from the slip and the multiplier on
   the previous grid. If it fails, continue as in step 2.

`PlaneSearch` follows a sample from instability to instability:

4. From rest, the next instability is the onset without corners, if no
   node reaches a corner in its law before. A coarse grid usually shows
   whether a node reaches a corner.
5. Otherwise, and after a jump, the path is followed in steps of the
   load. Each step is proved to be stable
   (`relaxation.stable_equilibrium`). If the proof fails, the step is
   shortened, down to the requested gap.
6. Follow the end of the path event by event (`fold`), to see whether it
   turns, and how.
7. Let a jump go to the least equilibrium a little above the load of the
   turn (`relaxation.least_equilibrium`).
"""

from dataclasses import replace

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.operator import Operator, inner, make_operator
from stiction.elasticity.protocol import HalfSpaces
from stiction.methods.equilibrium.state import (
    EquilibriumState,
    Jump,
    Outcome,
    PathStatus,
    at_rest,
)
from stiction.methods.equilibrium.strength import (
    StaticSample,
    all_breakable_slip,
    exceeds,
    pieces_of,
)
from stiction.methods.equilibrium.transforms.bracket import Bracket, TooSmallError, bisect
from stiction.methods.equilibrium.transforms.fold import follow_to_turn
from stiction.methods.equilibrium.transforms.relaxation import (
    least_equilibrium,
    stable_equilibrium,
)
from stiction.methods.equilibrium.transforms.turning_point import close_by_newton
from stiction.problem.problem import Problem

MIN_STIFFNESS_RATIO = 8.0
"""Least ratio of the largest K(k) to W on a coarse grid: about six
nodes in h_n."""
MIN_COARSE_NODES = 8
"""Fewest nodes along x and y on a coarse grid. A smaller grid saves no time."""
COARSE_GAP = 1e-4
"""Relative gap on coarse grids, whose own error is larger."""
FIRST_LOAD_STEP = 1e-4
"""First step of the load along a path, as a fraction of the load. Later
steps adapt."""
FIRST_SHARE_OF_ONSET = 0.9
"""Part of the way to the onset without corners that is tried at once.
Corners mostly take off less than a tenth."""
STEP_FACTOR_IF_FAILED, STEP_FACTOR = 0.3, 1.5
"""Factors of the next step, after a step that failed and after a step
that succeeded."""
MAX_EXTRAPOLATION = 3.0
"""Most steps by which slip is extrapolated as a guess."""
STEP_RESIDUAL = 0.1
"""Largest residual stress after a step, as a fraction of the step."""
MAX_STEP_RESIDUAL = 1e-5
"""Largest residual stress after a step, relative to the mean strength
or load. A rougher slip may miss an event."""
AT_CORNER = 1.0 - 1e-9
"""Fraction of the slip at a corner above which a node counts as beyond
it, given `SLIP_RTOL`."""
SLIP_RTOL = 1e-7
"""Largest residual stress of the slip at a given load, as a fraction of
the mean strength."""
BISECTED_GAP, BISECTED_GAP_FACTOR = 5e-3, 0.2
"""Relative gap to which a trivial bracket is bisected before Newton's
method is tried, and its change each time that fails."""
BISECTED_RESIDUAL = 0.05
"""Residual stress of bisection, as a fraction of that gap, or of
`COARSE_GAP` if it is smaller."""


def halved(fine: Array) -> Array:
    """Return values at every second node, averaged with weights 1/4, 1/2, 1/4 along each axis.

    >>> halved(np.array([1.0, 2, 5, 10, 3, 0])).tolist()
    [1.0, 5.5, 4.0]
    >>> halved(np.array([[8.0, 0, 4, 0], [0, 0, 0, 0], [0, 0, 0, 16], [0, 0, 0, 0]])).tolist()
    [[2.0, 1.0], [2.0, 2.0]]
    """
    for axis in range(fine.ndim):
        even, odd = ((*(slice(None),) * axis, slice(first, None, 2)) for first in (0, 1))
        fine = 0.5 * fine[even] + 0.25 * (fine[odd] + np.roll(fine[odd], 1, axis))
    return fine


def doubled(coarse: Array) -> Array:
    """Return values interpolated linearly to twice as many nodes along each axis.

    >>> doubled(np.array([1.0, 5.0, 3.0])).tolist()
    [1.0, 3.0, 5.0, 4.0, 3.0, 2.0]
    >>> doubled(np.array([[1.0, 3.0], [5.0, 3.0]])).tolist()[:2]
    [[1.0, 2.0, 3.0, 2.0], [3.0, 3.0, 3.0, 3.0]]
    """
    for axis in range(coarse.ndim):
        between = 0.5 * (coarse + np.roll(coarse, -1, axis))
        shape = tuple(n * (1 + (a == axis)) for a, n in enumerate(coarse.shape))
        coarse = np.stack((coarse, between), axis + 1).reshape(shape)
    return coarse


def halved_strength(fine: Array) -> Array:
    """Halve the grid of strengths, as `halved` does, and average only over
    nodes with finite strength.

    >>> halved_strength(np.array([np.inf, 2.0, 3.0, 4.0, 1.0, np.inf]))
    array([inf,  3.,  2.])
    """
    finite = np.isfinite(fine)
    if finite.all():
        return halved(fine)
    # A coarse node can break if the fine node at its place can.
    even = finite[tuple(slice(None, None, 2) for _ in fine.shape)]
    coarse, weight = halved(np.where(finite, fine, 0.0)), halved(1.0 * finite)
    return np.divide(coarse, weight, out=np.full(even.shape, np.inf), where=even)


def _refined(coarse: Array, shape: tuple[int, ...]) -> Array:
    """Return a flattened field on the next finer grid of the given shape.

    >>> _refined(np.array([1.0, 3.0, 5.0]), (2, 6)).tolist()
    [1.0, 2.0, 3.0, 4.0, 5.0, 3.0, 1.0, 2.0, 3.0, 4.0, 5.0, 3.0]
    """
    return doubled(coarse.reshape([nodes // 2 for nodes in shape])).flatten()


def _narrow(bracket: Bracket, gap: float) -> float:
    """Step 2: close a bracket from its trivial bounds.

    Returns the curvature. If the stiffness is not a Z-matrix, the
    bounds may not meet.

    The onset of the example in `fold.follow_to_turn` is 1.8 Pa:

    >>> K, excess = np.array([0.0, 8, 8, 8, 8]), np.array([1.0, 2, 3, 9, 9, 9, 9, 9])
    >>> bracket = Bracket(K, 5.5, excess, np.ones(8))
    >>> _narrow(bracket, 1e-7) < 0.0
    True
    >>> bracket.closed(1e-7)
    True
    >>> round(bracket.upper, 5)
    1.8
    """
    share, finest = BISECTED_GAP, 0.1 * gap
    bend = 0.0
    while not bracket.closed(gap):
        # Newton's method starts from the lower bound
        # of bisection and its last unstable direction,
        # which is close to the patch that turns.
        residual = BISECTED_RESIDUAL * min(share, COARSE_GAP)
        direction = bisect(bracket, share, residual)
        _, bend = close_by_newton(bracket, direction, bracket.lower, bracket.slip, gap)
        if share <= finest:
            break
        share = max(BISECTED_GAP_FACTOR * share, finest)
    return bend


def plane_onset(
    half_spaces: HalfSpaces,
    excess: Array,
    profile: Array,
    W: Array,
    gap: float = 1e-6,
    slip: Array | None = None,
    corner: Array | None = None,
) -> Bracket:
    """Bracket the largest load with an equilibrium before a node reaches a corner in its law.

    All fields have shape (nx, ny), or (nodes,) on a line. `excess` is
    the peak strength minus the initial stress (Pa). `profile` is the
    load profile p > 0. `W` is the weakening rate (Pa/m, zero at
    residual nodes). `slip` (m) belongs to an equilibrium at a lower
    load, from which the search starts in place of coarse grids.
    `corner` is the slip at the next corner (m, 0 without a corner). The
    search stops when the bounds agree to a relative `gap`. If a node of
    a coarse grid slips beyond its corner, the bracket of this grid is
    returned.

    The onset is the largest load with A d + s - load p >= 0, which `linprog`
    finds without transforms:

    >>> from scipy.optimize import linprog
    >>> half_spaces, shape = HalfSpaces((1.0, 1.6), (4.0, 3.0)), (12, 16)
    >>> x, y = np.indices(shape)
    >>> excess, p = 3.0 + np.cos(x + 0.3 * y) + np.sin(2.0 * y), 1.0 + 0.1 * np.sin(y)
    >>> W = 15.0 + 0.5 * x
    >>> waves = half_spaces.symbol(shape) * np.fft.rfft2(np.eye(192).reshape(192, *shape))
    >>> A = np.fft.irfft2(waves, shape).reshape(192, 192) - np.diag(W.ravel())
    >>> limits = np.column_stack((p.ravel(), -A))
    >>> exact = -linprog(-np.eye(193)[0], limits, excess.ravel()).fun
    >>> bracket = plane_onset(half_spaces, excess, p, W, 1e-6)
    >>> bracket.lower < exact + 1e-9
    True
    >>> bracket.upper > exact - 1e-9
    True
    >>> bracket.closed(1e-6)
    True

    If a node slips beyond its corner, the search stops at a coarse grid:

    >>> x, y = np.indices((16, 16))
    >>> excess, one = 3.0 + np.cos(x + 0.3 * y), np.ones((16, 16))
    >>> for corner in (0.001 * one, None):
    ...     print(plane_onset(half_spaces, excess, one, 6.0 * one, corner=corner).slip.size)
    64
    256
    """
    # 1.
    corners = np.zeros_like(excess) if corner is None else corner
    fields = (excess, profile, W, corners)
    grids = [tuple(np.asarray(field, dtype=np.float64) for field in fields)]
    while slip is None:
        shape = grids[-1][0].shape
        stiffest, steepest = float(half_spaces.symbol(shape).max()), float(grids[-1][2].max())
        # A coarse grid takes every other node, so that an odd number of
        # nodes cannot be halved.
        odd = any(nodes % 2 for nodes in shape)
        resolved = 0.5 * stiffest >= MIN_STIFFNESS_RATIO * steepest
        if odd or min(shape) < 2 * MIN_COARSE_NODES or not resolved:
            break  # this is the coarsest grid
        strength, *fine = grids[-1]
        grids.append((halved_strength(strength), *map(halved, fine)))
    coarser: Bracket | None = None
    bend = 0.0
    while True:
        strength, p, weakening, end = grids.pop()
        is_finest, shape = not grids, strength.shape
        goal = gap if is_finest else max(COARSE_GAP, gap)
        lifting = None if coarser is None else _refined(coarser.lifting[0], shape)
        try:
            bracket = Bracket(half_spaces.symbol(shape), weakening, strength, p, lifting)
        except TooSmallError:  # on a coarse grid a small extent may be smaller
            if is_finest:
                raise
            continue
        if slip is not None:
            bracket.raise_slip(slip.flatten())
        closed = False
        if coarser is not None:  # 3.
            guess, phi = (_refined(x, shape) for x in (coarser.slip, coarser.multiplier))
            # Interpolation spreads both to nodes that cannot break.
            guess, phi = np.where(bracket.can_break, (guess, phi), 0.0)
            phi *= 1.0 / np.sqrt((phi**2).sum())
            closed, bend = close_by_newton(bracket, phi, coarser.lower, guess, goal, bend)
        if not closed:  # 2.
            bend = _narrow(bracket, goal)
        # Beyond a corner the finer onsets would not hold either.
        end = end.reshape(-1)
        if is_finest or ((bracket.slip > end) & (end > 0.0)).any():
            return bracket
        coarser = bracket


class PlaneSearch:
    """Thread-safe search for equilibria of a plane, to a relative gap between bounds.

    The onset of the plane in `plane_onset` is 1.849481 Pa. The slip at 1.8 Pa
    satisfies the law, and the plane slides after the onset:

    >>> from stiction.methods.equilibrium.strength import LINEAR
    >>> from stiction.methods.equilibrium.strength import make_sample, present_pieces
    >>> search = PlaneSearch.__new__(PlaneSearch)
    >>> search.elastic, search.shape = HalfSpaces((1.0, 1.6), (4.0, 3.0)), (12, 16)
    >>> search.pieces, search.requested = LINEAR._replace(at_corner=AT_CORNER), 1e-6
    >>> x, y = (values.ravel() for values in np.indices(search.shape))
    >>> excess, p = 3.0 + np.cos(x + 0.3 * y) + np.sin(2.0 * y), 1.0 + 0.1 * np.sin(y)
    >>> sample = make_sample(excess, np.full(192, -9.0), p, 15.0 + 0.5 * x, search.pieces)
    >>> def overload(sample, state):
    ...     present = present_pieces(sample, state.slip)
    ...     strength = present.strength - present.weakening_rate * state.slip
    ...     overload = state.load * sample.profile - search.stress_released(state) - strength
    ...     slips = state.slip > 0.0
    ...     return bool(overload.max() < 1e-4), bool(np.abs(overload[slips]).max() < 1e-4)
    >>> onset = search.next(sample)
    >>> round(onset.load, 5)
    1.84948
    >>> onset.certified
    True
    >>> bool(onset.gap < 2e-6)
    True
    >>> overload(sample, onset)
    (True, True)
    >>> reached = search.at(sample, at_rest(sample), 1.8)
    >>> reached.load
    1.8
    >>> overload(sample, reached)
    (True, True)
    >>> search.at(sample, onset, 1.9)
    >>> search.jump(sample, onset).outcome.name
    'SLIDING'

    If strength falls by 0.5 Pa only, nodes pass corners before the path turns:

    >>> sample = make_sample(excess, excess - 0.5, p, 15.0 + 0.5 * x, search.pieces)
    >>> turn = search.next(sample)
    >>> turn.certified
    False
    >>> exceeds(sample, turn.slip)
    True
    >>> overload(sample, turn)
    (True, True)
    >>> search.jump(sample, turn).outcome.name
    'SLIDING'

    Strong nodes stop a jump, and the path goes on from there:

    >>> excess += 4.0 * (x > 7)
    >>> sample = make_sample(excess, excess - 0.5, p, 15.0 + 0.5 * x, search.pieces)
    >>> turn = search.next(sample)
    >>> jump = search.jump(sample, turn)
    >>> jump.outcome.name
    'ARRESTED'
    >>> jump.state.load > turn.load
    True
    >>> overload(sample, jump.state)
    (True, True)
    >>> later = search.next(sample, jump.state)
    >>> later.load > jump.state.load
    True
    >>> overload(sample, later)
    (True, True)
    """

    def __init__(self, problem: Problem, gap: float = 1e-6) -> None:
        self.elastic = problem.half_spaces
        self.shape = problem.interface.shape
        self.pieces = pieces_of(problem.friction)._replace(at_corner=AT_CORNER)
        self.requested = gap
        self.widest_gap = 1.01 * gap  # round-off

    def _operator(self, sample: StaticSample) -> Operator:
        W = sample.weakening_rate.reshape(self.shape)
        return make_operator(self.elastic.symbol(self.shape), W, self.shape)

    def _onset(self, sample: StaticSample, corner: Array) -> Bracket:
        """Return the onset without corners, or on a coarse grid on which a node passes a corner."""
        fields = (sample.excess, sample.profile, sample.weakening_rate, corner)
        excess, profile, W, corner = (field.reshape(self.shape) for field in fields)
        return plane_onset(self.elastic, excess, profile, W, self.requested, corner=corner)

    def next(
        self, sample: StaticSample, state: EquilibriumState | None = None
    ) -> EquilibriumState:
        """Return the next instability on the path from a stable state or from rest (steps 4 to 6).

        If the path was followed because of a coarse grid, and turns
        before any node reaches a corner, the onset is computed after
        all, with its certificate.
        """
        if state is not None:  # 5. after a jump
            return self._follow_in_steps(sample, state, FIRST_LOAD_STEP * state.load)
        # 4.
        try:
            onset = self._onset(sample, self.pieces.ends[0] * sample.critical)
        except TooSmallError:  # there is no onset without corners, perhaps no instability
            rest = at_rest(sample)
            return self._follow_in_steps(sample, rest, FIRST_LOAD_STEP * abs(rest.load))
        if onset.slip.size < sample.excess.size:  # of a coarse grid
            turn = self._follow_from_rest(sample, onset)
            if exceeds(sample, turn.slip):
                return turn
            onset = self._onset(sample, np.zeros_like(sample.excess))
        if exceeds(sample, onset.slip):
            return self._follow_from_rest(sample, onset)
        return EquilibriumState(onset.lower, onset.slip, onset.multiplier, gap=onset.gap)

    def _follow_from_rest(self, sample: StaticSample, onset: Bracket) -> EquilibriumState:
        """Follow the path from rest, at first most of the way to the onset without corners."""
        rest = at_rest(sample)
        first = FIRST_SHARE_OF_ONSET * (onset.lower - rest.load)
        return self._follow_in_steps(sample, rest, max(first, FIRST_LOAD_STEP * rest.load))

    def _follow_in_steps(
        self, sample: StaticSample, state: EquilibriumState, step: float
    ) -> EquilibriumState:
        """Steps 5 and 6: follow the stable path in steps of the load to its end.

        A long step may look unstable only because some nodes begin to
        slip during the step before other nodes reach their corners.
        """
        load, slip, gap = state.load, state.slip, self.requested
        operator = self._operator(sample)
        passed = [(load, slip)]
        while not all_breakable_slip(sample, slip):
            accuracy = max(0.1 * gap, min(STEP_RESIDUAL * step / abs(load), MAX_STEP_RESIDUAL))
            # Slip grows smoothly with the load, so extrapolate it as a guess.
            guess = slip
            if len(passed) > 1:
                load_before, slip_before = passed[-2]
                steps_ahead = min(step / (load - load_before), MAX_EXTRAPOLATION)
                guess = slip + steps_ahead * (slip - slip_before)
            end = stable_equilibrium(operator, sample, load + step, slip, accuracy, guess)
            too_far = end is None or all_breakable_slip(sample, end)
            if too_far and step > gap * abs(load):
                # The last step is below the gap.
                step = max(STEP_FACTOR_IF_FAILED * step, 0.7 * gap * load)
                continue
            load_beyond = load + step
            if end is None:  # 6.
                # A rough slip may lie beyond the turn. Then start from the
                # previous step, and so on.
                for start, rough in reversed(passed):
                    turn = follow_to_turn(operator, sample, start, load_beyond, rough)
                    if turn is not None:
                        break
                else:
                    # The path may turn here or not: `jump` finds out,
                    # along the last growth.
                    direction = slip - passed[0][1]
                    return EquilibriumState(load, slip, direction, gap=step, certified=False)
                if turn.direction is not None:
                    return EquilibriumState(
                        turn.load, turn.slip, turn.direction, gap=load_beyond - turn.load,
                        certified=False, multiplier=turn.direction,
                    )  # fmt: skip
                end = turn.slip  # the path goes on beyond the step
            growth = end - slip
            work = step * inner(sample.profile, growth)
            if work > 0.0:  # A times the growth is about the step of the load
                operator = operator._replace(soft_mode=growth / np.sqrt(work))
            # The last few states are enough to restart before a turn
            # that was passed unseen.
            load, slip, step = load_beyond, end, STEP_FACTOR * step
            passed = [*passed[-3:], (load, slip)]
        still = np.zeros_like(slip)
        return EquilibriumState(load, slip, still, status=PathStatus.STABLE, certified=False)

    def jump(
        self, sample: StaticSample, instability: EquilibriumState, to_rest: bool = False
    ) -> Jump:
        assert instability.gap is not None  # instabilities of planes have a gap
        load_beyond = instability.load + instability.gap
        # Above the turn by the requested gap, where there is no
        # equilibrium close by.
        load_beyond += self.requested * abs(load_beyond)
        end = least_equilibrium(
            self._operator(sample), sample, load_beyond, instability.slip,
            accuracy=0.1 * self.requested, is_unstable=True, to_rest=to_rest,
        )  # fmt: skip
        outcome = end.status
        turns = instability.certified or instability.multiplier is not None
        if outcome == Outcome.ARRESTED and not turns:
            # It only shows that a stable path was hard to follow.
            outcome = Outcome.NOT_UNSTABLE
        direction, status = instability.direction, PathStatus.STABLE
        return Jump(outcome, EquilibriumState(load_beyond, end.slip, direction, status=status))

    def at(
        self, sample: StaticSample, state: EquilibriumState, load: float
    ) -> EquilibriumState | None:
        if load <= state.load:
            return state
        end = least_equilibrium(self._operator(sample), sample, load, state.slip, SLIP_RTOL)
        if end.status != Outcome.ARRESTED:
            return None
        return replace(state, load=load, slip=end.slip, status=PathStatus.STABLE)

    def stress_released(self, state: EquilibriumState) -> Array:
        symbol = self.elastic.symbol(self.shape)
        slip = state.slip.reshape(self.shape)
        return np.fft.irfft2(symbol * np.fft.rfft2(slip), self.shape).reshape(-1)

"""The linear programme with one dense factor of K, on a line or a specimen.

Where very many nodes of a line slip the factor is slower than transforms, which take over. Behind a
machine the path is followed event by event: slip lowers the force, whose largest value may lie
before the instability, and where all nodes slip without one the interface slides stably. Arrest in
a specimen is always decided by following the jump.
"""

import threading
from dataclasses import replace

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.line import line_of
from stiction.elasticity.protocol import NONE, Elasticity
from stiction.elasticity.stiffness import apply_circular
from stiction.elasticity.weakest import window_bound
from stiction.methods.equilibrium.dense.cholesky import Course, Workspace, make_workspace
from stiction.methods.equilibrium.dense.jump import jump
from stiction.methods.equilibrium.dense.linear_program import NEARER, certificate, solve_program
from stiction.methods.equilibrium.dense.runaway import Runs, runs_away, runs_of
from stiction.methods.equilibrium.dense.stable_path import REACHED, UNSTABLE, advance
from stiction.methods.equilibrium.sample import (
    Jump,
    Outcome,
    State,
    StaticSample,
    at_rest,
    exceeds,
    multiplier_of,
    pieces_of,
    present_pieces,
    step_to_corner,
)
from stiction.methods.equilibrium.transforms.plane import plane_onset
from stiction.problem.problem import Problem

MANY_NODES = 1500
"""Number of nodes weaker than the upper bound of the load above which transforms are faster."""
GAP_OF_MANY = 3e-10
"""Relative distance of the bounds by transforms, below `widest_gap`."""
WIDEST_OF_STOPS = 1e-4
"""`widest_gap` where nodes may stop: positive entries of K leave bounds so far apart."""
SAME = 1e-12
"""Relative distance of weakening rates that differ by round-off."""


class DenseProgram:
    """Equilibria of a line or a specimen; safe to use from several threads."""

    widest_gap = 1e-9
    """Certificate gap, as a share of the load, above which there is a warning."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.pieces = pieces_of(problem.friction)
        self.nodes = problem.interface.size
        self.elastic: Elasticity
        self.runs: Runs | None = None
        if problem.specimen is None:
            self.elastic = line_of(problem.half_spaces, self.nodes)
            self.runs = runs_of(problem.half_spaces, self.nodes)
        else:
            self.elastic = problem.blocks
        self.driven = self.elastic.relief > 0.0
        self.stops = self.elastic.positive > 0.0  # slip may unload a node that slips
        self._own = threading.local()
        if self.stops:
            self.widest_gap = max(self.widest_gap, WIDEST_OF_STOPS)

    @property
    def _workspaces(self) -> tuple[Workspace, Workspace]:
        """The workspaces of the thread: for programmes and elastic steps, and for true states."""
        if not hasattr(self._own, "workspaces"):
            self._own.workspaces = tuple(
                make_workspace(self.elastic.entries, self.nodes) for _ in range(2)
            )
        pair: tuple[Workspace, Workspace] = self._own.workspaces
        return pair

    def bound(self, sample: StaticSample) -> tuple[float, Array]:
        """Return the bound of the weakest window of one sample (Pa), and its multiplier."""
        low, high = _rates(sample)
        windows = self.elastic.windows(low, high) if high > 0.0 else NONE
        work, multiplier = np.empty((2, self.nodes))
        bound = window_bound(
            sample.excess, sample.profile, sample.rate, windows, work, multiplier
        )
        return bound, multiplier

    def solve(
        self,
        sample: StaticSample,
        cap: float = np.inf,
        state: State | None = None,
    ) -> State | None:
        """Return the critical load of one sample (below `cap`) with its proofs, None if it stalls.

        Only the first piece of the friction law counts: `excess` and `rate`. The state is an
        equilibrium at a lower load, if one was found.
        """
        bound, multiplier = self.bound(sample)
        if cap == np.inf and self.nodes > MANY_NODES:
            weak = np.count_nonzero(sample.excess < bound * sample.profile)
            found = self._by_transforms(sample, state) if weak > MANY_NODES else None
            if found is not None:
                return found
        slip, stiff = np.zeros((2, self.nodes))
        start = top = min(bound, cap)
        low, high = _rates(sample)
        if state is not None:
            start, slip = state.load, state.slip.copy()
        elif low < high:  # the bound is not close: at too high a load far too many nodes join
            first = min(top, float((sample.excess / sample.profile).min()))
            start = (1.0 - NEARER) * first + NEARER * top
        course = Course(sample, slip, stiff, self._workspaces[0], self.stops)
        load, solved = solve_program(course, start, bound, cap, multiplier)
        if not solved:
            return None
        return State(load, slip, multiplier, stiff, multiplier=multiplier)

    def _by_transforms(self, sample: StaticSample, state: State | None) -> State | None:
        """Solve a programme in which many nodes slip; None if its bounds stay apart."""
        half_spaces = self.elastic.half_spaces
        if half_spaces is None:
            return None
        found = plane_onset(
            half_spaces, sample.excess, sample.profile, sample.rate, GAP_OF_MANY,
            None if state is None else state.slip,
        )  # fmt: skip
        if not found.closed:
            return None
        # The multiplier was lifted everywhere to be feasible; that of nodes at rest is zero.
        multiplier = found.multiplier - found.multiplier.min()
        multiplier[multiplier < 1e-9 * multiplier.max()] = 0.0
        multiplier /= multiplier @ sample.profile
        symbol = half_spaces.symbol((self.nodes,))
        stiff = np.fft.irfft(symbol * np.fft.rfft(found.slip), self.nodes)
        return State(found.lower, found.slip, multiplier, stiff, multiplier=multiplier)

    def next(
        self, sample: StaticSample, state: State | None = None, target: float = np.inf
    ) -> State:
        """Return the next instability from a state or from rest, or the state at a load before it.

        The programme of the present pieces gives it if no node reaches a further corner before.
        That is not tried again after it once failed, but for from rest.
        """
        state = state or at_rest(sample)
        rests, by_events = not state.slip.any(), state.by_events or self.driven
        if rests:
            for workspace in self._workspaces:  # what is held is of another sample
                workspace.held[0] = 0
        if target == np.inf and not by_events:
            piece, present = None, sample
            if not rests:
                piece, strength, rate = present_pieces(sample, state.slip)
                present = sample._replace(excess=strength, rate=rate)
            found = self.solve(present, state=None if rests else state)
            straight = found is not None and (rests or found.load >= state.load)
            if found is not None and straight and not exceeds(sample, found.slip, piece):
                self._certify(present, found, found.direction)
                found.stiff_direction = self._workspaces[0].product[: self.nodes].copy()
                return found
            by_events = not rests
        slip, stiff, direction = state.slip.copy(), state.stiff.copy(), state.direction.copy()
        course = Course(sample, slip, stiff, self._workspaces[1], self.stops)
        load, peak, stopped, status = advance(course, state.load, target, direction)
        found = State(
            load, slip, direction, stiff,
            unstable=status == UNSTABLE, known=status in (UNSTABLE, REACHED), peak=peak,
            by_events=by_events, jumped=state.jumped, stopped=stopped or state.stopped,
        )  # fmt: skip
        # No multiplier bounds the load from above where a law steepens, or a node stopped.
        found.certified = found.unstable and not (self.pieces.steepens or found.stopped)
        if found.certified and rests:
            _, strength, rate = present_pieces(sample, slip)
            present = sample._replace(excess=strength, rate=rate)
            self._certify(present, found, multiplier_of(sample, found))
        return found

    def _certify(self, present: StaticSample, found: State, multiplier: Array) -> None:
        """Write the distance of the bounds of an instability; K y is left in the workspace."""
        found.gap = certificate(
            present, found.slip, found.stiff, multiplier, self._workspaces[0]
        )

    def at(self, sample: StaticSample, state: State, load: float) -> State | None:
        if load <= state.load:
            return state
        if not (state.jumped or state.by_events or self.driven):
            found = self.solve(sample, load)
            if found is not None and not exceeds(sample, found.slip):
                return replace(found, load=load, direction=state.direction, unstable=False)
        there = self.next(sample, replace(state, by_events=True), load)
        return None if there.unstable or not there.known else there

    def jump(self, sample: StaticSample, found: State) -> Jump:
        slip, stiff = found.slip.copy(), found.stiff.copy()
        outcome, longest = self._run(sample, found, slip)
        if outcome == Outcome.UNDECIDED:
            elastic, true = self._workspaces
            course = Course(sample, slip, stiff, elastic, self.stops)
            outcome = jump(course, found.load, longest, true)
        if outcome == Outcome.ARRESTED:
            before, after = (present_pieces(sample, each).piece for each in (found.slip, slip))
            if not np.any(after > before):
                # Round-off: only nodes that pass a corner can stop an instability.
                outcome = Outcome.UNDECIDED
        state = State(
            found.load, slip, found.direction, stiff,
            by_events=found.by_events, jumped=True, stopped=found.stopped,
        )  # fmt: skip
        return Jump(outcome == Outcome.ARRESTED, outcome != Outcome.UNDECIDED, state)

    def _run(self, sample: StaticSample, found: State, slip: Array) -> tuple[int, float]:
        """Try whether the patch certainly slides; return that, and a length of residual nodes that
        shows it. The slip moves on to a lower bound of the next equilibrium."""
        if self.runs is None:
            step = step_to_corner(sample, slip, found.direction, np.inf)
            return (Outcome.SLIDING if step == np.inf else Outcome.UNDECIDED), np.inf
        stiff_direction = found.stiff_direction
        if stiff_direction is None:
            members, stiff_direction = np.flatnonzero(found.direction), np.empty(self.nodes)
            apply_circular(
                self.elastic.entries, members, members.size, found.direction[members],
                np.empty((2, self.nodes // 2)), stiff_direction,
            )  # fmt: skip
        return runs_away(
            sample, self.runs, found.load, slip, found.stiff, found.direction,
            stiff_direction,
        )  # fmt: skip

    def gradient(self, sample: StaticSample, state: State) -> Array:
        """Find the multiplier, whose mean over the load profile is one.

        Behind a machine the multiplier is that of the drive;
        until the instability (K - W) d = D q - s on the nodes that slip, none of which rests.
        """
        y = multiplier_of(sample, state)
        if not self.driven:
            return y
        rate = present_pieces(sample, state.slip).rate
        slips, q = state.slip > 0.0, sample.profile
        moved = np.zeros(y.size)  # d' of a rise of the drive
        block = self.problem.blocks.stiffness[np.ix_(slips, slips)] - np.diag(rate[slips])
        moved[slips] = np.linalg.solve(block, q[slips])
        return y - self.elastic.relief / y.size * ((q @ moved) * y - moved)

    def stress_released(self, state: State) -> Array:
        return state.stiff


def _rates(sample: StaticSample) -> tuple[float, float]:
    """Return the lowest and highest weakening rate that is not zero, 0 if all are.

    They are the same if they differ by round-off.
    """
    rates = sample.rate[sample.rate > 0.0]
    if rates.size == 0:
        return 0.0, 0.0
    low, high = float(rates.min()), float(rates.max())
    return low, (high if low < high * (1.0 - SAME) else low)

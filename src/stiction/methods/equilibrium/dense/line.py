"""The linear programme of a line, with one dense factor.

Where very many nodes slip the factor is slower than the transforms of planes, which take over.
"""

import threading
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.line import Stiffness, make_stiffness, stiffness_column
from stiction.elasticity.stiffness import apply
from stiction.methods.equilibrium.dense.cholesky import Workspace, make_workspace
from stiction.methods.equilibrium.dense.jump import jump
from stiction.methods.equilibrium.dense.linear_program import SOLVED, certificate, solve_program
from stiction.methods.equilibrium.dense.runaway import (
    Runs,
    block_factor,
    runs_away,
    unstoppable_length,
)
from stiction.methods.equilibrium.dense.stable_path import REACHED, UNSTABLE, advance
from stiction.methods.equilibrium.dense.windows import (
    Windows,
    exact_window,
    window_bound,
    windows_between,
)
from stiction.methods.equilibrium.patches import main_patch
from stiction.methods.equilibrium.sample import (
    Jump,
    Outcome,
    Program,
    State,
    StaticSample,
    exceeds,
    multiplier_of,
    pieces_of,
    present_pieces,
)
from stiction.methods.equilibrium.transforms.plane import Plane, plane_onset
from stiction.problem.problem import Problem

LONGEST_RUN = 2048
"""Nodes up to which the quick test for arrest follows a run."""
MANY_NODES = 1500
"""Number of nodes weaker than the upper bound of the load above which transforms are faster."""
GAP_OF_MANY = 3e-10
"""Relative distance of the bounds by transforms."""
MARGIN = 1.5
"""Safety factor on the length beyond which a rupture counts as unstoppable."""


class LineProgram(Program):
    """Equilibria of a line.

    Parameters
    ----------
    problem : Problem

    Raises
    ------
    InputError
        If the law has no straight pieces.
    """

    widest_gap = 1e-9
    """Certificate gap, as a share of the load, above which there is a warning."""
    stops = False
    """Whether slip may unload a node that slips, so that it stops."""
    stiffness: Any
    own: Any

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.pieces = pieces_of(problem.friction)
        self.nodes = problem.interface.size
        self._make_stiffness(problem)
        self._own = threading.local()

    def _make_stiffness(self, problem: Problem) -> None:
        """Make K, its diagonal `own`, and what else follows from the elasticity."""
        self.modulus, self.extent = problem.effective_modulus, problem.interface.extent
        self.unit = np.pi * self.modulus / self.extent
        self.stiffness, self.runs = _stiffness_and_runs(self.nodes, self.extent, self.modulus)
        self.own = self.stiffness.column[0]
        rate = problem.friction.weakening_rate
        self.usual_rate = np.nan if rate is None or np.ptp(rate) else float(np.max(rate))
        self.usual = exact_window(self.nodes, self.usual_rate, self.unit)

    @property
    def _workspaces(self) -> tuple[Workspace, Workspace]:
        """The workspaces of the thread: one for the path, another one for jumps."""
        if not hasattr(self._own, "workspaces"):
            self._own.workspaces = tuple(
                make_workspace(self.stiffness, self.nodes) for _ in range(2)
            )
        pair: tuple[Workspace, Workspace] = self._own.workspaces
        return pair

    @property
    def _workspace(self) -> Workspace:
        return self._workspaces[0]

    def _windows(self, rate: Array) -> Windows:
        """Windows of a sample with these weakening rates, Pa/m; `usual` where all are."""
        usual = rate == self.usual_rate
        if usual.all() or (usual | (rate == 0.0)).all():
            return self.usual
        moving = rate[rate > 0.0]
        return windows_between(self.nodes, float(moving.min()), float(moving.max()), self.unit)

    def bound(self, sample: StaticSample) -> tuple[float, Array]:
        """Return the discrete local bound of one sample (Pa), and its multiplier."""
        work, multiplier = np.empty((2, self.nodes))
        return self._bound(sample, multiplier, work)[0], multiplier

    def _bound(
        self, sample: StaticSample, multiplier: Array, work: Array
    ) -> tuple[float, float]:
        """Return the bound of the weakest window, and where `solve_program` begins."""
        windows = self._windows(sample.rate)
        bound = window_bound(sample, windows, work, multiplier)
        return bound, np.inf if windows is self.usual else -np.inf

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
        multiplier, slip, stiff = np.zeros((3, self.nodes))
        bound, start = self._bound(sample, multiplier, stiff)
        if cap == np.inf and self.nodes > MANY_NODES:
            weak = np.count_nonzero(sample.excess < bound * sample.profile)
            found = self._by_transforms(sample, state) if weak > MANY_NODES else None
            if found is not None:
                return found
        workspace = self._workspace
        workspace.diagonal[:] = self.own - sample.rate
        if state is not None:
            start, slip = state.load, state.slip.copy()
        load, status = solve_program(
            sample, start, bound, cap, multiplier, slip, stiff, workspace
        )
        return State(load, slip, stiff, multiplier) if status == SOLVED else None

    def _by_transforms(self, sample: StaticSample, state: State | None) -> State | None:
        """Solve a programme in which many nodes slip; None if its bounds stay apart."""
        plane = Plane((self.extent,), self.modulus, 0.0)
        found = plane_onset(
            plane, sample.excess, sample.profile, sample.rate, GAP_OF_MANY,
            None if state is None else state.slip,
        )  # fmt: skip
        if not found.closed:
            return None
        # The multiplier was lifted everywhere to be feasible; that of nodes at rest is zero.
        multiplier = found.multiplier - found.multiplier.min()
        multiplier[multiplier < 1e-9 * multiplier.max()] = 0.0
        multiplier /= multiplier @ sample.profile
        symbol = plane.symbol((self.nodes,))
        stiff = np.fft.irfft(symbol * np.fft.rfft(found.slip), self.nodes)
        return State(found.lower, found.slip, stiff, multiplier)

    def next(
        self, sample: StaticSample, state: State | None = None, target: float = np.inf
    ) -> State:
        """Return the next instability from a state or from rest, or the state at a load before it.

        The programme of the present pieces gives it if no node reaches a further corner before.
        That is not tried again after it once failed, but for from rest.
        """
        stuck = state is not None and state.stuck
        first = state is None or not state.slip.any()
        if first:
            for workspace in self._workspaces:  # what is held is of another sample
                workspace.held[0] = 0
        if target == np.inf and not stuck:
            piece, present = None, sample
            if state is not None:
                piece, strength, rate = present_pieces(sample, state.slip)
                present = sample._replace(excess=strength, rate=rate)
            found = self.solve(present, state=state)
            straight = found is not None and (state is None or found.load >= state.load)
            if found is not None and straight and not exceeds(sample, found.slip, piece):
                self._certify(present, found, found.direction)
                found.ahead = self._workspace.vectors[2, : self.nodes].copy()
                return found
            stuck = state is not None
        state = state or self.at_rest(sample)
        slip, stiff, direction = state.slip.copy(), state.stiff.copy(), state.direction.copy()
        load, peak, stopped, status = advance(
            sample, state.load, target, slip, stiff, direction, self._workspaces[1], self.stops
        )
        found = State(
            load, slip, stiff, direction,
            unstable=status == UNSTABLE, known=status in (UNSTABLE, REACHED), stuck=stuck,
            peak=peak, stopped=stopped or state.stopped,
        )  # fmt: skip
        # No multiplier bounds the load from above where a law steepens, or a node stopped.
        found.certified = found.unstable and not (self.pieces.steepens or found.stopped)
        if found.certified and first:
            _, strength, rate = present_pieces(sample, slip)
            present = sample._replace(excess=strength, rate=rate)
            self._certify(present, found, multiplier_of(sample, found))
        return found

    def _certify(self, present: StaticSample, found: State, multiplier: Array) -> None:
        """Write the distance of the bounds of an instability; K y is left in the workspace."""
        found.gap = certificate(present, found.slip, found.stiff, multiplier, self._workspace)

    def at(self, sample: StaticSample, state: State, load: float, fresh: bool) -> State | None:
        """Return the equilibrium at a load from a state below, None if it is not found."""
        if load <= state.load:
            return state
        if fresh and not state.stuck:
            found = self.solve(sample, load)
            if found is not None and not exceeds(sample, found.slip):
                return replace(found, load=load, direction=state.direction, unstable=False)
        there = self.next(sample, replace(state, stuck=True), load)
        return None if there.unstable or not there.known else there

    def jump(self, sample: StaticSample, found: State) -> Jump:
        """Let an unstable state jump to another equilibrium, or to sliding."""
        slip, stiff, direction = found.slip.copy(), found.stiff, found.direction
        outcome, griffith = self._runs_away(sample, found, slip)
        if outcome == Outcome.UNDECIDED:
            stiff = stiff.copy()
            outcome = jump(
                sample, found.load, slip, stiff, griffith, *self._workspaces, self.stops
            )
        if outcome == Outcome.ARRESTED:
            before, after = (present_pieces(sample, each).piece for each in (found.slip, slip))
            if not np.any(after > before):
                # Round-off: only nodes that pass a corner can stop an instability.
                outcome = Outcome.UNDECIDED
        state = State(
            found.load, slip, stiff, direction, stuck=found.stuck, stopped=found.stopped
        )
        return Jump(outcome == Outcome.ARRESTED, outcome != Outcome.UNDECIDED, state)

    def _runs_away(self, sample: StaticSample, found: State, slip: Array) -> tuple[int, float]:
        """Try whether the patch certainly slides; return that and the length that would show it.

        The slip moves on to a lower bound of the next equilibrium.
        """
        direction = found.direction
        start, length, _ = main_patch(direction)
        pushed = self._stiffness_times(direction) if found.ahead is None else found.ahead
        outcome = runs_away(
            sample, self.runs, found.load, slip, found.stiff, direction, pushed, start, length,
            np.empty((4, self.nodes)),
        )  # fmt: skip
        if outcome != Outcome.UNDECIDED:
            return outcome, np.inf
        return outcome, MARGIN * unstoppable_length(sample, found.load, self.runs)

    def stress_released(self, state: State) -> Array:
        """Return the stress that the slip takes off the interface, K d, Pa."""
        return state.stiff

    def _stiffness_times(self, field: Array) -> Array:
        members = np.flatnonzero(field)
        result = np.empty(self.nodes)
        halves = np.empty((2, self.nodes // 2))
        apply(self.stiffness, members, members.size, field[members], halves, result)
        return result


@lru_cache(maxsize=4)
def _stiffness_and_runs(nodes: int, extent: float, modulus: float) -> tuple[Stiffness, Runs]:
    column = stiffness_column(nodes, extent, modulus)
    longest = min(LONGEST_RUN, nodes - 1)
    factor = block_factor(column, longest)
    return make_stiffness(column), Runs(
        np.tile(column, 3), factor, longest, extent / nodes, modulus
    )

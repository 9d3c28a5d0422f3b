"""The linear programme of a line, with one dense factor.

Where very many nodes slip the factor is slower than the transforms of planes, which take over.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.elasticity.line import (
    Stiffness,
    apply_stiffness,
    make_stiffness,
    stiffness_column,
)
from stiction.elasticity.linear import dot
from stiction.equilibrium.cholesky import Workspace, make_workspace
from stiction.equilibrium.jump import jump
from stiction.equilibrium.linear_program import SOLVED, certificate, solve_program
from stiction.equilibrium.patches import count_patches, main_patch
from stiction.equilibrium.runaway import (
    ARRESTED,
    SLIDING,
    UNDECIDED,
    Runs,
    block_factor,
    runs_away,
    unstoppable_length,
)
from stiction.equilibrium.sample import (
    First,
    Jump,
    Program,
    Sample,
    State,
    empty_first,
    exceeds,
    pieces_of,
    present_pieces,
    refused,
    row_of,
    sample_of,
)
from stiction.equilibrium.stable_path import REACHED, UNSTABLE, advance
from stiction.equilibrium.transforms import Plane, plane_onset
from stiction.equilibrium.windows import Windows, exact_window, window_bound, windows_between
from stiction.errors import InputError
from stiction.problem import Problem
from stiction.problem import Sample as Samples

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
    every : int
        Which nodes of the problem are taken: all, or every second one.

    Raises
    ------
    InputError
        If the law has no straight pieces.
    """

    widest_gap = 1e-9
    """Certificate gap, as a share of the load, above which there is a warning."""

    def __init__(self, problem: Problem, every: int = 1) -> None:
        if reasons := refused(problem.friction):
            raise InputError(reasons)
        self.problem = problem
        self.pieces = pieces_of(problem.friction)
        self.nodes = problem.interface.size // every
        self.modulus, self.extent = problem.effective_modulus, problem.interface.extent
        self.unit = np.pi * self.modulus / self.extent
        self.stiffness, self.runs = _stiffness_and_runs(self.nodes, self.extent, self.modulus)
        rate = problem.friction.weakening_rate
        self.usual_rate = np.nan if rate is None or np.ptp(rate) else float(np.max(rate))
        self.usual = exact_window(self.nodes, self.usual_rate, self.unit)

    def _windows(self, rate: Array) -> Windows:
        """Windows of a sample with these weakening rates, Pa/m; `usual` where all are."""
        if np.all((rate == self.usual_rate) | (rate == 0.0)):
            return self.usual
        moving = rate[rate > 0.0]
        return windows_between(self.nodes, float(moving.min()), float(moving.max()), self.unit)

    def bound(self, sample: Sample) -> tuple[float, Array]:
        """Return the discrete local bound of one sample (Pa), and its multiplier."""
        work, multiplier = np.empty((2, self.nodes))
        return window_bound(sample, self._windows(sample.rate), work, multiplier), multiplier

    def programme(
        self,
        sample: Sample,
        cap: float = np.inf,
        state: State | None = None,
        windows: Windows | None = None,
        workspace: Workspace | None = None,
    ) -> State | None:
        """Return the critical load of one sample (below `cap`) with its proofs, None if it stalls.

        Only the first piece of the friction law counts: `excess` and `rate`. The state is an
        equilibrium at a lower load, if one was found.
        """
        windows = windows or self._windows(sample.rate)
        multiplier, slip, stiff = np.zeros((3, self.nodes))
        bound = window_bound(sample, windows, stiff, multiplier)
        if cap == np.inf and self.nodes > MANY_NODES:
            weak = np.count_nonzero(sample.excess < bound * sample.profile)
            found = self._by_transforms(sample, state) if weak > MANY_NODES else None
            if found is not None:
                return found
        workspace = workspace or make_workspace(self.stiffness)
        workspace.diagonal[:] = self.stiffness.column[0] - sample.rate
        start = np.inf if windows is self.usual else -np.inf
        if state is not None:
            start, slip = state.load, state.slip.copy()
        load, status = solve_program(
            sample, start, bound, cap, multiplier, slip, stiff, workspace
        )
        return State(load, slip, stiff, multiplier) if status == SOLVED else None

    def _by_transforms(self, sample: Sample, state: State | None) -> State | None:
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

    def first(self, rows: Samples, fields: bool) -> tuple[First, dict[int, State | None]]:
        """Return the first instability of each row, with `fields` also its slip and multiplier.

        Also returns the rows to be followed from there or, with None, from rest, as a corner of
        the law is reached before; all other rows run away.
        """
        first = empty_first(rows.samples, 5, self.nodes)
        samples = sample_of(rows, self.pieces)
        alike = self._windows(samples.rate) is self.usual
        workspace = make_workspace(self.stiffness)
        states: dict[int, State | None] = {}
        for row in range(rows.samples):
            sample = row_of(samples, row)
            windows = self.usual if alike else self._windows(sample.rate)
            found = self.programme(sample, windows=windows, workspace=workspace)
            if found is None or exceeds(sample, found.slip):
                states[row] = None
                continue
            multiplier = found.direction
            gap = certificate(sample, found.slip, found.stiff, multiplier, workspace)
            _, length, centre = main_patch(multiplier)
            spacing, patches = self.runs.spacing, count_patches(found.slip)
            first.table[row] = found.load, gap, patches, centre * spacing, length * spacing
            if fields:
                first.slip[row], first.multiplier[row] = found.slip, multiplier
            ahead = found.slip.copy()
            if not self._runs_away(sample, found, ahead, workspace.vectors[2]):
                states[row] = replace(found, ahead=ahead)
        return first, states

    def _runs_away(self, sample: Sample, found: State, slip: Array, stiff: Array) -> bool:
        """Test quickly whether an instability becomes sliding; `stiff` is K times its direction.

        The slip is moved to a lower bound of the next equilibrium.
        """
        start, length, _ = main_patch(found.direction)
        outcome = runs_away(
            sample, self.runs, found.load, slip, found.stiff, found.direction, stiff,
            start, length, np.empty((4, self.nodes)),
        )  # fmt: skip
        return bool(outcome == SLIDING)

    def next(self, sample: Sample, state: State, target: float = np.inf) -> State:
        """Return the next instability, or the state at a load before it.

        The programme of the present pieces gives it if no node reaches a further corner before.
        That is tried neither from rest, where `first` did so, nor after it once failed.
        """
        stuck = state.stuck
        if target == np.inf and state.slip.any() and not stuck:
            piece, strength, rate = present_pieces(sample, state.slip)
            present = sample._replace(excess=strength, rate=rate)
            found = self.programme(present, state=state)
            straight = found is not None and found.load >= state.load
            if found is not None and straight and not exceeds(sample, found.slip, piece):
                return found
            stuck = True
        slip, stiff, direction = state.slip.copy(), state.stiff.copy(), state.direction.copy()
        workspace = make_workspace(self.stiffness)
        load, status = advance(sample, state.load, target, slip, stiff, direction, workspace)
        return State(
            load, slip, stiff, direction,
            unstable=status == UNSTABLE, known=status in (UNSTABLE, REACHED), stuck=stuck,
        )  # fmt: skip

    def at(self, sample: Sample, state: State, load: float, fresh: bool) -> State | None:
        """Return the equilibrium at a load from a state below, None if it is not found."""
        if load <= state.load:
            return state
        if fresh and not state.stuck:
            found = self.programme(sample, load)
            if found is not None and not exceeds(sample, found.slip):
                return replace(found, load=load, direction=state.direction, unstable=False)
        there = self.next(sample, replace(state, stuck=True), load)
        return None if there.unstable or not there.known else there

    def jump(self, sample: Sample, found: State) -> Jump:
        """Let an unstable state jump to another equilibrium, or to sliding."""
        slip, stiff = found.slip.copy(), found.stiff.copy()
        outcome = UNDECIDED
        if found.ahead is not None:
            slip = found.ahead
        elif self._runs_away(sample, found, slip, self._stiffness_times(found.direction)):
            outcome = SLIDING
        if outcome == UNDECIDED:
            griffith = MARGIN * unstoppable_length(sample, found.load, self.runs)
            spaces = make_workspace(self.stiffness), make_workspace(self.stiffness)
            outcome = jump(sample, found.load, slip, stiff, griffith, *spaces)
        before, after = (present_pieces(sample, each).piece for each in (found.slip, slip))
        if outcome == ARRESTED and not np.any(after > before):
            # Round-off: only nodes that pass a corner can stop an instability.
            outcome = UNDECIDED
        state = State(found.load, slip, stiff, found.direction, stuck=found.stuck)
        return Jump(outcome == ARRESTED, outcome != UNDECIDED, state)

    def gap(self, sample: Sample, state: State, multiplier: Array) -> float:
        """Return the distance of the bounds of an instability (Pa); NaN where a law steepens.

        Then no multiplier bounds the load from above.
        """
        if self.pieces.steepens:
            return np.nan
        _, strength, rate = present_pieces(sample, state.slip)
        present = sample._replace(excess=strength, rate=rate)
        workspace = make_workspace(self.stiffness)
        return float(certificate(present, state.slip, state.stiff, multiplier, workspace))

    def corner_sensitivity(
        self, sample: Sample, slip: Array, piece: NDArray[np.int64], corners: NDArray[np.int64]
    ) -> Array:
        """Return the derivative by the peak strengths of the load at which a node is at a corner.

        Up to there A d = tau_0 p - q on the slipping nodes, with q the start of their pieces, and
        the slip of node j is u_j (tau_p - tau_r)/W; with z = A^-1 e_j that is z (tau_0 p - q).
        NaN where several nodes reach a corner at once: the derivatives of either side differ.
        """
        derivative = np.zeros(slip.size)
        if corners.size > 1:
            derivative[:] = np.nan
            return derivative
        pieces, node = sample.pieces, int(corners[0])
        before = piece.copy()
        before[node] -= 1
        inside = np.flatnonzero(slip > 0.0)
        matrix = self.stiffness.column[np.abs(inside[:, None] - inside)]
        matrix[np.diag_indices(inside.size)] -= (pieces.slopes[before] * sample.rate)[inside]
        z = np.linalg.solve(matrix, (inside == node).astype(np.float64))
        share = np.where(sample.critical > 0.0, pieces.starts[before], 1.0)
        derivative[inside] = z * share[inside]
        derivative[node] += pieces.ends[before[node]] * pieces.first / sample.rate[node]
        return derivative / dot(z, sample.profile[inside], inside.size)

    def stress_released(self, state: State) -> Array:
        """Return the stress that the slip takes off the interface, K d, Pa."""
        return state.stiff

    def _stiffness_times(self, field: Array) -> Array:
        members = np.flatnonzero(field)
        result = np.empty(self.nodes)
        halves = np.empty((2, self.nodes // 2))
        apply_stiffness(self.stiffness, members, members.size, field[members], halves, result)
        return result


@lru_cache(maxsize=4)
def _stiffness_and_runs(nodes: int, extent: float, modulus: float) -> tuple[Stiffness, Runs]:
    column = stiffness_column(nodes, extent, modulus)
    longest = min(LONGEST_RUN, nodes - 1)
    factor = block_factor(column, longest)
    return make_stiffness(column), Runs(
        np.tile(column, 3), factor, longest, extent / nodes, modulus
    )

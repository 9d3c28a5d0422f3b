"""The programme of lines, with one dense factor.

Where very many nodes slip the factor is slower than the transforms of planes, which take over.
"""

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

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
from stiction.equilibrium.linear_program import (
    SOLVED,
    certificate,
    solve_program,
)
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
    GAP,
    LENGTH,
    LOAD,
    OUTCOME,
    PATCHES,
    POSITION,
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
from stiction.jit import jit, jit_inside
from stiction.problem import Problem
from stiction.problem import Sample as Samples

LONGEST_RUN = 2048
"""Nodes up to which the quick test for arrest follows a run."""
MANY_NODES = 1500
"""Nodes weaker than the upper bound of the load from which on transforms are faster."""
GAP_OF_MANY = 3e-10
"""Relative distance of the bounds by transforms."""
MARGIN = 1.5
"""Safety on the length at which a rupture counts as unstoppable."""

CORNER_REACHED = 3
"""Outcome of a sample in which a corner of the law is reached before the first instability."""
CROWDED = 4
"""Outcome of a sample that is left to transforms."""


class Line(NamedTuple):
    """What is the same for all samples of a line.

    `usual` is the window at the problem's uniform weakening rate, `usual_rate`, or NaN.
    """

    stiffness: Stiffness
    runs: Runs
    usual_rate: float
    usual: Windows


@jit_inside
def judge(
    sample: Sample,
    line: Line,
    first: First,
    row: int,
    slip: Array,
    stiff: Array,
    all_slips: bool,
    workspace: Workspace,
    work: Array,
) -> None:
    """Write what the programme of a sample says, and test quickly whether it runs away.

    Its load and multiplier are in their places; `slip` is changed.
    """
    multiplier, n = first.multiplier[row], slip.shape[0]
    gap = certificate(sample, slip, stiff, multiplier, workspace)
    _, length, centre = main_patch(multiplier)
    outcome = UNDECIDED
    for i in range(n):
        corner = sample.pieces.ends[0] * sample.critical[i]
        if slip[i] > corner * (2.0 - sample.pieces.at_corner) and sample.critical[i] > 0.0:
            outcome = CORNER_REACHED
    if all_slips or outcome == UNDECIDED:
        for i in range(n):
            first.slip[row, i] = slip[i]
    first.table[row, PATCHES] = count_patches(slip)
    if outcome == UNDECIDED:
        outcome = runs_away(
            sample, line.runs, first.table[row, LOAD], slip, stiff, multiplier,
            workspace.vectors[2], work,
        )  # fmt: skip
        if outcome == UNDECIDED:
            for i in range(n):
                first.stiff[row, i] = stiff[i]
                first.ahead[row, i] = slip[i]
    first.table[row, GAP] = gap
    first.table[row, POSITION] = centre * line.runs.spacing
    first.table[row, LENGTH] = length * line.runs.spacing
    first.table[row, OUTCOME] = outcome


@jit
def solve_batch(
    samples: Sample,
    line: Line,
    others: Windows,
    all_slips: bool,
    solved: bool,
    first: First,
    workspace: Workspace,
    work: Array,
) -> None:
    """Solve the programme for each row and test quickly whether its instability is arrested.

    `others` are the windows of samples with another weakening rate than the usual one anywhere;
    `work` is (8, n) of work space. With `solved` load, slip, K d and multiplier are in their
    places already.
    """
    count, n = samples.excess.shape
    slip, stiff = work[6], work[7]
    for row in range(count):
        sample = row_of(samples, row)
        multiplier = first.multiplier[row]
        start = np.inf
        for i in range(n):
            workspace.diagonal[i] = line.stiffness.column[0] - sample.rate[i]
            slip[i] = 0.0
            if sample.rate[i] != line.usual_rate and sample.rate[i] != 0.0:
                start = -np.inf
        if solved:
            for i in range(n):
                slip[i], stiff[i] = first.slip[row, i], first.stiff[row, i]
        else:
            windows = line.usual if start == np.inf else others
            bound = window_bound(sample, windows, work[0], multiplier)
            weak = 0
            for i in range(n):
                weak += sample.excess[i] < bound * sample.profile[i]
            if weak > MANY_NODES:
                first.table[row, OUTCOME] = CROWDED
                continue
            # If it does not succeed, the certificate says so.
            first.table[row, LOAD], _ = solve_program(
                sample, start, bound, np.inf, multiplier, slip, stiff, workspace
            )
        judge(sample, line, first, row, slip, stiff, all_slips, workspace, work)


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
    """Certificate gap, as a share of the load, from which on there is a warning."""

    def __init__(self, problem: Problem, every: int = 1) -> None:
        if reasons := refused(problem.friction):
            raise InputError(reasons)
        self.problem = problem
        self.pieces = pieces_of(problem.friction)
        self.nodes = problem.interface.size // every
        modulus = problem.effective_modulus
        self.unit = np.pi * modulus / problem.interface.extent
        rate = problem.friction.weakening_rate
        uniform = rate is not None and np.ptp(rate) == 0.0
        usual = float(np.max(rate)) if uniform else np.nan
        extent = problem.interface.extent
        stiffness, runs = _stiffness_and_runs(self.nodes, extent, modulus)
        self.line = Line(
            stiffness,
            runs,
            usual,
            exact_window(self.nodes, usual, self.unit) if uniform else _no_windows(),
        )  # fmt: skip

    def _windows(self, rates: Array) -> Windows:
        """Windows for samples whose weakening rates (any shape, Pa/m) are not the usual one."""
        moving = rates[rates > 0.0]
        if moving.size == 0:
            return _no_windows()
        return windows_between(self.nodes, float(moving.min()), float(moving.max()), self.unit)

    def _is_usual(self, sample: Sample) -> bool:
        return bool(np.all((sample.rate == self.line.usual_rate) | (sample.rate == 0.0)))

    def bound(self, sample: Sample) -> tuple[float, Array]:
        """Return the discrete local bound of one sample (Pa), and its multiplier."""
        windows = self.line.usual if self._is_usual(sample) else self._windows(sample.rate)
        multiplier = np.empty(self.nodes)
        load = window_bound(sample, windows, np.empty(self.nodes), multiplier)
        return load, multiplier

    def programme(
        self, sample: Sample, cap: float = np.inf, state: State | None = None
    ) -> State | None:
        """Return the critical load of one sample (below `cap`) with its proofs, None if it stalls.

        Only the first piece of its law counts: `excess` and `rate`. The state is an equilibrium at
        a lower load, if one is known.
        """
        bound, multiplier = self.bound(sample)
        weak = np.count_nonzero(sample.excess < bound * sample.profile)
        if cap == np.inf and weak > MANY_NODES:
            found = self._by_transforms(sample, state)
            if found is not None:
                return found
        workspace = self._workspace(sample)
        stiff = np.empty(self.nodes)
        start, slip = np.inf if self._is_usual(sample) else -np.inf, np.zeros(self.nodes)
        if state is not None:
            start, slip = state.load, state.slip.copy()
        load, status = solve_program(
            sample, start, bound, cap, multiplier, slip, stiff, workspace
        )
        return State(load, slip, stiff, multiplier) if status == SOLVED else None

    def _by_transforms(self, sample: Sample, state: State | None) -> State | None:
        """Solve a programme in which many nodes slip; None if its bounds stay apart."""
        plane = Plane((self.problem.interface.extent,), self.problem.effective_modulus, 0.0)
        found = plane_onset(
            plane, sample.excess, sample.profile, sample.rate, GAP_OF_MANY,
            None if state is None else state.slip,
        )  # fmt: skip
        if not found.closed:
            return None
        # The multiplier was lifted everywhere to be feasible; nodes at rest have none.
        multiplier = found.multiplier - found.multiplier.min()
        multiplier[multiplier < 1e-9 * multiplier.max()] = 0.0
        multiplier /= multiplier @ sample.profile
        symbol = plane.symbol((self.nodes,))
        stiff = np.fft.irfft(symbol * np.fft.rfft(found.slip), self.nodes)
        return State(found.lower, found.slip, stiff, multiplier)

    def _workspace(self, sample: Sample) -> Workspace:
        workspace = make_workspace(self.line.stiffness)
        workspace.diagonal[:] = self.line.stiffness.column[0] - sample.rate
        return workspace

    def first(self, rows: Samples, slips: bool) -> tuple[First, dict[int, State | None]]:
        """Return the first instability of each row by the programme.

        Also the rows to be followed from there, or, None, from the start, as a corner of the law
        is reached before; all others run away.
        """
        first = empty_first(rows.samples, 6, self.nodes)
        samples = sample_of(rows, self.pieces)
        unusual = samples.rate[np.any(samples.rate != self.line.usual_rate, axis=1)]
        spaces = make_workspace(self.line.stiffness), np.empty((8, self.nodes))
        others = self._windows(unusual)
        solve_batch(samples, self.line, others, slips, False, first, *spaces)
        for row in map(int, np.flatnonzero(first.table[:, OUTCOME] == CROWDED)):
            found = self.programme(self.sample_of(rows, row))
            if found is None:  # followed event by event instead
                first.table[row] = 0.0
                first.table[row, GAP] = np.nan
                first.multiplier[row] = 0.0
                first.table[row, OUTCOME] = CORNER_REACHED
                continue
            first.table[row, LOAD] = found.load
            first.slip[row], first.stiff[row] = found.slip, found.stiff
            first.multiplier[row] = found.direction
            part = slice(row, row + 1)
            one, table = (
                sample_of(rows, self.pieces, part),
                First(*(each[part] for each in first)),
            )
            solve_batch(one, self.line, others, slips, True, table, *spaces)
        states: dict[int, State | None] = {}
        for row in map(int, np.flatnonzero(first.table[:, OUTCOME] != SLIDING)):
            states[row] = None
            if first.table[row, OUTCOME] == UNDECIDED:
                states[row] = State(
                    float(first.table[row, LOAD]), first.slip[row].copy(), first.stiff[row],
                    first.multiplier[row].copy(), ahead=first.ahead[row],
                )  # fmt: skip
        return first, states

    def next(self, sample: Sample, state: State, target: float = np.inf) -> State:
        """Return the next instability, or the state at a load before it.

        It is the programme of the present pieces if no node reaches another corner before it; that
        is not tried from rest, where it has been, nor after it once failed: most others would.
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
        workspace = make_workspace(self.line.stiffness)
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
        runs = self.line.runs
        griffith = MARGIN * unstoppable_length(sample, found.load, runs)
        outcome = UNDECIDED
        if found.ahead is not None:
            slip = found.ahead
        else:
            outcome = runs_away(
                sample, runs, found.load, slip, stiff, found.direction,
                self._stiffness_times(found.direction), np.empty((6, self.nodes)),
            )  # fmt: skip
        stiffness = self.line.stiffness
        if outcome == UNDECIDED:
            spaces = make_workspace(stiffness), make_workspace(stiffness)
            outcome = jump(sample, found.load, slip, stiff, griffith, *spaces)
        before, after = (present_pieces(sample, each).piece for each in (found.slip, slip))
        if outcome == ARRESTED and not np.any(after > before):
            outcome = (
                UNDECIDED  # round-off: only nodes that pass a corner can stop an instability
            )
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
        workspace = make_workspace(self.line.stiffness)
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
        matrix = self.line.stiffness.column[np.abs(inside[:, None] - inside)]
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
        apply_stiffness(
            self.line.stiffness, members, members.size, field[members], halves, result
        )
        return result


@lru_cache(maxsize=4)
def _stiffness_and_runs(nodes: int, extent: float, modulus: float) -> tuple[Stiffness, Runs]:
    column = stiffness_column(nodes, extent, modulus)
    longest = min(LONGEST_RUN, nodes - 1)
    factor = block_factor(column, longest)
    return make_stiffness(column), Runs(
        np.tile(column, 3), factor, longest, extent / nodes, modulus
    )


def _no_windows() -> Windows:
    return Windows(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((1, 1)))

"""The solver of the equilibrium method: rows in, onset out."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.elasticity.inner_product import dot
from stiction.equilibrium import batch, discretization
from stiction.equilibrium.batch import solve_batch
from stiction.equilibrium.continuation import (
    Event,
    State,
    at_rest,
    exceeds,
    fall,
    follow,
    present_pieces,
    residual_nodes,
    steep_corners,
)
from stiction.equilibrium.instability_jump import SLIDING, UNDECIDED
from stiction.equilibrium.linear_program_cg import Solution
from stiction.equilibrium.patches import count_patches, main_patch
from stiction.equilibrium.pieces import LINEAR, Pieces, steepens
from stiction.equilibrium.prepared import LARGE_GRID, Setting
from stiction.equilibrium.single_patch_test import runs_away
from stiction.equilibrium.workspace import Sample, make_sample
from stiction.errors import warn_accuracy
from stiction.problem import Problem
from stiction.problem import Sample as Samples

WORST_GAP = 1e-9
"""Certificate gap, as a share of the load, from which on there is a warning."""


def sample_of(rows: Samples, row: int, pieces: Pieces = LINEAR) -> Sample:
    """One row as the kernels take it."""
    initial = rows.initial_stress[row]
    excess = np.ascontiguousarray(rows.strength[row] - initial)
    residual = np.ascontiguousarray(rows.residual_strength[row] - initial)
    rate = np.array(rows.weakening_rate[row])
    return make_sample(excess, residual, np.array(rows.load_profile), rate, pieces)


class Solver:
    """Solves rows of a problem; safe to call from several threads.

    Parameters
    ----------
    problem : Problem
    sensitivity, slip : bool
        Whether to return these as well.
    discretization_error : bool
        Whether to estimate it, from the onsets on every second node.
    prove_sliding : bool
        Whether to follow jumps until no balance of forces is left.
    nodes : slice
        Nodes of the problem that the rows have.
    events : int
        How many arrested events to return of each row.
    """

    def __init__(
        self,
        problem: Problem,
        sensitivity: bool = False,
        slip: bool = False,
        discretization_error: bool = False,
        prove_sliding: bool = False,
        nodes: slice = slice(None),
        events: int = 0,
    ) -> None:
        self.setting = Setting(problem, nodes, prove_sliding)
        self.sensitivity = sensitivity
        self.slip = slip
        self.events = events
        self.halves: list[Solver] = []
        if discretization_error:
            discretization.check(problem)
            self.halves = [Solver(problem, nodes=slice(first, None, 2)) for first in (0, 1)]

    def __call__(self, rows: Samples) -> dict[str, NDArray[Any]]:
        """The onset of each row; see `Equilibrium` for what comes back."""
        return self.solve(rows)[0]

    def solve(self, rows: Samples) -> tuple[dict[str, NDArray[Any]], dict[int, list[Event]]]:
        """The onset of each row, and the arrested events of the rows that have any."""
        if not self.halves:
            self.setting.problem.warn_if_coarse(rows, 8.0, discretization.ROUGHLY)
        values, events = self._solve(rows)
        if self.halves:
            coarse = [
                half._solve(rows.every_second(first))[0]["first_instability"]
                for first, half in enumerate(self.halves)
            ]
            values["discretization_error"] = discretization.estimate(
                values["first_instability"], coarse
            )
        return values, events

    def _solve(self, rows: Samples) -> tuple[dict[str, NDArray[Any]], dict[int, list[Event]]]:
        """The same without a word on the grid."""
        self.setting.refuse_too_fine(float(rows.weakening_rate.max()))
        count, nodes = rows.samples, rows.strength.shape[1]
        table = np.empty((count, batch.COLUMNS))
        multipliers = np.empty((count, nodes))
        slips = np.empty((count, nodes))  # what is never written takes no memory
        known: dict[int, State] = {}
        if nodes < LARGE_GRID:
            stiffs, aheads = np.empty((2, count, nodes))
            self._batch(rows, table, slips, stiffs, aheads, multipliers)
            for row in map(int, np.flatnonzero(table[:, batch.OUTCOME] == UNDECIDED)):
                known[row] = State(
                    float(table[row, batch.LOAD]), slips[row].copy(), stiffs[row],
                    multipliers[row].copy(), ahead=aheads[row],
                )  # fmt: skip
        else:
            for row in range(count):
                state = self._one(rows, row, table, slips, multipliers)
                if state is not None:
                    known[row] = state
        load = table[:, batch.LOAD].copy()
        first = load.copy()
        outcome = table[:, batch.OUTCOME].astype(np.int64)
        events: dict[int, list[Event]] = {}
        residual = np.zeros(count, dtype=np.bool_)
        sliding_at = table[:, batch.POSITION].copy()
        for row in map(int, np.flatnonzero(outcome != SLIDING)):
            sample = sample_of(rows, row, self.setting.pieces)
            if row in known:
                state = known[row]
                fall(self.setting, sample, state)
            else:
                state = at_rest(sample)
            follow(self.setting, sample, state)
            load[row] = state.load
            if state.events:
                events[row] = state.events
            residual[row] = bool(residual_nodes(sample, state.slip).any())
            if state.direction.any():
                sliding_at[row] = main_patch(state.direction)[2] * self.setting.spacing
            if outcome[row] == batch.CORNER_REACHED:
                at_first = state.first or state  # it has none if it could not be followed so far
                self._rewrite(sample, at_first, table[row], multipliers[row])
                first[row] = at_first.load
                if self.slip:
                    slips[row] = at_first.slip
        known_gaps = ~(steepens(self.setting.pieces) & (outcome == batch.CORNER_REACHED))
        self._check(table[known_gaps, batch.GAP], first[known_gaps])
        mean_profile = rows.load_profile.mean()
        values: dict[str, NDArray[Any]] = {
            "critical_load": load,
            "critical_stress": rows.mean_stress(load),
            "first_instability": rows.mean_stress(first),
            "critical_position": table[:, batch.POSITION].copy(),
            "certificate_gap": table[:, batch.GAP] * mean_profile,
            "slip_patches": table[:, batch.PATCHES].astype(np.int64),
            "critical_patch_length": table[:, batch.LENGTH].copy(),
            "arrested_events": np.array([len(events.get(row, ())) for row in range(count)]),
            "residual_reached": residual,
            "sliding_position": sliding_at,
        }
        if self.events:
            values |= self._sequences(rows, events)
        if self.slip:
            values["slip"] = slips
        if self.sensitivity:
            values["sensitivity"] = multipliers * mean_profile
            lost = int(np.isnan(multipliers).any(axis=1).sum())
            if lost:
                warn_accuracy(
                    f"several nodes begin to weaken more steeply at once in {lost} of {count}"
                    " samples: their first instability has no derivative, sensitivity is NaN"
                )
        return values, events

    def _batch(
        self,
        rows: Samples,
        table: Array,
        slips: Array,
        stiffs: Array,
        aheads: Array,
        multipliers: Array,
    ) -> None:
        """Solve the programme of all rows in one compiled loop."""
        setting = self.setting
        rate = np.ascontiguousarray(rows.weakening_rate)
        unusual = rate[np.any(rate != setting.usual_rate, axis=1)]
        solve_batch(
            np.ascontiguousarray(rows.strength - rows.initial_stress),
            np.ascontiguousarray(rows.residual_strength - rows.initial_stress),
            setting.profile, rate, setting.pieces, setting.usual_rate, setting.grid,
            setting.wide_column, setting.usual, setting.windows(unusual), setting.block,
            setting.reach, setting.spacing, setting.modulus, setting.caution, table, slips, stiffs,
            aheads, multipliers, self.slip,
        )  # fmt: skip

    def _one(
        self, rows: Samples, row: int, table: Array, slips: Array, multipliers: Array
    ) -> State | None:
        """Solve the programme of one row on a large grid, and test quickly for arrest.

        Returns the first instability if it is to be followed from there.
        """
        setting = self.setting
        sample = sample_of(rows, row, setting.pieces)
        line = table[row]
        solution = setting.programme(sample.excess, sample.rate)
        if solution is None:  # followed event by event instead
            line[:] = 0.0
            line[batch.GAP] = np.nan
            multipliers[row] = 0.0
            line[batch.OUTCOME] = batch.CORNER_REACHED
            return None
        multipliers[row] = solution.multiplier
        if self.slip:
            slips[row] = solution.slip
        line[batch.LOAD] = solution.load
        line[batch.PATCHES] = count_patches(solution.slip)
        stiff_multiplier = np.empty(setting.nodes)
        line[batch.GAP] = setting.gap(sample.excess, sample.rate, solution, stiff_multiplier)
        _, length, centre = main_patch(solution.multiplier)
        line[batch.POSITION] = centre * setting.spacing
        line[batch.LENGTH] = length * setting.spacing
        if exceeds(sample, solution.slip):
            line[batch.OUTCOME] = batch.CORNER_REACHED
            return None
        ahead = solution.slip.copy()
        line[batch.OUTCOME] = runs_away(
            sample, setting.wide_column, solution.load, ahead, solution.stiff,
            solution.multiplier, stiff_multiplier,
            setting.griffith_length(sample, solution.load), setting.block, setting.reach,
            np.empty((6, setting.nodes)),
        )  # fmt: skip
        if line[batch.OUTCOME] == SLIDING:
            return None
        return State(solution.load, solution.slip, solution.stiff, solution.multiplier, ahead=ahead)

    def _rewrite(self, sample: Sample, state: State, line: Array, multiplier: Array) -> None:
        """Replace what the programme said by what the path to the first instability says."""
        piece, strength, rate = present_pieces(sample, state.slip)
        multiplier[:] = state.direction / max(
            dot(state.direction, sample.profile, sample.profile.size), 1e-300
        )
        line[batch.GAP] = self.setting.gap(
            strength,
            rate,
            Solution(state.load, state.slip, state.stiff, multiplier),
            np.empty(self.setting.nodes),
        )
        if steepens(sample.pieces):  # then no multiplier bounds the load from above
            line[batch.GAP] = np.nan
        line[batch.PATCHES] = count_patches(state.slip)
        _, length, centre = main_patch(multiplier)
        line[batch.POSITION] = centre * self.setting.spacing
        line[batch.LENGTH] = length * self.setting.spacing
        corners = steep_corners(sample, state.slip)
        if corners.size:
            multiplier[:] = self._corner_sensitivity(sample, state.slip, piece, corners)
            return
        # Of a piece that starts from share tau_p + (1 - share) tau_r; the share of the last is 0.
        moving = sample.critical > 0.0
        multiplier[moving] *= sample.pieces.starts[piece[moving]]

    def _corner_sensitivity(
        self, sample: Sample, slip: Array, piece: NDArray[np.int64], corners: NDArray[np.int64]
    ) -> Array:
        """Derivative by the peak strengths of the load at which a node reaches its corner.

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
        matrix = self.setting.grid.column[np.abs(inside[:, None] - inside)]
        matrix[np.diag_indices(inside.size)] -= (pieces.slopes[before] * sample.rate)[inside]
        z = np.linalg.solve(matrix, (inside == node).astype(np.float64))
        share = np.where(sample.critical > 0.0, pieces.starts[before], 1.0)
        derivative[inside] = z * share[inside]
        derivative[node] += pieces.ends[before[node]] * pieces.first / sample.rate[node]
        return derivative / dot(z, sample.profile[inside], inside.size)

    def _sequences(
        self, rows: Samples, events: dict[int, list[Event]]
    ) -> dict[str, NDArray[np.float64]]:
        """The first arrested events of each row, (rows, events) each, nan where there are none."""
        names = ("event_stress", "event_position", "event_length", "event_moment")
        table = np.full((len(names), rows.samples, self.events), np.nan)
        spacing, modulus = self.setting.spacing, self.setting.problem.solid.shear_modulus
        initial = rows.initial_stress.mean(axis=rows.axes)
        for row, several in events.items():
            for i, event in enumerate(several[: self.events]):
                table[:, row, i] = (
                    initial[row] + event.load * rows.load_profile.mean(),
                    event.position * spacing, event.length * spacing,
                    modulus * event.total_slip * spacing,
                )  # fmt: skip
        return dict(zip(names, table, strict=True))

    @staticmethod
    def _check(gap: Array, load: Array) -> None:
        """Warn where the bounds did not close."""
        open_ = ~(gap <= WORST_GAP * load)  # also where there is none
        if open_.any():
            warn_accuracy(
                f"the bounds of the first instability did not close in {int(open_.sum())} of"
                f" {gap.size} samples; the largest gap is {gap[open_].max():.3g} Pa"
            )

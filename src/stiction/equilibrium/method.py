"""Equilibrium as a method: exact quasi-static onset with every interaction."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stiction._model import model
from stiction._typing import Array
from stiction.equilibrium import batch
from stiction.equilibrium.bound import Windows, exact_window, windows_between
from stiction.equilibrium.follow import State, fall, follow, start
from stiction.equilibrium.jump import SLIDING
from stiction.equilibrium.patches import count_patches, main_patch
from stiction.equilibrium.runaway import block_factor
from stiction.equilibrium.spaces import Grid, Sample, make_room
from stiction.equilibrium.stiffness import coupling_strip, stiffness_column
from stiction.errors import InputError
from stiction.problem import Problem
from stiction.results import ONSET_VARIABLES, Variable
from stiction.rows import Rows

LONGEST_RUN = 512
"""Nodes up to which the quick test for arrest follows a run."""

OWN_VARIABLES: dict[str, Variable] = {
    "certificate_gap": Variable("Pa", "distance between the bounds of the first instability"),
    "slip_patches": Variable("1", "number of slipping patches at the first instability"),
    "critical_patch_length": Variable("m", "length of the patch that becomes unstable first"),
    "arrested_events": Variable("1", "number of instabilities that came to rest"),
    "residual_reached": Variable("1", "whether a node was at its residual strength before sliding"),
    "sliding_position": Variable("m", "position of the patch that runs along the whole interface"),
}
SLIP = Variable("m", "slip at the first instability", ("sample", "x"))
SENSITIVITY = Variable(
    "1", "sensitivity of the first instability to the strength at each node", ("sample", "x")
)


class Solver:
    """What is the same for all samples of a problem, and the solution of rows."""

    def __init__(self, problem: Problem, sensitivity: bool = False, slip: bool = False) -> None:
        nodes = problem.interface.nodes
        self.problem = problem
        self.sensitivity = sensitivity
        self.slip = slip
        self.unit = np.pi * problem.effective_modulus / problem.interface.length
        column = stiffness_column(nodes, problem.interface.length, problem.effective_modulus)
        self.grid = Grid(column, coupling_strip(column))
        rate = problem.friction.weakening_rate
        uniform = rate is not None and np.ptp(rate) == 0.0
        self.usual_rate = float(np.max(rate)) if uniform else np.nan
        none = Windows(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((1, 1)))
        self.usual = exact_window(nodes, self.usual_rate, self.unit) if uniform else none
        self.none = none
        self.reach = min(LONGEST_RUN, nodes - 1)
        self.block = block_factor(column, self.reach)
        self.cell = problem.effective_modulus / problem.interface.spacing

    def sample(self, rows: Rows, row: int) -> Sample:
        """One row as the kernels take it."""
        initial = rows.initial_stress[row]
        excess = np.ascontiguousarray(rows.strength[row] - initial)
        floor = np.ascontiguousarray(rows.residual_strength[row] - initial)
        rate = np.array(rows.weakening_rate[row])
        profile = np.array(rows.load_profile)
        return Sample(excess, floor, profile, rate, (excess - floor) / rate)

    def __call__(self, rows: Rows) -> dict[str, NDArray[Any]]:
        """The onset of each row; see `Equilibrium` for what comes back."""
        refuse_overstressed(rows)
        count, nodes = rows.count, rows.nodes
        excess = np.ascontiguousarray(rows.strength - rows.initial_stress)
        floor = np.ascontiguousarray(rows.residual_strength - rows.initial_stress)
        rate = np.ascontiguousarray(rows.weakening_rate)
        profile = np.array(rows.load_profile)
        unusual = rate[np.any(rate != self.usual_rate, axis=1)]
        others = self.none
        if unusual.size:
            others = windows_between(nodes, unusual.min(), unusual.max(), self.unit)
        table = np.empty((count, batch.COLUMNS))
        slips = np.empty((count if self.slip else 0, nodes))
        multipliers = np.empty((count, nodes))
        batch.solve_batch(
            excess, floor, profile, rate, self.usual_rate, self.grid, self.usual, others,
            self.block, self.reach, rows.spacing, self.problem.effective_modulus, table, slips,
            multipliers,
        )  # fmt: skip
        load = table[:, batch.LOAD].copy()
        first = load.copy()
        fate = table[:, batch.FATE].astype(np.int64)
        events = np.zeros(count, dtype=np.int64)
        residual = np.zeros(count, dtype=np.bool_)
        sliding_at = table[:, batch.POSITION].copy()
        for row in np.flatnonzero(fate != SLIDING):
            sample = self.sample(rows, row)
            state = self.follow_row(
                sample, fate[row] == batch.FLOOR_REACHED, float(load[row]), multipliers[row]
            )
            load[row] = state.load
            events[row] = len(state.events)
            residual[row] = bool(np.any(state.slip >= sample.critical * (1.0 - 1e-9)))
            sliding_at[row] = main_patch(state.direction)[2] * rows.spacing
            if fate[row] == batch.FLOOR_REACHED and state.first is not None:
                self._rewrite(sample, state.first, table[row], multipliers[row], rows.spacing)
                first[row] = state.first.load
                if self.slip:
                    slips[row] = state.first.slip
        values: dict[str, NDArray[Any]] = {
            "critical_load": load,
            "critical_stress": rows.mean_stress(load),
            "first_instability": rows.mean_stress(first),
            "critical_position": table[:, batch.POSITION].copy(),
            "certificate_gap": table[:, batch.GAP] * profile.mean(),
            "slip_patches": table[:, batch.PATCHES].astype(np.int64),
            "critical_patch_length": table[:, batch.LENGTH].copy(),
            "arrested_events": events,
            "residual_reached": residual,
            "sliding_position": sliding_at,
        }
        if self.slip:
            values["slip"] = slips
        if self.sensitivity:
            values["sensitivity"] = multipliers * profile.mean()
        return values

    def follow_row(
        self, sample: Sample, from_start: bool, load: float, multiplier: Array
    ) -> State:
        """Follow one sample to global sliding, from rest or from its first instability."""
        if from_start:
            return follow(sample, self.grid, start(sample), self.cell)
        state = self.at_instability(sample, load, multiplier)
        fall(sample, self.grid, state, self.cell, make_room(sample.excess.shape[0]))
        return follow(sample, self.grid, state, self.cell)

    def at_instability(self, sample: Sample, load: float, multiplier: Array) -> State:
        """The least equilibrium at the critical load of the programme."""
        n = sample.excess.shape[0]
        room = make_room(n)
        room.diagonal[:] = self.grid.column[0] - sample.rate
        slip, stiff = np.empty(n), np.empty(n)
        batch.solve_program(
            sample.excess, sample.profile, self.grid, load, load, multiplier.copy(), slip, stiff,
            room,
        )  # fmt: skip
        return State(load, slip, stiff, multiplier.copy())

    def _rewrite(
        self, sample: Sample, state: State, line: Array, multiplier: Array, spacing: float
    ) -> None:
        """Replace what the programme said by what the path to the first instability says."""
        residual = state.slip >= sample.critical * (1.0 - 1e-9)
        strength = np.where(residual, sample.floor, sample.excess)
        rate = np.where(residual, 0.0, sample.rate)
        multiplier[:] = state.direction / np.dot(state.direction, sample.profile)
        present = Sample(strength, sample.floor, sample.profile, rate, sample.critical)
        room = make_room(strength.shape[0])
        line[batch.GAP] = batch.certificate(
            present, self.grid, state.load, state.slip, state.stiff, multiplier, room
        )
        _, length, centre = main_patch(multiplier)
        line[batch.POSITION] = centre * spacing
        line[batch.LENGTH] = length * spacing
        line[batch.PATCHES] = count_patches(state.slip)
        multiplier[residual] = 0.0  # the strength there is tau_r, whatever tau_p


def refuse_overstressed(rows: Rows) -> None:
    """Refuse profiles that slip before any load is applied, naming sample and node."""
    margin = rows.strength - rows.initial_stress
    if margin.min() <= 0.0:
        sample, node = np.unravel_index(int(np.argmin(margin)), margin.shape)
        raise InputError(
            "initial_stress: must be below tau_p everywhere, or the interface slips before it is"
            f" loaded; sample {sample}, node {node}: initial stress"
            f" {rows.initial_stress[sample, node]:g} against {rows.strength[sample, node]:g} Pa"
        )


@model(kw_only=True)
class Equilibrium:
    """Exact quasi-static onset with every interaction between patches, in under a millisecond.

    The load is raised until no equilibrium is left. As long as no node has reached its residual
    strength this is a linear programme, solved to round-off with a certificate; beyond the first
    instability, or where the residual strength is reached before it, events are followed one by
    one. Weakening rate, residual strength, initial stress and load profile may vary along the
    interface.

    Parameters
    ----------
    sensitivity : bool
        Also return d first_instability / d tau_p at every node, at fixed weakening rates.
    slip : bool
        Also return the slip at the first instability.

    Notes
    -----
    Besides the variables of every method: `certificate_gap` (Pa) between rigorous bounds of the
    first instability, `slip_patches` at that moment, `critical_patch_length` (m),
    `arrested_events`, `residual_reached` (whether a node had reached its residual strength before
    the interface let go), and `sliding_position` (m), which differs from `critical_position` only
    after an arrested event. Arrest is decided by equilibrium: inertia may carry a rupture through.
    """

    sensitivity: bool = False
    slip: bool = False
    type: Literal["equilibrium"] = "equilibrium"

    @property
    def chunk_size(self) -> int:
        """Samples that make a good piece of work in an ensemble."""
        return 256

    @property
    def variables(self) -> dict[str, Variable]:
        """What the solver returns for each sample."""
        variables = ONSET_VARIABLES | OWN_VARIABLES
        if self.slip:
            variables["slip"] = SLIP
        if self.sensitivity:
            variables["sensitivity"] = SENSITIVITY
        return variables

    def prepare(self, problem: Problem) -> Callable[[Rows], dict[str, NDArray[Any]]]:
        """A solver for rows of this problem.

        Raises
        ------
        InputError
            From the solver: if the initial stress reaches the strength somewhere.
        """
        return Solver(problem, self.sensitivity, self.slip)

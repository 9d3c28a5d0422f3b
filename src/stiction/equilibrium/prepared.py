"""What is the same for all samples of a problem, and the programme for one of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.line_stiffness import apply_stiffness, coupling_strip, stiffness_column
from stiction.equilibrium.batch import certificate, start_from_bound
from stiction.equilibrium.instability_jump import griffith_length
from stiction.equilibrium.linear_program import OVERFULL, SOLVED, solve_program
from stiction.equilibrium.linear_program_cg import LargeProgram, Solution
from stiction.equilibrium.pieces import pieces_of, refused
from stiction.equilibrium.single_patch_test import block_factor
from stiction.equilibrium.window_bound import Windows, exact_window, window_bound, windows_between
from stiction.equilibrium.workspace import Grid, Sample, make_workspace
from stiction.errors import InputError
from stiction.problem import Problem

LONGEST_RUN = 2048
"""Nodes up to which the quick test for arrest follows a run."""
LARGE_GRID = 4096
"""Nodes from which on the large path may be faster."""
MANY_NODES = 600
"""Nodes weaker than the upper bound of the load from which on it is."""
WIDEST_PATCH = 256
"""Nodes in the nucleation length beyond which a large grid takes too long: the slipping nodes are
too many for a dense factor, and a patch is as wide as a segment of the preconditioner."""
PATIENCE = 1000
"""Iterations of conjugate gradients, all in all, after which the dense factor takes over."""


@dataclass
class Bound:
    """An upper bound of the critical load (Pa) and its multiplier."""

    load: float
    multiplier: Array


class Setting:
    """Stiffness, windows and tables of a problem.

    Parameters
    ----------
    problem : Problem
    nodes : slice
        Nodes of the problem that are taken: all, or every second one.
    prove_sliding : bool
        Whether no length of a rupture counts as unstoppable.
    """

    def __init__(
        self, problem: Problem, nodes: slice = slice(None), prove_sliding: bool = False
    ) -> None:
        if reasons := refused(problem.friction):
            raise InputError(reasons)
        self.problem = problem
        self.pieces = pieces_of(problem.friction)
        self.caution = np.inf if prove_sliding else 1.0
        every = nodes.step or 1
        self.nodes = problem.interface.size // every
        self.spacing = problem.interface.spacing * every
        self.modulus = problem.effective_modulus
        self.unit = np.pi * self.modulus / problem.interface.extent
        rate = problem.friction.weakening_rate
        if rate is not None:
            self.refuse_too_fine(float(np.max(rate)))
        column = stiffness_column(self.nodes, problem.interface.extent, self.modulus)
        self.grid = Grid(column, coupling_strip(column))
        self.wide_column = np.tile(column, 3)
        profile = np.broadcast_to(problem.load_profile, problem.interface.shape)
        self.profile = np.array(profile[nodes], dtype=np.float64)
        uniform = rate is not None and np.ptp(rate) == 0.0
        self.usual_rate = float(np.max(rate)) if uniform else np.nan
        none = Windows(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((1, 1)))
        self.usual = exact_window(self.nodes, self.usual_rate, self.unit) if uniform else none
        self._none = none
        self.reach = min(LONGEST_RUN, self.nodes - 1)
        self.block = block_factor(column, self.reach)

    def refuse_too_fine(self, steepest_rate: float) -> None:
        """`InputError` where a grid is so much too fine that it would take minutes."""
        resolution = self.problem.nucleation_lengths(steepest_rate)[0] / self.spacing
        if self.nodes < LARGE_GRID or resolution <= WIDEST_PATCH:
            return
        share = int(np.ceil(resolution / WIDEST_PATCH))
        raise InputError(
            f"interface.nodes: the nucleation length spans {resolution:.4g} of {self.nodes} nodes;"
            f" on grids of {LARGE_GRID} nodes or more Equilibrium takes at most {WIDEST_PATCH} of"
            " them (it would need minutes a sample, and 64 leave an error of 3e-5). Take"
            f" every {share}th node or fewer, interface.nodes <= {self.nodes // (2 * share) * 2}"
        )

    def griffith_length(self, sample: Sample, load: float) -> float:
        """Griffith's critical length at a load, in nodes, taken with caution."""
        return self.caution * float(griffith_length(sample, load, self.spacing, self.modulus))

    def stiffness(self, field: Array) -> Array:
        """K times a field, (n,) array."""
        result = np.empty(self.nodes)
        members = np.flatnonzero(field)
        workspace = np.empty((2, self.nodes // 2))
        apply_stiffness(
            self.grid.strip, self.grid.column[0], members, members.size, field[members], workspace,
            result,
        )  # fmt: skip
        return result

    def windows(self, rates: Array) -> Windows:
        """Windows for samples whose weakening rates (any shape, Pa/m) are not the usual one."""
        moving = rates[rates > 0.0]
        if moving.size == 0:
            return self._none
        return windows_between(self.nodes, float(moving.min()), float(moving.max()), self.unit)

    def bound(self, excess: Array, rate: Array) -> Bound:
        """The discrete local bound of one sample."""
        usual = bool(np.all((rate == self.usual_rate) | (rate == 0.0)))
        windows = self.usual if usual else self.windows(rate)
        load, start, choice = window_bound(
            excess, self.profile, rate, windows, np.empty((2, self.nodes))
        )
        multiplier = np.empty(self.nodes)
        width = 0 if choice < 0 else int(windows.widths[choice])
        start_from_bound(start, width, windows.modes[max(choice, 0)], multiplier, self.profile)
        return Bound(load, multiplier)

    def is_large(self, excess: Array, bound: Bound) -> bool:
        """Whether a sample is for conjugate gradients rather than for a dense factor."""
        if self.nodes < LARGE_GRID:
            return False
        return bool(np.count_nonzero(excess < bound.load * self.profile) > MANY_NODES)

    def programme(self, excess: Array, rate: Array, cap: float = np.inf) -> Solution | None:
        """Critical load, slip and multiplier of one sample (below `cap`), or None if it stalled.

        Parameters
        ----------
        excess, rate : (n,) arrays
            Strength less initial stress (Pa), weakening rate (Pa/m), 0 where it is residual.
        cap : float
            Load (Pa) not to go beyond.
        """
        bound = self.bound(excess, rate)
        if self.is_large(excess, bound):
            found = self._by_segments(excess, rate, bound, cap, PATIENCE)
            if found is not None:
                return found
        # Also for samples on which conjugate gradients are slow: patches alike, or very wide.
        workspace = make_workspace(self.nodes)
        workspace.diagonal[:] = self.grid.column[0] - rate
        slip, stiff, multiplier = (
            np.empty(self.nodes),
            np.empty(self.nodes),
            bound.multiplier.copy(),
        )
        load, status = solve_program(
            excess, self.profile, self.grid, bound.load, cap, multiplier, slip, stiff, workspace
        )
        if status == SOLVED:
            return Solution(load, slip, stiff, multiplier)
        return self._by_segments(excess, rate, bound, cap) if status == OVERFULL else None

    def _by_segments(
        self, excess: Array, rate: Array, bound: Bound, cap: float, patience: float = np.inf
    ) -> Solution | None:
        found = LargeProgram(
            excess, self.profile, rate, self.grid, bound.load, bound.multiplier, cap
        ).run(patience)
        return found if found.status == SOLVED else None

    def gap(self, excess: Array, rate: Array, solution: Solution, stiff_multiplier: Array) -> float:
        """Distance of the bounds by slip and multiplier, Pa; K y is left in the last argument."""
        sample = Sample(excess, excess, self.profile, rate, excess, self.pieces)
        return float(
            certificate(
                sample, self.grid, solution.slip, solution.stiff, solution.multiplier,
                stiff_multiplier, make_workspace(self.nodes),
            )
        )  # fmt: skip

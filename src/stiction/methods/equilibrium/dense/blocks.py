"""The programme of a specimen: that of a line, with a dense stiffness and windows of its own.

Under dead load all of it holds as on lines. Behind a machine the path is followed event by event:
slip lowers the force, whose largest value may lie before the instability, and where all nodes slip
without one the interface slides stably. Arrest is always decided by following the jump.
"""

from dataclasses import replace

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import warn_accuracy
from stiction.elasticity.places import places_of
from stiction.elasticity.stiffness import make_block_stiffness
from stiction.elasticity.weakest import weakest_place
from stiction.methods.equilibrium.dense.line import LineProgram
from stiction.methods.equilibrium.sample import (
    Outcome,
    State,
    StaticSample,
    present_pieces,
    step_to_corner,
)
from stiction.problem.problem import Problem

RUNG = 1.5
"""Ratio of successive weakening rates whose windows are tried where the rate varies."""
MOST_RUNGS = 12


class BlockProgram(LineProgram):
    """Equilibria of a specimen.

    Parameters
    ----------
    problem : Problem
        With a specimen.
    """

    def _make_stiffness(self, problem: Problem) -> None:
        self.blocks = problem.blocks
        self.machine = self.blocks.relief > 0.0
        self.stops = self.blocks.positive > 0.0
        self.stiffness = make_block_stiffness(self.blocks.stiffness, self.blocks.relief)
        self.own = np.diag(self.blocks.stiffness).copy()
        if self.blocks.positive:
            self.widest_gap = 1e-4
            warn_accuracy(
                "the stiffness of these blocks has positive entries off its diagonal, up to"
                f" {self.blocks.positive:.1g} of the diagonal: that equilibria are the least ones,"
                " and bounds rigorous, is then not proved (docs/specimens.md)"
            )

    def at_rest(self, sample: StaticSample) -> State:
        """Return the state in which the first node is about to slip."""
        return replace(super().at_rest(sample), stuck=self.machine)

    def relief(self, slip: Array) -> float:
        """Return by how much slip lowers the mean stress of the interface, Pa."""
        return float(self.blocks.mean_relief(slip))

    def of_stress(self, sample: StaticSample, state: State, y: Array) -> Array:
        """Return the derivative of the mean stress at an instability from y, that of its drive.

        Until the instability (K - W) d = D q - s on the nodes that slip, none of which rests.
        """
        if not self.machine:
            return y
        rate = present_pieces(sample, state.slip).rate
        slips, q = state.slip > 0.0, sample.profile
        moved = np.zeros(y.size)  # d' of a rise of the drive
        block = self.blocks.stiffness[np.ix_(slips, slips)] - np.diag(rate[slips])
        moved[slips] = np.linalg.solve(block, q[slips])
        return y - self.blocks.relief / y.size * ((q @ moved) * y - moved)

    def travel(self, load: float, slip: Array) -> float:
        """Return the travel of both drives together from the unloaded state, m."""
        force = (load - self.relief(slip)) * self.problem.interface.extent
        return float(self.blocks.travel(force, slip))

    def elongation(self, stress: float) -> float:
        """Return by how much the machine gives at a mean stress of the interface (Pa), m.

        NaN under dead load, whose far end is not defined.
        """
        assert self.problem.specimen is not None
        machine, area = self.problem.specimen.drive.stiffness, self.problem.area
        if machine == 0.0:
            return np.nan
        return 0.0 if area is None else stress * area / machine  # without an area it is rigid

    def next(
        self, sample: StaticSample, state: State | None = None, target: float = np.inf
    ) -> State:
        """Return the next instability, or the state at a load before it; see `LineProgram`."""
        if self.machine:
            state = state or self.at_rest(sample)
        return super().next(sample, state, target)

    def _bound(
        self, sample: StaticSample, multiplier: Array, work: Array
    ) -> tuple[float, float]:
        """Return the bound of the weakest window, or of sliding as a whole under dead load."""
        rates = sample.rate[sample.rate > 0.0]
        low, high = float(rates.min(initial=np.inf)), float(rates.max(initial=0.0))
        best = float(sample.excess.sum() / sample.profile.sum())
        multiplier[:] = 1.0
        steps = 0
        if low < high * (1.0 - 1e-12):
            steps = min(int(np.ceil(np.log(high / low) / np.log(RUNG))), MOST_RUNGS)
        for step in range(steps + 1 if high > 0.0 else 0):
            places = places_of(self.blocks, low if steps == 0 else _rung(high, step))
            load, choice = weakest_place(
                sample.excess, sample.profile, sample.rate, places, work
            )
            if load < best:
                best = load
                multiplier[:] = 0.0
                first, width = places.starts[choice], places.widths[choice]
                multiplier[first : first + width] = places.modes[choice, :width]
        multiplier /= multiplier @ sample.profile
        return best, np.inf if steps == 0 else -np.inf

    def _by_transforms(self, sample: StaticSample, state: State | None) -> State | None:
        """Return None: a specimen has no transforms."""
        return None

    def _runs_away(self, sample: StaticSample, found: State, slip: Array) -> tuple[int, float]:
        """Move the slip on as far as the unstable direction goes; the jump decides."""
        step = step_to_corner(sample, slip, found.direction, np.inf)
        return (Outcome.SLIDING if step == np.inf else Outcome.UNDECIDED), np.inf


def _rung(rate: float, step: int) -> float:
    """Return a rate of a fixed ladder, the same for all samples: `step` below the first."""
    return float(RUNG ** (np.floor(np.log(rate) / np.log(RUNG)) - step))

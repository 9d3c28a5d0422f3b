"""Ruptures on specimens: the path of equilibria, whose instabilities run with inertia."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.variables import Variable
from stiction.methods.dynamics.event import Event, begin
from stiction.methods.dynamics.mesh import make_mesh
from stiction.methods.dynamics.summary import SPEEDS, rupture_speed
from stiction.methods.equilibrium.dense.cholesky import Course
from stiction.methods.equilibrium.dense.jump import jump
from stiction.methods.equilibrium.dense.program import DenseProgram
from stiction.methods.equilibrium.method import Equilibrium
from stiction.methods.equilibrium.sample import Jump, Outcome, State, StaticSample, refused
from stiction.methods.equilibrium.solver import OnsetSolver, Path
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample

RATES = (
    "loading_rate", "load", "end_time", "kernel_tolerance", "slip_step", "load_step", "implicit",
    "start", "stop",
)  # fmt: skip
"""Options of `Rupture` between half-spaces, under a load that rises in time."""


def refusals(method: Any, problem: Problem) -> list[str]:
    """Return the reasons why a rupture cannot run on the specimen of a problem."""
    usual = type(method)()
    given = [name for name in RATES if getattr(method, name) != getattr(usual, name)]
    reasons = [
        f"{name}: means nothing on a specimen, which is loaded slowly between events; leave it out"
        for name in given
    ]
    return reasons + refused(problem.friction)


def variables(method: Any, problem: Problem) -> dict[str, Variable]:
    """Return the variables of a sample of a specimen."""
    return Equilibrium(events=method.events).variables(problem) | SPEEDS


class RuptureProgram(DenseProgram):
    """Equilibria of a specimen between which waves run through the blocks.

    Between events loading is slow. Where a wave carried slip beyond the next equilibrium, nodes
    rest below their strength afterwards: the path counts them as stopped.

    Parameters
    ----------
    problem : Problem
        With a specimen.
    method : Rupture
    """

    def __init__(self, problem: Problem, method: Any) -> None:
        super().__init__(problem)
        self.stops = True
        self.mesh, self.max_steps = make_mesh(problem, method.courant), method.max_steps
        law = problem.friction
        self.arrival = min(law.slip_at(1.0 - method.arrival), law.reach) / law.reach

    def event(self, sample: StaticSample, found: State) -> Event:
        """Return an event that is about to run from an instability."""
        return begin(sample, self.mesh, self.problem.blocks.stiffness, found, self.arrival)

    def jump(self, sample: StaticSample, found: State) -> Jump:
        """Let an unstable state run until it rests, or all of it slides."""
        event = self.event(sample, found)
        event.run(self.max_steps)
        slip = event.waves.slip
        stiff: Array = self.problem.blocks.stiffness @ slip
        outcome: int = Outcome.SLIDING
        if not event.slides:  # what still moves once the waves have died away comes to rest
            elastic, true = self._workspaces
            course = Course(sample, slip, stiff, elastic, self.stops)
            outcome = jump(course, found.load, np.inf, true)
        state = State(
            found.load, slip, found.direction, stiff, by_events=True, jumped=True, stopped=True
        )
        arrested, known = outcome == Outcome.ARRESTED, outcome != Outcome.UNDECIDED
        return Jump(arrested, known, state, arrival=event.waves.arrival)


class RuptureSolver(OnsetSolver):
    """Solves samples of a specimen; safe in several threads."""

    program: RuptureProgram

    def __init__(self, problem: Problem, events: int, program: RuptureProgram) -> None:
        super().__init__(problem, Equilibrium(events=events), program)

    def __call__(self, rows: Sample) -> dict[str, NDArray[Any]]:
        """Return the onset of each sample; see `Rupture`."""
        refuse_barriers(rows)
        return super().__call__(rows)

    def _values(
        self, rows: Sample, row: int, sample: StaticSample, path: Path
    ) -> dict[str, Any]:
        speeds = dict.fromkeys(SPEEDS, np.nan)
        if path.arrival is not None:
            speeds = front_speeds(self.problem, rows.steepest_rate, path.arrival)
        return super()._values(rows, row, sample, path) | speeds


def refuse_barriers(rows: Sample) -> None:
    """Refuse what only half-spaces take: infinite strength, and stress above the strength."""
    if not np.isfinite(rows.strength).all():
        raise InputError(
            "strength: barriers that never break (infinite strength) are taken between half-spaces"
            " only; give a finite strength, such as ten times the others"
        )
    if np.any(rows.strength < rows.initial_stress):
        raise InputError(
            "initial_stress: is above the strength, which is taken between half-spaces only; on"
            " specimens lower it"
        )


def front_speeds(problem: Problem, steepest_rate: float, arrival: Array) -> dict[str, float]:
    """Return the largest speed of a front over 2 h_n and the median one over h_n/2, m/s."""
    spacing, length = problem.interface.spacing, problem.interface.extent
    nucleation = problem.nucleation_lengths(steepest_rate)[0]
    found = []
    for lengths, statistic in ((2.0, np.max), (0.5, np.median)):
        window = min(max(lengths * nucleation, 8.0 * spacing), 0.25 * length)
        ends = np.full(round(window / spacing), np.nan)  # fronts do not run round
        speeds = rupture_speed(np.concatenate([arrival, ends]), spacing, window)
        speeds = speeds[np.isfinite(speeds)]
        found.append(float(statistic(speeds)) if speeds.size else np.nan)
    return dict(zip(SPEEDS, found, strict=True))

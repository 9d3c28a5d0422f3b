"""Ruptures on specimens: a path of equilibria, with inertia during instabilities.

Problem
-------
A specimen is loaded slowly. Its slip follows the equilibria of
`methods.equilibrium` up to an instability. From there waves run through
the blocks (`waves`), until all is at rest or the whole interface
slides. Then the path continues from the final state of the waves.

Algorithm of an event: our own
------------------------------
1. Begin at the static state that becomes unstable. Raise the drive
   slightly, because it continues to rise, and let slip grow slightly
   along the unstable direction (`begin`).
2. Follow the waves. The block is at rest when no node slips while shear
   waves cross the block and return (`DynamicEvent.run`).
3. Let slip that is still under way come to rest in a static state
   (`RuptureSearch.jump`). Nodes that waves carried beyond this
   equilibrium count as stopped.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.variables import Variable
from stiction.methods.dynamics.mesh import Mesh, make_mesh
from stiction.methods.dynamics.state import UNSTABLE_STRESS
from stiction.methods.dynamics.summary import SPEEDS, front_speeds
from stiction.methods.dynamics.waves import Waves, block_at_rest, wave_steps
from stiction.methods.equilibrium.dense.cholesky import SlipState
from stiction.methods.equilibrium.dense.jump import jump
from stiction.methods.equilibrium.dense.search import DenseSearch
from stiction.methods.equilibrium.events import event_variables, of_samples
from stiction.methods.equilibrium.method import Equilibrium
from stiction.methods.equilibrium.solver import OnsetSolver, SamplePath, refused
from stiction.methods.equilibrium.state import (
    EquilibriumState,
    Jump,
    Outcome,
    PathStatus,
    Route,
)
from stiction.methods.equilibrium.strength import StaticSample
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample
from stiction.problem.specimen import Slider

OPTIONS = ("courant", "arrival", "max_steps", "events")
"""Options of `Rupture` with an effect on specimens. Other options need
a load that rises in time."""
LOAD_RISE = 1e-5
"""Rise of the drive in an event, as a fraction of the mean strength
drop."""
INITIAL_GROWTH = 1e-3
"""Largest growth of the slip at the start, as a fraction of d_c."""
RESTING_SLIP = 1e-4
"""Fraction of the largest slip of an event below which a node counts as
resting."""
CHECKS_PER_WINDOW = 8
"""Number of checks for rest while shear waves cross the block and
return."""


def refusals(method: Any, problem: Problem) -> list[str]:
    """Return the reasons why a rupture cannot run on the specimen of a problem."""
    if isinstance(problem.specimen, Slider):
        return [
            "problem.specimen: waves run through two equal blocks only, whose pressure does not"
            " change. Use st.Equilibrium()"
        ]
    # An option with its default value was not asked for.
    usual = type(method)()
    reasons = [
        f"{name}: has no effect on a specimen, which is loaded slowly. Leave it out"
        for name, value in vars(method).items()
        if name not in OPTIONS and value != getattr(usual, name)
    ]
    return reasons + refused(problem)


def variables(method: Any, problem: Problem) -> dict[str, Variable]:
    """Return the variables of the results on a specimen."""
    known = Equilibrium().variables(problem) | SPEEDS
    if method.events:
        known |= of_samples(event_variables(problem.interface, inertia=True))
    return known


@dataclass
class DynamicEvent:
    """An instability of a specimen, with waves.

    Attributes
    ----------
    before : EquilibriumState
        The equilibrium that became unstable.
    start : (n,) array
        Stress in the static state at the start, minus the initial
        stress, Pa.
    front : (n,) array
        Slip, m, at which the front arrives at a node. The front does
        not arrive again at a node that has already slipped so far.
    slides : bool
        Whether every node has slipped.
    steps : int
        Number of steps taken so far.
    """

    sample: StaticSample
    mesh: Mesh
    before: EquilibriumState
    start: Array
    waves: Waves
    front: Array
    slides: bool = False
    steps: int = 0

    def take_steps(self, count: int, ends: bool = True) -> bool:
        """Take `count` steps.

        With `ends`, stop earlier if all nodes have slipped.

        Return whether a node has not slipped yet.
        """
        sample, waves = self.sample, self.waves
        self.steps += wave_steps(sample, self.start, self.front, self.mesh, waves, count, ends)
        self.slides = bool((waves.slip > 0.0).all())
        return not self.slides

    def run(self, max_steps: int) -> None:
        """Step 2: take steps until all is at rest or all nodes have slipped."""
        # Slip at the last checks, which together span a window.
        slips = deque([self.waves.slip.copy()], maxlen=CHECKS_PER_WINDOW + 1)
        while self.take_steps(-(-self.mesh.window // CHECKS_PER_WINDOW)):
            slips.append(self.waves.slip.copy())
            added = float((slips[-1] - slips[0]).max())
            largest = float((slips[-1] - self.before.slip).max())
            if len(slips) > CHECKS_PER_WINDOW and added <= RESTING_SLIP * largest:
                return
            if self.steps > max_steps:
                raise InputError(
                    f"max_steps: an event has not come to rest after {self.steps} steps. Raise"
                    " max_steps, or lower specimen.quality_factor"
                )


def begin(
    sample: StaticSample, mesh: Mesh, stiffness: Array, before: EquilibriumState, arrival: float
) -> DynamicEvent:
    """Step 1: return an event that is about to run.

    `arrival` is the slip, over d_c,
    at which a front counts as arrived.
    """
    can_break = np.isfinite(sample.excess)
    fall = (sample.excess - sample.residual)[can_break]
    load = before.load + LOAD_RISE * float(fall.mean() / sample.profile[can_break].mean())
    # Scale the unstable direction by the node that grows fastest.
    z = before.direction
    fastest = int(np.argmax(z))
    growth = INITIAL_GROWTH * sample.critical[fastest] / max(float(z[fastest]), 1e-300)
    slip = before.slip + growth * z
    start = load * sample.profile - stiffness @ slip
    # The initial growth is not the arrival of a front: put the
    # threshold just above it.
    front = arrival * sample.critical
    front = np.where(before.slip < front, np.maximum(front, slip * (1.0 + 1e-12)), front)
    waves = block_at_rest(mesh, slip)
    waves.now["fast_slip_rate"] = UNSTABLE_STRESS * float(np.median(fall)) / mesh.impedance
    return DynamicEvent(sample, mesh, before, start, waves, front)


class RuptureSearch(DenseSearch):
    """Search for equilibria of a specimen, with waves between equilibria.

    Between events loading is slow. Nodes that waves carried beyond the
    next equilibrium then rest below their strength.

    Parameters
    ----------
    problem : Problem
        A problem with a specimen.
    method : Rupture
    """

    def __init__(self, problem: Problem, method: Any) -> None:
        super().__init__(problem)
        self.may_stop = True  # waves leave nodes at rest below their strength
        self.mesh, self.max_steps = make_mesh(problem, method.courant), method.max_steps
        law = problem.friction
        self.arrival = min(law.slip_at(1.0 - method.arrival), law.reach) / law.reach

    def event(self, sample: StaticSample, unstable: EquilibriumState) -> DynamicEvent:
        """Return an event that is about to run from an instability."""
        return begin(sample, self.mesh, self.problem.blocks.stiffness, unstable, self.arrival)

    def jump(
        self, sample: StaticSample, unstable: EquilibriumState, to_rest: bool = False
    ) -> Jump:
        """Let an unstable state run until it rests or the interface slides (steps 1 to 3)."""
        event = self.event(sample, unstable)
        event.run(self.max_steps)
        slip = event.waves.slip
        stiff: Array = self.problem.blocks.stiffness @ slip
        outcome = Outcome.SLIDING
        # 3. Slip that is still under way comes to rest without inertia.
        if not event.slides:
            elastic, true = self._workspaces
            slip_state = SlipState(sample, slip, stiff, elastic, self.may_stop, self.ends)
            outcome = jump(slip_state, unstable.load, np.inf, true)
        state = EquilibriumState(
            unstable.load, slip, unstable.direction, stiff, PathStatus.STABLE, Route.EVENTS,
            stopped=True,
        )  # fmt: skip
        now = event.waves.now
        duration = now["fast_until"] - now["fast_since"] if now["fast"] else np.nan
        return Jump(outcome, state, event.waves.arrival, {"event_duration": duration})


class RuptureSolver(OnsetSolver):
    """Thread-safe solver for samples of a specimen with inertia."""

    search: RuptureSearch
    inertia = True

    def __init__(self, problem: Problem, events: int, search: RuptureSearch) -> None:
        super().__init__(problem, Equilibrium(events=events), search)

    def __call__(self, rows: Sample) -> dict[str, NDArray[Any]]:
        """Return the variables of `Rupture`.

        The first dimension of each is the sample.
        """
        refuse_overstress(rows)
        return super().__call__(rows)

    def _values(
        self, rows: Sample, row: int, sample: StaticSample, path: SamplePath
    ) -> dict[str, Any]:
        speeds = dict.fromkeys(SPEEDS, np.nan)
        if path.arrival is not None:
            length = self.problem.nucleation_lengths(rows.steepest_weakening_rate)[0]
            speeds = front_speeds(self.problem.interface, 0, path.arrival, length)
        return super()._values(rows, row, sample, path) | speeds


def refuse_overstress(rows: Sample) -> None:
    """Raise an `InputError` for stress above the strength, which only half-spaces accept."""
    if np.any(rows.strength < rows.initial_stress):
        raise InputError("initial_stress: must not be above the strength of a specimen")

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
    """Return the reasons why a rupture cannot run on the specimen of a problem.

    >>> from types import SimpleNamespace
    >>> import stiction as st
    >>> problem = SimpleNamespace(friction=st.LinearWeakening(4.0), specimen=None)
    >>> refusals(
    ...     st.Rupture(courant=0.5, arrival=0.1, max_steps=9, events=2), problem
    ... )
    []
    >>> [
    ...     reason[:28]
    ...     for reason in refusals(
    ...         st.Rupture(loading_rate=1e6, start="rest"), problem
    ...     )
    ... ]
    ['loading_rate: has no effect ', 'start: has no effect on a sp']
    >>> problem.friction = st.ExponentialWeakening(4.0)
    >>> [reason[:30] for reason in refusals(st.Rupture(), problem)]
    ['friction: ExponentialWeakening']
    >>> problem.specimen = Slider.__new__(Slider)
    >>> [reason[:44] for reason in refusals(st.Rupture(loading_rate=1e6), problem)]
    ['problem.specimen: waves run through two equa']
    """
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
    """Return the variables of the results on a specimen.

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.problem.interface import Interface
    >>> solver = SimpleNamespace(variables=lambda problem: {"critical_load": None})
    >>> plain = FunctionType(
    ...     variables.__code__, globals() | {"Equilibrium": lambda: solver}
    ... )
    >>> problem = SimpleNamespace(interface=Interface(0.8, 8, ends="free"))
    >>> [*plain(SimpleNamespace(events=0), problem)]
    ['critical_load', 'rupture_speed', 'median_rupture_speed']
    >>> plain(SimpleNamespace(events=2), problem)["event_duration"].dims
    ('sample', 'event')
    """
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

        >>> from types import FunctionType, SimpleNamespace
        >>> names = globals() | {"wave_steps": lambda *given: given[5] - 2 * given[6]}
        >>> plain = FunctionType(DynamicEvent.take_steps.__code__, names)
        >>> waves = SimpleNamespace(slip=np.array([0.5, 0.0]))
        >>> event = DynamicEvent(None, None, None, None, waves, None, steps=10)
        >>> (
        ...     plain(event, 5, True),
        ...     event.steps,
        ...     event.slides,
        ... )  # a node has not slipped yet
        (True, 13, False)
        >>> waves.slip[1] = 0.1
        >>> plain(event, 5, False), event.steps, event.slides
        (False, 18, True)
        """
        sample, waves = self.sample, self.waves
        self.steps += wave_steps(sample, self.start, self.front, self.mesh, waves, count, ends)
        self.slides = bool((waves.slip > 0.0).all())
        return not self.slides

    def run(self, max_steps: int) -> None:
        """Step 2: take steps until all is at rest or all nodes have slipped.

        There is a check after every second step out of a window of 16. The event
        slips by 2 m, and by 0.25 mm more at the fifth check. This is more than
        1e-4 times 2 m, so the block rests eight checks later. Without such growth
        it rests as soon as the checks span a window.

        >>> from types import SimpleNamespace
        >>> class Scripted(DynamicEvent):
        ...     def take_steps(self, count, ends=True):
        ...         self.steps += count
        ...         self.waves.slip[0] = 3.0 if self.steps < 10 else 3.0 + grown
        ...         return self.steps < 100
        >>> before = SimpleNamespace(slip=np.array([1.0, 1.0]))
        >>> waves = SimpleNamespace(slip=np.array([1.0, 1.0]))
        >>> event = Scripted(None, SimpleNamespace(window=15), before, None, waves, None)
        >>> for grown in (0.25e-3, 0.15e-3):
        ...     waves.slip[:], event.steps = 1.0, 0
        ...     event.run(1000)
        ...     print(event.steps)
        26
        18
        >>> waves.slip[:], event.steps = 1.0, 0
        >>> event.run(13)  # doctest: +ELLIPSIS
        Traceback (most recent call last):
            ...
        stiction.base.errors.InputError: max_steps: an event has not come to rest after 14 steps...
        """
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

    The drops are 4 and 5 Pa, so the load rises by 1e-5 * 4.5/2 Pa. Node 1 grows
    fastest, by 1e-3 * 4 m. At node 0 this growth passes half of d_c, and must not
    count as an arrival.

    >>> from types import SimpleNamespace
    >>> excess, residual = np.array([5.0, 7.0, np.inf]), np.array([1.0, 2.0, 0.0])
    >>> sample = SimpleNamespace(excess=excess, residual=residual)
    >>> sample.profile, sample.critical = (
    ...     np.array([1.0, 3.0, 5.0]),
    ...     np.array([2.0, 4.0, np.inf]),
    ... )
    >>> before = SimpleNamespace(load=10.0, slip=np.array([0.999, 2.5, 0.0]))
    >>> before.direction, mesh = (
    ...     np.array([0.25, 0.5, 0.0]),
    ...     SimpleNamespace(heights=np.zeros(2)),
    ... )
    >>> stiffness = np.array([[2.0, -1.0, 0.0], [-1.0, 3.0, 0.0], [0.0, -2.0, 2.0]])
    >>> mesh.impedance = 2.0
    >>> event = begin(sample, mesh, stiffness, before, 0.5)
    >>> event.waves.slip.round(9).tolist(), event.front.round(9).tolist()
    ([1.001, 2.504, 0.0], [1.001, 2.0, inf])
    >>> bool(event.front[0] > event.waves.slip[0])
    True
    >>> stress = (10.0 + 2.25e-5) * sample.profile - [-0.502, 6.511, -5.008]
    >>> np.allclose(event.start, stress, rtol=1e-9)
    True
    >>> round(float(event.waves.now["fast_slip_rate"]), 9)  # 0.075 * 4.5/2
    0.16875
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
        """Let an unstable state run until it rests or the interface slides (steps 1 to 3).

        The waves are scripted. Slip that is still under way comes to rest, with a
        given outcome.

        >>> from types import FunctionType, SimpleNamespace
        >>> names = globals() | {"jump": lambda state, load, *others: Outcome.ARRESTED}
        >>> names["SlipState"] = lambda *given: None
        >>> plain = FunctionType(RuptureSearch.jump.__code__, names)
        >>> now = {"fast": 1, "fast_since": 2.0, "fast_until": 5.0}
        >>> waves = SimpleNamespace(slip=np.array([1.0, 2.0]), now=now)
        >>> waves.arrival = np.array([0.5, 0.75])
        >>> event = SimpleNamespace(waves=waves, slides=True, run=lambda max_steps: None)
        >>> search = SimpleNamespace(event=lambda *given: event, max_steps=9, ends=True)
        >>> search._workspaces = 1, 2
        >>> search.problem = SimpleNamespace(
        ...     blocks=SimpleNamespace(stiffness=np.diag([3.0, 4.0]))
        ... )
        >>> unstable = SimpleNamespace(load=7.0, direction=np.array([0.0, 1.0]))
        >>> search.may_stop = True
        >>> result = plain(search, None, unstable, False)
        >>> (
        ...     result.outcome.name,
        ...     result.state.Kd.tolist(),
        ...     result.known,
        ...     result.state.status.name,
        ... )
        ('SLIDING', [3.0, 8.0], {'event_duration': 3.0}, 'STABLE')
        >>> event.slides, now["fast"] = False, 0
        >>> result = plain(search, None, unstable, False)
        >>> (
        ...     result.outcome.name,
        ...     result.known,
        ...     result.arrival.tolist(),
        ...     result.state.stopped,
        ... )
        ('ARRESTED', {'event_duration': nan}, [0.5, 0.75], True)
        """
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
    """Raise an `InputError` for stress above the strength, which only half-spaces accept.

    >>> from types import SimpleNamespace
    >>> rows = SimpleNamespace(
    ...     strength=np.array([5.0, 4.0]), initial_stress=np.array([5.0, 3.0])
    ... )
    >>> refuse_overstress(rows)
    >>> rows.initial_stress[1] = 4.1
    >>> refuse_overstress(rows)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: initial_stress: must not be above the strength of a specimen
    """
    if np.any(rows.strength < rows.initial_stress):
        raise InputError("initial_stress: must not be above the strength of a specimen")

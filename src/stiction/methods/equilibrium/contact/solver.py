"""Onsets, events and paths of sliders, as `Equilibrium` gives them.

Loads and forces are divided by the length of the interface: the mean shear stress, Pa. The load
D is the push that the machine would exert without slip. Slip and travel count from the beginning
of the push, and opening is the present opening. The travel of the push is U = F/C + T'x (`Rig`),
without the constant part from the pressing.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy, warn_of_samples
from stiction.base.variables import Variable
from stiction.elasticity.rig import on_cells
from stiction.methods.equilibrium.contact.path import N_STACKED, Status, follow
from stiction.methods.equilibrium.contact.stages import (
    Friction,
    begin_push,
    forces_of,
    make_matrices,
    press,
)
from stiction.methods.equilibrium.events import (
    elongation_of,
    event_variables,
    patch_measures,
    tabulate,
)
from stiction.methods.equilibrium.patches import critical_patch, patches_of
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem
from stiction.problem.resolution import warn_if_coarse
from stiction.problem.results import along
from stiction.problem.sample import Sample

OF_SLIDERS = {
    "open_fraction": Variable("1", "part of the interface that is open before it slides"),
}
ON_PATH = {
    "pressure": Variable("Pa", "normal pressure", ("load",)),
    "opening": Variable("m", "opening, the mean of both edges of a node", ("load",)),
}
WITH_FIXED_PRESSURE = {"event_energy_stress_drop", "event_fracture_energy"}
"""Variables of events that are defined for a pressure that does not change."""
STRENGTH_STEP = 1e-7
"""Rise of a friction coefficient in a difference quotient."""
MIN_NODES = 16
"""Nodes in a nucleation length without a warning about the ends of the slider."""
MIN_TURNING = 1e-6
"""Opening over slip of a slider that topples, in the motion that does not end."""


class PushState(NamedTuple):
    """A slider under a load D and a force F (N/m), with arrays over cells, then edges (m,)."""

    load: float
    force: float
    moved: Array  # slip of the push, and opening, m
    forces: Array  # shear force, and tension of edges, N/m
    direction: Array  # (n,): rate of slip
    residual: bool  # whether a cell has reached its residual strength


class Push(NamedTuple):
    """The push of a sample until it slides. Without an instability, `first` is None.

    `last` is the last equilibrium, and `peak` the largest force (N/m). `events` holds the states
    before and after each. `known` is false if the path was not followed to its end.
    """

    first: PushState | None
    last: PushState
    peak: float
    events: list[tuple[PushState, PushState]]
    known: bool
    topples: bool


def push_variables(interface: Interface) -> dict[str, Variable]:
    """Return the variables of the events of a slider."""
    variables = event_variables(interface)
    return {name: variables[name] for name in variables if name not in WITH_FIXED_PRESSURE}


def refused_laws(problem: Problem) -> list[str]:
    """Return why a slider cannot take its friction law, or an empty list."""
    text = "friction: the strength of a slider falls linearly with slip. Use"
    text += " st.LinearWeakening(weakening_rate=...)"
    return [] if problem.friction.linear else [text]


class SliderPath:
    """A slider on its path, which only goes on."""

    def __init__(self, solver: "SliderSolver", friction: Friction, force: float) -> None:
        start = press(solver.for_pressing, friction, force)
        self.friction, self.contact = friction, begin_push(solver.for_push, start)
        self.before = np.abs(start.moved)
        self.before[len(friction.peak) :] = 0.0
        self.load = self.force = self.peak = 0.0

    def move(self, target: float = np.inf) -> int:
        """Go on to a load, or to the next instability or arrest. Return the `Status`."""
        stop = follow(self.contact, self.load, self.force, self.peak, target)
        self.load, self.force, self.peak, status = stop
        return int(status)

    def state(self) -> PushState:
        """Return a copy of the present state."""
        contact, law = self.contact, self.friction
        direction = np.maximum(contact.rate[: len(law.peak)], 0.0)
        at_residual = bool(((contact.difference == 0.0) & (law.peak > law.residual)).any())
        moved, forces = contact.moved - self.before, forces_of(contact, law)
        return PushState(self.load, self.force, moved, forces, direction, at_residual)

    def follow(self) -> Push:
        """Follow the path until the slider slides."""
        events, first = [], None
        while (status := self.move()) == Status.UNSTABLE:
            last = self.state()
            first = first or last
            if (status := self.move()) != Status.ARRESTED:
                break
            events.append((last, self.state()))
        unstable = self.contact.counts[N_STACKED] > 0  # otherwise it slides stably
        last = last if unstable else self.state()
        rate, n = np.abs(self.contact.rate), len(self.friction.peak)
        known = status == Status.SLIDING
        turns = bool(rate[n:].max() > MIN_TURNING * rate[:n].max())
        return Push(first, last, self.peak, events, known, known and unstable and turns)


class SliderSolver:
    """Solver for samples of a slider by `Equilibrium` with given options. It is thread-safe."""

    def __init__(self, problem: Problem, options: Any = None) -> None:
        if reasons := refused_laws(problem):
            raise InputError(reasons)
        rig, machine = problem.rig, problem.specimen.machine  # type: ignore[union-attr]
        relief = rig.C / (1.0 + rig.C / machine) if machine > 0.0 else 0.0
        self.problem, self.options, self.rig = problem, options, rig
        self.length = problem.interface.measure
        self.for_pressing = make_matrices(rig.K, rig.T_p)
        self.for_push = make_matrices(rig.K, rig.T, relief)

    def __call__(self, rows: Sample) -> dict[str, NDArray[Any]]:
        """Return the variables of `Equilibrium`. The first dimension of each is the sample."""
        warn_if_coarse(
            self.problem,
            rows.steepest_weakening_rate,
            MIN_NODES,
            "stress is singular at the ends of the slider. At 17 nodes, twice as many move static"
            " friction by up to 0.04 % and the first instability by up to 0.5 %",
        )
        pushes = [self.path(rows, row).follow() for row in range(rows.samples)]
        table = [self._values(rows, row, push) for row, push in enumerate(pushes)]
        warn_of_samples(
            "the path was not followed to its end in {samples}: static friction is a lower bound",
            np.array([not push.known for push in pushes]),
        )
        warn_of_samples(
            "the slider topples before it slides in {samples}: static friction is the force at"
            " which it topples. Push lower",
            np.array([push.topples for push in pushes]),
        )
        warn_of_samples(
            "no patch becomes unstable in {samples}: the machine is so stiff that the slider slides"
            " stably, and first_instability is NaN",
            np.array([push.first is None for push in pushes]),
        )
        return {name: np.array([values[name] for values in table]) for name in table[0]}

    def path(self, rows: Sample, row: int, node: int = 0, step: float = 0.0) -> SliderPath:
        """Return a sample before the push, whose friction coefficient has a step at a node."""
        pressure, spacing = rows.normal_pressure[row], self.problem.interface.spacing
        peak, residual = rows.strength[row] / pressure, rows.residual_strength[row] / pressure
        peak[node] += step
        friction = Friction(peak, residual, rows.weakening_rate[row] * spacing)
        return SliderPath(self, friction, float(pressure.mean()) * self.length)

    def _values(self, rows: Sample, row: int, push: Push) -> dict[str, Any]:
        interface, first, last = self.problem.interface, push.first, push.last
        n = interface.size
        direction = np.zeros(n) if first is None else first.direction
        slip = np.zeros(n) if first is None else first.moved[:n]
        patch = critical_patch(direction, interface)
        values: dict[str, Any] = {
            "critical_load": last.load / self.length,
            "critical_stress": push.peak / self.length,
            "first_instability": np.nan if first is None else first.force / self.length,
            "certificate_gap": np.nan,
            "critical_position": patch.centre[0],
            "critical_patch_length": patch.area,
            "sliding_position": critical_patch(last.direction, interface).centre[0],
            "slip_patches": patches_of(slip, interface),
            "arrested_events": len(push.events),
            "residual_reached": last.residual,
            "open_fraction": float(np.trapezoid(last.moved[n:] > 0.0) / n),
        }
        if self.options.slip:
            values["slip"] = slip
        if self.options.sensitivity:
            # Between events paths are straight, so a small step gives the exact derivative.
            values["sensitivity"] = np.full(n, np.nan)
            for node in range(n if first else 0):
                path = self.path(rows, row, node, STRENGTH_STEP)
                path.move()
                rise = (path.force - first.force) / self.length  # type: ignore[union-attr]
                step = STRENGTH_STEP * rows.normal_pressure[row, node]
                values["sensitivity"][node] = rise / step
        if most := self.options.events:
            values |= self.event_table(push, most)
        return values

    def travels(self, state: PushState) -> dict[str, float]:
        """Return the mean stress (Pa), and the travels of the push and of the machine (m)."""
        stress, travel = state.force / self.length, state.force / self.rig.C
        travel += float(self.rig.T @ state.moved)
        far = travel + elongation_of(self.problem, stress)
        return {"mean_stress": stress, "travel": travel, "crosshead_travel": far}

    def profiles(self, state: PushState) -> dict[str, Array]:
        """Return slip and opening (m), shear stress and pressure (Pa) at the nodes."""
        n, spacing = self.problem.interface.size, self.problem.interface.spacing
        return {
            "slip": state.moved[:n],
            "stress": state.forces[:n] / spacing,
            "pressure": on_cells(-state.forces[n:]) / spacing,
            "opening": 0.5 * (state.moved[n:-1] + state.moved[n + 1 :]),
        }

    def event_table(self, push: Push, most: int | None = None) -> dict[str, Array]:
        """Return the variables of events as arrays, padded with NaN to `most` events."""
        measured, interface = [], self.problem.interface
        for before, after in push.events[:most]:
            added = (after.moved - before.moved)[: interface.size]
            drop = (before.forces - after.forces)[: interface.size] / interface.spacing
            stress, travel, far = self.travels(before).values()
            values = patch_measures(self.problem, before.direction, added, drop)
            measured.append(values | {
                "event_load": before.load / self.length,
                "event_stress": stress,
                "event_stress_drop": stress - after.force / self.length,
                "event_travel": travel,
                "event_crosshead_travel": far,
                "event_travel_step": self.travels(after)["travel"] - travel,
            })  # fmt: skip
        return tabulate(measured, push_variables(interface), most)

    def at_loads(
        self, rows: Sample, loads: Array
    ) -> tuple[dict[str, Array], dict[str, Variable]]:
        """Return values and further variables of `equilibrium_path` at rising loads, Pa."""
        interface = self.problem.interface
        # The path to sliding gives all events, and a second path the states at the loads.
        push, path = self.path(rows, 0).follow(), self.path(rows, 0)
        if not push.known:
            warn_accuracy(
                f"the path was not followed beyond {push.last.load / self.length:g} Pa"
            )
        sliding, states = loads * self.length > push.last.load, []
        for load in loads[~sliding]:
            while (status := path.move(load * self.length)) != Status.AT_TARGET:
                if status > Status.ARRESTED:  # it slides at this load: `state` is about to jump
                    break
                state = path.state()
            state = path.state() if status == Status.AT_TARGET else state
            states.append(self.travels(state) | self.profiles(state))
        values = self.event_table(push)
        wide = {"slip", "stress", *ON_PATH}
        for name in (*wide, "mean_stress", "travel", "crosshead_travel"):
            values[name] = np.full(
                (loads.size, *(interface.shape if name in wide else ())), np.nan
            )
            for i, at_load in enumerate(states):
                values[name][i] = at_load[name]
        starts = [before.load / self.length for before, _ in push.events]
        values |= {"arrested_events": np.searchsorted(starts, loads), "sliding": sliding}
        variables = {name: along(interface, variable) for name, variable in ON_PATH.items()}
        return values, variables | push_variables(interface)

"""Onsets, events and paths of sliders, as `Equilibrium` gives them.

Loads and forces are divided by the length of the interface: the mean shear stress, Pa. The load
D is the push that the machine would exert without slip. Slip counts from the beginning of the
push, and opening is the present opening. The travel of the push is U = F/C + T'x (`Rig`),
without the constant part from the pressing.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import warn_accuracy, warn_of_samples
from stiction.base.variables import Variable
from stiction.methods.equilibrium.contact.path import N_STACKED, Contact, Status, follow
from stiction.methods.equilibrium.contact.stages import (
    Friction,
    averages,
    begin_push,
    make_matrices,
    press,
    strengths,
)
from stiction.methods.equilibrium.events import (
    MIN_ADDED_SLIP,
    elongation_of,
    event_variables,
    moment_of,
)
from stiction.methods.equilibrium.patches import critical_patch, largest_patch, patches_of
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
"""Nodes in a nucleation length without a warning about the bonded corner."""
MIN_TURNING = 1e-6
"""Opening over slip of a slider that topples, in the motion that does not end."""


class PushState(NamedTuple):
    """A slider under a load D and a force F (N/m)."""

    load: float
    force: float
    slip: Array  # (n,): slip of the push, m
    opening: Array  # (n + 1,): of the edges, m
    shear: Array  # (n,): shear force of the cells, N/m
    pressing: Array  # (n + 1,): normal force of the edges, N/m
    residual: bool  # whether a cell has reached its residual strength
    direction: Array  # (n,): rate of slip


class PushEvent(NamedTuple):
    """An instability, before and after slip."""

    before: PushState
    after: PushState


class Push(NamedTuple):
    """The push of a sample until it slides. Without an instability, `first` is None.

    `last` is the last equilibrium, and `peak` the largest force (N/m). `known` is false if the path
    was not followed to its end.
    """

    first: PushState | None
    last: PushState
    peak: float
    events: list[PushEvent]
    known: bool
    topples: bool


class SliderPaths:
    """The pushes of samples on the rig of a problem. It is thread-safe."""

    def __init__(self, problem: Problem) -> None:
        rig, slider = problem.rig, problem.specimen
        machine: float = slider.machine  # type: ignore[union-attr]
        relief = rig.C / (1.0 + rig.C / machine) if machine > 0.0 else 0.0
        self.problem, self.C, self.T, self.relief = problem, rig.C, rig.T, relief
        self.for_pressing = make_matrices(rig.K, rig.T_p)
        self.for_push = make_matrices(rig.K, rig.T, relief)

    def friction(self, rows: Sample, row: int) -> Friction:
        """Return the law of a sample on the cells."""
        pressure, spacing = rows.normal_pressure[row], self.problem.interface.spacing
        peak, residual = rows.strength[row] / pressure, rows.residual_strength[row] / pressure
        return Friction(peak, residual, rows.weakening_rate[row] * spacing)

    def begin(self, rows: Sample, row: int, friction: Friction | None = None) -> "SliderPath":
        """Return a sample that is pressed and not yet pushed."""
        friction = friction or self.friction(rows, row)
        force = float(rows.normal_pressure[row].mean()) * self.problem.interface.measure
        start = press(self.for_pressing, friction, force)
        return SliderPath(self, friction, begin_push(self.for_push, friction, start))

    def travel(self, state: PushState) -> float:
        """Return the travel of the push since its beginning, m."""
        n, T = len(state.slip), self.T
        return float(state.force / self.C + T[:n] @ state.slip + T[n:] @ state.opening)


class SliderPath:
    """A slider on its path. A path only goes on."""

    def __init__(self, paths: SliderPaths, friction: Friction, contact: Contact) -> None:
        self.paths, self.friction, self.contact = paths, friction, contact
        self.start = contact.moved.copy()
        self.load = self.force = self.peak = 0.0
        self.status = int(Status.AT_TARGET)

    def move(self, target: float = np.inf) -> int:
        """Go on to a load, or to the next instability or arrest. Return the `Status`."""
        stop = follow(self.contact, self.load, self.force, self.peak, target)
        self.load, self.force, self.peak, status = stop
        self.status = int(status)
        return self.status

    def state(self) -> PushState:
        """Return a copy of the present state."""
        contact, n = self.contact, len(self.friction.peak)
        moved, overstress = contact.moved, contact.overstress
        shear = overstress[:n] + strengths(self.friction, contact)
        at_residual = (contact.difference == 0.0) & (
            self.friction.peak > self.friction.residual
        )
        return PushState(
            self.load, self.force, moved[:n] - self.start[:n], moved[n:].copy(), shear,
            -overstress[n:], bool(at_residual.any()), np.maximum(contact.rate[:n], 0.0),
        )  # fmt: skip


def follow_push(path: SliderPath) -> Push:
    """Follow a sample until it slides."""
    events: list[PushEvent] = []
    first: PushState | None = None
    while path.move() == Status.UNSTABLE:
        before = path.state()
        first = first or before
        if path.move() != Status.ARRESTED:
            break
        events.append(PushEvent(before, path.state()))
    unstable = path.contact.counts[N_STACKED] > 0  # otherwise it slides stably
    last = before if unstable else path.state()
    rate, n = path.contact.rate, len(last.slip)
    turns = bool(np.abs(rate[n:]).max() > MIN_TURNING * np.abs(rate[:n]).max())
    known = path.status == Status.SLIDING
    return Push(first, last, path.peak, events, known, known and unstable and turns)


def push_event(paths: SliderPaths, event: PushEvent) -> dict[str, float]:
    """Return the variables of an event, as `events.event_variables` names them."""
    problem, (before, after) = paths.problem, event
    interface, length = problem.interface, problem.interface.measure
    added = after.slip - before.slip
    inside, patch = largest_patch(np.maximum(added, 0.0), interface, MIN_ADDED_SLIP)
    drop = (before.shear - after.shear) / interface.spacing
    travel, stress = paths.travel(before), before.force / length
    return {
        "event_load": before.load / length,
        "event_stress": stress,
        "event_position": patch.centre[0],
        "event_length": patch.area,
        "event_mean_slip": float(added[inside].mean()),
        "event_largest_slip": float(added.max()),
        "event_moment": moment_of(problem, added),
        "event_area_stress_drop": float(drop[inside].mean()),
        "event_slip_stress_drop": float((drop * added).sum() / added.sum()),
        "event_stress_drop": (before.force - after.force) / length,
        "event_travel": travel,
        "event_crosshead_travel": travel + elongation_of(problem, stress),
        "event_travel_step": paths.travel(after) - travel,
        "event_start": float(np.argmax(inside)) * interface.spacing,
    }


def push_variables(interface: Interface) -> dict[str, Variable]:
    """Return the variables of the events of a slider."""
    variables = event_variables(interface)
    return {name: variables[name] for name in variables if name not in WITH_FIXED_PRESSURE}


def push_event_table(
    paths: SliderPaths, events: list[PushEvent], most: int | None = None
) -> dict[str, Array]:
    """Return the variables of events as arrays, padded with NaN to `most` events."""
    measured = [push_event(paths, event) for event in events[:most]]
    table: dict[str, Array] = {}
    for name in push_variables(paths.problem.interface):
        table[name] = np.full(len(events) if most is None else most, np.nan)
        table[name][: len(measured)] = [values[name] for values in measured]
    return table


class SliderSolver:
    """Solver for samples of a slider by `Equilibrium` with given options. It is thread-safe."""

    def __init__(self, problem: Problem, options: Any) -> None:
        self.problem, self.options, self.paths = problem, options, SliderPaths(problem)

    def __call__(self, rows: Sample) -> dict[str, NDArray[Any]]:
        """Return the variables of `Equilibrium`. The first dimension of each is the sample."""
        warn_if_coarse(
            self.problem,
            rows.steepest_weakening_rate,
            MIN_NODES,
            "the stress at the ends of the slider is singular. Static friction is off by about"
            " 0.1 %, and the first instability by 1 %, at 16 nodes",
        )
        table, flags = [], []
        for row in range(rows.samples):
            push = follow_push(self.paths.begin(rows, row))
            flags.append((push.known, push.topples))
            table.append(self._values(rows, row, push))
        known, topples = np.array(flags).T
        warn_of_samples(
            "the path was not followed to its end in {samples}: static friction is a lower bound",
            ~known,
        )
        warn_of_samples(
            "the slider topples before it slides in {samples}: static friction is the force at"
            " which it topples. Push lower",
            topples,
        )
        warn_of_samples(
            "no patch becomes unstable in {samples}: the machine is so stiff that the slider slides"
            " stably, and first_instability is NaN",
            np.array([np.isnan(row["first_instability"]) for row in table]),
        )
        return {name: np.array([row[name] for row in table]) for name in table[0]}

    def _values(self, rows: Sample, row: int, push: Push) -> dict[str, Any]:
        interface, length = self.problem.interface, self.problem.interface.measure
        first, last = push.first, push.last
        nothing = np.zeros(interface.size)
        patch = critical_patch(nothing if first is None else first.direction, interface)
        sliding = critical_patch(last.direction, interface)
        slip = nothing if first is None else first.slip
        values: dict[str, Any] = {
            "critical_load": last.load / length,
            "critical_stress": push.peak / length,
            "first_instability": np.nan if first is None else first.force / length,
            "certificate_gap": np.nan,
            "critical_position": patch.centre[0],
            "critical_patch_length": patch.area,
            "sliding_position": sliding.centre[0],
            "slip_patches": patches_of(slip, interface),
            "arrested_events": len(push.events),
            "residual_reached": last.residual,
            "open_fraction": float(np.trapezoid(last.opening > 0.0) / interface.size),
        }
        if self.options.slip:
            values["slip"] = slip
        if self.options.sensitivity:
            values["sensitivity"] = self._sensitivity(rows, row, first)
        if most := self.options.events:
            values |= push_event_table(self.paths, push.events, most)
        return values

    def _sensitivity(self, rows: Sample, row: int, first: PushState | None) -> Array:
        """Return derivatives of the first instability as difference quotients.

        Between events paths are straight, so a small step gives the exact derivative.
        """
        derivative = np.full(self.problem.interface.size, np.nan)
        if first is None:
            return derivative
        friction, length = self.paths.friction(rows, row), self.problem.interface.measure
        for node in range(derivative.size):
            peak = friction.peak.copy()
            peak[node] += STRENGTH_STEP
            path = self.paths.begin(rows, row, friction._replace(peak=peak))
            path.move()
            step = STRENGTH_STEP * float(rows.normal_pressure[row, node])
            derivative[node] = (path.force - first.force) / length / step
        return derivative


def push_at_loads(
    problem: Problem, rows: Sample, loads: Array
) -> tuple[dict[str, Array], dict[str, Variable]]:
    """Return values and further variables of `equilibrium_path` at rising loads, Pa."""
    paths, interface = SliderPaths(problem), problem.interface
    count, length, spacing = loads.size, interface.measure, interface.spacing
    # The path to sliding gives all events, and a second path the states at the loads.
    push, path = follow_push(paths.begin(rows, 0)), paths.begin(rows, 0)
    narrow = ("mean_stress", "travel", "crosshead_travel")
    shapes: dict[str, tuple[int, ...]] = dict.fromkeys(narrow, (count,))
    shapes |= dict.fromkeys(("slip", "stress", *ON_PATH), (count, interface.size))
    values = {name: np.full(shape, np.nan) for name, shape in shapes.items()}
    sliding = loads * length > push.last.load
    for i in np.flatnonzero(~sliding):
        while path.move(loads[i] * length) in (Status.UNSTABLE, Status.ARRESTED):
            pass
        state = path.state()
        stress, travel = state.force / length, paths.travel(state)
        at_load = {
            "slip": state.slip,
            "stress": state.shear / spacing,
            "pressure": averages(state.pressing) / spacing,
            "opening": 0.5 * (state.opening[:-1] + state.opening[1:]),
            "mean_stress": stress,
            "travel": travel,
            "crosshead_travel": travel + elongation_of(problem, stress),
        }
        for name, value in at_load.items():
            values[name][i] = value
    if not push.known:
        warn_accuracy(f"the path was not followed beyond {push.last.load / length:g} Pa")
    at_events = [event.before.load / length for event in push.events]
    values |= {"arrested_events": np.searchsorted(at_events, loads), "sliding": sliding}
    values |= push_event_table(paths, push.events)
    variables = {name: along(interface, variable) for name, variable in ON_PATH.items()}
    return values, variables | push_variables(interface)

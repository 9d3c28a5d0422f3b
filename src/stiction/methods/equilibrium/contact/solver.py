"""Onsets, events and paths of sliders, as `Equilibrium` gives them.

Loads and forces are divided by the length of the interface: the mean shear stress, Pa. The load
D is the push that the machine would exert without slip. Slip and travel count from the beginning
of the push, and opening is the present opening. The travel of the push is U = F/C + T'x (`Rig`),
without the constant part from the pressing.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy, warn_of_samples
from stiction.base.variables import Variable
from stiction.elasticity.rig import on_cells
from stiction.methods.equilibrium.contact.path import Status
from stiction.methods.equilibrium.contact.stages import Friction, Push, PushState, SliderPath
from stiction.methods.equilibrium.events import (
    elongation_of,
    event_variables,
    patch_measures,
    tabulate,
)
from stiction.methods.equilibrium.patches import critical_patch, patches_of
from stiction.problem.checks import warn_if_coarse
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample

OF_SLIDERS = {
    "open_fraction": Variable("1", "part of the interface that is open before it slides")
}
WITH_FIXED_PRESSURE = {"event_energy_stress_drop", "event_fracture_energy"}
"""Variables of events that are defined for a pressure that does not change."""
STRENGTH_STEP = 1e-7
"""Rise of a friction coefficient in a difference quotient."""
MIN_NODES = 16
"""Nodes in a nucleation length without a warning about the ends of the slider."""


def push_variables(interface: Interface) -> dict[str, Variable]:
    """Return the variables of the events of a slider."""
    variables = event_variables(interface)
    return {name: variables[name] for name in variables if name not in WITH_FIXED_PRESSURE}


def refused_laws(problem: Problem) -> list[str]:
    """Return why a slider cannot take its friction law, or an empty list."""
    text = "friction: the strength of a slider falls linearly with slip. Use"
    text += " st.LinearWeakening(weakening_rate=...)"
    return [] if problem.friction.linear else [text]


class SliderSolver:
    """Solver for samples of a slider by `Equilibrium` with given options. It is thread-safe."""

    def __init__(self, problem: Problem, options: Any = None) -> None:
        if reasons := refused_laws(problem):
            raise InputError(reasons)
        rig, machine = problem.rig, problem.specimen.machine  # type: ignore[union-attr]
        self.relief = rig.C / (1.0 + rig.C / machine) if machine > 0.0 else 0.0
        self.problem, self.options, self.rig = problem, options, rig
        self.length = problem.interface.measure

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
        force = float(pressure.mean()) * self.length
        return SliderPath(self.rig, self.relief, friction, force)

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
                rise = (path.state().force - first.force) / self.length  # type: ignore[union-attr]
                step = STRENGTH_STEP * rows.normal_pressure[row, node]
                values["sensitivity"][node] = rise / step
        if most := self.options.events:
            values |= self.event_table(push, most)
        return values

    def values_at(self, state: PushState) -> dict[str, Any]:
        """Return the mean stress (Pa), both travels (m), and profiles (m, Pa) at the nodes."""
        n, spacing = self.problem.interface.size, self.problem.interface.spacing
        stress, travel = state.force / self.length, state.force / self.rig.C
        travel += float(self.rig.T @ state.moved)
        return {
            "mean_stress": stress,
            "travel": travel,
            "crosshead_travel": travel + elongation_of(self.problem, stress),
            "slip": state.moved[:n],
            "stress": state.forces[:n] / spacing,
            "pressure": on_cells(-state.forces[n:]) / spacing,
            "opening": 0.5 * (state.moved[n:-1] + state.moved[n + 1 :]),
        }

    def event_table(self, push: Push, most: int | None = None) -> dict[str, Array]:
        """Return the variables of events as arrays, padded with NaN to `most` events."""
        measured, interface = [], self.problem.interface
        for before, after in push.events[:most]:
            start, end = self.values_at(before), self.values_at(after)
            drop = (before.forces - after.forces)[: interface.size] / interface.spacing
            added = end["slip"] - start["slip"]
            measured.append(patch_measures(self.problem, before.direction, added, drop) | {
                "event_load": before.load / self.length,
                "event_stress": start["mean_stress"],
                "event_stress_drop": start["mean_stress"] - end["mean_stress"],
                "event_travel": start["travel"],
                "event_crosshead_travel": start["crosshead_travel"],
                "event_travel_step": end["travel"] - start["travel"],
            })  # fmt: skip
        return tabulate(measured, push_variables(interface), most)

    def at_loads(self, rows: Sample, loads: Array) -> dict[str, Array]:
        """Return values of `equilibrium_path` at rising loads, Pa."""
        # The path to sliding gives all events, and a second path the states at the loads.
        push, path = self.path(rows, 0).follow(), self.path(rows, 0)
        end = push.last.load
        if not push.known:
            warn_accuracy(f"the path was not followed beyond {end / self.length:g} Pa")
        sliding, state, states = loads * self.length > end, path.state(), []
        for load in loads[~sliding]:
            while (status := path.move(load * self.length)) <= Status.ARRESTED:
                state = path.state()
                if status == Status.AT_TARGET:
                    break
            states.append(self.values_at(state))  # if it slides at this load, just before
        after = {name: np.nan * value for name, value in self.values_at(push.last).items()}
        table = states + [after] * int(sliding.sum())
        starts = [before.load / self.length for before, _ in push.events]
        return {
            **self.event_table(push),
            **{name: np.array([values[name] for values in table]) for name in after},
            "arrested_events": np.searchsorted(starts, loads),
            "sliding": sliding,
        }

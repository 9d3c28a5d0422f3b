"""The scalars of a run: loads, moment, energies, rupture speeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.dynamics import monitor
from stiction.dynamics.checks import resolves_steps
from stiction.dynamics.energies import fracture_energy, radiated_energy, rupture_speed
from stiction.dynamics.integrator import Run, State
from stiction.interface import Interface
from stiction.problem import Problem
from stiction.results import Variable, position

Floats = NDArray[np.float64]

_SCALARS: dict[str, Variable] = {
    "applied_load": Variable("Pa", "load factor applied when the mean stress was largest"),
    "onset_time": Variable("s", "time from zero load when the mean stress was largest"),
    "kinetic_stress": Variable("Pa", "mean stress when all that can break had broken"),
    "stress_drop": Variable("Pa", "critical stress less kinetic stress"),
    "seismic_moment": Variable("N", "seismic moment per length, G times the integral of slip"),
    "radiated_energy": Variable("J/m", "energy radiated up to the end of the run"),
    "fracture_energy": Variable("J/m", "energy dissipated above the residual strength"),
    "arrested_events": Variable("1", "instabilities that stopped before the whole interface slid"),
    "rupture_speed": Variable("m/s", "largest apparent speed of the front over 2 h_n"),
    "median_rupture_speed": Variable("m/s", "median apparent speed of the front over h_n/2"),
    "start_load": Variable("Pa", "load factor at which the simulation began"),
    "start_error": Variable(
        "Pa", "estimated error of the first instability due to the start; 0 from rest"
    ),
    "implicit_steps": Variable("1", "implicit steps taken"),
    "explicit_steps": Variable("1", "explicit steps taken"),
}


def per_area(interface: Interface, variable: Variable) -> Variable:
    """The same quantity on a plane, where what is per length on a line is whole."""
    if not interface.is_plane:
        return variable
    units = {"N": "N m", "J/m": "J"}.get(variable.units, variable.units)
    return replace(variable, units=units, long_name=variable.long_name.replace(" per length", ""))


def scalars(interface: Interface) -> dict[str, Variable]:
    """What a run returns besides what every method does; speeds along x and y on a plane."""
    found = {name: per_area(interface, variable) for name, variable in _SCALARS.items()}
    for name in ("rupture_speed", "median_rupture_speed"):
        found[name] = position(interface, found[name])
    return found


def _windows(problem: Problem, run: Run, lengths: float) -> list[float]:
    """Lengths, m, over which speeds are taken along x and y, in units of the shortest h_n there."""
    interface = problem.interface
    moduli = (
        problem.effective_modulus,
        problem.solid.shear_modulus,
    )  # mode II along x, III along y
    unit = problem.nucleation_lengths(run.steepest_rate)[0] / problem.effective_modulus
    return [
        min(max(lengths * unit * modulus, 8.0 * spacing), 0.25 * length)
        for modulus, spacing, length in zip(
            moduli, interface.spacings, interface.lengths, strict=False
        )
    ]


def front_speed(problem: Problem, run: Run, state: State) -> Floats:
    """Apparent speed of the front, m/s, over half of the shortest h_n, of the interface's shape."""
    interface = problem.interface
    if not resolves_steps(run, state.time):
        return np.full(interface.shape, np.nan)
    arrival = state.arrival.reshape(interface.shape)
    return rupture_speed(arrival, interface.spacings, _windows(problem, run, 0.5))


def _axis_speeds(problem: Problem, run: Run, state: State, lengths: float) -> list[Floats]:
    """Apparent speeds of the front along each axis, on the lines through where it began."""
    interface = problem.interface
    if not resolves_steps(run, state.time):
        return [np.full(n, np.nan) for n in interface.shape]
    arrival = state.arrival.reshape(interface.shape)
    began = np.unravel_index(int(state.watch[monitor.PEAK_NODE]), interface.shape)
    windows = _windows(problem, run, lengths)
    found = []
    for axis, (spacing, window) in enumerate(zip(interface.spacings, windows, strict=True)):
        through = tuple(slice(None) if i == axis else node for i, node in enumerate(began))
        found.append(rupture_speed(arrival[through], (spacing,), [window]))
    return found


def _of_finite(statistic: Callable[[Floats], Any], values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(statistic(finite)) if finite.size else np.nan


def _per_direction(values: list[float]) -> Any:
    """A number on a line, one along x and one along y on a plane."""
    return values[0] if len(values) == 1 else np.array(values)


def summary(problem: Problem, run: Run, state: State) -> dict[str, Any]:
    """The scalars of a finished run."""
    medium, watch, setting = run.medium, state.watch, run.setting
    peak = float(watch[monitor.PEAK_STRESS])
    first = float(watch[monitor.FIRST_STRESS])
    far, near = (_axis_speeds(problem, run, state, lengths) for lengths in (2.0, 0.5))
    kinetic = float(watch[monitor.KINETIC])
    kinetic = kinetic if np.isfinite(kinetic) else np.nan
    dissipated = fracture_energy(run.friction, state.slip, setting.nodes)
    interface, cell = medium.interface, medium.interface.cell
    node = np.unravel_index(int(watch[monitor.PEAK_NODE]), interface.shape)
    return {
        "critical_load": (peak - setting.mean_initial) / setting.mean_profile,
        "critical_stress": peak,
        "first_instability": first if np.isfinite(first) else peak,
        "critical_position": _per_direction(
            [i * spacing for i, spacing in zip(node, interface.spacings, strict=True)]
        ),
        "applied_load": float(watch[monitor.PEAK_LOAD]),
        "onset_time": float(watch[monitor.PEAK_TIME]),
        "kinetic_stress": kinetic,
        "stress_drop": peak - kinetic,
        "seismic_moment": medium.shear_modulus * float(state.slip.sum()) * cell,
        "radiated_energy": radiated_energy(run.friction, setting.nodes, medium.grid, state.fields),
        "fracture_energy": float(dissipated.sum()) * cell,
        "arrested_events": int(watch[monitor.ARRESTED]),
        "rupture_speed": _per_direction([_of_finite(np.max, speeds) for speeds in far]),
        "median_rupture_speed": _per_direction([_of_finite(np.median, speeds) for speeds in near]),
        "start_load": float(watch[monitor.START_LOAD]),
        "start_error": float(watch[monitor.START_ERROR]),
        "implicit_steps": int(watch[monitor.IMPLICIT_STEPS]),
        "explicit_steps": int(watch[monitor.EXPLICIT_STEPS]),
    }

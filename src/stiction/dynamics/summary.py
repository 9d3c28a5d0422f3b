"""The scalars of a run: loads, moment, energies, rupture speeds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.dynamics import monitor
from stiction.dynamics.checks import resolves_steps
from stiction.dynamics.energies import fracture_energy, radiated_energy, rupture_speed
from stiction.dynamics.integrator import Run, State
from stiction.problem import Problem
from stiction.results import Variable

Floats = NDArray[np.float64]

SCALARS: dict[str, Variable] = {
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
    "implicit_steps": Variable("1", "implicit steps taken"),
    "explicit_steps": Variable("1", "explicit steps taken"),
}


def front_speed(problem: Problem, run: Run, state: State, lengths: float) -> Floats:
    """Apparent speed of the front, m/s, over a window in units of the shortest h_n, (nodes,)."""
    interface = run.medium.interface
    shortest = problem.nucleation_length_of(run.steepest_rate)
    if not resolves_steps(run, state.time):
        return np.full(interface.size, np.nan)
    window = min(max(lengths * shortest, 8.0 * interface.spacing), 0.25 * interface.extent)
    return rupture_speed(state.arrival, interface.spacing, window)


def _of_finite(statistic: Callable[[Floats], Any], values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(statistic(finite)) if finite.size else np.nan


def summary(problem: Problem, run: Run, state: State) -> dict[str, Any]:
    """The scalars of a finished run."""
    medium, watch, setting = run.medium, state.watch, run.setting
    peak = float(watch[monitor.PEAK_STRESS])
    first = float(watch[monitor.FIRST_STRESS])
    far, near = (front_speed(problem, run, state, lengths) for lengths in (2.0, 0.5))
    kinetic = float(watch[monitor.KINETIC])
    kinetic = kinetic if np.isfinite(kinetic) else np.nan
    dissipated = fracture_energy(run.friction, state.slip, setting.nodes)
    cell = medium.interface.cell
    return {
        "critical_load": (peak - setting.mean_initial) / setting.mean_profile,
        "critical_stress": peak,
        "first_instability": first if np.isfinite(first) else peak,
        "critical_position": float(watch[monitor.PEAK_NODE]) * medium.interface.spacing,
        "applied_load": float(watch[monitor.PEAK_LOAD]),
        "onset_time": float(watch[monitor.PEAK_TIME]),
        "kinetic_stress": kinetic,
        "stress_drop": peak - kinetic,
        "seismic_moment": medium.shear_modulus * float(state.slip.sum()) * cell,
        "radiated_energy": radiated_energy(run.friction, setting.nodes, medium.grid, state.fields),
        "fracture_energy": float(dissipated.sum()) * cell,
        "arrested_events": int(watch[monitor.ARRESTED]),
        "rupture_speed": _of_finite(np.max, far),
        "median_rupture_speed": _of_finite(np.median, near),
        "implicit_steps": int(watch[monitor.IMPLICIT_STEPS]),
        "explicit_steps": int(watch[monitor.EXPLICIT_STEPS]),
    }

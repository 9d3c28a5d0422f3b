"""The start of a run on the quasi-static path, close to the first instability.

While the load rises slowly, slip follows the equilibria d(tau_0) at the rate V = R dd/dtau_0, R the
loading rate. Slip that grows as exp(a t) leaves in each memory variable, psi' = z psi + V with
z = s_p |k| c_s, a permanent part: psi = V/(a - z). Near the onset, a fold, the distance of
slip from its limit falls as (tau_c - tau_0)^(1/2), so that a = R / (2 (tau_c - tau_0)).

Stress that follows such a rate without delay needs no force; what is left over is inertia (the
kernel is even in a except for the radiation of the mean, to which the load is raised). So the
stress by which such a state misses the strength where it slips estimates the error: it is both
the error of the state and, as a stress, the amount by which the onset can be misplaced.
"""

import numpy as np

from stiction.methods.dynamics.integrator import Run
from stiction.methods.dynamics.memory import grown_memory
from stiction.methods.dynamics.state import Phase, RuptureState
from stiction.methods.dynamics.summary import energy_balance
from stiction.methods.equilibrium.dense.program import DenseProgram
from stiction.methods.equilibrium.sample import StaticSample, exceeds, refused, sample_of
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample

_TOLERANCE = 2e-5  # in units of the stress scale: a fifth of the fall that counts as an event
_CROSSINGS = 10.0  # times shear waves cross h_n between the first trial and the onset
_BACK = 0.25  # share of the distance to the onset over which the rate is measured
_TRIALS = 5


def static_program(problem: Problem) -> DenseProgram | None:
    """Return the programme for equilibria of a problem; None where they are not followed."""
    if problem.interface.is_plane or refused(problem.friction):
        return None
    return DenseProgram(problem)


def slow_start(
    program: DenseProgram, run: Run, rows: Sample, number: int, rate: float
) -> RuptureState | None:
    """The state closest to the onset whose error is small enough, None if there is none."""
    nodes = run.setting.nodes
    if not np.all(np.isfinite(nodes.strength)) or np.any(nodes.strength <= nodes.initial):
        return None
    static = sample_of(rows, program.pieces, number)
    onset = program.solve(static)
    if onset is None:
        return None
    asked = _TOLERANCE * run.scale_at(onset.load)
    crossing = program.problem.nucleation_lengths(run.steepest_rate)[0] / (
        program.problem.solid.shear_wave_speed
    )
    distance = max(_CROSSINGS * crossing * rate, 1e-6 * asked)
    for _ in range(_TRIALS):
        if onset.load - (1.0 + _BACK) * distance <= run.first_load:
            return None
        found = _at(program, run, static, onset.load, distance, rate)
        if found is None:
            distance *= 4.0
        elif found.now["start_error"] <= asked:
            return found
        else:  # V falls as distance^(-1/2), its second derivative as distance^(-5/2)
            distance *= 1.2 * (found.now["start_error"] / asked) ** 0.4
    return None


def _at(
    program: DenseProgram,
    run: Run,
    static: StaticSample,
    onset: float,
    distance: float,
    rate: float,
) -> RuptureState | None:
    """RuptureState at a distance (Pa) below the onset; None where it is not determined well enough.

    That is where a node is beyond the first piece of its law, so that the programme does not hold,
    or has lost half of its strength at a time that would be unknown.
    """
    nodes, grid = run.setting.nodes, run.medium.grid
    load, back = onset - distance, _BACK * distance
    here, before = (program.solve(static, cap) for cap in (load, load - back))
    if here is None or before is None or exceeds(static, here.slip):
        return None
    weakens = nodes.critical > 0.0
    half = run.setting.thresholds.arrival * nodes.critical
    if np.any(here.slip[weakens] >= half[weakens]) or np.any(here.slip[~weakens] > 0.0):
        return None
    interval, growth = back / rate, 0.5 * rate / distance
    mean_rate = np.maximum(here.slip - before.slip, 0.0) / interval
    slip_rate = mean_rate * (1.0 + 0.5 * growth * interval)
    radiated = run.medium.impedance * float(slip_rate.mean())
    applied = load + radiated / run.setting.mean_profile
    state = run.start(applied / rate, here.slip)
    rate_hat = run.medium.interface.transform(slip_rate)
    memory = grown_memory(grid, state.memory, rate_hat, growth)
    stress = run.elastic_stress(state.slip_hat, applied)
    stress += run.medium.interface.inverse_transform(grid.stiffness[1] * memory)
    stress -= run.medium.impedance * slip_rate
    missed = np.abs(stress - run.strength_after(here.slip))[here.slip > 0.0]
    state.rate[:], state.past[:], state.stress[:] = slip_rate, mean_rate, stress
    now = state.now
    now["phase"], now["two_step"] = Phase.IMPLICIT, 1
    now["previous_size"], now["top_slip_rate"] = interval, slip_rate.max()
    now["mean_stress"] = now["maximum_stress"] = stress.mean()
    now["maximum_radiated"] = now["previous_radiated"] = radiated
    # The slow path has radiated nothing: that is the work that was done on it.
    now["work"] -= energy_balance(run, state)["radiated_energy"]
    now["start_error"] = missed.max(initial=0.0)
    return state

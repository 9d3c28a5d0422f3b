"""The start of a run on the quasi-static path, close to the first instability.

Problem
-------
While the load tau_0 rises slowly at the rate R, slip follows the equilibria d(tau_0).
Wanted is the state of the run at a load tau_c - D, a distance D below the onset tau_c,
without the steps that lead there: slip, slip rate and memory variables. A run from it
should have the same onset.

Algorithm
---------
Asymptotics of a fold: near the onset, the distance of slip from its limit falls as (tau_c -
tau_0)^(1/2), so that the slip rate V = R dd/dtau_0 grows as exp(a t) with a = R/(2 D).

1. Find the onset tau_c by equilibrium. Begin with a distance in which shear waves cross the
   nucleation length `_CROSSINGS` times.
2. At the distance D: find the equilibria at tau_c - D and a little before; their difference
   gives the mean slip rate, and its growth the slip rate V at tau_c - D (`_state_at`).
3. Slip that grows as exp(a t) leaves in each memory variable, psi' = z psi + V with
   z = s_p |k| c_s, a permanent part psi = V/(a - z) (`memory.grown_memory`).
4. The load is raised by what the mean slip rate radiates, Z <V>/<p>. Then stress that
   follows V without delay needs no further force, and the remaining stress is inertia (the
   kernel is even in a but for the radiation of the mean).
5. The stress by which the state misses the strength where it slips estimates the error. It
   is the error of the state and, as a stress, the amount by which the onset can be
   misplaced. If it is more than `_MAX_ERROR` of the stress scale, try again from 2 further
   away: V falls as D^(-1/2), its second derivative as D^(-5/2).
6. Give up, and begin at rest, after `_MAX_TRIALS` or where no state is known well enough.
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

_MAX_ERROR = 2e-5  # share of the stress scale: a fifth of the fall that counts as an event
_CROSSINGS = 10.0  # times shear waves cross h_n between the first trial and the onset
_RATE_SHARE = 0.25  # of the distance to the onset, over which the mean rate is measured
_MAX_TRIALS = 5


def static_program(problem: Problem) -> DenseProgram | None:
    """Return the programme for equilibria of a problem; None where they are not followed."""
    if problem.interface.is_plane or refused(problem.friction):
        return None
    return DenseProgram(problem)


def slow_start(
    program: DenseProgram, run: Run, rows: Sample, number: int, rate: float
) -> RuptureState | None:
    """Return the state closest to the onset whose error is small enough, None if there is none."""
    nodes = run.setting.nodes
    if not np.all(np.isfinite(nodes.strength)) or np.any(nodes.strength <= nodes.initial):
        return None
    static = sample_of(rows, program.pieces, number)
    onset = program.solve(static)
    if onset is None:
        return None
    # 1. The onset, and the first distance.
    allowed = _MAX_ERROR * run.scale_at(onset.load)
    crossing = program.problem.nucleation_lengths(run.steepest_rate)[0] / (
        program.problem.solid.shear_wave_speed
    )
    distance = max(_CROSSINGS * crossing * rate, 1e-6 * allowed)
    for _ in range(_MAX_TRIALS):
        if onset.load - (1.0 + _RATE_SHARE) * distance <= run.first_load:
            return None
        state = _state_at(program, run, static, onset.load, distance, rate)
        # 5. Close enough, or a greater distance.
        if state is None:
            distance *= 4.0
        elif state.now["start_error"] <= allowed:
            return state
        else:
            distance *= 1.2 * (state.now["start_error"] / allowed) ** 0.4
    return None


def _state_at(
    program: DenseProgram,
    run: Run,
    static: StaticSample,
    onset: float,
    distance: float,
    rate: float,
) -> RuptureState | None:
    """Steps 2 to 5: the state at a distance (Pa) below the onset; None where it is not known.

    It is not known well enough where a node is beyond the first piece of its law, so that
    the linear programme does not hold, or where a front has arrived at a time that would be
    unknown.
    """
    nodes, grid = run.setting.nodes, run.medium.grid
    # 2. Two equilibria, and the slip rate between them.
    load, load_rise = onset - distance, _RATE_SHARE * distance
    present, before = (program.solve(static, cap) for cap in (load, load - load_rise))
    if present is None or before is None or exceeds(static, present.slip):
        return None
    weakens = nodes.critical > 0.0
    front = run.setting.thresholds.arrival * nodes.critical
    arrived = present.slip[weakens] >= front[weakens]
    if np.any(arrived) or np.any(present.slip[~weakens] > 0.0):
        return None
    interval, growth = load_rise / rate, 0.5 * rate / distance
    mean_rate = np.maximum(present.slip - before.slip, 0.0) / interval
    slip_rate = mean_rate * (1.0 + 0.5 * growth * interval)
    # 3. and 4. Memory, load and stress.
    radiated = run.medium.impedance * float(slip_rate.mean())
    applied = load + radiated / run.setting.mean_profile
    state = run.start(applied / rate, present.slip)
    rate_hat = run.medium.interface.transform(slip_rate)
    memory = grown_memory(grid, state.memory, rate_hat, growth)
    stress = run.elastic_stress(state.slip_hat, applied)
    stress += run.medium.interface.inverse_transform(grid.stiffness[1] * memory)
    stress -= run.medium.impedance * slip_rate
    # 5. The stress that is missed estimates the error.
    missed = np.abs(stress - run.strength_after(present.slip))[present.slip > 0.0]
    state.rate[:], state.past[:], state.stress[:] = slip_rate, mean_rate, stress
    now = state.now
    now["phase"], now["two_step"] = Phase.IMPLICIT, 1
    now["previous_size"], now["top_slip_rate"] = interval, slip_rate.max()
    for name in ("mean_stress", "whole_stress", "maximum_stress", "maximum_breakable"):
        now[name] = stress.mean()
    now["maximum_radiated"] = now["previous_radiated"] = radiated
    # The slow path has radiated nothing: that is the work that was done on it.
    now["work"] -= energy_balance(run, state)["radiated_energy"]
    now["start_error"] = missed.max(initial=0.0)
    return state

"""Explicit predictor-corrector steps with fixed size and second order, in a compiled loop.

Problem
-------
Advance equations (1) and (2) of `state` by a step h: slip d, slip rate
V and stress tau at the nodes, and the memory variables y of `memory` at
the modes. Let f_hat(d_hat, V_hat) be the stress transferred at the end
of the step if a slip rate V_hat acts for the whole step and leads to
the slip d_hat:

    f_hat = (G|k|/2) (S + V_hat Re sum_p w_p B) - K(k) d_hat,   S = Re sum_p w_p E B y.  (1)

The state of a node follows from the stress that it would carry at rest
and its strength s(d):

    V = max(f + tau_0 p + tau_i - s(d), 0) / Z,   tau = f + tau_0 p + tau_i - Z V.  (2)

Algorithm (Heun's method: K. Heun, Zeitschrift fuer Mathematik und Physik 45, 1900)
----------------------------------------------------------------------------------
1. Predict: the present rate V_0 acts for the whole step (`_transfer`),
   and (2) gives the rate V* at the end (`_predict`).
2. Correct: the mean (V_0 + V*)/2 acts for the step (`_transfer`). The
   slip grows by h times this mean, and (2) gives the rate and the
   stress at the end (`_correct`).
3. Advance slip and memory of the modes by the same mean
   (`memory.advance_memory`).
4. Update the diagnostics (`diagnostics`). Return if the run ends, or if
   the interface is so calm that implicit steps can take over (`_calm`).

The step is stable below the limit of `medium.largest_step`. By (2) a
node cannot slip backwards.
"""

from typing import Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit, jit_inside
from stiction.elasticity.operator import backward, forward
from stiction.methods.dynamics.diagnostics import (
    EVENT_DROP,
    STEADY_STRESS,
    TakenStep,
    end_event,
    finish_step,
)
from stiction.methods.dynamics.memory import ENTRIES, advance_memory, pack
from stiction.methods.dynamics.state import (
    ExplicitTables,
    Grid,
    Reason,
    RuptureState,
    Setting,
    StepRecord,
    Thresholds,
    node_strength,
    value_at,
)

_CALM_STRESS = 1e-4  # Z V of waves that implicit steps may smear, in units of the stress scale


@jit_inside
def _transfer(grid: Grid, slip_hat: Array, memory_sum: Array, tables: ExplicitTables) -> None:
    """Write equation (1), the stress if `slip_rate_hat` acts for a step, to `tables.transfer`."""
    slip_rate_hat, response, shared = tables.slip_rate_hat, tables.response, tables.shared
    offset, step = grid.offset, tables.step
    static, dynamic = grid.stiffness[0], grid.stiffness[1]
    shared[0] = 0.0
    for q in range(1, shared.size):
        o, v_hat = offset[q], slip_rate_hat[q]
        memory = complex(memory_sum[o], memory_sum[o + ENTRIES])
        slip = slip_hat[q] + step * v_hat  # at the end of the step
        shared[q] = dynamic[q] * (memory + response[q] * v_hat) - static[q] * slip
    backward(grid.transform, shared, tables.transfer)


@jit_inside
def _predict(
    state: RuptureState, setting: Setting, tables: ExplicitTables, load: float, impedance: float
) -> None:
    """Step 1: write to `predicted` the rate at the end if the present rate acts all the time."""
    profile, initial = setting.nodes.profile, setting.nodes.initial
    slip, slip_rate, transfer, step = state.slip, state.slip_rate, tables.transfer, tables.step
    for i in range(slip.size):
        next_slip = slip[i] + step * slip_rate[i]
        limit = node_strength(setting, i, next_slip)
        at_rest = transfer[i] + load * profile[i] + initial[i]
        tables.predicted[i] = max(at_rest - limit, 0.0) / impedance


@jit_inside
def _correct(
    state: RuptureState, setting: Setting, tables: ExplicitTables, load: float, impedance: float
) -> Any:
    """Step 2: update slip, rate and stress.

    Write strength and slip increments.

    Return the sums over nodes of work per cell area, and of V.
    """
    profile, initial, step = setting.nodes.profile, setting.nodes.initial, tables.step
    slip, slip_rate, stress = state.slip, state.slip_rate, state.stress
    transfer, predicted, increments = tables.transfer, tables.predicted, tables.increments
    work, total = 0.0, 0.0
    mean_load = 0.5 * (load + state.diagnostics[0].step.load)
    for i in range(slip.size):
        increment = 0.5 * step * (slip_rate[i] + predicted[i])
        next_slip = slip[i] + increment
        limit = node_strength(setting, i, next_slip)
        at_rest = transfer[i] + load * profile[i] + initial[i]
        v = max(at_rest - limit, 0.0) / impedance
        work += increment * (mean_load * profile[i] + initial[i])
        increments[i], tables.strength[i] = 0.5 * step * (slip_rate[i] + v), limit
        slip[i], slip_rate[i], stress[i] = next_slip, v, at_rest - impedance * v
        total += v
    return work, total


@jit_inside
def _calm(now: Any, thresholds: Thresholds, step: float, impedance: float, rise: float) -> Any:
    """Step 4: count successive calm steps.

    Return whether they suffice for implicit steps.

    Slip rates due to waves come and go. Creep is slow, or as fast as
    when the count began.
    """
    scale, before, top = now.run.scale, now.stepping.calm_slip_rate, now.step.top_slip_rate
    quiet = top < _CALM_STRESS * scale / impedance + thresholds.calm_slip * rise / step
    steady = 0.5 * before <= top <= 2.0 * before
    # Once all nodes have broken only the load drives steady slip,
    # however fast it is.
    slid = thresholds.slid_stop and now.step.weakened_nodes >= thresholds.breakable
    slow = top < STEADY_STRESS * scale / impedance or slid
    if quiet or (steady and slow):
        now.stepping.calm_steps += 1
    else:
        now.stepping.calm_steps, now.stepping.calm_slip_rate = 0, top
    return now.stepping.calm_steps >= thresholds.calm_count


@jit
def explicit_steps(
    n: int, state: RuptureState, setting: Setting, tables: ExplicitTables, record: StepRecord
) -> Any:
    """Take up to `n` explicit steps in place. Return (steps taken, reason).

    `stepping.phase` is EXPLICIT. `record` has at least `n` rows, or no
    rows to keep no record.
    """
    grid, step = setting.grid, tables.step
    impedance = grid.impedance
    now, thresholds = state.diagnostics[0], setting.thresholds
    slip_rate_hat, slip_hat = tables.slip_rate_hat, state.slip_hat
    # A single return: a further return would double the time to compile.
    taken, reason = ZERO, Reason.DONE
    while taken < n and reason == Reason.DONE and not (now.event.begun or now.event.calm):
        time = now.step.time + step
        load = value_at(setting.load, time)
        # 1. Predict.
        forward(grid.transform, state.slip_rate, slip_rate_hat)
        _transfer(grid, slip_hat, state.memory_sum, tables)
        _predict(state, setting, tables, load, impedance)
        # 2. Correct. The transform is linear, so average the transforms
        # of both rates.
        forward(grid.transform, tables.predicted, tables.shared)
        for q in range(slip_rate_hat.size):
            slip_rate_hat[q] = 0.5 * (slip_rate_hat[q] + tables.shared[q])
        _transfer(grid, slip_hat, state.memory_sum, tables)
        work, total = _correct(state, setting, tables, load, impedance)
        if not np.isfinite(total):
            now.step.time = time
            reason = Reason.NOT_FINITE
            break
        # 3. Advance slip and memory of the modes.
        for q in range(slip_rate_hat.size):
            slip_hat[q] += step * slip_rate_hat[q]
        pack(grid.offset, slip_rate_hat, tables.packed)
        advance_memory(
            state.memory, tables.table, tables.packed, state.memory_sum,
            grid.poles.size, grid.multiplicity,
        )  # fmt: skip
        # 4. Diagnostics, and the end.
        rise, radiated = abs(load - now.step.load), impedance * total / thresholds.period_nodes
        now.stepping.explicit_steps += 1
        work *= grid.cell
        done = TakenStep(time, step, load, work, radiated, tables.increments, tables.strength)
        fall = finish_step(state, setting, done, record, taken)
        taken += 1
        calm = _calm(now, thresholds, step, impedance, rise)
        slid = thresholds.slid_stop and now.step.weakened_nodes >= thresholds.breakable
        if slid and (calm or not thresholds.held):
            reason = Reason.ALL_SLID
        elif thresholds.event_stop and fall > EVENT_DROP * now.run.scale:
            reason = Reason.DROPPED
        elif calm:
            end_event(now, thresholds.unstable_slip_rate, radiated)
            now.event.calm = now.event.open
            if thresholds.rest_stop and now.results.instabilities > 0:
                reason = Reason.AT_REST
            elif not thresholds.explicit_only:
                reason = Reason.TO_IMPLICIT
    return taken, reason

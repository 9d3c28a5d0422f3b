"""Explicit predictor-corrector steps: second order, one fixed step, all in one compiled loop."""

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
    value_at,
)
from stiction.problem.friction.kernels import strength_at

_CALM_STRESS = 1e-4  # Z V of waves that implicit steps may smear, in units of the stress scale


@jit_inside
def _transfer(grid: Grid, slip_hat: Array, memory_sum: Array, tables: ExplicitTables) -> None:
    """Stress `tables.transfer` along the interface if the rate, in `rate_hat`, acts for a step."""
    rate_hat, response, shared = tables.rate_hat, tables.response, tables.shared
    offset, step = grid.offset, tables.step
    static, dynamic = grid.stiffness[0], grid.stiffness[1]
    shared[0] = 0.0
    for q in range(1, shared.size):
        o, rate = offset[q], rate_hat[q]
        g, b, c = static[q], response[q], dynamic[q]
        slip = slip_hat[q] + step * rate
        real = c * (memory_sum[o] + b * rate.real) - g * slip.real
        imaginary = c * (memory_sum[o + ENTRIES] + b * rate.imag) - g * slip.imag
        shared[q] = complex(real, imaginary)
    backward(grid.transform, shared, tables.transfer)


@jit_inside
def _predict(
    state: RuptureState, setting: Setting, tables: ExplicitTables, load: float, impedance: float
) -> None:
    """Slip rate `tables.predicted` at the end of the step if the present one acted all along."""
    nodes, law = setting.nodes, setting.law
    slip, rate, transfer, predicted = state.slip, state.rate, tables.transfer, tables.predicted
    strength, residual, weakening = nodes.strength, nodes.residual, nodes.weakening
    profile, initial, step = nodes.profile, nodes.initial, tables.step
    for i in range(slip.size):
        ahead = slip[i] + step * rate[i]
        limit = strength_at(law, strength[i], residual[i], weakening[i], ahead)
        stuck = transfer[i] + load * profile[i] + initial[i]
        predicted[i] = max(stuck - limit, 0.0) / impedance


@jit_inside
def _correct(
    state: RuptureState, setting: Setting, tables: ExplicitTables, load: float, impedance: float
) -> Any:
    """Slip, rate and stress after the step; return (work, sum of V).

    `tables.transfer` then holds the strength, and `tables.predicted` what the mean of the rates
    before and after slips.
    """
    nodes, law, step = setting.nodes, setting.law, tables.step
    slip, rate, stress = state.slip, state.rate, state.stress
    transfer, predicted = tables.transfer, tables.predicted
    strength, residual, weakening = nodes.strength, nodes.residual, nodes.weakening
    profile, initial = nodes.profile, nodes.initial
    work, total = 0.0, 0.0
    mean_load = 0.5 * (load + state.diagnostics[0].load)
    for i in range(slip.size):
        increment = 0.5 * step * (rate[i] + predicted[i])
        next_slip = slip[i] + increment
        limit = strength_at(law, strength[i], residual[i], weakening[i], next_slip)
        stuck = transfer[i] + load * profile[i] + initial[i]
        v = max(stuck - limit, 0.0) / impedance
        work += increment * (mean_load * profile[i] + initial[i])
        predicted[i] = 0.5 * step * (rate[i] + v)
        transfer[i], slip[i], rate[i], stress[i] = limit, next_slip, v, stuck - impedance * v
        total += v
    return work, total


@jit_inside
def _calm(now: Any, thresholds: Thresholds, step: float, impedance: float, rise: float) -> Any:
    """Count calm steps; return whether there were enough of them in a row.

    Waves make slip rates come and go; creep is slow, or as fast as it was.
    """
    scale, before, top = now.scale, now.calm_rate, now.top_slip_rate
    quiet = top < _CALM_STRESS * scale / impedance + thresholds.calm_slip * rise / step
    steady = 0.5 * before <= top <= 2.0 * before
    # Once all has broken nothing but the load drives steady slip, however fast it rises.
    slow = top < STEADY_STRESS * scale / impedance or now.weakened_nodes >= thresholds.slid_stop
    if quiet or (steady and slow):
        now.calm_steps += 1
    else:
        now.calm_steps, now.calm_rate = 0, top
    return now.calm_steps >= thresholds.calm_count


@jit
def explicit_steps(
    count: int,
    state: RuptureState,
    grid: Grid,
    setting: Setting,
    tables: ExplicitTables,
    record: StepRecord,
) -> Any:
    """Take up to `count` explicit steps in place; return (steps taken, reason).

    `state.memory` holds psi/B. `record` has at least `count` rows, or none to keep nothing.
    """
    n, impedance, step = state.slip.size, grid.impedance, tables.step
    now, thresholds = state.diagnostics[0], setting.thresholds
    rate_hat, slip_hat = tables.rate_hat, state.slip_hat
    taken, reason = ZERO, Reason.DONE  # one way out: each costs as much to compile as the rest
    while taken < count and reason == Reason.DONE:
        time = now.time + step
        load = value_at(setting.load, time)
        forward(grid.transform, state.rate, rate_hat)
        _transfer(grid, slip_hat, state.memory_sum, tables)
        _predict(state, setting, tables, load, impedance)
        forward(grid.transform, tables.predicted, tables.shared)
        for q in range(rate_hat.size):
            rate_hat[q] = 0.5 * (rate_hat[q] + tables.shared[q])
        _transfer(grid, slip_hat, state.memory_sum, tables)
        work, total = _correct(state, setting, tables, load, impedance)
        if not np.isfinite(total):
            for i in range(n):
                if not np.isfinite(state.rate[i]):
                    now.non_finite_node = i
                    break
            now.time = time
            reason = Reason.NOT_FINITE
            break
        for q in range(rate_hat.size):
            slip_hat[q] += step * rate_hat[q]
        pack(grid.offset, rate_hat, tables.packed)
        advance_memory(
            state.memory, tables.table, tables.packed, state.memory_sum,
            grid.poles.size, grid.multiplicity,
        )  # fmt: skip
        rise, radiated = abs(load - now.load), impedance * total / n
        now.explicit_steps += 1
        done, limit = TakenStep(time, step, load, work * grid.cell, radiated), tables.transfer
        fall = finish_step(state, grid, setting, done, tables.predicted, limit, record, taken)
        taken += 1
        calm = _calm(now, thresholds, step, impedance, rise)
        if now.weakened_nodes >= thresholds.slid_stop and (calm or not thresholds.held):
            reason = Reason.ALL_SLID
        elif thresholds.event_stop and fall > EVENT_DROP * now.scale:
            reason = Reason.DROPPED
        elif calm:
            end_event(now, thresholds.unstable_rate, radiated)
            if thresholds.rest_stop and now.instabilities > 0:
                reason = Reason.AT_REST
            elif not thresholds.explicit_only:
                reason = Reason.TO_IMPLICIT
    return taken, reason

"""Explicit predictor-corrector steps: second order, one fixed step, all in one compiled loop."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.dynamics.diagnostics import Step, arrived, end_event, finish_step
from stiction.dynamics.loading import load_at
from stiction.dynamics.memory import advance_memory, pack
from stiction.dynamics.state import (
    ALL_SLID,
    AT_REST,
    DONE,
    DROPPED,
    NOT_FINITE,
    TO_IMPLICIT,
    ExplicitTables,
    Grid,
    Setting,
    State,
    Thresholds,
)
from stiction.elasticity.operator import backward, forward
from stiction.friction.kernels import strength_at
from stiction.jit import jit, jit_inside


@jit_inside
def _transfer(grid: Grid, slip_hat: Array, carried: Array, tables: ExplicitTables) -> None:
    """Stress `tables.moved` along the interface if the rate, in `rate_hat`, acts for a step."""
    rate_hat, fresh, shared = tables.rate_hat, tables.fresh, tables.shared
    place, step = grid.place, tables.step
    static, dynamic = grid.stiffness[0], grid.stiffness[1]
    shared[0] = 0.0
    for q in range(1, shared.size):
        o, rate = place[q], rate_hat[q]
        g, b, c = static[q], fresh[q], dynamic[q]
        slip = slip_hat[q] + step * rate
        real = c * (carried[o] + b * rate.real) - g * slip.real
        imaginary = c * (carried[o + 64] + b * rate.imag) - g * slip.imag
        shared[q] = complex(real, imaginary)
    backward(grid.transform, shared, tables.moved)


@jit_inside
def _predict(
    state: State, setting: Setting, tables: ExplicitTables, load: float, impedance: float
) -> None:
    """Slip rate `tables.guess` at the end of the step if the present one acted all along."""
    nodes, law = setting.nodes, setting.law
    slip, rate, moved, guess = state.slip, state.rate, tables.moved, tables.guess
    strength, residual, weakening = nodes.strength, nodes.residual, nodes.weakening
    profile, initial, step = nodes.profile, nodes.initial, tables.step
    for i in range(slip.size):
        ahead = slip[i] + step * rate[i]
        limit = strength_at(law, strength[i], residual[i], weakening[i], ahead)
        guess[i] = max(moved[i] + load * profile[i] + initial[i] - limit, 0.0) / impedance


@jit_inside
def _correct(
    state: State, setting: Setting, tables: ExplicitTables, load: float, impedance: float
) -> Any:
    """Slip and stress after the step, the rate in `tables.guess`; return (work, sum of V, slid)."""
    nodes, law, step = setting.nodes, setting.law, tables.step
    slip, rate, stress = state.slip, state.rate, state.stress
    moved, guess = tables.moved, tables.guess
    strength, residual, weakening = nodes.strength, nodes.residual, nodes.weakening
    critical, profile, initial = nodes.critical, nodes.profile, nodes.initial
    work, total, slid = 0.0, 0.0, 0
    mean_load = 0.5 * (load + state.diagnostics[0].load)
    for i in range(slip.size):
        increment = 0.5 * step * (rate[i] + guess[i])
        fresh_slip = slip[i] + increment
        limit = strength_at(law, strength[i], residual[i], weakening[i], fresh_slip)
        stuck = moved[i] + load * profile[i] + initial[i]
        v = max(stuck - limit, 0.0) / impedance
        work += increment * (mean_load * profile[i] + initial[i])
        guess[i] = v
        stress[i] = stuck - impedance * v
        total += v
        slip[i] = fresh_slip
        if fresh_slip >= critical[i]:
            slid += 1
    return work, total, slid


@jit_inside
def _arrive(state: State, critical: Array, half: float, tables: ExplicitTables, time: float) -> Any:
    """Take over the new rate; return (largest rate, its node, sum of the slip)."""
    slip, rate, arrival = state.slip, state.rate, state.arrival
    guess, step = tables.guess, tables.step
    top, node, slip_sum = -1.0, 0, 0.0
    for i in range(slip.size):
        if guess[i] > top:
            top, node = guess[i], i
        # d_c = 0 where nothing weakens: there the first slip counts.
        if np.isnan(arrival[i]) and slip[i] > 0.0 and slip[i] >= half * critical[i]:
            increment = 0.5 * step * (rate[i] + guess[i])
            arrival[i] = arrived(slip[i], half * critical[i], increment, time, step)
        slip_sum += slip[i]
        rate[i] = guess[i]
    return top, node, slip_sum


@jit_inside
def _calm(now: Any, thresholds: Thresholds, step: Step, impedance: float, rise: float) -> Any:
    """Count calm steps; return whether there were enough of them in a row.

    Waves make slip rates come and go; creep is slow, or as fast as it was.
    """
    scale = now.scale
    quiet = step.top < (
        thresholds.calm_stress * scale / impedance + thresholds.calm_slip * rise / step.size
    )
    before = now.calm_rate
    steady = 0.5 * before <= step.top <= 2.0 * before
    if quiet or (steady and step.top < thresholds.steady_stress * scale / impedance):
        now.calm_steps += 1
    else:
        now.calm_steps, now.calm_rate = 0, step.top
    return now.calm_steps >= thresholds.calm_count


@jit
def explicit_steps(
    count: int,
    state: State,
    grid: Grid,
    setting: Setting,
    tables: ExplicitTables,
    record: Array,
) -> Any:
    """Take up to `count` explicit steps in place; return (steps taken, reason).

    Parameters
    ----------
    state : State
        Updated; `memory` holds psi/B.
    grid, setting
    tables : ExplicitTables
        The arrays to work in are overwritten.
    record : (>= count, columns) array, or with no rows to keep nothing. Three more columns for
        each station: slip, slip rate and stress.
    """
    n, impedance, step = state.slip.size, grid.impedance, tables.step
    now, thresholds = state.diagnostics[0], setting.thresholds
    rate_hat, slip_hat = tables.rate_hat, state.slip_hat
    half = thresholds.arrival
    for taken in range(count):
        time = now.time + step
        load = load_at(setting.load_times, setting.load_values, time)
        forward(grid.transform, state.rate, rate_hat)
        _transfer(grid, slip_hat, state.carried, tables)
        _predict(state, setting, tables, load, impedance)
        forward(grid.transform, tables.guess, tables.shared)
        for q in range(rate_hat.size):
            rate_hat[q] = 0.5 * (rate_hat[q] + tables.shared[q])
        _transfer(grid, slip_hat, state.carried, tables)
        work, total, slid = _correct(state, setting, tables, load, impedance)
        if not np.isfinite(total):
            for i in range(n):
                if not np.isfinite(tables.guess[i]):
                    now.bad_node = i
                    break
            now.time = time
            return taken, NOT_FINITE
        top, node, slip_sum = _arrive(state, setting.nodes.critical, half, tables, time)
        for q in range(rate_hat.size):
            slip_hat[q] += step * rate_hat[q]
        pack(grid.place, rate_hat, tables.packed)
        advance_memory(
            state.memory, tables.table, tables.packed, state.carried, grid.poles.size, grid.copies
        )
        rise = abs(load - now.load)
        now.explicit_steps += 1
        radiated = impedance * total / n
        done = Step(time, step, load, work * grid.cell, radiated, slip_sum / n, slid, top, node)
        fall = finish_step(state, setting, record, taken, done)
        if slid >= thresholds.slid_stop:
            return taken + 1, ALL_SLID
        if thresholds.event_stop and fall > now.event_drop:
            return taken + 1, DROPPED
        if _calm(now, thresholds, done, impedance, rise):
            end_event(now, thresholds.unstable_rate, now.mean_stress, radiated)
            if thresholds.rest_stop and now.first_stress > -np.inf:
                return taken + 1, AT_REST
            if not thresholds.explicit_only:
                return taken + 1, TO_IMPLICIT
    return count, DONE

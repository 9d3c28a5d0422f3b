"""Explicit predictor-corrector steps: second order, one fixed step, all in one compiled loop."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.dynamics import monitor
from stiction.dynamics.arrays import ExplicitTables, Fields, Grid, Setting
from stiction.dynamics.finish import Taken, arrived, finish_step
from stiction.dynamics.loading import load_at
from stiction.dynamics.memory_layout import advance_memory, pack
from stiction.elasticity.operator import backward, forward
from stiction.friction.kernels import strength_at
from stiction.jit import jit


@jit
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


@jit
def _predict(
    fields: Fields, setting: Setting, tables: ExplicitTables, load: float, impedance: float
) -> None:
    """Slip rate `tables.guess` at the end of the step if the present one acted all along."""
    nodes, law = setting.nodes, setting.law
    slip, rate, moved, guess = fields.slip, fields.rate, tables.moved, tables.guess
    strength, residual, weakening = nodes.strength, nodes.residual, nodes.weakening
    profile, initial, step = nodes.profile, nodes.initial, tables.step
    for i in range(slip.size):
        ahead = slip[i] + step * rate[i]
        limit = strength_at(law, strength[i], residual[i], weakening[i], ahead)
        guess[i] = max(moved[i] + load * profile[i] + initial[i] - limit, 0.0) / impedance


@jit
def _correct(
    fields: Fields, setting: Setting, tables: ExplicitTables, load: float, impedance: float
) -> Any:
    """Slip and stress after the step, the rate in `tables.guess`; return (work, sum of V, slid)."""
    nodes, law, step = setting.nodes, setting.law, tables.step
    slip, rate, stress = fields.slip, fields.rate, fields.stress
    moved, guess = tables.moved, tables.guess
    strength, residual, weakening = nodes.strength, nodes.residual, nodes.weakening
    critical, profile, initial = nodes.critical, nodes.profile, nodes.initial
    work, total, slid = 0.0, 0.0, 0
    mean_load = 0.5 * (load + fields.watch[monitor.LOAD])
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


@jit
def _arrive(
    fields: Fields, critical: Array, half: float, tables: ExplicitTables, time: float
) -> Any:
    """Take over the new rate; return (largest rate, its node, sum of the slip)."""
    slip, rate, arrival = fields.slip, fields.rate, fields.arrival
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


@jit
def _calm(watch: Array, setting: Setting, step: Taken, impedance: float, rise: float) -> Any:
    """Count calm steps; whether there were enough of them in a row.

    Waves make slip rates come and go; creep is slow, or as fast as it was.
    """
    control, scale = setting.control, watch[monitor.SCALE]
    quiet = step.top < (
        control[monitor.CALM_STRESS] * scale / impedance
        + control[monitor.CALM_SLIP] * rise / step.size
    )
    before = watch[monitor.CALM_TOP]
    steady = 0.5 * before <= step.top <= 2.0 * before
    if quiet or (steady and step.top < control[monitor.STEADY_STRESS] * scale / impedance):
        watch[monitor.CALM_STEPS] += 1.0
    else:
        watch[monitor.CALM_STEPS], watch[monitor.CALM_TOP] = 0.0, step.top
    return watch[monitor.CALM_STEPS] >= control[monitor.CALM_COUNT]


@jit
def explicit_steps(
    count: int,
    fields: Fields,
    grid: Grid,
    setting: Setting,
    tables: ExplicitTables,
    record: Array,
) -> Any:
    """Take up to `count` explicit steps in place; return (steps taken, reason).

    Parameters
    ----------
    fields : Fields
        Updated; `memory` holds psi/B.
    grid, setting
    tables : ExplicitTables
        Their room to work is overwritten.
    record : (>= count, columns) array, or with no rows to keep nothing. Three more columns for
        each station: slip, slip rate and stress.
    """
    n, impedance, step = fields.slip.size, grid.impedance, tables.step
    watch, control, rate_hat = fields.watch, setting.control, tables.rate_hat
    slip_hat = fields.slip_hat
    half = control[monitor.ARRIVAL]
    for taken in range(count):
        time = watch[monitor.TIME] + step
        load = load_at(setting.load_times, setting.load_values, time)
        forward(grid.transform, fields.rate, rate_hat)
        _transfer(grid, slip_hat, fields.carried, tables)
        _predict(fields, setting, tables, load, impedance)
        forward(grid.transform, tables.guess, tables.shared)
        for q in range(rate_hat.size):
            rate_hat[q] = 0.5 * (rate_hat[q] + tables.shared[q])
        _transfer(grid, slip_hat, fields.carried, tables)
        work, total, slid = _correct(fields, setting, tables, load, impedance)
        if not np.isfinite(total):
            for i in range(n):
                if not np.isfinite(tables.guess[i]):
                    watch[monitor.BAD_NODE] = i
                    break
            watch[monitor.TIME] = time
            return taken, monitor.NOT_FINITE
        top, node, slip_sum = _arrive(fields, setting.nodes.critical, half, tables, time)
        for q in range(rate_hat.size):
            slip_hat[q] += step * rate_hat[q]
        pack(grid.place, rate_hat, tables.packed)
        advance_memory(
            fields.memory, tables.table, tables.packed, fields.carried, grid.poles.size, grid.copies
        )
        rise = abs(load - watch[monitor.LOAD])
        watch[monitor.EXPLICIT_STEPS] += 1.0
        radiated = impedance * total / n
        done = Taken(time, step, load, work * grid.cell, radiated, slip_sum / n, slid, top, node)
        fall = finish_step(fields, setting, record, taken, done)
        if slid >= control[monitor.SLID_STOP]:
            return taken + 1, monitor.ALL_SLID
        if control[monitor.EVENT_STOP] > 0.0 and fall > watch[monitor.EVENT_DROP]:
            return taken + 1, monitor.DROPPED
        if _calm(watch, setting, done, impedance, rise):
            monitor.settle(watch, control, watch[monitor.MEAN_STRESS], radiated)
            if control[monitor.REST_STOP] > 0.0 and watch[monitor.FIRST_STRESS] > -np.inf:
                return taken + 1, monitor.AT_REST
            if not control[monitor.EXPLICIT_ONLY] > 0.0:
                return taken + 1, monitor.TO_IMPLICIT
    return count, monitor.DONE

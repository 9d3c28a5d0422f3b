"""Implicit steps of adaptive size while the interface creeps, in one compiled loop."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.dynamics import monitor
from stiction.dynamics.arrays import Fields, Grid, ImplicitTables, Setting
from stiction.dynamics.complementarity import solve_increment
from stiction.dynamics.finish import Taken, arrived, finish_step
from stiction.dynamics.implicit_tables import carry, remember, tabulate
from stiction.dynamics.loading import load_at
from stiction.elasticity.operator import backward, forward
from stiction.friction.kernels import strength_at
from stiction.jit import jit

_ROUND_OFF = 1e-14  # of the largest stress: what a few transforms leave, ten times over


class _Attempt(NamedTuple):
    """One step that is tried.

    V at its end is mean + share (mean - past mean); its slope in the step, a second difference of
    slip, is (mean - past mean) bend.
    """

    size: float
    time: float
    load: float
    share: float
    bend: float


class _Outcome(NamedTuple):
    """What a step that was tried does: the strength that a node loses, the total slip, Z <V>."""

    largest: float
    total: float
    radiated: float


@jit
def _choose_size(watch: Array, setting: Setting, step: float) -> Any:
    """Size to try; return (size, step to go on with, whether cut short, whether the last one)."""
    control, now, clipped, size = setting.control, watch[monitor.TIME], False, step
    smallest = control[monitor.SMALLEST_STEP]
    small = control[monitor.LOAD_STEP] * watch[monitor.SCALE]
    while True:
        rise = load_at(setting.load_times, setting.load_values, now + size) - watch[monitor.LOAD]
        if size <= smallest or abs(rise) <= small:
            break
        size /= np.sqrt(2.0)
        step = size
    for turn_time in setting.turns:  # land on each peak of the load, or creep would miss its top
        ahead = turn_time - now
        if 1e-6 * smallest < ahead < size:
            size = ahead
            clipped = True
            break
    last = now + size > control[monitor.END_TIME]
    if last:
        size = control[monitor.END_TIME] - now
        clipped = True
    return size, step, clipped, last


@jit
def _assemble(
    fields: Fields, grid: Grid, setting: Setting, tables: ImplicitTables, attempt: _Attempt
) -> Any:
    """Matrix, stress if nothing slipped, and first guess; return the accuracy to ask for, Pa."""
    stiffness, slot, fresh, turn = grid.stiffness, grid.slot, tables.fresh, tables.turn
    symbol, pushed_hat, past_hat = tables.symbol, tables.work, tables.past_hat
    size, share, bend, impedance = attempt.size, attempt.share, attempt.bend, grid.impedance
    if size != tables.made[0]:
        tabulate(grid, size, tables)
    if size != tables.made[0] or share != tables.made[1]:
        symbol[0] = impedance * (1.0 + share) / size
        for q in range(1, symbol.size):
            fading = stiffness[1, q] * (fresh[slot[q]] + bend * turn[slot[q]]) / size
            symbol[q] = symbol[0] + stiffness[0, q] - fading
        for q in range(symbol.size):
            tables.inverse[q] = 1.0 / symbol[q]
        tables.made[0], tables.made[1] = size, share
    carry(grid, fields.memory, tables)
    forward(grid.transform, fields.past, past_hat)
    pushed_hat[0] = impedance * share * past_hat[0]
    for q in range(1, pushed_hat.size):
        pushed_hat[q] = (
            stiffness[1, q] * (tables.carried[q] - bend * turn[slot[q]] * past_hat[q])
            - stiffness[0, q] * fields.slip_hat[q]
            + impedance * share * past_hat[q]
        )
    backward(grid.transform, pushed_hat, tables.pushed)
    pushed, profile, initial = tables.pushed, setting.nodes.profile, setting.nodes.initial
    level = 0.0
    for i in range(pushed.size):
        pushed[i] += attempt.load * profile[i] + initial[i]
        level = max(level, abs(pushed[i]))
        tables.increment[i] = fields.past[i] * size
        tables.state[i] = 1 if fields.rate[i] > 0.0 else 0
    # Round-off of the transforms bounds what can be asked for.
    asked = setting.control[monitor.RESIDUAL] * fields.watch[monitor.SCALE]
    return max(asked, _ROUND_OFF * level)


@jit
def _try(
    fields: Fields, grid: Grid, setting: Setting, tables: ImplicitTables, attempt: _Attempt
) -> Any:
    """Solve for the slip increments; return whether that succeeded and the outcome."""
    control, nodes, law, u = setting.control, setting.nodes, setting.law, tables.increment
    accuracy = _assemble(fields, grid, setting, tables, attempt)
    near = accuracy if control[monitor.CURVED] > 0.0 else 0.0
    solved = solve_increment(grid.transform, setting, fields.slip, tables, accuracy, near)
    slip, past, scale = fields.slip, fields.past, fields.watch[monitor.SCALE]
    peak, residual, weakening = nodes.strength, nodes.residual, nodes.weakening
    critical, size, share = nodes.critical, attempt.size, attempt.share
    largest, total = 0.0, 0.0
    if solved:
        least = control[monitor.SMALL_DROP] * scale
        creep = control[monitor.STEADY_STRESS] * scale * size / grid.impedance
        for i in range(u.size):
            if slip[i] < critical[i] and u[i] > 0.0:
                lost = strength_at(law, peak[i], residual[i], weakening[i], slip[i])
                lost -= strength_at(law, peak[i], residual[i], weakening[i], slip[i] + u[i])
                largest = max(largest, lost / max(peak[i] - residual[i], least))
            elif u[i] > creep and critical[i] > 0.0:
                largest = max(largest, u[i] / critical[i])
            total += u[i]
    radiated = 0.0
    for i in range(u.size):
        radiated += max(u[i] / size * (1.0 + share) - share * past[i], 0.0)
    return solved, _Outcome(largest, total, radiated * (grid.impedance / u.size))


@jit
def _races(watch: Array, control: Array, attempt: _Attempt, outcome: _Outcome) -> Any:
    """Whether the interface accelerates too much for the load at onset to be accurate."""
    scale, radiated = watch[monitor.SCALE], outcome.radiated
    # A step that raises the load by next to nothing cannot put the onset wrong.
    rise = abs(attempt.load - watch[monitor.LOAD])
    matters = rise > control[monitor.NEGLIGIBLE] * scale
    noticed = control[monitor.NOTICED] * scale
    before = max(watch[monitor.RADIATED], noticed)
    racing = radiated > noticed and radiated > control[monitor.GROWTH] * before
    # At the smallest size, waves of an arrested event alone do not call for explicit steps.
    shorter = (
        0.5 * attempt.size >= control[monitor.SMALLEST_STEP]
        or outcome.largest > 0.1 * control[monitor.SLIP_STEP]
    )
    return racing and matters and shorter and attempt.share > 0.0


@jit
def _accept(
    fields: Fields,
    grid: Grid,
    setting: Setting,
    tables: ImplicitTables,
    attempt: _Attempt,
    radiated: float,
) -> Any:
    """Take the step; return it as what is told to the monitor."""
    size, share, bend, load = attempt.size, attempt.share, attempt.bend, attempt.load
    nodes, u, moved = setting.nodes, tables.increment, tables.pushed
    rate_hat, past_hat, moved_hat = tables.rate_hat, tables.past_hat, tables.work
    stiffness, slot, slip_hat = grid.stiffness, grid.slot, fields.slip_hat
    forward(grid.transform, u, rate_hat)
    for q in range(rate_hat.size):
        slip_hat[q] += rate_hat[q]
        rate_hat[q] /= size
        past_hat[q] = bend * (rate_hat[q] - past_hat[q])
    remember(grid, fields.memory, tables)
    moved_hat[0] = 0.0
    for q in range(1, moved_hat.size):
        fresh, turn = tables.fresh[slot[q]], tables.turn[slot[q]]
        memory_part = tables.carried[q] + fresh * rate_hat[q] + turn * past_hat[q]
        moved_hat[q] = stiffness[1, q] * memory_part - stiffness[0, q] * slip_hat[q]
    backward(grid.transform, moved_hat, moved)
    slip, rate, past, stress = fields.slip, fields.rate, fields.past, fields.stress
    critical, profile, initial = nodes.critical, nodes.profile, nodes.initial
    half = setting.control[monitor.ARRIVAL]
    mean_load = 0.5 * (load + fields.watch[monitor.LOAD])
    work, slid, slip_sum, top, node = 0.0, 0, 0.0, -1.0, 0
    for i in range(u.size):
        work += u[i] * (mean_load * profile[i] + initial[i])
        slip[i] += u[i]
        rate[i] = max(u[i] / size * (1.0 + share) - share * past[i], 0.0)
        past[i] = u[i] / size
        stress[i] = moved[i] + load * profile[i] + initial[i] - grid.impedance * rate[i]
        slip_sum += slip[i]
        if slip[i] >= critical[i]:
            slid += 1
        if rate[i] > top:
            top, node = rate[i], i
        if np.isnan(fields.arrival[i]) and slip[i] > 0.0 and slip[i] >= half * critical[i]:
            fields.arrival[i] = arrived(slip[i], half * critical[i], u[i], attempt.time, size)
    mean_slip = slip_sum / u.size
    return Taken(attempt.time, size, load, work * grid.cell, radiated, mean_slip, slid, top, node)


@jit
def _next_size(control: Array, size: float, largest: float, growing: bool) -> Any:
    """Sizes change by powers of sqrt 2, so that tables are reused while the size stays."""
    root, asked = np.sqrt(2.0), control[monitor.SLIP_STEP]
    if largest > asked:
        return size / root
    if largest < 0.25 * asked and not growing:
        return min(2.0 * size, control[monitor.LARGEST_STEP])
    if largest < 0.7 * asked and not growing:
        return min(root * size, control[monitor.LARGEST_STEP])
    return size


@jit
def implicit_steps(
    count: int,
    step: float,
    fields: Fields,
    grid: Grid,
    setting: Setting,
    tables: ImplicitTables,
    record: Array,
) -> Any:
    """Take up to `count` accepted implicit steps in place; return (steps, next size, reason).

    Parameters as in `explicit_steps`; `fields.memory` holds psi itself, `step` is the size to try
    first. Second order: the slip rate at the end of a step follows from the mean rates of this
    step and of the one before (`past`, m/s; none if PAST_STEP is 0), as in the two-step backward
    differences, and the memory sees it rise or fall linearly.
    A step is repeated at half the size if no slip increments are found (negative curvature: the
    patches are unstable at this size), a node weakens too much, or the interface accelerates too
    much. Creep of nodes at their residual strength does not count, nor the weakening of nodes that
    weaken by next to nothing.
    """
    watch, control = fields.watch, setting.control
    smallest = control[monitor.SMALLEST_STEP]
    taken = 0
    while taken < count:
        size, step, clipped, last = _choose_size(watch, setting, step)
        if size < smallest and not clipped:
            return taken, step, monitor.TO_EXPLICIT
        past_step = watch[monitor.PAST_STEP]
        share = size / (size + past_step) if past_step > 0.0 else 0.0
        time = watch[monitor.TIME] + size
        load = load_at(setting.load_times, setting.load_values, time)
        attempt = _Attempt(size, time, load, share, 2.0 * share / size)
        solved, outcome = _try(fields, grid, setting, tables, attempt)
        if not np.isfinite(outcome.total):
            watch[monitor.BAD_NODE] = 0.0
            return taken, step, monitor.NOT_FINITE
        too_much = outcome.largest > 2.0 * control[monitor.SLIP_STEP]
        if not solved or too_much or _races(watch, control, attempt, outcome):
            watch[monitor.REJECTED_STEPS] += 1.0
            step = size / 2.0
            if step < smallest:
                return taken, step, monitor.TO_EXPLICIT
            continue
        noticed = control[monitor.NOTICED] * watch[monitor.SCALE]
        steady = np.sqrt(control[monitor.GROWTH]) * watch[monitor.RADIATED]
        growing = outcome.radiated > noticed and outcome.radiated > steady
        done = _accept(fields, grid, setting, tables, attempt, outcome.radiated)
        watch[monitor.IMPLICIT_STEPS] += 1.0
        watch[monitor.PAST_STEP], watch[monitor.RADIATED] = size, outcome.radiated
        fall = finish_step(fields, setting, record, taken, done)
        taken += 1
        if done.slid >= control[monitor.SLID_STOP]:
            return taken, step, monitor.ALL_SLID
        if control[monitor.EVENT_STOP] > 0.0 and fall > watch[monitor.EVENT_DROP]:
            return taken, step, monitor.DROPPED
        if last or watch[monitor.TIME] >= control[monitor.END_TIME]:
            return taken, step, monitor.DONE
        if clipped:
            continue
        step = _next_size(control, size, outcome.largest, growing)
        if step < smallest:
            return taken, step, monitor.TO_EXPLICIT
    return taken, step, monitor.DONE

"""Implicit steps of adaptive size while the interface creeps, in one compiled loop."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.dynamics.complementarity import solve_increment
from stiction.dynamics.diagnostics import Step, arrived, finish_step
from stiction.dynamics.loading import load_at
from stiction.dynamics.memory import advance_with_ramp, fading_memory, tabulate
from stiction.dynamics.state import (
    ALL_SLID,
    DONE,
    DROPPED,
    NOT_FINITE,
    TO_EXPLICIT,
    Grid,
    ImplicitTables,
    Setting,
    State,
    Thresholds,
)
from stiction.elasticity.operator import backward, forward
from stiction.friction.kernels import strength_at
from stiction.jit import jit, jit_inside

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


@jit_inside
def _choose_size(now: Any, setting: Setting, step: float) -> Any:
    """Return (size to try, step to go on with, whether cut short, whether the last one)."""
    thresholds, time, clipped, size = setting.thresholds, now.time, False, step
    smallest = thresholds.smallest_step
    small = thresholds.load_step * now.scale
    while True:
        rise = load_at(setting.load_times, setting.load_values, time + size) - now.load
        if size <= smallest or abs(rise) <= small:
            break
        size /= np.sqrt(2.0)
        step = size
    for turn_time in setting.turns:  # land on each peak of the load, or creep would miss its top
        ahead = turn_time - time
        if 1e-6 * smallest < ahead < size:
            size = ahead
            clipped = True
            break
    last = time + size > thresholds.end_time
    if last:
        size = thresholds.end_time - time
        clipped = True
    return size, step, clipped, last


@jit_inside
def _assemble(
    state: State, grid: Grid, setting: Setting, tables: ImplicitTables, attempt: _Attempt
) -> Any:
    """Matrix, stress if nothing slipped, and first guess; return the accuracy to ask for, Pa."""
    stiffness, entry, fresh, ramp = grid.stiffness, grid.entry, tables.fresh, tables.fresh_ramp
    symbol, pushed_hat, past_hat = tables.symbol, tables.work, tables.past_hat
    size, share, bend, impedance = attempt.size, attempt.share, attempt.bend, grid.impedance
    if size != tables.made[0]:
        tabulate(grid, size, tables)
    if size != tables.made[0] or share != tables.made[1]:
        symbol[0] = impedance * (1.0 + share) / size
        for q in range(1, symbol.size):
            fading = stiffness[1, q] * (fresh[entry[q]] + bend * ramp[entry[q]]) / size
            symbol[q] = symbol[0] + stiffness[0, q] - fading
        for q in range(symbol.size):
            tables.inverse[q] = 1.0 / symbol[q]
        tables.made[0], tables.made[1] = size, share
    fading_memory(grid, state.memory, tables)
    forward(grid.transform, state.past, past_hat)
    pushed_hat[0] = impedance * share * past_hat[0]
    for q in range(1, pushed_hat.size):
        pushed_hat[q] = (
            stiffness[1, q] * (tables.carried[q] - bend * ramp[entry[q]] * past_hat[q])
            - stiffness[0, q] * state.slip_hat[q]
            + impedance * share * past_hat[q]
        )
    backward(grid.transform, pushed_hat, tables.pushed)
    pushed, profile, initial = tables.pushed, setting.nodes.profile, setting.nodes.initial
    level = 0.0
    for i in range(pushed.size):
        pushed[i] += attempt.load * profile[i] + initial[i]
        level = max(level, abs(pushed[i]))
        tables.increment[i] = state.past[i] * size
        tables.slipping[i] = 1 if state.rate[i] > 0.0 else 0
    # Round-off of the transforms bounds what can be asked for.
    asked = setting.thresholds.residual * state.diagnostics[0].scale
    return max(asked, _ROUND_OFF * level)


@jit_inside
def _try(
    state: State, grid: Grid, setting: Setting, tables: ImplicitTables, attempt: _Attempt
) -> Any:
    """Solve for the slip increments; return whether that succeeded and the outcome."""
    thresholds, nodes, law, u = setting.thresholds, setting.nodes, setting.law, tables.increment
    accuracy = _assemble(state, grid, setting, tables, attempt)
    near = accuracy if thresholds.curved else 0.0
    solved = solve_increment(grid.transform, setting, state.slip, tables, accuracy, near)
    slip, past, scale = state.slip, state.past, state.diagnostics[0].scale
    peak, residual, weakening = nodes.strength, nodes.residual, nodes.weakening
    critical, size, share = nodes.critical, attempt.size, attempt.share
    largest, total = 0.0, 0.0
    if solved:
        least = thresholds.small_drop * scale
        creep = thresholds.steady_stress * scale * size / grid.impedance
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


@jit_inside
def _races(now: Any, thresholds: Thresholds, attempt: _Attempt, outcome: _Outcome) -> Any:
    """Whether the interface accelerates too much for the load at onset to be accurate."""
    scale, radiated = now.scale, outcome.radiated
    # A step that raises the load by next to nothing cannot put the onset wrong.
    rise = abs(attempt.load - now.load)
    matters = rise > thresholds.negligible * scale
    noticed = thresholds.noticed * scale
    before = max(now.radiated, noticed)
    racing = radiated > noticed and radiated > thresholds.growth * before
    # At the smallest size, waves of an arrested event alone do not call for explicit steps.
    shorter = (
        0.5 * attempt.size >= thresholds.smallest_step
        or outcome.largest > 0.1 * thresholds.slip_step
    )
    return racing and matters and shorter and attempt.share > 0.0


@jit_inside
def _accept(
    state: State,
    grid: Grid,
    setting: Setting,
    tables: ImplicitTables,
    attempt: _Attempt,
    radiated: float,
) -> Any:
    """Take the step; return it as what is told to the"""
    size, share, bend, load = attempt.size, attempt.share, attempt.bend, attempt.load
    nodes, u, moved = setting.nodes, tables.increment, tables.pushed
    rate_hat, past_hat, moved_hat = tables.rate_hat, tables.past_hat, tables.work
    stiffness, entry, slip_hat = grid.stiffness, grid.entry, state.slip_hat
    forward(grid.transform, u, rate_hat)
    for q in range(rate_hat.size):
        slip_hat[q] += rate_hat[q]
        rate_hat[q] /= size
        past_hat[q] = bend * (rate_hat[q] - past_hat[q])
    advance_with_ramp(grid, state.memory, tables)
    moved_hat[0] = 0.0
    for q in range(1, moved_hat.size):
        fresh, ramp = tables.fresh[entry[q]], tables.fresh_ramp[entry[q]]
        memory_part = tables.carried[q] + fresh * rate_hat[q] + ramp * past_hat[q]
        moved_hat[q] = stiffness[1, q] * memory_part - stiffness[0, q] * slip_hat[q]
    backward(grid.transform, moved_hat, moved)
    slip, rate, past, stress = state.slip, state.rate, state.past, state.stress
    critical, profile, initial = nodes.critical, nodes.profile, nodes.initial
    half = setting.thresholds.arrival
    mean_load = 0.5 * (load + state.diagnostics[0].load)
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
        if np.isnan(state.arrival[i]) and slip[i] > 0.0 and slip[i] >= half * critical[i]:
            state.arrival[i] = arrived(slip[i], half * critical[i], u[i], attempt.time, size)
    mean_slip = slip_sum / u.size
    return Step(attempt.time, size, load, work * grid.cell, radiated, mean_slip, slid, top, node)


@jit_inside
def _next_size(thresholds: Thresholds, size: float, largest: float, growing: bool) -> Any:
    """Sizes change by powers of sqrt 2, so that tables are reused while the size stays."""
    root, asked = np.sqrt(2.0), thresholds.slip_step
    if largest > asked:
        return size / root
    if largest < 0.25 * asked and not growing:
        return min(2.0 * size, thresholds.largest_step)
    if largest < 0.7 * asked and not growing:
        return min(root * size, thresholds.largest_step)
    return size


@jit
def implicit_steps(
    count: int,
    step: float,
    state: State,
    grid: Grid,
    setting: Setting,
    tables: ImplicitTables,
    record: Array,
) -> Any:
    """Take up to `count` accepted implicit steps in place; return (steps, next size, reason).

    Parameters as in `explicit_steps`; `state.memory` holds psi itself, `step` is the size to try
    first. Second order: the slip rate at the end of a step follows from the mean rates of this
    step and of the one before (`past`, m/s; none if `past_step` is 0), as in the two-step backward
    differences, and the memory sees it rise or fall linearly.
    A step is repeated at half the size if no slip increments are found (negative curvature: the
    patches are unstable at this size), a node weakens too much, or the interface accelerates too
    much. Creep of nodes at their residual strength does not count, nor the weakening of nodes that
    weaken by next to nothing.
    """
    now, thresholds = state.diagnostics[0], setting.thresholds
    smallest = thresholds.smallest_step
    taken = 0
    while taken < count:
        size, step, clipped, last = _choose_size(now, setting, step)
        if size < smallest and not clipped:
            return taken, step, TO_EXPLICIT
        past_step = now.past_step
        share = size / (size + past_step) if past_step > 0.0 else 0.0
        time = now.time + size
        load = load_at(setting.load_times, setting.load_values, time)
        attempt = _Attempt(size, time, load, share, 2.0 * share / size)
        solved, outcome = _try(state, grid, setting, tables, attempt)
        if not np.isfinite(outcome.total):
            now.bad_node = 0
            return taken, step, NOT_FINITE
        too_much = outcome.largest > 2.0 * thresholds.slip_step
        if not solved or too_much or _races(now, thresholds, attempt, outcome):
            now.rejected_steps += 1
            step = size / 2.0
            if step < smallest:
                return taken, step, TO_EXPLICIT
            continue
        noticed = thresholds.noticed * now.scale
        steady = np.sqrt(thresholds.growth) * now.radiated
        growing = outcome.radiated > noticed and outcome.radiated > steady
        done = _accept(state, grid, setting, tables, attempt, outcome.radiated)
        now.implicit_steps += 1
        now.past_step, now.radiated = size, outcome.radiated
        fall = finish_step(state, setting, record, taken, done)
        taken += 1
        if done.slid >= thresholds.slid_stop:
            return taken, step, ALL_SLID
        if thresholds.event_stop and fall > now.event_drop:
            return taken, step, DROPPED
        if last or now.time >= thresholds.end_time:
            return taken, step, DONE
        if clipped:
            continue
        step = _next_size(thresholds, size, outcome.largest, growing)
        if step < smallest:
            return taken, step, TO_EXPLICIT
    return taken, step, DONE

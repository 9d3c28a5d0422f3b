"""Implicit steps with adaptive size while the interface creeps, in a compiled loop.

Problem
-------
Advance equations (1) and (2) of `state` by a step h. The unknowns are
the slip increments u >= 0. Let u/h be the mean slip rate in this step,
V' the mean rate in the previous step, h' the size of the previous step,
and r = h/(h + h'). To second order the slip rate at the end of the step
is

    V = u/h + r (u/h - V'),                                          (1)

as in the two-step backward differences of C. F. Curtiss and J. O.
Hirschfelder (Proceedings of the National Academy of Sciences 38, 1952).
In the step, the rate changes linearly with the slope a = 2 r (u/h -
V')/h. If there is no previous step, r = 0, and the step is of first
order. The stress at the end is, mode by mode,

    tau_0 p + tau_i - Z V - K (slip + u)
        + (G|k|/2) (S + u/h Re sum_p w_p B + a Re sum_p w_p R),      (2)

with S, B and R of `memory`. This is linear in u, so u solves the
complementarity problem of `complementarity` with a circulant matrix.

Algorithm
---------
1. Choose a size: as proposed, but smaller if the load would rise too
   much. The step is cut short at a turning point of the load or at the
   end time (`_choose_size`).
2. Assemble the matrix and the stress without slip in this step
   (`_assemble`).
3. Solve for u (`complementarity.solve_increment`).
4. Go to step 1 with half the size if no u is found (a patch is unstable
   at this size), if a node weakens too much (`_effect`), or if the
   interface accelerates too much (`_accelerates`). If half the size is
   below the smallest size, explicit steps take over.
5. Take the step (`_accept`), and update the diagnostics (`diagnostics`).
6. Choose the next size from the weakening of the nodes (`_next_size`).
   Sizes change by powers of sqrt 2, so that tables can be used again.
"""

from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit, jit_inside
from stiction.elasticity.operator import backward, forward
from stiction.methods.dynamics.complementarity import solve_increment
from stiction.methods.dynamics.diagnostics import (
    EVENT_DROP,
    STEADY_STRESS,
    TakenStep,
    finish_step,
)
from stiction.methods.dynamics.memory import advance_with_ramp, fading_memory, tabulate
from stiction.methods.dynamics.state import (
    ImplicitTables,
    Reason,
    RuptureState,
    Setting,
    StepRecord,
    Thresholds,
    node_strength,
    value_at,
)

LARGEST_STEP = 1e20  # s
_ROUND_OFF_SHARE = 1e-14  # of the largest stress: ten times the error of the transforms
# Fractions of the stress scale:
_SOLVED_STRESS = 1e-9  # stress at which a step counts as solved
_SMALL_DROP = 0.1  # a node with a smaller tau_p - tau_r is not resolved to `slip_step`
_FREE_LOAD_RISE = 5e-7  # rise of the load in a step with any acceleration
_NOTICED_RADIATION = 1e-7  # Z <V> from which its growth in a step is limited
_MAX_ACCELERATION = 1.3  # largest factor of this growth
# Sizes are powers of sqrt(2) times the smallest size, up to round-off,
# which must have no effect.
_JUST_BELOW, _JUST_ABOVE = 1.0 - 1e-9, 1.0 + 1e-9


class _Attempt(NamedTuple):
    """A step that may be taken."""

    size: float  # h, s
    time: float  # at its end, s
    load: float  # at its end, Pa
    ratio: float  # r of (1)
    rise: float  # 2 r/h = a/(u/h - V'), 1/s


@jit_inside
def _choose_size(now: Any, setting: Setting, step: float) -> Any:
    """Step 1: return (size to try, size for later steps, whether cut short, whether the last)."""

    thresholds, time, clipped, size = setting.thresholds, now.step.time, False, step
    smallest = thresholds.smallest_step
    small = thresholds.load_step * now.run.scale
    while True:
        rise = value_at(setting.load, time + size) - now.step.load
        if size <= _JUST_ABOVE * smallest or abs(rise) <= small:
            break
        size /= np.sqrt(2.0)
        step = size
    for turning_time in setting.turning_times:  # land on each peak of the load
        ahead = turning_time - time
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
    state: RuptureState, setting: Setting, tables: ImplicitTables, attempt: _Attempt
) -> Any:
    """Step 2: write the matrix, the stress without slip, and the first guess of u.

    Return the accuracy of u, Pa.
    """
    grid, problem = setting.grid, tables.problem
    stiffness, entry, symbol = grid.stiffness, grid.entry, problem.symbol
    response, ramp, past_hat = tables.response, tables.ramp_response, tables.past_hat
    size, ratio, rise = attempt.size, attempt.ratio, attempt.rise
    impedance = grid.impedance
    # Tables of the size and a matrix of
    # size and ratio often serve many steps.
    other_size = not tables.filled[0] or size != tables.valid_for[0]
    if other_size:
        tabulate(grid, size, tables)
    if other_size or ratio != tables.valid_for[1]:
        symbol[0] = impedance * (1.0 + ratio) / size
        for q in range(1, symbol.size):
            fading = stiffness[1, q] * (response[entry[q]] + rise * ramp[entry[q]]) / size
            symbol[q] = symbol[0] + stiffness[0, q] - fading
        for q in range(symbol.size):
            problem.inverse[q] = 1.0 / symbol[q]
        tables.valid_for[0], tables.valid_for[1], tables.filled[0] = size, ratio, 1
    fading_memory(grid, state.memory, tables)
    forward(grid.transform, state.past, past_hat)
    trial_hat, trial = problem.work, problem.trial
    trial_hat[0] = impedance * ratio * past_hat[0]
    for q in range(1, trial_hat.size):
        memory = tables.memory_sum[q] - rise * ramp[entry[q]] * past_hat[q]
        elastic = stiffness[1, q] * memory - stiffness[0, q] * state.slip_hat[q]
        trial_hat[q] = elastic + impedance * ratio * past_hat[q]
    backward(grid.transform, trial_hat, trial)
    profile, initial = setting.nodes.profile, setting.nodes.initial
    largest = 0.0
    for i in range(trial.size):
        trial[i] += attempt.load * profile[i] + initial[i]
        if setting.nodes.peak[i] < np.inf:
            largest = max(largest, abs(trial[i]))
        problem.increment[i] = state.past[i] * size
        problem.slipping[i] = 1 if state.slip_rate[i] > 0.0 else 0
    # Round-off of the transforms limits the accuracy.
    return max(_SOLVED_STRESS * state.diagnostics[0].run.scale, _ROUND_OFF_SHARE * largest)


@jit_inside
def _effect(state: RuptureState, setting: Setting, u: Array, attempt: _Attempt) -> Any:
    """Step 4: return (largest weakening of a node, total slip, Z <V>) due to slip increments u.

    Weakening is a fraction of tau_p - tau_r. Creep at the residual
    strength counts if it is fast.
    """
    nodes, slip, past = setting.nodes, state.slip, state.past
    residual_slip, size, ratio = nodes.residual_slip, attempt.size, attempt.ratio
    scale, impedance = state.diagnostics[0].run.scale, setting.grid.impedance
    largest, total, radiated = 0.0, 0.0, 0.0
    smallest_drop, fast_slip = _SMALL_DROP * scale, STEADY_STRESS * scale * size / impedance
    for i in range(u.size):
        if slip[i] < residual_slip[i] and u[i] > 0.0:
            lost = node_strength(setting, i, slip[i])
            lost -= node_strength(setting, i, slip[i] + u[i])
            largest = max(largest, lost / max(nodes.peak[i] - nodes.residual[i], smallest_drop))
        elif u[i] > fast_slip and residual_slip[i] > 0.0:
            largest = max(largest, u[i] / residual_slip[i])
        total += u[i]
        radiated += max(u[i] / size * (1.0 + ratio) - ratio * past[i], 0.0)
    return largest, total, radiated * (impedance / setting.thresholds.period_nodes)


@jit_inside
def _accelerates(
    now: Any, thresholds: Thresholds, attempt: _Attempt, largest: float, radiated: float
) -> Any:
    """Step 4: return whether the interface accelerates too much for an accurate load at onset."""
    # A step that hardly raises the load cannot misplace the onset.
    matters = abs(attempt.load - now.step.load) > _FREE_LOAD_RISE * now.run.scale
    noticed = _NOTICED_RADIATION * now.run.scale
    allowed = _MAX_ACCELERATION * max(now.stepping.previous_radiated, noticed)
    growing = radiated > noticed and radiated > allowed
    # At the smallest size, waves of an arrested event alone are no
    # reason for explicit steps.
    halved = 0.5 * attempt.size >= _JUST_BELOW * thresholds.smallest_step
    shorter = halved or largest > 0.1 * thresholds.slip_step
    return growing and matters and shorter and attempt.ratio > 0.0


@jit_inside
def _accept(
    state: RuptureState, setting: Setting, tables: ImplicitTables, attempt: _Attempt
) -> Any:
    """Step 5: take the step in place.

    Write the strength after it, and return the work, J/m.
    """
    size, ratio, rise, load = attempt.size, attempt.ratio, attempt.rise, attempt.load
    grid, u = setting.grid, tables.problem.increment
    transfer, transfer_hat = tables.transfer, tables.problem.work
    slip_rate_hat, slope_hat, slip_hat = tables.slip_rate_hat, tables.slope_hat, state.slip_hat
    forward(grid.transform, u, slip_rate_hat)
    for q in range(slip_rate_hat.size):
        slip_hat[q] += slip_rate_hat[q]
        # Part by part: complex division is slow to compile and to run.
        mean = complex(slip_rate_hat[q].real / size, slip_rate_hat[q].imag / size)
        slip_rate_hat[q], slope_hat[q] = mean, rise * (mean - tables.past_hat[q])
    advance_with_ramp(grid, state.memory, tables)
    transfer_hat[0] = 0.0
    for q in range(1, transfer_hat.size):
        j = grid.entry[q]
        memory = tables.memory_sum[q] + tables.response[j] * slip_rate_hat[q]
        memory += tables.ramp_response[j] * slope_hat[q]
        transfer_hat[q] = grid.stiffness[1, q] * memory - grid.stiffness[0, q] * slip_hat[q]
    backward(grid.transform, transfer_hat, transfer)
    slip, slip_rate, past, stress = state.slip, state.slip_rate, state.past, state.stress
    profile, initial = setting.nodes.profile, setting.nodes.initial
    mean_load = 0.5 * (load + state.diagnostics[0].step.load)
    work = 0.0
    for i in range(u.size):
        work += u[i] * (mean_load * profile[i] + initial[i])
        slip[i] += u[i]
        slip_rate[i] = max(u[i] / size * (1.0 + ratio) - ratio * past[i], 0.0)
        past[i] = u[i] / size
        stress[i] = transfer[i] + load * profile[i] + initial[i] - grid.impedance * slip_rate[i]
        tables.strength[i] = node_strength(setting, i, slip[i])
    return work * grid.cell


@jit_inside
def _next_size(asked: float, size: float, largest: float, growing: bool) -> Any:
    """Step 6: return the next size, at which a step weakens nodes by `asked`."""
    root = np.sqrt(2.0)
    if largest > asked:
        return size / root
    if largest < 0.25 * asked and not growing:
        return min(2.0 * size, LARGEST_STEP)
    if largest < 0.7 * asked and not growing:
        return min(root * size, LARGEST_STEP)
    return size


@jit
def implicit_steps(
    n: int, state: RuptureState, setting: Setting, tables: ImplicitTables, record: StepRecord
) -> Any:
    """Take up to `n` accepted implicit steps in place.

    Return (steps taken, reason).

    The parameters are described in `explicit_steps`. `stepping.phase`
    is IMPLICIT.
    """
    now, thresholds, u = state.diagnostics[0], setting.thresholds, tables.problem.increment
    stepping = now.stepping
    step = stepping.next_size
    smallest = _JUST_BELOW * thresholds.smallest_step
    # A single return: a further return would double the time to compile.
    taken, reason = ZERO, Reason.DONE
    while taken < n:
        # 1. Size, time, load and ratio.
        size, step, clipped, last = _choose_size(now, setting, step)
        if size < smallest and not clipped:
            reason = Reason.TO_EXPLICIT
            break
        ratio = size / (size + stepping.previous_size) if stepping.two_step else 0.0
        time = now.step.time + size
        load = value_at(setting.load, time)
        attempt = _Attempt(size, time, load, ratio, 2.0 * ratio / size)
        # 2. and 3. Slip increments.
        accuracy = _assemble(state, setting, tables, attempt)
        line_accuracy = accuracy if thresholds.curved else 0.0
        solved = solve_increment(tables.problem, setting, state.slip, accuracy, line_accuracy)
        # 4. Keep the step, or try half its size.
        largest, total, radiated = 0.0, 0.0, 0.0
        if solved:
            largest, total, radiated = _effect(state, setting, u, attempt)
        if not np.isfinite(total):
            reason = Reason.NOT_FINITE
            break
        too_much = largest > 2.0 * thresholds.slip_step
        if not solved or too_much or _accelerates(now, thresholds, attempt, largest, radiated):
            step = size / 2.0
            if step < smallest:
                reason = Reason.TO_EXPLICIT
                break
            continue
        steady = np.sqrt(_MAX_ACCELERATION) * stepping.previous_radiated
        growing = radiated > _NOTICED_RADIATION * now.run.scale and radiated > steady
        # 5. Take it.
        work = _accept(state, setting, tables, attempt)
        done = TakenStep(time, size, load, work, radiated, u, tables.strength)
        stepping.implicit_steps += 1
        stepping.two_step, stepping.previous_size = 1, size
        stepping.previous_radiated = radiated
        fall = finish_step(state, setting, done, record, taken)
        taken += 1
        # 6. The next size, or the end.
        if not clipped:
            step = _next_size(thresholds.slip_step, size, largest, growing)
        if thresholds.slid_stop and now.step.weakened_nodes >= thresholds.breakable:
            reason = Reason.ALL_SLID
        elif thresholds.event_stop and fall > EVENT_DROP * now.run.scale:
            reason = Reason.DROPPED
        elif step < smallest and not (clipped or last or now.step.time >= thresholds.end_time):
            reason = Reason.TO_EXPLICIT
        ends = reason != Reason.DONE or now.event.begun or now.event.calm
        if ends or last or now.step.time >= thresholds.end_time:
            break
    stepping.next_size = step
    return taken, reason

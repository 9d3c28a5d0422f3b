"""Implicit steps of adaptive size while the interface creeps, in one compiled loop."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction._jit import jit
from stiction._typing import Array
from stiction.dynamics.complementarity import solve_increment
from stiction.dynamics.loading import load_at
from stiction.dynamics.monitor import (
    ALL_SLID,
    ARRIVAL,
    BAD_NODE,
    BREAKABLE,
    CURVED,
    DONE,
    DROPPED,
    END_TIME,
    EVENT_DROP,
    EVENT_STOP,
    GROWTH,
    IMPLICIT_STEPS,
    KINETIC,
    LARGEST_STEP,
    LOAD,
    LOAD_STEP,
    NEGLIGIBLE,
    NOT_FINITE,
    NOTICED,
    PAST_STEP,
    RADIATED,
    REC_LOAD,
    REC_MEAN_SLIP,
    REC_MEAN_STRESS,
    REC_STEP,
    REC_TIME,
    REC_TOP_RATE,
    REC_WORK,
    REJECTED_STEPS,
    RESIDUAL,
    SCALE,
    SLID,
    SLID_STOP,
    SLIP_STEP,
    SMALL_DROP,
    SMALLEST_STEP,
    STEADY_STRESS,
    STEP,
    TIME,
    TO_EXPLICIT,
    TOP_RATE,
    WORK,
    observe,
)
from stiction.dynamics.scale import follow_scale
from stiction.friction.kernels import strength_at

_ROUND_OFF = 1e-14  # of the largest stress: what a few transforms leave, ten times over


@jit
def _phi(z: Any) -> Any:
    return 1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0 * (1.0 + z / 5.0 * (1.0 + z / 6.0))))


@jit
def _tilt(z: Any) -> Any:
    """int_0^1 exp(z (1 - t)) (t - 1/2) dt near z = 0."""
    return -z / 12.0 * (1.0 + z / 2.0 * (1.0 + z * 0.3 * (1.0 + z * (2.0 / 9.0))))


@jit
def tabulate(
    poles: Array,
    weights: Array,
    pace: Array,
    step: float,
    table: Array,
    tilt: Array,
    fresh: Array,
    turn: Any,
) -> None:
    """Tables of a step of any size, packed as in `layout`.

    E and B = int_0^h exp(s k c_s t') dt' into `table`, its counterpart for a slip rate that rises
    linearly with zero mean into `tilt`, and their sums Re sum w B into `fresh` and `turn`.
    pace[j] = (j + 1) pace[0], so the exponentials of a pole are powers of one number: a product
    each, with a relative error of 1e-16 j.
    """
    for j in range(fresh.size):
        fresh[j] = turn[j] = 0.0
    pairs = poles.size
    for p in range(pairs):
        unit = poles[p] * (pace[0] * step)
        base = np.exp(unit)
        decay = 1.0 + 0.0j
        for j in range(fresh.size):
            decay = decay * base
            z = unit * (j + 1)
            if abs(z) < 0.02:
                gain, lean = step * _phi(z), step * step * _tilt(z)
            else:
                ratio = (decay - 1.0) / z
                gain, lean = step * ratio, step * step * ((ratio - 1.0) / z - 0.5 * ratio)
            o = ((j // 64) * pairs + p) * 256 + j % 64
            table[o], table[o + 64] = decay.real, decay.imag
            table[o + 128], table[o + 192] = gain.real, gain.imag
            tilt[o], tilt[o + 64] = lean.real, lean.imag
            fresh[j] += (weights[p] * gain).real
            turn[j] += (weights[p] * lean).real


@jit
def _carry(memory: Array, table: Array, weights: Array, out: Array) -> None:
    """Re sum w E psi for the modes j = 1.., complex: what the past leaves after the step."""
    pairs = weights.size
    for j in range(out.size):
        real, imaginary = 0.0, 0.0
        for p in range(pairs):
            o = ((j // 64) * pairs + p) * 256 + j % 64
            w = weights[p] * complex(table[o], table[o + 64])
            real += w.real * memory[o] - w.imag * memory[o + 64]
            imaginary += w.real * memory[o + 128] - w.imag * memory[o + 192]
        out[j] = complex(real, imaginary)


@jit
def _remember(
    memory: Array, table: Array, tilt: Array, rate_hat: Array, slope_hat: Array, pairs: int
) -> None:
    """psi <- E psi + B V, with a slip rate that changes linearly in the step."""
    for j in range(rate_hat.size - 1):
        v, a = rate_hat[j + 1], slope_hat[j + 1]
        for p in range(pairs):
            o = ((j // 64) * pairs + p) * 256 + j % 64
            decay = complex(table[o], table[o + 64])
            gain = complex(table[o + 128], table[o + 192])
            lean = complex(tilt[o], tilt[o + 64])
            y = decay * complex(memory[o], memory[o + 64]) + gain * v.real + lean * a.real
            memory[o], memory[o + 64] = y.real, y.imag
            y = decay * complex(memory[o + 128], memory[o + 192]) + gain * v.imag + lean * a.imag
            memory[o + 128], memory[o + 192] = y.real, y.imag


@jit
def implicit_steps(
    count: int,
    step: float,
    slip: Array,
    rate: Array,
    stress: Array,
    slip_hat: Array,
    past: Any,
    memory: Array,
    arrival: Array,
    watch: Array,
    poles: Array,
    weights: Array,
    pace: Array,
    stiffness: Array,
    medium: Any,
    law: Any,
    rows: Array,
    load_times: Array,
    load_values: Array,
    turns: Any,
    scale_loads: Array,
    scales: Array,
    control: Array,
    record: Array,
) -> Any:
    """Take up to `count` accepted implicit steps in place; return (steps, next size, reason).

    Parameters as in `explicit_steps`; `memory` holds psi itself, `step` is the size to try first.
    Second order: the slip rate at the end of a step follows from the mean rates of this step and
    of the one before (`past`, (nodes,), m/s; none if PAST_STEP is 0), as in the two-step
    backward differences, and the memory sees it rise or fall linearly.
    `turns` are the times at which the load begins to fall or to rise again, s.
    Sizes are multiplied or divided by powers of sqrt 2, so that tables are reused while the size
    stays. A step is repeated at half the size if no slip increments are found (negative
    curvature: the patches are unstable at this size), a node weakens too much, or the interface
    accelerates too much for the load at onset to be accurate. Creep of nodes at their residual
    strength does not count, nor the weakening of nodes that weaken by next to nothing.
    """
    n = slip.size
    modes = pace.size
    impedance, spacing = medium[0], medium[1]
    table, tilt = np.zeros(memory.size), np.zeros(memory.size)
    fresh, turn = np.empty(modes), np.empty(modes)
    carried = np.empty(modes, np.complex128)
    pushed_hat = np.empty(modes + 1, np.complex128)
    symbol, inverse = np.empty(modes + 1), np.empty(modes + 1)
    state = np.zeros(n, np.int64)
    profile, initial, critical = rows[4], rows[5], rows[3]
    peak, residual, weakening = rows[0], rows[1], rows[2]
    half = control[ARRIVAL]
    breakable = int(control[BREAKABLE])
    root = np.sqrt(2.0)
    tabulated, paired = -1.0, -1.0
    taken = 0
    while taken < count:
        clipped = False
        size = step
        while True:
            rise = load_at(load_times, load_values, watch[TIME] + size) - watch[LOAD]
            small = control[LOAD_STEP] * watch[SCALE]
            if size <= control[SMALLEST_STEP] or abs(rise) <= small:
                break
            size /= root
            step = size
        for turn_time in turns:  # land on each peak of the load, or creep would miss its top
            ahead = turn_time - watch[TIME]
            if 1e-6 * control[SMALLEST_STEP] < ahead < size:
                size = ahead
                clipped = True
                break
        last = watch[TIME] + size > control[END_TIME]
        if last:
            size = control[END_TIME] - watch[TIME]
            clipped = True
        if size < control[SMALLEST_STEP] and not clipped:
            return taken, step, TO_EXPLICIT
        # V at the end = mean + share (mean - past mean); its slope in the step, a second
        # difference of slip, is (mean - past mean) bend.
        share = size / (size + watch[PAST_STEP]) if watch[PAST_STEP] > 0.0 else 0.0
        bend = 2.0 * share / size
        if size != tabulated:
            tabulate(poles, weights, pace, size, table, tilt, fresh, turn)
        if size != tabulated or share != paired:
            symbol[0] = impedance * (1.0 + share) / size
            for j in range(modes):
                fading = stiffness[1, j] * (fresh[j] + bend * turn[j]) / size
                symbol[j + 1] = symbol[0] + stiffness[0, j] - fading
            for j in range(modes + 1):
                inverse[j] = 1.0 / symbol[j]
            tabulated, paired = size, share
        time = watch[TIME] + size
        load = load_at(load_times, load_values, time)
        _carry(memory, table, weights, carried)
        past_hat = np.fft.rfft(past)
        pushed_hat[0] = impedance * share * past_hat[0]
        for j in range(modes):
            pushed_hat[j + 1] = (
                stiffness[1, j] * (carried[j] - bend * turn[j] * past_hat[j + 1])
                - stiffness[0, j] * slip_hat[j + 1]
                + impedance * share * past_hat[j + 1]
            )
        pushed = np.fft.irfft(pushed_hat, n)
        u = np.empty(n)
        level = 0.0
        for i in range(n):
            pushed[i] += load * profile[i] + initial[i]
            level = max(level, abs(pushed[i]))
            u[i] = past[i] * size
            state[i] = 1 if rate[i] > 0.0 else 0
        scale = watch[SCALE]
        # Round-off of the transforms bounds what can be asked for.
        accuracy = max(control[RESIDUAL] * scale, _ROUND_OFF * level)
        near = accuracy if control[CURVED] > 0.0 else 0.0
        solved = solve_increment(symbol, inverse, law, rows, slip, pushed, u, state, accuracy, near)
        largest, total = 0.0, 0.0
        if solved:
            least = control[SMALL_DROP] * scale
            creep = control[STEADY_STRESS] * scale * size / impedance
            for i in range(n):
                if slip[i] < critical[i] and u[i] > 0.0:
                    lost = strength_at(law, peak[i], residual[i], weakening[i], slip[i])
                    lost -= strength_at(law, peak[i], residual[i], weakening[i], slip[i] + u[i])
                    largest = max(largest, lost / max(peak[i] - residual[i], least))
                elif u[i] > creep and critical[i] > 0.0:
                    largest = max(largest, u[i] / critical[i])
                total += u[i]
            if not np.isfinite(total):
                watch[BAD_NODE] = 0.0
                return taken, step, NOT_FINITE
        radiated = 0.0
        for i in range(n):
            radiated += max(u[i] / size * (1.0 + share) - share * past[i], 0.0)
        radiated *= impedance / n
        before = watch[RADIATED]
        # A step that raises the load by next to nothing cannot put the onset wrong.
        matters = abs(load - watch[LOAD]) > control[NEGLIGIBLE] * scale
        noticed = control[NOTICED] * scale
        racing = radiated > noticed and radiated > control[GROWTH] * max(before, noticed)
        # At the smallest size, waves of an arrested event alone do not call for explicit steps.
        shorter = 0.5 * size >= control[SMALLEST_STEP] or largest > 0.1 * control[SLIP_STEP]
        racing = racing and matters and shorter and share > 0.0
        if not solved or largest > 2.0 * control[SLIP_STEP] or racing:
            watch[REJECTED_STEPS] += 1.0
            step = size / 2.0
            if step < control[SMALLEST_STEP]:
                return taken, step, TO_EXPLICIT
            continue
        work, slid, slip_sum, top, node = 0.0, 0, 0.0, -1.0, 0
        mean_load = 0.5 * (load + watch[LOAD])
        rate_hat = np.fft.rfft(u)
        for j in range(modes + 1):
            slip_hat[j] += rate_hat[j]
            rate_hat[j] /= size
            past_hat[j] = bend * (rate_hat[j] - past_hat[j])
        _remember(memory, table, tilt, rate_hat, past_hat, poles.size)
        pushed_hat[0] = 0.0
        for j in range(modes):
            memory_part = carried[j] + fresh[j] * rate_hat[j + 1] + turn[j] * past_hat[j + 1]
            pushed_hat[j + 1] = stiffness[1, j] * memory_part - stiffness[0, j] * slip_hat[j + 1]
        moved = np.fft.irfft(pushed_hat, n)
        for i in range(n):
            work += u[i] * (mean_load * profile[i] + initial[i])
            slip[i] += u[i]
            rate[i] = max(u[i] / size * (1.0 + share) - share * past[i], 0.0)
            past[i] = u[i] / size
            stress[i] = moved[i] + load * profile[i] + initial[i] - impedance * rate[i]
            slip_sum += slip[i]
            if slip[i] >= critical[i]:
                slid += 1
            if rate[i] > top:
                top, node = rate[i], i
            if np.isnan(arrival[i]) and slip[i] > 0.0 and slip[i] >= half * critical[i]:
                beyond = slip[i] - half * critical[i]
                arrival[i] = time - size * min(1.0, beyond / max(u[i], 1e-300))
        mean_stress = medium[3] + load * medium[2] - radiated
        watch[TIME], watch[LOAD], watch[TOP_RATE], watch[SLID] = time, load, top, slid
        watch[WORK] += work * spacing
        watch[IMPLICIT_STEPS] += 1.0
        watch[STEP] = watch[PAST_STEP] = size
        watch[RADIATED] = radiated
        follow_scale(watch, control, scale_loads, scales, load)
        fall = observe(watch, time, load, mean_stress, radiated, node)
        if slid >= breakable and watch[KINETIC] == -np.inf:
            watch[KINETIC] = mean_stress
        if record.shape[0] > 0:
            record[taken, REC_TIME], record[taken, REC_LOAD], record[taken, REC_MEAN_STRESS] = (
                time,
                load,
                mean_stress,
            )
            record[taken, REC_MEAN_SLIP], record[taken, REC_TOP_RATE] = slip_sum / n, top
            record[taken, REC_STEP], record[taken, REC_WORK] = size, watch[WORK]
        taken += 1
        if slid >= control[SLID_STOP]:
            return taken, step, ALL_SLID
        if control[EVENT_STOP] > 0.0 and fall > watch[EVENT_DROP]:
            return taken, step, DROPPED
        if last or watch[TIME] >= control[END_TIME]:
            return taken, step, DONE
        if clipped:
            continue
        growing = radiated > noticed and radiated > np.sqrt(control[GROWTH]) * before
        if largest > control[SLIP_STEP]:
            step = size / root
        elif largest < 0.25 * control[SLIP_STEP] and not growing:
            step = min(2.0 * size, control[LARGEST_STEP])
        elif largest < 0.7 * control[SLIP_STEP] and not growing:
            step = min(root * size, control[LARGEST_STEP])
        if step < control[SMALLEST_STEP]:
            return taken, step, TO_EXPLICIT
    return taken, step, DONE

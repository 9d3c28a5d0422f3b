"""Explicit predictor-corrector steps: second order, one fixed step, all in one compiled loop."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction._jit import jit
from stiction._typing import Array
from stiction.dynamics.loading import load_at
from stiction.dynamics.memory_layout import advance_memory, pack
from stiction.dynamics.monitor import (
    ALL_SLID,
    ARRIVAL,
    AT_REST,
    BAD_NODE,
    BREAKABLE,
    CALM_COUNT,
    CALM_SLIP,
    CALM_STEPS,
    CALM_STRESS,
    CALM_TOP,
    DONE,
    DROPPED,
    EVENT_DROP,
    EVENT_STOP,
    EXPLICIT_ONLY,
    EXPLICIT_STEPS,
    FIRST_STRESS,
    KINETIC,
    LOAD,
    NOT_FINITE,
    REC_LOAD,
    REC_MEAN_SLIP,
    REC_MEAN_STRESS,
    REC_STEP,
    REC_TIME,
    REC_TOP_RATE,
    REC_WORK,
    REST_STOP,
    SLID,
    SLID_STOP,
    STEADY_STRESS,
    STEP,
    TIME,
    TO_IMPLICIT,
    TOP_RATE,
    WORK,
    observe,
    settle,
)
from stiction.dynamics.scale import follow_scale
from stiction.friction.kernels import strength_at


@jit
def _transfer(
    slip_hat: Array,
    rate_hat: Array,
    step: float,
    carried: Array,
    fresh: Array,
    stiffness: Array,
    packed: Array,
    out: Array,
) -> None:
    """Stress transferred along the interface, in Fourier space, if the rate acts for a step."""
    pack(rate_hat, packed)
    out[0] = 0.0
    for j in range(out.size - 1):
        o = (j // 64) * 128 + j % 64
        g, b = stiffness[0, j], fresh[j]
        slip = slip_hat[j + 1] + step * rate_hat[j + 1]
        real = stiffness[1, j] * (carried[o] + b * packed[o]) - g * slip.real
        imaginary = stiffness[1, j] * (carried[o + 64] + b * packed[o + 64]) - g * slip.imag
        out[j + 1] = complex(real, imaginary)


@jit
def explicit_steps(
    count: int,
    step: float,
    slip: Array,
    rate: Array,
    stress: Array,
    slip_hat: Array,
    memory: Array,
    carried: Array,
    arrival: Array,
    watch: Array,
    table: Array,
    fresh: Array,
    stiffness: Array,
    medium: Any,
    law: Any,
    rows: Array,
    load_times: Array,
    load_values: Array,
    scale_loads: Array,
    scales: Array,
    control: Array,
    record: Array,
) -> Any:
    """Take up to `count` explicit steps in place; return (steps taken, reason).

    Parameters
    ----------
    slip, rate, stress, arrival : (nodes,) arrays
        m, m/s, Pa, and the time when half of the strength was lost (nan before), s; updated.
    slip_hat : (nodes//2 + 1,) complex array
    memory, carried, table : packed as in `layout`
    fresh : (nodes//2,) array
    stiffness : (2, nodes//2) array
        G*|k|/2 and G|k|/2, Pa/m.
    medium : (4,) array
        Z = G/(2 c_s) (Pa s/m), dx (m), <p>, <tau_i>.
    law : NamedTuple
        ``friction.parameters``.
    rows : (6, nodes) array
        As in `Run`.
    scale_loads, scales : arrays
        Stress scale against the load, Pa.
    control : array
        Thresholds, see `track`.
    record : (>= count, columns) array, or with no rows to keep nothing.
    """
    n = slip.size
    impedance, spacing = medium[0], medium[1]
    pairs = memory.size // (carried.size * 2)
    packed = np.zeros(carried.size)
    out = np.empty(slip_hat.size, np.complex128)
    guess = np.empty(n)
    strength, residual, weakening = rows[0], rows[1], rows[2]
    critical, profile, initial = rows[3], rows[4], rows[5]
    half = control[ARRIVAL]
    keep = record.shape[0] > 0
    load_before = watch[LOAD]
    for taken in range(count):
        time = watch[TIME] + step
        load = load_at(load_times, load_values, time)
        rate_hat = np.fft.rfft(rate)
        _transfer(slip_hat, rate_hat, step, carried, fresh, stiffness, packed, out)
        moved = np.fft.irfft(out, n)
        for i in range(n):
            ahead = slip[i] + step * rate[i]
            limit = strength_at(law, strength[i], residual[i], weakening[i], ahead)
            guess[i] = max(moved[i] + load * profile[i] + initial[i] - limit, 0.0) / impedance
        guess_hat = np.fft.rfft(guess)
        for j in range(rate_hat.size):
            rate_hat[j] = 0.5 * (rate_hat[j] + guess_hat[j])
        _transfer(slip_hat, rate_hat, step, carried, fresh, stiffness, packed, out)
        moved = np.fft.irfft(out, n)
        work, total, slid = 0.0, 0.0, 0
        mean_load = 0.5 * (load + load_before)
        for i in range(n):
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
        if not np.isfinite(total):
            for i in range(n):
                if not np.isfinite(guess[i]):
                    watch[BAD_NODE] = i
                    break
            watch[TIME] = time
            return taken, NOT_FINITE
        top, node, slip_sum = -1.0, 0, 0.0
        for i in range(n):
            if guess[i] > top:
                top, node = guess[i], i
            # d_c = 0 where nothing weakens: there the first slip counts.
            if np.isnan(arrival[i]) and slip[i] > 0.0 and slip[i] >= half * critical[i]:
                increment = 0.5 * step * (rate[i] + guess[i])
                past = slip[i] - half * critical[i]
                arrival[i] = time - step * min(1.0, past / max(increment, 1e-300))
            slip_sum += slip[i]
            rate[i] = guess[i]
        for j in range(rate_hat.size):
            slip_hat[j] += step * rate_hat[j]
        advance_memory(memory, table, packed, carried, pairs)
        radiated = impedance * total / n
        mean_stress = medium[3] + load * medium[2] - radiated
        watch[TIME], watch[LOAD], watch[TOP_RATE], watch[SLID] = time, load, top, slid
        watch[WORK] += work * spacing
        watch[EXPLICIT_STEPS] += 1.0
        watch[STEP] = step
        rise = abs(load - load_before)
        load_before = load
        scale = follow_scale(watch, control, scale_loads, scales, load)
        fall = observe(watch, time, load, mean_stress, radiated, node)
        if slid >= control[BREAKABLE] and watch[KINETIC] == -np.inf:
            watch[KINETIC] = mean_stress
        if keep:
            record[taken, REC_TIME], record[taken, REC_LOAD], record[taken, REC_MEAN_STRESS] = (
                time,
                load,
                mean_stress,
            )
            record[taken, REC_MEAN_SLIP], record[taken, REC_TOP_RATE] = slip_sum / n, top
            record[taken, REC_STEP], record[taken, REC_WORK] = step, watch[WORK]
        if slid >= control[SLID_STOP]:
            return taken + 1, ALL_SLID
        if control[EVENT_STOP] > 0.0 and fall > watch[EVENT_DROP]:
            return taken + 1, DROPPED
        # Waves make slip rates come and go; creep is slow, or as fast as it was.
        quiet = top < control[CALM_STRESS] * scale / impedance + control[CALM_SLIP] * rise / step
        steady = 0.5 * watch[CALM_TOP] <= top <= 2.0 * watch[CALM_TOP]
        if quiet or (steady and top < control[STEADY_STRESS] * scale / impedance):
            watch[CALM_STEPS] += 1.0
        else:
            watch[CALM_STEPS], watch[CALM_TOP] = 0.0, top
        if watch[CALM_STEPS] >= control[CALM_COUNT]:
            settle(watch, mean_stress, radiated)
            if control[REST_STOP] > 0.0 and watch[FIRST_STRESS] > -np.inf:
                return taken + 1, AT_REST
            if not control[EXPLICIT_ONLY] > 0.0:
                return taken + 1, TO_IMPLICIT
    return count, DONE

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
    """Write equation (1), the stress if `slip_rate_hat` acts for a step, to `tables.transfer`.

    A mode has the memory 0.3 + 0.6i, the response 0.5 and the slip 1 + 0.1 *
    2 at the end, which gives 1 * (0.3 + 0.6i + 0.5 * 2) - 2 * 1.2. (The
    function runs without compilation, with a transform by numpy.)

    >>> from types import FunctionType, SimpleNamespace
    >>> def by_numpy(transform, spectrum, field):
    ...     field[:] = np.fft.irfft(spectrum, field.size)
    >>> plain = FunctionType(
    ...     _transfer.py_func.__code__, globals() | {"backward": by_numpy}
    ... )
    >>> stiffness = np.array([[0.0, 2.0, 4.0], [0.0, 1.0, 3.0]])
    >>> grid = SimpleNamespace(
    ...     transform=None, offset=np.array([0, 0, 1]), stiffness=stiffness
    ... )
    >>> memory_sum = np.zeros(2 * ENTRIES)
    >>> memory_sum[[0, 1, ENTRIES]] = 0.3, -0.2, 0.6
    >>> tables = SimpleNamespace(
    ...     step=0.1,
    ...     slip_rate_hat=np.array([7.0, 2.0, 4.0]),
    ...     response=np.array([9.0, 0.5, 0.25]),
    ...     shared=np.ones(3, complex),
    ...     transfer=np.zeros(4),
    ... )
    >>> plain(grid, np.array([5.0, 1.0, -2.0]), memory_sum, tables)
    >>> hat = np.fft.rfft(tables.transfer)
    >>> (hat.real.round(9) + 0.0).tolist(), (hat.imag.round(9) + 0.0).tolist()
    ([0.0, -1.1, 8.8], [0.0, 0.6, 0.0])
    """
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
    """Step 1: write to `predicted` the rate at the end if the present rate acts all the time.

    Node 0 would carry 1 + 5 * 2 - 3 Pa, and its strength is 9 - 2 * 0.7 Pa.

    >>> from types import FunctionType, SimpleNamespace
    >>> strength = {"node_strength": lambda setting, i, slip: 9.0 + i - 2.0 * slip}
    >>> plain = FunctionType(_predict.py_func.__code__, globals() | strength)
    >>> nodes = SimpleNamespace(
    ...     profile=np.array([2.0, 1.0]), initial=np.array([-3.0, 0.5])
    ... )
    >>> state = SimpleNamespace(
    ...     slip=np.array([0.5, 0.2]), slip_rate=np.array([2.0, 0.0])
    ... )
    >>> tables = SimpleNamespace(
    ...     transfer=np.array([1.0, -1.0]), step=0.1, predicted=np.zeros(2)
    ... )
    >>> plain(state, SimpleNamespace(nodes=nodes), tables, 5.0, 4.0)
    >>> tables.predicted.round(9).tolist()
    [0.1, 0.0]
    """
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

    The mean rate of node 0 is 3, so it slips 0.3 to 0.8. It would carry 8 Pa,
    and its strength is 9 - 2 * 0.8 Pa. The mean load is 4 Pa.

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> strength = {"node_strength": lambda setting, i, slip: 9.0 + i - 2.0 * slip}
    >>> plain = FunctionType(_correct.py_func.__code__, globals() | strength)
    >>> nodes = SimpleNamespace(
    ...     profile=np.array([2.0, 1.0]), initial=np.array([-3.0, 0.5])
    ... )
    >>> state = SimpleNamespace(
    ...     slip=np.array([0.5, 0.2]),
    ...     slip_rate=np.array([2.0, 0.0]),
    ...     stress=np.zeros(2),
    ...     diagnostics=np.zeros(1, DIAGNOSTICS).view(np.recarray),
    ... )
    >>> state.diagnostics[0].step.load = 3.0
    >>> tables = SimpleNamespace(
    ...     transfer=np.array([1.0, -1.0]),
    ...     step=0.1,
    ...     predicted=np.array([4.0, 0.0]),
    ...     increments=np.zeros(2),
    ...     strength=np.zeros(2),
    ... )
    >>> np.round(
    ...     plain(state, SimpleNamespace(nodes=nodes), tables, 5.0, 4.0), 9
    ... ).tolist()
    [1.5, 0.15]
    >>> (
    ...     state.slip.tolist(),
    ...     state.slip_rate.round(9).tolist(),
    ...     state.stress.round(9).tolist(),
    ... )
    ([0.8, 0.2], [0.15, 0.0], [7.4, 4.5])
    >>> tables.increments.round(9).tolist(), tables.strength.round(9).tolist()
    ([0.1075, 0.0], [7.4, 9.6])
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

    The scale makes 0.5 m/s calm, and 0.8 m/s while the load rises. A rate up
    to 50 m/s is calm if it is half to twice the rate at the first calm step.
    Once all nodes have broken, it may be faster.

    >>> from types import SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> now = np.zeros(1, DIAGNOSTICS).view(np.recarray)[0]
    >>> thresholds = SimpleNamespace(
    ...     calm_slip=0.1, slid_stop=True, breakable=5, calm_count=2
    ... )
    >>> now.run.scale, now.stepping.calm_slip_rate = 1e4, 9.6
    >>> for top, weakened in (
    ...     (0.79, 0),
    ...     (19.0, 4),
    ...     (0.81, 4),
    ...     (40.0, 4),
    ...     (51.0, 4),
    ...     (90.0, 5),
    ... ):
    ...     now.step.top_slip_rate, now.step.weakened_nodes = top, weakened
    ...     calm = _calm.py_func(now, thresholds, 0.5, 2.0, 1.5)
    ...     print(bool(calm), now.stepping.calm_steps, now.stepping.calm_slip_rate)
    False 1 9.6
    True 2 9.6
    False 0 0.81
    False 0 40.0
    False 0 51.0
    False 1 51.0
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

    The parts of a step are replaced here. Node rates of (1, 3) and (3, 5) move
    the slip by half a second times (2, 4).

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS, PiecewiseLinear
    >>> def taken(
    ...     falls, calm, total=4.0, instabilities=0, weakened=0, open=1, **changed
    ... ):
    ...     def forward(transform, field, spectrum):
    ...         spectrum[:] = np.fft.rfft(field)
    ...
    ...     def finish_step(state, setting, done, record, row):
    ...         kept.append([float(value) for value in done[:5]])
    ...         now.step.time, now.step.load = done.time, done.load
    ...         return falls[row]
    ...
    ...     parts = {"_transfer", "pack", "advance_memory", "end_event", "_predict"}
    ...     names = globals() | {part: lambda *arguments: None for part in parts}
    ...     names |= {"forward": forward, "finish_step": finish_step}
    ...     names["_correct"] = lambda *arguments: (3.0, total)
    ...     names["_calm"] = lambda *arguments: calm[len(kept) - 1]
    ...     kept, diagnostics = [], np.zeros(1, DIAGNOSTICS).view(np.recarray)
    ...     now = diagnostics[0]
    ...     now.run.scale, now.event.open, now.results.instabilities = (
    ...         1e4,
    ...         open,
    ...         instabilities,
    ...     )
    ...     now.step.weakened_nodes, now.step.time, now.step.load = (
    ...         weakened,
    ...         1.0,
    ...         2.0,
    ...     )
    ...     options = {
    ...         "slid_stop": True,
    ...         "held": False,
    ...         "event_stop": False,
    ...         "rest_stop": False,
    ...     }
    ...     options |= {
    ...         "breakable": 2,
    ...         "period_nodes": 8,
    ...         "explicit_only": False,
    ...     } | changed
    ...     grid = SimpleNamespace(
    ...         transform=None, offset=None, impedance=6.0, cell=0.25
    ...     )
    ...     grid.poles, grid.multiplicity = np.zeros(1), 1
    ...     setting = SimpleNamespace(
    ...         grid=grid,
    ...         thresholds=SimpleNamespace(unstable_slip_rate=1.0, **options),
    ...         load=PiecewiseLinear(np.array([0.0, 1.0]), np.array([0.0, 2.0])),
    ...     )
    ...     state = SimpleNamespace(
    ...         slip_hat=np.zeros(2, complex),
    ...         slip_rate=np.array([1.0, 3.0]),
    ...         memory=None,
    ...         memory_sum=None,
    ...         diagnostics=diagnostics,
    ...     )
    ...     tables = SimpleNamespace(
    ...         step=0.5,
    ...         slip_rate_hat=np.zeros(2, complex),
    ...         shared=np.zeros(2, complex),
    ...         predicted=np.array([3.0, 5.0]),
    ...         packed=None,
    ...         table=None,
    ...         increments=None,
    ...         strength=None,
    ...     )
    ...     plain = FunctionType(explicit_steps.py_func.__code__, names)
    ...     count, reason = plain(3, state, setting, tables, None)
    ...     return (
    ...         int(count),
    ...         Reason(reason).name,
    ...         kept,
    ...         state.slip_hat.real.tolist(),
    ...         now,
    ...     )
    >>> rests = [False] * 3
    >>> taken([0.0, 0.0, 0.0], rests)[:2]
    (3, 'DONE')
    >>> count, reason, kept, slip_hat, now = taken(
    ...     [0.9, 1.1, 0.0], rests, event_stop=True
    ... )
    >>> count, reason, kept[1], slip_hat, int(now.stepping.explicit_steps)
    (2, 'DROPPED', [2.0, 0.5, 4.0, 0.75, 3.0], [6.0, -2.0], 2)
    >>> taken([0.0, 0.0, 0.0], rests, total=np.nan)[:2]
    (0, 'NOT_FINITE')

    A calm interface ends the run or goes on with implicit steps.

    >>> calm = [False, True, False]
    >>> rest = {"rest_stop": True}
    >>> for changed in ({}, {"open": 0}, rest, rest | {"instabilities": 1}):
    ...     count, reason, *_, now = taken([0.0, 0.0, 0.0], calm, **changed)
    ...     print(count, reason, now.event.calm)
    2 TO_IMPLICIT 1
    2 TO_IMPLICIT 0
    2 TO_IMPLICIT 1
    2 AT_REST 1
    >>> for changed in (
    ...     {},
    ...     {"held": True},
    ...     {"slid_stop": False, "explicit_only": True},
    ... ):
    ...     print(taken([0.0, 0.0, 0.0], calm, weakened=2, **changed)[:2])
    (1, 'ALL_SLID')
    (2, 'ALL_SLID')
    (2, 'DONE')
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

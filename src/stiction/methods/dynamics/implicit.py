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
    """Step 1: return (size to try, size for later steps, whether cut short, whether the last).

    The load rises by 2 Pa/s, and may rise by 1.1 Pa in a step. A step ends at
    the next turning point of the load, or at the end time.

    >>> from types import SimpleNamespace
    >>> from stiction.methods.dynamics.state import PiecewiseLinear
    >>> load = PiecewiseLinear(np.array([0.0, 1.0]), np.array([0.0, 2.0]))
    >>> now = SimpleNamespace(step=SimpleNamespace(time=1.0, load=2.0))
    >>> now.run = SimpleNamespace(scale=100.0)
    >>> def size(turning_times, **changed):
    ...     options = {
    ...         "load_step": 0.011,
    ...         "smallest_step": 0.1,
    ...         "end_time": 9.0,
    ...     } | changed
    ...     setting = SimpleNamespace(
    ...         load=load, turning_times=np.array(turning_times)
    ...     )
    ...     setting.thresholds = SimpleNamespace(**options)
    ...     size, step, clipped, last = _choose_size.py_func(now, setting, 2.0)
    ...     return round(float(size), 6), round(float(step), 6), clipped, bool(last)
    >>> size([]), size([1.0, 1.3, 1.4])
    ((0.5, 0.5, False, False), (0.3, 0.5, True, False))
    >>> size([], smallest_step=1.0), size([], end_time=1.2)
    ((1.0, 1.0, False, False), (0.2, 0.5, True, True))
    >>> size([1.8], end_time=1.6)
    (0.5, 0.5, False, False)
    """

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

    With Z = 4 and r = 1/4, the mean mode has the entry 4 * 1.25/0.5. The next
    has 10 + 2 - 1 * (0.1 + 0.05)/0.5. Without the load, the stress of this
    mode is 1 * (0.2 + 0.1i + 0.05 * 3) - 2 * 0.5 - 4/4 * 3. (The function
    runs without compilation, with transforms by numpy.)

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> def forward(transform, field, spectrum):
    ...     spectrum[:] = np.fft.rfft(field)
    >>> def backward(transform, spectrum, field):
    ...     field[:] = np.fft.irfft(spectrum, field.size)
    >>> names = {
    ...     "forward": forward,
    ...     "backward": backward,
    ...     "fading_memory": lambda *arguments: None,
    ... }
    >>> names |= (
    ...     globals()
    ...     | names
    ...     | {"tabulate": lambda grid, size, tables: tabulated.append(size)}
    ... )
    >>> plain, tabulated = FunctionType(_assemble.py_func.__code__, names), []
    >>> stiffness = np.array([[0.0, 2.0, 5.0], [0.0, 1.0, 3.0]])
    >>> grid = SimpleNamespace(
    ...     transform=None, stiffness=stiffness, entry=np.array([0, 0, 1])
    ... )
    >>> grid.impedance = 4.0
    >>> problem = SimpleNamespace(
    ...     symbol=np.zeros(3),
    ...     inverse=np.zeros(3),
    ...     work=np.zeros(3, complex),
    ...     trial=np.zeros(4),
    ...     increment=np.zeros(4),
    ...     slipping=np.zeros(4, int),
    ... )
    >>> tables = SimpleNamespace(
    ...     problem=problem,
    ...     response=np.array([0.1, 0.2]),
    ...     ramp_response=np.array([0.05, -0.1]),
    ...     past_hat=np.zeros(3, complex),
    ...     memory_sum=np.array([0.0, 0.2 + 0.1j, 0.3]),
    ...     filled=np.zeros(1, int),
    ...     valid_for=np.zeros(2),
    ... )
    >>> state = SimpleNamespace(
    ...     past=np.array([1.0, 2.0, 4.0, 2.0]),
    ...     slip_hat=np.array([0.0, 0.5, -1.0]),
    ...     memory=None,
    ...     slip_rate=np.array([0.0, 0.1, 0.0, 0.2]),
    ...     diagnostics=np.zeros(1, DIAGNOSTICS),
    ... )
    >>> state.diagnostics = state.diagnostics.view(np.recarray)
    >>> nodes = SimpleNamespace(
    ...     profile=np.array([99.0, 2.0, 1.0, 1.0]), initial=np.full(4, 0.5)
    ... )
    >>> nodes.peak, setting = (
    ...     np.array([np.inf, 9.0, 9.0, 9.0]),
    ...     SimpleNamespace(grid=grid),
    ... )
    >>> setting.nodes = nodes
    >>> accuracy = plain(state, setting, tables, _Attempt(0.5, 1.0, 3.0, 0.25, 1.0))
    >>> problem.symbol.round(9).tolist(), (1.0 / problem.inverse).round(9).tolist()
    ([10.0, 11.7, 14.4], [10.0, 11.7, 14.4])
    >>> hat = np.fft.rfft(problem.trial - 3.0 * nodes.profile - 0.5)
    >>> (hat.real.round(9) + 0.0).tolist(), (hat.imag.round(9) + 0.0).tolist()
    ([9.0, -3.65, 7.2], [0.0, 0.1, 0.0])
    >>> problem.increment.tolist(), problem.slipping.tolist()
    ([0.5, 1.0, 2.0, 1.0], [0, 1, 0, 1])
    >>> relative = accuracy * 1e14 / np.abs(problem.trial[1:]).max()
    >>> round(float(relative), 9), tables.valid_for.tolist()
    (1.0, [0.5, 0.25])

    The tables serve further steps until the size or the ratio changes.

    >>> for size, ratio in ((0.5, 0.25), (0.5, 0.5), (0.25, 0.5)):
    ...     _ = plain(
    ...         state,
    ...         setting,
    ...         tables,
    ...         _Attempt(size, 1.0, 3.0, ratio, 2.0 * ratio / size),
    ...     )
    ...     print(tabulated, problem.symbol[0])
    [0.5] 10.0
    [0.5] 12.0
    [0.5, 0.25] 24.0
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

    Node 0 loses 2 Pa out of 8 Pa. Node 1 loses 1 Pa out of 1 Pa, but a drop
    below a tenth of the scale counts as 5 Pa. Nodes 2 and 3 are at the
    residual strength, and slip by 0.3 and 0.4 residual slips. Node 4 never
    weakens. The step and Z
    count slip above 0.5 m as fast.

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> strength = {
    ...     "node_strength": lambda setting, i, slip: (
    ...         (6.0, 2.0, 1.0, 1.0)[i] - 2.0 * slip
    ...     )
    ... }
    >>> plain = FunctionType(_effect.py_func.__code__, globals() | strength)
    >>> diagnostics = np.zeros(1, DIAGNOSTICS).view(np.recarray)
    >>> diagnostics[0].run.scale = 50.0
    >>> peak, residual = (
    ...     np.array([10.0, 2.0, 5.0, 5.0, 1.0]),
    ...     np.array([2.0, 1.0, 1.0, 1.0, 1.0]),
    ... )
    >>> residual_slip = np.array([2.0, 2.0, 1.0, 2.0, 0.0])
    >>> nodes = SimpleNamespace(
    ...     peak=peak, residual=residual, residual_slip=residual_slip
    ... )
    >>> setting = SimpleNamespace(nodes=nodes, grid=SimpleNamespace(impedance=2.0))
    >>> setting.thresholds = SimpleNamespace(period_nodes=5)
    >>> slip, past = (
    ...     np.array([0.5, 0.5, 1.0, 3.0, 1.0]),
    ...     np.array([0.0, 0.0, 0.0, 2.0, 0.0]),
    ... )
    >>> state = SimpleNamespace(slip=slip, past=past, diagnostics=diagnostics)
    >>> attempt = _Attempt(2.0, 0.0, 0.0, 0.5, 0.0)
    >>> for u in ([1, 0, 0.3, 0, 0], [0, 0.5, 0.5, 0, 0], [0, 0.5, 0, 0.8, 0.9]):
    ...     print(*np.round(plain(state, setting, np.array(u), attempt), 6).tolist())
    0.25 1.3 0.39
    0.2 1.0 0.3
    0.4 2.2 0.42
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
    """Step 4: return whether the interface accelerates too much for an accurate load at onset.

    A step matters if the load rises by 0.5 Pa at this scale. Radiation up to
    0.1 Pa is not noticed, and may grow to 1.3 times 0.2 Pa.

    >>> from types import SimpleNamespace
    >>> now = SimpleNamespace(
    ...     step=SimpleNamespace(load=7.0),
    ...     run=SimpleNamespace(scale=1e6),
    ...     stepping=SimpleNamespace(previous_radiated=0.2),
    ... )
    >>> thresholds = SimpleNamespace(smallest_step=0.1, slip_step=0.02)
    >>> def accelerates(radiated=0.27, load=7.6, size=0.2, largest=0.0, ratio=0.5):
    ...     attempt = _Attempt(size, 0.0, load, ratio, 0.0)
    ...     return bool(
    ...         _accelerates.py_func(now, thresholds, attempt, largest, radiated)
    ...     )
    >>> accelerates(), accelerates(load=6.4), accelerates(size=0.19, largest=0.0021)
    (True, True, True)
    >>> accelerates(radiated=0.25), accelerates(load=7.4), accelerates(ratio=0.0)
    (False, False, False)
    >>> accelerates(size=0.19, largest=0.0019)
    False
    >>> now.stepping.previous_radiated = 0.0
    >>> accelerates(radiated=0.14), accelerates(radiated=0.12)
    (True, False)
    """
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

    The steps of node 0 are 0.4 m in 0.5 s, after 0.2 m/s: its rate is 1.5 *
    0.8 - 0.5 * 0.2 m/s. (The function runs without compilation, with
    transforms by numpy.)

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> def forward(transform, field, spectrum):
    ...     spectrum[:] = np.fft.rfft(field)
    >>> def backward(transform, spectrum, field):
    ...     field[:] = np.fft.irfft(spectrum, field.size)
    >>> names = {"forward": forward, "backward": backward}
    >>> names["advance_with_ramp"] = lambda *arguments: None
    >>> names["node_strength"] = lambda setting, i, slip: 9.0 + i - 2.0 * slip
    >>> plain = FunctionType(_accept.py_func.__code__, globals() | names)
    >>> stiffness, entry = (
    ...     np.array([[0.0, 2.0, 5.0], [0.0, 1.0, 3.0]]),
    ...     np.array([0, 0, 1]),
    ... )
    >>> grid = SimpleNamespace(transform=None, stiffness=stiffness, entry=entry)
    >>> grid.impedance, grid.cell = 4.0, 0.25
    >>> u, past = np.array([0.4, 0.0, 0.0, 0.0]), np.array([0.2, 0.6, 0.0, 0.0])
    >>> tables = SimpleNamespace(
    ...     problem=SimpleNamespace(increment=u, work=np.zeros(3, complex)),
    ...     transfer=np.zeros(4),
    ...     slip_rate_hat=np.zeros(3, complex),
    ...     slope_hat=np.zeros(3, complex),
    ...     strength=np.zeros(4),
    ...     response=np.array([0.1, 0.2]),
    ...     ramp_response=np.array([0.05, -0.1]),
    ...     memory_sum=np.array([0.0, 0.2, 0.3]),
    ...     past_hat=np.fft.rfft(past),
    ... )
    >>> state = SimpleNamespace(
    ...     slip_hat=np.array([0.0, 0.5, -1.0], complex),
    ...     memory=None,
    ...     slip=np.array([1.0, 2.0, 0.0, 0.0]),
    ...     slip_rate=np.zeros(4),
    ...     past=past.copy(),
    ...     stress=np.zeros(4),
    ...     diagnostics=np.zeros(1, DIAGNOSTICS).view(np.recarray),
    ... )
    >>> state.diagnostics[0].step.load = 1.0
    >>> nodes = SimpleNamespace(
    ...     profile=np.array([1.0, 2.0, 1.0, 1.0]), initial=np.full(4, 0.5)
    ... )
    >>> setting = SimpleNamespace(grid=grid, nodes=nodes)
    >>> work = plain(state, setting, tables, _Attempt(0.5, 1.0, 3.0, 0.5, 2.0))
    >>> print(
    ...     f"{work:.6f}", state.slip.tolist(), state.slip_rate.round(9).tolist()
    ... )  # 0.4 * 2.5/4
    0.250000 [1.4, 2.0, 0.0, 0.0] [1.1, 0.0, 0.0, 0.0]
    >>> state.past.tolist(), tables.strength[:2].round(9).tolist()
    ([0.8, 0.0, 0.0, 0.0], [6.2, 6.0])
    >>> V, a = np.fft.rfft(u / 0.5), 2.0 * np.fft.rfft(u / 0.5 - past)
    >>> memory = (
    ...     tables.memory_sum
    ...     + tables.response[entry] * V
    ...     + tables.ramp_response[entry] * a
    ... )
    >>> hat = stiffness[1] * memory - stiffness[0] * (
    ...     np.array([0.0, 0.5, -1.0]) + np.fft.rfft(u)
    ... )
    >>> stress = (
    ...     np.fft.irfft(hat, 4) + 3.0 * nodes.profile + 0.5 - 4.0 * state.slip_rate
    ... )
    >>> (
    ...     np.allclose(state.stress, stress),
    ...     np.allclose(state.slip_hat, [0.4, 0.9, -0.6]),
    ... )
    (True, True)
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
    """Step 6: return the next size, at which a step weakens nodes by `asked`.

    A step that weakens too much is followed by a smaller size. Small effects
    allow a larger size, unless the slip rate grows.

    >>> following = _next_size.py_func
    >>> sizes = [
    ...     following(0.02, 1.0, most, False)
    ...     for most in (0.021, 0.019, 0.013, 0.004)
    ... ]
    >>> [round(float(size), 4) for size in sizes]
    [0.7071, 1.0, 1.4142, 2.0]
    >>> following(0.02, 1.0, 0.004, True), following(0.02, 9e19, 0.004, False)
    (1.0, 1e+20)
    """
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

    The parts of a step are replaced here. Each attempt has a scripted effect:
    the weakening, and whether a solution was found and the interface
    accelerates.

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS, PiecewiseLinear
    >>> def taken(
    ...     effects, fall=0.0, weakened=0, total=1.0, end_time=99.0, **changed
    ... ):
    ...     def choose(now, setting, step):
    ...         tried.append(float(step))
    ...         last = now.step.time + step > end_time
    ...         return (end_time - now.step.time if last else step), step, last, last
    ...
    ...     def accept(state, setting, tables, attempt):
    ...         ratios.append(round(float(attempt.ratio), 6))
    ...         return 3.0
    ...
    ...     def finish_step(state, setting, done, record, row):
    ...         now.step.time, now.step.load = done.time, done.load
    ...         return fall
    ...
    ...     tried, ratios, diagnostics = (
    ...         [],
    ...         [],
    ...         np.zeros(1, DIAGNOSTICS).view(np.recarray),
    ...     )
    ...     names = {
    ...         "_choose_size": choose,
    ...         "_accept": accept,
    ...         "finish_step": finish_step,
    ...     }
    ...     names |= {
    ...         "_next_size": _next_size.py_func,
    ...         "_assemble": lambda *given: 0.0,
    ...     }
    ...     names["solve_increment"] = lambda *given: (
    ...         effects[len(tried) - 1] is not None
    ...     )
    ...     names["_effect"] = lambda *given: (effects[len(tried) - 1], total, 0.0)
    ...     names["_accelerates"] = lambda *given: effects[len(tried) - 1] == 0.03
    ...     now, thresholds = diagnostics[0], {"slid_stop": True, "event_stop": True}
    ...     thresholds |= {
    ...         "breakable": 2,
    ...         "end_time": end_time,
    ...         "smallest_step": 0.3,
    ...     }
    ...     thresholds |= {"slip_step": 0.02, "curved": False} | changed
    ...     now.run.scale, now.stepping.next_size, now.step.weakened_nodes = (
    ...         1e4,
    ...         1.0,
    ...         weakened,
    ...     )
    ...     load = PiecewiseLinear(np.array([0.0, 1.0]), np.array([0.0, 2.0]))
    ...     setting = SimpleNamespace(
    ...         load=load, thresholds=SimpleNamespace(**thresholds)
    ...     )
    ...     problem = SimpleNamespace(increment=np.zeros(2))
    ...     tables = SimpleNamespace(problem=problem, strength=None)
    ...     state = SimpleNamespace(diagnostics=diagnostics, slip=None)
    ...     plain = FunctionType(implicit_steps.py_func.__code__, globals() | names)
    ...     count, reason = plain(3, state, setting, tables, None)
    ...     return (
    ...         int(count),
    ...         Reason(reason).name,
    ...         np.round(tried, 4).tolist(),
    ...         ratios,
    ...     )
    >>> taken([0.021, 0.004, 0.019])
    (3, 'DONE', [1.0, 0.7071, 1.4142], [0.0, 0.414214, 0.666667])
    >>> (
    ...     taken([0.041, 0.019, 0.019, 0.019]),
    ...     taken([0.019, None, 0.019, 0.03, 0.019])[2],
    ... )
    ((3, 'DONE', [1.0, 0.5, 0.5, 0.5], [0.0, 0.5, 0.5]), [1.0, 1.0, 0.5, 0.5])
    >>> taken([None, None]), taken([0.019], total=np.nan)[:2]
    ((0, 'TO_EXPLICIT', [1.0, 0.5], []), (0, 'NOT_FINITE'))
    >>> taken([0.019], weakened=2)[:2], taken([0.019], fall=1.1)[:2]
    ((1, 'ALL_SLID'), (1, 'DROPPED'))
    >>> taken([0.019] * 3, fall=0.9)[:2]
    (3, 'DONE')
    >>> taken([0.019] * 3, end_time=1.5)
    (2, 'DONE', [1.0, 1.0], [0.0, 0.333333])
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

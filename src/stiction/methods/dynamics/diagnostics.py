"""Diagnostics after every step: maxima of the mean stress, instabilities, and front arrivals.

Problem
-------
Waves carry away the unbalanced stress, so the mean stress on the
interface is

    <tau> = tau_0 <p> + <tau_i> - Z <V>.                             (1)

<p> and <tau_i> are means over the nodes that can break. Nodes beyond an
extent have no effect. If the interface has an extent, the nodes beyond
take over stress without any waves. Then (1) includes the stress that
they take over (`whole_stress`), and results do not (`mean_stress`).
<V> and the mean strength refer to a period of two extents
(`Thresholds.period_nodes`), or to the true period if it is shorter.

An instability is slip that the load does not drive: after a maximum of
<tau>, waves lower <tau> by `EVENT_DROP` of the stress scale
(`docs/guide/model.md`). The instability began at that maximum. A falling
load also lowers <tau>, but without an instability. Therefore the
relevant fall is

    fall = min(max <tau> - <tau>, Z <V> - Z <V> at the maximum).     (2)

The fall counts only if the mean strength of all nodes has fallen as much as
<tau> ever did since the maximum. Slipping nodes carry their strength,
and static stress transfer only takes load off them (the sum of K d over
them is not negative). So the sum of (1) over them says that Z <V> grows
by no more than strength falls and the load on them rises. In a slow
instability strength falls by ten times as much as <tau>. If locked
nodes at their residual strength slip again because the load rises,
waves may overshoot and lower <tau>, but strength does not fall. A
stress above the strength at the start counts as strength, because the
release of this stress is also an instability.

Algorithm, after each step of a run (`observe`)
-----------------------------------------------
1. Compute the fall (2).
2. While <tau> is practically at its maximum, the fastest node is the
   place of the maximum. At slow loading, all creeping patches are about
   equally slow at the maximum. The unstable patch is faster only just
   after the maximum.
3. An instability ends when <tau> rises above the maximum at which it
   began. The instability was arrested if a node slipped faster than
   `Thresholds.unstable_slip_rate`, which the waves of an earlier
   instability do not reach. The present <tau> is the next maximum.
   (Explicit steps also end an instability when the interface is calm
   (see `explicit`).)
4. Between instabilities a higher <tau> is the next maximum, and a fall
   by `EVENT_DROP` begins an instability. The onset is the instability
   with the highest maximum so far.
5. Note <tau> once all nodes that can break are at their
   residual strength. From then on no instability can begin.
   Reaching this state is not an instability by itself, because
   the last nodes next to the end of an extent may creep to this
   state. If they do, the interface slid in the previous
   instability, which then does not count as arrested.
6. Slip is fast while a node slips at `Thresholds.unstable_slip_rate`
   and the mean slip rate is above `PULSE_SHARE` of its largest. An
   event of the table ends when `Thresholds.settling_time` has passed
   since its last fast slip, and its instability ends with it. The size
   of a step, creep under the load and an echo of a periodic image do
   not move this end.

This has two consequences. A maximum without such a fall, for example
the largest load or the stress that returns when slip ends, is not an
instability. If the stress is above the strength at the start, the
maximum is the mean stress before the first slip, with which a run
begins (`Run.start`).
"""

from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.jit import jit_inside
from stiction.methods.dynamics.state import (
    PULSE_SHARE,
    Nodes,
    PiecewiseLinear,
    RuptureState,
    Setting,
    StepRecord,
    Thresholds,
    value_at,
)

MAX_DROP_RATIO = 3.0  # largest tau_p - tau_r that counts, relative to the drop by the load
# Fractions of the stress scale:
EVENT_DROP = 1e-4  # drop of the mean stress that begins an event
STEADY_STRESS = 1e-2  # Z V of creep whose waves implicit steps may smear
_AT_MAXIMUM = 1e-5  # distance from its maximum at which the mean stress counts as being there


class TakenStep(NamedTuple):
    """The step that was taken, with the slip of the nodes in it, and their strength after it."""

    time: float  # at its end, s
    size: float  # s
    load: float  # tau_0 at its end, Pa
    work: float  # of the load on the slip, J/m
    radiated: float  # Z <V> at its end, Pa
    increments: Array  # m
    strength: Array  # Pa


def stress_scale(nodes: Nodes) -> PiecewiseLinear:
    """Return the stress scale as a function of the load, both Pa.

    The scale is the mean over the nodes that can break of

        max(0, min(tau_p - tau_r, MAX_DROP_RATIO (tau_0 p + tau_i - tau_r))).

    The second term is the drop that the load provides. If strengths are
    similar, the scale is the mean of tau_p - tau_r. Nodes far stronger
    than the load do not raise it. The scale grows as the load becomes
    able to break them.

    The first node holds the scale back at low loads, and the last node from
    a load of 3.8 Pa. The middle node cannot break.

    >>> peak, residual = np.array([7.0, np.inf, 5.0]), np.array([1.0, 0.0, 2.0])
    >>> profile, initial = np.array([2.0, 9.0, 0.5]), np.array([-1.0, 9.0, 1.0])
    >>> nodes = Nodes(peak, residual, np.ones(3), np.ones(3), profile, initial)
    >>> scale = stress_scale(nodes)
    >>> for load in (1.0, 1.5, 2.5, 3.5, 20.0):
    ...     drop = np.minimum(
    ...         peak - residual, 3.0 * (load * profile + initial - residual)
    ...     )
    ...     print(
    ...         f"{value_at(scale, load):.4f} {np.maximum(drop[[0, 2]], 0.0).mean():.4f}"
    ...     )
    0.0000 0.0000
    1.5000 1.5000
    3.3750 3.3750
    4.1250 4.1250
    4.5000 4.5000
    """
    can_break = np.isfinite(nodes.peak)
    peak, residual = nodes.peak[can_break], nodes.residual[can_break]
    profile, initial = nodes.profile[can_break], nodes.initial[can_break]
    # Loads between which the term of a node rises, with this slope.
    first = (residual - initial) / profile
    last = first + (peak - residual) / (MAX_DROP_RATIO * profile)
    slope = MAX_DROP_RATIO * profile / profile.size
    loads, kink = np.unique(np.concatenate([first, last]), return_inverse=True)
    bends = np.bincount(kink, np.concatenate([slope, -slope]))
    # Add a load, so that the table shows the slope beyond the last kink.
    loads = np.append(loads, loads[-1] + max(1.0, abs(loads[-1])))
    scales = np.concatenate([[0.0], np.cumsum(np.cumsum(bends) * np.diff(loads))])
    return PiecewiseLinear(loads, scales)


@jit_inside
def _set_maximum(step: Any, maximum: Any, radiated: float) -> None:
    """Record the present mean stress as the last maximum.

    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> now = np.zeros(1, DIAGNOSTICS).view(np.recarray)[0]
    >>> step, maximum = now.step, now.maximum
    >>> step.time, step.load, step.mean_stress, step.whole_stress = (
    ...     3.0,
    ...     5.0,
    ...     7.0,
    ...     8.0,
    ... )
    >>> step.strength_change, step.top_node, maximum.largest_fall = -2.0, 4, 9.0
    >>> _set_maximum.py_func(step, maximum, 0.5)
    >>> print(*(f"{name}={maximum[name]:g}" for name in maximum.dtype.names))
    stress=8 breakable=7 radiated=0.5 strength=-2 largest_fall=0 time=3 load=5 work=0 node=4
    """
    maximum.stress, maximum.radiated = step.whole_stress, radiated
    maximum.strength, maximum.largest_fall = step.strength_change, 0.0
    maximum.breakable, maximum.node = step.mean_stress, step.top_node
    maximum.time, maximum.load = step.time, step.load


@jit_inside
def _begin_event(now: Any) -> None:
    """Step 4: begin an instability at the last maximum of the mean stress.

    The mean stress with the nodes beyond the extent is highest at the third
    of four instabilities, and the mean stress without them at the second.

    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> now = np.zeros(1, DIAGNOSTICS).view(np.recarray)[0]
    >>> maxima = [(6.0, 5.0, 0.1, 11.0, 3), (6.2, 5.5, 0.2, 12.0, 2)]
    >>> maxima += [(7.0, 4.0, 0.3, 13.0, 1), (6.5, 4.5, 0.4, 14.0, 5)]
    >>> for stress, breakable, time, load, node in maxima:
    ...     now.maximum.stress, now.maximum.breakable, now.maximum.node = (
    ...         stress,
    ...         breakable,
    ...         node,
    ...     )
    ...     now.maximum.time, now.maximum.load, now.step.top_slip_rate = (
    ...         time,
    ...         load,
    ...         0.25,
    ...     )
    ...     _begin_event.py_func(now)
    >>> print(
    ...     *(
    ...         f"{name}={now.results[name]:g}"
    ...         for name in now.results.dtype.names[:5]
    ...     )
    ... )
    first_stress=5 onset_stress=7 critical_stress=5.5 onset_time=0.3 onset_load=13
    >>> [int(now.results[name]) for name in ("instabilities", "onset_node")]
    [4, 1]
    >>> int(now.event.unstable), int(now.event.begun), float(now.event.slip_rate)
    (1, 1, 0.25)
    """
    event, results, maximum = now.event, now.results, now.maximum
    event.unstable, event.begun, event.slip_rate = 1, 1, now.step.top_slip_rate
    is_first = results.instabilities == 0
    results.instabilities += 1
    if is_first:
        results.first_stress = maximum.breakable
    if is_first or maximum.breakable > results.critical_stress:
        results.critical_stress = maximum.breakable
    if is_first or maximum.stress > results.onset_stress:
        results.onset_stress, results.onset_time = maximum.stress, maximum.time
        results.onset_load, results.onset_node = maximum.load, maximum.node


@jit_inside
def end_event(now: Any, unstable_slip_rate: float, radiated: float) -> None:
    """Step 3: end an event, because the mean stress has recovered or the interface is calm.

    Only the first instability counts as arrested: it was fast enough, and
    not all nodes had broken. The last call finds no instability.

    >>> from types import FunctionType
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> names = globals() | {"_set_maximum": _set_maximum.py_func}
    >>> plain = FunctionType(
    ...     end_event.py_func.__code__, names
    ... )  # without compilation
    >>> now = np.zeros(1, DIAGNOSTICS).view(np.recarray)[0]
    >>> for unstable, rate, broken in (
    ...     (1, 0.6, 0),
    ...     (1, 0.5, 0),
    ...     (1, 0.6, 1),
    ...     (0, 0.6, 0),
    ... ):
    ...     now.event.unstable, now.event.slip_rate, now.results.all_broken = (
    ...         unstable,
    ...         rate,
    ...         broken,
    ...     )
    ...     now.step.whole_stress += 1.0
    ...     plain(now, 0.5, 0.0)
    ...     flags = (
    ...         now.event.last_arrested,
    ...         now.results.arrested_events,
    ...         now.event.unstable,
    ...     )
    ...     print(*flags, now.maximum.stress)
    1 1 0 1.0
    0 1 0 2.0
    0 1 0 3.0
    0 1 0 3.0
    """
    event, results = now.event, now.results
    if event.unstable:
        event.unstable = 0
        # Once all nodes have broken the event cannot have been arrested.
        event.last_arrested = not results.all_broken and event.slip_rate > unstable_slip_rate
        results.arrested_events += event.last_arrested
        _set_maximum(now.step, now.maximum, radiated)


@jit_inside
def observe(now: Any, thresholds: Thresholds, radiated: float) -> Any:
    """Update the maximum and the instabilities.

    Return the drop of the mean stress, Pa.

    The scale makes a drop of 1 Pa an instability. The stress rises, stays,
    falls by 0.05 Pa, falls by 2 Pa (but waves took off 1.5 Pa), and
    recovers. A deep fall without weakening and a small fall after
    it are no instabilities. Then the last nodes reach their residual
    strength: the instability was the sliding, and not arrested.

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> plain = dict(globals())  # the kernels without compilation
    >>> for kernel in (_set_maximum, _begin_event, end_event, observe):
    ...     plain[kernel.__name__] = FunctionType(kernel.py_func.__code__, plain)
    >>> now = np.zeros(1, DIAGNOSTICS).view(np.recarray)[0]
    >>> step, results, now.run.scale = now.step, now.results, 1e4
    >>> thresholds = SimpleNamespace(unstable_slip_rate=0.5, breakable=4)
    >>> steps = [(100.0, 0.25, 0.0, 0), (100.0, 0.25, 0.0, 0), (99.95, 0.3, -0.5, 0)]
    >>> steps += [(98.0, 1.75, -3.0, 0), (101.0, 0.5, -3.0, 0), (95.0, 4.0, -3.5, 3)]
    >>> steps += [(100.5, 1.0, -3.6, 3), (94.0, 5.0, -3.6, 4)]
    >>> for node, (stress, radiated, change, weakened) in enumerate(steps):
    ...     step.whole_stress, step.strength_change, step.weakened_nodes = (
    ...         stress,
    ...         change,
    ...         weakened,
    ...     )
    ...     step.top_node, step.top_slip_rate = node, (0.6 if node == 3 else 0.4)
    ...     step.mean_stress = 0.5 * stress
    ...     fall = plain["observe"](now, thresholds, radiated)
    ...     state = (
    ...         results.instabilities,
    ...         results.arrested_events,
    ...         results.all_broken,
    ...     )
    ...     print(
    ...         f"{fall:.2f}",
    ...         *state,
    ...         now.event.unstable,
    ...         now.maximum.node,
    ...         now.maximum.stress,
    ...     )
    -100.00 0 0 0 0 0 100.0
    0.00 0 0 0 0 0 100.0
    0.05 0 0 0 0 2 100.0
    1.50 1 0 0 1 2 100.0
    -1.00 1 1 0 0 4 101.0
    0.00 1 1 0 0 4 101.0
    0.00 1 1 0 0 4 101.0
    0.00 1 0 1 0 4 101.0
    >>> (
    ...     float(results.kinetic_stress),
    ...     int(results.onset_node),
    ...     round(float(now.event.slip_rate), 9),
    ... )
    (47.0, 2, 0.6)
    """
    step, maximum, event, results = now.step, now.maximum, now.event, now.results
    # 1. The fall by waves.
    below = maximum.stress - step.whole_stress
    fall = min(below, radiated - maximum.radiated)
    maximum.largest_fall = max(maximum.largest_fall, fall)
    if maximum.largest_fall > maximum.strength - step.strength_change:
        fall = 0.0
    # 2. The place of the maximum.
    if below < _AT_MAXIMUM * now.run.scale and fall > 0.0:
        maximum.node = step.top_node
    if event.unstable:
        # 3. The end of an instability.
        event.slip_rate = max(event.slip_rate, step.top_slip_rate)
        if step.whole_stress > maximum.stress:
            end_event(now, thresholds.unstable_slip_rate, radiated)
    elif step.whole_stress > maximum.stress:
        # 4. Another maximum, or the beginning of an instability.
        _set_maximum(step, maximum, radiated)
    elif fall > EVENT_DROP * now.run.scale and not results.all_broken:
        _begin_event(now)
    # 5. The end of all strength above the residual.
    if step.weakened_nodes >= thresholds.breakable and not results.all_broken:
        results.all_broken, results.kinetic_stress = 1, step.mean_stress
        if not event.unstable:
            results.arrested_events -= event.last_arrested
    return fall


@jit_inside
def finish_step(
    state: RuptureState, setting: Setting, taken: TakenStep, record: StepRecord, row: int
) -> Any:
    """Update diagnostics, arrivals and the record.

    Return the drop of the mean stress, Pa.

    If the record has no rows, it stays empty.

    Node 3 cannot break. Node 0 passes half its residual slip in the middle
    of the step, node 1 has done so before, node 2 never weakens, and node 4
    has not slipped far enough.

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS, STATION, STEP
    >>> plain = dict(globals())  # the kernels without compilation
    >>> for kernel in (_set_maximum, _begin_event, end_event, observe, finish_step):
    ...     plain[kernel.__name__] = FunctionType(kernel.py_func.__code__, plain)
    >>> state = SimpleNamespace(
    ...     slip=np.array([0.5, 0.25, 0.05, 0.0, 0.1]),
    ...     slip_rate=np.array([1.0, 3.0, 2.0, 0.0, 0.5]),
    ...     stress=np.array([4.0, 5.0, -6.0, 1.0, 3.0]),
    ...     arrival=np.array([np.nan, 0.7, np.nan, np.nan, np.nan]),
    ...     maximum_slip=np.zeros(5),
    ...     diagnostics=np.zeros(1, DIAGNOSTICS).view(np.recarray),
    ... )
    >>> residual_slip = np.array([0.8, 0.25, 0.0, np.inf, 1.0])
    >>> peak = np.array([8.0, 6.0, 7.0, np.inf, 9.0])
    >>> thresholds = SimpleNamespace(
    ...     front_share=0.5,
    ...     breakable=4,
    ...     period_nodes=6,
    ...     held=True,
    ...     unstable_slip_rate=2.5,
    ...     settling_time=5.0,
    ... )
    >>> setting = SimpleNamespace(
    ...     nodes=SimpleNamespace(residual_slip=residual_slip, peak=peak),
    ...     thresholds=thresholds,
    ...     mean_initial=1.0,
    ...     mean_profile=0.5,
    ...     grid=SimpleNamespace(impedance=4.0),
    ...     scale=PiecewiseLinear(np.array([0.0, 10.0]), np.array([0.0, 30.0])),
    ...     stations=np.array([2, 0]),
    ... )
    >>> record = StepRecord(np.recarray(2, STEP), np.recarray((2, 2), STATION))
    >>> increments = np.array([0.2, 0.1, 0.04, 0.0, 0.1])
    >>> strength = np.array([5.0, 3.0, 2.0, np.inf, 6.0])
    >>> taken = TakenStep(10.0, 2.0, 10.0, 7.0, 2.0, increments, strength)
    >>> now = state.diagnostics[0]
    >>> now.event.open, step = 1, now.step
    >>> float(plain["finish_step"](state, setting, taken, record, 1))
    -4.0
    >>> state.arrival.tolist(), state.maximum_slip.tolist(), float(now.maximum.work)
    ([9.0, 0.7, 8.0, nan, nan], [0.5, 0.25, 0.05, 0.0, 0.1], 7.0)
    >>> for names in (step.dtype.names[4:8], step.dtype.names[8:]):
    ...     print(*(f"{name}={step[name]:.4g}" for name in names))
    mean_slip=0.225 mean_slip_rate=0.75 mean_stress=1.5 whole_stress=4
    strength_change=-2.333 top_slip_rate=3 top_node=1 weakened_nodes=2
    >>> (
    ...     float(now.run.scale),
    ...     float(now.run.reverse_margin),
    ...     int(now.run.reverse_node),
    ... )
    (30.0, -4.0, 2)
    >>> int(now.event.fast), float(now.event.fast_since), float(now.event.peak_rate)
    (1, 10.0, 0.75)
    >>> float(record.steps[1].load), record.stations[1].slip.tolist()
    (10.0, [0.05, 0.5])
    >>> (
    ...     record.stations[1].slip_rate.tolist(),
    ...     record.stations[1].shear_stress.tolist(),
    ... )
    ([2.0, 1.0], [-6.0, 4.0])

    After the settling time without fast slip, the event ends.

    >>> empty = StepRecord(record.steps[:0], record.stations[:0])
    >>> for time, rate in ((12.0, 2.6), (16.9, 2.4), (17.0, 2.4)):
    ...     state.slip_rate[:], later = rate, taken._replace(time=time, radiated=1.0)
    ...     _ = plain["finish_step"](state, setting, later, empty, 0)
    ...     print(
    ...         now.event.calm, now.event.fast_since, now.event.fast_until, step.work
    ...     )
    0 10.0 12.0 14.0
    0 10.0 12.0 21.0
    1 10.0 12.0 28.0
    """
    now, increments, strength = state.diagnostics[0], taken.increments, taken.strength
    step, run, event = now.step, now.run, now.event
    slip, slip_rate, stress = state.slip, state.slip_rate, state.stress
    residual_slip, arrival = setting.nodes.residual_slip, state.arrival
    thresholds, peak = setting.thresholds, setting.nodes.peak
    top_slip_rate, top_node, weakened = -1.0, 0, 0
    slip_sum, change, stress_sum = 0.0, 0.0, 0.0  # the last two over nodes that can break
    margin, margin_node = run.reverse_margin, run.reverse_node
    for i in range(slip.size):
        if slip_rate[i] > top_slip_rate:
            top_slip_rate, top_node = slip_rate[i], i
        if stress[i] + strength[i] < margin:
            margin, margin_node = stress[i] + strength[i], i
        if slip[i] >= residual_slip[i]:
            weakened += 1
        # A node that does not weaken has d_c
        # = 0: there the first slip counts.
        front = thresholds.front_share * residual_slip[i]
        if np.isnan(arrival[i]) and slip[i] > 0.0 and slip[i] >= front:
            # Assume that slip grew at a constant rate in the step, and
            # interpolate.
            passed = (slip[i] - front) / max(increments[i], 1e-300)
            arrival[i] = taken.time - taken.size * min(1.0, passed)
        slip_sum += slip[i]
        if peak[i] < np.inf:
            change += strength[i] - peak[i]
            stress_sum += stress[i]
    whole_stress = setting.mean_initial + taken.load * setting.mean_profile - taken.radiated
    step.time, step.size, step.load = taken.time, taken.size, taken.load
    step.whole_stress, step.weakened_nodes = whole_stress, weakened
    step.strength_change = change / thresholds.period_nodes
    # Without locked nodes, equation (1) has less round-off than the sum.
    step.mean_stress = stress_sum / thresholds.breakable if thresholds.held else whole_stress
    step.top_slip_rate, step.top_node = top_slip_rate, top_node
    run.reverse_margin, run.reverse_node = margin, margin_node
    step.work, step.mean_slip = step.work + taken.work, slip_sum / thresholds.breakable
    per_node = thresholds.period_nodes / thresholds.breakable
    step.mean_slip_rate = taken.radiated / setting.grid.impedance * per_node
    run.scale = max(run.scale, value_at(setting.scale, taken.load))
    fall = observe(now, thresholds, taken.radiated)
    if top_slip_rate > thresholds.unstable_slip_rate and not event.begun:
        event.peak_rate = max(event.peak_rate, step.mean_slip_rate)
        if step.mean_slip_rate >= PULSE_SHARE * event.peak_rate:
            event.fast_since = event.fast_since if event.fast else step.time
            event.fast, event.fast_until = 1, step.time
    settled = step.time >= event.fast_until + thresholds.settling_time
    if settled and event.fast and event.open and not event.begun:
        # 6. The end of an event. The next one may begin from here.
        end_event(now, thresholds.unstable_slip_rate, taken.radiated)
        event.calm = 1
    if now.maximum.time == step.time:  # an event may begin here
        now.maximum.work = step.work
        for i in range(slip.size):
            state.maximum_slip[i] = slip[i]
    if record.steps.size > 0:
        record.steps[row] = step
        for s in range(setting.stations.size):
            node, station = setting.stations[s], record.stations[row, s]
            station.slip, station.slip_rate = slip[node], slip_rate[node]
            station.shear_stress = stress[node]
    return fall

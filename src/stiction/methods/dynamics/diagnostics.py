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
    """Record the present mean stress as the last maximum."""
    maximum.stress, maximum.radiated = step.whole_stress, radiated
    maximum.strength, maximum.largest_fall = step.strength_change, 0.0
    maximum.breakable, maximum.node = step.mean_stress, step.top_node
    maximum.time, maximum.load = step.time, step.load


@jit_inside
def _begin_event(now: Any) -> None:
    """Step 4: begin an instability at the last maximum of the mean stress."""
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
    """Step 3: end an event, because the mean stress has recovered or the interface is calm."""
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

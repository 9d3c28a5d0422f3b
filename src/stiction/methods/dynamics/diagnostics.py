"""Updates after a step of either kind: peaks, events, arrival, the record."""

from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.jit import jit_inside
from stiction.methods.dynamics.state import (
    Grid,
    History,
    Nodes,
    Record,
    Setting,
    State,
    Thresholds,
    value_at,
)

REACH = 3.0  # a node counts with at most so many times the stress drop that the load provides
# In units of the stress scale:
EVENT_DROP = 1e-4  # fall of the mean stress that begins an event
STEADY_STRESS = 1e-2  # Z V of creep whose waves implicit steps may smear
_PEAK_WIDTH = 1e-5  # distance below its maximum at which the mean stress counts as at it


class Step(NamedTuple):
    """A step that was taken: its end, its size, the work of the load, and Z <V> at the end."""

    time: float
    size: float
    load: float
    work: float
    radiated: float


def stress_scale(nodes: Nodes) -> History:
    """Return the stress scale as a function of the load, both Pa.

    It is the mean over nodes of tau_p - tau_r, no node counting for more than `REACH` times
    tau_0 p + tau_i - tau_r, the drop that the load provides there. Where strengths are alike it
    is the mean of tau_p - tau_r; barriers that the load is far from breaking, infinite ones among
    them, do not raise it, and it grows with the load that comes to break them.
    """
    strength, residual = nodes.strength, nodes.residual
    profile, initial = nodes.profile, nodes.initial
    begin = (residual - initial) / profile
    end = begin + (strength - residual) / (REACH * profile)
    slope = REACH * profile / profile.size
    stops = np.isfinite(end)
    loads, at = np.unique(np.concatenate([begin, end[stops]]), return_inverse=True)
    bends = np.bincount(at, np.concatenate([slope, -slope[stops]]))
    # The last slope goes on beyond the last load; one more load makes it visible.
    loads = np.append(loads, loads[-1] + max(1.0, abs(loads[-1])))
    scales = np.concatenate([[0.0], np.cumsum(np.cumsum(bends) * np.diff(loads))])
    return History(loads, scales)


@jit_inside
def _at_maximum(now: Any, radiated: float) -> None:
    """Take the present mean stress for its last maximum."""
    now.local_stress, now.local_radiated = now.mean_stress, radiated
    now.local_time, now.local_load, now.local_node = now.time, now.load, now.top_node


@jit_inside
def _begin(now: Any) -> None:
    """Keep where an instability began: at the last maximum of the mean stress."""
    if now.first_stress == -np.inf:
        now.first_stress = now.local_stress
    if now.local_stress > now.onset_stress:
        now.onset_stress, now.onset_time = now.local_stress, now.local_time
        now.onset_load, now.onset_node = now.local_load, now.local_node


@jit_inside
def end_event(now: Any, unstable_rate: float, radiated: float) -> None:
    """End an event that is under way: the mean stress is as high as before, or all is calm."""
    if now.in_event:
        now.in_event = 0
        # After global sliding there is nothing left to arrest.
        if now.kinetic_stress == -np.inf and now.event_rate > unstable_rate:
            now.arrested += 1
        _at_maximum(now, radiated)


@jit_inside
def observe(now: Any, thresholds: Thresholds, radiated: float) -> Any:
    """Update events with the state after a step; return the fall of the mean stress, Pa.

    An instability is slip that the load does not drive: waves lower the mean stress by EVENT_DROP
    below its last maximum, where it began; a fall of the load itself does not count. Before a start
    above the strength the maximum is the stress without slip. No instability is a maximum that no
    such fall follows, be it the largest load or the stress that returns when slip dies. It ends
    when the mean stress rises above that maximum again or everything creeps, and was arrested if
    a node slipped faster than `unstable_rate`; waves of an earlier one are slower. The last nodes
    that can break may also creep to their residual strength: that is none. At slow loading all
    creeping patches are about equally slow there, so that the place of the onset, the fastest node,
    is read just after it.
    """
    fall = min(now.local_stress - now.mean_stress, radiated - now.local_radiated)
    if now.local_stress - now.mean_stress < _PEAK_WIDTH * now.scale and fall > 0.0:
        now.local_node = now.top_node
    if now.in_event:
        now.event_rate = max(now.event_rate, now.top_slip_rate)
        if now.mean_stress > now.local_stress:
            end_event(now, thresholds.unstable_rate, radiated)
    elif now.mean_stress > now.local_stress:
        _at_maximum(now, radiated)
    elif fall > EVENT_DROP * now.scale and now.kinetic_stress == -np.inf:
        now.in_event, now.event_rate = 1, now.top_slip_rate
        _begin(now)
    if now.slid >= thresholds.breakable and now.kinetic_stress == -np.inf:
        now.kinetic_stress = now.mean_stress
    return fall


@jit_inside
def finish_step(
    state: State,
    grid: Grid,
    setting: Setting,
    step: Step,
    increments: Array,
    strength: Array,
    record: Record,
    row: int,
) -> Any:
    """Update diagnostics, arrivals, and the record if there is one; return the fall of the stress.

    `increments` are those of slip in the step (m), `strength` is that after it (Pa), at the nodes.
    """
    now, slip, rate, stress = state.diagnostics[0], state.slip, state.rate, state.stress
    critical, arrival, half = setting.nodes.critical, state.arrival, setting.thresholds.arrival
    top, node, slid, slip_sum = -1.0, 0, 0, 0.0
    least, least_node = now.least, now.least_node
    for i in range(slip.size):
        if rate[i] > top:
            top, node = rate[i], i
        if stress[i] + strength[i] < least:
            least, least_node = stress[i] + strength[i], i
        if slip[i] >= critical[i]:
            slid += 1
        # d_c = 0 where nothing weakens: there the first slip counts.
        if np.isnan(arrival[i]) and slip[i] > 0.0 and slip[i] >= half * critical[i]:
            beyond = (slip[i] - half * critical[i]) / max(increments[i], 1e-300)
            arrival[i] = step.time - step.size * min(1.0, beyond)
        slip_sum += slip[i]
    mean_stress = setting.mean_initial + step.load * setting.mean_profile - step.radiated
    now.time, now.size, now.load = step.time, step.size, step.load
    now.mean_stress, now.top_slip_rate, now.top_node, now.slid = mean_stress, top, node, slid
    now.least, now.least_node = least, least_node
    now.work, now.mean_slip = now.work + step.work, slip_sum / slip.size
    now.scale = max(now.scale, value_at(setting.scale, step.load))
    fall = observe(now, setting.thresholds, step.radiated)
    if record.steps.size > 0:
        record.steps[row] = now
        for s in range(setting.stations.size):
            node, one = setting.stations[s], record.stations[row, s]
            one.slip, one.slip_rate, one.shear_stress = slip[node], rate[node], stress[node]
    return fall

"""Updates after a step of either kind: peaks, events, arrival, the record."""

from typing import Any, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.dynamics.loading import load_at
from stiction.dynamics.state import RECORD, History, Nodes, Setting, State
from stiction.jit import jit_inside

REACH = 3.0  # a node counts with at most so many times the stress drop that the load provides
# In units of the stress scale:
EVENT_DROP = 1e-4  # fall of the mean stress that begins an event
STEADY_STRESS = 1e-2  # Z V of creep whose waves implicit steps may smear
_PEAK_WIDTH = 1e-5  # distance below its maximum at which the mean stress counts as at it
_COLUMNS = len(RECORD)


class Step(NamedTuple):
    """A step that was taken: where it led, its sums over the nodes and its fastest node."""

    time: float
    size: float
    load: float
    work: float
    radiated: float
    mean_slip: float
    slid: int
    top: float
    node: int


def stress_scale(nodes: Nodes) -> History:
    """Return the stress scale as a function of the load: (loads, scales), Pa, straight in between.

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
    return loads, scales


@jit_inside
def end_event(now: Any, unstable_rate: float, mean_stress: float, radiated: float) -> None:
    """End an event that is under way: the mean stress is as high as before, or all is calm."""
    if now.in_event:
        now.in_event = 0
        # After global sliding there is nothing left to arrest.
        if now.kinetic_stress == -np.inf and now.event_rate > unstable_rate:
            now.arrested += 1
        now.local_stress, now.local_radiated = mean_stress, radiated


@jit_inside
def observe(now: Any, unstable_rate: float, mean_stress: float, step: Step) -> Any:
    """Update peaks and events with the state after a step; return the fall of the mean stress, Pa.

    The fall counts from the last local maximum, and only as far as waves carry it away: where the
    load itself goes down, nothing has become unstable. An event begins when it exceeds EVENT_DROP
    and ends when the mean stress rises above that maximum again or everything creeps. It was an
    arrested instability if a node slipped faster than `unstable_rate`; waves of an earlier one are
    slower. At slow loading all creeping patches are about equally slow at the maximum itself, so
    that the place of the onset is read just after it.
    """
    now.mean_stress = mean_stress
    if mean_stress > now.peak_stress:
        now.peak_stress, now.peak_time, now.peak_load = mean_stress, step.time, step.load
        now.peak_node = step.node
    fall = min(now.local_stress - mean_stress, step.radiated - now.local_radiated)
    if now.peak_stress - mean_stress < _PEAK_WIDTH * now.scale and fall > 0.0:
        now.peak_node = step.node
    if now.in_event:
        now.event_rate = max(now.event_rate, step.top)
        if mean_stress > now.local_stress:
            end_event(now, unstable_rate, mean_stress, step.radiated)
    elif mean_stress > now.local_stress:
        now.local_stress, now.local_radiated = mean_stress, step.radiated
    elif fall > EVENT_DROP * now.scale:
        now.in_event, now.event_rate = 1, step.top
        if now.first_stress == -np.inf:
            now.first_stress = now.local_stress
    return fall


@jit_inside
def arrived(slip: float, threshold: float, increment: float, time: float, size: float) -> Any:
    """Return when the slip passed a threshold in a step that ends at `time` beyond it, s."""
    return time - size * min(1.0, (slip - threshold) / max(increment, 1e-300))


@jit_inside
def finish_step(state: State, setting: Setting, record: Array, row: int, step: Step) -> Any:
    """Update the diagnostics, and the record if there is one; return the fall of the stress, Pa."""
    now = state.diagnostics[0]
    mean_stress = setting.mean_initial + step.load * setting.mean_profile - step.radiated
    now.time, now.load = step.time, step.load
    now.top_rate, now.slid = step.top, step.slid
    now.work += step.work
    now.scale = max(now.scale, load_at(setting.scale_loads, setting.scales, step.load))
    fall = observe(now, setting.thresholds.unstable_rate, mean_stress, step)
    if step.slid >= setting.thresholds.breakable and now.kinetic_stress == -np.inf:
        now.kinetic_stress = mean_stress
    if record.shape[0] > 0:
        record[row, 0], record[row, 1], record[row, 2] = step.time, step.load, mean_stress
        record[row, 3], record[row, 4] = step.mean_slip, step.top
        record[row, 5], record[row, 6] = step.size, now.work
        for s in range(setting.stations.size):
            node, column = setting.stations[s], _COLUMNS + 3 * s
            record[row, column] = state.slip[node]
            record[row, column + 1] = state.rate[node]
            record[row, column + 2] = state.stress[node]
    return fall

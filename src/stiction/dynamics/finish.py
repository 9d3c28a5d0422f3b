"""What explicit and implicit steps have in common once the new slip is known."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.dynamics import monitor
from stiction.dynamics.arrays import Fields, Setting
from stiction.dynamics.scale import follow_scale
from stiction.jit import jit


class Taken(NamedTuple):
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


@jit
def arrived(slip: float, threshold: float, increment: float, time: float, size: float) -> Any:
    """When the slip passed a threshold in a step that ends at `time` with it beyond, s."""
    return time - size * min(1.0, (slip - threshold) / max(increment, 1e-300))


@jit
def finish_step(fields: Fields, setting: Setting, record: Array, row: int, step: Taken) -> Any:
    """Tell the monitor, and the record if there is one; return the fall of the mean stress, Pa."""
    watch = fields.watch
    mean_stress = setting.mean_initial + step.load * setting.mean_profile - step.radiated
    watch[monitor.TIME], watch[monitor.LOAD] = step.time, step.load
    watch[monitor.TOP_RATE], watch[monitor.SLID] = step.top, step.slid
    watch[monitor.WORK] += step.work
    watch[monitor.STEP] = step.size
    follow_scale(watch, setting.control, setting.scale_loads, setting.scales, step.load)
    fall = monitor.observe(
        watch, setting.control, step.time, step.load, mean_stress, step.radiated, step.node
    )
    if step.slid >= setting.control[monitor.BREAKABLE] and watch[monitor.KINETIC] == -np.inf:
        watch[monitor.KINETIC] = mean_stress
    if record.shape[0] > 0:
        record[row, monitor.REC_TIME], record[row, monitor.REC_LOAD] = step.time, step.load
        record[row, monitor.REC_MEAN_STRESS] = mean_stress
        record[row, monitor.REC_MEAN_SLIP] = step.mean_slip
        record[row, monitor.REC_TOP_RATE], record[row, monitor.REC_STEP] = step.top, step.size
        record[row, monitor.REC_WORK] = watch[monitor.WORK]
        for s in range(setting.stations.size):
            node, column = setting.stations[s], monitor.COLUMNS + 3 * s
            record[row, column] = fields.slip[node]
            record[row, column + 1] = fields.rate[node]
            record[row, column + 2] = fields.stress[node]
    return fall

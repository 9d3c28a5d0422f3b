"""What is watched at every step: peaks of the mean stress, arrested events, rupture arrival."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.jit import jit

# Fields of the `watch` array: plain float64, so that compiled steps and checkpoints share it.
TIME, LOAD, WORK, MEAN_STRESS = 0, 1, 2, 3  # s, Pa, J/m, Pa
PEAK_STRESS, PEAK_TIME, PEAK_LOAD, PEAK_NODE = 4, 5, 6, 7
LOCAL_STRESS, IN_EVENT, FIRST_STRESS, ARRESTED = 8, 9, 10, 11
EVENT_DROP, TOP_RATE, SLID, BAD_NODE = 12, 13, 14, 15
EXPLICIT_STEPS, IMPLICIT_STEPS, REJECTED_STEPS, CALM_STEPS = 16, 17, 18, 19
STEP, LOCAL_RADIATED, RADIATED, PAST_STEP = 20, 21, 22, 23
KINETIC = 24  # Pa, mean stress when all that can break first had broken; -inf before
PEAK_WIDTH = 25  # Pa, so close below its maximum the mean stress still is at it
SCALE = 26  # Pa, stress scale of the largest load so far
CALM_TOP = 27  # m/s, largest slip rate when the row of calm steps began
START_LOAD, START_ERROR = 28, 29  # Pa, where the run began and what that may cost
EVENT_RATE = 30  # m/s, largest slip rate in the event under way
FIELDS = 31

# Why a compiled phase returned.
DONE, ALL_SLID, TO_EXPLICIT, TO_IMPLICIT, NOT_FINITE, DROPPED, AT_REST = range(7)
RUNAWAY = 7  # seen between phases, not in them

# Columns of the record of every step.
REC_TIME, REC_LOAD, REC_MEAN_STRESS, REC_MEAN_SLIP, REC_TOP_RATE, REC_STEP, REC_WORK = range(7)
COLUMNS = 7


# Thresholds of the `control` array; stresses in units of the stress scale (see `scale`).
(
    SLID_STOP,  # nodes at the residual strength at which to return
    EVENT_STOP,  # 1 to return at an event
    REST_STOP,  # 1 to return when all is at rest after an event
    END_TIME,  # s
    BREAKABLE,  # nodes that can break at all
    CALM_STRESS,  # radiated stress Z V of the fastest node below which a step counts as calm
    CALM_SLIP,  # or slip per load that it may make, m/Pa: creep that the load alone drives
    STEADY_STRESS,  # or Z V below which it counts as calm if V has not changed by a factor 2
    CALM_COUNT,  # calm steps in a row after which implicit steps take over
    SLIP_STEP,  # loss of strength of a node in one implicit step, in units of tau_p - tau_r
    SMALL_DROP,  # nodes that weaken by less than this count as weakening by this
    LOAD_STEP,  # largest rise of the load factor in one implicit step
    SMALLEST_STEP,  # implicit step below which explicit steps take over, s
    LARGEST_STEP,  # s
    RESIDUAL,  # stress residual at which an implicit step counts as solved
    EVENT_DROP_SIZE,  # fall of the mean stress that counts as an event
    EXPLICIT_ONLY,  # 1 to take no implicit steps
    NOTICED,  # radiated stress Z <V> from which the growth of one implicit step is limited
    GROWTH,  # by this factor
    PEAK_WIDTH_SIZE,  # so close below its maximum the mean stress still is at it
    NEGLIGIBLE,  # rise of the load in a step for which that does not matter
    ARRIVAL,  # slip at which strength has lost half of its way, in units of that at the residual
    UNSTABLE_RATE,  # slip rate (m/s) that only an instability reaches
    CURVED,  # 0 if strength is that of the linear law, whose pieces are met to the bit
) = range(24)
CONTROLS = 24


@jit
def settle(watch: Array, control: Array, mean_stress: float, radiated: float) -> None:
    """End an event that is under way: the mean stress is as high as before, or all is calm."""
    if watch[IN_EVENT] > 0.0:
        watch[IN_EVENT] = 0.0
        # After global sliding there is nothing left to arrest.
        if watch[KINETIC] == -np.inf and watch[EVENT_RATE] > control[UNSTABLE_RATE]:
            watch[ARRESTED] += 1.0
        watch[LOCAL_STRESS], watch[LOCAL_RADIATED] = mean_stress, radiated


@jit
def observe(
    watch: Array,
    control: Array,
    time: float,
    load: float,
    mean_stress: float,
    radiated: float,
    node: int,
) -> Any:
    """Update peaks and events with the state after a step; return the fall of the mean stress, Pa.

    The fall counts from the last local maximum, and only as far as waves carry it away: where the
    load itself goes down, nothing has become unstable. An event begins when the fall exceeds
    EVENT_DROP, and ends when the mean stress rises above that maximum again or everything creeps.
    It was an arrested instability if a node slipped faster than UNSTABLE_RATE in it: waves that an
    earlier one has left behind, and creep that they modulate, also make the mean stress fall, but
    stay slower.

    At slow loading all creeping patches are about equally slow at the maximum itself, so that
    the place of the onset is read just after it.
    """
    watch[MEAN_STRESS] = mean_stress
    if mean_stress > watch[PEAK_STRESS]:
        watch[PEAK_STRESS], watch[PEAK_TIME], watch[PEAK_LOAD], watch[PEAK_NODE] = (
            mean_stress,
            time,
            load,
            node,
        )
    fall = min(watch[LOCAL_STRESS] - mean_stress, radiated - watch[LOCAL_RADIATED])
    if watch[PEAK_STRESS] - mean_stress < watch[PEAK_WIDTH] and fall > 0.0:
        watch[PEAK_NODE] = node
    if watch[IN_EVENT] > 0.0:
        watch[EVENT_RATE] = max(watch[EVENT_RATE], watch[TOP_RATE])
        if mean_stress > watch[LOCAL_STRESS]:
            settle(watch, control, mean_stress, radiated)
    elif mean_stress > watch[LOCAL_STRESS]:
        watch[LOCAL_STRESS], watch[LOCAL_RADIATED] = mean_stress, radiated
    elif fall > watch[EVENT_DROP]:
        watch[IN_EVENT], watch[EVENT_RATE] = 1.0, watch[TOP_RATE]
        if watch[FIRST_STRESS] == -np.inf:
            watch[FIRST_STRESS] = watch[LOCAL_STRESS]
    return fall

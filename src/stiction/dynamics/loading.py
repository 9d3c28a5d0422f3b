"""Load histories: tau_0(t) as straight pieces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.dynamics.state import Floats, History
from stiction.errors import InputError
from stiction.jit import jit
from stiction.model import describe

_SMOOTHNESS = 1e-7  # of the range of the load: how far straight pieces may miss a callable
_MOST_PIECES = 200_000


@jit
def load_at(times: Array, values: Array, t: float) -> Any:
    """Piecewise linear load history, continued beyond its last point with its last slope."""
    low, high = 0, times.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if times[middle] <= t:
            low = middle
        else:
            high = middle
    slope = (values[high] - values[low]) / (times[high] - times[low])
    return values[low] + slope * (t - times[low])


def turns(history: History) -> Floats:
    """Return the times at which the load begins to fall or to rise again, s."""
    times, values = history
    rising = np.sign(np.diff(values))
    turned: Floats = times[1:-1][rising[1:] != rising[:-1]]
    return turned


def _sampled(function: Callable[[float], float], end: float) -> History:
    """Straight pieces that follow a callable, halved until they do."""

    def value(t: float) -> float:
        try:
            result = float(function(t))
        except (TypeError, ValueError):
            raise InputError(f"load: the callable returns no number at t = {t:.6g} s") from None
        if not np.isfinite(result):
            raise InputError(f"load: the callable returns {result!r} at t = {t:.6g} s")
        return result

    times = list(np.linspace(0.0, end, 257))
    values = [value(t) for t in times]
    scale = max(max(values) - min(values), abs(values[0]), 1e-300)
    done_t, done_v = [times[0]], [values[0]]
    todo = [(times[i], values[i], times[i + 1], values[i + 1]) for i in range(256)][::-1]
    while todo:
        t0, v0, t1, v1 = todo.pop()
        tm = 0.5 * (t0 + t1)
        vm = value(tm)
        if abs(vm - 0.5 * (v0 + v1)) > _SMOOTHNESS * scale and t1 - t0 > 1e-12 * end:
            todo += [(tm, vm, t1, v1), (t0, v0, tm, vm)]
        else:
            done_t += [tm, t1]
            done_v += [vm, v1]
        if len(done_t) + len(todo) > _MOST_PIECES:
            raise InputError(
                f"load: the callable needs more than {_MOST_PIECES} straight pieces up to "
                f"end_time = {end:g} s; smooth it, or give samples (times, values)"
            )
    return np.array(done_t), np.array(done_v)


def load_history(load: Any, end_time: float | None) -> History:
    """Return times (s) and values (Pa) of tau_0 from a callable, or from samples.

    Parameters
    ----------
    load : callable or (times, values)
        tau_0(t) in Pa for t >= 0 in s; samples are joined by straight lines, and the last slope
        goes on beyond the last of them.
    end_time : float or None
        Needed with a callable, s.

    Raises
    ------
    InputError
    """
    if callable(load):
        if end_time is None:
            raise InputError("end_time: needed where load is a callable, got None")
        return _sampled(load, end_time)
    pair = isinstance(load, Sequence) or (isinstance(load, np.ndarray) and load.ndim > 0)
    if not pair or len(load) != 2:
        raise InputError(
            f"load: must be a callable tau_0(t) or a pair (times, values), got {describe(load)}"
        )
    try:
        times, values = (np.ascontiguousarray(part, dtype=np.float64) for part in load)
    except (TypeError, ValueError):
        raise InputError("load: times and values must be arrays of numbers") from None
    problems = []
    if times.ndim != 1 or times.shape != values.shape or times.size < 2:
        problems.append(
            "load: times and values must be 1-d, equally long, with two entries or more; got "
            f"shapes {times.shape} and {values.shape}"
        )
    elif not (np.all(np.isfinite(times)) and np.all(np.isfinite(values))):
        problems.append("load: times and values must be finite")
    elif times[0] != 0.0 or np.any(np.diff(times) <= 0.0):
        problems.append("load: times must begin at 0 s and increase")
    if problems:
        raise InputError(problems)
    return times, values


def first_reach(history: History, target: float, what: str = "first slip") -> float:
    """Return when tau_0 first reaches `target`, s; `what` says in messages why it must.

    Raises
    ------
    InputError
        If the load goes down before it gets there, or never does.
    """
    times, values = history
    if values[0] >= target:
        return 0.0
    above = np.flatnonzero(values >= target)
    last = int(above[0]) if above.size else values.size - 1
    falling = np.flatnonzero(np.diff(values[: last + 1]) < 0.0)
    if falling.size:
        at = times[falling[0]]
        raise InputError(
            f"load: goes down at t = {at:.6g} s before anything slips ({what} at tau_0 = "
            f"{target:.6g} Pa); begin with a load that does not fall"
        )
    low = last - 1
    slope = (values[last] - values[low]) / (times[last] - times[low])
    if slope <= 0.0:
        raise InputError(
            f"load: stays at or below {values.max():.6g} Pa, but the {what} needs tau_0 = "
            f"{target:.6g} Pa"
        )
    return float(times[low] + (target - values[low]) / slope)

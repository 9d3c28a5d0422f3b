"""Load histories: tau_0(t) as straight pieces."""

from typing import Any

import numpy as np

from stiction.base.errors import InputError
from stiction.base.jit import jit
from stiction.base.model import real_array
from stiction.methods.dynamics.state import Floats, History


@jit
def value_at(history: History, t: float) -> Any:
    """Value of a piecewise linear function."""
    times, values = history
    low, high = 0, times.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if times[middle] <= t:
            low = middle
        else:
            high = middle
    slope = (values[high] - values[low]) / (times[high] - times[low])
    return values[low] + slope * (t - times[low])


def turning_times(history: History) -> Floats:
    """Return the times at which the load begins to fall or to rise again, s."""
    rising = np.sign(np.diff(history.values))
    turned: Floats = history.at[1:-1][rising[1:] != rising[:-1]]
    return turned


def load_history(load: Any) -> History:
    """Return times (s) and values (Pa) of tau_0 from samples (times, values), checked."""
    try:
        times, values = (real_array(part) for part in load)
    except (TypeError, ValueError):
        raise InputError("must be two arrays of numbers, (times, values)") from None
    if times.ndim != 1 or times.shape != values.shape or times.size < 2:
        shapes = f"{times.shape} and {values.shape}"
        raise InputError(f"needs two 1-d arrays, equally long, of two or more; got {shapes}")
    if not (np.all(np.isfinite(times)) and np.all(np.isfinite(values))):
        raise InputError("times and values must be finite")
    if times[0] != 0.0 or np.any(np.diff(times) <= 0.0):
        raise InputError("times must begin at 0 s and increase")
    return History(times, values)


def first_reach(history: History, target: float) -> float:
    """Return when tau_0 first reaches that of the first slip, s; inf if it never does."""
    times, values = history
    if values[0] >= target:
        return 0.0
    above = np.flatnonzero(values >= target)
    last = int(above[0]) if above.size else values.size - 1
    low = last - 1
    slope = (values[last] - values[low]) / (times[last] - times[low])
    return float(times[low] + (target - values[low]) / slope) if slope > 0.0 else np.inf

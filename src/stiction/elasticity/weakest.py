"""The lowest bound that critical windows give, of a line or of blocks, with the proof of it."""

from stiction.base.arrays import Array
from stiction.base.jit import jit, jit_inside
from stiction.elasticity.operator import dot
from stiction.elasticity.protocol import Windows

STRIDES = 16
"""Number of places in the width of a window at which it is tried first."""


@jit_inside
def _window_sum(values: Array, mode: Array, width: int, start: int) -> float:
    """Weighted sum of a field over a window, on the circle."""
    first = min(width, values.shape[0] - start)
    return dot(values[start:], mode, first) + dot(values, mode[first:], width - first)


@jit_inside
def _count_fast(rate: Array, threshold: float, length: Array) -> None:
    """Count the nodes in a row, from each on, that weaken at least as fast as a threshold."""
    n = rate.shape[0]
    run = 0.0
    for q in range(2 * n - 1, -1, -1):
        i = q if q < n else q - n
        run = run + 1.0 if rate[i] >= threshold else 0.0
        length[i] = run


@jit
def weakest_window(
    excess: Array, profile: Array, rate: Array, windows: Windows, bound: float, allowed: Array
) -> tuple[float, int, int]:
    """Return the lowest <s, y>/<p, y> of windows that weaken throughout, Pa, the window, its start.

    It is `bound`, with -1 and 0, if none is below that. Windows that may lie anywhere: a weighted
    mean hardly changes as the window moves by a sixteenth of its width, so only every such place is
    tried, and then the nodes about the best one. Every window found gives a bound. `allowed` (n,)
    is a workspace.
    """
    n = rate.shape[0]
    best, choice, start = bound, -1, 0
    lowest, highest, counted = rate[0], rate[0], -1.0
    uniform = True
    for i in range(n):
        uniform = uniform and profile[i] == profile[0]
        lowest = min(lowest, rate[i])
        highest = max(highest, rate[i])
    for c in range(windows.rates.shape[0]):
        threshold = windows.rates[c]
        if threshold > highest:
            continue
        if c > 0 and threshold < windows.rates[c - 1] <= lowest:
            break  # wider windows are unstable too, but bound less tightly
        width, mode = windows.widths[c], windows.modes[c]
        everywhere = threshold <= lowest
        if not everywhere and threshold != counted:
            _count_fast(rate, threshold, allowed)
            counted = threshold
        first = windows.starts[c]
        if first >= 0:
            if everywhere or allowed[first] >= width:
                above = dot(excess[first:], mode, width)
                below = dot(profile[first:], mode, width)
                if above < best * below:
                    best, choice, start = above / below, c, first
            continue
        low, high, stride = 0, n, max(1, width // STRIDES)
        straight = _window_sum(profile, mode, width, 0) if uniform else 0.0
        while True:
            found = -1
            for a in range(low, high, stride):
                i = a % n
                if everywhere or allowed[i] >= width:
                    above = _window_sum(excess, mode, width, i)
                    below = straight
                    if not uniform or i + width > n:
                        below = _window_sum(profile, mode, width, i)
                    if above < best * below:
                        best = above / below
                        found = i
            if found >= 0:
                choice, start = c, found
            if stride == 1 or found < 0:
                break
            low, high = found - stride + 1 + n, found + stride + n
            stride = 1
    return best, choice, start


@jit
def window_bound(
    excess: Array, profile: Array, rate: Array, windows: Windows, allowed: Array, y: Array
) -> float:
    """Return the lowest bound of windows and of sliding as a whole, Pa, and write its multiplier.

    The multiplier y (n,) has <p, y> = 1.
    """
    n = rate.shape[0]
    above = below = 0.0
    for i in range(n):
        above += excess[i]
        below += profile[i]
    best, choice, start = weakest_window(excess, profile, rate, windows, above / below, allowed)
    for i in range(n):
        y[i] = 1.0 if choice < 0 else 0.0
    if choice >= 0:
        for q in range(windows.widths[choice]):
            i = start + q
            y[i if i < n else i - n] = windows.modes[choice, q]
    weight = 0.0
    for i in range(n):
        weight += y[i] * profile[i]
    for i in range(n):
        y[i] /= weight
    return best

"""The lowest upper bound of the load from critical windows, with its multiplier.

Problem
-------
A window (`protocol.Windows`) is a run of nodes with weights y > 0 for
which K y <= W y if all its nodes weaken at the rate W or faster. Then
<s, y>/<p, y> bounds the load of the first instability from above. Here
s is the strength minus initial stress (Pa), and p is the load profile.
Find the lowest bound over all windows and all places.

Algorithm: our own
------------------
1. Take the windows in turn, from the narrowest to the widest. Skip
   windows that need a higher weakening rate than any node has. Stop if
   a narrower window is unstable anywhere, because wider windows give a
   looser bound.
2. If the rate varies, count for each node how many nodes in a row
   weaken fast enough.
3. A window with a fixed place (on blocks) has a single bound.
   A window that may lie anywhere (on a line) is first tried
   at steps of a sixteenth of its width, because a weighted
   mean hardly changes over this distance. It is then tried at
   all nodes around the best place. The lowest minimum may be
   missed, but every place gives a valid bound.
4. Compare with sliding of the whole interface: y = 1 everywhere.

Example
-------
A window of two nodes with weights (1, 1) may lie anywhere on a line of
four nodes with strengths 3, 1, 2 and 4 Pa. The mean of 1 and 2 is the
lowest bound, and y = 1/2 at these nodes:

>>> import numpy as np
>>> windows = Windows(np.ones(1), np.array([-1]), np.array([2]), np.ones((1, 2)))
>>> y, strength, unit = np.empty(4), np.array([3.0, 1.0, 2.0, 4.0]), np.ones(4)
>>> window_bound(strength, unit, unit, windows, np.empty(4), y), y.tolist()
(1.5, [0.0, 0.5, 0.5, 0.0])
"""

from stiction.base.arrays import Array
from stiction.base.jit import jit, jit_inside
from stiction.elasticity.operator import dot
from stiction.elasticity.protocol import Windows

PLACES_PER_WIDTH = 16
"""Number of first trials within the width of a window."""
NO_WINDOW = -1  # no window gives the bound
NOWHERE = -1  # no place is better


@jit_inside
def _window_sum(values: Array, mode: Array, width: int, start: int) -> float:
    """Return the weighted sum of a field over a window on the circle."""
    first = min(width, values.shape[0] - start)
    return dot(values[start:], mode, first) + dot(values, mode[first:], width - first)


@jit_inside
def _count_fast(W: Array, threshold: float, length: Array) -> None:
    """Step 2: count, from each node on, the consecutive nodes that weaken fast enough."""
    # Twice around the circle from the end, so that runs across the
    # first node are complete.
    n, run = W.shape[0], 0.0
    for q in range(2 * n - 1, -1, -1):
        i = q if q < n else q - n
        run = run + 1.0 if W[i] >= threshold else 0.0
        length[i] = run


@jit
def weakest_window(
    excess: Array, profile: Array, W: Array, windows: Windows, bound: float, allowed: Array
) -> tuple[float, int, int]:
    """Steps 1 to 3: return the lowest bound (Pa), its window, and the first node of the window.

    If no window gives a bound below `bound`, return `bound`,
    `NO_WINDOW` and 0. `allowed` (n,) is a workspace.

    A window of two nodes with the weights 1/4 and 3/4 lies anywhere on six nodes, also
    across the end. The lowest means are (4 + 3 * 1)/4 at node 3, (2 + 3 * 2)/4 at
    node 5 and (2 + 3 * 4)/4 at node 2.

    >>> import numpy as np
    >>> def weakest(windows, W, profile=None, bound=9.0):
    ...     excess, W = np.array([2.0, 9.0, 9.0, 4.0, 1.0, 2.0]), np.array(W, float)
    ...     profile = np.ones(6) if profile is None else np.array(profile)
    ...     return weakest_window(excess, profile, W, windows, bound, np.empty(6))
    >>> def window(rates, starts, widths, modes):
    ...     return Windows(np.array(rates), np.array(starts), np.array(widths), np.array(modes))
    >>> pair = window([1.0], [-1], [2], [[0.25, 0.75]])
    >>> weakest(pair, 6 * [1.0])
    (1.75, 0, 3)
    >>> weakest(pair, 6 * [1.0], bound=1.75), weakest(pair, 6 * [0.9])
    ((1.75, -1, 0), (9.0, -1, 0))

    If a node weakens too slowly, windows that hold it are left out. A profile divides.

    >>> weakest(pair, [1.0, 1.0, 1.0, 1.0, 0.5, 1.0])
    (2.0, 0, 5)
    >>> weakest(pair, [1.0, 1.0, 1.0, 1.0, 0.5, 0.5])
    (5.25, 0, 2)
    >>> bound, _, start = weakest(pair, 6 * [1.0], [4.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    >>> round(bound, 6), start  # 8/4 over 13/4
    (0.615385, 5)

    Windows with fixed places have one mean each. Windows after one that is unstable
    everywhere are not tried, unless they need the same rate.

    >>> fixed = window([2.0, 1.0, 1.0, 0.5], [1, 2, 3, 4], [1, 2, 2, 1], 4 * [[0.5, 0.5]])
    >>> weakest(fixed, 6 * [1.0])
    (2.5, 2, 3)
    >>> pair = window([1.0], [3], [2], [[0.5, 0.5]])
    >>> weakest(pair, [0.5, 0.5, 0.5, 1.0, 1.0, 0.5])
    (2.5, 0, 3)
    >>> weakest(fixed, [1.0, 1.0, 1.0, 0.5, 1.0, 1.0])
    (1.0, 3, 4)

    A window of 32 nodes is tried at every second node, and then around the best place.

    >>> excess = np.abs(np.arange(64.0) - 24.5) + 1.0
    >>> wide = window([1.0], [-1], [32], [32 * [1.0 / 32]])
    >>> ones = np.ones(64)
    >>> weakest_window(excess, ones, ones, wide, 99.0, np.empty(64))[1:]  # 24.5 - 15.5
    (0, 9)
    """
    n = W.shape[0]
    best, window, start = bound, NO_WINDOW, 0
    lowest, highest, counted = W[0], W[0], -1.0
    uniform = True
    for i in range(n):
        uniform = uniform and profile[i] == profile[0]
        lowest = min(lowest, W[i])
        highest = max(highest, W[i])
    for c in range(windows.weakening_rates.shape[0]):
        # 1.
        threshold = windows.weakening_rates[c]
        if threshold > highest:
            continue
        if c > 0 and threshold < windows.weakening_rates[c - 1] <= lowest:
            break
        # 2.
        width, mode = windows.widths[c], windows.modes[c]
        everywhere = threshold <= lowest
        if not everywhere and threshold != counted:
            _count_fast(W, threshold, allowed)
            counted = threshold
        # 3. A fixed place.
        first = windows.starts[c]
        if first >= 0:
            if everywhere or allowed[first] >= width:
                s_y = dot(excess[first:], mode, width)
                p_y = dot(profile[first:], mode, width)
                if s_y < best * p_y:
                    best, window, start = s_y / p_y, c, first
            continue
        # 3. Any place: with a stride, and then around the best place.
        low, high, stride = 0, n, max(1, width // PLACES_PER_WIDTH)
        uniform_p_y = _window_sum(profile, mode, width, 0) if uniform else 0.0
        while True:
            place = NOWHERE
            for a in range(low, high, stride):
                i = a % n
                if everywhere or allowed[i] >= width:
                    s_y = _window_sum(excess, mode, width, i)
                    p_y = uniform_p_y
                    if not uniform or i + width > n:
                        p_y = _window_sum(profile, mode, width, i)
                    if s_y < best * p_y:
                        best = s_y / p_y
                        place = i
            if place != NOWHERE:
                window, start = c, place
            if stride == 1 or place == NOWHERE:
                break
            low, high = place - stride + 1 + n, place + stride + n
            stride = 1
    return best, window, start


@jit
def window_bound(
    excess: Array, profile: Array, W: Array, windows: Windows, allowed: Array, y: Array
) -> float:
    """Return the lowest bound from windows and from sliding as a whole, Pa.

    Write its multiplier.

    The multiplier y (n,) has <p, y> = 1. `allowed` (n,) is a workspace.

    Sliding as a whole gives the mean 3 of strengths 2, 3 and 4 under the load (1, 1, 1), and
    9/6 under (1, 2, 3). A window across the end has 1/2 and 1/2.

    >>> import numpy as np
    >>> excess, one, y = np.array([2.0, 3.0, 4.0]), np.ones(3), np.empty(3)
    >>> single = Windows(np.array([2.0]), np.array([-1]), np.array([2]), np.array([[1.0, 1.0]]))
    >>> window_bound(excess, one, one, single, np.empty(3), y), (3 * y).round(9).tolist()
    (3.0, [1.0, 1.0, 1.0])
    >>> window_bound(excess, np.array([1.0, 2.0, 3.0]), one, single, np.empty(3), y)
    1.5
    >>> (6 * y).round(9).tolist()
    [1.0, 1.0, 1.0]
    >>> window_bound(np.array([1.0, 9.0, 2.0]), one, 2.0 * one, single, np.empty(3), y), y.tolist()
    (1.5, [0.5, 0.0, 0.5])

    The second window has weights of its own, and needs a lower rate.

    >>> rates, modes = np.array([2.0, 1.0]), np.array([[1.0, 0.0], [0.25, 0.75]])
    >>> two = Windows(rates, np.array([-1, -1]), np.array([1, 2]), modes)
    >>> window_bound(np.array([8.0, 1.0, 9.0]), one, one, two, np.empty(3), y), y.tolist()
    (2.75, [0.25, 0.75, 0.0])
    """
    n = W.shape[0]
    # 4.
    total_s = total_p = 0.0
    for i in range(n):
        total_s += excess[i]
        total_p += profile[i]
    bound = total_s / total_p
    best, window, start = weakest_window(excess, profile, W, windows, bound, allowed)
    for i in range(n):
        y[i] = 1.0 if window == NO_WINDOW else 0.0
    if window != NO_WINDOW:
        for q in range(windows.widths[window]):
            i = start + q
            y[i if i < n else i - n] = windows.modes[window, q]
    p_y = 0.0
    for i in range(n):
        p_y += y[i] * profile[i]
    # Scale y, so that <s, y> alone is the bound.
    for i in range(n):
        y[i] /= p_y
    return best

"""The discrete local criterion: the lowest window that is unstable by itself bounds the onset.

A window of w nodes is unstable if the smallest eigenvalue of its block of K is at most the
weakening rate in it. The eigenvector y is positive, A y <= 0, so <s, y>/<p, y> bounds the critical
load from above: the criterion of Uenishi and Rice (2003) in the form that is strict on the grid.
"""

import bisect
import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit, jit_inside
from stiction.elasticity.line import stiffness_column
from stiction.elasticity.linear import dot
from stiction.methods.equilibrium.sample import StaticSample
from stiction.problem.friction.parameters import SMALLEST_EIGENVALUE

GROWTH = 1.25
"""Ratio of successive widths tried where the weakening rate varies."""
DENSE = 300
"""Widest window whose eigenvector is found with a dense matrix."""
WIDEST = 4096
"""Widest window tried."""
STRIDES = 16
"""Number of places in the width of a window at which it is tried first."""


@functools.lru_cache(maxsize=512)
def window_mode(nodes: int, width: int) -> tuple[float, Array]:
    """Smallest eigenvalue of a block of K with (G*/2)(2 pi/L) = 1, and its positive eigenvector."""
    first = stiffness_column(nodes, np.pi, 1.0)[:width]
    if width <= DENSE:
        values, vectors = scipy.linalg.eigh(
            scipy.linalg.toeplitz(first), subset_by_index=[0, 0]
        )
        value, mode = float(values[0]), np.abs(vectors[:, 0])
        mode /= mode.sum()
    else:
        # Inverse iteration; the next eigenvalue is more than twice as large.
        mode = np.sqrt(np.arange(1.0, width + 1.0) * np.arange(width, 0.0, -1.0))
        mode /= mode.sum()
        for _ in range(60):
            new = scipy.linalg.solve_toeplitz(first, mode)
            value = 1.0 / float(new.sum())
            new *= value
            change = float(np.abs(new - mode).max())
            mode = new
            if change < 1e-14 * float(mode.max()):
                break
    mode.flags.writeable = False
    return value, mode


def estimated_width(nodes: int, rate: float) -> int:
    """Width of an unstable window by h_n = 2 lambda_0 G*/W of the continuum.

    The rate is W in units of (G*/2)(2 pi/L), so that h_n/L = 2 lambda_0/(pi rate).
    """
    return int(np.clip(2.0 * SMALLEST_EIGENVALUE / (np.pi * rate) * nodes, 1, nodes))


def narrowest(nodes: int, widths: Sequence[int], guess: int, rate: float) -> int:
    """Index of the first of rising widths that is unstable, their number if none is."""
    i = min(guess, len(widths) - 1)
    while i < len(widths) and window_mode(nodes, widths[i])[0] > rate:
        i += 1
    while i > 0 and window_mode(nodes, widths[i - 1])[0] <= rate:
        i -= 1
    return i


def smallest_window(nodes: int, rate: float) -> int | None:
    """Fewest nodes that are unstable by themselves at a weakening rate; None beyond `WIDEST`."""
    widest = min(nodes - 1, WIDEST)
    width = estimated_width(nodes, rate)
    if width > 1.2 * widest:
        return None
    # The estimate is a node or so off, more where the window is a fair part of the circle.
    width = narrowest(nodes, range(1, widest + 1), width - 1, rate) + 1
    return width if width <= widest else None


def ladder(nodes: int) -> list[int]:
    """Widths tried where the weakening rate varies: the same for all samples."""
    widths = [1]
    while widths[-1] < min(nodes // 2, WIDEST):
        widths.append(max(widths[-1] + 1, int(widths[-1] * GROWTH)))
    return widths[:-1]


class Windows(NamedTuple):
    """Unstable windows, the narrowest first.

    Attributes
    ----------
    thresholds : (count,) array
        Weakening rate above which each is unstable, Pa/m, falling.
    widths : (count,) int array
    modes : (count or 1, largest width) array
        Eigenvectors of unit sum, zero beyond their width.
    """

    thresholds: Array
    widths: NDArray[np.int64]
    modes: Array


@functools.lru_cache(maxsize=64)
def _windows(nodes: int, widths: tuple[int, ...], unit: float) -> Windows:
    modes = np.zeros((max(len(widths), 1), max(widths, default=1)))
    for i, width in enumerate(widths):
        modes[i, :width] = window_mode(nodes, width)[1]
    thresholds = np.array([window_mode(nodes, width)[0] * unit for width in widths])
    return Windows(thresholds, np.array(widths, dtype=np.int64), modes)


def exact_window(nodes: int, rate: float, unit: float) -> Windows:
    """The narrowest window that is unstable at one weakening rate, if there is any.

    Rate (NaN if there is none) and unit are W and (G*/2)(2 pi/L), Pa/m.
    """
    width = None if np.isnan(rate) else smallest_window(nodes, rate / unit)
    return _windows(nodes, () if width is None else (width,), unit)


def windows_between(nodes: int, lowest: float, highest: float, unit: float) -> Windows:
    """Rungs of the ladder for weakening rates from `lowest` to `highest`, Pa/m."""
    rungs = ladder(nodes)

    def rung(rate: float) -> int:
        guess = bisect.bisect_left(rungs, estimated_width(nodes, rate / unit))
        return narrowest(nodes, rungs, guess, rate / unit)

    return _windows(nodes, tuple(rungs[rung(highest) : rung(lowest) + 1]), unit)


@jit_inside
def _window_sum(values: Array, mode: Array, width: int, start: int) -> float:
    """Weighted sum of a field over a window on the circle."""
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
def window_bound(
    sample: StaticSample, windows: Windows, allowed: Array, multiplier: Array
) -> float:
    """Lowest bound over the windows and the uniform field, Pa, and its multiplier.

    A weighted mean over a window hardly changes as the window moves by a sixteenth of its width:
    only every such place is tried, and then the nodes about the best one. Every window found
    gives a bound. `allowed` is a workspace.
    """
    rate = sample.rate
    n = rate.shape[0]
    start = 0
    choice = -1
    above = 0.0
    below = 0.0
    lowest = rate[0]
    highest = rate[0]
    uniform = True
    for i in range(n):
        uniform = uniform and sample.profile[i] == sample.profile[0]
        above += sample.excess[i]
        below += sample.profile[i]
        lowest = min(lowest, rate[i])
        highest = max(highest, rate[i])
    best = above / below
    for c in range(windows.thresholds.shape[0]):
        threshold = windows.thresholds[c]
        if threshold > highest:
            continue
        width = windows.widths[c]
        mode = windows.modes[c]
        straight = _window_sum(sample.profile, mode, width, 0)
        everywhere = threshold <= lowest
        if not everywhere:
            _count_fast(rate, threshold, allowed)
        stride = max(1, width // STRIDES)
        low, high = 0, n
        while True:
            found = -1
            for a in range(low, high, stride):
                i = a % n
                if everywhere or allowed[i] >= width:
                    above = _window_sum(sample.excess, mode, width, i)
                    below = straight
                    if not uniform or i + width > n:
                        below = _window_sum(sample.profile, mode, width, i)
                    if above < best * below:
                        best = above / below
                        found = i
            if found >= 0:
                start = found
                choice = c
            if stride == 1 or found < 0:
                break
            low, high = found - stride + 1 + n, found + stride + n
            stride = 1
        if everywhere:
            break  # wider windows are unstable too, but bound less tightly
    for i in range(n):
        multiplier[i] = 1.0 if choice < 0 else 0.0
    if choice >= 0:
        for q in range(windows.widths[choice]):
            i = start + q
            multiplier[i if i < n else i - n] = windows.modes[choice, q]
    weight = 0.0
    for i in range(n):
        weight += multiplier[i] * sample.profile[i]
    for i in range(n):
        multiplier[i] /= weight
    return best

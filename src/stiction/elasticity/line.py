"""Half-spaces that meet on a line: K at the nodes in closed form, and critical windows.

Problem
-------
K is the circulant matrix of the symbol (G*/2)|k|, with modulus G* (Pa)
and period L (m). Summing its Fourier series gives, for an even number n
of nodes, the first column

    K_0 = (G*/2)(2 pi/L) n/4,   K_j = -(G*/2)(2 pi/L)/(n sin^2(pi j/n)) for odd j,  (1)

and K_j = 0 for even j > 0. Even nodes act only on odd nodes and vice
versa, which halves the cost of products. In a window, a run of nodes,
the smallest eigenvalue of K is at most the weakening rate W. If all
other nodes are held, the window is unstable. Its eigenvector bounds the
load of the first instability (`protocol.Windows`), and the narrowest
window gives the closest bound.

Algorithm
---------
1. Find the widths for rates between two values (`widths_between`). At
   one rate W, start from the width in the continuum, h_n = 2 lambda_0
   G*/W (K. Uenishi and J. R. Rice, J. Geophys. Res. 108, 2003), and
   move to the narrowest unstable width. If rates vary, use a ladder of
   widths.
2. Compute the smallest eigenvalue and its eigenvector for each width
   (`window_mode`), with a dense matrix up to `MAX_DENSE_WIDTH` nodes,
   and above by inverse iteration with a solver for Toeplitz matrices.
   The results are cached, because all samples use them.
"""

import bisect
import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from stiction.base.arrays import Array
from stiction.elasticity.protocol import (
    ANYWHERE,
    SMALLEST_EIGENVALUE,
    CircularEntries,
    HalfSpaces,
    Windows,
)

WIDTH_RATIO = 1.25
"""Ratio of successive widths if the rate varies, and bounds are rough
anyway."""
MAX_DENSE_WIDTH = 300
"""Nodes of the widest window for which a dense matrix is faster than
inverse iteration."""
MAX_WIDTH = 4096
"""Nodes of the widest window. The eigenvector of a wider window takes
longer than it saves."""
MAX_INVERSE_ITERATIONS = 60
"""Number of iterations, each of which more than halves the error, until
a double gains no digit."""
MODE_RTOL = 1e-14
"""Change of an eigenvector in an iteration, relative to its largest
entry, that is round-off."""


def stiffness_column(nodes: int, length: float, modulus: float) -> Array:
    """Return the first column of K, Pa/m, with shape (nodes,), for a period (m) and G* (Pa).

    The node count is even.

    The unit pi G*/L is 2 here:

    >>> stiffness_column(4, np.pi, 2.0).round(9).tolist()
    [2.0, -1.0, 0.0, -1.0]
    >>> symbol = HalfSpaces((0.4,), (3.0,)).symbol((12,))
    >>> np.allclose(stiffness_column(12, 0.4, 3.0), np.fft.irfft(symbol, 12))
    True
    """
    scale = np.pi * modulus / length
    column = np.zeros(nodes)
    odd = np.arange(1, nodes, 2)
    column[odd] = -scale / (nodes * np.sin(np.pi * np.minimum(odd, nodes - odd) / nodes) ** 2)
    # Equal to scale * nodes / 4 up to round-off, so that uniform slip
    # is exactly free of stress.
    column[0] = -column[odd].sum()
    return column


@dataclass(frozen=True, eq=False)
class Line:
    """Half-spaces that meet on a line of nodes, as a read-only `Elasticity`."""

    half_spaces: HalfSpaces
    nodes: int
    entries: CircularEntries
    relief: float = 0.0
    positive: float = 0.0

    def block(self, nodes: Array) -> Array:
        """Return K between some nodes, Pa/m.

        >>> line_of(HalfSpaces((np.pi,), (2.0,)), 4).block(np.array([0, 1, 3])).round(9).tolist()
        [[2.0, -1.0, -1.0], [-1.0, 2.0, 0.0], [-1.0, 0.0, 2.0]]
        """
        return self.entries.column[np.abs(np.subtract.outer(nodes, nodes))]

    def windows(self, low: float, high: float) -> Windows:
        """Return the windows for weakening rates from `low` to `high`, Pa/m, narrowest first.

        With the unit 4 Pa/m, a single node is unstable at 4 * 16/4 Pa/m, and two nodes at
        less:

        >>> line = line_of(HalfSpaces((np.pi,), (4.0,)), 16)
        >>> windows = line.windows(16.5, 16.5)
        >>> [part.round(9).tolist() for part in windows]
        [[16.0], [-1], [1], [[1.0]]]
        >>> windows = line.windows(10.0, 17.0)
        >>> windows.widths.tolist(), windows.modes.round(9).tolist()
        ([1, 2], [[1.0, 0.0], [0.5, 0.5]])
        >>> np.allclose(windows.weakening_rates[1], 16.0 + line.entries.column[1])
        True
        """
        (length,), (modulus,) = self.half_spaces
        unit = np.pi * modulus / length
        return _windows(self.nodes, widths_between(self.nodes, low / unit, high / unit), unit)


@functools.lru_cache(maxsize=4)
def line_of(half_spaces: HalfSpaces, nodes: int) -> Line:
    """Return K and the windows of a line.

    >>> line_of(HalfSpaces((np.pi,), (2.0,)), 4).entries.strip.round(9).tolist()
    [-1.0, -1.0, -1.0, -1.0, -1.0, -1.0]
    """
    column = stiffness_column(nodes, half_spaces.lengths[0], half_spaces.moduli[0])
    return Line(half_spaces, nodes, CircularEntries(column, np.tile(column[1::2], 3)))


@functools.lru_cache(maxsize=512)
def window_mode(nodes: int, width: int) -> tuple[float, Array]:
    """Step 2: return the smallest eigenvalue and eigenvector of a block in K.

    The unit of K is (G*/2)(2 pi/L). The
    eigenvector is positive, with unit sum.

    Two nodes move alike. A wide window uses inverse iteration, and its mode
    y has K y = W y, close to the continuum with W = 2 lambda_0 n/(pi w).

    >>> value, mode = window_mode(16, 2)
    >>> column = stiffness_column(16, np.pi, 1.0)
    >>> mode.round(9).tolist(), round(value, 9) == round(float(column[0] + column[1]), 9)
    ([0.5, 0.5], True)
    >>> value, mode = window_mode(1024, 301)
    >>> block = scipy.linalg.toeplitz(stiffness_column(1024, np.pi, 1.0)[:301])
    >>> bool(np.abs(block @ mode - value * mode).max() < 1e-9 * mode.max())
    True
    >>> continuum = 2.0 * SMALLEST_EIGENVALUE / np.pi * 1024 / 301
    >>> round(float(mode.sum()), 9), round(value / continuum, 1)
    (1.0, 1.0)
    """
    column = stiffness_column(nodes, np.pi, 1.0)[:width]
    if width <= MAX_DENSE_WIDTH:
        block = scipy.linalg.toeplitz(column)
        values, vectors = scipy.linalg.eigh(block, subset_by_index=[0, 0])
        value, mode = float(values[0]), np.abs(vectors[:, 0])
        mode /= mode.sum()
    else:
        # Start from sqrt(x (w - x)), the shape of slip in a crack under
        # uniform stress. Inverse iteration converges fast, as the next
        # eigenvalue is more than twice as large.
        mode = np.sqrt(np.arange(1.0, width + 1.0) * np.arange(width, 0.0, -1.0))
        mode /= mode.sum()
        for _ in range(MAX_INVERSE_ITERATIONS):
            next_mode = scipy.linalg.solve_toeplitz(column, mode)
            value = 1.0 / float(next_mode.sum())
            next_mode *= value
            change = float(np.abs(next_mode - mode).max())
            mode = next_mode
            if change < MODE_RTOL * float(mode.max()):
                break
    mode.flags.writeable = False
    return value, mode


def _narrowest(nodes: int, widths: Sequence[int], W: float) -> int:
    """Step 1: return the index of the first unstable width, or the number of widths.

    >>> widths = (1, 2, 3, 5, 8, 13)
    >>> rates = [window_mode(32, width)[0] for width in widths]
    >>> [_narrowest(32, widths, rate) for rate in rates]  # the rate itself is unstable
    [0, 1, 2, 3, 4, 5]
    >>> [_narrowest(32, widths, 0.999 * rate) for rate in rates]
    [1, 2, 3, 4, 5, 6]
    """
    # The width in the continuum is off by about a node, or more on a
    # large part of the circle.
    i = min(bisect.bisect_left(widths, _continuous_width(nodes, W)), len(widths) - 1)
    while i < len(widths) and window_mode(nodes, widths[i])[0] > W:
        i += 1
    while i > 0 and window_mode(nodes, widths[i - 1])[0] <= W:
        i -= 1
    return i


def _continuous_width(nodes: int, weakening_rate: float) -> int:
    """Return the node count in h_n = 2 lambda_0 G*/W, for W in units of (G*/2)(2 pi/L).

    >>> _continuous_width(100, 1.0), _continuous_width(100, 0.5), _continuous_width(100, 0.1)
    (36, 73, 100)
    """
    return int(min(2.0 * SMALLEST_EIGENVALUE / (np.pi * weakening_rate), 1.0) * nodes)


@functools.lru_cache(maxsize=64)
def widths_between(nodes: int, lowest: float, highest: float) -> tuple[int, ...]:
    """Step 1: return the widths for weakening rates from `lowest` to `highest`.

    The last width is the first that is unstable at `lowest`. For a
    single rate there is a single width, or no width if it would be much
    larger than `MAX_WIDTH`. Otherwise the widths come from a ladder,
    which is the same for all samples.

    A single rate has the narrowest unstable width. Otherwise the ladder 1, 2, ...
    8, 10, 12, 15, ... is used, up to the first width that is unstable at the lowest rate.

    >>> [width] = widths_between(64, 1.5, 1.5)
    >>> window_mode(64, width)[0] <= 1.5 < window_mode(64, width - 1)[0]
    True
    >>> widths_between(64, 1.5, 4.0)
    (6, 7, 8, 10, 12, 15)
    >>> window_mode(64, 12)[0] > 1.5 >= window_mode(64, 15)[0]
    True
    >>> window_mode(64, 5)[0] > 4.0 >= window_mode(64, 6)[0]
    True
    >>> widths_between(16, 0.01, 4.1)  # less than half of the circle
    (1, 2, 3, 4, 5, 6, 7)
    >>> widths_between(10_000, 0.1, 0.1)  # 10,000 nodes and more
    ()
    """
    widest = min(nodes - 1, MAX_WIDTH)
    widths: Sequence[int] = range(1, widest + 1)
    if lowest < highest:
        # A ladder is the same for all samples, so that its eigenvectors
        # are computed once.
        ladder = [1]
        while ladder[-1] < min(nodes // 2, MAX_WIDTH):
            ladder.append(max(ladder[-1] + 1, int(ladder[-1] * WIDTH_RATIO)))
        widths = ladder[:-1]
    elif _continuous_width(nodes, highest) > 1.2 * widest:
        return ()
    first, last = _narrowest(nodes, widths, highest), _narrowest(nodes, widths, lowest)
    return tuple(widths[first : last + 1])


@functools.lru_cache(maxsize=64)
def _windows(nodes: int, widths: tuple[int, ...], unit: float) -> Windows:
    modes = np.zeros((max(len(widths), 1), max(widths, default=1)))
    for i, width in enumerate(widths):
        modes[i, :width] = window_mode(nodes, width)[1]
    weakening_rates = np.array([window_mode(nodes, width)[0] * unit for width in widths])
    anywhere = np.full(len(widths), ANYWHERE, dtype=np.int64)
    return Windows(weakening_rates, anywhere, np.array(widths, dtype=np.int64), modes)

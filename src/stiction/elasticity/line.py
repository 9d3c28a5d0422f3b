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
        """Return K between some nodes, Pa/m."""
        return self.entries.column[np.abs(np.subtract.outer(nodes, nodes))]

    def windows(self, low: float, high: float) -> Windows:
        """Return the windows for weakening rates from `low` to `high`, Pa/m, narrowest first."""
        (length,), (modulus,) = self.half_spaces
        unit = np.pi * modulus / length
        return _windows(self.nodes, widths_between(self.nodes, low / unit, high / unit), unit)


@functools.lru_cache(maxsize=4)
def line_of(half_spaces: HalfSpaces, nodes: int) -> Line:
    """Return K and the windows of a line."""
    column = stiffness_column(nodes, half_spaces.lengths[0], half_spaces.moduli[0])
    return Line(half_spaces, nodes, CircularEntries(column, np.tile(column[1::2], 3)))


@functools.lru_cache(maxsize=512)
def window_mode(nodes: int, width: int) -> tuple[float, Array]:
    """Step 2: return the smallest eigenvalue and eigenvector of a block in K.

    The unit of K is (G*/2)(2 pi/L). The
    eigenvector is positive, with unit sum.
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
    """Step 1: return the index of the first unstable width, or the number of widths."""
    # The width in the continuum is off by about a node, or more on a
    # large part of the circle.
    i = min(bisect.bisect_left(widths, _continuous_width(nodes, W)), len(widths) - 1)
    while i < len(widths) and window_mode(nodes, widths[i])[0] > W:
        i += 1
    while i > 0 and window_mode(nodes, widths[i - 1])[0] <= W:
        i -= 1
    return i


def _continuous_width(nodes: int, weakening_rate: float) -> int:
    """Return the node count in h_n = 2 lambda_0 G*/W, for W in units of (G*/2)(2 pi/L)."""
    return int(min(2.0 * SMALLEST_EIGENVALUE / (np.pi * weakening_rate), 1.0) * nodes)


@functools.lru_cache(maxsize=64)
def widths_between(nodes: int, lowest: float, highest: float) -> tuple[int, ...]:
    """Step 1: return the widths for weakening rates from `lowest` to `highest`.

    The last width is the first that is unstable at `lowest`. For a
    single rate there is a single width, or no width if it would be much
    larger than `MAX_WIDTH`. Otherwise the widths come from a ladder,
    which is the same for all samples.
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

"""The elasticity of the solids on both sides of an interface, as methods need it.

`Line` (half-spaces that meet on a line) and `Driven` (two blocks and
their machine) are complete. `HalfSpaces` on a plane provide only the
symbol of K, because K would not fit in memory, and slip does not
relieve the load. This file defines records. The kernels for these
records are in `stiffness` and `weakest`.

Slip has one component, along x, the direction of the load. For a wave
vector (kx, ky) with length k and a = (kx/k)^2, the stiffness between
half-spaces is

    K(k) = (G* a + G (1 - a)) k/2,

with mode II along x and mode III along y (P. Geubelle and J. Rice,
Journal of the Mechanics and Physics of Solids 43, 1995). A line has the
modulus of its mode.
"""

import functools
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array

ANYWHERE = -1
"""First node of a window that may begin anywhere on a periodic interface."""
SMALLEST_EIGENVALUE = 0.5788869418506
"""lambda_0 in the nucleation length h_n = 2 lambda_0 G*/W (Uenishi and
Rice, 2003)."""


class HalfSpaces(NamedTuple):
    """Half-spaces, described by periods (m) and moduli (Pa) along each direction.

    A line has the modulus G* of its mode, and a plane the moduli G* and G.
    """

    lengths: tuple[float, ...]
    moduli: tuple[float, ...]

    def symbol(self, shape: tuple[int, ...]) -> Array:
        """Return K(k), Pa/m, for the modes of an interface as in ``numpy.fft.rfftn``; read-only.

        On a line, K(k) is G* k/2. On a plane, wave vectors (2, 0), (0, 4) and (2, 4)
        per m have 3 * 2/2, 1 * 4/2 and (3/5 * 1 + 4/5) sqrt(20)/2:

        >>> HalfSpaces((np.pi,), (3.0,)).symbol((4,)).round(9).tolist()
        [0.0, 3.0, 6.0]
        >>> symbol = HalfSpaces((np.pi, 0.5 * np.pi), (3.0, 1.0)).symbol((4, 6))
        >>> symbol.shape, symbol[[0, 1, 3, 0, 1], [0, 0, 0, 1, 1]].round(4).tolist()
        ((4, 4), [0.0, 3.0, 3.0, 2.0, 3.1305])
        """
        return _symbol(self, shape)

    def nucleation_lengths(self, weakening_rate: float) -> tuple[float, ...]:
        """Return h_n, m, in each direction, for a weakening rate (Pa/m).

        >>> HalfSpaces((1.0, 2.0), (3.0, 5.0)).nucleation_lengths(2.0)  # 0.57889 * 3 and 5
        (1.7366608255518, 2.894434709253)
        """
        double = 2.0 * SMALLEST_EIGENVALUE
        return tuple(double * modulus / weakening_rate for modulus in self.moduli)


@functools.lru_cache(maxsize=16)
def _symbol(half_spaces: HalfSpaces, shape: tuple[int, ...]) -> Array:
    lengths, moduli = half_spaces
    last = 2.0 * np.pi / lengths[-1] * np.arange(shape[-1] // 2 + 1)
    if len(shape) == 1:
        symbol: Array = 0.5 * moduli[0] * last
    else:
        first = 2.0 * np.pi * np.fft.fftfreq(shape[0], lengths[0] / shape[0])[:, None]
        k = np.hypot(first, last[None, :])
        k[0, 0] = 1.0  # both terms are zero there
        symbol = 0.5 * (moduli[0] * first**2 + moduli[1] * last**2) / k
    symbol.flags.writeable = False
    return symbol


class Windows(NamedTuple):
    """Runs of nodes that are just unstable in isolation.

    On a run, the smallest eigenvalue of the block of K is at
    most the weakening rate W. If K has no positive off-diagonal
    entry, the eigenvector y is positive, and K y <= W y.
    Therefore <s, y>/<p, y> bounds the load of the first
    instability from above. Here s is the strength minus initial
    stress, and p is the load profile. This is the criterion of
    Uenishi and Rice (2003) in a form that is strict on the grid.
    """

    weakening_rates: Array  # (count,): smallest that is unstable, Pa/m, never rising
    starts: NDArray[np.int64]  # (count,): first node, or `ANYWHERE`
    widths: NDArray[np.int64]  # (count,): number of nodes
    modes: Array  # (count or 1, largest width): eigenvectors of unit sum, zero beyond it


_NO_NODES = np.empty(0, dtype=np.int64)
NONE = Windows(np.empty(0), _NO_NODES, _NO_NODES, np.empty((1, 1)))


class CircularEntries(NamedTuple):
    """K of a periodic line, Pa/m: the first column (n,), and the odd entries three times in a row.

    With the repeated entries, products need no index arithmetic.
    """

    column: Array
    strip: Array


class DenseEntries(NamedTuple):
    """K of two blocks, row by row in a flat array, and the relief by slip.

    Slip d lowers the mean stress by relief <q, d>/n. `relief` is in
    Pa/m, and 0 under a dead load.
    """

    rows: Array
    n_nodes: int
    relief: float


class Elasticity(Protocol):
    """Protocol for the elasticity of two solids that meet at nodes."""

    @property
    def entries(self) -> Any:
        """K in the form that kernels need: `CircularEntries` or `DenseEntries`."""

    @property
    def half_spaces(self) -> HalfSpaces | None:
        """The half-spaces, which give the symbol of K, or `None` for blocks."""

    @property
    def relief(self) -> float:
        """Relief h of the load per mean of p d, Pa/m, or 0 without a machine."""

    @property
    def positive(self) -> float:
        """Largest positive off-diagonal entry in K, as a fraction of the diagonal.

        If it is not zero, slip at one node can stop slip at other nodes.
        """

    def block(self, nodes: NDArray[np.int64]) -> Array:
        """Return K between some nodes, Pa/m."""

    def windows(self, low: float, high: float) -> Windows:
        """Return the windows for weakening rates from `low` to `high`, Pa/m.

        For a single rate the windows are exact. Otherwise they give a
        bound, and are the same for all samples.
        """

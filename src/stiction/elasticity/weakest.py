"""The weakest of the critical windows of a specimen."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit
from stiction.elasticity.linear import dot


class Places(NamedTuple):
    """The shortest unstable runs of nodes, from left to right.

    Attributes
    ----------
    rate : float
        Weakening rate at which they are unstable, Pa/m.
    starts, widths : (count,) int arrays
    modes : (count, widest) array
        Eigenvectors of unit sum, not negative, zero beyond the width.
    """

    rate: float
    starts: NDArray[np.int64]
    widths: NDArray[np.int64]
    modes: Array


@jit
def weakest_place(
    excess: Array, profile: Array, rate: Array, places: Places, allowed: Array
) -> tuple[float, int]:
    """Return the lowest <s, y>/<q, y> of the runs that weaken throughout, Pa, and which it is.

    It is infinite, and -1, without one; `allowed` (n,) is a workspace.
    """
    n = excess.shape[0]
    run = 0.0
    for i in range(n - 1, -1, -1):
        run = run + 1.0 if rate[i] >= places.rate else 0.0
        allowed[i] = run
    best = np.inf
    choice = -1
    for c in range(places.starts.shape[0]):
        first, width = places.starts[c], places.widths[c]
        if allowed[first] >= width:
            mode = places.modes[c]
            load = dot(excess[first:], mode, width) / dot(profile[first:], mode, width)
            if load < best:
                best = load
                choice = c
    return best, choice

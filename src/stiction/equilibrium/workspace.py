"""What the kernels pass around: one sample, the grid, and a workspace."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.equilibrium.cholesky import row_start
from stiction.equilibrium.pieces import Pieces
from stiction.jit import jit

FLAT = 1e-11
"""Share of the mean strength by which it must fall to count as weakening. Less cannot be told from
the round-off of K d; an instability of such nodes would be one of nothing, and never end."""


class Sample(NamedTuple):
    """One strength profile; all arrays of shape (n,).

    Stress is counted from the initial one: `excess` is the strength excess tau_p - tau_i and
    `residual` is tau_r - tau_i (Pa). `profile` is the load profile, `rate` the weakening rate W at
    zero slip (Pa/m), and `critical` the slip d_c (m) at which the strength is residual. Nodes of
    constant strength have both 0. `pieces` are those of the friction law.
    """

    excess: Array
    residual: Array
    profile: Array
    rate: Array
    critical: Array
    pieces: Pieces


@jit
def make_sample(
    excess: Array, residual: Array, profile: Array, rate: Array, pieces: Pieces
) -> Sample:
    """A sample in which nodes whose strength is residual, but for round-off, do not weaken."""
    n = excess.shape[0]
    scale = 0.0
    for i in range(n):
        scale += max(abs(excess[i]), abs(residual[i]))
    critical = np.empty(n)
    moving = rate.copy()
    residual = residual.copy()
    for i in range(n):
        if excess[i] - residual[i] <= FLAT * scale / n:
            residual[i] = excess[i]
            moving[i] = 0.0
            critical[i] = 0.0
        else:
            critical[i] = pieces.first * (excess[i] - residual[i]) / rate[i]
    return Sample(excess, residual, profile, moving, critical, pieces)


class Grid(NamedTuple):
    """The stiffness: its first column (n,) and the strip of `coupling_strip`, Pa/m."""

    column: Array
    strip: Array


class Workspace(NamedTuple):
    """Work space for one sample at a time.

    `members[:size]` are the slipping nodes in the order of the rows of `factor`, `inside` marks
    them; `forward` holds the forward substitutions of the load profile and of the strength.
    """

    factor: Array
    members: NDArray[np.int64]
    order: NDArray[np.int64]
    inside: NDArray[np.bool_]
    diagonal: Array
    forward: Array
    vectors: Array
    halves: Array


MOST_MEMBERS = 8192
"""Slipping nodes for which a dense factor has space (268 MB if all of it is used)."""


@jit
def make_workspace(n: int) -> Workspace:
    """Workspace for samples of n nodes. Pages of the factor that are never used cost no memory."""
    capacity = min(n, MOST_MEMBERS)
    return Workspace(
        np.empty(row_start(capacity + 4)),
        np.empty(n + 4, np.int64),
        np.empty(n, np.int64),
        np.empty(n, np.bool_),
        np.empty(n),
        np.empty((2, n + 4)),
        np.empty((4, n + 4)),
        np.empty((2, n // 2)),
    )

"""On large grids: the jump of a patch with everything outside a window held fixed.

Slip outside only helps, so that this too is a lower bound: if the patch runs away in its window,
the interface slides, and if it comes to rest, the jump of the whole starts from there. It spares
most work with the elastic factor of all slipping nodes of a long interface.
"""

from __future__ import annotations

import numpy as np
import scipy.fft

from stiction.arrays import Array
from stiction.elasticity.line_stiffness import coupling_strip
from stiction.equilibrium.instability_jump import SLIDING, jump
from stiction.equilibrium.patches import main_patch
from stiction.equilibrium.workspace import Grid, Sample, make_workspace

WINDOW = 1024
"""Nodes of the window."""
OUT_OF_REACH = 50.0
"""Strength of what must not slip, as a multiple of the largest strength."""


def circle_of(column: Array, window: int) -> Grid:
    """Stiffness of a window of a longer interface, on a circle of twice its length.

    Nodes of the far half must not slip: only then are distances on the circle the true ones.
    """
    small = np.zeros(2 * window)
    small[:window] = column[:window]
    small[window + 1 :] = small[window - 1 : 0 : -1]
    return Grid(small, coupling_strip(small))


def padded(values: Array, fill: float) -> Array:
    """Values of the window, followed by as many for the far half of the circle."""
    return np.concatenate((values, np.full(values.shape[0], fill)))


def runs_away_frozen(
    grid: Grid,
    sample: Sample,
    load: float,
    slip: Array,
    direction: Array,
    griffith: float,
    steps: int,
) -> bool:
    """Whether the unstable patch slides even if nothing outside its window moves.

    If not, slip is left where the window comes to rest, not above the next equilibrium.

    Parameters
    ----------
    grid, sample : Grid, Sample
    load : float
        tau_0, Pa.
    slip : (n,) array, changed
        A lower bound of the next equilibrium, beyond the state that is unstable in `direction`.
    griffith, steps : float, int
        As for `jump`.

    Returns
    -------
    bool
        False also where the grid is not large.
    """
    n = slip.shape[0]
    if n < 4 * WINDOW:
        return False
    first, length, _ = main_patch(direction)
    nodes = (first + length // 2 - WINDOW // 2 + np.arange(WINDOW)) % n
    small = circle_of(grid.column, WINDOW)
    local = padded(slip[nodes], 0.0)
    stiff = _product(small.column, local)
    # Stress that the slip outside takes off the window, counted as strength.
    outside = _product(grid.column, slip)[nodes] - stiff[:WINDOW]
    beyond = OUT_OF_REACH * float(np.abs(sample.excess).max())
    part = Sample(
        padded(sample.excess[nodes] + outside, beyond),
        padded(sample.residual[nodes] + outside, beyond),
        padded(sample.profile[nodes], 1e-9 * float(sample.profile.mean())),
        padded(sample.rate[nodes], 1.0),
        padded(sample.critical[nodes], np.inf),
        sample.pieces,
    )
    outcome = jump(part, small, load, local, stiff, griffith, steps, make_workspace(2 * WINDOW))
    slip[nodes] = np.maximum(slip[nodes], local[:WINDOW])
    return bool(outcome == SLIDING)


def _product(column: Array, field: Array) -> Array:
    spectrum = scipy.fft.rfft(column) * scipy.fft.rfft(field)
    product: Array = scipy.fft.irfft(spectrum, field.shape[0])
    return product

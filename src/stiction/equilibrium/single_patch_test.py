"""A quick test: does the unstable patch run away along the interface, all others held fixed?

A lower bound of what happens: if the patch alone, growing as one run of nodes, reaches a length at
which no fracture energy can stop it, the whole interface slides. Each step solves the elastic
problem of the run with frozen strengths; the blocks of K being Toeplitz, one Cholesky factor serves
the runs of every sample.
"""

from __future__ import annotations

import numpy as np

from stiction.arrays import Array
from stiction.equilibrium.cholesky import back_substitute, row_start, substitute
from stiction.equilibrium.instability_jump import (
    SLIDING,
    UNDECIDED,
    step_to_corner,
    strength_at,
    unsupported,
)
from stiction.equilibrium.patches import main_patch
from stiction.equilibrium.pieces import AT_CORNER
from stiction.equilibrium.workspace import Sample
from stiction.jit import jit
from stiction.lanes import multiply_add

STEPS = 30
"""Elastic steps; most samples need five to eight."""
SHARE = 1e-3
"""Growth in a step, as a share of the largest slip, below which the test gives up."""


@jit
def block_factor(column: Array, width: int) -> Array:
    """Cholesky factor of the leading block of K, for runs of up to `width` nodes.

    The block is a Toeplitz matrix: its factor follows column by column from two vectors, in
    `width`^2 operations (the algorithm of Schur; Kailath and Sayed, 1999).
    """
    factor = np.empty(row_start(width + 4))
    upper = column[:width] / np.sqrt(column[0])
    lower = upper.copy()
    for k in range(width):
        if k > 0:
            # One step down, and the hyperbolic rotation that clears entry k of the second vector.
            for r in range(width - 1, k - 1, -1):
                upper[r] = upper[r - 1]
            turn = lower[k] / upper[k]
            length = np.sqrt((1.0 - turn) * (1.0 + turn))
            for r in range(k, width):
                upper[r] = (upper[r] - turn * lower[r]) / length
                lower[r] = length * lower[r] - turn * upper[r]
        for r in range(k, width):
            factor[row_start(r) + k] = upper[r]
    return factor


@jit
def _add_scaled(target: Array, source: Array, first: int, count: int, factor: float) -> None:
    part = source[first : first + count]
    for i in range(count):
        target[i] = multiply_add(factor, part[i], target[i])


@jit
def runs_away(
    sample: Sample,
    wide_column: Array,
    load: float,
    slip: Array,
    stiff: Array,
    direction: Array,
    stiff_direction: Array,
    griffith: float,
    factor: Array,
    width: int,
    work: Array,
) -> int:
    """Whether the patch of an instability certainly becomes global sliding.

    Parameters
    ----------
    sample : Sample
    wide_column : (3 n,) array
        First column of K, three times over.
    load : float
        tau_0, Pa.
    slip : (n,) array, changed
        d of the state that became unstable; afterwards a lower bound of the next equilibrium.
    stiff : (n,) array
        K d of that state.
    direction, stiff_direction : (n,) arrays
        In which it is unstable, and K times it.
    griffith : float
        Griffith's critical crack length, in nodes: so many residual ones in a row nothing stops.
    factor, width : array and int
        From `block_factor`.
    work : (6, n) array

    Returns
    -------
    int
        SLIDING or UNDECIDED.
    """
    n = slip.shape[0]
    step = step_to_corner(sample, slip, direction, np.inf)
    if not np.isfinite(step):
        return SLIDING
    first, length, _ = main_patch(direction)
    if (np.isfinite(griffith) and griffith > width) or length > width:
        return UNDECIDED
    # Everything below is numbered from `origin`, so that the patch lies in the middle.
    origin = (first - (n - length) // 2) % n
    grown = work[0]
    drive = work[1]
    extra = work[2]
    forward = work[3]
    solution = work[4]
    push = work[5]
    grown[:] = 0.0
    extra[:] = 0.0
    for q in range(n):
        i = (origin + q) % n
        push[q] = load * sample.profile[i] - stiff[i] - step * stiff_direction[i]
    begin = (n - length) // 2
    end = begin + length
    low = begin
    high = end
    for _ in range(STEPS):
        # Neighbours that are driven forward join, as far as the stress was computed.
        while begin > low:
            i = (origin + begin - 1) % n
            if push[begin - 1] - extra[begin - 1] < strength_at(sample, slip, i):
                break
            begin -= 1
        while end < high:
            i = (origin + end) % n
            if push[end] - extra[end] < strength_at(sample, slip, i):
                break
            end += 1
        length = end - begin
        if length > width:
            return UNDECIDED
        for t in range(length):
            q = begin + t
            i = (origin + q) % n
            drive[t] = max(push[q] - extra[q] - strength_at(sample, slip, i), 0.0)
        substitute(factor, length, drive, forward)
        back_substitute(factor, length, forward, solution)
        run = 0
        longest = 0
        largest = 0.0
        fastest = 0.0
        for t in range(length):
            i = (origin + begin + t) % n
            slip[i] += solution[t]
            grown[begin + t] += solution[t]
            largest = max(largest, slip[i])
            fastest = max(fastest, solution[t])
            run = run + 1 if slip[i] >= AT_CORNER * sample.critical[i] else 0
            longest = max(longest, run)
        if longest >= griffith or unsupported(sample, load, slip):
            return SLIDING
        if fastest < SHARE * largest:
            return UNDECIDED
        low = max(begin - length // 2, 0)
        high = min(end + length // 2, n)
        extra[low:high] = 0.0
        for q in range(begin, end):
            _add_scaled(extra[low:high], wide_column, n + low - q, high - low, grown[q])
    return UNDECIDED

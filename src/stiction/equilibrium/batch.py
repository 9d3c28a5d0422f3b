"""The onset of many profiles, one after the other, in one compiled loop."""

from __future__ import annotations

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.line_stiffness import apply_stiffness
from stiction.equilibrium.instability_jump import UNDECIDED, griffith_length
from stiction.equilibrium.linear_program import solve_program
from stiction.equilibrium.patches import count_patches, main_patch
from stiction.equilibrium.pieces import AT_CORNER, Pieces
from stiction.equilibrium.single_patch_test import runs_away
from stiction.equilibrium.window_bound import Windows, window_bound
from stiction.equilibrium.workspace import Grid, Sample, Workspace, make_sample, make_workspace
from stiction.jit import ZERO, jit

LOAD, GAP, PATCHES, POSITION, LENGTH, OUTCOME = range(6)
COLUMNS = 6
"""Columns of the result of `solve_batch`."""

CORNER_REACHED = 3
"""Outcome of a sample in which a corner of the law is reached before the first instability."""


@jit
def certificate(
    sample: Sample,
    grid: Grid,
    slip: Array,
    stiff: Array,
    multiplier: Array,
    product: Array,
    workspace: Workspace,
) -> float:
    """Distance of the rigorous bounds from below (by the slip) and from above (by y), Pa.

    K y is left in `product`.
    """
    n = slip.shape[0]
    lower = np.inf
    count = ZERO
    values = workspace.vectors[1]
    for i in range(n):
        balance = sample.excess[i] + stiff[i] - sample.rate[i] * slip[i]
        lower = min(lower, balance / sample.profile[i])
        if multiplier[i] > 0.0:
            workspace.order[count] = i
            values[count] = multiplier[i]
            count += 1
    apply_stiffness(
        grid.strip, grid.column[0], workspace.order, count, values, workspace.halves, product
    )
    above = 0.0
    below = 0.0
    excess = 0.0
    for i in range(n):
        above += multiplier[i] * sample.excess[i]
        below += multiplier[i] * sample.profile[i]
        # Round-off may leave A y slightly positive; what this can do to the bound is added to it.
        excess += max(product[i] - sample.rate[i] * multiplier[i], 0.0) * slip[i]
    return max((above + excess) / below - lower, 0.0)


@jit
def start_from_bound(
    start: int, width: int, mode: Array, multiplier: Array, profile: Array
) -> None:
    """Write the multiplier of a window (or, width 0, of the uniform field), <p, y> = 1."""
    n = multiplier.shape[0]
    if width == 0:
        multiplier[:] = 1.0
    else:
        multiplier[:] = 0.0
        for q in range(width):
            multiplier[(start + q) % n] = mode[q]
    weight = 0.0
    for i in range(n):
        weight += multiplier[i] * profile[i]
    for i in range(n):
        multiplier[i] /= weight


@jit
def solve_batch(
    excess: Array,
    residual: Array,
    profile: Array,
    rate: Array,
    pieces: Pieces,
    usual_rate: float,
    grid: Grid,
    wide_column: Array,
    usual: Windows,
    others: Windows,
    block: Array,
    reach: int,
    spacing: float,
    modulus: float,
    caution: float,
    results: Array,
    slips: Array,
    stiffs: Array,
    aheads: Array,
    multipliers: Array,
    all_slips: bool,
) -> None:
    """Solve the programme for each row and test quickly whether its instability is arrested.

    Parameters
    ----------
    excess, residual, rate : (samples, n) arrays
        tau_p - tau_i, tau_r - tau_i (Pa), W (Pa/m).
    profile : (n,) array
    pieces : Pieces
    usual_rate : float
        The problem's uniform weakening rate, or NaN.
    grid : Grid
    wide_column : (3 n,) array
        Its column, three times over.
    usual, others : Windows
        For samples with the usual rate everywhere, and for all others.
    block, reach : array and int
        From `block_factor`.
    spacing, modulus : float
        m and Pa.
    caution : float
        Factor on the length at which a rupture counts as unstoppable.
    results : (samples, COLUMNS) array, output
    slips, stiffs, multipliers : (samples, n) arrays, output
        d, K d and y at the first instability; K d where the outcome is left undecided, and d only
        there unless `all_slips`.
    aheads : (samples, n) array, output
        Where the outcome is left undecided, a lower bound of the slip after the jump.
    """
    samples, n = excess.shape
    workspace = make_workspace(n)
    slip = np.empty(n)
    stiff = np.empty(n)
    multiplier = np.empty(n)
    product = np.empty(n)
    work = np.empty((6, n))
    for row in range(samples):
        sample = make_sample(excess[row], residual[row], profile, rate[row], pieces)
        windows = usual
        for i in range(n):
            workspace.diagonal[i] = grid.column[0] - sample.rate[i]
            if rate[row, i] != usual_rate:
                windows = others
        bound, start, choice = window_bound(excess[row], profile, sample.rate, windows, work)
        width = 0 if choice < 0 else windows.widths[choice]
        start_from_bound(start, width, windows.modes[max(choice, 0)], multiplier, profile)
        # If it does not succeed, the certificate says so.
        load, _ = solve_program(
            excess[row], profile, grid, bound, np.inf, multiplier, slip, stiff, workspace
        )
        line = results[row]
        line[LOAD] = load
        line[PATCHES] = count_patches(slip)
        line[GAP] = certificate(sample, grid, slip, stiff, multiplier, product, workspace)
        _, length, centre = main_patch(multiplier)
        line[POSITION] = centre * spacing
        line[LENGTH] = length * spacing
        for i in range(n):
            multipliers[row, i] = multiplier[i]
        if all_slips:
            slips[row] = slip
        line[OUTCOME] = UNDECIDED
        for i in range(n):
            corner = pieces.ends[0] * sample.critical[i]
            if slip[i] > corner * (2.0 - AT_CORNER) and sample.critical[i] > 0.0:
                line[OUTCOME] = CORNER_REACHED
        if line[OUTCOME] == UNDECIDED:
            griffith = caution * griffith_length(sample, load, spacing, modulus)
            tried = slip.copy()
            line[OUTCOME] = runs_away(
                sample,
                wide_column,
                load,
                tried,
                stiff,
                multiplier,
                product,
                griffith,
                block,
                reach,
                work,
            )
            if line[OUTCOME] == UNDECIDED:
                slips[row] = slip
                stiffs[row] = stiff
                aheads[row] = tried

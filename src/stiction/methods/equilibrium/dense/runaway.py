"""A quick test for an unstable patch that runs along the interface, all others held fixed.

A lower bound of what happens: if the patch alone, growing as one run of nodes, reaches a length at
which no fracture energy can stop it, the whole interface slides. Each step solves the elastic
problem of the run with frozen strengths; the blocks of K being Toeplitz, one Cholesky factor serves
the runs of every sample.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit, jit_allocating
from stiction.base.lanes import multiply_add
from stiction.elasticity.line import line_of
from stiction.elasticity.protocol import HalfSpaces
from stiction.methods.equilibrium.dense.cholesky import back_substitute, row_start, substitute
from stiction.methods.equilibrium.patches import main_patch
from stiction.methods.equilibrium.sample import (
    Outcome,
    StaticSample,
    step_to_corner,
    strength_at,
    unsupported,
)

STEPS = 30
"""Elastic steps; most samples need five to eight."""
SHARE = 1e-3
"""Growth in a step, as a share of the largest slip, below which the test gives up."""
LONGEST_RUN = 2048
"""Nodes up to which the test follows a run."""
MARGIN = 1.5
"""Safety factor on the length beyond which a rupture counts as unstoppable."""


def block_factor(column: Array, width: int) -> Array:
    """Cholesky factor of the leading block of K, for runs of up to `width` nodes.

    The block is a Toeplitz matrix: its factor follows column by column from two vectors, in
    `width`^2 operations (the algorithm of Schur; Kailath and Sayed, 1999).
    """
    factor = np.empty(row_start(width + 4))
    starts = np.array([row_start(r) for r in range(width)])
    upper = column[:width] / np.sqrt(column[0])
    lower = upper.copy()
    for k in range(width):
        if k > 0:
            # One step down, and the hyperbolic rotation that clears entry k of the second vector.
            shifted, rest = upper[k - 1 : -1], lower[k:]
            turn = lower[k] / upper[k - 1]
            length = np.sqrt((1.0 - turn) * (1.0 + turn))
            upper[k:] = (shifted - turn * rest) / length
            lower[k:] = length * rest - turn * upper[k:]
        factor[starts[k:] + k] = upper[k:]
    return factor


class Runs(NamedTuple):
    """Properties of a line that the test needs."""

    wide_column: Array  # the first column of K three times over, Pa/m
    factor: Array  # for runs of up to `longest` nodes
    longest: int
    spacing: float  # m
    modulus: float  # G*, Pa


@lru_cache(maxsize=4)
def runs_of(half_spaces: HalfSpaces, nodes: int) -> Runs:
    """Return what the test needs of a line."""
    (length,), (modulus,) = half_spaces
    column = line_of(half_spaces, nodes).entries.column
    longest = min(LONGEST_RUN, nodes - 1)
    factor = block_factor(column, longest)
    return Runs(np.tile(column, 3), factor, longest, length / nodes, modulus)


@jit
def unstoppable_length(sample: StaticSample, load: float, runs: Runs) -> float:
    """Nodes in a row at their residual strength that nothing stops; infinite without a stress drop.

    Griffith's (1921) length with the least stress drop D and the largest fracture energy, which is
    (tau_p - tau_r) d_c times the area under the law: with half of it, a, a crack releases
    pi a D^2/(2 G*) at each tip.
    """
    drop = np.inf
    energy = 0.0
    for i in range(sample.excess.shape[0]):
        drop = min(drop, load * sample.profile[i] - sample.residual[i])
        fall = sample.excess[i] - sample.residual[i]
        energy = max(energy, sample.pieces.area * fall * sample.critical[i])
    if drop <= 0.0:
        return np.inf
    return 4.0 * runs.modulus * energy / (np.pi * drop * drop) / runs.spacing


@jit_allocating
def runs_away(
    sample: StaticSample,
    runs: Runs,
    load: float,
    slip: Array,
    stiff: Array,
    direction: Array,
    stiff_direction: Array,
) -> tuple[Outcome, float]:
    """Whether the patch of an instability certainly becomes global sliding: SLIDING or UNDECIDED.

    Returned is, too, the number of residual nodes in a row that would show it in a jump. Slip d and
    K d are those of the state that became unstable; afterwards slip is a lower bound of the next
    equilibrium. K times the unstable direction is given beside it.
    """
    n = slip.shape[0]
    griffith = unstoppable_length(sample, load, runs)
    safe = MARGIN * griffith
    step = step_to_corner(sample, slip, direction, np.inf)
    if step == np.inf:
        return Outcome.SLIDING, safe
    first, length, _ = main_patch(direction)
    if (griffith > runs.longest and griffith < np.inf) or length > runs.longest:
        return Outcome.UNDECIDED, safe
    # Everything below is numbered from `origin`, so that the patch lies in the middle.
    begin = (n - length) // 2
    end = begin + length
    low = begin
    high = end
    origin = first - begin
    if origin < 0:
        origin += n
    grown, extra = np.zeros(n), np.zeros(n)
    push, solution = np.empty(n), np.empty(n)
    for q in range(n):
        i = (origin + q) % n
        push[q] = load * sample.profile[i] - stiff[i] - step * stiff_direction[i]
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
        if length > runs.longest:
            return Outcome.UNDECIDED, safe
        for t in range(length):
            q = begin + t
            i = (origin + q) % n
            solution[t] = max(push[q] - extra[q] - strength_at(sample, slip, i), 0.0)
        substitute(runs.factor, ZERO, length, solution)
        back_substitute(runs.factor, length, solution)
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
            run = run + 1 if slip[i] >= sample.pieces.at_corner * sample.critical[i] else 0
            longest = max(longest, run)
        if longest >= griffith or unsupported(sample, load, slip):
            return Outcome.SLIDING, safe
        if fastest < SHARE * largest:
            return Outcome.UNDECIDED, safe
        low = max(begin - length // 2, 0)
        high = min(end + length // 2, n)
        near = extra[low:high]
        for t in range(near.shape[0]):
            near[t] = 0.0
        for q in range(begin, end):
            source = runs.wide_column[n + low - q : n + high - q]
            factor = grown[q]
            for t in range(near.shape[0]):
                near[t] = multiply_add(factor, source[t], near[t])
    return Outcome.UNDECIDED, safe

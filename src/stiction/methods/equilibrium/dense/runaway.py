"""Test quickly whether an unstable patch on a line certainly grows until the interface slides.

Problem
-------
At a load (Pa) a patch on a line became unstable. K is the stiffness
(Pa/m), d is the slip (m), s(d) is the strength minus initial stress
(Pa) and p is the load profile. Does slip come to rest again? `jump`
answers this for any sample. Most samples slide, and this test shows
sliding faster. Without the test, onsets take three to five times as
long. The test follows only the patch, as a run of nodes, while all
other nodes are held. The result is a lower bound of the slip, because
slip at other nodes only adds stress (K has no positive off-diagonal
entry).

Algorithm
---------
The algorithm is our own. It uses two known results: the factor of a
Toeplitz matrix (`block_factor`) and Griffith's length
(`unstoppable_length`).

1. Move along the direction of the instability until a node reaches a
   corner in its law. If no node reaches a corner, the interface slides.
2. Overloaded nodes next to the run join the
   run, while their stress is known.
3. Take an elastic step. With the present strengths, solve K_RR x =
   (load p - K d - s(d))_R on the run R, with the right side cut off at
   zero, and add x to the slip. Blocks of K on runs with the same length
   are equal, so a single Cholesky factor serves all runs and samples.
4. The interface slides if nodes at their residual strength form a run
   of the unstoppable length, or if the mean strength of the interface
   cannot carry the load.
5. The test gives up (UNDECIDED) if slip hardly grows, after
   `MAX_RUN_STEPS` steps, or if the run or the unstoppable length is
   longer than the factor.
6. Compute the stress due to all slip added so far, on the run and for
   half its length on both sides. Go to step 2.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.jit import ZERO, jit, jit_allocating
from stiction.base.lanes import multiply_add
from stiction.elasticity.line import line_of
from stiction.elasticity.protocol import HalfSpaces
from stiction.methods.equilibrium.dense.cholesky import (
    back_substitute,
    forward_substitute,
    row_start,
)
from stiction.methods.equilibrium.patches import main_patch
from stiction.methods.equilibrium.state import Outcome
from stiction.methods.equilibrium.strength import (
    StaticSample,
    step_to_corner,
    strength_at,
    unsupported,
)

MAX_RUN_STEPS = 30
"""Most elastic steps. Samples usually need five to eight."""
MIN_GROWTH = 1e-3
"""Growth in a step, as a fraction of the largest slip, below which the
test gives up."""
MAX_RUN = 2048
"""Most nodes in a run that the test follows."""
UNSTOPPABLE_MARGIN = 1.5
"""Safety factor on the length from which `jump` counts a rupture as
unstoppable."""


def block_factor(column: Array, width: int) -> Array:
    """Return the Cholesky factor of the leading block of K, for runs with up to `width` nodes.

    The block is a Toeplitz matrix. Its factor follows, column by
    column, from two vectors in `width`^2 operations (the algorithm of
    Schur; T. Kailath and A. Sayed, Fast Reliable Algorithms for
    Matrices with Structure, 1999, chapter 1).

    The factor of a Toeplitz block, row by row, as numpy finds it from the whole block:

    >>> column = 6.0 / (1.0 + np.arange(12)) ** 2 * np.where(np.arange(12) > 0, -1.0, 1.0)
    >>> block = column[np.abs(np.subtract.outer(np.arange(11), np.arange(11)))]
    >>> factor, L = block_factor(column, 11), np.linalg.cholesky(block)
    >>> rows = [factor[row_start(r) : row_start(r) + r + 1] for r in range(11)]
    >>> all(np.allclose(row, L[r, : r + 1]) for r, row in enumerate(rows))
    True
    """
    factor = np.empty(row_start(width + 4))
    starts = np.array([row_start(r) for r in range(width)])
    upper = column[:width] / np.sqrt(column[0])
    lower = upper.copy()
    for k in range(width):
        if k > 0:
            # One step down, and the hyperbolic rotation that clears
            # entry k of the second vector.
            shifted, remaining = upper[k - 1 : -1], lower[k:]
            reflection = lower[k] / upper[k - 1]
            scale = np.sqrt((1.0 - reflection) * (1.0 + reflection))
            upper[k:] = (shifted - reflection * remaining) / scale
            lower[k:] = scale * remaining - reflection * upper[k:]
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
    """Return the properties of a line that the test needs.

    >>> runs = runs_of(HalfSpaces((2.0,), (5.0,)), 16)
    >>> runs.longest
    15
    >>> runs.spacing
    0.125
    >>> runs.modulus
    5.0
    >>> runs.wide_column.size
    48
    >>> runs.wide_column[16:32].tolist() == runs.wide_column[:16].tolist()
    True
    """
    (length,), (modulus,) = half_spaces
    column = line_of(half_spaces, nodes).entries.column
    longest = min(MAX_RUN, nodes - 1)
    factor = block_factor(column, longest)
    return Runs(np.tile(column, 3), factor, longest, length / nodes, modulus)


@jit
def unstoppable_length(sample: StaticSample, load: float, runs: Runs) -> float:
    """Return the length, in nodes, above which no strength around stops a run of residual nodes.

    This is Griffith's (1921) length with the smallest stress drop D and
    the largest fracture energy. The fracture energy is (tau_p - tau_r)
    d_c times the area under the law. A crack of half-length a releases
    pi a D^2/(2 G*) at each tip. The length is infinite if a node has no
    stress drop.

    The least stress drop is 2 x 1.5 - 1 Pa at node 0, and the largest energy
    0.5 x 3 x 2 J/m² at node 1. The length is 4 x 5 x 3/(pi 2^2) m, divided by
    0.125 m:

    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> rows = np.array([[2.0, 4.0, np.inf], [1.0, 1.0, 2.9], [1.5, 2, 1], [1.0, 1.5, 1]])
    >>> sample, runs = make_sample(*rows, LINEAR), Runs(np.zeros(1), np.zeros(1), 15, 0.125, 5.0)
    >>> round(unstoppable_length(sample, 2.0, runs) * np.pi, 6)
    120.0
    >>> unstoppable_length(sample, 2 / 3, runs)
    inf
    """
    stress_drop, energy = np.inf, 0.0
    for i in range(sample.excess.shape[0]):
        if sample.excess[i] == np.inf:
            continue
        stress_drop = min(stress_drop, load * sample.profile[i] - sample.residual[i])
        fall = sample.excess[i] - sample.residual[i]
        energy = max(energy, sample.pieces.area * fall * sample.critical[i])
    if stress_drop <= 0.0:
        return np.inf
    return 4.0 * runs.modulus * energy / (np.pi * stress_drop * stress_drop) / runs.spacing


@jit_allocating
def runs_away(
    sample: StaticSample, runs: Runs, load: float, slip: Array, Kd: Array, z: Array, Kz: Array
) -> tuple[Outcome, float]:
    """Return SLIDING if the patch of an instability certainly slides, otherwise UNDECIDED.

    The second value is the number of residual nodes in a row that
    proves sliding in `jump`. Slip d, K d, the direction z of the
    instability and K z belong to the instability. After the call, slip
    is a lower bound of the least equilibrium.

    A patch at the border of 64 equal nodes slides, and 1.5 times Griffith's
    length is 6 x 5 x 0.00675/(pi 0.8^2) m. Without a corner nothing stops it:

    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> runs, i = runs_of(HalfSpaces((2.0,), (5.0,)), 64), (np.arange(64) + 31) % 64 - 31
    >>> K = runs.wide_column[np.abs(np.subtract.outer(np.arange(64), np.arange(64)))]
    >>> def outcome(weak, strong, z, W=60.0):
    ...     excess, slip = np.where((i > -2) & (i < weak), 1.0, strong), np.zeros(64)
    ...     rows = excess, np.full(64, 0.1), np.ones(64), np.full(64, W)
    ...     sample = make_sample(*rows, LINEAR)
    ...     found, length = runs_away(sample, runs, 0.9, slip, np.zeros(64), z, K @ z)
    ...     return Outcome(found).name, round(length / 32, 6), slip
    >>> z = np.maximum(1.0 - np.abs(i) / 6.0, 0.0)
    >>> outcome(99, 1.0, z)[:2] == ("SLIDING", round(30 * 0.00675 / np.pi / 0.64, 6))
    True
    >>> outcome(99, 1.0, 0.0 * z)[0]
    'SLIDING'

    Strong nodes stop the patch, so that K d = 0.9 - 0.1 on its four nodes. Their
    fracture energy is 2.9^2/600 J/m²:

    >>> patch = (i > -2) & (i < 3)
    >>> found, length, slip = outcome(3, 3.0, 1.0 * patch, 300.0)
    >>> found
    'UNDECIDED'
    >>> length == round(30 * 2.9**2 / 600 / np.pi / 0.64, 6)
    True
    >>> rest = np.linalg.solve(K[np.ix_(patch, patch)], np.full(4, 0.8))
    >>> bool(np.allclose(slip[patch], rest, rtol=2e-3))
    True
    >>> int(np.count_nonzero(slip))
    4
    """
    n = slip.shape[0]
    griffith = unstoppable_length(sample, load, runs)
    unstoppable = UNSTOPPABLE_MARGIN * griffith
    # 1.
    step = step_to_corner(sample, slip, z, np.inf)
    if step == np.inf:
        return Outcome.SLIDING, unstoppable
    first, length, _ = main_patch(z)
    if (griffith > runs.longest and griffith < np.inf) or length > runs.longest:
        return Outcome.UNDECIDED, unstoppable
    # Places q on the circle are counted from `origin`, so that the
    # patch lies in the middle: the run is begin..end-1, and the stress
    # is known in low..high-1.
    begin = (n - length) // 2
    end = begin + length
    low, high = begin, end
    origin = first - begin
    if origin < 0:
        origin += n
    added, K_added = np.zeros(n), np.zeros(n)  # slip added since step 1, and K times it
    stress, solution = np.empty(n), np.empty(n)
    for q in range(n):
        i = (origin + q) % n
        stress[q] = load * sample.profile[i] - Kd[i] - step * Kz[i]
    for _ in range(MAX_RUN_STEPS):
        # 2.
        while begin > low:
            i = (origin + begin - 1) % n
            if stress[begin - 1] - K_added[begin - 1] < strength_at(sample, slip, i):
                break
            begin -= 1
        while end < high:
            i = (origin + end) % n
            if stress[end] - K_added[end] < strength_at(sample, slip, i):
                break
            end += 1
        length = end - begin
        if length > runs.longest:
            return Outcome.UNDECIDED, unstoppable
        # 3.
        for t in range(length):
            q = begin + t
            i = (origin + q) % n
            solution[t] = max(stress[q] - K_added[q] - strength_at(sample, slip, i), 0.0)
        forward_substitute(runs.factor, ZERO, length, solution)
        back_substitute(runs.factor, length, solution)
        run, longest_run, largest_slip, largest_growth = 0, 0, 0.0, 0.0
        for t in range(length):
            i = (origin + begin + t) % n
            slip[i] += solution[t]
            added[begin + t] += solution[t]
            largest_slip = max(largest_slip, slip[i])
            largest_growth = max(largest_growth, solution[t])
            residual = slip[i] >= sample.pieces.at_corner * sample.critical[i]
            run = run + 1 if residual else 0
            longest_run = max(longest_run, run)
        # 4. and 5.
        if longest_run >= griffith or unsupported(sample, load, slip):
            return Outcome.SLIDING, unstoppable
        if largest_growth < MIN_GROWTH * largest_slip:
            return Outcome.UNDECIDED, unstoppable
        # 6.
        low = max(begin - length // 2, 0)
        high = min(end + length // 2, n)
        K_near = K_added[low:high]
        for t in range(K_near.shape[0]):
            K_near[t] = 0.0
        for q in range(begin, end):
            K_q = runs.wide_column[n + low - q : n + high - q]
            added_q = added[q]
            for t in range(K_near.shape[0]):
                K_near[t] = multiply_add(added_q, K_q[t], K_near[t])
    return Outcome.UNDECIDED, unstoppable

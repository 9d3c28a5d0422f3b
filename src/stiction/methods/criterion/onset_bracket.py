"""Whether the exact onset of a line is near a prediction, without the kernels of equilibrium.

Problem: does a line have an equilibrium at the load tau_0, that is a slip d >= 0 with

    K d + max(tau_p - W d, tau_r) >= tau_i + tau_0 p ?

A predicted load is right to 1 % if there is one at 0.99 of it and none at 1.01. If it is not, wider
brackets tell by how much it is off.

Source: entries of K off the diagonal are not positive, and strength falls with slip. The slip of
the least equilibrium can therefore be built up from zero without ever being taken back
(Chandrasekaran 1970, for linear problems). Steps of `slides`, from d = 0:

1. The overstress f = tau_i + tau_0 p - K d - strength, Pa.
2. The interface slides if the load exceeds the mean strength, or if so many nodes in a row are at
   their residual strength that no fracture energy stops a crack of this length (Griffith 1921).
3. S, the nodes that slip or are overstressed. If none is overstressed, d is an equilibrium.
4. Newton: d_S grows by x with (K - W)_SS x = f, up to the first node that reaches its residual
   strength.
5. If K - W is not positive definite on S, a patch is unstable. A few steps with frozen strengths
   follow, K_SS x = f, which never pass the least equilibrium.

Departure from the source: strength has a corner, and steps end at a tolerance. Where
thousands of nodes slip the question is left undecided, as each step solves a dense system.
"""

import numpy as np
from scipy.linalg.lapack import dposv

from stiction.base.arrays import Array, one_blas_thread
from stiction.elasticity.line import line_of
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample

MAX_OPERATIONS = 4e9
"""Cubes of the nodes that move and squares of all nodes, summed over steps: beyond, a sample is
undecided."""
FROZEN_STEPS = 4
"""Steps with frozen strengths before Newton's is tried again."""
REST_RTOL, JOIN_RTOL = 1e-5, 1e-9
"""Overstress over strength below which nothing moves, and below which a node does not join."""
BRACKETS_RATIO = 2.0**0.5
BRACKETS = tuple(0.01 * BRACKETS_RATIO**i for i in range(7))
"""Half-widths of the brackets about a predicted load, as shares of it: 1 to 8 %."""
GRIFFITH_MARGIN = 1.5
"""Safety factor on the length beyond which a crack counts as unstoppable."""


def rms_difference(problem: Problem, sample: Sample, stress: Array) -> float:
    """Return about how far exact onsets are from predicted ones, rms over samples, as a share.

    Differences below the narrowest bracket, 1 %, count as none. Infinite if a sample is undecided.

    Parameters
    ----------
    problem : Problem
        A line between half-spaces, with strength that falls linearly.
    sample : Sample
    stress : (samples,) array
        Predicted mean stress at the onset, Pa.
    """
    column = line_of(problem.half_spaces, problem.interface.size).entries.column
    bounds = np.zeros(sample.samples)
    with one_blas_thread():
        for i in range(sample.samples):
            initial, rate = sample.initial_stress[i], sample.weakening_rate[i]
            peak, residual = sample.strength[i] - initial, sample.residual_strength[i] - initial
            load = (stress[i] - initial.mean()) / sample.load_profile.mean()
            nodes = peak, residual, rate, load * sample.load_profile
            bounds[i] = max(_least_difference(column, *nodes, side) for side in (-1, 1))
            if np.isinf(bounds[i]):
                break
    return BRACKETS_RATIO**0.5 * float(np.sqrt(np.mean(bounds**2)))


def _least_difference(
    column: Array, peak: Array, residual: Array, rate: Array, load: Array, side: int
) -> float:
    """Return the widest bracket on a side beyond which the onset is; 0 if it is in all of them."""
    least = 0.0
    for width in BRACKETS:
        sliding = slides(column, peak, residual, rate, (1.0 + side * width) * load)
        if sliding is None:
            return np.inf
        if sliding == (side > 0):
            break
        least = width
    return least


def slides(
    column: Array, peak: Array, residual: Array, rate: Array, load: Array
) -> bool | None:
    """Return whether a line has no equilibrium under a load, and so slides; None if undecided.

    Parameters
    ----------
    column : (nodes,) array
        First column of K, Pa/m.
    peak, residual : (nodes,) arrays
        tau_p - tau_i and tau_r - tau_i, Pa.
    rate : (nodes,) array
        W, Pa/m.
    load : (nodes,) array
        tau_0 p, Pa.
    """
    nodes, symbol = column.size, np.fft.rfft(column)
    critical, scale = (peak - residual) / rate, float(peak.mean())
    crack = GRIFFITH_MARGIN * _unstoppable_nodes(column, peak, residual, rate, load)
    slip, frozen, operations = np.zeros(nodes), 0, 0
    while operations < MAX_OPERATIONS:
        # 1.
        strength = np.maximum(peak - rate * slip, residual)
        overstress = load - np.fft.irfft(symbol * np.fft.rfft(slip), nodes) - strength
        # 2.
        intact = np.flatnonzero(slip < critical)
        run = (
            np.diff(intact, append=intact[:1] + nodes).max(initial=0) if intact.size else nodes
        )
        if run > crack or load.mean() >= strength.mean():
            return True
        # 3.
        moving = np.flatnonzero((slip > 0.0) | (overstress > JOIN_RTOL * scale))
        operations += moving.size**3 + nodes**2
        force = np.maximum(overstress[moving], 0.0)
        if force.max(initial=0.0) < REST_RTOL * scale:
            return False
        stiffness = column[np.abs(np.subtract.outer(moving, moving))]
        # 4.
        left = (critical - slip)[moving]
        unstable = True
        if not frozen:
            weakening = np.where(left > 0.0, rate[moving], 0.0)
            _, growth, unstable = dposv(stiffness - np.diag(weakening), force)
            reached = (weakening > 0.0) & (growth >= left)
            if not unstable and reached.any():
                growth *= np.min(left[reached] / growth[reached]) * (1.0 + 1e-9)
            frozen = FROZEN_STEPS if unstable else 0
        # 5.
        if unstable:
            _, growth, _ = dposv(stiffness, force)
            frozen -= 1
        slip[moving] += growth
    return None


def _unstoppable_nodes(
    column: Array, peak: Array, residual: Array, rate: Array, load: Array
) -> float:
    """Return how many nodes a crack spans that nothing stops; infinite without a stress drop.

    Griffith's length is 4 G* E/(pi D^2), with the largest fracture energy E and the least stress
    drop D. Between half-spaces K_0 is pi G*/4 over the spacing.
    """
    drop = float(np.min(load - residual))
    energy = float(np.max((peak - residual) ** 2 / (2.0 * rate)))
    return 16.0 * column[0] * energy / (np.pi * drop) ** 2 if drop > 0.0 else np.inf

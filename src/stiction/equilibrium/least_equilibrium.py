"""Relaxation of a plane at a fixed load: each node stuck, weakening, or at its residual strength.

Strength less initial stress is max(s - W d, r). From a slip d whose nodes are all driven forward
or balanced, an overdamped interface moves to the least equilibrium that is not below d, or there
is none and it slides. Two kinds of step, neither of which passes that equilibrium: an elastic one,
with the strength frozen at its present value; and one with the true states of the nodes, up to
where the first weakening node reaches its residual strength: if none does, it is the equilibrium.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.conjugate_gradients import (
    EXHAUSTED,
    NEGATIVE,
    SOLVED,
    residual_of,
    solve_inside,
)
from stiction.elasticity.lowest_eigenvector import lowest_eigenvector
from stiction.elasticity.transform_operator import Operator
from stiction.equilibrium.controlled_equilibrium import equilibrate

BALANCED = 0
SLIDING = 1
UNDECIDED = 2

AT_RESIDUAL = 1.0 - 1e-9
"""Share of d_c from which on a node counts as at its residual strength."""
RELEVANT = 1e-5
"""Share of the largest value below which a node is not part of an unstable direction."""
ITERATIONS = 3000
STEPS = 2000
SETTLED = 0.02
"""Growth of slip in one elastic step, as a share of d_c, below which the true states are tried."""
DRAG = 1e-3
"""Stiffness added to elastic steps, as a share of the largest W."""
ROUGH = 2e-3
"""Largest residual stress as a share of the mean strength while slip grows faster than that."""


class PlaneSample(NamedTuple):
    """One sample: s, r (strengths less initial stress, Pa), p, W (Pa/m), d_c (m); (nx, ny) each."""

    excess: Array
    residual: Array
    profile: Array
    rate: Array
    critical: Array


def contiguous(sample: PlaneSample) -> PlaneSample:
    """The sample as compiled kernels take it, whatever its arrays are views of."""
    return PlaneSample(*(np.ascontiguousarray(values, dtype=np.float64) for values in sample))


def at_residual(sample: PlaneSample, slip: Array) -> Array:
    """Which nodes are at their residual strength, (nx, ny) bool; those of constant strength are."""
    reached: Array = slip >= AT_RESIDUAL * sample.critical
    return reached


def strength_at(sample: PlaneSample, slip: Array) -> Array:
    """Strength less initial stress at a slip, Pa."""
    weakened: Array = np.maximum(sample.excess - sample.rate * slip, sample.residual)
    return weakened


def step_to_residual(sample: PlaneSample, slip: Array, direction: Array) -> float:
    """Length along a direction at which the first weakening node reaches its residual strength."""
    weak = ~at_residual(sample, slip) & (direction > 0.0)
    if not weak.any():
        return np.inf
    return float(((sample.critical - slip)[weak] / direction[weak]).min())


def _advance(
    operator: Operator, sample: PlaneSample, load: float, strength: Array, rate: Array,
    slip: Array, tolerance: float,
) -> tuple[int, Array, int]:  # fmt: skip
    """Equilibrium for given strengths at zero slip and rates; status, slip, iterations."""
    new = slip.copy()
    drive = load * sample.profile - strength
    inside = (slip > 0.0) | (drive > 0.0)
    none = np.zeros_like(slip)
    status, taken = equilibrate(
        operator._replace(rate=rate), drive, 0.0, none, inside, new, np.empty_like(slip),
        np.empty((3, *slip.shape)), tolerance, ITERATIONS,
    )  # fmt: skip
    return status, new, taken


def weakening_step(
    operator: Operator, sample: PlaneSample, load: float, slip: Array, tolerance: float
) -> tuple[Array, int]:
    """Slip moved with the true states until the first node reaches its residual strength.

    Only the nodes that slip or are overloaded move; it goes towards their equilibrium, or, if they
    have none, along y >= 0 with A y = lambda y, lambda < 0. Both keep every node that moves driven
    forward or balanced, so the next equilibrium is not passed. Returns the slip and iterations.
    """
    residual = at_residual(sample, slip)
    operator = operator._replace(rate=np.where(residual, 0.0, sample.rate))
    drive = load * sample.profile - np.where(residual, sample.residual, sample.excess)
    rest, new = np.empty_like(slip), slip.copy()
    workspace = np.empty((3, *slip.shape))
    none = np.zeros_like(slip)
    residual_of(operator, 0.0, none, drive, slip, rest)
    inside = (slip > 0.0) | (rest > 0.0)
    status, used = solve_inside(
        operator, inside, 0.0, none, new, rest, workspace, tolerance, ITERATIONS
    )  # fmt: skip
    direction = np.where(inside, np.maximum(new - slip, 0.0), 0.0)
    longest = 1.0
    if status == NEGATIVE:
        direction = np.abs(workspace[1])
        largest = float(sample.rate.max())
        _, taken = lowest_eigenvector(operator, inside, direction, 1e-6 * largest, ITERATIONS)
        used += taken
        direction = np.where(direction > RELEVANT * direction.max(), direction, 0.0)
        longest = np.inf
    step = min(step_to_residual(sample, slip, direction), longest)
    return (slip + step * direction if np.isfinite(step) else slip), used


class Relaxed(NamedTuple):
    """BALANCED, SLIDING or UNDECIDED; the slip; whether it was unstable on the way; iterations."""

    status: int
    slip: Array
    jumped: bool
    iterations: int


def least_equilibrium(
    operator: Operator,
    sample: PlaneSample,
    load: float,
    slip: Array,
    accuracy: float = 1e-7,
    only_stable: bool = False,
) -> Relaxed:
    """The least equilibrium at a load that is not below a given slip.

    Parameters
    ----------
    operator : Operator
        Its rate is not used.
    sample : PlaneSample
    load : float
        tau_0, Pa.
    slip : (nx, ny) array
        Zero, or an equilibrium at a lower load, or beyond it along an unstable direction, m.
    accuracy : float
        Largest residual stress as a share of the mean strength.
    only_stable : bool
        Give up, as UNDECIDED, where the path to the equilibrium looks unstable.

    Notes
    -----
    It slides as soon as the load exceeds the strength that is left on average: stiffness adds
    nothing to the mean. For lattice wavenumbers up to nu = 0.45 the result is exact up to
    `accuracy`; spectral ones have small positive off-diagonal entries.
    """
    tolerance = accuracy * float(np.abs(sample.excess).mean() + abs(load) * sample.profile.mean())
    # K alone is singular where everything slips; a drag on the growth keeps it a lower bound.
    drag = DRAG * float(sample.rate.max())
    frozen = np.full_like(sample.rate, -drag)
    slip = np.maximum(slip, 0.0)
    jumped = False
    used = 0
    patient = False
    for _ in range(STEPS):
        strength = strength_at(sample, slip)
        if float((load * sample.profile - strength).sum()) > tolerance * slip.size:
            return Relaxed(SLIDING, slip, True, used)
        residual = at_residual(sample, slip)
        if not patient:
            status, new, taken = _advance(
                operator, sample, load, np.where(residual, sample.residual, sample.excess),
                np.where(residual, 0.0, sample.rate), slip, tolerance,
            )  # fmt: skip
            used += taken
            if status == EXHAUSTED:
                return Relaxed(UNDECIDED, slip, jumped, used)
            jumped = jumped or status == NEGATIVE
            if jumped and only_stable:
                return Relaxed(UNDECIDED, slip, jumped, used)
            if status == SOLVED:
                new = np.maximum(new, slip)
                if step_to_residual(sample, slip, new - slip) >= 1.0:
                    return Relaxed(BALANCED, new, jumped, used)
            slip, taken = weakening_step(operator, sample, load, slip, tolerance)
            used += taken
            strength = strength_at(sample, slip)
        # With the drive lowered by the residual allowed, a rough solution is a lower bound too.
        rough = max(ROUGH / accuracy, 1.0) * tolerance if patient else tolerance
        status, new, taken = _advance(
            operator, sample, load, strength + rough - drag * slip, frozen, slip, rough
        )
        used += taken
        if status != SOLVED:
            return Relaxed(UNDECIDED, slip, jumped, used)
        new = np.maximum(new, slip)
        weakening = ~at_residual(sample, new)
        patient = bool((new - slip > SETTLED * sample.critical)[weakening].any())
        slip = new
    return Relaxed(UNDECIDED, slip, jumped, used)

"""A plane from its first instability to global sliding: stable path, jump, stable path, and so on.

Between jumps the programme (`plane_onset`) gives the next instability at once, with the nodes that
have reached their residual strength at W = 0, as long as no other node reaches it before. Where
one does, the path is followed in steps of the load by relaxation at fixed load.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.conjugate_gradients import inner
from stiction.elasticity.lowest_eigenvector import lowest_eigenvector
from stiction.elasticity.transform_operator import Operator, make_operator
from stiction.equilibrium.least_equilibrium import (
    AT_RESIDUAL,
    BALANCED,
    UNDECIDED,
    PlaneSample,
    Relaxed,
    at_residual,
    contiguous,
    least_equilibrium,
)
from stiction.equilibrium.plane_onset import Plane, PlaneOnset, plane_onset, symbol_of

FIRST_STEP = 0.01
"""Step of the load where the path is followed in steps, as a share of the load."""
MOVED = 0.02
"""Slip, as a share of d_c, below which a jump is a long step of the stable path and no event."""
DIRECTION_ITERATIONS = 300


@dataclass(frozen=True)
class PlaneEvent:
    """An instability that came to rest: its load (Pa), and the slip before and after it (m)."""

    load: float
    before: Array
    after: Array


@dataclass
class PlanePath:
    """What happens to one sample until it slides.

    Attributes
    ----------
    lower, upper : float
        Bounds of the first instability, Pa.
    slip : (nx, ny) array
        d at the first instability, m.
    direction : (nx, ny) array
        y at the first instability, <p, y> = 1: the derivative of its load by the strength that
        each node has there, tau_p - W d or tau_r.
    certified : bool
        Whether the bounds are rigorous: no node reached its residual strength before.
    load : float
        Last equilibrium = global sliding, Pa.
    events : list of PlaneEvent
    sliding_slip, sliding_direction : (nx, ny) arrays
        d (m) and y at the last equilibrium.
    outcome : int
        SLIDING, or UNDECIDED where a relaxation did not settle: `load` is then a lower bound.
    """

    lower: float
    upper: float
    slip: Array
    direction: Array
    certified: bool
    load: float = np.nan
    events: list[PlaneEvent] = field(default_factory=list)
    sliding_slip: Array = field(default_factory=lambda: np.zeros(0))
    sliding_direction: Array = field(default_factory=lambda: np.zeros(0))
    outcome: int = UNDECIDED


def programme(plane: Plane, sample: PlaneSample, slip: Array, gap: float) -> PlaneOnset | None:
    """Next instability if no further node reaches its residual strength before it."""
    residual = at_residual(sample, slip)
    found = plane_onset(
        plane,
        np.where(residual, sample.residual, sample.excess),
        sample.profile,
        np.where(residual, 0.0, sample.rate),
        gap,
        slip if slip.any() else None,
    )
    weak = ~residual
    if (found.slip[weak] > (2.0 - AT_RESIDUAL) * sample.critical[weak]).any():
        return None
    return found


def _step_on(
    operator: Operator, sample: PlaneSample, load: float, slip: Array, gap: float
) -> tuple[float, float, Array, Relaxed]:
    """Follow the stable path in steps of the load.

    A step is halved if it looks unstable, which a long one may do only because nodes reach their
    residual strength in it. Returns the last load of the path, the first one beyond, the slip at
    the one, and what comes of the other.
    """
    step = FIRST_STEP * load
    while True:
        trial = least_equilibrium(operator, sample, load + step, slip, 0.1 * gap, True)
        if trial.status == BALANCED:
            load, slip, step = load + step, trial.slip, 1.5 * step
        elif step > gap * load:
            step = max(0.4 * step, 0.7 * gap * load)
        else:
            beyond = least_equilibrium(operator, sample, load + step, slip, 0.1 * gap)
            return load, load + step, slip, beyond


def _direction(operator: Operator, sample: PlaneSample, slip: Array, after: Array) -> Array:
    """How the patch at the end of a stable path gives way: the y of its nearly zero eigenvalue."""
    weak = ~at_residual(sample, slip)
    growth = np.maximum(after - slip, 0.0)
    inside = slip > 0.0
    vector = np.where(inside, growth, 0.0)
    if vector.any():
        frozen = operator._replace(rate=np.where(weak, sample.rate, 0.0))
        tolerance = 1e-6 * float(sample.rate.max())
        lowest_eigenvector(frozen, inside, vector, tolerance, DIRECTION_ITERATIONS)
        growth = np.maximum(vector, 0.0)
    y: Array = growth / inner(sample.profile, growth)
    return y


def follow_plane(plane: Plane, sample: PlaneSample, gap: float = 1e-6) -> PlanePath:
    """First instability, arrested events and global sliding of one sample.

    Parameters
    ----------
    plane : Plane
    sample : PlaneSample
    gap : float
        Relative accuracy of loads.

    Notes
    -----
    Arrest is overdamped: the patch stops at the least equilibrium of the same load. Inertia may
    carry it through.
    """
    sample = contiguous(sample)
    shape = sample.excess.shape
    operator = make_operator(symbol_of(plane, shape), sample.rate, shape)
    path: PlanePath | None = None
    slip = np.zeros(shape)
    load = float((sample.excess / sample.profile).min())
    while True:
        found = programme(plane, sample, slip, gap)
        if found is not None:
            stable, before = found.lower, np.maximum(found.slip, slip)
            beyond = found.upper + gap * abs(found.upper)
            relaxed = least_equilibrium(operator, sample, beyond, before, 0.1 * gap)
            direction = found.multiplier
        else:
            stable, beyond, before, relaxed = _step_on(operator, sample, load, slip, gap)
            direction = _direction(operator, sample, before, relaxed.slip)
        slides = relaxed.status != BALANCED
        weakens = sample.critical > 0.0
        moved = slides or bool((relaxed.slip - before > MOVED * sample.critical)[weakens].any())
        if moved:
            if path is None:
                proved = found is not None and not at_residual(sample, slip)[weakens].any()
                upper = beyond if found is None else found.upper
                path = PlanePath(stable, upper, before, direction, proved)
            if slides:
                path.load, path.outcome = stable, relaxed.status
                path.sliding_slip, path.sliding_direction = before, direction
                return path
            path.events.append(PlaneEvent(stable, before, relaxed.slip))
        load, slip = beyond, relaxed.slip


def first_instability(plane: Plane, sample: PlaneSample, gap: float = 1e-6) -> float:
    """Its load alone, without the jump, Pa."""
    sample = contiguous(sample)
    found = programme(plane, sample, np.zeros(sample.excess.shape), gap)
    return found.lower if found is not None else follow_plane(plane, sample, gap).lower


def plane_slip_at(
    plane: Plane, sample: PlaneSample, loads: Array, accuracy: float = 1e-7
) -> tuple[Array, Array]:
    """Slip at given loads, by relaxation from each to the next.

    Parameters
    ----------
    plane : Plane
    sample : PlaneSample
    loads : (count,) array
        Rising, Pa.
    accuracy : float
        Largest residual stress as a share of the mean strength.

    Returns
    -------
    slip : (count, nx, ny) array
        d, m; NaN from global sliding on.
    status : (count,) int array
        BALANCED, SLIDING or UNDECIDED; the same from the first that is not balanced on.
    """
    sample = contiguous(sample)
    shape = sample.excess.shape
    operator = make_operator(symbol_of(plane, shape), sample.rate, shape)
    slips = np.full((len(loads), *shape), np.nan)
    status = np.full(len(loads), BALANCED)
    slip = np.zeros(shape)
    for number, load in enumerate(loads):
        relaxed = least_equilibrium(operator, sample, float(load), slip, accuracy)
        status[number:] = relaxed.status
        if relaxed.status != BALANCED:
            break
        slip = slips[number] = relaxed.slip
    return slips, status

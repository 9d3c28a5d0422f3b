"""The turning point of the load, where the stable and the unstable equilibria of a patch meet.

With the patch held by a spring along phi (`held_equilibrium`), equilibria exist on both sides
of it. Let a = <phi, d> and mu the force of the spring. On the slipping nodes A d = tau_0 p - s +
mu phi, and the slope d' = dd/da at fixed load satisfies A d' = mu' phi. At the turning point
mu = mu' = 0: Newton's method in a (with the slope of mu' by secant) and tau_0.

Bounds: d is feasible at tau_0 if mu >= 0. The combination y of two slopes, one with mu' > 0 and one
with mu' < 0, for which A y = 0 where both slip, is a multiplier; nodes that slip in one state only
have A y <= 0 and hardly slip at the turning point, so the error of its bound is of second order.
"""

from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.operator import (
    SOLVED,
    inner,
    lowest_eigenvector,
    residual_of,
    solve_inside,
)
from stiction.methods.equilibrium.transforms.bracket import Bracket
from stiction.methods.equilibrium.transforms.held_equilibrium import equilibrate

# Where Newton's method fails, bisection takes over: no result rests on these.
STEPS = 40
"""Most states that are tried."""
SWITCHES = 4
"""Largest number of patches that are held one after the other."""
PATIENCE, PROGRESS = 8, 0.95
"""States in a row that leave more than this share of the gap, after which the search ends."""
RETREAT = 2e-3
"""Share by which the load is lowered when another patch is held, twice as much each time."""
LONGEST = 0.3
"""Longest step, as a share of the amplitude: a patch twice as large is another one."""
BEYOND = 1.2
"""Step over Newton's: mu' falls in steps, as nodes join, so that its own falls short."""
STALLED = 0.7
"""Share of mu' that must be left for a step to be doubled instead."""
PRECISE = 0.05
"""Residual stress over the gap that is asked for: what is left of it must not open the bounds."""
BELOW = 0.3
"""Distance of the load from the upper bound, over that gap: a state there closes the bracket."""


class Held(NamedTuple):
    """A held equilibrium, or a guess of one."""

    load: float
    amplitude: float  # a
    slip: Array  # d
    slope: Array  # d', <phi, d'> = 1
    force: float = 0.0  # mu
    slope_of_force: float = 0.0  # mu'
    force_by_load: float = 0.0  # d mu/d tau_0 at fixed a


def _hold(bracket: Bracket, held: Array, guess: Held, accuracy: float) -> Held | None:
    """Equilibrium with a patch phi held; None if another patch is unstable.

    The guess gives the amplitude at which the spring has no force; the accuracy is the largest
    residual stress as a share of the mean strength.
    """
    excess, profile, load, amplitude = (
        bracket.excess,
        bracket.profile,
        guess.load,
        guess.amplitude,
    )
    stiffness = 2.0 * float(bracket.operator.rate.max())  # no curvature is below -W
    operator = bracket.operator._replace(spring=stiffness, phi=held)
    slip = guess.slip.copy()
    inside = bracket.inside
    inside[:] = (slip > 0.0) | (excess < load * profile)
    right = load * profile - excess + (stiffness * amplitude) * held
    status, _ = equilibrate(
        operator, right, inside, slip, bracket.residual, accuracy * bracket.scale
    )
    if status != SOLVED:
        return None
    slope = np.where(inside, guess.slope, 0.0)
    share = inner(held, slope)
    if not share > 0.0:  # none of the patch slips any more
        return None
    slope *= 1.0 / (stiffness * share)
    residual_of(operator, held, slope, bracket.residual)
    # A lift of y by epsilon costs epsilon <s - tau_0 p, 1>/<p, y>.
    cost = float(np.abs(excess - load * profile).sum())
    tolerance = accuracy * stiffness * bracket.magnitude * inner(profile, slope) / cost
    status, _ = solve_inside(operator, inside, slope, bracket.residual, tolerance)
    if status != SOLVED:
        return None
    share = inner(held, slope)
    reached = inner(held, slip)
    return Held(
        load, reached, slip, slope / share, stiffness * (amplitude - reached),
        1.0 / share - stiffness, -inner(profile, slope) / share,
    )  # fmt: skip


def _other_patch(bracket: Bracket) -> Array | None:
    """The patch that became unstable beside the one that was held, unit norm; None if none did."""
    vector = np.where(bracket.inside, np.abs(bracket.operator.direction), 0.0)
    if not vector.any():
        return None
    value, _ = lowest_eigenvector(
        bracket.operator, bracket.inside, vector, 1e-3 * float(bracket.operator.rate.max()), 12
    )
    if value <= 0.0:
        bracket.raise_multiplier(vector)
    held: Array = np.maximum(vector, 0.0)
    return held / np.sqrt(inner(held, held))


def _load_at(state: Held, amplitude: float, curvature: float = 0.0) -> float:
    """Load at which the spring has no force at an amplitude, extrapolated from a state, Pa."""
    step = amplitude - state.amplitude
    force = state.force + (state.slope_of_force + 0.5 * curvature * step) * step
    return state.load - force / state.force_by_load


def _amplitude_between(below: Held, above: Held, turn: int) -> float:
    """Guess of the turning point between a state with mu' > 0 and one with mu' < 0."""
    if turn % 2 == 0:  # mu' is linear in a, as where many nodes join one after the other
        share = below.slope_of_force / (below.slope_of_force - above.slope_of_force)
    else:  # mu' has one step, as where a single node joins: where the two `_load_at` agree
        here, there = _load_at(below, below.amplitude), _load_at(above, below.amplitude)
        rise = below.slope_of_force / -below.force_by_load
        fall = above.slope_of_force / -above.force_by_load
        share = (there - here) / ((rise - fall) * (above.amplitude - below.amplitude))
        share = min(max(share, 0.0), 1.0)
    return below.amplitude + share * (above.amplitude - below.amplitude)


def _step_across(state: Held, step: float, last: float, curvature: float, moved: bool) -> float:
    """Step of the amplitude that is likely to change the sign of mu'.

    `step` and `last` are the step before and mu' before it. Since mu' falls in steps, as nodes
    join, it goes a little beyond Newton's, and twice as far as before if mu' hardly changed.
    """
    longest = LONGEST * state.amplitude
    if curvature >= 0.0:
        return float(np.copysign(longest / 3.0, state.slope_of_force))
    newton = -BEYOND * state.slope_of_force / curvature
    stalled = moved and state.slope_of_force / last > STALLED
    step = 2.0 * step if stalled and abs(newton) < 2.0 * abs(step) else newton
    return min(max(step, -longest), longest)


def close(
    bracket: Bracket,
    held: Array,
    load: float,
    slip: Array,
    gap: float,
    bend: float = 0.0,
) -> tuple[bool, float]:
    """Close a bracket by Newton's method on the turning point of a patch.

    If another patch turns out to be unstable, it is held instead. Load and slip are a guess;
    `bend` is the curvature a d mu'/da (Pa/m, negative) if it is known. Returns whether the bounds
    are within `gap` of the load, and the curvature found.
    """
    if bracket.closed(gap):
        return True, bend
    if (
        not slip.any() and not (bracket.excess < load * bracket.profile).any()
    ):  # nothing to hold
        load = 0.5 * (bracket.lower + bracket.upper)
    accuracy = PRECISE * gap
    first: Held | None = None
    below: Held | None = None  # mu' > 0, the one with the largest a
    above: Held | None = None
    guess = Held(load, inner(held, slip), slip, held)
    step = last = 0.0
    switches = idle = 0
    for turn in range(STEPS):
        state = _hold(bracket, held, guess, accuracy)
        if state is None:
            switches += 1
            other = _other_patch(bracket)
            if switches > SWITCHES or other is None:
                break
            held = other
            load = min(guess.load, bracket.upper)
            load -= RETREAT * 2.0 ** (switches - 1) * bracket.magnitude
            slip = slip if first is None else first.slip
            guess = Held(load, inner(held, slip), slip, held)
            first = below = above = None
            step = bend = 0.0
            continue
        before = bracket.gap
        bracket.raise_slip(state.slip)
        stable = state.slope_of_force > 0.0
        if stable:
            below = state
        else:
            above = state
            bracket.raise_multiplier(state.slope)
        if below is not None and above is not None:
            fall = -above.slope_of_force
            bracket.raise_multiplier(below.slope * fall + above.slope * below.slope_of_force)
        if bracket.closed(gap):
            return True, bend
        idle = idle + 1 if bracket.gap > PROGRESS * before else 0
        if idle > PATIENCE:
            break
        first = first or state
        moved = state.amplitude - first.amplitude
        curvature = bend / max(state.amplitude, 1e-300)
        if moved:
            curvature = (state.slope_of_force - first.slope_of_force) / moved
        if curvature < 0.0:
            bend = curvature * state.amplitude
        if below is not None and above is not None and below.amplitude < above.amplitude:
            amplitude = _amplitude_between(below, above, turn)
            step = amplitude - state.amplitude
            load = min(_load_at(below, amplitude), _load_at(above, amplitude))
        else:
            step = _step_across(state, step, last, curvature, bool(moved))
            load = _load_at(state, state.amplitude + step, min(curvature, 0.0))
        last = state.slope_of_force
        load = min(load, bracket.upper - BELOW * gap * bracket.magnitude)
        slip_there = np.maximum(state.slip + step * state.slope, 0.0)
        guess = Held(load, state.amplitude + step, slip_there, state.slope)
    return False, bend

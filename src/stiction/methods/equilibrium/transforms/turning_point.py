"""Find the turning point of the load, at which stable and unstable equilibria of a patch meet.

Problem
-------
Close the bracket (1) in `bracket`. A = K - diag(W), d is the slip, s is
the strength minus initial stress, and p is the load profile. A spring
holds a patch phi (|phi| = 1) at the amplitude a = <phi, d>, with a
force mu (`held_equilibrium`). On the slipping nodes

    A d = load p - s + mu phi,   A d' = mu' phi,  <phi, d'> = 1,     (1)

where a dash is the derivative with respect to a at a fixed load. The
interface without the spring is in equilibrium if mu = 0. Its load turns
if also mu' = 0. Find (load, a) with mu = mu' = 0.

Lower bound: if mu >= 0 at a load, d is feasible, and the load bounds
the onset from below. Upper bound: let y combine the slopes d' of two
states, with mu' > 0 and mu' < 0, so that A y = 0 at nodes that slip in
both. Then y is a multiplier, which bounds the onset from above. A node
that slips in only one state has A y <= 0, and hardly slips at the
turning point, so the error of this bound is of second order.

Algorithm
---------
The algorithm is our own: Newton's method for two equations. As nodes
join, mu' falls in steps.

1. Hold the patch at the guess (load, a), solve (1) for d and d'
   (`_hold`), and compute both bounds.
2. If conjugate gradients meet negative curvature although the patch is
   held, a different patch became unstable. Hold this patch instead, at
   a lower load.
3. As long as mu' had only one sign, change a by Newton's method, with a
   secant for the slope of mu'. Step slightly beyond the zero, so that
   the sign changes (`_step_across`).
4. With states of both signs, guess an a between these states,
   alternately as if mu' were linear in a and as if mu' had a single
   step (`_amplitude_between`).
5. Take as the next load the load at which the spring would have no
   force at the next a (`_load_at`), kept below the upper bound.
6. End if the bounds are close enough, or if successive states hardly
   narrow the bounds.

If the algorithm fails, `bracket.bisect` takes over, so no result
depends on the constants below.
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

MAX_STATES = 40
MAX_PATCH_CHANGES = 4
"""Most changes to another patch."""
MAX_IDLE_STATES = 8
"""States in a row that hardly narrow the gap, after which the search
ends."""
IDLE_GAP_SHARE = 0.95
"""Fraction of the gap that must remain for a state to count as idle."""
PATCH_CHANGE_RETREAT = 2e-3
"""Fraction by which the load is lowered when another patch is held,
twice as much each time."""
MAX_STEP = 0.3
"""Longest step, as a fraction of the amplitude. A longer step may reach
another patch."""
NEWTON_FACTOR = 1.2
"""Length of a step as a multiple of Newton's, which falls short because
mu' falls in steps."""
STALLED_SHARE = 0.7
"""Fraction of mu' that must remain after a step for the next step to be
twice as long instead."""
RESIDUAL_SHARE_OF_GAP = 0.05
"""Residual stress, relative to the requested gap, at which the residual
does not open the bounds."""
LOAD_BELOW_BOUND = 0.3
"""Distance of the load below the upper bound, as a fraction of the gap,
at which a state closes the gap."""
PATCH_EIGENVALUE_RTOL, MAX_PATCH_ITERATIONS = 1e-3, 12
"""Residual of the eigenvector of another patch, as a fraction of the
largest W, and iterations."""


class Held(NamedTuple):
    """A held equilibrium, or a guess."""

    load: float
    amplitude: float  # a
    slip: Array  # d
    slope: Array  # d', <phi, d'> = 1
    force: float = 0.0  # mu
    slope_of_force: float = 0.0  # mu'
    force_by_load: float = 0.0  # d mu/d tau_0 at fixed a


def _hold(bracket: Bracket, phi: Array, guess: Held, accuracy: float) -> Held | None:
    """Step 1: return the equilibrium with a held patch, or `None` if another patch is unstable.

    The guess gives the amplitude at which the
    spring has no force. The accuracy is the largest
    residual stress as a fraction of the mean strength.

    Eight nodes have K d = 8 d - D, with the sum D of d, and W = 5.5 Pa/m. A
    spring of 11 Pa/m holds three equally strong nodes at the mean slip 0.6 m.
    By (1), 1.8 - 2 + mu/sqrt(3) = (8 - 3 - 5.5) d, and mu' is -0.5 Pa/m:

    >>> K, excess = np.array([0.0, 8, 8, 8, 8]), np.array([2.0, 2, 2, 9, 9, 9, 9, 9])
    >>> bracket, phi = Bracket(K, 5.5, excess, np.ones(8)), (np.arange(8) < 3) / 3**0.5
    >>> guess = Held(1.8, 0.6 * 3**0.5, 0.5 * phi, phi)
    >>> held = _hold(bracket, phi, guess, 1e-9)
    >>> d = (11 * 0.6 + 1.8 - 2) / (11 - 0.5)
    >>> np.allclose(held.slip, [d, d, d, 0, 0, 0, 0, 0], atol=1e-6)
    True
    >>> root, (amplitude, _, slope, force, slope_of_force, by_load) = 3**0.5, held[1:]
    >>> np.allclose(slope, phi, atol=1e-6)
    True
    >>> round(slope_of_force, 6)
    -0.5
    >>> numbers = amplitude / root, force / root, by_load / root
    >>> np.allclose(numbers, [d, 11 * (0.6 - d), -1.0], atol=1e-6)
    True
    >>> _hold(bracket, np.eye(8)[0], guess._replace(slope=-phi), 1e-9) is None
    True
    """
    excess, profile = bracket.excess, bracket.profile
    load, amplitude = guess.load, guess.amplitude
    stiffness = 2.0 * float(bracket.operator.weakening_rate.max())  # no curvature is below -W
    operator = bracket.operator._replace(spring=stiffness, phi=phi)
    slip = guess.slip.copy()
    inside = bracket.inside
    inside[:] = (slip > 0.0) | (excess < load * profile)
    right = load * profile - excess + (stiffness * amplitude) * phi
    if equilibrate(operator, right, inside, slip, accuracy * bracket.scale) != SOLVED:
        return None
    slope = np.where(inside, guess.slope, 0.0)
    share = inner(phi, slope)
    if not share > 0.0:  # all nodes of the patch have stopped
        return None
    slope *= 1.0 / (stiffness * share)
    residual_of(operator, phi, slope, bracket.residual)
    # A lift of y by epsilon costs epsilon <s - tau_0 p, 1>/<p, y>.
    cost = float(np.abs(bracket.finite_excess - load * profile)[bracket.can_break].sum())
    tolerance = accuracy * stiffness * bracket.magnitude * inner(profile, slope) / cost
    status, _ = solve_inside(operator, inside, slope, bracket.residual, tolerance)
    if status != SOLVED:
        return None
    share = inner(phi, slope)
    reached = inner(phi, slip)
    return Held(
        load, reached, slip, slope / share, stiffness * (amplitude - reached),
        1.0 / share - stiffness, -inner(profile, slope) / share,
    )  # fmt: skip


def _other_patch(bracket: Bracket) -> Array | None:
    """Step 2: return the unstable patch (unit norm) next to the held patch, or `None`.

    Three nodes have the lowest eigenvector (1, 1, 1), whose bound is their mean strength:

    >>> K, excess = np.array([0.0, 8, 8, 8, 8]), np.array([1.0, 2, 3, 9, 9, 9, 9, 9])
    >>> bracket = Bracket(K, 5.5, excess, np.ones(8))
    >>> bracket.inside[:3], bracket.operator.direction[:] = True, [-1, 2, 3, 4, 0, 0, 0, 0]
    >>> np.abs(_other_patch(bracket)[:4]).round(3).tolist()
    [0.577, 0.577, 0.577, 0.0]
    >>> round(bracket.upper, 3)
    2.0
    >>> bracket.operator.direction[:] = 0.0
    >>> _other_patch(bracket) is None
    True
    """
    vector = np.where(bracket.inside, np.abs(bracket.operator.direction), 0.0)
    if not vector.any():
        return None
    tolerance = PATCH_EIGENVALUE_RTOL * float(bracket.operator.weakening_rate.max())
    most = MAX_PATCH_ITERATIONS
    if lowest_eigenvector(bracket.operator, bracket.inside, vector, tolerance, most) <= 0.0:
        bracket.raise_multiplier(vector)
    phi: Array = np.maximum(vector, 0.0)
    return phi / np.sqrt(inner(phi, phi))


def _load_at(state: Held, amplitude: float, curvature: float = 0.0) -> float:
    """Step 5: return the load (Pa) without spring force at an amplitude, from a state nearby.

    The force 3 + (0.5 - 0.5 x 2/2) x 2 Pa at a + 2 falls by 4 per load:

    >>> state = Held(10.0, 5.0, None, None, 3.0, 0.5, -4.0)
    >>> _load_at(state, 7.0)
    11.0
    >>> _load_at(state, 7.0, -0.5)
    10.75
    >>> _load_at(state, 5.0)
    10.75
    """
    step = amplitude - state.amplitude
    force = state.force + (state.slope_of_force + 0.5 * curvature * step) * step
    return state.load - force / state.force_by_load


def _amplitude_between(below: Held, above: Held, is_linear: bool) -> float:
    """Step 4: guess the turning point between states with mu' > 0 and mu' < 0.

    A linear mu' falls from 3 to -1 between a = 2 and 6, and is zero at three
    quarters. If mu' has a single step, the loads of both states agree there,
    unless the step lies beyond one of them:

    >>> below = Held(10.0, 2.0, None, None, 0.0, 3.0, -2.0)
    >>> above = Held(14.0, 6.0, None, None, 0.0, -1.0, -4.0)
    >>> _amplitude_between(below, above, True)
    5.0
    >>> a = _amplitude_between(below, above, False)
    >>> round(_load_at(below, a) - _load_at(above, a), 9)
    0.0
    >>> _amplitude_between(below, above._replace(load=30.0), False)
    6.0
    >>> _amplitude_between(below, above._replace(load=5.0), False)
    2.0
    """
    width = above.amplitude - below.amplitude
    if is_linear:  # mu' is linear in a, as where many nodes join one after the other
        share = below.slope_of_force / (below.slope_of_force - above.slope_of_force)
    else:  # mu' has a single step, as where a node joins: where the two `_load_at` agree
        load_below = _load_at(below, below.amplitude)
        load_above = _load_at(above, below.amplitude)
        rise = below.slope_of_force / -below.force_by_load
        fall = above.slope_of_force / -above.force_by_load
        share = (load_above - load_below) / ((rise - fall) * width)
        share = min(max(share, 0.0), 1.0)
    return below.amplitude + share * width


def _step_across(state: Held, step: float, last: float, curvature: float, moved: bool) -> float:
    """Step 3: return a step of the amplitude that is likely to change the sign of mu'.

    `step` is the previous step, and `last` is mu' before this step.
    Because mu' falls in steps as nodes join, the new step is slightly
    longer than Newton's. It is twice as long as the previous step if
    mu' hardly changed.

    mu' = 0.6 falls by 2 per amplitude. Newton's step is 0.3, and 1.2 times as
    long here. A step is at most 0.3 times the amplitude:

    >>> wide, narrow = (Held(1.0, a, None, None, 0.0, 0.6) for a in (9.0, 0.5))
    >>> [round(_step_across(state, 0.1, 1.0, -2.0, False), 6) for state in (wide, narrow)]
    [0.36, 0.15]

    If mu' fell from 0.8 to 0.6 only, the next step is twice as long as the
    last, unless Newton's is longer:

    >>> [round(_step_across(wide, step, 0.8, -2.0, True), 6) for step in (0.25, 0.15)]
    [0.5, 0.36]
    >>> round(_step_across(wide, 0.25, 0.9, -2.0, True), 6)
    0.36

    If mu' does not fall, the step is a third of the longest, forwards or back:

    >>> back = wide._replace(slope_of_force=-1.0)
    >>> [round(_step_across(state, 0.1, 1.0, 0.0, True), 6) for state in (wide, back)]
    [0.9, -0.9]
    """
    longest = MAX_STEP * state.amplitude
    if curvature >= 0.0:
        return float(np.copysign(longest / 3.0, state.slope_of_force))
    newton = -NEWTON_FACTOR * state.slope_of_force / curvature
    stalled = moved and state.slope_of_force / last > STALLED_SHARE
    step = 2.0 * step if stalled and abs(newton) < 2.0 * abs(step) else newton
    return min(max(step, -longest), longest)


def close_by_newton(
    bracket: Bracket, phi: Array, load: float, slip: Array, gap: float, bend: float = 0.0
) -> tuple[bool, float]:
    """Close a bracket by Newton's method on the turning point of a patch.

    If a different patch turns out to be unstable, the spring
    holds that patch. `load` and `slip` are first guesses.
    `bend` is the curvature a d mu'/da (Pa/m, negative) if it
    is known. Return whether the bounds are within `gap` of
    the load, and the curvature that was found.

    The onset of the example in `fold.follow_to_turn` is 1.8 Pa:

    >>> K, excess = np.array([0.0, 8, 8, 8, 8]), np.array([1.0, 2, 3, 9, 9, 9, 9, 9])
    >>> slip, phi = np.array([[0.7, 0.3, 0, 0, 0, 0, 0, 0], [2, 2, 1, 0, 0, 0, 0, 0]])
    >>> bracket = Bracket(K, 5.5, excess, np.ones(8))
    >>> closed, bend = close_by_newton(bracket, phi / 3.0, 1.75, slip, 1e-6)
    >>> closed
    True
    >>> round(bracket.lower, 4)
    1.8
    >>> round(bracket.upper, 4)
    1.8
    >>> bend < 0.0
    True
    >>> close_by_newton(bracket, phi, 1.75, slip, 1e-6, -4.0)  # closed already
    (True, -4.0)

    If node 5 is held, the patch of nodes 0 to 2 is unstable, and is held instead:

    >>> bracket = Bracket(K, 5.5, excess, np.ones(8))
    >>> close_by_newton(bracket, np.eye(8)[5], 1.9, slip, 1e-6)[0]
    True
    >>> round(bracket.upper, 4)
    1.8
    """
    if bracket.closed(gap):
        return True, bend
    some_slip = slip.any() or (bracket.excess < load * bracket.profile).any()
    if not some_slip:  # no patch to hold
        load = 0.5 * (bracket.lower + bracket.upper)
    accuracy = RESIDUAL_SHARE_OF_GAP * gap
    first: Held | None = None
    below: Held | None = None  # the last state with mu' > 0
    above: Held | None = None  # the last state with mu' <= 0
    guess = Held(load, inner(phi, slip), slip, phi)
    step = last_slope = 0.0
    patch_changes = idle_states = 0
    for number in range(MAX_STATES):
        # 1.
        state = _hold(bracket, phi, guess, accuracy)
        if state is None:  # 2.
            patch_changes += 1
            other_patch = _other_patch(bracket)
            if patch_changes > MAX_PATCH_CHANGES or other_patch is None:
                break
            # The other patch may have turned at this load already, so
            # begin below it.
            phi = other_patch
            load = min(guess.load, bracket.upper)
            load -= PATCH_CHANGE_RETREAT * 2.0 ** (patch_changes - 1) * bracket.magnitude
            slip = slip if first is None else first.slip
            guess = Held(load, inner(phi, slip), slip, phi)
            first = below = above = None
            step = bend = 0.0
            continue
        gap_before = bracket.gap
        bracket.raise_slip(state.slip)
        stable = state.slope_of_force > 0.0
        if stable:
            below = state
        else:
            above = state
            bracket.raise_multiplier(state.slope)
        if below is not None and above is not None:
            # With these weights the slopes mu' cancel, so A y = 0 where
            # both states slip.
            fall = -above.slope_of_force
            bracket.raise_multiplier(below.slope * fall + above.slope * below.slope_of_force)
        if bracket.closed(gap):
            return True, bend
        # 6.
        idle_states = idle_states + 1 if bracket.gap > IDLE_GAP_SHARE * gap_before else 0
        if idle_states > MAX_IDLE_STATES:
            break
        # A secant from the first state on, which smooths the steps of mu'.
        first = first or state
        moved = state.amplitude - first.amplitude
        curvature = bend / max(state.amplitude, 1e-300)
        if moved:
            curvature = (state.slope_of_force - first.slope_of_force) / moved
        if curvature < 0.0:
            bend = curvature * state.amplitude
        if below is not None and above is not None and below.amplitude < above.amplitude:
            # 4.
            amplitude = _amplitude_between(below, above, is_linear=number % 2 == 0)
            step = amplitude - state.amplitude
            load = min(_load_at(below, amplitude), _load_at(above, amplitude))
        else:
            # 3.
            step = _step_across(state, step, last_slope, curvature, bool(moved))
            load = _load_at(state, state.amplitude + step, min(curvature, 0.0))
        last_slope = state.slope_of_force
        # 5.
        load = min(load, bracket.upper - LOAD_BELOW_BOUND * gap * bracket.magnitude)
        slip_there = np.maximum(state.slip + step * state.slope, 0.0)
        guess = Held(load, state.amplitude + step, slip_there, state.slope)
    return False, bend

"""Press a slider, and push it: the two stages of its path.

Problem
-------
A `Rig` gives the stiffness K, and the forces T F and T_p N of the push F and the normal force N
(N/m). Both stages are paths of `path`. The load is N in the first, and the push in the second.

Algorithm
---------
The algorithm is our own (`press`, `begin_push`).

1. Pressing alone causes shear, because the two bodies expand differently. Each cell has the sign s
   of its shear T_p. With the slip s d, K becomes s K s. If no cell exceeds its strength and each
   edge is pressed, the forces are T_p N.
2. Otherwise begin at a small part of N. All strengths are zero without N. The nodes beyond their
   strength are on E, edges on top. Follow the path to N. Slip nearby may then load a cell against
   its sign beyond its strength. Change the sign of such cells, and press again.
3. Push. Slip in the push is positive. Slip of both stages in either direction adds up in the
   weakening. Edges that are open begin in S.
4. Instabilities and arrests alternate until the slider slides (`SliderPath.follow`). The first
   instability is the first of them during the push. Static friction is the largest force.
"""

from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.elasticity.rig import Rig, on_cells
from stiction.methods.equilibrium.contact.path import (
    LOAD,
    N_INSIDE,
    N_STACKED,
    PEAK,
    Contact,
    Motion,
    Status,
    follow,
)

FIRST_PRESSING = 1e-3
"""Fraction of the normal force at which a pressing that slips begins."""
REVERSE_RTOL = 1e-9
"""Excess of shear against the sign of a cell that is round-off, in mean normal forces of a cell."""
MIN_TURNING = 1e-6
"""Opening over slip of a slider that topples, in the motion that does not end."""


class Friction(NamedTuple):
    """Friction coefficients of the cells (n,), and the fall of their strength with slip, Pa."""

    peak: Array
    residual: Array
    weakening: Array


class Pressed(NamedTuple):
    """A slider after the pressing."""

    forces: Array  # (m,): shear force of cells, and tension of edges, N/m
    moved: Array  # (m,): slip with its sign, and opening, m
    friction: Friction  # the peak is the residual where it has been reached


def make_contact(
    K: Array, T: Array, friction: Friction, overstress: Array, moved: Array, relief: float = 0.0
) -> Contact:
    """Return a slider at rest, in which open edges are in S.

    `overstress` and `moved` are taken over. Where the strength is mu_r N, `friction.peak` must
    equal `friction.residual`. With a machine, the force falls by `relief` T'x (Pa).
    """
    n, m = len(friction.peak), len(moved)
    if relief > 0.0:
        K = K + relief * np.outer(T, T)
    columns, load, normal, normal_load = K.T.copy(), T.copy(), on_cells(K[n:]), on_cells(T[n:])
    difference = friction.peak - friction.residual
    weakening = np.where(difference > 0.0, friction.weakening, 0.0)
    columns[:, :n] += friction.peak * normal.T
    columns.flat[: n * (m + 1) : m + 1] -= weakening
    load[:n] += friction.peak * normal_load
    inverse, (inside, stack, motion) = np.empty((m, m)), np.zeros((3, m), np.int64)
    opened = n + np.flatnonzero(moved[n:] > 0.0)
    k = opened.size
    inverse[:k, :k] = np.linalg.inv(columns[np.ix_(opened, opened)].T)
    inside[:k], motion[opened] = opened, Motion.STABLE
    counts = np.zeros(4, np.int64)
    counts[N_INSIDE] = k
    return Contact(
        columns, load, relief * T, normal, normal_load, difference, weakening, overstress, moved,
        inverse, inside, stack, motion, counts, np.zeros(3), *np.empty((4, m)),
    )  # fmt: skip


def press(K: Array, T_p: Array, friction: Friction, force: float) -> Pressed:
    """Steps 1 and 2: return a slider under a normal force (N/m)."""
    linear, n = T_p * force, len(friction.peak)
    strength = friction.peak * on_cells(-linear[n:])
    if np.all(linear[n:] < 0.0) and np.all(np.abs(linear[:n]) < strength):
        return Pressed(linear, np.zeros_like(linear), friction)
    # 1. The same with slip along the shear.
    sign = np.where(linear < 0.0, -1.0, 1.0)
    sign[n:] = 1.0
    # 2. A sign may change once for each cell.
    for _ in range(n + 1):
        overstress = T_p * sign * (FIRST_PRESSING * force)
        overstress[:n] -= FIRST_PRESSING * strength
        moved = np.zeros_like(overstress)
        state = make_contact(K * sign * sign[:, None], T_p * sign, friction, overstress, moved)
        beyond = np.flatnonzero(overstress > 0.0)  # cells first, so that edges are on top
        state.stack[: beyond.size], state.motion[beyond] = beyond, Motion.UNSTABLE
        state.counts[N_STACKED], state.loads[LOAD] = beyond.size, FIRST_PRESSING * force
        while (status := follow(state, force)) in (Status.ARRESTED, Status.UNSTABLE):
            pass
        if status != Status.AT_TARGET:
            break
        forces = forces_of(state, friction)
        excess = overstress[:n] - 2.0 * forces[:n]  # of -f over the strength
        against = excess > REVERSE_RTOL * force / n
        if not against.any():
            present = friction._replace(peak=friction.residual + state.difference)
            return Pressed(forces * sign, moved * sign, present)
        sign[:n][against] *= -1.0
    raise InputError(
        "friction_coefficient: the slider does not come to rest while it is pressed. Check the"
        " coefficients and the weakening rate"
    )


def forces_of(state: Contact, friction: Friction) -> Array:
    """Return the shear force of each cell, and the tension of each edge (m,), N/m."""
    n, forces = len(friction.peak), state.overstress.copy()
    coefficient = friction.residual + state.difference
    forces[:n] += coefficient * on_cells(-forces[n:]) - state.weakening * state.moved[:n]
    return forces


def begin_push(K: Array, T: Array, start: Pressed, relief: float = 0.0) -> Contact:
    """Step 3: return the slider before the push. Its slip adds to the slip of the pressing."""
    peak, residual, weakening = start.friction
    moved, overstress, n = np.abs(start.moved), start.forces.copy(), len(peak)
    overstress[:n] -= peak * on_cells(-start.forces[n:])
    overstress[:n] += np.where(peak > residual, weakening * moved[:n], 0.0)
    return make_contact(K, T, start.friction, overstress, moved, relief)


class PushState(NamedTuple):
    """A slider under a load D and a force F (N/m), with arrays over cells, then edges (m,)."""

    load: float
    force: float
    moved: Array  # slip of the push, and opening, m
    forces: Array  # shear force, and tension of edges, N/m
    direction: Array  # (n,): rate of slip
    residual: bool  # whether a cell has reached its residual strength


class Push(NamedTuple):
    """The push of a sample until it slides. Without an instability, `first` is None.

    `last` is the last equilibrium, and `peak` the largest force (N/m). `events` holds the states
    before and after each. `known` is false if the path was not followed to its end.
    """

    first: PushState | None
    last: PushState
    peak: float
    events: list[tuple[PushState, PushState]]
    known: bool
    topples: bool


class SliderPath:
    """A slider on its path, which only goes on."""

    def __init__(self, rig: Rig, relief: float, friction: Friction, force: float) -> None:
        start = press(rig.K, rig.T_p, friction, force)
        self.contact = begin_push(rig.K, rig.T, start, relief)
        self.friction, self.before = friction, np.abs(start.moved)
        self.before[len(friction.peak) :] = 0.0

    def move(self, target: float = np.inf) -> int:
        """Go on to a load (N/m), an instability or an arrest. Return the `Status`."""
        return follow(self.contact, target)

    def state(self) -> PushState:
        """Return a copy of the present state."""
        contact, law = self.contact, self.friction
        direction = np.maximum(contact.rate[: len(law.peak)], 0.0)
        at_residual = bool(((contact.difference == 0.0) & (law.peak > law.residual)).any())
        moved, forces = contact.moved - self.before, forces_of(contact, law)
        load, force, _ = contact.loads.tolist()
        return PushState(load, force, moved, forces, direction, at_residual)

    def follow(self) -> Push:
        """Follow the path until the slider slides."""
        events, first = [], None
        while (status := self.move()) == Status.UNSTABLE:
            last = self.state()
            first = first or last
            if (status := self.move()) != Status.ARRESTED:
                break
            events.append((last, self.state()))
        unstable = self.contact.counts[N_STACKED] > 0  # otherwise it slides stably
        last = last if unstable else self.state()
        rate, n = np.abs(self.contact.rate), len(self.friction.peak)
        known = status == Status.SLIDING
        turns = bool(rate[n:].max() > MIN_TURNING * rate[:n].max())
        return Push(
            first,
            last,
            float(self.contact.loads[PEAK]),
            events,
            known,
            known and unstable and turns,
        )

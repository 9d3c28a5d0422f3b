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
   strength are on E, edges on top. Follow the path to N.
3. Push. Slip in the push is positive. Slip of both stages in either direction adds up in the
   weakening. Edges that are open begin in S.
4. Instabilities and arrests alternate until the slider slides (`solver.follow_push`). The first
   instability is the first of them during the push. Static friction is the largest force.
"""

from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.elasticity.rig import on_cells
from stiction.methods.equilibrium.contact.path import (
    N_INSIDE,
    N_STACKED,
    NOBODY,
    Contact,
    PathStop,
    Status,
    follow,
)

FIRST_PRESSING = 1e-3
"""Fraction of the normal force at which a pressing that slips begins."""


class Friction(NamedTuple):
    """Friction coefficients of the cells (n,), and the fall of their strength with slip, Pa."""

    peak: Array
    residual: Array
    weakening: Array


class Matrices(NamedTuple):
    """What the samples of a rig have in common. K may contain a machine."""

    transposed: Array  # (m, m): K'
    normal: Array  # (n, m): Q K_w
    forces: Array  # (m,): T
    relief: Array  # (m,): k' T


def make_matrices(K: Array, T: Array, relief: float = 0.0) -> Matrices:
    """Return the matrices of a rig whose force falls by `relief` T'x (Pa)."""
    n = len(T) // 2
    if relief > 0.0:
        K = K + relief * np.outer(T, T)
    return Matrices(np.ascontiguousarray(K.T), on_cells(K[n:]), T, relief * T)


def make_contact(rig: Matrices, friction: Friction, overstress: Array, moved: Array) -> Contact:
    """Return a slider at rest, in which open edges are in S.

    `overstress` and `moved` are taken over. Where the strength is mu_r N, `friction.peak` must
    equal `friction.residual`.
    """
    n, m = len(friction.peak), len(moved)
    difference = friction.peak - friction.residual
    weakening = np.where(difference > 0.0, friction.weakening, 0.0)
    columns, load, normal_load = (
        rig.transposed.copy(),
        rig.forces.copy(),
        on_cells(rig.forces[n:]),
    )
    columns[:, :n] += friction.peak * rig.normal.T
    columns.flat[: n * (m + 1) : m + 1] -= weakening
    load[:n] += friction.peak * normal_load
    inside, stack = np.zeros((2, m), np.int64)
    place, counts = np.full(m, NOBODY), np.zeros(4, np.int64)
    state = Contact(
        columns, load, rig.relief, rig.normal, normal_load, difference, weakening, overstress,
        moved, np.empty((m, m)), inside, place, stack, np.zeros(m, np.bool_), counts,
        *np.empty((4, m)),
    )  # fmt: skip
    opened = n + np.flatnonzero(moved[n:] > 0.0)
    if opened.size:
        block = columns[np.ix_(opened, opened)].T
        state.inverse[: opened.size, : opened.size] = np.linalg.inv(block)
        state.inside[: opened.size] = opened
        place[opened] = np.arange(opened.size)
        state.counts[N_INSIDE] = opened.size
    return state


class Pressed(NamedTuple):
    """A slider after the pressing."""

    forces: Array  # (m,): shear force of cells, and tension of edges, N/m
    moved: Array  # (m,): slip with its sign, and opening, m
    friction: Friction  # the peak is the residual where it has been reached


def press(rig: Matrices, friction: Friction, force: float) -> Pressed:
    """Steps 1 and 2: return a slider under a normal force (N/m). `rig.forces` is T_p."""
    linear, n = rig.forces * force, len(friction.peak)
    strength = friction.peak * on_cells(-linear[n:])
    if np.all(linear[n:] < 0.0) and np.all(np.abs(linear[:n]) < strength):
        return Pressed(linear, np.zeros_like(linear), friction)
    # 1. The same with slip along the shear.
    sign = np.where(linear < 0.0, -1.0, 1.0)
    sign[n:] = 1.0
    along = Matrices(
        rig.transposed * sign * sign[:, None], rig.normal * sign, rig.forces * sign, rig.relief
    )
    # 2.
    first = FIRST_PRESSING * force
    overstress = along.forces * first
    overstress[:n] -= FIRST_PRESSING * strength
    state = make_contact(along, friction, overstress, np.zeros_like(overstress))
    beyond = np.flatnonzero(overstress > 0.0)  # cells first, so that edges are on top
    state.stack[: beyond.size], state.stacked[beyond] = beyond, True
    state.counts[N_STACKED] = beyond.size
    stop = PathStop(first, 0.0, 0.0, Status.ARRESTED)
    while stop.status in (Status.ARRESTED, Status.UNSTABLE):
        stop = follow(state, stop.load, 0.0, 0.0, force)
    if stop.status != Status.AT_TARGET:
        raise InputError(
            "friction_coefficient: the slider does not come to rest while it is pressed. Check the"
            " coefficients and the weakening rate"
        )
    present = friction._replace(peak=friction.residual + state.difference)
    return Pressed(forces_of(state, friction) * sign, state.moved * sign, present)


def forces_of(state: Contact, friction: Friction) -> Array:
    """Return the shear force of each cell, and the tension of each edge (m,), N/m."""
    n, forces = len(friction.peak), state.overstress.copy()
    coefficient = friction.residual + state.difference
    forces[:n] += coefficient * on_cells(-forces[n:]) - state.weakening * state.moved[:n]
    return forces


def begin_push(rig: Matrices, start: Pressed) -> Contact:
    """Step 3: return the slider before the push. Its slip adds to the slip of the pressing."""
    peak, residual, weakening = start.friction
    moved, overstress, n = np.abs(start.moved), start.forces.copy(), len(peak)
    overstress[:n] -= peak * on_cells(-start.forces[n:])
    overstress[:n] += np.where(peak > residual, weakening * moved[:n], 0.0)
    return make_contact(rig, start.friction, overstress, moved)

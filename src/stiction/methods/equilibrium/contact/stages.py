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
2. Otherwise begin at a small share of N. All strengths are zero without N. The nodes beyond their
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
from stiction.methods.equilibrium.contact import path
from stiction.methods.equilibrium.contact.path import (
    N_INSIDE,
    N_STACKED,
    NOBODY,
    Contact,
    Status,
    follow,
)

FIRST_PRESSING = 1e-3
"""Share of the normal force at which a pressing that slips begins."""


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


def averages(edges: Array) -> Array:
    """Return Q P along the first axis: (n + 1, ...) on edges to (n, ...) on cells."""
    cells = 0.5 * (edges[:-1] + edges[1:])
    cells[0] += 0.5 * edges[0]
    cells[-1] += 0.5 * edges[-1]
    return np.asarray(cells)


def make_matrices(K: Array, T: Array, relief: float = 0.0) -> Matrices:
    """Return the matrices of a rig whose force falls by `relief` T'x (Pa)."""
    n = len(T) // 2
    if relief > 0.0:
        K = K + relief * np.outer(T, T)
    return Matrices(np.ascontiguousarray(K.T), averages(K[n:]), T, relief * T)


def make_contact(rig: Matrices, friction: Friction, overstress: Array, moved: Array) -> Contact:
    """Return a slider at rest, in which open edges are in S.

    `overstress` and `moved` are taken over. Where the strength is mu_r N, `friction.peak` must
    equal `friction.residual`.
    """
    n, m = len(friction.peak), len(moved)
    columns = rig.transposed.copy()
    columns[:, :n] += friction.peak * rig.normal.T
    falling = friction.peak > friction.residual
    weakening = np.where(falling, friction.weakening, 0.0)
    columns.flat[: n * (m + 1) : m + 1] -= weakening
    normal_load = averages(rig.forces[n:])
    load = rig.forces.copy()
    load[:n] += friction.peak * normal_load
    difference = friction.peak - friction.residual
    integers = np.zeros((3, m), np.int64)
    place = np.full(m, NOBODY)
    state = Contact(
        columns, load, rig.relief, rig.normal, normal_load, difference, weakening,
        overstress, moved, np.empty((m, m)), integers[0], place, integers[1],
        np.zeros(m, np.bool_), integers[2], np.zeros(5, np.int64), *np.empty((4, m)),
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
    """A slider after the pressing: forces of cells and edges (m,), slip and opening (m,)."""

    forces: Array  # shear force, and tension of edges, N/m
    moved: Array  # slip with its sign, and opening, m


def press(rig: Matrices, friction: Friction, force: float) -> Pressed:
    """Steps 1 and 2: return a slider under a normal force (N/m). `rig.forces` is T_p."""
    n = len(friction.peak)
    linear = rig.forces * force
    pressure = averages(-linear[n:])
    if np.all(linear[n:] < 0.0) and np.all(np.abs(linear[:n]) < friction.peak * pressure):
        return Pressed(linear, np.zeros_like(linear))
    # 1. The same with slip along the shear.
    sign = np.ones(len(linear))
    sign[:n] = np.where(linear[:n] < 0.0, -1.0, 1.0)
    along = Matrices(
        rig.transposed * sign * sign[:, None], rig.normal * sign, rig.forces * sign, rig.relief
    )
    # 2.
    first = FIRST_PRESSING * force
    overstress = along.forces * first
    overstress[:n] += friction.peak * averages(overstress[n:])
    state = make_contact(along, friction, overstress, np.zeros_like(overstress))
    beyond = np.flatnonzero(overstress > 0.0)  # cells first, so that edges are on top
    state.stack[: beyond.size] = beyond
    state.stacked[beyond] = True
    state.counts[N_STACKED] = beyond.size
    stop = path.PathStop(first, 0.0, 0.0, Status.ARRESTED)
    while stop.status in (Status.ARRESTED, Status.UNSTABLE):
        stop = follow(state, stop.load, 0.0, 0.0, force)
    if stop.status != Status.AT_TARGET:
        raise InputError(
            "friction_coefficient: the slider does not come to rest while it is pressed. Check the"
            " coefficients and the weakening rate"
        )
    forces = state.overstress.copy()
    strength = strengths(friction, state)
    forces[:n] += strength
    return Pressed(forces * sign, state.moved * sign)


def strengths(friction: Friction, state: Contact) -> Array:
    """Return the strength of each cell, N/m."""
    n = len(friction.peak)
    coefficient = friction.residual + state.difference
    return coefficient * averages(-state.overstress[n:]) - state.weakening * state.moved[:n]


def begin_push(rig: Matrices, friction: Friction, start: Pressed) -> Contact:
    """Step 3: return the slider before the push. Its slip adds to the slip of the pressing."""
    n = len(friction.peak)
    moved = np.abs(start.moved)
    pressure = averages(-start.forces[n:])
    # Cells that have passed their corner have the residual coefficient.
    above = (friction.peak - friction.residual) * pressure - friction.weakening * moved[:n]
    at_residual = (above <= 1e-12 * friction.peak * pressure) & (moved[:n] > 0.0)
    peak = np.where(at_residual, friction.residual, friction.peak)
    present = friction._replace(peak=peak)
    overstress = start.forces.copy()
    falls = np.where(at_residual, 0.0, friction.weakening)
    overstress[:n] -= peak * pressure - falls * moved[:n]
    return make_contact(rig, present, overstress, moved)

"""Waves in a block, with friction on its interface: central differences in time, row by row.

Everything is counted from a static state. In the upper block u is half of the slip at y = 0; the
lower one is its mirror image, so that no normal stress changes there. A node of the interface
slips at the rate that its strength leaves, and rests where that would be negative.
"""

from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.jit import jit_allocating, jit_inside
from stiction.methods.dynamics.mesh import Mesh
from stiction.methods.equilibrium.sample import StaticSample, strength_at


class Waves(NamedTuple):
    """Where a block is, and how fast. Single precision is enough for differences.

    The displacements u and v come with the viscous time times their rates: elements only need
    this sum.
    """

    u: Array
    v: Array
    u_rate: Array
    v_rate: Array
    """(rows, nodes), m and m/s."""
    slip: Array
    slip_rate: Array
    stress: Array
    """Of the interface, (nodes,); stress is counted from the initial one."""
    corrected: Array
    """Stress of the static correction, (nodes,), Pa."""
    arrival: Array
    """Time at which the front arrives, (nodes,), s."""
    now: Array
    """As named by `NOW`."""


NOW = ("time", "travel", "speed", "force", "friction")
"""Time (s), travel (m) and speed of one drive, change of its force (N/m), and what friction took
from one block (J/m)."""
TIME, TRAVEL, SPEED, FORCE, FRICTION = range(5)


def at_rest(mesh: Mesh, slip: Array) -> Waves:
    """Return a block at rest whose interface has a slip, m."""
    u, v, u_rate, v_rate = np.zeros((4, mesh.heights.size, slip.size), np.float32)
    slip_rate, stress, corrected = np.zeros((3, slip.size))
    arrival = np.full(slip.size, np.nan)
    return Waves(
        u, v, u_rate, v_rate, slip.copy(), slip_rate, stress, corrected, arrival,
        np.zeros(len(NOW)),
    )  # fmt: skip


@jit_inside
def _difference(values: Any, result: Any) -> None:
    """Write the differences of neighbours, beside a zero at each end."""
    for i in range(values.shape[0] - 1):
        result[i + 1] = values[i + 1] - values[i]


@jit_inside
def _sum(values: Any, result: Any) -> None:
    """Write the sums of neighbours, beside a zero at each end."""
    for i in range(values.shape[0] - 1):
        result[i + 1] = values[i + 1] + values[i]


@jit_inside
def _combine(
    stencil: Any, x0: Any, x1: Any, x2: Any, y0: Any, y1: Any, y2: Any, result: Any
) -> None:
    """Add up two fields of the rows below, here and above: one result a loop is fastest."""
    a, b, c = stencil[0], stencil[1], stencil[2]
    d, e, f = stencil[3], stencil[4], stencil[5]
    for i in range(result.shape[0]):
        result[i] = (a * x0[i] + b * x1[i] + c * x2[i]) + (d * y0[i] + e * y1[i] + f * y2[i])


@jit_inside
def _force(along: Any, across: Any, force: Any) -> None:
    """Write the forces of the elements on the nodes of a row."""
    for i in range(force.shape[0]):
        force[i] = (along[i + 1] - along[i]) + (across[i + 1] + across[i])


@jit_inside
def _add_strips(stiffness: Any, row: int, values: Any, carried: Any, force: Any) -> None:
    """Add the forces of the half cells beyond the outer columns."""
    last = force.shape[0] - 1
    for side, i in ((0, 0), (1, last)):
        force[i] -= carried[side]
        if row < stiffness.shape[0]:
            carried[side] = stiffness[row] * (values[row + 1, i] - values[row, i])
            force[i] += carried[side]


@jit_inside
def _move(w: Any, rate: Any, force: Any, keep: Any, gain: Any, step: Any, lag: Any) -> None:
    """Move a row of nodes by one step."""
    for i in range(w.shape[0]):
        before = rate[i]
        after = keep * before + gain * force[i]
        w[i] += step * after + lag * (after - before)
        rate[i] = after


@jit_inside
def _slide(
    sample: StaticSample,
    start: Array,
    front: Array,
    mesh: Mesh,
    waves: Waves,
    force: Any,
    keep: float,
    gain: float,
) -> int:
    """Move the nodes of the interface; returns how many never slipped."""
    dx, step = mesh.spacing, mesh.step
    slip, rates, u, now = waves.slip, waves.u_rate[0], waves.u[0], waves.now
    never = 0
    for i in range(slip.shape[0]):
        before = np.float64(rates[i])
        strength = strength_at(sample, slip, i)
        free = keep * before + gain * (force[i] + dx * (start[i] - waves.corrected[i]))
        after = free - gain * dx * strength
        if after > 0.0:
            waves.stress[i] = strength
        else:
            after = 0.0
            waves.stress[i] = free / (gain * dx)
        added = 2.0 * step * after
        if slip[i] < front[i] <= slip[i] + added:
            waves.arrival[i] = now[TIME] + step * (front[i] - slip[i]) / added
        slip[i] += added
        waves.slip_rate[i] = 2.0 * after
        now[FRICTION] += 0.5 * dx * step * waves.stress[i] * (before + after)
        u[i] += np.float32(step * after + mesh.viscous_time * (after - before))
        rates[i] = np.float32(after)
        never += slip[i] == 0.0
    for j in range(slip.shape[0]):
        added = step * waves.slip_rate[j]
        if added > 0.0:
            column = mesh.correction[j]
            for i in range(slip.shape[0]):
                waves.corrected[i] += added * column[i]
    return never


@jit_inside
def _move_platen(mesh: Mesh, waves: Waves, force: Any) -> None:
    """Move the top with its platen, behind a spring that is half implicit, or hold it."""
    now, top, step = waves.now, waves.u.shape[0] - 1, mesh.step
    total = 0.0
    for i in range(force.shape[0]):
        total += force[i]
    before = now[SPEED]
    if mesh.stiffness == np.inf:
        now[FORCE] = -total
        return
    own = force.shape[0] * mesh.mass[top]
    inert = (own + mesh.drive_mass) / step + 0.5 * mesh.stiffness * step
    lost = 0.5 * mesh.attenuation * own
    total -= mesh.stiffness * now[TRAVEL]
    after = ((inert - lost) * before + total) / (inert + lost)
    now[SPEED] = after
    now[TRAVEL] += step * after
    now[FORCE] = -mesh.stiffness * now[TRAVEL]
    w, rate = np.float32(now[TRAVEL] + mesh.viscous_time * after), np.float32(after)
    for i in range(force.shape[0]):
        waves.u[top, i] = w
        waves.u_rate[top, i] = rate


@jit_inside
def _move_pusher(mesh: Mesh, waves: Waves, gains: Array) -> None:
    """Let the pusher act on the block, behind a spring that is half implicit, or hold it."""
    now, step, last = waves.now, mesh.step, waves.u.shape[1] - 1
    ease = speed = 0.0
    for j in range(gains.shape[0]):
        for side, i in ((0, 0), (1, last)):
            ease += mesh.push[j, side] ** 2 * gains[j]
            speed += mesh.push[j, side] * waves.u_rate[j, i]
    before = now[SPEED]
    if mesh.stiffness == np.inf:
        force = -speed / ease
    else:
        a = 0.5 * mesh.stiffness * step + mesh.drive_mass / step
        force = -(mesh.stiffness * now[TRAVEL] + a * (speed - before)) / (1.0 + a * ease)
    now[SPEED] = speed + ease * force
    now[TRAVEL] += step * now[SPEED]
    now[FORCE] = force if mesh.stiffness == np.inf else -mesh.stiffness * now[TRAVEL]
    if force == 0.0:
        return
    for j in range(gains.shape[0]):
        for side, i in ((0, 0), (1, last)):
            more = mesh.push[j, side] * gains[j] * force
            waves.u_rate[j, i] += np.float32(more)
            waves.u[j, i] += np.float32((step + mesh.viscous_time) * more)


@jit_allocating
def follow(
    sample: StaticSample, start: Array, front: Array, mesh: Mesh, waves: Waves, steps: int,
    ends: bool,
) -> int:  # fmt: skip
    """Take so many steps, or `ends` once all nodes have slipped; returns how many were taken.

    `start` (Pa) is the stress of the static state less the initial stress; `front` (m) is the
    slip with which the front arrives at a node.
    """
    rows, n = waves.u.shape
    step, lag = np.float32(mesh.step), np.float32(mesh.viscous_time)
    half = 0.5 * mesh.attenuation * mesh.step
    keep = (1.0 - half) / (1.0 + half)
    gains = mesh.step / ((1.0 + half) * mesh.mass)
    du, mu, dv, mv = np.zeros((4, 3, n + 1), np.float32)
    along, across = np.zeros((2, n + 1), np.float32)
    force, carried = np.zeros(n, np.float32), np.zeros((2, 2), np.float32)
    u, v, u_rate, v_rate = waves.u, waves.v, waves.u_rate, waves.v_rate
    for taken in range(steps):
        never = n
        carried[:] = np.float32(0.0)
        _difference(u[0], du[0])
        _sum(u[0], mu[0])
        _difference(v[0], dv[0])
        _sum(v[0], mv[0])
        for j in range(rows):
            below, here, above = (j + 2) % 3, j % 3, (j + 1) % 3
            if j < rows - 1:  # beyond the top and the interface stencils are zero
                _difference(u[j + 1], du[above])
                _sum(u[j + 1], mu[above])
                _difference(v[j + 1], dv[above])
                _sum(v[j + 1], mv[above])
            gain = np.float32(gains[j])
            if not mesh.anti_plane and j < rows - 1:
                _combine(
                    mesh.stencils[j, 2], dv[below], dv[here], dv[above],
                    mu[below], mu[here], mu[above], along,
                )  # fmt: skip
                _combine(
                    mesh.stencils[j, 3], mv[below], mv[here], mv[above],
                    du[below], du[here], du[above], across,
                )  # fmt: skip
                _force(along, across, force)
                _add_strips(mesh.layers.strip_v, j, v, carried[1], force)
                _move(v[j], v_rate[j], force, np.float32(keep), gain, step, lag)
            _combine(
                mesh.stencils[j, 0], du[below], du[here], du[above],
                mv[below], mv[here], mv[above], along,
            )  # fmt: skip
            _combine(
                mesh.stencils[j, 1], mu[below], mu[here], mu[above],
                dv[below], dv[here], dv[above], across,
            )  # fmt: skip
            _force(along, across, force)
            _add_strips(mesh.layers.strip_u, j, u, carried[0], force)
            if j == 0:
                never = _slide(sample, start, front, mesh, waves, force, keep, gains[0])
            elif j == rows - 1 and mesh.platen:
                _move_platen(mesh, waves, force)
            else:
                _move(u[j], u_rate[j], force, np.float32(keep), gain, step, lag)
        if not mesh.platen:
            _move_pusher(mesh, waves, gains)
        waves.now[TIME] += mesh.step
        if ends and never == 0:
            return taken + 1
    return steps

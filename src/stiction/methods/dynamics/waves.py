"""Waves in a block with friction on its interface, by central differences, row by row.

Problem
-------
Solve M u'' + M alpha u' + K (u + theta u') = forces for the block of
`mesh`, starting from a static state. M are the masses, alpha the
attenuation (`Mesh.attenuation`) and theta the viscous time of the grid
(`Mesh.viscous_time`). Displacements are counted from the static state.
In the upper block u is half the slip at y = 0. The lower block is its
mirror image, so the normal stress does not change.

Algorithm (`wave_steps`)
------------------------
Leapfrog, with friction at split nodes (D. J. Andrews, Bulletin of the
Seismological Society of America 89, 1999). Velocities are known in the
middle of a step of size h, displacements at its end, and attenuation is
semi-implicit. With a = alpha h/2 and w = u + theta u', each step
processes the rows:

1. Compute the forces F on the row from its elements (`_force`). They
   depend on w alone, so only w is stored.
2. Move the row: u' <- ((1 - a) u' + h F/M)/(1 + a) and w <- w + (h +
   theta) u' - theta (u' before) (`_move`).
3. Move the interface in the same way, with friction
   (`_slide`): a node slips at the rate at which its stress
   equals its strength, and rests if this rate would be
   negative. `Mesh.correction`, the K of the closed form minus
   the K of the mesh, acts on the slip of the interface.
4. Move the top with its platen (`_move_platen`), or let the pusher act
   on the ends (`_move_pusher`). The spring of the machine is
   semi-implicit. An infinitely stiff machine does not move.

The force on row j + 1 needs row j before it moves, so the force on a
row is computed before the row below it moves.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit_allocating, jit_inside
from stiction.methods.dynamics.mesh import Mesh
from stiction.methods.dynamics.state import PULSE_SHARE, record
from stiction.methods.equilibrium.strength import StaticSample, strength_at


class Waves(NamedTuple):
    """The displacements and velocities of a block.

    Single precision is enough, because displacements are counted from
    the static state. u and v are the sums w (displacement plus viscous
    time times rate) that the elements need.
    """

    u: Array
    v: Array
    u_rate: Array
    v_rate: Array
    """(rows, nodes), m and m/s."""
    slip: Array
    slip_rate: Array
    stress: Array
    """Slip, slip rate and stress of the interface, (nodes,). Stress is
    counted from the initial stress."""
    corrected: Array
    """Stress of the static correction, (nodes,), Pa."""
    arrival: Array
    """Time at which the front arrives, (nodes,), s."""
    totals: NDArray[Any]
    """(1,) array of `TOTALS`."""

    @property
    def now(self) -> Any:
        """Totals, by name."""
        return self.totals[0]


TOTALS = record(
    "time travel speed force friction fast_slip_rate peak_rate fast_since fast_until", "fast"
)
"""Totals of an event so far.

- `time`, s
- `travel` of the drive of a block, m
- `speed` of this drive, m/s
- `force`: change of the force of this drive, N/m
- `friction`: energy that friction took from a block, J/m
- `fast_slip_rate`: slip rate that counts as fast, m/s
- `peak_rate`: largest sum of the rates of all nodes while slip was fast,
  m/s
- `fast`: whether slip was fast, as in `diagnostics`
- `fast_since`, `fast_until`: when slip was fast first and last, s
"""


def block_at_rest(mesh: Mesh, slip: Array) -> Waves:
    """Return a block at rest whose interface has a given slip (m).

    >>> from types import SimpleNamespace
    >>> slip = np.array([1.0, 2.0, 5.0])
    >>> waves = block_at_rest(SimpleNamespace(heights=np.zeros(4)), slip)
    >>> waves.u.shape, waves.u.dtype.name, waves.slip.tolist(), waves.slip is slip
    ((4, 3), 'float32', [1.0, 2.0, 5.0], False)
    >>> waves.arrival.tolist(), float(waves.now["time"]), waves.stress.tolist()
    ([nan, nan, nan], 0.0, [0.0, 0.0, 0.0])
    """
    u, v, u_rate, v_rate = np.zeros((4, mesh.heights.size, slip.size), np.float32)
    rate, stress, corrected = np.zeros((3, slip.size))
    arrival, totals = np.full(slip.size, np.nan), np.zeros(1, TOTALS)
    return Waves(u, v, u_rate, v_rate, slip.copy(), rate, stress, corrected, arrival, totals)


@jit_inside
def _force(stencil: Any, x0: Any, x1: Any, x2: Any, y0: Any, y1: Any, y2: Any, F: Any) -> None:
    """Step 1: write the force on a row along an axis.

    x0, x1 and x2 are the displacements along the axis in the row below,
    the row, and the row above. y0, y1 and y2 are the other components.

    A unit displacement along the axis at node 1 of the row acts with the
    coefficients 2 and 5. One across the axis acts with 8, and at the ends
    with 14. The rows below and above have other coefficients.

    >>> stencil, zero = np.arange(1.0, 16.0).reshape(5, 3), np.zeros(4)
    >>> rows, F = np.eye(4), np.zeros(4)
    >>> for row, node in ((1, 1), (0, 0), (2, 3), (3, 1), (4, 1), (4, 0), (5, 3)):
    ...     fields = [rows[node] if place == row else zero for place in range(6)]
    ...     _force.py_func(stencil, *fields, F)
    ...     print(F.tolist())
    [2.0, 5.0, 2.0, 0.0]
    [10.0, 1.0, 0.0, 0.0]
    [0.0, 0.0, 3.0, 12.0]
    [7.0, 0.0, -7.0, 0.0]
    [8.0, 0.0, -8.0, 0.0]
    [14.0, -8.0, 0.0, 0.0]
    [0.0, 0.0, 9.0, -15.0]
    """
    n = F.shape[0]
    # Coefficients in registers: of both neighbours, of the node, and of
    # the other component.
    a, b, c = stencil[0, 0], stencil[0, 1], stencil[0, 2]
    d, e, f = stencil[1, 0], stencil[1, 1], stencil[1, 2]
    g, h, k = stencil[2, 0], stencil[2, 1], stencil[2, 2]
    for i in range(n - 2):  # a single loop without branches, so that it is vectorised
        F[i + 1] = (
            (a * (x0[i] + x0[i + 2]) + b * (x1[i] + x1[i + 2]) + c * (x2[i] + x2[i + 2]))
            + (d * x0[i + 1] + e * x1[i + 1] + f * x2[i + 1])
            + (g * (y0[i + 2] - y0[i]) + h * (y1[i + 2] - y1[i]) + k * (y2[i + 2] - y2[i]))
        )
    # The end nodes have a single neighbour, and a strip beyond them.
    for i, inner, sign in ((0, 1, np.float32(1.0)), (n - 1, n - 2, np.float32(-1.0))):
        from_x = a * x0[inner] + b * x1[inner] + c * x2[inner]
        from_x += stencil[3, 0] * x0[i] + stencil[3, 1] * x1[i] + stencil[3, 2] * x2[i]
        from_y = g * y0[inner] + h * y1[inner] + k * y2[inner]
        from_y += stencil[4, 0] * y0[i] + stencil[4, 1] * y1[i] + stencil[4, 2] * y2[i]
        F[i] = from_x + sign * from_y


@jit_inside
def _move(w: Any, velocity: Any, force: Any, keep: Any, gain: Any, step: Any, lag: Any) -> None:
    """Step 2: move a row of nodes by a step. `lag` is the viscous time.

    The velocity 3 becomes 0.5 * 3 + 2 * 4 = 9.5. The displacement with the
    viscous time grows by 0.15 * 9.5 - 0.05 * 3.

    >>> w, velocity = np.array([1.0, 0.0]), np.array([3.0, 0.0])
    >>> _move.py_func(w, velocity, np.array([4.0, -1.0]), 0.5, 2.0, 0.1, 0.05)
    >>> w.round(9).tolist(), velocity.tolist()
    ([2.275, -0.3], [9.5, -2.0])
    """
    for i in range(w.shape[0]):
        before = velocity[i]
        after = keep * before + gain * force[i]
        # w = u + theta u' grows by h u' and by theta times the change of u'.
        w[i] += (step + lag) * after - lag * before
        velocity[i] = after


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
    """Step 3: move the nodes of the interface.

    Return the number of nodes that never slipped.

    Node 1 would move at 0.9 * 0.2 + 0.5 * (1 + 0.5 * 3) m/s without friction.
    Its strength, 2 Pa, leaves 0.93 m/s. Node 0 sticks, and node 2 stops.

    >>> from types import FunctionType, SimpleNamespace
    >>> strength = {"strength_at": lambda sample, slip, i: (9.0, 2.0, 5.0)[i]}
    >>> plain = FunctionType(_slide.py_func.__code__, globals() | strength)
    >>> mesh = SimpleNamespace(spacing=0.5, step=0.1, viscous_time=0.02)
    >>> mesh.correction = np.array(
    ...     [[8.0, 8.0, 8.0], [1.0, 2.0, 4.0], [9.0, 9.0, 9.0]]
    ... )
    >>> waves = SimpleNamespace(
    ...     slip=np.array([0.0, 0.1, 0.5]),
    ...     slip_rate=np.full(3, 7.0),
    ...     stress=np.zeros(3),
    ...     corrected=np.array([1.0, 1.0, 2.0]),
    ...     arrival=np.full(3, np.nan),
    ...     u=np.zeros((2, 3)),
    ...     u_rate=np.array([[0.0, 0.2, 0.4]]),
    ...     totals=np.zeros(1, TOTALS).view(np.recarray),
    ... )
    >>> now = waves.totals[0]
    >>> now.time, now.fast_slip_rate = 5.0, 1.5
    >>> start, front, force = (
    ...     np.array([4.0, 4.0, 1.0]),
    ...     np.full(3, 0.2),
    ...     np.array([-1.0, 1.0, 0.0]),
    ... )
    >>> int(
    ...     plain(None, start, front, mesh, waves, force, 0.9, 0.5)
    ... )  # a node that never slipped
    1
    >>> waves.slip.round(6).tolist(), waves.slip_rate.round(6).tolist()
    ([0.0, 0.286, 0.5], [0.0, 1.86, 0.0])
    >>> waves.stress.round(6).tolist()
    [1.0, 2.0, 0.44]
    >>> waves.arrival.round(6).tolist()  # 5 + 0.1 * 0.1/0.186
    [nan, 5.053763, nan]
    >>> waves.u[0].round(6).tolist(), waves.u_rate[0].round(6).tolist()
    ([0.0, 0.1076, -0.008], [0.0, 0.93, 0.0])
    >>> (
    ...     waves.corrected.round(6).tolist(),
    ...     round(float(now.friction), 6),
    ... )  # 0.0565 + 0.0044
    ([1.186, 1.372, 2.744], 0.0609)
    >>> [
    ...     round(float(now[name]), 6)
    ...     for name in ("peak_rate", "fast_since", "fast_until", "fast")
    ... ]
    [1.86, 5.0, 5.0, 1.0]
    """
    dx, step = mesh.spacing, mesh.step
    slip, velocities, u, now = waves.slip, waves.u_rate[0], waves.u[0], waves.totals[0]
    never, fast, total = 0, False, 0.0
    for i in range(slip.shape[0]):
        # In double precision, since slip adds up many small increments.
        before = np.float64(velocities[i])
        strength = strength_at(sample, slip, i)
        # The velocity without friction, and with friction at the
        # strength of the node.
        free = keep * before + gain * (force[i] + dx * (start[i] - waves.corrected[i]))
        after = free - gain * dx * strength
        if after > 0.0:
            waves.stress[i] = strength
        else:
            # The node sticks. Its stress is the friction that just stops it.
            after = 0.0
            waves.stress[i] = free / (gain * dx)
        added = 2.0 * step * after  # both blocks move
        # Slip grows evenly within the step,
        # so interpolate the time of arrival.
        if slip[i] < front[i] <= slip[i] + added:
            waves.arrival[i] = now.time + step * (front[i] - slip[i]) / added
        slip[i] += added
        waves.slip_rate[i] = 2.0 * after
        # The work of friction, with the mean of the rates before and
        # after the step.
        now.friction += 0.5 * dx * step * waves.stress[i] * (before + after)
        u[i] += np.float32(step * after + mesh.viscous_time * (after - before))
        velocities[i] = np.float32(after)
        never += slip[i] == 0.0
        fast |= 2.0 * after > now.fast_slip_rate
        total += 2.0 * after
    if fast:
        now.peak_rate = max(now.peak_rate, total)
        if total >= PULSE_SHARE * now.peak_rate:
            now.fast_since = now.fast_since if now.fast else now.time
            now.fast, now.fast_until = 1, now.time
    # Update the stress of the correction by the added slip only: most
    # nodes rest most of the time.
    for j in range(slip.shape[0]):
        added = step * waves.slip_rate[j]
        if added > 0.0:
            column = mesh.correction[j]
            for i in range(slip.shape[0]):
                waves.corrected[i] += added * column[i]
    return never


@jit_inside
def _move_platen(mesh: Mesh, waves: Waves, force: Any) -> None:
    """Step 4: move the top with its platen and spring, or hold the top.

    Nodes with 2 * 3 kg/m and a platen with 4 kg/m feel 5 N/m, and a spring at
    0.2 m takes off 2 N/m. In 0.5 s the speed changes from 1 m/s to
    ((20 + 2.5 - 3) * 1 + 3)/(20 + 2.5 + 3) with the damping.

    >>> from types import SimpleNamespace
    >>> mesh = SimpleNamespace(
    ...     step=0.5, stiffness=10.0, drive_mass=4.0, viscous_time=0.25
    ... )
    >>> mesh.mass, mesh.attenuation = np.array([9.0, 3.0]), 1.0
    >>> waves = SimpleNamespace(u=np.zeros((2, 2)), u_rate=np.zeros((2, 2)))
    >>> waves.totals = np.zeros(1, TOTALS).view(np.recarray)
    >>> now = waves.totals[0]
    >>> now.speed, now.travel = 1.0, 0.2
    >>> _move_platen.py_func(mesh, waves, np.array([2.0, 3.0]))
    >>> speed = ((20.0 + 2.5 - 3.0) + 3.0) / (20.0 + 2.5 + 3.0)
    >>> np.allclose([now.speed, now.travel], [speed, 0.2 + 0.5 * speed])
    True
    >>> np.allclose(now.force, -10.0 * now.travel)
    True
    >>> np.allclose(waves.u, [[0.0] * 2, [0.2 + 0.75 * speed] * 2])
    True
    >>> np.allclose(waves.u_rate, [[0.0] * 2, [speed] * 2])
    True
    >>> mesh.stiffness = np.inf  # the drive holds the top
    >>> _move_platen.py_func(mesh, waves, np.array([2.0, 3.0]))
    >>> float(now.force), np.allclose(now.speed, speed)
    (-5.0, True)
    """
    now, top, step = waves.totals[0], waves.u.shape[0] - 1, mesh.step
    total = 0.0
    for i in range(force.shape[0]):
        total += force[i]
    before = now.speed
    if mesh.stiffness == np.inf:  # the drive holds the top, and balances its force
        now.force = -total
        return
    mass = force.shape[0] * mesh.mass[top]
    # The spring acts at the mean travel of the step, which keeps stiff machines
    # stable.
    # All nodes of the top and the platen move as a single mass.
    inert = (mass + mesh.drive_mass) / step + 0.5 * mesh.stiffness * step
    lost = 0.5 * mesh.attenuation * mass
    total -= mesh.stiffness * now.travel
    after = ((inert - lost) * before + total) / (inert + lost)
    now.speed = after
    now.travel += step * after
    now.force = -mesh.stiffness * now.travel
    w, velocity = np.float32(now.travel + mesh.viscous_time * after), np.float32(after)
    for i in range(force.shape[0]):
        waves.u[top, i] = w
        waves.u_rate[top, i] = velocity


@jit_inside
def _move_pusher(mesh: Mesh, waves: Waves, gains: Array) -> None:
    """Step 4: move the pusher with its spring, or hold the pusher.

    Apply its force to the block.

    The force F changes the speed of the pusher from v to v + g F, with
    the mobility g of the pushed nodes.

    The mobility is (0.75² + 0.25²) * 2, and the pushed nodes move at 0.75 * 1 -
    0.25 * 2. The force keeps the pusher at their speed.

    >>> from types import SimpleNamespace
    >>> mesh = SimpleNamespace(
    ...     step=0.5, stiffness=4.0, drive_mass=1.0, viscous_time=0.25
    ... )
    >>> mesh.push, gains = np.array([[0.0, 0.0], [0.75, 0.25]]), np.array([9.0, 2.0])
    >>> u_rate = np.array([[5.0, 5.0, 5.0], [1.0, 6.0, -2.0]])
    >>> waves = SimpleNamespace(u=np.zeros((2, 3)), u_rate=u_rate)
    >>> waves.totals = np.zeros(1, TOTALS).view(np.recarray)
    >>> now = waves.totals[0]
    >>> now.speed, now.travel = 0.5, 0.125
    >>> _move_pusher.py_func(mesh, waves, gains)
    >>> mobility, a, before = (
    ...     0.75**2 * 2 + 0.25**2 * 2,
    ...     0.5 * 4.0 * 0.5 + 1.0 / 0.5,
    ...     0.75 - 0.5,
    ... )
    >>> force = -(4.0 * 0.125 + a * (before - 0.5)) / (1.0 + a * mobility)
    >>> (
    ...     np.allclose(now.speed, before + mobility * force),
    ...     np.allclose(now.force, -4.0 * now.travel),
    ... )
    (True, True)
    >>> np.allclose(now.travel, 0.125 + 0.5 * now.speed)
    True
    >>> np.allclose(waves.u_rate[1], [1.0 + 1.5 * force, 6.0, -2.0 + 0.5 * force])
    True
    >>> np.allclose(
    ...     waves.u, [[0.0] * 3, [0.75 * 1.5 * force, 0.0, 0.75 * 0.5 * force]]
    ... )
    True

    A rigid machine holds the pusher.

    >>> mesh.stiffness = np.inf
    >>> _move_pusher.py_func(mesh, waves, gains)
    >>> held = 0.75 * waves.u_rate[1, 0] + 0.25 * waves.u_rate[1, 2]
    >>> print(f"{abs(held):.6f} {abs(now.speed):.6f}")
    0.000000 0.000000
    """
    now, step, last = waves.totals[0], mesh.step, waves.u.shape[1] - 1
    # The pusher moves as the mean of the pushed nodes, weighted by
    # their parts of the force.
    mobility = speed = 0.0
    for j in range(gains.shape[0]):
        for side, i in ((0, 0), (1, last)):
            mobility += mesh.push[j, side] ** 2 * gains[j]
            speed += mesh.push[j, side] * waves.u_rate[j, i]
    before = now.speed
    if mesh.stiffness == np.inf:  # the force that stops the pushed nodes
        force = -speed / mobility
    else:
        # Semi-implicit: F = -k X - a (v + g F - v_before), solved for F.
        a = 0.5 * mesh.stiffness * step + mesh.drive_mass / step
        force = -(mesh.stiffness * now.travel + a * (speed - before)) / (1.0 + a * mobility)
    now.speed = speed + mobility * force
    now.travel += step * now.speed
    now.force = force if mesh.stiffness == np.inf else -mesh.stiffness * now.travel
    if force == 0.0:
        return
    for j in range(gains.shape[0]):
        for side, i in ((0, 0), (1, last)):
            added = mesh.push[j, side] * gains[j] * force
            waves.u_rate[j, i] += np.float32(added)
            waves.u[j, i] += np.float32((step + mesh.viscous_time) * added)


@jit_allocating
def wave_steps(
    sample: StaticSample, start: Array, front: Array, mesh: Mesh, waves: Waves, steps: int,
    ends: bool,
) -> int:  # fmt: skip
    """Advance the waves by up to `steps` time steps, and return the number of steps taken.

    If `ends` is true, stop once all nodes have slipped. `start` is the
    stress in the static state minus the initial stress (Pa). `front` is
    the slip (m) at which the front counts as arrived at a node.

    The parts of a step are replaced by their names. Forces on a row are
    computed before the row below moves. The nodes have all slipped after two
    steps.

    >>> from types import FunctionType, SimpleNamespace
    >>> def steps(platen, anti_plane, most, ends):
    ...     def part(name):
    ...         return lambda *arguments: called.append(name)
    ...
    ...     def slide(*arguments):
    ...         called.append("slide")
    ...         return left.pop(0)
    ...
    ...     called, left = [], [1, 0, 0]
    ...     parts = "_force", "_move", "_move_platen", "_move_pusher"
    ...     names = (
    ...         globals()
    ...         | {name: part(name[1:]) for name in parts}
    ...         | {"_slide": slide}
    ...     )
    ...     plain = FunctionType(wave_steps.py_func.__code__, names)
    ...     mesh = SimpleNamespace(
    ...         platen=platen, anti_plane=anti_plane, step=0.5, viscous_time=0.0
    ...     )
    ...     mesh.attenuation, mesh.mass, mesh.stencils = (
    ...         0.0,
    ...         np.ones(3),
    ...         np.zeros((3, 2, 5, 3)),
    ...     )
    ...     fields = dict(
    ...         zip(("u", "v", "u_rate", "v_rate"), np.zeros((4, 3, 2)), strict=True)
    ...     )
    ...     waves = SimpleNamespace(
    ...         **fields, totals=np.zeros(1, TOTALS).view(np.recarray)
    ...     )
    ...     taken = plain(None, None, None, mesh, waves, most, ends)
    ...     return (
    ...         taken,
    ...         float(waves.totals[0].time),
    ...         " ".join(called[: len(called) // taken]),
    ...     )
    >>> steps(platen=True, anti_plane=True, most=1, ends=False)
    (1, 0.5, 'force force slide force move move_platen')
    >>> steps(platen=False, anti_plane=True, most=3, ends=True)
    (2, 1.0, 'force force slide force move move move_pusher')
    >>> steps(platen=True, anti_plane=False, most=3, ends=False)
    (3, 1.5, 'force force force force slide move force force move move move_platen')
    """
    rows, n = waves.u.shape
    step, lag = np.float32(mesh.step), np.float32(mesh.viscous_time)
    half = 0.5 * mesh.attenuation * mesh.step
    keep = (1.0 - half) / (1.0 + half)
    gains = mesh.step / ((1.0 + half) * mesh.mass)
    along = np.zeros((2, n), np.float32)  # forces on a row, and on the one below it
    across = np.zeros((2, n), np.float32)
    last, keep_row = rows - 1, np.float32(keep)
    u, v, u_rate, v_rate = waves.u, waves.v, waves.u_rate, waves.v_rate
    for taken in range(steps):
        never = n
        # Forces on row j and motion of row j - 1 alternate, so that two
        # rows of forces suffice.
        for j in range(rows + 1):
            # 1. Forces on row j.
            if j < rows:  # stencils are zero beyond the interface and the top
                low, up, stencil = max(j - 1, 0), min(j + 1, last), mesh.stencils[j]
                _force(stencil[0], u[low], u[j], u[up], v[low], v[j], v[up], along[j % 2])
                if not mesh.anti_plane:
                    _force(stencil[1], v[low], v[j], v[up], u[low], u[j], u[up], across[j % 2])
            i = j - 1
            if i < 0:
                continue
            # 2. to 4. Move row j - 1. The forces
            # on row j have used it already.
            force, gain = along[i % 2], np.float32(gains[i])  # the row above has felt this row
            if i == 0:
                never = _slide(sample, start, front, mesh, waves, force, keep, gains[0])
            elif i == last and mesh.platen:
                _move_platen(mesh, waves, force)
            else:
                _move(u[i], u_rate[i], force, keep_row, gain, step, lag)
            if i < last and not mesh.anti_plane:
                _move(v[i], v_rate[i], across[i % 2], keep_row, gain, step, lag)
        if not mesh.platen:
            _move_pusher(mesh, waves, gains)
        waves.totals[0].time += mesh.step
        if ends and never == 0:
            return taken + 1
    return steps

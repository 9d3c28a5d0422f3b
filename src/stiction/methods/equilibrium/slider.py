"""Sliders on a base: press them, push them, and return onsets, events and paths.

Problem
-------
A `Rig` gives the stiffness K, and the forces T F and T_p N of the push
F and the normal force N (N/m). Pressing and push are paths of
`contact_path`. The load is N in the first, and the push in the second.

Algorithm
---------
The algorithm is our own (`press`, `begin_push`).

1. Pressing alone causes shear, because the two bodies expand
   differently. Each cell has the sign s of its shear T_p. With the slip
   s d, K becomes s K s.
2. All strengths are zero without N, so begin at a small part of N. The
   nodes beyond their strength are on E, edges on top. Follow the path
   to N. Slip nearby may then load a cell against its sign beyond its
   strength. Change the sign of such cells, and press again.
3. Push. Slip in the push is positive. Slip of both stages in either
   direction adds up in the weakening. Edges that are open begin in S.
4. Follow instabilities and arrests in turn until the slider slides
   (`SliderPath.follow`). The first instability is the first of them
   during the push. Static friction is the largest force.

Results
-------
Loads and forces are divided by the length of the interface: the mean
shear stress, Pa. The load D is the push that the machine would exert
without slip. Slip and travel count from the beginning of the push, and
opening is the present opening. The travel of the push is U = F/C + T'x
(`Rig`), without the constant part from the pressing.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy, warn_of_samples
from stiction.base.variables import Variable
from stiction.elasticity.rig import Rig, on_cells
from stiction.methods.equilibrium import contact_path
from stiction.methods.equilibrium.contact_path import Contact, Motion, Status, follow
from stiction.methods.equilibrium.events import (
    elongation_of,
    event_variables,
    patch_measures,
    tabulate,
)
from stiction.methods.equilibrium.patches import critical_patch, patches_of
from stiction.methods.equilibrium.solver import refused
from stiction.problem.checks import warn_if_coarse
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample

OF_SLIDERS = {
    "open_fraction": Variable("1", "part of the interface that is open before it slides")
}
WITH_FIXED_PRESSURE = {"event_energy_stress_drop", "event_fracture_energy"}
"""Variables of events that are defined for a pressure that does not
change."""
COEFFICIENT_STEP = 1e-7
"""Rise of a friction coefficient in a difference quotient."""
NODES_AT_ENDS = 16
"""Number of nodes in a nucleation length above which no warning about
the ends is issued."""
COARSE_ENDS = (
    "stress is singular at the ends of the slider. If the 17 nodes are doubled, static friction"
    " changes by up to 0.04 %, and the first instability by up to 0.5 %"
)
WARNINGS = (
    "the path was not followed to its end in {samples}: static friction is a lower bound",
    "the slider topples before it slides in {samples}: static friction is the force at which it"
    " topples. Lower the drive",
    "no patch becomes unstable in {samples}: the machine is so stiff that the slider slides stably,"
    " and first_instability is NaN",
)
"""Warnings about exceptional samples."""
FIRST_PRESSING = 1e-3
"""Fraction of the normal force at which a pressing that slips begins."""
REVERSE_RTOL = 1e-9
"""Excess of shear against the sign of a cell that is round-off, in mean
normal forces of a cell."""
MIN_TURNING = 1e-6
"""Opening over slip of a slider that topples, in the motion that does
not end."""


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
    """Return a slider at rest, in which open edges are in the active set S.

    The contact holds `overstress` and `moved` without copying them.
    Where the strength is mu_r N, `friction.peak` must equal
    `friction.residual`. With a machine, the force falls by `relief` T'x
    (Pa).

    Row 0 of M is K_0 + 0.5 (K_1 + K_2) with the weakening on its diagonal,
    and the load on the cell is 1 + 0.5 (0.2 + 0.4). Edge 2 is open, so S
    begins with it and 1/K_22:

    >>> K, T = np.array([[4.0, 1, 2], [1, 3, 0], [2, 0, 5]]), np.array([1.0, 0.2, 0.4])
    >>> friction = Friction(*np.array([[0.5], [0.25], [1.5]]))
    >>> state = make_contact(K, T, friction, np.zeros(3), np.array([0.7, 0.0, 0.1]))
    >>> state.columns.T.tolist()
    [[4.0, 2.5, 4.5], [1.0, 3.0, 0.0], [2.0, 0.0, 5.0]]
    >>> state.load.round(6).tolist()
    [1.3, 0.2, 0.4]
    >>> state.motion.tolist()
    [0, 0, 1]
    >>> state.counts.tolist()
    [1, 0, 0, 0]
    >>> int(state.inside[0]), float(state.inverse[0, 0])
    (2, 0.2)

    Strength does not fall below its residual. A machine of 10 Pa adds 10 T T':

    >>> flat = Friction(*np.array([[0.5], [0.5], [1.5]]))
    >>> state = make_contact(K, T, flat, np.zeros(3), np.zeros(3), relief=10.0)
    >>> state.columns.T.round(6).tolist()
    [[18.5, 5.1, 9.7], [3.0, 3.4, 0.8], [6.0, 0.8, 6.6]]
    >>> state.relief.tolist()
    [10.0, 2.0, 4.0]
    >>> float(state.weakening[0])
    0.0
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
    counts[contact_path.N_INSIDE] = k
    return Contact(
        columns, load, relief * T, normal, normal_load, difference, weakening, overstress, moved,
        inverse, inside, stack, motion, counts, np.zeros(3), *np.empty((4, m)),
    )  # fmt: skip


def press(K: Array, T_p: Array, friction: Friction, force: float) -> Pressed:
    """Steps 1 and 2: return a slider under a normal force (N/m).

    Under 2 N/m, the cell carries 2 N/m and can bear 2 N/m of shear. Shear
    of -0.5 N/m is held. Under -3 N/m the cell slips until 3 - 3 d = 2 - d:

    >>> K, friction = np.diag([3.0, 1, 1]), Friction(*np.array([[1.0], [0.5], [1.0]]))
    >>> for shear in (-0.25, -1.5):
    ...     pressed = press(K, np.array([shear, -0.6, -0.4]), friction, 2.0)
    ...     print(pressed.forces.round(6).tolist(), pressed.moved.round(6).tolist())
    [-0.5, -1.2, -0.8] [-0.0, 0.0, 0.0]
    [-1.5, -1.2, -0.8] [-0.5, 0.0, 0.0]

    With W = 2.5 Pa, the cell has its residual strength, 3 - 3 d = 1 N/m, after the pressing:

    >>> steep = friction._replace(weakening=np.array([2.5]))
    >>> pressed = press(K, np.array([1.5, -0.6, -0.4]), steep, 2.0)
    >>> pressed.moved.round(6).tolist()
    [0.666667, 0.0, 0.0]
    >>> pressed.friction.peak.tolist()
    [0.5]
    """
    n = len(friction.peak)
    strength = friction.peak * on_cells(-T_p[n:] * force)
    # 1. The sign of slip along the shear.
    sign = np.where(T_p < 0.0, -1.0, 1.0)
    sign[n:] = 1.0
    # 2. A sign may change once for each cell.
    for _ in range(n + 1):
        overstress = T_p * sign * (FIRST_PRESSING * force)
        overstress[:n] -= FIRST_PRESSING * strength
        moved = np.zeros_like(overstress)
        state = make_contact(K * sign * sign[:, None], T_p * sign, friction, overstress, moved)
        beyond = np.flatnonzero(overstress > 0.0)  # cells first, so that edges are on top
        state.stack[: beyond.size], state.motion[beyond] = beyond, Motion.UNSTABLE
        state.counts[contact_path.N_STACKED] = beyond.size
        state.loads[contact_path.LOAD] = FIRST_PRESSING * force
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
    """Return the shear force of each cell, and the tension of each edge (m,), N/m.

    The cell carries N = 1.5 N/m and is 0.2 N/m below its strength, 1.5 - 2 x 0.25 N/m:

    >>> K, T, friction = np.eye(3), np.zeros(3), Friction(*np.array([[1.0], [0.5], [2.0]]))
    >>> overstress, moved = np.array([-0.2, -0.5, -1.0]), np.array([0.25, 0.0, 0.0])
    >>> forces_of(make_contact(K, T, friction, overstress, moved), friction).tolist()
    [0.8, -0.5, -1.0]
    """
    n, forces = len(friction.peak), state.overstress.copy()
    coefficient = friction.residual + state.difference
    forces[:n] += coefficient * on_cells(-forces[n:]) - state.weakening * state.moved[:n]
    return forces


def begin_push(K: Array, T: Array, start: Pressed, relief: float = 0.0) -> Contact:
    """Step 3: return the slider before the push, whose slip adds to the slip of the pressing.

    After a slip of -0.5 m, the strength is 2 - 0.5 N/m, and the shear -1.5 N/m:

    >>> friction = Friction(*np.array([[1.0], [0.5], [1.0]]))
    >>> start = Pressed(np.array([-1.5, -1.2, -0.8]), np.array([-0.5, 0.0, 0.0]), friction)
    >>> state = begin_push(np.eye(3), np.ones(3), start)
    >>> state.overstress.tolist()
    [-3.0, -1.2, -0.8]
    >>> state.moved.tolist()
    [0.5, 0.0, 0.0]
    >>> residual = start._replace(friction=friction._replace(peak=friction.residual))
    >>> begin_push(np.eye(3), np.ones(3), residual).overstress.tolist()
    [-2.5, -1.2, -0.8]
    """
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
    """The push of a sample until it slides.

    Without an instability, `first` is None.

    `last` is the last equilibrium, and `peak` the largest force (N/m).
    `events` holds the states before and after each. `known` is false if
    the path was not followed to its end.
    """

    first: PushState | None
    last: PushState
    peak: float
    events: list[tuple[PushState, PushState]]
    known: bool
    topples: bool


class SliderPath:
    """A slider on its path, which never goes back.

    The example by hand in `contact_path`, with a shear of -0.5 N/m from the
    pressing. Slip jumps at 2.5 N/m, to 1/3 m. Then the cell slides stably:

    >>> K, T, T_p = np.diag([3.0, 1, 1]), np.eye(3)[0], np.array([-0.25, -0.6, -0.4])
    >>> rig = Rig(K, T, T_p, 2.0)
    >>> path = SliderPath(rig, 0.0, Friction(*np.array([[1.0], [0.5], [4.0]])), 2.0)
    >>> push = path.follow()
    >>> push.first.load
    2.5
    >>> push.peak
    2.5
    >>> push.known
    True
    >>> bool(push.topples)
    False
    >>> len(push.events)
    1
    >>> before, after = push.events[0]
    >>> before.moved.tolist()
    [0.0, 0.0, 0.0]
    >>> after.moved.round(6).tolist()
    [0.333333, 0.0, 0.0]
    >>> after.forces.round(6).tolist()
    [1.0, -1.2, -0.8]
    >>> before.direction.tolist()
    [1.0]
    >>> before.residual
    False
    >>> after.residual
    True
    >>> push.last.load
    2.5

    Slip of the pressing does not count as slip of the push:

    >>> rig = Rig(K, T, np.array([1.5, -0.6, -0.4]), 2.0)
    >>> path = SliderPath(rig, 0.0, path.friction, 2.0)
    >>> path.state().moved.tolist()
    [0.0, 0.0, 0.0]
    >>> bool(path.move(3.0) == Status.AT_TARGET)
    True
    >>> path.state().moved.round(6).tolist()
    [1.0, 0.0, 0.0]
    >>> path.before.round(6).tolist()
    [0.666667, 0.0, 0.0]
    """

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
        contact, events, first = self.contact, [], None
        while (status := self.move()) == Status.UNSTABLE:
            last = self.state()
            first = first or last
            if (status := self.move()) != Status.ARRESTED:
                break
            events.append((last, self.state()))
        unstable = contact.counts[contact_path.N_STACKED] > 0  # otherwise it slides stably
        last, known = last if unstable else self.state(), status == Status.SLIDING
        rate, n = np.abs(contact.rate), len(self.friction.peak)
        turns = bool(rate[n:].max() > MIN_TURNING * rate[:n].max())
        peak = float(contact.loads[contact_path.PEAK])
        return Push(first, last, peak, events, known, known and unstable and turns)


def push_variables(interface: Interface) -> dict[str, Variable]:
    """Return the event variables of a slider.

    >>> free = Interface(0.8, 8, ends="free")
    >>> sorted(event_variables(free).keys() - push_variables(free))
    ['event_energy_stress_drop', 'event_fracture_energy']
    """
    variables = event_variables(interface).items()
    return {name: known for name, known in variables if name not in WITH_FIXED_PRESSURE}


class SliderSolver:
    """Thread-safe solver for samples of a slider by `Equilibrium` with given options.

    Eight cells that are not coupled carry 1 N/m each. Cell 2 jumps at 2 N/m
    to (2 - 1)/3 m, and cell 5 at 3.5 N/m to (3.5 - 1)/3 m. The other cells do
    not weaken and begin to slide at 9 N/m:

    >>> from types import SimpleNamespace
    >>> from stiction.problem.friction import LinearWeakening
    >>> T_p = np.repeat([0.0, -0.0625, -0.125, -0.0625], [8, 1, 7, 1])
    >>> rig = Rig(np.diag([3.0] * 17), np.repeat([1.0, 0.0], [8, 9]), T_p, 4.0)
    >>> problem = SimpleNamespace(
    ...     friction=LinearWeakening(4.0), rig=rig, interface=Interface(0.8, 8, ends="free"),
    ...     specimen=SimpleNamespace(
    ...         machine=0.0, drive=SimpleNamespace(stiffness=5.0), thickness=0.5
    ...     ),
    ...     solid=SimpleNamespace(shear_modulus=2.0),
    ... )
    >>> options = SimpleNamespace(slip=True, sensitivity=False, events=0)
    >>> solver, peak = SliderSolver(problem, options), np.full(8, 9.0)
    >>> peak[[2, 5]] = 2.0, 3.5
    >>> friction = Friction(peak, np.where(peak < 9.0, 1.0, 9.0), np.full(8, 4.0))
    >>> solver.path = lambda *place: SliderPath(rig, 0.0, friction, 8.0)
    >>> values = solver._values(None, 0, solver.path().follow())
    >>> for name in "critical_load", "critical_stress", "first_instability", "critical_position":
    ...     print(name, round(values[name], 6))
    critical_load 11.25
    critical_stress 11.25
    first_instability 2.5
    critical_position 0.25
    >>> values["arrested_events"]
    2
    >>> values["slip_patches"]
    0
    >>> values["residual_reached"]
    True

    At 10 N/m it slides. Slip at 2.5 N/m is (2.5 - 1)/3 m at cell 2:

    >>> known = solver.at_loads(None, np.array([1.8, 2.5, 10.0]) / 0.8)
    >>> known["slip"][:, 2].round(6).tolist()
    [0.0, 0.5, nan]
    >>> known["sliding"].tolist()
    [False, False, True]
    >>> known["arrested_events"].tolist()
    [0, 1, 2]
    >>> known["event_load"].round(6).tolist()
    [2.5, 4.375]
    >>> known["event_travel_step"].round(6).tolist()
    [0.333333, 0.833333]
    >>> known["event_position"].round(6).tolist()
    [0.25, 0.55]
    >>> known["travel"].round(6).tolist()
    [0.45, 1.125, nan]
    >>> known["crosshead_travel"].round(6).tolist()
    [0.63, 1.375, nan]
    >>> known["stress"][1, :4].round(6).tolist()
    [25.0, 25.0, 10.0, 25.0]
    >>> known["pressure"][1, :3].round(6).tolist()
    [10.0, 10.0, 10.0]
    """

    def __init__(self, problem: Problem, options: Any = None) -> None:
        if reasons := refused(problem):
            raise InputError(reasons)
        rig, machine = problem.rig, problem.specimen.machine  # type: ignore[union-attr]
        self.relief = rig.C / (1.0 + rig.C / machine) if machine > 0.0 else 0.0
        self.problem, self.options, self.rig = problem, options, rig
        self.length = problem.interface.measure

    def __call__(self, rows: Sample) -> dict[str, NDArray[Any]]:
        """Return the variables of `Equilibrium`.

        The first dimension of each is the sample.
        """
        warn_if_coarse(self.problem, rows.steepest_weakening_rate, NODES_AT_ENDS, COARSE_ENDS)
        pushes = [self.path(rows, row).follow() for row in range(rows.samples)]
        table = [self._values(rows, row, push) for row, push in enumerate(pushes)]
        flags = [(not push.known, push.topples, push.first is None) for push in pushes]
        for text, samples in zip(WARNINGS, np.transpose(flags), strict=True):
            warn_of_samples(text, samples)
        return {name: np.array([values[name] for values in table]) for name in table[0]}

    def path(self, rows: Sample, row: int, node: int = 0, step: float = 0.0) -> SliderPath:
        """Return a sample before the push, whose friction coefficient has a step at a node."""
        pressure, spacing = rows.normal_pressure[row], self.problem.interface.spacing
        peak, residual = rows.strength[row] / pressure, rows.residual_strength[row] / pressure
        peak[node] += step
        # Round-off hides a weakening that does not change the pivot of a cell. It never weakens.
        weakening = rows.weakening_rate[row] * spacing
        hidden = weakening <= contact_path.CONTACT_PIVOT_RTOL * np.diag(self.rig.K)[: peak.size]
        friction = Friction(peak, np.where(hidden, peak, residual), weakening)
        force = float(pressure.mean()) * self.length
        return SliderPath(self.rig, self.relief, friction, force)

    def _values(self, rows: Sample, row: int, push: Push) -> dict[str, Any]:
        interface, first, last = self.problem.interface, push.first, push.last
        n = interface.size
        direction = np.zeros(n) if first is None else first.direction
        slip = np.zeros(n) if first is None else first.moved[:n]
        patch = critical_patch(direction, interface)
        values: dict[str, Any] = {
            "critical_load": last.load / self.length,
            "critical_stress": push.peak / self.length,
            "first_instability": np.nan if first is None else first.force / self.length,
            "certificate_gap": np.nan,
            "critical_position": patch.centre[0],
            "critical_patch_length": patch.area,
            "sliding_position": critical_patch(last.direction, interface).centre[0],
            "slip_patches": patches_of(slip, interface),
            "arrested_events": len(push.events),
            "residual_reached": last.residual,
            "open_fraction": float(np.trapezoid(last.moved[n:] > 0.0) / n),
        }
        if self.options.slip:
            values["slip"] = slip
        if self.options.sensitivity:
            # Between events paths are straight, so a small step gives the exact derivative.
            values["sensitivity"] = np.full(n, np.nan)
            for node in range(n if first else 0):
                path = self.path(rows, row, node, COEFFICIENT_STEP)
                path.move()
                rise = (path.state().force - first.force) / self.length  # type: ignore[union-attr]
                step = COEFFICIENT_STEP * rows.normal_pressure[row, node]
                values["sensitivity"][node] = rise / step
        if most := self.options.events:
            values |= self.event_table(push, most)
        return values

    def values_at(self, state: PushState) -> dict[str, Any]:
        """Return the mean stress (Pa), both travels (m), and profiles (m, Pa) at the nodes.

        Opening is the mean of the edges on both sides of a node:

        >>> from types import SimpleNamespace
        >>> solver = SliderSolver.__new__(SliderSolver)
        >>> specimen = SimpleNamespace(drive=SimpleNamespace(stiffness=5.0), thickness=0.5)
        >>> interface = SimpleNamespace(size=2, spacing=0.1, measure=0.2)
        >>> solver.problem = SimpleNamespace(interface=interface, specimen=specimen)
        >>> solver.length, solver.rig = 0.2, Rig(None, np.arange(1.0, 6.0), None, 4.0)
        >>> moved, forces = np.array([1.0, 2, 0, 0.4, 3]), np.array([5.0, 6, -1, -2, -4])
        >>> state = PushState(0.0, 3.0, moved, forces, None, False)
        >>> for name, values in solver.values_at(state).items():
        ...     print(name, np.round(values, 6).tolist())
        mean_stress 15.0
        travel 22.35
        crosshead_travel 22.65
        slip [1.0, 2.0]
        stress [50.0, 60.0]
        pressure [20.0, 50.0]
        opening [0.2, 1.7]
        """
        n, spacing = self.problem.interface.size, self.problem.interface.spacing
        stress, travel = state.force / self.length, state.force / self.rig.C
        travel += float(self.rig.T @ state.moved)
        return {
            "mean_stress": stress,
            "travel": travel,
            "crosshead_travel": travel + elongation_of(self.problem, stress),
            "slip": state.moved[:n],
            "stress": state.forces[:n] / spacing,
            "pressure": on_cells(-state.forces[n:]) / spacing,
            "opening": 0.5 * (state.moved[n:-1] + state.moved[n + 1 :]),
        }

    def event_table(self, push: Push, most: int | None = None) -> dict[str, Array]:
        """Return the variables of events as arrays, padded with NaN to `most` events."""
        measured, interface = [], self.problem.interface
        for before, after in push.events[:most]:
            start, end = self.values_at(before), self.values_at(after)
            drop, added = start["stress"] - end["stress"], end["slip"] - start["slip"]
            measured.append(patch_measures(self.problem, before, added, drop) | {
                "event_load": before.load / self.length,
                "event_stress": start["mean_stress"],
                "event_stress_drop": start["mean_stress"] - end["mean_stress"],
                "event_travel": start["travel"],
                "event_crosshead_travel": start["crosshead_travel"],
                "event_travel_step": end["travel"] - start["travel"],
            })  # fmt: skip
        return tabulate(measured, push_variables(interface), most)

    def at_loads(self, rows: Sample, loads: Array) -> dict[str, Array]:
        """Return the values that `equilibrium_path` needs at rising loads, Pa."""
        # The path to sliding gives all events, and a second path the states at the loads.
        push, path = self.path(rows, 0).follow(), self.path(rows, 0)
        end = push.last.load / self.length
        if not push.known:
            warn_accuracy(f"the path was not followed beyond {end:g} Pa")
        sliding, state, states = loads > end, path.state(), []
        for load in loads[~sliding]:
            while (status := path.move(load * self.length)) <= Status.ARRESTED:
                state = path.state()
                if status == Status.AT_TARGET:
                    break
            states.append(self.values_at(state))  # if it slides at this load, just before
        after = {name: np.nan * value for name, value in self.values_at(push.last).items()}
        table = states + [after] * int(sliding.sum())
        starts = [before.load / self.length for before, _ in push.events]
        return {
            **self.event_table(push),
            **{name: np.array([values[name] for values in table]) for name in after},
            "arrested_events": np.searchsorted(starts, loads),
            "sliding": sliding,
        }

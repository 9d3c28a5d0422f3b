"""`simulate_rupture` on specimens: an event in space and time, and the velocity of the block.

1. Follow the path of the sample to sliding, and choose the event.
2. Run the event once as a trial, which shows the duration and the
   amount of slip.
3. Run the event again and keep frames. Pictures of the block are spread
   evenly over the slip.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.base.errors import InputError
from stiction.base.progress import Meter, Show
from stiction.base.variables import Variable, force_variables, forces
from stiction.methods.dynamics.mesh import layer_matrix
from stiction.methods.dynamics.save import (
    FIELDS,
    MOMENT_RATE,
    OVER_NODES,
    SCALARS,
    STEPS,
    TIME,
    Save,
    over,
)
from stiction.methods.dynamics.specimens import DynamicEvent, RuptureSearch, refuse_overstress
from stiction.methods.dynamics.summary import SPEEDS, front_speeds, rate_spectrum
from stiction.methods.equilibrium.events import event_table, event_variables, moment_of
from stiction.methods.equilibrium.solver import SamplePath, follow_to_sliding, sample_of
from stiction.methods.equilibrium.state import PathStatus
from stiction.methods.equilibrium.strength import present_pieces, residual_nodes
from stiction.problem.problem import Problem
from stiction.problem.results import along, study_attributes, to_dataset
from stiction.problem.sample import Sample

if TYPE_CHECKING:
    import xarray as xr

PICTURE_SHARES = (0.02, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95)
"""Fractions of an event's slip at which the velocities of the whole
block are kept."""
OVER_TIME = over(
    "time",
    machine_stress=("Pa", "force of the machine per area of interface"),
    drive_travel=("m", "travel of both drives since the event began"),
    work=("J/m", "work of the stress before the event on the slip"),
    friction_energy=("J/m", "energy lost to friction"),
    strain_energy=("J/m", "strain energy of the changes in blocks and machine"),
    kinetic_energy=("J/m", "kinetic energy of blocks and drives"),
    attenuated_energy=("J/m", "energy lost to attenuation, the rest of the work"),
)
AS_BETWEEN_HALF_SPACES = (
    "load", "mean_stress", "mean_slip", "top_slip_rate", "weakened_fraction",
)  # fmt: skip
OF_EVENT = over(
    critical_load=("Pa", "drive of the event"),
    critical_position=("m", "position at which the front arrives first"),
    onset_time=("s", "time at which the front arrives first"),
)
OF_PICTURES = over(
    "snapshot", "height", "x", block_velocity=("m/s", "velocity along x in the upper block")
)
VARIABLES: dict[str, Variable] = {
    **{name: SCALARS[name] for name in AS_BETWEEN_HALF_SPACES},
    **{name: replace(speed, dims=()) for name, speed in SPEEDS.items()},
    **OVER_TIME, **OF_EVENT, **OF_PICTURES, **MOMENT_RATE, "step_time": STEPS["step_time"],
}  # fmt: skip


def simulate_event(
    problem: Problem, rows: Sample, method: Any, save: Save, number: int | None, progress: Show
) -> xr.Dataset:
    """Return an event of a specimen over time, by default the sliding event."""
    if save.to is not None or save.stations:
        raise InputError(
            "save: specimens keep results in memory. Leave 'to' and 'stations' out"
        )
    refuse_overstress(rows)
    search: RuptureSearch = method.search(problem)
    sample = sample_of(rows, search.pieces, 0)
    with Meter("rupture", show=progress, unit="events") as meter:
        path = follow_to_sliding(search, sample)  # 1.
        # Arrested events began at `before`. The path ends with the
        # sliding event, if any.
        states = [event.before for event in path.events]
        states += [path.last] if path.last.status == PathStatus.UNSTABLE else []
        meter.advance(len(states))
        if not states:
            raise InputError("problem: the machine is so stiff that no patch becomes unstable")
        if (number or 0) >= len(states):
            raise InputError(f"event: must be below {len(states)}, the number of events")
        before = states[-1 if number is None else number]
        trial = search.event(sample, before)  # 2.
        trial.run(method.max_steps)
        if trial.slides:  # go on until the last waves have crossed the block
            trial.take_steps(trial.mesh.window // 2, ends=False)
        event, last = search.event(sample, before), trial.waves.slip.mean()
        record = EventRecord(problem, rows, event, save, last)  # 3.
        record.add()
        for _ in range(0, trial.steps, save.every):
            record.take_steps(save.every)
            record.add()
    return record.dataset(method, "sliding" if trial.slides else "rest", path)


class EventRecord:
    """Frames of an event up to now, with pictures of the block.

    A trial of the event shows the mean slip at its end, `last` (m), so
    that the pictures are spread evenly over the slip.
    """

    def __init__(
        self, problem: Problem, rows: Sample, event: DynamicEvent, save: Save, last: float
    ) -> None:
        self.problem, self.rows, self.event, self.save = problem, rows, event, save
        first = event.waves.slip.mean()
        self._due = [first + share * (last - first) for share in PICTURE_SHARES]
        self.frames: list[dict[str, Any]] = []
        self.pictures: list[Any] = []
        self.picture_times: list[float] = []
        self.steps: list[tuple[float, float]] = []  # time (s) and moment rate (N/s)
        nodes, count = problem.interface.size, event.mesh.heights.size - 1
        self._layers = [layer_matrix(event.mesh, row, nodes) for row in range(count)]
        self._begun = event.waves.slip.copy()

    def take_steps(self, count: int) -> None:
        """Take `count` steps, and keep the moment rate after each.

        >>> from types import SimpleNamespace
        >>> from stiction.problem.interface import Interface
        >>> problem = SimpleNamespace(solid=SimpleNamespace(shear_modulus=3.0))
        >>> problem.interface = Interface(0.8, 8)
        >>> waves = SimpleNamespace(slip_rate=np.full(8, 0.5), now={"time": 0.0})
        >>> def take(count, ends):
        ...     waves.now["time"] += count
        >>> event = SimpleNamespace(waves=waves, take_steps=take)
        >>> record = SimpleNamespace(problem=problem, event=event, steps=[])
        >>> EventRecord.take_steps(record, 2)
        >>> [
        ...     tuple(round(value, 9) for value in step) for step in record.steps
        ... ]  # 3 * 0.8 * 0.5
        [(1.0, 1.2), (2.0, 1.2)]
        """
        for _ in range(count):
            self.event.take_steps(1, ends=False)
            waves = self.event.waves
            rate = moment_of(self.problem, waves.slip_rate)
            self.steps.append((float(waves.now["time"]), rate))

    def add(self) -> None:
        """Keep a frame of the present state, and a picture of the block if it is due.

        The first frame has the stress before the event. Pictures are due at a mean
        slip of 0.3 and 0.4 m.

        >>> from types import FunctionType, SimpleNamespace
        >>> from stiction.methods.equilibrium.strength import Present
        >>> from stiction.problem.interface import Interface
        >>> pieces = Present(None, np.full(8, 9.0), np.full(8, 2.0))
        >>> names = globals() | {"present_pieces": lambda *given: pieces}
        >>> names["residual_nodes"] = lambda sample, slip: slip >= 0.5
        >>> plain = FunctionType(EventRecord.add.__code__, names)
        >>> problem = SimpleNamespace(interface=Interface(0.8, 8))
        >>> problem.blocks = SimpleNamespace(mean_relief=lambda slip: slip.sum())
        >>> waves = SimpleNamespace(
        ...     slip=0.5 * (np.arange(8) < 6), slip_rate=np.arange(8.0)
        ... )
        >>> waves.stress, waves.u_rate = np.full(8, 4.0), np.full((2, 8), 0.25)
        >>> waves.now = {"time": 1.5, "force": 1.6, "travel": 0.125}
        >>> event = SimpleNamespace(waves=waves, sample=None, start=np.full(8, 6.0))
        >>> event.before = SimpleNamespace(load=5.0, slip=np.full(8, 0.125))
        >>> rows = SimpleNamespace(initial_stress=np.full((1, 8), 0.5))
        >>> save = SimpleNamespace(fields=["shear_stress", "strength"])
        >>> record = SimpleNamespace(
        ...     problem=problem, event=event, rows=rows, save=save, frames=[]
        ... )
        >>> record._energies, record._due = dict, [0.3, 0.375, 0.4]
        >>> record.pictures, record.picture_times = [], []
        >>> for _ in range(2):
        ...     plain(record)
        >>> first, second = record.frames
        >>> first["shear_stress"][0].item(), second["shear_stress"][0].item()
        (6.5, 4.5)
        >>> first["strength"].tolist() == [8.5] * 6 + [9.5] * 2
        True
        >>> names = (
        ...     "machine_stress",
        ...     "drive_travel",
        ...     "weakened_fraction",
        ...     "mean_slip",
        ...     "load",
        ... )
        >>> for name in names:
        ...     print(name, float(first[name]))  # 0.5 + 5 - 1 + 1.6/0.8
        machine_stress 6.5
        drive_travel 0.25
        weakened_fraction 0.75
        mean_slip 0.375
        load 5.0
        >>> len(record.pictures), record.picture_times, record._due
        (2, [1.5, 1.5], [0.4])
        """
        problem, waves, sample = self.problem, self.event.waves, self.event.sample
        now, before, initial = waves.now, self.event.before, self.rows.initial_stress[0]
        pieces = present_pieces(sample, waves.slip)
        relief = float(problem.blocks.mean_relief(before.slip))
        stress_before = initial.mean() + (before.load - relief)
        fields = {
            "slip": waves.slip.copy(),
            "slip_rate": waves.slip_rate.copy(),
            # Before the first step the waves have no stress yet.
            "shear_stress": (waves.stress if self.frames else self.event.start) + initial,
            "strength": pieces.strength - pieces.weakening_rate * waves.slip + initial,
        }
        self.frames.append(
            {name: fields[name] for name in self.save.fields}
            | self._energies()
            | {
                "time": now["time"],
                "load": before.load,
                "mean_stress": problem.interface.mean(fields["shear_stress"]),
                "mean_slip": problem.interface.mean(waves.slip),
                "top_slip_rate": waves.slip_rate.max(),
                "weakened_fraction": problem.interface.mean(residual_nodes(sample, waves.slip)),
                "machine_stress": stress_before + now["force"] / problem.interface.measure,
                "drive_travel": 2.0 * now["travel"],
            }
        )
        # Pictures at given fractions of the slip show the event better
        # than at equal times.
        while self._due and self._due[0] <= waves.slip.mean():
            self._due.pop(0)
            self.pictures.append(waves.u_rate.copy())
            self.picture_times.append(float(now["time"]))

    def _energies(self) -> dict[str, float]:
        """Return the energies of both blocks, J/m, in the middle of the last step.

        Two rows and two nodes, with unit springs between all numbers of a layer.
        The step is 0.2 s, so the middle is 0.1 s back, and the viscous time 0.3 s.

        >>> from types import SimpleNamespace
        >>> mesh = SimpleNamespace(
        ...     step=0.2, viscous_time=0.3, spacing=0.5, stiffness=6.0
        ... )
        >>> mesh.drive_mass = 3.0
        >>> mesh.mass, mesh.correction = (
        ...     np.array([2.0, 1.0]),
        ...     np.array([[2.0, 1.0], [1.0, 4.0]]),
        ... )
        >>> waves = SimpleNamespace(
        ...     u=np.array([[1.0, 2.0], [0.0, 0.5]]), u_rate=np.zeros((2, 2))
        ... )
        >>> waves.v, waves.v_rate = np.zeros((2, 2)), np.array([[0.0, 0.0], [0.0, 2.0]])
        >>> waves.now = {"speed": 0.5, "travel": 0.25, "friction": 0.125}
        >>> waves.slip, waves.slip_rate = np.array([1.5, 3.0]), np.array([5.0, 0.0])
        >>> event = SimpleNamespace(mesh=mesh, waves=waves, start=np.array([7.0, 4.0]))
        >>> record = SimpleNamespace(
        ...     event=event, _layers=[np.eye(8)], _begun=np.array([0.5, 1.0])
        ... )
        >>> energies = EventRecord._energies(record)  # w is -0.8 where v moves
        >>> blocks, added = (
        ...     1.0 + 4.0 + 0.25 + 0.64,
        ...     np.array([0.5, 2.0]),
        ... )  # 1.5 - 0.5 - 0.1 * 5
        >>> strain = (
        ...     blocks
        ...     + 0.5 * 0.5 * (2 * 0.25 + 2 * 1.0 + 4 * 4.0)
        ...     + 6.0 * (0.25 - 0.05) ** 2
        ... )
        >>> kinetic, work = 1.0 * 2.0**2 + 3.0 * 0.5**2, 0.5 * (7.0 * 0.5 + 4.0 * 2.0)
        >>> expected = [work, 0.25, strain, kinetic, work - 0.25 - strain - kinetic]
        >>> np.allclose([*energies.values()], expected)
        True
        >>> mesh.stiffness = np.inf
        >>> round(strain - EventRecord._energies(record)["strain_energy"], 9)
        0.24
        """
        # Rates are known in the middle of a
        # step, and displacements at its end.
        mesh, waves, now = self.event.mesh, self.event.waves, self.event.waves.now
        velocities = np.hstack([waves.u_rate, waves.v_rate]).astype(float)
        lag = mesh.viscous_time + 0.5 * mesh.step
        # w holds displacement and viscous time times rate, at the end
        # of the step.
        w = np.hstack([waves.u, waves.v]).astype(float) - lag * velocities
        # Twice the energy of a block, for both blocks.
        strain = 0.0
        for row, matrix in enumerate(self._layers):
            corners = np.concatenate([w[row], w[row + 1]])
            strain += float(corners @ (matrix @ corners))
        # Slip in the middle of the step. The correction of K stores
        # energy, too.
        added = waves.slip - self._begun - 0.5 * mesh.step * waves.slip_rate
        strain += 0.5 * mesh.spacing * float(added @ (mesh.correction @ added))
        speed = now["speed"]
        if np.isfinite(mesh.stiffness):
            strain += mesh.stiffness * (now["travel"] - 0.5 * mesh.step * speed) ** 2
        kinetic = (mesh.mass[:, None] * velocities**2).sum() + mesh.drive_mass * speed**2
        work = mesh.spacing * self.event.start @ added
        friction = 2.0 * now["friction"]
        return {
            "work": work,
            "friction_energy": friction,
            "strain_energy": strain,
            "kinetic_energy": kinetic,
            "attenuated_energy": work - friction - strain - kinetic,
        }

    def dataset(self, method: Any, stopped: str, path: SamplePath) -> xr.Dataset:
        """Return the event's frames, pictures of the block, and all events on the path."""
        problem, interface, event = self.problem, self.problem.interface, self.event
        arrival = event.waves.arrival
        length = problem.nucleation_lengths(self.rows.steepest_weakening_rate)[0]
        # If the front arrived nowhere, the
        # event began where slip grew fastest.
        first = int(event.before.direction.argmax())
        if np.isfinite(arrival).any():
            first = int(np.nanargmin(arrival))
        names, frames = self.frames[0], self.frames
        values: dict[str, Any] = {name: np.array([f[name] for f in frames]) for name in names}
        time = values.pop("time")
        values |= {
            "peak_strength": self.rows.strength[0],
            "arrival_time": arrival,
            "block_velocity": np.array(self.pictures),
            "critical_load": event.before.load,
            "critical_position": interface.x[first],
            "onset_time": arrival[first],
            **front_speeds(interface, 0, arrival, length),
        }
        of_events = event_variables(interface, inertia=True)
        values |= event_table(problem, self.rows, 0, path.all_events, of_events)
        nodal = {name: FIELDS[name] for name in self.save.fields} | OVER_NODES
        variables = {name: along(interface, variable) for name, variable in nodal.items()}
        variables |= VARIABLES | of_events
        values |= forces(values, problem.area, problem.whole_area)
        variables |= force_variables(variables)
        values["step_time"], values["moment_rate"] = np.array(self.steps).T
        frequency, spectrum = rate_spectrum(problem, values["step_time"], values["moment_rate"])
        values["moment_rate_spectrum"], variables["moment_rate_spectrum"] = spectrum
        taken = Variable("s", "time of a picture of the block", ("snapshot",))
        above = Variable("m", "height above the interface", ("height",))
        coordinates = {
            "frequency": frequency,
            "time": (time, TIME),
            "snapshot": (np.array(self.picture_times), taken),
            "height": (event.mesh.heights, above),
        }
        attributes = study_attributes(problem=problem, method=method) | {"stopped": stopped}
        return to_dataset(values, variables, coordinates, attributes, interface)

"""Frames: what a run shows at chosen moments, and their labels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.dynamics import monitor, stations
from stiction.dynamics.energies import fracture_energy, strain_energy
from stiction.dynamics.integrator import Run, State
from stiction.dynamics.stations import Stations
from stiction.dynamics.summary import per_area
from stiction.errors import InputError, unknown_name
from stiction.interface import Interface
from stiction.model import Names, check
from stiction.results import Variable, along

Floats = NDArray[np.float64]

_FIELDS: dict[str, Variable] = {
    "slip": Variable("m", "slip", ("time",)),
    "slip_rate": Variable("m/s", "slip rate", ("time",)),
    "shear_stress": Variable("Pa", "shear stress on the interface", ("time",)),
    "strength": Variable("Pa", "current strength", ("time",)),
}
_SCALARS: dict[str, Variable] = {
    "load": Variable("Pa", "load factor tau_0", ("time",)),
    "mean_stress": Variable("Pa", "mean shear stress on the interface", ("time",)),
    "mean_slip": Variable("m", "mean slip", ("time",)),
    "top_slip_rate": Variable("m/s", "largest slip rate", ("time",)),
    "weakened_fraction": Variable("1", "share of nodes at the residual strength", ("time",)),
    "seismic_moment": Variable("N", "seismic moment per length", ("time",)),
    "work": Variable("J/m", "work of the load on the slip", ("time",)),
    "strain_energy": Variable("J/m", "static strain energy of the slip", ("time",)),
    "fracture_energy": Variable("J/m", "energy dissipated above the residual", ("time",)),
    "radiated_energy": Variable("J/m", "work less friction less strain energy", ("time",)),
    "time_step": Variable("s", "size of the last step", ("time",)),
    "step_number": Variable("1", "steps taken so far", ("time",)),
}
_STEPS: dict[str, Variable] = {
    "step_time": Variable("s", "time after each step", ("step",)),
    "step_load": Variable("Pa", "load factor tau_0 after each step", ("step",)),
    "step_mean_stress": Variable("Pa", "mean shear stress after each step", ("step",)),
    "step_mean_slip": Variable("m", "mean slip after each step", ("step",)),
    "step_top_slip_rate": Variable("m/s", "largest slip rate after each step", ("step",)),
    "step_size": Variable("s", "size of each step", ("step",)),
    "step_work": Variable("J/m", "work of the load up to each step", ("step",)),
}
TIME = Variable("s", "time from zero load", ("time",))
FIELDS, SCALARS, STEPS = tuple(_FIELDS), tuple(_SCALARS), tuple(_STEPS)
"""Names of what frames hold, over time and the interface, over time, and over steps."""


def frame_variables(interface: Interface) -> dict[str, Variable]:
    """What all of them mean."""
    fields = {name: along(interface, variable) for name, variable in _FIELDS.items()}
    return (
        fields
        | stations.VARIABLES
        | {name: per_area(interface, variable) for name, variable in (_SCALARS | _STEPS).items()}
    )


def check_variables(names: Sequence[str]) -> None:
    """Refuse unknown names of fields."""
    known = check("variables", names, Names)
    problems = [unknown_name("variables", name, FIELDS) for name in known if name not in FIELDS]
    if problems:
        raise InputError(problems)


class Frames:
    """Frames and step records gathered so far, until they are taken away."""

    def __init__(
        self, run: Run, variables: Sequence[str], stations: Stations, *, steps: bool
    ) -> None:
        self.run, self.variables, self.stations = run, tuple(variables), stations
        self.step_names = STEPS if steps else STEPS[:1] if stations.nodes.size else ()
        self._frames: list[dict[str, Any]] = []
        self._records: list[Floats] = []

    def __len__(self) -> int:
        return len(self._frames)

    @property
    def pending(self) -> int:
        """Frames and recorded steps not yet taken away; a step with stations counts for more."""
        numbers = sum(record.size for record in self._records)
        return len(self._frames) + numbers // monitor.COLUMNS

    def room(self, steps: int) -> Floats:
        """An array for the record of so many steps; without rows if none is kept."""
        rows = steps if self.step_names else 0
        return np.empty((rows, monitor.COLUMNS + self.stations.columns))

    def add_steps(self, record: Floats) -> None:
        """Keep the record of some steps."""
        if record.shape[0]:
            self._records.append(record.copy())

    def add(self, state: State) -> None:
        """Keep a frame of the state as it is now."""
        run, nodes = self.run, self.run.setting.nodes
        medium, watch = run.medium, state.watch
        cell = medium.interface.cell
        dissipated = fracture_energy(run.friction, state.slip, nodes)
        fracture = float(dissipated.sum()) * cell
        with np.errstate(over="ignore"):  # just before a run becomes non-finite
            strain = strain_energy(state.slip_hat, medium.grid)
        friction = fracture + float((nodes.residual * state.slip).sum()) * cell
        work = float(watch[monitor.WORK])
        frame: dict[str, Any] = {
            "time": state.time,
            "load": state.load,
            "mean_stress": state.mean_stress,
            "mean_slip": float(state.slip.mean()),
            "top_slip_rate": float(state.rate.max()),
            "weakened_fraction": float(watch[monitor.SLID]) / state.slip.size,
            "seismic_moment": medium.shear_modulus * float(state.slip.sum()) * cell,
            "work": work,
            "strain_energy": strain,
            "fracture_energy": fracture,
            "radiated_energy": work - friction - strain,
            "time_step": float(watch[monitor.STEP]),
            "step_number": state.steps,
        }
        fields = {
            "slip": state.slip,
            "slip_rate": state.rate,
            "shear_stress": state.stress,
            "strength": run.strength_after(state.slip),
        }
        shape = medium.interface.shape
        frame |= {name: fields[name].reshape(shape).copy() for name in self.variables}
        self._frames.append(frame)

    def take(self) -> dict[str, NDArray[Any]]:
        """All gathered as arrays, time first; what was gathered is let go."""
        values = {
            name: np.array([frame[name] for frame in self._frames])
            for name in ("time", *SCALARS, *self.variables)
        }
        if not self._frames:
            shape = self.run.medium.interface.shape
            values |= {name: np.empty((0, *shape)) for name in self.variables}
        if self.step_names:
            record = np.concatenate([self.room(0), *self._records])
            values |= {name: record[:, i].copy() for i, name in enumerate(self.step_names)}
            values |= self.stations.of_record(record)
        self._frames, self._records = [], []
        return values

"""The arrested events of interfaces on their way to global sliding, as a dataset of their own."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction._checks import check_instance
from stiction.arrays import Array
from stiction.equilibrium.plane_path import plane_jumps
from stiction.equilibrium.solver import Solver
from stiction.model import to_plain
from stiction.problem import Problem, Sample
from stiction.results import Variable, coordinate, position, to_dataset

EVENT = Variable("1", "event number", ("event",))
VARIABLES = {
    "sample": Variable("1", "sample in which the event occurs", ("event",)),
    "load": Variable("Pa", "load factor at which the patch becomes unstable", ("event",)),
    "stress": Variable("Pa", "mean interface stress at that load", ("event",)),
    "position": Variable("m", "centre of the slip added by the event", ("event",)),
    "length": Variable("m", "length of the patch that slipped", ("event",)),
    "extent": Variable("m", "extent of the patch that slipped", ("event",)),
    "area": Variable("m2", "area of the patch that slipped", ("event",)),
    "mean_slip": Variable("m", "mean slip added to that patch", ("event",)),
    "moment": Variable("N", "shear modulus times slip added, per unit depth", ("event",)),
}


def equilibrium_events(
    problem: Problem,
    profiles: Any,
) -> xr.Dataset:
    """Instabilities that come to rest before the interface as a whole lets go.

    Parameters
    ----------
    problem : Problem
    profiles : array, mapping of arrays, xarray.Dataset or Sample
        Peak strength, Pa, or several profiles by name, as in `onset`.

    Returns
    -------
    xarray.Dataset
        Over 'event', sample by sample in the order of rising load: `sample`, `load` (Pa, tau_0),
        `stress` (Pa, the mean on the interface), `position` (m), `length` (m), `mean_slip` (m,
        over that length), and `moment` (N per unit depth: G times the slip added, integrated over
        the interface). On planes `position` has two components, along 'direction', `extent` (m,
        along 'direction') and `area` (m²) of the patch take the place of its length, and the
        moment is in N m.

    Raises
    ------
    InputError
        As `onset` does.

    Notes
    -----
    The patch jumps to the least equilibrium at the same load: an overdamped interface would stop
    there. Inertia may carry a rupture through; only `Rupture` decides that.
    """
    check_instance("problem", problem, Problem)
    rows = problem.sample(profiles)
    interface = problem.interface
    variables = dict(VARIABLES)
    coordinates = {}
    if interface.is_plane:
        sample, load, values = _of_plane(problem, rows)
        variables |= {name: position(interface, VARIABLES[name]) for name in ("position", "extent")}
        variables["moment"] = Variable("N m", "shear modulus times slip added", ("event",))
        coordinates["direction"] = coordinate(interface, "direction")
    else:
        sample, load, values = _of_line(problem, rows)
    mean_initial = rows.initial_stress.mean(axis=rows.axes)[sample] if load.size else np.zeros(0)
    stress = mean_initial + load * rows.load_profile.mean()
    return to_dataset(
        {"sample": sample, "load": load, "stress": stress} | values,
        variables,
        {"event": (np.arange(load.size), EVENT)} | coordinates,
        {"study": {"problem": to_plain(problem)}, "samples": rows.samples},
    )


Columns = tuple[NDArray[np.int64], Array, dict[str, NDArray[Any]]]
"""Samples, loads, and everything else of all events."""


def _of_line(problem: Problem, rows: Sample) -> Columns:
    _, events = Solver(problem).solve(rows)
    found = [(sample, event) for sample, several in events.items() for event in several]
    spacing = problem.interface.spacing
    modulus = problem.solid.shear_modulus
    values = {
        "position": np.array([event.position * spacing for _, event in found]),
        "length": np.array([event.length * spacing for _, event in found]),
        "mean_slip": np.array([event.mean_slip for _, event in found]),
        "moment": np.array([modulus * event.total_slip * spacing for _, event in found]),
    }
    sample = np.array([number for number, _ in found], dtype=np.int64)
    return sample, np.array([event.load for _, event in found], dtype=np.float64), values


def _of_plane(problem: Problem, rows: Sample) -> Columns:
    found = plane_jumps(problem, rows)
    modulus = problem.solid.shear_modulus
    values = {
        "position": np.reshape([jump.centre for _, jump in found], (-1, 2)),
        "extent": np.reshape([jump.extents for _, jump in found], (-1, 2)),
        "area": np.array([jump.area for _, jump in found]),
        "mean_slip": np.array([jump.mean_slip for _, jump in found]),
        "moment": np.array([modulus * jump.potency for _, jump in found]),
    }
    sample = np.array([number for number, _ in found], dtype=np.int64)
    return sample, np.array([jump.load for _, jump in found], dtype=np.float64), values

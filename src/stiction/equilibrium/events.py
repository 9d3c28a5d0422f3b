"""The arrested events of interfaces on their way to global sliding, as a dataset of their own."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from stiction._checks import check_instance
from stiction._model import to_plain
from stiction.equilibrium.solver import Solver
from stiction.problem import Problem
from stiction.results import Variable, to_dataset

EVENT = Variable("1", "event number", ("event",))
VARIABLES = {
    "sample": Variable("1", "sample in which the event occurs", ("event",)),
    "load": Variable("Pa", "load factor at which the patch becomes unstable", ("event",)),
    "stress": Variable("Pa", "mean interface stress at that load", ("event",)),
    "position": Variable("m", "centre of the slip added by the event", ("event",)),
    "length": Variable("m", "length of the patch that slipped", ("event",)),
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
        the interface).

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
    _, events = Solver(problem).solve(rows)
    found = [(sample, event) for sample, several in events.items() for event in several]
    sample = np.array([number for number, _ in found], dtype=np.int64)
    load = np.array([event.load for _, event in found], dtype=np.float64)
    mean_initial = rows.initial_stress.mean(axis=1)[sample] if found else np.zeros(0)
    spacing = problem.interface.spacing
    values = {
        "sample": sample,
        "load": load,
        "stress": mean_initial + load * rows.load_profile.mean(),
        "position": np.array([event.position * spacing for _, event in found]),
        "length": np.array([event.length * spacing for _, event in found]),
        "mean_slip": np.array([event.mean_slip for _, event in found]),
        "moment": np.array(
            [problem.solid.shear_modulus * event.total_slip * spacing for _, event in found]
        ),
    }
    return to_dataset(
        values,
        VARIABLES,
        {"event": (np.arange(len(found)), EVENT)},
        {"study": {"problem": to_plain(problem)}, "samples": rows.samples},
    )

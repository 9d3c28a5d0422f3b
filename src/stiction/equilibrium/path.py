"""The path itself: slip and stress at given loads, up to the onset of global sliding."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction._checks import check_instance, check_memory
from stiction.arrays import Array
from stiction.equilibrium.continuation import State, at_rest, exceeds, follow
from stiction.equilibrium.plane_path import plane_equilibria
from stiction.equilibrium.prepared import Setting
from stiction.equilibrium.solver import sample_of
from stiction.equilibrium.workspace import Sample
from stiction.errors import InputError
from stiction.model import real_array, to_plain
from stiction.problem import Problem
from stiction.problem import Sample as Samples
from stiction.results import Variable, along, coordinate, to_dataset

LOAD = Variable("Pa", "load factor tau_0", ("load",))
VARIABLES = {
    "slip": Variable("m", "slip", ("load",)),
    "stress": Variable("Pa", "shear stress on the interface", ("load",)),
    "mean_stress": Variable("Pa", "mean shear stress on the interface", ("load",)),
    "arrested_events": Variable("1", "instabilities that came to rest so far", ("load",)),
    "sliding": Variable("1", "whether the interface as a whole has let go", ("load",)),
}


class Path:
    """Equilibria of one sample at rising loads.

    Up to the first instability, and while no node is at its residual strength, each is the least
    solution of one complementarity problem; beyond, the path is followed event by event.
    """

    def __init__(self, setting: Setting, sample: Sample) -> None:
        self.setting, self.sample = setting, sample
        self.state = at_rest(sample)
        onset = setting.programme(sample.excess, sample.rate)
        self.simple_to = -np.inf if onset is None else onset.load

    def at(self, load: float) -> State:
        """The state at a load not below the last one asked for."""
        if load <= self.state.load:
            return self.state
        if load < self.simple_to:
            found = self.setting.programme(self.sample.excess, self.sample.rate, load)
            if found is not None and not exceeds(self.sample, found.slip):
                self.state = State(load, found.slip, found.stiff, self.state.direction)
                return self.state
            self.simple_to = -np.inf
        follow(self.setting, self.sample, self.state, load)
        return self.state


def _check_loads(loads: Any) -> Array:
    try:
        given = np.atleast_1d(real_array(loads))
    except TypeError as error:
        raise InputError(f"loads: must be an array of numbers (Pa); {error}") from None
    if given.ndim != 1 or given.size == 0 or not np.all(np.isfinite(given)):
        raise InputError(
            f"loads: must be a one-dimensional array of finite numbers, got shape {given.shape}"
        )
    if np.any(np.diff(given) <= 0.0):
        worst = int(np.argmin(np.diff(given)))
        raise InputError(
            f"loads: must rise; entries {worst} and {worst + 1} are {given[worst]:g} and"
            f" {given[worst + 1]:g} Pa"
        )
    if given[0] < 0.0:
        raise InputError(f"loads: must not be negative, got {given[0]:g} Pa")
    return given


def equilibrium_path(
    problem: Problem,
    profiles: Any,
    loads: Any,
) -> xr.Dataset:
    """Slip and stress of one interface at rising loads: patches grow, merge and become unstable.

    Parameters
    ----------
    problem : Problem
    profiles : array, mapping of arrays, xarray.Dataset or Sample
        Peak strength (Pa) of one sample, or several profiles by name, as in `onset`.
    loads : (loads,) array
        Load factors tau_0, rising, Pa.

    Returns
    -------
    xarray.Dataset
        Over 'load' and the nodes: `slip` (m) and `stress` (Pa); over 'load': `mean_stress` (Pa),
        `arrested_events` so far, and `sliding`. From the onset of global sliding on slip and
        stress are NaN and `sliding` is true.

    Raises
    ------
    InputError
        If there is more than one profile or the loads do not rise, and as `onset` does.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> path = st.equilibrium_path(problem, tau_p[0], [0.5e6, 2e6])
    >>> path.sliding.values
    array([False,  True])
    """
    given = _check_loads(loads)
    check_instance("problem", problem, Problem)
    rows = problem.sample(profiles)
    if rows.samples != 1:
        raise InputError(f"profiles: must be one sample, got {rows.samples}")
    interface = problem.interface
    check_memory("loads", 16.0 * given.size * interface.size)
    find = plane_equilibria if interface.is_plane else _line_equilibria
    slip, stress, events, sliding = find(problem, rows, given)
    values = {
        "slip": slip,
        "stress": stress,
        "mean_stress": stress.mean(axis=tuple(range(1, stress.ndim))),
        "arrested_events": events,
        "sliding": sliding,
    }
    coordinates = {"load": (given, LOAD)}
    coordinates |= {dim: coordinate(interface, dim) for dim in interface.dims}
    wide = {name: along(interface, VARIABLES[name]) for name in ("slip", "stress")}
    attributes = {"study": {"problem": to_plain(problem)}}
    return to_dataset(values, VARIABLES | wide, coordinates, attributes)


def _line_equilibria(
    problem: Problem, rows: Samples, loads: Array
) -> tuple[Array, Array, NDArray[np.int64], NDArray[np.bool_]]:
    """Slip (m) and stress (Pa), (loads, nodes), arrested events, and whether it slides."""
    setting = Setting(problem)
    sample = sample_of(rows, 0, setting.pieces)
    path = Path(setting, sample)
    initial = rows.initial_stress[0]
    slip = np.full((loads.size, problem.interface.size), np.nan)
    stress = np.full((loads.size, problem.interface.size), np.nan)
    events = np.zeros(loads.size, dtype=np.int64)
    sliding = np.zeros(loads.size, dtype=np.bool_)
    for i, load in enumerate(loads):
        state = path.at(float(load))
        events[i] = len(state.events)
        sliding[i] = state.sliding
        if not state.sliding:
            slip[i] = state.slip
            stress[i] = initial + load * setting.profile - state.stiff
    return slip, stress, events, sliding

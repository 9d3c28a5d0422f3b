"""The path of a sample: slip and stress at given loads, and arrested events.

Problem
-------
Return the slip d of the least equilibrium, equation (1) in `solver`, at
each of some rising loads, and the stress tau_i + load p - K d.

Algorithm
---------
1. Follow the sample to global sliding. This gives the arrested events
   and the last load.
2. For each load before sliding, start from the
   nearest known state: the equilibrium after the last
   event, or the equilibrium at the previous load.
3. Follow the stable path from there to the load. If this fails close to
   an event, use the state that is about to jump. If it fails at other
   loads, the load is within round-off of sliding.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy
from stiction.base.model import RealArray, check, check_memory, describe
from stiction.base.variables import Variable, force_variables, forces
from stiction.methods.equilibrium.events import (
    elongation_of,
    event_table,
    event_variables,
    travel_of,
)
from stiction.methods.equilibrium.slider import SliderSolver
from stiction.methods.equilibrium.solver import (
    SamplePath,
    follow_to_sliding,
    make_search,
    sample_of,
    warn_of_signs,
)
from stiction.methods.equilibrium.state import EquilibriumSearch, EquilibriumState, at_rest
from stiction.methods.equilibrium.strength import StaticSample
from stiction.problem.checks import doubt_sample
from stiction.problem.problem import Problem
from stiction.problem.results import along, study_attributes, to_dataset
from stiction.problem.sample import Sample
from stiction.problem.specimen import Blocks, Slider

LOAD = Variable("Pa", "load factor tau_0", ("load",))
VARIABLES = {
    "slip": Variable("m", "slip", ("load",)),
    "stress": Variable("Pa", "shear stress on the interface", ("load",)),
    "mean_stress": Variable("Pa", "mean shear stress on the interface", ("load",)),
    "arrested_events": Variable("1", "instabilities that came to rest so far", ("load",)),
    "sliding": Variable("1", "whether the interface as a whole slides", ("load",)),
}
OF_SPECIMENS = {
    "pressure": Variable("Pa", "normal pressure", ("load",)),
    "opening": Variable("m", "opening, the mean of both edges of a node", ("load",)),
    "travel": Variable("m", "travel of both drives together", ("load",)),
    "crosshead_travel": Variable("m", "travel of the machine's far ends", ("load",)),
}
EVENT = Variable("1", "event number", ("event",))
LOAD_RTOL = 1e-9
"""Largest relative distance of two loads that count as equal."""


def _check_loads(loads: Any) -> Array:
    """Return loads as an array, or raise an error.

    >>> _check_loads(0.5).tolist()
    [0.5]
    >>> _check_loads([0.0, 2.0]).tolist()
    [0.0, 2.0]
    >>> for loads in ([2.0, 2.0], [-1.0, 3.0], [1.0, np.inf]):
    ...     try:
    ...         print(_check_loads(loads))
    ...     except InputError as error:
    ...         print(str(error)[:43])
    loads: must be finite, non-negative and inc
    loads: must be finite, non-negative and inc
    loads: must be finite, non-negative and inc
    """
    given = np.atleast_1d(check("loads", loads, RealArray))
    # `prepend` also refuses a negative first load.
    rises = given.ndim == 1 and given.size and np.all(np.diff(given, prepend=-1e-300) > 0.0)
    if not (rises and np.isfinite(given[-1])):
        text = describe(given.tolist())
        raise InputError(f"loads: must be finite, non-negative and increasing, got {text}")
    return given


def _states_at(
    search: EquilibriumSearch, sample: StaticSample, path: SamplePath, loads: Array
) -> Iterator[EquilibriumState]:
    """Yield the equilibrium at each of the rising loads, until the interface slides.

    Events begin at 3 and 5 Pa, and end in states with the slip 3 and 5 m. The
    search returns 10 times the slip from which it starts, plus 1 m. It finds no
    equilibrium at 3 Pa, where the state with 0.2 m is about to jump:

    >>> from types import SimpleNamespace
    >>> from stiction.methods.equilibrium.events import ArrestedEvent
    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> sample = make_sample(np.full(2, 0.5), *np.ones((3, 2)), LINEAR)
    >>> def state(load, slip):
    ...     return EquilibriumState(load, np.full(2, slip), np.zeros(2))
    >>> def at(sample, start, load):
    ...     return state(load, 10.0 * start.slip[0] + 1.0) if load not in missing else None
    >>> search, missing = SimpleNamespace(at=at), [3.0]
    >>> events = [ArrestedEvent(state(load, 0.2), state(load, load)) for load in (3.0, 5.0)]
    >>> path = SamplePath(events[0].before, state(5.5, 0.1), 5.5, events, True, None)
    >>> def slips(loads, path):
    ...     return [float(found.slip[0]) for found in _states_at(search, sample, path, loads)]
    >>> slips([1.0, 2.0, 3.0, 4.0, 5.5, 6.0], path)
    [1.0, 11.0, 0.2, 31.0, 51.0]

    At 4 Pa an equilibrium is missing without an event nearby. An interface that
    ends creeps on after its last event:

    >>> missing.append(4.0)
    >>> last = ArrestedEvent(state(5.5, 0.1), state(5.5, 7.0))
    >>> slips([1.0, 4.0, 4.5], path)
    [1.0]
    >>> slips([6.0], path._replace(sliding=last))
    [71.0]
    """
    events = path.all_events
    starts = [at_rest(sample), *(event.after for event in events)]
    # Each state begins where the state before ended, because a path
    # only goes up.
    state = starts[0]
    for load in map(float, loads):
        # An interface that ends still creeps
        # after the event in which it slides.
        if load > path.last.load and path.sliding is None:
            return
        # 2. After an event, the path continues from the state to which
        # the event led.
        n_passed = sum(event.before.load < load for event in events)
        state = max(starts[n_passed], state, key=lambda start: start.load)
        # 3. Close to an event, round-off may hide the equilibrium that
        # is about to jump.
        reached = search.at(sample, state, load)
        if reached is None and n_passed < len(events):
            about_to_jump = events[n_passed].before
            if load > (1.0 - LOAD_RTOL) * about_to_jump.load:
                reached = about_to_jump
        if reached is None:
            return
        state = reached
        yield state


def equilibrium_path(
    problem: Problem, profiles: Any, loads: Any, *, method: Any = None
) -> xr.Dataset:
    """Return the slip and stress of an interface at rising loads, and the arrested events.

    Parameters
    ----------
    problem : Problem
    profiles : array, mapping of arrays, xarray.Dataset or Sample
        Peak strength (Pa) of a single sample, or several profiles by
        name, as in `onset`.
    loads : (loads,) array
        Load factors tau_0, rising, Pa.
    method : Rupture, optional
        Adds inertia to the events of equal blocks.

    Returns
    -------
    xarray.Dataset
        Over 'load' and the nodes: `slip` (m) and `stress` (Pa). Over
        'load': `mean_stress` (Pa), `arrested_events` so far, and
        `sliding`. After the onset of global sliding, slip and stress
        are NaN and `sliding` is true.

        Over 'event', all arrested events up to global sliding, even
        beyond the given loads, and the event in which an interface that
        ends slides: `event_load` (tau_0, Pa), `event_stress` (mean
        stress on the interface, Pa), `event_hypocentre`, from which the
        event starts, `event_position`, the centre of the slip,
        `event_start` and `event_end`, the ends of the patch (m),
        `event_length` of the patch that slipped (m), `event_mean_slip`
        over that length (m), `event_largest_slip` (m), `event_moment`,
        G times the integral of the added slip (N per unit depth), and
        `event_fracture_energy`, the energy dissipated above the
        residual strength (J/m). There are three stress drops (Pa).
        `event_area_stress_drop` is the mean over the patch.
        `event_slip_stress_drop` is the mean weighted by the added slip.
        `event_energy_stress_drop` is twice the energy that the slip
        releases beyond friction at the residual strength, over the
        integral of the slip. A `Rupture` adds `event_duration` (s).
        `stiction.external.event_table` returns the events as a table.

        On specimens, `load` is the mean stress that the drive would
        cause without slip. `travel` is the travel of both drives together (m).
        `crosshead_travel` (m) adds the deformation of the machine, force over
        stiffness, and is NaN under a dead load. Events also have
        `event_stress_drop` (drop of the mean stress, Pa), `event_travel` and
        `event_crosshead_travel` before the event (m), and `event_travel_step`
        (m). With a thickness, width or area, mean stresses are also given as
        forces: `force`, `event_force` and `event_force_drop` (N).

        On a slider, `pressure` (Pa) and `opening` (m) at the nodes
        are added. Slip and travel count from the beginning of the push.
        Two variables that need a fixed pressure are missing:
        `event_energy_stress_drop` and `event_fracture_energy`.

        On planes, positions have two components, along
        'direction'. `event_extent` (m) and `event_area`
        (m²) replace the length, the moment is in N m, and
        `event_magnitude` is Mw = (log10 M_0 - 9.1)/1.5.

    Raises
    ------
    InputError
        As in `onset`, or for several samples, or loads that do not rise.

    Notes
    -----
    A patch jumps to the least equilibrium at the same load, where an overdamped
    interface would stop. Inertia may carry it further: on equal blocks, pass a
    `Rupture` as `method`.

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
    check("problem", problem, Problem)
    blocks = isinstance(problem.specimen, Blocks)
    if method is not None and not (blocks and hasattr(method, "search")):
        raise InputError("method: must be st.Rupture() for st.Blocks. Otherwise leave it out")
    rows = problem.sample(profiles)
    if rows.samples != 1:
        raise InputError(f"profiles: must be a single sample, got {rows.samples}")
    doubt_sample(problem, rows)
    # Slip and stress, each of 8 bytes, at every load and node.
    interface = problem.interface
    check_memory("loads", 16.0 * given.size * interface.size)
    if isinstance(problem.specimen, Slider):
        values = SliderSolver(problem).at_loads(rows, given)
    else:
        values = _at_loads(problem, rows, given, method)
    variables = VARIABLES | OF_SPECIMENS | event_variables(interface, method is not None)
    for name in ("slip", "stress", "pressure", "opening"):
        variables[name] = along(interface, variables[name])
    values |= forces(values, problem.area, problem.whole_area)
    variables |= force_variables(variables)
    coordinates = {
        "load": (given, LOAD),
        "event": (np.arange(values["event_load"].size), EVENT),
    }
    attributes = study_attributes(problem=problem, **({"method": method} if method else {}))
    return to_dataset(values, variables, coordinates, attributes, interface)


def _at_loads(problem: Problem, rows: Sample, given: Array, method: Any) -> dict[str, Array]:
    """Return values at rising loads, Pa.

    A search that is made by hand: an event at 1 MPa, sliding at 2 MPa, and the slip
    of each equilibrium is 1 pm/Pa at every node. K d is replaced by 5 GPa/m times d:

    >>> from types import SimpleNamespace
    >>> import stiction as st
    >>> from stiction.methods.equilibrium.state import Jump, Outcome, PathStatus
    >>> from stiction.methods.equilibrium.strength import LINEAR
    >>> solid, law = st.Solid(3e9, 0.35, 1180.0), st.LinearWeakening(1e9)
    >>> problem = st.Problem(solid, st.Interface(0.8, 8), law)
    >>> rows = problem.sample(np.linspace(3e6, 4e6, 8))
    >>> def state(load, status=PathStatus.UNSTABLE):
    ...     return EquilibriumState(load, np.full(8, 1e-12 * load), np.ones(8), status=status)
    >>> names = "duration", "time", "radiated_energy", "settled"
    >>> known = {f"event_{name}": 7.0 for name in names}
    >>> rest = Jump(Outcome.ARRESTED, state(1.5e6), known=known)
    >>> jumps, states = iter([rest, Jump(Outcome.SLIDING, None)]), iter([state(1e6), state(2e6)])
    >>> search = SimpleNamespace(
    ...     pieces=LINEAR, next=lambda *_: next(states), jump=lambda *_: next(jumps),
    ...     at=lambda sample, start, load: state(load),
    ...     stress_released=lambda state: 5e9 * state.slip,
    ... )
    >>> method = SimpleNamespace(search=lambda problem: search)
    >>> values = _at_loads(problem, rows, np.array([5e5, 1e6, 1.7e6, 2e6, 2.1e6]), method)
    >>> values["slip"][:, 3].round(9).tolist()
    [5e-07, 1e-06, 1.7e-06, 2e-06, nan]
    >>> values["sliding"].tolist()
    [False, False, False, False, True]
    >>> values["mean_stress"].round(1).tolist()
    [497500.0, 995000.0, 1691500.0, 1990000.0, nan]
    >>> values["arrested_events"].tolist()
    [0, 0, 1, 1, 1]
    >>> values["event_load"].tolist()
    [1000000.0]
    >>> values["event_largest_slip"].round(12).tolist()
    [5e-07]
    """
    interface = problem.interface
    search = make_search(problem) if method is None else method.search(problem)
    warn_of_signs(problem)
    sample = sample_of(rows, search.pieces, 0)
    # 1.
    path = follow_to_sliding(search, sample, to_rest=True)
    events, end = path.all_events, path.last.load
    # An event counts at all loads above its own.
    n_events = np.searchsorted([event.before.load for event in events], given)
    # After sliding there is no state, and values stay NaN.
    slip, stress = np.full((2, given.size, interface.size), np.nan)
    travel, far = np.full((2, given.size), np.nan)
    sliding = np.ones(given.size, dtype=np.bool_)
    for i, state in enumerate(_states_at(search, sample, path, given)):
        load = float(given[i])
        sliding[i] = load > end
        slip[i] = state.slip
        released = search.stress_released(state)
        stress[i] = rows.initial_stress[0].reshape(-1) + load * sample.profile - released
        if problem.specimen is not None:
            travel[i] = travel_of(problem, load, state.slip)
            far[i] = travel[i] + elongation_of(problem, stress[i].mean())
    if not path.known and sliding.any():
        warn_accuracy(
            f"no equilibrium was found beyond {end:g} Pa, but sliding was not proved either: the"
            " path ends at this load"
        )
    # Kernels have flat nodes, and results the shape of the interface.
    wide = (given.size, *interface.shape)
    values = {
        "slip": slip.reshape(wide),
        "stress": stress.reshape(wide),
        "mean_stress": interface.mean(stress.reshape(wide)),
        # The event in which an interface slides
        # is the last, and is not arrested.
        "arrested_events": np.minimum(n_events, len(path.events)),
        "sliding": sliding,
    }
    variables = event_variables(interface, inertia=method is not None)
    values |= event_table(problem, rows, 0, events, variables)
    if interface.is_free:
        values |= {"travel": travel, "crosshead_travel": far}
    return values

"""`simulate_rupture`: a rupture in space and time."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.base.errors import InputError, warn_accuracy
from stiction.base.model import Number, Progress, checked
from stiction.base.progress import Meter
from stiction.base.variables import FRICTION_COEFFICIENT, force_variables, forces
from stiction.methods.dynamics import checks
from stiction.methods.dynamics.integrator import Run
from stiction.methods.dynamics.method import Rupture, make_run
from stiction.methods.dynamics.save import OVER_NODES, SCALARS, Recorder, Save, open_rupture
from stiction.methods.dynamics.simulate_event import simulate_event
from stiction.methods.dynamics.state import RuptureState
from stiction.methods.dynamics.summary import arrested_events, rate_spectrum, summary
from stiction.methods.equilibrium.events import event_table, event_variables
from stiction.problem.checks import doubt_sample
from stiction.problem.problem import Problem, refusals
from stiction.problem.results import along, study_attributes, to_dataset
from stiction.problem.sample import Sample

if TYPE_CHECKING:
    import xarray as xr


@checked
def simulate_rupture(
    problem: Problem,
    profiles: Any,
    *,
    method: Rupture,
    save: Save | None = None,
    event: Number | None = None,
    progress: Progress = True,
) -> xr.Dataset:
    """Simulate an interface from its first slip to global sliding, in space and time.

    On a specimen, simulate an event from an unstable equilibrium until
    all is at rest.

    Parameters
    ----------
    problem : Problem
    profiles : array, mapping of arrays, xarray.Dataset or Sample
        Peak strength (Pa) of a single sample, or several profiles by
        name, as in `onset`. If the initial stress is above the
        strength, slip begins at once.
    method : Rupture
        Load, numerical options and end of the run. The run begins at
        the first slip, regardless of `start`, and keeps its results if
        `max_steps` ends it.
    save : Save, optional
        Results to keep and the place to store them.
        By default, slip, slip rate and shear stress
        are kept every ten explicit steps, in memory.
    event : int, optional
        On specimens, the number of the event in order, from 0. By
        default it is the sliding event.
    progress : bool or callable
        True shows progress on standard error after a second. A callable
        receives the number of steps taken and 0.

    Returns
    -------
    xarray.Dataset
        Over ('time', 'x'): the fields. Over 'time': `load`,
        `mean_stress`, `mean_slip`, `top_slip_rate`,
        `weakened_fraction`, `seismic_moment`, `work` and energies. Over
        'step': `step_time`, `moment_rate`, and some of the above after
        every step. Over ('step', 'station'): `station_slip`,
        `station_slip_rate` and `station_shear_stress`. Over 'station':
        `station_x` (and `station_y`), the places of the nodes. Over
        'x': `peak_strength` and `arrival_time`. Over 'event': the table
        of events, with the variables of `equilibrium_path`,
        `event_time`, `event_duration`, `event_radiated_energy` and
        `event_settled`. Over
        'frequency': `moment_rate_spectrum`, the amplitude spectrum of
        the moment rate from the onset to the next event or to the end
        of the run, which cuts off an interface that slides. The scalars
        of `Rupture` refer to the run so far. Forces and the
        `friction_coefficient` are as in `onset`. The attribute
        `stopped` is the reason why the run ended.

        On a specimen, there are also `machine_stress` (with a thickness
        `machine_force`, N) and `drive_travel` over 'time', and energies
        relative to the stress at which the event began.
        `block_velocity` over ('snapshot', 'height', 'x') is the
        velocity along x in the upper block (m/s) at a few times. The
        lower block is its mirror image and moves the opposite way. The table
        holds all events on the path that came to rest.

    Raises
    ------
    InputError
        If any argument is invalid. The message lists every mistake.
    StoreError
        If `save.to` cannot be written. Frames
        that were written stay readable.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(
    ...     problem.interface, seed=1
    ... )
    >>> method = st.Rupture(loading_rate=1e8, stop="onset")
    >>> run = st.simulate_rupture(
    ...     problem, tau_p[0], method=method, save=st.Save(["slip"])
    ... )
    >>> run.attrs["stopped"]
    'onset'
    """
    save = Save() if save is None else save
    if refused := refusals(problem, method):
        raise InputError(refused)
    rows = problem.sample(profiles, accept=method.accepts)
    if rows.samples != 1:
        raise InputError(f"profiles: must be a single sample, got {rows.samples}")
    doubt_sample(problem, rows)
    if problem.specimen is not None:
        return simulate_event(problem, rows, method, save, event, progress)
    if event is not None:
        raise InputError("event: only specimens have numbered events. Leave event out")
    stations = save.nodes(problem.interface)
    checks.warn_of_coarse_grid(problem, rows)
    run = make_run(method, method.medium(problem), rows, 0, stations)
    state = checks.at_first_slip(run)
    if state is None:
        raise InputError(
            f"load: does not reach the first slip, tau_0 = {run.first_load:.6g} Pa, before the run"
            " ends. Raise the load, Load.initial_stress where slip should begin, or end_time"
        )
    attributes = study_attributes(problem=problem, method=method)
    recorder = Recorder(run, save, attributes | {"stopped": "running"})
    if recorder.begin(state) and save.to is not None:
        return open_rupture(save.to, fields=())
    if state.steps == 0:
        recorder.add(state)
    with Meter("rupture", show=progress, unit="steps") as meter:
        stopped = _record_to_end(run, state, recorder, method.max_steps, meter)
    recorder.attributes["stopped"] = stopped
    checks.warn_of_slip(run, state)
    recorder.flush(state, last=True)
    run.cut_event(state)
    checks.warn_of_cut_events([run.cut_short])
    dataset = recorder.take() if save.to is None else open_rupture(save.to, fields=())
    dataset.attrs["stopped"] = stopped
    result = _complete(dataset, method, run, state, rows)
    if stopped in ("rest", "time"):
        checks.warn_of_survival(method.stop, [result])
    checks.warn_of_fast_loading([checks.rise_in_crossing(run, result)])
    recorder.finish(result, stopped)
    return result


def _record_to_end(
    run: Run, state: RuptureState, recorder: Recorder, max_steps: int, meter: Meter
) -> str:
    """Take steps and keep frames until the run ends. Return the reason.

    Explicit steps come in groups of 20, and implicit steps in groups of 2. If
    `max_steps` is near, all is written at once.

    >>> from types import SimpleNamespace
    >>> from stiction.methods.dynamics.state import Reason
    >>> def recorded(max_steps, ending=None, reason=Reason.DONE):
    ...     def take_steps(state, count):
    ...         calls.append(count)
    ...         state.steps, state.explicit = state.steps + count, True
    ...         return count, reason
    ...
    ...     calls, meter = [], SimpleNamespace(advance=lambda taken: None)
    ...     step = {
    ...         "time": 1.0,
    ...         "mean_stress": 2e6,
    ...         "weakened_nodes": 3,
    ...         "load": 5.0,
    ...     }
    ...     state = SimpleNamespace(steps=0, explicit=False, now={"step": step})
    ...     recorder = SimpleNamespace(
    ...         save=SimpleNamespace(every=20), take_steps=take_steps
    ...     )
    ...     words = {True: "now", False: "flush"}
    ...     recorder.flush = lambda state, at_once=False: calls.append(
    ...         words[at_once]
    ...     )
    ...     recorder.add = lambda state: calls.append("add")
    ...     run = SimpleNamespace(
    ...         ending=lambda state, reason: ending if state.steps > 20 else None
    ...     )
    ...     run.setting = SimpleNamespace(thresholds=SimpleNamespace(breakable=4))
    ...     return (
    ...         _record_to_end(run, state, recorder, max_steps, meter),
    ...         calls,
    ...         meter.note,
    ...     )
    >>> recorded(23)[:2]
    ('max_steps', [2, 'add', 'flush', 20, 'add', 'flush', 'now', 1, 'add', 'flush'])
    >>> recorded(99, ending="sliding")
    ('sliding', [2, 'add', 'flush', 20, 'add'], 't = 1 s, mean stress 2.0000 MPa, 75% weakened')
    """
    interval = recorder.save.every
    while state.steps < max_steps:
        # An implicit step is much longer than an explicit step.
        count = interval if state.explicit else max(1, interval // 10)
        if state.steps + count >= max_steps:
            recorder.flush(state, at_once=True)
        taken, reason = recorder.take_steps(state, min(count, max_steps - state.steps))
        try:
            checks.check_finite(run, state, reason)
        except FloatingPointError as error:
            warn_accuracy(str(error))
            return f"not finite: {error}"
        recorder.add(state)
        step = state.now["step"]
        meter.note = (
            f"t = {step['time']:.6g} s, mean stress {step['mean_stress'] * 1e-6:.4f} MPa, "
            f"{step['weakened_nodes'] / run.setting.thresholds.breakable:.0%} weakened"
        )
        meter.advance(taken)
        if stopped := run.ending(state, reason):
            return stopped
        recorder.flush(state)
    return "max_steps"


def _spectrum(dataset: xr.Dataset, run: Run, state: RuptureState) -> tuple[Any, Any]:
    """Return the spectrum of the highest instability, up to the next instability or the end.

    The highest instability is at 2 s, and the next event at 4 s. Events before
    it do not count.

    >>> from types import FunctionType, SimpleNamespace
    >>> def given(problem, time, rate):
    ...     return time.tolist(), rate.tolist()
    >>> plain = FunctionType(
    ...     _spectrum.__code__, globals() | {"rate_spectrum": given}
    ... )
    >>> data = {"step_time": np.arange(1.0, 7.0), "moment_rate": 10.0 * np.arange(6)}
    >>> data = {
    ...     name: SimpleNamespace(values=values) for name, values in data.items()
    ... }
    >>> run = SimpleNamespace(medium=SimpleNamespace(problem=None))
    >>> run.events = [{"time": 1.0}, {"time": 2.0}, {"time": 5.0}, {"time": 4.0}]
    >>> results = {"onset_time": 2.0, "instabilities": 4}
    >>> plain(data, run, SimpleNamespace(now={"results": results}))
    ([2.0, 3.0, 4.0], [10.0, 20.0, 30.0])
    >>> run.events = run.events[:2]
    >>> plain(data, run, SimpleNamespace(now={"results": results}))[0]
    [2.0, 3.0, 4.0, 5.0, 6.0]
    >>> plain(
    ...     data,
    ...     run,
    ...     SimpleNamespace(now={"results": results | {"instabilities": 0}}),
    ... )[0]
    []
    """
    moment_rate = dataset["moment_rate"].values
    time, onset = dataset["step_time"].values, float(state.now["results"]["onset_time"])
    later = [float(event["time"]) for event in run.events if event["time"] > onset]
    inside = (time >= onset) & (time <= min(later, default=np.inf))
    inside &= state.now["results"]["instabilities"] > 0
    return rate_spectrum(run.medium.problem, time[inside], moment_rate[inside])


def _complete(
    dataset: xr.Dataset, method: Rupture, run: Run, state: RuptureState, rows: Sample
) -> xr.Dataset:
    """Return a dataset with the variables of the whole run added."""
    problem, interface = run.medium.problem, run.medium.interface
    variables = {name: along(interface, variable) for name, variable in OVER_NODES.items()}
    for name, variable in replace(method, events=0).variables(problem).items():
        variables[name] = replace(variable, dims=variable.dims[1:])  # without 'sample'
    values: dict[str, Any] = {
        "peak_strength": run.setting.nodes.peak.reshape(interface.shape),
        "arrival_time": state.arrival.reshape(interface.shape),
    }
    frequency, spectrum = _spectrum(dataset, run, state)
    values["moment_rate_spectrum"], variables["moment_rate_spectrum"] = spectrum
    with np.errstate(over="ignore", invalid="ignore"):  # after a run that became non-finite
        values |= summary(run, state)
        events, of_events = arrested_events(run), event_variables(interface, inertia=True)
        values |= event_table(problem, rows, 0, events, of_events)
    variables |= of_events
    pressure = float(rows.mean(rows.normal_pressure)[0])  # NaN if the problem has none
    if not np.isnan(pressure):
        values["friction_coefficient"] = values["critical_stress"] / pressure
        variables["friction_coefficient"] = replace(FRICTION_COEFFICIENT, dims=())
    values |= forces(values, problem.area, problem.whole_area)
    variables |= force_variables(variables)
    # Energies and moment are there already, over 'time'. Their last
    # value is the total.
    added = {name: value for name, value in values.items() if name not in SCALARS}
    return dataset.merge(to_dataset(added, variables, {"frequency": frequency}, {}, interface))

"""simulate_rupture: one rupture in space and time."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction.dynamics import monitor
from stiction.dynamics.checkpoint import read_checkpoint, write_checkpoint
from stiction.dynamics.checks import (
    check_finite,
    check_pace,
    warn_if_coarse,
    warn_if_reversed,
    warn_if_reversed_before,
    warn_if_unresolved,
)
from stiction.dynamics.frames import Frames, check_variables
from stiction.dynamics.integrator import Run, State
from stiction.dynamics.loading import first_reach, load_history, uniform_rate
from stiction.dynamics.method import (
    Rupture,
    first_slip,
    make_run,
    set_stop,
)
from stiction.dynamics.options import Stop, check_options
from stiction.dynamics.runaway import refused_stop, runs_away
from stiction.dynamics.stations import make_stations
from stiction.dynamics.stream import Stream, chunk_dataset, open_rupture
from stiction.dynamics.summary import front_speed, summary
from stiction.errors import InputError, warn_accuracy
from stiction.gaps import gather, with_gaps
from stiction.model import describe, real_array, to_plain
from stiction.problem import Problem, named_profiles, refusals
from stiction.profiles import at_nodes
from stiction.progress import Meter
from stiction.results import DIRECTION, Variable, along, coordinate

_MOST_STEPS = 50_000  # recorded between frames that lie far apart, before they are streamed
_NEAR_ONSET = 0.02  # fall of the mean stress, in stress scales, that counts as 'around'

_ALONG: dict[str, Variable] = {
    "peak_strength": Variable("Pa", "peak strength tau_p", ()),
    "arrival_time": Variable("s", "when the front arrived, see `arrival`", ()),
    "front_speed": Variable("m/s", "apparent speed of the rupture front", ()),
}


@dataclasses.dataclass(frozen=True)
class Progress:
    """What a progress callback is told.

    Attributes
    ----------
    time : float
        s.
    load, mean_stress : float
        Pa.
    steps : int
        Of both kinds so far.
    weakened_fraction : float
        Share of nodes at the residual strength.
    """

    time: float
    load: float
    mean_stress: float
    steps: int
    weakened_fraction: float


def _progress(state: State) -> Progress:
    return Progress(
        state.time,
        state.load,
        state.mean_stress,
        state.steps,
        float(state.watch[monitor.SLID]) / state.slip.size,
    )


def _note(now: Progress) -> str:
    return (
        f"t = {now.time:.6g} s, mean stress {now.mean_stress * 1e-6:.4f} MPa,"
        f" {now.weakened_fraction:.0%} weakened"
    )


def _initial(run: Run, slip: Any, load: float | None) -> State:
    if slip is None or load is None:
        time = first_slip(run)
        check_pace(run, time)
        warn_if_reversed_before(run, time)
        return run.start(time)
    shape = run.medium.interface.shape
    try:
        start = real_array(slip)
    except TypeError:
        start = np.full(1, np.nan)
    if start.shape != shape or not (np.all(np.isfinite(start)) and np.all(start >= 0.0)):
        raise InputError(
            f"initial_slip: must be {shape} numbers in m, finite and nowhere negative, got "
            f"{describe(slip)}"
        )
    time = first_reach(run.history, float(load), "initial_load")
    if time == 0.0 and run.history[1][0] > load:
        raise InputError(
            f"initial_load: {load:.6g} Pa is below the load at t = 0, {run.history[1][0]:.6g} Pa"
        )
    check_pace(run, time)
    return run.start(time, start)


def simulate_rupture(
    problem: Problem,
    profiles: Any,
    *,
    method: Rupture,
    load: Any = None,
    initial_slip: Any = None,
    initial_load: float | None = None,
    variables: Sequence[str] = ("slip", "slip_rate", "shear_stress"),
    every: int = 10,
    every_implicit: int = 1,
    every_near_onset: int | None = None,
    interval: float | None = None,
    steps: bool = True,
    stations: Mapping[str, Any] | None = None,
    stop: Stop | None = None,
    end_time: float | None = None,
    arrival: float = 0.5,
    store: str | Path | None = None,
    chunk: int = 64,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 10_000,
    restart: str | Path | None = None,
    progress: bool | Callable[[Progress], Any] | None = True,
) -> xr.Dataset:
    """Simulate one interface from its first slip to global sliding, in space and time.

    Parameters
    ----------
    problem : Problem
    profiles : array, mapping of arrays, xarray.Dataset or Sample
        Peak strength (Pa) of one sample, infinite where nothing ever breaks, or several profiles
        by name, as in `onset`. Where the initial stress is above the strength, slip begins at
        once.
    method : Rupture
        Loading rate and numerical options. The run begins at the first slip, whatever its `start`.
    load : callable or (times, values), optional
        tau_0(t), Pa, instead of the method's constant rate. It must not fall before the first
        slip. A callable needs `end_time`.
    initial_slip, initial_load : (nodes,) array in m, float in Pa, optional
        Start from this equilibrium (with an empty memory) instead of from rest at first slip.
    variables : sequence of {"slip", "slip_rate", "shear_stress", "strength"}
        Fields to keep.
    every, every_implicit, every_near_onset : int
        Steps between frames: explicit ones, implicit ones (while the interface creeps), and
        explicit ones until the mean stress has fallen by 2 % of the stress scale of `Rupture` (if
        given). Since steps shorten as the interface accelerates, frames are dense in time around
        onset anyhow.
    interval : float, optional
        s; at most one frame in each interval of this length, counted from zero load.
    steps : bool
        Keep time, load, mean stress, ... of every step, over 'step'.
    stations : mapping of str to float or (float, float), optional
        Names and places x, on a plane (x, y), in m, where slip, slip rate and shear stress
        (traction) are recorded after every step, whatever `every` and `variables`: 24 bytes a step
        and station. The node nearest to a place is taken.
    stop : {"sliding", "onset", "rest", "runaway", "time"}, optional
        As `method.stop`, which holds if left out; or "time", only at `end_time`. Unless it waits
        for `end_time`, a run also ends where nothing slips and the load has stopped rising for
        good ("rest").
    end_time : float, optional
        s; the run never goes beyond it (except for a part of the last explicit step).
    arrival : float
        Share of its way to the residual that the strength of a node has lost when the front has
        arrived there, in (0, 1]: 0.5 is the middle of the cohesive zone, 1e-3 its tip.
    store : path, optional
        Folder to stream frames to, in chunks of `chunk` frames; memory then stays bounded, the
        result holds no fields, and `open_rupture` reads them back.
    checkpoint : path, optional
        File to save the whole state to, every `checkpoint_every` steps and at the end.
    restart : path, optional
        Checkpoint of the same run to go on from; every later number is the same, bit by bit. The
        result holds what comes after it (with `store`, everything).
    progress : bool or callable
        True shows how far it is, on standard error, once it takes more than two seconds; a
        callable is called with a `Progress` after each frame.

    Returns
    -------
    xarray.Dataset
        Over ('time', 'x') the fields; over 'time' `load`, `mean_stress`, energies and more; over
        'step' the same scalars at every step; over ('step', 'station') `station_slip`,
        `station_slip_rate` and `station_shear_stress`, with `step_time`, and `station_x` (and
        `station_y`), where the nodes are; over 'x' `peak_strength`, `arrival_time` and
        `front_speed`; and the scalars of `Rupture` for the run so far. The attribute `stopped`
        says why it ended.

    Raises
    ------
    InputError
        Naming all that does not fit.
    OSError
        If a stream cannot be written; what was written stays readable.
    """
    check_options(dict(locals()))
    check_variables(variables)
    if refused := refusals(problem, method) or refused_stop(problem, stop or method.stop):
        raise InputError(refused)
    given, measured = gather(problem, named_profiles(profiles), "refuse")
    rows = problem.sample(given, accept=method.accepts)
    if rows.samples != 1:
        raise InputError(f"profiles: one sample at a time, got {rows.samples}")
    problem.warn_of_units(rows.mean_strength, float(rows.residual_strength.mean()))
    history = uniform_rate(method.loading_rate) if load is None else load_history(load, end_time)
    warn_if_coarse(problem, rows)
    run = make_run(method, problem.friction, method.medium(problem), rows, 0, history)
    stop = stop or method.stop
    places = make_stations(stations, problem.interface)
    run.setting = run.setting._replace(stations=places.nodes)
    set_stop(run.control, stop)
    passed = min(problem.friction.slip_at(1.0 - arrival), problem.friction.reach)
    run.control[monitor.ARRIVAL] = passed / problem.friction.reach
    if end_time is not None:
        run.control[monitor.END_TIME] = end_time
    if restart is None:
        if initial_slip is not None:
            initial_slip = at_nodes("initial_slip", initial_slip, "slip", problem.interface).values
        state = _initial(run, initial_slip, initial_load)
    else:
        state = read_checkpoint(restart, run)
    if end_time is not None and state.time >= end_time:
        raise InputError(
            f"end_time: {end_time:g} s is not after the start of the run, t = {state.time:.6g} s "
            "(first slip)"
        )
    attributes = {
        "study": {"problem": to_plain(problem), "method": to_plain(method)},
        "stopped": "running",
    }
    stream = None
    if store is not None:
        stream = Stream(store, resume=restart is not None)
        if restart is not None:
            stream.drop_after(state.steps)
    frames = Frames(run, variables, places, steps=steps)

    def flush() -> None:
        if stream is not None and frames.pending:
            part = chunk_dataset(frames.take(), problem.interface, places, attributes)
            stream.append(part, state.steps)

    if restart is None:
        frames.add(state)
    before = state.time
    next_checkpoint = state.steps + checkpoint_every
    reason = "max_steps"
    reversed_ = False
    record = frames.room(max(every, every_implicit, every_near_onset or 1))
    meter = Meter("rupture", show=progress is True, unit="steps").start()
    try:
        while state.steps < method.max_steps:
            count = every if state.explicit else every_implicit
            falling = state.watch[monitor.LOCAL_STRESS] - state.mean_stress
            near = _NEAR_ONSET * state.watch[monitor.SCALE]
            if every_near_onset is not None and state.explicit and falling < near:
                count = every_near_onset
            count = min(count, method.max_steps - state.steps)
            part = record[:count]
            taken, code = run.advance(state, count, part)
            frames.add_steps(part[:taken])
            if code == monitor.NOT_FINITE:
                check_finite(run, state, code)
            reversed_ = reversed_ or warn_if_reversed(run, state)
            ended = _reason(code, run, state, stop)
            if ended or interval is None or state.time // interval > before // interval:
                frames.add(state)
            before = state.time
            if callable(progress):
                progress(_progress(state))
            meter.note, meter.done = _note(_progress(state)), state.steps
            if ended:
                reason = ended
                break
            if len(frames) >= chunk or frames.pending >= _MOST_STEPS:
                flush()
            if checkpoint is not None and state.steps >= next_checkpoint:
                flush()
                write_checkpoint(checkpoint, run, state)
                next_checkpoint = state.steps + checkpoint_every
    except FloatingPointError as error:
        reason = f"not finite: {error}"
        warn_accuracy(str(error))
    except BaseException:
        # Interrupted or out of disk: what was computed is worth keeping.
        _quietly(flush)
        raise
    finally:
        meter.stop()
    attributes["stopped"] = reason
    warn_if_unresolved(problem, run, state)
    flush()  # before the checkpoint, which counts on the frames up to it
    if checkpoint is not None and not reason.startswith("not finite"):
        write_checkpoint(checkpoint, run, state)
    if stream is not None:
        dataset = open_rupture(stream.folder, variables=(), steps=False)
        dataset.attrs["stopped"] = reason
        dataset.attrs["store"] = str(stream.folder)
    else:
        dataset = chunk_dataset(frames.take(), problem.interface, places, attributes)
    result = _complete(dataset, problem, method, run, state)
    return result if measured is None else with_gaps(problem, result, measured)


def _quietly(action: Callable[[], None]) -> None:
    try:
        action()
    except OSError:
        return  # the first error is already on its way


def _reason(code: int, run: Run, state: State, stop: str) -> str | None:
    """Why the run ends here, or None."""
    if code == monitor.ALL_SLID:
        return "sliding"
    if code == monitor.DROPPED:
        return "onset"
    if code == monitor.AT_REST:
        return "rest"
    if stop == "runaway" and runs_away(run, state):
        return "runaway"
    if run.ended(state):
        return "time"
    if stop != "time" and run.resting(state):
        return "rest"
    return None


def _complete(
    dataset: xr.Dataset, problem: Problem, method: Rupture, run: Run, state: State
) -> xr.Dataset:
    """Add what belongs to the run as a whole."""
    fields: dict[str, NDArray[Any]] = {
        "peak_strength": run.setting.nodes.strength,
        "arrival_time": state.arrival,
        "front_speed": front_speed(problem, run, state),
    }
    interface = problem.interface
    for name, values in fields.items():
        variable = along(interface, _ALONG[name])
        attrs = {"units": variable.units, "long_name": variable.long_name}
        dataset[name] = (variable.dims, values.reshape(interface.shape), attrs)
    with np.errstate(over="ignore", invalid="ignore"):  # after a run that became non-finite
        scalars = summary(problem, run, state)
    for name, value in scalars.items():
        variable = method.variables(problem)[name]
        label = {"units": variable.units, "long_name": variable.long_name}
        # Energies and moment are already there over 'time'; their last value is the total.
        if name not in dataset:
            dataset[name] = (variable.dims[1:], value, label)
    if interface.is_plane:
        names, what = coordinate(interface, DIRECTION)
        dataset = dataset.assign_coords({DIRECTION: (DIRECTION, names)})
        dataset[DIRECTION].attrs["long_name"] = what.long_name
    return dataset

"""Checkpoints: a run's whole state in one file, from which it goes on as if never interrupted."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.dynamics import monitor
from stiction.dynamics.integrator import Run, State
from stiction.errors import InputError
from stiction.files import UNREADABLE, read_arrays, write_arrays

FORMAT = 6

_SLIPS = np.linspace(0.0, 5.0, 101)  # where laws are compared, in units of d_c

_NAMES = {
    "nodes": "number of nodes",
    "spacing": "spacing of the nodes (m)",
    "impedance": "G/(2 c_s) (Pa s/m)",
    "time_step": "explicit time step (s)",
    "poles": "memory kernel",
    "weights": "memory kernel",
    "stiffness": "elastic stiffness",
    "law": "friction law",
    "tau_p": "peak strength (Pa)",
    "tau_r": "residual strength (Pa)",
    "weakening_rate": "weakening rate (Pa/m)",
    "profile": "load profile",
    "initial_stress": "initial stress (Pa)",
    "load_times": "load history (s)",
    "load_values": "load history (Pa)",
    "control": "step control of the method",
}


def identity(run: Run) -> dict[str, NDArray[Any]]:
    """All that a run depends on besides its state."""
    medium, setting = run.medium, run.setting
    grid, nodes = medium.grid, setting.nodes
    # When to stop may differ between the parts of one run; how to step may not.
    control = run.control.copy()
    stops = [monitor.SLID_STOP, monitor.EVENT_STOP, monitor.REST_STOP, monitor.END_TIME]
    control[stops] = 0.0
    values: dict[str, Any] = {
        "nodes": medium.interface.nodes,
        "spacing": np.squeeze(medium.interface.spacings),
        "impedance": grid.impedance,
        "time_step": medium.step,
        "stiffness": grid.stiffness,
        "poles": grid.poles,
        "weights": grid.weights,
        "law": np.concatenate([run.friction.fraction(_SLIPS), *map(np.ravel, setting.law)]),
        "tau_p": nodes.strength,
        "tau_r": nodes.residual,
        "weakening_rate": nodes.weakening,
        "profile": nodes.profile,
        "initial_stress": nodes.initial,
        "load_times": run.history[0],
        "load_values": run.history[1],
        "control": control,
    }
    return {name: np.asarray(value) for name, value in values.items()}


def write_checkpoint(path: str | Path, run: Run, state: State) -> None:
    """Save the state of a run, with all that it depends on.

    Parameters
    ----------
    path : path
        Replaced as a whole if it exists.
    run, state

    Raises
    ------
    OSError
        If it cannot be written; a file that was there before is left as it was.
    """
    arrays: dict[str, Any] = {"format": FORMAT}
    arrays |= {f"run_{name}": value for name, value in identity(run).items()}
    arrays |= {f"state_{f.name}": getattr(state, f.name) for f in dataclasses.fields(State)}
    try:
        write_arrays(Path(path), arrays)
    except OSError as error:
        raise OSError(f"checkpoint: cannot write {str(path)!r} ({error})") from error


def _difference(name: str, here: NDArray[Any], there: NDArray[Any]) -> str:
    what = _NAMES[name]
    if here.shape != there.shape:
        return f"{what}: shape {there.shape} in the checkpoint, {here.shape} here"
    if here.ndim == 0:
        return f"{what}: {there[()]:g} in the checkpoint, {here[()]:g} here"
    node = int(np.argmax((here != there).ravel()))
    return (
        f"{what}: entry {node} is {there.ravel()[node]:g} in the checkpoint, "
        f"{here.ravel()[node]:g} here"
    )


def read_checkpoint(path: str | Path, run: Run) -> State:
    """The state saved in a checkpoint of this very run.

    Raises
    ------
    InputError
        If the file cannot be read, has another format version, or belongs to another problem,
        strength, load or method; every difference is named.
    """
    try:
        arrays = read_arrays(Path(path))
    except FileNotFoundError:
        raise InputError(f"restart: there is no checkpoint {str(path)!r}") from None
    except UNREADABLE as error:
        raise InputError(f"restart: {str(path)!r} is not a readable checkpoint: {error}") from None
    found = arrays.get("format")
    if found is None or found.ndim > 0 or found[()] != FORMAT:
        given = "none" if found is None else repr(found.tolist())
        raise InputError(
            f"restart: {str(path)!r} has format version {given}, this version reads {FORMAT}"
        )
    here = identity(run)
    state = run.start(0.0)
    fresh = vars(state)
    expected = {f"run_{name}" for name in here} | {f"state_{name}" for name in fresh}
    if missing := expected - set(arrays):
        raise InputError(
            f"restart: {str(path)!r} is damaged, it lacks {', '.join(sorted(missing))}"
        )
    problems = []
    for name, value in here.items():
        saved = arrays[f"run_{name}"]
        if not np.array_equal(saved, value):
            problems.append(f"restart: other {_difference(name, value, saved)}")
    if problems:
        raise InputError(problems)
    values: dict[str, Any] = {name: arrays[f"state_{name}"] for name in fresh}
    for name, like in fresh.items():
        kind, shape = np.asarray(like).dtype, np.shape(like)
        if values[name].dtype != kind or values[name].shape != shape:
            problems.append(
                f"restart: {str(path)!r} is damaged, {name} must be {kind} of shape {shape}, got "
                f"{values[name].dtype} of shape {values[name].shape}"
            )
    if problems:
        raise InputError(problems)
    state.explicit, state.step = bool(values["explicit"]), float(values["step"])
    for name, like in fresh.items():
        if isinstance(like, np.ndarray):  # the arrays stay where steps want them
            like[...] = values[name]
    return state

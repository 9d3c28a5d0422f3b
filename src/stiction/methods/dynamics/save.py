"""Stored results of a rupture: frames, a record of every step, and a folder on disk.

A folder holds files of frames, a checkpoint from which the run resumes,
and at the end a summary.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import numpy as np
import pydantic
from numpy.typing import NDArray
from pydantic import BeforeValidator

from stiction.base.errors import InputError, UnitWarning, prefixed, unknown_name, warn_user
from stiction.base.files import (
    PART,
    UNREADABLE,
    content_of,
    read_arrays,
    write_arrays,
    write_whole,
)
from stiction.base.model import (
    AnyNumbers,
    Converted,
    Count,
    FilePath,
    HeldPath,
    Listed,
    Names,
    Real,
    Text,
    checked,
    model,
)
from stiction.base.netcdf import read_netcdf
from stiction.base.variables import Variable, force_variables, forces
from stiction.methods.dynamics.integrator import Run
from stiction.methods.dynamics.state import (
    DIAGNOSTICS,
    STATION,
    STEP,
    Floats,
    RuptureState,
    StepRecord,
    event_type,
)
from stiction.methods.dynamics.summary import energy_balance
from stiction.methods.equilibrium.events import moment_of
from stiction.problem.interface import Interface
from stiction.problem.results import along, coordinate, per_area, to_dataset

if TYPE_CHECKING:
    import xarray as xr

MAX_FRAME_BYTES = 2**36
"""Largest size of a file of frames, bytes."""
FRAMES_PER_FILE = 64
NEARLY_ZERO = 1e-6
"""Distance of a place from the first node, in spacings, that exceeds
round-off."""
_MAX_STEPS_PER_FILE = 50_000  # steps between frames that lie far apart
_CHECKPOINT, _SUMMARY, _FRAME_FILES = "checkpoint.npz", "summary.nc", "frames-*.nc"


def over(*dims: str, **meanings: tuple[str, str]) -> dict[str, Variable]:
    """Return variables over dimensions, by name, from (units, meaning).

    >>> over("time", "x", load=("Pa", "load factor"))
    {'load': Variable(units='Pa', long_name='load factor', dims=('time', 'x'))}
    """
    return {name: Variable(*meaning, dims) for name, meaning in meanings.items()}


FIELDS = over(
    "time",
    slip=("m", "slip"),
    slip_rate=("m/s", "slip rate"),
    shear_stress=("Pa", "shear stress on the interface"),
    strength=("Pa", "current strength"),
)
SCALARS: dict[str, Variable] = over(
    "time",
    load=("Pa", "load factor tau_0"),
    mean_stress=("Pa", "mean shear stress on the interface"),
    mean_slip=("m", "mean slip"),
    top_slip_rate=("m/s", "largest slip rate"),
    weakened_fraction=("1", "fraction of nodes at the residual strength"),
    seismic_moment=("N", "seismic moment per length"),
    work=("J/m", "work of the load on the slip"),
    strain_energy=("J/m", "static strain energy of the slip"),
    fracture_energy=("J/m", "energy dissipated above the residual"),
    radiated_energy=("J/m", "work minus dissipated and strain energy"),
)
STEPS: dict[str, Variable] = over(  # as in STEP
    "step",
    step_time=("s", "time after each step"),
    step_load=("Pa", "load factor tau_0 after each step"),
    step_mean_stress=("Pa", "mean shear stress after each step"),
    step_mean_slip=("m", "mean slip after each step"),
    step_mean_slip_rate=("m/s", "mean slip rate after each step"),
    step_top_slip_rate=("m/s", "largest slip rate after each step"),
    step_size=("s", "size of each step"),
    step_work=("J/m", "work of the load up to each step"),
)
MOMENT_RATE: dict[str, Variable] = over(
    "step", moment_rate=("N/s", "seismic moment rate per length after each step")
)
STATIONS = over(  # as in STATION
    "step",
    "station",
    station_slip=("m", "slip at a station after each step"),
    station_slip_rate=("m/s", "slip rate at a station after each step"),
    station_shear_stress=("Pa", "shear stress (traction) at a station after each step"),
)
OVER_NODES = over(
    peak_strength=("Pa", "peak strength tau_p"),
    arrival_time=("s", "arrival time of the front, see `Rupture.arrival`"),
)
TIME = Variable("s", "time from zero load", ("time",))
_OF_STEP = ("time", "load", "mean_stress", "work")


Place = Annotated[tuple[Real, ...], BeforeValidator(lambda x: np.atleast_1d(x).tolist())]

Stations: TypeAlias = Converted[dict[Text, Place], Mapping[str, AnyNumbers]]
Folder: TypeAlias = Converted[HeldPath | None, FilePath | None]


@model
class Save(Listed):
    """Results that `simulate_rupture` keeps, and the folder in which it stores them.

    Parameters
    ----------
    fields : sequence of {"slip", "slip_rate", "shear_stress", "strength"}
        Fields to keep in frames.
    every : int
        Explicit steps between frames. While the interface creeps, a
        frame follows after a tenth as many implicit steps, at least
        one. Steps shorten as slip accelerates, so that frames are dense
        in time around the onset.
    stations : mapping from str to float or (float, float)
        Names and places of stations, x or on a plane (x, y), m. Slip,
        slip rate and shear stress (traction) are recorded after every
        step at the node nearest to the place.
    to : path, optional
        Folder to write to during the run. Memory then stays bounded, and the
        result holds no fields; read them with
        `stiction.methods.dynamics.save.open_rupture`. If the folder holds a part of
        the same run, the run resumes from the last written state, and the results are
        equal to the bit. If the folder holds the finished run, the run is read.

    Examples
    --------
    >>> import stiction as st
    >>> st.Save(["slip"], every=50, stations={"centre": 0.05}).stations
    {'centre': (0.05,)}
    """

    fields: Names = ("slip", "slip_rate", "shear_stress")
    every: Annotated[Count, pydantic.Field(le=10**6)] = 10
    stations: Stations = pydantic.Field(default_factory=dict)  # type: ignore[arg-type]
    to: Folder = None  # type: ignore[assignment]  # converted

    @pydantic.model_validator(mode="after")
    def _known(self) -> Save:
        _check_fields(self.fields)
        return self

    def nodes(self, interface: Interface) -> NDArray[np.int64]:
        """Return the flat node numbers of stations, which must lie on the interface.

        Warn about positions that are nearly zero, and about stations at
        nodes that cannot break.

        The end of a period is the first node. Places that are nearly zero, or
        beyond an extent, are doubted.

        >>> from stiction.base.errors import collect_warnings
        >>> line, plane = Interface(0.8, 8), Interface((0.8, 0.4), (8, 8))
        >>> Save(["slip"], stations={"a": 0.34, "b": 0.79, "c": 0.0}).nodes(
        ...     line
        ... ).tolist()
        [3, 0, 0]
        >>> Save(["slip"], stations={"a": (0.34, 0.12)}).nodes(
        ...     plane
        ... ).tolist()  # 3 * 8 + 2
        [26]
        >>> with collect_warnings() as warned:
        ...     nodes = Save(
        ...         ["slip"], stations={"a": 0.049, "b": 0.051, "d": 0.0}
        ...     ).nodes(line)
        ...     _ = Save(["slip"], stations={"c": 0.6}).nodes(
        ...         Interface(0.8, 8, extent=(0.1, 0.5))
        ...     )
        >>> nodes.tolist(), [str(warning)[:32] for warning in warned]
        ([0, 1, 0], ["stations['a']: (0.049,) is neare", "stations['c']: (0.6,) lies beyon"])
        """
        lengths, numbers = interface.lengths, []
        for name, place in self.stations.items():
            x = np.array(place)
            if x.size != len(lengths) or not np.all((x >= 0.0) & (x <= lengths)):
                reach = " x ".join(f"{length:g}" for length in lengths)
                raise InputError(
                    f"stations[{name!r}]: {place} is not on the interface of {reach} m. Give"
                    f" {' and '.join(interface.dims)} in m, from the first node"
                )
            # The nearest node. On a periodic
            # interface the end is the first node.
            nodes = x / interface.spacings
            index = tuple(np.round(nodes).astype(int) % interface.shape)
            numbers.append(np.ravel_multi_index(index, interface.shape))
            text = "is nearer to the first node than to any other"
            if not interface.breakable[index]:
                text = "lies beyond the extent of the interface, where nothing slips"
            elif not np.any((nodes > NEARLY_ZERO) & (nodes < 0.5)):
                continue
            warn_user(f"stations[{name!r}]: {place} {text}. Check its unit (m)", UnitWarning)
        return np.array(numbers, dtype=np.int64)


class Recorder:
    """Frames and step records of a run, kept in memory or written to a folder."""

    def __init__(self, run: Run, save: Save, attributes: dict[str, Any]) -> None:
        self.run, self.save, self.attributes = run, save, attributes
        interface = run.medium.interface
        self._saved = repr([save.fields, save.stations])  # part of the digest of a folder
        # Steps write to these rows. `take_steps` copies the rows that
        # were filled.
        rows, stations = save.every, len(save.stations)
        self._record = StepRecord(np.empty(rows, STEP), np.empty((rows, stations), STATION))
        self._columns = {name: self._record.steps[name.removeprefix("step_")] for name in STEPS}
        for name in STATIONS if stations else ():
            self._columns[name] = self._record.stations[name.removeprefix("station_")]
        self._frames: list[dict[str, Any]] = []
        self._steps: list[dict[str, Floats]] = []
        variables = {name: along(interface, field) for name, field in FIELDS.items()}
        variables |= SCALARS | STEPS | MOMENT_RATE | STATIONS
        self.variables = {
            name: per_area(interface, variable) for name, variable in variables.items()
        } | force_variables(SCALARS)  # forces, N, also on a plane

    def take_steps(self, state: RuptureState, count: int) -> tuple[int, int]:
        """Take up to `count` steps and record them. Return (steps taken, reason)."""
        record = StepRecord(*(rows[:count] for rows in self._record))
        taken, reason = self.run.take_steps(state, count, record)
        columns = self._columns.items()
        self._steps.append({name: column[:taken].copy() for name, column in columns})
        return taken, reason

    def add(self, state: RuptureState) -> None:
        """Keep a frame of the present state.

        >>> from types import FunctionType, SimpleNamespace
        >>> names = globals() | {
        ...     "energy_balance": lambda run, state: {"strain_energy": 9.0}
        ... }
        >>> plain = FunctionType(Recorder.add.__code__, names)
        >>> medium = SimpleNamespace(interface=Interface(0.8, 8))
        >>> solid = SimpleNamespace(shear_modulus=3.0)
        >>> medium.problem = SimpleNamespace(solid=solid, interface=medium.interface)
        >>> run = SimpleNamespace(medium=medium)
        >>> run.setting = SimpleNamespace(thresholds=SimpleNamespace(breakable=4))
        >>> run.mean, run.strength_after = np.mean, lambda slip: 5.0 - slip
        >>> step = {
        ...     "time": 1.0,
        ...     "load": 2.0,
        ...     "mean_stress": 3.0,
        ...     "work": 4.0,
        ...     "weakened_nodes": 3,
        ... }
        >>> slip, stress = np.full(8, 0.5), np.arange(8.0)
        >>> state = SimpleNamespace(now={"step": step}, slip=slip, stress=stress)
        >>> state.slip_rate = 0.1 * stress
        >>> recorder = SimpleNamespace(
        ...     run=run, save=Save(["shear_stress", "strength"]), _frames=[]
        ... )
        >>> plain(recorder, state)
        >>> stress += 9.0  # a frame keeps its values
        >>> for name, value in recorder._frames[0].items():
        ...     print(name, np.round(value, 9).tolist())
        time 1.0
        load 2.0
        mean_stress 3.0
        work 4.0
        mean_slip 0.5
        top_slip_rate 0.7
        weakened_fraction 0.75
        seismic_moment 1.2
        strain_energy 9.0
        shear_stress [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
        strength [4.5, 4.5, 4.5, 4.5, 4.5, 4.5, 4.5, 4.5]
        """
        run, step, medium = self.run, state.now["step"], self.run.medium
        frame: dict[str, Any] = {name: float(step[name]) for name in _OF_STEP}
        frame |= {
            "mean_slip": float(run.mean(state.slip)),
            "top_slip_rate": float(state.slip_rate.max()),
            "weakened_fraction": step["weakened_nodes"] / run.setting.thresholds.breakable,
            "seismic_moment": moment_of(medium.problem, state.slip),
        }
        # Energies are quadratic and overflow first.
        with np.errstate(over="ignore"):  # just before a run becomes non-finite
            frame |= energy_balance(run, state)
        fields = {
            "slip": state.slip,
            "slip_rate": state.slip_rate,
            "shear_stress": state.stress,
            "strength": run.strength_after(state.slip),
        }
        shape = medium.interface.shape
        frame |= {name: fields[name].reshape(shape).copy() for name in self.save.fields}
        self._frames.append(frame)

    def take(self) -> xr.Dataset:
        """Return the data since the last call as a dataset.

        Two frames and three steps, out of two groups, become a dataset. Then the
        record is empty.

        >>> from types import SimpleNamespace
        >>> import stiction as st
        >>> problem = st.paper.problem(nodes=256)
        >>> medium = SimpleNamespace(problem=problem, interface=problem.interface)
        >>> run = SimpleNamespace(
        ...     medium=medium, setting=SimpleNamespace(stations=np.array([3, 5]))
        ... )
        >>> save = Save(["slip"], stations={"a": 0.001, "b": 0.002})
        >>> recorder = Recorder(run, save, {"stopped": "rest"})
        >>> frame = dict.fromkeys(SCALARS, 2.0) | {"slip": np.full(256, 0.5)}
        >>> recorder._frames = [frame | {"time": time} for time in (1.0, 4.0)]
        >>> for count in (1, 2):
        ...     group = {name: np.full(count, 1.0 * count) for name in STEPS}
        ...     group |= {name: np.full((count, 2), 7.0) for name in STATIONS}
        ...     recorder._steps.append(group)
        >>> data = recorder.take()
        >>> dict(data.sizes), data.time.values.tolist(), data.step_load.values.tolist()
        ({'time': 2, 'x': 256, 'step': 3, 'station': 2}, [1.0, 4.0], [1.0, 2.0, 2.0])
        >>> (
        ...     data.station_x.values.round(9).tolist(),
        ...     data.station_slip.shape,
        ...     data.attrs["stopped"],
        ... )
        ([0.001171875, 0.001953125], (3, 2), 'rest')
        >>> (data.moment_rate / (1e9 * 0.1)).values.round(
        ...     9
        ... ).tolist()  # G times the length
        [1.0, 2.0, 2.0]
        >>> dict(recorder.take().sizes)["time"]
        0
        """
        interface, save = self.run.medium.interface, self.save
        names = ("time", *SCALARS, *save.fields)
        data = {name: np.array([frame[name] for frame in self._frames]) for name in names}
        shape = len(self._frames), *interface.shape  # also without frames
        data |= {name: data[name].reshape(shape) for name in save.fields}
        for name, column in self._columns.items():
            data[name] = np.concatenate([column[:0], *(steps[name] for steps in self._steps)])
        problem = self.run.medium.problem
        moment_per_slip = problem.solid.shear_modulus * interface.breakable_measure
        data["moment_rate"] = moment_per_slip * data["step_mean_slip_rate"]
        data |= forces(data, problem.area, problem.whole_area)
        self._frames, self._steps = [], []
        coordinates = {"time": (data.pop("time"), TIME)}
        coordinates |= {dim: coordinate(interface, dim) for dim in interface.dims}
        if save.stations:
            label = Variable("", "name of a station", ("station",))
            coordinates["station"] = (np.array(list(save.stations), dtype=str), label)
            index = np.unravel_index(self.run.setting.stations, interface.shape)
            for dim, i, spacing in zip(interface.dims, index, interface.spacings, strict=True):
                place = Variable("m", f"{dim} of a station's node", ("station",))
                coordinates[f"station_{dim}"] = (i * spacing, place)
        return to_dataset(data, self.variables, coordinates, self.attributes)

    def begin(self, state: RuptureState) -> bool:
        """Open the folder.

        Return whether it holds the same run in its finished state.

        If the folder holds a part of the same run, the state takes the
        values that were written last.

        A new folder gets a checkpoint. A folder with frames after its checkpoint
        loses them, and a folder with other files is refused.

        >>> import tempfile
        >>> from types import FunctionType, SimpleNamespace
        >>> names = globals() | {
        ...     "write_checkpoint": lambda path, *given: path.write_text("")
        ... }
        >>> names["read_checkpoint"] = lambda *given: None
        >>> plain, folder = (
        ...     FunctionType(Recorder.begin.__code__, names),
        ...     Path(tempfile.mkdtemp()),
        ... )
        >>> recorder = SimpleNamespace(
        ...     save=SimpleNamespace(to=folder), run=None, _saved=""
        ... )
        >>> state = SimpleNamespace(steps=7)
        >>> _ = (folder / f"killed{PART}").write_text("")
        >>> (
        ...     plain(recorder, state),
        ...     {path.suffix for path in folder.iterdir()} == {".npz", PART},
        ... )
        (False, True)
        >>> for name in ("frames-000000000007.nc", "frames-000000000008.nc"):
        ...     _ = (folder / name).write_text("")
        >>> plain(recorder, state), [path.name for path in folder.glob("*.nc")]
        (False, ['frames-000000000007.nc'])
        >>> _ = (folder / "summary.nc").write_text("")
        >>> plain(recorder, state)
        True
        >>> (folder / "checkpoint.npz").unlink()
        >>> plain(recorder, state)  # doctest: +ELLIPSIS
        Traceback (most recent call last):
            ...
        stiction.base.errors.InputError: to: ... is not empty and holds no rupture...
        >>> recorder.save.to = None
        >>> plain(recorder, state)
        False
        """
        folder = self.save.to
        if folder is None:
            return False
        checkpoint = folder / _CHECKPOINT
        if not checkpoint.exists():
            present = folder.iterdir() if folder.is_dir() else [folder] * folder.exists()
            # A run that was killed in its first write leaves a partial file.
            if any(path.suffix != PART for path in present):
                raise InputError(
                    f"to: {str(folder)!r} is not empty and holds no rupture. Give a new folder"
                )
            write_checkpoint(checkpoint, self.run, state, self._saved)
            return False
        read_checkpoint(checkpoint, self.run, state, self._saved)
        if (folder / _SUMMARY).exists():
            return True
        # Frames after the checkpoint will be computed again. They come
        # from a run that was killed between the two files.
        for path in folder.glob(_FRAME_FILES):
            if int(path.stem.removeprefix("frames-")) > state.steps:
                path.unlink()
        return False

    def flush(self, state: RuptureState, *, at_once: bool = False, last: bool = False) -> None:
        """Write frames and steps if there are enough, or `at_once`.

        Also write the checkpoint.

        With `last` there is no checkpoint: a run that
        resumes with more steps may have no frame at
        the step at which `max_steps` ended it.

        A file follows 64 frames or 50 000 steps, or a single frame at once. At the
        end there is no checkpoint.

        >>> from types import FunctionType, SimpleNamespace
        >>> def written(frames, steps, **options):
        ...     names = globals() | {"_write": lambda path, data: done.append(path.name)}
        ...     names["write_checkpoint"] = lambda path, *given: done.append(path.name)
        ...     plain = FunctionType(Recorder.flush.__code__, names, None, None, None)
        ...     plain.__kwdefaults__ = Recorder.flush.__kwdefaults__
        ...     recorder = SimpleNamespace(save=SimpleNamespace(to=Path("folder")))
        ...     recorder.run, recorder._saved = None, ""
        ...     recorder._frames, recorder.take = [{}] * frames, lambda: None
        ...     recorder._steps, done = [{"step_time": np.zeros(steps)}] * 2, []
        ...     plain(recorder, SimpleNamespace(steps=7), **options)
        ...     return done
        >>> written(64, 1), written(63, 24_999)
        (['frames-000000000007.nc', 'checkpoint.npz'], [])
        >>> written(1, 25_000), written(1, 1, at_once=True)
        (['frames-000000000007.nc', 'checkpoint.npz'], ['frames-000000000007.nc', 'checkpoint.npz'])
        >>> written(1, 1, last=True), written(0, 1, last=True)
        (['frames-000000000007.nc'], [])
        """
        folder, steps = self.save.to, sum(rows["step_time"].size for rows in self._steps)
        # A file for every frame would be slow, and a single file would
        # have to fit in memory.
        full = len(self._frames) >= FRAMES_PER_FILE or steps >= _MAX_STEPS_PER_FILE
        if folder is None or not (full or ((at_once or last) and self._frames)):
            return
        _write(folder / f"frames-{state.steps:012d}.nc", self.take())
        if not last:
            write_checkpoint(folder / _CHECKPOINT, self.run, state, self._saved)

    def finish(self, dataset: xr.Dataset, stopped: str) -> None:
        """Write the variables of the whole run next to its frames, unless the run can continue."""
        if self.save.to is not None and stopped != "max_steps":
            without_time = dataset.drop_dims(["time", "step"], errors="ignore")
            _write(self.save.to / _SUMMARY, without_time)


def _write(path: Path, dataset: xr.Dataset) -> None:
    write_whole(path, lambda aside: dataset.to_netcdf(aside, engine="h5netcdf"))


def _digest(run: Run, saved: str) -> str:
    """Return the SHA-256 of all that a run depends on besides its state.

    Every input changes the digest.

    >>> from types import SimpleNamespace
    >>> def digest(saved="", peak=1.0, law=2.0, load=3.0, end_time=4.0, **others):
    ...     grid, step, length = (
    ...         others.get(name, 5.0) for name in ("grid", "step", "length")
    ...     )
    ...     friction = SimpleNamespace(fraction=lambda slips: np.exp(-law * slips))
    ...     medium = SimpleNamespace(
    ...         grid=("transform", grid), interface=Interface(length, 8)
    ...     )
    ...     medium.step = step
    ...     medium.problem, times = (
    ...         SimpleNamespace(friction=friction),
    ...         np.array([0.0, 1.0]),
    ...     )
    ...     setting = SimpleNamespace(
    ...         nodes=[np.array([peak])], load=[times, load * times], law=[]
    ...     )
    ...     setting.thresholds = [True, end_time]
    ...     return _digest(SimpleNamespace(medium=medium, setting=setting), saved)
    >>> names = "peak", "law", "load", "end_time", "grid", "step", "length"
    >>> digests = [
    ...     digest(),
    ...     digest(saved="a"),
    ...     *(digest(**{name: 7.0}) for name in names),
    ... ]
    >>> digest() == digests[0], len(set(digests)), len(digests[0])
    (True, 9, 64)
    """
    medium, setting = run.medium, run.setting
    numbers = medium.grid[1:]  # all but the transform, which follows from the interface
    # A law of others has no text that identifies it, so compare its values.
    slips = np.linspace(0.0, 5.0, 101)  # at which laws are compared, in units of d_c
    law = np.concatenate([medium.problem.friction.fraction(slips), *map(np.ravel, setting.law)])
    texts = [medium.interface, float(medium.step), saved, DIAGNOSTICS]
    digest = hashlib.sha256(repr(texts).encode())
    for values in (
        *setting.nodes, law, *setting.load, np.array(setting.thresholds, float), *numbers,
    ):  # fmt: skip
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def write_checkpoint(path: Path, run: Run, state: RuptureState, saved: str = "") -> None:
    """Write the state of a run and its digest, in a single operation.

    The state and the events of a run are read again, but not for another run.

    >>> import tempfile
    >>> from types import FunctionType, SimpleNamespace
    >>> names = globals() | {"_digest": lambda run, saved: f"digest of {saved}"}
    >>> functions = write_checkpoint, read_checkpoint
    >>> write, read = (
    ...     FunctionType(of.__code__, names, None, of.__defaults__)
    ...     for of in functions
    ... )
    >>> state = RuptureState(
    ...     *np.arange(20.0).reshape(10, 2), np.zeros(1, DIAGNOSTICS)
    ... )
    >>> run, path = (
    ...     SimpleNamespace(events=[]),
    ...     Path(tempfile.mkdtemp()) / "checkpoint.npz",
    ... )
    >>> run.events.append(np.zeros((), event_type(2)))
    >>> state.now["step"]["time"], run.events[0]["time"] = 3.0, 5.0
    >>> write(path, run, state, "this")
    >>> empty, other = (
    ...     RuptureState(*np.zeros((10, 2)), np.zeros(1, DIAGNOSTICS)),
    ...     SimpleNamespace(),
    ... )
    >>> (
    ...     read(path, other, empty, "this") is empty,
    ...     empty.memory.tolist(),
    ...     empty.event_slip.tolist(),
    ... )
    (True, [10.0, 11.0], [18.0, 19.0])
    >>> (
    ...     float(empty.now["step"]["time"]),
    ...     [float(event["time"]) for event in other.events],
    ... )
    (3.0, [5.0])
    >>> read(path, other, empty, "that")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: to: ... holds another run: ...
    """
    digest = np.frombuffer(_digest(run, saved).encode(), np.uint8)
    events = np.array(run.events, event_type(state.slip.size))
    write_arrays(path, {"digest": digest, "events": events} | state._asdict())


def read_checkpoint(path: Path, run: Run, state: RuptureState, saved: str = "") -> RuptureState:
    """Fill a state with a checkpoint of the same run, and return it."""
    try:
        arrays = read_arrays(path)
        digest = arrays["digest"].tobytes().decode()
        stored = [arrays[name] for name in state._fields]
        events = [*arrays["events"]]
    except UNREADABLE as error:
        raise InputError(f"to: {str(path)!r} is not a readable checkpoint: {error}") from None
    if digest != _digest(run, saved):
        raise InputError(
            f"to: {str(path.parent)!r} holds another run: the problem, the profiles, the load, "
            "the method or the saved results differ. Give a new folder"
        )
    run.events = events
    for array, values in zip(state, stored, strict=True):
        array[...] = values  # in place, which keeps the alignment of the arrays
    return state


@checked
def open_rupture(folder: FilePath, *, fields: Names | None = None) -> xr.Dataset:
    """Read a run from the folder of `Save.to`, even if it is unfinished.

    Parameters
    ----------
    folder : path
    fields : sequence of str, optional
        Fields over ('time', 'x'), or ('time', 'x', 'y'), to load. By
        default all fields are loaded.

    Returns
    -------
    xarray.Dataset
        The dataset of `simulate_rupture`. Variables of the whole run
        are there once it has ended.

    Raises
    ------
    InputError
        If the folder holds no rupture, or a field has an unknown name.
    """
    import xarray as xr

    place, wanted = Path(folder), FIELDS if fields is None else fields
    _check_fields(wanted)
    unwanted = FIELDS.keys() - {*wanted}
    parts = [_read(path, unwanted) for path in sorted(place.glob(_FRAME_FILES))]
    if not parts:
        raise InputError(f"folder: {str(folder)!r} holds no frames of a rupture")

    def joined(dim: str, dropped: str) -> xr.Dataset:
        return xr.concat(
            [part.drop_dims(dropped) for part in parts], dim=dim,
            data_vars="minimal", coords="minimal", compat="override", join="override",
        )  # fmt: skip

    # Frames and steps have different lengths
    # in each file: join them separately.
    framed = joined("time", "step").merge(joined("step", "time"))
    framed.attrs = parts[-1].attrs
    if (place / _SUMMARY).exists():
        whole = _read(place / _SUMMARY)
        framed = framed.merge(whole, compat="override")
        framed.attrs = whole.attrs
    return framed


def _check_fields(names: Collection[str]) -> None:
    """Refuse names that are not fields."""
    if unknown := [name for name in names if name not in FIELDS]:
        raise InputError([unknown_name("fields", name, FIELDS) for name in unknown])


def _read(path: Path, unwanted: Collection[str] = ()) -> xr.Dataset:
    """Return the dataset of a file, which may come from a stranger."""
    with prefixed(str(path)):
        return read_netcdf(content_of(path, max_bytes=MAX_FRAME_BYTES), unwanted)

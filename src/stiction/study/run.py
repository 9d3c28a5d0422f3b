"""Runs on disk: parts of a study for several jobs, stored samples, and export to files."""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator

from stiction.base.errors import InputError, RunError, warn_accuracy
from stiction.base.files import cannot, write_whole
from stiction.base.model import FilePath, check
from stiction.base.representation import Result, brief
from stiction.base.variables import DIRECTION
from stiction.ensemble.batches import Failure
from stiction.ensemble.dataset import Gathered
from stiction.ensemble.store import Store
from stiction.random.synthesis import SAMPLES_PER_BLOCK

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

OVERHEAD = 2**16
"""Bytes of a NetCDF file apart from its arrays."""
FEWEST_BLOCKS = 8
"""Fewest blocks in a part, if there are enough, so that parts take
similar times."""


def _part(value: Any) -> tuple[int, int]:
    r"""Return the number of a part, and the number of parts.

    >>> _part("3/100"), _part("5/5"), _part("1/1")
    ((3, 100), (5, 5), (1, 1))
    >>> for given in ("0/5", "6/5", "3", "3/100 ", "-1/5", "\u0663/5", 3):
    ...     try:
    ...         _part(given)
    ...     except ValueError as error:
    ...         print(str(error)[:31])
    must be K/N with K from 1 to N,
    must be K/N with K from 1 to N,
    must be K/N with K from 1 to N,
    must be K/N with K from 1 to N,
    must be K/N with K from 1 to N,
    must be K/N with K from 1 to N,
    must be K/N with K from 1 to N,
    """
    match = re.fullmatch(r"(\d+)/(\d+)", value, re.ASCII) if isinstance(value, str) else None
    number, of = map(int, match.groups()) if match else (0, 0)
    if not 1 <= number <= of:
        raise ValueError("must be K/N with K from 1 to N, such as 3/100 for the third part")
    return number, of


PartOfRun: TypeAlias = Annotated[Any, BeforeValidator(_part)]
"""Number of a part, from 1, and the number of parts."""


def samples_of_part(part: tuple[int, int], points: int, samples: int) -> NDArray[np.bool_]:
    """Return a mask (points, samples) of the samples in a part.

    Blocks go to the parts in turn.

    A part of 50 // 3 samples has eight blocks of 2 samples, or blocks of at most 256 samples.

    >>> [np.flatnonzero(samples_of_part((k, 3), 2, 25)).tolist()[:6] for k in (1, 2, 3)]
    [[0, 1, 6, 7, 12, 13], [2, 3, 8, 9, 14, 15], [4, 5, 10, 11, 16, 17]]
    >>> samples_of_part((2, 3), 2, 5).astype(int).tolist()
    [[0, 1, 0, 0, 1], [0, 0, 1, 0, 0]]
    >>> np.flatnonzero(samples_of_part((2, 2), 1, 10_000))[[0, 255, 256]].tolist()
    [256, 511, 768]
    """
    (number, of), total = part, points * samples
    block = min(SAMPLES_PER_BLOCK, max(1, total // (FEWEST_BLOCKS * of)))
    mine = np.arange(total) // block % of == number - 1
    return mine.reshape(points, samples)


@dataclass(frozen=True, eq=False, repr=False)
class Status(Result):
    """State of a run."""

    samples: int  # of all points
    done: int
    done_by_point: NDArray[np.int64]
    failures: tuple[Failure, ...]
    damaged: tuple[str, ...]  # defects of chunks, which running the study again repairs
    chunks: int
    seconds: float  # of all workers together
    versions: tuple[str, ...]  # of the packages that computed the samples

    __repr__ = brief

    @property
    def complete(self) -> bool:
        """Whether every sample is stored.

        >>> status = Status(7, 6, np.array([6]), (), (), 1, 2.5, ())
        >>> status.complete, Status(7, 7, *list(vars(status).values())[2:]).complete
        (False, True)
        """
        return self.done == self.samples


class StoredRun:
    """A run on disk that is open for reading. See `stiction.open_run`.

    Attributes
    ----------
    path : Path
    study : Study

    Examples
    --------
    >>> import tempfile
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=576)
    >>> random = st.paper.strength(problem, correlation_ratio=2.0)
    >>> sweep = [{"random.strength.spectrum.correlation_length": [3e-3, 6e-3]}]
    >>> study = st.Study(
    ...     problem=problem, random=random, method=st.LocalCriterion(), samples=3, sweep=sweep
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     part = study.run(out=folder, part="2/4", progress=False)
    ...     run = st.open_run(folder)
    ...     repr(run).removeprefix(f"StoredRun({folder!r}")
    ...     state = run.status()
    ...     state.samples, state.done, state.done_by_point.tolist(), state.complete, state.failures
    ...     run.dataset(["critical_load"]).critical_load.isnull().values.astype(int).tolist()
    ...     try:
    ...         run.export(Path(folder, "all.csv"))
    ...     except RunError as error:
    ...         str(error).removeprefix(folder)[:26]
    ...     run.export(Path(folder, "all.nc"), partial=True)
    ...     run.export(Path(folder, "all.csv"), partial=True)
    ...     Path(folder, "all.csv").read_text()[:40], Path(folder, "all.nc").exists()
    ...     for events in (False, True):
    ...         try:
    ...             run.export("all.nc" if events else "all.txt", partial=True, events=events)
    ...         except InputError as error:
    ...             print(error)
    ', 2 x 3 samples by local criterion)'
    (6, 2, [1, 1], False, ())
    [[1, 0, 1], [1, 1, 0]]
    ': 2 of 6 samples exist. Ru'
    ('correlation_length (m),sample (1),critic', True)
    all.txt: the suffix must be .nc or .csv, got '.txt'
    all.nc: the suffix must be .csv for a table of events, got '.nc'
    """

    def __init__(self, store: Store, study: Any) -> None:
        self.path, self.study, self._store = store.path, study, store

    def __repr__(self) -> str:
        points, samples = len(self.study.experiments), self.study.samples
        what = f"{points} x {samples} samples by {self.methods}"
        return f"{type(self).__name__}({str(self.path)!r}, {what})"

    @property
    def methods(self) -> str:
        """Labels of the methods in the study."""
        return " and ".join({point.method.label: None for point in self.study.experiments})

    def status(self) -> Status:
        """Compare all chunks with their checksums, and return the state of the run.

        Raises
        ------
        StoreError
            If a stored file cannot be read.
        """
        rows = self._read(only=())
        return Status(
            samples=rows.done.size,
            done=int(rows.done.sum()),
            done_by_point=rows.done.sum(axis=1),
            failures=tuple(rows.failed),
            damaged=tuple(f"{name}: {text}" for name, text in self._store.damage.items()),
            chunks=len(self._store.seconds),
            seconds=sum(self._store.seconds),
            versions=tuple(self._store.versions),
        )

    def dataset(self, only: Sequence[str] | None = None) -> xr.Dataset:
        """Return all stored samples as a dataset. Missing samples are NaN.

        Parameters
        ----------
        only : sequence of str, optional
            Variables to read. By default all variables.

        Warns
        -----
        UserWarning
            If a chunk is damaged.
        """
        return self._checked(self._read(only))

    def _checked(self, rows: Gathered) -> xr.Dataset:
        for name, text in self._store.damage.items():
            self._store.warn(f"{name}: {text}. Its samples are missing. Run the study again")
        attributes = self.study.attributes | (self._store.pilot or {})
        return rows.dataset(attributes, self.study.axes)

    def _read(self, only: Sequence[str] | None = None) -> Gathered:
        rows = Gathered(self.study.experiments, self.study.samples, only)
        self._store.read_into(rows)
        return rows

    def export(self, path: str | Path, *, partial: bool = False, events: bool = False) -> None:
        """Write the `dataset` to a file (.nc or .csv), completely or not at all.

        Parameters
        ----------
        path : path
        partial : bool
            Whether to write the stored part of an incomplete run.
        events : bool
            Whether a table (.csv) has a row for each
            event, as in `stiction.external.event_table`,
            rather than a row for each sample.

        Raises
        ------
        InputError
            If the suffix is not .nc or .csv, or if `events` is
            true and the run has no events.
        StoreError
            If the file cannot be written.
        RunError
            If the run is not complete, and `partial` is False.
        """
        rows, place = self._read(), check("path", path, FilePath)
        if not (partial or rows.done.all()):
            raise RunError(
                f"{self.path}: {int(rows.done.sum())} of {rows.done.size} samples exist. Run the"
                " study again, or export a part: partial=True, in a shell --partial"
            )
        result = self._checked(rows)
        if place.suffix == ".nc" and not events:
            write_result(result, place)
        elif place.suffix == ".csv":
            frame = event_table(result) if events else table_of(result)
            # Numbers are written as the shortest text that reads back to
            # the same bits.
            write_whole(place, lambda aside: frame.to_csv(aside, index=False, na_rep="nan"))
        else:
            valid = ".csv for a table of events" if events else ".nc or .csv"
            raise InputError(f"{place}: the suffix must be {valid}, got {place.suffix!r}")


# -- files for other programs --------------------------------------------------------------------


def write_result(result: xr.Dataset, path: Path) -> None:
    """Write a result as a NetCDF file with checksums, completely or not at all.

    >>> import tempfile
    >>> from unittest.mock import patch
    >>> import h5py
    >>> import xarray as xr
    >>> slip = "x", [2.5, 7.5]
    >>> result = xr.Dataset({"slip": slip, "name": ("x", ["a", "b"]), "load": 3.0}, {"x": slip})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "result.nc")
    ...     write_result(result, path)
    ...     with h5py.File(path) as file:
    ...         print({name: file[name].fletcher32 for name in sorted(file)})
    ...     for free in (1.05 * result.nbytes + OVERHEAD, 1.05 * result.nbytes + OVERHEAD - 1):
    ...         with patch("shutil.disk_usage") as usage:
    ...             usage.return_value.free = free
    ...             try:
    ...                 write_result(result, path)
    ...             except RunError as error:
    ...                 print(usage.call_args.args == (path.parent,), os.strerror(28) in str(error))
    {'load': False, 'name': False, 'slip': True, 'x': True}
    True True
    """
    with suppress(OSError):
        free = shutil.disk_usage(path.parent).free
        # NetCDF does not report a full disk,
        # and keeps its unfinished file open.
        if free < 1.05 * result.nbytes + OVERHEAD:
            raise cannot("written", path, OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
    encoding = {
        str(name): {"fletcher32": True}
        for name, variable in result.variables.items()
        if variable.ndim and variable.size and variable.dtype.kind in "fiub"
    }
    write_whole(path, lambda file: result.to_netcdf(file, engine="h5netcdf", encoding=encoding))


def event_table(result: xr.Dataset) -> pd.DataFrame:
    """Return the events in a result as a data frame with a row for each event.

    Parameters
    ----------
    result : xarray.Dataset
        From `equilibrium_path` or `simulate_rupture`, or from `onset`,
        `monte_carlo` or a study whose method has ``events=``.

    Returns
    -------
    pandas.DataFrame
        Columns, named ``name (unit)``, hold the sweep and the sample,
        if there are any, the number of the event in its sample, and the
        variables of the event (see `equilibrium_path`).

    Raises
    ------
    InputError
        If the result has no events. An `AccuracyWarning` is issued if
        samples have more events than the result keeps.

    Notes
    -----
    Moment, fracture energy, and the stress drops by slip and by energy
    refer to all slip that an event adds. Length or area, mean slip and
    the area stress drop refer to the patch around the largest slip.

    The event of a `Rupture` ends when shear waves have crossed the
    part that can break since the last fast slip, so that later creep,
    which the load drives, is left out. `event_settled` is 0 if the run
    ended before. An instability in which no node reaches dynamic slip
    rates is no event. A run at rest can therefore have a
    `critical_stress` and no row.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=192)
    >>> field = st.paper.strength(problem, correlation_ratio=2.0)
    >>> method = st.Equilibrium(events=4)
    >>> result = st.monte_carlo(problem, field, method=method, samples=20, seed=1)
    >>> list(st.external.event_table(result).columns[:3])
    ['sample (1)', 'event (1)', 'event_load (Pa)']

    Events are kept with NaN for missing events:

    >>> import xarray as xr
    >>> from stiction.base.errors import collect_warnings
    >>> event = ("sample", "event")
    >>> cells = {"event_load": (event, [[3.0, np.nan], [5.0, 7.0]], {"units": "Pa"})}
    >>> cells |= {"arrested_events": ("sample", [1, 2]), "critical_load": ("sample", [8.0, 9.0])}
    >>> with collect_warnings() as caught:
    ...     table = event_table(xr.Dataset(cells))
    ...     cells["arrested_events"] = "sample", [1, 4]
    ...     _ = event_table(xr.Dataset(cells))
    >>> print(table.to_csv(index=False), end="")
    sample (1),event (1),event_load (Pa)
    0,0,3.0
    1,0,5.0
    1,1,7.0
    >>> [warned.text for warned in caught]
    ['events: kept only 2 of up to 4 per sample. Raise events=']
    >>> event_table(xr.Dataset({"critical_load": 3.0}))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: result: has no events. Set events= of the method, ...
    """
    variables = getattr(result, "data_vars", {})
    names = [str(name) for name, values in variables.items() if "event" in values.dims]
    if not names:
        raise InputError(
            "result: has no events. Set events= of the method, as in st.Equilibrium(events=20), or"
            " call st.equilibrium_path or st.simulate_rupture"
        )
    if "sample" in result.dims:
        most, kept = int(result["arrested_events"].max()), result.sizes["event"]
        if most > kept:
            warn_accuracy(f"events: kept only {kept} of up to {most} per sample. Raise events=")
    frame = _frame_of(result[names])
    return frame[frame["event_load (Pa)"].notna()].reset_index(drop=True)


def table_of(result: xr.Dataset) -> pd.DataFrame:
    """Return a table with a column for each variable, and a row for each sample and point.

    Columns, named ``name (unit)``, hold swept keys, the sample number
    and results. Curves of equally likely interfaces are left out, but
    their band is included.

    >>> import xarray as xr
    >>> from stiction.base.errors import collect_warnings
    >>> cells = {
    ...     "load": ("sample", [3.0, 7.0], {"units": "Pa"}),
    ...     "place": (("sample", DIRECTION), [[1.0, 2.0], [5.0, 6.0]], {"units": "m"}),
    ...     "slip": (("sample", "x"), [[1.0, 2.0], [5.0, 6.0]]),
    ...     "curve": ("member", [1.0, 2.0, 4.0]),
    ... }
    >>> coords = {"sample": [0, 1], DIRECTION: ["x", "y"], "member": [0, 1, 2]}
    >>> result = xr.Dataset(cells, coords)
    >>> with collect_warnings() as caught:
    ...     table = table_of(result)
    >>> table.columns.tolist(), table.values.tolist()[1]
    (['sample (1)', 'load (Pa)', 'place_x (m)', 'place_y (m)'], [1.0, 7.0, 5.0, 6.0])
    >>> caught[0].text[:36]
    'slip: has several numbers for each s'
    """
    result = result.drop_dims("member", errors="ignore")
    wide = sorted(
        str(name)
        for name, values in result.data_vars.items()
        if "sample" in values.dims
        and {*values.dims[values.dims.index("sample") + 1 :]} - {DIRECTION}
    )
    if wide:
        warn_accuracy(
            f"{', '.join(wide)}: has several numbers for each sample and does not fit into a table."
            " Export a .nc file, or a table of --events (in Python events=True)"
        )
    return _frame_of(result.drop_vars(wide))


def components(result: xr.Dataset) -> xr.Dataset:
    """Return a result with a variable such as critical_position_x for each component.

    >>> import xarray as xr
    >>> place = xr.DataArray([3.0, 7.0], {DIRECTION: ["x", "y"]}, attrs={"units": "m"})
    >>> parts = components(xr.Dataset({"place": place, "load": 5.0}))
    >>> {str(name): float(part) for name, part in parts.items()}, parts.place_y.attrs
    ({'load': 5.0, 'place_x': 3.0, 'place_y': 7.0}, {'units': 'm'})
    """
    for name, values in result.data_vars.items():
        if DIRECTION in values.dims:
            parts = {
                f"{name}_{c.item()}": values.sel({DIRECTION: c}, drop=True)
                for c in values[DIRECTION]
            }
            result = result.drop_vars([name]).assign(parts)
    return result


def _frame_of(result: xr.Dataset) -> pd.DataFrame:
    """Return a column for each variable or component, named ``name (unit)``.

    The rows follow the dimensions of the variables. A dimension without a variable is dropped.

    >>> import xarray as xr
    >>> load = xr.DataArray([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], dims=("point", "sample"))
    >>> coords = {"mean": ("point", [0.1, 0.2], {"units": "Pa"}), "x": [1.0, 2.0]}
    >>> frame = _frame_of(xr.Dataset({"load": load}, coords))
    >>> frame.columns.tolist(), frame.values.tolist()[4]
    (['mean (Pa)', 'point (1)', 'sample (1)', 'load (1)'], [0.2, 1.0, 1.0, 5.0])
    """
    narrow = components(result)
    rows = list(dict.fromkeys(dim for v in narrow.data_vars.values() for dim in v.dims))
    narrow = narrow.drop_dims({*narrow.dims} - {*rows})
    names = dict.fromkeys([*narrow.coords, *rows, *narrow.data_vars])
    units = {name: narrow[name].attrs.get("units", "1") for name in names}
    frame = narrow.to_dataframe(dim_order=rows).reset_index()[list(names)]
    return frame.rename(columns={name: f"{name} ({unit})" for name, unit in units.items()})

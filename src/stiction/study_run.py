"""A study run into a folder or a file, from the beginning or from where it was interrupted."""

from __future__ import annotations

import json
from concurrent.futures import Executor
from contextlib import suppress
from pathlib import Path

import numpy as np
import xarray as xr

from stiction._checks import as_path
from stiction.ensemble.files import cannot_write
from stiction.ensemble.manifest import MANIFEST, refuse_another
from stiction.ensemble.monte_carlo import check_run
from stiction.ensemble.part import Part
from stiction.ensemble.points import variables_in
from stiction.ensemble.resume import run_stored
from stiction.ensemble.store import LOCK, Store
from stiction.ensemble.store_writer import empty, prepare_folder, writing
from stiction.ensemble.versions import versions
from stiction.ensemble.work import Outcome
from stiction.errors import StoreError
from stiction.progress import Show
from stiction.results import DIRECTION
from stiction.stored_run import FAILED, StoredRun, folder_beside, read_result
from stiction.study.study import Study


def parts_folder(path: Path) -> Path:
    """Where the parts of a run are until they are merged."""
    return path.parent / f"{path.name}.parts"


def make_part_folder(path: Path, part: Part) -> Path:
    """The folder of a part, made if need be.

    Raises
    ------
    StoreError
        If the place cannot take it.
    """
    folder = parts_folder(path)
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from error
    return folder / part.name


def check_target(path: Path) -> None:
    """Refuse a place that cannot take a run, before any work is done.

    Raises
    ------
    StoreError
    """
    if path.suffix != ".nc":
        prepare_folder(path)
        return
    if path.is_dir():
        raise StoreError(f"{path}: is a folder; a result needs a file name")
    prepare_folder(folder_beside(path))
    if not any(folder_beside(path).iterdir()):
        folder_beside(path).rmdir()


def run_into(
    study: Study,
    out: str | Path,
    *,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Show = True,
    retry: bool = False,
    time_limit: float | None = None,
    lock: bool = True,
    part: Part | None = None,
) -> StoredRun:
    """Run a study, or what is missing of it, into a folder or a file; see `Study.run`.

    What is read back at the end decides whether it is complete.

    Raises
    ------
    StoreError
        If samples are missing in the end that have not failed.
    """
    path = as_path("out", out)
    if part is not None:
        path = make_part_folder(path, part)
    ensemble, plans = study.ensemble, study.plans
    check_run(ensemble.samples, ensemble.first, workers, executor, time_limit)
    plain = study.to_dict()  # refuses what cannot be written down
    check_target(path)
    to_file = path.suffix == ".nc"
    folder = folder_beside(path) if to_file else path
    before = None
    if to_file and path.exists():
        before = read_result(path)
        refuse_another(path, plain, json.loads(before.attrs["study"]))
        same = json.loads(before.attrs["study"])["ensemble"]["samples"] == ensemble.samples
        if same and not (folder / MANIFEST).exists() and not (retry and FAILED in before.attrs):
            return StoredRun(path)
    with writing(folder, plain, versions(), lock=lock) as store:
        if before is not None and not store.chunks and FAILED not in before.attrs:
            store.add(_outcomes_of(before, len(plans)), variables_in(plans))
        run_stored(
            store,
            plans,
            ensemble.samples,
            first=ensemble.first,
            workers=workers,
            executor=executor,
            progress=progress,
            retry=retry,
            time_limit=time_limit,
            part=part,
        )
        stored = StoredRun(folder)
        state, missing = stored.status(), stored.missing(part)
        if time_limit is not None and missing and not state.damaged:
            return StoredRun(path)
        if state.damaged or missing:
            raise StoreError(
                f"{folder}: {state.done} of {state.samples} samples are stored: others were damaged"
                f" or removed while the run went on ({'; '.join(state.damaged[:3]) or 'gone'}); the"
                " same command computes them again"
            )
        if to_file:
            write_result(stored, store, path)
    return StoredRun(path)


def write_result(stored: StoredRun, store: Store, path: Path) -> None:
    """Make the file of a complete run, and take away its folder unless samples have failed."""
    stored.export(path)
    if not store.failures:
        empty(store.path)
        with suppress(OSError):  # somebody else's files are in it
            (store.path / LOCK).unlink(missing_ok=True)
            store.path.rmdir()


INNER = ("sample", "kept_sample", "x", "y", DIRECTION)
"""Dimensions of a result that no sweep adds."""


def _outcomes_of(result: xr.Dataset, points: int) -> list[Outcome]:
    """A finished result as outcomes, one a point."""
    samples = result["sample"].values.astype(np.int64)
    kept = result["kept_sample"].values.astype(np.int64) if "kept_sample" in result else samples
    swept = result.sizes
    values = {}
    for name, variable in result.data_vars.items():
        inner = [dim for dim in variable.dims if dim in INNER]
        values[str(name)] = variable.values.reshape(points, *(swept[dim] for dim in inner))
    return [
        Outcome(point, samples, kept, {name: value[point] for name, value in values.items()})
        for point in range(points)
    ]

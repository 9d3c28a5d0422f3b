"""Runs on disk, read back: how far they are, and what they hold."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction._checks import as_path
from stiction.ensemble.assemble import Gathered
from stiction.ensemble.chunk import ROWS, stored_samples
from stiction.ensemble.manifest import MANIFEST
from stiction.ensemble.part import Part
from stiction.ensemble.store import Store, is_active
from stiction.ensemble.work import Failure
from stiction.errors import InputError, StoreError
from stiction.export import check_suffix, export
from stiction.files import DamagedError, read_dataset
from stiction.model import brief, describe
from stiction.study.study import Study

FAILED = "failed_samples"


@dataclass(frozen=True)
class Status:
    """How far a run is.

    Attributes
    ----------
    samples, done : int
        Of all points together.
    done_by_point : (points,) array
    failures : tuple of Failure
    damaged : tuple of str
        What is wrong with which chunk; running the study again mends it.
    verified : bool
        Whether everything was read and compared with its checksum, or chunks looked at only.
    chunks, bytes : int
    seconds : float
        Computing time of all workers together.
    active : bool
        Whether a process is writing to it now.
    """

    samples: int
    done: int
    done_by_point: NDArray[np.int64]
    failures: tuple[Failure, ...]
    damaged: tuple[str, ...]
    verified: bool
    chunks: int
    bytes: int
    seconds: float
    active: bool

    __repr__ = brief

    @property
    def complete(self) -> bool:
        """Whether every sample is stored."""
        return self.done == self.samples


class StoredRun:
    """A run on disk, for reading: a folder, or the NetCDF file of a finished one.

    Parameters
    ----------
    path : path

    Raises
    ------
    StoreError
        If there is no run.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = as_path("path", path)
        beside = folder_beside(self.path)
        self._store: Store | None = None
        if self.path.is_dir():
            self._store = Store(self.path)
        elif beside.is_dir() and ((beside / MANIFEST).exists() or not self.path.is_file()):
            self._store = Store(beside)
        elif self.path.is_file():
            self._result = read_result(self.path)
        else:
            raise StoreError(f"{self.path}: there is no run here")
        if self._store is not None:
            self.study = Study.from_dict(self._store.study, trusted=True)
        else:
            self.study = Study.from_result(self._result)
            _refuse_other_shape(self.path, self._result, self.study)

    def __repr__(self) -> str:
        points = len(self.study.plans)
        each = f"{points} points of " if points > 1 else ""
        return f"<StoredRun {str(self.path)!r}: {each}{self.study.ensemble.samples} samples>"

    def status(self, *, verify: bool = True) -> Status:
        """How far it is.

        Parameters
        ----------
        verify : bool
            Read every chunk and compare it with its checksum and with the list; else only look
            whether it is there, in its size. A finished file was verified when it was opened.

        Raises
        ------
        StoreError
            If something is there and cannot be read.
        """
        ensemble = self.study.ensemble
        points = len(self.study.plans)
        total = points * ensemble.samples
        if self._store is None:
            first = self._result[next(iter(self._result.data_vars))]
            done = np.isfinite(first.values.reshape(points, -1)).sum(axis=1)
            size = self.path.stat().st_size
            return Status(
                total, int(done.sum()), done, self.failures, (), True, 1, size, 0.0, False
            )
        store = self._store
        bad = store.verify(whole=verify)
        wrong = [f"{file} {text}" for file, text in sorted(bad.items())] + store.unlisted()
        intact = [chunk for chunk in store.chunks if chunk.file not in bad]
        done = stored_samples(intact, points, ensemble.samples, ensemble.first).sum(axis=1)
        return Status(
            total,
            int(done.sum()),
            done,
            self.failures,
            (*store.damage, *wrong),
            verify,
            len(intact),
            sum(chunk.bytes for chunk in intact),
            sum(chunk.seconds for chunk in intact),
            is_active(store.path),
        )

    def missing(self, part: Part | None = None) -> int:
        """How many samples are neither stored nor have failed, of a part or of all."""
        if self._store is None:
            return 0
        ensemble, points = self.study.ensemble, len(self.study.plans)
        spans = self._store.missing(points, ensemble.samples, ensemble.first, part=part)
        return sum(span.samples for span in spans)

    @property
    def versions(self) -> list[str]:
        """Versions of the package that computed it."""
        if self._store is not None:
            return self._store.versions
        return [str(self._result.attrs["stiction_version"])]

    @property
    def failures(self) -> tuple[Failure, ...]:
        """The samples that have failed."""
        if self._store is not None:
            return tuple(self._store.failures.values())
        return tuple(Failure(*item) for item in json.loads(self._result.attrs.get(FAILED, "[]")))

    def dataset(self, only: Sequence[str] | None = None) -> xr.Dataset:
        """All that is stored, labelled, NaN where a sample is missing.

        Parameters
        ----------
        only : sequence of str, optional
            Names of the variables to read; all if left out.
        """
        if self._store is None:
            names = [name for name in only or () if name in self._result]
            return self._result if only is None else self._result[names]
        study = self.study
        gathered = Gathered(study.plans, study.ensemble.samples, study.ensemble.first, only)
        for table in self._store.tables():
            values = {name: v for name, v in table.values.items() if name not in ROWS}
            gathered.put(*table.rows, values)
        attributes = study.attributes
        if self.failures:
            attributes[FAILED] = [list(failure) for failure in self.failures]
        missing = self.missing()
        if missing:
            total = len(study.plans) * study.ensemble.samples
            attributes["cut_short"] = f"{total - missing} of {total} samples are done"
        return gathered.dataset(attributes, study.axes)

    def export(self, path: str | Path) -> None:
        """Write `dataset` as the suffix says (.nc, .csv, .parquet, .zarr), whole or not at all.

        Raises
        ------
        InputError
            If the suffix is another one, or its library is not installed.
        StoreError
            If it cannot be written.
        """
        target = as_path("path", path)
        check_suffix(target)
        export(self.dataset(), target)


def folder_beside(file: Path) -> Path:
    """Where the chunks of ``result.nc`` are until it is complete."""
    return file.parent / f"{file.name}.run"


def read_result(path: Path) -> xr.Dataset:
    """The result of a finished run, verified; `StoreError` if it is none."""
    try:
        result = read_dataset(path)
    except OSError as error:
        raise StoreError(f"{path}: cannot be read: {error.strerror or error}") from None
    except DamagedError as error:
        raise StoreError(
            f"{path}: {error}; move it away, and running the study again computes it anew"
        ) from None
    if "study" not in result.attrs:
        raise StoreError(f"{path}: holds no result of a study")
    try:
        str(result.attrs["stiction_version"])
        for item in json.loads(result.attrs.get(FAILED, "[]")):
            Failure(*item)
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise StoreError(
            f"{path}: its attributes are damaged ({type(error).__name__}: {error})"
        ) from None
    return result


def _refuse_other_shape(path: Path, result: xr.Dataset, study: Study) -> None:
    """A result that does not hold what its study says was put together by something else."""
    names = study.plans[0].variables.keys()
    missing = [name for name in names if name not in result]
    sizes = {"sample": study.ensemble.samples} | {axis.dim: axis.size for axis in study.axes}
    wrong = [dim for dim, size in sizes.items() if result.sizes.get(dim) != size]
    if missing or wrong:
        what = ", ".join([*missing, *wrong])
        raise StoreError(f"{path}: does not hold the results of its study (see {what})")


def open_run(path: Any) -> StoredRun:
    """A run on disk, by the path of its folder or file.

    Raises
    ------
    InputError
        If the path is not one.
    StoreError
        If there is no run.
    """
    if not isinstance(path, str | Path):
        raise InputError(f"path: must be the path of a run, got {describe(path)}")
    return StoredRun(path)

"""A study run into a folder, from the beginning or from where it was interrupted, and read back."""

from __future__ import annotations

import re
from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction.ensemble.dataset import Gathered, warn_of_failures
from stiction.ensemble.monte_carlo import compute
from stiction.ensemble.pilot import pilot_attributes
from stiction.ensemble.store import SAVE_SECONDS, Store
from stiction.ensemble.table import Failure
from stiction.errors import InputError, StoreError, warn_user
from stiction.model import FilePath, brief, check, describe, is_whole
from stiction.progress import Show
from stiction.random.synthesis import BLOCK
from stiction.study.export import check_suffix, export

FEWEST_BLOCKS = 8
"""Blocks of samples that a part has if there are enough, so that parts take about as long."""


class Part(NamedTuple):
    """Part `number` (from 1) of `of`: the samples that one of several jobs computes.

    Blocks of consecutive samples are dealt out in turn, through all points of a sweep, so that
    parts are alike even where points are not.
    """

    number: int
    of: int

    def mask(self, points: int, samples: int) -> NDArray[np.bool_]:
        """Return which samples it has, (points, samples)."""
        total = points * samples
        block = min(BLOCK, max(1, total // (FEWEST_BLOCKS * self.of)))
        mine: NDArray[np.bool_] = np.arange(total) // block % self.of == self.number - 1
        return mine.reshape(points, samples)


def as_part(value: Any) -> Part:
    """Return a part from a pair of numbers or a text such as '3/100'.

    Raises
    ------
    InputError
    """
    pair: Any = value
    if isinstance(value, str):
        found = re.fullmatch(r"\s*(\d{1,9})\s*/\s*(\d{1,9})\s*", value)
        pair = tuple(int(number) for number in found.groups()) if found else None
    valid = (
        isinstance(pair, tuple | list)
        and len(pair) == 2
        and all(is_whole(number, 1) for number in pair)
        and pair[0] <= pair[1]
    )
    if not valid:
        raise InputError(
            "part: must be which part of how many, such as 3/100 (in Python also (3, 100)), from"
            f" 1/100 to 100/100; got {describe(value)}"
        )
    return Part(int(pair[0]), int(pair[1]))


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
        Whether everything was compared with its digest.
    chunks, bytes : int
    seconds : float
        Computing time of all workers together.
    versions : tuple of str
        Versions of what computed it.
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
    versions: tuple[str, ...]

    __repr__ = brief

    @property
    def complete(self) -> bool:
        """Whether every sample is stored."""
        return self.done == self.samples


class StoredRun:
    """A run on disk, for reading; see `stiction.open_run`.

    Attributes
    ----------
    path : Path
    study : Study
    """

    def __init__(self, store: Store, study: Any) -> None:
        self.path, self.study, self._store = store.path, study, store

    def __repr__(self) -> str:
        points = len(self.study.experiments)
        each = f"{points} points of " if points > 1 else ""
        return f"<StoredRun {str(self.path)!r}: {each}{self.study.ensemble.samples} samples>"

    def status(self, *, verify: bool = True) -> Status:
        """Return how far it is.

        Parameters
        ----------
        verify : bool
            Read everything and compare it with its digests; else only which samples there are.

        Raises
        ------
        StoreError
            If something is there and cannot be read.
        """
        ensemble, points = self.study.ensemble, len(self.study.experiments)
        rows = Gathered(self.study.experiments, ensemble.samples, ensemble.first, ())
        count, size, seconds = 0, 0, 0.0
        versions: dict[str, None] = {}
        for chunk in self._store.chunks(whole=verify):
            rows.add(chunk.table)
            count, size = count + 1, size + chunk.bytes
            seconds += chunk.table.seconds
            versions[chunk.versions] = None
        done = rows.done.sum(axis=1)
        return Status(
            samples=points * ensemble.samples,
            done=int(done.sum()),
            done_by_point=done,
            failures=tuple(rows.failed),
            damaged=tuple(self._store.damage),
            verified=verify,
            chunks=count,
            bytes=size,
            seconds=seconds,
            versions=tuple(versions),
        )

    def dataset(self, only: Sequence[str] | None = None) -> xr.Dataset:
        """Return everything that is stored, labelled, NaN where a sample is missing.

        Parameters
        ----------
        only : sequence of str, optional
            Names of the variables to read; all if left out.

        Warns
        -----
        UserWarning
            If something is damaged.
        """
        return self._read(only)[0]

    def _read(self, only: Sequence[str] | None = None) -> tuple[xr.Dataset, Gathered]:
        study = self.study
        rows = Gathered(study.experiments, study.ensemble.samples, study.ensemble.first, only)
        for chunk in self._store.chunks():
            rows.add(chunk.table)
        for text in self._store.damage:
            text = f"{self.path}: {text}; its samples are missing; run the study again"
            warn_user(text, UserWarning)
        attributes = {**study.attributes, **(self._store.pilot() or {})}
        total, made = rows.done.size, int(rows.done.sum())
        if made + len(rows.failed) < total:
            attributes["cut_short"] = f"{made} of {total} samples are done"
        return rows.dataset(attributes, study.axes), rows

    def export(self, path: str | Path) -> None:
        """Write `dataset` as the suffix says (.nc, .csv, .parquet, .zarr), whole or not at all.

        Raises
        ------
        InputError
            If the suffix is another one, or its library is not installed.
        StoreError
            If it cannot be written.
        """
        target = check("path", path, FilePath)
        check_suffix(target)
        export(self.dataset(), target)


def run_into(
    study: Any,
    out: str | Path,
    *,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Show = True,
    time_limit: float | None = None,
    retry: bool = False,
    part: Any = None,
    pilot: bool = True,
) -> StoredRun:
    """Run a study, or what is missing of it, into a folder; see `Study.run`."""
    mine = None if part is None else as_part(part)
    ensemble, points = study.ensemble, study.experiments
    size = len(points), ensemble.samples
    store = Store.open(check("out", out, FilePath), study.to_dict())
    done = store.done(*size, ensemble.first, retry=retry, whole=mine is None)
    if mine is not None:
        done |= ~mine.mask(*size)
    try:
        compute(
            points,
            done,
            store,
            first=ensemble.first,
            workers=workers,
            executor=executor,
            progress=progress,
            time_limit=time_limit,
            seconds=SAVE_SECONDS,
        )
        if pilot and (mine is None or mine.number == 1) and store.pilot() is None:
            show = progress is True
            found = pilot_attributes(points, ensemble.samples, ensemble.first, show=show)
            store.note_pilot(found)
    finally:
        with suppress(StoreError):
            store.close()
    return StoredRun(store, study)


def result_of(stored: StoredRun, *, partial: bool) -> xr.Dataset:
    """Return the dataset of a run that has just ended, and warn of samples that failed.

    Parameters
    ----------
    stored : StoredRun
    partial : bool
        Whether samples may be missing: after a time limit, or of a part.

    Raises
    ------
    StoreError
        If samples are missing that should be there.
    """
    result, rows = stored._read()
    made, total = int(rows.done.sum()), rows.done.size
    if made + len(rows.failed) < total and not partial:
        raise StoreError(
            f"{stored.path}: {made} of {total} samples are stored: others were damaged or removed"
            " while the run went on; the same command computes them again"
        )
    warn_of_failures(rows.failed, total)
    return result

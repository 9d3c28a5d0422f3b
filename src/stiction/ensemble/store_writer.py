"""Writing to a run: chunks, their list, and the joining of small chunks as they become many."""

from __future__ import annotations

import os
import uuid
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.ensemble.chunk import Chunk, DamagedChunk, Table, joined, mark_of, tables_of
from stiction.ensemble.files import Lock, NoLock, cannot_write, printable, read_whole, write_whole
from stiction.ensemble.manifest import (
    FORMAT,
    MANIFEST,
    DamagedManifest,
    refuse_another,
    write_manifest,
)
from stiction.ensemble.store import CHUNKS, LIST, LOCK, OWN, Store, sealed, warn_of_damage
from stiction.ensemble.work import Outcome
from stiction.errors import StoreError
from stiction.files import PART, final_name
from stiction.results import Variable

MANY = 64
"""Chunks of one level that are joined to one of the next."""
LARGE = 16 * 2**20
"""Bytes of a chunk that is not joined any more."""


class StoreWriter(Store):
    """A store that is written to, by one process at a time.

    Parameters
    ----------
    path : Path
    lock : Lock or NoLock
        Held; asked before every write whether it still is.
    """

    def __init__(self, path: Path, lock: Lock | NoLock) -> None:
        super().__init__(path)
        self._lock = lock
        self._token = uuid.uuid4().hex[:8]  # two writers never choose the same name
        numbers = [int(Path(chunk.file).stem.split("-")[0]) for chunk in self.chunks]
        self._next = max(numbers, default=-1) + 1

    def _write_list(self) -> None:
        entries: list[dict[str, Any]] = [chunk.entry() for chunk in self.chunks]
        if self.failures:
            entries.append({"failed": [list(f) for f in self.failures.values()]})
        self._lock.check()
        write_whole(self.path / LIST, b"".join(map(sealed, entries)))

    def _clean(self) -> None:
        """Drop damaged chunks with a warning, take in whole ones that the list does not name."""
        folder = self.path / CHUNKS
        if folder.is_symlink() or not folder.is_dir():
            raise StoreError(f"{folder}: is no folder of its own; chunks are kept in a real one")
        try:
            names = sorted(entry.name for entry in os.scandir(folder))
        except OSError as error:
            raise StoreError(f"{folder}: cannot be read: {error}") from error
        for name in names:
            if name.endswith(PART) and OWN.fullmatch(final_name(name)):
                (folder / name).unlink(missing_ok=True)
        bad: dict[Chunk, DamagedChunk] = {}
        for chunk in self.chunks:
            try:
                self.bytes_of(chunk)
            except DamagedChunk as error:
                bad[chunk] = error
        self.chunks = [chunk for chunk in self.chunks if chunk not in bad]
        listed = {chunk.file for chunk in self.chunks}
        unlisted = [n for n in names if OWN.fullmatch(n) and f"{CHUNKS}/{n}" not in listed]
        known = {chunk.file for chunk in bad}
        taken = [self._take_in(f"{CHUNKS}/{name}", known) for name in unlisted]
        for damage in self.damage:
            self._warn(f"{damage}; what it named is taken from the chunks or computed again")
        for chunk, reason in bad.items():
            if not chunk.is_within(self.chunks):
                text = f"its {chunk.samples} samples are computed again"
                warn_of_damage(self.path, chunk, reason, text)
        if bad or self.damage or any(taken) or not (self.path / LIST).exists():
            self._write_list()
        self.damage = []

    def _take_in(self, file: str, known: set[str]) -> bool:
        """List a whole chunk that nobody lists, if it adds something; delete what is damaged."""
        path = self.path / file
        data = read_whole(path)
        if data is None:
            return False
        try:
            table = Table.decode(data)
        except DamagedChunk as error:
            if file not in known:
                self._warn(f"{file}: {error}, and nobody lists it; it is deleted")
            path.unlink(missing_ok=True)
            return False
        if table.study != self._mark:
            self._warn(f"{file}: belongs to another study; it is left alone")
            return False
        chunk = table.as_chunk(file, data)
        if chunk.is_within(self.chunks):  # a rest of joining
            path.unlink(missing_ok=True)
            return False
        self._note(chunk.entry())
        return True

    def add(self, outcomes: Sequence[Outcome], variables: Mapping[str, Variable]) -> None:
        """Store outcomes, all their variables together.

        Raises
        ------
        StoreError
            If they cannot be written; what was stored before stays readable.
        """
        failed = [list(f) for outcome in outcomes for f in outcome.failures]
        entries: list[dict[str, Any]] = [{"failed": failed}] if failed else []
        entries += [self._write(table, 0).entry() for table in tables_of(outcomes, variables)]
        if entries:
            self._append(entries)
            self._join_small()

    def take_over(self, other: Store, points: int, samples: int, first: int) -> None:
        """Store what another store of the same study holds and this one does not.

        Raises
        ------
        StoreError
            If a sample is in both and not the same.
        """
        here = self.done(points, samples, first)

        def known(point: NDArray[Any], sample: NDArray[Any]) -> NDArray[Any]:
            found: NDArray[Any] = here[point, sample - first]
            return found

        entries: list[dict[str, Any]] = []
        for table in other.tables():
            repeated = table.at(known)
            if repeated.values["point"].size:
                self._compare(repeated, other.path)
                table = table.at(lambda point, sample: ~known(point, sample))
            if table.values["point"].size:
                entries.append(self._write(table, 0).entry())
        here = here | other.done(points, samples, first)
        failed = [list(f) for f in other.failures.values() if not here[f.point, f.sample - first]]
        entries += [{"failed": failed}] if failed else []
        if entries:
            self._append(entries)
            self._join_small()

    def _compare(self, table: Table, path: Path) -> None:
        """Refuse samples that are stored already and were another result."""
        wanted = {key: row for row, key in enumerate(table.keys)}
        for stored in self.tables():
            rows = [(row, wanted[key]) for row, key in enumerate(stored.keys) if key in wanted]
            if not rows:
                continue
            there, here = np.array(rows).T
            for name, value in table.narrow.items():
                if not np.array_equal(stored.values[name][there], value[here], equal_nan=True):
                    points = ", ".join(str(key) for key in table.keys[:3])
                    raise StoreError(
                        f"{path}: holds samples that are stored already with another {name}"
                        f" (point and sample: {points}...); one of both was computed by another"
                        " version or was changed"
                    )

    def _write(self, table: Table, level: int) -> Chunk:
        data = table.encode(FORMAT, self._mark, level)
        file = f"{CHUNKS}/{self._next:06d}-{self._token}.nc"
        self._next += 1
        self._lock.check()
        write_whole(self.path / file, data)
        return table.as_chunk(file, data, level)

    def _append(self, entries: Sequence[Mapping[str, Any]]) -> None:
        path = self.path / LIST
        self._lock.check()
        try:
            with open(path, "ab") as file:
                before = file.tell()
                try:
                    file.write(b"".join(map(sealed, entries)))
                    file.flush()
                    os.fsync(file.fileno())
                except OSError:
                    with suppress(OSError):
                        os.ftruncate(file.fileno(), before)
                    raise
        except OSError as error:
            raise cannot_write(path, error) from error
        for entry in entries:
            self._note(entry)

    def _join_small(self) -> None:
        """Join small chunks, sixty-four of a level to one of the next.

        However long a run is, its chunks stay few, and each number is written a few times only.
        The list changes when the joined chunk is whole, and the small ones go when it has changed.
        """
        small = [chunk for chunk in self.chunks if chunk.bytes < LARGE]
        for level in sorted({chunk.level for chunk in small}):
            group = [chunk for chunk in small if chunk.level == level]
            if len(group) < MANY:
                continue
            tables, old, size = [], [], 0
            for chunk in group:
                with suppress(DamagedChunk):  # it stays listed, and is reported at the end
                    tables.append(self.table(chunk))
                    old.append(chunk)
                size += chunk.bytes
                if size >= LARGE:
                    break
            if len(old) < 2:
                continue
            new = [self._write(table, level + 1) for table in joined(tables)]
            gone = {chunk.file for chunk in old}
            self.chunks = [chunk for chunk in self.chunks if chunk.file not in gone] + new
            self._write_list()
            for chunk in old:
                with suppress(OSError):  # the next run finds what is left
                    (self.path / chunk.file).unlink()


@contextmanager
def writing(
    path: Path, study: dict[str, Any], version: str, *, lock: bool = True
) -> Iterator[StoreWriter]:
    """Open a folder for writing, a new one or one that holds the same study.

    Raises
    ------
    StoreError
        If another run is writing to it, the folder cannot be written, holds other files, or holds
        another study (the differences are named).
    """
    prepare_folder(path)
    with Lock(path / LOCK) if lock else NoLock() as held:
        store = _open_or_make(path, study, version, held)
        refuse_another(path, study, store.study)
        if version not in store.versions:
            store._warn(
                f"was begun with {store.versions[-1]}, this is {version}: samples"
                " of both may differ in their last digits"
            )
        if version not in store.versions or study != store.study:
            store.versions += [version] * (version not in store.versions)
            store.study = study
            write_manifest(path, study, store.versions)
        try:
            (path / CHUNKS).mkdir(exist_ok=True)
        except FileExistsError:
            pass  # said below
        except OSError as error:
            raise cannot_write(path / CHUNKS, error) from error
        store._clean()
        yield store


def _open_or_make(
    path: Path, study: dict[str, Any], version: str, lock: Lock | NoLock
) -> StoreWriter:
    """The store of a folder; a damaged manifest is made anew if the chunks are of this study."""
    try:
        return StoreWriter(path, lock)
    except DamagedManifest as error:
        marks = _marks_of_chunks(path)
        if marks - {mark_of(study)}:
            raise StoreError(
                f"{error}; its chunks belong to another study than the one that is given here"
            ) from None
        if marks or (path / MANIFEST).exists():
            warnings.warn(f"{error}: it is made anew from the study that is given", stacklevel=4)
        write_manifest(path, study, [version])
        return StoreWriter(path, lock)


def _marks_of_chunks(path: Path) -> set[str]:
    """Marks of the studies whose chunks are in a folder."""
    marks = set()
    for file in sorted((path / CHUNKS).glob("*.nc")):
        if OWN.fullmatch(file.name):
            with suppress(DamagedChunk):
                marks.add(Table.decode(read_whole(file) or b"").study)
    return marks


def prepare_folder(path: Path) -> None:
    """Make the folder, or refuse it before any work is done."""
    if path.exists() and not path.is_dir():
        raise StoreError(f"{path}: is a file; a run needs a folder")
    if not path.absolute().parent.is_dir():
        raise StoreError(f"{path}: the folder {path.absolute().parent} does not exist")
    try:
        path.mkdir(exist_ok=True)
        names = {entry.name for entry in path.iterdir()} - {LOCK}
        others = {
            name for name in names if final_name(name) == name or final_name(name) != MANIFEST
        }
    except OSError as error:
        raise cannot_write(path, error) from error
    if others and MANIFEST not in others and not (LIST in others or _marks_of_chunks(path)):
        some = printable(", ".join(sorted(others)[:3]))
        raise StoreError(f"{path}: holds other files ({some}); choose a new folder")


def empty(path: Path) -> None:
    """Take what is a run's own out of its folder but for the lock.

    The manifest goes last: at any moment in between it is a run, though without some chunks.
    """
    folder = path / CHUNKS
    (path / LIST).unlink(missing_ok=True)
    for file in folder.iterdir():
        if OWN.fullmatch(final_name(file.name)):
            file.unlink()
    with suppress(OSError):  # somebody else's files are in it
        folder.rmdir()
    (path / MANIFEST).unlink()

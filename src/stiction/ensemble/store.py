"""A run in progress: a folder of small NetCDF chunks and the list of what they hold.

``manifest.json`` says which study it is, ``chunks.jsonl`` has one line for each chunk, ``chunks/``
the chunks. A chunk is a table: one row a sample, with the numbers of its point and sample, and
with a mark of its study. Everything is written whole or not at all and carries a digest: a run may
be killed at any moment, and what was damaged since is found. Small chunks are joined as they
become many.
"""

from __future__ import annotations

import json
import os
import re
import uuid
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from stiction._files import PART
from stiction.ensemble.chunk import (
    Chunk,
    DamagedChunk,
    Table,
    joined,
    mark_of,
    missing_spans,
    stored_samples,
    tables_of,
)
from stiction.ensemble.files import (
    Lock,
    NoLock,
    cannot_write,
    digest,
    printable,
    read_whole,
    write_whole,
)
from stiction.ensemble.same import refuse_another
from stiction.ensemble.scheduler import Span
from stiction.ensemble.work import Failure, Outcome
from stiction.errors import StoreError
from stiction.results import Variable

FORMAT = 2
MANIFEST, LIST, CHUNKS, LOCK = "manifest.json", "chunks.jsonl", "chunks", "lock"
MANY = 64
"""Chunks of one level that are joined to one of the next."""
LARGE = 16 * 2**20
"""Bytes of a chunk that is not joined any more."""
_OWN = re.compile(r"(\d{6,})-[0-9a-f]{8}\.nc")


class Store:
    """What is stored in a folder.

    Parameters
    ----------
    path : Path
        Folder of a run.

    Attributes
    ----------
    study : dict
        In plain form.
    versions : list of str
        Of what wrote to it, as of `stiction.ensemble.versions`.
    chunks : list of Chunk
    failures : dict of Failure
        By point and sample.
    damage : list of str
        What is wrong with the list itself.

    Raises
    ------
    StoreError
        If the folder holds no run, one of another format, or one that cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        manifest = read_manifest(path)
        self.study: dict[str, Any] = manifest["study"]
        self.versions: list[str] = manifest["versions"]
        self.chunks: list[Chunk] = []
        self.failures: dict[tuple[int, int], Failure] = {}
        self.damage: list[str] = []
        self._mark = mark_of(self.study)
        self._next, self._read = 0, ""
        self._token = uuid.uuid4().hex[:8]
        self._lock: Lock | NoLock = NoLock()
        self._read_list()

    def _read_list(self) -> bool:
        """Read the list, and whether it is another than before."""
        data = read_whole(self.path / LIST) or b""
        if digest(data) == self._read:
            return False
        self._read, self.chunks, self.failures, self.damage = digest(data), [], {}, []
        lines = data.split(b"\n")
        for number, line in enumerate(lines, 1):
            try:
                self._note(_opened(line))
            except (ValueError, KeyError, TypeError):
                if number < len(lines):  # what follows the last line end was cut short
                    self.damage.append(f"line {number} of {LIST} fails its checksum")
        return True

    def _note(self, entry: Mapping[str, Any]) -> None:
        if "file" in entry:
            chunk = Chunk.from_entry(entry)
            folder, _, name = chunk.file.partition("/")
            own = _OWN.fullmatch(name)
            if folder != CHUNKS or own is None:
                raise ValueError(f"{chunk.file}: is no name of a chunk")
            self.chunks.append(chunk)
            self._next = max(self._next, int(own[1]) + 1)
            for key in list(self.failures):
                if chunk.holds(*key):
                    del self.failures[key]
        for item in entry.get("failed", ()):
            failure = Failure(*item)
            self.failures[failure.point, failure.sample] = failure

    # -- what is there ---------------------------------------------------------------------------

    def done(self, points: int, samples: int, first: int = 0) -> NDArray[Any]:
        """Which samples are stored, (points, samples)."""
        return stored_samples(self.chunks, points, samples, first)

    def missing(
        self, points: int, samples: int, first: int = 0, *, retry: bool = False
    ) -> list[Span]:
        """What is to be computed; failed samples only if they are to be retried."""
        found = self.done(points, samples, first)
        if not retry:
            for point, sample in self.failures:
                if 0 <= sample - first < samples:
                    found[point, sample - first] = True
        return missing_spans(found, first)

    def bytes_of(self, chunk: Chunk) -> bytes:
        """The bytes of a chunk.

        Raises
        ------
        DamagedChunk
            If it is gone, truncated or corrupted.
        StoreError
            If it cannot be read, which is no damage.
        """
        data = read_whole(self.path / chunk.file)
        if data is None:
            raise DamagedChunk("is gone")
        if digest(data) != chunk.sha256:
            raise DamagedChunk("fails its checksum")
        return data

    def table(self, chunk: Chunk) -> Table:
        """The table of a chunk, which holds what the list says, of this study."""
        table = Table.decode(self.bytes_of(chunk))
        if table.study != self._mark:
            raise DamagedChunk("belongs to another study")
        if not chunk.agrees_with(table):
            raise DamagedChunk("holds other samples than the list says")
        return table

    def verify(self, *, whole: bool = True) -> dict[str, str]:
        """What is wrong with which chunk: of all that is in it, or of its size alone."""
        look = self.table if whole else self._look_at
        while True:
            found = {}
            for chunk in self.chunks:
                try:
                    look(chunk)
                except DamagedChunk as error:
                    found[chunk.file] = str(error)
            if not found or not self._read_list():  # a run may have joined chunks meanwhile
                return found

    def _look_at(self, chunk: Chunk) -> None:
        try:
            size = os.stat(self.path / chunk.file).st_size
        except FileNotFoundError:
            raise DamagedChunk("is gone") from None
        except OSError as error:
            raise StoreError(f"{self.path / chunk.file}: cannot be read: {error}") from error
        if size != chunk.bytes:
            raise DamagedChunk(f"has {size} bytes instead of {chunk.bytes}")

    def tables(self) -> Iterator[Table]:
        """All that is stored, chunk after chunk; damaged ones are skipped with a warning."""
        for damage in self.damage:
            self._warn(f"{damage}; what it named is missing; run the study again")
        seen: set[str] = set()
        waiting = list(self.chunks)
        while waiting:
            chunk = waiting.pop(0)
            try:
                table = self.table(chunk)
            except DamagedChunk as error:
                if self._read_list():  # a run has joined chunks meanwhile
                    waiting = [chunk for chunk in self.chunks if chunk.file not in seen]
                    continue
                warn_of_damage(
                    self.path, chunk, error, "its samples are missing; run the study again"
                )
                continue
            seen.add(chunk.file)
            yield table

    def _warn(self, text: str) -> None:
        warnings.warn(f"{self.path}: {text}", stacklevel=3)

    # -- writing ---------------------------------------------------------------------------------

    def _write_list(self) -> None:
        entries: list[dict[str, Any]] = [chunk.entry() for chunk in self.chunks]
        if self.failures:
            entries.append({"failed": [list(f) for f in self.failures.values()]})
        self._lock.check()
        write_whole(self.path / LIST, b"".join(map(_sealed, entries)))

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
            if name.endswith(PART) and _OWN.fullmatch(name.removesuffix(PART)):
                (folder / name).unlink(missing_ok=True)
        bad: dict[Chunk, DamagedChunk] = {}
        for chunk in self.chunks:
            try:
                self.bytes_of(chunk)
            except DamagedChunk as error:
                bad[chunk] = error
        self.chunks = [chunk for chunk in self.chunks if chunk not in bad]
        listed = {chunk.file for chunk in self.chunks}
        unlisted = [n for n in names if _OWN.fullmatch(n) and f"{CHUNKS}/{n}" not in listed]
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
        number = int(Path(file).stem.split("-")[0])
        self._next = max(self._next, number + 1)
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
                    file.write(b"".join(map(_sealed, entries)))
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


# -- lines and the manifest ------------------------------------------------------------------------


def _sealed(entry: Mapping[str, Any]) -> bytes:
    """A line of the list: a digest, and the entry as JSON."""
    text = json.dumps(entry).encode()
    return digest(text)[:16].encode() + b" " + text + b"\n"


def _opened(line: bytes) -> dict[str, Any]:
    if not line:
        return {}
    mark, _, text = line.partition(b" ")
    if digest(text)[:16].encode() != mark:
        raise ValueError("fails its checksum")
    entry: dict[str, Any] = json.loads(text)
    return entry


class DamagedManifest(StoreError):
    """A manifest that is gone or not what was written; the study makes a new one."""


def read_manifest(path: Path) -> dict[str, Any]:
    """The manifest of a run.

    Raises
    ------
    DamagedManifest
    StoreError
        If it is of another format, or cannot be read.
    """
    data = read_whole(path / MANIFEST)
    if data is None:
        raise DamagedManifest(f"{path}: holds no run (no {MANIFEST} in it)")
    advice = "is damaged; running the study again into the folder makes a new one"
    try:
        manifest: dict[str, Any] = json.loads(data)
        said = manifest.pop("sha256", None)
        found = manifest.get("format")
    except (ValueError, AttributeError):
        raise DamagedManifest(f"{path / MANIFEST}: {advice}") from None
    if found != FORMAT and (said is None or said == _seal(manifest)):
        raise StoreError(
            f"{path}: is of format {printable(repr(found))}; this version reads {FORMAT}"
        )
    if said != _seal(manifest):
        raise DamagedManifest(f"{path / MANIFEST}: {advice}")
    return manifest


def _write_manifest(path: Path, study: dict[str, Any], versions: list[str]) -> None:
    manifest = {"format": FORMAT, "study": study, "versions": versions}
    text = json.dumps(manifest | {"sha256": _seal(manifest)}, indent=1)
    write_whole(path / MANIFEST, text.encode())


def _seal(manifest: Mapping[str, Any]) -> str:
    return digest(json.dumps(manifest, sort_keys=True).encode())


@contextmanager
def writing(
    path: Path, study: dict[str, Any], version: str, *, lock: bool = True
) -> Iterator[Store]:
    """Open a folder for writing, a new one or one that holds the same study.

    Raises
    ------
    StoreError
        If another run is writing to it, the folder cannot be written, holds other files, or holds
        another study (the differences are named).
    """
    prepare_folder(path)
    with Lock(path / LOCK) if lock else NoLock() as held:
        store = _opened_or_new(path, study, version)
        refuse_another(path, study, store.study)
        if version not in store.versions:
            store._warn(
                f"was begun with {store.versions[-1]}, this is {version}: samples"
                " of both may differ in their last digits"
            )
        if version not in store.versions or study != store.study:
            store.versions += [version] * (version not in store.versions)
            store.study = study
            _write_manifest(path, study, store.versions)
        try:
            (path / CHUNKS).mkdir(exist_ok=True)
        except FileExistsError:
            pass  # said below
        except OSError as error:
            raise cannot_write(path / CHUNKS, error) from error
        store._lock = held
        store._clean()
        yield store


def _opened_or_new(path: Path, study: dict[str, Any], version: str) -> Store:
    """The store of a folder; a damaged manifest is made anew if the chunks are of this study."""
    try:
        return Store(path)
    except DamagedManifest as error:
        marks = _marks_of_chunks(path)
        if marks - {mark_of(study)}:
            raise StoreError(
                f"{error}; its chunks belong to another study than the one that is given here"
            ) from None
        if marks or (path / MANIFEST).exists():
            warnings.warn(f"{error}: it is made anew from the study that is given", stacklevel=4)
        _write_manifest(path, study, [version])
        return Store(path)


def _marks_of_chunks(path: Path) -> set[str]:
    """Marks of the studies whose chunks are in a folder."""
    marks = set()
    for file in sorted((path / CHUNKS).glob("*.nc")):
        if _OWN.fullmatch(file.name):
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
        others = {entry.name for entry in path.iterdir()} - {LOCK, f"{MANIFEST}{PART}"}
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
        if _OWN.fullmatch(file.name.removesuffix(PART)):
            file.unlink()
    with suppress(OSError):  # somebody else's files are in it
        folder.rmdir()
    (path / MANIFEST).unlink()


def warn_of_damage(path: Path, chunk: Chunk, error: Exception, consequence: str) -> None:
    """Warn of a chunk that is gone, truncated or corrupted."""
    warnings.warn(f"{path / chunk.file}: {error}; {consequence}", stacklevel=4)

"""A run in progress: a folder of small NetCDF chunks and the list of what they hold.

``manifest.json`` says which study it is, ``chunks.jsonl`` has one line for each chunk with its
hash, ``chunks/`` the chunks. A chunk is a table: one row a sample, with the numbers of its point
and sample. Only one process writes, everything is written whole or not at all, and what the list
does not name does not exist: a run may be killed at any moment.
"""

from __future__ import annotations

import json
import os
import shutil
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.ensemble.files import (
    Lock,
    cannot_write,
    decode,
    digest,
    encode,
    write_whole,
)
from stiction.ensemble.same import refuse_another
from stiction.ensemble.scheduler import Span
from stiction.ensemble.trouble import StoreError
from stiction.ensemble.work import Failure, Outcome
from stiction.results import Variable

FORMAT = 1
MANIFEST, LIST, CHUNKS, LOCK = "manifest.json", "chunks.jsonl", "chunks", "lock"

_ROW = {
    "point": Variable("1", "number of the point of the sweep", ("row",)),
    "sample": Variable("1", "sample number", ("row",)),
    "wide_point": Variable("1", "number of the point of the sweep", ("wide_row",)),
    "wide_sample": Variable("1", "sample number", ("wide_row",)),
}


@dataclass(frozen=True)
class Chunk:
    """One line of the list: a file, its hash, and the samples in it."""

    file: str
    sha256: str
    bytes: int
    seconds: float
    done: tuple[Span, ...]

    @property
    def samples(self) -> int:
        """Number of samples in it."""
        return sum(span.samples for span in self.done)


class Store:
    """What is stored in a folder.

    Parameters
    ----------
    path : Path
        Folder of a run.

    Raises
    ------
    StoreError
        If the folder holds no run, or one of another format.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            manifest = json.loads((path / MANIFEST).read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise StoreError(f"{path}: holds no run (no {MANIFEST} in it)") from None
        except (OSError, ValueError) as error:
            raise StoreError(f"{path / MANIFEST}: cannot be read: {error}") from None
        if manifest.get("format") != FORMAT:
            raise StoreError(
                f"{path}: is of format {manifest.get('format')!r}; this version reads {FORMAT}"
            )
        self.study: dict[str, Any] = manifest["study"]
        self.versions: list[str] = manifest["versions"]
        self.chunks: list[Chunk] = []
        self.failures: dict[tuple[int, int], Failure] = {}
        self._next = 0
        self._read_list()

    def _read_list(self) -> None:
        try:
            lines = (self.path / LIST).read_bytes().split(b"\n")
        except FileNotFoundError:
            return
        for line in lines:
            with suppress(ValueError, KeyError, TypeError):  # the last line may be torn
                self._note(json.loads(line))

    def _note(self, entry: Mapping[str, Any]) -> None:
        if "file" in entry:
            done = tuple(Span(*span) for span in entry["done"])
            chunk = Chunk(entry["file"], entry["sha256"], entry["bytes"], entry["seconds"], done)
            self.chunks.append(chunk)
            self._next = max(self._next, int(Path(chunk.file).stem) + 1)
            if self.failures:
                for key in list(self.failures):
                    if any(s.point == key[0] and 0 <= key[1] - s.first < s.samples for s in done):
                        del self.failures[key]
        for item in entry.get("failed", ()):
            failure = Failure(*item)
            self.failures[failure.point, failure.sample] = failure

    # -- what is there ---------------------------------------------------------------------------

    def done(self, points: int, samples: int, first: int = 0) -> NDArray[np.bool_]:
        """Which samples are stored, (points, samples)."""
        found = np.zeros((points, samples), dtype=np.bool_)
        for chunk in self.chunks:
            for span in chunk.done:
                start = max(span.first - first, 0)
                found[span.point, start : max(span.first + span.samples - first, 0)] = True
        return found

    def missing(
        self, points: int, samples: int, first: int = 0, *, retry: bool = False
    ) -> list[Span]:
        """What is to be computed; failed samples only if they are to be retried."""
        found = self.done(points, samples, first)
        if not retry:
            for point, sample in self.failures:
                if 0 <= sample - first < samples:
                    found[point, sample - first] = True
        return [span for point in range(points) for span in _spans(point, ~found[point], first)]

    def read(self, chunk: Chunk) -> bytes | None:
        """The bytes of a chunk, or None if it is gone, truncated or corrupted."""
        try:
            data = (self.path / chunk.file).read_bytes()
        except OSError:
            return None
        return data if digest(data) == chunk.sha256 else None

    def damaged(self) -> list[Chunk]:
        """The chunks that fail their checksum."""
        return [chunk for chunk in self.chunks if self.read(chunk) is None]

    def outcomes(self) -> Iterator[Outcome]:
        """All that is stored, chunk after chunk; damaged ones are skipped with a warning."""
        for chunk in self.chunks:
            data = self.read(chunk)
            if data is None:
                warn_of_damage(self.path, chunk, "its samples are missing; run the study again")
                continue
            yield from _outcomes(decode(data))

    # -- writing ---------------------------------------------------------------------------------

    def _write_manifest(self) -> None:
        manifest = {"format": FORMAT, "study": self.study, "versions": self.versions}
        write_whole(self.path / MANIFEST, json.dumps(manifest, indent=1).encode())

    def _write_list(self) -> None:
        lines = [_line(chunk) for chunk in self.chunks]
        if self.failures:
            lines.append({"failed": [list(f) for f in self.failures.values()]})
        text = "".join(json.dumps(line) + "\n" for line in lines)
        write_whole(self.path / LIST, text.encode())

    def _clean(self) -> None:
        """Drop damaged chunks with a warning, and files that the list does not name."""
        for chunk in self.damaged():
            warn_of_damage(self.path, chunk, f"its {chunk.samples} samples are computed again")
            self.chunks.remove(chunk)
        self._write_list()
        listed = {chunk.file for chunk in self.chunks}
        for file in (self.path / CHUNKS).iterdir():
            if f"{CHUNKS}/{file.name}" not in listed:
                file.unlink()

    def add(self, outcomes: Sequence[Outcome], variables: Mapping[str, Variable]) -> None:
        """Store outcomes, all their variables together.

        Raises
        ------
        StoreError
            If they cannot be written; what was stored before stays readable.
        """
        groups: dict[Any, list[Outcome]] = {}
        for outcome in outcomes:
            if outcome.samples.size:
                shapes = tuple((name, v.shape[1:]) for name, v in outcome.values.items())
                groups.setdefault(shapes, []).append(outcome)
        failed = [list(f) for outcome in outcomes for f in outcome.failures]
        entries: list[dict[str, Any]] = [{"failed": failed}] if failed else []
        for group in groups.values():
            data = encode(*_table(group, variables), {"format": FORMAT})
            file = f"{CHUNKS}/{self._next:06d}.nc"
            self._next += 1
            write_whole(self.path / file, data)
            spans = tuple(span for outcome in group for span in _outcome_spans(outcome))
            seconds = round(sum(outcome.seconds for outcome in group), 3)
            entries.append(_line(Chunk(file, digest(data), len(data), seconds, spans)))
        self._append(entries)

    def _append(self, entries: Sequence[Mapping[str, Any]]) -> None:
        if not entries:
            return
        path = self.path / LIST
        try:
            with open(path, "ab") as file:
                before = file.tell()
                try:
                    file.write("".join(json.dumps(entry) + "\n" for entry in entries).encode())
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


@contextmanager
def writing(path: Path, study: dict[str, Any], version: str) -> Iterator[Store]:
    """Open a folder for writing, a new one or one that holds the same study.

    Raises
    ------
    StoreError
        If another run is writing to it, the folder cannot be written, holds other files, or holds
        another study (the differences are named).
    """
    prepare_folder(path)
    with Lock(path / LOCK):
        if not (path / MANIFEST).exists():
            manifest = {"format": FORMAT, "study": study, "versions": [version]}
            write_whole(path / MANIFEST, json.dumps(manifest, indent=1).encode())
        store = Store(path)
        refuse_another(path, study, store.study)
        if version not in store.versions:
            warnings.warn(
                f"{path}: was begun with version {store.versions[-1]}, this is {version}: samples"
                " of both may differ in their last digits",
                stacklevel=3,
            )
            store.versions.append(version)
        store.study = study
        store._write_manifest()
        try:
            (path / CHUNKS).mkdir(exist_ok=True)
        except OSError as error:
            raise cannot_write(path / CHUNKS, error) from error
        store._clean()
        yield store


def prepare_folder(path: Path) -> None:
    """Make the folder, or refuse it before any work is done."""
    if path.exists() and not path.is_dir():
        raise StoreError(f"{path}: is a file; a run needs a folder")
    if not path.absolute().parent.is_dir():
        raise StoreError(f"{path}: the folder {path.absolute().parent} does not exist")
    try:
        path.mkdir(exist_ok=True)
        others = {entry.name for entry in path.iterdir()} - {LOCK, f"{MANIFEST}.part"}
    except OSError as error:
        raise cannot_write(path, error) from error
    if others and MANIFEST not in others:
        some = ", ".join(sorted(others)[:3])
        raise StoreError(f"{path}: holds other files ({some}); choose a new folder")


def empty(path: Path) -> None:
    """Empty the folder of a run but for its lock.

    The list goes first and the manifest last: at any moment in between it is a run without chunks.
    """
    (path / LIST).unlink()
    shutil.rmtree(path / CHUNKS)
    (path / MANIFEST).unlink()


def warn_of_damage(path: Path, chunk: Chunk, consequence: str) -> None:
    """Warn of a chunk that is gone, truncated or corrupted."""
    warnings.warn(
        f"{path / chunk.file}: is gone or fails its checksum; {consequence}", stacklevel=3
    )


def _line(chunk: Chunk) -> dict[str, Any]:
    return {
        "file": chunk.file,
        "sha256": chunk.sha256,
        "bytes": chunk.bytes,
        "seconds": chunk.seconds,
        "done": [list(span) for span in chunk.done],
    }


def _spans(point: int, wanted: NDArray[np.bool_], first: int) -> list[Span]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], wanted, [False])).astype(np.int8)))
    return [
        Span(point, first + int(start), int(stop - start))
        for start, stop in zip(edges[::2], edges[1::2], strict=True)
    ]


def _outcome_spans(outcome: Outcome) -> list[Span]:
    numbers = outcome.samples
    cuts = np.flatnonzero(np.diff(numbers) != 1) + 1
    parts = np.split(numbers, cuts)
    return [Span(outcome.point, int(part[0]), part.size) for part in parts]


def _table(
    outcomes: Sequence[Outcome], variables: Mapping[str, Variable]
) -> tuple[dict[str, NDArray[Any]], dict[str, Variable]]:
    """Outcomes of one shape, one below the other, and what the columns mean."""
    samples = [outcome.samples for outcome in outcomes]
    wide = [outcome.wide_samples for outcome in outcomes]
    points = [outcome.point for outcome in outcomes]
    values: dict[str, NDArray[Any]] = {
        "point": np.repeat(points, [part.size for part in samples]).astype(np.int64),
        "sample": np.concatenate(samples),
        "wide_point": np.repeat(points, [part.size for part in wide]).astype(np.int64),
        "wide_sample": np.concatenate(wide),
    }
    names = dict(_ROW)
    for name in outcomes[0].values:
        variable = variables[name]
        row = "wide_row" if len(variable.dims) > 1 else "row"
        names[name] = replace(variable, dims=(row, *variable.dims[1:]))
        values[name] = np.concatenate([outcome.values[name] for outcome in outcomes])
    return values, names


def _outcomes(table: dict[str, NDArray[Any]]) -> Iterator[Outcome]:
    """The reverse of `_table`, one outcome a point."""
    keys = {name: table.pop(name) for name in _ROW}
    rows, wide_rows = keys["sample"].size, keys["wide_sample"].size
    for point in np.unique(keys["point"]):
        narrow, wide = keys["point"] == point, keys["wide_point"] == point
        values = {}
        for name, value in table.items():
            mask = narrow if value.ndim == 1 else wide
            assert value.shape[0] == (rows if value.ndim == 1 else wide_rows)
            values[name] = value if mask.all() else value[mask]
        yield Outcome(int(point), keys["sample"][narrow], keys["wide_sample"][wide], values)

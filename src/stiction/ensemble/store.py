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
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from stiction.ensemble.chunk import (
    Chunk,
    DamagedChunk,
    Table,
    mark_of,
    missing_spans,
    stored_samples,
)
from stiction.ensemble.files import HeldError, Lock, digest, read_whole
from stiction.ensemble.manifest import read_manifest
from stiction.ensemble.part import Part
from stiction.ensemble.scheduler import Span
from stiction.ensemble.work import Failure
from stiction.errors import StoreError

LIST, CHUNKS, LOCK = "chunks.jsonl", "chunks", "lock"
OWN = re.compile(r"(\d{6,})-[0-9a-f]{8}\.nc")


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
        self._read = ""
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
                self._note(opened(line))
            except (ValueError, KeyError, TypeError):
                if number < len(lines):  # what follows the last line end was cut short
                    self.damage.append(f"line {number} of {LIST} fails its checksum")
        return True

    def _note(self, entry: Mapping[str, Any]) -> None:
        if "file" in entry:
            chunk = Chunk.from_entry(entry)
            folder, _, name = chunk.file.partition("/")
            if folder != CHUNKS or OWN.fullmatch(name) is None:
                raise ValueError(f"{chunk.file}: is no name of a chunk")
            self.chunks.append(chunk)
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
        self,
        points: int,
        samples: int,
        first: int = 0,
        *,
        retry: bool = False,
        part: Part | None = None,
    ) -> list[Span]:
        """What is to be computed, of a part or of all; failed samples only to be retried."""
        found = self.done(points, samples, first)
        if part is not None:
            found |= ~part.mask(points, samples)
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

    def unlisted(self) -> list[str]:
        """What is wrong with chunks that no list names although they hold what is missing.

        A run lists a chunk when it is whole; so none are looked for while one is writing.
        """
        names = self._unlisted_names()
        if not names or is_active(self.path):
            return []
        if self._read_list():  # a run has ended meanwhile
            names = self._unlisted_names()
        found = []
        for name in names:
            file = f"{CHUNKS}/{name}"
            data = read_whole(self.path / file)
            if data is None:
                continue
            try:
                table = Table.decode(data)
            except DamagedChunk as error:
                found.append(f"{file} {error} and is not in {LIST}")
                continue
            if table.study == self._mark and not table.as_chunk(file, data).is_within(self.chunks):
                found.append(f"{file} is not in {LIST}, which was cut or lost")
        return found

    def _unlisted_names(self) -> list[str]:
        listed = {chunk.file for chunk in self.chunks}
        try:
            names = sorted(os.listdir(self.path / CHUNKS))
        except OSError:  # said where a chunk is read
            return []
        return [name for name in names if OWN.fullmatch(name) and f"{CHUNKS}/{name}" not in listed]

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
        for text in self.unlisted():
            self._warn(f"{text}; running the study again mends this")

    def _warn(self, text: str) -> None:
        warnings.warn(f"{self.path}: {text}", stacklevel=3)


def is_active(folder: Path) -> bool:
    """Whether a process is writing to a run now."""
    if not os.access(folder / LOCK, os.W_OK):
        return False
    try:
        with Lock(folder / LOCK, announce=False):
            return False
    except HeldError:
        return True
    except StoreError:  # no locks here: nobody knows
        return False


def warn_of_damage(path: Path, chunk: Chunk, error: Exception, consequence: str) -> None:
    """Warn of a chunk that is gone, truncated or corrupted."""
    warnings.warn(f"{path / chunk.file}: {error}; {consequence}", stacklevel=4)


def sealed(entry: Mapping[str, Any]) -> bytes:
    """A line of the list: a digest, and the entry as JSON."""
    text = json.dumps(entry).encode()
    return digest(text)[:16].encode() + b" " + text + b"\n"


def opened(line: bytes) -> dict[str, Any]:
    if not line:
        return {}
    mark, _, text = line.partition(b" ")
    if digest(text)[:16].encode() != mark:
        raise ValueError("fails its checksum")
    entry: dict[str, Any] = json.loads(text)
    return entry

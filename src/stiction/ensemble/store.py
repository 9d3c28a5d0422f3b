"""The store: a folder of self-describing chunks.

``study.json`` identifies the study, and ``chunks/`` holds the samples. A chunk is a table
of samples with a mark of their study; its name is a digest of its content. Chunks are
written whole or not at all, and nothing lists them: so any number of processes may write to
a folder at once, a run may be killed at any moment, and damage is found. Each writer joins
its own small chunks as they become many.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stiction.ensemble.batches import versions
from stiction.ensemble.table import Failure, Table, joined
from stiction.errors import StoreError, warn_user
from stiction.files import PART, UNREADABLE, cannot, write_whole
from stiction.model import describe

FORMAT = 5
STUDY, PILOT, CHUNKS = "study.json", "pilot.json", "chunks"
NAME = re.compile(r"[0-9a-f]{32}\.npz")
SAVE_SECONDS = 1.0
SAVE_BYTES = 32 * 2**20
MANY = 64
"""Small chunks that are joined to one."""
LARGE = 16 * 2**20
"""Bytes of a chunk that is not joined any more."""


class Damaged(ValueError):
    """A stored file is damaged; the message gives the defect."""


class Chunk(NamedTuple):
    """One file of samples: its size, its table, and what computed it for which study."""

    bytes: int
    table: Table
    versions: str
    study: str


class Store:
    """What is stored in a folder.

    Parameters
    ----------
    path : Path
        Folder of a run.
    study : dict
        The study whose samples it holds, in plain form.

    Attributes
    ----------
    damage : dict of str
        What is wrong with which chunk, by its name, as far as they were read.
    """

    def __init__(self, path: Path, study: dict[str, Any]) -> None:
        self.path, self.study = path, study
        self._mark = digest(json.dumps(_identity(study), sort_keys=True).encode())
        self.damage: dict[str, str] = {}
        self._taken: list[Table] = []
        self._saved = time.monotonic()
        self._small: dict[str, Table] = {}

    @classmethod
    def open(cls, path: Path, study: dict[str, Any]) -> Store:
        """Open a folder for writing: a new one, or one that holds the same study.

        Raises
        ------
        StoreError
            If the folder cannot be written, holds other files, or holds another study (the
            differences are named).
        """
        if path.exists() and not path.is_dir():
            raise StoreError(f"{path}: is a file; a run needs a folder")
        try:
            path.mkdir(parents=True, exist_ok=True)
            others = {name for name in os.listdir(path) if not name.endswith(PART)}
            if others and not others & {STUDY, CHUNKS}:
                some = ", ".join(sorted(others)[:3])
                raise StoreError(f"{path}: holds other files ({some}); choose a new folder")
            (path / CHUNKS).mkdir(exist_ok=True)
        except OSError as error:
            raise cannot("written", path, error) from error
        store, before = cls(path, study), None
        try:
            before = read_json(path / STUDY)
            refuse_another(path, study, before)
        except (FileNotFoundError, Damaged):
            if list(store.chunks()) or STUDY in others:
                store._warn(
                    f"{STUDY} is damaged or missing; it is rebuilt from the given study"
                )
        if before != study:
            _write_json(path / STUDY, study)
        return store

    # -- reading -------------------------------------------------------------------------------

    def chunks(self) -> Iterator[Chunk]:
        """Yield the chunks that are what was written; what is wrong with others is in `damage`.

        Chunks that another process joins meanwhile are read in their new form; a sample may then
        occur twice, with the same numbers.

        Raises
        ------
        StoreError
            If something is there and cannot be read, so that damage cannot be ruled out.
        """
        self.damage = {}
        seen: set[str] = set()
        while new := sorted(self._names() - seen):
            seen.update(new)
            for name in new:
                try:
                    chunk = read_chunk(self.path / CHUNKS / name)
                except FileNotFoundError:  # joined meanwhile
                    continue
                except Damaged as error:
                    self.damage[name] = str(error)
                    continue
                if chunk.study != self._mark:
                    raise StoreError(f"{self.path}: {CHUNKS}/{name} belongs to another study")
                yield chunk

    def _names(self) -> set[str]:
        try:
            return set(filter(NAME.fullmatch, os.listdir(self.path / CHUNKS)))
        except FileNotFoundError:
            return set()
        except OSError as error:
            raise cannot("read", self.path / CHUNKS, error) from error

    def load(self, take: Callable[[list[Table]], None]) -> None:
        """Hand on all tables; delete damaged chunks, and warn of them and of other versions."""
        found = set()
        for chunk in self.chunks():
            take([chunk.table])
            found.add(chunk.versions)
        for other in sorted(found - {versions()}):
            self._warn(
                f"was begun with {other}, not {versions()}: samples of the two may differ"
                " in their last digits"
            )
        for name, text in self.damage.items():
            self._warn(f"{CHUNKS}/{name}: {text}; its samples are computed again")
            (self.path / CHUNKS / name).unlink(missing_ok=True)

    def _warn(self, text: str) -> None:
        warn_user(f"{self.path}: {text}", UserWarning)

    @property
    def pilot(self) -> dict[str, Any] | None:
        """What the pilot has found; None if there was none."""
        with suppress(FileNotFoundError, Damaged):
            return read_json(self.path / PILOT)
        return None

    # -- writing -------------------------------------------------------------------------------

    def add(self, tables: list[Table]) -> None:
        """Take tables, and store what was taken if a second has passed or it is large.

        Raises
        ------
        StoreError
            If it cannot be written; what was stored before stays readable.
        """
        self._taken += tables
        late = time.monotonic() - self._saved >= SAVE_SECONDS
        if late or sum(table.rows.nbytes for table in self._taken) >= SAVE_BYTES:
            self._save()
            size = sum(table.rows.nbytes for table in self._small.values())
            if len(self._small) >= MANY or size >= LARGE:
                self._join()

    def close(self) -> None:
        """Store what was taken, and join the small chunks of this writer."""
        self._save()
        self._join()

    def _save(self) -> None:
        self._write(self._taken)
        self._taken, self._saved = [], time.monotonic()

    def _write(self, tables: Iterable[Table]) -> None:
        for table in joined(tables):
            data = encode(table, self._mark)
            name = f"{digest(data)}.npz"
            write_whole(self.path / CHUNKS / name, data)
            if len(data) < LARGE:
                self._small[name] = table

    def _join(self) -> None:
        """Replace small chunks by larger ones; they go when the larger ones are whole."""
        if len(self._small) < 2:
            return
        small, self._small = self._small, {}
        try:
            self._write(small.values())
        except StoreError:  # the disk is full: the small ones stay, and nothing is lost
            return
        # A table whose columns no other has comes back under the name that it had.
        for name in small.keys() - self._small.keys():
            with suppress(OSError):
                (self.path / CHUNKS / name).unlink()

    def note_pilot(self, attributes: Mapping[str, Any]) -> None:
        """Store what the pilot has found."""
        _write_json(self.path / PILOT, attributes)


# -- files ---------------------------------------------------------------------------------------


def digest(data: bytes) -> str:
    """Return the first half of the SHA-256, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()[:32]


def encode(table: Table, study: str) -> bytes:
    """Return a table as the bytes of an .npz archive, with a few words about it as JSON."""
    about = [study, versions(), table.seconds, table.failures]
    text = np.frombuffer(json.dumps(about).encode(), dtype=np.uint8)
    file = io.BytesIO()
    np.savez(file, about=text, rows=table.rows)
    return file.getvalue()


def read_chunk(file: Path) -> Chunk:
    """Return a chunk, or raise `Damaged` or an error of `_read`."""
    data = _read(file)
    if file.stem != digest(data):
        raise Damaged("fails its checksum")
    try:
        with np.load(io.BytesIO(data), max_header_size=len(data)) as archive:
            study, made_by, seconds, failures = json.loads(archive["about"].tobytes())
            table = Table(archive["rows"], tuple(Failure(*one) for one in failures), seconds)
    except (*UNREADABLE, AttributeError, TypeError) as error:
        # Made by a program that names its files likewise.
        raise Damaged(f"cannot be read: {error}") from None
    return Chunk(len(data), table, made_by, study)


def _write_json(file: Path, content: Mapping[str, Any]) -> None:
    """Write JSON with the format and a digest, whole or not at all."""
    body = {"format": FORMAT, "content": content}
    sealed = body | {"digest": digest(json.dumps(body, sort_keys=True).encode())}
    write_whole(file, json.dumps(sealed, indent=1).encode())


def read_json(file: Path) -> dict[str, Any]:
    """Return what `_write_json` wrote, or raise `Damaged` or an error of `_read`."""
    try:
        body = json.loads(_read(file))
        if body.pop("digest") != digest(json.dumps(body, sort_keys=True).encode()):
            raise ValueError
        if body["format"] == FORMAT:
            return dict(body["content"])
    except (ValueError, KeyError, TypeError, AttributeError):
        raise Damaged(f"{file}: is damaged") from None
    raise StoreError(f"{file}: is of format {body['format']!r}; this version reads {FORMAT}")


def _read(file: Path) -> bytes:
    """Return what a file holds; what is there and cannot be read may be whole: a StoreError."""
    try:
        return file.read_bytes()
    except FileNotFoundError:
        raise
    except OSError as error:
        raise cannot("read", file, error) from error


# -- which study it is ---------------------------------------------------------------------------


def _identity(study: Mapping[str, Any]) -> dict[str, Any]:
    """What makes two studies the same run: all but the title and the number of samples."""
    ensemble = {key: value for key, value in study["ensemble"].items() if key != "samples"}
    return {key: value for key, value in study.items() if key != "title"} | {
        "ensemble": ensemble
    }


def refuse_another(path: Path, here: Mapping[str, Any], there: Mapping[str, Any]) -> None:
    """Refuse a study that differs from the stored one in more than a growing number of samples."""
    ours, theirs = flat(_identity(here)), flat(_identity(there))
    found = [
        f"{key}: {_shown(ours.get(key))} here, {_shown(theirs.get(key))} there"
        for key in dict.fromkeys([*ours, *theirs])
        if ours.get(key) != theirs.get(key)
    ]
    now, before = here["ensemble"]["samples"], there["ensemble"]["samples"]
    if now < before and not found:
        found = [f"ensemble.samples: {now} here, {before} there: a run can grow, not shrink"]
    if found:
        raise StoreError(
            f"{path}: holds another study; choose another place, or make the study the same:\n"
            + "\n".join(f"  {text}" for text in found[:20])
        )


def flat(content: Any, path: str = "") -> dict[str, Any]:
    """Return the numbers and texts in plain tables and lists by their paths."""
    if isinstance(content, list):
        content = dict(enumerate(content))
    if not isinstance(content, Mapping) or not content:
        return {path: content}
    found: dict[str, Any] = {}
    for key, value in content.items():
        found |= flat(value, f"{path}.{key}" if path else str(key))
    return found


def _shown(value: Any) -> str:
    return "nothing" if value is None else describe(value)

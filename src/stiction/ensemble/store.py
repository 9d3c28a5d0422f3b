"""The store: a folder of chunks that say what they hold.

``study.json`` says which study it is, and ``chunks/`` holds the samples. A chunk is a table (see
`stiction.ensemble.table`) of samples with a mark of their study; its name is a digest of its
content. Chunks are written whole or not at all, and nothing lists them: so any number of processes
may write to a folder at once, a run may be killed at any moment, and damage is found. Each writer
joins its own small chunks as they become many.
"""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from stiction.ensemble.batches import versions
from stiction.ensemble.table import Table, decode, digest, encode, joined
from stiction.errors import StoreError, warn_user
from stiction.files import PART, cannot, write_whole

FORMAT = 4
STUDY, PILOT, CHUNKS = "study.json", "pilot.json", "chunks"
NAME = re.compile(r"[0-9a-f]{32}\.npz")
SAVE_SECONDS = 1.0
SAVE_BYTES = 32 * 2**20
MANY = 64
"""Small chunks that are joined to one."""
LARGE = 16 * 2**20
"""Bytes of a chunk that is not joined any more."""


class Damaged(ValueError):
    """A file is not what was written; the message says what is wrong with it."""


class Chunk(NamedTuple):
    """One file of samples; `versions` are those of the process that computed it."""

    bytes: int
    versions: str
    table: Table


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
        self.path, self.study, self._mark = path, study, mark_of(study)
        self.damage: dict[str, str] = {}
        self._buffer: list[Table] = []
        self._saved = time.monotonic()
        self._small: list[str] = []

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
        store = cls(path, study)
        before: dict[str, Any] = {}
        try:
            before = read_study(path)
        except (FileNotFoundError, Damaged):
            if sum(1 for _ in store.chunks()) or STUDY in others:
                store._warn(
                    f"{STUDY} is damaged or gone; it is made of the study that is given"
                )
        if before:
            refuse_another(path, study, before)
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
            If something is there and cannot be read: nobody knows then whether it is damaged.
        """
        self.damage = {}
        seen: set[str] = set()
        while new := sorted(self._names() - seen):
            seen.update(new)
            for name in new:
                try:
                    chunk, mark = read_chunk(self.path / CHUNKS / name)
                except FileNotFoundError:  # joined meanwhile
                    continue
                except Damaged as error:
                    self.damage[name] = str(error)
                    continue
                if mark != self._mark:
                    raise StoreError(f"{self.path}: {CHUNKS}/{name} belongs to another study")
                yield chunk

    def _names(self) -> set[str]:
        try:
            names = os.listdir(self.path / CHUNKS)
        except FileNotFoundError:
            return set()
        except OSError as error:
            raise cannot("read", self.path / CHUNKS, error) from error
        return {name for name in names if NAME.fullmatch(name)}

    def load(self, take: Callable[[list[Table]], None]) -> None:
        """Hand on all tables; delete damaged chunks, and warn of them and of other versions."""
        found = set()
        for chunk in self.chunks():
            take([chunk.table])
            found.add(chunk.versions)
        for other in sorted(found - {versions()}):
            self._warn(
                f"was begun with {other}, this is {versions()}: samples of both may differ in"
                " their last digits"
            )
        for name, text in self.damage.items():
            self._warn(f"{CHUNKS}/{name}: {text}; its samples are computed again")
            (self.path / CHUNKS / name).unlink(missing_ok=True)

    def _warn(self, text: str) -> None:
        warn_user(f"{self.path}: {text}", UserWarning)

    # -- writing -------------------------------------------------------------------------------

    def add(self, tables: Sequence[Table]) -> None:
        """Take tables, and store what was taken if a second has passed or it is large.

        Raises
        ------
        StoreError
            If it cannot be written; what was stored before stays readable.
        """
        self._buffer += tables
        late = time.monotonic() - self._saved >= SAVE_SECONDS
        if late or sum(table.nbytes for table in self._buffer) >= SAVE_BYTES:
            self._save()

    def close(self) -> None:
        """Store what was taken, and join the small chunks of this writer."""
        self._save()
        self._join()

    def _save(self) -> None:
        tables, self._buffer = joined(self._buffer), []
        for table in tables:
            self._write(table)
        self._saved = time.monotonic()
        if len(self._small) >= MANY:
            self._join()

    def _write(self, table: Table) -> str:
        """Write a chunk, and return its name."""
        data = encode(table, {"study": self._mark, "versions": versions()})
        name = f"{digest(data)[:32]}.npz"
        write_whole(self.path / CHUNKS / name, data)
        if len(data) < LARGE:
            self._small.append(name)
        return name

    def _join(self) -> None:
        """Replace small chunks by larger ones; they go when the larger ones are whole."""
        names, self._small = self._small, []
        while names:
            group: dict[str, Chunk] = {}
            while names and sum(chunk.bytes for chunk in group.values()) < LARGE:
                name = names.pop()
                with suppress(
                    FileNotFoundError, Damaged
                ):  # damage is reported where it is read
                    group[name] = read_chunk(self.path / CHUNKS / name)[0]
            if len(group) < 2:
                self._small += group
                continue
            try:
                tables = joined(chunk.table for chunk in group.values())
                written = {self._write(table) for table in tables}
            except StoreError:  # the disk is full: the small ones stay, and nothing is lost
                return
            # Tables of other variables than all others come back under the name that they had.
            for name in group.keys() - written:
                with suppress(OSError):
                    (self.path / CHUNKS / name).unlink()

    def note_pilot(self, attributes: Mapping[str, Any]) -> None:
        """Store what the pilot has found."""
        _write_json(self.path / PILOT, dict(attributes))

    def pilot(self) -> dict[str, Any] | None:
        """Return what the pilot has found; None if there was none."""
        try:
            return _read_json(self.path / PILOT)
        except (FileNotFoundError, Damaged):
            return None


def read_chunk(file: Path) -> tuple[Chunk, str]:
    """Return a chunk and the mark of its study, or raise `Damaged` or an error of `_read`."""
    data = _read(file)
    if not file.name.startswith(digest(data)[:32]):
        raise Damaged("fails its checksum")
    try:
        table, about = decode(data)
    except ValueError as error:  # made by a program that names its files likewise
        raise Damaged(str(error)) from None
    return Chunk(len(data), str(about.get("versions")), table), str(about.get("study"))


# -- which study it is ---------------------------------------------------------------------------


def mark_of(study: Mapping[str, Any]) -> str:
    """Return what all chunks of the same study share."""
    return digest(json.dumps(_identity(study), sort_keys=True).encode())[:32]


def _identity(study: Mapping[str, Any]) -> dict[str, Any]:
    """What makes two studies the same run: all but the title and the number of samples."""
    ensemble = {key: value for key, value in study["ensemble"].items() if key != "samples"}
    kept = {key: value for key, value in study.items() if key != "title"}
    return kept | {"ensemble": ensemble}


def read_study(path: Path) -> dict[str, Any]:
    """Return the study of a run in plain form, or raise `Damaged` or an error of `_read`."""
    return _read_json(path / STUDY)


def _write_json(file: Path, content: Mapping[str, Any]) -> None:
    """Write JSON with the format and a digest, whole or not at all."""
    body = {"format": FORMAT, "content": content}
    sealed = body | {"sha256": digest(json.dumps(body, sort_keys=True).encode())}
    write_whole(file, json.dumps(sealed, indent=1).encode())


def _read_json(file: Path) -> dict[str, Any]:
    try:
        body = json.loads(_read(file))
        said = body.pop("sha256")
        if said != digest(json.dumps(body, sort_keys=True).encode()):
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


def refuse_another(path: Path, here: Mapping[str, Any], there: Mapping[str, Any]) -> None:
    """Refuse a study that differs from the stored one in more than a growing number of samples."""
    found = differences(_identity(here), _identity(there))
    now, before = here["ensemble"]["samples"], there["ensemble"]["samples"]
    if now < before and not found:
        found = [f"ensemble.samples: {now} here, {before} there: a run can grow, not shrink"]
    if found:
        raise StoreError(
            f"{path}: holds another study; choose another place, or make the study the same:\n"
            + "\n".join(f"  {text}" for text in found[:20])
        )


def differences(here: Any, there: Any, path: str = "") -> list[str]:
    """Return where two plain structures differ, one text each, with the path to the key."""
    if isinstance(here, list) and isinstance(there, list):
        here, there = dict(enumerate(here)), dict(enumerate(there))
    if isinstance(here, Mapping) and isinstance(there, Mapping):
        found = []
        for key in dict.fromkeys([*here, *there]):
            inner = f"{path}.{key}" if path else str(key)
            found += differences(here.get(key), there.get(key), inner)
        return found
    if here == there:
        return []
    texts = ["nothing" if value is None else json.dumps(value) for value in (here, there)]
    short = [text if len(text) <= 60 else f"{text[:57]}..." for text in texts]
    return [f"{path}: {short[0]} here, {short[1]} there"]

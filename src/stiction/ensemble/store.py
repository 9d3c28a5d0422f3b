"""The store: a folder of self-describing chunks.

Problem. Many processes write samples to a folder, and any process may
be killed at any moment. A written sample must not be lost, and damage
must be detected.

Solution. ``study.json`` identifies the study, and ``chunks/`` holds the
samples. A chunk is a table of samples with a mark that identifies its
study. A digest of its content names a chunk. A chunk is written
completely or not at all. Chunks never change, and no file lists them.

Limits. A digest reveals damage, but not forgery, because anyone who can
write to the folder can write other numbers with a new digest. A folder
may come from a stranger. If a file is a link, a pipe, a device or a
folder, an `InputError` is raised. Content that does not fit
the study counts as damage, even if the digest fits.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import re
import stat
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.base.errors import InputError, StoreError, warn_user
from stiction.base.files import (
    MAX_FILE_BYTES,
    PART,
    UNREADABLE,
    arrays_in,
    cannot,
    read_regular,
    write_whole,
)
from stiction.base.model import describe
from stiction.ensemble.batches import NUMBER, POINT, Failure, Table, versions
from stiction.ensemble.pilot import MAX_RANKED_SAMPLES

FORMAT = 6
STUDY, PILOT_FILE, CHUNKS = "study.json", "pilot.json", "chunks"
NAME = re.compile(r"[0-9a-f]{32}\.npz")
SAVE_SECONDS = 10.0
"""Seconds of computing after which samples are stored as a chunk."""
SAVE_BYTES = 32 * 2**20
MAX_JSON_BYTES = 64 * 2**20
"""Largest size of the description of a study or of a pilot."""


class Damaged(StoreError):
    """Error for a stored file that is missing or damaged.

    The message describes the damage.
    """


class Store:
    """The folder of a run, with the samples of a study in plain form.

    After reading, `damage` holds the defects of damaged chunks by name.
    `seconds` (on one core) and `versions` describe the intact chunks.
    """

    def __init__(self, path: Path, study: Mapping[str, Any]) -> None:
        self.path = path
        self._mark = digest(json.dumps(_identity(study), sort_keys=True).encode())
        self.damage: dict[str, str] = {}
        self.seconds: list[float] = []
        self.versions: dict[str, None] = {}
        self._taken: list[Table] = []
        self._saved = time.monotonic()

    @classmethod
    def open(cls, path: Path, study: dict[str, Any]) -> Store:
        """Open a folder for writing. The folder is new or holds the same study."""
        try:
            path.mkdir(parents=True, exist_ok=True)
            names = {name for name in os.listdir(path) if not name.endswith(PART)}
            if names and not names & {STUDY, CHUNKS}:
                some = ", ".join(sorted(names)[:3])
                raise StoreError(f"{path}: contains other files ({some}). Choose a new folder")
            # Another process may create the folder at the same moment.
            with suppress(FileExistsError):
                (path / CHUNKS).mkdir()
            _check_folder(path / CHUNKS)
        except OSError as error:
            raise cannot("written as a folder", path, error) from error
        store, before = cls(path, study), None
        try:
            before = read_study(path)
            _refuse_another(path, study, before)
        except Damaged:
            if list(store._tables()) or STUDY in names:
                store.warn(f"{STUDY} is damaged or missing. It is rebuilt from the given study")
        # The same study with another title or more samples replaces the
        # description.
        if before != study:
            # A pilot of fewer samples is no longer valid.
            if before and before["samples"] < MAX_RANKED_SAMPLES:
                (path / PILOT_FILE).unlink(missing_ok=True)
            _write_json(path / STUDY, study)
        return store

    def read_into(self, rows: Any) -> None:
        """Add intact chunks to `rows`, and record the defects of damaged chunks in `damage`.

        `rows` accepts tables (`add`), and says why a table does not fit
        (`misfit`). A file that exists but cannot be read may be intact.
        Such a file raises a `StoreError`.
        """
        self.damage, self.seconds, self.versions = {}, [], {}
        for name, table in self._tables():
            if misfit := rows.misfit(table):
                self.damage[name] = f"does not fit the study: {misfit}"
                continue
            rows.add(table)
            self.seconds.append(table.seconds)
            self.versions[table.versions] = None

    def _tables(self) -> Iterator[tuple[str, Table]]:
        """Yield the intact chunks with their names."""
        folder = self.path / CHUNKS
        try:
            _check_folder(folder)
            names = sorted(filter(NAME.fullmatch, os.listdir(folder)))
        except OSError as error:
            raise cannot("read", folder, error) from error
        for name in names:
            try:
                data = _read(folder / name, MAX_FILE_BYTES)
            except Damaged:  # another process has deleted a damaged chunk
                continue
            # The name proves the content, so no list of chunks is needed.
            if name != f"{digest(data)}.npz":
                self.damage[name] = "fails its checksum"
                continue
            try:
                mark, table = _table_in(data)
            except (*UNREADABLE, TypeError, RecursionError, MemoryError):
                self.damage[name] = "is not a chunk, though its checksum is right"
                continue
            if mark != self._mark:
                raise StoreError(f"{folder / name}: belongs to another study")
            yield name, table

    def resume(self, rows: Any) -> None:
        """Pass on the stored samples, warn about different versions, and delete damaged chunks."""
        self.read_into(rows)
        for name, text in self.damage.items():
            # The samples are missing in `rows`,
            # so the run computes them again.
            self.warn(f"{CHUNKS}/{name}: {text}. Its samples are computed again")
            (self.path / CHUNKS / name).unlink(missing_ok=True)
        for version in sorted({*self.versions} - {versions()}):
            self.warn(f"was begun with {version}, not {versions()}. Last digits may differ")

    def warn(self, text: str) -> None:
        """Issue a warning about this run."""
        warn_user(f"{self.path}: {text}", UserWarning)

    @property
    def pilot(self) -> dict[str, Any] | None:
        """Result of the pilot, or None."""
        with suppress(Damaged):
            return read_json(self.path / PILOT_FILE)
        return None

    def note_pilot(self, attributes: Mapping[str, Any]) -> None:
        """Store the result of the pilot."""
        _write_json(self.path / PILOT_FILE, attributes)

    def add(self, table: Table) -> None:
        """Collect a table. Store the collected tables if they are large or it is time."""
        self._taken.append(table)
        # Few large chunks are read faster, but a kill may lose the last
        # seconds of work.
        size = sum(v.nbytes for table in self._taken for v in table.columns.values())
        if time.monotonic() - self._saved >= SAVE_SECONDS or size >= SAVE_BYTES:
            self.save()

    def save(self) -> None:
        """Store the collected tables, as a chunk for each set of variables."""
        _check_folder(self.path / CHUNKS)
        groups: dict[Any, list[tuple[NDArray[Any], Table]]] = {}
        for table in self._taken:  # an array of rows has one type
            rows = _rows(table.columns)
            groups.setdefault(rows.dtype, []).append((rows, table))
        for group in groups.values():
            seconds = round(sum(table.seconds for _, table in group), 3)
            failures = [failure for _, table in group for failure in table.failures]
            about = json.dumps([self._mark, group[0][1].versions, seconds, failures]).encode()
            rows, file = np.concatenate([rows for rows, _ in group]), io.BytesIO()
            np.savez(file, about=np.frombuffer(about, dtype=np.uint8), rows=rows)
            data = file.getvalue()
            write_whole(self.path / CHUNKS / f"{digest(data)}.npz", data)
        self._taken, self._saved = [], time.monotonic()


def digest(data: bytes) -> str:
    """Return the first half of the SHA-256 digest in hexadecimal."""
    return hashlib.sha256(data).hexdigest()[:32]


def _check_folder(folder: Path) -> None:
    """Reject a link as the chunk folder, because files would be written to its target."""
    if not stat.S_ISDIR(os.lstat(folder).st_mode):
        raise InputError(f"{folder}: is not a folder. Remove it, or choose another run")


def _rows(columns: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
    """Return columns as rows, which are stored."""
    types = [(name, values.dtype, values.shape[1:]) for name, values in columns.items()]
    rows = np.empty(len(columns[POINT]), dtype=types)
    for name, values in columns.items():
        rows[name] = values
    return rows


def _table_in(data: bytes) -> tuple[str, Table]:
    """Return the mark and the table of a chunk.

    Raise one of several errors for other content.
    """
    arrays = arrays_in(data)
    mark, made_by, seconds, failed = json.loads(arrays["about"].tobytes())
    failures = tuple(Failure(*one) for one in failed)
    texts = [mark, made_by, *(failure.error for failure in failures)]
    numbers = [number for failure in failures for number in failure[:3]]
    rows, long = arrays["rows"], np.dtype(np.int64)
    fields: Any = rows.dtype.fields or {}
    # Types are checked before any value is used, because the folder may
    # be a stranger's.
    valid = (
        all(isinstance(text, str) for text in texts)
        and all(isinstance(number, int) for number in numbers)
        and isinstance(seconds, int | float) and 0.0 <= seconds < math.inf
        and rows.ndim == 1 and all(fields[name][0] == long for name in (POINT, NUMBER))
        and all(field[0].base.kind in "fiub" for field in fields.values())
    )  # fmt: skip
    if not valid:
        raise ValueError("values that no chunk can have")
    columns = {name: rows[name] for name in fields}
    return mark, Table(columns, failures, seconds, made_by)


def _read(file: Path, max_bytes: int) -> bytes:
    """Return the content of a file.

    A file that exists but cannot be read may be intact.
    """
    try:
        return read_regular(file, max_bytes=max_bytes, follow_links=False)
    except InputError as error:
        raise InputError(f"{file}: {error}. Remove this file, or choose another run") from None
    except FileNotFoundError:
        advice = "there is no run here. Give the folder of `stiction run --out`"
        if file.name == STUDY and (file.parent / CHUNKS).is_dir():
            advice = f"{STUDY} is missing. Run the study again into the folder to restore it"
        raise Damaged(f"{file.parent}: {advice}") from None
    except OSError as error:
        raise cannot("read", file, error) from error


def _write_json(file: Path, content: Mapping[str, Any]) -> None:
    """Write JSON with its format and a digest, completely or not at all."""
    # Sorted keys give the same digest on every machine.
    body = {"format": FORMAT, "content": content}
    sealed = body | {"digest": digest(json.dumps(body, sort_keys=True).encode())}
    write_whole(file, json.dumps(sealed, indent=1).encode())


def read_json(file: Path) -> dict[str, Any]:
    """Return the content that `_write_json` wrote, or raise a `StoreError`."""
    try:
        body = json.loads(_read(file, MAX_JSON_BYTES))
        if body.pop("digest") != digest(json.dumps(body, sort_keys=True).encode()):
            raise ValueError
        if body["format"] == FORMAT:
            return dict(body["content"])
    except InputError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise Damaged(f"{file}: is damaged. Run the study again into the folder") from None
    raise StoreError(
        f"{file}: is of format {describe(body['format'])}, but this version reads {FORMAT}."
        " Install the version of stiction that wrote it"
    )


def read_study(folder: Path) -> dict[str, Any]:
    """Return the study of a run, or raise a `StoreError`."""
    study = read_json(folder / STUDY)
    if not isinstance(study.get("samples"), int):
        raise Damaged(f"{folder / STUDY}: is damaged. Run the study again to repair it")
    return study


def _identity(study: Mapping[str, Any]) -> dict[str, Any]:
    """Return a study without title and number of samples. The result identifies a run."""
    return {key: value for key, value in study.items() if key not in ("title", "samples")}


def _refuse_another(path: Path, here: Mapping[str, Any], there: Mapping[str, Any]) -> None:
    """Refuse a study that differs from the stored study, except by additional samples."""
    now, before = here["samples"], there["samples"]
    differences = _differences(_identity(here), _identity(there))
    if now < before:
        differences.append(f"samples: {now} given, {before} stored. A run can only grow")
    if differences:
        raise InputError(
            f"{path}: holds another study. Choose another folder, or make the study the same:\n"
            + "\n".join(f"  {text}" for text in differences[:20])
        )


def _differences(here: Any, there: Any, path: str = "") -> list[str]:
    """Return the differences between two studies, each with its key and both values."""
    if isinstance(here, list) and isinstance(there, list):
        here, there = dict(enumerate(here)), dict(enumerate(there))
    if isinstance(here, Mapping) and isinstance(there, Mapping):
        return [
            text
            for key in dict.fromkeys([*here, *there])
            for text in _differences(here.get(key), there.get(key), f"{path}.{key}".strip("."))
        ]
    shown = ["nothing" if one is None else describe(one) for one in (here, there)]
    return [f"{path}: {shown[0]} given, {shown[1]} stored"] if here != there else []

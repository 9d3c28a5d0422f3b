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

    Examples
    --------
    Two tables of one kind become one chunk. A damaged chunk is reported, and
    deleted before its samples are computed again.

    >>> import tempfile
    >>> from types import SimpleNamespace as Named
    >>> from stiction.base.errors import collect_warnings
    >>> folder, study = tempfile.TemporaryDirectory(), {"samples": 3, "title": "a", "seed": 9}
    >>> store = Store.open(Path(folder.name) / "run", study)
    >>> def table(number, **columns):
    ...     columns = {name: np.array([value]) for name, value in columns.items()}
    ...     columns |= {POINT: np.array([0], np.int64), NUMBER: np.array([number], np.int64)}
    ...     return Table(columns, (Failure(0, 7, 9, "no root"),), 0.25 * number, versions())
    >>> for one in (table(1, stress=2.0), table(2, stress=3.0), table(0, load=4.0)):
    ...     store.add(one)
    >>> store.save()
    >>> chunks = store.path / CHUNKS
    >>> (
    ...     len(list(chunks.iterdir())),
    ...     {NAME.fullmatch(path.name) is None for path in chunks.iterdir()},
    ... )
    (2, {False})
    >>> def stored(samples=3):
    ...     tables = []
    ...     fits = Named(
    ...         add=tables.append, misfit=lambda table: "load" in table.columns and "no load"
    ...     )
    ...     again = Store.open(store.path, study | {"samples": samples, "title": "b"})
    ...     with collect_warnings() as warned:
    ...         again.resume(fits)
    ...     return again, tables, [str(warning).partition("npz: ")[2] for warning in warned]
    >>> again, tables, warned = stored()
    >>> [table.columns["stress"].tolist() for table in tables]
    [[2.0, 3.0]]
    >>> [failure.name for failure in tables[0].failures]
    ['sample 7 (seed 9)', 'sample 7 (seed 9)']
    >>> again.seconds, [*again.versions] == [versions()]
    ([0.75], True)
    >>> list(again.damage.values()), len(list(chunks.iterdir()))
    (['does not fit the study: no load'], 1)
    >>> warned
    ['does not fit the study: no load. Its samples are computed again']
    >>> for name in (32 * "0", digest(b"abc")):
    ...     _ = (chunks / f"{name}.npz").write_bytes(b"abc")
    >>> for text in stored()[2]:
    ...     print(text)
    fails its checksum. Its samples are computed again
    is not a chunk, though its checksum is right. Its samples are computed again
    >>> read_study(store.path)["title"], again.pilot
    ('b', None)
    >>> again.note_pilot({"pilot_bias": 0.5})
    >>> again.pilot, stored(4)[0].pilot  # more samples need another pilot
    ({'pilot_bias': 0.5}, None)
    >>> folder.cleanup()
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
    """Return the first half of the SHA-256 digest in hexadecimal.

    The first half of a known digest.

    >>> digest(b"abc")
    'ba7816bf8f01cfea414140de5dae2223'
    """
    return hashlib.sha256(data).hexdigest()[:32]


def _check_folder(folder: Path) -> None:
    """Reject a link as the chunk folder, because files would be written to its target.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _check_folder(Path(folder))
    ...     _ = (Path(folder) / "file").write_bytes(b"")
    ...     try:
    ...         _check_folder(Path(folder) / "file")
    ...     except InputError as error:
    ...         print(str(error).rpartition("file: ")[2])
    is not a folder. Remove it, or choose another run
    """
    if not stat.S_ISDIR(os.lstat(folder).st_mode):
        raise InputError(f"{folder}: is not a folder. Remove it, or choose another run")


def _rows(columns: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
    """Return columns as rows, which are stored.

    >>> columns = {POINT: np.array([0, 1]), "slip": np.array([[2.0, 3.0], [4.0, 5.0]])}
    >>> rows = _rows(columns)
    >>> rows.dtype.names, rows[POINT].tolist(), rows["slip"].tolist()
    (('_point', 'slip'), [0, 1], [[2.0, 3.0], [4.0, 5.0]])
    """
    types = [(name, values.dtype, values.shape[1:]) for name, values in columns.items()]
    rows = np.empty(len(columns[POINT]), dtype=types)
    for name, values in columns.items():
        rows[name] = values
    return rows


def _table_in(data: bytes) -> tuple[str, Table]:
    """Return the mark and the table of a chunk.

    Raise one of several errors for other content.

    >>> def chunk(mark="m", made_by="v", seconds=0.5, failures=(), **columns):
    ...     columns = {
    ...         POINT: np.array([3], np.int64),
    ...         NUMBER: np.array([7], np.int64),
    ...     } | columns
    ...     about, file = json.dumps([mark, made_by, seconds, failures]).encode(), io.BytesIO()
    ...     np.savez(file, about=np.frombuffer(about, dtype=np.uint8), rows=_rows(columns))
    ...     return file.getvalue()
    >>> mark, table = _table_in(
    ...     chunk(failures=[(3, 8, 9, "no root", False)], stress=np.array([2.5]))
    ... )
    >>> mark, table.versions, table.seconds, table.failures[0].name
    ('m', 'v', 0.5, 'sample 8 of point 3 (seed 9)')
    >>> [(name, values.tolist()) for name, values in table.columns.items()]
    [('_point', [3]), ('_sample', [7]), ('stress', [2.5])]
    >>> strange = (
    ...     {"mark": 3},
    ...     {"made_by": None},
    ...     {"seconds": -0.5},
    ...     {"seconds": math.inf},
    ...     {"seconds": "1"},
    ...     {"failures": [(3, 8, 9, 5)]},
    ...     {"failures": [(3, 8.5, 9, "")]},
    ...     {"failures": [(3, 8, "9", "")]},
    ...     {POINT: np.array([3.0])},
    ...     {NUMBER: np.array([7.0])},
    ...     {"text": np.array(["a"])},
    ... )
    >>> for given in strange:
    ...     try:
    ...         print(_table_in(chunk(**given)))
    ...     except ValueError as error:
    ...         assert str(error) == "values that no chunk can have"
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
    """Return the content that `_write_json` wrote, or raise a `StoreError`.

    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> file = Path(folder.name) / STUDY
    >>> _write_json(file, {"b": 2.5, "a": [1, "x"]})
    >>> read_json(file), json.loads(file.read_text())["format"] == FORMAT
    ({'b': 2.5, 'a': [1, 'x']}, True)
    >>> def message():
    ...     try:
    ...         read_json(file)
    ...     except StoreError as error:
    ...         return str(error).rpartition("study.json")[2] or str(error)
    >>> text = file.read_text()
    >>> _ = file.write_text(text.replace("2.5", "2.6"))
    >>> message()
    ': is damaged. Run the study again into the folder'
    >>> body = {"format": FORMAT - 1, "content": {}}
    >>> sealed = body | {"digest": digest(json.dumps(body, sort_keys=True).encode())}
    >>> _ = file.write_text(json.dumps(sealed))
    >>> message().startswith(f": is of format {FORMAT - 1}, but this version reads {FORMAT}.")
    True
    >>> _ = file.write_text("[]")
    >>> message()
    ': is damaged. Run the study again into the folder'
    >>> file.unlink()
    >>> message().rpartition(": ")[2]
    'there is no run here. Give the folder of `stiction run --out`'
    >>> (file.parent / CHUNKS).mkdir()
    >>> message()
    ' is missing. Run the study again into the folder to restore it'
    >>> folder.cleanup()
    """
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
    """Return the study of a run, or raise a `StoreError`.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _write_json(Path(folder) / STUDY, {"samples": 3, "seed": 9})
    ...     print(read_study(Path(folder)))
    ...     _write_json(Path(folder) / STUDY, {"samples": "3"})
    ...     try:
    ...         read_study(Path(folder))
    ...     except Damaged as error:
    ...         print(str(error).rpartition(": ")[2])
    {'samples': 3, 'seed': 9}
    is damaged. Run the study again to repair it
    """
    study = read_json(folder / STUDY)
    if not isinstance(study.get("samples"), int):
        raise Damaged(f"{folder / STUDY}: is damaged. Run the study again to repair it")
    return study


def _identity(study: Mapping[str, Any]) -> dict[str, Any]:
    """Return a study without title and number of samples. The result identifies a run.

    >>> _identity({"title": "a", "samples": 3, "seed": 9, "problem": {"title": "b"}})
    {'seed': 9, 'problem': {'title': 'b'}}
    """
    return {key: value for key, value in study.items() if key not in ("title", "samples")}


def _refuse_another(path: Path, here: Mapping[str, Any], there: Mapping[str, Any]) -> None:
    """Refuse a study that differs from the stored study, except by additional samples.

    >>> stored = {"samples": 3, "title": "a", "seed": 9}
    >>> _refuse_another(Path("run"), stored | {"title": "b", "samples": 4}, stored)
    >>> _refuse_another(
    ...     Path("run"), stored | {"samples": 2, "seed": 8}, stored
    ... )  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: run: holds another study. ...:
      seed: 8 given, 9 stored
      samples: 2 given, 3 stored. A run can only grow
    """
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
    """Return the differences between two studies, each with its key and both values.

    >>> here = {"a": {"b": [1, 2], "c": 3}, "d": 4, "e": 5}
    >>> there = {"a": {"b": [1, 7, 8], "c": 3}, "d": {"f": 6}, "e": 5, "g": 0}
    >>> for text in _differences(here, there):
    ...     print(text)
    a.b.1: 2 given, 7 stored
    a.b.2: nothing given, 8 stored
    d: 4 given, {'f': 6} stored
    g: nothing given, 0 stored
    >>> _differences(here, here)
    []
    """
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

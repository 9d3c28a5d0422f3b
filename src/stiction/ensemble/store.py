"""The store: a folder of chunks that say what they hold.

``study.json`` says which study it is, and ``chunks/`` holds the samples. A chunk is a table (see
`stiction.ensemble.table`) of samples with a mark of their study; its name is a digest of its
content. Chunks are written whole or not at all, and nothing lists them: so any number of processes
may write to a folder at once, a run may be killed at any moment, and damage is found. Each writer
joins its small chunks as they become many.
"""

from __future__ import annotations

import errno
import json
import os
import re
import time
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.ensemble.batches import versions
from stiction.ensemble.table import Table, decode, digest, encode, joined
from stiction.errors import StoreError, warn_user
from stiction.files import cannot_read, cannot_write, final_name, write_whole

FORMAT = 3
STUDY, PILOT, CHUNKS = "study.json", "pilot.json", "chunks"
NAME = re.compile(r"[0-9a-f]{32}\.npz")
OWN = re.compile(r"[0-9a-f]{32}\.(npz|json)")
SAVE_SECONDS = 1.0
SAVE_BYTES = 32 * 2**20
MANY = 64
"""Small chunks that are joined to one."""
LARGE = 16 * 2**20
"""Bytes of a chunk that is not joined any more."""
STALE = 24 * 3600.0
"""Seconds after which a half-written file is one that a killed process left."""


class Damaged(ValueError):
    """A chunk is not what was written; the message says what is wrong with it."""


class DamagedStudy(StoreError):
    """The file that says which study it is, is gone or not what was written."""


class Chunk(NamedTuple):
    """One file of samples.

    Attributes
    ----------
    name : str
    bytes : int
    versions : str
        Of the process that computed it.
    table : Table
    """

    name: str
    bytes: int
    versions: str
    table: Table


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
    damage : list of str
        What is wrong with which chunk, as far as they were read.

    Raises
    ------
    StoreError
        If the folder holds no run, one of another format, or one that cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.study = read_study(path)
        self.damage: list[str] = []
        self._mark = mark_of(self.study)
        self._token = uuid.uuid4().hex
        self._buffer: list[Table] = []
        self._saved = time.monotonic()
        self._small: dict[int, list[str]] = {}

    @classmethod
    def open(cls, path: Path, study: dict[str, Any]) -> Store:
        """Open a folder for writing: a new one, or one that holds the same study.

        Raises
        ------
        StoreError
            If the folder cannot be written, holds other files, or holds another study (the
            differences are named).
        """
        prepare_folder(path)
        try:
            store = cls(path)
        except DamagedStudy as error:
            marks = _marks_of_chunks(path)
            if marks - {mark_of(study)}:
                raise StoreError(
                    f"{error}; its chunks belong to another study than the one that is given here"
                ) from None
            if marks or (path / STUDY).exists():
                warn_user(f"{error}: it is made anew from the study that is given", UserWarning)
            write_study(path, study)
            store = cls(path)
        refuse_another(path, study, store.study)
        if study != store.study:
            write_study(path, study)
            store.study = study
        folder = path / CHUNKS
        if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
            raise StoreError(f"{folder}: is no folder of its own; chunks are kept in a real one")
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise cannot_write(folder, error) from error
        return store

    # -- reading -------------------------------------------------------------------------------

    def chunks(self, *, whole: bool = True) -> Iterator[Chunk]:
        """Yield the chunks that are what was written; what is wrong with others is in `damage`.

        Chunks that another process joins meanwhile are read in their new form; a sample may then
        occur twice, with the same numbers.

        Parameters
        ----------
        whole : bool
            Compare everything with its digest; else read only which samples there are.

        Raises
        ------
        StoreError
            If something is there and cannot be read: nobody knows then whether it is damaged.
        """
        self.damage = []
        seen: set[str] = set()
        while new := sorted(self._names() - seen):
            seen.update(new)
            for name in new:
                try:
                    yield self._chunk(name, whole)
                except FileNotFoundError:  # joined meanwhile
                    continue
                except Damaged as error:
                    self.damage.append(f"{CHUNKS}/{name}: {error}")

    def _names(self) -> set[str]:
        try:
            names = os.listdir(self.path / CHUNKS)
        except FileNotFoundError:
            return set()
        except OSError as error:
            raise cannot_read(self.path / CHUNKS, error) from error
        return {name for name in names if NAME.fullmatch(name)}

    def _chunk(self, name: str, whole: bool = True) -> Chunk:
        path = self.path / CHUNKS / name
        try:
            size = os.stat(path).st_size
            data: Any = path.read_bytes() if whole else path
            if whole and not name.startswith(digest(data)[:32]):
                raise Damaged("fails its checksum")
            table, about = decode(data, rows_only=not whole)
        except FileNotFoundError:
            raise
        except OSError as error:
            raise cannot_read(path, error) from error
        except Damaged:
            raise
        except ValueError as error:
            raise Damaged(str(error)) from None
        if about.get("study") != self._mark:
            raise Damaged("belongs to another study")
        return Chunk(name, size, str(about.get("versions")), table)

    def done(
        self, points: int, samples: int, first: int = 0, *, retry: bool = False, whole: bool = True
    ) -> NDArray[np.bool_]:
        """Return which samples are stored or have failed, (points, samples).

        Parameters
        ----------
        points, samples, first : int
        retry : bool
            Count failed samples as not done.
        whole : bool
            See `chunks`; then damaged chunks are deleted with a warning.
        """
        found = np.zeros((points, samples), dtype=np.bool_)
        others: set[str] = set()
        small: list[str] = []
        for chunk in self.chunks(whole=whole):
            failed = [] if retry else [(f.point, f.sample) for f in chunk.table.failures]
            for point, sample in ((chunk.table.point, chunk.table.sample), _columns(failed)):
                inside = (point < points) & (sample >= first) & (sample < first + samples)
                found[point[inside], sample[inside] - first] = True
            others |= {chunk.versions} - {versions()}
            small += [chunk.name] if chunk.bytes < LARGE else []
        for other in sorted(others):
            self._warn(
                f"was begun with {other}, this is {versions()}: samples of both may differ in"
                " their last digits"
            )
        if whole:
            self._mend()
            if len(small) >= MANY:
                self._join(small, 0)
        return found

    def _mend(self) -> None:
        """Delete what is damaged, and what processes that were killed have left."""
        for text in self.damage:
            name = text.partition(":")[0].removeprefix(f"{CHUNKS}/")
            if text.endswith("another study"):
                self._warn(f"{text}; it is left alone")
                continue
            self._warn(f"{text}; its samples are computed again")
            with suppress(FileNotFoundError):
                (self.path / CHUNKS / name).unlink()
        for folder in (self.path, self.path / CHUNKS):
            for entry in os.scandir(folder):
                with suppress(OSError):
                    left = OWN.fullmatch(final_name(entry.name)) and not NAME.fullmatch(entry.name)
                    if left and time.time() - entry.stat().st_mtime > STALE:
                        os.unlink(entry.path)

    def _warn(self, text: str) -> None:
        warn_user(f"{self.path}: {text}", UserWarning)

    # -- writing -------------------------------------------------------------------------------

    def add(self, table: Table) -> None:
        """Take the rows of a table; `save` stores them."""
        self._buffer.append(table)

    def save(self, *, now: bool = False) -> None:
        """Store what was added, if a second has passed, it is large, or `now`.

        Raises
        ------
        StoreError
            If it cannot be written; what was stored before stays readable.
        """
        late = time.monotonic() - self._saved >= SAVE_SECONDS
        if self._buffer and (
            now or late or sum(table.nbytes for table in self._buffer) >= SAVE_BYTES
        ):
            tables, self._buffer = joined(self._buffer), []
            for table in tables:
                self._write(table, 0)
            self._saved = time.monotonic()
            level = 0
            while len(self._small.get(level, ())) >= MANY:
                self._join(self._small.pop(level), level + 1)
                level += 1

    def close(self) -> None:
        """Join the small chunks that this process has written."""
        names = [name for level in self._small.values() for name in level]
        self._small = {}
        self._join(names, 0)

    def _write(self, table: Table, level: int) -> None:
        about = {"format": FORMAT, "study": self._mark, "versions": versions()}
        data = encode(table, about | {"writer": self._token})
        name = f"{digest(data)[:32]}.npz"
        write_whole(self.path / CHUNKS / name, data)
        if len(data) < LARGE:
            self._small.setdefault(level, []).append(name)

    def _join(self, names: Sequence[str], level: int) -> None:
        """Replace chunks by larger ones; the small ones go when the large ones are whole."""
        group: list[Chunk] = []
        left = list(names)
        while left:
            name = left.pop(0)
            with suppress(FileNotFoundError, Damaged):  # a damaged one is reported when it is read
                group.append(self._chunk(name))
            if group and (not left or sum(chunk.bytes for chunk in group) >= LARGE):
                if len(group) > 1:
                    self._replace(group, level)
                group = []

    def _replace(self, group: Sequence[Chunk], level: int) -> None:
        try:
            for table in joined(chunk.table for chunk in group):
                self._write(table, level)
        except StoreError:  # the disk is full: the small ones stay, and nothing is lost
            return
        for chunk in group:
            with suppress(OSError):
                (self.path / CHUNKS / chunk.name).unlink()

    def note_pilot(self, attributes: Mapping[str, Any]) -> None:
        """Store what the pilot has found."""
        _write_json(self.path, PILOT, {"pilot": dict(attributes)})

    def pilot(self) -> dict[str, Any] | None:
        """Return what the pilot has found; None if there was none."""
        try:
            found: dict[str, Any] = _read_json(self.path / PILOT)["pilot"]
        except (FileNotFoundError, ValueError, KeyError):
            return None
        return found


def _columns(pairs: Sequence[tuple[int, int]]) -> NDArray[np.int64]:
    found: NDArray[np.int64] = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    return found


def _marks_of_chunks(path: Path) -> set[str]:
    """Marks of the studies whose chunks are in a folder."""
    marks = set()
    for file in (path / CHUNKS).glob("*.npz"):
        if NAME.fullmatch(file.name):
            with suppress(ValueError, OSError):
                marks.add(decode(file, rows_only=True)[1]["study"])
    return marks


def prepare_folder(path: Path) -> None:
    """Make the folder, or refuse it before any work is done.

    Raises
    ------
    StoreError
    """
    if path.exists() and not path.is_dir():
        raise StoreError(f"{path}: is a file; a run needs a folder")
    if not path.absolute().parent.is_dir():
        raise StoreError(f"{path}: the folder {path.absolute().parent} does not exist")
    try:
        path.mkdir(exist_ok=True)
        others = {name for name in os.listdir(path) if not OWN.fullmatch(final_name(name))}
        if not os.access(path, os.W_OK):
            raise OSError(errno.EACCES, "")
    except OSError as error:
        raise cannot_write(path, error) from error
    if "manifest.json" in others:
        raise StoreError(
            f"{path}: was written by an earlier version, in a format that this one does not read;"
            " choose a new folder"
        )
    if others and STUDY not in others and not _marks_of_chunks(path):
        some = printable(", ".join(sorted(others)[:3]))
        raise StoreError(f"{path}: holds other files ({some}); choose a new folder")


# -- which study it is ---------------------------------------------------------------------------


def mark_of(study: Mapping[str, Any]) -> str:
    """Return what all chunks of the same study share."""
    return digest(json.dumps(_identity(study), sort_keys=True).encode())[:32]


def _identity(study: Mapping[str, Any]) -> dict[str, Any]:
    """What makes two studies the same run: all but the title, the samples and limits."""
    result = {key: value for key, value in study.items() if key != "title"}
    free = ("samples", "keep_limit")
    result["ensemble"] = {k: v for k, v in study["ensemble"].items() if k not in free}
    return result


def read_study(path: Path) -> dict[str, Any]:
    """Return the study of a run in plain form.

    Raises
    ------
    DamagedStudy
    StoreError
        If it is of another format, or cannot be read.
    """
    file = path / STUDY
    try:
        found = _read_json(file)
        study: dict[str, Any] = found["study"]
    except FileNotFoundError:
        raise DamagedStudy(f"{path}: holds no run (no {STUDY} in it)") from None
    except OSError as error:
        raise cannot_read(file, error) from error
    except (ValueError, KeyError, TypeError):
        text = "is damaged; running the study again into the folder makes a new one"
        raise DamagedStudy(f"{file}: {text}") from None
    if found.get("format") != FORMAT:
        said = printable(repr(found.get("format")))
        raise StoreError(f"{path}: is of format {said}; this version reads {FORMAT}")
    return study


def write_study(path: Path, study: dict[str, Any]) -> None:
    """Write which study it is, whole or not at all."""
    _write_json(path, STUDY, {"format": FORMAT, "study": study})


def _write_json(folder: Path, name: str, content: dict[str, Any]) -> None:
    """Write JSON with a digest, under a name of its own first: others may do the same."""
    sealed = content | {"sha256": digest(json.dumps(content, sort_keys=True).encode())}
    aside = folder / f"{uuid.uuid4().hex}.json"
    write_whole(aside, json.dumps(sealed, indent=1).encode())
    os.replace(aside, folder / name)


def _read_json(file: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(file.read_bytes())
    said = content.pop("sha256")
    if said != digest(json.dumps(content, sort_keys=True).encode()):
        raise ValueError("fails its checksum")
    return content


def refuse_another(path: Path, here: Mapping[str, Any], there: Mapping[str, Any]) -> None:
    """Refuse a study that differs from the stored one in more than a growing number of samples.

    Raises
    ------
    StoreError
        Naming the differences.
    """
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
    if isinstance(here, Mapping) and isinstance(there, Mapping):
        keys = [*here, *(key for key in there if key not in here)]
        pairs = [(f"{path}.{k}" if path else k, here.get(k), there.get(k)) for k in keys]
        return [text for key, a, b in pairs for text in differences(a, b, key)]
    if here == there:
        return []
    lists = isinstance(here, list) and isinstance(there, list) and len(here) == len(there)
    if lists and len(here) > 8:
        count = sum(a != b for a, b in zip(here, there, strict=True))
        return [f"{path}: {count} of {len(here)} entries differ"]
    if lists and any(isinstance(item, Mapping | list) for item in here):
        items = enumerate(zip(here, there, strict=True))
        return [text for i, (a, b) in items for text in differences(a, b, f"{path}[{i}]")]
    texts = ["nothing" if value is None else json.dumps(value) for value in (here, there)]
    short = [text if len(text) <= 60 else text[:57] + "..." for text in texts]
    return [f"{path}: {short[0]} here, {short[1]} there"]


def printable(text: str) -> str:
    """Return text of unknown origin without control characters."""
    return "".join(char if char.isprintable() else "?" for char in text)

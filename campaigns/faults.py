"""A fault at every file operation of a run: is anything lost, or accepted in silence?

    python campaigns/faults.py --count 1000 --seed 0

The n-th operation on the files of a run (open, read, write, sync, rename, remove, list, make a
folder) fails with a full disk, an I/O error or missing permission, for every n; once, or from then
on. Afterwards the same command must end with the result of an undisturbed run, without computing
again what was stored. What the NetCDF library itself writes is not reached.
"""

from __future__ import annotations

import builtins
import errno
import io
import os
import random
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
import small
from harness import Summary, command_line, finish, trial
from numpy.typing import NDArray

from stiction import open_run
from stiction.ensemble.manifest import MANIFEST

NAMES = (
    "open", "fsync", "replace", "rename", "unlink", "remove", "rmdir", "mkdir", "ftruncate",
    "write", "scandir", "listdir",
)  # fmt: skip
LONGEST = 60.0
"""Seconds a trial may take: several runs side by side are slow."""
ERRORS = (errno.ENOSPC, errno.EIO, errno.EACCES)


class Faults:
    """Counts operations below a folder and lets one of them, or all from it on, fail."""

    def __init__(self, folder: Path, number: int, code: int, lasting: bool) -> None:
        self.folder, self.number, self.code, self.lasting = str(folder), number, code, lasting
        self.count, self.handles, self.fired = 0, set(), ""

    def concerns(self, target: Any) -> bool:
        """Whether a path or a handle belongs to the folder."""
        if isinstance(target, int):
            return target in self.handles
        return str(target).startswith(self.folder)

    def check(self, name: str) -> None:
        """Count one operation; raise if it is the one."""
        self.count += 1
        if self.count == self.number or (self.lasting and self.count > self.number):
            self.fired = self.fired or name
            raise OSError(self.code, os.strerror(self.code))

    def of_system(self, name: str, original: Callable[..., Any]) -> Callable[..., Any]:
        """A function of `os` that may fail."""

        def wrapped(target: Any = ".", *args: Any, **kwargs: Any) -> Any:
            mine = self.concerns(target)
            if mine:
                self.check(name)
            result = original(target, *args, **kwargs)
            if name == "open" and mine:
                self.handles.add(result)
            return result

        return wrapped

    def of_files(self, original: Callable[..., Any]) -> Callable[..., Any]:
        """`open`, whose files may fail to be read and written."""

        def wrapped(file: Any, *args: Any, **kwargs: Any) -> Any:
            if not self.concerns(file):
                return original(file, *args, **kwargs)
            self.check("open")
            opened = original(file, *args, **kwargs)
            self.handles.add(opened.fileno())
            return _File(opened, self)

        return wrapped


class _File:
    """An open file that may fail."""

    def __init__(self, file: Any, faults: Faults) -> None:
        self._file, self._faults = file, faults

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._file, name)
        if name not in ("read", "write", "flush", "truncate", "readline"):
            return value

        def wrapped(*args: Any) -> Any:
            self._faults.check(name)
            return value(*args)

        return wrapped

    def __enter__(self) -> _File:
        return self

    def __exit__(self, *args: Any) -> None:
        self.close()

    def __iter__(self) -> Iterator[Any]:
        return iter(self._file)

    def close(self) -> None:
        """Close it; its number may be given to another file."""
        if not self._file.closed:
            self._faults.handles.discard(self._file.fileno())
        self._file.close()


@contextmanager
def injected(folder: Path, number: int, code: int, lasting: bool) -> Iterator[Faults]:
    """Faults while inside."""
    faults = Faults(folder, number, code, lasting)
    before = {name: getattr(os, name) for name in NAMES}
    before_open, before_io = builtins.open, io.open
    try:
        for name, original in before.items():
            setattr(os, name, faults.of_system(name, original))
        builtins.open = io.open = faults.of_files(before_open)
        yield faults
    finally:
        builtins.open, io.open = before_open, before_io
        for name, original in before.items():
            setattr(os, name, original)


def _fresh(folder: Path, half: Path) -> Path:
    return folder / "run"


def _half(folder: Path, half: Path) -> Path:
    shutil.copytree(half, folder / "run")
    return folder / "run"


def _file(folder: Path, half: Path) -> Path:
    return folder / "run.nc"


SCENES = {"a new folder": _fresh, "half a run": _half, "a file": _file}


def _stored(path: Path) -> NDArray[np.float64]:
    """The results of each point and sample, NaN where none is stored; chunks may be joined."""
    if path.suffix == ".nc" or not (path / MANIFEST).exists():
        return np.empty((0, 0))
    return open_run(path).dataset(only=["critical_stress"])["critical_stress"].values


def _judge(path: Path, before: NDArray[np.float64], reference: Any) -> str:
    """What was lost or accepted in silence, if anything."""
    if before.size:
        after = _stored(path)[:, : before.shape[1]]
        gone = int(np.count_nonzero(np.isfinite(before) & (after != before)))
        if gone:
            return f"FAULT lost: {gone} stored samples are gone"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = small.run(path, 40)
    if not result.identical(reference):
        return "FAULT accepted: the result differs from that of an undisturbed run"
    if small.warned(caught):
        return f"FAULT lost: the next run says {caught[0].message}"
    return ""


def campaign(count: int, seed: int = 0) -> Summary:
    """Every operation of every scene, with every error, in random order until `count`."""
    chance, summary = random.Random(seed), Summary(seed)
    with tempfile.TemporaryDirectory(dir=small.place()) as name:
        top = Path(name)
        reference = small.run(top / "reference", 40)
        half = top / "half"
        small.run(half, 20)
        cases = []
        for scene, prepare in SCENES.items():
            folder = top / f"counted {scene}"
            folder.mkdir()
            path = prepare(folder, half)
            with injected(folder, 0, 0, False) as faults:
                small.run(path, 40)
            cases += [
                (scene, number, code, lasting)
                for number in range(1, faults.count + 1)
                for code in ERRORS
                for lasting in (False, True)
            ]
        chance.shuffle(cases)
        for number, case in enumerate(cases[:count]):
            folder = top / str(number)
            folder.mkdir()
            _one(summary, folder, half, reference, *case)
            shutil.rmtree(folder)
    return summary


def _one(
    summary: Summary,
    folder: Path,
    half: Path,
    reference: Any,
    scene: str,
    number: int,
    code: int,
    lasting: bool,
) -> None:
    path = SCENES[scene](folder, half)
    before = _stored(path)
    results: list[Any] = []
    with injected(folder, number, code, lasting) as faults:
        outcome, detail = trial(lambda: results.append(small.run(path, 40)), LONGEST)
    often = " and all later ones" if lasting else ""
    name = f"{scene}, operation {number} ({faults.fired}){often}: {errno.errorcode[code]}"
    if not outcome.startswith("FAULT") and results and not results[0].identical(reference):
        outcome = "FAULT accepted: the disturbed run returned another result"
    if not outcome.startswith("FAULT"):
        judged, told = trial(lambda: results.append(_judge(path, before, reference)), LONGEST)
        bad = results[-1] if judged == "fine" else f"FAULT lost: the next run fails: {told}"
        outcome = bad or outcome
    kind, _, more = outcome.partition(": ")
    summary.note(name, kind, more or detail)


if __name__ == "__main__":
    options = command_line(__doc__, 2000)
    finish(campaign(options.count, options.seed))

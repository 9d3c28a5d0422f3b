"""Damage to every kind of file of a run: is any of it accepted in silence?

    python campaigns/corruption.py --count 600 --seed 0

Bytes of a file are flipped, zeroed, cut off, appended, or the file is emptied, removed or made a
folder. Reading must refuse, warn, or give what an undamaged run gives; so must the same command
that made the run, and what it gives must be whole.
"""

from __future__ import annotations

import random
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import small
from harness import Summary, command_line, finish, trial

import stiction as st


def _flip(path: Path, chance: random.Random) -> None:
    data = bytearray(path.read_bytes())
    for _ in range(chance.choice((1, 1, 8))):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    path.write_bytes(data)


def _zero(path: Path, chance: random.Random) -> None:
    data = bytearray(path.read_bytes())
    begin, size = chance.randrange(len(data)), chance.choice((1, 16, 512))
    data[begin : begin + size] = bytes(len(data[begin : begin + size]))
    path.write_bytes(data)


def _cut(path: Path, chance: random.Random) -> None:
    data = path.read_bytes()
    path.write_bytes(data[: chance.randrange(len(data))])


def _append(path: Path, chance: random.Random) -> None:
    with path.open("ab") as file:
        file.write(chance.randbytes(chance.choice((1, 100))))


def _empty(path: Path, chance: random.Random) -> None:
    path.write_bytes(b"")


def _remove(path: Path, chance: random.Random) -> None:
    path.unlink()


def _folder(path: Path, chance: random.Random) -> None:
    path.unlink()
    path.mkdir()


DAMAGES: tuple[Callable[[Path, random.Random], None], ...] = (
    _flip, _flip, _flip, _zero, _zero, _cut, _cut, _append, _empty, _remove, _folder,
)  # fmt: skip
KINDS = ("manifest.json", "chunks.jsonl", "chunks", "lock", "result.nc")


def _victim(top: Path, kind: str, chance: random.Random) -> Path:
    if kind == "result.nc":
        return top / kind
    if kind == "chunks":
        return chance.choice(sorted((top / "run" / kind).iterdir()))
    return top / "run" / kind


def _accepted(read: Callable[[], Any], reference: Any) -> str:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = read()
    if result.identical(reference) or small.warned(caught):
        return ""
    return "a result that differs was given without a word"


def campaign(count: int, seed: int = 0) -> Summary:
    """So many damaged files, of every kind in turn."""
    chance, summary = random.Random(seed), Summary(seed)
    with tempfile.TemporaryDirectory(dir=small.place()) as name:
        top = Path(name)
        reference = small.run(top / "run")
        small.run(top / "result.nc")
        for number in range(count):
            kind = KINDS[number % len(KINDS)]
            trial_folder = top / "trial"
            trial_folder.mkdir()
            shutil.copytree(top / "run", trial_folder / "run")
            shutil.copy(top / "result.nc", trial_folder)
            damage = chance.choice(DAMAGES)
            damage(_victim(trial_folder, kind, chance), chance)
            path = trial_folder / ("result.nc" if kind == "result.nc" else "run")
            _one(summary, f"{kind}, {damage.__name__[1:]}", path, reference)
            shutil.rmtree(trial_folder)
    return summary


def _one(summary: Summary, name: str, path: Path, reference: Any) -> None:
    for step, use in (
        ("read", lambda: st.open_run(path).dataset()),
        ("status", lambda: st.open_run(path).status()),
        ("run again", lambda: small.run(path)),
    ):
        found: list[Any] = []
        if step == "status":
            outcome, detail = trial(use)
        else:
            outcome, detail = trial(
                lambda use=use, found=found: found.append(_accepted(use, reference))
            )
        if found and found[0]:
            outcome, detail = "FAULT accepted", found[0]
        summary.note(f"{name}: {step}", outcome, detail)
    if outcome == "fine" and not st.open_run(path).dataset().identical(reference):
        summary.note(f"{name}: after all", "FAULT lost", "the run is complete and differs")


if __name__ == "__main__":
    options = command_line(__doc__, 600)
    finish(campaign(options.count, options.seed))

"""The commands: what they print and write, how they end, and what they make of mistakes."""

import errno
import math
import os
import signal
import subprocess
import sys
import time
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from crooked import LINE, LINE_STRENGTH
from recording import stored
from refusals import refuses
from setups import local_onset
from small_study import lengths, small_study

import stiction as st
from stiction.base import files
from stiction.base.errors import StoreError
from stiction.cli.pages import shown
from stiction.ensemble.store import Store
from stiction.study import run as runs_on_disk

# 16 nodes in a nucleation length.
STUDY = small_study(256, title="a small sweep", samples=100, sweep=lengths(4e-3, 6e-3, 8e-3))
STUDY["problem"]["load"] = {"normal_pressure": 5e6}
TEXT = tomli_w.dumps(STUDY)


@pytest.fixture(autouse=True)
def study(monkeypatch, tmp_path):
    """Commands run in a folder of their own, which holds a study."""
    monkeypatch.chdir(tmp_path)
    path = Path("study.toml")
    path.write_text(TEXT)
    return path


def test_interrupted_from_outside(runs, study):
    # A shell that starts tests in the background lets them, and what they start, ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    study.write_text(TEXT.replace("samples = 100", "samples = 3_000_000"))
    command = [sys.executable, "-m", "stiction", "run", str(study), "--out", "run"]
    options = {"stderr": subprocess.PIPE, "text": True, "env": os.environ | {"COLUMNS": "200"}}
    with subprocess.Popen(command, **options) as process:
        deadline = time.monotonic() + 120.0
        while not Path("run/study.json").exists():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        err = process.communicate(timeout=60.0)[1]
    assert process.returncode == 130
    assert "interrupted:" in err
    stored = "results are" if any(Path("run/chunks").iterdir()) else "no sample is stored"
    assert f"{stored} in run. Rerun the command to resume" in err
    assert "Traceback" not in err
    runs("status run", "of 9000000", code=1)


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize(
    ("where", "done", "number"),
    [("add", "100 of 300", signal.SIGTERM), ("note_pilot", "300 of 300", signal.SIGINT)],
)
def test_an_interruption_whose_exception_is_lost(runs, monkeypatch, where, done, number):
    """As in a finalizer or a callback from C: the run ends at the next table, or at its end.

    Python reports neither the lost exception nor what the interruption has left half built."""

    class Losing:
        def __del__(self):
            signal.raise_signal(number)

    class HalfBuilt:
        def __del__(self):
            raise AttributeError("closed was never set")

    def lose(*given):
        original(*given)
        Losing()
        HalfBuilt()

    original, alive = getattr(Store, where), [HalfBuilt()]
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with monkeypatch.context() as patch:
        patch.setattr(Store, where, lose)
        words = "interrupted: results are in run"
        runs("run study.toml --out run --workers 1", words, code=130)
    alive.clear()
    runs("status run", done, code=int(not done.startswith("300")))
    runs("run study.toml --out run", "300 of 300")


def test_an_interruption_before_the_first_sample_promises_no_results(runs, monkeypatch):
    monkeypatch.setattr(Store, "resume", lambda *_: signal.raise_signal(signal.SIGTERM))
    runs("run study.toml --out run", "interrupted: no sample is stored in run", code=130)


def test_mistakes_end_with_a_message(runs):
    for line, words in stored("lines").items():
        runs(line.format(long="x" * 300), words, code=2)


def test_a_full_disk_is_called_so_and_leaves_nothing_half(runs, monkeypatch):
    runs("run study.toml --out run")
    before = sorted(os.listdir())

    def fail(handle):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(files.os, "fsync", fail)  # as of a file system that allocates late
    for line in ("report run --out page.html", "export run out.nc"):
        runs(line, "cannot be written: No space left on device", code=1)
        assert sorted(os.listdir()) == before


@pytest.mark.parametrize("number", [12345, -7, True, 0.1234567, -1e-7, math.nan])
def test_a_report_shows_numbers_of_arrays_as_those_of_python(number):
    assert shown(np.array([number])[0]) == shown(number)


def test_escape_sequences_of_a_run_are_not_printed_raw(runs):
    """And a run of which nothing is left has no report."""
    title = "\x1b[2Jnice\x07\nsamples 9 of 9 <script>"
    st.Study.from_dict(STUDY | {"title": title}).to_toml("hostile.toml")
    runs("run hostile.toml --out run")
    for line in ("check hostile.toml", "status run"):
        said = runs(line, "\\x1b[2Jnice")
        assert not any(raw in said for raw in ("\x1b", "\x07", "\nsamples 9"))
    runs("report run")
    assert "9 <script>" not in Path("run/report.html").read_text()
    for chunk in Path("run/chunks").iterdir():
        chunk.unlink()
    runs("report run", "no sample is stored yet", code=2)


def test_a_disk_without_room_for_a_result_is_left_as_it_was(tmp_path, monkeypatch):
    """The NetCDF library itself would report nothing."""
    result = local_onset(LINE, LINE_STRENGTH)
    Usage = namedtuple("Usage", "free")
    room = {"free": result.nbytes + 2**16}
    monkeypatch.setattr(runs_on_disk.shutil, "disk_usage", lambda _: Usage(**room))
    words = "cannot be written: No space left on device"
    refuses(words, lambda: runs_on_disk.write_result(result, tmp_path / "out.nc"), StoreError)
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]
    room["free"] *= 2
    runs_on_disk.write_result(result, tmp_path / "out.nc")

"""Runs that are killed, fail to write or are damaged end with the bits of an undisturbed one.

More of them: pytest tests/fuzz/test_stores.py --fuzz-count 15000 --fuzz-seed 771.
"""

import errno
import multiprocessing
import os
import random
import signal
import time
import warnings
from pathlib import Path

import pytest
from small_study import lengths, small_study

import stiction as st

pytestmark = [
    pytest.mark.filterwarnings("ignore"),
    pytest.mark.usefixtures("small_chunks"),
    pytest.mark.skipif(not hasattr(os, "fork"), reason="writers are forked"),
]
IN_A_CHUNK = 7
METHODS = [{"type": "local_criterion"}, {"type": "equilibrium"}]
SWEEP = [lengths(8e-3, 12e-3)[0] | {"method": METHODS}]
STUDY = st.Study.from_dict(small_study(64, samples=40, keep=["strength"], sweep=SWEEP))


@pytest.fixture
def fuzz(fuzz):
    """Each trial is a run: one of them for fifteen elsewhere."""
    fuzz.count = max(1, fuzz.count // 15)
    return fuzz


@pytest.fixture(scope="module")
def reference():
    return STUDY.run(workers=1, pilot=False)


def write(folder):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return STUDY.run(out=folder, workers=1, pilot=False, progress=False)


def begin(folder):
    fork = multiprocessing.get_context("fork")
    writer = fork.Process(target=write, args=(folder,), daemon=True)
    writer.start()
    return writer


def test_writers_killed_at_random(tmp_path, fuzz, reference):
    """One or two are killed and begin again until one ends by itself; then a new run begins."""
    chance, kills, runs = random.Random(fuzz.seed), 0, 0
    while kills < fuzz.count:
        folder, seconds = tmp_path / f"run-{runs}", 0.2
        running = [begin(folder) for _ in range(1 + runs % 2)]
        while running:
            seconds *= 1.05  # longer on a machine so busy that nothing is stored meanwhile
            assert seconds < 20.0, "no writer comes to its end"
            time.sleep(chance.uniform(0.0, seconds))
            victim = running.pop(chance.randrange(len(running)))
            if victim.exitcode is None:
                os.kill(victim.pid, signal.SIGKILL)
            victim.join()
            if victim.exitcode == -signal.SIGKILL:
                kills += 1
                running.append(begin(folder))
            else:
                assert victim.exitcode == 0
        assert write(folder).identical(reference)
        state = st.open_run(folder).status()
        assert state.complete
        assert state.damaged == ()
        runs += 1


def test_calls_of_the_system_that_fail(tmp_path, fuzz, reference, monkeypatch):
    """The disk is full, or Ctrl-C comes, at any of the calls that write or rename."""
    chance, faults, runs = random.Random(fuzz.seed), 0, 0
    calls = {"fsync": os, "replace": os, "write_bytes": Path}
    while faults < fuzz.count:
        folder, runs = tmp_path / f"run-{runs}", runs + 1
        for _ in range(3):
            name = chance.choice(list(calls))
            whole, left = getattr(calls[name], name), chance.randrange(20)

            def fail(*arguments, whole=whole, **options):
                nonlocal left, faults
                left -= 1
                if left < 0:
                    faults += left == -1
                    raise chance.choice([OSError(errno.ENOSPC, "full"), KeyboardInterrupt()])
                return whole(*arguments, **options)

            with monkeypatch.context() as patch:
                patch.setattr(calls[name], name, fail)
                try:
                    assert write(folder).identical(reference)
                except (st.RunError, KeyboardInterrupt):
                    assert left < 0
        assert write(folder).identical(reference)
        assert st.open_run(folder).dataset().identical(reference)


def test_damage_anywhere(tmp_path, fuzz, reference):
    """Bits, lost or added ends, files that are gone or of other content."""
    chance = random.Random(fuzz.seed)
    folder = tmp_path / "run"
    for _ in range(fuzz.count):
        write(folder)
        chunk = chance.choice(sorted((folder / "chunks").iterdir()))
        victim = folder / "study.json" if chance.random() < 0.3 else chunk
        data = bytearray(victim.read_bytes())
        kind = chance.choice(("bit", "bit", "bit", "cut", "longer", "gone"))
        at = chance.randrange(len(data))
        if kind == "bit":
            data[at] ^= 1 << chance.randrange(8)
        elif kind == "cut":
            del data[at:]
        elif kind == "longer":
            data += os.urandom(chance.randint(1, 100))
        same = bytes(data) == victim.read_bytes()
        victim.write_bytes(data)
        if kind == "gone":
            victim.unlink()
        elif victim.name == "study.json" and not same:
            with pytest.raises(st.RunError, match="damaged"):
                st.open_run(folder)
        elif not same:
            assert len(st.open_run(folder).status().damaged) == 1
        assert write(folder).identical(reference), (victim.name, kind, at)
        assert st.open_run(folder).dataset().identical(reference)

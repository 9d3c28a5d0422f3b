"""Runs on disk: they go on where they ended, however they ended, to the same bits."""

import copy
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import warnings

import numpy as np
import pytest
import xarray as xr
from executors import Counting, Forbidding, SlowFrom
from small_study import lengths, small_study

import stiction as st
from stiction.ensemble import resume, scheduler, work
from stiction.ensemble.files import Lock
from stiction.ensemble.manifest import write_manifest
from stiction.errors import StoreError, WorkerError
from stiction.stored_run import StoredRun, folder_beside
from stiction.study_run import run_into

STUDY = small_study(
    ensemble={"samples": 900, "seed": 3, "keep": ["strength"], "keep_samples": [1, 700, 899]},
    sweep=[*lengths(4e-3, 6e-3), {"problem.solid.poisson_ratio": [0.25, 0.33]}],
)


def make_study(samples=900, **changes):
    study = copy.deepcopy(STUDY)
    study["ensemble"]["samples"] = samples
    return st.Study.from_dict(study | changes)


@pytest.fixture
def often(monkeypatch):
    """Many chunks of a hundred samples instead of one a second."""
    monkeypatch.setattr(resume, "FLUSH_SECONDS", 0.0)
    monkeypatch.setattr(
        scheduler.Sizer, "next", lambda sizer, plan, span, *rest: min(100, span.samples)
    )


@pytest.fixture(scope="module")
def reference():
    return make_study().run(workers=1)


def sizes(folder):
    return {path.name: path.stat().st_mtime_ns for path in (folder / "chunks").iterdir()}


def test_a_stored_run_is_the_run_in_memory(tmp_path, often, reference):
    for name in ("run", "result.nc"):
        result = make_study().run(out=tmp_path / name, workers=2)
        assert result.identical(reference)
        assert StoredRun(tmp_path / name).study == make_study()
    assert len(sizes(tmp_path / "run")) > 4
    assert not folder_beside(tmp_path / "result.nc").exists()
    with xr.open_dataset(tmp_path / "result.nc") as written:
        assert written.load().identical(reference)


def test_export_is_the_same_again(tmp_path, often, reference):
    run_into(make_study(), tmp_path / "run")
    StoredRun(tmp_path / "run").export(tmp_path / "exported.nc")
    with xr.open_dataset(tmp_path / "exported.nc") as written:
        assert written.load().identical(reference)


@pytest.mark.parametrize("name", ["run", "result.nc"])
def test_growing_computes_only_the_new_samples(tmp_path, often, reference, name):
    make_study(samples=500).run(out=tmp_path / name)
    counting = Counting()
    assert make_study().run(out=tmp_path / name, executor=counting).identical(reference)
    assert min(first for first, _ in counting.pieces) == 500
    assert sum(count for _, count in counting.pieces) == 4 * 400
    assert make_study().run(out=tmp_path / name, executor=Forbidding()).identical(reference)


def test_a_run_does_not_shrink(tmp_path):
    make_study(samples=50).run(out=tmp_path / "run")
    with pytest.raises(StoreError, match=r"ensemble\.samples: 20 here, 50 there"):
        make_study(samples=20).run(out=tmp_path / "run")


@pytest.mark.parametrize("name", ["run", "result.nc"])
def test_another_study_is_refused_with_the_difference(tmp_path, name):
    make_study(samples=50).run(out=tmp_path / name)
    problem = copy.deepcopy(STUDY["problem"])
    problem["solid"]["density"] = 2000.0
    del problem["friction"]["weakening_rate"]
    problem["friction"]["critical_slip"] = 1e-6
    other = make_study(samples=50, problem=problem, sweep=STUDY["sweep"][:1])
    with pytest.raises(StoreError) as caught:
        other.run(out=tmp_path / name)
    text = str(caught.value)
    assert "problem.solid.density: 2000.0 here, 1170.0 there" in text
    assert "problem.friction.critical_slip: 1e-06 here, nothing there" in text
    assert "sweep" in text
    renamed = make_study(samples=50, title="another title", cluster={"jobs": 3})
    renamed.run(out=tmp_path / name)


def test_an_interrupted_run_is_readable_and_goes_on(tmp_path, often, reference):
    def interrupt(done, total):
        if done > 1200:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_study().run(out=tmp_path / "run", progress=interrupt, workers=2)
    state = StoredRun(tmp_path / "run").status()
    assert 1200 < state.done < 3600
    assert not state.active
    part = StoredRun(tmp_path / "run").dataset()
    stress = part["critical_stress"].values
    found = np.isfinite(stress)
    assert found.sum() == state.done
    np.testing.assert_array_equal(stress[found], reference["critical_stress"].values[found])
    assert make_study().run(out=tmp_path / "run").identical(reference)


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.write_bytes(path.read_bytes()[:-100]),
        lambda path: path.write_bytes(path.read_bytes().replace(b"\x00", b"\x01", 1)),
        lambda path: path.write_bytes(b""),
        lambda path: path.unlink(),
    ],
    ids=["truncated", "one byte", "empty", "gone"],
)
def test_damaged_chunks_are_found_and_computed_again(tmp_path, often, reference, damage):
    run_into(make_study(), tmp_path / "run", workers=1)
    before = sizes(tmp_path / "run")
    victim = sorted((tmp_path / "run" / "chunks").iterdir())[1]
    damage(victim)
    state = StoredRun(tmp_path / "run").status()
    assert [text.split()[0] for text in state.damaged] == [f"chunks/{victim.name}"]
    assert state.done < state.samples
    with pytest.warns(UserWarning, match=f"{victim.name}: (is gone|fails its checksum).*missing"):
        part = StoredRun(tmp_path / "run").dataset()
    assert int(part["critical_stress"].isnull().sum()) == state.samples - state.done
    with pytest.warns(
        UserWarning, match=f"{victim.name}: (is gone|fails its checksum).*computed again"
    ):
        result = make_study().run(out=tmp_path / "run", workers=1)
    assert result.identical(reference)
    after = sizes(tmp_path / "run")
    kept = [name for name in before if name != victim.name]
    assert {name: after[name] for name in kept} == {name: before[name] for name in kept}


def test_a_torn_list_and_files_aside_do_no_harm(tmp_path, often, reference):
    run_into(make_study(), tmp_path / "run", workers=1)
    listed = tmp_path / "run" / "chunks.jsonl"
    lines = listed.read_bytes()
    listed.write_bytes(lines[: len(lines) - 37])
    (tmp_path / "run" / "chunks" / "000777-0123abcd.nc.part").write_bytes(b"half a chunk")
    (tmp_path / "run" / "chunks.jsonl.part").write_bytes(b"half a list")
    assert make_study().run(out=tmp_path / "run").identical(reference)
    assert not list((tmp_path / "run" / "chunks").glob("*.part"))


def test_two_runs_at_once_in_one_process(tmp_path, often):
    begun, go_on = threading.Event(), threading.Event()

    def wait(done, total):
        begun.set()
        go_on.wait(20.0)

    thread = threading.Thread(
        target=lambda: make_study().run(out=tmp_path / "run", progress=wait, workers=1)
    )
    thread.start()
    assert begun.wait(20.0)
    assert StoredRun(tmp_path / "run").status().active
    with pytest.raises(StoreError, match="is writing to it"):
        make_study().run(out=tmp_path / "run")
    go_on.set()
    thread.join()
    assert StoredRun(tmp_path / "run").status().complete


HOLD = """
import sys, time
from pathlib import Path
from stiction.ensemble.files import Lock
from stiction.ensemble.manifest import write_manifest
with Lock(Path(sys.argv[1])):
    print("locked", flush=True)
    time.sleep(60.0)
"""


def test_the_lock_ends_with_its_process_however_it_ends(tmp_path):
    path = tmp_path / "lock"
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(path)], stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout.readline() == "locked\n"
        with pytest.raises(StoreError, match=f"process {holder.pid} on"), Lock(path):
            pass
        holder.send_signal(signal.SIGKILL)
    with Lock(path):
        pass


def failing(samples):
    original = work.compute

    def compute(plan, first, count):
        if any(first <= sample < first + count for sample in samples):
            raise FloatingPointError("the slip rate became non-finite")
        return original(plan, first, count)

    return compute


def test_failed_samples_are_named_listed_and_retried(tmp_path, often, reference, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(work, "compute", failing({17, 850}))
        with pytest.raises(RuntimeError, match=r"sample 17 \(seed 3\): FloatingPointError"):
            make_study(sweep=[]).run(workers=1)
        for name in ("run", "result.nc"):
            result = make_study().run(out=tmp_path / name, workers=2)
            run = StoredRun(tmp_path / name)
            assert {(f.point, f.sample, f.seed) for f in run.failures} == {
                (point, sample, 3) for point in range(4) for sample in (17, 850)
            }
            assert run.status().done == 4 * 898
            rest = [sample for sample in range(900) if sample not in (17, 850)]
            assert result["critical_stress"].isnull().sum() == 8
            np.testing.assert_array_equal(
                result["critical_stress"].sel(sample=rest),
                reference["critical_stress"].sel(sample=rest),
            )
            assert len(json.loads(result.attrs["failed_samples"])) == 8
    for name in ("run", "result.nc"):
        again = make_study().run(out=tmp_path / name)  # without being asked: not tried again
        assert len(StoredRun(tmp_path / name).failures) == 8
        assert again["critical_stress"].isnull().sum() == 8
        assert make_study().run(out=tmp_path / name, retry=True).identical(reference)
        assert StoredRun(tmp_path / name).failures == ()


def test_a_study_that_fails_from_the_start_is_given_up(tmp_path, often, monkeypatch):
    monkeypatch.setattr(work, "compute", failing(set(range(1000))))
    with pytest.raises(st.InputError, match="samples of point 0 all failed.*seed 3"):
        make_study().run(out=tmp_path / "run", workers=1)


class DyingExecutor:
    """Loses its third piece of work."""

    def __init__(self):
        self.pieces = 0

    def submit(self, function, *arguments):
        from concurrent.futures import Future

        self.pieces += 1
        future = Future()
        if self.pieces == 3:
            future.set_exception(OSError("the machine is gone"))
        else:
            future.set_result(function(*arguments))
        return future


def test_a_lost_worker_leaves_what_is_done(tmp_path, often, reference):
    with pytest.raises(WorkerError, match=r"samples \d+ to \d+ of point 0 \(seed 3\).*is gone"):
        make_study().run(out=tmp_path / "run", executor=DyingExecutor(), workers=1)
    assert 0 < StoredRun(tmp_path / "run").status().done < 3600
    assert make_study().run(out=tmp_path / "run").identical(reference)


@pytest.mark.parametrize(
    ("prepare", "words"),
    [
        (lambda path: path.write_text("text"), "is a file"),
        (lambda path: (path.mkdir(), (path / "thesis.tex").write_text("text")), "thesis.tex"),
        (
            lambda path: (path.mkdir(), (path / "manifest.json").write_text('{"format": 99}')),
            "format 99",
        ),
    ],
    ids=["a file", "other files", "a later format"],
)
def test_unusable_folders_are_refused_before_any_work(tmp_path, prepare, words):
    prepare(tmp_path / "run")
    with pytest.raises(StoreError, match=words):
        make_study().run(out=tmp_path / "run", executor=Forbidding())


def test_unusable_places_are_refused_before_any_work(tmp_path):
    with pytest.raises(StoreError, match="does not exist"):
        make_study().run(out=tmp_path / "nowhere" / "run", executor=Forbidding())
    (tmp_path / "folder.nc").mkdir()
    with pytest.raises(StoreError, match="is a folder"):
        make_study().run(out=tmp_path / "folder.nc", executor=Forbidding())
    (tmp_path / "notes.nc").write_text("not NetCDF")
    with pytest.raises(StoreError, match=r"notes\.nc"):
        make_study().run(out=tmp_path / "notes.nc", executor=Forbidding())


def test_a_folder_that_vanishes(tmp_path, often):
    def vanish(done, total):
        if (tmp_path / "run").exists():
            shutil.rmtree(tmp_path / "run")

    with pytest.raises(StoreError, match="the folder is gone"):
        make_study().run(out=tmp_path / "run", progress=vanish, workers=1)


@pytest.fixture
def small_disk(tmp_path):
    """A file system of one megabyte."""
    place = tmp_path / "disk"
    place.mkdir()
    if not shutil.which("mount") or os.geteuid() != 0:
        pytest.skip("mounting a small file system needs root")
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(place)], capture_output=True
    )
    if done.returncode:
        pytest.skip(f"mounting a small file system failed: {done.stderr.decode().strip()}")
    yield place
    subprocess.run(["umount", "--lazy", str(place)], check=True)


def test_a_full_disk(small_disk, often, reference, monkeypatch):
    ballast = small_disk / "ballast"
    ballast.write_bytes(b"\x00" * (900 << 10))  # a chunk of a hundred samples takes some 8 kB
    with pytest.raises(StoreError, match="the disk is full"):
        make_study().run(out=small_disk / "run", workers=1)
    state = StoredRun(small_disk / "run").status()
    assert 0 < state.done < state.samples
    assert state.damaged == ()
    assert not list((small_disk / "run" / "chunks").glob("*.part"))
    with pytest.raises(StoreError, match="the disk is full"):
        StoredRun(small_disk / "run").export(small_disk / "result.nc")
    assert not (small_disk / "result.nc").exists()
    with pytest.raises(StoreError, match="the disk is full"):
        make_study().run(out=small_disk / "run", workers=1)
    ballast.unlink()
    # What is left goes into larger chunks: each takes at least 10 kB.
    monkeypatch.setattr(resume, "FLUSH_SECONDS", 10.0)
    assert make_study().run(out=small_disk / "run").identical(reference)


def test_a_read_only_disk(small_disk):
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    for name in ("run", "result.nc"):
        with pytest.raises(StoreError, match="read-only"):
            make_study().run(out=small_disk / name, executor=Forbidding())


def test_a_version_that_differs_is_said(tmp_path, often):
    study = make_study(samples=40)
    study.run(out=tmp_path / "run")
    write_manifest(tmp_path / "run", study.to_dict(), ["stiction 99.0, numpy 1.0, numba 0.1"])
    with pytest.warns(UserWarning, match=r"begun with stiction 99\.0, numpy .*, this is stiction"):
        make_study(samples=60).run(out=tmp_path / "run")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make_study(samples=80).run(out=tmp_path / "run")


def test_memory_is_bounded_by_the_pieces_in_flight(monkeypatch):
    """Only so many pieces are handed out, and each is only so big, whatever the study."""
    monkeypatch.setattr(scheduler, "MOST_BYTES", 2**20)
    alive, most = set(), 0

    class Counting:
        def submit(self, function, plan, point, first, count, *marks):
            nonlocal most
            from concurrent.futures import Future

            future = Future()
            alive.add((first, count))
            most = max(most, len(alive))
            work = (future, function, plan, point, first, count)
            threading.Timer(0.002, self.finish, work).start()
            return future

        def finish(self, future, function, plan, point, first, count):
            outcome = function(plan, point, first, count)
            alive.discard((first, count))
            future.set_result(outcome)

    plan = make_study(
        sweep=[], ensemble={"samples": 20000, "keep": ["strength"], "keep_limit": 1e9}
    ).plans[0]
    spans = [scheduler.Span(0, 0, 20000)]
    largest = 0
    for outcome in scheduler.share_out([plan], spans, executor=Counting(), workers=3, seconds=1e6):
        largest = max(largest, outcome.nbytes if outcome else 0)
    assert most <= 6  # two a worker
    # 128 nodes and four more numbers a sample make 1056 bytes: a fair share would be 3.5 MB.
    assert 2**18 < largest < 1.1 * 2**20


@pytest.mark.slow
def test_killed_at_random_moments(tmp_path, monkeypatch):
    """Ten times kill -9, resumed each time; the campaign does a hundred."""
    from importlib.util import module_from_spec, spec_from_file_location
    from pathlib import Path

    path = Path(__file__).parents[2] / "campaigns" / "kill.py"
    spec = spec_from_file_location("kill", path)
    kill = module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "kill", kill)
    spec.loader.exec_module(kill)
    counts = kill.campaign(10, tmp_path, seed=1)
    assert counts.kills == 10
    assert counts.different == 0
    assert counts.in_the_middle > 0


def test_time_between_chunks_is_about_a_second(tmp_path):
    """A sample that takes long does not keep finished ones from being stored."""
    with SlowFrom(256, seconds=1.6) as executor:
        study = make_study(samples=300, sweep=[])
        study.run(out=tmp_path / "run", executor=executor, workers=2)
    assert StoredRun(tmp_path / "run").status().chunks >= 2

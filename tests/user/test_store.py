"""Runs on disk: they go on where they ended, however they ended, to the same bits."""

import errno
import os
import threading
import warnings
from concurrent.futures import Executor, Future

import numpy as np
import pytest
from crooked import LINE
from refusals import refuses
from setups import beta_strength
from small_study import lengths, small_study

import stiction as st
from stiction.base import files
from stiction.base.errors import StoreError, WorkerError
from stiction.ensemble import batches, store
from stiction.ensemble.dataset import Gathered
from stiction.ensemble.experiment import Experiment
from stiction.study.run import samples_of_part

SWEEP = [*lengths(4e-3, 6e-3), {"problem.solid.poisson_ratio": [0.25, 0.33]}]
STUDY = small_study(samples=60, keep=["strength"], sweep=SWEEP)
ALL = 4 * 60


class AtOnce(Executor):
    """Computes at once, but for a piece that is lost, and keeps which samples, as spans."""

    def __init__(self, lost=0, **others):
        self.spans, self.lost, self.others = [], lost, others

    def submit(self, function, experiment, span):
        self.spans.append(span)
        future = Future()
        if len(self.spans) == self.lost:
            future.set_exception(OSError("the machine is gone"))
        else:
            future.set_result(function(experiment, span)._replace(**self.others))
        return future


def make_study(samples=60, **changes):
    return st.Study.from_dict(STUDY | {"samples": samples} | changes)


@pytest.fixture(scope="module")
def reference():
    return make_study().run(workers=1)


def again(folder, executor=None):
    """Run the study again, which says nothing about the store."""
    with warnings.catch_warnings(action="error", category=UserWarning):
        warnings.simplefilter("ignore", st.AccuracyWarning)
        return make_study().run(out=folder, workers=1, executor=executor)


# -- what is stored is what is computed ----------------------------------------------------------


def test_growing_computes_only_the_new_samples(tmp_path, small_chunks, reference):
    make_study(samples=40).run(out=tmp_path / "run")
    counting = AtOnce()
    assert make_study().run(out=tmp_path / "run", executor=counting).identical(reference)
    assert min(span.first for span in counting.spans) == 40
    assert sum(span.samples for span in counting.spans) == 4 * 20
    assert again(tmp_path / "run", executor=(none := AtOnce())).identical(reference)
    assert none.spans == []


# -- parts and several writers -------------------------------------------------------------------


@pytest.mark.parametrize(("points", "samples", "of"), [(1, 1, 3), (7, 1000, 10), (1, 5000, 3)])
def test_every_sample_is_in_one_part_and_parts_are_alike(points, samples, of):
    masks = [samples_of_part((k, of), points, samples) for k in range(1, of + 1)]
    assert (np.sum(masks, axis=0) == 1).all()
    sizes = [mask.sum() for mask in masks]
    # Eight blocks a part or more: no part is longer than another by more than one.
    assert max(sizes) - min(sizes) <= max(1, points * samples // (8 * of))


def test_a_reader_beside_a_writer_sees_no_damage(tmp_path, small_chunks):
    options = {"out": tmp_path / "run", "workers": 1, "pilot": False}
    thread = threading.Thread(target=lambda: make_study(120).run(**options), daemon=True)
    thread.start()
    seen, done = 0, 0
    while thread.is_alive():
        if (tmp_path / "run" / "study.json").exists():
            state = st.open_run(tmp_path / "run").status()
            assert state.damaged == ()
            assert state.done >= done
            seen, done = seen + 1, state.done
    assert seen


# -- damage --------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [errno.EIO, errno.EACCES])
def test_what_cannot_be_read_is_not_damaged(tmp_path, small_chunks, monkeypatch, number):
    run = tmp_path / "run"
    make_study().run(out=run, workers=1)
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    for victim in (run / "study.json", next((run / "chunks").glob("*.npz"))):

        def fail(path, read=files.read_regular, victim=victim, **options):
            if path.name == victim.name:
                raise OSError(number, os.strerror(number))
            return read(path, **options)

        with monkeypatch.context() as patch:
            patch.setattr(store, "read_regular", fail)
            refuses("cannot be read", lambda: make_study().run(out=run), StoreError)
            refuses("cannot be read", lambda: st.open_run(run).status(), StoreError)
    assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before


# -- failures ------------------------------------------------------------------------------------


def test_counts_are_whole_numbers_and_samples_beyond_the_last_are_left_out():
    """Which another process, with more samples, may have stored; a count that is lost is NaN."""
    point = Experiment(LINE, beta_strength(4e-3), st.Equilibrium())
    whole = batches.solve_span(point, batches.Span(0, 0, 5))
    failures = tuple(batches.Failure(0, sample, 0, "lost") for sample in (2, 3))
    fewer = {name: np.delete(values, 2, axis=0) for name, values in whole.columns.items()}
    for columns, lost in ((whole.columns, []), (fewer, [2])):
        gathered = Gathered([point], 3)
        gathered.add(whole._replace(columns=columns, failures=failures))
        assert [one.sample for one in gathered.failed] == lost
        found = gathered.dataset({})
        counts = found.arrested_events
        assert counts.dtype.kind == ("f" if lost else "i")
        assert found.sample[counts.isnull().values].values.tolist() == lost
        np.testing.assert_array_equal(counts[:2], whole.columns["arrested_events"][:2])


def test_a_study_that_fails_from_the_start_is_given_up(tmp_path, small_chunks, monkeypatch):
    def results(self, first, count):
        raise FloatingPointError("the slip rate became non-finite")

    monkeypatch.setattr(Experiment, "results", results)
    for out in (None, tmp_path / "run"):
        with pytest.raises(RuntimeError, match=r"sample 0 \(seed 3\): FloatingPointError"):
            make_study().run(out=out, workers=1)


def test_a_lost_worker_leaves_what_is_done(tmp_path, small_chunks, reference):
    options = {"out": tmp_path / "run", "executor": AtOnce(lost=3), "workers": 1}
    words = "items ... of point 0 ... is gone"
    refuses(words, lambda: make_study().run(**options), WorkerError)
    assert 0 < st.open_run(tmp_path / "run").status().done < ALL
    assert again(tmp_path / "run").identical(reference)


def test_versions_of_a_worker_that_differ_are_said():
    with pytest.raises(WorkerError, match="Install the same versions"):
        make_study(samples=40).run(executor=AtOnce(versions="stiction 99.0"))


# -- samples of any ensemble, Dask -----------------------------------------------------------------


@pytest.mark.slow
def test_a_dask_scheduler(tmp_path, command):
    """By the executor of a client, and by the address on the command line."""
    distributed = pytest.importorskip("distributed")
    small = st.Study.from_dict(small_study(sweep=lengths(4e-3, 6e-3)))
    small.to_toml(tmp_path / "study.toml")
    reference = small.run(workers=1)
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        assert small.run(executor=client.get_executor(pure=False)).identical(reference)
        given = tmp_path / "study.toml", "--out", tmp_path / "run"
        code, _, errors = command("run", *given, "--scheduler", cluster.scheduler_address)
    assert code == 0, errors
    assert st.open_run(tmp_path / "run").dataset().identical(reference)


def test_a_file_is_on_the_disk_before_it_has_its_name(tmp_path, monkeypatch):
    """So that a loss of power leaves the old file or the new one: synced, then renamed."""
    done, path = [], tmp_path / "kept.npz"
    for name in ("fsync", "replace"):
        real = getattr(os, name)

        def noted(*given, name=name, real=real):
            done.append((name, path.exists()))
            return real(*given)

        monkeypatch.setattr(os, name, noted)
    files.write_arrays(path, {"a": [1.0]})
    assert done[:2] == [("fsync", False), ("replace", False)]
    assert done[2:] in ([("fsync", True)], [])  # Windows opens no folders
    assert files.read_arrays(path)["a"].tolist() == [1.0]

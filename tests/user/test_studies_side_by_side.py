"""Studies side by side: needs first, the same results, failures and interruptions that end it."""

import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from threadpoolctl import threadpool_info

import stiction as st
from stiction._blas import one_blas_thread
from stiction.errors import warn_accuracy, warn_user
from stiction.papers.albertini2020.setting import Setting
from stiction.papers.albertini2020.studies import STUDIES, compute
from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.side_by_side import side_by_side
from stiction.papers.albertini2020.studies.study_cache import place_of


def _study(name, compute, needs=(), cost=1):
    return SimpleNamespace(
        name=name, title=f"Study {name}", needs=needs, cost=lambda context: cost, compute=compute
    )


def _context(**options):
    return Context(Setting(problem=st.paper.problem(nodes=256)), 64, 0, **options)


def test_two_studies_are_under_way_at_once():
    """Each waits for the other: one after the other they would never end."""
    meet = threading.Barrier(2, timeout=20)

    def wait(context):
        meet.wait()
        return xr.Dataset()

    found = list(side_by_side([_study("a", wait), _study("b", wait)], _context(workers=2)))
    assert {study.name for study, _ in found} == {"a", "b"}


def test_a_study_begins_when_those_that_it_needs_are_done():
    def second(context):
        return xr.Dataset({"twice": 2.0 * context.results["first"]["x"]})

    studies = [
        _study("second", second, needs=("first",), cost=100),
        _study("first", lambda context: xr.Dataset({"x": 21.0})),
    ]
    found = {study.name: dataset for study, dataset in side_by_side(studies, _context(workers=2))}
    assert list(found) == ["first", "second"]
    assert float(found["second"]["twice"]) == 42.0
    assert found["second"].attrs["title"] == "Study second"


def test_the_costliest_begins_first():
    order = []

    def of(name):
        def note(context):
            order.append(name)
            return xr.Dataset()

        return note

    studies = [_study(name, of(name), cost=cost) for name, cost in (("a", 1), ("b", 9), ("c", 5))]
    list(side_by_side(studies, _context(workers=1)))
    assert order == ["b", "c", "a"]


def test_warnings_and_progress_belong_to_their_study():
    def warns(name):
        def compute(context):
            def run(tell):
                warn_accuracy(f"so says Study {name}")
                list(context.executor.map(lambda i: warn_accuracy(f"sample {i % 1}"), range(3)))
                tell(1, 1)
                return xr.Dataset()

            return context.listen(run, 7)

        return compute

    told = []
    context = _context(workers=2, report=told.append)
    list(side_by_side([_study(name, warns(name)) for name in "ab"], context))
    assert context.warnings == {
        "Study a: so says Study a": 1, "Study a: sample 0": 3,
        "Study b: so says Study b": 1, "Study b: sample 0": 3,
    }  # fmt: skip
    assert told == [7, 7]


def test_what_is_under_way_is_finished_before_a_failure_is_raised():
    failed = threading.Event()

    def fails(context):
        failed.set()
        raise ValueError("this one")

    def finishes(context):
        assert failed.wait(20)
        time.sleep(0.3)  # until the failure is known
        return xr.Dataset()

    def never(context):
        raise AssertionError("began after a failure")

    studies = [_study("a", fails, cost=3), _study("b", finishes, cost=2), _study("c", never)]
    found = []
    with pytest.raises(ValueError, match="this one"):
        found.extend(study.name for study, _ in side_by_side(studies, _context(workers=2)))
    assert found == ["b"]


def test_who_leaves_early_abandons_the_rest():
    stopped = threading.Event()

    def endless(context):
        try:
            while True:
                context.report(0)
                time.sleep(0.01)
        finally:
            stopped.set()

    studies = [_study("a", lambda context: xr.Dataset()), _study("b", endless)]
    results = side_by_side(studies, _context(workers=2))
    assert next(results)[0].name == "a"
    results.close()
    assert stopped.is_set()


def test_threads_of_blas_are_what_they_were_however_it_ends():
    """One thread while anybody needs that; the limits end in another order than they began."""

    def threads():
        return [each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"]

    before = threads()
    first, second = one_blas_thread(), one_blas_thread()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert set(threads()) == {1}
    second.__exit__(None, None, None)
    assert threads() == before

    def tell(work):
        raise KeyboardInterrupt

    context = _context(workers=2, report=tell)
    with pytest.raises(KeyboardInterrupt):
        compute(["monte_carlo", "disorder"], context)
    assert threads() == before


def test_warnings_outside_ensembles_are_kept_and_others_are_the_callers():
    def warns(context):
        warn_accuracy("coarse")
        warn_user("strange unit", st.UnitWarning)
        return xr.Dataset()

    context = _context(workers=1)
    with pytest.warns(st.UnitWarning, match="strange") as caught:
        list(side_by_side([_study("a", warns)], context))
    assert context.warnings == {"Study a: coarse": 1}
    assert [warning.filename for warning in caught] == [__file__]


def test_what_is_kept_does_not_depend_on_how_the_folder_is_called(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    absolute, relative = _context(folder=tmp_path / "run"), _context(folder=Path("run"))
    for study in STUDIES.values():
        assert place_of(study, absolute).name == place_of(study, relative).name


def test_seconds_are_processor_time_wherever_it_was_spent():
    def burn(seconds):
        begin = time.thread_time()
        while time.thread_time() - begin < seconds:
            pass

    def busy(context):
        burn(0.05)
        list(context.executor.map(burn, [0.05, 0.05]))
        time.sleep(0.3)
        return xr.Dataset()

    ((_, found),) = side_by_side([_study("a", busy)], _context(workers=2))
    # 0.15 s of work; half of it again for what surrounds it. The wait is no work.
    assert 0.15 <= found.attrs["seconds"] < 0.225


def test_results_are_the_same_whatever_runs_beside_them():
    """To the bit: one worker, and more than there are cores."""
    names = ["monte_carlo", "interaction", "disorder", "free_end", "trend"]
    one, many = (
        compute(names, Context(Setting(problem=st.paper.problem(nodes=256)), 64, 3, workers=w))
        for w in (1, 5)
    )
    assert list(one) == list(many)
    for name, dataset in one.items():
        for key, variable in dataset.variables.items():
            np.testing.assert_array_equal(variable.values, many[name][key].values)

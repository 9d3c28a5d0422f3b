"""Mistakes and mishaps: options, load histories, folders, caches."""

import dataclasses
import errno
import logging

import numpy as np
import pytest
import xarray as xr
from refusals import refuses
from ruptures import STRESS, wavy_line

import stiction as st
from stiction import AccuracyWarning, InputError
from stiction.dynamics import save as save_module
from stiction.dynamics.method import Rupture
from stiction.dynamics.save import open_rupture
from stiction.dynamics.simulate import simulate_rupture
from stiction.elasticity.exponential_sum import kernel_sum
from stiction.errors import StoreError
from stiction.files import read_arrays

NODES = 128


def make_problem(nodes=NODES):
    return wavy_line(nodes)[0]


def profile(nodes=NODES):
    return wavy_line(nodes)[1]


METHOD = Rupture(loading_rate=1e8)


def simulate(save=None, **options):
    given = {"problem": make_problem(), "profiles": profile(), "method": METHOD}
    return simulate_rupture(save=save, **given | options)


@pytest.fixture(scope="module")
def held():
    """The run of METHOD, in memory."""
    return simulate()


FALLING = [[0.0, 1e-3, 2e-3, 3e-3], [0.0, 5e5, 4e5, 2e6]]
METHOD_MISTAKES = {
    "loading_rate": {"loading_rate": 0.0},
    "loading_rate ... nan": {"loading_rate": float("nan")},
    "did you mean 'loading_rate'": {"loading_rat": 1e7},
    "loading_rate: give either loading_rate or load": {},
    "give either loading_rate or load": {"loading_rate": 1e7, "load": ([0.0, 1.0], [0.0, 1e7])},
    "stop": {"loading_rate": 1e7, "stop": "never"},
    "end_time: needed with stop='time'": {"loading_rate": 1e7, "stop": "time"},
    "end_time": {"loading_rate": 1e7, "end_time": "1"},
    "arrival": {"loading_rate": 1e7, "arrival": 0.0},
    "times must begin at 0 s and increase": {"load": ([0.0, 1.0, 0.5], [0.0, 1e5, 2e6])},
    "must be finite": {"load": ([0.0, 1.0], [0.0, np.nan])},
    "equally long": {"load": ([0.0, 1.0], [0.0])},
    "load: must be two arrays of numbers": {"load": 3.0},
    "two arrays": {"load": lambda t: 1e8 * t},
    "event_drop": {"event_drop": 1e-3},
}
SAVE_MISTAKES = {
    "every": {"every": 0},
    "to": {"to": 3},
    "fields": {"fields": None},
    "fields ... 1": {"fields": [1]},
    "did you mean 'slip_rate'": {"fields": ["slip_rat"]},
}
RUN_MISTAKES = {
    "progress": {"progress": 3},
    "Rupture": {"method": st.LocalCriterion()},
    "one sample at a time": {"profiles": np.stack([profile()] * 2)},
    "not after the start": {"method": Rupture(loading_rate=1e8, end_time=1e-9)},
    "goes down at t = 0.001": {"method": Rupture(load=FALLING)},
    "first slip needs": {"method": Rupture(load=([0.0, 1.0], [1e5, 1e5]))},
}


@pytest.mark.parametrize(
    ("call", "words", "options"),
    [
        (call, words, options)
        for call, table in (
            (Rupture, METHOD_MISTAKES),
            (st.Save, SAVE_MISTAKES),
            (simulate, RUN_MISTAKES),
        )
        for words, options in table.items()
    ],
)
def test_a_mistake_is_named(call, words, options):
    refuses(words, lambda: call(**options))


@pytest.mark.filterwarnings("ignore::stiction.UnitWarning")
def test_a_weakening_rate_next_to_nothing_is_refused():
    """A denormal rate: no critical slip can be a number then."""
    friction = st.LinearWeakening(weakening_rate=5e-324)
    problem = dataclasses.replace(make_problem(), friction=friction)
    refuses("infinitely much slip", lambda: simulate(problem=problem))


def test_unstable_time_step_is_refused_with_the_limit():
    problem = make_problem()
    limit = METHOD.medium(problem).largest_step
    # 0.42 dx/c_s at this solid; the limit is found by bisection to 0.1 %.
    expected = 0.416 * problem.interface.spacing / STRESS.shear_wave_speed
    assert limit == pytest.approx(expected, rel=5e-3)
    with pytest.raises(InputError, match=f"stability limit {limit:.6g} s"):
        Rupture(loading_rate=1e7, time_step=1.01 * limit).prepare(problem)
    Rupture(loading_rate=1e7, time_step=0.99 * limit).prepare(problem)


@pytest.mark.parametrize(
    ("mode", "ratio", "plane", "courant"),
    [("II", 0.0, "strain", 0.56), ("II", 0.33, "stress", 0.42), ("III", 0.25, "strain", 0.99)],
)
def test_stability_limits(mode, ratio, plane, courant):
    solid = st.Solid(shear_modulus=1.0, poisson_ratio=ratio, density=1.0, plane=plane)
    line, friction = (
        st.Interface(length=64.0, nodes=64),
        st.LinearWeakening(weakening_rate=0.05),
    )
    problem = st.Problem(solid, line, friction, mode=mode)
    # The figures are known to two digits.
    assert METHOD.medium(problem).largest_step == pytest.approx(courant, abs=0.006)


def test_a_coarse_grid_warns_with_the_error_to_expect():
    for nodes, text in (
        (48, "7.4 nodes; .*: expect more than 15 %"),
        (80, "expect up to 6 %"),
    ):
        problem = make_problem(nodes=nodes)
        with pytest.warns(AccuracyWarning, match=text):
            METHOD.prepare(problem)(problem.sample(profile(nodes)))


def test_a_run_in_a_folder_is_the_one_in_memory(held, tmp_path, monkeypatch):
    folder = tmp_path / "run"
    monkeypatch.setattr(save_module, "FRAMES", 8)
    result = simulate(st.Save(to=folder))
    read = open_rupture(folder)
    assert len(list(folder.glob("frames-*.nc"))) > 3
    assert "slip" not in result
    for name in held.data_vars:
        assert np.array_equal(read[name].values, held[name].values, equal_nan=True), name
    assert read["slip"].attrs["units"] == "m"
    assert read.attrs["stopped"] == "sliding"
    assert set(open_rupture(folder, fields=["slip"]).data_vars) == set(held.data_vars) - {
        "slip_rate", "shear_stress"
    }  # fmt: skip
    with pytest.raises(InputError, match="no frames"):
        open_rupture(tmp_path)
    with pytest.raises(InputError, match="is not empty and holds no rupture"):
        simulate(st.Save(to=tmp_path))


class Cut(Exception):
    """What a user or a crash interrupts a run with."""


@pytest.mark.parametrize("every", [3, 40])
def test_a_run_cut_short_goes_on_to_the_same_numbers(tmp_path, monkeypatch, every):
    """Wherever it was cut; between frames that lie far apart, steps are stored as well."""
    monkeypatch.setattr(save_module, "FRAMES", 4)
    monkeypatch.setattr(save_module, "_MOST_STEPS", 70)
    kept = {"every": every, "to": tmp_path / "run"}
    whole = simulate(st.Save(**(kept | {"to": None})))
    for most in (150, 40):

        def cut(done, _, most=most):
            if done >= most:
                raise Cut

        with pytest.raises(Cut):
            simulate(st.Save(**kept), progress=cut)
        assert open_rupture(tmp_path / "run").sizes["time"] > 0  # readable as it was left
    for _ in range(2):  # the second reads what has ended
        found = simulate(st.Save(**kept))
        read = open_rupture(tmp_path / "run")
        for name in whole.data_vars:
            assert np.array_equal(read[name].values, whole[name].values, equal_nan=True), name
            if name in found:
                assert np.array_equal(found[name].values, whole[name].values, equal_nan=True), (
                    name
                )
        assert found.attrs["stopped"] == whole.attrs["stopped"]
        assert "critical_stress" in found


def test_damaged_checkpoints_are_refused(tmp_path):
    save = st.Save(to=tmp_path / "run")
    onset = Rupture(loading_rate=1e8, stop="onset")
    simulate(save, method=onset)
    path = tmp_path / "run" / "checkpoint.npz"
    arrays = read_arrays(path)
    np.savez(path, **{name: value for name, value in arrays.items() if name != "memory"})
    without = path.read_bytes()
    for damaged in (without, b"not a checkpoint"):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match="not a readable checkpoint"):
            simulate(save)


def test_full_disk_leaves_what_was_written_readable(tmp_path, monkeypatch):
    folder, written = tmp_path / "run", []
    monkeypatch.setattr(save_module, "FRAMES", 8)
    original = xr.Dataset.to_netcdf

    def to_netcdf(self, path, **options):
        if len(written) == 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        written.append(path)
        return original(self, path, **options)

    monkeypatch.setattr(xr.Dataset, "to_netcdf", to_netcdf)
    with pytest.raises(StoreError, match="the files before it are complete"):
        simulate(st.Save(to=folder))
    assert open_rupture(folder).sizes["time"] >= 24
    assert not list(folder.glob("*.part"))
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match="file"):
        simulate(st.Save(to=tmp_path / "file" / "run"))


def test_a_run_that_blows_up_stops_and_says_where(monkeypatch):
    monkeypatch.setattr("stiction.dynamics.medium.largest_step", lambda *_: 0.02)
    method = Rupture(loading_rate=1e8, implicit=False, stop="time", end_time=10.0)
    with pytest.warns(AccuracyWarning, match=r"non-finite at t = .* s, x = .* m \(node \d+\)"):
        run = simulate(method=method)
    assert run.attrs["stopped"].startswith("not finite")
    assert np.all(np.isfinite(run["slip"].values))


def test_too_few_steps_is_said():
    problem = make_problem()
    with pytest.raises(InputError, match="max_steps: 20 steps"):
        Rupture(loading_rate=1e8, max_steps=20).prepare(problem)(problem.sample(profile()))


def test_stop_conditions_and_progress(held):
    seen = []
    onset = simulate(
        st.Save(every=1),
        method=Rupture(loading_rate=1e8, stop="onset"),
        progress=lambda done, _: seen.append(done),
    )
    end = float(held["time"][-1]) + 1e-5
    longer = simulate(method=Rupture(loading_rate=1e8, stop="time", end_time=end))
    assert onset.attrs["stopped"] == "onset"
    assert float(onset["weakened_fraction"][-1]) < 1.0
    assert held.attrs["stopped"] == "sliding"
    assert longer.attrs["stopped"] == "time"
    assert float(longer["time"][-1]) >= end
    assert float(longer["critical_stress"]) == float(held["critical_stress"])
    assert seen == sorted(seen)
    assert seen[-1] == onset.sizes["step"]
    assert set(METHOD.variables(make_problem())) <= set(held)


KERNEL = ("III", 1.0, 1e-3)


def built_again():
    """Return the kernel as a process that begins finds it."""
    kernel_sum.cache_clear()
    return kernel_sum(*KERNEL)


def test_cache_that_cannot_be_written_is_kept_in_memory(tmp_path, monkeypatch, caplog):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("STICTION_CACHE_DIR", str(blocked))
    with caplog.at_level(logging.INFO, logger="stiction"):
        first = built_again()
    assert kernel_sum(*KERNEL) is first
    assert caplog.text.count("cannot write the kernel cache") == 1


def test_a_damaged_cache_file_is_built_again(tmp_path, monkeypatch):
    monkeypatch.setenv("STICTION_CACHE_DIR", str(tmp_path))
    first = built_again()
    (path,) = tmp_path.iterdir()
    path.write_bytes(path.read_bytes()[:50])
    assert np.array_equal(built_again().poles, first.poles)
    assert path.stat().st_size > 500
    for poles, weights in (
        (first.poles, first.weights[1:]),
        (-first.poles, first.weights),
        (np.array(["a"]), np.array(["b"])),
    ):
        np.savez(path, poles=poles, weights=weights, error=0.0)
        assert np.array_equal(built_again().poles, first.poles)


def test_load_by_samples_and_by_rate_agree():
    whole, pieces = {"loading_rate": 1e8}, {"load": ([0.0, 5e-3, 2e-2], [0.0, 5e5, 2e6])}
    loads = [
        float(simulate(method=Rupture(stop="onset", **load))["critical_stress"])
        for load in (whole, pieces)
    ]
    # The same straight line in other pieces: only rounding differs, and it may tip a step size.
    assert loads[1] == pytest.approx(loads[0], rel=1e-5)


def test_a_run_killed_after_its_last_frame_takes_no_further_step(tmp_path, monkeypatch):
    save, whole = st.Save(to=tmp_path / "run"), simulate(st.Save(to=tmp_path / "whole"))
    with monkeypatch.context() as patch:
        patch.setattr("stiction.dynamics.save.Recorder.finish", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            simulate(save)
    assert simulate(save).identical(whole)

"""Mistakes and mishaps: options, load histories, checkpoints, stores, caches."""

import dataclasses
import errno
import logging
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

import stiction as st
from stiction import AccuracyWarning, InputError
from stiction.dynamics import method as method_module
from stiction.dynamics.loading import load_history
from stiction.dynamics.method import Rupture
from stiction.dynamics.simulate import simulate_rupture
from stiction.dynamics.stream import open_rupture
from stiction.elasticity.kernel_cache import KernelCache

SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress")
NODES = 128


def make_problem(solid=SOLID, nodes=NODES):
    friction = st.LinearWeakening(weakening_rate=0.2e12)
    return st.Problem(solid, st.Interface(length=0.05, nodes=nodes), friction)


def profile(nodes=NODES):
    x = np.arange(nodes) / nodes
    return 1e6 - 2e5 * np.cos(2 * np.pi * x) + 5e4 * np.sin(10 * np.pi * x)


METHOD = Rupture(loading_rate=1e8)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), "fast"])
def test_loading_rate_must_be_positive(rate):
    with pytest.raises(InputError, match="loading_rate"):
        Rupture(loading_rate=rate)


def test_unknown_option_offers_the_nearest():
    with pytest.raises(InputError, match="did you mean 'loading_rate'"):
        Rupture(loading_rat=1e7)


def test_unstable_time_step_is_refused_with_the_limit():
    problem = make_problem()
    limit = Rupture(loading_rate=1e7).medium(problem).largest_step
    # 0.42 dx/c_s at this solid; the limit is found by bisection to 0.1 %.
    expected = 0.416 * problem.interface.spacing / SOLID.shear_wave_speed
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
    problem = st.Problem(
        solid,
        st.Interface(length=64.0, nodes=64),
        st.LinearWeakening(weakening_rate=0.05),
        mode=mode,
    )
    # The figures are known to two digits.
    assert Rupture(loading_rate=1.0).medium(problem).largest_step == pytest.approx(
        courant, abs=0.006
    )


def test_poisson_ratio_above_the_range_is_refused():
    solid = dataclasses.replace(SOLID, poisson_ratio=0.495, plane="strain")
    with pytest.raises(InputError, match=r"poisson_ratio.*0\.49.*0\.495"):
        METHOD.prepare(make_problem(solid))


def test_a_coarse_grid_warns_with_the_error_to_expect():
    for nodes, text in ((48, "spans 7.4 nodes: expect more than 15 %"), (80, "expect up to 6 %")):
        problem = make_problem(nodes=nodes)
        with pytest.warns(AccuracyWarning, match=text):
            METHOD.prepare(problem)(problem.sample(profile(nodes)))


@pytest.mark.parametrize(
    ("load", "end", "text"),
    [
        (([0.0, 1e-3, 2e-3, 3e-3], [0.0, 5e5, 4e5, 2e6]), None, "goes down at t = 0.001"),
        (([0.0, 1.0], [0.0, 1e5]), 0.5, "end_time"),
        (([0.0, 1.0], [1e5, 1e5]), None, "first slip needs"),
        (([0.0, 1.0, 0.5], [0.0, 1e5, 2e6]), None, "times must begin at 0 s and increase"),
        (([0.0, 1.0], [0.0, np.nan]), None, "must be finite"),
        (([0.0, 1.0], [0.0]), None, "equally long"),
        (3.0, None, "callable"),
        (lambda t: 1e8 * t, None, "end_time: needed"),
        (lambda t: float("nan"), 1.0, "returns nan"),
    ],
)
def test_load_histories_that_cannot_be(load, end, text):
    with pytest.raises(InputError, match=text):
        simulate_rupture(make_problem(), profile(), method=METHOD, load=load, end_time=end)


def test_a_callable_load_follows_its_curve():
    times, values = load_history(lambda t: 1e6 * np.sin(t), 3.0)
    t = np.linspace(0.0, 3.0, 999)
    assert np.abs(np.interp(t, times, values) - 1e6 * np.sin(t)).max() < 1.0  # 1e-6 of the range


def test_load_by_callable_samples_and_rate_agree():
    problem = make_problem()
    runs = [
        simulate_rupture(problem, profile(), method=METHOD, stop="onset", **load)
        for load in (
            {},
            {"load": ([0.0, 5e-3, 2e-2], [0.0, 5e5, 2e6])},
            {"load": lambda t: 1e8 * t, "end_time": 0.02},
        )
    ]
    loads = [float(run["critical_stress"]) for run in runs]
    # The same straight line in other pieces: only rounding differs, and it may tip a step size.
    assert loads[1:] == pytest.approx([loads[0]] * 2, rel=1e-5)


def test_wrong_options_are_all_named():
    with pytest.raises(InputError) as caught:
        simulate_rupture(
            make_problem(), profile(), method=METHOD, every=0, stop="never", end_time=-1.0
        )
    text = str(caught.value)
    assert "every:" in text
    assert "stop:" in text
    assert "end_time:" in text
    with pytest.raises(InputError, match="did you mean 'slip_rate'"):
        simulate_rupture(make_problem(), profile(), method=METHOD, variables=["slip_rat"])
    with pytest.raises(InputError, match="one sample at a time"):
        simulate_rupture(make_problem(), np.stack([profile()] * 2), method=METHOD)
    with pytest.raises(InputError, match="Rupture"):
        simulate_rupture(make_problem(), profile(), method=st.LocalCriterion())
    with pytest.raises(InputError, match="not after the start"):
        simulate_rupture(make_problem(), profile(), method=METHOD, end_time=1e-9)


def test_checkpoint_of_another_run_is_refused_by_name(tmp_path):
    problem, path = make_problem(), tmp_path / "state.npz"
    simulate_rupture(problem, profile(), method=METHOD, stop="onset", checkpoint=path)
    other = profile()
    other[3] += 1.0
    with pytest.raises(InputError, match=r"peak strength \(Pa\): entry 3"):
        simulate_rupture(problem, other, method=METHOD, restart=path)
    with pytest.raises(InputError, match=r"load history \(Pa\): entry 1 is 1e\+08 .* 2e\+08 here"):
        simulate_rupture(problem, profile(), method=Rupture(loading_rate=2e8), restart=path)
    with pytest.raises(InputError, match="number of nodes: 128 in the checkpoint, 256 here"):
        simulate_rupture(make_problem(nodes=256), profile(256), method=METHOD, restart=path)
    with np.load(path) as data:
        arrays = dict(data)
    np.savez(path, **(arrays | {"format": 99}))
    with pytest.raises(InputError, match="format version 99, this version reads 6"):
        simulate_rupture(problem, profile(), method=METHOD, restart=path)
    path.write_bytes(b"not a checkpoint")
    with pytest.raises(InputError, match="not a readable checkpoint"):
        simulate_rupture(problem, profile(), method=METHOD, restart=path)
    with pytest.raises(InputError, match="there is no checkpoint"):
        simulate_rupture(problem, profile(), method=METHOD, restart=tmp_path / "none.npz")


def test_restarted_simulation_continues_the_fields_exactly(tmp_path):
    problem, path = make_problem(), tmp_path / "state.npz"
    whole = simulate_rupture(problem, profile(), method=METHOD)
    first = simulate_rupture(problem, profile(), method=METHOD, stop="onset", checkpoint=path)
    rest = simulate_rupture(problem, profile(), method=METHOD, restart=path)
    steps = np.r_[first["step_time"].values, rest["step_time"].values]
    assert np.array_equal(steps, whole["step_time"].values)
    assert np.array_equal(rest["slip"].values[-1], whole["slip"].values[-1])
    assert np.array_equal(rest["arrival_time"].values, whole["arrival_time"].values)


def test_streamed_run_equals_the_one_in_memory(tmp_path):
    problem, folder = make_problem(), tmp_path / "run"
    held = simulate_rupture(problem, profile(), method=METHOD)
    result = simulate_rupture(problem, profile(), method=METHOD, store=folder, chunk=8)
    read = open_rupture(folder)
    assert len(list(folder.glob("frames-*.nc"))) > 3
    assert "slip" not in result
    for name in ("slip", "shear_stress", "load", "step_mean_stress"):
        assert np.array_equal(read[name].values, held[name].values), name
    assert read["slip"].attrs["units"] == "m"
    with pytest.raises(InputError, match="exists and is not empty"):
        simulate_rupture(problem, profile(), method=METHOD, store=folder)
    with pytest.raises(InputError, match="not a streamed rupture"):
        open_rupture(tmp_path)


def test_streamed_run_can_be_cut_short_and_restarted(tmp_path):
    problem, folder, path = make_problem(), tmp_path / "run", tmp_path / "state.npz"
    held = simulate_rupture(problem, profile(), method=METHOD)

    class Cut(Exception):
        pass

    def cut(progress):
        if progress.weakened_fraction > 0.3:
            raise Cut

    options = {"store": folder, "chunk": 8, "checkpoint": path, "checkpoint_every": 30}
    with pytest.raises(Cut):
        simulate_rupture(problem, profile(), method=METHOD, progress=cut, **options)
    assert open_rupture(folder).sizes["time"] > 8  # readable as it was left
    simulate_rupture(problem, profile(), method=METHOD, restart=path, **options)
    read = open_rupture(folder)
    assert np.array_equal(read["step_time"].values, held["step_time"].values)
    assert np.array_equal(read["slip"].values[-1], held["slip"].values[-1])


def test_full_disk_leaves_what_was_written_readable(tmp_path, monkeypatch):
    problem, folder = make_problem(), tmp_path / "run"
    written = []
    original = xr.Dataset.to_netcdf

    def to_netcdf(self, path, **options):
        if len(written) == 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        written.append(path)
        return original(self, path, **options)

    monkeypatch.setattr(xr.Dataset, "to_netcdf", to_netcdf)
    with pytest.raises(OSError, match="the 3 chunks before it are complete"):
        simulate_rupture(problem, profile(), method=METHOD, store=folder, chunk=8)
    assert open_rupture(folder).sizes["time"] >= 24
    assert not list(folder.glob("*.tmp"))


def test_a_run_that_blows_up_stops_and_says_where(monkeypatch):
    problem = make_problem()
    monkeypatch.setattr("stiction.dynamics.discretization.courant_limit", lambda *_: 40.0)
    with pytest.warns(AccuracyWarning, match=r"non-finite at t = .* s, x = .* m \(node \d+\)"):
        run = simulate_rupture(
            problem, profile(), method=Rupture(loading_rate=1e8, implicit=False), stop="time",
            end_time=10.0,
        )  # fmt: skip
    assert run.attrs["stopped"].startswith("not finite")
    assert np.all(np.isfinite(run["slip"].values))


def test_too_few_steps_is_said():
    problem = make_problem()
    with pytest.raises(InputError, match="max_steps: 20 steps"):
        Rupture(loading_rate=1e8, max_steps=20).prepare(problem)(problem.sample(profile()))


def test_stop_conditions_and_progress():
    problem, seen = make_problem(), []
    onset = simulate_rupture(
        problem, profile(), method=METHOD, stop="onset", progress=seen.append, every_near_onset=1
    )
    sliding = simulate_rupture(problem, profile(), method=METHOD)
    longer = simulate_rupture(
        problem, profile(), method=METHOD, stop="time",
        end_time=float(sliding["time"][-1]) + 1e-5,
    )  # fmt: skip
    assert onset.attrs["stopped"] == "onset"
    assert float(onset["weakened_fraction"][-1]) < 1.0
    assert sliding.attrs["stopped"] == "sliding"
    assert longer.attrs["stopped"] == "time"
    assert float(longer["time"][-1]) >= float(sliding["time"][-1]) + 1e-5
    assert float(longer["critical_stress"]) == float(sliding["critical_stress"])
    assert [p.steps for p in seen] == sorted(p.steps for p in seen)
    assert set(method_module.Rupture(loading_rate=1.0).variables(problem)) - set(sliding) == set()


def test_two_processes_build_one_kernel_at_once(tmp_path):
    code = (
        "from stiction.elasticity.kernel_cache import kernel_sum;"
        "k = kernel_sum('III', 1.0, 1e-4, 1e3);"
        "print(k.poles.size, repr(k.error))"
    )
    import os

    environment = dict(os.environ, STICTION_CACHE_DIR=str(tmp_path))
    pair = [
        subprocess.Popen(
            [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True
        )
        for _ in range(2)
    ]
    outputs = [process.communicate()[0] for process in pair]
    assert all(process.returncode == 0 for process in pair)
    assert outputs[0] == outputs[1] != ""
    assert len(list(tmp_path.iterdir())) == 1


def test_cache_that_cannot_be_written_is_kept_in_memory(tmp_path, monkeypatch, caplog):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("STICTION_CACHE_DIR", str(blocked))
    cache = KernelCache()
    with caplog.at_level(logging.INFO, logger="stiction"):
        first = cache.kernel_sum("III", 1.0, 1e-3, 1e3)
        cache.kernel_sum("III", 1.0, 1e-4, 1e3)
    assert cache.kernel_sum("III", 1.0, 1e-3, 1e3) is first
    assert caplog.text.count("cannot write the kernel cache") == 1


def test_damaged_cache_file_is_built_again(tmp_path, monkeypatch):
    monkeypatch.setenv("STICTION_CACHE_DIR", str(tmp_path))
    first = KernelCache().kernel_sum("III", 1.0, 1e-3, 1e3)
    (path,) = tmp_path.iterdir()
    path.write_bytes(path.read_bytes()[:50])
    second = KernelCache().kernel_sum("III", 1.0, 1e-3, 1e3)
    assert np.array_equal(first.poles, second.poles)
    assert path.stat().st_size > 500

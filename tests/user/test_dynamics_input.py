"""Ruptures as they are stored, resumed and cached; what their scalars mean is in tests/records."""

import dataclasses
import errno
from functools import partial

import numpy as np
import pytest
import xarray as xr
from recording import stored
from refusals import refuses
from ruptures import wavy_line
from setups import make_problem

import stiction as st
from stiction.base.errors import StoreError
from stiction.base.files import read_arrays
from stiction.elasticity.memory_kernels import kernel_sum
from stiction.methods.dynamics import save as save_module
from stiction.methods.dynamics.save import open_rupture
from stiction.random.dotted_keys import with_values

METHOD = st.Rupture(loading_rate=1e8)
PROBLEM, PROFILE = wavy_line()


def simulate(save=None, **options):
    given = {"problem": PROBLEM, "profiles": PROFILE, "method": METHOD}
    return st.simulate_rupture(save=save, **given | options)


def test_a_run_that_blows_up_stops_and_says_where(monkeypatch):
    monkeypatch.setattr("stiction.methods.dynamics.medium.largest_step", lambda *_: 0.02)
    method = st.Rupture(loading_rate=1e8, implicit=False, stop="time", end_time=10.0)
    text = r"non-finite at t = .* s, x = .* m \(node \d+\)"
    with pytest.warns(st.AccuracyWarning, match=text):
        run = simulate(method=method)
    assert run.attrs["stopped"].startswith("not finite")
    assert np.all(np.isfinite(run["slip"].values))


def test_a_run_cut_short_goes_on_to_the_same_numbers(tmp_path, monkeypatch):
    """A run with two events, cut before, between and after them."""
    problem = make_problem(128, 0.05, mode="III", residual_strength=2e5)
    interface = st.Interface(0.05, 128, extent=(0.01, 0.03))
    problem, x = dataclasses.replace(problem, interface=interface), interface.x
    strength = 1e6 - 2e5 * np.exp(-(((x - 0.017) / 0.003) ** 2)) + 1.2e6 * (x > 0.02)
    method = st.Rupture(loading_rate=1e9)
    simulate = partial(st.simulate_rupture, problem, strength)
    monkeypatch.setattr(save_module, "FRAMES_PER_FILE", 6)
    monkeypatch.setattr(save_module, "_MAX_STEPS_PER_FILE", 105)
    folder = tmp_path / "run"
    kept = st.Save(every=40, to=folder)
    whole = simulate(method=method, save=st.Save(every=40))
    assert whole.sizes["event"] == 1
    # Between two frames of the whole run.
    part = simulate(method=dataclasses.replace(method, max_steps=113), save=kept)
    assert part.attrs["stopped"] == "max_steps"
    assert open_rupture(folder).sizes["step"] == 113
    stepping = read_arrays(folder / "checkpoint.npz")["diagnostics"]["stepping"][0]
    steps = stepping["explicit_steps"] + stepping["implicit_steps"]
    assert 113 - 40 <= steps < 113  # little is lost
    for most in (150, 40):

        def cut(done, _, most=most):
            if done >= most:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            simulate(method=method, save=kept, progress=cut)
        assert open_rupture(folder).sizes["time"] > 0  # readable as it was left
    with monkeypatch.context() as patch:  # killed after its last frame
        patch.setattr(save_module.Recorder, "finish", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            simulate(method=method, save=kept)
    for _ in range(2):  # the second reads what has ended
        found = simulate(method=method, save=kept)
        assert found.equals(whole[list(found.data_vars)])
        assert "slip" not in found
    read = open_rupture(folder)
    for name in whole.data_vars:
        assert np.array_equal(read[name], whole[name], equal_nan=True), name
    assert found.attrs["stopped"] == read.attrs["stopped"] == whole.attrs["stopped"]
    assert read["slip"].attrs["units"] == "m"
    some = set(open_rupture(folder, fields=["slip"]).data_vars)
    assert some == set(whole.data_vars) - {"slip_rate", "shear_stress"}


def test_what_is_no_run_of_this_kind(tmp_path):
    """An empty folder, one killed while it wrote its first file, one of others, damaged ones."""
    onset = {"method": st.Rupture(loading_rate=1e8, stop="onset")}
    refuses("no frames", lambda: open_rupture(tmp_path))
    save = st.Save(to=tmp_path / "run")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "checkpoint.npz.1a2b.part").write_bytes(b"half")
    found = simulate(save, **onset)
    assert found.equals(simulate(st.Save(), **onset)[list(found.data_vars)])
    refuses("is not empty and holds no rupture", lambda: simulate(st.Save(to=tmp_path)))
    path = tmp_path / "run" / "checkpoint.npz"
    arrays = read_arrays(path)
    np.savez(path, **{name: value for name, value in arrays.items() if name != "memory"})
    for damaged in (path.read_bytes(), b"not a checkpoint"):
        path.write_bytes(damaged)
        refuses("not a readable checkpoint", lambda: simulate(save, **onset))


OTHERS = stored("other_runs")


def test_a_folder_takes_no_other_run(tmp_path):
    """Whatever differs, but for the number of steps and the distance of frames."""
    few = {"problem": PROBLEM, "method": dataclasses.replace(METHOD, max_steps=20)}
    save, words = st.Save(to=tmp_path / "run"), "holds another run"
    simulate(save, **few)
    for key, value in OTHERS.items():
        refuses(words, partial(simulate, save, **with_values(few, {key: value})))
    for other in ({"fields": ["slip"]}, {"stations": {"a": 0.01}}):
        refuses(words, partial(simulate, dataclasses.replace(save, **other), **few))
    refuses(words, partial(simulate, save, profiles=1.001 * PROFILE, **few))
    more = dataclasses.replace(METHOD, max_steps=30)
    assert simulate(dataclasses.replace(save, every=7), method=more).sizes["step"] == 30


def test_full_disk_leaves_what_was_written_readable(tmp_path, monkeypatch):
    folder, left = tmp_path / "run", iter(range(3))
    monkeypatch.setattr(save_module, "FRAMES_PER_FILE", 8)
    original = xr.Dataset.to_netcdf

    def to_netcdf(*arguments, **options):
        if next(left, None) is None:
            raise OSError(errno.ENOSPC, "No space left on device")
        return original(*arguments, **options)

    monkeypatch.setattr(xr.Dataset, "to_netcdf", to_netcdf)
    refuses("No space left", lambda: simulate(st.Save(to=folder)), StoreError)
    assert open_rupture(folder).sizes["time"] >= 24
    assert not list(folder.glob("*.part"))
    (tmp_path / "file").write_text("")
    refuses("file", lambda: simulate(st.Save(to=tmp_path / "file" / "run")), StoreError)


@pytest.mark.filterwarnings("ignore:cache:UserWarning")
def test_fitted_kernels_are_kept_but_need_no_folder(tmp_path, monkeypatch):
    def built():
        """The kernel as a process that begins finds it."""
        kernel_sum.cache_clear()
        return kernel_sum("III", 1.0, 1e-3)

    blocked, kept = tmp_path / "file", tmp_path / "kept"
    blocked.write_text("")
    monkeypatch.setenv("STICTION_CACHE_DIR", str(blocked))
    first = built()
    assert kernel_sum("III", 1.0, 1e-3) is first
    monkeypatch.setenv("STICTION_CACHE_DIR", str(kept))
    built()
    (path,) = kept.rglob("*.npz")
    whole = path.read_bytes()
    path.write_bytes(whole[:50])  # damaged: it is built again
    assert np.array_equal(built().poles, first.poles)
    assert path.read_bytes() == whole

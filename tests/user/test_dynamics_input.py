"""Ruptures as they are asked for: options, stored runs and their resumption, scalars, caches."""

import dataclasses
import errno

import numpy as np
import pytest
import xarray as xr
from refusals import refuses
from ruptures import CROOKED, CROOKED_STRENGTH, STRESS, wavy_line

import stiction as st
from stiction import Rupture
from stiction.base.errors import StoreError
from stiction.base.files import read_arrays
from stiction.elasticity.exponential_sum import kernel_sum
from stiction.methods.dynamics import save as save_module
from stiction.methods.dynamics.save import open_rupture
from stiction.methods.dynamics.summary import rupture_speed

METHOD = Rupture(loading_rate=1e8)
PROBLEM, PROFILE = wavy_line()


def simulate(save=None, **options):
    given = {"problem": PROBLEM, "profiles": PROFILE, "method": METHOD}
    return st.simulate_rupture(save=save, **given | options)


@pytest.fixture(scope="module")
def held():
    """The run of METHOD, in memory."""
    return simulate()


def same(found, expected):
    for name in found.data_vars:
        assert np.array_equal(found[name], expected[name], equal_nan=True), name
    assert found.attrs["stopped"] == expected.attrs["stopped"]


def test_the_largest_stable_step_is_known():
    limit = METHOD.medium(PROBLEM).largest_step
    # 0.42 dx/c_s at this solid; the limit is found by bisection to 0.1 %.
    expected = 0.416 * PROBLEM.interface.spacing / STRESS.shear_wave_speed
    assert limit == pytest.approx(expected, rel=5e-3)


def test_a_run_that_blows_up_stops_and_says_where(monkeypatch):
    monkeypatch.setattr("stiction.methods.dynamics.medium.largest_step", lambda *_: 0.02)
    method = Rupture(loading_rate=1e8, implicit=False, stop="time", end_time=10.0)
    with pytest.warns(
        st.AccuracyWarning, match=r"non-finite at t = .* s, x = .* m \(node \d+\)"
    ):
        run = simulate(method=method)
    assert run.attrs["stopped"].startswith("not finite")
    assert np.all(np.isfinite(run["slip"].values))


def test_a_run_in_a_folder_is_the_one_in_memory(held, tmp_path, monkeypatch):
    folder = tmp_path / "run"
    monkeypatch.setattr(save_module, "FRAMES", 8)
    result = simulate(st.Save(to=folder))
    read = open_rupture(folder)
    assert len(list(folder.glob("frames-*.nc"))) > 3
    assert "slip" not in result
    same(held, read)
    assert read["slip"].attrs["units"] == "m"
    some = set(open_rupture(folder, fields=["slip"]).data_vars)
    assert some == set(held.data_vars) - {"slip_rate", "shear_stress"}
    refuses("no frames", lambda: open_rupture(tmp_path))
    refuses("is not empty and holds no rupture", lambda: simulate(st.Save(to=tmp_path)))


@pytest.mark.parametrize("every", [25, 40])
def test_a_run_cut_short_goes_on_to_the_same_numbers(tmp_path, monkeypatch, every):
    """Wherever it was cut or ended; between frames far apart, steps are stored as well."""
    monkeypatch.setattr(save_module, "FRAMES", 4)
    monkeypatch.setattr(save_module, "_MOST_STEPS", 70)
    kept = {"every": every, "to": tmp_path / "run"}
    whole = simulate(st.Save(**(kept | {"to": None})))
    # Between two frames of the whole run.
    part = simulate(st.Save(**kept), method=dataclasses.replace(METHOD, max_steps=113))
    assert part.attrs["stopped"] == "max_steps"
    assert open_rupture(tmp_path / "run").sizes["step"] == 113
    now = read_arrays(tmp_path / "run" / "checkpoint.npz")["diagnostics"][0]
    assert 113 - every <= now["explicit_steps"] + now["implicit_steps"] < 113  # little is lost
    for most in (150, 40):

        def cut(done, _, most=most):
            if done >= most:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            simulate(st.Save(**kept), progress=cut)
        assert open_rupture(tmp_path / "run").sizes["time"] > 0  # readable as it was left
    for _ in range(2):  # the second reads what has ended
        found = simulate(st.Save(**kept))
        same(whole, open_rupture(tmp_path / "run"))
        same(found, whole)
        assert "critical_stress" in found


def test_a_run_killed_while_it_wrote_its_first_file_begins_again(tmp_path):
    (tmp_path / "checkpoint.npz.1a2b.part").write_bytes(b"half")
    found = simulate(st.Save(to=tmp_path))
    same(found, simulate(st.Save()))


def test_a_run_killed_after_its_last_frame_takes_no_further_step(tmp_path, monkeypatch):
    save, whole = st.Save(to=tmp_path / "run"), simulate(st.Save(to=tmp_path / "whole"))
    with monkeypatch.context() as patch:
        patch.setattr("stiction.methods.dynamics.save.Recorder.finish", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            simulate(save)
    assert simulate(save).identical(whole)


def test_damaged_checkpoints_are_refused(tmp_path):
    save = st.Save(to=tmp_path / "run")
    simulate(save, method=Rupture(loading_rate=1e8, stop="onset"))
    path = tmp_path / "run" / "checkpoint.npz"
    arrays = read_arrays(path)
    np.savez(path, **{name: value for name, value in arrays.items() if name != "memory"})
    for damaged in (path.read_bytes(), b"not a checkpoint"):
        path.write_bytes(damaged)
        refuses("not a readable checkpoint", lambda: simulate(save))


def test_full_disk_leaves_what_was_written_readable(tmp_path, monkeypatch):
    folder, left = tmp_path / "run", iter(range(3))
    monkeypatch.setattr(save_module, "FRAMES", 8)
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


# What the scalars of a run mean, from its own fields, where everything varies along x.
@pytest.fixture(scope="module")
def run():
    save = st.Save(["slip", "shear_stress", "strength"], every=1)
    return simulate(
        save, problem=CROOKED, profiles=CROOKED_STRENGTH, method=Rupture(loading_rate=1e7)
    )


def test_loads(run):
    profile, initial = CROOKED.load.profile.mean(), CROOKED.load.initial_stress.mean()
    critical = run.critical_stress.item()
    assert critical == run.step_mean_stress.values.max()
    assert run.critical_load.item() == pytest.approx((critical - initial) / profile, rel=1e-12)
    assert run.applied_load.item() > run.critical_load.item()
    stress = run.shear_stress.values.mean(axis=1)
    # Explicit steps know the mean stress to round-off, implicit ones to 1e-9 of the drop.
    np.testing.assert_allclose(run.mean_stress.values, stress, rtol=1e-6)


def test_moment_and_energies(run):
    slip, stress = run.slip.values, run.shear_stress.values
    assert run.seismic_moment.values == pytest.approx(
        1e9 * slip.sum(axis=1) * CROOKED.interface.spacing
    )
    excess = CROOKED_STRENGTH - CROOKED.friction.residual_strength
    gamma = excess**2 / (2 * CROOKED.friction.weakening_rate)
    assert run.fracture_energy.values[-1] == pytest.approx(
        gamma.sum() * CROOKED.interface.spacing
    )
    # Friction and work as integrals over the stored steps, by the trapezoidal rule.
    increments = np.diff(slip, axis=0)
    friction = np.sum(0.5 * (stress[1:] + stress[:-1]) * increments) * CROOKED.interface.spacing
    load = run["load"].values
    mean_load = 0.5 * (load[1:] + load[:-1])[:, None]
    work = np.sum((mean_load * CROOKED.load.profile + CROOKED.load.initial_stress) * increments)
    symbol = 0.5 * CROOKED.effective_modulus * CROOKED.interface.wavenumbers
    pull = np.fft.irfft(symbol * np.fft.rfft(slip[-1]), 128)
    strain = 0.5 * np.sum(pull * slip[-1]) * CROOKED.interface.spacing
    assert run.work.values[-1] == pytest.approx(work * CROOKED.interface.spacing, rel=1e-10)
    assert run.strain_energy.values[-1] == pytest.approx(strain, rel=1e-10)
    # d_c is passed within a step: 1e-3 of friction is seen.
    radiated = work * CROOKED.interface.spacing - friction - strain
    assert run.radiated_energy.values[-1] == pytest.approx(radiated, rel=1e-2)
    found = st.onset(CROOKED, CROOKED_STRENGTH, method=Rupture(loading_rate=1e7, start="rest"))
    for name in ("radiated_energy", "fracture_energy", "seismic_moment"):
        assert found[name].item() == pytest.approx(run[name].values[-1], rel=1e-12)


def test_front_speed_is_that_of_a_front_and_not_where_fronts_meet():
    x = np.arange(64.0)
    away = np.abs((x - 10.0 + 32.0) % 64.0 - 32.0)  # both ways from node 10, around the period
    speed = rupture_speed(away / 3.0, 1.0, 8.0)
    assert np.isnan(speed[[8, 10, 12, 40, 42, 44]]).all()
    known = speed[np.isfinite(speed)]
    assert known.size == 64 - 2 * 7
    assert known == pytest.approx(3.0)


KERNEL = ("III", 1.0, 1e-3)


def built_again():
    """Return the kernel as a process that begins finds it."""
    kernel_sum.cache_clear()
    return kernel_sum(*KERNEL)


def test_cache_that_cannot_be_written_is_kept_in_memory(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("STICTION_CACHE_DIR", str(blocked))
    first = built_again()
    assert kernel_sum(*KERNEL) is first


def test_a_damaged_cache_file_is_built_again(tmp_path, monkeypatch):
    monkeypatch.setenv("STICTION_CACHE_DIR", str(tmp_path))
    first = built_again()
    (path,) = tmp_path.iterdir()
    path.write_bytes(path.read_bytes()[:50])
    assert np.array_equal(built_again().poles, first.poles)
    assert path.stat().st_size > 500

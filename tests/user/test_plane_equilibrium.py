"""st.Equilibrium on planes as a user meets it: what comes back, warnings, refusals, commands."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import stiction as st
from stiction.cli import app

RATE = 0.5e12
LENGTH = 3.46e-3  # nucleation length h_n along x
STUDY = """
[problem.solid]
shear_modulus = 1e9
poisson_ratio = 0.33
density = 1170.0
plane = "strain"
[problem.interface]
length = [0.0208, 0.0156]
nodes = [72, 64]
[problem.friction]
weakening_rate = 0.5e12
"""


def smooth(shape, seed=0, correlation=4.0):
    rng = np.random.default_rng(seed)
    k = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None, :])
    noise = np.fft.rfft2(rng.standard_normal(shape)) * np.exp(-((correlation * k) ** 2))
    field = np.fft.irfft2(noise, shape)
    return 0.7e6 + 1e6 * (field - field.min()) / np.ptp(field)


def plane_of(solid, nodes=(72, 64), length=(0.0208, 0.0156), **friction):
    law = st.LinearWeakening(weakening_rate=RATE, **friction)
    return st.Problem(solid, st.Interface(length, nodes), law)


@pytest.fixture
def plane(solid):
    return plane_of(solid)


def test_what_comes_back(plane):
    method = st.Equilibrium(slip=True, sensitivity=True)
    strength = np.array([smooth((72, 64), seed) for seed in (0, 1)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a fine grid, certified: nothing to be warned of
        found = st.onset(plane, strength, method=method)
    assert set(found.data_vars) == set(method.variables(plane))
    for name, variable in method.variables(plane).items():
        assert found[name].dims == variable.dims
        assert found[name].attrs["units"] == variable.units
    assert list(found["direction"].values) == ["x", "y"]
    assert found["slip"].dims == ("sample", "x", "y")
    assert found["certified"].values.all()
    assert (found["certificate_gap"] <= 1e-6 * found["first_instability"]).all()
    assert "critical_patch_length" not in found
    single = st.onset(plane, strength[1], method=method)
    assert single["critical_load"].item() == found["critical_load"].values[1]


def test_a_coarse_direction_is_warned_of_by_name(solid):
    coarse = plane_of(solid, (96, 36))
    with pytest.warns(st.AccuracyWarning, match=r"in mode III, 5\.3 along y \(better 8"):
        st.onset(coarse, smooth((96, 36)), method=st.Equilibrium())


def test_bounds_that_do_not_close_are_warned_of_with_their_distance(solid, monkeypatch):
    from stiction.equilibrium import transforms

    # As if Newton's method and bisection had got nowhere.
    monkeypatch.setattr(transforms, "close", lambda *a, **k: (False, 0.0))
    monkeypatch.setattr(transforms, "_narrow", lambda *a, **k: 0.0)
    plane = plane_of(solid)
    strength = np.array([smooth((72, 64), seed) for seed in (0, 1)])
    with pytest.warns(st.AccuracyWarning, match=r"2 of 2 samples \(samples 0, 1\).*apart"):
        found = st.onset(plane, strength, method=st.Equilibrium())
    assert (found["certificate_gap"] > 1e-3 * found["first_instability"]).all()


def test_no_certificate_where_the_residual_strength_is_reached_first(solid):
    plane = plane_of(solid, residual_strength=0.69e6)
    strength = smooth((72, 64))
    with pytest.warns(st.AccuracyWarning, match="residual strength before.*no certificate"):
        found = st.onset(plane, strength, method=st.Equilibrium(sensitivity=True, slip=True))
    assert not found["certified"].item()
    assert found["residual_reached"].item()
    assert np.isfinite(found["critical_position"].values).all()
    # Where the residual strength is reached, the peak strength is of no consequence any more.
    residual = found["slip"].values >= (strength - 0.69e6) / RATE
    assert residual.any()
    assert (found["sensitivity"].values[residual] == 0.0).all()


def test_nodes_of_constant_strength(plane):
    strength = smooth((72, 64))
    residual = np.zeros((72, 64))
    residual[10:14, 20:30] = 2e6
    with pytest.warns(st.AccuracyWarning, match="stays as it is"):
        found = st.onset(
            plane,
            {"strength": strength, "residual_strength": residual},
            method=st.Equilibrium(),
        )
    weaker = st.onset(plane, strength, method=st.Equilibrium())
    # Constant strength is more than what weakens from the same peak.
    assert found["first_instability"].item() >= weaker["first_instability"].item() * (
        1.0 - 2e-6
    )
    assert found["arrested_events"].item() == 0
    assert found["certified"].item()


def test_refusals(solid, plane):
    with pytest.raises(st.InputError, match="x and y have changed places"):
        st.onset(plane, smooth((64, 72)), method=st.Equilibrium())
    with pytest.raises(st.InputError, match=r"multiple of four.*74 x 64; take 76 x 64"):
        st.Equilibrium(discretization_error=True).prepare(plane_of(solid, (74, 64)))
    with pytest.raises(st.InputError, match="gap"):
        st.Equilibrium(gap=1.0)


def test_the_sample_that_fails_is_named(plane, monkeypatch):
    from stiction.equilibrium import solver

    real, seen = solver.follow, []

    def second_fails(*arguments):
        seen.append(arguments)
        if len(seen) == 2:
            raise FloatingPointError("singular")
        return real(*arguments)

    monkeypatch.setattr(solver, "follow", second_fails)
    with pytest.raises(FloatingPointError) as caught:
        st.onset(plane, np.array([smooth((72, 64))] * 3), method=st.Equilibrium())
    assert caught.value.__notes__ == ["in sample 1 of the 3 that were solved together"]


def test_labelled_strength(plane):
    strength = smooth((72, 64))
    coords = {name: place * 1e3 for name, place in plane.interface.coordinates.items()}
    labelled = xr.DataArray(
        strength.T / 1e6, dims=("y", "x"), coords=coords, attrs={"units": "MPa"}
    )
    for dim in "xy":
        labelled[dim].attrs["units"] = "mm"
    plain = st.onset(plane, strength, method=st.Equilibrium())
    found = st.onset(plane, labelled, method=st.Equilibrium())
    # A conversion of units rounds.
    assert found["critical_load"].item() == pytest.approx(
        plain["critical_load"].item(), rel=1e-12
    )
    elsewhere = labelled.assign_coords(x=0.9 * labelled["x"])
    elsewhere["x"].attrs["units"] = "mm"
    with pytest.raises(st.InputError, match="x lies elsewhere than the 72 nodes"):
        st.onset(plane, elsewhere, method=st.Equilibrium())


def test_events_and_path_of_a_plane_that_just_slides(plane):
    strength = smooth((72, 64))
    onset = st.onset(plane, strength, method=st.Equilibrium())["critical_load"].item()
    path = st.equilibrium_path(plane, strength, onset * np.array([0.5, 0.99, 1.01]))
    assert path.sizes["event"] == 0
    assert path["event_extent"].dims == ("event", "direction")
    assert list(path["sliding"].values) == [False, False, True]
    assert path["slip"].dims == ("load", "x", "y")
    assert np.isnan(path["slip"].values[2]).all()
    with pytest.raises(st.InputError, match="one sample"):
        st.equilibrium_path(plane, np.array([strength, strength]), [1e5])


def test_command(tmp_path):
    study, profile = tmp_path / "study.toml", tmp_path / "tau.npy"
    study.write_text(STUDY)
    np.save(profile, smooth((72, 64)) * 1e-6)
    run = CliRunner().invoke(
        app,
        ["onset", str(study), "--strength", str(profile), "--unit", "MPa", "--method",
         "equilibrium"],
    )  # fmt: skip
    assert run.exit_code == 0, run.output
    assert "critical_position_x (m)" in run.output
    assert "critical_position_y (m)" in run.output


def test_command_refuses_profiles_of_other_shapes(tmp_path):
    study, profile = tmp_path / "study.toml", tmp_path / "tau.npy"
    study.write_text(STUDY)
    np.save(profile, smooth((64, 72)))
    run = CliRunner().invoke(app, ["onset", str(study), "--strength", str(profile)])
    assert "changed places" in str(run.exception)

"""st.Equilibrium on planes as a user meets it: what comes back, warnings, refusals, commands."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import xarray as xr
from refusals import refuses
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


SAMPLES = np.array([smooth((72, 64), seed) for seed in (0, 1)])
STRENGTH = SAMPLES[0]


def onset(plane, strength, **options):
    return st.onset(plane, strength, method=st.Equilibrium(**options))


@pytest.fixture(scope="module")
def found():
    """Two samples with everything that can be asked for; a fine grid, certified: no warning."""
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
    method = st.Equilibrium(slip=True, sensitivity=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return st.onset(plane_of(solid), SAMPLES, method=method)


def test_what_comes_back(plane, found):
    variables = st.Equilibrium(slip=True, sensitivity=True).variables(plane)
    assert set(found.data_vars) == set(variables)
    for name, variable in variables.items():
        assert found[name].dims == variable.dims
        assert found[name].attrs["units"] == variable.units
    assert list(found["direction"].values) == ["x", "y"]
    assert found["slip"].dims == ("sample", "x", "y")
    assert found["certified"].values.all()
    assert (found["certificate_gap"] <= 1e-6 * found["first_instability"]).all()
    assert "critical_patch_length" not in found
    single = onset(plane, SAMPLES[1])
    assert single["critical_load"].item() == found["critical_load"].values[1]


def test_a_coarse_direction_is_warned_of_by_name(solid):
    coarse = plane_of(solid, (96, 36))
    with pytest.warns(
        st.AccuracyWarning, match=r"in mode III, 5\.3 along y; 16 are recommended"
    ):
        onset(coarse, smooth((96, 36)))


def test_bounds_that_do_not_close_are_warned_of_with_their_distance(solid, monkeypatch):
    from stiction.equilibrium import transforms

    # As if Newton's method and bisection had got nowhere.
    monkeypatch.setattr(transforms, "close", lambda *a, **k: (False, 0.0))
    monkeypatch.setattr(transforms, "_narrow", lambda *a, **k: 0.0)
    with pytest.warns(st.AccuracyWarning, match=r"2 of 2 samples \(samples 0, 1\).*apart"):
        found = onset(plane_of(solid), SAMPLES)
    assert (found["certificate_gap"] > 1e-3 * found["first_instability"]).all()


def test_no_certificate_where_the_residual_strength_is_reached_first(solid):
    plane = plane_of(solid, residual_strength=0.69e6)
    with pytest.warns(st.AccuracyWarning, match="residual strength before.*no certificate"):
        found = onset(plane, STRENGTH, sensitivity=True, slip=True)
    assert not found["certified"].item()
    assert found["residual_reached"].item()
    assert np.isfinite(found["critical_position"].values).all()
    # Where the residual strength is reached, the peak strength is of no consequence any more.
    residual = found["slip"].values >= (STRENGTH - 0.69e6) / RATE
    assert residual.any()
    assert (found["sensitivity"].values[residual] == 0.0).all()


def test_nodes_of_constant_strength(plane, found):
    residual = np.zeros((72, 64))
    residual[10:14, 20:30] = 2e6
    with pytest.warns(st.AccuracyWarning, match="strength is constant"):
        held = onset(plane, {"strength": STRENGTH, "residual_strength": residual})
    # Constant strength is more than what weakens from the same peak.
    weaker = found["first_instability"].values[0]
    assert held["first_instability"].item() >= weaker * (1.0 - 2e-6)
    assert held["arrested_events"].item() == 0
    assert held["certified"].item()


def labelled(plane):
    coords = {name: place * 1e3 for name, place in plane.interface.coordinates.items()}
    array = xr.DataArray(
        STRENGTH.T / 1e6, dims=("y", "x"), coords=coords, attrs={"units": "MPa"}
    )
    for dim in "xy":
        array[dim].attrs["units"] = "mm"
    return array


def test_refusals(solid, plane):
    elsewhere = labelled(plane).assign_coords(x=900.0 * plane.interface.x)
    elsewhere["x"].attrs["units"] = "mm"
    odd = plane_of(solid, (74, 64))
    refuses("x and y are swapped", lambda: onset(plane, STRENGTH.T))
    refuses("x does not coincide with the 72 nodes", lambda: onset(plane, elsewhere))
    refuses("one sample", lambda: st.equilibrium_path(plane, SAMPLES, [1e5]))
    refuses("gap", lambda: st.Equilibrium(gap=1.0))
    refuses(
        "multiple of four ... 74 x 64; take 76 x 64",
        lambda: st.Equilibrium(discretization_error=True).prepare(odd),
    )


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


def test_labelled_strength(plane, found):
    # A conversion of units rounds.
    assert onset(plane, labelled(plane))["critical_load"].item() == pytest.approx(
        found["critical_load"].values[0], rel=1e-12
    )


def test_events_and_path_of_a_plane_that_just_slides(plane, found):
    load = found["critical_load"].values[0]
    path = st.equilibrium_path(plane, STRENGTH, load * np.array([0.5, 0.99, 1.01]))
    assert path.sizes["event"] == 0
    assert path["event_extent"].dims == ("event", "direction")
    assert list(path["sliding"].values) == [False, False, True]
    assert path["slip"].dims == ("load", "x", "y")
    assert np.isnan(path["slip"].values[2]).all()


def test_command(tmp_path):
    study, profile = tmp_path / "study.toml", tmp_path / "tau.npy"
    study.write_text(STUDY)
    ask = ["onset", str(study), "--strength", str(profile), "--unit", "MPa", "--method"]
    np.save(profile, STRENGTH * 1e-6)
    run = CliRunner().invoke(app, [*ask, "equilibrium"])
    assert run.exit_code == 0, run.output
    assert "critical_position_x (m)" in run.output
    assert "critical_position_y (m)" in run.output
    np.save(profile, STRENGTH.T * 1e-6)
    run = CliRunner().invoke(app, [*ask, "equilibrium"])
    assert "are swapped" in str(run.exception)

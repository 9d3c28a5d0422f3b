"""Planes as a user meets them: results, warnings, refusals, study files, commands, figures."""

import dataclasses
import functools
import warnings

import numpy as np
import pytest
import tomli_w
import xarray as xr
from PIL import Image
from refusals import refusals
from setups import RATE, make_problem, smooth_noise
from small_study import lengths, small_study

import stiction as st
from stiction.methods.equilibrium import solver
from stiction.methods.equilibrium.sample import Jump, Outcome
from stiction.methods.equilibrium.transforms import plane as program
from stiction.methods.equilibrium.transforms.relaxation import Relaxed


def smooth(shape, seed=0):
    return 0.7e6 + 1e6 * smooth_noise(4.0, np.random.default_rng(seed), shape)


def plane_of(nodes=(72, 64), **friction):
    return make_problem(nodes, (0.0208, 0.0156), weakening_rate=RATE, **friction)


PLANE = plane_of()
SAMPLES = np.array([smooth((72, 64), seed) for seed in (0, 1)])
STRENGTH = SAMPLES[0]


def onset(strength=SAMPLES, plane=PLANE, **options):
    return st.onset(plane, strength, method=st.Equilibrium(**options))


@pytest.fixture(scope="module")
def found():
    """Two samples with everything that can be asked for; a fine grid, certified: no warning."""
    with warnings.catch_warnings(action="error"):
        return onset(slip=True, sensitivity=True)


def test_what_comes_back(found):
    variables = st.Equilibrium(slip=True, sensitivity=True).variables(PLANE)
    assert set(found.data_vars) == {*variables, "critical_force", "first_instability_force"}
    for name, variable in variables.items():
        assert found[name].dims == variable.dims
        assert found[name].attrs["units"] == variable.units
    assert list(found["direction"].values) == ["x", "y"]
    assert found["slip"].dims == ("sample", "x", "y")
    assert found["certified"].values.all()
    assert (found["certificate_gap"] <= 1e-6 * found["first_instability"]).all()
    assert "critical_patch_length" not in found
    assert onset(SAMPLES[1])["critical_load"].item() == found["critical_load"].values[1]


def test_bounds_that_do_not_close_are_warned_of_with_their_distance(monkeypatch):
    # As if Newton's method and bisection had got nowhere.
    monkeypatch.setattr(program, "close", lambda *a, **k: (False, 0.0))
    monkeypatch.setattr(program, "_narrow", lambda *a, **k: 0.0)
    with pytest.warns(st.AccuracyWarning, match=r"2 of 2 samples \(0, 1\).*apart"):
        found = onset()
    assert (found["certificate_gap"] > 1e-3 * found["first_instability"]).all()


def test_no_certificate_where_the_residual_strength_is_reached_first():
    plane = plane_of(residual_strength=0.69e6)
    with pytest.warns(st.AccuracyWarning, match="residual strength before.*no certificate"):
        found = onset(STRENGTH, plane, sensitivity=True, slip=True)
    assert not found["certified"].item()
    assert found["residual_reached"].item()
    assert np.isfinite(found["critical_position"].values).all()
    # Where the residual strength is reached, the peak strength is of no consequence any more.
    residual = found["slip"].values >= (STRENGTH - 0.69e6) / RATE
    assert residual.any()
    assert (found["sensitivity"].values[residual] == 0.0).all()


def test_a_path_that_is_lost_is_warned_of(monkeypatch, found):
    """In its first jump, before it, or after a jump that came to rest."""
    follow_on = program.PlaneProgram.next

    def path_lost(*given):
        return dataclasses.replace(follow_on(*given), unstable=False, known=False)

    def at_rest(own, sample, state):
        monkeypatch.setattr(program.PlaneProgram, "next", path_lost)
        return Jump(True, True, state)

    for owner, name, lost in (
        (program, "least_equilibrium", lambda *given: Relaxed(Outcome.UNDECIDED, given[3])),
        (program.PlaneProgram, "next", path_lost),
        (program.PlaneProgram, "jump", at_rest),
    ):
        monkeypatch.setattr(owner, name, lost)
        text = r"not followed .* in 1 of 1 samples \(0\): .* a lower bound"
        with pytest.warns(st.AccuracyWarning, match=text):
            ends = onset(STRENGTH)
        monkeypatch.undo()
        assert ends["critical_load"].item() >= found["critical_load"].values[0]


def test_nodes_of_constant_strength(found):
    residual = np.zeros((72, 64))
    residual[10:14, 20:30] = 2e6
    with pytest.warns(st.AccuracyWarning, match="strength is constant"):
        held = onset({"strength": STRENGTH, "residual_strength": residual})
    # Constant strength is more than what weakens from the same peak.
    weaker = found["first_instability"].values[0]
    assert held["first_instability"].item() >= weaker * (1.0 - 2e-6)
    assert held["arrested_events"].item() == 0
    assert held["certified"].item()


def labelled(scale=1e3):
    """The strength in MPa over places in mm."""
    coords = {
        name: (name, scale * place, {"units": "mm"})
        for name, place in PLANE.interface.coordinates.items()
    }
    return xr.DataArray(STRENGTH.T / 1e6, coords, ("y", "x"), attrs={"units": "MPa"})


def rupture(**options):
    return st.onset(PLANE, STRENGTH, method=st.Rupture(loading_rate=1e8, **options))


STIFF = st.Solid(shear_modulus=1e9, poisson_ratio=0.495, density=1170.0)
test_refusals = refusals({
    "x and y are swapped": lambda: onset(STRENGTH.T),
    "x does not coincide with the 72 nodes": lambda: onset(labelled(900.0)),
    "one sample": lambda: st.equilibrium_path(PLANE, SAMPLES, [1e5]),
    "mode II needs nu <= 0.49": lambda: st.Rupture(loading_rate=1e8).prepare(
        make_problem((72, 64), (0.0208, 0.0156), solid=STIFF)
    ),
})  # fmt: skip


def test_the_sample_that_fails_is_named(monkeypatch):
    real, seen = solver.follow, []

    def second_fails(*arguments):
        seen.append(arguments)
        if len(seen) == 2:
            raise FloatingPointError("singular")
        return real(*arguments)

    monkeypatch.setattr(solver, "follow", second_fails)
    with pytest.raises(FloatingPointError) as caught:
        onset(SAMPLES[[0, 1, 0]])
    assert caught.value.__notes__ == ["in sample 1 of the 3 that were solved together"]


def test_labelled_strength_and_the_path_of_a_plane_that_just_slides(found):
    load = found["critical_load"].values[0]
    # A conversion of units rounds.
    assert onset(labelled())["critical_load"].item() == pytest.approx(load, rel=1e-12)
    path = st.equilibrium_path(PLANE, STRENGTH, load * np.array([0.5, 0.99, 1.01]))
    assert path.sizes["event"] == 0
    assert path["event_extent"].dims == ("event", "direction")
    assert list(path["sliding"].values) == [False, False, True]
    assert path["slip"].dims == ("load", "x", "y")
    assert np.isnan(path["slip"].values[2]).all()


STUDY = small_study(
    nodes=[72, 60],
    length=[0.02, 0.014],
    weakening_rate=RATE,
    ensemble={"samples": 30, "seed": 3, "keep": ["strength"]},
    sweep=lengths(2e-3, 4e-3),
)
STUDY["random"]["strength"] |= {"anisotropy": 1.5, "mean_mode": True}
RUPTURES = small_study(
    nodes=[40, 36],
    length=[0.016, 0.012],
    weakening_rate=RATE,
    correlation_length=2e-3,
    method={"type": "rupture", "loading_rate": 1e8},
    ensemble={"samples": 2, "seed": 4},
)
RUPTURES["problem"]["friction"]["residual_strength"] = 1e5


@pytest.fixture
def written(tmp_path, monkeypatch):
    """Write a study into the folder in which commands run."""
    monkeypatch.chdir(tmp_path)
    return lambda study: (tmp_path / "plane.toml").write_text(tomli_w.dumps(study))


def test_a_study_in_memory_on_disk_and_by_commands(written, runs):
    written(STUDY)
    study = st.Study.from_toml("plane.toml")
    assert st.Study.from_dict(study.to_dict()) == study
    memory = study.run()
    assert memory.critical_position.dims == ("correlation_length", "sample", "direction")
    assert memory.strength.shape == (2, 30, 72, 60)
    runs("check plane.toml", "L / h_n along x      5.787", "L / h_n along y      4.0509")
    runs("run plane.toml --out run")
    runs("status run", "60 of 60")
    xr.testing.assert_equal(memory, st.open_run("run").dataset())
    runs("export run run.nc")
    xr.testing.assert_equal(xr.load_dataset("run.nc"), memory)
    runs("report run")


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_ruptures_on_disk_and_by_commands(written, runs, monkeypatch):
    written(RUPTURES)
    runs("run plane.toml --out run")
    stored = st.open_run("run").dataset()
    assert "rupture_speed" not in stored  # an apparent one, above any speed of waves
    for name in ("critical_position", "median_rupture_speed"):
        assert stored[name].dims == ("sample", "direction")
    assert np.all(stored.stress_drop.values > 5e5)
    monkeypatch.setattr(st.plot, "film", functools.partial(st.plot.film, frames=12))
    words = ("position of the critical patch: ", " and ", "ended by: sliding")
    runs("rupture plane.toml --film --out . --sample 1", *words)
    assert Image.open("rupture.gif").n_frames > 10
    assert Image.open("rupture.png").size[0] > 500
    with xr.open_dataset("rupture.nc") as run:
        assert run.slip_rate.dims == ("time", "x", "y")
        assert run.critical_stress.item() == stored.critical_stress.values[1]
        assert run.arrival_time.dims == ("x", "y")


def test_onset_of_a_profile_of_ones_own(written, runs):
    problem = {
        "solid": STUDY["problem"]["solid"],
        "interface": {"length": [0.0208, 0.0156], "nodes": [72, 64]},
        "friction": {"weakening_rate": RATE},
    }
    written({"problem": problem})
    own = "onset plane.toml --strength tau.npy --unit MPa --method equilibrium"
    np.save("tau.npy", STRENGTH * 1e-6)
    runs(own, "critical_position_x (m)", "critical_position_y (m)")
    np.save("tau.npy", STRENGTH.T * 1e-6)
    runs(own, "are swapped", code=2)


def test_load_of_a_plane_from_a_file(written):
    profile = 1.0 + 0.1 * np.random.default_rng(0).random((72, 60))
    np.save("load.npy", profile)
    np.save("turned.npy", profile.T)
    problem = STUDY["problem"]
    written(STUDY | {"problem": problem | {"load": {"profile": "load.npy"}}})
    study = st.Study.from_toml("plane.toml")
    assert np.array_equal(study.experiments[0].problem.load.profile, profile)
    assert st.Study.from_dict(study.to_dict()) == study
    written(STUDY | {"problem": problem | {"load": {"profile": "turned.npy"}}})
    with pytest.raises(st.InputError, match="load.profile.*x and y are swapped"):
        st.Study.from_toml("plane.toml")


def test_failing_profiles_are_kept():
    plan = st.Study.from_dict(STUDY).experiments[0]
    found = st.failure_probability(
        plan.problem, plan.random, 0.72e6, method=plan.method, algorithm="plain",
        target_cv=0.5, max_evaluations=300,
    )  # fmt: skip
    assert found.failing_profiles.sizes["sample"] >= 2

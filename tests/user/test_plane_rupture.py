"""Ruptures on planes as they are asked for: files, streams, commands, memory, units."""

import functools

import numpy as np
import pytest
import tomli_w
import xarray as xr
from PIL import Image
from small_study import small_study
from typer.testing import CliRunner

import stiction as st
from stiction.cli import app

pytestmark = pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")

STUDY = small_study(
    nodes=[40, 36],
    length=[0.016, 0.012],
    weakening_rate=0.5e12,
    correlation_length=2e-3,
    method={"type": "rupture", "loading_rate": 1e8},
    ensemble={"samples": 3, "seed": 4},
)
STUDY["problem"]["friction"]["residual_strength"] = 1e5


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "plane.toml"
    path.write_text(tomli_w.dumps(STUDY))
    return path


def command(*arguments):
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    assert result.exit_code == 0, result.output
    return result.output


def test_a_stored_study_is_that_in_memory_and_has_units(path, tmp_path):
    command("run", path, "--out", tmp_path / "run")
    stored = st.open_run(tmp_path / "run").dataset()
    direct = st.Study.from_toml(path).run(progress=False)
    for name in direct.data_vars:
        assert np.array_equal(stored[name].values, direct[name].values, equal_nan=True)
    assert direct.seismic_moment.attrs["units"] == "N m"
    assert direct.radiated_energy.attrs["units"] == "J"
    for name in ("critical_position", "rupture_speed", "median_rupture_speed"):
        assert direct[name].dims == ("sample", "direction")
        assert list(direct.direction.values) == ["x", "y"]
    assert np.all(direct.stress_drop.values > 5e5)


def test_the_command_draws_figures_and_a_film(path, tmp_path, monkeypatch):
    monkeypatch.setattr(st.plot, "film", functools.partial(st.plot.film, frames=20))
    out = command("rupture", path, "--film", "--out", tmp_path)
    for text in ("position of the critical patch: ", " and ", "ended by: sliding"):
        assert text in out
    film = Image.open(tmp_path / "rupture.gif")
    assert film.n_frames > 10
    first = np.asarray(film.convert("RGB")).astype(int)
    film.seek(film.n_frames - 1)
    assert np.abs(np.asarray(film.convert("RGB")) - first).max() > 50
    for name in ("rupture.png",):
        assert Image.open(tmp_path / name).size[0] > 500
    with xr.open_dataset(tmp_path / "rupture.nc") as run:
        assert run.slip_rate.dims == ("time", "x", "y")
        assert run.arrival_time.dims == run.front_speed.dims == ("x", "y")


def problem_and_strength(path):
    plan = st.Study.from_toml(path).experiments[0]
    return plan.problem, plan.profiles(plan.draws(0, 1))


def test_an_unstable_step_and_a_solid_without_waves_are_refused(path):
    problem, strength = problem_and_strength(path)
    with pytest.raises(st.InputError, match=r"time_step: .* above the stability limit"):
        st.onset(problem, strength, method=st.Rupture(loading_rate=1e8, time_step=1e-6))
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.495, density=1170.0)
    with pytest.raises(st.InputError, match=r"mode II needs nu <= 0.49"):
        st.onset(
            st.Problem(solid, problem.interface, problem.friction), strength,
            method=st.Rupture(loading_rate=1e8),
        )  # fmt: skip

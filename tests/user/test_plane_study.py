"""A study of a plane from a file: run, stored, exported, drawn and reported like that of a line."""

import csv

import numpy as np
import pytest
import tomli_w
import xarray as xr
from small_study import lengths, small_study
from typer.testing import CliRunner

import stiction as st
from stiction.cli import app

STUDY = small_study(
    nodes=[72, 60],
    length=[0.02, 0.014],
    weakening_rate=0.5e12,
    ensemble={"samples": 30, "seed": 3, "keep": ["strength"]},
    sweep=lengths(2e-3, 4e-3),
)
STUDY["random"]["strength"] |= {"anisotropy": 1.5, "mean_mode": True}


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "plane.toml"
    path.write_text(tomli_w.dumps(STUDY))
    return path


def command(*arguments):
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    assert result.exit_code == 0, result.output
    return result.output


def test_stored_run_is_that_in_memory(path, tmp_path):
    study = st.Study.from_toml(path)
    assert st.Study.from_dict(study.to_dict()) == study
    memory = study.run(progress=False)
    assert memory.critical_position.dims == ("correlation_length", "sample", "direction")
    assert memory.strength.shape == (2, 30, 72, 60)
    stored = study.run(out=tmp_path / "run", progress=False)
    xr.testing.assert_equal(memory, stored)
    xr.testing.assert_equal(memory, st.open_run(tmp_path / "run").dataset())
    field = study.experiments[1].random.strength
    own = field.sample(study.experiments[1].problem.interface, seed=3, first=4)
    assert np.array_equal(own[0], memory.strength[1, 4])
    again = st.onset(study.experiments[1].problem, own, method=st.LocalCriterion())
    assert again.critical_load.item() == memory.critical_load.values[1, 4]


def test_commands(path, tmp_path):
    run = tmp_path / "run"
    text = command("check", path)
    assert "L / h_n along x      5.787" in text
    assert "L / h_n along y      4.0509" in text
    command("run", path, "--out", run)
    assert "60 of 60" in command("status", run)
    command("export", run, tmp_path / "run.csv")
    rows = list(csv.DictReader((tmp_path / "run.csv").open()))
    assert len(rows) == 60
    stored = st.open_run(run).dataset()
    for dim in ("x", "y"):
        found = float(rows[7][f"critical_position_{dim} (m)"])
        assert found == stored.critical_position.sel(direction=dim).values.ravel()[7]
    command("export", run, tmp_path / "run.nc")
    xr.testing.assert_equal(xr.load_dataset(tmp_path / "run.nc"), stored)
    command("report", run)
    assert "30" in (run / "report.html").read_text()


def test_failing_profiles_are_drawn(path):
    plan = st.Study.from_toml(path).experiments[0]
    found = st.failure_probability(
        plan.problem, plan.random, 0.72e6, method=plan.method, algorithm="plain",
        target_cv=0.5, max_evaluations=300, progress=False,
    )  # fmt: skip
    assert found.failing_profiles.sizes["sample"] >= 2
    axes = st.plot.weak_spots(found, problem=plan.problem)
    middle = axes.collections[0].get_array()
    assert middle.min() < 0.9 * middle.mean()


def test_load_of_a_plane_from_a_file(path, tmp_path):
    profile = 1.0 + 0.1 * np.random.default_rng(0).random((72, 60))
    np.save(tmp_path / "load.npy", profile)
    np.save(tmp_path / "turned.npy", profile.T)
    text = tomli_w.dumps(
        STUDY | {"problem": STUDY["problem"] | {"load": {"profile": "load.npy"}}}
    )
    path.write_text(text)
    study = st.Study.from_toml(path)
    assert np.array_equal(study.experiments[0].problem.load.profile, profile)
    assert st.Study.from_dict(study.to_dict()) == study
    path.write_text(text.replace("load.npy", "turned.npy"))
    with pytest.raises(st.InputError, match="load.profile.*x and y are swapped"):
        st.Study.from_toml(path)

"""The command that simulates one rupture."""

import sys

import numpy as np
import pytest
import xarray as xr

import stiction as st
from stiction.cli import app as room

TEXT = """
[problem.solid]
shear_modulus = 1e9
poisson_ratio = 0.33
density = 1170.0
plane = "stress"
[problem.interface]
length = 0.05
nodes = 128
[problem.friction]
weakening_rate = 0.25e12
[random.strength.marginal]
type = "beta"
alpha = 1.5
beta = 3.0
low = 0.66e6
high = 1.66e6
[random.strength.spectrum]
type = "power_law"
correlation_length = 6e-3
[method]
type = "local_criterion"
[ensemble]
samples = 2
seed = 3
"""


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["stiction", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        room.main()
    return ended.value.code


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(TEXT)
    return path


@pytest.mark.slow
def test_writes_result_figures_and_film(monkeypatch, capsys, study, tmp_path):
    out = tmp_path / "rupture"
    assert run(monkeypatch, "rupture", study, "--out", out, "--film", "--sample", 1) == 0
    text = capsys.readouterr().out
    assert "onset at x" in text
    assert "ended by: sliding" in text
    for name in ("rupture.png", "rupture.pdf", "front.png", "front.pdf", "rupture.gif"):
        assert (out / name).stat().st_size > 5000, name
    loaded = st.Study.from_toml(study)
    tau_p = loaded.random.strength.sample(loaded.problem.interface, samples=1, seed=3, first=1)
    with xr.open_dataset(out / "rupture.nc") as result:
        np.testing.assert_array_equal(result.peak_strength, tau_p[0])
        method = st.Rupture(loading_rate=2e7, start="rest")  # as one rupture always begins
        expected = st.onset(loaded.problem, tau_p, method=method)
        assert float(result.critical_stress) == float(expected.critical_stress[0])


def test_mistakes_end_with_a_message(monkeypatch, capsys, study, tmp_path):
    assert run(monkeypatch, "rupture", study, "--out", study) == 2
    assert "--out" in capsys.readouterr().err
    assert run(monkeypatch, "rupture", study, "--out", tmp_path / "r", "--loading-rate", -1) == 2
    assert "loading_rate" in capsys.readouterr().err
    assert run(monkeypatch, "rupture", study, "--out", tmp_path / "r", "--strength", "no.npy") == 2
    assert "no.npy" in capsys.readouterr().err
    assert run(monkeypatch, "rupture", study, "--out", tmp_path / "r", "--sample", -1) == 2

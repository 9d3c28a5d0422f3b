"""The command that simulates one rupture."""

import numpy as np
import pytest
import tomli_w
import xarray as xr
from small_study import small_study

import stiction as st

STUDY = small_study(length=0.05, correlation_length=6e-3, ensemble={"samples": 2, "seed": 3})
STUDY["problem"]["solid"]["plane"] = "stress"


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(tomli_w.dumps(STUDY))
    return path


@pytest.mark.slow
def test_writes_result_figures_and_film(command, study, tmp_path):
    out = tmp_path / "rupture"
    code, text, _ = command("rupture", study, "--out", out, "--film", "--sample", 1)
    assert code == 0
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


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--out", "study.toml"], "--out"),
        (["--loading-rate", -1], "loading_rate"),
        (["--strength", "no.npy"], "no.npy"),
        (["--sample", -1], "--sample"),
    ],
)
def test_mistakes_end_with_a_message(command, study, tmp_path, monkeypatch, options, named):
    monkeypatch.chdir(tmp_path)
    code, _, said = command("rupture", study, "--out", "run", *options)
    assert code == 2
    assert named in said

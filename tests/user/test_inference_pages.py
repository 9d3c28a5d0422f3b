"""What is shown of inference: the page, its data, the command and the examples, as they stand."""

import os
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
DATA = ROOT / "examples" / "data"
PAGE = ROOT / "docs" / "what-do-twenty-five-tests-tell-me.md"


def run_example(name, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    found = runpy.run_path(str(ROOT / "examples" / f"{name}.py"))
    return found, capsys.readouterr().out


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_openturns_works_on_the_limit_state(monkeypatch, tmp_path, capsys):
    pytest.importorskip("openturns")
    found, said = run_example("outside_openturns", monkeypatch, tmp_path, capsys)
    theirs, own = found["found"], found["own"]
    error = np.hypot(theirs.getCoefficientOfVariation(), own.coefficient_of_variation)
    ratio = theirs.getProbabilityEstimate() / own.probability
    assert abs(np.log(ratio)) < 4.0 * error  # joint standard errors
    assert "OpenTURNS" in said


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_dynesty_finds_the_same_posterior(monkeypatch, tmp_path, capsys):
    """Another sampler, likelihood and no affine scaling: 60 live points, two minutes."""
    pytest.importorskip("dynesty")
    found, _ = run_example("outside_dynesty", monkeypatch, tmp_path, capsys)
    for i, name in enumerate(found["names"]):
        own = found["posterior"].draws[name].ravel()
        # Sixty live points leave a tenth of the width; two seeds gave 0.04 to 0.11.
        assert abs(found["draws"][:, i].mean() - own.mean()) < 0.3 * own.std(), name
    # Silverman's kernel widens the variance of 1000 peaks by 750^-0.4, which each of the 25 pays.
    # Nested sampling adds sqrt(information / live points), 0.22 here: three of them.
    smoothing = 0.5 * 25 * np.log1p(750.0**-0.4)
    assert found["evidence"] == pytest.approx(found["posterior"].log_evidence - smoothing, abs=0.66)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_the_page_runs_and_says_what_it_prints(monkeypatch, tmp_path):
    shutil.copy(DATA / "peaks.csv", tmp_path)
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text("utf-8")
    assert "synthetic" in text
    scope = {}
    for block in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL):
        exec(compile(block, PAGE.name, "exec"), scope)
    posterior, told = scope["posterior"], scope["told"].information
    low, high = posterior.interval("marginal.low", 0.99)
    assert low < 0.66e6 < high  # the truth of the data
    low, high = posterior.interval("correlation_length", 0.99)
    assert low < 3.08e-3 < high
    length = told.sel(parameter="correlation_length")
    assert length.sel(design="marginal measured") > length.sel(design="25 tests")
    assert told.sel(parameter="marginal.low", design="25 tests") > length.sel(design="25 tests")


def test_the_data_say_that_they_are_synthetic():
    assert (DATA / "peaks.csv").read_text().startswith("# synthetic")
    assert "Nothing here was measured" in (DATA / "make_peaks.py").read_text()
    assert "synthetic" in (DATA / "tests.toml").read_text()


def command(*arguments, cwd):
    return subprocess.run(
        [sys.executable, "-m", "stiction", *map(str, arguments)],
        cwd=cwd, capture_output=True, text=True, env=os.environ | {"COLUMNS": "100"}, check=False,
    )  # fmt: skip


def small_study(folder, more=""):
    text = (DATA / "tests.toml").read_text()
    text = text.replace("nodes = 512", "nodes = 256")
    text = text.replace("load_cell_error = 4e3", "load_cell_error = 4e3\nsamples = 200")
    (folder / "tests.toml").write_text(text + more)
    return folder / "tests.toml"


@pytest.mark.slow
def test_the_command_writes_a_page(tmp_path):
    study = small_study(tmp_path)
    done = command("infer", study, "--peaks", DATA / "peaks.csv", "--out", "told", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "15 peaks at 0.04 m, 25 peaks at 0.1 m" in done.stdout
    assert "marginal.low" in done.stdout
    assert "nats" in done.stdout
    names = {path.name for path in (tmp_path / "told").iterdir()}
    wanted = {"report.html", "posterior.png", "posterior.pdf", "parameters.csv", "draws.csv"}
    assert wanted <= names
    page = (tmp_path / "told" / "report.html").read_text()
    assert "data:image/png" in page
    draws = np.loadtxt(tmp_path / "told" / "draws.csv", delimiter=",", skiprows=1)
    assert draws.shape == (4000, 3)


def test_the_command_says_what_is_missing(tmp_path):
    text = (DATA / "tests.toml").read_text()
    (tmp_path / "bare.toml").write_text(text[: text.index("[inference]")])
    done = command("infer", "bare.toml", "--peaks", DATA / "peaks.csv", cwd=tmp_path)
    assert done.returncode == 2
    assert "no table [inference]" in done.stderr
    (tmp_path / "odd.toml").write_text(text + "exponent = {type = 'nrm', loc = 4}\n")
    done = command("infer", "odd.toml", "--peaks", DATA / "peaks.csv", cwd=tmp_path)
    assert done.returncode == 2
    assert "inference.prior" in done.stderr
    assert "'nrm'" in done.stderr


def test_a_study_keeps_its_inference(tmp_path):
    import stiction as st

    study = st.Study.from_toml(DATA / "tests.toml")
    assert study.inference.prior["marginal.low"] == [0.4e6, 0.8e6]
    study.to_toml(tmp_path / "again.toml")
    assert st.Study.from_toml(tmp_path / "again.toml") == study
    assert "inference" not in study.attributes["study"]

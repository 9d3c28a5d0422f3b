"""What is shown of inference: the page, its data, the command and the examples, as they stand."""

import re
import runpy
import shutil
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
    error = np.hypot(theirs.getCoefficientOfVariation(), own.cv)
    ratio = theirs.getProbabilityEstimate() / own.probability
    assert abs(np.log(ratio)) < 4.0 * error  # joint standard errors
    assert "OpenTURNS" in said


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_dynesty_finds_the_same_posterior(monkeypatch, tmp_path, capsys):
    """Another sampler, likelihood and no scaling: 60 live points, two minutes."""
    pytest.importorskip("dynesty")
    found, _ = run_example("outside_dynesty", monkeypatch, tmp_path, capsys)
    for i, name in enumerate(found["names"]):
        own = found["posterior"].draws[name].ravel()
        # Sixty live points leave a tenth of the width; two seeds gave 0.04 to 0.11.
        assert abs(found["draws"][:, i].mean() - own.mean()) < 0.3 * own.std(), name
    # Silverman's kernel widens the variance of 1000 peaks by 750^-0.4, which each of the 25 pays.
    # Nested sampling adds sqrt(information / live points), 0.22 here: three of them.
    smoothing = 0.5 * 25 * np.log1p(750.0**-0.4)
    assert found["evidence"] == pytest.approx(
        found["posterior"].log_evidence - smoothing, abs=0.66
    )


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
    posterior, told = scope["posterior"], scope["plans"].information
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

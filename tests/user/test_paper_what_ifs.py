"""The studies of examples/ are valid, and each what-if runs, draws and says what it shows."""

import dataclasses
import importlib
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import stiction as st

EXAMPLES = Path(__file__).parents[2] / "examples"
STUDIES = sorted(EXAMPLES.glob("*.toml"))
pytestmark = pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")


@pytest.fixture(scope="module")
def what_ifs():
    sys.path.insert(0, str(EXAMPLES))
    try:
        yield importlib.import_module("what_ifs")
    finally:
        sys.path.remove(str(EXAMPLES))


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_every_study_is_valid_and_runs(path):
    study = st.Study.from_toml(path)
    assert study.title
    few = dataclasses.replace(study.ensemble, samples=2, keep=(), keep_samples=None)
    result = dataclasses.replace(study, ensemble=few).run()
    stress = result["critical_stress"].values
    assert stress.shape[-1] == 2
    assert np.all(stress > 0.0)


def test_every_what_if_has_a_study_and_a_part(what_ifs):
    names = {path.stem.removeprefix("what_if_") for path in EXAMPLES.glob("what_if_*.toml")}
    assert names == set(what_ifs.PARTS)
    page = (EXAMPLES.parent / "docs" / "what-ifs.md").read_text(encoding="utf-8")
    for name in names:
        assert f"images/what_if_{name}.png" in page
        assert (EXAMPLES.parent / "docs" / "images" / f"what_if_{name}.png").exists()


@pytest.mark.parametrize(
    "name",
    [
        *("skewness", "length", "random_residual", "uniform_dc", "free_end", "plane"),
        pytest.param("correlation", marks=pytest.mark.slow),  # ruptures, too
    ],
)
def test_a_what_if_in_small(what_ifs, name, tmp_path):
    """Six samples: the sentences have numbers, and the figure has ink."""
    title, figure, sentences = what_ifs.run(name, samples=6)
    assert title
    assert len(sentences) >= 3
    assert sum(len(re.findall(r"\d", sentence)) for sentence in sentences) > 3
    assert "nan" not in " ".join(sentences)
    path = tmp_path / "figure.png"
    what_ifs.save(figure, path)
    assert path.stat().st_size > 5000


def test_pictures_of_the_readme(what_ifs, tmp_path):
    """In small: both are drawn, and short correlation means a higher stress."""
    first, last = importlib.import_module("pictures").main(tmp_path, samples=200, nodes=256)
    assert first > last > 0.66
    for name in ("monte_carlo", "rupture"):
        size = (tmp_path / f"{name}.png").stat().st_size
        assert 20_000 < size < 200_000  # a page of text should not weigh more


@pytest.mark.slow
def test_what_ifs_of_the_page(what_ifs):
    """Numbers of docs/what-ifs.md with fewer samples, within their sampling error."""
    page = re.sub(r"\s+", " ", (EXAMPLES.parent / "docs" / "what-ifs.md").read_text("utf-8"))
    _, _, sentences = what_ifs.run("plane")
    assert sentences[0] in page  # moduli are exact
    assert sentences[1] in page  # the same samples, bit by bit
    _, _, sentences = what_ifs.run("free_end")
    assert sentences[1] in page

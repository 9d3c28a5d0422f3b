"""What the pages of docs/ show: python that runs, study files that parse, links, names."""

import re
import runpy
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

import stiction as st

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs").glob("*.md"))


def blocks(page, language):
    """Fenced blocks of a page, without the indentation that they have inside a list."""
    text = (ROOT / page).read_text("utf-8")
    found = re.findall(
        rf"^( *)```{language}\n(.*?)^ *```", text, flags=re.DOTALL | re.MULTILINE
    )
    return [re.sub(rf"^{indent}", "", block, flags=re.MULTILINE) for indent, block in found]


def run_blocks(page, scope, **fewer):
    """Run the python of a page, numbers of samples replaced by smaller ones."""
    for block in blocks(page, "python"):
        for name, value in fewer.items():
            block = re.sub(rf"\b{name}=[\d_]+", f"{name}={value}", block)
        exec(compile(block, page, "exec"), scope)


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_python_of_the_page_on_studies(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    problem = st.paper.problem()
    strength = st.paper.strength(problem)
    tau_p = strength.sample(problem.interface)[0]
    table = np.column_stack([problem.interface.x, tau_p])
    np.savetxt("profile.csv", table, delimiter=",", header="x (m),strength (Pa)", comments="")
    scope = {"st": st, "problem": problem, "strength": strength}
    run_blocks("docs/studies.md", scope, samples=4)
    assert scope["result"]["critical_stress"].dims == ("correlation_length", "length", "sample")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_the_tutorial_from_a_profile_to_a_failure_probability(monkeypatch, tmp_path):
    """Every block and command, with fewer repetitions."""
    page = "docs/tutorials/measured-profile.md"
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "examples" / "data", tmp_path / "examples" / "data")
    scope = {}
    for block in blocks(page, "python"):
        block = block.replace("bootstrap=200", "bootstrap=20").replace("[:20]", "[:2]")
        exec(compile(block.replace("seed=1)", "seed=1, target_cv=0.3)"), page, "exec"), scope)
    fit, truth = scope["fit"], {"mean": 1e6, "noise": 0.03e6, "spectrum.exponent": 2.0}
    for name, value in truth.items():
        assert fit.parameters[name] == pytest.approx(value, rel=0.2)
    assert 0.0 < scope["found"].probability < 0.5
    assert 0.2e6 < scope["design"].stress < 1e6
    joint = st.Problem(
        **tomllib.loads((ROOT / "examples/data/joint.toml").read_text())["problem"]
    )
    assert joint == scope["joint"]


def test_the_tutorials_data_are_what_the_script_makes_and_say_so():
    script = runpy.run_path(str(ROOT / "examples" / "data" / "make_strength_profile.py"))
    text = (ROOT / "examples" / "data" / "strength_profile.csv").read_text("utf-8")
    assert "synthetic" in text.splitlines()[0]
    profile = st.read_profile(ROOT / "examples" / "data" / "strength_profile.csv")
    x, strength = script["record"]()
    np.testing.assert_allclose(profile["x"], 1e-3 * x, atol=1e-9)  # to the digits of the file
    np.testing.assert_allclose(profile, 1e6 * strength, atol=51.0)


@pytest.mark.slow
def test_python_of_the_page_on_reliability():
    """With a failure curve by equilibrium: about a minute."""
    scope = {}
    run_blocks("docs/reliability.md", scope)
    assert 1e-6 < scope["found"].probability < 1e-3


def test_tables_of_study_files():
    """Each is valid TOML; what the page on studies shows of a study makes a valid one."""
    parsed = [tomllib.loads(block) for page in PAGES for block in blocks(page, "toml")]
    assert len(parsed) >= 5
    whole = tomllib.loads((ROOT / "examples" / "paper.toml").read_text())
    whole["method"] = {"type": "equilibrium"}  # the one that can keep slip and sensitivity
    for table in parsed:
        if {"random", "sweep", "ensemble"} & table.keys():
            st.Study.from_dict(whole | table)


def test_links():
    # The entry of the site links pages that are made when it is built, and is checked there.
    for page in [*(p for p in PAGES if p.name != "index.md"), ROOT / "CONTRIBUTING.md"]:
        for target in re.findall(r"\]\((?!http)([^)#]+)", page.read_text("utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_the_glossary_names_what_the_code_names():
    page = (ROOT / "docs" / "conventions.md").read_text("utf-8")
    rows = re.findall(r"^\| (`.*?) \|", page.split("## Glossary")[1], flags=re.MULTILINE)
    names = {name.split(".")[-1] for row in rows for name in re.findall(r"`([\w.]+)`", row)}
    assert len(names) > 50
    code = "\n".join(path.read_text("utf-8") for path in (ROOT / "src").rglob("*.py"))
    words = set(re.findall(r"\w+", code))
    assert names - words == set()


def test_every_path_that_the_pages_name_is_there():
    pattern = r"`((?:examples|validation|benchmarks|tests|docs)/[\w./]+\.\w+)`"
    for page in [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"]:
        for path in re.findall(pattern, page.read_text("utf-8")):
            assert (ROOT / path).exists(), f"{page.name}: {path}"

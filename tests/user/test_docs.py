"""What README.md, docs/ and docstrings show: python that runs, study files, links, names."""

import doctest
import re
import runpy
import shutil
import tomllib
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import stiction as st

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
PAGES = sorted((ROOT / "docs").glob("*.md"))
MORE = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
COMMANDS = (
    "python3 -m venv .venv && .venv/bin/python -m pip install . && .venv/bin/python reproduction",
    'python3 -m venv .venv && .venv/bin/python -m pip install -e ".[test]"'
    " && .venv/bin/python -m pytest",
)


def blocks(page, language):
    """Fenced blocks of a page, without the indentation that they have inside a list."""
    text = (ROOT / page).read_text("utf-8")
    found = re.findall(
        rf"^( *)```{language}\n(.*?)^ *```", text, flags=re.DOTALL | re.MULTILINE
    )
    return [re.sub(rf"^{indent}", "", block, flags=re.MULTILINE) for indent, block in found]


def run_blocks(page, scope, **less):
    """Run the python of a page, some of its words replaced."""
    for block in blocks(page, "python"):
        for words, other in less.items():
            block = re.sub(words, other, block)
        exec(compile(block, page, "exec"), scope)
    return scope


def test_the_two_commands_stand_there_each_on_its_own_line():
    for command in COMMANDS:
        assert README.splitlines().count(command) == 1
    # Continuous integration takes both from the README, so that they are run as printed.
    assert (ROOT / ".ci" / "run").read_text().count("README.md") >= 2


def test_python_of_the_readme(monkeypatch, tmp_path):
    """On a coarser grid, and less far out in the tail."""
    monkeypatch.chdir(tmp_path)
    less = {
        "nodes=(1024|512)": "nodes=256",
        "probability=1e-3, method": "probability=0.1, method",
    }
    scope = run_blocks("README.md", {}, **less)
    assert scope["result"].sizes["sample"] == 10_000


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_python_of_the_page_on_studies(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    problem = st.paper.problem()
    strength = st.paper.strength(problem)
    table = np.column_stack([problem.interface.x, strength.sample(problem.interface)[0]])
    np.savetxt("profile.csv", table, delimiter=",", header="x (m),strength (Pa)", comments="")
    scope = {"st": st, "problem": problem, "strength": strength}
    run_blocks("docs/studies.md", scope, **{r"\bsamples=[\d_]+": "samples=4"})
    assert scope["result"]["critical_stress"].dims == ("correlation_length", "length", "sample")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_the_tutorial_from_a_profile_to_a_failure_probability(monkeypatch, tmp_path):
    """Every block and command, with fewer repetitions."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "examples" / "data", tmp_path / "examples" / "data")
    less = {
        "bootstrap=200": "bootstrap=20",
        "joint, fit, ": "joint, fit.interfaces(4), ",
        r"exact, seed=1\)": "exact, seed=1, target_cv=0.3)",
    }
    scope = run_blocks("docs/tutorials/measured-profile.md", {}, **less)
    fit, truth = scope["fit"], {"mean": 1e6, "noise": 0.03e6, "spectrum.exponent": 2.0}
    for name, value in truth.items():
        assert fit.parameters[name] == pytest.approx(value, rel=0.2)
    assert 0.0 < scope["found"].probability < 0.5
    assert 0.2e6 < scope["design"].stress < 1e6
    assert 0.2e6 < scope["decision"].stress < 1e6
    assert scope["decision"].members.size == 4
    joint = tomllib.loads((ROOT / "examples/data/joint.toml").read_text())["problem"]
    assert st.Problem(**joint) == scope["joint"]


@pytest.mark.slow
def test_python_of_the_page_on_reliability():
    """With a failure curve by equilibrium: about a minute."""
    scope = run_blocks("docs/reliability.md", {})
    assert 1e-6 < scope["found"].probability < 1e-3
    low, high = scope["decision"].band
    assert low < scope["decision"].probability < high


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_python_of_the_page_on_peaks(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "examples" / "data" / "peaks.csv", tmp_path)
    scope = run_blocks("docs/what-do-twenty-five-tests-tell-me.md", {})
    assert scope["first"].size == 13
    assert scope["found"].p_values["cramer_von_mises"] > 0.05


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_the_road_from_files_to_a_force(monkeypatch, tmp_path):
    """Every block of the page on decisions, with fewer repetitions and interfaces."""
    monkeypatch.chdir(tmp_path)
    less = {
        "between=True": "between=True, bootstrap=20",
        r"interfaces\(60\)": "interfaces(6)",
        "samples=400": "samples=40",
        "probability=1e-3, method": "probability=0.03, method",
        "nodes=256": "nodes=128",
    }
    scope = run_blocks("docs/decisions.md", {}, **less)
    assert scope["fit"].parameters["marginal.mean"] == pytest.approx(0.2, rel=0.1)
    assert 30e3 < scope["design"].force < 50e3
    assert scope["demand"].force == pytest.approx(40e3)
    assert 0.0 < scope["demand"].probability < 0.3
    assert str(scope["design"]).startswith("force ")


WITH_EXAMPLES = [
    ".".join(path.relative_to(ROOT / "src").with_suffix("").parts)
    for path in sorted((ROOT / "src").rglob("*.py"))
    if ">>>" in path.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_in_docstrings(module):
    found = doctest.testmod(import_module(module))
    assert found.attempted > 0
    assert found.failed == 0


def test_the_tutorials_data_are_what_the_script_makes_and_say_so():
    data = ROOT / "examples" / "data"
    script = runpy.run_path(str(data / "make_strength_profile.py"))
    assert "synthetic" in (data / "strength_profile.csv").read_text("utf-8").splitlines()[0]
    profile = st.read_profile(data / "strength_profile.csv")
    x, strength = script["record"]()
    np.testing.assert_allclose(profile["x"], 1e-3 * x, atol=1e-9)  # to the digits of the file
    np.testing.assert_allclose(profile, 1e6 * strength, atol=51.0)
    assert (data / "peaks.csv").read_text().startswith("# synthetic")
    assert "Nothing here was measured" in (data / "make_peaks.py").read_text()


def test_tables_of_study_files():
    """Each is valid TOML; what the page on studies shows of a study makes a valid one."""
    pages = [page for page in PAGES if page.stem != "architecture"]  # names a reader's package
    parsed = [tomllib.loads(block) for page in pages for block in blocks(page, "toml")]
    assert len(parsed) >= 5
    whole = tomllib.loads((ROOT / "examples" / "paper.toml").read_text())
    whole["method"] = {"type": "equilibrium"}  # the one that can keep slip and sensitivity
    for table in parsed:
        if {"random", "sweep", "ensemble"} & table.keys():
            st.Study.from_dict(whole | table)


@pytest.mark.parametrize(
    "path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda path: path.name
)
def test_every_study_file_is_valid(path):
    study = st.Study.from_toml(path)
    assert st.Study.from_dict(study.to_dict()) == study


def test_links_and_paths():
    pattern = r"`((?:examples|validation|benchmarks|tests|docs)/[\w./]+\.\w+)`"
    known = [path.as_posix() for path in (ROOT / "src").rglob("*.py")]
    page = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    for name in re.findall(r"`([\w/]+\.py)`", page):
        assert any(path.endswith(f"/{name}") for path in [*known, f"{ROOT}/{name}"]), name
    for page in [*PAGES, *MORE]:
        text = page.read_text("utf-8")
        # The entry of the site links pages that are made when it is built, and is checked there.
        links = [] if page.name == "index.md" else re.findall(r"\]\((?!http)([^)#]+)", text)
        for place in [page.parent / link for link in links] + [
            ROOT / path for path in re.findall(pattern, text)
        ]:
            assert place.exists(), f"{page.name}: {place}"


def test_the_glossary_names_what_the_code_names():
    page = (ROOT / "docs" / "conventions.md").read_text("utf-8")
    rows = re.findall(r"^\| (`.*?) \|", page.split("## Glossary")[1], flags=re.MULTILINE)
    names = {name.split(".")[-1] for row in rows for name in re.findall(r"`([\w.]+)`", row)}
    assert len(names) > 50
    code = "\n".join(path.read_text("utf-8") for path in (ROOT / "src").rglob("*.py"))
    assert names - set(re.findall(r"\w+", code)) == set()

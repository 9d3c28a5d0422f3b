"""What the pages of docs/ show: python that runs, study files that parse, links, names."""

import re
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
    found = re.findall(rf"^( *)```{language}\n(.*?)^ *```", text, flags=re.DOTALL | re.MULTILINE)
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
    for page in [*PAGES, ROOT / "CONTRIBUTING.md"]:
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

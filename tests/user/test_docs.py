"""What README.md, docs/ and docstrings show: python that runs, study files, links, names."""

import ast
import contextlib
import doctest
import io
import re
import runpy
import shutil
import tomllib
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from recording import stored

import stiction as st

ROOT = Path(__file__).parents[2]
NUMBER = re.compile(r"\d+(?:\.\d+)?")
README = (ROOT / "README.md").read_text("utf-8")
PAGES = sorted(path for path in (ROOT / "docs").rglob("*.md") if path.parts[-2] != "api")
DATA = ROOT / "examples" / "data"


def blocks(page, language):
    """Fenced blocks of a page, without the indentation that they have inside a list."""
    text = (ROOT / page).read_text("utf-8")
    found = re.findall(rf"(?sm)^( *)```{language}\n(.*?)^ *```", text)
    return [re.sub(rf"^{indent}", "", block, flags=re.MULTILINE) for indent, block in found]


# -- python of pages, some of its words replaced so that it takes less, and what it must find ------


SHOWN = stored("pages")
"""Pages whose python runs, with the words that make it shorter."""
FOUND = stored("found_on_pages")
"""What a page finds, as text, and the limits of its numbers."""
SHOWN_OUTPUT = re.compile(r"(?sm)^```python\n(.*?)^```\n(?:```\n(.*?)^```)?")


def run_blocks(text, scope, replaced):
    """Run the blocks of a page and compare what they print with the output that follows them.

    A number may differ by two units of its last printed digit, because other processors round
    differently and some blocks sample. After a replaced word only the text of the output counts.
    """
    exact = True
    for code, expected in SHOWN_OUTPUT.findall(text):
        block = code
        for words, shorter in replaced.items():
            block = re.sub(words, shorter, block)
        exact = exact and block == code
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(block, "page", "exec"), scope)
        if not expected:
            continue
        for line, shown in zip(
            printed.getvalue().splitlines(), expected.splitlines(), strict=True
        ):
            assert NUMBER.sub("#", line).split() == NUMBER.sub("#", shown).split()
            pairs = zip(NUMBER.findall(line), NUMBER.findall(shown), strict=True)
            for number, given in pairs if exact else ():
                unit = 10.0 ** -len(given.partition(".")[2])
                assert float(number) == pytest.approx(float(given), abs=2.01 * unit), line


QUICK = ("docs/guide/studies.md", "docs/guide/reading-data.md")


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=() if page in QUICK else pytest.mark.slow) for page in SHOWN],
)
def test_python_of_a_page(page, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(DATA, tmp_path / "examples" / "data")
    shutil.copy(DATA / "peaks.csv", tmp_path)
    problem = st.paper.problem()
    strength = st.paper.strength(problem)
    table = np.column_stack([problem.interface.x, strength.sample(problem.interface)[0]])
    np.savetxt("profile.csv", table, delimiter=",", header="x (m),strength (Pa)", comments="")
    scope = {"st": st, "problem": problem, "strength": strength}
    run_blocks((ROOT / page).read_text("utf-8"), scope, SHOWN[page])
    for text, (low, high) in FOUND.get(page, {}).items():
        assert low <= eval(text, globals() | scope) <= high, text


def test_the_readme_prints_what_it_shows(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert [bool(output) for _, output in SHOWN_OUTPUT.findall(README)] == 3 * [True]
    run_blocks(README, {}, {})
    assert (tmp_path / "joint.png").stat().st_size > 10_000


def test_the_page_of_messages_quotes_messages():
    """Each quotation of the page occurs in a text of the package; '...' replaces values."""
    texts = set()
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            parts = node.values if isinstance(node, ast.JoinedStr) else [node]
            texts.add("#".join(str(getattr(part, "value", "")) for part in parts))
    messages = "\n".join(texts)
    page = (ROOT / "docs" / "reference" / "errors-and-warnings.md").read_text("utf-8")
    quotes = re.findall(r"(?:^- |or |and )\*\*`([^`]+)`", page, re.MULTILINE)
    assert len(quotes) > 60
    for part in (part.strip() for quote in quotes for part in quote.split("...")):
        assert part in messages


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
    script = runpy.run_path(str(DATA / "make_strength_profile.py"))
    assert "synthetic" in (DATA / "strength_profile.csv").read_text("utf-8").splitlines()[0]
    profile = st.read_profile(DATA / "strength_profile.csv")
    x, strength = script["record"]()
    np.testing.assert_allclose(profile["x"], 1e-3 * x, atol=1e-9)  # to the digits of the file
    np.testing.assert_allclose(profile, 1e6 * strength, atol=51.0)
    assert (DATA / "peaks.csv").read_text().startswith("# synthetic")
    assert "Nothing here was measured" in (DATA / "make_peaks.py").read_text()


def test_study_files_and_tables_of_them():
    """Each is valid TOML; what the pages show of a study makes a valid one."""
    examples = sorted((ROOT / "examples").glob("*.toml"))
    for path in examples:
        study = st.Study.from_toml(path)
        assert st.Study.from_dict(study.to_dict()) == study, path
    # These name a reader's package, and hold parameters of the report on the paper.
    pages = [page for page in PAGES if page.stem not in ("extend-and-connect", "paper")]
    parsed = [tomllib.loads(block) for page in pages for block in blocks(page, "toml")]
    assert len(parsed) >= 5
    whole = tomllib.loads((ROOT / "examples" / "paper.toml").read_text())
    whole["method"] = {"type": "equilibrium"}  # the one that can keep slip and sensitivity
    for table in parsed:
        if {"random", "sweep", "samples"} & table.keys():
            st.Study.from_dict(whole | table)


def test_links_and_paths():
    pattern = r"`((?:examples|validation|benchmarks|tests|docs)/[\w./]+\.\w+)`"
    known = [path.as_posix() for path in (ROOT / "src").rglob("*.py")]
    page = (ROOT / "docs" / "developers" / "architecture.md").read_text("utf-8")
    for name in re.findall(r"`([\w/]+\.py)`", page):
        assert any(path.endswith(f"/{name}") for path in [*known, f"{ROOT}/{name}"]), name
    for page in [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"]:
        text = page.read_text("utf-8")
        # The entry of the site links pages that are made when it is built, and is checked there.
        links = [] if page.name == "index.md" else re.findall(r"\]\((?!http)([^)#]+)", text)
        places = [page.parent / link for link in links]
        for place in places + [ROOT / path for path in re.findall(pattern, text)]:
            assert place.exists(), f"{page.name}: {place}"

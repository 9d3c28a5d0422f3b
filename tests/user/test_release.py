"""A release says the same everywhere, and what a user and an editor see of the package."""

import json
import re
import sys
import tomllib
from pathlib import Path

import pytest
from checks import python
from public import public
from recording import stored

import stiction as st
from stiction.base.kinds import _registered

ROOT, PACKAGE = Path(__file__).parents[2], Path(st.__file__).parent
META = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CITATION = (ROOT / "CITATION.cff").read_text()
CODEMETA = json.loads((ROOT / "codemeta.json").read_text())
RECIPE = (ROOT / "conda" / "recipe.yaml").read_text()


def test_the_version_and_its_date_stand_everywhere(command):
    assert f"\nversion: {st.__version__}\n" in CITATION
    assert CODEMETA["version"] == st.__version__
    assert f'version: "{st.__version__}"' in RECIPE
    heading = rf"^## {re.escape(st.__version__)} - (\d{{4}}-\d\d-\d\d)$"
    (date,) = re.findall(heading, (ROOT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)
    assert f"date-released: {date}" in CITATION
    assert CODEMETA["datePublished"] == date
    assert command("--version") == (0, f"stiction {st.__version__}\n", "")


def test_the_recipe_needs_what_the_package_needs():
    run = RECIPE.split("  run:\n")[1].split("\ntests:")[0].lower()
    for requirement in META["dependencies"]:
        name, version = requirement.lower().split(">=")
        name = "matplotlib-base" if name == "matplotlib" else name
        assert f"    - {name} >={version}" in run
    needed = {one.split(">=")[0] for one in META["dependencies"]}
    assert set(CODEMETA["softwareRequirements"]) == needed
    assert META["scripts"]["stiction"] in RECIPE


def test_the_lowest_versions_that_are_tested_are_those_that_are_promised():
    extras = META["optional-dependencies"]
    needed = [*META["dependencies"], *extras["distributed"], *extras["test"]]
    promised = {re.sub(r">=([\d.]+).*", r"==\1", one) for one in needed}
    lines = (ROOT / "tests" / "lowest.txt").read_text().splitlines()
    assert {line for line in lines if not line.startswith("#")} == promised


def test_every_public_name_is_there_documented_and_completed():
    """Completion asks `dir`."""
    for module in (st, st.extensions, st.external, st.paper, st.plot, st.statistics, st.theory):
        assert dir(module) == sorted(module.__all__)
    with pytest.raises(AttributeError, match="did you mean 'monte_carlo'"):
        _ = st.montecarlo
    for name in set(st.__all__) - {"__version__"}:
        assert (getattr(st, name).__doc__ or "").strip(), name


def test_the_public_interface_is_the_stored_list(monkeypatch):
    """`python tests/public.py > tests/public.txt` stores it anew; CHANGELOG.md tells users."""
    for kinds in _registered.values():
        for name in [name for name in kinds if "stiction" not in kinds[name].__module__]:
            monkeypatch.delitem(kinds, name)  # a class of another test
    assert public() == (ROOT / "tests" / "public.txt").read_text()


def test_no_module_bears_the_name_of_a_public_function():
    modules = {path.stem for path in PACKAGE.glob("*.py")}
    folders = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    own = {"__version__", "extensions", "external", "paper", "plot", "statistics", "theory"}
    assert not (modules | folders) & (set(st.__all__) - own)


def test_importing_is_quick_because_nothing_heavy_is_loaded():
    heavy = "{'numpy', 'numba', 'scipy', 'xarray', 'matplotlib'}"
    assert python("-c", f"import sys, stiction; print(*{heavy} & set(sys.modules))") == "\n"


def test_a_type_checker_finds_every_mistake_and_accepts_what_is_right(tmp_path):
    """Lines of tests/records/typed.json, what belongs in them, and a mistake in its place."""
    pytest.importorskip("basedpyright")
    head = "import numpy as np\nimport stiction as st\n"
    calls = stored("typed")
    for name, which in (("right.py", 1), ("wrong.py", 2)):
        lines = [call[0].format(call[which]) for call in calls]
        (tmp_path / name).write_text(head + "\n".join(lines))
    config = tmp_path / "pyrightconfig.json"
    config.write_text('{"typeCheckingMode": "strict"}')
    options = ["-m", "basedpyright", "--level", "error", "--outputjson"]
    options += ["--pythonpath", sys.executable]  # else the first Python of the path
    found = json.loads(python(*options, "-p", config, code=1))["generalDiagnostics"]
    assert [one["message"] for one in found if one["file"].endswith("right.py")] == []
    assert {one["range"]["start"]["line"] - 2 for one in found} >= {*range(len(calls))}

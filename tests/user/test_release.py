"""A release says the same everywhere, and what a user and an editor see of the package."""

import json
import re
import sys
import tomllib
from pathlib import Path

import pytest
from checks import python

import stiction as st

ROOT, PACKAGE = Path(__file__).parents[2], Path(st.__file__).parent
META = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CITATION = (ROOT / "CITATION.cff").read_text()
CODEMETA = json.loads((ROOT / "codemeta.json").read_text())
RECIPE = (ROOT / "conda" / "recipe.yaml").read_text()


def test_the_version_and_its_date_stand_everywhere():
    assert f"\nversion: {st.__version__}\n" in CITATION
    assert CODEMETA["version"] == st.__version__
    assert f'version: "{st.__version__}"' in RECIPE
    heading = rf"^## {re.escape(st.__version__)} - (\d{{4}}-\d\d-\d\d)$"
    (date,) = re.findall(heading, (ROOT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)
    assert f"date-released: {date}" in CITATION
    assert CODEMETA["datePublished"] == date
    assert python("-m", "stiction", "--version") == f"stiction {st.__version__}\n"


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
    needed = [
        *META["dependencies"],
        *extras["distributed"],
        *extras["inference"],
        *extras["test"],
    ]
    promised = {re.sub(r">=([\d.]+).*", r"==\1", one) for one in needed}
    lines = (ROOT / "tests" / "lowest.txt").read_text().splitlines()
    assert {line for line in lines if not line.startswith("#")} == promised


def test_every_public_name_is_there_documented_and_completed():
    assert dir(st) == sorted(st.__all__)
    for name in set(st.__all__) - {"__version__"}:
        assert (getattr(st, name).__doc__ or "").strip(), name
    code = "import stiction as st, numpy; st.Solid; print(' '.join(dir(st)))"
    assert python("-c", code).split() == sorted(st.__all__)


def test_no_module_bears_the_name_of_a_public_function():
    modules = {path.stem for path in PACKAGE.glob("*.py")}
    folders = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    own = {"__version__", "extensions", "external", "paper", "plot", "statistics", "theory"}
    assert not (modules | folders) & (set(st.__all__) - own)


def test_importing_is_quick_because_nothing_heavy_is_loaded():
    heavy = "{'numpy', 'numba', 'scipy', 'xarray', 'matplotlib'}"
    assert python("-c", f"import sys, stiction; print(*{heavy} & set(sys.modules))") == "\n"


CALLS = [
    ("solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, {}=1170.0)", "density", "densty"),
    ("interface = st.Interface(length={}, nodes=1024)", "0.1", '"0.1"'),
    ("law = st.LinearWeakening({}=5e11)", "weakening_rate", "weakening_rat"),
    ("steep = st.LinearWeakening(weakening_rate={})", "np.full(1024, 5e11)", '"fast"'),
    ("beta = st.Beta(alpha=1.5, beta=3.0, {}low=0.66e6)", "high=1.66e6, ", ""),
    ("problem = st.Problem({}, law)", "solid, interface", "interface, solid"),
    ("st.Problem(solid, interface, {})", "law", '"linear"'),
    ("st.Problem(solid, interface, law, {})", "st.Load()", "1e6"),
    ("st.Load(profile={})", "st.GradientLoad(amplitude=0.1)", "st.GradientLoad"),
    ("st.Load(initial_stress={})", "[1e5] * 1024", '"1e5"'),
    ("method = st.{}()", "Equilibrium", "Equilibrum"),
    ("field = st.RandomField({})", "beta, st.PowerLawSpectrum(1e-3)", "beta, 1e-3"),
    ("st.RandomField({})", "beta, st.PowerLawSpectrum(1e-3)", "st.PowerLawSpectrum(1e-3), beta"),
    ("st.RandomField({}, st.PowerLawSpectrum(1e-3))", "beta", "st.Beta"),
    ("st.RandomField(beta, {})", "st.PowerLawSpectrum(1e-3)", "st.PowerLawSpectrum"),
    (
        "st.RandomInterface(strength=field, correlation={})",
        '{("strength", "initial_stress"): 0.1}', '{"strength": 0.1}',
    ),
    ("st.monte_carlo(problem, {}, method=method, samples=9)", "[field, field]", "3"),
    ("st.monte_carlo(problem, field, method=method, samples={})", "9", '"10"'),
    ("st.monte_carlo(problem, field, method={}, samples=9)", "method", '"equilibrium"'),
    ("st.monte_carlo(problem, field, method={}, samples=9)", "method", "st.Equilibrium"),
    ("st.monte_carlo(problem, field, method=method, samples=9, keep={})", '"strength"', "1"),
    ("st.Save({})", '["slip"], stations={"a": 0.05}', "3"),
    ("run = st.Rupture(loading_rate={})", "2e7", '"fast"'),
    ("st.plot.field(interface, [0.0]).figure.{}", "set_size_inches(3, 2)", "set_size(3, 2)"),
]  # fmt: skip
"""Lines, what belongs in them, and a mistake in its place."""


def test_a_type_checker_finds_every_mistake_and_accepts_what_is_right(tmp_path):
    pytest.importorskip("basedpyright")
    head = "import numpy as np\nimport stiction as st\n"
    for name, which in (("right.py", 1), ("wrong.py", 2)):
        lines = [call[0].format(call[which]) for call in CALLS]
        (tmp_path / name).write_text(head + "\n".join(lines))
    config = tmp_path / "pyrightconfig.json"
    config.write_text('{"include": ["right.py"], "typeCheckingMode": "strict"}')
    options = ["-m", "basedpyright", "--level", "error", "--outputjson"]
    options += ["--pythonpath", sys.executable]  # else the first Python of the path
    right = json.loads(python(*options, "-p", config))["generalDiagnostics"]
    assert [one["message"] for one in right] == []
    found = json.loads(python(*options, tmp_path / "wrong.py", code=1))["generalDiagnostics"]
    assert {one["range"]["start"]["line"] - 2 for one in found} >= {*range(len(CALLS))}

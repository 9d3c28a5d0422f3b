"""What a user and an editor see of the package: names, completion, types, a quick import."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import stiction as st

SOURCES = Path(st.__file__).parent


def printed(code):
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def test_every_public_name_is_there_documented_and_completed():
    assert dir(st) == sorted(st.__all__)
    for name in set(st.__all__) - {"__version__"}:
        assert (getattr(st, name).__doc__ or "").strip(), name
    with pytest.raises(AttributeError, match="no attribute 'Rapture'"):
        _ = st.Rapture
    code = "import stiction as st, numpy; st.Solid; print(' '.join(dir(st)))"
    assert printed(code) == sorted(st.__all__)


def test_no_module_bears_the_name_of_a_public_function():
    modules = {path.stem for path in SOURCES.glob("*.py")}
    folders = {path.parent.name for path in SOURCES.glob("*/__init__.py")}
    own = {"__version__", "plot", "paper", "theory", "external", "statistics"}
    assert not (modules | folders) & (set(st.__all__) - own)


def test_importing_is_quick_because_nothing_heavy_is_loaded():
    heavy = "{'numpy', 'numba', 'scipy', 'xarray', 'matplotlib'}"
    assert printed(f"import sys, stiction; print(*{heavy} & set(sys.modules))") == []


CALLS = [
    ("solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, {}=1170.0)", "density", "densty"),
    ("interface = st.Interface(length={}, nodes=1024)", "0.1", '"0.1"'),
    ("law = st.LinearWeakening({}=5e11)", "weakening_rate", "weakening_rat"),
    ("beta = st.Beta(alpha=1.5, beta=3.0, {}low=0.66e6)", "high=1.66e6, ", ""),
    ("problem = st.Problem({}, law)", "solid, interface", "interface, solid"),
    ("method = st.{}()", "Equilibrium", "Equilibrum"),
    ("field = {}", "st.RandomField(beta, st.PowerLawSpectrum(1e-3))", "3"),
    (
        "found = st.monte_carlo(problem, field, method=st.LocalCriterion(), samples={})",
        "9",
        "{}",
    ),
    ("run = st.Rupture(loading_rate={})", "2e7", '"fast"'),
]
"""Lines, what belongs in them, and a mistake in its place."""


def test_a_type_checker_finds_every_mistake(tmp_path):
    pytest.importorskip("basedpyright")
    for name, which in (("right.py", 1), ("wrong.py", 2)):
        lines = [call[0].format(call[which]) for call in CALLS]
        (tmp_path / name).write_text("\n".join(["import stiction as st", *lines]))
    command = [sys.executable, "-m", "basedpyright", "--level", "error", "--outputjson"]
    done = subprocess.run([*command, tmp_path], capture_output=True, text=True)
    found = json.loads(done.stdout)["generalDiagnostics"]
    errors = {(Path(d["file"]).name, d["range"]["start"]["line"]) for d in found}
    lines = {i + 1 for i, call in enumerate(CALLS) if call[0] != "field = {}"}
    assert errors == {("wrong.py", line) for line in lines}

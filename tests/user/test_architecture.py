"""Imports run downwards as docs/architecture.md draws them, and kernels depend on kernels only."""

import dataclasses
import re
import tomllib
from pathlib import Path

import numpy as np
import pydantic
from checks import python
from refusals import refuses

import stiction as st
from stiction.model import to_plain

MIXED = {
    "average.py", "diagnostics.py", "explicit.py", "implicit.py", "loading.py",
    "mapping.py", "rice.py", "sample.py",
}  # fmt: skip
"""Files with kernels that hold messages as well, or import those that do."""

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "src" / "stiction"


def test_imports_run_downwards():
    """Those inside functions and under TYPE_CHECKING included."""
    python("-c", "from importlinter.cli import lint_imports_command as f; f()", cwd=ROOT)


def test_the_drawing_is_what_is_held():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    held = [re.findall(r"(?<!\()\b\w+", layer) for layer in contracts["contracts"][0]["layers"]]
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    drawing = re.search(r"## Layers\n.*?```\n(.*?)```", page, flags=re.DOTALL)[1]
    drawn = [line.split("  ")[0].split() for line in drawing.splitlines()]
    assert [sorted(layer) for layer in drawn] == [sorted(layer) for layer in held]


def test_an_edited_message_compiles_no_kernel_anew():
    """Files with kernels refuse nothing and import none that do, whose states they depend on."""
    texts = {path: path.read_text(encoding="utf-8") for path in SOURCES.rglob("*.py")}
    names = {
        ".".join(path.relative_to(SOURCES.parent).with_suffix("").parts): path for path in texts
    }
    for path, text in texts.items():
        if path.name in MIXED or not re.search(
            r"^from stiction\.(jit|lanes) import", text, flags=re.MULTILINE
        ):
            continue
        for module in re.findall(r"^from (stiction[\w.]*) import", text, flags=re.MULTILINE):
            imported = texts.get(names.get(module), "")
            assert module == "stiction.jit" or "InputError" not in imported, (path, module)


def test_the_worked_examples_run(monkeypatch):
    """A friction law, a load, a spectrum and a marginal of one's own, as the page shows them."""
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    names: dict = {"__name__": __name__}
    for block in re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL):
        exec(block, names)
    base = st.paper.problem(nodes=256)
    problem = dataclasses.replace(base, friction=names["law"], load=names["load"])
    sample = problem.sample(names["field"].sample(base.interface, samples=2, seed=0))
    found = st.onset(problem, sample, method=st.LocalCriterion(), progress=False)
    assert np.all(np.abs(found.critical_position - 0.05) < 0.02)
    # The load in study files, and what is refused of it.
    loaded, bump = dataclasses.replace(base, load=names["load"]), names["BumpLoad"]
    plain = to_plain(loaded)
    assert plain["load"]["profile"] == {"type": "bump", "width": 0.02}
    assert pydantic.TypeAdapter(st.Problem).validate_python(plain) == loaded
    words = "BumpLoad.width: must be greater than 0"
    refuses(words, lambda: st.Load(profile={"type": "bump", "width": 0.0}))
    monkeypatch.setattr(bump, "values", lambda self, interface: interface.x - 0.01)
    refuses("Bump ... must be positive everywhere", lambda: bump(width=0.01).on(base.interface))

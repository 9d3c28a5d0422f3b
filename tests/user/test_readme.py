"""What the README promises: its commands, its code, its names."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import stiction as st

MODULES = ("plot", "paper", "theory", "external", "statistics")
ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
COMMANDS = (
    "python3 -m venv .venv && .venv/bin/python -m pip install . && .venv/bin/python reproduction",
    'python3 -m venv .venv && .venv/bin/python -m pip install -e ".[test]"'
    " && .venv/bin/python -m pytest",
)


def test_the_two_commands_stand_there_each_on_its_own_line():
    lines = README.splitlines()
    for command in COMMANDS:
        assert lines.count(command) == 1
    # Continuous integration takes both from the README, so that they are run as printed.
    script = (ROOT / ".ci" / "run").read_text()
    assert script.count("README.md") >= 2


def test_every_block_of_python_runs(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    assert len(blocks) >= 2
    scope: dict = {}
    for block in blocks:  # on a coarser grid, and less far out in the tail
        for text in ("nodes=1024", "nodes=512"):
            block = block.replace(text, "nodes=256")
        block = block.replace("probability=1e-3, method=", "probability=0.1, method=")
        exec(compile(block, "README.md", "exec"), scope)
    assert scope["result"].sizes["sample"] == 10_000


def test_every_linked_file_exists():
    targets = re.findall(r"\]\((?!http)([^)#]+)\)", README)
    assert targets
    for target in targets:
        assert (ROOT / target).exists(), target


@pytest.mark.parametrize("name", sorted(set(st.__all__) - {"__version__"}))
def test_every_public_name_is_there_and_documented(name):
    found = getattr(st, name)
    assert (found.__doc__ or "").strip()


def test_no_module_bears_the_name_of_a_public_function():
    modules = {path.stem for path in (ROOT / "src" / "stiction").glob("*.py")}
    folders = {path.parent.name for path in (ROOT / "src" / "stiction").glob("*/__init__.py")}
    functions = {name for name in st.__all__ if name not in ("__version__", *MODULES)}
    assert not (modules | folders) & functions


def test_importing_is_quick_because_nothing_heavy_is_loaded():
    code = (
        "import sys, stiction; heavy = {'numpy', 'numba', 'scipy', 'xarray', 'matplotlib'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert result.stdout.strip() == "[]", result.stderr


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'Rapture'"):
        _ = st.Rapture

"""Imports: no cycle, downwards only in the order that docs/architecture.md draws, none hidden.

Static: the sources are parsed and not imported. Blocks under TYPE_CHECKING do not count.
"""

import ast
import graphlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "src"
PAGE = ROOT / "docs" / "architecture.md"

DEFERRED = {
    ("stiction.study.study", "stiction.study_run"),
    ("stiction.ensemble.distributed", "stiction.ensemble.slurm"),
}
"""Imports of own modules inside functions, outside the commands; the page says why of each."""


class Import(NamedTuple):
    importer: str
    target: str
    inside_function: bool
    names: tuple[str, ...]


def is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")


def statements(node: ast.AST, inside: bool = False) -> Iterator[tuple[ast.stmt, bool]]:
    """Import statements below a node that run, and whether in a function."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import | ast.ImportFrom):
            yield child, inside
        elif is_type_checking(child):
            for other in child.orelse:
                yield from statements(ast.Module([other], []), inside)
        else:
            function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            yield from statements(child, inside or function)


def imports_of(sources: dict[str, str]) -> list[Import]:
    """Imports of own modules by own modules, of sources by the dotted names of their modules."""
    own = next(iter(sources)).split(".")[0]
    found = []
    for importer, text in sources.items():
        for node, inside in statements(ast.parse(text)):
            if isinstance(node, ast.Import):
                pairs = [(name.name, ()) for name in node.names]
            else:
                assert node.level == 0, f"{importer}: relative import"
                whole = f"{node.module}"
                pairs = []
                for name in node.names:
                    inner = f"{whole}.{name.name}"
                    pairs.append((inner, ()) if inner in sources else (whole, (name.name,)))
            for target, names in pairs:
                if target.split(".")[0] == own:
                    found.append(Import(importer, target, inside, names))
    return found


def cycle_in(imports: list[Import]) -> list[str] | None:
    """A cycle of imports that run when modules are loaded, those of parent packages included."""
    graph: dict[str, set[str]] = {}
    for importer, target, inside, _ in imports:
        if inside:
            continue
        graph.setdefault(importer, set()).add(target)
        parts = target.split(".")
        for count in range(2, len(parts)):  # loading a.b.c runs a.b first
            parent = ".".join(parts[:count])
            if not importer.startswith(parent):
                graph[importer].add(parent)
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return None


def layer_of(page: str) -> dict[str, int]:
    """Number of the layer of each module or package just below `stiction`, 0 the highest."""
    drawing = re.search(r"## Layers\n.*?```\n(.*?)```", page, flags=re.DOTALL)
    assert drawing is not None
    layers = {}
    for number, line in enumerate(drawing[1].splitlines()):
        for name in line.split("  ")[0].split():
            assert name not in layers, f"{name} is drawn twice"
            layers[name] = number
    return layers


def upwards(imports: list[Import], layers: dict[str, int]) -> list[str]:
    """Imports that do not run downwards, those inside functions outside the commands included."""
    wrong = []
    for importer, target, _, names in imports:
        if (importer, target) in DEFERRED or importer.count(".") == 0:
            continue
        if target == "stiction":
            if not names or set(names) - {"__version__"}:
                allowed = importer.startswith("stiction.cli.")
                wrong += [] if allowed else [f"{importer} imports public names {names}"]
            continue
        above, below = importer.split(".")[1], target.split(".")[1]
        if above != below and layers[above] >= layers[below]:
            wrong.append(f"{importer} (layer {layers[above]}) imports {target} ({layers[below]})")
    return wrong


@pytest.fixture(scope="module")
def sources():
    found = {}
    for path in sorted((SOURCES / "stiction").rglob("*.py")):
        parts = path.relative_to(SOURCES).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text("utf-8")
    return found


@pytest.fixture(scope="module")
def imports(sources):
    return imports_of(sources)


def test_no_cycle(imports):
    assert cycle_in(imports) is None


def test_every_module_is_drawn_and_every_drawn_one_is_there(sources):
    layers = layer_of(PAGE.read_text("utf-8"))
    there = {name.split(".")[1] for name in sources if "." in name}
    assert there - layers.keys() == set(), "give these a line in docs/architecture.md"
    assert layers.keys() - there == set(), "docs/architecture.md draws what is not there"


def test_layers_import_downwards_only(imports):
    assert upwards(imports, layer_of(PAGE.read_text("utf-8"))) == []


def test_imports_inside_functions_are_of_the_commands_or_known(imports):
    """The public namespace imports by name, so that it has none either."""
    hidden = {
        (one.importer, one.target)
        for one in imports
        if one.inside_function and not one.importer.startswith("stiction.cli.")
    }
    assert hidden == DEFERRED


def test_the_checks_see_what_they_look_for():
    """Each of the faults above, in a package of three modules."""
    layers = {"high": 0, "low": 1, "side": 1}
    head = "from __future__ import annotations\nfrom typing import TYPE_CHECKING\n"
    lazy = {"stiction.high": "def f():\n    from stiction.low import a\n"}
    cycle = {"stiction.high": "import stiction.low", "stiction.low": "from stiction import high"}
    typed = {
        "stiction.high": "from stiction.low import a",
        "stiction.low": f"{head}if TYPE_CHECKING:\n    from stiction.high import b\n",
    }
    assert cycle_in(imports_of(cycle)) is not None
    assert cycle_in(imports_of(typed)) is None
    assert upwards(imports_of(typed), layers) == []
    assert len(upwards(imports_of(cycle), layers)) == 1
    assert len(upwards(imports_of({"stiction.low": "import stiction.side"}), layers)) == 1
    assert len(upwards(imports_of({"stiction.low": "from stiction import onset"}), layers)) == 1
    assert [one.inside_function for one in imports_of(lazy)] == [True]

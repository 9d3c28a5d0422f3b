"""Draw the rooms of the package and who imports whom, from the sources, when pages are built."""

from __future__ import annotations

import ast
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

HERE = Path(__file__).parents[1]
PACKAGE = HERE.parent / "src" / "stiction"
PICTURE = HERE / "images" / "architecture.svg"


def rooms() -> dict[str, set[str]]:
    """Return what each room (a folder or a single file of the root) imports of the others."""
    found: dict[str, set[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        room = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        if room.startswith("__"):
            continue
        targets = found.setdefault(room, set())
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("stiction."):
                targets.add(node.module.split(".")[1])
        targets.discard(room)
    return found


def heights(imports: dict[str, set[str]]) -> dict[str, int]:
    """Return the layer of each room: one above the highest that it imports."""
    layer: dict[str, int] = {}
    while len(layer) < len(imports):
        for room, targets in imports.items():
            if room not in layer and targets <= layer.keys():
                layer[room] = 1 + max((layer[target] for target in targets), default=-1)
    return layer


def draw() -> Figure:
    """Return the rooms by layer; a line leads down to each room that is imported."""
    imports = rooms()
    layer = heights(imports)
    count = 1 + max(layer.values())
    rows = [[room for room in sorted(layer) if layer[room] == i] for i in range(count)]
    at = {
        room: (column - 0.5 * (len(row) - 1), float(i))
        for i, row in enumerate(rows)
        for column, room in enumerate(row)
    }
    figure = Figure(figsize=(7.0, 0.5 * len(rows)))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    for room, targets in imports.items():
        for target in sorted(targets):
            (x, y), (to_x, to_y) = at[room], at[target]
            next_to = abs(y - to_y) < 1.5
            axes.plot(
                (x, to_x), (y, to_y), color="0.55" if next_to else "0.88", lw=0.9, zorder=0
            )
    for room, (x, y) in at.items():
        axes.text(
            x, y, room, ha="center", va="center", fontsize=9,
            bbox={"boxstyle": "round", "facecolor": "white", "edgecolor": "0.4"},
        )  # fmt: skip
    widest = max(map(len, rows))
    axes.set(xlim=(-0.5 * widest - 0.1, 0.5 * widest + 0.1), ylim=(-0.6, len(rows) - 0.4))
    axes.axis("off")
    return figure


def setup(app) -> dict[str, bool]:
    """Draw the picture anew."""
    with rc_context({"svg.hashsalt": "architecture"}):
        draw().savefig(PICTURE, metadata={"Date": None})
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    setup(None)

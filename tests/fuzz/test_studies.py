"""Mutated study files are refused with a message or right, soon and in little memory.

What is called valid is described as `stiction check` does, and one sample of it computed. More of
them: pytest tests/fuzz --fuzz-count 3000 --fuzz-seed 771.
"""

from __future__ import annotations

import copy
import functools
import operator
import random
import warnings
from pathlib import Path
from typing import Any

import tomli_w
from small_study import lengths, small_study
from trials import fault, mutated

from stiction.cli.commands import description
from stiction.study.study import Study

PLAIN = small_study(
    weakening_rate=0.1e12,
    correlation_length=0.02,
    samples=20,
    seed=11,
    sweep=[*lengths(0.02, 0.03), {"problem.interface.length": [0.1, 0.2]}],
)
PLAIN["problem"]["load"] = {"profile": 1.0, "initial_stress": 0.0, "normal_pressure": 5e6}
PLAIN["random"]["strength"]["mean_mode"] = True
PLAIN["random"]["strength"]["spectrum"] |= {"exponent": 4.0, "power_kept": 0.9997}

VALUES: tuple[Any, ...] = (
    True, "", "x", "1", "\x1b[2J", "a\nb", "x" * 10_000, "profile.npy", "missing.csv", "/dev/zero",
    "../../etc/passwd", 0, 1, -1, 2, 7, 10**6, 10**13, 2**63 - 1, 0.0, -0.0, 0.5, 1.0, -1.0, 1e-308,
    5e-324, 1e-30, 1e-9, 1e3, 1e9, 1e30, 1e308, float("nan"), float("inf"), [], [1], [1.0, 2.0],
    ["x"], [[1.0], [2.0, 3.0]], [True], {}, {"a": 1}, {"type": "x"}, {"type": "norm"},
    {"type": "lognorm", "s": 0.3, "scale": 1e6}, {"type": "equilibrium"}, {"type": 3},
    [1, 2, 3], [1e-300, 1e300], {"low": 1e-300, "high": 1e300, "spacing": "log"},
    [{"type": "beta"}],
)  # fmt: skip


def _leaves(tree: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths to everything inside, tables too."""
    found = [path] if path else []
    items = enumerate(tree) if isinstance(tree, list) else ()
    for key, value in tree.items() if isinstance(tree, dict) else items:
        found += _leaves(value, (*path, key))
    return found


def _mutated_tree(tree: Any, chance: random.Random) -> str:
    path = chance.choice(_leaves(tree))
    *above, key = path
    owner = functools.reduce(operator.getitem, above, tree)
    kind = chance.choice(("value",) * 6 + ("scale", "remove", "rename", "move", "sweep"))
    if kind == "scale" and isinstance(owner[key], int | float):
        owner[key] = owner[key] * 10 ** chance.choice((-12, -6, -3, 3, 6, 12))
    elif kind == "remove":
        del owner[key]
    elif kind == "rename" and isinstance(owner, dict):
        owner[f"{key}{chance.choice('sx_ ')}"] = owner.pop(key)
    elif kind == "move" and isinstance(owner, dict):
        tree[str(key)] = owner.pop(key)
    elif kind == "sweep" and isinstance(tree.get("sweep"), list):
        dotted = ".".join(map(str, path))
        tree["sweep"].append({dotted: [chance.choice(VALUES), chance.choice(VALUES)]})
    else:
        owner[key] = copy.deepcopy(chance.choice(VALUES))
    return f"{kind} {'.'.join(map(str, path))}"


def mutation(chance: random.Random) -> tuple[str, bytes]:
    """What was done, and the file that came of it."""
    if chance.random() < 0.25:
        return "bytes", mutated(tomli_w.dumps(PLAIN).encode(), chance)
    tree = copy.deepcopy(PLAIN)
    texts = [_mutated_tree(tree, chance) for _ in range(chance.choice((1, 1, 1, 2, 3)))]
    return "; ".join(texts), tomli_w.dumps(tree).encode("utf-8", "surrogatepass")


def use(path: Path) -> None:
    """Describe a study, and compute one sample of it if it is not large."""
    study = Study.from_toml(path)
    description(study)
    point = study.experiments[0]
    interface = point.problem.interface
    if max(interface.size, point.dimension) <= 2**15:
        point.results(0, 1)


def test_mutated_studies_are_refused_or_right(tmp_path, fuzz):
    chance, faults = random.Random(fuzz.seed), []
    path = tmp_path / "study.toml"
    path.write_text(tomli_w.dumps(PLAIN))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        use(path)  # compiles kernels
        for number in range(fuzz.count):
            name, data = mutation(chance)
            path.write_bytes(data)
            if wrong := fault(functools.partial(use, path), 10.0):
                faults.append(f"study {number} ({name}): {wrong}")
    assert not faults, "\n".join(faults)

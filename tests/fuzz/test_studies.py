"""Mutated study files are refused with a message or right, soon and in little memory.

Values of a study are replaced, removed, renamed, moved and swept, or bytes of the file changed.
What is called valid is described as `stiction check` does, and one sample of it computed. More of
them: pytest tests/fuzz --fuzz-count 3000 --fuzz-seed 771.
"""

from __future__ import annotations

import copy
import random
import tomllib
import warnings
from pathlib import Path
from typing import Any

import tomli_w
from harness import trial

from stiction.cli import description
from stiction.study.study import Study

STUDY = """
title = "a study"
[problem]
mode = "II"
[problem.solid]
shear_modulus = 1e9
poisson_ratio = 0.33
density = 1170.0
plane = "stress"
[problem.interface]
length = 0.1
nodes = 128
[problem.friction]
weakening_rate = 0.1e12
residual_strength = 0.0
[problem.load]
profile = 1.0
initial_stress = 0.0
normal_pressure = 5e6
[random.strength]
mean_mode = true
[random.strength.marginal]
type = "beta"
alpha = 1.5
beta = 3.0
low = 0.66e6
high = 1.66e6
[random.strength.spectrum]
type = "power_law"
correlation_length = 0.02
exponent = 4.0
truncation = 2.5
[method]
type = "local_criterion"
[ensemble]
samples = 20
seed = 11
first = 0
[[sweep]]
"random.strength.spectrum.correlation_length" = [0.02, 0.03]
[[sweep]]
"problem.interface.length" = { start = 0.1, stop = 0.2, count = 2 }
"""

VALUES: tuple[Any, ...] = (
    True, "", "x", "1", "\x1b[2J", "a\nb", "x" * 10_000, "profile.npy", "missing.csv", "/dev/zero",
    "../../etc/passwd", 0, 1, -1, 2, 7, 10**6, 10**13, 2**63 - 1, 0.0, -0.0, 0.5, 1.0, -1.0, 1e-308,
    5e-324, 1e-30, 1e-9, 1e3, 1e9, 1e30, 1e308, float("nan"), float("inf"), [], [1], [1.0, 2.0],
    ["x"], [[1.0], [2.0, 3.0]], [True], {}, {"a": 1}, {"type": "x"}, {"type": "norm"},
    {"type": "lognorm", "s": 0.3, "scale": 1e6}, {"type": "equilibrium"}, {"type": 3},
    {"start": 1, "stop": 2, "count": 3}, {"start": 1.0, "stop": 2.0, "count": 10**9},
    {"start": 1e-300, "stop": 1e300, "count": 5, "spacing": "log"}, [{"type": "beta"}],
)  # fmt: skip


def _leaves(tree: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths to everything inside, tables too."""
    found = [path] if path else []
    items = tree.items() if isinstance(tree, dict) else ()
    items = enumerate(tree) if isinstance(tree, list) else items
    for key, value in items:
        found += _leaves(value, (*path, key))
    return found


def _parent(tree: Any, path: tuple[Any, ...]) -> Any:
    for key in path[:-1]:
        tree = tree[key]
    return tree


def _mutated_tree(tree: Any, chance: random.Random) -> str:
    path = chance.choice(_leaves(tree))
    owner, key = _parent(tree, path), path[-1]
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
        data = bytearray(STUDY.encode())
        for _ in range(chance.randint(1, 4)):
            place, kind = chance.randrange(len(data)), chance.randrange(4)
            if kind == 0:
                data[place] = chance.randrange(256)
            elif kind == 1:
                del data[place : place + chance.randint(1, 40)]
            elif kind == 2:
                data[place:place] = bytes(data[: chance.randint(1, 80)])
            else:
                data[place:place] = chance.choice(
                    (b"[" * 2000, b"\xff", b"9" * 400, b"\n", b'"""')
                )
        return "bytes", bytes(data)
    tree = tomllib.loads(STUDY)
    texts = [_mutated_tree(tree, chance) for _ in range(chance.choice((1, 1, 1, 2, 3)))]
    return "; ".join(texts), tomli_w.dumps(tree).encode("utf-8", "surrogatepass")


def use(path: Path) -> None:
    """Describe a study, and compute one sample of it if it is not large."""
    study = Study.from_toml(path)
    description(study)
    point = study.experiments[0]
    interface = point.problem.interface
    if max(interface.size, point.dimension) <= 2**15:
        point.results(study.ensemble.first, 1)


def test_mutated_studies_are_refused_or_right(tmp_path, fuzz):
    chance, faults = random.Random(fuzz.seed), []
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        use(path)  # compiles kernels
        for number in range(fuzz.count):
            name, data = mutation(chance)
            path.write_bytes(data)
            outcome, detail = trial(lambda: use(path))
            if outcome.startswith("FAULT"):
                faults.append(f"study {number} ({name}): {outcome}: {detail}")
    assert not faults, "\n".join(faults)

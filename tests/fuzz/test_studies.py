"""Mutated study files are refused with a message or right, soon and in little memory.

What is called valid is described as `stiction check` does, and one sample of it computed. More of
them: pytest tests/fuzz --fuzz-count 3000 --fuzz-seed 771.
"""

from __future__ import annotations

import copy
import functools
import random
import warnings
from pathlib import Path

import tomli_w
from small_study import lengths, small_study
from trials import fault, mutated, mutated_tree

from stiction.cli.commands import description
from stiction.study.study import Study

SWEEP = [*lengths(0.02, 0.03), {"problem.interface.length": [0.1, 0.2]}]
PLAIN = small_study(weakening_rate=0.1e12, correlation_length=0.02, samples=20, sweep=SWEEP)
PLAIN["problem"]["load"] = {"profile": 1.0, "initial_stress": 0.0, "normal_pressure": 5e6}
PLAIN["random"]["strength"]["mean_mode"] = True
PLAIN["random"]["strength"]["spectrum"] |= {"exponent": 4.0, "power_kept": 0.9997}


def mutation(chance: random.Random) -> tuple[str, bytes]:
    """What was done, and the file that came of it."""
    if chance.random() < 0.25:
        return "bytes", mutated(tomli_w.dumps(PLAIN).encode(), chance)
    tree = copy.deepcopy(PLAIN)
    texts = [mutated_tree(tree, chance) for _ in range(chance.choice((1, 1, 1, 2, 3)))]
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

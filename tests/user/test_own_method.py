"""A method of somebody else's package: in `onset`, `monte_carlo`, a study file and a report."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import stiction as st
from stiction.results import onset_variables
from stiction.variables import Variable

METHOD = '''\
from dataclasses import dataclass
from typing import Literal

import numpy as np
from stiction.results import onset_variables
from stiction.variables import Variable


@dataclass(frozen=True)
class WeakestNode:
    """The interface slides when its weakest node does."""

    share: float = 1.0
    type: Literal["weakest_node"] = "weakest_node"

    label = "weakest node"
    chunk_size = 256

    def variables(self, problem):
        return onset_variables(problem.interface) | {"margin": Variable("Pa", "mean less least")}

    def seconds_per_sample(self, problem):
        return 1e-6

    def supports(self, problem):
        return ["it does not take planes"] if problem.interface.is_plane else []

    def prepare(self, problem):
        def solve(sample):
            excess = sample.strength - sample.initial_stress
            load = self.share * excess.min(axis=1)
            return {
                "critical_load": load,
                "critical_stress": sample.mean_stress(load),
                "first_instability": sample.mean_stress(load),
                "critical_position": problem.interface.x[excess.argmin(axis=1)],
                "margin": sample.strength.mean(axis=1) - load,
            }

        return solve
'''

STUDY = """\
[problem]
solid = { shear_modulus = 1e9, poisson_ratio = 0.33, density = 1170.0 }
interface = { length = 0.1, nodes = 256 }
friction = { weakening_rate = 0.5e12 }

[random.strength]
marginal = { type = "beta", alpha = 1.5, beta = 3.0, low = 0.66e6, high = 1.66e6 }
spectrum = { type = "power_law", correlation_length = 3e-3 }

[method]
type = "weakest_node"
share = 0.5

[ensemble]
samples = 64
"""

SCRIPT = """\
import sys
import numpy as np, stiction as st
from weakest import WeakestNode
from stiction.cli import main

study = st.Study.from_toml("study.toml")
assert study.method == WeakestNode(0.5)
found = study.run()
tau_p = study.random.profiles(study.problem.interface, samples=64)["strength"]
assert np.array_equal(found.critical_load, 0.5 * tau_p.min(axis=1))
own = st.onset(study.problem, tau_p, method=WeakestNode(0.5))
assert own.margin.attrs["units"] == "Pa" and own.critical_load.equals(found.critical_load)
again = st.Study.from_result(found)
assert again == study
for words in ("run study.toml --out found", "report found"):
    sys.argv = ["stiction", *words.split()]
    try:
        main()
    except SystemExit as ended:
        assert not ended.code
"""


class Broken:
    """A method whose solver does not keep what its variables promise."""

    type, label, chunk_size = "broken", "broken", 4

    def __init__(self, change, promise=()):
        self.change, self.promise = change, promise

    def variables(self, problem):
        return onset_variables(problem.interface) | dict(self.promise)

    def seconds_per_sample(self, problem):
        return 1e-6

    def supports(self, problem):
        return []

    def prepare(self, problem):
        names = onset_variables(problem.interface)
        return lambda sample: {name: np.ones(sample.samples) for name in names} | self.change


@pytest.mark.parametrize(
    ("method", "words"),
    [
        (
            Broken({}, {"margin": Variable("Pa", "margin")}),
            "broken must return .*, margin; got",
        ),
        (Broken({"margin": np.ones(3)}), "broken must return .*; got .*, margin"),
        (
            Broken({"critical_load": np.ones(2)}),
            r"'critical_load' of shape \(3,\) over \(sample\), got \(2,\)",
        ),
    ],
)
def test_a_solver_that_breaks_its_promise_is_refused(method, words):
    problem = st.paper.problem(nodes=256)
    strength = 1e6 + np.arange(256.0) * np.ones((3, 1))
    with pytest.raises(st.InputError, match=words):
        st.onset(problem, strength, method=method)


def test_a_method_from_another_package(tmp_path):
    """Offered by an entry point, without a line in this package that names it."""
    (tmp_path / "weakest.py").write_text(METHOD)
    info = tmp_path / "weakest-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: weakest\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[stiction.methods]\nweakest_node = weakest:WeakestNode\n"
    )
    (tmp_path / "study.toml").write_text(STUDY)
    package = Path(st.__file__).parents[1]
    paths = os.pathsep.join([str(tmp_path), str(package)])
    env = os.environ | {"PYTHONPATH": paths, "MPLBACKEND": "Agg"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=tmp_path, env=env, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    pages = list(tmp_path.rglob("*.html"))
    assert pages
    assert "weakest node" in pages[0].read_text()

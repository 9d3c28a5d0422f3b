"""A method of somebody else's package: in `onset`, `monte_carlo`, a study file and a report."""

import os
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from checks import python
from refusals import refuses
from small_study import small_study

import stiction as st
from stiction.results import onset_variables
from stiction.variables import Variable

EXAMPLE = Path(__file__).parents[2] / "examples" / "my_method.py"
SCRIPT = """\
import sys
import numpy as np, stiction as st
from weakest import WeakestWindow
from stiction.cli import main

study = st.Study.from_toml("study.toml")
assert study.method == WeakestWindow(0.005)
found = study.run()
tau_p = study.random.profiles(study.problem.interface, samples=64)["strength"]
own = st.onset(study.problem, tau_p, method=WeakestWindow(0.005))
assert own.critical_load.equals(found.critical_load)
assert st.Study.from_result(found) == study
for words in ("run study.toml --out found", "report found"):
    sys.argv = ["stiction", *words.split()]
    try:
        main()
    except SystemExit as ended:
        assert not ended.code
"""


def test_a_method_from_another_package(tmp_path):
    """The one of the example, offered by an entry point, as docs/architecture.md describes it."""
    text = EXAMPLE.read_text().split("\n\nproblem = ")[0]
    text = text.replace("from dataclasses", "from typing import Literal\nfrom dataclasses")
    text = text.replace("type = ", 'type: Literal["weakest_window"] = ')
    (tmp_path / "weakest.py").write_text(text)
    info = tmp_path / "weakest-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: weakest\nVersion: 1.0\n")
    entry = "[stiction.methods]\nweakest_window = weakest:WeakestWindow\n"
    (info / "entry_points.txt").write_text(entry)
    method = {"type": "weakest_window", "length": 0.005}
    study = small_study(method=method, ensemble={"samples": 64})
    (tmp_path / "study.toml").write_text(tomli_w.dumps(study))
    paths = os.pathsep.join([str(tmp_path), str(Path(st.__file__).parents[1])])
    python("-c", SCRIPT, cwd=tmp_path, PYTHONPATH=paths, MPLBACKEND="Agg")
    (page,) = tmp_path.rglob("*.html")
    assert "weakest window" in page.read_text()


class Broken:
    """A method whose solver does not keep what its variables promise."""

    type, label = "broken", "broken"

    def __init__(self, change, promise=(), seconds=1e-6):
        self.change, self.promise, self.seconds = change, promise, seconds

    def variables(self, problem):
        return onset_variables(problem.interface) | dict(self.promise)

    def seconds_per_sample(self, problem):
        return self.seconds

    def supports(self, problem):
        return []

    def prepare(self, problem):
        names = onset_variables(problem.interface)
        return lambda sample: {name: np.ones(sample.samples) for name in names} | self.change


MARGIN = {"margin": Variable("Pa", "margin")}
BROKEN = {
    "broken must return ... , margin; got": Broken({}, MARGIN),
    "broken must return ... ; got ... , margin": Broken({"margin": np.ones(3)}),
    "'critical_load' of shape (3,) over (sample), got (2,)": Broken({"critical_load": [1.0, 1.0]}),
}  # fmt: skip


@pytest.mark.parametrize("words", BROKEN)
def test_a_solver_that_breaks_its_promise_is_refused(words):
    strength = 1e6 + np.arange(256.0) * np.ones((3, 1))
    problem = st.paper.problem(nodes=256)
    refuses(words, lambda: st.onset(problem, strength, method=BROKEN[words]))


@pytest.mark.parametrize("seconds", [np.nan, -1.0, "fast"])
def test_a_time_that_is_none_is_refused(seconds):
    problem, method = st.paper.problem(nodes=256), Broken({}, seconds=seconds)
    strength = st.paper.strength(problem, correlation_ratio=2.0)
    words = "method: seconds_per_sample of broken must return a number of seconds"
    refuses(words, lambda: st.onset(problem, np.full((3, 256), 1e6), method=method))
    refuses(words, lambda: st.failure_probability(problem, strength, 0.7e6, method=method))

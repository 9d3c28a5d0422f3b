"""Imports run downwards (docs/developers/architecture.md); kernels depend on kernels only."""

import configparser
import os
import re
import tomllib
from pathlib import Path

import scipy.stats
from checks import python
from refusals import refuses

import stiction as st
from stiction.base.kinds import register
from stiction.base.model import model
from stiction.random.marginals import Marginal

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "src" / "stiction"


def test_imports_run_downwards():
    """Those inside functions and under TYPE_CHECKING included."""
    python("-c", "from importlinter.cli import lint_imports_command as f; f()", cwd=ROOT)


def worked_examples(language: str) -> list[str]:
    page = (ROOT / "docs" / "guide" / "extend-and-connect.md").read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", page, flags=re.DOTALL)


READ = """
import contextlib, sys, numpy as np, stiction as st
from stiction.cli import commands

def command(*arguments):
    sys.argv = ["stiction", *arguments]
    with contextlib.suppress(SystemExit), contextlib.redirect_stderr(sys.stdout):
        commands.main()

command("run", "study.toml", "--out", "found", "--workers", "1")
found = st.open_run("found")
assert found.study == st.Study.from_toml("study.toml") == st.Study.from_dict(found.study.to_dict())
names = [type(one).__name__ for one in (
    found.study.problem.friction, found.study.method,
    found.study.random.strength.marginal, found.study.random.strength.spectrum)]
assert "my_package" in sys.modules and found.dataset().sizes == {"sample": 8}, names
own = sys.modules["my_package"]
assert np.array_equal(own.onset.critical_load, found.dataset().critical_load)
# sin(x/xi)/(x/xi) of a band falls to 1/e at 2.2006 xi, a little further without 0.03 % of it.
assert abs(own.field.spectrum.efolding_length / 2e-3 - 2.2006) < 2e-3
values = own.field.sample(st.Interface(length=0.1, nodes=256), samples=200, seed=1)
assert abs(values.mean() / 1.2e6 - 1.0) < 5e-3  # four standard errors
print(*names)
command("check", "torn.toml")
"""


def test_a_package_adds_one_of_each_kind_as_the_page_shows(tmp_path):
    """In Python, by entry points in a study file, on the command line, and read back."""
    (tmp_path / "my_package.py").write_text("\n\n".join(worked_examples("python")))
    entries, study = worked_examples("toml")
    (tmp_path / "study.toml").write_text(study)
    (tmp_path / "torn.toml").write_text(study.replace('"square"', '"torn"'))
    offered = tomllib.loads(entries)["project"]["entry-points"]
    offered["stiction.laws"]["torn"] = "my_package:NoSuchLaw"
    # What an installed package leaves beside its modules.
    info, points = tmp_path / "my_package-1.0.dist-info", configparser.ConfigParser()
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-package\nVersion: 1.0\n")
    points.read_dict(offered)
    with (info / "entry_points.txt").open("w") as file:
        points.write(file)
    places = {"cwd": tmp_path, "MPLBACKEND": "Agg"}
    places["PYTHONPATH"] = os.pathsep.join(map(str, (tmp_path, SOURCES.parent)))
    said = python("-c", READ, **places)
    assert "\nSquareWeakening WeakestNode Triangular BandSpectrum\n" in said
    # What cannot be imported is an error where it is named.
    words = "'torn' of the package my-package (entry point of stiction.laws) cannot be used"
    assert words in said.splitlines()[-1]


def test_a_class_is_registered_by_a_type_of_its_own():
    @model
    class Unregistered(Marginal):
        type: str = "unregistered"

        @property
        def distribution(self):
            return scipy.stats.uniform(1e6, 2e5)

    register(Unregistered)
    given, spectrum = {"type": "unregistered", "width": 0.0}, st.PowerLawSpectrum(4e-3)
    words = "marginal: unknown 'width' (valid: type)"
    refuses(words, lambda: st.RandomField(marginal=given, spectrum=spectrum))

    @model
    class Another(Unregistered):
        pass

    refuses("Another: type 'unregistered' is taken by ... Rename it", lambda: register(Another))
    refuses("needs a field such as type", lambda: register(Marginal))
    Another.__abstractmethods__ = frozenset({"distribution"})
    refuses("Another: must define distribution", lambda: register(Another))

"""What a user and an editor see of the package."""

import subprocess
import sys

import pytest

import stiction as st


def test_completion_lists_public_names_only():
    assert dir(st) == sorted(st.__all__)
    code = "import stiction as st, numpy; st.Solid; print(' '.join(dir(st)))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == sorted(st.__all__)


MISTAKES = """\
import stiction as st

solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, densty=1170.0)
interface = st.Interface(length="0.1", nodes=1024)
law = st.LinearWeakening(weakening_rat=5e11)
beta = st.Beta(alpha=1.5, beta=3.0, low=0.66e6)
method = st.Equilibrum()
problem = st.Problem(interface, solid, law)
result = st.monte_carlo(problem, "strength", method=st.LocalCriterion(), samples=10)
run = st.Rupture(loading_rate="fast")
"""


def test_a_type_checker_finds_every_mistake(tmp_path):
    """Each line but the first holds one mistake; the same lines put right hold none."""
    pytest.importorskip("basedpyright")
    import json

    wrong = tmp_path / "wrong.py"
    wrong.write_text(MISTAKES)
    right = tmp_path / "right.py"
    right.write_text(
        MISTAKES.replace("densty", "density")
        .replace('"0.1"', "0.1")
        .replace("weakening_rat=", "weakening_rate=")
        .replace("low=0.66e6", "low=0.66e6, high=1.66e6")
        .replace("Equilibrum", "Equilibrium")
        .replace("interface, solid, law", "solid, interface, law")
        .replace('"strength"', "st.RandomField(beta, st.PowerLawSpectrum(1e-3))")
        .replace('"fast"', "2e7")
    )
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "basedpyright",
            "--level",
            "error",
            "--outputjson",
            str(tmp_path),
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    found = json.loads(done.stdout)["generalDiagnostics"]
    errors = [d for d in found if d["severity"] == "error"]
    lines = {d["range"]["start"]["line"] for d in errors if d["file"].endswith("wrong.py")}
    assert lines == {i for i, line in enumerate(MISTAKES.splitlines()) if line and i > 1}
    assert not [d["message"] for d in errors if d["file"].endswith("right.py")]

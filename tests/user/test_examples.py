"""How-tos and other scripts run, the long ones in small, and what they find is right."""

import ast
import re
import runpy
from importlib import import_module as load
from pathlib import Path

import numpy as np
import pytest

import stiction as st

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


def method(found):
    """The window is off by more than the criterion, but no more than some per cent."""
    exact = found["exact"]
    window, local = (
        np.abs(found["onsets"][name].critical_stress / exact - 1.0).mean()
        for name in ("weakest window", "local criterion")
    )
    assert local < window < 0.05


def correlated(found):
    """Arrest becomes rare: 27 % against 5 % on the page of what-ifs."""
    rare, often = ((found["onsets"][rho].arrested_events > 0).mean() for rho in (0.8, 0.0))
    assert rare < 0.5 * often


def critical_slip(found):
    """Where it varies, weak places may also weaken fast: the same samples slide earlier."""
    onsets = found["onsets"]
    change = onsets["d_c random"].critical_stress - onsets["d_c uniform"].critical_stress
    assert float(change.mean()) < -2.0 * float(change.std()) / np.sqrt(change.size)


CHECKS = {
    "my_method": method,
    "correlated_residual_strength": correlated,
    "random_critical_slip": critical_slip,
}
HOW_TOS = ["my_spectrum", "nonuniform_load", "between_specimens", "arrested_events", *CHECKS]


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in CHECKS else pytest.mark.slow) for name in HOW_TOS],
)
def test_a_how_to(name, monkeypatch, tmp_path, capsys):
    """Those without a check run whenever the pages are built: their gallery is made of them."""
    monkeypatch.chdir(tmp_path)
    path = EXAMPLES / f"{name}.py"
    found = runpy.run_path(str(path))
    said = capsys.readouterr().out
    assert 2 <= len(said.splitlines()) <= 8
    assert max(map(len, said.splitlines())) <= 150
    assert re.search(r"\d", said)
    assert "nan" not in said
    assert "?" in ast.get_docstring(ast.parse(path.read_text()))  # the question that it answers
    if name in CHECKS:
        CHECKS[name](found)


def test_the_tables_list_every_how_to():
    text = (ROOT / "examples" / "README.md").read_text()
    assert [name for name in HOW_TOS if f"]({name}.py)" not in text] == []


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_simulated_campaigns_of_inference():
    """A campaign of validation/inference.py in small: the script calls the package as it is."""
    inference = load("inference")
    for case in inference.cases().values():
        names, ranks = inference.ranks(1, case, samples=60, points=10 ** len(case.prior))
        assert names == tuple(case.prior)
        assert ranks.shape == (1, len(names))
        assert ((ranks >= 0) & (ranks <= inference.DRAWS)).all()


# -- docs/evidence/rupture-benchmarks.md, coarser: the community's fault, and its line -----------

FAULT = load("community_benchmark")
"""200 m are 4 nodes to the nucleation length across the slip."""


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_line_arrives_with_a_spectral_element_code():
    """When half of the strength is lost at five places on the line in mode II, s."""
    line = st.Interface(length=60e3, nodes=300, extent=(15e3, 45e3))
    away = np.abs(line.x - 30e3)
    friction = st.LinearWeakening(
        critical_slip=FAULT.CRITICAL_SLIP, residual_strength=FAULT.RESIDUAL
    )
    initial = np.where(away <= 1500.0, FAULT.INSIDE, FAULT.AROUND)
    problem = st.Problem(FAULT.SOLID, line, friction, st.Load(initial_stress=initial))
    still = ([0.0, 100.0], [0.0, 0.0])
    run = st.simulate_rupture(
        problem,
        np.full(300, FAULT.STRENGTH),
        method=st.Rupture(load_history=still, implicit=False, stop="time", end_time=5.3),
        save=st.Save([], every=1000),
    )
    places = [3e3, 6e3, 9e3, 12e3, 14.9e3]
    found = np.interp(places, line.x - 30e3, run.arrival_time.values)
    # An independent spectral-element code, nodes 250 m apart; 0.7 % between the two at 12.5 m.
    assert found == pytest.approx([1.083, 2.119, 3.120, 4.105, 5.048], rel=0.01)

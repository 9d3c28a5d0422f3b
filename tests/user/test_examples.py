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


def failure(found):
    """Two methods agree in the tail, and P = 1e-6 lies between 1 and 3 kPa above the bound."""
    one, other = found["found"], found["again"]
    error = np.hypot(one.cv, other.cv)  # joint
    assert abs(np.log(one.probability / other.probability)) < 4.0 * error
    assert 1e3 < found["design"].stress_above_bound < 3e3


def stored(found):
    """All is there; longer correlation lowers the static strength."""
    assert found["status"].done == found["status"].samples == 3000
    medians = found["result"].critical_stress.median("sample").values
    assert np.all(np.diff(medians) < 0.0)


CHECKS = {
    "my_method": method,
    "correlated_residual_strength": correlated,
    "random_critical_slip": critical_slip,
    "failure_probability": failure,
    "stored_sweep": stored,
}
HOW_TOS = [
    "my_measured_profile", "my_spectrum", "nonuniform_load", "scanned_interface",
    "between_specimens", "one_rupture", "arrested_events", *CHECKS,
]  # fmt: skip


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
    text = (ROOT / "README.md").read_text()
    assert [name for name in HOW_TOS if f"examples/{name}.py" not in text] == []


@pytest.mark.slow
@pytest.mark.slow
def test_scripts_of_validation():
    """What they compute is checked in exact/, oracle/ and paper/."""
    found = load("memory").compute()
    # 4.8e-8 and 1.3e-3 on the page.
    assert found["exponentials, 1e-06"].max() < 1e-6
    assert 1e-4 < found["history cut at 100"].max() < 1e-2
    for slow, fast in load("onset").compute(256, 2, (1e5, 2e7)).values():
        assert np.abs(slow).max() < 5e-6
        assert np.abs(fast).max() < 1e-3
    slip, stress = load("grid").compute((0.25,), (512, 2048), samples=2)[0.25, 512]
    # Largest of six fields on the page: 3.1 % and 0.06 %; a quarter of the dx^2 is left out.
    assert 1e-4 < slip.max() < 0.04
    assert stress.max() < 1e-3
    (_, coarse), (_, fine), *_ = load("energy").compute()
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.3)  # 1.93 on the page
    (_, coarse), (_, fine), *_ = load("waves").compute()
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.3)
    assert all(error < tol for (_, tol), (_, error) in load("kernels").compute().items())
    fast, slow = (speed[-1] for _, speed in load("rupture_speed").compute((0.5, 2.0)).values())
    assert slow < 1.0 < 1.5 < fast


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning", "ignore::stiction.UnitWarning")
def test_stick_slips_of_a_fault(monkeypatch):
    """The page's rig, in small: its machine, a cycle's drop over slip, and where ruptures begin."""
    slips = load("stick_slips")
    monkeypatch.setattr(slips, "SAMPLES", 20)
    machine, blocks = slips.machine_of(0.594e9)
    problem = slips.rig(machine, slips.CENTRAL[0], nodes=64)
    # Both ends push: relief is h of docs/specimens.md, and the stiffnesses are in series.
    assert problem.blocks.relief == pytest.approx(0.594e9, rel=1e-3)
    assert 1.0 / (1.0 / machine + 1.0 / blocks) == pytest.approx(0.594e9 * 0.4, rel=1e-3)
    found, slid = slips.onsets(problem, slips.strength_of(slips.CENTRAL[1], 0.5, 0.2))
    drop, slip, spread = slips.of_model(problem, found, slid)
    # Slip before the rupture, at the ends, is some microns; after it nothing is left to slip.
    assert np.all((drop / slip > 0.5e9) & (drop / slip < 0.594e9))
    assert 1.5e-6 < spread.mean() < 3e-6
    most = problem.interface.x[found.slip.to_numpy().argmax(axis=1)]
    assert np.all(np.abs(most - 2.0) > 1.0)
    # With inertia the blocks swing beyond rest: less than twice as far, for friction takes some.
    monkeypatch.setattr(slips, "CYCLES", 4)
    strength = slips.strength_of(slips.CENTRAL[1], 0.5, 0.2)
    still = slips.last_events(problem, strength)
    waves = slips.last_events(problem, strength, st.Rupture(arrival=0.05))
    rested = still.arrests == 0
    first = slips.of_model(problem, found[{"sample": slice(4)}], slid[:4])
    assert rested.sum() >= 2
    # The peak, from which `of_model` counts, may be passed just before the instability.
    assert np.allclose(still["drop"][rested], first[0], rtol=2e-3)
    assert np.all(still["drop"][rested] <= first[0] * (1.0 + 1e-9))
    assert np.allclose(still.slip[rested], first[1], rtol=1e-6)
    assert np.all((waves.slip / still.slip > 1.5) & (waves.slip / still.slip < 2.0))
    ratio = waves["drop"] / waves.slip
    assert np.all((ratio > 0.5e9) & (ratio < 0.594e9))
    start = slips.read_table()
    line = np.polyfit(start.time[1:], slips.without_trend(start[1:], "before"), 1)
    assert abs(line[0]) < 1e-6
    # Residuals are correlated: 8.824 Pa/s by sums of outer products, 5.0 as if they were not.
    error = slips.error_of_slope(start.time[1:].to_numpy(), start.before[1:].to_numpy())
    assert error == pytest.approx(8.824, rel=1e-3)
    monkeypatch.setattr("sys.argv", ["stick_slips.py", "--quik"])
    with pytest.raises(SystemExit, match="--quik: no such folder"):
        slips.main()


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_interaction_lowers_the_onset_most_on_planes(monkeypatch):
    """Eight nodes in h_n, six samples, and one correlation length."""
    study = load("line_and_plane")
    monkeypatch.setattr(study, "CASES", {"line": (16, 8, 6), "plane": (4, 8, 6)})
    (line, _), (plane, far) = (study.lowering(name, 0.5, 6, seed=3) for name in study.CASES)
    # The local criterion is an upper bound of the discrete problem, up to the gap of 1e-6.
    assert np.all(plane > -1e-4)
    assert plane.mean() > line.mean()
    # Slip that is held back near the critical patch can only raise the onset.
    assert np.all(far > -1e-4)
    assert 0.0 < far.mean() < plane.mean()


# -- docs/rupture-benchmarks.md, coarser: the community's fault, and its line ----------------------

FAULT = load("community_benchmark")
"""200 m are 4 nodes to the nucleation length across the slip."""


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_line_arrives_with_a_spectral_element_code():
    """When half of the strength is lost at five places on the line in mode II, s."""
    line = st.Interface(length=60e3, nodes=300)
    away = np.abs(line.x - 30e3)
    friction = st.LinearWeakening(
        critical_slip=FAULT.CRITICAL_SLIP, residual_strength=FAULT.RESIDUAL
    )
    initial = np.where(away <= 1500.0, FAULT.INSIDE, FAULT.AROUND)
    problem = st.Problem(FAULT.SOLID, line, friction, st.Load(initial_stress=initial))
    still = ([0.0, 100.0], [0.0, 0.0])
    run = st.simulate_rupture(
        problem,
        np.where(away <= 15e3, FAULT.STRENGTH, np.inf),
        method=st.Rupture(load=still, implicit=False, stop="time", end_time=7.0),
        save=st.Save([], every=1000),
    )
    places = [3e3, 6e3, 9e3, 12e3, 14.9e3]
    found = np.interp(places, line.x - 30e3, run.arrival_time.values)
    # An independent spectral-element code, nodes 250 m apart; 0.7 % between the two at 12.5 m.
    assert found == pytest.approx([1.083, 2.119, 3.120, 4.105, 5.048], rel=0.01)

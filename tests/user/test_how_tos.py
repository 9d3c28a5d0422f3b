"""The how-tos of examples/: each runs, says something readable, and what it says is right."""

import ast
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


def measured_profile(found):
    """Interaction only lowers the onset; both begin where the strength is low."""
    exact = found["onset"]  # of the last method, equilibrium
    local = found["st"].onset(
        found["problem"], found["profile"], method=found["st"].LocalCriterion()
    )
    assert exact.critical_stress < local.critical_stress.item()
    near = np.abs(found["x"] * 1e-3 - exact.critical_position.item()) < 1.5e-3
    assert found["tau_p"][near].mean() < np.quantile(found["tau_p"], 0.1)


def spectrum(found):
    """Both fields have one distribution and one decay length, and still another onset."""
    machined, power_law = (found["onsets"][name] for name in ("machined", "power law"))
    assert found["alike"].efolding_length == pytest.approx(
        found["own"].efolding_length, rel=1e-9
    )
    difference = abs(float(machined.mean() - power_law.mean()))
    assert difference > 5.0 * float(machined.std()) / np.sqrt(machined.size)


def method(found):
    """The window is off by more than the criterion, but no more than some per cent."""
    exact = found["exact"]
    window, local = (
        np.abs(found["onsets"][name].critical_stress / exact - 1.0).mean()
        for name in ("weakest window", "local criterion")
    )
    assert local < window < 0.05


def nonuniform_load(found):
    """None begins in the middle where the ends are loaded twice as high."""
    onsets, length = found["onsets"], found["plain"].interface.length
    place = onsets["high at the ends"].critical_position / length
    assert not ((place > 0.25) & (place < 0.75)).any()
    # Strength less initial stress differs by 0.2 MPa at most, and so does the load (monotony).
    change = (
        onsets["uniform, with initial stress"].critical_load - onsets["uniform"].critical_load
    )
    assert (abs(change) <= 0.2e6).all()
    assert change.mean() < 0.0


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
    error = np.hypot(one.cv, other.cv)
    assert (
        abs(np.log(one.probability / other.probability)) < 4.0 * error
    )  # joint standard errors
    assert 1e3 < found["design"].stress_above_bound < 3e3


def scanned(found):
    """The scan holds a specimen near its measured values, and its answer is not that of any."""
    given, line = found["given"], found["problem"].interface
    near = np.abs(given.quantile(line, 0.5)[: line.size // 3] - found["scan"].values)
    assert near.mean() < 20e3  # the error of the scan


def between(found):
    """Both scatters add, as squares, and the tail lies lower."""
    one, other = (onset.critical_stress for onset in found["onsets"].values())
    cv = [float(each.std() / each.mean()) for each in (one, other)]
    assert cv[1] ** 2 - cv[0] ** 2 == pytest.approx(0.1**2, rel=0.25)  # 2,000 samples: 3 % each


def stored(found):
    """All is there; longer correlation lowers the static strength."""
    assert found["status"].done == found["status"].samples == 3000
    medians = found["result"].critical_stress.median("sample").values
    assert np.all(np.diff(medians) < 0.0)


def rupture(found):
    """Without residual strength all of the critical stress drops; the front is supershear here."""
    run = found["run"]
    assert run.stress_drop.item() == pytest.approx(run.critical_stress.item(), rel=1e-3)
    solid = found["problem"].solid
    assert run.median_rupture_speed.item() > np.sqrt(solid.shear_modulus / solid.density)


def arrested(found):
    """The path passes the events that the method counts for that sample."""
    onset, path = found["onset"], found["path"]
    assert onset.arrested_events.item() >= path.arrested_events[-1] > 0
    assert found["onset"].critical_stress > found["onset"].first_instability


HOW_TOS = {
    "my_measured_profile": measured_profile,
    "my_spectrum": spectrum,
    "my_method": method,
    "nonuniform_load": nonuniform_load,
    "correlated_residual_strength": correlated,
    "random_critical_slip": critical_slip,
    "failure_probability": failure,
    "scanned_interface": scanned,
    "between_specimens": between,
    "stored_sweep": stored,
    "one_rupture": rupture,
    "arrested_events": arrested,
}


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
@pytest.mark.parametrize("name", HOW_TOS)
def test_a_how_to(name, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    path = EXAMPLES / f"{name}.py"
    found = runpy.run_path(str(path))
    said = capsys.readouterr().out
    assert 2 <= len(said.splitlines()) <= 8
    assert max(map(len, said.splitlines())) <= 150
    assert re.search(r"\d", said)
    assert "nan" not in said
    assert "?" in ast.get_docstring(ast.parse(path.read_text()))  # the question that it answers
    HOW_TOS[name](found)


def test_the_tables_list_every_how_to():
    for page in ("README.md", "docs/README.md"):
        text = (ROOT / page).read_text()
        assert [name for name in HOW_TOS if f"examples/{name}.py" not in text] == []

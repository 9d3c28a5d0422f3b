"""A field that was measured in part, in study files and tails."""

import numpy as np
import pytest
import xarray as xr
from small_study import small_study

import stiction as st

OWN = st.Study.from_dict(small_study())
FIELD, LINE = OWN.random.strength, OWN.problem.interface
SCANNED = FIELD.sample(LINE, seed=9)[0]
KNOWN = xr.DataArray(SCANNED, {"x": LINE.x}, "x")[:40]


@pytest.fixture
def study(tmp_path, monkeypatch):
    """The plain form of a study whose strength was scanned over a third."""
    monkeypatch.chdir(tmp_path)
    plain = small_study()
    header = "x (mm),strength (MPa)"
    table = np.column_stack([LINE.x[:40] * 1e3, SCANNED[:40] * 1e-6])
    np.savetxt("scan.csv", table, delimiter=",", header=header, comments="")
    plain["random"]["strength"]["given"] = {"profile": "scan.csv", "noise": 20e3}
    return plain


def test_a_study_file_is_the_same_as_the_calls(study):
    read = st.Study.from_dict(study, folder=".")
    result = read.run()
    given = FIELD.given(st.read_profile("scan.csv"), noise=20e3)
    called = st.monte_carlo(read.problem, given, method=read.method, samples=30, seed=3)
    assert np.array_equal(result.critical_stress, called.critical_stress)
    assert st.Study.from_result(result) == read
    read.run(out="RUN")
    assert st.open_run("RUN").study == read
    sweep = [{"random.strength.given.noise": [5e3, 20e3]}]
    swept = study | {"sweep": sweep, "ensemble": {"samples": 3}}
    found = st.Study.from_dict(swept, folder=".").run()
    assert found.critical_stress.sizes == {"noise": 2, "sample": 3}


@pytest.mark.parametrize(
    ("name", "heading", "unit"),
    [("strength", "mu", 1.0), ("critical_slip", "d_c (um)", 1e-6)],
)
def test_a_file_holds_the_property_that_was_measured(study, name, heading, unit):
    """A coefficient where the field is of those; any other property by its own name."""
    field = {
        "marginal": {"type": "lognormal", "mean": 0.5 * unit, "cv": 0.15},
        "spectrum": study["random"]["strength"]["spectrum"],
        "given": {"profile": "measured.csv", "noise": 0.01 * unit},
    }
    if name == "strength":
        field["of"] = "friction_coefficient"
    study["problem"]["load"] = {"normal_pressure": 2e6}
    study["random"][name] = field
    table = np.column_stack([[10.0, 20.0], [0.45, 0.55]])
    np.savetxt("measured.csv", table, delimiter=",", header=f"x (mm),{heading}", comments="")
    read = st.Study.from_dict(study, folder=".")
    values = read.random.properties[name].conditions.values
    np.testing.assert_allclose(values, [0.45 * unit, 0.55 * unit], rtol=1e-12)


def test_the_tail_of_a_scanned_specimen(study):
    """Failure probability against counting ten times as many samples."""
    read = st.Study.from_dict(study, folder=".")
    given = {"problem": read.problem, "random": read.random, "method": read.method}
    counted = st.monte_carlo(**given, samples=10_000, seed=8, pilot=False).critical_stress
    stress = float(counted.quantile(0.01))
    found = st.failure_probability(**given, stress=stress, algorithm="subset", target_cv=0.15)
    error = np.hypot(0.1, found.cv)  # of 100 failures, and of the answer
    assert abs(np.log(found.probability / 0.01)) < 3.5 * error


@pytest.mark.filterwarnings(
    "ignore::stiction.AccuracyWarning"
)  # of values that are so unlikely
def test_what_was_measured_may_be_rarer_than_what_is_called_impossible():
    """A place at 0.3 MPa, as of one node in 1e23: without the scan nothing slides at 0.33 MPa."""
    field = st.RandomField(st.Lognormal(mean=1e6, cv=0.12), FIELD.spectrum)
    weak = KNOWN.copy(data=np.full(KNOWN.size, 0.3e6))
    options = {"stress": 0.33e6, "method": OWN.method, "target_cv": 0.5, "progress": False}
    without = st.failure_probability(OWN.problem, field, **options)
    assert (without.probability, without.algorithm) == (0.0, "exact")
    found = st.failure_probability(OWN.problem, field.given(weak, noise=1e3), **options)
    assert found.probability == 1.0

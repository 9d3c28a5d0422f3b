"""A study, swept or not, is the same in Python, in TOML and in the attributes of its result."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
import tomli_w
from recording import stored
from refusals import refuses
from small_study import altered, small_study

import stiction as st
from stiction.base.errors import StoreError

STUDY = small_study()
BASE = st.Study.from_dict(STUDY)
LENGTH = "random.strength.spectrum.correlation_length"
LOGNORMAL = {"type": "lognorm", "s": 0.2, "scale": 1e6}


def loaded(folder=".", **values):
    return st.Study.from_dict(altered(STUDY, **values), folder=folder)


def swept(*axes, **values):
    return loaded(**{"sweep": list(axes)} | values)


def in_python(**parts):
    return dataclasses.replace(BASE, **parts)


# -- one study in all its forms ------------------------------------------------------------------


def test_a_sweep_in_toml_python_and_the_result(tmp_path):
    text = """
    [[sweep]]
    "random.strength.spectrum.correlation_length" = [4e-3, 6e-3, 8e-3]
    [[sweep]]
    problem.solid.density = [1000.0, 2000.0]
    problem.solid.poisson_ratio = [0.2, 0.3]
    """
    path = tmp_path / "study.toml"
    BASE.to_toml(path)
    path.write_text(path.read_text() + text)
    study = st.Study.from_toml(path)
    solids = {"problem.solid.density": [1e3, 2e3], "problem.solid.poisson_ratio": [0.2, 0.3]}
    assert study == in_python(sweep=[{LENGTH: np.array([4e-3, 6e-3, 8e-3])}, solids])
    assert st.Study.from_result(study.run()) == study
    study.to_toml(path)
    assert st.Study.from_toml(path) == study


def test_a_study_that_cannot_be_written_is_a_failure_of_the_run(tmp_path):
    """As for other files: a full disk is no invalid input."""
    path = tmp_path / "missing" / "study.toml"
    refuses("cannot be written: No such file", lambda: BASE.to_toml(path), StoreError)


def test_a_function_cannot_be_written_down(tmp_path):
    def bell(k):
        return np.exp(-((k * 1e-3) ** 2))

    field = dataclasses.replace(BASE.random.strength, spectrum=st.CustomSpectrum(bell, 8e3))
    own = in_python(random=field)
    words = "cannot be written down: spectrum.function is the Python function 'bell'"
    refuses(words, lambda: own.to_toml(tmp_path / "study.toml"))
    assert "bell" in own.run().attrs["study_incomplete"]
    spectra = [BASE.random.strength.spectrum, field.spectrum]
    pair = in_python(sweep=[{"random.strength.spectrum": spectra}])
    assert pair.run()["critical_stress"].shape == (2, 30)
    refuses("bell", pair.to_dict)


# -- points of a sweep ---------------------------------------------------------------------------


def test_whole_tables_are_values_too():
    marginals = [STUDY["random"]["strength"]["marginal"], LOGNORMAL]
    study = swept({"random.strength.marginal": marginals})
    np.testing.assert_array_equal(study.run()["marginal"], ["beta", "lognorm"])
    mean = study.experiments[1].random.members[0].strength.mean
    assert mean == pytest.approx(scipy.stats.lognorm(0.2, scale=1e6).mean())
    scales = {"random.strength.marginal.scale": [1e6, 2e6]}
    stress = swept(scales, random__strength__marginal=LOGNORMAL).run()["critical_stress"].values
    # The onset is linear in the strength: twice the scale, twice the stress, to round-off.
    np.testing.assert_allclose(stress[1], 2.0 * stress[0], rtol=1e-12)


def test_a_correlation_coefficient_is_swept():
    """The strength has the same draws at every coefficient; the coordinate is a pure number."""
    field = STUDY["random"]["strength"]
    residual = field | {"marginal": LOGNORMAL | {"scale": 1e5}}
    kept = {"samples": 2, "keep": ["strength", "residual_strength"]}
    key = "random.correlation.strength.residual_strength"
    given = {"random__residual_strength": residual, **kept}
    result = swept({key: [-1.0, 0.0, 1.0]}, **given).run()
    rho = result["random_correlation_strength_residual_strength"]
    assert rho.attrs == {"units": "1", "long_name": key}
    np.testing.assert_array_equal(result.strength[0], result.strength[2])
    flat = zip(result.strength.values, result.residual_strength.values, strict=True)
    signs = [np.corrcoef(one.flat, other.flat)[0, 1].round() for one, other in flat]
    # The marginals bend the fields: |r| of +-1 becomes 0.9 or more (Grigoriu 1995).
    assert signs[::2] == [-1, 1]


# -- a field that was measured in part -----------------------------------------------------------


@pytest.mark.parametrize(("name", "heading", "unit"), stored("cases")["measured properties"])
def test_a_file_holds_the_property_that_was_measured(tmp_path, name, heading, unit):
    """A coefficient where the field is of those; any other property by its own name."""
    table = np.column_stack([[10.0, 20.0], [0.95, 1.05]])
    header = f"x (mm),{heading}"
    np.savetxt(tmp_path / "scan.csv", table, delimiter=",", header=header, comments="")
    field = {
        "marginal": {"type": "lognormal", "mean": unit, "cv": 0.15},
        "spectrum": STUDY["random"]["strength"]["spectrum"],
        "conditions": {"profile": "scan.csv", "noise": 0.02 * unit},
    } | ({"quantity": "friction_coefficient"} if heading == "mu" else {})
    options = {"problem__load": {"normal_pressure": 2e6}, f"random__{name}": field}
    if name != "strength":  # the law has no scale of slip beside a random one
        options["problem__friction"] = {}
    read = loaded(tmp_path, **options)
    values = read.random.properties[name].conditions.values
    np.testing.assert_allclose(values, [0.95 * unit, 1.05 * unit], rtol=1e-12)
    if "MPa" not in heading:
        return
    result = read.run(out=tmp_path / "run")
    bare = st.RandomField(field["marginal"], field["spectrum"])
    given = bare.given(st.read_profile(tmp_path / "scan.csv"), noise=2e4)
    called = st.monte_carlo(read.problem, given, method=read.method, samples=30, seed=3)
    assert np.array_equal(result.critical_stress, called.critical_stress)
    assert st.Study.from_result(result) == read == st.open_run(tmp_path / "run").study
    sweep = [{"random.strength.conditions.noise": [5e3, 20e3]}]
    found = loaded(tmp_path, **options, samples=3, sweep=sweep).run()
    assert found.critical_stress.sizes == {"noise": 2, "sample": 3}


def test_a_measured_profile_in_a_file_is_run_and_reported(tmp_path, monkeypatch, runs):
    """To the bit as by st.onset of the file, and read again from the run."""
    monkeypatch.chdir(tmp_path)
    plain = {name: table for name, table in STUDY.items() if name in ("problem", "method")}
    problem = st.Problem(**plain["problem"])
    x = problem.interface.x
    scan = 1.0 + 0.2 * np.sin(300.0 * x) + 0.1 * np.cos(777.0 * x)
    table = np.column_stack([1e3 * x, scan])
    np.savetxt("scan.csv", table, delimiter=",", header="x,strength", comments="")
    profiles = {"strength": {"file": "scan.csv", "unit": "MPa", "x_unit": "mm"}}
    Path("study.toml").write_text(tomli_w.dumps(plain | {"profiles": profiles}))
    runs("run study.toml --out run", "critical stress (MPa)", "1 of 1 samples")
    given = st.read_profile("scan.csv", unit="MPa", x_unit="mm", interface=problem.interface)
    exact = st.onset(problem, given, method=st.LocalCriterion())
    stored = st.open_run("run")
    assert stored.dataset().critical_stress.values == exact.critical_stress.values
    assert st.Study.from_result(stored.dataset()) == stored.study
    assert stored.study == st.Study.from_toml("study.toml")
    methods = [{"type": "local_criterion"}, {"type": "equilibrium"}]
    both = st.Study.from_dict(stored.study.to_dict() | {"sweep": [{"method": methods}]}).run()
    assert both.sizes == {"onset_method": 2, "sample": 1}

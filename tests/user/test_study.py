"""A study, swept or not, is the same in Python, in TOML and in the attributes of its result."""

import copy
import dataclasses
import json

import numpy as np
import pytest
import scipy.stats
import xarray as xr
from refusals import refuses
from setups import beta_strength
from small_study import small_study

import stiction as st

STUDY = small_study()
BASE = st.Study.from_dict(STUDY)
LENGTH = "random.strength.spectrum.correlation_length"
LOGNORMAL = {"type": "lognorm", "s": 0.2, "scale": 1e6}


def changed(**values):
    """A copy of the study with keys, dots written as __, replaced, or removed if None."""
    study = copy.deepcopy(STUDY)
    for path, value in values.items():
        *folders, last = path.split("__")
        table = study
        for name in folders:
            table = table[name]
        table[last] = value
        if value is None:
            del table[last]
    return study


def loaded(folder=".", **values):
    return st.Study.from_dict(changed(**values), folder=folder)


def swept(*axes, **values):
    return loaded(**{"sweep": list(axes)} | values)


def in_python(**parts):
    return dataclasses.replace(BASE, **parts)


# -- one study in all its forms ------------------------------------------------------------------


def test_python_and_toml_and_result_are_the_same_study(tmp_path):
    study = st.Study(
        title="a study",
        problem=st.Problem(
            st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
            st.Interface(length=0.1, nodes=128),
            st.LinearWeakening(weakening_rate=0.25e12),
        ),
        random=st.RandomField(
            st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
            st.PowerLawSpectrum(correlation_length=4e-3),
        ),
        method=st.LocalCriterion(),
        ensemble=st.Ensemble(samples=30, seed=3),
    )
    assert study == loaded(title="a study")
    study.to_toml(tmp_path / "study.toml")
    assert st.Study.from_toml(tmp_path / "study.toml") == study
    result = study.run()
    again = st.Study.from_result(result)
    assert again == study
    np.testing.assert_array_equal(again.run()["critical_load"], result["critical_load"])
    result.to_netcdf(tmp_path / "result.nc")
    with xr.open_dataset(tmp_path / "result.nc") as read:
        assert read.attrs["stiction_version"] == st.__version__
        assert read.attrs["seed"] == 3
        assert read.attrs["title"] == "a study"
        assert json.loads(read.attrs["study"])["ensemble"]["samples"] == 30
        for variable in read.variables.values():
            assert {"units", "long_name"} <= set(variable.attrs)


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


def test_a_function_cannot_be_written_down(tmp_path):
    def bell(k):
        return np.exp(-((k * 1e-3) ** 2))

    field = dataclasses.replace(BASE.random.strength, spectrum=st.CustomSpectrum(bell, 8e3))
    own = in_python(random=field)
    words = "cannot be written down: spectrum.function is the Python function 'bell'; use"
    refuses(words, lambda: own.to_toml(tmp_path / "study.toml"))
    assert "bell" in own.run().attrs["study_incomplete"]
    pair = in_python(
        sweep=[{"random.strength.spectrum": [BASE.random.strength.spectrum, field.spectrum]}]
    )
    assert pair.run()["critical_stress"].shape == (2, 30)
    refuses("bell", pair.to_dict)


@pytest.mark.parametrize("text", ["a = [", "\xff"])
def test_files_that_are_not_toml(tmp_path, text):
    (tmp_path / "study.toml").write_bytes(text.encode("latin-1"))
    refuses("study.toml", lambda: st.Study.from_toml(tmp_path / "study.toml"))


# -- points of a sweep ---------------------------------------------------------------------------


def test_every_point_is_the_study_with_its_values():
    study = swept({LENGTH: [4e-3, 6e-3]}, {"problem.solid.poisson_ratio": [0.2, 0.4]})
    result = study.run()
    assert result["critical_stress"].dims == ("correlation_length", "poisson_ratio", "sample")
    assert result["critical_stress"].shape == (2, 2, 30)
    assert result["correlation_length"].attrs == {"units": "m", "long_name": LENGTH}
    for point in study.points:
        values = {name.replace(".", "__"): value for name, value in point.values.items()}
        alone = loaded(**values).run()
        part = result.isel(correlation_length=point.number // 2, poisson_ratio=point.number % 2)
        for name in alone.data_vars:
            np.testing.assert_array_equal(part[name], alone[name])


def test_an_unquoted_key_of_toml_is_a_table():
    rupture = {"type": "rupture", "loading_rate": 1e8}
    points = swept({"method": {"start": ["rest", "equilibrium"]}}, method=rupture).experiments
    assert [point.method.start for point in points] == ["rest", "equilibrium"]


def test_whole_tables_are_values_too():
    marginals = [STUDY["random"]["strength"]["marginal"], LOGNORMAL]
    study = swept({"random.strength.marginal": marginals})
    np.testing.assert_array_equal(study.run()["marginal"], ["beta", "lognorm"])
    assert study.experiments[1].random.strength.mean == pytest.approx(
        scipy.stats.lognorm(0.2, scale=1e6).mean()
    )
    scales = {"random.strength.marginal.scale": [1e6, 2e6]}
    stress = swept(scales, random__strength__marginal=LOGNORMAL).run()["critical_stress"].values
    # The onset is linear in the strength: twice the scale, twice the stress, to round-off.
    np.testing.assert_allclose(stress[1], 2.0 * stress[0], rtol=1e-12)


def test_a_correlation_coefficient_is_swept():
    """The strength has the same draws at every coefficient; the coordinate is a pure number."""
    residual = {
        "marginal": {"type": "beta", "alpha": 2.0, "beta": 2.0, "low": 0.0, "high": 0.5e6},
        "spectrum": STUDY["random"]["strength"]["spectrum"],
    }
    kept = {"samples": 8, "keep": ["strength", "residual_strength"]}
    given = {"random__residual_strength": residual, "ensemble": kept}
    key = "random.correlation.strength.residual_strength"
    result = swept({key: [-1.0, 0.0, 1.0]}, **given).run()
    rho = result["random_correlation_strength_residual_strength"]
    assert rho.attrs == {"units": "1", "long_name": key}
    strength = result["strength"].values
    np.testing.assert_array_equal(strength[0], strength[2])
    for i, one in enumerate(rho.values):
        found = np.corrcoef(strength[i].ravel(), result["residual_strength"].values[i].ravel())
        # The marginals bend the fields: |r| of +-1 becomes 0.98 (Grigoriu 1995), and 8 samples of
        # 25 correlation lengths scatter by 0.07.
        assert found[0, 1] == pytest.approx(one, abs=0.2)
    misspelt = {"random.correlation.strength.residual_strenght": [0.1]}
    refuses("did you mean 'residual_strength'", lambda: swept(misspelt, **given))


# -- events under a load -------------------------------------------------------------------------


def test_events_are_those_of_the_path():
    problem = st.paper.problem(nodes=256)
    tau_p = beta_strength(1.5e-3, high=4.66e6).sample(problem.interface, samples=6, seed=0)
    found = st.onset(problem, tau_p, method=st.Equilibrium(events=4))
    kept = found["event_moment"].values
    assert np.isfinite(kept).sum() > 2
    for sample in range(6):
        own = st.equilibrium_path(problem, tau_p[sample], [0.0])["event_moment"].values[:4]
        np.testing.assert_allclose(kept[sample, : own.size], own, rtol=1e-12)
        assert np.isnan(kept[sample, own.size :]).all()

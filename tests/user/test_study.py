"""A study is the same in Python, in TOML and in the attributes of its result."""

import copy
import json
import tomllib
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import scipy.stats
import xarray as xr
from refusals import refuses
from small_study import small_study

import stiction as st
from stiction.study.study import study_schema

EXAMPLES = Path(__file__).parents[2] / "examples"

STUDY = small_study(
    weakening_rate=0.5e12,
    correlation_length=1.7e-3,
    ensemble={"samples": 40, "seed": 3},
)


def changed(path, value):
    """A copy of the study with one key replaced, or removed if the value is None."""
    study = copy.deepcopy(STUDY)
    *folders, last = path.split(".")
    table = study
    for name in folders:
        table = table[name]
    if value is None:
        del table[last]
    else:
        table[last] = value
    return study


def test_python_and_toml_are_the_same_study(tmp_path):
    study = st.Study(
        problem=st.Problem(
            st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
            st.Interface(length=0.1, nodes=128),
            st.LinearWeakening(weakening_rate=0.5e12),
        ),
        random=st.RandomField(
            st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
            st.PowerLawSpectrum(correlation_length=1.7e-3),
        ),
        method=st.LocalCriterion(),
        ensemble=st.Ensemble(samples=40, seed=3),
    )
    assert study == st.Study.from_dict(STUDY)
    study.to_toml(tmp_path / "study.toml")
    assert st.Study.from_toml(tmp_path / "study.toml") == study
    result = study.run()
    assert st.Study.from_result(result) == study
    again = st.Study.from_result(result).run()
    np.testing.assert_array_equal(again["critical_load"], result["critical_load"])


def test_attributes_say_all_it_takes(tmp_path):
    result = st.Study.from_dict(STUDY | {"title": "a study"}).run()
    result.to_netcdf(tmp_path / "result.nc")
    with xr.open_dataset(tmp_path / "result.nc") as read:
        assert read.attrs["stiction_version"] == st.__version__
        assert read.attrs["seed"] == 3
        assert read.attrs["title"] == "a study"
        assert json.loads(read.attrs["study"])["ensemble"]["samples"] == 40
        for variable in read.variables.values():
            assert {"units", "long_name"} <= set(variable.attrs)


def test_distributions_of_scipy_and_profiles_in_files(tmp_path):
    np.save(tmp_path / "profile.npy", np.linspace(1.0, 1.2, 128))
    np.savetxt(tmp_path / "stress.csv", np.full(128, 1e4), delimiter=",")
    study = copy.deepcopy(STUDY)
    study["random"]["strength"]["marginal"] = {"type": "lognorm", "s": 0.2, "scale": 1e6}
    study["problem"]["load"] = {"profile": "profile.npy", "initial_stress": "stress.csv"}
    loaded = st.Study.from_dict(study, folder=tmp_path)
    np.testing.assert_array_equal(loaded.problem.load.profile, np.linspace(1.0, 1.2, 128))
    expected = scipy.stats.lognorm(0.2, scale=1e6)
    assert loaded.random.strength.mean == pytest.approx(expected.mean(), rel=1e-14)
    loaded.to_toml(tmp_path / "written.toml")
    assert st.Study.from_toml(tmp_path / "written.toml") == loaded


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("problem", None, "problem: missing"),
        ("problem.solid.density", None, "problem.solid.density: missing"),
        ("problem.solid.density", -1.0, "problem.solid.density ... greater than 0 ... -1"),
        ("problem.solid.densty", 1.0, "problem.solid ... 'densty' ... did you mean 'density'"),
        ("problem.interface.nodes", "many", "problem.interface.nodes ... 'many'"),
        ("problem.load", {"profile": "missing.npy"}, "problem.load.profile ... missing.npy"),
        ("random.strength.marginal.type", "betta", "'betta' ... did you mean 'beta'"),
        ("random.strength.marginal.low", 2e6, "strength.marginal ... low must be below high"),
        ("random.strength.spectrum.correlation_length", 10.0, "strength ... no mode is left"),
        ("method.type", "local", "method.type ... 'local' ... local_criterion"),
        ("method.typ", "exact", "method ... 'typ' ... did you mean 'type'"),
        ("ensemble.samples", 0, "ensemble.samples ... 0"),
        ("ensemble.samples", 2.5, "ensemble.samples ... whole number ... 2.5"),
        ("ensemble.keep", ["stregth"], "keep ... 'stregth' ... strength"),
    ],
)
def test_mistakes_are_named(tmp_path, path, value, words):
    refuses(words, lambda: st.Study.from_dict(changed(path, value), folder=tmp_path))


def test_all_mistakes_come_at_once():
    study = changed("problem.solid.density", -1.0)
    study["ensemble"] = {"samples": -5, "sed": 1}
    study["sweep"] = [{"method.typ": ["exact"]}]
    del study["random"]["strength"]["spectrum"]
    words = "solid.density ... ensemble.samples ... 'sed' ... strength.spectrum ... 'type'"
    refuses(words, lambda: st.Study.from_dict(study))


def test_a_function_cannot_be_written_down(tmp_path):
    def bell(k):
        return np.exp(-((k * 1e-3) ** 2))

    study = st.Study.from_dict(STUDY)
    own = st.Study(
        problem=study.problem,
        random=st.RandomField(study.random.strength.marginal, st.CustomSpectrum(bell, 8e3)),
        method=study.method,
        ensemble=study.ensemble,
    )
    with pytest.raises(st.InputError, match="bell"):
        own.to_toml(tmp_path / "study.toml")
    assert "bell" in own.run().attrs["study_incomplete"]


@pytest.mark.parametrize("text", ["a = [", "\xff"])
def test_files_that_are_not_toml(tmp_path, text):
    (tmp_path / "study.toml").write_bytes(text.encode("latin-1"))
    with pytest.raises(st.InputError, match=r"study\.toml"):
        st.Study.from_toml(tmp_path / "study.toml")


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.name)
def test_every_example_is_valid(path):
    study = st.Study.from_toml(path)
    jsonschema.validate(tomllib.loads(path.read_text()), study_schema())
    assert st.Study.from_dict(study.to_dict()) == study

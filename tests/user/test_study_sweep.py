"""Sweeps: lists and ranges over any key, crossed or zipped, the same in Python and TOML."""

import copy

import numpy as np
import pytest
import scipy.stats
from refusals import refuses
from small_study import small_study

import stiction as st

STUDY = small_study()
KEEPING = {"samples": 2, "seed": 3, "keep": ["strength"]}
LENGTH = "random.strength.spectrum.correlation_length"


def swept(*axes, **changes):
    return st.Study.from_dict(copy.deepcopy(STUDY) | {"sweep": list(axes)} | changes)


def test_every_point_is_the_study_with_its_values():
    study = swept({LENGTH: [4e-3, 6e-3, 8e-3]}, {"problem.solid.poisson_ratio": [0.2, 0.4]})
    result = study.run()
    assert result["critical_stress"].dims == ("correlation_length", "poisson_ratio", "sample")
    assert result["critical_stress"].shape == (3, 2, 30)
    assert result["correlation_length"].attrs == {"units": "m", "long_name": LENGTH}
    for point in study.points:
        one = copy.deepcopy(STUDY)
        one["random"]["strength"]["spectrum"]["correlation_length"] = point.values[LENGTH]
        one["problem"]["solid"]["poisson_ratio"] = point.values["problem.solid.poisson_ratio"]
        alone = st.Study.from_dict(one).run()
        part = result.isel(correlation_length=point.number // 2, poisson_ratio=point.number % 2)
        for name in alone.data_vars:
            np.testing.assert_array_equal(part[name], alone[name])


def test_keys_of_one_table_vary_together():
    study = swept(
        {"problem.interface.length": [0.1, 0.2], "problem.interface.nodes": [128, 256]},
        {"ensemble.seed": [3, 4, 5]},
    )
    assert [tuple(point.values.values()) for point in study.points] == [
        (0.1, 128, 3), (0.1, 128, 4), (0.1, 128, 5), (0.2, 256, 3), (0.2, 256, 4), (0.2, 256, 5)
    ]  # fmt: skip
    result = study.run()
    assert result["critical_stress"].dims == ("length", "seed", "sample")
    assert result["nodes"].dims == ("length",)
    spacings = [plan.problem.interface.spacing for plan in study.experiments]
    assert spacings == [0.1 / 128] * 6


def test_ranges():
    study = swept({LENGTH: {"start": 2e-3, "stop": 8e-3, "count": 3, "spacing": "log"}})
    # Geometric and arithmetic means of the ends, up to round-off.
    assert study.points[1].values[LENGTH] == pytest.approx(4e-3, rel=1e-14)
    study = swept({LENGTH: {"start": 2e-3, "stop": 8e-3, "count": 4}})
    assert [p.values[LENGTH] for p in study.points] == pytest.approx([2e-3, 4e-3, 6e-3, 8e-3])
    study = swept({"problem.interface.nodes": {"start": 128, "stop": 256, "count": 3}})
    assert [p.values["problem.interface.nodes"] for p in study.points] == [128, 192, 256]


def test_toml_python_and_result_agree(tmp_path):
    text = """
    [[sweep]]
    "random.strength.spectrum.correlation_length" = { start = 4e-3, stop = 8e-3, count = 3 }
    [[sweep]]
    problem.solid.density = [1000.0, 2000.0]
    problem.solid.poisson_ratio = [0.2, 0.3]
    """
    base = st.Study.from_dict(STUDY)
    base.to_toml(tmp_path / "study.toml")
    written = (tmp_path / "study.toml").read_text()
    (tmp_path / "study.toml").write_text(written + text)
    study = st.Study.from_toml(tmp_path / "study.toml")
    python = st.Study(
        problem=base.problem,
        random=base.random,
        method=base.method,
        ensemble=base.ensemble,
        sweep=[
            {LENGTH: np.linspace(4e-3, 8e-3, 3)},
            {
                "problem.solid.density": [1000.0, 2000.0],
                "problem.solid.poisson_ratio": [0.2, 0.3],
            },
        ],
    )
    assert python == study
    result = study.run()
    assert st.Study.from_result(result) == study
    study.to_toml(tmp_path / "again.toml")
    assert st.Study.from_toml(tmp_path / "again.toml") == study


def test_whole_tables_are_values_too():
    other = {"type": "lognorm", "s": 0.2, "scale": 1e6}
    study = swept(
        {"random.strength.marginal": [STUDY["random"]["strength"]["marginal"], other]}
    )
    result = study.run()
    np.testing.assert_array_equal(result["marginal"], ["beta", "lognorm"])
    assert study.experiments[1].random.strength.mean == pytest.approx(
        scipy.stats.lognorm(0.2, scale=1e6).mean()
    )
    scales = swept({"random.strength.marginal.scale": [1e6, 2e6]}, random={"strength": {
        "marginal": other, "spectrum": STUDY["random"]["strength"]["spectrum"]
    }})  # fmt: skip
    stress = scales.run()["critical_stress"].values
    # The onset is linear in the strength: twice the scale, twice the stress, to round-off.
    np.testing.assert_allclose(stress[1], 2.0 * stress[0], rtol=1e-12)


def test_objects_and_functions_in_python():
    base = st.Study.from_dict(STUDY)
    study = st.Study(
        problem=base.problem,
        random=base.random,
        method=base.method,
        ensemble=base.ensemble,
        sweep=[
            {
                "random.strength.spectrum": [
                    base.random.strength.spectrum,
                    st.CustomSpectrum(lambda k: np.exp(-((k * 2e-3) ** 2)), 4e3),
                ]
            }
        ],
    )
    assert study.run()["critical_stress"].shape == (2, 30)
    with pytest.raises(st.InputError):
        study.to_dict()


def test_a_swept_key_needs_no_value_of_its_own():
    bare = copy.deepcopy(STUDY)
    del bare["random"]["strength"]["spectrum"]["correlation_length"]
    study = st.Study.from_dict(bare | {"sweep": [{LENGTH: [4e-3, 6e-3]}]})
    assert study.random.strength.spectrum.correlation_length == 4e-3


def test_profiles_in_files_can_be_swept(tmp_path):
    for name, scale in (("a", 0.0), ("b", 0.1)):
        np.save(
            tmp_path / f"{name}.npy", 1.0 + scale * np.sin(np.arange(128) * 2 * np.pi / 128)
        )
    study = st.Study.from_dict(
        STUDY | {"sweep": [{"problem.load.profile": ["a.npy", "b.npy"]}]}, folder=tmp_path
    )
    assert study.experiments[1].problem.load.profile.max() == pytest.approx(1.1)
    assert study.run()["critical_stress"].shape == (2, 30)


SPAN = {"start": 1e-3, "stop": 2e-3}
MANY = [{"ensemble.seed": list(range(1000))}, {"x": [1] * 1000}]


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        ([{"random.strength.spectrum.corelation_length": [1]}], "mean 'correlation_length'"),
        ([{"problm.solid.density": [1.0]}], "did you mean 'problem'"),
        ([{LENGTH: [4e-3, -1.0]}], "correlation_length ... greater than 0 ... point 1"),
        ([{LENGTH: 4e-3}], f"{LENGTH} ... list of values or a range"),
        ([{LENGTH: []}], f"{LENGTH} ... list"),
        ([{LENGTH: SPAN}], "count: missing"),
        ([{LENGTH: SPAN | {"num": 3}}], "'num' ... count: missing"),
        ([{LENGTH: SPAN | {"start": 0.0, "count": 3, "spacing": "log"}}], "positive"),
        ([{LENGTH: SPAN | {"count": 1}}], "count ... >= 2"),
        (
            [{LENGTH: [1, 2], "ensemble.seed": [1, 2, 3]}],
            "as many values each ... has 2 ... has 3",
        ),
        ([{LENGTH: [1e-3]}, {LENGTH: [2e-3]}], "swept twice"),
        ([{"random.strength.spectrum": []}, {LENGTH: [2e-3]}], "random.strength.spectrum"),
        ([{"ensemble.samples": [10, 20]}], "ensemble.samples: cannot be swept"),
        ([{"problem.solid.density": [1.0, "heavy"]}], "problem.solid.density ... 'heavy'"),
        (MANY, "1000000 points"),
        ("everything", "list of tables"),
        ({LENGTH: [1e-3], "ensemble.seed": [1]}, "list of tables"),
    ],
)
def test_mistakes_are_named(axes, words):
    refuses(words, lambda: st.Study.from_dict(STUDY | {"sweep": axes}))


def test_kept_profiles():
    study = swept({LENGTH: [4e-3, 6e-3]}, ensemble=KEEPING)
    result = study.run()
    assert result["strength"].dims == ("correlation_length", "sample", "x")
    direct = study.experiments[1].random.strength.sample(
        study.problem.interface, samples=2, seed=3
    )
    np.testing.assert_array_equal(result["strength"].values[1], direct)
    longer = swept(
        {"problem.interface.length": [0.1, 0.2]}, ensemble={"samples": 3, "keep": ["strength"]}
    ).run()
    np.testing.assert_allclose(longer["position"][1], 0.2 / 128 * np.arange(128), rtol=1e-15)


def test_what_may_be_kept_is_limited():
    nodes, keep = {"problem.interface.nodes": [128, 256]}, {"keep": ["strength"]}
    refuses("number of nodes is swept", lambda: swept(nodes, ensemble={"samples": 3} | keep))
    study = swept(ensemble={"samples": 10**9} | keep)
    refuses("GiB of memory", study.run)


@pytest.mark.slow
def test_slip_and_sensitivity_on_request():
    """What the method can add is switched on by asking for it."""
    study = st.Study.from_dict(
        STUDY
        | {
            "method": {"type": "equilibrium"},
            "ensemble": {"samples": 6, "keep": ["slip", "sensitivity"]},
        }
    )
    result = study.run()
    direct = st.onset(
        study.problem,
        study.random.strength.sample(study.problem.interface, samples=6, seed=0),
        method=st.Equilibrium(slip=True, sensitivity=True),
    )
    np.testing.assert_array_equal(result["critical_load"], direct["critical_load"])
    for name in ("slip", "sensitivity"):
        assert result[name].dims == ("sample", "x")
        np.testing.assert_array_equal(result[name], direct[name])


def test_warnings_of_many_points_are_summed_up():
    lengths = {"start": 20e-3, "stop": 30e-3, "count": 9}
    with pytest.warns(st.AccuracyWarning) as caught:
        swept({LENGTH: lengths}, ensemble={"samples": 2}).run()
    texts = [str(warning.message) for warning in caught]
    assert sum("no mean mode" in text for text in texts) == 4
    assert sum("5 more warnings like these" in text for text in texts) == 1


def test_a_correlation_coefficient_is_swept():
    """The strength has the same draws at every coefficient; the coordinate is a pure number."""
    random = copy.deepcopy(STUDY["random"])
    residual = {"type": "beta", "alpha": 2.0, "beta": 2.0, "low": 0.0, "high": 0.5e6}
    random["residual_strength"] = {
        "marginal": residual,
        "spectrum": random["strength"]["spectrum"],
    }
    kept = {"samples": 8, "keep": ["strength", "residual_strength"]}
    key = "random.correlation.strength.residual_strength"
    study = swept({key: [-1.0, 0.0, 1.0]}, random=random, ensemble=kept)
    result = study.run()
    rho = result["correlation_strength_residual_strength"]
    assert rho.attrs == {"units": "1", "long_name": key}
    strength = result["strength"].values
    np.testing.assert_array_equal(strength[0], strength[2])
    for i, one in enumerate(rho.values):
        found = np.corrcoef(strength[i].ravel(), result["residual_strength"].values[i].ravel())
        # The marginals bend the fields: |r| of +-1 becomes 0.98 (Grigoriu 1995), and 8 samples of
        # 25 correlation lengths scatter by 0.07.
        assert found[0, 1] == pytest.approx(one, abs=0.2)
    with pytest.raises(st.InputError, match="did you mean 'residual_strength'"):
        swept({"random.correlation.strength.residual_strenght": [0.1]}, random=random)

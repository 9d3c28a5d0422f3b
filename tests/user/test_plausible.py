"""Numbers in another unit than they are taken to be: a warning."""

import warnings

import numpy as np
import pytest
import scipy.stats

import stiction as st
from stiction.errors import StoreError

LENGTH, NODES = 0.1, 256


def problem(**changes):
    given = {"G": 1e9, "rho": 1170.0, "W": 0.5e12, "L": LENGTH, "p": None, "d_c": None} | changes
    friction = {"weakening_rate": given["W"]} if given["d_c"] is None else {}
    if given["d_c"] is not None:
        friction = {"critical_slip": given["d_c"]}
    return st.Problem(
        st.Solid(shear_modulus=given["G"], poisson_ratio=0.33, density=given["rho"]),
        st.Interface(length=given["L"], nodes=NODES),
        st.LinearWeakening(**friction),
        st.Load(normal_pressure=given["p"]),
    )


def ask(strength, **changes):
    tau_p = strength * np.ones(NODES)
    method = st.Equilibrium() if "d_c" in changes else st.LocalCriterion()
    return st.onset(problem(**changes), tau_p, method=method)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: problem(rho=1.17), "units of shear_modulus = 1e.09 Pa and density = 1.17 kg/m3"),
        (lambda: st.Solid(1.0, 0.33, 1170.0), "shear waves run at 0.02924 m/s, as in no solid"),
        (lambda: problem(W=0.5e6), "nucleation length 3.46e.03 m. fills the interface"),
        (lambda: ask(1.0), "its mean, 1 Pa, is 1e-09 of the shear modulus"),
        (lambda: ask(1e6, d_c=2.0), "fills the interface"),
        (lambda: ask(1e12, d_c=2.0), "is 1e.03 of the shear modulus"),
    ],
)
def test_a_wrong_unit_is_doubted(call, words):
    with pytest.warns(st.UnitWarning, match=words):
        call()


@pytest.mark.parametrize("changes", [{"G": 1e3}, {"L": 100.0}])
def test_more_nodes_than_anybody_has_suggest_a_unit(changes):
    with pytest.raises(st.InputError, match="so many suggest that a length, a modulus"):
        problem(**changes)


def test_ensembles_warn_too_and_point_at_the_caller():
    spectrum = st.PowerLawSpectrum(correlation_length=4e-3)
    field = st.RandomField(scipy.stats.uniform(0.3, 0.2), spectrum)
    with pytest.warns(st.UnitWarning, match="of the shear modulus") as caught:
        st.monte_carlo(problem(), field, method=st.LocalCriterion(), samples=2)
    assert {one.filename for one in caught if one.category is st.UnitWarning} == {__file__}
    with pytest.warns(st.UnitWarning):
        st.failure_probability(problem(), field, 0.1, method=st.LocalCriterion())
    with pytest.warns(st.UnitWarning) as caught:
        problem(rho=1.17)
    assert caught[0].filename == __file__


@pytest.mark.parametrize(
    ("solid", "friction", "length", "strength"),
    [
        ((1e9, 0.33, 1170.0), 0.5e12, 0.1, 1e6),  # the paper's polymer
        ((3e10, 0.25, 2700.0), 1e6 / 1e-4, 100.0, 5e6),  # a laboratory fault in granite
        ((3e10, 0.25, 2700.0), 5e6 / 0.5, 5e4, 5e7),  # a natural fault, d_c of half a metre
        ((8e10, 0.3, 7850.0), 3e5 / 1e-6, 1.0, 3e5),  # steel, lightly clamped
        ((2e3, 0.49, 1000.0), 5e2 / 1e-3, 0.1, 5e2),  # a gel
        ((4.8e11, 0.1, 3500.0), 1e7 / 1e-8, 1e-3, 1e7),  # diamond
    ],
)
def test_what_people_study_raises_no_doubt(solid, friction, length, strength):
    with warnings.catch_warnings():
        warnings.simplefilter("error", st.UnitWarning)
        h_n = 2 * 0.5789 * solid[0] / (1 - solid[1]) / friction
        nodes = max(64, 2 * int(4 * length / h_n))
        system = st.Problem(
            st.Solid(*solid), st.Interface(length, nodes), st.LinearWeakening(friction)
        )
        spectrum = st.SquaredExponentialSpectrum(correlation_length=length / 20)
        field = st.RandomField(scipy.stats.uniform(0.9 * strength, 0.2 * strength), spectrum)
        st.monte_carlo(system, field, method=st.LocalCriterion(), samples=1)


def test_harmless_forms_are_taken():
    spectrum = st.PowerLawSpectrum(correlation_length=4e-3)
    field = st.RandomField(st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6), spectrum)
    result = st.monte_carlo(
        problem(), field, method=st.LocalCriterion(), samples=1e1, keep="strength", seed=2.0
    )
    assert result["strength"].shape == (10, NODES)
    np.testing.assert_array_equal(result["strength"], field.sample(
        problem().interface, samples=np.float64(10.0), seed=2))  # fmt: skip
    assert st.Interface(length=0.1, nodes=256.0).nodes == 256
    assert st.Ensemble(samples=1e4, keep="strength").keep == ("strength",)
    with pytest.raises(st.InputError, match="keep: must be a name or a list of names, got 3"):
        st.monte_carlo(problem(), field, method=st.LocalCriterion(), samples=2, keep=3)
    with pytest.raises(st.InputError, match="samples: must be a whole number >= 1, got 2.5"):
        st.monte_carlo(problem(), field, method=st.LocalCriterion(), samples=2.5)


def test_a_family_of_distributions_needs_its_parameters():
    spectrum = st.PowerLawSpectrum(correlation_length=4e-3)
    with pytest.raises(st.InputError, match=r"write|scipy.stats.lognorm\(s=..., loc=..., scale="):
        st.RandomField(scipy.stats.lognorm, spectrum)
    with pytest.raises(st.InputError, match=r"scipy.stats.norm\(loc=..., scale=...\)"):
        st.RandomField(scipy.stats.norm, spectrum)
    counts, edges = np.histogram(np.linspace(1e6, 2e6, 100), bins=10)
    histogram = scipy.stats.rv_histogram((counts, edges), density=False)
    taken = st.RandomField(histogram, spectrum)  # has all it needs
    assert taken.mean == pytest.approx(1.5e6, rel=1e-3)  # of ten bins, 10 % wide


def test_representations_fit_on_a_screen(tmp_path):
    system = problem(p=np.linspace(1e6, 2e6, NODES))
    assert len(repr(system)) < 600
    assert "<256 array, 1e+06 to 2e+06>" in repr(system)
    spectrum = st.PowerLawSpectrum(correlation_length=4e-3)
    field = st.RandomField(st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6), spectrum)
    ensemble = st.Ensemble(samples=3)
    study = st.Study(problem=problem(), random=field, method=st.LocalCriterion(), ensemble=ensemble)
    study.run(out=tmp_path / "run")
    assert repr(st.open_run(tmp_path / "run")).endswith("run': 3 samples>")
    assert len(repr(st.open_run(tmp_path / "run").status())) < 200
    assert len(repr(st.statistics.density(np.random.default_rng(0).random(1000)))) < 300
    assert issubclass(StoreError, st.RunError)

"""Numbers in another unit than they are taken to be: a warning. Harmless forms: none."""

import warnings
from functools import partial

import numpy as np
import pytest
import scipy.stats
from refusals import refuses
from small_study import small_study

import stiction as st
from stiction.errors import StoreError

LENGTH, NODES = 0.1, 256
SPECTRUM = st.PowerLawSpectrum(correlation_length=4e-3)
FIELD = st.RandomField(st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6), SPECTRUM)


def problem(modulus=1e9, density=1170.0, rate=0.5e12, length=LENGTH, pressure=None, slip=None):
    rate = {"critical_slip": slip} if slip else {"weakening_rate": rate}
    return st.Problem(
        st.Solid(shear_modulus=modulus, poisson_ratio=0.33, density=density),
        st.Interface(length=length, nodes=NODES),
        st.LinearWeakening(**rate),
        st.Load(normal_pressure=pressure),
    )


def monte_carlo(field):
    return st.monte_carlo(problem(), field, method=st.LocalCriterion(), samples=2)


DOUBTS = {
    "units of shear_modulus = 1e.09 Pa and density = 1.17 kg/m3": lambda: problem(density=1.17),
    "shear wave speed is 0.02924 m/s, which no solid has": lambda: st.Solid(1.0, 0.33, 1170.0),
    "nucleation length 3.46e.03 m. fills the interface": lambda: problem(rate=0.5e6),
    "fills the interface": lambda: problem(slip=2.0).warn_of_units(1e6),
    "is 1e.03 of the shear modulus": lambda: problem(slip=2.0).warn_of_units(1e12),
    "its mean, 1 Pa, is 1e-09 of the shear modulus": lambda: st.onset(
        problem(), np.ones(NODES), method=st.LocalCriterion()
    ),
    "2e-06 of the normal pressure": lambda: problem(pressure=5e11).warn_of_units(1e6),
    "percentages": lambda: problem(pressure=5e4).warn_of_units(1e6),
    "for 2 % give 0.02": lambda: st.Lognormal(mean=1e6, cv=2),
    "each sample is uniform; check its unit": lambda: monte_carlo(
        st.RandomField(FIELD.marginal, st.PowerLawSpectrum(4.0), mean_mode=True)
    ),
    "friction_coefficient: 8e.07 Pa is 81 times": lambda: st.failure_probability(
        problem(pressure=2e6), FIELD, friction_coefficient=40, method=st.LocalCriterion()
    ),
    "residual_strength: its mean, 0.45 Pa": lambda: problem().warn_of_units(1e6, 0.45),
}


@pytest.mark.parametrize("words", DOUBTS)
def test_a_wrong_unit_is_doubted(words):
    with pytest.warns(st.UnitWarning, match=words) as caught:
        DOUBTS[words]()
    assert caught[0].filename == __file__


@pytest.mark.parametrize("family", [st.Lognormal, st.Weibull, st.Gamma, st.TruncatedNormal])
def test_a_coefficient_of_variation_in_per_cent_is_refused(family):
    refuses("at most 10, got 15; for 15 % give 0.15", partial(family, mean=1e6, cv=15))


@pytest.mark.parametrize("changes", [{"modulus": 1e3}, {"length": 100.0}])
def test_more_nodes_than_anybody_has_suggest_a_unit(changes):
    with pytest.raises(st.InputError, match="check the units of all lengths, moduli"):
        problem(**changes)


def test_ensembles_warn_too_and_point_at_the_caller():
    field = st.RandomField(scipy.stats.uniform(0.3, 0.2), SPECTRUM)
    method = st.LocalCriterion()
    with pytest.warns(st.UnitWarning, match="of the shear modulus") as caught:
        monte_carlo(field)
    assert {one.filename for one in caught if one.category is st.UnitWarning} == {__file__}
    with pytest.warns(st.UnitWarning, match="of the shear modulus"):
        st.failure_probability(problem(), field, 0.1, method=method)


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
        interface = st.Interface(length, max(64, 2 * int(4 * length / h_n)))
        system = st.Problem(st.Solid(*solid), interface, st.LinearWeakening(friction))
        system.warn_of_units(strength)


def test_harmless_forms_are_taken():
    method = st.LocalCriterion()
    result = st.monte_carlo(
        problem(), FIELD, method=method, samples=1e1, keep="strength", seed=2.0
    )
    expected = FIELD.sample(problem().interface, samples=np.float64(10.0), seed=2)
    np.testing.assert_array_equal(result["strength"], expected)
    assert st.Interface(length=0.1, nodes=256.0).nodes == 256
    assert st.Ensemble(samples=1e4, keep="strength").keep == ("strength",)
    for words, options in {
        "keep: must be a name or a list of names, got 3": {"samples": 2, "keep": 3},
        "samples: must be a whole number >= 1, got 2.5": {"samples": 2.5},
    }.items():
        refuses(words, partial(st.monte_carlo, problem(), FIELD, method=method, **options))


def test_representations_fit_on_a_screen(tmp_path):
    system = problem(pressure=np.linspace(1e6, 2e6, NODES))
    assert len(repr(system)) < 600
    assert "<256 array, 1e+06 to 2e+06>" in repr(system)
    st.Study.from_dict(small_study(ensemble={"samples": 3})).run(out=tmp_path / "run")
    assert repr(st.open_run(tmp_path / "run")).endswith("run': 3 samples>")
    assert len(repr(st.open_run(tmp_path / "run").status())) < 200
    assert len(repr(st.statistics.density(np.random.default_rng(0).random(1000)))) < 300
    assert issubclass(StoreError, st.RunError)

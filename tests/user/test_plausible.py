"""Numbers in another unit than they are taken to be: a warning. Harmless forms: none."""

import warnings
from functools import partial

import numpy as np
import pytest
import scipy.stats
from refusals import refuses
from setups import beta_strength, make_problem
from small_study import small_study

import stiction as st

FIELD = beta_strength(4e-3)
LOCAL = st.LocalCriterion()


def problem(modulus=1e9, density=1170.0, length=0.1, pressure=None, **weakening):
    solid, load = st.Solid(modulus, 0.33, density), st.Load(normal_pressure=pressure)
    return make_problem(256, length, solid=solid, load=load, **weakening)


PLAIN = problem()


def monte_carlo(field):
    return st.monte_carlo(PLAIN, field, method=LOCAL, samples=2)


DOUBTS = {
    "units of shear_modulus = 1e.09 Pa and density = 1.17 kg/m3": lambda: st.Solid(
        1e9, 0.33, 1.17
    ),
    "shear wave speed is 0.02924 m/s, which no solid has": lambda: st.Solid(1.0, 0.33, 1170.0),
    "fills the interface": lambda: problem(critical_slip=2.0).warn_of_units(1e6),
    "is 1e.03 of the shear modulus": lambda: problem(critical_slip=2.0).warn_of_units(1e12),
    "its mean, 1 Pa, is 1e-09 of the shear modulus": lambda: st.onset(
        PLAIN, np.ones(256), method=LOCAL
    ),
    "2e-06 of the normal pressure": lambda: problem(pressure=5e11).warn_of_units(1e6),
    "percentages": lambda: problem(pressure=5e4).warn_of_units(1e6),
    "for 2 % give 0.02": lambda: st.Lognormal(mean=1e6, cv=2),
    "each sample is uniform; check its unit": lambda: monte_carlo(
        st.RandomField(FIELD.marginal, st.PowerLawSpectrum(4.0), mean_mode=True)
    ),
    "friction_coefficient: 8e.07 Pa is 81 times": lambda: st.failure_probability(
        problem(pressure=2e6), FIELD, friction_coefficient=40, method=LOCAL
    ),
    "residual_strength: its mean, 0.45 Pa": lambda: PLAIN.warn_of_units(1e6, 0.45),
    "of the shear modulus": lambda: monte_carlo(
        st.RandomField(scipy.stats.uniform(0.3, 0.2), FIELD.spectrum)
    ),
}


@pytest.mark.parametrize("words", DOUBTS)
def test_a_wrong_unit_is_doubted(words):
    with pytest.warns(st.UnitWarning, match=words) as caught:
        DOUBTS[words]()
    (unit, *_) = [one for one in caught if one.category is st.UnitWarning]
    assert unit.filename == __file__


def test_the_nucleation_length_is_doubted_by_its_value():
    with pytest.warns(st.UnitWarning, match="nucleation length 3.46e.03 m. fills the interf"):
        problem(weakening_rate=0.5e6)


@pytest.mark.parametrize("family", [st.Lognormal, st.Weibull, st.Gamma, st.TruncatedNormal])
def test_a_coefficient_of_variation_in_per_cent_is_refused(family):
    refuses("at most 10, got 15; for 15 % give 0.15", partial(family, mean=1e6, cv=15))


@pytest.mark.parametrize("changes", [{"modulus": 1e3}, {"length": 100.0}])
def test_more_nodes_than_anybody_has_suggest_a_unit(changes):
    refuses("check the units of all lengths, moduli", lambda: problem(**changes))


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
    given = {"samples": 1e1, "keep": "strength", "seed": 2.0}
    result = st.monte_carlo(PLAIN, FIELD, method=LOCAL, **given)
    expected = FIELD.sample(PLAIN.interface, samples=np.float64(10.0), seed=2)
    np.testing.assert_array_equal(result["strength"], expected)
    assert st.Interface(length=0.1, nodes=256.0).nodes == 256
    assert st.Ensemble(samples=1e4, keep="strength").keep == ("strength",)


def test_representations_fit_on_a_screen(tmp_path):
    system = problem(pressure=np.linspace(1e6, 2e6, 256))
    assert len(repr(system)) < 600
    assert "<256 array, 1e+06 to 2e+06>" in repr(system)
    st.Study.from_dict(small_study(ensemble={"samples": 3})).run(out=tmp_path / "run")
    assert repr(st.open_run(tmp_path / "run")).endswith("run': 3 samples>")
    assert len(repr(st.open_run(tmp_path / "run").status())) < 200
    assert len(repr(st.statistics.density(np.random.default_rng(0).random(1000)))) < 300

"""The distribution of the critical stress from crossing rates, against Monte Carlo."""

import dataclasses

import numpy as np
import pytest
import scipy.signal
from setups import make_problem

import stiction as st
from stiction.statistics.rice import rice_distribution


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_lower_tail_agrees_with_monte_carlo(problem, make_strength, ratio):
    strength = make_strength(ratio)
    found = rice_distribution(problem, strength, profiles=8192, seed=1)
    tau_p = strength.sample(problem.interface, samples=4 * 4096, seed=2)
    stress = st.onset(problem, tau_p, method=st.LocalCriterion()).critical_stress.values
    for probability, tolerance in ((0.03, 0.25), (0.1, 0.15)):
        # Errors of both counts: at 0.03 some 250 crossings and 490 samples, 6 and 5 %, three
        # times over, and 5 % of the approximation.
        level = np.quantile(stress, probability)
        assert found.failure_probability(level) == pytest.approx(probability, rel=tolerance)
    # Beyond its range it is too low, by a few per cent at the median.
    median = found.failure_probability(np.median(stress))
    assert 0.44 < median < 0.5


@pytest.mark.parametrize("load", [st.Load(initial_stress=2e5), st.Load(profile=2.0)])
def test_it_is_the_critical_stress_and_not_the_load(problem, make_strength, load):
    """With an initial stress it was shifted by it, with p = 2 every sample failed."""
    loaded = dataclasses.replace(problem, load=load)
    field = make_strength(1.0)
    found = st.monte_carlo(
        loaded, field, method=st.LocalCriterion(), samples=4000, seed=5, pilot=False
    )
    level = float(found.critical_stress.quantile(0.1))
    rice = rice_distribution(loaded, field, profiles=2000, seed=9)
    # 400 samples and as many crossings: 5 % each, three times over, and 5 % of the approximation.
    assert rice.failure_probability(level) == pytest.approx(0.1, rel=0.25)


def test_friction_coefficients_count_in_pascals(problem):
    """0.22 was taken for 0.22 Pa."""
    pressed = dataclasses.replace(problem, load=st.Load(normal_pressure=2e6))
    spectrum = st.PowerLawSpectrum(5e-3)
    in_pascals = st.RandomField(st.Beta(alpha=2.0, beta=3.0, low=0.4e6, high=1.2e6), spectrum)
    coefficient = st.RandomField(
        st.Beta(alpha=2.0, beta=3.0, low=0.2, high=0.6), spectrum, of="friction_coefficient"
    )
    found, expected = (
        rice_distribution(pressed, field, profiles=64) for field in (coefficient, in_pascals)
    )
    np.testing.assert_allclose(found.stress, expected.stress, rtol=1e-9)
    assert np.mean(found.probability == expected.probability) > 0.99


def test_says_where_to_trust_it(problem, make_strength):
    found = rice_distribution(problem, make_strength(0.5), profiles=256)
    assert found.trusted.any()
    assert found.probability[found.trusted].max() <= 0.1
    # Ten crossings in 256 profiles: not much below 10/256, whatever the clustering.
    assert found.probability[found.trusted].min() > 0.5 * 10 / 256
    assert np.all(np.diff(found.probability) >= 0.0)
    assert found.relative_error[found.trusted].max() <= 10**-0.5
    level = found.quantile(0.05)
    assert found.failure_probability(level) == pytest.approx(0.05, rel=1e-9)
    assert found.failure_probability(0.5e6) == 0.0


@pytest.mark.parametrize("share", [0.05, 0.1, 0.3, 0.5])
def test_is_within_five_per_cent_where_it_says_so(make_strength, share):
    """Short interfaces with a mean mode, ten h_n long: at 0.3 and 0.5 it is 8 to 17 % too high."""
    problem = make_problem(160, 10.0 * make_problem().nucleation_length)
    strength = make_strength(10.0 * share, mean_mode=True)
    tau_p = strength.sample(problem.interface, samples=16384, seed=1)
    stress = st.onset(problem, tau_p, method=st.LocalCriterion()).critical_stress.values
    chances = np.array([0.01, 0.03, 0.1])
    levels = np.quantile(stress, chances)
    # From the same samples, so that most of the sampling error drops out: 1 % is left.
    found = rice_distribution(problem, strength, profiles=16384, seed=1, stress=levels)
    error = found.probability / chances - 1.0
    if share < 0.2:
        assert found.trusted[:2].all()  # the third lies on either side of P = 0.1
        assert np.abs(error).max() < 0.06
    else:
        assert not found.trusted.any()
        assert error.min() > 0.07
    # Too high by about what lies below at a point, with two per cent of sampling error.
    assert np.all(error < (1.0 - found.point_survival) / chances + 0.02)


def test_crossings_are_those_of_the_profiles(problem, make_strength):
    """Counted one by one at a few levels, on a grid four times finer."""
    strength = make_strength(1.0)
    found = rice_distribution(problem, strength, profiles=32, seed=4)
    tau_n = st.theory.nucleation_stress(
        problem, strength.sample(problem.interface, samples=32, seed=4)
    )
    # 256 nodes have nearly 9 in h_n; at least 32 are wanted.
    factor = int(np.ceil(32 * problem.interface.spacing / problem.nucleation_length))
    assert factor == 4
    tau_n = scipy.signal.resample(tau_n, 256 * factor, axis=1)
    before = np.roll(tau_n, 1, axis=1)
    for index in (100, 400, 800):
        level = found.stress[index]
        crossings = np.sum((before > level) & (tau_n <= level))
        assert found.crossing_rate[index] * 32 * 0.1 == pytest.approx(crossings, abs=1e-6)
        above = np.mean(tau_n > level)
        assert found.point_survival[index] == pytest.approx(above, abs=1e-12)
        # The formula itself, with the crossings of one interface.
        chance = 1.0 - above * np.exp(-crossings / 32 / above)
        assert found.probability[index] == pytest.approx(chance, rel=1e-9)


def test_same_seed_same_numbers(problem, make_strength):
    first, second = (rice_distribution(problem, make_strength(), profiles=64) for _ in range(2))
    np.testing.assert_array_equal(first.probability, second.probability)
    with pytest.raises(st.InputError, match="profiles"):
        rice_distribution(problem, make_strength(), profiles=3)

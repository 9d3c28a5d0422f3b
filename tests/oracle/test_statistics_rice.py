"""The distribution of the critical stress from crossing rates, against Monte Carlo."""

import dataclasses

import numpy as np
import pytest
import scipy.signal
from setups import beta_strength, ensemble, make_problem

import stiction as st
from stiction.statistics.rice import rice_distribution


def stresses(problem, strength, samples, seed):
    """Critical stresses by Monte Carlo."""
    return ensemble(problem, strength, samples, seed=seed).critical_stress.values


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_lower_tail_agrees_with_monte_carlo(problem, make_strength, ratio):
    strength = make_strength(ratio)
    found = rice_distribution(problem, strength, profiles=8192, seed=1)
    stress = stresses(problem, strength, 4 * 4096, 2)
    for probability, tolerance in ((0.03, 0.25), (0.1, 0.15)):
        # Errors of both counts: at 0.03 some 250 crossings and 490 samples, 6 and 5 %, three
        # times over, and 5 % of the approximation.
        level = np.quantile(stress, probability)
        assert found.failure_probability(level) == pytest.approx(probability, rel=tolerance)
    # Beyond its range it is too low, by a few per cent at the median.
    assert 0.44 < found.failure_probability(np.median(stress)) < 0.5


@pytest.mark.parametrize("load", [st.Load(initial_stress=2e5), st.Load(profile=2.0)])
def test_it_is_the_critical_stress_and_not_the_load(problem, make_strength, load):
    """With an initial stress it was shifted by it, with p = 2 every sample failed."""
    loaded, field = dataclasses.replace(problem, load=load), make_strength(1.0)
    level = np.quantile(stresses(loaded, field, 4000, 5), 0.1)
    rice = rice_distribution(loaded, field, profiles=2000, seed=9)
    # 400 samples and as many crossings: 5 % each, three times over, and 5 % of the approximation.
    assert rice.failure_probability(level) == pytest.approx(0.1, rel=0.25)


def test_says_where_to_trust_it(problem, make_strength):
    found = rice_distribution(problem, make_strength(0.5), profiles=256)
    assert found.trusted.any()
    assert found.probability[found.trusted].max() <= 0.1
    # Ten of 256 profiles reach it, and each crosses at least once.
    assert found.probability[found.trusted].min() > 0.95 * 10 / 256
    assert np.all(np.diff(found.probability) >= 0.0)
    assert found.relative_error[found.trusted].max() <= 10**-0.5
    level = found.quantile(0.05)
    assert found.failure_probability(level) == pytest.approx(0.05, rel=1e-9)
    assert found.failure_probability(0.5e6) == 0.0


def test_crossings_of_one_profile_are_no_evidence_of_their_own(problem):
    """A rough field with a long correlation length crosses a level several times at one place."""
    length = 8.0 * problem.nucleation_length
    marginal = st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6)
    field = st.RandomField(marginal, st.ExponentialSpectrum(length), mean_mode=True)
    found = rice_distribution(problem, field, profiles=512)
    level = found.quantile(0.1)
    reached = (stresses(problem, field, 512, 0) <= level).sum()
    error = np.interp(level, found.stress, found.relative_error)
    assert error == pytest.approx(reached**-0.5, rel=0.1)


@pytest.mark.parametrize("share", [0.05, 0.1, 0.3, 0.5])
def test_is_within_five_per_cent_where_it_says_so(make_strength, share):
    """Short interfaces with a mean mode, ten h_n long: at 0.3 and 0.5 it is 8 to 17 % too high."""
    problem = make_problem(160, 10.0 * make_problem().nucleation_length)
    strength = make_strength(10.0 * share, mean_mode=True)
    chances = np.array([0.01, 0.03, 0.1])
    # From the same samples, so that most of the sampling error drops out: 1 % is left.
    levels = np.quantile(stresses(problem, strength, 16384, 1), chances)
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
    tau_p = strength.sample(problem.interface, samples=32, seed=4)
    # 256 nodes have nearly 9 in h_n; at least 32 are wanted.
    assert 8.0 < problem.nucleation_length / problem.interface.spacing < 32.0 / 3.0
    tau_n = st.theory.nucleation_stress(problem, tau_p)
    tau_n = scipy.signal.resample(tau_n, 4 * 256, axis=1)
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


def test_dips_of_a_plane_are_nodes_less_edges_plus_faces():
    """Of what lies below a level, by whole arrays, across both seams."""
    problem = make_problem((24, 20), (0.023, 0.0164), weakening_rate=0.28e12)
    field = beta_strength(4e-3, mean_mode=True)
    levels = np.linspace(0.7e6, 1.3e6, 13)
    found = rice_distribution(problem, field, profiles=40, seed=3, stress=levels)
    tau_p = field.sample(problem.interface, samples=40, seed=3)
    tau_n = st.theory.nucleation_stress(problem, tau_p)
    for index, level in enumerate(levels):
        below = tau_n <= level
        along, across = (below & np.roll(below, -1, axis=axis) for axis in (1, 2))
        faces = along & np.roll(along, -1, axis=2)
        dips = below.sum() - along.sum() - across.sum() + faces.sum()
        reached, share = below.any(axis=(1, 2)).sum(), below.mean()
        assert found.crossing_rate[index] * 40 * 0.023 * 0.0164 == pytest.approx(dips, abs=1e-6)
        assert found.point_survival[index] == pytest.approx(1.0 - share, abs=1e-12)
        assert found.relative_error[index] == pytest.approx(max(reached, 1) ** -0.5)
        chance = max(1.0 - np.exp(-max(dips, 0) / 40), share)
        if index == 0 or chance >= found.probability[index - 1]:
            assert found.probability[index] == pytest.approx(chance, rel=1e-12)


def test_same_seed_same_numbers(problem, make_strength):
    first, second = (rice_distribution(problem, make_strength(), profiles=64) for _ in range(2))
    np.testing.assert_array_equal(first.probability, second.probability)

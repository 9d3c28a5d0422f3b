"""Failure probabilities by different algorithms, and by OpenTURNS, of the same limit states."""

import dataclasses
import math

import numpy as np
import pytest
from importance import by_importance

import stiction as st
from stiction.equilibrium.method import Equilibrium
from stiction.statistics.rice import rice_distribution

LOCAL = st.LocalCriterion()


def longer(problem, times):
    """The same problem on a line that is so many times longer."""
    interface = st.Interface(times * problem.interface.extent, times * problem.interface.size)
    return dataclasses.replace(problem, interface=interface)


@pytest.fixture(scope="module")
def system():
    problem = st.paper.problem(nodes=256)
    return problem, st.paper.strength(problem, 0.5)


def apart(one, other):
    """Distance of two estimates, in joint standard errors of their logarithms."""
    error = math.hypot(one.cv, other.cv)
    return abs(math.log(one.probability / other.probability)) / error


def by(system, stress, algorithm, cv, *, method=LOCAL, seed=0):
    if algorithm == "importance":
        return by_importance(*system, stress, method, cv, seed=seed)
    return st.failure_probability(
        *system, stress, method=method, algorithm=algorithm, target_cv=cv, seed=seed
    )


# Stresses with P of about 1e-2, 1e-3 and 1e-4; agreement within four joint standard errors.


def test_subset_and_importance_against_plain_monte_carlo(system):
    plain = by(system, 0.679e6, "plain", 0.07)
    assert apart(by(system, 0.679e6, "subset", 0.07), plain) < 4.0
    assert apart(by(system, 0.679e6, "importance", 0.05), plain) < 4.0


@pytest.mark.slow
@pytest.mark.parametrize(("stress", "cv"), [(0.670e6, 0.06), (0.6656e6, 0.2)])
def test_subset_and_importance_against_long_plain_monte_carlo(system, stress, cv):
    plain = by(system, stress, "plain", cv)
    assert plain.evaluations > 100_000
    assert apart(by(system, stress, "subset", 0.07), plain) < 4.0
    assert apart(by(system, stress, "importance", 0.04), plain) < 4.0


def test_importance_against_subset_at_one_in_a_million(system):
    shifted = by(system, 0.6617e6, "importance", 0.05)
    assert 0.3e-6 < shifted.probability < 3e-6
    assert shifted.effective_size > 100
    assert apart(by(system, 0.6617e6, "subset", 0.15), shifted) < 4.0


def test_two_levels_and_importance_agree_on_equilibrium(system):
    two = by(system, 0.6617e6, "two_level", 0.2, method=Equilibrium())
    shifted = by(system, 0.6617e6, "importance", 0.07, method=Equilibrium())
    assert apart(two, shifted) < 4.0
    # The exact limit state is asked for a few hundred samples a run, not a few thousand a level.
    assert two.evaluations < 0.2 * two.first_stage_evaluations


def test_two_levels_where_patches_interact():
    """At xi_0/h_n = 0.25 interaction lowers the typical onset most; subset takes no short cut."""
    problem = st.paper.problem(nodes=256)
    system = problem, st.paper.strength(problem, 0.25)
    two = by(system, 0.684e6, "two_level", 0.2, method=Equilibrium())
    whole = by(system, 0.684e6, "subset", 0.25, method=Equilibrium())
    assert whole.probability < 1e-3
    assert apart(two, whole) < 4.0


@pytest.mark.parametrize("method", [LOCAL, Equilibrium()], ids=["local", "equilibrium"])
def test_design_stress_has_the_probability_asked_for(system, method):
    answer = st.design_stress(*system, probability=1e-5, method=method, target_cv=0.2)
    back = by(system, answer.stress, "importance", 0.07, method=method)
    error = math.hypot(answer.cv, back.cv)
    assert abs(math.log(back.probability / 1e-5)) < 4.0 * error
    low, high = answer.interval
    assert 0.66e6 < low < answer.stress < high


def test_length_by_importance_against_plain_monte_carlo(system):
    """Four times the length, at P of about 5 %."""
    long = longer(system[0], 4), system[1]
    plain = by(long, 0.679e6, "plain", 0.07)
    assert apart(by(long, 0.679e6, "importance", 0.05), plain) < 4.0
    assert apart(by(long, 0.679e6, "subset", 0.07), plain) < 4.0


def test_rice_formula_against_plain_monte_carlo(system):
    """Good below the median; crossings pooled from 3000 profiles, against 3000 others."""
    problem, field = system
    onset = st.monte_carlo(problem, field, method=LOCAL, samples=3000, seed=1)
    found = onset["critical_stress"].values
    for chance, allowed in ((0.5, 0.12), (0.1, 0.25), (0.03, 0.4)):
        stress = np.quantile(found, chance)
        rice = rice_distribution(problem, field, profiles=3000, stress=[stress]).probability[0]
        # 5 to 8 % low at the median; binomial errors of 10 and 18 % twice over in the tail.
        assert rice == pytest.approx(chance, rel=allowed)


@pytest.mark.slow
def test_against_openturns_subset_sampling():
    """Its block size must not exceed p_0 N: larger blocks report too small an error."""
    ot = pytest.importorskip("openturns")
    problem = st.paper.problem(nodes=256)
    field = st.paper.strength(problem, 1.0)
    state = st.external.limit_state(problem, field, LOCAL)
    stress, dimension = 0.6615e6, state.dimension

    def sample(points):
        return state(np.asarray(points))[:, None]

    ot.RandomGenerator.SetSeed(1)
    function = ot.PythonFunction(dimension, 1, func_sample=sample)
    vector = ot.RandomVector(ot.Normal(dimension))
    event = ot.ThresholdEvent(ot.CompositeRandomVector(function, vector), ot.Less(), stress)
    found = []
    for _ in range(6):
        algorithm = ot.SubsetSampling(event)
        algorithm.setMaximumOuterSampling(20)
        algorithm.setBlockSize(100)
        algorithm.setConditionalProbability(0.1)
        algorithm.run()
        found.append(algorithm.getResult().getProbabilityEstimate())
    theirs, spread = np.mean(found), np.std(found, ddof=1) / math.sqrt(len(found))
    ours = by((problem, field), stress, "subset", 0.1)
    assert ours.probability < 1e-3
    error = math.hypot(spread, ours.probability * ours.cv)
    # Four joint standard errors; theirs from the spread of its own six runs.
    assert abs(theirs - ours.probability) < 4.0 * error

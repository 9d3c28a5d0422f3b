"""Failure probabilities by different algorithms of the same limit states."""

import math

import numpy as np
import pytest
from crooked import LINE
from importance import by_importance
from setups import EXACT, LOCAL, beta_strength, ensemble, without

import stiction as st

PROBLEM = st.paper.problem(nodes=256)
SYSTEM = PROBLEM, st.paper.strength(PROBLEM, 0.5)


def by(system, stress, algorithm, cv, *, method=LOCAL, seed=0):
    if algorithm == "importance":
        return by_importance(*system, stress, method, cv, seed=seed)
    options = {"method": method, "algorithm": algorithm, "target_cv": cv, "seed": seed}
    return st.failure_probability(*system, stress, **options)


def assert_agree(one, other):
    """Within four joint standard errors of their logarithms."""
    error = math.hypot(one.cv, other.cv)
    assert abs(math.log(one.probability / other.probability)) < 4.0 * error


# P is about 1e-2 and 1e-4.
@pytest.mark.parametrize(
    ("stress", "cvs", "least"),
    [
        (0.679e6, (0.07, 0.1, 0.05), 0),
        pytest.param(0.6656e6, (0.2, 0.07, 0.04), 100_000, marks=pytest.mark.slow),
    ],
)
def test_subset_and_importance_against_plain_monte_carlo(stress, cvs, least):
    algorithms = "plain", "subset", "importance"
    plain, subset, importance = (
        by(SYSTEM, stress, algorithm, cv) for algorithm, cv in zip(algorithms, cvs, strict=True)
    )
    assert plain.evaluations > least
    assert_agree(subset, plain)
    assert_agree(importance, plain)


def test_importance_against_subset_at_one_in_a_million():
    shifted = by(SYSTEM, 0.6617e6, "importance", 0.05)
    assert 0.3e-6 < shifted.probability < 3e-6
    assert shifted.effective_size > 100
    assert_agree(by(SYSTEM, 0.6617e6, "subset", 0.15), shifted)


def test_two_levels_and_importance_agree_on_equilibrium():
    two = by(SYSTEM, 0.6617e6, "two_level", 0.2, method=EXACT)
    assert_agree(two, by(SYSTEM, 0.6617e6, "importance", 0.07, method=EXACT))
    # The exact limit state is asked for a few hundred samples a run, not a few thousand a level.
    assert two.evaluations < 0.2 * two.first_stage_evaluations


def test_two_levels_where_patches_interact():
    """At xi_0/h_n = 0.25 interaction lowers the typical onset most; subset takes no short cut."""
    system = PROBLEM, st.paper.strength(PROBLEM, 0.25)
    two = by(system, 0.684e6, "two_level", 0.2, method=EXACT)
    whole = by(system, 0.684e6, "subset", 0.3, method=EXACT)
    assert whole.probability < 1e-3
    assert_agree(two, whole)


def test_design_stress_has_the_probability_asked_for():
    answer = st.design_stress(*SYSTEM, probability=1e-5, method=EXACT, target_cv=0.2)
    back = by(SYSTEM, answer.stress, "importance", 0.07, method=EXACT)
    error = math.hypot(answer.cv, back.cv)
    assert abs(math.log(back.probability / 1e-5)) < 4.0 * error
    low, high = answer.interval["stress"]
    assert 0.66e6 < low < answer.stress < high


def test_two_very_different_interfaces_against_counting_and_each_alone():
    """On a crooked line: short and weak, or long and strong with a random residual strength."""
    problem = without(LINE, "friction.residual_strength")
    residual = st.Lognormal(mean=0.2e6, cv=0.1)
    pair = [
        st.RandomInterface(
            strength=beta_strength(length, low, 1.9e6),
            residual_strength=st.RandomField(residual, st.ExponentialSpectrum(5e-3)),
            between={"strength": st.Lognormal(mean=1.0, cv=cv)},
        )
        for length, low, cv in ((2.3e-3, 0.66e6, 0.03), (17e-3, 0.73e6, 0.11))
    ]
    onsets = [ensemble(problem, one, 4000, seed=4).critical_stress.values for one in pair]
    together = ensemble(problem, pair, 4000, seed=9).critical_stress.values
    for share in (0.2, 0.02):
        stress = float(np.quantile(np.concatenate(onsets), share))
        each = np.array([(own < stress).mean() for own in onsets])
        # Counting the list, and the tail of the list, within four standard errors.
        error = 4.0 * (share / 4000) ** 0.5
        assert (together < stress).mean() == pytest.approx(share, abs=error)
    found = by((problem, pair), stress, "subset", 0.1)
    error = math.hypot(found.cv, (share * 8000) ** -0.5)
    assert found.probability == pytest.approx(share, rel=4.0 * error)
    assert each.min() < 0.5 * each.max()
    assert found.members == pytest.approx(each, rel=0.3, abs=0.05 * each.max())
    assert found.probability == pytest.approx(found.members.mean(), rel=1e-9)
    design = st.design_stress(problem, pair, probability=0.001, method=LOCAL, target_cv=0.1)
    alone = [by((problem, one), design.stress, "subset", 0.15).probability for one in pair]
    assert np.mean(alone) == pytest.approx(0.001, rel=4.0 * math.hypot(0.1, 0.15))
    # In the other order they are the same two.
    back = by((problem, pair[::-1]), stress, "plain", 0.1)
    assert back.members[::-1] == pytest.approx(each, rel=0.3, abs=0.05 * each.max())

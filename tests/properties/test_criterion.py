"""The local criterion on lines and planes: symmetries, bounds, and theory of its stress."""

import numpy as np
import pytest
from checks import assert_mean
from hypothesis import given, settings
from hypothesis import strategies as hs
from oracles import symbol_of, times
from refusals import warning_texts
from setups import (
    LENGTH,
    LOCAL,
    RATE,
    ROUND_OFF,
    beta_strength,
    ensemble,
    local_onset,
    make_problem,
)

import stiction as st
from stiction.methods.criterion.average import averages
from stiction.methods.criterion.windows import windows_of

PROBLEM = make_problem(128)
PLANE = make_problem((48, 48), (5.0 * LENGTH, 4.0 * LENGTH))


def onset(tau_p):
    result = local_onset(PROBLEM, tau_p)
    return float(result.critical_load[0]), float(result.critical_position[0])


@settings(max_examples=40, deadline=None)
@given(levels=hs.lists(hs.floats(3.0, 9.0), min_size=2, max_size=12), seed=hs.integers(0, 1000))
def test_lies_between_the_least_and_the_greatest_strength_whatever_the_jumps(levels, seed):
    """Blocks of strengths over six decades, 4.4 nodes in h_n."""
    rng = np.random.default_rng(seed)
    tau_p = np.repeat(10.0 ** np.array(levels), 11)[: 128 - 1]
    tau_p = np.append(tau_p, np.full(128 - tau_p.size, tau_p[-1])) * rng.uniform(0.9, 1.1, 128)
    load, _ = onset(tau_p)
    tau_n = st.theory.nucleation_stress(PROBLEM, tau_p)
    least, most = (1.0 - ROUND_OFF) * tau_p.min(), (1.0 + ROUND_OFF) * tau_p.max()
    assert least <= load <= tau_n.min() * (1.0 + ROUND_OFF)
    assert tau_n.max() <= most


def field_of(ratio=0.7, **options):
    return beta_strength(ratio * LENGTH, **options)


def test_weights_certify_the_bound():
    """(K - W) y <= 0 everywhere, with spectral wave vectors too: an upper bound."""
    for window in windows_of(PLANE, RATE):
        y = window.weight
        assert y.min() >= 0.0
        assert y.sum() == pytest.approx(1.0, rel=1e-12)
        forces = times(symbol_of(PLANE), y) - RATE * y
        assert forces.max() < 1e-6 * RATE * y.max()  # residual of the eigenvector


@pytest.mark.parametrize("mean_mode", [False, True])
def test_variance_of_the_nucleation_stress_of_a_plane_is_that_of_theory(mean_mode):
    field = field_of(1.0, mean_mode=mean_mode, anisotropy=1.4)
    theory = st.theory.nucleation_statistics(PLANE, field)
    middle = windows_of(PLANE, RATE, stretches=(1.0,))
    strength = field.sample(PLANE.interface, samples=400, seed=2)
    each = averages(PLANE.interface, middle, strength, np.ones((48, 48)))
    tau_n = np.array([next(windows) for windows in each])
    assert_mean(((tau_n - theory.mean) ** 2).mean(axis=(1, 2)), theory.variance, errors=4.0)
    assert_mean(tau_n.mean(axis=(1, 2)), theory.mean, errors=4.0)


def test_failure_probability_of_a_plane_is_that_of_counting():
    plane = make_problem((20, 24), (4.0 * LENGTH, 3.5 * LENGTH))
    field, options = field_of(), {"method": LOCAL, "progress": False, "target_cv": 0.25}
    onsets = ensemble(plane, field, 3000, seed=9).critical_stress.values
    stress, counted, own = float(np.quantile(onsets, 0.01)), 0.01, 1.0 / np.sqrt(30.0)
    found = st.failure_probability(plane, field, stress, algorithm="subset", seed=1, **options)
    assert abs(found.probability / counted - 1.0) < 4.0 * np.hypot(own, found.cv)
    assert found.failing_profiles.strength.dims[-2:] == ("x", "y")


def test_coarse_directions_are_named():
    def onset_on(*nodes):
        local_onset(make_problem(nodes, PLANE.interface.length), np.full(nodes, 1e6))

    (text,) = warning_texts(lambda: onset_on(48, 26))
    assert "9.6 nodes along x and, in mode III, 4.4 along" in text
    assert warning_texts(lambda: onset_on(60, 72)) == []

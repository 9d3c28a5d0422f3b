"""The local criterion on lines and planes: symmetries, bounds, and theory of its stress."""

import warnings

import numpy as np
import pytest
from checks import assert_mean
from hypothesis import given, settings
from hypothesis import strategies as hs
from importance import by_importance
from oracles import symbol_of, times
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


def on_circle(difference):
    return abs((difference + 0.05) % 0.1 - 0.05)


profiles = hs.integers(0, 1000).map(
    lambda i: beta_strength(2e-3).sample(PROBLEM.interface, samples=1, first=i)
)


@settings(max_examples=50, deadline=None)
@given(tau_p=profiles, shift=hs.integers(0, 127), factor=hs.floats(0.1, 10.0),
       offset=hs.floats(0.0, 1e6))  # fmt: skip
def test_symmetries_of_a_line(tau_p, shift, factor, offset):
    """Shifts move the place, reflection mirrors it, affine scaling keeps it and scales the load."""
    load, place = onset(tau_p)
    mirrored = np.roll(tau_p[:, ::-1], 1, axis=1)  # x -> -x on the circle
    away = shift * PROBLEM.interface.spacing
    for changed, its_load, its_place in (
        (np.roll(tau_p, shift, axis=1), load, place + away),
        (mirrored, load, -place),
        (factor * tau_p + offset, factor * load + offset, place),
    ):
        found_load, found_place = onset(changed)
        assert abs(found_load / its_load - 1.0) < 1e-12
        # The slope vanishes at the minimum: round-off of the load is the square of the place's.
        assert on_circle(found_place - its_place) < 1e-8
    assert tau_p.min() < load <= tau_p.mean() * (1.0 + 1e-12)


@settings(max_examples=100, deadline=None)
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


def test_the_minimum_of_a_rough_line_is_the_same_wherever_the_line_begins():
    """Strengths without correlation, whose minima lie at every node, the seam among them."""
    problem = make_problem(64, 0.02)
    rough = np.random.default_rng(5).uniform(0.6e6, 1.4e6, (300, 64))
    found = local_onset(problem, rough).critical_stress
    for shift in range(1, 64):
        there = local_onset(problem, np.roll(rough, shift, axis=1)).critical_stress
        np.testing.assert_allclose(there, found, rtol=ROUND_OFF)


def test_weights_certify_the_bound():
    """(K - W) y <= 0 everywhere, with spectral wave vectors too: an upper bound."""
    for window in windows_of(PLANE, RATE):
        y = window.weight
        assert y.min() >= 0.0
        assert y.sum() == pytest.approx(1.0, rel=1e-12)
        forces = times(symbol_of(PLANE), y) - RATE * y
        assert forces.max() < 1e-6 * RATE * y.max()  # residual of the eigenvector


def test_translations_and_reflections_of_a_plane_change_nothing():
    strength = field_of().sample(PLANE.interface, samples=3, seed=1)
    first = local_onset(PLANE, strength).critical_load
    shifted = np.roll(strength, (7, -3), (1, 2))
    for changed in (shifted, strength[:, ::-1].copy(), strength[:, :, ::-1].copy()):
        found = local_onset(PLANE, changed).critical_load
        np.testing.assert_allclose(first, found, rtol=1e-12)


def test_between_least_and_greatest_strength_of_a_plane():
    weak = np.random.default_rng(0).random((2, 48, 48)) < 0.5
    tau_n = st.theory.nucleation_stress(PLANE, np.where(weak, 0.7e6, 1.6e6))
    assert tau_n.min() >= 0.7e6 * (1.0 - ROUND_OFF)
    assert tau_n.max() <= 1.6e6 * (1.0 + ROUND_OFF)
    uniform = local_onset(PLANE, np.full((48, 48), 1e6))
    assert uniform.critical_load.item() == pytest.approx(1e6, rel=1e-13)


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
    plane = make_problem((32, 32), (4.0 * LENGTH, 3.5 * LENGTH))
    field, options = field_of(), {"method": LOCAL, "progress": False, "target_cv": 0.25}
    onsets = ensemble(plane, field, 3000, seed=9).critical_stress.values
    stress, counted, own = float(np.quantile(onsets, 0.01)), 0.01, 1.0 / np.sqrt(30.0)
    found = st.failure_probability(plane, field, stress, algorithm="subset", seed=1, **options)
    shifted = by_importance(plane, field, stress, LOCAL, 0.25, seed=1)
    for one in (found, shifted):
        assert abs(one.probability / counted - 1.0) < 4.0 * np.hypot(own, one.cv)
    assert found.failing_profiles.strength.dims[-2:] == ("x", "y")
    wanted = st.design_stress(plane, field, probability=0.01, seed=2, **options)
    # Four standard errors on either side, by the density of the onsets there.
    low, high = np.quantile(onsets, [0.01 * (1.0 - 4.0 * own) + 1e-4, 0.01 * (1.0 + 4.0 * own)])
    assert low < wanted.stress < high


def test_coarse_directions_are_named():
    def onset_on(*nodes):
        local_onset(make_problem(nodes, PLANE.interface.length), np.full(nodes, 1e6))

    words = r"9\.6 nodes along x and, in mode III, 4\.4 along"
    with pytest.warns(st.AccuracyWarning, match=words):
        onset_on(48, 26)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        onset_on(60, 72)

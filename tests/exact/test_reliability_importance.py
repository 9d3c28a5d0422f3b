"""The importance density and its dips, where both are known in closed form."""

import numpy as np
import pytest
import scipy.stats
from checks import assert_mean, standard_error
from importance import dips, log_weights, mixture

import stiction as st

PROBLEM = st.paper.problem(nodes=256)
LINE = PROBLEM.interface


def nucleation_stress(profiles):
    return st.theory.nucleation_stress(PROBLEM, profiles)


@pytest.mark.parametrize("mean_mode", [False, True])
def test_dips_of_a_gaussian_strength_are_exact(mean_mode):
    """A Gaussian strength makes tau_n Gaussian: beta = (mean - s)/sd(tau_n)."""
    spectrum = st.paper.strength(PROBLEM).spectrum
    field = st.RandomField(scipy.stats.norm(1e6, 5e4), spectrum, mean_mode)
    deviation = nucleation_stress(field.sample(LINE, samples=20_000, seed=3)).std()
    found = dips(PROBLEM, field, 0.9e6)
    # The variance of 20,000 profiles of some thirty independent lengths is good to 0.3 %.
    assert np.linalg.norm(found[0]) == pytest.approx(1e5 / deviation, rel=0.005)
    stress = nucleation_stress(field.profiles(LINE, found))
    assert np.diag(stress) == pytest.approx(0.9e6, abs=0.2)
    np.testing.assert_array_equal(stress.argmin(axis=1), np.arange(256))


def test_a_dip_lies_on_the_limit_and_no_draws_nearer():
    field = st.paper.strength(PROBLEM, 0.5)
    dip = dips(PROBLEM, field, 0.67e6)[0]
    # Random neighbours at a distance closer to the origin do not fail at x = 0.
    rng = np.random.default_rng(0)
    near = dip + 0.5 * rng.standard_normal((2000, dip.size)) / np.sqrt(50.0)
    near *= 0.995 * np.linalg.norm(dip) / np.linalg.norm(near, axis=1, keepdims=True)
    assert nucleation_stress(field.profiles(LINE, near))[:, 0].min() > 0.67e6


def test_weights_make_the_mixture_normal_again():
    """E[w h] over the mixture is E[h] over the normal density, for h that the mixture covers."""
    shifts = np.zeros((3, 40))
    shifts[:, :6] = (1.0, 0.5, 0.5, -0.5, 0.2, 0.1), (0.5, 1.0, 0.5, 0.5, 0, 0), (0.1,) * 6
    draws, logs = mixture(shifts, 200_000, np.random.default_rng(2))
    weights = np.exp(logs)
    for found in (weights, weights * draws[:, 0] ** 2):
        assert_mean(found, 1.0, errors=4.0)
        assert standard_error(found) < 0.02


def test_log_weights_survive_six_hundred_dimensions():
    shift = np.full((1, 600), 0.5)
    logs = log_weights(shift, np.vstack([4.0 * shift, -4.0 * shift]))
    assert np.all(np.isfinite(logs))
    # At four times the shift the density ratio is about exp(4*150 - 75): far beyond underflow.
    assert logs[0] < -500.0

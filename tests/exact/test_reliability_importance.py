"""The importance density and its design point, where both are known in closed form."""

import numpy as np
import pytest
import scipy.stats
from importance import Mixture, design_point

import stiction as st


@pytest.fixture(scope="module")
def system():
    return st.paper.problem(nodes=256)


@pytest.mark.parametrize("mean_mode", [False, True])
def test_design_point_of_a_gaussian_strength_is_exact(system, mean_mode):
    """A Gaussian strength makes tau_n Gaussian: beta = (mean - s)/sd(tau_n)."""
    field = st.RandomField(
        scipy.stats.norm(1e6, 5e4), st.paper.strength(system).spectrum, mean_mode
    )
    profiles = field.sample(system.interface, samples=20_000, seed=3)
    deviation = st.theory.nucleation_stress(system, profiles).std()
    point = design_point(system, field, 0.9e6)
    assert point.converged
    # The variance of 20,000 profiles of some thirty independent lengths is good to 0.3 %.
    assert point.index == pytest.approx(1e5 / deviation, rel=0.005)
    profile = field.profiles(system.interface, point.draws[None])
    # The iteration stops at 1e-6 of the way from the mean.
    assert st.theory.nucleation_stress(system, profile)[0, 0] == pytest.approx(0.9e6, abs=0.2)


def test_design_point_lies_on_the_limit_and_nowhere_nearer(system):
    field = st.paper.strength(system, 0.5)
    point = design_point(system, field, 0.67e6)
    tau = st.theory.nucleation_stress(
        system, field.profiles(system.interface, point.draws[None])
    )[0]
    assert tau[0] == pytest.approx(0.67e6, abs=1.0)
    assert np.argmin(tau) == 0
    # Random neighbours at a distance closer to the origin do not fail at x = 0.
    rng = np.random.default_rng(0)
    near = point.draws + 0.5 * rng.standard_normal((2000, point.draws.size)) / np.sqrt(50.0)
    near *= 0.995 * point.index / np.linalg.norm(near, axis=1, keepdims=True)
    there = st.theory.nucleation_stress(system, field.profiles(system.interface, near))[:, 0]
    assert there.min() > 0.67e6


@pytest.mark.parametrize("mean_mode", [False, True])
def test_shift_moves_along_the_interface(system, mean_mode):
    field = st.RandomField(
        st.paper.strength(system).marginal, st.paper.strength(system).spectrum, mean_mode
    )
    rng = np.random.default_rng(1)
    shift = rng.standard_normal(field.modes(system.interface).dimension)
    mixture = Mixture(shift, (256,), field.modes(system.interface).numbers[:, 1:], mean_mode)
    moved = mixture.moved(np.array([0, 1, 100]))
    z = field.gaussian(system.interface, np.vstack([shift, moved]))
    for row, node in zip(z[1:], (0, 1, 100), strict=True):
        # Turning phases is exact to round-off.
        np.testing.assert_allclose(row, np.roll(z[0], node), atol=1e-12)
    draws = rng.standard_normal((3, shift.size))
    direct = draws @ mixture.moved(np.arange(256)).T
    np.testing.assert_allclose(mixture.projections(draws), direct, atol=1e-10)


def test_weights_make_the_mixture_normal_again():
    """E[w h] over the mixture is E[h] over the normal density, for h that the mixture covers."""
    shift = np.zeros(40)
    shift[:6] = (1.0, 0.5, 0.5, -0.5, 0.2, 0.1)
    mixture = Mixture(shift, (64,), np.arange(1, 21)[None])
    draws = mixture.sample(200_000, np.random.default_rng(2))
    weights = np.exp(mixture.log_weights(draws))
    for values, expected in ((np.ones(len(draws)), 1.0), (draws[:, 0] ** 2, 1.0)):
        found = weights * values
        # Four standard errors.
        error = found.std() / np.sqrt(len(draws))
        assert abs(found.mean() - expected) < 4.0 * error
        assert error < 0.02


def test_log_weights_survive_six_hundred_dimensions():
    shift = np.full(600, 0.5)
    mixture = Mixture(shift, (1024,), np.arange(1, 301)[None])
    logs = mixture.log_weights(np.vstack([4.0 * shift, -4.0 * shift]))
    assert np.all(np.isfinite(logs))
    # At four times the shift the density ratio is about exp(4*150 - 75): far beyond underflow.
    assert logs[0] < -500.0

"""Mean and variance of the nucleation stress against their definitions and limits."""

import dataclasses

import numpy as np
import pytest
import scipy.stats
from scipy.integrate import quad

import stiction as st
from stiction.criterion.eigenproblem import exact_weight
from stiction.random.mapping import correlation_of_mapped, hermite_coefficients
from stiction.statistics.moments import (
    nucleation_limits,
    nucleation_statistics,
    strength_spectrum,
)


@pytest.mark.parametrize("ratio", [0.25, 1.0])
def test_variance_is_the_double_integral(problem, make_strength, ratio):
    """Midpoint rule on 1500 x 1500 cells of the definition, on an infinite interface."""
    strength = make_strength(ratio)
    t = (np.arange(1500) + 0.5) * np.pi / 1500
    s, measure = np.cos(t), np.sin(t) * np.pi / 1500
    share = exact_weight().at(s) * measure
    lags = np.abs(s[:, None] - s[None, :]) * problem.nucleation_length / 2.0
    rho = strength.spectrum.untruncated_correlation(lags)
    c = correlation_of_mapped(rho, hermite_coefficients(strength.marginal))
    found = nucleation_statistics(problem, strength, infinite=True)
    # The midpoint rule in the angle converges as fast as the integrand is smooth; C has a kink in
    # its seventh derivative only.
    assert found.variance_ratio == pytest.approx(share @ c @ share, rel=1e-7)
    assert found.variance == pytest.approx(found.variance_ratio * strength.standard_deviation**2)


def test_periodic_variance_is_that_of_the_grid(problem, make_strength):
    """The covariance matrix of the nodes, averaged by the weights of nucleation_stress itself."""
    strength = make_strength(0.5)
    c = strength.correlation(problem.interface)
    weights = st.nucleation_stress(problem, 1e6 + np.eye(256))[:, 0] - 1e6  # of every node
    matrix = c[(np.arange(256)[:, None] - np.arange(256)[None, :]) % 256]
    found = nucleation_statistics(problem, strength)
    # 1e6 + 1 keeps ten digits of the one.
    assert found.variance_ratio == pytest.approx(weights @ matrix @ weights, rel=1e-8)
    assert found.mean == pytest.approx(strength.mean, rel=1e-14)


def test_periodic_tends_to_infinite(problem, make_strength):
    """Without the mean mode a share of about the correlation length over L is missing."""
    strength = make_strength(0.5)
    infinite = nucleation_statistics(problem, strength, infinite=True).variance_ratio
    gaps = []
    for factor in (1, 2, 4):
        grid = st.Interface(length=0.1 * factor, nodes=256 * factor)
        longer = dataclasses.replace(problem, interface=grid)
        gaps.append(infinite - nucleation_statistics(longer, strength).variance_ratio)
    assert gaps[0] > 0.0
    # What is missing falls as 1/L; truncation at 2.5 lambda leaves a few 1e-5 besides.
    assert gaps[0] / gaps[1] == pytest.approx(2.0, rel=0.05)
    assert gaps[1] / gaps[2] == pytest.approx(2.0, rel=0.05)


def test_short_correlation_is_linear(problem):
    """A Gaussian marginal keeps exp(-x/xi), whose integral is 2 xi: the slope is in closed form."""
    marginal = scipy.stats.norm(loc=1e6, scale=1e5)
    xi = 0.01 * problem.nucleation_length
    strength = st.RandomField(
        marginal=marginal, spectrum=st.ExponentialSpectrum(correlation_length=xi)
    )
    square = quad(lambda s: float(exact_weight().at(np.array([s]))[0]) ** 2, -1.0, 1.0)[0]
    slope = nucleation_limits(problem, strength).short_slope
    assert slope == pytest.approx(4.0 * square, rel=1e-4)  # Simpson's rule across the kink
    ratio = nucleation_statistics(problem, strength, infinite=True).variance_ratio
    # At xi = h_n/100 the next order is about xi/h_n.
    assert ratio == pytest.approx(0.01 * slope, rel=0.03)


def test_long_correlation_at_fixed_length(problem):
    """One mode left: the closed limit is what the general formula gives."""
    xi = 2.4 * problem.interface.length
    marginal = st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6)
    strength = st.RandomField(
        marginal=marginal, spectrum=st.PowerLawSpectrum(correlation_length=xi)
    )
    assert strength.modes(problem.interface).count == 1
    limit = nucleation_limits(problem, strength).long_ratio_fixed_length
    found = nucleation_statistics(problem, strength).variance_ratio
    # Twice the error of the weights on a grid of 9 nodes in h_n, |k| h_n/2 = 0.14 and multiples.
    assert found == pytest.approx(limit, rel=1e-6)
    uniform = st.RandomField(
        marginal=marginal,
        spectrum=st.PowerLawSpectrum(correlation_length=1e3 * xi, truncation=1e4),
        mean_mode=True,
    )
    assert nucleation_limits(problem, uniform).long_ratio_fixed_length == 1.0
    assert nucleation_statistics(problem, uniform).variance_ratio == pytest.approx(1.0, abs=1e-6)


def test_spectrum_sums_to_one(problem, make_strength):
    power = strength_spectrum(problem, make_strength(0.25))
    assert power.sum() == pytest.approx(1.0, rel=1e-12)
    assert power.shape == (129,)


def test_uniform_load_and_initial_stress_scale(problem, make_strength):
    """tau_n = (<g, tau_p> - tau_i)/p."""
    loaded = dataclasses.replace(problem, load=st.Load(profile=2.0, initial_stress=1e5))
    plain = nucleation_statistics(problem, make_strength())
    found = nucleation_statistics(loaded, make_strength())
    assert found.mean == pytest.approx((plain.mean - 1e5) / 2.0)
    assert found.variance == pytest.approx(plain.variance / 4.0)


def test_rounded_weights_are_too_heavy(problem, make_strength):
    found = nucleation_statistics(problem, make_strength(), weights="rounded")
    assert found.mean / found.strength_mean == pytest.approx(1.00036, abs=1e-5)  # to its digits


def test_load_that_varies_is_refused(problem, make_strength):
    varying = dataclasses.replace(problem, load=st.Load(profile=np.linspace(0.9, 1.1, 256)))
    with pytest.raises(st.InputError, match=r"load\.profile.*monte_carlo"):
        nucleation_statistics(varying, make_strength())

"""Random fields against theory and against another library, by sampling."""

import gstools
import numpy as np
import pytest
import scipy.stats
from setups import beta_strength

import stiction as st
from stiction.random.mapping import hermite_coefficients

SAMPLES = 100_000


@pytest.fixture(scope="module")
def sampled():
    """1e5 samples on a short, coarse interface: 64 nodes, L = 16 xi_0."""
    interface = st.Interface(length=1.0, nodes=64)
    strength = beta_strength(1.0 / 16.0)
    return strength, interface, strength.sample(interface, samples=SAMPLES, seed=11)


def test_marginal_at_one_node(sampled):
    strength, _, profiles = sampled
    result = scipy.stats.kstest(profiles[:, 17], strength.marginal.distribution.cdf)
    # Fixed seed, so no flakiness: a p-value this small would occur once in a thousand seeds.
    assert result.pvalue > 1e-3


def test_marginal_of_another_distribution():
    interface = st.Interface(length=1.0, nodes=64)
    distribution = scipy.stats.lognorm(0.4, scale=1e6)
    strength = st.RandomField(
        marginal=distribution, spectrum=st.ExponentialSpectrum(correlation_length=0.05)
    )
    profiles = strength.sample(interface, samples=20_000, seed=2)
    assert scipy.stats.kstest(profiles[:, 0], distribution.cdf).pvalue > 1e-3
    assert scipy.stats.kstest(profiles[:, 40], distribution.cdf).pvalue > 1e-3


def test_variance_and_correlation(sampled):
    strength, interface, profiles = sampled
    deviation = profiles - strength.mean
    # Each lag averages 64 pairs of each sample; the samples are independent, so the standard
    # error of the estimate comes from its scatter between them.
    expected = strength.standard_deviation**2 * strength.correlation(interface)
    for lag in (0, 1, 2, 4, 8, 16, 32):
        products = (deviation * np.roll(deviation, -lag, axis=1)).mean(axis=1)
        error = products.std() / np.sqrt(SAMPLES)
        assert abs(products.mean() - expected[lag]) < 4.0 * error


def test_correlation_of_z_and_of_the_strength_differ_as_the_hermite_expansion_says(sampled):
    strength, interface, _ = sampled
    z, tau = strength.correlation(interface, of="z"), strength.correlation(interface)
    assert np.all(np.abs(tau[1:]) < np.abs(z[1:]))
    # The first Hermite coefficient carries 0.966 of the variance of this Beta marginal.
    power = hermite_coefficients(strength.marginal)[1:] ** 2
    assert power[0] / power.sum() == pytest.approx(0.966, abs=5e-4)
    assert power.sum() == pytest.approx(strength.standard_deviation**2, rel=1e-6)


def test_covariance_of_gstools():
    """GSTools' Matern model of smoothness 7/2, whose length scale is sqrt(nu)/lambda."""
    spectrum = st.PowerLawSpectrum(correlation_length=0.3, exponent=4.0)
    lam, smoothness = 2.0 * np.pi / 0.3, 3.5
    model = gstools.Matern(dim=1, var=1.0, nu=smoothness, len_scale=np.sqrt(smoothness) / lam)
    lags = np.linspace(0.0, 0.6, 40)
    found = spectrum.untruncated_correlation(lags)
    np.testing.assert_allclose(found, model.correlation(lags), atol=1e-10)
    # On a long interface with the mean mode the discrete correlation tends to the same.
    interface = st.Interface(length=6.0, nodes=1024)
    strength = st.RandomField(
        marginal=scipy.stats.norm(5.0, 1.0),
        spectrum=st.PowerLawSpectrum(correlation_length=0.3, truncation=10.0),
        mean_mode=True,
    )
    found = strength.correlation(interface, of="z")[:100]
    # Truncation at 10 lambda leaves out 4e-8 of the power.
    np.testing.assert_allclose(found, model.correlation(interface.x[:100]), atol=1e-7)

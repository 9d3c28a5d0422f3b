"""Random fields against theory by sampling, and correlations against two other libraries."""

import gstools
import numpy as np
import openturns
import pytest
import scipy.stats
import xarray as xr
from checks import assert_mean
from setups import beta_strength

import stiction as st
from stiction.random.mapping import hermite_coefficients

XI = 2e-3
LAMBDA = 2.0 * np.pi / XI
R = np.linspace(0.0, 2.0 * XI, 41)
CASES = {
    f"power law {p}": (
        st.PowerLawSpectrum(correlation_length=XI, exponent=p),
        gstools.Matern(dim=1, nu=p - 0.5, len_scale=np.sqrt(p - 0.5) / LAMBDA),
        openturns.MaternModel([np.sqrt(2.0 * (p - 0.5)) / LAMBDA], [1.0], p - 0.5),
    )
    for p in (1.0, 1.5, 2.0, 4.0)
} | {
    "exponential": (
        st.ExponentialSpectrum(correlation_length=XI),
        gstools.Exponential(dim=1, len_scale=XI),
        openturns.AbsoluteExponential([XI]),
    ),
    "squared exponential": (
        st.SquaredExponentialSpectrum(correlation_length=XI),
        gstools.Gaussian(dim=1, len_scale=XI * np.sqrt(np.pi) / 2.0),
        openturns.SquaredExponential([XI / np.sqrt(2.0)], [1.0]),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_the_same_field_elsewhere(name):
    """What docs/correlation-lengths.md says of other libraries, to the last digits."""
    here, other, third = CASES[name]
    expected = here.untruncated_correlation(R)
    np.testing.assert_allclose(other.correlation(R), expected, atol=1e-12)
    np.testing.assert_allclose([third([r])[0, 0] for r in R], expected, atol=1e-12)


def test_correlation_of_a_long_interface_with_its_mean_mode_is_that_of_gstools():
    interface = st.Interface(length=20.0 * XI, nodes=1024)
    spectrum = st.PowerLawSpectrum(correlation_length=XI, truncation=10.0)
    field = st.RandomField(scipy.stats.norm(5.0, 1.0), spectrum, mean_mode=True)
    expected = CASES["power law 4.0"][1].correlation(interface.x[:100])
    # Truncation at 10 lambda leaves out 4e-8 of the power.
    found = field.correlation(interface, of="z")[:100]
    np.testing.assert_allclose(found, expected, atol=1e-7)


LINE = st.Interface(length=1.0, nodes=64)


@pytest.fixture(scope="module")
def sampled():
    """1e5 samples on a short, coarse interface: 64 nodes, L = 16 xi_0."""
    strength = beta_strength(1.0 / 16.0)
    return strength, strength.sample(LINE, samples=100_000, seed=11)


def assert_marginal(values, field):
    """With a fixed seed: a p-value this small would occur once in a thousand seeds."""
    assert scipy.stats.kstest(values, field.marginal.distribution.cdf).pvalue > 1e-3


def test_marginal_at_one_node(sampled):
    strength, profiles = sampled
    assert_marginal(profiles[:, 17], strength)
    distribution = scipy.stats.lognorm(0.4, scale=1e6)
    field = st.RandomField(distribution, st.ExponentialSpectrum(correlation_length=0.05))
    profiles = field.sample(LINE, samples=20_000, seed=2)
    assert_marginal(profiles[:, 0], field)
    assert_marginal(profiles[:, 40], field)


def test_variance_and_correlation(sampled):
    strength, profiles = sampled
    deviation = profiles - strength.mean
    expected = strength.standard_deviation**2 * strength.correlation(LINE)
    # Each lag averages 64 pairs of each sample; the samples are independent.
    for lag in (0, 1, 2, 4, 8, 16, 32):
        products = (deviation * np.roll(deviation, -lag, axis=1)).mean(axis=1)
        assert_mean(products, expected[lag], errors=4.0)


def test_correlation_of_z_and_of_the_strength_differ_as_the_hermite_expansion_says():
    strength = beta_strength(1.0 / 16.0)
    z, tau = strength.correlation(LINE, of="z"), strength.correlation(LINE)
    assert np.all(np.abs(tau[1:]) < np.abs(z[1:]))
    # The first Hermite coefficient carries 0.966 of the variance of this Beta marginal.
    power = hermite_coefficients(strength.marginal)[1:] ** 2
    assert power[0] / power.sum() == pytest.approx(0.966, abs=5e-4)
    assert power.sum() == pytest.approx(strength.standard_deviation**2, rel=1e-6)


def test_mean_and_deviation_are_those_of_gstools_kriging():
    """A line of 60 correlation lengths, so that GSTools, which knows no period, has the same."""
    line = st.Interface(length=0.06, nodes=512)
    spectrum = st.SquaredExponentialSpectrum(1e-3, power_kept=1.0 - 1e-9)
    field = st.RandomField(scipy.stats.norm(1e6, 0.2e6), spectrum, mean_mode=True)
    x = np.linspace(0.02, 0.03, 37)
    values = np.interp(x, line.x, field.sample(line, seed=3)[0])
    given = field.given(xr.DataArray(values, {"x": x}, "x"), noise=20e3)
    # exp(-(pi/4) (x/len_scale)^2) there is exp(-(x/xi_0)^2) here.
    model = gstools.Gaussian(dim=1, var=0.04e12, len_scale=0.5 * np.pi**0.5 * 1e-3)
    kriging = gstools.krige.Simple(model, [x], values, mean=1e6, cond_err=20e3**2, exact=False)
    mean, variance = kriging([line.x])
    # The two variograms differ by the mean mode and the period: 1e-4 of the deviation.
    np.testing.assert_allclose(given.quantile(line, 0.5), mean, atol=2e-3 * 0.2e6)
    ends = [given.quantile(line, float(scipy.stats.norm.cdf(z))) for z in (-1.0, 1.0)]
    np.testing.assert_allclose(0.5 * (ends[1] - ends[0]), variance**0.5, atol=2e-3 * 0.2e6)

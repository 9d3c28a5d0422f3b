"""Fits against scipy's maximum likelihood and GSTools' variogram."""

import gstools
import numpy as np
import pytest
import scipy.stats

import stiction as st
from stiction.inference.marginal_fit import family_of

VALUES = st.Lognormal(mean=1e6, cv=0.25, low=0.2e6).distribution.rvs(800, random_state=1)

SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("weibull", "gamma")]


@pytest.mark.parametrize(
    ("given", "family", "fixed"),
    [
        ({"type": "lognormal", "low": 0.2e6}, "lognorm", {"floc": 0.2e6}),
        ({"type": "gamma", "low": 0.2e6}, "gamma", {"floc": 0.2e6}),
        ({"type": "weibull", "low": 0.2e6}, "weibull_min", {"floc": 0.2e6}),
        ({"type": "beta", "low": 0.0, "high": 4e6}, "beta", {"floc": 0.0, "fscale": 4e6}),
        ({"type": "normal"}, "norm", {}),
    ],
)
def test_marginals_are_scipys_of_greatest_likelihood(given, family, fixed):
    ours = family_of(given).fit(VALUES).distribution
    scipys = getattr(scipy.stats, family)
    theirs = scipys(*scipys.fit(VALUES, **fixed))
    assert ours.logpdf(VALUES).sum() >= theirs.logpdf(VALUES).sum() - 1e-3
    # scipy stops its search earlier than ours.
    assert ours.mean() == pytest.approx(theirs.mean(), rel=1e-3)
    assert ours.std() == pytest.approx(theirs.std(), rel=1e-2)


def test_a_cut_normal_distribution_has_the_greatest_likelihood():
    found = family_of({"type": "truncated_normal", "low": 0.4e6}).fit(VALUES[VALUES > 0.4e6])
    best = found.distribution.logpdf(VALUES[VALUES > 0.4e6]).sum()
    for mean, cv in ((1.01, 1.0), (0.99, 1.0), (1.0, 1.03), (1.0, 0.97)):
        other = st.TruncatedNormal(mean=found.mean * mean, cv=found.cv * cv, low=0.4e6)
        assert other.distribution.logpdf(VALUES[VALUES > 0.4e6]).sum() < best


@pytest.mark.parametrize("name", ["lognormal", "beta", *SLOW])
def test_noise_is_taken_out_of_a_marginal(name):
    """Of many independent values: two per cent of the standard deviation, by sampling."""
    truth = {
        "lognormal": st.Lognormal(mean=1e6, cv=0.25),
        "weibull": st.Weibull(mean=1e6, cv=0.25),
        "gamma": st.Gamma(mean=1e6, cv=0.25),
        "beta": st.Beta(alpha=1.5, beta=3.0, low=0.5e6, high=2e6),
    }[name]
    rng = np.random.default_rng(3)
    quiet = truth.distribution.rvs(20_000, random_state=rng)
    noise = 0.3 * quiet.std()
    values = quiet + noise * rng.standard_normal(quiet.size)
    fixed = {"low": 0.5e6, "high": 2e6} if name == "beta" else {}
    found = family_of({"type": name} | fixed).fit(values, noise)
    assert found.distribution.std() == pytest.approx(quiet.std(), rel=0.02)
    assert found.distribution.ppf(0.01) == pytest.approx(np.quantile(quiet, 0.01), rel=0.03)
    again = family_of({"type": name} | fixed).fit(values, noise, found)  # moves nothing
    assert again.distribution.std() == pytest.approx(found.distribution.std(), rel=1e-3)


@pytest.mark.parametrize("exponent", [1.5, 2.0, 4.0])
def test_lengths_are_translated_as_the_page_says(exponent):
    x = np.linspace(0.0, 3e-3, 7)
    ours = st.PowerLawSpectrum(2e-3, exponent, power_kept=0.9)
    length = np.sqrt(exponent - 0.5) * 2e-3 / (2.0 * np.pi)
    matern = gstools.Matern(dim=1, nu=exponent - 0.5, len_scale=length)
    np.testing.assert_allclose(
        matern.correlation(x), ours.untruncated_correlation(x), atol=1e-12
    )
    gaussian = gstools.Gaussian(dim=1, len_scale=0.5 * np.sqrt(np.pi) * 2e-3)
    squared = st.SquaredExponentialSpectrum(2e-3)
    np.testing.assert_allclose(gaussian.correlation(x), squared.untruncated_correlation(x))
    plain = st.ExponentialSpectrum(2e-3)
    exponential = gstools.Exponential(dim=1, len_scale=2e-3)
    np.testing.assert_allclose(exponential.correlation(x), plain.untruncated_correlation(x))


def test_correlation_length_against_a_variogram():
    """GSTools fits the same record by least squares on a variogram: two estimates, one truth."""
    truth = st.RandomField(
        st.Lognormal(mean=1e6, cv=0.1),
        st.ExponentialSpectrum(1e-3, power_kept=0.999),  # both take the spectrum as whole
        mean_mode=True,
    )
    interface = st.Interface(length=1.2, nodes=6_000)
    values = truth.sample(interface, seed=4)[0, :2000]
    piece = st.Interface(length=0.4, nodes=2000)
    fit = st.fit_field(
        values,
        piece,
        marginal="lognormal",
        spectrum="exponential",
        bootstrap=20,
        progress=False,
    )
    bins = np.arange(0.0, 3.0, 0.2)  # mm, MPa: its search begins at numbers about one
    centres, gamma = gstools.vario_estimate(1e3 * piece.x, 1e-6 * values, bins)
    model = gstools.Exponential(dim=1)
    model.fit_variogram(centres, gamma, nugget=False)
    # 400 correlation lengths: either is within some 10 per cent of the truth.
    assert fit.parameters["spectrum.correlation_length"] == pytest.approx(1e-3, rel=0.2)
    assert model.len_scale == pytest.approx(1.0, rel=0.25)
    ours = 1e3 * fit.parameters["spectrum.correlation_length"]
    assert ours == pytest.approx(model.len_scale, rel=0.3)

"""Fields of which a part was measured, and factors between specimens, against closed forms."""

import warnings

import numpy as np
import pytest
import scipy.stats
import xarray as xr
from recording import stored
from setups import beta_strength

import stiction as st
from stiction.random.conditioning import conditioning_of
from stiction.random.mapping import from_normal

LINE = st.Interface(length=0.05, nodes=64)
FREE = st.Interface(length=0.05, nodes=64, ends="free")
PLANE = st.Interface(length=(0.02, 0.01), nodes=(16, 8))
FIELD = beta_strength(6e-3)
FACTOR = st.Lognormal(mean=1.0, cv=0.1)


def scan(interface, places, field=FIELD):
    """Values of one sample at places (dimensions, points), between the nodes by its own waves."""
    phi = field.modes(interface).basis(places)
    draws = st.RandomInterface(strength=field).draws(interface, 1, seed=7)
    return from_normal(field.marginal, phi @ draws[0])


def all_of(coordinates):
    """Places (dimensions, points) of a grid."""
    return np.array([row.ravel() for row in np.meshgrid(*coordinates.values(), indexing="ij")])


def conditioning(given, interface):
    _, known = conditioning_of(st.RandomInterface(strength=given), interface)
    return known


def given_on(x, values, noise, field=FIELD):
    return field.given(xr.DataArray(values, {"x": x}, "x"), noise=noise)


def strengths(random, samples, seed):
    return random.profiles(LINE, samples=samples, seed=seed)["strength"]


def kriging(field, interface, places, z, error, grid):
    """Mean, covariance on a grid and chi-square from z at places, by sums over waves."""
    modes = field.modes(interface)

    def correlation(one, other):
        apart = one[:, :, None] - other[:, None, :]
        periods = np.reshape(interface.lengths, (-1, 1, 1)) * (1 + interface.is_free)
        phase = np.tensordot(apart / periods, modes.numbers, (0, 0))
        return np.cos(2.0 * np.pi * phase) @ modes.sigma**2

    across = correlation(grid, places)
    inner = correlation(places, places) + error**2 * np.eye(z.size)
    weights = np.linalg.solve(inner, across.T).T
    chi_square = z @ np.linalg.solve(inner, z)
    return weights @ z, correlation(grid, grid) - weights @ across.T, chi_square


@pytest.mark.parametrize(
    ("interface", "shift", "mean_mode", "error"),
    [(LINE, 0.0, True, 0.1), (FREE, 0.31, False, 0.1), (PLANE, 0.0, False, 0.1),
     (PLANE, 0.31, True, 2e-4)],
)  # fmt: skip
def test_mean_and_deviation_are_those_of_dense_kriging(interface, shift, mean_mode, error):
    """Also of values that are off by fifty of their errors."""
    # Of a normal marginal z and its error are the values and the noise, scaled.
    field = st.RandomField(scipy.stats.norm(1e6, 0.2e6), FIELD.spectrum, mean_mode=mean_mode)
    numbers = np.arange(5.0, 12.0), np.arange(2.0, 5.0)
    sides = zip(interface.dims, numbers, interface.spacings, strict=False)
    at = {dim: (number + shift) * spacing for dim, number, spacing in sides}
    places, grid = all_of(at), all_of(interface.coordinates)
    values = scan(interface, places, field)
    values += 2e3 * np.cos(7.0 * np.arange(values.size))
    known = xr.DataArray(values.reshape([one.size for one in at.values()]), at, tuple(at))
    given = field.given(known.T, noise=0.2e6 * error)
    z = (values - 1e6) / 0.2e6
    expected, covariance, misfit = kriging(field, interface, places, z, error, grid)
    known = conditioning(given, interface)
    assert known.misfit == pytest.approx(misfit, rel=1e-6)
    assert max(known.error) < 1e-6  # all likelihoods are normal
    mean, deviation = known.regression.moments(field.modes(interface).basis(grid))
    np.testing.assert_allclose(mean, expected, atol=1e-11 / error)  # round-off
    np.testing.assert_allclose(deviation**2, np.diag(covariance), atol=1e-11 / error)
    # 20,000 samples: an entry of a covariance scatters by 0.01, the largest of 16,384 by 4.5 of it.
    draws = known.draws(st.RandomInterface(strength=field).draws(interface, 20_000, seed=1))
    sampled = field.modes(interface).gaussian(draws).reshape(20_000, -1)
    np.testing.assert_allclose(sampled.mean(axis=0), mean, atol=5.0 / 20_000**0.5)
    np.testing.assert_allclose(np.cov(sampled.T), covariance, atol=0.05)
    assert given.quantile(interface, 0.5).shape == interface.shape


LOGNORMAL, BETA = st.Lognormal(mean=1e6, cv=1.0), FIELD.marginal
SKEWED = stored("cases")["skewed posteriors"]
"""Marginal, places, values, noise, and the number of values at each place."""


@pytest.mark.parametrize("case", SKEWED)
def test_the_regression_has_the_moments_of_skewed_posteriors(case):
    """The moments of z are those of the prior's draws, weighted by the exact likelihood."""
    (kind, given), x, values, noise, times = SKEWED[case]
    marginal = getattr(st, kind)(**given)
    field = st.RandomField(marginal, st.PowerLawSpectrum(7e-3), mean_mode=True)
    given = given_on(np.repeat(x, times), np.repeat(values, times), noise, field)
    phi, known = field.modes(LINE).basis(np.array([x])), conditioning(given, LINE)
    found_mean, found_deviation = known.regression.moments(phi)
    z = np.random.default_rng(2).standard_normal((600_000, len(x)))
    z = z @ np.linalg.cholesky(phi @ phi.T).T
    misfit = (from_normal(marginal, z) - values) / noise
    weight = np.exp(-0.5 * times * (misfit**2).sum(axis=1))
    weight /= weight.sum()
    mean = weight @ z
    deviation = np.sqrt(weight @ (z - mean) ** 2)
    # Expectation propagation is exact for a single place. 5,000 samples of the prior or more
    # count: three standard errors are 0.04 of the mean, and 0.03 of the deviation.
    np.testing.assert_allclose(found_mean, mean, atol=0.04 * deviation.min())
    np.testing.assert_allclose(found_deviation, deviation, rtol=0.03)
    at_nodes = field.modes(LINE).basis(LINE.x[None])
    known_mean, known_deviation = known.regression.moments(at_nodes)
    quantile = known_mean + scipy.stats.norm.ppf(0.05) * known_deviation
    np.testing.assert_allclose(given.quantile(LINE, 0.05), from_normal(marginal, quantile))
    with warnings.catch_warnings():  # neither unlikely nor approximate
        warnings.simplefilter("error")
        known.warn()


def test_draws_fit_contradictory_values_as_well_as_their_mean_does():
    """A smooth field and 60 unrelated values of little noise: the updates do not settle."""
    field = st.RandomField(BETA, st.PowerLawSpectrum(5e-3), mean_mode=True)
    places = np.linspace(1e-3, 19e-3, 60)
    values = np.random.default_rng(3).uniform(0.7, 1.6, 60)
    known = conditioning(given_on(places, 1e6 * values, 2e3, field), LINE)
    phi = field.modes(LINE).basis(places[None])
    draws = known.draws(np.random.default_rng(0).standard_normal((200, phi.shape[1])))
    off = (from_normal(BETA, draws @ phi.T) - 1e6 * values) / 2e3
    misfits = (off**2).sum(axis=1) + (draws**2).sum(axis=1)
    assert np.median(misfits) < 1.01 * known.misfit  # 0.98 of it; 7.4e5 for 60 values
    with pytest.warns(st.AccuracyWarning, match="unlikely for this field"):
        known.warn()


def test_values_drawn_from_the_field_are_not_unlikely():
    """A skewed marginal with a noise of two standard deviations, and one with two bounds, five."""
    for marginal, noise in ((st.Lognormal(mean=1e6, cv=0.25), 0.5e6), (BETA, 0.9e6)):
        field = st.RandomField(marginal, FIELD.spectrum)
        places = np.random.default_rng(4).uniform(0.0, 0.05, 300)
        values = scan(LINE, places[None], field)
        values += noise * np.random.default_rng(5).standard_normal(300)
        known = conditioning(given_on(places, values, noise, field), LINE)
        assert abs(known.misfit - 300) < 4.0 * 600**0.5  # chi-square of 300 values


def test_what_remains_of_skewed_likelihoods_is_measured_and_warned_of():
    field = st.RandomField(LOGNORMAL, st.PowerLawSpectrum(2e-3), mean_mode=True)
    places = np.linspace(0.0, 0.05, 200)
    values = scan(LINE, places[None], field)
    values += 2e6 * np.random.default_rng(5).standard_normal(200)
    given = given_on(places, values, 2e6, field)
    with pytest.warns(st.AccuracyWarning, match=r"errors up to about 0\.\d+ standard"):
        given.sample(LINE)


def test_a_scan_of_one_property_tells_of_one_that_is_correlated_with_it():
    marginal = st.Beta(alpha=2.0, beta=2.0, low=0.1e6, high=0.3e6)
    residual = st.RandomField(marginal, FIELD.spectrum)
    places = LINE.x[10:30]
    strength = given_on(places, scan(LINE, places[None]), 2e3)
    alike = {("strength", "residual_strength"): 1.0}
    random = st.RandomInterface(
        strength=strength, residual_strength=residual, correlation=alike
    )
    profiles = random.profiles(LINE, samples=20, seed=0)
    # With a correlation of 1 and one spectrum both are functions of one field.
    rank = FIELD.marginal.distribution.cdf(profiles["strength"])
    expected = residual.marginal.distribution.ppf(rank)
    np.testing.assert_allclose(profiles["residual_strength"], expected, rtol=1e-6)
    assert profiles["residual_strength"][:, 15].std() < 0.02 * 0.2e6


def test_a_factor_changes_no_other_draw_and_is_constant_along_each_specimen():
    plain = st.RandomInterface(strength=FIELD)
    random = st.RandomInterface(strength=FIELD, between={"strength": FACTOR})
    factors = strengths(random, 300, 4) / strengths(plain, 300, 4)
    assert np.ptp(factors, axis=1).max() < 1e-14
    of_factor = random.draws(LINE, 300, seed=4)[:, -1]
    exact = FACTOR.distribution.ppf(scipy.stats.norm.cdf(of_factor))
    np.testing.assert_allclose(factors[:, 0], exact, rtol=1e-9)  # of the tabulated quantile
    assert random.dimension(LINE) == plain.dimension(LINE) + 1

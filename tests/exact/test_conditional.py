"""Fields of which a part was measured, and factors between specimens, against closed forms."""

import numpy as np
import pytest
import scipy.stats
import xarray as xr
from scipy.stats import kstest
from setups import beta_strength, make_problem

import stiction as st
from stiction.random.mapping import from_normal
from stiction.random.random_field import conditioning
from stiction.random.random_interface import _conditioned

LINE = st.Interface(length=0.05, nodes=64)
PLANE = st.Interface(length=(0.02, 0.01), nodes=(16, 8))
FIELD = beta_strength(6e-3)
FACTOR = st.Lognormal(mean=1.0, cv=0.1)


def coarse():
    """A problem that 64 nodes resolve: h_n is 15 mm of 100 mm."""
    solid = st.paper.problem().solid
    return make_problem(64, solid=solid, weakening_rate=0.1e12)


def scan(interface, places, field=FIELD, seed=7):
    """Values of one sample at places (dimensions, points), between the nodes by its own waves."""
    draws = field.draws(interface, 1, seed)
    phi = field.modes(interface).basis(places)
    return from_normal(field.marginal, phi @ draws[0])


def all_of(coordinates):
    """Places (dimensions, points) of a grid."""
    return np.array([row.ravel() for row in np.meshgrid(*coordinates.values(), indexing="ij")])


def on_line(places, values):
    return xr.DataArray(values, {"x": places}, "x")


def correlation(field, interface, one, other):
    """Of z between places (dimensions, points), as a sum over waves."""
    modes = field.modes(interface)
    lag = (one[:, :, None] - other[:, None, :]) / np.array(interface.lengths)[:, None, None]
    phase = 2.0 * np.pi * np.tensordot(lag, modes.numbers, axes=(0, 0))
    return np.cos(phase) @ modes.sigma**2


@pytest.mark.parametrize("mean_mode", [False, True])
@pytest.mark.parametrize("between_nodes", [False, True])
@pytest.mark.parametrize("interface", [LINE, PLANE], ids=["line", "plane"])
def test_mean_and_deviation_are_those_of_dense_kriging(interface, between_nodes, mean_mode):
    # Of a normal marginal z and its error are the values and the noise, scaled.
    normal = scipy.stats.norm(1e6, 0.2e6)
    field = st.RandomField(normal, FIELD.spectrum, mean_mode=mean_mode)
    shift = 0.31 * between_nodes
    numbers = {"x": np.arange(5.0, 12.0), "y": np.arange(2.0, 5.0)}
    at = {
        dim: (numbers[dim] + shift) * spacing
        for dim, spacing in zip(interface.dims, interface.spacings, strict=True)
    }
    places = all_of(at)
    values = scan(interface, places, field)
    known = xr.DataArray(values.reshape([one.size for one in at.values()]), at, tuple(at))
    given = field.given(known, noise=20e3)
    z, error = (values - 1e6) / 0.2e6, np.full(values.size, 0.1)
    grid = all_of(interface.coordinates)
    across = correlation(field, interface, grid, places)
    inner = correlation(field, interface, places, places) + np.diag(error**2)
    weights = np.linalg.solve(inner, across.T).T
    phi = field.modes(interface).basis(grid)
    mean, deviation = conditioning(given, interface).moments(phi)
    covariance = correlation(field, interface, grid, grid) - weights @ across.T
    np.testing.assert_allclose(mean, weights @ z, atol=1e-10)  # round-off of the dense solution
    np.testing.assert_allclose(deviation**2, np.diag(covariance), atol=1e-10)
    # 20,000 samples: an entry of a covariance scatters by 0.01, the largest of 16,384 by 4.5 of it.
    draws = conditioning(given, interface).draws(field.draws(interface, 20_000, 1))
    sampled = field.gaussian(interface, draws).reshape(20_000, -1)
    np.testing.assert_allclose(sampled.mean(axis=0), mean, atol=5.0 / 20_000**0.5)
    np.testing.assert_allclose(np.cov(sampled.T), covariance, atol=0.05)
    # The band of the field is that of its samples: quantiles of 20,000 to 0.02 of a deviation.
    assert given.quantile(interface, 0.5).shape == interface.shape


def test_noise_leads_from_the_measured_values_to_the_field_as_it_was():
    places = LINE.x[10:30]
    values = scan(LINE, places[None])
    known = on_line(places, values)
    free = FIELD.sample(LINE, samples=50, seed=1)
    exact = FIELD.given(known, noise=1.0).sample(LINE, samples=50, seed=1)
    assert np.abs(exact[:, 10:30] - values).max() < 10.0  # Pa, ten errors
    vague = FIELD.given(known, noise=1e9).sample(LINE, samples=50, seed=1)
    np.testing.assert_allclose(vague, free, rtol=1e-2)
    # A sample depends on its number only.
    given = FIELD.given(known, noise=20e3)
    whole = given.sample(LINE, samples=50, seed=1)
    assert np.array_equal(whole[17:20], given.sample(LINE, samples=3, seed=1, first=17))


def test_conditional_probabilities_average_to_the_unconditional_one():
    """Law of total probability: over scans of simulated specimens."""
    problem = coarse()
    line, method, noise = problem.interface, st.LocalCriterion(), 30e3
    field = beta_strength(20e-3)
    all_of_it = st.monte_carlo(problem, field, method=method, samples=4000, seed=0, pilot=False)
    stress = float(all_of_it.critical_stress.quantile(0.2))
    shares = []
    rng = np.random.default_rng(5)
    for specimen in field.sample(line, samples=150, seed=3):
        measured = specimen[:24] + noise * rng.standard_normal(24)
        given = field.given(on_line(line.x[:24], measured), noise=noise)
        found = st.monte_carlo(
            problem, given, method=method, samples=100, seed=1, pilot=False, progress=False
        )
        shares.append(float((found.critical_stress < stress).mean()))
    error = np.std(shares) / len(shares) ** 0.5 + 0.4 / 4000**0.5
    assert np.mean(shares) == pytest.approx(0.2, abs=3.5 * error)
    assert np.std(shares) > 0.1  # a scan does tell something


def test_a_scan_of_one_property_tells_of_one_that_is_correlated_with_it():
    marginal = st.Beta(alpha=2.0, beta=2.0, low=0.1e6, high=0.3e6)
    residual = st.RandomField(marginal, FIELD.spectrum)
    known = on_line(LINE.x[10:30], scan(LINE, LINE.x[None, 10:30]))
    random = st.RandomInterface(
        strength=FIELD.given(known, noise=2e3),
        residual_strength=residual,
        correlation={("strength", "residual_strength"): 1.0},
    )
    profiles = random.profiles(LINE, samples=20, seed=0)
    # With a correlation of 1 and one spectrum both are functions of one field.
    rank = FIELD.marginal.distribution.cdf(profiles["strength"])
    expected = residual.marginal.distribution.ppf(rank)
    np.testing.assert_allclose(profiles["residual_strength"], expected, rtol=1e-6)
    assert profiles["residual_strength"][:, 15].std() < 0.02 * 0.2e6


@pytest.mark.parametrize("within", [False, True], ids=["narrow", "wide"])
def test_variance_of_the_peak_is_that_within_and_between(within):
    """Without scatter within, the peak is the factor; with one value along it, the product."""
    problem = coarse()
    marginal = st.Lognormal(mean=1e6, cv=0.15 if within else 1e-4)
    field = st.RandomField(
        marginal, st.PowerLawSpectrum(100.0 if within else 0.02), mean_mode=True
    )
    random = st.RandomInterface(strength=field, between={"strength": FACTOR})
    found = st.monte_carlo(
        problem, random, method=st.LocalCriterion(), samples=20_000, seed=0, pilot=False
    ).critical_stress
    cv = float(found.std() / found.mean())
    expected = ((1.0 + 0.15**2 * within) * 1.01 - 1.0) ** 0.5
    assert cv == pytest.approx(expected, rel=0.03)  # 20,000 samples: 0.5 % and the tail's 1 %


def test_a_factor_changes_no_other_draw_and_is_constant_along_each_specimen():
    plain = st.RandomInterface(strength=FIELD)
    random = st.RandomInterface(strength=FIELD, between={"strength": FACTOR})
    one, other = (r.profiles(LINE, samples=300, seed=4)["strength"] for r in (plain, random))
    factors = other / one
    assert np.ptp(factors, axis=1).max() < 1e-14
    assert kstest(factors[:, 0], FACTOR.distribution.cdf).pvalue > 1e-3
    assert random.dimension(LINE) == plain.dimension(LINE) + 1


def test_a_scan_tells_of_the_factor_of_its_specimen():
    """Ranks of the true factors in their posteriors are uniform over 50 specimens."""
    factor, noise = st.Lognormal(mean=1.0, cv=0.15), 10e3
    rng = np.random.default_rng(2)
    ranks, spreads = [], []
    for i, profile in enumerate(FIELD.sample(LINE, samples=50, seed=11)):
        truth = float(factor.distribution.ppf(rng.uniform()))
        measured = truth * profile[:20] + noise * rng.standard_normal(20)
        given = FIELD.given(on_line(LINE.x[:20], measured), noise=noise)
        random = st.RandomInterface(strength=given, between={"strength": factor})
        ((_, known),) = _conditioned(random, LINE)
        u = np.random.default_rng(i).standard_normal(400)
        u = np.interp(u, known.score, known.quantile)
        factors = from_normal(factor, u)
        ranks.append(np.mean(factors < truth))
        spreads.append(factors.std())
        if i == 0:
            found = random.profiles(LINE, samples=100, seed=0)["strength"]
            assert np.abs(found[:, :20] - measured).mean() < 1.5 * noise
    assert kstest(ranks, "uniform").pvalue > 1e-3
    assert np.median(spreads) < 0.05  # of 0.15 before

"""Random fields, their marginals, and several properties of one interface, against closed forms and
sums of modes.
"""

import dataclasses
import itertools

import numpy as np
import pytest
import scipy.stats
from contracts.test_laws import DENSITIES, STRENGTHS
from recording import stored
from scipy.integrate import quad
from setups import beta_strength

import stiction as st
from stiction.random.fields import lower_factor
from stiction.random.mapping import (
    correlation_of_mapped,
    from_normal,
    hermite_coefficients,
    quantile_of_normal,
    quantile_table,
)

LINE = st.Interface(length=0.1, nodes=256)
COARSE = st.Interface(length=0.1, nodes=64)
MULTIPLES = stored("cases")["multiples of a marginal"]
"""Marginals as functions of a factor, of which the lognormal one needs no table at all."""


def field_of(marginal, correlation_length=2e-3, **options):
    return st.RandomField(marginal, st.PowerLawSpectrum(correlation_length), **options)


@pytest.mark.parametrize("spectrum", DENSITIES.values(), ids=DENSITIES)
def test_density_on_the_plane_integrates_to_the_line_across(spectrum):
    """g(kx) of the line is the integral over ky of the plane's."""
    wave = 2.0 * np.pi / spectrum.correlation_length
    k = np.array([0.0, 0.3, 1.0, 2.0]) * wave

    def density(q, a=0.0):
        return spectrum.density(np.hypot(a, q), 2)

    across = np.array([quad(lambda q, a=a: density(q * wave, a), 0.0, np.inf)[0] for a in k])
    along = spectrum.density(k)
    # 1e-7 of the quadrature, or of the integral at k = 0.
    np.testing.assert_allclose(across / across[0], along / along[0], rtol=1e-7, atol=1e-9)


BOUNDED = [marginal.distribution for marginal in [*STRENGTHS.values()][:5]]
TRIANGLE = scipy.stats.triang(0.3, loc=1.0, scale=2.0)
SKEWED = scipy.stats.invgauss(0.145)  # whose tails scipy inverts poorly


@pytest.mark.filterwarnings("ignore:Error in function:RuntimeWarning")  # scipy, of invgauss
@pytest.mark.parametrize(
    "distribution", [*BOUNDED, TRIANGLE, SKEWED], ids=lambda d: d.dist.name
)
def test_table_of_the_map_matches_the_quantile(distribution):
    marginal = field_of(distribution, 1.0).marginal
    z = np.linspace(-7.99, 7.99, 20_001)  # all in the table
    exact, low = quantile_of_normal(distribution, z), z < 3.0
    np.testing.assert_allclose(from_normal(marginal, z), exact, rtol=1e-9)
    # Where the textbook's composition has all its digits.
    composed = distribution.ppf(scipy.stats.norm.cdf(z[low]))
    np.testing.assert_allclose(exact[low], composed, rtol=1e-10)
    beyond = np.array([-9.0, 8.5, 20.0])
    np.testing.assert_array_equal(
        from_normal(marginal, beyond), quantile_of_normal(distribution, beyond)
    )
    assert np.isnan(quantile_table(marginal)[:, 1]).mean() < 0.02  # where scipy is slow


def test_the_far_end_of_a_beta_marginal_is_its_bound():
    """scipy's quantile of this one is NaN from z = 8.3 on, where 1 - u is below 1e-15."""
    marginal = st.Beta(alpha=0.6, beta=1.03125, low=4e5, high=1.2e6)
    z = np.array([8.0, 8.31, 9.0, 12.0])
    np.testing.assert_allclose(from_normal(marginal, z), 1.2e6, rtol=1e-14)


@pytest.mark.parametrize("nodes", [16, 100, (16, 10), (8, 48), 50])
@pytest.mark.parametrize("mean_mode", [False, True])
def test_field_is_the_sum_of_all_modes_in_the_ellipse_on_any_grid(nodes, mean_mode):
    """Waves that a grid does not resolve and those of Nyquist. Free ends double the period."""
    plane = isinstance(nodes, tuple)
    lengths = (0.4, 0.3) if plane else (0.4,)
    if nodes == 50:
        interface = st.Interface(0.2, nodes, ends="free")
    else:
        interface = st.Interface(lengths if plane else 0.4, nodes)
    options = {"anisotropy": 1.7} if plane else {}
    field = beta_strength(0.05, mean_mode=mean_mode, **options)
    modes = field.modes(interface)
    draws = st.RandomInterface(strength=field).draws(interface, 2, seed=3)
    numbers = modes.numbers[:, 1:]
    wanted = {
        (i, j)[: len(numbers)]
        for i in range(-40, 41)
        for j in range(41 if plane else 1)
        if (j > 0 or i > 0) and np.hypot(i / 0.4, 1.7 * j / 0.3) < 50.0 * (1.0 + 1e-12)
    }
    assert len(wanted) == modes.ranks.size
    assert set(map(tuple, numbers.T.tolist())) == wanted
    x = np.array(np.meshgrid(*interface.coordinates.values(), indexing="ij"))
    shares = x / np.reshape(lengths, (-1, *[1] * len(numbers)))
    phase = 2.0 * np.pi * np.tensordot(numbers.T, shares, 1)
    a = draws[:, mean_mode::2] * modes.sigma[1:]
    b = draws[:, mean_mode + 1 :: 2] * modes.sigma[1:]
    direct = np.tensordot(a, np.cos(phase), 1) + np.tensordot(b, np.sin(phase), 1)
    mean = modes.sigma[0] * draws[:, 0] * mean_mode
    # Round-off of a sum of hundreds of terms.
    np.testing.assert_allclose(modes.gaussian(draws).T, direct.T + mean, atol=1e-12)
    assert np.sum(modes.sigma**2) == pytest.approx(1.0, rel=1e-13)


def test_discrete_spectrum_is_the_density_at_the_modes(make_strength):
    strength = make_strength(1.0)
    sigma = strength.modes(LINE).sigma
    k = 2.0 * np.pi * np.arange(1, sigma.size) / 0.1
    lam = 2.0 * np.pi / strength.spectrum.correlation_length
    assert k[-1] <= 2.5 * lam < k[-1] + k[0]
    power = (k**2 + lam**2) ** -4.0
    np.testing.assert_allclose(sigma[1:] ** 2, power / power.sum(), rtol=1e-12)
    assert sigma[0] == 0.0
    with_mean = make_strength(1.0, mean_mode=True).modes(LINE).sigma
    # Modes k and -k share sigma_j; the mean mode stands for itself.
    expected = 0.5 * lam**-8.0 / power[0]
    assert with_mean[0] ** 2 / with_mean[1] ** 2 == pytest.approx(expected, rel=1e-12)


def test_a_mode_keeps_its_draws_whatever_the_spectrum():
    """More modes, or an ellipse of others, extend the same field."""
    plane = st.Interface(length=(1.0, 2.2), nodes=(32, 32))
    exponential = st.ExponentialSpectrum(0.3, power_kept=0.8)
    fields = [
        beta_strength(0.25),
        beta_strength(0.25, power_kept=0.99),
        beta_strength(0.25, anisotropy=2.5),
        dataclasses.replace(beta_strength(1.0), spectrum=exponential, mean_mode=True),
    ]
    known = {}
    for field in fields:
        modes = field.modes(plane)
        draws = st.RandomInterface(strength=field).draws(plane, 1, seed=2)[0]
        pairs = draws[int(field.mean_mode) :].reshape(-1, 2)
        for number, pair in zip(modes.numbers[:, 1:].T.tolist(), pairs, strict=True):
            assert known.setdefault(tuple(number), tuple(pair)) == tuple(pair)
    assert len(known) > fields[2].modes(plane).ranks.size


@pytest.mark.parametrize("anisotropy", [None, 0.3, 8.0])
def test_the_warning_of_a_missing_mean_states_the_variance_of_the_mean(anisotropy):
    plane = st.Interface(length=(0.05, 0.05), nodes=(64, 64))
    field = beta_strength(0.03, anisotropy=anisotropy)
    share = dataclasses.replace(field, mean_mode=True).modes(plane).sigma[0] ** 2
    with pytest.warns(st.AccuracyWarning, match=rf"would hold {100.0 * share:.3g} %"):
        field.sample(plane)


@pytest.mark.parametrize("shape", [(8, 48), (48, 8)])
def test_waves_that_one_direction_does_not_resolve_are_warned_of(shape):
    """The variance beyond half the nodes along x or y, from the density at all waves."""
    plane = st.Interface(length=(1.0, 1.3), nodes=shape)
    field = beta_strength(0.2, anisotropy=0.8, mean_mode=True)
    i, j = np.meshgrid(np.arange(-40, 41), np.arange(-40, 41), indexing="ij")
    k = 2.0 * np.pi * np.hypot(i, 0.8 * j / 1.3)
    power = field.spectrum.density(k, 2) * (k <= field.spectrum.cutoff(2))
    beyond = (np.abs(i) > shape[0] // 2) | (np.abs(j) > shape[1] // 2)
    share = power[beyond].sum() / power.sum()
    assert field.modes(plane).unresolved[0] == pytest.approx(share, rel=1e-9)
    with pytest.warns(st.AccuracyWarning, match=rf"{100.0 * share:.3g} %"):
        field.sample(plane)


def test_draws_are_defined_by_seed_block_and_mode():
    """The promise of reproducibility, spelled out with numpy alone."""
    field = field_of(scipy.stats.norm(), 0.05)
    found = st.RandomInterface(strength=field).draws(LINE, 1, seed=7, first=300)[0]
    key = np.random.SeedSequence(entropy=7, spawn_key=(0, 1))  # sample 300 lies in block 1
    block = np.random.Generator(np.random.PCG64DXSM(key)).standard_normal((12, 256))
    np.testing.assert_array_equal(found, block[2:, 300 - 256])


def test_custom_spectrum_agrees_with_the_named_one():
    named = st.SquaredExponentialSpectrum(correlation_length=0.02)
    custom = st.CustomSpectrum(
        function=lambda k: 7.0 * np.exp(-((0.01 * k) ** 2)), max_wavenumber=named.cutoff() * 3.0
    )
    lags = np.linspace(0.0, 0.06, 30)
    # At three times the cutoff less than 1e-20 of the power is left out.
    expected = named.untruncated_correlation(lags)
    np.testing.assert_allclose(custom.correlation(lags), expected, atol=1e-9)
    assert custom.efolding_length == pytest.approx(0.02, rel=1e-9)
    # On a plane it is the density there.
    own = st.CustomSpectrum(
        function=lambda k: named.density(k, 2), max_wavenumber=named.cutoff(2)
    )
    plane = st.Interface(length=(0.3, 0.2), nodes=(64, 64))
    fields = [st.RandomField(scipy.stats.norm(), each, True) for each in (named, own)]
    one, other = (field.modes(plane).sigma for field in fields)
    np.testing.assert_allclose(one, other, rtol=1e-12)


def test_efolding_length_is_the_first_crossing():
    """A narrow band: the correlation oscillates as cos(k_0 x) under a slow envelope."""
    spectrum = st.CustomSpectrum(
        function=lambda k: np.exp(-(((k - 3e3) / 30.0) ** 2)), max_wavenumber=4e3
    )
    # cos(k_0 x) = 1/e; the envelope exp(-(30 x)^2/4) takes off 4e-5.
    assert spectrum.efolding_length == pytest.approx(np.arccos(np.exp(-1.0)) / 3e3, rel=1e-4)


def test_distributions_that_scipy_has_no_name_for():
    counts = np.histogram(np.random.default_rng(0).normal(5.0, 1.0, 1000), 20)
    distribution = scipy.stats.rv_histogram(counts)()
    field = field_of(distribution, 0.01)
    z = np.array([[-1.0, 0.3]])
    values = from_normal(field.marginal, z)
    np.testing.assert_allclose(values, quantile_of_normal(distribution, z), rtol=1e-9)
    assert field.mean == pytest.approx(distribution.mean())
    assert field.correlation(COARSE)[0] == pytest.approx(1.0, rel=1e-12)

    class Narrow(scipy.stats.rv_continuous):
        def _pdf(self, x):
            return 1.0 + 0.0 * x

    # Named like scipy's normal distribution, but not it.
    assert field_of(Narrow(name="norm", a=0.0, b=1.0)()).mean == pytest.approx(0.5)


def test_a_function_that_returns_its_own_array_keeps_it():
    table = {}

    def density(k):
        return table.setdefault(np.shape(k), np.ones(np.shape(k)))

    spectrum = st.CustomSpectrum(function=density, max_wavenumber=500.0)
    st.RandomField(marginal=scipy.stats.norm(), spectrum=spectrum).modes(COARSE)
    assert all(np.all(values == 1.0) for values in table.values())


def mapped(distribution, rho):
    return correlation_of_mapped(rho, hermite_coefficients(field_of(distribution).marginal))


def test_correlation_of_a_heavy_lognormal():
    """(exp(s^2 rho) - 1)/(exp(s^2) - 1)."""
    rho, s2 = np.linspace(-1.0, 1.0, 21), 1.5**2
    expected = np.expm1(s2 * rho) / np.expm1(s2)
    # Less than a millionth of the variance is left to the last coefficient.
    np.testing.assert_allclose(mapped(scipy.stats.lognorm(1.5), rho), expected, atol=1e-6)


def test_a_narrow_marginal_has_the_correlation_of_a_wide_one():
    rho = np.linspace(-1.0, 1.0, 21)
    wide = mapped(scipy.stats.beta(2.0, 2.0), rho)
    narrow = mapped(scipy.stats.beta(2.0, 2.0, loc=1e6, scale=1e-2), rho)
    # Values of 1e6 have 1e-10 of round-off, that is 1e-8 of the width.
    np.testing.assert_allclose(narrow, wide, atol=1e-7)


@pytest.mark.parametrize("distribution", [scipy.stats.t(2.01), scipy.stats.pareto(2.01)])
def test_tails_too_heavy_for_a_correlation_are_said(distribution):
    with pytest.warns(st.AccuracyWarning, match=r"uncertain by up to 0\.\d"):
        field_of(distribution, 0.1).correlation(st.Interface(length=1.0, nodes=64))


@pytest.mark.parametrize("exponent", [0.7, 1.0])
def test_efolding_length_is_that_of_the_modes_that_are_sampled(exponent):
    """On an interface of a thousand lengths, by its modes."""
    spectrum = st.PowerLawSpectrum(1.0, exponent=exponent)
    kept = spectrum.power_within(2.5 * spectrum.scale)
    spectrum = dataclasses.replace(spectrum, power_kept=kept)
    spectrum = spectrum.with_efolding_length(0.05)
    field = st.RandomField(beta_strength(1.0).marginal, spectrum, mean_mode=True)
    interface = st.Interface(length=50.0, nodes=1000 * 64)
    for of, length in (("z", 0.05), ("strength", field.efolding_length())):
        correlation = field.correlation(interface, of=of)
        # Without truncation the length was .0665 for exponent 1. Left over: the sum over modes,
        # which at exponent 0.7 meets a density that is sharp at k = 0, and the line between nodes.
        found = np.interp(-np.exp(-1.0), -correlation[:200], interface.x[:200])
        assert found == pytest.approx(length, rel=2e-3)
    assert field.efolding_length() < 0.05


def test_truncated_correlation_is_the_sum_of_cosines():
    """Against the midpoint rule on a million wavenumbers."""
    spectrum = st.ExponentialSpectrum(correlation_length=0.3, power_kept=0.95)
    k = (np.arange(1_000_000) + 0.5) * spectrum.cutoff() / 1e6
    g = spectrum.density(k)
    for lag in (0.0, 1e-3, 0.3, 5.0, 300.0):
        expected = np.sum(g * np.cos(k * lag)) / g.sum()
        # The midpoint rule: (lag dk)^2/24 with dk = 4e-5.
        error = 1e-9 + (lag * k[0] * 2.0) ** 2 / 24.0
        assert spectrum.correlation(np.array([lag]))[0] == pytest.approx(expected, abs=error)


@pytest.mark.parametrize("name", MULTIPLES)
def test_multiples_share_one_table(name):
    """A long list has as many factors between specimens as members: no table for each."""
    family = eval(MULTIPLES[name])
    z = np.random.default_rng(3).uniform(-6.5, 6.5, 500)
    from_normal(family(0.97), z)
    built = quantile_table.cache_info().misses
    for factor in (1.1, 0.313, 7e-5):
        marginal = family(factor)
        exact = quantile_of_normal(marginal.distribution, z)
        np.testing.assert_allclose(from_normal(marginal, z), exact, rtol=1e-9)
    assert quantile_table.cache_info().misses == built


@pytest.mark.parametrize("nodes", [16, (10, 8)], ids=["line", "plane"])
def test_covariance_of_a_chain_of_properties_with_spectra_of_their_own(nodes):
    """A and B are correlated, B and C: the response to each draw, as a matrix, times itself."""
    plane = isinstance(nodes, tuple)
    interface = st.Interface((0.008, 0.006) if plane else 0.008, nodes)
    options = {"anisotropy": 1.3} if plane else {}
    names = ("strength", "residual_strength", "initial_stress")
    spectra = dict(zip(names, DENSITIES.values(), strict=True))
    fields = {
        name: st.RandomField(scipy.stats.norm(), spectra[name], name != "strength", **options)
        for name in names
    }
    chain = {
        ("strength", "residual_strength"): 0.7, ("residual_strength", "initial_stress"): -0.6,
    }  # fmt: skip
    random = st.RandomInterface(**fields, correlation=chain)
    response = random.from_draws(interface, np.eye(random.dimension(interface)))
    modes = [fields[name].modes(interface) for name in random.names]
    places = np.meshgrid(*interface.coordinates.values(), indexing="ij")
    for one, other in itertools.combinations_with_replacement(range(3), 2):
        sigma = [dict(zip(map(tuple, m.numbers.T), m.sigma, strict=True)) for m in modes]
        expected = 0.0
        for number in sigma[one].keys() & sigma[other].keys():
            turns = zip(number, places, interface.lengths, strict=True)
            phase = sum(2.0 * np.pi * j * x / length for j, x, length in turns)
            wave = sigma[one][number] * sigma[other][number] * np.cos(phase)
            expected = expected + random.matrix[one, other] * wave
        here, there = (
            response[random.names[i]].reshape(-1, interface.size) for i in (one, other)
        )
        found = (here.T @ there)[0].reshape(interface.shape)  # of the first node with all
        # The map is tabulated to 1e-9.
        np.testing.assert_allclose(found, expected, atol=1e-7)


def test_factor_of_a_singular_matrix():
    matrix = np.array([[1.0, 1.0, 0.3], [1.0, 1.0, 0.3], [0.3, 0.3, 1.0]])
    factor = lower_factor(matrix)
    assert np.allclose(factor @ factor.T, matrix, atol=1e-15)

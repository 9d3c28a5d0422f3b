"""Fits against scipy's maximum likelihood, GSTools' variogram, and records of known scatter."""

import dataclasses

import numpy as np
import pytest
import scipy.stats
from recording import stored
from setups import examples

import stiction as st
from stiction.inference.estimate import BestFit, FitSetting, estimate
from stiction.inference.marginal_fit import family_of, mean_log_likelihood, normal_of
from stiction.inference.specimens import FactorPrior, Profiles, grid_of_profiles
from stiction.inference.whittle import SpectrumFamily
from stiction.inference.window import RecordWindow

VALUES = st.Lognormal(mean=1e6, cv=0.25, low=0.2e6).distribution.rvs(800, random_state=1)
SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("weibull", "gamma")]


@pytest.mark.parametrize(("given", "family", "fixed"), stored("cases")["families of scipy"])
def test_marginals_are_scipys_of_greatest_likelihood(given, family, fixed):
    ours = family_of(given).fit(VALUES).distribution
    scipys = getattr(scipy.stats, family)
    theirs = scipys(*scipys.fit(VALUES, **fixed))
    assert ours.logpdf(VALUES).sum() >= theirs.logpdf(VALUES).sum() - 1e-3
    np.testing.assert_allclose(ours.support(), theirs.support(), rtol=1e-12)
    # scipy stops its search earlier than ours.
    assert ours.mean() == pytest.approx(theirs.mean(), rel=1e-3)
    assert ours.std() == pytest.approx(theirs.std(), rel=1e-2)


@pytest.mark.parametrize("name", ["lognormal", "beta", *SLOW])
def test_noise_is_taken_out_of_a_marginal(name):
    """Of many independent values: two per cent of the standard deviation, by sampling."""
    truth = examples("strengths with noise")[name]
    rng = np.random.default_rng(3)
    quiet = truth.distribution.rvs(20_000, random_state=rng)
    noise = 0.3 * quiet.std()
    values = quiet + noise * rng.standard_normal(quiet.size)
    fixed = {"low": 0.5e6, "high": 2e6} if name == "beta" else {}
    family = family_of({"type": name} | fixed)
    found = family.fit(values, noise)
    assert found.distribution.std() == pytest.approx(quiet.std(), rel=0.02)
    assert found.distribution.ppf(0.01) == pytest.approx(np.quantile(quiet, 0.01), rel=0.03)
    # Nothing near is likelier, and free bounds are at least as likely as stated bounds.
    best = mean_log_likelihood(found, values, noise)
    for factor in (0.99, 1.01):
        assert mean_log_likelihood(family.widened(found, factor), values, noise) < best
    free = family_of(name).fit(values, noise)
    assert mean_log_likelihood(free, values, noise) > best - 1e-4
    again = family.fit(values, noise, found)  # moves nothing
    assert again.distribution.std() == pytest.approx(found.distribution.std(), rel=1e-3)


@pytest.mark.parametrize(
    "given", [{"type": "beta", "low": 1e5}, {"type": "beta", "low": 1e5, "high": 4e6}, "normal"]
)
def test_a_wider_marginal_keeps_its_mean_and_what_is_fixed(given):
    family = family_of(given)
    found = family.fit(VALUES)
    wider = family.widened(found, 1.2)
    assert wider.distribution.mean() == pytest.approx(found.distribution.mean(), rel=1e-9)
    assert wider.distribution.std() == pytest.approx(1.2 * found.distribution.std(), rel=1e-9)
    for name, value in family.fixed.items():
        assert getattr(wider, name) == value


def test_strengths_have_no_negative_bound():
    """Some fits to eighty values of a Weibull field put the bound of 'beta' far below zero."""
    rng, family = np.random.default_rng(1), family_of("beta")
    for _ in range(20):
        values = st.Weibull(mean=1e6, cv=0.3).distribution.rvs(80, random_state=rng)
        found = family.fit(values)
        assert 0.0 <= family.widened(found, 1.3).low <= found.low


@pytest.mark.parametrize("noise", [0.0, 8e4])
def test_the_likelihood_is_that_of_values(noise):
    """The density of the sum with the noise by quadrature, whatever the bins."""
    marginal = st.Gamma(mean=1e6, cv=0.25)
    values = VALUES + noise * np.random.default_rng(2).standard_normal(VALUES.size)
    density = marginal.distribution.pdf
    if noise:
        e = np.linspace(-6.0, 6.0, 2001) * noise
        kernel = scipy.stats.norm.pdf(e, scale=noise) * (e[1] - e[0])
        exact = np.log(density(values[:, None] - e) @ kernel).mean()
    else:
        exact = marginal.distribution.logpdf(values).mean()
    assert mean_log_likelihood(marginal, values, noise) == pytest.approx(exact, abs=1e-3)
    # A value that the family all but excludes weighs much, but leaves a number.
    bounded = st.Beta(alpha=2.0, beta=3.0, low=0.0, high=4e6)
    worse = mean_log_likelihood(bounded, np.append(values, 9e6), noise)
    assert -10.0 < worse - mean_log_likelihood(bounded, values, noise) < -0.02


@pytest.mark.parametrize("records", [2, pytest.param(7, marks=pytest.mark.slow)])
def test_levels_alone_predict_the_level_of_another_specimen(records):
    """Scatter drawn from its prior: the next level is as likely in each fifth of its forecast."""
    rng, held, within = np.random.default_rng(records), [], np.full((1, records), 0.04**2)
    field = st.RandomInterface(strength=st.RandomField(FIFTH, st.PowerLawSpectrum(1e-3)))
    prior = FactorPrior()
    sigma = np.log1p(rng.choice(prior.cells(), 200) ** 2) ** 0.5
    for own in sigma:
        levels = 1e6 * np.exp(np.hypot(own, 0.04) * rng.standard_normal(records + 1))
        profiles = Profiles((field,), 1e6, levels[:-1], within, ("lognormal",), prior)
        grid, _ = grid_of_profiles(profiles)
        drawn = grid.draws(400, rng)
        spread = np.log1p(drawn[:, 2] ** 2)
        forecast = drawn[:, 3] - 0.5 * (spread + 0.04**2)
        forecast += np.sqrt(spread + 0.04**2) * rng.standard_normal(400)
        held.append((1e6 * np.exp(forecast) < levels[-1]).mean())
    counts = np.histogram(held, [0.0, 0.2, 0.4, 0.6, 0.8, 1.01])[0]
    assert scipy.stats.chisquare(counts).pvalue > 1e-3, counts


PIECE = st.Interface(length=0.05, nodes=64)
SIMPLE = {
    "marginal": "lognormal", "spectrum": {"type": "power_law", "exponent": 2.0}, "noise": False,
    "bootstrap": 20, "progress": False,
}  # fmt: skip


FIFTH = st.Lognormal(mean=1e6, cv=0.2)


def records_of(spectrum, seed, count=20, marginal=FIFTH):
    """Pieces of five correlation lengths of long samples, (count, 64)."""
    field = st.RandomField(marginal, spectrum, mean_mode=True)
    line = st.Interface(length=21 * 0.05, nodes=21 * 64)
    return field.sample(line, samples=count, seed=seed)[:, :64]


def test_a_factor_between_short_records_leaves_the_field_as_it_is():
    """Records of five lengths made equal in mean would lack 5 % of the standard deviation.

    A pair of fits of the same records, with a factor and without, differs by 1 % at random.
    """
    records = records_of(st.PowerLawSpectrum(1e-2, exponent=2.0), 4)
    factor = np.exp(0.15 * np.random.default_rng(4).standard_normal((20, 1)))
    plain = st.fit_field(records, PIECE, **SIMPLE).parameters
    scattered = st.fit_field(records * factor, PIECE, between=True, **SIMPLE)
    cv, other = (
        found["standard_deviation"] / found["mean"] for found in (plain, scattered.parameters)
    )
    assert other / cv == pytest.approx(1.0, abs=0.035)
    low, high = scattered.interval["between"]  # of 90 %
    assert low < np.expm1(0.15**2) ** 0.5 < high < 0.3
    assert "between" in str(scattered)
    # The mean of other specimens is as uncertain as the records' levels scatter: by Student's
    # distribution, but for the prior of the scatter.
    levels = np.log((records * factor).mean(axis=1))
    width = scipy.stats.t.ppf(0.95, 19) * scipy.stats.sem(levels)
    low, high = scattered.interval["marginal.mean"]
    assert 0.5 * np.log(high / low) == pytest.approx(width, rel=0.1)
    # Its repetitions scatter, too: the same records, each by a factor of its own.
    found = dataclasses.replace(scattered._estimate, between=0.3)
    factors = []
    for number in range(20):
        pair = found, dataclasses.replace(found, between=0.0)
        rows = [np.array(one.simulate(np.random.default_rng(number))) for one in pair]
        factors.append(rows[0] / rows[1])
        assert np.ptp(factors[-1], axis=1).max() < 1e-12
    logarithms = np.log(np.array(factors)[:, :, 0].ravel())
    spread = np.log1p(0.3**2) ** 0.5
    assert logarithms.std() == pytest.approx(spread, rel=0.15)  # four errors of 400
    assert logarithms.mean() == pytest.approx(0.0, abs=4.0 * spread / 20)


def test_families_are_compared_by_one_number_of_independent_values():
    """Scores by hand, from the sum over all pairs of points; `interfaces` draws by weights."""
    spectrum = st.PowerLawSpectrum(1e-2, exponent=2.0)
    rows = records_of(spectrum, 2, 3, st.Weibull(mean=1e6, cv=0.25))
    several = SIMPLE | {
        "marginal": ["lognormal", "gamma", "weibull", {"type": "beta", "low": 0.0}]
    }
    fit = st.fit_field(rows, PIECE, **several)
    [window] = set(fit._estimate.setting.windows)
    # By the best family's own correlation, which is next to that of any other.
    rho = fit._estimate.model.correlation(window)[:64]
    places = np.arange(64)
    independent = 3 * 64**2 / np.sum(rho[abs(places[:, None] - places)] ** 3)
    assert fit._estimate.independent == pytest.approx(independent, rel=0.01)
    scores = {}
    for given, parameters in zip(several["marginal"], (2, 2, 2, 3), strict=True):
        family = family_of(given)
        likelihood = family.fit(rows.ravel()).distribution.logpdf(rows.ravel()).mean()
        scores[family.label] = fit._estimate.independent * likelihood - parameters
    best = max(scores.values())
    found = {name: one.score for name, one in fit.families.items()}
    assert found == pytest.approx({n: s - best for n, s in scores.items()}, abs=0.01)
    assert min(found.values()) < -1.0 < max(found.values()) == 0.0 == next(iter(found.values()))
    assert fit.tied == tuple(name for name, score in found.items() if score > -2.0)
    weights = {name: one.weight for name, one in fit.families.items() if one.weight}
    free = {label: 3 if label.startswith("beta") else 2 for label in weights}
    likelihoods = np.array([found[label] + free[label] / 2 for label in weights])
    shares = np.exp(likelihoods) / np.exp(likelihoods).sum()
    assert list(weights.values()) == pytest.approx(shares)
    assert len(weights) > len(fit.tied) > 1
    assert f"{fit.tied[1]} {found[fit.tied[1]]:.1f}" in str(fit)
    assert f"({', '.join(fit.tied)} cannot be distinguished)" in str(fit)
    types = [one.strength.marginal.type for one in fit.interfaces(400, seed=3)]
    for name, weight in weights.items():
        assert types.count(name.partition(",")[0]) == pytest.approx(400 * weight, abs=1.0)


def test_what_mean_and_trend_take_is_given_back():
    """By traces of matrices; records of ten lengths show two thirds of the variance."""
    gaps = np.ones(64, dtype=bool)
    gaps[[3, 4, 50]] = False
    windows = [RecordWindow((0.05 / 64,), kept, 3) for kept in (np.ones(64, dtype=bool), gaps)]
    spectrum = st.PowerLawSpectrum(5e-3, exponent=2.0)
    rows = records_of(spectrum, 5, 16)
    family = SpectrumFamily("power_law", {"exponent": 2.0}, 1.0, 0.0, (1e-3, 0.1))
    setting = FitSetting(
        tuple(windows[i % 2] for i in range(16)), family_of("lognormal"), family
    )
    used = [w.without_trend(r[w.measured]) for r, w in zip(rows, setting.windows, strict=True)]
    found = estimate(used, setting)
    sizes = [row.size for row in used]
    total = np.zeros((sum(sizes),) * 2)
    keep, ends = np.zeros_like(total), np.cumsum([0, *sizes])
    for window, start, end in zip(setting.windows, ends, ends[1:], strict=False):
        places = np.flatnonzero(window.measured)
        own = np.s_[start:end, start:end]
        total[own] = found.model.correlation(window)[abs(places[:, None] - places)]
        keep[own] = np.eye(end - start) - window.basis @ window.basis.T + 1.0 / (end - start)
    centre = np.eye(len(total)) - 1.0 / len(total)
    share = np.sum((centre @ keep) * (keep @ total).T) / len(total)
    assert 0.5 < share < 0.85
    wider = found.marginal.cv / found.of_values.cv
    assert wider == pytest.approx(share**-0.5, rel=1e-6)
    assert found.parameters["standard_deviation"] == pytest.approx(0.2e6, rel=0.12)


@pytest.mark.parametrize("across", [(), (5e-4,)], ids=["lines", "maps"])
def test_means_of_records_scatter_as_their_field_says(across):
    """Of two geometries: their variances, and p-values of campaigns, which are uniform."""
    shapes, spacings = ((64, 9), (40, 12)), ((8e-4, *across), (5e-4, *across))
    windows = (
        tuple(
            RecordWindow(spacing, np.ones(shape[: len(spacing)], dtype=bool))
            for shape, spacing in zip(shapes, spacings, strict=True)
        )
        * 2
    )
    family = SpectrumFamily(
        "power_law", {"exponent": 2.0}, None if across else 1.0, 0.0, (1e-3, 1.0)
    )
    model = family.model(
        family.vector([1.0, 3e-3, 1.4][: 2 + len(across)]), np.array([0.0, 1.0])
    )
    marginal = normal_of(1e6, 1e5)
    setting = FitSetting(windows, family_of("normal"), family)
    fit = BestFit(setting, marginal, marginal, model, 0.0, 0.0, (0.0, 0.0))
    rng, count = np.random.default_rng(3), 50 if across else 400
    levels = np.array([[row.mean() for row in fit.simulate(rng)] for _ in range(count)])
    four_errors = 4.0 * np.sqrt(2.0 / count)
    np.testing.assert_allclose(levels.var(axis=0), fit.of_means, rtol=four_errors)
    p_values = [fit.chance_of_scatter(campaign) for campaign in levels]
    assert scipy.stats.kstest(p_values, "uniform").pvalue > 1e-3
    extents = sum(np.prod(np.multiply(w.spacings, w.measured.shape)) for w in windows)
    lengths = 3e-3 * (1.4 * 3e-3 if across else 1.0)
    assert fit.lengths_held == pytest.approx(extents / lengths, rel=1e-9)


def test_a_spectrum_without_truncation_is_one_and_the_same_in_simulations_and_fits():
    """Its usual end was at 2.5 lambda in a simulation only: the length came out 60 % too long."""
    assert st.PowerLawSpectrum(1e-2).cutoff() == pytest.approx(500.0 * np.pi, rel=1e-15)
    spectrum = st.PowerLawSpectrum(1e-2, exponent=2.0)
    fit = st.fit_field(records_of(spectrum, 2, 40), PIECE, **SIMPLE | {"noise": True})
    length = fit.parameters["correlation_length"]
    assert length == pytest.approx(1e-2, rel=0.1)
    assert fit.field.spectrum == st.PowerLawSpectrum(length, exponent=2.0)

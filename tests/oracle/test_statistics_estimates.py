"""Estimates, quantiles and densities against simulation and known distributions."""

import runpy
from pathlib import Path

import numpy as np
import pytest
import scipy.stats

import stiction as st
from stiction.statistics.densities import density
from stiction.statistics.estimates import WithError, mean, quantiles, standard_deviation

RNG = np.random.default_rng(20)
EXAMPLE = Path(__file__).parents[2] / "examples" / "rupture_ensemble_on_a_plane.py"


@pytest.mark.parametrize("estimator", [mean, standard_deviation])
def test_errors_are_the_scatter_of_repetitions(estimator):
    """A skewed distribution, 400 repetitions of 2000 values: scatter known to 1/sqrt(800)."""
    samples = RNG.gamma(4.0, size=(400, 2000))
    found = [estimator(sample) for sample in samples]
    scatter = np.std([each.value for each in found], ddof=1)
    claimed = np.mean([each.error for each in found])
    # 3.5 % from the number of repetitions, three times over; the sixth moments add a little.
    assert claimed / scatter == pytest.approx(1.0, abs=0.15)


def test_errors_of_independent_estimates_add_in_squares():
    difference = WithError(3.0, 0.3) - WithError(1.0, 0.4)
    assert (difference.value, difference.error) == pytest.approx((2.0, 0.5))


def test_quantile_intervals_cover():
    """Coverage at least as promised over 3000 repetitions of 200 values, and not wasteful."""
    probabilities = np.array([0.02, 0.5, 0.9])
    truth = scipy.stats.expon.ppf(probabilities)
    inside = np.zeros(3)
    for sample in RNG.exponential(size=(3000, 200)):
        q = quantiles(sample, probabilities)
        inside += (q.lower < truth) & (truth < q.upper)
    # Whole ranks make it exceed 0.95; three standard errors are 0.012. At 0.02 of 200 values the
    # count is 4 +- 2, and one rank is worth up to 0.03 on each side.
    assert np.all((inside / 3000 > 0.95 - 0.012) & (inside / 3000 < 0.995))


def test_quantile_intervals_know_when_the_sample_is_too_small():
    q = quantiles(np.arange(100.0), [0.001, 0.5, 0.999])
    assert q.lower[0] == -np.inf
    assert q.upper[2] == np.inf
    assert np.all((q.lower < q.value) & (q.value < q.upper))


def assert_mass_one(found):
    assert found.value.sum() * (found.x[1] - found.x[0]) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    ("distribution", "bounds"),
    [
        (scipy.stats.beta(2.0, 5.0), (0.0, 1.0)),
        (scipy.stats.norm(), (None, None)),
        (scipy.stats.expon(), (0.0, None)),
        (scipy.stats.uniform(), (0.0, 1.0)),
    ],
)
def test_density_of_known_distributions(distribution, bounds):
    """40,000 values: within a few of its own errors nearly everywhere, mass one."""
    found = density(
        distribution.rvs(40_000, random_state=np.random.default_rng(3)), bounds=bounds
    )
    assert_mass_one(found)
    truth = distribution.pdf(found.x)
    # Smoothing adds a bias of the order of the error (that is how the bandwidth is chosen), more
    # where the density meets a bound with a slope, as the exponential does.
    seen = truth > 0.05 * truth.max()
    bias = 0.5 * found.bandwidth * np.abs(np.gradient(truth, found.x))
    wrong = np.abs(found.value - truth)[seen] > (4.0 * found.error + 2.0 * bias)[seen]
    assert wrong.mean() < 0.02


def test_density_does_not_leak_through_bounds():
    """At the bound of a uniform density a plain Gaussian kernel loses half."""
    sample = RNG.uniform(size=20_000)
    found = density(sample, bounds=(0.0, 1.0))
    assert found.x[0] > 0.0
    assert found.x[-1] < 1.0
    assert found.value[0] == pytest.approx(1.0, abs=0.1)  # three errors of about 0.03
    assert scipy.stats.gaussian_kde(sample)(0.0)[0] < 0.6


@pytest.mark.parametrize(
    "sample",
    [np.repeat([1.0, 2.0, 3.0], 10), np.concatenate([np.arange(20.0), 1e4 + np.arange(20.0)])],
    ids=["ties", "far apart"],
)
def test_density_of_spikes_still_has_mass_one(sample):
    """A kernel as narrow as a cell rings; what is cut off below zero must not be added."""
    found = density(sample, bounds=(0.0, None))
    assert found.value.min() >= 0.0
    assert_mass_one(found)


def test_density_of_even_values_is_uniform():
    """No time of diffusion is a fixed point there; one in twenty uniform samples is as even."""
    found = density((np.arange(1024) + 0.5) / 1024, bounds=(0.0, 1.0))
    # Values at the lower ends of their cells: half a cell over the bandwidth of 0.07 is 1.7e-3.
    np.testing.assert_allclose(found.value, 1.0, atol=2e-3)


@pytest.mark.parametrize("shape", [1.5, 2.5])
def test_a_density_that_vanishes_at_its_bound_is_estimated_so(shape):
    """With no flux through the bound it was positive there, with zero slope."""
    truth = scipy.stats.gamma(shape, scale=0.1)
    sample = truth.rvs(20_000, random_state=np.random.default_rng(5))
    found = density(sample, bounds=(0.0, None))
    assert found.value[0] < 0.2 * found.value.max()
    width = found.x[1] - found.x[0]
    for share_below in (0.002, 0.01):  # smoothing adds to the 40 and 200 values that lie below
        end = truth.ppf(share_below)
        mass = found.value[found.x < end].sum() * width
        assert mass == pytest.approx((sample < end).mean(), rel=0.2)
    slopes = np.diff(found.value[found.x < np.quantile(sample, 0.02)])
    assert np.mean(slopes > 0.0) > 0.95


def test_errors_of_a_density_are_its_scatter_also_where_the_kernel_narrows():
    """It vanishes at its bound: at one per cent the kernel is a quarter as wide as amid."""
    truth, rng = scipy.stats.gamma(2.5, loc=3.0), np.random.default_rng(6)
    found = [density(truth.rvs(4000, random_state=rng), bounds=(3.0, None)) for _ in range(40)]
    for share in (0.01, 0.1, 0.5, 0.9):
        x = truth.ppf(share)
        values, errors = (
            [np.interp(x, one.x, getattr(one, name)) for one in found]
            for name in ("value", "error")
        )
        # Forty know their scatter to 11 %; bandwidths vary, too.
        assert np.mean(errors) == pytest.approx(np.std(values), rel=0.35)
    for one in found[:5]:  # which is that of a normal kernel of this bandwidth
        middle = np.interp(0.5, np.cumsum(one.value) / one.value.sum(), one.x)
        value, error = (np.interp(middle, one.x, row) for row in (one.value, one.error))
        kernel = value / (2.0 * np.pi**0.5 * 4000 * error**2)
        assert one.bandwidth == pytest.approx(kernel, rel=0.02)


def test_errors_of_combined_means_are_honest_and_the_means_unbiased():
    """Many times over with a known mean: 8 expensive results, 60 and 500 inexpensive ones."""
    rng = np.random.default_rng(1)
    scores = []
    for _ in range(2000):
        local = rng.normal(0.0, 1.0, 500)
        exact = 0.9 * local + 0.1 * rng.normal(0.0, 1.0, 500)
        expensive = 2.0 + exact + 0.02 * rng.normal(0.0, 1.0, 500)
        found = st.statistics.combined_mean(expensive[:8], exact[:60], local)
        scores.append((found.estimate.value - 2.0) / found.estimate.error)
        assert found.saving > 1.0
    # Student's t of few results is wider than a normal distribution; 2000 of them give 0.02.
    assert abs(np.mean(scores)) < 0.08
    assert 0.9 < np.std(scores) < 1.4


def test_combined_means_are_those_of_regressions():
    """Of 5 results on 9, and of these on 14, by least squares; slopes far from one."""
    rng = np.random.default_rng(3)
    onsets = rng.normal(3.0, 1.0, 14)
    exact = 1.0 + 2.5 * onsets[:9] + rng.normal(0.0, 0.6, 9)
    expensive = 7.0 - 0.3 * exact[:5] + rng.normal(0.0, 0.2, 5)
    value, variance = onsets.mean(), onsets.var(ddof=1) / 14
    for results, others in ((exact, onsets), (expensive, exact)):
        own = others[: results.size]
        line = scipy.stats.linregress(own, results)
        square = line.stderr**2 * np.sum((own - own.mean()) ** 2)  # of what is left
        variance = square / results.size + line.slope**2 * variance
        value = line.intercept + line.slope * value
    found = st.statistics.combined_mean(expensive, exact, onsets)
    assert found.estimate.value == pytest.approx(value, rel=1e-12)
    assert found.estimate.error == pytest.approx(variance**0.5, rel=1e-10)
    assert found.plain_error == pytest.approx(scipy.stats.sem(expensive), rel=1e-12)
    half = scipy.stats.t.ppf(0.975, 3) * found.estimate.error
    assert found.interval() == pytest.approx((value - half, value + half), rel=1e-9)


@pytest.mark.parametrize("expensive", [4, 6])
def test_intervals_of_few_results_cover(expensive):
    """Twice the error held in 77 % of campaigns of four results only."""
    rng = np.random.default_rng(2)
    inside = 0
    for _ in range(1500):
        others = rng.normal(0.0, 1.0, 400)
        results = 1.0 + others[:expensive] + 0.3 * rng.normal(0.0, 1.0, expensive)
        low, high = st.statistics.combined_mean(results, others).interval()
        inside += low < 1.0 < high
    assert 0.935 < inside / 1500 < 0.98  # a standard error of 0.6 %


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_eight_ruptures_on_a_plane_are_worth_a_hundred(capsys):
    found = runpy.run_path(str(EXAMPLE))
    mean, ruptures, onsets = (found[name] for name in ("mean", "ruptures", "onsets"))
    assert mean.saving > 10.0
    # The same samples: what inertia adds at this rate is small and positive.
    added = ruptures.first_instability.values / onsets.first_instability.values[:8] - 1.0
    assert np.all((added > -1e-5) & (added < 5e-3))
    assert abs(mean.estimate.value / float(onsets.first_instability.mean()) - 1.0) < 0.02
    assert "MPa" in capsys.readouterr().out

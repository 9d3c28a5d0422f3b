"""Quantiles and densities against simulation and known distributions."""

import numpy as np
import pytest
import scipy.stats
from recording import stored

from stiction.statistics import density, quantiles


def test_quantile_intervals_cover():
    """Coverage at least as promised over 3000 repetitions of 200 values, and not wasteful."""
    probabilities = np.array([0.02, 0.5, 0.9])
    truth = scipy.stats.expon.ppf(probabilities)
    inside = np.zeros(3)
    for sample in np.random.default_rng(20).exponential(size=(3000, 200)):
        q = quantiles(sample, probabilities)
        inside += (q.lower < truth) & (truth < q.upper)
    # Whole ranks make it exceed 0.90; three standard errors are 0.016. At 0.02 of 200 values the
    # count is 4 +- 2, and one rank is worth up to 0.05 on each side.
    assert np.all((inside / 3000 > 0.90 - 0.016) & (inside / 3000 < 0.96))


def test_quantile_intervals_know_when_the_sample_is_too_small():
    q = quantiles(np.arange(100.0), [0.001, 0.5, 0.999])
    assert q.lower[0] == -np.inf
    assert q.upper[2] == np.inf
    assert np.all((q.lower < q.value) & (q.value < q.upper))


def assert_mass_one(found):
    assert found.value.sum() * (found.x[1] - found.x[0]) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(("kind", "shape", "bounds"), stored("cases")["known densities"])
def test_density_of_known_distributions(kind, shape, bounds):
    """40,000 values: within a few of its own errors nearly everywhere, mass one."""
    distribution = getattr(scipy.stats, kind)(*shape)
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


SPIKES = {"ties": 10 * [1.0, 2.0, 3.0], "far apart": [*range(20), *range(10_000, 10_020)]}


@pytest.mark.parametrize("name", SPIKES)
def test_density_of_spikes_still_has_mass_one(name):
    """Also where the kernel is as narrow as a cell."""
    found = density(np.array(SPIKES[name], dtype=float), bounds=(0.0, None))
    assert found.value.min() >= 0.0
    assert_mass_one(found)


def test_density_of_even_values_is_uniform():
    found = density((np.arange(1024) + 0.5) / 1024, bounds=(0.0, 1.0))
    # Values at the lower ends of their cells: half a cell over the bandwidth of 0.07 is 1.7e-3.
    np.testing.assert_allclose(found.value, 1.0, atol=2e-3)


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

"""Control variates: unbiased, their stated errors true, and a saving as theory says."""

import numpy as np
import pytest
import scipy.stats

from stiction.statistics.control_variates import combined_mean, combined_quantiles

N, FEW, REPEATS = 4000, 100, 150
SCATTER = 0.1  # of what the cheap result misses, in units of its own spread


def _samples(seed):
    generator = np.random.default_rng(seed)
    cheap = generator.gamma(4.0, 0.5, N)
    dear = 0.3 + 1.2 * cheap[:FEW] + SCATTER * generator.standard_normal(FEW)
    return dear, cheap


@pytest.fixture(scope="module")
def found():
    probabilities = np.array([0.1, 0.5, 0.9])
    means, quantiles = [], []
    for seed in range(REPEATS):
        dear, cheap = _samples(seed)
        means.append(combined_mean(dear, cheap))
        quantiles.append(combined_quantiles(dear, [cheap], probabilities))
    return means, quantiles


def test_mean(found):
    means, _ = found
    values = np.array([each.estimate.value for each in means])
    errors = np.array([each.estimate.error for each in means])
    exact = 0.3 + 1.2 * 2.0
    # The mean of 150 repetitions is known to 1/sqrt(150) of their scatter: three of that.
    assert abs(values.mean() - exact) < 3.0 * values.std() / np.sqrt(REPEATS)
    # A standard deviation from 150 values is known to 6 %; three of that.
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(values.std(), rel=0.18)
    # Var Y/n over its parts: residual/n + b^2 Var X/N, Var X = 1.
    saving = (1.44 + SCATTER**2) / FEW / (SCATTER**2 / FEW + 1.44 / N)
    assert np.mean([each.saving for each in means]) == pytest.approx(saving, rel=0.1)


def test_quantiles(found):
    _, quantiles = found
    # Y is a gamma variable smeared by a Gaussian: exact quantiles by convolution on a grid.
    y = np.linspace(-1.0, 20.0, 42001)
    density = scipy.stats.gamma(4.0, scale=0.6).pdf(y - 0.3)
    width = int(8 * SCATTER / (y[1] - y[0]))
    kernel = scipy.stats.norm.pdf(np.arange(-width, width + 1) * (y[1] - y[0]), scale=SCATTER)
    share = np.cumsum(np.convolve(density, kernel, mode="same"))
    exact = np.interp([0.1, 0.5, 0.9], share / share[-1], y)
    for i in range(3):
        values = np.array([each[i].estimate.value for each in quantiles])
        errors = np.array([each[i].estimate.error for each in quantiles])
        # Inverting from few indicators leaves a bias; it must stay below half an error.
        assert abs(values.mean() - exact[i]) < 0.5 * values.std()
        # The stated error comes from a density by differences, and is meant to be cautious.
        assert 0.85 < np.sqrt(np.mean(errors**2)) / values.std() < 1.6
        assert np.mean([each[i].saving for each in quantiles]) > 2.0


def test_without_correlation_nothing_is_gained():
    generator = np.random.default_rng(0)
    dear, cheap = generator.standard_normal(500), generator.standard_normal(5000)
    best = combined_mean(dear, cheap)
    assert best.saving == pytest.approx(1.0, abs=0.03)
    assert best.estimate.error == pytest.approx(best.plain_error, rel=0.02)


def test_a_chain_of_ever_cheaper_methods():
    """Three levels: unbiased, the stated error true, and better than any two of them."""
    n, few, many = 60, 1200, 24_000
    means, errors, halves = [], [], []
    for seed in range(150):
        generator = np.random.default_rng(seed)
        cheapest = generator.standard_normal(many)
        middle = cheapest[:few] + 0.3 * generator.standard_normal(few)
        dear = 5.0 + middle[:n] + 0.02 * generator.standard_normal(n)
        best = combined_mean(dear, middle, cheapest)
        means.append(best.estimate.value)
        errors.append(best.estimate.error)
        halves.append(combined_mean(dear, middle).estimate.error)
        if seed < 20:
            (median,) = combined_quantiles(dear, [middle, cheapest], [0.5])
            # Five stated errors: never by chance, and a forgotten level is off by far more.
            assert abs(median.estimate.value - 5.0) < 5.0 * median.estimate.error
    exact = np.sqrt(0.02**2 / n + 0.3**2 / few + 1.0 / many)
    assert abs(np.mean(means) - 5.0) < 3.0 * exact / np.sqrt(150)
    assert np.std(means) == pytest.approx(exact, rel=0.18)  # 150 values know it to 6 %
    assert np.mean(errors) == pytest.approx(exact, rel=0.05)
    assert np.mean(halves) > 2.0 * exact

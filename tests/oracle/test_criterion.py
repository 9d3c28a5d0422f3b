"""The local criterion against its definition and against theory."""

import numpy as np

import stiction as st
from stiction.criterion.eigenproblem import exact_weight


def test_nucleation_stress_is_the_weighted_integral(problem, make_strength):
    """Direct quadrature of the definition on the trigonometric interpolant of the profile."""
    tau_p = make_strength(1.0).sample(problem.interface, samples=2, seed=1)
    half = problem.nucleation_length / 2.0
    t = (np.arange(400) + 0.5) * np.pi / 400.0  # midpoint rule in the angle: spectrally accurate
    s, measure = np.cos(t), np.sin(t) * np.pi / 400.0
    spectrum = np.fft.rfft(tau_p, axis=1) / 256.0
    spectrum[:, 1:-1] *= 2.0
    k = problem.interface.wavenumbers
    found = st.nucleation_stress(problem, tau_p)
    for node in (0, 100, 201):
        x = problem.interface.x[node] + half * s
        values = (spectrum @ np.exp(1j * np.outer(k, x))).real
        expected = values @ (exact_weight().at(s) * measure)
        np.testing.assert_allclose(found[:, node], expected, rtol=1e-12)


def test_minimum_is_that_of_the_interpolant(problem, make_strength):
    """Against a grid sixteen times finer, made by padding the spectrum with zeros."""
    tau_p = make_strength(0.25).sample(problem.interface, samples=512, seed=2)
    tau_n = st.nucleation_stress(problem, tau_p)
    result = st.onset(problem, tau_p, method=st.LocalCriterion())
    spectrum = np.fft.rfft(tau_n, axis=1)
    spectrum[:, -1] *= 0.5  # the Nyquist mode is shared between both of its signs
    padded = np.zeros((512, 256 * 8 + 1), dtype=complex)
    padded[:, :129] = spectrum
    fine = np.fft.irfft(padded, 4096, axis=1) * 16.0
    gap = fine.min(axis=1) - result.critical_load.values
    assert gap.min() > -1e-6  # round-off of 1e6 Pa
    # A fine spacing off by half costs (dx/2)^2/2 times the curvature at most.
    curvature = np.abs(np.diff(fine, 2, axis=1)).max(axis=1)
    assert np.all(gap <= 0.125 * curvature + 1e-6)
    place = fine.argmin(axis=1) / 4096.0 * 0.1
    distance = np.abs((result.critical_position.values - place + 0.05) % 0.1 - 0.05)
    close = gap < 0.125 * curvature
    assert np.mean(distance[close] <= 0.1 / 4096.0) > 0.99


def test_mean_and_variance_of_the_nucleation_stress(problem, make_strength):
    """E[tau_n] = E[tau_p]; Var from the correlation, for four correlation lengths."""
    k = 2.0 * np.pi * np.abs(np.fft.fftfreq(256, 0.1 / 256.0))
    multiplier = exact_weight().multiplier(k * problem.nucleation_length / 2.0)
    samples = 4096
    for ratio in (0.25, 0.5, 1.0, 2.0):
        strength = make_strength(ratio)
        tau_n = st.nucleation_stress(
            problem, strength.sample(problem.interface, samples=samples, seed=3)
        )
        spectrum = np.fft.fft(strength.correlation(problem.interface)).real / 256.0
        variance = strength.standard_deviation**2 * np.sum(spectrum * multiplier**2)
        means = tau_n.mean(axis=1)
        squares = ((tau_n - strength.mean) ** 2).mean(axis=1)
        error = 4.0 / np.sqrt(samples)  # four standard errors of independent samples
        assert abs(means.mean() - strength.mean) < error * means.std()
        assert abs(squares.mean() - variance) < error * squares.std()


def test_critical_position_is_uniform(problem, make_strength):
    from scipy.stats import kstest

    result = st.monte_carlo(
        problem, make_strength(0.5), method=st.LocalCriterion(), samples=20_000, seed=5
    )
    assert kstest(result.critical_position.values / 0.1, "uniform").pvalue > 1e-3

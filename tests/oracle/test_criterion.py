"""The local criterion against its definition, against theory and against exact onsets."""

import warnings

import numpy as np
import pytest
from checks import assert_mean
from oracles import angle_rule
from scipy.stats import kstest
from setups import ROUND_OFF, ensemble, exact_onset, local_onset, make_problem

import stiction as st
from stiction.criterion import eigenfunction
from stiction.criterion.local import beyond_residual


# With the error of the weights on the grid, a tenth of the strength's own variation at most.
@pytest.mark.parametrize(("nodes", "error"), [(256, 3e-4), (512, 1e-5), (1024, 3e-7)])
def test_nucleation_stress_is_the_weighted_integral(make_strength, nodes, error):
    """Direct quadrature of the definition on the trigonometric interpolant of the profile."""
    problem = make_problem(nodes)
    tau_p = make_strength(1.0).sample(problem.interface, samples=2, seed=1)
    s, measure = angle_rule(400)
    weights = eigenfunction.weight(s) * measure
    spectrum = np.fft.rfft(tau_p, axis=1) / nodes
    spectrum[:, 1:-1] *= 2.0
    found = st.theory.nucleation_stress(problem, tau_p)
    for node in (0, 100, 201):
        x = problem.interface.x[node] + problem.nucleation_length / 2.0 * s
        values = (spectrum @ np.exp(1j * np.outer(problem.interface.wavenumbers, x))).real
        np.testing.assert_allclose(found[:, node], values @ weights, rtol=error)


# Error of a polynomial through ten nodes where the strength varies within a quarter of h_n, in
# standard deviations of the strength (0.2 MPa); h_n is 9, 18 and 35 nodes.
@pytest.mark.parametrize(
    ("nodes", "rms", "largest"), [(256, 4e-3, 3e-2), (512, 5e-4, 2e-3), (1024, 4e-6, 2e-5)]
)
def test_minimum_is_that_of_the_interpolant(make_strength, nodes, rms, largest):
    """Against a grid sixteen times finer, made by padding the spectrum with zeros."""
    problem = make_problem(nodes)
    tau_p = make_strength(0.25).sample(problem.interface, samples=512, seed=2)
    tau_n = st.theory.nucleation_stress(problem, tau_p)
    result = local_onset(problem, tau_p)
    spectrum = np.fft.rfft(tau_n, axis=1)
    spectrum[:, -1] *= 0.5  # the Nyquist mode is shared between both of its signs
    fine = np.fft.irfft(spectrum, 16 * nodes, axis=1) * 16.0
    found = result.critical_load.values
    assert np.all(found <= tau_n.min(axis=1) * (1.0 + ROUND_OFF))
    assert np.all(found >= tau_p.min(axis=1) * (1.0 - ROUND_OFF))
    # A fine spacing off by half costs (dx/2)^2/2 times the curvature at most.
    rows, at = np.arange(512), fine.argmin(axis=1)
    beside = fine[rows, at - 1] + fine[rows, (at + 1) % (16 * nodes)]
    allowed = 0.0625 * (beside - 2.0 * fine[rows, at]) / 0.2e6
    error = (found - fine[rows, at]) / 0.2e6 + allowed
    assert np.sqrt(np.mean(np.maximum(np.abs(error) - allowed, 0.0) ** 2)) < rms
    assert np.all(np.abs(error) <= allowed + largest)
    place = at / (16.0 * nodes) * 0.1
    distance = np.abs((result.critical_position.values - place + 0.05) % 0.1 - 0.05)
    assert np.mean(distance <= 0.1 / (4.0 * nodes)) > 0.95


@pytest.mark.parametrize("contrast", [10.0, 50.0, 200.0, 1000.0, 1e6])
def test_a_barrier_leaves_the_weak_stretch_beside_it_alone(contrast):
    """The patch that lets go lies where there is no barrier, so its strength does not matter."""
    problem = make_problem(384)
    x = problem.interface.x
    # Uniform, and with a dip in the middle of the rest.
    for weak in (np.full(384, 1e6), 1e6 - 3e5 * np.exp(-(((x - 0.08) / 0.004) ** 2))):
        barred = np.where((x > 0.025) & (x < 0.05), contrast * 1e6, weak)
        without, found = (local_onset(problem, s).critical_load.item() for s in (weak, barred))
        assert found == pytest.approx(without, rel=1e-9)
        tau_n = st.theory.nucleation_stress(problem, barred)
        assert weak.min() <= tau_n.min() * (1.0 + ROUND_OFF)
        assert tau_n.max() <= barred.max() * (1.0 + ROUND_OFF)


@pytest.mark.parametrize("ratio", [0.25, 0.5, 1.0, 2.0])
def test_mean_and_variance_of_the_nucleation_stress(problem, make_strength, ratio):
    """E[tau_n] = E[tau_p]; Var from the correlation."""
    k = 2.0 * np.pi * np.abs(np.fft.fftfreq(256, 0.1 / 256.0))
    multiplier = eigenfunction.multiplier(k * problem.nucleation_length / 2.0)
    strength = make_strength(ratio)
    tau_p = strength.sample(problem.interface, samples=4096, seed=3)
    tau_n = st.theory.nucleation_stress(problem, tau_p)
    spectrum = np.fft.fft(strength.correlation(problem.interface)).real / 256.0
    variance = strength.standard_deviation**2 * np.sum(spectrum * multiplier**2)
    assert_mean(tau_n.mean(axis=1), strength.mean, errors=4.0)
    assert_mean(((tau_n - strength.mean) ** 2).mean(axis=1), variance, errors=4.0)


def test_critical_position_is_uniform(problem, make_strength):
    places = ensemble(problem, make_strength(0.5), 20_000, seed=5).critical_position.values
    assert kstest(places / 0.1, "uniform").pvalue > 1e-3


def lognormal(xi, cv=0.3):
    return st.RandomField(st.Lognormal(mean=1e6, cv=cv), st.PowerLawSpectrum(xi), True)


def beyond(problem, tau_p):
    """Where the residual strength counts and how much it lowers onsets; exact onsets; warnings."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        local = local_onset(problem, tau_p)
    texts = [str(one.message) for one in found if "upper bound" in str(one.message)]
    exact = exact_onset(problem, tau_p)
    above = (local.critical_stress / exact.first_instability - 1.0).values
    return *beyond_residual(problem, problem.sample(tau_p), dict(local)), exact, above, texts


def test_it_is_said_where_residual_strength_ends_the_upper_bound():
    """Exact onsets tell in which samples it is one; nothing was said of a fifth of them."""
    weak = make_problem(128, 0.0144, residual_ratio=0.3)  # 30 nodes in h_n
    xi = 0.5 * weak.nucleation_length
    tau_p = lognormal(xi).sample(weak.interface, samples=200, seed=11)
    reached, missing, exact, above, texts = beyond(weak, tau_p)
    low = above < -1e-3
    assert np.mean(low) > 0.05
    assert reached[low].mean() > 0.8
    assert exact.residual_reached.values[reached].mean() > 0.7
    assert 0.5 < missing[low].mean() / -above[low].mean() < 2.0
    assert len(texts) == 1
    assert f"{100.0 * reached.mean():.2g} %" in texts[0]
    # With a strength that varies little it is one, and nothing is said.
    calm = lognormal(xi, 0.05).sample(weak.interface, samples=100, seed=11)
    *_, texts = beyond(weak, calm)
    assert texts == []


def test_residual_strength_within_the_critical_patch_of_a_plane():
    plane = make_problem((32, 32), (0.012, 0.012), residual_ratio=0.75)
    tau_p = lognormal(0.3 * plane.nucleation_length).sample(plane.interface, samples=10, seed=1)
    reached, _, _, above, texts = beyond(plane, tau_p)
    assert np.any(above < -1e-3)
    assert reached[above < -1e-3].all()
    assert len(texts) == 1

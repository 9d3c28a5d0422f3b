"""Mean and variance of the nucleation stress against their definitions and limits."""

import dataclasses

import numpy as np
import pytest
from oracles import angle_rule
from setups import make_problem

import stiction as st
from stiction.methods.criterion import eigenfunction
from stiction.random.mapping import correlation_of_mapped, hermite_coefficients
from stiction.statistics.moments import nucleation_statistics, strength_spectrum


def infinite_ratio(problem, strength):
    """Var[tau_n]/Var[tau_p] on an infinite line: 1500 x 1500 cells of the definition."""
    s, measure = angle_rule(1500)
    share = eigenfunction.weight(s) * measure
    lags = np.abs(s[:, None] - s[None, :]) * problem.nucleation_length / 2.0
    rho = strength.spectrum.untruncated_correlation(lags)
    c = correlation_of_mapped(rho, hermite_coefficients(strength.marginal))
    return share @ c @ share


def test_periodic_variance_is_that_of_the_grid(problem, make_strength):
    """The covariance matrix of the nodes, averaged by the weights of nucleation_stress itself."""
    strength = make_strength(0.5)
    c = strength.correlation(problem.interface)
    weights = st.theory.nucleation_stress(problem, 1e6 + np.eye(256))[:, 0] - 1e6
    matrix = c[(np.arange(256)[:, None] - np.arange(256)[None, :]) % 256]
    found = nucleation_statistics(problem, strength)
    # 1e6 + 1 keeps ten digits of the one.
    assert found.variance_ratio == pytest.approx(weights @ matrix @ weights, rel=1e-8)
    assert found.mean == pytest.approx(strength.mean, rel=1e-14)


def test_periodic_tends_to_infinite(problem, make_strength):
    """Without the mean mode a share of about the correlation length over L is missing."""
    strength = make_strength(0.5)
    infinite = infinite_ratio(problem, strength)
    gaps = []
    for factor in (1, 2, 4):
        longer = make_problem(256 * factor, 0.1 * factor)
        gaps.append(infinite - nucleation_statistics(longer, strength).variance_ratio)
    assert gaps[0] > 0.0
    # What is missing falls as 1/L; truncation at 2.5 lambda leaves a few 1e-5 besides.
    assert gaps[0] / gaps[1] == pytest.approx(2.0, rel=0.05)
    assert gaps[1] / gaps[2] == pytest.approx(2.0, rel=0.05)


def test_a_uniform_field_is_averaged_to_itself(problem, make_strength):
    xi = 240.0 * problem.interface.length
    uniform = dataclasses.replace(
        make_strength(),
        spectrum=st.PowerLawSpectrum(correlation_length=xi, truncation=1e4),
        mean_mode=True,
    )
    found = nucleation_statistics(problem, uniform)
    assert found.variance_ratio == pytest.approx(1.0, abs=1e-6)


def test_friction_coefficients_are_taken_times_the_pressure(problem):
    """0.22 was taken for 0.22 Pa."""
    pressed = dataclasses.replace(problem, load=st.Load(normal_pressure=2e6))
    in_pascals, coefficient = (
        st.RandomField(
            st.Beta(alpha=2.0, beta=3.0, low=low, high=3.0 * low),
            st.PowerLawSpectrum(correlation_length=5e-3),
            of=of,
        )
        for low, of in ((0.4e6, None), (0.2, "friction_coefficient"))
    )
    found, expected = (nucleation_statistics(pressed, f) for f in (coefficient, in_pascals))
    assert found.mean == pytest.approx(expected.mean, rel=1e-12)
    assert found.variance == pytest.approx(expected.variance, rel=1e-12)
    varying = make_problem(load=st.Load(normal_pressure=np.linspace(1e6, 2e6, 256)))
    with pytest.raises(st.InputError, match=r"load\.normal_pressure: varies"):
        nucleation_statistics(varying, coefficient)


def test_spectrum_sums_to_one(problem, make_strength):
    power = strength_spectrum(problem, make_strength(0.25))
    assert power.sum() == pytest.approx(1.0, rel=1e-12)
    assert power.shape == (129,)


def test_uniform_load_and_initial_stress_scale(problem, make_strength):
    """tau_n = (<g, tau_p> - tau_i)/p."""
    loaded = dataclasses.replace(problem, load=st.Load(profile=2.0, initial_stress=1e5))
    plain = nucleation_statistics(problem, make_strength())
    found = nucleation_statistics(loaded, make_strength())
    assert found.mean == pytest.approx((plain.mean - 1e5) / 2.0)
    assert found.variance == pytest.approx(plain.variance / 4.0)

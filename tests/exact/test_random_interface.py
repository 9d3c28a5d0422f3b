"""Several random properties of one interface: their draws, correlation, and what they mean."""

import dataclasses
import itertools

import numpy as np
import pytest
import scipy.stats
from setups import exact_onset, make_problem

import stiction as st
from stiction.random.fields import lower_factor

LINE = st.Interface(length=0.1, nodes=256)


@pytest.fixture
def residual(make_strength):
    return dataclasses.replace(
        make_strength(1.0), marginal=st.Beta(alpha=2.0, beta=2.0, low=0.1e6, high=0.5e6)
    )


def test_a_property_keeps_its_draws_whatever_else_is_random(make_strength, residual):
    fields = {"strength": make_strength(1.0), "residual_strength": residual}
    correlation = {("residual_strength", "initial_stress"): 0.5}
    both = st.RandomInterface(**fields)
    third = st.RandomInterface(**fields, initial_stress=residual, correlation=correlation)
    alone = st.RandomInterface(strength=fields["strength"])
    one, two, three = (r.profiles(LINE, samples=5, seed=3) for r in (alone, both, third))
    first = fields["strength"].sample(LINE, samples=5, seed=3)
    for profiles in (one, two, three):
        assert np.array_equal(first, profiles["strength"])
    assert np.array_equal(two["residual_strength"], three["residual_strength"])


def test_residual_ratio_is_the_same_thing(problem, make_strength):
    tau_p = make_strength(1.0).sample(LINE, samples=3, seed=2)
    own = exact_onset(make_problem(residual_ratio=0.5), tau_p)
    other = exact_onset(problem, {"strength": tau_p, "residual_strength": 0.5 * tau_p})
    assert np.array_equal(own.critical_stress, other.critical_stress)


@pytest.mark.parametrize("nodes", [16, (10, 8)], ids=["line", "plane"])
def test_covariance_of_a_chain_of_properties_with_spectra_of_their_own(nodes):
    """A and B are correlated, B and C: the response to each draw, as a matrix, times itself."""
    plane = isinstance(nodes, tuple)
    interface = st.Interface((1.0, 0.7) if plane else 1.0, nodes)
    options = {"anisotropy": 1.3} if plane else {}
    fields = {
        name: st.RandomField(scipy.stats.norm(), spectrum, mean_mode=mean, **options)
        for name, spectrum, mean in (
            ("strength", st.PowerLawSpectrum(0.5), False),
            ("residual_strength", st.SquaredExponentialSpectrum(0.3), True),
            ("initial_stress", st.ExponentialSpectrum(0.4, power_kept=0.9), True),
        )
    }
    random = st.RandomInterface(
        **fields,
        correlation={
            ("strength", "residual_strength"): 0.7,
            ("residual_strength", "initial_stress"): -0.6,
        },
    )
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


def test_fracture_energy_and_critical_slip_as_random_properties(make_strength):
    """W follows from tau_p - tau_r and Gamma or d_c, node by node."""
    problem = make_problem(512, weakening_rate=None)
    tau_p = make_strength(1.0).sample(problem.interface, samples=2, seed=1)
    energy, slip = 0.8, 1.9e-6
    by_energy = problem.sample({"strength": tau_p, "fracture_energy": energy})
    assert np.allclose(by_energy.weakening_rate, tau_p**2 / (2.0 * energy), rtol=1e-15)
    by_slip = problem.sample({"strength": tau_p, "critical_slip": slip})
    assert np.allclose(by_slip.weakening_rate, tau_p / slip, rtol=1e-15)


def test_factor_of_a_singular_matrix():
    matrix = np.array([[1.0, 1.0, 0.3], [1.0, 1.0, 0.3], [0.3, 0.3, 1.0]])
    factor = lower_factor(matrix)
    assert np.allclose(factor @ factor.T, matrix, atol=1e-15)

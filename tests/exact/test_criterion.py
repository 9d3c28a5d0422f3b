"""The local criterion, mean and variance of its stress, and cracks, against closed forms."""

import numpy as np
import pytest
from recording import stored
from setups import edge_load, local_onset, make_problem, turns

import stiction as st
from stiction.elasticity.protocol import SMALLEST_EIGENVALUE
from stiction.methods.criterion.griffith import release_rates
from stiction.methods.criterion.windows import (
    around,
    eigenvalue_and_vector,
    grid_weights,
    multiplier,
    weight,
)
from stiction.theory import griffith_length, nucleation_statistics


def first_onset(problem, tau_p):
    """Of one sample: the values of the results by name."""
    return {name: values.item() for name, values in local_onset(problem, tau_p).items()}


def test_smallest_eigenvalue_and_its_vector():
    """Digits of Uenishi and Rice's eigenproblem, converged in the number of terms."""
    value, vector = eigenvalue_and_vector()
    assert value == pytest.approx(0.57888694185, abs=1e-10)
    assert pytest.approx(value, abs=1e-10) == SMALLEST_EIGENVALUE
    expected = [1.0, -0.0874721588, -0.001737348, -0.000832592]
    np.testing.assert_allclose(vector[:8:2], expected, atol=1e-9)
    finer, _ = eigenvalue_and_vector(80)
    assert finer == pytest.approx(value, abs=2e-10)


def test_integrals_of_the_weight():
    s = np.cos(np.linspace(np.pi, 0.0, 100_001))
    g = weight(s)
    # The trapezoidal sum on this grid is good to 1e-9; the figures have the digits printed.
    assert np.trapezoid(g, s) == pytest.approx(1.0, abs=1e-9)
    assert np.trapezoid(s * s * g, s) == pytest.approx(0.22813196, abs=1e-8)
    assert np.sqrt(np.trapezoid(g * g, s)) == pytest.approx(0.7499991, abs=1e-7)


def test_multiplier_is_the_fourier_transform_of_the_weight():
    s = np.cos(np.linspace(np.pi, 0.0, 200_001))
    z = np.array([0.0, 1e-6, 0.3, 3.0, 20.0, 150.0])
    expected = [np.trapezoid(weight(s) * np.cos(one * s), s) for one in z]
    # The trapezoidal sum is good to (z dt)^2/12 of its value: 5e-9 at the largest z.
    np.testing.assert_allclose(multiplier(z), expected, atol=1e-8)


# Largest error for waves of |k| h_n/2 up to 1, 3, 6 and 12, rounded up from what was measured.
@pytest.mark.parametrize(("half_width", "errors"), stored("cases")["errors of weights"])
def test_weights_on_a_grid_do_to_smooth_waves_what_the_eigenfunction_does(half_width, errors):
    nodes = 16 * int(np.ceil(half_width))
    w = grid_weights(half_width)
    assert w.min() >= 0.0
    assert w.size - 1 == np.ceil(half_width) + 1  # one node beyond the end of the patch
    assert w[0] + 2.0 * w[1:].sum() == pytest.approx(1.0, rel=1e-14)
    found = np.fft.rfft(around(w, nodes)).real
    z = 2.0 * np.pi * np.arange(nodes // 2 + 1) / nodes * half_width
    error = np.abs(found - multiplier(z))
    for highest, allowed in zip((1.0, 3.0, 6.0, 12.0), errors, strict=True):
        assert error[z <= highest].max() < allowed


@pytest.mark.parametrize(("plane", "nu"), [("stress", -0.5), ("strain", 0.33)])
def test_moduli_and_wave_speeds_of_both_plane_states(plane, nu):
    """Plane stress: G (1 + nu), plane strain: G/(1 - nu), mode III: G."""
    solid = st.Solid(shear_modulus=3.0, poisson_ratio=nu, density=2.0, plane=plane)
    factor = 1.0 + nu if plane == "stress" else 1.0 / (1.0 - nu)
    assert solid.effective_modulus("II") == pytest.approx(factor * 3.0, rel=1e-14)
    assert solid.effective_modulus("III") == 3.0
    assert solid.shear_wave_speed == pytest.approx(1.5**0.5, rel=1e-14)
    # c_d from Lame's constants in plane strain, from E/(1-nu^2) in plane stress.
    young = 2.0 * 3.0 * (1.0 + nu)
    lame = young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    stiffness = lame + 6.0 if plane == "strain" else young / (1.0 - nu**2)
    assert solid.dilatational_wave_speed == pytest.approx(np.sqrt(stiffness / 2.0), rel=1e-14)
    # The Rayleigh function before squaring.
    q = (solid.rayleigh_wave_speed / solid.shear_wave_speed) ** 2
    eta = solid.dilatational_wave_speed / solid.shear_wave_speed
    function = (2.0 - q) ** 2 - 4.0 * np.sqrt(1.0 - q) * np.sqrt(1.0 - q / eta**2)
    assert 0.0 < q < 1.0
    assert function == pytest.approx(0.0, abs=1e-13)


def test_weakening_rate_of_each_sample(make_strength):
    """Samples of different W in one call are the same as one by one; columns are broadcast."""
    problem = make_problem(weakening_rate=None)
    tau_p = make_strength(0.5).sample(problem.interface, samples=5, seed=1)
    weakening_rates = np.array([[0.5], [0.4], [0.5], [0.3], [0.45]]) * 1e12
    together = local_onset(problem, {"strength": tau_p, "weakening_rate": weakening_rates})
    for i in range(5):
        alone = first_onset(make_problem(weakening_rate=float(weakening_rates[i, 0])), tau_p[i])
        for name in ("critical_load", "critical_position"):
            assert together[name][i].item() == alone[name]
    assert len(np.unique(together.critical_load)) == 5


def test_position_lies_on_the_interface(problem):
    """A minimum a hair left of node 0 is at 0, not at L. Half a spacing left, it is near L."""
    tau_p = 1e6 - 2e5 * np.cos(np.outer([1, 3, 5], turns(256)))
    for signed in (tau_p, tau_p[:, ::-1].copy(), np.roll(tau_p, 1, axis=1)):
        places = local_onset(problem, signed)["critical_position"].values
        assert 0.0 <= places.min() <= places.max() < 0.1
    at = 0.1 / 256 * np.array([-0.7, -0.5, -0.2, 0.3, 255.6])
    shifted = 1e6 - 2e5 * np.cos(turns(256) - 2.0 * np.pi / 0.1 * at[:, None])
    places = local_onset(problem, shifted)["critical_position"].values
    np.testing.assert_allclose(places, at % 0.1, atol=1e-7)


def test_moments_of_the_nucleation_stress_are_those_of_the_grid():
    """The covariance matrix of the nodes, averaged by the weights of nucleation_stress itself.

    Of friction coefficients: 0.22 was taken for 0.22 Pa.
    """
    load = st.Load(profile=2.0, initial_stress=1e5, normal_pressure=2e6)
    problem, marginal = make_problem(load=load), st.Beta(alpha=2.0, beta=3.0, low=0.2, high=0.6)
    spectrum = st.PowerLawSpectrum(correlation_length=5e-3)
    field = st.RandomField(marginal, spectrum, True, quantity="friction_coefficient")
    c = field.correlation(problem.interface)
    # A tip as high as the rest keeps all but one digit of the weights.
    tips = st.theory.nucleation_stress(problem, 1e6 * (1.0 + np.eye(256)))[:, 0]
    weights = (tips - (1e6 - 1e5) / 2.0) / 1e6
    matrix = c[(np.arange(256)[:, None] - np.arange(256)[None, :]) % 256]
    found = nucleation_statistics(problem, field)
    variance = (2e6 * field.standard_deviation) ** 2 * (weights @ matrix @ weights)
    assert found.variance == pytest.approx(variance, rel=1e-8)
    assert found.mean == pytest.approx((2e6 * field.mean - 1e5) / 2.0, rel=1e-12)


PROBLEM = st.paper.problem(nodes=1024)


def test_cracks_shorter_than_any_that_is_looked_at():
    """A short crack under a uniform drop: 2a = 4 G* Gamma/(pi drop^2)."""
    exact = 4.0 * PROBLEM.effective_modulus * 1e-9 / (np.pi * 0.7e6**2)
    assert griffith_length(PROBLEM, 0.7e6, 1e-9) == pytest.approx(exact, rel=1e-5)


def test_a_release_rate_that_peaks_within_a_few_nodes_is_seen():
    """A strong, narrow load: the peak lies below a 2,000th of the length, and was missed."""
    line, law = st.Interface(1.0, 2048), {"weakening_rate": 2e12, "residual_strength": 4e5}
    solid, load = st.Solid(3e9, 0.21, 2000.0), edge_load(line, 60.0, 4e-4)
    problem = st.Problem(solid, line, st.LinearWeakening(**law), load)
    lengths = np.geomspace(1e-5, 0.1, 1000)
    above = release_rates(problem, 1.5e5, lengths, 0.0).min(axis=1) > 1.5
    first = int(above.argmax())
    last = first + int(above[first:].argmin())
    start, stop = (
        griffith_length(problem, 1.5e5, 1.5, arrest=arrest) for arrest in (False, True)
    )
    assert lengths[first - 1] < start <= lengths[first]
    assert lengths[last - 1] < stop <= lengths[last] < 5e-3

"""Elastodynamics with a known answer: a self-similar crack, and a wave on a free interface."""

import numpy as np
import pytest
from checks import assert_second_order
from oracles import from_laplace, mode_three_stiffness, mode_two_stiffness
from ruptures import stepped
from scipy.special import j0, j1
from setups import make_problem

import stiction as st
from stiction.elasticity.memory_kernels import kernel_sum, memory_kernel, static_stiffness

SOLID = st.paper.problem().solid
ETA = np.sqrt(2.0 / 0.67)


def kostrov_integral(speed, mode):
    """I = b^2 int_0^inf D(s) (s^2 + b^2)^(-3/2) ds, b = v/c_s (Kostrov 1964, by mode)."""
    # s = b tan(angle): the integrand is then smooth on a finite range.
    nodes, weights = np.polynomial.legendre.leggauss(200)
    angle = 0.25 * np.pi * (nodes + 1.0)
    shear = np.sqrt(1.0 + (speed * np.tan(angle)) ** 2)  # D of mode III
    if mode == "II":
        shear = [float(mode_two_stiffness(s, ETA).real) for s in speed * np.tan(angle)]
    values = shear * np.cos(angle)
    return float(np.sum(0.25 * np.pi * weights * values))


@pytest.mark.parametrize("mode", ["II", "III"])
@pytest.mark.parametrize("speed", [0.3, 0.85])
@pytest.mark.parametrize("short", [False, True], ids=["quadrature", "short sum"])
def test_stress_inside_a_growing_crack_is_minus_the_drop(mode, speed, short):
    """Slip A sqrt(v^2 t^2 - x^2) with A = 2 drop/(G I), G = c_s = 1: mode by mode, then filtered.

    Slip rate of mode k: A pi v^2 t J0(k v t). A Gaussian filter of width v t/8 reaches the tips
    with a weight of 1e-14 only.
    """
    amplitude = 2.0 / kostrov_integral(speed, mode)
    width = speed / 8.0
    x, w = np.polynomial.legendre.leggauss(160)
    k, k_weight = 4.5 / width * (x + 1.0), 4.5 / width * w
    x, w = np.polynomial.legendre.leggauss(300)
    past, past_weight = 0.5 * (x + 1.0), 0.5 * w
    scaled = np.multiply.outer(k, past)
    kernel = kernel_sum(mode, ETA)(scaled) if short else memory_kernel(scaled, mode, ETA)
    rate = speed**2 * (1.0 - past) * j0(np.multiply.outer(k, speed * (1.0 - past)))
    slip = np.pi * amplitude * speed * j1(k * speed) / k
    memory = np.pi * amplitude * (kernel * rate) @ past_weight
    stress = 0.5 * k * (memory - static_stiffness(mode, ETA) * slip)
    stress -= 0.5 * np.pi * amplitude * speed**2 * j0(k * speed)
    inside = np.sum(k_weight * stress * np.exp(-0.5 * (k * width) ** 2)) / np.pi
    # 1e-6 is the kernel's tolerance; the quadrature alone leaves 1e-8.
    assert inside == pytest.approx(-1.0, abs=1e-6)


def released(steps, end, mode="II"):
    """Amplitude of a slip cos(kx) on an interface without friction law, at c_s k t = end."""
    # Everything has slipped beyond d_c and slides on at the residual strength.
    friction = {"weakening_rate": 1e9, "residual_strength": 1e6}
    problem = make_problem(32, solid=SOLID, mode=mode, **friction)
    k = problem.interface.wavenumbers[2]
    slip = 1e-3 + 1e-6 * np.cos(k * problem.interface.x)
    time = end / (k * SOLID.shear_wave_speed)
    _, state = stepped(problem, np.full(32, 1.001e6), 2e6, time, steps, slip)
    return state.slip_hat[2].real / 16.0 / 1e-6


def release_by_laplace(t, mode):
    """a/a_0 = inverse transform of (1 - D0/D)/s."""

    def transform(s):
        if mode == "III":
            return (1 - 1 / mode_three_stiffness(s)) / s
        return (1 - static_stiffness("II", ETA) / mode_two_stiffness(s, ETA)) / s

    return from_laplace(transform, t)


@pytest.mark.parametrize("mode", ["II", "III"])
def test_released_wave_converges_to_the_laplace_solution_with_second_order(mode):
    expected = release_by_laplace(10.0, mode)
    errors = [abs(released(steps, 10.0, mode) - expected) for steps in (100, 200, 400)]
    assert_second_order(errors, 0.3)  # measured between 3.9 and 4.1
    assert errors[2] < 5e-4


def test_a_free_interface_rings_on_as_the_rayleigh_wave_alone():
    """Late, only the pole at s = i c_R/c_s is left: a = 2 Re(residue exp(s t)), undamped."""
    pole = 1j * SOLID.rayleigh_wave_speed / SOLID.shear_wave_speed
    h = 1e-5
    above, below = (complex(mode_two_stiffness(pole + each, ETA)) for each in (h, -h))
    slope = (above - below) / (2.0 * h)
    residue = -static_stiffness("II", ETA) / (pole * slope)
    for time in (600.0, 602.0):
        expected = 2.0 * (residue * np.exp(pole * time)).real
        # Waves of the branch points have faded like t^-3/2, to about 1e-4; the phase is off by
        # the square of the step (0.02) times the time, some 1e-3.
        assert released(30_000, time) == pytest.approx(expected, abs=2e-3)
    assert abs(residue) > 0.1

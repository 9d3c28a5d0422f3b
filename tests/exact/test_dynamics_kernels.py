"""The memory kernel against closed forms and high-precision inversion, and its short sums."""

import mpmath
import numpy as np
import pytest
from oracles import from_laplace, mode_two_stiffness

from stiction.elasticity.memory_kernels import (
    _Polish,
    fit_exponentials,
    kernel_sum,
    memory_kernel,
    static_stiffness,
)
from stiction.methods.dynamics import explicit, implicit, memory

ETA = np.sqrt(2.0 / 0.67)
"""c_d/c_s in plane stress at nu = 0.33."""
ALMOST_INCOMPRESSIBLE = np.sqrt(1.02 / 0.02)
"""In plane strain at nu = 0.49."""


def bessel_tail(t):
    """W(T) = int_T^inf J1(x)/x dx, by the integral of J0."""
    integral = t * mpmath.hyp1f2(mpmath.mpf(1) / 2, 1, mpmath.mpf(3) / 2, -t * t / 4)
    return 1 - integral + mpmath.besselj(1, t)


def closed_form(t, mode, eta):
    """C by Bessel functions; needs many digits, since terms of mode II cancel like T^2."""
    t, e = mpmath.mpf(t), mpmath.mpf(float(eta))
    if mode == "III":
        return bessel_tail(t)
    w, w_fast = bessel_tail(t), bessel_tail(e * t)
    return (
        2 * w
        - mpmath.besselj(1, t)
        - 2 / e**2 * (w_fast - mpmath.besselj(1, e * t))
        - 2 * t**2 * (w_fast - w)
        + 2 * t / e * mpmath.besselj(0, e * t)
        - 2 * t * mpmath.besselj(0, t)
    )


@pytest.mark.parametrize(
    ("mode", "eta"),
    [("II", ETA), ("II", np.sqrt(2.0)), ("II", ALMOST_INCOMPRESSIBLE), ("III", 1.0)],
)
@pytest.mark.parametrize("t", [1e-3, 0.3, 2.0, 7.0, 40.0, 1e3, 1e5])
def test_kernel_equals_its_closed_form(t, mode, eta):
    with mpmath.workdps(40):
        expected = float(closed_form(t, mode, eta))
    # 1e-12 is asked for; round-off in phases of 1e5 rad is what is left.
    assert abs(memory_kernel(t, mode, eta) - expected) < 1e-12


@pytest.mark.parametrize("t", [0.5, 3.0, 12.0])
def test_kernel_equals_high_precision_laplace_inversion(t):
    def transform(s):
        return (static_stiffness("II", ETA) + s - mode_two_stiffness(s, ETA)) / s

    expected = from_laplace(transform, t, degree=80)
    assert abs(memory_kernel(t, "II", ETA) - expected) < 1e-12


@pytest.mark.parametrize(
    ("mode", "eta"), [("II", ETA), ("II", ALMOST_INCOMPRESSIBLE), ("III", 1.0)]
)
def test_short_sum_reaches_its_tolerance_on_times_it_never_saw(mode, eta):
    kernel = kernel_sum(mode, eta, 1e-6)
    rng = np.random.default_rng(123)
    times = np.concatenate([np.linspace(0.0, 60.0, 4001), 10.0 ** rng.uniform(-3, 5, 20_000)])
    error = np.abs(kernel(times) - memory_kernel(times, mode, eta)).max()
    # A random time can sit a little beside the worst one that was validated.
    assert error < 1.2e-6
    assert kernel.error < 1e-6
    assert kernel.poles.real.max() <= -0.3 / 1e5
    assert np.abs(kernel.weights).max() < 10.0
    assert kernel.poles.size <= 28


def test_a_looser_tolerance_needs_fewer_pairs():
    loose, tight = fit_exponentials("III", 1.0, 1e-3), kernel_sum("III", 1.0, 1e-6)
    assert loose.poles.size < 0.6 * tight.poles.size


def test_a_real_pole_has_a_weight():
    """The sine beside it is zero, and the basis of both is singular."""
    times = np.linspace(0.0, 5.0, 40)
    fit = _Polish(times, 0.7 * np.exp(-times))
    _, _, weights, residual = fit.project(np.array([-1.0 + 0.0j]), 1.0 + times)
    assert weights == pytest.approx([0.7])
    assert np.abs(residual).max() < 1e-14


@pytest.mark.parametrize("module", [explicit, implicit, memory])
def test_blocks_of_the_memory_have_their_length_from_one_constant(module):
    kernels = [one.py_func for one in vars(module).values() if hasattr(one, "py_func")]
    lengths = {64, 128, 192, 256}
    assert {one.__name__ for one in kernels if lengths & {*one.__code__.co_consts}} == set()

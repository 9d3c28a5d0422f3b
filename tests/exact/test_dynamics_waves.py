"""Elastodynamics with a known answer: kernels, a self-similar crack, a wave on a free interface.

On a plane: lines, the kernels of wave vectors, a point load.
"""

import dataclasses
import functools

import mpmath
import numpy as np
import pytest
from checks import assert_second_order
from oracles import from_laplace, mode_three_stiffness, mode_two_stiffness
from ruptures import stepped, with_step
from scipy.special import j0, j1
from setups import QUARTER, RATE, make_problem

import stiction as st
from stiction.elasticity.memory_kernels import (
    ExponentialSum,
    _Polish,
    kernel_sum,
    memory_kernel,
    static_stiffness,
)
from stiction.methods.dynamics.medium import amplification

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
    slip_rate = speed**2 * (1.0 - past) * j0(np.multiply.outer(k, speed * (1.0 - past)))
    slip = np.pi * amplitude * speed * j1(k * speed) / k
    memory = np.pi * amplitude * (kernel * slip_rate) @ past_weight
    stress = 0.5 * k * (memory - static_stiffness(mode, ETA) * slip)
    stress -= 0.5 * np.pi * amplitude * speed**2 * j0(k * speed)
    inside = np.sum(k_weight * stress * np.exp(-0.5 * (k * width) ** 2)) / np.pi
    # 1e-6 is the kernel's tolerance; the quadrature alone leaves 1e-8.
    assert inside == pytest.approx(-1.0, abs=1e-6)


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
    w, w_fast, J = bessel_tail(t), bessel_tail(e * t), mpmath.besselj
    slow = 2 * w - J(1, t) - 2 * t * J(0, t)
    fast = 2 * t / e * J(0, e * t) - 2 / e**2 * (w_fast - J(1, e * t))
    return slow + fast - 2 * t**2 * (w_fast - w)


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
    assert kernel.poles.size <= (10 if mode == "III" else 24)  # or one less


def test_a_real_pole_has_a_weight():
    """The sine beside it is zero, and the basis of both is singular."""
    times = np.linspace(0.0, 5.0, 40)
    fit = _Polish(times, 0.7 * np.exp(-times))
    _, _, weights, residual = fit.project(np.array([-1.0 + 0.0j]), 1.0 + times)
    assert weights == pytest.approx([0.7])
    assert np.abs(residual).max() < 1e-14


# Strips are narrow, and solids soft, where only waves count.

LENGTH, NODES = 0.024, 64


@pytest.mark.parametrize(("mode", "loading_rate"), [("II", 1e7), ("III", 1e9)])
def test_fields_along_one_axis_are_those_of_the_line(mode, loading_rate):
    along, turn = (0, 1) if mode == "II" else (1, -1)
    still = 1 - along
    shape, lengths = (NODES, 8)[::turn], (LENGTH, LENGTH / 8)[::turn]
    line = make_problem(NODES, LENGTH, solid=QUARTER, weakening_rate=RATE, mode=mode)
    plane = make_problem(shape, lengths, solid=QUARTER, weakening_rate=RATE)
    x = line.interface.x
    tau_p = 1e6 - 2e5 * np.exp(-(((x - 0.008) / 0.0025) ** 2)) + 3e4 * np.cos(2900.0 * x)
    on_plane = np.array(np.broadcast_to(np.expand_dims(tau_p, still), shape))
    method = st.Rupture(loading_rate=loading_rate)
    step = min(method.medium(problem).step for problem in (line, plane))
    one, two = (
        st.simulate_rupture(
            problem, profile, method=with_step(method, problem, step), save=st.Save(every=1)
        )
        for problem, profile in ((line, tau_p), (plane, on_plane))
    )
    assert int(one.explicit_steps) > 100
    assert (int(one.implicit_steps) > 50) == (loading_rate < 1e8)
    assert one.sizes["time"] == two.sizes["time"]
    for name in ("slip", "slip_rate", "shear_stress"):
        exact, found = one[name].values, two[name].values
        across = found.take(3, 1 + still)
        # Round-off; rounded otherwise, implicit steps stop at slightly different residuals.
        close = 1e-11 if loading_rate > 1e8 else 1e-8
        assert np.abs(across - exact).max() <= close * np.abs(exact).max()
        assert found.std(axis=1 + still).max() <= 1e-10 * np.abs(exact).max()
    for name in ("critical_position", "median_rupture_speed"):
        assert two[name].values[along] == pytest.approx(float(one[name]), rel=1e-6)
    # On a plane of another width, what is per length of a line is whole.
    for name in ("seismic_moment", "work", "strain_energy", "fracture_energy"):
        whole = one[name].values[-1] * lengths[still]
        assert two[name].values[-1] == pytest.approx(whole, rel=1e-6)
        assert two[name].attrs["units"] == {"N": "N m", "J/m": "J"}[one[name].attrs["units"]]


def medium_of(ratio, lengths, nodes):
    """Solid of a Poisson ratio, and what ruptures of all samples share on a plane of it."""
    solid = dataclasses.replace(QUARTER, poisson_ratio=ratio)
    problem = make_problem(nodes, lengths, solid=solid, weakening_rate=5e10)
    return solid, st.Rupture(loading_rate=1.0).medium(problem)


def weights_of(grid, share):
    """Weights of the exponentials for a wave of that share of mode II."""
    return np.where(np.arange(grid.poles.size) < grid.split, share, 1.0 - share) * grid.weights


@pytest.mark.parametrize("ratio", [-0.3, 0.45])
def test_kernels_of_wave_vectors_are_the_exact_ones(ratio):
    """a C_II + b C_III from the arcs, a = (kx/k)², at all times up to 1e5."""
    solid, medium = medium_of(ratio, (0.01, 0.006), (12, 10))
    grid, eta = medium.grid, solid.wave_speed_ratio
    kx, ky = (k.ravel() for k in np.broadcast_arrays(*medium.interface.wave_vectors))
    times = np.concatenate([[0.0], np.geomspace(1e-3, 1e5, 200)])
    for q in (1, 7, 20, 33, 50):
        k = float(np.hypot(kx[q], ky[q]))
        share = kx[q] ** 2 / k**2
        slot = grid.entry[q]
        assert grid.mode_two[slot] == pytest.approx(share, abs=1e-14)
        found = (np.exp(np.outer(times, grid.poles)) @ weights_of(grid, share)).real
        exact = share * memory_kernel(times, "II", eta)
        exact += (1.0 - share) * memory_kernel(times, "III", eta)
        assert np.abs(found - exact).max() < 1.5e-6  # 1e-6 is asked for of each
        static = share * static_stiffness("II", eta) + 1.0 - share
        assert grid.stiffness[0, q] == pytest.approx(0.5e9 * k * static, rel=1e-12)
        assert grid.frequency[slot] == pytest.approx(k * solid.shear_wave_speed, rel=1e-12)


@pytest.mark.parametrize(
    ("ratio", "lengths"), [(0.0, (0.01, 0.004)), (0.45, (0.01, 0.01)), (0.45, (0.01, 0.004))]
)
def test_no_wave_of_the_grid_grows_at_the_largest_step(ratio, lengths):
    solid, medium = medium_of(ratio, lengths, (16, 16))
    grid = medium.grid
    for slot in range(1, grid.frequency.size, 3):
        share = grid.mode_two[slot]
        kernel = ExponentialSum(grid.poles, weights_of(grid, share), 0.0)
        static = share * static_stiffness("II", solid.wave_speed_ratio) + 1.0 - share
        step = amplification(grid.frequency[slot] * medium.largest_step, kernel, static)
        assert np.abs(np.linalg.eigvals(step)).max() < 1.0 + 1.1e-5


@functools.cache
def step_response(share, time):
    """Slip of a mode on a free interface under a unit stress from t = 0 on, times G k/2.

    Inverse transform of 1/(s D(s)), D = a D_II + b D_III; time is k c_s t.
    """
    eta = QUARTER.wave_speed_ratio

    def transform(s):
        across = (1 - share) * mode_three_stiffness(s)
        return 1 / (s * (share * mode_two_stiffness(s, eta) + across))

    return from_laplace(transform, time)


def point_load(steps, end, plane, load):
    """Slip on a freely sliding plane, less its mean, after a stress was put on it at t = 0."""
    friction = st.LinearWeakening(weakening_rate=1e9, residual_strength=1e6)
    problem = st.Problem(QUARTER, plane, friction, st.Load(initial_stress=load))
    begin = np.full(plane.shape, 1e-3)
    _, state = stepped(problem, np.full(plane.shape, 1.001e6), 2e6, end, steps, begin)
    slip = state.slip.reshape(plane.shape)
    return slip - slip.mean()


def test_a_point_load_spreads_as_the_exact_waves_with_second_order():
    """Like Lamb's problem, with slip across the load held: mode by mode by Laplace inversion."""
    plane = st.Interface(length=(0.1, 0.08), nodes=(12, 10))
    x, y = np.meshgrid(*plane.coordinates.values(), indexing="ij")
    load = 1e5 * np.exp(-(((x - 0.05) / 0.012) ** 2) - ((y - 0.04) / 0.012) ** 2)
    k, share = plane.wavenumbers, plane.in_plane_share
    speed = QUARTER.shear_wave_speed
    end = 1.5 / (k[0, 1] * speed)
    response = np.zeros(k.shape)
    for at in zip(*np.nonzero(k), strict=True):
        value = step_response(round(share[at], 12), round(k[at] * speed * end, 9))
        response[at] = 2.0 * value / (QUARTER.shear_modulus * k[at])
    exact = plane.inverse_transform(response * plane.transform(load))
    errors = [
        np.abs(point_load(steps, end, plane, load) - exact).max() / np.abs(exact).max()
        for steps in (30, 60, 120)
    ]
    assert_second_order(errors, 0.5)
    assert errors[2] < 3e-5
    # Along the load waves run ahead at c_d, across it at c_s: the response is no circle.
    assert abs(exact[6 + 3, 5]) != pytest.approx(abs(exact[6, 5 + 3]), rel=0.05)

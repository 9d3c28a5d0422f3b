"""Elastodynamics of a plane with a known answer: lines, exact kernels, a point load."""

import dataclasses
import functools

import numpy as np
import pytest
from checks import assert_second_order
from oracles import from_laplace, mode_three_stiffness, mode_two_stiffness
from ruptures import stepped, with_step
from setups import QUARTER, RATE, make_problem

import stiction as st
from stiction.elasticity.memory_kernels import ExponentialSum, memory_kernel, static_stiffness
from stiction.methods.dynamics.medium import amplification
from stiction.methods.dynamics.simulate import simulate_rupture

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
        simulate_rupture(
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
    plane = st.Interface(length=(0.1, 0.08), nodes=(16, 12))
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
    assert abs(exact[8 + 4, 6]) != pytest.approx(abs(exact[8, 6 + 4]), rel=0.05)

"""Elastodynamics of a plane with a known answer: lines, exact kernels, a point load."""

import dataclasses
import functools

import mpmath
import numpy as np
import pytest
from setups import from_laplace, mode_two_stiffness

import stiction as st
from stiction.dynamics.medium import amplification
from stiction.dynamics.method import make_run
from stiction.dynamics.simulate import simulate_rupture
from stiction.elasticity.exponential_sum import ExponentialSum
from stiction.elasticity.memory_kernels import memory_kernel, static_stiffness

# Strips are narrow, and solids soft, where only waves count.
pytestmark = pytest.mark.filterwarnings("ignore::stiction.UnitWarning")

SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0)
FRICTION = st.LinearWeakening(weakening_rate=0.5e12)
GENTLE = st.LinearWeakening(weakening_rate=5e10)
LENGTH, NODES = 0.024, 64


@pytest.mark.parametrize("rate", [1e7, 1e9], ids=["implicit and explicit", "explicit"])
@pytest.mark.parametrize("mode", ["II", "III"])
def test_fields_along_one_axis_are_those_of_the_line(mode, rate):
    line = st.Problem(SOLID, st.Interface(length=LENGTH, nodes=NODES), FRICTION, mode=mode)
    turn = 1 if mode == "II" else -1
    shape, lengths = (NODES, 8)[::turn], (LENGTH, LENGTH / 8)[::turn]
    plane = st.Problem(SOLID, st.Interface(length=lengths, nodes=shape), FRICTION)
    x = line.interface.x
    tau_p = 1e6 - 2e5 * np.exp(-(((x - 0.008) / 0.0025) ** 2)) + 3e4 * np.cos(2900.0 * x)
    on_plane = np.broadcast_to(tau_p[:, None] if mode == "II" else tau_p[None, :], shape)
    method = st.Rupture(loading_rate=rate)
    step = min(method.medium(problem).step for problem in (line, plane))
    method = dataclasses.replace(method, time_step=step)
    options = {"method": method, "progress": False, "save": st.Save(every=1)}
    one = simulate_rupture(line, tau_p, **options)
    two = simulate_rupture(plane, np.array(on_plane), **options)
    assert int(one.explicit_steps) > 100
    assert (int(one.implicit_steps) > 50) == (rate < 1e8)
    assert one.sizes["time"] == two.sizes["time"]
    for name in ("slip", "slip_rate", "shear_stress"):
        across = two[name].isel({"y" if mode == "II" else "x": 3}).values
        # Round-off; rounded otherwise, implicit steps stop at slightly different residuals.
        close = 1e-11 if rate > 1e8 else 1e-8
        assert np.abs(across - one[name].values).max() <= close * np.abs(one[name].values).max()
        spread = two[name].values.std(axis=2 if mode == "II" else 1)
        assert spread.max() <= 1e-10 * np.abs(one[name].values).max()
    along = 0 if mode == "II" else 1
    for name in ("critical_position", "rupture_speed"):
        assert two[name].values[along] == pytest.approx(float(one[name]), rel=1e-6)
    # On a plane of another width, what is per length of a line is whole.
    width = lengths[1 - along]
    for name in ("seismic_moment", "work", "strain_energy", "fracture_energy"):
        assert two[name].values[-1] == pytest.approx(one[name].values[-1] * width, rel=1e-6)
        assert two[name].attrs["units"] == {"N": "N m", "J/m": "J"}[one[name].attrs["units"]]


@pytest.mark.parametrize("ratio", [-0.3, 0.0, 0.25, 0.45])
def test_kernels_of_wave_vectors_are_the_exact_ones(ratio):
    """a C_II + b C_III from the arcs, a = (kx/k)², at all times up to 1e5."""
    solid = dataclasses.replace(SOLID, poisson_ratio=ratio)
    plane = st.Interface(length=(0.01, 0.006), nodes=(12, 10))
    grid = st.Rupture(loading_rate=1.0).medium(st.Problem(solid, plane, GENTLE)).grid
    kx, ky = np.broadcast_arrays(*plane.wave_vectors)
    times = np.concatenate([[0.0], np.geomspace(1e-3, 1e5, 200)])
    for q in (1, 7, 20, 33, 50):
        k = float(np.hypot(kx.ravel()[q], ky.ravel()[q]))
        share = kx.ravel()[q] ** 2 / k**2
        slot = grid.entry[q]
        assert grid.mode_two[slot] == pytest.approx(share, abs=1e-14)
        parts = np.where(np.arange(grid.poles.size) < grid.split, share, 1.0 - share)
        found = (np.exp(np.outer(times, grid.poles)) @ (parts * grid.weights)).real
        eta = solid.wave_speed_ratio
        exact = share * memory_kernel(times, "II", eta)
        exact += (1.0 - share) * memory_kernel(times, "III", eta)
        assert np.abs(found - exact).max() < 1.5e-6  # 1e-6 is asked for of each
        static = share * static_stiffness("II", eta) + 1.0 - share
        assert grid.stiffness[0, q] == pytest.approx(0.5e9 * k * static, rel=1e-12)
        assert grid.frequency[slot] == pytest.approx(k * solid.shear_wave_speed, rel=1e-12)


@pytest.mark.parametrize("ratio", [0.0, 0.25, 0.45])
@pytest.mark.parametrize("lengths", [(0.01, 0.01), (0.01, 0.004)])
def test_no_wave_of_the_grid_grows_at_the_largest_step(ratio, lengths):
    solid = dataclasses.replace(SOLID, poisson_ratio=ratio)
    problem = st.Problem(solid, st.Interface(length=lengths, nodes=(16, 16)), GENTLE)
    medium = st.Rupture(loading_rate=1.0).medium(problem)
    grid, eta = medium.grid, solid.wave_speed_ratio
    for slot in range(1, grid.frequency.size, 3):
        share = grid.mode_two[slot]
        parts = np.where(np.arange(grid.poles.size) < grid.split, share, 1.0 - share)
        kernel = ExponentialSum(grid.poles, parts * grid.weights, 0.0)
        static = share * static_stiffness("II", eta) + 1.0 - share
        step = amplification(grid.frequency[slot] * medium.largest_step, kernel, static)
        assert np.abs(np.linalg.eigvals(step)).max() < 1.0 + 1.1e-5


@functools.cache
def step_response(share, time):
    """Slip of a mode on a free interface under a unit stress from t = 0 on, times G k/2.

    Inverse transform of 1/(s D(s)), D = a D_II + b D_III; time is k c_s t.
    """
    eta = SOLID.wave_speed_ratio

    def transform(s):
        across = mpmath.sqrt(s - 1j) * mpmath.sqrt(s + 1j)
        return 1 / (s * (share * mode_two_stiffness(s, eta) + (1 - share) * across))

    return from_laplace(transform, time)


def point_load(steps, end, plane, load):
    """Slip on a freely sliding plane, less its mean, after a stress was put on it at t = 0."""
    friction = st.LinearWeakening(weakening_rate=1e9, residual_strength=1e6)
    problem = st.Problem(SOLID, plane, friction, st.Load(initial_stress=load))
    method = st.Rupture(
        load=([0.0, 1.0], [2e6, 2e6]), stop="time", end_time=1.0, implicit=False,
        time_step=end / steps,
    )  # fmt: skip
    rows = problem.sample(np.full(plane.shape, 1.001e6), accept=("overstress",))
    run = make_run(method, problem.friction, method.medium(problem), rows, 0)
    state = run.start(0.0, np.full(plane.shape, 1e-3))
    run.advance(state, steps)
    slip = state.slip.reshape(plane.shape)
    return slip - slip.mean()


def test_a_point_load_spreads_as_the_exact_waves_with_second_order():
    """Like Lamb's problem, with slip across the load held: mode by mode by Laplace inversion."""
    plane = st.Interface(length=(0.1, 0.08), nodes=(16, 12))
    x, y = np.meshgrid(*plane.coordinates.values(), indexing="ij")
    load = 1e5 * np.exp(-(((x - 0.05) / 0.012) ** 2) - ((y - 0.04) / 0.012) ** 2)
    k, share = plane.wavenumbers, plane.in_plane_share
    end = 1.5 / (k[0, 1] * SOLID.shear_wave_speed)
    response = np.zeros(k.shape)
    for entry in np.ndindex(k.shape):
        if k[entry] > 0.0:
            time = k[entry] * SOLID.shear_wave_speed * end
            value = step_response(round(float(share[entry]), 12), round(float(time), 9))
            response[entry] = 2.0 * value / (SOLID.shear_modulus * k[entry])
    exact = plane.inverse_transform(response * plane.transform(load))
    errors = [
        np.abs(point_load(steps, end, plane, load) - exact).max() / np.abs(exact).max()
        for steps in (30, 60, 120)
    ]
    # Order 2: a factor 4 a halving.
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.5)
    assert errors[1] / errors[2] == pytest.approx(4.0, abs=0.5)
    assert errors[2] < 3e-5
    # Along the load waves run ahead at c_d, across it at c_s: the response is no circle.
    spread = [np.abs(exact[8 + 4, 6]), np.abs(exact[8, 6 + 4])]
    assert spread[0] != pytest.approx(spread[1], rel=0.05)

"""Orders of accuracy of a whole rupture: in time step, in spacing, of the energy balance."""

import numpy as np
import pytest

import stiction as st
from stiction.dynamics.energies import energy_balance
from stiction.dynamics.method import Rupture, make_run

END = 40e-6


def rupture(nodes, steps):
    """A weak spot that breaks a whole interface at constant load; slip and radiated energy."""
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0, plane="strain")
    interface = st.Interface(length=0.1, nodes=nodes)
    friction = st.LinearWeakening(weakening_rate=2e11, residual_strength=2e5)
    problem = st.Problem(solid, interface, friction)
    strength = 1e6 - 0.35e6 * np.exp(-(((interface.x - 0.05) / 0.012) ** 2))
    method = Rupture(
        load=([0.0, 1.0], [7.5e5, 7.5e5]), stop="time", end_time=1.0, implicit=False,
        time_step=END / steps,
    )  # fmt: skip
    run = make_run(
        method, problem.friction, method.medium(problem), problem.sample(strength), 0
    )
    state = run.start(0.0)
    run.advance(state, steps)
    balance = energy_balance(problem.friction, run.setting.nodes, run.medium.grid, state)
    return state, balance["radiated_energy"]


def test_slip_and_radiated_energy_converge_with_second_order_in_time():
    reference, energy = rupture(256, 8000)
    assert reference.now["slid"] == 256
    slips, energies = [], []
    for steps in (500, 1000, 2000):
        state, radiated = rupture(256, steps)
        slips.append(np.abs(state.slip - reference.slip).max() / reference.slip.max())
        energies.append(abs(radiated / energy - 1.0))
    # Order 2 is a factor 4; the reference's own error (1/64 of the last) and nodes that stop and
    # go between steps leave it between 3.7 and 4.4.
    for errors in (slips, energies):
        assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.6)
        assert errors[1] / errors[2] == pytest.approx(4.0, abs=0.6)
    assert slips[2] < 3e-4
    assert energies[2] < 1e-4


def test_slip_converges_with_second_order_in_space():
    reference, _ = rupture(2048, 3000)
    errors = []
    for nodes in (128, 256, 512):
        state, _ = rupture(nodes, 3000)
        fine = reference.slip[:: 2048 // nodes]
        errors.append(np.abs(state.slip - fine).max() / fine.max())
    # Second order in dx is a factor 4, with the kink of the law at d_c between 3.4 and 4.6.
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.8)
    assert errors[1] / errors[2] == pytest.approx(4.0, abs=0.8)


@pytest.mark.slow
def test_implicit_steps_approach_the_explicit_solution():
    """The same slow onset by explicit steps only, and by implicit steps of two sizes."""
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress")
    interface = st.Interface(length=0.05, nodes=128)
    problem = st.Problem(solid, interface, st.LinearWeakening(weakening_rate=2e11))
    strength = 1e6 - 3e5 * np.exp(-(((interface.x - 0.025) / 0.01) ** 2))
    rows = problem.sample(strength)

    def stress(**options):
        solver = Rupture(loading_rate=1e8, **options).prepare(problem)
        return float(solver(rows)["critical_stress"][0])

    exact = stress(implicit=False)
    coarse = abs(stress(slip_step=0.06, load_step=4e-3) / exact - 1.0)
    fine = abs(stress(slip_step=0.0075, load_step=5e-4) / exact - 1.0)
    # Default steps are between the two; 1e-4 is what the onset is asked to be good for.
    assert coarse < 3e-4
    assert fine < 5e-5

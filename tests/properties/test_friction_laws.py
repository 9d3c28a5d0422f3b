"""What ruptures do whatever the friction law, and what depends on its shape."""

import dataclasses

import numpy as np
import pytest
from ruptures import dip, wavy_line
from setups import QUARTER, make_problem

import stiction as st

GAMMA = {"fracture_energy": 2.5, "residual_strength": 0.2e6}
LAWS = {
    "linear": st.LinearWeakening(**GAMMA),
    "exponential": st.ExponentialWeakening(**GAMMA),
    "bilinear": st.PiecewiseWeakening(slip=[0.1, 1.0], strength=[0.4, 0.0], **GAMMA),
    "steepening": st.PiecewiseWeakening(slip=[0.4, 1.0], strength=[0.8, 0.0], **GAMMA),
}


@pytest.fixture(scope="module")
def runs():
    """A weak spot breaks an interface of 512 nodes, with the same fracture energy for each law."""
    method = st.Rupture(loading_rate=1e8, kernel_tolerance=1e-4, courant=0.25)
    save = st.Save(["slip", "slip_rate", "shear_stress", "strength"], every=1)
    found = {}
    for name, law in LAWS.items():
        problem = make_problem(512, solid=QUARTER, friction=law, mode="III")
        strength = 1e6 - 0.4e6 * dip(problem.interface, 0.05, 0.015)
        found[name] = st.simulate_rupture(problem, strength, method=method, save=save)
    return found


@pytest.mark.parametrize("name", LAWS)
def test_energies_balance(runs, name):
    run, law = runs[name], LAWS[name]
    spacing = run.x.values[1]
    slip, stress, load = run.slip.values, run.shear_stress.values, run["load"].values
    # What friction dissipates, summed from the stress that slides, step by step.
    sheared = 0.5 * (stress[1:] + stress[:-1]) * np.diff(slip, axis=0)
    friction = np.cumsum(sheared.sum(axis=1)) * spacing
    dissipated = run.fracture_energy.values + 0.2e6 * slip.sum(axis=1) * spacing
    # Trapezia over steps in which the fastest nodes weaken by a tenth: off at corners.
    assert friction[-1] == pytest.approx(dissipated[-1], rel=1e-3)
    pushed = 0.5 * (load[1:] + load[:-1]) * np.diff(slip.sum(axis=1)) * spacing
    assert run.work.values[-1] == pytest.approx(pushed.sum(), rel=1e-3)
    radiated = run.radiated_energy.values
    np.testing.assert_allclose(
        run.work - dissipated - run.strain_energy, radiated, atol=1e-9 * run.work.values[-1]
    )
    assert (np.diff(radiated) > -1e-4 * radiated[-1]).all()
    # All of it is spent, up to the last per cent of strength of a law that never ends.
    assert run.stopped == "sliding"
    left = 0.01 if name == "exponential" else 1e-12
    assert run.fracture_energy.values[-1] == pytest.approx(0.25, rel=left)
    assert law.reach > 0.0


def test_the_front_reaches_a_node_that_does_not_weaken_when_it_first_slips():
    problem, strength = wavy_line()
    firm = np.arange(60, 70)
    residual = np.full(128, 2e5)
    residual[firm] = strength[firm]
    friction = st.LinearWeakening(weakening_rate=0.2e12, residual_strength=residual)
    problem = dataclasses.replace(problem, friction=friction)
    method = st.Rupture(loading_rate=1e8)
    run = st.simulate_rupture(problem, strength, method=method, save=st.Save(["slip"], every=1))
    first = np.argmax(run.slip.values[:, firm] > 0.0, axis=0)
    arrival, time = run.arrival_time.values[firm], run.time.values
    round_off = 1e-9 * time[-1]
    assert np.all(arrival >= time[first - 1] - round_off)
    assert np.all(arrival <= time[first] + round_off)

"""How fast a rupture runs on a uniform interface."""

import numpy as np
from setups import QUARTER, make_problem

import stiction as st
from stiction.methods.dynamics.simulate import simulate_rupture
from stiction.methods.dynamics.summary import rupture_speed

RATE, STRENGTH = 1e12, 1e6


def final_speed(ratio, nodes):
    """Speed in c_R of a rupture on a uniform interface at S = ratio, far from its weak patch."""
    modulus = QUARTER.effective_modulus("II")
    spacing = 1.158 * modulus / RATE / 16.0
    problem = make_problem(nodes, nodes * spacing, solid=QUARTER, weakening_rate=RATE)
    load = STRENGTH / (1.0 + ratio)
    griffith = 2.0 * modulus * STRENGTH**2 / (np.pi * RATE * load**2)
    x = problem.interface.x - 0.5 * problem.interface.length
    run = simulate_rupture(
        problem,
        np.where(np.abs(x) < 0.75 * griffith, 0.98 * load, STRENGTH),
        method=st.Rupture(load=([0.0, 1.0], [load, load]), implicit=False),
        save=st.Save([], every=1000),
    )
    speed = rupture_speed(run["arrival_time"].values, spacing, problem.nucleation_length)
    at = nodes // 2 + np.arange(int(0.38 * nodes), int(0.42 * nodes))
    return float(np.mean(speed[at])) / QUARTER.rayleigh_wave_speed


def test_weak_driving_tends_to_the_rayleigh_speed_from_below():
    near, far = final_speed(2.0, 512), final_speed(2.0, 1024)
    assert near < far < 1.0
    assert far > 0.97

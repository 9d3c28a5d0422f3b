"""The paper's onsets and fronts: bias of the local criterion, patches, the lower tail, speeds."""

import math

import numpy as np
import pytest
from importance import by_importance, longer
from setups import LOCAL, QUARTER, beta_strength, exact_onset, local_onset, make_problem

import stiction as st
from stiction.methods.dynamics.simulate import simulate_rupture
from stiction.methods.dynamics.summary import rupture_speed


@pytest.mark.parametrize(
    ("ratio", "expected", "patches"), [(0.25, 4.1e3, 27.0), (1.0, 0.3e3, 2.8)]
)
def test_bias_of_the_local_criterion(ratio, expected, patches):
    """Mean of local minus exact (Pa) and slipping patches at onset; G* = G/(1-nu), n = 1024."""
    problem = make_problem(1024)
    strength = beta_strength(ratio * problem.nucleation_length)
    tau_p = strength.sample(problem.interface, samples=1000, seed=20)
    exact, local = exact_onset(problem, tau_p), local_onset(problem, tau_p)
    bias = (local.critical_load - exact.first_instability).values
    error = bias.std() / np.sqrt(1000.0)
    # Four standard errors, and the rounding of the expected figures (two digits, or one).
    assert abs(bias.mean() - expected) < 4.0 * error + 0.1e3 * (ratio < 2) + 0.01e3
    count = exact.slip_patches.values
    assert abs(count.mean() - patches) < 4.0 * count.std() / np.sqrt(1000.0) + 0.5 * (ratio < 1)
    # The grid's own local bound is strict; the continuous one is 1e-4 MPa lower at worst.
    assert bias.min() > -2e2
    assert np.all(exact.certificate_gap < 1e-9 * exact.critical_load)


@pytest.mark.slow
def test_the_weakest_link_rule_holds_with_a_mean_mode_and_fails_without():
    """At P of a few 1e-9 survival to the power of the length is linear: a factor of four."""
    problem = st.paper.problem(nodes=512)
    own = st.paper.strength(problem, 0.5)

    def growth(mean_mode):
        field = st.RandomField(own.marginal, own.spectrum, mean_mode)
        short, long = (
            by_importance(one, field, 0.66035e6, LOCAL, 0.07)
            for one in (problem, longer(problem, 4))
        )
        return long.probability / short.probability, math.hypot(short.cv, long.cv)

    ratio, error = growth(True)
    # Three standard errors, 0.3 in all.
    assert abs(math.log(ratio / 4.0)) < 3.0 * error
    # A dip at fixed mean of z has to be paid for; a longer interface can better afford it.
    ratio, error = growth(False)
    assert ratio > 4.0 * math.exp(2.0 * error)


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
        method=st.Rupture(load_history=([0.0, 1.0], [load, load]), implicit=False),
        save=st.Save([], every=1000),
    )
    speed, _ = rupture_speed(run["arrival_time"].values, spacing, problem.nucleation_length)
    at = nodes // 2 + np.arange(int(0.38 * nodes), int(0.42 * nodes))
    return float(np.mean(speed[at])) / QUARTER.rayleigh_wave_speed


def test_weak_driving_tends_to_the_rayleigh_speed_from_below():
    near, far = final_speed(2.0, 512), final_speed(2.0, 1024)
    assert near < far < 1.0
    assert far > 0.97

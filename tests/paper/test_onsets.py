"""The paper's onsets: bias of the local criterion, patches, and the lower tail."""

import math

import numpy as np
import pytest
from importance import by_importance, longer
from setups import LOCAL, beta_strength, exact_onset, local_onset, make_problem

import stiction as st


@pytest.mark.parametrize(
    ("ratio", "expected", "patches"),
    [(0.25, 4.1e3, 27.0), (1.0, 0.3e3, 2.8)],
)
def test_bias_of_the_local_criterion(ratio, expected, patches):
    """Mean of local minus exact (Pa) and slipping patches at onset; G* = G/(1-nu), n = 1024."""
    problem = make_problem(1024)
    strength = beta_strength(ratio * problem.nucleation_length, truncation=2.5)
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

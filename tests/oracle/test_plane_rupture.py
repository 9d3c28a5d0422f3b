"""Slow rupture on planes against the exact equilibrium onset."""

import numpy as np
import pytest
from setups import RATE, beta_strength, make_problem

import stiction as st

H_N = 2.0 * 0.57888694 * 1e9 / 0.67 / RATE


def onsets(nodes, lengths, ratio, samples):
    problem = make_problem((nodes, nodes), (lengths * H_N, lengths * H_N))
    tau_p = beta_strength(ratio * H_N).sample(problem.interface, samples=samples, seed=5)
    exact = st.onset(problem, tau_p, method=st.Equilibrium())
    slow = st.onset(problem, tau_p, method=st.Rupture(loading_rate=1e4, stop="onset"))
    return exact, slow


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
@pytest.mark.parametrize("ratio", [0.5, 1.0])
def test_first_instability_at_a_slow_rate_is_the_exact_equilibrium_onset(ratio):
    exact, slow = onsets(48, 5, ratio, 2)
    # Equilibrium brackets to 1e-6; inertia at 1e4 Pa/s and the sizes of implicit steps leave less.
    assert slow.first_instability.values == pytest.approx(
        exact.first_instability.values, rel=1e-5
    )
    apart = np.abs(slow.critical_position - exact.critical_position).max(axis=1).values
    # The same patch, perhaps around the period.
    assert np.all((apart < H_N) | (apart > 4.0 * H_N))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_twenty_samples_agree():
    exact, slow = onsets(80, 8, 0.5, 20)
    assert slow.first_instability.values == pytest.approx(
        exact.first_instability.values, rel=1e-5
    )

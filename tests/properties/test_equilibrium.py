"""Equilibrium: symmetries, bounds and monotonicity, for random profiles, rates and loads."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as hs
from setups import exact_onset, make_problem, turns

import stiction as st
from stiction.methods.equilibrium.dense.search import DenseSearch
from stiction.methods.equilibrium.solver import sample_of

NODES = 96
ANGLE = turns(NODES)


def profile(seed, roughness):
    """Positive random profile around 1e6 Pa: modes falling like j^-roughness."""
    rng = np.random.default_rng(seed)
    spectrum = np.zeros(NODES // 2 + 1, dtype=complex)
    j = np.arange(1, NODES // 2)
    spectrum[1 : NODES // 2] = (rng.standard_normal((2, j.size)).T @ [1, 1j]) * j**-roughness
    field = np.fft.irfft(spectrum, NODES)
    return 1e6 * (1.0 + 0.4 * field / np.abs(field).max())


def problem_of(length, wave=0.0, varying=False):
    weakening_rate = 0.5e12 * (1.0 + 0.5 * np.cos(2 * ANGLE)) if varying else 0.5e12
    load = st.Load(profile=1.0 + wave * np.sin(ANGLE)) if wave else st.Load()
    return make_problem(NODES, length, load=load, weakening_rate=weakening_rate)


lengths = hs.floats(2e-3, 0.04)  # half a critical patch to twelve of them
problems = hs.builds(problem_of, lengths, hs.sampled_from([0.0, 0.3]), hs.booleans())
uniform_problems = hs.builds(problem_of, lengths)
profiles = hs.builds(profile, hs.integers(0, 10**6), hs.floats(0.0, 2.0))


def solve(problem, tau_p):
    return exact_onset(problem, tau_p, sensitivity=True, slip=True)


@settings(max_examples=50, deadline=None)
@given(problem=problems, tau_p=profiles)
def test_gap_closes_and_bounds_hold(problem, tau_p):
    onset = solve(problem, tau_p)
    load, slip = onset.first_instability.item(), onset.slip.values[0]
    assert onset.certificate_gap.item() < 1e-9 * load
    assert slip.min() >= 0.0
    y = onset.sensitivity.values[0]
    mean = np.mean(problem.load.profile)
    # What is mean stress must be the mean of the load: <p, y> = <p>, at no residual node.
    if not np.any(slip >= tau_p / np.asarray(problem.friction.weakening_rate) * (1 - 1e-9)):
        np.testing.assert_allclose(y @ np.broadcast_to(problem.load.profile, NODES), mean)
    # A uniform field is a multiplier: the load factor is at most <s>/<p>.
    assert onset.critical_load.item() * mean <= tau_p.mean() * (1.0 + 1e-12)
    assert onset.critical_load.item() * mean >= load * (1.0 - 1e-12)


@settings(max_examples=30, deadline=None)
@given(problem=uniform_problems, tau_p=profiles)
def test_never_above_the_discrete_local_criterion(problem, tau_p):
    search = DenseSearch(problem)
    bound, _ = search.bound(sample_of(problem.sample(tau_p), search.pieces, 0))
    onset = solve(problem, tau_p)
    assert onset.first_instability.item() <= bound * (1.0 + 1e-13)


@settings(max_examples=15, deadline=None)
@given(problem=problems, tau_p=profiles)
def test_slip_grows_with_the_load_and_strength_is_kept(problem, tau_p):
    load = solve(problem, tau_p).critical_load.item()
    loads = load * np.array([0.6, 0.8, 0.9, 0.97, 0.9999])
    path = st.equilibrium_path(problem, tau_p, loads)
    slip, stress = path.slip.values, path.stress.values
    assert np.diff(slip, axis=0).min() >= -1e-15
    strength = np.maximum(tau_p - np.asarray(problem.friction.weakening_rate) * slip, 0.0)
    # Where it slips the stress is the strength, elsewhere below: to 1e-10 of it.
    assert (stress - strength).max() < 1e-10 * load
    assert np.abs(stress - strength)[slip > 0.0].max(initial=0.0) < 1e-10 * load

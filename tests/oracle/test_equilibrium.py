"""Equilibrium against other algorithms: HiGHS, path following, transforms, relaxation."""

from dataclasses import replace

import numpy as np
import pytest
from oracles import largest_load, relaxed
from setups import SOLID, exact_onset, make_problem, turns

import stiction as st
import stiction.methods.equilibrium.dense.search
from stiction.methods.equilibrium.dense.search import DenseSearch
from stiction.methods.equilibrium.solver import follow_to_sliding, sample_of
from stiction.methods.equilibrium.state import PathStatus, Route, at_rest


def assert_first(problem, tau_p, weakening_rate=None):
    """The first instability is that of the linear programme; returns all results."""
    onset = exact_onset(problem, tau_p)
    weakening_rates = (
        [weakening_rate] * len(tau_p) if weakening_rate is None else weakening_rate
    )
    theirs = [
        largest_load(problem, *given)[0] for given in zip(tau_p, weakening_rates, strict=True)
    ]
    found = onset.critical_load if np.ndim(problem.load.profile) else onset.first_instability
    np.testing.assert_allclose(found, theirs, rtol=1e-11)
    return onset


@pytest.mark.parametrize("ratio", [0.25, 0.5, 1.0, 2.0])
def test_linear_programme_and_path_of_events(problem, make_strength, ratio):
    tau_p = make_strength(ratio).sample(problem.interface, samples=5, seed=7)
    loads = assert_first(problem, tau_p).first_instability.values
    rows, search = problem.sample(tau_p), DenseSearch(problem)
    for row, load in enumerate(loads):
        sample = sample_of(rows, search.pieces, row)
        found = search.next(sample, replace(at_rest(sample), route=Route.EVENTS))
        assert found.status == PathStatus.UNSTABLE
        assert found.load == pytest.approx(load, rel=1e-11)


def test_uniform_critical_slip(make_strength):
    problem = make_problem(critical_slip=2e-6)
    tau_p = make_strength(0.5).sample(problem.interface, samples=3, seed=9)
    assert_first(problem, tau_p, tau_p / 2e-6)


def test_interface_shorter_than_a_critical_patch(make_strength):
    # h_n is twice the period: no window is unstable by itself, yet the whole interface is.
    weakening_rate = 2.0 * 0.57888694185 * SOLID.effective_modulus() / 0.2
    problem = make_problem(128, weakening_rate=weakening_rate)
    tau_p = make_strength(2.0).sample(problem.interface, samples=4, seed=10)
    onset = assert_first(problem, tau_p)
    assert np.all(onset.first_instability.values <= tau_p.mean(axis=1) * (1 + 1e-12))


def test_transforms_agree_with_the_dense_factor(make_strength, monkeypatch):
    """Lines on which very many nodes slip are solved as planes are."""
    weakening_rate = 0.5e12 * (1.0 + 0.4 * np.sin(5 * turns(1024)))
    problem = make_problem(1024, weakening_rate=weakening_rate)
    search = DenseSearch(problem)
    rows = problem.sample(make_strength(0.25).sample(problem.interface, samples=3, seed=12))
    samples = [sample_of(rows, search.pieces, row) for row in range(3)]
    dense = [search.solve(sample) for sample in samples]
    monkeypatch.setattr(stiction.methods.equilibrium.dense.search, "MAX_WEAK_NODES", 10)
    for sample, exact in zip(samples, dense, strict=True):
        found = search.solve(sample)
        assert found.load == pytest.approx(exact.load, rel=1e-9)
        assert found.load != exact.load
        # At the optimum slip may be steep in the load; 1e-3 of d_c is far below any use of it.
        np.testing.assert_allclose(found.slip, exact.slip, atol=1e-3 * sample.critical.max())
        # Nodes at rest have no part in the multiplier.
        assert np.mean((found.direction > 0.0) == (exact.direction > 0.0)) > 0.99


def test_patches_alike_on_a_long_interface():
    """Thirty-two periods of a profile let go at the load of one: all patches are singular at once.

    By symmetry there is a multiplier with the period of the profile.
    """
    loads = []
    for periods in (1, 32):
        problem = make_problem(128 * periods, 0.0135 * periods)
        tau_p = np.tile(1e6 + 0.3e6 * np.cos(turns(128)), periods)
        search = DenseSearch(problem)
        loads.append(search.solve(sample_of(problem.sample(tau_p), search.pieces, 0)).load)
    assert loads[1] == pytest.approx(loads[0], rel=1e-11)


def test_events_against_relaxation(problem, make_strength):
    """A wide range of strength: nodes reach the floor, patches are arrested."""
    strength = make_strength(0.5, low=0.1e6, high=4.0e6)
    tau_p = strength.sample(problem.interface, samples=3, seed=13)
    onset = exact_onset(problem, tau_p)
    assert onset.arrested_events.max() > 0
    for profile, load in zip(tau_p, onset.critical_load.values, strict=True):
        loads = load * np.array([0.8, 0.95, 0.999])
        path = st.equilibrium_path(problem, profile, loads)
        assert np.diff(path.slip, axis=0).min() >= -1e-15
        # Where it slips the stress is the strength, elsewhere below.
        strength = np.maximum(profile - problem.friction.weakening_rate * path.slip.values, 0.0)
        over = path.stress.values - strength
        assert over.max() < 1e-10 * load
        assert np.abs(over)[path.slip.values > 0.0].max() < 1e-10 * load
        for i in range(3):
            slip = relaxed(problem, profile, loads[i])
            assert slip is not None
            # Relaxation stops at increments of 1e-19 m, up to 1e4 of them away from the limit.
            np.testing.assert_allclose(path.slip.values[i], slip, atol=1e-14)
        assert relaxed(problem, profile, 1.001 * load) is None


@pytest.mark.parametrize("law", ["weakening_rate", "critical_slip"])
def test_nodes_that_do_not_weaken(make_strength, law):
    """Where tau_p is not above tau_r strength is constant; against relaxation with that law."""
    given = {} if law == "weakening_rate" else {"critical_slip": 3e-6}
    problem = make_problem(residual_strength=0.8e6, **given)
    tau_p = 2.0 * make_strength(0.5).sample(problem.interface, samples=2, seed=16) - 0.8e6
    constant = tau_p <= 0.8e6
    assert constant.any(axis=1).all()
    words = f"{100.0 * constant.mean():.3g} % of the nodes"
    with pytest.warns(st.AccuracyWarning, match=words):
        onset = exact_onset(problem, tau_p)
    assert np.all(onset.certificate_gap < 1e-9 * onset.critical_load)
    for profile, load in zip(tau_p, onset.critical_load.values, strict=True):
        # Close enough to see that weak nodes matter, and far enough for relaxation to end.
        assert relaxed(problem, profile, 0.9995 * load) is not None
        assert relaxed(problem, profile, 1.0005 * load) is None


def test_sliding_is_proved(problem, make_strength):
    """Without any length taken for unstoppable, the same loads and events."""
    tau_p = make_strength(0.5, high=2.66e6).sample(problem.interface, samples=200, seed=17)
    plain = exact_onset(problem, tau_p)
    search = DenseSearch(problem)
    # Griffith's length grows with the modulus, of which the test for arrest knows only here.
    search.runs = search.runs._replace(modulus=np.inf)
    rows = problem.sample(tau_p)
    paths = [
        follow_to_sliding(search, sample_of(rows, search.pieces, row)) for row in range(200)
    ]
    loads = [path.last.load for path in paths]
    np.testing.assert_allclose(plain.critical_load, loads, rtol=1e-12)
    np.testing.assert_array_equal(plain.arrested_events, [len(path.events) for path in paths])

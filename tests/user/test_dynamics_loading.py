"""Loads that fall, rest or run at extreme rates."""

import dataclasses
import functools
import warnings

import numpy as np
import pytest
import ruptures

import stiction as st
from stiction import AccuracyWarning, InputError
from stiction.dynamics import diagnostics
from stiction.dynamics.state import DIAGNOSTICS

PROBLEM, TAU_P = ruptures.wavy_line()
DETOUR = ([0.0, 0.1, 0.2, 0.3], [0.0, 7.75e5, 7.0e5, 9e5])
simulate = functools.partial(ruptures.simulate, PROBLEM, TAU_P)


@pytest.fixture(scope="module")
def exact():
    return st.onset(PROBLEM, TAU_P, method=st.Equilibrium())


@pytest.mark.parametrize("stop", ["sliding", "onset", "rest"])
def test_a_load_that_goes_down_and_up_again_is_no_instability(exact, stop):
    run = simulate(load=DETOUR, stop=stop)
    assert run.attrs["stopped"] == ("onset" if stop == "onset" else "sliding")
    assert int(run["arrested_events"]) == 0
    assert float(run["first_instability"]) == float(run["critical_stress"])
    # Reached at 2e6 Pa/s: inertia lifts it by 1e-5.
    assert float(run["critical_stress"]) == pytest.approx(
        float(exact.critical_stress[0]), rel=5e-5
    )


def test_a_load_that_stops_below_the_onset_lets_the_run_end():
    for last in (7.75e5, 7.65e5):
        run = simulate(load=([0.0, 0.1, 0.2], [0.0, 7.75e5, last]))
        assert run.attrs["stopped"] == "rest"
        assert np.isnan(float(run["kinetic_stress"]))
        assert float(run["time"][-1]) < 1.0
    run = simulate(load=([0.0, 0.1, 0.2], [0.0, 7.75e5, 7.75e5]), stop="time", end_time=10.0)
    assert float(run["time"][-1]) == pytest.approx(10.0)


def test_a_load_held_above_the_strength_from_the_start_breaks_it():
    run = simulate(load=([0.0, 1.0], [2e6, 2e6]))
    assert run.attrs["stopped"] == "sliding"
    assert np.all(np.isfinite(run["slip"].values))


def test_kinetic_stress_is_that_of_the_first_global_sliding():
    friction = st.LinearWeakening(weakening_rate=0.2e12, residual_strength=3e5)
    problem = dataclasses.replace(PROBLEM, friction=friction)
    load = ([0.0, 0.12, 0.1201, 0.1203, 0.121], [0.0, 1.2e6, 1.2e6, 1e5, 1e5])
    # Slides at its residual strength, is unloaded, and stands still at 0.1 MPa.
    options = {"load": load, "stop": "time", "end_time": 0.1206}
    run = ruptures.simulate(problem, TAU_P + 3e5, st.Save(every=100), **options)
    assert float(run["mean_stress"][-1]) == pytest.approx(1e5)
    # All at the residual strength; a node that sticks for a moment may carry a little less.
    assert float(run["kinetic_stress"]) == pytest.approx(3e5, rel=1e-3)
    drop = float(run["critical_stress"]) - float(run["kinetic_stress"])
    assert float(run["stress_drop"]) == drop
    assert int(run["arrested_events"]) == 0
    assert np.isnan(float(simulate(stop="onset")["stress_drop"]))


def test_a_first_instability_at_a_negative_mean_stress_is_kept(monkeypatch):
    """Where the initial stress pushes back elsewhere, the mean may be negative."""
    monkeypatch.setattr(diagnostics, "end_event", diagnostics.end_event.py_func)
    now = np.zeros(1, DIAGNOSTICS).view(np.recarray)[0]
    now.first_stress = now.kinetic_stress = -np.inf
    now.peak_stress = now.local_stress = -9.0
    now.scale = 1e4  # an event is a fall by 1
    events = [(-8.0, 0.0), (-9.5, 1.6), (-9.4, 0.0), (-6.0, 0.0), (-7.5, 2.0), (-5.9, 0.0)]
    for i, (mean, radiated) in enumerate(events):
        step = diagnostics.Step(float(i), 1.0, 0.0, 0.0, radiated, 0.0, 0, radiated, i)
        diagnostics.observe.py_func(now, 1.5, mean, step)
    assert now.first_stress == -8.0
    assert now.arrested == 2
    assert (now.peak_stress, now.peak_node) == (-5.9, 5)


def test_the_place_of_a_slow_onset_is_that_of_equilibrium():
    """Two fields whose creeping patches are about equally slow when the mean stress is largest."""
    problem = st.paper.problem(nodes=512)
    for ratio in (0.5, 2.0):
        tau_p = st.paper.strength(problem, correlation_ratio=ratio).sample(
            problem.interface, samples=1, seed=3, first=18
        )
        exact = st.onset(problem, tau_p, method=st.Equilibrium())
        found = st.onset(problem, tau_p, method=st.Rupture(loading_rate=1e3))
        nodes = (found.critical_position - exact.critical_position) / problem.interface.spacing
        # A node, and what the maximum moves while the mean stress falls by 1e-5.
        assert abs((nodes + 256) % 512 - 256) < 2.0


def test_rates_that_cannot_be_resolved_are_said(exact):
    with pytest.warns(AccuracyWarning, match="too late for floating-point times"):
        slow = st.onset(PROBLEM, TAU_P, method=st.Rupture(loading_rate=1e-2))
    assert float(slow.critical_stress[0]) == pytest.approx(
        float(exact.critical_stress[0]), rel=1e-9
    )
    assert np.isnan(slow.rupture_speed[0])
    with pytest.raises(InputError, match="first slip would come after"):
        st.onset(PROBLEM, TAU_P, method=st.Rupture(loading_rate=1e-300))
    with pytest.warns(
        AccuracyWarning, match="the load rises by 0.16 of .* use time_step=5e-09"
    ):
        fast = st.onset(PROBLEM, TAU_P, method=st.Rupture(loading_rate=1e12))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fine = st.onset(PROBLEM, TAU_P, method=st.Rupture(loading_rate=1e12, time_step=4.9e-9))
    # The peak is sampled by 18 steps.
    assert float(fast.critical_stress[0]) == pytest.approx(
        float(fine.critical_stress[0]), rel=1e-2
    )
    with pytest.raises(InputError, match="loading_rate: in one explicit step"):
        st.onset(PROBLEM, TAU_P, method=st.Rupture(loading_rate=1e15))

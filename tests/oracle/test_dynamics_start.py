"""Runs that begin at an equilibrium just below the onset, against runs from the first slip."""

import numpy as np
import pytest
from checks import assert_same
from ruptures import CROOKED, CROOKED_STRENGTH, radiated_energy, run_of
from setups import make_problem, within

import stiction as st
from stiction.methods.dynamics import slow_start as module
from stiction.methods.dynamics.slow_start import slow_start, static_search
from stiction.methods.equilibrium.solver import sample_of

PROBLEM = st.paper.problem(nodes=512)


def profiles(ratio, samples, first=0):
    field = st.paper.strength(PROBLEM, correlation_ratio=ratio)
    return field.sample(PROBLEM.interface, samples=samples, seed=0, first=first)


def solve(tau_p, problem=PROBLEM, **options):
    method = st.Rupture(**options)
    return method.prepare(problem)(problem.sample(tau_p, accept=method.accepts))


def both(tau_p, problem=PROBLEM, **options):
    """Onsets from the equilibrium and from rest."""
    return [solve(tau_p, problem, start=start, **options) for start in ("equilibrium", "rest")]


def assert_agree(near, rest, median=5e-5):
    """Twice as close as asked for, 1e-4 in the median and 5e-4 at worst; events the same.

    With half the step sizes a run from rest moves by 1e-5 at 2e7 Pa/s, at 2e8 by 6e-5.
    """
    for name in ("critical_stress", "first_instability"):
        apart = np.abs(near[name] / rest[name] - 1.0)
        assert np.median(apart) < median
        assert apart.max() < 2e-4
    assert np.all(rest["start_error"] == 0.0)
    assert near["arrested_events"] == pytest.approx(rest["arrested_events"], nan_ok=True)


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    ("ratio", "loading_rate", "samples"),
    [
        *((0.25, 2e8, 3), (0.5, 2e7, 3), (2.0, 2e5, 3)),
        *(pytest.param(r, v, 20, marks=SLOW) for r in (0.25, 1.0) for v in (2e5, 2e7, 2e8)),
    ],
)
def test_same_onset_as_from_rest(ratio, loading_rate, samples):
    near, rest = both(profiles(ratio, samples), loading_rate=loading_rate)
    assert_agree(near, rest)
    begun = near["start_error"] > 0.0
    assert begun.any()
    assert np.all(near["start_load"] < near["critical_load"])
    assert np.all(near["start_load"][begun] > rest["start_load"][begun])
    if samples == 3:
        assert np.all(near["implicit_steps"][begun] < 0.8 * rest["implicit_steps"][begun])


def test_with_an_event_arrested_before_the_onset():
    near, rest = both(profiles(0.5, 1, 819), loading_rate=2e7)
    assert_agree(near, rest, median=1e-4)  # of one; waves of the event scatter what follows
    assert near["start_error"][0] > 0.0
    assert near["arrested_events"][0] == rest["arrested_events"][0] == 1
    assert near["start_load"] < near["first_instability"] < 0.999 * near["critical_stress"]


def test_what_follows_the_onset_is_the_same():
    """Sliding, moment, energies, speeds: as close as the same rupture shifted in time by a step."""
    near, rest = both(profiles(1.0, 4), loading_rate=2e7)
    for name, share in {
        "critical_stress": 5e-5, "onset_time": 1e-4, "seismic_moment": 0.03,
        "radiated_energy": 0.03, "fracture_energy": 1e-3, "median_rupture_speed": 0.02,
    }.items():  # fmt: skip
        assert near[name] == pytest.approx(rest[name], rel=share), name


def test_the_estimate_bounds_the_error_and_grows_towards_the_onset(monkeypatch):
    """Trials that begin ever closer: where the estimate is above the solver's own error, it holds.

    The run's own error at 2e7 Pa/s, seen by halving its steps, is 1e-5 of the stress scale.
    """
    method = st.Rupture(loading_rate=2e7, stop="onset")
    tau_p, setting = profiles(0.5, 3), static_search(PROBLEM)
    rest = solve(tau_p, loading_rate=2e7, stop="onset", start="rest")["critical_stress"]
    monkeypatch.setattr(module, "_MAX_ERROR", 1.0)
    for strength, exact in zip(tau_p, rest, strict=True):
        estimates = []
        for crossings in (20.0, 5.0, 1.25, 0.4):
            monkeypatch.setattr(module, "_CROSSINGS", crossings)
            run = run_of(PROBLEM, strength, method)
            state = slow_start(setting, run, PROBLEM.sample(strength), 0)
            estimates.append(state.now["run"]["start_error"])
            run.take_steps(state, 10_000)
            error = abs(state.now["results"]["onset_stress"] - exact)
            assert error < max(estimates[-1], 3e-5 * state.now["run"]["scale"])
        assert np.all(np.diff(estimates) > 0.0)


def test_loading_too_fast_begins_at_rest():
    near, rest = both(profiles(2.0, 2), loading_rate=3e10, stop="onset")
    assert np.all(near["start_error"] == 0.0)
    assert_same(near, rest)


@pytest.mark.parametrize(
    ("initial_stress", "extent"),
    [(0.0, (0.01, 0.09)), (0.9e6, None)],
    ids=["barriers", "stress above the strength"],
)
def test_where_no_equilibrium_is_followed_it_begins_at_rest(initial_stress, extent):
    problem = within(make_problem(load=st.Load(initial_stress=initial_stress)), extent)
    field = st.paper.strength(problem, correlation_ratio=1.0)
    tau_p = field.sample(problem.interface, samples=1, seed=0)[0]
    assert_same(*both(tau_p, problem, loading_rate=1e8, stop="onset"))


def test_laws_without_straight_pieces_and_planes_have_no_equilibrium_to_begin_from():
    curved = st.ExponentialWeakening(weakening_rate=2e10)
    plane = make_problem((16, 16), (0.1, 0.1), weakening_rate=2e10)
    assert static_search(make_problem(64, weakening_rate=2e10)) is not None
    assert static_search(make_problem(64, friction=curved)) is None
    assert static_search(plane) is None


def test_the_state_at_the_start_is_that_of_the_slow_path():
    """Slip rates by central differences of equilibria; what is radiated only begins there."""
    run = run_of(CROOKED, CROOKED_STRENGTH, st.Rupture(loading_rate=1e7))
    search, rows = static_search(CROOKED), CROOKED.sample(CROOKED_STRENGTH)
    state = slow_start(search, run, rows, 0)
    static, impedance = sample_of(rows, search.pieces, 0), run.medium.impedance
    load = state.now["step"]["load"] - impedance * state.slip_rate.mean() / 1.2  # <p>
    step = 0.01 * (search.solve(static).load - load)
    slips = [search.solve(static, load + side * step).slip for side in (-1.0, 1.0)]
    slip_rate = 1e7 * (slips[1] - slips[0]) / (2.0 * step)
    # Extrapolated as at a fold, by 1/16; on this grid the path is straight there.
    assert np.all(
        (state.slip_rate >= 0.999 * slip_rate) & (state.slip_rate <= 1.07 * slip_rate)
    )
    assert abs(radiated_energy(run, state)) < 1e-12 * state.now["step"]["work"]

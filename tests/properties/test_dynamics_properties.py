"""What holds for every rupture of a line: energy, symmetry, restart."""

import numpy as np
import pytest
from checks import assert_same
from hypothesis import given, settings
from hypothesis import strategies as some
from ruptures import radiated_energy, run_of
from setups import make_problem

import stiction as st
from stiction import Rupture, simulate_rupture
from stiction.methods.dynamics.save import read_checkpoint, write_checkpoint
from stiction.methods.dynamics.state import Reason

NODES = 128
PROBLEM = make_problem(NODES, 0.05, solid=st.paper.problem().solid)
METHOD = Rupture(loading_rate=1e7)
WEAK_SPOT = np.where((np.arange(NODES) >= 40) & (np.arange(NODES) < 60), 0.8e6, 3e6)
"""Twenty nodes between strong ones, which arrest what begins there."""


def strength(seed, low=0.7e6, high=1.5e6):
    """A smooth random profile."""
    rng = np.random.default_rng(seed)
    spread = np.exp(-0.5 * (np.arange(NODES // 2 + 1) / 12.0) ** 2)
    noise = np.fft.irfft(np.fft.rfft(rng.standard_normal(NODES)) * spread, NODES)
    return low + (high - low) * (noise - noise.min()) / np.ptp(noise)


def through_file(path, run, state):
    """The state as it is read from a checkpoint."""
    write_checkpoint(path, run, state)
    return read_checkpoint(path, run, run.start(0.0))


def fresh_run(profile, method=METHOD):
    run = run_of(PROBLEM, profile, method)
    return run, run.start(run.first_slip())


@settings(max_examples=8, deadline=None)
@given(seed=some.integers(0, 10_000), rate=some.sampled_from([1e4, 1e7, 1e9]))
def test_energy_is_never_created_and_stress_never_above_strength(seed, rate):
    profile = strength(seed)
    save = st.Save(["slip", "slip_rate", "shear_stress", "strength"], every=5)
    run = simulate_rupture(PROBLEM, profile, method=Rupture(loading_rate=rate), save=save)
    total = run["work"].values[-1]
    assert run.attrs["stopped"] == "sliding"
    # Rounding of a difference of terms that are 1e3 times larger.
    assert run["radiated_energy"].values.min() > -1e-5 * total
    assert np.all(run["slip_rate"].values >= 0.0)
    assert np.all(np.diff(run["slip"].values, axis=0) >= 0.0)
    # The complementarity solver stops at 1e-8 of the strength drop.
    assert np.all(run["shear_stress"].values <= run["strength"].values + 1e-7 * 1e6)


@settings(max_examples=6, deadline=None)
@given(seed=some.integers(0, 10_000), shift=some.integers(1, NODES - 1))
def test_onset_moves_with_the_profile_and_mirrors_with_it(seed, shift):
    profile = strength(seed)
    three = np.stack([profile, np.roll(profile, shift), np.roll(profile[::-1], 1)])
    found = METHOD.prepare(PROBLEM)(PROBLEM.sample(three))
    loads = found["critical_stress"]
    # Step sizes are chosen by thresholds, which round-off may tip: the accuracy of the method.
    assert loads[1:] == pytest.approx([loads[0]] * 2, rel=2e-5)
    at = found["critical_position"] / PROBLEM.interface.spacing
    assert abs((at[1] - at[0] - shift + NODES / 2) % NODES - NODES / 2) <= 2
    assert abs((at[2] + at[0] + NODES / 2) % NODES - NODES / 2) <= 2


def test_restart_at_any_step_is_the_uninterrupted_run(tmp_path):
    profile = strength(5)
    run, straight = fresh_run(profile)
    total, reason = run.advance(straight, 100_000)
    assert reason == Reason.ALL_SLID
    implicit = int(straight.now["implicit_steps"])
    assert implicit > 10
    path = tmp_path / "state.npz"
    # In the implicit phase, just before, at and after the switch, in the rupture.
    for cut in (1, 7, implicit - 1, implicit, implicit + 1, total - 20):
        run, state = fresh_run(profile)
        run.advance(state, cut)
        state = through_file(path, run, state)
        run.advance(state, 100_000)
        assert_same(state._asdict(), straight._asdict())


def test_the_pass_over_the_memory_meets_whole_cache_lines(tmp_path):
    """A third slower where it does not; what allocates memory begins 16 bytes later."""
    run, state = fresh_run(strength(5), Rupture(loading_rate=1e7, implicit=False))
    run.advance(state, 1)
    again, tables = through_file(tmp_path / "state.npz", run, state), run.tables
    arrays = state.memory, again.memory, again.memory_sum, tables.table, tables.packed
    for array in arrays:
        assert array.ctypes.data % 64 == 0


def test_restart_across_a_return_to_implicit_steps(tmp_path):
    """A weak spot that is arrested by a strong surrounding: explicit and back."""
    run, straight = fresh_run(WEAK_SPOT)
    count = 0
    while straight.now["arrested"] == 0 or straight.explicit:
        run.advance(straight, 5)
        count += 5
        assert count < 20_000
    run.advance(straight, 3)
    run, state = fresh_run(WEAK_SPOT)
    for cut in (count // 3, count - count // 3 - 25, 25):
        run.advance(state, cut)
        state = through_file(tmp_path / "state.npz", run, state)
    run.advance(state, 3)
    assert not straight.explicit
    assert_same(state._asdict(), straight._asdict())


def test_radiated_energy_is_steady_after_arrest():
    run, state = fresh_run(WEAK_SPOT)
    while state.now["arrested"] == 0:
        run.advance(state, 20)
    # Hold the load: from here on nothing slips, and what was radiated stays radiated.
    held = float(state.now["load"])
    run.setting.load.at[:] = [0.0, 1e9]
    run.setting.load.values[:] = [held, held * (1.0 + 1e-15)]
    thresholds = run.setting.thresholds._replace(explicit_only=True, calm_count=10**9)
    run.setting = run.setting._replace(thresholds=thresholds)
    run.advance(state, 3000)
    middle = radiated_energy(run, state)
    run.advance(state, 3000)
    assert middle > 0.0
    assert radiated_energy(run, state) == pytest.approx(middle, rel=1e-6)
    assert state.rate.max() == 0.0


@pytest.mark.parametrize("rate", [1e5, 2e9])
def test_work_is_the_load_times_the_slip_of_every_step(rate):
    """For a uniform load, int tau_0 d<slip> L by the trapezoidal rule, to round-off."""
    method = Rupture(loading_rate=rate)
    run = simulate_rupture(PROBLEM, strength(7), method=method, save=st.Save([]))
    load = np.r_[float(run["load"][0]), run["step_load"].values]
    slip = np.r_[0.0, run["step_mean_slip"].values]
    work = np.cumsum(0.5 * (load[1:] + load[:-1]) * np.diff(slip)) * 0.05
    assert int(run["explicit_steps"]) > 100
    assert np.abs(run["step_work"].values - work).max() < 1e-12 * work[-1]


def test_creep_stops_where_the_load_falls_and_never_runs_back():
    """Up to half of the creep, down, and up again."""
    profile = strength(3)
    onset = float(METHOD.prepare(PROBLEM)(PROBLEM.sample(profile))["critical_stress"][0])
    high = 0.5 * (profile.min() + onset)
    low, end = 0.8 * high, 0.3
    load = ([0.0, 0.1, 0.2, end], [0.0, high, low, high])
    method = Rupture(load=load, stop="time", end_time=end)
    save = st.Save(["slip", "slip_rate", "shear_stress", "strength"])
    run = simulate_rupture(PROBLEM, profile, method=method, save=save)
    slip, time = run["slip"].values, run["time"].values
    assert int(run["implicit_steps"]) > 30
    assert slip.max() > 0.0
    assert np.all(np.diff(slip, axis=0) >= 0.0)
    falling = (time > 0.1) & (time <= 0.2)
    # From the peak of the load on, everything rests: slip is that of the peak, to the last bit.
    late = slip[falling][np.sum(falling) // 4 :]
    assert falling.sum() > 4
    assert np.array_equal(late, np.broadcast_to(late[0], late.shape))
    assert np.all(run["shear_stress"].values <= run["strength"].values + 0.1)
    # Back at the same load nothing more has slipped than the solver's accuracy allows.
    assert slip[-1] == pytest.approx(late[0], abs=1e-4 * slip.max())

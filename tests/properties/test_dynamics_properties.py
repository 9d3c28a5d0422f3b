"""What holds for every rupture: energy, symmetry, restart."""

import numpy as np
import pytest
from checks import assert_same
from hypothesis import given, settings
from hypothesis import strategies as some
from ruptures import BREAKING_PLANE, dip, run_of
from setups import make_problem, within
from specimens import crooked, rough

import stiction as st
from stiction import Rupture, simulate_rupture
from stiction.methods.dynamics.save import read_checkpoint, write_checkpoint
from stiction.methods.dynamics.specimens import RuptureSearch
from stiction.methods.dynamics.state import Reason
from stiction.methods.equilibrium.solver import follow_to_sliding, make_search, sample_of
from stiction.methods.equilibrium.state import Outcome
from stiction.methods.equilibrium.strength import present_pieces

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


@settings(max_examples=5, deadline=None)
@given(seed=some.integers(0, 10_000), loading_rate=some.sampled_from([1e4, 1e7, 1e9]))
def test_energy_is_never_created_and_stress_never_above_strength(seed, loading_rate):
    profile = strength(seed)
    save = st.Save(["slip", "slip_rate", "shear_stress", "strength"], every=5)
    run = simulate_rupture(
        PROBLEM, profile, method=Rupture(loading_rate=loading_rate), save=save
    )
    total = run["work"].values[-1]
    assert run.attrs["stopped"] == "sliding"
    # Rounding of a difference of terms that are 1e3 times larger.
    assert run["radiated_energy"].values.min() > -1e-5 * total
    assert np.all(run["slip_rate"].values >= 0.0)
    assert np.all(np.diff(run["slip"].values, axis=0) >= 0.0)
    # The complementarity solver stops at 1e-8 of the strength drop.
    assert np.all(run["shear_stress"].values <= run["strength"].values + 1e-7 * 1e6)


@pytest.mark.parametrize("arrested", [False, True])
def test_restart_at_any_step_is_the_uninterrupted_run(tmp_path, arrested):
    """A weak spot that is arrested by a strong surrounding returns to implicit steps."""
    profile = WEAK_SPOT if arrested else strength(5)
    run, straight = fresh_run(profile)
    if arrested:
        total = 0
        while straight.now["results"]["arrested_events"] == 0 or straight.explicit:
            total += run.take_steps(straight, 5)[0]
            assert total < 20_000
        cuts = total // 3, total - 25, total
        total += run.take_steps(straight, 3)[0]
    else:
        total, reason = run.take_steps(straight, 100_000)
        implicit = int(straight.now["stepping"]["implicit_steps"])
        assert reason == Reason.ALL_SLID
        assert implicit > 10
        # In the implicit phase, just before, at and after the switch, in the rupture.
        cuts = 1, 7, implicit - 1, implicit, implicit + 1, total - 20
    for cut in cuts:
        run, state = fresh_run(profile)
        run.take_steps(state, cut)
        state = through_file(tmp_path / "state.npz", run, state)
        run.take_steps(state, total - cut)
        assert_same(state._asdict(), straight._asdict())


def test_creep_stops_where_the_load_falls_and_never_runs_back():
    """Up to half of the creep, down, and up again."""
    profile = strength(3)
    onset = float(METHOD.prepare(PROBLEM)(PROBLEM.sample(profile))["critical_stress"][0])
    high = 0.5 * (profile.min() + onset)
    low, end = 0.8 * high, 0.3
    load = ([0.0, 0.1, 0.2, end], [0.0, high, low, high])
    method = Rupture(load_history=load, stop="time", end_time=end)
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


def test_an_arrested_rupture_radiates_no_more():
    """A strong frame stops it; then work, friction and strain energy balance for good."""
    plane = BREAKING_PLANE.interface
    x, y = np.meshgrid(*plane.coordinates.values(), indexing="ij")
    inside = (np.abs(x - 0.02) < 0.011) & (np.abs(y - 0.015) < 0.009)
    tau_p = 8e5 - 2e5 * dip(plane, (0.018, 0.014), 0.007)
    method = Rupture(
        load_history=([0.0, 6e-3, 1.0], [0.0, 6.2e5, 6.2e5]), stop="time", end_time=0.5
    )
    problem = within(BREAKING_PLANE, inside)
    run = simulate_rupture(problem, tau_p, method=method, save=st.Save(every=20))
    slip = run.slip.values[-1]
    assert np.all(slip[~inside] == 0.0)
    assert np.all(slip[inside] > 0.0)
    radiated = run.radiated_energy.values
    settled = run.time.values > 6.4e-3
    assert radiated[-1] > 0.0
    assert np.ptp(radiated[settled]) < 1e-6 * radiated[-1]
    # The strain energy is the work of the stress change on the slip.
    change = run.shear_stress.values[-1] - 6.2e5
    strain = -0.5 * float(np.sum(change * slip)) * plane.cell
    # Waves along the interface fade like the square root of time only.
    assert run.strain_energy.values[-1] == pytest.approx(strain, rel=1e-3)
    moment = BREAKING_PLANE.solid.shear_modulus * float(slip.sum()) * plane.cell
    assert run.seismic_moment.values[-1] == pytest.approx(moment, rel=1e-12)


LOW = st.Pusher(height=0.006, width=0.004, stiffness=3e7)
DRIVES = [
    LOW,
    st.Pusher(height=0.012, width=0.005),
    st.Platen(stiffness=2e7, mass=0.1),
    st.Pusher(height=0.01, width=0.004, side="both", stiffness=float("inf")),
]


@pytest.mark.parametrize("drive", DRIVES)
def test_no_event_is_shorter_than_without_inertia_and_each_ends_in_equilibrium(drive):
    problem = crooked(nodes=64, drive=drive)
    search, overdamped = RuptureSearch(problem, Rupture()), make_search(problem)
    for strength in rough(problem, 5, samples=4):
        sample = sample_of(problem.sample(strength), search.pieces, 0)
        for before, after, _ in follow_to_sliding(search, sample).events:
            least = overdamped.jump(sample, before)
            assert least.outcome == Outcome.ARRESTED
            assert np.all(after.slip >= least.state.slip - 1e-6 * after.slip.max())
            pieces = present_pieces(sample, after.slip)
            load = before.load * sample.profile - problem.blocks.stiffness @ after.slip
            over = load - (pieces.strength - pieces.weakening_rate * after.slip)
            assert over.max() < 1e-9 * sample.excess.max()


def test_one_event_in_space_and_time():
    """It comes to rest; every tenth step is kept."""
    specimen = crooked(nodes=64, drive=LOW)
    save = st.Save(["slip", "slip_rate", "shear_stress", "strength"])
    strength = rough(specimen, 3)
    run = simulate_rupture(specimen, strength, method=Rupture(), event=0, save=save)
    energies = (f"{name}_energy" for name in ("friction", "strain", "kinetic", "attenuated"))
    assert sum(run[name] for name in energies).values == pytest.approx(run["work"].values)
    assert run.attrs["stopped"] == "rest"
    assert run["attenuated_energy"].values[-1] > 0.0
    assert np.all(np.diff(run["slip"].values, axis=0) >= 0.0)
    added = (run["slip"][-1] - run["slip"][0]).values.sum() * specimen.interface.cell
    moment = specimen.solid.shear_modulus * added  # the frames begin just after the event
    assert st.external.event_table(run)["event_moment (N)"][0] == pytest.approx(
        moment, rel=0.02
    )
    over = run["shear_stress"] - run["strength"]
    assert over.values[1:].max() < 0.02 * float(run["peak_strength"].mean())
    assert run["machine_force"].values[0] == pytest.approx(run["force"].values[0], rel=1e-3)
    assert run["block_velocity"].dims == ("snapshot", "height", "x")

"""What holds for every rupture and friction law: energy, restart, stations, arrival times."""

import dataclasses

import numpy as np
import pytest
from checks import assert_same
from ruptures import BREAKING_PLANE, dip, run_of, wavy_line
from setups import QUARTER, beta_strength, examples, make_problem
from specimens import crooked, rough

import stiction as st
from stiction import Rupture, simulate_rupture
from stiction.methods.dynamics.save import open_rupture, read_checkpoint, write_checkpoint
from stiction.methods.dynamics.specimens import RuptureSearch
from stiction.methods.dynamics.state import Reason
from stiction.methods.equilibrium.solver import follow_to_sliding, make_search, sample_of
from stiction.methods.equilibrium.state import Outcome
from stiction.methods.equilibrium.strength import present_pieces

NODES = 128
PROBLEM = make_problem(NODES, 0.05, solid=st.paper.problem().solid)
WEAK_SPOT = np.where((np.arange(NODES) >= 40) & (np.arange(NODES) < 60), 0.8e6, 3e6)
"""Twenty nodes between strong ones, which arrest what begins there."""


def strength(seed, low=0.7e6, high=1.5e6):
    """A smooth random profile."""
    rng = np.random.default_rng(seed)
    spread = np.exp(-0.5 * (np.arange(NODES // 2 + 1) / 12.0) ** 2)
    noise = np.fft.irfft(np.fft.rfft(rng.standard_normal(NODES)) * spread, NODES)
    return low + (high - low) * (noise - noise.min()) / np.ptp(noise)


def fresh_run(profile):
    run = run_of(PROBLEM, profile, Rupture(loading_rate=1e7))
    return run, run.start(run.first_slip())


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
        write_checkpoint(tmp_path / "state.npz", run, state)
        state = read_checkpoint(tmp_path / "state.npz", run, run.start(0.0))
        run.take_steps(state, total - cut)
        assert_same(state._asdict(), straight._asdict())


DRIVES = examples("drives with arrested events")


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
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


LINE = make_problem(64, 0.04, solid=QUARTER, weakening_rate=3e11, residual_strength=2e5)
FAST = Rupture(loading_rate=1e8)
RECORDED = {f"station_{name}": name for name in ("slip", "slip_rate", "shear_stress")}
CASES = {
    "line": (LINE, {"weak": 0.012, "far": 0.0304}, (19, 49)),
    "plane": (
        BREAKING_PLANE, {"weak": (0.012, 0.012), "far": (0.0302, 0.0201)}, ((12, 14), (30, 24)),
    ),
}  # fmt: skip


def with_stations(problem, method=FAST, **save):
    interface = problem.interface
    strength = 1e6 - 3e5 * dip(interface, [0.012] * len(interface.shape), 0.007)
    save = st.Save(**save)
    return simulate_rupture(problem, strength, method=method, save=save, progress=False)


def test_an_end_of_the_interface_is_its_first_node():
    """It is periodic; half a node before the end is its last node."""
    for problem, place, node in (
        (LINE, 0.04, 0), (LINE, 0.03963, 63), (BREAKING_PLANE, (0.04, 0.0124), 15),
        (BREAKING_PLANE, (0.0124, 0.03), 12 * 36),
    ):  # fmt: skip
        assert st.Save(stations={"a": place}).nodes(problem.interface) == node


@pytest.fixture(scope="module", params=list(CASES))
def case(request):
    problem, stations, nodes = CASES[request.param]
    return problem, stations, nodes, with_stations(problem, every=1, stations=stations)


def test_stations_show_the_fields_at_their_nodes(case):
    """Frames after every step are the same numbers, but for the first, which no step led to."""
    problem, stations, nodes, run = case
    assert run.station.values.tolist() == list(stations)
    assert np.array_equal(run.step_time, run.time[1:])
    for own, field in RECORDED.items():
        for name, node in zip(stations, nodes, strict=True):
            at_node = run[field].values[(slice(1, None), *np.atleast_1d(node))]
            assert np.array_equal(run[own].sel(station=name), at_node), own
        assert run[own].attrs["units"] == run[field].attrs["units"]
    far = [float(run[f"station_{dim}"][1]) for dim in problem.interface.dims]
    axes = problem.interface.coordinates.values()
    expected = [at[i] for at, i in zip(axes, np.atleast_1d(nodes[1]), strict=True)]
    assert far == pytest.approx(expected)


def test_stations_change_nothing_and_need_no_frames(case):
    problem, stations, _, run = case
    plain = with_stations(problem, fields=[], every=50)
    recorded = with_stations(problem, fields=[], every=50, stations=stations)
    places = {f"station_{dim}" for dim in problem.interface.dims}
    assert set(recorded.variables) - set(plain.variables) == {*RECORDED, "station"} | places
    assert plain.identical(recorded[list(plain.variables)])
    for name in RECORDED:
        assert np.array_equal(recorded[name], run[name])


def test_a_restart_records_the_rest_to_the_bit(case, tmp_path):
    problem, stations, _, run = case
    for method in (Rupture(loading_rate=1e8, max_steps=60), FAST):
        with_stations(problem, method, stations=stations, to=tmp_path / "run")
    streamed = open_rupture(tmp_path / "run", fields=())
    assert len(list((tmp_path / "run").glob("frames-*.nc"))) > 1
    for name in (*RECORDED, "step_time"):
        assert np.array_equal(streamed[name], run[name])


LAWS = examples("laws of one fracture energy")


@pytest.fixture(scope="module")
def runs():
    """A weak spot breaks an interface, with the same fracture energy for each law."""
    method = Rupture(loading_rate=1e8, kernel_tolerance=1e-4, courant=0.25)
    save = st.Save(["slip", "slip_rate", "shear_stress", "strength"], every=1)
    found = {}
    for name, law in LAWS.items():
        problem = make_problem(256, 0.05, solid=QUARTER, friction=law, mode="III")
        strength = 1e6 - 0.4e6 * dip(problem.interface, 0.025, 0.0075)
        found[name] = simulate_rupture(problem, strength, method=method, save=save)
    return found


@pytest.mark.parametrize("name", LAWS)
def test_energies_balance(runs, name):
    run = runs[name]
    spacing = run.x.values[1]
    slip, stress = run.slip.values, run.shear_stress.values
    # What friction dissipates, summed from the stress that slides, step by step.
    sheared = 0.5 * (stress[1:] + stress[:-1]) * np.diff(slip, axis=0)
    friction = np.cumsum(sheared.sum(axis=1)) * spacing
    dissipated = run.fracture_energy.values + 0.2e6 * slip.sum(axis=1) * spacing
    # Trapezia over steps in which the fastest nodes weaken by a tenth: off at corners.
    assert friction[-1] == pytest.approx(dissipated[-1], rel=1e-3)
    radiated = run.radiated_energy.values
    np.testing.assert_allclose(
        run.work - dissipated - run.strain_energy, radiated, atol=1e-9 * run.work.values[-1]
    )
    assert (np.diff(radiated) > -1e-4 * radiated[-1]).all()
    # All of it is spent, up to the last per cent of strength of a law that never ends.
    assert run.stopped == "sliding"
    left = 0.01 if name == "exponential" else 1e-12
    assert run.fracture_energy.values[-1] == pytest.approx(0.05 * 2.5, rel=left)


def test_the_front_reaches_a_node_that_does_not_weaken_when_it_first_slips():
    problem, strength = wavy_line()
    firm = np.arange(60, 70)
    residual = np.full(128, 2e5)
    residual[firm] = strength[firm]
    friction = st.LinearWeakening(weakening_rate=0.2e12, residual_strength=residual)
    problem = dataclasses.replace(problem, friction=friction)
    run = simulate_rupture(problem, strength, method=FAST, save=st.Save(["slip"], every=1))
    first = np.argmax(run.slip.values[:, firm] > 0.0, axis=0)
    arrival, time = run.arrival_time.values[firm], run.time.values
    round_off = 1e-9 * time[-1]
    assert np.all(arrival >= time[first - 1] - round_off)
    assert np.all(arrival <= time[first] + round_off)


def test_an_overstressed_node_slips_from_the_start():
    """So a run has no equilibrium near the onset to start from."""
    problem = make_problem(128, 0.06)
    (strength,) = beta_strength(6e-3).sample(problem.interface, samples=1, seed=3)
    initial = np.full(128, 1e5)
    initial[60:62] = 1.02 * strength[60:62]
    profiles = {"strength": strength, "initial_stress": initial}
    near, rest = (
        st.onset(problem, profiles, method=st.Rupture(loading_rate=1e9, start=start))
        for start in ("equilibrium", "rest")
    )
    assert near.first_instability.item() == rest.first_instability.item()
    assert near.critical_load.item() == rest.critical_load.item()

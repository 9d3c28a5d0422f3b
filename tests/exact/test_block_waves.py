"""Waves in blocks and events with inertia beside what is known exactly, or computed otherwise."""

import dataclasses

import numpy as np
import pytest
from ruptures import stepped
from setups import examples, make_problem
from specimens import crooked, rough

import stiction as st
from stiction.methods.dynamics.mesh import condensed, make_mesh
from stiction.methods.dynamics.simulate_event import EventRecord
from stiction.methods.dynamics.specimens import RuptureSearch, begin
from stiction.methods.dynamics.waves import block_at_rest, wave_steps
from stiction.methods.equilibrium.solver import follow_to_sliding as path_of
from stiction.methods.equilibrium.solver import make_search, sample_of
from stiction.methods.equilibrium.strength import LINEAR

LOW = st.Pusher(height=0.006, width=0.004, stiffness=3e7)
FREE = st.Pusher(height=0.006, width=0.004)
SLOW = 0.05e12
"""A weakening rate that few nodes resolve in mode III, too."""
DRIVES = [*zip(examples("drives of events").values(), ("III", "II") * 3, strict=True)]


def of(problem, strength):
    """One sample as the solvers take it."""
    return sample_of(problem.sample(strength), LINEAR, 0)


def lossless(problem):
    return make_mesh(problem)._replace(attenuation=0.0, viscous_time=0.0)


def stepping(problem, mesh, waves):
    """A function that makes one step beside an interface that never slips."""
    nodes = problem.interface.size
    sample, far = of(problem, np.full(nodes, 1e12)), np.full(nodes, np.inf)
    return lambda: wave_steps(sample, np.zeros(nodes), far, mesh, waves, 1, True)


@pytest.mark.parametrize("mode", ["II", "III"])
@pytest.mark.parametrize("drive", [st.Platen(), st.Pusher(height=0.016, width=0.01)])
def test_the_statics_of_the_mesh_are_those_of_the_block(mode, drive):
    errors = []
    for nodes in (48, 96):
        problem = crooked(nodes=nodes, mode=mode, drive=drive, weakening_rate=SLOW)
        blocks = problem.blocks
        static, profile, own = condensed(make_mesh(problem), nodes)
        slip = np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes) ** 3
        exact = blocks.stiffness @ slip
        off = np.abs(static @ slip - exact)[2:-2]  # corners are what `correction` is for
        error = off.max() / np.abs(exact).max()
        errors.append((error, abs(own / blocks.drive_stiffness - 1.0)))
        assert np.abs(profile - blocks.shear).mean() < 0.02
    assert errors[1][0] < 0.01
    assert errors[1][0] < 0.6 * errors[0][0]
    assert errors[1][1] < max(0.6 * errors[0][1], 1e-9)  # exact in mode III below a platen


def test_shear_waves_of_mode_iii_swing_at_the_frequency_of_their_mode():
    """Beside a stuck interface and a free top: cos kx sin ly, l = pi/(2H)."""
    problem = crooked(nodes=96, mode="III", weakening_rate=SLOW, drive=FREE)
    mesh = lossless(problem)
    x, height = problem.interface.x, 0.031
    k, across = 2.0 * np.pi / 0.083, 0.5 * np.pi / height
    waves = block_at_rest(mesh, np.zeros(96))
    shape = np.cos(k * x) * np.sin(across * mesh.heights)[:, None]
    waves.u[:] = 1e-6 * shape
    period = 2.0 * np.pi / (problem.solid.shear_wave_speed * np.hypot(k, across))
    step, values = stepping(problem, mesh, waves), []
    for _ in range(int(10.2 * period / mesh.step)):
        step()
        values.append(float((waves.u * shape).sum()))
    turns = np.flatnonzero(np.diff(np.sign(values)))
    exact = [i - values[i] / (values[i + 1] - values[i]) for i in turns]
    measured = 2.0 * mesh.step * (exact[-1] - exact[0]) / (len(exact) - 1)
    assert measured == pytest.approx(period, rel=5e-3)


@pytest.mark.parametrize("along", [True, False])
def test_pulses_cross_the_block_at_the_speeds_of_the_solid(along):
    """A pulse along y, some of the highest rows long, until the ends are heard: of v, and of u."""
    problem = crooked(nodes=256 if along else 384, height=0.1, drive=FREE)
    mesh = lossless(problem)
    solid, y, nodes = problem.solid, mesh.heights, problem.interface.size
    speed = solid.dilatational_wave_speed if along else solid.shear_wave_speed
    width, path = (0.009, 0.03) if along else (0.006, 0.018)
    waves = block_at_rest(mesh, np.zeros(nodes))

    def pulse(y):
        return 1e-7 * np.exp(-(((y - 0.035) / width) ** 2))

    (waves.v if along else waves.u)[:] = pulse(y)[:, None]
    velocity = waves.v_rate if along else waves.u_rate
    velocity[:] = ((pulse(y) - pulse(y - speed * mesh.step)) / -mesh.step)[:, None]
    row = int(np.argmin(np.abs(y - 0.035 - path)))
    step, values = stepping(problem, mesh, waves), []
    for _ in range(int(1.15 * path / speed / mesh.step)):
        step()
        values.append(float((waves.v if along else waves.u)[row, nodes // 2]))
    i = int(np.argmax(values))
    a, b, c = values[i - 1 : i + 2]
    time = mesh.step * (i + 1 + 0.5 * (a - c) / (a - 2.0 * b + c))
    assert (y[row] - 0.035) / time == pytest.approx(speed, rel=5e-3)


def test_waves_along_the_interface_run_at_rayleighs_speed():
    """Beside friction that does not change, while the blocks slide past each other.

    A wave of Rayleigh begins everywhere; its phase is seen in the middle until the ends are heard.
    """
    problem = crooked(nodes=256, height=0.05, load=st.Load())
    mesh = lossless(problem)
    sample = of(problem, np.full(256, 1e6))
    solid, x, y = problem.solid, problem.interface.x, mesh.heights[:, None]
    k = 2.0 * np.pi * 8 / 0.083
    omega = k * solid.rayleigh_wave_speed
    q = np.sqrt(k**2 - (omega / solid.dilatational_wave_speed) ** 2)
    s = np.sqrt(k**2 - (omega / solid.shear_wave_speed) ** 2)
    along = k * np.exp(-q * y) - 2.0 * k * q * s / (k**2 + s**2) * np.exp(-s * y)
    up = q * np.exp(-q * y) - 2.0 * k**2 * q / (k**2 + s**2) * np.exp(-s * y)
    waves, size, half = block_at_rest(mesh, np.full(256, 1.0)), 1e-10, 0.5 * omega * mesh.step
    waves.u[:], waves.v[:] = size * along * np.sin(k * x), size * up * np.cos(k * x)
    waves.u_rate[:] = 0.05 - size * omega * along * np.cos(k * x + half)
    waves.v_rate[:] = size * omega * up * np.sin(k * x + half)
    waves.u_rate[-1] = waves.now["speed"] = 0.05
    phases, middle = [], slice(80, 176)  # three wavelengths
    given = np.full(256, sample.residual[0]), np.full(256, np.inf)
    for _ in range(int(0.022 / solid.dilatational_wave_speed / mesh.step)):
        wave_steps(sample, *given, mesh, waves, 1, True)
        phases.append(np.angle(np.exp(-1j * k * x[middle]) @ waves.v[0, middle]))
    slope = np.polyfit(np.arange(len(phases)) * mesh.step, np.unwrap(phases), 1)[0]
    assert abs(slope) / k == pytest.approx(solid.rayleigh_wave_speed, rel=5e-3)


@pytest.mark.parametrize("attenuation", [0.0, 2e4])
@pytest.mark.parametrize(("drive", "mode"), DRIVES)
def test_energy_is_kept(drive, mode, attenuation):
    """What the stress before the event gives is stored, moves, or is lost to friction and so on."""
    W = 0.19e12 if mode == "II" else SLOW
    problem = crooked(nodes=48, drive=drive, mode=mode, weakening_rate=W)
    strength = rough(problem, 2)
    sample = of(problem, strength[0])
    path = path_of(make_search(problem), sample)
    state = path.events[0].before if path.events else path.last
    mesh = make_mesh(problem)._replace(viscous_time=0.0, attenuation=attenuation)
    event = begin(sample, mesh, problem.blocks.stiffness, state, 0.5)
    record = EventRecord(problem, problem.sample(strength), event, st.Save([]), 1.0)
    lost, worst, largest, more, step = 0.0, 0.0, 0.0, True, 0
    while more and step < 600:
        step, before = step + 1, np.hstack([event.waves.u_rate, event.waves.v_rate])
        more = event.take_steps(1)
        mean = 0.5 * (before + np.hstack([event.waves.u_rate, event.waves.v_rate]))
        lost += 2.0 * attenuation * mesh.step * (mesh.mass[:, None] * mean**2).sum()
        energies = record._energies()
        worst = max(worst, abs(energies["attenuated_energy"] - lost))
        largest = max(largest, energies["work"])
    assert 0.0 < worst < 1e-3 * largest


@pytest.mark.parametrize("drive", [LOW, st.Platen(stiffness=2e7)])
def test_heavy_attenuation_comes_to_rest_where_an_overdamped_jump_does(drive):
    checked, problem = 0, crooked(nodes=64, drive=drive)
    search, mesh = make_search(problem), make_mesh(problem)._replace(attenuation=3e5)
    for seed in range(1, 4):
        sample = of(problem, rough(problem, seed)[0])
        for before, after, _ in path_of(search, sample).events[:3]:
            event = begin(sample, mesh, problem.blocks.stiffness, before, 0.5)
            event.take_steps(60 * mesh.window)
            moved = after.slip - before.slip
            if moved.max() < 0.1 * sample.critical.max():
                continue  # to which the rise of the drive adds more
            checked += 1
            assert np.abs(event.waves.slip - after.slip).max() < 1e-3 * moved.max()
    assert checked


@pytest.mark.parametrize("mode", ["II", "III"])
def test_far_from_ends_and_top_a_rupture_is_that_between_half_spaces(mode):
    """From an overstressed patch in the middle, until the first echo."""
    nodes, tau = 384, 0.7e6
    half = make_problem(nodes, 0.1, mode=mode, weakening_rate=0.25e12)
    block = dataclasses.replace(half, specimen=st.Blocks(height=0.05, drive=st.Platen()))
    x, solid = half.interface.x, half.solid
    strength = 1.0e6 - 0.36e6 * np.exp(-(((x - 0.05) / 0.004) ** 2))
    strength += 1.5e4 * np.sin(2.0 * np.pi * x / 0.008)
    speed = solid.shear_wave_speed if mode == "III" else solid.dilatational_wave_speed
    end = 0.95 * (0.1 - 0.02) / speed  # from the patch to an end, and back to the front
    sample, mesh = of(block, strength), make_mesh(block)._replace(attenuation=0.0)
    waves, steps = block_at_rest(mesh, np.zeros(nodes)), int(end / mesh.step)
    wave_steps(sample, np.full(nodes, tau), 0.5 * sample.critical, mesh, waves, steps, True)
    _, state = stepped(half, strength, tau, end, 2 * steps)
    ours, theirs = waves.arrival, state.arrival
    both = np.isfinite(ours) & np.isfinite(theirs)
    assert both.sum() > 0.25 * nodes
    assert (np.isfinite(ours) ^ np.isfinite(theirs)).sum() <= 4  # two at each tip
    assert np.abs(ours - theirs)[both].max() < 5e-3 * end


def smooth(nodes):
    """A specimen pushed low, its search with inertia, and a sample of a smooth strength."""
    problem = crooked(nodes=nodes, drive=LOW, load=st.Load(), weakening_rate=0.09e12)
    x = problem.interface.x
    strength = 1e6 - 3.2e5 * np.cos(2.0 * np.pi * x / 0.083 * 2.5) ** 2 + 4e6 * x
    return RuptureSearch(problem, st.Rupture()), of(problem, strength)


def test_an_event_that_has_come_to_rest_moves_no_further():
    """Nor does it rest after waves have crossed the block once, if slip goes on."""
    search, sample = smooth(64)
    for before, _, _ in path_of(search, sample).events:
        event = search.event(sample, before)
        event.run(10**6)
        slip = event.waves.slip.copy()
        assert not event.slides
        event.take_steps(event.mesh.window)
        moved = (event.waves.slip - slip).max()
        assert moved < 1e-3 * (slip - before.slip).max()


@pytest.mark.slow
def test_half_the_spacing_changes_an_event_by_two_per_cent():
    """Slip and length of the largest event of a smooth strength; without inertia it is 2.2 %."""
    found = []
    for nodes in (128, 256):
        path = path_of(*smooth(nodes))
        sizes = [np.ptp(one.after.slip - one.before.slip) for one in path.events]
        before, after, _ = path.events[int(np.argmax(sizes))]
        added = after.slip - before.slip
        reach = np.flatnonzero(added > 1e-3 * added.max())[[0, -1]]
        found.append((added.sum() / nodes, added.max(), np.ptp(reach) / nodes))
    assert found[0] == pytest.approx(found[1], rel=0.02)

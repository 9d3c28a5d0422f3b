"""Waves in blocks and events with inertia beside what is known exactly, or computed otherwise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from ruptures import stepped
from setups import make_problem
from specimens import crooked, rough

import stiction as st
from stiction.methods.dynamics.mesh import Mesh, condensed, layer_matrix, make_mesh
from stiction.methods.dynamics.specimens import Event, RuptureProgram, begin
from stiction.methods.dynamics.waves import FRICTION, SPEED, TRAVEL, Waves, at_rest, follow
from stiction.methods.equilibrium.sample import LINEAR, State, StaticSample, sample_of
from stiction.methods.equilibrium.solver import follow as path_of
from stiction.methods.equilibrium.solver import make_program

LOW = st.Pusher(height=0.006, width=0.004, stiffness=3e7)
FREE = st.Pusher(height=0.006, width=0.004)
SLOW = 0.05e12
"""A weakening rate that few nodes resolve in mode III, too."""
DRIVES = [
    st.Platen(),
    st.Platen(stiffness=2e7, mass=0.1),
    st.Platen(stiffness=float("inf")),
    st.Pusher(height=0.012, width=0.005, side="right"),
    st.Pusher(height=0.006, width=0.004, stiffness=3e7, mass=0.05),
    st.Pusher(height=0.016, width=0.004, side="both", stiffness=float("inf")),
]


def of(problem: st.Problem, strength: np.ndarray) -> StaticSample:
    """One sample as the solvers take it."""
    return sample_of(problem.sample(strength), LINEAR, 0)


def held(problem: st.Problem) -> StaticSample:
    """An interface that never slips."""
    return of(problem, np.full(problem.interface.size, 1e12))


def displacements(mesh: Mesh, waves: Waves) -> np.ndarray:
    """u and v of each row, one row after the other."""
    rates = np.hstack([waves.u_rate, waves.v_rate]).astype(float)
    return np.hstack([waves.u, waves.v]).astype(float) - mesh.viscous_time * rates


def whole_matrix(mesh: Mesh, nodes: int) -> sp.csr_matrix:
    """The stiffness of all nodes, u and v of one row after the other."""
    rows = len(mesh.heights)
    total = sp.csr_matrix((2 * nodes * rows,) * 2)
    for row in range(rows - 1):
        to = sp.eye(4 * nodes, 2 * nodes * rows, 2 * nodes * row).tocsr()
        total = total + to.T @ layer_matrix(mesh, row, nodes) @ to
    return total.tocsr()


@pytest.mark.parametrize("mode", ["II", "III"])
def test_a_step_is_that_of_the_matrices_of_the_elements(mode: str) -> None:
    problem = crooked(nodes=24, mode=mode, drive=LOW, rate=SLOW)
    mesh = make_mesh(problem)._replace(stiffness=0.0, attenuation=0.0)
    waves = at_rest(mesh, np.zeros(24))
    random = np.random.default_rng(3)
    waves.u[1:], waves.v[:-1] = random.normal(size=(2, len(mesh.heights) - 1, 24)) * 1e-6
    if mode == "III":
        waves.v[:] = 0.0
    w = np.hstack([waves.u, waves.v]).astype(float)
    elastic = -(whole_matrix(mesh, 24) @ w.ravel()).reshape(w.shape)
    expected = mesh.step * elastic / mesh.mass[:, None]
    expected[0, :24] = expected[-1, 24:] = 0.0
    follow(held(problem), np.zeros(24), np.full(24, np.inf), mesh, waves, 1, True)
    rates = np.hstack([waves.u_rate, waves.v_rate])
    assert np.abs(rates - expected).max() < 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize("mode", ["II", "III"])
@pytest.mark.parametrize("drive", [st.Platen(), st.Pusher(height=0.016, width=0.01)])
def test_the_statics_of_the_mesh_are_those_of_the_block(mode: str, drive: Any) -> None:
    errors = []
    for nodes in (48, 96):
        problem = crooked(nodes=nodes, mode=mode, drive=drive, rate=SLOW)
        blocks = problem.blocks
        static, profile, own = condensed(make_mesh(problem), nodes)
        slip = np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes) ** 3
        exact = blocks.stiffness @ slip
        off = np.abs(static @ slip - exact)[
            2:-2
        ]  # the corner itself is what `correction` is for
        error = off.max() / np.abs(exact).max()
        errors.append((error, abs(own / blocks.drive_stiffness - 1.0)))
        assert np.abs(profile - blocks.shear).mean() < 0.02
    assert errors[1][0] < 0.01
    assert errors[1][0] < 0.6 * errors[0][0]
    assert errors[1][1] < max(0.6 * errors[0][1], 1e-9)  # exact in mode III below a platen


def test_shear_waves_of_mode_iii_swing_at_the_frequency_of_their_mode() -> None:
    """Beside a stuck interface and a free top: cos kx sin ly, l = pi/(2H)."""
    problem = crooked(nodes=96, mode="III", rate=SLOW, drive=FREE)
    mesh = make_mesh(problem)._replace(attenuation=0.0, viscous_time=0.0)
    x, height = problem.interface.x, 0.031
    k, across = 2.0 * np.pi / 0.083, 0.5 * np.pi / height
    waves = at_rest(mesh, np.zeros(96))
    shape = np.cos(k * x) * np.sin(across * mesh.heights)[:, None]
    waves.u[:] = 1e-6 * shape
    period = 2.0 * np.pi / (problem.solid.shear_wave_speed * np.hypot(k, across))
    sample, none, far = held(problem), np.zeros(96), np.full(96, np.inf)
    values = []
    for _ in range(int(10.2 * period / mesh.step)):
        follow(sample, none, far, mesh, waves, 1, True)
        values.append(float((waves.u * shape).sum()))
    turns = np.flatnonzero(np.diff(np.sign(values)))
    exact = [i - values[i] / (values[i + 1] - values[i]) for i in turns]
    measured = 2.0 * mesh.step * (exact[-1] - exact[0]) / (len(exact) - 1)
    assert measured == pytest.approx(period, rel=5e-3)


@pytest.mark.parametrize("along", [True, False])
def test_pulses_cross_the_block_at_the_speeds_of_the_solid(along: bool) -> None:
    """A pulse along y, some of the highest rows long, until the ends are heard: of v, and of u."""
    problem = crooked(nodes=256 if along else 384, height=0.1, drive=FREE)
    mesh = make_mesh(problem)._replace(attenuation=0.0, viscous_time=0.0)
    solid, y, nodes = problem.solid, mesh.heights, problem.interface.size
    speed = solid.dilatational_wave_speed if along else solid.shear_wave_speed
    width, path = (0.009, 0.03) if along else (0.006, 0.018)
    waves = at_rest(mesh, np.zeros(nodes))

    def pulse(y: np.ndarray) -> np.ndarray:
        return 1e-7 * np.exp(-(((y - 0.035) / width) ** 2))

    (waves.v if along else waves.u)[:] = pulse(y)[:, None]
    rate = waves.v_rate if along else waves.u_rate
    rate[:] = ((pulse(y) - pulse(y - speed * mesh.step)) / -mesh.step)[:, None]
    row = int(np.argmin(np.abs(y - 0.035 - path)))
    values, sample = [], held(problem)
    for _ in range(int(1.15 * path / speed / mesh.step)):
        follow(sample, np.zeros(nodes), np.full(nodes, np.inf), mesh, waves, 1, True)
        values.append(float((waves.v if along else waves.u)[row, nodes // 2]))
    i = int(np.argmax(values))
    a, b, c = values[i - 1 : i + 2]
    time = mesh.step * (i + 1 + 0.5 * (a - c) / (a - 2.0 * b + c))
    assert (y[row] - 0.035) / time == pytest.approx(speed, rel=5e-3)


def test_waves_along_the_interface_run_at_rayleighs_speed() -> None:
    """Beside friction that does not change, while the blocks slide past each other.

    A wave of Rayleigh begins everywhere; its phase is seen in the middle until the ends are heard.
    """
    problem = crooked(nodes=256, height=0.05, load=st.Load())
    mesh = make_mesh(problem)._replace(attenuation=0.0, viscous_time=0.0)
    sample = of(problem, np.full(256, 1e6))
    solid, x, y = problem.solid, problem.interface.x, mesh.heights[:, None]
    k = 2.0 * np.pi * 8 / 0.083
    omega = k * solid.rayleigh_wave_speed
    q = np.sqrt(k**2 - (omega / solid.dilatational_wave_speed) ** 2)
    s = np.sqrt(k**2 - (omega / solid.shear_wave_speed) ** 2)
    along = k * np.exp(-q * y) - 2.0 * k * q * s / (k**2 + s**2) * np.exp(-s * y)
    up = q * np.exp(-q * y) - 2.0 * k**2 * q / (k**2 + s**2) * np.exp(-s * y)
    waves, size, half = at_rest(mesh, np.full(256, 1.0)), 1e-10, 0.5 * omega * mesh.step
    waves.u[:], waves.v[:] = size * along * np.sin(k * x), size * up * np.cos(k * x)
    waves.u_rate[:] = 0.05 - size * omega * along * np.cos(k * x + half)
    waves.v_rate[:] = size * omega * up * np.sin(k * x + half)
    waves.u_rate[-1] = waves.now[SPEED] = 0.05
    phases, middle = [], slice(80, 176)  # three wavelengths
    for _ in range(int(0.022 / solid.dilatational_wave_speed / mesh.step)):
        follow(
            sample, np.full(256, sample.residual[0]), np.full(256, np.inf), mesh, waves, 1, True
        )
        phases.append(np.angle(np.exp(-1j * k * x[middle]) @ waves.v[0, middle]))
    slope = np.polyfit(np.arange(len(phases)) * mesh.step, np.unwrap(phases), 1)[0]
    assert abs(slope) / k == pytest.approx(solid.rayleigh_wave_speed, rel=5e-3)


def first_event(
    problem: st.Problem, seed: int, number: int = 0
) -> tuple[Any, StaticSample, State]:
    """Sample and state of one of the instabilities of the overdamped path."""
    program = make_program(problem)
    sample = of(problem, rough(problem, seed)[0])
    path = path_of(program, sample)
    states = [one.before for one in path.events] + [path.last]
    return program, sample, states[number]


@pytest.mark.parametrize("mode", ["II", "III"])
@pytest.mark.parametrize("attenuation", [0.0, 2e4])
@pytest.mark.parametrize("drive", DRIVES)
def test_energy_is_kept(drive: Any, attenuation: float, mode: str) -> None:
    """What the stress before the event gives is stored, moves, or is lost to friction and so on."""
    problem = crooked(nodes=48, drive=drive, mode=mode, rate=0.19e12 if mode == "II" else SLOW)
    _, sample, state = first_event(problem, 2)
    mesh = make_mesh(problem)._replace(viscous_time=0.0, attenuation=attenuation)
    event = begin(sample, mesh, problem.blocks.stiffness, state, 0.5)
    waves, dx = event.waves, mesh.spacing
    begun, start = waves.slip.copy(), event.start
    mass = mesh.mass[:, None] * np.ones(48)
    matrix = whole_matrix(mesh, 48)
    lost, before = 0.0, (waves.u_rate.copy(), waves.v_rate.copy())
    worst, largest = 0.0, 0.0
    for step in range(600):
        more = event.advance(1)
        slid = waves.slip - begun
        mean = 0.5 * (before[0].astype(float) + waves.u_rate)
        mean_v = 0.5 * (before[1].astype(float) + waves.v_rate)
        moving = (mass * (mean**2 + mean_v**2)).sum()
        lost += attenuation * moving * mesh.step
        before = (waves.u_rate.copy(), waves.v_rate.copy())
        if more and step % 20:
            continue
        last = np.hstack([waves.u_rate, waves.v_rate]).astype(float) * mesh.step
        middle = (displacements(mesh, waves) - 0.5 * last).ravel()  # where the rates are known
        travel = waves.now[TRAVEL] - 0.5 * mesh.step * waves.now[SPEED]
        spring = 0.0 if not np.isfinite(mesh.stiffness) else mesh.stiffness
        half = slid - 0.5 * mesh.step * waves.slip_rate
        stored = 0.5 * middle @ (matrix @ middle) + 0.5 * spring * travel**2
        stored += 0.25 * dx * half @ (mesh.correction @ half)
        kinetic = 0.5 * (mass * (waves.u_rate**2 + waves.v_rate**2)).sum()
        kinetic += 0.5 * mesh.drive_mass * waves.now[SPEED] ** 2
        work = 0.5 * dx * start @ half
        worst = max(worst, abs(work - waves.now[FRICTION] - stored - kinetic - lost))
        largest = max(largest, work)
        if not more:
            break
    assert 0.0 < worst < 1e-3 * largest


@pytest.mark.parametrize(
    "drive", [LOW, st.Pusher(height=0.012, width=0.005), st.Platen(stiffness=2e7)]
)
def test_heavy_attenuation_comes_to_rest_where_an_overdamped_jump_does(drive: Any) -> None:
    checked = 0
    problem = crooked(nodes=64, drive=drive)
    program = make_program(problem)
    mesh = make_mesh(problem)._replace(attenuation=3e5)
    for seed in range(1, 4):
        sample = of(problem, rough(problem, seed)[0])
        events = path_of(program, sample).events
        for before, after in events[:3]:
            event = begin(sample, mesh, problem.blocks.stiffness, before, 0.5)
            event.advance(60 * mesh.window)
            moved = after.slip - before.slip
            if moved.max() < 0.1 * sample.critical.max():
                continue  # to which the rise of the drive adds more
            checked += 1
            assert np.abs(event.waves.slip - after.slip).max() < 1e-3 * moved.max()
    assert checked


def mirrored(problem: st.Problem, strength: np.ndarray) -> Event:
    program, sample = make_program(problem), of(problem, strength)
    path = path_of(program, sample)
    state = path.events[0].before if path.events else path.last
    event = begin(sample, make_mesh(problem), problem.blocks.stiffness, state, 0.5)
    event.run(10**6)
    return event


def test_a_mirrored_block_ruptures_like_its_mirror_image() -> None:
    left = crooked(nodes=64, drive=LOW, load=st.Load())
    right = crooked(
        nodes=64, load=st.Load(),
        drive=st.Pusher(height=0.006, width=0.004, stiffness=3e7, side="right"),
    )  # fmt: skip
    strength = rough(left, 4)[0]
    one, other = mirrored(left, strength), mirrored(right, strength[::-1])
    added = one.waves.slip - one.before.slip
    assert one.steps == other.steps
    assert np.abs(one.waves.slip - other.waves.slip[::-1]).max() < 1e-4 * added.max()


@pytest.mark.parametrize("mode", ["II", "III"])
def test_far_from_ends_and_top_a_rupture_is_that_between_half_spaces(mode: str) -> None:
    """From an overstressed patch in the middle, until the first echo."""
    nodes, half = 384, make_problem(384, 0.1, mode=mode, weakening_rate=0.25e12)
    x = half.interface.x
    block = st.Problem(
        solid=half.solid, interface=st.Interface(length=0.1, nodes=nodes), friction=half.friction,
        specimen=st.Blocks(height=0.05, drive=st.Platen()), mode=mode,
    )  # fmt: skip
    strength = 1.0e6 - 0.36e6 * np.exp(-(((x - 0.05) / 0.004) ** 2))
    strength += 1.5e4 * np.sin(2.0 * np.pi * x / 0.008)
    tau = 0.7e6
    solid = half.solid
    speed = solid.shear_wave_speed if mode == "III" else solid.dilatational_wave_speed
    end = 0.95 * (0.1 - 0.02) / speed  # from the patch to an end, and back to the front
    sample = of(block, strength)
    mesh = make_mesh(block)._replace(attenuation=0.0)
    waves = at_rest(mesh, np.zeros(nodes))
    front = 0.5 * sample.critical
    follow(sample, np.full(nodes, tau), front, mesh, waves, int(end / mesh.step), True)
    run, state = stepped(half, strength, tau, end, int(end / mesh.step) * 2)
    ours, theirs = waves.arrival, state.arrival
    both = np.isfinite(ours) & np.isfinite(theirs)
    assert both.sum() > 0.25 * nodes
    assert (np.isfinite(ours) ^ np.isfinite(theirs)).sum() <= 4  # two at each tip
    assert np.abs(ours - theirs)[both].max() < 5e-3 * end
    assert run is not None


@pytest.mark.slow
def test_half_the_spacing_changes_an_event_by_two_per_cent() -> None:
    """Slip and length of the largest event of a smooth strength; without inertia it is 2.2 %."""
    found = []
    for nodes in (128, 256):
        problem = crooked(nodes=nodes, drive=LOW, load=st.Load(), rate=0.09e12)
        x = problem.interface.x
        strength = 1e6 - 3.2e5 * np.cos(2.0 * np.pi * x / 0.083 * 2.5) ** 2 + 4e6 * x
        program = RuptureProgram(problem, st.Rupture())
        path = path_of(program, of(problem, strength))
        sizes = [np.ptp(one.after.slip - one.before.slip) for one in path.events]
        before, after = path.events[int(np.argmax(sizes))]
        added = after.slip - before.slip
        reach = np.flatnonzero(added > 1e-3 * added.max())[[0, -1]]
        found.append((added.sum() / nodes, added.max(), np.ptp(reach) / nodes))
    assert found[0] == pytest.approx(found[1], rel=0.02)

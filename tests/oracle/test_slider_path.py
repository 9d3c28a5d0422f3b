"""The path of a slider beside load steps, and beside solutions in closed form."""

import functools

import numpy as np
import pytest
from recording import stored
from rigs import LoadSteps

from stiction.elasticity.columns import Body
from stiction.elasticity.rig import Rig, contact_rig, on_cells
from stiction.methods.equilibrium.contact_path import (
    LOAD,
    N_BORDERED_AGAIN,
    N_INSIDE,
    N_STACKED,
    Status,
    follow,
)
from stiction.methods.equilibrium.slider import (
    Friction,
    begin_push,
    forces_of,
    make_contact,
    press,
)

N = 1e6 * 0.14  # 1 MPa
RIGS = stored("cases")["rigs of paths"]


@functools.lru_cache
def rig(name):
    """A rig of 24 cells, as arrays of one kind."""
    base, push = Body(*RIGS[name]["base"]), tuple(RIGS[name]["push"])
    given = RIGS[name] | {"base": base, "push": push}
    *arrays, C = contact_rig(0.14, 24, Body(0.075, 1.11e9, 2.65 / 1.35), **given)
    return Rig(*(array.copy() for array in arrays), C)


def random_friction(K, seed, residual=0.2):
    """Friction coefficients that are rough, and then smooth over three cells."""
    rng, n = np.random.default_rng(seed), len(K) // 2
    mean = rng.choice([0.45, 0.7])
    peak = mean + 0.12 * np.convolve(rng.normal(size=n + 2), np.ones(3) / 3**0.5, "valid")
    peak = np.maximum(peak, residual + 0.01)
    weakening = rng.choice([0.05, 0.1, 0.2]) * K[n // 2, n // 2]
    return Friction(peak, np.full(n, residual), np.full(n, weakening))


def to_the_end(contact):
    """Return the status and the loads at all stops of a path until it slides."""
    stops = []
    while not stops or stops[-1][0] in (Status.ARRESTED, Status.UNSTABLE):
        stops.append((follow(contact, np.inf), contact.loads.copy()))
    return stops


def onsets_of(stops):
    return [loads[LOAD] for status, loads in stops if status == Status.UNSTABLE]


def compare(plain, friction, relief=0.0, steps=12, away=1e-5):
    """Check slip and opening at rising loads, also just before and just after each event.

    Return the stops of the path. Each onset is then inside the bracket of two load steps.
    """
    K, T, start = plain.K, plain.T, press(plain.K, plain.T_p, friction, N)
    n, stops = len(friction.peak), to_the_end(begin_push(K, T, start, relief))
    onsets = onsets_of(stops)
    end = onsets[-1]  # there the slider slides
    loads = np.linspace(0.0, end, steps)[1:-1]
    loads = np.union1d(loads, np.outer(onsets, [1.0 - away, 1.0 + away]))
    brute = LoadSteps(
        K + relief * np.outer(T, T), T, *friction, start.forces, np.abs(start.moved[:n]),
        start.moved[n:],
    )  # fmt: skip
    contact, missed = begin_push(K, T, start, relief), 0
    for load in loads[loads < end]:
        while follow(contact, load) != Status.AT_TARGET:
            pass
        if brute.raise_to(load, most=3000) is None:
            missed += 1  # growth just beyond an instability is slow
            continue
        largest = np.abs(brute.x).max()
        np.testing.assert_allclose(contact.moved, brute.x, rtol=0.0, atol=1e-9 * largest)
    assert missed <= 1
    # Beyond the last onset no equilibrium is near.
    if relief == 0.0:
        assert brute.raise_to(end * (1.0 + away), most=300) is None
    return stops


MANY = pytest.param(range(60), {"steps": 40, "away": 1e-3}, marks=pytest.mark.slow)


@pytest.mark.parametrize(("seeds", "options"), [((1, 2), {}), MANY], ids=["two", "many"])
@pytest.mark.parametrize("name", RIGS)
def test_the_path_is_that_of_load_steps(name, seeds, options):
    """Every onset is inside the bracket of two steps."""
    plain = rig(name)
    for seed in seeds:
        friction = random_friction(plain.K, seed, residual=[0.1, 0.2, 0.35][seed % 3])
        compare(plain, friction, **options)


def test_a_machine_unloads_as_in_load_steps():
    plain = rig("acrylic")
    for seed in (3, 4):
        stops = compare(plain, random_friction(plain.K, seed), 0.3 * plain.C, steps=60)
        load, force, peak = np.transpose([loads for _, loads in stops])
        assert peak[-1] >= force.max()
        assert peak[-1] < load[-1]


@pytest.mark.parametrize("seed", [38, 424])
def test_an_edge_closes_where_the_rest_is_unstable(seed):
    # A rigid plate, a push at 55 mm and 1 MPa. The inverse has a negative entry at the edge.
    plain, rng, n = rig("plate"), np.random.default_rng(seed), 24
    rough = rng.normal(size=n if seed % 2 else n + 2)
    rough = rough if seed % 2 else np.convolve(rough, np.ones(3) / 3**0.5, "valid")
    peak = 0.7 + 0.35 * rough
    weakening = np.full(n, 0.3 * plain.K[n // 2, n // 2])
    friction = Friction(np.maximum(peak, 0.25), np.full(n, 0.2), weakening)
    start = press(plain.K, plain.T_p, friction, N)
    contact = begin_push(plain.K, plain.T, start)
    stops = to_the_end(contact)
    # Otherwise a jump would come to rest in a state that jumps at the same load.
    assert np.diff(onsets_of(stops)).min() > 1e-9 * N
    assert contact.counts[N_BORDERED_AGAIN] > 0
    compare(plain, friction)


def test_pressing_that_slips_is_that_of_load_steps():
    plain, n = rig("soft base, tilt"), 24
    friction = Friction(
        np.full(n, 0.12), np.full(n, 0.05), np.full(n, 0.1 * plain.K[n // 2, n // 2])
    )
    start = press(plain.K, plain.T_p, friction, N)
    assert start.moved[:n].max() > 0.0
    assert start.moved[:n].min() < 0.0
    sign = np.ones(2 * n + 1)
    sign[:n] = np.sign(plain.T_p[:n])
    brute = LoadSteps(
        plain.K * sign * sign[:, None], plain.T_p * sign, *friction, 0.0 * sign, np.zeros(n),
        np.zeros(n + 1),
    )  # fmt: skip
    for force in np.geomspace(1e-3, 1.0, 13) * N:
        brute.raise_to(force)
    largest = np.abs(brute.x).max()
    np.testing.assert_allclose(start.moved * sign, brute.x, rtol=0.0, atol=1e-9 * largest)
    compare(plain, friction)


@pytest.mark.parametrize("mean", [0.02, 0.03, 0.05, 0.1, 0.2, 0.4, 0.6])
@pytest.mark.parametrize("name", RIGS)
def test_no_cell_carries_more_than_its_strength(name, mean):
    """After the pressing, and after each stop of the push, in either direction."""
    plain, n, rng = rig(name), 24, np.random.default_rng(1)
    for fall in (0.02, 0.1, 0.3):
        peak = mean * np.exp(0.15 * rng.normal(size=n))
        weakening = np.full(n, fall * plain.K[n // 2, n // 2])
        friction = Friction(peak, 0.4 * peak, weakening)
        pressed = press(plain.K, plain.T_p, friction, N)
        # Slip is along the shear of the pressing alone, or, if slip nearby turned it, of its own.
        slip, shear = pressed.moved[:n], pressed.forces[:n]
        assert np.all((slip * plain.T_p[:n] >= 0.0) | (slip * shear > 0.0))
        contact, status = begin_push(plain.K, plain.T, pressed), Status.ARRESTED
        while status in (Status.ARRESTED, Status.UNSTABLE):
            forces = forces_of(contact, friction)
            present = friction.residual + contact.difference
            strength = present * on_cells(-forces[n:])
            strength -= contact.weakening * contact.moved[:n]
            excess = np.abs(forces[:n]) - strength * (1.0 + 1e-9)
            excess[contact.stack[: contact.counts[N_STACKED]]] = 0.0  # these jump next
            assert excess.max() <= 1e-9 * N / n
            status = follow(contact, np.inf)
            if status == Status.UNSTABLE:  # the top moves, and forces in S stay
                S = contact.inside[: contact.counts[N_INSIDE]]
                top = contact.stack[contact.counts[N_STACKED] - 1]
                left = np.abs(contact.rate @ contact.columns[:, S]).max(initial=0.0)
                assert left < 1e-12 * np.abs(contact.columns).max() * contact.rate.max()
                assert contact.rate[top] == 1.0


def test_stick_widths_of_cattaneo():
    # A cylinder on a half-plane of the same material, which is pressed and then pushed. The part
    # that sticks is sqrt(1 - F/(mu N)) of the contact (Johnson, Contact Mechanics, section 7.2).
    n, mu = 200, 0.5
    edges = np.linspace(-1.0, 1.0, n + 1)
    x, dx = 0.5 * (edges[:-1] + edges[1:]), 2.0 / n

    def integral(z):
        return z * np.log(np.maximum(np.abs(z), 1e-300)) - z

    flexibility = -(integral(edges[1:] - x[:, None]) - integral(edges[:-1] - x[:, None])) / dx
    G = np.linalg.inv(flexibility + 2.0)
    total = G.sum(axis=1)
    K, T = np.eye(2 * n + 1), np.zeros(2 * n + 1)
    K[:n, :n] = G - np.outer(total, total) / total.sum()
    T[:n] = total / total.sum()
    # Pressure at the edges. It is zero at the ends of the contact.
    P = np.sqrt(np.maximum(1.0 - edges**2, 1e-9)) * dx * 2.0 / np.pi
    friction = Friction(np.full(n, mu), np.full(n, mu), np.zeros(n))
    overstress = np.concatenate([np.zeros(n), -P])
    cells = 0.5 * (P[:-1] + P[1:])
    cells[[0, -1]] += 0.5 * P[[0, -1]]
    overstress[:n] = -mu * cells
    contact = make_contact(K, T, friction, overstress, np.zeros(2 * n + 1))
    for push, width in ((0.2, 0.894), (0.4, 0.775), (0.6, 0.632)):
        assert follow(contact, push * mu * P.sum()) == Status.AT_TARGET
        stuck = np.count_nonzero(contact.moved[:n] == 0.0) * dx / 2.0
        assert stuck == pytest.approx(width, abs=1.5 * dx)

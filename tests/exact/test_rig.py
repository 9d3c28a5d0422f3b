"""The stiffness of a slider on a base: conservation laws, closed forms, and equal blocks."""

import numpy as np
import pytest
from recording import stored

from stiction.elasticity.columns import Body, block
from stiction.elasticity.rig import Rig, contact_rig, loaded, on_cells

LENGTH = 0.14
ACRYLIC, STEEL = (1.11e9, 2.65 / 1.35), (77e9, 2.7 / 1.3)
SLIDER = Body(0.075, *ACRYLIC)
PUSH = (0.015, 0.025)
RIGS = stored("cases")["rigs"]


def rig_of(name: str, nodes: int = 64, **more: object) -> Rig:
    given = RIGS[name] | {"base": Body(*RIGS[name]["base"])} | more
    given["push"] = given["push"] and tuple(given["push"])
    return contact_rig(LENGTH, nodes, SLIDER, **given)


@pytest.mark.parametrize("name", RIGS)
def test_motions_of_the_slider_and_sums_of_forces(name):
    """Translation, lift and rotation cause no force. Push and pressing keep their moments.

    Round-off of the merges is 1e-13 of the diagonal, and 1e-12 in sums of forces.
    """
    rig, given = rig_of(name), RIGS[name]
    n = len(rig.T) // 2
    x = np.linspace(0.0, 1.0, n + 1)
    for d, w in ((1.0, 0.0), (0.0, 1.0), (0.0, x)):
        motion = np.concatenate([np.full(n, d), np.broadcast_to(w, n + 1)])
        assert abs(rig.K @ motion).max() < 1e-13 * rig.K.diagonal().max()
    assert np.array_equal(rig.K, rig.K.T)
    height = SLIDER.height if given["push"] is None else np.mean(given["push"])
    P, pressed = -rig.T[n:], -rig.T_p[n:]
    assert rig.T[:n].sum() == pytest.approx(1.0, abs=1e-12)
    assert [P.sum(), P @ x] == pytest.approx([0.0, height / LENGTH], abs=1e-12)
    centre = 0.5 + given.get("tilt", 0.0) / 6.0
    sums = [rig.T_p[:n].sum(), pressed.sum(), pressed @ x]
    assert sums == pytest.approx([0.0, 1.0, centre], abs=1e-12)
    assert on_cells(pressed).sum() == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("pressing", ["soft", "plate"])
def test_energy_and_betti(pressing):
    """(2) and (3) of the rig against the energy of both bodies at random slip and opening."""
    n = 40
    rig = rig_of("acrylic", n, pressing=pressing)
    cell = LENGTH / n
    S, g, travels = loaded(block(Body(0.075, *ACRYLIC), cell, n, push=PUSH), n, pressing, 0.0)
    signs = np.repeat([1.0, -1.0], [n, n + 1])
    below = block(Body(0.03, *ACRYLIC), cell, n, far="fixed", behind=0.06, ahead=0.1)
    S_B = below * np.outer(signs, signs)
    j, F = 1e-6 * np.random.default_rng(1).normal(size=2 * n + 1), 2e4
    u_B = np.linalg.solve(S + S_B, g[:, 0] * F - S @ j)
    u_S = u_B + j
    assert rig.T * F - rig.K @ j == pytest.approx(S_B @ u_B, rel=1e-9, abs=1e-9 * F)
    energy = 0.5 * (u_S @ S @ u_S + u_B @ S_B @ u_B - travels * F**2)
    assert F**2 / (2.0 * rig.C) + 0.5 * j @ rig.K @ j == pytest.approx(energy, rel=1e-11)
    travel = g[:, 0] @ u_S - travels * F
    assert F / rig.C + rig.T @ j == pytest.approx(travel, rel=1e-11)


def test_a_stop_takes_the_push_of_a_base_on_rollers():
    """The length of the base ahead of the slider is a bar that the whole push compresses."""
    name, E_plane = (
        "soft base on rollers",
        8.0 * 0.3e9 / 2.7,
    )  # E = 8 G/(kappa + 1), plane stress
    ends = (0, 0.2), (0, 0.4), (0.2, 0.2)
    compliances = [1.0 / rig_of(name, behind=a, ahead=b).C for a, b in ends]
    assert compliances[1] - compliances[0] == pytest.approx(0.2 / (E_plane * 0.05), rel=0.01)
    assert compliances[2] == pytest.approx(compliances[0], rel=0.02)


# -- closed forms of contact mechanics -----------------------------------------------------------

NU = 0.3
HALF_PLANE = (1.0, 3.0 - 4.0 * NU)


def punch(n: int) -> Rig:
    """A rigid slider of unit length, which does not rotate, on a base twelve times as long."""
    sides = {"behind": 12.0, "ahead": 12.0, "pressing": "plate", "push": None}
    return contact_rig(1.0, n, Body(1.0, 1e7, 3.0 - 4.0 * NU), Body(12.0, *HALF_PLANE), **sides)


def sliding(rig: Rig, mu: float) -> np.ndarray:
    """Forces on the edges, for a unit normal force, where all cells slip at mu N."""
    n = len(rig.T) // 2

    def excess(force: np.ndarray) -> np.ndarray:
        return force[:n] + mu * on_cells(force[n:])

    load = mu * rig.T + rig.T_p
    # Uniform slip changes nothing, so that the system is singular.
    d = np.linalg.lstsq(excess(rig.K[:, :n]), excess(load), rcond=1e-10)[0]
    return -(load - rig.K[:, :n] @ d)[n:]


@pytest.mark.parametrize("mu", [0.0, 0.4])
def test_a_rigid_punch(mu):
    """Pressure x^-a (L - x)^(a-1) sin(pi a)/pi, without friction and sliding towards +x.

    a - 1/2 = atan(mu (1 - 2 nu)/(2 (1 - nu)))/pi. The base and the grid leave 1 to 2 %.
    """
    errors = []
    for n in (64, 128):
        x, P = np.linspace(0.0, 1.0, n + 1), sliding(punch(n), mu)
        a = 0.5 + np.arctan(mu * (1.0 - 2.0 * NU) / (2.0 * (1.0 - NU))) / np.pi
        middle = slice(n // 8, -(n // 8))
        exact = np.sin(np.pi * a) / np.pi * x[middle] ** -a * (1.0 - x[middle]) ** (a - 1.0)
        errors.append(abs(n * P[middle] / exact - 1.0).max())
    assert errors[1] < 0.018
    assert errors[1] < 0.6 * errors[0]  # first order, from the ends


def test_hertz():
    """A rigid cylinder without friction: half-width sqrt(4 N R/(pi E*)), elliptic pressure."""
    n, R, half = 256, 10.0, 0.3
    rig, x = punch(n), np.linspace(-0.5, 0.5, n + 1)
    on_slip = np.linalg.pinv(rig.K[:n, :n], rcond=1e-10)  # uniform slip changes nothing
    K = rig.K[n:, n:] - rig.K[n:, :n] @ on_slip @ rig.K[:n, n:]
    T = rig.T_p[n:] - rig.K[n:, :n] @ on_slip @ rig.T_p[:n]
    E_star = 2.0 / (1.0 - NU)  # E/(1 - nu^2) of the base with G = 1
    N, gap = np.pi * E_star * half**2 / (4.0 * R), x**2 / (2.0 * R)
    closed = abs(x) < 0.2
    for _ in range(30):
        w, opened = -gap, ~closed
        w[opened] = np.linalg.solve(
            K[np.ix_(opened, opened)], T[opened] * N - K[np.ix_(opened, closed)] @ w[closed]
        )
        P = -(T * N - K @ w)
        closed = np.where(closed, P > 0.0, w + gap < 0.0)
    exact = 2.0 * N / (np.pi * half) * np.sqrt(np.maximum(1.0 - (x / half) ** 2, 0.0))
    assert 0.5 * closed.sum() / n == pytest.approx(half, abs=1.0 / n)
    assert abs(n * P - exact).max() < 0.02 * exact.max()


def test_short_waves():
    """K_uu and K_uw of a wave in the middle, for unlike half-planes, on the lattice of the package.

    K_uu = E sin(k dx/2)/dx and K_uw = -beta E times the staggered derivative, with E = 2/(a (1 -
    beta^2)): pressure under w = sin kx contracts the softer body, and shear must stretch it. A wave
    packet of 40 cells leaves 3e-3.
    """
    n = 256
    rig = contact_rig(1.0, n, Body(1.0, *ACRYLIC), Body(1.0, *STEEL), push=None)
    (G, kappa), (G_B, kappa_B) = ACRYLIC, STEEL
    a = (kappa + 1.0) / (4.0 * G) + (kappa_B + 1.0) / (4.0 * G_B)
    beta = ((kappa - 1.0) / (4.0 * G) - (kappa_B - 1.0) / (4.0 * G_B)) / a
    E, phase = 2.0 / (a * (1.0 - beta**2)), 0.9
    cells, edges = np.arange(n) + 0.5 - n / 2, np.arange(n + 1) - n / 2
    middle = slice(n // 2 - 1, n // 2 + 1)

    def packet(function, x):
        return function(phase * x) * np.exp(-((x / 40.0) ** 2))

    d = np.concatenate([packet(np.cos, cells), np.zeros(n + 1)])
    w = np.concatenate([np.zeros(n), packet(np.sin, edges)])
    shear, coupled = (rig.K @ d)[:n][middle], (rig.K @ w)[:n][middle]
    scale = E * np.sin(0.5 * phase)
    assert shear == pytest.approx(scale * packet(np.cos, cells)[middle], abs=4e-3 * scale)
    expected = -beta * scale * packet(np.cos, cells)[middle]
    assert coupled == pytest.approx(expected, abs=4e-3 * scale)


def test_the_corner_of_a_slider():
    """Stress grows as r^(lambda - 1) at a corner of 270 degrees, lambda = 0.5445 and 0.9085.

    Forces at the end node over dx are a sum of both powers of n. Two grids remove the known
    power, two more give the exponent of the remaining power.
    """
    known, forces = np.array([0.5444837, 0.9085292]), []
    for n in (32, 64, 128, 256):
        rig = contact_rig(
            1.0, n, Body(0.6, *HALF_PLANE), Body(0.5, *HALF_PLANE),
            push=(0.2, 0.3), behind=0.5, ahead=0.5,
        )  # fmt: skip
        forces.append([n * rig.T[0], n * rig.T_p[0], n * rig.T_p[n]])
    forces = np.array(forces)
    for exponent, removed, column, atol in ((0, 1, 1, 4e-3), (0, 1, 0, 7e-3), (1, 0, 2, 0.04)):
        rest = forces[1:] - 2.0 ** (1.0 - known[removed]) * forces[:-1]
        slope = 1.0 - np.log2(abs(rest[-1] / rest[-2]))[column]
        assert slope == pytest.approx(known[exponent], abs=atol)

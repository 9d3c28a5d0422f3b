"""The response of blocks against spectral elements on a graded grid, which share no code with it.

Elements of degree 7 shrink by 0.3 from layer to layer towards corners and edges of a push. Their
errors, judged by degrees 7 to 9, are below 3e-7 in C and 1e-5 in q and in the pressure; if a push
ends at the interface, 2e-4 in q, since its step makes their stress oscillate.
"""

import itertools
import math

import numpy as np
import pytest
import scipy.sparse as sparse
from numpy.polynomial import legendre
from recording import stored
from scipy.sparse.linalg import splu

from stiction.elasticity.blocks import Pushes, block_response, glued_pressure
from stiction.elasticity.columns import Body
from stiction.elasticity.rig import contact_rig


class Axis:
    """Gauss-Lobatto elements along a line between breaks, which are graded towards each break."""

    def __init__(self, breaks, size, degree=7, layers=6):
        edges = set(breaks)
        for a, b in itertools.pairwise(breaks):
            count = max(2, int(np.ceil((b - a) / size)))
            inner = np.linspace(a, b, count + 1)[1:-1]
            layer = (b - a) / count * 0.3 ** np.arange(1, layers)
            edges.update([*inner, *(a + layer), *(b - layer)])
        self.edges, self.degree = np.array(sorted(edges)), degree
        roots = legendre.Legendre.basis(degree).deriv().roots().real
        points, (gauss, weights) = np.array([-1.0, *roots, 1.0]), legendre.leggauss(degree + 2)
        self.inverse = np.linalg.inv(legendre.legvander(points, degree))
        values = legendre.legvander(gauss, degree) @ self.inverse
        slopes = legendre.legval(gauss, legendre.legder(np.eye(degree + 1))).T @ self.inverse
        half = 0.5 * np.diff(self.edges)
        self.size = degree * half.size + 1
        self.x = np.zeros(self.size)
        self.mass, self.mixed, self.stiff = (
            sparse.lil_matrix((self.size, self.size)) for _ in range(3)
        )
        for k, h in enumerate(half):
            s = slice(k * degree, (k + 1) * degree + 1)
            self.x[s] = self.edges[k] + h * (1.0 + points)
            self.mass[s, s] += h * (values.T * weights) @ values
            self.mixed[s, s] += (values.T * weights) @ slopes
            self.stiff[s, s] += (slopes.T * weights) @ slopes / h

    def at(self, places):
        """Matrix from values at the points to values at some places."""
        k = np.clip(np.searchsorted(self.edges, places) - 1, 0, self.edges.size - 2)
        a, b = self.edges[k], self.edges[k + 1]
        rows = legendre.legvander((2.0 * places - a - b) / (b - a), self.degree) @ self.inverse
        matrix = np.zeros((places.size, self.size))
        for row, (start, values) in enumerate(zip(k * self.degree, rows, strict=True)):
            matrix[row, start : start + self.degree + 1] = values
        return matrix


class Elements:
    """One block, G = 1; fields are u and then v, x by x."""

    def __init__(self, length, height, kappa, breaks=(), degree=7, ends=(), size=math.inf):
        size = min(size, 0.5 * min(length, height))
        self.across = Axis(sorted({0.0, length, *ends}), size, degree)
        self.up = Axis(sorted({0.0, height, *breaks}), size, degree)
        x, y, lame = self.across, self.up, (3.0 - kappa) / (kappa - 1.0)
        uu = (lame + 2.0) * sparse.kron(x.stiff, y.mass) + sparse.kron(x.mass, y.stiff)
        vv = (lame + 2.0) * sparse.kron(x.mass, y.stiff) + sparse.kron(x.stiff, y.mass)
        uv = lame * sparse.kron(x.mixed.T, y.mixed) + sparse.kron(x.mixed, y.mixed.T)
        self.matrix = sparse.bmat([[uu, uv], [uv.T, vv]], format="csc")
        number = np.arange(2 * x.size * y.size).reshape(2, x.size, y.size)
        self.interface, self.top = number[:, :, 0], number[:, :, -1]
        self.left, self.right = number[0, 0], number[0, -1]

    def push(self, low, high):
        """Forces of a unit push on the left side, spread evenly between two heights."""
        force, (gauss, weights) = np.zeros(self.matrix.shape[0]), legendre.leggauss(8)
        for a, b in itertools.pairwise(self.up.edges):
            if low < 0.5 * (a + b) < high:
                values = self.up.at(0.5 * (a + b) + 0.5 * (b - a) * gauss).T @ weights
                force[self.left] += 0.5 * (b - a) / (high - low) * values
        return force

    def solve(self, given, force=0.0):
        """Displacements with some of them given, and forces on the others."""
        u = np.zeros(self.matrix.shape[0])
        for places, values in given:
            u[places] = values
        free = np.setdiff1d(np.arange(u.size), np.concatenate([places for places, _ in given]))
        inner, load = self.matrix[free][:, free], (force - self.matrix @ u)[free]
        factors = splu(inner, "MMD_AT_PLUS_A", 0.001, options={"SymmetricMode": True})
        solution = factors.solve(load)
        u[free] = solution + factors.solve(load - inner @ solution)  # one step of refinement
        return u

    def stress(self, u, component, places):
        """Stress on the interface, which forces at the points add up to."""
        forces = -(self.matrix @ u)[self.interface[component]]
        return self.across.at(places) @ splu(self.across.mass.tocsc()).solve(forces)


def kolosov(nu, plane):
    return 3.0 - 4.0 * nu if plane == "strain" else (3.0 - nu) / (1.0 + nu)


def middles(length, nodes):
    return (np.arange(nodes) + 0.5) * length / nodes


PUSHES = stored("cases")["pushes"]
LENGTH, SLOW = 1.0, pytest.mark.slow


@pytest.mark.parametrize(
    "name", [*list(PUSHES)[:2], *(pytest.param(name, marks=SLOW) for name in list(PUSHES)[2:])]
)
def test_a_pusher(name):
    """From the left and from both sides."""
    height, nu, plane, low, high, atol = PUSHES[name]
    low, high = low * height, high * height
    kappa, nodes, middle = kolosov(nu, plane), 96, 0.5 * (low + high)
    elements = Elements(LENGTH, height, kappa, (low, high))
    force = elements.push(low, high)
    mirrored = np.zeros(force.size)
    mirrored[elements.right] = force[elements.left]
    u = elements.solve([(elements.interface[0], 0.0), (elements.top[1], 0.0)], force)
    shear = elements.stress(u, 0, middles(LENGTH, nodes))
    sides = (
        (("left",), shear, force @ u),
        (("left", "right"), 0.5 * (shear + shear[::-1]), 0.5 * (force + mirrored) @ u),
    )
    for names, profile, travel in sides:
        response = block_response(
            LENGTH, nodes, height, 1.0, kappa, Pushes(names, middle, high - low)
        )
        assert response.drive_stiffness * travel == pytest.approx(1.0, rel=1e-6)
        np.testing.assert_allclose(response.shear, profile / profile.mean(), atol=atol)
        assert response.shear.min() > 0.0
        assert response.error < 1e-8


def bent(x, length):
    """Slip that vanishes with its slope at both ends, so that sums over nodes are exact."""
    return np.sin(np.pi * x / length) ** 2 * np.exp(x / length)


@pytest.mark.parametrize(
    ("height", "nu", "plane"),
    [
        (0.5, 0.35, "stress"),
        pytest.param(1.7, 0.0, "strain", marks=SLOW),
        pytest.param(0.2, 0.45, "strain", marks=SLOW),
    ],
)
def test_a_glued_top(height, nu, plane):
    kappa, nodes = kolosov(nu, plane), 384
    x = middles(LENGTH, nodes)
    response = block_response(LENGTH, nodes, height, 1.0, kappa, None)
    elements = Elements(LENGTH, height, kappa)
    stuck, (u, v) = (elements.interface[0], 0.0), elements.top
    moved = elements.solve([stuck, (u, 1.0), (v, 0.0)])
    drive = moved @ elements.matrix @ moved
    assert response.drive_stiffness == pytest.approx(drive, rel=1e-6)
    shear = elements.stress(moved, 0, x)
    np.testing.assert_allclose(response.shear, shear / shear.mean(), atol=2e-5)
    pressed = elements.solve([(elements.interface[1], 0.0), (u, 0.0), (v, -1.0)])
    pressure = elements.stress(pressed, 1, x)
    exact = glued_pressure(LENGTH, nodes, height, kappa)
    np.testing.assert_allclose(exact, pressure / pressure.mean(), atol=2e-5)
    # The error of the lattice is the same on rollers: compare what glue adds to the energy.
    energies, slip = [], bent(x, LENGTH)
    for fixed in ([(u, 0.0)], []):
        slid = [(elements.interface[0], 0.5 * bent(elements.across.x, LENGTH)), (v, 0.0)]
        field = elements.solve([*slid, *fixed])
        energies.append(field @ elements.matrix @ field)
    rollers = block_response(
        LENGTH, nodes, height, 1.0, kappa, Pushes(("left",), 0.5 * height, 0.1 * height)
    )
    added = slip @ (response.stiffness - rollers.stiffness) @ slip * 0.5 * LENGTH / nodes
    # What holds the platen; the mean of q over the nodes is not its mean over the interface.
    added += 0.25 * LENGTH * shear.mean() * (response.shear @ slip / nodes) ** 2
    assert added == pytest.approx(energies[0] - energies[1], rel=2e-5)  # falls as 1/nodes²
    assert response.error < 1e-9


def test_a_slider_on_a_longer_base():
    """C and the tractions of a bonded slider, by columns, with a stiffer base of another nu."""
    height, low, high, behind, ahead, n = 0.5, 0.1, 0.2, 0.3, 0.4, 128
    kappa, below, stiffer = kolosov(0.35, "stress"), kolosov(0.2, "stress"), 3.0
    ends = (behind, behind + 1.0)
    top = Elements(1.0, height, kappa, (low, high), degree=6, size=0.15)
    base = Elements(behind + 1.0 + ahead, 0.3, below, degree=6, ends=ends, size=0.15)
    x = base.across.x
    under = (x > behind - 1e-9) & (x < behind + 1.0 + 1e-9)
    np.testing.assert_allclose(x[under] - behind, top.across.x, atol=1e-12)
    # The depth of the base counts downwards. Points in contact have the same displacement.
    size = top.matrix.shape[0]
    place = size + np.arange(base.matrix.shape[0])
    sign = np.ones(place.size)
    sign[place.size // 2 :] = -1.0
    place[base.interface[:, under]] = top.interface
    held = base.top.ravel()
    join = sparse.csr_matrix(
        (sign, (np.arange(place.size), place)), (place.size, size + place.size)
    )
    matrix = join.T @ (stiffer * base.matrix) @ join
    matrix += sparse.block_diag([top.matrix, sparse.csr_matrix((place.size, place.size))])
    force = np.append(top.push(low, high), np.zeros(place.size))
    used = np.setdiff1d(np.flatnonzero(matrix.diagonal()), place[held])
    factors = splu(
        matrix.tocsc()[used][:, used], "MMD_AT_PLUS_A", 0.001, options={"SymmetricMode": True}
    )
    u = np.zeros(force.size)
    u[used] = factors.solve(force[used])
    bodies = Body(height, 1.0, kappa), Body(0.3, stiffer, below)
    rig = contact_rig(1.0, n, *bodies, push=(low, high), behind=behind, ahead=ahead)
    assert rig.C * (force @ u) == pytest.approx(1.0, rel=3e-3)
    middle = slice(n // 16, -n // 16)
    pulled = -top.matrix @ u[:size]  # the slider pulls the base
    mass = splu(top.across.mass.tocsc())
    for component, T, places in (
        (0, rig.T[:n], middles(1.0, n)),
        (1, rig.T[n:], np.arange(n + 1) / n),
    ):
        traction = top.across.at(places) @ mass.solve(pulled[top.interface[component]])
        np.testing.assert_allclose(
            n * T[middle], traction[middle], atol=0.01 * abs(n * T).max()
        )

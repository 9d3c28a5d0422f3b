"""Sliders on a base, assembled at once: energy on staggered lines, and condensation with numpy.

The energy of cells and edges is that of `stiction.elasticity.rig`. Here all lines of a body are
put into a single sparse matrix, the mesh across the interface is uniform, and the columns beyond
the slider have the width of the cells. Nothing is merged or doubled.
"""

import itertools
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg


@dataclass(frozen=True)
class PlainRig:
    """Stiffness (2n+1, 2n+1) over [slip, opening], forces of unit loads (2n+1,), and C."""

    K: np.ndarray
    T: np.ndarray
    T_p: np.ndarray
    C: float


def line_matrices(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (N, N), (N, N') and (N', N') of linear elements between points (m,)."""
    m, h = len(points), np.diff(points)
    mass, mixed, stiff = np.zeros((3, m, m))
    for e, width in enumerate(h):
        at = np.ix_([e, e + 1], [e, e + 1])
        mass[at] += width / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
        mixed[at] += 0.5 * np.array([[-1.0, 1.0], [-1.0, 1.0]])
        stiff[at] += np.array([[1.0, -1.0], [-1.0, 1.0]]) / width
    return mass, mixed, stiff


def body(cells: int, h: float, y: np.ndarray, E: float, nu: float) -> sp.csc_matrix:
    """Return the stiffness of a body, plane stress, over u (cells, y) and v (cells + 1, y)."""
    G = E / (2.0 * (1.0 + nu))
    lame = E * nu / (1.0 - nu**2)  # plane stress
    P = lame + 2.0 * G
    M, D, S = line_matrices(y)
    m = len(y)
    u = np.arange(cells * m).reshape(cells, m)
    v = cells * m + np.arange((cells + 1) * m).reshape(cells + 1, m)
    cell = G * np.block([[M / h, -D, -M / h], [-D.T, h * S, D.T], [-M / h, D, M / h]])
    edge = np.block(
        [
            [P * M / h, -lame * D, -P * M / h],
            [-lame * D.T, h * P * S, lame * D.T],
            [-P * M / h, lame * D, P * M / h],
        ]
    )
    end = 4.0 * G * (lame + G) / P * 0.5 * h * S
    blocks = [(cell, [v[a], u[a], v[a + 1]]) for a in range(cells)]
    blocks += [(edge, [u[b - 1], v[b], u[b]]) for b in range(1, cells)]
    blocks += [(end, [v[0]]), (end, [v[cells]])]
    rows, columns, entries = [], [], []
    for matrix, parts in blocks:
        places = np.concatenate(parts)
        rows.append(np.repeat(places, len(places)))
        columns.append(np.tile(places, len(places)))
        entries.append(matrix.ravel())
    size = (2 * cells + 1) * m
    joined = [np.concatenate(some) for some in (entries, rows, columns)]
    return sp.csc_matrix((joined[0], (joined[1], joined[2])), shape=(size, size))


def condensed(matrix, loads, kept):
    """Return the stiffness of kept unknowns, the loads on them, and the loads' own compliance."""
    rest = np.setdiff1d(np.arange(matrix.shape[0]), kept)
    solver = scipy.sparse.linalg.splu(matrix[rest][:, rest].tocsc())
    coupling = matrix[rest][:, kept].toarray()
    moved = solver.solve(loads[rest])
    stiffness = matrix[kept][:, kept].toarray() - coupling.T @ solver.solve(coupling)
    return stiffness, loads[kept] - coupling.T @ moved, loads[rest].T @ moved


def plain_rig(
    n: int = 32,
    length: float = 0.14,
    height: float = 0.075,
    solid: tuple[float, float] = (3e9, 0.35),
    base_height: float = 0.03,
    base_solid: tuple[float, float] | None = None,
    beyond: int = 16,
    push: tuple[float, float] = (0.006, 0.004),
    tilt: float = 0.0,
    plate: bool = False,
    lines: int = 24,
) -> PlainRig:
    """Return the rig of a slider on a fixed base that is `beyond` cells longer on either side."""
    h = length / n
    # Slider.
    y = np.unique(
        np.concatenate(
            [
                np.linspace(0.0, height, lines),
                np.linspace(0.0, min(4.0 * h, height), 9),
                push[0] + push[1] * np.linspace(-0.5, 0.5, 3),
            ]
        ).round(12)
    )
    m = len(y)
    K = body(n, h, y, *solid)
    u = np.arange(n * m).reshape(n, m)
    v = n * m + np.arange((n + 1) * m).reshape(n + 1, m)
    loads = np.zeros((K.shape[0], 2))
    E, nu = solid
    G, lame = E / (2.0 * (1.0 + nu)), E * nu / (1.0 - nu**2)
    P = lame + 2.0 * G
    for a, b in itertools.pairwise(y):
        k = int(np.flatnonzero(y == a)[0])
        if a >= push[0] - 0.5 * push[1] - 1e-9 and b <= push[0] + 0.5 * push[1] + 1e-9:
            loads[u[0, k : k + 2], 0] += 0.5 * (b - a) / push[1]
            loads[v[0, k : k + 2], 0] += 0.5 * h * lame / P / push[1] * np.array([-1.0, 1.0])
    x = np.linspace(0.0, length, n + 1)
    weights = np.full(n + 1, h)
    weights[[0, -1]] *= 0.5
    slope = (2.0 * x / length - 1.0) * weights
    slope[0] += h * h / (3.0 * length)  # the exact integrals of half a hat
    slope[-1] -= h * h / (3.0 * length)
    loads[v[:, -1], 1] = -(weights + tilt * slope) / length
    if plate:
        # All points of the top have a single height.
        keep = np.setdiff1d(np.arange(K.shape[0]), v[1:, -1])
        place = np.zeros(K.shape[0], dtype=int)
        place[keep] = np.arange(len(keep))
        place[v[1:, -1]] = place[v[0, -1]]
        ones = np.ones(K.shape[0])
        sums = sp.csc_matrix((ones, (np.arange(K.shape[0]), place)))
        K, loads = (sums.T @ K @ sums).tocsc(), sums.T @ loads
        u, v = place[u], place[v]
    kept = np.concatenate([u[:, 0], v[:, 0]])
    S_S, g, own = condensed(K, loads, kept)
    S_gg = -own[0, 0] - 0.5 * h / (P * push[1])
    # Base: y runs from its bottom to the interface.
    y = np.unique(
        np.concatenate(
            [
                np.linspace(-base_height, 0.0, lines),
                np.linspace(-min(4.0 * h, base_height), 0.0, 9),
            ]
        ).round(12)
    )
    m, cells = len(y), n + 2 * beyond
    K = body(cells, h, y, *(base_solid or solid))
    u = np.arange(cells * m).reshape(cells, m)
    v = cells * m + np.arange((cells + 1) * m).reshape(cells + 1, m)
    free = np.setdiff1d(np.arange(K.shape[0]), np.concatenate([u[:, 0], v[:, 0]]))
    place = np.zeros(K.shape[0], dtype=int)
    place[free] = np.arange(len(free))
    inside = slice(beyond, beyond + n)
    tops = np.concatenate([u[inside, -1], v[beyond : beyond + n + 1, -1]])
    S_B, _, _ = condensed(K[free][:, free].tocsc(), np.zeros((len(free), 1)), place[tops])
    A = S_S + S_B
    T = S_B @ np.linalg.solve(A, g)
    stiffness = S_B @ np.linalg.solve(A, S_S)
    C = 1.0 / (g[:, 0] @ np.linalg.solve(A, g[:, 0]) - S_gg)
    return PlainRig(0.5 * (stiffness + stiffness.T), T[:, 0].copy(), T[:, 1].copy(), float(C))


class LoadSteps:
    """Brute force: the least equilibrium above the present slip, at one load after the other.

    The load is D. Projected Newton steps on the nodes that are beyond their strength stop at each
    corner. If the matrix of these nodes has a pivot that is not positive, the strength is held
    during a step instead, which always stays below the least equilibrium.
    """

    def __init__(self, K, T, peak, residual, weakening, forces, slip, opening):
        self.n = n = len(peak)
        self.K, self.T, self.peak, self.residual = K, T, peak, residual
        self.W = np.asarray(weakening, float)
        self.forces, self.x0 = forces.copy(), np.concatenate([slip, opening])
        self.x, self.load = self.x0.copy(), 0.0
        self.Q = np.zeros((n, n + 1))
        for a in range(n):
            self.Q[a, a] = 1.0 if a == 0 else 0.5
            self.Q[a, a + 1] = 1.0 if a == n - 1 else 0.5
        self.passed = np.zeros(n, bool)
        self._note_corners(self._forces(self.x, 0.0))

    def _forces(self, x, load):
        return self.forces + load * self.T - self.K @ (x - self.x0)

    def _above_corner(self, f, x):
        N = -self.Q @ f[self.n :]
        return (self.peak - self.residual) * N - self.W * x[: self.n]

    def _note_corners(self, f):
        scale = 1e-11 * np.abs(f).max()
        self.passed |= (self._above_corner(f, self.x) <= scale) & (self.x[: self.n] > 0.0)

    def _overstress(self, x, load):
        f, n = self._forces(x, load), self.n
        N = -self.Q @ f[n:]
        mu = np.where(self.passed, self.residual, self.peak)
        o = f.copy()
        o[:n] -= mu * N - np.where(self.passed, 0.0, self.W) * x[:n]
        return o, f

    def _matrix(self, held_strength=False):
        n, M = self.n, self.K.copy()
        mu = np.where(self.passed, self.residual, self.peak)
        M[:n] += mu[:, None] * (self.Q @ self.K[n:])
        if not held_strength:
            M[np.arange(n), np.arange(n)] -= np.where(self.passed, 0.0, self.W)
        return M

    def raise_to(self, load, most=20000):
        """Move to a load. Return whether slip jumped, or None if no equilibrium was reached."""
        n, lowest, jumped = self.n, self.x.copy(), False
        lowest[n:] = 0.0
        active = np.zeros(len(self.x), bool)
        for _ in range(most):
            o, f = self._overstress(self.x, load)
            tol = 1e-13 * np.abs(f).max()
            active[:n] &= self.x[:n] > lowest[:n]
            active[n:] = self.x[n:] > 0.0
            active |= o > tol
            if np.abs(o[active]).max(initial=0.0) <= tol:
                self.load = load
                self._note_corners(f)
                return jumped
            A = np.flatnonzero(active)
            M = self._matrix()[np.ix_(A, A)]
            step, longest = np.zeros(len(self.x)), 1.0
            if positive_pivots(M):
                step[A] = np.linalg.solve(M, o[A])
            else:
                jumped = True
                held = self._matrix(held_strength=True)[np.ix_(A, A)]
                step[A] = np.linalg.solve(held, o[A])
                # As long as all nodes are beyond their strength, slip is too small.
                falls = M @ step[A]
                some = falls > 1e-9 * np.abs(o[A]).max()
                longest = 0.9 * float((o[A][some] / falls[some]).min(initial=1e3))
                longest = max(1.0, longest)
                step *= longest
            # Up to the first corner, and not below the bounds.
            before = self._above_corner(f, self.x)
            after = self._above_corner(self._forces(self.x + step, load), self.x + step)
            scale = 1e-13 * np.abs(f).max()
            crosses = ~self.passed & (after < -scale) & ((step[:n] > 0) | (self.x[:n] > 0))
            share = 1.0  # and not to where a further node starts, if the step is long
            if longest > 1.0:
                further = self._overstress(self.x + step, load)[0]
                starts = ~active & (further > tol)
                if starts.any():
                    rise = (further - o)[starts]
                    share = float(((tol - o)[starts] / rise).clip(1.0 / longest, 1.0).min())
            if crosses.any():
                share = min(
                    share, float((before / (before - after))[crosses].clip(0.0, 1.0).min())
                )
            self.x = np.maximum(self.x + share * step, lowest)
            _, f = self._overstress(self.x, load)
            self._note_corners(f)
            if self.x.max() > 1.0:  # m
                return None
        return None


def positive_pivots(M):
    """Return whether elimination without exchanges meets positive pivots only."""
    M = M.copy()
    for k in range(len(M)):
        if not M[k, k] > 1e-12 * abs(M).max():
            return False
        M[k + 1 :, k:] -= np.outer(M[k + 1 :, k] / M[k, k], M[k, k:])
    return True

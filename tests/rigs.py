"""The path of a slider by load steps."""

import numpy as np


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
        self.Q = 0.5 * (np.eye(n, n + 1) + np.eye(n, n + 1, 1))
        self.Q[0, 0] = self.Q[-1, -1] = 1.0
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
                try:
                    step[A] = np.linalg.solve(held, o[A])
                except np.linalg.LinAlgError:  # if all cells slip alike, no force holds them
                    return None
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
                passed = (before / (before - after))[crosses].clip(0.0, 1.0)
                share = min(share, float(passed.min()))
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

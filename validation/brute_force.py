"""The quasi-static path of a specimen by brute force, and the energy that it releases.

Slip rates solve a complementarity problem with the true stiffness in every state, by nothing but
dense linear algebra of numpy; slip is irreversible, and no theorem on signs is relied on.
"""

from typing import Any, NamedTuple

import numpy as np
import scipy.linalg

import stiction as st

AT = 1e-9
"""Share of the mean strength within which a node is at its strength, and of a corner at it."""


class BruteForce:
    """One sample, from rest to sliding: rates by complementarity, each jump to the next rest.

    Attributes
    ----------
    load, peak : float
        The drive at which the interface slides; the largest mean stress on the way, Pa.
    first : float or None
        Mean stress at the first instability, Pa.
    drops : list of float
        Fall of the mean stress in each arrested event, Pa.
    kinks : list of float
        Drives at which a node begins to slip or passes a corner of its law, Pa.
    """

    def __init__(self, problem: st.Problem, strength: Any) -> None:
        rows, law = problem.sample(strength), problem.friction
        self.K, self.q = problem.blocks.stiffness, rows.load_profile
        self.s = rows.strength[0] - rows.initial_stress[0]
        self.r = rows.residual_strength[0] - rows.initial_stress[0]
        linear = isinstance(law, st.LinearWeakening)
        self.u, self.f = ([0.0, 1.0], [1.0, 0.0]) if linear else law.corners
        slopes = -np.diff(self.f) / np.diff(self.u)
        self.critical = slopes[0] * (self.s - self.r) / rows.weakening_rate[0]
        self.slopes = np.append(slopes, 0.0)
        self.ends = np.append(self.u[1:], np.inf)
        self.relief, self.initial = problem.blocks.relief, rows.initial_stress.mean()
        self.scale = np.abs(self.s).mean()
        self.load, self.slip = float((self.s / self.q).min()), np.zeros(self.s.size)
        self.peak, self.first, self.drops = self.carried, None, []
        self.slides, self.kinks = False, [self.load]

    @property
    def carried(self) -> float:
        """Mean stress of the interface, Pa."""
        return self.initial + self.load - self.relief * (self.q * self.slip).mean()

    @property
    def piece(self) -> np.ndarray:
        """The piece of its law on which each node is."""
        return np.searchsorted(self.ends[:-1] * (1.0 - AT), self.slip / self.critical, "right")

    @property
    def over(self) -> np.ndarray:
        """Stress less strength, Pa."""
        strength = self.r + (self.s - self.r) * np.interp(
            self.slip / self.critical, self.u, self.f
        )
        return self.load * self.q - self.K @ self.slip - strength

    def complementary(self, drive: np.ndarray) -> tuple[np.ndarray, bool]:
        """Return slip z >= 0 where nodes are at their strength, with A z = drive where z > 0.

        A is K less the present weakening. Or a z > 0 with A z <= 0, if there is one, and False.
        """
        a = self.K - np.diag(self.slopes[self.piece] * (self.s - self.r) / self.critical)
        moving, z = self.over > -AT * self.scale, np.zeros(self.s.size)
        while moving.any():
            at = np.flatnonzero(moving)
            block = a[np.ix_(at, at)]
            lowest, mode = scipy.linalg.eigh(block, subset_by_index=[0, 0])
            if lowest[0] <= 1e-10 * self.K[0, 0]:
                z[at] = np.abs(mode[:, 0])
                return z, False
            z[at] = np.linalg.solve(block, drive[at])
            if z.min() >= 0.0:
                break
            moving &= z > 0.0
            z[:] = 0.0
        return z, True

    def move(self, z: np.ndarray, longest: float) -> float:
        """Slip along z, at most so many times, as far as the first corner; return how far."""
        end = self.ends[self.piece] * self.critical
        reach = np.full(z.size, np.inf)
        np.divide(end - self.slip, z, out=reach, where=z > 0.0)
        size = min(longest, max(float(reach.min()), 0.0))
        if size < np.inf:
            there = reach <= size * (1.0 + 1e-12)
            self.slip = np.where(there, end, self.slip + size * z)
        return size

    def step(self, rate: np.ndarray) -> None:
        """Raise the drive until a node reaches its strength or a corner."""
        closing = self.q - self.K @ rate
        left = np.full(rate.size, np.inf)
        rests = (rate == 0.0) & (closing > 0.0) & (self.over <= -AT * self.scale)
        np.divide(-self.over, closing, out=left, where=rests)
        self.load += self.move(rate, float(left.min()))
        self.peak = max(self.peak, self.carried)
        self.kinks.append(self.load)

    def jump(self) -> None:
        """Slip at a fixed drive, along what is unstable or towards rest, corner by corner."""
        before = self.carried
        self.first = before if self.first is None else self.first
        for _ in range(100 * self.s.size):
            z, stable = self.complementary(self.over)
            size = self.move(z, 1.0 if stable else np.inf)
            if size == np.inf or (self.slip > 0.0).all():
                self.slides = True
                return
            if stable and size == 1.0 and self.over.max() <= AT * self.scale:
                self.drops.append(before - self.carried)
                return
        raise AssertionError("no rest")

    def run(self) -> "BruteForce":
        """Follow the path until the whole interface slides."""
        while not self.slides:
            rate, stable = self.complementary(self.q)
            if stable:
                self.step(rate)
                self.slides = bool((self.slip > 0.0).all())
            else:
                self.jump()
        return self


class Balance(NamedTuple):
    """Energy per unit depth between successive drives, J/m.

    `lost` is the work at the grips less what is stored and what friction takes; `jumps` are the
    steps in which an event lies. `back` is how far slip goes back, as a share of the largest.
    """

    work: np.ndarray
    lost: np.ndarray
    jumps: np.ndarray
    back: float


def energy(problem: st.Problem, strength: Any, kinks: Any) -> Balance:
    """Return the balance of one sample along `stiction.equilibrium_path`, between all kinks."""
    at = st.equilibrium_path(problem, strength, [1.0]).event_load.values
    loads = np.unique(np.concatenate([[1.0], kinks, at, at * (1.0 + 1e-13)]))
    path = st.equilibrium_path(problem, strength, loads)
    path = path.isel(load=~path.sliding.values)
    rows, d, blocks = problem.sample(strength), path.slip.values, problem.blocks
    cell, q = problem.interface.cell, blocks.shear
    initial, residual = rows.initial_stress[0], rows.residual_strength[0]
    force = (path.mean_stress.values - initial.mean()) * problem.interface.extent
    work = 0.5 * (force[1:] + force[:-1]) * np.diff(path.travel.values)
    dead = blocks.stiffness - blocks.relief / q.size * np.outer(q, q)
    stored = force**2 / blocks.drive_stiffness
    stored += 0.5 * cell * np.einsum("ti,ij,tj->t", d, dead, d)
    drop = rows.strength[0] - residual
    spent = problem.friction.dissipated(d, drop, rows.weakening_rate[0])
    spent = cell * (spent + (residual - initial) * d).sum(axis=1)
    lost = work - np.diff(stored) - np.diff(spent)
    back = max(0.0, -np.diff(d, axis=0).min() / d.max())
    return Balance(work, lost, np.diff(path.arrested_events.values) > 0, back)

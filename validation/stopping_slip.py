"""The quasi-static path of a specimen by brute force, where nodes may stop.

Slip rates solve a complementarity problem with the true stiffness in every state, by Keller's
principal pivots (1973) with nothing but dense linear algebra; slip is irreversible, nodes stop and
slip again, and no theorem on signs is relied on.
"""

from typing import Any

import numpy as np

import stiction as st

AT = 1e-9
"""Share of the mean strength within which a node is at its strength, and of a corner at it."""
PIVOTS, EVENTS = 100, 200
"""Most pivots of a minimum and most events of a path, for each node: round-off may repeat them."""
ELASTIC = 20
"""Elastic steps of a jump after which one with the present weakening is taken."""


class StoppingBruteForce:
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
    stops, stops_at_corners, stops_in_jumps : int
        How often a node that slipped rests in the next step, how often as another has just reached
        a corner, and after a step of a jump.
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
        self.rate = np.zeros(self.s.size)
        self.stops = self.stops_at_corners = self.stops_in_jumps = 0

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

    def complementary(
        self, drive: np.ndarray, start: Any, elastic: bool = False
    ) -> tuple[np.ndarray, bool]:
        """Return the z >= 0 next to `start` at which <z, A z>/2 - <drive, z> is least.

        A is K less the present weakening, on the nodes at their strength; `elastic`, it is K, on
        all. Or a direction z >= 0 in which nothing bounds it, and False.
        """
        rate = self.slopes[self.piece] * (self.s - self.r) / self.critical
        a = self.K if elastic else self.K - np.diag(rate)
        at = (self.over > -AT * self.scale) | elastic
        z = np.where(at, start, 0.0)
        least = 1e-12 * np.abs(drive).max()
        if z.any() and np.linalg.eigvalsh(a[np.ix_(z > 0.0, z > 0.0)])[0] <= 0.0:
            z[:] = 0.0
        free, joins = z > 0.0, -1
        for _ in range(PIVOTS * z.size):
            slope, d = a @ z - drive, np.zeros(z.size)
            if joins < 0 and np.abs(slope[free]).max(initial=0.0) <= least:
                joins = int(np.where(at & ~free, slope, np.inf).argmin())
                if not at[joins] or free[joins] or slope[joins] >= -least:
                    return z, True
            # Those that slip come to their minimum first; then the worst at rest joins them.
            if joins < 0:
                d[free], longest = -np.linalg.solve(a[np.ix_(free, free)], slope[free]), 1.0
            else:
                d[joins] = 1.0
                d[free] = -np.linalg.solve(a[np.ix_(free, free)], a[free, joins])
                bend = float(d @ a @ d)
                longest = -slope[joins] / bend if bend > 1e-13 * self.K[0, 0] else np.inf
            reach = np.full(z.size, np.inf)
            np.divide(-z, d, out=reach, where=free & (d < -1e-11 * np.abs(d).max()))
            size = min(float(reach.min()), longest)
            if size == np.inf:
                return np.maximum(d, 0.0), False
            z = np.maximum(z + size * d, 0.0)
            if reach.min() < longest:
                out = int(reach.argmin())
                free[out], z[out] = False, 0.0
            elif joins >= 0:
                free[joins], joins = True, -1
        raise AssertionError(f"no minimum after {PIVOTS} pivots a node")

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

    def jump(self, along: np.ndarray) -> None:
        """Slip at a fixed drive: along what is unstable, then as an overdamped interface would.

        Each elastic step is the slip z >= 0 that brings no stress above the strengths of before.
        """
        before = self.carried
        self.first = before if self.first is None else self.first
        if self.move(along, np.inf) == np.inf:
            self.slides = True
            return
        for count in range(20_000):
            over = self.over
            if over.max() <= AT * self.scale:
                self.drops.append(before - self.carried)
                return
            if self.relief == 0.0 and over.sum() > 0.0:  # K takes nothing off the mean
                self.slides = True
                return
            if count % ELASTIC == ELASTIC - 1:
                z, stable = self.complementary(over, 0.0)
                size = self.move(z, 1.0 if stable else np.inf)
            else:
                z, size = self.complementary(over, 0.0, elastic=True)[0], 1.0
                self.slip = self.slip + z
            self.stops_in_jumps += int(
                np.sum((self.slip > 0.0) & (self.over < -1e-6 * self.scale))
            )
            if size == np.inf or (self.slip > 0.0).all():
                self.slides = True
                return
        raise AssertionError("no rest")

    def run(self) -> "StoppingBruteForce":
        """Follow the path until the whole interface slides."""
        piece = self.piece
        for _ in range(EVENTS * piece.size):
            if self.slides:
                return self
            rate, stable = self.complementary(self.q, self.rate)
            if stable:
                stop = int(((rate == 0.0) & (self.rate > 0.0)).sum())
                self.stops += stop
                if ((self.piece > piece) & (self.rate > 0.0)).any():
                    self.stops_at_corners += stop
                piece = self.piece
                self.rate = rate
                self.step(rate)
                self.slides = bool((self.slip > 0.0).all())
            else:
                self.rate = np.zeros(rate.size)
                self.jump(rate)
        raise AssertionError(f"no sliding after {EVENTS} events a node")

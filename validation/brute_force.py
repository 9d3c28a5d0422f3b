"""The quasi-static path of a specimen by two plain ways, and the energy that it releases.

By brute force slip rates solve a complementarity problem with the true stiffness in every state, by
Keller's principal pivots (1973) with nothing but dense linear algebra; slip is irreversible, nodes
stop and slip again, and no theorem on signs is relied on. The other way raises the drive in small
steps, and lets nodes slip, never back, until none is above its strength.
"""

from typing import Any, NamedTuple

import numba
import numpy as np

import stiction as st

AT = 1e-9
"""Share of the mean strength within which a node is at its strength, and of a corner at it."""
PIVOTS, EVENTS = 100, 200
"""Most pivots of a minimum and most events of a path, for each node."""
ELASTIC = 20
"""Elastic steps of a jump after which one with the present weakening is taken."""


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
    direction : (n,) array
        In which the first instability slips.
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
        self.v = np.zeros(self.s.size)
        self.stops = self.stops_at_corners = self.stops_in_jumps = 0

    @property
    def carried(self) -> float:
        """Mean stress of the interface, Pa."""
        return self.initial + self.load - self.relief * (self.q * self.slip).mean()

    @property
    def piece(self) -> np.ndarray:
        """The piece of its law on which each node is."""
        return np.searchsorted(self.ends[:-1] * (1.0 - AT), self.slip / self.critical, "right")

    def strength(self, slip: np.ndarray) -> np.ndarray:
        """Strength less initial stress at these slips, Pa."""
        share: np.ndarray = np.interp(slip / self.critical, self.u, self.f)
        return self.r + (self.s - self.r) * share

    @property
    def over(self) -> np.ndarray:
        """Stress less strength, Pa."""
        return self.load * self.q - self.K @ self.slip - self.strength(self.slip)

    def complementary(
        self, drive: np.ndarray, start: Any, elastic: bool = False
    ) -> tuple[np.ndarray, bool]:
        """Return the z >= 0 next to `start` at which <z, A z>/2 - <drive, z> is least.

        A is K less the present weakening, on the nodes at their strength; `elastic`, it is K, on
        all. Or a direction z >= 0 in which nothing bounds it, and False.
        """
        W = self.slopes[self.piece] * (self.s - self.r) / self.critical
        a = self.K if elastic else self.K - np.diag(W)
        at = (self.over > -AT * self.scale) | elastic
        z = np.where(at, start, 0.0)
        least = 1e-12 * np.abs(drive).max()
        if z.any() and np.linalg.eigvalsh(a[np.ix_(z > 0.0, z > 0.0)])[0] <= 0.0:
            z[:] = 0.0
        free, joins, settled = z > 0.0, -1, not z.any()
        for _ in range(PIVOTS * z.size):
            slope, d = a @ z - drive, np.zeros(z.size)
            if settled:
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
            settled = joins < 0 and longest <= reach.min()
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

    def step(self, v: np.ndarray) -> None:
        """Raise the drive until a node reaches its strength or a corner."""
        closing = self.q - self.K @ v
        left = np.full(v.size, np.inf)
        rests = (v == 0.0) & (closing > 0.0) & (self.over <= -AT * self.scale)
        np.divide(-self.over, closing, out=left, where=rests)
        self.load += self.move(v, float(left.min()))
        self.peak = max(self.peak, self.carried)
        self.kinks.append(self.load)

    def jump(self, along: np.ndarray) -> None:
        """Slip at a fixed drive: along what is unstable, then as an overdamped interface would.

        Each elastic step is the slip z >= 0 that brings no stress above the strengths of before.
        """
        before = self.carried
        if self.first is None:
            self.first, self.direction = before, along
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
                z, size = self.complementary(over, np.maximum(over, 0.0), elastic=True)[0], 1.0
                self.slip = self.slip + z
            self.stops_in_jumps += int(
                np.sum((self.slip > 0.0) & (self.over < -1e-6 * self.scale))
            )
            if size == np.inf or (self.slip > 0.0).all():
                self.slides = True
                return
        raise AssertionError("no rest")

    def run(self) -> "BruteForce":
        """Follow the path until the whole interface slides."""
        piece = self.piece
        for _ in range(EVENTS * piece.size):
            if self.slides:
                return self
            v, stable = self.complementary(self.q, self.v)
            if stable:
                stop = int(((v == 0.0) & (self.v > 0.0)).sum())
                self.stops += stop
                if ((self.piece > piece) & (self.v > 0.0)).any():
                    self.stops_at_corners += stop
                piece = self.piece
                self.v = v
                self.step(v)
                self.slides = bool((self.slip > 0.0).all())
            else:
                self.v = np.zeros(v.size)
                self.jump(v)
        raise AssertionError(f"no sliding after {EVENTS} events a node")


class Along(NamedTuple):
    """The states along a path, and the energy per unit depth between successive drives, J/m.

    `lost` is the work at the grips less what is stored and what friction takes; `jumps` are the
    steps in which an event lies. As shares of the mean strength: `stress` is how far that of the
    path is from that of its own slip, `over` the largest stress less strength, `off` the largest
    distance of a slipping node from its strength; as a share of the largest slip, `back` is how far
    slip goes back. `rests` counts nodes below their strength after slip, `again` those that go on.
    """

    work: np.ndarray
    lost: np.ndarray
    jumps: np.ndarray
    stress: float
    over: float
    off: float
    back: float
    rests: int
    again: int

    @property
    def imbalance(self) -> float:
        """Energy lost outside of events, as a share of all work."""
        return float(np.abs(self.lost[~self.jumps]).sum() / self.work.sum())


def along(problem: st.Problem, strength: Any, kinks: Any) -> Along:
    """Return what one sample does along `stiction.equilibrium_path`, between all kinks."""
    at = st.equilibrium_path(problem, strength, [1.0]).event_load.dropna("event").values
    loads = np.unique(np.concatenate([[1.0], kinks, at, at * (1.0 + 1e-13)]))
    path = st.equilibrium_path(problem, strength, loads)
    path = path.isel(load=~path.sliding.values)
    rows, d, blocks = problem.sample(strength), path.slip.values, problem.blocks
    cell, q = problem.interface.cell, blocks.shear
    initial, residual = rows.initial_stress[0], rows.residual_strength[0]
    force = (path.mean_stress.values - initial.mean()) * problem.interface.measure
    work = 0.5 * (force[1:] + force[:-1]) * np.diff(path.travel.values)
    dead = blocks.stiffness - blocks.relief / q.size * np.outer(q, q)
    stored = force**2 / blocks.drive_stiffness
    stored += 0.5 * cell * np.einsum("ti,ij,tj->t", d, dead, d)
    drop, scale = rows.strength[0] - residual, rows.strength[0].mean()
    spent = problem.friction.dissipated(d, drop, rows.weakening_rate[0])
    spent = cell * (spent + (residual - initial) * d).sum(axis=1)
    jumps = np.diff(path.arrested_events.values) > 0
    stress = path["load"].values[:, None] * q + initial - d @ blocks.stiffness
    brute = BruteForce(problem, strength)
    over = stress - initial - brute.strength(d)
    slips = np.diff(d, axis=0) > 1e-9 * d.max()
    rests = (d > 0.0) & (over < -1e-6 * scale)
    return Along(
        work,
        work - np.diff(stored) - np.diff(spent),
        jumps,
        float(np.abs(path.stress.values - stress).max() / scale),
        float(over.max() / scale),
        float(np.abs(over[1:][slips & ~jumps[:, None]]).max(initial=0.0) / scale),
        max(0.0, -np.diff(d, axis=0).min(initial=0.0) / max(d.max(), 1e-300)),
        int(rests.sum()),
        int((rests[:-1] & slips).sum()),
    )


@numba.njit
def _raise(
    K: Any, q: Any, s: Any, r: Any, critical: Any, corners: Any, relief: float, step: float
) -> tuple[float, float, float]:
    """See `stepped`, which counts stress from the initial one on."""
    n = s.size
    slip, taken = np.zeros(n), np.zeros(n)
    load = np.min(s / q)
    peak, first = load, np.nan
    while True:
        before, old = load - relief * (q * slip).mean(), slip.copy()
        for _ in range(200_000):
            worst = 0.0
            for i in range(n):
                share = np.interp(slip[i] / critical[i], corners[0], corners[1])
                over = load * q[i] - taken[i] - r[i] - (s[i] - r[i]) * share
                worst = max(worst, over)
                if over > 0.0:
                    slip[i] += 0.5 * over / K[i, i]
                    taken += 0.5 * over / K[i, i] * K[:, i]
            if worst < 1e-8 * s.mean() or slip.min() > 0.0:
                break
        peak = max(peak, before)
        if slip.min() > 0.0:
            return load, peak, first
        if np.isnan(first) and ((slip - old) / critical).max() > 0.05:
            first = before
        peak = max(peak, load - relief * (q * slip).mean())
        load += step


def stepped(problem: st.Problem, strength: Any, step: float) -> tuple[float, float, float]:
    """Raise the drive in steps of this share of the mean strength; slip relaxes node by node.

    Returns the drive at which the interface slides, the largest mean stress, and the one before the
    first step in which a node slips by a twentieth of its critical slip: steep growth counts, too.
    """
    one = BruteForce(problem, strength)
    corners = np.array([one.u, one.f])
    load, peak, first = _raise(
        one.K, one.q, one.s, one.r, one.critical, corners, one.relief, step * one.s.mean()
    )
    return load, peak + one.initial, first + one.initial

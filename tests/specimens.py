"""Specimens for tests, and a path by brute force: slip rates by complementarity, step by step."""

from typing import Any

import numpy as np
import scipy.linalg

import stiction as st


def crooked(
    *,
    nodes: int = 96,
    drive: Any = None,
    height: float = 0.031,
    mode: str = "II",
    nu: float = 0.33,
    plane: str = "stress",
    rate: float = 0.19e12,
    residual: float = 0.52e6,
    **more: Any,
) -> st.Problem:
    """A specimen with nothing symmetric about it."""
    x = (np.arange(nodes) + 0.5) / nodes
    load = st.Load(initial_stress=-2e4 + 9e4 * x * (1.0 - 0.7 * x), normal_pressure=2.1e6)
    return st.Problem(
        solid=st.Solid(youngs_modulus=2.7e9, poisson_ratio=nu, density=1180.0, plane=plane),
        interface=st.Interface(length=0.083, nodes=nodes),
        friction=st.LinearWeakening(weakening_rate=rate, residual_strength=residual),
        specimen=st.Blocks(height=height, thickness=0.0071, drive=drive or st.Platen()),
        load=more.pop("load", load),
        mode=mode,
        **more,
    )


def rough(problem: st.Problem, seed: int, samples: int = 1, length: float = 4e-3) -> np.ndarray:
    """Strengths of a few patches on the specimen."""
    marginal = st.Beta(alpha=1.5, beta=3.0, low=0.68e6, high=1.61e6)
    field = st.RandomField(marginal, st.PowerLawSpectrum(correlation_length=length))
    return field.sample(problem.interface, samples=samples, seed=seed)


class BruteForce:
    """The quasi-static path of one sample: rates by complementarity with the true K, jumps
    with frozen strengths, from below."""

    def __init__(self, problem: st.Problem, strength: np.ndarray) -> None:
        rows = problem.sample(strength)
        self.K, self.q = problem.blocks.stiffness, rows.load_profile
        self.s = rows.strength[0] - rows.initial_stress[0]
        self.r = rows.residual_strength[0] - rows.initial_stress[0]
        self.w = rows.weakening_rate[0]
        self.relief, self.initial = problem.blocks.relief, rows.initial_stress.mean()
        self.held = self.relief > 0.0
        self.load, self.slip = float((self.s / self.q).min()), np.zeros(self.s.size)
        self.peak, self.first, self.drops = self.carried, None, []
        self.slides, self.kinks = False, [self.load]

    @property
    def carried(self) -> float:
        """Mean stress of the interface, Pa."""
        return self.initial + self.load - self.relief * (self.q * self.slip).mean()

    def strength(self) -> np.ndarray:
        return np.maximum(self.s - self.w * self.slip, self.r)

    def rates(self) -> np.ndarray | None:
        """Slip per load of a stable state, None if there is none."""
        margin = self.strength() + self.K @ self.slip - self.load * self.q
        may = margin < 1e-9 * np.abs(self.s).mean()
        falls = self.s - self.w * self.slip > self.r + 1e-9 * self.w * self.slip
        a = self.K - np.diag(np.where(falls, self.w, 0.0))
        moving = may.copy()
        for _ in range(self.s.size):
            at = np.flatnonzero(moving)
            if not at.size:
                return np.zeros(self.s.size)
            block = a[np.ix_(at, at)]
            if scipy.linalg.eigvalsh(block, subset_by_index=[0, 0])[0] <= 1e-10 * a[0, 0]:
                return None
            rate = np.zeros(self.s.size)
            rate[at] = np.linalg.solve(block, self.q[at])
            if rate.min() >= 0.0:
                return rate
            moving &= rate > 0.0
        raise AssertionError("no complementary rates")

    def step(self, rate: np.ndarray) -> None:
        """To the next node that slips or reaches its residual strength."""
        margin = self.strength() + self.K @ self.slip - self.load * self.q
        closing = self.q - self.K @ rate
        rests = (rate == 0.0) & (closing > 0.0)
        left = np.where(rests, np.maximum(margin, 0.0) / np.where(rests, closing, 1.0), np.inf)
        critical = (self.s - self.r) / self.w
        weak = (rate > 0.0) & (self.slip < critical * (1.0 - 1e-9))
        end = np.where(weak, (critical - self.slip) / np.where(weak, rate, 1.0), np.inf)
        size = max(min(left.min(), end.min()), 0.0)
        at_end = weak & (end <= size * (1.0 + 1e-12))
        self.load += size
        self.slip = self.slip + size * rate
        self.slip[at_end] = critical[at_end]
        self.peak = max(self.peak, self.carried)
        self.kinks.append(self.load)

    def jump(self) -> None:
        """With frozen strengths to balance, until all rest or the whole interface slides."""
        before = self.carried
        self.first = before if self.first is None else self.first
        tolerance = 1e-11 * np.abs(self.s).mean()
        self.slip = self.slip * (1.0 + 1e-7) + 1e-12 * (self.slip > 0.0)
        for _ in range(200_000):
            strength = self.strength()
            over = self.load * self.q - self.K @ self.slip - strength
            if over.max() <= tolerance:
                break
            if (not self.held and over.sum() > 0.0) or (self.slip > 0.0).all():
                self.slides = True
                return
            at = np.flatnonzero((self.slip > 0.0) | (over > tolerance))
            if at.size == self.s.size and not self.held:
                self.slides = True
                return
            pull = (self.load * self.q - strength)[at]
            self.slip[at] = np.maximum(
                np.linalg.solve(self.K[np.ix_(at, at)], pull), self.slip[at]
            )
        else:
            raise AssertionError("no rest")
        self.drops.append(before - self.carried)

    def run(self) -> "BruteForce":
        while not self.slides:
            rate = self.rates()
            if rate is None:
                self.jump()
            else:
                self.step(rate)
                self.slides = bool((self.slip > 0.0).all())
        return self

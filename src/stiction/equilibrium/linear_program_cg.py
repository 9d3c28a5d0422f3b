"""The programme on large grids: conjugate gradients instead of one dense factor.

The same algorithm as in `program`, with two changes. The slipping nodes are solved for by conjugate
gradients, with products by FFT and the factors of short segments as preconditioner, so that memory
grows like the number of nodes. And overstressed nodes join all at once where this is harmless;
near a critical patch, where their order decides, they join one by one, each with the one solution
y = (-A_SS^-1 A_Sj, 1) that both updates the slip and, at a pivot <= 0, is the cut.

It starts from the exact solution of a window around the weakest place. A multiplier that is zero
outside the window is a multiplier of the whole interface, so the window's load is an upper bound,
and a tight one: it lacks only what patches far away contribute.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft

from stiction.arrays import Array
from stiction.elasticity.inner_product import dot
from stiction.equilibrium.linear_program import OVERSTRESS, PIVOT, SOLVED, STALLED, solve_program
from stiction.equilibrium.segments import Segments
from stiction.equilibrium.window_test import OUT_OF_REACH, circle_of, padded
from stiction.equilibrium.workspace import Grid, make_workspace

WINDOW = 1024
"""Nodes of the window that is solved first."""
WIDTH = 512
"""Nodes of a segment."""
ITERATIONS = 500
ROUGH = 1e-5
FINE = 2e-14
"""Residual of a solution, as a share of the mean strength: while nodes still join, and at last."""
PASSES = 2000


@dataclass
class Solution:
    """Critical load (Pa), slip (m), K times it (Pa), and the multiplier, <p, y> = 1."""

    load: float
    slip: Array
    stiff: Array
    multiplier: Array
    status: int = SOLVED


def window_solution(
    excess: Array,
    profile: Array,
    diagonal: Array,
    grid: Grid,
    centre: int,
    bound: float,
    multiplier: Array,
) -> tuple[float, Array, Array]:
    """Critical load of a window if nothing outside slips, its multiplier and slipping nodes."""
    n = excess.shape[0]
    nodes = (centre - WINDOW // 2 + np.arange(WINDOW)) % n
    small = circle_of(grid.column, WINDOW)
    workspace = make_workspace(2 * WINDOW)
    workspace.diagonal[:] = grid.column[0]
    workspace.diagonal[:WINDOW] = diagonal[nodes]
    strength = padded(excess[nodes], OUT_OF_REACH * float(np.abs(excess).max()))
    load_profile = padded(profile[nodes], 1e-9 * float(profile.mean()))
    local = np.zeros(2 * WINDOW)
    local[:WINDOW] = multiplier[nodes]
    slip, stiff = np.empty(2 * WINDOW), np.empty(2 * WINDOW)
    solve_program(strength, load_profile, small, bound, np.inf, local, slip, stiff, workspace)
    result = np.zeros(n)
    result[nodes] = local[:WINDOW]
    result /= dot(result, profile, n)
    return float(dot(excess, result, n)), result, nodes[slip[:WINDOW] > 0.0]


class LargeProgram:
    """One sample on a large grid; arguments as of `solve_program`."""

    def __init__(
        self,
        excess: Array,
        profile: Array,
        rate: Array,
        grid: Grid,
        bound: float,
        multiplier: Array,
        cap: float = np.inf,
    ) -> None:
        n = excess.shape[0]
        self.excess, self.profile, self.rate = excess, profile, rate
        self.symbol = scipy.fft.rfft(grid.column).real
        self.bound, self.multiplier, self.cap = bound, multiplier, cap
        self.scale = float(np.abs(excess).mean() + abs(bound) * profile.mean())
        self.iterations = 0
        diagonal = grid.column[0] - rate
        centre = int(np.argmax(multiplier))
        value, better, slipping = window_solution(
            excess, profile, diagonal, grid, centre, bound, multiplier
        )
        if value <= bound:
            self.bound, self.multiplier = value, better
        self.nodes = Segments(grid.column, diagonal, (centre - WIDTH // 2) % n, WIDTH)
        self.patch = max(int(np.count_nonzero(multiplier)), 8)
        self.careful = np.zeros(n, dtype=np.bool_)
        self.take_care(centre)
        start = excess < min(self.bound, cap) * profile
        if cap < self.bound:  # the window was solved at a higher load than is asked for
            self.start = np.flatnonzero(start)
            return
        start[self.careful] = False
        joined = np.concatenate((slipping, np.flatnonzero(start)))
        _, first = np.unique(joined, return_index=True)
        self.start = joined[np.sort(first)]

    def take_care(self, node: int) -> None:
        """From now on nodes near this one join one by one."""
        reach = min(2 * self.patch, self.excess.shape[0] // 2 - 1)
        self.careful[np.arange(node - reach, node + reach + 1) % self.excess.shape[0]] = True

    def stiffness(self, field: Array) -> Array:
        """K times a field."""
        result: Array = scipy.fft.irfft(self.symbol * scipy.fft.rfft(field), field.shape[0])
        return result

    def solve(self, right: Array, guess: Array, tolerance: float) -> tuple[Array, int]:
        """A x = right on the slipping nodes; node of the strongest negative curvature, or -1."""
        inside = self.nodes.inside
        x = np.where(inside, guess, 0.0)
        residual = np.where(inside, right - self.stiffness(x) + self.rate * x, 0.0)
        direction = np.zeros_like(x)
        previous = 0.0
        n = x.size
        for _ in range(ITERATIONS):
            if np.abs(residual).max() <= tolerance:
                break
            self.iterations += 1
            z = self.nodes.solve(residual)
            product = float(dot(residual, z, n))
            direction = z if previous == 0.0 else z + (product / previous) * direction
            previous = product
            image = np.where(inside, self.stiffness(direction) - self.rate * direction, 0.0)
            curvature = float(dot(direction, image, n))
            if curvature <= 0.0:
                return x, int(np.argmax(np.abs(direction)))
            step = product / curvature
            x += step * direction
            residual -= step * image
        return x, -1

    def slip_at(self, load: float, guess: Array, share: float) -> tuple[Array, int]:
        """Slip of the present nodes at a load."""
        return self.solve(load * self.profile - self.excess, guess, share * self.scale)

    def cut(self, node: int, y: Array) -> float:
        """Take the multiplier y if it lowers the bound; returns its value."""
        y = np.maximum(y, 0.0)
        y = y / dot(y, self.profile, y.size)
        value = float(dot(y, self.excess, y.size))
        if value < self.bound:
            self.bound, self.multiplier = value, y
        return value

    def unit_response(self, node: int) -> tuple[Array, float]:
        """y = (-A_SS^-1 A_Sj, 1) and the pivot A_jj - A_jS A_SS^-1 A_Sj."""
        unit = np.zeros_like(self.excess)
        unit[node] = 1.0
        image = self.stiffness(unit)
        y, bad = self.solve(-image, np.zeros_like(unit), FINE * float(image[node]))
        y[node] = 1.0
        pivot = float(self.stiffness(y)[node] - self.rate[node])
        return y, -np.inf if bad >= 0 else pivot

    def settle(self, load: float, slip: Array) -> Array:
        """Slip at a load after it was lowered; members that would slip backwards leave."""
        while True:
            slip, _ = self.slip_at(load, slip, FINE)
            negative = slip < 0.0
            if not negative.any():
                return slip
            self.nodes.remove(negative)
            slip[negative] = 0.0

    def run(self, patience: float = np.inf) -> Solution:
        """Solve, or give up as STALLED after `patience` iterations."""
        n = self.excess.shape[0]
        tolerance = OVERSTRESS * self.scale
        status = STALLED
        slip = np.zeros(n)
        load = min(self.bound, self.cap)
        self.nodes.append(self.start)
        share = ROUGH
        slip, _ = self.slip_at(load, slip, share)
        stiff = self.stiffness(slip)
        for _ in range(PASSES):
            if self.iterations > patience:
                break
            margin = self.excess - load * self.profile + stiff
            margin[self.nodes.inside] = 0.0
            over = np.flatnonzero(margin < -max(tolerance, 10.0 * share * self.scale))
            if over.size == 0:
                if share == FINE:
                    status = SOLVED
                    break
                share = FINE
                slip = self.settle(load, slip)
                stiff = self.stiffness(slip)
                continue
            over = over[np.argsort(margin[over], kind="stable")]
            quick = over[~self.careful[over]]
            if quick.size:
                sizes = self.nodes.sizes.copy()
                failed = self.nodes.append(quick)
                trial, bad = slip, -1
                if failed >= 0:
                    bad = int(self.nodes.members[failed, self.nodes.sizes[failed]])
                else:
                    trial, bad = self.slip_at(load, slip, share)
                if bad >= 0:
                    self.nodes.truncate(sizes)
                    self.take_care(bad)
                    continue
                slip = trial
            else:
                node = int(over[0])
                if share != FINE:
                    share = FINE
                    slip, _ = self.slip_at(load, slip, share)
                    stiff = self.stiffness(slip)
                    continue
                y, pivot = self.unit_response(node)
                if pivot > PIVOT * self.nodes.diagonal[node]:
                    self.nodes.append(np.array([node]))
                    slip = slip + (-margin[node] / pivot) * y
                else:
                    value = self.cut(node, y)
                    settled = value >= load - tolerance
                    load = min(load, self.bound)
                    slip = self.settle(load, slip)
                    if settled:
                        status = SOLVED
                        stiff = self.stiffness(slip)
                        break
            stiff = self.stiffness(slip)
        slip = np.maximum(slip, 0.0)
        return Solution(load, slip, self.stiffness(slip), self.multiplier, status)

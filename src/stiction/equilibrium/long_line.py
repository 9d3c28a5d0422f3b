"""The programme on long lines: conjugate gradients instead of one dense factor.

The algorithm of `linear_program`, with two changes. The slipping nodes are solved for by conjugate
gradients, with products by FFT and the factors of short segments as preconditioner, so that memory
grows like the number of nodes. And overstressed nodes join all at once where this is harmless;
near a critical patch, where their order decides, they join one by one, each with the one solution
y = (-A_SS^-1 A_Sj, 1) that both updates the slip and, at a pivot <= 0, is the cut.

It starts from the exact solution of a window around the weakest place. A multiplier that is zero
outside the window is a multiplier of the whole interface, so the window's load is an upper bound,
and a tight one: it lacks only what patches far away contribute. Jumps too are first followed in a
window with everything outside held fixed: slip outside only helps, so that a patch that runs away
there does so in truth, and if it comes to rest, the jump of the whole starts from there.
"""

from typing import NamedTuple

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.elasticity.line import Stiffness, make_stiffness
from stiction.elasticity.linear import dot
from stiction.equilibrium.cholesky import (
    PIVOT,
    append,
    back_substitute,
    make_workspace,
    row_start,
    substitute,
)
from stiction.equilibrium.jump import jump
from stiction.equilibrium.linear_program import (
    OVERSTRESS,
    SOLVED,
    STALLED,
    Solution,
    solve_program,
)
from stiction.equilibrium.patches import main_patch
from stiction.equilibrium.runaway import SLIDING
from stiction.equilibrium.sample import Sample
from stiction.jit import jit

WINDOW = 1024
"""Nodes of a window that is solved by itself."""
OUT_OF_REACH = 50.0
"""Strength of what must not slip, as a multiple of the largest strength."""
WIDTH = 512
"""Nodes of a segment."""
ITERATIONS = 500
ROUGH = 1e-5
FINE = 2e-14
"""Residual of a solution, as a share of the mean strength: while nodes still join, and at last."""
PASSES = 2000


def _times(column: Array, field: Array) -> Array:
    """The circulant matrix with a first column times a field."""
    spectrum = scipy.fft.rfft(column) * scipy.fft.rfft(field)
    product: Array = scipy.fft.irfft(spectrum, field.shape[0])
    return product


def _circle_of(column: Array) -> Stiffness:
    """Stiffness of a window of a longer interface, on a circle of twice its length.

    Nodes of the far half must not slip: only then are distances on the circle the true ones.
    """
    small = np.zeros(2 * WINDOW)
    small[:WINDOW] = column[:WINDOW]
    small[WINDOW + 1 :] = small[WINDOW - 1 : 0 : -1]
    return make_stiffness(small)


def _padded(values: Array, fill: float) -> Array:
    """Values of the window, followed by as many for the far half of the circle."""
    return np.concatenate((values, np.full(values.shape[0], fill)))


def _window_of(
    sample: Sample, nodes: NDArray[np.int64], outside: Array | float = 0.0
) -> Sample:
    """The sample on the nodes of a window; what the slip outside takes off counts as strength."""
    beyond = OUT_OF_REACH * float(np.abs(sample.excess).max())
    return Sample(
        _padded(sample.excess[nodes] + outside, beyond),
        _padded(sample.residual[nodes] + outside, beyond),
        _padded(sample.profile[nodes], 1e-9 * float(sample.profile.mean())),
        _padded(sample.rate[nodes], 1.0),
        _padded(sample.critical[nodes], np.inf),
        sample.pieces,
    )


def runs_away_alone(
    sample: Sample,
    stiffness: Stiffness,
    load: float,
    slip: Array,
    direction: Array,
    griffith: float,
) -> bool:
    """Whether the unstable patch slides even if nothing outside its window moves.

    If not, slip, a lower bound of the next equilibrium, is left where the window comes to rest.
    False also where the line is not much longer than the window.
    """
    n = slip.shape[0]
    if n < 4 * WINDOW:
        return False
    first, length, _ = main_patch(direction)
    nodes = (first + length // 2 - WINDOW // 2 + np.arange(WINDOW)) % n
    small = _circle_of(stiffness.column)
    local = _padded(slip[nodes], 0.0)
    stiff = _times(small.column, local)
    outside = _times(stiffness.column, slip)[nodes] - stiff[:WINDOW]
    part = _window_of(sample, nodes, outside)
    spaces = make_workspace(small), make_workspace(small)
    outcome = jump(part, load, local, stiff, griffith, *spaces)
    slip[nodes] = np.maximum(slip[nodes], local[:WINDOW])
    return bool(outcome == SLIDING)


class Segments(NamedTuple):
    """A preconditioner: the slipping nodes cut into segments of WIDTH nodes from `origin` on.

    Each has a factor, nodes and a number of them: (segments, ...) arrays. `inside` marks the nodes
    that slip; `column` and `diagonal` are those of K and A, (n,); the rest is work space.
    """

    column: Array
    diagonal: Array
    origin: int
    factors: Array
    members: NDArray[np.int64]
    sizes: NDArray[np.int64]
    inside: NDArray[np.bool_]
    order: NDArray[np.int64]
    work: Array


def _make_segments(column: Array, diagonal: Array, origin: int) -> Segments:
    """Segments without nodes."""
    n = column.shape[0]
    count = -(-n // WIDTH)
    integers = np.zeros((count, WIDTH + 4), dtype=np.int64)
    return Segments(
        column, diagonal, origin, np.empty((count, row_start(WIDTH + 4))), integers,
        np.zeros(count, dtype=np.int64), np.zeros(n, dtype=np.bool_),
        np.empty(WIDTH + 4, dtype=np.int64), np.empty((3, WIDTH + 4)),
    )  # fmt: skip


@jit
def _append_nodes(segments: Segments, nodes: NDArray[np.int64]) -> int:
    """Append nodes, in the order given, to the factors of their segments.

    Returns the first segment whose own block of A is not positive definite (it stops before the
    node that makes it so), or -1.
    """
    n = segments.inside.shape[0]
    order = segments.order
    for segment in range(segments.sizes.shape[0]):
        members = segments.members[segment]
        count = 0
        for t in range(nodes.shape[0]):
            if ((nodes[t] - segments.origin) % n) // WIDTH == segment:
                order[count] = nodes[t]
                count += 1
        if count == 0:
            continue
        before = segments.sizes[segment]
        now = append(
            segments.factors[segment], before, members, order, count, segments.column,
            segments.diagonal, PIVOT,
        )  # fmt: skip
        segments.sizes[segment] = now
        for t in range(before, now):
            segments.inside[members[t]] = True
        if now < before + count:
            return segment
    return -1


@jit
def _precondition(segments: Segments, values: Array, result: Array) -> None:
    """Solve the block-diagonal part of A on the slipping nodes; zero elsewhere."""
    right, forward, solution = segments.work[0], segments.work[1], segments.work[2]
    result[:] = 0.0
    for segment in range(segments.sizes.shape[0]):
        size = segments.sizes[segment]
        members = segments.members[segment]
        if size == 0:
            continue
        for t in range(size):
            right[t] = values[members[t]]
        substitute(segments.factors[segment], size, right, forward)
        back_substitute(segments.factors[segment], size, forward, solution)
        for t in range(size):
            result[members[t]] = solution[t]


def _truncate(segments: Segments, sizes: NDArray[np.int64]) -> None:
    """Go back to earlier sizes."""
    segments.sizes[:] = sizes
    segments.inside[:] = False
    for members, size in zip(segments.members, sizes, strict=True):
        segments.inside[members[:size]] = True


def _remove(segments: Segments, negative: NDArray[np.bool_]) -> None:
    """Take out the marked nodes; factors of their segments are rebuilt from there on."""
    again = []
    sizes = segments.sizes.copy()
    for segment, size in enumerate(sizes):
        marked = negative[segments.members[segment, :size]]
        if marked.any():
            kept = int(np.argmax(marked))
            rest = segments.members[segment, kept:size]
            again.append(rest[~marked[kept:]].copy())
            sizes[segment] = kept
    _truncate(segments, sizes)
    if again:
        _append_nodes(segments, np.concatenate(again))


class LongLine:
    """The programme of one sample on a long line; arguments as of `solve_program`."""

    def __init__(
        self,
        sample: Sample,
        stiffness: Stiffness,
        bound: float,
        multiplier: Array,
        cap: float = np.inf,
    ) -> None:
        n = sample.excess.shape[0]
        self.sample = sample
        self.symbol = scipy.fft.rfft(stiffness.column).real
        self.bound, self.multiplier, self.cap = bound, multiplier, cap
        self.scale = float(np.abs(sample.excess).mean() + abs(bound) * sample.profile.mean())
        self.iterations = 0
        centre = int(np.argmax(multiplier))
        slipping = self._solve_window(stiffness, centre)
        diagonal = stiffness.column[0] - sample.rate
        self.nodes = _make_segments(stiffness.column, diagonal, (centre - WIDTH // 2) % n)
        self.patch = max(int(np.count_nonzero(multiplier)), 8)
        self.careful = np.zeros(n, dtype=np.bool_)
        self.take_care(centre)
        start = sample.excess < min(self.bound, cap) * sample.profile
        if cap < self.bound:  # the window was solved at a higher load than is asked for
            self.start = np.flatnonzero(start)
            return
        start[self.careful] = False
        joined = np.concatenate((slipping, np.flatnonzero(start)))
        _, first = np.unique(joined, return_index=True)
        self.start = joined[np.sort(first)]

    def _solve_window(self, stiffness: Stiffness, centre: int) -> NDArray[np.int64]:
        """Lower the bound by that of a window if nothing outside slips; its slipping nodes."""
        sample, n = self.sample, self.multiplier.size
        nodes = (centre - WINDOW // 2 + np.arange(WINDOW)) % n
        workspace = make_workspace(_circle_of(stiffness.column))
        workspace.diagonal[:] = stiffness.column[0]
        workspace.diagonal[:WINDOW] = stiffness.column[0] - sample.rate[nodes]
        local = _padded(self.multiplier[nodes], 0.0)
        slip, stiff = np.zeros((2, 2 * WINDOW))
        part = _window_of(sample, nodes)
        solve_program(part, np.inf, self.bound, np.inf, local, slip, stiff, workspace)
        better = np.zeros(n)
        better[nodes] = local[:WINDOW]
        better /= dot(better, sample.profile, n)
        value = float(dot(sample.excess, better, n))
        if value <= self.bound:
            self.bound, self.multiplier = value, better
        slipping: NDArray[np.int64] = nodes[slip[:WINDOW] > 0.0]
        return slipping

    def take_care(self, node: int) -> None:
        """From now on nodes near this one join one by one."""
        n = self.careful.size
        reach = min(2 * self.patch, n // 2 - 1)
        self.careful[np.arange(node - reach, node + reach + 1) % n] = True

    def stiffness(self, field: Array) -> Array:
        """K times a field."""
        result: Array = scipy.fft.irfft(self.symbol * scipy.fft.rfft(field), field.shape[0])
        return result

    def solve(self, right: Array, guess: Array, tolerance: float) -> tuple[Array, int]:
        """A x = right on the slipping nodes; node of the strongest negative curvature, or -1."""
        inside = self.nodes.inside
        x = np.where(inside, guess, 0.0)
        residual = np.where(inside, right - self.stiffness(x) + self.sample.rate * x, 0.0)
        direction, z = np.zeros((2, x.size))
        previous = 0.0
        n = x.size
        for _ in range(ITERATIONS):
            if np.abs(residual).max() <= tolerance:
                break
            self.iterations += 1
            _precondition(self.nodes, residual, z)
            product = float(dot(residual, z, n))
            direction = z + (product / previous) * direction if previous > 0.0 else z.copy()
            previous = product
            image = np.where(
                inside, self.stiffness(direction) - self.sample.rate * direction, 0.0
            )
            curvature = float(dot(direction, image, n))
            if curvature <= 0.0:
                return x, int(np.argmax(np.abs(direction)))
            step = product / curvature
            x += step * direction
            residual -= step * image
        return x, -1

    def slip_at(self, load: float, guess: Array, share: float) -> tuple[Array, int]:
        """Slip of the present nodes at a load."""
        drive = load * self.sample.profile - self.sample.excess
        return self.solve(drive, guess, share * self.scale)

    def cut(self, y: Array) -> float:
        """Take the multiplier y if it lowers the bound; returns its value."""
        y = np.maximum(y, 0.0)
        y = y / dot(y, self.sample.profile, y.size)
        value = float(dot(y, self.sample.excess, y.size))
        if value < self.bound:
            self.bound, self.multiplier = value, y
        return value

    def unit_response(self, node: int) -> tuple[Array, float]:
        """y = (-A_SS^-1 A_Sj, 1) and the pivot A_jj - A_jS A_SS^-1 A_Sj."""
        unit = np.zeros_like(self.sample.excess)
        unit[node] = 1.0
        image = self.stiffness(unit)
        y, bad = self.solve(-image, np.zeros_like(unit), FINE * float(image[node]))
        y[node] = 1.0
        pivot = float(self.stiffness(y)[node] - self.sample.rate[node])
        return y, -np.inf if bad >= 0 else pivot

    def settle(self, load: float, slip: Array) -> Array:
        """Slip at a load after it was lowered; members that would slip backwards leave."""
        while True:
            slip, _ = self.slip_at(load, slip, FINE)
            negative = slip < 0.0
            if not negative.any():
                return slip
            _remove(self.nodes, negative)
            slip[negative] = 0.0

    def run(self, patience: float = np.inf) -> Solution:
        """Solve, or give up as STALLED after `patience` iterations."""
        n = self.sample.excess.shape[0]
        tolerance = OVERSTRESS * self.scale
        status = STALLED
        slip = np.zeros(n)
        load = min(self.bound, self.cap)
        _append_nodes(self.nodes, self.start)
        share = ROUGH
        slip, _ = self.slip_at(load, slip, share)
        stiff = self.stiffness(slip)
        for _ in range(PASSES):
            if self.iterations > patience:
                break
            margin = self.sample.excess - load * self.sample.profile + stiff
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
                failed = _append_nodes(self.nodes, quick)
                trial, bad = slip, -1
                if failed >= 0:
                    bad = int(self.nodes.members[failed, self.nodes.sizes[failed]])
                else:
                    trial, bad = self.slip_at(load, slip, share)
                if bad >= 0:
                    _truncate(self.nodes, sizes)
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
                    _append_nodes(self.nodes, np.array([node]))
                    slip = slip + (-margin[node] / pivot) * y
                else:
                    value = self.cut(y)
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

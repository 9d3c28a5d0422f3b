"""Two blocks and the machine that drives them: stiffness, shear profile, travel and windows.

The block with its drive and the machine are springs in series. With the
force F per unit depth, the drive's travel U, the travel X at the
machine's far end, and the machine's stiffness k,

    F = k (X - U),    U = F/C + (dx/2L) <q, d>.

The second equation is Betti's theorem. C is the stiffness of the block
against its drive without slip. Slip d at the interface moves the drive
by the average of d weighted by q. Eliminating U gives

    tau = D q - K d,   D = k C X/((k + C) L),   K = K_dead + h/n q q^T,
    F/L = D - h <q, d>/n,

with h = (k/(k + C)) C/(2 L). Under a dead load h = 0, and for a rigid
machine h = C/(2 L).
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, ClassVar

import numpy as np
import scipy.linalg

from stiction.base.arrays import Array
from stiction.elasticity.blocks import Pushes, block_response, glued_pressure
from stiction.elasticity.protocol import DenseEntries, HalfSpaces, Windows

MAX_WINDOWS_PER_WIDTH = 32
"""Windows that begin within the width of a window. Weighted means
hardly change between them."""
POSITIVE_RTOL = 1e-12
"""Largest positive entry of K off its diagonal that is round-off, as a
fraction of the diagonal."""
MIN_SHEAR = 1e-9
"""Smallest value of the profile of a drive far from a pusher, as a
fraction of the largest."""


@dataclass(frozen=True, eq=False)
class Driven:
    """Two blocks and their machine, as an `Elasticity`. Do not write to its arrays.

    >>> K = np.array([[4.0, -1.0, 0.5], [-1.0, 5.0, -2.0], [0.5, -2.0, 6.0]])
    >>> shear = np.array([1.5, 1.0, 0.5])
    >>> blocks = Driven(K, shear, np.ones(3), relief=3.0, drive_stiffness=8.0, error=0.1)
    >>> blocks.positive, Driven(K, shear, shear, 3.0, 8.0, error=0.6).positive
    (0.125, 0.0)
    >>> blocks.block([2, 0]).tolist(), float(blocks.entries.rows[5]), blocks.entries.relief
    ([[6.0, 0.5], [0.5, 4.0]], -2.0, 3.0)

    Slip (2, 1, 4) has the weighted mean (3 + 1 + 2)/3 = 2, and half the slip has 1.

    >>> slip = np.array([[2.0, 1.0, 4.0], [1.0, 0.5, 2.0]])
    >>> blocks.mean_relief(slip).tolist(), blocks.travel(12.0, slip).tolist()
    ([6.0, 3.0], [5.0, 4.0])
    """

    stiffness: Array  # (n, n): K, Pa/m
    shear: Array  # (n,): q, with mean 1
    pressure: Array  # (n,): pressure of the normal load, divided by its mean
    relief: float  # h, Pa/m: relief of the drive per mean of q d
    drive_stiffness: float  # C, Pa
    error: float  # largest error of the entries of K, Pa/m
    half_spaces: ClassVar[HalfSpaces | None] = None

    @cached_property
    def entries(self) -> DenseEntries:
        """K in the form that kernels need."""
        return DenseEntries(self.stiffness.reshape(-1), len(self.stiffness), self.relief)

    @cached_property
    def positive(self) -> float:
        """Largest positive off-diagonal entry in K over the diagonal, or 0 within the error."""
        off = self.stiffness - np.diag(np.diag(self.stiffness))
        diagonal, most = float(np.diag(self.stiffness).min()), float(off.max())
        return most / diagonal if most > max(self.error, POSITIVE_RTOL * diagonal) else 0.0

    def block(self, nodes: Any) -> Array:
        """Return K between some nodes, Pa/m."""
        return self.stiffness[np.ix_(nodes, nodes)]

    def mean_relief(self, slip: Array) -> Array:
        """Return h <q, d>/n, by which slip (..., n) lowers the mean stress, Pa."""
        return self.relief * (slip * self.shear).mean(axis=-1)

    def windows(self, low: float, high: float) -> Windows:
        """Return the windows at the lowest weakening rate (Pa/m), with their places."""
        return _windows_at(self, low)

    def travel(self, force: Any, slip: Array) -> Any:
        """Return the total travel of both drives (m) at a force per unit depth (N/m)."""
        return 2.0 * force / self.drive_stiffness + (slip * self.shear).mean(axis=-1)


def _unstable(matrix: Array, W: float, begin: int, end: int) -> bool:
    # A Cholesky factor exists only if all eigenvalues of K - W are positive.
    """The block of the last two nodes has the eigenvalues 1 and 3.

    >>> matrix = np.array([[9.0, 0.0, 0.0], [0.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
    >>> [_unstable(matrix, W, 1, 3) for W in (0.9, 1.1, 3.1)]
    [False, True, True]
    >>> _unstable(matrix, 1.1, 0, 2), _unstable(matrix, 2.1, 1, 2)
    (False, True)
    """
    block = matrix[begin:end, begin:end].copy()
    block.flat[:: end - begin + 1] -= W
    return bool(scipy.linalg.lapack.dpotrf(block, lower=1, overwrite_a=1)[1] > 0)


def shortest_runs(matrix: Array, W: float) -> list[tuple[int, int]]:
    """Return where the shortest runs begin and end on which K (n, n) is unstable at a rate, Pa/m.

    If a block of K shrinks, its lowest eigenvalue rises.
    Therefore a shortest run that begins later also ends later, and a
    single pass over the nodes finds all:

    1. Lengthen the run until it is unstable.
    2. Shorten it from its end as long as it remains unstable, and keep it.
    3. Move on by a fraction of the width, and go to step 1. The last run
       ends with the specimen.

    All runs are compared with a search for the shortest run from each node:

    >>> matrix = np.diag([5.0, 4.0, 6.0, 3.0, 6.0, 4.0])
    >>> matrix -= 1.5 * (np.eye(6, k=1) + np.eye(6, k=-1))
    >>> def brute(W):
    ...     ends = [[b for b in range(a + 1, 7) if _unstable(matrix, W, a, b)] for a in range(6)]
    ...     return [(a, end[0]) for a, end in enumerate(ends) if end]
    >>> [shortest_runs(matrix, W) == brute(W) for W in (0.5, 1.5, 2.0, 2.5, 3.5, 4.5, 7.0)]
    [True, True, True, True, True, True, True]
    >>> shortest_runs(matrix, 0.5), shortest_runs(matrix, 3.5)
    ([], [(0, 2), (1, 3), (2, 4), (3, 4), (4, 6)])

    Runs of 64 nodes begin at every second node, and the last run ends with
    the specimen. A chain of m nodes has the lowest eigenvalue 2 - 2 cos(pi/(m + 1)).

    >>> chain = 2.0 * np.eye(67) - np.eye(67, k=1) - np.eye(67, k=-1)
    >>> shortest_runs(chain, 1.000001 * (2.0 - 2.0 * np.cos(np.pi / 65)))
    [(0, 64), (2, 66), (3, 67)]
    """
    n, runs = len(matrix), []
    begin, end, step = 0, 1, 1
    while begin < n:
        end = min(max(end, begin + 1), n)
        # 1. and 2.
        while not (unstable := _unstable(matrix, W, begin, end)) and end < n:
            end += 1
        while unstable and end - begin > 1 and _unstable(matrix, W, begin, end - 1):
            end -= 1
        if not unstable and step == 1:
            break
        # 3.
        if unstable:
            runs.append((begin, end))
            step = max(1, (end - begin) // MAX_WINDOWS_PER_WIDTH)
            begin, end = begin + step, end + step
        else:  # too far: look for the last run node by node
            begin, end, step = begin - step + 1, n, 1
    return runs


@lru_cache(maxsize=32)
def _windows_at(blocks: Driven, weakening_rate: float) -> Windows:
    """The lowest eigenvector of the last two nodes is (2, 1)/3, for 4 - 2 = 2 Pa/m.
    The first node needs both.

    >>> matrix = np.array([[9.0, 0.0, 0.0], [0.0, 4.0, -4.0], [0.0, -4.0, 10.0]])
    >>> blocks = Driven(matrix, np.ones(3), np.ones(3), 0.0, 1.0, 0.0)
    >>> windows = _windows_at(blocks, 2.5)
    >>> windows.starts.tolist(), windows.widths.tolist(), windows.modes.round(6).tolist()
    ([0, 1], [3, 2], [[0.0, 0.666667, 0.333333], [0.666667, 0.333333, 0.0]])
    >>> windows.weakening_rates.tolist(), blocks.windows(2.5, 9.0).starts.tolist()
    ([2.5, 2.5], [0, 1])
    >>> _windows_at(blocks, 1.5).widths.tolist()
    []
    """
    matrix = blocks.stiffness
    runs = shortest_runs(matrix, weakening_rate)
    # The weights of a window must be positive. The lowest eigenvector
    # has a single sign if K has no positive entry off its diagonal.
    modes = np.zeros((len(runs), max((end - begin for begin, end in runs), default=1)))
    for row, (begin, end) in zip(modes, runs, strict=True):
        block = matrix[begin:end, begin:end]
        _, vectors = scipy.linalg.eigh(block, subset_by_index=[0, 0], check_finite=False)
        row[: end - begin] = np.abs(vectors[:, 0])
        row /= row.sum()
    starts, ends = np.array(runs, dtype=np.int64).reshape(-1, 2).T
    return Windows(np.full(len(runs), weakening_rate), starts.copy(), ends - starts, modes)


@lru_cache(maxsize=8)
def driven(
    length: float,
    nodes: int,
    height: float,
    modulus: float,
    kappa: float,
    anti_plane: bool,
    pushes: Pushes | None,
    glued: bool,
    machine: float,
) -> Driven:
    """Return the response of blocks with a machine.

    For arguments see `block_response`.

    If the blocks are `glued` while they are pressed, the pressure is
    not uniform. `machine` is its stiffness per unit
    depth (Pa), for one block, which is half the specimen.

    In mode III below a platen, C is G L/H = 12 Pa, and q is 1. With a machine of
    4 Pa, the relief is 4/(4 + 12) * 12/(2 L), and K changes by relief/n.

    >>> dead = driven(2.0, 8, 0.5, 3.0, 1.8, True, None, False, 0.0)
    >>> soft = driven(2.0, 8, 0.5, 3.0, 1.8, True, None, False, 4.0)
    >>> stiff = driven(2.0, 8, 0.5, 3.0, 1.8, True, None, False, np.inf)
    >>> dead.relief, round(soft.relief, 9), round(stiff.relief, 9), round(dead.drive_stiffness, 9)
    (0.0, 0.75, 3.0, 12.0)
    >>> np.allclose(soft.stiffness - dead.stiffness, 0.75 / 8), dead.pressure.tolist() == 8 * [1.0]
    (True, True)

    Far from a pusher, q is at least 1e-9 of its largest value. Glue
    makes the pressure uneven.

    >>> push = Pushes(("left",), 0.1, 0.1)
    >>> long = driven(20.0, 40, 0.5, 3.0, 1.8, True, push, False, 0.0)
    >>> round(float(long.shear.min() / long.shear.max()) * 1e9, 6)
    1.0
    >>> round(float(long.shear.mean()), 6)
    1.0
    >>> glued = driven(2.0, 8, 0.5, 3.0, 1.8, False, None, True, 0.0).pressure
    >>> np.allclose(glued, glued_pressure(2.0, 8, 0.5, 1.8)), bool(np.ptp(glued) > 0.01)
    (True, True)
    """
    kind = None if anti_plane else kappa
    response = block_response(length, nodes, height, modulus, kind, pushes)
    # Far from a pusher q falls to round-off,
    # and a load profile must be positive.
    shear, floor = response.shear, MIN_SHEAR * response.shear.max()
    if np.abs(shear).min() < floor:
        shear = np.where(np.abs(shear) < floor, floor, shear)
        shear /= shear.mean()
    pressure = glued_pressure(length, nodes, height, kappa) if glued else np.ones(nodes)
    drive = response.drive_stiffness
    # k/(k + C) without overflow for a rigid machine. Without a machine
    # the load is dead.
    share = 1.0 / (1.0 + drive / machine) if machine > 0.0 else 0.0
    relief = 0.5 * share * drive / length
    stiffness = response.stiffness
    if relief > 0.0:
        stiffness = stiffness + relief / nodes * np.outer(shear, shear)
    error = response.error * float(stiffness.diagonal().min())
    return Driven(np.ascontiguousarray(stiffness), shear, pressure, relief, drive, error)

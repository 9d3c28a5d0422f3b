"""Strength on slipping nodes, in the form that kernels read.

Strength falls with slip along straight pieces. A law with M pieces has
M corners, and piece M is the residual strength. Between corners the
equations are linear, so solvers step from corner to corner. The linear
law has a single piece, which starts exactly at tau_p.

Example. Two pieces fall from f = 1 at u = 0 to f = 0.4 at u = 0.3, and
to f = 0 at u = 1. Then `ends` is (0.3, 1). The slopes -f' are 2 and
4/7, so `first_slope` is 2 and `slopes` is (1, 2/7, 0). Continued to
zero slip, the pieces start at 1, 4/7 and 0 (`starts`).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit, jit_inside
from stiction.problem.friction import FrictionLaw
from stiction.problem.friction.parameters import Polygon

CONSTANT_STRENGTH_RTOL = 1e-11
"""Smallest strength drop, as a fraction of the mean strength, with
which a node counts as weakening. A smaller fall is within the round-off
of K d: an instability of such nodes adds no slip and never ends."""


class Pieces(NamedTuple):
    """Falling, piecewise linear function f of u = slip/d_c, the same at every node.

    At a node, W is the weakening rate of the first piece that falls.
    The relative slope of this piece is therefore 1.

    A law that falls by 1 per d_c and then by 2 per d_c steepens:

    >>> one, three = np.ones(1), np.ones(3)
    >>> Pieces(one, three, np.array([1.0, 2.0, 0.0]), 1.0, 0.7).steepens
    True
    >>> LINEAR.steepens
    False
    """

    ends: Array  # (M,): u at the end of each piece; the last is 1
    starts: Array  # (M + 1,): f on each piece, continued to u = 0; from 1 to 0 (residual)
    slopes: Array  # (M + 1,): -f' on each piece, over `first_slope`; to 0 (residual)
    first_slope: float  # -f' on the first piece that falls
    area: float  # integral of f
    at_corner: float = 1.0 - 1e-12  # a node with this fraction of a corner's slip is beyond it

    @property
    def steepens(self) -> bool:
        """Whether a piece falls more steeply than the piece before it."""
        return bool(np.any(np.diff(self.slopes) > 0.0))


LINEAR = Pieces(np.array([1.0]), np.array([1.0, 0.0]), np.array([1.0, 0.0]), 1.0, 0.5)


def pieces_of(law: FrictionLaw) -> Pieces:
    """Return the pieces of a law for which `solver.refused` returns no reason.

    These are the two pieces of the example above, with the area 0.21 + 0.14 = 0.35:

    >>> from stiction.problem.friction import PiecewiseWeakening
    >>> law = PiecewiseWeakening(1.0, slip=[0.3, 1.0], strength=[0.4, 0.0])
    >>> pieces = pieces_of(law)
    >>> pieces.ends.tolist()
    [0.3, 1.0]
    >>> pieces.starts.round(6).tolist()
    [1.0, 0.571429, 0.0]
    >>> pieces.slopes.round(6).tolist()
    [1.0, 0.285714, 0.0]
    >>> round(pieces.first_slope, 6), round(pieces.area, 6)
    (2.0, 0.35)
    """
    parameters = law.parameters
    if not isinstance(parameters, Polygon):
        return LINEAR
    u, f = parameters.slip, parameters.fraction
    steep = np.append(-np.diff(f) / np.diff(u), 0.0)
    starts, first = f + steep * u, law.initial_slope
    return Pieces(u[1:].copy(), starts, steep / first, first, law.integral)


class StaticSample(NamedTuple):
    """Strength profile, as arrays (nodes,).

    Rate and d_c are 0 at nodes with constant strength.

    Beyond the interface extent, excess and d_c are infinite.
    """

    excess: Array  # tau_p - tau_i, Pa
    residual: Array  # tau_r - tau_i, Pa
    profile: Array  # of the load
    weakening_rate: Array  # W at zero slip, Pa/m
    critical: Array  # d_c, the slip at which the strength is residual, m
    pieces: Pieces


def make_sample(
    excess: Array, residual: Array, profile: Array, W: Array, pieces: Pieces
) -> StaticSample:
    """Return a sample, or many samples along the first axis.

    If strength falls by no more than round-off at a node, it is
    constant there.

    If strength falls by 2 Pa at 4 Pa/m, d_c is 0.5 m for a linear law. It is twice
    as long if the first piece falls twice as steeply as the law on average:

    >>> excess, residual = np.array([3.0, 2.0, np.inf]), np.array([1.0, 2.0, 1.5])
    >>> p, W = np.ones(3), np.array([4.0, 7.0, 5.0])
    >>> sample = make_sample(excess, residual, p, W, LINEAR)
    >>> sample.critical.tolist()
    [0.5, 0.0, inf]
    >>> sample.weakening_rate.tolist()
    [4.0, 0.0, 5.0]
    >>> steep = LINEAR._replace(first_slope=2.0)
    >>> make_sample(excess, residual, p, W, steep).critical.tolist()
    [1.0, 0.0, inf]

    The mean strengths are 3 and 4 Pa. A fall of 4e-11 Pa counts, and a
    fall of 2e-11 Pa is round-off:

    >>> strength = np.array([[1.0, 5.0, np.inf], [-2.0, -6.0, np.inf]])
    >>> residual = np.array([[1 - 4e-11, 5 - 2e-11, 0], [-2 - 2e-11, -6 - 8e-11, -9]])
    >>> many = make_sample(strength, residual, p, np.full((2, 3), 2.0), LINEAR)
    >>> many.weakening_rate.tolist()
    [[2.0, 0.0, 2.0], [0.0, 2.0, 2.0]]
    >>> (many.residual == strength).tolist()
    [[False, True, False], [True, False, False]]
    """
    fall = excess - residual
    largest = max(excess.max(), residual.max(), -excess.min(), -residual.min())
    if not fall.min() > CONSTANT_STRENGTH_RTOL * largest:
        scale = np.maximum(np.abs(excess), np.abs(residual))
        scale = scale.mean(axis=-1, keepdims=True, where=np.isfinite(excess))
        constant = ~(fall > CONSTANT_STRENGTH_RTOL * scale)
        residual = np.where(constant, excess, residual)
        fall, W = np.where(constant, 0.0, (fall, W))
    with np.errstate(invalid="ignore", divide="ignore"):
        critical = np.where(W > 0.0, pieces.first_slope * fall / W, 0.0)
    return StaticSample(excess, residual, profile, W, critical, pieces)


def row_of(samples: StaticSample, row: int) -> StaticSample:
    """Return a sample from a batch that `sample_of` made.

    This saves a tenth of the time.

    >>> excess, residual, W = np.array([[[3.0], [5.0]], [[1.0], [2.0]], [[4.0], [6.0]]])
    >>> many = make_sample(excess, residual, np.ones(1), W, LINEAR)
    >>> [values.tolist() for values in row_of(many, 1)[:5]]
    [[5.0], [2.0], [1.0], [6.0], [0.5]]
    """
    excess, residual, profile, W, critical, pieces = samples
    return StaticSample(excess[row], residual[row], profile, W[row], critical[row], pieces)


class Present(NamedTuple):
    """Present pieces of the nodes, with their value at zero slip (Pa) and slope (Pa/m)."""

    piece: NDArray[np.int64]
    strength: Array
    weakening_rate: Array


def residual_nodes(sample: StaticSample, slip: Array) -> NDArray[np.bool_]:
    """Return which weakening nodes have reached their residual strength.

    A node with constant strength does not count:

    >>> excess, fall = np.full(4, 2.0), np.array([1.0, 1.0, 1.0, 0.0])
    >>> sample = make_sample(excess, excess - fall, np.ones(4), np.full(4, 0.5), LINEAR)
    >>> sample.critical.tolist()
    [2.0, 2.0, 2.0, 0.0]
    >>> residual_nodes(sample, np.array([2.0, 1.9, 3.0, 3.0])).tolist()
    [True, False, True, False]
    """
    reached: NDArray[np.bool_] = slip >= sample.pieces.at_corner * sample.critical
    return reached & (sample.critical > 0.0)


def exceeds(sample: StaticSample, slip: Array, piece: NDArray[np.int64] | None = None) -> bool:
    """Return whether slip at any node exceeds the given piece, by default the first piece.

    The two nodes have d_c = 2 m and constant strength. The first piece ends at 0.6 m:

    >>> pieces = LINEAR._replace(ends=np.array([0.3, 1.0]))
    >>> excess, residual = np.array([[3.0, 3.0], [1.0, 3.0]])
    >>> sample = make_sample(excess, residual, np.ones(2), np.ones(2), pieces)
    >>> [exceeds(sample, np.array(slip)) for slip in ([0.6, 9.0], [0.61, 0.0])]
    [False, True]
    >>> pieces = [np.array([piece, 0]) for piece in (0, 1, 2)]
    >>> [exceeds(sample, np.array([2.1, 9.0]), piece) for piece in pieces]
    [True, True, False]
    >>> exceeds(sample, np.array([1.9, 0.0]), np.array([1, 0]))
    False
    """
    pieces = sample.pieces
    end = pieces.ends[0] if piece is None else np.append(pieces.ends, 1e300)[piece]
    beyond: NDArray[np.bool_] = slip > (2.0 - pieces.at_corner) * (end * sample.critical)
    return bool(beyond.any()) and bool((beyond & (sample.critical > 0.0)).any())


def all_breakable_slip(sample: StaticSample, slip: Array) -> bool:
    """Return whether the interface ends, and every node that can break slips.

    >>> sample = make_sample(np.array([2.0, np.inf, 3.0]), *np.zeros((3, 3)), LINEAR)
    >>> [all_breakable_slip(sample, np.array(slip)) for slip in ([0.1, 0, 0.2], [0.1, 0.1, 0])]
    [True, False]
    >>> all_breakable_slip(sample._replace(excess=np.ones(3)), np.ones(3))
    False
    """
    can_break = np.isfinite(sample.excess)
    return not can_break.all() and bool((slip[can_break] > 0.0).all())


@jit_inside
def piece_at(sample: StaticSample, slip: Array, i: int) -> int:
    """Return the piece on which node i is after some slip.

    >>> pieces = LINEAR._replace(ends=np.array([0.25, 1.0]))
    >>> sample = make_sample(*np.array([[2.0, 6.0], [1.0, 2.0], [1, 1], [2.0, 1.0]]), pieces)
    >>> sample.critical.tolist()
    [0.5, 4.0]
    >>> [piece_at.py_func(sample, np.array([9.0, slip]), 1) for slip in (0.9, 1.0, 3.9, 4.0)]
    [0, 1, 1, 2]
    """
    piece, ends, at_corner = 0, sample.pieces.ends, sample.pieces.at_corner
    while piece < ends.shape[0] and slip[i] >= at_corner * (ends[piece] * sample.critical[i]):
        piece += 1
    return piece


@jit_inside
def start_of(sample: StaticSample, i: int, piece: int) -> float:
    """Return the strength at node i minus initial stress, Pa, for a piece continued to zero slip.

    The first piece gives tau_p, and the last piece gives tau_r.

    Three quarters of the excess and a quarter of the residual strength:

    >>> pieces = LINEAR._replace(starts=np.array([1.0, 0.75, 0.0]))
    >>> sample = make_sample(*np.array([[9.0, 6.0], [1.0, 2.0], [1, 1], [1, 1]]), pieces)
    >>> [float(start_of.py_func(sample, 1, piece)) for piece in (0, 1, 2)]
    [6.0, 5.0, 2.0]
    """
    share = sample.pieces.starts[piece]
    return share * sample.excess[i] + (1.0 - share) * sample.residual[i]


@jit_inside
def strength_at(sample: StaticSample, slip: Array, i: int) -> float:
    """Return the strength of node i minus initial stress after some slip, Pa.

    Strength falls from 6 to 2 Pa at 2 Pa/m up to d_c = 2 m:

    >>> rows = np.array([[9.0, 6.0], [1.0, 2.0], [1, 1], [1, 2.0]])
    >>> sample = make_sample(*rows, LINEAR)
    >>> call = jit(lambda sample, slip, i: strength_at(sample, slip, i))
    >>> [call(sample, np.array([7.0, slip]), 1) for slip in (0.0, 0.5, 2.0, 3.0)]
    [6.0, 5.0, 2.0, 2.0]
    """
    piece = piece_at(sample, slip, i)
    W = sample.pieces.slopes[piece] * sample.weakening_rate[i]
    return start_of(sample, i, piece) - W * slip[i]


@jit
def _find_pieces(sample: StaticSample, slip: Array, present: Present) -> None:
    for i in range(slip.size):
        piece = piece_at(sample, slip, i)
        present.piece[i] = piece
        present.strength[i] = start_of(sample, i, piece)
        present.weakening_rate[i] = sample.pieces.slopes[piece] * sample.weakening_rate[i]


def present_pieces(sample: StaticSample, slip: Array) -> Present:
    """Return the pieces on which the nodes are after some slip.

    The law falls from 1 to 0.4 at u = 0.3 and to 0 at u = 1 (example above). Here d_c
    is 2 x 4/8 = 1 m. The second piece starts at 1 + 4 x 4/7 Pa and falls by 2/7 x 8 Pa/m:

    >>> starts, slopes = np.array([1, 4 / 7, 0]), np.array([1, 2 / 7, 0])
    >>> pieces = Pieces(np.array([0.3, 1.0]), starts, slopes, 2.0, 0.35)
    >>> sample = make_sample(np.full(3, 5.0), np.ones(3), np.ones(3), np.full(3, 8.0), pieces)
    >>> piece, strength, W = present_pieces(sample, np.array([0.5, 0.0, 1.5]))
    >>> piece.tolist()
    [1, 0, 2]
    >>> strength.round(6).tolist()
    [3.285714, 5.0, 1.0]
    >>> W.round(6).tolist()
    [2.285714, 8.0, 0.0]
    """
    present = Present(np.empty(slip.size, dtype=np.int64), *np.empty((2, slip.size)))
    _find_pieces(sample, slip, present)
    return present


@jit
def step_to_corner(sample: StaticSample, slip: Array, direction: Array, limit: float) -> float:
    """Move slip along a direction until the first node reaches a corner, and return the step.

    The step is at most `limit`. If the
    step is infinite, slip does not change.

    Corners are at 0.5 and 2 m. Node 1 would reach its first corner after a step of
    0.2, and node 0 its second corner after 0.375. A node that does not move counts for nothing:

    >>> pieces = LINEAR._replace(ends=np.array([0.25, 1.0]))
    >>> sample = make_sample(np.full(4, 3.0), np.ones(4), np.ones(4), np.ones(4), pieces)
    >>> slip, direction = np.array([1.25, 0.1, 0.4, 2.5]), np.array([2.0, 2.0, 0.0, 1.0])
    >>> step_to_corner(sample, slip, direction, np.inf)
    0.2
    >>> slip.tolist()
    [1.65, 0.5, 0.4, 2.7]
    >>> step_to_corner(sample, slip, direction, 0.0625)
    0.0625
    >>> slip.tolist()
    [1.775, 0.625, 0.4, 2.7625]
    >>> only_last = np.array([0.0, 0.0, 0.0, 1.0])  # at its residual strength
    >>> step_to_corner(sample, slip, only_last, np.inf)
    inf
    >>> slip.tolist()
    [1.775, 0.625, 0.4, 2.7625]
    """
    step, ends = limit, sample.pieces.ends
    for i in range(slip.shape[0]):
        if direction[i] > 0.0:
            piece = piece_at(sample, slip, i)
            if piece < ends.shape[0]:
                step = min(step, (ends[piece] * sample.critical[i] - slip[i]) / direction[i])
    if step == np.inf:
        return step
    for i in range(slip.shape[0]):
        slip[i] += step * direction[i]
    return step


@jit_inside
def unsupported(sample: StaticSample, load: float, slip: Array) -> bool:
    """Return whether the load exceeds the present strengths of the whole interface.

    If so, the interface slides, because strength only falls with slip.

    The strengths are 4 - 1 and 1 Pa, and the load 1.5 times 1 and 2:

    >>> sample = make_sample(*np.array([[4.0, 3.0], [0.0, 1.0], [1, 2.0], [1.0, 1.0]]), LINEAR)
    >>> call = jit(lambda sample, load, slip: unsupported(sample, load, slip))
    >>> [call(sample, load, np.array([1.0, 2.5])) for load in (1.3, 1.4)]
    [False, True]
    """
    balance = 0.0
    for i in range(slip.shape[0]):
        balance += load * sample.profile[i] - strength_at(sample, slip, i)
    return balance > 0.0

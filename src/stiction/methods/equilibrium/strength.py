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
    """Return the pieces of a law for which `solver.refused` returns no reason."""
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
    """
    excess, residual, profile, W, critical, pieces = samples
    return StaticSample(excess[row], residual[row], profile, W[row], critical[row], pieces)


class Present(NamedTuple):
    """Present pieces of the nodes, with their value at zero slip (Pa) and slope (Pa/m)."""

    piece: NDArray[np.int64]
    strength: Array
    weakening_rate: Array


def residual_nodes(sample: StaticSample, slip: Array) -> NDArray[np.bool_]:
    """Return which weakening nodes have reached their residual strength."""
    reached: NDArray[np.bool_] = slip >= sample.pieces.at_corner * sample.critical
    return reached & (sample.critical > 0.0)


def exceeds(sample: StaticSample, slip: Array, piece: NDArray[np.int64] | None = None) -> bool:
    """Return whether slip at any node exceeds the given piece, by default the first piece."""
    pieces = sample.pieces
    end = pieces.ends[0] if piece is None else np.append(pieces.ends, 1e300)[piece]
    beyond: NDArray[np.bool_] = slip > (2.0 - pieces.at_corner) * (end * sample.critical)
    return bool(beyond.any()) and bool((beyond & (sample.critical > 0.0)).any())


def all_breakable_slip(sample: StaticSample, slip: Array) -> bool:
    """Return whether the interface ends, and every node that can break slips."""
    can_break = np.isfinite(sample.excess)
    return not can_break.all() and bool((slip[can_break] > 0.0).all())


@jit_inside
def piece_at(sample: StaticSample, slip: Array, i: int) -> int:
    """Return the piece on which node i is after some slip."""
    piece, ends, at_corner = 0, sample.pieces.ends, sample.pieces.at_corner
    while piece < ends.shape[0] and slip[i] >= at_corner * (ends[piece] * sample.critical[i]):
        piece += 1
    return piece


@jit_inside
def start_of(sample: StaticSample, i: int, piece: int) -> float:
    """Return the strength at node i minus initial stress, Pa, for a piece continued to zero slip.

    The first piece gives tau_p, and the last piece gives tau_r.
    """
    share = sample.pieces.starts[piece]
    return share * sample.excess[i] + (1.0 - share) * sample.residual[i]


@jit_inside
def strength_at(sample: StaticSample, slip: Array, i: int) -> float:
    """Return the strength of node i minus initial stress after some slip, Pa."""
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
    """Return the pieces on which the nodes are after some slip."""
    present = Present(np.empty(slip.size, dtype=np.int64), *np.empty((2, slip.size)))
    _find_pieces(sample, slip, present)
    return present


@jit
def step_to_corner(sample: StaticSample, slip: Array, direction: Array, limit: float) -> float:
    """Move slip along a direction until the first node reaches a corner, and return the step.

    The step is at most `limit`. If the
    step is infinite, slip does not change.
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
    """
    balance = 0.0
    for i in range(slip.shape[0]):
        balance += load * sample.profile[i] - strength_at(sample, slip, i)
    return balance > 0.0

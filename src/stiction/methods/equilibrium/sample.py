"""Samples, equilibrium states, and the protocol for the search for equilibria.

Strength falls with slip along straight pieces. A law with M pieces has
M corners, and piece M is the residual strength. Between corners the
equations are linear, so solvers step from corner to corner. The linear
law has a single piece, which starts exactly at tau_p.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from types import MappingProxyType
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit, jit_inside
from stiction.elasticity.operator import inner
from stiction.problem.friction import FrictionLaw
from stiction.problem.friction.parameters import Linear, Polygon
from stiction.problem.sample import Sample

CONSTANT_STRENGTH_RTOL = 1e-11
"""Smallest fall of strength, as a share of the mean strength, with which a node counts as
weakening. A smaller fall is within the round-off of K d: an instability
of such nodes adds no slip
and never ends."""


class Pieces(NamedTuple):
    """Falling, piecewise linear function f of u = slip/d_c. It is the same at every node.

    At a node, W is the weakening rate of the first piece. The relative
    slope of this piece is therefore 1.
    """

    ends: Array  # (M,): u at the end of each piece; the last is 1
    starts: Array  # (M + 1,): f on each piece, continued to u = 0; from 1 to 0 (residual)
    slopes: Array  # (M + 1,): -f' on each piece, over `first_slope`; from 1 to 0 (residual)
    first_slope: float  # -f' on the first piece
    area: float  # integral of f
    at_corner: float = 1.0 - 1e-12  # a node with this share of a corner's slip is beyond it

    @property
    def steepens(self) -> bool:
        """Whether a piece falls more steeply than the piece before it."""
        return bool(np.any(np.diff(self.slopes) > 0.0))


LINEAR = Pieces(np.array([1.0]), np.array([1.0, 0.0]), np.array([1.0, 0.0]), 1.0, 0.5)


def refused(law: FrictionLaw) -> list[str]:
    """Return the reasons why a law cannot be followed piece by piece, or an empty list."""
    name, kind = type(law).__name__, type(law.parameters)
    if kind in (Linear, Polygon):
        return []
    return [
        f"friction: {name} is curved, but equilibria are followed along straight pieces. Use"
        " st.PiecewiseWeakening.from_law(friction, pieces=32) or, between half-spaces,"
        " st.Rupture(...)"
    ]


def pieces_of(law: FrictionLaw) -> Pieces:
    """Return the pieces of a law for which `refused` returns no reason."""
    parameters = law.parameters
    if not isinstance(parameters, Polygon):
        return LINEAR
    u, f = parameters.slip, parameters.fraction
    steep = np.append(-np.diff(f) / np.diff(u), 0.0)
    starts = f + steep * u
    return Pieces(u[1:].copy(), starts, steep / steep[0], float(steep[0]), law.integral)


class Outcome(IntEnum):
    """Outcome for an interface that moves at a fixed load."""

    SLIDING = 0
    ARRESTED = 1
    UNDECIDED = 2
    NOT_UNSTABLE = 3  # at rest after a long step along a path that was not seen to turn


class PathStatus(IntEnum):
    """Why the path of stable equilibria ends at a state."""

    STABLE = 0  # the load is the target, or every node has slipped
    UNSTABLE = 1  # slip jumps along the direction of the state
    GIVEN_UP = 2  # too many slipping nodes, or too many events


class Search(IntEnum):
    """How the equilibria after a state of a line or specimen are found."""

    PROGRAMME_FROM_REST = 0
    PROGRAMME = 1  # from the state, because a patch jumped before
    EVENTS = 2  # event by event, because the programme does not hold


class StaticSample(NamedTuple):
    """Strength profile, as arrays (nodes,). Rate and d_c are 0 at nodes with constant strength.

    Beyond the extent of the interface, excess and d_c are infinite.
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


def sample_of(rows: Sample, pieces: Pieces, row: int | slice = slice(None)) -> StaticSample:
    """Return one sample or all samples of a batch, in the form that kernels need."""
    initial = rows.initial_stress[row]
    shape = (*initial.shape[: initial.ndim - rows.load_profile.ndim], -1)
    excess = (rows.strength[row] - initial).reshape(shape)
    residual = (rows.residual_strength[row] - initial).reshape(shape)
    # Copy the rate: numba would compile each kernel again for a
    # read-only array, as laws return.
    weakening_rate = rows.weakening_rate[row].reshape(shape).copy()
    return make_sample(excess, residual, rows.load_profile.flatten(), weakening_rate, pieces)


def row_of(samples: StaticSample, row: int) -> StaticSample:
    """Return a sample from a batch that `sample_of` made. This saves a tenth of the time."""
    excess, residual, profile, W, critical, pieces = samples
    return StaticSample(excess[row], residual[row], profile, W[row], critical[row], pieces)


class Present(NamedTuple):
    """Present pieces of the nodes, with their value at zero slip (Pa) and slope (Pa/m)."""

    piece: NDArray[np.int64]
    strength: Array
    weakening_rate: Array


@dataclass
class EquilibriumState:
    """An equilibrium on the path of a sample."""

    load: float  # tau_0, Pa
    slip: Array  # (n,): d, m
    direction: Array  # (n,): direction of the instability
    Kd: Array = field(default_factory=lambda: np.empty(0))  # (n,): K d, Pa; empty on planes
    status: PathStatus = PathStatus.UNSTABLE
    search: Search = Search.PROGRAMME_FROM_REST
    gap: float | None = None  # distance to a load without equilibrium, Pa, if it is known
    certified: bool = True  # a multiplier proves the gap
    stopped: bool = False  # a slipping node stopped on the way
    # Largest mean stress on the way here, divided by the mean of the
    # load profile, Pa. Without a machine it is the load itself (None).
    peak: float | None = None
    K_direction: Array | None = None  # (n,): K times the direction, if it is known
    # The exact y with <p, y> = 1, if the direction is exact; otherwise
    # the direction replaces it.
    multiplier: Array | None = None

    @property
    def highest(self) -> float:
        """Largest load that the interface carried on the way to this state, Pa."""
        return self.load if self.peak is None else self.peak


def at_rest(sample: StaticSample) -> EquilibriumState:
    """Return the state in which the first node is about to slip."""
    load = float((sample.excess / sample.profile).min())
    slip, direction, Kd = np.zeros((3, sample.excess.size))
    return EquilibriumState(load, slip, direction, Kd, PathStatus.STABLE)


def multiplier_of(sample: StaticSample, state: EquilibriumState) -> Array:
    """Return the multiplier y of an instability, <p, y> = 1."""
    if state.multiplier is not None:
        return state.multiplier
    return state.direction / max(inner(state.direction, sample.profile), 1e-300)


class Jump(NamedTuple):
    """End of an instability."""

    outcome: Outcome
    state: EquilibriumState
    arrival: Array | None = None  # with inertia: arrival time of the front at each node, s
    timed: Mapping[str, float] = MappingProxyType({})  # with inertia: variables of the event


class Program(Protocol):
    """Thread-safe protocol for the search for equilibria: `DenseProgram` or `PlaneProgram`.

    `widest_gap` is the largest certificate gap without a warning, as a
    share of the load.
    """

    pieces: Pieces
    widest_gap: float

    def next(
        self, sample: StaticSample, state: EquilibriumState | None = None
    ) -> EquilibriumState:
        """Return the next instability from a stable state, or from rest."""

    def jump(
        self, sample: StaticSample, instability: EquilibriumState, to_rest: bool = False
    ) -> Jump:
        """Let an unstable state jump to a new equilibrium, or to sliding.

        If an interface ends, the jump stops when all nodes that can
        break slip. With `to_rest`, it goes on.
        """

    def at(
        self, sample: StaticSample, state: EquilibriumState, load: float
    ) -> EquilibriumState | None:
        """Return the equilibrium at a load above a state, or `None` if it is not found."""

    def gradient(self, sample: StaticSample, state: EquilibriumState) -> Array:
        """Return the derivative (n,) of an instability's stress with respect to the strengths.

        The stress is the mean stress divided by the mean of the load
        profile. The strengths are the present pieces of the law,
        continued to zero slip.
        """

    def stress_released(self, state: EquilibriumState) -> Array:
        """Return the stress K d that slip releases, Pa."""


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
def piece_at(pieces: Pieces, critical: float, slip: float) -> int:
    """Return the piece on which a node with a given d_c is after some slip."""
    piece = 0
    while piece < pieces.ends.shape[0] and slip >= pieces.at_corner * (
        pieces.ends[piece] * critical
    ):
        piece += 1
    return piece


@jit_inside
def start_of(sample: StaticSample, i: int, piece: int) -> float:
    """Return the strength of node i minus initial stress, Pa, for a piece continued to zero slip.

    The first piece gives tau_p, and the last piece gives tau_r.
    """
    share = sample.pieces.starts[piece]
    return share * sample.excess[i] + (1.0 - share) * sample.residual[i]


@jit_inside
def strength_at(sample: StaticSample, slip: Array, i: int) -> float:
    """Return the strength of node i minus initial stress after some slip, Pa."""
    piece = piece_at(sample.pieces, sample.critical[i], slip[i])
    W = sample.pieces.slopes[piece] * sample.weakening_rate[i]
    return start_of(sample, i, piece) - W * slip[i]


@jit
def _find_pieces(sample: StaticSample, slip: Array, present: Present) -> None:
    for i in range(slip.size):
        piece = piece_at(sample.pieces, sample.critical[i], slip[i])
        present.piece[i] = piece
        present.strength[i] = start_of(sample, i, piece)
        present.weakening_rate[i] = sample.pieces.slopes[piece] * sample.weakening_rate[i]


def present_pieces(sample: StaticSample, slip: Array) -> Present:
    """Return the pieces on which the nodes are after some slip."""
    present = Present(np.empty(slip.size, dtype=np.int64), *np.empty((2, slip.size)))
    _find_pieces(sample, slip, present)
    return present


@jit
def step_to_corner(
    sample: StaticSample, slip: Array, direction: Array, longest: float
) -> float:
    """Move slip along a direction until the first node reaches a corner, and return the step.

    The step is at most `longest`. If the
    step is infinite, slip does not change.
    """
    step = longest
    ends = sample.pieces.ends
    for i in range(slip.shape[0]):
        if direction[i] > 0.0:
            piece = piece_at(sample.pieces, sample.critical[i], slip[i])
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

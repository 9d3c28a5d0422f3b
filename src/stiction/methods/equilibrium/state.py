"""Equilibrium states, how searches end at them, and the protocol for these searches."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.operator import inner
from stiction.methods.equilibrium.strength import Pieces, StaticSample


class Outcome(IntEnum):
    """Outcomes for an interface that moves at a fixed load."""

    SLIDING = 0
    ARRESTED = 1
    UNDECIDED = 2
    NOT_UNSTABLE = 3  # at rest after a long step along a path that was not seen to turn


class PathStatus(IntEnum):
    """Reasons why the path of stable equilibria ends at a state."""

    STABLE = 0  # the load is the target, or every node has slipped
    UNSTABLE = 1  # slip jumps along the direction of the state
    GIVEN_UP = 2  # too many slipping nodes, or too many events


class Route(IntEnum):
    """Ways to find the equilibria after a state of a line or specimen."""

    PROGRAMME_FROM_REST = 0
    PROGRAMME = 1  # from the state, because a patch jumped before
    EVENTS = 2  # event by event, because the programme does not hold


@dataclass
class EquilibriumState:
    """An equilibrium on the path of a sample."""

    load: float  # tau_0, Pa
    slip: Array  # (n,): d, m
    direction: Array  # (n,): direction of the instability
    Kd: Array = field(default_factory=lambda: np.empty(0))  # (n,): K d, Pa; empty on planes
    status: PathStatus = PathStatus.UNSTABLE
    route: Route = Route.PROGRAMME_FROM_REST
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
        """Largest load that the interface carried on the way to this state, Pa.

        >>> from dataclasses import replace
        >>> state = EquilibriumState(3.0, np.zeros(2), np.zeros(2))
        >>> state.highest
        3.0
        >>> replace(state, peak=4.0).highest
        4.0
        >>> replace(state, peak=0.0).highest
        0.0
        """
        return self.load if self.peak is None else self.peak


def at_rest(sample: StaticSample) -> EquilibriumState:
    """Return the state in which the first node is about to slip.

    The nodes begin to slip at 4, 1.5 and 2 Pa:

    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> rows = np.array([[4.0, 3.0, 6.0], [1.0, 2.0, 0.0], [1.0, 2.0, 3.0], [5.0, 6.0, 7.0]])
    >>> state = at_rest(make_sample(*rows, LINEAR))
    >>> state.load
    1.5
    >>> state.slip.tolist()
    [0.0, 0.0, 0.0]
    >>> state.status.name
    'STABLE'
    >>> state.Kd.tolist()
    [0.0, 0.0, 0.0]
    """
    load = float((sample.excess / sample.profile).min())
    slip, direction, Kd = np.zeros((3, sample.excess.size))
    return EquilibriumState(load, slip, direction, Kd, PathStatus.STABLE)


def multiplier_of(sample: StaticSample, state: EquilibriumState) -> Array:
    """Return the multiplier y of an instability, <p, y> = 1.

    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> profile = np.array([1.0, 4.0])
    >>> sample = make_sample(np.array([3.0, 2.0]), np.zeros(2), profile, np.ones(2), LINEAR)
    >>> at_rest(sample).load
    0.5
    >>> unstable = EquilibriumState(0.5, np.zeros(2), direction=np.array([2.0, 0.5]))
    >>> multiplier_of(sample, unstable).tolist()
    [0.5, 0.125]

    If y is known exactly, y is returned:

    >>> unstable.multiplier = np.array([0.3, 0.2])
    >>> multiplier_of(sample, unstable).tolist()
    [0.3, 0.2]
    """
    if state.multiplier is not None:
        return state.multiplier
    return state.direction / max(inner(state.direction, sample.profile), 1e-300)


class Jump(NamedTuple):
    """End of an instability."""

    outcome: Outcome
    state: EquilibriumState
    arrival: Array | None = None  # with inertia: arrival time of the front at each node, s
    known: Mapping[str, Any] = MappingProxyType({})  # with inertia: variables of the event


class EquilibriumSearch(Protocol):
    """Protocol for thread-safe searches for equilibria: `DenseSearch` or `PlaneSearch`.

    `widest_gap` is the largest certificate gap that causes no warning,
    as a fraction of the load.
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

    def stress_released(self, state: EquilibriumState) -> Array:
        """Return the stress K d that slip releases, Pa."""

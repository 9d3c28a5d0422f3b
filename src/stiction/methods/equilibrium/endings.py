"""How the searches for equilibria end, and the route by which they go on."""

from enum import IntEnum


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


class Route(IntEnum):
    """How the equilibria after a state of a line or specimen are found."""

    PROGRAMME_FROM_REST = 0
    PROGRAMME = 1  # from the state, because a patch jumped before
    EVENTS = 2  # event by event, because the programme does not hold

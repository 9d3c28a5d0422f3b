"""From the first instability to global sliding: stable path, jump, stable path, and so on."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from stiction.arrays import Array
from stiction.equilibrium.sample import Sample


@dataclass
class State:
    """An equilibrium on the path of one sample, by default one at which it is unstable.

    Attributes
    ----------
    load : float
        tau_0, Pa.
    slip, stiff, direction : (nodes,) arrays
        d (m), K d (Pa; of lines only), and the direction in which it is unstable.
    upper : float
        A load without equilibrium (Pa), where it is known.
    certified : bool
        Whether that is proved.
    unstable, known : bool
        Whether the path is unstable there, and whether it could be followed so far.
    stuck : bool
        Whether the programme failed to find the next instability before.
    ahead : Any
        What is known already of the equilibrium to which it leads.
    """

    load: float
    slip: Array
    stiff: Array
    direction: Array
    upper: float = np.nan
    certified: bool = True
    unstable: bool = True
    known: bool = True
    stuck: bool = False
    ahead: Any = None


class Jump(NamedTuple):
    """Where an instability ends: whether it is arrested, and counts; the state; if it is known.

    `counts` is false for a jump so small that it is a long step of the stable path.
    """

    arrested: bool
    known: bool
    state: State
    counts: bool = True


class Program(Protocol):
    """Equilibria of the samples of one problem."""

    def at_rest(self, sample: Sample) -> State:
        """The state in which the first node is about to slip."""

    def next(self, sample: Sample, state: State) -> State:
        """The next instability on the path from a stable state."""

    def jump(self, sample: Sample, found: State) -> Jump:
        """Let an unstable state jump to the least equilibrium above it, or to sliding."""

    def at(self, sample: Sample, state: State, load: float, fresh: bool) -> State | None:
        """The equilibrium at a load from a state below with no instability between, or None.

        `fresh` says that there has been no instability before either.
        """


class Event(NamedTuple):
    """An instability that came to rest: the states before and after it."""

    before: State
    after: State


@dataclass
class Path:
    """What happens to one sample until it slides.

    `first` is the first instability, `last` the last equilibrium, `known` is false where a jump
    or a path did not come to its end: `last` is then a lower bound.
    """

    first: State
    last: State
    events: list[Event] = field(default_factory=list)
    known: bool = True


def follow(program: Program, sample: Sample, found: State | None = None) -> Path:
    """Follow a sample to global sliding.

    Parameters
    ----------
    program : Program
    sample : Sample
    found : State, optional
        Its first instability, if it is known; otherwise the path is followed from rest.

    Notes
    -----
    Arrest is overdamped: the patch stops at the least equilibrium of the same load. Inertia may
    carry it through.
    """
    if found is None:
        found = program.next(sample, program.at_rest(sample))
    first: State | None = None
    events: list[Event] = []
    known = found.known
    while found.unstable:
        jump = program.jump(sample, found)
        if jump.counts:
            first = first or found
            if not jump.arrested:
                known = jump.known
                break
            events.append(Event(found, jump.state))
        found = program.next(sample, jump.state)
        known = found.known
    return Path(first or found, found, events, known)

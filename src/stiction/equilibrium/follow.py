"""From the first instability to global sliding: stable path, jump, stable path, and so on."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np

from stiction._typing import Array
from stiction.equilibrium.advance import REACHED, advance
from stiction.equilibrium.jump import ARRESTED, UNDECIDED, escape_run, jump
from stiction.equilibrium.patches import main_patch
from stiction.equilibrium.spaces import Grid, Room, Sample, make_room
from stiction.errors import AccuracyWarning

JUMP_STEPS = 4000
MARGIN = 1.5
"""Safety on the length at which a rupture counts as unstoppable."""


@dataclass
class Event:
    """An instability: where and at which load, and what slipped if it was arrested.

    `load` is tau_0 (Pa); `position` and `length` (in nodes) belong to the patch that slipped, and
    `mean_slip` (m) is the slip added to it; `moment` is the slip added anywhere, summed over nodes.
    """

    load: float
    position: float
    length: float
    mean_slip: float
    moment: float


@dataclass
class State:
    """Where the path is: load, slip, K d, and whether it has ended in global sliding.

    `direction` is the last unstable direction, `onset_slip` the slip just before it.
    """

    load: float
    slip: Array
    stiff: Array
    direction: Array
    sliding: bool = False
    events: list[Event] = field(default_factory=list)
    first: State | None = None


def start(sample: Sample) -> State:
    """The state in which the first node is about to slip."""
    n = sample.excess.shape[0]
    load = float((sample.excess / sample.profile).min())
    return State(load, np.zeros(n), np.zeros(n), np.zeros(n))


def fall(sample: Sample, grid: Grid, state: State, cell: float, room: Room) -> None:
    """Let the unstable state jump: to another equilibrium, recorded as an event, or to sliding.

    Parameters
    ----------
    cell : float
        Effective modulus over node spacing, Pa/m.
    """
    before, stiff_before = state.slip.copy(), state.stiff.copy()
    if state.first is None:
        state.first = State(state.load, before, stiff_before, state.direction.copy())
    escape = MARGIN * escape_run(sample, state.load, 1.0, cell)
    fate = jump(
        sample, grid, state.load, state.slip, state.stiff, state.direction.copy(), escape,
        JUMP_STEPS, True, room,
    )  # fmt: skip
    if fate == UNDECIDED:
        warnings.warn(
            "the jump of an unstable patch did not settle; it is counted as global sliding",
            AccuracyWarning,
            stacklevel=2,
        )
    if fate != ARRESTED:
        state.sliding = True
        state.slip, state.stiff = before, stiff_before
        return
    added = state.slip - before
    # The whole interface yields a little; the patch is where slip grew by a fair share of the most.
    moved = np.where(added > 1e-3 * added.max(), added, 0.0)
    first, length, centre = main_patch(moved)
    nodes = (first + np.arange(length)) % added.shape[0]
    state.events.append(
        Event(state.load, centre, length, float(added[nodes].mean()), float(added.sum()))
    )


def follow(
    sample: Sample, grid: Grid, state: State, cell: float, target: float = np.inf
) -> State:
    """Carry a state on to a load, or to global sliding."""
    n = sample.excess.shape[0]
    room = make_room(n)
    while not state.sliding and state.load < target:
        state.load, status = advance(
            sample, grid, state.load, target, state.slip, state.stiff, state.direction, 20 * n, room
        )
        if status == REACHED:
            break
        fall(sample, grid, state, cell, room)
    return state

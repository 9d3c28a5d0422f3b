"""From the first instability to global sliding: stable path, jump, stable path, and so on."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.equilibrium.instability_jump import (
    ARRESTED,
    SLIDING,
    UNDECIDED,
    jump,
)
from stiction.equilibrium.patches import main_patch
from stiction.equilibrium.pieces import AT_CORNER
from stiction.equilibrium.prepared import Setting
from stiction.equilibrium.single_patch_test import runs_away
from stiction.equilibrium.stable_path import CROWDED, REACHED, advance
from stiction.equilibrium.window_test import runs_away_frozen
from stiction.equilibrium.workspace import Sample, make_workspace
from stiction.errors import warn_accuracy

JUMP_STEPS = 4000
MARGIN = 1.5
"""Safety on the length at which a rupture counts as unstoppable."""
MOVED = 1e-3
"""Share of the largest added slip from which a node belongs to the patch of an event."""
OVERSHOOT = 2.0 - AT_CORNER
TOGETHER = 1e-9
"""Share of the slip at a corner within which nodes reach their corners at once."""


@dataclass
class Event:
    """An instability that came to rest.

    `load` is tau_0 (Pa); `position` and `length` (in nodes) belong to the patch that slipped, and
    `mean_slip` (m) is the slip added to it; `total_slip` is the slip added, summed over all nodes.
    """

    load: float
    position: float
    length: float
    mean_slip: float
    total_slip: float


@dataclass
class State:
    """Where the path is: load, slip, K d, and whether it has ended in global sliding.

    `direction` is that of the last instability, and `first` the state at the first one. `ahead` is
    a slip that is known to lie below the equilibrium to which the present instability leads.
    """

    load: float
    slip: Array
    stiff: Array
    direction: Array
    sliding: bool = False
    events: list[Event] = field(default_factory=list)
    first: State | None = None
    ahead: Array | None = None


def residual_nodes(sample: Sample, slip: Array) -> Array:
    """Which weakening nodes have reached their residual strength, (n,) bool."""
    reached: Array = (slip >= AT_CORNER * sample.critical) & (sample.critical > 0.0)
    return reached


def present_pieces(sample: Sample, slip: Array) -> tuple[NDArray[np.int64], Array, Array]:
    """The piece on which each node is, what it has at zero slip (Pa), and its slope (Pa/m)."""
    pieces = sample.pieces
    corners = AT_CORNER * (pieces.ends * sample.critical[:, None])
    piece = np.count_nonzero(slip[:, None] >= corners, axis=1)
    share = pieces.starts[piece]
    return (
        piece,
        share * sample.excess + (1.0 - share) * sample.residual,
        pieces.slopes[piece] * sample.rate,
    )


def steep_corners(sample: Sample, slip: Array) -> NDArray[np.int64]:
    """Nodes that are at a corner beyond which they weaken more steeply."""
    pieces = sample.pieces
    corners = pieces.ends * sample.critical[:, None]
    near = np.abs(slip[:, None] - corners) <= TOGETHER * corners
    steeper = np.diff(pieces.slopes) > 0.0
    found: NDArray[np.int64] = np.flatnonzero(
        (near & steeper).any(axis=1) & (sample.critical > 0.0)
    )
    return found


def exceeds(sample: Sample, slip: Array, piece: NDArray[np.int64] | None = None) -> bool:
    """Whether a slip goes beyond the piece of each node (by default the first) that it rests on."""
    ends = np.append(sample.pieces.ends, np.inf)
    with np.errstate(invalid="ignore"):
        end = ends[0 if piece is None else piece] * sample.critical
    return bool(np.any((slip > OVERSHOOT * end) & (sample.critical > 0.0)))


def at_rest(sample: Sample) -> State:
    """The state in which the first node is about to slip."""
    n = sample.excess.shape[0]
    load = float((sample.excess / sample.profile).min())
    return State(load, np.zeros(n), np.zeros(n), np.zeros(n))


def fall(setting: Setting, sample: Sample, state: State) -> None:
    """Let the unstable state jump: to another equilibrium, recorded as an event, or to sliding."""
    n = sample.excess.shape[0]
    before, stiff_before = state.slip.copy(), state.stiff.copy()
    if state.first is None:
        state.first = State(state.load, before, stiff_before, state.direction.copy())
    griffith = setting.griffith_length(sample, state.load)
    if state.ahead is None:
        outcome = runs_away(
            sample, setting.wide_column, state.load, state.slip, state.stiff, state.direction,
            setting.stiffness(state.direction), griffith, setting.block, setting.reach,
            np.empty((6, n)),
        )  # fmt: skip
    else:
        state.slip, state.ahead, outcome = state.ahead, None, UNDECIDED
    griffith *= MARGIN
    if outcome == UNDECIDED and runs_away_frozen(
        setting.grid, sample, state.load, state.slip, state.direction, griffith, JUMP_STEPS
    ):
        outcome = SLIDING
    if outcome == UNDECIDED:
        outcome = jump(
            sample, setting.grid, state.load, state.slip, state.stiff, griffith, JUMP_STEPS,
            make_workspace(n),
        )  # fmt: skip
    if outcome == ARRESTED and not np.any(
        present_pieces(sample, state.slip)[0] > present_pieces(sample, before)[0]
    ):
        outcome = UNDECIDED  # round-off: only nodes that pass a corner can stop an instability
    if outcome == UNDECIDED:
        warn_accuracy(
            "the jump of an unstable patch did not settle; it is counted as global sliding"
        )
    if outcome != ARRESTED:
        state.sliding = True
        state.slip, state.stiff = before, stiff_before
        return
    added = state.slip - before
    # The whole interface yields a little; the patch is where slip grew by a fair share of the most.
    moved = np.where(added > MOVED * added.max(), added, 0.0)
    first, length, centre = main_patch(moved)
    nodes = (first + np.arange(length)) % n
    state.events.append(
        Event(state.load, centre, length, float(added[nodes].mean()), float(added.sum()))
    )


def leap(setting: Setting, sample: Sample, state: State) -> bool:
    """Go straight to the next instability if no node reaches another corner before it."""
    piece, strength, rate = present_pieces(sample, state.slip)
    found = setting.programme(strength, rate)
    if found is None or found.load < state.load:
        return False
    if exceeds(sample, found.slip, piece):
        return False
    state.load, state.slip, state.stiff = found.load, found.slip, found.stiff
    state.direction = found.multiplier
    return True


def follow(setting: Setting, sample: Sample, state: State, target: float = np.inf) -> State:
    """Carry a state on to a load, or to global sliding.

    Parameters
    ----------
    setting : Setting
    sample : Sample
    state : State
        A stable equilibrium, changed.
    target : float
        Load to stop at, Pa.
    """
    n = sample.excess.shape[0]
    leaping = target == np.inf
    while not state.sliding and state.load < target:
        # Where one leap failed most others would.
        leaping = leaping and (not state.events or leap(setting, sample, state))
        if not (leaping and state.events):
            state.load, status = advance(
                sample, setting.grid, state.load, target, state.slip, state.stiff,
                state.direction, make_workspace(n),
            )  # fmt: skip
            if status == CROWDED:
                warn_accuracy(
                    "too many slipping nodes to follow event by event; the last load that was"
                    " reached is returned as the critical one, a lower bound"
                )
                state.sliding = True
            if status == REACHED or state.sliding:
                break
        fall(setting, sample, state)
    return state

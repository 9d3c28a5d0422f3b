"""The state of a rupture: constants of a run, variables, and diagnostics of every step.

Fields of the interface and their transforms are flat, whatever its shape; `Grid.transform` knows
the shape. Modes q = 0, 1, ... are those of the real transform in its order, q = 0 the mean.
"""

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit
from stiction.elasticity.operator import Transform

Ints = NDArray[np.int64]
Spectrum = NDArray[np.complex128]
Floats = NDArray[np.float64]


class History(NamedTuple):
    """A piecewise linear function, continued beyond its last point with its last slope."""

    at: Floats  # times, s, or loads, Pa; rising
    values: Floats


@jit
def value_at(history: History, t: float) -> Any:
    """Value of a piecewise linear function."""
    times, values = history
    low, high = 0, times.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if times[middle] <= t:
            low = middle
        else:
            high = middle
    slope = (values[high] - values[low]) / (times[high] - times[low])
    return values[low] + slope * (t - times[low])


Reason = IntEnum(
    "Reason", "DONE ALL_SLID TO_EXPLICIT TO_IMPLICIT NOT_FINITE DROPPED AT_REST", start=0
)
"""Reasons why a compiled loop of steps returned."""

DIAGNOSTICS = np.dtype(
    [
        ("time", "f8"),  # s
        ("size", "f8"),  # of the last step, s
        ("load", "f8"),  # tau_0, Pa
        ("work", "f8"),  # of the load on the slip, J/m
        ("mean_slip", "f8"),  # m
        ("mean_stress", "f8"),  # Pa, as all stresses here
        ("local_stress", "f8"),  # last maximum of the mean stress, and there
        ("local_radiated", "f8"),  # Z <V>, time, load and the fastest node
        ("local_time", "f8"),
        ("local_load", "f8"),
        ("local_node", "i8"),
        ("in_event", "i8"),  # whether an instability has begun there
        ("event_rate", "f8"),  # largest slip rate since then, m/s
        ("first_stress", "f8"),  # mean stress at the first instability; -inf before
        ("onset_stress", "f8"),  # that of the highest one; -inf before
        ("onset_time", "f8"),
        ("onset_load", "f8"),
        ("onset_node", "i8"),
        ("arrested", "i8"),  # instabilities that have stopped
        ("kinetic_stress", "f8"),  # mean stress when all that can break had broken; -inf before
        ("top_slip_rate", "f8"),  # largest slip rate, m/s, and where
        ("top_node", "i8"),
        ("slid", "i8"),  # nodes at the residual strength
        ("bad_node", "i8"),  # first node whose slip rate became non-finite; -1 if none
        ("past_step", "f8"),  # of the last implicit step; 0 before the first one
        ("radiated", "f8"),  # Z <V> after the last implicit step
        ("explicit_steps", "i8"),
        ("implicit_steps", "i8"),
        ("calm_steps", "i8"),  # in a row, and the largest slip rate when the row began, m/s
        ("calm_rate", "f8"),
        ("scale", "f8"),  # stress scale of the largest load so far
        ("start_load", "f8"),  # where the run began, and what that may cost
        ("start_error", "f8"),
        ("least", "f8"),  # smallest sum of stress and strength so far, and where
        ("least_node", "i8"),
    ]
)
"""Diagnostics of every step: one record, which compiled steps and checkpoints share."""

STATION = np.dtype([("slip", "f8"), ("slip_rate", "f8"), ("shear_stress", "f8")])
"""Slip (m), slip rate (m/s) and stress (Pa) of a node."""


class Record(NamedTuple):
    """What is kept of every step; with no rows, nothing."""

    steps: NDArray[Any]  # (steps,) array of DIAGNOSTICS
    stations: NDArray[Any]  # (steps, stations) array of STATION


class Thresholds(NamedTuple):
    """Thresholds at which steps change or end, from the method and the problem."""

    slid_stop: float  # nodes at the residual strength at which to return
    held: bool  # by nodes that never break: return only once the slip has come to rest, too
    event_stop: bool  # return at an event
    rest_stop: bool  # return when all is at rest after an event
    end_time: float  # s
    breakable: int  # nodes that can break at all
    calm_slip: float  # slip of calm steps over the rise of the load, m/Pa; see `explicit._calm`
    calm_count: int  # calm steps in a row after which implicit steps take over
    slip_step: float  # loss of strength of a node in one implicit step, in tau_p - tau_r
    load_step: float  # largest rise of the load in one implicit step, in stress scales
    smallest_step: float  # of implicit steps, s; below it explicit steps take over
    unstable_rate: float  # slip rate, m/s, that only an instability reaches
    arrival: float  # slip at which a front has arrived, in units of `Nodes.critical`
    curved: bool  # whether the law is other than linear, whose pieces are met to the bit
    explicit_only: bool


class Grid(NamedTuple):
    """Elastic half-spaces on a grid. Read-only, shared by threads."""

    transform: Transform
    impedance: float  # Z = G/(2 c_s), Pa s/m
    cell: float  # size of a node's cell: dx (m), on a plane dx dy (m²)
    stiffness: Array  # (2, modes): static stiffness K(k) and G|k|/2, Pa/m; zero for the mean
    entry: Ints  # (modes,): which entry of the tables a mode uses
    offset: Ints  # (modes,): where its real part is in packed arrays, see `memory`
    multiplicity: int  # modes that share an entry of the tables: 2 on a plane, kx and -kx
    frequency: Array  # |k| c_s of each entry, rad/s
    mode_two: Array  # share of mode II, (kx/k)²; 1 on a line, whatever its mode
    poles: Spectrum  # of the sums of exponentials: first those that weigh with `mode_two`,
    weights: Spectrum  # then, on a plane, those of mode III, which weigh with 1 - mode_two
    split: int  # how many of the pairs weigh with `mode_two`


class Nodes(NamedTuple):
    """Properties of the nodes that do not change in a run, each (nodes,)."""

    strength: Array  # tau_p, Pa; infinite where nothing breaks
    residual: Array  # tau_r, Pa
    weakening: Array  # W at zero slip, Pa/m
    critical: Array  # slip from which on a node counts as at its residual strength, m
    profile: Array  # p
    initial: Array  # tau_i, Pa


class Setting(NamedTuple):
    """Load and friction of an interface, and its stepping. Does not change in a run."""

    law: Any  # ``friction.parameters``
    nodes: Nodes
    mean_profile: float  # <p>
    mean_initial: float  # <tau_i>, Pa
    load: History  # tau_0(t)
    turning_times: Array  # when the load begins to fall or to rise again, s
    scale: History  # stress scale against the load, Pa
    thresholds: Thresholds
    stations: Ints  # nodes that `Record.stations` holds


class State(NamedTuple):
    """Variables of a run; two runs from equal states are the same run, bit by bit."""

    slip: Floats  # (nodes,), m; flat, also on a plane
    rate: Floats  # m/s
    stress: Floats  # Pa
    slip_hat: Spectrum  # (modes,) real transform of the slip
    past: Floats  # mean slip rate in the last implicit step, m/s
    memory: Floats  # as in `memory`: psi/B while explicit, psi while implicit
    memory_sum: Floats  # weighted sum of the memory variables for the next explicit step
    arrival: Floats  # when the front arrived, s; nan before
    diagnostics: NDArray[Any]  # (1,) array of DIAGNOSTICS
    phase: Floats  # 1 if explicit steps come next, else 0; size that the next implicit one tries, s

    @property
    def now(self) -> Any:
        """The record of `diagnostics`, by its names."""
        return self.diagnostics[0]

    @property
    def explicit(self) -> bool:
        """Whether explicit steps come next."""
        return bool(self.phase[0])

    @property
    def steps(self) -> int:
        """Steps taken so far, of both kinds."""
        return int(self.now["explicit_steps"] + self.now["implicit_steps"])


class ExplicitTables(NamedTuple):
    """Tables of one fixed explicit step h, with arrays to work in."""

    step: float  # h, s
    table: Array  # [block][pair][4][64]: E = exp(s |k| c_s h) and w E B, B = h phi(s |k| c_s h)
    response: Array  # (modes,): Re sum_p w B, weight of the current slip rate, s
    packed: Array
    rate_hat: Spectrum
    shared: Spectrum
    transfer: Array
    predicted: Array


class ImplicitTables(NamedTuple):
    """Tables of an implicit step of some size, with arrays to work in; belong to one run."""

    valid_for: Array  # size (s) and ratio of the last step that they are for; -1 if none
    table: Array  # this one to `ramp_response`: see `memory.tabulate`
    ramp: Array
    response: Array
    ramp_response: Array
    symbol: Array  # (modes,): eigenvalues of the matrix of a step, Pa/m
    inverse: Array
    memory_sum: Spectrum  # (modes,), as the next three
    past_hat: Spectrum
    rate_hat: Spectrum
    work: Spectrum
    trial_stress: Array  # (nodes,), as the rest up to `slipping`
    increment: Array
    driving: Array
    falling: Array
    residual: Array
    direction: Array
    product: Array
    other: Array
    slipping: Ints  # 0 stuck, 1 slipping
    packed: Array  # in packed order, as `others`
    others: Array
    sums: Array  # (2, 128)

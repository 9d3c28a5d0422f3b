"""The state of a rupture: constants of a run, variables, and diagnostics of every step.

A run takes steps of two kinds. Implicit steps of adaptive size follow an interface that
creeps (`implicit`), explicit steps of one size follow its waves (`explicit`);
`RuptureState.phase` says which kind comes next. Both solve, at every node,

    tau = tau_0 p + tau_i + f - Z V,   V = 0 or tau = strength(slip),   V >= 0.              (1)

tau_0 p is the load, tau_i the initial stress, Z = G/(2 c_s) the impedance and f the stress
that slip elsewhere transfers, mode by mode with the memory kernel C of
`elasticity.memory_kernels`:

    f(k, t) = -K(k) slip(k, t) + (G|k|/2) int_0^t C(|k| c_s t') V(k, t - t') dt'.            (2)

Fields of the interface and their transforms are flat, whatever its shape; `Grid.transform`
knows the shape. Modes q = 0, 1, ... are those of the real transform in its order, q = 0 the
mean.
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


class PiecewiseLinear(NamedTuple):
    """A piecewise linear function, continued beyond its last point with its last slope."""

    at: Floats  # times, s, or loads, Pa; rising
    values: Floats


@jit
def value_at(history: PiecewiseLinear, t: float) -> Any:
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


class Phase(IntEnum):
    """The kind of steps that comes next. It decides what `RuptureState.memory` holds."""

    IMPLICIT = 0  # psi, the memory variables themselves
    EXPLICIT = 1  # psi/B, the same divided by their response B to a unit slip rate


DIAGNOSTICS = np.dtype(
    [
        # The last step.
        ("time", "f8"),  # s
        ("size", "f8"),  # s
        ("load", "f8"),  # tau_0, Pa
        ("work", "f8"),  # of the load on the slip so far, J/m
        ("mean_slip", "f8"),  # m
        ("mean_stress", "f8"),  # of the nodes that can break, Pa, as all stresses here
        ("whole_stress", "f8"),  # mean stress of all nodes
        ("top_slip_rate", "f8"),  # largest slip rate, m/s, and where
        ("top_node", "i8"),
        ("weakened_nodes", "i8"),  # number of nodes at the residual strength
        ("non_finite_node", "i8"),  # after Reason.NOT_FINITE, the first whose slip rate is not
        # The last maximum of the mean stress of all nodes.
        ("maximum_stress", "f8"),
        ("maximum_breakable", "f8"),  # mean stress of the nodes that can break at that time
        ("maximum_radiated", "f8"),  # Z <V>
        ("maximum_time", "f8"),
        ("maximum_load", "f8"),
        ("maximum_node", "i8"),  # the fastest
        # Instabilities. Stresses, times and loads are NaN until they have happened.
        ("instabilities", "i8"),  # how many have begun
        ("in_event", "i8"),  # whether one has begun at the last maximum and has not ended
        ("event_slip_rate", "f8"),  # largest slip rate in it, m/s
        ("arrested_events", "i8"),
        ("first_stress", "f8"),  # mean stress at the first one
        ("onset_stress", "f8"),  # mean stress of all nodes at the highest one
        ("critical_stress", "f8"),  # largest mean stress at any, of the nodes that can break
        ("onset_time", "f8"),
        ("onset_load", "f8"),
        ("onset_node", "i8"),
        ("all_broken", "i8"),  # whether all that can break has been at its residual strength
        ("kinetic_stress", "f8"),  # mean stress when that happened
        # Choice of steps.
        ("phase", "i8"),  # a `Phase`
        ("next_size", "f8"),  # that the next implicit step tries, s
        ("two_step", "i8"),  # whether it knows the rate of an implicit step before it
        ("previous_size", "f8"),  # of the last implicit step, s
        ("previous_radiated", "f8"),  # Z <V> after it
        ("explicit_steps", "i8"),
        ("implicit_steps", "i8"),
        ("calm_steps", "i8"),  # in a row, and the largest slip rate when the row began, m/s
        ("calm_rate", "f8"),
        # The whole run so far.
        ("scale", "f8"),  # stress scale of the largest load
        ("start_load", "f8"),  # where the run began, and the error that this may cause
        ("start_error", "f8"),
        ("reverse_margin", "f8"),  # smallest sum of stress and strength, and where:
        ("reverse_node", "i8"),  # below zero, slip would reverse there
    ]
)
"""Diagnostics of every step: one record, which compiled steps and checkpoints share."""

STATION = np.dtype([("slip", "f8"), ("slip_rate", "f8"), ("shear_stress", "f8")])
"""Slip (m), slip rate (m/s) and stress (Pa) of a node."""


class StepRecord(NamedTuple):
    """Rows to keep every step in. Without rows, nothing is kept."""

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
    load: PiecewiseLinear  # tau_0(t)
    turning_times: Array  # when the load begins to fall or to rise again, s
    scale: PiecewiseLinear  # stress scale against the load, Pa
    thresholds: Thresholds
    stations: Ints  # nodes that `StepRecord.stations` holds


class RuptureState(NamedTuple):
    """Variables of a run; two runs from equal states are the same run, bit by bit."""

    slip: Floats  # (nodes,), m; flat, also on a plane
    rate: Floats  # m/s
    stress: Floats  # Pa
    slip_hat: Spectrum  # (modes,) real transform of the slip
    past: Floats  # mean slip rate in the last implicit step, m/s
    memory: Floats  # memory variables, packed as in `memory`; `Phase` says in which form
    memory_sum: Floats  # weighted sum of the memory variables for the next explicit step
    arrival: Floats  # when the front arrived, s; nan before
    diagnostics: NDArray[Any]  # (1,) array of DIAGNOSTICS

    @property
    def now(self) -> Any:
        """The record of `diagnostics`, by its names."""
        return self.diagnostics[0]

    @property
    def explicit(self) -> bool:
        """Whether explicit steps come next."""
        return bool(self.now["phase"] == Phase.EXPLICIT)

    @property
    def steps(self) -> int:
        """Number of steps taken so far, of both kinds."""
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

    valid_for: Array  # size (s) and ratio of the step that they are for; NaN before the first
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
    cg_residual: Array
    cg_direction: Array
    product: Array
    cg_preconditioned: Array
    slipping: Ints  # 0 stuck, 1 slipping
    packed: Array  # a Fourier array in packed order, as the next one
    second_packed: Array
    sums: Array  # (2, 128)

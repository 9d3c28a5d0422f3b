"""State of a rupture: constants of the run, variables, and diagnostics at every step.

A run takes two types of steps. Implicit steps with adaptive size follow
a creeping interface (`implicit`), and explicit steps with fixed size
follow its waves (`explicit`). The diagnostic `phase` states which type
comes next. Both solve, at every node,

    tau = tau_0 p + tau_i + f - Z V,   V = 0 or tau = strength(slip),   V >= 0.  (1)

tau_0 p is the load, tau_i the initial stress, Z = G/(2 c_s) the
impedance and f the stress that slip at other nodes transfers. It is
computed mode by mode with the memory kernel C from
`elasticity.memory_kernels`:

    f(k, t) = -K(k) slip(k, t) + (G|k|/2) int_0^t C(|k| c_s t') V(k, t - t') dt'.  (2)

Fields of the interface and their transforms are flat, also on planes.
`Grid.transform` knows the shape. Modes q = 0, 1, ... are in the order
of the real transform, and q = 0 is the mean.
"""

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit, jit_inside
from stiction.elasticity.operator import Transform
from stiction.problem.friction.kernels import line_at, strength_at

Ints = NDArray[np.int64]
Spectrum = NDArray[np.complex128]
Floats = NDArray[np.float64]


class PiecewiseLinear(NamedTuple):
    """Piecewise linear function, continued beyond its last point with its last slope."""

    at: Floats  # times, s, or loads, Pa; rising
    values: Floats


@jit
def value_at(history: PiecewiseLinear, t: float) -> Any:
    """Return the value of a piecewise linear function.

    >>> history = PiecewiseLinear(
    ...     np.array([0.0, 1.0, 3.0]), np.array([2.0, 5.0, 4.0])
    ... )
    >>> [value_at(history, t) for t in (-1.0, 0.5, 1.0, 2.0, 5.0)]
    [-1.0, 3.5, 5.0, 4.5, 3.0]
    """
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
    """Type of the next step, explicit or implicit.

    `RuptureState.memory` depends on the type.
    """

    IMPLICIT = 0  # psi, the memory variables themselves
    EXPLICIT = 1  # psi/B, divided by their response B to a unit slip rate


UNSTABLE_STRESS = 0.075
"""Z V that only an instability reaches, in units of the median of tau_p
- tau_r: at least 0.106 in those that were arrested, at most 0.054 in
the waves after them (4 problems, 5e6 and 5e7 Pa/s)."""

PULSE_SHARE = 0.1
"""Slip is fast if a node slips at the rate of an instability, and if
the mean slip rate is above this fraction of its maximum in the event.
Echoes in a period of two extents reach 0.06."""


def record(numbers: str, counts: str = "", **groups: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type of a record of groups, numbers, and counts or flags, by their names.

    >>> record("slip load", "node", step=record("time")).descr
    [('step', [('time', '<f8')]), ('slip', '<f8'), ('load', '<f8'), ('node', '<i8')]
    """
    fields = [(name, "f8") for name in numbers.split()]
    fields += [(name, "i8") for name in counts.split()]
    return np.dtype([*groups.items(), *fields])


STEP = record(
    "time size load work mean_slip mean_slip_rate mean_stress whole_stress strength_change"
    " top_slip_rate",
    "top_node weakened_nodes",
)
"""The last step. Values belong to its end.

- `time`, s
- `size` of the step, s
- `load`: tau_0, Pa
- `work` of the load on the slip so far, J/m
- `mean_slip`, m
- `mean_slip_rate`, m/s
- `mean_stress` of the nodes that can break, Pa, as all stresses here
- `whole_stress`: the mean stress with the stress that nodes beyond an
  extent took over
- `strength_change`: change of the mean strength by slip
- `top_slip_rate`: the largest slip rate, m/s
- `top_node`: the node with this rate
- `weakened_nodes`: number of nodes at the residual strength
"""

MAXIMUM = record("stress breakable radiated strength largest_fall time load work", "node")
"""The last maximum of `whole_stress`.

- `stress`
- `breakable`: mean stress of the nodes that can break at that time
- `radiated`: Z <V>
- `strength`: `strength_change`
- `largest_fall` of the mean stress since then, by waves
- `time`, s
- `load`
- `work`
- `node`: the fastest node
"""

EVENT = record(
    "slip_rate time load work peak_rate fast_since fast_until",
    "unstable last_arrested open begun calm node fast",
)
"""The present instability and the open event.

`Run` follows the open event until its fast slip has settled, or until
the next event begins.

- `unstable`: whether an instability is under way
- `slip_rate`: largest slip rate in it, m/s
- `last_arrested`: whether the last instability counts as arrested
- `open`: whether there is an open event
- `begun`: whether an event has just begun
- `calm`: whether the open event has just ended
- `time`, s, `load` and `work` when the open event began
- `node`: the fastest node as it began
- `peak_rate`: largest mean slip rate in it while slip was fast, m/s
- `fast`: whether slip was fast in it
- `fast_since`, `fast_until`: when slip was fast first and last, s; see
  step 6 of `diagnostics`
"""

RESULTS = record(
    "first_stress onset_stress critical_stress onset_time onset_load kinetic_stress",
    "instabilities arrested_events onset_node all_broken",
)
"""Results so far.

Stresses, times and loads have a meaning after the first instability.

- `instabilities`: number of instabilities
- `arrested_events`: number of instabilities that came to rest
- `first_stress`: mean stress at the first instability
- `onset_stress`: `whole_stress` at the highest instability
- `onset_time`, `onset_load`, `onset_node` of the highest instability
- `critical_stress`: largest mean stress of breakable nodes at an
  instability
- `all_broken`: whether all breakable nodes have reached their residual
  strength
- `kinetic_stress`: if so, the mean stress when that happened
"""

STEPPING = record(
    "next_size previous_size previous_radiated calm_slip_rate",
    "phase two_step explicit_steps implicit_steps calm_steps",
)
"""Choice of steps.

- `phase`: a `Phase`
- `explicit_steps`, `implicit_steps`: numbers of steps so far
- `next_size`: size that the next implicit step tries, s
- `two_step`: whether the next implicit step follows an implicit step
- `previous_size`: size of the last implicit step, s
- `previous_radiated`: Z <V> after the last implicit step
- `calm_steps`: calm steps in a row
- `calm_slip_rate`: largest slip rate when the row began, m/s
"""

RUN = record("scale start_load start_error reverse_margin", "reverse_node")
"""The whole run so far.

- `scale`: stress scale of the largest load
- `start_load`: load at the start
- `start_error`: error of the onset due to the start
- `reverse_margin`: smallest sum of stress and strength. If it is below
  zero, slip would reverse
- `reverse_node`: the node with this sum
"""

DIAGNOSTICS = record(
    "", step=STEP, maximum=MAXIMUM, event=EVENT, results=RESULTS, stepping=STEPPING, run=RUN
)
"""Diagnostics of a run, in a record that compiled steps and checkpoints
have in common."""

STATION = record("slip slip_rate shear_stress")
"""Slip (m), slip rate (m/s) and stress (Pa) of a node."""


def event_type(nodes: int) -> np.dtype[Any]:
    """Return the data type for the record of an event.

    Pairs are values before and after.

    >>> event = np.zeros((), event_type(3))
    >>> (
    ...     event["slip"].shape,
    ...     event["load"].shape,
    ...     event["work"].shape,
    ...     event["node"].dtype.kind,
    ... )
    ((2, 3), (2,), (2,), 'i')
    """
    return np.dtype(
        [
            ("time", "f8"),  # when it began, s
            ("node", "i8"),  # where it began
            ("settled", "i8"),  # 0 if the end of the run cut it short
            ("duration", "f8"),  # from the first to the last fast slip, s
            ("load", "f8", (2,)),  # tau_0, Pa
            ("work", "f8", (2,)),  # of the load on the slip so far, J/m
            ("slip", "f8", (2, nodes)),  # m
        ]
    )


class StepRecord(NamedTuple):
    """Rows that keep every step. Without rows, no step is kept."""

    steps: NDArray[Any]  # (steps,) array of STEP
    stations: NDArray[Any]  # (steps, stations) array of STATION


class Thresholds(NamedTuple):
    """Thresholds at which steps change or end, from the method and the problem."""

    slid_stop: bool  # return once all nodes that can break are at the residual strength
    held: bool  # whether unbreakable nodes hold the interface; return after slip came to rest
    event_stop: bool  # return at an event
    rest_stop: bool  # return when all is at rest after an event
    end_time: float  # s
    breakable: int  # number of nodes that can break
    period_nodes: int  # nodes of a period of two extents, to which means in `diagnostics` refer
    calm_slip: float  # slip of a calm step per rise of the load, m/Pa; see `explicit._calm`
    calm_count: int  # calm steps in a row after which implicit steps take over
    settling_time: float  # time after the last fast slip at which an event has ended, s
    slip_step: float  # weakening of a node in an implicit step, in units of tau_p - tau_r
    load_step: float  # largest rise of the load in a step, in units of the stress scale
    smallest_step: float  # of implicit steps, s; below it explicit steps take over
    unstable_slip_rate: float  # slip rate, m/s, that only an instability reaches
    front_share: float  # slip at which a front arrives, as a fraction of `Nodes.residual_slip`
    curved: bool  # whether the law is not linear; a linear law's pieces are met to the bit
    explicit_only: bool


class Grid(NamedTuple):
    """Read-only elastic half-spaces on a grid, shared by threads."""

    transform: Transform
    impedance: float  # Z = G/(2 c_s), Pa s/m
    cell: float  # size of a node's cell: dx (m), on a plane dx dy (m²)
    stiffness: Array  # (2, modes): static stiffness K(k) and G|k|/2, Pa/m; zero for the mean
    entry: Ints  # (modes,): entry of the tables that a mode uses
    offset: Ints  # (modes,): place of its real part in packed arrays, see `memory`
    multiplicity: int  # modes with the same entry of the tables: 2 on a plane, kx and -kx
    frequency: Array  # |k| c_s of each entry, rad/s
    mode_two: Array  # fraction of mode II, (kx/k)²; 1 on a line of either mode
    poles: Spectrum  # of the sums of exponentials: first the pairs that weigh with `mode_two`,
    weights: Spectrum  # then, on a plane, the pairs of mode III, which weigh with 1 - mode_two
    split: int  # number of pairs that weigh with `mode_two`


class Nodes(NamedTuple):
    """Properties of the nodes that do not change in a run. Each has shape (nodes,)."""

    peak: Array  # tau_p, Pa; infinite beyond the extent of the interface
    residual: Array  # tau_r, Pa
    weakening_rate: Array  # W at zero slip, Pa/m
    residual_slip: Array  # slip from which a node counts as being at its residual strength, m
    profile: Array  # p
    initial: Array  # tau_i, Pa


class Setting(NamedTuple):
    """Elasticity, load, friction and stepping for an interface, which do not change in a run."""

    grid: Grid
    law: Any  # ``friction.parameters``
    nodes: Nodes
    mean_profile: float  # <p>
    mean_initial: float  # <tau_i>, Pa
    load: PiecewiseLinear  # tau_0(t)
    turning_times: Array  # times at which the load begins to fall or to rise again, s
    scale: PiecewiseLinear  # stress scale as a function of the load, Pa
    thresholds: Thresholds
    stations: Ints  # nodes that `StepRecord.stations` holds


@jit_inside
def node_strength(setting: Setting, i: int, slip: float) -> Any:
    """Return the strength of node i after some slip (m), Pa.

    In these arrays the nodes have different strengths. (The examples run the
    kernels without compilation.)

    >>> from types import SimpleNamespace
    >>> from stiction.problem.friction.parameters import Linear
    >>> peak, residual, rate = np.array([[5.0, 7.0], [1.0, 2.0], [2.0, 3.0]])
    >>> nodes = SimpleNamespace(peak=peak, residual=residual, weakening_rate=rate)
    >>> setting = SimpleNamespace(law=Linear(), nodes=nodes)
    >>> [node_strength.py_func(setting, i, 1.5) for i in (0, 1)]
    [2.0, 2.5]
    """
    nodes, W = setting.nodes, setting.nodes.weakening_rate[i]
    return strength_at(setting.law, nodes.peak[i], nodes.residual[i], W, slip)


@jit_inside
def node_line(setting: Setting, i: int, slip: float, ahead: float) -> Any:
    """Return the straight line of strength of node i, as `friction.kernels.line_at` does.

    >>> from types import SimpleNamespace
    >>> from stiction.problem.friction.parameters import Linear
    >>> peak, residual, rate = np.array([[5.0, 7.0], [1.0, 2.0], [2.0, 3.0]])
    >>> nodes = SimpleNamespace(peak=peak, residual=residual, weakening_rate=rate)
    >>> setting = SimpleNamespace(law=Linear(), nodes=nodes)
    >>> [node_line.py_func(setting, 1, 1.5, ahead) for ahead in (0.1, 0.5)]
    [(2.5, 3.0), (2.0, 0.0)]
    """
    nodes, W = setting.nodes, setting.nodes.weakening_rate[i]
    return line_at(setting.law, nodes.peak[i], nodes.residual[i], W, slip, ahead)


class RuptureState(NamedTuple):
    """Variables of a run. Runs from equal states are equal to the bit."""

    slip: Floats  # (nodes,), m; flat, also on a plane
    slip_rate: Floats  # m/s
    stress: Floats  # Pa
    slip_hat: Spectrum  # (modes,) real transform of the slip
    past: Floats  # mean slip rate in the last implicit step, m/s
    memory: Floats  # memory variables, packed as in `memory`, in the form of `Phase`
    memory_sum: Floats  # weighted sum of the memory variables for the next explicit step
    arrival: Floats  # arrival time of the front, s; NaN before
    maximum_slip: Floats  # slip at the last maximum of the mean stress, m
    event_slip: Floats  # slip at the maximum at which the open event began, m
    diagnostics: NDArray[Any]  # (1,) array of DIAGNOSTICS

    @property
    def now(self) -> Any:
        """Diagnostics, by group and name."""
        return self.diagnostics[0]

    @property
    def explicit(self) -> bool:
        """Whether explicit steps come next.

        >>> state = RuptureState(*[np.zeros(0)] * 10, np.zeros(1, DIAGNOSTICS))
        >>> state.explicit
        False
        >>> state.now["stepping"]["phase"] = Phase.EXPLICIT
        >>> state.explicit
        True
        """
        return bool(self.now["stepping"]["phase"] == Phase.EXPLICIT)

    @property
    def steps(self) -> int:
        """Number of steps so far, explicit and implicit.

        >>> state = RuptureState(*[np.zeros(0)] * 10, np.zeros(1, DIAGNOSTICS))
        >>> (
        ...     state.now["stepping"]["explicit_steps"],
        ...     state.now["stepping"]["implicit_steps"],
        ... ) = 5, 2
        >>> state.steps
        7
        """
        stepping = self.now["stepping"]
        return int(stepping["explicit_steps"] + stepping["implicit_steps"])


class ExplicitTables(NamedTuple):
    """Tables for explicit steps h, with work arrays."""

    step: float  # h, s
    table: Array  # [block][pair][4][64]: E = exp(s |k| c_s h) and w E B, B = h phi(s |k| c_s h)
    response: Array  # (modes,): Re sum_p w B, weight of the current slip rate, s
    packed: Array
    slip_rate_hat: Spectrum
    shared: Spectrum
    transfer: Array  # (nodes,), like the rest
    predicted: Array  # slip rate at the end of the step, if the rate before acts all along
    strength: Array  # after the step
    increments: Array  # of slip, by the mean of the rates before and after the step


class SlipProblem(NamedTuple):
    """Problem (1) of `complementarity` for the slip in a step, with its solution and work arrays.

    Arrays have the shape (nodes,), and `symbol`, `inverse` and `work`
    (modes,).
    """

    transform: Transform
    symbol: Array  # eigenvalues of M, Pa/m
    inverse: Array  # 1/symbol
    work: Spectrum
    trial: Array  # g, stress without slip, Pa
    driving: Array  # g - b on the present straight lines of strength, Pa
    falling: Array  # w, their slopes, Pa/m
    increment: Array  # u, m
    slipping: Ints  # S: 0 stuck, 1 slipping
    product: Array
    cg_residual: Array  # r, p and z of conjugate gradients
    cg_direction: Array
    cg_preconditioned: Array


class ImplicitTables(NamedTuple):
    """Tables for implicit steps of a given size, with the work arrays of a run."""

    filled: Ints  # (1,): whether the tables hold the values of a step
    valid_for: Array  # size (s) and ratio of this step
    table: Array  # from here to `ramp_response`, see `memory.tabulate`
    ramp: Array
    response: Array
    ramp_response: Array
    memory_sum: Spectrum  # (modes,), like the next three
    past_hat: Spectrum
    slip_rate_hat: Spectrum
    slope_hat: Spectrum  # of the slip rate in the step
    transfer: Array  # (nodes,)
    strength: Array  # (nodes,): after the step
    packed: Array  # a Fourier array in packed order, like `second_packed`
    second_packed: Array
    sums: Array  # (2, 128)
    problem: SlipProblem

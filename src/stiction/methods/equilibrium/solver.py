"""Onsets of samples from exact equilibrium, on lines, specimens and planes.

Problem
-------
The load (Pa) rises slowly from zero. K is the stiffness (Pa/m), d >= 0
the slip (m), s(d) the strength minus the initial stress (Pa), which
falls with slip, and p the load profile. Slip d is an equilibrium at a load if

    load p - K d <= s(d),  with '=' where d > 0.                     (1)

Follow the least equilibrium, which an interface without inertia takes,
from rest to the load at which (1) has no solution: there the whole
interface slides. Slip never decreases. The first instability is the
load at which the path of equilibria first turns and a patch jumps.

Algorithm for a sample
----------------------
The algorithm is our own (`follow_to_sliding`). An `EquilibriumSearch`
supplies the two searches:

1. Start from rest and raise the load to the next instability
   (`EquilibriumSearch.next`).
2. If the path ends without an instability, the interface slides stably:
   stop.
3. Let the unstable patch jump at constant load
   (`EquilibriumSearch.jump`). If no equilibrium stops it, the interface
   slides: stop.
4. If the patch comes to rest, this is an arrested event. Go to step 1
   from the new equilibrium.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy, warn_of_samples
from stiction.methods.equilibrium.dense.search import DenseSearch
from stiction.methods.equilibrium.events import ArrestedEvent, event_table, event_variables
from stiction.methods.equilibrium.patches import Mask, critical_patch, patches_of
from stiction.methods.equilibrium.state import (
    EquilibriumSearch,
    EquilibriumState,
    Outcome,
    PathStatus,
    multiplier_of,
)
from stiction.methods.equilibrium.strength import (
    Pieces,
    StaticSample,
    all_breakable_slip,
    make_sample,
    present_pieces,
    residual_nodes,
    row_of,
)
from stiction.methods.equilibrium.transforms.plane import PlaneSearch
from stiction.problem.checks import warn_if_coarse
from stiction.problem.friction.parameters import Linear, Polygon
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample
from stiction.problem.specimen import Slider

MIN_NODES = 8.0
"""Fewest nodes in a nucleation length without a warning, which gives
the expected error."""
ERRORS_OF_COARSE_GRIDS = {  # by the number of dimensions
    1: "single onsets are off by 0.4 % at 9 nodes and 3 % at 4 if the correlation length is a"
    " quarter of the nucleation length, and by 3 and 9 % if it is a tenth",
    2: "single onsets are off by 0.15 % at 9 nodes along x and 6 along y, and by 0.5 % at 6 and 4",
}
MIN_PEAK_HEIGHT = 0.02
"""A peak that is hardly higher than the stress of sliding gets a
warning. This is its smallest height above the mean residual strength,
as a fraction of the strength drop."""
OF_INSTABILITY = {
    "first_instability", "critical_position", "critical_patch_length", "critical_patch_extent",
    "critical_patch_area",
}  # fmt: skip
"""Variables that are NaN without an instability."""
STRENGTH_STEP = 1e-7
"""Rise of a node's strength in a difference quotient, as a fraction of
the mean strength."""


class SamplePath(NamedTuple):
    """The course of a sample until it slides.

    `first` is the first instability, and `last` is the last
    equilibrium. `known` is false if a jump or a path was not followed
    to its end. The load of `last` is then a lower bound. `peak` is the
    largest mean stress on the way, divided by the mean of the load
    profile (Pa). With inertia, `arrival` is the time at which the front
    of the last event reached each node (s). If the interface ends,
    `last` is the last instability, and `sliding` is its event, if the
    event was followed to its end.
    """

    first: EquilibriumState
    last: EquilibriumState
    peak: float
    events: list[ArrestedEvent]
    known: bool
    arrival: Array | None
    sliding: ArrestedEvent | None = None

    @property
    def all_events(self) -> list[ArrestedEvent]:
        """All arrested events.

        If the interface ends, also the event in which it slides.

        >>> path = SamplePath(None, None, 1.0, ["a", "b"], True, None)
        >>> path.all_events
        ['a', 'b']
        >>> path._replace(sliding="c").all_events
        ['a', 'b', 'c']
        """
        return self.events + ([] if self.sliding is None else [self.sliding])


def follow_to_sliding(
    search: EquilibriumSearch, sample: StaticSample, to_rest: bool = False
) -> SamplePath:
    """Follow a sample from rest to global sliding.

    Without inertia, a patch stops at the least equilibrium at the same
    load. Inertia may carry it further. An interface that ends slides as
    soon as every node that can break slips. Pass `to_rest` to follow
    this last event until it stops.

    Lists replace the search. A patch jumps at 3 Pa and comes to rest, and the
    next instability, at 5 Pa, slides. The stress was largest before 3 Pa:

    >>> from types import SimpleNamespace
    >>> from stiction.methods.equilibrium.state import Jump
    >>> from stiction.methods.equilibrium.strength import LINEAR
    >>> some, every = np.array([0.0, 2.0, 0.0]), np.array([1.0, 2.0, 0.0])
    >>> def state(load, status=PathStatus.UNSTABLE, slip=some, peak=None):
    ...     return EquilibriumState(load, slip, slip, status=status, peak=peak)
    >>> def follow(strength, states, outcomes, slip=some, to_rest=False):
    ...     sample = make_sample(np.array(strength), *np.ones((3, 3)), LINEAR)
    ...     states, outcomes, asked = iter(states), iter(outcomes), []
    ...     def jump(sample, before, to_rest):
    ...         asked.append(to_rest)
    ...         return Jump(next(outcomes), state(before.load, slip=slip), "time")
    ...     search = SimpleNamespace(next=lambda *_: next(states), jump=jump)
    ...     path = follow_to_sliding(search, sample, to_rest)
    ...     print(path.first.load, path.last.load, path.peak, len(path.events))
    ...     print(path.known, path.arrival or "-", path.sliding is not None, asked)
    >>> ends, circle, (slides, arrested) = [3, 3, np.inf], [3, 3, 3], list(Outcome)[:2]
    >>> follow(circle, [state(3.0, peak=7.0), state(5.0)], [arrested, slides], some, True)
    3.0 5.0 7.0 1
    True time False [False, False]

    An instability that was not one does not count, and a jump may not be
    followed to its end. A path may slide stably, or be given up:

    >>> outcomes = [Outcome.NOT_UNSTABLE, Outcome.UNDECIDED]
    >>> follow(circle, [state(3.0), state(4.0)], outcomes)
    4.0 4.0 4.0 0
    False time False [False, False]
    >>> follow(circle, [state(3.0, PathStatus.STABLE)], [])
    3.0 3.0 3.0 0
    True - False []
    >>> follow(circle, [state(3.0), state(6.0, PathStatus.GIVEN_UP)], [arrested])
    3.0 6.0 6.0 1
    False - False [False]

    If an interface ends, it slides in the event in which every node slips, or
    else in the last event:

    >>> follow(ends, [state(3.0), state(4.0)], [arrested], every, True)
    3.0 3.0 3.0 0
    True time True [True]
    >>> stable = state(6.0, PathStatus.STABLE)
    >>> follow(ends, [state(3.0), state(4.0), stable], [arrested, arrested])
    3.0 4.0 6.0 1
    True - True [False, False]
    >>> follow(ends, [state(3.0), state(6.0, PathStatus.GIVEN_UP)], [arrested])
    3.0 6.0 6.0 1
    False - False [False]
    """
    ends, sliding = not np.isfinite(sample.excess).all(), None
    first: EquilibriumState | None = None
    events: list[ArrestedEvent] = []
    outcome, arrival = Outcome.NOT_UNSTABLE, None
    # 1.
    state = search.next(sample)
    peak = state.highest
    while state.status == PathStatus.UNSTABLE:  # 2.
        # 3. Without ends there is no difference between sliding and all slip.
        jump = search.jump(sample, state, to_rest and ends)
        outcome = jump.outcome
        if outcome != Outcome.NOT_UNSTABLE:
            first = first or state
        slides = outcome in (Outcome.SLIDING, Outcome.UNDECIDED)
        if outcome == Outcome.ARRESTED:  # 4.
            events.append(ArrestedEvent(state, jump.state, jump.known))
            slides = all_breakable_slip(sample, jump.state.slip)
        if slides:
            arrival = jump.arrival
            break
        state = search.next(sample, jump.state)
        peak = max(peak, state.highest)
    known = outcome != Outcome.UNDECIDED and state.status != PathStatus.GIVEN_UP
    if ends and known and events and outcome != Outcome.SLIDING:
        # The last instability, after which the other nodes creep at most.
        sliding = events.pop()
        state = sliding.before
    return SamplePath(first or state, state, peak, events, known, arrival, sliding)


def refused(problem: Problem) -> list[str]:
    """Return the reasons why the law of a problem cannot be followed, or an empty list.

    >>> from types import SimpleNamespace
    >>> import stiction as st
    >>> laws = [
    ...     st.LinearWeakening(4.0), st.ExponentialWeakening(4.0),
    ...     st.PiecewiseWeakening(4.0, slip=[0.3, 1.0], strength=[0.4, 0.0]),
    ... ]
    >>> for specimen in (None, Slider.__new__(Slider)):
    ...     problems = (SimpleNamespace(friction=law, specimen=specimen) for law in laws)
    ...     print([[reason[10:26] for reason in refused(problem)] for problem in problems])
    [[], ['ExponentialWeake'], []]
    [[], ['ExponentialWeake'], ['the strength of ']]
    """
    law = problem.friction
    if not isinstance(law.parameters, Linear | Polygon):
        return [
            f"friction: {type(law).__name__} is curved, but equilibria are followed along straight"
            " pieces. Use st.PiecewiseWeakening.from_law(friction, pieces=32) or, between"
            " half-spaces, st.Rupture(...)"
        ]
    if isinstance(problem.specimen, Slider) and not law.linear:
        return [
            "friction: the strength of a slider falls linearly with slip. Use"
            " st.LinearWeakening(weakening_rate=...)"
        ]
    return []


def sample_of(rows: Sample, pieces: Pieces, row: int | slice = slice(None)) -> StaticSample:
    """Return one sample or all samples of a batch, in the form that kernels need.

    Two samples of a plane with 2 x 3 nodes, flattened:

    >>> from types import SimpleNamespace
    >>> from stiction.methods.equilibrium.strength import LINEAR
    >>> nodes = np.arange(6.0).reshape(2, 3)
    >>> rows = SimpleNamespace(
    ...     initial_stress=np.stack([nodes, 2 * nodes]), load_profile=nodes + 1.0,
    ...     strength=np.stack([nodes + 9.0, nodes + 20.0]),
    ...     residual_strength=np.stack([nodes, nodes]),
    ...     weakening_rate=np.stack([nodes + 1.0, nodes + 2.0]),
    ... )
    >>> sample = sample_of(rows, LINEAR, 1)
    >>> sample.excess.tolist()
    [20.0, 19.0, 18.0, 17.0, 16.0, 15.0]
    >>> sample.residual.tolist()
    [0.0, -1.0, -2.0, -3.0, -4.0, -5.0]
    >>> sample.weakening_rate.tolist()
    [2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    >>> sample.profile.tolist()
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    >>> sample_of(rows, LINEAR).excess.shape
    (2, 6)
    """
    initial = rows.initial_stress[row]
    shape = (*initial.shape[: initial.ndim - rows.load_profile.ndim], -1)
    excess = (rows.strength[row] - initial).reshape(shape)
    residual = (rows.residual_strength[row] - initial).reshape(shape)
    # Copy the rate: numba would compile each kernel again for a
    # read-only array, as laws return.
    weakening_rate = rows.weakening_rate[row].reshape(shape).copy()
    return make_sample(excess, residual, rows.load_profile.flatten(), weakening_rate, pieces)


def make_search(problem: Problem, gap: float = 1e-6) -> EquilibriumSearch:
    """Return the programme that finds equilibria for a problem, or raise an `InputError`.

    >>> import stiction as st
    >>> solid, law = st.Solid(3e9, 0.35, 1180.0), st.LinearWeakening(1e9)
    >>> for interface in (st.Interface(0.8, 16), st.Interface((0.8, 0.8), (16, 16))):
    ...     print(type(make_search(st.Problem(solid, interface, law))).__name__)
    DenseSearch
    PlaneSearch
    """
    if reasons := refused(problem):
        raise InputError(reasons)
    return PlaneSearch(problem, gap) if problem.interface.is_plane else DenseSearch(problem)


def warn_of_signs(problem: Problem) -> None:
    """Warn if the signs of K do not prove that the equilibria found are the least."""
    if problem.specimen is not None and problem.blocks.positive:
        warn_accuracy(
            "the stiffness of these blocks has positive entries off its diagonal, up to"
            f" {problem.blocks.positive:.1g} of the diagonal. Then there is no proof that the"
            " equilibria are the least and the bounds rigorous (docs/guide/specimens.md)"
        )


class OnsetSolver:
    """Thread-safe solver for samples by `Equilibrium` with given options."""

    inertia = False

    def __init__(self, problem: Problem, options: Any, search: EquilibriumSearch) -> None:
        self.problem, self.options, self.search = problem, options, search

    def __call__(self, rows: Sample) -> dict[str, NDArray[Any]]:
        """Return the variables of `Equilibrium`.

        The first dimension of each is the sample.
        """
        warn_of_signs(self.problem)
        errors = ERRORS_OF_COARSE_GRIDS[len(self.problem.interface.shape)]
        warn_if_coarse(self.problem, rows.steepest_weakening_rate, MIN_NODES, errors)
        # One after the other, so that the result of a sample depends on
        # this sample alone.
        samples, table, flags = sample_of(rows, self.search.pieces), [], []
        for row in range(rows.samples):
            sample = row_of(samples, row)
            try:
                path = follow_to_sliding(self.search, sample, self.options.events > 0)
            except Exception as error:  # say which sample failed
                error.add_note(
                    f"in sample {row} of the {rows.samples} that were solved together"
                )
                raise
            flags.append((path.known, path.first.certified, path.first.stopped))
            table.append(self._values(rows, row, sample, path))
        values = {name: np.array([row[name] for row in table]) for name in table[0]}
        # Loads become mean stresses: add the initial stress, multiply
        # by the mean profile.
        values["critical_stress"] = rows.mean_stress(values["critical_stress"])
        values["first_instability"] = rows.mean_stress(values["first_instability"])
        values["certificate_gap"] *= rows.mean(rows.load_profile)
        self._warn(rows, values, np.array(flags))
        return values

    def _values(
        self, rows: Sample, row: int, sample: StaticSample, path: SamplePath
    ) -> dict[str, Any]:
        """Return the variables of one sample.

        Stresses are divided by the load profile.

        Node 2 jumps first, and node 5 slides later:

        >>> from types import SimpleNamespace
        >>> from stiction.methods.equilibrium.strength import LINEAR
        >>> from stiction.problem.interface import Interface
        >>> problem = SimpleNamespace(
        ...     interface=Interface(0.8, 8, ends="free"), specimen=None,
        ...     relief=lambda slip: 2.0 * float(slip.mean()),
        ... )
        >>> rows = SimpleNamespace(strength=[None, np.ones(8)])
        >>> options = SimpleNamespace(slip=True, sensitivity=False, events=0)
        >>> sample = make_sample(np.full(8, 3.0), *np.ones((3, 8)), LINEAR)
        >>> slip, direction = np.array([0, 0.4, 0.8, 0, 0, 0, 0, 0]), np.eye(8)
        >>> first = EquilibriumState(3.0, slip, direction[2], gap=0.25)
        >>> last = EquilibriumState(5.0, slip + direction[5] * 2, direction[5])
        >>> path = SamplePath(first, last, 4.5, [], True, None)
        >>> solver = OnsetSolver(problem, options, None)
        >>> values = solver._values(rows, 1, sample, path)
        >>> for name in sorted(values.keys() - {"slip"}):
        ...     print(name, np.round(float(values[name]), 6))
        arrested_events 0.0
        certificate_gap 0.25
        critical_load 5.0
        critical_patch_length 0.1
        critical_position 0.25
        critical_stress 4.5
        first_instability 2.7
        residual_reached 1.0
        sliding_position 0.55
        slip_patches 1.0
        >>> values["slip"].tolist() == slip.tolist()
        True

        If the last state does not move, the first patch slides:

        >>> still = EquilibriumState(5.0, slip, 0.0 * slip)
        >>> values = solver._values(rows, 1, sample, path._replace(last=still))
        >>> round(values["sliding_position"], 6)
        0.25

        Without an instability, the values of the instability are NaN, and if
        the interface ends between half-spaces, the values of sliding as well:

        >>> stable = EquilibriumState(3.0, slip, direction[2], status=PathStatus.STABLE, gap=1.0)
        >>> path = SamplePath(stable, stable, 4.5, [], True, None)
        >>> extent = Interface(0.8, 8, extent=(0.1, 0.5))
        >>> for problem.interface in (problem.interface, extent):
        ...     values = solver._values(rows, 1, sample, path)
        ...     print(*(name for name in sorted(values) if np.isnan(np.sum(values[name]))))
        critical_patch_length critical_position first_instability
        critical_load critical_patch_length critical_position critical_stress first_instability
        >>> problem.specimen = "blocks"
        >>> values = solver._values(rows, 1, sample, path)
        >>> round(values["critical_load"], 6)
        3.0
        """
        interface, shape = self.problem.interface, rows.strength[row].shape
        first, last = path.first, path.last
        sliding_patch = patch = critical_patch(multiplier_of(sample, first), interface)
        # After an arrested event another patch
        # may let go of the whole interface.
        if last is not first and last.direction.any():
            sliding_patch = critical_patch(last.direction, interface)
        values: dict[str, Any] = {
            "critical_load": last.load,
            "critical_stress": self._peak(path),
            "first_instability": first.load - self.problem.relief(first.slip),
            "certificate_gap": np.nan if first.gap is None else first.gap,
            "critical_position": patch.centre if interface.is_plane else patch.centre[0],
            "sliding_position": (
                sliding_patch.centre if interface.is_plane else sliding_patch.centre[0]
            ),
            "slip_patches": patches_of(first.slip, interface),
            "arrested_events": len(path.events),
            "residual_reached": bool(residual_nodes(sample, last.slip).any()),
        }
        if interface.is_plane:
            values["critical_patch_extent"] = patch.extents
            values["critical_patch_area"] = patch.area
            values["certified"] = first.certified
        else:
            values["critical_patch_length"] = patch.area
        # If the machine is stiff, or within a short
        # extent, an interface can slide without any
        # instability. Then there is no critical patch.
        stable = first.status == PathStatus.STABLE
        if stable:
            names = OF_INSTABILITY & values.keys()
            if interface.is_held and self.problem.specimen is None:
                # As in a rupture, which knows the onset of an instability only.
                names |= {"critical_load", "critical_stress"}
            values |= {name: np.full_like(values[name], np.nan) for name in names}
        if self.options.slip:
            values["slip"] = first.slip.reshape(shape)
        if self.options.sensitivity:
            derivative = np.full(first.slip.size, np.nan)
            if not stable:
                derivative = _sensitivity(self.problem, self.search, sample, first)
            values["sensitivity"] = derivative.reshape(shape) * rows.mean(rows.load_profile)
        if most := self.options.events:
            variables = event_variables(interface, self.inertia)
            values |= event_table(self.problem, rows, row, path.all_events, variables, most)
        return values

    def _peak(self, path: SamplePath) -> float:
        """Return the largest mean stress on the way, divided by the mean load profile, Pa.

        If the interface ends, only stresses at instabilities count.

        The stresses are 3 - 2 and 4 - 2 Pa at the instabilities if the interface ends:

        >>> from types import SimpleNamespace
        >>> interface = SimpleNamespace(is_held=False)
        >>> problem = SimpleNamespace(interface=interface, relief=lambda slip: slip.sum())
        >>> states = [EquilibriumState(load, np.array([d]), None) for load, d in ((5, 1), (6, 3))]
        >>> events = [ArrestedEvent(states[0], states[1])]
        >>> path = SamplePath(states[0], states[1], 7.0, events, True, None)
        >>> solver = OnsetSolver(problem, None, None)
        >>> solver._peak(path)
        7.0
        >>> interface.is_held = True
        >>> int(solver._peak(path))
        4
        >>> int(solver._peak(path._replace(events=[])))
        3
        """
        if not self.problem.interface.is_held:
            return path.peak
        states = [event.before for event in path.events] + [path.last]
        return max(state.load - self.problem.relief(state.slip) for state in states)

    def _warn(self, rows: Sample, values: dict[str, Array], flags: Mask) -> None:
        """Warn about exceptional samples.

        `values` holds all samples, with stresses in Pa.
        """
        known, certified, stopped = flags.T
        first, unproved = values["first_instability"], ~certified
        # Gaps are compared with the load. A stress of zero must not
        # divide them.
        share = values["certificate_gap"] / np.maximum(np.abs(first), 1e-300)
        warn_of_samples(
            f"the bounds of the first instability did not close to within {self.search.widest_gap}"
            " of the load in {samples}. The bounds hold, but are up to {worst:.2g} of the load"
            " apart. Use more nodes",
            ~unproved & ~(share <= self.search.widest_gap),
            share,
        )
        if self.problem.interface.is_plane:
            warn_of_samples(
                "nodes reach a corner of the law or their residual strength before the first"
                " instability in {samples}. This instability was found by following equilibria, to"
                " within {worst:.2g} of the load, and has no certificate",
                unproved & np.isfinite(first),
                share,
            )
        # Only machines and ends hold an interface in which all nodes slip.
        cause = "machine is so stiff" if self.problem.has_machine else "extent is so small"
        warn_of_samples(
            f"no patch becomes unstable in {{samples}}: the {cause} that the interface slides"
            " stably. Values of an instability are NaN",
            np.isnan(first),
        )
        warn_of_samples(
            "a jump was not followed to its end in {samples}: the critical load is the last load"
            " with a known equilibrium, a lower bound",
            ~known,
        )
        warn_of_samples(
            "a slipping node stops before the first instability in {samples}. From then on, the"
            " computed equilibrium need not be the least, so the first instability has no upper"
            " bound, and certificate_gap is NaN",
            stopped & np.isfinite(first),
        )
        # Compare the peak with the stress of sliding, on the scale of
        # the strength drop.
        residual = rows.mean(rows.residual_strength)
        falls = (rows.strength - rows.residual_strength).reshape(rows.samples, -1)
        falls = falls[:, np.isfinite(falls[0])]
        above = values["critical_stress"] - residual
        above /= np.maximum(np.median(falls, axis=1), 1e-300)
        warn_of_samples(
            "all but the last nodes are at their residual strength before the peak in {samples}:"
            " static friction then equals the mean residual strength to within {worst:.2g} of the"
            " strength drop, and depends on little else",
            values["residual_reached"] & (above < MIN_PEAK_HEIGHT),
            above,
        )
        if self.options.sensitivity:
            unknown = np.isnan(values["sensitivity"]).reshape(rows.samples, -1).any(axis=1)
            warn_of_samples(
                "sensitivity is NaN in {samples}, because nodes pass a corner beyond which their"
                " law falls more steeply",
                np.isfinite(first) & unknown,
            )


def _sensitivity(
    problem: Problem, search: Any, sample: StaticSample, state: EquilibriumState
) -> Array:
    """Return the derivative (n,) of an instability's stress with respect to peak strengths.

    `search` is a `DenseSearch`, because planes have no sensitivity.

    The derivative is NaN if a law steepens and a node passed a corner
    before the instability.

    Node 1 is on the second piece, whose strength at zero slip is 0.75 tau_p + 0.25 tau_r:

    >>> from types import SimpleNamespace
    >>> pieces = Pieces(
    ...     np.array([0.25, 1.0]), np.array([1.0, 0.75, 0.0]), np.array([1.0, 0.5, 0.0]), 1.0, 0.4
    ... )
    >>> rows = np.array([[3.0] * 3, [1.0, 1.0, 3.0], [1.0] * 3, [2.0] * 3])
    >>> sample = make_sample(*rows, pieces)
    >>> state = EquilibriumState(2.0, np.array([0.1, 0.5, 0.0]), np.zeros(3))
    >>> search = SimpleNamespace(gradient=lambda sample, state: np.array([0.2, 0.4, 0.6]))
    >>> _sensitivity(None, search, sample, state).round(6).tolist()
    [0.2, 0.3, 0.6]
    >>> steep = sample._replace(pieces=pieces._replace(slopes=np.array([0.5, 1.0, 0.0])))
    >>> _sensitivity(None, search, steep, state).round(6).tolist()
    [0.2, 0.3, 0.6]
    >>> state.certified = False
    >>> _sensitivity(None, search, steep, state).tolist()
    [nan, nan, nan]
    """
    pieces = sample.pieces
    if state.stopped:
        return _quotients(problem, search, sample, state)
    if pieces.steepens and not state.certified:
        return np.full(state.slip.size, np.nan)
    # The search's derivative is by the present piece continued to zero
    # slip, f tau_p + (1 - f) tau_r with f = `share`. The chain rule
    # gives the derivative by tau_p.
    share = pieces.starts[present_pieces(sample, state.slip).piece]
    gradient: Array = search.gradient(sample, state)
    return gradient * np.where(sample.critical > 0.0, share, 1.0)


def _quotients(
    problem: Problem, search: EquilibriumSearch, sample: StaticSample, first: EquilibriumState
) -> Array:
    """Return derivatives of a first instability as difference quotients, from one path per node.

    Between events paths are straight, so a
    small step gives the exact derivative.

    The load of the instability is 3 s_0 + 5 s_1 + 7 r_0 + 8 r_1 with the
    residual strengths r, and its slip relieves 2 s_1. The strength of node 0
    is constant, so that r_0 rises with s_0:

    >>> from types import SimpleNamespace
    >>> from stiction.methods.equilibrium.strength import LINEAR
    >>> rows = np.array([[4.0, 6.0, np.inf], [4.0, 1.0, 0.0], [1, 1, 1], [2, 2, 2]])
    >>> sample = make_sample(*rows, LINEAR)
    >>> def instability(sample):
    ...     load = float(sample.excess[:2] @ [3.0, 5.0] + sample.residual[:2] @ [7.0, 8.0])
    ...     return EquilibriumState(load, sample.excess[1:2], np.zeros(3))
    >>> search = SimpleNamespace(next=instability)
    >>> problem = SimpleNamespace(relief=lambda slip: 2.0 * slip[0])
    >>> _quotients(problem, search, sample, instability(sample)).round(4).tolist()
    [10.0, 3.0, 0.0]
    """
    stress_before = first.load - problem.relief(first.slip)
    # At nodes that cannot break, the derivative is zero.
    can_break = np.isfinite(sample.excess)
    step = STRENGTH_STEP * float(np.abs(sample.excess[can_break]).mean())
    derivative = np.zeros(sample.excess.size)
    for node in np.flatnonzero(can_break):
        excess, residual = sample.excess.copy(), sample.residual.copy()
        excess[node] += step
        residual[node] += step * (sample.critical[node] == 0.0)  # its strength is constant
        W = sample.weakening_rate
        raised = make_sample(excess, residual, sample.profile, W, sample.pieces)
        state = search.next(raised)
        derivative[node] = (state.load - problem.relief(state.slip) - stress_before) / step
    return derivative

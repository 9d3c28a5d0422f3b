"""Choose the algorithm for equilibria of a line or a specimen, with dense factors.

1. If no node reaches a corner in its law before the next
   instability, the instability follows from a linear programme
   for the present pieces of the friction law
   (`linear_program`). If very many nodes of a line slip,
   transforms are used (`plane_onset`), because they are faster.
2. Otherwise the path is followed event by event (`stable_path`). On
   this path the programme is not tried again, except from rest. A state
   says in `route` how the path goes on.
3. With a machine, the path is always followed: slip lowers the force,
   and the force may be largest before the instability. If all nodes
   slip without an instability, the interface slides stably.
4. If only part of a line or specimen can break, the other nodes have an
   infinite strength. They hold the part that can break. K is positive
   definite on this part, so each instability ends at an equilibrium.
   The interface slides if all nodes that can break slip in this
   equilibrium.
5. After an instability of a line, a quick test for sliding comes first
   (`runaway`). If the test is undecided, and always on specimens, the
   jump is followed to its end (`jump`).
"""

import threading
from dataclasses import replace

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.line import line_of
from stiction.elasticity.protocol import NONE, Elasticity
from stiction.elasticity.stiffness import apply_circular
from stiction.elasticity.weakest import window_bound
from stiction.methods.equilibrium.dense.cholesky import SlipState, Workspace, make_workspace
from stiction.methods.equilibrium.dense.jump import jump
from stiction.methods.equilibrium.dense.linear_program import (
    SHARE_TOWARDS_BOUND,
    certificate,
    solve_program,
)
from stiction.methods.equilibrium.dense.runaway import Runs, runs_away, runs_of
from stiction.methods.equilibrium.dense.stable_path import follow_stable_path
from stiction.methods.equilibrium.patches import count_patches
from stiction.methods.equilibrium.state import (
    EquilibriumState,
    Jump,
    Outcome,
    PathStatus,
    Route,
    at_rest,
    multiplier_of,
)
from stiction.methods.equilibrium.strength import (
    StaticSample,
    exceeds,
    pieces_of,
    present_pieces,
    step_to_corner,
)
from stiction.methods.equilibrium.transforms.bracket import TooSmallError
from stiction.methods.equilibrium.transforms.plane import plane_onset
from stiction.problem.problem import Problem

MAX_WEAK_NODES = 1500
"""Number of nodes weaker than the upper bound of the load above which
transforms are faster."""
TRANSFORMS_GAP_RTOL = 3e-10
"""Relative distance of the bounds by transforms, below `widest_gap`."""
WIDEST_GAP_IF_NODES_STOP = 1e-4
"""`widest_gap` if nodes may stop, since positive entries of K leave the
bounds so far apart."""
WEAKENING_RATE_RTOL = 1e-12
"""Relative distance of weakening rates that differ by round-off."""
RESTING_MULTIPLIER_RTOL = 1e-9
"""Fraction of the largest multiplier below which it is zero, as at
nodes at rest."""


class DenseSearch:
    """Thread-safe search for equilibria of a line or a specimen.

    The first instability of a line is the solution of (1) in
    `linear_program`, which `linprog` finds from the matrix:

    >>> import stiction as st
    >>> from scipy.optimize import linprog
    >>> from stiction.methods.equilibrium.solver import sample_of
    >>> solid, line, i = st.Solid(3e9, 0.35, 1180.0), st.Interface(0.4, 32), np.arange(32)
    >>> strength = 1e6 * (3.0 + np.sin(0.9 * i) + 0.5 * np.cos(1.7 * i))
    >>> problem = st.Problem(solid, line, st.LinearWeakening(1e11))
    >>> dense = DenseSearch(problem)
    >>> sample = sample_of(problem.sample(strength), dense.pieces, 0)
    >>> onset = dense.next(sample)
    >>> A = dense.elastic.block(i) - np.diag(sample.weakening_rate)
    >>> limits = np.column_stack((np.ones(32), -A / 1e11))
    >>> exact = -linprog(-np.eye(33)[0], limits, strength / 1e6).fun * 1e6
    >>> round(onset.load / exact, 9)
    1.0
    >>> onset.certified
    True
    >>> bool(onset.gap < 1e-9 * onset.load)
    True
    >>> dense.jump(sample, onset).outcome.name
    'SLIDING'
    >>> below = dense.at(sample, at_rest(sample), 0.97 * exact)
    >>> over = below.load - below.Kd - strength + sample.weakening_rate * below.slip
    >>> bool(over.max() < 1.0)
    True
    >>> bool(np.abs(over[below.slip > 0]).max() < 1.0)
    True
    """

    widest_gap = 1e-9
    """Certificate gap, as a fraction of the load, above which there is
    a warning."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.pieces = pieces_of(problem.friction)
        self.nodes = problem.interface.size
        self.ends = problem.interface.is_held
        self.elastic: Elasticity
        self.runs: Runs | None = None  # what the test for sliding needs, where it applies
        if problem.specimen is not None:
            self.elastic = problem.blocks
        else:
            self.elastic = line_of(problem.half_spaces, self.nodes)
            # If several parts can break, a run of nodes may stop at the
            # end of its part.
            if count_patches(1.0 * problem.interface.breakable) == 1:
                self.runs = runs_of(problem.half_spaces, self.nodes)
        self.driven = self.elastic.relief > 0.0
        self.may_stop = self.elastic.positive > 0.0  # slip may unload a node that slips
        self._of_thread = threading.local()
        if self.may_stop:
            self.widest_gap = max(self.widest_gap, WIDEST_GAP_IF_NODES_STOP)

    @property
    def _workspaces(self) -> tuple[Workspace, Workspace]:
        """Workspaces of the thread, for elastic steps (and programmes) and for true pieces."""
        # All threads use the same search, but kernels overwrite the workspaces.
        if not hasattr(self._of_thread, "workspaces"):
            elements = (self.elastic.entries, self.nodes)
            self._of_thread.workspaces = make_workspace(*elements), make_workspace(*elements)
        return self._of_thread.workspaces

    def bound(self, sample: StaticSample) -> tuple[float, Array]:
        """Return the bound from the weakest window of a sample (Pa), and its multiplier."""
        low, high = _range_of_weakening_rates(sample)
        windows = self.elastic.windows(low, high) if high > 0.0 else NONE
        allowed, multiplier = np.empty((2, self.nodes))
        excess, profile, W = sample.excess, sample.profile, sample.weakening_rate
        return window_bound(excess, profile, W, windows, allowed, multiplier), multiplier

    def solve(
        self, sample: StaticSample, cap: float = np.inf, state: EquilibriumState | None = None
    ) -> EquilibriumState | None:
        """Return the critical load (at most `cap`) with its proofs, or `None` if the search stalls.

        Only the first piece of the friction law is
        used: `excess` and `weakening_rate`. `state`
        is a known equilibrium at a lower load.
        """
        bound, multiplier = self.bound(sample)
        if bound == cap == np.inf:  # no window fits within the extent
            return None
        # Dense factors cost the cube of the slipping nodes, transforms
        # little more than all nodes.
        if cap == np.inf and self.nodes > MAX_WEAK_NODES:
            weak_nodes = np.count_nonzero(sample.excess < bound * sample.profile)
            if weak_nodes > MAX_WEAK_NODES:
                solution = self._by_transforms(sample, state)
                if solution is not None:
                    return solution
        # Start from a known equilibrium, or from a load at which not
        # too many nodes join.
        slip, Kd = np.zeros((2, self.nodes))
        start = top = min(bound, cap)
        low, high = _range_of_weakening_rates(sample)
        if state is not None:
            start, slip = state.load, state.slip.copy()
        elif low < high:  # the bound is not close: at too high a load far too many nodes join
            first_slip = min(top, float((sample.excess / sample.profile).min()))
            start = (1.0 - SHARE_TOWARDS_BOUND) * first_slip + SHARE_TOWARDS_BOUND * top
        slip_state = SlipState(sample, slip, Kd, self._workspaces[0], self.may_stop)
        load, solved = solve_program(slip_state, start, bound, cap, multiplier)
        if not solved:
            return None
        return EquilibriumState(load, slip, multiplier, Kd, multiplier=multiplier)

    def _by_transforms(
        self, sample: StaticSample, state: EquilibriumState | None
    ) -> EquilibriumState | None:
        """Solve a programme in which many nodes slip.

        Return `None` if its bounds stay apart.
        """
        half_spaces = self.elastic.half_spaces
        if half_spaces is None:
            return None
        try:
            onset = plane_onset(
                half_spaces, sample.excess, sample.profile, sample.weakening_rate,
                TRANSFORMS_GAP_RTOL, None if state is None else state.slip,
            )  # fmt: skip
        except TooSmallError:
            return None
        if not onset.closed(TRANSFORMS_GAP_RTOL):
            return None
        # The multiplier was lifted everywhere to be feasible. At nodes
        # at rest it must be zero.
        multiplier = onset.multiplier - onset.multiplier.min()
        multiplier[multiplier < RESTING_MULTIPLIER_RTOL * multiplier.max()] = 0.0
        multiplier /= multiplier @ sample.profile
        symbol = half_spaces.symbol((self.nodes,))
        Kd = np.fft.irfft(symbol * np.fft.rfft(onset.slip), self.nodes)
        return EquilibriumState(onset.lower, onset.slip, multiplier, Kd, multiplier=multiplier)

    def next(
        self, sample: StaticSample, state: EquilibriumState | None = None, cap: float = np.inf
    ) -> EquilibriumState:
        """Return the next instability from a state or from rest, or the state at a lower load.

        See steps 1 to 3 at the top of the file.
        """
        state = state or at_rest(sample)
        from_rest = not state.slip.any()
        # If a machine drives the blocks, the stress may be largest before the instability.
        route = Route.EVENTS if self.driven else state.route
        if from_rest:
            for workspace in self._workspaces:
                workspace.n_factored[0] = 0  # the rows belong to another sample
        if cap == np.inf and route != Route.EVENTS:
            instability = self._next_by_programme(sample, state, from_rest)
            if instability is not None:
                return instability
            if not from_rest:  # a corner is near, so the programme would fail again
                route = Route.EVENTS
        # The kernel moves these arrays, and the state before must stay.
        slip, Kd, direction = state.slip.copy(), state.Kd.copy(), state.direction.copy()
        # Between given loads, a path goes on although the interface slides.
        goes_on = self.ends and cap < np.inf
        slip_state = SlipState(sample, slip, Kd, self._workspaces[1], self.may_stop, goes_on)
        end = follow_stable_path(slip_state, state.load, cap, direction)
        reached = EquilibriumState(
            end.load, slip, direction, Kd, PathStatus(end.status), route,
            stopped=end.stopped or state.stopped, peak=end.peak,
        )  # fmt: skip
        # No multiplier bounds the load from above if a law steepens or
        # a node stopped.
        is_unstable = reached.status == PathStatus.UNSTABLE
        reached.certified = is_unstable and not (self.pieces.steepens or reached.stopped)
        if reached.certified and from_rest:
            present = present_sample(sample, slip)
            self._certify(present, reached, multiplier_of(sample, reached))
        return reached

    def _next_by_programme(
        self, sample: StaticSample, state: EquilibriumState, from_rest: bool
    ) -> EquilibriumState | None:
        """Return the next instability by a linear programme, or `None` if a corner comes first."""
        present = self._first_piece(sample) if from_rest else present_sample(sample, state.slip)
        solution = self.solve(present, state=None if from_rest else state)
        if solution is None or not (from_rest or solution.load >= state.load):
            return None
        # The programme holds only if no node passes the corner at the
        # end of its piece.
        piece = None if from_rest else present_pieces(sample, state.slip).piece
        if exceeds(sample, solution.slip, piece):
            return None
        solution.K_direction = self._certify(present, solution, solution.direction)
        return solution

    def _first_piece(self, sample: StaticSample) -> StaticSample:
        """Return the linear sample of the first piece, which is flat if the law has a plateau.

        >>> from types import SimpleNamespace
        >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
        >>> rows = np.array([[3.0, 2], [1.0, 1], [1, 1], [2.0, 2]])
        >>> plateau = np.array([0.0, 1.0, 0.0])
        >>> ends, starts = np.array([0.2, 1.0]), np.array([1.0, 1.25, 0.0])
        >>> for pieces in (LINEAR, LINEAR._replace(ends=ends, starts=starts, slopes=plateau)):
        ...     search = SimpleNamespace(pieces=pieces, nodes=2)
        ...     first = DenseSearch._first_piece(search, make_sample(*rows, pieces))
        ...     print(first.weakening_rate)
        [2. 2.]
        [0. 0.]
        """
        if self.pieces.slopes[0] > 0.0:
            return sample
        return present_sample(sample, np.zeros(self.nodes))

    def _certify(
        self, present: StaticSample, instability: EquilibriumState, multiplier: Array
    ) -> Array:
        """Write the gap of an instability, and return K times the multiplier."""
        Ky, slip, Kd = np.empty(self.nodes), instability.slip, instability.Kd
        instability.gap = certificate(present, slip, Kd, multiplier, self._workspaces[0], Ky)
        return Ky

    def at(
        self, sample: StaticSample, state: EquilibriumState, load: float
    ) -> EquilibriumState | None:
        """Return the equilibrium at a load above a state, or `None` if it is not found.

        From rest, a programme that ends at the load comes first, unless a node
        passes a corner:

        >>> from types import SimpleNamespace
        >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
        >>> sample = make_sample(*np.array([[1.0, 2], [0.0, 0], [1, 1], [2.0, 2]]), LINEAR)
        >>> def state(slip, status=PathStatus.STABLE, **more):
        ...     slip = np.array([slip, 0.0])
        ...     return EquilibriumState(1.0, slip, 0.0 * slip, status=status, **more)
        >>> search = SimpleNamespace(
        ...     driven=False, _first_piece=lambda sample: sample,
        ...     solve=lambda sample, cap: state(by_programme),
        ...     next=lambda sample, start, cap: state(0.3, status, route=start.route),
        ... )
        >>> status, by_programme, start = PathStatus.STABLE, 0.2, state(0.0)
        >>> def at(start, load=3.0):
        ...     found = DenseSearch.at(search, sample, start, load)
        ...     return found and (found.load, float(found.slip[0]), found.route.name)
        >>> at(start)
        (3.0, 0.2, 'PROGRAMME_FROM_REST')
        >>> at(start, 1.0)
        (1.0, 0.0, 'PROGRAMME_FROM_REST')
        >>> at(state(0.0, route=Route.PROGRAMME))
        (1.0, 0.3, 'EVENTS')
        >>> by_programme = 0.6  # beyond the corner at 0.5 m
        >>> at(start)
        (1.0, 0.3, 'EVENTS')
        >>> status = PathStatus.UNSTABLE
        >>> at(start) is None
        True
        """
        if load <= state.load:
            return state
        # From rest, a programme that ends at
        # the load is faster than the events.
        if state.route == Route.PROGRAMME_FROM_REST and not self.driven:
            solution = self.solve(self._first_piece(sample), load)
            if solution is not None and not exceeds(sample, solution.slip):
                status = PathStatus.STABLE
                return replace(solution, load=load, direction=state.direction, status=status)
        reached = self.next(sample, replace(state, route=Route.EVENTS), load)
        return reached if reached.status == PathStatus.STABLE else None

    def jump(
        self, sample: StaticSample, instability: EquilibriumState, to_rest: bool = False
    ) -> Jump:
        slip, Kd = instability.slip.copy(), instability.Kd.copy()
        outcome, unstoppable = self._test_sliding(sample, instability, slip, to_rest)
        if outcome == Outcome.UNDECIDED:
            elastic, true_pieces = self._workspaces
            slip_state = SlipState(sample, slip, Kd, elastic, self.may_stop, to_rest)
            outcome = jump(slip_state, instability.load, unstoppable, true_pieces)
        # Strength that falls linearly cannot stop an instability.
        if outcome == Outcome.ARRESTED:
            before = present_pieces(sample, instability.slip).piece
            after = present_pieces(sample, slip).piece
            if not np.any(after > before):  # round-off
                outcome = Outcome.UNDECIDED
        state = EquilibriumState(
            instability.load, slip, instability.direction, Kd, PathStatus.STABLE,
            max(instability.route, Route.PROGRAMME), stopped=instability.stopped,
        )  # fmt: skip
        return Jump(Outcome(outcome), state)

    def _test_sliding(
        self, sample: StaticSample, instability: EquilibriumState, slip: Array, to_rest: bool
    ) -> tuple[int, float]:
        """Test for sliding (step 5).

        Return the outcome and an unstoppable length.

        The length is a number of residual nodes. Slip moves to a lower
        bound of the next equilibrium.
        """
        direction = instability.direction
        if self.runs is None or to_rest:
            # Only whether a corner is on the way is known.
            step = step_to_corner(sample, slip, direction, np.inf)
            return (Outcome.SLIDING if step == np.inf else Outcome.UNDECIDED), np.inf
        K_direction = instability.K_direction
        if K_direction is None:
            nodes, K_direction = np.flatnonzero(direction), np.empty(self.nodes)
            apply_circular(
                self.elastic.entries, nodes, nodes.size, direction[nodes],
                np.empty((2, self.nodes // 2)), K_direction,
            )  # fmt: skip
        return runs_away(
            sample, self.runs, instability.load, slip, instability.Kd, direction,
            K_direction,
        )  # fmt: skip

    def gradient(self, sample: StaticSample, state: EquilibriumState) -> Array:
        """Return the multiplier y.

        If slip lowers the mean stress, return its derivative.

        With a relief of r (Pa/m) the mean stress is D - r <p, d>/n at a
        drive D, and y is the derivative of the largest D by the
        strengths s. Up to the instability, (K - W) d = D p - s on the
        slipping nodes, and no node has stopped. Therefore d grows with
        D at the rate d' = (K - W)^-1 p, the derivative of <p, d> by s
        is -d', and the mean stress has the derivative

            y - (r/n) (<p, d'> y - d').

        If the interface ends, the mean stress of the n nodes that can
        break, divided by the mean of p there, is D - <c, d>, with c = K
        1/(n <p>) and 1 on these nodes. The derivative is then

            y - <c, d'> y + (K - W)^-1 c.

        Node 0 slips with K - W = 4 - 1.5 Pa/m, so d' = (0.4, 0). A machine has
        r = 5 Pa/m and n = 2. If the interface ends, c is (0.3, 0.2):

        >>> from types import SimpleNamespace
        >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
        >>> sample = make_sample(*np.array([[1.0, 2], [0.0, 0], [1, 3], [1.5, 2]]), LINEAR)
        >>> state = EquilibriumState(1.0, np.array([0.1, 0.0]), np.array([1.0, 2.0]))
        >>> K = np.array([[4.0, -1.0], [-1.0, 4.0]])
        >>> elastic = SimpleNamespace(relief=5.0, block=lambda nodes: K[np.ix_(nodes, nodes)])
        >>> search = SimpleNamespace(driven=False, ends=False, elastic=elastic)
        >>> DenseSearch.gradient(search, sample, state).round(6).tolist()  # y = z/<p, z>
        [0.142857, 0.285714]
        >>> search.driven = True
        >>> y, rate = np.array([1.0, 2.0]) / 7.0, np.array([0.4, 0.0])
        >>> expected = y - 2.5 * (0.4 * y - rate)
        >>> bool(np.allclose(DenseSearch.gradient(search, sample, state), expected))
        True
        >>> search.problem = SimpleNamespace(relief_of_nodes=np.array([0.3, 0.2]))
        >>> search.ends = True
        >>> expected = (1.0 - 0.3 * 0.4) * y + [0.3 / 2.5, 0.0]
        >>> bool(np.allclose(DenseSearch.gradient(search, sample, state), expected))
        True
        """
        y = multiplier_of(sample, state)
        if not (self.driven or self.ends):
            return y
        W = present_pieces(sample, state.slip).weakening_rate
        slips, p = np.flatnonzero(state.slip > 0.0), sample.profile
        block = self.elastic.block(slips) - np.diag(W[slips])
        slip_rate = np.zeros(y.size)  # d'
        slip_rate[slips] = np.linalg.solve(block, p[slips])
        if not self.ends:
            return y - self.elastic.relief / y.size * ((p @ slip_rate) * y - slip_rate)
        c = self.problem.relief_of_nodes
        derivative = (1.0 - c @ slip_rate) * y
        derivative[slips] += np.linalg.solve(block, c[slips])
        return derivative

    def stress_released(self, state: EquilibriumState) -> Array:
        return state.Kd


def present_sample(sample: StaticSample, slip: Array) -> StaticSample:
    """Return, for `solve`, the linear sample with the pieces on which nodes are after a slip.

    `excess` and `weakening_rate` belong to these pieces, continued to
    zero slip. The law has no further effect.

    Node 0 is residual, with 1 Pa, and node 1 has not slipped:

    >>> from stiction.methods.equilibrium.strength import LINEAR, make_sample
    >>> rows = np.array([[3.0, 2], [1.0, 0.5], [1, 1], [2.0, 4]])
    >>> present = present_sample(make_sample(*rows, LINEAR), np.array([1.5, 0.0]))
    >>> present.excess.tolist()
    [1.0, 2.0]
    >>> present.weakening_rate.tolist()
    [0.0, 4.0]
    >>> present.residual.tolist()
    [1.0, 0.5]
    """
    present = present_pieces(sample, slip)
    return sample._replace(excess=present.strength, weakening_rate=present.weakening_rate)


def _range_of_weakening_rates(sample: StaticSample) -> tuple[float, float]:
    """Return the lowest and the highest non-zero weakening rate, or zeros if all rates are zero.

    Rates that differ only by round-off are returned as equal.

    >>> from types import SimpleNamespace
    >>> for W in ([0.0, 3.0, 2.0, 5.0], [0.0, 3.0, 3.0 + 1e-12], [0.0, 0.0]):
    ...     print(_range_of_weakening_rates(SimpleNamespace(weakening_rate=np.array(W))))
    (2.0, 5.0)
    (3.0, 3.0)
    (0.0, 0.0)
    """
    weakening_rates = sample.weakening_rate[sample.weakening_rate > 0.0]
    if weakening_rates.size == 0:
        return 0.0, 0.0
    low, high = float(weakening_rates.min()), float(weakening_rates.max())
    return low, (high if low < high * (1.0 - WEAKENING_RATE_RTOL) else low)

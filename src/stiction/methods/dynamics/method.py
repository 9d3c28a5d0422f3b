"""The method `Rupture`, with inertia: its options, its solver, and the thresholds of a run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import pydantic
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, PlainSerializer

from stiction.base.errors import InputError
from stiction.base.model import Count, Flag, Listed, Number, Positive, Real, model
from stiction.base.units import as_numbers
from stiction.base.variables import Variable
from stiction.methods.dynamics import checks, specimens
from stiction.methods.dynamics.diagnostics import stress_scale
from stiction.methods.dynamics.integrator import Run
from stiction.methods.dynamics.medium import Medium, prepare_medium
from stiction.methods.dynamics.slow_start import first_instability, slow_start, static_search
from stiction.methods.dynamics.state import (
    UNSTABLE_STRESS,
    Ints,
    Nodes,
    PiecewiseLinear,
    RuptureState,
    Setting,
    Thresholds,
)
from stiction.methods.dynamics.summary import arrested_events, scalars, summary
from stiction.methods.equilibrium.events import event_table, event_variables, of_samples
from stiction.problem.problem import Problem, refusals
from stiction.problem.results import onset_variables
from stiction.problem.sample import Sample

ShareUpToOne = Annotated[Real, Field(gt=0, le=1)]

SLIP_STEP = 0.02  # largest slip of a weakening node in an implicit step, in units of its d_c
NO_STATIONS = np.empty(0, dtype=np.int64)
LOAD_STEP = 1e-3  # largest rise of the load in an implicit step, in units of the stress scale
_EXPLICIT_STEPS_IN_IMPLICIT = 6.0  # size of the smallest implicit step
_MIN_CALM_STEPS = 300
_SETTLING_CROSSINGS = 1.0  # times shear waves cross the part that can break after fast slip

_UNKNOWN_AT_ONSET = (
    "kinetic_stress", "stress_drop", "seismic_moment", "radiated_energy", "fracture_energy",
    "arrested_events", "rupture_speed", "median_rupture_speed",
)  # fmt: skip


def _load_history(load: Any) -> PiecewiseLinear | None:
    """Return the load history for samples (times, values) in s and Pa, or raise an `InputError`.

    >>> history = _load_history(([0, 1, 3], [0, 2e6, 1e6]))
    >>> history.at.tolist(), history.values.tolist(), _load_history(None) is None
    ([0.0, 1.0, 3.0], [0.0, 2000000.0, 1000000.0], True)
    >>> _load_history(([0, 1, 1], [0, 2e6, 1e6]))
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: times must begin at 0 s and increase
    """
    if load is None:
        return None
    try:
        times, values = (as_numbers(part) for part in load)
    except (TypeError, ValueError):
        raise InputError("must be two arrays of numbers, (times, values)") from None
    finite = np.isfinite(times).all() and np.isfinite(values).all()
    if times.ndim != 1 or times.shape != values.shape or times.size < 2 or not finite:
        raise InputError("needs two arrays of finite numbers, of equal length (2 or more)")
    if times[0] != 0.0 or np.any(np.diff(times) <= 0.0):
        raise InputError("times must begin at 0 s and increase")
    return PiecewiseLinear(times, values)


def _written(load: PiecewiseLinear | None) -> Any:
    return None if load is None else [array.tolist() for array in load]


LoadHistory = Annotated[Any, BeforeValidator(_load_history), PlainSerializer(_written), "tuple"]


@model(kw_only=True)
class Rupture(Listed):
    """Onset from an elastodynamic simulation under a slowly rising load.

    Implicit steps follow creep, and explicit steps follow ruptures. A
    patch whose initial stress exceeds its strength breaks at once.

    Parameters
    ----------
    loading_rate : float, optional
        d tau_0/dt, Pa/s. Between half-spaces, give this or `load_history`.
    end_time : float, optional
        Latest end of a run, s. A warning counts the events that are cut short.
    load_history : (times, values), optional
        tau_0(t), Pa, from t = 0 s, interpolated linearly. The last slope
        continues.
    kernel_tolerance : float
        Largest error (1) of the memory kernel.
    courant : float
        Explicit time step in units of the stability limit, in (0, 1].
    implicit : bool
        If false, take explicit steps only, a million for slow loading.
    arrival : float
        Fraction of tau_p - tau_r that a node has lost when the front
        arrives: 0.5 for the middle of the cohesive zone, 1e-3 for its tip.
    start : {"equilibrium", "rest"}
        Start of a run: at an equilibrium just below the first instability,
        known to within `start_error` (Pa), or at first slip.
    stop : {"sliding", "onset", "rest", "time"}
        End of a run. "sliding": every node that can break is at its
        residual strength and, with an extent, at rest. "onset": the
        first instability has begun. "rest": after an instability, slip
        has ended or follows the load. "time": `end_time`.
    max_steps : int
        Number of steps after which a run, or an event on a specimen, is
        abandoned.
    events : int
        Number of events to return for each sample, over 'event', padded
        with NaN, with the variables of `equilibrium_path` and more.

    Raises
    ------
    InputError
        If an option is outside the range.

    Notes
    -----
    Specimens are loaded slowly. Waves run during events, and only
    `courant`, `arrival`, `max_steps` and `events` have an effect.

    Values of events that did not happen are NaN, with a warning.
    `rupture_speed` is the largest apparent speed and can exceed all wave
    speeds. Use `median_rupture_speed` as the speed of a rupture.
    Energies and `seismic_moment` are values at the run's end. See
    docs/guide/ruptures.md for the definitions of instabilities, events and
    their ends, and for the error by fast loading. A node never slips
    backwards (Breitenfeld and Geubelle, 1998).
    """

    loading_rate: Positive | None = None
    end_time: Positive | None = None
    load_history: LoadHistory = None
    kernel_tolerance: Positive = 1e-6
    courant: ShareUpToOne = 0.9
    implicit: Flag = True
    arrival: ShareUpToOne = 0.5
    start: Literal["equilibrium", "rest"] = "equilibrium"
    stop: Literal["sliding", "onset", "rest", "time"] = "sliding"
    max_steps: Count = 5_000_000
    events: Number = 0
    type: Literal["rupture"] = "rupture"
    # Profiles that `Problem.sample` refuses for other methods.
    accepts: ClassVar[tuple[str, ...]] = ("overstress",)
    label = "rupture"
    _shown = ()
    counted_only: ClassVar[bool] = True

    @pydantic.model_validator(mode="after")
    def _consistent(self) -> Rupture:
        problems = []
        if self.loading_rate is not None and self.load_history is not None:
            problems.append("loading_rate: give either loading_rate or load_history, got both")
        if self.stop == "time" and self.end_time is None:
            problems.append("end_time: is needed in s with stop='time', got None")
        if problems:
            raise InputError(problems)
        return self

    def seconds_per_sample(self, problem: Problem) -> float:
        """Return the approximate time for a sample on a core, s.

        >>> from types import SimpleNamespace
        >>> def seconds(shape, drive=None, **options):
        ...     interface = SimpleNamespace(shape=shape, size=int(np.prod(shape)))
        ...     specimen = drive and SimpleNamespace(drive=SimpleNamespace(type=drive))
        ...     problem = SimpleNamespace(interface=interface, specimen=specimen)
        ...     return round(Rupture(**options).seconds_per_sample(problem), 9)
        >>> seconds((2048,)), seconds((2048,), start="rest"), seconds((128, 256))
        (0.208, 0.408, 6.0)
        >>> seconds((256,), drive="platen"), seconds((256,), drive="pusher")
        (0.08, 1.2)
        """
        shape = problem.interface.shape
        if problem.specimen is not None:
            drive = problem.specimen.drive
            return (0.02 if drive.type == "platen" else 0.3) * (shape[0] / 128) ** 2
        if len(shape) == 1:
            usual = 0.1 if self.start == "rest" else 0.05
            return 8e-3 + usual * (shape[0] / 1024) ** 2
        # The number of steps grows with the nodes of the longer side,
        # the time of a step with all nodes.
        return 1.5 * (max(shape) / 128) * (problem.interface.size / 128**2)

    def supports(self, problem: Problem) -> list[str]:
        """Return the reasons why the method cannot solve a problem, or an empty list."""
        if problem.specimen is not None:
            return specimens.refusals(self, problem)
        reasons = []
        if self.loading_rate is None and self.load_history is None:
            reasons = ["loading_rate: give either loading_rate or load_history, got neither"]
        return reasons

    def bounded_by_strength(self, problem: Problem, event: str) -> tuple[bool, bool]:
        """Return whether strength bounds the stress of an event from below and from above.

        A rupture begins at a maximum of the mean stress, which is not
        below the stress of the first slip, unless the interface ends:
        then slip lowers the mean stress of the part that can break.
        Specimens are in equilibrium up to each event.

        >>> from types import SimpleNamespace
        >>> cases = [
        ...     (True, None, False),
        ...     (False, None, False),
        ...     (False, 1, False),
        ...     (False, 1, True),
        ... ]
        >>> for held, specimen, machine in cases:
        ...     problem = SimpleNamespace(specimen=specimen, has_machine=machine)
        ...     problem.interface = SimpleNamespace(is_held=held)
        ...     events = "first_instability", "critical_stress"
        ...     print(
        ...         *(Rupture().bounded_by_strength(problem, event) for event in events)
        ...     )
        (False, False) (False, False)
        (True, False) (True, False)
        (True, True) (True, True)
        (False, False) (True, True)
        """
        if problem.interface.is_held:
            return False, False
        if problem.specimen is None:
            return True, False
        certain = not (problem.has_machine and event == "first_instability")
        return certain, certain

    def variables(self, problem: Problem) -> dict[str, Variable]:
        """Return the variables in the solver's results."""
        if problem.specimen is not None:
            return specimens.variables(self, problem)
        variables = onset_variables(problem.interface) | scalars(problem.interface)
        if self.events:
            variables |= of_samples(event_variables(problem.interface, inertia=True))
        return variables

    def medium(self, problem: Problem) -> Medium:
        """Return the memory kernel and tables for a problem between half-spaces."""
        return prepare_medium(problem, self.kernel_tolerance, self.courant)

    def prepare(self, problem: Problem) -> Callable[[Sample], dict[str, NDArray[Any]]]:
        """Return a solver for the samples of a problem.

        The memory kernel is fitted once.
        """
        if problem.specimen is not None:
            return specimens.RuptureSolver(problem, self.events, self.search(problem))
        medium, loading_rate = self.medium(problem), self.loading_rate
        from_rest = self.start != "equilibrium" or not self.implicit
        static = None if loading_rate is None else static_search(problem)

        def solve(rows: Sample) -> dict[str, NDArray[Any]]:
            checks.warn_of_coarse_grid(problem, rows)
            summaries, rises, cut, expected = [], [], [], []
            for i in range(rows.samples):
                run = make_run(self, medium, rows, i)
                start = None
                if static and loading_rate and not from_rest:
                    start = slow_start(static, run, rows, i)
                summaries.append(self._summary_of(run, start, rows, i))
                rises.append(checks.rise_in_crossing(run, summaries[-1]))
                cut.append(run.cut_short)
                expected.append(first_instability(static, rows, i) if static else np.nan)
            checks.warn_of_cut_events(cut)
            first = np.array([row["first_instability"] for row in summaries])
            checks.warn_of_missed_jumps(first, expected)
            checks.warn_of_survival(self.stop, summaries)
            checks.warn_of_fast_loading(rises)
            names = self.variables(problem)
            return {name: np.array([row[name] for row in summaries]) for name in names}

        return solve

    def search(self, problem: Problem) -> specimens.RuptureSearch:
        """Return the search for equilibria of a specimen, with waves between equilibria."""
        if reasons := refusals(problem, self):
            raise InputError(reasons)
        return specimens.RuptureSearch(problem, self)

    def _summary_of(
        self, run: Run, state: RuptureState | None, rows: Sample, row: int
    ) -> dict[str, Any]:
        """The parts of the run are replaced here. A run that begins at rest, a run
        from an equilibrium, and a run without slip, which has only its end:

        >>> from types import FunctionType, SimpleNamespace
        >>> def summarised(first, state=None, ending="sliding", **options):
        ...     names = globals() | {
        ...         "checks": SimpleNamespace(at_first_slip=lambda run: first)
        ...     }
        ...     names["checks"].check_finite = names["checks"].warn_of_slip = (
        ...         lambda *given: None
        ...     )
        ...     values = {"kinetic_stress": 3.0}
        ...     names["summary"] = lambda run, state: {"critical_stress": state} | values
        ...     names["event_table"] = lambda *given: {"event_load": given[-1]}
        ...     for name in ("arrested_events", "event_variables"):
        ...         names[name] = lambda *given, **named: []
        ...     load = SimpleNamespace(at=np.array([0.0, 4.0]))
        ...     setting = SimpleNamespace(
        ...         load=load, thresholds=SimpleNamespace(end_time=2.5)
        ...     )
        ...     problem = SimpleNamespace(interface=None)
        ...     run = SimpleNamespace(
        ...         setting=setting, medium=SimpleNamespace(problem=problem)
        ...     )
        ...     run.start, run.cut_event = (
        ...         lambda time: f"start at {time}",
        ...         lambda state: None,
        ...     )
        ...     run.run_to_end = lambda state, most: (ending, 0)
        ...     plain = FunctionType(Rupture._summary_of.__code__, names)
        ...     return plain(Rupture(**options), run, state, None, 0)
        >>> summarised("rest"), summarised("rest", "equilibrium")["critical_stress"]
        ({'critical_stress': 'rest', 'kinetic_stress': 3.0}, 'equilibrium')
        >>> summarised(None, "equilibrium", events=2)
        {'critical_stress': 'start at 2.5', 'kinetic_stress': 3.0, 'event_load': 2}
        >>> summarised("rest", stop="onset")["kinetic_stress"].tolist()
        nan
        """
        rest = checks.at_first_slip(run)
        if rest is None:  # no node slips: the result is the state at rest at the end
            state = run.start(min(run.setting.load.at[-1], run.setting.thresholds.end_time))
        else:
            state = rest if state is None else state
            ended, reason = run.run_to_end(state, self.max_steps)
            checks.check_finite(run, state, reason)
            if ended is None:
                step = state.now["step"]
                raise InputError(
                    f"max_steps: {self.max_steps} steps did not reach stop={self.stop!r}, but"
                    f" tau_0 = {step['load']:.6g} Pa with {step['weakened_nodes']} nodes at their"
                    " residual strength. Raise max_steps or the loading rate"
                )
            run.cut_event(state)
        checks.warn_of_slip(run, state)
        values = summary(run, state)
        if self.stop == "onset":
            unknown = [name for name in _UNKNOWN_AT_ONSET if name in values]
            values |= {name: np.full(np.shape(values[name]), np.nan) for name in unknown}
        if self.events:
            problem, events = run.medium.problem, arrested_events(run)
            variables = event_variables(problem.interface, inertia=True)
            values |= event_table(problem, rows, row, events, variables, self.events)
        return values


def make_run(
    method: Rupture, medium: Medium, rows: Sample, row: int, stations: Ints = NO_STATIONS
) -> Run:
    """Return the run for a sample, which records every step at the nodes `stations`.

    The load turns at 2 and 3 s. Half a metre of slip is d_c where the
    strength falls by 1 Pa at 2 Pa/m.

    >>> from types import FunctionType, SimpleNamespace
    >>> parts = {
    ...     "_thresholds": lambda *others: "thresholds",
    ...     "_least_load": lambda *others: 0.25,
    ... }
    >>> plain = FunctionType(
    ...     make_run.__code__, globals() | parts, None, make_run.__defaults__
    ... )
    >>> friction = SimpleNamespace(parameters="law", reach=2.0)
    >>> friction.critical_slip_of = lambda drop, rate: drop / rate
    >>> medium = SimpleNamespace(
    ...     grid="grid", problem=SimpleNamespace(friction=friction)
    ... )
    >>> rows = SimpleNamespace(
    ...     strength=np.array([[9.0, 9.0], [3.0, np.inf]]),
    ...     residual_strength=np.array([[5.0, 5.0], [2.0, 2.0]]),
    ...     weakening_rate=np.array([[1.0, 1.0], [2.0, 2.0]]),
    ...     load_profile=np.array([1.5, 0.5]),
    ...     initial_stress=np.array([[0.0, 0.0], [0.25, 0.75]]),
    ...     part=lambda some: SimpleNamespace(
    ...         steepest_weakening_rate=(some.start, some.stop)
    ...     ),
    ... )
    >>> history = ([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 3.0, 5.0, 4.0, 6.0])
    >>> run = plain(Rupture(load_history=history, stop="rest"), medium, rows, 1)
    >>> setting = run.setting
    >>> setting.turning_times.tolist(), setting.nodes.residual_slip.tolist()
    ([2.0, 3.0], [1.0, inf])
    >>> (
    ...     setting.mean_profile,
    ...     setting.mean_initial,
    ...     run.steepest_weakening_rate,
    ...     run.stop,
    ... )
    (1.5, 0.25, (1, 2), 'rest')
    >>> load = plain(Rupture(loading_rate=7.0), medium, rows, 0).setting.load
    >>> load.at.tolist(), load.values.tolist()
    ([0.0, 1.0], [0.0, 7.0])
    """
    strength, residual = rows.strength[row], rows.residual_strength[row]
    W, initial = rows.weakening_rate[row], rows.initial_stress[row]
    # Unbreakable nodes have an infinite strength, and an infinite
    # residual slip.
    friction, finite = medium.problem.friction, np.isfinite(strength).ravel()
    with np.errstate(over="ignore"):
        residual_slip = friction.reach * friction.critical_slip_of(strength - residual, W)
    if not np.all(np.isfinite(residual_slip.ravel()[finite])):
        raise InputError(
            f"friction: a weakening rate of {W.min():.3g} Pa/m gives an infinite critical"
            " slip. Check the unit of the rate"
        )
    profiles = (strength, residual, W, residual_slip, rows.load_profile, initial)
    nodes = Nodes(*(np.array(values, dtype=np.float64).ravel() for values in profiles))
    steepest = rows.part(slice(row, row + 1)).steepest_weakening_rate
    load = method.load_history
    if load is None:
        load = PiecewiseLinear(np.array([0.0, 1.0]), np.array([0.0, method.loading_rate]))
    # Implicit steps end at these times, because a step across a peak
    # would cut it off.
    rising = np.sign(np.diff(load.values))
    setting = Setting(
        grid=medium.grid,
        law=friction.parameters,
        nodes=nodes,
        mean_profile=float(nodes.profile[finite].mean()),
        mean_initial=float(nodes.initial[finite].mean()),
        load=load,
        turning_times=load.at[1:-1][rising[1:] != rising[:-1]],
        scale=stress_scale(nodes),
        thresholds=_thresholds(method, medium, nodes, load),
        stations=stations,
    )
    least_load = _least_load(medium, nodes, steepest)
    return Run(medium, setting, method.stop, steepest, least_load)


def _least_load(medium: Medium, nodes: Nodes, steepest: float) -> float:
    """Return the mean load, Pa, at which the weakest nodes of half a nucleation length slip.

    Half the nucleation length covers three nodes. They slip at 3, 5 and 7 Pa
    at least. One node never weakens, and one cannot break.

    >>> from types import SimpleNamespace
    >>> medium = SimpleNamespace(
    ...     interface=SimpleNamespace(cell=0.1), problem=SimpleNamespace()
    ... )
    >>> medium.problem.half_spaces = SimpleNamespace(
    ...     nucleation_lengths=lambda rate: (1.2 / rate,)
    ... )
    >>> nodes = SimpleNamespace(
    ...     peak=np.array([11.0, 4.5, 8.0, 4.0, 1.0, np.inf]), initial=1.0
    ... )
    >>> nodes.profile = np.array([2.0, 0.5, 1.0, 1.0, 1.0, 1.0])
    >>> nodes.residual_slip = np.array([1.0, 1.0, 1.0, 1.0, 0.0, np.inf])
    >>> (
    ...     _least_load(medium, nodes, 2.0),
    ...     _least_load(medium, nodes, 200.0),
    ... )  # 3, 5, 7 Pa; 3 Pa
    (5.0, 3.0)
    >>> _least_load(medium, nodes, 0.2)  # all four
    5.5
    """
    interface = medium.interface
    # Half the nucleation length of a line. On a plane, half the lengths
    # along x and y multiplied.
    half = float(np.prod(medium.problem.half_spaces.nucleation_lengths(2.0 * steepest)))
    weakens = np.isfinite(nodes.peak) & (nodes.residual_slip > 0.0)
    # Nodes that never weaken cannot start a rupture.
    loads = ((nodes.peak - nodes.initial) / nodes.profile)[weakens]
    weakest = round(min(max(half / interface.cell, 1.0), loads.size))
    return float(np.partition(loads, weakest - 1)[:weakest].mean())


def _thresholds(
    method: Rupture, medium: Medium, nodes: Nodes, load: PiecewiseLinear
) -> Thresholds:
    """Return the thresholds at which steps change or end.

    A run is calm if, while shear waves cross the part that can break,
    no node slips faster than in a crack with half its length that only
    the load drives, or if no node slips faster than before.

    Waves cross half the period in 500 steps. The median drop is 5 Pa,
    of which 0.075 over Z are an instability.

    >>> from types import SimpleNamespace
    >>> import stiction as st
    >>> def thresholds(
    ...     load=(0.0, 9.0), residual=1.0, peak=(5.0, 6.0, np.inf, 8.0), **options
    ... ):
    ...     solid = SimpleNamespace(shear_wave_speed=2.0)
    ...     problem = SimpleNamespace(effective_modulus=8.0, solid=solid)
    ...     problem.friction = st.LinearWeakening(weakening_rate=1.0)
    ...     interface = SimpleNamespace(lengths=(0.8, 0.2), reach=0.4, size=8)
    ...     medium = SimpleNamespace(
    ...         problem=problem, interface=interface, step=1e-4, impedance=3.0
    ...     )
    ...     medium.grid = SimpleNamespace(
    ...         frequency=np.array([0.0, 40.0 * np.pi, 20.0 * np.pi])
    ...     )
    ...     nodes = SimpleNamespace(
    ...         peak=np.array(peak), residual=np.full(4, residual)
    ...     )
    ...     nodes.profile, nodes.initial = np.full(4, 0.5), np.full(4, 0.25)
    ...     history = PiecewiseLinear(np.array([0.0, 1.0]), np.array(load))
    ...     return _thresholds(Rupture(**options), medium, nodes, history)
    >>> found = thresholds(arrival=0.25)
    >>> (
    ...     found.calm_count,
    ...     found.breakable,
    ...     found.period_nodes,
    ...     found.held,
    ...     found.slid_stop,
    ... )
    (500, 3, 6, True, True)
    >>> [
    ...     round(value, 9)
    ...     for value in (found.calm_slip, found.settling_time, found.front_share)
    ... ]
    [0.05, 0.2, 0.25]
    >>> (
    ...     round(found.unstable_slip_rate, 9),
    ...     round(found.smallest_step, 9),
    ...     found.end_time,
    ... )
    (0.125, 0.0006, inf)
    >>> found.explicit_only, found.curved, found.event_stop, found.rest_stop
    (False, False, False, False)

    An interface that slides, and is unloaded or held up by less than its
    residual strength, may come to rest.

    >>> whole = {"peak": (5.0, 6.0, 7.0, 8.0), "stop": "rest"}
    >>> falls = {"load": (9.0, 8.9)}
    >>> cases = [{}, falls, {"residual": 5.0}, falls | {"stop": "sliding"}]
    >>> [thresholds(**whole | case).slid_stop for case in cases]
    [True, False, False, True]
    >>> (
    ...     thresholds(stop="time", end_time=2.0).slid_stop,
    ...     thresholds(**whole).period_nodes,
    ... )
    (False, 8)
    >>> thresholds(
    ...     stop="rest", **falls
    ... ).slid_stop  # held, so slip comes to rest anyway
    True
    """
    friction, finite = medium.problem.friction, np.isfinite(nodes.peak)
    held = not finite.all()
    # An interface that slides and is unloaded later may still come to rest.
    stress = load.values[-1] * nodes.profile + nodes.initial  # at the end of the samples
    too_low = stress[finite].mean() < nodes.residual[finite].mean()
    unloaded = load.values[-1] < load.values[-2] or too_low
    rests_later = method.stop == "rest" and unloaded and not held
    # The longest wave crosses the interface in 2 pi/(|k| c_s).
    frequency, longest = medium.grid.frequency, max(medium.interface.lengths)
    reach = medium.interface.reach
    crossing = 2.0 * np.pi / frequency[frequency > 0.0].min() * (reach / longest) / medium.step
    typical = float(np.median((nodes.peak - nodes.residual)[finite]))
    front_share = min(friction.slip_at(1.0 - method.arrival), friction.reach) / friction.reach
    breakable = int(np.count_nonzero(finite))
    return Thresholds(
        slid_stop=method.stop != "time" and not rests_later,
        held=held,
        event_stop=method.stop == "onset",
        rest_stop=method.stop == "rest",
        end_time=np.inf if method.end_time is None else method.end_time,
        breakable=breakable,
        period_nodes=min(2 * breakable, medium.interface.size),
        calm_slip=reach / medium.problem.effective_modulus,
        calm_count=max(_MIN_CALM_STEPS, int(np.ceil(crossing))),
        settling_time=_SETTLING_CROSSINGS * reach / medium.problem.solid.shear_wave_speed,
        slip_step=SLIP_STEP,
        load_step=LOAD_STEP,
        smallest_step=_EXPLICIT_STEPS_IN_IMPLICIT * medium.step,
        unstable_slip_rate=UNSTABLE_STRESS * typical / medium.impedance,
        front_share=float(front_share),
        curved=not friction.linear,
        explicit_only=not method.implicit,
    )

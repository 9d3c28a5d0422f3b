"""A run: implicit and explicit steps, switches between them, and the end.

A run goes through phases (`Run.take_steps`):

1. Begin at rest at the first slip, or at an equilibrium (`Run.start`).
   Implicit steps come first, unless the stress is above the strength by
   more than round-off.
2. Follow creep by implicit steps until their size falls below
   `Thresholds.smallest_step`. Then rescale the memory, and change to
   explicit steps (`_to_explicit`).
3. Follow waves by explicit steps until the interface has been calm for
   a while. Then change to implicit steps. The first of these is of
   first order (`_to_implicit`).
4. End the run for one of the reasons in `Run.ending`.
"""

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.methods.dynamics.explicit import explicit_steps
from stiction.methods.dynamics.implicit import LARGEST_STEP, implicit_steps
from stiction.methods.dynamics.medium import Medium
from stiction.methods.dynamics.memory import (
    empty_memory,
    explicit_tables,
    implicit_tables,
    step_table,
    to_explicit,
    to_implicit,
)
from stiction.methods.dynamics.state import (
    DIAGNOSTICS,
    STATION,
    STEP,
    ExplicitTables,
    Floats,
    ImplicitTables,
    Phase,
    Reason,
    RuptureState,
    Setting,
    StepRecord,
    event_type,
    value_at,
)
from stiction.problem.friction.kernels import strengths

# Fractions of the stress scale:
_OVERSTRESS = 1e-6  # stress above the strength from which a run begins with explicit steps
_RESTING_STRESS = 1e-9  # Z V below which the interface rests
_STOPPED_SHARE = 0.1  # slip rate, over `unstable_slip_rate`, above which an interface slides on
_REACHED_SHARE = 1e-12  # of the strength: excess of a node that has just reached it
_STEPS_BETWEEN_CHECKS = 1000  # steps after which a run checks whether it has ended

_ENDINGS = {Reason.ALL_SLID: "sliding", Reason.DROPPED: "onset", Reason.AT_REST: "rest"}
NO_RECORD = StepRecord(np.empty(0, STEP), np.empty((0, 0), STATION))


@dataclasses.dataclass(eq=False)
class Run:
    """Constants of a run (an interface with a load history), with tables for steps."""

    medium: Medium
    setting: Setting
    stop: str  # as `Rupture.stop`
    steepest_weakening_rate: float  # largest at any slip of nodes that may break, Pa/m
    # Load below which no patch runs away: the mean strength of the
    # weakest nodes that make up half a nucleation length, Pa. A few
    # nodes of almost no strength hardly lower this mean.
    least_load: float
    # Tables of the last kind of step only, since they are large.
    tables: ExplicitTables | ImplicitTables | None = None
    # Instabilities that came to rest so far, each a record of `event_type`.
    events: list[NDArray[Any]] = dataclasses.field(default_factory=list)

    def elastic_stress(self, slip_hat: NDArray[np.complex128], load: float) -> Floats:
        """Return the stress (Pa) on an interface at rest with a given slip and load.

        A wave of slip with the amplitude 3 and the stiffness 2 takes off 6 Pa
        where it is largest. (The examples of `Run` replace the parts of a run
        that a method does not read.)

        >>> from types import SimpleNamespace
        >>> from stiction.problem.interface import Interface
        >>> medium = SimpleNamespace(interface=Interface(0.8, 8))
        >>> medium.grid = SimpleNamespace(
        ...     stiffness=np.array([[0.0, 1.0, 2.0, 5.0, 7.0]])
        ... )
        >>> nodes = SimpleNamespace(
        ...     profile=np.linspace(1.0, 8.0, 8), initial=np.full(8, -1.0)
        ... )
        >>> run = Run(medium, SimpleNamespace(nodes=nodes), "sliding", 1.0, 0.0)
        >>> slip_hat = np.fft.rfft(3.0 * np.cos(np.pi / 2.0 * np.arange(8)))
        >>> run.elastic_stress(slip_hat, 10.0)[:4].round(9).tolist()
        [3.0, 19.0, 35.0, 39.0]
        """
        grid, nodes = self.medium.grid, self.setting.nodes
        interface = self.medium.interface
        stress_hat = (-grid.stiffness[0] * slip_hat).reshape(interface.wavenumbers.shape)
        elastic: Floats = interface.inverse_transform(stress_hat).ravel()
        return elastic + load * nodes.profile + nodes.initial

    def mean(self, field: Floats) -> float:
        """Return the mean of a flat field over the nodes that can break.

        >>> from types import SimpleNamespace
        >>> from stiction.problem.interface import Interface
        >>> medium = SimpleNamespace(interface=Interface(0.8, 8, extent=(0.2, 0.4)))
        >>> Run(medium, None, "sliding", 1.0, 0.0).mean(
        ...     np.arange(8.0) ** 2
        ... )  # (4 + 9 + 16)/3
        9.666666666666666
        """
        interface = self.medium.interface
        return float(interface.mean(field.reshape(interface.shape)))

    def strength_after(self, slip: Floats) -> Floats:
        """Return the strength after a slip (m), Pa.

        >>> from types import SimpleNamespace
        >>> from stiction.problem.friction.parameters import Linear
        >>> peak, residual, rate = np.array([[5.0, 7.0], [1.0, 2.0], [2.0, 3.0]])
        >>> nodes = SimpleNamespace(peak=peak, residual=residual, weakening_rate=rate)
        >>> run = Run(
        ...     None, SimpleNamespace(nodes=nodes, law=Linear()), "sliding", 1.0, 0.0
        ... )
        >>> run.strength_after(np.array([1.5, 2.0])).tolist()
        [2.0, 2.0]
        """
        nodes, law = self.setting.nodes, self.setting.law
        peak, residual, W = nodes.peak, nodes.residual, nodes.weakening_rate
        return strengths(law, peak, residual, W, slip)

    def scale_at(self, load: float) -> float:
        """Return the stress scale, Pa, at a load, or at `least_load` if it is larger.

        >>> from types import SimpleNamespace
        >>> from stiction.methods.dynamics.state import PiecewiseLinear
        >>> scale = PiecewiseLinear(np.array([0.0, 10.0]), np.array([0.0, 20.0]))
        >>> run = Run(None, SimpleNamespace(scale=scale), "sliding", 1.0, least_load=3.0)
        >>> run.scale_at(1.0), run.scale_at(5.0)
        (6.0, 10.0)
        """
        return float(value_at(self.setting.scale, max(load, self.least_load)))

    @property
    def first_load(self) -> float:
        """Load at which the first node reaches its strength, before any slip, Pa.

        >>> from types import SimpleNamespace
        >>> peak, initial, profile = np.array(
        ...     [[5.0, 9.0, 4.0], [1.0, 0.5, 2.0], [1.0, 5.0, 0.5]]
        ... )
        >>> nodes = SimpleNamespace(peak=peak, initial=initial, profile=profile)
        >>> Run(None, SimpleNamespace(nodes=nodes), "sliding", 1.0, 0.0).first_load
        1.7
        """
        nodes = self.setting.nodes
        return float(np.min((nodes.peak - nodes.initial) / nodes.profile))

    def first_slip(self) -> float | None:
        """Return the time, s, at which the first node reaches its strength, if it ever does.

        The load rises to 3 Pa, falls to 2 Pa, and rises by 2 Pa/s. The last piece
        continues. A load that falls at last never reaches 4 Pa.

        >>> from types import SimpleNamespace
        >>> from stiction.methods.dynamics.state import PiecewiseLinear
        >>> times, values = (
        ...     np.array([0.0, 1.0, 2.0, 4.0]),
        ...     np.array([0.5, 3.0, 2.0, 6.0]),
        ... )
        >>> for first_load, pieces in ((0.4, 4), (2.5, 4), (3.5, 4), (8.0, 4), (4.0, 3)):
        ...     one = np.ones(1)
        ...     nodes = SimpleNamespace(
        ...         peak=first_load * one, initial=0.0 * one, profile=one
        ...     )
        ...     load = PiecewiseLinear(times[:pieces], values[:pieces])
        ...     setting = SimpleNamespace(nodes=nodes, load=load)
        ...     time = Run(None, setting, "time", 1.0, 0.0).first_slip()
        ...     print("never" if time is None else time)
        0.0
        0.8
        2.75
        5.0
        never
        """
        (times, values), target = self.setting.load, self.first_load
        if values[0] >= target:
            return 0.0
        last = int(np.argmax(values >= target)) or values.size - 1
        slope = (values[last] - values[last - 1]) / (times[last] - times[last - 1])
        missing = target - values[last - 1]
        return float(times[last - 1] + missing / slope) if slope > 0.0 else None

    def slope(self, time: float) -> float:
        """Return the absolute loading rate just after a time, Pa/s.

        >>> from types import SimpleNamespace
        >>> from stiction.methods.dynamics.state import PiecewiseLinear
        >>> load = PiecewiseLinear(
        ...     np.array([0.0, 1.0, 2.0, 4.0]), np.array([0.5, 3.0, 2.0, 6.0])
        ... )
        >>> run = Run(None, SimpleNamespace(load=load), "time", 1.0, 0.0)
        >>> [run.slope(time) for time in (0.0, 0.9, 1.0, 2.0, 9.0)]
        [2.5, 2.5, 1.0, 2.0, 2.0]
        """
        times, values = self.setting.load
        i = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, times.size - 2))
        return float(abs(values[i + 1] - values[i]) / (times[i + 1] - times[i]))

    def start(self, time: float, slip: Floats | None = None) -> RuptureState:
        """Phase 1: return the state at rest, or in equilibrium at a given slip.

        The memory is empty. If any stress exceeds the strength by more than round-off,
        explicit steps come first.

        At 1 s the load is 4 Pa, and the strength of node 1 is 3.5 Pa. With Z = 2 it
        slips at 0.25 m/s, and radiates 0.5 Pa. At zero load, its stress and
        strength have the sum 3 Pa.

        >>> from types import SimpleNamespace
        >>> from stiction.methods.dynamics.state import PiecewiseLinear
        >>> from stiction.problem.friction.parameters import Linear
        >>> from stiction.problem.interface import Interface
        >>> grid = SimpleNamespace(
        ...     frequency=np.ones(4), multiplicity=1, poles=np.zeros(2)
        ... )
        >>> grid.stiffness = np.array([[0.0, 1.0, 2.0, 5.0, 7.0]])
        >>> medium = SimpleNamespace(
        ...     interface=Interface(0.8, 8), impedance=2.0, grid=grid
        ... )
        >>> peak = np.array([5.0, 3.5, 6.0, 7.0, 4.0, 9.0, 9.0, 9.0])
        >>> nodes = SimpleNamespace(
        ...     peak=peak, residual=0.2 * peak, weakening_rate=np.full(8, 2.0)
        ... )
        >>> nodes.residual_slip, nodes.profile, nodes.initial = (
        ...     0.4 * peak,
        ...     np.ones(8),
        ...     np.zeros(8),
        ... )
        >>> history = PiecewiseLinear(
        ...     np.array([0.0, 0.5, 2.0]), np.array([0.0, 2.0, 8.0])
        ... )
        >>> options = {
        ...     "held": False,
        ...     "period_nodes": 8,
        ...     "front_share": 0.5,
        ...     "smallest_step": 1e-6,
        ... }
        >>> thresholds = SimpleNamespace(**options, load_step=1e-3, explicit_only=False)
        >>> setting = SimpleNamespace(nodes=nodes, load=history, scale=history)
        >>> setting.thresholds = thresholds
        >>> setting.law, setting.mean_initial, setting.mean_profile = Linear(), 0.0, 1.0
        >>> run = Run(medium, setting, "sliding", 1.0, 0.0)
        >>> state = run.start(1.0)
        >>> (
        ...     state.slip_rate[:2].tolist(),
        ...     state.stress[[0, 1, 4]].tolist(),
        ...     state.explicit,
        ... )
        ([0.0, 0.25], [4.0, 3.5, 4.0], True)
        >>> step, maximum, of_run = (
        ...     state.now[name] for name in ("step", "maximum", "run")
        ... )
        >>> [
        ...     float(step[name])
        ...     for name in ("time", "load", "whole_stress", "mean_stress")
        ... ]
        [1.0, 4.0, 3.9375, 3.9375]
        >>> [
        ...     float(maximum[name])
        ...     for name in ("time", "stress", "breakable", "strength")
        ... ]
        [1.0, 4.0, 4.0, 0.0625]
        >>> int(step["top_node"]), int(maximum["node"]), float(step["top_slip_rate"])
        (1, 1, 0.25)
        >>> [float(of_run[name]) for name in ("scale", "reverse_margin", "reverse_node")]
        [16.0, 3.0, 1.0]

        With this slip, nodes 2 and 3 are at and beyond their residual strengths,
        and a front has arrived at node 0 too. The first step lets the load rise
        by a tenth of `load_step`.

        >>> peak += 20.0
        >>> nodes.residual_slip[:] = 0.4
        >>> state = run.start(1.0, np.array([0.2, 0.1, 0.4, 0.9, 0.0, 0.0, 0.0, 0.0]))
        >>> np.isfinite(state.arrival).tolist(), int(state.now["step"]["weakened_nodes"])
        ([True, False, True, True, False, False, False, False], 2)
        >>> [
        ...     round(float(state.now["step"][name]), 9)
        ...     for name in ("strength_change", "mean_slip")
        ... ]
        [-0.4, 0.2]
        >>> state.explicit, round(float(state.now["stepping"]["next_size"]), 9)
        (False, 0.0004)
        """
        interface, impedance = self.medium.interface, self.medium.impedance
        setting, nodes, thresholds = self.setting, self.setting.nodes, self.setting.thresholds
        initial_slip = np.zeros(interface.size) if slip is None else slip
        delta = np.array(initial_slip, dtype=np.float64).ravel()
        memory, memory_sum = empty_memory(self.medium.grid)
        load = float(value_at(self.setting.load, time))
        slip_hat = interface.transform(delta.reshape(interface.shape)).ravel()
        stress = self.elastic_stress(slip_hat, load)
        limit = self.strength_after(delta)
        excess = stress - limit
        slip_rate = np.maximum(excess, 0.0) / impedance
        # A node that has just reached its strength has not begun to
        # slip: drop round-off.
        slip_rate[slip_rate * impedance < _REACHED_SHARE * nodes.peak] = 0.0
        stress = stress - impedance * slip_rate
        diagnostics = np.zeros(1, DIAGNOSTICS)
        step, maximum, of_run = (diagnostics[0][name] for name in ("step", "maximum", "run"))
        step["time"] = maximum["time"] = time
        step["load"] = maximum["load"] = of_run["start_load"] = load
        # The mean stress before the first slip, when no waves are radiated.
        maximum["stress"] = setting.mean_initial + load * setting.mean_profile
        radiated = impedance * slip_rate.sum() / thresholds.period_nodes
        step["whole_stress"] = maximum["stress"] - radiated
        weakens = np.isfinite(limit)
        change = (limit[weakens] - nodes.peak[weakens]).sum()
        step["strength_change"] = change / thresholds.period_nodes
        # Stress above the strength counts as strength.
        maximum["strength"] = step["strength_change"] + radiated
        maximum["breakable"] = maximum["stress"]
        if thresholds.held:
            maximum["breakable"] = self.mean(load * nodes.profile + nodes.initial)
        step["mean_stress"] = self.mean(stress)
        maximum["node"] = step["top_node"] = int(np.argmax(excess))
        times, values = setting.load
        lowest = min(load, values[times <= time].min()) if slip is None else load
        margin = stress + limit - (load - lowest) * nodes.profile  # at rest, at the lowest load
        of_run["reverse_margin"], of_run["reverse_node"] = margin.min(), int(np.argmin(margin))
        step["top_slip_rate"], step["mean_slip"] = slip_rate.max(), self.mean(delta)
        step["weakened_nodes"] = np.count_nonzero(delta >= nodes.residual_slip)
        scale = max(0.0, self.scale_at(load))
        of_run["scale"] = scale
        front = thresholds.front_share * nodes.residual_slip
        arrival = np.where((delta > 0.0) & (delta >= front), time, np.nan)
        size, slope = thresholds.smallest_step, self.slope(time)
        first = 0.1 * thresholds.load_step * scale / slope if slope > 0.0 else size
        explicit = thresholds.explicit_only or impedance * slip_rate.max() > _OVERSTRESS * scale
        stepping = diagnostics[0]["stepping"]
        stepping["phase"] = Phase.EXPLICIT if explicit else Phase.IMPLICIT
        stepping["next_size"] = min(max(size, first), LARGEST_STEP)
        return RuptureState(
            delta, slip_rate, stress, slip_hat, slip_rate.copy(), memory, memory_sum, arrival,
            maximum_slip=delta.copy(), event_slip=delta.copy(), diagnostics=diagnostics,
        )  # fmt: skip

    def ended(self, state: RuptureState) -> bool:
        """Return whether the end time is reached, apart from round-off after many steps.

        >>> from types import SimpleNamespace
        >>> setting = SimpleNamespace(thresholds=SimpleNamespace(end_time=5.0))
        >>> run = Run(SimpleNamespace(step=0.1), setting, "time", 1.0, 0.0)
        >>> times = (4.9, 5.0 - 2e-7, 5.0 - 5e-8, 5.1)
        >>> [run.ended(SimpleNamespace(now={"step": {"time": time}})) for time in times]
        [False, False, True, True]
        """
        remaining = self.setting.thresholds.end_time - state.now["step"]["time"]
        return bool(remaining <= 1e-6 * self.medium.step)

    def ending(self, state: RuptureState, reason: int) -> str | None:
        """Return the reason why a run ends in its present state, or `None` if it goes on.

        >>> from types import SimpleNamespace
        >>> from stiction.methods.dynamics.state import PiecewiseLinear
        >>> history = PiecewiseLinear(
        ...     np.array([0.0, 1.0, 2.0]), np.array([0.0, 3.0, 3.0])
        ... )
        >>> thresholds = SimpleNamespace(held=False, end_time=9.0)
        >>> setting = SimpleNamespace(load=history, thresholds=thresholds)
        >>> medium = SimpleNamespace(step=0.1)
        >>> run, medium.impedance = Run(medium, setting, "sliding", 1.0, 0.0), 2.0
        >>> def ending(reason=Reason.DONE, time=3.0, rate=4e-9, explicit=False):
        ...     state = SimpleNamespace(
        ...         slip_rate=np.array([rate, 0.0]), explicit=explicit
        ...     )
        ...     state.now = {"step": {"time": time}, "run": {"scale": 10.0}}
        ...     return run.ending(state, reason)
        >>> [
        ...     ending(reason)
        ...     for reason in (Reason.ALL_SLID, Reason.DROPPED, Reason.AT_REST)
        ... ]
        ['sliding', 'onset', 'rest']
        >>> ending(), ending(time=9.0)
        ('rest', 'time')
        >>> goes_on = {"time": 1.9}, {"rate": 6e-9}, {"explicit": True}
        >>> [ending(**case) is None for case in goes_on]
        [True, True, True]
        >>> run.stop, thresholds.held = "time", True
        >>> ending() is None, ending(Reason.ALL_SLID)
        (True, 'rest')
        """
        if reason == Reason.ALL_SLID and self.setting.thresholds.held:
            return "rest"
        if reason in _ENDINGS:
            return _ENDINGS[Reason(reason)]
        if self.ended(state):
            return "time"
        times, values = self.setting.load
        # The last piece of the load does not rise, and no node slips.
        level = state.now["step"]["time"] >= times[-1] and values[-1] <= values[-2]
        fastest = self.medium.impedance * state.slip_rate.max()
        rests = not state.explicit and fastest <= _RESTING_STRESS * state.now["run"]["scale"]
        return "rest" if self.stop != "time" and level and rests else None

    def run_to_end(self, state: RuptureState, max_steps: int) -> tuple[str | None, int]:
        """Continue to the run's end, or to `max_steps` in total.

        Return (ending, `Reason`).

        The ending is `None` if the run has not ended. The reason is
        then NOT_FINITE or DONE.

        At most 1000 steps lie between two checks.

        >>> class Scripted(Run):
        ...     def take_steps(self, state, count):
        ...         counts.append(count)
        ...         state.now["stepping"]["implicit_steps"] += count
        ...         return (
        ...             count,
        ...             Reason.NOT_FINITE if state.steps >= 3600 else Reason.DONE,
        ...         )
        ...
        ...     def ending(self, state, reason):
        ...         return "sliding" if 2500 <= state.steps < 3000 else None
        >>> state = RuptureState(*[np.zeros(0)] * 10, np.zeros(1, DIAGNOSTICS))
        >>> run, counts = Scripted(None, None, "sliding", 1.0, 0.0), []
        >>> for most in (1500, 9000, 9000):
        ...     ending, reason = run.run_to_end(state, most)
        ...     print(ending or "goes on", reason.name, counts)
        goes on DONE [1000, 500]
        sliding DONE [1000, 500, 1000]
        goes on NOT_FINITE [1000, 500, 1000, 1000, 1000]
        """
        ending, reason = None, int(Reason.DONE)
        while ending is None and reason != Reason.NOT_FINITE and state.steps < max_steps:
            count = min(_STEPS_BETWEEN_CHECKS, max_steps - state.steps)
            _, reason = self.take_steps(state, count)
            ending = self.ending(state, reason)
        return ending, reason

    def take_steps(
        self, state: RuptureState, count: int, record: StepRecord = NO_RECORD
    ) -> tuple[int, int]:
        """Take up to `count` steps in place. Return (steps taken, reason).

        The reason is DONE after `count` steps or at the end time,
        otherwise ALL_SLID, DROPPED, AT_REST or NOT_FINITE. Each step
        fills a row of `record`.

        The steps are scripted: a number and a reason for each loop. Each change of
        type is followed by the other loop.

        >>> from types import SimpleNamespace
        >>> class Scripted(Run):
        ...     def _implicit(self, state, count, record):
        ...         state.now["event"]["begun"] = len(script) == 2
        ...         called.append((state.explicit, count))
        ...         return script.pop(0)
        ...
        ...     def _to_explicit(self, state):
        ...         state.now["stepping"]["phase"] = Phase.EXPLICIT
        ...
        ...     def _to_implicit(self, state):
        ...         state.now["stepping"]["phase"] = Phase.IMPLICIT
        ...
        ...     def _follow_event(self, state, rests):
        ...         called.append(rests)
        ...         state.now["event"]["begun"] = state.now["event"]["calm"] = 0
        ...
        ...     _explicit = _implicit
        >>> thresholds = SimpleNamespace(held=True, end_time=9.0)
        >>> setting, called = SimpleNamespace(thresholds=thresholds), []
        >>> run = Scripted(SimpleNamespace(step=0.1), setting, "sliding", 1.0, 0.0)
        >>> state = RuptureState(*[np.zeros(0)] * 10, np.zeros(1, DIAGNOSTICS))
        >>> script = [
        ...     (3, Reason.TO_EXPLICIT),
        ...     (4, Reason.TO_IMPLICIT),
        ...     (5, Reason.ALL_SLID),
        ... ]
        >>> taken, reason = run.take_steps(state, 20)
        >>> taken, reason.name, called
        (12, 'ALL_SLID', [(False, 20), (True, 17), False, (False, 13), True])
        >>> script, state.now["step"]["time"] = [(2, Reason.DONE), (2, Reason.DONE)], 9.0
        >>> run.take_steps(state, 20)[0], run.take_steps(state, 2)[0]
        (2, 2)
        """
        taken = 0
        while taken < count:
            # 2. and 3. A compiled loop takes steps of one type, until
            # it returns a reason.
            rest_of_record = StepRecord(*(rows[taken:] for rows in record))
            steps = self._explicit if state.explicit else self._implicit
            steps_taken, reason = steps(state, count - taken, rest_of_record)
            taken += steps_taken
            now, held = state.now, self.setting.thresholds.held
            rests = bool(now["event"]["calm"] or (reason == Reason.ALL_SLID and held))
            if rests or now["event"]["begun"]:
                self._follow_event(state, rests)
            # 2. to 4. The other type of steps takes over, or the run ends.
            if reason == Reason.TO_EXPLICIT:
                self._to_explicit(state)
            elif reason == Reason.TO_IMPLICIT:
                self._to_implicit(state)
            elif reason != Reason.DONE or self.ended(state):
                return taken, reason
        return taken, Reason.DONE

    def _follow_event(self, state: RuptureState, rests: bool) -> None:
        """Keep the open event if it has ended, and open the event that has just begun.

        An event ends when its fast slip has settled (`rests`). If the
        next event begins before then, the open event ends where the
        next event begins: at a maximum of the mean stress.

        The next event begins at a maximum, before the fast slip has settled. Then
        slip comes to rest, which is also the last maximum.

        >>> class Scripted(Run):
        ...     def _keep_event(self, state, slip, end):
        ...         kept.append((slip.tolist(), float(end["work"])))
        >>> state, kept = RuptureState(*np.zeros((10, 2)), np.zeros(1, DIAGNOSTICS)), []
        >>> run, now = Scripted(None, None, "sliding", 1.0, 0.0), state.now
        >>> state.slip[:], state.maximum_slip[:] = (0.5, 0.25), (0.1, 0.2)
        >>> now["maximum"]["time"], now["maximum"]["work"], now["step"]["work"] = (
        ...     1.0,
        ...     3.0,
        ...     7.0,
        ... )
        >>> now["maximum"]["node"], now["step"]["time"], now["event"]["begun"] = (
        ...     1,
        ...     2.0,
        ...     1,
        ... )
        >>> run._follow_event(state, rests=False)
        >>> kept, state.event_slip.tolist()
        ([([0.1, 0.2], 3.0)], [0.1, 0.2])
        >>> [
        ...     float(now["event"][name])
        ...     for name in ("open", "begun", "time", "work", "node")
        ... ]
        [1.0, 0.0, 1.0, 3.0, 1.0]
        >>> now["maximum"]["time"], now["event"]["calm"], now["event"]["fast"] = (
        ...     2.0,
        ...     1,
        ...     1,
        ... )
        >>> run._follow_event(state, rests=True)
        >>> kept[1], state.event_slip.tolist(), state.maximum_slip.tolist()
        (([0.5, 0.25], 7.0), [0.5, 0.25], [0.5, 0.25])
        >>> [
        ...     float(now["event"][name])
        ...     for name in ("open", "calm", "fast", "time", "work")
        ... ]
        [0.0, 0.0, 0.0, 2.0, 7.0]
        """
        now, event = state.now, state.now["event"]
        if rests:
            self._keep_event(state, state.slip, now["step"])
        else:
            self._keep_event(state, state.maximum_slip, now["maximum"])
        event["fast"], event["peak_rate"], event["open"] = 0, 0.0, event["begun"]
        # The next event may begin from the present state of rest.
        if rests and now["maximum"]["time"] == now["step"]["time"]:
            now["maximum"]["work"], state.maximum_slip[:] = now["step"]["work"], state.slip
        for name in ("time", "load", "work", "node"):
            event[name] = now["maximum"][name]
        state.event_slip[:] = state.maximum_slip
        event["begun"] = event["calm"] = 0

    def _keep_event(
        self, state: RuptureState, slip: Floats, end: Any, settled: bool = True
    ) -> None:
        """Keep the open event with its slip, load and work at the end, if its slip was fast.

        >>> from types import SimpleNamespace
        >>> thresholds = SimpleNamespace(held=False, unstable_slip_rate=5.0)
        >>> run = Run(None, SimpleNamespace(thresholds=thresholds), "sliding", 1.0, 0.0)
        >>> state = RuptureState(*np.zeros((10, 2)), np.zeros(1, DIAGNOSTICS))
        >>> end = np.zeros((), STEP)
        >>> end["load"], end["work"] = 8.0, 9.0
        >>> begun, state.slip[:], state.event_slip[:] = (
        ...     state.now["event"],
        ...     (0.5, 0.25),
        ...     (0.1, 0.2),
        ... )
        >>> begun["open"], begun["fast"], begun["node"], begun["time"] = 1, 1, 1, 1.0
        >>> begun["fast_since"], begun["fast_until"] = 3.0, 7.0
        >>> begun["load"], begun["work"] = 2.0, 4.0
        >>> state.now["step"]["top_slip_rate"] = 0.6
        >>> run._keep_event(state, state.slip, end, settled=False)
        >>> event = run.events[0]
        >>> event["load"].tolist(), event["work"].tolist(), event["slip"].tolist()
        ([2.0, 8.0], [4.0, 9.0], [[0.1, 0.2], [0.5, 0.25]])
        >>> event["time"].item(), event["duration"].item(), run.cut_short
        (1.0, 4.0, True)

        An interface that slides on ends no event, unless the slip is an earlier
        one. Without fast slip there is no event.

        >>> state.now["results"]["all_broken"] = 1
        >>> for slip in (state.slip, state.slip.copy()):
        ...     run._keep_event(state, slip, end)
        >>> state.now["step"]["top_slip_rate"] = 0.4
        >>> run._keep_event(state, state.slip, end)
        >>> begun["fast"] = 0
        >>> run._keep_event(state, state.slip, end)
        >>> len(run.events), run.cut_short
        (3, False)
        """
        now, thresholds = state.now, self.setting.thresholds
        # A sliding interface never comes to rest.
        slides = now["results"]["all_broken"] and not thresholds.held and slip is state.slip
        slides &= now["step"]["top_slip_rate"] > _STOPPED_SHARE * thresholds.unstable_slip_rate
        begun = now["event"]
        if begun["open"] and begun["fast"] and not slides:
            event = np.zeros((), event_type(slip.size))
            event["time"], event["node"] = begun["time"], begun["node"]
            event["settled"] = settled
            event["duration"] = begun["fast_until"] - begun["fast_since"]
            event["load"] = begun["load"], end["load"]
            event["work"] = begun["work"], end["work"]
            event["slip"] = state.event_slip, slip
            self.events.append(event)

    def cut_event(self, state: RuptureState) -> None:
        """Keep the event that the end of the run cuts short."""
        self._keep_event(state, state.slip, state.now["step"], settled=False)

    @property
    def cut_short(self) -> bool:
        """Whether the run's end cut the last event short."""
        return bool(self.events) and not self.events[-1]["settled"]

    def _explicit(self, state: RuptureState, count: int, record: StepRecord) -> tuple[int, int]:
        """At most 3 steps of 0.1 s are left, and at least one is taken.

        >>> from types import FunctionType, SimpleNamespace
        >>> names = globals() | {
        ...     "explicit_steps": lambda count, *others: (count, Reason.DONE)
        ... }
        >>> plain = FunctionType(Run._explicit.__code__, names)
        >>> run = SimpleNamespace(
        ...     medium=SimpleNamespace(step=0.1), _explicit_tables=lambda: None
        ... )
        >>> run.setting = SimpleNamespace(thresholds=SimpleNamespace(end_time=1.0))
        >>> for time in (0.0, 0.72, 0.7 + 1e-9, 1.0):
        ...     state = SimpleNamespace(now={"step": {"time": time}})
        ...     print(plain(run, state, 5, None)[0])
        5
        3
        3
        1
        """
        medium, tables = self.medium, self._explicit_tables()
        remaining = self.setting.thresholds.end_time - state.now["step"]["time"]
        if remaining < count * medium.step:
            count = min(count, max(1, int(np.ceil(remaining / medium.step - 1e-6))))
        return explicit_steps(count, state, self.setting, tables, record)

    def _implicit(self, state: RuptureState, count: int, record: StepRecord) -> tuple[int, int]:
        if not isinstance(self.tables, ImplicitTables):
            self.tables = None  # release the tables of explicit steps before making new tables
            self.tables = implicit_tables(self.medium.grid)
        return implicit_steps(count, state, self.setting, self.tables, record)

    def _explicit_tables(self) -> ExplicitTables:
        if not isinstance(self.tables, ExplicitTables):
            self.tables, medium = None, self.medium
            table = medium.step_table or step_table(medium.grid, medium.step)
            self.tables = explicit_tables(medium.grid, medium.step, *table)
        return self.tables

    def _to_explicit(self, state: RuptureState) -> None:
        """Phase 2: let explicit steps take over."""
        tables = self._explicit_tables()
        to_explicit(self.medium.grid, state, tables.step, tables.table, state.memory_sum)
        stepping = state.now["stepping"]
        stepping["calm_steps"], stepping["calm_slip_rate"] = 0, state.slip_rate.max()

    def _to_implicit(self, state: RuptureState) -> None:
        """Phase 3: let implicit steps take over.

        >>> from types import FunctionType, SimpleNamespace
        >>> names = globals() | {"to_implicit": lambda *arguments: None}
        >>> plain = FunctionType(Run._to_implicit.__code__, names)
        >>> thresholds = SimpleNamespace(smallest_step=0.3, period_nodes=4)
        >>> run = SimpleNamespace(
        ...     medium=SimpleNamespace(grid=None, step=0.1, impedance=2.0)
        ... )
        >>> run.setting = SimpleNamespace(thresholds=thresholds)
        >>> state = RuptureState(*np.zeros((10, 3)), np.ones(1, DIAGNOSTICS))
        >>> state.slip_rate[:] = 1.0, 2.0, 5.0
        >>> plain(run, state)
        >>> stepping = state.now["stepping"]
        >>> (
        ...     state.past.tolist(),
        ...     *map(float, stepping[["next_size", "previous_radiated"]]),
        ... )
        ([1.0, 2.0, 5.0], 0.6, 4.0)
        >>> int(stepping["two_step"])
        0
        """
        to_implicit(self.medium.grid, state, self.medium.step)
        stepping, thresholds = state.now["stepping"], self.setting.thresholds
        state.past[:] = state.slip_rate
        stepping["next_size"] = 2.0 * thresholds.smallest_step
        stepping["two_step"] = 0  # the first implicit step is of first order
        mean_rate = state.slip_rate.sum() / thresholds.period_nodes
        stepping["previous_radiated"] = self.medium.impedance * mean_rate

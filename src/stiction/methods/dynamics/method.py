"""Ruptures with inertia as a method: options, solver, and thresholds for a run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import pydantic
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, PlainSerializer

from stiction.base.errors import InputError
from stiction.base.model import Count, Flag, Number, Positive, Real, model, real_array
from stiction.base.variables import Variable
from stiction.methods.dynamics import checks, specimens
from stiction.methods.dynamics.diagnostics import stress_scale
from stiction.methods.dynamics.integrator import Run
from stiction.methods.dynamics.medium import Medium, prepare_medium
from stiction.methods.dynamics.slow_start import slow_start, static_search
from stiction.methods.dynamics.state import (
    UNSTABLE_STRESS,
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

_EXPLICIT_STEPS_IN_IMPLICIT = 6.0  # size of the smallest implicit step
_MIN_CALM_STEPS = 300
_SETTLING_CROSSINGS = 0.5  # times shear waves cross the part that can break after fast slip

_UNKNOWN_AT_ONSET = (
    "kinetic_stress", "stress_drop", "seismic_moment", "radiated_energy", "fracture_energy",
    "arrested_events", "rupture_speed", "median_rupture_speed",
)  # fmt: skip


def _load_history(load: Any) -> PiecewiseLinear | None:
    """Return the load history for samples (times, values) in s and Pa, or raise an `InputError`."""
    if load is None:
        return None
    try:
        times, values = (real_array(part) for part in load)
    except (TypeError, ValueError):
        raise InputError("must be two arrays of numbers, (times, values)") from None
    finite = np.isfinite(times).all() and np.isfinite(values).all()
    if times.ndim != 1 or times.shape != values.shape or times.size < 2 or not finite:
        raise InputError("needs two arrays of equal length, 2 or more, of finite numbers")
    if times[0] != 0.0 or np.any(np.diff(times) <= 0.0):
        raise InputError("times must begin at 0 s and increase")
    return PiecewiseLinear(times, values)


def _written(load: PiecewiseLinear | None) -> Any:
    return None if load is None else [array.tolist() for array in load]


LoadHistory = Annotated[Any, BeforeValidator(_load_history), PlainSerializer(_written), "tuple"]


@model(kw_only=True)
class Rupture:
    """Onset from an elastodynamic simulation under a slowly rising load.

    Adaptive implicit steps follow the creeping interface, and explicit
    steps follow its rupture. Initial stress may exceed the strength.
    Such a patch breaks at once, at zero load.

    Parameters
    ----------
    loading_rate : float, optional
        d tau_0/dt, Pa/s, positive. Between half-spaces, give either
        this or `load`.
    kernel_tolerance : float
        Largest error (1) of the memory kernel. The kernel is a sum of
        exponentials, which is fitted once for each solid and stored on
        disk. The fit takes 1 s at 1e-6 (22 pairs) or half a minute at
        1e-8 (35 pairs). Above about 1e-3, waves may grow at any time
        step. This raises an error.
    courant : float
        Explicit time step in units of the stability limit, in (0, 1].
    slip_step : float
        Largest slip of a weakening node in an
        implicit step, in units of its d_c.
    load_step : float
        Largest rise of the load in an implicit step, in units of the
        stress scale (see Notes).
    start : {"equilibrium", "rest"}
        "rest" starts at the first slip. "equilibrium" starts on the
        quasi-static path, as close below the first instability as the
        estimated error allows. `start_load` is the load at the start,
        and `start_error` the estimated error (Pa). These runs always
        start at the first slip: with `load`, if the loading rate is too
        high, if a node loses half of its strength before the first
        instability, on planes, with curved friction laws, with an
        extent, and with stress above the strength.
    end_time : float, optional
        Latest end of a run, s. The last explicit step may exceed it.
    load : (times, values), optional
        Samples of tau_0(t), Pa, from t = 0 s, instead
        of a constant rate. They are interpolated
        linearly, and the last slope continues.
    arrival : float
        Share of tau_p - tau_r that a node has lost when the front
        arrives, in (0, 1]. Use 0.5 for the middle of the cohesive zone,
        and 1e-3 for its tip.
    stop : {"sliding", "onset", "rest", "time"}
        End of a run. "sliding": every node that can break is at its
        residual strength and, if the interface has an extent, has come
        to rest. "onset": the first instability has begun. "rest": after
        an instability, slip has ended or only follows the load. An
        interface that slides and is never unloaded also ends there.
        "time": at `end_time`. A sliding interface takes explicit steps
        until then. Every run but "time" also ends when no node slips
        and the load has stopped rising.
    implicit : bool
        If false, only explicit steps are taken. Slow loading then needs
        a million steps.
    max_steps : int
        Number of steps after which a run, or
        an event on a specimen, is abandoned.
    events : int
        Also return this number of events for each sample over 'event',
        padded with NaN. Events have the variables of `equilibrium_path`
        and `event_duration` (s). Between half-spaces they also have
        `event_time` (s) and `event_radiated_energy` (J/m).

    Raises
    ------
    InputError
        If an option is out of range.

    Notes
    -----
    **Specimens.** Loading is slow. The path follows `Equilibrium` up to each instability. Then
    waves run through the blocks until they are at rest, and the path continues from there.
    The options `courant`, `arrival`, `max_steps` and `events` have an effect. The
    attenuation and the masses of the specimen (`Blocks.quality_factor`, `Platen.mass`,
    `Pusher.mass`) also have an effect. The result has the variables of `Equilibrium`, and
    `rupture_speed` and `median_rupture_speed` for the sliding event.

    **Instabilities between half-spaces.** An instability is slip that the load
    does not drive. It begins when the mean shear stress has a maximum, after
    which waves lower it by 1e-4 of the stress scale. A fall by the load does not
    count, nor a fall while strength falls less. If the stress is above the
    strength at the start, it begins there.
    `first_instability` is the mean stress at the beginning of the first
    instability. The highest instability has `onset_time`, `critical_position` and
    `applied_load` (the load factor at that time). If the interface slides, it
    also has `critical_stress` and `critical_load`, the load factor that carries
    this stress statically. The two load factors differ by the stress that waves
    radiate. Events that did not happen have the value NaN, with a warning. An
    overstressed start has no `critical_load`.

    **Speeds.** Use `median_rupture_speed` as the speed of a rupture.
    `rupture_speed` is the largest apparent speed. It exceeds all wave
    speeds if a part twice as long as the nucleation length breaks
    almost at once.

    **Arrested events.** `arrested_events` counts instabilities in which
    Z V at a node exceeds 7.5 % of the median tau_p - tau_r before the
    mean stress is as high again or all is calm. `Equilibrium` also
    counts smaller jumps. If the last nodes beside the end of an extent
    creep to their residual strength, the interface slides in the last
    instability before, which is not arrested. A run that stops at
    "rest" ends before this can be known.

    **Stress scale.** At each node, it is the smaller of tau_p - tau_r
    and three times the drop tau_0 p + tau_i - tau_r at the largest load
    so far, so that nodes far stronger than the load do not count. The
    stress scale is the mean over nodes.

    **End.** `kinetic_stress` is the mean stress after the first step in
    which every node that can break is at its residual strength.
    Energies and moment refer to the end of the run. A sliding interface
    ends with that step, in which radiated energy and moment grow by
    about 2 %. The last nodes beside the end of an extent may creep to
    their residual strength while the load still rises. This is no
    instability, and `critical_stress` remains the mean stress at the
    highest instability before. It is NaN if all nodes that can break
    did so without an instability.

    With "onset" and "rest", critical values belong to the highest
    instability, which need not end in sliding. With "onset", all values
    that are not final are NaN: kinetic stress, stress drop, moment,
    energies, rupture speeds and arrested events.

    **Events.** An event is followed from its onset until the interface
    is calm, or until the next event begins. The table of `events` holds
    it if a node slipped so fast as an arrested event must. Its moment,
    energies and stress drops are the values at its end, and
    `event_duration` is the time from its first to its last fast slip.
    An event that the end of the run cuts short is left out, such as the
    sliding of an interface without ends.

    **Slow loading.** Let r be the rise of the load while shear waves
    cross the nucleation length, as a share of the stress scale. On 60
    heterogeneous faults of 43 nucleation lengths (mode III, peak
    strength 25.2 to 36 MPa, residual strength 25 MPa), the moment of
    all events together was too large by 2 % at r = 1e-4, 15 % at 3e-4,
    38 % at 1e-3 and 97 % at 3e-3, and the critical load by 0.06, 0.2,
    0.6 and 2 %. The number of arrested events rose from 9 to 14, 13, 14
    and 19 (``validation/faults.py``). If there are arrested events and
    r is above 1e-3, a warning gives r and the rate to use.

    **No reverse slip.** A node whose slip rate would become negative
    sticks, keeps its weakened strength, and slips again only when the
    stress reaches it. If the stress fell below minus the strength, a
    warning gives the place. The boundary integral in Fourier space
    follows Breitenfeld and Geubelle (1998).
    """

    loading_rate: Positive | None = None
    end_time: Positive | None = None
    load: LoadHistory = None
    kernel_tolerance: Positive = 1e-6
    courant: ShareUpToOne = 0.9
    slip_step: ShareUpToOne = 0.02
    load_step: ShareUpToOne = 1e-3
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
    counted_only: ClassVar[bool] = True

    @pydantic.model_validator(mode="after")
    def _consistent(self) -> Rupture:
        problems = []
        if self.loading_rate is not None and self.load is not None:
            problems.append("loading_rate: give either loading_rate or load. Got both")
        if self.stop == "time" and self.end_time is None:
            problems.append("end_time: is needed with stop='time', in s. Got None")
        if not self.implicit:
            problems += [
                f"{name}: has no effect with implicit=False, leave it out"
                for name in ("slip_step", "load_step")
                if getattr(self, name) != type(self).__dataclass_fields__[name].default
            ]
        if problems:
            raise InputError(problems)
        return self

    def seconds_per_sample(self, problem: Problem) -> float:
        """Return the approximate time for a sample on a core, s."""
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
        if self.loading_rate is None and self.load is None:
            reasons.append("loading_rate: give either loading_rate or load. Got neither")
        return reasons

    def bounded_by_strength(self, problem: Problem, event: str) -> tuple[bool, bool]:
        """Return whether strength bounds the stress of an event from below and from above.

        A rupture begins at a maximum of the mean stress, which is not
        below the stress of the first slip, unless the interface ends:
        then slip lowers the mean stress of the part that can break.
        Specimens are in equilibrium up to each event.
        """
        if problem.interface.is_held:
            return False, False
        if problem.specimen is None:
            return True, False
        certain = not (problem.has_machine and event == "first_instability")
        return certain, certain

    def variables(self, problem: Problem) -> dict[str, Variable]:
        """Return the variables of the solver's results."""
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
        """Return a solver for samples of a problem. The memory kernel is fitted once."""
        if problem.specimen is not None:
            return specimens.RuptureSolver(problem, self.events, self.search(problem))
        medium, loading_rate = self.medium(problem), self.loading_rate
        from_rest = self.start != "equilibrium" or not self.implicit
        static = None if from_rest or loading_rate is None else static_search(problem)

        def solve(rows: Sample) -> dict[str, NDArray[Any]]:
            checks.warn_of_coarse_grid(problem, rows)
            summaries, rises, cut = [], [], 0
            for i in range(rows.samples):
                run = make_run(self, medium, rows, i)
                start = None
                if static and loading_rate:
                    start = slow_start(static, run, rows, i, loading_rate)
                summaries.append(self._summary_of(run, start, rows, i))
                rises.append(checks.rise_in_crossing(run, summaries[-1]))
                cut += run.cut_events
            checks.warn_of_cut_events(cut)
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
        rest = checks.at_first_slip(run)
        if rest is None:  # no node slips: the result is the state at rest at the end
            state = run.start(min(run.setting.load.at[-1], run.setting.thresholds.end_time))
        else:
            state = rest if state is None else state
            ended, reason = run.run_to_end(state, self.max_steps)
            checks.check_finite(run, state, reason)
            if ended is None:
                raise InputError(
                    f"max_steps: {self.max_steps} steps did not reach stop={self.stop!r}, only"
                    f" tau_0 = {state.now['load']:.6g} Pa with {state.now['weakened_nodes']} nodes"
                    " at their residual strength. Raise max_steps or the loading rate"
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
    method: Rupture,
    medium: Medium,
    rows: Sample,
    sample: int,
    stations: NDArray[np.int64] | None = None,
) -> Run:
    """Return the run for a sample. It records every step at the nodes `stations`."""
    strength, residual = rows.strength[sample], rows.residual_strength[sample]
    weakening, initial = rows.weakening_rate[sample], rows.initial_stress[sample]
    # Unbreakable nodes have an infinite strength, and an infinite
    # residual slip.
    friction, finite = medium.problem.friction, np.isfinite(strength).ravel()
    with np.errstate(over="ignore"):
        residual_slip = friction.reach * friction.critical_slip_of(
            strength - residual, weakening
        )
    if not np.all(np.isfinite(residual_slip.ravel()[finite])):
        raise InputError(
            f"friction: a weakening rate of {weakening.min():.3g} Pa/m gives an infinite critical"
            " slip. Check the unit of the rate"
        )
    profiles = (strength, residual, weakening, residual_slip, rows.load_profile, initial)
    nodes = Nodes(*(np.array(values, dtype=np.float64).ravel() for values in profiles))
    steepest = rows.part(slice(sample, sample + 1)).steepest_weakening_rate
    load = method.load
    if load is None:
        load = PiecewiseLinear(np.array([0.0, 1.0]), np.array([0.0, method.loading_rate]))
    # Implicit steps end at these times, because a step across a peak
    # would cut it off.
    rising = np.sign(np.diff(load.values))
    setting = Setting(
        law=friction.parameters,
        nodes=nodes,
        mean_profile=float(nodes.profile[finite].mean()),
        mean_initial=float(nodes.initial[finite].mean()),
        load=load,
        turning_times=load.at[1:-1][rising[1:] != rising[:-1]],
        scale=stress_scale(nodes),
        thresholds=_thresholds(method, medium, nodes, load),
        stations=np.empty(0, dtype=np.int64) if stations is None else stations,
    )
    least_load = _least_load(medium, nodes, steepest)
    return Run(medium, setting, method.stop, steepest, least_load)


def _least_load(medium: Medium, nodes: Nodes, steepest: float) -> float:
    """Return the mean load, Pa, at which the weakest nodes of half a nucleation length slip."""
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
        calm_slip=reach / medium.problem.effective_modulus,
        calm_count=max(_MIN_CALM_STEPS, int(np.ceil(crossing))),
        settling_time=_SETTLING_CROSSINGS * reach / medium.problem.solid.shear_wave_speed,
        slip_step=method.slip_step,
        load_step=method.load_step,
        smallest_step=_EXPLICIT_STEPS_IN_IMPLICIT * medium.step,
        unstable_slip_rate=UNSTABLE_STRESS * typical / medium.impedance,
        front_share=float(front_share),
        curved=not friction.linear,
        explicit_only=not method.implicit,
    )

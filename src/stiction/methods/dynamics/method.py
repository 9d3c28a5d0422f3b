"""Elastodynamic rupture as a method: from the first slip to global sliding, sample by sample."""

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
from stiction.methods.dynamics.slow_start import slow_start, static_program
from stiction.methods.dynamics.state import (
    Nodes,
    PiecewiseLinear,
    RuptureState,
    Setting,
    Thresholds,
)
from stiction.methods.dynamics.summary import scalars, summary
from stiction.problem.problem import Problem, refusals
from stiction.problem.results import onset_variables
from stiction.problem.sample import Sample, steepest_rate

ShareUpToOne = Annotated[Real, Field(gt=0, le=1)]

_EXPLICIT_STEPS_IN_IMPLICIT = 6.0  # in the smallest implicit step
_MIN_CALM_STEPS = 300
# Z V that only an instability reaches, in units of the median of tau_p - tau_r: at least 0.106 in
# those that were arrested, at most 0.054 in the waves after them (4 problems, 5e6 and 5e7 Pa/s).
_UNSTABLE_STRESS = 0.075

Start = Literal["equilibrium", "rest"]
Stop = Literal["sliding", "onset", "rest", "time"]
_UNKNOWN_AT_ONSET = (
    "kinetic_stress", "stress_drop", "seismic_moment", "radiated_energy", "fracture_energy",
    "arrested_events", "rupture_speed", "median_rupture_speed",
)  # fmt: skip


def _load_history(load: Any) -> PiecewiseLinear | None:
    """Return times (s) and values (Pa) of tau_0 from samples (times, values), checked."""
    if load is None:
        return None
    try:
        times, values = (real_array(part) for part in load)
    except (TypeError, ValueError):
        raise InputError("must be two arrays of numbers, (times, values)") from None
    if times.ndim != 1 or times.shape != values.shape or times.size < 2:
        shapes = f"{times.shape} and {values.shape}"
        raise InputError(f"needs two 1-d arrays, equally long, of two or more; got {shapes}")
    if not (np.all(np.isfinite(times)) and np.all(np.isfinite(values))):
        raise InputError("times and values must be finite")
    if times[0] != 0.0 or np.any(np.diff(times) <= 0.0):
        raise InputError("times must begin at 0 s and increase")
    return PiecewiseLinear(times, values)


def _written(load: PiecewiseLinear | None) -> Any:
    return None if load is None else [array.tolist() for array in load]


LoadHistory = Annotated[Any, BeforeValidator(_load_history), PlainSerializer(_written), "tuple"]


@model(kw_only=True)
class Rupture:
    """Onset from an elastodynamic simulation under a slowly rising load.

    Adaptive implicit steps follow the creeping interface, explicit steps its rupture.
    The initial stress may be above the strength: such a patch breaks at once, at zero load.

    Parameters
    ----------
    loading_rate : float, optional
        d tau_0/dt, Pa/s, positive. Between half-spaces either this or `load` must be given.
    kernel_tolerance : float
        Allowed error (1) of the memory kernel, a sum of exponentials. The sum is fitted
        once for each solid and stored on disk, in 1 s at 1e-6 (22 pairs) or half a minute
        at 1e-8 (35). From about 1e-3 on, waves may grow at any time step, which raises an
        error.
    courant : float
        Explicit time step in units of the stability limit, in (0, 1].
    slip_step : float
        Slip of any weakening node in one implicit step, in units of its d_c.
    load_step : float
        Rise of the load in one implicit step, in units of the stress scale (see Notes).
    start : {"equilibrium", "rest"}
        "rest": at the first slip. "equilibrium": on the quasi-static path, as close below
        the first instability as the estimated error allows; `start_load` is the load there,
        and `start_error` (Pa) the estimate. The run still begins at the first slip with
        `load`, if the loading rate is too high, if a node loses half of its strength
        before, on planes, with laws that are not piecewise linear, and with barriers or
        stress above the strength.
    end_time : float, optional
        Time at which a run ends at the latest, s, but for a part of the last explicit step.
    load : (times, values), optional
        Samples of tau_0(t), Pa, from t = 0 s, instead of a constant rate, with linear
        interpolation; the last slope continues.
    arrival : float
        Share of tau_p - tau_r that a node has lost when the front arrives there, in (0, 1]:
        0.5 is the middle of the cohesive zone, 1e-3 its tip.
    stop : {"sliding", "onset", "rest", "time"}
        When to end (see Notes), unless nothing slips and the load has stopped rising:
        "sliding": every node that can break is at its residual strength and, if barriers of
        infinite strength hold the interface, has come to rest. "onset": the first
        instability has begun. "rest": nothing slips after an instability any more, except
        as the load drives it; an interface that slides and is never unloaded ends there.
        "time": at `end_time`; an interface that slides takes explicit steps until then.
    implicit : bool
        False takes explicit steps only (slow loading then costs a million steps).
    max_steps : int
        Number of steps after which a run, or an event on a specimen, is abandoned.
    events : int
        Of specimens, also return this number of arrested events, as `Equilibrium` does.

    Raises
    ------
    InputError
        If an option is out of range.

    Notes
    -----
    On specimens loading is slow: the path is that of `Equilibrium` up to each instability,
    from which waves run through the blocks until they are at rest, and the path goes on
    from there. Of the options `courant`, `arrival`, `max_steps` and `events` count, and the
    attenuation and masses of the specimen (`Blocks.quality_factor`, `Platen.mass`,
    `Pusher.mass`). Results are those of `Equilibrium`, and `rupture_speed` and
    `median_rupture_speed` of the event that slides.

    Between half-spaces, an instability is slip that the load does not drive. It begins at a
    maximum of the mean shear stress after which waves lower it by 1e-4 of the stress scale,
    not counting any fall of the load itself; at the start where the stress is above the
    strength. `first_instability` is the mean stress at which the first one begins. The
    highest one has `onset_time`, `critical_position`, `applied_load` (the load factor then)
    and, if the interface slides, `critical_stress` and `critical_load`, the load factor
    that carries that stress statically; what waves radiate is the difference. NaN is what
    did not happen, with a warning, and an overstressed start has no `critical_load`.

    `arrested_events` counts instabilities in which a node slips so fast that Z V exceeds
    7.5 % of the median of tau_p - tau_r before the mean stress is as high again or all is
    calm. `Equilibrium` also counts jumps too small for that. The stress scale is the mean
    over nodes of tau_p - tau_r, or of three times the drop tau_0 p + tau_i - tau_r at the
    largest load so far where that is less, so that unbroken barriers do not count.
    `kinetic_stress` is the mean stress after the first step in which every node that can
    break is at its residual strength. Energies and moment are those of the end of the run.
    If that is this step, as in an interface that slides, radiated energy and moment grow by
    about 2 % in it.

    The last nodes beside a barrier may creep to their residual strength under a load that
    goes on to rise. That is no instability, and `critical_stress` stays the mean stress at
    the highest instability before. It is NaN if everything that can break did so without an
    instability.

    With "onset" and "rest", critical values are those of the highest instability, which
    need not end in sliding, and with "onset" what is not final is NaN: kinetic stress,
    stress drop, moment, energies, rupture speeds and arrested events.

    Slip never reverses: a node whose slip rate would become negative sticks, keeps its
    weakened strength, and slips again only when the stress reaches it; a warning gives the
    place if the stress fell below minus the strength. Boundary integral in Fourier space:
    Breitenfeld and Geubelle (1998).
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
    start: Start = "equilibrium"
    stop: Stop = "sliding"
    max_steps: Count = 5_000_000
    events: Number = 0
    type: Literal["rupture"] = "rupture"
    accepts: ClassVar[tuple[str, ...]] = ("overstress",)
    label: ClassVar[str] = "rupture"
    counted_only: ClassVar[bool] = True

    @pydantic.model_validator(mode="after")
    def _consistent(self) -> Rupture:
        problems = []
        if self.loading_rate is not None and self.load is not None:
            problems.append("loading_rate: give either loading_rate or load, not both")
        if self.stop == "time" and self.end_time is None:
            problems.append("end_time: needed with stop='time', got None")
        if not self.implicit:
            problems += [
                f"{name}: is of implicit steps and has no effect with implicit=False; leave it out"
                for name in ("slip_step", "load_step")
                if getattr(self, name) != type(self).__dataclass_fields__[name].default
            ]
        if problems:
            raise InputError(problems)
        return self

    def seconds_per_sample(self, problem: Problem) -> float:
        """Return the approximate time of a sample on one core, s."""
        shape = problem.interface.shape
        if problem.specimen is not None:
            drive = problem.specimen.drive
            return (0.02 if drive.type == "platen" else 0.3) * (shape[0] / 128) ** 2
        if len(shape) == 1:
            usual = 0.1 if self.start == "rest" else 0.05
            return 8e-3 + usual * (shape[0] / 1024) ** 2
        # As many steps as the longer side has nodes, each in proportion to all nodes.
        return 1.5 * (max(shape) / 128) * (problem.interface.size / 128**2)

    def supports(self, problem: Problem) -> list[str]:
        """Return the reasons why the method cannot solve a problem; none if it can."""
        if problem.specimen is not None:
            return specimens.refusals(self, problem)
        reasons = []
        if self.loading_rate is None and self.load is None:
            reasons.append("loading_rate: give either loading_rate or load")
        if self.events:
            reasons.append("events: only those of specimens are known one by one; leave it out")
        return reasons

    def bounded_by_strength(self, problem: Problem, event: str) -> tuple[bool, bool]:
        """Return whether strength bounds the stress of an event from below and from above.

        A rupture begins at a largest mean stress, however the load moves: none is below the
        stress of the first slip. Specimens are in equilibrium up to each event.
        """
        if problem.specimen is None:
            return True, False
        certain = not (problem.has_machine and event == "first_instability")
        return certain, certain

    def variables(self, problem: Problem) -> dict[str, Variable]:
        """Return the variables that the solver computes for each sample."""
        if problem.specimen is not None:
            return specimens.variables(self, problem)
        return onset_variables(problem.interface) | scalars(problem.interface)

    def medium(self, problem: Problem) -> Medium:
        """Return kernel and tables for a problem."""
        return prepare_medium(problem, self.kernel_tolerance, self.courant)

    def prepare(self, problem: Problem) -> Callable[[Sample], dict[str, NDArray[Any]]]:
        """Return a solver for samples of this problem, with its kernel fitted once."""
        if problem.specimen is not None:
            return specimens.RuptureSolver(problem, self.events, self.program(problem))
        medium, rate = self.medium(problem), self.loading_rate
        from_equilibrium = self.start == "equilibrium" and self.implicit and rate is not None
        static = static_program(problem) if from_equilibrium else None

        def solve(rows: Sample) -> dict[str, NDArray[Any]]:
            checks.warn_if_coarse(problem, rows)
            summaries = []
            for i in range(rows.samples):
                run = make_run(self, medium, rows, i)
                start = slow_start(static, run, rows, i, rate) if static and rate else None
                summaries.append(self._summary_of(run, start))
            checks.warn_of_survival(self.stop, summaries)
            names = self.variables(problem)
            return {name: np.array([row[name] for row in summaries]) for name in names}

        return solve

    def program(self, problem: Problem) -> specimens.RuptureProgram:
        """Return what finds equilibria of a specimen, with waves between them."""
        if reasons := refusals(problem, self):
            raise InputError(reasons)
        return specimens.RuptureProgram(problem, self)

    def _summary_of(self, run: Run, state: RuptureState | None) -> dict[str, Any]:
        rest = checks.at_first_slip(run)
        if rest is None:  # nothing slips: the state at the end of the load is the last
            state = run.start(min(run.setting.load.at[-1], run.setting.thresholds.end_time))
        else:
            state = rest if state is None else state
            ended, reason = run.run_to_end(state, self.max_steps)
            checks.check_finite(run, state, reason)
            if ended is None:
                raise InputError(
                    f"max_steps: {self.max_steps} steps led to tau_0 = {state.now['load']:.6g} Pa,"
                    f" and {state.now['weakened_nodes']} nodes to their residual strength, but not"
                    f" to stop={self.stop!r}; raise max_steps or the loading rate"
                )
        checks.warn_of_slip(run, state)
        values = summary(run, state)
        if self.stop == "onset":
            unknown = [name for name in _UNKNOWN_AT_ONSET if name in values]
            values |= {name: np.full(np.shape(values[name]), np.nan) for name in unknown}
        return values


def make_run(
    method: Rupture,
    medium: Medium,
    rows: Sample,
    sample: int,
    stations: NDArray[np.int64] | None = None,
) -> Run:
    """Return the run of one sample, which records what happens at some nodes."""
    strength, residual = rows.strength[sample], rows.residual_strength[sample]
    weakening, initial = rows.weakening_rate[sample], rows.initial_stress[sample]
    friction, finite = medium.problem.friction, np.isfinite(strength)
    with np.errstate(over="ignore"):
        critical = friction.reach * friction.critical_slip_of(strength - residual, weakening)
    if not np.all(np.isfinite(critical[finite])):
        raise InputError(
            f"friction: a weakening rate of {weakening.min():.3g} Pa/m takes infinitely much slip;"
            " check its unit"
        )
    profiles = (strength, residual, weakening, critical, rows.load_profile, initial)
    nodes = Nodes(*(np.array(values, dtype=np.float64).ravel() for values in profiles))
    steepest = steepest_rate(strength[None], residual[None], weakening[None])
    steepest *= friction.steepest_slope / friction.initial_slope
    load = method.load
    if load is None:
        load = PiecewiseLinear(np.array([0.0, 1.0]), np.array([0.0, method.loading_rate]))
    rising = np.sign(np.diff(load.values))
    setting = Setting(
        law=friction.parameters,
        nodes=nodes,
        mean_profile=float(nodes.profile.mean()),
        mean_initial=float(nodes.initial.mean()),
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
    # Of a line, or on a plane along x times along y.
    half = float(np.prod(medium.problem.half_spaces.nucleation_lengths(2.0 * steepest)))
    weakens = np.isfinite(nodes.strength) & (nodes.critical > 0.0)
    loads = ((nodes.strength - nodes.initial) / nodes.profile)[weakens]
    weakest = round(min(max(half / interface.cell, 1.0), loads.size))
    return float(np.partition(loads, weakest - 1)[:weakest].mean())


def _thresholds(
    method: Rupture, medium: Medium, nodes: Nodes, load: PiecewiseLinear
) -> Thresholds:
    """When steps change or end.

    Calm: for as long as shear waves need to cross the interface, nothing slips faster than
    a crack of half its length does when the load alone drives it, or nothing faster than
    before.
    """
    friction, finite = medium.problem.friction, np.isfinite(nodes.strength)
    held = not finite.all()
    stress = load.values[-1] * nodes.profile + nodes.initial  # at the end, and on from there
    unloaded = load.values[-1] < load.values[-2] or stress.mean() < nodes.residual.mean()
    rests_later = method.stop == "rest" and unloaded and not held
    frequency = medium.grid.frequency
    crossing = 2.0 * np.pi / frequency[frequency > 0.0].min() / medium.step
    typical = float(np.median((nodes.strength - nodes.residual)[finite]))
    arrival = min(friction.slip_at(1.0 - method.arrival), friction.reach) / friction.reach
    breakable = int(np.count_nonzero(finite))
    return Thresholds(
        slid_stop=np.inf if method.stop == "time" or rests_later else float(breakable),
        held=held,
        event_stop=method.stop == "onset",
        rest_stop=method.stop == "rest",
        end_time=np.inf if method.end_time is None else method.end_time,
        breakable=breakable,
        calm_slip=max(medium.interface.lengths) / medium.problem.effective_modulus,
        calm_count=max(_MIN_CALM_STEPS, int(np.ceil(crossing))),
        slip_step=method.slip_step,
        load_step=method.load_step,
        smallest_step=_EXPLICIT_STEPS_IN_IMPLICIT * medium.step,
        unstable_rate=_UNSTABLE_STRESS * typical / medium.impedance,
        arrival=float(arrival),
        curved=not friction.linear,
        explicit_only=not method.implicit,
    )

"""Elastodynamic rupture as a method: from the first slip to global sliding, sample by sample."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field

from stiction._model import Count, Positive, _number, model
from stiction.dynamics import monitor
from stiction.dynamics.discretization import Medium, prepare_medium
from stiction.dynamics.energies import fracture_energy, radiated_energy, rupture_speed
from stiction.dynamics.integrator import Run, State
from stiction.dynamics.loading import History, first_reach, uniform_rate
from stiction.errors import InputError, warn_accuracy
from stiction.problem import Problem
from stiction.results import Variable, onset_variables
from stiction.sample import Sample

Floats = NDArray[np.float64]
Fraction = Annotated[float, BeforeValidator(_number), Field(gt=0, le=1, allow_inf_nan=False)]

_SWITCH = 6.0  # explicit steps in the smallest implicit step
_CALM_STEPS = 300.0
_SLOWEST = 1e20  # s to the first slip, beyond which sizes of implicit steps lose their meaning
_COARSE, _COARSEST = 5e-3, 0.2  # load in one explicit step, in units of the mean of tau_p - tau_r
_GROWTH = 1.3  # of the slip rate in one implicit step, once it shows in the mean stress

_MORE: dict[str, Variable] = {
    "applied_load": Variable("Pa", "load factor applied when the mean stress was largest"),
    "onset_time": Variable("s", "time from zero load when the mean stress was largest"),
    "kinetic_stress": Variable("Pa", "mean stress when all nodes had reached their residual"),
    "stress_drop": Variable("Pa", "critical stress less kinetic stress"),
    "seismic_moment": Variable("N", "seismic moment per length, G times the integral of slip"),
    "radiated_energy": Variable("J/m", "energy radiated until every node had weakened"),
    "fracture_energy": Variable("J/m", "energy dissipated above the residual strength"),
    "arrested_events": Variable("1", "instabilities that stopped before the whole interface slid"),
    "rupture_speed": Variable("m/s", "largest apparent speed of the front over 2 h_n"),
    "median_rupture_speed": Variable("m/s", "median apparent speed of the front over h_n/2"),
    "implicit_steps": Variable("1", "implicit steps taken"),
    "explicit_steps": Variable("1", "explicit steps taken"),
}


@model(kw_only=True)
class Rupture:
    """Onset from an elastodynamic simulation under a slowly rising load.

    Implicit steps of adaptive size follow the interface while it creeps, explicit ones its
    rupture; the run goes from the first slip to the moment when every node has reached its
    residual strength.

    Parameters
    ----------
    loading_rate : float
        d tau_0/dt, Pa/s, positive.
    kernel_tolerance : float
        Error allowed in the memory kernel C(T) by its sum of exponentials (1). The sum is fitted
        once a solid and kept on disk: about 1 s at 1e-6 (22 pairs), half a minute at 1e-8 (35).
    memory_range : float
        That error holds up to T = |k| c_s t of this size (1); older slip rate decays faster than
        it should.
    courant : float
        Explicit time step in units of the stability limit, in (0, 1].
    time_step : float, optional
        Explicit time step, s, instead of `courant`.
    slip_step : float
        Slip of any node in one implicit step, in units of its d_c.
    load_step : float
        Rise of the load in one implicit step, in units of the mean of tau_p - tau_r.
    event_drop : float
        Fall of the mean stress that counts as an instability, in the same units.
    implicit : bool
        False takes explicit steps only (slow loading then costs a million steps).
    max_steps : int
        Steps after which a run is given up.

    Raises
    ------
    InputError
        If an option is out of range; from `prepare` if the time step is unstable.

    Notes
    -----
    `critical_stress` is the largest mean shear stress on the interface, `critical_load` the load
    factor that carries it statically, `applied_load` the one applied at that moment, somewhat
    higher; the difference is radiated. An instability begins when the mean stress has fallen by
    `event_drop` below its last maximum, not counting what the load itself goes down.
    `kinetic_stress` and the energies are those of the first step after which every node is at its
    residual strength; the interface slides fast then, and radiated energy and moment grow by some
    2 % in that step. Slip never reverses: a node whose slip rate would become
    negative sticks, keeps its weakened strength, and slips again only when the stress reaches it.
    Boundary integral in Fourier space: Breitenfeld and Geubelle (1998).
    """

    loading_rate: Positive
    kernel_tolerance: Positive = 1e-6
    memory_range: Positive = 1e5
    courant: Fraction = 0.9
    time_step: Positive | None = None
    slip_step: Fraction = 0.02
    load_step: Fraction = 1e-3
    event_drop: Fraction = 1e-4
    implicit: bool = True
    max_steps: Count = 5_000_000
    type: Literal["rupture"] = "rupture"

    @property
    def chunk_size(self) -> int:
        """Samples that make a good piece of work in an ensemble."""
        return 8

    @property
    def label(self) -> str:
        """Its name in figures and tables."""
        return "rupture"

    def seconds_per_sample(self, problem: Problem) -> float:
        """About how long a sample takes on one core, s."""
        return 0.1 * (problem.interface.size / 1024) ** 2

    def supports(self, problem: Problem) -> list[str]:
        """Reasons why it cannot take a problem; none if it can."""
        return (
            ["it does not take interfaces of two dimensions"] if problem.interface.is_plane else []
        )

    def variables(self, problem: Problem) -> dict[str, Variable]:
        """What the solver returns for each sample."""
        return onset_variables(problem.interface) | _MORE

    def medium(self, problem: Problem) -> Medium:
        """Kernel and tables for a problem."""
        return prepare_medium(
            problem,
            tolerance=self.kernel_tolerance,
            memory_range=self.memory_range,
            courant=self.courant,
            time_step=self.time_step,
        )

    def prepare(self, problem: Problem) -> Callable[[Sample], dict[str, NDArray[Any]]]:
        """A solver for rows of this problem; the kernel is fitted here, once."""
        medium = self.medium(problem)
        history = uniform_rate(self.loading_rate)

        def solve(rows: Sample) -> dict[str, NDArray[Any]]:
            warn_if_coarse(problem, rows)
            found = [
                self._one(problem, make_run(self, medium, rows, i, history))
                for i in range(rows.samples)
            ]
            return {
                name: np.array([one[name] for one in found]) for name in self.variables(problem)
            }

        return solve

    def _one(self, problem: Problem, run: Run) -> dict[str, float]:
        time = first_slip(run)
        check_pace(run, time)
        state = run.start(time)
        _, reason = run.advance(state, self.max_steps)
        check_finite(run, state, reason)
        if reason != monitor.ALL_SLID:
            raise InputError(
                f"max_steps: {self.max_steps} steps were taken before every node had reached its "
                f"residual strength (at t = {state.time:.6g} s, tau_0 = {state.load:.6g} Pa); "
                "raise max_steps or the loading rate"
            )
        return summary(problem, run, state)


def warn_if_coarse(problem: Problem, rows: Sample) -> None:
    """Warn where the nucleation length is not resolved, with the error to expect."""
    resolution = (
        problem.nucleation_length_of(float(rows.weakening_rate.max())) / problem.interface.spacing
    )
    if resolution < 15.0:
        # Largest of rough fields against 126 nodes, see docs/validation.md: 16 %, 3 % and 0.6 %
        # at 8, 16 and 32 nodes.
        percent = 3.0 * (16.0 / resolution) ** 2.4
        expected = f"up to {percent:.0f} %" if percent < 15.0 else "more than 15 %"
        warn_accuracy(
            f"the nucleation length spans {resolution:.1f} nodes: expect {expected} error in slip "
            "just after onset (3 % at 16 nodes, 0.6 % at 32; the critical load is far less "
            "sensitive)"
        )


def _resolves_steps(run: Run, time: float) -> bool:
    """Whether the time since zero load, as a float, tells explicit steps apart."""
    return float(np.spacing(time)) <= 0.01 * run.medium.step


def check_pace(run: Run, time: float) -> None:
    """Refuse or warn of loading that explicit steps or floating-point times cannot follow.

    Parameters
    ----------
    run : Run
    time : float
        When it starts, s.

    Raises
    ------
    InputError
    """
    if time > _SLOWEST:
        raise InputError(
            f"loading_rate: the first slip would come after {time:.3g} s, more than {_SLOWEST:g} s;"
            " load faster (the onset no longer depends on the rate)"
        )
    if not _resolves_steps(run, time):
        warn_accuracy(
            f"the first slip comes after {time:.3g} s, too late for floating-point times to tell "
            f"steps of {run.medium.step:.2g} s apart: rupture speeds are nan, times rounded; loads "
            "and energies are not affected"
        )
    drop = float(np.mean(run.rows[0] - run.rows[1]))
    rise = run.slope(time) * run.medium.step / drop
    if rise > _COARSE:
        step = run.medium.step
        text = (
            f"loading_rate: in one explicit step of {step:.3g} s the load rises by {rise:.2g} of "
            f"the mean of tau_p - tau_r; use time_step={step * _COARSE / rise:.2g} or less, or "
            "load more slowly"
        )
        if rise > _COARSEST:
            raise InputError(text)
        warn_accuracy(f"{text} (the onset is sampled coarsely)")


def make_run(method: Rupture, medium: Medium, rows: Sample, sample: int, history: History) -> Run:
    """The run of one sample."""
    strength, residual = rows.strength[sample], rows.residual_strength[sample]
    weakening, initial = rows.weakening_rate[sample], rows.initial_stress[sample]
    critical = (strength - residual) / weakening
    table = np.stack([strength, residual, weakening, critical, rows.load_profile, initial])
    drop = float(np.mean(strength - residual))
    control = np.zeros(monitor.CONTROLS)
    smallest = _SWITCH * medium.step
    control[monitor.SLID_STOP] = medium.nodes
    control[monitor.DROP_STOP] = np.inf
    control[monitor.CALM_RATE] = 0.25 * method.slip_step * critical.min() / smallest
    control[monitor.CALM_COUNT] = _CALM_STEPS if method.implicit else np.inf
    control[monitor.SLIP_STEP] = method.slip_step
    control[monitor.LOAD_STEP] = method.load_step * drop
    control[monitor.SMALLEST_STEP] = smallest
    control[monitor.RESIDUAL] = 1e-9 * drop
    control[monitor.LARGEST_STEP], control[monitor.END_TIME] = _SLOWEST, np.inf
    control[monitor.EVENT_DROP_SIZE] = method.event_drop * drop
    control[monitor.PEAK_WIDTH_SIZE] = 1e-5 * drop
    control[monitor.NOTICED] = 1e-7 * drop
    control[monitor.GROWTH] = _GROWTH
    control[monitor.NEGLIGIBLE] = 5e-7 * drop
    control[monitor.EXPLICIT_ONLY] = 0.0 if method.implicit else 1.0
    constants = np.array(
        [medium.impedance, medium.spacing, float(rows.load_profile.mean()), float(initial.mean())]
    )
    return Run(medium, table, constants, history, control)


def first_slip(run: Run) -> float:
    """When the first node reaches its strength, s."""
    strength, profile, initial = run.rows[0], run.rows[4], run.rows[5]
    return first_reach(run.history, float(np.min((strength - initial) / profile)))


def check_finite(run: Run, state: State, reason: int) -> None:
    """Raise `FloatingPointError` that says when and where a run became non-finite."""
    if reason == monitor.NOT_FINITE:
        node = int(state.watch[monitor.BAD_NODE])
        raise FloatingPointError(
            f"the slip rate became non-finite at t = {state.time:.9g} s, x = "
            f"{node * run.medium.spacing:.6g} m (node {node}), tau_0 = {state.load:.6g} Pa, after "
            f"{state.steps} steps; the last finite state is kept"
        )


def front_speed(problem: Problem, run: Run, state: State, lengths: float) -> Floats:
    """Apparent speed of the front, m/s, over a window in units of the shortest h_n, (nodes,)."""
    shortest = problem.nucleation_length_of(float(run.rows[2].max()))
    if not _resolves_steps(run, state.time):
        return np.full(run.medium.nodes, np.nan)
    window = min(max(lengths * shortest, 8.0 * run.medium.spacing), 0.25 * problem.interface.extent)
    return rupture_speed(state.arrival, run.medium.spacing, window)


def _of_finite(statistic: Callable[[Floats], Any], values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(statistic(finite)) if finite.size else np.nan


def summary(problem: Problem, run: Run, state: State) -> dict[str, float]:
    """The scalars of a finished run."""
    medium, watch, rows = run.medium, state.watch, run.rows
    peak = float(watch[monitor.PEAK_STRESS])
    first = float(watch[monitor.FIRST_STRESS])
    far, near = (front_speed(problem, run, state, lengths) for lengths in (2.0, 0.5))
    kinetic = float(watch[monitor.KINETIC])
    kinetic = kinetic if np.isfinite(kinetic) else np.nan
    dissipated = fracture_energy(state.slip, rows[0], rows[1], rows[2])
    return {
        "critical_load": (peak - run.constants[3]) / run.constants[2],
        "critical_stress": peak,
        "first_instability": first if np.isfinite(first) else peak,
        "critical_position": float(watch[monitor.PEAK_NODE]) * medium.spacing,
        "applied_load": float(watch[monitor.PEAK_LOAD]),
        "onset_time": float(watch[monitor.PEAK_TIME]),
        "kinetic_stress": kinetic,
        "stress_drop": peak - kinetic,
        "seismic_moment": medium.shear_modulus * float(state.slip.sum()) * medium.spacing,
        "radiated_energy": radiated_energy(
            float(watch[monitor.WORK]), state.slip, state.slip_hat, rows,
            medium.stiffness[0], medium.spacing,
        ),
        "fracture_energy": float(dissipated.sum()) * medium.spacing,
        "arrested_events": int(watch[monitor.ARRESTED]),
        "rupture_speed": _of_finite(np.max, far),
        "median_rupture_speed": _of_finite(np.median, near),
        "implicit_steps": int(watch[monitor.IMPLICIT_STEPS]),
        "explicit_steps": int(watch[monitor.EXPLICIT_STEPS]),
    }  # fmt: skip

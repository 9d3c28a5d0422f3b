"""Refusals and warnings of a run: coarse grids, rates of loading, loads that reverse."""

import numpy as np

from stiction.dynamics.integrator import Run
from stiction.dynamics.loading import load_at
from stiction.dynamics.state import Reason, State
from stiction.errors import InputError, warn_accuracy
from stiction.problem import FEWEST_NODES, Problem, Sample

_COARSE, _COARSEST = 5e-3, 0.2  # load in one explicit step, in units of the stress scale


def warn_if_coarse(problem: Problem, rows: Sample) -> None:
    """Warn where the nucleation length is not resolved, with the error to expect."""
    # Largest of rough fields against 126 nodes, see docs/validation.md: 16 %, 3 % and 0.6 %
    # at 8, 16 and 32 nodes.
    percent = 3.0 * (16.0 / min(problem.nodes_in_nucleation_length(rows.steepest_rate))) ** 2.4
    expected = f"up to {percent:.0f} %" if percent < 15.0 else "more than 15 %"
    problem.warn_if_coarse(
        rows,
        15.0,
        f"expect {expected} error in slip just after onset (3 % at 16 nodes, 0.6 % at 32; the"
        " critical load is far less sensitive)",
    )


def warn_if_unresolved(problem: Problem, run: Run, state: State) -> None:
    """Warn where nodes have slipped that weaken too steeply for the grid, such as barriers."""
    rates, interface = run.setting.nodes.weakening, problem.interface
    steepest = problem.nucleation_lengths(1.0)[-1] / (FEWEST_NODES * interface.spacing)
    steep = np.flatnonzero((state.slip > 0.0) & (rates > steepest))
    if steep.size:
        warn_accuracy(
            f"{steep.size} nodes slipped, the first at {interface.describe_node(steep[0])}, "
            f"where the strength falls by up to {rates[steep].max():.3g} Pa/m, too steeply for this"
            " grid; take more nodes, or infinite strength for barriers that never break"
        )


def at_first_slip(run: Run) -> State:
    """Return the state of rest at first slip; refuse or warn of loads that cannot be followed."""
    time, step = run.first_slip(), run.medium.step
    if np.spacing(time) > 0.01 * step:
        raise InputError(
            f"loading_rate: the first slip would come after {time:.3g} s, too late to resolve "
            f"steps of {step:.2g} s; load faster (the onset no longer depends on the rate)"
        )
    scale = run.scale_at(float(load_at(*run.history, time)))
    if not scale > 0.0:
        raise InputError(
            "initial_stress: too far from the strength for any scale of stress between them; "
            "check the units of both"
        )
    rise = run.slope(time) * step / scale
    if rise > _COARSE:
        text = (
            f"loading_rate: in one explicit step of {step:.3g} s the load rises by {rise:.2g} of "
            f"the stress scale, {scale:.3g} Pa; use time_step={step * _COARSE / rise:.2g} or less,"
            " or load more slowly"
        )
        if rise > _COARSEST:
            raise InputError(text)
        warn_accuracy(f"{text} (the onset is sampled coarsely)")
    _warn_of_reverse(run, time)
    return run.start(time)


def _warn_of_reverse(run: Run, first_slip: float) -> None:
    """Warn if the load may take the stress below minus the strength, which falls by slip."""
    times, values = run.history
    nodes, lowest = run.setting.nodes, float(values.min())
    later = values[times > first_slip].min(initial=0.0)
    below = lowest * nodes.profile + nodes.initial < -nodes.strength
    if later < 0.0:
        below |= later * nodes.profile + nodes.initial < -nodes.residual
    at = np.flatnonzero(below)
    if at.size:
        warn_accuracy(
            f"the stress falls below minus the strength at {at.size} nodes, the first at "
            f"{run.medium.interface.describe_node(at[0])}, where tau_0 = {lowest:.6g} Pa: they "
            "would slip in reverse, which is not modelled, and are kept at rest; change the sign "
            "of the load, or keep it above minus the strength"
        )


def check_finite(run: Run, state: State, reason: int) -> None:
    """Raise a `FloatingPointError` with the time and place at which a run became non-finite."""
    if reason == Reason.NOT_FINITE:
        now = state.now
        node = int(now["bad_node"])
        raise FloatingPointError(
            f"the slip rate became non-finite at t = {now['time']:.9g} s, "
            f"{run.medium.interface.describe_node(node)} (node {node}), tau_0 = "
            f"{now['load']:.6g} Pa, after {state.steps} steps; the last finite state is kept"
        )

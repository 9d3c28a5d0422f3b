"""Errors and warnings for a run: coarse grids, fast loading and reversed loads."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from stiction.base.errors import InputError, warn_accuracy, warn_of_samples
from stiction.methods.dynamics.integrator import Run
from stiction.methods.dynamics.state import Reason, RuptureState, value_at
from stiction.problem.checks import (
    MIN_NODES_IN_NUCLEATION,
    nodes_in_nucleation_length,
    warn_if_coarse,
)
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample

FAST_RISE = 1e-3
"""Rise of the load while shear waves cross the nucleation length,
relative to the stress scale, above which arrested events depend on the
rate of loading."""
MISSED_PERCENT = 2.0
"""Distance of a first instability from equilibrium, %, from which there
is a warning."""
# Fractions of the stress scale:
_COARSE_RISE, _MAX_RISE = 5e-3, 0.2  # rise of the load in an explicit step: warning, and error
_MIN_REVERSE = 1e-3  # stress below minus the strength from which there is a warning


def _rate_below(rate: float) -> str:
    """Return a loading rate in one digit that is not above `rate`, although it is rounded."""
    return f"{0.75 * rate:.1g}"


def warn_of_coarse_grid(problem: Problem, rows: Sample) -> None:
    """Warn if the grid does not resolve the nucleation length, with the expected error."""
    # A power law through the largest errors of rough fields, relative
    # to 126 nodes: 16 %, 3 % and 0.6 % at 8, 16 and 32 nodes
    # (docs/evidence/accuracy.md).
    nodes = min(nodes_in_nucleation_length(problem, rows.steepest_weakening_rate))
    percent = 3.0 * (16.0 / nodes) ** 2.4
    expected = f"up to {percent:.0f} %" if percent < 15.0 else "more than 15 %"
    warn_if_coarse(
        problem,
        rows.steepest_weakening_rate,
        15.0,
        f"expect an error of {expected} in slip after the onset (3 % at 16 nodes, 0.6 % at 32). The"
        " critical load is far less sensitive",
    )


def warn_of_slip(run: Run, state: RuptureState) -> None:
    """Warn about nodes that weaken too steeply for the grid, or whose stress would reverse slip."""
    interface, now = run.medium.interface, state.now["run"]
    W = run.setting.nodes.weakening_rate * run.medium.problem.friction.steepening
    shortest = MIN_NODES_IN_NUCLEATION * interface.spacing
    steepest = run.medium.problem.nucleation_lengths(1.0)[-1] / shortest
    steep = np.flatnonzero((state.slip > 0.0) & (steepest < W))
    if steep.size:
        warn_accuracy(
            f"slip reached {steep.size} nodes, the first at {interface.describe_node(steep[0])},"
            f" where the strength falls by up to {W[steep].max():.3g} Pa/m, too steeply for this"
            " grid. Use more nodes, or end the interface before these nodes (interface.extent)"
        )
    if now["reverse_margin"] < -_MIN_REVERSE * now["scale"]:
        warn_accuracy(
            f"the stress fell below minus the strength, by {-now['reverse_margin']:.3g} Pa at "
            f"{interface.describe_node(int(now['reverse_node']))}: slip in reverse is not"
            " modelled, so these nodes were kept at rest. Change the sign of the load, or unload"
            " less"
        )


def at_first_slip(run: Run) -> RuptureState | None:
    """Return the state of rest at the first slip, or `None` if the load never causes slip.

    If loading is too fast for the grid,
    raise an `InputError` or issue a warning.
    """
    time, step = run.first_slip(), run.medium.step
    if time is None or time >= run.setting.thresholds.end_time:
        return None
    if np.spacing(time) > 0.01 * step:
        raise InputError(
            f"loading_rate: the first slip would come after {time:.3g} s, too late to resolve "
            f"steps of {step:.2g} s. Load faster, which hardly changes the onset"
        )
    scale = run.scale_at(float(value_at(run.setting.load, time)))
    if not scale > 0.0:
        raise InputError("initial_stress: is far below the strength. Check the units of both")
    rise = run.slope(time) * step / scale
    if rise > _COARSE_RISE:
        slower = _rate_below(run.slope(time) * _COARSE_RISE / rise)
        text = (
            f"loading_rate: in one explicit step of {step:.3g} s the load rises by {rise:.2g} of "
            f"the stress scale, {scale:.3g} Pa. Load at {slower} Pa/s or slower"
        )
        if rise > _MAX_RISE:
            raise InputError(text)
        warn_accuracy(f"{text} to resolve the onset")
    return run.start(time)


def warn_of_survival(stop: str, results: list[Any]) -> None:
    """Warn if interfaces did not slide, or become unstable, before their run ended."""
    name = "critical_stress" if stop == "sliding" else "first_instability"
    if any(np.isnan(result[name]) for result in results):
        stuck = any(np.isnan(result["kinetic_stress"]) for result in results)
        what = "slide" if stop == "sliding" and stuck else "become unstable"
        warn_accuracy(
            f"load: an interface did not {what} before its run ended. The values for this event"
            " are NaN, and failure_probability counts the interface as a survivor"
        )


def warn_of_cut_events(cut: Iterable[bool]) -> None:
    """Warn about samples whose run ended during the last event."""
    warn_of_samples(
        "end_time: the run ended during the last event in {samples}. Moment, energies and stress"
        " drops of this event are values at end_time (event_settled is 0). Raise end_time",
        list(cut),
    )


def warn_of_missed_jumps(found: Any, in_equilibrium: Any) -> None:
    """Warn if the first instabilities of ruptures lie above those of equilibrium.

    Both arrays have the shape (samples,), in Pa.
    """
    excess = 100.0 * (found / np.array(in_equilibrium) - 1.0)
    warn_of_samples(
        "first_instability is up to {worst:.2g} % above the first instability in equilibrium in"
        " {samples}. A jump that lowered the mean stress by less than 1e-4 of the stress scale was"
        " missed. Use more nodes, load more slowly, or use st.Equilibrium()",
        excess > MISSED_PERCENT,
        excess,
    )


def rise_in_crossing(run: Run, result: Any) -> tuple[float, float]:
    """Return the rise of the load while shear waves cross the nucleation length, and its rate.

    The rise is a fraction of the stress scale, and the rate is in Pa/s.
    Both are zero without arrested events.
    """
    first_slip = run.first_slip()
    if first_slip is None or not result["arrested_events"] > 0:
        return 0.0, 0.0
    lengths = run.medium.problem.nucleation_lengths(run.steepest_weakening_rate)
    crossing = lengths[0] / run.medium.problem.solid.shear_wave_speed
    loading_rate = run.slope(first_slip)
    return loading_rate * crossing / run.scale_at(float(result["applied_load"])), loading_rate


def warn_of_fast_loading(rises: Iterable[tuple[float, float]]) -> None:
    """Warn if the load rises so fast that arrested events differ from events at a slow load.

    The rises are results of `rise_in_crossing`.
    """
    rise, loading_rate = max(rises)
    if rise > FAST_RISE:
        warn_accuracy(
            f"loading_rate: the load rises by {rise:.2g} of the stress scale while shear waves"
            " cross the nucleation length. Number and size of arrested events then depend on the"
            f" rate. Load at {_rate_below(FAST_RISE / rise * loading_rate)} Pa/s or slower"
        )


def check_finite(run: Run, state: RuptureState, reason: int) -> None:
    """Raise a `FloatingPointError` with the time and place at which a run became non-finite."""
    if reason == Reason.NOT_FINITE:
        step = state.now["step"]
        # In an implicit step only the attempt was non-finite, and all
        # nodes have values.
        places = [
            f" {run.medium.interface.describe_node(node)} (node {node}),"
            for node in np.flatnonzero(~np.isfinite(state.slip_rate))[:1]
        ]
        raise FloatingPointError(
            f"the slip rate became non-finite at t = {step['time']:.9g} s,{''.join(places)} tau_0"
            f" = {step['load']:.6g} Pa, after {state.steps} steps. The last finite state is kept"
        )

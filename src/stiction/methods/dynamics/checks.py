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
    """Return a loading rate in one digit that is not above `rate`, although it is rounded.

    >>> (
    ...     _rate_below(5e7),
    ...     _rate_below(1.9e6),
    ...     _rate_below(1e5),
    ... )  # 0.75 of these, in one digit
    ('4e+07', '1e+06', '8e+04')
    """
    return f"{0.75 * rate:.1g}"


def warn_of_coarse_grid(problem: Problem, rows: Sample) -> None:
    """Warn if the grid does not resolve the nucleation length, with the expected error.

    A nucleation length of 10 nodes gives 3 % times 1.6 to the power 2.4.

    >>> from types import SimpleNamespace
    >>> import stiction as st
    >>> from stiction.base.errors import collect_warnings
    >>> problem = st.paper.problem(nodes=256)
    >>> rate = problem.friction.weakening_rate * problem.nucleation_length
    >>> for nodes in (8.1, 10.0, 14.9, 15.1):
    ...     steepest = rate / problem.interface.spacing / nodes
    ...     with collect_warnings() as warned:
    ...         warn_of_coarse_grid(
    ...             problem, SimpleNamespace(steepest_weakening_rate=steepest)
    ...         )
    ...     print(
    ...         nodes,
    ...         *(str(warning).split("error of ")[1][:14] for warning in warned),
    ...     )
    8.1 more than 15 %
    10.0 up to 9 % in s
    14.9 up to 4 % in s
    15.1
    """
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
    """Warn about nodes that weaken too steeply for the grid, or whose stress would reverse slip.

    Four nodes must span the nucleation length 2/W, so W may be 1 where the
    nodes are 0.5 m apart. Node 2 is steeper, and node 1 does not slip.

    >>> from types import SimpleNamespace
    >>> from stiction.base.errors import collect_warnings
    >>> from stiction.problem.interface import Interface
    >>> problem = SimpleNamespace(friction=SimpleNamespace(steepening=1.5))
    >>> problem.nucleation_lengths = lambda rate: (9.0 / rate, 2.0 / rate)
    >>> medium = SimpleNamespace(problem=problem, interface=Interface(4.0, 8))
    >>> W = np.array([0.6, 9.0, 0.8, 0.0, 0.0, 0.0, 0.0, 0.0])
    >>> nodes = SimpleNamespace(weakening_rate=W)
    >>> run = SimpleNamespace(medium=medium, setting=SimpleNamespace(nodes=nodes))
    >>> now = {"reverse_margin": -0.011, "scale": 10.0, "reverse_node": 3}
    >>> state = SimpleNamespace(slip=1.0 * (np.arange(8) != 1), now={"run": now})
    >>> with collect_warnings() as warned:
    ...     warn_of_slip(run, state)
    >>> [str(warning)[:41] for warning in warned]
    ['slip reached 1 nodes, the first at x = 1 ', 'the stress fell below minus the strength,']
    >>> "by up to 1.2 Pa/m" in str(warned[0]), "at x = 1.5 m" in str(warned[1])
    (True, True)
    >>> now["reverse_margin"], W[2] = -0.009, 0.6
    >>> with collect_warnings() as warned:
    ...     warn_of_slip(run, state)
    >>> warned
    []
    """
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

    In a step of 0.1 s, the load rises by 0.2 Pa, which is 0.5 % of 40 Pa. The
    parts of a run that are not needed are left out.

    >>> from types import SimpleNamespace
    >>> from stiction.base.errors import collect_warnings
    >>> from stiction.methods.dynamics.state import PiecewiseLinear
    >>> def first(scale, time=3.0, end_time=9.0):
    ...     load = PiecewiseLinear(np.array([0.0, 1.0]), np.array([0.0, 2.0]))
    ...     setting = SimpleNamespace(
    ...         load=load, thresholds=SimpleNamespace(end_time=end_time)
    ...     )
    ...     run = SimpleNamespace(setting=setting, medium=SimpleNamespace(step=0.1))
    ...     run.first_slip, run.scale_at = lambda: time, lambda load: scale * load
    ...     run.slope, run.start = (
    ...         lambda time: 2.0,
    ...         lambda time: f"begins at {time} s",
    ...     )
    ...     with collect_warnings() as warned:
    ...         return at_first_slip(run), [str(warning)[-44:] for warning in warned]
    >>> first(7.0)
    ('begins at 3.0 s', [])
    >>> [first(7.0, **never)[0] is None for never in ({"time": None}, {"end_time": 3.0})]
    [True, True]
    >>> first(1.0)  # 0.2 Pa out of 6 Pa; 0.75 * 2 * 0.005 * 6/0.2 = 0.225
    ('begins at 3.0 s', ['d at 0.2 Pa/s or slower to resolve the onset'])
    >>> first(0.16)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: loading_rate: in one explicit step of 0.1 s the load rises...
    >>> first(-1.0)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: initial_stress: is far below the strength...
    >>> first(7.0, time=3e13, end_time=9e13)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: loading_rate: the first slip would come after 3e+13 s, too ...
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
    """Warn if interfaces did not slide, or become unstable, before their run ended.

    >>> from stiction.base.errors import collect_warnings
    >>> def told(stop, critical, first, kinetic):
    ...     names = "critical_stress", "first_instability", "kinetic_stress"
    ...     results = [dict(zip(names, (critical, first, kinetic), strict=True))] * 2
    ...     with collect_warnings() as warned:
    ...         warn_of_survival(stop, results)
    ...     return [str(warning)[:40] for warning in warned]
    >>> told("sliding", np.nan, 5.0, np.nan), told("sliding", np.nan, 5.0, 3.0)
    (['load: an interface did not slide before '], ['load: an interface did not become unstab'])
    >>> told("onset", np.nan, np.nan, np.nan), told("onset", np.nan, 5.0, np.nan)
    (['load: an interface did not become unstab'], [])
    """
    name = "critical_stress" if stop == "sliding" else "first_instability"
    if any(np.isnan(result[name]) for result in results):
        stuck = any(np.isnan(result["kinetic_stress"]) for result in results)
        what = "slide" if stop == "sliding" and stuck else "become unstable"
        warn_accuracy(
            f"load: an interface did not {what} before its run ended. The values for this event"
            " are NaN, and failure_probability counts the interface as a survivor"
        )


def warn_of_cut_events(cut: Iterable[bool]) -> None:
    """Warn about samples whose run ended during the last event.

    >>> from stiction.base.errors import collect_warnings
    >>> with collect_warnings() as warned:
    ...     warn_of_cut_events(flag for flag in (False, True, True))
    >>> str(warned[0])[:68]
    'end_time: the run ended during the last event in 2 of 3 samples (1, '
    """
    warn_of_samples(
        "end_time: the run ended during the last event in {samples}. Moment, energies and stress"
        " drops of this event are values at end_time (event_settled is 0). Raise end_time",
        list(cut),
    )


def warn_of_missed_jumps(found: Any, in_equilibrium: Any) -> None:
    """Warn if the first instabilities of ruptures lie above those of equilibrium.

    Both arrays have the shape (samples,), in Pa.

    >>> from stiction.base.errors import collect_warnings
    >>> with collect_warnings() as warned:
    ...     found = np.array([103.0, 204.2, 99.0, 101.0])
    ...     warn_of_missed_jumps(found, [100.0, 200.0, 300.0, np.nan])
    >>> str(warned[0])[:85]
    'first_instability is up to 3 % above the first instability in equilibrium in 2 of 4 s'
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

    Waves cross 0.6 m in 0.2 s. In this time the load rises by 1 Pa, and the
    scale is 40 Pa.

    >>> from types import SimpleNamespace
    >>> problem = SimpleNamespace(nucleation_lengths=lambda rate: (1.8 / rate, 9.0))
    >>> problem.solid = SimpleNamespace(shear_wave_speed=3.0)
    >>> run = SimpleNamespace(
    ...     medium=SimpleNamespace(problem=problem), steepest_weakening_rate=3.0
    ... )
    >>> run.first_slip, run.slope = lambda: 7.0, lambda time: time - 2.0
    >>> run.scale_at = lambda load: 4.0 * load
    >>> result = {"arrested_events": 1, "applied_load": 10.0}
    >>> [round(value, 9) for value in rise_in_crossing(run, result)]
    [0.025, 5.0]
    >>> rise_in_crossing(run, result | {"arrested_events": 0})
    (0.0, 0.0)
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

    The fastest of three runs is warned about: 0.75 * 0.001/0.004 * 7 Pa/s.

    >>> from stiction.base.errors import collect_warnings
    >>> with collect_warnings() as warned:
    ...     warn_of_fast_loading([(0.0, 0.0), (0.004, 7.0), (0.003, 9.0)])
    ...     warn_of_fast_loading([(0.0, 0.0), (0.001, 8.0)])
    >>> len(warned), str(warned[0])[:39], str(warned[0])[-24:]
    (1, 'loading_rate: the load rises by 0.004 o', 'Load at 1 Pa/s or slower')
    """
    rise, loading_rate = max(rises)
    if rise > FAST_RISE:
        warn_accuracy(
            f"loading_rate: the load rises by {rise:.2g} of the stress scale while shear waves"
            " cross the nucleation length. Number and size of arrested events then depend on the"
            f" rate. Load at {_rate_below(FAST_RISE / rise * loading_rate)} Pa/s or slower"
        )


def check_finite(run: Run, state: RuptureState, reason: int) -> None:
    """Raise a `FloatingPointError` with the time and place at which a run became non-finite.

    >>> from types import SimpleNamespace
    >>> from stiction.problem.interface import Interface
    >>> run = SimpleNamespace(medium=SimpleNamespace(interface=Interface(0.8, 8)))
    >>> slip_rate, now = np.zeros(8), {"step": {"time": 1.5, "load": 3.0}}
    >>> state = SimpleNamespace(slip_rate=slip_rate, now=now, steps=7)
    >>> slip_rate[[3, 5]] = np.nan, np.inf
    >>> check_finite(run, state, Reason.DONE)
    >>> check_finite(run, state, Reason.NOT_FINITE)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    FloatingPointError: the slip rate became non-finite at t = 1.5 s, x = 0.3 m (node 3), tau_0 =...
    """
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

"""Start a run on the quasi-static path, close to the first instability.

Problem
-------
While the load tau_0 rises slowly at the rate R, slip follows the
equilibria d(tau_0). Find the state of the run (slip, slip rate and
memory variables) at a load tau_c - D, a distance D below the onset
tau_c, without taking the steps to this state. A run from this state
must have the same onset.

Algorithm: our own
------------------
Asymptotics of a fold: near the onset, the distance of slip from its
limit falls as (tau_c - tau_0)^(1/2), so the slip rate V = R dd/dtau_0
grows as exp(a t) with a = R/(2 D).

1. Find the onset tau_c by equilibrium. Begin with a distance D in which
   shear waves cross the nucleation length `_CROSSINGS` times.
2. Find the equilibria at tau_c - D and a little before. Their
   difference gives the mean slip rate, and its growth the slip rate V
   at tau_c - D (`_state_at`).
3. Slip that grows as exp(a t) leaves a permanent part psi = V/(a - z)
   in each memory variable, psi' = z psi + V with z = s_p |k| c_s
   (`memory.grown_memory`).
4. Raise the load by the radiation of the mean slip rate, Z <V>/<p>.
   Then stress that follows V without delay needs no further force, and
   the remaining stress is inertia (the kernel is even in a, except for
   the radiation of the mean).
5. At the slipping nodes, the difference of stress and strength
   estimates the error of the state, and as a stress the amount by which
   the onset may be misplaced. If this error exceeds `_MAX_ERROR` of the
   stress scale, go to step 2 with a larger D: V falls as D^(-1/2), and
   its second derivative falls as D^(-5/2).
6. Give up after `_MAX_TRIALS`, or if no state is known well enough. The
   run then begins at rest.
"""

import numpy as np

from stiction.methods.dynamics.integrator import Run
from stiction.methods.dynamics.memory import grown_memory
from stiction.methods.dynamics.state import Phase, RuptureState
from stiction.methods.dynamics.summary import energy_balance
from stiction.methods.equilibrium.dense.search import DenseSearch
from stiction.methods.equilibrium.solver import refused, sample_of
from stiction.methods.equilibrium.state import PathStatus
from stiction.methods.equilibrium.strength import StaticSample, exceeds
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample

_MAX_ERROR = 2e-5  # fraction of the stress scale: a fifth of the drop that counts as an event
_CROSSINGS = 10.0  # times shear waves cross h_n between the first trial and the onset
_RATE_SHARE = 0.25  # fraction of the distance to the onset over which the mean rate is measured
_MAX_TRIALS = 5


def static_search(problem: Problem) -> DenseSearch | None:
    """Return the search for equilibria of a problem, or `None` for planes and curved laws.

    >>> import dataclasses, stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> type(static_search(problem)).__name__
    'DenseSearch'
    >>> law = st.ExponentialWeakening(weakening_rate=5e11)
    >>> static_search(dataclasses.replace(problem, friction=law)) is None
    True
    """
    if problem.interface.is_plane or refused(problem):
        return None
    return DenseSearch(problem)


def first_instability(search: DenseSearch, rows: Sample, number: int) -> float:
    """Return the mean stress of the first instability in equilibrium, Pa, or NaN without it.

    The mean stress is the load less the relief by slip, here 7 - 0.5 * 4 Pa.

    >>> from types import FunctionType, SimpleNamespace
    >>> names = globals() | {"sample_of": lambda rows, pieces, number: number}
    >>> plain = FunctionType(first_instability.__code__, names)
    >>> state = SimpleNamespace(
    ...     status=PathStatus.UNSTABLE, load=7.0, slip=np.full(2, 2.0)
    ... )
    >>> search = SimpleNamespace(next=lambda sample: state, pieces=None)
    >>> search.problem = SimpleNamespace(relief=lambda slip: 0.5 * slip.sum())
    >>> rows = SimpleNamespace(strength=np.array([[9.0, 9.0], [9.0, 3.0]]))
    >>> rows.initial_stress = np.full((2, 2), 3.0)
    >>> rows.part = lambda some: SimpleNamespace(
    ...     mean_stress=lambda load: load + some.stop
    ... )
    >>> (
    ...     plain(search, rows, 0),
    ...     plain(search, rows, 1),
    ... )  # node 1 has no strength to spare
    (6.0, nan)
    >>> state.status = PathStatus.STABLE
    >>> plain(search, rows, 0)
    nan
    """
    if np.any(rows.strength[number] <= rows.initial_stress[number]):  # overstressed
        return np.nan
    state = search.next(sample_of(rows, search.pieces, number))
    if state.status != PathStatus.UNSTABLE:
        return np.nan
    load = state.load - search.problem.relief(state.slip)
    return float(rows.part(slice(number, number + 1)).mean_stress(np.array([load]))[0])


def slow_start(search: DenseSearch, run: Run, rows: Sample, number: int) -> RuptureState | None:
    """Return the state with a small error that is closest to the onset, or `None`.

    `number` is the row of the sample. The loading rate is constant.

    Shear waves cross h_n in 0.1 s, so the first distance is 10 * 0.1 * 2 Pa. An
    unknown state makes it four times as large, and an error of twice the
    allowed error 1.2 * 2^0.4 times.

    >>> from types import FunctionType, SimpleNamespace
    >>> def distances(errors, first_load=0.0, peak=9.0, onset=100.0):
    ...     def state_at(search, run, static, load, distance):
    ...         tried.append(round(distance, 6))
    ...         error = errors[len(tried) - 1]
    ...         start = {"run": {"start_error": error and error * 2e-5 * 50.0}}
    ...         return None if error is None else SimpleNamespace(now=start)
    ...
    ...     tried, names = (
    ...         [],
    ...         {"_state_at": state_at, "sample_of": lambda *given: None},
    ...     )
    ...     plain = FunctionType(slow_start.__code__, globals() | names)
    ...     problem = SimpleNamespace(
    ...         nucleation_lengths=lambda rate: (1.5 / rate, 9.0)
    ...     )
    ...     problem.solid = SimpleNamespace(shear_wave_speed=5.0)
    ...     equilibrium = onset and SimpleNamespace(load=onset)
    ...     search = SimpleNamespace(
    ...         solve=lambda static: equilibrium, problem=problem, pieces=None
    ...     )
    ...     nodes = SimpleNamespace(
    ...         peak=np.array([peak, 8.0]), initial=np.array([3.0, 3.0])
    ...     )
    ...     run = SimpleNamespace(
    ...         setting=SimpleNamespace(nodes=nodes), slope=lambda time: 2.0
    ...     )
    ...     run.scale_at, run.first_load = lambda load: 0.5 * load, first_load
    ...     run.steepest_weakening_rate = 3.0
    ...     return plain(search, run, None, 0) is not None, tried
    >>> distances([None, 2.0, 1.0])
    (True, [2.0, 8.0, 12.667276])
    >>> distances([None] * 5), distances([1.1] * 5)[0]
    ((False, [2.0, 8.0, 32.0]), False)
    >>> distances([1.0], first_load=97.5), distances([1.0], first_load=97.4)
    ((False, []), (True, [2.0]))
    >>> (
    ...     distances([1.0], peak=3.0),
    ...     distances([1.0], peak=np.inf),
    ...     distances([1.0], onset=None),
    ... )
    ((False, []), (False, []), (False, []))
    """
    nodes, loading_rate = run.setting.nodes, run.slope(0.0)
    if not np.all(np.isfinite(nodes.peak)) or np.any(nodes.peak <= nodes.initial):
        return None
    static = sample_of(rows, search.pieces, number)
    onset = search.solve(static)
    if onset is None:
        return None
    # 1. The onset, and the first distance.
    allowed = _MAX_ERROR * run.scale_at(onset.load)
    crossing = search.problem.nucleation_lengths(run.steepest_weakening_rate)[0] / (
        search.problem.solid.shear_wave_speed
    )
    distance = max(_CROSSINGS * crossing * loading_rate, 1e-6 * allowed)
    for _ in range(_MAX_TRIALS):
        if onset.load - (1.0 + _RATE_SHARE) * distance <= run.first_load:  # 6.
            return None
        state = _state_at(search, run, static, onset.load, distance)
        # 5. Close enough, or a greater distance.
        if state is None:
            distance *= 4.0
        elif state.now["run"]["start_error"] <= allowed:
            return state
        else:
            distance *= 1.2 * (state.now["run"]["start_error"] / allowed) ** 0.4
    return None  # 6.


def _state_at(
    search: DenseSearch, run: Run, static: StaticSample, onset: float, distance: float
) -> RuptureState | None:
    """Steps 2 to 5: return the state at a distance (Pa) below the onset, or `None` if unknown.

    The state is unknown if a node is beyond the first piece of its law,
    where the linear programme does not hold, or if a front has arrived,
    since the time of arrival is not known.

    At 8 Pa below the onset of 100 Pa, and at 2 Pa less, the slips differ by 0.1
    and 0.05 m. The load takes 1 s from one to the other at 2 Pa/s. The growth is
    2/(2 * 8) per second, so the rates are 1 + 0.125/2 times their means.

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> from stiction.problem.interface import Interface
    >>> names = globals() | {"exceeds": lambda static, slip: False}
    >>> names["energy_balance"] = lambda run, state: {"radiated_energy": 4.0}
    >>> names["grown_memory"] = lambda grid, memory, V, growth: (
    ...     growth * np.eye(1, 5)[0]
    ... )
    >>> plain, line = FunctionType(_state_at.__code__, names), Interface(0.8, 8)
    >>> def solve(static, cap):
    ...     return SimpleNamespace(slip=slips[cap]) if cap in slips else None
    >>> slips = {92.0: np.append([0.5, 0.25], np.zeros(6))}
    >>> slips[90.0] = np.append([0.4, 0.2], np.zeros(6))
    >>> nodes = SimpleNamespace(residual_slip=np.append([1.2, 0.8], np.full(6, 9.0)))
    >>> setting = SimpleNamespace(nodes=nodes, mean_profile=2.0)
    >>> setting.thresholds = SimpleNamespace(front_share=0.5)
    >>> grid = SimpleNamespace(stiffness=np.full((2, 5), 16.0))
    >>> run = SimpleNamespace(setting=setting, slope=lambda time: 2.0)
    >>> run.medium = SimpleNamespace(grid=grid, impedance=3.0, interface=line)
    >>> def start(time, slip):
    ...     fields = (
    ...         slip.copy(),
    ...         *np.zeros((2, 8)),
    ...         np.zeros(5, complex),
    ...         *np.zeros((6, 8)),
    ...     )
    ...     state = RuptureState(*fields, np.zeros(1, DIAGNOSTICS))
    ...     state.now["step"]["time"], state.now["step"]["work"] = time, 9.0
    ...     return state
    >>> run.start, run.elastic_stress = (
    ...     start,
    ...     lambda slip_hat, load: np.full(8, load),
    ... )
    >>> run.strength_after = lambda slip: np.full(8, 90.0)
    >>> state = plain(SimpleNamespace(solve=solve), run, None, 100.0, 8.0)
    >>> state.slip_rate[:3].round(9).tolist(), state.past[:3].round(9).tolist()
    ([0.10625, 0.053125, 0.0], [0.1, 0.05, 0.0])
    >>> now, radiated = state.now, 3.0 * (0.10625 + 0.053125) / 8.0
    >>> load = 92.0 + radiated / 2.0
    >>> stress = load + 0.125 * 16.0 / 8.0 - 3.0 * state.slip_rate
    >>> (
    ...     np.allclose(state.stress, stress),
    ...     np.allclose(now["step"]["time"], load / 2.0),
    ... )
    (True, True)
    >>> np.allclose(now["run"]["start_error"], np.abs(stress - 90.0)[:2].max())
    True
    >>> np.allclose(
    ...     [now["maximum"]["stress"], now["step"]["whole_stress"]], stress.mean()
    ... )
    True
    >>> np.allclose(
    ...     [now["maximum"]["radiated"], now["stepping"]["previous_radiated"]],
    ...     radiated,
    ... )
    True
    >>> [float(now[group]["work"]) for group in ("step", "maximum")]
    [5.0, 5.0]
    >>> [
    ...     round(float(now["stepping"][name]), 9)
    ...     for name in ("previous_size", "two_step", "phase")
    ... ]
    [1.0, 1.0, 0.0]

    The state is unknown without an equilibrium, if the front has arrived at a
    node, or if a node that never weakens slips.

    >>> search = SimpleNamespace(solve=solve)
    >>> onsets = (98.0, 102.0)
    >>> [plain(search, run, None, onset, 8.0) is None for onset in onsets]
    [True, True]
    >>> for node, length in ((1, 0.5), (0, 0.0)):
    ...     nodes.residual_slip[node] = length
    ...     print(plain(search, run, None, 100.0, 8.0) is None)
    True
    True
    """
    nodes, grid, loading_rate = run.setting.nodes, run.medium.grid, run.slope(0.0)
    # 2. Two equilibria, and the slip rate between them.
    load, load_rise = onset - distance, _RATE_SHARE * distance
    present, before = (search.solve(static, cap) for cap in (load, load - load_rise))
    if present is None or before is None or exceeds(static, present.slip):
        return None
    weakens = nodes.residual_slip > 0.0
    front = run.setting.thresholds.front_share * nodes.residual_slip
    arrived = present.slip[weakens] >= front[weakens]
    if np.any(arrived) or np.any(present.slip[~weakens] > 0.0):
        return None
    interval, growth = load_rise / loading_rate, 0.5 * loading_rate / distance
    mean_slip_rate = np.maximum(present.slip - before.slip, 0.0) / interval
    slip_rate = mean_slip_rate * (1.0 + 0.5 * growth * interval)
    # 3. and 4. Memory, load and stress.
    radiated = run.medium.impedance * float(slip_rate.mean())
    applied = load + radiated / run.setting.mean_profile
    state = run.start(applied / loading_rate, present.slip)
    slip_rate_hat = run.medium.interface.transform(slip_rate)
    memory = grown_memory(grid, state.memory, slip_rate_hat, growth)
    stress = run.elastic_stress(state.slip_hat, applied)
    stress += run.medium.interface.inverse_transform(grid.stiffness[1] * memory)
    stress -= run.medium.impedance * slip_rate
    # 5. The difference of stress and strength estimates the error.
    missed = np.abs(stress - run.strength_after(present.slip))[present.slip > 0.0]
    state.slip_rate[:], state.past[:], state.stress[:] = slip_rate, mean_slip_rate, stress
    now = state.now
    now["stepping"]["phase"], now["stepping"]["two_step"] = Phase.IMPLICIT, 1
    now["stepping"]["previous_size"], now["step"]["top_slip_rate"] = interval, slip_rate.max()
    now["step"]["mean_stress"] = now["step"]["whole_stress"] = stress.mean()
    now["maximum"]["stress"] = now["maximum"]["breakable"] = stress.mean()
    now["maximum"]["radiated"] = now["stepping"]["previous_radiated"] = radiated
    # The slow path radiates no energy. Set
    # its work so that the balance gives zero.
    now["step"]["work"] -= energy_balance(run, state)["radiated_energy"]
    now["maximum"]["work"] = now["step"]["work"]
    now["run"]["start_error"] = missed.max(initial=0.0)
    return state

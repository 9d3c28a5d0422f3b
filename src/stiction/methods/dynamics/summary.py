"""Scalars of a run: loads, moment, energies and rupture speeds.

1. The critical load carries the critical stress statically
   (`_critical_load`).
2. The work of the load is dissipated by friction, stored as strain
   energy or radiated. The first two follow from the slip alone, so the
   radiated energy is the difference (`_energies`).
3. The front arrives at a node when the node has lost a fraction of its
   strength. The distance of two nodes on a line over the difference of
   their arrival times is an apparent speed (`rupture_speed`). Each
   speed is a mean over a window of two or half a nucleation length.
   The median weighs the windows, so that round-off in arrival times
   does not move it (`front_speeds`).
4. The spectrum is the Fourier integral of an event's moment rate
   (`rate_spectrum`).
"""

from typing import Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.variables import Variable
from stiction.methods.dynamics.integrator import Run
from stiction.methods.dynamics.state import Floats, RuptureState, Spectrum
from stiction.methods.equilibrium.events import ArrestedEvent, moment_of, place_of
from stiction.methods.equilibrium.state import EquilibriumState
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem
from stiction.problem.results import per_area, position

SPEEDS: dict[str, Variable] = {
    "rupture_speed": Variable(
        "m/s",
        "largest apparent speed of the front over 2 h_n, beyond waves if a part breaks at once",
    ),
    "median_rupture_speed": Variable("m/s", "median apparent speed of the front over h_n/2"),
}
SPECTRUM = Variable("N", "amplitude spectrum of the moment rate per length", ("frequency",))
NODES_IN_SHORTEST_WAVE = 8.0
"""Number of node spacings in the shortest shear wave of a spectrum."""
FREQUENCIES = 100
SPEED_SPANS = {"rupture_speed": 2.0, "median_rupture_speed": 0.5}
"""Length over which a speed is a mean, in units of h_n."""
BACKWARDS, MONOTONE = 1e-3, 1.0 - 1e-9
"""Part of the time over a window in which the front goes back, from
which on it has no speed, and the weight of a window in which it does
not go back."""
_SCALARS: dict[str, Variable] = {
    "applied_load": Variable("Pa", "load factor applied at the onset"),
    "onset_time": Variable("s", "time from zero load to the onset"),
    "kinetic_stress": Variable("Pa", "mean stress when every node that can break has broken"),
    "stress_drop": Variable("Pa", "critical stress minus kinetic stress"),
    "seismic_moment": Variable("N", "seismic moment per length, G times the integral of slip"),
    "radiated_energy": Variable("J/m", "energy radiated up to the end of the run"),
    "fracture_energy": Variable("J/m", "energy dissipated above the residual strength"),
    "arrested_events": Variable("1", "instabilities that stopped before global sliding"),
    **SPEEDS,
    "start_load": Variable("Pa", "load factor at which the simulation began"),
    "start_error": Variable("Pa", "estimated error of the onset due to the start; 0 from rest"),
    "implicit_steps": Variable("1", "implicit steps taken"),
    "explicit_steps": Variable("1", "explicit steps taken"),
}


def scalars(interface: Interface) -> dict[str, Variable]:
    """Return the additional variables of a run.

    Planes have median speeds along x and y, and no largest speed: the
    apparent speed of a front that arrives at an angle can exceed all
    wave speeds. On a line this happens only if a long part breaks
    almost at once.

    >>> line, plane = (
    ...     scalars(Interface(0.8, 8)),
    ...     scalars(Interface((0.8, 0.8), (8, 8))),
    ... )
    >>> (
    ...     sorted({*line} - {*plane}),
    ...     line["seismic_moment"].units,
    ...     plane["seismic_moment"].units,
    ... )
    (['rupture_speed'], 'N', 'N m')
    >>> line["median_rupture_speed"].dims, plane["median_rupture_speed"].dims
    (('sample',), ('sample', 'direction'))
    """
    variables = {name: per_area(interface, variable) for name, variable in _SCALARS.items()}
    if interface.is_plane:
        del variables["rupture_speed"]
    median = "median_rupture_speed"
    variables[median] = position(interface, variables[median])
    return variables


def rate_spectrum(
    problem: Problem, time: Array, moment_rate: Array
) -> tuple[tuple[Array, Variable], tuple[Array, Variable]]:
    """Return frequencies (Hz) and the amplitude spectrum of a moment rate, N, or N m on a plane.

    The spectrum is the absolute value of int M'(t) exp(-2 pi i f t) dt,
    with straight lines between the times (s), from one period in all to
    the waves that the nodes and times resolve. The spectrum is empty
    with fewer than three times.

    The integral over many points agrees. The times from 1 to 4 s give
    frequencies from 1/3 Hz to 2/3 Hz. Nodes that are 0.1 m apart resolve waves
    up to 4/0.8 = 5 Hz, if the steps are short enough.

    >>> from types import SimpleNamespace
    >>> problem = SimpleNamespace(interface=Interface(0.8, 8))
    >>> problem.solid = SimpleNamespace(shear_wave_speed=4.0)
    >>> time, rate = np.array([1.0, 2.0, 4.0]), np.array([1.0, 3.0, 2.0])
    >>> (f, _), (amplitude, variable) = rate_spectrum(problem, time, rate)
    >>> print(f"{f[0]:.6f} {f[-1]:.6f} {f.size} {variable.units}")
    0.333333 0.666667 100 N
    >>> t = 1.0 + 3.0 * (np.arange(3000) + 0.5) / 3000
    >>> waves = [np.exp(-2j * np.pi * f[i] * t) for i in (0, 60)]
    >>> integrals = [
    ...     abs(3.0 * np.mean(np.interp(t, time, rate) * wave)) for wave in waves
    ... ]
    >>> np.allclose(amplitude[[0, 60]], integrals, rtol=1e-5)
    True
    >>> for count in (3001, 19, 2):  # steps of 1 ms and 1/6 s; too few times
    ...     fine = np.linspace(1.0, 4.0, count)
    ...     (f, _), (amplitude, _) = rate_spectrum(problem, fine, np.ones(count))
    ...     print(f.size, f[-1:].round(6).tolist())
    100 [5.0]
    100 [3.0]
    0 []
    """
    frequencies = np.empty(0)
    if time.size > 2:
        # Waves shorter than a few spacings and changes within a step
        # are not resolved.
        spacing = max(problem.interface.spacings)
        resolved = problem.solid.shear_wave_speed / (NODES_IN_SHORTEST_WAVE * spacing)
        steps = np.diff(time)
        highest = max(min(resolved, 0.5 / float(np.median(steps))), 2.0 / np.ptp(time))
        frequencies = np.geomspace(1.0 / np.ptp(time), highest, FREQUENCIES)
    amplitude = np.empty(frequencies.size)
    for i, omega in enumerate(2.0 * np.pi * frequencies):
        # Integrated twice by parts: a straight line leaves the changes
        # of its slope.
        phases = np.exp(-1j * omega * (time - time[0]))
        ends = moment_rate[0] * phases[0] - moment_rate[-1] * phases[-1]
        bends = np.diff(phases) @ (np.diff(moment_rate) / steps)
        amplitude[i] = abs(ends / (1j * omega) + bends / omega**2)
    variable = per_area(problem.interface, SPECTRUM)
    return (frequencies, Variable("Hz", "frequency", ("frequency",))), (amplitude, variable)


def energy_balance(run: Run, state: RuptureState) -> dict[str, float]:
    """Return the strain, fracture and radiated energy so far, J/m, or J on a plane."""
    return _energies(run, state.slip, state.slip_hat, float(state.now["step"]["work"]))


def _energies(run: Run, slip: Floats, slip_hat: Spectrum, work: float) -> dict[str, float]:
    """Return the energies for a slip, its transform, and the work that the load has done.

    The static strain energy is the sum over modes of K(k)|delta_k|²/2.
    Waves carry away the work minus the work of friction and the strain
    energy. The stress of a slipping node equals its strength, so the
    work of friction follows from the slip alone.

    The strain energy is half the work of K d on the slip d. Slip beyond d_c
    dissipates above the residual strength only drop²/(2 W). The last node
    cannot break.

    >>> from types import SimpleNamespace
    >>> from stiction.elasticity.operator import make_transform
    >>> from stiction.problem.friction import LinearWeakening
    >>> problem = SimpleNamespace(friction=LinearWeakening(weakening_rate=1.0))
    >>> medium = SimpleNamespace(problem=problem)
    >>> medium.grid = SimpleNamespace(transform=make_transform((6,)), cell=0.25)
    >>> medium.grid.stiffness = np.array([[9.0, 1.0, 2.0, 5.0]])
    >>> nodes = SimpleNamespace(
    ...     residual=np.full(6, 2.0), weakening_rate=np.full(6, 4.0)
    ... )
    >>> nodes.peak = np.append(np.full(5, 8.0), np.inf)
    >>> slip = np.array([0.5, 2.0, 0.0, 0.0, 1.0, 0.0])
    >>> run = SimpleNamespace(medium=medium, setting=SimpleNamespace(nodes=nodes))
    >>> energies = _energies(run, slip, np.fft.rfft(slip), 50.0)
    >>> fracture = 0.25 * ((6.0 * 0.5 - 2.0 * 0.25) + 36.0 / 8.0 + (6.0 * 1.0 - 2.0))
    >>> stress = np.fft.irfft(np.fft.rfft(slip) * [0.0, 1.0, 2.0, 5.0], 6)
    >>> strain, residual = 0.5 * 0.25 * slip @ stress, 0.25 * 2.0 * 3.5
    >>> np.allclose(
    ...     [*energies.values()],
    ...     [strain, fracture, 50.0 - strain - fracture - residual],
    ... )
    True
    """
    nodes, grid, friction = run.setting.nodes, run.medium.grid, run.medium.problem.friction
    # Unbreakable nodes have infinite strength and dissipate no energy.
    drop = np.where(np.isfinite(nodes.peak), nodes.peak - nodes.residual, 0.0)
    fracture = friction.dissipated(slip, drop, nodes.weakening_rate)
    share = np.full(grid.transform.half, 2.0)  # a mode includes its conjugate
    share[..., 0] = share[..., -1] = 1.0  # modes without a conjugate
    power = share.ravel()[1:] * grid.stiffness[0, 1:] * np.abs(slip_hat[1:]) ** 2
    strain = float(0.5 * np.sum(power) * grid.cell / np.prod(grid.transform.shape))
    dissipated = float((fracture + nodes.residual * slip).sum()) * grid.cell
    return {
        "strain_energy": strain,
        "fracture_energy": float(fracture.sum()) * grid.cell,
        "radiated_energy": work - dissipated - strain,
    }


def arrested_events(run: Run) -> list[ArrestedEvent]:
    """Return the events in a run so far, with the variables that only inertia provides.

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.methods.dynamics.state import event_type
    >>> def energies(run, slip, slip_hat, work):
    ...     return {"radiated_energy": work + slip_hat[0].real}
    >>> plain = FunctionType(
    ...     arrested_events.__code__, globals() | {"_energies": energies}
    ... )
    >>> record = np.zeros((), event_type(8))
    >>> record["time"], record["node"], record["settled"], record["duration"] = (
    ...     3.0,
    ...     5,
    ...     1,
    ...     0.5,
    ... )
    >>> record["load"], record["work"], record["slip"][1] = (
    ...     (7.0, 8.0),
    ...     (10.0, 14.0),
    ...     0.25,
    ... )
    >>> run = SimpleNamespace(
    ...     medium=SimpleNamespace(interface=Interface(0.8, 8)), events=[record]
    ... )
    >>> ((before, after, known),) = plain(run)
    >>> before.load, after.load, float(after.slip.sum()), float(before.slip.sum())
    (7.0, 8.0, 2.0, 0.0)
    >>> for name, value in known.items():
    ...     print(name, np.round(value, 6).tolist())
    event_time 3.0
    event_settled 1.0
    event_hypocentre [0.5]
    event_duration 0.5
    event_radiated_energy 6.0
    """
    interface, events = run.medium.interface, []
    for record in run.events:
        # The state before the event, and the state after it.
        states, radiated = [], []
        ends = zip(record["slip"], record["load"], record["work"], strict=True)
        for slip, load, work in ends:
            slip_hat = interface.transform(slip.reshape(interface.shape)).ravel()
            radiated.append(_energies(run, slip, slip_hat, work)["radiated_energy"])
            states.append(EquilibriumState(float(load), slip, np.empty(0)))
        known: dict[str, Any] = {
            "event_time": float(record["time"]),
            "event_settled": float(record["settled"]),
            "event_hypocentre": place_of(interface, int(record["node"])),
            "event_duration": float(record["duration"]),
            "event_radiated_energy": radiated[1] - radiated[0],
        }
        events.append(ArrestedEvent(states[0], states[1], known))
    return events


def _speeds(run: Run, state: RuptureState) -> dict[str, list[float]]:
    """Return the speeds of the front, m/s, along each axis on the line through the onset.

    On this plane the front leaves node (5, 9) with 2 m/s along x and 3 m/s
    along y.

    >>> from types import SimpleNamespace
    >>> plane = Interface((32.0, 32.0), (32, 32))
    >>> x, y = (np.abs(np.arange(32.0) - at) for at in (5, 9))
    >>> arrival = (
    ...     np.minimum(x, 32.0 - x)[:, None] / 2.0 + np.minimum(y, 32.0 - y) / 3.0
    ... )
    >>> arrival[np.ix_(x > 0.0, y > 0.0)] = (
    ...     np.nan
    ... )  # only the lines through the node count
    >>> problem = SimpleNamespace(nucleation_lengths=lambda rate: (8.0, 8.0))
    >>> run = SimpleNamespace(
    ...     medium=SimpleNamespace(interface=plane, problem=problem)
    ... )
    >>> run.steepest_weakening_rate = 1.0
    >>> state = SimpleNamespace(arrival=arrival.ravel())
    >>> state.now = {"results": {"onset_node": 5 * 32 + 9}}
    >>> np.round(_speeds(run, state)["median_rupture_speed"], 6).tolist()
    [2.0, 3.0]
    """
    interface = run.medium.interface
    nucleation = run.medium.problem.nucleation_lengths(run.steepest_weakening_rate)
    arrival = state.arrival.reshape(interface.shape)
    began = np.unravel_index(int(state.now["results"]["onset_node"]), interface.shape)
    speeds: dict[str, list[float]] = {name: [] for name in SPEEDS}
    for axis, length in enumerate(nucleation):
        through: Any = (*began[:axis], slice(None), *began[axis + 1 :])
        for name, speed in front_speeds(interface, axis, arrival[through], length).items():
            speeds[name].append(speed)
    return speeds


def _critical_load(run: Run, now: Any) -> float:
    """Return the load, Pa, that carries the critical stress, or NaN after an overstressed start.

    The mean stress 7 Pa is tau_0 2 + 1 Pa. If the run began with stress above
    the strength, a load above the load at the start is still known.

    >>> from types import SimpleNamespace
    >>> def critical(start_load, peak):
    ...     nodes = SimpleNamespace(
    ...         peak=np.array([9.0, peak]), profile=np.array([1.0, 3.0])
    ...     )
    ...     nodes.initial = np.array([0.0, 2.0])
    ...     setting = SimpleNamespace(
    ...         nodes=nodes, mean_initial=1.0, mean_profile=2.0
    ...     )
    ...     now = {"run": {"scale": 10.0, "start_load": start_load}}
    ...     now["results"] = {"onset_stress": 7.0}
    ...     return _critical_load(SimpleNamespace(setting=setting), now)
    >>> critical(3.0, 11.0), critical(2.9, 10.6), critical(3.0, 10.9)
    (3.0, 3.0, nan)
    """
    nodes, margin = run.setting.nodes, 1e-6 * now["run"]["scale"]
    stress = float(now["results"]["onset_stress"])
    # Without slip the mean stress is tau_0 <p> + <tau_i>.
    load = (stress - run.setting.mean_initial) / run.setting.mean_profile
    # An overstressed start breaks at once. No static load carries its stress.
    began = now["run"]["start_load"] * nodes.profile + nodes.initial
    overstressed = bool(np.any(began - nodes.peak > margin))
    return load if not overstressed or load > now["run"]["start_load"] + margin else np.nan


def summary(run: Run, state: RuptureState) -> dict[str, Any]:
    """Return the scalars of a finished run, with NaN for events that did not happen.

    Events that did not happen are NaN. A run to sliding in which not all
    nodes have broken has no onset, but a first instability.

    >>> from types import FunctionType, SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> speeds = {"rupture_speed": [4.0], "median_rupture_speed": [2.0]}
    >>> parts = {"_speeds": lambda run, state: speeds}
    >>> parts["energy_balance"] = lambda run, state: dict(
    ...     radiated_energy=8.0, fracture_energy=6.0
    ... )
    >>> parts["_critical_load"] = lambda run, now: 33.0
    >>> plain = FunctionType(summary.__code__, globals() | parts)
    >>> problem = SimpleNamespace(solid=SimpleNamespace(shear_modulus=3.0))
    >>> problem.interface, diagnostics = Interface(0.8, 8), np.zeros(1, DIAGNOSTICS)
    >>> medium = SimpleNamespace(interface=problem.interface, problem=problem)
    >>> results, run = diagnostics[0]["results"], SimpleNamespace(medium=medium)
    >>> state = SimpleNamespace(now=diagnostics[0], slip=np.full(8, 0.5))
    >>> names = (
    ...     "critical_load",
    ...     "critical_stress",
    ...     "first_instability",
    ...     "critical_position",
    ... )
    >>> names += (
    ...     "onset_time",
    ...     "stress_drop",
    ...     "median_rupture_speed",
    ...     "seismic_moment",
    ... )
    >>> results["first_stress"], results["critical_stress"] = 5.0, 7.0
    >>> results["kinetic_stress"] = 4.0
    >>> results["onset_time"], results["onset_node"] = 0.125, 3
    >>> cases = (0, 1, "rest"), (1, 0, "sliding"), (1, 1, "sliding"), (1, 0, "rest")
    >>> for instabilities, broken, run.stop in cases:
    ...     results["instabilities"], results["all_broken"] = instabilities, broken
    ...     print(*(f"{float(plain(run, state)[name]):.4g}" for name in names))
    nan nan nan nan nan nan nan 1.2
    nan nan 5 0.3 0.125 nan 2 1.2
    33 7 5 0.3 0.125 3 2 1.2
    33 7 5 0.3 0.125 nan 2 1.2
    """
    interface, now = run.medium.interface, state.now
    results = now["results"]
    unstable, broken = results["instabilities"] > 0, bool(results["all_broken"])
    # In a run to sliding, or to an end time, the interface may have survived.
    failed = unstable and (broken or run.stop not in ("sliding", "time"))
    critical = float(results["critical_stress"]) if failed else np.nan
    kinetic = float(results["kinetic_stress"]) if broken else np.nan
    node = np.unravel_index(int(results["onset_node"]), interface.shape)
    energies = energy_balance(run, state)
    values: dict[str, Any] = {
        "critical_load": _critical_load(run, now) if failed else np.nan,
        "critical_stress": critical,
        "first_instability": float(results["first_stress"]) if unstable else np.nan,
        "critical_position": [i * h for i, h in zip(node, interface.spacings, strict=True)],
        "applied_load": float(results["onset_load"]) if unstable else np.nan,
        "onset_time": float(results["onset_time"]) if unstable else np.nan,
        "kinetic_stress": kinetic,
        "stress_drop": critical - kinetic,
        "seismic_moment": moment_of(run.medium.problem, state.slip),
        "arrested_events": int(results["arrested_events"]),
        **_speeds(run, state),
        **{name: energies[name] for name in ("radiated_energy", "fracture_energy")},
        **{name: float(now["run"][name]) for name in ("start_load", "start_error")},
        **{name: int(now["stepping"][name]) for name in ("implicit_steps", "explicit_steps")},
    }
    for name in ("critical_position", *SPEEDS):
        # A number on a line, and on a plane a number along x and a
        # number along y.
        along = np.where(unstable, values[name], np.nan)
        values[name] = along if interface.is_plane else along[0]
    if interface.is_plane:
        del values["rupture_speed"]  # see `scalars`
    return values


def front_speeds(
    interface: Interface, axis: int, arrival: Floats, nucleation: float
) -> dict[str, float]:
    """Return the speeds of a front along a line of nodes (m/s, or NaN).

    The names are the names in `SPEEDS`. `arrival` holds the arrival
    times (s) along `axis`, and `nucleation` is the nucleation length
    (m).

    The front passes 16 nodes at 3 m/s, and others at 1 m/s. Over 32 m, a quarter
    of the line, it takes at least 16 + 16/3 s. Over 2 h_n = 16 m it takes 16/3 s.

    >>> steps = np.where(
    ...     (np.arange(127) >= 40) & (np.arange(127) < 56), 1.0 / 3.0, 1.0
    ... )
    >>> arrival = np.append(0.0, np.cumsum(steps))
    >>> for length in (20.0, 8.0):
    ...     speeds = front_speeds(Interface(128.0, 128), 0, arrival, length)
    ...     print(
    ...         f"{speeds['rupture_speed']:.6f} {speeds['median_rupture_speed']:.6f}"
    ...     )
    1.500000 1.000000
    3.000000 1.000000

    In a specimen, fronts do not pass from one end to the other, where they
    would be faster here.

    >>> arrival = (np.arange(128) + 64.0) % 128 + np.where(
    ...     np.arange(128) < 64, -0.9, 0.0
    ... )
    >>> for ends in ("periodic", "free"):
    ...     interface = Interface(128.0, 128, ends=ends)
    ...     print(
    ...         f"{front_speeds(interface, 0, arrival, 16.0)['rupture_speed']:.6f}"
    ...     )
    1.028939
    1.000000
    >>> front_speeds(interface, 0, np.full(128, np.nan), 16.0)[
    ...     "median_rupture_speed"
    ... ]
    nan
    """
    spacing, longest = interface.spacings[axis], 0.25 * interface.lengths[axis]
    front = {}
    for name, lengths in SPEED_SPANS.items():
        window = min(max(lengths * nucleation, 8.0 * spacing), longest)
        times = arrival
        if interface.is_free:  # fronts do not pass from one end to the other
            times = np.append(arrival, np.full(round(window / spacing), np.nan))
        speeds, weights = rupture_speed(times, spacing, window)
        kept = np.flatnonzero(weights >= (MONOTONE if name == "rupture_speed" else 1e-9))
        kept = kept[np.argsort(speeds[kept])]
        below = np.cumsum(weights[kept]) - 0.5 * weights[kept]
        # The largest speed, or the median as a continuous function of the weights.
        place = np.inf if name == "rupture_speed" else 0.5 * weights[kept].sum()
        front[name] = float(np.interp(place, below, speeds[kept])) if kept.size else np.nan
    return front


def rupture_speed(arrival: Floats, spacing: float, window: float) -> tuple[Floats, Floats]:
    """Return the apparent speed of a front at each node on a line, m/s, or NaN, and its weight.

    `arrival` (s) is periodic, and NaN at nodes that the front did not
    reach. The speed is a mean over `window` (m). Its weight is 1 if the
    arrival is monotone over the window, and falls to 0 if the front goes
    back for the part `BACKWARDS` of the time. This excludes places where
    patches begin or fronts meet.

    Over two spacings, the front takes 2 s at node 1 and 3 s at node 3. At nodes
    0 and 7 it goes back. At node 4 it was not seen on one side.

    >>> arrival = np.array([0.0, 1.0, 2.0, 4.0, 5.0, np.nan, 8.0, 9.0])
    >>> speeds, weights = rupture_speed(arrival, 1.0, 2.0)
    >>> speeds.round(4).tolist(), weights.round(4).tolist()
    ([nan, 1.0, 0.6667, 0.6667, nan, nan, nan, nan], [0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0])

    The front goes back for 0.5 ms in 1 s, half as long as it may.

    >>> arrival[1:4] = 3.0, 2.9995, 4.0
    >>> _, weights = rupture_speed(arrival, 1.0, 2.0)
    >>> round(float(weights[2]), 4)
    0.5
    >>> rupture_speed(arrival, 1.0, 8.0)[1].tolist() == [
    ...     0.0
    ... ] * 8  # a window of the whole line
    True
    """
    # A window over more than the line would compare a front with itself.
    half = max(1, round(0.5 * window / spacing))
    if 2 * half >= arrival.size:
        return np.full(arrival.shape, np.nan), np.zeros(arrival.shape)
    wrapped = np.concatenate([arrival[-half:], arrival, arrival[:half]])
    steps = np.lib.stride_tricks.sliding_window_view(np.diff(wrapped), 2 * half)
    times = np.abs(wrapped[2 * half :] - wrapped[: -2 * half])
    back = np.maximum(0.5 * (np.abs(steps).sum(axis=1) - times), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        weight = np.nan_to_num(np.maximum(1.0 - back / (BACKWARDS * times), 0.0))
        return np.where(weight > 0.0, 2 * half * spacing / times, np.nan), weight

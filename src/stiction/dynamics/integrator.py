"""One run: explicit steps and implicit steps, and the switch between them."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from numpy.typing import NDArray

from stiction.dynamics import monitor
from stiction.dynamics.arrays import ExplicitTables, Fields, ImplicitTables, Setting
from stiction.dynamics.discretization import Medium
from stiction.dynamics.energies import fracture_energy
from stiction.dynamics.explicit import explicit_steps
from stiction.dynamics.implicit import implicit_steps
from stiction.dynamics.implicit_tables import make_tables
from stiction.dynamics.loading import History, load_at
from stiction.dynamics.memory_layout import (
    carry_memory,
    empty_memory,
    explicit_tables,
    scale_memory,
)
from stiction.dynamics.scale import follow_scale
from stiction.friction import FrictionLaw
from stiction.friction.kernels import strengths

Floats = NDArray[np.float64]

_OVERSTRESSED = 1e-6  # of the stress scale: above the strength by so much, slip begins with waves

NOTHING = np.empty((0, monitor.COLUMNS))


@dataclasses.dataclass(eq=False)
class State:
    """Everything that changes in a run; two runs from equal states are the same run, bit by bit.

    Attributes
    ----------
    slip, rate, stress : (nodes,) arrays
        m, m/s, Pa; flat, also on a plane.
    slip_hat : (modes,) complex array
        Real transform of the slip.
    past : (nodes,) array
        Mean slip rate in the last implicit step, m/s.
    memory : flat array
        Memory variables as in `memory_layout`: psi/B while explicit, psi while implicit.
    carried : flat array
        The memory's part of the next explicit step.
    arrival : (nodes,) array
        When half of the strength was lost, s; nan before.
    watch : (monitor.FIELDS,) array
        Time, load, work of the load, peaks, events, counts.
    explicit : bool
        Which kind of step comes next.
    step : float
        Size that the next implicit step tries, s.
    """

    slip: Floats
    rate: Floats
    stress: Floats
    slip_hat: NDArray[np.complex128]
    past: Floats
    memory: Floats
    carried: Floats
    arrival: Floats
    watch: Floats
    explicit: bool
    step: float

    @property
    def fields(self) -> Fields:
        """The arrays, as compiled steps take them."""
        return Fields(
            self.slip, self.rate, self.stress, self.slip_hat, self.past, self.memory, self.carried,
            self.arrival, self.watch,
        )  # fmt: skip

    @property
    def time(self) -> float:
        """s."""
        return float(self.watch[monitor.TIME])

    @property
    def load(self) -> float:
        """tau_0, Pa."""
        return float(self.watch[monitor.LOAD])

    @property
    def mean_stress(self) -> float:
        """Mean shear stress on the interface, Pa."""
        return float(self.watch[monitor.MEAN_STRESS])

    @property
    def steps(self) -> int:
        """Steps taken so far, of both kinds."""
        return int(self.watch[monitor.EXPLICIT_STEPS] + self.watch[monitor.IMPLICIT_STEPS])


@dataclasses.dataclass(eq=False)
class Run:
    """One interface under one load history: what does not change in a run, and tables of steps.

    Attributes
    ----------
    medium : Medium
    friction : FrictionLaw
    setting : Setting
    steepest_rate : float
        Largest rate, Pa/m, at which a node that may break weakens at any slip.
    least_load : float
        Load below which nothing runs away: the mean strength of the weakest nodes that make up
        half a nucleation length, Pa. A few nodes of next to no strength do not count, nor do
        nodes that do not weaken.
    tables : ExplicitTables, ImplicitTables or None
        Of the kind of step that was taken last: one kind at a time is enough, and they are large.
    """

    medium: Medium
    friction: FrictionLaw
    setting: Setting
    steepest_rate: float
    least_load: float
    tables: ExplicitTables | ImplicitTables | None = None

    @property
    def control(self) -> Floats:
        """Thresholds, see `monitor`."""
        return self.setting.control

    @property
    def history(self) -> History:
        """Times (s) and values (Pa) of the load."""
        return self.setting.load_times, self.setting.load_values

    def elastic_stress(self, slip_hat: NDArray[np.complex128], load: float) -> Floats:
        """Static stress of a slip at a load, Pa: what an interface at rest carries."""
        grid, nodes = self.medium.grid, self.setting.nodes
        interface = self.medium.interface
        stress_hat = (-grid.stiffness[0] * slip_hat).reshape(interface.wavenumbers.shape)
        shared: Floats = interface.inverse_transform(stress_hat).ravel()
        return shared + load * nodes.profile + nodes.initial

    @functools.cached_property
    def toughest(self) -> float:
        """Largest fracture energy, J/m²: infinite if there are barriers that never break."""
        nodes = self.setting.nodes
        if not np.all(np.isfinite(nodes.strength)):
            return np.inf
        return float(fracture_energy(self.friction, nodes.critical, nodes).max())

    def scale_at(self, load: float) -> float:
        """Stress scale of a load, at least of the earliest at which anything may run away, Pa."""
        setting = self.setting
        return float(load_at(setting.scale_loads, setting.scales, max(load, self.least_load)))

    def strength_after(self, slip: Floats) -> Floats:
        """Strength after a slip (m), Pa."""
        nodes = self.setting.nodes
        found: Floats = strengths(
            self.setting.law, nodes.strength, nodes.residual, nodes.weakening, slip
        )
        return found

    @property
    def first_load(self) -> float:
        """Load at which the first node reaches its strength, if nothing has slipped, Pa."""
        nodes = self.setting.nodes
        return float(np.min((nodes.strength - nodes.initial) / nodes.profile))

    def start(self, time: float, slip: Floats | None = None) -> State:
        """State of rest (or of an equilibrium with this slip) at a time, with an empty memory.

        Where the stress is above the strength by more than round-off, explicit steps come first.
        """
        interface, nodes, setting = self.medium.interface, self.setting.nodes, self.setting
        delta = np.zeros(interface.size)
        if slip is not None:
            delta = np.array(slip, dtype=np.float64).ravel()
        memory, carried = empty_memory(self.medium.grid)
        watch = np.zeros(monitor.FIELDS)
        load = float(load_at(*self.history, time))
        slip_hat = interface.transform(delta.reshape(interface.shape)).ravel()
        stress = self.elastic_stress(slip_hat, load)
        limit = self.strength_after(delta)
        rate = np.maximum(stress - limit, 0.0) / self.medium.impedance
        # A node that has just reached its strength has not begun to slip: drop round-off.
        rate[rate * self.medium.impedance < 1e-12 * nodes.strength] = 0.0
        stress = stress - self.medium.impedance * rate
        watch[monitor.TIME], watch[monitor.LOAD] = time, load
        watch[monitor.START_LOAD] = load
        watch[monitor.MEAN_STRESS] = watch[monitor.PEAK_STRESS] = stress.mean()
        watch[monitor.LOCAL_STRESS] = stress.mean()
        watch[monitor.LOCAL_RADIATED] = self.medium.impedance * rate.mean()
        watch[monitor.PEAK_TIME], watch[monitor.PEAK_LOAD] = time, load
        watch[monitor.PEAK_NODE] = int(np.argmax(stress - limit))
        watch[monitor.FIRST_STRESS] = watch[monitor.KINETIC] = -np.inf  # not yet
        watch[monitor.BAD_NODE] = -1.0
        least = max(load, self.least_load)
        scale = follow_scale(watch, setting.control, setting.scale_loads, setting.scales, least)
        watch[monitor.TOP_RATE] = rate.max()
        watch[monitor.SLID] = np.count_nonzero(delta >= nodes.critical)
        half = self.control[monitor.ARRIVAL] * nodes.critical
        arrival = np.where((delta > 0.0) & (delta >= half), time, np.nan)
        size = self.control[monitor.SMALLEST_STEP]
        slope = self.slope(time)
        first = 0.1 * self.control[monitor.LOAD_STEP] * scale / slope if slope > 0.0 else size
        return State(
            slip=delta,
            rate=rate,
            stress=stress,
            slip_hat=slip_hat,
            past=rate.copy(),
            memory=memory,
            carried=carried,
            arrival=arrival,
            watch=watch,
            explicit=bool(
                self.control[monitor.EXPLICIT_ONLY] > 0.0
                or self.medium.impedance * rate.max() > _OVERSTRESSED * scale
            ),
            step=min(max(size, first), self.control[monitor.LARGEST_STEP]),
        )

    def slope(self, time: float) -> float:
        """Size of the loading rate just after a time, Pa/s."""
        times, values = self.history
        i = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, times.size - 2))
        return float(abs(values[i + 1] - values[i]) / (times[i + 1] - times[i]))

    def ended(self, state: State) -> bool:
        """Whether the end time is reached, up to the rounding of a sum of many steps."""
        return bool(self.control[monitor.END_TIME] - state.time <= 1e-6 * self.medium.step)

    def resting(self, state: State) -> bool:
        """Whether nothing slips and the load, beyond its last piece, never rises again."""
        times, values = self.history
        return bool(
            not state.explicit
            and state.time >= times[-1]
            and values[-1] <= values[-2]
            and self.medium.impedance * state.rate.max()
            <= self.control[monitor.RESIDUAL] * state.watch[monitor.SCALE]
        )

    def _to_explicit(self, state: State) -> None:
        grid, tables = self.medium.grid, self._explicit_tables()
        scale_memory(grid, state.memory, tables.step, divide=True)
        carry_memory(state.memory, tables.table, state.carried, grid.poles.size, grid.copies)
        state.explicit = True
        state.watch[monitor.CALM_STEPS] = 0.0
        state.watch[monitor.CALM_TOP] = state.rate.max()

    def _to_implicit(self, state: State) -> None:
        scale_memory(self.medium.grid, state.memory, self.medium.step, divide=False)
        state.explicit = False
        state.past = state.rate.copy()
        state.watch[monitor.PAST_STEP] = 0.0  # the first implicit step is one of first order
        state.watch[monitor.RADIATED] = self.medium.impedance * state.rate.mean()
        state.step = 2.0 * float(self.control[monitor.SMALLEST_STEP])

    def _explicit_tables(self) -> ExplicitTables:
        if not isinstance(self.tables, ExplicitTables):
            self.tables = None  # let go of the others before these are made
            medium = self.medium
            self.tables = explicit_tables(medium.grid, medium.step, *medium.step_table())
        return self.tables

    def _implicit_tables(self) -> ImplicitTables:
        if not isinstance(self.tables, ImplicitTables):
            self.tables = None
            self.tables = make_tables(self.medium.grid)
        return self.tables

    def advance(self, state: State, count: int, record: Floats = NOTHING) -> tuple[int, int]:
        """Take up to `count` steps in place; return (steps taken, why it returned).

        The reason is DONE after `count` steps or at the end time, else ALL_SLID, DROPPED, AT_REST
        or NOT_FINITE of `monitor`. Rows of `record` are filled, one a step.
        """
        taken = 0
        while taken < count:
            part = record[taken:] if record.shape[0] else NOTHING
            if state.explicit:
                fresh, reason = self._explicit(state, count - taken, part)
            else:
                fresh, reason = self._implicit(state, count - taken, part)
            taken += fresh
            if reason == monitor.TO_EXPLICIT:
                self._to_explicit(state)
            elif reason == monitor.TO_IMPLICIT:
                self._to_implicit(state)
            elif reason != monitor.DONE or taken >= count:
                return taken, reason
            elif self.ended(state):
                return taken, monitor.DONE
        return taken, monitor.DONE

    def _explicit(self, state: State, count: int, record: Floats) -> tuple[int, int]:
        medium = self.medium
        left = self.control[monitor.END_TIME] - state.time
        if left < count * medium.step:
            count = min(count, max(1, int(np.ceil(left / medium.step - 1e-6))))
        taken, reason = explicit_steps(
            count, state.fields, medium.grid, self.setting, self._explicit_tables(), record
        )
        return int(taken), int(reason)

    def _implicit(self, state: State, count: int, record: Floats) -> tuple[int, int]:
        taken, size, reason = implicit_steps(
            count, state.step, state.fields, self.medium.grid, self.setting,
            self._implicit_tables(), record,
        )  # fmt: skip
        state.step = float(size)
        return int(taken), int(reason)

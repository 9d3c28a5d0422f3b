"""What a rupture consists of: what stays, what changes, and what is watched at every step.

Fields of the interface and their transforms are flat, whatever its shape; `Grid.transform` knows
the shape. Modes q = 0, 1, ... are those of the real transform in its order, q = 0 the mean.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.elasticity.operator import Transform

Ints = NDArray[np.int64]
Spectrum = NDArray[np.complex128]
Floats = NDArray[np.float64]
History = tuple[Floats, Floats]
"""Times (s) and values of what is straight in between."""

DONE, ALL_SLID, TO_EXPLICIT, TO_IMPLICIT, NOT_FINITE, DROPPED, AT_REST = range(7)
"""Why a compiled loop of steps returned."""

RECORD = ("time", "load", "mean_stress", "mean_slip", "top_slip_rate", "size", "work")
"""Columns of the record of every step; each station adds slip, slip rate and stress."""

DIAGNOSTICS = np.dtype(
    [
        ("time", "f8"),  # s
        ("load", "f8"),  # tau_0, Pa
        ("work", "f8"),  # of the load on the slip, J/m
        ("mean_stress", "f8"),  # Pa, as all stresses here
        ("peak_stress", "f8"),  # largest mean stress so far, and when, at what load and where
        ("peak_time", "f8"),
        ("peak_load", "f8"),
        ("peak_node", "i8"),
        ("local_stress", "f8"),  # last local maximum of the mean stress
        ("local_radiated", "f8"),  # Z <V> there
        ("in_event", "i8"),  # whether the mean stress has fallen from there by `event_drop`
        ("event_rate", "f8"),  # largest slip rate since then, m/s
        ("first_stress", "f8"),  # mean stress at the first instability; -inf before
        ("arrested", "i8"),  # instabilities that have stopped
        ("kinetic_stress", "f8"),  # mean stress when all that can break had broken; -inf before
        ("top_rate", "f8"),  # largest slip rate, m/s
        ("slid", "i8"),  # nodes at the residual strength
        ("bad_node", "i8"),  # first node whose slip rate became non-finite; -1 if none
        ("step", "f8"),  # size of the last step, s
        ("past_step", "f8"),  # of the last implicit step; 0 before the first one
        ("radiated", "f8"),  # Z <V> after the last implicit step
        ("explicit_steps", "i8"),
        ("implicit_steps", "i8"),
        ("rejected_steps", "i8"),
        ("calm_steps", "i8"),  # in a row, and the largest slip rate when the row began, m/s
        ("calm_rate", "f8"),
        ("scale", "f8"),  # stress scale of the largest load so far
        ("event_drop", "f8"),  # fall of the mean stress that counts as an event
        ("peak_width", "f8"),  # so close below its maximum the mean stress still is at it
        ("start_load", "f8"),  # where the run began, and what that may cost
        ("start_error", "f8"),
    ]
)
"""What is watched at every step: one record, which compiled steps and checkpoints share."""


class Thresholds(NamedTuple):
    """When steps change or end; stresses in units of the stress scale.

    Attributes
    ----------
    slid_stop : float
        Nodes at the residual strength at which to return.
    event_stop, rest_stop : bool
        Return at an event; when all is at rest after an event.
    end_time : float
        s.
    breakable : int
        Nodes that can break at all.
    calm_stress, calm_slip, steady_stress, calm_count : float
        A step is calm if the fastest node radiates less than Z V = `calm_stress`, or slips less
        than `calm_slip` (m/Pa) times the rise of the load, or less than `steady_stress` if V has
        not changed by a factor of 2; after so many in a row, implicit steps take over.
    slip_step, small_drop : float
        Loss of strength of a node in one implicit step, in units of tau_p - tau_r, which counts
        as `small_drop` where it is less.
    load_step : float
        Largest rise of the load in one implicit step.
    smallest_step, largest_step : float
        Of implicit steps, s; below it explicit steps take over.
    residual : float
        Stress at which an implicit step counts as solved.
    event_drop : float
        Fall of the mean stress that begins an event.
    unstable_rate : float
        Slip rate, m/s, that only an instability reaches.
    noticed, growth : float
        Z <V> from which its growth in one implicit step is limited, and the factor.
    peak_width : float
        So close below its maximum the mean stress still is at it.
    negligible : float
        Rise of the load in a step for which growth does not matter.
    arrival : float
        Slip at which a front has arrived, in units of that at the residual strength.
    curved : bool
        Whether a friction law is other than linear, whose pieces are met to the bit.
    explicit_only : bool
    """

    slid_stop: float
    event_stop: bool
    rest_stop: bool
    end_time: float
    breakable: int
    calm_stress: float
    calm_slip: float
    steady_stress: float
    calm_count: int
    slip_step: float
    small_drop: float
    load_step: float
    smallest_step: float
    largest_step: float
    residual: float
    event_drop: float
    unstable_rate: float
    noticed: float
    growth: float
    peak_width: float
    negligible: float
    arrival: float
    curved: bool
    explicit_only: bool


class Grid(NamedTuple):
    """Elastic half-spaces on a grid. Read-only, shared by threads.

    Attributes
    ----------
    transform : Transform
    impedance : float
        Z = G/(2 c_s), Pa s/m.
    cell : float
        What a node stands for: dx (m), on a plane dx dy (m²).
    stiffness : (2, modes) array
        Static stiffness K(k) and G|k|/2, Pa/m; zero for the mean.
    entry, place : (modes,) int arrays
        Which entry of the tables a mode uses, and where its real part is in packed arrays; see
        `memory`.
    copies : int
        Modes that share one entry of the tables: 2 on a plane, kx and -kx, else 1.
    frequency : (entries,) array
        |k| c_s of each entry, rad/s.
    mode_two : (entries,) array
        How much of it is mode II, (kx/k)²; 1 on a line, whatever its mode.
    poles, weights : (pairs,) complex arrays
        Of the sums of exponentials: first those that weigh with `mode_two`, then, on a plane,
        those of mode III, which weigh with 1 - mode_two.
    split : int
        How many of the pairs weigh with `mode_two`.
    """

    transform: Transform
    impedance: float
    cell: float
    stiffness: Array
    entry: Ints
    place: Ints
    copies: int
    frequency: Array
    mode_two: Array
    poles: Spectrum
    weights: Spectrum
    split: int


class Nodes(NamedTuple):
    """What differs between nodes and does not change in a run, each (nodes,).

    Attributes
    ----------
    strength, residual : arrays
        tau_p (infinite where nothing breaks) and tau_r, Pa.
    weakening : array
        W at zero slip, Pa/m.
    critical : array
        Slip from which on a node counts as at its residual strength, m.
    profile : array
        p (1).
    initial : array
        tau_i, Pa.
    """

    strength: Array
    residual: Array
    weakening: Array
    critical: Array
    profile: Array
    initial: Array


class Setting(NamedTuple):
    """What drives and holds an interface, and how it is stepped. Does not change in a run.

    Attributes
    ----------
    law : NamedTuple
        ``friction.parameters``.
    nodes : Nodes
    mean_profile, mean_initial : float
        <p>, <tau_i> (Pa).
    load_times, load_values : arrays
        Load history, s and Pa.
    turns : array
        Times at which the load begins to fall or to rise again, s.
    scale_loads, scales : arrays
        Stress scale against the load, Pa.
    thresholds : Thresholds
    stations : array of int
        Nodes whose slip, slip rate and stress the record of steps holds.
    """

    law: Any
    nodes: Nodes
    mean_profile: float
    mean_initial: float
    load_times: Array
    load_values: Array
    turns: Array
    scale_loads: Array
    scales: Array
    thresholds: Thresholds
    stations: Ints


class State(NamedTuple):
    """What changes in a run; two runs from equal states are the same run, bit by bit.

    Attributes
    ----------
    slip, rate, stress : (nodes,) arrays
        m, m/s, Pa; flat, also on a plane.
    slip_hat : (modes,) complex array
        Real transform of the slip.
    past : (nodes,) array
        Mean slip rate in the last implicit step, m/s.
    memory : flat array
        Memory variables as in `memory`: psi/B while explicit, psi while implicit.
    carried : flat array
        The memory's part of the next explicit step.
    arrival : (nodes,) array
        When the front arrived, s; nan before.
    diagnostics : (1,) array of DIAGNOSTICS
    phase : (2,) array
        1 if explicit steps come next, else 0; size that the next implicit step tries, s.
    """

    slip: Floats
    rate: Floats
    stress: Floats
    slip_hat: Spectrum
    past: Floats
    memory: Floats
    carried: Floats
    arrival: Floats
    diagnostics: NDArray[Any]
    phase: Floats

    @property
    def now(self) -> Any:
        """The record of `diagnostics`, by its names."""
        return self.diagnostics[0]

    @property
    def explicit(self) -> bool:
        """Whether explicit steps come next."""
        return bool(self.phase[0])

    @property
    def steps(self) -> int:
        """Steps taken so far, of both kinds."""
        return int(self.now["explicit_steps"] + self.now["implicit_steps"])


class ExplicitTables(NamedTuple):
    """Of one fixed explicit step h, with arrays to work in.

    Attributes
    ----------
    step : float
        h, s.
    table : flat array
        [block][pair][4][64]: E = exp(s |k| c_s h) and w E B, B = h phi(s |k| c_s h); the memory
        is kept as psi/B.
    fresh : (modes,) array
        Re sum_p w B, weight of the current slip rate, s.
    """

    step: float
    table: Array
    fresh: Array
    packed: Array
    rate_hat: Spectrum
    shared: Spectrum
    moved: Array
    guess: Array


class ImplicitTables(NamedTuple):
    """Of an implicit step of some size, with arrays to work in; belongs to one run.

    Attributes
    ----------
    made : (2,) array
        Size (s) and share of the last step that `table` and `symbol` are for; -1 if none.
    table, ramp : flat arrays
        See `memory.tabulate`.
    fresh, fresh_ramp : (entries,) arrays
    symbol, inverse : (modes,) arrays
        Eigenvalues of the matrix of a step, Pa/m, and their inverses.
    carried, past_hat, rate_hat, work : (modes,) complex arrays
    pushed, increment, driving, falling, residual, direction, product, other : (nodes,) arrays
    slipping : (nodes,) int array
        0 stuck, 1 slipping.
    packed, others : arrays in packed order, see `memory`
    sums : (2, 128) array
    """

    made: Array
    table: Array
    ramp: Array
    fresh: Array
    fresh_ramp: Array
    symbol: Array
    inverse: Array
    carried: Spectrum
    past_hat: Spectrum
    rate_hat: Spectrum
    work: Spectrum
    pushed: Array
    increment: Array
    driving: Array
    falling: Array
    residual: Array
    direction: Array
    product: Array
    other: Array
    slipping: Ints
    packed: Array
    others: Array
    sums: Array

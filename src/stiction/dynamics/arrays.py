"""What compiled steps work on: groups of arrays, as kernels take them.

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
    slot, place : (modes,) int arrays
        Which entry of the tables a mode uses, and where its real part is in packed arrays; see
        `memory_layout`.
    copies : int
        Modes that share one entry of the tables: 2 on a plane, kx and -kx, else 1.
    pace : (slots,) array
        |k| c_s of each entry, rad/s.
    share : (slots,) array
        How much of it is mode II, (kx/k)²; 1 on a line, whatever its mode.
    poles, weights : (pairs,) complex arrays
        Of the sums of exponentials: first those that weigh with `share`, then, on a plane, those of
        mode III, which weigh with 1 - share.
    split : int
        How many of the pairs weigh with `share`.
    """

    transform: Transform
    impedance: float
    cell: float
    stiffness: Array
    slot: Ints
    place: Ints
    copies: int
    pace: Array
    share: Array
    poles: Spectrum
    weights: Spectrum
    split: int


class Fields(NamedTuple):
    """What changes in a run; see `integrator.State`."""

    slip: Array
    rate: Array
    stress: Array
    slip_hat: Spectrum
    past: Array
    memory: Array
    carried: Array
    arrival: Array
    watch: Array


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
    control : (monitor.CONTROLS,) array
        Thresholds.
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
    control: Array
    stations: Ints


class ExplicitTables(NamedTuple):
    """Of one fixed explicit step h, with room to work.

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
    """Of an implicit step of some size, with room to work; belongs to one run.

    Attributes
    ----------
    made : (2,) array
        Size (s) and share of the last step that `table` and `symbol` are for; -1 if none.
    table, tilt : flat arrays
        See `implicit_tables.tabulate`.
    fresh, turn : (slots,) arrays
    symbol, inverse : (modes,) arrays
        Eigenvalues of the matrix of a step, Pa/m, and their inverses.
    carried, past_hat, rate_hat, work : (modes,) complex arrays
    pushed, increment, driving, falling, residual, direction, product, other : (nodes,) arrays
    state : (nodes,) int array
        0 stuck, 1 slipping.
    packed, others : arrays in packed order, see `memory_layout`
    """

    made: Array
    table: Array
    tilt: Array
    fresh: Array
    turn: Array
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
    state: Ints
    packed: Array
    others: Array

"""Memory of past slip rates: memory variables for each mode, and their time steps.

Problem
-------
Past slip rates V of a mode k transfer the stress (G|k|/2) S, with the
convolution

    S(t) = int_0^t C(|k| c_s t') V(t - t') dt',   C(T) = Re sum_p w_p exp(s_p T).  (1)

It is therefore enough to store a memory variable for each pair (s_p,
w_p) and mode,

    psi_p(t) = int_0^t exp(s_p |k| c_s t') V(t - t') dt',   S = Re sum_p w_p psi_p.  (2)

The real and the imaginary part of V are two real signals. Each signal
has a complex psi_p. On a plane the pairs before `Grid.split` have the
weight (kx/k)² w_p. The pairs of mode III follow, with the weight (1 -
(kx/k)²) w_p.

Algorithm
---------
The method is exponential time differencing (S. M. Cox and P. C.
Matthews, Journal of Computational Physics 176, 2002): psi' = z/h psi +
V is integrated exactly if the slip rate is a polynomial in a step h.
With z = s_p |k| c_s h, E = exp(z), and phi(z) = (exp(z) - 1)/z:

1. Explicit step, constant slip rate V: psi <- E psi + B V, with B = h
   phi(z). The variables are stored as y = psi/B, which saves a
   multiplication in each pass:

       y <- E y + V,   and for the next step at once   Re sum_p w_p E B y  (3)

   (`advance_memory`). The sum is the part of S at the end of the next
   step that is already known. The slip rate of that step adds V Re
   sum_p w_p B (`response` of `step_table`).
2. Implicit step, slip rate V + a (t - h/2) for 0 < t < h. The variables
   are stored as psi:

       psi <- E psi + B V + R a,   R = int_0^h exp(s_p |k| c_s (h - t)) (t - h/2) dt  (4)

   (`advance_with_ramp`, with the tables of `tabulate`). Before that
   `fading_memory` sums Re sum_p w_p E psi, the part of S at the end of
   the step that is already known.
3. Between the two types of steps, `to_explicit` divides by B and
   `to_implicit` multiplies by B. Both set `Phase`, which states the
   form of `RuptureState.memory`.

Layout
------
Variables lie in blocks of 64 modes, so that the sums of a pass stay in
registers. Tables have an entry for each wave vector with different
waves: on a line k > 0, on a plane kx >= 0 and ky >= 0, because (kx, ky)
and (-kx, ky) have the same |k| and fraction of mode II. On a plane an
entry therefore has multiplicity 2. Entries are padded to whole blocks.
Tables are packed as [block][pair][row][64], Fourier arrays as
[block][copy][real, imaginary][64] and memory variables as
[block][copy][pair][4][64]. The four rows hold the memory of the real
signal (real and imaginary part), and then the memory of the imaginary
signal. Because the row length is constant, the compiler can vectorise
without run-time checks for overlap.

Example by hand
---------------
A line of two nodes has one mode with memory. Let |k| c_s = 1/s, with a
single pair s = -1 and w = 1. A step of h = log 2 has E = 1/2 and B =
1 - E = 1/2. At a slip rate of 1 m/s, (2) is psi = 1 - exp(-t) metres:
1/2 after a step, and 3/4 after two. The explicit steps store y = psi/B,
1 and 3/2, and w E B y, 1/4 and 3/8. With the response w B = 1/2, the
next steps end with S = 1/4 + 1/2 = 3/4, and S = 3/8 + 1/2 = 7/8:

>>> import numba
>>> from stiction.elasticity.operator import make_transform
>>> unit, (entry, offset, multiplicity) = np.ones(1), offsets((2,))
>>> constants = (
...     make_transform((2,)),
...     1.0,
...     1.0,
...     np.zeros((2, 2)),
...     entry,
...     offset,
...     multiplicity,
... )
>>> grid = Grid(*constants, unit, unit, -unit + 0j, unit + 0j, 1)
>>> table, response = step_table(grid, np.log(2.0))
>>> y, memory_sum = empty_memory(grid)
>>> V = zeros(TWO_ROWS)
>>> V[0] = 1.0
>>> advance = numba.njit(lambda *arguments: advance_memory(*arguments))
>>> for _ in range(2):
...     advance(y, table, V, memory_sum, 1, 1)
...     print(f"{y[0]:g} {memory_sum[0]:g} {memory_sum[0] + response[1]:g}")
1 0.25 0.75
1.5 0.375 0.875
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit_inside
from stiction.methods.dynamics.state import (
    ExplicitTables,
    Floats,
    Grid,
    ImplicitTables,
    Ints,
    Phase,
    RuptureState,
    SlipProblem,
    Spectrum,
)

ENTRIES = 64
"""Number of entries in a block of the memory, which a pass processes together."""
TWO_ROWS, THREE_ROWS, FOUR_ROWS = 2 * ENTRIES, 3 * ENTRIES, 4 * ENTRIES
"""Numbers in two, three and four rows of a block."""
CACHE_LINE = 64
"""Bytes in a line of the processor's cache."""


def phi(z: Spectrum) -> Spectrum:
    """Return (exp(z) - 1)/z, also for small z.

    >>> z = np.array([9e-4, 1.1e-3, -0.5, 2j])
    >>> (
    ...     bool(np.abs(phi(z) - np.expm1(z) / z).max() < 1e-15),
    ...     phi(np.zeros(1)).tolist(),
    ... )
    (True, [1.0])
    """
    small = np.abs(z) < 1e-3
    series = 1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0 * (1.0 + z / 5.0)))
    # `np.where` computes both branches, so the quotient must not divide by zero.
    safe = np.where(small, 1.0, z)
    return np.where(small, series, np.expm1(safe) / safe)


def offsets(half: tuple[int, ...]) -> tuple[Ints, Ints, int]:
    """Return the entry and offset for each mode, and the multiplicity of entries.

    On a line, mode q has entry q - 1. On a plane, row 3 out of 4 is the
    opposite of row 1, and comes after 128 numbers. Entry 79 is number 15 in
    the second block.

    >>> (
    ...     [part.tolist() for part in offsets((4,))[:2]],
    ...     offsets((70,))[1][[64, 65, 69]].tolist(),
    ... )
    ([[0, 0, 1, 2], [0, 0, 1, 2]], [63, 128, 132])
    >>> entry, offset, multiplicity = offsets((4, 3))
    >>> entry.tolist(), multiplicity
    ([0, 1, 2, 3, 4, 5, 6, 7, 8, 3, 4, 5], 2)
    >>> offset.tolist()
    [0, 1, 2, 3, 4, 5, 6, 7, 8, 131, 132, 133]
    >>> offsets((4, 40))[1].reshape(4, 40)[:, 39].tolist()
    [39, 271, 311, 399]
    """
    if len(half) == 1:
        entry = np.maximum(np.arange(half[0]) - 1, 0)  # the mean has no memory
        copy, multiplicity = np.zeros_like(entry), 1
    else:
        # Row r and row n - r have opposite kx,
        # and use an entry as two copies.
        row = np.arange(half[0])
        folded = np.minimum(row, half[0] - row)
        entry = (folded[:, None] * half[1] + np.arange(half[1])[None, :]).ravel()
        copy, multiplicity = np.repeat((row > half[0] // 2).astype(np.int64), half[1]), 2
    # Copies of a block follow each other, and each has a real and an
    # imaginary row.
    offset = (entry // ENTRIES * multiplicity + copy) * (2 * ENTRIES) + entry % ENTRIES
    return entry, offset, multiplicity


def blocks(entries: int) -> int:
    """Return the number of blocks that hold all entries.

    >>> blocks(64), blocks(65), blocks(1)
    (1, 2, 1)
    """
    return -(-entries // ENTRIES)


def zeros(size: int, kind: type = float) -> NDArray[Any]:
    """Return zeros that begin at a cache line, so that no vector in a pass crosses two lines.

    NumPy's arrays may begin 16 bytes later. Every second load would
    then touch two lines, which makes a pass a third slower.

    >>> arrays = [zeros(5), zeros(3, complex), zeros(11)]
    >>> [(x.size, x.dtype.name, x.ctypes.data % 64) for x in arrays]
    [(5, 'float64', 0), (3, 'complex128', 0), (11, 'float64', 0)]
    """
    buffer = np.zeros(size * np.dtype(kind).itemsize + CACHE_LINE, dtype=np.uint8)
    first = -buffer.ctypes.data % CACHE_LINE
    return buffer[first : buffer.size - CACHE_LINE + first].view(kind)


def work_arrays(count: int, size: int, kind: type) -> list[NDArray[Any]]:
    """Return work arrays whose distance is not a multiple of a page, to avoid waiting loads.

    If two addresses are equal modulo 4096 bytes, processors assume that
    a load from the first depends on an earlier store to the second. On
    grids with a power of two nodes, steps would take 50 % longer.

    >>> first, second, third = work_arrays(3, 433, float)
    >>> (
    ...     third.size,
    ...     (second.ctypes.data - first.ctypes.data) // 8,
    ...     third.ctypes.data % 64,
    ... )
    (433, 520, 0)
    """
    distance = -(-size // 8) * 8 + 80
    buffer = zeros(count * distance, kind)
    return [buffer[i * distance : i * distance + size] for i in range(count)]


def empty_memory(grid: Grid) -> tuple[Floats, Floats]:
    """Return memory variables and their sum for the next explicit step, all zero.

    Here 65 entries need two blocks, each with two copies. Each copy has four
    rows for each of three pairs.

    >>> from types import SimpleNamespace
    >>> grid = SimpleNamespace(
    ...     frequency=np.zeros(65), multiplicity=2, poles=np.zeros(3)
    ... )
    >>> [array.size for array in empty_memory(grid)]
    [3072, 512]
    """
    count = blocks(grid.frequency.size) * grid.multiplicity * ENTRIES
    return zeros(count * grid.poles.size * 4), zeros(count * 2)


def step_table(grid: Grid, step: float) -> tuple[Floats, Floats]:
    """Step 1: return `table` and `response` of `ExplicitTables` for an explicit step h.

    The first pair weighs with the fraction of mode II, 0.25 at entry 1, and
    the second pair with 0.75.

    >>> from types import SimpleNamespace
    >>> grid = SimpleNamespace(
    ...     poles=np.array([-0.5 + 1j, -2.0 - 1j]),
    ...     weights=np.array([3.0 + 1j, 2.0 - 1j]),
    ...     split=1,
    ...     frequency=np.array([0.3, 2.0]),
    ...     mode_two=np.array([1.0, 0.25]),
    ...     entry=np.array([1, 0, 1]),
    ... )
    >>> table, response = step_table(grid, 0.5)
    >>> z = grid.poles * 2.0 * 0.5
    >>> E, B, w = (
    ...     np.exp(z),
    ...     0.5 * (np.exp(z) - 1.0) / z,
    ...     grid.weights * np.array([0.25, 0.75]),
    ... )
    >>> rows = table.reshape(2, 4, ENTRIES)[:, :, 1]
    >>> np.allclose(rows.T, [E.real, E.imag, (w * E * B).real, (w * E * B).imag])
    True
    >>> (
    ...     bool(response[0] == response[2]),
    ...     np.allclose(response[0], (w * B).real.sum()),
    ... )
    (True, True)
    >>> first = (3.0 + 1j) * np.expm1(0.15 * grid.poles[0]) / 0.3 / grid.poles[0]
    >>> np.allclose(response[1], first.real)  # all of mode II
    True
    """
    pairs, count = grid.poles.size, blocks(grid.frequency.size)
    table = zeros(count * pairs * 4 * ENTRIES).reshape(count, pairs, 4, ENTRIES)
    response = np.empty(grid.frequency.size)
    in_plane = (np.arange(pairs) < grid.split)[:, None]
    for block in range(count):  # block by block, since all exponentials need more memory
        entries = slice(block * ENTRIES, (block + 1) * ENTRIES)
        z = np.multiply.outer(grid.poles, grid.frequency[entries] * step)
        share = np.where(in_plane, grid.mode_two[entries], 1.0 - grid.mode_two[entries])
        decay, gain, weights = np.exp(z), step * phi(z), grid.weights[:, None] * share
        # The weights of (3) are those of psi, times B because y = psi/B.
        product = weights * decay * gain
        rows = (decay.real, decay.imag, product.real, product.imag)
        for row, values in enumerate(rows):
            table[block, :, row, : values.shape[1]] = values
        response[entries] = np.sum((weights * gain).real, axis=0)
    return table.ravel(), response[grid.entry]


def explicit_tables(grid: Grid, step: float, table: Floats, response: Floats) -> ExplicitTables:
    """Return the tables from `step_table`, with work arrays for a run.

    >>> from types import SimpleNamespace
    >>> grid = SimpleNamespace(
    ...     entry=np.zeros(9), frequency=np.zeros(8), multiplicity=2
    ... )
    >>> grid.transform = SimpleNamespace(shape=(4, 4))
    >>> tables = explicit_tables(grid, 0.5, np.zeros(5), np.zeros(9))
    >>> tables.step, tables.table.size, tables.response.size, tables.packed.size
    (0.5, 5, 9, 256)
    >>> tables.slip_rate_hat.size, tables.shared.dtype.name, tables.transfer.size
    (9, 'complex128', 16)
    """
    modes, nodes = grid.entry.size, int(np.prod(grid.transform.shape))
    packed = zeros(blocks(grid.frequency.size) * grid.multiplicity * 2 * ENTRIES)
    spectra, fields = work_arrays(2, modes, complex), work_arrays(4, nodes, float)
    return ExplicitTables(step, table, response, packed, *spectra, *fields)


@jit_inside
def pack(offset: Array, spectrum: Array, packed: Array) -> None:
    """Write all modes of a transform, except the mean, in packed order.

    >>> packed = np.zeros(2 * ENTRIES)
    >>> pack.py_func(np.array([0, 0, 2]), np.array([9.0, 1 + 2j, 3 - 4j]), packed)
    >>> packed[[0, 2, ENTRIES, ENTRIES + 2]].tolist()
    [1.0, 3.0, 2.0, -4.0]
    """
    for q in range(1, spectrum.size):
        o = offset[q]
        packed[o] = spectrum[q].real
        packed[o + ENTRIES] = spectrum[q].imag


@jit_inside
def advance_memory(
    memory: Array, table: Array, V_hat: Array, memory_sum: Array, pairs: int, multiplicity: int
) -> None:
    """Step 1: set y <- E y + V and memory_sum = Re sum w E B y, for all modes and pairs in a pass.

    `e` has four rows for each pair: the real and imaginary parts of E
    and w E B.

    With complex numbers and two copies, for two pairs:

    >>> random = np.random.default_rng(1)
    >>> table, memory = (
    ...     random.normal(size=(*n, ENTRIES)) for n in ((1, 2, 4), (2, 2, 2, 2))
    ... )
    >>> V, total = random.normal(size=(2, 2, ENTRIES)), np.zeros((2, 2, ENTRIES))
    >>> E, wEB = (
    ...     table[0, :, 0] + 1j * table[0, :, 1],
    ...     table[0, :, 2] + 1j * table[0, :, 3],
    ... )
    >>> y = memory[..., 0, :] + 1j * memory[..., 1, :]  # (copy, pair, signal, entry)
    >>> y = E[:, None] * y + V[:, None]
    >>> advance_memory.py_func(
    ...     memory.ravel(), table.ravel(), V.ravel(), total.reshape(-1), 2, 2
    ... )
    >>> np.allclose(memory[..., 0, :] + 1j * memory[..., 1, :], y)
    True
    >>> np.allclose(total, (wEB[:, None] * y).sum(axis=1).real)
    True
    """
    size = pairs * FOUR_ROWS
    for table_block in range(table.size // size):
        # Views begin at zero, so that the compiler can exclude negative
        # indices. Make them once per block and not for each pair, since
        # a view costs as much as a few modes.
        e = table[table_block * size :][:size]
        for copy in range(multiplicity):
            block = table_block * multiplicity + copy
            y, first = memory[block * size :][:size], block * TWO_ROWS
            v, c = V_hat[first:][:TWO_ROWS], memory_sum[first:][:TWO_ROWS]
            for j in range(TWO_ROWS):
                c[j] = 0.0
            for p in range(pairs):
                o = p * FOUR_ROWS
                # (3) for 64 modes at once. Complex numbers are pairs of real ones in rows
                # of constant length, so that the
                # compiler vectorises the loop.
                for j in range(ENTRIES):
                    # E and w E B of the pair, which both signals use.
                    er, ei = e[o + j], e[o + ENTRIES + j]
                    cr, ci = e[o + TWO_ROWS + j], e[o + THREE_ROWS + j]
                    # The real part of the slip rate.
                    yr, yi = y[o + j], y[o + ENTRIES + j]
                    ar = er * yr - ei * yi + v[j]
                    ai = er * yi + ei * yr
                    y[o + j], y[o + ENTRIES + j] = ar, ai
                    c[j] += cr * ar - ci * ai
                    # Its imaginary part.
                    yr, yi = y[o + TWO_ROWS + j], y[o + THREE_ROWS + j]
                    ar = er * yr - ei * yi + v[ENTRIES + j]
                    ai = er * yi + ei * yr
                    y[o + TWO_ROWS + j], y[o + THREE_ROWS + j] = ar, ai
                    c[ENTRIES + j] += cr * ar - ci * ai


def to_explicit(
    grid: Grid, state: RuptureState, step: float, table: Floats, memory_sum: Floats
) -> None:
    """Step 3: divide psi by B for explicit steps h.

    Write Re sum w E psi to `memory_sum`.

    With B = 1/2 and E = 1/2, psi = 1 + 2i of the real signal and 4 - 2i of the
    imaginary signal become twice as large. The sum weighs with w E B = 1/4.

    >>> from types import SimpleNamespace
    >>> from stiction.methods.dynamics.state import DIAGNOSTICS
    >>> unit = np.ones(1)
    >>> grid = SimpleNamespace(
    ...     frequency=unit, multiplicity=1, poles=-unit + 0j, weights=unit + 0j
    ... )
    >>> grid.mode_two, grid.split, grid.entry = unit, 1, np.zeros(2, int)
    >>> table, _ = step_table(grid, np.log(2.0))
    >>> memory, total = empty_memory(grid)
    >>> memory[::ENTRIES] = 1.0, 2.0, 4.0, -2.0
    >>> now = np.zeros(1, DIAGNOSTICS)[0]
    >>> state = SimpleNamespace(memory=memory, now=now)
    >>> to_explicit(grid, state, np.log(2.0), table, total)
    >>> memory[::ENTRIES].round(9).tolist(), total[::ENTRIES].round(9).tolist()
    ([2.0, 4.0, 8.0, -4.0], [0.5, 2.0])
    >>> int(now["stepping"]["phase"]) == Phase.EXPLICIT
    True
    >>> to_implicit(grid, state, np.log(2.0))
    >>> (
    ...     memory[::ENTRIES].round(9).tolist(),
    ...     int(now["stepping"]["phase"]) == Phase.IMPLICIT,
    ... )
    ([1.0, 2.0, 4.0, -2.0], True)
    """
    _scale_memory(grid, state.memory, step, divide=True)
    count, pairs = blocks(grid.frequency.size), grid.poles.size
    rows = table.reshape(count, pairs, 4, ENTRIES)
    # The next explicit step needs the sum in (3), which only explicit
    # steps update.
    y = state.memory.reshape(count, grid.multiplicity, pairs, 2, 2, ENTRIES)  # of both signals
    for block, total in enumerate(memory_sum.reshape(count, grid.multiplicity, 2, ENTRIES)):
        real, imaginary = rows[block, :, 2, None], rows[block, :, 3, None]
        total[:] = (real * y[block, ..., 0, :] - imaginary * y[block, ..., 1, :]).sum(axis=1)
    state.now["stepping"]["phase"] = Phase.EXPLICIT


def to_implicit(grid: Grid, state: RuptureState, step: float) -> None:
    """Step 3: multiply psi/B by B for explicit steps h."""
    _scale_memory(grid, state.memory, step, divide=False)
    state.now["stepping"]["phase"] = Phase.IMPLICIT


def _scale_memory(grid: Grid, memory: Floats, step: float, *, divide: bool) -> None:
    """Multiply or divide memory variables by B, in place.

    >>> from types import SimpleNamespace
    >>> grid = SimpleNamespace(frequency=np.linspace(0.1, 6.5, 65), multiplicity=2)
    >>> grid.poles = np.array([-0.5 + 1j, -2.0 - 1j])
    >>> memory = np.arange(2.0 * 2 * 2 * 4 * ENTRIES)
    >>> y = memory.copy().reshape(
    ...     2, 2, 2, 2, 2, ENTRIES
    ... )  # block, copy, pair, signal, part
    >>> _scale_memory(grid, memory, 0.5, divide=False)
    >>> z = grid.poles[:, None] * 6.5 * 0.5  # of entry 64, the first of block 1
    >>> B, before = (
    ...     0.5 * (np.exp(z) - 1.0) / z,
    ...     y[1, ..., 0, 0] + 1j * y[1, ..., 1, 0],
    ... )
    >>> after = memory.reshape(y.shape)[1, ..., 0]
    >>> np.allclose(after[..., 0] + 1j * after[..., 1], B * before)
    True
    >>> _scale_memory(grid, memory, 0.5, divide=True)
    >>> np.allclose(memory, y.ravel())
    True
    """
    count = blocks(grid.frequency.size)
    y = memory.reshape(count, grid.multiplicity, grid.poles.size, 4, ENTRIES)
    for block in range(count):
        # The last block is padded, and the padding has no B.
        frequency = grid.frequency[block * ENTRIES : (block + 1) * ENTRIES]
        factor = step * phi(np.multiply.outer(grid.poles, frequency * step))
        rows = y[block, ..., : frequency.size]
        for row in (0, 2):
            value = rows[:, :, row] + 1j * rows[:, :, row + 1]
            value = value / factor if divide else value * factor
            rows[:, :, row], rows[:, :, row + 1] = value.real, value.imag


@jit_inside
def _phi(z: Any) -> Any:
    """Return (exp(z) - 1)/z near z = 0, by a series.

    >>> z = 0.1 - 0.05j
    >>> print(
    ...     f"{abs(_phi.py_func(z) - np.expm1(z) / z):.7f} {_phi.py_func(1.0 + 0j).real:.5f}"
    ... )
    0.0000000 1.71806
    """
    value = 1.0 + 0.0j
    for k in range(6, 1, -1):  # part by part: complex division is slow to compile and to run
        value = 1.0 + complex(z.real / k, z.imag / k) * value
    return value


@jit_inside
def _ramp(z: Any) -> Any:
    """Return int_0^1 exp(z (1 - t)) (t - 1/2) dt near z = 0, by a series.

    >>> z, t = 0.1 - 0.05j, (np.arange(1000) + 0.5) / 1000
    >>> value, integral = (
    ...     _ramp.py_func(z),
    ...     np.mean(np.exp(z * (1.0 - t)) * (t - 0.5)),
    ... )
    >>> print(f"{abs(value - integral):.7f}")
    0.0000000
    """
    return -z / 12.0 * (1.0 + z / 2.0 * (1.0 + z * 0.3 * (1.0 + z * (2.0 / 9.0))))


def implicit_tables(grid: Grid) -> ImplicitTables:
    """Return tables that are not yet valid for any step.

    >>> from types import SimpleNamespace
    >>> grid = SimpleNamespace(
    ...     entry=np.zeros(9), frequency=np.zeros(8), multiplicity=2
    ... )
    >>> grid.transform, grid.poles = SimpleNamespace(shape=(4, 4)), np.zeros(3)
    >>> tables = implicit_tables(grid)
    >>> tables.table.size, tables.ramp.size, tables.packed.size, tables.response.size
    (768, 384, 256, 8)
    >>> tables.memory_sum.size, tables.transfer.size, tables.problem.symbol.size
    (9, 16, 9)
    >>> (
    ...     tables.problem.slipping.dtype.kind,
    ...     tables.problem.work.size,
    ...     int(tables.filled[0]),
    ... )
    ('i', 9, 0)
    """
    count, pairs, entries = blocks(grid.frequency.size), grid.poles.size, grid.frequency.size
    modes, nodes = grid.entry.size, int(np.prod(grid.transform.shape))
    table, ramp = (zeros(count * pairs * rows * ENTRIES) for rows in (4, 2))
    spectra: Any = work_arrays(5, modes, complex)
    transfer, strength, *fields = work_arrays(10, nodes, float)
    of_problem: Any = (*fields[:4], np.zeros(nodes, dtype=np.int64), *fields[4:])
    symbol, inverse = work_arrays(2, modes, float)
    problem = SlipProblem(grid.transform, symbol, inverse, spectra.pop(), *of_problem)
    packed, second_packed = np.zeros((2, count * grid.multiplicity * 2 * ENTRIES))
    arrays: Any = (
        np.zeros(1, dtype=np.int64), np.zeros(2), table, ramp, *work_arrays(2, entries, float),
        *spectra, transfer, strength, packed, second_packed, np.empty((2, TWO_ROWS)), problem,
    )  # fmt: skip
    return ImplicitTables(*arrays)


@jit_inside
def tabulate(grid: Grid, step: float, tables: ImplicitTables) -> None:
    """Step 2: write E, B and R of (4) for a step h, and their weighted sums.

    E and B are written to `table` with the layout [block][pair][4][64],
    and R to `ramp` with [block][pair][2][64]. Re sum w B and Re sum w R
    are written to `response` and `ramp_response`. On a line |k| c_s is
    j + 1 times the lowest frequency, so the exponentials for a pole are
    powers of the same number. Each takes one product, and has a
    relative error of 1e-16 j.

    On a line the entries have one, two and three times the lowest frequency.
    On a plane the first frequency is zero, so that E = 1, B = h and R = 0.
    (The function runs without compilation.)

    >>> from types import FunctionType, SimpleNamespace
    >>> names = globals() | {"_phi": _phi.py_func, "_ramp": _ramp.py_func}
    >>> plain, h = FunctionType(tabulate.py_func.__code__, names), 0.5
    >>> poles, weights = (
    ...     np.array([-0.5 + 1j, -2.0 - 1j]),
    ...     np.array([3.0 + 1j, 2.0 - 1j]),
    ... )
    >>> line = (1, np.array([0.03, 0.06, 0.09]), np.ones(3), 2)
    >>> plane = (2, np.array([0.0, 2.0, 5.0]), np.array([0.3, 0.6, 0.9]), 1)
    >>> for multiplicity, frequency, mode_two, split in (line, plane):
    ...     grid = SimpleNamespace(
    ...         multiplicity=multiplicity, frequency=frequency, poles=poles
    ...     )
    ...     grid.weights, grid.mode_two, grid.split = weights, mode_two, split
    ...     tables = SimpleNamespace(
    ...         table=np.zeros(2 * FOUR_ROWS), ramp=np.zeros(2 * TWO_ROWS)
    ...     )
    ...     tables.response, tables.ramp_response = np.full((2, 3), 9.0)
    ...     plain(grid, h, tables)
    ...     z, t = (
    ...         np.multiply.outer(poles, frequency) * h,
    ...         (np.arange(2000) + 0.5) / 2000,
    ...     )
    ...     E, B = np.exp(z), h * phi(z)
    ...     R = (
    ...         h
    ...         * h
    ...         * np.mean(np.exp(z[..., None] * (1.0 - t)) * (t - 0.5), axis=-1)
    ...     )
    ...     rows, ramps = (
    ...         tables.table.reshape(2, 4, ENTRIES),
    ...         tables.ramp.reshape(2, 2, ENTRIES),
    ...     )
    ...     found = rows[:, 0] + 1j * rows[:, 1], rows[:, 2] + 1j * rows[:, 3]
    ...     found = *found, ramps[:, 0] + 1j * ramps[:, 1]
    ...     pairs = zip(found, (E, B, R), strict=True)
    ...     print([bool(np.abs(x[:, :3] - y).max() < 1e-7) for x, y in pairs])
    ...     share = np.array([mode_two, mode_two if split == 2 else 1.0 - mode_two])
    ...     sums = [(weights[:, None] * share * x).real.sum(axis=0) for x in (B, R)]
    ...     away = (
    ...         np.abs(tables.response - sums[0]),
    ...         np.abs(tables.ramp_response - sums[1]),
    ...     )
    ...     print(bool(away[0].max() < 1e-12), bool(away[1].max() < 1e-6))
    [True, True, True]
    True True
    [True, True, True]
    True True
    """
    table, ramp = tables.table, tables.ramp
    response, ramp_response = tables.response, tables.ramp_response
    for j in range(response.size):
        response[j] = ramp_response[j] = 0.0
    pairs = grid.poles.size
    for p in range(pairs):
        pole, weight = grid.poles[p], grid.weights[p]
        unit = pole * (grid.frequency[0] * step)
        base = np.exp(unit)
        # On a plane the lowest frequency is zero, and z is computed
        # entry by entry.
        inverse = 1.0 / unit if grid.multiplicity == 1 else 0.0j
        decay = 1.0 + 0.0j
        for j in range(response.size):
            if grid.multiplicity == 1:
                decay = decay * base
                z = unit * (j + 1)
                share = 1.0
            else:
                z = pole * (grid.frequency[j] * step)
                decay = np.exp(z)
                share = grid.mode_two[j] if p < grid.split else 1.0 - grid.mode_two[j]
            if z.real * z.real + z.imag * z.imag < 4e-4:  # |z| < 0.02: series
                gain, ramp_gain = step * _phi(z), step * step * _ramp(z)
            else:
                per_z = inverse * (1.0 / (j + 1)) if grid.multiplicity == 1 else 1.0 / z
                ratio = (decay - 1.0) * per_z
                gain = step * ratio
                ramp_gain = step * step * ((ratio - 1.0) * per_z - 0.5 * ratio)
            # Entry j lies in column j % 64 of block j // 64.
            o = ((j // ENTRIES) * pairs + p) * FOUR_ROWS + j % ENTRIES
            table[o], table[o + ENTRIES] = decay.real, decay.imag
            table[o + TWO_ROWS], table[o + THREE_ROWS] = gain.real, gain.imag
            o = ((j // ENTRIES) * pairs + p) * TWO_ROWS + j % ENTRIES
            ramp[o], ramp[o + ENTRIES] = ramp_gain.real, ramp_gain.imag
            response[j] += share * (weight * gain).real
            ramp_response[j] += share * (weight * ramp_gain).real


@jit_inside
def fading_memory(grid: Grid, memory: Array, tables: ImplicitTables) -> None:
    """Step 2: write Re sum w E psi for all modes to `tables.memory_sum`.

    On this plane, the real and the imaginary signal of entry 1 are summed
    over a pair of mode II and a pair of mode III.

    >>> from types import SimpleNamespace
    >>> random = np.random.default_rng(2)
    >>> entry, offset, _ = offsets((4, 3))
    >>> grid = SimpleNamespace(entry=entry, offset=offset, multiplicity=2, split=1)
    >>> grid.poles, grid.weights = np.zeros(2), np.array([3.0 + 1j, 2.0 - 1j])
    >>> grid.mode_two, memory = (
    ...     np.linspace(0.1, 0.7, 9),
    ...     random.normal(size=(2, 2, 2, 2, ENTRIES)),
    ... )
    >>> table = random.normal(size=(2, 4, ENTRIES))
    >>> tables = SimpleNamespace(table=table.ravel(), sums=np.zeros((2, TWO_ROWS)))
    >>> tables.packed, tables.second_packed = np.zeros((2, 2 * TWO_ROWS))
    >>> tables.memory_sum = np.zeros(12, complex)
    >>> fading_memory.py_func(grid, memory.ravel(), tables)
    >>> E, psi = (
    ...     table[:, 0] + 1j * table[:, 1],
    ...     memory[..., 0, :] + 1j * memory[..., 1, :],
    ... )
    >>> for q, copy in ((4, 0), (10, 1)):  # both with entry 4
    ...     share = np.array([grid.mode_two[4], 1.0 - grid.mode_two[4]])
    ...     real, imaginary = (
    ...         (share * grid.weights * E[:, 4]) @ psi[copy, :, :, 4]
    ...     ).real
    ...     print(np.allclose(tables.memory_sum[q], real + 1j * imaginary))
    True
    True
    """
    pairs, multiplicity, split = grid.poles.size, grid.multiplicity, grid.split
    sums = tables.sums  # over the pairs before `split`, and over the pairs of mode III
    for block in range(memory.size // (FOUR_ROWS * pairs)):
        for j in range(TWO_ROWS):
            sums[0, j] = sums[1, j] = 0.0
        for p in range(pairs):
            # Views begin at zero, so that the compiler can exclude
            # negative indices.
            y = memory[(block * pairs + p) * FOUR_ROWS :][:FOUR_ROWS]
            e = tables.table[(block // multiplicity * pairs + p) * FOUR_ROWS :][:FOUR_ROWS]
            out = sums[0 if p < split else 1]
            # The product w E is computed on the way, and not stored.
            wr, wi = grid.weights[p].real, grid.weights[p].imag
            for j in range(ENTRIES):
                cr, ci = wr * e[j] - wi * e[ENTRIES + j], wr * e[ENTRIES + j] + wi * e[j]
                out[j] += cr * y[j] - ci * y[ENTRIES + j]
                out[ENTRIES + j] += cr * y[TWO_ROWS + j] - ci * y[THREE_ROWS + j]
        for j in range(TWO_ROWS):
            tables.packed[block * TWO_ROWS + j] = sums[0, j]
            tables.second_packed[block * TWO_ROWS + j] = sums[1, j]
    # The tables do not hold the fractions of the modes on a plane: weight
    # the two sums here.
    for q in range(1, tables.memory_sum.size):
        o, share = grid.offset[q], grid.mode_two[grid.entry[q]]
        share_three = 1.0 - share
        tables.memory_sum[q] = complex(
            share * tables.packed[o] + share_three * tables.second_packed[o],
            share * tables.packed[o + ENTRIES]
            + share_three * tables.second_packed[o + ENTRIES],
        )


@jit_inside
def advance_with_ramp(grid: Grid, memory: Array, tables: ImplicitTables) -> None:
    """Step 2: set psi <- E psi + B V + R a with V = `slip_rate_hat`, a = `slope_hat` (m/s²).

    >>> from types import FunctionType, SimpleNamespace
    >>> names = globals() | {"pack": pack.py_func}  # without compilation
    >>> plain = FunctionType(advance_with_ramp.py_func.__code__, names)
    >>> random = np.random.default_rng(3)
    >>> entry, offset, _ = offsets((4, 3))
    >>> grid = SimpleNamespace(
    ...     entry=entry, offset=offset, multiplicity=2, poles=np.zeros(2)
    ... )
    >>> sizes = (2, 2, 2, 2), (2, 4), (2, 2)
    >>> memory, table, ramp = (
    ...     random.normal(size=(*size, ENTRIES)) for size in sizes
    ... )
    >>> V, a = random.normal(size=(2, 12, 2)) @ [1.0, 1j]
    >>> tables = SimpleNamespace(table=table.ravel(), ramp=ramp.ravel())
    >>> tables.slip_rate_hat, tables.slope_hat = V, a
    >>> tables.packed, tables.second_packed = np.zeros((2, 2 * TWO_ROWS))
    >>> psi = (
    ...     memory[1, ..., 0, 4] + 1j * memory[1, ..., 1, 4]
    ... )  # (pair, signal) of mode 10
    >>> E, B, R = (
    ...     x[:, 0, 4] + 1j * x[:, 1, 4] for x in (table[:, :2], table[:, 2:], ramp)
    ... )
    >>> V, a = np.array([V[10].real, V[10].imag]), np.array([a[10].real, a[10].imag])
    >>> plain(grid, memory.reshape(-1), tables)
    >>> expected = E[:, None] * psi + B[:, None] * V + R[:, None] * a
    >>> np.allclose(memory[1, ..., 0, 4] + 1j * memory[1, ..., 1, 4], expected)
    True
    """
    pairs, multiplicity = grid.poles.size, grid.multiplicity
    pack(grid.offset, tables.slip_rate_hat, tables.packed)
    pack(grid.offset, tables.slope_hat, tables.second_packed)
    for block in range(memory.size // (FOUR_ROWS * pairs)):
        first = block * TWO_ROWS
        v, a = tables.packed[first:][:TWO_ROWS], tables.second_packed[first:][:TWO_ROWS]
        for p in range(pairs):
            y = memory[(block * pairs + p) * FOUR_ROWS :][:FOUR_ROWS]
            entry = block // multiplicity * pairs + p
            e = tables.table[entry * FOUR_ROWS :][:FOUR_ROWS]
            r = tables.ramp[entry * TWO_ROWS :][:TWO_ROWS]
            # (4) for 64 modes at once, first for the real signal.
            for j in range(ENTRIES):
                er, ei, br, bi = e[j], e[ENTRIES + j], e[TWO_ROWS + j], e[THREE_ROWS + j]
                rr, ri = r[j], r[ENTRIES + j]
                yr, yi = y[j], y[ENTRIES + j]
                y[j] = er * yr - ei * yi + br * v[j] + rr * a[j]
                y[ENTRIES + j] = er * yi + ei * yr + bi * v[j] + ri * a[j]
                yr, yi = y[TWO_ROWS + j], y[THREE_ROWS + j]
                y[TWO_ROWS + j] = er * yr - ei * yi + br * v[ENTRIES + j] + rr * a[ENTRIES + j]
                yi = er * yi + ei * yr
                y[THREE_ROWS + j] = yi + bi * v[ENTRIES + j] + ri * a[ENTRIES + j]


def grown_memory(grid: Grid, memory: Floats, V_hat: Spectrum, growth: float) -> Spectrum:
    """Set psi = V/(growth - s |k| c_s) for a slip rate that has always grown as exp(growth t).

    Returns Re sum w psi for all modes.

    The memory variable V/(a - z) grows as exp(a t): its rate a psi is z psi + V.

    >>> from types import SimpleNamespace
    >>> entry, offset, _ = offsets((4, 3))
    >>> grid = SimpleNamespace(entry=entry, offset=offset, multiplicity=2, split=1)
    >>> grid.poles, grid.weights = (
    ...     np.array([-0.5 + 1j, -2.0 - 1j]),
    ...     np.array([3.0 + 1j, 2.0 - 1j]),
    ... )
    >>> grid.frequency, grid.mode_two = (
    ...     np.linspace(0.0, 4.0, 9),
    ...     np.linspace(0.1, 0.7, 9),
    ... )
    >>> memory, V = np.zeros((2, 2, 2, 2, ENTRIES)), np.arange(12) * (1.0 + 2j)
    >>> total = grown_memory(grid, memory.reshape(-1), V, 0.7)
    >>> psi = (
    ...     memory[1, ..., 0, 4] + 1j * memory[1, ..., 1, 4]
    ... )  # (pair, signal) of mode 10
    >>> z, signals = grid.poles[:, None] * 2.0, np.array([10.0, 20.0])
    >>> np.allclose(0.7 * psi, z * psi + signals)
    True
    >>> share = grid.weights * np.array([0.4, 0.6])
    >>> np.allclose(total[10], (share @ psi).real @ [1.0, 1j])
    True
    """
    total = np.zeros(V_hat.size, dtype=np.complex128)
    slip_rate, entry, pairs = V_hat[1:], grid.entry[1:], grid.poles.size
    # Place of each mode in the memory of the
    # first pair: its block, and its column.
    first = grid.offset[1:] // TWO_ROWS * pairs * FOUR_ROWS + grid.offset[1:] % ENTRIES
    for p in range(pairs):
        share = grid.mode_two[entry] if p < grid.split else 1.0 - grid.mode_two[entry]
        gain = 1.0 / (growth - grid.poles[p] * grid.frequency[entry])
        place = first + p * FOUR_ROWS
        for row, signal in enumerate((slip_rate.real, slip_rate.imag)):
            memory[place + row * TWO_ROWS] = gain.real * signal
            memory[place + row * TWO_ROWS + ENTRIES] = gain.imag * signal
        total[1:] += share * (grid.weights[p] * gain).real * slip_rate
    return total

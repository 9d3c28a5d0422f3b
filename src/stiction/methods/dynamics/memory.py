"""The memory of past slip rates: the layout of its variables, and how steps advance them.

Variables lie in blocks of 64 modes, so that one pass stays in registers. Tables have an entry for
each wave vector that differs in what waves do: on a line k > 0, on a plane kx >= 0 and ky >= 0,
because (kx, ky) and (-kx, ky) share |k| and the share of mode II: such an entry has multiplicity 2.
Entries are padded to whole blocks. Tables are packed as [block][pair][row][64], Fourier arrays as
[block][copy][real, imaginary][64] and memory variables as [block][copy][pair][4][64] with the four
rows real and imaginary part of the memory of the real signal, then of the imaginary signal. The
constant row length lets the compiler vectorise without run-time checks of overlap.
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
    Spectrum,
)

ENTRIES = 64
"""Entries of a block of the memory, which a pass takes together."""
TWO, THREE, FOUR = 2 * ENTRIES, 3 * ENTRIES, 4 * ENTRIES
"""Numbers in so many rows of a block."""
LINE = 64
"""Bytes of a cache line."""


def phi(z: Spectrum) -> Spectrum:
    """(exp(z) - 1)/z, also for small z."""
    small = np.abs(z) < 1e-3
    series = 1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0 * (1.0 + z / 5.0)))
    safe = np.where(small, 1.0, z)
    return np.where(small, series, np.expm1(safe) / safe)


def offsets(half: tuple[int, ...]) -> tuple[Ints, Ints, int]:
    """Return entry and offset of each mode of a transform, and the multiplicity of entries."""
    if len(half) == 1:
        entry = np.maximum(np.arange(half[0]) - 1, 0)  # the mean has no memory
        copy, multiplicity = np.zeros_like(entry), 1
    else:
        row = np.arange(half[0])
        folded = np.minimum(row, half[0] - row)
        entry = (folded[:, None] * half[1] + np.arange(half[1])[None, :]).ravel()
        copy, multiplicity = np.repeat((row > half[0] // 2).astype(np.int64), half[1]), 2
    offset = (entry // ENTRIES * multiplicity + copy) * (2 * ENTRIES) + entry % ENTRIES
    return entry, offset, multiplicity


def blocks(entries: int) -> int:
    """Number of blocks for so many entries."""
    return -(-entries // ENTRIES)


def zeros(size: int, kind: type = float) -> NDArray[Any]:
    """Zeros from the start of a cache line on, so that no vector of a pass lies across two.

    (Allocated memory begins 16 bytes later: every second load would touch two lines, which
    costs a third of the pass.)
    """
    whole = np.zeros(size * np.dtype(kind).itemsize + LINE, dtype=np.uint8)
    first = -whole.ctypes.data % LINE
    return whole[first : whole.size - LINE + first].view(kind)


def work_arrays(count: int, size: int, kind: type) -> list[NDArray[Any]]:
    """Arrays to work in, apart by what is no multiple of a page: stores then hold up no loads.

    (Of addresses that are equal modulo 4096 bytes, processors take a load to depend on the store
    before it; with grids of powers of two that would cost half a step.)
    """
    apart = -(-size // 8) * 8 + 80
    whole = zeros(count * apart, kind)
    return [whole[i * apart : i * apart + size] for i in range(count)]


def empty_memory(grid: Grid) -> tuple[Floats, Floats]:
    """Memory variables and their sum for the next explicit step, all zero."""
    count = blocks(grid.frequency.size) * grid.multiplicity * ENTRIES
    return zeros(count * grid.poles.size * 4), zeros(count * 2)


def step_table(grid: Grid, step: float) -> tuple[Floats, Floats]:
    """Tables of one fixed explicit step h: `table` and `response` of `ExplicitTables`."""
    pairs, count = grid.poles.size, blocks(grid.frequency.size)
    table = zeros(count * pairs * 4 * ENTRIES).reshape(count, pairs, 4, ENTRIES)
    response = np.empty(grid.frequency.size)
    in_plane = (np.arange(pairs) < grid.split)[:, None]
    for block in range(count):  # one by one: all exponentials together would take more
        some = slice(block * ENTRIES, (block + 1) * ENTRIES)
        z = np.multiply.outer(grid.poles, grid.frequency[some] * step)
        share = np.where(in_plane, grid.mode_two[some], 1.0 - grid.mode_two[some])
        decay, gain, weights = np.exp(z), step * phi(z), grid.weights[:, None] * share
        product = weights * decay * gain
        rows = (decay.real, decay.imag, product.real, product.imag)
        for row, values in enumerate(rows):
            table[block, :, row, : values.shape[1]] = values
        response[some] = np.sum((weights * gain).real, axis=0)
    return table.ravel(), response[grid.entry]


def explicit_tables(grid: Grid, step: float, table: Floats, response: Floats) -> ExplicitTables:
    """Tables from `step_table` with arrays to work in, which belongs to one run."""
    modes, nodes = grid.entry.size, int(np.prod(grid.transform.shape))
    packed = zeros(blocks(grid.frequency.size) * grid.multiplicity * 2 * ENTRIES)
    spectra, fields = work_arrays(2, modes, complex), work_arrays(2, nodes, float)
    return ExplicitTables(step, table, response, packed, *spectra, *fields)


@jit_inside
def pack(offset: Array, spectrum: Array, packed: Array) -> None:
    """All modes of a transform but the mean into packed order."""
    for q in range(1, spectrum.size):
        o = offset[q]
        packed[o] = spectrum[q].real
        packed[o + ENTRIES] = spectrum[q].imag


@jit_inside
def advance_memory(
    memory: Array, table: Array, rate: Array, memory_sum: Array, pairs: int, multiplicity: int
) -> None:
    """y <- E y + V and memory_sum = Re sum w E B y, for all modes and pairs: the one pass."""
    size = pairs * FOUR
    for own in range(table.size // size):
        # Views that begin at zero: the compiler can then exclude negative indices. One of each
        # a block and none a pair: making a view costs as much as a few modes.
        e = table[own * size :][:size]
        for copy in range(multiplicity):
            block = own * multiplicity + copy
            y = memory[block * size :][:size]
            v, c = rate[block * TWO :][:TWO], memory_sum[block * TWO :][:TWO]
            for j in range(TWO):
                c[j] = 0.0
            for p in range(pairs):
                o = p * FOUR
                for j in range(ENTRIES):
                    er, ei = e[o + j], e[o + ENTRIES + j]
                    cr, ci = e[o + TWO + j], e[o + THREE + j]
                    yr, yi = y[o + j], y[o + ENTRIES + j]
                    ar = er * yr - ei * yi + v[j]
                    ai = er * yi + ei * yr
                    y[o + j] = ar
                    y[o + ENTRIES + j] = ai
                    c[j] += cr * ar - ci * ai
                    yr, yi = y[o + TWO + j], y[o + THREE + j]
                    ar = er * yr - ei * yi + v[ENTRIES + j]
                    ai = er * yi + ei * yr
                    y[o + TWO + j] = ar
                    y[o + THREE + j] = ai
                    c[ENTRIES + j] += cr * ar - ci * ai


def sum_memory(grid: Grid, memory: Floats, table: Floats, memory_sum: Floats) -> None:
    """Put Re sum w E B y into `memory_sum` without advancing: where an explicit phase begins."""
    count, pairs = blocks(grid.frequency.size), grid.poles.size
    rows = table.reshape(count, pairs, 4, ENTRIES)
    y = memory.reshape(count, grid.multiplicity, pairs, 2, 2, ENTRIES)  # of both signals
    for block, total in enumerate(memory_sum.reshape(count, grid.multiplicity, 2, ENTRIES)):
        real, imaginary = rows[block, :, 2, None], rows[block, :, 3, None]
        total[:] = (real * y[block, ..., 0, :] - imaginary * y[block, ..., 1, :]).sum(axis=1)


def scale_memory(grid: Grid, memory: Floats, step: float, *, divide: bool) -> None:
    """psi = B y, or y = psi/B with `divide`, in place: at the switch between kinds of step."""
    count = blocks(grid.frequency.size)
    y = memory.reshape(count, grid.multiplicity, grid.poles.size, 4, ENTRIES)
    for block in range(count):
        frequency = grid.frequency[block * ENTRIES : (block + 1) * ENTRIES]
        factor = step * phi(np.multiply.outer(grid.poles, frequency * step))
        part = y[block, ..., : frequency.size]
        for row in (0, 2):
            value = part[:, :, row] + 1j * part[:, :, row + 1]
            value = value / factor if divide else value * factor
            part[:, :, row], part[:, :, row + 1] = value.real, value.imag


@jit_inside
def _phi(z: Any) -> Any:
    """(exp(z) - 1)/z near z = 0."""
    value = 1.0 + 0.0j
    for k in range(6, 1, -1):  # part by part: complex division is slow to compile and to run
        value = 1.0 + complex(z.real / k, z.imag / k) * value
    return value


@jit_inside
def _ramp(z: Any) -> Any:
    """int_0^1 exp(z (1 - t)) (t - 1/2) dt near z = 0."""
    return -z / 12.0 * (1.0 + z / 2.0 * (1.0 + z * 0.3 * (1.0 + z * (2.0 / 9.0))))


def implicit_tables(grid: Grid) -> ImplicitTables:
    """Tables that are not yet valid for any step."""
    count, pairs, entries = blocks(grid.frequency.size), grid.poles.size, grid.frequency.size
    modes, nodes = grid.entry.size, int(np.prod(grid.transform.shape))
    table, ramp = (zeros(count * pairs * rows * ENTRIES) for rows in (4, 2))
    arrays: Any = (
        *(table, ramp, *work_arrays(2, entries, float), *work_arrays(2, modes, float)),
        *work_arrays(4, modes, complex),
        *work_arrays(8, nodes, float),
        np.zeros(nodes, dtype=np.int64),
        *np.zeros((2, count * grid.multiplicity * 2 * ENTRIES)),
        np.empty((2, TWO)),
    )
    return ImplicitTables(np.array([-1.0, -1.0]), *arrays)


@jit_inside
def tabulate(grid: Grid, step: float, tables: ImplicitTables) -> None:
    """E and B = int_0^h exp(s |k| c_s t') dt' into `table`.

    `ramp`, [block][pair][2][64], gets the counterpart of B for a slip rate that rises linearly with
    zero mean; `response` and `ramp_response` get their sums Re sum w B. On a line |k| c_s is j + 1
    times the lowest, so the exponentials of a pole are powers of one number: a product each, with a
    relative error of 1e-16 j.
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
        inverse = 1.0 / unit if grid.multiplicity == 1 else 0.0j  # on a plane the first is 0
        decay = 1.0 + 0.0j
        for j in range(response.size):
            if grid.multiplicity == 1:
                decay = decay * base
                z = unit * (j + 1)
                part = 1.0
            else:
                z = pole * (grid.frequency[j] * step)
                decay = np.exp(z)
                part = grid.mode_two[j] if p < grid.split else 1.0 - grid.mode_two[j]
            if z.real * z.real + z.imag * z.imag < 4e-4:
                gain, ramp_gain = step * _phi(z), step * step * _ramp(z)
            else:
                per_z = inverse * (1.0 / (j + 1)) if grid.multiplicity == 1 else 1.0 / z
                ratio = (decay - 1.0) * per_z
                gain = step * ratio
                ramp_gain = step * step * ((ratio - 1.0) * per_z - 0.5 * ratio)
            o = ((j // ENTRIES) * pairs + p) * FOUR + j % ENTRIES
            table[o], table[o + ENTRIES] = decay.real, decay.imag
            table[o + TWO], table[o + THREE] = gain.real, gain.imag
            o = ((j // ENTRIES) * pairs + p) * TWO + j % ENTRIES
            ramp[o], ramp[o + ENTRIES] = ramp_gain.real, ramp_gain.imag
            response[j] += part * (weight * gain).real
            ramp_response[j] += part * (weight * ramp_gain).real


@jit_inside
def fading_memory(grid: Grid, memory: Array, tables: ImplicitTables) -> None:
    """Put Re sum w E psi of all modes into `memory_sum`: what the past leaves after the step."""
    pairs, multiplicity, split = grid.poles.size, grid.multiplicity, grid.split
    sums = tables.sums  # of the pairs before `split`, and of those from there on
    for block in range(memory.size // (FOUR * pairs)):
        for j in range(TWO):
            sums[0, j] = sums[1, j] = 0.0
        for p in range(pairs):
            # Views that begin at zero: the compiler can then exclude negative indices.
            y = memory[(block * pairs + p) * FOUR :][:FOUR]
            e = tables.table[(block // multiplicity * pairs + p) * FOUR :][:FOUR]
            out = sums[0 if p < split else 1]
            wr, wi = grid.weights[p].real, grid.weights[p].imag
            for j in range(ENTRIES):
                cr, ci = wr * e[j] - wi * e[ENTRIES + j], wr * e[ENTRIES + j] + wi * e[j]
                out[j] += cr * y[j] - ci * y[ENTRIES + j]
                out[ENTRIES + j] += cr * y[TWO + j] - ci * y[THREE + j]
        for j in range(TWO):
            tables.packed[block * TWO + j] = sums[0, j]
            tables.others[block * TWO + j] = sums[1, j]
    for q in range(1, tables.memory_sum.size):
        o, share = grid.offset[q], grid.mode_two[grid.entry[q]]
        rest = 1.0 - share
        tables.memory_sum[q] = complex(
            share * tables.packed[o] + rest * tables.others[o],
            share * tables.packed[o + ENTRIES] + rest * tables.others[o + ENTRIES],
        )


@jit_inside
def advance_with_ramp(grid: Grid, memory: Array, tables: ImplicitTables) -> None:
    """psi <- E psi + B V, V = `rate_hat`, with a slip rate that changes by `past_hat` in it."""
    pairs, multiplicity = grid.poles.size, grid.multiplicity
    pack(grid.offset, tables.rate_hat, tables.packed)
    pack(grid.offset, tables.past_hat, tables.others)
    for block in range(memory.size // (FOUR * pairs)):
        v, a = tables.packed[block * TWO :][:TWO], tables.others[block * TWO :][:TWO]
        for p in range(pairs):
            y = memory[(block * pairs + p) * FOUR :][:FOUR]
            own = block // multiplicity * pairs + p
            e, s = tables.table[own * FOUR :][:FOUR], tables.ramp[own * TWO :][:TWO]
            for j in range(ENTRIES):
                er, ei, gr, gi = e[j], e[ENTRIES + j], e[TWO + j], e[THREE + j]
                lr, li = s[j], s[ENTRIES + j]
                yr, yi = y[j], y[ENTRIES + j]
                y[j] = er * yr - ei * yi + gr * v[j] + lr * a[j]
                y[ENTRIES + j] = er * yi + ei * yr + gi * v[j] + li * a[j]
                yr, yi = y[TWO + j], y[THREE + j]
                y[TWO + j] = er * yr - ei * yi + gr * v[ENTRIES + j] + lr * a[ENTRIES + j]
                y[THREE + j] = er * yi + ei * yr + gi * v[ENTRIES + j] + li * a[ENTRIES + j]


def grown_memory(grid: Grid, memory: Floats, rate_hat: Spectrum, growth: float) -> Spectrum:
    """psi of a slip rate that has always grown as exp(growth t); return Re sum w psi, (modes,)."""
    total = np.zeros(rate_hat.size, dtype=np.complex128)
    rate, entry, pairs = rate_hat[1:], grid.entry[1:], grid.poles.size
    first = grid.offset[1:] // (2 * ENTRIES) * pairs * 4 * ENTRIES + grid.offset[1:] % ENTRIES
    for p in range(pairs):
        part = grid.mode_two[entry] if p < grid.split else 1.0 - grid.mode_two[entry]
        gain = 1.0 / (growth - grid.poles[p] * grid.frequency[entry])
        own = first + p * 4 * ENTRIES
        for row, signal in enumerate((rate.real, rate.imag)):
            memory[own + 2 * row * ENTRIES] = gain.real * signal
            memory[own + (2 * row + 1) * ENTRIES] = gain.imag * signal
        total[1:] += part * (grid.weights[p] * gain).real * rate
    return total

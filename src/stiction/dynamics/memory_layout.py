"""How memory variables lie in memory: blocks of 64 modes, so that one pass stays in registers.

Tables have a slot for each wave vector that differs in what waves do: on a line k > 0, on a plane
kx >= 0 and ky >= 0, because (kx, ky) and (-kx, ky), two copies, share |k| and the share of mode II.
Slots are padded to whole blocks. Tables are packed as [block][pair][row][64], Fourier arrays as
[block][copy][real, imaginary][64] and memory variables as [block][copy][pair][4][64] with the four
rows real and imaginary part of the memory of the real signal, then of the imaginary signal. The
constant row length lets the compiler vectorise without run-time checks of overlap.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.dynamics.arrays import ExplicitTables, Grid, Ints, Spectrum
from stiction.dynamics.courant_limit import phi
from stiction.jit import jit

LANES = 64
LINE = 64  # bytes of a cache line

Floats = NDArray[np.float64]


def places(half: tuple[int, ...]) -> tuple[Ints, Ints, int]:
    """Slot and place of each mode of a transform of this shape, and copies a slot; see `Grid`."""
    if len(half) == 1:
        slot = np.maximum(np.arange(half[0]) - 1, 0)  # the mean has no memory
        copy, copies = np.zeros_like(slot), 1
    else:
        row = np.arange(half[0])
        folded = np.minimum(row, half[0] - row)
        slot = (folded[:, None] * half[1] + np.arange(half[1])[None, :]).ravel()
        copy, copies = np.repeat((row > half[0] // 2).astype(np.int64), half[1]), 2
    return slot, (slot // LANES * copies + copy) * (2 * LANES) + slot % LANES, copies


def blocks(slots: int) -> int:
    """Number of blocks for so many slots."""
    return -(-slots // LANES)


def zeros(size: int, kind: type = float) -> NDArray[Any]:
    """Zeros from the start of a cache line on, so that no vector of a pass lies across two.

    (What allocates memory begins 16 bytes later: every second load would touch two lines, which
    costs a third of the pass.)
    """
    whole = np.zeros(size * np.dtype(kind).itemsize + LINE, dtype=np.uint8)
    first = -whole.ctypes.data % LINE
    return whole[first : whole.size - LINE + first].view(kind)


def rooms(count: int, size: int, kind: type) -> list[NDArray[Any]]:
    """Arrays to work in, apart by what is no multiple of a page: stores then hold up no loads.

    (Of addresses that are equal modulo 4096 bytes, processors take a load to depend on the store
    before it; with grids of powers of two that would cost half a step.)
    """
    apart = -(-size // 8) * 8 + 80
    whole = zeros(count * apart, kind)
    return [whole[i * apart : i * apart + size] for i in range(count)]


def empty_memory(grid: Grid) -> tuple[Floats, Floats]:
    """Memory variables and the array carried from one explicit step to the next, all zero."""
    count = blocks(grid.pace.size) * grid.copies * LANES
    return zeros(count * grid.poles.size * 4), zeros(count * 2)


def _weights(grid: Grid, some: slice) -> Spectrum:
    """Weights of some slots, (pairs, slots)."""
    in_plane = (np.arange(grid.poles.size) < grid.split)[:, None]
    share = np.where(in_plane, grid.share[some], 1.0 - grid.share[some])
    weights: Spectrum = grid.weights[:, None] * share
    return weights


def step_table(grid: Grid, step: float) -> tuple[Floats, Floats]:
    """Tables of one fixed explicit step h: `table` and `fresh` of `ExplicitTables`."""
    pairs, count = grid.poles.size, blocks(grid.pace.size)
    table = zeros(count * pairs * 4 * LANES).reshape(count, pairs, 4, LANES)
    fresh = np.empty(grid.pace.size)
    for block in range(count):  # one by one: their exponentials together would take more than it
        some = slice(block * LANES, (block + 1) * LANES)
        z = np.multiply.outer(grid.poles, grid.pace[some] * step)
        decay, gain, weights = np.exp(z), step * phi(z), _weights(grid, some)
        carry = weights * decay * gain
        rows = (decay.real, decay.imag, carry.real, carry.imag)
        for row, values in enumerate(rows):
            table[block, :, row, : values.shape[1]] = values
        fresh[some] = np.sum((weights * gain).real, axis=0)
    return table.ravel(), fresh[grid.slot]


def explicit_tables(grid: Grid, step: float, table: Floats, fresh: Floats) -> ExplicitTables:
    """Tables from `step_table` with room to work, which belongs to one run."""
    modes, nodes = grid.slot.size, int(np.prod(grid.transform.shape))
    packed = zeros(blocks(grid.pace.size) * grid.copies * 2 * LANES)
    spectra, fields = rooms(2, modes, complex), rooms(2, nodes, float)
    return ExplicitTables(step, table, fresh, packed, *spectra, *fields)


@jit
def pack(place: Array, spectrum: Array, packed: Array) -> None:
    """All modes of a transform but the mean into packed order."""
    for q in range(1, spectrum.size):
        o = place[q]
        packed[o] = spectrum[q].real
        packed[o + 64] = spectrum[q].imag


@jit
def advance_memory(
    memory: Array, table: Array, rate: Array, carried: Array, pairs: int, copies: int
) -> None:
    """y <- E y + V and carried = Re sum w E B y, for all modes and pairs: the one pass."""
    size = pairs * 256
    for own in range(table.size // size):
        # Views that begin at zero: the compiler then knows that no index is negative. One of each
        # a block and none a pair: making a view costs as much as a few modes.
        e = table[own * size :][:size]
        for copy in range(copies):
            block = own * copies + copy
            y = memory[block * size :][:size]
            v, c = rate[block * 128 :][:128], carried[block * 128 :][:128]
            for j in range(128):
                c[j] = 0.0
            for p in range(pairs):
                o = p * 256
                for j in range(64):
                    er, ei = e[o + j], e[o + 64 + j]
                    cr, ci = e[o + 128 + j], e[o + 192 + j]
                    yr, yi = y[o + j], y[o + 64 + j]
                    ar = er * yr - ei * yi + v[j]
                    ai = er * yi + ei * yr
                    y[o + j] = ar
                    y[o + 64 + j] = ai
                    c[j] += cr * ar - ci * ai
                    yr, yi = y[o + 128 + j], y[o + 192 + j]
                    ar = er * yr - ei * yi + v[64 + j]
                    ai = er * yi + ei * yr
                    y[o + 128 + j] = ar
                    y[o + 192 + j] = ai
                    c[64 + j] += cr * ar - ci * ai


@jit
def carry_memory(memory: Array, table: Array, carried: Array, pairs: int, copies: int) -> Any:
    """carried = Re sum w E B y without advancing: where an explicit phase begins."""
    for block in range(carried.size // 128):
        c = carried[block * 128 :][:128]
        for j in range(128):
            c[j] = 0.0
        for p in range(pairs):
            y = memory[(block * pairs + p) * 256 :][:256]
            e = table[(block // copies * pairs + p) * 256 :][:256]
            for j in range(64):
                cr, ci = e[128 + j], e[192 + j]
                c[j] += cr * y[j] - ci * y[64 + j]
                c[64 + j] += cr * y[128 + j] - ci * y[192 + j]


def scale_memory(grid: Grid, memory: Floats, step: float, *, divide: bool) -> None:
    """psi = B y, or y = psi/B with `divide`, in place: at the switch between kinds of step."""
    count = blocks(grid.pace.size)
    y = memory.reshape(count, grid.copies, grid.poles.size, 4, LANES)
    for block in range(count):
        pace = grid.pace[block * LANES : (block + 1) * LANES]
        factor = step * phi(np.multiply.outer(grid.poles, pace * step))
        part = y[block, ..., : pace.size]
        for row in (0, 2):
            value = part[:, :, row] + 1j * part[:, :, row + 1]
            value = value / factor if divide else value * factor
            part[:, :, row], part[:, :, row + 1] = value.real, value.imag

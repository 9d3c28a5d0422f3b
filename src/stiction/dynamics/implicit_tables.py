"""Tables of an implicit step of any size, and what the memory does in it."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.dynamics.arrays import Grid, ImplicitTables
from stiction.dynamics.memory_layout import LANES, blocks, pack, rooms, zeros
from stiction.jit import jit


@jit
def _phi(z: Any) -> Any:
    return 1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0 * (1.0 + z / 5.0 * (1.0 + z / 6.0))))


@jit
def _tilt(z: Any) -> Any:
    """int_0^1 exp(z (1 - t)) (t - 1/2) dt near z = 0."""
    return -z / 12.0 * (1.0 + z / 2.0 * (1.0 + z * 0.3 * (1.0 + z * (2.0 / 9.0))))


def make_tables(grid: Grid) -> ImplicitTables:
    """Tables that are for no step yet."""
    count, pairs, slots = blocks(grid.pace.size), grid.poles.size, grid.pace.size
    modes, nodes = grid.slot.size, int(np.prod(grid.transform.shape))
    table, tilt = (zeros(count * pairs * rows * LANES) for rows in (4, 2))
    return ImplicitTables(
        np.array([-1.0, -1.0]),
        *(table, tilt, *rooms(2, slots, float), *rooms(2, modes, float)),
        *(*rooms(4, modes, complex), *rooms(8, nodes, float), np.zeros(nodes, dtype=np.int64)),
        *np.zeros((2, count * grid.copies * 2 * LANES)),
    )


@jit
def tabulate(grid: Grid, step: float, tables: ImplicitTables) -> None:
    """E and B = int_0^h exp(s |k| c_s t') dt' into `table`, packed as in `memory_layout`.

    `tilt`, [block][pair][2][64], gets the counterpart of B for a slip rate that rises linearly with
    zero mean; `fresh` and `turn` get their sums Re sum w B. On a line |k| c_s = (j + 1) pace[0], so
    the exponentials of a pole are powers of one number: a product each, with a relative error of
    1e-16 j.
    """
    table, tilt, fresh, turn = tables.table, tables.tilt, tables.fresh, tables.turn
    for j in range(fresh.size):
        fresh[j] = turn[j] = 0.0
    pairs = grid.poles.size
    for p in range(pairs):
        pole, weight = grid.poles[p], grid.weights[p]
        unit = pole * (grid.pace[0] * step)
        base = np.exp(unit)
        inverse = 1.0 / unit if grid.copies == 1 else 0.0j  # on a plane pace[0] = 0, the mean's
        decay = 1.0 + 0.0j
        for j in range(fresh.size):
            if grid.copies == 1:
                decay = decay * base
                z = unit * (j + 1)
                part = 1.0
            else:
                z = pole * (grid.pace[j] * step)
                decay = np.exp(z)
                part = grid.share[j] if p < grid.split else 1.0 - grid.share[j]
            if z.real * z.real + z.imag * z.imag < 4e-4:
                gain, lean = step * _phi(z), step * step * _tilt(z)
            else:
                per_z = inverse * (1.0 / (j + 1)) if grid.copies == 1 else 1.0 / z
                ratio = (decay - 1.0) * per_z
                gain, lean = step * ratio, step * step * ((ratio - 1.0) * per_z - 0.5 * ratio)
            o = ((j // 64) * pairs + p) * 256 + j % 64
            table[o], table[o + 64] = decay.real, decay.imag
            table[o + 128], table[o + 192] = gain.real, gain.imag
            o = ((j // 64) * pairs + p) * 128 + j % 64
            tilt[o], tilt[o + 64] = lean.real, lean.imag
            fresh[j] += part * (weight * gain).real
            turn[j] += part * (weight * lean).real


@jit
def carry(grid: Grid, memory: Array, tables: ImplicitTables) -> None:
    """Re sum w E psi of all modes into `carried`, complex: what the past leaves after the step."""
    pairs, copies, split = grid.poles.size, grid.copies, grid.split
    sums = np.empty((2, 128))  # of the pairs before `split`, and of those from there on
    for block in range(memory.size // (256 * pairs)):
        sums[:] = 0.0
        for p in range(pairs):
            # Views that begin at zero: the compiler then knows that no index is negative.
            y = memory[(block * pairs + p) * 256 :][:256]
            e = tables.table[(block // copies * pairs + p) * 256 :][:256]
            out = sums[0 if p < split else 1]
            wr, wi = grid.weights[p].real, grid.weights[p].imag
            for j in range(64):
                cr, ci = wr * e[j] - wi * e[64 + j], wr * e[64 + j] + wi * e[j]
                out[j] += cr * y[j] - ci * y[64 + j]
                out[64 + j] += cr * y[128 + j] - ci * y[192 + j]
        tables.packed[block * 128 : block * 128 + 128] = sums[0]
        tables.others[block * 128 : block * 128 + 128] = sums[1]
    for q in range(1, tables.carried.size):
        o, share = grid.place[q], grid.share[grid.slot[q]]
        rest = 1.0 - share
        tables.carried[q] = complex(
            share * tables.packed[o] + rest * tables.others[o],
            share * tables.packed[o + 64] + rest * tables.others[o + 64],
        )


@jit
def remember(grid: Grid, memory: Array, tables: ImplicitTables) -> None:
    """psi <- E psi + B V, V = `rate_hat`, with a slip rate that changes by `past_hat` in it."""
    pairs, copies = grid.poles.size, grid.copies
    pack(grid.place, tables.rate_hat, tables.packed)
    pack(grid.place, tables.past_hat, tables.others)
    for block in range(memory.size // (256 * pairs)):
        v, a = tables.packed[block * 128 :][:128], tables.others[block * 128 :][:128]
        for p in range(pairs):
            y = memory[(block * pairs + p) * 256 :][:256]
            own = block // copies * pairs + p
            e, s = tables.table[own * 256 :][:256], tables.tilt[own * 128 :][:128]
            for j in range(64):
                er, ei, gr, gi, lr, li = e[j], e[64 + j], e[128 + j], e[192 + j], s[j], s[64 + j]
                yr, yi = y[j], y[64 + j]
                y[j] = er * yr - ei * yi + gr * v[j] + lr * a[j]
                y[64 + j] = er * yi + ei * yr + gi * v[j] + li * a[j]
                yr, yi = y[128 + j], y[192 + j]
                y[128 + j] = er * yr - ei * yi + gr * v[64 + j] + lr * a[64 + j]
                y[192 + j] = er * yi + ei * yr + gi * v[64 + j] + li * a[64 + j]


@jit
def remember_growth(grid: Grid, memory: Array, rate_hat: Array, growth: float) -> Array:
    """psi of a slip rate that has always grown as exp(growth t); return Re sum w psi, (modes,)."""
    total = np.zeros(rate_hat.size, dtype=np.complex128)
    pairs = grid.poles.size
    for q in range(1, rate_hat.size):
        v, slot = rate_hat[q], grid.slot[q]
        o = grid.place[q] // 128 * pairs * 256 + grid.place[q] % 64
        for p in range(pairs):
            part = grid.share[slot] if p < grid.split else 1.0 - grid.share[slot]
            gain = 1.0 / (growth - grid.poles[p] * grid.pace[slot])
            memory[o], memory[o + 64] = gain.real * v.real, gain.imag * v.real
            memory[o + 128], memory[o + 192] = gain.real * v.imag, gain.imag * v.imag
            total[q] += part * (grid.weights[p] * gain).real * v
            o += 256
    return total

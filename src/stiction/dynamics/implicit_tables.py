"""Tables of an implicit step of any size, and what the memory does in it."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction._jit import jit
from stiction._typing import Array
from stiction.dynamics.arrays import Grid, ImplicitTables
from stiction.dynamics.memory_layout import LANES, blocks, rooms


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
    table, tilt = (np.zeros(count * pairs * rows * LANES) for rows in (4, 2))
    return ImplicitTables(
        np.array([-1.0, -1.0]),
        *(table, tilt, *rooms(2, slots, float), *rooms(2, modes, float)),
        *(*rooms(4, modes, complex), *rooms(8, nodes, float), np.zeros(nodes, dtype=np.int64)),
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
        base, inverse = np.exp(unit), 1.0 / unit
        decay = 1.0 + 0.0j
        for j in range(fresh.size):
            if grid.copies == 1:
                decay = decay * base
                z, per_z = unit * (j + 1), inverse * (1.0 / (j + 1))
                part = 1.0
            else:
                z = pole * (grid.pace[j] * step)
                decay, per_z = np.exp(z), 1.0 / z
                part = grid.share[j] if p < grid.split else 1.0 - grid.share[j]
            if z.real * z.real + z.imag * z.imag < 4e-4:
                gain, lean = step * _phi(z), step * step * _tilt(z)
            else:
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
def _address(grid: Grid, q: int) -> Any:
    """Where the first pair of a mode is: in memory, in `table` and in `tilt`."""
    pairs, lane = grid.poles.size, grid.place[q] % 64
    block = grid.place[q] // 128
    return (
        block * pairs * 256 + lane,
        block // grid.copies * pairs * 256 + lane,
        block // grid.copies * pairs * 128 + lane,
    )


@jit
def carry(grid: Grid, memory: Array, tables: ImplicitTables) -> None:
    """Re sum w E psi of all modes into `carried`, complex: what the past leaves after the step."""
    table, out = tables.table, tables.carried
    pairs, split = grid.poles.size, grid.split
    for q in range(1, out.size):
        o, t, _ = _address(grid, q)
        share = grid.share[grid.slot[q]]
        total = 0.0 + 0.0j
        for first, last, part in ((0, split, share), (split, pairs, 1.0 - share)):
            real, imaginary = 0.0, 0.0
            for p in range(first, last):
                w = grid.weights[p] * complex(table[t + p * 256], table[t + p * 256 + 64])
                y = o + p * 256
                real += w.real * memory[y] - w.imag * memory[y + 64]
                imaginary += w.real * memory[y + 128] - w.imag * memory[y + 192]
            total += complex(part * real, part * imaginary)
        out[q] = total


@jit
def remember(grid: Grid, memory: Array, tables: ImplicitTables) -> None:
    """psi <- E psi + B V, V = `rate_hat`, with a slip rate that changes by `past_hat` in it."""
    table, tilt = tables.table, tables.tilt
    for q in range(1, tables.rate_hat.size):
        v, a = tables.rate_hat[q], tables.past_hat[q]
        o, t, s = _address(grid, q)
        for _p in range(grid.poles.size):
            decay = complex(table[t], table[t + 64])
            gain = complex(table[t + 128], table[t + 192])
            lean = complex(tilt[s], tilt[s + 64])
            y = decay * complex(memory[o], memory[o + 64]) + gain * v.real + lean * a.real
            memory[o], memory[o + 64] = y.real, y.imag
            y = decay * complex(memory[o + 128], memory[o + 192]) + gain * v.imag + lean * a.imag
            memory[o + 128], memory[o + 192] = y.real, y.imag
            o, t, s = o + 256, t + 256, s + 128


@jit
def remember_growth(grid: Grid, memory: Array, rate_hat: Array, growth: float) -> Array:
    """psi of a slip rate that has always grown as exp(growth t); return Re sum w psi, (modes,)."""
    total = np.zeros(rate_hat.size, dtype=np.complex128)
    pairs = grid.poles.size
    for q in range(1, rate_hat.size):
        v, slot = rate_hat[q], grid.slot[q]
        o = _address(grid, q)[0]
        for p in range(pairs):
            part = grid.share[slot] if p < grid.split else 1.0 - grid.share[slot]
            gain = 1.0 / (growth - grid.poles[p] * grid.pace[slot])
            memory[o], memory[o + 64] = gain.real * v.real, gain.imag * v.real
            memory[o + 128], memory[o + 192] = gain.real * v.imag, gain.imag * v.imag
            total[q] += part * (grid.weights[p] * gain).real * v
            o += 256
    return total

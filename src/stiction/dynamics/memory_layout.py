"""How memory variables lie in memory: blocks of 64 modes, so that one pass stays in registers.

Modes j = 1..n/2 (the mean has no memory) are padded to whole blocks. Fourier arrays are packed as
[block][real, imaginary][64], memory variables as [block][pair][4][64] with the four rows real and
imaginary part of the memory of the real signal, then of the imaginary signal. The constant row
length lets the compiler vectorise without run-time checks of overlap.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction._jit import jit
from stiction._typing import Array
from stiction.dynamics.courant_limit import phi
from stiction.elasticity.exponential_sum import ExponentialSum

LANES = 64

Floats = NDArray[np.float64]


def blocks(nodes: int) -> int:
    """Number of blocks of modes for so many nodes."""
    return -(-(nodes // 2) // LANES)


def _packed(rows: list[Floats], count: int) -> Floats:
    """Rows of shape (pairs, modes) as [block][pair][row][64], padded with zeros, flat."""
    pairs, modes = rows[0].shape
    table = np.zeros((count, pairs, len(rows), LANES))
    for r, row in enumerate(rows):
        padded = np.zeros((pairs, count * LANES))
        padded[:, :modes] = row
        table[:, :, r, :] = padded.reshape(pairs, count, LANES).transpose(1, 0, 2)
    return table.ravel()


def step_table(kernel: ExponentialSum, pace: Floats, step: float) -> tuple[Floats, Floats, Floats]:
    """Tables of one fixed explicit step.

    Parameters
    ----------
    kernel : ExponentialSum
    pace : (n/2,) array
        k c_s of the modes j = 1..n/2, rad/s.
    step : float
        h, s.

    Returns
    -------
    decay : flat array [block][pair][4][64]
        E = exp(s k c_s h) and w E B, B = h phi(s k c_s h): the memory is kept as psi/B.
    gain : flat array [block][pair][2][64]
        B, to turn psi/B into psi and back, s.
    fresh : (n/2,) array
        Re sum_p w B: weight of the current slip rate, s.
    """
    z = np.multiply.outer(kernel.poles, pace * step)
    decay, gain = np.exp(z), step * phi(z)
    carry = kernel.weights[:, None] * decay * gain
    count = -(-pace.size // LANES)
    table = _packed([decay.real, decay.imag, carry.real, carry.imag], count)
    fresh = np.sum((kernel.weights[:, None] * gain).real, axis=0)
    return table, _packed([gain.real, gain.imag], count), fresh


@jit
def pack(spectrum: Array, packed: Array) -> None:
    """Modes 1.. of a real transform into packed order."""
    modes = spectrum.size - 1
    for j in range(modes):
        o = (j // 64) * 128 + j % 64
        packed[o] = spectrum[j + 1].real
        packed[o + 64] = spectrum[j + 1].imag


@jit
def advance_memory(memory: Array, table: Array, rate: Array, carried: Array, pairs: int) -> None:
    """y <- E y + V and carried = Re sum w E B y, for all modes and pairs: the one pass."""
    for block in range(rate.size // 128):
        so = block * 128
        for j in range(128):
            carried[so + j] = 0.0
        for p in range(pairs):
            o = (block * pairs + p) * 256
            for j in range(64):
                er, ei = table[o + j], table[o + 64 + j]
                cr, ci = table[o + 128 + j], table[o + 192 + j]
                yr, yi = memory[o + j], memory[o + 64 + j]
                ar = er * yr - ei * yi + rate[so + j]
                ai = er * yi + ei * yr
                memory[o + j] = ar
                memory[o + 64 + j] = ai
                carried[so + j] += cr * ar - ci * ai
                yr, yi = memory[o + 128 + j], memory[o + 192 + j]
                ar = er * yr - ei * yi + rate[so + 64 + j]
                ai = er * yi + ei * yr
                memory[o + 128 + j] = ar
                memory[o + 192 + j] = ai
                carried[so + 64 + j] += cr * ar - ci * ai


@jit
def carry_memory(memory: Array, table: Array, carried: Array, pairs: int) -> Any:
    """carried = Re sum w E B y without advancing: where an explicit phase begins."""
    for block in range(carried.size // 128):
        so = block * 128
        for j in range(128):
            carried[so + j] = 0.0
        for p in range(pairs):
            o = (block * pairs + p) * 256
            for j in range(64):
                cr, ci = table[o + 128 + j], table[o + 192 + j]
                carried[so + j] += cr * memory[o + j] - ci * memory[o + 64 + j]
                carried[so + 64 + j] += cr * memory[o + 128 + j] - ci * memory[o + 192 + j]


def scale_memory(memory: Floats, gain: Floats, pairs: int, *, divide: bool) -> None:
    """psi = B y, or y = psi/B with `divide`, in place: at the switch between kinds of step."""
    b = gain.reshape(-1, pairs, 2, LANES)
    factor = b[:, :, 0] + 1j * b[:, :, 1]
    factor = np.where(factor == 0.0, 1.0, factor)  # padding
    y = memory.reshape(-1, pairs, 4, LANES)
    for row in (0, 2):
        value = y[:, :, row] + 1j * y[:, :, row + 1]
        value = value / factor if divide else value * factor
        y[:, :, row], y[:, :, row + 1] = value.real, value.imag


def present_memory(memory: Floats, weights: NDArray[np.complex128], pairs: int) -> Floats:
    """Re sum w psi in packed order: the memory's part of the stress now, m."""
    y = memory.reshape(-1, pairs, 4, LANES)
    w = weights[None, :, None]
    real = np.sum(w.real * y[:, :, 0] - w.imag * y[:, :, 1], axis=1)
    imaginary = np.sum(w.real * y[:, :, 2] - w.imag * y[:, :, 3], axis=1)
    return np.stack([real, imaginary], axis=1).ravel()

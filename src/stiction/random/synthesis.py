"""Make standard normal draws from (seed, sample, mode), and Gaussian fields from draws.

Problem
-------
Compute the spectral representation (M. Shinozuka and G. Deodatis, Applied
Mechanics Reviews 44, 1991)

    z(x) = sigma_0 A_0 + sum_j sigma_j (A_j cos k_j.x + B_j sin k_j.x),                       (1)

with standard normal A_j and B_j. Sample i must depend only on the seed
and i. Within a sample, a draw must depend only on its property and
mode, not on the batch, the number of workers, the spectrum or the grid.

Draws (`Stream.draw`)
---------------------
1. On a line, 256 samples form a block that shares a generator, because a generator
   for each sample would cost more than the sample. On a plane, a sample
   has so many modes that it forms a block by itself. The generator
   depends on the seed, the property and the number of the block.
2. Inside a block the draws follow mode after mode, with A_j before B_j,
   so that a spectrum with more modes extends the same field. Draws of
   modes outside the spectrum are dropped.

Field (`synthesise`)
--------------------
3. Put mode (jx, jy) with amplitude (A - i B)/2 at k, and its conjugate at -k,
   into the half of the wave vectors that a real transform holds. Fold
   unresolved modes onto resolved modes, so that values at the nodes are
   exact on any grid.
4. Transform back, sample by sample, so that the numbers do not depend
   on the batch.

Example
-------
A line of four nodes has a single mode with sigma = 1, A = 1 and B = 0.
The field is cos(2 pi x/L):

>>> draws, sigma, numbers = np.array([[1.0, 0.0]]), np.array([0.0, 1.0]), np.array([[0, 0], [0, 1]])
>>> field = np.empty((1, 1, 4))
>>> synthesise(draws, sigma, numbers, False, field)
>>> field.round(12).tolist()
[[[1.0, 0.0, -1.0, 0.0]]]
"""

from functools import lru_cache, reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit_allocating
from stiction.base.variables import PROFILES

SAMPLES_PER_BLOCK = 256
NAMES = tuple(PROFILES)
FACTORS = (*NAMES, "pressing_force")  # what may have a factor, in the order of their streams
FIRST_FACTOR_STREAM = 1000  # number of the stream of draws of the first property's factor


def block_of(dimensions: int) -> int:
    """Return how many samples share a generator, on a line (1 dimension) or a plane (2)."""
    return SAMPLES_PER_BLOCK if dimensions == 1 else 1


class Stream(NamedTuple):
    """The draws for a property, or for a factor between specimens, among all draws in a sample."""

    number: int  # number of the stream; never changes
    block: int  # samples that share a generator
    ranks: NDArray[np.int64]  # modes drawn, rising
    mean_mode: bool  # whether the mean mode is drawn
    columns: slice = slice(None)  # of the vector of all draws
    of_property: Any = None  # those `columns` that are modes of the property itself

    def draw(self, seed: int, first: int, samples: int) -> Array:
        """Draw samples `first`, `first` + 1, ...: A_0, then A and B of mode after mode."""
        ranks, block = self.ranks, self.block
        modes = int(ranks[-1]) if ranks.size else 0
        kept: slice | NDArray[np.int64] = slice(2, None)
        if self.mean_mode or ranks.size < modes:
            kept = (2 * ranks[:, None] + np.arange(2)).ravel()
            kept = np.concatenate(([0], kept)) if self.mean_mode else kept
        draws = np.empty((samples, 2 * ranks.size + int(self.mean_mode)))
        # 1. Block after block.
        done = 0
        while done < samples:
            number, offset = divmod(first + done, block)
            count = min(block - offset, samples - done)
            place = (self.number, number, block)[: 2 if block == SAMPLES_PER_BLOCK else 3]
            key = np.random.SeedSequence(entropy=seed, spawn_key=place)
            generator = np.random.Generator(np.random.PCG64DXSM(key))
            # 2. Draw A_j and B_j of all modes, and keep the modes of
            # the spectrum.
            rows = generator.standard_normal((2 * (modes + 1), block))
            draws[done : done + count] = rows[kept, offset : offset + count].T
            done += count
        return draws


@lru_cache(maxsize=8192)
def layout(random: Any, interface: Any) -> list[Stream]:
    """Return the stream of draws for each property and each factor between specimens."""
    fields = list(random.properties.values())
    streams, start, block = [], 0, block_of(len(interface.shape))
    for name, field, row in zip(random.names, fields, random.linked, strict=True):
        # Correlated properties draw the same modes: all modes of any of them.
        group = [fields[j] for j in np.flatnonzero(row)]
        ranks = reduce(np.union1d, [linked.modes(interface).ranks for linked in group])
        mean_mode = any(linked.mean_mode for linked in group)
        columns = slice(start, start + 2 * ranks.size + int(mean_mode))
        # Columns of the group's draws that belong to modes of this field.
        places = np.searchsorted(ranks, field.modes(interface).ranks)
        pairs = int(mean_mode) + 2 * places[:, None] + np.arange(2)
        numbers: Any = np.concatenate((np.arange(int(field.mean_mode)), pairs.ravel()))
        numbers = slice(None) if numbers.size == columns.stop - start else numbers
        streams.append(Stream(NAMES.index(name), block, ranks, mean_mode, columns, numbers))
        start = columns.stop
    no_modes = np.arange(0)
    for column, name in enumerate(random.between or (), start):
        number = FIRST_FACTOR_STREAM + FACTORS.index(name)
        columns = slice(column, column + 1)
        streams.append(Stream(number, SAMPLES_PER_BLOCK, no_modes, True, columns, no_modes))
    return streams


@jit_allocating
def synthesise(
    draws: Array, sigma: Array, numbers: NDArray[np.int64], has_mean: bool, out: Array
) -> None:
    """Fill `out`, with shape (samples, rows, columns), with fields (1). A line has a single row."""
    samples, rows, columns = out.shape
    half = columns // 2
    scale = 0.5 * rows * columns
    start = 1 if has_mean else 0
    spectrum = np.empty((rows, half + 1), dtype=np.complex128)
    for i in range(samples):
        # 3. Modes of the transform.
        spectrum.fill(0.0)
        if has_mean:
            spectrum[0, 0] = 2.0 * scale * (sigma[0] * draws[i, 0])
        for m in range(1, sigma.size):
            a = scale * (sigma[m] * draws[i, start + 2 * (m - 1)])
            b = scale * (sigma[m] * draws[i, start + 2 * (m - 1) + 1])
            p, q = numbers[0, m] % rows, numbers[1, m]
            if q >= columns:
                q %= columns
            if q <= half:
                spectrum[p, q] += complex(a, -b)
            if q == 0 or q >= half:
                spectrum[-p % rows, -q % columns] += complex(a, b)
        # 4. Back.
        if rows == 1:
            row = np.fft.irfft(spectrum[0], columns)
            for q in range(columns):  # a loop, since numba takes seconds to compile slices
                out[i, 0, q] = row[q]
        else:
            field = np.fft.irfft2(spectrum, (rows, columns))
            for p in range(rows):
                for q in range(columns):
                    out[i, p, q] = field[p, q]


@jit_allocating
def condition(
    right: Array, transposed: Array, offsets: Array, factors: Array, out: Array
) -> None:
    """Replace each row a of `out` by draws given measured values, a + V (b + f V^T a).

    V is `right`, b is a row of `offsets`, and f are the `factors`.
    """
    dimension, count = right.shape
    weights = np.empty(count)
    for i in range(out.shape[0]):
        weights[:] = 0.0
        for j in range(dimension):
            draw = out[i, j]
            for k in range(count):
                weights[k] += draw * right[j, k]
        row = min(i, offsets.shape[0] - 1)
        for k in range(count):
            weight = offsets[row, k] + factors[k] * weights[k]
            for j in range(dimension):
                out[i, j] += weight * transposed[k, j]

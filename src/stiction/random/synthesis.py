"""Gaussian fields on an interface: their modes, their draws, and the sum of modes.

Problem
-------
On a periodic interface a field consists of waves with k = 2 pi (jx/Lx,
jy/Ly). Compute the spectral representation (M. Shinozuka and G.
Deodatis, Applied Mechanics Reviews 44, 1991)

    z(x) = sigma_0 A_0 + sum_j sigma_j (A_j cos k_j.x + B_j sin k_j.x),                       (1)

with standard normal A_j and B_j. With the spectral density g(k) and the
truncation K, the amplitudes have the variances

    sigma_j^2 = g(k_j) / sum_i g(k_i),   |k_j| <= K.                                          (2)

Sample i must depend only on the seed and i. Within a sample, a draw
must depend only on its property and mode, not on the batch, the number
of workers, the spectrum or the grid.

Modes (`make_modes`)
--------------------
1. List candidate wave vectors, either k or -k, in an order that depends
   only on the proportions of the interface. The position of a mode in
   this order selects its draws (`_numbers`).
2. Keep the wave vectors up to the truncation.
3. Compute (2). The mean mode k = 0 is a single wave
   vector, and every other mode represents k and -k.
   The mean mode therefore takes half of g(0).

Draws (`Stream.draw`)
---------------------
4. On a line, 256 samples form a block with one generator, because a
   generator for each sample would cost more than the sample. On a
   plane, a sample has so many modes that it forms a block by itself.
   The generator depends on the seed, the property and the number of the
   block.
5. Inside a block the draws follow mode after mode, with A_j before B_j,
   so that a spectrum with more modes extends the same field. Draws of
   modes outside the spectrum are dropped.

Field (`synthesise`)
--------------------
6. Put mode (jx, jy) with amplitude (A - i B)/2 at k, and its conjugate
   at -k, into the half of the wave vectors that a real transform holds.
   Fold unresolved modes onto resolved modes, so that values at the
   nodes are exact on any grid.
7. Transform back, sample by sample, so that the numbers do not depend
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

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.jit import jit_allocating
from stiction.base.model import check_memory
from stiction.base.variables import PROFILES
from stiction.problem.interface import Interface

MAX_MODES = 1 << 22
CUTOFF_RTOL = 1e-9  # round-off keeps a mode exactly at the truncation, such as 2.5/lambda
SAMPLES_PER_BLOCK = 256
NAMES = tuple(PROFILES)
FACTORS = (*NAMES, "pressing_force")  # what may have a factor, in the order of their streams
FIRST_FACTOR_STREAM = 1000  # number of the stream of draws of the first property's factor
FIRST_DRAW = np.zeros(1, np.int64)  # the only draw of a stream for a single number


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes of a field on an interface: the mean mode, followed by J modes."""

    interface: Interface
    # Standard deviations, (J + 1,), with unit sum of squares; the first
    # is 0 without a mean mode.
    sigma: Array
    # Wave vectors in units of 2 pi/length,
    # (dimensions, J + 1), either k or -k.
    numbers: NDArray[np.int64]
    ranks: NDArray[np.int64]  # places of modes 1..J in the order of draws, rising, (J,)
    has_mean: bool

    @property
    def draw_numbers(self) -> NDArray[np.int64]:
        """Numbers of the draws: 0 for the mean mode, and 2 j and 2 j + 1 for the mode of rank j."""
        pairs = (2 * self.ranks[:, None] + np.arange(2)).ravel()
        return np.concatenate((FIRST_DRAW, pairs)) if self.has_mean else pairs

    @property
    def unresolved(self) -> tuple[float, float]:
        """Fractions of the variance: at wavelengths that the nodes do not resolve, and in all modes
        from the largest of these on. On a plane, nodes resolve shorter waves along the diagonal.
        """
        limit = np.array(self.interface.embedding.shape)[:, None] // 2
        sigma, lost = self.sigma[1:], (np.abs(self.numbers[:, 1:]) > limit).any(axis=0)
        short = sigma <= sigma[lost].max(initial=0.0)
        return float(np.sum(sigma[lost] ** 2)), float(np.sum(sigma[short] ** 2))

    def nodes_for(self, share: float) -> list[int]:
        """Return node counts, in equal proportions, that leave at most a fraction unresolved."""
        shape = np.array(self.interface.shape)
        halves = np.array(self.interface.embedding.shape) / 2.0
        # Refinement of the present grid that resolves each mode.
        refinement = (np.abs(self.numbers) / halves[:, None]).max(axis=0)
        order = np.argsort(refinement)
        last = np.searchsorted(np.cumsum(self.sigma[order] ** 2), 1.0 - share)
        return [2 * math.ceil(n / 2 * refinement[order][last] - 1e-9) for n in shape.tolist()]

    def gaussian(self, draws: Array) -> Array:
        """Compute z(x) = sum_m sigma_m (A_m cos k_m.x + B_m sin k_m.x) as (samples, *shape).

        Each sample has its own inverse transform, so that the result
        does not depend on the batch.
        """
        shape, start = self.interface.embedding.shape, int(self.has_mean)
        numbers = np.concatenate([np.zeros_like(self.numbers), self.numbers])[-2:]
        if self.interface.is_free:
            # Move the origin to the first node, which lies half a spacing
            # from the end of a specimen.
            phase = np.pi * self.interface.first * self.numbers[0, 1:] / self.interface.size
            a, b = draws[:, start::2], draws[:, start + 1 :: 2]
            draws = draws.copy()
            draws[:, start::2] = a * np.cos(phase) + b * np.sin(phase)
            draws[:, start + 1 :: 2] = b * np.cos(phase) - a * np.sin(phase)
        out = np.empty((draws.shape[0], math.prod(shape[:-1]), shape[-1]))
        synthesise(draws, self.sigma, numbers, self.has_mean, out)
        fields = out.reshape(-1, *shape)
        return np.ascontiguousarray(fields[:, : self.interface.shape[0]])

    def basis(self, places: Array) -> Array:
        """Return phi (points, draws), with z = phi @ draws at places (dimensions, points)."""
        lengths = np.array(self.interface.embedding.lengths)[:, None]
        phase = 2.0 * np.pi * (places / lengths).T @ self.numbers[:, 1:]
        start = int(self.has_mean)
        phi = np.empty((phase.shape[0], start + 2 * self.ranks.size))
        phi[:, :start] = self.sigma[0]
        phi[:, start::2] = self.sigma[1:] * np.cos(phase)
        phi[:, start + 1 :: 2] = self.sigma[1:] * np.sin(phase)
        return phi


@lru_cache(maxsize=2048)
def make_modes(
    spectrum: Any, mean_mode: bool, anisotropy: float, interface: Interface
) -> Modes:
    """Return the modes of a spectrum.

    Raise an `InputError` if there are too many or no modes.

    A field on a specimen is half of a periodic field that is twice as
    long. With this period, the correlation at lags along the specimen
    is the same as on an infinite interface.
    """
    placed_on, interface = interface, interface.embedding
    dimensions = len(interface.shape)
    cutoff = spectrum.cutoff(dimensions)
    units = 2.0 * math.pi / np.array(interface.lengths)
    units[1:] *= anisotropy
    largest = cutoff / units * (1.0 + CUTOFF_RTOL)
    if largest.max() < 1.0 and not mean_mode:
        raise InputError(
            f"spectrum: is truncated at {cutoff:.3g} rad/m, below the first mode of an interface of"
            f" {max(interface.lengths):g} m at {units.min():.3g} rad/m. Check the unit of the"
            " correlation length (m), shorten it or raise the truncation"
        )
    # 1. and 2. Wave vectors.
    numbers = _numbers(interface, largest)
    wavenumbers = reduce(np.hypot, units[:, None] * numbers, np.zeros(1))
    kept = np.flatnonzero(wavenumbers <= cutoff * (1.0 + CUTOFF_RTOL))
    ranks, numbers = kept[1:], numbers[:, kept]
    # 3. Amplitudes.
    power = np.zeros(kept.size)
    power[1:] = spectrum.density(wavenumbers[ranks], dimensions)
    if mean_mode:
        # A mode j >= 1 represents k and -k, the mean mode for a single
        # wave vector.
        power[0] = 0.5 * float(np.ravel(spectrum.density(np.zeros(1), dimensions))[0])
    total = power.sum()
    if not (0.0 < total < np.inf and power.min() >= 0.0):
        raise InputError(
            "spectrum: its power in the modes of this interface must be positive and finite,"
            f" got a total of {total:g} and a smallest value of {power.min():g}"
        )
    sigma = np.sqrt(power / total)
    for array in (sigma, numbers, ranks):
        array.flags.writeable = False
    return Modes(placed_on, sigma, numbers, ranks, mean_mode)


def _numbers(interface: Interface, largest: Array) -> NDArray[np.int64]:
    """Step 1: return candidate wave vectors in units of 2 pi/length, in the order of draws.

    `largest` is the cutoff along each axis, in the same units. On a
    plane the order follows growing rectangles with the proportions of
    the interface, so that the draws of a mode depend on neither the
    spectrum nor the grid.
    """
    modes, along, across = float(largest[0]), 1, 1
    if interface.is_plane:
        proportion = interface.lengths[0] / interface.lengths[1]
        along, across = max(1, round(proportion)), max(1, round(1.0 / proportion))
        shells = float(np.ceil(np.max(np.floor(largest) / [along, across])))
        rectangle = 2.0 * along * across * shells * shells
        modes = max(0.5 * math.pi * float(np.prod(largest)), rectangle / 8.0)
    if not modes <= MAX_MODES:
        raise InputError(
            f"spectrum: has {modes:.10g} modes on this interface, more than the limit of"
            f" {MAX_MODES}. Truncate it earlier, or check the units of the lengths"
        )
    if not interface.is_plane:
        return np.arange(math.floor(modes) + 1)[None, :]
    jx = np.arange(-along * int(shells), along * int(shells) + 1)
    jy = np.arange(across * int(shells) + 1)
    x, y = (grid.ravel() for grid in np.meshgrid(jx, jy, indexing="ij"))
    half = (y > 0) | (x >= 0)  # either k or -k, and the constant
    x, y = x[half], y[half]
    shell = np.maximum(-(-np.abs(x) // along), -(-y // across))
    return np.stack([x, y])[:, np.lexsort((x, y, shell))]


def block_of(dimensions: int) -> int:
    """Return the samples per generator, on a line (1 dimension) or a plane (2)."""
    return SAMPLES_PER_BLOCK if dimensions == 1 else 1


class Stream(NamedTuple):
    """The draws for a property, or for a factor between specimens, among all draws in a sample."""

    number: int  # number of the stream; never changes
    block: int  # samples with the same generator
    numbers: NDArray[np.int64]  # of the draws in the stream, rising
    columns: slice = slice(None)  # of the vector of all draws
    of_property: Any = None  # those `columns` that are modes of the property itself

    def places_of(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the columns for some draws in the stream."""
        return self.columns.start + np.searchsorted(self.numbers, numbers)

    def draw(self, seed: int, first: int, samples: int) -> Array:
        """Draw samples `first`, `first` + 1, ...: A_0, then A and B of mode after mode."""
        block, draws = self.block, np.empty((samples, self.numbers.size))
        # 4. Block after block.
        done = 0
        while done < samples:
            number, offset = divmod(first + done, block)
            count = min(block - offset, samples - done)
            place = (self.number, number, block)[: 2 if block == SAMPLES_PER_BLOCK else 3]
            key = np.random.SeedSequence(entropy=seed, spawn_key=place)
            generator = np.random.Generator(np.random.PCG64DXSM(key))
            # 5. Draw A_j and B_j of all modes, and keep the modes of
            # the spectrum.
            rows = generator.standard_normal((self.numbers[-1] + 1, block))
            draws[done : done + count] = rows[self.numbers, offset : offset + count].T
            done += count
        return draws


def draws_of(
    streams: Sequence[Stream], interface: Interface, samples: int, seed: int, first: int
) -> Array:
    """Draw samples `first`, `first` + 1, ... of streams as an array (samples, dimension)."""
    # Draws, and about as many numbers in the profiles that follow from them.
    numbers = sum(stream.numbers.size + interface.size for stream in streams)
    check_memory("samples", 8.0 * min(samples, 2**62) * numbers)
    return np.concatenate([stream.draw(seed, first, samples) for stream in streams], axis=1)


@lru_cache(maxsize=8192)
def layout(random: Any, interface: Any) -> list[Stream]:
    """Return the stream of draws for each property and each factor between specimens."""
    numbers = [field.modes(interface).draw_numbers for field in random.properties.values()]
    streams, start, block = [], 0, block_of(len(interface.shape))
    for name, of_field, row in zip(random.names, numbers, random.linked, strict=True):
        # Correlated properties draw the same modes: all modes of any of them.
        group = reduce(np.union1d, [numbers[j] for j in np.flatnonzero(row)])
        columns = slice(start, start + group.size)
        of_property = np.searchsorted(group, of_field)
        streams.append(Stream(NAMES.index(name), block, group, columns, of_property))
        start = columns.stop
    for column, name in enumerate(random.between or (), start):
        number, columns = FIRST_FACTOR_STREAM + FACTORS.index(name), slice(column, column + 1)
        streams.append(Stream(number, SAMPLES_PER_BLOCK, FIRST_DRAW, columns))
    return streams


@jit_allocating
def synthesise(
    draws: Array, sigma: Array, numbers: NDArray[np.int64], has_mean: bool, out: Array
) -> None:
    """Fill `out`, with shape (samples, rows, columns), with fields (1).

    A line has a single row.
    """
    samples, rows, columns = out.shape
    half = columns // 2
    scale = 0.5 * rows * columns
    start = 1 if has_mean else 0
    spectrum = np.empty((rows, half + 1), dtype=np.complex128)
    for i in range(samples):
        # 6. Modes of the transform.
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
        # 7. Back.
        if rows == 1:
            row = np.fft.irfft(spectrum[0], columns)
            for q in range(columns):  # a loop, since numba takes seconds to compile slices
                out[i, 0, q] = row[q]
        else:
            field = np.fft.irfft2(spectrum, (rows, columns))
            for p in range(rows):
                for q in range(columns):
                    out[i, p, q] = field[p, q]

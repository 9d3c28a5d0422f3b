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

>>> draws, sigma, numbers = (
...     np.array([[1.0, 0.0]]),
...     np.array([0.0, 1.0]),
...     np.array([[0, 0], [0, 1]]),
... )
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
        """Numbers of the draws: 0 for the mean mode, and 2 j and 2 j + 1 for the mode of rank j.

        >>> sigma, numbers, ranks = np.full(3, 0.5), np.array([[0, 1, 3]]), np.array([1, 3])
        >>> line = Interface(0.1, 8)
        >>> Modes(line, sigma, numbers, ranks, has_mean=True).draw_numbers.tolist()
        [0, 2, 3, 6, 7]
        >>> Modes(line, sigma, numbers, ranks, has_mean=False).draw_numbers.tolist()
        [2, 3, 6, 7]
        """
        pairs = (2 * self.ranks[:, None] + np.arange(2)).ravel()
        return np.concatenate((FIRST_DRAW, pairs)) if self.has_mean else pairs

    @property
    def unresolved(self) -> tuple[float, float]:
        """Fractions of the variance: at wavelengths that the nodes do not resolve, and in all modes
        from the largest of these on. On a plane, nodes resolve shorter waves along the diagonal.

        Eight nodes resolve the modes up to 4. The modes 5 and 6 have the
        variance 0.35, and mode 3 has no more than mode 5.

        >>> numbers, variances = (
        ...     np.array([[0, 3, 4, 5, 6]]),
        ...     np.array([0.1, 0.15, 0.4, 0.2, 0.15]),
        ... )
        >>> modes = Modes(Interface(0.1, 8), np.sqrt(variances), numbers, np.arange(1, 5), True)
        >>> [round(fraction, 9) for fraction in modes.unresolved]
        [0.35, 0.5]
        >>> modes = Modes(
        ...     Interface(0.1, 12), np.sqrt(variances), numbers, np.arange(1, 5), True
        ... )
        >>> modes.unresolved
        (0.0, 0.0)
        >>> numbers = np.array([[0, -5, 4, 4, -1], [0, 1, 7, 8, 8]])
        >>> plane = Interface((0.1, 0.2), (8, 14))
        >>> modes = Modes(plane, np.sqrt(variances), numbers, np.arange(1, 5), True)
        >>> [round(fraction, 9) for fraction in modes.unresolved]
        [0.5, 0.5]
        """
        limit = np.array(self.interface.embedding.shape)[:, None] // 2
        sigma, lost = self.sigma[1:], (np.abs(self.numbers[:, 1:]) > limit).any(axis=0)
        short = sigma <= sigma[lost].max(initial=0.0)
        return float(np.sum(sigma[lost] ** 2)), float(np.sum(sigma[short] ** 2))

    def nodes_for(self, share: float) -> list[int]:
        """Return node counts, in equal proportions, that leave at most a fraction unresolved.

        The modes up to 5 hold 0.85 of the variance, and need ten nodes.

        >>> numbers, variances = (
        ...     np.array([[0, 3, 4, 5, 6]]),
        ...     np.array([0.1, 0.15, 0.4, 0.2, 0.15]),
        ... )
        >>> modes = Modes(Interface(0.1, 8), np.sqrt(variances), numbers, np.arange(1, 5), True)
        >>> modes.nodes_for(0.4), modes.nodes_for(0.2), modes.nodes_for(0.1)
        ([8], [10], [12])
        >>> plane, numbers = (
        ...     Interface((0.1, 0.2), (8, 16)),
        ...     np.array([[0, -5, 4, 3, -1], [0, 1, 7, 12, 8]]),
        ... )
        >>> modes = Modes(plane, np.sqrt(variances), numbers, np.arange(1, 5), True)
        >>> modes.nodes_for(0.3), modes.nodes_for(0.01)
        ([10, 20], [12, 24])
        """
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

        At the nodes it is `basis` times the draws, also with free ends, on
        planes and for modes that the nodes do not resolve.

        >>> from stiction.random.spectra import CustomSpectrum
        >>> spectrum = CustomSpectrum(lambda k: 1.0 / (900.0 + k), 700.0)
        >>> free = Interface(0.1, 8, ends="free")
        >>> for interface in (Interface(0.1, 8), free, Interface((0.1, 0.07), (12, 8))):
        ...     for mean_mode in (True, False):
        ...         modes = make_modes(spectrum, mean_mode, 1.3, interface)
        ...         grid = np.meshgrid(*interface.coordinates.values(), indexing="ij")
        ...         basis = modes.basis(np.array([places.ravel() for places in grid]))
        ...         draws = np.cos(np.arange(2 * basis.shape[1]) ** 2.0).reshape(2, -1)
        ...         z = modes.gaussian(draws)
        ...         print(z.shape, np.allclose(z.reshape(2, -1), draws @ basis.T))
        (2, 8) True
        (2, 8) True
        (2, 8) True
        (2, 8) True
        (2, 12, 8) True
        (2, 12, 8) True
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
        """Return phi (points, draws), with z = phi @ draws at places (dimensions, points).

        The mean mode, then the cosine and the sine of each mode.

        >>> sigma, numbers = np.array([0.5, 0.25, 0.75]), np.array([[0, 1, 3]])
        >>> modes = Modes(Interface(0.8, 8), sigma, numbers, np.array([1, 3]), True)
        >>> (
        ...     modes.basis(np.array([[0.0, 0.2]])).round(6) + 0.0
        ... ).tolist()  # quarters of the first wave
        [[0.5, 0.25, 0.0, 0.75, 0.0], [0.5, 0.0, 0.25, 0.0, -0.75]]
        >>> plane, numbers = Interface((0.8, 0.4), (8, 8)), np.array([[0, -1, 1], [0, 1, 0]])
        >>> modes = Modes(plane, sigma, numbers, np.array([1, 3]), False)
        >>> (modes.basis(np.array([[0.2, 0.0], [0.0, 0.1]])).round(6) + 0.0).tolist()
        [[0.0, -0.25, 0.0, 0.75], [0.0, 0.25, 0.75, 0.0]]
        """
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

    A constant density gives equal variances, and half of one to the mean.

    >>> from stiction.random.spectra import CustomSpectrum
    >>> flat = CustomSpectrum(np.ones_like, 1.2)
    >>> modes = make_modes(flat, True, 1.0, Interface(20.0 * math.pi, 32))  # k = 0.1, 0.2, ...
    >>> modes.numbers.tolist(), modes.ranks.tolist()
    ([[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]], [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12])
    >>> (modes.sigma[[0, 1, 12]] ** 2 * 12.5).round(9).tolist()
    [0.5, 1.0, 1.0]
    >>> (make_modes(flat, False, 1.0, modes.interface).sigma[[0, 1, 12]] ** 2 * 12.0).round(
    ...     9
    ... ).tolist()
    [0.0, 1.0, 1.0]

    On a plane with k = (jx / 2, jy), anisotropy multiplies jy:

    >>> plane = Interface((4.0 * math.pi, 2.0 * math.pi), (8, 8))
    >>> def vectors(anisotropy):
    ...     return sorted(
    ...         map(tuple, make_modes(flat, True, anisotropy, plane).numbers.T.tolist())
    ...     )
    >>> vectors(1.0)
    [(-1, 1), (0, 0), (0, 1), (1, 0), (1, 1), (2, 0)]
    >>> vectors(1.5)
    [(0, 0), (1, 0), (2, 0)]
    >>> vectors(0.5)
    [(-2, 1), (-1, 1), (-1, 2), (0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1)]

    With free ends the period is twice the length, and a falling density
    gives variances in proportion:

    >>> falling = CustomSpectrum(lambda k: 3.0 - k, 1.2)
    >>> modes = make_modes(
    ...     falling, True, 1.0, Interface(2.0 * math.pi, 8, ends="free")
    ... )  # k = 0, 1/2, 1
    >>> (modes.sigma**2 * 6.0).round(9).tolist(), modes.interface.length == 2.0 * math.pi
    ([1.5, 2.5, 2.0], True)
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

    >>> _numbers(Interface(0.1, 8), np.array([3.7])).tolist()
    [[0, 1, 2, 3]]

    The first rectangle on a plane of 2 to 1 has 2 columns on either side and
    one row. A second rectangle leaves these numbers as they are.

    >>> plane = Interface((0.2, 0.1), (8, 8))
    >>> first = _numbers(plane, np.array([2.4, 1.3]))
    >>> first.tolist()
    [[0, 1, 2, -2, -1, 0, 1, 2], [0, 0, 0, 1, 1, 1, 1, 1]]
    >>> second = _numbers(plane, np.array([2.4, 2.3]))
    >>> bool((second[:, :8] == first).all()), second.shape, second[:, 8:14].tolist()
    (True, (2, 23), [[3, 4, -4, -3, 3, 4], [0, 0, 1, 1, 1, 1]])
    >>> _numbers(Interface((0.1, 0.2), (8, 8)), np.array([1.3, 2.4])).tolist()
    [[0, 1, -1, 0, 1, -1, 0, 1], [0, 0, 1, 1, 1, 2, 2, 2]]
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
    """Return the samples per generator, on a line (1 dimension) or a plane (2).

    >>> block_of(1), block_of(2)
    (256, 1)
    """
    return SAMPLES_PER_BLOCK if dimensions == 1 else 1


class Stream(NamedTuple):
    """The draws for a property, or for a factor between specimens, among all draws in a sample."""

    number: int  # number of the stream; never changes
    block: int  # samples with the same generator
    numbers: NDArray[np.int64]  # of the draws in the stream, rising
    columns: slice = slice(None)  # of the vector of all draws
    of_property: Any = None  # those `columns` that are modes of the property itself

    def places_of(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the columns for some draws in the stream.

        >>> stream = Stream(0, 256, np.array([0, 2, 3, 6, 7]), slice(10, 15))
        >>> stream.places_of(np.array([2, 7])).tolist()
        [11, 14]
        """
        return self.columns.start + np.searchsorted(self.numbers, numbers)

    def draw(self, seed: int, first: int, samples: int) -> Array:
        """Draw samples `first`, `first` + 1, ...: A_0, then A and B of mode after mode.

        Block 1 begins with sample 256. Its generator also draws the numbers 0,
        1, 3 and 4.

        >>> def drawn(*key):
        ...     sequence = np.random.SeedSequence(entropy=7, spawn_key=key)
        ...     return np.random.Generator(np.random.PCG64DXSM(sequence))
        >>> draws = Stream(3, 256, np.array([2, 5])).draw(seed=7, first=254, samples=4)
        >>> bool((draws[:2] == drawn(3, 0).standard_normal((6, 256))[[2, 5], 254:].T).all())
        True
        >>> bool((draws[2:] == drawn(3, 1).standard_normal((6, 256))[[2, 5], :2].T).all())
        True
        >>> draws = Stream(3, 1, np.array([2, 5])).draw(
        ...     seed=7, first=254, samples=2
        ... )  # on a plane
        >>> bool((draws[1] == drawn(3, 255, 1).standard_normal(6)[[2, 5]]).all())
        True
        """
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
    """Draw samples `first`, `first` + 1, ... of streams as an array (samples, dimension).

    >>> streams = [Stream(number, 256, np.array([0, 4])) for number in (3, 0)]
    >>> draws = draws_of(streams, Interface(0.1, 8), samples=3, seed=7, first=2)
    >>> draws.shape, bool((draws[:, 2:] == streams[1].draw(7, 2, 3)).all())
    ((3, 4), True)
    >>> bool((draws[:, :2] == streams[0].draw(7, 2, 3)).all())
    True
    """
    # Draws, and about as many numbers in the profiles that follow from them.
    numbers = sum(stream.numbers.size + interface.size for stream in streams)
    check_memory("samples", 8.0 * min(samples, 2**62) * numbers)
    return np.concatenate([stream.draw(seed, first, samples) for stream in streams], axis=1)


@lru_cache(maxsize=8192)
def layout(random: Any, interface: Any) -> list[Stream]:
    """Return the stream of draws for each property and each factor between specimens.

    The strength has one mode, and the residual strength a mean mode too.
    They are correlated, so both draw the numbers 0, 2 and 3.

    >>> import stiction as st
    >>> marginal, spectrum = st.Lognormal(mean=2e6, cv=0.2), st.SquaredExponentialSpectrum(0.06)
    >>> a, b = (st.RandomField(marginal, spectrum, mean_mode=mean) for mean in (False, True))
    >>> random = st.RandomInterface(
    ...     strength=a,
    ...     residual_strength=b,
    ...     normal_pressure=a,
    ...     correlation={("strength", "residual_strength"): 0.5},
    ...     between=dict.fromkeys(
    ...         ["pressing_force", "critical_slip"], st.Lognormal(mean=1.0, cv=0.1)
    ...     ),
    ... )
    >>> for stream in layout(random, Interface(0.1, 8)):
    ...     columns = stream.columns.start, stream.columns.stop
    ...     modes = [] if stream.of_property is None else stream.of_property.tolist()
    ...     print(stream.number, stream.numbers.tolist(), columns, modes)
    0 [0, 2, 3] (0, 3) [1, 2]
    1 [0, 2, 3] (3, 6) [0, 1, 2]
    6 [2, 3] (6, 8) [0, 1]
    1007 [0] (8, 9) []
    1004 [0] (9, 10) []
    >>> {stream.block for stream in layout(random, Interface(0.1, 8))}
    {256}
    >>> [stream.block for stream in layout(random, Interface((0.1, 0.05), (8, 8)))]
    [1, 1, 1, 256, 256]
    """
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

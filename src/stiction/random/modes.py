"""The modes of a field: waves on an interface and their amplitudes.

Problem
-------
On a periodic interface a field consists of waves with k = 2 pi (jx/Lx, jy/Ly). With
the spectral density g(k) and the truncation K, the amplitudes have the variances

    sigma_j^2 = g(k_j) / sum_i g(k_i),   |k_j| <= K.                                          (1)

Algorithm (`make_modes`)
------------------------
1. List candidate wave vectors, either k or -k, in an order that depends only on the
   proportions of the interface. The position of a mode in this order
   selects its draws (`_numbers`).
2. Keep the wave vectors up to the truncation.
3. Compute (1). The mean mode k = 0 is a single wave
   vector, and every other mode stands for k and -k.
   The mean mode therefore takes half of g(0).
"""

import math
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.problem.interface import Interface
from stiction.random.synthesis import synthesise

MAX_MODES = 1 << 22
CUTOFF_RTOL = 1e-9  # round-off keeps a mode exactly at the truncation, such as 2.5/lambda


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
    def dimension(self) -> int:
        """Number of standard normal draws for a sample."""
        return 2 * self.ranks.size + int(self.has_mean)

    @property
    def unresolved(self) -> float:
        """Fraction of the variance at wavelengths that the nodes do not resolve."""
        limit = np.array(self.interface.embedding.shape)[:, None] // 2
        return float(np.sum(self.sigma[(np.abs(self.numbers) > limit).any(axis=0)] ** 2))

    def nodes_for(self, share: float) -> list[int]:
        """Return how many nodes leave at most a given fraction unresolved, in equal proportions."""
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
        numbers, shape = self.numbers, self.interface.embedding.shape
        if len(shape) == 1:
            numbers = np.concatenate([np.zeros_like(numbers), numbers])
        if self.interface.is_free:
            draws = self._from_first_node(draws)
        out = np.empty((draws.shape[0], math.prod(shape[:-1]), shape[-1]))
        synthesise(draws, self.sigma, numbers, self.has_mean, out)
        fields = out.reshape(-1, *shape)
        if self.interface.is_free:
            return np.ascontiguousarray(fields[:, : self.interface.size])
        return fields

    def _from_first_node(self, draws: Array) -> Array:
        """Return draws for the same waves, with the origin moved to the first node.

        The first node of a specimen lies half a spacing from its end.
        """
        phase = np.pi * self.interface.first * self.numbers[0, 1:] / self.interface.size
        start, shifted = int(self.has_mean), draws.copy()
        a, b = draws[:, start::2], draws[:, start + 1 :: 2]
        shifted[:, start::2] = a * np.cos(phase) + b * np.sin(phase)
        shifted[:, start + 1 :: 2] = b * np.cos(phase) - a * np.sin(phase)
        return shifted

    def basis(self, places: Array) -> Array:
        """Return phi (points, dimension), with z = phi @ draws at places (dimensions, points)."""
        lengths = np.array(self.interface.embedding.lengths)[:, None]
        phase = 2.0 * np.pi * (places / lengths).T @ self.numbers[:, 1:]
        phi = np.empty((phase.shape[0], self.dimension))
        start = int(self.has_mean)
        phi[:, :start] = self.sigma[0]
        phi[:, start::2] = self.sigma[1:] * np.cos(phase)
        phi[:, start + 1 :: 2] = self.sigma[1:] * np.sin(phase)
        return phi


@lru_cache(maxsize=2048)
def make_modes(
    spectrum: Any, mean_mode: bool, anisotropy: float, interface: Interface
) -> Modes:
    """Return the modes of a spectrum. Raise an `InputError` if there are too many or no modes.

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
        # A mode j >= 1 stands for k and -k, the mean mode for a single
        # wave vector.
        power[0] = 0.5 * float(np.ravel(spectrum.density(np.zeros(1), dimensions))[0])
    total = power.sum()
    if not (0.0 < total < np.inf and power.min() >= 0.0):
        raise InputError(
            "spectrum: its power in the modes of this interface must be positive and finite,"
            f" got {total:g} in all and {power.min():g} in a mode"
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
    if largest.size == 1:
        _refuse_too_many(largest[0])
        return np.arange(math.floor(largest[0]) + 1)[None, :]
    proportion = interface.lengths[0] / interface.lengths[1]
    along, across = max(1, round(proportion)), max(1, round(1.0 / proportion))
    count = float(np.ceil(np.max(np.floor(largest) / [along, across])))
    rectangle = 2.0 * along * across * count * count
    _refuse_too_many(max(0.5 * math.pi * float(np.prod(largest)), rectangle / 8.0))
    shells = int(count)
    jx = np.arange(-along * shells, along * shells + 1)
    jy = np.arange(across * shells + 1)
    x, y = (grid.ravel() for grid in np.meshgrid(jx, jy, indexing="ij"))
    half = (y > 0) | (x >= 0)  # either k or -k, and the constant
    x, y = x[half], y[half]
    shell = np.maximum(-(-np.abs(x) // along), -(-y // across))
    return np.stack([x, y])[:, np.lexsort((x, y, shell))]


def _refuse_too_many(modes: float) -> None:
    if not modes <= MAX_MODES:
        raise InputError(
            f"spectrum: has {modes:.10g} modes on this interface, at most {MAX_MODES} are"
            " allowed. Truncate it earlier, or check the units of the lengths"
        )

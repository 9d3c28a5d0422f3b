"""The discrete spectrum of a field: the waves on an interface and their amplitudes."""

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

MOST_MODES = 1 << 22
NEAREST_MODE = 1.0 + 1e-9
"""Factor on the truncation, so that round-off keeps a mode exactly at it, such as 2.5/lambda."""


@dataclass(frozen=True, eq=False)
class Modes:
    """The discrete spectrum on an interface: J modes, and the mean mode in front."""

    interface: Interface
    sigma: Array  # standard deviations, (J + 1,), of unit sum of squares; 0 without a mean
    numbers: NDArray[np.int64]  # wave vectors over 2 pi/length, (dimensions, J + 1); of +-k one
    ranks: NDArray[np.int64]  # places of modes 1..J in the order of draws, rising, (J,)
    has_mean: bool

    @property
    def dimension(self) -> int:
        """Number of standard normal draws a sample."""
        return 2 * self.ranks.size + int(self.has_mean)

    @property
    def unresolved(self) -> float:
        """Share of the variance at wavelengths that the nodes do not resolve."""
        limit = np.array(self.interface.embedding.shape)[:, None] // 2
        return float(np.sum(self.sigma[(np.abs(self.numbers) > limit).any(axis=0)] ** 2))

    def nodes_for(self, share: float) -> list[int]:
        """Return how many nodes leave at most this share unresolved, at the proportions given."""
        shape = np.array(self.interface.shape)
        halves = np.array(self.interface.embedding.shape) / 2.0
        finer = (np.abs(self.numbers) / halves[:, None]).max(axis=0)  # than now, to resolve it
        order = np.argsort(finer)
        last = np.searchsorted(np.cumsum(self.sigma[order] ** 2), 1.0 - share)
        return [2 * math.ceil(n / 2 * finer[order][last] - 1e-9) for n in shape.tolist()]

    def gaussian(self, draws: Array) -> Array:
        """Compute z(x) = sum_m sigma_m (A_m cos k_m.x + B_m sin k_m.x), (samples, *shape).

        One inverse transform a sample, so that the numbers do not depend on the batch.
        """
        numbers, shape = self.numbers, self.interface.embedding.shape
        if len(shape) == 1:
            numbers = np.concatenate([np.zeros_like(numbers), numbers])
        if self.interface.is_free:
            draws = self._from_first_node(draws)
        out = np.empty((draws.shape[0], math.prod(shape[:-1]), shape[-1]))
        synthesise(draws, self.sigma, numbers, self.has_mean, out)
        found = out.reshape(-1, *shape)
        if self.interface.is_free:
            return np.ascontiguousarray(found[:, : self.interface.size])
        return found

    def _from_first_node(self, draws: Array) -> Array:
        """Return the draws of the same waves counted from the first node, half a spacing on."""
        turn = np.pi * self.interface.first * self.numbers[0, 1:] / self.interface.size
        start, turned = int(self.has_mean), draws.copy()
        a, b = draws[:, start::2], draws[:, start + 1 :: 2]
        turned[:, start::2] = a * np.cos(turn) + b * np.sin(turn)
        turned[:, start + 1 :: 2] = b * np.cos(turn) - a * np.sin(turn)
        return turned

    def basis(self, places: Array) -> Array:
        """Return phi, (points, dimension): z at places (dimensions, points) is phi @ draws."""
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
    """Find the modes of a spectrum; `InputError` if there are too many, or none.

    A field on a specimen is one of twice its length, cut: with that period its correlation
    along the specimen is that of an endless one.
    """
    own, interface = interface, interface.embedding
    dimensions = len(interface.shape)
    cutoff = spectrum.cutoff(dimensions)
    units = 2.0 * math.pi / np.array(interface.lengths)
    units[1:] *= anisotropy
    reach = cutoff / units * NEAREST_MODE
    if reach.max() < 1.0 and not mean_mode:
        raise InputError(
            f"spectrum: no mode is left on an interface of {max(interface.lengths):g} m: the first"
            f" is at {units.min():.3g} rad/m, the spectrum is truncated at {cutoff:.3g} rad/m;"
            " shorten the correlation length, lengthen the interface or raise the truncation"
        )
    numbers = _numbers(interface, reach)
    wavenumbers = reduce(np.hypot, units[:, None] * numbers, np.zeros(1))
    kept = np.flatnonzero(wavenumbers <= cutoff * NEAREST_MODE)
    ranks, numbers = kept[1:], numbers[:, kept]
    power = np.zeros(kept.size)
    power[1:] = spectrum.density(wavenumbers[ranks], dimensions)
    if mean_mode:
        # A mode j >= 1 stands for the wave vectors k and -k, the mean mode for one of them only.
        power[0] = 0.5 * float(spectrum.density(np.zeros(1), dimensions)[0])
    total = power.sum()
    if not 0.0 < total < np.inf:
        raise InputError(
            "spectrum: its power in the modes of this interface must be positive and finite,"
            f" got {total:g}"
        )
    sigma = np.sqrt(power / total)
    for array in (sigma, numbers, ranks):
        array.flags.writeable = False
    return Modes(own, sigma, numbers, ranks, mean_mode)


def _numbers(interface: Interface, reach: Array) -> NDArray[np.int64]:
    """Wave vectors over 2 pi/length among which the modes are, in the order of draws.

    On a plane that is the order of growing rectangles of its proportions, so that a mode
    has the same draws whatever the spectrum and the grid.
    """
    if reach.size == 1:
        _refuse_too_many(reach[0])
        return np.arange(math.floor(reach[0]) + 1)[None, :]
    proportion = interface.lengths[0] / interface.lengths[1]
    along, across = max(1, round(proportion)), max(1, round(1.0 / proportion))
    count = float(np.ceil(np.max(np.floor(reach) / [along, across])))
    rectangle = 2.0 * along * across * count * count
    _refuse_too_many(max(0.5 * math.pi * float(np.prod(reach)), rectangle / 8.0))
    shells = int(count)
    jx = np.arange(-along * shells, along * shells + 1)
    jy = np.arange(across * shells + 1)
    x, y = (part.ravel() for part in np.meshgrid(jx, jy, indexing="ij"))
    half = (y > 0) | (x >= 0)  # of k and -k one, and the constant
    x, y = x[half], y[half]
    shell = np.maximum(-(-np.abs(x) // along), -(-y // across))
    return np.stack([x, y])[:, np.lexsort((x, y, shell))]


def _refuse_too_many(modes: float) -> None:
    if not modes <= MOST_MODES:
        raise InputError(
            f"spectrum: has {modes:.10g} modes on this interface, at most {MOST_MODES} are"
            " allowed; truncate it earlier, or check the units of the lengths"
        )

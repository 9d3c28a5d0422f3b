"""The discrete spectrum of a field: which waves an interface holds, and how strong each is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.interface import Interface

MOST_MODES = 1 << 22
HAIR = 1.0 + 1e-12
"""Tolerance of the truncation: 2.5 lambda may fall exactly on a mode."""


@dataclass(frozen=True, eq=False)
class Modes:
    """The discrete spectrum on an interface.

    Attributes
    ----------
    sigma : (J + 1,) array
        Standard deviations sigma_j of modes 0..J; their squares sum to 1. sigma_0 is zero without
        the mean mode.
    numbers : (dimensions, J + 1) array of int
        Their wave vectors in units of 2 pi/length; of k and -k, one.
    ranks : (J,) array of int
        Place of modes 1..J in the order of draws, rising: a mode has its draws by this, whatever
        the spectrum leaves out. On a line it is the number of the wave.
    dimension : int
        Number of standard normal draws a sample.
    """

    sigma: Array
    numbers: NDArray[np.int64]
    ranks: NDArray[np.int64]
    dimension: int

    @property
    def count(self) -> int:
        """J, the number of modes without the mean; on a line the highest."""
        return self.sigma.size - 1

    @property
    def highest(self) -> tuple[int, ...]:
        """Largest wave number in each direction, in units of 2 pi/length."""
        return tuple(int(most) for most in np.abs(self.numbers).max(axis=1))

    def lengths(self, interface: Interface, anisotropy: float = 1.0) -> Array:
        """Length of the wave vectors, rad/m, (J + 1,); along y times the anisotropy."""
        return _length(self.numbers, _units(interface, anisotropy))

    def unresolved(self, interface: Interface) -> float:
        """Share of the variance at wavelengths that the nodes do not resolve."""
        limit = np.array(interface.shape)[:, None] // 2
        return float(np.sum(self.sigma[(np.abs(self.numbers) > limit).any(axis=0)] ** 2))


def _units(interface: Interface, anisotropy: float) -> Array:
    """Wavenumber of the first wave in each direction, rad/m; along y times the anisotropy."""
    result: Array = 2.0 * math.pi / np.array(interface.lengths)
    result[1:] *= anisotropy
    return result


def _length(numbers: NDArray[Any], units: Array) -> Array:
    result: Array = np.abs(units[0] * numbers[0])
    return result if units.size == 1 else np.hypot(result, units[1] * numbers[1])


def make_modes(spectrum: Any, mean_mode: bool, anisotropy: float, interface: Interface) -> Modes:
    """Find the modes of a spectrum: wave vectors on a line, or in an ellipse; of k and -k one.

    On a plane they are in the order of growing rectangles of its proportions, so that a mode has
    the same draws whatever the spectrum, its truncation and the grid.

    Raises
    ------
    InputError
        If there are too many modes, or none.
    """
    dimensions = len(interface.shape)
    cutoff = spectrum.cutoff(dimensions)
    units = _units(interface, anisotropy)
    numbers = _numbers(interface, cutoff, cutoff / units * HAIR, mean_mode)
    length = _length(numbers, units)
    kept = np.flatnonzero(length <= cutoff * HAIR)
    power = np.zeros(kept.size)
    power[1:] = spectrum.density(length[kept[1:]], dimensions)
    if mean_mode:
        # A mode j >= 1 stands for the wave vectors k and -k, the mean mode for one of them only.
        power[0] = 0.5 * float(spectrum.density(np.zeros(1), dimensions)[0])
    total = power.sum()
    if not 0.0 < total < np.inf:
        raise InputError(
            "spectrum: its power in the modes of this interface must be positive and finite,"
            f" got {total:g}"
        )
    sigma, numbers, ranks = np.sqrt(power / total), numbers[:, kept], kept[1:]
    for array in (sigma, numbers, ranks):
        array.flags.writeable = False
    return Modes(sigma, numbers, ranks, 2 * ranks.size + int(mean_mode))


def _numbers(
    interface: Interface, cutoff: float, reach: Array, mean_mode: bool
) -> NDArray[np.int64]:
    """Wave vectors in units of 2 pi/length among which the modes are, in the order of draws."""
    size = " x ".join(f"{length:g}" for length in interface.lengths)
    # Half of the ellipse, and at least of one direction.
    most = max(0.5 * math.pi * float(np.prod(reach)), reach.max()) if reach.size > 1 else reach[0]
    if not most <= MOST_MODES:
        raise InputError(
            f"spectrum: has {most:.10g} modes on an interface of {size} m, at most"
            f" {MOST_MODES} are possible; truncate it earlier, or check the units of the lengths"
        )
    if reach.max() < 1.0 and not mean_mode:
        first = 2.0 * math.pi / max(interface.lengths)
        raise InputError(
            f"spectrum: no mode is left on an interface of {size} m: the first mode"
            f" is at {first:.3g} rad/m, the spectrum is truncated at"
            f" {cutoff:.3g} rad/m; shorten the correlation length, lengthen the"
            " interface or raise the truncation"
        )
    if reach.size == 1:
        return np.arange(math.floor(reach[0]) + 1)[None, :]
    proportion = interface.lengths[0] / interface.lengths[1]
    along, across = max(1, round(proportion)), max(1, round(1.0 / proportion))
    shells = float(np.ceil(np.max(np.floor(np.minimum(reach, 1e9)) / [along, across])))
    boxed = 2.0 * along * across * shells * shells
    if boxed > 8.0 * MOST_MODES:
        raise InputError(
            f"spectrum: on a plane of these proportions its modes are found among {boxed:.10g}, at"
            f" most {8 * MOST_MODES} are possible; truncate it earlier"
        )
    shells = int(shells)
    jx = np.arange(-along * shells, along * shells + 1)
    jy = np.arange(across * shells + 1)
    x, y = (part.ravel() for part in np.meshgrid(jx, jy, indexing="ij"))
    half = (y > 0) | (x >= 0)  # of k and -k one, and the constant
    x, y = x[half], y[half]
    shell = np.maximum(-(-np.abs(x) // along), -(-y // across))
    return np.stack([x, y])[:, np.lexsort((x, y, shell))]

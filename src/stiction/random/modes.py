"""The discrete spectrum of a field: which waves an interface holds, and how strong each is."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.interface import Interface

MOST_MODES = 1 << 22


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
        return _length(self.numbers, interface, anisotropy)

    def unresolved(self, interface: Interface) -> float:
        """Share of the variance at wavelengths that the nodes do not resolve."""
        limit = np.array(interface.shape)[:, None] // 2
        return float(np.sum(self.sigma[(np.abs(self.numbers) > limit).any(axis=0)] ** 2))


def _length(numbers: NDArray[Any], interface: Interface, anisotropy: float) -> Array:
    unit = 2.0 * math.pi / np.array(interface.lengths)
    if numbers.shape[0] == 1:
        return unit[0] * np.abs(numbers[0])
    return np.hypot(unit[0] * numbers[0], anisotropy * unit[1] * numbers[1])


def _made(power: Array, numbers: NDArray[Any], ranks: NDArray[Any], mean_mode: bool) -> Modes:
    total = power.sum()
    if not 0.0 < total < np.inf:
        raise InputError(
            "spectrum: its power in the modes of this interface must be positive and finite,"
            f" got {total:g}"
        )
    sigma = np.sqrt(power / total)
    for array in (sigma, numbers, ranks):
        array.flags.writeable = False
    return Modes(sigma, numbers, ranks, 2 * (power.size - 1) + int(mean_mode))


def _check(most: float, cutoff: float, mean_mode: bool, interface: Interface) -> None:
    """Refuse spectra with too many modes on an interface, or with none."""
    size = " x ".join(f"{length:g}" for length in interface.lengths)
    if not most <= MOST_MODES:
        raise InputError(
            f"spectrum: has {most:.10g} modes on an interface of {size} m, at most"
            f" {MOST_MODES} are possible; truncate it earlier, or check the units of the lengths"
        )
    if most < 1.0 and not mean_mode:
        first = 2.0 * math.pi / max(interface.lengths)
        raise InputError(
            f"spectrum: no mode is left on an interface of {size} m: the first mode"
            f" is at {first:.3g} rad/m, the spectrum is truncated at"
            f" {cutoff:.3g} rad/m; shorten the correlation length, lengthen the"
            " interface or raise the truncation"
        )


def _power(density: Callable[[Array], Array], k: Array, mean_mode: bool) -> Array:
    """Power of modes 0..J at wavenumbers k."""
    power = np.zeros(k.size)
    power[1:] = density(k[1:])
    if mean_mode:
        # A mode j >= 1 stands for the wavenumbers k and -k, the mean mode for one of them only.
        power[0] = 0.5 * float(density(np.zeros(1))[0])
    return power


def line_modes(spectrum: Any, mean_mode: bool, interface: Interface) -> Modes:
    """The modes of a spectrum on a line."""
    spacing = 2.0 * math.pi / interface.extent
    # A hair of tolerance: 2.5 lambda may fall exactly on a mode.
    most = spectrum.cutoff / spacing * (1.0 + 1e-12)
    _check(most, spectrum.cutoff, mean_mode, interface)
    j = np.arange(math.floor(most) + 1)
    power = _power(spectrum.density, spacing * j, mean_mode)
    return _made(power, j[None, :], j[1:].copy(), mean_mode)


def plane_modes(spectrum: Any, mean_mode: bool, anisotropy: float, interface: Interface) -> Modes:
    """The modes of a spectrum on a plane: wave vectors in an ellipse, of k and -k one.

    They are in the order of growing rectangles of the proportions of the plane, so that a mode has
    the same draws whatever the spectrum, its truncation and the grid.
    """
    cutoff = spectrum.plane_cutoff
    units = 2.0 * math.pi / np.array(interface.lengths) * np.array([1.0, anisotropy])
    reach = cutoff / units * (1.0 + 1e-12)
    proportion = interface.lengths[0] / interface.lengths[1]
    along, across = max(1, round(proportion)), max(1, round(1.0 / proportion))
    shells = np.ceil(np.max(np.floor(np.minimum(reach, 1e9)) / [along, across]))
    # Of the rectangle that is looked through, and at least of the half of it that counts.
    most = float(max(0.5 * math.pi * reach[0] * reach[1], reach.max()))
    _check(most if reach.max() >= 1.0 else 0.0, cutoff, mean_mode, interface)
    boxed = 2.0 * along * across * shells * shells
    if boxed > 8.0 * MOST_MODES:
        raise InputError(
            f"spectrum: on a plane of these proportions its modes are found among {boxed:.10g}, at"
            f" most {8 * MOST_MODES} are possible; truncate it earlier"
        )
    size = int(shells)
    jx = np.arange(-along * size, along * size + 1)
    jy = np.arange(across * size + 1)
    x, y = (part.ravel() for part in np.meshgrid(jx, jy, indexing="ij"))
    half = (y > 0) | (x >= 0)  # of k and -k one, and the constant
    x, y = x[half], y[half]
    shell = np.maximum(-(-np.abs(x) // along), -(-y // across))
    order = np.lexsort((x, y, shell))
    numbers = np.stack([x[order], y[order]])
    length = _length(numbers, interface, anisotropy)
    kept = np.flatnonzero(length <= cutoff * (1.0 + 1e-12))
    power = _power(spectrum.plane_density, length[kept], mean_mode)
    return _made(power, np.ascontiguousarray(numbers[:, kept]), kept[1:], mean_mode)

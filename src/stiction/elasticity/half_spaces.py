"""Two half-spaces that meet on a periodic line or plane: the symbol of their static stiffness.

Slip has one component, along x, the direction of the load. With a wave vector (kx, ky) of
length k and a = (kx/k)^2 the stiffness is

    K(k) = (G* a + G (1 - a)) k/2,

mode II along x and mode III along y (Geubelle and Rice 1995); a line has the modulus of its mode.
"""

import functools
from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array

SMALLEST_EIGENVALUE = 0.5788869418506
"""lambda_0 in the nucleation length h_n = 2 lambda_0 G*/W (Uenishi and Rice, 2003)."""


class HalfSpaces(NamedTuple):
    """Periods (m) and moduli (Pa) along each direction.

    The moduli are G* of the mode on a line, G* and G on a plane.
    """

    lengths: tuple[float, ...]
    moduli: tuple[float, ...]

    def symbol(self, shape: tuple[int, ...]) -> Array:
        """Return K(k), Pa/m, for the modes of ``numpy.fft.rfftn`` of an interface; read-only."""
        return _symbol(*self, shape)

    def nucleation_lengths(self, rate: float) -> tuple[float, ...]:
        """Return h_n of a weakening rate (Pa/m) in each direction, m."""
        return tuple(2.0 * SMALLEST_EIGENVALUE * modulus / rate for modulus in self.moduli)


@functools.lru_cache(maxsize=16)
def _symbol(
    lengths: tuple[float, ...], moduli: tuple[float, ...], shape: tuple[int, ...]
) -> Array:
    last = 2.0 * np.pi / lengths[-1] * np.arange(shape[-1] // 2 + 1)
    if len(shape) == 1:
        symbol: Array = 0.5 * moduli[0] * last
    else:
        first = 2.0 * np.pi * np.fft.fftfreq(shape[0], lengths[0] / shape[0])[:, None]
        k = np.hypot(first, last[None, :])
        k[0, 0] = 1.0  # both terms are zero there
        symbol = 0.5 * (moduli[0] * first**2 + moduli[1] * last**2) / k
    symbol.flags.writeable = False
    return symbol

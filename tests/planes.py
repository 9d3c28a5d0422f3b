"""Planes on which every entry of K off its diagonal is negative, so that the theory is strict."""

from __future__ import annotations

import numpy as np

from stiction.elasticity.protocol import HalfSpaces


class Lattice(HalfSpaces):
    """A plane with the wavenumbers (2/h) sin(k h/2) of a lattice, up to nu = 0.45 a Z-matrix."""

    def symbol(self, shape):
        (n, m), (length, width) = shape, self.lengths
        first = 2.0 * n / length * np.sin(np.pi * np.arange(n) / n)[:, None]
        second = 2.0 * m / width * np.sin(np.pi * np.arange(m // 2 + 1) / m)
        k = np.hypot(first, second)
        k[0, 0] = 1.0
        return 0.5 * (self.moduli[0] * first**2 + self.moduli[1] * second**2) / k


WAVENUMBERS = {"spectral": HalfSpaces, "lattice": Lattice}


def moduli(modulus, ratio):
    """G* along x and G along y, of a shear modulus and Poisson's ratio."""
    return modulus / (1.0 - ratio), modulus

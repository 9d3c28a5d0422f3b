"""Closed forms beside a free end: slip on an interface that ends there, and a push on the end.

The half-space x > 0 has a free surface x = 0 and an interface y = 0. Fields are given by Goursat's
functions (`rectangle`), imaginary on the real axis, and found from those of the full space by
reflection on the free surface (Muskhelishvili 1953, chapter 18).
"""

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.rectangle import Goursat

CORRECTION = 1.0 / 12.0
"""Half of the 1/6 with which the symbol would be right to fourth order.

The error that remains and that of a border of slip that lies between nodes, of the same order, have
opposite signs: with 1/12 the mean error of onsets vanishes (measured with random strengths).
"""


def point_slip(place: Array, z: Array, modulus: float) -> Goursat:
    """Return the field of a unit of slip (m²) at places on the interface of a full space.

    The modulus is G*, Pa. Shear stress on the interface: (G*/2 pi)/(x - s)².
    """
    a, d = 0.25j * modulus / np.pi, z - place
    return Goursat(a / d, -a / d**2, 2.0 * a / d**3, a * place / d**2, -2.0 * a * place / d**3)


def image_slip(place: Array, z: Array, modulus: float) -> Goursat:
    """Return what the free surface x = 0 adds to the field of a point of slip at x = s > 0.

    Shear stress on the interface: (G*/2 pi) [12 x s/(x + s)^4 - 1/(x + s)²].
    """
    a, p = 0.25j * modulus / np.pi, z + place
    f = a * (place - z) / p**2
    df = a * (z - 3.0 * place) / p**3
    ddf = a * (10.0 * place - 2.0 * z) / p**4
    return Goursat(f, df, ddf, z * df - a / p, df + z * ddf + a / p**2)


def push(low: float, high: float, z: Array) -> Goursat:
    """Return the field of a unit force (N/m) on low < y < high of the free surface, along x.

    The mirror image of the force acts the other way.
    """
    f, df, ddf = np.zeros((3, *z.shape), complex)
    for place, sign in ((low, 1.0), (high, -1.0)):
        for arm in (z - 1j * place, z + 1j * place):
            log = np.log(arm)
            f, df, ddf = f + sign * arm * log, df + sign * log, ddf + sign / arm
    scale = 0.5j / (np.pi * (high - low))
    f, df, ddf = scale * f, scale * df, scale * ddf
    return Goursat(f, df, ddf, z * df - f, z * ddf)


def turned(field: Goursat, length: float) -> Goursat:
    """Return the field at z of a block that is turned by half a turn, from its values at L - z.

    Slip keeps its sign, and a push at the left end becomes a pull at the right one.
    """
    f, df, ddf, g, dg = field
    return Goursat(-f, df, -ddf, -g - length * df, dg + length * ddf)


def lattice_symbol(angle: Array) -> Array:
    """Return the symbol |k| dx of the lattice for angles k dx; all entries but one are negative.

    |k| dx is 2 arcsin(s) = 2 s (1 + s²/6 + ...), with s = |sin(k dx/2)|. The exact symbol has a
    kink at the shortest wave, and its entries are zero at every other distance; a smooth
    correction, such as that of a finite block, would make them positive.
    """
    s = np.abs(np.sin(0.5 * angle))
    symbol: Array = 2.0 * s * (1.0 + CORRECTION * s * s)
    return symbol


def lattice_entries(count: int) -> Array:
    """Return the entries of `lattice_symbol` at distances 0, ..., count - 1 on an endless line.

    Those of 2 s are -1/(pi (j² - 1/4)); s² is -1/4, 1/2, -1/4.
    """
    j = np.arange(-1.0, count + 1.0)
    entries = -1.0 / (np.pi * (j * j - 0.25))
    second: Array = 0.5 * entries[1:-1] - 0.25 * (entries[:-2] + entries[2:])
    return entries[1:-1] + CORRECTION * second


def stiffness_between_ends(nodes: int, spacing: float, modulus: float) -> Array:
    """Return K of an interface with two free ends that do not feel each other, (n, n), Pa/m.

    Nodes lie at (i + 1/2) dx. To the lattice and its mirror images at both ends comes the rest of
    `image_slip`, (G*/2 pi)(12 x s/(x + s)^4 - 2/(x + s)²), averaged over the cells of x and s: it
    is the mixed derivative of (G*/pi) x s/(x + s)².
    """
    entries, i = lattice_entries(2 * nodes), np.arange(nodes)
    mirrored = i[:, None] + i
    both = entries[np.abs(i[:, None] - i)] + entries[mirrored + 1] + entries[::-1][mirrored]
    edge = np.arange(nodes + 1.0)
    share = np.outer(edge, edge) / np.maximum(np.add.outer(edge, edge), 1.0) ** 2
    rest = np.diff(np.diff(share, axis=0), axis=1) * (2.0 / np.pi)
    stiffness: Array = (0.5 * modulus / spacing) * (both - rest - rest[::-1, ::-1])
    return stiffness

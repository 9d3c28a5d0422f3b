"""A spectral density in pieces: its integral and cosine transform, to a stated accuracy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.special import spherical_jn

from stiction.arrays import Array
from stiction.errors import InputError

DEGREE = 15
LOOKED_AT = 4096  # points at which a piece as first given is compared with the density
DEEPEST = 60  # bisections: a step is then enclosed to 1e-18 of the piece
TOLERANCE = 1e-11  # of the integral, for each piece

_NODES, _SHARES = legendre.leggauss(DEGREE + 1)
# Legendre coefficients from values at the nodes.
_FIT = (legendre.legvander(_NODES, DEGREE) * _SHARES[:, None]).T * (
    np.arange(DEGREE + 1) + 0.5
).reshape(-1, 1)


@dataclass(frozen=True, eq=False)
class Pieces:
    """Legendre expansions of a density g(k) on adjoining intervals.

    Attributes
    ----------
    middle, half : (pieces,) arrays
        Where each interval lies and half its width, rad/m.
    coefficients : (pieces, 16) array
    """

    middle: Array
    half: Array
    coefficients: Array

    @property
    def powers(self) -> Array:
        """The integral over each piece, (pieces,)."""
        result: Array = 2.0 * self.half * self.coefficients[:, 0]
        return result

    @property
    def total(self) -> float:
        """The integral over all of them."""
        return float(self.powers.sum())

    def within(self, wavenumber: float) -> float:
        """The integral from the start to `wavenumber`."""
        ends = self.middle + self.half
        whole = ends <= wavenumber
        value = float(self.powers[whole].sum())
        if not whole.all():
            piece = int(np.argmin(whole))
            s = (wavenumber - self.middle[piece]) / self.half[piece]
            if s > -1.0:
                part = legendre.legint(self.coefficients[piece], lbnd=-1)
                value += float(self.half[piece] * legendre.legval(s, part))
        return value

    def cosine(self, lag: Array) -> Array:
        """Integral of g(k) cos(k lag), the same shape as `lag` (m).

        The transform of the Legendre polynomial P_n on [-1, 1] is 2 i^n j_n, the spherical Bessel
        function, so that no lag is too long.
        """
        x = np.abs(np.asarray(lag, dtype=np.float64)).ravel()
        phase = np.exp(1j * np.multiply.outer(self.middle, x))
        reach = np.multiply.outer(self.half, x)
        value = np.zeros(x.size)
        for n in range(DEGREE + 1):
            weight = 2.0 * self.half * self.coefficients[:, n]
            value += weight @ (spherical_jn(n, reach) * (1j**n * phase).real)
        return value.reshape(np.shape(lag))


def in_pieces(density: Callable[[Array], Array], edges: Array) -> Pieces:
    """Expand a density between `edges`, bisected until the expansion holds.

    Each piece is compared with the density at evenly spaced points, 4096 in an interval as given,
    so that a line wider than 1/4096 of it is seen, however narrow beside the rest.

    Raises
    ------
    InputError
        If it does not settle.
    """
    low, high = np.asarray(edges[:-1], dtype=float), np.asarray(edges[1:], dtype=float)
    done: list[tuple[Array, Array, Array]] = []
    settled = 0.0
    for level in range(DEEPEST + 1):
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        values = density((middle[:, None] + half[:, None] * _NODES).ravel())
        fitted = values.reshape(middle.size, DEGREE + 1) @ _FIT.T
        count = max(LOOKED_AT >> level, 2 * DEGREE + 3)
        s = (np.arange(count) + 0.5) * (2.0 / count) - 1.0
        exact = density((middle[:, None] + half[:, None] * s).ravel()).reshape(middle.size, count)
        wrong = 2.0 * half * np.abs(fitted @ legendre.legvander(s, DEGREE).T - exact).mean(axis=1)
        power = 2.0 * half * np.maximum(fitted[:, 0], exact.mean(axis=1))
        good = wrong <= TOLERANCE * (settled + power.sum())
        if level == DEEPEST:
            if not wrong.sum() <= 1e-6 * (settled + power.sum()):
                break
            good[:] = True
        done.append((middle[good], half[good], fitted[good]))
        settled += float(power[good].sum())
        low, middle, high = low[~good], middle[~good], high[~good]
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        if low.size == 0:
            middle, half, fitted = (np.concatenate(part) for part in zip(*done, strict=True))
            order = np.argsort(middle)
            return Pieces(middle[order], half[order], fitted[order])
    raise InputError(
        "function: its integral over wavenumbers does not settle; name the wavenumbers at which it"
        " jumps or peaks in break_points"
    )

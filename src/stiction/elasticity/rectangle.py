"""Plane elasticity of a block 0 <= x <= L, 0 <= y <= H on its interface y = 0, by least squares.

With Goursat's functions f and g of z = x + iy (Muskhelishvili 1953, sections 32 and 39), kappa
being 3 - 4 nu in plane strain and (3 - nu)/(1 + nu) in plane stress,

    2 G (u + iv) = kappa f - z conj(f') - conj(g),    s_yy + i s_xy = 2 Re f' + conj(z) f'' + g',
    s_xx - i s_xy = 2 Re f' - conj(z) f'' - g'.

Functions that are imaginary on the real axis leave no u and no s_yy there: the block is sheared.
Real ones leave no v and no s_xy: it is pressed. What remains are the sides and the top. Polynomials
fit them to many digits, also where nu is near 0.5. At the corners of a glued top, where stresses
are singular, poles outside the block that cluster towards the corner join them (Gopal and
Trefethen 2019; Brubeck and Trefethen 2022, 'Lightning Stokes solver').
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array

DEGREE = 24
"""Degree of the polynomials for a block, with its mirror image, as long as high."""
POLES = 24
"""Poles at each corner of a glued top."""
CLUSTER = 4.0
"""The nearest poles lie at exp(-CLUSTER sqrt(POLES)) of the block's size from the corner."""
ROUND_OFF = 1e-14
"""Share of the largest singular value below which directions of the fit are left out."""


class Goursat(NamedTuple):
    """Values of f, f', f'', g and g' at some points, (points,) or (points, functions)."""

    f: Array
    df: Array
    ddf: Array
    g: Array
    dg: Array

    def displacement(self, z: Array, kappa: float) -> Array:
        """Return 2 G (u + iv)."""
        return kappa * self.f - z * self.df.conj() - self.g.conj()

    def side(self, z: Array) -> Array:
        """Return s_xx - i s_xy."""
        return 2.0 * self.df.real - z.conj() * self.ddf - self.dg

    def face(self, z: Array) -> Array:
        """Return s_yy + i s_xy."""
        return 2.0 * self.df.real + z.conj() * self.ddf + self.dg


def total(*parts: Goursat) -> Goursat:
    """Return the sum of several fields."""
    return Goursat(*(np.sum(each, axis=0) for each in zip(*parts, strict=True)))


class Rectangle:
    """Fields of a block from the values at places `left`, `right` and `top` of its border, m.

    The top is given by u and v if it is `glued`, otherwise by v and s_xy (rollers). The interface
    has no v and no s_xy if the block is `pressed`, otherwise no u and no s_yy.
    """

    def __init__(
        self, length: float, height: float, kappa: float, *, glued: bool, pressed: bool = False
    ) -> None:
        self.length, self.height, self.kappa, self.glued = length, height, kappa, glued
        self.unit = 1.0 if pressed else 1j
        aspect = max(length / (2.0 * height), 2.0 * height / length)
        self.degree = int(DEGREE * aspect)
        self.half = max(0.5 * length, height)
        along = up = _clustered(max(2 * self.degree, 80))
        if glued:
            near = 0.5 * np.exp(-CLUSTER * np.sqrt(POLES) * np.linspace(0.0, 1.0, 3 * POLES))
            up = np.sort(np.concatenate([up, 1.0 - near[1:]]))
            along = np.sort(np.concatenate([along, near, 1.0 - near[1:]]))
        self.left, self.right = 1j * height * up, length + 1j * height * up
        self.top = length * along + 1j * height
        self._weights = np.sqrt(np.gradient(up) * height), np.sqrt(np.gradient(along) * length)
        count = POLES if glued else 0
        away = min(length, height) * np.exp(
            CLUSTER * (np.sqrt(np.arange(1, count + 1)) - np.sqrt(POLES))
        )
        self._corners = np.repeat([1j * height, length + 1j * height], count)
        outwards = np.repeat(np.exp([0.75j * np.pi, 0.25j * np.pi]), count)
        self._away = np.tile(away, 2)
        self._poles = self._corners + self._away * outwards
        boundary = np.concatenate([self.left, self.right, self.top])
        self._recurrence = self._orthogonal(boundary)
        basis = self._basis(boundary)
        cuts = np.cumsum([self.left.size, self.right.size])
        left, right, top = (
            Goursat(*parts) for parts in zip(*(np.split(a, cuts) for a in basis), strict=True)
        )
        system = self._rows(
            left.side(self.left[:, None]),
            right.side(self.right[:, None]),
            top.displacement(self.top[:, None], kappa),
            top.face(self.top[:, None]).imag,
        )
        self._norms = np.linalg.norm(system, axis=0)
        u, s, vt = np.linalg.svd(system / self._norms, full_matrices=False)
        kept = s > ROUND_OFF * s[0]
        self._inverse = (vt[kept].T / s[kept]) @ u[:, kept].T

    def _orthogonal(self, z: Array) -> list[Array]:
        """Return the recurrence of polynomials that are orthogonal on the boundary.

        Arnoldi's process (Brubeck, Nakatsukasa and Trefethen 2021); the mirror image counts too,
        so that coefficients are real.
        """
        w = (z - 0.5 * self.length) / self.half
        known, recurrence = [np.ones_like(w)], []
        for _ in range(self.degree):
            new, row = w * known[-1], np.zeros(len(known) + 1)
            for _ in range(2):
                for k, each in enumerate(known):
                    share = np.vdot(each, new).real / w.size
                    row[k] += share
                    new = new - share * each
            row[-1] = np.linalg.norm(new) / np.sqrt(w.size)
            known.append(new / row[-1])
            recurrence.append(row)
        return recurrence

    def _basis(self, z: Array) -> Goursat:
        """Return the functions of the fit at some points, (points, functions)."""
        w = (z - 0.5 * self.length) / self.half
        known = np.zeros((3, self.degree + 1, z.size), complex)  # values and two derivatives
        known[0, 0] = 1.0
        for k, row in enumerate(self._recurrence):
            last = known[:, k]
            new = w * last - np.tensordot(row[:-1], known[:, : k + 1], (0, 1))
            new[1] += last[0]
            new[2] += 2.0 * last[1]
            known[:, k + 1] = new / row[-1]
        f, df, ddf = (known / self.half ** np.arange(3.0)[:, None, None]).transpose(0, 2, 1)
        # Poles and their mirror images; g makes their field small of second order at the corner.
        u, v = z[:, None] - self._poles, z[:, None] - self._poles.conj()
        r, c = self._away, self._corners

        def both(a: Array, b: Array) -> Array:
            return np.hstack([a + b, 1j * (a - b)])

        pole = Goursat(
            both(r / u, r / v),
            both(-r / u**2, -r / v**2),
            both(2.0 * r / u**3, 2.0 * r / v**3),
            both(c.conj() * r / u**2, c * r / v**2),
            both(-2.0 * c.conj() * r / u**3, -2.0 * c * r / v**3),
        )
        zero, rest = np.zeros_like(f), np.zeros_like(pole.f)
        functions = Goursat(
            np.hstack([f, zero, pole.f, rest]),
            np.hstack([df, zero, pole.df, rest]),
            np.hstack([ddf, zero, pole.ddf, rest]),
            np.hstack([zero, f, pole.g, pole.f]),
            np.hstack([zero, df, pole.dg, pole.df]),
        )
        return Goursat(*(self.unit * each for each in functions))

    def _rows(self, left: Array, right: Array, moved: Array, sheared: Array) -> Array:
        """Return what is fitted: values on the boundary, weighted by the distance of points."""
        side, top = (weight[:, None] for weight in self._weights)
        top = top / min(self.length, self.height)  # 2 G u beside stresses
        parts = [side * left.real, side * left.imag, side * right.real, side * right.imag]
        parts += [top * (moved.real if self.glued else sheared), top * moved.imag]
        return np.concatenate(parts)

    def fit(self, left: Array, right: Array, moved: Array, sheared: Array) -> Array:
        """Return the coefficients of the fields with these values on the boundary.

        s_xx - i s_xy on the sides, 2 G (u + iv) and s_xy on the top, each (points, fields).
        """
        coefficients = self._inverse @ self._rows(left, right, moved, sheared)
        scaled: Array = coefficients / self._norms[:, None]
        return scaled

    def face(self, coefficients: Array, x: Array) -> Array:
        """Return s_yy + i s_xy on the interface, (points, fields)."""
        z = x + 0j
        return self.field(coefficients, z).face(z[:, None])

    def field(self, coefficients: Array, z: Array) -> Goursat:
        """Return the fields with these coefficients at points z of the block."""
        return Goursat(*(each @ coefficients for each in self._basis(z)))


def _clustered(count: int) -> Array:
    """Return points of [0, 1] that are dense at the ends (Chebyshev)."""
    points: Array = 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)
    return points

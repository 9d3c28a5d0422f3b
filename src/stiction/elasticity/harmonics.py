"""Harmonics of a block 0 <= x <= L, 0 <= y <= H with free sides, in closed form.

Problem
-------
The top is on rollers (v = 0, s_xy given). On the interface u is given,
and s_yy = 0. Top and interface act as mirrors, so the stresses
follow from Airy's function (S. Timoshenko and J. Goodier, Theory of
Elasticity, article 24) as a sum of independent harmonics,

    phi = sum Phi_k(x) sin(k y),   s_xx = -k² Phi_k sin(k y),   s_yy = Phi_k'' sin(k y),
    s_xy = -k Phi_k' cos(k y),     k = pi/(2 H), 3 pi/(2 H), ...     (1)

If the block is `pressed`, its interface has v = 0 and s_xy = 0 instead.
Then sin and cos are exchanged, and k = pi/H, 2 pi/H, ... At free sides
Phi_k is clamped: Phi_k and its slope vanish. All fields follow from a
function g_k(x, s), the deflection of a clamped beam,

    (d²/dx² - k²)² g_k = delta(x - s),   g_k = dg_k/dx = 0 at x = 0 and at x = L.  (2)

For example, slip d on the interface causes the shear stress -(E*/H) sum
k² int (d²g_k/dx ds) d ds there, with E* = 8 G/(kappa + 1).

Algorithm
---------
1. Write g_k as the solution for a beam without ends,
   (1 + k r) exp(-k r)/(4 k³) at a distance r, minus the
   single reflection at each clamp,
   (1 + k (x + s) + 2 k² x s) exp(-k (x + s))/(4 k³) for the left clamp,
   plus a `remainder`, the reflections between the clamps.
2. Sum the solution without ends and the single reflections over k in
   closed form (`sums`).
3. The remainder falls as exp(-k L), so that few harmonics give it to
   round-off (`reflected`). The remainder is a combination of the four
   solutions of (2) without load: exp(-k x), k x exp(-k x) and the same
   functions of L - x. The conditions at the clamps determine the
   coefficients.

Derivatives of the four solutions follow from polynomials. An operator
P(d/dx), in units of k, turns exp(-k x) into P(-1) exp(-k x), and k x
exp(-k x) into (P'(-1) + k x P(-1)) exp(-k x).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from stiction.base.arrays import Array

SLOPE, CURVATURE, THIRD = (Polynomial.basis(order) for order in (1, 2, 3))
"""Derivatives of a harmonic along x, in units of k."""


class Sums(NamedTuple):
    """Sums of k^j exp(-k z) over k, with an array for each power j from -1 to 3."""

    inverse: Array
    plain: Array
    first: Array
    second: Array
    third: Array


class Harmonics:
    """Harmonics of a block: sums in closed form, and the reflections between its sides.

    In a pressed block, the sums include half the constant harmonic, k = 0.

    Parameters
    ----------
    length, height : float
        L and H, m.
    max_decay : float
        Largest exponent k L of a harmonic in the remainder.
    pressed : bool
        Whether the interface has v = 0 and s_xy = 0, rather than s_yy = 0.
    """

    def __init__(
        self, length: float, height: float, max_decay: float, *, pressed: bool = False
    ) -> None:
        self.length, self.height, self.pressed = length, height, pressed
        count = int(max_decay * height / (np.pi * length)) + 2
        self.k = (np.arange(count) + (1.0 if pressed else 0.5)) * np.pi / height
        self.at_top = (-1.0) ** (np.arange(count) + pressed)  # cos(k H), or sin(k H)
        # Step 3. Values and slopes of the four solutions at the left
        # and the right clamp.
        kl, decay = self.k * length, np.exp(-self.k * length)
        zero, unit = np.zeros_like(kl), np.ones_like(kl)
        clamps = np.array(
            [
                [unit, zero, decay, kl * decay],
                [-unit, unit, decay, (kl - 1.0) * decay],
                [decay, kl * decay, unit, zero],
                [-decay, (1.0 - kl) * decay, unit, -unit],
            ]
        ).transpose(2, 0, 1)
        # The same of the beam without ends, as combinations of the four
        # solutions in s.
        endless = np.kron(np.diag([1.0, 0.0]), [[1.0, 1.0], [0.0, 1.0]])
        endless += np.kron(np.diag([0.0, 1.0]), [[1.0, 1.0], [0.0, -1.0]])
        single = np.kron(np.eye(2), [[1.0, 1.0], [1.0, 2.0]])  # one clamp without the other
        inverse = np.linalg.inv(clamps)
        # All reflections but the single reflections, which have closed forms.
        self._remainder = single - inverse @ endless
        self.raised = inverse[:, :, 0]
        """Coefficients of the solution that is 1, without a slope, at
        the left clamp."""

    def sums(self, z: Array) -> Sums:
        """Step 2: return the sums of k^j exp(-k z) over k, for z with a positive real part.

        The sums over the first 400 harmonics, one by one:

        >>> z = np.array([0.3, 1.7])
        >>> Harmonics(2.0, 1.5, 10.0).k.size  # 10 * 1.5/(2 pi) = 2.39, and 2 more
        4
        >>> for pressed in (False, True):
        ...     k = (np.arange(400) + (1.0 if pressed else 0.5)) * np.pi / 1.5
        ...     sums = Harmonics(2.0, 1.5, 10.0, pressed=pressed).sums(z)
        ...     powers = [k**power for power in (-1.0, 0.0, 1.0, 2.0, 3.0)]
        ...     direct = np.array([np.exp(-np.outer(z, k)) @ power for power in powers])
        ...     direct[:2] += pressed * np.array([-0.5 * z, [0.5, 0.5]])  # half of k = 0
        ...     print(np.abs(np.array(sums) / direct - 1.0).max() < 1e-10)
        True
        True
        """
        # Geometric series and their derivatives. `expm1` keeps the
        # digits near z = 0.
        c = 0.5 * np.pi / self.height
        q, w = np.exp(-c * z), -np.expm1(-2.0 * c * z)
        coth, square = (2.0 - w) / w, 4.0 * q * q / (w * w)  # and 1/sinh²
        if self.pressed:
            return Sums(
                -0.5 * (np.log(w) / c + z),
                0.5 * coth,
                0.5 * c * square,
                c * c * coth * square,
                c**3 * square * (2.0 + 3.0 * square),
            )
        csch = 2.0 * q / w
        return Sums(
            -0.5 * np.log(-np.expm1(-c * z) / (1.0 + q)) / c,
            0.5 * csch,
            0.5 * c * coth * csch,
            0.5 * c * c * csch * (1.0 + 2.0 * square),
            0.5 * c**3 * coth * csch * (1.0 + 6.0 * square),
        )

    def sums_at_top(self, x: Array) -> Sums:
        """Return the sums of +-k^j exp(-k x) over k, with the signs of the harmonics at the top.

        >>> for pressed in (False, True):
        ...     harmonics = Harmonics(2.0, 1.5, 1e3, pressed=pressed)
        ...     k, x = harmonics.k, np.array([0.3, 1.7])
        ...     signs = np.cos(k * 1.5) if pressed else np.sin(k * 1.5)
        ...     assert np.allclose(harmonics.at_top, signs)
        ...     direct = np.exp(-np.outer(x, k)) @ (signs * k**2)
        ...     print(np.allclose(harmonics.sums_at_top(x).second, direct, rtol=1e-9))
        True
        True
        """
        turn = 1.0 if self.pressed else 1j
        return Sums(*((turn * values).real for values in self.sums(x + 1j * self.height)))

    def solutions(self, operator: Polynomial, x: Array) -> Array:
        """Apply an operator to the four solutions.

        Return an array (harmonics, points, 4).

        The slopes of exp(-k x), k x exp(-k x) and the same functions of L - x:

        >>> harmonics, x = Harmonics(2.0, 1.5, 1.0), np.array([0.3])
        >>> a, b = harmonics.k[1] * 0.3, harmonics.k[1] * 1.7
        >>> slopes = [-np.exp(-a), (1 - a) * np.exp(-a), np.exp(-b), (b - 1) * np.exp(-b)]
        >>> np.allclose(harmonics.solutions(SLOPE, x)[1, 0], slopes)
        True
        >>> curved = [np.exp(-a), (a - 2) * np.exp(-a), np.exp(-b), (b - 2) * np.exp(-b)]
        >>> np.allclose(harmonics.solutions(CURVATURE, x)[1, 0], curved)
        True

        `raised` is 1 at the left clamp, and has no other value or slope at clamps:

        >>> for operator in Polynomial([1.0]), SLOPE:
        ...     at_clamps = harmonics.solutions(operator, np.array([0.0, 2.0]))
        ...     print(np.einsum("kxi,ki->xk", at_clamps, harmonics.raised)[:, 0].round(9) + 0.0)
        [1. 0.]
        [0. 0.]
        """
        value, slope = operator(-1.0), operator.deriv()(-1.0)
        parity = operator(1.0) / value  # -1 for odd derivatives: towards the right end x falls
        parts = []
        for distance, sign in ((x, 1.0), (self.length - x, parity)):
            y = self.k[:, None] * distance
            wave = sign * np.exp(-y)
            parts += [value * wave, (slope + value * y) * wave]
        return np.stack(parts, axis=-1)

    def reflected(
        self, weights: Array, along_x: Polynomial, x: Array, along_s: Polynomial, s: Array
    ) -> Array:
        """Step 3: sum, over k, the weights times 4 k³ P(d/dx) Q(d/ds) of the
        remainder, at (x, s).

        The deflection for a load at s vanishes at x = 0. There the wave without
        ends and the reflection at the left clamp cancel, so that the remainder
        cancels the reflection at the right clamp, at x + s = 2 L - s from this clamp:

        >>> harmonics, value, s = Harmonics(0.5, 1.5, 1.0), Polynomial([1.0]), 0.2
        >>> k, away = harmonics.k, 2.0 * 0.5 - s
        >>> right = (1.0 + k * away + 2.0 * k**2 * 0.5 * (0.5 - s)) * np.exp(-k * away)
        >>> weights = np.arange(1.0, 1.0 + k.size)
        >>> found = harmonics.reflected(weights, value, np.array([0.0]), value, np.array([s]))
        >>> np.allclose(found, weights @ right)
        True

        The remainder does not change if x and s are exchanged.

        >>> x, s = np.array([0.1, 0.3]), np.array([0.4])
        >>> there = harmonics.reflected(weights, SLOPE, x, THIRD, s)
        >>> np.allclose(there, harmonics.reflected(weights, THIRD, s, SLOPE, x).T)
        True
        """
        # The remainder couples the solutions in x with the solutions in s.
        left = self.solutions(along_x, x) @ (weights[:, None, None] * self._remainder)
        return np.tensordot(left, self.solutions(along_s, s), ((0, 2), (0, 2)))

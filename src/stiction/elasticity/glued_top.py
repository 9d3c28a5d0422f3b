"""A block with its top glued to a rigid platen, computed from a block with its top on rollers.

Problem
-------
On rollers the top has v = 0. With glue, u is also given. This requires
a shear traction t(s) on the top with

    int G(x, s) t(s) ds = u(x),   0 < x < L,                         (1)

where G is the compliance of a block on rollers, known in closed form
(`harmonics`). At the corners t has singularities x^(lambda - 1) with
many exponents, most of them complex (M. L. Williams, Journal of Applied
Mechanics 19, 1952).

Algorithm
---------
1. Map the line -inf < z < inf to the top so that x falls as exp(z)
   towards the corner and grows evenly between corners (`GluedTop`). For
   any exponents, t dx/dz is smooth and falls exponentially at both
   ends, so that trapezoidal sums converge exponentially (F. Stenger,
   Numerical Methods Based on Sinc and Analytic Functions, 1993).
2. G has a logarithm at x = s. Split off log |2 sin(pi (z - z')/P)|,
   where P is the range of z. Its integrals with trigonometric
   polynomials are known (R. Kress, Linear Integral Equations, 2014,
   section 12.3).
3. Solve (1) at the points. The matrix is symmetric, and well
   conditioned for an equation of the first kind.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.polynomial import Polynomial

from stiction.base.arrays import Array
from stiction.elasticity.harmonics import CURVATURE, SLOPE, Harmonics

MAX_EXPONENT = 36.0
"""Points reach to a distance of exp(-MAX_EXPONENT) sizes of the block
from its corners."""
HEIGHTS_PER_UNIT = 0.5
"""Length of the top, in heights of the block, that a unit of z covers
between the corners."""


class GluedTop:
    """Points on a glued top, and the response of the block to shear traction at these points.

    Between the corners of a flat block, dx/dz is `HEIGHTS_PER_UNIT`
    heights, because the kernels vary over a height.

    Parameters
    ----------
    harmonics : Harmonics
        Harmonics of the block.
    modulus : float
        G, Pa.
    kappa : float
        Kolosov's constant: 3 - 4 nu in plane strain, (3 - nu)/(1 + nu)
        in plane stress.
    step : float
        Distance between the points in z.

    The points reach both corners, and dx/dz is the slope of x(z). Far from the corners it
    is half the height.

    >>> top = GluedTop(Harmonics(4.0, 0.5, 10.0), 3.0, 1.8, 0.25)
    >>> np.allclose(top.x + top.to_right, 4.0), np.allclose(top.x, top.to_right[::-1])
    (True, True)
    >>> np.allclose(np.gradient(top.x, 0.25), top.stretch, atol=0.002)
    True
    >>> round(float(top.stretch.max()), 3), round(float(top.step * top.stretch.sum()), 6)
    (0.25, 4.0)

    A uniform traction t shears a long block by about t/G. A shift U of the top takes
    a force close to U G L/H, and less because the ends are free.

    >>> shifted = top.solve(np.ones(top.x.size))
    >>> 0.9 < float(top.step * shifted.sum()) / (3.0 * 4.0 / 0.5) < 1.0
    True
    >>> np.allclose(top.compliance, top.compliance.T)
    True
    """

    def __init__(self, harmonics: Harmonics, modulus: float, kappa: float, step: float) -> None:
        self.harmonics, self.modulus, self.kappa = harmonics, modulus, kappa
        length, height = harmonics.length, harmonics.height
        # Step 1. z runs over 0 < z < width with a margin at both ends.
        width = length / (HEIGHTS_PER_UNIT * height)
        count = int(np.ceil((width + 2.0 * MAX_EXPONENT) / step))
        z = step * (np.arange(count) - 0.5 * (count - 1))
        self.step, unit = step, length / width

        def from_corner(z: Array) -> Array:
            """Return the distance from the corner at z = -inf, to full relative precision."""
            grown: Array = np.exp(z)
            return unit * np.log1p(-np.expm1(-width) * grown / (1.0 + grown * np.exp(-width)))

        self.x, self.to_right = from_corner(z + 0.5 * width), from_corner(0.5 * width - z)
        from_left, from_right = 1.0 + np.exp(-z - 0.5 * width), 1.0 + np.exp(z - 0.5 * width)
        self.stretch = unit * -np.expm1(-width) / (from_left * from_right)
        """dx/dz."""
        ratio = (3.0 - kappa) / (kappa + 1.0)  # Poisson's ratio, as in plane stress
        self._traction = Polynomial([0.0, 2.0 + ratio, 0.0, -1.0])
        self.compliance = self._compliance()

    def _compliance(self) -> Array:
        """Return the matrix of (1), which multiplies values of t dx/dz at the points."""
        harmonics, kappa, count = self.harmonics, self.kappa, self.x.size
        distance = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
        apart = np.abs(np.subtract.outer(self.x, self.x))
        from_right = np.abs(np.subtract.outer(self.to_right, self.to_right))
        # Near the right corner only distances from the right end keep
        # their relative precision.
        apart = np.where(np.add.outer(self.x, self.x) < harmonics.length, apart, from_right)
        np.fill_diagonal(apart, self.stretch)
        sums = harmonics.sums(apart)
        kernel = kappa * sums.inverse + apart * sums.plain
        # Step 2. The sum of exp(-k r)/k is
        # -(H/pi) log(r) + a constant near r = 0.
        weight, period = kappa * harmonics.height / np.pi, self.step * count
        sine = 2.0 * np.sin(np.pi * distance / count)
        np.fill_diagonal(sine, 2.0 * np.pi / period)
        constant = np.log((1.0 if harmonics.pressed else 4.0) * harmonics.height / np.pi)
        # The sum of both logarithms is smooth.
        # On the diagonal it has this limit.
        kernel += weight * np.log(sine)
        limit = weight * (constant + np.log(2.0 * np.pi / period / self.stretch))
        kernel[np.diag_indices(count)] = harmonics.height / np.pi + limit
        # Put the logarithm back with the exact weights of its Fourier modes.
        modes = np.arange(1, count // 2 + 1)
        logarithm = np.fft.irfft(np.append(0.0, 0.5 * period / modes), count)
        matrix = self.step * kernel + weight * logarithm[distance]
        # Single reflections at both ends, and then between the ends.
        for end in (self.x, self.to_right):
            across = np.add.outer(end, end)
            sums = harmonics.sums(across)
            kernel = 0.5 * (kappa * kappa + 1.0) * sums.inverse + kappa * across * sums.plain
            matrix += self.step * (kernel + 2.0 * np.outer(end, end) * sums.first)
        # All further reflections, harmonic by harmonic.
        points = self._traction, self.x
        remainder = harmonics.reflected(1.0 / harmonics.k, *points, *points)
        matrix -= self.step * (kappa + 1.0) ** 2 / 16.0 * remainder
        return matrix / (self.modulus * harmonics.height * (kappa + 1.0))

    def solve(self, displacement: Array) -> Array:
        """Step 3: return t dx/dz (Pa m) for displacements u (m) with shape (points, cases)."""
        return scipy.linalg.solve(self.compliance, displacement, assume_a="sym")

    def shear(self, x: Array) -> Array:
        """Return the shear stress at places on the interface due to unit t at a point, 1/m.

        The traction that shifts the top causes a shear stress with the same force on the
        interface, which is uniform in the middle, and zero near the free ends.

        >>> top = GluedTop(Harmonics(4.0, 0.5, 40.0), 3.0, 1.8, 0.25)
        >>> x = (np.arange(400) + 0.5) / 100
        >>> stress = top.step * top.shear(x) @ top.solve(np.ones(top.x.size))
        >>> force = top.step * top.solve(np.ones(top.x.size)).sum()
        >>> round(float(stress.mean() * 4.0 / force), 3), np.allclose(stress, stress[::-1])
        (1.0, True)
        >>> round(float(stress[200]), 2), bool(stress[0] < 0.3)  # G U/H is 6 Pa
        (6.0, True)

        In a short block, waves run between the ends. The force is the same:

        >>> top = GluedTop(Harmonics(0.4, 0.5, 40.0), 3.0, 1.8, 0.25)
        >>> x, traction = (np.arange(400) + 0.5) / 1000, top.solve(np.ones(top.x.size))
        >>> round(float((top.shear(x) @ traction).mean() * 0.4 / traction.sum()), 4)
        1.0
        """
        harmonics, kappa = self.harmonics, self.kappa
        # The direct wave, single reflections at both ends, and the remainder.
        apart = np.abs(np.subtract.outer(x, self.x))
        sums = harmonics.sums_at_top(apart)
        stress = 0.5 * (kappa - 1.0) * sums.plain + apart * sums.first
        for place, point in (
            (x[:, None], self.x),
            (harmonics.length - x[:, None], self.to_right),
        ):
            sums = harmonics.sums_at_top(place + point)
            stress -= 0.5 * (kappa - 1.0) * (sums.plain - 2.0 * place * sums.first)
            stress += (place - point) * sums.first + 2.0 * place * point * sums.second
        remainder = harmonics.reflected(harmonics.at_top, SLOPE, x, self._traction, self.x)
        stress -= 0.25 * (kappa + 1.0) * remainder
        return stress * 2.0 / ((kappa + 1.0) * harmonics.height)

    def normal(self, x: Array) -> Array:
        """Return s_yy on the interface of a pressed block due to unit t at a point, 1/m.

        The result applies to tractions without a resultant.

        Glue keeps e_xx at zero in the middle of a long block. The same compression then
        takes P = lambda + 2 G instead of 4 G (lambda + G)/P, so that the pressure is 3.5^2/10 times
        the pressure with rollers, for lambda = 1.5 G.

        >>> top = GluedTop(Harmonics(8.0, 0.5, 40.0, pressed=True), 1.0, 1.8, 0.25)
        >>> traction = top.solve(-(3.0 - 1.8) / 16.0 * (top.x - top.to_right))
        >>> x = np.array([0.05, 3.9, 4.0, 4.1, 7.95])
        >>> (1.0 - top.step * top.normal(x) @ traction)[1:4].round(3).tolist()
        [1.225, 1.225, 1.225]
        >>> ends = (top.normal(x) @ traction)[[0, -1]]
        >>> np.allclose(ends[0], ends[1]), bool(ends[0] > 0.0)
        (True, True)
        """
        harmonics, kappa = self.harmonics, self.kappa
        towards = np.subtract.outer(x, self.x)
        sums = harmonics.sums_at_top(np.abs(towards))
        stress = towards * sums.first - 0.5 * (3.0 - kappa) * np.sign(towards) * sums.plain
        for sign, place, point in (
            (1.0, x[:, None], self.x),
            (-1.0, harmonics.length - x[:, None], self.to_right),
        ):
            sums = harmonics.sums_at_top(place + point)
            slope = (3.0 * point - kappa * place) * sums.first
            stress -= sign * (0.5 * (3.0 * kappa - 1.0) * sums.plain + slope)
            stress += sign * 2.0 * place * point * sums.second
        remainder = harmonics.reflected(harmonics.at_top, CURVATURE, x, self._traction, self.x)
        stress += 0.25 * (kappa + 1.0) * remainder
        return stress * 2.0 / ((kappa + 1.0) * harmonics.height)

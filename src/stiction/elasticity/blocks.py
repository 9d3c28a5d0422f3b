"""Response of two identical blocks to slip between them and to the drive that pushes them.

Blocks of length L and height H are mirror images at the interface, free at their ends and driven in
opposite directions, so that slip d changes no normal stress. Per unit depth, with the force F of
the drive on one block (N/m), its travel U (m), the nodes' distance dx and the mean stress F/L,

    tau = (F/L) q - K d,    U = F/C + (dx/(2 L)) sum q d    (Betti's theorem).

K is that of a given force; a uniform slip is free of stress. It is put together from the closed
form for two free ends and a correction for the top and for the ends seeing each other.
The correction is smooth, so that few points of the interface give it to many digits, one field of a
block (`rectangle`) each. Mode III has closed forms throughout.

Beside a free end, the half-space x > 0 has a free surface x = 0 and an interface y = 0. Fields are
given by Goursat's functions (`rectangle`), imaginary on the real axis, and found from those of the
full space by reflection on the free surface (Muskhelishvili 1953, chapter 18).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from scipy.fft import idct

from stiction.base.arrays import Array, one_blas_thread
from stiction.elasticity.rectangle import Goursat, Rectangle, total

Side: TypeAlias = Literal["left", "right"]

POINTS = 24
"""Points of the interface of a square block for which the correction is computed."""
NEGLIGIBLE = 40.0
"""Exponent beyond which terms of the series of mode III are round-off."""
CORRECTION = 1.0 / 12.0
"""Half of the 1/6 with which the symbol would be right to fourth order.

The error that remains and that of a border of slip that lies between nodes, of the same order, have
opposite signs: with 1/12 the mean error of onsets vanishes (measured with random strengths).
"""


class Pushes(NamedTuple):
    """Uniform traction on a side, over a width (m) around a height (m) above the interface.

    From both sides each block is pushed at one end and pulled at the other, by half of the force.
    """

    sides: tuple[Side, ...]
    height: float
    width: float


class BlockResponse(NamedTuple):
    """What a method needs of two blocks; nodes at (i + 1/2) dx."""

    stiffness: Array  # (n, n): K at a given force, Pa/m; symmetric, its rows sum to zero
    shear: Array  # (n,): q, shear stress of the drive over its mean
    drive_stiffness: float  # C, force per unit depth over travel of a block without slip, Pa
    error: float = 0.0  # by how much K violates reciprocity at most, Pa/m


@lru_cache(maxsize=8)
def block_response(
    length: float,
    nodes: int,
    height: float,
    modulus: float,
    kappa: float | None,
    pushes: Pushes | None,
) -> BlockResponse:
    """Return the response of two blocks to slip and to their drive.

    Length L and height H are in m, the modulus is G (Pa), and kappa Kolosov's constant
    (`rectangle`), None for mode III. A platen (no `pushes`) is glued to the top and moves along the
    interface; the top of a block that is pushed lies on rollers (in mode III it is free).
    """
    with one_blas_thread():
        if kappa is None:
            return _anti_plane(length, nodes, height, modulus, pushes)
        return _in_plane(length, nodes, height, modulus, kappa, pushes)


def _in_plane(
    length: float,
    nodes: int,
    height: float,
    modulus: float,
    kappa: float,
    pushes: Pushes | None,
) -> BlockResponse:
    spacing = length / nodes
    x = (np.arange(nodes) + 0.5) * spacing
    block = Rectangle(length, height, kappa, glued=pushes is None)
    effective = 4.0 * modulus / (kappa + 1.0)
    stiffness = stiffness_between_ends(nodes, spacing, effective)
    correction, error = _correction(block, effective, x)
    stiffness += spacing * correction
    if pushes is None:
        traction = _with_moved_top(block, 2.0 * modulus, x).imag
        drive = spacing * traction.sum()
        stiffness -= 0.5 * spacing * np.outer(traction, traction) / drive
        shear = traction * length / drive
    else:
        shear, compliance = _pushed(block, pushes, x)
        drive = 2.0 * modulus / compliance
    # What discretisation leaves of the stress of a uniform slip, 1e-7 of the diagonal.
    stiffness[np.diag_indices(nodes)] -= stiffness.sum(axis=1)
    return BlockResponse(stiffness, shear / shear.mean(), float(drive), spacing * error)


def _correction(block: Rectangle, effective: float, x: Array) -> tuple[Array, float]:
    """Return what a finite block adds to K of two ends that do not feel each other, Pa/m².

    And by how much it violates reciprocity.

    For slip at Gauss points the field that clears its sides and its top; polynomials between them.
    """
    length = block.length
    count = round(POINTS * max(1.0, length / (2.0 * block.height)))
    gauss, weights = np.polynomial.legendre.leggauss(count)
    places = 0.5 * length * (1.0 + gauss)

    def first(z: Array) -> Goursat:
        return image_slip(places, z, effective)

    def second(z: Array) -> Goursat:
        return turned(image_slip(length - places, length - z, effective), length)

    left, right, top = (z[:, None] for z in (block.left, block.right, block.top))
    above = total(point_slip(places, top, effective), first(top), second(top))
    fitted = block.fit(
        -second(left).side(left),
        -first(right).side(right),
        -above.displacement(top, block.kappa),
        -above.face(top).imag,
    )
    kernel = -block.face(fitted, places).imag
    # Barycentric weights of the Gauss points (Wang and Xiang 2012).
    share = (-1.0) ** np.arange(count) * np.sqrt((1.0 - gauss**2) * weights)
    terms = share / (x[:, None] - places)
    between = terms / terms.sum(axis=1, keepdims=True)
    correction: Array = between @ (0.5 * (kernel + kernel.T)) @ between.T
    return correction, float(np.abs(kernel - kernel.T).max())


def _pushed(block: Rectangle, pushes: Pushes, x: Array) -> tuple[Array, float]:
    """Return the shear stress of a force of 1 N/m and 2 G times the travel, of a pushed block."""
    length = block.length
    low, high = pushes.height - 0.5 * pushes.width, pushes.height + 0.5 * pushes.width
    right, top = block.right[:, None], block.top[:, None]
    at_top = push(low, high, top)
    fitted = block.fit(
        np.zeros((block.left.size, 1)),
        -push(low, high, right).side(right),
        -at_top.displacement(top, block.kappa),
        -at_top.face(top).imag,
    )

    def stress(x: Array) -> Array:
        found: Array = block.face(fitted, x)[:, 0] + push(low, high, x + 0j).face(x)
        return found.imag

    def travel(end: float) -> float:
        gauss, weights = np.polynomial.legendre.leggauss(64)
        z = end + 1j * (pushes.height + 0.5 * pushes.width * gauss)
        moved = block.field(fitted, z).displacement(z[:, None], block.kappa)[:, 0]
        return float(
            0.5 * weights @ (moved + push(low, high, z).displacement(z, block.kappa)).real
        )

    return _of_sides(pushes, stress, x, length, travel(0.0), travel(length))


def _of_sides(
    pushes: Pushes,
    stress: Callable[[Array], Array],
    x: Array,
    length: float,
    near: float,
    far: float,
) -> tuple[Array, float]:
    """Return stress and travel of a drive from those of a force at the left end.

    `near` and `far` are the displacements where the force acts and at the same place of the other
    end.
    """
    if len(pushes.sides) == 2:
        return 0.5 * (stress(x) + stress(length - x)), 0.5 * (near + far)
    return stress(x if pushes.sides[0] == "left" else length - x), near


def _with_moved_top(block: Rectangle, by: complex, x: Array) -> Array:
    """Return s_yy + i s_xy on the interface if the glued top moves `by` 2 G (u + iv)."""
    none, moved = np.zeros((block.left.size, 1)), np.full((block.top.size, 1), by)
    return block.face(block.fit(none, none, moved, 0.0 * moved.real), x)[:, 0]


def glued_pressure(length: float, nodes: int, height: float, kappa: float) -> Array:
    """Return pressure over its mean, (n,), between blocks whose tops are glued to rigid platens."""
    x = (np.arange(nodes) + 0.5) * length / nodes
    block = Rectangle(length, height, kappa, glued=True, pressed=True)
    with one_blas_thread():
        pressure = -_with_moved_top(block, -1j, x).real
    scaled: Array = pressure / pressure.mean()
    return scaled


def _anti_plane(
    length: float, nodes: int, height: float, modulus: float, pushes: Pushes | None
) -> BlockResponse:
    """Return the response in mode III: cosines on the interface, sines on the sides.

    K has the symbol (G/2) k coth(k H) below a platen, which is free of k = 0 under a given force,
    and (G/2) k tanh(k H) below a free top.
    """
    spacing = length / nodes
    k = np.pi / length * np.arange(1, nodes)
    finite = k * (1.0 / np.tanh(k * height) if pushes is None else np.tanh(k * height))
    symbol = np.append(0.0, lattice_symbol(k * spacing) / spacing + finite - k)
    cosines = idct(np.eye(nodes), norm="ortho", axis=0)
    stiffness = (cosines * (0.5 * modulus * symbol)) @ cosines.T
    x = (np.arange(nodes) + 0.5) * spacing
    if pushes is None:
        return BlockResponse(stiffness, np.ones(nodes), modulus * length / height)
    terms = int(NEGLIGIBLE * height / (np.pi * x[0])) + 1
    k = (np.arange(terms) + 0.5) * np.pi / height
    low, high = pushes.height - 0.5 * pushes.width, pushes.height + 0.5 * pushes.width
    share = (np.cos(k * low) - np.cos(k * high)) / (k * pushes.width)  # mean of sin k y
    once = -np.expm1(-2.0 * k * length)

    def stress(x: Array) -> Array:
        waves = np.exp(-k * x[:, None]) + np.exp(-k * (2.0 * length - x[:, None]))
        found: Array = waves @ (2.0 / height * share / once)
        return found

    series = 2.0 / height * share**2 / (k * once)
    near = float(series @ (1.0 + np.exp(-2.0 * k * length)))
    far = float(series @ (2.0 * np.exp(-k * length)))
    shear, travel = _of_sides(pushes, stress, x, length, near, far)
    return BlockResponse(stiffness, shear / shear.mean(), modulus / travel)


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

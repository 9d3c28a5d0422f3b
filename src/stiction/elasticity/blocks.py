"""Response of two identical blocks to slip between them and to the drive that loads them.

Problem
-------
Two blocks of length L and height H are mirror images at the interface.
They have free ends and are driven in opposite directions, so that slip
d does not change the normal stress. Let F be the force of the drive on
a block per unit depth (N/m), U the travel of the drive (m), and dx the
distance between nodes. F/L is the mean stress. Then

    tau = (F/L) q - K d,    U = F/C + (dx/(2 L)) sum q d    (Betti's theorem).

K applies to a given force: uniform slip causes no stress.
`block_response` returns K, q and C.

Algorithm
---------
1. Compute K for two free ends that do not interact, averaged over the
   cells of the nodes (`stiffness_between_ends`).
2. Add the effect of the top, which is on rollers, and of the other end.
   This is a smooth function, in closed form except for a few harmonics
   (`_rollers_correction`).
3. With a pusher, q and C of a block on rollers also have closed forms
   (`_pushed`).
4. With a platen, find the shear traction t that holds the top in place
   (`glued_top`). With the compliance G of the top and the stress A t on
   the interface, A' d/2 is the displacement of the top that slip d
   causes (Betti's theorem). If the platen is held,

       K = K_rollers + A G^-1 A'/2,    q = A G^-1 1 L/C,    C = 1' G^-1 1.

   At a given force, subtract the stress due
   to the motion of the platen (`_glued`).
5. Repeat steps 2 to 4 with a coarser resolution. The largest change is
   the `error`.

Mode III has closed forms throughout.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from scipy.fft import idct

from stiction.base.arrays import Array, one_blas_thread
from stiction.elasticity.glued_top import GluedTop
from stiction.elasticity.harmonics import SLOPE, THIRD, Harmonics

Side: TypeAlias = Literal["left", "right"]


class Resolution(NamedTuple):
    """Resolution with which the response is computed."""

    max_decay: float  # harmonics below exp(-max_decay) are left out
    step: float  # distance of the points of a glued top, in z
    quadrature_rtol: float  # of the compliance below a pusher


RESOLUTION, COARSER_RESOLUTION = Resolution(40.0, 0.28, 1e-11), Resolution(26.0, 0.42, 1e-6)
"""Resolution of the response, and a coarser resolution to measure the
error."""
LATTICE_CORRECTION = 1.0 / 12.0
"""Half of the 1/6 with which the symbol would be right to fourth order.

The remaining error of the symbol and the error by a border of slip
between nodes have the same order and opposite signs. With 1/12 the mean
error of onsets vanishes, as measured with random strengths.
"""


class Pushes(NamedTuple):
    """Uniform traction on a side, over a width (m), centred at a height (m) above the interface.

    With two sides, each block is pushed at one end and pulled at the
    other end, each by half the force.
    """

    sides: tuple[Side, ...]
    height: float
    width: float

    def edges(self, height: float) -> tuple[float, float]:
        """Return both edges of the push, m, clipped to the side 0 <= y <= height.

        >>> Pushes(("left",), 3.0, 2.0).edges(10.0), Pushes(("left",), 0.5, 2.0).edges(1.25)
        ((2.0, 4.0), (0.0, 1.25))
        """
        low, high = self.height - 0.5 * self.width, self.height + 0.5 * self.width
        return max(low, 0.0), min(high, height)


class BlockResponse(NamedTuple):
    """Response of two blocks. Nodes are at (i + 1/2) dx."""

    stiffness: Array  # (n, n): K at a given force, Pa/m; symmetric, its rows sum to zero
    shear: Array  # (n,): q, shear stress of the drive, divided by its mean
    drive_stiffness: float  # C, force per unit depth divided by travel, without slip, Pa
    # Largest relative error of q, C and K (relative to its diagonal),
    # without the lattice's error
    error: float = 0.0


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

    Length L and height H are in m, and the modulus is G (Pa). kappa is
    Kolosov's constant, 3 - 4 nu in plane strain and (3 - nu)/(1 + nu)
    in plane stress, or `None` for mode III. A platen (no `pushes`) is
    glued to the top and moves along the interface. The top of a pushed
    block lies on rollers, or is free in mode III.

    In mode III below a platen, C is G L/H, and K multiplies the first cosine
    by (G/2) k coth(k H), up to the error of the lattice:

    >>> response = block_response(2.0, 64, 0.5, 3.0, None, None)
    >>> cosine = np.cos(np.pi * (np.arange(64) + 0.5) / 64)
    >>> k = np.pi / 2.0
    >>> ratio = response.stiffness @ cosine / cosine / (1.5 * k / np.tanh(0.5 * k))
    >>> round(response.drive_stiffness, 9), bool(np.abs(ratio - 1.0).max() < 1e-4)
    (12.0, True)

    A platen glued to blocks: K is symmetric, uniform slip causes no stress, and C is a
    little below G L/H, because the ends are free.

    >>> response = block_response(4.0, 16, 0.5, 3.0, 1.8, None)
    >>> K = response.stiffness
    >>> np.allclose(K, K.T), np.allclose(K.sum(axis=0), 0.0, atol=1e-9), response.error < 1e-5
    (True, True, True)
    >>> round(float(response.shear.mean()), 9), 0.8 < response.drive_stiffness / 24.0 < 1.0
    (1.0, True)

    Pushers on both sides load by half each. Their profile is the mean of the
    profiles of both sides, before each is divided by its own mean.

    >>> left, right, both = (
    ...     block_response(1.0, 8, 0.5, 3.0, 1.8, Pushes(sides, 0.25, 0.125))
    ...     for sides in (("left",), ("right",), ("left", "right"))
    ... )
    >>> np.allclose(right.shear, left.shear[::-1]), bool(left.shear[0] > left.shear[-1])
    (True, True)
    >>> np.allclose(both.shear, 0.5 * (left.shear + right.shear))
    True
    >>> both.drive_stiffness > left.drive_stiffness == right.drive_stiffness
    True

    The file `columns` computes the same block by finite elements. v is
    free on the interface and zero on the top. u is free on rollers, and a
    single number below a platen. A force per unit slip stress is S/(2 dx).

    >>> from stiction.elasticity.columns import Body, block, eliminated
    >>> n, x = 24, (np.arange(24) + 0.5) / 24
    >>> slip = np.sin(np.pi * x) ** 2 * (1.0 + x)
    >>> whole = block(Body(0.5, 3.0, 1.8), 0.6 / n, n, push=(0.1, 0.35))
    >>> pushes = Pushes(("left",), 0.225, 0.25)
    >>> platen = np.eye(4 * n + 3)[:, : 2 * n + 2]
    >>> platen[2 * n + 1 : 3 * n + 1, 2 * n + 1] = 1.0
    >>> platen[3 * n + 1 :, 2 * n + 1] = 0.0
    >>> rollers = np.delete(np.eye(4 * n + 3), np.s_[3 * n + 1 : 4 * n + 2], axis=1)
    >>> for basis, push in (rollers, pushes), (platen, None):
    ...     matrix = basis.T @ whole @ basis
    ...     kept = np.arange(len(matrix)) < n
    ...     kept[-1] = True  # the force of the push, or the travel of the platen
    ...     S = eliminated(matrix, kept)
    ...     q, C = S[:n, -1] / S[:n, -1].mean(), S[-1, -1] if push is None else -1 / S[-1, -1]
    ...     K = 0.5 * n / 0.6 * S[:n, :n]
    ...     if push is None:  # at a given force the platen moves
    ...         K -= 0.5 * n / 0.6 * np.outer(S[-1, :n], S[-1, :n]) / C
    ...     found = block_response(0.6, n, 0.5, 3.0, 1.8, push)
    ...     off = float(np.abs((K - found.stiffness) @ slip).mean() / np.abs(K @ slip).max())
    ...     off_q, off_C = float(np.abs(q - found.shear).mean()), float(found.drive_stiffness / C)
    ...     print(off < 0.012, off_q < 0.006, abs(off_C - 1.0) < 0.005)
    True True True
    True True True

    A short block, also by finite elements:

    >>> whole = block(Body(0.5, 3.0, 1.8), 0.2 / n, n)
    >>> top = np.arange(2 * n + 1) > n
    >>> C = float(eliminated(whole[n : 3 * n + 1, n : 3 * n + 1], top).sum())
    >>> round(block_response(0.2, n, 0.5, 3.0, 1.8, None).drive_stiffness / C, 2)
    1.0
    """
    with one_blas_thread():
        response, coarse = (
            _anti_plane(length, nodes, height, modulus, pushes, resolution)
            if kappa is None
            else _in_plane(length, nodes, height, modulus, kappa, pushes, resolution)
            for resolution in (RESOLUTION, COARSER_RESOLUTION)
        )
    # Step 5.
    changes = (
        (response.stiffness - coarse.stiffness) / response.stiffness.diagonal().min(),
        response.shear - coarse.shear,
        coarse.drive_stiffness / response.drive_stiffness - 1.0,
    )
    return response._replace(error=max(float(np.abs(change).max()) for change in changes))


def _in_plane(
    length: float,
    nodes: int,
    height: float,
    modulus: float,
    kappa: float,
    pushes: Pushes | None,
    resolution: Resolution,
) -> BlockResponse:
    spacing = length / nodes
    harmonics = Harmonics(length, height, resolution.max_decay)
    effective = 4.0 * modulus / (kappa + 1.0)
    stiffness = stiffness_between_ends(nodes, spacing, effective)  # step 1
    stiffness += spacing * _rollers_correction(harmonics, effective, nodes)  # step 2
    if pushes is not None:  # step 3
        shear, compliance = _pushed(harmonics, pushes, nodes, resolution)
        drive = 2.0 * effective / compliance
    else:  # step 4
        top = GluedTop(harmonics, modulus, kappa, resolution.step)
        addition, shear, drive = _glued(top, nodes)
        stiffness += addition
    # Make uniform slip free of stress, from which it differs by 1e-7 of
    # the diagonal.
    stiffness[np.diag_indices(nodes)] -= stiffness.sum(axis=1)
    return BlockResponse(stiffness, shear / shear.mean(), drive)


def _rollers_correction(harmonics: Harmonics, effective: float, nodes: int) -> Array:
    """Step 2: return K of a block on rollers minus K of two ends without a top, Pa/m².

    The kernel of a block, in units of E*/(4 H), is a sum over k. Two
    nodes at a distance r contribute k (1 - k r) exp(-k r). Each end
    subtracts k (1 - k (x + s) + 2 k² x s) exp(-k (x + s)), with the
    distances x and s of the nodes from this end. The kernels of
    half-spaces, which are subtracted, are the limits for large H.
    """
    spacing, c = harmonics.length / nodes, 0.5 * np.pi / harmonics.height
    x, i = (np.arange(nodes) + 0.5) * spacing, np.arange(nodes)
    # The direct kernel k (1 - k r) exp(-k r), minus its limit for large
    # H. At r = 0 both are infinite, and their difference is c/12.
    r = spacing * np.arange(1, nodes)
    sums = harmonics.sums(r)
    along = np.append(c / 12.0, sums.first - r * sums.second + 0.5 / (c * r**2))
    # The reflection at an end: a part that depends on x + s alone, and
    # x s times another.
    r = spacing * np.arange(1, 2 * nodes)  # x + s
    sums = harmonics.sums(r)
    even = r * sums.second - sums.first - 0.5 / (c * r**2)
    odd = 6.0 / (c * r**4) - 2.0 * sums.third
    # Nodes i and j have x + s = (i + j + 1) dx from the left end. The
    # right end is its image.
    mirrored = i[:, None] + i
    end = even[mirrored] + np.outer(x, x) * odd[mirrored]
    kernel = along[np.abs(i[:, None] - i)] + end + end[::-1, ::-1]
    kernel += harmonics.reflected(harmonics.k, SLOPE, x, SLOPE, x)
    return 0.5 * effective / harmonics.height * kernel


def _glued(top: GluedTop, nodes: int) -> tuple[Array, Array, float]:
    """Step 4: return what glue adds to K (Pa/m), the shear stress at unit travel, and C."""
    spacing = top.harmonics.length / nodes
    on_interface = top.shear((np.arange(nodes) + 0.5) * spacing)
    tractions = top.solve(np.column_stack([np.ones(top.x.size), on_interface.T]))
    # Tractions for a unit travel, and for the displacements of the top
    # that slip causes.
    shear, *held = top.step * (on_interface @ tractions).T
    addition = 0.5 * spacing * np.array(held)
    # At a given force the platen moves, which takes its part of the
    # stress away.
    addition -= 0.5 * np.outer(shear, shear) / shear.sum()
    return 0.5 * (addition + addition.T), shear, float(top.step * tractions[:, 0].sum())


def _pushed(
    harmonics: Harmonics, pushes: Pushes, nodes: int, resolution: Resolution
) -> tuple[Array, float]:
    """Step 3: return the shear stress in a pushed block at 1 N/m, and 2 G* times the travel.

    The push has the harmonics 2/H `mean_sine`, and phi = mean_sine
    2/H/k² at the clamp.
    """
    k, length, height = harmonics.k, harmonics.length, harmonics.height
    low, high = pushes.edges(height)
    mean_sine = (np.cos(k * low) - np.cos(k * high)) / (k * (high - low))
    x = (np.arange(nodes) + 0.5) * length / nodes
    # Single waves from the edges of the push in closed form, and the
    # reflections.
    ends = harmonics.sums(x + 1j * low).plain - harmonics.sums(x + 1j * high).plain
    remainder = harmonics.raised - np.array([1.0, 1.0, 0.0, 0.0])
    waves = np.einsum("mxi,mi,m->x", harmonics.solutions(SLOPE, x), remainder, mean_sine)
    stress = 2.0 / height * (x * ends.real / (high - low) - waves)
    at_ends = harmonics.solutions(THIRD, np.array([0.0, length]))
    share = 2.0 * mean_sine**2 / k
    near = 4.0 * _mean_logarithm(harmonics, low, high, resolution.quadrature_rtol)
    near += float(np.einsum("mi,mi,m->", at_ends[:, 0], remainder, share))
    far = float(np.einsum("mi,mi,m->", at_ends[:, 1], harmonics.raised, share))
    return _of_sides(pushes, stress, near / height, far / height)


def _mean_logarithm(harmonics: Harmonics, low: float, high: float, rtol: float) -> float:
    """Return the sum over k of m_k²/k, where m_k is the mean of sin(k y) over low < y < high.

    The sum is a double integral of logarithms of y - y' and y + y'. A
    substitution reduces it to a single integral.

    The sum over the first 20,000 harmonics, one by one:

    >>> harmonics = Harmonics(1.0, 0.5, 10.0)
    >>> k = (np.arange(20_000) + 0.5) * np.pi / 0.5
    >>> mean = (np.cos(0.1 * k) - np.cos(0.3 * k)) / (0.2 * k)
    >>> round(_mean_logarithm(harmonics, 0.1, 0.3, 1e-9) / float(np.sum(mean**2 / k)), 6)
    1.0
    """
    width = high - low

    def integrand(apart: float) -> float:
        angles = np.array([apart, low + high - apart, low + high + apart])
        logarithms = harmonics.sums(1j * angles).inverse.real
        return float((width - apart) * (logarithms @ [1.0, -0.5, -0.5]))

    import scipy.integrate

    integral, _ = scipy.integrate.quad(integrand, 0.0, width, epsabs=0.0, epsrel=rtol)
    return float(integral) / width**2


def _of_sides(pushes: Pushes, stress: Array, near: float, far: float) -> tuple[Array, float]:
    """Return the stress and travel of a drive from the stress due to a force at the left end.

    `near` and `far` are the displacements at the force and at the same
    height of the other end.

    >>> stress = np.array([4.0, 1.0, 2.0])
    >>> for sides in (("left",), ("right",), ("left", "right")):
    ...     profile, travel = _of_sides(Pushes(sides, 1.0, 1.0), stress, 5.0, 2.0)
    ...     print(profile.tolist(), travel)
    [4.0, 1.0, 2.0] 5.0
    [2.0, 1.0, 4.0] 5.0
    [3.0, 1.0, 3.0] 3.5
    """
    if len(pushes.sides) == 2:
        return 0.5 * (stress + stress[::-1]), 0.5 * (near + far)
    return stress if pushes.sides[0] == "left" else stress[::-1], near


def glued_pressure(length: float, nodes: int, height: float, kappa: float) -> Array:
    """Return the pressure (n,) between blocks glued to rigid platens, divided by its mean.

    With rollers the pressure would be uniform, 1, and the top would
    widen by the fraction (3 - kappa)/(8 G) of its length. Glue prevents
    this through a shear traction without resultant.

    The pressure is symmetric. With kappa = 3, in plane strain without Poisson's
    effect, it would be uniform.

    >>> pressure = glued_pressure(2.0, 8, 0.5, 1.8)
    >>> np.allclose(pressure, pressure[::-1]), round(float(pressure.mean()), 9)
    (True, 1.0)
    >>> np.allclose(glued_pressure(2.0, 8, 0.5, 3.0), 1.0), bool(np.ptp(pressure) > 0.01)
    (True, True)

    In the file `columns`, the top moves by -1, and only u on the interface is free.

    >>> from stiction.elasticity.columns import Body, block
    >>> from stiction.elasticity.rig import on_cells
    >>> whole = block(Body(0.5, 3.0, 1.8), 0.6 / 12, 12)
    >>> u, v, forces = whole[:12, :12], whole[12:25, :12], -whole[:, 37:].sum(axis=1)
    >>> pressed = -on_cells(forces[12:25] - v @ np.linalg.solve(u, forces[:12]))
    >>> np.allclose(pressed / pressed.mean(), glued_pressure(0.6, 12, 0.5, 1.8), atol=2e-3)
    True
    """
    with one_blas_thread():
        harmonics = Harmonics(length, height, RESOLUTION.max_decay, pressed=True)
        top = GluedTop(harmonics, 1.0, kappa, RESOLUTION.step)
        wider = (3.0 - kappa) / 16.0 * (top.x - top.to_right)
        shifted, narrowed = top.solve(np.column_stack([np.ones(top.x.size), -wider])).T
        # Remove the resultant: the platens
        # are not loaded along the interface.
        traction = narrowed - narrowed.sum() / shifted.sum() * shifted
        x = (np.arange(nodes) + 0.5) * length / nodes
        pressure = 1.0 - top.step * top.normal(x) @ traction
    return pressure / pressure.mean()


def _anti_plane(
    length: float,
    nodes: int,
    height: float,
    modulus: float,
    pushes: Pushes | None,
    resolution: Resolution,
) -> BlockResponse:
    """Return the response in mode III: cosines on the interface, sines on the sides.

    K has the symbol (G/2) k coth(k H) below a platen, without k = 0 at
    a given force, and (G/2) k tanh(k H) below a free top. A push has
    the same harmonics as in mode II on rollers.

    A push in mode III, as a sum over harmonics that grow towards the pushed end:

    >>> k = (np.arange(20_000) + 0.5) * np.pi / 0.5
    >>> mean, x = (np.cos(0.1 * k) - np.cos(0.3 * k)) / (0.2 * k), (np.arange(8) + 0.5) / 8
    >>> grown = np.exp(-np.outer(x, k)) + np.exp(-np.outer(2.0 - x, k))
    >>> stress = grown @ (mean / -np.expm1(-2.0 * k))
    >>> near = 4.0 * np.sum(mean**2 / k / np.tanh(k))
    >>> far = 4.0 * np.sum(mean[:9] ** 2 / k[:9] / np.sinh(k[:9]))
    >>> found = _anti_plane(1.0, 8, 0.5, 3.0, Pushes(("left",), 0.2, 0.2), RESOLUTION)
    >>> np.allclose(found.shear, stress / stress.mean(), atol=1e-5)
    True
    >>> bool(abs(found.drive_stiffness * near / 3.0 - 1.0) < 1e-6)
    True
    >>> both = _anti_plane(1.0, 8, 0.5, 3.0, Pushes(("left", "right"), 0.2, 0.2), RESOLUTION)
    >>> bool(abs(both.drive_stiffness * 0.5 * (near + far) / 3.0 - 1.0) < 1e-6)
    True
    >>> bool(far > 1e-3 * near)
    True

    Below a free top, K multiplies the first cosine by (G/2) k tanh(k H):

    >>> cosine, K = np.cos(np.pi * x), found.stiffness
    >>> ratio = K @ cosine / cosine / (1.5 * np.pi * np.tanh(0.5 * np.pi))
    >>> bool(np.abs(ratio - 1.0).max() < 0.01)
    True
    """
    spacing = length / nodes
    k = np.pi / length * np.arange(1, nodes)
    finite = k * (1.0 / np.tanh(k * height) if pushes is None else np.tanh(k * height))
    # The lattice replaces |k|, and the finite height adds a smooth remainder.
    symbol = np.append(0.0, lattice_symbol(k * spacing) / spacing + finite - k)
    # Cosines diagonalise K between two free ends.
    cosines = idct(np.eye(nodes), norm="ortho", axis=0)
    stiffness = (cosines * (0.5 * modulus * symbol)) @ cosines.T
    if pushes is None:
        return BlockResponse(stiffness, np.ones(nodes), modulus * length / height)
    harmonics = Harmonics(length, height, resolution.max_decay)
    k, x = harmonics.k, (np.arange(nodes) + 0.5) * spacing
    low, high = pushes.edges(height)
    mean_sine = (np.cos(k * low) - np.cos(k * high)) / (k * (high - low))
    ends = harmonics.sums(x + 1j * low).inverse - harmonics.sums(x + 1j * high).inverse
    # Reflections between the ends. The closed forms hold the waves
    # before the first reflection.
    once = -np.expm1(-2.0 * k * length)
    waves = np.exp(-np.outer(2.0 * length + x, k)) + np.exp(-np.outer(2.0 * length - x, k))
    stress = 2.0 / height * (ends.real / (high - low) + waves @ (mean_sine / once))
    share = mean_sine**2 / (k * once)
    near = _mean_logarithm(harmonics, low, high, resolution.quadrature_rtol)
    near += 2.0 * float(share @ np.exp(-2.0 * k * length))
    far = 2.0 * float(share @ np.exp(-k * length))
    shear, travel = _of_sides(pushes, stress, 2.0 / height * near, 2.0 / height * far)
    return BlockResponse(stiffness, shear / shear.mean(), modulus / travel)


def lattice_symbol(angle: Array) -> Array:
    """Return the symbol |k| dx of the lattice for angles k dx.

    |k| dx is 2 arcsin(s) = 2 s (1 + s²/6 + ...), with s = |sin(k
    dx/2)|. The exact symbol has a kink at the shortest wave, and its
    entries vanish at every second distance. A smooth correction, such
    as for a finite block, would make these entries positive. All
    entries of the lattice symbol except the diagonal are negative.

    >>> (lattice_symbol(np.array([0.01, -0.2])) / [0.01, 0.2]).round(2).tolist()
    [1.0, 1.0]
    >>> lattice_symbol(np.array([np.pi, np.pi / 3.0])).round(9).tolist()  # s is 1 and 1/2
    [2.166666667, 1.020833333]
    """
    s = np.abs(np.sin(0.5 * angle))
    return 2.0 * s * (1.0 + LATTICE_CORRECTION * s * s)


def lattice_entries(count: int) -> Array:
    """Return the entries of `lattice_symbol` at distances 0, ..., count - 1 on an endless line.

    2 s has the entries -1/(pi (j² - 1/4)), and s² has 1/2 at distance 0
    and -1/4 at distance 1.

    The entries are the Fourier coefficients of the symbol:

    >>> angle = (np.arange(4096) + 0.5) * np.pi / 4096
    >>> cosines = np.cos(np.outer(np.arange(5), angle))
    >>> np.allclose(lattice_entries(5), cosines @ lattice_symbol(angle) / 4096, atol=1e-6)
    True
    """
    j = np.arange(-1.0, count + 1.0)
    entries = -1.0 / (np.pi * (j * j - 0.25))
    second: Array = 0.5 * entries[1:-1] - 0.25 * (entries[:-2] + entries[2:])
    return entries[1:-1] + LATTICE_CORRECTION * second


def stiffness_between_ends(nodes: int, spacing: float, modulus: float) -> Array:
    """Return K (n, n), Pa/m, for an interface with two free ends that do not interact.

    Nodes lie at (i + 1/2) dx. A free end x = 0 adds (G*/2
    pi)(12 x s/(x + s)^4 - 1/(x + s)²) to the shear stress of
    slip at s (N. Muskhelishvili, Some Basic Problems of the
    Mathematical Theory of Elasticity, 1953). The lattice and
    its mirror images at both ends account for 1/(x + s)².
    The remaining term is averaged over the cells of x and s:
    it is the mixed derivative of (G*/pi) x s/(x + s)².

    Uniform slip causes no stress, and the matrix is symmetric. Far from the
    ends it is the lattice.

    >>> K = stiffness_between_ends(400, 0.5, 3.0)
    >>> np.allclose(K, K.T), np.allclose(K, K[::-1, ::-1])
    (True, True)
    >>> bool(np.abs(K.sum(axis=1)).max() < 2e-3 * K[0, 0])
    True
    >>> np.allclose(K[200, 200:204], 1.5 / 0.5 * lattice_entries(4), atol=1e-4)
    True

    For two nodes, x s/(x + s)^2 is 1/4 at the edges (1, 1), and 2/9 at (1, 2) and (2, 1).
    Node 0 has images at the distances 1 and 3, and the pair has two images at the distance 2.

    >>> entries, pair = lattice_entries(4), stiffness_between_ends(2, 2.0, 4.0)
    >>> corner, far, between = 0.25, 0.25 + 0.25 - 4.0 / 9.0, 2.0 / 9.0 - 0.25
    >>> on_diagonal = entries[0] + entries[1] + entries[3] - (corner + far) * 2.0 / np.pi
    >>> off_diagonal = entries[1] + 2.0 * entries[2] - 2.0 * between * 2.0 / np.pi
    >>> np.allclose(pair, [[on_diagonal, off_diagonal], [off_diagonal, on_diagonal]])
    True
    """
    entries, i = lattice_entries(2 * nodes), np.arange(nodes)
    mirrored = i[:, None] + i
    both = entries[np.abs(i[:, None] - i)] + entries[mirrored + 1] + entries[::-1][mirrored]
    # The mixed derivative over cells is the mixed difference of x s/(x + s)² at their edges.
    edge = np.arange(nodes + 1.0)
    share = np.outer(edge, edge) / np.maximum(np.add.outer(edge, edge), 1.0) ** 2
    rest = np.diff(np.diff(share, axis=0), axis=1) * (2.0 / np.pi)
    return (0.5 * modulus / spacing) * (both - rest - rest[::-1, ::-1])

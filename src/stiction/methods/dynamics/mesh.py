"""A finite-element mesh for a block, 0 < x < L and 0 < y < H, on the nodes of its interface.

Problem
-------
Discretise the elasticity of a block for waves (`waves`), on rows of
nodes above the interface. The static response must agree with the
closed form of `elasticity.blocks`.

Grid
----
Columns lie at the nodes x = (i + 1/2) dx, so that each column has a
cell of the interface. Beyond the outer columns half a cell remains, in
which s_xx and s_xy vanish: a strip that only resists stretching along
y. Rows are dx apart at the interface and up to five times as much
above.

Elements (`_elements`)
----------------------
Elements are bilinear. An element with the sides a and b has mean
strains and two hourglass modes (D. P. Flanagan and T. Belytschko,
International Journal for Numerical Methods in Engineering 17, 1981).
Exact integration gives the energy of the means as a b (s . e)/2, and
the energy of an hourglass mode as (c_11 b/a + G a/b)/24 times the
square of u_00 - u_10 - u_01 + u_11, and likewise for v. In mode III
there is only u. Then c_11 is G, and the other coefficients are zero.

Algorithm (`make_mesh`)
-----------------------
1. Place the rows. Compute elements, masses and the stencils that move
   nodes.
2. Condense the static response: eliminate the rows from the top downwards
   (`condensed`; R. J. Guyan, AIAA Journal 3, 1965).
3. Correct the static response: the K of the closed form minus the K of
   the mesh acts on the slip of the interface.
4. Find the stable step for mesh, viscosity
   and correction together (`_limit`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from stiction.base.arrays import Array, one_blas_thread
from stiction.base.model import Mode
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem
from stiction.problem.solid import Solid
from stiction.problem.specimen import Blocks, Platen

ROW_RATIO, MAX_ROW_HEIGHT = 1.08, 5.0
"""Ratio of the heights of successive rows, and their largest height in
units of dx."""
GRID_VISCOSITY = 0.05
"""Viscous time in units of dx/c_d, which damps oscillations of the
shortest waves."""


class Mesh(NamedTuple):
    """A block with its drive and time step. Forces and masses are per unit depth."""

    spacing: float
    heights: Array
    """y of the rows, m."""
    mass: Array
    """Mass of a node of each row, kg/m."""
    elements: Array
    """Stiffness of the elements above each row but the last, (rows - 1,
    2, 2, 2, 2, 2, 2), Pa. The indices are lower or upper row, x or y,
    left or right, for the force and then for the displacement."""
    strips: Array
    """Stiffness of the half cells at the ends, along x and y, (rows -
    1, 2), Pa."""
    stencils: Array
    """Coefficients of the force on a node by its neighbours, (rows, 2,
    5, 3); see `_stencils`."""
    anti_plane: bool
    push: Array
    """Fraction of the pusher's force on the left and on the right of
    each row, (rows, 2)."""
    platen: bool
    stiffness: float
    """Stiffness of the machine for a block, half of the specimen, Pa."""
    drive_mass: float
    """Mass of platen or pusher, kg/m."""
    impedance: float
    """G/(2 c_s), Pa s/m."""
    attenuation: float
    """Rate at which momentum is lost, 1/s."""
    viscous_time: float = 0.0
    step: float = 0.0
    window: int = 0
    """Number of steps in which a shear wave crosses the block and
    returns."""
    correction: Array = np.zeros((0, 0), np.float32)
    """K of the closed form less K of the mesh, (n, n), Pa/m."""


def make_mesh(problem: Problem, courant: float = 0.9) -> Mesh:
    """Return the mesh for a problem's block.

    The step is `courant` times the stability limit.

    >>> import dataclasses, stiction as st
    >>> blocks = st.Blocks(
    ...     height=0.03, drive=st.Pusher(height=0.01, width=0.01, side="right")
    ... )
    >>> problem = st.Problem(
    ...     solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0),
    ...     interface=st.Interface(0.1, 16),
    ...     friction=st.LinearWeakening(weakening_rate=4e10),
    ...     specimen=blocks,
    ... )
    >>> mesh = make_mesh(problem)
    >>> print(f"{mesh.mass.sum() / (1000.0 * 0.1 / 16 * 0.03):.6f}")
    1.000000
    >>> mesh.push.sum(axis=0).round(6).tolist()
    [0.0, 1.0]
    >>> mesh.impedance, round(mesh.attenuation * 25.0 * 0.1 / np.pi, 6), mesh.platen
    (500000.0, 1000.0, False)
    >>> (
    ...     bool(mesh.window == np.ceil(2.0 * 0.1 / 1000.0 / mesh.step)),
    ...     mesh.correction.dtype.name,
    ... )
    (True, 'float32')
    >>> thin, c_d = np.diff(mesh.heights).min(), 1000.0 * 3.0**0.5
    >>> both = condensed(mesh, 16)[0] + mesh.correction
    >>> np.allclose(
    ...     both, problem.blocks.stiffness, rtol=1e-5, atol=1e-6 * both.max()
    ... )
    True
    >>> half = make_mesh(problem, 0.45).step / mesh.step
    >>> round(half, 6), bool(0.0 < mesh.step < 0.9 * thin / c_d)
    (0.5, True)
    >>> blocks = st.Blocks(
    ...     height=0.03, thickness=0.005, drive=st.Platen(stiffness=1e6, mass=0.2)
    ... )
    >>> driven = make_mesh(dataclasses.replace(problem, specimen=blocks))
    >>> driven.platen, driven.stiffness, driven.drive_mass, bool(driven.push.any())
    (True, 400000000.0, 40.0, False)
    """
    assert problem.specimen is not None
    return _mesh(problem.specimen, problem.interface, problem.solid, problem.mode, courant)


@lru_cache(maxsize=4)
def _mesh(
    specimen: Blocks, interface: Interface, solid: Solid, mode: Mode, courant: float
) -> Mesh:
    # 1. Rows, elements, masses and the drive.
    dx, n, drive = interface.spacing, interface.size, specimen.drive
    depth, c_s = specimen.thickness or 1.0, solid.shear_wave_speed
    heights = row_heights(specimen.height, dx)
    elements, strips = _elements(np.diff(heights), dx, solid, mode == "III")
    # A row carries half of the elements above and below it.
    tributary = np.gradient(heights)
    tributary[[0, -1]] = 0.5 * np.diff(heights)[[0, -1]]
    push = np.zeros((heights.size, 2))
    if not isinstance(drive, Platen):
        share = _covered(heights, drive.height, drive.width)
        push[:, 0] = share * {"left": 1.0, "both": 0.5, "right": 0.0}[drive.side]
        push[:, 1] = share * {"left": 0.0, "both": 0.5, "right": 1.0}[drive.side]
    mesh = Mesh(
        spacing=dx,
        heights=heights,
        mass=solid.density * dx * tributary,
        elements=elements,
        strips=strips,
        stencils=_stencils(elements, strips),
        anti_plane=mode == "III",
        push=push,
        platen=isinstance(drive, Platen),
        stiffness=2.0 * drive.stiffness / depth,
        drive_mass=drive.mass / depth,
        impedance=0.5 * solid.shear_modulus / c_s,
        attenuation=np.pi * c_s / interface.measure / specimen.quality_factor,
    )
    # 2. and 3. The static response, with the machine, and its correction.
    static, profile, stiffness = condensed(mesh, n)
    if mesh.stiffness > 0.0:
        relief = 0.5 * stiffness / (1.0 + stiffness / mesh.stiffness) / interface.measure
        static = static + relief / n * np.outer(profile, profile)
    blocks = specimen.driven(interface.measure, n, solid, mode)
    correction = blocks.stiffness - static
    # 4. The step.
    speed = c_s * (1.0 if mesh.anti_plane else solid.wave_speed_ratio)
    viscous = GRID_VISCOSITY * dx / speed
    step = courant * _limit(speed, c_s, mesh, correction, viscous)
    longest = max(interface.measure, specimen.height)
    return mesh._replace(
        viscous_time=viscous,
        step=step,
        window=int(np.ceil(2.0 * longest / c_s / step)),
        correction=correction.astype(np.float32),
    )


def row_heights(height: float, spacing: float) -> Array:
    """Return the heights y of the rows, m. The first two are `spacing` apart.

    The steps 1, 1.08 and 1.08² reach beyond 3 m. All but the first shrink by
    the same factor.

    >>> row_heights(3.0, 1.0).round(6).tolist(), row_heights(2.0, 1.0).tolist()
    ([0.0, 1.0, 1.961538, 3.0], [0.0, 1.0, 2.0])
    >>> steps = np.diff(row_heights(400.0, 1.0))  # at most five times the first
    >>> print(
    ...     f"{steps[3] / steps[2]:.6f} {steps[-1] / steps[-2]:.6f} {steps.sum():.6f}"
    ... )
    1.080000 1.000000 400.000000
    """
    numbers = np.arange(int(2.0 * height / spacing) + 2)
    steps = spacing * np.minimum(ROW_RATIO**numbers, MAX_ROW_HEIGHT)
    count = max(int(np.searchsorted(np.cumsum(steps), height * (1.0 - 1e-9))) + 1, 2)
    # Stretch the rows to end at the top, except the first, which fits
    # the interface.
    steps = steps[:count]
    steps[1:] *= (height - spacing) / steps[1:].sum()
    return np.concatenate([[0.0], np.cumsum(steps)])


def _elements(b: Array, a: float, solid: Solid, anti: bool) -> tuple[Array, Array]:
    """Return the stiffness of elements with heights b, and of the strips at their ends.

    An element with the sides 0.25 and 0.5 has the energies of uniform strains:
    u_x, v_y, u_y, a rotation, both stretches, and an hourglass mode.

    >>> from types import SimpleNamespace
    >>> solid = SimpleNamespace(
    ...     shear_modulus=2.0, wave_speed_ratio=3.0**0.5
    ... )  # c_11 = 6, c_12 = 2
    >>> a, b, d = 0.25, 0.5, np.zeros((6, 2, 2, 2))  # (case, row, axis, column)
    >>> d[[0, 4], :, 0, 1], d[[1, 4], 1, 1], d[[2, 3], 1, 0], d[3, :, 1, 1] = (
    ...     a,
    ...     b,
    ...     b,
    ...     -a,
    ... )
    >>> d[5, :, 0] = [[1.0, -1.0], [-1.0, 1.0]]
    >>> elements, strips = _elements(np.array([b]), a, solid, False)
    >>> energy = 0.5 * np.einsum("nrac,racsbd,nsbd->n", d, elements[0], d) / (a * b)
    >>> energy[:5].round(9).tolist(), round(float(energy[5] * a * b), 6)
    ([3.0, 3.0, 1.0, 0.0, 8.0], 8.666667)
    >>> round((6.0 * b / a + 2.0 * a / b) / 24.0 * 4.0**2, 6)
    8.666667
    >>> strips.round(6).tolist()  # a/2b times c_11 - c_12²/c_11
    [[0.0, 1.333333]]

    In mode III there is only u.

    >>> elements, strips = _elements(np.array([b]), a, solid, True)
    >>> energy = 0.5 * np.einsum("nrac,racsbd,nsbd->n", d, elements[0], d) / (a * b)
    >>> energy[:5].round(9).tolist(), strips.tolist()
    ([1.0, 0.0, 1.0, 1.0, 1.0], [[0.5, 0.0]])
    """
    shear = solid.shear_modulus
    c11 = shear * (1.0 if anti else solid.wave_speed_ratio**2)
    sign, axes = np.array([-1.0, 1.0]), np.eye(2)
    # Weights of the corners (row, axis, column) in a mean strain, and
    # in an hourglass mode.
    along = [np.multiply.outer([0.5, 0.5], np.outer(axis, sign)) for axis in axes]
    up = [0.5 * np.multiply.outer(sign, np.outer(axis, [1.0, 1.0])) for axis in axes]
    twist = [np.multiply.outer(sign, np.outer(axis, sign)) for axis in axes]

    def times(stiffness: Any, left: Array, right: Array) -> Array:
        return np.multiply.outer(stiffness * np.ones_like(b), np.multiply.outer(left, right))

    # Energy of u alone: stretching along x, shear by du/dy, and the
    # hourglass mode.
    elements = times(c11 * b / a, along[0], along[0]) + times(shear * a / b, up[0], up[0])
    elements += times((c11 * b / a + shear * a / b) / 12.0, twist[0], twist[0])
    stretched = 0.0
    if not anti:
        # The same of v, and the products of strains of u and v.
        c12 = c11 - 2.0 * shear
        elements += times(c11 * a / b, up[1], up[1]) + times(shear * b / a, along[1], along[1])
        elements += times((c11 * a / b + shear * b / a) / 12.0, twist[1], twist[1])
        for left, right, stiffness in ((along[0], up[1], c12), (up[0], along[1], shear)):
            elements += times(stiffness, left, right) + times(stiffness, right, left)
        # Modulus of a strip that stretches along y while s_xx vanishes.
        stretched = c11 - c12**2 / c11
    strips = 0.5 * a / b[:, None] * np.array([shear if anti else 0.0, stretched])
    return elements, strips


def _stencils(elements: Array, strips: Array) -> Array:
    """Return the coefficients (rows, axis, 5, 3) of the force on a node.

    The last index is the row below, the row of the node, and the row
    above. The five coefficients belong to

    - the sum of both neighbours in a row, and the node itself,
    - the difference of both neighbours in the other component,
    - at the left end, with a single neighbour, the node itself, and its
      other component. At the right end the other component has the
      opposite sign.

    The rows of minus the stiffness matrix hold the same coefficients.

    >>> from types import SimpleNamespace
    >>> solid = SimpleNamespace(shear_modulus=2.0, wave_speed_ratio=3.0**0.5)
    >>> elements, strips = _elements(np.array([0.5, 0.75]), 0.25, solid, False)
    >>> mesh = SimpleNamespace(elements=elements, strips=strips)
    >>> stencils = _stencils(elements, strips)
    >>> lower, upper = (layer_matrix(mesh, layer, 4).toarray() for layer in (0, 1))
    >>> K = np.zeros((24, 24))  # u and v at the nodes of three rows
    >>> K[:16, :16], K[8:, 8:] = lower, K[8:, 8:] + upper
    >>> K[8:16, 8:16] = lower[8:, 8:] + upper[:8, :8]
    >>> rows = -K.reshape(
    ...     3, 2, 4, 3, 2, 4
    ... )  # row, axis and node of the force, and of the motion
    >>> for axis in (0, 1):
    ...     found = stencils[1, axis]
    ...     same, other = rows[1, axis][:, :, axis], rows[1, axis][:, :, 1 - axis]
    ...     print(
    ...         np.allclose(found[[0, 1, 0]].T, same[1, :, :3], atol=1e-5), end=" "
    ...     )
    ...     cross = [-found[2], 0.0 * found[2], found[2]]
    ...     print(np.allclose(cross, other[1, :, :3].T, atol=1e-5), end=" ")
    ...     print(
    ...         np.allclose([found[3], found[0]], same[0, :, :2].T, atol=1e-5),
    ...         end=" ",
    ...     )
    ...     print(np.allclose([-found[2], -found[4]], other[3, :, 2:].T, atol=1e-5))
    True True True True
    True True True True
    """
    stencils = np.zeros((len(elements) + 1, 2, 5, 3))
    for row, (element, strip) in enumerate(zip(elements, strips, strict=True)):
        for up in (0, 1):
            for axis in (0, 1):
                # The stiffness gives the force that holds a node. The
                # force on the node is its negative.
                same, cross = element[up, axis, :, :, axis], element[up, axis, :, :, 1 - axis]
                end = same[0, :, 0].copy()
                end += strip[axis] * np.where(np.arange(2) == up, 1.0, -1.0)
                stencils[row + up, axis, :, 1 - up : 3 - up] -= [
                    same[0, :, 1], same[0, :, 0] + same[1, :, 1], cross[0, :, 1], end,
                    cross[0, :, 0],
                ]  # fmt: skip
    return stencils.astype(np.float32)


def _covered(heights: Array, middle: float, width: float) -> Array:
    """Return each row's fraction of a uniform traction, zero for the interface.

    The rows have parts from 0 to 0.5, 1.5, 3 and 4 m. A pusher from 0 to 2 m
    covers the first three, and its force on the interface goes to row 1.

    >>> heights = np.array([0.0, 1.0, 2.0, 4.0])
    >>> (
    ...     _covered(heights, 1.0, 2.0).tolist(),
    ...     _covered(heights, 3.5, 2.0).round(6).tolist(),
    ... )
    ([0.0, 0.75, 0.25, 0.0], [0.0, 0.0, 0.333333, 0.666667])
    """
    edges = np.concatenate([heights[:1], 0.5 * (heights[1:] + heights[:-1]), heights[-1:]])
    low, high = middle - 0.5 * width, middle + 0.5 * width
    share = np.maximum(np.minimum(edges[1:], high) - np.maximum(edges[:-1], low), 0.0)
    # The row above the interface takes the part of the interface.
    share[1] += share[0]
    share[0] = 0.0
    return share / share.sum()


def _limit(c: float, c_s: float, mesh: Mesh, correction: Array, viscous: float) -> float:
    """Return the largest stable step, s, given the speeds of the fastest waves (c) and shear (c_s).

    The step is stable for mesh, viscosity and correction together.

    The fastest element has the squared frequency 4 * 3²/0.25². The stiffest
    correction adds 2 * 3 * 0.5/0.75. Damping shortens the step.

    >>> from types import SimpleNamespace
    >>> heights, mass = np.array([0.0, 0.5, 0.75]), np.array([0.75, 9.0, 9.0])
    >>> mesh = SimpleNamespace(spacing=0.5, heights=heights, mass=mass)
    >>> frequency = (4.0 * 9.0 / 0.0625 + 4.0) ** 0.5
    >>> step = _limit(3.0, 2.0, mesh, np.diag([1.0, 3.0, -5.0]), 0.0)
    >>> print(f"{step * frequency:.6f}")
    2.000000
    >>> damped = _limit(3.0, 2.0, mesh, np.diag([1.0, 3.0, -5.0]), 0.02)
    >>> print(
    ...     f"{damped / step + 0.01 * frequency - (1.0 + (0.01 * frequency) ** 2) ** 0.5:.6f}"
    ... )
    0.000000
    >>> close = _limit(2.0, 1.9, mesh, np.diag([-1.0, -2.0, -3.0]), 0.0)
    >>> print(
    ...     f"{(2.0 / close) ** 2 * 0.0625:.6f} {8.0 / 3.0 * (2.0**2 + 1.9**2):.6f}"
    ... )
    20.293333 20.293333
    """
    thin = min(mesh.spacing, float(np.diff(mesh.heights).min()))
    # Bound of the squared frequency of an element, then of the
    # correction on the interface.
    squares = max(4.0 * c**2, 8.0 / 3.0 * (c**2 + c_s**2)) / thin**2
    last = [len(correction) - 1] * 2
    stiffest = float(scipy.linalg.eigvalsh(correction, subset_by_index=last)[0])
    squares += 2.0 * max(stiffest, 0.0) * mesh.spacing / mesh.mass[0]
    frequency = np.sqrt(squares)
    # Stability limit of the leapfrog with stiffness-proportional damping.
    damped = 0.5 * viscous * frequency
    return float(2.0 / frequency * (np.sqrt(1.0 + damped**2) - damped))


def layer_matrix(mesh: Mesh, layer: int, nodes: int) -> sp.csr_matrix:
    """Return the stiffness of an element row, for u and v at the lower and then the upper nodes.

    A stretch along x has the energy of three elements between four columns.
    A stretch along y also has the energy of two strips.

    >>> from types import SimpleNamespace
    >>> solid = SimpleNamespace(shear_modulus=2.0, wave_speed_ratio=3.0**0.5)
    >>> elements, strips = _elements(np.array([0.7, 0.5]), 0.25, solid, False)
    >>> K = layer_matrix(
    ...     SimpleNamespace(elements=elements, strips=strips), 1, 4
    ... ).toarray()
    >>> along, up = np.zeros(
    ...     (2, 4, 4)
    ... )  # (u and v of the lower row, and of the upper row; column)
    >>> along[[0, 2]], up[3] = 0.25 * np.arange(4), 0.5
    >>> print(f"{0.5 * along.ravel() @ K @ along.ravel() / (0.25 * 0.5):.6f}")
    9.000000
    >>> print(
    ...     f"{0.5 * up.ravel() @ K @ up.ravel() / (0.25 * 0.5):.6f}"
    ... )  # 3 * 3 + (6 - 4/6)/2
    11.666667
    """
    left, right = np.eye(nodes, nodes - 1), np.eye(nodes, nodes - 1, -1)
    # Neighbouring elements have common nodes. Both matrices select
    # the nodes of a side.
    columns = [sp.csr_matrix(left), sp.csr_matrix(right)]
    stiffness = sp.csr_matrix((4 * nodes, 4 * nodes))
    for i, to_column in enumerate(columns):
        for j, from_column in enumerate(columns):
            corner = mesh.elements[layer][:, :, i, :, :, j].reshape(4, 4)
            stiffness += sp.kron(corner, to_column @ from_column.T)
    # The strips at both ends stretch between the rows.
    ends = sp.csr_matrix((np.ones(2), ([0, nodes - 1],) * 2), shape=(nodes, nodes))
    strips = np.kron([[1.0, -1.0], [-1.0, 1.0]], np.diag(mesh.strips[layer]))
    return (stiffness + sp.kron(strips, ends)).tocsr()


def condensed(mesh: Mesh, nodes: int) -> tuple[Array, Array, float]:
    """Return K of the mesh at a given force (Pa/m), q, and C (Pa).

    See `elasticity.blocks`.

    Motions that are even and odd about the middle of the block are
    independent, which halves the matrices.

    In mode III a dead load shears the block evenly: q is 1, C is G L/H, and a
    rigid motion has no stiffness.

    >>> from types import SimpleNamespace
    >>> solid = SimpleNamespace(shear_modulus=2.0, wave_speed_ratio=3.0**0.5)
    >>> elements, strips = _elements(np.array([0.25, 0.5]), 0.25, solid, True)
    >>> mesh = SimpleNamespace(
    ...     spacing=0.25,
    ...     heights=np.array([0.0, 0.25, 0.75]),
    ...     elements=elements,
    ...     strips=strips,
    ...     anti_plane=True,
    ...     platen=True,
    ...     push=np.zeros((3, 2)),
    ... )
    >>> static, profile, C = condensed(mesh, 4)
    >>> profile.round(6).tolist(), round(C * 0.75 / (2.0 * 1.0), 6)
    ([1.0, 1.0, 1.0, 1.0], 1.0)
    >>> print(
    ...     f"{np.abs(static.sum(axis=0)).max():.9f} {np.abs(static - static.T).max():.9f}"
    ... )
    0.000000000 0.000000000
    >>> bool(static.diagonal().min() > 0.0 > static[0, 1])
    True

    In mode II, the stiffness matrix without the platen's u and the v of the
    interface gives the same.

    >>> elements, strips = _elements(np.array([0.5]), 0.25, solid, False)
    >>> fields = {
    ...     "elements": elements,
    ...     "strips": strips,
    ...     "heights": mesh.heights[[0, 2]] / 1.5,
    ... }
    >>> fields |= {
    ...     "anti_plane": False,
    ...     "platen": True,
    ...     "push": mesh.push,
    ...     "spacing": 0.25,
    ... }
    >>> static, profile, C = condensed(SimpleNamespace(**fields), 4)
    >>> K = layer_matrix(SimpleNamespace(**fields), 0, 4).toarray()
    >>> moves = np.eye(16)[:, 4:9]
    >>> moves[8:12, 4] = 1.0
    >>> flexibility = np.linalg.inv(moves.T @ K @ moves)
    >>> schur = K[:4, :4] - K[:4] @ moves @ flexibility @ moves.T @ K[:, :4]
    >>> (
    ...     np.allclose(static, 0.5 / 0.25 * schur),
    ...     np.allclose(C * flexibility[4, 4], 1.0),
    ... )
    (True, True)
    >>> force = -K[:4] @ moves @ flexibility[:, 4]
    >>> np.allclose(profile, 4.0 * force / force.sum())
    True
    """
    static, force, compliance = np.zeros((nodes, nodes)), np.zeros(nodes), 0.0
    half = np.eye(nodes, nodes // 2)
    with one_blas_thread():
        for sign in (1.0, -1.0):
            # If u is even about the middle, v is odd, and vice versa.
            folds = [(half + one * half[::-1]) / np.sqrt(2.0) for one in (sign, -sign)]
            above, below, moved = _condensed(mesh, folds)
            static += folds[0] @ above @ folds[0].T
            force += folds[0] @ below
            compliance += moved
    static *= 0.5 / mesh.spacing
    return 0.5 * (static + static.T), force * nodes / force.sum(), 1.0 / compliance


def _condensed(mesh: Mesh, folds: list[Array]) -> tuple[Array, Array, float]:
    """Return stiffness, force and compliance for the even or the odd motion.

    Rows are eliminated from the top downwards. The matrices `folds`, of
    shape (nodes, half), map the unknowns of half a row to u and v at
    all its nodes.
    """
    nodes, size = folds[0].shape
    fold = sp.csr_matrix(scipy.linalg.block_diag(*folds, *folds))
    unknowns = size if mesh.anti_plane else 2 * size  # of a row: u, and v
    ends = folds[0][[0, -1]].T
    kept, above, force = sp.eye(size).tocsr(), np.zeros((size, size)), np.zeros(size)
    if mesh.platen:  # rigid, so all of its nodes move alike, and it rests in odd motion
        kept = sp.csr_matrix(folds[0].sum(axis=0)[:, None])
        above, force = np.eye(1) * (kept.nnz == 0), np.ones(1) * (kept.nnz > 0)
    compliance = 0.0

    def eliminated(inner: Array, between: Any, force: Array) -> tuple[Array, Array, float]:
        # The Schur complement, by the inverse of a Cholesky factor
        # (LAPACK's dpotri).
        factor = scipy.linalg.cholesky(inner, overwrite_a=True, check_finite=False)
        inverse = scipy.linalg.lapack.dpotri(factor, overwrite_c=True)[0]
        inverse = np.triu(inverse) + np.triu(inverse, 1).T
        moved = inverse @ force
        condensed_part = between.T @ (between.T @ inverse).T
        return -condensed_part, -(between.T @ moved), float(force @ moved)

    # `above` is the stiffness of all rows above, condensed to the nodes of this row.
    for row in range(mesh.heights.size - 1, 0, -1):
        layer = (fold.T @ layer_matrix(mesh, row - 1, nodes) @ fold).tocsc()
        up = slice(2 * size, 2 * size + kept.shape[0])
        force = force + kept[:size].T @ (ends @ mesh.push[row])
        inner = above + (kept.T @ layer[up, up] @ kept).toarray()
        above, force, moved = eliminated(inner, kept.T @ layer[up, :unknowns], force)
        above += layer[:unknowns, :unknowns].toarray()
        compliance += moved
        kept = sp.eye(unknowns).tocsr()
    if not mesh.anti_plane:  # v of the interface
        v = slice(size, None)
        change, added, moved = eliminated(above[v, v], above[v, :size], force[v])
        above, force = above[:size, :size] + change, force[:size] + added
        compliance += moved
    return above, force, compliance

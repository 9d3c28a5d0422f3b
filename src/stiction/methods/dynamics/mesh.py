"""A block in bilinear finite elements: 0 < x < L, 0 < y < H, with the nodes of its interface.

Columns lie at the nodes x = (i + 1/2) dx, so that each has a cell of the interface. Beyond the
outer ones half a cell remains, in which s_xx and s_xy vanish: it is a strip that only resists to
being stretched along y. Rows are dx apart at the interface and up to four times as much above.

An element with the sides a and b has mean strains and two modes of an hourglass. Exact integration
gives its energy as a b (s . e)/2 of the means, and (c_11 b/a + G a/b)/24 times the square of
u_00 - u_10 - u_01 + u_11, likewise for v. In mode III there is only u: c_11 is G, all else zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from stiction.base.arrays import Array, one_blas_thread
from stiction.problem.problem import Problem
from stiction.problem.specimen import Platen

GROWTH, WIDEST = 1.08, 4.0
"""Ratio of the heights of successive rows, and their largest height over dx."""
VISCOSITY = 0.05
"""Of the grid: oscillations of the shortest waves lose stress over dx/c_d times this."""


class Layers(NamedTuple):
    """Coefficients of the forces of each row of elements, in N/m² per unit depth, (rows - 1,).

    Means of s_xx from u_x and v_y, of s_yy from v_y, of s_xy from u_y and v_x and their product,
    each times what it exerts at a node; two hourglasses; the strips at the ends.
    """

    xx: Array
    xy: Array
    yy: Array
    shear_u: Array
    shear: Array
    shear_v: Array
    hourglass_u: Array
    hourglass_v: Array
    strip_u: Array
    strip_v: Array


class Mesh(NamedTuple):
    """A block, its drive and its step in time; forces and masses are per unit depth."""

    spacing: float
    heights: Array
    """y of the rows, m."""
    mass: Array
    """Of a node of each row, kg/m."""
    layers: Layers
    stencils: Array
    """What differences and sums of neighbours exert at each row, (rows, 4, 6); see `_stencils`."""
    anti_plane: bool
    push: Array
    """Share of the pusher's force on the left and on the right of each row, (rows, 2)."""
    platen: bool
    stiffness: float
    """Of the machine, as one block sees it, Pa."""
    drive_mass: float
    """Of platen or pusher, kg/m."""
    attenuation: float
    """1/s: momentum is lost at this rate."""
    viscous_time: float
    step: float
    window: int
    """Steps in which a shear wave crosses the block and returns."""
    correction: Array
    """K of the closed form less that of the mesh, (n, n), Pa/m."""


def make_mesh(problem: Problem, courant: float = 0.9) -> Mesh:
    """Return the mesh of a block of a problem, its step being a share of the stability limit."""
    specimen = problem.specimen
    assert specimen is not None
    drive, depth = specimen.drive, specimen.thickness or 1.0
    return _mesh(
        problem, courant, 2.0 * drive.stiffness / depth, drive.mass / depth,
        np.pi * problem.solid.shear_wave_speed / problem.interface.extent
        / specimen.quality_factor,
    )  # fmt: skip


def _mesh(
    problem: Problem, courant: float, stiffness: float, drive_mass: float, attenuation: float
) -> Mesh:
    interface, solid, specimen = problem.interface, problem.solid, problem.specimen
    assert specimen is not None
    dx, n = interface.spacing, interface.size
    shear, anti_plane = solid.shear_modulus, problem.mode == "III"
    heights = row_heights(specimen.height, dx)
    moduli = (shear, 0.0) if anti_plane else _moduli(shear, solid.wave_speed_ratio)
    layers = _layers(np.diff(heights), dx, *moduli, shear, anti_plane)
    tributary = np.gradient(heights)
    tributary[[0, -1]] = 0.5 * np.diff(heights)[[0, -1]]
    mass = solid.density * dx * tributary
    platen = isinstance(drive := specimen.drive, Platen)
    push = np.zeros((heights.size, 2))
    if not isinstance(drive, Platen):
        share = _covered(heights, drive.height, drive.width)
        push[:, 0] = share * {"left": 1.0, "both": 0.5, "right": 0.0}[drive.side]
        push[:, 1] = share * {"left": 0.0, "both": 0.5, "right": 1.0}[drive.side]
    mesh = Mesh(
        dx, heights, mass, layers, _stencils(layers), anti_plane, push, platen, stiffness,
        drive_mass, attenuation, 0.0, 0.0, 0, np.zeros((n, n)),
    )  # fmt: skip
    static, profile, own = condensed(mesh, n, anti_plane)
    if stiffness > 0.0:
        relief = 0.5 * own / (1.0 + own / stiffness) / interface.extent
        static = static + relief / n * np.outer(profile, profile)
    correction = problem.blocks.stiffness - static
    speed = solid.shear_wave_speed * (1.0 if anti_plane else solid.wave_speed_ratio)
    viscous = VISCOSITY * dx / speed
    step = courant * _limit(speed, solid.shear_wave_speed, mesh, correction, viscous)
    longest = max(interface.extent, specimen.height)
    return mesh._replace(
        viscous_time=viscous,
        step=step,
        window=int(np.ceil(2.0 * longest / solid.shear_wave_speed / step)),
        correction=np.ascontiguousarray(correction),
    )


def row_heights(height: float, spacing: float) -> Array:
    """Return the y of the rows, the first two `spacing` apart."""
    steps = spacing * np.minimum(GROWTH ** np.arange(int(2.0 * height / spacing) + 2), WIDEST)
    count = max(int(np.searchsorted(np.cumsum(steps), height * (1.0 - 1e-9))) + 1, 2)
    steps = steps[:count]
    steps[1:] *= (height - spacing) / steps[1:].sum()
    return np.concatenate([[0.0], np.cumsum(steps)])


def _moduli(shear: float, ratio: float) -> tuple[float, float]:
    """Return c_11 and c_12 of the plane state, Pa."""
    along = shear * ratio**2
    return along, along - 2.0 * shear


def _layers(b: Array, a: float, c11: float, c12: float, shear: float, anti: bool) -> Layers:
    cross, c22 = (0.0, 0.0) if anti else (1.0, c11)
    one = np.ones_like(b)
    stretched = 0.0 if anti else c22 - c12**2 / c11
    found = Layers(
        xx=c11 * b / (4.0 * a),
        xy=0.25 * c12 * one,
        yy=c22 * a / (4.0 * b),
        shear_u=shear * a / (4.0 * b),
        shear=0.25 * cross * shear * one,
        shear_v=cross * shear * b / (4.0 * a),
        hourglass_u=(c11 * b / a + shear * a / b) / 12.0,
        hourglass_v=(c22 * a / b + cross * shear * b / a) / 12.0,
        strip_u=(0.5 * a * shear if anti else 0.0) / b,
        strip_v=0.5 * a * stretched / b,
    )
    return Layers(*(column.astype(np.float32) for column in found))


def _stencils(layers: Layers) -> Array:
    """Return the coefficients by which each row adds up the fields of three rows.

    At a node, forces along x are differences of the first sums over x, and sums of the second; so
    are those along y with the third and fourth. Each adds up two fields of the rows below, here and
    above: differences over x of u and sums of v, sums of u and differences of v, then with u and v
    exchanged twice.
    """
    k = Layers(*(np.pad(column.astype(np.float64), 1) for column in layers))
    low, up = slice(None, -1), slice(1, None)

    def stretched(stiffness: Array, hourglass: Array) -> tuple[Array, ...]:
        less, more = stiffness - hourglass, stiffness + hourglass
        return less[low], more[low] + more[up], less[up]

    def sheared(stiffness: Array) -> tuple[Array, ...]:
        return stiffness[low], -stiffness[low] - stiffness[up], stiffness[up]

    def coupled(stiffness: Array, sign: float) -> tuple[Array, ...]:
        return -stiffness[low], sign * (stiffness[low] - stiffness[up]), stiffness[up]

    found = [
        [*stretched(k.xx, k.hourglass_u), *coupled(k.xy, 1.0)],
        [*sheared(k.shear_u), *coupled(k.shear, -1.0)],
        [*stretched(k.shear_v, k.hourglass_v), *coupled(k.shear, 1.0)],
        [*sheared(k.yy), *coupled(k.xy, -1.0)],
    ]
    return np.ascontiguousarray(np.moveaxis(np.array(found), -1, 0), dtype=np.float32)


def _covered(heights: Array, middle: float, width: float) -> Array:
    """Return the share of a uniform traction that each row takes, none of it the interface."""
    edges = np.concatenate([heights[:1], 0.5 * (heights[1:] + heights[:-1]), heights[-1:]])
    low, high = middle - 0.5 * width, middle + 0.5 * width
    share = np.maximum(np.minimum(edges[1:], high) - np.maximum(edges[:-1], low), 0.0)
    share[1] += share[0]
    share[0] = 0.0
    return share / share.sum()


def _limit(
    speed: float, shear_speed: float, mesh: Mesh, correction: Array, viscous: float
) -> float:
    """Return the largest stable step, s: that of the mesh, its viscosity and the correction."""
    thin = min(mesh.spacing, float(np.diff(mesh.heights).min()))
    squares = max(4.0 * speed**2, 8.0 / 3.0 * (speed**2 + shear_speed**2)) / thin**2
    most = float(
        scipy.linalg.eigvalsh(correction, subset_by_index=[len(correction) - 1] * 2)[0]
    )
    squares += 2.0 * max(most, 0.0) * mesh.spacing / mesh.mass[0]
    frequency = np.sqrt(squares)
    damped = 0.5 * viscous * frequency
    return float(2.0 / frequency * (np.sqrt(1.0 + damped**2) - damped))


def layer_matrix(mesh: Mesh, layer: int, nodes: int) -> sp.csr_matrix:
    """Return the stiffness of a row of elements: u and v of its lower nodes, then the upper ones.

    Independently of the kernel: as the sum of the squares of strains.
    """
    k = Layers(*(column[layer] for column in mesh.layers))
    d = sp.diags([-np.ones(nodes - 1), np.ones(nodes - 1)], [0, 1], shape=(nodes - 1, nodes))
    m = abs(d)
    zero = sp.csr_matrix(d.shape)
    along = sp.hstack([d, zero, d, zero])
    up = sp.hstack([zero, -m, zero, m])
    over = sp.hstack([-m, zero, m, zero])
    tilt = sp.hstack([zero, d, zero, d])
    twist_u, twist_v = sp.hstack([-d, zero, d, zero]), sp.hstack([zero, -d, zero, d])
    ends = sp.csr_matrix((np.ones(2), ([0, 1], [0, nodes - 1])), shape=(2, nodes))
    none = sp.csr_matrix(ends.shape)
    strip_u = sp.hstack([-ends, none, ends, none])
    strip_v = sp.hstack([none, -ends, none, ends])
    whole = (
        k.xx * along.T @ along
        + k.xy * (along.T @ up + up.T @ along)
        + k.yy * up.T @ up
        + k.shear_u * over.T @ over
        + k.shear * (over.T @ tilt + tilt.T @ over)
        + k.shear_v * tilt.T @ tilt
        + k.hourglass_u * twist_u.T @ twist_u
        + k.hourglass_v * twist_v.T @ twist_v
        + k.strip_u * strip_u.T @ strip_u
        + k.strip_v * strip_v.T @ strip_v
    )
    return whole.tocsr()


def condensed(mesh: Mesh, nodes: int, anti_plane: bool) -> tuple[Array, Array, float]:
    """Return K of the mesh under a given force (Pa/m), q, and C (Pa); see `elasticity.blocks`.

    Rows are eliminated from the top downwards.
    """
    with one_blas_thread():
        return _condensed(mesh, nodes, anti_plane)


def _condensed(mesh: Mesh, nodes: int, anti_plane: bool) -> tuple[Array, Array, float]:
    rows = mesh.heights.size
    own = np.arange(nodes if anti_plane else 2 * nodes)  # of a row: u, and v
    top = own if anti_plane else own[:nodes]  # v = 0 at the top
    compliance = 0.0
    above, force = np.zeros((top.size, top.size)), np.zeros(top.size)
    if mesh.platen:
        glue = np.ones((top.size, 1))
        above, force = np.zeros((1, 1)), np.ones(1)
    for row in range(rows - 1, 0, -1):
        layer = layer_matrix(mesh, row - 1, nodes).tocsc()
        upper = top if row == rows - 1 else own
        down, up = own, 2 * nodes + upper
        inner = layer[up][:, up]
        between = layer[up][:, down]
        if row == rows - 1 and mesh.platen:
            inner, between = glue.T @ (inner @ glue), glue.T @ between
        else:
            force = force.copy()
            force[0] += mesh.push[row, 0]
            force[nodes - 1] += mesh.push[row, 1]
        inner = above + (inner.toarray() if sp.issparse(inner) else inner)
        between = sp.csr_matrix(between)
        inverse = scipy.linalg.lapack.dpotri(
            scipy.linalg.cholesky(inner, overwrite_a=True, check_finite=False), overwrite_c=True
        )[0]
        inverse = np.triu(inverse) + np.triu(inverse, 1).T
        moved = inverse @ force
        compliance += float(force @ moved)
        above = layer[down][:, down].toarray() - between.T @ (between.T @ inverse).T
        force = -(between.T @ moved)
    if not anti_plane:
        inverse = np.linalg.inv(above[nodes:, nodes:])
        moved = inverse @ force[nodes:]
        compliance += float(force[nodes:] @ moved)
        force = force[:nodes] - above[:nodes, nodes:] @ moved
        above = above[:nodes, :nodes] - above[:nodes, nodes:] @ inverse @ above[nodes:, :nodes]
    static = 0.5 * (above + above.T) * 0.5 / mesh.spacing
    return static, force * nodes / force.sum(), 1.0 / compliance

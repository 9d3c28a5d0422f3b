"""Stiffness of a rectangular body on its surface, from columns across it.

Problem
-------
A body has n cells of width h along its surface. The displacement u along x is defined on the
lines through the middles of the cells, and the displacement v into the body on the lines at
their edges. y is the depth below the surface. With Lame's lambda and G of the plane state,
and P = lambda + 2 G, the elastic energy is

    cell a:  (h G/2) int (u_a' + (v_{a+1} - v_a)/h)^2 dy
    edge b:  (w/2) int P e^2 + P v_b'^2 + 2 lambda e v_b' dy,    e = (u_b - u_{b-1})/w,

where w is the distance between the middles of the two cells. `block` returns the stiffness of
the points on the surface and on the far side, with the forces of a push on the left side.

Algorithm: our own
------------------
Staggered differences along x, elements of degree 6 across. Each derivative along x has the
symbol 2i sin(k h/2)/h, so that a half-plane has the symbol E* sin(k h/2)/h of the lattice.

1. Elements across (`graded`, `Elements`): their sizes are 2 h, 6 h, 18 h and so on, away from
   the surface and from both edges of a push. All integrals are exact.
2. Terms of a cell, of an edge between two cells, and of an edge at an end, where sigma_xx = 0
   or -p in the half cell between the line and the end (`Columns`).
3. A piece is a matrix with labels. `merge` adds pieces and eliminates labels by Cholesky.
4. Cell 0 and edge 1 are the first piece. Merge each piece with its shifted copy, and so double
   it, following the bits of n - 1 (`_repeated`). A piece keeps its first and last two lines,
   and its points on the surface and the far side.
5. Columns beyond the surface in contact grow outwards. Merge them inwards (`_beyond`).
6. Merge the cells with the last cell and the ends. If the far side is held, its points are
   left out of each term.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import block_diag, cholesky, solve_triangular

from stiction.base.arrays import Array

DEGREE = 6
"""Degree of the elements across a body."""
FIRST_ELEMENT, ELEMENT_GROWTH, MAX_REMAINDER = 2.0, 3.0, 1.5
"""Smallest element in cells, ratio of neighbours, and largest last element over the next size."""
COLUMN_GROWTH, MAX_COLUMN = 1.25, 0.1
"""Ratio of the widths of neighbouring columns beyond the contact, and largest width over the
length of these columns."""
STRIDE = 1 << 20
"""Distance between the labels of two lines. Lines at edges are even, and lines of cells odd."""
LOBATTO = np.concatenate(([-1.0], legendre.Legendre.basis(DEGREE).deriv().roots(), [1.0]))
"""Points of an element on [-1, 1]."""
LOBATTO_WEIGHTS = 1.0 / (DEGREE * (DEGREE + 1) * legendre.Legendre.basis(DEGREE)(LOBATTO) ** 2)
"""Integrals of the functions of an element over its length."""
PUSH = 1 << 60
"""Label of the force of the push, per unit depth. Rows and columns hold minus its loads."""

Far: TypeAlias = Literal["free", "rollers", "fixed"]
Interval: TypeAlias = tuple[float, float]
Labels: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]
Keep: TypeAlias = Callable[[Labels], Mask]


class Material(NamedTuple):
    """Elastic constants of the plane problem: G (Pa) and Kolosov's constant (1)."""

    modulus: float
    kappa: float

    @property
    def lame(self) -> float:
        """Lame's lambda of the plane state, Pa."""
        return self.modulus * (3.0 - self.kappa) / (self.kappa - 1.0)


class Piece(NamedTuple):
    """A symmetric matrix, Pa, with a label for each row."""

    labels: Labels
    matrix: Array


class Elements(NamedTuple):
    """Step 1: elements across a body, with the integrals of N_i N_j, N_i N_j' and N_i' N_j'."""

    edges: Array  # (elements + 1,), depth of their borders, m
    mass: Array
    mixed: Array
    slope: Array

    @property
    def n_points(self) -> int:
        """Number of points on a line."""
        return len(self.mass)


def graded(length: float, first: float) -> list[float]:
    """Return sizes of elements, m, that grow along a length from a first size."""
    sizes, rest, size = [], length, first
    while rest > MAX_REMAINDER * size:
        sizes.append(size)
        rest, size = rest - size, size * ELEMENT_GROWTH
    return [*sizes, rest]


def elements(height: float, first: float, push: Interval | None = None) -> Elements:
    """Return elements that are fine at the surface and at both edges of a push (m)."""
    # 1. An interval between two fine places is split in the middle.
    sizes: list[float] = []
    fine = [0.0, *(edge for edge in push or () if 0.0 < edge < height)]
    for low, high in zip(fine, [*fine[1:], height], strict=True):
        if high < height:
            half = graded(0.5 * (high - low), first)
            sizes += [*half, *half[::-1]]
        else:
            sizes += graded(high - low, first)
    edges = np.concatenate(([0.0], np.cumsum(sizes)))
    gauss, weights = legendre.leggauss(DEGREE + 1)
    coefficients = np.linalg.inv(legendre.legvander(LOBATTO, DEGREE))
    values = legendre.legval(gauss, coefficients).T
    slopes = legendre.legval(gauss, legendre.legder(coefficients)).T
    totals = np.zeros((3, DEGREE * len(sizes) + 1, DEGREE * len(sizes) + 1))
    for i, size in enumerate(sizes):
        points = slice(DEGREE * i, DEGREE * (i + 1) + 1)
        weighted = values.T * weights
        totals[0, points, points] += 0.5 * size * weighted @ values
        totals[1, points, points] += weighted @ slopes
        totals[2, points, points] += 2.0 / size * (slopes.T * weights) @ slopes
    return Elements(edges, *totals)


def merge(pieces: list[Piece], keep: Keep) -> Piece:
    """Step 3: add pieces, and eliminate the labels that are not kept, without load on them."""
    labels, places = np.unique(np.concatenate([p.labels for p in pieces]), return_inverse=True)
    total = np.zeros((labels.size, labels.size))
    start = 0
    for piece in pieces:
        rows = places[start : start + piece.labels.size]
        total[np.ix_(rows, rows)] += piece.matrix
        start += piece.labels.size
    kept = keep(labels)
    return Piece(labels[kept], eliminated(total, kept))


def eliminated(matrix: Array, kept: Mask) -> Array:
    """Return the Schur complement of a symmetric matrix on the rows that are kept."""
    if kept.all():
        return matrix
    factor = cholesky(matrix[np.ix_(~kept, ~kept)], lower=True)
    half = solve_triangular(factor, matrix[np.ix_(~kept, kept)], lower=True)
    complement: Array = matrix[np.ix_(kept, kept)] - half.T @ half
    return complement


class Columns(NamedTuple):
    """Step 2: the terms of a body. Each is a `Piece` on a line and its neighbours."""

    across: Elements
    material: Material
    far: Far

    def _piece(self, lines: Sequence[int], matrix: Array, more: Sequence[int] = ()) -> Piece:
        count = self.across.n_points
        labels = (np.array(lines)[:, None] * STRIDE + np.arange(count)).ravel()
        held = (labels % STRIDE == count - 1) & (self.far != "free")
        if self.far == "rollers":
            held &= labels // STRIDE % 2 == 0
        free = np.append(~held, np.ones(len(more), dtype=bool))
        return Piece(
            np.append(labels[~held], more).astype(np.int64), matrix[np.ix_(free, free)]
        )

    def cell(self, line: int, width: float) -> Piece:
        """Return the shear of a cell."""
        G = self.material.modulus
        M, D, S = self.across.mass * G / width, self.across.mixed * G, self.across.slope * G
        blocks = np.block([[M, -D, -M], [-D.T, width * S, D.T], [-M, D, M]])
        return self._piece((line - 1, line, line + 1), blocks)

    def edge(self, line: int, width: float, stop: bool = False) -> Piece:
        """Return the extension between two cells whose middles are `width` apart (m).

        With a stop, the place of the second cell is taken by a frictionless wall.
        """
        lame, stiff = self.material.lame, self.material.lame + 2.0 * self.material.modulus
        M, D = self.across.mass * stiff / width, self.across.mixed * lame
        S = self.across.slope * stiff * width
        blocks = np.block([[M, -D, -M], [-D.T, S, D.T], [-M, D, M]])
        lines, size = (line - 1, line, line + 1)[: 3 - stop], (3 - stop) * len(M)
        return self._piece(lines, blocks[:size, :size])

    def end(self, line: int, width: float, push: Interval | None = None) -> Piece:
        """Return the half cell at an end, which is free, or pushed along x by a unit force."""
        G, lame, count = self.material.modulus, self.material.lame, self.across.n_points
        stiff = lame + 2.0 * G
        free = 2.0 * G * (lame + G) / stiff * width * self.across.slope
        if push is None:
            return self._piece((line,), free)
        low, high = (int(np.argmin(np.abs(self.across.edges - edge))) for edge in push)
        extent = push[1] - push[0]
        v, u = np.zeros((2, count))
        for i in range(low, high):
            size = self.across.edges[i + 1] - self.across.edges[i]
            u[DEGREE * i : DEGREE * (i + 1) + 1] += size * LOBATTO_WEIGHTS / extent
        v[[DEGREE * low, DEGREE * high]] = (
            0.5 * width * lame / stiff / extent * np.array([-1, 1])
        )
        matrix = block_diag(free, np.zeros_like(free), -0.5 * width / (stiff * extent))
        matrix[-1, :-1] = matrix[:-1, -1] = -np.concatenate([v, u])
        return self._piece((line, line + 1), matrix, [PUSH])


def _repeated(period: Piece, count: int, keep: Callable[[int], Keep]) -> Piece:
    """Step 4: merge the first periods of a body. A period is two lines long."""
    chain, length, power, size = None, 0, period, 1
    while True:
        if count & size:
            shifted = Piece(power.labels + 2 * length * STRIDE, power.matrix)
            length += size
            chain = shifted if chain is None else merge([chain, shifted], keep(length))
        if chain is not None and length == count:
            return chain
        shifted = Piece(power.labels + 2 * size * STRIDE, power.matrix)
        size *= 2
        power = merge([power, shifted], keep(size))


def _on_lines(*kept: int) -> Keep:
    return lambda labels: np.isin(labels // STRIDE, kept)


def widths_beyond(length: float, first: float) -> list[float]:
    """Step 5: return the widths, m, of columns over a free length, outwards."""
    if length <= 0.0:
        return []
    widths = [first * COLUMN_GROWTH]
    largest = MAX_COLUMN * length + first
    while sum(widths) < length:
        widths.append(min(widths[-1] * COLUMN_GROWTH, largest))
    return [width * length / sum(widths) for width in widths]


def _beyond(
    columns: Columns, edge: int, outwards: Literal[-1, 1], widths: list[float], stop: bool
) -> Piece:
    """Step 5: return the columns beyond the last edge of the contact, and this edge.

    `widths` (m) begins with the last cell of the contact.
    """
    line = edge + 2 * outwards * (len(widths) - 1)
    if stop:
        piece = columns.edge(line, 0.5 * widths[-1], stop=True)
    else:
        piece = columns.end(line, widths[-1])
    for inner, width in zip(widths[-2::-1], widths[:0:-1], strict=True):
        line -= 2 * outwards
        parts = [piece, columns.cell(line + outwards, width)]
        parts.append(columns.edge(line, 0.5 * (inner + width)))
        piece = merge(parts, _on_lines(line, line - outwards))
    return piece


def block(
    height: float,
    cell: float,
    n_cells: int,
    material: Material,
    *,
    far: Far = "free",
    push: Interval | None = None,
    behind: float = 0.0,
    ahead: float = 0.0,
    stop: bool = False,
) -> Array:
    """Return the stiffness of a body per unit depth, Pa, on its surface and its far side.

    Lengths are in m. The rows are u at the cells and v at the edges of the surface, u and v of
    the far side if it is free, and the push, if any. The row of the push holds minus the loads of
    a unit force. The body is longer than the surface in contact by `behind` and `ahead`. With
    `stop`, a frictionless wall holds its leading end.
    """
    across = elements(height, FIRST_ELEMENT * cell, push)
    columns, last = Columns(across, material, far), 2 * n_cells

    def keep(length: int, borders: bool = True) -> Keep:
        def kept(labels: Labels) -> Mask:
            lines, points = labels // STRIDE, labels % STRIDE
            outside = (points == 0) | ((points == across.n_points - 1) & (far == "free"))
            outside &= (lines >= 0) & (lines <= last)
            border = (lines < 2) | (lines // 2 == length)
            result: Mask = outside | (labels == PUSH) | (border & borders)
            return result

        return kept

    # 4.
    period = merge([columns.cell(1, cell), columns.edge(2, cell)], keep(1))
    parts = [_repeated(period, n_cells - 1, keep), columns.cell(last - 1, cell)]
    # 5.
    left, right = ([cell, *widths_beyond(length, cell)] for length in (behind, ahead))
    if push is not None:
        parts.append(columns.end(0, cell, push))
    else:
        parts.append(_beyond(columns, 0, -1, left, False))
    parts.append(_beyond(columns, last, 1, right, stop))
    # 6.
    labels, matrix = merge(parts, keep(n_cells, borders=False))
    lines, points = labels // STRIDE, labels % STRIDE
    order = np.lexsort((lines, lines % 2 == 0, points, labels == PUSH))
    return matrix[np.ix_(order, order)]

"""Stiffness of a rectangular body at its surface, assembled from columns of elements.

Problem
-------
A body has n cells of width h along its surface. The displacement u
along x is defined on lines through the middles of the cells, and the
displacement v into the body on lines through their edges. y is the
depth below the surface. With Lame's lambda and G of the plane state,
and P = lambda + 2 G, the elastic energy is

    cell a:  (h G/2) int (u_a' + (v_{a+1} - v_a)/h)^2 dy
    edge b:  (w/2) int P e^2 + P v_b'^2 + 2 lambda e v_b' dy,    e = (u_b - u_{b-1})/w,

where w is the distance between the middles of the two cells. `block`
returns the stiffness of the points on the surface and on the far side,
with the forces of a push on the left side.

Algorithm: our own
------------------
Use staggered differences along x, and elements of degree 6 across the
body. Each derivative along x has the symbol 2i sin(k h/2)/h, so that a half-plane
has the symbol E* sin(k h/2)/h of the lattice.

1. Choose elements across the body (`graded`, `Elements`) with the sizes
   2 h, 6 h, 18 h and so on, away from the surface and from both edges
   of a push. All integrals are exact.
2. Integrate the energy of a cell, of an edge between two cells, and of
   an edge at an end (`Columns`). At an end, sigma_xx is 0 or -p in the
   half cell between the outermost line and the end.
3. Store each piece of the body as a matrix with labels. To join pieces,
   add them and eliminate labels by Cholesky (`merge`).
4. A period consists of cell 0 and edge 1. To assemble n - 1 periods,
   merge two copies of half as many periods, and add one period if n - 1
   is odd (`_repeated`). Of each piece, keep the first and last two
   lines, and the points on the surface and on the far side.
5. Beyond the contact, columns become wider with distance. Merge them
   from the outermost column inwards (`_beyond`).
6. Merge the result with the last cell and both ends. If the far side is
   held, leave its points out of each term.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from stiction.base.arrays import Array

DEGREE = 6
"""Degree of the elements across a body."""
FIRST_ELEMENT, ELEMENT_GROWTH, MAX_REMAINDER = 2.0, 3.0, 1.5
"""Smallest element in cells, ratio of neighbours, and largest last
element over the next size."""
COLUMN_GROWTH, MAX_COLUMN = 1.25, 0.1
"""Ratio of the widths of neighbouring columns beyond the contact, and
largest width over the length of these columns."""
STRIDE, PERIOD = 1 << 20, 2 << 20
"""Distances between the labels of two lines and of two periods. Lines
at edges are even, and lines of cells odd."""
LOBATTO = np.concatenate(([-1.0], legendre.Legendre.basis(DEGREE).deriv().roots().real, [1.0]))
"""Points of an element on [-1, 1]."""
PUSH = 1 << 60
"""Label of the force of the push, per unit depth. Rows and columns hold
minus its loads."""

Far: TypeAlias = Literal["free", "rollers", "fixed"]
Interval: TypeAlias = tuple[float, float]
Labels: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]
Keep: TypeAlias = Callable[[Labels], Mask]


class Body(NamedTuple):
    """A rectangular body: its height (m), G (Pa) and Kolosov's constant of the plane problem.

    With Poisson's ratio 0.25, kappa is 2 and lambda is G in plane strain.

    >>> body = Body(height=0.1, modulus=5.0, kappa=2.0)
    >>> body.lame, body.longitudinal
    (5.0, 15.0)
    """

    height: float
    modulus: float
    kappa: float

    @property
    def lame(self) -> float:
        """Lame's lambda of the plane state, Pa."""
        return self.modulus * (3.0 - self.kappa) / (self.kappa - 1.0)

    @property
    def longitudinal(self) -> float:
        """P = lambda + 2 G, Pa."""
        return self.lame + 2.0 * self.modulus


class Piece(NamedTuple):
    """A symmetric matrix, Pa, with a label for each row."""

    labels: Labels
    matrix: Array


class Elements(NamedTuple):
    """Step 1: points across a body (m), and the integrals of N_i N_j, N_i N_j' and N_i' N_j'."""

    points: Array
    mass: Array
    mixed: Array
    slope: Array


def graded(length: float, first: float) -> list[float]:
    """Return sizes of elements, m, that grow along a length from a first size.

    >>> graded(10.0, 1.0), graded(5.5, 1.0), graded(5.6, 1.0), graded(1.5, 1.0)
    ([1.0, 3.0, 6.0], [1.0, 4.5], [1.0, 3.0, 1.5999999999999996], [1.5])
    """
    sizes, rest, size = [], length, first
    while rest > MAX_REMAINDER * size:
        sizes.append(size)
        rest, size = rest - size, size * ELEMENT_GROWTH
    return [*sizes, rest]


def elements(height: float, first: float, push: Interval | None = None) -> Elements:
    """Return elements that are fine at the surface and at both edges of a push (m).

    The integrals are exact for polynomials: of 1, of y^2 and of the slope of y^3 times
    itself, 9 y^4. Places of a push are points.

    >>> points, mass, mixed, slope = elements(2.0, 0.3, (0.5, 1.25))
    >>> one, y = np.ones(points.size), points
    >>> np.allclose([one @ mass @ one, y @ mass @ y, y**3 @ slope @ y**3], [2.0, 8 / 3, 9 * 32 / 5])
    True
    >>> np.allclose([y**2 @ mixed @ y, y @ mixed @ y**2], [8 / 3, 16 / 3])  # of y^2, and 2 y^2
    True
    >>> [round(float(np.abs(points - place).min()), 9) for place in (0.0, 0.5, 1.25, 2.0)]
    [0.0, 0.0, 0.0, 0.0]
    >>> elements(2.0, 0.1, (0.5, 2.0)).points[:30:6].round(9).tolist()  # fine at both ends
    [0.0, 0.1, 0.25, 0.4, 0.5]
    >>> elements(2.0, 0.3, (0.0, 2.0)).points.size
    19
    """
    # 1. An interval between two fine places is split in the middle.
    sizes: list[float] = []
    fine = [0.0, *(edge for edge in push or () if 0.0 < edge < height)]
    for low, high in pairwise(fine):
        half = graded(0.5 * (high - low), first)
        sizes += [*half, *half[::-1]]
    sizes += graded(height - fine[-1], first)
    gauss, weights = legendre.leggauss(DEGREE + 1)
    coefficients = np.linalg.inv(legendre.legvander(LOBATTO, DEGREE))
    values = legendre.legval(gauss, coefficients).T
    slopes = legendre.legval(gauss, legendre.legder(coefficients)).T
    count = DEGREE * len(sizes) + 1
    points, totals = np.zeros(count), np.zeros((3, count, count))
    for i, size in enumerate(sizes):
        at = slice(DEGREE * i, DEGREE * (i + 1) + 1)
        points[at] = points[at.start] + 0.5 * size * (LOBATTO + 1.0)
        totals[0, at, at] += 0.5 * size * (values.T * weights) @ values
        totals[1, at, at] += (values.T * weights) @ slopes
        totals[2, at, at] += 2.0 / size * (slopes.T * weights) @ slopes
    return Elements(points, *totals)


def merge(pieces: list[Piece], keep: Keep) -> Piece:
    """Step 3: add pieces, and eliminate the unknowns that are not kept.

    No load acts on them.

    Two springs of 2 and 3 Pa in series have 1.2 Pa.

    >>> first = Piece(np.array([5, 7]), np.array([[2.0, -2.0], [-2.0, 2.0]]))
    >>> second = Piece(np.array([7, 9]), np.array([[3.0, -3.0], [-3.0, 3.0]]))
    >>> labels, matrix = merge([first, second], lambda labels: labels != 7)
    >>> labels.tolist(), matrix.round(9).tolist()
    ([5, 9], [[1.2, -1.2], [-1.2, 1.2]])
    """
    labels = np.unique(np.concatenate([piece.labels for piece in pieces]))
    total = np.zeros((labels.size, labels.size))
    for piece in pieces:
        rows = np.searchsorted(labels, piece.labels)
        total[np.ix_(rows, rows)] += piece.matrix
    kept = keep(labels)
    return Piece(labels[kept], eliminated(total, kept))


def eliminated(matrix: Array, kept: Mask) -> Array:
    """Return the Schur complement of a symmetric matrix on the rows that are kept.

    >>> matrix = np.array([[4.0, 2.0, 1.0], [2.0, 5.0, 0.0], [1.0, 0.0, 8.0]])
    >>> eliminated(matrix, np.array([False, True, True])).tolist()  # 5 - 2 2/4, - 2/4, 8 - 1/4
    [[4.0, -0.5], [-0.5, 7.75]]
    """
    factor = cholesky(matrix[np.ix_(~kept, ~kept)], lower=True)
    half = solve_triangular(factor, matrix[np.ix_(~kept, kept)], lower=True)
    return matrix[np.ix_(kept, kept)] - half.T @ half


class Columns(NamedTuple):
    """Step 2: the terms of a body. Each is a `Piece` on a line and its neighbours.

    The terms store the energy of simple fields. In a cell of width 0.5 and height 2, u = 3 y
    and v rising by 1 from edge to edge shear by 3 + 1/0.5 = 5. With G = 5, twice the
    energy is 5 * 0.5 * 2 * 5^2.

    >>> columns = Columns(elements(2.0, 0.4), Body(2.0, 5.0, 2.0), "free")
    >>> y, one = columns.across.points, np.ones(columns.across.points.size)
    >>> def twice_the_energy(piece, *lines):
    ...     field = np.concatenate(lines)
    ...     return round(float(field @ piece.matrix @ field), 6)
    >>> twice_the_energy(columns.cell(1, 0.5), 0.0 * one, 3.0 * y, one)
    125.0

    Across an edge, u rising by 1 over 0.5 and v = 3 y extend by 2 and 3. Twice the
    energy is 0.5 * 2 * (15 * 4 + 15 * 9 + 2 * 5 * 2 * 3). With a wall, u falls to zero.

    >>> twice_the_energy(columns.edge(2, 0.5), 0.0 * one, 3.0 * y, one)
    255.0
    >>> twice_the_energy(columns.edge(2, 0.5, stop=True), -one, 3.0 * y)
    255.0

    At a free end, v = 3 y in the half cell has the modulus 4 G (lambda + G)/P.

    >>> twice_the_energy(columns.end(2, 0.5), 3.0 * y)  # 0.25 * 2 * 40/3 * 3^2
    60.0

    The push acts on u of the first cell. A rigid motion does work 1.

    >>> push = columns.push(0.5, (0.5, 1.25))
    >>> bool(push.labels[-1] == PUSH), round(float(push.matrix[-1, len(y):-1] @ one), 9)
    (True, -1.0)
    >>> round(float(push.matrix[-1, -1]), 9)  # -0.5 * 0.5/(15 * 0.75)
    -0.022222222

    Points that are held on the far side are left out: all on a fixed side, and v on rollers.

    >>> sizes = [Columns(columns.across, columns.body, far).cell(1, 0.5).labels.size
    ...     for far in ("free", "fixed", "rollers")]
    >>> [size - 3 * y.size for size in sizes]
    [0, -3, -2]
    """

    across: Elements
    body: Body
    far: Far

    def _piece(self, lines: list[int], matrix: Array) -> Piece:
        """Return a piece on some lines, without the points that are held on the far side."""
        count = len(self.across.points)
        labels = (np.array(lines)[:, None] * STRIDE + np.arange(count)).ravel()
        held = (labels % STRIDE == count - 1) & (self.far != "free")
        if self.far == "rollers":
            held &= labels // STRIDE % 2 == 0
        free = np.flatnonzero(~held)
        return Piece(labels[free], matrix[np.ix_(free, free)])

    def _coupled(self, lines: list[int], M: Array, D: Array, S: Array) -> Piece:
        return self._piece(lines, np.block([[M, -D, -M], [-D.T, S, D.T], [-M, D, M]]))

    def cell(self, line: int, width: float) -> Piece:
        """Return the shear of a cell."""
        (_, M, D, S), G = self.across, self.body.modulus
        return self._coupled([line - 1, line, line + 1], M * G / width, D * G, S * G * width)

    def edge(self, line: int, width: float, stop: bool = False) -> Piece:
        """Return the extension between two cells whose middles are `width` apart (m).

        With a stop, the place of the second cell is taken by a
        frictionless wall.
        """
        (_, M, D, S), P = self.across, self.body.longitudinal
        lines = [line - 1, line, line + 1][: 3 - stop]
        return self._coupled(lines, M * P / width, D * self.body.lame, S * P * width)

    def end(self, line: int, width: float) -> Piece:
        """Return the half cell at a free end."""
        G, (lame, P) = self.body.modulus, (self.body.lame, self.body.longitudinal)
        return self._piece([line], 2.0 * G * (lame + G) / P * width * self.across.slope)

    def push(self, width: float, push: Interval) -> Piece:
        """Return minus the loads of a unit force along x on the end of the first cell."""
        points, _, mixed, slope = self.across
        lame, P = self.body.lame, self.body.longitudinal
        extent, count = push[1] - push[0], len(points)
        ramp = np.clip(points, *push) / extent  # its derivative is the traction
        matrix = np.zeros((2 * count + 1, 2 * count + 1))
        matrix[-1, :count] = -0.5 * width * lame / P * slope @ ramp
        matrix[-1, count:-1] = -mixed @ ramp
        matrix += matrix.T
        matrix[-1, -1] = -0.5 * width / (P * extent)
        return Piece(np.append(self._piece([0, 1], matrix).labels, PUSH), matrix)


def _repeated(period: Piece, count: int, keep: Callable[[int], Keep]) -> Piece:
    """Step 4: merge the first periods of a body. A period is two lines long.

    Five springs of 2 Pa in a row have 0.4 Pa.

    >>> spring = Piece(np.array([0, PERIOD]), np.array([[2.0, -2.0], [-2.0, 2.0]]))
    >>> def keep(length):
    ...     return lambda labels: np.isin(labels, [0, length * PERIOD])
    >>> labels, matrix = _repeated(spring, 5, keep)
    >>> (labels // PERIOD).tolist(), matrix.round(9).tolist()
    ([0, 5], [[0.4, -0.4], [-0.4, 0.4]])
    """
    if count == 1:
        return period
    half = _repeated(period, count // 2, keep)
    parts = [half, Piece(half.labels + count // 2 * PERIOD, half.matrix)]
    parts += [Piece(period.labels + (count - 1) * PERIOD, period.matrix)] * (count % 2)
    return merge(parts, keep(count))


def widths_beyond(length: float, first: float) -> list[float]:
    """Step 5: return the widths, m, of columns over a free length, outwards.

    The widths 1.25, 1.5, 1.5 and 1.5 reach beyond 5 m, and are shortened.

    >>> np.array(widths_beyond(5.0, 1.0)).round(4).tolist(), widths_beyond(0.0, 1.0)
    ([1.087, 1.3043, 1.3043, 1.3043], [])
    >>> round(5.0 / 5.75 * 1.25, 4), round(5.0 / 5.75 * 1.5, 4)
    (1.087, 1.3043)
    """
    widths: list[float] = []
    largest = MAX_COLUMN * length + first
    while sum(widths) < length:
        before = widths[-1] if widths else first
        widths.append(min(before * COLUMN_GROWTH, largest))
    return [width * length / sum(widths) for width in widths]


def _on_lines(*kept: int) -> Keep:
    """Return a choice of labels on some lines.

    >>> _on_lines(3, 5)(np.array([3 * STRIDE + 7, 4 * STRIDE, 5 * STRIDE])).tolist()
    [True, False, True]
    """
    return lambda labels: np.isin(labels // STRIDE, kept)


def _beyond(
    columns: Columns, edge: int, outwards: Literal[-1, 1], widths: list[float]
) -> Piece:
    """Step 5: return the columns beyond the last edge of the contact, and this edge.

    `widths` (m) begins with the last cell of the contact.
    """
    line = edge + 2 * outwards * (len(widths) - 1)
    if columns.far == "rollers" and outwards > 0:
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
    body: Body, cell: float, n_cells: int, *, far: Far = "free", push: Interval | None = None,
    behind: float = 0.0, ahead: float = 0.0,
) -> Array:  # fmt: skip
    """Return the stiffness of a body per unit depth, Pa, on its surface and its far side.

    Lengths are in m. The rows are u at the cells and v at the edges of
    the surface, u and v of the far side if it is free, and the push, if
    any. The row for the push holds minus the loads by a unit force. The
    body is longer than the surface in contact by `behind` and `ahead`.
    If it lies on rollers, a frictionless wall holds its leading end.

    The rows are u of 3 cells, v of 4 edges, the same on the far side, and
    the push. Motions along x and into the body, and a rotation, cause no
    force, and the push has the resultant 1.

    >>> body = Body(height=1.0, modulus=5.0, kappa=2.0)
    >>> free = block(body, 0.4, 3, push=(0.25, 0.5))
    >>> along, into = np.r_[1, 1, 1, 0, 0, 0, 0], np.r_[0, 0, 0, 1, 1, 1, 1]
    >>> turn = np.r_[0, 0, 0, 0.0, 0.4, 0.8, 1.2]
    >>> motions = np.array([np.r_[along, along], np.r_[into, into], np.r_[turn, turn - along]])
    >>> free.shape, np.allclose(free, free.T), np.allclose(free[:14, :14] @ motions.T, 0.0)
    ((15, 15), True, True)
    >>> ((motions @ free[:14, 14]).round(9) + 0.0).tolist()  # the moment is the height 0.375
    [-1.0, 0.0, 0.375]

    A longer body is stiffer, and a body with a fixed bottom does not move freely.

    >>> short = block(body, 0.4, 3, far="fixed")
    >>> long = block(body, 0.4, 3, far="fixed", behind=0.5, ahead=1.0)
    >>> short.shape, bool(np.linalg.eigvalsh(long - short).min() > -1e-9)
    ((7, 7), True)
    >>> bool(along @ long @ along > along @ short @ along > 1.0)
    True
    >>> mirror, signs = np.r_[2, 1, 0, 6, 5, 4, 3], np.r_[-1, -1, -1, 1, 1, 1, 1]
    >>> other = block(body, 0.4, 3, far="fixed", behind=1.0, ahead=0.5)
    >>> np.allclose(long[np.ix_(mirror, mirror)] * np.outer(signs, signs), other)
    True

    The leading end of a body on rollers has a wall. v is held at the bottom.

    >>> rollers = block(body, 0.4, 3, far="rollers", ahead=1.0)
    >>> bool(np.linalg.eigvalsh(rollers).min() > 0.01), np.allclose(rollers, rollers[::-1, ::-1])
    (True, False)
    """
    columns = Columns(elements(body.height, FIRST_ELEMENT * cell, push), body, far)
    last, last_point = 2 * n_cells, len(columns.across.points) - 1

    def keep(length: int, borders: bool = True) -> Keep:
        def kept(labels: Labels) -> Mask:
            lines, points = labels // STRIDE, labels % STRIDE
            outside = (points == 0) | ((points == last_point) & (far == "free"))
            outside &= (lines >= 0) & (lines <= last)
            border = borders & ((lines < 2) | (lines // 2 == length))
            return outside | border | (labels == PUSH)

        return kept

    # 4.
    period = merge([columns.cell(1, cell), columns.edge(2, cell)], keep(1))
    parts = [_repeated(period, n_cells - 1, keep), columns.cell(last - 1, cell)]
    # 5.
    parts.append(_beyond(columns, 0, -1, [cell, *widths_beyond(behind, cell)]))
    parts.append(_beyond(columns, last, 1, [cell, *widths_beyond(ahead, cell)]))
    if push is not None:
        parts.append(columns.push(cell, push))
    # 6.
    labels, matrix = merge(parts, keep(n_cells, borders=False))
    lines, points = labels // STRIDE, labels % STRIDE
    order = np.lexsort((lines, lines % 2 == 0, points, labels == PUSH))
    return matrix[np.ix_(order, order)]

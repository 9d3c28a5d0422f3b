"""From the Gaussian of a regression to the posterior itself, direction after direction.

With draws w of the Gaussian, z at place k is m_k + A_k w, and the posterior has the density
N(w) prod_k r_k(z_k), r_k being the likelihood over the Gaussian that stands for it. Along
orthonormal directions u_1, u_2, ... the map to it is triangular (Rosenblatt, 1952): e_j =
u_j w goes, quantile by quantile, to the distribution of density

    N(e_j) prod_k E[r_k(z_k) | e_1, ..., e_j],

which takes places as independent given e_1 to e_j (Cseke and Heskes, 2011). That is exact
for one place, for independent ones, and for many that measure one number. A direction is
that of the place at which the posterior differs most from the Gaussian, as far as it is not
yet spanned; the last are left out where there is hardly a difference. What is then left is
measured by the weights of samples.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit_allocating

MOST, LISTED = 16, 12  # directions, and places whose dependence on the earlier ones counts
WORTH = 0.1  # difference of the logarithm of a density that is worth a direction
NOTHING = 0.005  # the same that is nothing
DEPENDS = 0.02  # the same of a term that is worth its dependence on earlier directions
CANDIDATES = 256  # places considered for a direction
SPANNED = 0.2  # share of the scatter of a place below which it is spanned by earlier directions
REACH, CELLS, ACROSS = 8.0, 96, 96  # of directions, and of places, in standard deviations
BEYOND = 7.0  # reach of the average over what is not yet known
LIMIT = 4.0  # of logarithms of ratios where they are compared
ORDERS = 6  # Hermite polynomials in that comparison
PROBES = 1024  # samples whose weights measure what is left
POINTS = 25  # of that average
TINY, FLOOR = 1e-300, 700.0  # least density, and least logarithm, that are floats
UNMOVED = 0.01  # share of the scatter of a place below which a direction does not move it

Ratio = Callable[[NDArray[np.int64], Array], Array]
"""Logarithm of r at places (indices) and z (places, ...)."""


class Transport(NamedTuple):
    """Directions, and the logarithms of density ratios along them."""

    basis: Array  # (directions, dimension), orthonormal
    fixed: Array  # (directions, CELLS + 1): what depends on e_j only
    counts: NDArray[np.int64]  # (directions,): places that depend on earlier directions, too
    slopes: Array  # (directions, LISTED, directions): their z, in units of its deviation
    tables: Array  # (directions, LISTED, ACROSS + 1): over that


class Left(NamedTuple):
    """What is left, at most at any place, in standard deviations of z there."""

    mean: float  # by which the mean is off
    deviation: float  # by which share the standard deviation is


@jit_allocating
def transport(
    basis: Array,
    fixed: Array,
    counts: NDArray[np.int64],
    slopes: Array,
    tables: Array,
    out: Array,
    density: Array,
) -> None:
    """Map each row of `out` in place; add the log density of e_j to `density`, (rows,)."""
    directions, dimension = basis.shape
    cells, across = fixed.shape[1] - 1, tables.shape[2] - 1
    step, pace = 2.0 * REACH / cells, 0.5 * across / REACH
    height, mass, moved = np.empty(cells + 1), np.empty(cells), np.empty(directions)
    for i in range(out.shape[0]):
        for j in range(directions):
            drawn = 0.0
            for d in range(dimension):
                drawn += basis[j, d] * out[i, d]
            for g in range(cells + 1):
                height[g] = fixed[j, g]
            for k in range(counts[j]):
                begin = 0.0
                for other in range(j):
                    begin += slopes[j, k, other] * moved[other]
                begin = (begin + REACH) * pace
                rise = slopes[j, k, j] * pace
                for g in range(cells + 1):
                    place = begin + rise * (g * step - REACH)
                    cell = int(min(max(place, 0.0), across - 1.0))
                    left = tables[j, k, cell]
                    height[g] += left + (place - cell) * (tables[j, k, cell + 1] - left)
            top = -math.inf
            for g in range(cells + 1):
                height[g] -= 0.5 * (g * step - REACH) ** 2
                top = max(top, height[g])
            total = 0.0
            for g in range(cells + 1):
                height[g] = max(height[g], top - 600.0)  # exp is a float there
            right = math.exp(height[0] - top)
            for g in range(cells):  # log-linear between the nodes
                left, right = right, math.exp(height[g + 1] - top)
                rate = height[g + 1] - height[g]
                flat = abs(rate) < 1e-4  # the trapezium is off by its square over twelve
                mass[g] = 0.5 * (left + right) if flat else (right - left) / rate
                total += mass[g]
            # From the nearer end, so that tails keep their digits.
            wanted = 0.5 * math.erfc(abs(drawn) / math.sqrt(2.0)) * total
            cell, last, turn = 0, cells - 1, 1
            if drawn > 0.0:
                cell, last, turn = last, 0, -1
            while wanted > mass[cell] and cell != last:
                wanted -= mass[cell]
                cell += turn
            part = min(wanted / mass[cell], 1.0)
            part = part if turn == 1 else 1.0 - part
            rate = height[cell + 1] - height[cell]
            if abs(rate) > 1e-5:  # else linear to half of it
                part = math.log1p(part * math.expm1(rate)) / rate
            moved[j] = (cell + part) * step - REACH
            density[i] += height[cell] + part * rate - top - math.log(total * step)
            for d in range(dimension):
                out[i, d] += basis[j, d] * (moved[j] - drawn)


def make_transport(ratio: Ratio, middle: Array, along: Array) -> tuple[Transport, Left]:
    """Find directions and tables, and what is left.

    z at the places is `middle` + `along` w, (places,) and (places, dimension).
    """
    whole = np.sqrt((along**2).sum(axis=1))
    coefficients = _hermite(ratio, middle, whole)
    own = np.linalg.norm(coefficients, axis=0)
    order = np.argsort(own)
    some = np.sort(order[np.cumsum(own[order]) > NOTHING])  # the others together are nothing

    def here(at: NDArray[np.int64], z: Array) -> Array:
        return ratio(some[at], z)

    middle, along, coefficients = middle[some], along[some], coefficients[:, some]
    basis = _directions(coefficients, along / whole[some, None])
    strength = np.linalg.norm(coefficients[1:], axis=0)
    found = _tables(here, middle, along, basis, strength)
    return found, _left(here, middle, along, found) if some.size else Left(0.0, 0.0)


def _hermite(ratio: Ratio, middle: Array, whole: Array) -> Array:
    """Coefficients of log r at each place in Hermite polynomials, (ORDERS, places)."""
    x = np.linspace(-BEYOND, BEYOND, CELLS + 1)
    value = ratio(np.arange(middle.size), middle[:, None] + whole[:, None] * x)
    weight = np.exp(-0.5 * x**2)
    weight /= weight.sum()
    value = (value - (value @ weight)[:, None]).clip(-LIMIT, LIMIT)
    found, before, now = [], np.zeros_like(x), np.ones_like(x)
    for order in range(1, ORDERS + 1):
        before, now = now, (x * now - np.sqrt(order - 1.0) * before) / np.sqrt(order)
        found.append(value @ (weight * now))
    return np.array(found)


def _directions(coefficients: Array, unit: Array) -> Array:
    """Directions u_j of the draws w, in turn those of the largest difference, (dimension, J)."""
    own = np.argsort(-np.linalg.norm(coefficients, axis=0))
    left, chosen = unit[own[:CANDIDATES]], np.empty((0, unit.shape[1]))
    while len(chosen) < MOST:
        norm = np.linalg.norm(left, axis=1)
        free = left[norm > SPANNED] / norm[norm > SPANNED, None]
        if not free.size:
            break
        cosine = free @ unit.T
        power, score = np.ones_like(cosine), np.zeros(len(free))
        for row in coefficients:
            power *= cosine
            score += (power @ row) ** 2
        best = int(np.argmax(score))
        if not score[best] > WORTH**2:
            break
        new = free[best] - chosen.T @ (chosen @ free[best])
        new /= np.linalg.norm(new)
        chosen, left = np.vstack([chosen, new]), left - np.outer(left @ new, new)
    return chosen


def _averaged(ratio: Ratio, at: NDArray[np.int64], mean: Array, variance: Array) -> Array:
    """Logarithm of E[r_k(z_k)] with z_k normal, (places, ...); variance (places,)."""
    y = np.linspace(-BEYOND, BEYOND, POINTS)
    deviation = np.sqrt(np.maximum(variance, 0.0))[:, None, None]
    value = ratio(at, mean[:, :, None] + deviation * y) - 0.5 * y**2
    top = value.max(axis=2)
    top = np.where(np.isfinite(top), top, -FLOOR)
    return np.log(np.exp(value - top[:, :, None]).sum(axis=2) + TINY) + top


def _tables(ratio: Ratio, middle: Array, along: Array, basis: Array, own: Array) -> Transport:
    """Tabulate the ratios along the directions; `own` is how much those of a place differ."""
    slope, count = along @ basis.T, len(basis)
    whole = (along**2).sum(axis=1)
    fixed, counts = np.zeros((count, CELLS + 1)), np.zeros(count, dtype=np.int64)
    slopes, tables = np.zeros((count, LISTED, count)), np.zeros((count, LISTED, ACROSS + 1))
    e, t = np.linspace(-REACH, REACH, CELLS + 1), np.linspace(-REACH, REACH, ACROSS + 1)
    for j in range(count):
        known = (slope[:, : j + 1] ** 2).sum(axis=1)
        rest = whole - known
        depends = own * np.abs(slope[:, j]) * np.sqrt(known - slope[:, j] ** 2) / whole
        some = np.argsort(-depends)[:LISTED]
        some = some[depends[some] > DEPENDS]
        counts[j] = some.size
        deviation = np.sqrt(known[some])
        slopes[j, : some.size] = slope[some] / deviation[:, None]
        at = middle[some, None] + deviation[:, None] * t
        tables[j, : some.size] = _averaged(ratio, some, at, rest[some])
        others = np.flatnonzero(np.abs(slope[:, j]) > UNMOVED * np.sqrt(whole))
        others = np.setdiff1d(others, some)
        for part in np.array_split(others, 1 + others.size // CANDIDATES):
            at = middle[part, None] + slope[part, j, None] * e
            fixed[j] += _averaged(ratio, part, at, rest[part]).sum(axis=0)
    return Transport(basis, fixed, counts, slopes, tables)


def _left(ratio: Ratio, middle: Array, along: Array, found: Transport) -> Left:
    """Compare samples with the same, weighted by the density over that which they have."""
    rng = np.random.default_rng(0)
    w, density = rng.standard_normal((PROBES, along.shape[1])), np.zeros(PROBES)
    if len(found.basis):
        transport(*found, w, density)
    z = w @ along.T
    weight = ratio(np.arange(middle.size), middle[:, None] + z.T).sum(axis=0)
    weight -= density + 0.5 * ((w @ found.basis.T) ** 2).sum(axis=1)
    weight = np.exp(weight - weight.max())
    weight = np.minimum(weight / weight.mean(), np.sqrt(PROBES))
    weight /= weight.sum()
    plain, scatter = z.mean(axis=0), z.std(axis=0)
    mean = weight @ z
    deviation = np.sqrt(weight @ (z - mean) ** 2)
    return Left(
        float(np.abs((mean - plain) / scatter).max()),
        float(np.abs(deviation / scatter - 1.0).max()),
    )

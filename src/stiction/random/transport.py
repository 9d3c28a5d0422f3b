"""Map draws from a Gaussian to the posterior that it approximates, one direction at a time.

Problem
-------
A regression has replaced the likelihood of each measured value by a Gaussian. In
the Gaussian posterior that follows, the field at place k is z_k = m_k + a_k'w
with standard normal w. The exact posterior of w has a density proportional to

    N(w) prod_k r_k(z_k),                                                                     (1)

where r_k is the likelihood of value k divided by the Gaussian that
replaced it.

Algorithm
---------
The map is triangular, along orthonormal directions u_1, u_2, ... (M. Rosenblatt,
Annals of Mathematical Statistics 23, 1952). The coordinate u_j'w, with a standard
normal distribution, is moved quantile by quantile to a coordinate e_j. The density
of e_j is, up to a constant,

    p(e_j | e_1, ..., e_j-1) = N(e_j) prod_k E[r_k(z_k) | e_1, ..., e_j].                     (2)

Here e_1, ..., e_j-1 are moved already. The mean E is taken over w
orthogonal to u_1, ..., u_j. Equation (2) treats places as independent
given e_1 to e_j (B. Cseke and T. Heskes, Journal of Machine Learning
Research 12, 2011). It is exact for a single place, for independent
places if each has its direction, and for places that all measure the
same number.

Preparation (`make_transport`):

1. Expand log r_k in Hermite polynomials of the standardised z_k. The
   norm of the coefficients measures the departure from the Gaussian at
   a place. Ignore the places with the smallest norms, which together
   stay below `IGNORED_TOTAL`.
2. Choose the directions greedily. The candidates are the a_k of the
   places that differ most from the Gaussian, made orthogonal to the
   directions chosen before. Choose the candidate on which the
   expansions of all places together have the largest projection.
3. Tabulate the factors of (2) along each direction. A place that
   depends noticeably on the coordinates before has its own table, over
   its mean given e_1 to e_j. The other places share a table over e_j,
   with the coordinates before at zero.
4. Estimate the remaining error: map samples, weight them by (1) divided
   by their density, and compare weighted and plain moments of z.

Mapping of a draw (`transport`), for each direction in turn:

5. Add the tables on a grid of e_j, which gives the logarithm of (2).
6. Integrate the density over each cell, with a logarithm that is linear
   in the cell.
7. Find the quantile, starting from the nearer end so that tails keep
   their digits. Move w along u_j to this quantile.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit_allocating

# Sizes of the map
MAX_DIRECTIONS = 16
MAX_DEPENDENT = 12  # places of a direction whose dependence on earlier coordinates is kept
E_MAX, N_CELLS = 8.0, 96  # grid of e_j: from -E_MAX to E_MAX standard deviations
N_TABLE_CELLS = 96  # the same for E[z_k | e_1, ..., e_j], standardised

# Thresholds on the logarithm of a density
MIN_DIRECTION_GAIN = 0.1  # a direction that explains less is not worth its time
IGNORED_TOTAL = 0.005
MIN_DEPENDENCE = 0.02  # a smaller dependence on earlier coordinates is dropped
MAX_LOG_RATIO = 4.0  # distance from its median at which log r_k is clipped before expansion

# Shares of the standard deviation of a place
MIN_UNSPANNED = 0.2  # smallest part of a candidate outside the earlier directions
MIN_SLOPE = 0.01  # smallest motion of a place by a direction for which it is tabulated

# Accuracy of the preparation
N_HERMITE, N_HERMITE_POINTS = 6, 97  # polynomials in an expansion, and points of its integrals
Z_MAX, N_QUADRATURE = 7.0, 25  # averages over z: range in standard deviations, and points
MAX_CANDIDATES = 256
PLACES_PER_BLOCK = 256  # tabulated together, to bound memory
N_CHECK_SAMPLES = 1024

LOG_OF_ZERO = -700.0
MAX_FALL = 600.0  # of a logarithm below its maximum, so that exp(-MAX_FALL) is not zero

LogRatio = Callable[[NDArray[np.int64], Array], Array]
"""log r_k, finite, at places (indices) and values z (places, ...)."""


class Transport(NamedTuple):
    """Directions, and tables for the logarithm of (2) along them, without the factor N(e_j).

    The fields are the first arguments of `transport`, in this order.
    The caller may express `basis` in other coordinates of the draws:
    `conditioning` does, since its draws are not whitened.
    """

    basis: Array  # (directions, dimension): u_j
    shared_table: Array  # (directions, N_CELLS + 1): sum over the places that share it
    n_dependent: NDArray[np.int64]  # (directions,): places with a table of their own
    own_tables: Array  # (directions, MAX_DEPENDENT, N_TABLE_CELLS + 1): their tables
    # Slope of the standardised mean E[z_k | e_1, ..., e_j] by e_i, for i <= j
    mean_slopes: Array  # (directions j, MAX_DEPENDENT, directions i)


class ErrorEstimate(NamedTuple):
    """Largest errors of the mapped draws, over all places that step 1 keeps."""

    mean: float  # of z, in standard deviations of z
    deviation: float  # of the standard deviation of z, as a share of it


def make_transport(
    log_ratio: LogRatio, mean: Array, slopes: Array
) -> tuple[Transport, ErrorEstimate]:
    """Prepare the map from Gaussian draws w to the posterior of z = mean + slopes @ w.

    `mean` has shape (places,), and `slopes` has shape (places, dimension).
    """
    # 1. The distance of the posterior from the Gaussian at each place.
    deviation = np.sqrt((slopes**2).sum(axis=1))
    coefficients = _hermite(log_ratio, mean, deviation)
    non_gaussianity = np.linalg.norm(coefficients, axis=0)
    order = np.argsort(non_gaussianity)
    kept = np.sort(order[np.cumsum(non_gaussianity[order]) > IGNORED_TOTAL])

    def log_ratio_of_kept(places: NDArray[np.int64], z: Array) -> Array:
        return log_ratio(kept[places], z)

    mean, slopes, coefficients = mean[kept], slopes[kept], coefficients[:, kept]
    basis = _choose_directions(coefficients, slopes / deviation[kept, None])
    # If log r_k is linear in z_k, earlier coordinates only multiply (2)
    # by a constant.
    nonlinearity = np.linalg.norm(coefficients[1:], axis=0)
    tables = _tabulate(log_ratio_of_kept, mean, slopes, basis, nonlinearity)
    if not kept.size:
        return tables, ErrorEstimate(0.0, 0.0)
    return tables, _estimate_error(log_ratio_of_kept, mean, slopes, tables)


def _hermite(log_ratio: LogRatio, mean: Array, deviation: Array) -> Array:
    """Step 1: return coefficients (N_HERMITE, places) for the Hermite polynomials 1, 2, ..."""
    x = np.linspace(-Z_MAX, Z_MAX, N_HERMITE_POINTS)
    value = log_ratio(np.arange(mean.size), mean[:, None] + deviation[:, None] * x)
    weight = np.exp(-0.5 * x**2)
    weight /= weight.sum()
    # Points without a quantile have a log r_k so low that they would
    # decide a mean over all points. They do not affect the median
    # within a standard deviation.
    typical = np.median(value[:, np.abs(x) <= 1.0], axis=1)
    value = (value - typical[:, None]).clip(-MAX_LOG_RATIO, MAX_LOG_RATIO)
    coefficients, previous, current = [], np.zeros_like(x), np.ones_like(x)
    for n in range(1, N_HERMITE + 1):
        following = (x * current - np.sqrt(n - 1.0) * previous) / np.sqrt(n)
        previous, current = current, following
        coefficients.append(value @ (weight * current))
    return np.array(coefficients)


def _choose_directions(coefficients: Array, unit: Array) -> Array:
    """Step 2: return an array (directions, dimension), chosen from unit vectors a_k / |a_k|."""
    by_non_gaussianity = np.argsort(-np.linalg.norm(coefficients, axis=0))
    unspanned = unit[by_non_gaussianity[:MAX_CANDIDATES]]
    basis = np.empty((0, unit.shape[1]))
    while len(basis) < MAX_DIRECTIONS:
        norm = np.linalg.norm(unspanned, axis=1)
        candidates = unspanned[norm > MIN_UNSPANNED] / norm[norm > MIN_UNSPANNED, None]
        if not candidates.size:
            break
        # Along a unit vector u, polynomial n of z_k keeps the share
        # (u'a_k / |a_k|)**n.
        cosine = candidates @ unit.T
        power, squared_gain = np.ones_like(cosine), np.zeros(len(candidates))
        for coefficient in coefficients:
            power *= cosine
            squared_gain += (power @ coefficient) ** 2
        best = int(np.argmax(squared_gain))
        if not squared_gain[best] > MIN_DIRECTION_GAIN**2:  # NaN ends here, too
            break
        # Make it orthogonal once more, against round-off.
        direction = candidates[best] - basis.T @ (basis @ candidates[best])
        direction /= np.linalg.norm(direction)
        basis = np.vstack([basis, direction])
        unspanned = unspanned - np.outer(unspanned @ direction, direction)
    return basis


def _log_mean_ratio(
    log_ratio: LogRatio, places: NDArray[np.int64], mean: Array, variance: Array
) -> Array:
    """Return log E[r_k(z_k)] up to a constant, for normal z_k with mean (places, ...)."""
    x = np.linspace(-Z_MAX, Z_MAX, N_QUADRATURE)
    deviation = np.sqrt(np.maximum(variance, 0.0))[:, None, None]
    value = log_ratio(places, mean[:, :, None] + deviation * x) - 0.5 * x**2
    highest = value.max(axis=2)
    highest = np.where(np.isfinite(highest), highest, LOG_OF_ZERO)
    return np.log(np.exp(value - highest[:, :, None]).sum(axis=2) + 1e-300) + highest


def _tabulate(
    log_ratio: LogRatio, mean: Array, slopes: Array, basis: Array, nonlinearity: Array
) -> Transport:
    """Step 3: return the tables. `nonlinearity` is the distance of log r_k from a line."""
    n_directions = len(basis)
    e_slopes = slopes @ basis.T  # of z_k by e_j
    variance = (slopes**2).sum(axis=1)
    shared_table = np.zeros((n_directions, N_CELLS + 1))
    n_dependent = np.zeros(n_directions, dtype=np.int64)
    own_tables = np.zeros((n_directions, MAX_DEPENDENT, N_TABLE_CELLS + 1))
    mean_slopes = np.zeros((n_directions, MAX_DEPENDENT, n_directions))
    e = np.linspace(-E_MAX, E_MAX, N_CELLS + 1)
    standardised_mean = np.linspace(-E_MAX, E_MAX, N_TABLE_CELLS + 1)
    for j in range(n_directions):
        # Variance of E[z_k | e_1, ..., e_j], and of z_k about it.
        explained = (e_slopes[:, : j + 1] ** 2).sum(axis=1)
        unexplained = variance - explained
        # Size of the product of e_j and an earlier coordinate in log r_k.
        earlier = np.sqrt(explained - e_slopes[:, j] ** 2)
        dependence = nonlinearity * np.abs(e_slopes[:, j]) * earlier / variance
        places = np.argsort(-dependence)[:MAX_DEPENDENT]
        places = places[dependence[places] > MIN_DEPENDENCE]
        n = n_dependent[j] = places.size
        deviation = np.sqrt(explained[places])
        mean_slopes[j, :n] = e_slopes[places] / deviation[:, None]
        z = mean[places, None] + deviation[:, None] * standardised_mean
        own_tables[j, :n] = _log_mean_ratio(log_ratio, places, z, unexplained[places])

        # All other places that e_j moves, with earlier coordinates at zero.
        sharing = np.flatnonzero(np.abs(e_slopes[:, j]) > MIN_SLOPE * np.sqrt(variance))
        sharing = np.setdiff1d(sharing, places)
        for block in np.array_split(sharing, 1 + sharing.size // PLACES_PER_BLOCK):
            z = mean[block, None] + e_slopes[block, j, None] * e
            log_mean = _log_mean_ratio(log_ratio, block, z, unexplained[block])
            shared_table[j] += log_mean.sum(axis=0)
    return Transport(basis, shared_table, n_dependent, own_tables, mean_slopes)


def _estimate_error(
    log_ratio: LogRatio, mean: Array, slopes: Array, tables: Transport
) -> ErrorEstimate:
    """Step 4: compare mapped samples with the same samples, weighted to have the density (1)."""
    rng = np.random.default_rng(0)
    draws = rng.standard_normal((N_CHECK_SAMPLES, slopes.shape[1]))
    log_density = np.zeros(N_CHECK_SAMPLES)
    if len(tables.basis):
        transport(*tables, draws, log_density)
    z = draws @ slopes.T  # less its mean
    log_weight = log_ratio(np.arange(mean.size), mean[:, None] + z.T).sum(axis=0)
    log_weight -= log_density + 0.5 * ((draws @ tables.basis.T) ** 2).sum(axis=1)
    weight = np.exp(log_weight - log_weight.max())
    # Truncated weights, so that a few samples do not dominate.
    weight = np.minimum(weight / weight.mean(), np.sqrt(N_CHECK_SAMPLES))
    weight /= weight.sum()
    plain_mean, plain_deviation = z.mean(axis=0), z.std(axis=0)
    weighted_mean = weight @ z
    weighted_deviation = np.sqrt(weight @ (z - weighted_mean) ** 2)
    return ErrorEstimate(
        float(np.abs((weighted_mean - plain_mean) / plain_deviation).max()),
        float(np.abs(weighted_deviation / plain_deviation - 1.0).max()),
    )


@jit_allocating
def transport(
    basis: Array,
    shared_table: Array,
    n_dependent: NDArray[np.int64],
    own_tables: Array,
    mean_slopes: Array,
    draws: Array,
    log_density: Array,
) -> None:
    """Map each row of `draws`, with shape (rows, dimension), in place.

    Add the log density of the coordinates e, up to a constant, to
    `log_density` (rows,).
    """
    n_directions, dimension = basis.shape
    n_cells, n_table = shared_table.shape[1] - 1, own_tables.shape[2] - 1
    width = 2.0 * E_MAX / n_cells
    cells_per_unit = 0.5 * n_table / E_MAX
    log_p, mass, e = np.empty(n_cells + 1), np.empty(n_cells), np.empty(n_directions)
    for row in range(draws.shape[0]):
        for j in range(n_directions):
            drawn = 0.0
            for d in range(dimension):
                drawn += basis[j, d] * draws[row, d]

            # 5. The logarithm of (2) on the grid of e_j: the tables,
            # then the factor N(e_j).
            for g in range(n_cells + 1):
                log_p[g] = shared_table[j, g]
            for slot in range(n_dependent[j]):
                offset = 0.0
                for i in range(j):
                    offset += mean_slopes[j, slot, i] * e[i]
                offset = (offset + E_MAX) * cells_per_unit
                slope = mean_slopes[j, slot, j] * cells_per_unit
                for g in range(n_cells + 1):
                    position = offset + slope * (g * width - E_MAX)
                    cell = int(min(max(position, 0.0), n_table - 1.0))
                    value = own_tables[j, slot, cell]
                    # Linear within the cell, and
                    # beyond the ends of the table.
                    log_p[g] += value + (position - cell) * (
                        own_tables[j, slot, cell + 1] - value
                    )
            highest = -math.inf
            for g in range(n_cells + 1):
                log_p[g] -= 0.5 * (g * width - E_MAX) ** 2
                highest = max(highest, log_p[g])

            # 6. The mass of each cell, divided by its width and by
            # exp(highest).
            total = 0.0
            for g in range(n_cells + 1):
                log_p[g] = max(log_p[g], highest - MAX_FALL)
            right = math.exp(log_p[0] - highest)
            for g in range(n_cells):
                left, right = right, math.exp(log_p[g + 1] - highest)
                rise = log_p[g + 1] - log_p[g]
                is_flat = abs(rise) < 1e-4  # the trapezium is off by rise**2 / 12
                mass[g] = 0.5 * (left + right) if is_flat else (right - left) / rise
                total += mass[g]

            # 7. The quantile of the drawn value, counted from the nearer end.
            remaining = 0.5 * math.erfc(abs(drawn) / math.sqrt(2.0)) * total
            cell, last_cell, step = 0, n_cells - 1, 1
            if drawn > 0.0:
                cell, last_cell, step = last_cell, 0, -1
            while remaining > mass[cell] and cell != last_cell:
                remaining -= mass[cell]
                cell += step
            share = min(remaining / mass[cell], 1.0)
            share = share if step == 1 else 1.0 - share
            rise = log_p[cell + 1] - log_p[cell]
            if abs(rise) > 1e-5:  # otherwise the shares of width and mass are equal
                share = math.log1p(share * math.expm1(rise)) / rise
            e[j] = (cell + share) * width - E_MAX
            log_density[row] += log_p[cell] + share * rise - highest - math.log(total * width)
            for d in range(dimension):
                draws[row, d] += basis[j, d] * (e[j] - drawn)

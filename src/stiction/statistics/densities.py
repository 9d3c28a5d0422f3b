"""Probability densities that keep to their bounds: the diffusion estimator."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.fft
from scipy.optimize import brentq
from scipy.special import betainc
from scipy.stats import beta

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import Real, brief, checked
from stiction.statistics.estimates import as_sample

CELLS = 4096
STAGES = 7
STEEPEST = 3.0
"""Largest exponent with which a distribution function is taken to rise from its bound."""


@dataclass(frozen=True, eq=False)
class Density:
    """An estimated probability density.

    Attributes
    ----------
    x, value : (m,) arrays
        Centres of equal cells, in the unit of the values, and the density there, 1/unit.
    error : (m,) array
        Its standard error from sampling; smoothing over `bandwidth` is not part of it.
    bandwidth : float
        Standard deviation of the smoothing kernel at the median, in the unit of the values.
    """

    x: Array
    value: Array
    error: Array
    bandwidth: float

    __repr__ = brief


@checked
def density(values: Any, *, bounds: tuple[Real | None, Real | None] = (None, None)) -> Density:
    """Estimate the density of independent values, smoothed without crossing the bounds.

    Parameters
    ----------
    values : (samples,) array
    bounds : (float or None, float or None)
        Lower and upper bound of the distribution where it has them, in the unit of the
        values: for strength those of its marginal.

    Notes
    -----
    Diffusion estimator of Botev, Grotowski and Kroese (2010): the histogram on a fine grid
    evolves by the heat equation with no flux through the ends, which is a Gaussian kernel
    reflected at the bounds; the time of diffusion, and so the bandwidth, solves their
    fixed-point equation (14) without reference to a normal distribution.

    A density that vanishes at a bound would be made positive there. So the share of values
    within a distance d of a bound is first fitted by d^b (Hill, 1975). If b is significantly
    above 1, the estimate is that of the values mapped by the beta distribution function with
    these exponents, for which the density of the mapped values neither vanishes nor has a
    slope. Where there is no bound the grid reaches beyond the sample.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> found = st.statistics.density(np.random.default_rng(0).normal(size=2000))
    >>> bool(abs(found.value.max() - 0.4) < 0.03)  # 1/sqrt(2 pi)
    True
    """
    sample = as_sample(values, 16)
    low, high = _ends(sample, bounds)
    shape = tuple(
        _exponent(np.abs(sample - end)) if bound == end else 1.0
        for end, bound in zip((low, high), bounds, strict=True)
    )
    width = high - low
    mapped = betainc(*shape, np.clip((sample - low) / width, 0.0, 1.0))
    counts = np.bincount(np.minimum((mapped * CELLS).astype(int), CELLS - 1), minlength=CELLS)
    cosine = scipy.fft.dct(counts / sample.size, type=2)  # a_k, k = 0..cells-1
    time = _diffusion_time(cosine, float(sample.size))
    k = np.arange(CELLS)
    smooth = scipy.fft.idct(cosine * np.exp(-0.5 * (k * math.pi) ** 2 * time), type=2)
    # Where the bandwidth is down to a cell the cosine series rings below zero.
    cumulative = np.append(0.0, np.cumsum(np.maximum(smooth, 0.0)))
    edges = np.linspace(0.0, 1.0, CELLS + 1)
    below = np.interp(betainc(*shape, edges), edges, cumulative / cumulative[-1])
    middles = 0.5 * (edges[1:] + edges[:-1])
    stretch = beta.pdf(middles, *shape) / width  # of the mapped values
    value, bandwidth = np.diff(below) * (CELLS / width), math.sqrt(time)
    # The integral of the kernel squared is 1/(2 sqrt(pi) bandwidth).
    error = np.sqrt(value * stretch / (2.0 * math.sqrt(math.pi) * bandwidth * sample.size))
    at_median = float(beta.pdf((float(np.median(sample)) - low) / width, *shape))
    return Density(low + middles * width, value, error, bandwidth * width / at_median)


def _exponent(distances: Array) -> float:
    """Return b of a share d^b of values within a distance d of a bound; 1 unless surely above."""
    count = max(8, int(distances.size**0.6))
    nearest = np.partition(distances, count)[: count + 1]
    nearest = nearest[nearest > 0.0]
    logarithms = float(np.mean(np.log(nearest.max() / nearest))) if nearest.size else 0.0
    found = 1.0 / logarithms if logarithms > 0.0 else 1.0
    return min(found, STEEPEST) if found > 1.0 + 3.0 / math.sqrt(count) else 1.0


def _ends(sample: Array, bounds: tuple[float | None, float | None]) -> tuple[float, float]:
    """Return the ends of the grid."""
    smallest, largest = float(sample.min()), float(sample.max())
    spread = largest - smallest
    if spread == 0.0:
        raise InputError(f"values: all are equal to {smallest:g}; they have no density")
    low = -math.inf if bounds[0] is None else bounds[0]
    high = math.inf if bounds[1] is None else bounds[1]
    if smallest < low:
        raise InputError(f"values: {smallest:g} is below the lower bound {low:g}")
    if largest > high:
        raise InputError(f"values: {largest:g} is above the upper bound {high:g}")
    # A far bound only wastes grid cells; the kernel does not reach half a spread beyond the data.
    return max(low, smallest - 0.5 * spread), min(high, largest + 0.5 * spread)


def _diffusion_time(cosine: Array, n: float) -> float:
    """Return the squared bandwidth on the unit interval (Botev et al., 2010, Algorithm 1)."""
    squares = (np.arange(1, CELLS) ** 2).astype(np.float64)
    log_squares = np.log(squares)
    log_power = np.log(np.maximum((0.5 * cosine[1:]) ** 2, 1e-300))

    def functional(order: int, time: float) -> float:
        exponent = order * log_squares + log_power - squares * math.pi**2 * time
        return float(2.0 * math.pi ** (2 * order) * np.sum(np.exp(exponent)))

    def excess(time: float) -> float:
        f = functional(STAGES, time)
        for s in range(STAGES - 1, 1, -1):
            if n * f < 1e-200:  # the values are as even as a grid: no such time smooths them
                return -math.inf
            odd = float(np.prod(np.arange(1, 2 * s, 2))) / math.sqrt(2.0 * math.pi)
            constant = (1.0 + 0.5 ** (s + 0.5)) / 3.0
            f = functional(s, (2.0 * constant * odd / (n * f)) ** (2.0 / (3.0 + 2.0 * s)))
        return time - (2.0 * n * math.sqrt(math.pi) * max(f, 1e-300)) ** -0.4

    # Below a cell's width the grid, not the sample, would be resolved.
    times = np.geomspace((0.5 / CELLS) ** 2, 0.1, 60)
    if excess((0.5 / CELLS) ** 2) >= 0.0:
        return (0.5 / CELLS) ** 2
    for left, right in pairwise(times):
        if excess(float(right)) > 0.0:  # the smallest root is the one that is meant
            root: float = brentq(excess, float(left), float(right), rtol=1e-6)
            return root
    return 0.28**2 * n**-0.4  # no root: few or even values; the normal-reference rule

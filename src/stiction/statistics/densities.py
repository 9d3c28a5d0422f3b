"""Probability densities that keep to their bounds: the diffusion estimator."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.fft
from scipy.optimize import brentq

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import Real, brief, checked
from stiction.statistics.estimates import as_sample

CELLS = 4096
STAGES = 7
FEW = 8


@dataclass(frozen=True, eq=False)
class Density:
    """An estimated probability density.

    Attributes
    ----------
    x, value : (m,) arrays
        Centres of equal cells, in the unit of the values, and the density there, 1/unit.
    error : (m,) array
        Standard error of the density from sampling, without the effect of smoothing.
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
        Lower and upper bound of the distribution, if any, in the unit of the values; for
        strength, those of its marginal.

    Notes
    -----
    Diffusion estimator of Botev, Grotowski and Kroese (2010): the histogram on a fine grid
    evolves by the heat equation with no flux through the ends, which is a Gaussian kernel
    reflected at the bounds; the time of diffusion, and so the bandwidth, solves their
    fixed-point equation (14) without reference to a normal distribution.

    This would make a density that vanishes at a bound positive there. So the share of
    values within a distance d of a bound is first fitted by d^b (Hill, 1975). If b is
    significantly above 1, the estimate is that of d + c log(1 - exp(-(d + e)/c)), with the
    median distance c and the distance e of the eighth nearest value: near the bound a
    logarithm, for which the kernel narrows towards the bound, and far from it d itself.
    Without a bound, the grid extends beyond the sample.

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
    ends = []
    for end, bound, sign in ((low, bounds[0], 1.0), (high, bounds[1], -1.0)):
        distances = np.abs(sample - end)
        if bound == end and _vanishes(distances):
            ends.append((end, sign, np.median(distances), np.partition(distances, FEW)[FEW]))

    def mapped(x: Any) -> Any:
        terms = [s * c * np.log(-np.expm1(-(np.abs(x - end) + e) / c)) for end, s, c, e in ends]
        return x + sum(terms)

    def slope(x: Any) -> Any:
        return 1.0 + sum(1.0 / np.expm1((np.abs(x - end) + e) / c) for end, _, c, e in ends)

    y = mapped(sample)
    reach = 0.5 * float(np.ptp(y))
    first = max(mapped(low), y.min() - reach)
    width = min(mapped(high), y.max() + reach) - first
    counts = np.bincount(
        np.minimum(((y - first) / width * CELLS).astype(int), CELLS - 1), minlength=CELLS
    )
    cosine = scipy.fft.dct(counts / sample.size, type=2)  # a_k, k = 0..cells-1
    time = _diffusion_time(cosine, float(sample.size))
    k = np.arange(CELLS)
    smooth = scipy.fft.idct(cosine * np.exp(-0.5 * (k * math.pi) ** 2 * time), type=2)
    # Where the bandwidth is down to a cell the cosine series rings below zero.
    cumulative = np.append(0.0, np.cumsum(np.maximum(smooth, 0.0)))
    edges = np.linspace(0.0, 1.0, CELLS + 1)
    x = low + edges * (high - low)
    below = np.interp(mapped(x), first + edges * width, cumulative / cumulative[-1])
    middles = 0.5 * (x[1:] + x[:-1])
    value, bandwidth = np.diff(below) / np.diff(x), math.sqrt(time) * width
    # The integral of the kernel squared is 1/(2 sqrt(pi) bandwidth).
    error = np.sqrt(
        value * slope(middles) / (2.0 * math.sqrt(math.pi) * bandwidth * sample.size)
    )
    return Density(middles, value, error, float(bandwidth / slope(np.median(sample))))


def _vanishes(distances: Array) -> bool:
    """Return whether the share d^b of values within a distance d of a bound surely has b > 1."""
    count = max(FEW, int(distances.size**0.6))
    nearest = np.sort(distances)[: count + 1]
    if nearest[FEW] == 0.0:
        return False
    inverse = float(np.mean(np.log(nearest[-1] / nearest[nearest > 0.0])))
    return 0.0 < inverse * (1.0 + 3.0 / math.sqrt(count)) < 1.0


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

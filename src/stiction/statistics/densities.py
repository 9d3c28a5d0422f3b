"""Probability densities that keep to their bounds: the diffusion estimator."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.optimize import brentq

from stiction._checks import is_real
from stiction.errors import InputError
from stiction.jit import jit
from stiction.model import brief, describe
from stiction.statistics.estimates import as_sample

Array = NDArray[np.float64]

CELLS = 4096
STAGES = 7


@dataclass(frozen=True, eq=False)
class Density:
    """An estimated probability density.

    Attributes
    ----------
    x : (m,) array
        Where, in the unit of the values.
    value : (m,) array
        The density, 1/unit. It integrates to 1 over the support.
    error : (m,) array
        Its standard error from sampling; smoothing over `bandwidth` is not part of it.
    bandwidth : float
        Standard deviation of the smoothing kernel, in the unit of the values.
    """

    x: Array
    value: Array
    error: Array
    bandwidth: float

    __repr__ = brief


@jit
def count_into(values: Array, low: float, high: float, counts: NDArray[np.int64]) -> None:
    """Add flat `values` to counts in equal cells of [low, high]; the ends take what is beyond."""
    cells = counts.size
    scale = cells / (high - low)
    for i in range(values.size):
        cell = int((values[i] - low) * scale)
        counts[min(max(cell, 0), cells - 1)] += 1


def density(
    values: Any,
    *,
    bounds: tuple[float | None, float | None] = (None, None),
    smoothing: float = 1.0,
) -> Density:
    """Density of independent values, smoothed without crossing the bounds.

    Parameters
    ----------
    values : (samples,) array
    bounds : (float or None, float or None)
        Lower and upper bound of the distribution where it has them, in the unit of the values:
        for strength those of its marginal.
    smoothing : float
        Factor on the bandwidth, positive: more than one where a curve shall not show what the
        sample cannot tell.

    Returns
    -------
    Density

    Raises
    ------
    InputError
        If there are fewer than 16 values, one is not finite or beyond the bounds, or all are
        equal.

    Notes
    -----
    Diffusion estimator of Botev, Grotowski and Kroese (2010): the histogram on a fine grid evolves
    by the heat equation with no flux through the ends, which is a Gaussian kernel reflected at the
    bounds; the time of diffusion, and so the bandwidth, solves their fixed-point equation (14)
    without reference to a normal distribution. No mass leaves the support and the density may be
    positive at a bound; what it does within about a bandwidth of the bound is smoothed away.
    Where there is no bound the grid reaches beyond the sample. Stretching the bound to infinity
    with a logarithm resolves more there but spikes wherever a few values crowd on the bound.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> found = st.density(np.random.default_rng(0).normal(size=2000))
    >>> bool(abs(found.value.max() - 0.4) < 0.03)  # 1/sqrt(2 pi)
    True
    """
    sample = as_sample(values, 16)
    low, high = _ends(sample, bounds)
    counts = np.zeros(CELLS, dtype=np.int64)
    count_into(sample, low, high, counts)
    return density_of_counts(counts, low, high, effective=sample.size, smoothing=smoothing)


def _ends(sample: Array, bounds: tuple[float | None, float | None]) -> tuple[float, float]:
    smallest, largest = float(sample.min()), float(sample.max())
    spread = largest - smallest
    if spread == 0.0:
        raise InputError(f"values: all are equal to {smallest:g}; they have no density")
    if (
        not isinstance(bounds, tuple | list)
        or len(bounds) != 2
        or not all(end is None or (is_real(end) and end == end) for end in bounds)
    ):
        raise InputError(
            f"bounds: must be two numbers or None, (low, high), got {describe(bounds)}"
        )
    low, high = bounds
    problems = []
    if low is not None and smallest < low:
        problems.append(f"values: {smallest:g} is below the lower bound {low:g}")
    if high is not None and largest > high:
        problems.append(f"values: {largest:g} is above the upper bound {high:g}")
    if problems:
        raise InputError(problems)
    # A far bound only wastes grid cells; the kernel does not reach half a spread beyond the data.
    near_low, near_high = smallest - 0.5 * spread, largest + 0.5 * spread
    return (
        near_low if low is None else max(low, near_low),
        near_high if high is None else min(high, near_high),
    )


def density_of_counts(
    counts: Any, low: float, high: float, *, effective: float, smoothing: float = 1.0
) -> Density:
    """The same from counts in equal cells of [low, high], where values do not fit into memory.

    Parameters
    ----------
    counts : (cells,) array
        How many values fell into each cell.
    low, high : float
        Ends of the support. No mass diffuses through them, which reflects the kernel there.
    effective : float
        How many independent values the counts are worth; fewer than their number where
        neighbouring points of one field were counted.
    smoothing : float
        Factor on the bandwidth.

    Returns
    -------
    Density
        At the centres of the cells.
    """
    counts = np.asarray(counts, dtype=np.float64)
    total = counts.sum()
    if counts.ndim != 1 or total <= 0.0 or not low < high or not effective > 1.0:
        raise InputError("counts: must be a (cells,) array with values in it, low < high")
    cells = counts.size
    cosine = scipy.fft.dct(counts / total, type=2)  # a_k, k = 0..cells-1
    if not (is_real(smoothing) and smoothing > 0.0):
        raise InputError(f"smoothing: must be a positive number, got {describe(smoothing)}")
    time = _diffusion_time(cosine, float(effective), cells) * smoothing**2
    k = np.arange(cells)
    smooth = scipy.fft.idct(cosine * np.exp(-0.5 * (k * math.pi) ** 2 * time), type=2) * cells
    width = high - low
    bandwidth = math.sqrt(time) * width
    # Where the bandwidth is down to a cell the cosine series rings below zero.
    value = np.maximum(smooth, 0.0)
    value *= cells / (value.sum() * width)
    roughness = 1.0 / (2.0 * math.sqrt(math.pi) * bandwidth)  # integral of the kernel squared
    return Density(
        x=low + (np.arange(cells) + 0.5) * (width / cells),
        value=value,
        error=np.sqrt(value * roughness / effective),
        bandwidth=bandwidth,
    )


def _diffusion_time(cosine: Array, n: float, cells: int) -> float:
    """Squared bandwidth on the unit interval (Botev et al., 2010, Algorithm 1)."""
    squares = (np.arange(1, cells) ** 2).astype(np.float64)
    power = (0.5 * cosine[1:]) ** 2
    log_squares = np.log(squares)
    log_power = np.log(np.maximum(power, 1e-300))

    def functional(order: int, time: float) -> float:
        exponent = order * log_squares + log_power - squares * math.pi**2 * time
        return float(2.0 * math.pi ** (2 * order) * np.sum(np.exp(exponent)))

    def excess(time: float) -> float:
        f = functional(STAGES, time)
        for s in range(STAGES - 1, 1, -1):
            odd = float(np.prod(np.arange(1, 2 * s, 2))) / math.sqrt(2.0 * math.pi)
            constant = (1.0 + 0.5 ** (s + 0.5)) / 3.0
            f = functional(s, (2.0 * constant * odd / (n * f)) ** (2.0 / (3.0 + 2.0 * s)))
        return time - (2.0 * n * math.sqrt(math.pi) * f) ** -0.4

    # Below a cell's width the grid, not the sample, would be resolved.
    finest, coarsest = (0.5 / cells) ** 2, 0.1
    if excess(finest) >= 0.0:
        return finest
    times = np.geomspace(finest, coarsest, 60)
    for left, right in pairwise(times):
        if excess(float(right)) > 0.0:  # the smallest root is the one that is meant
            root: float = brentq(excess, float(left), float(right), rtol=1e-6)
            return root
    return 0.28**2 * n**-0.4  # no root: a sample of a few values; the normal-reference rule

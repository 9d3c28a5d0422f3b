"""Statistics of samples: quantiles and densities with errors, and agreement with tests.

The exact moments of the nucleation stress are in `stiction.theory`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import scipy.stats
from scipy.ndimage import gaussian_filter1d

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import Real, RealArray, check, checked
from stiction.inference.agreement import agreement

__all__ = ["agreement"]

GRID_CELLS = 4096
KERNEL_END = 8.0
"""End of the kernel, in standard deviations."""


def __dir__() -> list[str]:  # what completion lists
    return __all__


def as_sample(values: Any, fewest: int) -> Array:
    """Return finite values as a flat array with at least `fewest` entries.

    >>> as_sample([[3, 1], [2, 5]], 4).tolist()
    [3.0, 1.0, 2.0, 5.0]
    >>> as_sample([3.0, 1.0], 3)
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: values: at least 3 are needed, got 2
    >>> as_sample([3.0, float("inf"), float("nan")], 3)
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: values: must be finite, but entry 1 is inf
    """
    array = check("values", values, RealArray).ravel()
    if array.size < fewest:
        raise InputError(f"values: at least {fewest} are needed, got {array.size}")
    if not np.all(np.isfinite(array)):
        entry = int(np.argmin(np.isfinite(array)))
        raise InputError(f"values: must be finite, but entry {entry} is {array[entry]}")
    return array


class Quantiles(NamedTuple):
    """Quantiles of a sample, and the ends of their 90 % confidence intervals, in its unit.

    An end is infinite if the sample is too small to bound a quantile.
    """

    value: Array
    lower: Array
    upper: Array


@checked
def quantiles(values: Any, probability: RealArray) -> Quantiles:
    """Estimate quantiles of independent values, with distribution-free confidence intervals.

    Parameters
    ----------
    values : (samples,) array
        Values, for example critical stresses from `monte_carlo`, Pa.
    probability : float or (m,) array
        Probabilities of the quantiles, between 0 and 1, exclusive.

    Notes
    -----
    The number of values below the p-quantile is binomial (N, p). The
    interval ends are order statistics. The number lies between their
    ranks with a probability of 90 % (David and Nagaraja, 2003, Sec.
    7.1). The coverage is exact for continuous distributions, rounded up
    to whole ranks.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.statistics import density, quantiles
    >>> found = quantiles(np.random.default_rng(0).normal(size=2000), [0.5])
    >>> bool(found.lower[0] < 0.0 < found.upper[0])
    True

    Of 20 values, at most 5 and at least 15 lie below the median with 2 %
    probability each, and 6 and 14 with 6 %. The 10 % quantile has no lower end.

    >>> found = quantiles(np.arange(20, 0, -1.0), [0.5, 0.1])
    >>> found.value.round(6).tolist(), found.lower.tolist(), found.upper.tolist()
    ([10.5, 2.366667], [6.0, -inf], [15.0, 5.0])
    """
    ordered = np.sort(as_sample(values, 1))
    p = np.atleast_1d(probability)
    if (wrong := p[~((p > 0.0) & (p < 1.0))]).size:
        raise InputError(f"probability: must be between 0 and 1, exclusive, got {wrong[0]:g}")
    n, tail = ordered.size, 0.05
    # Rank r is a lower end if fewer than r values lie below the
    # quantile with probability <= tail.
    low = scipy.stats.binom.ppf(tail, n, p).astype(int)  # P(B <= low - 1) < tail <= P(B <= low)
    high = scipy.stats.binom.isf(tail, n, p).astype(int) + 1  # P(B >= high) <= tail
    padded = np.concatenate(([-np.inf], ordered, [np.inf]))
    value = np.quantile(ordered, p, method="median_unbiased")
    lower, upper = padded[np.clip(low, 0, n + 1)], padded[np.clip(high, 0, n + 1)]
    return Quantiles(value, lower, upper)


class Density(NamedTuple):
    """Estimated probability density at the centres x of equal cells."""

    x: Array  # in the unit of the values
    value: Array  # 1/unit
    error: Array  # standard error from sampling, without the effect of smoothing
    bandwidth: float  # standard deviation of the smoothing kernel, in the unit of the values


@checked
def density(values: Any, *, bounds: tuple[Real | None, Real | None] = (None, None)) -> Density:
    """Estimate the density of independent values.

    Smoothing does not cross the bounds.

    Parameters
    ----------
    values : (samples,) array
    bounds : (float or None, float or None)
        Lower and upper bound of the distribution, if any, in the unit
        of the values. Use the bounds of the marginal for strength.

    Notes
    -----
    The algorithm follows B. W. Silverman, Density Estimation for
    Statistics and Data Analysis, 1986:

    1. Choose the ends of a grid: the bounds,
       or half a spread beyond the sample.
    2. Count the values in the cells of the grid.
    3. Choose the bandwidth h with Eq. 3.31, 0.9 min(standard deviation,
       interquartile range/1.34) N^(-1/5), but at least half a cell.
    4. Smooth the counts with a Gaussian kernel of standard deviation h,
       reflected at the ends.
    5. Compute the sampling error from the integral of the squared
       kernel, 1/(2 sqrt(pi) h).

    A density with two peaks is smoothed more than necessary, and the
    slope at a bound is zero.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.statistics import density, quantiles
    >>> found = density(np.random.default_rng(0).normal(size=2000))
    >>> bool(abs(found.value.max() - 0.4) < 0.03)  # 1/sqrt(2 pi)
    True

    The density of 16 equal steps between bounds far away, and between close
    bounds: the sum is 1, and half of the range lies on either side of the sample.

    >>> values = np.arange(16.0)
    >>> free, held = density(values, bounds=(-99.0, None)), density(values, bounds=(-0.5, 15.5))
    >>> [round(float(part.x[0] + part.x[-1]), 6) for part in (free, held)]
    [15.0, 15.0]
    >>> widths = [float(part.x[1] - part.x[0]) * 4096 for part in (free, held)]
    >>> round(widths[0], 9), round(widths[1], 9)
    (30.0, 16.0)
    >>> round(float(free.value.mean()) * 30.0, 9), round(float(held.value.mean()) * 16.0, 9)
    (1.0, 1.0)

    The bandwidth is 0.9 min(4.6098, 7.5/1.34) 16^(-1/5), and the error follows from it:

    >>> round(free.bandwidth, 4), round(0.9 * 4.6098 * 16**-0.2, 4)
    (2.3829, 2.3829)
    >>> variance = held.value / (2.0 * math.sqrt(math.pi) * held.bandwidth * 16)
    >>> np.allclose(held.error**2, variance), bool(np.abs(held.value * 16 - 1).max() < 0.1)
    (True, True)
    >>> skewed = density(np.r_[np.arange(15.0) / 100.0, 9.0])  # the quartiles are 0.075 apart
    >>> round(skewed.bandwidth, 5), round(0.9 * 0.075 / 1.34 * 16**-0.2, 5)
    (0.02893, 0.02893)
    """
    sample = as_sample(values, 16)
    smallest, largest = float(sample.min()), float(sample.max())
    low = -math.inf if bounds[0] is None else bounds[0]
    high = math.inf if bounds[1] is None else bounds[1]
    if not low <= smallest < largest <= high:
        raise InputError(
            f"values: must differ and lie between the bounds {low:g} and {high:g}, got"
            f" {smallest:g} to {largest:g}"
        )
    # 1. A bound far from the sample would waste cells, as the kernel
    # never reaches half a spread.
    spread = largest - smallest
    low, high = max(low, smallest - 0.5 * spread), min(high, largest + 0.5 * spread)
    width = high - low
    # 2.
    cells = ((sample - low) / width * GRID_CELLS).astype(int)
    counts = np.bincount(np.minimum(cells, GRID_CELLS - 1), minlength=GRID_CELLS)
    # 3. A narrower kernel would resolve the cells of the grid instead
    # of the sample.
    deviation, middle = float(sample.std()), np.quantile(sample, [0.25, 0.75])
    silverman = 0.9 * (min(deviation, float(np.ptp(middle)) / 1.34) or deviation)
    bandwidth = max(silverman * float(sample.size) ** -0.2, 0.5 * width / GRID_CELLS)
    # 4. and 5. The smooth density and its error.
    smooth = gaussian_filter1d(
        1.0 * counts, bandwidth / width * GRID_CELLS, mode="reflect", truncate=KERNEL_END
    )
    x = low + (np.arange(GRID_CELLS) + 0.5) / GRID_CELLS * width
    value = smooth / smooth.sum() * GRID_CELLS / width
    error = np.sqrt(value / (2.0 * math.sqrt(math.pi) * bandwidth * sample.size))
    return Density(x, value, error, bandwidth)

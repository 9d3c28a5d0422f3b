"""Probability densities within bounds, from a kernel that is reflected at the bounds.

Problem: estimate the density of N independent values, without crossing given bounds.

Algorithm (`density`), after B. W. Silverman, Density Estimation for Statistics
and Data Analysis, 1986:

1. Choose the ends of a grid: the bounds, or half a spread beyond the sample.
2. Count the values in the cells of the grid.
3. Choose the bandwidth h with Eq. 3.31 of this book, 0.9 min(standard deviation,
   interquartile range/1.34) N^(-1/5), but at least half a cell.
4. Smooth the counts with a Gaussian kernel of standard deviation h, reflected at
   the ends.
5. Compute the sampling error from the integral of the squared kernel, 1/(2 sqrt(pi) h).
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import Real, checked
from stiction.base.representation import Result, brief
from stiction.statistics.estimates import as_sample

GRID_CELLS = 4096
KERNEL_END = 8.0
"""End of the kernel, in standard deviations."""


@dataclass(frozen=True, eq=False, repr=False)
class Density(Result):
    """Estimated probability density.

    Attributes
    ----------
    x, value : (m,) arrays
        Centres of equal cells, in the unit of the values, and the density there,
        1/unit.
    error : (m,) array
        Standard error of the density from sampling, without the effect of smoothing.
    bandwidth : float
        Standard deviation of the smoothing kernel, in the unit of the values.
    """

    x: Array
    value: Array
    error: Array
    bandwidth: float

    __repr__ = brief


@checked
def density(values: Any, *, bounds: tuple[Real | None, Real | None] = (None, None)) -> Density:
    """Estimate the density of independent values. Smoothing does not cross the bounds.

    Parameters
    ----------
    values : (samples,) array
    bounds : (float or None, float or None)
        Lower and upper bound of the distribution, if any, in the unit of the
        values. Use the bounds of the marginal for strength.

    Notes
    -----
    A Gaussian kernel with the bandwidth of Silverman (1986, Eq. 3.31) smooths the
    values on a fine grid, and is reflected at the bounds. A density with two peaks is
    smoothed more than necessary, and the slope at a bound is zero. Without a bound,
    the grid extends beyond the sample.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> found = st.statistics.density(np.random.default_rng(0).normal(size=2000))
    >>> bool(abs(found.value.max() - 0.4) < 0.03)  # 1/sqrt(2 pi)
    True
    """
    sample = as_sample(values, 16)
    # 1. and 2. Grid and counts.
    low, high = _ends(sample, bounds)
    width = high - low
    counts = np.bincount(
        np.minimum(((sample - low) / width * GRID_CELLS).astype(int), GRID_CELLS - 1),
        minlength=GRID_CELLS,
    )
    # 3. A narrower kernel would resolve the cells of the grid instead of the sample.
    bandwidth = max(_bandwidth(sample), 0.5 * width / GRID_CELLS)
    # 4. and 5. The smooth density and its error.
    smooth = gaussian_filter1d(
        1.0 * counts, bandwidth / width * GRID_CELLS, mode="reflect", truncate=KERNEL_END
    )
    x = low + (np.arange(GRID_CELLS) + 0.5) / GRID_CELLS * width
    value = smooth / smooth.sum() * GRID_CELLS / width
    error = np.sqrt(value / (2.0 * math.sqrt(math.pi) * bandwidth * sample.size))
    return Density(x, value, error, bandwidth)


def _ends(sample: Array, bounds: tuple[float | None, float | None]) -> tuple[float, float]:
    """Step 1: return the ends of the grid."""
    smallest, largest = float(sample.min()), float(sample.max())
    spread = largest - smallest
    if spread == 0.0:
        raise InputError(f"values: must differ to have a density, all are {smallest:g}")
    low = -math.inf if bounds[0] is None else bounds[0]
    high = math.inf if bounds[1] is None else bounds[1]
    if smallest < low:
        raise InputError(f"values: {smallest:g} is below the lower bound {low:g}")
    if largest > high:
        raise InputError(f"values: {largest:g} is above the upper bound {high:g}")
    # A bound far from the sample would waste cells, as the kernel never reaches
    # half a spread.
    return max(low, smallest - 0.5 * spread), min(high, largest + 0.5 * spread)


def _bandwidth(values: Array) -> float:
    """Step 3: return the standard deviation of the kernel."""
    low, high = np.quantile(values, [0.25, 0.75])
    spread = min(float(values.std()), float(high - low) / 1.34) or float(values.std())
    return 0.9 * spread * float(values.size) ** -0.2

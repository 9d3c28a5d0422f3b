"""The posterior on a grid that closes in on its mass, and draws from it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stiction.arrays import Array
from stiction.progress import SILENT, Meter

Function = Callable[[Array], Array]
"""Logarithms at points (points, parameters)."""

POINTS = 100_000
"""Approximate number of points of a grid."""
MOST_ALONG = 512
ZOOMS = 6
NEGLIGIBLE = 1e-6
"""Mass left outside on either side of a parameter when the grid closes in."""
BATCH = 5_000


@dataclass(frozen=True, eq=False)
class Grid:
    """Cells of equal prior mass in a box, each with its share of the posterior."""

    low: Array  # (parameters,): corners of the box, as u
    high: Array
    mass: Array  # (n_1, ..., n_parameters): of the cells; sums to 1
    log_evidence: float  # logarithm of the mean of the likelihood over the whole prior

    def centres(self, axis: int) -> Array:
        """Return the centres of the cells along one parameter, as u."""
        count, width = self.mass.shape[axis], self.high[axis] - self.low[axis]
        result: Array = self.low[axis] + width * (np.arange(count) + 0.5) / count
        return result

    def marginal(self, axis: int) -> Array:
        """Return the mass of the cells along one parameter."""
        return _along(self.mass, axis)

    def held(self, axis: int, low: float, high: float) -> float:
        """Return the mass between two values of one parameter, as u."""
        centres = self.centres(axis)
        return float(self.marginal(axis)[(centres > low) & (centres < high)].sum())

    def information(self, axis: int) -> float:
        """Return the divergence of the marginal of one parameter from its prior, nats."""
        mass = self.marginal(axis)
        prior = (self.high[axis] - self.low[axis]) / mass.size
        held = mass > 0.0
        return float(np.sum(mass[held] * np.log(mass[held] / prior)))

    def spread(self, axis: int) -> float:
        """Return the standard deviation of one parameter, as u."""
        mass, centres = self.marginal(axis), self.centres(axis)
        return float(np.sqrt(mass @ (centres - mass @ centres) ** 2))

    def draws(self, count: int, seed: int) -> Array:
        """Draw from the posterior as u, (count, parameters), uniform within the cells."""
        rng = np.random.default_rng(seed)
        cells = rng.choice(self.mass.size, size=count, p=self.mass.ravel())
        places = np.stack(np.unravel_index(cells, self.mass.shape), axis=1)
        share = (places + rng.random(places.shape)) / np.array(self.mass.shape)
        result: Array = self.low + (self.high - self.low) * share
        return result


def _along(mass: Array, axis: int) -> Array:
    result: Array = mass.sum(axis=tuple(i for i in range(mass.ndim) if i != axis))
    return result


def _evaluated(function: Function, low: Array, high: Array, along: int, meter: Meter) -> Array:
    """Evaluate the function at the centres of the cells of a box."""
    dimension = low.size
    steps = (np.arange(along) + 0.5) / along
    mesh = np.stack(np.meshgrid(*([steps] * dimension), indexing="ij"), axis=-1)
    u = low + (high - low) * mesh.reshape(-1, dimension)
    parts = []
    for start in range(0, u.shape[0], BATCH):
        parts.append(function(u[start : start + BATCH]))
        meter.advance(parts[-1].size)
    return np.concatenate(parts).reshape((along,) * dimension)


def _closer(mass: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Return the box without the cells on either side that hold almost no mass."""
    new_low, new_high = low.copy(), high.copy()
    for axis in range(mass.ndim):
        along = _along(mass, axis)
        below = int(np.sum(np.cumsum(along) <= NEGLIGIBLE))
        above = int(np.sum(np.cumsum(along[::-1]) <= NEGLIGIBLE))
        width = (high[axis] - low[axis]) / along.size
        new_low[axis] += max(below - 1, 0) * width  # one cell of margin
        new_high[axis] -= max(above - 1, 0) * width
    return new_low, new_high


def grid_of(
    function: Function, low: Array, high: Array, meter: Meter = SILENT, points: int = POINTS
) -> Grid | None:
    """Return a density, given by its logarithm, between two corners; None if it is zero.

    The first grid covers all of it; each next one the box that holds all but a millionth of the
    last, until it no longer shrinks by a tenth in any direction. The midpoint rule converges
    faster than any power of the step once a cell is narrower than the density.
    """
    along = int(min(MOST_ALONG, max(8, points ** (1.0 / low.size))))
    for zoom in range(ZOOMS):
        values = _evaluated(function, low, high, along, meter)
        top = float(values.max())
        if top == -np.inf:
            return None
        mass = np.exp(values - top)
        total = float(mass.sum())
        cell = float(np.prod((high - low) / along))
        mass /= total
        closer = _closer(mass, low, high)
        if zoom == ZOOMS - 1 or np.all(closer[1] - closer[0] > 0.9 * (high - low)):
            break
        low, high = closer
    return Grid(low, high, mass, top + float(np.log(total * cell)))

"""The posterior on a grid that closes in on its mass, and draws from it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stiction.arrays import Array

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
        others = tuple(i for i in range(self.mass.ndim) if i != axis)
        result: Array = self.mass.sum(axis=others)
        return result

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

    def draws(self, count: int, seed: int) -> Array:
        """Draw from the posterior as u, (count, parameters), uniform within the cells."""
        rng = np.random.default_rng(seed)
        cells = rng.choice(self.mass.size, size=count, p=self.mass.ravel())
        places = np.stack(np.unravel_index(cells, self.mass.shape), axis=1)
        share = (places + rng.random(places.shape)) / np.array(self.mass.shape)
        result: Array = self.low + (self.high - self.low) * share
        return result


def grid_of(function: Function, low: Array, high: Array, points: int = POINTS) -> Grid | None:
    """Return a density, given by its logarithm, between two corners; None if it is zero.

    The first grid covers all of it; each next one the box that holds all but a millionth of the
    last, until it no longer shrinks by a tenth in any direction. The midpoint rule converges
    faster than any power of the step once a cell is narrower than the density.
    """
    along = int(min(MOST_ALONG, max(8, points ** (1.0 / low.size))))
    steps = [(np.arange(along) + 0.5) / along] * low.size
    unit = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)
    for _ in range(ZOOMS):
        u = (low + (high - low) * unit).reshape(-1, low.size)
        parts = [function(u[start : start + BATCH]) for start in range(0, u.shape[0], BATCH)]
        values = np.concatenate(parts).reshape(unit.shape[:-1])
        top = float(values.max())
        if top == -np.inf:
            return None
        mass, cell = np.exp(values - top), (high - low) / along
        evidence = top + float(np.log(mass.sum() * np.prod(cell)))
        grid = Grid(low, high, mass / mass.sum(), evidence)
        # Cells on either side that hold almost no mass, less one of margin.
        rows = [grid.marginal(axis) for axis in range(low.size)]
        below = [np.sum(np.cumsum(row) <= NEGLIGIBLE) - 1 for row in rows]
        above = [np.sum(np.cumsum(row[::-1]) <= NEGLIGIBLE) - 1 for row in rows]
        closer = low + np.maximum(below, 0) * cell, high - np.maximum(above, 0) * cell
        if np.all(closer[1] - closer[0] > 0.9 * (high - low)):
            break
        low, high = closer
    return grid

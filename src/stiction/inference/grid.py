"""Compute a posterior on a grid that closes in on the mass, and draw from it.

Problem. The prior is uniform in the unit cube. Compute the posterior
density L(u)/Z of the parameters u from the likelihood L, with the
evidence Z = int L du. L may be narrow.

Source. Gelman and others, Bayesian Data Analysis (2013), section 10.1,
describe posteriors on a grid. Closing in is our own.

Steps:

1. Divide a box into equal cells, and
   compute log L at the centre of each cell.
2. The mass of a cell is L over the sum of L. Z is
   the sum of L times the volume of a cell (midpoint
   rule). The part outside the box is neglected.
3. Shrink the box. For each parameter, cut off cells with a mass up to
   `OUTSIDE_MASS` on either side, but keep one more cell on either side.
4. Repeat, at most `MAX_GRID_ZOOMS` times, until no side of the box
   shrinks by a tenth.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import entropy

from stiction.base.arrays import Array

GRID_POINTS = 100_000
"""Approximate number of points of a grid."""
MOST_ALONG = 512
"""Most points along a parameter."""
MAX_GRID_ZOOMS = 6
OUTSIDE_MASS = 1e-6
"""Posterior mass outside on either side of a parameter when the grid closes in."""
MAX_BATCH = 5_000
"""Points at which the likelihood is computed at once."""


@dataclass(frozen=True, eq=False)
class PosteriorGrid:
    """Posterior probabilities of cells with equal prior mass in a box."""

    box: Array  # corners, as u, (2, parameters)
    mass: Array  # of the cells, (n_1, ..., n_parameters); sums to 1
    log_evidence: float  # logarithm of the mean likelihood over the whole prior

    def marginal(self, axis: int) -> Array:
        """Return the mass of cells along one parameter."""
        axes = tuple(i for i in range(self.mass.ndim) if i != axis)
        return self.mass.sum(axis=axes)

    def information(self, axis: int) -> float:
        """Return the divergence of one parameter's marginal posterior from its prior, nats."""
        mass = self.marginal(axis)
        return float(np.log(mass.size / np.ptp(self.box[:, axis])) - entropy(mass))

    def draws(self, count: int, seed: int) -> Array:
        """Draw u (count, parameters) from the posterior. Draws are uniform within cells."""
        rng = np.random.default_rng(seed)
        cells = rng.choice(self.mass.size, size=count, p=self.mass.ravel())
        places = np.stack(np.unravel_index(cells, self.mass.shape), axis=1)
        share = (places + rng.random(places.shape)) / np.array(self.mass.shape)
        return self.box[0] + np.ptp(self.box, axis=0) * share


def grid_of(
    function: Callable[[Array], Array], box: Array, points: int = GRID_POINTS
) -> PosteriorGrid | None:
    """Return the posterior from a log density at points (points, parameters) in a box, or None.

    The result is None if the density is zero at all points. If a cell
    is narrower than the density, the midpoint rule converges faster
    than any power of the step.
    """
    dimension = box.shape[1]
    along = int(min(MOST_ALONG, max(8, points ** (1.0 / dimension))))
    steps = [(np.arange(along) + 0.5) / along] * dimension
    unit = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)
    for _ in range(MAX_GRID_ZOOMS):
        low, high = box  # 1.
        u = (low + (high - low) * unit).reshape(-1, dimension)
        parts = [function(u[k : k + MAX_BATCH]) for k in range(0, u.shape[0], MAX_BATCH)]
        values = np.concatenate(parts).reshape(unit.shape[:-1])
        top = float(values.max())
        if top == -np.inf:
            return None
        mass, cell = np.exp(values - top), (high - low) / along  # 2.
        evidence = top + float(np.log(mass.sum() * np.prod(cell)))
        grid = PosteriorGrid(box, mass / mass.sum(), evidence)
        # 3. Leave one cell of almost no mass as a margin.
        rows = [grid.marginal(axis) for axis in range(dimension)]
        empty = [[np.sum(np.cumsum(r) <= OUTSIDE_MASS) - 1 for r in (o, o[::-1])] for o in rows]
        below, above = np.maximum(empty, 0).T * cell
        box = np.stack([low + below, high - above])
        if np.all(box[1] - box[0] > 0.9 * (high - low)):  # 4.
            break
    return grid

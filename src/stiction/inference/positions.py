"""Where slip began: density of the position given the peak, on an interface that is not uniform."""

from __future__ import annotations

import math

import numpy as np

from stiction.arrays import Array
from stiction.inference.density import silverman
from stiction.inference.onset_table import OnsetTable

IMAGES = np.arange(-2, 3)


def position_table(
    table: OnsetTable, length: float, peaks: Array, positions: Array, error: float
) -> Array:
    """Logarithm of p(position | peak) at every node, (nodes, peaks); 0 where none was seen.

    A kernel estimate over the simulated pairs, periodic along the interface (Rosenblatt, 1969):
    Gaussian in the peak, as wide as for its density, and in the position, and a hundredth of the
    uniform density for what no sample has shown.
    """
    seen = np.isfinite(positions)
    result = np.zeros((table.peaks.shape[0], peaks.size))
    for node, (onsets, places) in enumerate(zip(table.peaks, table.places, strict=True)):
        width = math.hypot(silverman(onsets.size) * onsets.std(), error)
        angle = 2.0 * math.pi * places / length
        order = min(abs(np.exp(1j * angle).mean()), 1.0 - 1e-9)
        spread = min(math.sqrt(-2.0 * math.log(order)) / (2.0 * math.pi), math.sqrt(1.0 / 12.0))
        for j in np.flatnonzero(seen):
            near = np.exp(-0.5 * np.minimum(((peaks[j] - onsets) / width) ** 2, 1400.0)) + 1e-300
            near /= near.sum()
            count = 1.0 / float((near**2).sum())
            along = max(silverman(max(count, 2.0)) * spread * length, 1e-6 * length)
            away = positions[j] - places[:, None] + length * IMAGES
            kernel = np.exp(-0.5 * (away / along) ** 2).sum(axis=1)
            density = float(near @ kernel) / (along * math.sqrt(2.0 * math.pi))
            result[node, j] = math.log(0.99 * density + 0.01 / length)
    return result

"""From draws to profiles: one inverse transform and one table look-up a sample."""

from __future__ import annotations

import numpy as np

from stiction._jit import jit
from stiction._typing import Array


@jit
def gaussian_rows(draws: Array, sigma: Array, has_mean: bool, nodes: int, out: Array) -> None:
    """z(x_i) = sum_j sigma_j (A_j cos k_j x_i + B_j sin k_j x_i), one row a sample.

    Modes that the grid does not resolve are folded onto those that it does: at the nodes, mode j
    and mode n - j differ by the sign of the sine only, so the values are exact whatever the grid.
    Row by row, so that the numbers do not depend on the batch.
    """
    half = nodes // 2
    spectrum = np.empty(half + 1, dtype=np.complex128)
    start = 1 if has_mean else 0
    for row in range(draws.shape[0]):
        spectrum[:] = 0.0
        for j in range(1 - start, sigma.size):
            if j == 0:
                spectrum[0] += nodes * sigma[0] * draws[row, 0]
                continue
            a = sigma[j] * draws[row, start + 2 * (j - 1)]
            b = sigma[j] * draws[row, start + 2 * (j - 1) + 1]
            m = j if j < nodes else j % nodes
            if m == 0 or m == half:
                spectrum[m] += nodes * a  # the sine vanishes at every node
            elif m < half:
                spectrum[m] += 0.5 * nodes * complex(a, -b)
            else:
                spectrum[nodes - m] += 0.5 * nodes * complex(a, b)
        out[row] = np.fft.irfft(spectrum, nodes)

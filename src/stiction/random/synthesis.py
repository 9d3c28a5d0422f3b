"""From draws to profiles: one inverse transform and one table look-up a sample."""

from __future__ import annotations

import numpy as np

from stiction.arrays import Array, inverse_transform
from stiction.jit import jit


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


@jit
def _plane_spectrum(
    draws: Array, sigma: Array, numbers: Array, has_mean: bool, columns: int, out: Array
) -> None:
    """Real Fourier transform of one sample of a plane with `columns` nodes along y.

    Mode (jx, jy) is e^(i k.x) with amplitude (A - i B)/2 and its conjugate at -k. Of both, those
    in the half of wave vectors that a real transform holds are added; in its first and last
    column it holds both. Modes that the grid does not resolve are folded.
    """
    nx, half = out.shape[0], columns // 2
    scale = 0.5 * nx * columns
    out[:] = 0.0
    start = 1 if has_mean else 0
    if has_mean:
        out[0, 0] = 2.0 * scale * sigma[0] * draws[0]
    for m in range(1, sigma.size):
        a = scale * sigma[m] * draws[start + 2 * (m - 1)]
        b = scale * sigma[m] * draws[start + 2 * (m - 1) + 1]
        p, q = numbers[0, m] % nx, numbers[1, m] % columns
        if q <= half:
            out[p, q] += complex(a, -b)
        if q == 0 or q >= half:
            out[-p % nx, -q % columns] += complex(a, b)


def gaussian_planes(
    draws: Array, sigma: Array, numbers: Array, has_mean: bool, shape: tuple[int, ...]
) -> Array:
    """z(x) = sum_m sigma_m (A_m cos k_m.x + B_m sin k_m.x), shape (samples, *shape).

    Parameters
    ----------
    draws : (samples, dimension) array
    sigma : (modes + 1,) array
    numbers : (2, modes + 1) array of int
        Wave vectors in units of 2 pi/length.
    has_mean : bool
    shape : (int, int)
        Nodes along x and y.
    """
    spectrum = np.empty((shape[0], shape[1] // 2 + 1), dtype=np.complex128)
    z = np.empty((draws.shape[0], *shape))
    for one, row in zip(z, draws, strict=True):
        _plane_spectrum(row, sigma, numbers, has_mean, shape[1], spectrum)
        one[:] = inverse_transform(spectrum, shape)
    return z

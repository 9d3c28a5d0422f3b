"""The static stiffness K of a plane between two half-spaces, applied by fast Fourier transform.

Slip has one component, along x, the direction of the load. With wave vector (kx, ky) of length k,

    K(k) = (G / 2k) (kx^2/(1 - nu) + ky^2),

mode II along x and mode III along y (Geubelle and Rice 1995). Two choices of k on a grid of
spacing h: *spectral*, k = 2 pi j/L, which converges fastest for smooth strengths and equals the
line for strengths that depend on one coordinate; *lattice*, k = (2/h) sin(pi j/n), whose
off-diagonal entries are all negative up to a Poisson's ratio of 0.45: K - W is then a Z-matrix.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rocket_fft import c2c, c2r, r2c

from stiction.arrays import Array
from stiction.jit import jit


def stiffness_symbol(
    shape: tuple[int, int],
    lengths: tuple[float, float],
    shear_modulus: float,
    poisson_ratio: float,
    wavenumbers: Literal["spectral", "lattice"] = "spectral",
) -> Array:
    """K(k) for the modes of ``numpy.fft.rfft2``, shape (nx, ny // 2 + 1), Pa/m.

    Parameters
    ----------
    shape : (int, int)
        Nodes along x (direction of slip) and y.
    lengths : (float, float)
        Periods along x and y, m.
    shear_modulus, poisson_ratio : float
        G (Pa) and nu.
    wavenumbers : {"spectral", "lattice"}
    """
    (nx, ny), (length_x, length_y) = shape, lengths
    kx = 2.0 * np.pi * np.fft.fftfreq(nx, length_x / nx)[:, None]
    ky = 2.0 * np.pi * np.fft.rfftfreq(ny, length_y / ny)[None, :]
    if wavenumbers == "lattice":
        kx = 2.0 * nx / length_x * np.sin(0.5 * kx * length_x / nx)
        ky = 2.0 * ny / length_y * np.sin(0.5 * ky * length_y / ny)
    k = np.hypot(kx, ky)
    k[0, 0] = 1.0  # both terms are zero there
    symbol: Array = 0.5 * shear_modulus * (kx**2 / (1.0 - poisson_ratio) + ky**2) / k
    return symbol


class Operator(NamedTuple):
    """K - W on a plane, an approximate inverse and a workspace for transforms; not for two threads.

    Attributes
    ----------
    symbol : (nx, ny // 2 + 1) array
        K(k), Pa/m.
    inverse : (nx, ny // 2 + 1) array
        1/(K(k) + W/2) with the mean W.
    rate : (nx, ny) array
        W, Pa/m, zero where the residual strength is reached.
    spectrum : (nx, ny // 2 + 1) complex array
        Overwritten by each transform.
    both, first, second : int arrays
        Axes of transforms.
    """

    symbol: Array
    inverse: Array
    rate: Array
    spectrum: NDArray[np.complex128]
    both: NDArray[np.int64]
    first: NDArray[np.int64]
    second: NDArray[np.int64]


def make_operator(symbol: Array, rate: Array | float, shape: tuple[int, int]) -> Operator:
    """The operator for a stiffness and a weakening rate (Pa/m), scalar or (nx, ny)."""
    rates = np.ascontiguousarray(np.broadcast_to(np.asarray(rate, dtype=np.float64), shape))
    typical = float(rates[rates > 0.0].mean()) if (rates > 0.0).any() else float(symbol.max())
    return Operator(
        symbol,
        1.0 / (symbol + 0.5 * typical),
        rates,
        np.empty(symbol.shape, dtype=np.complex128),
        np.array([0, 1]),
        np.array([0]),
        np.array([1]),
    )


@jit
def filtered(operator: Operator, multiplier: Array, field: Array, out: Array) -> None:
    """`out` = the field with its Fourier modes multiplied, without allocating."""
    spectrum = operator.spectrum
    r2c(field, spectrum, operator.both, True, 1.0, 1)
    modes = spectrum.reshape(-1)
    factors = multiplier.reshape(-1)
    for i in range(modes.size):
        modes[i] *= factors[i]
    c2c(spectrum, spectrum, operator.first, False, 1.0, 1)
    c2r(spectrum, out, operator.second, False, 1.0 / field.size, 1)


@jit
def product(operator: Operator, field: Array, out: Array) -> None:
    """`out` = (K - W) field at every node."""
    filtered(operator, operator.symbol, field, out)
    values, source, rate = out.reshape(-1), field.reshape(-1), operator.rate.reshape(-1)
    for i in range(values.size):
        values[i] -= rate[i] * source[i]

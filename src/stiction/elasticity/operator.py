"""K - W of an interface by fast Fourier transform, inside compiled kernels and without allocating.

K is given by its symbol (`half_spaces`). Kernels take flat arrays, so that the same code serves
lines and planes.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rocket_fft import c2c, c2r, r2c

from stiction.base.arrays import Array
from stiction.base.jit import jit, jit_inside


class Transform(NamedTuple):
    """Shapes and axes of the transform of an interface; read-only, shared by threads."""

    shape: tuple[int, int]  # of a profile; (1, nodes) on a line: one kernel serves both
    half: tuple[int, int]  # of its real transform
    every: NDArray[np.int64]  # axes that are transformed; of a line counted on flat arrays
    first: NDArray[np.int64]  # all but the last of them
    last: NDArray[np.int64]


def make_transform(shape: tuple[int, ...]) -> Transform:
    """Return the transform of profiles of this shape."""
    rows, columns = shape if len(shape) == 2 else (1, *shape)
    axes = np.arange(len(shape))
    return Transform((rows, columns), (rows, columns // 2 + 1), axes, axes[:-1], axes[-1:])


@jit_inside
def forward(transform: Transform, field: Array, spectrum: Array) -> None:
    """`spectrum` = the unscaled transform of a field; both flat."""
    if transform.first.size == 0:  # rows of one are a fifth slower than flat arrays
        r2c(field, spectrum, transform.every, True, 1.0, 1)
    else:
        modes = spectrum.reshape(transform.half)
        r2c(field.reshape(transform.shape), modes, transform.every, True, 1.0, 1)


@jit_inside
def backward(transform: Transform, spectrum: Array, field: Array) -> None:
    """`field` = the inverse transform of a spectrum, which is overwritten; both flat."""
    if transform.first.size == 0:
        c2r(spectrum, field, transform.last, False, 1.0 / field.size, 1)
    else:
        modes = spectrum.reshape(transform.half)
        c2c(modes, modes, transform.first, False, 1.0, 1)
        c2r(modes, field.reshape(transform.shape), transform.last, False, 1.0 / field.size, 1)


@jit_inside
def convolve(
    transform: Transform, multiplier: Array, field: Array, spectrum: Array, out: Array
) -> None:
    """`out` = a field with its Fourier modes multiplied; all flat; spectrum is a workspace."""
    forward(transform, field, spectrum)
    for i in range(spectrum.size):
        spectrum[i] *= multiplier[i]
    backward(transform, spectrum, out)


class Operator(NamedTuple):
    """K - W of an interface, an approximate inverse and a workspace; for one thread at a time."""

    transform: Transform
    symbol: Array  # (modes,): K(k), Pa/m
    inverse: Array  # (modes,): 1/(K(k) + W/2) with the mean W
    rate: Array  # (nodes,): W, Pa/m, zero where the residual strength is reached
    spectrum: NDArray[np.complex128]  # (modes,): overwritten by each transform
    slow: Array  # (nodes,): y with y^T (K - W) y about 1 that the inverse lacks, or empty


def make_operator(symbol: Array, rate: Array | float, shape: tuple[int, ...]) -> Operator:
    """Return the operator for a stiffness and a weakening rate (Pa/m), scalar or on the nodes."""
    rates = np.broadcast_to(np.asarray(rate, dtype=np.float64), shape).flatten()
    typical = float(rates[rates > 0.0].mean()) if (rates > 0.0).any() else float(symbol.max())
    flat = symbol.flatten()
    return Operator(
        make_transform(shape),
        flat,
        1.0 / (flat + 0.5 * typical),
        rates,
        np.empty(flat.shape, dtype=np.complex128),
        np.empty(0),
    )


@jit
def filtered(operator: Operator, multiplier: Array, field: Array, out: Array) -> None:
    """`out` = the field with its Fourier modes multiplied."""
    convolve(operator.transform, multiplier, field, operator.spectrum, out)


@jit
def product(operator: Operator, field: Array, out: Array) -> None:
    """`out` = (K - W) field at every node."""
    filtered(operator, operator.symbol, field, out)
    rate = operator.rate
    for i in range(out.size):
        out[i] -= rate[i] * field[i]

"""Real Fourier transforms of lines and planes inside compiled kernels, without allocating."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rocket_fft import c2c, c2r, r2c

from stiction.arrays import Array
from stiction.jit import jit


class Transform(NamedTuple):
    """Shapes and axes of the transform of an interface; read-only, shared by threads.

    Attributes
    ----------
    shape : (int, int)
        Of a profile; (1, nodes) on a line, so that one compiled kernel serves both.
    half : (int, int)
        Of its real transform.
    every, first, last : int arrays
        All axes that are transformed, all but the last of them, the last; of a line counted on
        flat arrays.
    """

    shape: tuple[int, int]
    half: tuple[int, int]
    every: NDArray[np.int64]
    first: NDArray[np.int64]
    last: NDArray[np.int64]


def make_transform(shape: tuple[int, ...]) -> Transform:
    """The transform of profiles of this shape."""
    rows, columns = shape if len(shape) == 2 else (1, *shape)
    axes = np.arange(len(shape))
    return Transform((rows, columns), (rows, columns // 2 + 1), axes, axes[:-1], axes[-1:])


@jit
def forward(transform: Transform, field: Array, spectrum: Array) -> None:
    """`spectrum` = the unscaled transform of a field; both flat."""
    if transform.first.size == 0:  # rows of one are a fifth slower than flat arrays
        r2c(field, spectrum, transform.every, True, 1.0, 1)
    else:
        modes = spectrum.reshape(transform.half)
        r2c(field.reshape(transform.shape), modes, transform.every, True, 1.0, 1)


@jit
def backward(transform: Transform, spectrum: Array, field: Array) -> None:
    """`field` = the inverse transform of a spectrum, which is overwritten; both flat."""
    if transform.first.size == 0:
        c2r(spectrum, field, transform.last, False, 1.0 / field.size, 1)
    else:
        modes = spectrum.reshape(transform.half)
        c2c(modes, modes, transform.first, False, 1.0, 1)
        c2r(modes, field.reshape(transform.shape), transform.last, False, 1.0 / field.size, 1)

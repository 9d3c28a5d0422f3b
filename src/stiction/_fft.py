"""Real Fourier transforms over the last axes, the only place that calls a library for them.

Inside compiled kernels numba takes ``np.fft`` from rocket-fft, which is loaded when numba is.
"""

from __future__ import annotations

import numpy as np

from stiction._typing import Array


def transform(profiles: Array, dimensions: int) -> Array:
    """Unscaled real transform over the last one or two axes.

    Row by row of the other axes, so that the numbers do not depend on the batch.
    """
    if dimensions == 1:
        return np.fft.rfft(profiles)
    return np.fft.rfft2(profiles)


def inverse_transform(spectra: Array, shape: tuple[int, ...]) -> Array:
    """The inverse of `transform` for profiles of the given shape."""
    if len(shape) == 1:
        return np.fft.irfft(spectra, shape[0])
    return np.fft.irfft2(spectra, shape)

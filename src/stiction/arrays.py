"""Arrays: their type, real Fourier transforms row by row, and BLAS with one thread.

Inside compiled kernels numba takes ``np.fft`` from rocket-fft, which is loaded when numba is.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[Any]
"""Array of floats, double precision unless said otherwise."""


def transform(profiles: Array, dimensions: int) -> Array:
    """Return the unscaled real transform over the last one or two axes.

    Row by row of the other axes, so that the numbers do not depend on the batch.
    """
    if dimensions == 1:
        return np.fft.rfft(profiles)
    return np.fft.rfft2(profiles)


def inverse_transform(spectra: Array, shape: tuple[int, ...]) -> Array:
    """Return the inverse of `transform` for profiles of the given shape."""
    if len(shape) == 1:
        return np.fft.irfft(spectra, shape[0])
    return np.fft.irfft2(spectra, shape)


_lock = threading.Lock()
_users = 0
_limit: Any = None


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS at one thread from the first user's entry to the last user's exit.

    The number of threads belongs to the process: of two overlapping limits, the one that ends last
    would otherwise restore what the other one had set.
    """
    global _users, _limit
    from threadpoolctl import threadpool_limits

    with _lock:
        if not _users:
            _limit = threadpool_limits(limits=1, user_api="blas")
        _users += 1
    try:
        yield
    finally:
        with _lock:
            _users -= 1
            if not _users and _limit is not None:
                _limit.restore_original_limits()
                _limit = None

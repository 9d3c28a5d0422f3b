"""Fitted kernels on disk: built once a machine, safe if several processes build at once."""

import hashlib
import logging
from functools import cache
from pathlib import Path

import numpy as np

from stiction.elasticity.exponential_sum import ExponentialSum, fit_exponentials
from stiction.errors import StoreError
from stiction.files import UNREADABLE, cache_folder, read_arrays, write_arrays

logger = logging.getLogger("stiction")

_FORMAT = 2  # raise when the fit or the file layout changes, so that old files are left alone


def kernel_sum(
    mode: str, eta: float, tolerance: float = 1e-6, t_max: float = 1e5
) -> ExponentialSum:
    """Return the validated sum of exponentials, from memory, from disk, or built now (about 1 s).

    Parameters and errors as in `fit_exponentials`. Two processes that build the same kernel
    at once both succeed: each writes aside and renames.
    """
    return stored_kernel(
        mode, 1.0 if mode == "III" else float(eta), float(tolerance), float(t_max)
    )


@cache
def stored_kernel(mode: str, eta: float, tolerance: float, t_max: float) -> ExponentialSum:
    """Return the same for arguments in one form, and keep it in memory."""
    text = f"{_FORMAT} {mode} {eta.hex()} {tolerance.hex()} {t_max.hex()}"
    path = cache_folder() / f"kernel-{hashlib.sha256(text.encode()).hexdigest()[:20]}.npz"
    kernel = _read(path)
    if kernel is None:
        kernel = fit_exponentials(mode, eta, tolerance, t_max)
        try:
            write_arrays(path, vars(kernel))
        except StoreError as error:
            logger.info("cannot write the kernel cache (%s); kernels stay in memory", error)
    return kernel


def _read(path: Path) -> ExponentialSum | None:
    try:
        data = read_arrays(path)
        poles, weights = data["poles"], data["weights"]
        kernel = ExponentialSum(poles, weights, float(data["error"]), float(data["t_max"]))
        whole = poles.dtype == weights.dtype == np.complex128 and poles.shape == weights.shape
        return kernel if whole and poles.ndim == 1 and np.all(poles.real < 0.0) else None
    except (*UNREADABLE, TypeError):
        return None  # not there, or damaged: it is built and written again

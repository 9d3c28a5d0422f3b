"""Fitted kernels on disk: built once a machine, safe if several processes build at once."""

from __future__ import annotations

import hashlib
import logging
import threading
from pathlib import Path

import numpy as np

from stiction.elasticity.exponential_sum import ExponentialSum, fit_exponentials
from stiction.files import UNREADABLE, cache_folder, read_arrays, write_arrays

logger = logging.getLogger("stiction")

_FORMAT = 2  # raise when the fit or the file layout changes, so that old files are left alone
_Key = tuple[str, float, float, float]


def _path(key: _Key) -> Path:
    mode, eta, tolerance, t_max = key
    text = f"{_FORMAT} {mode} {eta.hex()} {tolerance.hex()} {t_max.hex()}"
    return cache_folder() / f"kernel-{hashlib.sha256(text.encode()).hexdigest()[:20]}.npz"


def _read(path: Path) -> ExponentialSum | None:
    try:
        data = read_arrays(path)
        poles, weights = data["poles"], data["weights"]
        kernel = ExponentialSum(poles, weights, float(data["error"]), float(data["t_max"]))
        whole = poles.dtype == weights.dtype == np.complex128 and poles.shape == weights.shape
        return kernel if whole and poles.ndim == 1 and np.all(poles.real < 0.0) else None
    except (*UNREADABLE, TypeError):
        return None  # not there, or damaged: it is built and written again


class KernelCache:
    """Kernels of one process: in memory, beneath that on disk."""

    def __init__(self) -> None:
        self._memory: dict[_Key, ExponentialSum] = {}
        self._lock = threading.Lock()
        self._said = False

    def kernel_sum(
        self, mode: str, eta: float, tolerance: float = 1e-6, t_max: float = 1e5
    ) -> ExponentialSum:
        """The validated sum of exponentials, from memory, from disk, or built now (about 1 s).

        Parameters and errors as in `fit_exponentials`. Two processes that build the same kernel at
        once both succeed: each writes aside and renames.
        """
        key = (mode, 1.0 if mode == "III" else float(eta), float(tolerance), float(t_max))
        with self._lock:
            kernel = self._memory.get(key)
            if kernel is None:
                path = _path(key)
                kernel = _read(path)
                if kernel is None:
                    kernel = fit_exponentials(*key)
                    self._write(path, kernel)
                self._memory[key] = kernel
            return kernel

    def _write(self, path: Path, kernel: ExponentialSum) -> None:
        try:
            write_arrays(path, vars(kernel))
        except OSError as error:
            if not self._said:
                self._said = True
                logger.info("cannot write the kernel cache (%s); kernels stay in memory", error)


kernel_sum = KernelCache().kernel_sum

"""The one decorator for compiled kernels."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numba.core import event

logger = logging.getLogger("stiction")
Kernel = TypeVar("Kernel", bound=Callable[..., Any])


class _FirstCompilation(event.Listener):
    """Says once that kernels are being compiled, so that a first run does not look hung."""

    def __init__(self) -> None:
        self.said = False

    def on_start(self, event: event.Event) -> None:
        dispatcher = (event.data or {}).get("dispatcher")
        function = getattr(dispatcher, "py_func", None)
        ours = getattr(function, "__module__", "").startswith("stiction.")
        if ours and not self.said:
            self.said = True
            logger.warning("compiling kernels on first use (up to 20 s, then cached)")

    def on_end(self, event: event.Event) -> None:
        pass


event.register("numba:compile", _FirstCompilation())


def jit(function: Kernel) -> Kernel:
    """Compile for one thread, without the interpreter lock, cached on disk where that is possible.

    No ``parallel=True`` (forking after an OpenMP region aborts) and no fast-math: the same
    numbers must come out whatever the batch.
    """
    options = {"nogil": True, "error_model": "numpy"}
    try:
        compiled: Any = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # numba finds no folder in which it may write its cache
        compiled = numba.njit(**options)(function)
    result: Kernel = compiled
    return result

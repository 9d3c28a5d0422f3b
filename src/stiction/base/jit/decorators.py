"""The decorators for compiled kernels."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np

from stiction.base.jit.folder import kernel_folder

internals: Any = None
with contextlib.suppress(Exception):  # it was deleted, or numba is not one that was tried
    import stiction.base.jit.internals as internals

logger = logging.getLogger("stiction")

ZERO: Any = np.int64(0)
"""A zero that is not a literal: numba compiles a kernel again for each literal it is given."""

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

_ANYWHERE: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
_one_at_a_time = threading.Lock()
_announced: set[str] = set()


def _is_own(kind: Any) -> bool:
    """Whether a numba type, or a tuple of them, names no class from outside the package."""
    if isinstance(kind, tuple | list):
        return all(map(_is_own, kind))
    named = getattr(kind, "instance_class", None)
    if named is not None and not named.__module__.startswith("stiction."):
        return False
    return _is_own(getattr(kind, "types", ()))


class _Guard:
    """A cache that keeps only what is compiled for types of this package.

    A friction law from elsewhere is part of the kernels that are compiled for it. numba would not
    notice that the law was edited, and could not read its index where the law's module is missing.
    """

    def __init__(self, cache: Any, function: Callable[..., Any]) -> None:
        self._cache, self._load, self._save = cache, cache.load_overload, cache.save_overload
        self._part = function.__module__.split(".")[-2:-1]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._cache, name)

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return the compiled form for types of arguments; None if none is kept."""
        own = _is_own(signature)
        found = self._load(signature, target) if own else None
        if found is None:
            _announce(self._part, own)
        return found

    def save_overload(self, signature: Any, data: Any) -> None:
        """Keep a compiled form."""
        if _is_own(signature):
            self._save(signature, data)


def _announce(part: list[str], own: bool) -> None:
    """State once for each part of the package that its kernels are being compiled."""
    when = "on first use only, then cached" if own else "for your friction law; not cached"
    for text in {f"{name} ({when})" for name in part} - _announced:
        _announced.add(text)
        logger.warning("compiling kernels: %s", text)


def _compile(function: Kernel, options: str) -> Kernel:
    """Compile on first call, cached on disk where that is possible."""
    if internals is None:
        return _plain(function)
    compiled: Any = numba.njit(**_ANYWHERE, **getattr(internals, options))(function)
    with contextlib.suppress(RuntimeError):  # numba finds no folder in which it may write
        compiled._cache = _Guard(internals.Cache(function), function)
    result: Kernel = compiled
    return result


def _plain(function: Any) -> Any:
    """Compile with what numba documents, and `_cache` if there is one."""
    with _one_at_a_time:
        kept = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(kernel_folder(function.__module__, "plain"))
        try:
            compiled = numba.njit(**_ANYWHERE, cache=True)(function)
            compiled._cache = _Guard(compiled._cache, function)
            return compiled
        except (RuntimeError, AttributeError, TypeError):  # no folder, or no such cache
            return numba.njit(**_ANYWHERE)(function)
        finally:
            numba.config.CACHE_DIR = kept


def jit(function: Kernel) -> Kernel:
    """Compile for one thread, without the interpreter lock.

    No ``parallel=True`` (forking after an OpenMP region aborts) and no fast-math: the same
    numbers must come out whatever the batch.
    """
    return _compile(function, "OPTIONS")


def jit_allocating(function: Kernel) -> Kernel:
    """Compile a kernel that makes arrays."""
    return _compile(function, "ALLOCATING")


def jit_inside(function: Kernel) -> Kernel:
    """Compile what only other kernels call, in half the time: Python itself cannot call it."""
    return _compile(function, "INSIDE")

"""The decorator for sums of products: compiled with a free order of summation.

A dot product runs some ten times faster if the compiler may sum in vector lanes. The order is
fixed once compiled and depends on the length alone, so results still do not depend on the batch.
Everything that is not a plain sum of products uses `stiction._jit.jit`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np

ZERO: Any = np.int64(0)
"""A zero that is not a literal: numba compiles a kernel again for each literal it is given."""

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def jit_sums(function: Kernel) -> Kernel:
    """Compile without the interpreter lock, allowing sums to be reordered and fused."""
    options = {
        "nogil": True,
        "error_model": "numpy",
        "fastmath": {"reassoc", "contract", "nsz"},
    }
    try:
        compiled: Any = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # numba finds no folder in which it may write its cache
        compiled = numba.njit(**options)(function)
    result: Kernel = compiled
    return result

"""Compiled kernels: decorators, and the use of numba's private parts."""

import os

if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
    raise ImportError("Kernels must be compiled. Unset NUMBA_DISABLE_JIT")

from stiction.base.jit.decorators import ZERO as ZERO
from stiction.base.jit.decorators import jit as jit
from stiction.base.jit.decorators import jit_allocating as jit_allocating
from stiction.base.jit.decorators import jit_inside as jit_inside

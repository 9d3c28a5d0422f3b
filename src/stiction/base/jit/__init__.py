"""Compiled kernels: decorators, and the use of numba's private parts."""

import os

if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
    raise ImportError("NUMBA_DISABLE_JIT is set, but kernels must be compiled. Unset it")

from stiction.base.jit.decorators import ZERO as ZERO
from stiction.base.jit.decorators import jit as jit
from stiction.base.jit.decorators import jit_allocating as jit_allocating
from stiction.base.jit.decorators import jit_inside as jit_inside

"""Compiled kernels: decorators, use of numba's private parts, and the folder of compiled code."""

from stiction.base.jit.decorators import ZERO as ZERO
from stiction.base.jit.decorators import jit as jit
from stiction.base.jit.decorators import jit_allocating as jit_allocating
from stiction.base.jit.decorators import jit_inside as jit_inside

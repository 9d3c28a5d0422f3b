"""Compiled kernels: decorators, and the use of numba's private parts."""

from stiction.base.jit.decorators import ZERO as ZERO
from stiction.base.jit.decorators import jit as jit
from stiction.base.jit.decorators import jit_allocating as jit_allocating
from stiction.base.jit.decorators import jit_inside as jit_inside

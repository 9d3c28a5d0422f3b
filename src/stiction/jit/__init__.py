"""Compiled kernels: the decorators, numba's private parts, and the folder of what is compiled."""

from stiction.jit.decorators import ZERO as ZERO
from stiction.jit.decorators import jit as jit
from stiction.jit.decorators import jit_allocating as jit_allocating
from stiction.jit.decorators import jit_inside as jit_inside

"""What kernels are given of a friction law, and the table of the functions that evaluate it."""

from collections.abc import Callable
from typing import Any, NamedTuple

from stiction.arrays import Array

SMALLEST_EIGENVALUE = 0.5788869418506
"""lambda_0 in the nucleation length h_n = 2 lambda_0 G*/W (Uenishi and Rice, 2003)."""


class Linear(NamedTuple):
    """The linear law needs no numbers but those of the sample."""


class Exponential(NamedTuple):
    """The exponential law needs no numbers but those of the sample."""


class Polygon(NamedTuple):
    """Corners of f: slip u in units of d_c, from 0 to 1, and f there, from 1 to 0."""

    slip: Array
    fraction: Array


FUNCTIONS: dict[type, tuple[Callable[..., Any], ...]] = {}
"""Strength, slope and line by type of parameters; see `stiction.friction.kernels.register`."""

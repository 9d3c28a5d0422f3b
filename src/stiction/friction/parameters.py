"""Parameters of friction laws for kernels, and the functions f by the type of the parameters."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from stiction.arrays import Array

SMALLEST_EIGENVALUE = 0.5788869418506
"""lambda_0 in the nucleation length h_n = 2 lambda_0 G*/W (Uenishi and Rice, 2003)."""

Shape = Callable[[Any, float], tuple[float, float]]
SHAPES: dict[type, Shape] = {}
"""f and -f' at a slip u in units of d_c, by the type of a law's parameters."""


def register(parameters: type, shape: Shape) -> None:
    """Register the function f of laws with parameters of a type.

    Parameters
    ----------
    parameters : NamedTuple class
        One of its fields is `initial_slope`, -f'(0).
    shape : function (parameters, u) -> (float, float)
        f(u) and -f'(u) at a slip u >= 0 in units of d_c, in plain Python that numba compiles.
    """
    SHAPES[parameters] = shape


class Linear(NamedTuple):
    """The linear law needs no numbers but those of the sample."""

    initial_slope: float = 1.0


class Exponential(NamedTuple):
    """The exponential law needs no numbers but those of the sample."""

    initial_slope: float = 1.0


class Polygon(NamedTuple):
    """Corners of f: slip u in units of d_c, from 0 to 1, and f there, from 1 to 0."""

    slip: Array
    fraction: Array
    initial_slope: float


def _linear(law: Linear, u: float) -> tuple[float, float]:
    return (1.0 - u, 1.0) if u < 1.0 else (0.0, 0.0)


def _exponential(law: Exponential, u: float) -> tuple[float, float]:
    left = math.exp(-u)
    return left, left


def _polygon(law: Polygon, u: float) -> tuple[float, float]:
    piece, last = 0, law.slip.shape[0] - 1
    while piece < last and u >= law.slip[piece + 1]:
        piece += 1
    if piece == last:
        return 0.0, 0.0
    fall = law.fraction[piece] - law.fraction[piece + 1]
    slope = fall / (law.slip[piece + 1] - law.slip[piece])
    return law.fraction[piece] - slope * (u - law.slip[piece]), slope


register(Linear, _linear)
register(Exponential, _exponential)
register(Polygon, _polygon)

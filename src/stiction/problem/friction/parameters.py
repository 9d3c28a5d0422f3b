"""Parameters of friction laws for kernels: NamedTuples that also define the function f."""

import math
from typing import NamedTuple, Protocol

from stiction.base.arrays import Array


class Parameters(Protocol):
    """Parameters of a law in kernels.

    Each law has its own NamedTuple with these members.
    """

    @property
    def initial_slope(self) -> float:
        """Slope -f'(0), positive: a field of the NamedTuple."""

    def f(self, u: float) -> tuple[float, float]:
        """Return f(u) and -f'(u) at a slip u >= 0 over d_c.

        Numba compiles this method.
        """


class Linear(NamedTuple):
    """Parameters of the linear law, which needs only the profiles of a sample."""

    initial_slope: float = 1.0

    def f(self, u: float) -> tuple[float, float]:
        """Return 1 - u and its slope, down to 0.

        >>> Linear().f(0.25), Linear().f(1.0), Linear().f(3.0)
        ((0.75, 1.0), (0.0, 0.0), (0.0, 0.0))
        """
        return (1.0 - u, 1.0) if u < 1.0 else (0.0, 0.0)


class Exponential(NamedTuple):
    """Parameters of the exponential law, which needs only the profiles of a sample."""

    initial_slope: float = 1.0

    def f(self, u: float) -> tuple[float, float]:
        """Return exp(-u), which is also the slope.

        >>> [round(number, 9) for number in Exponential().f(math.log(4.0))]
        [0.25, 0.25]
        """
        left = math.exp(-u)
        return left, left


class Polygon(NamedTuple):
    """Corners of f: the slip u over d_c rises from 0 to 1, and f falls from 1 to 0."""

    slip: Array
    fraction: Array
    initial_slope: float

    def f(self, u: float) -> tuple[float, float]:
        """Return f and -f' by linear interpolation. A corner belongs to the piece behind it.

        >>> import numpy as np
        >>> polygon = Polygon(np.array([0.0, 0.5, 1.0]), np.array([1.0, 0.75, 0.0]), 0.5)
        >>> for u in (0.25, 0.5, 0.75, 1.0, 3.0):
        ...     print(*map(float, polygon.f(u)))
        0.875 0.5
        0.75 1.5
        0.375 1.5
        0.0 0.0
        0.0 0.0
        """
        piece, last = 0, self.slip.shape[0] - 1
        while piece < last and u >= self.slip[piece + 1]:
            piece += 1
        if piece == last:
            return 0.0, 0.0
        fall = self.fraction[piece] - self.fraction[piece + 1]
        slope = fall / (self.slip[piece + 1] - self.slip[piece])
        return self.fraction[piece] - slope * (u - self.slip[piece]), slope

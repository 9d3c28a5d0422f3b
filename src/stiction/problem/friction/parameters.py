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
        return (1.0 - u, 1.0) if u < 1.0 else (0.0, 0.0)


class Exponential(NamedTuple):
    """Parameters of the exponential law, which needs only the profiles of a sample."""

    initial_slope: float = 1.0

    def f(self, u: float) -> tuple[float, float]:
        left = math.exp(-u)
        return left, left


class Polygon(NamedTuple):
    """Corners of f: the slip u over d_c rises from 0 to 1, and f falls from 1 to 0."""

    slip: Array
    fraction: Array
    initial_slope: float

    def f(self, u: float) -> tuple[float, float]:
        piece, last = 0, self.slip.shape[0] - 1
        while piece < last and u >= self.slip[piece + 1]:
            piece += 1
        if piece == last:
            return 0.0, 0.0
        fall = self.fraction[piece] - self.fraction[piece + 1]
        slope = fall / (self.slip[piece + 1] - self.slip[piece])
        return self.fraction[piece] - slope * (u - self.slip[piece]), slope

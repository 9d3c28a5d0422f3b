"""Strength of any friction law at a slip, inside compiled kernels.

A law hands kernels its numbers as a NamedTuple of its own type, and registers functions for that
type with `register`. ``strength_at`` and ``line_at`` are resolved by the type when a kernel is
compiled, so a law costs nothing that it does not use, and another law changes no kernel.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba.extending import overload

from stiction.arrays import Array
from stiction.friction.parameters import FUNCTIONS, Exponential, Linear, Polygon
from stiction.jit import jit


def register(
    parameters: type,
    strength: Callable[..., float],
    slope: Callable[..., float],
    line: Callable[..., tuple[float, float]] | None = None,
) -> None:
    """Register the functions by which kernels evaluate laws with parameters of this type.

    Parameters
    ----------
    parameters : NamedTuple class
    strength, slope : compiled functions (law, peak, residual, rate, slip) -> float
        tau_f (Pa), and how fast it falls, -d tau_f / d slip >= 0 (Pa/m).
    line : compiled function (law, peak, residual, rate, slip, ahead) -> (float, float), optional
        See `line_at`; follows from the other two if left out.
    """
    if line is None:

        @jit
        def line(law, peak, residual, rate, slip, ahead):  # type: ignore[no-untyped-def]
            falling = slope(law, peak, residual, rate, slip + ahead)
            there = strength(law, peak, residual, rate, slip + ahead)
            return there + falling * ahead, falling

    FUNCTIONS[parameters] = (strength, slope, line)


def strength_at(law: Any, peak: float, residual: float, rate: float, slip: float) -> float:
    """Return the strength tau_f, Pa, at a slip.

    Parameters
    ----------
    law : NamedTuple
        ``friction.parameters`` of the problem.
    peak, residual, rate, slip : float
        tau_p and tau_r (Pa), the weakening rate W at zero slip (Pa/m), slip (m).
    """
    result: float = FUNCTIONS[type(law)][0](law, peak, residual, rate, slip)
    return result


def line_at(
    law: Any, peak: float, residual: float, rate: float, slip: float, ahead: float
) -> tuple[float, float]:
    """Return the straight line that the strength follows at ``slip + ahead``.

    What the line has at `slip` (Pa), and how fast it falls (Pa/m). Of a piecewise linear law it is
    the piece itself. For the parameters see `strength_at`.
    """
    result: tuple[float, float] = FUNCTIONS[type(law)][2](
        law, peak, residual, rate, slip, ahead
    )
    return result


def _registered(law: Any) -> tuple[Callable[..., Any], ...] | None:
    return FUNCTIONS.get(
        getattr(law, "instance_class", type)
    )  # of numba's types of NamedTuples


# numba compares the names of arguments with their annotations, so these have none.
@overload(strength_at)
def _strength_at(law, peak, residual, rate, slip):  # type: ignore[no-untyped-def]
    if found := _registered(law):
        function = found[0]
        return lambda law, peak, residual, rate, slip: function(law, peak, residual, rate, slip)
    return None


@overload(line_at)
def _line_at(law, peak, residual, rate, slip, ahead):  # type: ignore[no-untyped-def]
    if found := _registered(law):
        function = found[2]
        return lambda law, peak, residual, rate, slip, ahead: function(
            law, peak, residual, rate, slip, ahead
        )
    return None


@jit
def strengths(law: Any, peak: Array, residual: Array, rate: Array, slip: Array) -> Array:
    """Strength tau_f at every node, Pa; all arrays (nodes,), see `strength_at`."""
    result = np.empty(slip.size)
    for i in range(slip.size):
        result[i] = strength_at(law, peak[i], residual[i], rate[i], slip[i])
    return result


@jit
def _linear_strength(
    law: Linear, peak: float, residual: float, rate: float, slip: float
) -> float:
    return max(peak - rate * slip, residual)


@jit
def _linear_slope(law: Linear, peak: float, residual: float, rate: float, slip: float) -> float:
    return rate if peak - rate * slip > residual else 0.0


@jit
def _linear_line(
    law: Linear, peak: float, residual: float, rate: float, slip: float, ahead: float
) -> tuple[float, float]:
    if peak - rate * (slip + ahead) > residual:
        return peak - rate * slip, rate
    return residual, 0.0


@jit
def _exponential_strength(
    law: Exponential, peak: float, residual: float, rate: float, slip: float
) -> float:
    drop = peak - residual
    if drop <= 0.0:
        return residual
    return residual + drop * math.exp(-rate * slip / drop)


@jit
def _exponential_slope(
    law: Exponential, peak: float, residual: float, rate: float, slip: float
) -> float:
    drop = peak - residual
    return rate * math.exp(-rate * slip / drop) if drop > 0.0 else 0.0


@jit
def _piece(law: Polygon, u: float) -> int:
    """The piece in which a slip lies; the number of pieces beyond the last corner."""
    piece = 0
    while piece < law.slip.shape[0] - 1 and u >= law.slip[piece + 1]:
        piece += 1
    return piece


@jit
def _steepness(law: Polygon, piece: int) -> float:
    """-f' in a piece."""
    fall = law.fraction[piece] - law.fraction[piece + 1]
    return fall / (law.slip[piece + 1] - law.slip[piece])


@jit
def _polygon_strength(
    law: Polygon, peak: float, residual: float, rate: float, slip: float
) -> float:
    drop = peak - residual
    if drop <= 0.0:
        return residual
    u = rate * slip / (drop * _steepness(law, 0))
    piece = _piece(law, u)
    if piece == law.slip.shape[0] - 1:
        return residual
    f = law.fraction[piece] - _steepness(law, piece) * (u - law.slip[piece])
    return residual + drop * f


@jit
def _polygon_slope(
    law: Polygon, peak: float, residual: float, rate: float, slip: float
) -> float:
    drop = peak - residual
    if drop <= 0.0:
        return 0.0
    first = _steepness(law, 0)
    piece = _piece(law, rate * slip / (drop * first))
    return rate * _steepness(law, piece) / first if piece < law.slip.shape[0] - 1 else 0.0


register(Linear, _linear_strength, _linear_slope, _linear_line)
register(Exponential, _exponential_strength, _exponential_slope)
register(Polygon, _polygon_strength, _polygon_slope)

"""Strength of any friction law at a slip, inside compiled kernels.

A law hands kernels its numbers as a NamedTuple of its own type. ``strength_at`` and ``line_at`` are
resolved by that type when a kernel is compiled, so a law costs nothing that it does not use, and
another law changes no kernel.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba.extending import overload

from stiction.arrays import Array
from stiction.friction.parameters import SHAPES, Linear
from stiction.jit import jit

# numba compares the names of arguments with their annotations, so compiled functions have none.
# mypy: disable-error-code="no-untyped-def"


@jit
def _linear_strength(law, peak, residual, rate, slip):
    return max(peak - rate * slip, residual)


@jit
def _linear_line(law, peak, residual, rate, slip, ahead):
    if peak - rate * (slip + ahead) > residual:
        return peak - rate * slip, rate
    return residual, 0.0


@cache
def _compiled(parameters: type) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Return `strength_at` and `line_at` for laws with parameters of a type."""
    if parameters is Linear:
        return _linear_strength, _linear_line
    shape = jit(SHAPES[parameters])

    @jit
    def strength(law, peak, residual, rate, slip):
        drop = peak - residual
        if drop <= 0.0:
            return residual
        return residual + drop * shape(law, rate * slip / (drop * law.initial_slope))[0]

    @jit
    def line(law, peak, residual, rate, slip, ahead):
        drop, first = peak - residual, law.initial_slope
        if drop <= 0.0:
            return residual, 0.0
        f, steep = shape(law, rate * (slip + ahead) / (drop * first))
        falling = rate * steep / first
        return residual + drop * f + falling * ahead, falling

    return strength, line


def strength_at(law: Any, peak: float, residual: float, rate: float, slip: float) -> float:
    """Return the strength tau_f, Pa, at a slip.

    Parameters
    ----------
    law : NamedTuple
        ``friction.parameters`` of the problem.
    peak, residual, rate, slip : float
        tau_p and tau_r (Pa), the weakening rate W at zero slip (Pa/m), slip (m).
    """
    result: float = _compiled(law.__class__)[0](law, peak, residual, rate, slip)
    return result


def line_at(
    law: Any, peak: float, residual: float, rate: float, slip: float, ahead: float
) -> tuple[float, float]:
    """Return the straight line that the strength follows at ``slip + ahead``.

    What the line has at `slip` (Pa), and how fast it falls (Pa/m). Of a piecewise linear law it is
    the piece itself. For the parameters see `strength_at`.
    """
    start, falling = _compiled(law.__class__)[1](law, peak, residual, rate, slip, ahead)
    return start, falling


@overload(strength_at)
def _strength_at(law, peak, residual, rate, slip):
    function = _compiled(law.instance_class)[0]
    return lambda law, peak, residual, rate, slip: function(law, peak, residual, rate, slip)


@overload(line_at)
def _line_at(law, peak, residual, rate, slip, ahead):
    function = _compiled(law.instance_class)[1]
    return lambda law, peak, residual, rate, slip, ahead: function(
        law, peak, residual, rate, slip, ahead
    )


@jit
def strengths(law: Any, peak: Array, residual: Array, rate: Array, slip: Array) -> Array:
    """Strength tau_f at every node, Pa; all arrays (nodes,), see `strength_at`."""
    result = np.empty(slip.size)
    for i in range(slip.size):
        result[i] = strength_at(law, peak[i], residual[i], rate[i], slip[i])
    return result

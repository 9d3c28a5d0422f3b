"""Strength at a given slip for any friction law, inside compiled kernels.

A law passes its parameters to kernels as a NamedTuple of its own type.
When a kernel is compiled, this type selects the formula for the
strength. A new law therefore changes no kernel, and it costs only as
much as its own formula.

Example
-------
tau_p = 5 Pa falls at W = 2 Pa/m to tau_r = 1 Pa, so d_c = 2 m:

>>> [strength_at(Linear(), 5.0, 1.0, 2.0, slip) for slip in (0.0, 1.0, 2.0, 3.0)]
[5.0, 3.0, 1.0, 1.0]
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba.extending import overload

from stiction.base.arrays import Array
from stiction.base.jit import jit, jit_allocating
from stiction.problem.friction.parameters import Linear

# numba compares the names of arguments with their annotations, so
# functions by type have none.

# mypy: disable-error-code="no-untyped-def"


def _line(law: Any, *numbers: float) -> tuple[float, float]:
    """Represent the `line_at` of a law.

    The type of its parameters selects the compiled version.
    """
    raise NotImplementedError


@overload(_line)
def _line_of(law, peak, residual, weakening_rate, slip, ahead):
    return _by_type(law.instance_class)


@cache
def compiled(parameters: Any) -> Any:
    """Return the compiled f and -f' for a type of parameters."""
    return jit(parameters.f)


@cache
def _by_type(parameters: type) -> Callable[..., tuple[float, float]]:
    """Return `line_at` for a type of parameters."""

    def linear(law, peak, residual, weakening_rate, slip, ahead):
        if peak - weakening_rate * (slip + ahead) > residual:
            return peak - weakening_rate * slip, weakening_rate
        return residual, 0.0

    if parameters is Linear:
        return linear
    shape = compiled(parameters)

    def line(law, peak, residual, weakening_rate, slip, ahead):
        # u = d/d_c with d_c = -f'(0) (tau_p - tau_r)/W.
        drop, first = peak - residual, law.initial_slope
        if drop <= 0.0:
            return residual, 0.0
        f, steep = shape(law, weakening_rate * (slip + ahead) / (drop * first))
        falling = weakening_rate * steep / first
        return residual + drop * f + falling * ahead, falling

    return line


@jit
def line_at(
    law: Any, peak: float, residual: float, weakening_rate: float, slip: float, ahead: float
) -> tuple[float, float]:
    """Return the straight line that the strength follows at ``slip + ahead``.

    The line is given by its value at `slip` (Pa) and its weakening rate
    (Pa/m). For a piecewise linear law it is the piece itself.

    Parameters
    ----------
    law : NamedTuple
        ``friction.parameters`` of the problem.
    peak, residual, rate, slip, ahead : float
        tau_p and tau_r (Pa), the weakening rate W at zero slip (Pa/m),
        and slips (m).

    Examples
    --------
    The strength falls from 5 Pa at 2 Pa/m to 1 Pa:

    >>> from stiction.problem.friction.parameters import Exponential
    >>> line_at(Linear(), 5.0, 1.0, 2.0, 0.5, 1.0), line_at(Linear(), 5.0, 1.0, 2.0, 0.5, 2.0)
    ((4.0, 2.0), (1.0, 0.0))

    The tangent of 1 + 4 exp(-d/2) at d = 2 has the slope -2/e:

    >>> value, rate = line_at(Exponential(), 5.0, 1.0, 2.0, 0.5, 1.5)
    >>> round(value - (1.0 + 4.0 / np.e + 1.5 * 2.0 / np.e), 12), round(rate * np.e, 9)
    (0.0, 2.0)
    >>> line_at(Exponential(), 3.0, 3.0, 2.0, 0.5, 1.5)
    (3.0, 0.0)
    """
    return _line(law, peak, residual, weakening_rate, slip, ahead)


@jit
def strength_at(law: Any, peak: float, residual: float, W: float, slip: float) -> float:
    """Return the strength tau_f, Pa, at a slip.

    The parameters are the same as in `line_at`.
    """
    return _line(law, peak, residual, W, slip, 0.0)[0]


@jit_allocating
def strengths(law: Any, peak: Array, residual: Array, W: Array, slip: Array) -> Array:
    """Return the strength tau_f, Pa, at every node.

    Parameters of `line_at` are (nodes,) arrays.

    >>> peak, residual, W = np.array([5.0, 7.0]), np.array([1.0, 2.0]), np.array([2.0, 3.0])
    >>> strengths(Linear(), peak, residual, W, np.array([1.0, 1.5])).tolist()
    [3.0, 2.5]
    """
    result = np.empty(slip.size)
    for i in range(slip.size):
        result[i] = strength_at(law, peak[i], residual[i], W[i], slip[i])
    return result

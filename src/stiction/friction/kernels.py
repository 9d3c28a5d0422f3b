"""Strength and slope of any friction law at a slip, inside compiled kernels.

A law hands kernels its numbers as a NamedTuple of its own type, and registers two functions for
that type with `register`. ``strength_at`` and ``slope_at`` are resolved by the type when a kernel
is compiled, so a law costs nothing that it does not use, and another law changes no kernel.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from numba.extending import overload

_FUNCTIONS: dict[type, tuple[Callable[..., float], Callable[..., float]]] = {}


def register(parameters: type, strength: Callable[..., float], slope: Callable[..., float]) -> None:
    """Say how kernels evaluate the law whose parameters have this type.

    Parameters
    ----------
    parameters : NamedTuple class
    strength, slope : compiled functions (law, peak, residual, rate, slip) -> float
        tau_f (Pa), and how fast it falls, -d tau_f / d slip >= 0 (Pa/m).
    """
    _FUNCTIONS[parameters] = (strength, slope)


def _registered(law: Any, which: int) -> Callable[..., float] | None:
    kind = getattr(law, "instance_class", None)  # numba's types of NamedTuples have one
    return _FUNCTIONS[kind][which] if kind in _FUNCTIONS else None


def strength_at(law: NamedTuple, peak: float, residual: float, rate: float, slip: float) -> float:
    """Strength tau_f, Pa, at a slip.

    Parameters
    ----------
    law : NamedTuple
        ``friction.parameters`` of the problem.
    peak, residual, rate, slip : float
        tau_p and tau_r (Pa), the weakening rate W at zero slip (Pa/m), slip (m).
    """
    return _FUNCTIONS[type(law)][0](law, peak, residual, rate, slip)


def slope_at(law: NamedTuple, peak: float, residual: float, rate: float, slip: float) -> float:
    """How fast the strength falls at a slip, -d tau_f / d slip >= 0, Pa/m; see `strength_at`."""
    return _FUNCTIONS[type(law)][1](law, peak, residual, rate, slip)


# numba compares the names of arguments with their annotations, so these two have none.
@overload(strength_at)
def _strength_at(law, peak, residual, rate, slip):  # type: ignore[no-untyped-def]
    function = _registered(law, 0)
    if function is None:
        return None
    return lambda law, peak, residual, rate, slip: function(law, peak, residual, rate, slip)


@overload(slope_at)
def _slope_at(law, peak, residual, rate, slip):  # type: ignore[no-untyped-def]
    function = _registered(law, 1)
    if function is None:
        return None
    return lambda law, peak, residual, rate, slip: function(law, peak, residual, rate, slip)

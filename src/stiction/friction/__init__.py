"""Friction laws: the laws themselves, and in `kernels.py` what compiled kernels take of them."""

from stiction.friction.laws import (
    SCALES,
    ExponentialWeakening,
    Friction,
    FrictionLaw,
    LinearWeakening,
    PiecewiseWeakening,
    contradictions,
)
from stiction.friction.parameters import register

__all__ = [
    "SCALES",
    "ExponentialWeakening",
    "Friction",
    "FrictionLaw",
    "LinearWeakening",
    "PiecewiseWeakening",
    "contradictions",
    "register",
]

"""Friction laws: how strength falls with slip.

`laws.py` holds the laws, `kernels.py` the functions by which compiled kernels evaluate them and
`register` for those of others.
"""

from stiction.friction.laws import (
    SCALES,
    ExponentialWeakening,
    Friction,
    FrictionLaw,
    LinearWeakening,
    PiecewiseWeakening,
    contradictions,
)

__all__ = [
    "SCALES",
    "ExponentialWeakening",
    "Friction",
    "FrictionLaw",
    "LinearWeakening",
    "PiecewiseWeakening",
    "contradictions",
]

"""Exponential slip weakening."""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.friction.kernels import register
from stiction.friction.law import FrictionLaw
from stiction.jit import jit
from stiction.model import model


class Exponential(NamedTuple):
    """The exponential law needs no numbers but those of the sample."""


@jit
def _strength(law: Exponential, peak: float, residual: float, rate: float, slip: float) -> float:
    drop = peak - residual
    if drop <= 0.0:
        return residual
    return residual + drop * math.exp(-rate * slip / drop)


@jit
def _slope(law: Exponential, peak: float, residual: float, rate: float, slip: float) -> float:
    drop = peak - residual
    return rate * math.exp(-rate * slip / drop) if drop > 0.0 else 0.0


register(Exponential, _strength, _slope)


@model
class ExponentialWeakening(FrictionLaw):
    """Strength that decays with slip: tau_r + (tau_p - tau_r) exp(-d/d_c).

    Parameters
    ----------
    weakening_rate : float or (nodes,) array, optional
        W at zero slip, Pa/m, positive. Give one of this, `critical_slip` and `fracture_energy`.
    critical_slip : float or (nodes,) array, optional
        d_c, m, positive: slip in which the strength falls to 1/e of its way.
    residual_strength : float or (nodes,) array
        tau_r, Pa, not negative; approached and never reached.
    fracture_energy : float or (nodes,) array, optional
        Gamma = (tau_p - tau_r) d_c, J/m², positive.
    residual_ratio : float or (nodes,) array, optional
        tau_r/tau_p in [0, 1), instead of `residual_strength`.

    Raises
    ------
    InputError
        If none or several of W, d_c and Gamma are given, or a value is out of range.

    Examples
    --------
    >>> import stiction as st
    >>> law = st.ExponentialWeakening(critical_slip=1e-6)
    >>> float(law.fraction(1.0).round(4))
    0.3679
    """

    type: Literal["exponential"] = "exponential"

    @property
    def initial_slope(self) -> float:
        """-f'(0) = 1."""
        return 1.0

    @property
    def integral(self) -> float:
        """Integral of f: 1."""
        return 1.0

    def fraction(self, u: Any) -> Array:
        """f(u) = exp(-u)."""
        return np.exp(-np.asarray(u, dtype=np.float64))

    def area(self, u: Any) -> Array:
        """1 - exp(-u)."""
        return -np.expm1(-np.asarray(u, dtype=np.float64))

    def slip_at(self, fraction: float) -> float:
        """u = -ln f."""
        return -math.log(fraction) if fraction > 0.0 else math.inf

    @property
    def parameters(self) -> Exponential:
        """For kernels."""
        return Exponential()

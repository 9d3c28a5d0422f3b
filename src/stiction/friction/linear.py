"""Linear slip weakening."""

from __future__ import annotations

from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.friction.kernels import register
from stiction.friction.law import FrictionLaw
from stiction.jit import jit
from stiction.model import model


class Linear(NamedTuple):
    """The linear law needs no numbers but those of the sample."""


@jit
def _strength(law: Linear, peak: float, residual: float, rate: float, slip: float) -> float:
    return max(peak - rate * slip, residual)


@jit
def _slope(law: Linear, peak: float, residual: float, rate: float, slip: float) -> float:
    return rate if peak - rate * slip > residual else 0.0


@jit
def _line(
    law: Linear, peak: float, residual: float, rate: float, slip: float, ahead: float
) -> tuple[float, float]:
    if peak - rate * (slip + ahead) > residual:
        return peak - rate * slip, rate
    return residual, 0.0


register(Linear, _strength, _slope, _line)


def dissipated(slip: Array, drop: Array, rate: Array) -> Array:
    """(tau_p - tau_r) d - W d^2/2 up to d_c, then (tau_p - tau_r)^2/(2 W), J/m2."""
    weakened = np.minimum(slip, drop / rate)
    energy: Array = weakened * (drop - 0.5 * rate * weakened)
    return energy


@model
class LinearWeakening(FrictionLaw):
    """Strength that falls linearly with slip: max(tau_p - W d, tau_r).

    Parameters
    ----------
    weakening_rate : float or (nodes,) array, optional
        W, Pa/m, positive. Give one of this, `critical_slip` and `fracture_energy`.
    critical_slip : float or (nodes,) array, optional
        d_c, m, positive: then W = (tau_p - tau_r)/d_c varies with the strength.
    residual_strength : float or (nodes,) array
        tau_r, Pa, not negative.
    fracture_energy : float or (nodes,) array, optional
        Gamma, J/m², positive: then W = (tau_p - tau_r)²/(2 Gamma) varies with the strength.
    residual_ratio : float or (nodes,) array, optional
        tau_r/tau_p in [0, 1), instead of `residual_strength`.

    Raises
    ------
    InputError
        If none or several of W, d_c and Gamma are given, or a value is out of range.

    Notes
    -----
    Linear slip weakening after Ida (1972) and Palmer and Rice (1973). The fracture energy is
    Gamma = (tau_p - tau_r)²/(2 W).

    Examples
    --------
    >>> import stiction as st
    >>> st.LinearWeakening(critical_slip=2e-6, residual_strength=0.4e6).scale
    ('critical_slip', 2e-06)
    """

    type: Literal["linear"] = "linear"

    linear: ClassVar[bool] = True

    @property
    def initial_slope(self) -> float:
        """-f'(0) = 1."""
        return 1.0

    @property
    def integral(self) -> float:
        """Integral of f: 1/2."""
        return 0.5

    def fraction(self, u: Any) -> Array:
        """f(u) = max(1 - u, 0)."""
        return np.maximum(1.0 - np.asarray(u, dtype=np.float64), 0.0)

    def area(self, u: Any) -> Array:
        """w - w^2/2 with w = min(u, 1)."""
        w = np.minimum(np.asarray(u, dtype=np.float64), 1.0)
        return w - 0.5 * w * w

    def slip_at(self, fraction: float) -> float:
        """u = 1 - f."""
        return 1.0 - fraction

    def dissipated(self, slip: Array, drop: Array, rate: Array) -> Array:
        """Energy dissipated above the residual strength, J/m2; see `FrictionLaw.dissipated`."""
        return dissipated(slip, drop, rate)

    @property
    def parameters(self) -> Linear:
        """For kernels."""
        return Linear()

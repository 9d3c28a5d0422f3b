"""Problems, strengths and a reference that many tests begin with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from scipy.optimize import linprog

import stiction as st

SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="strain")
RATE = 0.5e12
LENGTH = 3.46e-3
"""Nucleation length h_n of that solid at that rate, along x."""


def make_problem(
    nodes: Any = 256,
    length: Any = 0.1,
    *,
    solid: st.Solid = SOLID,
    friction: Any = None,
    load: st.Load | None = None,
    mode: Any = "II",
    **weakening: Any,
) -> st.Problem:
    """The paper's system in plane strain but for what is given; pairs make it a plane."""
    if not {"weakening_rate", "critical_slip"} & set(weakening):
        weakening["weakening_rate"] = RATE
    law = st.LinearWeakening(**weakening) if friction is None else friction
    return st.Problem(solid, st.Interface(length, nodes), law, load or st.Load(), mode)


def beta_strength(
    correlation_length: float,
    low: float = 0.66e6,
    high: float = 1.66e6,
    truncation: float | None = None,
    **options: Any,
) -> st.RandomField:
    """The paper's marginal, on other bounds perhaps, with its spectrum of another length."""
    return st.RandomField(
        st.Beta(alpha=1.5, beta=3.0, low=low, high=high),
        st.PowerLawSpectrum(correlation_length, truncation=truncation),
        **options,
    )


def smooth_noise(correlation: float, rng: np.random.Generator, shape: Any) -> Any:
    """A field on a plane between 0 and 1, with a correlation length given in nodes."""
    k = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None, :])
    waves = np.fft.rfft2(rng.standard_normal(shape)) * np.exp(-((correlation * k) ** 2))
    field = np.fft.irfft2(waves, shape)
    return (field - field.min()) / np.ptp(field)


def by_linear_programme(
    stiffness: Any, rate: Any, excess: Any, profile: Any
) -> tuple[float, Any, Any]:
    """max tau_0: (K - W) d + s - tau_0 p >= 0, d >= 0, by the simplex method of HiGHS.

    The load, its slip and its multiplier; in units that make the matrix of order one. Feasibility
    is kept to 1e-7 at worst, 1e-10 on request; the vertex is exact.
    """
    n, unit = len(stiffness), float(np.max(rate))
    matrix = (stiffness - np.diag(np.broadcast_to(rate, n))) / unit
    found = linprog(
        np.r_[np.zeros(n), -1.0],
        A_ub=np.c_[-matrix, np.broadcast_to(profile, n)],
        b_ub=excess / 1e6,
        bounds=[(0, None)] * n + [(None, None)],
        method="highs-ds",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    assert found.status == 0
    return found.x[-1] * 1e6, found.x[:-1] * 1e6 / unit, -found.ineqlin.marginals


def mode_two_stiffness(s: Any, eta: float) -> Any:
    """D(s) of mode II over wavenumber and impedance; for mpmath, s in units of k c_s."""
    shear = mpmath.sqrt(s - 1j) * mpmath.sqrt(s + 1j)
    fast = mpmath.sqrt(s - 1j * eta) * mpmath.sqrt(s + 1j * eta) / eta
    return ((2 + s * s) ** 2 - 4 * shear * fast) / (s * s * shear)


def from_laplace(transform: Callable[[Any], Any], t: float, degree: int = 90) -> float:
    """The inverse transform, to double precision."""
    with mpmath.workdps(40):
        return float(mpmath.invertlaplace(transform, t, method="talbot", degree=degree))

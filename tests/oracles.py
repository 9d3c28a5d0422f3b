"""Independent answers: dense stiffness, a linear programme, relaxation, Laplace inversion."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from scipy.optimize import linprog

import stiction as st


def symbol_of(problem: st.Problem) -> Any:
    """K of each wave by its definition, from the moduli in modes II (along x) and III."""
    stiff, soft = problem.effective_modulus, problem.solid.shear_modulus
    if len(problem.interface.shape) == 1:
        return 0.5 * stiff * problem.interface.wavenumbers
    kx, ky = problem.interface.wave_vectors
    k = np.hypot(kx, ky)
    k[0, 0] = 1.0
    return 0.5 * (stiff * kx**2 + soft * ky**2) / k


def times(symbol: Any, field: Any) -> Any:
    """K d of one field on a line or a plane."""
    return np.fft.irfftn(symbol * np.fft.rfftn(field), field.shape, range(field.ndim))


def dense(symbol: Any, shape: Any) -> Any:
    """K as a matrix, from its first column."""
    column = np.fft.irfftn(symbol, shape, range(len(shape)))
    places = (np.unravel_index(i, shape) for i in range(column.size))
    return np.array([np.roll(column, at, range(len(shape))).ravel() for at in places])


def by_linear_programme(
    stiffness: Any, weakening_rate: Any, excess: Any, profile: Any
) -> tuple[float, Any, Any]:
    """max tau_0: (K - W) d + s - tau_0 p >= 0, d >= 0, by the simplex method of HiGHS.

    The load, its slip and its multiplier; in units that make the matrix of order one. Feasibility
    is kept to 1e-7 at worst, 1e-10 on request; the vertex is exact.
    """
    n, unit = len(stiffness), float(np.max(weakening_rate))
    matrix = (stiffness - np.diag(np.broadcast_to(weakening_rate, n))) / unit
    found = linprog(
        np.r_[np.zeros(n), -1.0], A_ub=np.c_[-matrix, np.broadcast_to(profile, n)],
        b_ub=excess / 1e6, bounds=[(0, None)] * n + [(None, None)], method="highs-ds",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )  # fmt: skip
    assert found.status == 0
    return found.x[-1] * 1e6, found.x[:-1] * 1e6 / unit, -found.ineqlin.marginals


def largest_load(
    problem: st.Problem, strength: Any, weakening_rate: Any = None
) -> tuple[float, Any, Any]:
    """Load, slip and multiplier of the first instability by the linear programme."""
    symbol, load = symbol_of(problem), problem.load
    W = problem.friction.weakening_rate if weakening_rate is None else weakening_rate
    excess, profile = strength - load.initial_stress, load.profile
    flat = (np.broadcast_to(field, strength.shape).ravel() for field in (W, excess, profile))
    return by_linear_programme(dense(symbol, strength.shape), *flat)


def relaxed(
    problem: st.Problem, strength: Any, load: float, slip: Any = None, rest: float = 5e-7
) -> Any:
    """Slip of the least equilibrium at a load, or None where all nodes slide.

    Strictly local and monotone: each node slips a little until no stress is `rest` Pa above the
    strength, a function of slip.
    """
    law, symbol = problem.friction, symbol_of(problem)
    u, f = (np.r_[each] for each in (getattr(law, "slip", 1.0), getattr(law, "strength", 0.0)))
    residual = np.minimum(law.residual_strength, strength)
    drop = strength - residual
    slopes = -np.diff(f, prepend=1.0) / np.diff(u, prepend=0.0)
    first = slopes[slopes > 0.0][0]  # of the first fall
    end = law.critical_slip or first * drop / law.weakening_rate

    slip = np.zeros(strength.shape) if slip is None else slip
    step = 1.0 / np.fft.irfftn(symbol, slip.shape, range(slip.ndim)).flat[0]
    stiffness = dense(symbol, slip.shape) if slip.ndim == 1 else None  # faster than transforms
    for _ in range(200_000):
        share = slip / np.maximum(end, 1e-30)  # some nodes do not weaken
        present = residual + drop * np.interp(share, np.r_[0.0, u], np.r_[1.0, f])
        pull = times(symbol, slip) if stiffness is None else stiffness @ slip
        drive = load - pull - present
        if drive.max() < rest:
            return slip
        if (slip > end).all():
            return None
        slip = slip + step * np.maximum(drive, 0.0)
    raise AssertionError("relaxation did not come to rest")


def angle_rule(count: int) -> tuple[Any, Any]:
    """Points s = cos t of (-1, 1) and their measure; exact as the integrand is smooth in t."""
    t = (np.arange(count) + 0.5) * np.pi / count
    return np.cos(t), np.sin(t) * np.pi / count


def mode_two_stiffness(s: Any, eta: float) -> Any:
    """D(s) of mode II over wavenumber and impedance; for mpmath, s in units of k c_s."""
    shear = mode_three_stiffness(s)
    fast = mpmath.sqrt(s - 1j * eta) * mpmath.sqrt(s + 1j * eta) / eta
    return ((2 + s * s) ** 2 - 4 * shear * fast) / (s * s * shear)


def mode_three_stiffness(s: Any) -> Any:
    """D(s) of mode III in the same units."""
    return mpmath.sqrt(s - 1j) * mpmath.sqrt(s + 1j)


def from_laplace(transform: Callable[[Any], Any], t: float) -> float:
    """The inverse transform at times up to 13, to double precision: degrees 60 and 90 agree."""
    with mpmath.workdps(40):
        return float(mpmath.invertlaplace(transform, t, method="talbot", degree=60))

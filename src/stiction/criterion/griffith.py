"""Griffith's criterion under any load: where the release of energy no longer pays for a crack."""

from __future__ import annotations

from typing import Any, overload

import numpy as np

from stiction._checks import check_instance, is_finite
from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import describe, real_array
from stiction.problem import Problem

POINTS = 512
"""Gauss-Chebyshev points along the crack; smooth drops are exact to round-off."""
FINEST = 2000
"""Lengths at which a crossing is looked for."""


def energy_release_rate(
    problem: Problem, load: float, lengths: Any, *, centre: float = 0.0, strip: Any = 0.0
) -> Array:
    """Static energy release rate at both tips of a crack, by Bueckner's weight functions.

    Parameters
    ----------
    problem : Problem
        A line; its load profile, initial stress and residual strength make the stress drop
        tau_i + tau_0 p - tau_r.
    load : float
        tau_0, Pa.
    lengths : (m,) array or float
        m, between 0 and the length of the interface.
    centre : float
        Of the crack, m.
    strip : float or (nodes,) array
        Pa, taken from the drop besides.

    Returns
    -------
    (m, 2) array, J/m²
        At the left and the right tip; negative where the faces would close there.

    Raises
    ------
    InputError
        If the interface has two dimensions, a length is out of range, or a number is not finite.

    Notes
    -----
    G = K|K|/(2 G*) between identical half-spaces, K the integral of the drop times the weight of
    Bueckner (1970). The interface is periodic: u = tan(pi x/L) maps the row of collinear cracks to
    one crack, so that a uniform drop gives K = drop (L tan(pi a/L))^(1/2), a the half-length
    (Koiter, 1959). This is how Kammer et al. (2015) and Ke et al. (2018) predict the length of
    confined ruptures.
    """
    _check(problem, centre=centre, load=load)
    period = problem.interface.extent
    whole = np.atleast_1d(_numbers("lengths", lengths))
    if whole.ndim != 1 or not np.all((whole > 0.0) & (whole < period)):
        raise InputError(
            f"lengths: must be between 0 and the length of the interface, {period:g} m, got"
            f" {describe(lengths)}"
        )
    drop = _resting_stress(problem) + load * problem.load_profile - strip
    factor = _intensity_factors(problem, drop, whole, centre)
    return _release_rate(problem, factor)


def _check(problem: Any, **numbers: Any) -> None:
    """Refuse what is no line, and numbers that are not finite."""
    check_instance("problem", problem, Problem)
    problems = [
        f"{name}: must be a finite number, got {describe(value)}"
        for name, value in numbers.items()
        if not is_finite(value)
    ]
    if problem.interface.is_plane:
        problems.append("problem: must be a line; a plane has no crack of two tips")
    if problems:
        raise InputError(problems)


def _numbers(name: str, given: Any) -> Array:
    try:
        return real_array(given)
    except TypeError:
        raise InputError(f"{name}: must be numbers, got {describe(given)}") from None


def _resting_stress(problem: Problem) -> Array:
    """What the stress drop is without a load, Pa."""
    residual = problem.friction.residual_strength
    if residual is None:
        raise InputError("problem: must have a residual strength of its own, not a ratio")
    found: Array = np.asarray(problem.load.initial_stress - residual, dtype=np.float64)
    return found


def _intensity_factors(problem: Problem, drop: Array, whole: Array, centre: float) -> Array:
    """K at both tips of cracks of these lengths, Pa m^(1/2); (m, 2), linear in the drop."""
    period = problem.interface.extent
    drop = np.broadcast_to(np.asarray(drop, dtype=np.float64), problem.interface.shape)
    t = (np.arange(POINTS) + 0.5) * np.pi / POINTS
    reach = np.tan(0.5 * np.pi * whole / period)  # U
    u = reach[:, None] * np.cos(t)
    x = np.mod(centre + np.arctan(u) * period / np.pi, period)
    found = np.interp(x, problem.interface.x, drop, period=period) / (1.0 + u * u)
    # K = (L (1 + U^2) U)^(1/2)/pi times the integral of drop (1 +- cos t)/(1 + u^2) over t.
    scale = np.sqrt(period * (1.0 + reach**2) * reach)
    tips = np.stack([(found * (1.0 + side * np.cos(t))).mean(axis=1) for side in (-1.0, 1.0)])
    factor: Array = (scale * tips).T
    return factor


def _release_rate(problem: Problem, factor: Array) -> Array:
    """G = K|K|/(2 G*), J/m²."""
    rate: Array = factor * np.abs(factor) / (2.0 * problem.effective_modulus)
    return rate


@overload
def griffith_length(
    problem: Problem,
    load: float,
    fracture_energy: float,
    *,
    centre: float = ...,
    arrest: bool = ...,
) -> float: ...
@overload
def griffith_length(
    problem: Problem,
    load: Array,
    fracture_energy: float,
    *,
    centre: float = ...,
    arrest: bool = ...,
) -> Array: ...
def griffith_length(
    problem: Problem,
    load: float | Array,
    fracture_energy: float,
    *,
    centre: float = 0.0,
    arrest: bool = False,
) -> float | Array:
    """Length at which a crack begins to run, or is arrested, by Griffith's criterion.

    Parameters
    ----------
    problem : Problem
        A line, see `energy_release_rate`.
    load : float or (k,) array
        tau_0, Pa; many at once cost little more than one.
    fracture_energy : float
        Gamma, J/m², positive; for random strength its mean.
    centre : float
        m; both tips are as far from it.
    arrest : bool
        False: the shortest length from which the release rate at the tip that releases less
        exceeds Gamma. True: the next length at which it falls below again.

    Returns
    -------
    float or (k,) array
        m; infinite where there is none.

    Raises
    ------
    InputError
        As `energy_release_rate`, or if Gamma is not positive.
    """
    _check(problem, centre=centre)
    if not (is_finite(fracture_energy) and fracture_energy > 0.0):
        given = describe(fracture_energy)
        raise InputError(f"fracture_energy: must be a positive number (J/m²), got {given}")
    loads = _numbers("load", load)
    if loads.ndim > 1 or not np.all(np.isfinite(loads)):
        raise InputError(f"load: must be a finite number or an array of them, got {describe(load)}")
    whole = problem.interface.extent * np.linspace(0.0, 1.0, FINEST + 2)[1:-1]
    resting = _intensity_factors(problem, _resting_stress(problem), whole, centre)
    unit = _intensity_factors(problem, problem.load_profile, whole, centre)
    from_zero = np.append(0.0, whole)  # where nothing is released
    lengths = np.array(
        [
            _crossing(from_zero, np.append(0.0, rate.min(axis=1)) - fracture_energy, arrest)
            for rate in (_release_rate(problem, resting + tau * unit) for tau in loads.ravel())
        ]
    )
    return lengths if loads.ndim else float(lengths[0])


def _crossing(lengths: Array, excess: Array, arrest: bool) -> float:
    """Where the excess of release over the fracture energy becomes positive, or ends to be."""
    above = np.flatnonzero(excess > 0.0)
    if above.size == 0:
        return np.inf
    first = int(above[0])
    if arrest:
        after = np.flatnonzero(excess[first:] <= 0.0)
        if after.size == 0:
            return np.inf
        first += int(after[0])
    low, high = excess[first - 1], excess[first]
    return float(lengths[first - 1] + (lengths[first] - lengths[first - 1]) * low / (low - high))

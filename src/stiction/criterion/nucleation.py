"""Nucleation stress: the load at which a critical patch centred at x would run away."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from stiction._checks import check_choice, check_instance, is_real
from stiction.arrays import Array
from stiction.criterion.assumptions import (
    check_law,
    excess_of,
    uniform_rates,
    warn_if_coarse,
)
from stiction.criterion.eigenproblem import Weight, exact_weight, rounded_weight
from stiction.criterion.grid_weights import grid_weights, transform
from stiction.criterion.moving_average import average_rows
from stiction.criterion.plane import plane_nucleation_stress
from stiction.errors import InputError
from stiction.model import describe
from stiction.problem import Problem

Weights = Literal["exact", "rounded"]


def weight_of(weights: Weights) -> Weight:
    """The exact weight or the printed, rounded one."""
    check_choice("weights", weights, ("exact", "rounded"))
    return exact_weight() if weights == "exact" else rounded_weight()


def multiplier_of(problem: Problem, nucleation_length: float, weights: Weights = "exact") -> Array:
    """What the moving average over h_n does to each wave of the grid, shape (nodes//2 + 1,).

    It is the transform of weights that are not negative.
    """
    check_law(problem)
    if nucleation_length > problem.interface.extent:
        raise InputError(
            f"interface.length: the nucleation length {nucleation_length:.4g} m is longer than the"
            f" interface ({problem.interface.extent:.4g} m); the local criterion does not hold"
            " there, use st.Equilibrium() or st.Rupture()"
        )
    half_width = 0.5 * nucleation_length / problem.interface.spacing
    return transform(grid_weights(weight_of(weights), half_width), problem.interface.size)


def check_aspect(problem: Problem, weights: Weights, aspect: Any) -> None:
    """Refuse the options of a plane on a line, and the other way round."""
    plane = problem.interface.is_plane
    if aspect is not None and not (plane and is_real(aspect) and 0.0 < aspect < np.inf):
        valid = "a positive number" if plane else "left out on a line"
        raise InputError(f"aspect: must be {valid}, got {describe(aspect)}")
    if plane and weight_of(weights) is not exact_weight():
        raise InputError("weights: 'rounded' is of a line; on a plane leave weights = 'exact'")


def nucleation_stress(
    problem: Problem, tau_p: Any, *, weights: Weights = "exact", aspect: float | None = None
) -> Array:
    """Nucleation stress tau_n(x) of strength profiles.

    The load tau_0 at which a patch of length h_n centred at x becomes unstable, if it were alone:
    the average of tau_p - tau_i over h_n with the weight of the critical slip-rate profile, over
    the same average of the load profile (Uenishi and Rice, 2003, Eq. 14; Albertini et al., 2020,
    Eq. 9).

    Parameters
    ----------
    problem : Problem
        With a weakening rate uniform along the interface.
    tau_p : (samples, *shape) or (*shape) array
        Peak strength, Pa.
    weights : {"exact", "rounded"}
        The exact eigenfunction, or the paper's 0.751 (0.925 - 0.308 s^2) sqrt(1 - s^2), which is
        too high by 0.036 %; the latter on a line only.
    aspect : float, optional
        On a plane the average over critical ellipses whose extent along x is so many times that
        along y; the least over five shapes if left out.

    Returns
    -------
    (samples, *shape) or (*shape) array, Pa
        Between the smallest and the largest (tau_p - tau_i)/p of the profile, times 1.00036 with
        the rounded weights.

    Raises
    ------
    InputError
        If the profile does not fit the problem, the weakening rate varies along the interface, or
        a critical patch is larger than the interface.

    Examples
    --------
    The average of a uniform strength is that strength; of any other it lies between the extremes.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> tau_n = st.nucleation_stress(problem, tau_p)
    >>> bool(tau_p.min() < tau_n.min() < tau_n.max() < tau_p.max())
    True
    """
    check_instance("problem", problem, Problem)
    check_aspect(problem, weights, aspect)
    plane = problem.interface.is_plane
    rows = problem.sample(tau_p)
    if problem.friction.weakening_rate is None:
        rate = float(uniform_rates(rows)[0])
        if np.ptp(rows.weakening_rate) > 0.0:
            raise InputError("weakening_rate: differs between samples; pass them one by one")
    else:
        uniform_rates(rows)
        rate = float(rows.weakening_rate.flat[0])
    warn_if_coarse(problem, rows)
    if plane:
        found = plane_nucleation_stress(problem, rows, aspect)
        return found[0] if np.ndim(tau_p) == 2 else found
    multiplier = multiplier_of(problem, problem.nucleation_length_of(rate), weights)
    excess = excess_of(rows)
    result = np.empty_like(excess)
    average_rows(excess, multiplier, result)
    load = np.empty((1, *rows.shape))
    average_rows(np.ascontiguousarray(rows.load_profile[None]), multiplier / multiplier[0], load)
    result /= load
    # The weights keep to these bounds; only the rounding of the transforms may not.
    ratio = multiplier[0] * (excess / rows.load_profile)
    low, high = ratio.min(axis=1, keepdims=True), ratio.max(axis=1, keepdims=True)
    np.clip(result, low, high, out=result)
    return result[0] if np.ndim(tau_p) == 1 else result

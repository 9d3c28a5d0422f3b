"""How much of a random strength lies below the residual strength, said before computing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stiction.errors import InputError, warn_accuracy
from stiction.problem import Problem
from stiction.random.coefficients import pressures, support_in_stress
from stiction.random.random_field import RandomField

WORTH_SAYING = 1e-6
MOST = 0.5
QUANTILES = 2000


def share_below_residual(problem: Problem, fields: Mapping[str, RandomField]) -> float:
    """Probability that the peak strength at a point is at or below the residual strength there.

    Parameters
    ----------
    problem : Problem
    fields : mapping
        'strength', and 'residual_strength' where that is random; they are independent.
    """
    residual = np.asarray(problem.friction.residual_strength)
    if "residual_strength" in fields:
        middles = (np.arange(QUANTILES) + 0.5) / QUANTILES
        residual = fields["residual_strength"].marginal.distribution.ppf(middles)
    strength = fields["strength"]
    if strength.of is not None:
        residual = np.ravel(residual)[:, None] / pressures(problem, fields)
    return float(np.mean(strength.marginal.distribution.cdf(residual)))


def check_residual(problem: Problem, fields: Mapping[str, RandomField]) -> None:
    """Say which share of the strength does not exceed the residual strength.

    A node whose strength does not exceed its residual strength does not weaken. A few of those
    can be meant, and are warned of; if they are the rule, the interface does not weaken at all.

    Parameters
    ----------
    problem : Problem
    fields : mapping
        What is random, by name; 'strength' among it.

    Raises
    ------
    InputError
        If the share exceeds a half.

    Warns
    -----
    AccuracyWarning
        If the share exceeds one in a million.
    """
    share = share_below_residual(problem, fields)
    if share <= WORTH_SAYING:
        return
    if "residual_strength" in fields:
        residual = "the random residual strength"
    else:
        given = np.asarray(problem.friction.residual_strength)
        values = dict.fromkeys((float(given.min()), float(given.max())))
        residual = "the residual strength, " + " to ".join(f"{v:g}" for v in values) + " Pa"
    low, high = support_in_stress(problem, fields, "strength")
    said = (
        f"strength: {100.0 * share:.3g} % of its marginal, which reaches from {low:g} to"
        f" {high:g} Pa, lies at or below {residual}"
    )
    if share > MOST:
        raise InputError(
            f"{said}: most of the interface would not weaken at all. Raise the strength, lower"
            " friction.residual_strength, or check the unit of both (Pa)"
        )
    warn_accuracy(
        f"{said}; there the interface does not weaken. If that is not meant, lower"
        " friction.residual_strength or choose a marginal that stays above it"
    )

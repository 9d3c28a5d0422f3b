"""What is refused or warned of a random interface on a problem, before anything is computed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.friction import SCALES
from stiction.interface import Interface
from stiction.problem import FEWEST_NODES, Problem
from stiction.random.mapping import from_normal
from stiction.random.pressure import coefficients_of, pressures, support_in_stress
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface, lower_factor

WORTH_SAYING = 1e-6
MOST = 0.5
QUANTILES = 2000
POINTS, SPREAD = 1 << 14, 2.5
"""Of importance sampling: normal draws that are wider than they are."""


def share_below_residual(problem: Problem, fields: Mapping[str, RandomField]) -> float:
    """Return the probability that the strength at a point is not above the residual strength.

    Parameters
    ----------
    problem : Problem
    fields : mapping
        'strength', and 'residual_strength' where that is random; they are taken as independent.
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
    """Warn of the share of the strength that does not exceed the residual strength.

    A node whose strength does not exceed its residual strength does not weaken. A few of those
    can be meant; if they are the rule, the interface does not weaken at all.

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


def warn_if_unresolved(problem: Problem, random: RandomInterface) -> float:
    """Warn of samples whose nucleation length the grid will not resolve somewhere.

    Returns
    -------
    float
        Their expected share; 0 if neither weakening rate, critical slip nor fracture energy is
        random.

    Warns
    -----
    AccuracyWarning
        If the share exceeds one in a million.

    Notes
    -----
    At a point it is the probability of a weakening rate (Pa/m) beyond what the grid resolves, by
    importance sampling. Anywhere along the interface it is that of the maximum of a Gaussian field
    of the same probability at a point, with the waves of the field that varies faster (Rice, 1944;
    Adler, 1981).
    """
    scale = next((name for name in SCALES if name in random.names), None)
    if scale is None:
        return 0.0
    point = _share_too_steep(problem, random, scale)
    fields = [random.properties[name] for name in ("strength", scale)]
    share = max(_share_anywhere(field, problem.interface, point) for field in fields)
    if share > WORTH_SAYING:
        warn_accuracy(
            f"{scale}: in about {100.0 * share:.2g} % of the samples the nucleation length will"
            f" span fewer than {FEWEST_NODES} nodes somewhere, which the grid does not resolve;"
            " raise interface.nodes or choose a marginal with bounds"
        )
    return share


def _share_too_steep(problem: Problem, random: RandomInterface, scale: str) -> float:
    """Probability that the grid does not resolve the nucleation length at a point."""
    names = random.names
    uniform = qmc.Sobol(len(names), rng=0).random(POINTS)
    wide = SPREAD * ndtri(np.clip(uniform, 1e-12, 1.0 - 1e-12))
    excess = 0.5 * (1.0 - SPREAD**-2) * np.sum(wide * wide, axis=1)
    weight = SPREAD ** len(names) * np.exp(-excess) / POINTS
    z = wide @ lower_factor(random.matrix).T
    found = {
        name: from_normal(field.marginal, z[:, i])
        for i, (name, field) in enumerate(random.properties.items())
    }
    for name in coefficients_of(random):
        pressure = found.get("normal_pressure", problem.load.normal_pressure)
        found[name] = found[name] * _everywhere(pressure)
    friction, strength = problem.friction, found["strength"]
    if "residual_strength" in found:
        residual = found["residual_strength"]
    elif friction.residual_ratio is not None:
        residual = _everywhere(friction.residual_ratio) * strength
    else:
        residual = _everywhere(friction.residual_strength)
    rate = friction.rate(np.maximum(strength - residual, 0.0), scale, found[scale])
    highest = min(problem.nodes_in_nucleation_length(1.0)) / FEWEST_NODES  # Pa/m
    return float(weight[rate > highest].sum())


def _everywhere(value: Any) -> Array:
    """Values at the nodes, each for as many points as the others."""
    return np.resize(np.ravel(value), POINTS)


def _share_anywhere(field: RandomField, interface: Interface, point: float) -> float:
    """Probability that a field exceeds anywhere what it exceeds with `point` at a point."""
    if point == 0.0:
        return 0.0
    modes = field.modes(interface)
    units = 2.0 * math.pi / np.array(interface.lengths)
    # Mean squares of the derivatives of z in each direction.
    slopes = (units[:, None] * modes.numbers) ** 2 @ modes.sigma**2
    level = -float(ndtri(point))
    waves = interface.extent * math.sqrt(float(np.prod(slopes))) / (2.0 * math.pi)
    if interface.is_plane:
        waves *= max(level, 0.0) / math.sqrt(2.0 * math.pi)
    share = 1.0 - (1.0 - point) * math.exp(-waves * math.exp(-0.5 * level * level))
    return min(share, interface.size * point)

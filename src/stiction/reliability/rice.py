"""Rice's formula: the lowest nucleation stress as the minimum of a stationary process."""

from __future__ import annotations

import numpy as np

from stiction._typing import Array
from stiction.criterion.nucleation import nucleation_stress
from stiction.fields.random_field import RandomField
from stiction.problem import Problem

BATCH = 256
FEWEST = 5
"""Crossings below which their rate is not known."""


def rice_probability(
    problem: Problem, strength: RandomField, stress: Array, *, samples: int = 500, seed: int = 0
) -> Array:
    """P(tau_cr < s) from how often the nucleation stress crosses s downwards.

    Parameters
    ----------
    problem : Problem
        Uniform along the interface.
    strength : RandomField
        Peak strength, Pa.
    stress : (k,) array
        s, Pa.
    samples : int
        Profiles over which crossings and time above are pooled.
    seed : int
        Not negative.

    Returns
    -------
    (k,) array
        1 - S exp(-L nu/S), S the share of the interface with tau_n >= s and nu the down-crossings
        per length; NaN where fewer than five crossings were seen.

    Notes
    -----
    Crossings taken as a Poisson process (Rice, 1944; Cramer and Leadbetter, 1967), with S in front
    for interfaces that lie below from the start. By the local criterion, whatever the method.
    """
    stress = np.asarray(stress, dtype=np.float64)
    initial, factor = np.mean(problem.load.initial_stress), np.mean(problem.load.profile)
    below, crossings, nodes = np.zeros(stress.size), np.zeros(stress.size), 0
    for first in range(0, samples, BATCH):
        count = min(BATCH, samples - first)
        profiles = strength.sample(problem.interface, samples=count, seed=seed, first=first)
        tau = initial + factor * nucleation_stress(problem, profiles)
        following = np.roll(tau, -1, axis=1)
        ordered = np.sort(tau.ravel())
        below += np.searchsorted(ordered, stress, side="left")
        # A crossing of s between two nodes counts for every s between their values.
        down = tau > following
        upper, lower = np.sort(tau[down]), np.sort(following[down])
        crossings += np.searchsorted(lower, stress, side="left")
        crossings -= np.searchsorted(upper, stress, side="left")
        nodes += tau.size
    above = 1.0 - below / nodes
    expected = crossings / samples
    with np.errstate(divide="ignore", invalid="ignore"):
        result: Array = np.where(above > 0.0, 1.0 - above * np.exp(-expected / above), 1.0)
    known = (crossings >= FEWEST) | (above < 0.5)  # far above the median nothing crosses either
    return np.where(known, result, np.nan)

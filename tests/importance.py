"""Importance sampling around the most likely weak spot, put at a random place on the interface.

Where the problem looks the same everywhere there is one most likely failure for each place, so the
sampling density is a mixture of normal densities shifted by the same dip at all nodes.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import logsumexp

import stiction as st
from stiction.base.arrays import Array
from stiction.methods.criterion.windows import windows_of
from stiction.random.fields import RandomField
from stiction.random.mapping import from_normal

SIZES = (1.0, 1.15)
"""Shifts in units of the dips: the failures lie a little beyond them."""


def longer(problem: st.Problem, times: int) -> st.Problem:
    """The same problem on a line that is so many times longer."""
    line = problem.interface
    interface = st.Interface(times * line.measure, times * line.size)
    return dataclasses.replace(problem, interface=interface)


def dips(problem: st.Problem, field: RandomField, stress: float) -> Array:
    """Most likely draws whose nucleation stress at each node is as low as given: a row a node.

    The nearest point to the origin on <g, F^-1(Phi(z))> = stress lies along the gradient there,
    g times the slope of the map: a fixed point. Sampling is unbiased without it as well.
    """
    interface = problem.interface
    (window,) = windows_of(problem, float(np.max(np.asarray(problem.friction.weakening_rate))))
    weight = window.weight
    unit = np.eye(field.modes(interface).draw_numbers.size)
    waves = field.modes(interface).gaussian(unit)  # z of each draw alone
    z, along = np.zeros(interface.shape), np.zeros(len(unit))
    for _ in range(100):
        slope = from_normal(field.marginal, z + 1e-4) - from_normal(field.marginal, z - 1e-4)
        steepest = waves @ (weight * slope)
        # Whole steps go to and fro.
        along += 0.2 * (steepest / np.linalg.norm(steepest) - along)
        along /= np.linalg.norm(along)
        profile = along @ waves

        def excess(length: float, profile: Array = profile) -> float:
            return np.sum(weight * from_normal(field.marginal, -length * profile)) - stress

        index = brentq(excess, 0.0, 40.0, xtol=1e-10)
        z = -index * profile
    nodes = np.arange(interface.size)
    behind = (nodes - nodes[:, None]) % interface.size  # how far each node lies behind each dip
    moved = (weight * slope)[behind] @ waves.T
    return -index * moved / np.linalg.norm(moved, axis=1, keepdims=True)


def mixture(shifts: Array, samples: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Draws of normal densities about the shifts, in several sizes, and their log weights.

    A weight is the normal density over that of the mixture.
    """
    draws = rng.standard_normal((samples, shifts.shape[1]))
    size = rng.choice(SIZES, samples)[:, None]
    draws += size * shifts[rng.integers(0, len(shifts), samples)]
    along, square = draws @ shifts.T, (shifts * shifts).sum(axis=1)  # densities underflow
    parts = [logsumexp(a * along - 0.5 * a * a * square, axis=1) for a in SIZES]
    return draws, np.log(len(shifts) * len(SIZES)) - logsumexp(parts, axis=0)


class Answer(NamedTuple):
    """Probability, its coefficient of variation, and how many equal weights it is worth."""

    probability: float
    cv: float
    effective_size: float


def by_importance(
    problem: st.Problem, field: RandomField, stress: float, method: Any, cv: float,
    seed: int = 0,
) -> Answer:  # fmt: skip
    """P(onset < stress) by sampling around the most likely weak spot, until `cv` is reached."""
    shifts = dips(problem, field, stress)
    state = st.external.limit_state(problem, field, method)
    rng = np.random.default_rng((seed, 4))
    weights = np.empty(0)
    while True:
        draws, logs = mixture(shifts, 1000, rng)
        weights = np.append(weights, np.where(state(draws) < stress, np.exp(logs), 0.0))
        mean, error = weights.mean(), weights.std() / math.sqrt(weights.size)
        if mean > 0.0 and error <= cv * mean:
            size = weights.sum() ** 2 / np.sum(weights * weights)
            return Answer(mean, error / mean, size)
        assert weights.size < 500_000

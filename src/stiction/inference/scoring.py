"""Greatest likelihoods by Fisher scoring within limits."""

from collections.abc import Callable
from typing import Any

import numpy as np

from stiction.base.arrays import Array

STEPS = 40
HIGHEST = 1e8
"""Damping at which no step raises the likelihood any more."""


def climb(
    at: Array,
    limits: Array,
    value_of: Callable[[Array], tuple[float, Any]],
    derivatives: Callable[[Array, Any], tuple[Array, Array]],
    *,
    longest: float,
    settled: float,
) -> Array:
    """Return the parameters of the greatest likelihood, by damped steps of at most `longest`.

    `value_of` returns the log likelihood and what `derivatives` needs for the score and Fisher's
    information. A gain below `settled` ends the search.
    """
    at = np.clip(at, limits[:, 0], limits[:, 1])
    value, state = value_of(at)
    damping = 1e-3
    for _ in range(STEPS):
        score, information = derivatives(at, state)
        # A parameter that pushes against its limit is held there, or the others could not move.
        held = ((at <= limits[:, 0]) & (score < 0.0)) | ((at >= limits[:, 1]) & (score > 0.0))
        free = np.flatnonzero(~held)
        information, score = information[np.ix_(free, free)], score[free]
        diagonal = np.diag(np.diag(information) + 1e-9 * np.trace(information) + 1e-300)
        while damping < HIGHEST:
            step = np.zeros(at.size)
            step[free] = np.linalg.solve(information + damping * diagonal, score)
            step *= min(1.0, longest / max(np.abs(step).max(initial=0.0), 1e-300))
            new = np.clip(at + step, limits[:, 0], limits[:, 1])
            new_value, new_state = value_of(new)
            if new_value >= value:
                break
            damping *= 10.0
        else:
            break
        gain = new_value - value
        at, state, value = new, new_state, new_value
        damping = max(0.1 * damping, 1e-9)
        if gain < settled:
            break
    return at

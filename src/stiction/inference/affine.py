"""Affine scaling: which parameters only shift and stretch the strength, and so need no simulation.

Let the strength be tau_p = a + b s with b > 0 and a profile s of one and the same distribution. If
the load profile and the initial stress are uniform and the weakening rate W is given, the smallest
load at which the linear problem A d + tau_p - tau_0 >= 0, d >= 0 has no solution is

    min {<tau_p, y> : y >= 0, <1, y> = 1, A y <= 0} = a + b min {<s, y> : ...},

because neither A = K - W nor the set of y knows the strength; the local criterion is the same with
y restricted to one weight. So onset(a + b s) = a + b onset(s), sample by sample, as long as no node
has reached its residual strength. The local criterion does not know a residual strength, so there
it always holds. Equilibrium and rupture do: with slip in units of b, strength is
a + b max(s - W d, (tau_r - a)/b), the same problem only if (tau_r - a)/b is: if a = 0 and tau_r is
zero or in proportion to tau_p. A rupture also depends on the loading rate, which would have to
scale with b. Where W follows from a critical slip or a fracture energy, it changes with b, and the
nucleation length with it: nothing scales.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.inference.prior import Prior, full_key

QUANTILES = np.linspace(0.02, 0.98, 25)
SAME = 1e-9
"""Of quantiles relative to their spread: round-off of scipy's quantiles."""
PLACES = 6
MARGINAL = "random.strength.marginal."


@dataclass(frozen=True, eq=False)
class Affine:
    """Parameters that shift and stretch the strength, and how.

    Attributes
    ----------
    keys : tuple of int
        Their places in the prior; empty if there are none.
    reference : (parameters,) array
        Where shift is 0 and stretch 1, in these parameters.
    shifts, stretches : (len(keys) + 1,) arrays
        Shift (Pa) and stretch are linear in the parameters: a constant, then one slope each.
    reason : str
        Why there are none, or no more than these; empty if the marginal is all affine.
    """

    keys: tuple[int, ...]
    reference: Array
    shifts: Array
    stretches: Array
    reason: str = ""

    def of(self, theta: Array) -> tuple[Array, Array]:
        """Shift (Pa) and stretch of points (points, parameters)."""
        own = theta[:, list(self.keys)]
        shift: Array = self.shifts[0] + own @ self.shifts[1:]
        stretch: Array = self.stretches[0] + own @ self.stretches[1:]
        return shift, stretch


def not_affine(middle: Array, reason: str = "") -> Affine:
    """No parameter is affine."""
    return Affine((), middle, np.zeros(1), np.ones(1), reason)


def no_scaling(prior: Prior, method: Any) -> str:
    """Why no parameter scales the onset, or nothing."""
    problem, random = prior.problem, prior.random
    if method.type not in ("local_criterion", "equilibrium"):
        return f"the onset by {method.label} does not scale with the strength"
    if len(random.names) > 1:
        return "more than the strength is random"
    if problem.friction.weakening_rate is None:
        return "the weakening rate follows from the strength"
    if np.ptp(problem.load.profile) > 0.0 or np.ptp(problem.load.initial_stress) > 0.0:
        return "the load is not uniform"
    if getattr(method, "weights", "exact") != "exact":
        return "the rounded weights do not integrate to one"
    if only_stretch(method) and np.any(np.asarray(problem.friction.residual_strength)):
        return "the residual strength does not scale with the strength"
    if only_stretch(method) and np.any(np.asarray(problem.load.initial_stress)):
        return "the initial stress does not scale with the strength"
    return ""


def only_stretch(method: Any) -> bool:
    """Whether a stretch scales the onset but a shift may not: a residual strength is known."""
    return bool(method.type != "local_criterion")


def _quantiles(prior: Prior, theta: Array) -> Array:
    _, random = prior.at(theta)
    return np.asarray(random.strength.marginal.distribution.ppf(QUANTILES), dtype=np.float64)


def _map(reference: Array, quantiles: Array) -> tuple[float, float] | None:
    """Shift and stretch from one set of quantiles to another, or None if that is no such map."""
    stretch = (quantiles[-1] - quantiles[0]) / (reference[-1] - reference[0])
    shift = quantiles[0] - stretch * reference[0]
    error = np.abs(shift + stretch * reference - quantiles).max()
    scale = max(np.ptp(quantiles), 1e-3 * np.abs(quantiles).max())
    return (float(shift), float(stretch)) if error <= SAME * scale and stretch > 0.0 else None


def find_affine(prior: Prior, method: Any) -> Affine:
    """Which parameters of a prior are affine for a method, tested at points of the prior.

    Nothing is concluded from names: the quantiles of the marginal are compared.
    """
    middle = prior.theta(np.full((1, prior.dimension), 0.5))[0]
    reason = no_scaling(prior, method)
    if reason:
        return not_affine(middle, reason)
    start = _quantiles(prior, middle)
    keys = []
    for i, name in enumerate(prior.names):
        if not full_key(name).startswith(MARGINAL):
            continue
        found = []
        for u in (0.2, 0.9):
            theta = middle.copy()
            theta[i] = prior.theta(np.full((1, prior.dimension), u))[0, i]
            found.append(_map(start, _quantiles_or_none(prior, theta, start)))
        most = SAME * np.abs(start).max() if only_stretch(method) else np.inf
        if all(one is not None and abs(one[0]) <= most for one in found):
            keys.append(i)
    result = _linear(prior, middle, tuple(keys))
    if result is None:
        return not_affine(middle, "shift and stretch are not linear in the parameters")
    some = any(full_key(name).startswith(MARGINAL) for name in prior.names)
    if some and not keys:
        text = "the parameters of the marginal change its shape" + (
            ", or shift it, and a residual strength may be reached" if only_stretch(method) else ""
        )
        return not_affine(middle, text)
    return result


def _quantiles_or_none(prior: Prior, theta: Array, start: Array) -> Array:
    try:
        return _quantiles(prior, theta)
    except InputError:  # no marginal there: low above high, say
        return np.full_like(start, np.nan)


def _linear(prior: Prior, middle: Array, keys: tuple[int, ...]) -> Affine | None:
    """Shift and stretch as linear functions, checked at random points of the whole prior."""
    start = _quantiles(prior, middle)
    shifts, stretches = np.zeros(len(keys) + 1), np.zeros(len(keys) + 1)
    stretches[0] = 1.0
    for place, i in enumerate(keys):
        theta = middle.copy()
        theta[i] = prior.theta(np.full((1, prior.dimension), 0.9))[0, i]
        found = _map(start, _quantiles(prior, theta))
        if found is None:
            return None
        step = theta[i] - middle[i]
        shifts[place + 1] = found[0] / step
        stretches[place + 1] = (found[1] - 1.0) / step
        shifts[0] -= shifts[place + 1] * middle[i]
        stretches[0] -= stretches[place + 1] * middle[i]
    result = Affine(keys, middle, shifts, stretches)
    places = np.random.default_rng(0).random((PLACES, prior.dimension))
    for theta in prior.theta(places):
        base = theta.copy()
        base[list(keys)] = middle[list(keys)]
        shift, stretch = result.of(theta[None, :])
        expected = shift + stretch * _quantiles(prior, base)
        found_here = _quantiles(prior, theta)
        scale = max(np.ptp(found_here), 1e-3 * np.abs(found_here).max())
        if np.abs(expected - found_here).max() > 10.0 * SAME * scale:
            return None
    return result

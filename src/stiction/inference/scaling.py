"""Parameters that shift and stretch the strength, and so the onset, without simulation.

Let the strength be tau_p = a + b s with b > 0 and a profile s of one and the same distribution. If
the load profile and the initial stress are uniform and the weakening rate W is given, the smallest
load at which the linear problem A d + tau_p - tau_0 >= 0, d >= 0 has no solution is

    min {<tau_p, y> : y >= 0, <1, y> = 1, A y <= 0} = a + b min {<s, y> : ...},

because neither A = K - W nor the set of y depends on the strength; the local criterion is the same
with y restricted to one weight. So onset(a + b s) = a + b onset(s), sample by sample, as long as no
node has reached its residual strength. The local criterion takes no residual strength into account,
so there it always holds. Equilibrium does: with slip in units of b, strength is
a + b max(s - W d, (tau_r - a)/b), the same problem only if (tau_r - a)/b is: if a = 0 and tau_r is
zero or in proportion to tau_p. A rupture also depends on the loading rate, which would have to
scale with b. Where W follows from a critical slip or a fracture energy, it changes with b, and the
nucleation length with it: nothing scales.

Friction coefficients mu = a + b s are a strength sigma_n (a + b s). The shift sigma_n a is the same
everywhere only if the normal pressure is; where it varies, a must be zero.
"""

from typing import Any, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.inference.prior import Prior, full_key
from stiction.random.marginals import affine_parameters

MARGINAL = "random.strength.marginal."
PRESSURE = "problem.load.normal_pressure"


class Scaling(NamedTuple):
    """Parameters that shift and stretch the onset, and how: linear in the parameters."""

    keys: tuple[int, ...]  # their places in the prior
    reference: Array  # (parameters,): where shift is 0 and stretch 1
    shifts: Array  # in the unit of the peaks: a constant, then one slope for each key
    stretches: Array  # the same
    reason: str = ""  # why there are none

    def of(self, theta: Array) -> tuple[Array, Array]:
        """Return shift (unit of the peaks) and stretch at points (points, parameters)."""
        own = theta[:, list(self.keys)]
        shift: Array = self.shifts[0] + own @ self.shifts[1:]
        stretch: Array = self.stretches[0] + own @ self.stretches[1:]
        return shift, stretch


def find_scaling(prior: Prior, method: Any, variable: str) -> Scaling:
    """Find the parameters of a prior that scale the onset; `variable` names the peaks."""
    middle = prior.middle
    problem, random = prior.at(middle)
    if reason := _no_scaling(prior, problem, random, method):
        return _none(middle, reason)
    field = random.strength
    names, location, scale = affine_parameters(field.marginal)
    full = [full_key(name) for name in prior.names]
    places = {
        key.removeprefix(MARGINAL): i for i, key in enumerate(full) if key.startswith(MARGINAL)
    }
    if "mean" in names and {"low", "high"} & places.keys():
        names = ()  # a bound of such a marginal changes its shape
    keys = tuple(i for name, i in places.items() if name in names)
    if places and not keys:
        return _none(middle, "the parameters of the marginal change its shape")
    shifts, stretches = np.zeros(len(keys) + 1), np.zeros(len(keys) + 1)
    shifts[0], stretches[0] = location, scale
    aside = prior.theta(np.full((1, prior.dimension), 0.9))[0]
    for slope, i in enumerate(keys, 1):
        theta = np.where(np.arange(prior.dimension) == i, aside, middle)
        _, moved, stretched = affine_parameters(prior.at(theta)[1].strength.marginal)
        shifts[slope] = (moved - location) / (aside[i] - middle[i])
        stretches[slope] = (stretched - scale) / (aside[i] - middle[i])
        shifts[0] -= shifts[slope] * middle[i]
        stretches[0] -= stretches[slope] * middle[i]
    varies = field.of is not None and np.ndim(problem.load.normal_pressure) > 0
    if keys and (varies or method.type != "local_criterion") and (location or shifts[1:].any()):
        why = "the normal pressure varies" if varies else "a residual strength may be reached"
        return _none(middle, f"the parameters of the marginal shift it, and {why}")
    stretches /= scale
    shifts -= location * stretches
    pressure = problem.load.normal_pressure
    mean = 1.0 if pressure is None else float(np.mean(pressure))
    factor = 1.0 if field.of is None else mean
    factor = factor / mean if variable == "friction_coefficient" else factor
    return Scaling(keys, middle, factor * shifts, stretches)


def _none(middle: Array, reason: str) -> Scaling:
    return Scaling((), middle, np.zeros(1), np.ones(1), reason)


def _no_scaling(prior: Prior, problem: Any, random: Any, method: Any) -> str:
    """Return the reason why no parameter scales the onset, or an empty text."""
    friction, load = problem.friction, problem.load
    if method.type not in ("local_criterion", "equilibrium"):
        return f"the onset by {method.label} does not scale with the strength"
    if len(random.names) > 1:
        return "more than the strength is random"
    if any(full_key(name) == PRESSURE for name in prior.names):
        return "the normal pressure is not known"
    if friction.weakening_rate is None:
        return "the weakening rate follows from the strength"
    if np.ptp(problem.load_profile) > 0.0 or np.ptp(load.initial_stress) > 0.0:
        return "the load is not uniform"
    if method.type != "local_criterion" and np.any(np.asarray(friction.residual_strength)):
        return "the residual strength does not scale with the strength"
    if method.type != "local_criterion" and np.any(np.asarray(load.initial_stress)):
        return "the initial stress does not scale with the strength"
    return ""

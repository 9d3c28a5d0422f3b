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
    none = Scaling((), middle, np.zeros(1), np.ones(1))
    field, full = random.strength, [full_key(name) for name in prior.names]
    if not _may_scale(problem, random, method) or PRESSURE in full:
        return none
    names, location, scale = affine_parameters(field.marginal)
    places = {
        key.removeprefix(MARGINAL): i for i, key in enumerate(full) if key.startswith(MARGINAL)
    }
    if "mean" in names and {"low", "high"} & places.keys():
        return none  # a bound of such a marginal changes its shape
    keys = tuple(i for name, i in places.items() if name in names)
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
    pressure = problem.load.normal_pressure
    varies = field.of is not None and np.ndim(pressure) > 0
    if (varies or method.type != "local_criterion") and (location or shifts[1:].any()):
        return none
    stretches /= scale
    shifts -= location * stretches
    mean = 1.0 if pressure is None else float(np.mean(pressure))
    factor = 1.0 if field.of is None else mean
    factor = factor / mean if variable == "friction_coefficient" else factor
    return Scaling(keys, middle, factor * shifts, stretches)


def _may_scale(problem: Any, random: Any, method: Any) -> bool:
    """Whether the onset scales with the strength if this keeps its distribution."""
    friction, load = problem.friction, problem.load
    exact = method.type == "equilibrium"
    return bool(
        (exact or method.type == "local_criterion")
        and len(random.names) == 1
        and friction.weakening_rate is not None
        and np.ptp(problem.load_profile) == 0.0
        and np.ptp(load.initial_stress) == 0.0
        # Neither of these scales with the strength; the local criterion needs no zero.
        and not (exact and np.any(np.asarray(friction.residual_strength)))
        and not (exact and np.any(np.asarray(load.initial_stress)))
    )

"""Parameters that shift and stretch the strength, and so the onset, without simulation.

Let the strength be tau_p = a + b s with b > 0 and a profile s of one and the same distribution. If
the load profile and the initial stress are uniform and the weakening rate W is given, the smallest
load at which the linear problem A d + tau_p - tau_0 >= 0, d >= 0 has no solution is

    min {<tau_p, y> : y >= 0, <1, y> = 1, A y <= 0} = a + b min {<s, y> : ...},

because neither A = K - W nor the set of y depends on the strength; the local criterion is
the same with y restricted to one weight. So onset(a + b s) = a + b onset(s), sample by
sample, as long as no node has reached its residual strength. The local criterion takes no
residual strength into account, so there it always holds. Equilibrium does: with slip in
units of b, strength is a + b max(s - W d, (tau_r - a)/b), the same problem only if
(tau_r - a)/b is: if a = 0 and tau_r is zero or in proportion to tau_p. A rupture also
depends on the loading rate, which would have to scale with b. Where W follows from a
critical slip or a fracture energy, it changes with b, and the nucleation length with it:
nothing scales.

Friction coefficients mu = a + b s are a strength sigma_n (a + b s). The shift sigma_n a is the same
everywhere only if the normal pressure is; where it varies, a must be zero. So it must where the
load profile p varies, as on specimens, without initial stress: <b s, y>/<p, y> only stretches.
"""

from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.ensemble.limit_state import scales_with_strength
from stiction.inference.prior import Prior
from stiction.methods.protocol import optional_member
from stiction.random.dotted_keys import full_key
from stiction.random.marginals import affine_parameters

MARGINAL = "random.strength.marginal."
PRESSURE = {"problem.load.normal_pressure", "problem.load.pressing_force"}
SLOPES = {"low": (1, -1), "high": (0, 1), "loc": (1, 0), "scale": (0, 1), "mean": (0, 1)}
"""Derivatives of location and scale of a marginal, see `affine_parameters`."""


class Scaling(NamedTuple):
    """Parameters that shift and stretch the onset, and how: linear in the parameters."""

    keys: tuple[int, ...]  # their places in the prior
    reference: Array  # (parameters,): where shift is 0 and stretch 1
    slopes: Array  # (keys, 2): of shift (unit of the peaks) and stretch

    def of(self, theta: Array) -> Array:
        """Return shift (unit of the peaks) and stretch at points, (2, points)."""
        shift_stretch: Array = (theta - self.reference)[:, list(self.keys)] @ self.slopes
        return np.ascontiguousarray(shift_stretch.T) + np.array([[0.0], [1.0]])


def find_scaling(prior: Prior, method: Any, variable: str) -> Scaling:
    """Find the parameters of a prior that scale the onset; `variable` names the peaks."""
    middle = prior.middle
    problem, random = prior.at(middle)
    none = Scaling((), middle, np.zeros((0, 2)))
    field, full = random.strength, [full_key(name) for name in prior.names]
    if not scales_with_strength(problem, random, method) or PRESSURE & {*full}:
        return none
    of_area = [
        key for key in full if key.startswith(("problem.interface.", "problem.specimen."))
    ]
    if of_area and problem.load.pressing_force is not None:
        return none  # a force over an area that varies
    names, location, scale = affine_parameters(field.marginal)
    if "mean" in names and {MARGINAL + "low", MARGINAL + "high"} & set(full):
        return none  # a bound of such a marginal changes its shape
    places = {full.index(MARGINAL + name): name for name in names if MARGINAL + name in full}
    slopes = np.array([SLOPES[name] for name in places.values()], dtype=float).reshape(-1, 2)
    pressure = problem.normal_pressure
    varies = field.of is not None and np.ndim(pressure) > 0
    varies = varies or np.ptp(problem.load_profile) > 0.0
    affine = optional_member(method, "scaling") == "affine" and not varies
    if not affine and (location or slopes[:, 0].any()):
        return none
    slopes[:, 1] /= scale
    slopes[:, 0] -= location * slopes[:, 1]
    mean = 1.0 if pressure is None else float(np.mean(pressure))
    slopes[:, 0] *= mean ** ((field.of is not None) - (variable == "friction_coefficient"))
    return Scaling(tuple(places), middle, slopes)

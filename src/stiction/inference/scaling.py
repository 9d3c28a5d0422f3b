"""Find parameters that shift and stretch the strength, and therefore the onset.

Problem. The strength is tau_p = a + b s, with b > 0 and a profile s
whose distribution does not depend on a and b. When is onset(a + b s) =
a + b onset(s), sample by sample?

Source. The derivation uses the duality of linear programmes (Farkas,
1902). The application is our own.

Derivation:

1. Let the load profile and the initial stress be uniform, and the
   weakening rate W be given. The onset is the smallest load at which A
   d + tau_p - tau_0 >= 0, d >= 0 has no solution, with A = K - W. By
   duality it is

       min {<tau_p, y> : y >= 0, <1, y> = 1, A y <= 0} = a + b min {<s, y> : ...},

   because A and the set of y do not depend on the strength. The
   equation holds as long as no node has reached its residual strength.
2. The local criterion is the same minimum with y
   restricted to one weight. It ignores the
   residual strength, so the equation always holds.
3. In equilibrium, with slip in units of b, the strength is a + b max(s - W d, (tau_r -
   a)/b). The problem is the same only if (tau_r - a)/b is the same: if a = 0, and
   tau_r is zero or proportional to tau_p.
4. A rupture also depends on the loading
   rate, which would have to scale with b.
5. If W follows from a critical slip or a fracture energy, W and the
   nucleation length change with b. The equation does not hold.
6. A friction coefficient mu = a + b s is a strength sigma_n (a + b s).
   The shift sigma_n a is uniform only if the normal pressure is
   uniform. Otherwise a must be zero. The parameter a must also be zero
   if the load profile p varies and there is no initial stress, as on
   specimens: <b s, y>/<p, y> only stretches.
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
OF_AREA = ("problem.interface.", "problem.specimen.")
"""Beginnings of keys that change the area."""
PRESSURE = {"problem.load.normal_pressure", "problem.load.pressing_force"}
SLOPES = {"low": (1, -1), "high": (0, 1), "loc": (1, 0), "scale": (0, 1), "mean": (0, 1)}
"""Derivatives of location and scale of a marginal by its parameters, see `affine_parameters`."""


class Scaling(NamedTuple):
    """Parameters that shift and stretch the onset linearly."""

    keys: tuple[int, ...]  # places of these parameters in the prior
    reference: Array  # point with shift 0 and stretch 1, (parameters,)
    slopes: Array  # derivatives of shift (unit of the peaks) and stretch, (keys, 2)

    def of(self, theta: Array) -> Array:
        """Return shift (in the unit of the peaks) and stretch at points, with shape (2, points)."""
        shift_stretch: Array = (theta - self.reference)[:, list(self.keys)] @ self.slopes
        return np.ascontiguousarray(shift_stretch.T) + np.array([[0.0], [1.0]])


def find_scaling(prior: Prior, method: Any, variable: str) -> Scaling:
    """Find the parameters of a prior that scale the onset. `variable` is the name of the peaks."""
    middle, changed = prior.middle, [full_key(name) for name in prior.names]
    none = Scaling((), middle, np.zeros((0, 2)))
    problem, random = prior.at(middle)
    field, pressure = random.strength, problem.normal_pressure
    if not scales_with_strength(problem, random, method) or PRESSURE & {*changed}:
        return none
    changes_area = any(key.startswith(OF_AREA) for key in changed)
    if changes_area and problem.load.pressing_force is not None:
        return none  # the pressure changes with the area
    names, location, scale = affine_parameters(field.marginal)
    if "mean" in names and {MARGINAL + "low", MARGINAL + "high"} & {*changed}:
        return none  # a bound of such a marginal changes its shape
    places = {
        changed.index(MARGINAL + name): name for name in names if MARGINAL + name in changed
    }
    slopes = np.array([SLOPES[name] for name in places.values()], dtype=float).reshape(-1, 2)
    # 6.
    varies = field.quantity is not None and np.ndim(pressure) > 0
    varies = varies or np.ptp(problem.load_profile) > 0.0
    # 1. to 3.
    affine = optional_member(method, "scaling") == "affine" and not varies
    if not affine and (location or slopes[:, 0].any()):
        return none
    # At the reference, location and scale must give shift 0 and stretch 1.
    slopes[:, 1] /= scale
    slopes[:, 0] -= location * slopes[:, 1]
    # Onsets are stresses, or coefficients if the peaks are coefficients.
    mean = 1.0 if pressure is None else float(np.mean(pressure))
    slopes[:, 0] *= mean ** (
        (field.quantity is not None) - (variable == "friction_coefficient")
    )
    return Scaling(tuple(places), middle, slopes)

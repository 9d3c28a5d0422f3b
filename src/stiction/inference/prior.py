"""The prior: unknown parameters, their distributions before the tests, and scaling parameters."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed
from stiction.base.model import describe
from stiction.ensemble.limit_state import scales_with_strength
from stiction.methods.protocol import optional_member
from stiction.problem.problem import Problem
from stiction.random.dotted_keys import distributions_of, full_key, with_values
from stiction.random.fields import RandomField, RandomInterface, as_random_interface
from stiction.random.marginals import affine_parameters

TAIL_PROBABILITY = 1e-4
"""Probability that is cut off at an end of a prior if its density is
zero there."""


@dataclass(frozen=True, eq=False)
class Prior:
    """Independent priors for some parameters of a problem and its random interface.

    `distributions` maps the user's keys to frozen distributions of
    `scipy.stats`. A point is given by `u`, which holds a number in [0,
    1] for each parameter. The prior is uniform in `u`. Arrays have
    shape (points, parameters). The parameters replace values in
    `problem` and `random`.
    """

    problem: Problem
    random: RandomInterface
    distributions: dict[str, Any]

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter keys, in order."""
        return tuple(self.distributions)

    @property
    def dimension(self) -> int:
        """Number of parameters."""
        return len(self.distributions)

    @property
    def middle(self) -> Array:
        """Medians of the parameters."""
        return self.theta(np.full((1, self.dimension), 0.5))[0]

    @property
    def whole(self) -> Array:
        """Lower and upper corner of the unit cube, with shape (2, parameters)."""
        return np.repeat([[0.0], [1.0]], self.dimension, axis=1)

    @property
    def ends(self) -> Array:
        """Least and greatest values, with shape (2, parameters)."""
        return self.theta(self.whole)

    def theta(self, u: Array) -> Array:
        """Return the parameters at `u`, from inverse distribution functions."""
        result = np.empty_like(u)
        for i, distribution in enumerate(self.distributions.values()):
            # An infinite end, or an end without density, cannot be
            # simulated.
            low, high = _tails(distribution)
            result[:, i] = distribution.ppf(low + (high - low) * u[:, i])
        return result

    def at(self, theta: Array) -> tuple[Problem, RandomInterface]:
        """Return the problem and the random interface at a point (parameters,)."""
        with self.named(theta):
            return with_parameters(self.problem, self.random, self.names, theta)

    def named(self, theta: Array) -> AbstractContextManager[None]:
        """Let messages of errors that are raised meanwhile begin with the point (parameters,)."""
        pairs = zip(self.names, theta, strict=True)
        return prefixed("prior: at " + ", ".join(f"{name} = {v:.4g}" for name, v in pairs))


def with_parameters(
    problem: Problem, random: RandomInterface, names: Sequence[str], values: Array
) -> tuple[Problem, RandomInterface]:
    """Return the problem and the random interface, with parameters replaced by keys of a prior."""
    keys = dict(zip(map(full_key, names), values.tolist(), strict=True))
    both = with_values({"problem": problem, "random": random}, keys)
    return both["problem"], both["random"]


def refuse_conditioned(interfaces: Iterable[RandomInterface]) -> None:
    """Refuse fields that are conditioned on the measured values of one specimen."""
    for interface in interfaces:
        for name, field in interface.properties.items():
            if field.conditions is not None:
                raise InputError(
                    f"random: {name} is conditioned on another specimen. Leave `given` out"
                )


@lru_cache(maxsize=64)
def _tails(distribution: Any) -> tuple[float, float]:
    """Return the probabilities between which a prior is used."""
    low, high = (
        0.0 if np.isfinite(end) and distribution.pdf(end) > 0.0 else TAIL_PROBABILITY
        for end in distribution.support()
    )
    return low, 1.0 - high


def make_prior(problem: Problem, random: Any, given: Any) -> Prior:
    """Return the prior for these arguments, or raise an `InputError` that lists all mistakes."""
    if not isinstance(given, Mapping) or not given:
        raise InputError(
            "prior: must map parameters to distributions or ranges, such as"
            f" {{'correlation_length': (1e-3, 1e-2)}}, got {describe(given)}"
        )
    with prefixed("prior"):
        distributions = distributions_of(given)
    if not isinstance(random, RandomField | RandomInterface):
        raise InputError(
            "prior: needs a single interface as random. Omit prior with a list or fit"
        )
    random = as_random_interface(random)
    refuse_conditioned([random])
    prior = Prior(problem, random, distributions)
    # Parameters that are valid at all corners are valid between them.
    for corner in itertools.product(*prior.ends.T):
        prior.at(np.array(corner))
    return prior


MARGINAL = "random.strength.marginal."
OF_AREA = ("problem.interface.", "problem.specimen.")
"""Beginnings of keys that change the area."""
PRESSURE = {"problem.load.normal_pressure", "problem.load.pressing_force"}
SLOPES = {"low": (1, -1), "high": (0, 1), "loc": (1, 0), "scale": (0, 1), "mean": (0, 1)}
"""Derivatives of location and scale of a marginal by its parameters, see
`affine_parameters`."""


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
    """Find the parameters of a prior that shift and stretch the strength, and therefore the onset.

    `variable` is the name of the peaks.

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
    3. In equilibrium, with slip in units of b, the strength is
       a + b max(s - W d, (tau_r - a)/b). The problem is the same only
       if (tau_r - a)/b is the same: if a = 0, and tau_r is zero or
       proportional to tau_p.
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
    scaling = [name for name in names if MARGINAL + name in changed]
    slopes = np.array([SLOPES[name] for name in scaling], dtype=float).reshape(-1, 2)
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
    power = (field.quantity is not None) - (variable == "friction_coefficient")
    slopes[:, 0] *= mean**power
    places = tuple(changed.index(MARGINAL + name) for name in scaling)
    return Scaling(places, middle, slopes)

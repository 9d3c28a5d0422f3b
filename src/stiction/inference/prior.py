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

    Two parameters, the first between 2 and 5, the second with density 2x:

    >>> from scipy.stats import beta, uniform
    >>> prior = Prior(None, None, {"a": uniform(2, 3), "b": beta(2, 1)})
    >>> prior.names, prior.dimension, prior.middle.round(4).tolist()
    (('a', 'b'), 2, [3.5, 0.7071])
    >>> prior.whole.tolist()
    [[0.0, 0.0], [1.0, 1.0]]
    >>> prior.ends.round(6).tolist()  # sqrt(1e-4) is the least value of b
    [[2.0, 0.01], [5.0, 1.0]]
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
        """Return the parameters at `u`, from inverse distribution functions.

        >>> from scipy.stats import beta, uniform
        >>> prior = Prior(None, None, {"a": uniform(2, 3), "b": beta(2, 1)})
        >>> prior.theta(np.array([[0.25, 0.64], [1.0, 0.09]])).round(3).tolist()
        [[2.75, 0.8], [5.0, 0.3]]
        """
        result = np.empty_like(u)
        for i, distribution in enumerate(self.distributions.values()):
            # An infinite end, or an end without density, cannot be
            # simulated.
            low, high = _tails(distribution)
            result[:, i] = distribution.ppf(low + (high - low) * u[:, i])
        return result

    def at(self, theta: Array) -> tuple[Problem, RandomInterface]:
        """Return the problem and the random interface at a point (parameters,).

        >>> import stiction as st
        >>> problem = st.paper.problem(nodes=256)
        >>> given = {"problem.solid.density": (900, 1300), "correlation_length": (1e-3, 4e-3)}
        >>> prior = make_prior(problem, st.paper.strength(problem), given)
        >>> problem, random = prior.at(np.array([950.0, 3e-3]))
        >>> float(problem.solid.density), float(random.strength.spectrum.correlation_length)
        (950.0, 0.003)
        >>> _ = prior.at(np.array([-950.0, 3e-3]))  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: prior: at problem.solid.density = -950, correlation_...
        """
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
    """Refuse fields that are conditioned on the measured values of one specimen.

    >>> import stiction as st
    >>> field = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), st.PowerLawSpectrum(2e-3))
    >>> refuse_conditioned([st.RandomInterface(strength=field)])
    >>> from types import SimpleNamespace
    >>> second = SimpleNamespace(properties={"a": field, "b": SimpleNamespace(conditions=1)})
    >>> refuse_conditioned([st.RandomInterface(strength=field), second])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: random: b is conditioned on another specimen. ...
    """
    for interface in interfaces:
        for name, field in interface.properties.items():
            if field.conditions is not None:
                raise InputError(
                    f"random: {name} is conditioned on another specimen. Leave `given` out"
                )


@lru_cache(maxsize=64)
def _tails(distribution: Any) -> tuple[float, float]:
    """Return the probabilities between which a prior is used.

    >>> from scipy.stats import beta, expon, norm, uniform
    >>> [_tails(d) for d in (uniform(2, 3), beta(2, 1), expon(), norm())]
    [(0.0, 1.0), (0.0001, 1.0), (0.0, 0.9999), (0.0001, 0.9999)]
    """
    low, high = (
        0.0 if np.isfinite(end) and distribution.pdf(end) > 0.0 else TAIL_PROBABILITY
        for end in distribution.support()
    )
    return low, 1.0 - high


def make_prior(problem: Problem, random: Any, given: Any) -> Prior:
    """Return the prior for these arguments, or raise an `InputError` that lists all mistakes.

    All corners are tried. Here the lower bound passes the upper bound,
    1.66e6, at one end:

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> random = st.paper.strength(problem)
    >>> make_prior(problem, random, {"marginal.low": (5e5, 8e5)}).middle.tolist()
    [650000.0]
    >>> make_prior(problem, random, {"marginal.low": (5e5, 2e6)})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: prior: at marginal.low = 2e+06: ...
    """
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
        """Return shift (in the unit of the peaks) and stretch at points, with shape (2, points).

        >>> scaling = Scaling((1,), np.array([7.0, 2.0]), np.array([[10.0, 0.5]]))
        >>> scaling.of(np.array([[7.0, 2.0], [8.0, 5.0]])).tolist()
        [[0.0, 30.0], [1.0, 2.5]]
        >>> both = Scaling((1, 0), np.array([7.0, 2.0]), np.array([[10.0, 0.5], [3.0, 0.0]]))
        >>> both.of(np.array([[8.0, 5.0]])).tolist()
        [[33.0], [2.5]]
        """
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

    Let the strength lie between 0.4 and 2.4 MPa. A lower bound at 0.6 MPa
    shifts and stretches it, because 0.6 + 1.8 s = 0.24 + 0.9 (0.4 + 2 s).
    In equilibrium only stretching is possible:

    >>> import stiction as st
    >>> interface = st.Interface(0.1, 256, width=0.01)
    >>> spectrum = st.PowerLawSpectrum(correlation_length=2e-3)
    >>> solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress")
    >>> def scaling(ends, theta, given, method=st.LocalCriterion(), quantity=None, of="Pa",
    ...             load=st.Load(), **weakening):
    ...     weakening = weakening or {"weakening_rate": 5e11}
    ...     problem = st.Problem(solid=solid, interface=interface, load=load,
    ...                          friction=st.LinearWeakening(**weakening))
    ...     if isinstance(ends, tuple):
    ...         ends = st.Beta(alpha=1.5, beta=3.0, low=ends[0], high=ends[1])
    ...     field = st.RandomField(ends, spectrum, quantity=quantity)
    ...     prior = Prior(problem, as_random_interface(field), distributions_of(given))
    ...     variable = "critical_stress" if of == "Pa" else "friction_coefficient"
    ...     found = find_scaling(prior, method, variable)
    ...     return found.keys, found.of(np.array([theta])).round(6).T.tolist()
    >>> low, high = {"marginal.low": (2e5, 6e5)}, {"marginal.high": (1.4e6, 3.4e6)}
    >>> scaling((4e5, 2.4e6), [6e5], low)
    ((0,), [[240000.0, 0.9]])
    >>> scaling((4e5, 2.4e6), [6e5], low, method=st.Equilibrium())[0]
    ()
    >>> scaling((0.0, 2.4e6), [3.6e6], high, method=st.Equilibrium())
    ((0,), [[0.0, 1.5]])

    An upper bound of 3.4 MPa gives 0.4 + 3 s = -0.2 + 1.5 (0.4 + 2 s). The
    density of the solid does not scale the onset:

    >>> more = {"problem.solid.density": (900, 1300)} | high
    >>> scaling((4e5, 2.4e6), [950.0, 3.4e6], more)
    ((1,), [[-200000.0, 1.5]])
    >>> scaling((4e5, 2.4e6), [3.4e6, 6e5], high | low)
    ((1, 0), [[40000.0, 1.4]])

    The keys of other marginals are `loc`, `scale` and `mean`:

    >>> logistic = {"type": "logistic", "loc": 5e6, "scale": 1e5}
    >>> given = {"marginal.scale": (5e4, 1.5e5), "marginal.loc": (4e6, 6e6)}
    >>> scaling(logistic, [2e5, 4e6], given)  # 4 + 0.2 s = -6 + 2 (5 + 0.1 s)
    ((1, 0), [[-6000000.0, 2.0]])
    >>> scaling(st.Lognormal(mean=1e6, cv=0.2), [1.5e6], {"marginal.mean": (5e5, 1.5e6)})
    ((0,), [[0.0, 1.5]])

    A coefficient from 0.4 instead of 0.3 to 0.8 shifts by 0.16. At a
    pressure of 2 MPa the shift is 0.32 MPa:

    >>> low, load = {"marginal.low": (0.2, 0.4)}, st.Load(normal_pressure=2e6)
    >>> mu = {"quantity": "friction_coefficient", "load": load}
    >>> scaling((0.3, 0.8), [0.4], low, **mu), scaling((0.3, 0.8), [0.4], low, **mu, of="1")
    (((0,), [[320000.0, 0.8]]), ((0,), [[0.16, 0.8]]))
    >>> scaling((4e5, 2.4e6), [6e5], {"marginal.low": (2e5, 6e5)}, load=load, of="1")
    ((0,), [[0.12, 0.9]])

    If the pressure varies, or the load profile, no shift is possible. The
    pressure must not be among the parameters, nor the area that carries a
    force. A fracture energy excludes all scaling:

    >>> crooked = 2e6 + 1e6 * np.cos(20.0 * np.pi * interface.x)
    >>> varying = mu | {"load": st.Load(normal_pressure=crooked)}
    >>> scaling((0.3, 0.8), [0.4], low, **varying)[0]
    ()
    >>> scaling((0.0, 0.8), [1.2], {"marginal.high": (0.4, 1.2)}, **varying)
    ((0,), [[0.0, 1.5]])
    >>> scaling((4e5, 2.4e6), [3.4e6], high, load=varying["load"])
    ((0,), [[-200000.0, 1.5]])
    >>> scaling((4e5, 2.4e6), [3.4e6], high, load=st.Load(profile=crooked / 2e6))[0]
    ()
    >>> scaling((0.3, 0.8), [0.4, 3e6], low | {"problem.load.normal_pressure": (1e6, 3e6)}, **mu)[0]
    ()
    >>> scaling((4e5, 2.4e6), [3.4e6], high, fracture_energy=1.0)[0]
    ()

    >>> width, force = {"problem.interface.width": (0.007, 0.009)}, st.Load(pressing_force=2e3)
    >>> ends, new = (4e5, 2.4e6), [3.4e6, 0.008]
    >>> [scaling(ends, new, high | width, load=load)[0] for load in (load, force)]
    [(0,), ()]
    >>> pressing = high | {"problem.load.pressing_force": (1e3, 3e3)}
    >>> new[1] = 2e3
    >>> [scaling(ends, new[:len(given)], given, load=force)[0] for given in (high, pressing)]
    [(0,), ()]
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

"""Marginals: distributions of a property at a point.

To add a family, write a subclass of `Marginal`, define `distribution`,
and `register` the class. Study files also accept every continuous
distribution of `scipy.stats` by its name.
"""

import math
from abc import abstractmethod
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Annotated, Any, ClassVar, Literal, Protocol, Self, TypeAlias

import numpy as np
import scipy.stats
from pydantic import Field, model_validator
from scipy.optimize import brentq, root
from scipy.special import gammaln

from stiction.base.arrays import Array
from stiction.base.errors import InputError, UnitWarning, unknown_name, warn_user
from stiction.base.kinds import Kinds, OneOf, from_table, register
from stiction.base.model import Converted, Listed, Positive, Real, check, model

Bound: TypeAlias = Annotated[Real, Field(gt=-1e18, lt=1e18)]


class Marginal(Listed):
    """Base class of marginals.

    A class may also define ``of_normal(z)``, which returns
    F^-1(Phi(z)) in closed form and replaces the tables in
    `mapping`. Marginals of the class use the same tables if
    `_scipy_family` is their family in scipy, and `distribution`
    is this family with shapes, `low` and scale in this order.
    """

    family: ClassVar[str] = "marginals"
    _shown: ClassVar[tuple[str, ...]] = ("distribution",)
    type: str
    _scipy_family: ClassVar[Any] = None

    @property
    @abstractmethod
    def distribution(self) -> Any:
        """Frozen `scipy.stats` distribution of the marginal."""

    def check_moments(self, given: object = "") -> None:
        """Raise an `InputError` unless the distribution is frozen and its moments are finite.

        >>> from types import SimpleNamespace as Named
        >>> def check(law):
        ...     try:
        ...         Marginal.check_moments(Named(distribution=law, type="own"), "mine")
        ...     except InputError as error:
        ...         return str(error)[:70]
        >>> check(scipy.stats.norm(2.0, 0.5))
        >>> check(scipy.stats.norm)
        'own: its distribution must be frozen, such as scipy.stats.norm(1e6, 2e'
        >>> check(scipy.stats.cauchy(2.0, 0.5)) == check(scipy.stats.pareto(1.5))  # no variance
        True
        >>> check(scipy.stats.pareto(1.5))
        'own: must have a finite mean and a positive, finite standard deviation'
        """
        distribution = self.distribution
        if not hasattr(distribution, "dist"):
            raise InputError(
                f"{self.type}: its distribution must be frozen, such as scipy.stats.norm(1e6, 2e5),"
                f" got {type(distribution).__name__}"
            )
        mean, deviation = distribution.mean(), distribution.std()
        if not (np.isfinite(mean) and np.isfinite(deviation) and deviation > 0.0):
            raise InputError(
                f"{self.type}: must have a finite mean and a positive, finite standard deviation,"
                f" got {mean:g} and {deviation:g} from {given or self}"
            )


@cache
def _frozen_once(family: Any) -> Any:
    """Return a frozen distribution, whose shapes do not matter.

    >>> _frozen_once(scipy.stats.beta).args
    (1.0, 1.0)
    """
    return family(*[1.0] * family.numargs)


def frozen(family: Any, *args: float) -> Any:
    """Return a frozen distribution from a family in scipy, with given shapes, loc and scale.

    scipy generates the documentation of each new frozen distribution,
    which takes a millisecond. A copy has the same documentation.

    >>> law = frozen(scipy.stats.truncnorm, -1.0, 2.0, 10.0, 3.0)
    >>> (
    ...     [float(end) for end in law.support()],
    ...     float(law.cdf(10.0))
    ...     == float(scipy.stats.truncnorm(-1.0, 2.0, 10.0, 3.0).cdf(10.0)),
    ... )
    ([7.0, 16.0], True)
    >>> [float(end) for end in frozen(scipy.stats.uniform, 3.0, 2.0).support()], law.args
    ([3.0, 5.0], (-1.0, 2.0, 10.0, 3.0))
    >>> float(law.a), float(law.b)  # without location and scale
    (-1.0, 2.0)
    """
    distribution = copy(_frozen_once(family))
    distribution.args = args
    distribution.a, distribution.b = family.support(*args[: family.numargs])
    return distribution


@register
@model(kw_only=True)
class Beta(Marginal):
    """Beta distribution on [low, high].

    Parameters
    ----------
    alpha, beta : float
        Shape parameters, positive.
    low, high : float
        Bounds, Pa, low < high.

    Examples
    --------
    >>> import stiction as st
    >>> float(st.Beta(alpha=1.0, beta=1.0, low=1e6, high=2e6).distribution.mean())  # uniform
    1500000.0

    >>> law = Beta(alpha=1.0, beta=3.0, low=2.0, high=6.0).distribution
    >>> float(law.mean()), [float(end) for end in law.support()]
    (3.0, [2.0, 6.0])
    """

    alpha: Positive
    beta: Positive
    low: Bound
    high: Bound
    type: Literal["beta"] = "beta"
    _scipy_family: ClassVar[Any] = scipy.stats.beta

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.low < self.high:
            raise InputError(f"low must be below high, got {self.low:g} and {self.high:g}")
        return self

    @cached_property
    def distribution(self) -> Any:
        return frozen(scipy.stats.beta, self.alpha, self.beta, self.low, self.high - self.low)


@model(kw_only=True)
class _ByMoments(Marginal):
    """Families above a lower bound, described by the mean and the coefficient of variation.

    All families have the mean and the deviation, whatever the bound is.

    >>> for family in (Lognormal, Weibull, Gamma, TruncatedNormal):
    ...     law = family(mean=3.0, cv=0.25, low=1.0).distribution
    ...     print(f"{law.mean():.6f} {law.std():.6f} {law.support()[0]:.6f}")
    3.000000 0.750000 1.000000
    3.000000 0.750000 1.000000
    3.000000 0.750000 1.000000
    3.000000 0.750000 1.000000
    """

    mean: Annotated[Positive, Field(gt=1e-18, lt=1e18)]
    cv: Annotated[Positive, Field(gt=1e-9)]
    low: Bound = 0.0

    @model_validator(mode="after")
    def _has_a_distribution(self) -> Self:
        """Accept a mean above `low` and a cv of at most 10, with a warning above 1.

        >>> from stiction.base.errors import collect_warnings
        >>> with collect_warnings() as texts:
        ...     laws = Gamma(mean=3.0, cv=1.0), Gamma(mean=3.0, cv=2.5)
        >>> [str(text) for text in texts]
        ['cv: is a standard deviation over a mean, at most 10, got 2.5 (for 2.5 % give 0.025)']
        >>> Gamma(mean=3.0, cv=10.5)  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: Gamma: cv: ..., got 10.5 (for 10.5 % give 0.105)
        """
        if not self.mean > self.low:
            raise InputError(f"mean must be above low, got {self.mean:g} and {self.low:g}")
        hint = (
            "cv: is a standard deviation over a mean, at most 10, got"
            f" {self.cv:g} (for {self.cv:g} % give {self.cv / 100:g})"
        )
        if self.cv > 10.0:
            raise InputError(hint)
        _ = self.distribution  # raises an error if no distribution has these moments
        if self.cv > 1.0:
            warn_user(hint, UnitWarning)
        return self

    def _shape(self, ratio: float) -> tuple[float, float]:
        """Return the shape, and mean divided by scale.

        `cv` belongs to the values minus `low`.
        """
        raise NotImplementedError  # a family without a shape overrides `distribution`

    @cached_property
    def distribution(self) -> Any:
        # Above the lower bound, the family has this mean and this ratio
        # of deviation to mean.
        above = self.mean - self.low
        shape, mean_over_scale = self._shape(self.cv * self.mean / above)
        return frozen(self._scipy_family, shape, self.low, above / mean_over_scale)


@register
@model(kw_only=True)
class Lognormal(_ByMoments):
    """Lognormal distribution above `low`.

    Parameters
    ----------
    mean, cv : float
        Field mean, above `low`, and coefficient of variation
        (standard deviation / mean).
    low : float
        Lower bound, by default 0.

    Examples
    --------
    >>> import stiction as st
    >>> round(st.Lognormal(mean=1e6, cv=0.2, low=0.3e6).distribution.std())
    200000
    """

    type: Literal["lognormal"] = "lognormal"
    _shown = ()
    _scipy_family: ClassVar[Any] = scipy.stats.lognorm

    def _shape(self, ratio: float) -> tuple[float, float]:
        """Return the deviation s of the logarithm, and exp(s^2 / 2).

        >>> shape, mean_over_scale = Lognormal(mean=2.0, cv=0.1)._shape(0.75)
        >>> round(shape**2, 9) == round(math.log(1.5625), 9), mean_over_scale
        (True, 1.25)
        """
        return math.sqrt(math.log1p(ratio**2)), math.sqrt(1.0 + ratio**2)

    def of_normal(self, z: Array) -> Array:
        """Return F^-1(Phi(z)), the mapping of standard normal numbers, in closed form.

        The median is 1 / 1.25 above `low`.

        >>> marginal, z = Lognormal(mean=2.0, cv=0.375, low=1.0), np.array([0.0, -2.5, 1.0])
        >>> marginal.of_normal(z)[:1].tolist()
        [1.8]
        >>> expected = marginal.distribution.ppf(scipy.stats.norm.cdf(z))
        >>> np.allclose(marginal.of_normal(z), expected, rtol=1e-9)
        True
        """
        above = self.mean - self.low
        shape, mean_over_scale = self._shape(self.cv * self.mean / above)
        return self.low + above / mean_over_scale * np.exp(shape * z)


@register
@model(kw_only=True)
class Weibull(_ByMoments):
    """Weibull distribution (of minima) above `low`, with the parameters of `Lognormal`."""

    type: Literal["weibull"] = "weibull"
    _scipy_family: ClassVar[Any] = scipy.stats.weibull_min

    def _shape(self, ratio: float) -> tuple[float, float]:
        """Return the shape k, and Gamma(1 + 1/k). The shapes 1 and 2 belong to the
        exponential and the Rayleigh distribution.

        >>> marginal = Weibull(mean=2.0, cv=0.1)
        >>> [round(number, 9) for number in marginal._shape(1.0)]
        [1.0, 1.0]
        >>> shape, mean_over_scale = marginal._shape(math.sqrt(4.0 / math.pi - 1.0))
        >>> round(shape, 9), round(mean_over_scale**2, 9) == round(math.pi / 4.0, 9)
        (2.0, True)
        >>> def ratio(shape):
        ...     return math.sqrt(
        ...         math.gamma(1.0 + 2.0 / shape) / math.gamma(1.0 + 1.0 / shape) ** 2 - 1.0
        ...     )
        >>> [round(ratio(marginal._shape(given)[0]), 7) for given in (9.99, 0.3, 0.00101)]
        [9.99, 0.3, 0.00101]
        """
        if not 1e-3 < ratio < 10.0:
            raise InputError(f"cv: must be 0.001 to 10 times mean - low, got {ratio:g}")

        def excess(log_shape: float) -> float:
            inverse = math.exp(-log_shape)
            spread = gammaln(1.0 + 2.0 * inverse) - 2.0 * gammaln(1.0 + inverse)
            return float(math.expm1(spread)) - ratio**2

        # The ratio falls from 10 to 0.001 as the shape rises from 0.2
        # to 1300. The search is in the logarithm, as the shape ranges
        # over four decades.
        shape = math.exp(brentq(excess, math.log(0.15), math.log(2e3), xtol=1e-14))
        return shape, math.exp(gammaln(1.0 + 1.0 / shape))


@register
@model(kw_only=True)
class Gamma(_ByMoments):
    """Gamma distribution above `low`, with the parameters of `Lognormal`."""

    type: Literal["gamma"] = "gamma"
    _scipy_family: ClassVar[Any] = scipy.stats.gamma

    def _shape(self, ratio: float) -> tuple[float, float]:
        """Return the shape twice, because the mean is the shape times the scale.

        >>> Gamma(mean=2.0, cv=0.1)._shape(0.5)
        (4.0, 4.0)
        """
        return ratio**-2, ratio**-2


@register
@model(kw_only=True)
class TruncatedNormal(_ByMoments):
    """Normal distribution truncated at `low` and `high`.

    Parameters
    ----------
    mean, cv : float
        Field mean and coefficient of variation (standard
        deviation / mean), both after truncation. The scatter must be
        below the scatter of an exponential distribution or, with two
        bounds, of a uniform distribution.
    low, high : float, optional
        Bounds, by default 0 and no upper bound.

    Examples
    --------
    >>> import stiction as st
    >>> marginal = st.TruncatedNormal(mean=1e6, cv=0.2, low=0.5e6, high=1.5e6)
    >>> round(float(marginal.distribution.median()))
    1000000

    >>> law = TruncatedNormal(mean=2.0, cv=0.2, low=1.5, high=4.0).distribution
    >>> f"{law.mean():.6f} {law.std():.6f}", [round(float(end), 6) for end in law.support()]
    ('2.000000 0.400000', [1.5, 4.0])

    An exponential distribution has cv = 1, and a uniform one on [0, 2] has
    the variance 1/3. No truncated normal distribution scatters more.

    >>> round(float(TruncatedNormal(mean=2.0, cv=0.98).distribution.std()), 6)
    1.96
    >>> round(float(TruncatedNormal(mean=1.0, cv=0.57, high=2.0).distribution.std()), 6)
    0.57
    >>> TruncatedNormal(mean=1.0, cv=0.58, high=2.0)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: ...cv: no normal distribution between low=0 and high=2 has ...
    """

    high: Real | None = None
    type: Literal["truncated_normal"] = "truncated_normal"

    @cached_property
    def distribution(self) -> Any:
        deviation, high = self.cv * self.mean, math.inf if self.high is None else self.high

        # Both unknowns are of order one: the shift in deviations, and
        # the log of the width.
        def parameters(guess: Any) -> tuple[float, float, float, float]:
            centre = self.mean + deviation * float(guess[0])
            width = deviation * math.exp(float(guess[1]))
            return (self.low - centre) / width, (high - centre) / width, centre, width

        def moments(guess: Any) -> Any:
            mean, variance = scipy.stats.truncnorm.stats(*parameters(guess))
            spread = np.sqrt(variance) / deviation
            return np.array([(mean - self.mean) / deviation, spread - 1.0])

        # The widest distributions: exponential, and with two bounds uniform.
        excess = self.mean - self.low
        room = min(excess**2, excess * max(high - self.mean, 0.0) / 2.0)
        # Start from the normal distribution without truncation.
        solution = root(moments, [0.0, 0.0], tol=1e-12) if deviation**2 < room else None
        if solution is None or not np.abs(moments(solution.x)).max() < 1e-8:
            raise InputError(
                f"cv: no normal distribution between low={self.low:g} and high={high:g} has"
                f" mean={self.mean:g} and cv={self.cv:g}. Lower cv, or use st.Lognormal"
            )
        return frozen(scipy.stats.truncnorm, *parameters(solution.x))


@dataclass(frozen=True)
class ScipyMarginal(Marginal):
    """Continuous `scipy.stats` distribution, given by its name and parameters.

    A distribution without a name in scipy is kept `frozen`. Such a
    distribution cannot be written to a study file, and equals only
    itself.

    >>> marginal = ScipyMarginal("uniform", (("loc", 1.0), ("scale", 3.0)))
    >>> float(marginal.distribution.mean()), marginal.plain()
    (2.5, {'type': 'uniform', 'loc': 1.0, 'scale': 3.0})
    >>> law = scipy.stats.norm(2.0, 0.5)
    >>> ScipyMarginal("own", frozen=law).distribution is law
    True
    >>> ScipyMarginal("own", frozen=law).plain()
    Traceback (most recent call last):
    ...
    ValueError: marginal is the Python distribution 'own', which scipy does not know
    """

    type: str
    parameters: tuple[tuple[str, float], ...] = ()
    frozen: Any = None

    def __post_init__(self) -> None:
        self.check_moments(dict(self.parameters))

    @cached_property
    def distribution(self) -> Any:
        return self.frozen or getattr(scipy.stats, self.type)(**dict(self.parameters))

    def plain(self) -> dict[str, Any]:
        """Return the table that describes this marginal in a study file."""
        if self.frozen is not None:
            raise ValueError(
                f"marginal is the Python distribution {self.type!r}, which scipy does not know"
            )
        return {"type": self.type, **dict(self.parameters)}


FACTOR_FAMILIES: dict[str, Any] = {
    "lognormal": Lognormal,
    "normal": TruncatedNormal,  # above zero
    "weibull": Weibull,
}
"""Distributions of the factor between specimens, by the names in
`infer` and in answers."""


def affine_parameters(marginal: Any) -> tuple[tuple[str, ...], float, float]:
    """Return the names of parameters that only shift or scale a marginal, with shift a and scale b.

    The distribution of (tau_p - a)/b does not depend on these
    parameters. a and b are linear in them.

    >>> affine_parameters(Beta(alpha=1.5, beta=2.5, low=3.0, high=7.0))
    (('low', 'high'), 3.0, 4.0)
    >>> affine_parameters(ScipyMarginal("norm", (("loc", 3.0), ("scale", 0.5))))
    (('loc', 'scale'), 3.0, 0.5)
    >>> affine_parameters(ScipyMarginal("lognorm", (("s", 0.5),)))
    (('loc', 'scale'), 0.0, 1.0)
    >>> (
    ...     affine_parameters(Weibull(mean=3.0, cv=0.2)),
    ...     affine_parameters(TruncatedNormal(mean=3.0, cv=0.2)),
    ... )
    ((('mean',), 0.0, 3.0), (('mean',), 0.0, 3.0))

    The bounds of other marginals do not move with the mean:

    >>> others = (
    ...     Weibull(mean=3.0, cv=0.2, low=1.0),
    ...     TruncatedNormal(mean=3.0, cv=0.2, high=6.0),
    ...     ScipyMarginal("own", frozen=scipy.stats.norm(2.0, 0.5)),
    ... )
    >>> {affine_parameters(marginal) for marginal in others}
    {((), 0.0, 1.0)}
    """
    if isinstance(marginal, Beta):
        return ("low", "high"), marginal.low, marginal.high - marginal.low
    if isinstance(marginal, ScipyMarginal) and marginal.frozen is None:
        parameters = dict(marginal.parameters)
        return ("loc", "scale"), parameters.get("loc", 0.0), parameters.get("scale", 1.0)
    unbounded = isinstance(marginal, _ByMoments) and getattr(marginal, "high", None) is None
    if unbounded and marginal.low == 0.0:
        return ("mean",), 0.0, marginal.mean
    return (), 0.0, 1.0


MARGINALS = Kinds("marginals")
"""Families by their names in study files. 'beta' and 'gamma' also take
parameters of scipy."""


def marginal_of(value: Any) -> Marginal:
    """Return a marginal, given as a marginal, a table {type, ...} or a frozen distribution.

    Raises an `InputError` for any other value, or if a moment is not
    finite.

    >>> marginal = marginal_of(
    ...     {"type": "beta", "alpha": 1.5, "beta": 2.5, "low": 3.0, "high": 7.0}
    ... )
    >>> (
    ...     marginal == Beta(alpha=1.5, beta=2.5, low=3.0, high=7.0),
    ...     marginal_of(marginal) is marginal,
    ... )
    (True, True)
    >>> of_scipy = {"type": "beta", "a": 1.5, "b": 2.5, "loc": 3.0, "scale": 4.0}
    >>> marginal_of(of_scipy).parameters
    (('a', 1.5), ('b', 2.5), ('loc', 3.0), ('scale', 4.0))
    >>> marginal_of(of_scipy) == marginal_of(scipy.stats.beta(1.5, 2.5, loc=3.0, scale=4.0))
    True
    >>> marginal_of({"type": "norm", "loc": 3.0}).type
    'norm'

    A histogram has no name in scipy.

    >>> law = scipy.stats.rv_histogram(([3, 1], [2.0, 4.0, 6.0]))
    >>> marginal = marginal_of(scipy.stats._distn_infrastructure.rv_continuous_frozen(law))
    >>> marginal.type, float(marginal.distribution.mean())
    ('rv_histogram', 3.5)
    >>> marginal_of(scipy.stats.poisson(3.0))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: must be st.Beta(...), st.Lognormal(...) or a frozen ...
    """
    if isinstance(value, Marginal):
        # Families of this package have finite moments by construction.
        if not type(value).__module__.startswith("stiction."):
            value.check_moments()
        return value
    if isinstance(value, Mapping):
        name, rest = value.get("type"), {k: v for k, v in value.items() if k != "type"}
        # 'beta' and 'gamma' are names here and in scipy. The parameters tell which is meant.
        theirs = name in ("beta", "gamma") and {"a", "b", "loc", "scale"} & rest.keys()
        if not isinstance(name, str) or (name in MARGINALS and not theirs):
            return marginal_of(from_table(MARGINALS, value))
        return _of_scipy(name, rest)
    family: Any = getattr(value, "dist", None)
    if not isinstance(family, scipy.stats.rv_continuous):
        raise InputError(
            "must be st.Beta(...), st.Lognormal(...) or a frozen continuous scipy.stats"
            f" distribution such as scipy.stats.lognorm(0.3, scale=1e6), got {type(value).__name__}"
        )
    name = str(getattr(family, "name", None))
    if type(family) is not type(getattr(scipy.stats, name, None)):  # for example a histogram
        return ScipyMarginal(type(family).__name__, frozen=value)
    return _of_scipy(name, value.kwds, value.args)


def _of_scipy(name: str, given: Mapping[str, Any], first: tuple[Any, ...] = ()) -> Marginal:
    """Return the marginal from a scipy family, by name and parameters.

    `first` are in order.

    >>> _of_scipy("truncnorm", {"scale": 0.5}, (-2.0, 3.0, 7.0)).parameters
    (('a', -2.0), ('b', 3.0), ('loc', 7.0), ('scale', 0.5))
    >>> _of_scipy("norm", {}, (7.0, 0.5)).parameters
    (('loc', 7.0), ('scale', 0.5))
    >>> _of_scipy("beta", {"a": 2.0, "scal": 3.0})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: beta: unknown 'scal'; did you mean 'scale'? (valid: ...)
    beta.b: missing
    """
    family = getattr(scipy.stats, name, None)
    if not isinstance(family, scipy.stats.rv_continuous):
        valid = [*MARGINALS, "lognorm", "weibull_min", "truncnorm", "uniform", "norm", "..."]
        raise InputError(unknown_name("type", name, valid))
    # Parameters in order, as scipy takes them: shapes, location, scale.
    shapes = family.shapes.replace(" ", "").split(",") if family.shapes else []
    known = [*shapes, "loc", "scale"]
    parameters = {**dict(zip(known, first, strict=False)), **given}
    problems = [unknown_name(name, key, known) for key in parameters if key not in known]
    problems += [f"{name}.{key}: missing" for key in shapes if key not in parameters]
    if problems:
        raise InputError(problems)
    values = {key: check(f"{name}.{key}", value, Real) for key, value in parameters.items()}
    return ScipyMarginal(name, tuple(values.items()))


class FrozenDistribution(Protocol):
    """A frozen distribution of `scipy.stats`."""

    def ppf(self, q: Any) -> Any: ...


MarginalObject: TypeAlias = Annotated[Any, OneOf(MARGINALS, marginal_of), "Marginal"]
AnyMarginal: TypeAlias = Converted[MarginalObject, Marginal | FrozenDistribution]
AnyMarginals: TypeAlias = Converted[
    dict[str, MarginalObject] | None, Mapping[str, Marginal | FrozenDistribution] | None
]
"""A `Beta`, `Lognormal`, ..., or any frozen continuous `scipy.stats`
distribution."""

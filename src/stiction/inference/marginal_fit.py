"""Fit marginals by maximum likelihood to values with measurement noise.

Problem. Values y = x + e contain normal noise e with standard deviation
s, and x has the distribution F from a family. Find the parameters of F that
maximise the likelihood.

Sources. The search uses Fisher's scoring with damping (Levenberg, 1944,
Quarterly of Applied Mathematics 2, 164; Marquardt, 1963, SIAM Journal
11, 431). Values are treated as independent, and the estimate remains
consistent (a composite likelihood: Varin, Reid and Firth, 2011,
Statistica Sinica 21, 5). The bootstrap gives the error of the estimate.

Steps:

1. If the noise is negligible, the likelihood is the density at the
   values. Otherwise count the values in `BINS` bins. The probability of
   a bin follows from F convolved with the noise, so that values may lie
   beyond a bound of F.
2. Search over the logarithms of scale and shape. For 'beta', search
   over both shapes and over the distances of free bounds from the mean.
   The shape at a free bound is at least 1. Otherwise the likelihood
   would grow without limit as the bound approaches a value.
3. Take steps (M + damping diag(M))^-1 g, with the score g and the
   information M. Divide the damping by 10 after a step that raises the
   likelihood, and multiply it by 10 otherwise. Hold parameters that are
   at their limits. Stop after a small gain.
4. Give a normal marginal the mean of the values, and the variance that
   they would have without noise.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import betainc, betaln, gammainc, ndtr

from stiction.base.arrays import Array
from stiction.base.errors import InputError, unknown_name
from stiction.base.model import Real, check, describe
from stiction.random.dotted_keys import with_values
from stiction.random.marginals import MARGINALS, Beta, ScipyMarginal, marginal_of

NORMAL = "normal"
BINS = 160
NOISE_DEVIATIONS = 5.0
"""Standard deviations of the noise up to which its distribution is summed."""
LEAST = 1e-12
"""Least probability of a bin."""
MARGINAL_STEP = 1e-5
WIDEST = 10.0
"""Largest distance of free bounds from the values, in ranges of the values."""
LEAST_SHAPE = 1.0
"""Least shape of 'beta' at a free bound."""
NEGLIGIBLE_NOISE = 1e-4
"""Fraction of noise in the variance that does not change a marginal."""
BOUND_MARGIN = 1e-2
"""Least distance of noisy values from a bound for a first guess, as a
fraction of their range."""
MOST_NOISE = 0.95
LEAST_TOTAL = 0.2
"""Least sum of the shapes of 'beta' that follow from moments."""
SCALED = {"mean", "low", "high", "loc", "scale"}
"""Parameters that grow with the values."""
MAX_CLIMB_STEPS = 40
HIGHEST = 1e8
"""Damping above which no step raises the likelihood."""


def _positive(u: Array) -> Array:
    """Return u, or the least number of the table of families.

    The distribution functions and log densities are as in scipy, except for
    a term log(2 pi)/2, and they accept values beyond a bound:

    >>> from scipy import stats
    >>> usual = {"lognormal": stats.lognorm(0.5), "weibull": stats.weibull_min(2.5),
    ...          "gamma": stats.gamma(3.2), "beta": stats.beta(1.5, 3.0)}
    >>> for name, (distribution, log_density) in KINDS.items():
    ...     known, u = usual[name], 0.3
    ...     aside = distribution(u, *known.args) - known.cdf(u)
    ...     of_log = log_density(u, *known.args) - known.logpdf(u)
    ...     print(*np.abs([aside, of_log]).round(6), distribution(-1.0, *known.args) == 0.0)
    0.0 0.918939 True
    0.0 0.0 True
    0.0 0.0 True
    0.0 0.0 True
    >>> float(KINDS["beta"][0](1.5, 2.0, 3.0))
    1.0
    """
    return np.maximum(u, 1e-300)


KINDS: dict[str, tuple[Callable[..., Array], Callable[..., Array]]] = {
    "lognormal": (
        lambda u, s: ndtr(np.log(_positive(u)) / s),
        lambda u, s: -np.log(u) - math.log(s) - 0.5 * (np.log(u) / s) ** 2,
    ),
    "weibull": (
        lambda u, k: -np.expm1(-(_positive(u) ** k)),
        lambda u, k: math.log(k) + (k - 1.0) * np.log(u) - u**k,
    ),
    "gamma": (
        lambda u, a: gammainc(a, _positive(u)),
        lambda u, a: (a - 1.0) * np.log(u) - u - math.lgamma(a),
    ),
    "beta": (
        lambda u, a, b: betainc(a, b, np.clip(u, 0.0, 1.0)),
        lambda u, a, b: (a - 1.0) * np.log(u) + (b - 1.0) * np.log1p(-u) - betaln(a, b),
    ),
}
"""Families that are fitted here: distribution function and log density
of (value - loc)/scale. The functions of scipy check their arguments,
which takes longer than the functions themselves."""


class Search(NamedTuple):
    """Start and limits of a search, and a function that maps its vector to parameters of scipy."""

    start: Array
    limits: Sequence[tuple[float, float]]
    parameters: Callable[[Array], tuple[float, ...]]


@dataclass(frozen=True)
class Family:
    """A family of marginals with its fixed parameters."""

    name: str
    fixed: dict[str, float]

    @property
    def label(self) -> str:
        """Name with the fixed parameters.

        >>> Family("lognormal", {"low": 0.0}).label, Family("lognormal", {"low": 3.0}).label
        ('lognormal', 'lognormal, low 3')
        >>> Family("beta", {"low": 0.0, "high": 5.0}).label
        'beta, high 5'
        """
        fixed = {k: v for k, v in self.fixed.items() if (k, v) != ("low", 0.0)}
        return ", ".join([self.name, *(f"{key} {value:g}" for key, value in fixed.items())])

    def fit(self, values: Array, noise: float = 0.0, start: Any = None) -> Any:
        """Fit the marginal to values with noise of this standard deviation (steps 1 to 4).

        Values 1, 2, 4, 8 have logarithms with mean 1.5 ln 2 and variance 1.25
        (ln 2)². A lower bound of 3 shifts them:

        >>> values = np.array([1.0, 2.0, 4.0, 8.0])
        >>> known = 2.0**1.5 * math.exp(0.625 * math.log(2.0) ** 2)
        >>> found = Family("lognormal", {"low": 0.0}).fit(values)
        >>> round(found.mean / known, 1), round(math.log1p(found.cv**2) / math.log(2.0) ** 2, 1)
        (1.0, 1.2)
        >>> found = Family("lognormal", {"low": 3.0}).fit(values + 3.0)
        >>> round((found.mean - 3.0) / known, 1), found.low
        (1.0, 3.0)

        Fits return the marginal of the values without noise, for each family:

        >>> share = (np.arange(200) + 0.5) / 200
        >>> z = normal_of(0.0, 1.0).distribution.ppf((np.arange(40) + 0.5) / 40)
        >>> gamma, weibull = MARGINALS["gamma"], MARGINALS["weibull"]
        >>> bounds = {"low": 2.0, "high": 9.0}
        >>> for family, marginal in (
        ...     (Family("gamma", {"low": 1.0}), gamma(mean=5.0, cv=0.2, low=1.0)),
        ...     (Family("weibull", {"low": 0.0}), weibull(mean=5.0, cv=0.3)),
        ...     (Family("beta", bounds), Beta(alpha=2.0, beta=3.0, **bounds)),
        ... ):
        ...     true = marginal.distribution
        ...     for noise in (0.0, 0.6):
        ...         values = np.add.outer(true.ppf(share), noise * z).ravel()
        ...         found = family.fit(values, noise).distribution
        ...         print(round(float(found.mean()), 1), round(float(found.std() / true.std()), 1))
        5.0 1.0
        5.0 1.0
        5.0 1.0
        5.0 1.0
        4.8 1.0
        4.8 1.0

        A normal marginal keeps the mean, with the variance 3.5 - 1.26 = 2.24:

        >>> values = np.array([1.0, 2.0, 3.0, 6.0])
        >>> found = Family(NORMAL, {}).fit(values, math.sqrt(1.26)).distribution
        >>> round(float(found.mean()), 9), round(float(found.var()), 9)
        (3.0, 2.24)
        """
        quiet = self.quiet(values, noise)
        if self.name == NORMAL:  # 4.
            return normal_of(float(quiet.mean()), float(quiet.std()))
        # 1. Without noise, values must lie within the bounds of the family.
        if noise**2 <= NEGLIGIBLE_NOISE * values.var():
            noise, values = 0.0, quiet
        # 2.
        distribution, log_density = KINDS[self.name]
        search_of = _beta if self.name == "beta" else _by_scale
        search = search_of(self, values, quiet, noise, start)
        limits = np.array(search.limits)
        counts, at = np.ones(values.size), values
        if noise:
            counts, at, probabilities = _bins(values, noise)

        def terms(v: Array) -> Array:
            *shapes, low, scale = search.parameters(v)
            u = (at - low) / scale
            if noise:
                return np.log(probabilities(distribution(u, *shapes)))
            return log_density(u, *shapes) - math.log(scale)

        def value_of(v: Array) -> tuple[float, Array]:
            logs = terms(v)
            return float(counts @ logs), logs

        def derivatives(v: Array, logs: Array) -> tuple[Array, Array]:
            # One-sided differences, away from the upper limits. The sum
            # of the outer products of the scores of all values is
            # Fisher's information on average.
            sides = np.where(v + MARGINAL_STEP <= limits[:, 1], MARGINAL_STEP, -MARGINAL_STEP)
            slopes = np.stack([(terms(v + s) - logs) / s.sum() for s in np.diag(sides)])
            return slopes @ counts, (slopes * counts) @ slopes.T

        # 3.
        best, _ = climb(search.start, limits, value_of, derivatives, longest=0.5, settled=1e-4)
        parameters = search.parameters(best)
        if self.name == "beta":
            a, b, low, width = parameters
            return Beta(alpha=a, beta=b, low=low, high=low + width)
        family: Any = MARGINALS[self.name]
        mean, variance = map(float, family._scipy_family.stats(*parameters))
        return family(mean=mean, cv=math.sqrt(variance) / mean, **self.fixed)

    def quiet(self, values: Array, noise: float) -> Array:
        """Return values shrunk to their variance without noise, within the bounds.

        The values have mean 3 and variance 3.5. A noise with variance 1.26 is 36 %,
        and shrinks deviations to 80 %. Values beyond a bound are moved inside it by
        1 % of the range:

        >>> values, noise = np.array([1.0, 2.0, 3.0, 6.0]), math.sqrt(1.26)
        >>> Family("beta", {}).quiet(values, noise).round(9).tolist()
        [1.4, 2.2, 3.0, 5.4]
        >>> Family("beta", {"low": 1.5, "high": 5.0}).quiet(values, noise).round(9).tolist()
        [1.55, 2.2, 3.0, 4.95]
        >>> Family("beta", {"low": 1.0, "high": 6.0}).quiet(values, 0.0).round(9).tolist()
        [1.05, 2.0, 3.0, 5.95]
        >>> loud = Family("beta", {}).quiet(values, 9.0)
        >>> round(float(loud.var() / 3.5), 9)  # at least 5 % is left
        0.05
        """
        mean, variance = float(values.mean()), float(values.var())
        share = min(noise**2 / variance, MOST_NOISE)
        low, high = self.bounds
        margin = BOUND_MARGIN * float(np.ptp(values))
        # Noise adds its variance, and the mean stays.
        values = mean + math.sqrt(1.0 - share) * (values - mean)
        values = np.where(values <= low, low + margin, values)
        return np.where(values >= high, high - margin, values)

    def parameters(self, marginal: Any) -> dict[str, float]:
        """Return the estimated parameters by name.

        >>> marginal = MARGINALS["lognormal"](mean=5.0, cv=0.2, low=1.0)
        >>> Family("lognormal", {"low": 1.0}).parameters(marginal)
        {'mean': 5.0, 'cv': 0.2}
        """
        return {n: v for n, v in _all_parameters(marginal).items() if n not in self.fixed}

    def widened(self, marginal: Any, factor: float) -> Any:
        """Return the marginal with the same mean and `factor` times the standard deviation.

        Fixed parameters do not change.

        The beta distribution has mean 3 and standard deviation 1. Its bounds move
        away from the mean, but not below zero, and not if they are fixed:

        >>> beta = Beta(alpha=2.0, beta=3.0, low=1.0, high=6.0)
        >>> def widened(marginal, factor, **fixed):
        ...     wide = Family("beta", fixed).widened(marginal, factor)
        ...     moments = wide.distribution.mean(), wide.distribution.std()
        ...     return [round(float(part), 6) for part in (wide.low, wide.high, *moments)]
        >>> widened(beta, 1.2), widened(beta, 2.0), widened(beta, 1.2, low=1.0)
        ([0.6, 6.6, 3.0, 1.2], [0.0, 9.0, 3.0, 2.0], [1.0, 6.6, 3.0, 1.2])
        >>> widened(Beta(alpha=2.0, beta=3.0, low=-1.0, high=4.0), 2.0)
        [-3.0, 7.0, 1.0, 2.0]
        >>> widened(Beta(alpha=2.0, beta=3.0, low=0.0, high=5.0), 2.0)[0]
        0.0
        >>> gamma = MARGINALS["gamma"](mean=5.0, cv=0.2, low=1.0)
        >>> found = Family("gamma", {"low": 1.0}).widened(gamma, 1.5)
        >>> found.mean, round(found.cv, 9), found.low
        (5.0, 0.3, 1.0)
        >>> found = Family(NORMAL, {}).widened(normal_of(2.0, 3.0), 1.5).distribution
        >>> float(found.mean()), float(found.std())
        (2.0, 4.5)
        """
        mean = float(marginal.distribution.mean())
        deviation = factor * float(marginal.distribution.std())
        if self.name == NORMAL:
            return normal_of(mean, deviation)
        if not isinstance(marginal, Beta):
            return replace(marginal, cv=factor * marginal.cv)
        low, high = (mean + factor * (end - mean) for end in (marginal.low, marginal.high))
        if marginal.low >= 0.0:
            low = max(low, 0.0)
        # A fixed bound stays, so the shapes must follow from the moments.
        return beta_of(mean, deviation, **{"low": low, "high": high} | self.fixed)

    @property
    def limited_shapes(self) -> tuple[str, ...]:
        """Keys of the shapes that are at least `LEAST_SHAPE`, because their bounds are free.

        >>> [Family(*family).limited_shapes for family in (("beta", {}), ("beta", {"low": 0.0}),
        ...                                                ("beta", {"high": 5.0}), ("gamma", {}))]
        [('marginal.alpha', 'marginal.beta'), ('marginal.beta',), ('marginal.alpha',), ()]
        """
        shapes = {"low": "marginal.alpha", "high": "marginal.beta"}
        free = shapes.keys() - self.fixed.keys() if self.name == "beta" else ()
        return tuple(shapes[bound] for bound in sorted(free, reverse=True))

    @property
    def bounds(self) -> tuple[float, float]:
        """Support of the family with its fixed parameters, before any fit.

        >>> Family("beta", {"high": 5.0}).bounds, Family("gamma", {"low": 1.0}).bounds
        ((-inf, 5.0), (1.0, inf))
        """
        return self.fixed.get("low", -math.inf), self.fixed.get("high", math.inf)

    def check(self, values: Array) -> None:
        """Refuse values that are impossible in the family.

        >>> Family("beta", {"low": 1.0, "high": 5.0}).check(np.array([1.1, 4.9]))
        >>> Family("beta", {"low": 1.0, "high": 5.0}).check(np.array([1.0, 3.0, 5.0, 6.0]))
        ... # doctest: +ELLIPSIS
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: marginal: 3 of 4 values lie outside the bounds ...
        """
        low, high = self.bounds
        if outside := int(((values <= low) | (values >= high)).sum()):
            raise InputError(
                f"marginal: {outside} of {values.size} values lie outside the bounds of"
                f" {self.name!r}, {low:.6g} and {high:.6g}. Widen the bounds, or pass noise=True"
            )


def beta_of(mean: float, deviation: float, low: float, high: float) -> Beta:
    """Return the beta distribution with these moments.

    The bounds limit its standard deviation.

    >>> found = beta_of(3.0, 1.0, 1.0, 6.0)  # u = 0.4, and 0.24/0.2² - 1 = 5
    >>> round(found.alpha, 9), round(found.beta, 9), found.low, found.high
    (2.0, 3.0, 1.0, 6.0)
    >>> found = beta_of(3.0, 100.0, 1.0, 6.0)  # the shapes sum to 0.2 at least
    >>> round(found.alpha, 9), round(found.beta, 9)
    (0.08, 0.12)
    """
    u, extent = (mean - low) / (high - low), high - low
    total = max(u * (1.0 - u) / (deviation / extent) ** 2 - 1.0, LEAST_TOTAL)
    return Beta(alpha=total * u, beta=total * (1.0 - u), low=low, high=high)


def normal_of(mean: float, deviation: float) -> Any:
    """Return the normal distribution with these moments.

    >>> found = normal_of(2.0, 3.0).distribution
    >>> float(found.mean()), float(found.std())
    (2.0, 3.0)
    """
    return marginal_of({"type": "norm", "loc": mean, "scale": deviation})


def _all_parameters(marginal: Any) -> dict[str, float]:
    """Return the parameters of a marginal by name, if they are set.

    >>> _all_parameters(MARGINALS["truncated_normal"](mean=2.0, cv=0.3, low=1.0))
    {'mean': 2.0, 'cv': 0.3, 'low': 1.0}
    >>> sorted(_all_parameters(normal_of(2.0, 3.0)).items())
    [('loc', 2.0), ('scale', 3.0)]
    """
    named = marginal.parameters if isinstance(marginal, ScipyMarginal) else vars(marginal)
    names = {"type", "distribution"}
    return {n: float(v) for n, v in dict(named).items() if v is not None and n not in names}


def multiplied(marginal: Any, factor: float) -> Any:
    """Return the marginal for values that are multiplied by a factor.

    >>> found = multiplied(MARGINALS["lognormal"](mean=2.0, cv=0.3, low=1.0), 3.0)
    >>> found.mean, found.cv, found.low
    (6.0, 0.3, 3.0)
    >>> found = multiplied(Beta(alpha=1.5, beta=3.0, low=1.0, high=2.0), 3.0)
    >>> found.alpha, found.beta, found.low, found.high
    (1.5, 3.0, 3.0, 6.0)
    >>> found = multiplied(normal_of(2.0, 0.5), 3.0).distribution
    >>> float(found.mean()), float(found.std())
    (6.0, 1.5)
    """
    parameters = _all_parameters(marginal)
    larger = {name: factor * parameters[name] for name in parameters.keys() & SCALED}
    return marginal_of(with_values(marginal, larger))


def family_table(given: Any) -> dict[str, Any]:
    """Return a table {type, ...} for a name or a table.

    >>> family_table("gamma"), family_table({"type": "beta", "low": 1.0})
    ({'type': 'gamma'}, {'type': 'beta', 'low': 1.0})
    """
    if isinstance(given, Mapping):
        return dict(given)
    if not isinstance(given, str):
        raise InputError(
            f"must be a name or a table {{'type': name, ...}}, got {describe(given)}"
        )
    return {"type": given}


def family_of(given: Any) -> Family:
    """Return the family for a name, or for a table with some parameters.

    >>> family_of("gamma").fixed, family_of("beta").fixed, family_of("normal").fixed
    ({'low': 0.0}, {}, {})
    >>> family_of({"type": "beta", "high": 5}), family_of({"type": "gamma", "low": 2}).fixed
    (Family(name='beta', fixed={'high': 5.0}), {'low': 2.0})
    >>> family_of({"type": "gamma", "high": 5})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: ...high...
    """
    fixed = family_table(given)
    name = str(fixed.pop("type", None))
    if name not in (*KINDS, NORMAL):
        raise InputError(unknown_name("type", name, [*KINDS, NORMAL]))
    known = {"beta": ["low", "high"], NORMAL: []}.get(name, ["low"])
    if problems := [unknown_name(name, key, known) for key in fixed if key not in known]:
        raise InputError(problems)
    usual = {"low": 0.0} if known == ["low"] else {}
    return Family(name, usual | {k: check(f"{name}.{k}", v, Real) for k, v in fixed.items()})


def _by_scale(family: Family, values: Array, quiet: Array, noise: float, start: Any) -> Search:
    """Return the search over scale and shape above a known lower bound (step 2).

    Above the bound 1 the mean is 2, and the variance 3.5. A lognormal
    distribution has exp(s²) = 1 + 3.5/4 and the scale 2 exp(-s²/2):

    >>> values = np.array([1.0, 2.0, 3.0, 6.0])
    >>> search = _by_scale(Family("lognormal", {"low": 1.0}), values, values, 0.0, None)
    >>> shape, low, scale = search.parameters(search.start)
    >>> round(math.exp(shape**2), 9), low, round(scale * math.exp(shape**2 / 2.0), 9)
    (1.875, 1.0, 2.0)
    >>> gamma = _by_scale(Family("gamma", {"low": 0.0}), values, values, 0.0, None)
    >>> search.limits[1], gamma.limits[1], gamma.limits[0]
    ((-5.0, 5.0), (-1.6, 7.0), (-700.0, 700.0))
    """
    low, mean = family.fixed["low"], float(quiet.mean())
    first = start or MARGINALS[family.name](mean=mean, cv=float(quiet.std()) / mean, low=low)
    shape, _, scale = first.distribution.args
    limits = [(-700.0, 700.0), (-5.0, 5.0) if family.name == "lognormal" else (-1.6, 7.0)]
    at = np.log([scale, shape])
    return Search(at, limits, lambda v: (math.exp(v[1]), low, math.exp(v[0])))


def _beta(family: Family, values: Array, quiet: Array, noise: float, start: Any) -> Search:
    """Return the search over shapes and distances of free bounds from the mean (step 2).

    The upper bound is free. The first guess is 10 % farther than the largest
    value from the mean, 3, at 6.3:

    >>> values, unit = np.array([1.0, 2.0, 3.0, 6.0]), math.sqrt(3.5)
    >>> search = _beta(Family("beta", {"low": 0.0}), values, values, 0.0, None)
    >>> a, b, low, width = search.parameters(search.start)
    >>> low, round(width, 9), round(width * a / (a + b), 9)
    (0.0, 6.3, 3.0)
    >>> [round(math.exp(end) * unit, 6) for end in search.limits[2]]  # 3, and 10 ranges more
    [3.0, 53.0]
    >>> [round(math.exp(least), 9) for least, _ in search.limits[:2]], search.limits[1][1]
    ([0.05, 1.0], 12.0)

    With noise, a bound may lie within the values. The lower bound of positive
    values is positive, and otherwise it may lie 10 ranges below them:

    >>> search = _beta(Family("beta", {"high": 9.0}), values, values, 0.1, None)
    >>> [round(math.exp(end) * k, 6) for end, k in zip(search.limits[2], (1.0, unit))]
    [0.5, 3.0]
    >>> search = _beta(Family("beta", {"high": 9.0}), values - 1.0, values - 1.0, 0.0, None)
    >>> [round(math.exp(end) * unit, 6) for end in search.limits[2]], search.limits[0][0]
    ([2.0, 52.0], 0.0)
    >>> a, b, low, width = search.parameters(search.start)
    >>> round(low, 9), round(low + width, 9)  # 2 - 1.1 x 2
    (-0.2, 9.0)
    >>> start = Beta(alpha=1.5, beta=2.5, low=-1.0, high=9.0)
    >>> search = _beta(Family("beta", {"high": 9.0}), values, values, 0.0, start)
    >>> [round(part, 9) for part in search.parameters(search.start)]
    [1.5, 2.5, -1.0, 10.0]
    """
    fixed = family.fixed
    mean, unit = float(values.mean()), float(values.std())
    sides = {name: side for name, side in (("low", -1.0), ("high", 1.0)) if name not in fixed}
    room = {"low": mean - float(values.min()), "high": float(values.max()) - mean}

    def ends_at(distances: Iterable[float]) -> dict[str, Any]:
        pairs = zip(sides.items(), distances, strict=True)
        return fixed | {name: mean + side * distance for (name, side), distance in pairs}

    def parameters(v: Array) -> tuple[float, ...]:
        ends = ends_at(unit * math.exp(at) for at in v[2:])
        return math.exp(v[0]), math.exp(v[1]), ends["low"], ends["high"] - ends["low"]

    if start is None:
        ends = ends_at(1.1 * room[name] for name in sides)
        start = beta_of(float(quiet.mean()), float(quiet.std()), **ends)
    # A free bound needs a shape of at least 1, because the likelihood
    # would grow without limit as the bound approaches a value.
    least_free = math.log(LEAST_SHAPE)
    limits = [(math.log(0.05) if end in fixed else least_free, 12.0) for end in ("low", "high")]
    first = [start.alpha, start.beta]
    for name, side in sides.items():
        first.append(max(side * (getattr(start, name) - mean) / unit, 1e-3))
        # Noise may carry values beyond a bound.
        least = 0.5 if noise else room[name] / unit * (1.0 + 1e-9)
        most = (room[name] + WIDEST * float(np.ptp(values))) / unit
        if name == "low" and values.min() > 0.0:  # positive values have no negative bound
            most = max(min(most, mean / unit * (1.0 - 1e-12)), least)
        limits.append((math.log(least), math.log(most)))
    return Search(np.log(first), limits, parameters)


def _bins(values: Array, noise: float) -> tuple[Array, Array, Callable[[Array], Array]]:
    """Return counts in bins, points, and a function that maps F at the points to probabilities.

    The convolution with the noise is a sum in steps of half a standard
    deviation or less (step 1).

    >>> counts, at, probabilities = _bins(np.arange(161.0), 0.1)  # noise far below the width, 1
    >>> counts[[0, 80, -1]].tolist(), at[[0, 80, -1]].tolist()
    ([1, 1, 2], [0.0, 80.0, 160.0])
    >>> probabilities(np.sqrt(at))[[0, 8, 15]].round(6).tolist()  # sqrt(9) - sqrt(8), ...
    [1.0, 0.171573, 0.127017]
    >>> float(probabilities(0.0 * at).max())
    1e-12

    A normal distribution with the variance 9 and noise with the variance 0.25:

    >>> counts, at, probabilities = _bins(np.arange(161.0), 0.5)
    >>> at[[0, 1, -1]].tolist()  # 5 x 0.5 beyond the values, in quarters
    [-2.5, -2.25, 162.5]
    >>> expected = np.diff(ndtr((np.arange(161.0) - 78.0) / math.sqrt(9.25)))
    >>> bool(np.abs(probabilities(ndtr((at - 78.0) / 3.0)) - expected).max() < 1e-6)
    True
    """
    counts, edges = np.histogram(values, bins=BINS)
    width = float(edges[1] - edges[0])
    # A noise that is narrow compared with a bin has no effect.
    parts, weight = 1, np.ones(1)
    if noise > 0.2 * width:
        parts = math.ceil(2.0 * width / noise)
        reach = math.ceil(NOISE_DEVIATIONS * noise * parts / width)
        weight = np.exp(-0.5 * (np.arange(-reach, reach + 1) * width / parts / noise) ** 2)
        weight /= weight.sum()
    outside = weight.size // 2
    at = edges[0] + width / parts * np.arange(-outside, BINS * parts + outside + 1)

    def probabilities(reached: Array) -> Array:
        return np.maximum(np.diff(np.convolve(reached, weight, "valid")[::parts]), LEAST)

    return counts, at, probabilities


def mean_log_likelihood(marginal: Any, values: Array, noise: float) -> float:
    """Return the mean log density of values with noise.

    With noise, the density is the probability of
    a bin over its width. The result stays finite
    if a value is almost impossible in the family.

    The density is 0.5 between 0 and 2. An impossible value has the density
    1e-12 over the range of the values, 2.5:

    >>> uniform = marginal_of({"type": "uniform", "loc": 0.0, "scale": 2.0})
    >>> found = mean_log_likelihood(uniform, np.array([0.5, 1.0, 3.0]), 0.0)
    >>> round(found - (2.0 * math.log(0.5) + math.log(1e-12 / 2.5)) / 3.0, 9)
    0.0

    With noise the variance is 1 + 0.25, and the mean log density of a normal
    variable is -log(2 pi e 1.25)/2:

    >>> values = normal_of(0.0, math.sqrt(1.25)).distribution.ppf((np.arange(4000) + 0.5) / 4000)
    >>> found = mean_log_likelihood(normal_of(0.0, 1.0), values, 0.5)
    >>> round(found + 0.5 * math.log(2.0 * math.pi * math.e * 1.25), 2) + 0.0
    0.0
    """
    if noise**2 <= NEGLIGIBLE_NOISE * values.var():
        least = math.log(LEAST / float(np.ptp(values)))
        return float(np.maximum(marginal.distribution.logpdf(values), least).mean())
    counts, at, probabilities = _bins(values, noise)
    expected = probabilities(marginal.distribution.cdf(at)) * (BINS / float(np.ptp(values)))
    return float(counts @ np.log(expected) / values.size)


def climb(
    at: Array,
    limits: Array,
    value_of: Callable[[Array], tuple[float, Any]],
    derivatives: Callable[[Array, Any], tuple[Array, Array]],
    *,
    longest: float,
    settled: float,
) -> tuple[Array, Any]:
    """Return the parameters with the greatest likelihood, and the state there (step 3).

    Steps are at most `longest`. `value_of` returns the log likelihood,
    and a state from which `derivatives` returns score and information.
    A gain below `settled` ends the search.

    The likelihood -r A r/2 has its maximum at r = v - (1, 2) = 0. If v_2 is at
    most 1.5, the maximum over v_1 is where 2 (v_1 - 1) + (1.5 - 2) = 0:

    >>> A, visited = np.array([[2.0, 1.0], [1.0, 3.0]]), []
    >>> def value_of(v):
    ...     visited.append(v)
    ...     return -0.5 * float((v - [1.0, 2.0]) @ A @ (v - [1.0, 2.0])), v
    >>> def derivatives(v, state):
    ...     return -A @ (state - [1.0, 2.0]), A
    >>> wide, narrow = np.array([[-9.0, 9.0], [-9.0, 9.0]]), np.array([[-9.0, 9.0], [-9.0, 1.5]])
    >>> best, state = climb(np.zeros(2), wide, value_of, derivatives, longest=0.5, settled=1e-9)
    >>> best.round(4).tolist(), state is best
    ([1.0, 2.0], True)
    >>> round(float(np.abs(np.diff(visited, axis=0)).max()), 9)
    0.5
    >>> start, options = np.array([20.0, 0.0]), {"longest": 99.0, "settled": 1e-9}
    >>> best, _ = climb(start, narrow, value_of, derivatives, **options)
    >>> best.round(4).tolist()
    [1.25, 1.5]
    >>> best, _ = climb(np.array([-9.0, 0.0]), narrow - 9.0, value_of, derivatives, **options)
    >>> best.tolist()  # narrow - 9 is at most 0 and -7.5
    [0.0, -7.5]

    Damping shortens steps if the information is far too small:

    >>> def too_little(v, state):
    ...     return -A @ (state - [1.0, 2.0]), 0.05 * A
    >>> best, _ = climb(np.zeros(2), wide, value_of, too_little, **options)
    >>> best.round(2).tolist()
    [1.0, 2.0]
    """
    at = np.clip(at, limits[:, 0], limits[:, 1])
    value, state = value_of(at)
    damping = 1e-3
    for _ in range(MAX_CLIMB_STEPS):
        score, information = derivatives(at, state)
        # The others could not move if a parameter pushed against its limit.
        held = ((at <= limits[:, 0]) & (score < 0.0)) | ((at >= limits[:, 1]) & (score > 0.0))
        free = np.flatnonzero(~held)
        information, score = information[np.ix_(free, free)], score[free]
        diagonal = np.diag(np.diag(information) + 1e-9 * np.trace(information) + 1e-300)
        # More damping makes steps shorter and
        # turns them towards the gradient.
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
    return at, state

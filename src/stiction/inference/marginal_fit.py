"""Marginals by maximum likelihood, with the measurement noise that values carry.

Without noise the likelihood is the density at the values. Values with noise are counted in bins;
the probability of a bin is that of the marginal, its distribution function convolved with that of
the noise, so that values beyond a bound of the marginal are no trouble. Values along a record are
correlated; the likelihood takes them for independent, which leaves the estimate consistent (a
composite likelihood) and its error to the bootstrap.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.stats
from scipy.special import betainc, betaln, gammainc, ndtr

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.inference.scoring import climb
from stiction.model import describe, is_finite
from stiction.random.marginals import (
    Beta,
    Gamma,
    Lognormal,
    ScipyMarginal,
    TruncatedNormal,
    Weibull,
    marginal_of,
)

BINS = 160
REACH = 5.0
"""Standard deviations of the noise that count."""
LEAST = 1e-12
"""Probability of a bin."""
DIFFERENCE = 1e-5
WIDEST = 10.0
"""Ranges of the values that free bounds may lie away from them: beyond, they are not seen."""
INSIDE = 1e-2
"""Of the range: how near to a bound noise leaves a value, for a first guess."""
NEGLIGIBLE = 1e-4
"""Share of noise that does not change a marginal."""
MOST_NOISE = 0.95


class Kind(NamedTuple):
    """A family fitted here, by functions of u = (value - loc)/scale and scipy's shapes."""

    made: Any
    scipys: Any
    distribution: Callable[..., Array]
    log_density: Callable[..., Array]


def _positive(u: Array) -> Array:
    return np.maximum(u, 1e-300)


def _between(below: float, above: float) -> float:
    """Probability of a standard normal number between two bounds."""
    return max(float(ndtr(above) - ndtr(below)), 1e-300)


KINDS = {
    "lognormal": Kind(
        Lognormal,
        scipy.stats.lognorm,
        lambda u, s: ndtr(np.log(_positive(u)) / s),
        lambda u, s: -np.log(u) - math.log(s) - 0.5 * (np.log(u) / s) ** 2,
    ),
    "weibull": Kind(
        Weibull,
        scipy.stats.weibull_min,
        lambda u, k: -np.expm1(-(_positive(u) ** k)),
        lambda u, k: math.log(k) + (k - 1.0) * np.log(u) - u**k,
    ),
    "gamma": Kind(
        Gamma,
        scipy.stats.gamma,
        lambda u, a: gammainc(a, _positive(u)),
        lambda u, a: (a - 1.0) * np.log(u) - u - math.lgamma(a),
    ),
    "beta": Kind(
        Beta,
        scipy.stats.beta,
        lambda u, a, b: betainc(a, b, np.clip(u, 0.0, 1.0)),
        lambda u, a, b: (a - 1.0) * np.log(u) + (b - 1.0) * np.log1p(-u) - betaln(a, b),
    ),
    "truncated_normal": Kind(
        TruncatedNormal,
        scipy.stats.truncnorm,
        lambda u, a, b: (ndtr(np.clip(u, a, b)) - ndtr(a)) / _between(a, b),
        lambda u, a, b: -0.5 * u * u - math.log(_between(a, b)),
    ),
}
SCIPYS = {"normal": "norm"}
"""Names of ours for families of scipy."""


class Search(NamedTuple):
    """Where to begin, between which limits, and scipy's parameters of a vector."""

    start: Array
    limits: Any
    parameters: Callable[[Array], tuple[float, ...]]


@dataclass(frozen=True)
class Family:
    """A family of marginals, and those of its parameters that are fixed."""

    name: str
    fixed: dict[str, float]

    def fit(self, values: Array, noise: float = 0.0, start: Any = None) -> Any:
        """Return the marginal of values (points,) that carry noise of a standard deviation.

        `start` is a marginal of this family to begin with.
        """
        quiet = self.quiet(values, noise)
        if self.name not in KINDS:
            return self._by_scipy(quiet)
        if noise**2 <= NEGLIGIBLE * values.var():
            noise, values = 0.0, quiet
        kind = KINDS[self.name]
        search = self._search(values, quiet, noise, start)
        limits = np.array(search.limits)
        counts, at, probabilities = np.ones(values.size), values, None
        if noise:
            counts, at, probabilities = _bins(values, noise)

        def terms(v: Array) -> Array:
            *shapes, low, scale = search.parameters(v)
            u = (at - low) / scale
            if probabilities is None:
                found: Array = kind.log_density(u, *shapes) - math.log(scale)
                return found
            return np.log(probabilities(kind.distribution(u, *shapes)))

        def value_of(v: Array) -> tuple[float, Array]:
            found = terms(v)
            return float(counts @ found), found

        def derivatives(v: Array, found: Array) -> tuple[Array, Array]:
            sides = np.where(v + DIFFERENCE <= limits[:, 1], DIFFERENCE, -DIFFERENCE)
            slopes = np.stack(
                [(terms(v + step) - found) / step.sum() for step in np.diag(sides)]
            )
            return slopes @ counts, (slopes * counts) @ slopes.T

        best = climb(search.start, limits, value_of, derivatives, longest=0.5, settled=1e-4)
        return self._member(search.parameters(best))

    def _search(self, values: Array, quiet: Array, noise: float, start: Any) -> Search:
        if self.name == "beta":
            return _beta(values, quiet, noise, self.fixed, start)
        low, high = self.bounds
        mean, unit = float(quiet.mean()), float(quiet.std())
        if self.name == "truncated_normal":

            def parameters(v: Array) -> tuple[float, ...]:
                middle, width = mean + unit * float(v[0]), unit * math.exp(v[1])
                return (low - middle) / width, (high - middle) / width, middle, width

            return Search(np.zeros(2), [(-8.0, 8.0), (-3.0, 2.5)], parameters)
        if start is None:
            start = KINDS[self.name].made(mean=mean, cv=unit / mean, low=low)
        shape, _, scale = start.distribution.args
        shapes = (-5.0, 5.0) if self.name == "lognormal" else (-1.6, 7.0)
        return Search(
            np.log([scale, shape]),
            [(-700.0, 700.0), shapes],
            lambda v: (math.exp(v[1]), low, math.exp(v[0])),
        )

    def _member(self, parameters: tuple[float, ...]) -> Any:
        """The marginal of scipy's parameters; most of ours have a mean and a cv instead."""
        kind = KINDS[self.name]
        if self.name == "beta":
            a, b, low, width = parameters
            return Beta(alpha=a, beta=b, low=low, high=low + width)
        mean, variance = map(float, kind.scipys.stats(*parameters))
        # A cut normal distribution may tend to an exponential or uniform one: the widest is taken
        # that its moments still determine.
        for narrower in 0.97 ** np.arange(60):
            try:
                cv = narrower * math.sqrt(variance) / mean
                return kind.made(mean=mean, cv=cv, **self.fixed)
            except InputError:
                continue
        raise InputError(f"marginal: no {self.name!r} distribution resembles the values")

    def _by_scipy(self, values: Array) -> Any:
        family = getattr(scipy.stats, SCIPYS.get(self.name, self.name))
        places = {"loc": "floc", "scale": "fscale"}
        fixed = {places.get(key, f"fix_{key}"): value for key, value in self.fixed.items()}
        try:
            return marginal_of(family(*family.fit(values, **fixed)))
        except Exception as error:  # every family of scipy has its own
            raise InputError(f"marginal: scipy cannot fit {self.name!r}: {error}") from None

    def quiet(self, values: Array, noise: float) -> Array:
        """Return values drawn together to the variance that they would have without noise."""
        mean, variance = float(values.mean()), float(values.var())
        share = min(noise**2 / variance, MOST_NOISE)
        low, high = self.bounds
        margin = INSIDE * float(np.ptp(values))
        values = mean + math.sqrt(1.0 - share) * (values - mean)
        values = np.where(values <= low, low + margin, values)
        return np.where(values >= high, high - margin, values)

    def parameters(self, marginal: Any) -> dict[str, float]:
        """Return what was estimated, by name."""
        own = vars(marginal) if not isinstance(marginal, ScipyMarginal) else marginal.parameters
        known = {"type", "distribution", *self.fixed}
        return {n: float(v) for n, v in dict(own).items() if v is not None and n not in known}

    @property
    def bounds(self) -> tuple[float, float]:
        """The support as far as it is known before anything is fitted."""
        return self.fixed.get("low", -math.inf), self.fixed.get("high", math.inf)

    def check(self, values: Array) -> None:
        """Refuse values that the family cannot have."""
        low, high = self.bounds
        outside = (values <= low) | (values >= high)
        if outside.any():
            raise InputError(
                f"marginal: {int(outside.sum())} of {values.size} values, from {values.min():.6g}"
                f" to {values.max():.6g}, do not lie between the bounds of {self.name!r},"
                f" {low:.6g} and {high:.6g}; give others, as in marginal={{'type': {self.name!r},"
                " 'low': ...}, or noise=True if measurement noise carries them there"
            )


def name_and_fixed(
    given: Any, names: Iterable[str], parameters: Callable[[str], Iterable[str] | None]
) -> tuple[str, dict[str, float]]:
    """Return the name of a family and its given parameters, from a name or a table {type, ...}.

    `names` are offered where a name is unknown, that is where it has no `parameters`.
    """
    table = {"type": given} if isinstance(given, str) else given
    if not isinstance(table, Mapping):
        raise InputError(
            "must be a name, or a table with the parameters to keep, such as"
            f" {{'type': 'beta', 'low': 0.0}}, got {describe(given)}"
        )
    fixed = {str(key): value for key, value in table.items() if key != "type"}
    name = str(table.get("type"))
    known = parameters(name)
    if known is None:
        raise InputError(unknown_name("type", name, names))
    problems = [unknown_name(name, key, known) for key in fixed if key not in known]
    problems += [
        f"{key}: must be a finite number, got {describe(value)}"
        for key, value in fixed.items()
        if not is_finite(value)
    ]
    if problems:
        raise InputError(problems)
    return name, {key: float(value) for key, value in fixed.items()}


def _parameters(name: str) -> Iterable[str] | None:
    """What may be given of a family."""
    if name in KINDS:
        return ("low", "high") if name in ("beta", "truncated_normal") else ("low",)
    family = getattr(scipy.stats, SCIPYS.get(name, name), None)
    if not isinstance(family, scipy.stats.rv_continuous):
        return None
    return (*(family.shapes or "").replace(" ", "").split(","), "loc", "scale")


def family_of(given: Any) -> Family:
    """Return the family of a name, or of a table with some of its parameters."""
    name, fixed = name_and_fixed(given, [*KINDS, *SCIPYS, "uniform"], _parameters)
    zero = {"low": 0.0} if name in KINDS and name != "beta" else {}
    return Family(name, zero | fixed)


def families_of(given: Any) -> list[Family]:
    """Return the families of one such name or table, or of several."""
    several = given if isinstance(given, list | tuple) else [given]
    if not several:
        raise InputError("must name a family")
    return [family_of(one) for one in several]


def _beta(
    values: Array, quiet: Array, noise: float, fixed: dict[str, float], start: Any
) -> Search:
    """Shapes, and the distances of free bounds from the mean, as logarithms."""
    mean, unit = float(values.mean()), float(values.std())
    sides = {name: side for name, side in (("low", -1.0), ("high", 1.0)) if name not in fixed}
    room = {"low": mean - float(values.min()), "high": float(values.max()) - mean}

    def parameters(v: Array) -> tuple[float, ...]:
        ends = fixed | {
            name: mean + side * unit * math.exp(at)
            for (name, side), at in zip(sides.items(), v[2:], strict=True)
        }
        return math.exp(v[0]), math.exp(v[1]), ends["low"], ends["high"] - ends["low"]

    if start is None:
        ends: dict[str, Any] = {
            name: mean + 1.1 * side * room[name] for name, side in sides.items()
        } | fixed
        u = (quiet - ends["low"]) / (ends["high"] - ends["low"])
        total = max(u.mean() * (1.0 - u.mean()) / u.var() - 1.0, 0.2)
        start = Beta(alpha=total * u.mean(), beta=total * (1.0 - u.mean()), **ends)
    distances = [side * (getattr(start, name) - mean) / unit for name, side in sides.items()]
    # Below 1 a shape makes the likelihood grow without bound as its bound nears a value.
    limits = [(math.log(0.05) if end in fixed else 0.0, 12.0) for end in ("low", "high")]
    for name in sides:
        least = 0.5 if noise else room[name] / unit * (1.0 + 1e-9)
        most = (room[name] + WIDEST * float(np.ptp(values))) / unit
        limits.append((math.log(least), math.log(most)))
    first = np.log([start.alpha, start.beta, *np.maximum(distances, 1e-3)])
    return Search(first, limits, parameters)


def _bins(values: Array, noise: float) -> tuple[Array, Array, Callable[[Array], Array]]:
    """Counts of values in bins, and how their probabilities follow from a distribution function.

    Returns
    -------
    counts : (BINS,) array
    at : array
        Where the function of the values without noise is needed, at equal distances.
    probabilities : callable
        From it to the probabilities of the bins with noise. The convolution is a sum in steps of
        half a deviation of the noise or less; noise far below the width of a bin does not count.
    """
    counts, edges = np.histogram(values, bins=BINS)
    width = float(edges[1] - edges[0])
    parts, weight = 1, np.ones(1)
    if noise > 0.2 * width:
        parts = math.ceil(2.0 * width / noise)
        reach = math.ceil(REACH * noise * parts / width)
        weight = np.exp(-0.5 * (np.arange(-reach, reach + 1) * width / parts / noise) ** 2)
        weight /= weight.sum()
    outside = weight.size // 2
    at = edges[0] + width / parts * np.arange(-outside, BINS * parts + outside + 1)

    def probabilities(reached: Array) -> Array:
        return np.maximum(np.diff(np.convolve(reached, weight, "valid")[::parts]), LEAST)

    return counts, at, probabilities


def mean_log_likelihood(marginal: Any, values: Array, noise: float) -> float:
    """Compute that of values in bins, marginal and noise together, without the width of a bin."""
    counts, at, probabilities = _bins(values, noise)
    expected = probabilities(marginal.distribution.cdf(at))
    return float(counts @ np.log(expected) / values.size)


def distance(marginal: Any, values: Array) -> float:
    """Compute Kolmogorov's distance: the largest difference of the distribution functions."""
    expected = marginal.distribution.cdf(np.sort(values))
    steps = np.arange(values.size + 1) / values.size
    return float(max((steps[1:] - expected).max(), (expected - steps[:-1]).max()))

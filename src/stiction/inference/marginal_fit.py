"""Marginals by maximum likelihood, with the measurement noise that values carry.

Values with noise are counted in bins; the probability of a bin is that of the marginal, convolved
with normal noise by Gauss-Hermite quadrature of its distribution function, which stays smooth where
a density does not. So values that noise carried beyond a bound of the marginal are no trouble.
Without noise the likelihood is the density at the values. Values along
a record are correlated; the likelihood takes them for independent, which leaves the estimate
consistent (a composite likelihood) and its error to the bootstrap.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.stats
from scipy.special import betainc, betaln, gamma, gammainc, ndtr

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.inference.scoring import climb
from stiction.model import describe, is_finite
from stiction.random.marginals import (
    Beta,
    Gamma,
    Lognormal,
    Marginal,
    ScipyMarginal,
    TruncatedNormal,
    Weibull,
    marginal_of,
)

BINS = 160
NODES = 9
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
ANY = (-30.0, 30.0)

_X, _W = np.polynomial.hermite_e.hermegauss(NODES)
_W = _W / _W.sum()

KEEPABLE: dict[str, tuple[str, ...]] = {
    "beta": ("low", "high"),
    "lognormal": ("low",),
    "weibull": ("low",),
    "gamma": ("low",),
    "truncated_normal": ("low", "high"),
    "normal": (),
    "uniform": (),
}
"""Families that are fitted here, and which of their parameters may be given."""


class Above(NamedTuple):
    """A family above a bound, as functions of u = (value - bound)/scale and its shape.

    `moments` are, from the shape, the mean above the bound over the scale, and the deviation over
    that mean.
    """

    made: Any
    distribution: Callable[[Array, float], Array]
    log_density: Callable[[Array, float], Array]
    moments: Callable[[float], tuple[float, float]]


ABOVE = {
    "lognormal": Above(
        Lognormal,
        lambda u, s: ndtr(np.log(u) / s),
        lambda u, s: -np.log(u) - math.log(s) - 0.5 * (np.log(u) / s) ** 2,
        lambda s: (math.exp(0.5 * s * s), math.sqrt(math.expm1(s * s))),
    ),
    "weibull": Above(
        Weibull,
        lambda u, k: -np.expm1(-(u**k)),
        lambda u, k: math.log(k) + (k - 1.0) * np.log(u) - u**k,
        lambda k: (gamma(1 + 1 / k), math.sqrt(gamma(1 + 2 / k) / gamma(1 + 1 / k) ** 2 - 1)),
    ),
    "gamma": Above(
        Gamma,
        lambda u, a: gammainc(a, u),
        lambda u, a: (a - 1.0) * np.log(u) - u - math.lgamma(a),
        lambda a: (a, a**-0.5),
    ),
}


class Search(NamedTuple):
    """A family as a function of a vector between limits."""

    start: Array
    limits: Array
    distribution: Callable[[Array, Array], Array]
    """From a vector and values to probabilities."""
    log_density: Callable[[Array, Array], Array]
    marginal: Callable[[Array], Any]


@dataclass(frozen=True)
class Family:
    """A family of marginals, and which of its parameters the user has fixed.

    Attributes
    ----------
    name : str
        As in study files.
    fixed : tuple of (str, float)
    """

    name: str
    fixed: tuple[tuple[str, float], ...] = ()

    def fit(self, values: Array, noise: float = 0.0, start: Any = None) -> Any:
        """Return the marginal of values (points,) that carry noise of a standard deviation.

        Parameters
        ----------
        values : (points,) array
        noise : float
        start : marginal, optional
            Of this family, to begin with.
        """
        quiet, deviation = self.quiet(values, noise), float(values.std())
        if noise**2 <= NEGLIGIBLE * deviation**2:
            noise, values = 0.0, quiet
        search = self._search(values, quiet, noise, start)
        if not isinstance(search, Search):
            return search
        counts, terms = np.ones(values.size), lambda v: search.log_density(v, values)
        if noise:
            counts, edges = np.histogram(values, bins=BINS)
            shifted = edges[:, None] - noise * _X

            def terms(v: Array) -> Array:
                return np.log(_in_bins(search.distribution(v, shifted)))

        def value_of(v: Array) -> tuple[float, Array]:
            found: Array = terms(v)
            return float(counts @ found), found

        def derivatives(v: Array, at: Array) -> tuple[Array, Array]:
            sides = np.where(v + DIFFERENCE <= search.limits[:, 1], DIFFERENCE, -DIFFERENCE)
            slopes = np.stack([(terms(v + step) - at) / step.sum() for step in np.diag(sides)])
            return slopes @ counts, (slopes * counts) @ slopes.T

        found = climb(search.start, search.limits, value_of, derivatives, longest=0.5, settled=1e-5)
        return search.marginal(found)

    def _search(self, values: Array, quiet: Array, noise: float, start: Any) -> Any:
        """The family as a function of a vector; or the marginal where nothing is searched."""
        fixed = dict(self.fixed)
        if self.name == "normal":
            spread = math.sqrt(max(float(values.var()) - noise**2, float(quiet.var())))
            return ScipyMarginal("norm", (("loc", float(values.mean())), ("scale", spread)))
        if self.name == "uniform":
            ends = (("loc", float(quiet.min())), ("scale", float(np.ptp(quiet))))
            return ScipyMarginal("uniform", ends)
        if self.name not in KEEPABLE:
            return _by_scipy(self.name, quiet, fixed)
        if self.name == "beta":
            return _beta(values, quiet, noise, fixed, start)
        low, high = fixed.get("low", 0.0), fixed.get("high")
        if self.name == "truncated_normal":
            return _truncated_normal(quiet, low, high)
        return _above(self.name, quiet, low, start)

    def quiet(self, values: Array, noise: float) -> Array:
        """Return values drawn together to the variance that they would have without noise."""
        mean, variance = float(values.mean()), float(values.var())
        share = min(noise**2 / variance, MOST_NOISE)
        low, high = self.bounds()
        margin = INSIDE * float(np.ptp(values))
        values = mean + math.sqrt(1.0 - share) * (values - mean)
        values = np.where(values <= low, low + margin, values)
        return np.where(values >= high, high - margin, values)

    def parameters(self, marginal: Any) -> dict[str, float]:
        """Return what was estimated, by name."""
        if isinstance(marginal, ScipyMarginal):
            found = dict(marginal.parameters)
        else:
            names = [field.name for field in dataclasses.fields(marginal) if field.name != "type"]
            found = {name: getattr(marginal, name) for name in names}
        known = {"low", *dict(self.fixed)} if self.name != "beta" else dict(self.fixed)
        return {n: float(v) for n, v in found.items() if v is not None and n not in known}

    def bounds(self) -> tuple[float, float]:
        """Return the support as far as it is known before anything is fitted."""
        zero = {"low": 0.0} if self.name in (*ABOVE, "truncated_normal") else {}
        bounds = zero | dict(self.fixed)
        return bounds.get("low", -math.inf), bounds.get("high", math.inf)

    def check(self, values: Array) -> None:
        """Refuse values that the family cannot have."""
        low, high = self.bounds()
        outside = (values <= low) | (values >= high)
        if outside.any():
            raise InputError(
                f"marginal: {int(outside.sum())} of {values.size} values, from {values.min():.6g}"
                f" to {values.max():.6g}, do not lie between the bounds of {self.name!r},"
                f" {low:.6g} and {high:.6g}; give others, as in marginal={{'type': {self.name!r},"
                " 'low': ...}, or noise=True if measurement noise carries them there"
            )


def family_of(given: Any) -> Family:
    """Return the family of a name, or of a table with some of its parameters."""
    if isinstance(given, str):
        given = {"type": given}
    if not isinstance(given, Mapping):
        raise InputError(
            "marginal: must be the name of a family such as 'beta' or 'lognormal', or a table with"
            f" parameters to keep, such as {{'type': 'beta', 'low': 0.0, 'high': 2e6}}, got"
            f" {describe(given)}"
        )
    fixed = {str(key): value for key, value in given.items() if key != "type"}
    name = str(given.get("type"))
    known = KEEPABLE.get(name, ())
    if name not in KEEPABLE:
        family = getattr(scipy.stats, name, None)
        if not isinstance(family, scipy.stats.rv_continuous):
            raise InputError(unknown_name("marginal", name, [*KEEPABLE, "norm", "weibull_max"]))
        shapes = family.shapes.replace(" ", "").split(",") if family.shapes else []
        known = (*shapes, "loc", "scale")
    problems = [unknown_name(f"marginal.{name}", key, known) for key in fixed if key not in known]
    problems += [
        f"marginal.{key}: must be a finite number, got {describe(value)}"
        for key, value in fixed.items()
        if not is_finite(value)
    ]
    if problems:
        raise InputError(problems)
    return Family(name, tuple((key, float(value)) for key, value in fixed.items()))


def _above(name: str, quiet: Array, low: float, start: Any) -> Search:
    family = ABOVE[name]
    if start is None:
        mean = float(quiet.mean())
        start = family.made(mean=mean, cv=float(quiet.std()) / mean, low=low)
    shape, _, scale = start.distribution.args

    def marginal(v: Array) -> Marginal:
        above, ratio = family.moments(math.exp(v[1]))
        mean = low + math.exp(v[0]) * above
        found: Marginal = family.made(mean=mean, cv=ratio * (mean - low) / mean, low=low)
        return found

    def unit(v: Array, y: Array) -> Array:
        return np.maximum((y - low) * math.exp(-v[0]), 1e-300)

    return Search(
        np.log([scale, shape]),
        np.array([(-700.0, 700.0), (-5.0, 5.0) if name == "lognormal" else (-1.6, 7.0)]),
        lambda v, y: family.distribution(unit(v, y), math.exp(v[1])),
        lambda v, y: family.log_density(unit(v, y), math.exp(v[1])) - v[0],
        marginal,
    )


def _truncated_normal(quiet: Array, low: float, high: float | None) -> Search:
    unit, mean, top = float(quiet.std()), float(quiet.mean()), math.inf if high is None else high

    def parts(v: Array) -> tuple[float, float, float, float]:
        middle, width = mean + unit * v[0], unit * math.exp(v[1])
        return middle, width, (low - middle) / width, (top - middle) / width

    def distribution(v: Array, y: Array) -> Array:
        middle, width, below, above = parts(v)
        reached = ndtr((np.clip(y, low, top) - middle) / width) - ndtr(below)
        found: Array = np.clip(reached / max(ndtr(above) - ndtr(below), 1e-300), 0.0, 1.0)
        return found

    def log_density(v: Array, y: Array) -> Array:
        middle, width, below, above = parts(v)
        mass = max(ndtr(above) - ndtr(below), 1e-300)
        found: Array = -0.5 * ((y - middle) / width) ** 2 - math.log(width * mass)
        return found

    def marginal(v: Array) -> TruncatedNormal:
        middle, width, below, above = parts(v)
        frozen = scipy.stats.truncnorm(below, above, middle, width)
        mean, cv = float(frozen.mean()), float(frozen.std()) / float(frozen.mean())
        # Near an exponential or uniform distribution, which the likelihood may tend to, the
        # widest is taken that its moments still determine.
        for _ in range(60):
            try:
                return TruncatedNormal(mean=mean, cv=cv, low=low, high=high)
            except InputError:
                cv *= 0.97
        raise InputError(
            "marginal: no normal distribution cut at these bounds resembles the values"
        )

    return Search(
        np.zeros(2), np.array([(-8.0, 8.0), (-3.0, 2.5)]), distribution, log_density, marginal
    )


def _beta(values: Array, quiet: Array, noise: float, fixed: dict[str, float], start: Any) -> Search:
    mean, unit = float(values.mean()), float(values.std())
    sides = {name: side for name, side in (("low", -1.0), ("high", 1.0)) if name not in fixed}
    room = {"low": mean - float(values.min()), "high": float(values.max()) - mean}
    widest = WIDEST * float(np.ptp(values))

    def parts(v: Array) -> tuple[float, float, float, float]:
        ends = fixed | {
            name: mean + side * unit * math.exp(at)
            for (name, side), at in zip(sides.items(), v[2:], strict=True)
        }
        return math.exp(v[0]), math.exp(v[1]), ends["low"], ends["high"]

    def distribution(v: Array, y: Array) -> Array:
        a, b, low, high = parts(v)
        found: Array = betainc(a, b, np.clip((y - low) / (high - low), 0.0, 1.0))
        return found

    def log_density(v: Array, y: Array) -> Array:
        a, b, low, high = parts(v)
        u = (y - low) / (high - low)
        shapes = (a - 1.0) * np.log(u) + (b - 1.0) * np.log1p(-u)
        found: Array = shapes - betaln(a, b) - math.log(high - low)
        return found

    def marginal(v: Array) -> Beta:
        a, b, low, high = parts(v)
        return Beta(alpha=a, beta=b, low=low, high=high)

    if start is None:
        ends: dict[str, Any] = {
            name: mean + 1.1 * side * room[name] for name, side in sides.items()
        } | fixed
        u = (quiet - ends["low"]) / (ends["high"] - ends["low"])
        total = max(u.mean() * (1.0 - u.mean()) / u.var() - 1.0, 0.2)
        start = Beta(alpha=total * u.mean(), beta=total * (1.0 - u.mean()), **ends)
    distances = [side * (getattr(start, name) - mean) / unit for name, side in sides.items()]
    # Below 1 a shape makes the likelihood grow without bound as its bound nears a value.
    least = {name: 0.5 if noise else room[name] / unit * (1.0 + 1e-9) for name in sides}
    limits = [(math.log(0.05) if end in fixed else 0.0, 12.0) for end in ("low", "high")]
    limits += [(math.log(least[name]), math.log((room[name] + widest) / unit)) for name in sides]
    first = np.log([start.alpha, start.beta, *np.maximum(distances, 1e-3)])
    return Search(first, np.array(limits), distribution, log_density, marginal)


def _by_scipy(name: str, values: Array, fixed: dict[str, float]) -> Any:
    family = getattr(scipy.stats, name)
    options = {
        f"f{key}" if key in ("loc", "scale") else f"fix_{key}": v for key, v in fixed.items()
    }
    try:
        found = family.fit(values, **options)
    except Exception as error:  # every family of scipy has its own
        raise InputError(f"marginal: scipy cannot fit {name!r} to this: {error}") from None
    return marginal_of(family(*found))


def _in_bins(reached: Array) -> Array:
    """Probabilities of bins from the distribution function at their edges, (bins + 1, nodes)."""
    below = reached @ _W if reached.shape[1] == NODES else reached[:, 0]
    found: Array = np.maximum(np.diff(below), LEAST)
    return found


def mean_log_likelihood(marginal: Any, values: Array, noise: float) -> float:
    """Of values in bins, marginal and noise together; the width of a bin is left out."""
    counts, edges = np.histogram(values, bins=BINS)
    expected = _in_bins(marginal.distribution.cdf(edges[:, None] - noise * _X))
    return float(counts @ np.log(expected) / values.size)


def distance(marginal: Any, values: Array) -> float:
    """Largest difference between the distribution function and that of the values (Kolmogorov)."""
    ordered = np.sort(values)
    expected = marginal.distribution.cdf(ordered)
    rank = np.arange(1, ordered.size + 1) / ordered.size
    return float(np.maximum(rank - expected, expected - rank + 1.0 / ordered.size).max())

"""Marginals by maximum likelihood, family by family, from what few numbers each needs.

Values along a record are correlated; the likelihood takes them for independent, which leaves the
estimate consistent (a composite likelihood) and its error to the bootstrap.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats
from scipy.optimize import brentq, minimize
from scipy.special import betaln, digamma, polygamma

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.inference.noisy_marginal import without_noise
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

WIDEST = 10.0
"""Ranges of the values that free bounds may lie away from them: beyond, they are not seen."""
INSIDE = 1e-2
"""Of the range: how near to a bound noise leaves a value, for a first guess."""
NEGLIGIBLE = 1e-4
"""Share of noise that does not change a marginal."""
MOST_NOISE = 0.95


@dataclass(frozen=True)
class Family:
    """A family of marginals, and which of its parameters the user has fixed.

    Attributes
    ----------
    name : str
        As in study files.
    fixed : mapping of str to float
    """

    name: str
    fixed: tuple[tuple[str, float], ...] = ()

    def fit(self, values: Array, noise: float = 0.0) -> Any:
        """The marginal of values (points,) that carry noise of a standard deviation."""
        fixed = dict(self.fixed)
        quiet = self.quiet(values, noise)
        if self.name not in _OWN:
            return _by_scipy(self.name, quiet, fixed)
        found = _OWN[self.name](quiet, fixed)
        if noise**2 <= NEGLIGIBLE * float(values.var()):
            return found
        return without_noise(found, fixed, values, noise)

    def quiet(self, values: Array, noise: float) -> Array:
        """Values drawn together to the variance that they would have without noise."""
        mean, variance = float(values.mean()), float(values.var())
        share = min(noise**2 / variance, MOST_NOISE)
        return self._inside(mean + math.sqrt(1.0 - share) * (values - mean))

    def parameters(self, marginal: Any) -> dict[str, float]:
        """What was estimated, by name."""
        if isinstance(marginal, ScipyMarginal):
            found = dict(marginal.parameters)
        else:
            found = {
                field.name: getattr(marginal, field.name)
                for field in dataclasses.fields(marginal)
                if field.name != "type" and getattr(marginal, field.name) is not None
            }
        known = {*dict(self.fixed), *(_BOUNDS.get(self.name, {}))}
        return {name: float(value) for name, value in found.items() if name not in known}

    def bounds(self) -> tuple[float, float]:
        """Support as far as it is known before anything is fitted."""
        bounds = _BOUNDS.get(self.name, {}) | dict(self.fixed)
        return bounds.get("low", -math.inf), bounds.get("high", math.inf)

    def _inside(self, values: Array) -> Array:
        """Values that noise carried beyond a bound, moved to just inside."""
        low, high = self.bounds()
        margin = INSIDE * float(np.ptp(values))
        values = np.where(values <= low, low + margin, values)
        return np.where(values >= high, high - margin, values)

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
    """A family from its name, a table with some of its parameters, or a marginal as a template."""
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
    if name in _OWN:
        known = _KEEPABLE[name]
    else:
        family = getattr(scipy.stats, name, None)
        if not isinstance(family, scipy.stats.rv_continuous):
            raise InputError(unknown_name("marginal", name, [*_OWN, "norm", "weibull_max"]))
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


def _lognormal(values: Array, fixed: dict[str, float]) -> Lognormal:
    low = fixed.get("low", 0.0)
    logs = np.log(values - low)
    mu, variance = float(logs.mean()), float(logs.var())
    excess = math.exp(mu + 0.5 * variance)
    mean = low + excess
    return Lognormal(mean=mean, cv=math.sqrt(math.expm1(variance)) * excess / mean, low=low)


def _gamma(values: Array, fixed: dict[str, float]) -> Gamma:
    low = fixed.get("low", 0.0)
    excess = values - low
    mean = float(excess.mean())
    gap = math.log(mean) - float(np.log(excess).mean())
    shape = brentq(lambda a: math.log(a) - digamma(a) - gap, 1e-3, 1e9, xtol=1e-12, rtol=1e-12)
    return Gamma(mean=low + mean, cv=mean / math.sqrt(shape) / (low + mean), low=low)


def _weibull(values: Array, fixed: dict[str, float]) -> Weibull:
    low = fixed.get("low", 0.0)
    logs = np.log(values - low)
    top = float(logs.max())
    average = float(logs.mean())

    def score(shape: float) -> float:
        weight = np.exp(shape * (logs - top))
        return float(weight @ logs / weight.sum()) - 1.0 / shape - average

    shape = brentq(score, 0.2, 500.0, xtol=1e-10)
    power = np.exp(shape * (logs - top)).mean()
    scale = math.exp(top) * float(power) ** (1.0 / shape)
    frozen = scipy.stats.weibull_min(shape, low, scale)
    mean = float(frozen.mean())
    return Weibull(mean=mean, cv=float(frozen.std()) / mean, low=low)


def _truncated_normal(values: Array, fixed: dict[str, float]) -> TruncatedNormal:
    # An exponential family in y and y^2: maximum likelihood equates the moments.
    # Where they are wider than any cut normal distribution, the likelihood rises towards an
    # exponential or uniform one; the widest that can still be told from it is taken.
    mean, cv = float(values.mean()), float(values.std()) / float(values.mean())
    low, high = fixed.get("low", 0.0), fixed.get("high")
    for _ in range(60):
        try:
            return TruncatedNormal(mean=mean, cv=cv, low=low, high=high)
        except InputError:
            cv *= 0.97
    raise InputError("marginal: no normal distribution cut at these bounds resembles the values")


def _normal(values: Array, fixed: dict[str, float]) -> ScipyMarginal:
    moments = (("loc", float(values.mean())), ("scale", float(values.std())))
    return ScipyMarginal("norm", moments)


def _uniform(values: Array, fixed: dict[str, float]) -> ScipyMarginal:
    return ScipyMarginal(
        "uniform", (("loc", float(values.min())), ("scale", float(np.ptp(values))))
    )


def _shapes(log_up: float, log_down: float, start: tuple[float, float]) -> tuple[float, float]:
    """alpha, beta >= 1 of the greatest likelihood, by Newton, from E log u and E log(1 - u)."""
    a, b = start
    for _ in range(60):
        both = digamma(a + b)
        ga, gb = log_up - digamma(a) + both, log_down - digamma(b) + both
        common = polygamma(1, a + b)
        haa, hbb = polygamma(1, a) - common, polygamma(1, b) - common
        determinant = haa * hbb - common * common
        da, db = (hbb * ga + common * gb) / determinant, (haa * gb + common * ga) / determinant
        a, b = float(np.clip(a + da, 0.5 * a, 2.0 * a)), float(np.clip(b + db, 0.5 * b, 2.0 * b))
        if abs(da) < 1e-9 * a and abs(db) < 1e-9 * b:
            break
    return a, b


def _beta_at(values: Array, low: float, high: float) -> tuple[float, float, float]:
    """alpha, beta and the mean log likelihood, bounds given."""
    width = high - low
    u = (values - low) / width
    up, down = float(np.log(u).mean()), float(np.log1p(-u).mean())
    mean, variance = float(u.mean()), float(u.var())
    total = max(mean * (1.0 - mean) / variance - 1.0, 0.1)
    a, b = _shapes(up, down, (max(mean * total, 0.1), max((1.0 - mean) * total, 0.1)))
    value = (a - 1.0) * up + (b - 1.0) * down - float(betaln(a, b)) - math.log(width)
    return a, b, value


def _beta(values: Array, fixed: dict[str, float]) -> Beta:
    least, most = float(values.min()), float(values.max())
    room = most - least

    def ends(at: Array) -> tuple[float, float]:
        place = iter(at)
        free_low = "low" not in fixed
        low = least - room * math.exp(next(place)) if free_low else fixed["low"]
        high = most + room * math.exp(next(place)) if "high" not in fixed else fixed["high"]
        return low, high

    free = 2 - len({"low", "high"} & fixed.keys())

    def loss(at: Array) -> float:
        if np.any(np.abs(at + 3.5) > 3.5 + math.log(WIDEST)):
            return 1e9 + float(np.sum(np.abs(at)))
        low, high = ends(at)
        a, b, value = _beta_at(values, low, high)
        # Below 1 a shape makes the likelihood grow without bound as its bound nears a value.
        return -value + 10.0 * (max(0.0, 1.0 - a) ** 2 + max(0.0, 1.0 - b) ** 2)

    if free:
        options = {"xatol": 1e-3, "fatol": 1e-8, "maxiter": 200}
        starts = [np.full(free, -3.0), np.full(free, -1.0)]
        found = min(
            (minimize(loss, s, method="Nelder-Mead", options=options) for s in starts),
            key=lambda one: one.fun,
        )
        low, high = ends(found.x)
    else:
        low, high = fixed["low"], fixed["high"]
    a, b, _ = _beta_at(values, low, high)
    return Beta(alpha=a, beta=b, low=low, high=high)


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


_OWN: dict[str, Callable[[Array, dict[str, float]], Any]] = {
    "beta": _beta,
    "lognormal": _lognormal,
    "weibull": _weibull,
    "gamma": _gamma,
    "truncated_normal": _truncated_normal,
    "normal": _normal,
    "uniform": _uniform,
}
_KEEPABLE = {
    "beta": ("low", "high"),
    "lognormal": ("low",),
    "weibull": ("low",),
    "gamma": ("low",),
    "truncated_normal": ("low", "high"),
    "normal": (),
    "uniform": (),
}
_BOUNDS: dict[str, dict[str, float]] = {
    "lognormal": {"low": 0.0},
    "weibull": {"low": 0.0},
    "gamma": {"low": 0.0},
    "truncated_normal": {"low": 0.0},
}


def distance(marginal: Any, values: Array) -> float:
    """Largest difference between the distribution function and that of the values (Kolmogorov)."""
    ordered = np.sort(values)
    expected = marginal.distribution.cdf(ordered)
    rank = np.arange(1, ordered.size + 1) / ordered.size
    return float(np.maximum(rank - expected, expected - rank + 1.0 / ordered.size).max())

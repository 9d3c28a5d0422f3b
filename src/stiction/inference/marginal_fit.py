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
        """Name with the fixed parameters."""
        fixed = {k: v for k, v in self.fixed.items() if (k, v) != ("low", 0.0)}
        return ", ".join([self.name, *(f"{key} {value:g}" for key, value in fixed.items())])

    def fit(self, values: Array, noise: float = 0.0, start: Any = None) -> Any:
        """Fit the marginal to values with noise of this standard deviation (steps 1 to 4)."""
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
        """Return values shrunk to their variance without noise, within the bounds."""
        mean, variance = float(values.mean()), float(values.var())
        share = min(noise**2 / variance, MOST_NOISE)
        low, high = self.bounds
        margin = BOUND_MARGIN * float(np.ptp(values))
        # Noise adds its variance, and the mean stays.
        values = mean + math.sqrt(1.0 - share) * (values - mean)
        values = np.where(values <= low, low + margin, values)
        return np.where(values >= high, high - margin, values)

    def parameters(self, marginal: Any) -> dict[str, float]:
        """Return the estimated parameters by name."""
        return {n: v for n, v in _all_parameters(marginal).items() if n not in self.fixed}

    def widened(self, marginal: Any, factor: float) -> Any:
        """Return the marginal with the same mean and `factor` times the standard deviation.

        Fixed parameters do not change.
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
        """Keys of the shapes that are at least `LEAST_SHAPE`, because their bounds are free."""
        shapes = {"low": "marginal.alpha", "high": "marginal.beta"}
        free = shapes.keys() - self.fixed.keys() if self.name == "beta" else ()
        return tuple(shapes[bound] for bound in sorted(free, reverse=True))

    @property
    def bounds(self) -> tuple[float, float]:
        """Support of the family with its fixed parameters, before any fit."""
        return self.fixed.get("low", -math.inf), self.fixed.get("high", math.inf)

    def check(self, values: Array) -> None:
        """Refuse values that are impossible in the family."""
        low, high = self.bounds
        if outside := int(((values <= low) | (values >= high)).sum()):
            raise InputError(
                f"marginal: {outside} of {values.size} values lie outside the bounds of"
                f" {self.name!r}, {low:.6g} and {high:.6g}. Widen the bounds, or pass noise=True"
            )


def beta_of(mean: float, deviation: float, low: float, high: float) -> Beta:
    """Return the beta distribution with these moments.

    The bounds limit its standard deviation.
    """
    u, extent = (mean - low) / (high - low), high - low
    total = max(u * (1.0 - u) / (deviation / extent) ** 2 - 1.0, LEAST_TOTAL)
    return Beta(alpha=total * u, beta=total * (1.0 - u), low=low, high=high)


def normal_of(mean: float, deviation: float) -> Any:
    """Return the normal distribution with these moments."""
    return marginal_of({"type": "norm", "loc": mean, "scale": deviation})


def _all_parameters(marginal: Any) -> dict[str, float]:
    named = marginal.parameters if isinstance(marginal, ScipyMarginal) else vars(marginal)
    names = {"type", "distribution"}
    return {n: float(v) for n, v in dict(named).items() if v is not None and n not in names}


def multiplied(marginal: Any, factor: float) -> Any:
    """Return the marginal for values that are multiplied by a factor."""
    parameters = _all_parameters(marginal)
    larger = {name: factor * parameters[name] for name in parameters.keys() & SCALED}
    return marginal_of(with_values(marginal, larger))


def family_table(given: Any) -> dict[str, Any]:
    """Return a table {type, ...} for a name or a table."""
    if isinstance(given, Mapping):
        return dict(given)
    if not isinstance(given, str):
        raise InputError(
            f"must be a name or a table {{'type': name, ...}}, got {describe(given)}"
        )
    return {"type": given}


def family_of(given: Any) -> Family:
    """Return the family for a name, or for a table with some parameters."""
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
    """Return the search over scale and shape above a known lower bound (step 2)."""
    low, mean = family.fixed["low"], float(quiet.mean())
    first = start or MARGINALS[family.name](mean=mean, cv=float(quiet.std()) / mean, low=low)
    shape, _, scale = first.distribution.args
    limits = [(-700.0, 700.0), (-5.0, 5.0) if family.name == "lognormal" else (-1.6, 7.0)]
    at = np.log([scale, shape])
    return Search(at, limits, lambda v: (math.exp(v[1]), low, math.exp(v[0])))


def _beta(family: Family, values: Array, quiet: Array, noise: float, start: Any) -> Search:
    """Return the search over shapes and distances of free bounds from the mean (step 2)."""
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

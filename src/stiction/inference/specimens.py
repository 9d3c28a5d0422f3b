"""Posterior of the mean and the scatter between specimens, from profiles and peaks, on a grid.

Problem. Specimen k has strength m b_k f(x). Here m is the mean, b_k a
factor with mean 1 and coefficient of variation s, and f a field with
mean 1 within the specimen. The data are the levels (mean strengths) of
some specimens and the peaks of others. A specimen of mean strength c
has its onset at T(c). Each measured specimen has its own factor. Find
the posterior of m, s and the family of b, averaged over equally likely
fields within a specimen.

Sources. Gelman and others, Bayesian Data Analysis (2013), chapter 5,
describe the integration of hierarchical models. Gelman (2006), Bayesian
Analysis 1, 515, proposes the half-Cauchy prior for a scatter.

In the steps, x = log(m b/reference) is the log strength of one specimen:

1. Simulate onsets T of each field at the reference mean. This is
   sufficient if T(c)/c does not depend on c. Otherwise simulate at
   `ONSET_MEANS` means and interpolate T(c)/c, sample by sample.
   T(c)/c is constant beyond these means.
2. Tabulate the likelihood of each measured number over x:
   the normal density for the logarithm of a level, or the density of
   simulated onsets at a peak (`stiction.inference.density`).
3. Choose `SCATTER_CELLS` values of s at equal steps of its prior
   probability, and `MEAN_CELLS` values of log m. The likelihood of a
   number at (family, s, m) is the integral of step 2 over the density
   of x, which is the density of log b shifted by log m: a convolution.
4. Multiply the likelihoods of all numbers, and narrow the grid to the
   means with posterior mass.
5. Given the profiles, the fields are equally
   likely. The peaks multiply their probabilities by
   the mean of the likelihood over (family, s, m).

Departure. The levels affect only the likelihood of (m, s). The fields
within a specimen come from `fit_field` for the same profiles without
their levels.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple, Self

import numpy as np
import scipy.stats
from scipy.optimize import brentq
from scipy.special import logsumexp

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, unknown_name
from stiction.ensemble.batches import in_threads, usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import scales_with_strength
from stiction.inference.density import Densities, densities_of, log_likelihoods
from stiction.inference.likelihood import (
    SPECIMEN,
    Axis,
    Simulation,
    bounds_of,
    corners,
    of_length,
    simulate,
    variable_of,
    warn_if_long,
)
from stiction.inference.marginal_fit import multiplied
from stiction.inference.peaks import Peaks
from stiction.problem.checks import doubt_strengths
from stiction.problem.problem import Problem
from stiction.random.dotted_keys import distribution_of
from stiction.random.fields import RandomField, RandomInterface
from stiction.random.marginals import FACTOR_FAMILIES, Lognormal
from stiction.random.spectra import PowerLawSpectrum

MEAN_KEY, SCATTER_KEY = "mean", "between"
"""Keys of the two parameters in a prior and among the draws."""
PRIOR_SCALE = 0.1
"""Scale of the half-Cauchy prior of s."""
LEAST_CV, MOST_CV = 2e-3, 0.9
"""Smallest and largest s."""
SCATTER_CELLS, MEAN_CELLS, ONSET_MEANS = 40, 48, 5
"""Number of values of s and of log m on the grid, and of means at which
onsets are simulated if T(c)/c depends on c."""
ONSETS, FEW_ONSETS = {"local_criterion": 200}, 100
"""Number of simulated onsets of each field, by the local criterion and
by other methods."""
LOG_STRENGTH_MARGIN = 0.3
"""Distance in the logarithm of the strength by which simulated means
exceed the range of peaks."""
LOG_MEAN_MARGIN = 1.0
"""Distance by which the first range of log m exceeds the range of x."""
LOWEST, PREDICTED = 6.0, 2_000
"""Distance of the lowest x below log m, and points of x, for a
predictive distribution."""
OUTER_MASS = 1e-6
"""Neglected mass on either side of log m."""
MAX_MEAN_ZOOMS = 4
FINE, MAX_X_POINTS = 4.0, 2_000
"""Points of x for the least standard deviation of a number, and most
points in all. Cells of x add a twelfth of their square to a variance,
which is 0.5 % of the least variance."""
LOWEST_FACTOR, TABULATED = 6.0, 2_401
"""Range of log b on either side of zero, and number of values in the
table of its distribution."""
TABULATED_DEVIATIONS = 6.0
"""Standard deviations up to which the likelihood of a number is tabulated."""
FEW_FIELDS = 10
"""Number of fields within a specimen for the sensitivities of a design,
which are only ratios."""
UNIFORM = 1e-8
"""Coefficient of variation of a field that counts as uniform."""
LEAST_DEVIATION = 1e-3
"""Least standard deviation of the logarithm of a level or a peak that
the grid resolves."""


@lru_cache(maxsize=1024)
def factor_of_family(family: str, cv: float) -> Any:
    """Return the marginal for a factor with mean 1.

    >>> factor = factor_of_family("weibull", 0.2).distribution
    >>> round(float(factor.mean()), 9), round(float(factor.std()), 9)
    (1.0, 0.2)
    """
    return FACTOR_FAMILIES[family](mean=1.0, cv=cv)


def families_of(given: Any) -> tuple[str, ...]:
    """Return families of factors: all families if True, or else the named families.

    >>> families_of("weibull"), families_of(["weibull", "lognormal", "weibull"])
    (('weibull',), ('weibull', 'lognormal'))
    >>> families_of(True) == tuple(FACTOR_FAMILIES)
    True
    >>> for given in ([], 3):
    ...     try:
    ...         families_of(given)
    ...     except InputError as error:
    ...         print(str(error)[:12])
    must be True
    must be True
    """
    names = (given,) if isinstance(given, str) else given
    names = tuple(FACTOR_FAMILIES) if given is True else names
    if not isinstance(names, list | tuple) or not names:
        raise InputError(f"must be True, False, or some of {', '.join(FACTOR_FAMILIES)}")
    if unknown := [str(name) for name in names if name not in FACTOR_FAMILIES]:
        raise InputError([unknown_name("family", name, FACTOR_FAMILIES) for name in unknown])
    return tuple(dict.fromkeys(names))


class FactorPrior(NamedTuple):
    """Priors for the scatter s and the mean.

    By default the mean is flat in its logarithm.
    """

    scatter: Any = scipy.stats.halfcauchy(scale=PRIOR_SCALE)
    mean: Any = None

    @classmethod
    def of(cls, given: Any) -> Self:
        """Return the prior, given a mapping from `MEAN_KEY` and `SCATTER_KEY` to distributions.

        >>> prior = FactorPrior.of({"between": (0.1, 0.3), "mean": (1e6, 3e6)})
        >>> [[float(end) for end in part.support()] for part in prior]
        [[0.1, 0.3], [1000000.0, 3000000.0]]
        >>> FactorPrior.of({"mean": (1e6, 3e6)}).scatter is FactorPrior().scatter
        True
        >>> FactorPrior.of({}).mean
        >>> FactorPrior.of({"between": (0.9, 1.3)})  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: prior: between: must be a coefficient of ...
        """
        with prefixed("prior"):
            priors = {key: distribution_of(key, value) for key, value in given.items()}
        prior = cls(priors.get(SCATTER_KEY, cls().scatter), priors.get(MEAN_KEY))
        low, high = prior.scatter.cdf([0.0, MOST_CV])
        if not low < high:
            raise InputError(
                f"prior: {SCATTER_KEY}: must be a coefficient of variation from 0 to {MOST_CV:g}"
            )
        return prior

    def cells(self) -> Array:
        """Return SCATTER_CELLS values of s at equal steps in prior probability.

        The steps have equal probability. Of a uniform prior from 0.7 to 1.1 only
        the part up to 0.9 counts:

        >>> cells = FactorPrior(scipy.stats.uniform(0.7, 0.4)).cells()
        >>> cells.size, cells[[0, 1, -1]].round(4).tolist()
        (40, [0.7025, 0.7075, 0.8975])
        >>> cells = FactorPrior(scipy.stats.uniform(-0.1, 0.4)).cells()  # from 0 to 0.3
        >>> cells[[0, -1]].round(5).tolist()
        [0.00375, 0.29625]
        >>> cells = FactorPrior().cells()  # tan(pi/2 share) / 10, at least 0.002
        >>> share = 2.0 / math.pi * math.atan(9.0)
        >>> expected = [0.1 * math.tan(math.pi / 2.0 * share * (k + 0.5) / 40) for k in (1, 39)]
        >>> (cells[[1, 39]] / expected).round(6).tolist()
        [1.0, 1.0]
        >>> float(cells[0])
        0.002
        """
        low, high = self.scatter.cdf([0.0, MOST_CV])
        shares = low + (high - low) * (np.arange(SCATTER_CELLS) + 0.5) / SCATTER_CELLS
        return np.maximum(self.scatter.ppf(shares), LEAST_CV)


class Profiles(NamedTuple):
    """Equally likely fields within a specimen, and the levels of the measured specimens."""

    fields: tuple[RandomInterface, ...]  # with the reference mean
    reference: float  # Pa, or a friction coefficient
    levels: Array  # (specimens,), in the unit of the reference; empty without profiles
    within: Array  # variance of the logarithm of a level by the field, (fields, specimens)
    families: tuple[str, ...] = tuple(FACTOR_FAMILIES)
    prior: FactorPrior = FactorPrior()
    whole: bool = False  # specimens differ only as a whole: the field is uniform

    @classmethod
    def without_field(cls, problem: Problem, peaks: Peaks, **more: Any) -> Self:
        """Return specimens with a uniform strength, a coefficient if there is a pressure.

        At a pressure of 2 MPa, a median of 0.7 MPa is a coefficient of 0.35. A
        force divides by the area as well:

        >>> import stiction as st
        >>> problem = st.paper.problem(nodes=256)
        >>> problem = replace(problem, interface=st.Interface(0.1, 256, width=0.02))
        >>> pressed = replace(problem, load=st.Load(normal_pressure=2e6))
        >>> def level(problem, *values, unit):
        ...     peaks = Peaks((None,), (np.array(values),), unit)
        ...     profiles = Profiles.without_field(problem, peaks)
        ...     return round(profiles.reference, 9), profiles.fields[0].strength.quantity
        >>> level(pressed, 0.6e6, 0.7e6, 0.9e6, unit="Pa"), level(pressed, 0.2, 0.35, 0.4, unit="1")
        ((0.35, 'friction_coefficient'), (0.35, 'friction_coefficient'))
        >>> level(pressed, 1200.0, 1400.0, 1900.0, unit="N")
        (0.35, 'friction_coefficient')
        >>> level(problem, 1200.0, 1400.0, 1900.0, unit="N")[0]
        700000.0
        """
        variable_of(problem, None, peaks.unit)  # checks it
        level, pressure = float(np.median(peaks.values[0])), problem.given_pressure
        if peaks.unit == "N":
            level /= problem.area or math.nan
        mean = 1.0 if pressure is None else float(np.mean(pressure))
        if peaks.unit != "1":
            level /= mean
        doubt_strengths(problem, level * mean)
        length = 0.25 * float(np.max(problem.interface.length))
        field = RandomField(
            Lognormal(mean=level, cv=UNIFORM), PowerLawSpectrum(length),
            quantity=None if pressure is None else "friction_coefficient", mean_mode=True,
        )  # fmt: skip
        fields = (RandomInterface(strength=field),)
        return cls(fields, level, np.zeros(0), np.zeros((1, 0)), whole=True, **more)

    @property
    def stated(self) -> bool:
        """Whether the field within a specimen was stated, not measured.

        >>> levels, fields = np.array([1.0, 2.0]), ("one", "two")
        >>> counts = (1, 0), (1, 2), (2, 0), (2, 2)
        >>> [Profiles(fields[:f], 1.0, levels[:k], None).stated for f, k in counts]
        [True, False, False, False]
        """
        return not self.levels.size and len(self.fields) == 1


def of_mean(random: RandomInterface, mean: float, factor: Any = None) -> RandomInterface:
    """Return a random interface with a different mean and a different factor of the strength.

    >>> import stiction as st
    >>> spectrum = st.PowerLawSpectrum(correlation_length=2e-3)
    >>> field = st.RandomField(st.Beta(alpha=2.0, beta=2.0, low=1e6, high=3e6), spectrum)
    >>> wide, narrow = st.Lognormal(mean=1.0, cv=0.3), st.Lognormal(mean=1.0, cv=0.1)
    >>> both = st.RandomInterface(strength=field, between={"strength": wide})
    >>> found = of_mean(both, 3e6, narrow)  # the mean was 2 MPa
    >>> round(found.strength.marginal.low, 3), round(found.strength.marginal.high, 3)
    (1500000.0, 4500000.0)
    >>> found.between["strength"].cv, bool(of_mean(both, 3e6).between)
    (0.1, False)
    """
    factors = {k: v for k, v in (random.between or {}).items() if k != "strength"}
    between = factors | ({} if factor is None else {"strength": factor})
    field = random.strength
    marginal = multiplied(field.marginal, mean / field.mean)
    return replace(random, strength=replace(field, marginal=marginal), between=between or None)


@dataclass(frozen=True, eq=False)
class Onsets:
    """Onsets divided by mean strength for one specimen type, by field, and their densities."""

    at: Array  # logarithms of c over the reference, (steps,)
    ratios: Array  # T(c) over c/reference, (fields, steps, samples)
    densities: tuple[Densities, ...]  # of each field
    area: float = 1.0  # ratio of peaks and onsets

    def of(self, order: Any) -> Self:
        """Return the onsets for the fields with given numbers.

        >>> ratios = np.arange(6.0).reshape(3, 1, 2)
        >>> some = Onsets(np.zeros(1), ratios, ("a", "b", "c"), 4.0).of([2, 0])
        >>> some.ratios.tolist(), some.densities, some.area
        ([[[4.0, 5.0]], [[0.0, 1.0]]], ('c', 'a'), 4.0)
        >>> Onsets(np.zeros(1), ratios, ()).of([1]).densities
        ()
        """
        densities = tuple(self.densities[k] for k in order) if self.densities else ()
        return replace(self, ratios=self.ratios[order], densities=densities)

    def tabulated(self, field: int, peaks: Array, error: float, x: Array) -> Array:
        """Return the log density (peaks, points) of each peak at x for a field.

        Uniform fields slide at T(c) = 2 c, or at 4 c if log c is 1, with an area 3.
        The error 0.6 is 5 % of the peak 12, and the peak 30 is known to 2 %:

        >>> peaks, x = np.array([12.0, 30.0]), np.array([0.5, 0.7])
        >>> onsets = Onsets(np.array([0.0]), np.array([[[1.0]], [[2.0]]]), (), 3.0)
        >>> found = onsets.tabulated(1, peaks, 0.6, x)
        >>> logs = scipy.stats.norm.logpdf(np.log(peaks / 6.0)[:, None] - x, 0.0, [[0.05], [0.02]])
        >>> expected = logs - np.log(peaks)[:, None] + 0.5 * math.log(2.0 * math.pi)
        >>> bool(np.allclose(found, expected))
        True
        >>> rising = Onsets(np.array([0.0, 1.0]), np.array([[[2.0], [4.0]]]), (), 3.0)
        >>> away = math.log(12.0 / 6.0) - 0.5 - 0.5 * math.log(2.0)
        >>> found = float(rising.tabulated(0, peaks, 0.6, x)[0, 0])
        >>> round(found + 0.5 * (away / 0.05) ** 2 + math.log(0.6), 9)
        0.0

        With densities, a peak 6 T c at c = e^x has the density of T over 6 c:

        >>> z = scipy.stats.norm.ppf((np.arange(4000) + 0.5) / 4000)[None]
        >>> known = densities_of(np.exp(0.1 * z), np.zeros(1))
        >>> onsets = Onsets(np.zeros(1), np.exp(0.1 * z)[None], (known,), 6.0)
        >>> found = onsets.tabulated(0, np.array([12.0]), 0.0, x)
        >>> expected = scipy.stats.lognorm(0.1, 0.0, 6.0 * np.exp(x)).logpdf(12.0)
        >>> np.abs(found[0] - expected).round(1).tolist()
        [0.0, 0.0]
        """
        if not self.densities:  # uniform fields: peaks scatter by their error alone
            deviation = np.maximum(error / peaks, LEAST_DEVIATION)[:, None]
            onsets = np.log(self.area * self.ratios[field].mean(axis=1))
            away = np.log(peaks)[:, None] - x - np.interp(x, self.at, onsets)
            return -0.5 * (away / deviation) ** 2 - np.log(deviation * peaks[:, None])
        known = self.densities[field]
        near = corners([Axis(0, self.at, np.positive)], x[:, None])
        scales = self.area * np.stack([np.zeros(x.size), np.exp(x)])
        of_v, out = known.between(*near), np.empty((x.size, peaks.size))
        log_likelihoods(known.table, *near, of_v, scales, error, peaks, out)
        return out.T

    def ranges(self, peaks: Array, error: float) -> tuple[float, float, float]:
        """Return the range of x to tabulate for these peaks, and the smallest deviation of x.

        Onsets 1 and 4 times the strength with an area 3, and peaks 12 and 30. Their
        logarithms lie log 2 from their mean:

        >>> ratios, peaks = np.array([[[1.0, 4.0]]]), np.array([12.0, 30.0])
        >>> low, high, deviation = Onsets(np.zeros(1), ratios, ("density",), 3.0).ranges(peaks, 0.6)
        >>> away = 6.0 * math.hypot(math.log(2.0), 0.6 / 12.0)
        >>> ends = math.log(12.0 / 12.0) - away, math.log(30.0 / 3.0) + away
        >>> bool(np.allclose([low, high], ends))
        True
        >>> round(deviation / math.log(2.0), 9)
        1.0
        >>> low, high, deviation = Onsets(np.zeros(1), ratios[..., :1], (), 3.0).ranges(peaks, 0.6)
        >>> aside = low - math.log(4.0), high - math.log(10.0)
        >>> [round(float(part), 9) for part in (*aside, deviation)]
        [-0.3, 0.3, 0.02]
        """
        # x = log y - log(T(c) over c/reference), by which fields and samples scatter.
        logs = np.log(self.area * self.ratios)
        deviation = max(float(logs.std(axis=2).min()), LEAST_DEVIATION)
        away = TABULATED_DEVIATIONS * np.hypot(float(logs.std()), error / peaks.min())
        if not self.densities:
            deviation = max(error / peaks.max(), LEAST_DEVIATION)
            away = TABULATED_DEVIATIONS * max(error / peaks.min(), LEAST_DEVIATION)
        ends = np.log(peaks.min()), np.log(peaks.max())
        return ends[0] - logs.max() - away, ends[1] - logs.min() + away, deviation


def points_between(ranges: Sequence[tuple[float, float, float]]) -> Array:
    """Return points x over all ranges, spaced by a quarter of the smallest deviation.

    >>> x = points_between([(0.0, 1.0, 0.1), (-1.0, 0.5, 0.05)])  # 4 x 2/0.05
    >>> x.size, x[[0, -1]].tolist()
    (160, [-1.0, 1.0])
    >>> points_between([(0.0, 1.0, 0.1)]).size, points_between([(0.0, 1.0, 1e-6)]).size
    (64, 2000)
    """
    lows, highs, deviations = zip(*ranges, strict=True)
    # A coarser grid would lose the narrowest likelihood between two
    # points.
    low, high = min(lows), max(highs)
    count = int(np.clip(np.ceil(FINE * (high - low) / min(deviations)), 64, MAX_X_POINTS))
    return np.linspace(low, high, count)


@lru_cache(maxsize=1024)
def _tabulated(family: str, cv: float) -> tuple[Array, Array]:
    """Return values of log b, dense near the mean, and the probability below each value.

    >>> logs, below = _tabulated("lognormal", 0.2)
    >>> logs.size, logs[[0, 1200, -1]].round(9).tolist()
    (2401, [-6.0, 0.0, 6.0])
    >>> s = math.sqrt(math.log(1.04))
    >>> bool(np.allclose(below, scipy.stats.norm.cdf(logs, -0.5 * s**2, s)))
    True
    """
    end = math.asinh(LOWEST_FACTOR / cv)
    logs = cv * np.sinh(np.linspace(-end, end, TABULATED))
    with np.errstate(over="ignore"):  # powers of values far above the mean
        return logs, factor_of_family(family, cv).distribution.cdf(np.exp(logs))


def masses(family: str, cv: float, means: Array, x: Array) -> Array:
    """Return the probability (means, points) that x lies in the cell of each point.

    The cell of -0.2 begins at -0.25, and its logarithm of the mean is 0 or 0.1:

    >>> x = np.linspace(-0.2, 0.3, 6)
    >>> found = masses("lognormal", 0.2, np.array([0.0, 0.1]), x)
    >>> s, ends = math.sqrt(math.log(1.04)), np.linspace(-0.25, 0.35, 7)
    >>> expected = np.diff([scipy.stats.norm.cdf(ends, m - 0.5 * s**2, s) for m in (0.0, 0.1)])
    >>> bool(np.allclose(found, expected, atol=1e-5))
    True
    """
    half = 0.5 * (x[1] - x[0])
    ends = np.append(x - half, x[-1] + half)
    return np.diff(np.interp(ends - means[:, None], *_tabulated(family, cv)), axis=1)


@dataclass(frozen=True, eq=False)
class FactorGrid:
    """Posterior mass over field, family, s and log m, and the evidence."""

    profiles: Profiles
    means: Array  # log m over the reference, (means,), equidistant
    mass: Array  # (fields, families, cells, means); sums to 1
    log_evidence: float = math.nan

    @property
    def families(self) -> dict[str, float]:
        """Posterior probability for each distribution between specimens.

        >>> profiles = Profiles((None, None), 1.0, np.zeros(0), None, ("weibull", "normal"))
        >>> mass = np.zeros((2, 2, 40, 3))
        >>> mass[0, 1, 7, 2], mass[1, 1, 9, 0], mass[1, 0, 0, 0] = 0.5, 0.2, 0.3
        >>> FactorGrid(profiles, np.array([0.0, 0.5, 1.0]), mass).families
        {'weibull': 0.3, 'normal': 0.7}
        """
        masses = self.mass.sum(axis=(0, 2, 3)).tolist()
        return dict(zip(self.profiles.families, masses, strict=True))

    def draws(self, count: int, rng: np.random.Generator, fields: Any = None) -> Array:
        """Draw field, family, s and log m, as (count, 4), also for given `fields`.

        >>> profiles = Profiles((None, None), 1.0, np.zeros(0), None, ("weibull", "normal"))
        >>> mass = np.zeros((2, 2, 40, 3))
        >>> mass[0, 1, 7, 2], mass[1, 0, 9, 0] = 0.75, 0.25
        >>> grid = FactorGrid(profiles, np.array([0.0, 0.5, 1.0]), mass)
        >>> drawn = grid.draws(4000, np.random.default_rng(0))
        >>> first = drawn[:, 0] == 0
        >>> cells = profiles.prior.cells()
        >>> bool(0.72 < first.mean() < 0.78), np.unique(drawn[first, 1]).tolist()
        (True, [1.0])
        >>> bool(np.all(drawn[first, 2] == cells[7])), np.unique(drawn[~first, 1]).tolist()
        (True, [0.0])
        >>> ends = drawn[first, 3].min(), drawn[first, 3].max()  # within half a step of 1
        >>> [round(float(end), 2) for end in ends]
        [0.75, 1.25]

        Draws for given fields, and the same draws in a longer list:

        >>> fields = [1, 0, 1]
        >>> given = grid.draws(3, np.random.default_rng(0), fields)
        >>> given[:, 0].tolist(), bool(np.allclose(given[:, 2], cells[[9, 7, 9]]))
        ([1.0, 0.0, 1.0], True)
        >>> bool(np.allclose(drawn[:7], grid.draws(7, np.random.default_rng(0))))
        True
        """
        # Two streams, so that draw number i is the same in a longer list.
        cells, (rng, mean_rng) = self.mass[0].size, rng.spawn(2)
        if fields is None:
            places = rng.choice(self.mass.size, count, p=self.mass.ravel())
        else:
            # From the posterior of family, s and log m given the field.
            below = np.cumsum(self.mass.reshape(-1, cells), axis=1)
            shares = rng.random(count) * below[fields, -1]
            drawn = [np.searchsorted(below[f], p) for f, p in zip(fields, shares, strict=True)]
            places = np.asarray(fields) * cells + np.minimum(drawn, cells - 1)
        field, family, cell, mean = np.unravel_index(places, self.mass.shape)
        step = self.means[1] - self.means[0]
        logs = self.means[mean] + step * (mean_rng.random(count) - 0.5)
        return np.stack([field, family, self.profiles.prior.cells()[cell], logs], axis=1)

    def interface(self, drawn: Array) -> RandomInterface:
        """Return the random interface for a draw (4,).

        >>> import stiction as st
        >>> spectrum = st.PowerLawSpectrum(correlation_length=2e-3)
        >>> marginals = st.Lognormal(mean=2e6, cv=0.1), st.Lognormal(mean=2e6, cv=0.3)
        >>> fields = [st.RandomInterface(strength=st.RandomField(marginal, spectrum))
        ...           for marginal in marginals]
        >>> profiles = Profiles(tuple(fields), 2e6, np.zeros(0), None, ("weibull", "normal"))
        >>> drawn = np.array([1.0, 0.0, 0.2, math.log(1.5)])
        >>> found = FactorGrid(profiles, None, None).interface(drawn)
        >>> found.strength.marginal.cv, round(found.strength.mean, 3)
        (0.3, 3000000.0)
        >>> drawn[1] = 1.0
        >>> other = FactorGrid(profiles, None, None).interface(drawn).between["strength"]
        >>> type(other) is FACTOR_FAMILIES["normal"]
        True
        >>> factor = found.between["strength"]
        >>> type(factor).__name__, round(factor.cv, 9), round(factor.mean, 9)
        ('Weibull', 0.2, 1.0)
        """
        (field, family), profiles = drawn[:2].astype(int), self.profiles
        factor = factor_of_family(profiles.families[family], float(drawn[2]))
        mean = profiles.reference * math.exp(drawn[3])
        return of_mean(profiles.fields[field], mean, factor)

    def described(self, drawn: Array) -> dict[str, Array]:
        """Return parameters by name from draws (draws, 4).

        >>> import stiction as st
        >>> spectra = [st.PowerLawSpectrum(correlation_length=length) for length in (2e-3, 5e-3)]
        >>> marginals = st.Lognormal(mean=2e6, cv=0.1), st.Lognormal(mean=2e6, cv=0.3)
        >>> fields = [st.RandomInterface(strength=st.RandomField(*both))
        ...           for both in zip(marginals, spectra)]
        >>> drawn = np.array([[1.0, 0.0, 0.2, math.log(1.5)], [0.0, 1.0, 0.3, 0.0]])
        >>> profiles = Profiles(tuple(fields), 2e6, np.ones(2), None)
        >>> found = FactorGrid(profiles, None, None).described(drawn)
        >>> found["mean"].round(3).tolist(), found["between"].tolist()
        ([3000000.0, 2000000.0], [0.2, 0.3])
        >>> found["standard_deviation"].round(3).tolist()  # 0.3 x 3 MPa and 0.1 x 2 MPa
        [900000.0, 200000.0]
        >>> bool(np.allclose(found["efolding_length"], [s.efolding_length for s in spectra[::-1]]))
        True
        >>> stated = profiles._replace(fields=profiles.fields[:1], levels=np.zeros(0))
        >>> sorted(FactorGrid(stated, None, None).described(drawn[1:]))
        ['between', 'mean']
        """
        field, scale = drawn[:, 0].astype(np.int64), np.exp(drawn[:, 3])
        strengths = [one.strength for one in self.profiles.fields]
        deviations = np.array([one.standard_deviation for one in strengths])
        lengths = np.array([one.spectrum.efolding_length for one in strengths])
        known = {MEAN_KEY: self.profiles.reference * scale, SCATTER_KEY: drawn[:, 2]}
        if self.profiles.stated:
            return known
        return known | {
            "standard_deviation": deviations[field] * scale,
            "efolding_length": lengths[field],
        }


def grid_of_profiles(
    profiles: Profiles, tables: "Tables | None" = None
) -> tuple[FactorGrid, FactorGrid]:
    """Return two posteriors: from profiles alone, and from profiles and peaks (steps 2 to 5).

    If the scatter is known, 0.2, and levels have no error, their logarithms are
    normal around log m - s²/2, and log m is normal with the deviation
    s/sqrt(3):

    >>> levels = np.array([1.1, 0.8, 1.3])
    >>> prior = FactorPrior(scipy.stats.uniform(0.2, 1e-9))
    >>> profiles = Profiles((None,), 2.0, 2.0 * levels, np.zeros((1, 3)), ("lognormal",), prior)
    >>> before, after = grid_of_profiles(profiles)
    >>> s, mass = math.sqrt(math.log(1.04)), before.mass.sum(axis=(0, 1, 2))
    >>> mean = float(mass @ before.means)
    >>> round(mean - float(np.log(levels).mean() + 0.5 * s**2), 3) + 0.0
    0.0
    >>> round(math.sqrt(float(mass @ (before.means - mean) ** 2)) / s * math.sqrt(3.0), 2)
    1.0
    >>> bool(np.allclose(before.mass, after.mass))
    True

    The field within a specimen adds its variance to the logarithm of a level,
    and lowers it by half of it. A prior of the mean is a density of m:

    >>> wide = profiles._replace(levels=2.0 * levels[:1], within=np.full((1, 1), 0.03))
    >>> grid = grid_of_profiles(wide)[0]
    >>> mass, means = grid.mass.sum(axis=(0, 1, 2)), grid.means
    >>> mean = float(mass @ means)
    >>> round(mean - (math.log(1.1) + 0.015 + 0.5 * s**2), 2) + 0.0
    0.0
    >>> round(math.sqrt(float(mass @ (means - mean) ** 2) / (s**2 + 0.03)), 2)
    1.0
    >>> narrow = prior._replace(mean=scipy.stats.lognorm(0.05, 0.0, 2.6))
    >>> grid = grid_of_profiles(wide._replace(prior=narrow))[0]
    >>> mass = grid.mass.sum(axis=(0, 1, 2))
    >>> precisions = np.array([1.0 / (s**2 + 0.03), 1.0 / 0.05**2])
    >>> both = np.array([math.log(1.1) + 0.015 + 0.5 * s**2, math.log(1.3)])
    >>> round(float(mass @ grid.means) - float(precisions @ both / precisions.sum()), 3) + 0.0
    0.0
    """
    # The logarithm of a level lies below log(m b) by half its variance
    # on average.
    levels = np.log(profiles.levels / profiles.reference) + 0.5 * profiles.within
    deviations = np.maximum(np.sqrt(profiles.within), LEAST_DEVIATION)
    ranges = [] if tables is None else tables.ranges()
    if levels.size:
        reach = TABULATED_DEVIATIONS * deviations
        ranges.append(((levels - reach).min(), (levels + reach).max(), deviations.min()))
    x = points_between(ranges)
    # 2.
    of_levels = -0.5 * ((x - levels[..., None]) / deviations[..., None]) ** 2
    of_levels -= np.log(deviations[..., None])
    of_peaks = np.zeros((len(profiles.fields), 0, x.size)) if tables is None else tables(x)
    box = np.array([x[0] - LOG_MEAN_MARGIN, x[-1] + LOG_MEAN_MARGIN])
    cells, by_field = profiles.prior.cells(), (1, 2, 3)
    for _ in range(MAX_MEAN_ZOOMS):
        means = box[0] + np.ptp(box) * (np.arange(MEAN_CELLS) + 0.5) / MEAN_CELLS
        # 3. and 4.
        rows = [[masses(name, cv, means, x) for cv in cells] for name in profiles.families]
        kernel: Array = np.array(rows)
        before = _products(kernel, of_levels)
        if profiles.prior.mean is not None:
            # The density of log m is m times the density of m.
            before += profiles.prior.mean.logpdf(profiles.reference * np.exp(means)) + means
        # 5. Given the profiles, each field has the same probability.
        before -= logsumexp(before, axis=by_field, keepdims=True) + math.log(len(before))
        after = before + _products(kernel, of_peaks)
        evidence = float(logsumexp(after))
        if not math.isfinite(evidence):
            raise InputError(
                "peaks: no mean and scatter can produce both the peaks and the profiles or prior."
                " Check their units, and leave out tests of another kind of specimen"
            )
        mass = np.exp(after - evidence)
        # Both posteriors must fit on the grid. Without a prior of the
        # mean and without profiles, the first posterior has no end.
        along = [mass.sum(axis=(0, 1, 2))]
        if levels.size or profiles.prior.mean is not None:
            along.append(np.exp(before).sum(axis=(0, 1, 2)))
        empty = np.array(
            [[np.sum(np.cumsum(p) <= OUTER_MASS) for p in (row, row[::-1])] for row in along]
        ).min(axis=0)
        if empty.sum() <= 0.1 * MEAN_CELLS:
            break
        # One empty cell stays as a margin.
        box = box + np.ptp(box) / MEAN_CELLS * np.maximum(empty - 1, 0) * [1, -1]
    both = FactorGrid(profiles, means, mass, evidence)
    return FactorGrid(profiles, means, np.exp(before)), both


def _products(kernel: Array, tables: Array) -> Array:
    """Return log likelihoods (fields, families, cells, means), summed over measured numbers.

    `tables` holds the log likelihoods (fields, numbers, points) of the
    numbers at x (steps 3 and 4).

    The means have the weights (1/4, 3/4) and (1, 0) of two points. Two numbers
    have likelihoods at these points. In the last field they are extremely small:

    >>> kernel = np.array([[[[0.25, 0.75], [1.0, 0.0]]]])
    >>> tables = np.log([[[2.0, 6.0], [3.0, 5.0]], [[1e-300, 3e-300], [4.0, 8.0]]])
    >>> found = _products(kernel, tables)
    >>> found.shape, np.exp(found[0]).round(6).tolist()  # (0.5 + 4.5) (0.75 + 3.75), 2 x 3
    ((2, 1, 1, 2), [[[22.5, 6.0]]])
    >>> np.exp(found[1] + 300.0 * math.log(10.0)).round(6).tolist()  # 2.5 x 7, 1 x 4
    [[[17.5, 4.0]]]
    >>> far = np.array([[[-2000.0, -1001.0], [0.0, 0.0]]])
    >>> round(float(_products(kernel, far)[0, 0, 0, 0] - math.log(0.75)), 6)
    -1001.0
    """
    flat = kernel.reshape(-1, kernel.shape[-1]).T
    total = np.zeros((len(tables), flat.shape[1]))
    for table in np.moveaxis(tables, 1, 0):
        # The likelihood of a number may be far below the smallest
        # number of the computer.
        top = table.max(axis=1, keepdims=True)
        total += np.log(np.maximum(np.exp(table - top) @ flat, 1e-300)) + top
    return total.reshape(-1, *kernel.shape[:-1])


@dataclass(frozen=True, eq=False)
class Tables:
    """Likelihood of measured peaks for each field and x, and predictions from a posterior."""

    profiles: Profiles
    method: Any
    onsets: tuple[Onsets, ...]  # of each kind of specimen
    error: float  # standard deviation of the load cell
    peaks: tuple[Array, ...]

    def of(self, peaks: Sequence[Array], kinds: Sequence[int]) -> Self:
        """Return the tables for other peaks of some specimen types.

        >>> some = Tables(None, None, ("a", "b", "c"), 0.1, ()).of(["x", "y"], [2, 0])
        >>> some.onsets, some.peaks, some.error
        (('c', 'a'), ('x', 'y'), 0.1)
        """
        return replace(self, peaks=tuple(peaks), onsets=tuple(self.onsets[k] for k in kinds))

    def ranges(self) -> list[tuple[float, float, float]]:
        """Return the range of x to tabulate for each kind.

        A kind without peaks has no range:

        >>> onsets = Onsets(np.zeros(1), np.array([[[1.0]]]), (), 3.0)
        >>> peaks = np.array([]), np.array([12.0, 30.0])
        >>> tables = Tables(None, None, (onsets, onsets), 0.6, peaks)
        >>> tables.ranges() == [onsets.ranges(peaks[1], 0.6)]
        True
        """
        pairs = zip(self.onsets, self.peaks, strict=True)
        return [kind.ranges(peaks, self.error) for kind, peaks in pairs if peaks.size]

    def of_field(self, field: int, x: Array) -> Array:
        """Return log likelihoods (peaks, points) of all peaks at x for a field.

        >>> first = Onsets(np.zeros(1), np.array([[[1.0]], [[2.0]]]), (), 3.0)
        >>> second, x = replace(first, area=4.0), np.array([0.5, 0.7])
        >>> peaks = np.array([12.0]), np.array([30.0, 40.0])
        >>> profiles = Profiles((None, None), 1.0, np.zeros(0), None)
        >>> tables = Tables(profiles, None, (first, second), 0.6, peaks)
        >>> table = tables.of_field(1, x)
        >>> bool(np.allclose(table[:1], first.tabulated(1, peaks[0], 0.6, x)))
        True
        >>> bool(np.allclose(table[1:], second.tabulated(1, peaks[1], 0.6, x)))
        True
        >>> tables(x).shape, bool(np.allclose(tables(x)[1], table))
        ((2, 3, 2), True)
        """
        pairs = zip(self.onsets, self.peaks, strict=True)
        return np.concatenate([k.tabulated(field, peaks, self.error, x) for k, peaks in pairs])

    def __call__(self, x: Array) -> Array:
        """Return log likelihoods (fields, peaks, points) of all peaks at x."""
        return np.stack([self.of_field(f, x) for f in range(len(self.profiles.fields))])

    def parts(self, u: Array) -> Array:
        """Return log densities (draws, peaks) of all peaks at draws (draws, 4).

        A peak at log x with the error e, if log b is normal with the deviation s:
        the density is normal with the variance e² + s², and has the factor 1/peak:

        >>> onsets = Onsets(np.zeros(1), np.array([[[1.0]], [[2.0]]]), (), 3.0)
        >>> profiles = Profiles((None, None), 1.0, np.zeros(0), None, ("weibull", "lognormal"))
        >>> tables = Tables(profiles, None, (onsets,), 0.6, (np.array([12.0, 11.0]),))
        >>> found = tables.parts(np.array([[0.0, 1.0, 0.2, 1.3], [1.0, 1.0, 0.1, 0.6]]))
        >>> for row, ratio, cv, mean in zip(found, (1.0, 2.0), (0.2, 0.1), (1.3, 0.6)):
        ...     s = math.log(1.0 + cv**2)
        ...     for value, peak in zip(row, (12.0, 11.0)):
        ...         normal = scipy.stats.norm(mean - 0.5 * s, math.sqrt(s + (0.6 / peak) ** 2))
        ...         expected = normal.logpdf(math.log(peak / 3.0 / ratio)) - math.log(peak)
        ...         print(round(value - expected - 0.5 * math.log(2.0 * math.pi), 2) + 0.0)
        0.0
        0.0
        0.0
        0.0
        """
        # The density of a peak at a draw is the integral over x, as in
        # step 3.
        x = points_between(self.ranges())
        rows = np.empty((len(u), x.size))
        for family, cv, places in _factor_groups(self.profiles, u):
            rows[places] = masses(family, cv, u[places, 3], x)
        densities = np.empty((len(u), sum(map(np.size, self.peaks))))
        for field in np.unique(u[:, 0].astype(np.int64)):
            members = np.flatnonzero(u[:, 0] == field)
            integrals = rows[members] @ np.exp(self.of_field(field, x)).T
            densities[members] = np.log(np.maximum(integrals, 1e-300))
        return densities

    def predicted(self, kind: int, u: Array, seed: int) -> Array:
        """Draw a peak of one specimen type for each draw (draws, 4).

        The ratio of field 1 is 2 or 4, and the area of kind 1 is 3. With little
        scatter all peaks are 3 c times 2 or 4, at log c = 0.7:

        >>> onsets = Onsets(np.zeros(1), np.array([[[1.0, 1.0]], [[2.0, 4.0]]]), (), 3.0)
        >>> profiles = Profiles((None, None), 1.0, np.zeros(0), None, ("weibull", "lognormal"))
        >>> tables = Tables(profiles, None, (None, onsets), 0.0, ())
        >>> drawn = tables.predicted(1, np.tile([1.0, 1.0, 1e-6, 0.7], (50, 1)), 3)
        >>> sorted({round(peak / 3.0 / math.exp(0.7), 4) for peak in drawn.tolist()})
        [2.0, 4.0]
        >>> drawn = tables.predicted(1, np.tile([0.0, 1.0, 0.2, 0.7], (9000, 1)), 3)
        >>> drawn /= 3.0 * math.exp(0.7)
        >>> round(float(drawn.mean()), 1), round(float(drawn.std()), 2)
        (1.0, 0.2)
        >>> noisy = replace(tables, error=0.5)
        >>> drawn = noisy.predicted(1, np.tile([0.0, 1.0, 1e-6, 0.7], (9000, 1)), 3)
        >>> round(float(drawn.std()), 1)
        0.5
        """
        rng = np.random.default_rng([seed, 1, kind])
        known, share = self.onsets[kind], rng.random(len(u))
        # A further specimen has its own factor and one of the simulated
        # onsets.
        x = u[:, 3].copy()
        for family, cv, places in _factor_groups(self.profiles, u):
            x[places] += np.log(factor_of_family(family, cv).distribution.ppf(share[places]))
        sample = rng.integers(known.ratios.shape[2], size=len(u))
        ratios = known.ratios[u[:, 0].astype(np.int64), :, sample]
        ratio = [np.interp(at, known.at, row) for at, row in zip(x, ratios, strict=True)]
        return known.area * np.exp(x) * ratio + self.error * rng.standard_normal(len(u))


class Prediction(NamedTuple):
    """Distribution of the onset in a further specimen, from a posterior on a grid."""

    tables: Tables
    grid: FactorGrid

    @classmethod
    def of(cls, grid: FactorGrid, problem: Problem, simulation: Simulation) -> Self:
        """Return the prediction for a problem, for which the fields are simulated."""
        nothing = Peaks((None,), (np.zeros(0),), "Pa")
        return cls(tables_of(problem, grid.profiles, simulation, nothing, 0.0), grid)

    def quantile(self, probability: float, family: str | None = None) -> float:
        """Return the stress, Pa, at a probability, averaged over distributions or for one.

        The predictive distribution is the mean over field, onset and
        grid, or over the part of the grid with this family. No draws
        are needed.

        If the posterior has a single cell, T(c) = 2 c and c is lognormal with the
        mean 1.5 e^0.5, the quantiles are known, to half a step of the grid:

        >>> profiles = Profiles((None,), 1.5, np.zeros(0), None, ("weibull", "lognormal"),
        ...                     FactorPrior(scipy.stats.uniform(0.2, 1e-9)))
        >>> onsets = Onsets(np.zeros(1), np.array([[[2.0]]]), (), 3.0)
        >>> mass = np.zeros((1, 2, 40, 2))
        >>> mass[0, 0, 0, 0], mass[0, 1, 0, 0] = 0.4, 0.6
        >>> grid = FactorGrid(profiles, np.array([0.5, 0.501]), mass)
        >>> prediction = Prediction(Tables(profiles, None, (onsets,), 0.0, ()), grid)
        >>> s = math.sqrt(math.log(1.04))
        >>> expected = 2.0 * scipy.stats.lognorm(s, 0.0, math.exp(0.5 - 0.5 * s**2)).ppf(0.03)
        >>> expected = float(expected)
        >>> round(prediction.quantile(0.03, "lognormal") / expected, 2)
        1.0
        >>> expected = 2.0 * factor_of_family("weibull", 0.2).distribution.ppf(0.03) * math.exp(0.5)
        >>> expected = float(expected)
        >>> round(prediction.quantile(0.03, "weibull") / expected, 2)
        1.0

        The average over both families has probabilities that are averages:

        >>> both = prediction.quantile(0.03)
        >>> round(prediction.probability(both), 5)
        0.03
        >>> shares = [factor_of_family(name, 0.2).distribution.cdf(both / 2.0 / math.exp(0.5))
        ...           for name in ("weibull", "lognormal")]
        >>> round(float(np.dot([0.4, 0.6], shares)), 3)
        0.03
        >>> prediction.families
        ['weibull', 'lognormal']
        """
        chance, (low, high) = self._distribution(family)
        if chance(low) < probability:  # or else a rarer peak than those of the table
            low = brentq(lambda log_peak: chance(log_peak) - probability, low, high, xtol=1e-6)
        return float(np.exp(low)) / self.tables.onsets[0].area

    def probability(self, stress: float) -> float:
        """Return the probability of an onset below a stress, Pa.

        T(c) is 2 c at log c = -1 and 3 c at 1, and constant multiples of c beyond.
        The strength c is lognormal with the mean e^0.5:

        >>> profiles = Profiles((None,), 1.5, np.zeros(0), None, ("lognormal",),
        ...                     FactorPrior(scipy.stats.uniform(0.6, 1e-9)))
        >>> mass = np.zeros((1, 1, 40, 2))
        >>> mass[0, 0, 0, 0] = 1.0
        >>> grid = FactorGrid(profiles, np.array([0.5, 0.501]), mass)
        >>> def probability(at, ratios, stress):
        ...     onsets = Onsets(np.array(at), np.array([ratios]), (), 3.0)
        ...     tables = Tables(profiles, None, (onsets,), 0.0, ())
        ...     return Prediction(tables, grid).probability(stress)
        >>> s = math.sqrt(math.log(1.36))
        >>> below = scipy.stats.norm(0.5 - 0.5 * s**2, s).cdf
        >>> for log_c, onset in (
        ...     (-1.3, 2.0 * math.exp(-1.3)), (1.3, 3.0 * math.exp(1.3)), (0.0, math.sqrt(6.0)),
        ... ):
        ...     found = probability([-1.0, 1.0], [[2.0], [3.0]], onset)
        ...     print(round(found - float(below(log_c)), 4) + 0.0)
        0.0
        0.0
        0.0

        If the onset is 2 c or 4 c, the probability is the mean of both:

        >>> found = probability([0.0], [[2.0, 4.0]], 3.0)
        >>> round(found - float(below(np.log([1.5, 0.75])).mean()), 4) + 0.0
        0.0
        """
        chance, _ = self._distribution()
        return chance(math.log(stress * self.tables.onsets[0].area))

    def _distribution(
        self, family: str | None = None
    ) -> tuple[Callable[[float], float], tuple[float, float]]:
        """Return the probability below a log peak, and a range of log peaks."""
        profiles, known, means = self.tables.profiles, self.tables.onsets[0], self.grid.means
        mass_of = dict(zip(profiles.families, np.moveaxis(self.grid.mass, 1, 0), strict=True))
        if family is not None:
            mass_of = {family: mass_of[family] / mass_of[family].sum()}
        x = np.linspace(means[0] - LOWEST, means[-1] + LOG_MEAN_MARGIN, PREDICTED)
        # Probability that x of a further specimen lies below the upper
        # edge of each cell, for each field.
        below, half = np.zeros((len(profiles.fields), x.size)), 0.5 * (x[1] - x[0])
        for name, of_family in mass_of.items():
            for cell, cv in enumerate(profiles.prior.cells()):
                mass = of_family[:, cell]
                below += mass @ masses(name, cv, means, x)
                below[:, 0] += mass @ np.interp(x[0] - half - means, *_tabulated(name, cv))
        below = np.cumsum(below, axis=1)
        # T(c) rises with c. Find the c at which it is t, for each field
        # and sample.
        logs = np.log(known.area * known.ratios) + known.at[:, None]

        def chance(log_peak: float) -> float:
            at = log_peak - logs[:, 0]
            if known.at.size > 1:
                at = np.array([[np.interp(log_peak, s, known.at) for s in f.T] for f in logs])
                # Beyond the simulated means T(c)/c is that of the ends.
                at += np.minimum(log_peak - logs[:, 0], 0.0)
                at += np.maximum(log_peak - logs[:, -1], 0.0)
            pairs = zip(at, below, strict=True)
            shares = [np.interp(row, x + half, part).sum() for row, part in pairs]
            return float(sum(shares)) / logs.shape[2]

        return chance, (x[0] + logs.min() - known.at[0], x[-1] + logs.max() - known.at[-1])

    def characteristic(self, draws: Array, probability: float, confidence: float) -> float:
        """Return the stress, Pa, whose quantile is higher in a fraction `confidence` of the draws.

        Fields are uniform, and `draws` are (draws, 4).

        Three draws of log c, with hardly any scatter, and T(c) = 2 c:

        >>> profiles = Profiles((None,), 1.0, np.zeros(0), None, ("weibull", "lognormal"))
        >>> onsets = Onsets(np.zeros(1), np.array([[[2.0]]]), (), 3.0)
        >>> tables = Tables(profiles, None, (onsets,), 0.0, ())
        >>> draws = np.array([[0.0, 1.0, 1e-6, math.log(c)] for c in (4.0, 1.0, 3.0)])
        >>> prediction = Prediction(tables, None)
        >>> [round(prediction.characteristic(draws, 0.05, share), 3) for share in (1.0, 0.75, 0.0)]
        [2.0, 4.0, 8.0]
        >>> draws[:, 2] = 0.2
        >>> factor = factor_of_family("lognormal", 0.2).distribution
        >>> round(prediction.characteristic(draws, 0.05, 0.5) / float(factor.ppf(0.05)), 3)
        6.0
        """
        x, known = draws[:, 3].copy(), self.tables.onsets[0]
        for family, cv, places in _factor_groups(self.tables.profiles, draws):
            x[places] += math.log(factor_of_family(family, cv).distribution.ppf(probability))
        onsets = np.exp(x) * np.interp(x, known.at, known.ratios[0, :, 0])
        return float(np.quantile(onsets, 1.0 - confidence))

    def divergence(self, first: str, second: str) -> float:
        """Return the divergence, nats, of one family from another at the mean scatter.

        The mean scatter is 0.2. The divergence of two distributions of log b:

        >>> profiles = Profiles((None,), 1.0, np.zeros(0), None, ("weibull", "lognormal"),
        ...                     FactorPrior(scipy.stats.uniform(0.2, 1e-9)))
        >>> onsets = Onsets(np.zeros(1), np.array([[[2.0]]]), (), 3.0)
        >>> tables = Tables(profiles, None, (onsets,), 0.0, ())
        >>> grid = FactorGrid(profiles, None, np.full((1, 2, 40, 1), 1.0 / 80.0))
        >>> prediction = Prediction(tables, grid)
        >>> b = np.linspace(0.2, 2.5, 20001)
        >>> p, q = (factor_of_family(name, 0.2).distribution for name in ("weibull", "lognormal"))
        >>> expected = float(np.sum(p.pdf(b) * (p.logpdf(b) - q.logpdf(b))) * (b[1] - b[0]))
        >>> round(prediction.divergence("weibull", "lognormal") / expected, 1)
        1.0
        >>> prediction.divergence("weibull", "weibull")
        0.0
        """
        scatters = self.tables.profiles.prior.cells()
        cv = float(self.grid.mass.sum(axis=(0, 1, 3)) @ scatters)
        x = np.linspace(-LOWEST, LOG_MEAN_MARGIN, PREDICTED)
        p, q = (masses(family, cv, np.zeros(1), x)[0] for family in (first, second))
        return float(scipy.stats.entropy(p, np.maximum(q, 1e-300)))

    @property
    def families(self) -> list[str]:
        """Families of the factor with posterior mass."""
        return [name for name, mass in self.grid.families.items() if mass > OUTER_MASS]


def _factor_groups(profiles: Profiles, u: Array) -> list[tuple[str, float, Any]]:
    """Group the draws by family and s.

    Return each family, its s, and the indices of its draws.

    >>> profiles = Profiles((None,), 1.0, np.zeros(0), None, ("weibull", "lognormal"))
    >>> u = np.array([[0, 1, 0.2, 5.0], [0, 0, 0.2, 6.0], [1, 1, 0.2, 7.0], [0, 1, 0.1, 8.0]])
    >>> [(family, cv, places.tolist()) for family, cv, places in _factor_groups(profiles, u)]
    [('weibull', 0.2, [1]), ('lognormal', 0.1, [3]), ('lognormal', 0.2, [0, 2])]
    """
    pairs, group = np.unique(u[:, 1:3], axis=0, return_inverse=True)
    return [
        (profiles.families[int(family)], float(cv), np.flatnonzero(group.ravel() == number))
        for number, (family, cv) in enumerate(pairs)
    ]


def tables_of(
    problem: Problem, profiles: Profiles, simulation: Simulation, measured: Peaks, error: float
) -> Tables:
    """Return the likelihood of peaks, from onsets simulated for each specimen type (step 1)."""
    if not profiles.whole:  # or else `without_field` has checked it
        variable_of(problem, profiles.fields[0], measured.unit)
    kinds = range(len(measured.values))
    onsets = [_onsets(problem, profiles, simulation, measured, kind, error) for kind in kinds]
    return Tables(profiles, simulation.method, tuple(onsets), error, measured.values)


def _onsets(
    problem: Problem, profiles: Profiles, simulation: Simulation, measured: Peaks, kind: int,
    error: float,
) -> Onsets:  # fmt: skip
    """Return the onsets of all fields for a specimen type, with or without measured peaks."""
    problem, peaks = of_length(problem, measured.lengths[kind]), measured.values[kind]
    method, workers, of = simulation.method, simulation.workers, measured.variable
    samples = simulation.samples or ONSETS.get(method.type, FEW_ONSETS)
    samples = 1 if profiles.whole else samples
    simulation = simulation._replace(samples=samples, workers=1)  # fields run in threads
    area = 1.0
    if of == "critical_force":
        area, of = problem.area or math.nan, "critical_stress"

    def onsets(place: int, at: Array) -> tuple[Array, Any]:
        """Return onsets (steps, samples) divided by c/reference, and their densities."""
        strengths = np.exp(at)
        fields = [of_mean(profiles.fields[place], c * profiles.reference) for c in strengths]
        experiments = [Experiment(problem, field, method) for field in fields]
        first = kind * SPECIMEN + place * samples
        relative = simulate(experiments, simulation, first, of) / strengths[:, None]
        if not np.isfinite(relative).all() or relative.min() <= 0.0:
            raise InputError("method: some simulated specimens have no positive onset")
        if profiles.whole:
            return relative, None
        bounds = np.array([bounds_of(one, of)[0] for one in experiments]) / strengths
        return relative, densities_of(relative, np.maximum(bounds, 0.0))

    at, fields = np.zeros(1), range(len(profiles.fields))
    if not scales_with_strength(problem, profiles.fields[0], method):
        # The onsets at the reference show over which strengths the
        # peaks range.
        first, known = onsets(0, at)
        peaks = peaks if peaks.size else area * first.ravel()
        known = () if profiles.whole else (known,)
        low, high, _ = Onsets(at, first[None], known, area).ranges(peaks, error)
        at = np.linspace(low - LOG_STRENGTH_MARGIN, high + LOG_STRENGTH_MARGIN, ONSET_MEANS)
    total = len(fields) * at.size * samples
    warn_if_long(Experiment(problem, profiles.fields[0], method), total, workers)
    simulation.meter.stage("simulated onsets", total)
    run = in_threads(lambda place: onsets(place, at), fields, workers or usable_cores())
    ratios, densities = map(tuple, zip(*run, strict=True))
    if profiles.whole:
        return Onsets(at, np.stack(ratios), (), area)
    # Standardised densities differ little between fields. Their mean
    # has a smaller error.
    table = np.log(np.mean([np.exp(known.table) for known in densities], axis=0))
    densities = tuple(known._replace(table=table) for known in densities)
    return Onsets(at, np.stack(ratios), densities, area)

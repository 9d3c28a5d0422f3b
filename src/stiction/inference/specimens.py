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
    """Return the marginal for a factor with mean 1."""
    return FACTOR_FAMILIES[family](mean=1.0, cv=cv)


def families_of(given: Any) -> tuple[str, ...]:
    """Return families of factors: all families if True, or else the named families."""
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
        """Return the prior, given a mapping from `MEAN_KEY` and `SCATTER_KEY` to distributions."""
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
        """Return SCATTER_CELLS values of s at equal steps in prior probability."""
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
        """Return specimens with a uniform strength, a coefficient if there is a pressure."""
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
        """Whether the field within a specimen was stated, not measured."""
        return not self.levels.size and len(self.fields) == 1


def of_mean(random: RandomInterface, mean: float, factor: Any = None) -> RandomInterface:
    """Return a random interface with a different mean and a different factor of the strength."""
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
        """Return the onsets for the fields with given numbers."""
        densities = tuple(self.densities[k] for k in order) if self.densities else ()
        return replace(self, ratios=self.ratios[order], densities=densities)

    def tabulated(self, field: int, peaks: Array, error: float, x: Array) -> Array:
        """Return the log density (peaks, points) of each peak at x for a field."""
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
        """Return the range of x to tabulate for these peaks, and the smallest deviation of x."""
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
    """Return points x over all ranges, spaced by a quarter of the smallest deviation."""
    lows, highs, deviations = zip(*ranges, strict=True)
    # A coarser grid would lose the narrowest likelihood between two
    # points.
    low, high = min(lows), max(highs)
    count = int(np.clip(np.ceil(FINE * (high - low) / min(deviations)), 64, MAX_X_POINTS))
    return np.linspace(low, high, count)


@lru_cache(maxsize=1024)
def _tabulated(family: str, cv: float) -> tuple[Array, Array]:
    """Return values of log b, dense near the mean, and the probability below each value."""
    end = math.asinh(LOWEST_FACTOR / cv)
    logs = cv * np.sinh(np.linspace(-end, end, TABULATED))
    with np.errstate(over="ignore"):  # powers of values far above the mean
        return logs, factor_of_family(family, cv).distribution.cdf(np.exp(logs))


def masses(family: str, cv: float, means: Array, x: Array) -> Array:
    """Return the probability (means, points) that x lies in the cell of each point."""
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
        """Posterior probability for each distribution between specimens."""
        masses = self.mass.sum(axis=(0, 2, 3)).tolist()
        return dict(zip(self.profiles.families, masses, strict=True))

    def draws(self, count: int, rng: np.random.Generator, fields: Any = None) -> Array:
        """Draw field, family, s and log m, as (count, 4), also for given `fields`."""
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
        """Return the random interface for a draw (4,)."""
        (field, family), profiles = drawn[:2].astype(int), self.profiles
        factor = factor_of_family(profiles.families[family], float(drawn[2]))
        mean = profiles.reference * math.exp(drawn[3])
        return of_mean(profiles.fields[field], mean, factor)

    def described(self, drawn: Array) -> dict[str, Array]:
        """Return parameters by name from draws (draws, 4)."""
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
    """Return two posteriors: from profiles alone, and from profiles and peaks (steps 2 to 5)."""
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
        """Return the tables for other peaks of some specimen types."""
        return replace(self, peaks=tuple(peaks), onsets=tuple(self.onsets[k] for k in kinds))

    def ranges(self) -> list[tuple[float, float, float]]:
        """Return the range of x to tabulate for each kind."""
        pairs = zip(self.onsets, self.peaks, strict=True)
        return [kind.ranges(peaks, self.error) for kind, peaks in pairs if peaks.size]

    def of_field(self, field: int, x: Array) -> Array:
        """Return log likelihoods (peaks, points) of all peaks at x for a field."""
        pairs = zip(self.onsets, self.peaks, strict=True)
        return np.concatenate([k.tabulated(field, peaks, self.error, x) for k, peaks in pairs])

    def __call__(self, x: Array) -> Array:
        """Return log likelihoods (fields, peaks, points) of all peaks at x."""
        return np.stack([self.of_field(f, x) for f in range(len(self.profiles.fields))])

    def parts(self, u: Array) -> Array:
        """Return log densities (draws, peaks) of all peaks at draws (draws, 4)."""
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
        """Draw a peak of one specimen type for each draw (draws, 4)."""
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
        """
        chance, (low, high) = self._distribution(family)
        if chance(low) < probability:  # or else a rarer peak than those of the table
            low = brentq(lambda log_peak: chance(log_peak) - probability, low, high, xtol=1e-6)
        return float(np.exp(low)) / self.tables.onsets[0].area

    def probability(self, stress: float) -> float:
        """Return the probability of an onset below a stress, Pa."""
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
        # Probability that x of a further specimen lies below each
        # point, for each field.
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
            shares = [np.interp(row, x, part).sum() for row, part in pairs]
            return float(sum(shares)) / logs.shape[2]

        return chance, (x[0] + logs.min() - known.at[0], x[-1] + logs.max() - known.at[-1])

    def characteristic(self, draws: Array, probability: float, confidence: float) -> float:
        """Return the stress, Pa, whose quantile is higher in a fraction `confidence` of the draws.

        Fields are uniform, and `draws` are (draws, 4).
        """
        x, known = draws[:, 3].copy(), self.tables.onsets[0]
        for family, cv, places in _factor_groups(self.tables.profiles, draws):
            x[places] += math.log(factor_of_family(family, cv).distribution.ppf(probability))
        onsets = np.exp(x) * np.interp(x, known.at, known.ratios[0, :, 0])
        return float(np.quantile(onsets, 1.0 - confidence))

    def divergence(self, first: str, second: str) -> float:
        """Return the divergence, nats, of one family from another at the mean scatter."""
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

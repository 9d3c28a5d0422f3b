"""Fit a marginal, a spectrum and noise to records, and compare families.

Problem. Values y = v(z) + e were measured along records. Here z is a
correlated Gaussian field, v maps it to a marginal, and e is white
normal noise. Find the marginal, the spectrum and the noise.

Sources. The composite likelihood follows Varin, Reid and Firth (2011),
Statistica Sinica 21, 5. The criterion is due to Akaike (1974), IEEE
Transactions on Automatic Control 19, 716. Steps 7 and 8 follow Paule and
Mandel (1982), Journal of Research of the National Bureau of Standards
87, 377, and Viechtbauer (2007), Statistics in Medicine 26, 37. Steps 3,
5, 6 and 9 are our own.

Steps:

1. Fit the marginal to the values, as if they were independent
   (`marginal_fit`).
2. Fit spectrum and noise to the periodograms with the map of this
   marginal (`whittle`). Noise increases the scatter of the values, so
   repeat both steps once with the estimated noise.
3. Increase the variance of the marginal by the amount that removal of
   the mean and the trend takes from the values on average.
4. Score each family by its mean log likelihood times the number of
   independent values (step 5), minus one for each estimated parameter.
5. Families fitted to the same values have the same mean and variance.
   The log ratio of their densities therefore begins with Hermite order
   3 in z. For N values with correlations rho_ij, the sum of the log
   ratios has the mean and variance of a sum over N^2/sum rho_ij^3
   independent values.
6. If records come from different specimens, scale them as if they came
   from one specimen (steps 7 to 9). This requires the scatter of means
   that the field alone causes, so repeat the fit `ROUNDS` times.
7. Records k = 1, ..., n have means with logarithms L_k, to which the
   field alone gives the variances v_k. With weights 1/(s + v_k), take
   the mean m(s) of the logarithms and Q(s) = sum (L_k - m(s))^2/(s + v_k).
   At the true variance s between specimens, Q has a chi-square
   distribution with n - 1 degrees of freedom.
8. Estimate s from Q(s) = n - 1, the mean of this distribution. Use s =
   0 if Q(0) is smaller.
9. Reduce the differences between the logarithms until Q(0) = n - 1, and
   scale the records to these means. Equal means would lack the variance
   that the field alone causes between records.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, ks_1samp

from stiction.base.arrays import Array
from stiction.base.errors import InputError, UnitWarning, collect_warnings, issue
from stiction.inference.marginal_fit import Family, mean_log_likelihood
from stiction.inference.records import Record
from stiction.inference.whittle import (
    OF_SPECTRUM,
    Model,
    Observed,
    SpectrumFamily,
    Whittle,
    hermite_shares,
    periodograms_of,
)
from stiction.inference.window import RecordWindow
from stiction.random.fields import RandomField
from stiction.random.mapping import from_normal

NEGLIGIBLE_CHANGE = 1e-4
"""Change of the noise variance, as a fraction of the variance, that
does not change a marginal."""
LAGS = np.concatenate(([0.0], np.geomspace(0.01, 4.0, 400)))
"""Lags in correlation lengths. The correlation of every spectrum falls
to 1/e within them."""
LEAST_LEFT = 0.2
"""Least fraction of the variance that mean and trend are assumed to leave."""
ROUNDS = 2
"""Rounds of step 6. Each round reduces the error of the field's
variance to this fraction."""
BANDS_PER_OCTAVE = 3
"""Bands of wavenumbers whose averages measure the roughness."""
DRAWN = 5.0
"""Difference of scores above which no field of the lower family is drawn."""


MOST_SCATTER = math.log(2.0)
"""Largest variance s of the search, of a log-normal factor with
coefficient of variation 1."""


@dataclass(frozen=True, eq=False)
class FitSetting:
    """Families to fit, and a window for each record, shared by records with the same geometry."""

    windows: tuple[RecordWindow, ...]
    marginal: Family
    spectrum: SpectrumFamily
    between: bool = False


@dataclass(frozen=True, eq=False)
class BestFit:
    """The result of one fit."""

    setting: FitSetting
    marginal: Any  # of the field
    of_values: Any  # marginal of the values, from which mean and trend have taken variance
    model: Model
    distance: float  # Kolmogorov's distance between values and marginal
    roughness: float  # mean square of log(periodogram/expectation), both averaged over bands
    noise: tuple[float, float]  # variance of the noise, which may be negative, and its error
    between: float = 0.0  # coefficient of variation of the factor between specimens

    @cached_property
    def parameters(self) -> dict[str, float]:
        """All estimated parameters and derived numbers, by name."""
        lags = self.model.spectrum.correlation_length * LAGS
        correlation = self.model.spectrum.untruncated_correlation(lags)
        values = {
            "efolding_length": float(np.interp(-math.exp(-1.0), -correlation, lags)),
            "mean": float(self.marginal.distribution.mean()),
            "standard_deviation": float(self.marginal.distribution.std()),
        }
        of_marginal = self.setting.marginal.parameters(self.marginal)
        values |= {f"marginal.{name}": value for name, value in of_marginal.items()}
        free = self.setting.spectrum.of(self.model)
        values |= {name: value for name, value in free.items() if name in OF_SPECTRUM}
        if "noise_share" in free:
            values["noise"] = self.model.noise
        return values

    def field(self, quantity: str) -> RandomField:
        """Return the field for simulations.

        >>> from stiction.inference.marginal_fit import family_of
        >>> from stiction.random.marginals import Lognormal
        >>> family = SpectrumFamily("exponential", {}, 1.0, None, (0.1, 6.0))
        >>> model = family.model(family.vector([4.0, 2.0, 0.25]), np.array([0.0, 1.0]))
        >>> setting = FitSetting((), family_of("lognormal"), family)
        >>> law = Lognormal(mean=5.0, cv=0.2)
        >>> fit = BestFit(setting, law, None, model, 0.1, 0.1, (0.0, 0.0))
        >>> {name: round(value, 3) for name, value in fit.parameters.items() if "." not in name}
        ... # doctest: +NORMALIZE_WHITESPACE
        {'efolding_length': 2.0, 'mean': 5.0, 'standard_deviation': 1.0,
         'correlation_length': 2.0, 'noise': 1.0}
        >>> fit.parameters["marginal.mean"], fit.parameters["marginal.cv"]
        (5.0, 0.2)
        >>> fit.field("strength").quantity, fit.field("friction_coefficient").quantity
        (None, 'friction_coefficient')
        >>> turned = replace(fit, model=model._replace(anisotropy=3.0)).field("strength")
        >>> turned.anisotropy, turned.mean_mode
        (3.0, True)
        >>> turned.marginal == law, turned.spectrum == model.spectrum
        (True, True)
        """
        options: Any = {"mean_mode": True}
        if self.model.anisotropy != 1.0:
            options["anisotropy"] = self.model.anisotropy
        if quantity == "friction_coefficient":
            options["quantity"] = quantity
        return RandomField(self.marginal, self.model.spectrum, **options)

    def simulate(self, rng: np.random.Generator) -> list[Array]:
        """Simulate the measured values (points,) of each record, with noise.

        The field hardly varies. Records show the noise, whose
        variance is 0.25*4, and then the factor between specimens.

        >>> from stiction.inference.marginal_fit import family_of
        >>> from stiction.random.marginals import Lognormal
        >>> window = RecordWindow((0.5,), np.ones(4, dtype=np.bool_))
        >>> law = Lognormal(mean=5.0, cv=1e-8)
        >>> family = SpectrumFamily("exponential", {}, 1.0, None, (0.1, 6.0))
        >>> model = family.model(family.vector([4.0, 2.0, 0.25]), np.array([0.0, 1.0]))
        >>> setting = FitSetting((window,) * 2000, family_of("lognormal"), family)
        >>> fit = BestFit(setting, law, None, model, 0.1, 0.1, (0.0, 0.0))
        >>> rows = np.array(fit.simulate(np.random.default_rng(0)))
        >>> rows.shape, f"{rows.mean():.1f} {rows.std():.1f}"
        ((2000, 4), '5.0 1.0')
        >>> model = family.model(family.vector([4.0, 2.0, 1e-20]), np.array([0.0, 1.0]))
        >>> quiet = replace(fit, model=model, between=0.3)
        >>> rows = np.array(quiet.simulate(np.random.default_rng(0)))
        >>> f"{np.ptp(rows, axis=1).max():.4f} {rows.mean():.1f} {rows.std() / rows.mean():.1f}"
        '0.0000 5.0 0.3'
        """
        windows = self.setting.windows
        power = {window: self.model.power(window) for window in dict.fromkeys(windows)}
        rows = []
        for window in windows:
            field = from_normal(self.marginal, window.sample(power[window], rng))
            noise = self.model.noise * rng.standard_normal(field.size)
            rows.append(window.without_trend(field + noise))
        if not self.between:
            return rows
        variance = math.log1p(self.between**2)
        # A log-normal factor with mean 1.
        scatter = math.sqrt(variance) * rng.standard_normal(len(rows)) - 0.5 * variance
        return [row * factor for row, factor in zip(rows, np.exp(scatter), strict=True)]

    @property
    def of_means(self) -> Array:
        """Variance that the field alone causes in the mean of each record.

        The mean of n values without correlation has the variance of
        a value over n.

        >>> from types import SimpleNamespace
        >>> def white(window):
        ...     return np.where(np.arange(window.pairs.size) == 0, 1.0, 0.0)
        >>> windows = tuple(RecordWindow((1.0,), np.ones(n, dtype=np.bool_)) for n in (4, 8))
        >>> fit = SimpleNamespace(
        ...     setting=SimpleNamespace(windows=(*windows, windows[0])),
        ...     model=SimpleNamespace(correlation=white), parameters={"standard_deviation": 3})
        >>> BestFit.of_means.fget(fit).round(9).tolist()
        [2.25, 1.125, 2.25]
        >>> fit = SimpleNamespace(of_means=np.array([3.0, 8.0]), parameters={"mean": 2.0})
        >>> np.exp(BestFit.within.func(fit)).round(9).tolist()  # 1 + 3/4 and 1 + 8/4
        [1.75, 3.0]
        """
        windows, model = self.setting.windows, self.model
        shares = {w: w.variance_of_mean(model.correlation(w)) for w in set(windows)}
        deviation = self.parameters["standard_deviation"]
        return deviation**2 * np.array([shares[window] for window in windows])

    @cached_property
    def within(self) -> Array:
        """Variance that the field alone causes in the log mean of each record."""
        return np.log1p(self.of_means / self.parameters["mean"] ** 2)

    def chance_of_scatter(self, levels: Array) -> float:
        """Return the probability that means of records from one field scatter as much (step 7).

        Two means, 1 away from their mean on either side, have Q =
        2/v.

        >>> from types import SimpleNamespace
        >>> fit = SimpleNamespace(of_means=np.array([0.5, 0.5]))
        >>> p = BestFit.chance_of_scatter(fit, np.array([1.0, 3.0]))
        >>> f"{p:.6f}"  # of a normal number beyond 2 deviations
        '0.045500'
        """
        return float(chi2.sf(_q(levels, self.of_means, 0.0), levels.size - 1))

    @property
    def independent(self) -> float:
        """Number of independent values that distinguish families equally well (step 5).

        Two records have 4 points, one has 6. If correlations are 1,
        the sum of their cubes is 2*16 + 36. If half of the variance
        is noise, they are 1/2 between different points.

        >>> from types import SimpleNamespace
        >>> first, second = (RecordWindow((1.0,), np.ones(n, dtype=np.bool_)) for n in (4, 6))
        >>> def independent(noise_share, correlation):
        ...     model = SimpleNamespace(noise_share=noise_share, correlation=correlation)
        ...     setting = SimpleNamespace(windows=(first, second, first))
        ...     fit = SimpleNamespace(setting=setting, model=model)
        ...     return f"{BestFit.independent.fget(fit):.6f}"
        >>> independent(0.0, lambda window: np.ones_like(window.pairs)), f"{14**2 / 68:.6f}"
        ('2.882353', '2.882353')
        >>> independent(0.5, lambda window: np.ones_like(window.pairs)), 14**2 / (11 + 9.75)
        ('9.445783', 9.44578313253012)
        >>> independent(0.0, lambda window: np.full_like(window.pairs, -0.5))  # at most 14
        '14.000000'
        """
        points, alike = 0.0, 0.0
        for window, count in Counter(self.setting.windows).items():
            rho = (1.0 - self.model.noise_share) * self.model.correlation(window)
            rho.flat[0] = 1.0  # noise is part of a value
            points += count * float(window.measured.sum())
            alike += count * float(np.sum(window.pairs * rho**3))
        return points**2 / max(alike, points)

    @property
    def lengths_held(self) -> float:
        """Number of correlation lengths (on planes, correlation areas) in all records together.

        Lines with 4 and 5 measured points, and a map with 5 of 6
        points:

        >>> from types import SimpleNamespace
        >>> def held(spacings, *measured):
        ...     length = SimpleNamespace(correlation_length=0.5)
        ...     windows = [
        ...         SimpleNamespace(measured=np.array(m), spacings=spacings) for m in measured]
        ...     return BestFit.lengths_held.fget(SimpleNamespace(
        ...         setting=SimpleNamespace(windows=windows),
        ...         model=SimpleNamespace(spectrum=length, anisotropy=4.0)))
        >>> held((0.25,), [True] * 4, [True, True, False, True, True, True])  # 9*0.25/0.5
        4.5
        >>> held((0.25, 0.5), [[True, True, True], [False, True, True]])  # 5*0.125/(0.5*2)
        0.625
        """
        windows, length = self.setting.windows, self.model.spectrum.correlation_length
        area = sum(float(one.measured.sum()) * math.prod(one.spacings) for one in windows)
        across = length * self.model.anisotropy if windows[0].measured.ndim == 2 else 1.0
        return area / (length * across)

    def as_of_one(self, rows: Sequence[Array]) -> list[Array]:
        """Return records without the scatter between specimens, if it is estimated.

        >>> from types import SimpleNamespace
        >>> fit = SimpleNamespace(within=np.zeros(2), setting=SimpleNamespace(between=False))
        >>> rows = [np.array([1.0, 3.0]), np.array([8.0])]
        >>> [row.tolist() for row in BestFit.as_of_one(fit, rows)]
        [[1.0, 3.0], [8.0]]
        >>> fit.setting.between = True
        >>> [row.round(6).tolist() for row in BestFit.as_of_one(fit, rows)]
        [[2.5, 7.5], [5.0]]
        """
        return as_of_one(rows, self.within) if self.setting.between else list(rows)


def estimate(
    rows: Sequence[Array], setting: FitSetting, start: BestFit | None = None
) -> BestFit:
    """Fit measured values (points,) of each record, less the trend, from a start if it is given.

    Examples
    --------
    Records of different specimens are first scaled to equal means,
    and then twice by means of the last fit (`_estimate` is replaced
    here).

    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> from stiction.base.errors import warn_accuracy, warn_user
    >>> @dataclass
    ... class Fit:
    ...     start: Any
    ...     within: Any
    ...     between: float = 0.0
    ...     def as_of_one(self, rows):
    ...         return ["scaled"]
    >>> def fit(rows, setting, start):
    ...     print([row if isinstance(row, str) else float(row[0].round(4)) for row in rows],
    ...           start and "from a start")
    ...     warn_user("strength", UnitWarning)
    ...     return Fit(start, np.full(3, 0.05))
    >>> rows = [np.array([2.0 * factor]) for factor in np.exp([0.0, 0.7, 0.2])]
    >>> with patch("stiction.inference.estimate._estimate", fit), collect_warnings() as caught:
    ...     estimated = estimate(rows, SimpleNamespace(between=True))
    ...     alone = estimate(["row"], SimpleNamespace(between=False), estimated).between
    ...     again = estimate(rows, SimpleNamespace(between=True), estimated)
    [2.8234, 2.8234, 2.8234] None
    ['scaled'] from a start
    ['scaled'] from a start
    ['row'] from a start
    ['scaled'] from a start
    ['scaled'] from a start
    >>> f"{alone} {math.log1p(estimated.between**2):.6f}", caught  # 0.13 - 0.05
    ('0.0 0.080000', [])
    """
    with collect_warnings() as caught:
        if not setting.between:
            fitted = _estimate(rows, setting, start)
        else:
            # 6. In the first round the scatter of means by the field
            # alone is unknown.
            fitted = start or _estimate(as_of_one(rows, np.zeros(len(rows))), setting, None)
            for _ in range(ROUNDS):
                fitted = _estimate(fitted.as_of_one(rows), setting, fitted)
            between = scatter_between(np.log(levels_of(rows)), fitted.within)
            fitted = replace(fitted, between=between)
    for warning in caught:
        if warning.category is not UnitWarning:  # users do not choose the unit of a fit
            issue(warning)
    return fitted


def _estimate(rows: Sequence[Array], setting: FitSetting, start: BestFit | None) -> BestFit:
    """Fit records from one field (steps 1 to 3).

    Ten records of 64 points are simulated with noise. The fit finds
    their parameters roughly.

    >>> from stiction.inference.marginal_fit import family_of
    >>> from stiction.random.marginals import Lognormal
    >>> windows = (RecordWindow((0.5,), np.ones(64, dtype=np.bool_)),) * 10
    >>> family = SpectrumFamily("exponential", {}, 1.0, None, (0.5, 64.0))
    >>> setting = FitSetting(windows, family_of("lognormal"), family)
    >>> def truth(noise_share):
    ...     model = family.model(family.vector([1.2, 2.0, noise_share]), np.array([0.0, 1.0]))
    ...     law = Lognormal(mean=5.0, cv=0.2)
    ...     return BestFit(setting, law, law, model, 0.1, 0.1, (0.0, 0.0))
    >>> rows = truth(0.15).simulate(np.random.default_rng(0))
    >>> fit = _estimate(rows, setting, None)
    >>> names = "mean", "standard_deviation", "correlation_length", "noise"
    >>> ratios = [fit.parameters[name] / truth(0.15).parameters[name] for name in names]
    >>> bool(np.all(np.abs(np.log(ratios)) < [0.05, 0.15, 0.3, 0.3]))
    True
    >>> f"{fit.noise[0] / fit.model.noise**2:.6f}", 0.02 < fit.noise[1] < 0.1
    ('1.000000', True)
    >>> ratio = fit.marginal.cv / fit.of_values.cv  # step 3
    >>> f"{ratio * _left(windows, fit.model) ** 0.5:.6f}", ratio > 1.0
    ('1.000000', True)
    >>> again = _estimate(rows, setting, fit).parameters
    >>> max(abs(math.log(again[name] / fit.parameters[name])) for name in names) < 0.01
    True

    The Kolmogorov distance and the roughness compare the data with
    the model.

    >>> from scipy.stats import kstest
    >>> quiet = setting.marginal.quiet(np.concatenate(rows), fit.model.noise)
    >>> f"{kstest(quiet, fit.of_values.distribution.cdf).statistic / fit.distance:.6f}"
    '1.000000'
    >>> (group,) = periodograms_of(rows, windows)
    >>> _, measured, expected = bands(group, fit.model.expectation(windows[0])).T + group.floor
    >>> f"{np.mean(np.log(measured / expected) ** 2) / fit.roughness:.6f}"
    '1.000000'

    Without noise, the estimated variance may be negative by chance.
    The noise is then zero. If the noise is known, its variance is
    not estimated.

    >>> rows = truth(1e-20).simulate(np.random.default_rng(4))
    >>> fit = _estimate(rows, setting, None)
    >>> fit.noise[0] < 0.0, fit.model.noise
    (True, 0.0)
    >>> known = replace(setting, spectrum=replace(family, noise=0.3))
    >>> fit = _estimate(rows, known, None)
    >>> fit.noise, round(fit.model.noise, 6)
    ((0.0, 0.0), 0.3)
    """
    family = setting.spectrum
    values = np.concatenate(rows)
    observed = periodograms_of(rows, setting.windows)
    vector: Any = None
    marginal: Any = None
    noise = family.noise or 0.0
    if start is not None:
        vector = family.vector_of(start.model)
        marginal, noise = start.marginal, start.model.noise
    for _ in range(2):
        # 1.
        marginal = setting.marginal.fit(values, noise, marginal)
        # 2. The coarse grid takes most of the time of a fit, and a
        # repetition skips it.
        likelihood = Whittle(family, hermite_shares(marginal), observed)
        vector, state = likelihood.fit(likelihood.coarse() if vector is None else vector)
        model = state[0]
        if model.noise_share < 0.0:  # the best possible noise is zero
            without = likelihood._replace(family=replace(family, noise=0.0))
            _, (model, _) = without.fit(vector[:-1])
        if abs(model.noise**2 - noise**2) < NEGLIGIBLE_CHANGE * model.variance:
            break
        noise = model.noise
    ratios = [
        math.log((measured + group.floor) / (predicted + group.floor))
        for group in observed
        for _, measured, predicted in bands(group, model.expectation(group.window))
    ]
    quiet = setting.marginal.quiet(values, model.noise)
    # 3.
    return BestFit(
        setting=setting,
        marginal=setting.marginal.widened(marginal, _left(setting.windows, model) ** -0.5),
        of_values=marginal,
        model=model,
        distance=float(ks_1samp(quiet, marginal.distribution.cdf, method="asymp").statistic),
        roughness=float(np.mean(np.square(ratios))),
        noise=likelihood.noise_variance(vector, state) if family.noise is None else (0.0, 0.0),
    )


def _left(windows: Sequence[RecordWindow], model: Model) -> float:
    """Return the expected fraction of the field's variance that remains about mean and trend.

    For N values with correlation R, the fraction is tr(M R)/N. The
    projection M removes the trend of each record, and the mean of all
    records, from the values.

    Values without correlation lose one of N for the mean of all,
    and one for the trend of each record. A single record that is
    correlated throughout loses all, and the least part is left.

    >>> from types import SimpleNamespace
    >>> first, second = (RecordWindow((1.0,), np.ones(n, dtype=np.bool_), 1) for n in (4, 6))
    >>> white = SimpleNamespace(correlation=lambda w: 1.0 * (np.arange(w.pairs.size) == 0))
    >>> uniform = SimpleNamespace(correlation=lambda w: np.ones_like(w.pairs))
    >>> f"{_left([first, second, first], white):.6f}"  # 1 - (3 + 1)/14
    '0.714286'
    >>> f"{_left([first, second, first], uniform):.6f}"  # 1 - (2*16 + 36)/14^2
    '0.653061'
    >>> _left([first], uniform)
    0.2
    """
    taken, mean, points = 0.0, 0.0, 0.0
    for window, count in Counter(windows).items():
        correlation, size = model.correlation(window), float(window.measured.sum())
        points += count * size
        taken += count * window.taken_by_trend(correlation)
        mean += count * size**2 * window.variance_of_mean(correlation)
    return max(1.0 - (taken + mean / points) / points, LEAST_LEFT)


def bands(group: Observed, expected: Array) -> Array:
    """Return band averages (bands, 3) of wavenumber (rad/m), periodogram and expectation.

    Examples
    --------
    The wavenumbers 4 and 4.1 are in one band. The point with weight
    0 is left out.

    >>> from types import SimpleNamespace
    >>> window = SimpleNamespace(
    ...     weights=np.array([[0, 1, 1], [0.5, 1, 0]]),
    ...     wave_vectors=(np.array([[0], [4.1]]), np.array([[0, 4, 8]])))
    >>> group = SimpleNamespace(window=window, average=np.array([[99, 1, 2], [5, 7, 99]]))
    >>> for band in bands(group, np.array([[99, 3, 4], [6, 8, 99]])):
    ...     band.round(4).tolist()
    [4.05, 3.0, 4.5]
    [5.728, 7.0, 8.0]
    [8.0, 2.0, 4.0]
    """
    weights = group.window.weights
    k = np.broadcast_to(np.sqrt(sum(v**2 for v in group.window.wave_vectors)), weights.shape)
    kept = weights > 0.0
    k = k[kept]
    # Single ordinates scatter by their own size. Averages of a band
    # hide this scatter.
    band = np.unique(np.round(BANDS_PER_OCTAVE * np.log2(k / k.min())), return_inverse=True)[1]
    sums = [np.bincount(band, weights=w) for w in (k, group.average[kept], expected[kept])]
    return np.transpose(sums) / np.bincount(band)[:, None]


class Goodness(NamedTuple):
    """How well a family of marginals fits: its best member, and two measures of the fit.

    `distance` is Kolmogorov's distance. `score` is the score (step 4)
    minus the score of the best family: 0 for the best family, negative
    for others. Differences below 2 do not distinguish families.
    `weight` is the fraction of fields that `FieldFit.interfaces` draws
    from the family. The weight is proportional to the likelihood of
    these fields. Because the fields scatter about the estimate, their
    log likelihood is on average below the maximum by half a unit for
    each parameter.
    """

    marginal: Any
    distance: float
    score: float
    weight: float


def windowed(
    records: Sequence[Record], degree: int
) -> tuple[tuple[RecordWindow, ...], list[Array]]:
    """Return a window for each record, shared by equal geometries, and the values without trend.

    Examples
    --------
    A straight line less its trend is its mean. The records 0 and 1
    have the same geometry.

    >>> line, spacing = np.array([1.0, 3.0, 5.0, 7.0]), (0.5,)
    >>> missing = np.array([1.0, 3.0, np.nan, 7.0])
    >>> records = (line, spacing), (2.0 * line, spacing), (missing, spacing), (line, (0.25,))
    >>> windows, rows = windowed([Record(*record) for record in records], 1)
    >>> [windows.index(window) for window in windows], windows[3].spacings
    ([0, 0, 2, 3], (0.25,))
    >>> [row.round(6).tolist() for row in rows[1:3]]
    [[8.0, 8.0, 8.0, 8.0], [3.666667, 3.666667, 3.666667]]
    """
    made: dict[Any, RecordWindow] = {}
    windows, rows = [], []
    for values, spacings in records:
        measured = np.isfinite(values)
        key = (values.shape, spacings, measured.tobytes())
        if key not in made:
            made[key] = RecordWindow(spacings, measured, degree)
        windows.append(made[key])
        rows.append(made[key].without_trend(values[measured]))
    return tuple(windows), rows


def ranking(
    settings: Sequence[FitSetting], rows: Sequence[Array]
) -> tuple[list[BestFit], dict[str, Goodness]]:
    """Return estimates (best family first), and their qualities by name of the family.

    Families that cannot be fitted are left out. If all families fail,
    an `InputError` is raised.

    Examples
    --------
    Three families have 2, 1 and 2 parameters. The likeliest family,
    'a', has 20 independent values, so the scores are -20 - 2, -24 -
    1 and -30 - 2. (Fits are replaced by numbers here.)

    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> means, sizes = {"a": -1.0, "b": -1.2, "d": -1.5}, {"a": 20, "b": 40, "d": 60}
    >>> def setting(name):
    ...     parameters = "x" if name == "b" else "xy"
    ...     law = SimpleNamespace(label=name, parameters=lambda _: parameters)
    ...     return SimpleNamespace(marginal=law, spectrum=SimpleNamespace(noise=None))
    >>> def fit(rows, setting):
    ...     if (name := setting.marginal.label) not in means:
    ...         raise InputError(f"{name} fails")
    ...     return SimpleNamespace(
    ...         setting=setting, marginal=name.upper(), of_values=means[name],
    ...         distance=sizes[name] / 100, independent=sizes[name],
    ...         model=SimpleNamespace(noise=0.0), as_of_one=lambda rows: rows)
    >>> changed = {"estimate": fit, "mean_log_likelihood": lambda mean, *_: mean}
    >>> with patch.multiple("stiction.inference.estimate", **changed):
    ...     estimates, families = ranking([setting(name) for name in "dcba"], [np.ones(3)])
    ...     ranking([setting("x"), setting("y")], [np.ones(3)])
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: x fails
    y fails
    >>> [one.marginal for one in estimates], [*families]
    (['A', 'B', 'D'], ['a', 'b', 'd'])
    >>> [round(one.score, 6) for one in families.values()], families["b"][:2]
    ([0.0, -3.0, -10.0], ('B', 0.4))
    >>> ratio = families["b"].weight / families["a"].weight  # exp(-3 + 0.5) over exp(0 + 1)
    >>> f"{math.log(ratio):.6f}", families["d"].weight, f"{families['a'].weight:.6f}"
    ('-3.500000', 0.0, '0.970688')
    """
    fitted: list[tuple[float, BestFit]] = []
    problems: list[str] = []
    for setting in settings:
        try:
            if setting.spectrum.noise == 0.0:
                setting.marginal.check(np.concatenate(rows))
            estimated = estimate(rows, setting)
        except InputError as error:
            problems += error.problems
            continue
        values = np.concatenate(estimated.as_of_one(rows))
        fitted.append(
            (mean_log_likelihood(estimated.of_values, values, estimated.model.noise), estimated)
        )
    if not fitted:
        raise InputError(problems)
    # 4. and 5. All families use the number of independent values of
    # the likeliest family.
    independent = max(fitted, key=lambda one: one[0])[1].independent
    costs = np.array([len(one.setting.marginal.parameters(one.of_values)) for _, one in fitted])
    scores = independent * np.array([mean for mean, _ in fitted]) - costs
    scores -= scores.max()
    # Without the penalty of Akaike's criterion, and half a unit less
    # for each parameter.
    weights = np.exp(scores + 0.5 * costs) * (scores > -DRAWN)
    weights /= weights.sum()
    best_first = np.argsort(-scores, kind="stable").tolist()
    estimates = [fitted[place][1] for place in best_first]
    families = {
        member.setting.marginal.label: Goodness(
            member.marginal, member.distance, float(scores[place]), float(weights[place])
        )
        for place, member in zip(best_first, estimates, strict=True)
    }
    return estimates, families


def levels_of(rows: Sequence[Array]) -> Array:
    """Return the mean for each record from different specimens.

    Examples
    --------
    >>> levels_of([np.array([1.0, 3.0]), np.array([8.0])]).tolist()
    [2.0, 8.0]
    >>> levels_of([np.array([1.0, -1.0]), np.array([8.0])])
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: between: needs records with a positive mean, got 0
    """
    levels = np.array([row.mean() for row in rows])
    if levels.min() <= 0.0:
        raise InputError(f"between: needs records with a positive mean, got {levels.min():g}")
    return levels


def as_of_one(rows: Sequence[Array], within: Array) -> list[Array]:
    """Return the records scaled as if all came from one specimen (step 9).

    `within` holds the variances v_k.

    Examples
    --------
    Without a variance by the field, all records get the mean 5.
    With variances, the logarithms of the levels get Q(0) = n - 1,
    and the mean of the levels stays.

    >>> rows = [np.array([1.0, 3.0]), np.array([8.0])]
    >>> [row.round(6).tolist() for row in as_of_one(rows, np.zeros(2))]
    [[2.5, 7.5], [5.0]]
    >>> scaled = as_of_one(rows, np.full(2, 0.5 * math.log(2.0) ** 2))
    >>> [row.round(6).tolist() for row in scaled]  # the ratio 4 of the means becomes 2
    [[1.666667, 5.0], [6.666667]]
    >>> within = np.array([0.1, 0.2, 0.4])
    >>> levels = levels_of(as_of_one(np.array([[4], [7], [19]]), within))
    >>> f"{levels.mean():.6f} {_q(np.log(levels), within, 0.0):.6f}"
    '10.000000 2.000000'
    """
    levels = levels_of(rows)
    logarithms = np.log(levels)
    # Records of a uniform field have no variance of their own.
    weight = 1.0 / np.maximum(within, 1e-300)
    away = logarithms - weight @ logarithms / weight.sum()
    excess = max(float(weight @ away**2) / max(levels.size - 1, 1), 1e-300)
    wanted = np.exp(away / math.sqrt(excess))
    # The mean over all records stays.
    factors = wanted / wanted.mean() * levels.mean() / levels
    return [row * factor for row, factor in zip(rows, factors, strict=True)]


def _q(values: Array, within: Array, s: float) -> float:
    """Return Q(s) for values (step 7).

    The weights are 1/2 and 1/4, and m(s) is 5/3.

    >>> f"{_q(np.array([1.0, 3.0]), np.array([1.0, 3.0]), 1.0):.6f}"  # (4/9)/2 + (16/9)/4
    '0.666667'
    """
    weight = 1.0 / (s + within)
    middle = float(weight @ values / weight.sum())
    return float(weight @ (values - middle) ** 2)


def scatter_between(logarithms: Array, within: Array) -> float:
    """Estimate the coefficient of variation of a log-normal factor between records (step 8).

    For a single record the estimate is 0.

    Examples
    --------
    With equal variances v, the estimate is the variance of the
    logarithms, 0.13, less v.

    >>> logarithms = np.array([0.0, 0.7, 0.2])
    >>> cv = scatter_between(logarithms, np.full(3, 0.05))
    >>> f"{math.log1p(cv**2):.6f}"
    '0.080000'
    >>> [scatter_between(logarithms[:n], np.full(n, 0.14)) for n in (3, 1)]
    [0.0, 0.0]
    >>> f"{scatter_between(9.0 * logarithms, np.full(3, 0.05)):.6f}"  # at most
    '1.000000'
    """

    def excess(s: float) -> float:  # it falls as s rises
        return _q(logarithms, within, s) - (logarithms.size - 1)

    if excess(0.0) <= 0.0:
        return 0.0
    bracketed = excess(MOST_SCATTER) < 0.0
    variance = brentq(excess, 0, MOST_SCATTER) if bracketed else MOST_SCATTER
    return math.sqrt(math.expm1(variance))

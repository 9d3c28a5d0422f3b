"""Fit a random field to measured profiles, with intervals and doubts.

Problem. Records are samples of one random field, with noise. Find the
field, and how well the records determine the field.

Sources. The parts, and their sources, are described in `records`,
`window`, `whittle`, `marginal_fit`, `estimate`, `bootstrap` and
`specimens`.

Steps:

1. Turn profiles into records at equal distances, and refuse white noise
   (`records`, `window`).
2. Fit each family of marginals together with the spectrum, and sort the
   families by score (`estimate`).
3. Fit records that are simulated from the best family,
   and from other families that may be true (`bootstrap`).
   If a family cannot be fitted to records simulated from
   it, leave the family out and repeat from step 2.
4. Compute intervals from the repetitions. If records come from
   different specimens, compute the intervals of mean and scatter from
   the posterior given the record levels (`specimens`).
5. Compare the distances of the data from marginal and spectrum with the
   distances of the repetitions. The logarithms of these distances are
   about normal, so p-values follow from Student's distribution.
6. Draw likely fields from the families in proportion to their
   weights. The draws follow a sequence of Niederreiter, which
   is evenly spread (Random Number Generation and Quasi-Monte
   Carlo Methods, 1992, chapter 3).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from functools import cached_property
from itertools import chain, cycle
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field
from scipy.stats import t as student

from stiction.base.arrays import Array
from stiction.base.errors import InputError, UnitWarning, unknown_name, warn_accuracy, warn_user
from stiction.base.model import Count, Flag, NotNegative, Number, Positive, Progress, checked
from stiction.base.representation import Result, Row, Summary
from stiction.base.variables import QUANTITIES, unit_of_key
from stiction.inference.bootstrap import (
    FIT_CONFIDENCE,
    MIN_REPETITIONS,
    TAILS,
    NotRepeated,
    Refits,
    bootstrapped,
    intervals,
    likely,
)
from stiction.inference.estimate import BestFit, FitSetting, Goodness, ranking, windowed
from stiction.inference.likelihood import Simulation
from stiction.inference.marginal_fit import Family, family_of
from stiction.inference.records import records_of, refuse_uncorrelated
from stiction.inference.specimens import (
    FEW_FIELDS,
    MEAN_KEY,
    SCATTER_KEY,
    FactorGrid,
    Prediction,
    Profiles,
    families_of,
    grid_of_profiles,
    of_mean,
)
from stiction.inference.whittle import SpectrumFamily, spectrum_family
from stiction.inference.window import RecordWindow
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem
from stiction.random.dotted_keys import with_values
from stiction.random.equally_likely import WithFactors
from stiction.random.fields import RandomField, RandomInterface

USUAL_FAMILIES = ("lognormal", "weibull", "gamma", "beta")
ENOUGH_LENGTHS = 10.0
"""Number of correlation lengths that a record needs to constrain
parameters well."""
MIN_P_VALUE = 0.01
"""p-value below which a family does not fit."""
ADVICE = {
    "marginal": "The values are far from this family. Compare families",
    "spectrum": "The periodogram is far from this family. Use another spectrum or a higher detrend",
    "level": "Means of records scatter more than means of one field. Designs based on the fit omit"
    " this scatter. Pass between=True if records are of different specimens",
}
TOLD = 2.0
"""Difference of scores above which data distinguish two families."""
FEW_SPECIMENS = 5
"""Fewest specimens whose scatter determines rare failures."""
EVENLY = 0.5 * (math.sqrt(5.0) - 1.0)
"""Step of a sequence modulo 1 that fills [0, 1) evenly."""
USUAL_STRENGTH = 1e4
"""Least strength of a usual solid, Pa."""
INTERVAL_DRAWS = 4000
"""Number of draws from the posterior for intervals."""


def _families(given: Any) -> list[Family]:
    """Return the families for names or tables.

    >>> [family.label for family in _families(("gamma", {"type": "beta", "high": 3.0}))]
    ['gamma', 'beta, high 3']
    >>> [family.label for family in _families("beta")]
    ['beta']
    >>> _families([])
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: must name a family
    """
    several = given if isinstance(given, list | tuple) else [given]
    if not several:
        raise InputError("must name a family")
    return list(map(family_of, several))


def _factors(given: Any) -> tuple[str, ...]:
    """Return the families of the factor between specimens.

    >>> _factors(False), _factors("normal"), _factors(True) == families_of(True)
    ((), ('normal',), True)
    >>> _factors([])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: must be True, False, or some of ...
    """
    return () if given is False else families_of(given)


DEFAULT_TOO = Field(validate_default=True)
Marginals = Annotated[Any, BeforeValidator(_families), DEFAULT_TOO, "str | list"]
Spectrum = Annotated[Any, BeforeValidator(spectrum_family), DEFAULT_TOO, "str | Spectrum"]
Factors = Annotated[Any, BeforeValidator(_factors), DEFAULT_TOO, "str | list"]


@dataclass(frozen=True, eq=False, repr=False)
class FieldFit(WithFactors, Result):
    """A random field that is fitted to measured profiles, with intervals and doubts.

    Attributes
    ----------
    field : RandomField
        The fitted field, for simulations, without measurement noise and
        with the mean mode.
    parameters : dict from str to float
        Estimates in SI. ``efolding_length`` (m) is the lag at which the
        correlation of z falls to 1/e. ``mean`` and
        ``standard_deviation`` describe the field. ``marginal.*``,
        ``correlation_length``, ``exponent`` and ``anisotropy`` are keys of
        a prior and a sweep. ``noise`` is the standard deviation of the
        measurement noise, and ``between`` is the coefficient of
        variation between specimens.
    interval : dict from str to (float, float)
        90 % bootstrap interval for each parameter. The interval for the
        noise may begin at zero. Intervals for bounds of the marginal
        end outside the values. An interval that ends at an end of the
        searched range has no known end: 10 ranges of the values for
        bounds of the marginal, a shape of 1 of 'beta' at a free bound,
        0.65 to 16 for the exponent, 0.05 to 20 for the anisotropy. With
        `between`, the intervals for ``mean`` and ``between`` come from
        the posterior given the record levels.
    repetitions : tuple of RandomField
        Fits to records simulated from `field`, which a repeated
        measurement might have given.
    families : dict from str to Goodness
        Quality of the fit for each requested family. The best family
        comes first.
    p_values : dict from str to float
        Probability that records with the fitted ``marginal`` and
        ``spectrum`` differ from their fits as much as the data do. A
        small probability means that the family does not fit. For
        several records without `between`, ``level`` is the probability
        that their means scatter as much.
    missing : (int, int)
        Number of points without a value, which are left out, and total
        number of points.
    doubts : tuple of str
        Reasons not to trust the fit, if any.
    """

    field: RandomField
    parameters: Mapping[str, float]
    interval: Mapping[str, tuple[float, float]]
    repetitions: tuple[RandomField, ...]
    families: Mapping[str, Goodness]
    p_values: Mapping[str, float]
    missing: tuple[int, int]
    quantity: str
    doubts: tuple[str, ...]
    _repeated: Sequence[Refits]  # of the field, and of other families that may be drawn
    _rows: Sequence[Array]
    _levels: Array
    _families: tuple[str, ...]  # of the factor between specimens; empty without a factor
    _between: Mapping[str, Any] = dataclass_field(default_factory=dict)

    @property
    def specimens(self) -> int:
        """Number of specimens whose scatter was fitted, or 0 without `between`.

        >>> from types import SimpleNamespace
        >>> fit = SimpleNamespace(_levels=np.ones(3), _families=("normal",))
        >>> FieldFit.specimens.fget(fit), FieldFit.specimens.fget(SimpleNamespace(_families=()))
        (3, 0)
        """
        return self._levels.size if self._families else 0

    @property
    def _estimate(self) -> BestFit:
        return self._repeated[0].truth

    @property
    def lengths_held(self) -> float:
        """Number of correlation lengths (on planes, correlation areas) in all records together."""
        return self._estimate.lengths_held

    @property
    def tied(self) -> tuple[str, ...]:
        """Names of the families that the records cannot distinguish from the best family.

        >>> from types import SimpleNamespace
        >>> scores = {"a": 0.0, "b": -1.9, "c": -2.0}
        >>> families = {name: SimpleNamespace(score=score) for name, score in scores.items()}
        >>> FieldFit.tied.fget(SimpleNamespace(families=families))
        ('a', 'b')
        """
        return tuple(name for name, one in self.families.items() if one.score > -TOLD)

    @cached_property
    def _likely(self) -> list[list[RandomField]]:
        values = np.concatenate(self._rows)
        return [likely(repeated, values, self.quantity) for repeated in self._repeated]

    @checked
    def interfaces(self, count: Count, seed: Number = 0) -> list[RandomInterface]:
        """Return equally likely random interfaces, over which failure probabilities are averaged.

        Each interface is the estimate minus the error of a repetition,
        so the interfaces have the bias and scatter of the intervals.
        Families of the marginal are drawn in proportion to their
        `weight`. With `between`, each interface has a mean and a factor
        between specimens, drawn from their posterior
        (`stiction.inference.specimens`). With the same seed, a longer
        list begins with the shorter list.

        Parameters
        ----------
        count : int
            Number of interfaces. A family has at most one different
            field for each repetition.
        seed : int
            Not negative.

        Raises
        ------
        InputError
            If the fitted quantity is not a strength.

        Examples
        --------
        >>> import stiction as st
        >>> truth = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), st.ExponentialSpectrum(1e-3))
        >>> interface = st.Interface(length=0.05, nodes=500)
        >>> fit = st.fit_field(truth.sample(interface, seed=2), interface, marginal="lognormal",
        ...                    spectrum="exponential", noise=0.0, bootstrap=20)
        >>> means = [one.strength.mean for one in fit.interfaces(10)]
        >>> min(means) < fit.field.mean < max(means)
        True
        """
        chosen = self._chosen(count, seed)
        if not self._families:
            return self._scattered([RandomInterface(strength=field) for field in chosen])
        # The mean and the factor follow from the posterior given the
        # chosen field.
        rng = np.random.default_rng([seed, 6])
        drawn = self._posterior.draws(count, rng, [self._numbers[field] for field in chosen])
        return self._scattered(list(map(self._posterior.interface, drawn)))

    def prediction(
        self, problem: Problem, method: Any, changes: Mapping[str, float], workers: int | None
    ) -> Prediction | None:
        """Return the prediction for a problem with constants changed by full key.

        The result is `None` if records are of a single specimen, which
        has no posterior of mean and scatter.

        >>> from types import SimpleNamespace
        >>> FieldFit.prediction(SimpleNamespace(_families=()), None, None, {}, None) is None
        True
        """
        if not self._families:
            return None
        given = {key.removeprefix("problem."): value for key, value in changes.items()}
        grid, _ = grid_of_profiles(self.profiles(FEW_FIELDS, 0))
        simulation = Simulation(method, None, 0, workers)
        return Prediction.of(grid, with_values(problem, given, "problem"), simulation)

    def _chosen(self, count: int, seed: int) -> list[RandomField]:
        """Return likely fields from all families in proportion to their weights (step 6).

        Family 'a' has two fields and three quarters of the weight.
        Family 'b' has one field. Family 'z' has no weight and no
        field.

        >>> from types import SimpleNamespace
        >>> weights = {"a": 0.3, "z": 0.0, "b": 0.1}
        >>> families = {name: SimpleNamespace(weight=share) for name, share in weights.items()}
        >>> likely = [["a0", "a1"], ["b0"]]
        >>> fit = SimpleNamespace(quantity="strength", _likely=likely, families=families)
        >>> chosen = FieldFit._chosen(fit, 1000, 7)
        >>> 745 < len(chosen) - chosen.count("b0") < 755
        True
        >>> abs(chosen.count("a0") - chosen.count("a1")) <= 1
        True
        >>> chosen[:9] == FieldFit._chosen(fit, 9, 7)
        True
        >>> len({tuple(FieldFit._chosen(fit, 4, seed)) for seed in range(20)}) > 2
        True
        >>> fit.quantity = "normal_pressure"
        >>> FieldFit._chosen(fit, 9, 7)  # doctest: +ELLIPSIS
        Traceback (most recent call last):
            ...
        stiction.base.errors.InputError: interfaces: need a strength, but ...
        """
        if self.quantity not in ("strength", "friction_coefficient"):
            raise InputError(
                f"interfaces: need a strength, but this fit describes {self.quantity}. Pass fields"
                f" of `fit.repetitions` to st.RandomInterface(strength=..., {self.quantity}=...)"
            )
        rng = np.random.default_rng([seed, 5])
        # Evenly spread places divide the draws between families more
        # exactly than random places.
        ends = np.cumsum([one.weight for one in self.families.values() if one.weight > 0.0])
        places = (rng.random() + EVENLY * np.arange(count)) % 1.0 * ends[-1]
        family = np.minimum(np.searchsorted(ends, places), ends.size - 1)
        # Each family uses its fields in a random order, and
        # repeats it if necessary.
        orders = [cycle(rng.permutation(len(fields))) for fields in self._likely]
        return [self._likely[number][next(orders[number])] for number in family.tolist()]

    @cached_property
    def _numbers(self) -> dict[RandomField, int]:
        """All likely fields, with their numbers in the posterior."""
        fields = dict.fromkeys(chain.from_iterable(self._likely))
        return {field: number for number, field in enumerate(fields)}

    @cached_property
    def _posterior(self) -> FactorGrid:
        """Posterior of mean and scatter between specimens, given the levels of the profiles."""
        return grid_of_profiles(self._with_levels(list(self._numbers)))[0]

    def profiles(self, count: int, seed: int) -> Profiles:
        """Return likely fields and the record levels, for the posterior with peaks."""
        return self._with_levels(list(dict.fromkeys(self._chosen(count, seed))))

    def _with_levels(self, fields: Sequence[RandomField]) -> Profiles:
        """Return the fields, the record levels, and the variance of each level by each field.

        The second field has twice the coefficient of variation and
        twice the length. Its levels have 8 times the variance, but
        at most the variance of the field.

        >>> import stiction as st
        >>> from types import SimpleNamespace
        >>> def field(mean, cv, length):
        ...     law = st.Lognormal(mean=mean, cv=cv)
        ...     return RandomField(law, st.ExponentialSpectrum(length))
        >>> truth = SimpleNamespace(
        ...     parameters={"mean": 2.0, "standard_deviation": 0.4},
        ...     within=np.array([0.001, 0.03]), field=lambda quantity: field(2.0, 0.2, 1e-3))
        >>> fit = SimpleNamespace(quantity="strength", _estimate=truth)
        >>> fit._levels, fit._families = np.array([3.0, 4.0]), ("normal",)
        >>> fields = [field(2.0, 0.2, 1e-3), field(5.0, 0.4, 2e-3)]
        >>> profiles = FieldFit._with_levels(fit, fields)
        >>> profiles.within.round(6).tolist(), round(math.log1p(0.4**2), 6)
        ([[0.001, 0.03], [0.008, 0.14842]], 0.14842)
        >>> profiles.levels.tolist(), profiles.reference, profiles.families
        ([3.0, 4.0], 2.0, ('normal',))
        >>> [round(one.strength.mean, 6) for one in profiles.fields]
        [2.0, 2.0]

        Without `between`, the weighted mean is the level of a
        single specimen.

        >>> fit._families = ()
        >>> profiles = FieldFit._with_levels(fit, fields)
        >>> weights = 1000.0, 1.0 / 0.03
        >>> f"{profiles.levels[0] - (3 * weights[0] + 4 * weights[1]) / sum(weights):.6f}"
        '0.000000'
        >>> f"{profiles.within[0, 0] * sum(weights):.6f}", profiles.within.shape
        ('1.000000', (2, 1))
        >>> f"{profiles.within[1, 0] * (1 / 0.008 + 1 / math.log1p(0.4**2)):.6f}"
        '1.000000'
        >>> profiles.families == families_of(True)
        True
        """
        truth, levels = self._estimate, self._levels
        mean, deviation = (truth.parameters[k] for k in ("mean", "standard_deviation"))
        length = truth.field(self.quantity).spectrum.efolding_length
        cvs = np.array([one.standard_deviation / one.mean for one in fields])
        lengths = np.array([one.spectrum.efolding_length for one in fields])
        # The variance of a mean grows with the variance of the field
        # and its correlation length.
        share = np.minimum(cvs**2 * lengths / ((deviation / mean) ** 2 * length), 1e3)
        within = np.minimum(np.outer(share, truth.within), np.log1p(cvs**2)[:, None])
        if not self._families:
            # All records are of one specimen. Their
            # weighted mean is a single level, whose
            # variance is the variance of a weighted mean.
            weight = 1.0 / np.maximum(truth.within, 1e-300)
            levels = np.atleast_1d(weight @ levels / weight.sum())
            within = 1.0 / np.sum(1.0 / np.maximum(within, 1e-300), axis=1, keepdims=True)
        members = tuple(of_mean(RandomInterface(strength=one), mean) for one in fields)
        families = self._families or families_of(True)
        return Profiles(members, mean, levels, within, families)

    def _summary(self) -> Summary:
        """Return the summary: parameters with intervals, scores,
        p-values and doubts.

        >>> import stiction as st
        >>> from types import SimpleNamespace
        >>> best, second = SimpleNamespace(score=0.0), SimpleNamespace(score=-1.5)
        >>> families = {"lognormal": best, "beta": second}
        >>> field = st.RandomField(st.Lognormal(mean=2e6, cv=0.2), st.ExponentialSpectrum(1e-3))
        >>> numbers = {"mean": 2e6, "marginal.mean": 2e6, "exponent": 3.0}
        >>> fit = SimpleNamespace(
        ...     field=field, lengths_held=12.34, quantity="strength", parameters=numbers,
        ...     missing=(3, 90),
        ...     interval={name: (value / 2.0, value * 2.0) for name, value in numbers.items()},
        ...     p_values={"marginal": 0.25, "level": 0.5}, families=families,
        ...     tied=("lognormal", "beta"), repetitions=(1, 2), doubts=("too short",))
        >>> summary = FieldFit._summary(fit)
        >>> print(summary.title, summary.interval, sep="\\n")
        lognormal marginal, exponential spectrum from 12.3 correlation lengths
        90 % interval
        >>> for row in summary.rows:
        ...     print(row.name, row.value, row.interval, row.unit)
        marginal.mean 2000000.0 (1000000.0, 4000000.0) Pa
        exponent 3.0 (1.5, 6.0) 1
        >>> print(*summary.notes, sep="\\n")
        3 of 90 points are missing and left out
        scores of families: lognormal 0.0, beta -1.5 (lognormal, beta cannot be distinguished)
        p-values: marginal 0.25, level 0.5 (2 repetitions)
        ! too short
        >>> fit.missing, fit.families, fit.doubts = (0, 90), {"lognormal": best}, ()
        >>> fit.parameters = {"mean": 2e6}
        >>> FieldFit._summary(fit).rows[0].name, FieldFit._summary(fit).notes
        ('mean', ['p-values: marginal 0.25, level 0.5 (2 repetitions)'])
        >>> fit.families, fit.tied = families, ("lognormal",)
        >>> FieldFit._summary(fit).notes[0]
        'scores of families: lognormal 0.0, beta -1.5'
        """
        marginal = getattr(self.field.marginal, "type", "marginal").replace("_", " ")
        spectrum = getattr(self.field.spectrum, "type", "").replace("_", " ")
        held = f"{self.lengths_held:.3g} correlation lengths"
        title = f"{marginal} marginal, {spectrum} spectrum from {held}"
        of_field = QUANTITIES[self.quantity].units
        rows = [
            Row(name, value, self.interval[name], unit_of_key(name, of_field))
            for name, value in self.parameters.items()
            if name != "mean" or "marginal.mean" not in self.parameters  # the same number
        ]
        missing = "{} of {} points are missing and left out".format(*self.missing)
        lines = [missing] * bool(self.missing[0])
        p_values = ", ".join(f"{name} {p:.3g}" for name, p in self.p_values.items())
        if len(self.families) > 1:
            tied = f" ({', '.join(self.tied)} cannot be distinguished)" if self.tied[1:] else ""
            scores = ", ".join(f"{name} {one.score:.1f}" for name, one in self.families.items())
            lines.append(f"scores of families: {scores}{tied}")
        lines.append(f"p-values: {p_values} ({len(self.repetitions)} repetitions)")
        lines += [f"! {doubt}" for doubt in self.doubts]
        return Summary(title, rows, f"{100 * FIT_CONFIDENCE:g} % interval", lines)


@checked
def fit_field(
    profiles: Any,
    interface: Interface | None = None,
    *,
    marginal: Marginals = USUAL_FAMILIES,
    spectrum: Spectrum = "power_law",
    detrend: Literal[0, 1, 2, 3] = 0,
    noise: Flag | NotNegative = True,
    anisotropy: Flag | Positive = False,
    between: Factors = False,
    quantity: str = "strength",
    bootstrap: Annotated[Count, Field(ge=MIN_REPETITIONS)] = 200,
    seed: Number = 0,
    progress: Progress = True,
) -> FieldFit:
    """Fit a random field to measured profiles, with an interval for every parameter.

    Parameters
    ----------
    profiles : DataArray, array, or list of them
        Lines over 'x' or maps over 'x' and 'y' (m) with equally spaced points, from
        `read_profile`. Missing values (NaN) are left out. Arrays in SI have a value at each
        node of `interface`, as (nodes,), (samples, nodes), (nx, ny) or (samples, nx, ny).
        Several profiles are samples of one field, and may differ in length.
    interface : Interface, optional
        Needed for arrays without coordinates. A warning says if it is too short or too coarse.
    marginal : str, dict or sequence of them
        'beta', 'lognormal', 'weibull', 'gamma' or 'normal'. The best of several is chosen
        (`families`). A table fixes bounds: ``{"type": "beta", "low": 0, "high": 2e6}``. Only
        'beta' has free bounds by default.
    spectrum : str or dict
        'power_law', 'squared_exponential' or 'exponential', or a table that fixes parameters:
        ``{"type": "power_law", "exponent": 4.0}``. The spectrum of a record is not truncated.
    detrend : int
        Degree of the removed polynomial trend, 0 to 3. The mean is kept. The scatter that the
        trend takes on average is added to the estimate.
    noise : bool or float
        Whether to estimate white, normal measurement noise, or its known standard deviation.
    anisotropy : bool or float
        For maps, the ratio of correlation lengths along y and x. True estimates the
        ratio.
    between : bool, str or sequence of str
        Whether records come from different specimens, each of which has a factor with mean 1
        and the coefficient of variation ``between``. Names choose its
        distributions ('lognormal', 'normal', 'weibull'). True averages over
        all.
    quantity : str
        Measured quantity: 'strength', 'normal_pressure', 'friction_coefficient', ...
    bootstrap : int
        Repetitions, at least 20, for each of three correlation lengths.
    seed : int
        Seed for the repetitions.
    progress : bool or callable
        As in `stiction.monte_carlo`.

    Returns
    -------
    FieldFit
        With `field`, `parameters` and `interval`. `stiction.plot.fit`
        draws the fit.

    Raises
    ------
    InputError
        If units are unknown, points are not equally spaced, neighbouring points are not
        correlated, records are constant or short, or values lie outside the bounds.

    Warns
    -----
    AccuracyWarning
        For outliers, dropouts and repeated profiles, families that are left out, and each of
        the `doubts`.
    UnitWarning
        If a table states no unit, the mean strength is below 10 kPa, or a record is shorter
        than 0.01 mm or longer than 1 km.

    Notes
    -----
    A composite likelihood gives the marginal, a Whittle likelihood the spectrum, and a
    studentised bootstrap the intervals (`stiction.inference.fit` names the sources).

    Examples
    --------
    >>> import stiction as st
    >>> truth = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), st.ExponentialSpectrum(1e-3))
    >>> interface = st.Interface(length=0.1, nodes=1000)
    >>> fit = st.fit_field(truth.sample(interface, seed=2), interface, marginal="lognormal",
    ...                    spectrum="exponential", noise=0.0, bootstrap=40)
    >>> low, high = fit.interval["correlation_length"]
    >>> bool(low < 1e-3 < high)
    True
    """
    if quantity not in QUANTITIES:
        raise InputError(unknown_name("quantity", quantity, QUANTITIES))
    # 1.
    records = records_of(profiles, interface, quantity)
    points = sum(record.values.size for record in records)
    ratio = None if anisotropy is True else float(anisotropy or 1.0)
    if ratio != 1.0 and records[0].values.ndim == 1:
        raise InputError("anisotropy: applies to maps only, not to lines. Leave it out")
    spacing = max(max(record.spacings) for record in records)
    longest = max(max(np.multiply(one.values.shape, one.spacings)) for one in records)
    # A correlation length outside this range leaves no trace in a record.
    (name, fixed), deviation = spectrum, None if noise is True else float(noise)
    family = SpectrumFamily(name, fixed, ratio, deviation, (spacing, 2.0 * float(longest)))
    windows, rows = windowed(records, detrend)
    levels = np.array([row.mean() for row in rows])
    if quantity == "strength" and 0.0 < (level := float(levels.mean())) < USUAL_STRENGTH:
        warn_user(
            f"profiles: the mean strength is {level:.4g} Pa, which is unusual for a solid. Check"
            " the unit, or state it, as in st.read_profile(path, unit='MPa')",
            UnitWarning,
        )
    refuse_uncorrelated(windows, rows)
    settings = [FitSetting(windows, one, family, bool(between)) for one in marginal]
    families, repeated, further = _refitted(settings, rows, bootstrap, seed, progress)
    # 4. and 5.
    field = repeated[0].truth.field(quantity)
    object.__setattr__(field, "specimens_of_fit", len(levels) if between else 0)
    fit = FieldFit(
        **_judged(repeated, rows, levels, bootstrap, between),
        field=field,
        repetitions=tuple(one.field(quantity) for one in repeated[0].fits),
        families=families,
        missing=(points - sum(row.size for row in rows), points),
        quantity=quantity,
        _repeated=[repeated[0], *further],
        _rows=repeated[0].truth.as_of_one(rows),
        _levels=levels,
        _families=between,
    )
    for doubt in fit.doubts:
        warn_accuracy(doubt)
    if interface is not None:
        fit.field.modes(interface)
        fit.field.warn_if_inaccurate(interface)
    return fit


def _refitted(
    settings: list[FitSetting], rows: Sequence[Array], count: int, seed: int, progress: Progress
) -> tuple[dict[str, Goodness], list[Refits], list[Refits]]:
    """Return the families, and repetitions of the best and of others (steps 2 and 3).

    The repetitions of other families are in proportion to their
    weights, but at least 20. Fits are replaced here, and the family
    'b' cannot be repeated.

    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> from stiction.base.errors import collect_warnings
    >>> weights = {"b": 0.6, "a": 0.5, "c": 0.3, "d": 0.01, "e": 0.0}
    >>> def ranked(settings, rows):
    ...     names = [setting.marginal.label for setting in settings]
    ...     return names, {name: SimpleNamespace(weight=weights[name]) for name in names}
    >>> def repeated(best, count, seed, progress, further):
    ...     if best == "b":
    ...         raise NotRepeated(names["b"], 3, count)
    ...     return [best, count, seed, progress], further
    >>> names = {name: SimpleNamespace(label=name) for name in weights}
    >>> settings = [SimpleNamespace(marginal=law) for law in names.values()]
    >>> changed = {"ranking": ranked, "bootstrapped": repeated}
    >>> with patch.multiple("stiction.inference.fit", **changed), collect_warnings() as caught:
    ...     families, best, further = _refitted(settings, ["row"], 100, 7, False)
    ...     _refitted(settings[:1], ["row"], 100, 7, False)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.inference.bootstrap.NotRepeated: marginal: 'b' could be fitted to only 3 of 100 ...
    >>> [*families], best, further
    (['a', 'c', 'd', 'e'], ['a', 100, 7, False], [('c', 60), ('d', 20)])
    >>> print(*caught)  # doctest: +ELLIPSIS
    marginal: 'b' could be fitted to only 3 of 100 ..., so this family is left out
    """
    estimates, families = ranking(settings, rows)
    # A family that is rarely drawn needs few repetitions.
    weights = [one.weight for one in families.values() if one.weight > 0.0]
    most = max(weights)
    counts = [max(MIN_REPETITIONS, round(count * w / most)) for w in weights[1:]]
    further = list(zip(estimates[1:], counts, strict=False))
    try:
        return families, *bootstrapped(estimates[0], count, seed, progress, further)
    except NotRepeated as error:
        settings = [setting for setting in settings if setting.marginal != error.family]
        if not settings:
            raise
        warn_accuracy(f"{error.reason}, so this family is left out")
        return _refitted(settings, rows, count, seed, progress)


def _judged(
    repeated: Sequence[Refits],
    rows: Sequence[Array],
    levels: Array,
    count: int,
    families: tuple[str, ...],
) -> dict[str, Any]:
    """Return parameters, intervals, p-values and doubts.

    Each field has `count` repetitions.

    Records of one field: `count` repetitions are wanted for each of
    the fields. (The intervals are replaced here.)

    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> import stiction as st
    >>> def fit(distance, roughness, **more):
    ...     return SimpleNamespace(distance=distance, roughness=roughness, **more)
    >>> field = RandomField(st.Lognormal(mean=2.0, cv=0.2), st.ExponentialSpectrum(1e-3))
    >>> setting = SimpleNamespace(between=False)
    >>> truth = fit(
    ...     1.0, math.e**2, parameters={"mean": 2.0, "marginal.mean": 2.0, "marginal.cv": 0.2},
    ...     as_of_one=lambda rows: rows, chance_of_scatter=lambda levels: levels[1] / 8.0,
    ...     setting=setting, within=np.array([0.01, 0.02]), field=lambda quantity: field)
    >>> fits = [fit(math.exp(k), math.exp(k)) for k in (0, 2, 4)]
    >>> repeated = [Refits(truth, fits), Refits(truth, fits[:1])]
    >>> def judged(levels, count=3):
    ...     ends, rows = {"marginal.cv": (1, 2)}, [levels[:1], levels[1:]]
    ...     given = {"_doubts": lambda *_: ["doubt"], "intervals": lambda *_: ends}
    ...     with patch.multiple("stiction.inference.fit", **given):
    ...         return _judged(repeated, rows, levels, count, ("lognormal",))
    >>> found = judged(np.array([1.0, 3.0]))
    >>> found["doubts"], found["interval"]
    (('doubt', 'intervals omit the 2 repetitions whose fit failed'), {'marginal.cv': (1, 2)})
    >>> found["parameters"] == truth.parameters
    True
    >>> {name: round(float(p), 6) for name, p in found["p_values"].items()}
    {'marginal': 0.761116, 'spectrum': 0.5, 'level': 0.375}
    >>> "level" in judged(np.array([3.0]))["p_values"], judged(np.ones(2), 2)["doubts"]
    (False, ('doubt',))

    Records of specimens: the mean and the scatter follow from the
    posterior of the levels.

    >>> setting.between = True
    >>> found = judged(np.array([1.8, 2.3]), 2)
    >>> "level" in found["p_values"], sorted(found["interval"])
    (False, ['between', 'marginal.cv', 'marginal.mean', 'mean'])
    >>> found["interval"]["mean"] == found["interval"]["marginal.mean"]
    True
    >>> low, high = found["interval"]["mean"]
    >>> low < 1.8 < 2.3 < high, found["interval"]["marginal.cv"]
    (True, (1, 2))
    >>> low, high = found["interval"]["between"]
    >>> 0.0 < low < found["parameters"]["between"] < high < 1.0, len(found["doubts"])
    (True, 2)
    >>> interfaces, within = (RandomInterface(strength=field),), truth.within[None]
    >>> profiles = Profiles(interfaces, 2.0, np.array([1.8, 2.3]), within, ("lognormal",))
    >>> grid = grid_of_profiles(profiles)[0]
    >>> drawn = grid.described(grid.draws(20_000, np.random.default_rng(1)))
    >>> for name in ("mean", "between"):
    ...     shares = [np.mean(drawn[name] < end) for end in found["interval"][name]]
    ...     print(np.abs(np.array(shares) - TAILS).max() < 0.04)
    True
    True
    >>> below = np.mean(drawn["between"] < found["parameters"]["between"])
    >>> bool(0.44 < below < 0.56)
    True
    """
    fitted, fits = repeated[0]
    parameters = dict(fitted.parameters)
    ends = intervals(repeated, np.concatenate(fitted.as_of_one(rows)))
    tests = {"marginal": "distance", "spectrum": "roughness"}
    p_values = {name: _p_value(of, fitted, fits) for name, of in tests.items()}
    if levels.size > 1 and not fitted.setting.between:
        p_values["level"] = fitted.chance_of_scatter(levels)
    doubts = _doubts(fitted, p_values)
    if failed := len(repeated) * count - sum(len(one.fits) for one in repeated):
        doubts.append(f"intervals omit the {failed} repetitions whose fit failed")
    if fitted.setting.between:
        # The bootstrap scales records as if all came from one specimen,
        # so its means and scatter lack the scatter between specimens.
        # The levels hold it.
        interfaces = (RandomInterface(strength=fitted.field("strength")),)
        mean, within = parameters["mean"], fitted.within[None]
        grid, _ = grid_of_profiles(Profiles(interfaces, mean, levels, within, families))
        draws = grid.described(grid.draws(INTERVAL_DRAWS, np.random.default_rng(0)))
        for name in {"mean", "marginal.mean"} & parameters.keys():
            ends[name] = tuple(np.quantile(draws[MEAN_KEY], TAILS).tolist())
        parameters["between"] = float(np.median(draws[SCATTER_KEY]))
        low, high = ends["between"] = tuple(np.quantile(draws[SCATTER_KEY], TAILS).tolist())
        if len(rows) < FEW_SPECIMENS:
            doubts.append(
                f"the scatter between specimens, {low:.2g} to {high:.2g}, follows mostly from the"
                f" prior. Measure {FEW_SPECIMENS} specimens, not {len(rows)}, or state the scatter:"
                " RandomInterface(fit.field, between={'strength': Lognormal(mean=1.0, cv=0.1)})"
            )
    return {
        "parameters": parameters, "interval": ends, "p_values": p_values, "doubts": tuple(doubts)
    }  # fmt: skip


def _p_value(name: str, truth: BestFit, fits: Sequence[BestFit]) -> float:
    """Return the p-value of a distance of the data, given the distances of repetitions (step 5).

    The logarithms 0, 2 and 4 of the repetitions have the standard
    deviation 2. Student's distribution with 2 degrees of freedom
    has 1/2 - t/(2 (2 + t^2)^(1/2)) above t.

    >>> from types import SimpleNamespace
    >>> fits = [SimpleNamespace(distance=math.exp(k)) for k in (0, 2, 4)]
    >>> for t in (0.0, 1.0, -1.0):
    ...     truth = SimpleNamespace(distance=math.exp(2.0 + t * 2.0 * math.sqrt(4.0 / 3.0)))
    ...     p = _p_value("distance", truth, fits)
    ...     print(f"{p - 0.5 + 0.5 * t / math.sqrt(2.0 + t**2):.6f}".replace("-", ""))
    0.000000
    0.000000
    0.000000
    """
    repeats = np.log([getattr(fit, name) for fit in fits])
    # The data and the mean of the repetitions both scatter.
    error = repeats.std(ddof=1) * math.sqrt(1.0 + 1.0 / repeats.size)
    away = (math.log(getattr(truth, name)) - repeats.mean()) / error
    return float(student.sf(away, repeats.size - 1))


def _doubts(fitted: BestFit, p_values: Mapping[str, float]) -> list[str]:
    """Return the reasons not to trust a fit.

    >>> from types import SimpleNamespace
    >>> def doubts(held=10.0, noise_share=0.0, ends=(), **p_values):
    ...     model = SimpleNamespace(
    ...         noise=math.sqrt(2.0 * noise_share), noise_share=noise_share, variance=2.0,
    ...         signal=lambda window: np.array([9.0, 8.0, 4.0, 1.9]))
    ...     spectrum = SimpleNamespace(at_end=lambda model: dict(ends))
    ...     setting = SimpleNamespace(windows=(Window(), Last()), spectrum=spectrum)
    ...     fitted = SimpleNamespace(lengths_held=held, model=model, setting=setting)
    ...     return [text.split(",")[0].split(". ")[0] for text in _doubts(fitted, p_values)]
    >>> class Window:
    ...     weights = np.array([0.0, 0.5, 1.0, 1.0])
    >>> class Last:
    ...     weights = np.array([0.0, 0.0, 0.0, 1.0])
    >>> doubts(marginal=0.02, spectrum=0.5)
    []
    >>> doubts(9.9), doubts(marginal=0.01, spectrum=0.5)
    (['the records hold 9.9 correlation lengths'], ['the p-value of the marginal is 0.01'])
    >>> doubts(ends=[("exponent", 16.0)])
    ['exponent 16 lies at an end of the searched range']

    The power at the cut-off is 2*4 times the fraction of the field,
    and the noise has the variance 2 times its fraction.

    >>> doubts(noise_share=0.75), doubts(noise_share=0.82)
    ([], ['the noise (1.28) hides the cut-off of the spectrum'])
    """
    doubts = []
    held, noise = fitted.lengths_held, fitted.model.noise
    if held < ENOUGH_LENGTHS:
        doubts.append(
            f"the records hold {held:.2g} correlation lengths, too few for reliable intervals."
            f" Measure longer or more profiles, of {ENOUGH_LENGTHS:g} correlation lengths or more"
        )
    left = max(_power_at_cutoff(fitted, window) for window in set(fitted.setting.windows))
    if left <= noise**2:
        doubts.append(
            f"the noise ({noise:.3g}) hides the cut-off of the spectrum, beyond which the field"
            f" scatters by {math.sqrt(left):.3g}. The correlation length then depends on the family"
        )
    doubts += [
        f"{name} {value:.3g} lies at an end of the searched range. State spectrum= or anisotropy="
        for name, value in fitted.setting.spectrum.at_end(fitted.model).items()
    ]
    doubts += [
        f"the p-value of the {name} is {p:.2g}. {ADVICE[name]}, or look at st.plot.fit"
        for name, p in p_values.items()
        if p <= MIN_P_VALUE
    ]
    return doubts


def _power_at_cutoff(fitted: BestFit, window: RecordWindow) -> float:
    """Return the power of the field, relative to white noise, where it has fallen to a quarter.

    The power is 2*0.75 times the signal, without the mean. It is at
    least a quarter of 12 at two wavenumbers, or at three.

    >>> from types import SimpleNamespace
    >>> window = SimpleNamespace(weights=np.array([0.0, 0.5, 1.0, 1.0]))
    >>> def power(last, noise_share=0.25):
    ...     model = SimpleNamespace(
    ...         variance=2.0, noise_share=noise_share,
    ...         signal=lambda window: np.array([9.0, 8.0, 4.0, last]))
    ...     return _power_at_cutoff(SimpleNamespace(model=model), window)
    >>> power(1.9), power(2.0), power(2.0, 0.0), power(2.0, -0.1)
    (6.0, 3.0, inf, inf)
    """
    model = fitted.model
    if model.noise_share <= 0.0:
        return math.inf
    power = model.variance * (1.0 - model.noise_share) * model.signal(window)
    power = power[window.weights > 0.0]
    # The correlation length follows from the wavenumbers at which the
    # power falls.
    return float(power[power >= 0.25 * power.max()].min())

"""Intervals for a fit, and fields as likely as the fit, from fits to simulated records.

Problem. A fit estimates parameters theta from records. Find intervals
that contain the true theta with a given probability. Also find fields
that are as likely as the estimate.

Sources. Studentised intervals: Davison and Hinkley, Bootstrap Methods
and their Application (1997), section 5.2. Ends by test inversion:
Carpenter (1999), Journal of the Royal Statistical Society B 61, 159.

Steps:

1. Simulate records from the estimate, and fit them. Each fit starts
   from the estimate.
2. Transform each parameter to a scale on which its error is about
   normal (`Scale`).
3. The error of a repetition is (its estimate - estimate)/width. The
   width is proportional to the square root of the correlation length,
   because a record contains only few correlation lengths.
4. Subtract the quantiles of the error, times the width, from the
   estimate: a first interval.
5. Repeat steps 1 and 3 for fields whose correlation length lies at
   either end of its first interval. Take the upper end of each interval
   from the field with the longer length, and the lower end from the
   other field. Exchange them for parameters whose estimates fall with
   the correlation length.
6. Limit the intervals: bounds of the marginal lie outside the values,
   and other parameters lie within their ranges. If estimates of
   repetitions reach a limit of a shape, their errors beyond the limit
   are unknown, and steps 4 and 5 give too short an interval. Also
   include the quantiles of the repetitions themselves (Efron's
   percentiles; Davison and Hinkley, section 5.3).
7. Compute each likely field: the estimate minus the error of one
   repetition times the width.

Departures. Only one step of the inversion is made, and the correlation
length is varied for all parameters.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.progress import Meter, Show
from stiction.inference.estimate import BestFit, estimate
from stiction.inference.marginal_fit import LEAST_SHAPE, WIDEST, Family, beta_of
from stiction.inference.whittle import OF_SPECTRUM, RANGES, offset
from stiction.random.dotted_keys import full_key, with_values
from stiction.random.fields import RandomField
from stiction.random.marginals import Beta

FIT_CONFIDENCE = 0.9
"""Level of the intervals, as everywhere in the package."""
TAILS = 0.5 * (1.0 - FIT_CONFIDENCE), 0.5 * (1.0 + FIT_CONFIDENCE)
"""Probabilities below the ends of an interval."""
MIN_REPETITIONS = 20
"""Fewest repetitions that determine a tail of errors."""
LOCATION_PARAMETERS = ("mean", "marginal.mean", "marginal.loc")
SIDES = {"marginal.low": -1.0, "marginal.high": 1.0}
"""Side of the mean on which a bound lies."""
MIN_WIDTH = 1e-3
"""Least width of an interval over its upper end.

The whole range replaces a narrower interval.
"""

HELD_RTOL = 1e-6
"""Relative distance of a shape from its limit below which the limit
counts as reached."""


class Refits(NamedTuple):
    """A field, and fits to records simulated from it."""

    truth: BestFit
    fits: list[BestFit]


class NotRepeated(InputError):
    """Error for a family that cannot be fitted to most records simulated from the family itself."""

    def __init__(self, family: Family, fits: int, count: int) -> None:
        """State the reason, and how many of the records were fitted.

        >>> error = NotRepeated(Family("beta", {"high": 3.0}), 4, 25)
        >>> error.reason, error.family.name  # doctest: +ELLIPSIS
        ("marginal: 'beta, high 3' could be fitted to only 4 of 25 records ...", 'beta')
        >>> str(error).removeprefix(error.reason)
        '. Use another marginal'
        """
        self.reason = (
            f"marginal: {family.label!r} could be fitted to only {fits} of {count} records"
            " that were simulated from its fit"
        )
        super().__init__(f"{self.reason}. Use another marginal")
        self.family = family


def bootstrapped(
    fitted: BestFit,
    count: int,
    seed: int,
    progress: Show,
    further: Sequence[tuple[BestFit, int]] = (),
) -> tuple[list[Refits], list[Refits]]:
    """Fit records simulated from an estimate, and from fields `at_ends` (steps 1 and 5).

    The second list holds fits from `further` estimates, with other
    numbers of repetitions. Records to which the family cannot be fitted
    are left out.

    Examples
    --------
    Simulated records are one random number here, and the fit to a
    number below 0.1 fails.

    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> def field(name, *free):
    ...     setting = SimpleNamespace(
    ...         spectrum=SimpleNamespace(free=free), marginal=SimpleNamespace(label=name))
    ...     draw = np.random.Generator.random
    ...     return SimpleNamespace(name=name, setting=setting, simulate=draw)
    >>> def fit(row, setting, start):
    ...     if row < 0.1:
    ...         raise InputError("too small")
    ...     return start.name, row
    >>> def ends(around):
    ...     return [field(f"{end} than {around.truth.name}") for end in ("shorter", "longer")]
    >>> with patch.multiple("stiction.inference.bootstrap", estimate=fit, at_ends=ends):
    ...     moved, further = bootstrapped(
    ...         field("a", "correlation_length"), 25, 3, False, [(field("b"), 24)])
    ...     alone, _ = bootstrapped(field("c"), 25, 3, False)
    ...     bootstrapped(field("d"), 21, 3, False)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.inference.bootstrap.NotRepeated: marginal: 'd' could be fitted to only 19 of 21 ...
    >>> [(one.truth.name, len(one.fits)) for one in moved]
    [('a', 23), ('shorter than a', 23), ('longer than a', 23)]
    >>> [(one.truth.name, len(one.fits)) for one in (*further, *alone)]
    [('b', 22), ('c', 23)]
    >>> rows = [np.random.default_rng([3, number]).random() for number in range(25)]
    >>> rows[0] < 0.1, rows[2] < 0.1, sum(row >= 0.1 for row in rows)
    (True, True, 23)
    >>> all(one.fits == [(one.truth.name, row) for row in rows if row >= 0.1] for one in moved)
    True
    """

    def repeat(truth: BestFit, count: int = count) -> Refits:
        fits = []
        for number in range(count):
            # The same random numbers for each field, so that
            # differences between fields are not due to chance.
            rng = np.random.default_rng([seed, number])
            with suppress(InputError):
                fits.append(estimate(truth.simulate(rng), truth.setting, truth))
                meter.advance()
        if len(fits) < MIN_REPETITIONS:
            raise NotRepeated(truth.setting.marginal, len(fits), count)
        return Refits(truth, fits)

    # A fixed correlation length has no ends from which to repeat.
    ends = "correlation_length" in fitted.setting.spectrum.free
    total = (3 if ends else 1) * count + sum(number for _, number in further)
    with Meter("fit_field", total, progress) as meter:
        repeated = [repeat(fitted)]
        if ends:
            repeated += [repeat(truth) for truth in at_ends(repeated[0])]
        return repeated, [repeat(*other) for other in further]


def at_ends(around: Refits) -> list[BestFit]:
    """Return the field with its correlation length at both ends of a first interval (step 5).

    Examples
    --------
    A correlation length of 1.5 m is fitted. One repetition has 4
    times and one has a quarter of it. The widths are proportional
    to the root of the length, so the first interval ends at
    1.5/4^(1/2) and 1.5*4^2. The second end lies beyond the searched
    range.

    >>> from types import SimpleNamespace
    >>> from stiction.inference.estimate import FitSetting
    >>> from stiction.inference.marginal_fit import family_of
    >>> from stiction.inference.whittle import SpectrumFamily
    >>> from stiction.random.marginals import Lognormal
    >>> family = SpectrumFamily("exponential", {}, 1.0, 0.0, (0.1, 6.0))
    >>> setting = FitSetting((), family_of("lognormal"), family)
    >>> law = Lognormal(mean=5.0, cv=0.2)
    >>> def fit(length):
    ...     model = family.model(family.vector([2.0, length]), np.array([0.0, 1.0]))
    ...     return BestFit(setting, law, law, model, 0.1, 0.1, (0.0, 0.0))
    >>> fits = [fit(1.5 * factor) for factor in (4.0, 0.25, *[1.0] * 17)]
    >>> models = [field.model for field in at_ends(Refits(fit(1.5), fits))]
    >>> [round(model.spectrum.correlation_length, 6) for model in models], models[1].variance
    ([0.75, 6.0], 2.0)
    """
    fitted, family = around.truth, around.truth.setting.spectrum
    place = family.free.index("correlation_length")
    moved = []
    likely_lengths = Scale("correlation_length").less(fitted, around)
    for end in np.quantile(likely_lengths, TAILS, method="weibull"):
        vector = family.vector_of(fitted.model)
        vector[place] = np.clip(end, *family.limits[place])
        moved.append(replace(fitted, model=family.model(vector, fitted.model.shares)))
    return moved


class Scale(NamedTuple):
    """Scale on which the error of a parameter is about normal: logarithmic unless `linear`.

    For a bound of a marginal, the scale is the logarithm of the
    distance from the mean. For noise, it is the variance. The variance
    may be negative, because estimates cut off at zero would seem to
    have no error.

    Examples
    --------
    >>> values = {"mean": 5.0, "marginal.low": 2.0, "marginal.high": 9.0, "exponent": 2.5}
    >>> scales = list(map(Scale, values))
    >>> [f"{math.exp(scale.to(values)):.4f}" for scale in scales]  # low and high from the mean
    ['5.0000', '3.0000', '4.0000', '2.0000']
    >>> [f"{scale.back(math.log(0.7), values):.4f}" for scale in scales]
    ['0.7000', '4.3000', '5.7000', '1.2000']
    >>> Scale("mean", linear=True).to(values), Scale("mean", linear=True).back(-3.0, values)
    (5.0, -3.0)
    >>> noise = Scale("noise")
    >>> noise.to({"noise": 3.0}), noise.back(16.0, {}), noise.back(-16.0, {})
    (9.0, 4.0, 0.0)
    >>> math.exp(Scale("marginal.low").to({"mean": 2.0, "marginal.low": 3.0})) > 0.0
    True
    """

    name: str
    linear: bool = False

    def to(self, values: Mapping[str, float]) -> float:
        """Return a parameter on this scale."""
        value, (origin, side) = values[self.name], self._origin(values)
        if self.name == "noise":
            return value**2
        return value if self.linear else math.log(max(side * (value - origin), 1e-300))

    def back(self, at: float, values: Mapping[str, float]) -> float:
        """Return a parameter from this scale."""
        origin, side = self._origin(values)
        if self.name == "noise":
            return math.sqrt(max(at, 0.0))
        return at if self.linear else origin + side * math.exp(at)

    def _origin(self, values: Mapping[str, float]) -> tuple[float, float]:
        """Return the origin of the logarithm, and the side of it on which values lie.

        >>> values = {"mean": 5.0}
        >>> names = "marginal.low", "marginal.high", "exponent", "mean"
        >>> [Scale(name)._origin(values) for name in names]
        [(5.0, -1.0), (5.0, 1.0), (0.5, 1.0), (0.0, 1.0)]
        """
        if self.name in SIDES:
            return values["mean"], SIDES[self.name]
        return offset(self.name), 1.0

    def of(self, fitted: BestFit) -> tuple[float, float]:
        """Return an estimate on this scale, and the width of step 3.

        The width grows with the root of the length, for a location
        also with the scatter.

        >>> from types import SimpleNamespace
        >>> numbers = {"efolding_length": 9.0, "standard_deviation": 2.0}
        >>> numbers |= {"mean": 5.0, "exponent": 1.5, "skew": -1.0}
        >>> fit = SimpleNamespace(parameters=numbers, noise=(0.3, 0.1))
        >>> Scale("mean", True).of(fit), Scale("skew", True).of(fit)
        ((5.0, 6.0), (-1.0, 3.0))
        >>> Scale("exponent").of(fit), Scale("noise").of(fit)
        ((0.0, 3.0), (0.3, 0.1))
        """
        if self.name == "noise":
            return fitted.noise
        width = math.sqrt(fitted.parameters["efolding_length"])
        if self.name in LOCATION_PARAMETERS:
            width *= fitted.parameters["standard_deviation"]
        return self.to(fitted.parameters), width

    def less(self, fitted: BestFit, repeated: Refits) -> Array:
        """Return the estimate minus the error of each repetition (steps 3 and 7).

        The estimate is 10, with width 2*2. Refits to records with
        mean 8 give 9 with width 3*1, and 6 with width 1*3.

        >>> from types import SimpleNamespace
        >>> def fit(mean, length, deviation):
        ...     widths = {"efolding_length": length, "standard_deviation": deviation}
        ...     return SimpleNamespace(parameters={"mean": mean} | widths)
        >>> refits = Refits(fit(8.0, 1.0, 5.0), [fit(9.0, 9.0, 1.0), fit(6.0, 1.0, 3.0)])
        >>> likely = Scale("mean", linear=True).less(fit(10.0, 4.0, 2.0), refits)
        >>> bool(np.allclose(likely, [10 - 4 * 1 / 3, 10 + 4 * 2 / 3]))
        True
        """
        at, width = self.of(fitted)
        true = self.to(repeated.truth.parameters)
        refitted = np.array([self.of(fit) for fit in repeated.fits])
        return at - width * (refitted[:, 0] - true) / refitted[:, 1]


def scale_of(name: str, repeated: Sequence[Refits]) -> Scale:
    """Return the scale of a parameter, which is linear if an estimate is negative.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> def linear(name, *values):
    ...     truth, *fits = [SimpleNamespace(parameters={name: value}) for value in values]
    ...     return scale_of(name, [Refits(truth, fits[:1]), Refits(truth, fits[1:])]).linear
    >>> linear("mean", 1, 2, 3), linear("marginal.cv", 1, 2, 0), linear("skew", 1, 2, -3)
    (True, False, True)
    >>> linear("skew", -1, 2, 3), linear("marginal.low", 1, -2, 3)
    (True, False)
    """
    least = min(one.parameters[name] for own in repeated for one in (own.truth, *own.fits))
    return Scale(name, name in LOCATION_PARAMETERS or (name not in SIDES and least < 0.0))


def intervals(repeated: Sequence[Refits], values: Array) -> dict[str, tuple[float, float]]:
    """Return the interval of each parameter (steps 2 to 6).

    `values` are measured, with noise.

    Examples
    --------
    The weibull quantiles of 19 repetitions are the least and the
    largest one. Fields with the shorter length have errors of log 3
    (once) or log 2, and fields with the longer length have -log 5
    (once) or -log 4. The shape rises with the length here, and the
    ratio falls.

    >>> from types import SimpleNamespace
    >>> family = SimpleNamespace(limited_shapes=("shape",), quiet=lambda values, noise: values)
    >>> law = SimpleNamespace(distribution=SimpleNamespace(support=lambda: (2.0, 9.0)))
    >>> def fit(shape=10.0, ratio=5.0, length=1.0, **more):
    ...     numbers = {"efolding_length": length, "shape": shape, "anisotropy": ratio}
    ...     return SimpleNamespace(
    ...         parameters=numbers | more, noise=(0.04, 0.01), model=SimpleNamespace(noise=0.0),
    ...         setting=SimpleNamespace(marginal=family), marginal=law)
    >>> around = Refits(fit(), [fit(10.0 * k, 5.0 / k, k) for k in np.linspace(0.9, 1.1, 19)])
    >>> shorter = Refits(fit(), [fit(30.0, 15.0)] + [fit(20.0, 10.0)] * 18)
    >>> longer = Refits(fit(), [fit(2.0, 1.0)] + [fit(2.5, 1.25)] * 18)
    >>> ends = intervals([around, shorter, longer], np.array([2.5, 8.0]))
    >>> np.round(ends["shape"], 6).tolist()  # 10/3 and 10*5
    [3.333333, 50.0]
    >>> np.round(ends["anisotropy"], 6).tolist()  # 5/2, and 5*4
    [2.5, 20.0]

    If a repetition reaches the limit of a shape, its interval
    contains the repetitions.

    >>> around.fits[0].parameters["shape"] = 1.0
    >>> shorter.fits[:2] = [fit(3.0), fit(4.0)]
    >>> longer.fits[1:3] = [fit(60.0), fit(70.0)]
    >>> ends = intervals([around, shorter, longer], np.array([2.5, 8.0]))
    >>> np.round(ends["shape"], 6).tolist()  # from 3 + 0.9 to 60 + 0.1*10, for 10/2 to 10*5
    [3.9, 61.0]
    >>> ends["anisotropy"]  # 25/5 at both ends, so the range is shown
    (0.05, 20.0)

    Without any error, the interval of a limited parameter is the
    whole range.

    >>> intervals([Refits(fit(), [fit()] * 19)], np.array([2.5, 8.0]))["anisotropy"]
    (0.05, 20.0)

    The variance of the noise is 0.04 - 0.05 to 0.04 + 0.03 here.
    Bounds of the marginal lie outside the values, and at most 10
    ranges of the values away.

    >>> def bounded(distance, variance):
    ...     numbers = {"marginal.low": 4.0 - distance, "marginal.high": 4.0 + distance}
    ...     numbers |= {"mean": 4.0, "standard_deviation": 1.0, "noise": math.sqrt(variance)}
    ...     made = fit(**numbers)
    ...     made.noise = variance, 0.01
    ...     return made
    >>> refits = [bounded(40.0, 0.09), bounded(0.1, 0.01), *[bounded(2.0, 0.04)] * 17]
    >>> ends = intervals([Refits(bounded(2.0, 0.04), refits)], np.array([2.5, 6.0]))
    >>> names = "noise", "marginal.low", "marginal.high"
    >>> [np.round(ends[name], 4).tolist() for name in names]
    [[0.0, 0.2646], [0.0, 2.5], [6.0, 41.0]]
    >>> still = Refits(bounded(2.0, 0.04), [bounded(2.0, 0.04)] * 19)
    >>> ends = intervals([Refits(still.truth, refits), still, still], np.array([2.5, 6.0]))
    >>> np.round(ends["noise"], 4).tolist()
    [0.0, 0.2646]
    >>> ends = intervals([Refits(bounded(2.0, 0.04), refits)], np.array([-2.5, 6.0]))
    >>> [np.round(ends[name], 4).tolist() for name in names[1:]]
    [[-36.0, 2.0], [6.0, 44.0]]
    """
    around, *moved = repeated
    fitted, estimated = around.truth, around.truth.parameters
    shapes = fitted.setting.marginal.limited_shapes
    lengths = [math.log(one.parameters["efolding_length"]) for one in around.fits]
    result = {}
    for name in estimated:
        # 2.
        scale = scale_of(name, repeated)
        # 5. The noise hardly depends on the correlation length.
        shorter, longer = moved if moved and name != "noise" else (around, around)
        if np.cov([scale.of(one)[0] for one in around.fits], lengths)[0, 1] < 0.0:
            shorter, longer = longer, shorter
        # 3. and 4.
        low, high = (
            float(np.quantile(scale.less(fitted, repetitions), share, method="weibull"))
            for repetitions, share in zip((shorter, longer), TAILS, strict=True)
        )
        # A noise that is negative by chance is as wide as an estimate of 0.
        if name == "noise" and high <= 0.0:
            high -= fitted.noise[0]
        first, last = sorted(scale.back(end, estimated) for end in (low, high))
        # 6.
        if name in shapes and any(held(one, shapes) for one in (fitted, *around.fits)):
            least, most = (
                float(np.quantile([one.parameters[name] for one in repetitions.fits], share))
                for repetitions, share in zip((shorter, longer), TAILS, strict=True)
            )
            first, last = min(first, least), max(last, most)
        result[name] = first, last
    noise = result["noise"][1] if "noise" in result else fitted.model.noise
    limits = limits_of(fitted, values, noise)
    # The removed trend is added to a field, which may take a shape below its limit.
    limits |= {name: (min(LEAST_SHAPE, estimated[name]), math.inf) for name in shapes}
    # Free bounds are searched up to this distance from the values.
    farthest = WIDEST * np.ptp(values)
    (lowest, below), (above, _) = limits["marginal.low"], limits["marginal.high"]
    limits["marginal.low"] = max(lowest, values.min() - farthest), below
    limits["marginal.high"] = above, values.max() + farthest
    for name in limits.keys() & result.keys():
        ends = limits[name]
        low, high = np.clip(result[name], *ends).tolist()
        # If clipping leaves almost no interval, the data say nothing
        # about the parameter.
        least = MIN_WIDTH * high if np.isfinite(ends).all() else 0.0
        if high - low <= least:
            low, high = (end if math.isfinite(end) else estimated[name] for end in ends)
        result[name] = low, high
    return result


def held(fit: BestFit, shapes: Sequence[str]) -> bool:
    """Return whether a shape of a fit lies at its limit.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> fit = SimpleNamespace(parameters={"a": 1.00001, "b": 1.0000001})  # the limit is 1
    >>> held(fit, ["a"]), held(fit, ["a", "b"]), held(fit, [])
    (False, True, False)
    """
    return any(fit.parameters[name] <= LEAST_SHAPE * (1.0 + HELD_RTOL) for name in shapes)


def limits_of(fitted: BestFit, values: Array, noise: float) -> dict[str, tuple[float, float]]:
    """Return limits for parameters.

    Bounds of the marginal must lie outside all values.

    Examples
    --------
    The values are 2, 4 and 9. Noise with a quarter of their
    variance, 26/3, leaves values from 5 - 3*0.866 to 5 + 4*0.866.

    >>> from types import SimpleNamespace
    >>> setting = SimpleNamespace(marginal=Family("beta", {}))
    >>> def bounds(low, high, values=(2.0, 4.0, 9.0), noise=0.0):
    ...     law = Beta(alpha=2.0, beta=3.0, low=low, high=high)
    ...     fit = SimpleNamespace(setting=setting, marginal=law)
    ...     limits = limits_of(fit, np.array(values), noise)
    ...     return [np.round(limits[name], 4).tolist() for name in SIDES]
    >>> bounds(3.0, 8.0), bounds(1.0, 12.0)
    ([[0.0, 3.0], [8.0, inf]], [[0.0, 2.0], [9.0, inf]])
    >>> bounds(1.0, 12.0, noise=math.sqrt(26 / 12))
    [[0.0, 2.4019], [8.4641, inf]]
    >>> bounds(-5.0, 12.0)[0], bounds(-5.0, 12.0, (-2.0, 4.0, 9.0))[0]
    ([0.0, 2.0], [-inf, -2.0])
    """
    quiet = fitted.setting.marginal.quiet(values, noise)
    bottom, top = (float(end) for end in fitted.marginal.distribution.support())
    # Noise may move values beyond the bounds, which lie outside the
    # shrunken values.
    least, most = max(float(quiet.min()), bottom), min(float(quiet.max()), top)
    # Positive values have no negative bound.
    below = 0.0 if values.min() > 0.0 and least > 0.0 else -math.inf, least
    return {
        "exponent": RANGES["exponent"],
        "anisotropy": RANGES["anisotropy"],
        "marginal.low": below,
        "marginal.high": (most, math.inf),
    }


def in_field(values: Mapping[str, float]) -> dict[str, float]:
    """Return parameters by their keys inside a field.

    Examples
    --------
    >>> in_field({"marginal.low": 3.0, "correlation_length": 4.0})
    {'marginal.low': 3.0, 'spectrum.correlation_length': 4.0}
    """
    begin = "random.strength."
    return {full_key(name).removeprefix(begin): value for name, value in values.items()}


def likely(repeated: Refits, measured: Array, quantity: str) -> list[RandomField]:
    """Return fields as likely as the estimate, one for each repetition (step 7).

    Examples
    --------
    The widths are equal, so an error of 1 in the mean, or a factor
    in another parameter, is subtracted from, or divides, the
    estimate.

    >>> from types import SimpleNamespace
    >>> from stiction.random.marginals import Lognormal
    >>> from stiction.random.spectra import ExponentialSpectrum
    >>> def fit(law, length, **parameters):
    ...     numbers = {"efolding_length": 1.0, "standard_deviation": 1.0, "mean": 5.0}
    ...     parameters |= {"correlation_length": length, "noise": 0.1}
    ...     field = RandomField(law, ExponentialSpectrum(length))
    ...     return SimpleNamespace(
    ...         parameters=numbers | parameters, marginal=law, model=SimpleNamespace(noise=0.0),
    ...         setting=SimpleNamespace(marginal=Family("lognormal", {"low": 0.0})),
    ...         field=lambda quantity: field)
    >>> law = Lognormal(mean=8.0, cv=0.2)
    >>> truth = fit(law, 2.0, **{"marginal.mean": 8.0, "marginal.cv": 0.2})
    >>> refit = fit(law, 4.0, **{"marginal.mean": 9.0, "marginal.cv": 0.25})
    >>> (field,) = likely(Refits(truth, [refit]), np.array([2.0, 4.0, 9.0]), "strength")
    >>> np.round([field.mean, field.marginal.cv, field.spectrum.correlation_length], 6).tolist()
    [7.0, 0.16, 1.0]

    The lower bound has the distance 4 from the mean, and 5 in the
    repetition. The likely bound, 5 - 4*4/5, would give the mean
    5.48 and the standard deviation 1.84. Both stay, although the
    bound must lie below the least value, 1.5.

    >>> law = Beta(alpha=2.0, beta=3.0, low=1.0, high=11.0)
    >>> keys = "alpha", "beta", "low", "high"
    >>> truth, refit = (
    ...     fit(law, 2.0, **{"marginal." + key: v for key, v in zip(keys, values, strict=True)})
    ...     for values in ((2.0, 3.0, 1.0, 11.0), (2.0, 3.0, 0.0, 11.0)))
    >>> (field,) = likely(Refits(truth, [refit]), np.array([1.5, 6.0, 12.0]), "strength")
    >>> np.round([field.mean, field.standard_deviation], 6).tolist()
    [5.48, 1.84]
    >>> field.marginal.low, field.marginal.high
    (1.5, 11.0)
    """
    fitted = repeated.truth
    field, limits = fitted.field(quantity), limits_of(fitted, measured, fitted.model.noise)
    free: dict[str, list[float]] = {}
    for name in fitted.parameters:
        if name == "mean" or name.startswith("marginal.") or name in OF_SPECTRUM:
            scale = scale_of(name, [repeated])
            places = scale.less(fitted, repeated).tolist()
            means = free.get("mean", places)  # bounds are given by their distance from the mean
            pairs = zip(places, means, strict=True)
            free[name] = [scale.back(at, {"mean": mean}) for at, mean in pairs]
    del free["mean"]
    members = []
    for row in zip(*free.values(), strict=True):
        values = dict(zip(free, row, strict=True))
        within = {n: float(np.clip(values[n], *limits[n])) for n in values.keys() & limits}
        member = with_values(field, in_field(values | within))
        if isinstance(member.marginal, Beta):  # the limits keep mean and scatter
            bounds = {n: values[n] for n in values.keys() & SIDES.keys()}
            before = with_values(field, in_field(values | within | bounds))
            ends = member.marginal.low, member.marginal.high
            marginal = beta_of(before.mean, before.standard_deviation, *ends)
            member = replace(member, marginal=marginal)
        members.append(member)
    return members

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
    """Return the field with its correlation length at both ends of a first interval (step 5)."""
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
        """Return the origin of the logarithm, and the side of it on which values lie."""
        if self.name in SIDES:
            return values["mean"], SIDES[self.name]
        return offset(self.name), 1.0

    def of(self, fitted: BestFit) -> tuple[float, float]:
        """Return an estimate on this scale, and the width of step 3."""
        if self.name == "noise":
            return fitted.noise
        width = math.sqrt(fitted.parameters["efolding_length"])
        if self.name in LOCATION_PARAMETERS:
            width *= fitted.parameters["standard_deviation"]
        return self.to(fitted.parameters), width

    def less(self, fitted: BestFit, repeated: Refits) -> Array:
        """Return the estimate minus the error of each repetition (steps 3 and 7)."""
        at, width = self.of(fitted)
        true = self.to(repeated.truth.parameters)
        refitted = np.array([self.of(fit) for fit in repeated.fits])
        return at - width * (refitted[:, 0] - true) / refitted[:, 1]


def scale_of(name: str, repeated: Sequence[Refits]) -> Scale:
    """Return the scale of a parameter, which is linear if an estimate is negative."""
    least = min(one.parameters[name] for own in repeated for one in (own.truth, *own.fits))
    return Scale(name, name in LOCATION_PARAMETERS or (name not in SIDES and least < 0.0))


def intervals(repeated: Sequence[Refits], values: Array) -> dict[str, tuple[float, float]]:
    """Return the interval of each parameter (steps 2 to 6).

    `values` are measured, with noise.
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
    """Return whether a shape of a fit lies at its limit."""
    return any(fit.parameters[name] <= LEAST_SHAPE * (1.0 + HELD_RTOL) for name in shapes)


def limits_of(fitted: BestFit, values: Array, noise: float) -> dict[str, tuple[float, float]]:
    """Return limits for parameters.

    Bounds of the marginal must lie outside all values.
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
    """Return parameters by their keys inside a field."""
    begin = "random.strength."
    return {full_key(name).removeprefix(begin): value for name, value in values.items()}


def likely(repeated: Refits, measured: Array, quantity: str) -> list[RandomField]:
    """Return fields as likely as the estimate, one for each repetition (step 7)."""
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

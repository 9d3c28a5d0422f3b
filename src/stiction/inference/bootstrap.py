"""Intervals of a fit, and fits as likely as it, from fits to simulated records."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.progress import Meter, Show
from stiction.ensemble.batches import in_threads, usable_cores
from stiction.inference.estimate import NAMES, Estimate, estimate
from stiction.inference.marginal_fit import Family, beta_of
from stiction.inference.whittle import RANGES, origin
from stiction.random.dotted_keys import with_values
from stiction.random.fields import RandomField
from stiction.random.marginals import Beta

MIN_REPETITIONS = 20
"""Number of repetitions that determine a tail of errors."""
LOCATION_PARAMETERS = ("mean", "marginal.mean", "marginal.loc")
"""Parameters of location."""
SIDES = {"marginal.low": -1.0, "marginal.high": 1.0}
"""Side of the mean on which a bound lies."""
MIN_WIDTH = 1e-3
"""Distance within which an interval is uninformative, as a share of an end of a range."""


class Repetitions(NamedTuple):
    """A field, and fits to records simulated from it."""

    truth: Estimate
    fits: list[Estimate]


class NotRepeated(InputError):
    """A family that cannot be fitted to most records that are simulated from it."""

    def __init__(self, family: Family, fits: int, count: int) -> None:
        super().__init__(
            f"marginal: {family.label!r} could be fitted to only {fits} of {count} records"
            " that were simulated from its fit; take another marginal"
        )
        self.family = family


def bootstrapped(
    fitted: Estimate,
    count: int,
    confidence: float,
    seed: int,
    progress: Show,
    workers: int | None = None,
    further: Sequence[tuple[Estimate, int]] = (),
) -> tuple[list[Repetitions], list[Repetitions]]:
    """Fit records simulated from an estimate, and from it `at_ends` of its correlation length.

    Also from `further`, each with its own number of repetitions. Those to which the family
    cannot be fitted are missing.
    """

    def repeat(truth: Estimate, count: int = count) -> Repetitions:
        def refit(number: int) -> Estimate | None:
            rng = np.random.default_rng([seed, number])
            try:
                again = estimate(truth.simulate(rng), truth.setting, truth)
            except InputError:
                return None
            meter.advance()
            return again

        results = in_threads(refit, range(count), workers or usable_cores())
        fits = [result for result in results if result is not None]
        if len(fits) < MIN_REPETITIONS:
            raise NotRepeated(truth.setting.marginal, len(fits), count)
        return Repetitions(truth, fits)

    ends = "correlation_length" in fitted.setting.spectrum.free
    total = (3 if ends else 1) * count + sum(number for _, number in further)
    with Meter("fit_field", total, progress) as meter:
        repeated = [repeat(fitted)]
        if ends:
            repeated += [repeat(truth) for truth in at_ends(repeated[0], confidence)]
        return repeated, [repeat(*other) for other in further]


def at_ends(around: Repetitions, confidence: float) -> list[Estimate]:
    """Return the field with its correlation length at either end of a first interval."""
    fitted, family = around.truth, around.truth.setting.spectrum
    place = family.free.index("correlation_length")
    moved = []
    scale, tail = Scale("spectrum.correlation_length"), 0.5 * (1.0 - confidence)
    for share in (tail, 1.0 - tail):
        vector = family.vector_of(fitted.model)
        end = np.quantile(scale.less(fitted, around), share, method="weibull")
        vector[place] = np.clip(end, *family.limits[place])
        moved.append(replace(fitted, model=family.model(vector, fitted.model.shares)))
    return moved


class Scale(NamedTuple):
    """Scale on which the error of a parameter is about normal: a logarithm, unless `linear`.

    For bounds of a marginal it is the logarithm of the distance from the mean; for the noise it is
    the variance, which may be negative: estimates at zero would all have an error of zero.
    """

    name: str
    linear: bool = False

    def to(self, values: Mapping[str, float]) -> float:
        """Return a parameter on this scale."""
        name, value = self.name, values[self.name]
        if name == "noise":
            return value**2
        if self.linear:
            return value
        away = SIDES[name] * (value - values["mean"]) if name in SIDES else value - origin(name)
        return math.log(max(away, 1e-300))

    def back(self, at: float, values: Mapping[str, float]) -> float:
        """Return a parameter from this scale."""
        name = self.name
        if name == "noise":
            return math.sqrt(max(at, 0.0))
        if self.linear:
            return at
        away = math.exp(at)
        return values["mean"] + SIDES[name] * away if name in SIDES else origin(name) + away

    def of(self, fitted: Estimate) -> tuple[float, float]:
        """Return an estimate on this scale, and a quantity to which its error is in proportion."""
        if self.name == "noise":
            return fitted.noise
        width = math.sqrt(fitted.parameters["efolding_length"])
        if self.name in LOCATION_PARAMETERS:
            width *= fitted.parameters["standard_deviation"]
        return self.to(fitted.parameters), width

    def less(self, fitted: Estimate, repeated: Repetitions) -> Array:
        """Return an estimate less the error of each repetition, in proportion to its width."""
        at, width = self.of(fitted)
        true, refitted = (
            self.to(repeated.truth.parameters),
            np.array([*map(self.of, repeated.fits)]),
        )
        return at - width * (refitted[:, 0] - true) / refitted[:, 1]


def scale_of(name: str, repeated: Sequence[Repetitions]) -> Scale:
    """Return the scale of a parameter, linear if it was found negative."""
    least = min(one.parameters[name] for own in repeated for one in (own.truth, *own.fits))
    return Scale(name, name in LOCATION_PARAMETERS or (name not in SIDES and least < 0.0))


def intervals(
    repeated: Sequence[Repetitions], confidence: float, values: Array
) -> dict[str, tuple[float, float]]:
    """Return studentised bootstrap intervals (Davison and Hinkley, 1997, section 5.2).

    Errors are in units of the root of the correlation length, of which a record holds few. Upper
    and lower ends come from fields of longer and shorter correlation, `at_ends` (one step of a test
    inversion; Carpenter, 1999): the longer one at the upper end of parameters whose estimates rise
    with the correlation length. Intervals of bounds end outside of `values` without noise.
    """
    around, *moved = repeated
    fitted, estimated = around.truth, around.truth.parameters
    tail = 0.5 * (1.0 - confidence)
    lengths = [math.log(one.parameters["efolding_length"]) for one in around.fits]
    result = {}
    for name in estimated:
        scale = scale_of(name, repeated)
        shorter, longer = moved if moved and name != "noise" else (around, around)
        if np.cov([scale.of(one)[0] for one in around.fits], lengths)[0, 1] < 0.0:
            shorter, longer = longer, shorter
        low, high = (
            float(np.quantile(scale.less(fitted, repetitions), share, method="weibull"))
            for repetitions, share in ((shorter, tail), (longer, 1.0 - tail))
        )
        if name == "noise" and high <= 0.0:  # by chance: as wide as of an estimate of zero
            high -= fitted.noise[0]
        first, last = sorted(scale.back(end, estimated) for end in (low, high))
        result[name] = first, last
    noise = result["noise"][1] if "noise" in result else fitted.model.noise
    limits = limits_of(fitted, values, noise)
    for name in limits.keys() & result.keys():
        ends = limits[name]
        low, high = np.clip(result[name], *ends).tolist()
        if high - low <= (
            MIN_WIDTH * high if np.isfinite(ends).all() else 0.0
        ):  # nothing is left
            low, high = (end if math.isfinite(end) else estimated[name] for end in ends)
        result[name] = low, high
    return result


def limits_of(fitted: Estimate, values: Array, noise: float) -> dict[str, tuple[float, float]]:
    """Return the limits of parameters, with bounds of the marginal outside of all values."""
    estimated = fitted.parameters
    quiet = fitted.setting.marginal.quiet(values, noise)
    bottom, top = (float(end) for end in fitted.marginal.distribution.support())
    least, most = max(float(quiet.min()), bottom), min(float(quiet.max()), top)
    below = 0.0 if values.min() > 0.0 and least > 0.0 else -math.inf, least
    above = most, math.inf
    limits = {
        "spectrum.exponent": RANGES["exponent"],
        "anisotropy": RANGES["anisotropy"],
        "marginal.low": below,
        "marginal.high": above,
    }
    loc, extent = estimated.get("marginal.loc"), estimated.get("marginal.scale")
    if loc in (bottom, top):  # else it is inside, such as a mean
        limits["marginal.loc"] = below if loc == bottom else above
    if extent is not None and math.isclose(extent, top - bottom):
        limits["marginal.scale"] = (most - least, math.inf)
    return limits


def likely(repeated: Repetitions, measured: Array, quantity: str) -> list[RandomField]:
    """Return fields as likely as the one found: it less the error of each repetition."""
    fitted = repeated.truth
    field, limits = fitted.field(quantity), limits_of(fitted, measured, fitted.model.noise)
    free: dict[str, list[float]] = {}
    for name in fitted.parameters:
        if name == "mean" or name.startswith("marginal.") or name in NAMES.values():
            scale = scale_of(name, [repeated])
            places = scale.less(fitted, repeated).tolist()
            means = free.get("mean", places)  # bounds lie at distances from them
            pairs = zip(places, means, strict=True)
            free[name] = [scale.back(at, {"mean": mean}) for at, mean in pairs]
    del free["mean"]
    members = []
    for row in zip(*free.values(), strict=True):
        values = dict(zip(free, row, strict=True))
        within = {
            n: float(np.clip(values[n], *limits[n])) for n in values.keys() & limits.keys()
        }
        member = with_values(field, values | within)
        if isinstance(member.marginal, Beta):  # of the same mean and scatter between its limits
            bounds = {n: values[n] for n in values.keys() & SIDES.keys()}
            before = with_values(field, values | within | bounds)
            ends = member.marginal.low, member.marginal.high
            marginal = beta_of(before.mean, before.standard_deviation, *ends)
            member = replace(member, marginal=marginal)
        members.append(member)
    return members

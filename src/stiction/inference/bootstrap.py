"""Intervals by a parametric bootstrap: how fits to simulated records of a fitted field scatter."""

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.inference.estimate import Estimate, Setting, estimate, simulate
from stiction.inference.spectrum_fit import RANGES as SEARCHED
from stiction.progress import Meter

PLACES = ("mean", "marginal.mean", "marginal.loc")
"""Parameters that say where something is; all others live on a logarithm."""
SIDES = {"marginal.low": -1.0, "marginal.high": 1.0}
"""On which side of the mean a bound lies; what lives on a logarithm is its distance from there."""
RANGES = {"spectrum.exponent": SEARCHED["exponent"], "anisotropy": SEARCHED["anisotropy"]}
"""Between which ends parameters are looked for, and intervals cut off."""
SAME = 1e-3
"""As a share of an end of a range: how near to it an interval that tells nothing lies."""


class Repetitions(NamedTuple):
    """A field, and fits to records simulated from it."""

    truth: Estimate
    fits: list[Estimate]


def repeat(
    found: Estimate, setting: Setting, count: int, seed: int, workers: int, meter: Meter
) -> Repetitions:
    """Fits to records simulated from a field, as many as the family can be fitted to.

    Repetition b depends on (seed, b) only.
    """

    def one(number: int) -> Estimate | None:
        rng = np.random.default_rng([seed, number])
        try:
            again = estimate(simulate(found, setting, rng), setting, found)
        except InputError:  # no member of the family fits: counted by its absence
            return None
        meter.advance()
        return again

    with ThreadPoolExecutor(workers) as pool:
        results = list(pool.map(one, range(count)))
    return Repetitions(found, [result for result in results if result is not None])


def at_ends(around: Repetitions, setting: Setting, confidence: float) -> list[Estimate]:
    """The field with its correlation length at either end of a first interval.

    Records of short correlation lengths hold more of them, and errors are smaller and more alike.
    An estimate that is too short by chance therefore promises too much.
    """
    found, family = around.truth, setting.spectrum
    place = family.free.index("correlation_length")
    moved = []
    for end in _ends("spectrum.correlation_length", found, around, around, confidence):
        vector = family.vector(found.model)
        vector[place] = np.clip(end, *family.limits[place])
        model = family.model(vector, found.model.shares)
        parameters = setting.parameters_of(found.marginal, model)
        moved.append(replace(found, model=model, parameters=parameters))
    return moved


def intervals(
    repeated: Sequence[Repetitions], setting: Setting, confidence: float, values: Array
) -> dict[str, tuple[float, float]]:
    """Studentised bootstrap intervals (Davison and Hinkley, 1997, section 5.2).

    The error of any parameter is as wide as the root of the correlation length, of which a record
    holds few, and that of a place, such as the mean, also as the field's standard deviation; a
    repetition finds both anew. What still changes with the correlation length is met by taking the
    error at an end of an interval from a field that belongs there, with a longer or a shorter
    correlation (one step of a test inversion; Carpenter, 1999): the longer one at the upper end of
    parameters whose estimates rise with that of the correlation length, and else at the lower.

    Of the noise it is the variance that has an interval, with its own standard error, which follows
    the correlation length as it is, and as if it could be negative: estimates that end at zero
    would all have the same error, and an interval from them would hold nothing but zero. What is
    below zero is cut off last. So is of other parameters what they cannot be, see `_limits`.

    Parameters
    ----------
    repeated : sequence of Repetitions
        From the estimate; then from fields of shorter and of longer correlation, see `at_ends`.
    setting : Setting
    confidence : float
    values : (points,)
        What was fitted, of all records.
    """
    around, *ends = repeated
    found, estimated = around.truth, around.truth.parameters
    lengths = [math.log(one.parameters["efolding_length"]) for one in around.fits]
    result = {}
    for name in estimated:
        shorter, longer = ends if ends and name != "noise" else (around, around)
        own = [_scaled(name, one.parameters) for one in around.fits]
        if np.cov(own, lengths)[0, 1] < 0.0:
            shorter, longer = longer, shorter
        both = _ends(name, found, shorter, longer, confidence)
        if name == "noise":
            low, high = (math.sqrt(max(end, 0.0)) for end in both)
        else:
            low, high = sorted(_unscaled(name, end, estimated) for end in both)
        result[name] = (low, high)
    noise = result["noise"][1] if "noise" in result else found.model.noise
    for name, limits in _limits(found, setting.marginal.quiet(values, noise)).items():
        result[name] = _cut(result[name], limits, estimated[name])
    return result


def _limits(found: Estimate, quiet: Array) -> dict[str, tuple[float, float]]:
    """Between which ends parameters can lie, of those for which there is such a thing.

    Values lie inside the bounds of their marginal; `quiet` are the values as they would be without
    the greatest noise that they may carry. Errors of bounds, which have a long tail where the
    values hardly show them, do not know of that, nor those of an exponent of its range.
    """
    estimated = found.parameters
    bottom, top = (float(end) for end in found.marginal.distribution.support())
    least, most = max(float(quiet.min()), bottom), min(float(quiet.max()), top)
    below, above = (-math.inf, least), (most, math.inf)
    limits = RANGES | {"marginal.low": below, "marginal.high": above}
    loc, scale = estimated.get("marginal.loc"), estimated.get("marginal.scale")
    if loc in (bottom, top):  # else it is inside, such as a mean
        limits["marginal.loc"] = below if loc == bottom else above
    if scale is not None and math.isclose(scale, top - bottom):
        limits["marginal.scale"] = (most - least, math.inf)
    return {name: limits[name] for name in limits if name in estimated}


def _cut(
    interval: tuple[float, float], limits: tuple[float, float], at: float
) -> tuple[float, float]:
    """An interval within limits; one that lies at a limit or beyond tells nothing, and is all.

    Where there is no end, it reaches to the estimate.
    """
    low, high = (min(max(end, limits[0]), limits[1]) for end in interval)
    near = SAME if np.isfinite(limits).all() else 0.0
    for end in limits:
        if math.isclose(low, end, rel_tol=near) and math.isclose(high, end, rel_tol=near):
            low, high = (end if math.isfinite(end) else at for end in limits)
    return low, high


def _ends(
    name: str, found: Estimate, shorter: Repetitions, longer: Repetitions, confidence: float
) -> tuple[float, float]:
    """An estimate, on its own scale, less the quantiles of its error in units of its width.

    Of R repetitions the quantile p is the p (R + 1)th: interpolated to the ends, as by default, it
    lies further inside.
    """
    at, width = _found(name, found)
    tail = 0.5 * (1.0 - confidence)
    highest = np.quantile(_errors(name, shorter), 1.0 - tail, method="weibull")
    lowest = np.quantile(_errors(name, longer), tail, method="weibull")
    return at - width * float(highest), at - width * float(lowest)


def _errors(name: str, repeated: Repetitions) -> list[float]:
    """Errors of a parameter on its own scale, in units of their widths."""
    model = repeated.truth.model
    truth = model.noise**2 if name == "noise" else _found(name, repeated.truth)[0]
    return [(at - truth) / width for at, width in (_found(name, one) for one in repeated.fits)]


def _found(name: str, one: Estimate) -> tuple[float, float]:
    """An estimate on its own scale, and what its error is proportional to."""
    if name == "noise":  # its variance, which may be negative, and its own error
        return one.noise
    width = math.sqrt(one.parameters["efolding_length"])
    if name in PLACES:
        width *= one.parameters["standard_deviation"]
    return _scaled(name, one.parameters), width


def _scaled(name: str, values: Mapping[str, float]) -> float:
    """A parameter on the scale on which its error is about normal."""
    if name in PLACES:
        return values[name]
    return math.log(max(SIDES.get(name, 1.0) * (values[name] - _origin(name, values)), 1e-300))


def _unscaled(name: str, scaled: float, values: Mapping[str, float]) -> float:
    if name in PLACES:
        return scaled
    return _origin(name, values) + SIDES.get(name, 1.0) * math.exp(scaled)


def _origin(name: str, values: Mapping[str, float]) -> float:
    """From where a logarithm counts."""
    if name in SIDES:
        return values["mean"]
    return 0.5 if name.endswith("exponent") else 0.0

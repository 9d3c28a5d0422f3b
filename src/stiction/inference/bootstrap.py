"""Intervals by a parametric bootstrap: how fits to simulated records of a fitted field scatter."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.inference.estimate import Estimate, Setting, estimate, simulate
from stiction.inference.spectrum_fit import ANISOTROPIES, EXPONENTS
from stiction.progress import Meter

PLACES = ("mean", "marginal.mean", "marginal.loc")
"""Parameters that say where something is; all others live on a logarithm."""
SIDES = {"marginal.low": -1.0, "marginal.high": 1.0}
"""On which side of the mean a bound lies; what lives on a logarithm is its distance from there."""

RANGES = {"spectrum.exponent": EXPONENTS, "anisotropy": ANISOTROPIES}
"""Between which ends parameters are looked for, and intervals cut off."""
SAME = 1e-3
"""As a share of an end of a range: how near to it an interval that tells nothing lies."""


def parameters_of(found: Estimate, setting: Setting) -> dict[str, float]:
    """Everything that was estimated, and what follows from it, by name."""
    marginal, spectrum = found.marginal, found.model.spectrum
    lags = spectrum.correlation_length * LAGS
    correlation = spectrum.untruncated_correlation(lags)
    values = {
        "efolding_length": float(np.interp(-math.exp(-1.0), -correlation, lags)),
        "mean": float(marginal.distribution.mean()),
        "standard_deviation": float(marginal.distribution.std()),
    }
    own = setting.marginal.parameters(marginal)
    values |= {f"marginal.{name}": value for name, value in own.items()}
    estimated = {
        "correlation_length": ("spectrum.correlation_length", spectrum.correlation_length),
        "exponent": ("spectrum.exponent", getattr(spectrum, "exponent", 0.0)),
        "anisotropy": ("anisotropy", found.model.anisotropy),
        "noise_share": ("noise", found.model.noise),
    }
    free = setting.spectrum.free
    return values | dict(pair for name, pair in estimated.items() if name in free)


LAGS = np.concatenate(([0.0], np.geomspace(0.01, 4.0, 400)))
"""In correlation lengths; every spectrum has its 1/e there."""


@dataclass(frozen=True, eq=False)
class Repetition:
    """A fit to simulated records.

    Attributes
    ----------
    estimate : Estimate
    parameters : dict of str to float
    """

    estimate: Estimate
    parameters: dict[str, float]


@dataclass(frozen=True, eq=False)
class Repetitions:
    """Fits to records simulated from one field, and that field.

    Attributes
    ----------
    truth : Estimate
    fits : list of Repetition
    """

    truth: Estimate
    fits: list[Repetition]


def repeat(
    found: Estimate, setting: Setting, count: int, seed: int, workers: int, meter: Meter
) -> Repetitions:
    """Fits to records simulated from a field, as many as the family can be fitted to.

    Repetition b depends on (seed, b) only.
    """

    def one(number: int) -> Repetition | None:
        rng = np.random.default_rng([seed, number])
        try:
            again = estimate(simulate(found, setting, rng), setting, found)
            result = Repetition(again, parameters_of(again, setting))
        except InputError:  # no member of the family fits: counted by its absence
            return None
        meter.advance()
        return result

    with ThreadPoolExecutor(workers) as pool:
        results = list(pool.map(one, range(count)))
    return Repetitions(found, [result for result in results if result is not None])


def at_ends(
    around: Repetitions, setting: Setting, confidence: float
) -> tuple[Estimate, Estimate] | None:
    """The field with its correlation length at either end of a first interval; None if it is known.

    Records of short correlation lengths hold more of them, and errors are smaller and more alike.
    An estimate that is too short by chance therefore promises too much.
    """
    name, family = "correlation_length", setting.spectrum
    if name not in family.free:
        return None
    found = around.truth
    estimated = parameters_of(found, setting)
    full = f"spectrum.{name}"
    errors = _errors(full, around, setting)
    at, width = _scaled(full, estimated), _width(full, estimated)
    first = _ends(at, width, errors, errors, confidence)
    place = family.free.index(name)

    def moved(end: float) -> Estimate:
        vector = family.vector(found.model)
        vector[place] = np.clip(end, *family.limits[place])
        return replace(found, model=family.model(vector, found.model.shares))

    return moved(first[0]), moved(first[1])


def intervals(
    around: Repetitions,
    ends: tuple[Repetitions, Repetitions] | None,
    setting: Setting,
    confidence: float,
    values: Array,
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
    around : Repetitions
        From the estimate.
    ends : (Repetitions, Repetitions), optional
        From a field of shorter and one of longer correlation, see `at_ends`.
    setting : Setting
    confidence : float
    values : (points,)
        What was fitted, of all records.
    """
    found = around.truth
    estimated = parameters_of(found, setting)
    lengths = [math.log(one.parameters["efolding_length"]) for one in around.fits]
    result = {}
    for name in estimated:
        if name == "noise":
            at, width = found.noise
            errors = _noise_errors(around)
            low, high = _ends(at, width, errors, errors, confidence)
            result[name] = (math.sqrt(max(low, 0.0)), math.sqrt(max(high, 0.0)))
            continue
        shorter, longer = ends or (around, around)
        own = [_scaled(name, one.parameters) for one in around.fits]
        if np.dot(np.array(own) - np.mean(own), np.array(lengths) - np.mean(lengths)) < 0.0:
            shorter, longer = longer, shorter
        at, width = _scaled(name, estimated), _width(name, estimated)
        both = _errors(name, shorter, setting), _errors(name, longer, setting)
        low, high = _ends(at, width, *both, confidence)
        low, high = sorted(_unscaled(name, end, estimated) for end in (low, high))
        result[name] = (low, high)
    noise = result["noise"][1] if "noise" in result else found.model.noise
    for name, limits in _limits(estimated, found, setting.marginal.quiet(values, noise)).items():
        result[name] = _cut(result[name], limits, estimated[name])
    return result


def _limits(
    estimated: Mapping[str, float], found: Estimate, quiet: Array
) -> dict[str, tuple[float, float]]:
    """Between which ends parameters can lie, of those for which there is such a thing.

    Values lie inside the bounds of their marginal; `quiet` are the values as they would be without
    the greatest noise that they may carry. Errors of bounds, which have a long tail where the
    values hardly show them, do not know of that, nor those of an exponent of its range.
    """
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
    if any(math.isclose(low, end, rel_tol=near) and math.isclose(high, end, rel_tol=near)
           for end in limits):  # fmt: skip
        low, high = (end if math.isfinite(end) else at for end in limits)
    return low, high


def _errors(name: str, repeated: Repetitions, setting: Setting) -> list[float]:
    """Of a parameter on its own scale, in units of their widths."""
    truth = _scaled(name, parameters_of(repeated.truth, setting))
    return [
        (_scaled(name, one.parameters) - truth) / _width(name, one.parameters)
        for one in repeated.fits
    ]


def _noise_errors(repeated: Repetitions) -> list[float]:
    """Errors of the variance of the noise in units of their standard errors."""
    truth = repeated.truth.model.noise**2
    return [(at - truth) / error for at, error in (one.estimate.noise for one in repeated.fits)]


def _ends(
    at: float,
    width: float,
    shorter: Sequence[float],
    longer: Sequence[float],
    confidence: float,
) -> tuple[float, float]:
    """An estimate less the quantiles of its error, which is in units of its width.

    Of R repetitions the quantile p is the p (R + 1)th: interpolated to the ends, as by default, it
    lies further inside.
    """
    tail = 0.5 * (1.0 - confidence)
    highest = float(np.quantile(shorter, 1.0 - tail, method="weibull"))
    lowest = float(np.quantile(longer, tail, method="weibull"))
    return at - width * highest, at - width * lowest


def _width(name: str, values: Mapping[str, float]) -> float:
    """What the error of a parameter, on its own scale, is proportional to."""
    root = math.sqrt(values["efolding_length"])
    return root * values["standard_deviation"] if name in PLACES else root


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

"""Intervals by a parametric bootstrap: how fits to simulated records of a fitted field scatter."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from stiction._progress import Meter
from stiction.errors import InputError
from stiction.inference.estimate import Estimate, Setting, estimate, simulate

PLACES = ("mean", "marginal.mean", "marginal.low", "marginal.high", "marginal.loc")
"""Parameters that say where something is; all others are positive and live on a logarithm."""


def parameters_of(found: Estimate, setting: Setting) -> dict[str, float]:
    """Everything that was estimated, and what follows from it, by name."""
    marginal, spectrum, model = found.marginal, found.model.spectrum, found.model
    values = {
        f"marginal.{name}": value for name, value in setting.marginal.parameters(marginal).items()
    }
    values |= {
        "mean": float(marginal.distribution.mean()),
        "standard_deviation": float(marginal.distribution.std()),
    }
    free = setting.spectrum.free
    if "correlation_length" in free:
        values["spectrum.correlation_length"] = spectrum.correlation_length
    if "exponent" in free:
        values["spectrum.exponent"] = spectrum.exponent
    values["efolding_length"] = efolding_length(found, setting)
    if "anisotropy" in free:
        values["anisotropy"] = model.anisotropy
    if "noise_share" in free:
        values["noise"] = model.noise
    return values


def efolding_length(found: Estimate, setting: Setting) -> float:
    """Where the correlation of z falls to 1/e, m: of the curve that was fitted, interpolated."""
    spectrum = found.model.spectrum
    lags = spectrum.correlation_length * LAGS
    rho = spectrum.untruncated_correlation(lags)
    return float(np.interp(-math.exp(-1.0), -rho, lags))


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


def repeat(
    found: Estimate, setting: Setting, count: int, seed: int, workers: int, meter: Meter
) -> list[Repetition]:
    """Fits to simulated records; fewer than asked for if the time is over.

    Repetition b depends on (seed, b) only.
    """
    start = setting.spectrum.vector(found.model)

    def one(number: int) -> Repetition | None:
        if meter.over:
            return None
        rng = np.random.default_rng([seed, number])
        try:
            again = estimate(simulate(found, setting, rng), setting, start)
            result = Repetition(again, parameters_of(again, setting))
        except InputError:  # no member of the family fits: counted by its absence
            return None
        meter.advance()
        return result

    with ThreadPoolExecutor(workers) as pool:
        results = list(pool.map(one, range(count)))
    return [result for result in results if result is not None]


def intervals(
    found: Estimate, setting: Setting, repeated: Sequence[Repetition], confidence: float
) -> dict[str, tuple[float, float]]:
    """Studentised bootstrap intervals (Davison and Hinkley, 1997, section 5.2).

    The error of any parameter is as wide as the root of the correlation length, of which a record
    holds few, and that of a place, such as the mean, also as the field's standard deviation; a
    repetition finds both anew.

    Of the noise it is the variance that has an interval, with its own standard error, and as if it
    could be negative: estimates that end at zero would all have the same error, and an interval
    from them would hold nothing but zero. What is below zero is cut off last.
    """
    estimated = parameters_of(found, setting)
    result = {}
    for name, value in estimated.items():
        if name == "noise" and found.noise is not None:
            at, width = found.noise
            pairs = [one.estimate.noise or (0.0, 1.0) for one in repeated]
            errors = [(again - found.model.noise**2) / error for again, error in pairs]
            ends = _ends(at, width, errors, confidence)
            low, high = (math.sqrt(max(end, 0.0)) for end in ends)
        else:
            at = _scaled(name, value)
            errors = [
                (_scaled(name, one.parameters[name]) - at) / _width(name, one.parameters)
                for one in repeated
            ]
            ends = _ends(at, _width(name, estimated), errors, confidence)
            low, high = (_unscaled(name, end) for end in ends)
        result[name] = (low, high)
    return result


def _ends(
    at: float, width: float, errors: Sequence[float], confidence: float
) -> tuple[float, float]:
    """An estimate less the quantiles of its error, which is in units of its width.

    Of R repetitions the quantile p is the p (R + 1)th: interpolated to the ends, as by default, it
    lies further inside.
    """
    tail = 0.5 * (1.0 - confidence)
    low, high = np.quantile(errors, [tail, 1.0 - tail], method="weibull")
    return float(at - width * high), float(at - width * low)


def _width(name: str, values: Mapping[str, float]) -> float:
    """What the error of a parameter, on its own scale, is proportional to."""
    root = math.sqrt(values["efolding_length"])
    return root * values["standard_deviation"] if name in PLACES else root


def _scaled(name: str, value: float) -> float:
    if name in PLACES:
        return value
    shift = 0.5 if name.endswith("exponent") else 0.0
    return math.log(max(value - shift, 1e-300))


def _unscaled(name: str, value: float) -> float:
    if name in PLACES:
        return value
    shift = 0.5 if name.endswith("exponent") else 0.0
    return shift + math.exp(value)

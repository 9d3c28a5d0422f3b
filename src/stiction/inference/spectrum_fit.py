"""Parameters of a spectrum by Fisher scoring on the Whittle likelihood."""

import dataclasses
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.inference.marginal_fit import name_and_fixed
from stiction.inference.scoring import climb
from stiction.inference.whittle import Model, Observed, loss
from stiction.random.spectra import (
    ExponentialSpectrum,
    PowerLawSpectrum,
    SquaredExponentialSpectrum,
)

CLASSES: dict[str, Any] = {
    "power_law": PowerLawSpectrum,
    "squared_exponential": SquaredExponentialSpectrum,
    "exponential": ExponentialSpectrum,
}
POWER_KEPT = {"power_law": 0.9997, "squared_exponential": 0.9997, "exponential": 0.99}
RANGES = {
    "variance": (1e-200, 1e200),
    "exponent": (0.65, 16.0),  # above, a power law looks like a squared exponential
    "anisotropy": (0.05, 20.0),
    # A negative share stands for less at high wavenumbers than the field alone would have, by
    # chance; were it cut at zero, the errors of small noises could not be told.
    "noise_share": (-0.5, 0.95),
}
"""Between which ends parameters are looked for; of noise, its share of the variance."""
DIFFERENCE = 1e-4
SETTLED = 1e-3
"""Gain of log likelihood below which scoring ends; a standard error is worth a half."""
LONGEST = 1.5
"""Step, on the scale on which parameters are searched for."""


@dataclass(frozen=True)
class SpectrumFamily:
    """A family of spectra, what of it is fixed, and what else is estimated with it.

    Attributes
    ----------
    name : str
    fixed : dict of str to float
    anisotropy : float or None
        None: estimated.
    noise : float or None
        Standard deviation of the measurement noise; None: estimated.
    lengths : (float, float)
        Between which correlation lengths are looked for, m.
    """

    name: str
    fixed: dict[str, float]
    anisotropy: float | None
    noise: float | None
    lengths: tuple[float, float]

    @property
    def free(self) -> tuple[str, ...]:
        """What is estimated, in the order of the vector of parameters."""
        estimated = {
            "variance": True,
            "correlation_length": "correlation_length" not in self.fixed,
            "exponent": self.name == "power_law" and "exponent" not in self.fixed,
            "anisotropy": self.anisotropy is None,
            "noise_share": self.noise is None,
        }
        return tuple(name for name, is_free in estimated.items() if is_free)

    @property
    def limits(self) -> Array:
        """Of each free parameter as it is searched for, (parameters, 2)."""
        ranges = RANGES | {"correlation_length": self.lengths}
        return np.array([[_forth(name, end) for end in ranges[name]] for name in self.free])

    def model(self, vector: Array, shares: Array) -> Model:
        """The model of a vector of parameters."""
        found = {n: back(n, float(v)) for n, v in zip(self.free, vector, strict=True)}
        variance = found.pop("variance")
        anisotropy = found.pop("anisotropy", self.anisotropy or 1.0)
        known = min((self.noise or 0.0) ** 2 / variance, RANGES["noise_share"][1])
        noise = found.pop("noise_share", known)
        options = self.fixed | found
        end_given = not {"truncation", "power_kept"}.isdisjoint(options)
        if not end_given:
            options["power_kept"] = POWER_KEPT[self.name]
        return Model(
            CLASSES[self.name](**options), anisotropy, noise, variance, shares, end_given
        )

    def vector(self, model: Model) -> Array:
        """The parameters of a model."""
        of = {name: model.spectrum for name in ("correlation_length", "exponent")}
        found = [(name, float(getattr(of.get(name, model), name))) for name in self.free]
        return np.array([_forth(*one) for one in found])


def _forth(name: str, value: float) -> float:
    """To the scale on which a parameter is searched for and its error is about normal."""
    if name == "exponent":
        return math.log(value - 0.5)
    return value if name == "noise_share" else math.log(value)


def back(name: str, value: float) -> float:
    """From that scale."""
    if name == "exponent":
        return 0.5 + math.exp(value)
    return value if name == "noise_share" else math.exp(value)


def spectrum_family(
    given: Any, anisotropy: float | None, noise: float | None, lengths: tuple[float, float]
) -> SpectrumFamily:
    """A family from its name, or a table with some of its parameters."""
    name, fixed = name_and_fixed("spectrum", given)
    if name not in CLASSES:
        raise InputError(unknown_name("spectrum", name, CLASSES))
    known = [field.name for field in dataclasses.fields(CLASSES[name]) if field.name != "type"]
    problems = [
        unknown_name(f"spectrum.{name}", key, known) for key in fixed if key not in known
    ]
    if problems:
        raise InputError(problems)
    try:
        CLASSES[name](**({"correlation_length": 1.0} | fixed))
    except InputError as error:
        raise InputError([f"spectrum: {text}" for text in error.problems]) from None
    return SpectrumFamily(name, fixed, anisotropy, noise, lengths)


def coarse(family: SpectrumFamily, shares: Array, observed: Sequence[Observed]) -> Array:
    """The best of a grid of parameters, to begin with."""
    axes: dict[str, Sequence[float]] = {
        "variance": [1.0],
        "correlation_length": [float(v) for v in np.geomspace(*family.lengths, 17)[:-2]],
        "exponent": [1.0, 2.0, 4.0],
        "anisotropy": [0.5, 1.0, 2.0],
        "noise_share": [0.0, 0.01, 0.1, 0.4],
    }
    power = sum(float(np.sum(one.weights * one.average)) for one in observed)
    best, least = np.zeros(0), math.inf
    for entry in itertools.product(*[axes[name] for name in family.free]):
        at = np.array([_forth(n, v) for n, v in zip(family.free, entry, strict=True)])
        model = family.model(at, shares)
        expected = [model.expectation(one) for one in observed]
        scale = power / sum(
            float(np.sum(one.weights * e)) for one, e in zip(observed, expected, strict=True)
        )
        value = loss([scale * e for e in expected], observed)
        if value < least:
            best, least = at, value
            best[0] = math.log(scale)
    return best


def fit_spectrum(
    family: SpectrumFamily, shares: Array, observed: Sequence[Observed], start: Array
) -> Array:
    """The vector of parameters of the greatest likelihood, from a start."""

    def value_of(at: Array) -> tuple[float, list[Array]]:
        model = family.model(at, shares)
        signal = [model.signal(one) for one in observed]
        mixed = [model.with_noise(s, one) for s, one in zip(signal, observed, strict=True)]
        return -loss(mixed, observed), signal

    def derivatives(at: Array, signal: Sequence[Array]) -> tuple[Array, Array]:
        return _score(family, at, shares, observed, signal)

    return climb(start, family.limits, value_of, derivatives, longest=LONGEST, settled=SETTLED)


def _score(
    family: SpectrumFamily,
    at: Array,
    shares: Array,
    observed: Sequence[Observed],
    signal: Sequence[Array],
) -> tuple[Array, Array]:
    """Derivatives of the log likelihood, (parameters,), and Fisher's information of it.

    With d = d log E/d theta the score is sum w d (I/E - 1) and the information sum w d d^T.
    """
    model, limits = family.model(at, shares), family.limits
    moved = {}
    for i, name in enumerate(family.free):
        if name not in ("variance", "noise_share"):
            aside = at.copy()
            aside[i] += DIFFERENCE if at[i] + DIFFERENCE <= limits[i, 1] else -DIFFERENCE
            moved[name] = family.model(aside, shares), aside[i] - at[i]
    score, information = np.zeros(at.size), np.zeros((at.size, at.size))
    for one, s in zip(observed, signal, strict=True):
        expected = model.with_noise(s, one)
        # Of a known noise the share falls as the variance grows.
        slopes = {
            "variance": expected if family.noise is None else model.variance * s,
            "noise_share": model.variance * (one.white - s),
        }
        for name, (other, step) in moved.items():
            slopes[name] = (
                model.variance * (1.0 - model.noise_share) * (other.signal(one) - s) / step
            )
        lifted = expected + one.floor
        d = np.stack([(slopes[name] / lifted).ravel() for name in family.free])
        weight = one.records * one.weights.ravel()
        score += d @ (weight * ((one.average - expected) / lifted).ravel())
        information += (d * weight) @ d.T
    return score, information


def noise_variance(
    family: SpectrumFamily, at: Array, shares: Array, observed: Sequence[Observed]
) -> tuple[float, float]:
    """Variance of the noise, which may be negative, and its standard error by the information.

    The information takes ordinates for independent, so that the error is somewhat too small; what
    a bootstrap needs is that it grows and shrinks as the true one.
    """
    model = family.model(at, shares)
    _, information = _score(family, at, shares, observed, [model.signal(o) for o in observed])
    slope = np.zeros(at.size)
    slope[family.free.index("variance")] = model.noise_share * model.variance
    slope[family.free.index("noise_share")] = model.variance
    error = math.sqrt(float(slope @ np.linalg.pinv(information, hermitian=True) @ slope))
    return model.noise_share * model.variance, error

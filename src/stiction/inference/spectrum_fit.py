"""Parameters of a spectrum by Fisher scoring on the Whittle likelihood."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.inference.scoring import climb
from stiction.inference.whittle import Model, Observed, loss
from stiction.model import describe, is_finite
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
EXPONENTS = (0.65, 16.0)
"""Beyond the upper one a power law looks like a squared exponential."""
NOISE = (-0.5, 0.95)
"""Shares of the variance. A negative one stands for less at high wavenumbers than the field alone
would have, by chance; were it cut at zero, the errors of small noises could not be told."""
VARIANCES = (1e-200, 1e200)
ANISOTROPIES = (0.05, 20.0)
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
    fixed : tuple of (str, float)
    anisotropy : float or None
        None: estimated.
    noise : float or None
        Standard deviation of the measurement noise; None: estimated.
    lengths : (float, float)
        Between which correlation lengths are looked for, m.
    """

    name: str
    fixed: tuple[tuple[str, float], ...]
    anisotropy: float | None
    noise: float | None
    lengths: tuple[float, float]

    @property
    def free(self) -> tuple[str, ...]:
        """What is estimated, in the order of the vector of parameters."""
        names = ["variance"]
        if "correlation_length" not in dict(self.fixed):
            names.append("correlation_length")
        if self.name == "power_law" and "exponent" not in dict(self.fixed):
            names.append("exponent")
        if self.anisotropy is None:
            names.append("anisotropy")
        if self.noise is None:
            names.append("noise_share")
        return tuple(names)

    @property
    def limits(self) -> Array:
        """Of each free parameter as it is searched for, (parameters, 2)."""
        ranges = {
            "variance": VARIANCES,
            "correlation_length": self.lengths,
            "exponent": EXPONENTS,
            "anisotropy": ANISOTROPIES,
            "noise_share": NOISE,
        }
        return np.array([[_forth(n, end) for end in ranges[n]] for n in self.free])

    @property
    def end_given(self) -> bool:
        """Whether the truncation was given; otherwise only simulation needs one."""
        return not {"truncation", "power_kept"}.isdisjoint(dict(self.fixed))

    def model(self, vector: Array, shares: Array) -> Model:
        """The model of a vector of parameters."""
        found = {n: back(n, float(v)) for n, v in zip(self.free, vector, strict=True)}
        variance = found.pop("variance")
        anisotropy = found.pop("anisotropy", self.anisotropy)
        known = min((self.noise or 0.0) ** 2 / variance, NOISE[1])
        noise = found.pop("noise_share", known)
        options = dict(self.fixed) | found
        if "truncation" not in options:
            options.setdefault("power_kept", POWER_KEPT[self.name])
        return Model(
            spectrum=CLASSES[self.name](**options),
            anisotropy=float(anisotropy or 1.0),
            noise_share=noise,
            variance=variance,
            shares=shares,
            end_seen=self.end_given,
        )

    def vector(self, model: Model) -> Array:
        """The parameters of a model."""
        known = {
            "variance": model.variance,
            "correlation_length": model.spectrum.correlation_length,
            "exponent": getattr(model.spectrum, "exponent", None),
            "anisotropy": model.anisotropy,
            "noise_share": model.noise_share,
        }
        return np.array([_forth(name, float(known[name])) for name in self.free])


def _forth(name: str, value: float) -> float:
    """To the scale on which a parameter is searched for and its error is about normal."""
    if name == "exponent":
        return math.log(value - 0.5)
    return value if name == "noise_share" else math.log(value)


def back(name: str, value: float) -> float:
    if name == "exponent":
        return 0.5 + math.exp(value)
    return value if name == "noise_share" else math.exp(value)


def spectrum_family(
    given: Any, anisotropy: float | None, noise: float | None, lengths: tuple[float, float]
) -> SpectrumFamily:
    """A family from its name, or a table with some of its parameters."""
    if isinstance(given, str):
        given = {"type": given}
    if not isinstance(given, Mapping):
        raise InputError(
            "spectrum: must be 'power_law', 'squared_exponential' or 'exponential', or a table with"
            " parameters to keep, such as {'type': 'power_law', 'exponent': 4.0}, got"
            f" {describe(given)}"
        )
    name = str(given.get("type"))
    if name not in CLASSES:
        raise InputError(unknown_name("spectrum", name, CLASSES))
    fixed = {str(key): value for key, value in given.items() if key != "type"}
    known = [f.name for f in dataclasses.fields(CLASSES[name]) if f.name != "type"]
    problems = [unknown_name(f"spectrum.{name}", key, known) for key in fixed if key not in known]
    problems += [
        f"spectrum.{key}: must be a finite number, got {describe(value)}"
        for key, value in fixed.items()
        if not is_finite(value)
    ]
    if not problems:
        try:
            CLASSES[name](**({"correlation_length": 1.0} | fixed))
        except InputError as error:
            problems = [f"spectrum: {text}" for text in error.problems]
    if problems:
        raise InputError(problems)
    return SpectrumFamily(
        name, tuple((k, float(v)) for k, v in fixed.items()), anisotropy, noise, lengths
    )


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
        expected = _expected(family.model(at, shares), observed)
        scale = power / sum(
            float(np.sum(one.weights * e)) for one, e in zip(observed, expected, strict=True)
        )
        value = loss([scale * e for e in expected], observed)
        if value < least:
            best, least = at, value
            best[0] = math.log(scale)
    return best


def _expected(model: Model, observed: Sequence[Observed]) -> list[Array]:
    return [model.expectation(one) for one in observed]


def fit_spectrum(
    family: SpectrumFamily, shares: Array, observed: Sequence[Observed], start: Array
) -> Array:
    """The vector of parameters of the greatest likelihood, from a start.

    With d = d log E/d theta the score is sum w d (I/E - 1) and the information sum w d d^T.
    """

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
    """Derivatives of the log likelihood, (parameters,), and Fisher's information of it."""
    score, information = np.zeros(at.size), np.zeros((at.size, at.size))
    slopes = _slopes(family, at, shares, observed, signal)
    for one, (expected, slope) in zip(observed, slopes, strict=True):
        weight = len(one.periodograms) * one.weights.ravel()
        d = slope / (expected + one.floor).ravel()
        score += d @ (weight * ((one.average - expected) / (expected + one.floor)).ravel())
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
    signal = [model.signal(one) for one in observed]
    _, information = _score(family, at, shares, observed, signal)
    slope = np.zeros(at.size)
    slope[family.free.index("variance")] = model.noise_share * model.variance
    slope[family.free.index("noise_share")] = model.variance
    error = math.sqrt(float(slope @ np.linalg.pinv(information, hermitian=True) @ slope))
    return model.noise_share * model.variance, error


def _slopes(
    family: SpectrumFamily,
    at: Array,
    shares: Array,
    observed: Sequence[Observed],
    signal: Sequence[Array],
) -> list[tuple[Array, Array]]:
    """Expectations, and their derivatives by the parameters, (parameters, ordinates)."""
    model, limits = family.model(at, shares), family.limits
    variance, share = model.variance, model.noise_share
    columns: list[list[Array]] = [[] for _ in observed]
    for i, name in enumerate(family.free):
        aside = at.copy()
        aside[i] += DIFFERENCE if at[i] + DIFFERENCE <= limits[i, 1] else -DIFFERENCE
        moved = family.model(aside, shares)
        for column, one, s in zip(columns, observed, signal, strict=True):
            if name == "variance" and family.noise is None:
                slope = model.with_noise(s, one)
            elif name == "variance":  # the noise stays what it is
                slope = variance * s
            elif name == "noise_share":
                slope = variance * (one.white - s)
            else:
                change = (moved.signal(one) - s) / (aside[i] - at[i])
                slope = variance * (1.0 - share) * change
            column.append(slope.ravel())
    return [
        (model.with_noise(s, one), np.array(column))
        for column, one, s in zip(columns, observed, signal, strict=True)
    ]

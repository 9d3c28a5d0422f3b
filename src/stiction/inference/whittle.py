"""Whittle likelihood of records with noise, whose field is mapped from a Gaussian field.

Problem. A record y = v(z) + e has periodogram I_k. Its expectation E_k
follows from the spectrum of z, the map v and the variance of the noise.
Find the parameters with the greatest likelihood

    L = -sum_k w_k (log E_k + I_k/E_k).

Sources. The likelihood is due to Whittle (1953), Arkiv foer Matematik
2, 423. With the exact expectation for a finite window it becomes the
debiased likelihood of Sykulski, Olhede, Guillaumin, Lilly and Early
(2019), Biometrika 106, 251, and on planes of Guillaumin, Sykulski,
Olhede and Simons (2022), Journal of the Royal Statistical Society B
84, 1526. Correlations of mapped fields follow Grigoriu, Applied
Non-Gaussian Processes (1995).

Steps:

1. Average the periodograms of all records with the same geometry
   (`window`).
2. The correlation of the values is a power series in the correlation of
   z. Its coefficients are the map's squared Hermite coefficients. White
   noise adds its variance at zero lag.
3. E_k follows exactly from this correlation and the window. The
   variance is a free parameter, so that its error in a short record
   does not disturb the shape of the spectrum.
4. Add a thousandth of the highest power to I_k and E_k. A truncated
   spectrum has almost no power at high wavenumbers, and without a
   floor, rounding and higher orders of the map would matter there. The
   score stays unbiased, and power below the floor has no effect.
5. Start at the best point of a coarse parameter grid, and climb by
   scoring (`marginal_fit.climb`). Fisher's information is sum w d d^T
   with d = d log E/d theta.

Departures. The map v, the noise and the floor are our own.
"""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.kinds import from_table
from stiction.inference.marginal_fit import climb, family_table
from stiction.inference.window import RecordWindow
from stiction.random.mapping import hermite_coefficients
from stiction.random.spectra import SPECTRA

RANGES = {
    "variance": (1e-200, 1e200),
    "exponent": (0.65, 16.0),  # above, a power law looks like a squared exponential
    "anisotropy": (0.05, 20.0),
    # A negative fraction means less power at high wavenumbers than the
    # field alone has, by chance. If it were cut at zero, the errors of
    # small noises could not be estimated.
    "noise_share": (-0.5, 0.95),
}
"""Ends of the searched range of each parameter. The noise is a fraction
of the variance."""
TRIED = {
    "variance": [1.0],
    "exponent": [1.0, 2.0, 4.0],
    "anisotropy": [0.5, 1.0, 2.0],
    "noise_share": [0.0, 0.01, 0.1, 0.4],
}
"""Values of each parameter on the coarse grid of step 5."""
FLOOR = 1e-3
"""Floor as a fraction of the highest power, which is averaged over
records and neighbours."""
NEIGHBOURS = 5
MAP_ORDERS, MAP_STEP = 10, 0.1
"""Hermite orders of the map of a marginal, and steps of z that give
them to 1e-4."""
OF_SPECTRUM = ("correlation_length", "exponent", "anisotropy")
"""Parameters of a spectrum, by their keys."""
AT_END = 1e-3
"""Distance from an end of a range, over the range, below which an
estimate is at the end."""
LOG_STEP = 1e-4
SETTLED = 1e-3
"""Gain of log likelihood below which scoring ends. A standard error
costs one half."""
LONGEST = 1.5
"""Longest step of scoring, on the scale of the search."""


def hermite_shares(marginal: Any) -> Array:
    """Return the fractions of the variance in Hermite orders 0, 1, ..., and the rest."""
    shares = hermite_coefficients(marginal, MAP_STEP, MAP_ORDERS) ** 2
    shares[0] = 0.0
    return shares / shares.sum()


class Observed(NamedTuple):
    """Average periodogram of records with the same geometry, their number, and the noise floor."""

    window: RecordWindow
    records: int
    average: Array
    floor: float


def periodograms_of(rows: Sequence[Array], windows: Sequence[RecordWindow]) -> list[Observed]:
    """Return the periodograms of measured values (points,) by geometry (step 1)."""
    powers: dict[RecordWindow, list[Array]] = {}
    for row, window in zip(rows, windows, strict=True):
        powers.setdefault(window, []).append(window.periodogram(row))
    observed = []
    for window, periodograms in powers.items():
        average = np.stack(periodograms).mean(axis=0)
        # A single ordinate may be several times its expectation by chance.
        highest = uniform_filter(average, NEIGHBOURS, mode="nearest").max()
        observed.append(Observed(window, len(periodograms), average, FLOOR * float(highest)))
    return observed


class Model(NamedTuple):
    """Prediction of records from a spectrum, the Hermite fractions of a marginal and noise.

    The truncation of the spectrum is left out: it lies at a multiple of
    1/xi_0, and would determine the correlation length if it fell among
    the wavenumbers of a record.
    """

    spectrum: Any
    anisotropy: float
    noise_share: float  # of the variance; negative only during the search
    variance: float  # of the values with noise
    shares: Array

    @property
    def noise(self) -> float:
        """Standard deviation due to measurement noise."""
        return math.sqrt(self.noise_share * self.variance)

    def power(self, window: RecordWindow) -> Array:
        """Return the variance of z in each mode on the periodic grid of a window."""
        return window.power(self.spectrum, self.anisotropy)

    def correlation(self, window: RecordWindow) -> Array:
        """Return the correlation of values without noise at all lags (step 2)."""
        rho = window.correlation(self.power(window))
        return np.polynomial.polynomial.polyval(rho, self.shares)

    def signal(self, window: RecordWindow) -> Array:
        """Return the expected periodogram (*half) for values without noise, with variance 1."""
        return window.expectation(self.correlation(window))

    def expectation(self, window: RecordWindow, signal: Array | None = None) -> Array:
        """Return the expected periodogram (*half), from the `signal` if it is known (step 3)."""
        signal = self.signal(window) if signal is None else signal
        share = self.noise_share
        return self.variance * ((1.0 - share) * signal + share * window.white)


def offset(name: str) -> float:
    """Return the origin for the logarithm of a parameter, so that its error is about normal."""
    return 0.5 if name.endswith("exponent") else 0.0


def spectrum_family(given: Any) -> tuple[str, dict[str, float]]:
    """Return the name and the fixed parameters of a spectrum family, after checks."""
    table = family_table(given)
    if "power_kept" in table:
        raise InputError("power_kept: a fit covers the whole spectrum. Leave it out")
    name = from_table(SPECTRA, {"correlation_length": 1.0} | table).type
    return name, {key: float(value) for key, value in table.items() if key != "type"}


@dataclass(frozen=True, eq=False)
class SpectrumFamily:
    """A family of spectra with fixed parameters.

    Parameters with the value None are estimated.
    """

    name: str
    fixed: dict[str, float]
    anisotropy: float | None
    noise: float | None  # standard deviation
    lengths: tuple[float, float]  # range of the searched correlation lengths, m

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Names of the free parameters, as in the vector."""
        known: dict[str, Any] = self.fixed | {"anisotropy": self.anisotropy}
        known["noise_share"] = self.noise
        absent = ("exponent",) if self.name != "power_law" else ()
        names = ("variance", "correlation_length", "exponent", "anisotropy", "noise_share")
        return tuple(n for n in names if known.get(n) is None and n not in absent)

    @cached_property
    def limits(self) -> Array:
        """Ends of the ranges on the search scale, with shape (parameters, 2)."""
        ranges = RANGES | {"correlation_length": self.lengths}
        ends = zip(*[ranges[name] for name in self.free], strict=True)
        return np.transpose([self.vector(end) for end in ends])

    def model(self, vector: Array, shares: Array) -> Model:
        """Return the model for a vector of free parameters."""
        values = {
            n: float(v) if n == "noise_share" else offset(n) + math.exp(v)
            for n, v in zip(self.free, vector, strict=True)
        }
        # A known noise has a fraction of the variance that depends
        # on the variance of the values.
        variance = values.pop("variance")
        anisotropy = values.pop("anisotropy", self.anisotropy or 1.0)
        known = min((self.noise or 0.0) ** 2 / variance, RANGES["noise_share"][1])
        noise = values.pop("noise_share", known)
        spectrum = SPECTRA[self.name](**self.fixed, **values)
        return Model(spectrum, anisotropy, noise, variance, shares)

    def vector(self, values: Sequence[float]) -> Array:
        """Return free parameters on the scale of the search."""
        pairs = zip(self.free, values, strict=True)
        logs = [v if n == "noise_share" else math.log(v - offset(n)) for n, v in pairs]
        return np.array(logs)

    def vector_of(self, model: Model) -> Array:
        """Return the vector for a model."""
        return self.vector(list(self.of(model).values()))

    def of(self, model: Model) -> dict[str, float]:
        """Return the free parameters of a model."""
        owners = {name: model.spectrum for name in ("correlation_length", "exponent")}
        return {name: float(getattr(owners.get(name, model), name)) for name in self.free}

    def at_end(self, model: Model) -> dict[str, float]:
        """Return the spectrum parameters that lie at an end of their range."""
        # The scale of the search is logarithmic, so both ends count alike.
        aside = np.abs(self.limits - self.vector_of(model)[:, None]).min(axis=1)
        near = aside < AT_END * np.ptp(self.limits, axis=1)
        pairs = zip(self.of(model).items(), near, strict=True)
        return {name: value for (name, value), end in pairs if end and name in OF_SPECTRUM}


class Whittle(NamedTuple):
    """The likelihood of periodograms, given a parameter vector."""

    family: SpectrumFamily
    shares: Array
    observed: Sequence[Observed]

    def of(self, expected: Sequence[Array]) -> float:
        """Return the log likelihood, -inf if an expectation is negative (step 4)."""
        value = 0.0
        for group, e in zip(self.observed, expected, strict=True):
            lifted = e + group.floor
            if lifted.min() <= 0.0:
                return -math.inf
            terms = np.log(lifted) + (group.average + group.floor) / lifted
            value -= group.records * float(np.sum(group.window.weights * terms))
        return value

    def coarse(self) -> Array:
        """Return the best point on a coarse parameter grid (step 5)."""
        lengths = np.geomspace(*self.family.lengths, 17)[:-2].tolist()
        tried = TRIED | {"correlation_length": lengths}
        windows = [group.window for group in self.observed]

        def total(powers: Iterable[Array]) -> float:
            pairs = zip(windows, powers, strict=True)
            return sum(float(np.sum(window.weights * power)) for window, power in pairs)

        power = total(group.average for group in self.observed)
        best, most = np.zeros(0), -math.inf
        for values in itertools.product(*[tried[name] for name in self.family.free]):
            at = self.family.vector(values)
            model = self.family.model(at, self.shares)
            expected = [model.expectation(window) for window in windows]
            # The variance needs no grid: the total power fixes it.
            scale = power / total(expected)
            value = self.of([scale * e for e in expected])
            if value > most:
                best, most = at, value
                best[0] = math.log(scale)
        return best

    def fit(self, start: Array) -> tuple[Array, tuple[Model, list[Array]]]:
        """Return the vector with the greatest likelihood, from a start, and the state there."""
        limits = self.family.limits
        return climb(start, limits, self.value, self.score, longest=LONGEST, settled=SETTLED)

    def value(self, at: Array) -> tuple[float, tuple[Model, list[Array]]]:
        """Return the log likelihood, and model and signals for its derivatives."""
        model = self.family.model(at, self.shares)
        signals = [model.signal(one.window) for one in self.observed]
        pairs = zip(self.observed, signals, strict=True)
        value = self.of([model.expectation(one.window, signal) for one, signal in pairs])
        return value, (model, signals)

    def score(self, at: Array, state: tuple[Model, list[Array]]) -> tuple[Array, Array]:
        """Return the score sum w d (I/E - 1) and Fisher's information sum w d d^T (step 5)."""
        family, limits = self.family, self.family.limits
        model, signals = state
        moved = {}
        for i, name in enumerate(family.free):
            if name not in ("variance", "noise_share"):
                # Only these parameters need a new signal, so their
                # slopes are differences.
                aside = at.copy()
                aside[i] += LOG_STEP if at[i] + LOG_STEP <= limits[i, 1] else -LOG_STEP
                moved[name] = family.model(aside, self.shares), aside[i] - at[i]
        result, information = np.zeros(at.size), np.zeros((at.size, at.size))
        for group, signal in zip(self.observed, signals, strict=True):
            expected = model.expectation(group.window, signal)
            # If the noise is known, its fraction falls as the variance grows.
            slopes = {
                "variance": expected if family.noise is None else model.variance * signal,
                "noise_share": model.variance * (group.window.white - signal),
            }
            scale = model.variance * (1.0 - model.noise_share)
            for name, (shifted, step) in moved.items():
                slopes[name] = scale * (shifted.signal(group.window) - signal) / step
            lifted = expected + group.floor
            d = np.stack([(slopes[name] / lifted).ravel() for name in family.free])
            weight = group.records * group.window.weights.ravel()
            result += d @ (weight * ((group.average - expected) / lifted).ravel())
            information += (d * weight) @ d.T
        return result, information

    def noise_variance(
        self, at: Array, state: tuple[Model, list[Array]]
    ) -> tuple[float, float]:
        """Return the variance of the noise, which may be negative, and its standard error.

        The error assumes independent ordinates, and is too small, but
        proportional to the true error.
        """
        model, (_, information) = state[0], self.score(at, state)
        # The noise variance is the product of two parameters, whose
        # errors are correlated.
        slope = np.zeros(at.size)
        slope[self.family.free.index("variance")] = model.noise_share * model.variance
        slope[self.family.free.index("noise_share")] = model.variance
        error = math.sqrt(float(slope @ np.linalg.pinv(information, hermitian=True) @ slope))
        return model.noise_share * model.variance, error

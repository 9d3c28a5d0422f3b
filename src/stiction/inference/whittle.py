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
    """Return the fractions of the variance in Hermite orders 0, 1, ..., and the rest.

    A lognormal field exp(s z) has the fractions s^(2n)/n! over exp(s²) - 1:

    >>> from stiction import Lognormal
    >>> square = math.log(1.0 + 0.5**2)
    >>> shares = hermite_shares(Lognormal(mean=3.0, cv=0.5))
    >>> [round(float(share), 4) for share in shares[:4]]
    [0.0, 0.8926, 0.0996, 0.0074]
    >>> [round(square**n / math.factorial(n) / 0.25, 4) for n in (1, 2, 3)]
    [0.8926, 0.0996, 0.0074]
    """
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
    """Return the periodograms of measured values (points,) by geometry (step 1).

    Two records share a window, in the first and the last place:

    >>> short, long = (RecordWindow((0.5,), np.ones(n, dtype=bool)) for n in (16, 32))
    >>> rows = [np.arange(16.0) ** 2, np.arange(32.0) % 5, np.arange(16.0) % 3]
    >>> first, second = periodograms_of(rows, [short, long, short])
    >>> first.records, second.records, first.window is short
    (2, 1, True)
    >>> mean = 0.5 * (short.periodogram(rows[0]) + short.periodogram(rows[2]))
    >>> bool(np.allclose(first.average, mean))
    True

    The floor is a thousandth of the highest average over five neighbours:

    >>> padded = np.pad(mean, 2, mode="edge")
    >>> highest = max(padded[k : k + 5].mean() for k in range(mean.size))
    >>> round(first.floor / float(highest), 9)
    0.001
    """
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

    >>> Model(None, 1.0, 0.25, 16.0, None).noise  # a quarter of the variance, 16
    2.0
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
        """Return the variance of z in each mode on the periodic grid of a window.

        >>> from types import SimpleNamespace
        >>> window = SimpleNamespace(power=lambda *given: given)
        >>> Model("spectrum", 2.0, 0.0, 1.0, None).power(window)
        ('spectrum', 2.0)
        """
        return window.power(self.spectrum, self.anisotropy)

    def correlation(self, window: RecordWindow) -> Array:
        """Return the correlation of values without noise at all lags (step 2).

        A half of the variance is linear in z, and a quarter each is quadratic and
        cubic: 0.5 rho + 0.25 rho² + 0.25 rho³.

        >>> from types import SimpleNamespace
        >>> rho = np.array([1.0, 0.6, -0.2])
        >>> window = SimpleNamespace(power=lambda *given: 7.0, correlation=lambda p: p / 7.0 * rho)
        >>> model = Model(None, 1.0, 0.0, 1.0, [0.0, 0.5, 0.25, 0.25])
        >>> model.correlation(window).round(6).tolist()
        [1.0, 0.444, -0.092]
        """
        rho = window.correlation(self.power(window))
        return np.polynomial.polynomial.polyval(rho, self.shares)

    def signal(self, window: RecordWindow) -> Array:
        """Return the expected periodogram (*half) for values without noise, with variance 1.

        >>> from types import SimpleNamespace
        >>> window = SimpleNamespace(power=lambda *given: 7.0, correlation=lambda power: power,
        ...                          expectation=lambda covariance: 3.0 * covariance)
        >>> float(Model(None, 1.0, 0.0, 1.0, [0.0, 1.0]).signal(window))
        21.0
        """
        return window.expectation(self.correlation(window))

    def expectation(self, window: RecordWindow, signal: Array | None = None) -> Array:
        """Return the expected periodogram (*half), from the `signal` if it is known (step 3).

        >>> from types import SimpleNamespace
        >>> window = SimpleNamespace(white=np.array([1.0, 2.0]))
        >>> Model(None, 1.0, 0.25, 4.0, None).expectation(window, np.array([3.0, 5.0])).tolist()
        [10.0, 17.0]
        """
        signal = self.signal(window) if signal is None else signal
        share = self.noise_share
        return self.variance * ((1.0 - share) * signal + share * window.white)


def offset(name: str) -> float:
    """Return the origin for the logarithm of a parameter, so that its error is about normal.

    >>> offset("exponent"), offset("spectrum.exponent"), offset("correlation_length")
    (0.5, 0.5, 0.0)
    """
    return 0.5 if name.endswith("exponent") else 0.0


def spectrum_family(given: Any) -> tuple[str, dict[str, float]]:
    """Return the name and the fixed parameters of a spectrum family, after checks.

    >>> spectrum_family("exponential")
    ('exponential', {})
    >>> spectrum_family({"type": "power_law", "exponent": 2})
    ('power_law', {'exponent': 2.0})
    """
    table = family_table(given)
    if "power_kept" in table:
        raise InputError("power_kept: a fit covers the whole spectrum. Leave it out")
    name = from_table(SPECTRA, {"correlation_length": 1.0} | table).type
    return name, {key: float(value) for key, value in table.items() if key != "type"}


@dataclass(frozen=True, eq=False)
class SpectrumFamily:
    """A family of spectra with fixed parameters.

    Parameters with the value None are estimated.

    Parameters that are not given are free. Only a power law has an exponent:

    >>> SpectrumFamily("power_law", {}, None, None, (0.01, 4.0)).free
    ('variance', 'correlation_length', 'exponent', 'anisotropy', 'noise_share')
    >>> SpectrumFamily("power_law", {"exponent": 2.0}, 1.0, None, (0.01, 4.0)).free
    ('variance', 'correlation_length', 'noise_share')
    >>> family = SpectrumFamily("exponential", {}, None, 0.0, (0.01, 4.0))
    >>> family.free
    ('variance', 'correlation_length', 'anisotropy')
    >>> np.exp(family.limits[1:]).round(9).tolist()
    [[0.01, 4.0], [0.05, 20.0]]
    >>> limits = SpectrumFamily("power_law", {}, 1.0, None, (0.01, 4.0)).limits
    >>> np.exp(limits[2]).round(9).tolist(), limits[3].tolist()  # exponents less 0.5
    ([0.15, 15.5], [-0.5, 0.95])
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
        """Return the model for a vector of free parameters.

        >>> family = SpectrumFamily("power_law", {}, None, None, (0.01, 4.0))
        >>> logs = np.log([9.0, 0.2, 1.5 - 0.5, 3.0]).tolist()
        >>> model = family.model(np.array([*logs, -0.2]), "h")
        >>> model.spectrum.correlation_length, model.spectrum.exponent, model.shares
        (0.2, 1.5, 'h')
        >>> round(model.variance, 9), round(model.anisotropy, 9), model.noise_share
        (9.0, 3.0, -0.2)

        A noise that is known, 3, is a quarter of the variance 36, and at most 95 %:

        >>> family = SpectrumFamily("exponential", {}, 2.0, 3.0, (0.01, 4.0))
        >>> models = [family.model(family.vector([v, 0.2]), None) for v in (36.0, 4.0)]
        >>> [(round(model.noise_share, 9), model.anisotropy) for model in models]
        [(0.25, 2.0), (0.95, 2.0)]
        """
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
        """Return free parameters on the scale of the search.

        >>> family = SpectrumFamily("power_law", {}, 1.0, None, (0.01, 4.0))
        >>> vector = family.vector([9.0, 0.2, 1.5, -0.2])
        >>> np.exp(vector[:3]).round(9).tolist(), float(vector[3])
        ([9.0, 0.2, 1.0], -0.2)
        """
        pairs = zip(self.free, values, strict=True)
        logs = [v if n == "noise_share" else math.log(v - offset(n)) for n, v in pairs]
        return np.array(logs)

    def vector_of(self, model: Model) -> Array:
        """Return the vector for a model.

        >>> family = SpectrumFamily("power_law", {}, 1.0, None, (0.01, 4.0))
        >>> vector = family.vector([9.0, 0.2, 1.5, -0.2])
        >>> bool(np.allclose(family.vector_of(family.model(vector, None)), vector))
        True
        """
        return self.vector(list(self.of(model).values()))

    def of(self, model: Model) -> dict[str, float]:
        """Return the free parameters of a model.

        >>> fixed = {"correlation_length": 0.2}
        >>> family = SpectrumFamily("power_law", fixed, None, None, (0.01, 4.0))
        >>> found = family.of(family.model(family.vector([9.0, 1.5, 3.0, -0.2]), None))
        >>> {name: round(value, 9) for name, value in found.items()}
        {'variance': 9.0, 'exponent': 1.5, 'anisotropy': 3.0, 'noise_share': -0.2}
        """
        owners = {name: model.spectrum for name in ("correlation_length", "exponent")}
        return {name: float(getattr(owners.get(name, model), name)) for name in self.free}

    def at_end(self, model: Model) -> dict[str, float]:
        """Return the spectrum parameters that lie at an end of their range.

        >>> family = SpectrumFamily("power_law", {}, None, None, (0.01, 4.0))
        >>> def at_end(*values):
        ...     return sorted(family.at_end(family.model(family.vector(values), None)))
        >>> at_end(9.0, 0.0101, 1.5, 3.0, 0.1), at_end(9.0, 0.01001, 15.999, 3.0, 0.1)
        ([], ['correlation_length', 'exponent'])
        >>> at_end(1e200, 0.2, 1.5, 20.0, 0.95)  # only parameters of the spectrum count
        ['anisotropy']
        """
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
        """Return the log likelihood, -inf if an expectation is negative (step 4).

        >>> from types import SimpleNamespace
        >>> def observed(weights, *others):
        ...     return Observed(SimpleNamespace(weights=np.array(weights)), *others)
        >>> both = [observed([1.0, 0.5], 2, np.array([3.0, 7.0]), 1.0),
        ...         observed([1.0], 1, np.array([0.0]), 2.0)]
        >>> value = Whittle(None, None, both).of([np.array([1.0, 3.0]), np.array([-1.0])])
        >>> by_hand = 2.0 * (math.log(2.0) + 4.0 / 2.0 + 0.5 * (math.log(4.0) + 8.0 / 4.0)) + 2.0
        >>> round(value + by_hand, 9)
        0.0
        >>> Whittle(None, None, both).of([np.array([1.0, 3.0]), np.array([-2.0])])
        -inf
        """
        value = 0.0
        for group, e in zip(self.observed, expected, strict=True):
            lifted = e + group.floor
            if lifted.min() <= 0.0:
                return -math.inf
            terms = np.log(lifted) + (group.average + group.floor) / lifted
            value -= group.records * float(np.sum(group.window.weights * terms))
        return value

    def coarse(self) -> Array:
        """Return the best point on a coarse parameter grid (step 5).

        If the periodogram equals its expectation at a point of the grid, this
        point is the best. The lengths 1, 2, 4, ... are tried:

        >>> family = SpectrumFamily("power_law", {}, 1.0, None, (1.0, 2.0**16))
        >>> shares, truth = np.array([0.0, 0.75, 0.25]), [9.0, 4.0, 2.0, 0.1]
        >>> windows = [RecordWindow((0.5,), np.ones(n, dtype=bool)) for n in (48, 32)]
        >>> model = family.model(family.vector(truth), shares)
        >>> seen = [Observed(window, 1, model.expectation(window), 1e-9) for window in windows]
        >>> best = Whittle(family, shares, seen).coarse()
        >>> bool(np.allclose(best, family.vector(truth)))
        True
        """
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
        """Return the vector with the greatest likelihood, from a start, and the state there.

        >>> family = SpectrumFamily("power_law", {"exponent": 2.0}, 1.0, None, (1.0, 64.0))
        >>> shares, truth = np.array([0.0, 0.75, 0.25]), [9.0, 4.4, 0.15]
        >>> window = RecordWindow((0.5,), np.ones(48, dtype=bool))
        >>> expected = family.model(family.vector(truth), shares).expectation(window)
        >>> whittle = Whittle(family, shares, [Observed(window, 100, expected, 1e-9)])
        >>> best, (model, _) = whittle.fit(family.vector([7.0, 6.0, 0.1]))
        >>> [round(value, 1) for value in family.of(model).values()]
        [9.0, 4.4, 0.1]
        """
        limits = self.family.limits
        return climb(start, limits, self.value, self.score, longest=LONGEST, settled=SETTLED)

    def value(self, at: Array) -> tuple[float, tuple[Model, list[Array]]]:
        """Return the log likelihood, and model and signals for its derivatives.

        >>> family = SpectrumFamily("exponential", {}, 1.0, None, (1.0, 64.0))
        >>> window = RecordWindow((0.5,), np.ones(48, dtype=bool))
        >>> whittle = Whittle(family, [0.0, 1.0], [Observed(window, 3, window.white, 0.5)])
        >>> value, (model, signals) = whittle.value(family.vector([9.0, 4.4, 0.15]))
        >>> round(value - whittle.of([model.expectation(window)]), 9)
        0.0
        >>> round(model.spectrum.correlation_length, 9)
        4.4
        >>> bool(np.allclose(signals[0], model.signal(window)))
        True
        """
        model = self.family.model(at, self.shares)
        signals = [model.signal(one.window) for one in self.observed]
        pairs = zip(self.observed, signals, strict=True)
        value = self.of([model.expectation(one.window, signal) for one, signal in pairs])
        return value, (model, signals)

    def score(self, at: Array, state: tuple[Model, list[Array]]) -> tuple[Array, Array]:
        """Return the score sum w d (I/E - 1) and Fisher's information sum w d d^T (step 5).

        The score is the slope of the likelihood, here on a plane, and with a known
        noise on a line:

        >>> shares = np.array([0.0, 0.75, 0.25])
        >>> def slopes(family, window, values):
        ...     power = window.periodogram(np.arange(float(window.measured.sum())) % 7)
        ...     whittle = Whittle(family, shares, [Observed(window, 3, power, 0.01)])
        ...     at = family.vector(values)
        ...     score, _ = whittle.score(at, whittle.value(at)[1])
        ...     differences = [
        ...         (whittle.value(at + step)[0] - whittle.value(at - step)[0]) / 2e-4
        ...         for step in 1e-4 * np.eye(at.size)
        ...     ]
        ...     return bool(np.allclose(score, differences, rtol=0.01, atol=0.01))
        >>> plane = RecordWindow((0.5, 0.4), np.ones((12, 10), dtype=bool))
        >>> family = SpectrumFamily("power_law", {}, None, None, (0.1, 9.0))
        >>> slopes(family, plane, [5.0, 2.0, 1.7, 1.3, 0.2])
        True
        >>> line = RecordWindow((0.5,), np.ones(48, dtype=bool))
        >>> slopes(SpectrumFamily("exponential", {}, 1.0, 1.1, (0.1, 9.0)), line, [5.0, 2.0])
        True
        >>> slopes(SpectrumFamily("exponential", {}, 1.0, 1.1, (0.1, 2.0)), line, [5.0, 2.0])
        True

        The information is the mean square of the score. For the logarithm of the
        variance alone, without a floor, each record counts once for each ordinate:

        >>> fixed = {"correlation_length": 2.0}
        >>> family = SpectrumFamily("exponential", fixed, 1.0, 0.0, (0.1, 9.0))
        >>> whittle = Whittle(family, [0.0, 1.0], [Observed(line, 3, line.white, 0.0)])
        >>> _, information = whittle.score(np.zeros(1), whittle.value(np.zeros(1))[1])
        >>> round(float(information[0, 0]), 9), 3 * float(line.weights.sum())
        (70.5, 70.5)
        """
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

        >>> family = SpectrumFamily("exponential", {}, 1.0, None, (0.1, 9.0))
        >>> window = RecordWindow((0.5,), np.ones(48, dtype=bool))
        >>> at = family.vector([5.0, 2.0, 0.2])
        >>> whittle = Whittle(family, [0.0, 1.0], [Observed(window, 3, window.white, 0.01)])
        >>> state = whittle.value(at)[1]
        >>> noise, error = whittle.noise_variance(at, state)
        >>> inverse = np.linalg.inv(whittle.score(at, state)[1])
        >>> slope = np.array([5.0 * 0.2, 0.0, 5.0])  # by log variance and by the fraction
        >>> round(noise, 9), round(float(error / math.sqrt(slope @ inverse @ slope)), 6)
        (1.0, 1.0)
        """
        model, (_, information) = state[0], self.score(at, state)
        # The noise variance is the product of two parameters, whose
        # errors are correlated.
        slope = np.zeros(at.size)
        slope[self.family.free.index("variance")] = model.noise_share * model.variance
        slope[self.family.free.index("noise_share")] = model.variance
        error = math.sqrt(float(slope @ np.linalg.pinv(information, hermitian=True) @ slope))
        return model.noise_share * model.variance, error

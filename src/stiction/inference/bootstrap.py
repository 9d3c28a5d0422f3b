"""Fits of a marginal, a spectrum and noise, and intervals from fits to simulated records."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.progress import Meter, Show
from stiction.ensemble.batches import in_threads, usable_cores
from stiction.inference.between import as_of_one, levels_of, scatter_between
from stiction.inference.marginal_fit import Family, distance, with_parameters
from stiction.inference.whittle import (
    RANGES,
    Model,
    Observed,
    SpectrumFamily,
    Whittle,
    hermite_shares,
    observe,
    origin,
)
from stiction.inference.window import RecordWindow
from stiction.random.fields import RandomField
from stiction.random.mapping import from_normal

FEWEST = 20
"""Number of repetitions that determine a tail of errors."""
NEGLIGIBLE = 1e-4
"""Share of noise that does not change a marginal."""
LAGS = np.concatenate(([0.0], np.geomspace(0.01, 4.0, 400)))
"""Lags in correlation lengths; the correlation of every spectrum falls to 1/e within them."""
NAMES = {name: f"spectrum.{name}" for name in ("correlation_length", "exponent")}
NAMES["anisotropy"] = "anisotropy"
"""Estimated parameters of a spectrum, by their names in study files."""
PLACES = ("mean", "marginal.mean", "marginal.loc")
"""Parameters of location."""
SIDES = {"marginal.low": -1.0, "marginal.high": 1.0}
"""Side of the mean on which a bound lies."""
SAME = 1e-3
"""Distance within which an interval is uninformative, as a share of an end of a range."""
LEAST_LEFT = 0.2
"""Least share of the variance that is taken to be left by mean and trend."""
ROUNDS = 2
"""In each, the error of the field's share in the scatter of means falls to that share of it."""


@dataclass(frozen=True, eq=False)
class FitSetting:
    """Families to fit, and a window for each record (equal windows are shared)."""

    windows: tuple[RecordWindow, ...]
    marginal: Family
    spectrum: SpectrumFamily
    between: bool = False


@dataclass(frozen=True, eq=False)
class Estimate:
    """The result of one fit."""

    setting: FitSetting
    marginal: Any  # of the field
    own: Any  # of the values, from which mean and trend have taken variance
    model: Model
    distance: float  # Kolmogorov's, between values and marginal
    roughness: float  # mean square of log(periodogram/expectation), both averaged over bands
    noise: tuple[float, float]  # its variance, which may be negative, and the error of that
    between: float = 0.0  # coefficient of variation of the factor between specimens

    @cached_property
    def parameters(self) -> dict[str, float]:
        """All estimated parameters, and what follows from them, by name."""
        spectrum = self.model.spectrum
        if self.model.end_seen or not hasattr(spectrum, "untruncated_correlation"):
            efolding = spectrum.efolding_length
        else:
            lags = spectrum.correlation_length * LAGS
            correlation = spectrum.untruncated_correlation(lags)
            efolding = float(np.interp(-math.exp(-1.0), -correlation, lags))
        values = {
            "efolding_length": efolding,
            "mean": float(self.marginal.distribution.mean()),
            "standard_deviation": float(self.marginal.distribution.std()),
        }
        own = self.setting.marginal.parameters(self.marginal)
        values |= {f"marginal.{name}": value for name, value in own.items()}
        free = self.setting.spectrum.of(self.model)
        values |= {NAMES[name]: value for name, value in free.items() if name in NAMES}
        if "noise_share" in free:
            values["noise"] = self.model.noise
        return values

    def field(self, quantity: str) -> RandomField:
        """Return the field to simulate with."""
        anisotropy = self.model.anisotropy if self.model.anisotropy != 1.0 else None
        of: Any = quantity if quantity == "friction_coefficient" else None
        return RandomField(
            self.marginal, self.model.spectrum, mean_mode=True, anisotropy=anisotropy, of=of
        )

    def simulate(self, rng: np.random.Generator) -> list[Array]:
        """Simulate records with their noise: measured values (points,) of each."""
        windows = self.setting.windows
        power = {window: self.model.power(window) for window in dict.fromkeys(windows)}
        rows = []
        for window in windows:
            field = from_normal(self.marginal, window.sample(power[window], rng))
            noise = self.model.noise * rng.standard_normal(field.size)
            rows.append(window.without_trend(field + noise))
        if not self.between:
            return rows
        variance = math.log1p(self.between**2)
        scatter = math.sqrt(variance) * rng.standard_normal(len(rows)) - 0.5 * variance
        return [row * factor for row, factor in zip(rows, np.exp(scatter), strict=True)]

    @property
    def within(self) -> Array:
        """Variance of the logarithm of the mean of each record from the field alone."""
        own = self.parameters["standard_deviation"] / self.parameters["mean"]
        windows, model = self.setting.windows, self.model
        shares = {w: w.variance_of_mean(model.correlation(w)) for w in set(windows)}
        result: Array = np.log1p(own**2 * np.array([shares[window] for window in windows]))
        return result

    @property
    def independent(self) -> float:
        """Number of independent values that tell families of the marginal apart as well.

        Families fitted to the same values agree in about mean and variance; the logarithm of the
        ratio of their densities then has Hermite orders of z from 3 on. Its sum over N values with
        correlations rho_ij has mean and variance of that over N^2/sum rho_ij^3 independent ones.
        """
        points, alike = 0.0, 0.0
        for window, count in Counter(self.setting.windows).items():
            rho = (1.0 - self.model.noise_share) * self.model.correlation(window)
            rho.flat[0] = 1.0
            points += count * float(window.measured.sum())
            alike += count * float(np.sum(window.pairs * rho**3))
        return points**2 / max(alike, points)

    def as_of_one(self, rows: Sequence[Array]) -> list[Array]:
        """Return records without the scatter between specimens, if that is estimated."""
        return as_of_one(rows, self.within) if self.setting.between else list(rows)


def estimate(
    rows: Sequence[Array], setting: FitSetting, start: Estimate | None = None
) -> Estimate:
    """Fit measured values (points,) of each record, without trend; from a start if there is one.

    Records of several specimens are scaled by what the fit itself finds of the field's own share
    in the scatter of their means, in a few rounds.
    """
    if not setting.between:
        return _estimate(rows, setting, start)
    equal = as_of_one(rows, np.zeros(len(rows)))
    found = start or _estimate(equal, setting, None)
    for _ in range(ROUNDS):
        found = _estimate(found.as_of_one(rows), setting, found)
    between, *_ = scatter_between(np.log(levels_of(rows)), found.within, 0.5)
    return replace(found, between=between)


def _estimate(rows: Sequence[Array], setting: FitSetting, start: Estimate | None) -> Estimate:
    """Fit records of one field.

    The noise is found with the marginal of the values, which it widens; then both are fitted again.
    """
    family = setting.spectrum
    values = np.concatenate(rows)
    observed = observe(rows, setting.windows)
    vector: Any = None
    marginal, noise = None, family.noise or 0.0
    if start is not None:
        vector = family.vector_of(start.model)
        marginal, noise = start.marginal, start.model.noise
    for _ in range(2):
        marginal = own = setting.marginal.fit(values, noise, marginal)
        likelihood = Whittle(family, hermite_shares(marginal), observed)
        vector = likelihood.fit(likelihood.coarse() if vector is None else vector)
        model = family.model(vector, likelihood.shares)
        if model.noise_share < 0.0:  # zero is the best possible
            without = likelihood._replace(family=replace(family, noise=0.0))
            model = without.family.model(without.fit(vector[:-1]), likelihood.shares)
        if abs(model.noise**2 - noise**2) < NEGLIGIBLE * model.variance:
            break
        noise = model.noise
    ratios = [
        math.log((measured + one.floor) / (predicted + one.floor))
        for one in observed
        for _, measured, predicted in bands(one, model.expectation(one.window))
    ]
    return Estimate(
        setting=setting,
        marginal=setting.marginal.widened(own, _left(setting.windows, model) ** -0.5),
        own=own,
        model=model,
        distance=distance(own, setting.marginal.quiet(values, model.noise)),
        roughness=float(np.mean(np.square(ratios))),
        noise=likelihood.noise_variance(vector) if family.noise is None else (0.0, 0.0),
    )


def _left(windows: Sequence[RecordWindow], model: Model) -> float:
    """Return the share of its variance that a field is expected to show about mean and trend.

    Of N values v with correlation R it is tr(M R)/N, with M the projection that takes the trend of
    each record, and the mean of all, from them.
    """
    taken, mean, points = 0.0, 0.0, 0.0
    for window, count in Counter(windows).items():
        correlation, size = model.correlation(window), float(window.measured.sum())
        points += count * size
        taken += count * window.taken_by_trend(correlation)
        mean += count * size**2 * window.variance_of_mean(correlation)
    return max(1.0 - (taken + mean / points) / points, LEAST_LEFT)


def bands(one: Observed, expected: Array, per_octave: int = 3) -> Array:
    """Return wavenumber (rad/m), periodogram and expectation averaged over bands, (bands, 3)."""
    weights = one.window.weights
    k = np.broadcast_to(np.sqrt(sum(v**2 for v in one.window.wave_vectors)), weights.shape)
    kept = weights > 0.0
    k = k[kept]
    band = np.unique(np.round(per_octave * np.log2(k / k.min())), return_inverse=True)[1]
    sums = [np.bincount(band, weights=w) for w in (k, one.average[kept], expected[kept])]
    means: Array = np.transpose(sums) / np.bincount(band)[:, None]
    return means


class Repetitions(NamedTuple):
    """A field, and fits to records simulated from it."""

    truth: Estimate
    fits: list[Estimate]


def bootstrapped(
    found: Estimate,
    count: int,
    confidence: float,
    seed: int,
    progress: Show,
    workers: int | None = None,
    others: Sequence[tuple[Estimate, int]] = (),
) -> tuple[list[Repetitions], list[Repetitions]]:
    """Fit records simulated from an estimate, and from it `at_ends` of its correlation length.

    Also from `others`, each with its own number of repetitions. Those to which the family cannot
    be fitted are missing.
    """

    def repeat(truth: Estimate, count: int = count) -> Repetitions:
        def one(number: int) -> Estimate | None:
            rng = np.random.default_rng([seed, number])
            try:
                again = estimate(truth.simulate(rng), truth.setting, truth)
            except InputError:
                return None
            meter.advance()
            return again

        results = in_threads(one, range(count), workers or usable_cores())
        fits = [result for result in results if result is not None]
        if len(fits) < FEWEST:
            raise InputError(
                f"marginal: {truth.setting.marginal.name!r} could be fitted to only {len(fits)} of"
                f" {count} repetitions; take another marginal"
            )
        return Repetitions(truth, fits)

    ends = "correlation_length" in found.setting.spectrum.free
    total = (3 if ends else 1) * count + sum(number for _, number in others)
    with Meter("fit_field", total, progress) as meter:
        repeated = [repeat(found)]
        if ends:
            repeated += [repeat(truth) for truth in at_ends(repeated[0], confidence)]
        return repeated, [repeat(*other) for other in others]


def at_ends(around: Repetitions, confidence: float) -> list[Estimate]:
    """Return the field with its correlation length at either end of a first interval."""
    found, family = around.truth, around.truth.setting.spectrum
    place = family.free.index("correlation_length")
    moved = []
    scale, tail = Scale("spectrum.correlation_length"), 0.5 * (1.0 - confidence)
    for share in (1.0 - tail, tail):
        vector = family.vector_of(found.model)
        vector[place] = np.clip(scale.end(found, around, share), *family.limits[place])
        moved.append(replace(found, model=family.model(vector, found.model.shares)))
    return moved


class Scale(NamedTuple):
    """Scale on which the error of a parameter is about normal: a logarithm, unless `linear`.

    For bounds of a marginal it is the logarithm of the distance from the mean; for the noise it is
    the variance, which may be negative: estimates at zero would all have an error of zero.
    """

    name: str
    linear: bool = False

    def _from(self, values: Mapping[str, float]) -> tuple[float, float]:
        """Origin of the logarithm, and the side of it on which the parameter lies."""
        if self.name in SIDES:
            return values["mean"], SIDES[self.name]
        return origin(self.name), 1.0

    def of(self, one: Estimate) -> tuple[float, float]:
        """Return an estimate on this scale, and a quantity to which its error is in proportion."""
        if self.name == "noise":
            return one.noise
        (start, side), value = self._from(one.parameters), one.parameters[self.name]
        width = math.sqrt(one.parameters["efolding_length"])
        if self.name in PLACES:
            width *= one.parameters["standard_deviation"]
        if self.linear:
            return value, width
        return math.log(max(side * (value - start), 1e-300)), width

    def back(self, scaled: float, values: Mapping[str, float]) -> float:
        """Return a parameter from this scale."""
        if self.name == "noise":
            return math.sqrt(max(scaled, 0.0))
        start, side = self._from(values)
        return scaled if self.linear else start + side * math.exp(scaled)

    def errors(self, repeated: Repetitions) -> Array:
        """Return the errors of repetitions in units of their widths."""
        truth = repeated.truth
        true = truth.model.noise**2 if self.name == "noise" else self.of(truth)[0]
        return np.array([(own - true) / wide for own, wide in map(self.of, repeated.fits)])

    def end(self, found: Estimate, repeated: Repetitions, share: float) -> float:
        """Return an estimate less a quantile of its error in units of its width."""
        at, width = self.of(found)
        return at - width * float(np.quantile(self.errors(repeated), share, method="weibull"))


def scale_of(name: str, repeated: Sequence[Repetitions]) -> Scale:
    """Return the scale of a parameter, linear if it was found negative."""
    least = min(one.parameters[name] for own in repeated for one in (own.truth, *own.fits))
    return Scale(name, name in PLACES or (name not in SIDES and least < 0.0))


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
    found, estimated = around.truth, around.truth.parameters
    tail = 0.5 * (1.0 - confidence)
    lengths = [math.log(one.parameters["efolding_length"]) for one in around.fits]
    result = {}
    for name in estimated:
        scale = scale_of(name, repeated)
        shorter, longer = moved if moved and name != "noise" else (around, around)
        if np.cov([scale.of(one)[0] for one in around.fits], lengths)[0, 1] < 0.0:
            shorter, longer = longer, shorter
        low, high = scale.end(found, shorter, 1.0 - tail), scale.end(found, longer, tail)
        if name == "noise" and high <= 0.0:  # by chance: as wide as of an estimate of zero
            high -= found.noise[0]
        first, last = sorted(scale.back(end, estimated) for end in (low, high))
        result[name] = first, last
    noise = result["noise"][1] if "noise" in result else found.model.noise
    limits = limits_of(found, values, noise)
    for name in limits.keys() & result.keys():
        ends = limits[name]
        low, high = np.clip(result[name], *ends).tolist()
        if high - low <= (SAME * high if np.isfinite(ends).all() else 0.0):  # nothing is left
            low, high = (end if math.isfinite(end) else estimated[name] for end in ends)
        result[name] = low, high
    return result


def limits_of(found: Estimate, values: Array, noise: float) -> dict[str, tuple[float, float]]:
    """Return the limits of parameters, with bounds of the marginal outside of all values."""
    estimated = found.parameters
    quiet = found.setting.marginal.quiet(values, noise)
    bottom, top = (float(end) for end in found.marginal.distribution.support())
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


def likely(repeated: Repetitions, measured: Array) -> list[Estimate]:
    """Return estimates as likely as the one found: it less the error of each repetition."""
    found = repeated.truth
    limits = limits_of(found, measured, found.model.noise)
    moved: dict[str, Array] = {}
    for name in found.parameters:
        if name == "mean" or name.startswith("marginal.") or name in NAMES.values():
            scale = scale_of(name, [repeated])
            at, width = scale.of(found)
            places = (at - width * scale.errors(repeated)).tolist()
            means = moved.get("mean", places)  # bounds lie at distances from them
            values = [scale.back(p, {"mean": m}) for p, m in zip(places, means, strict=True)]
            moved[name] = np.clip(values, *limits.get(name, (-math.inf, math.inf)))
    result = []
    for number in range(len(repeated.fits)):
        own = {name: float(value[number]) for name, value in moved.items()}
        parts: dict[str, dict[str, float]] = {"marginal": {}, "spectrum": {}}
        for name, value in own.items():
            part, _, last = name.rpartition(".")
            parts.setdefault(part, {})[last] = value
        model = found.model._replace(
            spectrum=replace(found.model.spectrum, **parts["spectrum"]),
            anisotropy=own.get("anisotropy", found.model.anisotropy),
        )
        marginal = with_parameters(found.marginal, parts["marginal"])
        result.append(replace(found, marginal=marginal, model=model))
    return result

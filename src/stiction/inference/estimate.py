"""One fit: records to a marginal, a spectrum and a share of noise; and records from those."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.inference.marginal_fit import Family, distance
from stiction.inference.spectral_model import Grid
from stiction.inference.spectrum_fit import (
    SpectrumFamily,
    coarse,
    fit_spectrum,
    noise_variance,
)
from stiction.inference.whittle import Model, Observed, hermite_shares, make_observed
from stiction.inference.window import Window
from stiction.random.mapping import from_normal
from stiction.random.random_field import RandomField

NEGLIGIBLE = 1e-4
"""Share of noise that does not change a marginal."""
LAGS = np.concatenate(([0.0], np.geomspace(0.01, 4.0, 400)))
"""In correlation lengths; every spectrum has its 1/e there."""


@dataclass(frozen=True, eq=False)
class Setting:
    """What is fitted to what: families, and a window for each record (equal ones are shared)."""

    windows: tuple[Window, ...]
    marginal: Family
    spectrum: SpectrumFamily

    def parameters_of(self, marginal: Any, model: Model) -> dict[str, float]:
        """Everything that is estimated, and what follows from it, by name."""
        spectrum = model.spectrum
        lags = spectrum.correlation_length * LAGS
        correlation = spectrum.untruncated_correlation(lags)
        values = {
            "efolding_length": float(np.interp(-math.exp(-1.0), -correlation, lags)),
            "mean": float(marginal.distribution.mean()),
            "standard_deviation": float(marginal.distribution.std()),
        }
        own = self.marginal.parameters(marginal)
        values |= {f"marginal.{name}": value for name, value in own.items()}
        free = self.spectrum.free
        for name in ("correlation_length", "exponent"):
            if name in free:
                values[f"spectrum.{name}"] = getattr(spectrum, name)
        if "anisotropy" in free:
            values["anisotropy"] = model.anisotropy
        if "noise_share" in free:
            values["noise"] = model.noise
        return values


@dataclass(frozen=True, eq=False)
class Estimate:
    """The result of one fit.

    Attributes
    ----------
    marginal : marginal
    model : Model
    parameters : dict of str to float
        See `Setting.parameters_of`.
    distance : float
        Kolmogorov's, between the values and the marginal.
    roughness : float
        How far the periodogram, averaged over bands, lies from its expectation: mean square of
        the logarithm of the ratio.
    noise : (float, float)
        Variance of the noise, negative where even less than none would suit better, and its
        standard error; 0 where it is known.
    """

    marginal: Any
    model: Model
    parameters: dict[str, float]
    distance: float
    roughness: float
    noise: tuple[float, float] = (0.0, 0.0)

    def field(self, quantity: str) -> RandomField:
        """To simulate with."""
        anisotropy = self.model.anisotropy if self.model.anisotropy != 1.0 else None
        of: Any = quantity if quantity == "friction_coefficient" else None
        return RandomField(
            self.marginal, self.model.spectrum, mean_mode=True, anisotropy=anisotropy, of=of
        )


def observe(rows: Sequence[Array], windows: Sequence[Window]) -> list[Observed]:
    """Periodograms of measured values (points,), by geometry."""
    powers: dict[Window, list[Array]] = {}
    for row, window in zip(rows, windows, strict=True):
        powers.setdefault(window, []).append(window.periodogram(row))
    return [make_observed(window, np.stack(own)) for window, own in powers.items()]


def estimate(
    rows: Sequence[Array], setting: Setting, start: Estimate | None = None
) -> Estimate:
    """Fit measured values (points,) of each record, without trend; from a start if there is one.

    The marginal of noisy values is too wide. So the noise is found first, with the marginal of the
    values as they are; then both are fitted again, the marginal to values less that noise.
    """
    family = setting.spectrum
    values = np.concatenate(rows)
    observed = observe(rows, setting.windows)
    vector, marginal, noise = None, None, family.noise or 0.0
    if start is not None:
        vector, marginal, noise = family.vector(start.model), start.marginal, start.model.noise
    signed = (0.0, 0.0)
    for _ in range(2):
        marginal = setting.marginal.fit(values, noise, marginal)
        shares = hermite_shares(marginal)
        if vector is None:
            vector = coarse(family, shares, observed)
        vector = fit_spectrum(family, shares, observed, vector)
        model = family.model(vector, shares)
        if family.noise is None:
            signed = noise_variance(family, vector, shares, observed)
        if model.noise_share < 0.0:  # the best there can be is none
            without = replace(family, noise=0.0)
            model = without.model(fit_spectrum(without, shares, observed, vector[:-1]), shares)
        if abs(model.noise**2 - noise**2) < NEGLIGIBLE * model.variance:
            break
        noise = model.noise
    return Estimate(
        marginal=marginal,
        model=model,
        parameters=setting.parameters_of(marginal, model),
        distance=distance(marginal, setting.marginal.quiet(values, model.noise)),
        roughness=_roughness(model, observed),
        noise=signed,
    )


def _roughness(model: Model, observed: Sequence[Observed]) -> float:
    ratios = [
        math.log((measured + one.floor) / (predicted + one.floor))
        for one in observed
        for _, measured, predicted in bands(one, model.expectation(one))
    ]
    return float(np.mean(np.square(ratios)))


def bands(one: Observed, expected: Array, per_octave: int = 3) -> Array:
    """Wavenumber (rad/m), periodogram and expectation averaged over bands, (bands, 3)."""
    k = np.broadcast_to(np.sqrt(sum(v**2 for v in one.window.wave_vectors)), one.weights.shape)
    kept = one.weights > 0.0
    k = k[kept]
    band = np.unique(np.round(per_octave * np.log2(k / k.min())), return_inverse=True)[1]
    sums = [np.bincount(band, weights=w) for w in (k, one.average[kept], expected[kept])]
    means: Array = np.transpose(sums) / np.bincount(band)[:, None]
    return means


def simulate(found: Estimate, setting: Setting, rng: np.random.Generator) -> list[Array]:
    """Records of a fitted field, with its noise: measured values (points,) of each."""
    power: dict[Window, Array] = {}
    rows = []
    for window in setting.windows:
        grid = Grid(window.shape, window.spacings)
        if window not in power:
            power[window] = found.model.power(grid)
        z = grid.sample(power[window], rng)[window.measured]
        values = from_normal(found.marginal, z) + found.model.noise * rng.standard_normal(
            z.size
        )
        rows.append(window.without_trend(values))
    return rows

"""One fit: records to a marginal, a spectrum and a share of noise; and records from those."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.inference.marginal_fit import Family, distance
from stiction.inference.records import Record
from stiction.inference.spectral_model import Grid
from stiction.inference.spectrum_fit import (
    SpectrumFamily,
    coarse,
    fit_spectrum,
    noise_variance,
)
from stiction.inference.whittle import Model, Observed, hermite_shares, make_observed
from stiction.inference.window import Window, make_window, without_trend
from stiction.random.mapping import from_normal
from stiction.random.random_field import RandomField

NEGLIGIBLE = 1e-4
"""Share of noise that does not change a marginal."""


@dataclass(frozen=True, eq=False)
class Setting:
    """What is fitted to what.

    Attributes
    ----------
    windows : tuple of Window
        One a record; records of one geometry share one.
    marginal : Family
    spectrum : SpectrumFamily
    degree : int
        Of the trend that is removed.
    """

    windows: tuple[Window, ...]
    marginal: Family
    spectrum: SpectrumFamily
    degree: int


def make_windows(records: Sequence[Record], degree: int) -> tuple[Window, ...]:
    """A window for each record."""
    made: dict[Any, Window] = {}
    for record in records:
        if record.geometry not in made:
            shape = record.values.shape
            made[record.geometry] = make_window(shape, record.spacings, record.measured, degree)
    return tuple(made[record.geometry] for record in records)


@dataclass(frozen=True, eq=False)
class Estimate:
    """The result of one fit.

    Attributes
    ----------
    marginal : marginal
    model : Model
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


def detrended(values: Array, window: Window, degree: int) -> Array:
    """Measured values (points,) without their trend but with their mean."""
    if degree == 0:
        return values
    result: Array = without_trend(values, window.basis) + values.mean()
    return result


def observe(rows: Sequence[Array], windows: Sequence[Window]) -> list[Observed]:
    """Periodograms of measured values, by geometry."""
    found: list[Observed] = []
    for window in dict.fromkeys(windows):
        powers = [
            window.periodogram(row) for row, w in zip(rows, windows, strict=True) if w is window
        ]
        found.append(make_observed(window, np.stack(powers)))
    return found


def estimate(rows: Sequence[Array], setting: Setting, start: Estimate | None = None) -> Estimate:
    """Fit measured values (points,) of each record; from a start if there is one.

    The marginal of noisy values is too wide. So the noise is found first, with the marginal of the
    values as they are; then both are fitted again, the marginal to values less that noise.
    """
    family = setting.spectrum
    rows = [detrended(r, w, setting.degree) for r, w in zip(rows, setting.windows, strict=True)]
    values = np.concatenate(rows)
    observed = observe(rows, setting.windows)
    vector = None if start is None else family.vector(start.model)
    marginal = None if start is None else start.marginal
    noise = 0.0 if start is None else start.model.noise
    if start is None and family.noise is not None:
        noise = family.noise
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
        distance=distance(marginal, setting.marginal.quiet(values, model.noise)),
        roughness=_roughness(model, observed),
        noise=signed,
    )


def _roughness(model: Model, observed: Sequence[Observed]) -> float:
    total, count = 0.0, 0
    for one in observed:
        for _, measured, predicted, _ in bands(one, model.expectation(one)):
            total += math.log((measured + one.floor) / (predicted + one.floor)) ** 2
            count += 1
    return total / max(count, 1)


def bands(
    one: Observed, expected: Array, per_octave: int = 3
) -> list[tuple[float, float, float, int]]:
    """Periodogram and its expectation averaged over bands of wavenumbers.

    Returns
    -------
    list of (wavenumber (rad/m), periodogram, expectation, ordinates)
    """
    vectors = one.window.wave_vectors
    k = np.broadcast_to(np.sqrt(sum(v**2 for v in vectors)), one.weights.shape)
    kept = one.weights > 0.0
    k, measured, predicted = k[kept], one.average[kept], expected[kept]
    band = np.round(per_octave * np.log2(k / k.min())).astype(np.int64)
    return [
        (
            float(k[at].mean()),
            float(measured[at].mean()),
            float(predicted[at].mean()),
            int(at.sum()),
        )
        for at in (band == b for b in np.unique(band))
    ]


def simulate(found: Estimate, setting: Setting, rng: np.random.Generator) -> list[Array]:
    """Records of a fitted field, with its noise: measured values (points,) of each."""
    power: dict[Window, Array] = {}
    rows = []
    for window in setting.windows:
        grid = Grid(window.shape, window.spacings)
        if window not in power:
            power[window] = found.model.power(grid)
        z = grid.sample(power[window], rng)[window.measured]
        rows.append(
            from_normal(found.marginal, z) + found.model.noise * rng.standard_normal(z.size)
        )
    return rows

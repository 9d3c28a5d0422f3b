"""What a fit is judged by: five panels, from the values to their residuals."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import fft

from stiction._typing import Array
from stiction.inference.estimate import bands, simulate
from stiction.inference.whittle import Observed
from stiction.quantities import UNITS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stiction.inference.field_fit import Details, FieldFit

INK, DATA, MODEL, ALARM = "#1a1a1a", "#7a7a7a", "#2a6f97", "#c8553d"
SHOWN = 100
"""Repetitions, or simulated records, that a band is drawn from: it holds 90 % of them."""
LAGS = 2.5
"""Correlation lengths that the panel of the correlation shows."""


def draw_fit(fit: FieldFit) -> Figure:
    """Histogram and quantiles, spectrum with its band, correlation, and residuals."""
    from matplotlib.figure import Figure

    details = fit._details
    figure = Figure(figsize=(10.0, 6.2), layout="constrained")
    grid = figure.add_gridspec(2, 6)
    panels = [figure.add_subplot(grid[0, i : i + 2]) for i in (0, 2, 4)]
    panels += [figure.add_subplot(grid[1, 0:3]), figure.add_subplot(grid[1, 3:6])]
    si = UNITS[fit.quantity]
    unit, scale = ("MPa", 1e-6) if si == "Pa" else (si, 1.0)
    values = details.setting.marginal.quiet(details.values, details.estimate.model.noise)
    name = fit.quantity.replace("_", " ")
    label = name if unit == "1" else f"{name} ({unit})"
    _histogram(panels[0], fit, details, scale, label, unit)
    _quantiles(panels[1], fit, values, scale, unit)
    one = max(details.observed, key=lambda o: o.window.shape[0])
    simulated = _simulated(details, one)
    _correlation(panels[2], details, one, simulated)
    _spectrum(panels[3], details, one, simulated, unit, scale)
    _residuals(panels[4], details, one, simulated)
    for letter, panel in zip("abcde", panels, strict=True):
        panel.set_title(f"({letter})", loc="left", fontsize=9, fontweight="bold")
        panel.spines[["top", "right"]].set_visible(False)
        panel.tick_params(labelsize=8)
    return figure


def _histogram(
    axes: Any, fit: FieldFit, details: Details, scale: float, label: str, unit: str
) -> None:
    values = details.values
    axes.hist(values * scale, bins=40, density=True, color="#d9d9d9", label="measured")
    at = np.linspace(values.min(), values.max(), 400)
    spread = [one.marginal.distribution.pdf(at) for one in details.repeated[:SHOWN]]
    _band(axes, at * scale, np.array(spread) / scale)
    noisy = details.estimate.model.noise > 0.05 * fit.parameters["standard_deviation"]
    name = "fitted, without the noise" if noisy else "fitted"
    density = fit.field.marginal.distribution.pdf(at) / scale
    axes.plot(at * scale, density, color=MODEL, label=name)
    # A density that is infinite at a bound must not set the scale of the panel.
    axes.set_ylim(0.0, 1.6 * np.histogram(values * scale, bins=40, density=True)[0].max())
    axes.set_xlabel(label)
    axes.set_ylabel("density" if unit == "1" else f"density (1/{unit})")
    axes.legend(fontsize=7, frameon=False)


def _quantiles(axes: Any, fit: FieldFit, values: Array, scale: float, unit: str) -> None:
    share = (np.arange(200) + 0.5) / 200
    expected = fit.field.marginal.distribution.ppf(share) * scale
    found = np.quantile(values, share) * scale
    details = fit._details
    spread = np.array([one.marginal.distribution.ppf(share) for one in details.repeated[:SHOWN]])
    _band(axes, expected, spread * scale)
    ends = [expected[0], expected[-1]]
    axes.plot(ends, ends, color=MODEL, linewidth=1.0)
    axes.plot(expected, found, ".", color=INK, markersize=3)
    suffix = "" if unit == "1" else f" ({unit})"
    axes.set_xlabel(f"quantile of the fit{suffix}")
    axes.set_ylabel(f"quantile of the data{suffix}")


def _simulated(details: Details, one: Observed) -> list[Array]:
    """Averages of periodograms that the fitted field would have had in the same window."""
    windows = tuple(one.window for _ in one.periodograms)
    setting = replace(details.setting, windows=windows)
    rng = np.random.default_rng(0)
    return [
        np.mean([one.window.periodogram(r) for r in simulate(details.estimate, setting, rng)], 0)
        for _ in range(SHOWN)
    ]


def _correlation(axes: Any, details: Details, one: Observed, simulated: list[Array]) -> None:
    """Of the values, along x: what the window leaves of it, measured and expected."""
    length = details.estimate.model.spectrum.correlation_length
    spacing = one.window.spacings[0]
    count = int(np.clip(round(LAGS * length / spacing), 12, one.window.shape[0] // 2))
    lag = np.arange(count) * spacing * 1e3
    curves = [_covariance(p, one)[:count] for p in simulated]
    _band(axes, lag, np.array([curve / curve[0] for curve in curves]))
    model = _covariance(details.estimate.model.expectation(one), one)[:count]
    measured = _covariance(one.average, one)[:count]
    axes.plot(lag, measured / measured[0], ".", color=INK, markersize=3, label="measured")
    axes.plot(lag, model / model[0], color=MODEL, label="fitted")
    axes.axhline(0.0, color=DATA, linewidth=0.6)
    axes.set_xlabel("lag along x (mm)")
    axes.set_ylabel("correlation in the window")
    axes.legend(fontsize=7, frameon=False)


def _covariance(power: Array, one: Observed) -> Array:
    """Circular covariance along x of a periodogram."""
    found: Array = fft.irfftn(power, one.window.shape)
    return found.reshape(found.shape[0], -1)[:, 0]


def _spectrum(
    axes: Any, details: Details, one: Observed, simulated: list[Array], unit: str, scale: float
) -> None:
    cell = float(np.prod(one.window.spacings))
    factor = cell * scale**2
    model = details.estimate.model.expectation(one)
    k, expected = _columns(one, model)
    _, measured = _columns(one, one.average)
    if len(one.window.shape) == 1:
        axes.plot(
            one.window.wave_vectors[0][1:], factor * one.average[1:], color="#cccccc", linewidth=0.5
        )
    _band(axes, k, factor * np.array([_columns(one, power)[1] for power in simulated]))
    axes.plot(k, factor * expected, color=MODEL, label="fitted, through the window")
    axes.plot(k, factor * measured, ".", color=INK, markersize=4, label="measured, averaged")
    noise = details.estimate.model.noise**2
    if noise > 1e-6 * expected.max():
        axes.axhline(factor * noise, color=ALARM, linewidth=0.8, linestyle="--", label="noise")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(bottom=0.1 * factor * min(measured.min(), expected.min()))
    dimension = "m" if len(one.window.shape) == 1 else "m²"
    axes.set_xlabel("wavenumber (rad/m)")
    prefix = "" if unit == "1" else f"{unit}² "
    axes.set_ylabel(f"spectral density ({prefix}{dimension})")
    axes.legend(fontsize=7, frameon=False)


def _residuals(axes: Any, details: Details, one: Observed, simulated: list[Array]) -> None:
    """Of the spectrum: measured over fitted in bands."""
    k, expected = _columns(one, details.estimate.model.expectation(one) + one.floor)
    _, measured = _columns(one, one.average + one.floor)
    rows = np.array([_columns(one, power + one.floor)[1] for power in simulated])
    _band(axes, k, rows / expected)
    axes.axhline(1.0, color=MODEL)
    axes.plot(k, measured / expected, ".", color=INK, markersize=4)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("wavenumber (rad/m)")
    axes.set_ylabel("measured over fitted spectrum")


def _columns(one: Observed, power: Array) -> tuple[Array, Array]:
    """Wavenumbers of bands, and a periodogram averaged over them."""
    found = np.array(bands(one, power, 4))
    return found[:, 0], found[:, 2]


def _band(axes: Any, at: Array, rows: Array) -> None:
    low, high = np.nanquantile(rows, [0.05, 0.95], axis=0)
    axes.fill_between(at, low, high, color=MODEL, alpha=0.25, linewidth=0.0)

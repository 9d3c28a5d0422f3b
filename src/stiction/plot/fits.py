"""A field fitted to profiles, beside them."""

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stiction.base.units import unit_for
from stiction.base.variables import QUANTITIES
from stiction.inference.estimate import bands
from stiction.inference.fit import FieldFit
from stiction.inference.whittle import Observed, observe
from stiction.plot.axes import with_unit
from stiction.plot.style import (
    ACCENT,
    INK,
    PAGE,
    PALE,
    color,
    panel,
    paper_style,
)

Array = NDArray[np.float64]

SHOWN = 100
"""Repetitions, or simulated records, that a band is drawn from: it holds 90 % of them."""


def fit(found: FieldFit) -> Figure:
    """Draw a fitted random field beside the records.

    Parameters
    ----------
    found : FieldFit
        From `stiction.fit_field`.

    Returns
    -------
    matplotlib.figure.Figure
        (a) Values and the fitted marginal; shaded: 90 % of the fits to records simulated from
        the fitted field. (b) Spectrum, with the effect of the window; shaded: 90 % of such
        records.
    """
    estimate = found._estimate
    windows = estimate.setting.windows
    one = max(observe(found._rows, windows), key=lambda record: record.window.shape[0])
    alike = replace(estimate.setting, windows=(one.window,) * one.records)
    rng, simulator = np.random.default_rng(0), replace(estimate, setting=alike)
    simulated = [
        np.mean([one.window.periodogram(row) for row in simulator.simulate(rng)], axis=0)
        for _ in range(SHOWN)
    ]
    with paper_style():
        figure = Figure(figsize=(PAGE, 2.8))
        left, right = figure.subplots(1, 2)
        _histogram(left, found)
        _spectrum(right, found, one, simulated)
        panel(left, "a")
        panel(right, "b")
    return figure


def _histogram(axes: Axes, found: FieldFit) -> None:
    values = np.concatenate(found._rows)
    factor, unit = unit_for(QUANTITIES[found.quantity].units, values)
    counts, *_ = axes.hist(values * factor, bins=40, density=True, color=PALE, label="measured")
    at = np.linspace(values.min(), values.max(), 400)
    density, *spread = (
        one.marginal.distribution.pdf(at) / factor
        for one in (found.field, *found.repetitions[:SHOWN])
    )
    _band(axes, at * factor, spread)
    noisy = found._estimate.model.noise > 0.05 * found.parameters["standard_deviation"]
    name = "fitted, without the noise" if noisy else "fitted"
    axes.plot(at * factor, density, color=color(1), label=name)
    # A density that is infinite at a bound must not set the scale of the panel.
    axes.set_ylim(0.0, 1.6 * np.max(counts))
    axes.set_xlabel(with_unit(found.quantity.replace("_", " "), unit))
    axes.set_ylabel(f"density (1/{unit})" if unit else "density")
    axes.legend()


def _spectrum(axes: Axes, found: FieldFit, one: Observed, simulated: list[Array]) -> None:
    scale, unit = unit_for(QUANTITIES[found.quantity].units, np.concatenate(found._rows))
    model = found._estimate.model
    factor = float(np.prod(one.window.spacings)) * scale**2
    k, measured, fitted = bands(one, model.expectation(one.window), 4).T
    spread = [factor * bands(one, power, 4)[:, 2] for power in simulated]
    _band(axes, k, spread)
    axes.plot(k, factor * fitted, color=color(1), label="fitted, with the window")
    axes.plot(k, factor * measured, ".", color=INK, markersize=3, label="measured, averaged")
    if model.noise**2 > 1e-6 * fitted.max():
        level = factor * model.noise**2
        axes.axhline(level, label="noise", color=ACCENT, linewidth=0.8, linestyle="--")
    axes.set(xscale="log", yscale="log")
    axes.set_ylim(bottom=0.1 * factor * min(measured.min(), fitted.min()))
    dimension = "m" if len(one.window.shape) == 1 else "m²"
    axes.set_xlabel("wavenumber (rad/m)")
    axes.set_ylabel(f"spectral density ({f'{unit}² ' if unit else ''}{dimension})")
    axes.legend(loc="lower left")  # spectra fall to the right


def _band(axes: Axes, at: Any, rows: Any) -> None:
    low, high = np.nanquantile(rows, [0.05, 0.95], axis=0)
    axes.fill_between(at, low, high, color=color(1), alpha=0.25, linewidth=0.0)

"""Figure 1: the problem in a sketch, and one field with its correlation and density."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Rectangle

from stiction.papers.albertini2020.data import Data
from stiction.plot.style import ACCENT, INK, PAGE, PALE, QUIET, new_figure, panel, series
from stiction.report.tables import Table

name = "problem"
number = "1"
title = "The problem"
needs: tuple[str, ...] = ("monte_carlo", "theory")

SHOWN = 1  # which of the correlation lengths


def caption(data: Data) -> str:
    """What is seen."""
    return (
        "(a) Two elastic half-spaces meet along an interface that is periodic in x; a uniform shear"
        " load rises. (b) The load rises to its critical value and falls to the kinetic level once"
        " sliding has set in (sketch). (c) Strength falls linearly with slip, from a random peak,"
        " at one rate W. (d) One sample of the peak strength at"
        f" \N{GREEK SMALL LETTER XI}\N{SUBSCRIPT ZERO}/h\N{LATIN SUBSCRIPT SMALL LETTER N}"
        f" = {data.ratios[SHOWN]:g}, with the nucleation length for scale; (e) its correlation;"
        " (f) its density (line) and a histogram of this sample."
    )


def tables(data: Data) -> list[Table]:
    """The profile and the correlation that are drawn."""
    ratio = data.ratios[SHOWN]
    x = data.setting.problem.interface.x
    sample = data.at(ratio)["profile_strength"].values
    correlation = data["theory"]["correlation"].sel(correlation_ratio=ratio).values
    return [
        Table.of(
            "figure-1-field",
            f"One field at xi_0/h_n = {ratio:g}, and the correlation of the strength",
            ("x or lag (m)", "tau_p (Pa)", "C(lag)"),
            zip(x, sample, correlation, strict=True),
        )
    ]


def draw(data: Data) -> Figure:
    """Sketches above, the field with correlation and density below."""
    figure = new_figure(PAGE, 4.1)
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.0, 0.95))
    top, bottom = parts
    sketch, history, law = top.subplots(1, 3, width_ratios=(1.5, 1.0, 1.0))
    _sketch(sketch)
    _history(history)
    _law(law)
    field, correlation, probability = bottom.subplots(1, 3, width_ratios=(1.7, 0.9, 0.7))
    _field(field, data)
    _correlation(correlation, data)
    _density(probability, data, field.get_ylim())
    panels = (sketch, history, law, field, correlation, probability)
    for axes, letter in zip(panels, "abcdef", strict=True):
        panel(axes, letter)
    return figure


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], **style: Any) -> None:
    options = {"arrowstyle": "-|>", "mutation_scale": 7, "linewidth": 0.9, "color": INK, **style}
    axes.add_patch(FancyArrowPatch(start, end, shrinkA=0, shrinkB=0, **options))


def _sketch(axes: Axes) -> None:
    axes.set_axis_off()
    axes.set_xlim(-0.14, 1.14)
    axes.set_ylim(-0.2, 1.05)
    for bottom, shade in ((0.5, "#ececec"), (0.0, "#dedede")):
        axes.add_patch(Rectangle((0, bottom), 1.0, 0.5, facecolor=shade, edgecolor="none"))
    axes.plot([0, 1], [0.5, 0.5], color=series(1)["color"], linewidth=2.2)
    for side in (0.0, 1.0):
        axes.plot([side, side], [0, 1], color=QUIET, linewidth=0.8, linestyle=(0, (4, 3)))
    for left in (0.13, 0.42, 0.71):
        _arrow(axes, (left, 0.93), (left + 0.17, 0.93))
        _arrow(axes, (left + 0.17, 0.07), (left, 0.07))
    axes.text(0.5, 0.85, r"$\tau_0(t)$", ha="center", va="top")
    axes.text(0.5, 0.53, r"$\tau_\mathrm{f}(\delta, x)$", ha="center", va="bottom")
    axes.text(0.03, 0.68, r"$G,\,\nu,\,\rho$", ha="left", va="center")
    axes.text(0.03, 0.28, r"$G,\,\nu,\,\rho$", ha="left", va="center")
    _arrow(axes, (0.5, -0.09), (1.0, -0.09), linewidth=0.7)
    _arrow(axes, (0.5, -0.09), (0.0, -0.09), linewidth=0.7)
    gap = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    axes.text(0.5, -0.09, "$L$", ha="center", va="center", bbox=gap)
    _arrow(axes, (1.045, 0.5), (1.13, 0.5), linewidth=0.7)
    axes.text(1.1, 0.45, "$x$", ha="center", va="top")


def _plain(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_xticks([])
    axes.set_yticks([])


def _history(axes: Axes) -> None:
    t = np.linspace(0.0, 1.0, 200)
    axes.plot(t, t, color=INK)
    fall = np.linspace(1.0, 1.18, 60)
    s = (fall - 1.0) / 0.18
    axes.plot(fall, 1.0 - 0.65 * (3 * s**2 - 2 * s**3), color=INK)
    axes.plot([1.18, 1.55], [0.35, 0.35], color=INK)
    axes.plot([1.0], [1.0], "o", color=ACCENT, markersize=4.5)
    axes.set_xlim(0, 1.6)
    axes.set_ylim(0, 1.18)
    for level in (1.0, 0.35):
        axes.axhline(level, color=PALE, linewidth=0.7, zorder=0)
    _plain(axes, "time $t$", r"mean stress $\langle\tau\rangle$")
    axes.set_yticks([0.35, 1.0], [r"$\tau_\mathrm{kin}$", r"$\tau_\mathrm{cr}$"])


def _law(axes: Axes) -> None:
    axes.plot([0, 0, 0.55, 0.95], [0, 0.92, 0.2, 0.2], color=INK)
    for peak in (0.7, 0.81, 1.03):
        critical = (peak - 0.2) * 0.55 / 0.72
        axes.plot([0, critical], [peak, 0.2], color=QUIET, linewidth=0.8, linestyle=(0, (4, 2)))
    axes.set_xlim(0, 0.95)
    axes.set_ylim(0, 1.18)
    axes.plot([0.55, 0.55], [0.0, 0.2], color=PALE, linewidth=0.7, zorder=0)
    axes.plot([0.62, 0.62, 0.76], [0.74, 0.557, 0.557], color=QUIET, linewidth=0.7)
    axes.text(0.6, 0.65, "$W$", ha="right", va="center")
    axes.text(0.69, 0.54, "1", ha="center", va="top", fontsize=7.5)
    axes.text(0.57, 0.02, r"$d_\mathrm{c}(x)$", ha="left", va="bottom")
    _plain(axes, r"slip $\delta$", r"strength $\tau_\mathrm{f}$")
    axes.set_yticks([0.2, 0.92], [r"$\tau_\mathrm{r}$", r"$\tau_\mathrm{p}(x)$"])


def _field(axes: Axes, data: Data) -> None:
    setting, ratio = data.setting, data.ratios[SHOWN]
    interface = setting.problem.interface
    sample = data.relative(data.at(ratio)["profile_strength"].values)
    axes.plot(interface.x / interface.extent, sample, color=series(1)["color"], linewidth=0.9)
    axes.axhline(1.0, color=PALE, linewidth=0.8, zorder=0)
    for bound in setting.bounds:
        if np.isfinite(bound):
            axes.axhline(bound / setting.mean, color=QUIET, linewidth=0.7, linestyle=(0, (4, 3)))
    axes.set_xlim(0, 1)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.16 * (high - low))
    length = setting.problem.nucleation_length / interface.extent
    level = high + 0.05 * (high - low)
    axes.plot(
        [0.04, 0.04 + length], [level, level], color=INK, linewidth=2.0, solid_capstyle="butt"
    )
    axes.text(0.05 + length, level, r"$h_\mathrm{n}$", va="center", ha="left")
    axes.set_xlabel("position $x/L$")
    axes.set_ylabel(r"strength $\tau_\mathrm{p}/\langle\tau_\mathrm{p}\rangle$")


def _correlation(axes: Axes, data: Data) -> None:
    setting, ratio = data.setting, data.ratios[SHOWN]
    xi = setting.spectrum(ratio).correlation_length
    theory = data["theory"].sel(correlation_ratio=ratio)
    lag = setting.problem.interface.x / xi
    seen = lag <= 2.0
    axes.plot(lag[seen], theory["correlation"].values[seen], color=series(1)["color"])
    axes.plot(
        lag[seen], theory["gaussian_correlation"].values[seen], color=INK, linestyle=(0, (1.2, 1.2))
    )
    axes.axhline(np.exp(-1.0), color=PALE, linewidth=0.8, zorder=0)
    axes.text(2.0, np.exp(-1.0) + 0.015, r"$\mathrm{e}^{-1}$", ha="right", va="bottom", color=QUIET)
    axes.text(0.62, 0.86, r"$\tau_\mathrm{p}$ (line)", transform=axes.transAxes, fontsize=7.5)
    axes.text(0.62, 0.74, r"$z$ (dots)", transform=axes.transAxes, fontsize=7.5)
    axes.set_xlim(0, 2)
    axes.set_ylim(min(-0.03, float(theory["correlation"].values[seen].min()) - 0.02), 1.03)
    axes.set_xlabel(r"lag $\xi/\xi_0$")
    axes.set_ylabel(r"correlation $C$")


def _density(axes: Axes, data: Data, limits: tuple[float, float]) -> None:
    setting = data.setting
    y = np.linspace(*limits, 400)
    axes.plot(
        setting.marginal.distribution.pdf(y * setting.mean) * setting.mean,
        y,
        color=INK,
        linewidth=1.0,
    )
    sample = data.relative(data.at(data.ratios[SHOWN])["profile_strength"].values)
    value, edges = np.histogram(sample, bins=18, range=_range(data, sample), density=True)
    axes.stairs(
        value, edges, orientation="horizontal", fill=True, color=series(1)["color"], alpha=0.3
    )
    axes.set_ylim(limits)
    axes.set_xlim(left=0)
    axes.tick_params(labelleft=False)
    axes.set_xlabel(r"density $f(\tau_\mathrm{p})$")


def _range(data: Data, sample: np.ndarray) -> tuple[float, float]:
    """Bounds of the strength where it has them, in units of its mean."""
    low, high = (bound / data.setting.mean for bound in data.setting.bounds)
    return (
        low if np.isfinite(low) else float(sample.min()),
        high if np.isfinite(high) else float(sample.max()),
    )

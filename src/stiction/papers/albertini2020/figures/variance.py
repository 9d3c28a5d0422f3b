"""Figure 7: correlation, eigenfunction, and variance of the nucleation stress."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import variance_ratio
from stiction.plot.style import INK, PAGE, PALE, QUIET, color, new_figure, panel, series
from stiction.report.tables import Table

name = "variance"
number = "7"
title = "Variance of the nucleation stress"
needs: tuple[str, ...] = ("monte_carlo", "theory")


def caption(data: Data) -> str:
    """What is seen."""
    slope = data["theory"].attrs["short_slope"]
    return (
        "(a) Correlation of the strength (lines) and of the Gaussian field behind it (dots) at the"
        " four correlation lengths. (b) First eigenfunction of the elastic problem as the weight"
        " of unit integral, and its printed, rounded form. (c) Variance of the nucleation stress"
        " over that of the strength: exact on this periodic interface (line) and on an infinite one"
        " (dashes), Monte Carlo study (circles; errors are smaller than the symbols). (d) The same"
        " below one nucleation length, with the linear law for short correlation of slope"
        f" {slope:.4f} (dots)."
    )


def tables(data: Data) -> list[Table]:
    """Variance ratios by theory and by Monte Carlo; the whole curve."""
    theory = data["theory"]
    rows = []
    for i, ratio in enumerate(data.ratios):
        found = variance_ratio(data, ratio)
        rows.append((ratio, float(theory["variance_ratio"].values[i]), found.value, found.error))
    curve = zip(
        theory["ratio"].values,
        theory["variance_ratio_periodic"].values,
        theory["variance_ratio_infinite"].values,
        strict=True,
    )
    return [
        Table.of(
            "figure-7-variance",
            "Var[tau_n]/Var[tau_p]",
            ("xi_0/h_n", "exact", "Monte Carlo", "its error"),
            rows,
        ),
        Table.of(
            "figure-7-curve",
            "Var[tau_n]/Var[tau_p] against correlation length",
            ("xi_0/h_n", "on this interface", "on an infinite one"),
            ((float(a), float(b), float(c)) for a, b, c in curve),
        ),
    ]


def draw(data: Data) -> Figure:
    """Correlation and weight above, variance and its zoom below."""
    figure = new_figure(PAGE * 0.82, 4.5)
    (correlation, weight), (whole, zoom) = figure.subplots(2, 2)
    _correlation(correlation, data)
    theory = data["theory"]
    s = theory["s"].values
    weight.plot(s, theory["exact_weight"].values, color=INK, label="exact")
    weight.plot(
        s,
        theory["rounded_weight"].values,
        color=color(2),
        linestyle=(0, (1.2, 1.6)),
        linewidth=1.6,
        label="printed, rounded",
    )
    weight.set_ylim(0, 0.86)
    weight.set_xlim(-1.05, 1.05)
    weight.set_xlabel(r"position $s = 2x/h_\mathrm{n}$")
    weight.set_ylabel(r"weight $v_0(s)\,/\int v_0\,\mathrm{d}s$")
    weight.legend(loc="lower center")
    _variance(whole, data, max(8.0, 2.0 * data.ratios[-1]))
    whole.legend(loc="lower right")
    largest = min(1.0, data.ratios[-1])
    _variance(zoom, data, largest)
    line = np.array([0.0, largest])
    slope = theory.attrs["short_slope"]
    zoom.plot(line, line * slope, color=color(3), linestyle=(0, (1.2, 1.2)), linewidth=1.6)
    inside = theory["variance_ratio_infinite"].values[theory["ratio"].values <= largest]
    zoom.set_ylim(0, 1.2 * float(inside.max()))
    for axes, letter in zip((correlation, weight, whole, zoom), "abcd", strict=True):
        panel(axes, letter)
    return figure


def _correlation(axes: Axes, data: Data) -> None:
    theory, problem = data["theory"], data.setting.problem
    lag = problem.interface.x / problem.nucleation_length
    seen = lag <= 2.0
    for i, ratio in enumerate(data.ratios):
        at = theory.sel(correlation_ratio=ratio)
        axes.plot(
            lag[seen],
            at["correlation"].values[seen],
            label=rf"$\xi_0/h_\mathrm{{n}} = {ratio:g}$",
            **series(i),
        )
        every = slice(None, None, max(int(seen.sum()) // 16, 1))
        axes.plot(
            lag[seen][every],
            at["gaussian_correlation"].values[seen][every],
            ".",
            color=series(i)["color"],
            markersize=3,
        )
    axes.axhline(0.0, color=PALE, linewidth=0.8, zorder=0)
    axes.set_xlim(0, 2)
    axes.set_xlabel(r"lag $\xi/h_\mathrm{n}$")
    axes.set_ylabel(r"correlation $C$")
    axes.legend(loc="upper right")


def _variance(axes: Axes, data: Data, largest: float) -> None:
    theory = data["theory"]
    ratio = np.concatenate(([0.0], theory["ratio"].values))
    infinite = np.concatenate(([0.0], theory["variance_ratio_infinite"].values))
    periodic = theory["variance_ratio_periodic"].values
    axes.axhline(1.0, color=PALE, linewidth=0.8, zorder=0)
    axes.plot(ratio[1:], periodic, color=INK, label="periodic interface")
    axes.plot(ratio, infinite, color=QUIET, linestyle=(0, (4, 1.5)), label="infinite interface")
    shown = [each for each in data.ratios if each <= largest]
    found = [variance_ratio(data, each) for each in shown]
    axes.errorbar(
        shown,
        [each.value for each in found],
        [each.error for each in found],
        fmt="o",
        color=color(2),
        markerfacecolor="white",
        label="Monte Carlo",
        zorder=4,
    )
    axes.set_xlim(0, largest * 1.02)
    axes.set_ylim(0, 1.08)
    axes.set_xlabel(r"correlation length $\xi_0/h_\mathrm{n}$")
    axes.set_ylabel(r"$\mathrm{Var}[\tau_\mathrm{n}]\,/\,\mathrm{Var}[\tau_\mathrm{p}]$")

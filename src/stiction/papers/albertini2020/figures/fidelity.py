"""Beyond the paper: its Monte Carlo study by elastodynamics, and what cheap methods save."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import fidelity
from stiction.plot.style import PAGE, PALE, QUIET, color, marker, new_figure, panel, series
from stiction.report.tables import Table
from stiction.statistics.control_variates import combined_mean, combined_quantiles
from stiction.statistics.densities import density

name = "fidelity"
number = "11"
title = "Monte Carlo study by elastodynamics"
needs: tuple[str, ...] = ("monte_carlo", "interaction", "abundant", "dynamic")

PROBABILITIES = np.array([0.01, 0.05, 0.25, 0.5, 0.75, 0.95])


def caption(data: Data) -> str:
    """What is seen."""
    runs = data["dynamic"].sizes["sample"]
    return (
        f"Not in the paper: {runs:,} elastodynamic ruptures at each correlation length. (a) Density"
        " of tau_cr by elastodynamics (lines) and by the local criterion (thin grey lines). (b)"
        " What inertia and the finite loading rate change: elastodynamics less exact equilibrium"
        " of the same sample, quantiles 5, 25, 50, 75, 95 %. (c) How many times as many ruptures"
        " plain sampling would need for the same error as these, with exact equilibrium of"
        f" {data.samples:,} samples and the local criterion of"
        f" {data['abundant'].sizes['sample']:,} as control variates: for the mean (filled) and"
        " quantiles (open)."
    )


def tables(data: Data) -> list[Table]:
    """Mean and quantiles, plain and with control variates."""
    rows = []
    for ratio in data.ratios:
        dear, *cheap = fidelity(data, ratio)
        best = combined_mean(dear, *cheap)
        plain = (float(dear.mean()), float(dear.std(ddof=1) / np.sqrt(dear.size)))
        rows.append((ratio, "mean", *plain, best.estimate.value, best.estimate.error, best.saving))
        for p, found in zip(
            PROBABILITIES, combined_quantiles(dear, cheap, PROBABILITIES), strict=True
        ):
            rows.append(
                (ratio, f"{100 * p:g} %", float(np.quantile(dear, p)), found.plain_error,
                 found.estimate.value, found.estimate.error, found.saving)
            )  # fmt: skip
    return [
        Table.of(
            "figure-11-fidelity",
            "Critical stress by elastodynamics (Pa)",
            (
                "xi_0/h_n",
                "of",
                "plain",
                "its error",
                "with control variates",
                "its error",
                "saving",
            ),
            rows,
        )
    ]


def draw(data: Data) -> Figure:
    """Densities, differences, savings."""
    figure = new_figure(PAGE, 2.6)
    densities, gaps, savings = figure.subplots(1, 3, width_ratios=(1.3, 1.0, 1.0))
    _densities(densities, data)
    for i, ratio in enumerate(data.ratios):
        dear, *cheap = fidelity(data, ratio)
        gap = 100.0 * (dear / cheap[0][: dear.size] - 1.0)
        q = np.quantile(gap, (0.05, 0.25, 0.5, 0.75, 0.95))
        gaps.plot([i, i], [q[0], q[4]], color=color(i), linewidth=0.9)
        gaps.plot([i, i], [q[1], q[3]], color=color(i), linewidth=5.0, alpha=0.45)
        gaps.plot([i], [q[2]], "_", color=color(i), markersize=9)
        best = combined_mean(dear, *cheap)
        savings.plot([0.0], [best.saving], marker(i), color=color(i), label=f"{ratio:g}")
        several = combined_quantiles(dear, cheap, PROBABILITIES)
        savings.plot(
            1.0 + np.arange(PROBABILITIES.size), [each.saving for each in several],
            marker=marker(i), color=color(i), markerfacecolor="white", linewidth=0.7,
        )  # fmt: skip
    gaps.axhline(0.0, color=PALE, linewidth=0.8, zorder=0)
    gaps.set_xticks(range(len(data.ratios)), [f"{ratio:g}" for ratio in data.ratios])
    gaps.set_xlim(-0.6, len(data.ratios) - 0.4)
    gaps.set_xlabel(r"correlation length $\xi_0/h_\mathrm{n}$")
    gaps.set_ylabel("dynamic less equilibrium (%)")
    savings.set_yscale("log")
    savings.axhline(1.0, color=PALE, linewidth=0.8, zorder=0)
    savings.set_xticks(
        range(1 + PROBABILITIES.size), ["mean", *(f"{100 * p:g}" for p in PROBABILITIES)]
    )
    savings.set_xlabel("quantile (%)")
    savings.set_ylabel("saving (times)")
    for axes, letter in zip((densities, gaps, savings), "abc", strict=True):
        panel(axes, letter)
    return figure


def _densities(axes: Axes, data: Data) -> None:
    low, high = (bound / data.setting.mean for bound in data.setting.bounds)
    bounds = (low if np.isfinite(low) else None, high if np.isfinite(high) else None)
    for i, ratio in enumerate(data.ratios):
        dear, *_ = fidelity(data, ratio)
        local = data.at(ratio)["critical_stress"].values
        for values, style in (
            (local, {"color": QUIET, "linewidth": 0.7}),
            (dear, {**series(i), "label": f"{ratio:g}"}),
        ):
            estimate = density(data.relative(values), bounds=bounds)
            keep = estimate.value > 4e-3 * estimate.value.max()
            axes.plot(estimate.x[keep], estimate.value[keep], **style)
    axes.set_ylim(bottom=0)
    axes.set_xlabel(r"critical stress $\tau_\mathrm{cr}/\langle\tau_\mathrm{p}\rangle$")
    axes.set_ylabel(r"density $f(\tau_\mathrm{cr})$")
    axes.legend(title=r"$\xi_0/h_\mathrm{n}$", title_fontsize=7.5)

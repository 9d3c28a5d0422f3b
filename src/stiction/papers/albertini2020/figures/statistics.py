"""Figure 6: nucleation stress and critical stress against correlation length, with limits."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import dynamic_mean
from stiction.plot.style import ACCENT, INK, PAGE, QUIET, color, new_figure, panel
from stiction.report.tables import Table
from stiction.statistics.estimates import mean
from stiction.statistics.quantiles import quantiles

name = "statistics"
number = "6"
title = "Statistics against correlation length"
needs: tuple[str, ...] = ("monte_carlo", "theory", "trend", "window")
may_show = ("ruptures", "interaction")

PROBABILITIES = (0.25, 0.5, 0.75)


_DYNAMIC = (
    " Diamonds in (b): mean of the elastodynamic ruptures of Figure 4 with two standard errors to"
    " either side; dashes: the same with exact equilibrium of all samples as control variate, known"
    " to a hundredth of that; the inset enlarges the shortest lengths."
)


def caption(data: Data) -> str:
    """What is seen."""
    return (
        "Mean, median and quartiles of (a) the nucleation stress at a point and (b) the critical"
        " stress, against the correlation length. Filled symbols and lines: Monte Carlo study,"
        f" {data.samples:,} samples each. Thin lines in (b): side study over a wider range at fixed"
        " interface length."
        f"{_DYNAMIC if 'ruptures' in data.studies else ''}"
        " Squares at the left edge: limit of vanishing correlation length."
        " Bars at the right edge: quartiles and median in the limit of long correlation with the"
        " interface as many correlation lengths long as at the last point: in (a) those of the"
        " strength at a point, in (b) those of its minimum. (c) The same critical stress when the"
        " interface keeps its length, far beyond the paper's range: without the mean mode, as in"
        " the paper, and with it, the trend turns."
    )


def tables(data: Data) -> list[Table]:
    """What is drawn in (a), (b) and (c)."""
    rows = []
    for key, label in (("tau_n", "tau_n"), ("critical_stress", "tau_cr")):
        for ratio in data.ratios:
            mean, low, middle, high = _numbers(data, ratio, key)
            rows.append((ratio, label, mean, low, middle, high))
    trend = data["trend"]
    wide = [
        (
            float(ratio),
            bool(mode),
            *(
                float(trend[key].sel(ratio=ratio, mean_mode=mode))
                for key in ("mean", "mean_error", "standard_deviation", "standard_deviation_error")
            ),
        )
        for mode in trend["mean_mode"].values
        for ratio in trend["ratio"].values
    ]
    window = data["window"]
    vanishing = [
        (
            float(ratio),
            *(
                float(window[key].sel(ratio=ratio))
                for key in ("mean", "standard_deviation", "excess", "distance")
            ),
        )
        for ratio in window["ratio"].values
    ]
    return [
        Table.of(
            "figure-6-statistics",
            "Mean and quartiles (Pa)",
            ("xi_0/h_n", "of", "mean", "25 %", "median", "75 %"),
            rows,
        ),
        Table.of(
            "figure-6-trend",
            "Critical stress at fixed interface length (Pa)",
            ("xi_0/h_n", "mean mode", "mean", "its error", "standard deviation", "its error"),
            wide,
        ),
        Table.of(
            "figure-6-vanishing-window",
            "The same field, ever smaller h_n: critical stress against min tau_p (Pa)",
            ("xi_0/h_n", "mean", "standard deviation", "mean above min tau_p", "KS distance"),
            vanishing,
        ),
    ]


def _numbers(data: Data, ratio: float, key: str) -> tuple[float, float, float, float]:
    """Mean and quartiles, Pa."""
    at = data.at(ratio)
    if key == "critical_stress":
        values = at[key].values
        low, middle, high = (float(v) for v in quantiles(values, PROBABILITIES).value)
        return float(values.mean()), low, middle, high
    counts = at["nucleation_counts"].values.astype(float)
    edges = np.linspace(float(at["nucleation_low"]), float(at["nucleation_high"]), counts.size + 1)
    share = np.concatenate(([0.0], np.cumsum(counts) / counts.sum()))
    low, middle, high = (float(v) for v in np.interp(PROBABILITIES, share, edges))
    mean = float(np.sum(counts * 0.5 * (edges[1:] + edges[:-1])) / counts.sum())
    return mean, low, middle, high


def draw(data: Data) -> Figure:
    """Nucleation stress, critical stress and the wider range, side by side."""
    figure = new_figure(PAGE, 2.9)
    nucleation, critical, wide = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 1.1))
    setting = data.setting
    _series(nucleation, data, "tau_n", 1)
    nucleation.set_ylabel(r"nucleation stress $\tau_\mathrm{n}/\langle\tau_\mathrm{p}\rangle$")
    quartiles = data.relative(setting.marginal.distribution.ppf(PROBABILITIES))
    _long_limit(nucleation, quartiles, 1, r"$\tau_\mathrm{p}$")
    _series(critical, data, "critical_stress", 2)
    critical.set_ylabel(r"critical stress $\tau_\mathrm{cr}/\langle\tau_\mathrm{p}\rangle$")
    weakest = data.relative(data["window"]["weakest_quantile_value"].values[1:4])
    _long_limit(critical, weakest, 2, r"$\min\tau_\mathrm{p}$")
    _short_side(critical, data)
    if "ruptures" in data.studies:
        _dynamic(critical, data)
        _inset(critical, data)
    critical.legend(loc="upper right", fontsize=6.2, labelspacing=0.25)
    for axes in (nucleation, critical):
        if np.isfinite(setting.bounds[0]):
            _bound(axes, setting.bounds[0] / setting.mean)
    _wide(wide, data)
    for axes, letter in zip((nucleation, critical, wide), "abc", strict=True):
        panel(axes, letter)
    return figure


def _dynamic(axes: Axes, data: Data, label: str = "simulations, mean") -> None:
    """Means over the ruptures, and with equilibrium of all samples as control variate."""
    runs, ratios = data["ruptures"], data.setting.simulated_ratios
    plain = [
        mean(data.relative(runs["critical_stress"].sel(correlation_ratio=ratio).values))
        for ratio in ratios
    ]
    axes.errorbar(
        ratios, [each.value for each in plain], [2.0 * each.error for each in plain], fmt="D",
        color=INK, markerfacecolor="white", markersize=3.6, capsize=2.0, linewidth=0.8, label=label,
        zorder=6,
    )  # fmt: skip
    known = [ratio for ratio in ratios if ratio in data.ratios]
    if "interaction" not in data.studies or runs.sizes["sample"] < 3 or not known:
        return
    best = [dynamic_mean(data, ratio).estimate for ratio in known]
    axes.plot(
        known, data.relative(np.array([each.value for each in best])), "_", color=ACCENT,
        markersize=8, markeredgewidth=1.4, label="with control variates", zorder=7,
    )  # fmt: skip


def _inset(axes: Axes, data: Data) -> None:
    """Enlarged means: how much lower simulations are at the shortest correlation length."""
    ratios = np.array(data.ratios)
    inset = axes.inset_axes((0.40, 0.30, 0.56, 0.34))
    means = data.relative(np.array([_numbers(data, r, "critical_stress")[0] for r in ratios]))
    inset.plot(ratios, means, color=color(2), marker="o", markersize=2.6, linewidth=0.9)
    _dynamic(inset, data)
    inset.set_xscale("log")
    inset.set_xlim(0.2, 0.65)
    shown = means[(ratios >= 0.2) & (ratios <= 0.65)]
    if shown.size:
        inset.set_ylim(shown.min() - 0.012, shown.max() + 0.012)
    inset.set_xticks([0.25, 0.5], ["0.25", "0.5"])
    inset.minorticks_off()
    inset.tick_params(labelsize=6.0, length=2)


_ZERO, _INFINITY = 0.6, 1.6
"""Where the limits stand, as factors of the first and last correlation length."""


def _series(axes: Axes, data: Data, key: str, index: int) -> None:
    ratios = np.array(data.ratios)
    numbers = data.relative(np.array([_numbers(data, ratio, key) for ratio in ratios]))
    shade = color(index)
    axes.fill_between(ratios, numbers[:, 1], numbers[:, 3], color=shade, alpha=0.18, linewidth=0)
    for column, dashes in ((1, (0, (4, 2))), (3, (0, (4, 2)))):
        axes.plot(ratios, numbers[:, column], color=shade, linestyle=dashes, linewidth=0.8)
    axes.plot(ratios, numbers[:, 0], color=shade, marker="o", label="mean")
    axes.plot(
        ratios, numbers[:, 2], color=shade, linestyle=(0, (1.2, 1.2)), marker="x", label="median"
    )
    axes.plot([], [], color=shade, linestyle=(0, (4, 2)), linewidth=0.8, label="quartiles")
    axes.set_xscale("log")
    left, right = ratios[0] * _ZERO, ratios[-1] * _INFINITY
    axes.plot([left], [1.0], "s", color=INK, clip_on=False, zorder=5)
    if key == "tau_n":
        for column in (0, 1, 3):
            axes.plot(
                [left, ratios[0]],
                [1.0, numbers[0, column]],
                color=QUIET,
                linewidth=0.7,
                linestyle=(0, (2, 2)),
            )
    axes.set_xlim(left * 0.85, right * 1.25)
    axes.set_xticks([left, *ratios, right], ["0", *(f"{ratio:g}" for ratio in ratios), r"$\infty$"])
    axes.minorticks_off()
    axes.set_xlabel(r"correlation length $\xi_0/h_\mathrm{n}$")
    if key == "critical_stress":
        axes.legend(loc="upper right")


def _short_side(axes: Axes, data: Data) -> None:
    # Between zero and the first point the side study shows how slowly the limit is reached.
    trend = data["trend"].sel(mean_mode=int(data.setting.mean_mode))
    first = data.ratios[0]
    ratio = trend["ratio"].values
    short = ratio <= first * 1.001
    if short.sum() < 2:
        return
    left = first * _ZERO
    place = left * (first / left) ** (ratio[short] / first)
    mean = data.relative(trend["mean"].values[short])
    axes.plot(
        np.concatenate(([left], place)),
        np.concatenate(([1.0], mean)),
        color=QUIET,
        linewidth=0.8,
        linestyle=(0, (2, 2)),
    )


def _long_limit(axes: Axes, quartiles: Any, index: int, text: str) -> None:
    right = axes.get_xlim()[1] / 1.25
    low, middle, high = quartiles
    axes.plot([right, right], [low, high], color=color(index), linewidth=3.0, alpha=0.5)
    axes.plot([right], [middle], "x", color=color(index))
    axes.text(right, high + 0.012, text, ha="center", va="bottom", fontsize=7.5)


def _bound(axes: Axes, bound: float) -> None:
    axes.axhline(bound, color=QUIET, linewidth=0.7, linestyle=(0, (4, 3)), zorder=0)


def _wide(axes: Axes, data: Data) -> None:
    trend = data["trend"]
    for mode, shade, dashes, symbol, label in (
        (0, color(2), "-", "o", "no mean mode (paper)"),
        (1, color(0), (0, (4, 1.5)), "s", "with mean mode"),
    ):
        chosen = trend.sel(mean_mode=mode)
        mean = data.relative(chosen["mean"].values)
        spread = data.relative(chosen["standard_deviation"].values)
        axes.fill_between(
            chosen["ratio"].values,
            mean - spread,
            mean + spread,
            color=shade,
            alpha=0.12,
            linewidth=0,
        )
        axes.plot(
            chosen["ratio"].values,
            mean,
            color=shade,
            linestyle=dashes,
            marker=symbol,
            markersize=3.2,
            label=label,
        )
    axes.axvspan(data.ratios[0], data.ratios[-1], color=ACCENT, alpha=0.06, linewidth=0)
    axes.text(
        np.sqrt(data.ratios[0] * data.ratios[-1]),
        0.02,
        "paper",
        transform=axes.get_xaxis_transform(),
        ha="center",
        va="bottom",
        fontsize=7.5,
        color=QUIET,
    )
    axes.set_xscale("log")
    axes.set_xticks([0.1, 1.0, 10.0], ["0.1", "1", "10"])
    axes.set_xlabel(r"correlation length $\xi_0/h_\mathrm{n}$, fixed $L$")
    axes.set_ylabel(r"mean $\tau_\mathrm{cr}/\langle\tau_\mathrm{p}\rangle$, $\pm$ st. dev.")
    axes.legend(loc="upper center", handlelength=2.2)
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.08 * (high - low), high + 0.22 * (high - low))

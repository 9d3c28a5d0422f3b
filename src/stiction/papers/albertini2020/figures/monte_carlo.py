"""Figure 5: strength and nucleation stress of the same draws, and the densities behind them."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.plot.style import INK, PAGE, PALE, QUIET, new_figure, panel, series
from stiction.report.tables import Table
from stiction.statistics.densities import Density, density, density_of_counts
from stiction.statistics.quantiles import quantiles

name = "mc"
number = "5"
title = "Monte Carlo study"
needs: tuple[str, ...] = ("monte_carlo", "theory")

BINS = 20
SMOOTHING = 1.8
"""On the bandwidth of f(tau_cr): the best one for the whole still shows noise at its top."""


def caption(data: Data) -> str:
    """What is seen."""
    ratio = ", ".join(f"{ratio:g}" for ratio in data.ratios)
    return (
        "(a) Peak strength of one and the same draws at correlation lengths of"
        f" {ratio} times the nucleation length, (b) its density, the same for all, and (c) the"
        " density of the weakest point of each sample, on an enlarged axis. (d) Nucleation stress"
        " of the samples in (a) and (e) its density."
        " (f) Density of the critical stress. (g) Density of the position of onset with its"
        f" 95 % interval for a uniform one. {data.samples:,} samples each. Densities by the"
        " diffusion estimator (Botev et al., 2010) with no flux through the bounds of the strength"
        " (dashed), that of the critical stress with 1.8 times its bandwidth; the shade is two"
        " standard errors to either side. The same draws serve all correlation lengths."
    )


def tables(data: Data) -> list[Table]:
    """Quantiles of all that is shown, and the densities."""
    rows = []
    for ratio in data.ratios:
        at = data.at(ratio)
        for label, key in (
            ("min tau_p", "weakest_strength"),
            ("tau_cr", "critical_stress"),
            ("max tau_n", "largest_nucleation_stress"),
        ):
            q = quantiles(at[key].values, (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99))
            rows += [
                (ratio, label, float(p), float(v), float(a), float(b))
                for p, v, a, b in zip(q.probability, q.value, q.lower, q.upper, strict=True)
            ]
    return [
        Table.of(
            "figure-5-quantiles",
            "Quantiles with 95 % confidence intervals from order statistics",
            ("xi_0/h_n", "of", "probability", "value (Pa)", "lower (Pa)", "upper (Pa)"),
            rows,
        ),
        _density_table(data),
    ]


def _density_table(data: Data) -> Table:
    rows = []
    for ratio in data.ratios:
        for label, estimate in _densities(data, ratio).items():
            keep = np.flatnonzero(estimate.value > 1e-3 * estimate.value.max())
            for i in keep[:: max(keep.size // 60, 1)]:
                numbers = (estimate.x[i], estimate.value[i], estimate.error[i])
                rows.append((ratio, label, *(float(number) for number in numbers)))
    return Table.of(
        "figure-5-densities",
        "Densities, in units of the mean strength",
        ("xi_0/h_n", "of", "stress/<tau_p>", "density", "standard error"),
        rows,
    )


def _densities(data: Data, ratio: float) -> dict[str, Density]:
    """Densities of min tau_p, tau_n and tau_cr in units of the mean strength."""
    setting, at = data.setting, data.at(ratio)
    low, high = (bound / setting.mean if np.isfinite(bound) else None for bound in setting.bounds)
    # Points of tau_n closer than half a nucleation length tell the same.
    lengths = setting.problem.interface.extent / setting.problem.nucleation_length
    return {
        "min tau_p": density(data.relative(at["weakest_strength"].values), bounds=(low, high)),
        "tau_n": density_of_counts(
            at["nucleation_counts"].values,
            float(at["nucleation_low"]) / setting.mean,
            float(at["nucleation_high"]) / setting.mean,
            effective=data.samples * min(lengths, float(data["monte_carlo"].attrs["stations"])),
        ),
        "tau_cr": density(
            data.relative(at["critical_stress"].values), bounds=(low, high), smoothing=SMOOTHING
        ),
    }


def _label(ratio: float) -> str:
    return rf"$\xi_0/h_\mathrm{{n}} = {ratio:g}$"


def draw(data: Data) -> Figure:
    """Profiles on the left, densities beside them, onset below."""
    figure = new_figure(PAGE, 6.3)
    parts: Any = figure.subfigures(2, 1, height_ratios=(2.0, 0.95))
    upper, lower = parts
    grid = upper.subplots(2, 3, width_ratios=(2.5, 0.8, 0.8))
    densities = {ratio: _densities(data, ratio) for ratio in data.ratios}
    limits = _limits(data)
    profile, marginal, weakest = grid[0]
    nucleation, point, legend = grid[1]
    _profiles(profile, data, "profile_strength", limits)
    profile.set_ylabel(r"strength $\tau_\mathrm{p}/\langle\tau_\mathrm{p}\rangle$")
    _profiles(nucleation, data, "profile_nucleation_stress", limits)
    nucleation.set_ylabel(r"nucleation stress $\tau_\mathrm{n}/\langle\tau_\mathrm{p}\rangle$")
    nucleation.set_xlabel("position $x/L$")
    _marginal(marginal, data, limits)
    marginal.set_xlabel(r"$f(\tau_\mathrm{p})$")
    for axes, key in ((weakest, "min tau_p"), (point, "tau_n")):
        for i, ratio in enumerate(data.ratios):
            _line(axes, densities[ratio][key], series(i), upright=True)
        axes.set_xlim(left=0)
    _beside(point, limits)
    _enlarged(weakest, [densities[ratio]["min tau_p"] for ratio in data.ratios])
    if np.isfinite(data.setting.bounds[0]):
        _dashed(weakest, data.setting.bounds[0] / data.setting.mean)
    weakest.set_xlabel(r"$f(\min \tau_\mathrm{p})$")
    point.set_xlabel(r"$f(\tau_\mathrm{n})$")
    legend.set_axis_off()
    for i, ratio in enumerate(data.ratios):
        legend.plot([], [], label=_label(ratio), **series(i))
    legend.legend(loc="center", handlelength=3.2)
    critical, position = lower.subplots(1, 2, width_ratios=(1.35, 1.0))
    for i, ratio in enumerate(data.ratios):
        _line(critical, densities[ratio]["tau_cr"], series(i), upright=False)
    low = data.setting.bounds[0]
    if np.isfinite(low):
        critical.axvline(low / data.setting.mean, color=QUIET, linewidth=0.7, linestyle=(0, (4, 3)))
    _frame(critical, [densities[ratio]["tau_cr"] for ratio in data.ratios])
    critical.set_ylim(bottom=0)
    critical.set_xlabel(r"critical stress $\tau_\mathrm{cr}/\langle\tau_\mathrm{p}\rangle$")
    critical.set_ylabel(r"$f(\tau_\mathrm{cr})$")
    _positions(position, data)
    for axes, letter in zip(
        (profile, marginal, weakest, nucleation, point, critical, position), "abcdefg", strict=True
    ):
        panel(axes, letter)
    return figure


def _limits(data: Data) -> tuple[float, float]:
    shown = data.relative(data["monte_carlo"]["profile_strength"].values)
    low, high = (bound / data.setting.mean for bound in data.setting.bounds)
    low = low if np.isfinite(low) else float(shown.min())
    high = high if np.isfinite(high) else float(shown.max())
    return low - 0.04 * (high - low), high + 0.04 * (high - low)


def _profiles(axes: Axes, data: Data, key: str, limits: tuple[float, float]) -> None:
    interface = data.setting.problem.interface
    for i, ratio in enumerate(data.ratios):
        values = data.relative(data.at(ratio)[key].values)
        axes.plot(interface.x / interface.extent, values, linewidth=0.9, **series(i))
    axes.axhline(1.0, color=PALE, linewidth=0.8, zorder=0)
    for bound in data.setting.bounds:
        if np.isfinite(bound):
            _dashed(axes, bound / data.setting.mean)
    axes.set_xlim(0, 1)
    axes.set_ylim(limits)


def _dashed(axes: Axes, level: float) -> None:
    axes.axhline(level, color=QUIET, linewidth=0.7, linestyle=(0, (4, 3)), zorder=0)


def _enlarged(axes: Axes, estimates: list[Density]) -> None:
    """An axis of its own: minima crowd within a few per cent of the bound."""
    low, high = _extent(estimates, 0.03)
    axes.set_ylim(low - 0.08 * (high - low), high)
    axes.yaxis.tick_right()
    axes.spines["right"].set_visible(True)
    axes.spines["left"].set_visible(False)


def _beside(axes: Axes, limits: tuple[float, float]) -> None:
    axes.set_ylim(limits)
    axes.tick_params(labelleft=False)


def _marginal(axes: Axes, data: Data, limits: tuple[float, float]) -> None:
    y = np.linspace(*limits, 400)
    mean = data.setting.mean
    axes.plot(data.setting.marginal.distribution.pdf(y * mean) * mean, y, color=INK)
    axes.set_xlim(left=0)
    _beside(axes, limits)


def _line(axes: Axes, estimate: Density, style: dict[str, Any], *, upright: bool) -> None:
    keep = estimate.value > 1e-4 * estimate.value.max()
    keep = keep & (np.arange(keep.size) % max(int(keep.sum()) // 600, 1) == 0)
    x, value, error = estimate.x[keep], estimate.value[keep], 2.0 * estimate.error[keep]
    shade = {"color": style["color"], "alpha": 0.25, "linewidth": 0}
    if upright:
        axes.fill_betweenx(x, value - error, value + error, **shade)
        axes.plot(value, x, **style)
    else:
        axes.fill_between(x, value - error, value + error, **shade)
        axes.plot(x, value, **style)


def _frame(axes: Axes, estimates: list[Density]) -> None:
    low, high = _extent(estimates, 4e-3)
    axes.set_xlim(low - 0.05 * (high - low), high + 0.02 * (high - low))


def _extent(estimates: list[Density], share: float) -> tuple[float, float]:
    """Where any of the densities is above `share` of its largest value."""
    shown = [estimate.x[estimate.value > share * estimate.value.max()] for estimate in estimates]
    return min(float(x.min()) for x in shown), max(float(x.max()) for x in shown)


def _positions(axes: Axes, data: Data) -> None:
    length = data.setting.problem.interface.extent
    edges = np.linspace(0.0, 1.0, BINS + 1)
    spread = 1.96 * np.sqrt(BINS * (1.0 - 1.0 / BINS) / data.samples)
    axes.axhspan(1.0 - spread, 1.0 + spread, color=PALE, zorder=0, linewidth=0)
    largest = 1.0
    for i, ratio in enumerate(data.ratios):
        where = data.at(ratio)["critical_position"].values / length
        value, _ = np.histogram(where, edges, density=True)
        largest = max(largest, float(value.max()))
        axes.stairs(value, edges, baseline=None, linewidth=1.1, **_stair(i))
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1.25 * largest)
    axes.set_xlabel(r"position of onset $x_\mathrm{cr}/L$")
    axes.set_ylabel(r"$f(x_\mathrm{cr})\,L$")


def _stair(index: int) -> dict[str, Any]:
    style = series(index)
    return {"color": style["color"], "linestyle": style["linestyle"]}
